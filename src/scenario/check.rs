//! Checks that a single key cannot show: a scenario as written becomes a [`CheckedScenario`].

use std::borrow::Cow;
use std::collections::HashSet;
use std::ops::Deref;

use super::layout::layout;
use super::{CrushZone, CurveTable, LawName, LimitsTable, Scenario, TrainTable, VehicleTable};
use crate::guess;
use crate::manifest::Document;
use crate::unit::km_per_h;

/// A scenario that has been checked; read its tables as those of the [`Scenario`] it was.
///
/// Invariants: one train and a wall, or two trains, the first faster than what it meets; every
/// train has vehicles, and between any two of them, at the contact and in every crush zone a
/// curve of `[curves]`, or at the first two the plates of ends that come from models; names of bodies are unique; a vehicle has more mass than its crush zones.
#[derive(Clone, Debug)]
pub struct CheckedScenario<'a> {
    tables: Cow<'a, Scenario>,
    meeting_m_per_s: f64,
    /// Its text, if it is as its file has it.
    document: Option<Document>,
}

impl Deref for CheckedScenario<'_> {
    type Target = Scenario;

    fn deref(&self) -> &Scenario {
        &self.tables
    }
}

/// What is wrong with a scenario as a whole.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CheckError {
    /// A wall takes the place of the second train.
    #[error("a [wall] needs exactly one [[train]], found {trains}")]
    WallTrains {
        /// Number of trains.
        trains: usize,
    },
    /// There is nothing to meet, or too much.
    #[error("expected two [[train]], or one and a [wall], found {trains} [[train]] and no [wall]")]
    Trains {
        /// Number of trains.
        trains: usize,
    },
    /// A limit that nothing keeps.
    #[error("[limits] mean_deceleration_g = {found}: expected more than 0")]
    Limit {
        /// As written, in g.
        found: f64,
    },
    /// Both trains have one name.
    #[error("two trains are named \"{name}\": give them different names")]
    TrainTwice {
        /// The name.
        name: String,
    },
    /// Limits for no train.
    #[error("[limits] trains is empty: name one, or remove it for all")]
    NoLimitedTrain,
    /// Limits for a train that is not there.
    #[error(
        "[limits] trains: there is no train \"{name}\": the scenario has {known}{}",
        guess::hint(name, known)
    )]
    UnknownTrain {
        /// The train.
        name: String,
        /// The trains there are.
        known: String,
    },
    /// Two bodies have one name.
    #[error(
        "two bodies are named \"{name}\": vehicles, their front and rear and the wall need different names"
    )]
    BodyTwice {
        /// The name.
        name: String,
    },
    /// A name that cannot stand in the columns of the result.
    #[error("the name \"{}\" may not be empty or contain , | [ ] or quotes", .name.escape_debug())]
    Name {
        /// The name.
        name: String,
    },
    /// A train without vehicles.
    #[error("train \"{train}\" has no vehicles")]
    NoVehicles {
        /// The train.
        train: String,
    },
    /// No curve between two vehicles.
    #[error("train \"{train}\" has {vehicles} vehicles but no inner = \"…\" curve between them")]
    NoInner {
        /// The train.
        train: String,
        /// How many vehicles it has.
        vehicles: usize,
    },
    /// A contact without a curve between what has no ends of a model.
    #[error(
        "[contact] needs curve = \"…\": it can be left out only where the noses that meet come from models (front or ends)"
    )]
    NoContact,
    /// One of two facing ends comes from a model.
    #[error(
        "{end} of vehicle \"{vehicle}\" comes from a model and the end that it meets does not: give both, or neither"
    )]
    OneEnd {
        /// The vehicle whose end comes from a model.
        vehicle: String,
        /// `front` or `rear`.
        end: &'static str,
    },
    /// A curve where the ends of models meet.
    #[error(
        "curve \"{curve}\" stands between ends that come from models, where plates meet: remove it"
    )]
    BetweenEnds {
        /// The curve.
        curve: String,
    },
    /// An end without a mass whose curve is no model.
    #[error(
        "{end} of vehicle \"{vehicle}\" needs mass = \"…t\", or a model as its curve, which tells the mass that is stopped"
    )]
    EndNeedsModel {
        /// The vehicle.
        vehicle: String,
        /// `front`, `rear` or `ends`.
        end: &'static str,
    },
    /// A curve behind the last vehicle.
    #[error("there is nothing behind the last vehicle \"{vehicle}\"")]
    NothingBehind {
        /// The vehicle.
        vehicle: String,
    },
    /// A crush zone is joined to its body without a gap.
    #[error(
        "curve \"{curve}\" has a gap, but {end} of vehicle \"{vehicle}\" is joined to the body without one: give it a curve without gap"
    )]
    ZoneGap {
        /// Curve of the crush zone.
        curve: String,
        /// `front` or `rear`.
        end: &'static str,
        /// The vehicle.
        vehicle: String,
    },
    /// The crush zones take the whole vehicle.
    #[error(
        "the crush zones of vehicle \"{vehicle}\" have all of its mass: nothing is left for the body"
    )]
    NoBodyMass {
        /// The vehicle.
        vehicle: String,
    },
    /// Stages that make no curve.
    #[error("curve \"{curve}\": stages is empty")]
    NoStages {
        /// The curve.
        curve: String,
    },
    /// A key that the kind of curve does not take.
    #[error("curve \"{curve}\": {key} belongs to {of}: remove it")]
    ForeignKey {
        /// The curve.
        curve: String,
        /// The key.
        key: &'static str,
        /// What takes it.
        of: &'static str,
    },
    /// A tension curve that is not there.
    #[error(
        "curve \"{curve}\": its tension curve \"{tension}\" is not in [curves]: it has {known}{}",
        guess::hint(tension, known)
    )]
    UnknownTension {
        /// The curve.
        curve: String,
        /// Its tension curve.
        tension: String,
        /// The curves there are.
        known: String,
    },
    /// A tension curve with a tension curve or a damper.
    #[error(
        "curve \"{tension}\" is the tension of \"{curve}\": it can have no tension or damping of its own"
    )]
    TensionOfTension {
        /// The curve.
        curve: String,
        /// Its tension curve.
        tension: String,
    },
    /// A model as a tension curve.
    #[error(
        "curve \"{tension}\" is the tension of \"{curve}\": models know compression only; give a file or stages"
    )]
    TensionModel {
        /// The curve.
        curve: String,
        /// Its tension curve.
        tension: String,
    },
    /// The first train does not reach what is in front of it.
    #[error("train \"{train}\" at {} never meets what is in front of it: it must be faster", km_per_h(*.speed_m_per_s))]
    NeverMeets {
        /// The first train.
        train: String,
        /// Its speed.
        speed_m_per_s: f64,
    },
    /// A curve that is used and not there.
    #[error(
        "there is no curve \"{curve}\" in [curves]: it has {known}{}",
        guess::hint(curve, known)
    )]
    UnknownCurve {
        /// The curve.
        curve: String,
        /// The curves there are.
        known: String,
    },
}

impl Scenario {
    /// Checks the scenario as a whole.
    ///
    /// # Errors
    /// [`CheckError`] names the key, vehicle or curve.
    pub(crate) fn check(&self) -> Result<CheckedScenario<'_>, CheckError> {
        check_shape(self)?;
        if let Some(limits) = &self.limits {
            check_limits(limits, &self.train)?;
        }
        check_names(self)?;
        check_contact(self)?;
        for (name, table) in &self.curves {
            check_keys(name, table)?;
        }
        let checked = check_values(self)?;
        for curve in layout(&checked).slots.iter().filter_map(|slot| slot.joint.curve()) {
            if !self.curves.contains_key(curve) {
                let (curve, known) = (curve.into(), curve_names(self));
                return Err(CheckError::UnknownCurve { curve, known });
            }
        }
        check_ends(self)?;
        Ok(checked)
    }
}

impl CheckedScenario<'_> {
    /// Speed at which the first train meets what is in front of it, in m/s; above 0.
    pub(crate) fn meeting_m_per_s(&self) -> f64 {
        self.meeting_m_per_s
    }

    /// Its text, if it is as its file has it.
    pub(super) fn document(&self) -> Option<&Document> {
        self.document.as_ref()
    }

    /// The same with the text that it was read from.
    pub(super) fn with(self, document: Document) -> Self {
        Self { document: Some(document), ..self }
    }

    /// The same with tables of its own.
    pub(crate) fn into_owned(self) -> CheckedScenario<'static> {
        CheckedScenario { tables: Cow::Owned(self.tables.into_owned()), ..self }
    }

    /// Checks `varied`, which differs from this scenario in numbers only and in which of its
    /// curves stand where: what these cannot break is not looked at again.
    ///
    /// # Errors
    /// [`CheckError`] as of [`Scenario::check`].
    pub(crate) fn vary<'v>(&self, varied: &'v Scenario) -> Result<CheckedScenario<'v>, CheckError> {
        check_values(varied)
    }
}

/// Two trains, or one and a wall.
fn check_shape(scenario: &Scenario) -> Result<(), CheckError> {
    let trains = scenario.train.len();
    match (&scenario.wall, scenario.train.as_slice()) {
        (Some(_), [_]) => Ok(()),
        (Some(_), _) => Err(CheckError::WallTrains { trains }),
        (None, [first, second]) if first.name == second.name => {
            Err(CheckError::TrainTwice { name: first.name.clone() })
        }
        (None, [_, _]) => Ok(()),
        (None, _) => Err(CheckError::Trains { trains }),
    }
}

fn check_limits(limits: &LimitsTable, trains: &[TrainTable]) -> Result<(), CheckError> {
    let found = limits.mean_deceleration_g;
    if !(found > 0.0 && found.is_finite()) {
        return Err(CheckError::Limit { found });
    }
    if limits.trains.as_ref().is_some_and(Vec::is_empty) {
        return Err(CheckError::NoLimitedTrain);
    }
    for name in limits.trains.iter().flatten() {
        if !trains.iter().any(|train| train.name == *name) {
            let known: Vec<&str> = trains.iter().map(|t| t.name.as_str()).collect();
            return Err(CheckError::UnknownTrain { name: name.clone(), known: known.join(", ") });
        }
    }
    Ok(())
}

/// Names of bodies, and that every train has vehicles with something between them.
fn check_names(scenario: &Scenario) -> Result<(), CheckError> {
    let mut names = HashSet::new();
    let mut take = |name: String| match names.insert(name.clone()) {
        true => Ok(()),
        false => Err(CheckError::BodyTwice { name }),
    };
    if let Some(wall) = &scenario.wall {
        check_name(&wall.name)?;
        take(wall.name.clone())?;
    }
    for train in &scenario.train {
        check_vehicles(train)?;
        for vehicle in &train.vehicles {
            check_name(&vehicle.name)?;
            take(vehicle.name.clone())?;
            for zone in vehicle.zones() {
                take(format!("{} {}", vehicle.name, zone.end))?;
            }
        }
    }
    Ok(())
}

fn check_vehicles(train: &TrainTable) -> Result<(), CheckError> {
    let (name, vehicles) = (train.name.clone(), train.vehicles.len());
    let Some(last) = train.vehicles.last() else {
        return Err(CheckError::NoVehicles { train: name });
    };
    for pair in train.vehicles.windows(2) {
        let plates = facing(
            (&pair[0].name, pair[0].rear_zone()),
            Some((&pair[1].name, pair[1].front_zone())),
        )?;
        match (plates, &pair[0].behind) {
            (true, Some(curve)) => {
                return Err(CheckError::BetweenEnds { curve: curve.clone() });
            }
            (false, None) if train.inner.is_none() => {
                return Err(CheckError::NoInner { train: name, vehicles });
            }
            _ => {}
        }
    }
    if last.behind.is_some() {
        return Err(CheckError::NothingBehind { vehicle: last.name.clone() });
    }
    Ok(())
}

/// Whether two facing ends, or an end and the wall, meet as plates: both come from models.
fn facing(
    (name, end): (&str, Option<CrushZone<'_>>),
    other: Option<(&str, Option<CrushZone<'_>>)>,
) -> Result<bool, CheckError> {
    let one = |vehicle: &str, end: CrushZone<'_>| {
        Err(CheckError::OneEnd { vehicle: vehicle.into(), end: end.end })
    };
    let other = other.map(|(name, end)| (name, end.filter(CrushZone::is_of_model)));
    match (end.filter(CrushZone::is_of_model), other) {
        (Some(_), None | Some((_, Some(_)))) => Ok(true),
        (Some(end), Some((_, None))) => one(name, end),
        (None, Some((other, Some(end)))) => one(other, end),
        (None, _) => Ok(false),
    }
}

/// The curve between the noses, or between plates none.
fn check_contact(scenario: &Scenario) -> Result<(), CheckError> {
    let nose = |train: usize| {
        let vehicle = scenario.train.get(train)?.vehicles.first()?;
        Some((vehicle.name.as_str(), vehicle.front_zone()))
    };
    let Some(first) = nose(0) else { return Ok(()) };
    match (facing(first, nose(1))?, &scenario.contact.curve) {
        (true, Some(curve)) => Err(CheckError::BetweenEnds { curve: curve.clone() }),
        (false, None) => Err(CheckError::NoContact),
        _ => Ok(()),
    }
}

/// Names stand in the columns of the result.
fn check_name(name: &str) -> Result<(), CheckError> {
    let breaks = |c: char| c.is_control() || [',', '|', '[', ']', '"'].contains(&c);
    match name.is_empty() || name.contains(breaks) {
        true => Err(CheckError::Name { name: name.into() }),
        false => Ok(()),
    }
}

/// Keys that only some kinds of curves take.
fn check_keys(name: &str, table: &CurveTable) -> Result<(), CheckError> {
    if table.stages.as_ref().is_some_and(Vec::is_empty) {
        return Err(CheckError::NoStages { curve: name.into() });
    }
    let no_model = table.model.is_none();
    let foreign = [
        (
            "force",
            "a model, predicted curve or case",
            table.stages.is_some() && table.force.is_some(),
        ),
        ("case", "a database", table.database.is_none() && table.case.is_some()),
        ("max_crush", "a model", no_model && table.max_crush.is_some()),
        ("parameters", "a model", no_model && !table.parameters.is_empty()),
        (
            "unloading",
            "law = \"memory\"",
            table.law == LawName::Elastic && table.unloading.is_some(),
        ),
    ];
    let rate = table.law == LawName::Rate;
    let of_rate = [
        ("law", "a model, which has a rate", rate && no_model),
        ("band", "law = \"memory\"", rate && table.band.is_some()),
        ("max_crush", "law = \"memory\"", rate && table.max_crush.is_some()),
        ("force", "law = \"memory\"", rate && table.force.is_some()),
        ("tension", "law = \"memory\"", rate && table.tension.is_some()),
    ];
    match foreign.into_iter().chain(of_rate).find(|(.., is_foreign)| *is_foreign) {
        Some((key, of, _)) => Err(CheckError::ForeignKey { curve: name.into(), key, of }),
        None => Ok(()),
    }
}

/// What depends on numbers and on which curve stands where.
fn check_values(scenario: &Scenario) -> Result<CheckedScenario<'_>, CheckError> {
    for vehicle in scenario.train.iter().flat_map(|train| &train.vehicles) {
        check_zones(vehicle, scenario)?;
    }
    for (name, table) in &scenario.curves {
        if let Some(tension) = &table.tension {
            check_tension(name, tension, scenario)?;
        }
    }
    let first = &scenario.train[0];
    let speed_m_per_s = first.speed.0;
    let meeting_m_per_s = speed_m_per_s - scenario.train.get(1).map_or(0.0, |t| t.speed.0);
    if meeting_m_per_s <= 0.0 {
        return Err(CheckError::NeverMeets { train: first.name.clone(), speed_m_per_s });
    }
    Ok(CheckedScenario { tables: Cow::Borrowed(scenario), meeting_m_per_s, document: None })
}

fn curve_names(scenario: &Scenario) -> String {
    scenario.curves.keys().map(String::as_str).collect::<Vec<_>>().join(", ")
}

fn check_zones(vehicle: &VehicleTable, scenario: &Scenario) -> Result<(), CheckError> {
    for zone in vehicle.zones() {
        let gap = scenario.curves.get(zone.curve).and_then(|curve| curve.gap);
        if gap.is_some_and(|gap| gap.0 > 0.0) {
            let (curve, vehicle) = (zone.curve.into(), vehicle.name.clone());
            return Err(CheckError::ZoneGap { curve, end: zone.end, vehicle });
        }
    }
    match vehicle.zones().next().is_some() && vehicle.body_mass_kg() <= 0.0 {
        true => Err(CheckError::NoBodyMass { vehicle: vehicle.name.clone() }),
        false => Ok(()),
    }
}

/// Ends without a mass of their own come from models.
fn check_ends(scenario: &Scenario) -> Result<(), CheckError> {
    for vehicle in scenario.train.iter().flat_map(|train| &train.vehicles) {
        for zone in vehicle.zones().filter(CrushZone::is_of_model) {
            let Some(table) = scenario.curves.get(zone.curve) else { continue };
            let between = "a curve between bodies, and this one is the end of a vehicle";
            let foreign = [
                ("band", table.band.is_some()),
                ("max_crush", table.max_crush.is_some()),
                ("force", table.force.is_some()),
                ("tension", table.tension.is_some()),
                ("damping", table.damping.is_some()),
            ];
            if let Some((key, _)) = foreign.into_iter().find(|(_, given)| *given) {
                return Err(CheckError::ForeignKey { curve: zone.curve.into(), key, of: between });
            }
            if table.model.is_none() {
                let by_both = vehicle.ends.as_deref() == Some(zone.curve);
                let end = if by_both { "ends" } else { zone.end };
                return Err(CheckError::EndNeedsModel { vehicle: vehicle.name.clone(), end });
            }
        }
    }
    Ok(())
}

fn check_tension(name: &str, tension: &str, scenario: &Scenario) -> Result<(), CheckError> {
    let (curve, tension) = (name.to_string(), tension.to_string());
    match scenario.curves.get(&tension) {
        None => {
            let known = curve_names(scenario);
            Err(CheckError::UnknownTension { curve, tension, known })
        }
        Some(other) if other.tension.is_some() || other.damping.is_some() => {
            Err(CheckError::TensionOfTension { curve, tension })
        }
        Some(other) if other.model.is_some() => Err(CheckError::TensionModel { curve, tension }),
        Some(_) => Ok(()),
    }
}
