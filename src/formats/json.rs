//! Predicted curve as JSON: the master format of exports.

use super::{ExportError, Options};
use crate::surrogate::PredictedCurve;

pub fn write(curve: &PredictedCurve, options: &Options) -> Result<Vec<u8>, ExportError> {
    if options.units.is_some() {
        return Err(ExportError::SiOnly { format: "json" });
    }
    let mut bytes = serde_json::to_vec_pretty(curve)?;
    bytes.push(b'\n');
    Ok(bytes)
}
