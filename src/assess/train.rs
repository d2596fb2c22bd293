//! Trains: every method's curves in one scenario, against FE's run of the whole train.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use schemars::JsonSchema;
use serde::Serialize;

use super::error::{CompareError, TrainError};
use super::methods::{ddtcm_model, fit_nsdm};
use super::settings::ComparisonSettings;
use super::validate::{self, Choice};
use crate::curve::body::filtered;
use crate::curve::{Case, DrivingCurve};
use crate::database::Database;
use crate::dataset::TrainingSet;
use crate::file;
use crate::history::EntityId;
use crate::manifest::KeyPath;
use crate::multibody::simulate;
use crate::scenario::{
    self, CheckedScenario, CurveSource, DampingTable, EndName, InterfaceSpeed, LawName,
    ReferenceTable, Scenario, Sources,
};
use crate::signal::resample::interpolate;
use crate::signal::{derivative, l1_ratio};
use crate::solver::{self, ReadError, Selection, WantedId};
use crate::surrogate::Model;

/// FE's motion of a train: time from the first contact on, speeds positive in the direction
/// in which the first train moves.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FeTrain {
    pub time_s: Vec<f64>,
    /// Vehicle, as the scenario names it, and its speed in m/s at each time.
    pub velocities: Vec<(String, Vec<f64>)>,
    /// Time by the clock that FE took, in s.
    pub wall_time_s: Option<f64>,
}

impl FeTrain {
    /// Reads what a scenario's reference names; `path` is the scenario's.
    ///
    /// # Errors
    /// [`TrainError`] names the file, node or component.
    pub(crate) fn read(path: &Path, reference: &ReferenceTable) -> Result<Self, TrainError> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let file = folder.join(&reference.file);
        let selection = Selection {
            ids: Some(reference.nodes.values().map(|&id| WantedId { id, side: None }).collect()),
            components: Some(vec![reference.component.clone()]),
            ..Selection::all()
        };
        let read = solver::read(&file, None, &selection)?;
        let units = reference.units;
        let contact_s = reference.contact.map_or(0.0, |t| t.0);
        let first = read.time.iter().take_while(|&&t| t * units.time_s < contact_s).count();
        let time_s = read.time[first..].iter().map(|t| t * units.time_s - contact_s).collect();
        let mut velocities = Vec::new();
        for (name, &node) in &reference.nodes {
            let missing = || TrainError::NoHistory {
                path: file.clone(),
                node,
                component: reference.component.clone(),
            };
            let history = read.history(Some(EntityId::new(node)), &reference.component);
            let values = &history.ok_or_else(missing)?.values[first..];
            if values.iter().any(|v| !v.is_finite()) {
                return Err(missing());
            }
            velocities.push((name.clone(), values.iter().map(|v| v * units.speed()).collect()));
        }
        // The first train moves forwards, whichever way it went in FE.
        let fastest = velocities
            .iter()
            .filter_map(|(_, v): &(String, Vec<f64>)| v.first().copied())
            .fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
        if fastest < 0.0 {
            velocities.iter_mut().for_each(|(_, v)| v.iter_mut().for_each(|v| *v = -*v));
        }
        let case = file::read_text(&file.with_file_name("case.json"), 1 << 20).ok();
        let wall_time_s = case
            .and_then(|text| serde_json::from_str::<serde_json::Value>(&text).ok())
            .and_then(|case| case.get("engine_wall_time_s")?.as_f64());
        Ok(Self { time_s, velocities, wall_time_s })
    }
}

/// Every method in one train.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct TrainComparison {
    /// Compared from 0 to here.
    pub until_s: f64,
    /// Times of the comparison, in s.
    pub time_s: Vec<f64>,
    /// FE's speeds in m/s.
    pub fe: BTreeMap<String, Vec<f64>>,
    /// Time by the clock that FE took for the train, in s, if the run's folder tells.
    pub fe_time_s: Option<f64>,
    /// One row per method.
    pub rows: Vec<TrainRow>,
}

/// One method in the train.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct TrainRow {
    /// `fe_body`, `fdrm` (FE's curves of the scenario, of the body's motion and of the recipe's
    /// force), `nsdm`, `ddtcm`, `best_train`, `best_local` (curves for the trains' speed and for
    /// each interface's own).
    pub method: String,
    /// What drives its interfaces: `body force`, `recipe's force`, `spring and damper`.
    pub driven_by: String,
    /// Means over the vehicles of the two below.
    pub mean_velocity_l1: f64,
    /// Of the acceleration, filtered with CFC 60.
    pub mean_acceleration_l1: f64,
    /// Errors of each vehicle.
    pub vehicles: Vec<VehicleErrors>,
    /// Speed each interface's curve is for, in m/s; null where no speed belongs to it.
    pub interface_speeds_m_per_s: BTreeMap<String, Option<f64>>,
    /// Time to fit, in s.
    pub fit_time_s: f64,
    /// Curves and run.
    pub simulation_time_s: f64,
    /// What a user should know about its curves.
    pub warnings: Vec<String>,
    /// Speeds in m/s at the times of the comparison.
    pub velocities: BTreeMap<String, Vec<f64>>,
}

/// Errors of one vehicle, as `Σ|p − r|/Σ|r|`.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct VehicleErrors {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Of the velocity.
    pub velocity_l1: f64,
    /// CFC 60 on both sides.
    pub acceleration_l1: f64,
}

/// FE's vehicles begin at the scenario's speeds, but for this share.
const SAME_SPEED: f64 = 0.02;

/// A method: what it makes of the scenario and its sources.
struct Method<'a> {
    name: &'a str,
    driven_by: &'static str,
    scenario: Scenario,
    sources: Sources,
    fit_time_s: f64,
}

/// Runs `scenario`, whose curves are cases of a database, by every method, and compares the
/// vehicles' speeds with its reference.
///
/// # Errors
/// [`CompareError`] names the curve, vehicle or method.
pub fn compare_train(
    path: &Path,
    scenario: &CheckedScenario<'_>,
    settings: &ComparisonSettings,
) -> Result<TrainComparison, CompareError> {
    compared(path, scenario, settings).map_err(|error| match error {
        CompareError::Train(source) => match key(&source, scenario) {
            Some(key) => {
                let place = scenario.place(path, &key);
                TrainError::InScenario { place, source: source.into() }.into()
            }
            None => source.into(),
        },
        other => other,
    })
}

/// The key of the scenario that an error is about.
fn key(error: &TrainError, scenario: &Scenario) -> Option<KeyPath> {
    let reference = |key: &str| KeyPath::of("reference").key(key);
    let of_node = |id: i64| {
        let mut nodes = scenario.reference.iter().flat_map(|r| &r.nodes);
        let (name, _) = nodes.find(|(_, node)| **node == id)?;
        Some(reference("nodes").key(name))
    };
    Some(match error {
        TrainError::NotACase { curve } => KeyPath::of("curves").key(curve),
        TrainError::NoVehicle { name, .. } => reference("nodes").key(name).itself(),
        TrainError::OtherSpeed { vehicle, .. } => reference("nodes").key(vehicle),
        TrainError::NoHistory { node, .. } => of_node(*node)?,
        TrainError::TooShort { .. } => reference("until"),
        TrainError::RunTooShort { .. } => KeyPath::of("run.duration"),
        TrainError::NoNodes => reference("nodes"),
        TrainError::NoReference => KeyPath::default(),
        TrainError::Read(ReadError::NoSuchEntity { id, .. }) => of_node(id.id)?,
        TrainError::Read(ReadError::NoSuchComponent { .. }) => reference("component"),
        TrainError::Read(_) => reference("file"),
        TrainError::InScenario { .. } | TrainError::Scenario(_) | TrainError::Database(_) => {
            return None;
        }
    })
}

fn compared(
    path: &Path,
    scenario: &CheckedScenario<'_>,
    settings: &ComparisonSettings,
) -> Result<TrainComparison, CompareError> {
    let reference = scenario.reference.as_ref().ok_or(TrainError::NoReference)?;
    if reference.nodes.is_empty() {
        return Err(TrainError::NoNodes.into());
    }
    let fe = &FeTrain::read(path, reference).map_err(CompareError::from)?;
    for (name, speeds) in &fe.velocities {
        let train = scenario.train.iter().find(|t| t.vehicles.iter().any(|v| v.name == *name));
        if let (Some(train), Some(&fe_m_per_s)) = (train, speeds.first()) {
            let m_per_s = train.speed.0;
            if (fe_m_per_s - m_per_s).abs() > SAME_SPEED * m_per_s.abs().max(1.0) {
                let vehicle = name.clone();
                return Err(TrainError::OtherSpeed { vehicle, fe_m_per_s, m_per_s }.into());
            }
        }
    }
    let until_s = reference.until.map_or(f64::MAX, |t| t.0);
    let states = fe.time_s.iter().take_while(|&&t| t <= until_s * (1.0 + 1e-9)).count();
    if states < 3 {
        return Err(TrainError::TooShort { states, until_s }.into());
    }
    let time_s = &fe.time_s[..states];
    let sources = Sources::read(path, scenario)?;
    let mut rows = Vec::new();
    for method in methods(path, scenario, &sources, settings)? {
        rows.push(row(path, method, fe, time_s)?);
    }
    Ok(TrainComparison {
        until_s: time_s[states - 1],
        time_s: time_s.to_vec(),
        fe: fe.velocities.iter().map(|(n, v)| (n.clone(), v[..states].to_vec())).collect(),
        fe_time_s: fe.wall_time_s,
        rows,
    })
}

/// The case that each curve names and the group around it.
fn groups(
    path: &Path,
    scenario: &Scenario,
) -> Result<BTreeMap<String, (Case, Vec<Case>)>, CompareError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut groups = BTreeMap::new();
    for (name, table) in &scenario.curves {
        let not_a_case = || TrainError::NotACase { curve: name.clone() };
        let file = folder.join(table.database.as_ref().ok_or_else(not_a_case)?);
        let case = table.case.as_deref().and_then(|c| c.split_once('/'));
        let (group, case) = case.ok_or_else(not_a_case)?;
        let database = Database::read(&file).map_err(TrainError::from)?;
        let cases = database.group(&file, group).map_err(TrainError::from)?;
        let case = database.case(&file, group, case).map_err(TrainError::from)?;
        groups.insert(name.clone(), (case.clone(), cases.to_vec()));
    }
    Ok(groups)
}

fn methods<'a>(
    path: &Path,
    scenario: &Scenario,
    sources: &Sources,
    settings: &ComparisonSettings,
) -> Result<Vec<Method<'a>>, CompareError> {
    let groups = groups(path, scenario)?;
    // Every curve with the body's force, or with the recipe's.
    let with_body = || {
        let mut scenario = scenario.clone();
        scenario.curves.values_mut().for_each(|table| table.force = None);
        scenario
    };
    let with_declared = || {
        let mut scenario = scenario.clone();
        for (name, table) in &mut scenario.curves {
            table.force = groups.get(name).map(|(case, _)| case.force_kind);
        }
        scenario
    };
    let mut methods = Vec::new();
    let mut add = |name, driven_by, scenario, sources, fit_time_s| {
        methods.push(Method { name, driven_by, scenario, sources, fit_time_s });
    };
    add("fe_body", "body force", with_body(), sources.clone(), 0.0);
    add("fdrm", "recipe's force", with_declared(), sources.clone(), 0.0);

    if settings.nsdm_seeds > 0 {
        let start = Instant::now();
        let (scenario, springs) = with_nsdm(scenario, sources, &groups, settings)?;
        add("nsdm", "spring and damper", scenario, springs, start.elapsed().as_secs_f64());
    }

    let start = Instant::now();
    let forests = with_models(sources, &groups, |group, cases| {
        // Beyond the paper's speeds and masses the motion is asked for the maximal crush.
        Ok(ddtcm_model(&TrainingSet::new(group, cases)?, settings.seed)?)
    })?;
    let mut paper = with_declared();
    paper.run.interface_speed = InterfaceSpeed::Train;
    add("ddtcm", "recipe's force", paper, forests, start.elapsed().as_secs_f64());

    let start = Instant::now();
    let best = with_models(sources, &groups, |group, cases| {
        let choice = Choice::Auto { seed: settings.seed, trees: None };
        Ok(validate::train(group, cases, choice)?)
    })?;
    let fit_s = start.elapsed().as_secs_f64();
    for (name, speed) in
        [("best_train", InterfaceSpeed::Train), ("best_local", InterfaceSpeed::Local)]
    {
        let mut changed = with_body();
        changed.run.interface_speed = speed;
        add(name, "body force", changed, best.clone(), fit_s);
    }
    Ok(methods)
}

/// The sources with a model in place of every case, which `fit` makes of the case's group.
fn with_models(
    sources: &Sources,
    groups: &BTreeMap<String, (Case, Vec<Case>)>,
    fit: impl Fn(&str, &[Case]) -> Result<Model, CompareError>,
) -> Result<Sources, CompareError> {
    let mut models = sources.clone();
    for (name, (case, cases)) in groups {
        models.replace(name, CurveSource::Model(Box::new(fit(&case.group, cases)?)));
    }
    Ok(models)
}

/// The scenario and its curves with a spring and damper fitted to each case.
fn with_nsdm(
    scenario: &Scenario,
    sources: &Sources,
    groups: &BTreeMap<String, (Case, Vec<Case>)>,
    settings: &ComparisonSettings,
) -> Result<(Scenario, Sources), CompareError> {
    let (mut changed, mut springs) = (scenario.clone(), sources.clone());
    for (name, (case, _)) in groups {
        let fitted = fit_nsdm(case, settings)?;
        let fit = fitted.best();
        let Some(table) = changed.curves.get_mut(name) else { continue };
        table.law = LawName::Elastic;
        table.end = EndName::Slope;
        table.damping = Some(DampingTable {
            speed_m_per_s: fit.model.damping.nodes().to_vec(),
            coefficient_n_s_per_m: fit.model.damping.values().to_vec(),
        });
        let curve = DrivingCurve::of_body(fit.model.envelope()?);
        springs.replace(name, CurveSource::Curve(Box::new(curve)));
    }
    Ok((changed, springs))
}

fn row(
    path: &Path,
    method: Method<'_>,
    fe: &FeTrain,
    time_s: &[f64],
) -> Result<TrainRow, CompareError> {
    let start = Instant::now();
    let scenario = scenario::check(path, &method.scenario)?;
    let prepared = scenario::assemble(path, &scenario, &method.sources)?;
    let run = simulate(&prepared.chain, &prepared.settings)?;
    let simulation_time_s = start.elapsed().as_secs_f64();
    let bodies = prepared.chain.bodies();
    let (mut vehicles, mut velocities) = (Vec::new(), BTreeMap::new());
    for (name, reference) in &fe.velocities {
        let Some(i) = bodies.iter().position(|b| b.name == *name) else {
            let known: Vec<&str> = bodies.iter().map(|b| b.name.as_str()).collect();
            return Err(
                TrainError::NoVehicle { name: name.clone(), known: known.join(", ") }.into()
            );
        };
        let reference = &reference[..time_s.len()];
        let ours = interpolate(&run.time_s, &run.bodies[i].v_m_per_s, time_s).map_err(|_| {
            TrainError::RunTooShort {
                duration_s: run.time_s.last().copied().unwrap_or(0.0),
                until_s: time_s[time_s.len() - 1],
            }
        })?;
        let acceleration = |v: &[f64]| filtered(time_s, derivative(time_s, v));
        vehicles.push(VehicleErrors {
            vehicle: name.clone(),
            velocity_l1: l1_ratio(reference, &ours),
            acceleration_l1: l1_ratio(&acceleration(reference), &acceleration(&ours)),
        });
        velocities.insert(name.clone(), ours);
    }
    let mean = |of: fn(&VehicleErrors) -> f64| {
        vehicles.iter().map(of).sum::<f64>() / vehicles.len().max(1) as f64
    };
    let names = prepared.chain.interfaces().iter().map(|i| i.name.clone());
    let mut warnings = prepared.warnings.clone();
    warnings.extend(run.all_warnings());
    Ok(TrainRow {
        method: method.name.into(),
        driven_by: method.driven_by.into(),
        mean_velocity_l1: mean(|v| v.velocity_l1),
        mean_acceleration_l1: mean(|v| v.acceleration_l1),
        interface_speeds_m_per_s: names
            .zip(prepared.used.iter().map(|u| u.speed_m_per_s))
            .collect(),
        vehicles,
        fit_time_s: method.fit_time_s,
        simulation_time_s,
        warnings,
        velocities,
    })
}
