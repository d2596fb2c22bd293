//! Queries to a model, and what follows from the query alone.

use std::collections::BTreeMap;

use super::cases::ModelCase;
use super::curves::{interpolate_held, mean_points, neighbours};
use super::max_crush::{self, MaxCrush, MaxCrushRule};
use super::predicted::{Rebound, stopping_force_n};
use super::warning::{Warning, is_far_outside, outside_of};
use super::{CaseCurve, Model, QueryPoint};
use crate::curve::body::rebound_stiffness_n_per_m;
use crate::curve::{EnergyAudit, Envelope, Masses, Parameter, above_0};
use crate::dataset::{MASS, OTHER_MASS, feature_values, is_same_mass};
use crate::error::{Error, ErrorCode, KeyPath, error};
use crate::unit::Speed;

/// Share of a curve over which the force before its maximum crush is averaged.
const LAST_SHARE_OF_CRUSH: f64 = 0.05;
/// Power of that force with which the separation speed goes: the energy returned with its root.
const SEPARATION_SPEED_EXPONENT: f64 = 0.25;

/// A query to a model.
#[derive(Clone, Debug, PartialEq)]
pub struct Query {
    /// Speed before contact in m/s, of the model's kind.
    pub speed_m_per_s: f64,
    /// Mass of the body, or of each body of a pair (the first, if the two bodies of a run differ); the training runs' if absent.
    pub mass_kg: Option<f64>,
    /// How the maximum crush is found; the model's own way if absent.
    pub rule: Option<MaxCrushRule>,
    /// Values of the model's further parameters.
    pub parameters: BTreeMap<String, Parameter>,
    /// Scale the forces so that the one that moves the body absorbs the impact's energy.
    pub energy_correct: bool,
    /// Allow speeds outside the training speeds by more than a third of their range.
    pub extrapolate: bool,
}

impl Query {
    /// The curve at a speed, everything else as the model has it.
    pub fn at(speed_m_per_s: f64) -> Self {
        Self {
            speed_m_per_s,
            mass_kg: None,
            rule: None,
            parameters: BTreeMap::new(),
            energy_correct: false,
            extrapolate: false,
        }
    }

    /// The same with a rule for the maximum crush.
    pub fn with_rule(self, rule: MaxCrushRule) -> Self {
        Self { rule: Some(rule), ..self }
    }

    /// The same at an interface between these masses, as [`Model::masses_as_trained`] has them.
    pub(crate) fn between(mut self, model: &Model, masses: Masses) -> Self {
        let Masses { body_kg, other_kg } = model.masses_as_trained(masses);
        if let Some(other_kg) = other_kg.filter(|_| model.other_mass_kg.is_some()) {
            self.parameters.entry(OTHER_MASS.into()).or_insert(Parameter::Number(other_kg));
        }
        Self { mass_kg: Some(body_kg), ..self }
    }

    /// The runs of a model that have the parameters of the query: all, if it sees speeds alone.
    pub(crate) fn runs_of(&self, model: &Model) -> Vec<ModelCase> {
        let Ok(asked) = ResolvedQuery::new(model, self) else { return Vec::new() };
        model.cases.iter().filter(|case| model.is_alike(case, &asked.at())).cloned().collect()
    }

    /// The training speeds in m/s that the query lies among or beyond, in order.
    pub(crate) fn speeds_around(&self, model: &Model) -> Result<Vec<f64>, Error> {
        Ok(model.speeds_around(&ResolvedQuery::new(model, self)?.at()))
    }
}

/// A query with everything that follows from it and the model alone.
pub(super) struct ResolvedQuery<'a> {
    pub model: &'a Model,
    pub v: f64,
    pub masses: Masses,
    /// Effective mass of the motion.
    pub mass_kg: f64,
    pub same_mass: bool,
    pub parameters: BTreeMap<String, Parameter>,
    pub features: Vec<f64>,
    pub kinetic_energy_j: f64,
}

impl<'a> ResolvedQuery<'a> {
    pub(crate) fn new(model: &'a Model, query: &Query) -> Result<Self, Error> {
        let v = query.speed_m_per_s;
        if !(v > 0.0 && v.is_finite()) {
            return Err(error!(
                Prediction,
                "the speed must be above 0, found {speed_m_per_s} m/s",
                speed_m_per_s = v
            ));
        }
        let (low, high) = model.shown_range_m_per_s();
        if !query.extrapolate && is_far_outside(v, low, high) {
            return Err(error!(
                Prediction,
                "{outside}: more than a third of the range outside, where the error of a curve is unknown: run FE near this speed, or predict it anyway with --extrapolate of crumple predict or export (in Python extrapolate=True)",
                outside = outside_of(v, low, high)
            ));
        }
        let mut parameters = query.parameters.clone();
        let other = mass_among(&parameters, OTHER_MASS)?;
        let as_parameter = mass_among(&parameters, MASS)?;
        if let (Some(mass), Some(other)) = (query.mass_kg, as_parameter)
            && mass != other
        {
            return Err(error!(
                Prediction,
                "{MASS} is {other}, but the mass is given as {mass} kg: give one of them"
            )
            .at(KeyPath::of("parameters").key(MASS)));
        }
        if let Some(mass) = query.mass_kg {
            above_0("the mass", mass).map_err(|e| e.coded_as(ErrorCode::Prediction))?;
        }
        let asked_kg = query.mass_kg.or(as_parameter);
        let is_unequal = model.is_of_unequal_masses();
        let masses = match asked_kg {
            Some(mass) => {
                let usual = |trained| if is_unequal { trained } else { mass };
                let other_kg = model.other_mass_kg.map(|kg| other.unwrap_or(usual(kg)));
                Masses { body_kg: mass, other_kg }
            }
            None => Masses {
                other_kg: model.other_mass_kg.map(|trained| other.unwrap_or(trained)),
                ..model.masses()
            },
        };
        if let Some(mass) = asked_kg {
            parameters.insert(MASS.into(), Parameter::Number(mass));
        }
        // What differs between the runs has to be stated.
        if let Some(other) = masses.other_kg.filter(|_| !(is_unequal && model.has(OTHER_MASS))) {
            parameters.entry(OTHER_MASS.into()).or_insert(Parameter::Number(other));
        }
        let known = |name: &str| {
            let of_pairs = name == OTHER_MASS && model.other_mass_kg.is_some();
            name == MASS || of_pairs || model.features.iter().any(|f| f.parameter == name)
        };
        if let Some(name) = query.parameters.keys().find(|name| !known(name)) {
            let mut names: Vec<&str> =
                model.features.iter().map(|f| f.parameter.as_str()).collect();
            names.dedup();
            let known_names = if names.is_empty() { vec!["none"] } else { names };
            let known_names = known_names.into_iter();
            return Err(error!(
                Prediction,
                "the model has no parameter \"{name}\": its parameters are"
            )
            .names(name, known_names)
            .at(KeyPath::of("parameters").key(name).itself()));
        }
        let features = feature_values(&model.features, &parameters)
            .map_err(|e| e.coded_as(ErrorCode::Prediction).at_key("parameters"))?;
        let mass_kg = masses.effective_kg();
        let same_mass = is_same_mass(mass_kg, model.masses().effective_kg());
        let kinetic_energy_j =
            masses.kinetic_energy_j(Speed { m_per_s: v, kind: model.speed_kind });
        Ok(Self { model, v, masses, mass_kg, same_mass, parameters, features, kinetic_energy_j })
    }

    pub(crate) fn at(&self) -> QueryPoint<'_> {
        QueryPoint {
            speed_m_per_s: self.v,
            features: &self.features,
            mass_kg: self.mass_kg,
            closing_m_per_s: None,
        }
    }

    /// The rule for the maximum crush.
    pub(crate) fn rule(&self, query: &Query) -> MaxCrushRule {
        query.rule.unwrap_or(match self.model.max_crush_rule {
            // Crush over speed is that of the trained mass and speeds; the motion knows both.
            MaxCrushRule::Spline | MaxCrushRule::Monotone
                if !(self.same_mass && self.model.contains(&self.at())) =>
            {
                MaxCrushRule::Motion
            }
            rule => rule,
        })
    }

    /// Speed at which the training mass has the same energy.
    fn energy_speed(&self) -> f64 {
        self.model.speed_of_equal_energy(self.v, self.mass_kg)
    }

    /// The rebound from where the body force has stopped the body.
    pub(crate) fn rebound(&self, body: &Envelope) -> Option<Rebound> {
        // Another mass of the same energy crushes the structure as far and gets the same energy back: the structure's, not
        // the car's.
        let trained_kg = self.model.masses().effective_kg();
        let top_n = stopping_force_n(body, self.kinetic_energy_j);
        let equal_v = self.energy_speed();
        // No body leaves faster than it came.
        let speed = rebound_speed(self.model, equal_v, last_force_n(body))?.min(equal_v);
        Some(Rebound {
            speed_m_per_s: speed * (self.v / equal_v),
            stiffness_n_per_m: rebound_stiffness_n_per_m(top_n, trained_kg, speed)?,
            left_out_error: self
                .model
                .leave_one_out
                .as_ref()
                .and_then(|of| of.chosen_means()?.rebound_error),
        })
    }

    /// The maximum crush by every rule.
    pub(crate) fn max_crush(&self, declared: &Envelope, body: &Envelope) -> MaxCrush {
        let equal_v = self.energy_speed();
        max_crush::by_all_rules(self.model, equal_v, declared, body, self.kinetic_energy_j)
    }

    /// Whether the largest force of the curve is nothing like those of the runs on both sides.
    pub(crate) fn unlike_peak(&self, declared: &Envelope) -> Option<Warning> {
        let (curves, _) = self.model.curves();
        let speeds: Vec<f64> = curves.iter().map(|curve| curve.speed_m_per_s).collect();
        let (low, high, share) = neighbours(&speeds, self.v);
        // At the speed of a run, that run alone.
        let high = if share > 0.0 { high } else { low };
        let is_inside =
            self.model.contains(&self.at()) && self.same_mass && self.model.features.is_empty();
        let peak = |k: usize| (speeds[k], curves[k].envelope().peak_force_n());
        // A run that ended while loading may have had a larger one later.
        let is_inside = is_inside && !curves[low].truncated && !curves[high].truncated;
        is_inside
            .then(|| Warning::peak_force(declared.peak_force_n(), [peak(low), peak(high)]))
            .flatten()
    }

    /// The unloading stiffness of the runs in N/m, interpolated in speed.
    pub(crate) fn unloading_n_per_m(&self) -> Option<f64> {
        let of = |case: &ModelCase| {
            Some((self.model.energy_speed(case), case.unloading_stiffness_n_per_m?))
        };
        interpolate_held(&mean_points(self.model.cases.iter().filter_map(of)), self.energy_speed())
    }

    /// Warnings on unloading, mass, and energy over kinetic energy.
    pub(crate) fn warnings(&self, unloading: Option<f64>, energy: f64) -> Vec<Warning> {
        let mut warnings = Vec::new();
        if unloading.is_none() {
            warnings.push(Warning::no_unloading());
        }
        let trained = self.model.masses();
        let others = self.masses.other_kg.zip(trained.other_kg);
        let is_as_trained = match (self.model.has(MASS), self.model.has(OTHER_MASS)) {
            (false, false) => self.same_mass,
            (true, true) => true,
            (true, false) => others.is_none_or(|(a, b)| is_same_mass(a, b)),
            (false, true) => is_same_mass(self.masses.body_kg, trained.body_kg),
        };
        if !is_as_trained {
            warnings.push(Warning::other_mass(self.masses, self.model.masses()));
        }
        if (energy - 1.0).abs() > EnergyAudit::TOLERANCE {
            warnings.push(Warning::energy_mismatch(energy));
        }
        warnings
    }
}

/// A mass in kg that the parameters give.
fn mass_among(parameters: &BTreeMap<String, Parameter>, name: &str) -> Result<Option<f64>, Error> {
    match parameters.get(name) {
        None => Ok(None),
        Some(Parameter::Number(kg)) if *kg > 0.0 && kg.is_finite() => Ok(Some(*kg)),
        Some(other) => {
            let found = match other {
                Parameter::Number(number) => number.to_string(),
                Parameter::Category(text) => format!("\"{text}\""),
            };
            let message = error!(Prediction, "{name} is {found}: expected a mass in kg, above 0");
            Err(message.at(KeyPath::of("parameters").key(name)))
        }
    }
}

/// The separation speed of the training mass: `F^¼ (a + b v)` with the mean force `F` before the maximum crush, `a` and `b` by
/// least squares of the runs' ratios to it. A structure behind one fold returns the same energy whatever
/// the force of that fold, the fold itself in proportion to it; the runs cannot separate the two, and
/// the root lies between. Runs of other masses count at the speed of equal energy. The residual of a run fades with the square of the proximity in speed. Beyond the
/// runs the line goes on from the outermost, neither falling with the speed nor rising faster than in proportion.
fn rebound_speed(model: &Model, v: f64, last_n: f64) -> Option<f64> {
    let (declared, body) = model.curves();
    let curves = if body.is_empty() { declared } else { body };
    let of_force = |force_n: f64| {
        if force_n > 0.0 { libm::pow(force_n, SEPARATION_SPEED_EXPONENT) } else { 0.0 }
    };
    let known = |(case, curve): (&ModelCase, &CaseCurve)| {
        let equal_v = model.energy_speed(case);
        let separates = case.rebound_speed_m_per_s? * (equal_v / case.speed_m_per_s);
        let per_force = separates / of_force(last_force_n(curve.envelope()));
        per_force.is_finite().then_some((equal_v, per_force))
    };
    let known: Vec<(f64, f64)> = model.cases.iter().zip(curves).filter_map(known).collect();
    let line = relative_line(&known)?;
    let beside = mean_points(known.iter().map(|&(v, y)| (v, libm::log(y / line(v)))));
    let speeds: Vec<f64> = beside.iter().map(|p| p.0).collect();
    let (low, high, share) = neighbours(&speeds, v);
    let beside = (1.0 - share).powi(2) * beside[low].1 + share.powi(2) * beside[high].1;
    let v_held = v.clamp(speeds[0], speeds[speeds.len() - 1]);
    let held = line(v_held);
    let slope = (line(v_held + 1.0) - held).clamp(0.0, held / v_held);
    Some(of_force(last_n) * libm::exp(beside) * (held + slope * (v - v_held)))
}

/// `a + b v` with the least squares of its ratios to the points, which are above 0; their mean if it were
/// not above 0 at all of them.
fn relative_line(points: &[(f64, f64)]) -> Option<impl Fn(f64) -> f64> {
    let weigh = |(v, y): &(f64, f64)| [1.0 / (y * y), v / (y * y), v * v / (y * y), 1.0 / y, v / y];
    let mut sums = [0.0; 5];
    points.iter().for_each(|p| sums.iter_mut().zip(weigh(p)).for_each(|(sum, x)| *sum += x));
    let [one, of_v, of_square, right, right_v] = sums;
    let determinant = one * of_square - of_v * of_v;
    let level = right / one;
    let line = if determinant > 1e-9 * one * of_square {
        let b = (one * right_v - of_v * right) / determinant;
        ((right - b * of_v) / one, b)
    } else {
        (level, 0.0)
    };
    let is_sound = points.iter().all(|&(v, _)| line.0 + line.1 * v > 0.0);
    let (a, b) = if is_sound { line } else { (level, 0.0) };
    (level.is_finite() && level > 0.0).then_some(move |v: f64| a + b * v)
}

/// Mean force in N over the last part of a curve: its very end is a matter of the fold's phase.
fn last_force_n(curve: &Envelope) -> f64 {
    let from_m = (1.0 - LAST_SHARE_OF_CRUSH) * curve.end_m();
    (curve.work() - curve.work_to(from_m)) / (curve.end_m() - from_m)
}
