//! Prediction: the force–deflection curve at a new speed.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::band::{self, Band};
use super::curves::interpolate_held;
use super::max_crush::{self, MaxCrushRule};
use super::model::{Fitted, ModelCase};
use super::warning::{Warning, is_far_outside, outside_of};
use super::{At, Model};
use crate::curve::{EnergyAudit, Envelope, EnvelopeError, ForceKind, Masses, Parameter};
use crate::dataset::{DatasetError, MASS, OTHER_MASS, feature_values, grid, nearest};
use crate::unit::{Speed, SpeedKind, UnitSystem};

/// Points of a predicted curve beside (0, 0), as in the reference data.
const POINTS: usize = 400;
/// Deviation of the mass from the training runs' that needs no warning.
const SAME_MASS: f64 = 1e-3;
/// The body's motion is followed to this share of the longest training curve.
const REACH: f64 = 1.5;
/// Bounds of an energy correction: beyond them level or crush is wrong, not the scale.
const CORRECTION: (f64, f64) = (0.8, 1.25);
/// A point stands alone if its force lies above both neighbours, or below both, by more than
/// this factor of what any training curve shows.
const SPIKE: f64 = 1.05;
const ROUNDS: usize = 100;
/// Most places of a training curve that are looked at.
const PROBES: f64 = 4_000.0;

/// What is asked of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct Query {
    pub speed_m_per_s: f64,
    /// Mass of the body, or of each body of a pair; the training runs' if absent.
    pub mass_kg: Option<f64>,
    /// How the maximal crush is found; the model's own way if absent.
    pub rule: Option<MaxCrushRule>,
    /// Values of the model's further parameters.
    pub parameters: BTreeMap<String, Parameter>,
    /// Scale the force so that the curve takes up the impact's energy.
    pub energy_correct: bool,
    /// Answer further outside the training speeds than a third of their range.
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

    /// The same with a rule for the maximal crush.
    pub fn with_rule(self, rule: MaxCrushRule) -> Self {
        Self { rule: Some(rule), ..self }
    }
}

/// A predicted curve: the master format of exports (JSON).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PredictedCurve {
    /// Loading branch from (0, 0) to the maximal crush.
    pub deflection_m: Vec<f64>,
    #[serde(rename = "force_N")]
    pub force_n: Vec<f64>,
    /// Band around the force, where the model gives one.
    #[serde(rename = "force_low_N", default, skip_serializing_if = "Option::is_none")]
    pub force_low_n: Option<Vec<f64>>,
    #[serde(rename = "force_high_N", default, skip_serializing_if = "Option::is_none")]
    pub force_high_n: Option<Vec<f64>>,
    /// The force that moves the body, where `force_N` is what the obstacle feels: mass that
    /// the crush zone stops early is in the one and not in the other. It drives bodies of one
    /// mass.
    #[serde(rename = "body_force_N", default, skip_serializing_if = "Option::is_none")]
    pub body_force_n: Option<Vec<f64>>,
    /// Forces between which the members of a forest's leaves lie, if the model keeps them. They
    /// tell how the training points scatter, not how far FE lies off.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub forest_quantiles: Option<ForestQuantiles>,
    /// Unloading stiffness that belongs to `force_N`, from its maximal crush: that of the
    /// rebound where one is known, else the measured one, at least the steepest rise.
    #[serde(rename = "unloading_stiffness_N_per_m")]
    pub unloading_stiffness_n_per_m: f64,
    /// The same for `body_force_N`.
    #[serde(
        rename = "body_unloading_stiffness_N_per_m",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub body_unloading_stiffness_n_per_m: Option<f64>,
    /// Which runs `force_N` may drive.
    #[serde(default)]
    pub drives: String,
    /// Which runs `body_force_N` may drive.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_drives: Option<String>,
    /// The rebound from the maximal crush.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rebound: Option<Rebound>,
    pub max_deflection_m: f64,
    pub speed_m_per_s: f64,
    pub speed_kind: SpeedKind,
    /// Mass of the body, or of each body of a pair.
    pub mass_kg: f64,
    /// Integral of force over deflection.
    #[serde(rename = "energy_J")]
    pub energy_j: f64,
    pub model: String,
    pub warnings: Vec<Warning>,
    pub provenance: Provenance,
}

/// Quantiles of a regression forest (Meinshausen, JMLR 7, 2006) along the curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ForestQuantiles {
    /// Share of the members' weight between the two.
    pub level: f64,
    #[serde(rename = "low_N")]
    pub low_n: Vec<f64>,
    #[serde(rename = "high_N")]
    pub high_n: Vec<f64>,
}

/// How the bodies part after the maximal crush.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Rebound {
    /// In m/s; interpolated as a power of the impact speed, since the share that comes back
    /// falls with it.
    pub speed_m_per_s: f64,
    /// Unloading stiffness from the maximal crush that gives this speed: `F²/(m v²)` with the
    /// force and mass of the body.
    #[serde(rename = "stiffness_N_per_m")]
    pub stiffness_n_per_m: f64,
}

/// Where a predicted curve comes from and how it was checked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Provenance {
    pub written_by: String,
    pub group: String,
    pub force_kind: ForceKind,
    pub training_hash: String,
    /// Units of the training runs' files: what an export to their solver is written in.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub study_units: Option<UnitSystem>,
    pub training_speeds_m_per_s: Vec<f64>,
    pub in_range: bool,
    pub nearest_training_speed_m_per_s: f64,
    pub distance_to_nearest_m_per_s: f64,
    pub max_crush_rule: MaxCrushRule,
    pub max_crush: MaxCrush,
    /// `mv²/2` against a wall, `μ v_r²/2` of a pair.
    #[serde(rename = "kinetic_energy_J")]
    pub kinetic_energy_j: f64,
    /// Energy of the curve over the kinetic energy.
    pub energy_over_kinetic: f64,
    /// The same for the body force, where it is another.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_energy_over_kinetic: Option<f64>,
    /// The band around the force at this speed, and what it rests on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub band: Option<Band>,
    /// Values of the model's further parameters.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, Parameter>,
}

/// The maximal crush by all rules, in m; `None` where a rule has no answer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MaxCrush {
    pub spline_m: Option<f64>,
    pub monotone_m: Option<f64>,
    pub energy_m: Option<f64>,
    /// Absent in files of earlier versions.
    #[serde(default)]
    pub motion_m: Option<f64>,
    /// Largest less smallest.
    pub spread_m: f64,
}

/// Why there is no curve.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PredictError {
    #[error("the speed must be above 0, found {speed_m_per_s} m/s")]
    Speed { speed_m_per_s: f64 },
    #[error(
        "{outside}: further outside than a third of the range, where nothing tells how wrong a curve is: run FE at such a speed, or ask for it all the same with --extrapolate"
    )]
    FarOutside { outside: String },
    #[error(
        "the maximal crush by the {rule} rule is {found}: expected a length above 0; try --max-crush {other}"
    )]
    MaxCrush { rule: &'static str, found: String, other: &'static str },
    #[error(
        "the energy correction would multiply the force by {factor:.3}, outside {low} to {high}: not the scale is wrong; look at mass, speed and the rule for the maximal crush",
        low = CORRECTION.0, high = CORRECTION.1
    )]
    Correction { factor: f64 },
    #[error(transparent)]
    Parameters(Box<DatasetError>),
    #[error("the model has no parameter \"{name}\": its parameters are {known}")]
    UnknownParameter { name: String, known: String },
    #[error(
        "the curve has a contact force and no body force: use the contact force, or predict it again with a model whose runs record velocities"
    )]
    NoBodyForce,
    #[error(
        "the curve has a body force and no contact force: its study's recipe names none; use the body force"
    )]
    NoContactForce,
    #[error("the {model} model has no answer at this speed: train another one")]
    NoAnswer { model: &'static str },
    #[error("the predicted curve is no curve: {0}")]
    Envelope(#[from] EnvelopeError),
    #[error("{0}")]
    Damaged(String),
}

/// The curve of `model` at the speed of `query`, with its audit and warnings.
///
/// # Errors
/// [`PredictError`] if the speed is not above 0 or far outside the training speeds, a parameter is missing, the rule gives no
/// maximal crush, or an energy correction is out of bounds.
pub fn predict(model: &Model, query: &Query) -> Result<PredictedCurve, PredictError> {
    predict_beyond(model, query).map(|(curve, _)| curve)
}

/// The forces of a model along even deflections beyond any maximal crush, in N: neighbours in
/// a train push on where a body by itself would have stopped.
#[derive(Clone, Debug, PartialEq)]
pub struct Beyond {
    pub declared: Envelope,
    pub body: Envelope,
}

/// A query with everything that follows from it and the model alone.
struct Asked<'a> {
    model: &'a Model,
    v: f64,
    masses: Masses,
    /// That the motion follows.
    mass_kg: f64,
    same_mass: bool,
    parameters: BTreeMap<String, Parameter>,
    features: Vec<f64>,
    kinetic_energy_j: f64,
}

impl<'a> Asked<'a> {
    fn new(model: &'a Model, query: &Query) -> Result<Self, PredictError> {
        let v = query.speed_m_per_s;
        if !(v > 0.0 && v.is_finite()) {
            return Err(PredictError::Speed { speed_m_per_s: v });
        }
        let (low, high) = model.range_m_per_s();
        if !query.extrapolate && is_far_outside(v, low, high) {
            return Err(PredictError::FarOutside { outside: outside_of(v, low, high) });
        }
        let mut parameters = query.parameters.clone();
        let other = match parameters.get(OTHER_MASS) {
            Some(Parameter::Number(mass)) if *mass > 0.0 && mass.is_finite() => Some(*mass),
            _ => None,
        };
        let masses = match query.mass_kg {
            Some(mass) => {
                let other_kg = model.other_mass_kg.map(|_| other.unwrap_or(mass));
                Masses { body_kg: mass, other_kg }
            }
            None => Masses {
                other_kg: model.other_mass_kg.map(|trained| other.unwrap_or(trained)),
                ..model.masses()
            },
        };
        if let Some(mass) = query.mass_kg {
            parameters.insert(MASS.into(), Parameter::Number(mass));
        }
        if let Some(other) = masses.other_kg {
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
            return Err(PredictError::UnknownParameter {
                name: name.clone(),
                known: if names.is_empty() { "none".into() } else { names.join(", ") },
            });
        }
        let features = feature_values(&model.features, &parameters)
            .map_err(|e| PredictError::Parameters(Box::new(e)))?;
        let mass_kg = masses.effective_kg();
        let same_mass = (mass_kg / model.masses().effective_kg() - 1.0).abs() <= SAME_MASS;
        let kinetic_energy_j =
            masses.kinetic_energy_j(Speed { m_per_s: v, kind: model.speed_kind });
        Ok(Self { model, v, masses, mass_kg, same_mass, parameters, features, kinetic_energy_j })
    }

    fn at(&self) -> At<'_> {
        At {
            speed_m_per_s: self.v,
            features: &self.features,
            mass_kg: self.mass_kg,
            closing_m_per_s: None,
        }
    }

    /// The force of the body's motion, beyond any maximal crush.
    fn body(&self) -> Result<Envelope, PredictError> {
        let longest = self.model.cases.iter().map(|c| c.max_deflection_m).fold(0.0, f64::max);
        let along = grid(REACH * longest, POINTS);
        let force_n = self.model.body_force_n(&self.at(), &along);
        let force_n = sound(self.model, &along, force_n, true)?;
        Ok(Envelope::new(along, force_n)?)
    }

    /// The rule for the maximal crush.
    fn rule(&self, query: &Query) -> MaxCrushRule {
        let (low, high) = self.model.range_m_per_s();
        query.rule.unwrap_or(match self.model.max_crush_rule {
            // Crush over speed is that of the trained mass and speeds; the motion knows both.
            MaxCrushRule::Spline | MaxCrushRule::Monotone
                if !(self.same_mass && (low..=high).contains(&self.v)) =>
            {
                MaxCrushRule::Motion
            }
            rule => rule,
        })
    }

    /// The rebound after the body's force was `top_n` at the maximal crush.
    fn rebound(&self, top_n: f64) -> Option<Rebound> {
        // Another mass gets the same energy back: the structure's, not the car's.
        let trained_kg = self.model.masses().effective_kg();
        rebound_speed(self.model, self.v)
            .map(|speed| Rebound {
                speed_m_per_s: speed * (trained_kg / self.mass_kg).sqrt(),
                stiffness_n_per_m: top_n * top_n / (trained_kg * speed * speed),
            })
            .filter(|r| r.stiffness_n_per_m > 0.0 && r.stiffness_n_per_m.is_finite())
    }

    /// What must be said of unloading, mass, and of an energy over the kinetic energy.
    fn warn(&self, warnings: &mut Vec<Warning>, unloading: Option<f64>, energy: f64) {
        if unloading.is_none() {
            warnings.push(Warning::no_unloading());
        }
        let mass_is_feature = self.model.features.iter().any(|f| f.parameter == MASS);
        if !mass_is_feature && !self.same_mass {
            let trained_kg = self.model.masses().effective_kg();
            warnings.push(Warning::other_mass(self.mass_kg, trained_kg));
        }
        if (energy - 1.0).abs() > EnergyAudit::TOLERANCE {
            warnings.push(Warning::energy_mismatch(energy));
        }
    }
}

fn evenly(end_m: f64) -> Vec<f64> {
    // The last point is the end itself, not its rounding.
    let inner = (0..POINTS).map(|i| end_m * i as f64 / POINTS as f64);
    inner.chain([end_m]).collect()
}

/// What drives a body of one mass: the force of its motion and how it unloads.
#[derive(Clone, Debug, PartialEq)]
pub struct Drive {
    /// To the maximal crush.
    pub envelope: Envelope,
    /// Along even deflections beyond it: neighbours in a train push on where a body by itself
    /// would have stopped.
    pub beyond: Envelope,
    /// From the maximal crush.
    pub unloading_stiffness_n_per_m: f64,
    pub warnings: Vec<Warning>,
}

/// The part of a prediction that moves bodies, at a fraction of its cost; `None` if the model
/// has no force of the body's own, or if the rule for the crush needs the other one.
///
/// # Errors
/// As [`predict`].
pub fn drive(model: &Model, query: &Query) -> Result<Option<Drive>, PredictError> {
    let asked = Asked::new(model, query)?;
    let rule = asked.rule(query);
    if !model.has_body_force() || rule == MaxCrushRule::Energy || query.energy_correct {
        return Ok(None);
    }
    let beyond = asked.body()?;
    // The energy rule's answer is not asked for.
    let crush = max_crush(model, asked.v, &beyond, &beyond, asked.kinetic_energy_j);
    let deflection_m = evenly(chosen(&crush, rule)?);
    let force_n = deflection_m.iter().map(|&d| beyond.force_at(d)).collect();
    let envelope = Envelope::new(deflection_m, force_n)?;
    let unloading = over_speed(model, asked.v, |c| c.unloading_stiffness_n_per_m);
    let mut warnings = model.warnings(&asked.at());
    asked.warn(&mut warnings, unloading, envelope.work() / asked.kinetic_energy_j);
    let rebound = asked.rebound(envelope.force_at(envelope.end_m()));
    let unloading_stiffness_n_per_m = match rebound {
        Some(rebound) => rebound.stiffness_n_per_m,
        None => unloading.unwrap_or(0.0).max(envelope.max_slope()),
    };
    Ok(Some(Drive { envelope, beyond, unloading_stiffness_n_per_m, warnings }))
}

/// As [`predict`], with the forces beyond the maximal crush.
///
/// # Errors
/// As [`predict`].
pub fn predict_beyond(
    model: &Model,
    query: &Query,
) -> Result<(PredictedCurve, Beyond), PredictError> {
    let asked = Asked::new(model, query)?;
    let (v, mass_kg, at) = (asked.v, asked.mass_kg, asked.at());
    let kinetic_energy_j = asked.kinetic_energy_j;

    // The motion first: crush and the speeds along it follow from the body's force.
    let body = asked.body()?;
    let along = body.deflection_m().to_vec();
    let closing_at = |&d: &f64| (v * v - 2.0 * body.work_to(d) / mass_kg).max(0.0).sqrt();
    let declared_over = |deflection_m: &[f64]| {
        if !model.has_body_force() {
            return Ok(deflection_m.iter().map(|&d| body.force_at(d)).collect());
        }
        let closing: Vec<f64> = deflection_m.iter().map(closing_at).collect();
        let force_n = model.force_n(&At { closing_m_per_s: Some(&closing), ..at }, deflection_m);
        sound(model, deflection_m, force_n, false)
    };
    let declared = Envelope::new(along.clone(), declared_over(&along)?)?;
    let crush = max_crush(model, v, &declared, &body, kinetic_energy_j);
    let rule = asked.rule(query);
    let end = chosen(&crush, rule)?;

    let deflection_m = evenly(end);
    let force_n = declared_over(&deflection_m)?;
    let body_n = deflection_m.iter().map(|&d| body.force_at(d)).collect();
    let mut warnings = model.warnings(&at);
    let corrected = |force_n: Vec<f64>, warn: bool, warnings: &mut Vec<Warning>| {
        let envelope = Envelope::new(deflection_m.clone(), force_n)?;
        if !query.energy_correct {
            return Ok(envelope);
        }
        let factor = kinetic_energy_j / envelope.work();
        if !(CORRECTION.0..=CORRECTION.1).contains(&factor) {
            return Err(PredictError::Correction { factor });
        }
        if warn {
            warnings.push(Warning::energy_corrected(factor));
        }
        let force_n = envelope.force_n().iter().map(|f| factor * f).collect();
        Ok(Envelope::new(deflection_m.clone(), force_n)?)
    };
    let envelope = corrected(force_n, true, &mut warnings)?;
    let beyond = Beyond { declared, body: body.clone() };
    let body = match model.has_body_force() {
        true => Some(corrected(body_n, false, &mut warnings)?),
        false => None,
    };
    let energy_over_kinetic = envelope.work() / kinetic_energy_j;
    let body_energy_over_kinetic = body.as_ref().map(|b| b.work() / kinetic_energy_j);

    let unloading = over_speed(model, v, |c| c.unloading_stiffness_n_per_m);
    let worst = body_energy_over_kinetic
        .filter(|e| (e - 1.0).abs() > (energy_over_kinetic - 1.0).abs())
        .unwrap_or(energy_over_kinetic);
    asked.warn(&mut warnings, unloading, worst);
    let rebound = asked.rebound(body.as_ref().unwrap_or(&envelope).force_at(end));
    let nearest =
        model.cases[nearest(model.cases.iter().map(|c| c.speed_m_per_s), v)].speed_m_per_s;
    let band = model.band(&at).unwrap_or_else(|warning| {
        warnings.push(warning);
        None
    });
    let (force_low_n, force_high_n) = band.map(|b| b.around(envelope.force_n())).unzip();
    let mut parameters = asked.parameters.clone();
    parameters.retain(|name, _| model.features.iter().any(|f| f.parameter == *name));
    let (low, high) = model.range_m_per_s();
    let mut curve = PredictedCurve {
        // Without a rebound a softer unloading than the steepest rise would create energy.
        unloading_stiffness_n_per_m: unloading.unwrap_or(0.0).max(envelope.max_slope()),
        body_unloading_stiffness_n_per_m: None,
        drives: model.force_kind.drives().into(),
        body_drives: body.as_ref().map(|_| ForceKind::Body.drives().into()),
        rebound,
        max_deflection_m: end,
        energy_j: envelope.work(),
        deflection_m: envelope.deflection_m().to_vec(),
        force_n: envelope.force_n().to_vec(),
        force_low_n,
        force_high_n,
        body_force_n: body.as_ref().map(|b| b.force_n().to_vec()),
        forest_quantiles: match model.fitted() {
            Fitted::Forest(forest) | Fitted::Extra(forest) => forest
                .quantiles(&at, envelope.deflection_m(), band::LEVEL)
                .map(|(low_n, high_n)| ForestQuantiles { level: band::LEVEL, low_n, high_n }),
            _ => None,
        },
        speed_m_per_s: v,
        speed_kind: model.speed_kind,
        mass_kg: asked.masses.body_kg,
        model: model.options.name().into(),
        warnings,
        provenance: Provenance {
            written_by: concat!("crumple ", env!("CARGO_PKG_VERSION")).into(),
            group: model.group.clone(),
            force_kind: model.force_kind,
            training_hash: model.training_hash.clone(),
            study_units: model.study_units,
            training_speeds_m_per_s: model.cases.iter().map(|c| c.speed_m_per_s).collect(),
            in_range: (low..=high).contains(&v),
            nearest_training_speed_m_per_s: nearest,
            distance_to_nearest_m_per_s: (nearest - v).abs(),
            max_crush_rule: rule,
            max_crush: crush,
            kinetic_energy_j,
            energy_over_kinetic,
            body_energy_over_kinetic,
            band,
            parameters,
        },
    };
    curve.unloading_stiffness_n_per_m = curve.stiffness_at_end(&envelope);
    curve.body_unloading_stiffness_n_per_m = body.map(|b| curve.stiffness_at_end(&b));
    Ok((curve, beyond))
}

/// Forces of a physical loading branch: 0 at 0, never negative, and no point that stands
/// alone as none of a training curve does.
fn sound(
    model: &Model,
    deflection_m: &[f64],
    force_n: Vec<f64>,
    of_body: bool,
) -> Result<Vec<f64>, PredictError> {
    if force_n.iter().any(|f| !f.is_finite()) {
        return Err(PredictError::NoAnswer { model: model.options.name() });
    }
    let mut force_n: Vec<f64> = force_n.into_iter().map(|f| f.max(0.0)).collect();
    let step = deflection_m[1] - deflection_m[0];
    // How far a point lies above both of its neighbours, or below both.
    let stands_out = |before: f64, at: f64, after: f64| {
        let (a, b) = (at - before, at - after);
        if a * b > 0.0 { a.abs().min(b.abs()) } else { 0.0 }
    };
    let most = model.most_kink_n(of_body, step, |curves| {
        let mut most = 0.0_f64;
        for curve in curves {
            // Far finer steps than the curve's own find no other kinks.
            let probes = (2.0 * curve.end_m() / step).clamp(2.0, PROBES) as usize;
            for k in 0..probes {
                let d = step + (curve.end_m() - 2.0 * step).max(0.0) * k as f64 / probes as f64;
                let [a, b, c] = [d - step, d, d + step].map(|d| curve.force_at(d));
                most = most.max(stands_out(a, b, c));
            }
        }
        most
    });
    // Taking one point back may leave its neighbour standing: a few rounds settle it.
    for _ in 0..ROUNDS {
        let mut settled = true;
        for i in 2..force_n.len() - 1 {
            let (before, after) = (force_n[i - 1], force_n[i + 1]);
            if most > 0.0 && stands_out(before, force_n[i], after) > SPIKE * most {
                force_n[i] = 0.5 * (before + after);
                settled = false;
            }
        }
        if settled {
            break;
        }
    }
    force_n[0] = 0.0;
    Ok(force_n)
}

fn max_crush(
    model: &Model,
    v: f64,
    declared: &Envelope,
    body: &Envelope,
    kinetic_j: f64,
) -> MaxCrush {
    // Crush over speed is a function only if nothing else differs.
    let points: Vec<(f64, f64)> = match model.features.is_empty() {
        true => {
            let whole = model.cases.iter().filter(|c| !c.truncated);
            whole.map(|c| (c.speed_m_per_s, c.max_deflection_m)).collect()
        }
        false => Vec::new(),
    };
    let spline_m = max_crush::spline(&points, v);
    let monotone_m = max_crush::monotone(&points, v);
    let energy_m = max_crush::energy(declared, kinetic_j);
    let motion_m = max_crush::energy(body, kinetic_j);
    let all = || [spline_m, monotone_m, energy_m, motion_m].into_iter().flatten();
    let spread_m = all().fold(f64::NEG_INFINITY, f64::max) - all().fold(f64::INFINITY, f64::min);
    MaxCrush { spline_m, monotone_m, energy_m, motion_m, spread_m: spread_m.max(0.0) }
}

impl MaxCrush {
    /// The answer of one rule.
    pub fn by(&self, rule: MaxCrushRule) -> Option<f64> {
        match rule {
            MaxCrushRule::Spline => self.spline_m,
            MaxCrushRule::Monotone => self.monotone_m,
            MaxCrushRule::Energy => self.energy_m,
            MaxCrushRule::Motion => self.motion_m,
        }
    }
}

fn chosen(crush: &MaxCrush, rule: MaxCrushRule) -> Result<f64, PredictError> {
    match crush.by(rule) {
        Some(end) if end > 0.0 && end.is_finite() => Ok(end),
        found => Err(PredictError::MaxCrush {
            rule: rule.name(),
            found: found.map_or("not defined for these cases".into(), |d| format!("{d} m")),
            other: MaxCrushRule::ALL
                .into_iter()
                .find(|&r| crush.by(r).is_some_and(|d| d > 0.0 && d.is_finite()))
                .map_or("(no rule has an answer here)", MaxCrushRule::name),
        }),
    }
}

/// The speed of separation, as a power of the impact speed between training speeds, and
/// the outermost share of it beyond them.
fn rebound_speed(model: &Model, v: f64) -> Option<f64> {
    let logarithm = |c: &ModelCase| Some((c.rebound_speed_m_per_s? / c.speed_m_per_s).ln());
    let share = over_speed_by(model, v.ln(), |c| Some((c.speed_m_per_s.ln(), logarithm(c)?)))?;
    Some(v * share.exp())
}

/// A value of the cases interpolated linearly in speed, held at both ends; the mean of
/// cases of equal speed.
fn over_speed(model: &Model, v: f64, value: impl Fn(&ModelCase) -> Option<f64>) -> Option<f64> {
    over_speed_by(model, v, |c| Some((c.speed_m_per_s, value(c)?)))
}

fn over_speed_by(
    model: &Model,
    x: f64,
    point: impl Fn(&ModelCase) -> Option<(f64, f64)>,
) -> Option<f64> {
    let mut known: Vec<(f64, f64, f64)> = Vec::new();
    for (x, y) in model.cases.iter().filter_map(point) {
        match known.last_mut() {
            Some(last) if last.0 == x => {
                last.1 += y;
                last.2 += 1.0;
            }
            _ => known.push((x, y, 1.0)),
        }
    }
    let points: Vec<(f64, f64)> = known.into_iter().map(|(x, sum, n)| (x, sum / n)).collect();
    interpolate_held(&points, x)
}

impl PredictedCurve {
    /// The loading branch as a function.
    ///
    /// # Errors
    /// [`PredictError`] if the curve was read from a file and breaks its promises.
    pub fn envelope(&self) -> Result<Envelope, PredictError> {
        let stiffness = self.unloading_stiffness_n_per_m;
        if !(stiffness > 0.0 && stiffness.is_finite()) {
            return Err(PredictError::Damaged(format!(
                "unloading_stiffness_N_per_m is {stiffness}: expected more than 0"
            )));
        }
        for (name, band) in [
            ("force_low_N", &self.force_low_n),
            ("force_high_N", &self.force_high_n),
            ("body_force_N", &self.body_force_n),
        ] {
            if let Some(band) = band
                && band.len() != self.force_n.len()
            {
                return Err(PredictError::Damaged(format!(
                    "{name} has {} values, force_N {}",
                    band.len(),
                    self.force_n.len()
                )));
            }
        }
        let envelope = Envelope::new(self.deflection_m.clone(), self.force_n.clone())?;
        match envelope.first_pulling_point() {
            Some(point) => Err(PredictError::Damaged(format!(
                "force_N of point {point} is below 0: an interface only pushes"
            ))),
            None => Ok(envelope),
        }
    }

    /// The curve of one force alone, with the unloading that belongs to it. What is of the
    /// declared force only (band, quantiles) goes with that.
    ///
    /// # Errors
    /// [`PredictError::NoBodyForce`] or [`PredictError::NoContactForce`] if it does not have that
    /// force, else as [`envelope`](Self::envelope).
    pub fn of_force(&self, kind: ForceKind) -> Result<Self, PredictError> {
        match (kind, self.provenance.force_kind) {
            (ForceKind::Contact, ForceKind::Body) => Err(PredictError::NoContactForce),
            (ForceKind::Contact, ForceKind::Contact) => self.of_contact_force(),
            (ForceKind::Body, _) => self.of_body_force(),
        }
    }

    fn of_contact_force(&self) -> Result<Self, PredictError> {
        let stiffness = self.stiffness_at_end(&self.envelope()?);
        let mut curve = self.clone();
        curve.unloading_stiffness_n_per_m = stiffness;
        if let Some(rebound) = &mut curve.rebound {
            rebound.stiffness_n_per_m = stiffness;
        }
        curve.without_second_force();
        Ok(curve)
    }

    fn of_body_force(&self) -> Result<Self, PredictError> {
        let envelope = self.driving_envelope()?;
        let mut curve = self.clone();
        curve.unloading_stiffness_n_per_m = self.stiffness_at_end(&envelope);
        if self.body_force_n.is_none() {
            return Ok(curve);
        }
        if curve.rebound.is_none() {
            curve.unloading_stiffness_n_per_m = envelope.max_slope();
        }
        curve.energy_j = envelope.work();
        curve.force_n = envelope.force_n().to_vec();
        (curve.force_low_n, curve.force_high_n, curve.forest_quantiles) = (None, None, None);
        curve.drives = ForceKind::Body.drives().into();
        curve.provenance.force_kind = ForceKind::Body;
        curve.provenance.energy_over_kinetic =
            self.provenance.body_energy_over_kinetic.unwrap_or(self.provenance.energy_over_kinetic);
        curve.provenance.band = None;
        curve.without_second_force();
        Ok(curve)
    }

    fn without_second_force(&mut self) {
        self.body_force_n = None;
        self.body_unloading_stiffness_n_per_m = None;
        self.body_drives = None;
        self.provenance.body_energy_over_kinetic = None;
    }

    /// Unloading stiffness with which a run leaves the end of one of the curve's envelopes: the
    /// energy of the rebound is the same whichever force it comes from.
    pub fn stiffness_at_end(&self, envelope: &Envelope) -> f64 {
        let end = self.max_deflection_m;
        let driving = self.body_force_n.as_ref().unwrap_or(&self.force_n).last();
        let share = driving.map_or(1.0, |driving| envelope.force_at(end) / driving);
        self.rebound
            .map(|r| r.stiffness_n_per_m * share * share)
            .filter(|k| *k > 0.0 && k.is_finite())
            .unwrap_or(self.unloading_stiffness_n_per_m)
    }

    /// The curve that moves a body of one mass: the body force, or the only force there is.
    ///
    /// # Errors
    /// As [`envelope`](Self::envelope); [`PredictError::NoBodyForce`] for a contact force alone.
    pub fn driving_envelope(&self) -> Result<Envelope, PredictError> {
        let declared = self.envelope()?;
        match &self.body_force_n {
            Some(force_n) => Ok(Envelope::new(self.deflection_m.clone(), force_n.clone())?),
            None if self.provenance.force_kind == ForceKind::Contact => {
                Err(PredictError::NoBodyForce)
            }
            None => Ok(declared),
        }
    }
}
