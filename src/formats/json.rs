//! Predicted curve as JSON: the master format of exports.

use super::export_curve::file_stem;
use super::{Exported, Options};
use crate::error::{Error, error};
use crate::surrogate::PredictedCurve;

pub(crate) fn write(curve: &PredictedCurve, options: &Options) -> Result<Exported, Error> {
    if options.units.is_some() {
        return Err(error!(
            Export,
            "{format} is always in SI: remove --units, or take a format that has units (csv, lsdyna, radioss, calculix, adams)",
            format = "json"
        ));
    }
    let mut bytes = serde_json::to_vec_pretty(curve)
        .map_err(|e| error!(Export, "cannot encode the curve: {e}").caused_by(e))?;
    bytes.push(b'\n');
    Ok(Exported::file(format!("{}.json", file_stem(curve)), bytes))
}
