//! Prediction: the force–deflection curve at a new speed.

use serde::{Deserialize, Serialize};

use super::Model;
use super::max_crush::{self, MaxCrushRule};
use super::warning::Warning;
use crate::curve::{EnergyAudit, Envelope, EnvelopeError, ForceKind, Masses};
use crate::dataset::{GRID_M, nearest};
use crate::unit::{Speed, SpeedKind};

/// Points of a predicted curve beside (0, 0), as in the reference data.
const POINTS: usize = 400;
/// Deviation of the mass from the training runs' that needs no warning.
const SAME_MASS: f64 = 1e-3;

/// What is asked of a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Query {
    pub speed_m_per_s: f64,
    /// Mass of the body, or of each body of a pair; the training runs' if absent.
    pub mass_kg: Option<f64>,
    pub rule: MaxCrushRule,
}

/// A predicted curve: the master format of exports (JSON).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    #[serde(rename = "unloading_stiffness_N_per_m")]
    pub unloading_stiffness_n_per_m: f64,
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

/// Where a predicted curve comes from and how it was checked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    pub written_by: String,
    pub group: String,
    pub force_kind: ForceKind,
    pub training_hash: String,
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
}

/// The maximal crush by all rules, in m; `None` where a rule has no answer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MaxCrush {
    pub spline_m: Option<f64>,
    pub monotone_m: Option<f64>,
    pub energy_m: Option<f64>,
    /// Largest less smallest.
    pub spread_m: f64,
}

/// Why there is no curve.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PredictError {
    #[error("the speed must be above 0, found {speed_m_per_s} m/s")]
    Speed { speed_m_per_s: f64 },
    #[error(
        "the maximal crush by the {rule} rule is {found}: expected a length above 0; try --max-crush {other}"
    )]
    MaxCrush { rule: &'static str, found: String, other: &'static str },
    #[error("the predicted curve is no curve: {0}")]
    Envelope(#[from] EnvelopeError),
    #[error("{0}")]
    Damaged(String),
}

/// The curve of `model` at the speed of `query`, with its audit and warnings.
///
/// # Errors
/// [`PredictError`] if the speed is not above 0 or the rule gives no maximal crush.
pub fn predict(model: &Model, query: &Query) -> Result<PredictedCurve, PredictError> {
    let v = query.speed_m_per_s;
    if !(v > 0.0 && v.is_finite()) {
        return Err(PredictError::Speed { speed_m_per_s: v });
    }
    let masses = match query.mass_kg {
        Some(mass) => Masses { body_kg: mass, other_kg: model.other_mass_kg.map(|_| mass) },
        None => model.masses(),
    };
    let speed = Speed { m_per_s: v, kind: model.speed_kind };
    let kinetic_energy_j = masses.kinetic_energy_j(speed);
    let crush = max_crush(model, v, kinetic_energy_j)?;
    let end = chosen(&crush, query.rule)?;
    let deflection_m: Vec<f64> = (0..=POINTS).map(|i| end * i as f64 / POINTS as f64).collect();
    let force_n = forces(model, v, &deflection_m);
    let envelope = Envelope::new(deflection_m, force_n)?;
    let energy_over_kinetic = envelope.work() / kinetic_energy_j;

    let mut warnings = model.warnings(v);
    let unloading = unloading_stiffness(model, v);
    if unloading.is_none() {
        warnings.push(Warning::no_unloading());
    }
    if (masses.body_kg / model.mass_kg - 1.0).abs() > SAME_MASS {
        warnings.push(Warning::other_mass(masses.body_kg, model.mass_kg));
    }
    if (energy_over_kinetic - 1.0).abs() > EnergyAudit::TOLERANCE {
        warnings.push(Warning::energy_mismatch(energy_over_kinetic));
    }
    let (low, high) = model.range_m_per_s();
    let nearest =
        model.cases[nearest(model.cases.iter().map(|c| c.speed_m_per_s), v)].speed_m_per_s;
    Ok(PredictedCurve {
        // A softer unloading than the steepest rise would create energy.
        unloading_stiffness_n_per_m: unloading.unwrap_or(0.0).max(envelope.max_slope()),
        max_deflection_m: end,
        energy_j: envelope.work(),
        deflection_m: envelope.deflection_m().to_vec(),
        force_n: envelope.force_n().to_vec(),
        force_low_n: None,
        force_high_n: None,
        speed_m_per_s: v,
        speed_kind: model.speed_kind,
        mass_kg: masses.body_kg,
        model: model.options.name().into(),
        warnings,
        provenance: Provenance {
            written_by: concat!("crumple ", env!("CARGO_PKG_VERSION")).into(),
            group: model.group.clone(),
            force_kind: model.force_kind,
            training_hash: model.training_hash.clone(),
            training_speeds_m_per_s: model.cases.iter().map(|c| c.speed_m_per_s).collect(),
            in_range: (low..=high).contains(&v),
            nearest_training_speed_m_per_s: nearest,
            distance_to_nearest_m_per_s: (nearest - v).abs(),
            max_crush_rule: query.rule,
            max_crush: crush,
            kinetic_energy_j,
            energy_over_kinetic,
        },
    })
}

/// Forces of a physical loading branch: 0 at 0, never negative.
fn forces(model: &Model, v: f64, deflection_m: &[f64]) -> Vec<f64> {
    let mut force_n = model.force_n(v, deflection_m);
    force_n.iter_mut().for_each(|f| *f = f.max(0.0));
    force_n[0] = 0.0;
    force_n
}

fn max_crush(model: &Model, v: f64, kinetic_j: f64) -> Result<MaxCrush, PredictError> {
    let points: Vec<(f64, f64)> = model
        .cases
        .iter()
        .filter(|c| !c.truncated)
        .map(|c| (c.speed_m_per_s, c.max_deflection_m))
        .collect();
    let reach = model.cases.iter().map(|c| c.max_deflection_m).fold(0.0, f64::max);
    let steps = (reach / GRID_M).ceil().clamp(2.0, 1e6) as usize;
    let grid: Vec<f64> = (0..=steps).map(|i| reach * i as f64 / steps as f64).collect();
    let force = forces(model, v, &grid);
    let spline_m = max_crush::spline(&points, v);
    let monotone_m = max_crush::monotone(&points, v);
    let energy_m = max_crush::energy(&Envelope::new(grid, force)?, kinetic_j);
    let all = || [spline_m, monotone_m, energy_m].into_iter().flatten();
    let spread_m = all().fold(f64::NEG_INFINITY, f64::max) - all().fold(f64::INFINITY, f64::min);
    Ok(MaxCrush { spline_m, monotone_m, energy_m, spread_m: spread_m.max(0.0) })
}

fn chosen(crush: &MaxCrush, rule: MaxCrushRule) -> Result<f64, PredictError> {
    let (found, other) = match rule {
        MaxCrushRule::Spline => (crush.spline_m, "monotone"),
        MaxCrushRule::Monotone => (crush.monotone_m, "energy"),
        MaxCrushRule::Energy => (crush.energy_m, "monotone"),
    };
    match found {
        Some(end) if end > 0.0 && end.is_finite() => Ok(end),
        _ => Err(PredictError::MaxCrush {
            rule: rule.name(),
            found: found.map_or("not defined for these cases".into(), |d| format!("{d} m")),
            other,
        }),
    }
}

/// The unloading stiffness interpolated linearly in speed, held at both ends, in N/m.
fn unloading_stiffness(model: &Model, v: f64) -> Option<f64> {
    let known: Vec<(f64, f64)> = model
        .cases
        .iter()
        .filter_map(|c| Some((c.speed_m_per_s, c.unloading_stiffness_n_per_m?)))
        .collect();
    let (first, last) = (known.first()?, known.last()?);
    if v <= first.0 {
        return Some(first.1);
    }
    if v >= last.0 {
        return Some(last.1);
    }
    let i = known.partition_point(|k| k.0 <= v);
    let (a, b) = (known[i - 1], known[i]);
    Some(a.1 + (b.1 - a.1) * (v - a.0) / (b.0 - a.0))
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
        for (name, band) in
            [("force_low_N", &self.force_low_n), ("force_high_N", &self.force_high_n)]
        {
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
}
