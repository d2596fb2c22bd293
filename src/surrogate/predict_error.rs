//! Why there is no predicted curve.

use crate::curve::Envelope;
use crate::error::{Error, ErrorCode};

/// Bounds of an energy correction: beyond them level or crush is wrong, not the scale.
pub(super) const CORRECTION: (f64, f64) = (0.8, 1.25);

/// The envelope of a predicted curve.
pub(super) fn envelope(deflection_m: Vec<f64>, force_n: Vec<f64>) -> Result<Envelope, Error> {
    Envelope::new(deflection_m, force_n).map_err(invalid)
}

/// The error of a predicted curve that is not an envelope.
pub(crate) fn invalid(error: Error) -> Error {
    error.coded_as(ErrorCode::Prediction).of("the predicted curve is invalid")
}
