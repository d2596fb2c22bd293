//! The kind of a file by its first bytes, for commands that accept several kinds.

use std::io::Read;
use std::path::Path;

use crate::error::error;
use crate::file;

use super::Failure;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FileKind {
    /// Curve database.
    Database,
    /// Model.
    Model,
    /// Predicted curve.
    Curve,
    /// Scenario.
    Scenario,
    /// Result of a multi-body run.
    Result,
    /// Anything else: what a solver has written, if it is known at all.
    Solver,
}

/// Bytes in which a file says what it is.
const HEAD: u64 = 4096;
/// With these every HDF5 file begins.
const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";

impl FileKind {
    pub(super) fn of(path: &Path) -> Result<Self, Failure> {
        let mut head = Vec::new();
        file::open(path)
            .and_then(|f| f.take(HEAD).read_to_end(&mut head))
            .map_err(|e| error!(CurveFile, "{path}: {e}", path = path.display()).caused_by(e))?;
        if head.starts_with(HDF5) {
            return Ok(Self::Database);
        }
        let text = String::from_utf8_lossy(&head);
        let text = text.trim_start_matches('\u{feff}');
        let is_toml = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
        Ok(match () {
            () if text.trim_start().starts_with('{') && text.contains("\"crumple model\"") => {
                Self::Model
            }
            () if text.trim_start().starts_with('{') => Self::Curve,
            () if is_toml => Self::Scenario,
            () if text.starts_with("time_s,") => Self::Result,
            () => Self::Solver,
        })
    }

    /// As a message calls it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Database => "a database",
            Self::Model => "a model",
            Self::Curve => "a predicted curve",
            Self::Scenario => "a scenario",
            Self::Result => "a result",
            Self::Solver => "read as a solver file",
        }
    }
}
