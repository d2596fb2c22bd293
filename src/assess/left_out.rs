//! Left-out cases: one speed is dropped, predicted from the rest, run, and measured against FE.

use std::collections::BTreeMap;

use super::reference::{MotionErrors, Reference};
use crate::curve::force_curve::ForceCurve;
use crate::curve::{Case, Envelope, ForceKind, Parameter};
use crate::dataset::{
    OTHER_MASS, TrainingCase, TrainingSet, are_masses, grid, is_within, nearly_same,
};
use crate::error::{Error, error};
use crate::parallel;
use crate::signal::l1_ratio;
use crate::signal::peaks::matched_peaks;
use crate::surrogate::band::{self, Gap, Residuals};
use crate::surrogate::leave_one_out::{Floor, LeftOut, PeakError};
use crate::surrogate::max_crush::MaxCrushRule;
use crate::surrogate::model::Material;
use crate::surrogate::predict::Prediction;
use crate::surrogate::{Model, ModelKind, PredictedCurve, Query};
use crate::unit::km_per_h;

/// Minimum number of steps along FE's crush at which forces are compared.
pub(super) const STEPS: usize = 400;

/// What to ask a model of this group's so that it predicts the case.
pub(crate) fn query_of(case: &Case, model: &Model) -> Query {
    let mut parameters = case.conditions.parameters.clone();
    // What all training cases share is not a parameter of the model.
    parameters.retain(|name, _| model.features.iter().any(|f| f.parameter == *name));
    if let Some(other) = case.conditions.masses.other_kg {
        parameters.insert(OTHER_MASS.into(), Parameter::Number(other));
    }
    Query {
        mass_kg: Some(case.conditions.masses.body_kg),
        parameters,
        // Ends that are left out are judged however far away the others lie.
        extrapolate: true,
        ..Query::at(case.conditions.speed.m_per_s)
    }
}

/// A case that is left out, and what is left.
pub(crate) struct LeftOutCase<'a> {
    /// As in the training set.
    pub own: &'a TrainingCase,
    /// Its records: a run, or the mean of the runs that it represents.
    pub case: &'a Case,
    /// The training set without the cases of its speed.
    pub rest: TrainingSet,
    /// Whether the rest has speeds on both sides.
    pub inner: bool,
    /// Over which it is predicted: the gap it leaves, or an end's distance to the others.
    gap: Gap,
    /// FE's motion.
    pub reference: Reference,
}

impl<'a> LeftOutCase<'a> {
    /// Leaves out all cases of the speed of the set's case `index`, and of speeds that nearly repeat it.
    pub(crate) fn new(set: &'a TrainingSet, index: usize) -> Result<Self, NotLeftOut> {
        let own = &set.cases[index];
        let left_out = nearly_same(&set.speeds_m_per_s(), own.speed_m_per_s);
        let rest = set.with(|case| !is_within(case.speed_m_per_s, left_out));
        Self::of(own, rest)
    }

    /// A case that a set lacks.
    pub(super) fn of(own: &'a TrainingCase, rest: TrainingSet) -> Result<Self, NotLeftOut> {
        let case: &Case = &own.case;
        let name = || own.name.clone();
        if own.truncated {
            return Err(NotLeftOut::Truncated { case: name() });
        }
        let reference = Reference::of(case)?;
        if own.envelope.work() <= 0.0 {
            return Err(NotLeftOut::NoEnergy { case: name() });
        }
        let v = own.speed_m_per_s;
        let others = rest.speeds_of_crush_m_per_s();
        let inner = others.first().is_some_and(|&low| low < v)
            && others.last().is_some_and(|&high| v < high);
        let gap = if inner { band::gap(&others, v) } else { band::outside(&others, v) };
        let gap = gap.ok_or(NotLeftOut::TooFew { case: name() })?;
        Ok(Self { own, case, rest, inner, gap, reference })
    }

    /// FE's own curves in the one-mass model: of the recipe's force, and of the body's motion
    /// where that is another.
    ///
    /// That of the body's motion is made from FE's speeds, so its errors check that curve, force law
    /// and run are consistent; only a contact force's are a floor for predictions of it.
    pub(crate) fn floors(&self) -> Result<Vec<Floor>, Error> {
        let floor = |(kind, curve): (ForceKind, ForceCurve)| {
            let errors = self.reference.errors_with(&curve)?;
            Ok(Floor {
                force: kind.name().into(),
                case: self.own.name.clone(),
                speed_m_per_s: self.own.speed_m_per_s,
                inner: self.inner,
                velocity_l1: errors.velocity_l1,
                acceleration_l1: errors.acceleration_l1,
                acceleration_unfiltered_l1: errors.acceleration_unfiltered_l1,
            })
        };
        self.own_curves().into_iter().map(floor).collect()
    }

    /// FE's own curves, by force.
    fn own_curves(&self) -> Vec<(ForceKind, ForceCurve)> {
        let of_body = |envelope: &Envelope| (ForceKind::Body, rebounding(self.own, envelope));
        match self.rest.force_kind {
            ForceKind::Contact => {
                let contact = rebounding(self.own, &self.own.envelope);
                vec![(ForceKind::Contact, contact), of_body(&self.own.motion.force)]
            }
            ForceKind::Body => vec![of_body(&self.own.envelope)],
        }
    }

    /// What models are fitted to without the case's speed: the same for all cases that a set lacks.
    pub(super) fn material(&self) -> Result<Material<'_>, Error> {
        Material::of(&self.rest)
    }

    /// The model without the case's speed.
    pub(super) fn fit(
        &self,
        kind: ModelKind,
        material: &Result<Material<'_>, Error>,
    ) -> Result<Model, Error> {
        let near = kind.near(self.case.conditions.speed.m_per_s);
        let fitted = material.as_ref().map_err(Error::to_string);
        let fitted = fitted.and_then(|of| of.fit(near).map_err(|e| e.to_string()));
        fitted.map_err(|error| error!(Validation, "without this speed: {error}"))
    }

    /// Predicts the case by one model and every rule for the maximum crush.
    fn trial(&self, kind: ModelKind, material: &Result<Material<'_>, Error>) -> LeftOutRun<'_> {
        self.trial_of(kind, &self.fit(kind, material), &MaxCrushRule::ALL)
    }

    /// The same by all of several models.
    pub(super) fn trials(&self, kinds: &[ModelKind]) -> Vec<LeftOutRun<'_>> {
        let material = self.material();
        parallel::map(kinds, |kind| self.trial(*kind, &material))
    }

    /// Predicts the case by a fitted model and some rules for the maximum crush.
    pub(super) fn trial_of(
        &self,
        kind: ModelKind,
        model: &Result<Model, Error>,
        rules: &[MaxCrushRule],
    ) -> LeftOutRun<'_> {
        let answers = || -> Result<Answers, String> {
            let model = model.as_ref().map_err(Error::to_string)?;
            let query = query_of(self.case, model);
            // Body force and motion are the same by all rules.
            let prediction = Prediction::new(model, &query).map_err(|e| e.to_string())?;
            let by = |rule| self.answer(prediction.curve(rule)?);
            Ok(rules.iter().map(|&rule| (rule, by(rule).map_err(|e| e.to_string()))).collect())
        };
        let answers = answers()
            .unwrap_or_else(|error| rules.iter().map(|&rule| (rule, Err(error.clone()))).collect());
        LeftOutRun { model: kind.name(), held: self, answers }
    }

    /// A predicted curve with its errors of crush and energy.
    pub(super) fn answer(&self, curve: PredictedCurve) -> Result<Answer, Error> {
        let fe = &self.own.envelope;
        let answer = Answer {
            energy_error: curve.energy_j / fe.work() - 1.0,
            max_crush_error: curve.max_deflection_m / fe.end_m() - 1.0,
            curve,
        };
        if answer.energy_error.is_finite() && answer.max_crush_error.is_finite() {
            Ok(answer)
        } else {
            Err(error!(Validation, "its errors against FE are not finite numbers"))
        }
    }

    /// The row of an answer of `model`, but for the coverage and the other rules.
    fn judged(&self, model: &str, answer: &Answer) -> Result<Score, Error> {
        let Answer { curve, energy_error, max_crush_error } = answer;
        let envelope = curve.envelope()?;
        let along = grid(self.own.envelope.end_m(), STEPS);
        let (reference, predicted) =
            (forces_n(&self.own.envelope, &along), forces_n(&envelope, &along));
        let force_l1 = l1_ratio(&reference, &predicted);
        if !force_l1.is_finite() {
            return Err(error!(Validation, "its errors against FE are not finite numbers"));
        }
        let driven_by = |force| -> Result<MotionErrors, Error> {
            self.reference.errors_with(&curve.driving(force)?)
        };
        let body = driven_by(ForceKind::Body)?;
        let contact = match curve.body_force_n {
            Some(_) => Some(driven_by(ForceKind::Contact)?),
            None => None,
        };
        let row = LeftOut {
            model: model.into(),
            case: self.own.name.clone(),
            speed_m_per_s: self.own.speed_m_per_s,
            inner: self.inner,
            force_l1,
            energy_error: *energy_error,
            max_crush_error: *max_crush_error,
            max_crush_errors: BTreeMap::new(),
            rebound_error: curve
                .rebound
                .zip(self.own.motion.rebound_speed_m_per_s)
                .map(|(predicted, fe)| predicted.speed_m_per_s / fe - 1.0),
            peak_force_error: Some(
                envelope.peak_force_n() / self.own.envelope.peak_force_n() - 1.0,
            ),
            peaks: peak_errors(&self.own.envelope, &envelope),
            velocity_l1: body.velocity_l1,
            acceleration_l1: body.acceleration_l1,
            acceleration_unfiltered_l1: body.acceleration_unfiltered_l1,
            contact_velocity_l1: contact.map(|c| c.velocity_l1),
            contact_acceleration_l1: contact.map(|c| c.acceleration_l1),
            coverage: None,
        };
        Ok(Score { row, residuals: self.residuals(curve, &along)? })
    }

    /// Residuals of each force of a predicted curve `along` FE's crush, in m.
    fn residuals(
        &self,
        curve: &PredictedCurve,
        along: &[f64],
    ) -> Result<BTreeMap<ForceKind, Residuals>, Error> {
        let features = &self.rest.features;
        let is_of_masses = !features.is_empty() && are_masses(features);
        // Up to its first point a prediction rises from 0, which FE does not.
        let first = curve.deflection_m[1];
        let from = along.iter().position(|&d| d >= first).unwrap_or(0);
        let of = |fe: &Envelope, predicted: &Envelope| {
            let mut ratios = band::ratios(&forces_n(fe, along), &forces_n(predicted, along));
            let (ratios, runs) = (ratios.split_off(from), self.own.runs.len());
            let mut residuals = Residuals::new(self.gap, ratios, runs);
            residuals.is_of_masses = is_of_masses;
            residuals
        };
        let declared = of(&self.own.envelope, &curve.envelope()?);
        let mut residuals = BTreeMap::from([(curve.provenance.force_kind, declared)]);
        if curve.body_force_n.is_some() {
            let body = of(&self.own.motion.force, &curve.driving_envelope()?);
            residuals.insert(ForceKind::Body, body);
        }
        Ok(residuals)
    }
}

pub(super) fn forces_n(envelope: &Envelope, deflection_m: &[f64]) -> Vec<f64> {
    deflection_m.iter().map(|&d| envelope.force_at(d)).collect()
}

/// The recipe's force, or another of the case, with the unloading that gives FE's rebound.
pub(super) fn rebounding(own: &TrainingCase, envelope: &Envelope) -> ForceCurve {
    ForceCurve::bare(envelope.clone()).rebounding(
        own.effective_mass_kg,
        own.motion.rebound_speed_m_per_s,
        own.unloading_stiffness_n_per_m,
    )
}

/// A prediction by one rule for the maximum crush.
pub(super) struct Answer {
    curve: PredictedCurve,
    pub energy_error: f64,
    pub max_crush_error: f64,
}

/// One model at one case by every requested rule, or why that is impossible.
pub(super) type Answers = BTreeMap<MaxCrushRule, Result<Answer, String>>;

/// A row of the table, and what bands are made of.
pub(super) struct Score {
    pub row: LeftOut,
    pub residuals: BTreeMap<ForceKind, Residuals>,
}

/// A model at a left-out case.
pub(super) struct LeftOutRun<'a> {
    pub model: &'static str,
    pub held: &'a LeftOutCase<'a>,
    pub answers: Answers,
}

impl LeftOutRun<'_> {
    pub(crate) fn answer(&self, rule: MaxCrushRule) -> Option<&Answer> {
        self.answers.get(&rule)?.as_ref().ok()
    }

    /// Its row by a rule: only this one's curve is run and compared along the crush.
    pub(crate) fn judged(&self, rule: MaxCrushRule) -> Result<Score, String> {
        let judged = match self.answers.get(&rule) {
            Some(Ok(answer)) => self.held.judged(self.model, answer).map_err(|e| e.to_string()),
            Some(Err(error)) => Err(error.clone()),
            None => Err(format!("the rule {} was not requested", rule.name())),
        };
        let speed = km_per_h(self.held.own.speed_m_per_s);
        let Score { row, residuals } =
            judged.map_err(|error| format!("{} at {speed}: no row: {error}", self.model))?;
        let crush = |rule| Some((rule, self.answer(rule)?.max_crush_error));
        let max_crush_errors = MaxCrushRule::ALL.into_iter().filter_map(crush).collect();
        Ok(Score { row: LeftOut { max_crush_errors, ..row }, residuals })
    }
}

/// The first two peaks of FE's force and the predicted peaks nearest to them, up to FE's maximum crush; at the points of both curves, between
/// which neither has one.
fn peak_errors(reference: &Envelope, predicted: &Envelope) -> Vec<PeakError> {
    let mut along = [reference.deflection_m(), predicted.deflection_m()].concat();
    along.retain(|d| *d <= reference.end_m());
    along.sort_by(f64::total_cmp);
    along.dedup();
    matched_peaks(&along, &forces_n(reference, &along), &forces_n(predicted, &along))
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

/// Why a case cannot be left out.
#[derive(Debug, thiserror::Error)]
pub(crate) enum NotLeftOut {
    /// Its maximum deflection is not known.
    #[error("case \"{case}\" ended while loading: not left out")]
    Truncated {
        /// Its name.
        case: String,
    },
    /// There is no motion to compare with.
    #[error(transparent)]
    Motion(#[from] Error),
    /// Ratios to its energy would divide by zero.
    #[error("case \"{case}\" has no energy to compare with")]
    NoEnergy {
        /// Its name.
        case: String,
    },
    /// Fewer than two speeds remain.
    #[error("without case \"{case}\" fewer than 2 speeds remain")]
    TooFew {
        /// Its name.
        case: String,
    },
}
