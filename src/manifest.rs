//! TOML files written by users: parsing, with errors that name file, line and columns.

use std::io;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

use crate::file;

/// Manifests have a few kilobytes; anything beyond this is another kind of file.
const MAX_BYTES: u64 = 16 << 20;

/// Why a TOML file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ManifestError {
    /// The file cannot be read.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The text is no TOML, or has a key or value that does not belong there.
    #[error("{path}: line {line}, columns {from}-{to}: {message}")]
    Toml {
        /// The file.
        path: PathBuf,
        /// Line in the file, counted from 1.
        line: usize,
        /// First column of what is wrong, counted from 1.
        from: usize,
        /// Last column of what is wrong, counted from 1.
        to: usize,
        /// What is wrong.
        message: String,
    },
    /// The file is wrong as a whole.
    #[error("{path}: {message}")]
    Invalid {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
}

/// Reads and parses the TOML file at `path`.
///
/// # Errors
/// [`ManifestError`] with the place of an unknown key, a missing key or a bad value.
pub(crate) fn load<T: DeserializeOwned>(path: &Path) -> Result<T, ManifestError> {
    parse(path, &read_text(path)?)
}

/// Reads the text of the TOML file at `path`.
///
/// # Errors
/// [`ManifestError::Io`] for what is no file, not UTF-8 or too large.
pub(crate) fn read_text(path: &Path) -> Result<String, ManifestError> {
    file::read_text(path, MAX_BYTES)
        .map_err(|source| ManifestError::Io { path: path.into(), source })
}

/// Parses TOML text; `path` is for messages.
pub(crate) fn parse<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T, ManifestError> {
    toml::from_str(text).map_err(|error| {
        let message = error.message().trim().replace('\n', "; ");
        match error.span() {
            Some(span) => {
                let (line, from) = line_and_column(text, span.start);
                let (end_line, end) = line_and_column(text, span.end.max(span.start + 1) - 1);
                // A value over several lines is shown by where it begins.
                let to = if end_line == line { end } else { from };
                ManifestError::Toml { path: path.into(), line, from, to, message }
            }
            None => ManifestError::Invalid { path: path.into(), message },
        }
    })
}

/// Line and column of a byte, both counted from 1.
fn line_and_column(text: &str, byte: usize) -> (usize, usize) {
    let before = &text.as_bytes()[..byte.min(text.len())];
    let line = before.iter().filter(|&&b| b == b'\n').count() + 1;
    let column = before.iter().rev().take_while(|&&b| b != b'\n').count() + 1;
    (line, column)
}
