//! Predicted curve as JSON: the master format of exports.

use super::export_curve::file_stem;
use super::{ExportError, ExportInput, Exported, Options};

pub(crate) fn write(input: &ExportInput, options: &Options) -> Result<Exported, ExportError> {
    if options.units.is_some() {
        return Err(ExportError::SiOnly { format: "json" });
    }
    let mut bytes = serde_json::to_vec_pretty(&input.curve)?;
    bytes.push(b'\n');
    Ok(Exported::file(format!("{}.json", file_stem(&input.curve)), bytes))
}
