//! The data that a model keeps of its training cases, and their curves by force.

use serde::{Deserialize, Serialize};

use super::CaseCurve;
use super::cached::Cached;
use super::response::Response;
use crate::curve::ForceKind;
use crate::dataset::{STEPS, TrainingCase, grid};
use crate::error::Error;

/// Forces beyond this are damage, not measurement.
const LARGEST_N: f64 = 1e15;

/// Data of a training case in a model: its curves over even deflections, no coarser than
/// 2 mm, and its ends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelCase {
    /// Name of the case.
    pub name: String,
    /// Speed before contact, in m/s, of the model's kind.
    pub speed_m_per_s: f64,
    /// Values of the model's features.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub features: Vec<f64>,
    /// Maximum deflection, in m.
    pub max_deflection_m: f64,
    /// Whether the record ended while loading, so that a larger deflection may follow.
    pub truncated: bool,
    /// Measured unloading stiffness, in N/m, if the record reaches so far.
    #[serde(rename = "unloading_stiffness_N_per_m")]
    pub unloading_stiffness_n_per_m: Option<f64>,
    /// Separation speed after the body force has first fallen to zero.
    #[serde(default)]
    pub rebound_speed_m_per_s: Option<f64>,
    /// Warnings of its build.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// Empty in files of version 1.
    #[serde(default)]
    pub deflection_m: Vec<f64>,
    /// The declared force in N, one value per deflection.
    #[serde(rename = "force_N", default)]
    pub force_n: Vec<f64>,
    /// The force of the body's motion; empty where the declared force is one.
    #[serde(rename = "body_force_N", default)]
    pub body_force_n: Vec<f64>,
    /// Closing speed in m/s along the deflections; empty in files of earlier versions.
    #[serde(default)]
    pub closing_speed_m_per_s: Vec<f64>,
}

impl ModelCase {
    pub(super) fn of(case: &TrainingCase, kind: ForceKind) -> Self {
        let deflection_m = grid(case.envelope.end_m(), STEPS);
        let over = |at: &dyn Fn(f64) -> f64| deflection_m.iter().map(|&d| at(d)).collect();
        Self {
            name: case.name.clone(),
            speed_m_per_s: case.speed_m_per_s,
            features: case.features.clone(),
            max_deflection_m: case.envelope.end_m(),
            truncated: case.truncated,
            warnings: case.case.quality.warnings.clone(),
            unloading_stiffness_n_per_m: case.unloading_stiffness_n_per_m,
            rebound_speed_m_per_s: case.motion.rebound_speed_m_per_s,
            force_n: over(&|d| case.envelope.force_at(d)),
            body_force_n: match kind {
                ForceKind::Contact => over(&|d| case.motion.force.force_at(d)),
                ForceKind::Body => Vec::new(),
            },
            closing_speed_m_per_s: over(&|d| case.motion.closing_speed.force_at(d).max(0.0)),
            deflection_m,
        }
    }

    /// Invariants of a case in a fit.
    pub(super) fn check(&self) -> Result<(), String> {
        let positive = |value: Option<f64>| value.is_none_or(|v| v > 0.0 && v.is_finite());
        if !positive(self.unloading_stiffness_n_per_m) || !positive(self.rebound_speed_m_per_s) {
            return Err("its unloading stiffness or rebound speed is not above 0".into());
        }
        let forces = self.force_n.iter().chain(&self.body_force_n);
        if let Some(force) = forces.into_iter().find(|f| f.abs() > LARGEST_N) {
            return Err(format!("a force of {force} N is beyond any vehicle's"));
        }
        if let Some(end) = self.deflection_m.last()
            && (end / self.max_deflection_m - 1.0).abs() > 1e-9
        {
            let max = self.max_deflection_m;
            return Err(format!("its curve ends at {end} m, its maximum deflection is {max} m"));
        }
        Ok(())
    }

    fn curve(&self, force_n: &[f64]) -> Result<CaseCurve, Error> {
        let mut curve = CaseCurve::new(
            self.speed_m_per_s,
            self.features.clone(),
            self.deflection_m.clone(),
            force_n.to_vec(),
            self.closing_speed_m_per_s.clone(),
        )?;
        curve.truncated = self.truncated;
        Ok(curve)
    }
}

/// Training curves by force.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Curves {
    pub declared: Vec<CaseCurve>,
    pub body: Vec<CaseCurve>,
    /// Of the curves of the declared force and of the body's, once it was requested.
    pub kinks: [Cached<SlopeJump>; 2],
    /// Of each of the body's curves, once it was requested.
    pub responses: Vec<Cached<Response>>,
}

/// How far single points of the curves lie above or below both of their neighbours, in N.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SlopeJump {
    /// Distance of the neighbours.
    pub step_m: f64,
    pub most_n: f64,
}

impl Curves {
    pub(crate) fn of(cases: &[ModelCase]) -> Result<Self, Error> {
        let with = |force: fn(&ModelCase) -> &[f64]| -> Result<Vec<_>, _> {
            cases.iter().filter(|c| !force(c).is_empty()).map(|c| c.curve(force(c))).collect()
        };
        let body = with(|c| &c.body_force_n)?;
        Ok(Self {
            declared: with(|c| &c.force_n)?,
            responses: vec![Cached::default(); body.len()],
            body,
            kinks: Default::default(),
        })
    }
}
