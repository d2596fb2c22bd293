//! Why there is no predicted curve.

use crate::curve::EnvelopeError;
use crate::dataset::DatasetError;
use crate::guess;

/// Bounds of an energy correction: beyond them level or crush is wrong, not the scale.
pub(super) const CORRECTION: (f64, f64) = (0.8, 1.25);

/// Why there is no curve.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PredictError {
    /// The speed is not above 0.
    #[error("the speed must be above 0, found {speed_m_per_s} m/s")]
    Speed {
        /// The speed asked for, in m/s.
        speed_m_per_s: f64,
    },
    /// The speed is further outside the training speeds than a third of their range.
    #[error(
        "{outside}: further outside than a third of the range, where nothing tells how wrong a curve is: run FE at such a speed, or ask for it all the same with --extrapolate"
    )]
    FarOutside {
        /// Which speed, and what the range is.
        outside: String,
    },
    /// The rule for the maximal crush gives no length above 0.
    #[error(
        "the maximal crush by the {rule} rule is {found}: expected a length above 0; try --max-crush {other}"
    )]
    MaxCrush {
        /// Name of the rule.
        rule: &'static str,
        /// What it gives.
        found: String,
        /// A rule to try instead.
        other: &'static str,
    },
    /// The energy correction would change the force too much to be one of scale.
    #[error(
        "the energy correction would multiply the force by {factor:.3}, outside {low} to {high}: the scale is not what is wrong; look at mass, speed and the rule for the maximal crush",
        low = CORRECTION.0, high = CORRECTION.1
    )]
    Correction {
        /// The factor on the force.
        factor: f64,
    },
    /// The query's parameters are not those of the model.
    #[error(transparent)]
    Parameters(Box<DatasetError>),
    /// The query gives a parameter that the model does not have.
    #[error(
        "the model has no parameter \"{name}\": its parameters are {known}{}",
        guess::hint(name, known)
    )]
    UnknownParameter {
        /// Its name.
        name: String,
        /// The model's parameters, as a list.
        known: String,
    },
    /// The curve has no force that moves a body.
    #[error(
        "the curve has a contact force and no body force: use the contact force, or predict it again with a model whose runs record velocities"
    )]
    NoBodyForce,
    /// The curve has no contact force.
    #[error(
        "the curve has a body force and no contact force: its study's recipe names none; use the body force"
    )]
    NoContactForce,
    /// The model gives no curve at this speed.
    #[error("the {model} model has no answer at this speed: train another one")]
    NoAnswer {
        /// Name of the model.
        model: &'static str,
    },
    /// The predicted points are no envelope.
    #[error("the predicted curve is no curve: {0}")]
    Envelope(#[from] EnvelopeError),
    /// The curve of a file contradicts itself; the text says how.
    #[error("{0}")]
    Damaged(String),
}
