//! Surrogates: models of F(v, d) behind one trait, and the curve predicted from them.
//!
//! Every model answers through one trait: force over speed, further features, mass and deflection. Models that answer from the
//! training curves alone (`nearest`, `linear`) hold nothing else; the curves stand once in the model file, over even
//! deflections.

mod alignment;
pub(crate) mod band;
mod blend;
mod cached;
mod cases;
pub(crate) mod crush_law;
mod crush_law_model;
pub(crate) mod curves;
pub(crate) mod forest;
mod gaussian_process;
pub(crate) mod leave_one_out;
mod linear;
pub(crate) mod max_crush;
pub(crate) mod model;
mod model_file;
pub(crate) mod models;
mod nearest;
pub(crate) mod predict;
use std::fmt::Debug;

use serde_json::value::RawValue;

pub use band::Band;
pub use cases::ModelCase;
pub(crate) use crush_law::CrushLaw;
pub(crate) use curves::CaseCurve;
pub use forest::ForestOptions;
pub use leave_one_out::{BodyScatter, Floor, LeftOut, Means, Scatter, SpeedScatter, Validation};
pub use max_crush::MaxCrushRule;
pub use model::Model;
pub(crate) use models::MODELS;
pub use models::ModelKind;
pub use predict::{predict, predict_driving};
pub use predicted::{Beyond, ForestQuantiles, PredictedCurve, Provenance, Rebound};
pub use query::Query;
pub use speed_of_crush::{SpeedOfCrush, speed_of_crush};
pub use warning::{Warning, WarningCode};
pub(crate) mod predicted;
mod query;
mod rate;
pub(crate) mod recorded;
mod response;
mod speed_of_crush;
pub(crate) mod warning;

/// Where a surrogate is used.
#[derive(Clone, Copy, Debug)]
pub(crate) struct QueryPoint<'a> {
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
pub(crate) trait Surrogate: Debug + Send + Sync {
    /// Forces in N at increasing deflections (m), one per deflection. `cases` are the
    /// curves it was fitted to, in order of speed.
    fn force_n(&self, cases: &[CaseCurve], at: &QueryPoint<'_>, deflection_m: &[f64]) -> Vec<f64>;

    /// What a user must know about a query here, beyond what holds for all models.
    fn warnings(&self, _cases: &[CaseCurve], _at: &QueryPoint<'_>) -> Vec<Warning> {
        Vec::new()
    }

    /// How far its answer is data, in m; `None` if that is as far as any of the runs.
    fn data_end_m(&self, _cases: &[CaseCurve], _at: &QueryPoint<'_>) -> Option<f64> {
        None
    }

    /// What was fitted, for the model file; `None` for a model that answers from the training
    /// curves alone.
    fn parameters(&self) -> Option<Result<Box<RawValue>, serde_json::Error>> {
        None
    }

    /// What a fit guarantees of the parameters and a file might not.
    fn check(&self, _features: usize) -> Result<(), String> {
        Ok(())
    }

    /// Whether it needs the training curves to answer.
    fn answers_from_curves(&self) -> bool {
        true
    }

    /// The law from which it answers, by the curves of the contact force, whichever force it gives.
    fn crush_law(&self) -> Option<&CrushLaw> {
        None
    }

    fn forest(&self) -> Option<&forest::ForestSurrogate> {
        None
    }
}
