//! Surrogates: models of F(v, d) behind one trait, and the curve predicted from them.

pub mod forest;
pub mod leave_one_out;
pub mod max_crush;
pub mod model;
pub mod nearest;
pub mod predict;
pub mod warning;

pub use model::{Fitted, Model, ModelError, Options};
pub use predict::{PredictedCurve, Query, predict};
pub use warning::Warning;

/// A model of the force at an interface over impact speed and deflection.
pub trait Surrogate {
    /// Forces in N at a speed (m/s) and increasing deflections (m), one per deflection.
    fn force_n(&self, speed_m_per_s: f64, deflection_m: &[f64]) -> Vec<f64>;

    /// What a user must know about a query at this speed, beyond what holds for all models.
    fn warnings(&self, speed_m_per_s: f64) -> Vec<Warning>;
}
