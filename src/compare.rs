//! Comparison at a left-out speed: FE against the curves of each method, in one MB model.

use std::time::Instant;

use serde::Serialize;

use crate::curve::rating::l1_ratio;
use crate::curve::{Case, Envelope, EnvelopeError};
use crate::dataset::{DatasetError, TrainingCase, TrainingSet, is_same_speed, nearest};
use crate::surrogate::forest::ForestOptions;
use crate::surrogate::max_crush::MaxCrushRule;
use crate::surrogate::predict::PredictError;
use crate::surrogate::{Model, ModelError, Options, predict};
use crate::unit::{SpeedKind, km_per_h};
use crate::validate::motion::{Driver, MotionError, Reference};
use crate::validate::{self, Choice, ValidateError, query_of};

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
    /// `fe` and `fe_body` (FE's own curves, of the recipe's force and of the body's: the floors
    /// of a one-mass model), `fdrm`, `ddtcm`, `best` (the model that validation chooses).
    pub method: &'static str,
    /// What its curve was made from.
    pub curve: String,
    pub velocity_l1: f64,
    /// Accelerations filtered with CFC 60.
    pub acceleration_l1: f64,
    /// Accelerations as central differences, not filtered.
    pub acceleration_unfiltered_l1: f64,
    /// Force of the method's curve along FE's crush, of the same kind of force.
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
    #[error("case \"{case}\" ended while loading: it is no reference; compare at another speed")]
    Truncated { case: String },
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Predict(#[from] PredictError),
    #[error(transparent)]
    Validate(#[from] ValidateError),
    #[error(transparent)]
    Motion(#[from] MotionError),
    #[error(transparent)]
    Envelope(#[from] EnvelopeError),
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
    let near = |v: f64| is_same_speed(v, speed_m_per_s);
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
    let own = &set.cases[index];
    let case = cases.iter().find(|c| c.name == own.name).ok_or(DatasetError::Empty)?;
    let reference = Reference::of(case)?;
    if own.truncated {
        return Err(CompareError::Truncated { case: own.name.clone() });
    }
    let mut rest = set.clone();
    rest.cases.retain(|c| !near(c.speed_m_per_s));
    if rest.cases.len() < 2 {
        return Err(CompareError::TooFew { cases: set.cases.len() });
    }
    let speed = case.speed.m_per_s;
    let with = |method, curve, candidate| row(method, curve, candidate, &reference);
    let mut rows = Vec::new();
    let made_from = format!("FE at {}", km_per_h(speed));
    rows.push(with("fe", made_from.clone(), Candidate::of_fe(own, &own.envelope, own))?);
    rows.push(with("fe_body", made_from, Candidate::of_fe(own, &own.motion.force, own))?);

    let speeds = rest.cases.iter().map(|c| c.speed_m_per_s);
    let nearest = &rest.cases[nearest(speeds, speed)];
    let made_from = format!("FE at {}", km_per_h(nearest.speed_m_per_s));
    rows.push(with("fdrm", made_from, Candidate::of_fe(nearest, &nearest.envelope, own))?);

    let options = Options::Forest(ForestOptions { seed, ..ForestOptions::paper() });
    let start = Instant::now();
    let model = Model::fit(&rest, options)?;
    let rule = match model.features.is_empty() {
        true => MaxCrushRule::Spline,
        false => MaxCrushRule::Motion,
    };
    let curve = predict(&model, &query_of(case, &model).with_rule(rule))?;
    let ddtcm = Candidate {
        declared: curve.envelope()?,
        driver: Driver::new(curve.envelope()?, Some(curve.stiffness_at_end(&curve.envelope()?))),
        truth: &own.envelope,
        time_s: start.elapsed().as_secs_f64(),
    };
    rows.push(with("ddtcm", format!("forest on {} speeds", rest.cases.len()), ddtcm)?);

    let others: Vec<Case> = cases.iter().filter(|c| !near(c.speed.m_per_s)).cloned().collect();
    let start = Instant::now();
    let model = validate::train(group, &others, Choice::Auto { seed, trees: None })?;
    let curve = predict(&model, &query_of(case, &model))?;
    let envelope = curve.driving_envelope()?;
    let best = Candidate {
        driver: Driver::new(envelope.clone(), Some(curve.stiffness_at_end(&envelope))),
        declared: curve.envelope()?,
        truth: &own.envelope,
        time_s: start.elapsed().as_secs_f64(),
    };
    rows.push(with("best", format!("{} on {} speeds", curve.model, rest.cases.len()), best)?);

    Ok(Comparison {
        group: group.into(),
        case: case.name.clone(),
        speed_m_per_s: speed,
        speed_kind: case.speed.kind,
        inner: index > 0 && index + 1 < set.cases.len(),
        mass_kg: case.masses.effective_kg(),
        window_s: reference.window_s(),
        reference_peak_force_n: case.peak_force_n(),
        reference_max_crush_m: case.max_deflection_m(),
        rows,
    })
}

/// A method's curve, and FE's own of the same kind of force.
struct Candidate<'a> {
    driver: Driver,
    /// What is held against FE's curve of the same kind of force.
    declared: Envelope,
    truth: &'a Envelope,
    time_s: f64,
}

impl<'a> Candidate<'a> {
    /// A measured curve with its own rebound, held against that of `own`.
    fn of_fe(from: &TrainingCase, envelope: &Envelope, own: &'a TrainingCase) -> Self {
        let is_body = *envelope == from.motion.force;
        Self {
            driver: Driver::rebounding(
                envelope.clone(),
                from.effective_mass_kg,
                from.motion.rebound_speed_m_per_s,
                from.unloading_stiffness_n_per_m,
            ),
            declared: envelope.clone(),
            truth: if is_body { &own.motion.force } else { &own.envelope },
            time_s: 0.0,
        }
    }
}

fn row(
    method: &'static str,
    curve: String,
    candidate: Candidate<'_>,
    reference: &Reference,
) -> Result<Row, CompareError> {
    let truth = candidate.truth;
    let along = truth.deflection_m();
    let force: Vec<f64> = along.iter().map(|&d| candidate.declared.force_at(d)).collect();
    let force_l1 = l1_ratio(truth.force_n(), &force);
    let start = Instant::now();
    let run = reference.run(&candidate.driver)?;
    let simulation_time_s = start.elapsed().as_secs_f64();
    let errors = reference.errors(&run)?;
    Ok(Row {
        method,
        curve,
        velocity_l1: errors.velocity_l1,
        acceleration_l1: errors.acceleration_l1,
        acceleration_unfiltered_l1: errors.acceleration_unfiltered_l1,
        force_l1,
        peak_force_n: run.interfaces[0].peak_force_n,
        max_crush_m: run.interfaces[0].max_deflection_m,
        curve_time_s: candidate.time_s,
        simulation_time_s,
    })
}
