//! Checks across several keys: a scenario as written becomes a [`CheckedScenario`].

use std::borrow::Cow;
use std::collections::HashSet;
use std::ops::Deref;

use super::layout::layout;
use super::{
    CrushZone, CurveTable, LawName, LimitsTable, Scenario, TrainTable, VehicleTable, place,
};
use crate::error::{Document, Error, KeyPath, error};
use crate::multibody::recorder::COARSEST_S;
use crate::unit::km_per_h;

/// A scenario that has been checked; read its tables as those of the [`Scenario`] it was.
///
/// Invariants: one train and a wall, or two trains, the first faster than what it meets; every
/// train has vehicles, and between any two of them, at the contact and in every crush zone a
/// curve of `[curves]`, or at the first two the plates of ends that come from models; names of bodies are unique; a vehicle has more mass than its crush zones.
#[derive(Clone, Debug)]
pub struct CheckedScenario<'a> {
    tables: Cow<'a, Scenario>,
    /// Speed at which the first train meets what is in front of it, in m/s; above 0.
    pub(crate) meeting_m_per_s: f64,
    /// Its text, if it is as in its file.
    document: Option<Document>,
}

impl Deref for CheckedScenario<'_> {
    type Target = Scenario;

    fn deref(&self) -> &Scenario {
        &self.tables
    }
}

impl Scenario {
    fn curve_names(&self) -> impl Iterator<Item = &str> {
        self.curves.keys().map(String::as_str)
    }

    /// Checks the scenario as a whole.
    pub(crate) fn check(&self) -> Result<CheckedScenario<'_>, Error> {
        check_shape(self)?;
        if let Some(limits) = &self.limits {
            check_limits(limits, &self.train)?;
            let of_occupants =
                limits.secondary_impact.is_some() || limits.occupant_load_g.is_some();
            if of_occupants && self.run.output_interval.0 > COARSEST_S {
                return Err(error!(
                    Scenario at "run.output_interval",
                    "[limits] on occupants need outputs at most 5 ms apart: shorten output_interval"
                ));
            }
        }
        check_models_of_ends(self)?;
        check_names(self)?;
        check_contact(self)?;
        let curves = self.curves.len();
        if curves > MAX_CURVES {
            return Err(error!(
                Scenario at "curves",
                "[curves] has {curves} curves: expected at most {MAX_CURVES}"
            ));
        }
        for (name, table) in &self.curves {
            check_length(name).map_err(|e| e.at_key("curves"))?;
            check_keys(name, table)?;
        }
        let checked = check_values(self)?;
        let inner = self.train.iter().filter_map(|train| train.inner.as_deref());
        let layout = layout(&checked);
        for curve in layout.slots.iter().filter_map(|slot| slot.joint.curve()).chain(inner) {
            if !self.curves.contains_key(curve) {
                return Err(error!(Scenario, "there is no curve \"{curve}\" in [curves]: it has")
                    .names(curve, self.curve_names())
                    .at(self.use_of(curve)));
            }
        }
        check_ends(self)?;
        Ok(checked)
    }
}

impl CheckedScenario<'_> {
    /// Its text, if it is as in its file.
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
    /// curves stand where: what these cannot break is not examined again.
    pub(crate) fn vary<'v>(&self, varied: &'v Scenario) -> Result<CheckedScenario<'v>, Error> {
        check_values(varied)
    }
}

/// Two trains, or one and a wall.
fn check_shape(scenario: &Scenario) -> Result<(), Error> {
    let trains = scenario.train.len();
    match (&scenario.wall, scenario.train.as_slice()) {
        (Some(_), [_]) => Ok(()),
        (Some(_), _) => {
            let key = if trains > 1 { place::train(1) } else { KeyPath::of("wall") };
            Err(error!(Scenario, "a [wall] needs exactly one [[train]], found {trains}").at(key))
        }
        (None, [first, second]) if first.name == second.name => {
            let name = &first.name;
            Err(error!(Scenario, "two trains are named \"{name}\": give them different names")
                .at(place::train(1).key("name")))
        }
        (None, [_, _]) => Ok(()),
        (None, _) => Err(error!(
            Scenario,
            "expected two [[train]], or one and a [wall], found {trains} [[train]] and no [wall]"
        )
        .at(place::train(if trains > 2 { 2 } else { 0 }))),
    }
}

fn check_limits(limits: &LimitsTable, trains: &[TrainTable]) -> Result<(), Error> {
    for (key, found) in [
        ("mean_deceleration_g", Some(limits.mean_deceleration_g)),
        ("occupant_load_g", limits.occupant_load_g),
    ] {
        if let Some(found) = found.filter(|found| !(*found > 0.0 && found.is_finite())) {
            let error = error!(Scenario, "[limits] {key} = {found}: expected more than 0");
            return Err(error.at(KeyPath::of("limits").key(key)));
        }
    }
    for (key, text) in [("standard", &limits.standard), ("edition", &limits.edition)] {
        if text.trim().is_empty() {
            let error =
                error!(Scenario, "[limits] {key} is empty: state which one the limits are of");
            return Err(error.at(KeyPath::of("limits").key(key)));
        }
    }
    if limits.trains.as_ref().is_some_and(Vec::is_empty) {
        return Err(error!(
            Scenario at "limits.trains",
            "[limits] trains is empty: name one, or remove it for all"
        ));
    }
    for (k, name) in limits.trains.iter().flatten().enumerate() {
        if !trains.iter().any(|train| train.name == *name) {
            return Err(error!(
                Scenario,
                "[limits] trains: there is no train \"{name}\": the scenario has"
            )
            .names(name, trains.iter().map(|t| t.name.as_str()))
            .at(KeyPath::of("limits.trains").item(k)));
        }
    }
    Ok(())
}

/// Names of bodies, and that every train has vehicles with something between them.
fn check_names(scenario: &Scenario) -> Result<(), Error> {
    let mut names = HashSet::new();
    let mut take = |name: String| {
        if names.insert(name.clone()) {
            return Ok(());
        }
        Err(error!(
            Scenario,
            "two bodies are named \"{name}\": vehicles, their front and rear and the wall need different names"
        )
        .at(scenario.body_twice(&name)))
    };
    if let Some(wall) = &scenario.wall {
        check_name(&wall.name).map_err(|e| e.at_key("wall.name"))?;
        take(wall.name.clone())?;
    }
    for train in &scenario.train {
        check_vehicles(scenario, train)?;
        for vehicle in &train.vehicles {
            check_name(&vehicle.name)
                .map_err(|e| e.at(scenario.vehicle(&vehicle.name).key("name")))?;
            take(vehicle.name.clone())?;
            for zone in vehicle.zones() {
                take(format!("{} {}", vehicle.name, zone.end))?;
            }
        }
    }
    Ok(())
}

fn check_vehicles(scenario: &Scenario, train: &TrainTable) -> Result<(), Error> {
    let (name, vehicles) = (&train.name, train.vehicles.len());
    let Some(last) = train.vehicles.last() else {
        return Err(error!(Scenario, "train \"{name}\" has no vehicles")
            .at(scenario.train_named(name).key("vehicles")));
    };
    for pair in train.vehicles.windows(2) {
        let plates = facing(
            scenario,
            (&pair[0].name, pair[0].rear_zone()),
            Some((&pair[1].name, pair[1].front_zone())),
        )?;
        match (plates, &pair[0].behind) {
            (true, Some(curve)) => {
                return Err(between_ends(scenario, curve));
            }
            (false, None) if train.inner.is_none() => {
                return Err(error!(
                    Scenario,
                    "train \"{name}\" has {vehicles} vehicles but no inner = \"…\" curve between them"
                )
                .at(scenario.train_named(name)));
            }
            _ => {}
        }
    }
    if last.behind.is_some() {
        let vehicle = &last.name;
        return Err(error!(Scenario, "there is nothing behind the last vehicle \"{vehicle}\"")
            .at(scenario.vehicle(vehicle).key("behind").itself()));
    }
    Ok(())
}

fn between_ends(scenario: &Scenario, curve: &str) -> Error {
    error!(
        Scenario,
        "curve \"{curve}\": ends that come from models meet by their plates, without a curve: remove this key"
    )
    .at(scenario.use_of(curve))
}

/// Whether two facing ends, or an end and the wall, meet as plates: both come from models.
fn facing(
    scenario: &Scenario,
    (name, end): (&str, Option<CrushZone<'_>>),
    other: Option<(&str, Option<CrushZone<'_>>)>,
) -> Result<bool, Error> {
    let one = |vehicle: &str, end: CrushZone<'_>| {
        let end = end.end;
        Err(error!(
            Scenario,
            "{end} of vehicle \"{vehicle}\" comes from a model and the end that it meets does not: give both, or neither"
        )
        .at(scenario.end_of(vehicle, end)))
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
fn check_contact(scenario: &Scenario) -> Result<(), Error> {
    let nose = |train: usize| {
        let vehicle = scenario.train.get(train)?.vehicles.first()?;
        Some((vehicle.name.as_str(), vehicle.front_zone()))
    };
    let Some(first) = nose(0) else { return Ok(()) };
    match (facing(scenario, first, nose(1))?, &scenario.contact.curve) {
        (true, Some(curve)) => Err(between_ends(scenario, curve)),
        (false, None) => Err(error!(
            Scenario at "contact",
            "[contact] needs curve = \"…\": it can be left out only where the noses that meet come from models (front or ends)"
        )),
        _ => Ok(()),
    }
}

/// Most curves of a scenario; each is read from its file.
const MAX_CURVES: usize = 1_000;

/// Longest name, in bytes: it appears in the columns of results and tables.
const MAX_NAME: usize = 200;

fn check_length(name: &str) -> Result<(), Error> {
    if name.len() <= MAX_NAME {
        return Ok(());
    }
    let begin: String = name.chars().take(20).collect();
    let (begin, found) = (begin.escape_debug(), name.len());
    Err(error!(Scenario, "the name \"{begin}…\" has {found} bytes: expected at most {MAX_NAME}"))
}

/// Names appear in the columns of the result.
fn check_name(name: &str) -> Result<(), Error> {
    check_length(name)?;
    let breaks = |c: char| c.is_control() || [',', '|', '[', ']', '"'].contains(&c);
    if name.is_empty() || name.contains(breaks) {
        let name = name.escape_debug();
        return Err(error!(
            Scenario,
            "the name \"{name}\" may not be empty or contain , | [ ] or quotes"
        ));
    }
    Ok(())
}

/// Keys that only some kinds of curves take.
fn check_keys(name: &str, table: &CurveTable) -> Result<(), Error> {
    if table.stages.as_ref().is_some_and(Vec::is_empty) {
        return Err(error!(Scenario, "curve \"{name}\": stages is empty")
            .at(place::curve(name).key("stages")));
    }
    let no_model = table.model.is_none();
    let foreign = [
        (
            "force",
            "a model, predicted curve or case",
            table.stages.is_some() && table.force.is_some(),
        ),
        ("units", "a file", table.file.is_none() && table.units.is_some()),
        ("curve", "a file", table.file.is_none() && table.curve.is_some()),
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
        ("law", "the curve of a model, whose force follows the rate", rate && no_model),
        ("band", "law = \"memory\"", rate && table.band.is_some()),
        ("max_crush", "law = \"memory\"", rate && table.max_crush.is_some()),
        ("force", "law = \"memory\" or \"elastic\"", rate && table.force.is_some()),
        ("tension", "law = \"memory\"", rate && table.tension.is_some()),
    ];
    match foreign.into_iter().chain(of_rate).find(|(.., is_foreign)| *is_foreign) {
        Some((key, of, _)) => Err(foreign_key(name, key, of)),
        None => Ok(()),
    }
}

fn foreign_key(curve: &str, key: &str, of: &str) -> Error {
    error!(Scenario, "curve \"{curve}\": {key} belongs to {of}: remove it")
        .at(place::curve(curve).key(key).itself())
}

/// What depends on numbers and on which curve stands where.
fn check_values(scenario: &Scenario) -> Result<CheckedScenario<'_>, Error> {
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
        let (train, speed) = (&first.name, km_per_h(speed_m_per_s));
        return Err(error!(
            Scenario,
            "train \"{train}\" at {speed} never meets what is in front of it: it must be faster"
        )
        .at(place::train(0).key("speed")));
    }
    Ok(CheckedScenario { tables: Cow::Borrowed(scenario), meeting_m_per_s, document: None })
}

fn check_zones(vehicle: &VehicleTable, scenario: &Scenario) -> Result<(), Error> {
    for zone in vehicle.zones() {
        let gap = scenario.curves.get(zone.curve).and_then(|curve| curve.gap);
        if gap.is_some_and(|gap| gap.0 > 0.0) {
            let (curve, end, vehicle) = (zone.curve, zone.end, &vehicle.name);
            return Err(error!(
                Scenario,
                "curve \"{curve}\" has a gap, but {end} of vehicle \"{vehicle}\" is joined to the body without one: give it a curve without gap"
            )
            .at(scenario.end_of(vehicle, end)));
        }
    }
    if vehicle.zones().next().is_some() && vehicle.body_mass_kg() <= 0.0 {
        let vehicle = &vehicle.name;
        return Err(error!(
            Scenario,
            "the crush zones of vehicle \"{vehicle}\" have all of its mass: nothing is left for the body"
        )
        .at(scenario.vehicle(vehicle).key("mass")));
    }
    Ok(())
}

/// Ends without a mass of their own come from models.
fn check_models_of_ends(scenario: &Scenario) -> Result<(), Error> {
    for vehicle in scenario.train.iter().flat_map(|train| &train.vehicles) {
        for zone in vehicle.zones().filter(CrushZone::is_of_model) {
            let Some(table) = scenario.curves.get(zone.curve) else { continue };
            if table.model.is_some() {
                continue;
            }
            let (name, curve) = (&vehicle.name, zone.curve);
            let by_both = vehicle.ends.as_deref() == Some(curve);
            let (end, instead) = match by_both {
                true => (
                    "ends",
                    format!(
                        "write front = {{ curve = \"{curve}\", mass = \"…t\" }} and rear likewise"
                    ),
                ),
                false => (zone.end, "add mass = \"…t\"".into()),
            };
            return Err(error!(
                Scenario,
                "{end} of vehicle \"{name}\": curve \"{curve}\" is not a model, so the stopped mass is unknown: {instead}, or name a model"
            )
            .at(scenario.vehicle(name).key(end)));
        }
    }
    Ok(())
}

/// What the ends of vehicles say that belongs to curves between bodies.
fn check_ends(scenario: &Scenario) -> Result<(), Error> {
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
                return Err(foreign_key(zone.curve, key, between));
            }
        }
    }
    Ok(())
}

fn check_tension(curve: &str, tension: &str, scenario: &Scenario) -> Result<(), Error> {
    let fault = match scenario.curves.get(tension) {
        None => error!(
            Scenario,
            "curve \"{curve}\": its tension curve \"{tension}\" is not in [curves]: it has"
        )
        .names(tension, scenario.curve_names()),
        Some(other) if other.tension.is_some() || other.damping.is_some() => error!(
            Scenario,
            "curve \"{tension}\" is the tension of \"{curve}\": it can have no tension or damping of its own"
        ),
        Some(other) if other.model.is_some() => error!(
            Scenario,
            "curve \"{tension}\" is the tension of \"{curve}\": models describe compression only; give a file or stages"
        ),
        Some(_) => return Ok(()),
    };
    Err(fault.at(place::curve(curve).key("tension")))
}
