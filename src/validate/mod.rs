//! Validation: every model at every speed that is left out, and the model that is chosen.

pub mod choose;
pub mod motion;

use std::collections::BTreeMap;

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use crate::curve::{Case, Envelope, ForceKind, Parameter};
use crate::dataset::{DatasetError, OTHER_MASS, TrainingCase, TrainingSet, grid, is_same_speed};
use crate::signal::l1_ratio;
use crate::signal::peaks::matched_peaks;
use crate::surrogate::band::{self, Band, LeftOutSpeeds, Residuals};
use crate::surrogate::forest::ForestOptions;
use crate::surrogate::leave_one_out::{Floor, LeftOut, Means, PeakError, Validation};
use crate::surrogate::max_crush::MaxCrushRule;
use crate::surrogate::predict::PredictError;
use crate::surrogate::{Model, ModelError, Options, PredictedCurve, Query, predict};
use crate::unit::km_per_h;
use choose::{NextRun, choose};
use motion::{Driver, MotionError, MotionErrors, Reference};

/// Fewest steps along FE's crush at which forces are compared.
const STEPS: usize = 400;

/// Why there is no validation or no model.
#[derive(Debug, thiserror::Error)]
pub enum ValidateError {
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Predict(#[from] PredictError),
    #[error(transparent)]
    Motion(#[from] MotionError),
    #[error("without this speed: {0}")]
    NotFitted(String),
    #[error("its errors against FE are no finite numbers")]
    NotFinite,
}

/// What `crumple validate --json` prints.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Report {
    /// In the order of the database.
    pub groups: Vec<GroupReport>,
}

/// One group: its table, or why there is none.
#[derive(Debug, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum GroupReport {
    Validated {
        #[serde(flatten)]
        validation: Box<Validation>,
        /// Absent if it was not asked for, or if there is no gap to run in.
        #[serde(skip_serializing_if = "Option::is_none")]
        next_run: Option<NextRun>,
    },
    Failed {
        group: String,
        error: String,
    },
}

/// The models that `auto` chooses among; `forest` is the reference method's.
pub fn candidates(seed: u64) -> Vec<Options> {
    vec![
        Options::Nearest,
        Options::Linear,
        Options::Rate,
        Options::Registered,
        Options::Extra(ForestOptions { seed, ..ForestOptions::extra() }),
        Options::Forest(ForestOptions { seed, ..ForestOptions::paper() }),
        Options::Gp,
    ]
}

/// Which model to train.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Choice {
    /// The one that leave-one-speed-out chooses; seed of the forests, and their number of trees
    /// if not their own.
    Auto { seed: u64, trees: Option<usize> },
    /// This one; it is validated beside `nearest` and `linear`.
    Options(Options),
}

/// Fits the chosen model to a group, with its validation.
///
/// # Errors
/// [`ValidateError`] if the cases are no training set, or too few for the model.
pub fn train(group: &str, cases: &[Case], choice: Choice) -> Result<Model, ValidateError> {
    let set = TrainingSet::new(group, cases)?;
    let (options, validation) = match choice {
        Choice::Auto { seed, trees } => {
            let mut candidates = candidates(seed);
            for options in &mut candidates {
                if let (Options::Forest(f) | Options::Extra(f), Some(trees)) = (options, trees) {
                    f.trees = trees;
                }
            }
            let validation = validate(group, cases, &candidates, None)?;
            let chosen = candidates.into_iter().find(|o| o.name() == validation.chosen);
            (chosen.unwrap_or(Options::Nearest), validation)
        }
        Choice::Options(options) => {
            // What the model itself refuses is said before it is validated.
            Model::fit(&set, options)?;
            let mut candidates = vec![Options::Nearest, Options::Linear, options];
            candidates.dedup();
            if options == Options::Nearest {
                candidates.truncate(2);
            }
            (options, validate(group, cases, &candidates, Some(options.name()))?)
        }
    };
    // Only the model that is kept needs the members of its leaves.
    let options = match options {
        Options::Forest(forest) => Options::Forest(ForestOptions { quantiles: true, ..forest }),
        other => other,
    };
    let mut model = Model::fit(&set, options)?;
    if let Some(means) = validation.means.iter().find(|m| m.model == options.name()) {
        model.max_crush_rule = means.max_crush_rule;
    }
    model.leave_one_out = Some(validation);
    Ok(model)
}

/// Leaves every speed out in turn and predicts it by every candidate.
///
/// A model that cannot be fitted to the group, or has no answer at a speed, is noted with the
/// reason; one without an answer at every inner speed has no means and cannot be chosen. `keep`
/// names the model that counts as chosen, whatever its errors.
///
/// # Errors
/// [`ValidateError`] if the cases are no training set.
pub fn validate(
    group: &str,
    cases: &[Case],
    candidates: &[Options],
    keep: Option<&str>,
) -> Result<Validation, ValidateError> {
    let set = TrainingSet::new(group, cases)?;
    let mut speeds = set.speeds_m_per_s();
    speeds.dedup_by(|a, b| is_same_speed(*a, *b));
    let mut notes = Vec::new();
    let mut fitting = Vec::new();
    for options in candidates {
        match Model::fit(&set, *options) {
            Ok(_) => fitting.push(*options),
            Err(error) => notes.push(format!("{}: {error}", options.name())),
        }
    }
    let mut left_out = Vec::new();
    if speeds.len() < 3 {
        let found = speeds.len();
        let s = if found == 1 { "" } else { "s" };
        notes.push(format!("the group has {found} speed{s}: leaving one out needs at least 3"));
    } else {
        left_out = (0..set.cases.len())
            .filter_map(|i| Held::new(&set, cases, &speeds, i, &mut notes))
            .collect();
    }
    let mut floors = Vec::new();
    for held in &left_out {
        match held.floors() {
            Ok(own) => floors.extend(own),
            Err(error) => notes.push(format!("FE's own curves of \"{}\": {error}", held.own.name)),
        }
    }
    let pairs: Vec<(&Options, &Held)> =
        fitting.iter().flat_map(|o| left_out.iter().map(move |h| (o, h))).collect();
    let trials: Vec<Trial> = pairs.par_iter().map(|(options, held)| held.trial(options)).collect();

    let inner_speeds = left_out.iter().filter(|held| held.inner).count();
    let (mut rows, mut means, mut residuals) = (Vec::new(), Vec::new(), BTreeMap::new());
    for options in &fitting {
        let model = options.name();
        let own: Vec<&Trial> = trials.iter().filter(|t| t.model == model).collect();
        let Some(rule) = best_rule(options, &own) else { continue };
        notes.extend(own.iter().filter_map(|t| t.failure(rule)));
        let mut own_rows = Vec::new();
        let mut own_residuals: BTreeMap<LeftOutSpeeds, Vec<Residuals>> = BTreeMap::new();
        for trial in &own {
            let (Some(row), Some(of)) = (trial.row(rule), trial.residuals(rule)) else { continue };
            own_rows.push(row);
            own_residuals.entry(trial.left_out()).or_default().push(of);
        }
        let mut index: BTreeMap<LeftOutSpeeds, usize> = BTreeMap::new();
        for row in &mut own_rows {
            let left_out = LeftOutSpeeds::of(row.inner);
            let i = index.entry(left_out).or_default();
            row.coverage = band::coverage(left_out, &own_residuals[&left_out], *i);
            *i += 1;
        }
        match mean(model, rule, &own_rows) {
            Some(of) if of.speeds < inner_speeds => notes.push(without_means(model)),
            of => means.extend(of),
        }
        residuals.insert(model, own_residuals);
        rows.extend(own_rows);
    }
    let (chosen, reason) = match keep {
        Some(model) => (model.to_string(), "asked for".into()),
        None => choose(&means).unwrap_or_else(|| without_validation(&fitting)),
    };
    let band_of = |left_out: LeftOutSpeeds| {
        Band::of(left_out, residuals.get(chosen.as_str())?.get(&left_out)?)
    };
    let (band, band_outside) = (band_of(LeftOutSpeeds::Inner), band_of(LeftOutSpeeds::Ends));
    let group = group.into();
    Ok(Validation { group, chosen, reason, rows, means, floors, band, band_outside, notes })
}

/// Adds the rows and means of `auto` itself: with every inner speed left out, model and rule
/// are chosen anew by leaving out speeds of what remains.
///
/// The errors of the chosen model are those that it was chosen by, and so a little too good;
/// these are not. Speeds that leave fewer than three others, or fail otherwise, have no row but a
/// note.
///
/// # Errors
/// As [`validate`].
pub fn add_nested(
    validation: &mut Validation,
    cases: &[Case],
    seed: u64,
) -> Result<(), ValidateError> {
    let group = validation.group.clone();
    let set = TrainingSet::new(&group, cases)?;
    let mut speeds = set.speeds_m_per_s();
    speeds.dedup_by(|a, b| is_same_speed(*a, *b));
    if speeds.len() < 4 {
        validation.notes.push(format!(
            "auto has no errors of its own: choosing anew without a speed needs at least 4, the group has {}",
            speeds.len()
        ));
        return Ok(());
    }
    // Cases that cannot be left out have been noted.
    let held: Vec<Held> = (0..set.cases.len())
        .filter_map(|i| Held::new(&set, cases, &speeds, i, &mut Vec::new()))
        .filter(|held| held.inner)
        .collect();
    let trials: Vec<Trial> = held
        .par_iter()
        .map(|held| {
            let v = held.own.speed_m_per_s;
            let others: Vec<Case> =
                cases.iter().filter(|c| !is_same_speed(c.speed.m_per_s, v)).cloned().collect();
            let predictions = train(&group, &others, Choice::Auto { seed, trees: None })
                .and_then(|model| {
                    let curve = predict(&model, &query_of(held.case, &model))?;
                    Ok((curve.provenance.max_crush_rule, held.judged(curve)?))
                })
                .map_or_else(
                    |error| BTreeMap::from([(MaxCrushRule::Motion, Err(error.to_string()))]),
                    |(rule, judged)| BTreeMap::from([(rule, Ok(judged))]),
                );
            held.trial_of("auto", predictions)
        })
        .collect();
    // Each has one rule.
    let of = |trial: &Trial| trial.predictions.keys().next().copied();
    let rows: Vec<LeftOut> = trials.iter().filter_map(|t| t.row(of(t)?)).collect();
    validation.notes.extend(trials.iter().filter_map(|t| t.failure(of(t)?)));
    let rule = trials.first().and_then(of).unwrap_or(MaxCrushRule::Motion);
    match mean("auto", rule, &rows) {
        Some(of) if of.speeds < held.len() => validation.notes.push(without_means("auto")),
        of => validation.means.extend(of),
    }
    validation.rows.extend(rows);
    Ok(())
}

/// Why a model is not among the means.
fn without_means(model: &str) -> String {
    format!("{model} has no means and cannot be chosen: it has no answer at every inner speed")
}

/// With too few speeds to leave one out.
fn without_validation(fitting: &[Options]) -> (String, String) {
    let reason = "too few speeds to leave one out";
    let linear = fitting.contains(&Options::Linear);
    (if linear { "linear" } else { "nearest" }.into(), reason.into())
}

/// What to ask a model of this group's so that it predicts the case.
pub fn query_of(case: &Case, model: &Model) -> Query {
    let mut parameters = case.parameters.clone();
    // What all training cases share is no parameter of the model.
    parameters.retain(|name, _| model.features.iter().any(|f| f.parameter == *name));
    if let Some(other) = case.masses.other_kg {
        parameters.insert(OTHER_MASS.into(), Parameter::Number(other));
    }
    Query {
        mass_kg: Some(case.masses.body_kg),
        parameters,
        // Ends that are left out are judged however far away the others lie.
        extrapolate: true,
        ..Query::at(case.speed.m_per_s)
    }
}

/// A case that is left out, and what is left.
struct Held<'a> {
    own: &'a TrainingCase,
    case: &'a Case,
    rest: TrainingSet,
    inner: bool,
    /// Over which it is predicted: the gap it leaves, or an end's distance to the others.
    span_m_per_s: f64,
    reference: Reference,
}

impl<'a> Held<'a> {
    /// Leaves out all cases of the speed of case `i`; `None`, with a note, if it cannot be
    /// compared with.
    fn new(
        set: &'a TrainingSet,
        cases: &'a [Case],
        speeds: &[f64],
        i: usize,
        notes: &mut Vec<String>,
    ) -> Option<Self> {
        let own = &set.cases[i];
        let case = cases.iter().find(|c| c.name == own.name)?;
        if own.truncated {
            notes.push(format!("case \"{}\" ended while loading: not left out", own.name));
            return None;
        }
        let reference = match Reference::of(case) {
            Ok(reference) => reference,
            Err(error) => {
                notes.push(error.to_string());
                return None;
            }
        };
        if own.envelope.work() <= 0.0 {
            notes.push(format!("case \"{}\" has no energy to compare with", own.name));
            return None;
        }
        let v = own.speed_m_per_s;
        let mut rest = set.clone();
        rest.cases.retain(|c| !is_same_speed(c.speed_m_per_s, v));
        let inner = speeds[0] < v && v < speeds[speeds.len() - 1];
        let others = rest.speeds_m_per_s();
        let span_m_per_s = match inner {
            true => band::gap_m_per_s(&others, v)?,
            false => band::distance_outside_m_per_s(&others, v),
        };
        Some(Self { own, case, rest, inner, span_m_per_s, reference })
    }

    /// FE's own curves in the multi-body model.
    fn floors(&self) -> Result<Vec<Floor>, ValidateError> {
        let contact = (ForceKind::Contact, &self.own.envelope);
        let body = (ForceKind::Body, &self.own.motion.force);
        let forces = match self.rest.force_kind {
            ForceKind::Contact => vec![contact, body],
            ForceKind::Body => vec![(ForceKind::Body, &self.own.envelope)],
        };
        forces
            .into_iter()
            .map(|(kind, envelope)| {
                let recorded = match kind {
                    ForceKind::Body => Driver::recorded(self.case),
                    ForceKind::Contact => None,
                };
                let driver = recorded.unwrap_or_else(|| {
                    Driver::rebounding(
                        envelope.clone(),
                        self.own.effective_mass_kg,
                        self.own.motion.rebound_speed_m_per_s,
                        self.own.unloading_stiffness_n_per_m,
                    )
                });
                let errors = finite(self.reference.errors(&self.reference.run(&driver)?)?)?;
                Ok(Floor {
                    force: kind.name().into(),
                    case: self.own.name.clone(),
                    speed_m_per_s: self.own.speed_m_per_s,
                    inner: self.inner,
                    velocity_l1: errors.velocity_l1,
                    acceleration_l1: errors.acceleration_l1,
                    acceleration_unfiltered_l1: errors.acceleration_unfiltered_l1,
                })
            })
            .collect()
    }

    /// Predicts the case by one model and every rule.
    fn trial(&self, options: &Options) -> Trial {
        let model = Model::fit(&self.rest, *options);
        let by = |rule: MaxCrushRule| -> Result<Judged, ValidateError> {
            let model = match &model {
                Ok(model) => model,
                Err(error) => return Err(ValidateError::NotFitted(error.to_string())),
            };
            self.judged(predict(model, &query_of(self.case, model).with_rule(rule))?)
        };
        let predictions =
            MaxCrushRule::ALL.map(|rule| (rule, by(rule).map_err(|e| e.to_string()))).into();
        self.trial_of(options.name(), predictions)
    }

    fn trial_of(&self, model: &'static str, predictions: Predictions) -> Trial {
        Trial {
            model,
            case: self.own.name.clone(),
            speed_m_per_s: self.own.speed_m_per_s,
            inner: self.inner,
            predictions,
        }
    }

    fn judged(&self, curve: PredictedCurve) -> Result<Judged, ValidateError> {
        let envelope = curve.envelope()?;
        let end = self.own.envelope.end_m();
        let along = grid(end, STEPS);
        let at = |e: &Envelope| -> Vec<f64> { along.iter().map(|&d| e.force_at(d)).collect() };
        let (reference, predicted) = (at(&self.own.envelope), at(&envelope));
        let driven = |envelope: Envelope| -> Result<MotionErrors, ValidateError> {
            let stiffness_n_per_m = Some(curve.stiffness_at_end(&envelope));
            let driver = Driver::new(envelope, stiffness_n_per_m);
            finite(self.reference.errors(&self.reference.run(&driver)?)?)
        };
        let judged = Judged {
            force_l1: l1_ratio(&reference, &predicted),
            energy_error: curve.energy_j / self.own.envelope.work() - 1.0,
            max_crush_error: curve.max_deflection_m / end - 1.0,
            peaks: peak_errors(&along, &reference, &predicted),
            residuals: {
                // Up to its first point a prediction rises from 0, which FE does not.
                let first = curve.deflection_m[1];
                let from = along.iter().position(|&d| d >= first).unwrap_or(0);
                let ratios = band::ratios(&reference, &predicted).split_off(from);
                Residuals { span_m_per_s: self.span_m_per_s, ratios }
            },
            body: driven(curve.driving_envelope()?)?,
            contact: match curve.body_force_n {
                Some(_) => Some(driven(envelope)?),
                None => None,
            },
        };
        let numbers = [judged.force_l1, judged.energy_error, judged.max_crush_error];
        match numbers.iter().all(|n| n.is_finite()) {
            true => Ok(judged),
            false => Err(ValidateError::NotFinite),
        }
    }
}

/// Errors that can be compared.
fn finite(errors: MotionErrors) -> Result<MotionErrors, ValidateError> {
    let MotionErrors { velocity_l1, acceleration_l1, acceleration_unfiltered_l1 } = errors;
    match [velocity_l1, acceleration_l1, acceleration_unfiltered_l1].iter().all(|e| e.is_finite()) {
        true => Ok(errors),
        false => Err(ValidateError::NotFinite),
    }
}

/// Errors of one prediction.
struct Judged {
    force_l1: f64,
    energy_error: f64,
    max_crush_error: f64,
    peaks: Vec<PeakError>,
    residuals: Residuals,
    body: MotionErrors,
    contact: Option<MotionErrors>,
}

/// One model at one case by every rule, or why that has no answer.
type Predictions = BTreeMap<MaxCrushRule, Result<Judged, String>>;

struct Trial {
    model: &'static str,
    case: String,
    speed_m_per_s: f64,
    inner: bool,
    predictions: Predictions,
}

impl Trial {
    fn left_out(&self) -> LeftOutSpeeds {
        LeftOutSpeeds::of(self.inner)
    }

    fn residuals(&self, rule: MaxCrushRule) -> Option<Residuals> {
        Some(self.judged(rule)?.residuals.clone())
    }

    fn judged(&self, rule: MaxCrushRule) -> Option<&Judged> {
        self.predictions.get(&rule)?.as_ref().ok()
    }

    /// Why there is no row.
    fn failure(&self, rule: MaxCrushRule) -> Option<String> {
        let error = self.predictions.get(&rule)?.as_ref().err()?;
        Some(format!("{} at {}: no row: {error}", self.model, km_per_h(self.speed_m_per_s)))
    }

    fn row(&self, rule: MaxCrushRule) -> Option<LeftOut> {
        let by_rule = self.judged(rule)?;
        let crush = |rule| Some((rule, self.judged(rule)?.max_crush_error));
        Some(LeftOut {
            model: self.model.into(),
            case: self.case.clone(),
            speed_m_per_s: self.speed_m_per_s,
            inner: self.inner,
            force_l1: by_rule.force_l1,
            energy_error: by_rule.energy_error,
            max_crush_error: by_rule.max_crush_error,
            max_crush_errors: MaxCrushRule::ALL.into_iter().filter_map(crush).collect(),
            peaks: by_rule.peaks.clone(),
            velocity_l1: by_rule.body.velocity_l1,
            acceleration_l1: by_rule.body.acceleration_l1,
            acceleration_unfiltered_l1: by_rule.body.acceleration_unfiltered_l1,
            contact_velocity_l1: by_rule.contact.map(|c| c.velocity_l1),
            contact_acceleration_l1: by_rule.contact.map(|c| c.acceleration_l1),
            coverage: None,
        })
    }
}

/// The rule with the smallest mean error of crush and energy over the inner speeds, as the
/// crush decides both; the reference method keeps its spline. A rule with an answer at more speeds
/// goes before; `None` without any trial.
fn best_rule(options: &Options, trials: &[&Trial]) -> Option<MaxCrushRule> {
    let errors = |rule: MaxCrushRule, of_inner: bool| -> Vec<f64> {
        let of = trials.iter().filter(|t| t.inner == of_inner).filter_map(|t| t.judged(rule));
        of.map(|j| j.max_crush_error.abs() + j.energy_error.abs()).collect()
    };
    let missing = |rule: MaxCrushRule| {
        let inner = errors(rule, true).len();
        (trials.len() - inner, trials.len() - inner - errors(rule, false).len())
    };
    let mean = |rule: MaxCrushRule| {
        let errors = errors(rule, true);
        errors.iter().sum::<f64>() / errors.len().max(1) as f64
    };
    // The spline is not monotone by construction: nobody gets it without asking.
    let best = (!trials.is_empty()).then_some(MaxCrushRule::ALL).and_then(|all| {
        all.into_iter()
            .filter(|rule| *rule != MaxCrushRule::Spline)
            .min_by(|&a, &b| missing(a).cmp(&missing(b)).then(mean(a).total_cmp(&mean(b))))
    })?;
    let is_paper = matches!(options, Options::Forest(f) if ForestOptions { seed: f.seed, ..ForestOptions::paper() } == *f);
    match is_paper && missing(MaxCrushRule::Spline).0 <= missing(best).0 {
        true => Some(MaxCrushRule::Spline),
        false => Some(best),
    }
}

/// The first two peaks of FE's force and the predicted peaks nearest to them.
fn peak_errors(along: &[f64], reference: &[f64], predicted: &[f64]) -> Vec<PeakError> {
    matched_peaks(along, reference, predicted)
        .into_iter()
        .map(|peak| {
            let (deflection_m, force_n) = peak.reference;
            PeakError {
                deflection_m,
                force_n,
                force_error: peak.prediction.map(|(_, force)| force / force_n - 1.0),
                shift_m: peak.prediction.map(|(at, _)| at - deflection_m),
            }
        })
        .collect()
}

/// Means over the inner speeds; `None` without any.
fn mean(model: &str, rule: MaxCrushRule, rows: &[LeftOut]) -> Option<Means> {
    let inner: Vec<&LeftOut> = rows.iter().filter(|r| r.inner).collect();
    let over = |of: fn(&LeftOut) -> f64| {
        inner.iter().map(|r| of(r).abs()).sum::<f64>() / inner.len() as f64
    };
    (!inner.is_empty()).then(|| Means {
        model: model.into(),
        speeds: inner.len(),
        force_l1: over(|r| r.force_l1),
        energy_error: over(|r| r.energy_error),
        max_crush_error: over(|r| r.max_crush_error),
        max_crush_rule: rule,
        max_crush_errors: MaxCrushRule::ALL
            .into_iter()
            .filter_map(|rule| {
                let errors: Option<Vec<f64>> =
                    inner.iter().map(|r| Some(r.max_crush_errors.get(&rule)?.abs())).collect();
                Some((rule, errors?.iter().sum::<f64>() / inner.len() as f64))
            })
            .collect(),
        velocity_l1: over(|r| r.velocity_l1),
        acceleration_l1: over(|r| r.acceleration_l1),
        acceleration_unfiltered_l1: over(|r| r.acceleration_unfiltered_l1),
    })
}
