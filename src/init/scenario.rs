//! From models to a proposed scenario: vehicles with the models' masses meet at a speed for which the
//! models were trained.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::folders::seen_from;
use super::measure;
use super::write::Evidence::{Guessed, Read};
use super::write::{Proposed, Text, inline, quoted, speed_text};
use crate::curve::Parameter;
use crate::error::{Error, error};
use crate::file::folder_of;
use crate::scenario;
use crate::surrogate::Model;
use crate::unit::{SpeedKind, km_per_h};

/// Vehicles of a train that has a curve between them.
const VEHICLES: usize = 3;
const GAP: &str =
    "guessed: no clear distance between the vehicles: put yours, between the surfaces that meet";
/// Parameters that vehicles give by themselves.
const MASSES: [&str; 2] = ["mass_kg", "other_mass_kg"];

#[derive(Clone, Debug, Serialize)]
pub(crate) struct ScenarioProposal {
    /// Between the noses or nose and wall, then that between the vehicles of a train.
    pub curves: Vec<ProposedCurve>,
    /// Two trains, or one if it meets a wall.
    pub trains: Vec<ProposedTrain>,
    /// Whether a rigid wall takes the place of the second train.
    pub wall: bool,
    /// Whether the vehicles have ends from the models, else one mass each and the curves between them.
    pub ends: bool,
    /// Length of the run in s.
    pub(crate) duration_s: Proposed<f64>,
    pub missing: Vec<String>,
}

#[derive(Clone, Debug, Serialize)]
pub(crate) struct ProposedCurve {
    pub name: &'static str,
    /// Model file as the scenario names it.
    pub model: String,
    pub group: String,
    /// Lowest and highest training speed, in m/s.
    pub range_m_per_s: [f64; 2],
    pub speed_kind: SpeedKind,
    /// Values of the model's further parameters: those of one of its runs.
    pub parameters: BTreeMap<String, Parameter>,
}

#[derive(Clone, Debug, Serialize)]
pub(crate) struct ProposedTrain {
    pub name: &'static str,
    pub(crate) speed_m_per_s: Proposed<f64>,
    /// From the nose back.
    pub vehicles: Vec<ProposedVehicle>,
}

#[derive(Clone, Debug, Serialize)]
pub(crate) struct ProposedVehicle {
    pub name: String,
    pub(crate) mass_kg: Proposed<f64>,
}

/// Proposes a scenario, which will stand at `place`, for one model or two.
pub(crate) fn propose_scenario(
    models: &[PathBuf],
    place: &Path,
    one_mass: bool,
) -> Result<ScenarioProposal, Error> {
    if !(1..=2).contains(&models.len()) {
        return Err(error!(
            Usage,
            "a scenario takes one model or two, found {found}: first the curve between the noses, or nose and wall, then that between the vehicles of a train",
            found = models.len()
        ));
    }
    let read: Vec<Model> =
        models.iter().map(|model| Model::read(model)).collect::<Result<_, _>>()?;
    let (nose, inner) = (&read[0], read.get(1));
    if inner.is_some_and(|inner| inner.speed_kind == SpeedKind::Wall) {
        return Err(error!(
            Study,
            "{path}: its speeds are wall speeds, but the curve between the vehicles of a train needs closing speeds: give a model with closing speeds second",
            path = models[1].display()
        ));
    }
    let mut missing = Vec::new();
    let curves = ["nose", "inner"]
        .into_iter()
        .zip(models)
        .zip(&read)
        .map(|((name, path), model)| {
            let path =
                seen_from(folder_of(place), path).unwrap_or_else(|| path.display().to_string());
            curve(name, path, model, &mut missing)
        })
        .collect();
    let wall = nose.speed_kind == SpeedKind::Wall;
    let knows_ends = Model::knows_stopped_mass;
    let ends = !one_mass && inner.is_some_and(|inner| knows_ends(nose) && knows_ends(inner));
    let speed = speed(nose);
    let mut trains = vec![train("A", speed, nose.mass_kg, nose, inner)];
    if !wall {
        let from = "the other train is at rest, so the first one's speed is the closing speed";
        let stands = Proposed::found(0.0, Guessed, from);
        let mass_kg = nose.other_mass_kg.unwrap_or(nose.mass_kg);
        trains.push(train("B", stands, mass_kg, nose, inner));
    }
    let proposal =
        ScenarioProposal { curves, trains, wall, ends, duration_s: duration(nose, inner), missing };
    scenario::parse(place, &proposal.to_toml())?;
    Ok(proposal)
}

fn curve(
    name: &'static str,
    model: String,
    of: &Model,
    missing: &mut Vec<String>,
) -> ProposedCurve {
    let (low, high) = of.range_m_per_s();
    let case = &of.cases[of.cases.len() / 2];
    let mut parameters = BTreeMap::new();
    let all = of.features.iter().zip(&case.features);
    let further: Vec<_> = all.filter(|(f, _)| !MASSES.contains(&&*f.parameter)).collect();
    for (feature, value) in &further {
        let value = match &feature.category {
            None => Parameter::Number(**value),
            Some(category) if **value == 1.0 => Parameter::Category(category.clone()),
            Some(_) => continue,
        };
        parameters.insert(feature.parameter.clone(), value);
    }
    let mut left: Vec<&String> = further
        .iter()
        .map(|(f, _)| &f.parameter)
        .filter(|name| !parameters.contains_key(*name))
        .collect();
    left.dedup();
    missing.extend(left.iter().map(|left| format!("parameters of the curve {name}: {left} = …")));
    ProposedCurve {
        name,
        model,
        group: of.group.clone(),
        range_m_per_s: [low, high],
        speed_kind: of.speed_kind,
        parameters,
    }
}

/// The middle one of the training speeds.
fn speed(model: &Model) -> Proposed<f64> {
    let (low, high) = model.range_m_per_s();
    let mut speeds: Vec<f64> = model.cases.iter().map(|case| case.speed_m_per_s).collect();
    speeds.dedup_by_key(|speed| km_per_h(*speed));
    let from = format!(
        "one of the {} training speeds, which go from {} to {} ({} speeds)",
        speeds.len(),
        km_per_h(low),
        km_per_h(high),
        model.speed_kind.name()
    );
    let speed = model.cases[model.cases.len() / 2].speed_m_per_s;
    Proposed::found(speed, Guessed, from)
}

fn train(
    name: &'static str,
    speed_m_per_s: Proposed<f64>,
    first_kg: f64,
    nose: &Model,
    inner: Option<&Model>,
) -> ProposedTrain {
    let of = |number: usize, kg: f64, group: &str| ProposedVehicle {
        name: format!("{name}{number}"),
        mass_kg: Proposed::found(kg, Read, format!("mass of the runs of {group}")),
    };
    let mut vehicles = vec![of(1, first_kg, &nose.group)];
    if let Some(inner) = inner {
        vehicles.extend((2..=VEHICLES).map(|number| of(number, inner.mass_kg, &inner.group)));
    }
    ProposedTrain { name, speed_m_per_s, vehicles }
}

/// Time to crush and part, with as much again, and half of it for each further vehicle.
fn duration(nose: &Model, inner: Option<&Model>) -> Proposed<f64> {
    let case = &nose.cases[nose.cases.len() / 2];
    let loading_s = 2.0 * case.max_deflection_m / case.speed_m_per_s;
    let vehicles = if inner.is_some() { VEHICLES } else { 1 };
    let all_s = 2.5 * loading_s * (1.0 + 0.5 * (vehicles - 1) as f64);
    let rounded_s = (all_s / 0.05).ceil().max(1.0) * 0.05;
    let from = "a few times the duration of the crush at this speed";
    Proposed::found(rounded_s, Guessed, from)
}

impl ScenarioProposal {
    /// The proposal as the text of a scenario.
    pub(crate) fn to_toml(&self) -> String {
        let mut text = Text::default();
        text.comment("Proposed by crumple init: masses and speeds are those of the models' runs. Put your own trains in their place; the speed must stay within the training speeds. Then: crumple simulate");
        self.missing.iter().for_each(|what| text.item(&format!("fill in {what}")));
        text.blank();
        text.line("[run]");
        text.value("duration", &self.duration_s, |s| quoted(&format!("{:.0}ms", s * 1e3)));
        text.line("output_interval = \"0.75ms\"");
        text.blank();
        text.line("[curves]");
        for curve in &self.curves {
            curve.write(&mut text, self.ends);
        }
        if self.ends {
            text.blank();
            text.comment("Vehicles have the ends that the models know, the most accurate way; crumple init --scenario --one-mass writes single-mass vehicles, which run faster.");
        }
        for train in &self.trains {
            self.train(&mut text, train);
        }
        if self.wall {
            text.blank();
            text.comment("computed: the speeds of the model are wall speeds");
            text.line("[wall]");
        }
        text.blank();
        text.line("[contact]");
        if !self.ends {
            text.line("curve = \"nose\"");
        }
        text.comment("guessed: the noses touch at the start; a run counts from the first contact, whatever the distance");
        text.line("gap = \"0mm\"");
        text.done()
    }

    fn train(&self, text: &mut Text, train: &ProposedTrain) {
        text.blank();
        text.line("[[train]]");
        text.line(&format!("name = {}", quoted(train.name)));
        text.value("speed", &train.speed_m_per_s, |v| quoted(&speed_text(*v)));
        if self.ends {
            text.comment(GAP);
            text.line("gap = \"0mm\"");
        } else if self.curves.len() > 1 {
            text.line("inner = \"inner\"");
        } else {
            text.comment("for more vehicles: inner = \"…\" with a curve of [curves] between them");
        }
        text.line("vehicles = [");
        for (k, vehicle) in train.vehicles.iter().enumerate() {
            let ends = match (self.ends, k) {
                (false, _) => "",
                (true, 0) => ", front = { curve = \"nose\" }, rear = { curve = \"inner\" }",
                (true, _) => ", ends = \"inner\"",
            };
            let mass = vehicle.mass_kg.value().map_or(String::new(), |kg| measure::text(*kg));
            text.line(&format!(
                "    {{ name = {}, mass = {}{ends} }},    # {}",
                quoted(&vehicle.name),
                quoted(&mass),
                vehicle.mass_kg
            ));
        }
        text.line("]");
    }
}

impl ProposedCurve {
    fn write(&self, text: &mut Text, ends: bool) {
        let [low, high] = self.range_m_per_s.map(km_per_h);
        text.comment(&format!(
            "model of {}, trained from {low} to {high} ({} speeds)",
            self.group,
            self.speed_kind.name()
        ));
        let mut keys = format!("model = {}", quoted(&self.model));
        if !self.parameters.is_empty() {
            text.comment("parameters of one of the runs");
            keys += &format!(", parameters = {}", inline(&self.parameters));
        }
        if self.name == "inner" && !ends {
            text.comment(GAP);
            keys += ", gap = \"0mm\"";
        }
        text.line(&format!("{} = {{ {keys} }}", self.name));
    }
}
