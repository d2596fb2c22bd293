//! Predicted curve as JSON: the master format of exports, written and read.

use std::path::{Path, PathBuf};

use super::export_curve::file_stem;
use super::{ExportError, ExportInput, Exported, MAX_CURVE_BYTES, Options};
use crate::file;
use crate::surrogate::PredictedCurve;
use crate::surrogate::predict::PredictError;

pub fn write(input: &ExportInput, options: &Options) -> Result<Exported, ExportError> {
    if options.units.is_some() {
        return Err(ExportError::SiOnly { format: "json" });
    }
    let mut bytes = serde_json::to_vec_pretty(&input.curve)?;
    bytes.push(b'\n');
    Ok(Exported::file(format!("{}.json", file_stem(&input.curve)), bytes))
}

/// Why a file is no predicted curve.
#[derive(Debug, thiserror::Error)]
pub enum CurveFileError {
    #[error("{path}: {source}")]
    Io { path: PathBuf, source: std::io::Error },
    #[error(
        "{path}: this is no predicted curve ({source}): give a JSON file made by crumple predict"
    )]
    Json { path: PathBuf, source: serde_json::Error },
    #[error("{path}: {source}")]
    Curve { path: PathBuf, source: PredictError },
}

/// Reads a predicted curve and checks its promises.
///
/// # Errors
/// [`CurveFileError`] with line and column, or with the promise that is broken.
pub fn read(path: &Path) -> Result<PredictedCurve, CurveFileError> {
    let bytes = file::read(path, MAX_CURVE_BYTES)
        .map_err(|source| CurveFileError::Io { path: path.into(), source })?;
    let curve: PredictedCurve = serde_json::from_slice(&bytes)
        .map_err(|source| CurveFileError::Json { path: path.into(), source })?;
    curve.envelope().map_err(|source| CurveFileError::Curve { path: path.into(), source })?;
    Ok(curve)
}
