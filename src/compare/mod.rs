//! Comparison with FE: the curves of each method in one multi-body model, at a speed that is
//! left out ([`compare`]) and in a whole train ([`train`]).

mod row;
pub mod train;

use std::time::Instant;

use schemars::JsonSchema;
use serde::Serialize;

use crate::curve::{Case, EnvelopeError, ForceKind};
use crate::dataset::{DatasetError, TrainingSet, is_same_speed, nearest};
use crate::multibody::SimulationError;
use crate::nsdm::{self, Identifiability, NsdmError, Start, Target};
use crate::rating::{Rating, SignalError};
use crate::surrogate::forest::ForestOptions;
use crate::surrogate::max_crush::MaxCrushRule;
use crate::surrogate::predict::PredictError;
use crate::surrogate::{Model, ModelError, Options, predict};
use crate::unit::{SpeedKind, km_per_h};
use crate::validate::motion::{Driver, MotionError, Reference};
use crate::validate::{self, Choice, ValidateError, query_of};
use row::{Maker, Times};

/// How the methods are set up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Seed of the forests, and first seed of the genetic algorithm.
    pub seed: u64,
    /// The one speed whose FE run FDRM and NSDM use, in m/s; the nearest other one if absent.
    pub fixed_speed_m_per_s: Option<f64>,
    /// Fits of the spring and damper, each with its own seed; none leaves NSDM out.
    pub nsdm_seeds: u64,
    /// Start of the genetic algorithm.
    pub nsdm_start: Start,
}

impl Settings {
    fn nsdm_seeds(&self) -> Vec<u64> {
        (0..self.nsdm_seeds).map(|k| self.seed.wrapping_add(k)).collect()
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self { seed: 0, fixed_speed_m_per_s: None, nsdm_seeds: 3, nsdm_start: Start::Random }
    }
}

/// Errors of every method at one left-out speed.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
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
    /// Time by the clock that FE took for this run, in s; null where its case file is missing.
    pub fe_time_s: Option<f64>,
    /// The same of the runs that the curves were made from.
    pub training_time_s: Option<f64>,
    pub rows: Vec<Row>,
    pub nsdm: Option<NsdmReport>,
}

/// One method.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Row {
    /// `fe` and `fe_body` (FE's own curves, of the recipe's force and of the body's motion: the
    /// floors of a one-mass model), `fdrm`, `nsdm`, `ddtcm`, `best` (the model that validation
    /// chooses).
    pub method: String,
    /// What its curve was made from.
    pub curve: String,
    pub velocity_l1: f64,
    /// Accelerations filtered with CFC 60.
    pub acceleration_l1: f64,
    /// Accelerations as central differences, not filtered.
    pub acceleration_unfiltered_l1: f64,
    /// Force of the method's curve along FE's crush, of the same kind of force; null for a
    /// spring and damper.
    pub force_l1: Option<f64>,
    #[serde(rename = "peak_force_N")]
    pub peak_force_n: f64,
    pub max_crush_m: f64,
    /// Time to fit, from the training cases on.
    pub fit_time_s: f64,
    /// Time to predict the curve.
    pub predict_time_s: f64,
    /// Time of the multi-body run.
    pub simulation_time_s: f64,
    /// FE's time over that of prediction and run; null where FE's is not known.
    pub speed_up: Option<f64>,
    /// The same with the training runs and the fit counted.
    pub speed_up_with_training: Option<f64>,
    /// Every measure of the velocity.
    pub velocity: Rating,
    /// Every measure of the acceleration, CFC 60.
    pub acceleration: Rating,
}

/// What the fits of the spring and damper are worth.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct NsdmReport {
    pub fitted_to: String,
    pub fitted_at_m_per_s: f64,
    pub start: String,
    /// Of each seed: errors at the speed it was fitted at, and here.
    pub fits: Vec<NsdmFit>,
    /// How far the fits differ; null for fewer than three.
    #[schemars(with = "Option<serde_json::Value>")]
    pub identifiability: Option<Identifiability>,
}

/// One fit of the spring and damper.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct NsdmFit {
    pub seed: u64,
    pub own_velocity_l1: f64,
    pub own_acceleration_l1: f64,
    pub velocity_l1: f64,
    pub acceleration_l1: f64,
    pub fit_time_s: f64,
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
    #[error("the fixed curve is that of {asked}, the speed that is left out: choose another one")]
    FixedIsLeftOut { asked: String },
    #[error(transparent)]
    Validate(#[from] ValidateError),
    #[error(transparent)]
    Nsdm(#[from] NsdmError),
    #[error(transparent)]
    Signal(#[from] SignalError),
    #[error(transparent)]
    Train(#[from] train::TrainError),
}

/// Causes that validation names as well.
macro_rules! through_validate {
    ($($error:ty),*) => {$(
        impl From<$error> for CompareError {
            fn from(error: $error) -> Self {
                Self::Validate(error.into())
            }
        }
    )*};
}
through_validate!(DatasetError, ModelError, PredictError, MotionError);

impl From<EnvelopeError> for CompareError {
    fn from(error: EnvelopeError) -> Self {
        PredictError::from(error).into()
    }
}

impl From<SimulationError> for CompareError {
    fn from(error: SimulationError) -> Self {
        MotionError::from(error).into()
    }
}

/// The speeds of a group that lie between others, for a comparison at each, in m/s.
///
/// # Errors
/// [`CompareError`] if the cases are no training set.
pub fn inner_speeds(group: &str, cases: &[Case]) -> Result<Vec<f64>, CompareError> {
    let set = TrainingSet::new(group, cases)?;
    let mut speeds = set.speeds_m_per_s();
    speeds.dedup_by(|a, b| is_same_speed(*a, *b));
    match speeds.len() {
        0..3 => Err(CompareError::TooFew { cases: speeds.len() }),
        n => Ok(speeds[1..n - 1].to_vec()),
    }
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
    settings: &Settings,
) -> Result<Comparison, CompareError> {
    let set = TrainingSet::new(group, cases)?;
    let no_case = |asked: f64, speeds: Vec<f64>| CompareError::NoCase {
        group: group.into(),
        asked: km_per_h(asked),
        known: speeds.into_iter().map(km_per_h).collect::<Vec<_>>().join(", "),
    };
    let near = |v: f64| is_same_speed(v, speed_m_per_s);
    let index = set
        .cases
        .iter()
        .position(|c| near(c.speed_m_per_s))
        .ok_or_else(|| no_case(speed_m_per_s, set.speeds_m_per_s()))?;
    if set.cases.len() < 3 {
        return Err(CompareError::TooFew { cases: set.cases.len() });
    }
    let own = &set.cases[index];
    let find = |name: &str| cases.iter().find(|c| c.name == name).ok_or(DatasetError::Empty);
    let case = find(&own.name)?;
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
    let fixed_at = settings.fixed_speed_m_per_s.unwrap_or_else(|| {
        rest.cases[nearest(rest.cases.iter().map(|c| c.speed_m_per_s), speed)].speed_m_per_s
    });
    if near(fixed_at) {
        return Err(CompareError::FixedIsLeftOut { asked: km_per_h(fixed_at) });
    }
    let fixed = rest
        .cases
        .iter()
        .find(|c| is_same_speed(c.speed_m_per_s, fixed_at))
        .ok_or_else(|| no_case(fixed_at, rest.speeds_m_per_s()))?;
    let fixed_case = find(&fixed.name)?;
    let fe_time = |c: &Case| c.solver_wall_time_s;
    let training_time_s: Option<f64> = rest
        .cases
        .iter()
        .map(|c| find(&c.name).ok().and_then(fe_time))
        .collect::<Option<Vec<f64>>>()
        .map(|times| times.iter().sum());
    let maker = Maker { reference: &reference, fe_time_s: fe_time(case), training_time_s };

    let mut rows = Vec::new();
    let fe = |from: &crate::dataset::TrainingCase| {
        let v = from.motion.rebound_speed_m_per_s;
        let other = from.unloading_stiffness_n_per_m;
        Driver::rebounding(from.envelope.clone(), from.effective_mass_kg, v, other)
    };
    let made_from = format!("FE at {}", km_per_h(speed));
    let none = Times { training: false, ..Times::default() };
    let truth = Some((&own.envelope, &own.envelope));
    rows.push(maker.row("fe", &made_from, &fe(own), truth, none)?);
    if case.force_kind == ForceKind::Contact
        && let Some(driver) = Driver::recorded(case)
    {
        let truth = Some((&own.motion.force, &own.motion.force));
        rows.push(maker.row("fe_body", &made_from, &driver, truth, none)?);
    }
    let made_from = format!("FE at {}", km_per_h(fixed.speed_m_per_s));
    let one_run = Times { training_s: fe_time(fixed_case), ..Times::default() };
    let truth = Some((&own.envelope, &fixed.envelope));
    rows.push(maker.row("fdrm", &made_from, &fe(fixed), truth, one_run)?);

    let mut report = None;
    if settings.nsdm_seeds > 0 {
        let (row, nsdm) = fit_nsdm(&maker, fixed_case, settings, &made_from)?;
        rows.push(row);
        report = Some(nsdm);
    }

    let options = Options::Forest(ForestOptions { seed: settings.seed, ..ForestOptions::paper() });
    let start = Instant::now();
    let model = Model::fit(&rest, options)?;
    let fit_s = start.elapsed().as_secs_f64();
    let rule = match model.features.is_empty() {
        true => MaxCrushRule::Spline,
        false => MaxCrushRule::Motion,
    };
    let start = Instant::now();
    let curve = predict(&model, &query_of(case, &model).with_rule(rule))?;
    let envelope = curve.envelope()?;
    let times = Times { fit_s, predict_s: start.elapsed().as_secs_f64(), ..Times::default() };
    let driver = Driver::new(envelope.clone(), Some(curve.stiffness_at_end(&envelope)));
    let made_from = format!("forest on {} speeds", rest.cases.len());
    rows.push(maker.row("ddtcm", &made_from, &driver, Some((&own.envelope, &envelope)), times)?);

    let others: Vec<Case> = cases.iter().filter(|c| !near(c.speed.m_per_s)).cloned().collect();
    let start = Instant::now();
    let model = validate::train(group, &others, Choice::Auto { seed: settings.seed, trees: None })?;
    let fit_s = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let curve = predict(&model, &query_of(case, &model))?;
    let driving = curve.driving_envelope()?;
    let times = Times { fit_s, predict_s: start.elapsed().as_secs_f64(), ..Times::default() };
    let driver = Driver::new(driving.clone(), Some(curve.stiffness_at_end(&driving)));
    let made_from = format!("{} on {} speeds", curve.model, rest.cases.len());
    let declared = curve.envelope()?;
    rows.push(maker.row("best", &made_from, &driver, Some((&own.envelope, &declared)), times)?);

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
        fe_time_s: fe_time(case),
        training_time_s,
        rows,
        nsdm: report,
    })
}

/// The motion of a case that a spring and damper are fitted to: to 30 ms after its largest
/// deflection.
pub(crate) fn nsdm_target(reference: &Reference) -> Result<Target, NsdmError> {
    let until = reference.inside();
    Target::new(
        reference.mass_kg(),
        reference.speed_m_per_s(),
        reference.time_s()[..until].to_vec(),
        reference.velocity()[..until].to_vec(),
        reference.acceleration()[..until].to_vec(),
    )
}

/// Fits with every seed; the row is that of the fit with the least objective, as one who
/// knows nothing of the new speed would choose.
fn fit_nsdm(
    maker: &Maker<'_>,
    fixed: &Case,
    settings: &Settings,
    made_from: &str,
) -> Result<(Row, NsdmReport), CompareError> {
    let own = Reference::of(fixed)?;
    let target = nsdm_target(&own)?;
    let choices = nsdm::FitSettings { start: settings.nsdm_start, ..nsdm::FitSettings::default() };
    let mut fits = Vec::new();
    for seed in settings.nsdm_seeds() {
        let start = Instant::now();
        let fit = nsdm::fit(&target, &choices, seed)?;
        fits.push((fit, start.elapsed().as_secs_f64()));
    }
    let errors_at = |fit: &nsdm::Fit, at: &Reference| -> Result<_, CompareError> {
        let motion = fit.model.run(at.mass_kg(), at.speed_m_per_s(), at.time_s())?;
        Ok(at.errors_of(&motion.v_m_per_s))
    };
    let mut lines = Vec::new();
    for (fit, fit_time_s) in &fits {
        let (own, here) = (errors_at(fit, &own)?, errors_at(fit, maker.reference)?);
        lines.push(NsdmFit {
            seed: fit.seed,
            own_velocity_l1: own.velocity_l1,
            own_acceleration_l1: own.acceleration_l1,
            velocity_l1: here.velocity_l1,
            acceleration_l1: here.acceleration_l1,
            fit_time_s: *fit_time_s,
        });
    }
    let best = fits
        .iter()
        .min_by(|a, b| a.0.objective.total_cmp(&b.0.objective))
        .ok_or(DatasetError::Empty)?;
    let row = maker.of_nsdm(
        &best.0.model,
        &format!("fit to {made_from}"),
        Times {
            // All seeds: one alone would not say which is best.
            fit_s: fits.iter().map(|(_, seconds)| seconds).sum(),
            training_s: fixed.solver_wall_time_s,
            ..Times::default()
        },
    )?;
    let all: Vec<nsdm::Fit> = fits.iter().map(|(fit, _)| fit.clone()).collect();
    let report = NsdmReport {
        fitted_to: fixed.name.clone(),
        fitted_at_m_per_s: fixed.speed.m_per_s,
        start: match settings.nsdm_start {
            Start::Random => "random".into(),
            Start::LeastSquares => "least squares".into(),
        },
        fits: lines,
        identifiability: Identifiability::of(&all).ok(),
    };
    Ok((row, report))
}
