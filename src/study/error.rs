//! Why a study or one of its runs cannot be used.

use std::io;
use std::path::PathBuf;

use super::check::InvalidStudy;
use crate::curve::extract::ExtractError;
use crate::manifest::ManifestError;
use crate::solver::ReadError;

/// Why a study cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The file cannot be read, or is no manifest.
    #[error(transparent)]
    Manifest(#[from] ManifestError),
    /// It contradicts itself.
    #[error("{path}: {source}")]
    Invalid {
        /// The manifest.
        path: PathBuf,
        /// What does not fit.
        source: InvalidStudy,
    },
}

/// Why one run gives no case.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "a variant is its message, a field what that says")]
pub enum RunError {
    #[error("the run's folder {path} does not exist: check path in the manifest")]
    NoFolder { path: PathBuf },
    #[error("the run's folder {folder} has no file \"{file}\": it has {found}")]
    NoFile { folder: PathBuf, file: String, found: String },
    #[error("{path}: {source}")]
    Io { path: PathBuf, source: io::Error },
    #[error(transparent)]
    Read(#[from] ReadError),
    #[error("{path}: {source}")]
    Extract { path: PathBuf, source: ExtractError },
    #[error(
        "the manifest gives no units and {why}: add units = \"mm-t-s\" (or what they are) to [study]"
    )]
    NoUnits { why: String },
}
