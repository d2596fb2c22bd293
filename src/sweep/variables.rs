//! The effect of a plan's variables on a scenario.

use serde::Serialize;

use crate::error::{Error, KeyPath, error};
use crate::plan::{Design, Plan, Vary, Vehicles, What};
use crate::scenario::{self, InterfaceSpeed, Scenario};
use crate::unit::{LengthText, MassText, SignedSpeedText};

/// One column of varied values.
pub(crate) struct Variable {
    /// Name of its column.
    pub column: String,
    target: Target,
    /// Values multiply what is there.
    factor: bool,
    /// Names that its values are indices of; none if they are numbers.
    pub names: Vec<String>,
}

impl Variable {
    /// The curve whose gap it is.
    pub(super) fn gap_of(&self) -> Option<&str> {
        match &self.target {
            Target::CurveGap(curve) => Some(curve),
            _ => None,
        }
    }

    /// Whether its values stand in place of those of one before it.
    fn replaces(&self, before: &Self) -> bool {
        !self.factor
            && match (&self.target, &before.target) {
                (Target::Speed(one), Target::Speed(other)) => one == other,
                (Target::Mass(some), Target::Mass(others)) => {
                    some.iter().any(|place| others.contains(place))
                }
                (Target::ContactGap, Target::ContactGap) => true,
                (Target::CurveGap(one), Target::CurveGap(other)) => one == other,
                _ => false,
            }
    }
}

enum Target {
    /// Train by number.
    Speed(usize),
    /// Vehicles by the numbers of train and vehicle.
    Mass(Vec<(usize, usize)>),
    ContactGap,
    CurveGap(String),
    Band(String),
    Force(String),
    /// Everything that has this curve gets another.
    Curve(String),
}

/// A variable for people to look at.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct VariableSummary {
    /// Name of its column.
    pub column: String,
    /// Values along the grid; `None` of a distribution.
    pub values: Option<u64>,
}

/// The variables of a plan, in order of their columns, and its design.
pub(crate) fn bind(plan: &Plan, scenario: &Scenario) -> Result<(Vec<Variable>, Design), Error> {
    if plan.vary.is_empty() {
        return Err(error!(Sweep, "[sweep] varies nothing: add [[sweep.vary]]"));
    }
    for vehicle in scenario.train.iter().flat_map(|train| &train.vehicles) {
        check_name("", &vehicle.name)?;
    }
    let (mut variables, mut spreads) = (Vec::new(), Vec::new());
    for (k, vary) in plan.vary.iter().enumerate() {
        let named = |fault: Error| {
            let name = format!("sweep.vary {} ({})", k + 1, vary.what.name());
            fault.of(name).inside(KeyPath::of("vary").item(k))
        };
        let bound = Binder { vary, scenario, plan }.variables().map_err(named)?;
        let spread = vary.spread().map_err(named)?;
        for variable in bound {
            if variables.iter().any(|v: &Variable| v.column == variable.column) {
                return Err(named(error!(Sweep, "{} is varied twice", variable.column)));
            }
            if let Some(before) = variables.iter().find(|v| variable.replaces(v)) {
                return Err(named(error!(
                    Sweep,
                    "{} would replace what {} has set: vary each quantity once (of several vehicles name the others), or by a factor behind its values",
                    variable.column,
                    before.column
                )));
            }
            variables.push(variable);
            spreads.push(spread.clone());
        }
    }
    let design = plan.design(spreads)?;
    Ok((variables, design))
}

struct Binder<'a> {
    vary: &'a Vary,
    scenario: &'a Scenario,
    plan: &'a Plan,
}

impl Binder<'_> {
    fn variables(&self) -> Result<Vec<Variable>, Error> {
        let vary = self.vary;
        self.only_own_keys()?;
        match vary.what {
            What::Speed => {
                let trains = &self.scenario.train;
                let name = vary
                    .train
                    .as_deref()
                    .ok_or_else(|| error!(Sweep, "name the train: train = \"…\""))?;
                let known = trains.iter().map(|t| t.name.as_str());
                let at = known.clone().position(|t| t == name);
                let at = at.ok_or_else(|| unknown("train", "train", name, known))?;
                let has_value = |v: &Vary| {
                    v.what == What::Speed && !v.factor && v.train.as_deref() == Some(name)
                };
                let stands = trains[at].speed.0 == 0.0;
                if vary.factor && stands && !self.plan.vary.iter().any(has_value) {
                    return Err(error!(
                        Sweep at "factor",
                        "train \"{name}\" stands, so a factor on its speed has no effect: give speeds instead"
                    ));
                }
                self.one("speed_m_per_s", "speed_factor", name, Target::Speed(at))
            }
            What::Mass => self.masses(),
            What::Gap => self.gaps(),
            What::Band => {
                let curve = self.curve()?;
                let table = &self.scenario.curves[curve];
                let is_json = |p: &std::path::PathBuf| p.extension().is_some_and(|e| e == "json");
                if table.model.is_none() && !table.file.as_ref().is_some_and(is_json) {
                    return Err(error!(
                        Sweep at "curve",
                        "curve \"{curve}\" has no band: only a model and a predicted curve (.json) have one"
                    ));
                }
                // An end of a vehicle and a law with a rate have none.
                let mut banded = self.scenario.clone();
                banded.curves.entry(curve.into()).and_modify(|table| table.band = Some(0.0));
                if let Err(error) = banded.check() {
                    return Err(error!(Sweep at "curve", "{}", error.message()));
                }
                self.refuse_if_replaced(curve)?;
                self.one("band", "band", curve, Target::Band(curve.into()))
            }
            What::Force => {
                let curve = self.curve()?;
                self.refuse_if_replaced(curve)?;
                self.one("force_factor", "force_factor", curve, Target::Force(curve.into()))
            }
            What::Curve => {
                let curve = self.curve()?;
                for value in vary.values.iter().flatten() {
                    check_name("values", &value.0)?;
                    self.known_curve("values", &value.0)?;
                }
                self.one("curve", "curve", curve, Target::Curve(curve.into()))
            }
        }
    }

    /// Refuses to vary a curve that the plan replaces in every item.
    fn refuse_if_replaced(&self, curve: &str) -> Result<(), Error> {
        let is_replaced = |v: &Vary| v.what == What::Curve && v.curve.as_deref() == Some(curve);
        if self.plan.vary.iter().any(is_replaced) && !self.replaces(curve) {
            return Err(error!(
                Sweep at "curve",
                "another variable replaces curve \"{curve}\" in every item, so this one has no effect: name the curve among the values of that variable, or vary those curves"
            ));
        }
        Ok(())
    }

    /// Whether the plan puts a curve in place of others.
    fn replaces(&self, curve: &str) -> bool {
        let replaces = |v: &Vary| {
            v.what == What::Curve && v.values.iter().flatten().any(|value| value.0 == curve)
        };
        self.plan.vary.iter().any(replaces)
    }

    fn gaps(&self) -> Result<Vec<Variable>, Error> {
        let vary = self.vary;
        match (&vary.curve, vary.interface.as_deref()) {
            (Some(curve), None) => {
                self.check_curve(curve)?;
                let mut vehicles = self.scenario.train.iter().flat_map(|t| &t.vehicles);
                if vehicles.any(|v| v.zones().any(|zone| zone.curve == *curve)) {
                    return Err(error!(
                        Sweep at "curve",
                        "curve \"{curve}\" joins a crush zone to its body, where there is no gap"
                    ));
                }
                if vary.factor && self.scenario.curves[curve].gap.is_none() {
                    return Err(error!(
                        Sweep at "factor",
                        "curve \"{curve}\" has no gap that a factor could change"
                    ));
                }
                if !self.replaces(curve) && !scenario::takes_gap_of(self.scenario, curve)?.0 {
                    return Err(error!(
                        Sweep at "curve",
                        "where curve \"{curve}\" is used, the contact, a train or a vehicle has its own gap, so that of the curve has no effect: remove these (for the contact, vary interface = \"contact\")"
                    ));
                }
                self.one("gap_m", "gap_factor", curve, Target::CurveGap(curve.clone()))
            }
            (None, Some("contact")) => {
                if vary.factor && self.scenario.contact.gap.is_none() {
                    return Err(error!(
                        Sweep at "factor",
                        "the contact has no gap that a factor could change"
                    ));
                }
                self.one("gap_m", "gap_factor", "contact", Target::ContactGap)
            }
            (None, Some(other)) => Err(error!(
                Sweep at "interface",
                "interface = \"{other}\": expected \"contact\"; gaps inside a train are those of its curve"
            )),
            _ => Err(error!(Sweep, "give curve = \"…\" or interface = \"contact\"")),
        }
    }

    /// Refuses keys of other kinds of variables.
    fn only_own_keys(&self) -> Result<(), Error> {
        let vary = self.vary;
        let keys = [
            ("train", vary.train.is_some(), vary.what == What::Speed),
            ("vehicle", vary.vehicle.is_some(), vary.what == What::Mass),
            ("vehicles", vary.vehicles.is_some(), vary.what == What::Mass),
            ("each", vary.each, vary.what == What::Mass),
            ("interface", vary.interface.is_some(), vary.what == What::Gap),
            ("curve", vary.curve.is_some(), !matches!(vary.what, What::Speed | What::Mass)),
            ("factor", vary.factor, matches!(vary.what, What::Speed | What::Mass | What::Gap)),
        ];
        match keys.iter().find(|(_, given, own)| *given && !own) {
            Some((key, ..)) => {
                Err(error!(Sweep at key, "{key} does not go with what = \"{}\"", vary.what.name())
                    .itself())
            }
            None => Ok(()),
        }
    }

    fn masses(&self) -> Result<Vec<Variable>, Error> {
        let vehicles = || {
            let trains = self.scenario.train.iter().enumerate();
            trains.flat_map(|(t, train)| {
                train.vehicles.iter().enumerate().map(move |(v, vehicle)| ((t, v), &*vehicle.name))
            })
        };
        let find = |name: &str| {
            let found = vehicles().find(|(_, n)| *n == name).map(|(place, _)| place);
            found.ok_or_else(|| {
                unknown(
                    if self.vary.vehicles.is_some() { "vehicles" } else { "vehicle" },
                    "vehicle",
                    name,
                    vehicles().map(|(_, n)| n),
                )
            })
        };
        let named: Vec<(&str, (usize, usize))> = match (&self.vary.vehicle, &self.vary.vehicles) {
            (Some(name), None) => vec![(name, find(name)?)],
            (None, Some(Vehicles::Word(word))) if word == "all" => {
                vehicles().map(|(place, name)| (name, place)).collect()
            }
            (None, Some(Vehicles::Word(word))) => {
                return Err(error!(
                    Sweep at "vehicles",
                    "vehicles = \"{word}\": expected a list, or \"all\""
                ));
            }
            (None, Some(Vehicles::List(names))) if !names.is_empty() => {
                let places: Result<Vec<_>, Error> =
                    names.iter().map(|name| Ok((name.as_str(), find(name)?))).collect();
                places?
            }
            _ => return Err(error!(Sweep, "give vehicle = \"…\", or vehicles = […] or \"all\"")),
        };
        if let Some(k) = (1..named.len()).find(|&k| named[..k].iter().any(|n| n.0 == named[k].0)) {
            return Err(error!(Sweep at "vehicles", "vehicles names \"{}\" twice", named[k].0));
        }
        if self.vary.each {
            let each = |(name, place): (&str, (usize, usize))| {
                self.one("mass_kg", "mass_factor", name, Target::Mass(vec![place]))
            };
            let variables: Result<Vec<Vec<Variable>>, Error> =
                named.into_iter().map(each).collect();
            return variables.map(|v| v.into_iter().flatten().collect());
        }
        let all = matches!(self.vary.vehicles, Some(Vehicles::Word(_)));
        let names: Vec<&str> = named.iter().map(|n| n.0).collect();
        let name = if all { "all".to_string() } else { names.join(" ") };
        let places = named.into_iter().map(|n| n.1).collect();
        self.one("mass_kg", "mass_factor", &name, Target::Mass(places))
    }

    fn one(
        &self,
        absolute: &str,
        factor: &str,
        name: &str,
        target: Target,
    ) -> Result<Vec<Variable>, Error> {
        let key = match self.vary.what {
            What::Speed => "train",
            What::Mass => "",
            _ => "curve",
        };
        check_name(key, name)?;
        let quantity = if self.vary.factor { factor } else { absolute };
        let names = match self.vary.what {
            What::Curve => self.vary.values.iter().flatten().map(|v| v.0.clone()).collect(),
            _ => Vec::new(),
        };
        let column = format!("{quantity}[{name}]");
        Ok(vec![Variable { column, target, factor: self.vary.factor, names }])
    }

    fn curve(&self) -> Result<&str, Error> {
        let curve = self
            .vary
            .curve
            .as_deref()
            .ok_or_else(|| error!(Sweep, "name the curve: curve = \"…\""))?;
        self.check_curve(curve)?;
        Ok(curve)
    }

    fn known_curve(&self, key: &str, curve: &str) -> Result<(), Error> {
        let known = self.scenario.curves.keys().map(String::as_str);
        let is_known = self.scenario.curves.contains_key(curve);
        if is_known { Ok(()) } else { Err(unknown(key, "curve", curve, known)) }
    }

    /// A curve that is there, and that some item uses.
    fn check_curve(&self, curve: &str) -> Result<(), Error> {
        self.known_curve("curve", curve)?;
        let mut scenario = self.scenario.clone();
        let used = scenario.curve_names_mut().iter().any(|name| *name == curve);
        if used || self.replaces(curve) {
            Ok(())
        } else {
            Err(error!(
                Sweep at "curve",
                "no interface has curve \"{curve}\", so varying it has no effect"
            ))
        }
    }
}

fn unknown<'a>(key: &str, what: &str, name: &str, known: impl Iterator<Item = &'a str>) -> Error {
    error!(Sweep at key, "there is no {what} \"{name}\": the scenario has").names(name, known)
}

/// Names appear in the columns of the result.
fn check_name(key: &str, name: &str) -> Result<(), Error> {
    let breaks = |c: char| c.is_control() || [',', '|', '[', ']', '"', '#'].contains(&c);
    if name.is_empty() || name.contains(breaks) {
        Err(error!(
            Sweep at key,
            "the name \"{}\" appears in the result and may not be empty or contain , | [ ] # or quotes",
                name.escape_debug()
        ))
    } else {
        Ok(())
    }
}

impl Variable {
    /// Whether force laws depend on it. Those of a model's curve depend on masses and speeds.
    pub(crate) fn shapes_laws(&self, scenario: &Scenario) -> bool {
        match self.target {
            Target::Band(_) | Target::Force(_) | Target::Curve(_) => true,
            Target::Speed(_) | Target::Mass(_) => {
                scenario.curves.values().any(|c| c.model.is_some())
            }
            // Gaps decide how fast interfaces close that have a curve for their own speed.
            Target::ContactGap | Target::CurveGap(_) => {
                scenario.run.interface_speed == InterfaceSpeed::Local
                    && scenario.curves.values().any(|c| c.model.is_some())
            }
        }
    }

    /// Gives `scenario` the value, in SI; `base` is the scenario as written.
    pub(crate) fn apply(&self, scenario: &mut Scenario, base: &Scenario, value: f64) {
        let with = |old: f64| if self.factor { old * value } else { value };
        match &self.target {
            Target::Speed(train) => {
                let train = &mut scenario.train[*train];
                train.speed = SignedSpeedText(with(train.speed.0));
            }
            Target::Mass(vehicles) => {
                for &(t, v) in vehicles {
                    let vehicle = &mut scenario.train[t].vehicles[v];
                    vehicle.mass = MassText(with(vehicle.mass.0));
                }
            }
            Target::ContactGap => {
                let old = scenario.contact.gap.map_or(0.0, |gap| gap.0);
                scenario.contact.gap = Some(LengthText(with(old)));
            }
            Target::CurveGap(curve) => {
                if let Some(table) = scenario.curves.get_mut(curve) {
                    table.gap = Some(LengthText(with(table.gap.map_or(0.0, |gap| gap.0))));
                }
            }
            Target::Band(curve) => {
                if let Some(table) = scenario.curves.get_mut(curve) {
                    table.band = Some(value);
                }
            }
            Target::Force(curve) => {
                if let Some(table) = scenario.curves.get_mut(curve) {
                    table.scale = Some(table.scale.unwrap_or(1.0) * value);
                }
            }
            Target::Curve(curve) => {
                let Some(name) = self.names.get(value as usize) else { return };
                let mut base = base.clone();
                let written = base.curve_names_mut();
                for (now, written) in scenario.curve_names_mut().into_iter().zip(written) {
                    if written == curve {
                        now.clone_from(name);
                    }
                }
            }
        }
    }
}
