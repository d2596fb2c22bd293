//! Comparison at a left-out speed: FE against the curves of each method, in one MB model.

use std::time::Instant;

use serde::Serialize;

use crate::curve::rating::l1_ratio;
use crate::curve::resample::interpolate;
use crate::curve::{Case, Envelope, EnvelopeError};
use crate::dataset::{DatasetError, TrainingSet, nearest};
use crate::history::derivative;
use crate::multibody::integrator::DEFAULT_STEP_S;
use crate::multibody::{
    Body, Chain, ChainError, EnvelopeEnd, ForceLaw, Interface, Run, RunSettings, SimulationError,
    Unloading, simulate,
};
use crate::surrogate::forest::ForestOptions;
use crate::surrogate::max_crush::MaxCrushRule;
use crate::surrogate::predict::PredictError;
use crate::surrogate::{Model, ModelError, Options, Query, leave_one_out, predict};
use crate::unit::{SpeedKind, km_per_h};

/// The comparison ends this long after FE's largest deflection, so that rebound counts.
const AFTER_MAX_CRUSH_S: f64 = 0.030;
/// A speed names a case if it is within this share of the case's.
const SAME_SPEED: f64 = 1e-3;

/// Errors of every method at one left-out speed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    pub group: String,
    pub case: String,
    pub speed_m_per_s: f64,
    pub speed_kind: SpeedKind,
    /// Whether the other cases lie on both sides of the speed.
    pub inner: bool,
    /// Mass of the one-mass model: the body's, or the reduced mass of a pair.
    pub mass_kg: f64,
    /// From contact to 30 ms after FE's largest deflection, as far as the record reaches.
    pub window_s: f64,
    #[serde(rename = "reference_peak_force_N")]
    pub reference_peak_force_n: f64,
    pub reference_max_crush_m: f64,
    pub rows: Vec<Row>,
}

/// One method.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// `fe` (FE's own curve: the floor of a one-mass model), `fdrm`, `ddtcm`.
    pub method: &'static str,
    /// What its curve was made from.
    pub curve: String,
    pub velocity_l1: f64,
    pub acceleration_l1: f64,
    /// Force of the curve along FE's crush.
    pub force_l1: f64,
    #[serde(rename = "peak_force_N")]
    pub peak_force_n: f64,
    pub max_crush_m: f64,
    /// Time to make the curve, from the training cases on.
    pub curve_time_s: f64,
    /// Time of the MB run.
    pub simulation_time_s: f64,
}

/// Why there is no comparison.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    #[error("group \"{group}\" has no case at {asked}: it has {known}")]
    NoCase { group: String, asked: String, known: String },
    #[error("leaving out one of {cases} cases leaves too few: a comparison needs at least 3")]
    TooFew { cases: usize },
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Predict(#[from] PredictError),
    #[error(transparent)]
    Chain(#[from] ChainError),
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    #[error(transparent)]
    Envelope(#[from] EnvelopeError),
    #[error("case \"{case}\": {message}")]
    Record { case: String, message: String },
}

/// Compares the methods at `speed_m_per_s`, with that speed's case left out of training.
///
/// The model is one body against a wall, with the effective mass of the case; the
/// reference is FE's rate of deflection. Accelerations are central differences over the
/// sampled times of both, as FE's contact forces are means over two output intervals.
///
/// # Errors
/// [`CompareError`] lists the speeds there are if none fits.
pub fn compare(
    group: &str,
    cases: &[Case],
    speed_m_per_s: f64,
    seed: u64,
) -> Result<Comparison, CompareError> {
    let set = TrainingSet::new(group, cases)?;
    let near = |v: f64| (v / speed_m_per_s - 1.0).abs() <= SAME_SPEED;
    let index = set.cases.iter().position(|c| near(c.speed_m_per_s)).ok_or_else(|| {
        let known: Vec<String> = set.cases.iter().map(|c| km_per_h(c.speed_m_per_s)).collect();
        CompareError::NoCase {
            group: group.into(),
            asked: km_per_h(speed_m_per_s),
            known: known.join(", "),
        }
    })?;
    if set.cases.len() < 3 {
        return Err(CompareError::TooFew { cases: set.cases.len() });
    }
    let name = &set.cases[index].name;
    let case = cases.iter().find(|c| c.name == *name).ok_or(DatasetError::Empty)?;
    let reference = Reference::of(case)?;
    let rest = leave_one_out::without(&set, index);
    let speed = case.speed.m_per_s;
    let mut rows = Vec::new();
    let own = &set.cases[index];
    let stiffness = own.unloading_stiffness_n_per_m;
    let fe = Candidate { envelope: own.envelope.clone(), stiffness, time_s: 0.0 };
    rows.push(row("fe", format!("FE at {}", km_per_h(speed)), fe, case, &reference)?);

    let speeds = rest.cases.iter().map(|c| c.speed_m_per_s);
    let nearest = &rest.cases[nearest(speeds, speed)];
    let fdrm = Candidate {
        envelope: nearest.envelope.clone(),
        stiffness: nearest.unloading_stiffness_n_per_m,
        time_s: 0.0,
    };
    let made_from = format!("FE at {}", km_per_h(nearest.speed_m_per_s));
    rows.push(row("fdrm", made_from, fdrm, case, &reference)?);

    let options = Options::Forest(ForestOptions { seed, ..ForestOptions::paper() });
    let start = Instant::now();
    let model = Model::fit_only(&rest, options)?;
    let query = Query { speed_m_per_s: speed, mass_kg: None, rule: MaxCrushRule::Spline };
    let curve = predict(&model, &query)?;
    let ddtcm = Candidate {
        envelope: curve.envelope()?,
        stiffness: Some(curve.unloading_stiffness_n_per_m),
        time_s: start.elapsed().as_secs_f64(),
    };
    let made_from = format!("forest on {} speeds", rest.cases.len());
    rows.push(row("ddtcm", made_from, ddtcm, case, &reference)?);

    Ok(Comparison {
        group: group.into(),
        case: case.name.clone(),
        speed_m_per_s: speed,
        speed_kind: case.speed.kind,
        inner: index > 0 && index + 1 < set.cases.len(),
        mass_kg: case.masses.effective_kg(),
        window_s: reference.time_s[reference.time_s.len() - 1],
        reference_peak_force_n: case.peak_force_n(),
        reference_max_crush_m: case.max_deflection_m(),
        rows,
    })
}

/// FE's motion over the window of the comparison.
struct Reference {
    time_s: Vec<f64>,
    velocity: Vec<f64>,
    acceleration: Vec<f64>,
    /// FE's loading branch.
    envelope: Envelope,
}

impl Reference {
    fn of(case: &Case) -> Result<Self, CompareError> {
        let end_s = case.original.time_s()[case.loading_end()] + AFTER_MAX_CRUSH_S;
        let time_s: Vec<f64> =
            case.sampled.time_s().iter().copied().take_while(|&t| t <= end_s).collect();
        if time_s.len() < 3 {
            let message = format!("only {} states lie in the window", time_s.len());
            return Err(CompareError::Record { case: case.name.clone(), message });
        }
        let velocity = case.closing_speed_m_per_s[..time_s.len()].to_vec();
        let acceleration = derivative(&time_s, &velocity);
        Ok(Self { time_s, velocity, acceleration, envelope: case.loading()?.envelope })
    }
}

/// A method's curve.
struct Candidate {
    envelope: Envelope,
    stiffness: Option<f64>,
    time_s: f64,
}

fn row(
    method: &'static str,
    curve: String,
    candidate: Candidate,
    case: &Case,
    reference: &Reference,
) -> Result<Row, CompareError> {
    let along = reference.envelope.deflection_m();
    let force: Vec<f64> = along.iter().map(|&d| candidate.envelope.force_at(d)).collect();
    let force_l1 = l1_ratio(reference.envelope.force_n(), &force);
    let start = Instant::now();
    let run = one_mass(&candidate, case, reference)?;
    let simulation_time_s = start.elapsed().as_secs_f64();
    let out_of_range = |_| CompareError::Record {
        case: case.name.clone(),
        message: "the MB run is shorter than the window".into(),
    };
    let velocity = interpolate(&run.time_s, &run.bodies[0].v_m_per_s, &reference.time_s)
        .map_err(out_of_range)?;
    let acceleration = derivative(&reference.time_s, &velocity);
    Ok(Row {
        method,
        curve,
        velocity_l1: l1_ratio(&reference.velocity, &velocity),
        acceleration_l1: l1_ratio(&reference.acceleration, &acceleration),
        force_l1,
        peak_force_n: run.interfaces[0].peak_force_n,
        max_crush_m: run.interfaces[0].max_deflection_m,
        curve_time_s: candidate.time_s,
        simulation_time_s,
    })
}

/// One body of the case's effective mass against a wall, driven by the curve.
fn one_mass(
    candidate: &Candidate,
    case: &Case,
    reference: &Reference,
) -> Result<Run, CompareError> {
    let body = Body {
        name: "body".into(),
        mass_kg: case.masses.effective_kg(),
        speed_m_per_s: case.speed.m_per_s,
    };
    let envelope = candidate.envelope.clone();
    let stiffness_n_per_m = candidate.stiffness.unwrap_or_else(|| envelope.max_slope());
    let unloading = Unloading::Memory { stiffness_n_per_m };
    let interface = Interface {
        name: "body|wall".into(),
        law: ForceLaw::new(envelope, unloading, EnvelopeEnd::Hold),
        gap_m: 0.0,
    };
    let chain = Chain::new(vec![body], vec![interface])?;
    let time_s = &reference.time_s;
    let output_interval_s = time_s[1] - time_s[0];
    // One output more than the window needs, so that rounding cannot make it too short.
    let duration_s = time_s[time_s.len() - 1] + 1.5 * output_interval_s;
    let settings = RunSettings { duration_s, output_interval_s, step_s: DEFAULT_STEP_S };
    Ok(simulate(&chain, &settings)?)
}
