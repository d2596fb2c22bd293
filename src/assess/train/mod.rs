//! Trains: every method's curves in one scenario, against FE's run of the whole train.

mod methods;
mod row;

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use super::methods::ComparisonSettings;
use crate::curve::body::can_filter;
use crate::curve::contact::milliseconds;
use crate::error::{Error, KeyPath, error};
use crate::file;
use crate::history::EntityId;
use crate::scenario::{CheckedScenario, ReferenceTable, Sources};
use crate::signal::interpolate;
use crate::solver::{self, Selection, WantedId};
use methods::methods;
use row::row;

/// Every method in one train.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct TrainComparison {
    /// Compared from 0 to here.
    pub until_s: f64,
    /// Times of the comparison, in s.
    pub time_s: Vec<f64>,
    /// FE's speeds in m/s.
    pub fe: BTreeMap<String, Vec<f64>>,
    /// Wall-clock time of FE for the train, in s, if the run's folder has it.
    pub fe_time_s: Option<f64>,
    /// What of the reference does not fit the scenario.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// One row per method.
    pub rows: Vec<TrainRow>,
}

impl TrainComparison {
    /// The filter of the accelerations.
    pub(crate) fn filter(&self) -> &'static str {
        if can_filter(&self.time_s) { "CFC 60" } else { "unfiltered" }
    }
}

/// One method in the train.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct TrainRow {
    /// `fe_body`, `fdrm` (FE's curves of the scenario, of the body's motion and of the recipe's
    /// force), `nsdm`, `ddtcm`, `best_train`, `best_local` (curves for the trains' speed and for
    /// each interface's own), `rate_live` (the force follows the run's closing speeds), `split_ends`
    /// (each vehicle with two ends of the models; not in a scenario with crush zones of its own). The last two
    /// only if every group has a crush law.
    pub method: String,
    /// What drives its interfaces: `body force`, `recipe's force`, `spring and damper`, `crush
    /// force`.
    pub driven_by: String,
    /// Means over the vehicles of the errors below.
    pub mean_velocity_l1: f64,
    /// Of the mean difference, in m/s.
    pub mean_velocity_difference_m_per_s: f64,
    /// The same as a share of the fastest vehicle's first speed.
    pub mean_velocity_share_of_initial: f64,
    /// Of the acceleration, filtered with CFC 60 where FE's output allows it.
    pub mean_acceleration_l1: f64,
    /// Errors of each vehicle.
    pub(crate) vehicles: Vec<VehicleErrors>,
    /// Crush and energy between vehicles, and before the wall.
    pub(crate) interfaces: Vec<InterfaceCrush>,
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
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct VehicleErrors {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Of the velocity.
    pub velocity_l1: f64,
    /// Mean `|p − r|` of the velocity, in m/s: where FE's speed is near zero a ratio says more than
    /// there is.
    pub velocity_difference_m_per_s: f64,
    /// The same as a share of the fastest vehicle's first speed.
    pub velocity_share_of_initial: f64,
    /// CFC 60 on both sides, where FE's output allows it.
    pub acceleration_l1: f64,
}

/// What is crushed between two vehicles, or a vehicle and the wall, up to the end of the comparison.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct InterfaceCrush {
    /// `A1|A2`.
    pub interface: String,
    /// Maximum approach of the two vehicles minus the gap, in m: both ends together.
    pub crush_m: f64,
    /// FE's, from the speeds of its nodes; null where the reference does not name both vehicles.
    pub fe_crush_m: Option<f64>,
    /// Work of the forces between the two vehicles, in J.
    #[serde(rename = "work_J")]
    pub work_j: f64,
}

/// FE's vehicles begin at the scenario's speeds, but for this share.
const SAME_SPEED: f64 = 0.02;

/// Runs `scenario`, whose curves are cases of a database, by every method, and compares the
/// vehicles' speeds with its reference.
///
/// # Errors
/// It names the curve, vehicle or method.
pub fn compare_train(
    path: &Path,
    scenario: &CheckedScenario<'_>,
    settings: &ComparisonSettings,
) -> Result<TrainComparison, Error> {
    compared(path, scenario, settings)
        .map_err(|error| error.placed_if_keyed(|key| scenario.place(path, key)))
}

fn compared(
    path: &Path,
    scenario: &CheckedScenario<'_>,
    settings: &ComparisonSettings,
) -> Result<TrainComparison, Error> {
    let reference = scenario.reference.as_ref().ok_or_else(|| {
        error!(
            Comparison,
            "the scenario has no [reference]: add one that names FE's run of the train"
        )
        .placed(|key| scenario.place(path, key))
    })?;
    if reference.nodes.is_empty() {
        return Err(error!(
            Comparison,
            "[reference] nodes names no vehicle: write nodes = {{ A1 = 900001 }}"
        )
        .at_key("reference.nodes"));
    }
    let speed = |name: &str| {
        let train = scenario.train.iter().find(|t| t.vehicles.iter().any(|v| v.name == *name));
        train.map(|train| train.speed.0)
    };
    let fe = &FeTrain::read(path, reference, speed)?;
    for (name, speeds) in &fe.velocities {
        if let (Some(m_per_s), Some(&fe_m_per_s)) = (speed(name), speeds.first())
            && (fe_m_per_s - m_per_s).abs() > SAME_SPEED * m_per_s.abs().max(1.0)
        {
            return Err(error!(Comparison, "in FE's record {name} starts at {fe_m_per_s:.3} m/s, in the scenario at {m_per_s:.3} m/s: check units, nodes and speeds").at(KeyPath::of("reference.nodes").key(name)));
        }
    }
    let until_s = reference.until.map_or(f64::MAX, |t| t.0);
    let states = fe.time_s.iter().take_while(|&&t| t <= until_s * (1.0 + 1e-9)).count();
    if states < 3 {
        let states = crate::words::counted(states, "state");
        return Err(match reference.until {
            Some(_) => error!(
                Comparison at "reference.until",
                "FE's record has {states} up to {until_s} s: at least 3 are needed"
            ),
            None => error!(
                Comparison at "reference.contact",
                "FE's record has {states} from the contact on: at least 3 are needed"
            ),
        });
    }
    let time_s = &fe.time_s[..states];
    let mut warnings = fe.warnings.clone();
    let interval_s = time_s[states - 1] - time_s[states - 2];
    let is_whole = states == fe.time_s.len();
    if is_whole && until_s < f64::MAX && until_s > time_s[states - 1] + interval_s {
        warnings.push(format!(
            "reference: FE's record ends at {}, before until",
            milliseconds(time_s[states - 1])
        ));
    }
    if !can_filter(time_s) {
        warnings.push("reference: FE's output is too coarse for CFC 60: accelerations are compared as they are, unfiltered".into());
    }
    let sources = Sources::read(path, scenario)?;
    let mut rows = Vec::new();
    for method in methods(path, scenario, &sources, settings)? {
        rows.push(row(path, method, fe, time_s)?);
    }
    warnings.extend(rows.first().into_iter().flat_map(|row| misfits(fe, time_s, row)));
    Ok(TrainComparison {
        until_s: time_s[states - 1],
        time_s: time_s.to_vec(),
        fe: fe.velocities.iter().map(|(n, v)| (n.clone(), v[..states].to_vec())).collect(),
        fe_time_s: fe.wall_time_s,
        warnings,
        rows,
    })
}

/// Another order of the nodes, or another time of the contact, that fits so much better is reported.
const SWAPPED: f64 = 0.5;
const SHIFTED: f64 = 0.6;
/// Times by which FE's record is shifted to see whether it fits better, in s.
const SHIFTS_S: (f64, i32) = (0.001, 50);

/// Vehicles of the reference whose nodes may be swapped, and a record that begins at another time than
/// the contact; seen by the run of the first method.
fn misfits(fe: &FeTrain, time_s: &[f64], row: &TrainRow) -> Vec<String> {
    let mut warnings = Vec::new();
    let off =
        |fe: &[f64], ours: &[f64]| -> f64 { fe.iter().zip(ours).map(|(a, b)| (a - b).abs()).sum() };
    for (i, (one, own)) in fe.velocities.iter().enumerate() {
        for (other, others) in &fe.velocities[i + 1..] {
            let (Some(a), Some(b)) = (row.velocities.get(one), row.velocities.get(other)) else {
                continue;
            };
            let (straight, crossed) = (off(own, a) + off(others, b), off(own, b) + off(others, a));
            if crossed < SWAPPED * straight {
                warnings.push(format!(
                    "reference: FE's record of {one} matches {other} in the run, and that of {other} matches {one}: their nodes may be swapped"
                ));
            }
        }
    }
    let shifted = |shift_s: f64| -> f64 {
        let own: Vec<f64> = fe.time_s.iter().map(|t| t + shift_s).collect();
        let common: Vec<usize> = (0..time_s.len())
            .filter(|&i| time_s[i] >= own[0] && time_s[i] <= own[own.len() - 1])
            .collect();
        let at: Vec<f64> = common.iter().map(|&i| time_s[i]).collect();
        let of = |(name, speeds): &(String, Vec<f64>)| {
            let ours = row.velocities.get(name)?;
            let fe = interpolate(&own, speeds, &at).ok()?;
            let ours: Vec<f64> = common.iter().map(|&i| ours[i]).collect();
            Some(off(&fe, &ours) / at.len().max(1) as f64)
        };
        fe.velocities.iter().filter_map(of).sum()
    };
    let best = (-SHIFTS_S.1..=SHIFTS_S.1)
        .map(|k| f64::from(k) * SHIFTS_S.0)
        .map(|shift_s| (shifted(shift_s), shift_s))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((error, shift_s)) = best.filter(|(error, _)| *error < SHIFTED * shifted(0.0)) {
        warnings.push(format!(
            "reference: FE's record fits better by {:.0} % when it is shifted by {:+.0} ms: check contact in [reference]",
            100.0 * (1.0 - error / shifted(0.0)),
            shift_s * 1e3
        ));
    }
    warnings
}

/// FE's motion of a train: time from the first contact on, speeds with the signs of the scenario's.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FeTrain {
    pub time_s: Vec<f64>,
    /// Vehicle, as the scenario names it, and its speed in m/s at each time.
    pub velocities: Vec<(String, Vec<f64>)>,
    /// Wall-clock time of FE, in s.
    pub wall_time_s: Option<f64>,
    /// Damage of its file.
    pub warnings: Vec<String>,
}

impl FeTrain {
    /// Speed of the fastest vehicle at the contact, in m/s.
    pub(super) fn fastest_m_per_s(&self) -> f64 {
        let firsts = self.velocities.iter().filter_map(|(_, v)| v.first());
        firsts.fold(0.0, |most: f64, v| most.max(v.abs()))
    }

    /// Reads what a scenario's reference names; `path` is the scenario's, and `speed` that of each vehicle in it, in m/s.
    fn read(
        path: &Path,
        reference: &ReferenceTable,
        speed: impl Fn(&str) -> Option<f64>,
    ) -> Result<Self, Error> {
        let mut named: BTreeMap<i64, &str> = BTreeMap::new();
        for (name, &node) in &reference.nodes {
            if let Some(other) = named.insert(node, name) {
                return Err(error!(
                    Comparison,
                    "node {node} is named for {other} already: each vehicle has its own"
                )
                .at(KeyPath::of("reference.nodes").key(name)));
            }
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        let file = folder.join(&reference.file);
        let selection = Selection {
            ids: Some(reference.nodes.values().map(|&id| WantedId { id, side: None }).collect()),
            components: Some(vec![reference.component.clone()]),
            ..Selection::all()
        };
        let mut sections = solver::read_sections(&file, None, &selection).map_err(|error| {
            // Ids were selected in the order of the nodes.
            let mut nodes = reference.nodes.keys().enumerate();
            let node = nodes.find(|(k, _)| *error.key() == KeyPath::of("ids").item(*k));
            let key = match node {
                Some((_, name)) => KeyPath::of("nodes").key(name),
                None if error.is_about("component") => KeyPath::of("component"),
                None => KeyPath::of("file"),
            };
            error.at(KeyPath::of("reference").then(key))
        })?;
        // Of a binary file; a text file has one section.
        let of_nodes = sections.iter().position(|section| section.section == "nodout");
        let read = sections.swap_remove(of_nodes.unwrap_or(0));
        let units = reference.units;
        let contact_s = reference.contact.map_or(0.0, |t| t.0);
        let first = read.time.iter().take_while(|&&t| t * units.time_s < contact_s).count();
        let time_s = read.time[first..].iter().map(|t| t * units.time_s - contact_s).collect();
        let mut velocities = Vec::new();
        for (name, &node) in &reference.nodes {
            let missing = || {
                error!(Comparison, "{path}: node {node} has no complete {component}: see crumple inspect, and name another node or component in [reference]", component = reference.component, path = file.display()).at(KeyPath::of("reference.nodes").key(name))
            };
            let history = read.history(Some(EntityId::new(node)), &reference.component);
            let values = &history.ok_or_else(missing)?.values[first..];
            if values.iter().any(|v| !v.is_finite()) {
                return Err(missing());
            }
            velocities.push((name.clone(), values.iter().map(|v| v * units.speed()).collect()));
        }
        // Trains may go either way in FE.
        let off = |sign: f64| -> f64 {
            let off =
                |(name, v): &(String, Vec<f64>)| Some((sign * v.first()? - speed(name)?).abs());
            velocities.iter().filter_map(off).sum()
        };
        if off(-1.0) < off(1.0) {
            velocities.iter_mut().for_each(|(_, v)| v.iter_mut().for_each(|v| *v = -*v));
        }
        let case = file::read_text(&file.with_file_name("case.json"), 1 << 20).ok();
        let wall_time_s = case
            .and_then(|text| text.parse::<serde_json::Value>().ok())
            .and_then(|case| case.get("engine_wall_time_s")?.as_f64());
        let warnings = read.problems.iter().map(|p| format!("{}: {p}", file.display())).collect();
        Ok(Self { time_s, velocities, wall_time_s, warnings })
    }
}
