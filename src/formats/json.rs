//! Predicted curve as JSON: the master format of exports.

use super::Exported;
use super::export_curve::file_stem;
use crate::error::{Error, error};
use crate::surrogate::PredictedCurve;

pub(crate) fn write(curve: &PredictedCurve) -> Result<Exported, Error> {
    curve.envelope()?;
    let mut bytes = serde_json::to_vec_pretty(curve)
        .map_err(|e| error!(Export, "cannot encode the curve: {e}").caused_by(e))?;
    bytes.push(b'\n');
    Ok(Exported::file(format!("{}.json", file_stem(curve)), bytes))
}
