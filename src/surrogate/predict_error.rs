//! Why there is no predicted curve.

use crate::curve::EnvelopeError;
use crate::dataset::DatasetError;

/// Bounds of an energy correction: beyond them level or crush is wrong, not the scale.
pub(super) const CORRECTION: (f64, f64) = (0.8, 1.25);

/// Why there is no curve.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PredictError {
    #[error("the speed must be above 0, found {speed_m_per_s} m/s")]
    Speed {
        speed_m_per_s: f64,
    },
    #[error(
        "{outside}: further outside than a third of the range, where nothing tells how wrong a curve is: run FE at such a speed, or ask for it all the same with --extrapolate"
    )]
    FarOutside {
        outside: String,
    },
    #[error(
        "the maximal crush by the {rule} rule is {found}: expected a length above 0; try --max-crush {other}"
    )]
    MaxCrush {
        rule: &'static str,
        found: String,
        other: &'static str,
    },
    #[error(
        "the energy correction would multiply the force by {factor:.3}, outside {low} to {high}: not the scale is wrong; look at mass, speed and the rule for the maximal crush",
        low = CORRECTION.0, high = CORRECTION.1
    )]
    Correction {
        factor: f64,
    },
    #[error(transparent)]
    Parameters(Box<DatasetError>),
    #[error("the model has no parameter \"{name}\": its parameters are {known}")]
    UnknownParameter {
        name: String,
        known: String,
    },
    #[error(
        "the curve has a contact force and no body force: use the contact force, or predict it again with a model whose runs record velocities"
    )]
    NoBodyForce,
    #[error(
        "the curve has a body force and no contact force: its study's recipe names none; use the body force"
    )]
    NoContactForce,
    #[error("the {model} model has no answer at this speed: train another one")]
    NoAnswer {
        model: &'static str,
    },
    #[error("the predicted curve is no curve: {0}")]
    Envelope(#[from] EnvelopeError),
    #[error("{0}")]
    Damaged(String),
}
