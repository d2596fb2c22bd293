//! The methods that are compared: FE's own curves, FDRM, NSDM, DDTCM and the best model.

use std::time::Instant;

use super::left_out::{LeftOutCase, query_of, rebounding};
use super::reference::Reference;
use super::validate::choose_and_fit;
use crate::curve::{Case, Envelope, ForceCurve, ForceKind};
use crate::dataset::{TrainingCase, TrainingSet};
use crate::error::Error;
use crate::nsdm::{self, Start, Target};
use crate::surrogate::forest::ForestOptions;
use crate::surrogate::max_crush::MaxCrushRule;
use crate::surrogate::{Model, ModelKind, PredictedCurve, Query, predict};
use crate::unit::km_per_h;
use crate::words::counted;

/// A method's curve at a left-out speed.
pub(super) struct Method {
    pub name: &'static str,
    /// What its curve was made from.
    pub made_from: String,
    pub curve: ForceCurve,
    /// FE's force and the method's, of one kind of force.
    pub forces: (Envelope, Envelope),
    pub times: Times,
}

/// Times that a method took.
#[derive(Clone, Copy)]
pub(super) struct Times {
    pub fit_s: f64,
    pub predict_s: f64,
    /// FE's time of the runs it needs, if not all.
    pub training_s: Option<f64>,
    /// Whether it saves an FE run at all.
    pub training: bool,
}

impl Default for Times {
    fn default() -> Self {
        Self { fit_s: 0.0, predict_s: 0.0, training_s: None, training: true }
    }
}

/// What a method took from a run: by its name too where more than speed may tell it from others.
fn fe_at(case: &Case) -> String {
    let (of, speed) = (case.origin(), km_per_h(case.conditions.speed.m_per_s));
    match case.conditions.parameters.is_empty() {
        true => format!("{of} at {speed}"),
        false => format!("{of} at {speed} ({})", case.id.name),
    }
}

/// FE's own curves: of the recipe's force, and of the body's motion where that is another; none if the motion was made of the force.
pub(super) fn of_fe(left_out: &LeftOutCase<'_>) -> Vec<Method> {
    let LeftOutCase { own, case, .. } = left_out;
    if case.moves_by_its_force() {
        return Vec::new();
    }
    let method = |name, curve, truth: &Envelope| Method {
        name,
        made_from: fe_at(case),
        curve,
        forces: (truth.clone(), truth.clone()),
        times: Times { training: false, ..Times::default() },
    };
    let declared = of_recipe(own, case.curves.force_kind);
    let mut methods = vec![method("fe", declared, &own.envelope)];
    if case.curves.force_kind == ForceKind::Contact {
        let recorded = ForceCurve::recorded(case);
        methods.extend(recorded.map(|curve| method("fe_body", curve, &own.motion.force)));
    }
    methods
}

/// The recipe's force of a case, rebounding as FE does.
fn of_recipe(case: &TrainingCase, force: ForceKind) -> ForceCurve {
    ForceCurve { kind: Some(force), ..rebounding(case, &case.envelope) }
}

/// The FE curve of one other speed, as it is.
pub(super) fn fdrm(left_out: &LeftOutCase<'_>, fixed: &TrainingCase, of: &Case) -> Method {
    Method {
        name: "fdrm",
        made_from: fe_at(of),
        curve: of_recipe(fixed, of.curves.force_kind),
        forces: (left_out.own.envelope.clone(), fixed.envelope.clone()),
        times: Times { training_s: fixed.solver_time_s(), ..Times::default() },
    }
}

/// A spring and damper fitted to one case by every seed.
pub(super) struct FittedNsdm {
    pub made_from: String,
    /// Motion that it was fitted to.
    pub reference: Reference,
    /// Each with the time it took, in s.
    pub fits: Vec<(nsdm::Fit, f64)>,
    /// FE's time of the run it was fitted to, in s.
    pub training_s: Option<f64>,
}

impl FittedNsdm {
    /// The fit with the least objective, as one who knows nothing of the new speed would choose.
    pub(crate) fn best(&self) -> &nsdm::Fit {
        let fits = self.fits.iter().map(|(fit, _)| fit);
        fits.min_by(|a, b| a.objective.total_cmp(&b.objective)).expect("at least one seed")
    }
}

/// Fits the spring and damper with every seed of the settings.
pub(super) fn fit_nsdm(fixed: &Case, settings: &ComparisonSettings) -> Result<FittedNsdm, Error> {
    let reference = Reference::of(fixed)?;
    let target = nsdm_target(&reference)?;
    let choices = nsdm::FitSettings { start: settings.nsdm_start, ..nsdm::FitSettings::default() };
    let mut fits = Vec::new();
    for seed in settings.nsdm_seeds() {
        let start = Instant::now();
        let fit = nsdm::fit(&target, &choices, seed)?;
        fits.push((fit, start.elapsed().as_secs_f64()));
    }
    let made_from = format!("fit to {}", fe_at(fixed));
    Ok(FittedNsdm { made_from, reference, fits, training_s: fixed.provenance.solver_wall_time_s })
}

/// The motion of a case that a spring and damper are fitted to: to 30 ms after its maximum
/// deflection.
pub(super) fn nsdm_target(reference: &Reference) -> Result<Target, Error> {
    let until = reference.inside;
    Target::new(
        reference.mass_kg,
        reference.speed_m_per_s,
        reference.time_s[..until].to_vec(),
        reference.velocity[..until].to_vec(),
        reference.acceleration[..until].to_vec(),
    )
}

/// The reference method's model: its forest, and its spline for the maximum crush where speed
/// alone differs.
pub(super) fn ddtcm_model(set: &TrainingSet, seed: u64) -> Result<Model, Error> {
    let options = ForestOptions { seed, ..ForestOptions::paper() };
    let mut model = Model::fit_curves(set, ModelKind::forest(options))?;
    model.max_crush_rule =
        if model.features.is_empty() { MaxCrushRule::Spline } else { MaxCrushRule::Motion };
    Ok(model)
}

/// The reference method: the recipe's force drives, as in the paper.
pub(super) fn ddtcm(left_out: &LeftOutCase<'_>, seed: u64) -> Result<Method, Error> {
    let start = Instant::now();
    let model = ddtcm_model(&left_out.rest, seed)?;
    let fit_s = start.elapsed().as_secs_f64();
    let rule = model.max_crush_rule;
    let (curve, predict_s) = predicted(left_out, &model, Some(rule))?;
    let driving = curve.driving(left_out.rest.force_kind)?;
    let made_from = format!("forest on {}", trained_on(left_out));
    method("ddtcm", made_from, left_out, &curve, driving, (fit_s, predict_s))
}

/// How many speeds, or cases of several designs, a model is trained on.
fn trained_on(left_out: &LeftOutCase<'_>) -> String {
    let rest = &left_out.rest;
    counted(rest.cases.len(), if rest.features.is_empty() { "speed" } else { "case" })
}

/// The model that leaving speeds out chooses among the others; the body force drives.
pub(super) fn best(
    left_out: &LeftOutCase<'_>,
    group: &str,
    others: &[Case],
    seed: u64,
) -> Result<Method, Error> {
    let start = Instant::now();
    let model = choose_and_fit(group, others, seed)?;
    let fit_s = start.elapsed().as_secs_f64();
    let (curve, predict_s) = predicted(left_out, &model, None)?;
    let driving = curve.driving(ForceKind::Body)?;
    let made_from = format!("{} on {}", curve.model, trained_on(left_out));
    method("best", made_from, left_out, &curve, driving, (fit_s, predict_s))
}

/// The model's curve at the left-out case, and the time it took in s.
fn predicted(
    left_out: &LeftOutCase<'_>,
    model: &Model,
    rule: Option<MaxCrushRule>,
) -> Result<(PredictedCurve, f64), Error> {
    let query = Query { rule, ..query_of(left_out.case, model) };
    let start = Instant::now();
    let curve = predict(model, &query)?;
    Ok((curve, start.elapsed().as_secs_f64()))
}

fn method(
    name: &'static str,
    made_from: String,
    left_out: &LeftOutCase<'_>,
    curve: &PredictedCurve,
    driving: ForceCurve,
    (fit_s, predict_s): (f64, f64),
) -> Result<Method, Error> {
    let forces = (left_out.own.envelope.clone(), curve.envelope()?);
    let times = Times { fit_s, predict_s, ..Times::default() };
    Ok(Method { name, made_from, curve: driving, forces, times })
}

/// How the methods are set up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ComparisonSettings {
    /// Seed of the forests, and first seed of the genetic algorithm.
    pub seed: u64,
    /// The one speed whose FE run FDRM and NSDM use, in m/s; the nearest other one if absent.
    pub fixed_speed_m_per_s: Option<f64>,
    /// Fits of the spring and damper, each with its own seed; none leaves NSDM out.
    pub nsdm_seeds: u64,
    /// Start of the genetic algorithm.
    pub nsdm_start: Start,
}

impl ComparisonSettings {
    pub(super) fn nsdm_seeds(&self) -> Vec<u64> {
        (0..self.nsdm_seeds).map(|k| self.seed.wrapping_add(k)).collect()
    }
}

impl Default for ComparisonSettings {
    fn default() -> Self {
        Self { seed: 0, fixed_speed_m_per_s: None, nsdm_seeds: 3, nsdm_start: Start::Random }
    }
}
