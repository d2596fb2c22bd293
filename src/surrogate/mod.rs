//! Surrogates: models of F(v, d) behind one trait, and the curve predicted from them.

pub mod band;
pub mod curves;
pub mod forest;
pub mod gp;
mod kept;
pub mod landmarks;
pub mod leave_one_out;
pub mod linear;
pub mod max_crush;
pub mod model;
pub mod nearest;
pub mod predict;
pub mod rate;
pub mod registered;
pub mod warning;

pub use curves::CaseCurve;
pub use model::{Fitted, Model, ModelError, Options};
pub use predict::{PredictedCurve, Query, predict};
pub use warning::Warning;

/// Where a surrogate is asked.
#[derive(Clone, Copy, Debug)]
pub struct At<'a> {
    /// Impact speed, of the training cases' kind.
    pub speed_m_per_s: f64,
    /// Values of the training set's further features.
    pub features: &'a [f64],
    /// Mass that moves along the deflection.
    pub mass_kg: f64,
    /// Closing speed in m/s at each deflection, where the body's motion is known; without
    /// it a model that needs it integrates its own force.
    pub closing_m_per_s: Option<&'a [f64]>,
}

/// A model of the force at an interface over impact speed, deflection and whatever else
/// distinguishes the cases it was fitted to.
pub trait Surrogate {
    /// Forces in N at increasing deflections (m), one per deflection. `cases` are the
    /// curves it was fitted to, in order of speed.
    fn force_n(&self, cases: &[CaseCurve], at: &At<'_>, deflection_m: &[f64]) -> Vec<f64>;

    /// What a user must know about a query here, beyond what holds for all models.
    fn warnings(&self, _cases: &[CaseCurve], _at: &At<'_>) -> Vec<Warning> {
        Vec::new()
    }
}
