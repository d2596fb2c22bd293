//! Models: a surrogate fitted to a group, with everything needed to predict and to assess it.

use std::sync::Arc;

use super::alignment::mode_switches;
use super::band::{self, Band};
use super::cached::Cached;
use super::cases::{Curves, ModelCase, SlopeJump};
use super::crush_law::{CrushCurve, CrushLaw};
use super::curves::{interpolate_held, mean_points};
use super::forest::ForestSurrogate;
use super::leave_one_out::Validation;
use super::max_crush::MaxCrushRule;
use super::models::FitInput;
use super::models::{MODELS, ModelEntry, ModelKind};
use super::response::with_response;
use super::{CaseCurve, QueryPoint, Surrogate, Warning, WarningCode};
use crate::curve::body::rebound_stiffness_n_per_m;
use crate::curve::{ForceKind, Masses};
use crate::dataset::{
    Feature, MASS, OTHER_MASS, SAME_MASS, SAME_SPEED, TrainingCase, TrainingSet, are_masses,
    is_same_mass, nearest, show_their_crush,
};
use crate::error::{Error, error};
use crate::forest::RegressionForest;
use crate::unit::{SpeedKind, UnitSystem};

/// Warnings of training runs that a prediction repeats.
const MOST_NAMED: usize = 8;
/// A nearest training speed further away than this share of the speed causes a warning.
const FAR_OUTSIDE_SHARE: f64 = 0.25;
/// Parameters outside the training cases' by up to this share of the largest are taken for theirs.
const NEARLY_INSIDE: f64 = 1e-3;
/// A surrogate fitted to a group, for the declared force and for the body's.
#[derive(Clone, Debug)]
pub struct Model {
    /// Version of the program that fitted it.
    pub(super) written_by: String,
    /// Group of the database that it was fitted to.
    pub group: String,
    /// What its speeds are measured against.
    pub speed_kind: SpeedKind,
    /// Which force its recipe declares.
    pub force_kind: ForceKind,
    /// Mass of the body, or of the first body of a pair.
    pub mass_kg: f64,
    /// Mass of the other body of a pair.
    pub other_mass_kg: Option<f64>,
    /// Units of the solver files that the training cases come from, for exports.
    pub study_units: Option<UnitSystem>,
    /// Parameters besides speed that queries must give.
    pub features: Vec<Feature>,
    /// Hash over the fingerprints of the training cases.
    pub training_hash: String,
    /// In order of speed.
    pub cases: Vec<ModelCase>,
    /// Which model, with its options.
    pub kind: ModelKind,
    /// How the maximum crush is found by default.
    pub max_crush_rule: MaxCrushRule,
    /// Pairs of neighbouring training speeds between which the collapse mode changes.
    pub mode_switches_m_per_s: Vec<(f64, f64)>,
    /// Leave-one-speed-out of the group, if it was requested.
    pub leave_one_out: Option<Validation>,
    /// For the declared force.
    pub(super) fitted: Arc<dyn Surrogate>,
    /// For the force of the body's motion, where that is another.
    pub(super) fitted_body: Option<Arc<dyn Surrogate>>,
    /// Stopped mass and crush force behind both forces; `None` if the runs do not determine them.
    pub(crate) crush_law: Option<CrushLaw>,
    /// The curves of `cases`, made when the model is fitted or read.
    pub(super) curves: Arc<Curves>,
}

/// What models of all kinds are fitted to: the data and curves of a set's cases, and their crush law, made once.
pub(crate) struct Material<'a> {
    set: &'a TrainingSet,
    cases: Vec<ModelCase>,
    curves: Arc<Curves>,
    crush_law: Cached<Option<CrushLaw>>,
}

impl<'a> Material<'a> {
    pub(crate) fn of(set: &'a TrainingSet) -> Result<Self, Error> {
        let of = |case: &Arc<TrainingCase>| ModelCase::of(case, set.force_kind);
        let cases: Vec<ModelCase> = set.cases.iter().map(of).collect();
        let curves = Arc::new(Curves::of(&cases)?);
        Ok(Self { set, cases, curves, crush_law: Cached::default() })
    }

    fn crush_law(&self) -> &Option<CrushLaw> {
        let contact = &self.curves.declared;
        let of = |stopped| CrushLaw::of(stopped, contact);
        self.crush_law.get_or_compute(|| self.set.stopped_mass().map(of))
    }

    /// [`Model::fit_curves`] of the set.
    pub(crate) fn fit(&self, kind: ModelKind) -> Result<Model, Error> {
        let Self { set, cases, curves, .. } = self;
        Model::check_inputs(set, kind)?;
        let needed_law = match kind.entry.needs_crush_law {
            true => self.crush_law().clone().filter(|law| law.stopped.is_known()),
            false => None,
        };
        let fitted = |curves: &[CaseCurve], force: ForceKind| {
            let (forest, crush_law) = (kind.forest_options(), needed_law.as_ref());
            (kind.entry.fit)(&FitInput { set, curves, force, forest, crush_law })
        };
        Ok(Model {
            written_by: concat!("crumple ", env!("CARGO_PKG_VERSION")).into(),
            group: set.group.clone(),
            speed_kind: set.speed_kind,
            force_kind: set.force_kind,
            mass_kg: set.masses.body_kg,
            other_mass_kg: set.masses.other_kg,
            study_units: set.units,
            features: set.features.clone(),
            training_hash: set.hash(),
            max_crush_rule: MaxCrushRule::Motion,
            mode_switches_m_per_s: Vec::new(),
            leave_one_out: None,
            fitted: fitted(&curves.declared, set.force_kind)?,
            fitted_body: match set.force_kind {
                ForceKind::Contact => Some(fitted(&curves.body, ForceKind::Body)?),
                ForceKind::Body => None,
            },
            crush_law: needed_law,
            kind,
            cases: cases.clone(),
            curves: curves.clone(),
        })
    }
}

impl Model {
    /// Fits the model to both forces of the set. The choice of a model by leaving speeds
    /// out is `validate::train`'s.
    ///
    /// # Errors
    /// If the set is too small for the model, differs in more than the model
    /// sees, or its options are wrong.
    pub fn fit(set: &TrainingSet, kind: ModelKind) -> Result<Self, Error> {
        Self::check_inputs(set, kind)?;
        let material = Material::of(set)?;
        let model = material.fit(kind)?;
        let crush_law = material.crush_law().clone();
        let speed = |i: usize| model.cases[i].speed_m_per_s;
        let switches = if are_masses(&set.features) {
            mode_switches(&model.curves.declared)
        } else {
            Vec::new()
        };
        let mode_switches_m_per_s = switches.iter().map(|&(i, k)| (speed(i), speed(k))).collect();
        Ok(Self { crush_law, mode_switches_m_per_s, ..model })
    }

    /// The same without a crush law that its curves do not need and without changes of mode, for trials that only ask for curves.
    pub(crate) fn fit_curves(set: &TrainingSet, kind: ModelKind) -> Result<Self, Error> {
        Self::check_inputs(set, kind)?;
        Material::of(set)?.fit(kind)
    }

    /// Whether the model can be fitted to the set, without fitting it.
    pub(crate) fn check_fits(set: &TrainingSet, kind: ModelKind) -> Result<(), Error> {
        Self::check_inputs(set, kind)?;
        if kind.entry.needs_crush_law { Self::fit_curves(set, kind).map(|_| ()) } else { Ok(()) }
    }

    /// Whether number and parameters of the set's cases serve the model.
    fn check_inputs(set: &TrainingSet, kind: ModelKind) -> Result<(), Error> {
        let (model, entry) = (kind.name(), kind.entry);
        let (found, least) = (set.cases.len(), entry.least_curves);
        if found < least {
            let runs: usize = set.cases.iter().map(|case| case.runs.len()).sum();
            let of_runs = match runs > found {
                true => format!(" (the mean of {runs} runs of one impact)"),
                false => String::new(),
            };
            return Err(error!(
                Model,
                "model {model} needs at least {least} curves, the group has {found}{of_runs}: only --model nearest can use a single curve, as it is"
            ));
        }
        let sees = |entry: &ModelEntry, feature: &Feature| {
            // A body's motion has its mass in it.
            entry.sees_features || entry.follows_closing && feature.is_mass()
        };
        let unseen = set.features.iter().filter(|feature| !sees(entry, feature));
        let unseen: Vec<String> = unseen.map(Feature::name).collect();
        if !unseen.is_empty() {
            let sees_all = |e: &&ModelEntry| set.features.iter().all(|feature| sees(e, feature));
            let others = MODELS.iter().filter(sees_all).filter(|e| e.least_curves > 1);
            return Err(error!(
                Model,
                "model {model} does not see {features}, in which the cases also differ: use --model {others}, or keep cases that differ in speed alone",
                features = unseen.join(", "),
                others = others.map(|e| e.name).collect::<Vec<_>>().join(" or ")
            ));
        }
        match kind.forest_options() {
            Some(options) => Ok(options.check()?),
            None => Ok(()),
        }
    }

    /// Its name, as of `MODELS`.
    pub fn name(&self) -> &'static str {
        self.kind.name()
    }

    /// Masses of the training runs.
    pub(crate) fn masses(&self) -> Masses {
        Masses { body_kg: self.mass_kg, other_kg: self.other_mass_kg }
    }

    /// The forest of the declared force, if the model has one.
    pub fn forest(&self) -> Option<&RegressionForest<f64>> {
        self.fitted.forest().map(ForestSurrogate::forest)
    }

    /// The maximum crush of its runs, in m.
    pub(crate) fn largest_crush_m(&self) -> f64 {
        self.cases.iter().map(|case| case.max_deflection_m).fold(0.0, f64::max)
    }

    /// How far the forces of a query are data, in m.
    pub(super) fn data_end_m(&self, at: &QueryPoint<'_>) -> f64 {
        let of = self.fitted.data_end_m(&self.curves.declared, at);
        of.unwrap_or_else(|| self.largest_crush_m())
    }

    /// Lowest and highest training speed, in m/s.
    pub fn range_m_per_s(&self) -> (f64, f64) {
        (self.cases[0].speed_m_per_s, self.cases[self.cases.len() - 1].speed_m_per_s)
    }

    /// The training speeds in m/s that a query lies among or beyond, in order: those of the runs with its parameters, or all if these have
    /// one speed or none.
    pub(super) fn speeds_around(&self, at: &QueryPoint<'_>) -> Vec<f64> {
        let alike = self.showing().filter(|case| self.is_alike(case, at));
        let alike: Vec<f64> = alike.map(|case| case.speed_m_per_s).collect();
        if alike.first() < alike.last() {
            alike
        } else {
            self.showing().map(|case| case.speed_m_per_s).collect()
        }
    }

    /// The runs that [`show_their_crush`].
    fn showing(&self) -> impl Iterator<Item = &ModelCase> {
        let alone = are_masses(&self.features);
        show_their_crush(&self.cases, move |case| {
            let features = if alone { &[] } else { &case.features[..] };
            (case.truncated, case.speed_m_per_s, case.max_deflection_m, features)
        })
    }

    /// The lowest and the highest speed of these runs, in m/s.
    pub(super) fn shown_range_m_per_s(&self) -> (f64, f64) {
        let speeds = self.showing().map(|case| case.speed_m_per_s);
        speeds.fold((f64::INFINITY, 0.0), |(low, high), v| (low.min(v), high.max(v)))
    }

    /// Whether the fastest of these runs ends while loading.
    pub(super) fn fastest_is_truncated(&self) -> bool {
        self.showing().last().is_some_and(|case| case.truncated)
    }

    /// Whether a query lies between these training speeds, but for the rounding of units.
    pub(super) fn contains(&self, at: &QueryPoint<'_>) -> bool {
        let speeds = self.speeds_around(at);
        let (low, high) = (speeds[0], speeds[speeds.len() - 1]);
        (low * (1.0 - SAME_SPEED)..=high * (1.0 + SAME_SPEED)).contains(&at.speed_m_per_s)
    }

    /// Speed in m/s at which the training mass (that of the first run, where they differ) has the energy of `mass_kg` at a
    /// speed: the structure is crushed as far, and gives as much back.
    pub(super) fn speed_of_equal_energy(&self, speed_m_per_s: f64, mass_kg: f64) -> f64 {
        speed_m_per_s * (mass_kg / self.masses().effective_kg()).sqrt()
    }

    /// The same of a run.
    pub(super) fn energy_speed(&self, case: &ModelCase) -> f64 {
        self.speed_of_equal_energy(case.speed_m_per_s, self.moved_kg(&case.features))
    }

    /// The masses of a run with these features.
    fn masses_of(&self, features: &[f64]) -> Masses {
        let of = |name: &str| {
            let at = self.features.iter().position(|feature| feature.parameter == name)?;
            features.get(at).copied()
        };
        let Masses { body_kg, other_kg } = self.masses();
        let other_kg = other_kg.map(|other_kg| of(OTHER_MASS).unwrap_or(other_kg));
        Masses { body_kg: of(MASS).unwrap_or(body_kg), other_kg }
    }

    /// The mass in kg that moves along the deflections of such a run.
    fn moved_kg(&self, features: &[f64]) -> f64 {
        self.masses_of(features).effective_kg()
    }

    /// Whether a mass, [`MASS`] or [`OTHER_MASS`], is among its parameters.
    pub(super) fn has(&self, mass: &str) -> bool {
        self.features.iter().any(|feature| feature.parameter == mass)
    }

    /// Whether the two bodies of a run differ in mass.
    pub(super) fn is_of_unequal_masses(&self) -> bool {
        let differ = |Masses { body_kg, other_kg }: Masses| {
            other_kg.is_some_and(|other_kg| !is_same_mass(body_kg, other_kg))
        };
        self.cases.iter().any(|case| differ(self.masses_of(&case.features)))
    }

    /// The masses at an interface as a query has them: in the order that is nearer to one of the runs if the curves depend on the masses of unequal
    /// bodies, else of two equal bodies with the same reduced mass.
    pub(crate) fn masses_as_trained(&self, masses: Masses) -> Masses {
        let equal_kg = masses.equal_kg();
        let equal = Masses { body_kg: equal_kg, other_kg: masses.other_kg.map(|_| equal_kg) };
        let depends = (self.has(MASS) || self.has(OTHER_MASS)) && self.is_of_unequal_masses();
        let Some(other_kg) = masses.other_kg.filter(|_| depends) else {
            return equal;
        };
        let swapped = Masses { body_kg: other_kg, other_kg: Some(masses.body_kg) };
        let off = |of: Masses| {
            let from = |run: Masses| {
                let ratio = |a: f64, b: f64| (a / b).max(b / a);
                let other = run.other_kg.zip(of.other_kg).map_or(1.0, |(a, b)| ratio(a, b));
                ratio(run.body_kg, of.body_kg).max(other)
            };
            let runs = self.cases.iter().map(|case| from(self.masses_of(&case.features)));
            runs.fold(f64::INFINITY, f64::min)
        };
        if off(swapped) < off(masses) { swapped } else { masses }
    }

    /// The band of a force at a query's place, or why there is none although speeds were left out.
    pub(super) fn band(
        &self,
        at: &QueryPoint<'_>,
        force: ForceKind,
    ) -> Result<Option<Band>, Warning> {
        let Some(of) = &self.leave_one_out else { return Ok(None) };
        let (inner, ends) = if force == self.force_kind {
            (of.band, of.band_outside)
        } else {
            (of.body_band, of.body_band_outside)
        };
        if inner.or(ends).is_none() {
            // Of fewer than three that is said already.
            return match self.cases.len() {
                0..3 => Ok(None),
                _ => Err(Warning::no_band("no speed could be left out to assess the model")),
            };
        }
        if let Some((feature, ..)) = self.features_outside(at).next() {
            let name = feature.name();
            let why = format!("no case outside the training cases' {name} was left out");
            return Err(Warning::no_band(&why));
        }
        let speeds: Vec<f64> = self.showing().map(|c| c.speed_m_per_s).collect();
        let is_inside = (speeds[0]..=speeds[speeds.len() - 1]).contains(&at.speed_m_per_s);
        if is_inside && !self.contains(at) {
            let why = "no speed beyond those of the runs with these parameters was left out";
            return Err(Warning::no_band(why));
        }
        match band::at(inner, ends, &speeds, at.speed_m_per_s) {
            Some(band) => Ok(Some(band)),
            None => Err(Warning::no_band(
                "no left-out speed shows how far FE may lie from a curve here",
            )),
        }
    }

    /// Numbers among the parameters that lie outside the training cases', as feature, value,
    /// lowest and highest.
    fn features_outside(
        &self,
        at: &QueryPoint<'_>,
    ) -> impl Iterator<Item = (&Feature, f64, f64, f64)> {
        let numbers = self.features.iter().enumerate().filter(|(_, f)| f.category.is_none());
        numbers.filter_map(|(k, feature)| {
            let known = || self.cases.iter().map(|c| c.features[k]);
            let (low, high) =
                (known().fold(f64::INFINITY, f64::min), known().fold(f64::NEG_INFINITY, f64::max));
            // A crush law that drives a train is not asked for any.
            let asked = *at.features.get(k)?;
            // 32 t are those of a run whose mass by momentum is 31.99 t.
            let slack = NEARLY_INSIDE * low.abs().max(high.abs());
            let inside = low - slack..=high + slack;
            (!inside.contains(&asked)).then_some((feature, asked, low, high))
        })
    }

    /// The declared forces in N at increasing deflections from 0 on that are close enough to follow the body's motion.
    pub(crate) fn force_n(&self, at: &QueryPoint<'_>, deflection_m: &[f64]) -> Vec<f64> {
        self.fitted.force_n(&self.curves.declared, at, deflection_m)
    }

    /// The forces in N that move the body, at such deflections: of its motion, or the declared ones if the model has no others.
    pub(crate) fn body_force_n(&self, at: &QueryPoint<'_>, deflection_m: &[f64]) -> Vec<f64> {
        match &self.fitted_body {
            Some(body) if body.crush_law().is_some() => {
                let law_n =
                    |at: &QueryPoint<'_>| body.force_n(&self.curves.declared, at, deflection_m);
                let mass_kg = |run: &CaseCurve| self.moved_kg(&run.features);
                let Curves { body: runs, responses, .. } = &*self.curves;
                with_response(runs, responses, mass_kg, at, deflection_m, law_n)
            }
            Some(body) => body.force_n(&self.curves.body, at, deflection_m),
            None => self.force_n(at, deflection_m),
        }
    }

    /// Whether the body forces of its runs are others than the declared ones: those of curves without times are not.
    pub(crate) fn has_own_body_forces(&self) -> bool {
        let Curves { declared, body, .. } = &*self.curves;
        declared.iter().zip(body).any(|(declared, body)| declared != body)
    }

    /// Whether declared force and body force are two.
    pub fn has_body_force(&self) -> bool {
        self.fitted_body.is_some()
    }

    /// The curves of a force at the two training speeds around `v` if the collapse mode changes between them: a run
    /// there may follow either.
    pub(super) fn branches(&self, v: f64, force: ForceKind) -> impl Iterator<Item = &CaseCurve> {
        let of_body = force != self.force_kind;
        let curves = if of_body { &self.curves.body } else { &self.curves.declared };
        let switch =
            self.mode_switches_m_per_s.iter().find(|(below, above)| *below < v && v < *above);
        curves.iter().filter(move |curve| {
            switch.is_some_and(|(a, b)| [*a, *b].contains(&curve.speed_m_per_s))
        })
    }

    /// Whether it has a crush law on whose stopped mass its runs agree.
    pub(crate) fn knows_stopped_mass(&self) -> bool {
        self.crush_law.as_ref().is_some_and(|law| law.stopped.is_known())
    }

    /// Makes its crush law one without stopped mass, in which the contact force itself has the rate.
    pub(crate) fn without_stopped_mass(&mut self) {
        if let Some(law) = &self.crush_law {
            self.crush_law = Some(law.without_stopped_mass(&self.curves.declared));
        }
    }

    /// The crush law and its curve at a speed of the model's kind.
    pub(crate) fn crush_curve(&self, speed_m_per_s: f64) -> Option<(&CrushLaw, CrushCurve)> {
        let law = self.crush_law.as_ref()?;
        Some((law, law.at(&self.curves.declared, speed_m_per_s)?))
    }

    /// Stiffness in N/m of the line on which a body of `mass_kg`, or two of that mass, leave the crush force at a speed, linear
    /// between the runs: that with which it rebounds as fast as it did, or else the recorded one of
    /// the declared force.
    pub(crate) fn unloading_n_per_m(&self, speed_m_per_s: f64, mass_kg: f64) -> Option<f64> {
        let equal_v = speed_m_per_s * (mass_kg / self.mass_kg).sqrt();
        let of = |(case, curve): (&ModelCase, &CaseCurve)| {
            let top_n = curve.force_at(curve.end_m());
            let law = self.crush_law.as_ref();
            let free_kg = self.moved_kg(&case.features)
                - law.map_or(0.0, |law| law.stopped.at(curve.end_m()));
            let rebound = case.rebound_speed_m_per_s;
            let stiffness = rebound.and_then(|v| rebound_stiffness_n_per_m(top_n, free_kg, v));
            Some((self.energy_speed(case), stiffness.or(case.unloading_stiffness_n_per_m)?))
        };
        let known = self.cases.iter().zip(&self.curves.declared).filter_map(of);
        interpolate_held(&mean_points(known), equal_v)
    }

    /// The training curves: of the declared force, and of the body's where it is another.
    pub(crate) fn curves(&self) -> (&[CaseCurve], &[CaseCurve]) {
        (&self.curves.declared, &self.curves.body)
    }

    /// The most by which a point of the training curves lies above both neighbours at
    /// `step_m`, or below both, in N; `most` finds it in curves. Cached for the first step that is
    /// asked for.
    pub(super) fn most_kink_n(
        &self,
        of_body: bool,
        step_m: f64,
        most: impl Fn(&[CaseCurve]) -> f64,
    ) -> f64 {
        let (declared, body) = self.curves();
        let of_body = of_body && !body.is_empty();
        let curves = if of_body { body } else { declared };
        let kept = self.curves.kinks[usize::from(of_body)]
            .get_or_compute(|| SlopeJump { step_m, most_n: most(curves) });
        if kept.step_m == step_m { kept.most_n } else { most(curves) }
    }

    /// Warnings of a query here, for any mass and rule.
    pub(crate) fn warnings(&self, at: &QueryPoint<'_>) -> Vec<Warning> {
        let v = at.speed_m_per_s;
        let speeds = self.speeds_around(at);
        let (low, high) = (speeds[0], speeds[speeds.len() - 1]);
        let mut warnings = Vec::new();
        if self.cases.len() < 3 {
            warnings.push(Warning::too_few_curves(self.cases.len()));
        }
        let nearest = speeds[nearest(speeds.iter().copied(), v)];
        if !self.contains(at) {
            let of = if self.cases.iter().any(|case| !self.is_alike(case, at)) {
                " of the runs with these parameters"
            } else {
                ""
            };
            warnings.push(Warning::out_of_range(v, low, high, of));
        } else if (nearest / v - 1.0).abs() > FAR_OUTSIDE_SHARE {
            warnings.push(Warning::far_from_training(v, nearest));
        }
        let known = warnings.len();
        warnings.extend(self.features_outside(at).map(|(feature, asked, low, high)| {
            Warning::parameter_out_of_range(&feature.name(), asked, low, high)
        }));
        if warnings.len() == known && !self.cases.iter().any(|case| self.is_alike(case, at)) {
            warnings.push(Warning::parameters_of_no_run(&self.features, at.features));
        }
        for &(below, above) in &self.mode_switches_m_per_s {
            if below < v && v < above {
                warnings.push(Warning::mode_switch(below, above));
            }
        }
        warnings.extend(self.fitted.warnings(&self.curves.declared, at));
        warnings.extend(self.case_warnings());
        warnings
    }

    /// Whether a run has the parameters of a query, but for masses that the model follows.
    pub(super) fn is_alike(&self, case: &ModelCase, at: &QueryPoint<'_>) -> bool {
        let pairs = self.features.iter().zip(case.features.iter().zip(at.features));
        pairs.into_iter().all(|(feature, (own, asked))| {
            let is_mass = feature.is_mass();
            let share = if is_mass { SAME_MASS } else { NEARLY_INSIDE };
            let follows = is_mass && self.kind.entry.follows_closing;
            follows || (own - asked).abs() <= share * own.abs()
        })
    }

    /// Warnings of the training runs, shortened if there are many.
    pub(crate) fn case_warnings(&self) -> Vec<Warning> {
        let of_case = |c: &ModelCase| Warning::of_case(&c.name, c.truncated, &c.warnings);
        let mut warnings: Vec<Warning> = self.cases.iter().flat_map(of_case).collect();
        if let Some(more) = warnings.len().checked_sub(MOST_NAMED).filter(|&more| more > 1) {
            warnings.truncate(MOST_NAMED);
            warnings.push(Warning {
                code: WarningCode::CaseWarning,
                message: format!(
                    "and {more} more warnings of training runs: crumple db ls has them"
                ),
            });
        }
        warnings
    }
}
