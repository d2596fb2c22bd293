//! TOML files written by users: parsing, with errors that name file, line and column and show the line.

mod place;

use std::io;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

use crate::file;
use crate::guess;
pub use place::Place;
pub(crate) use place::{Document, KeyPath};

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
    #[error("{place}: {message}")]
    Toml {
        /// Where.
        place: Place,
        /// What is wrong.
        message: String,
    },
}

impl ManifestError {
    /// Where in the file it is wrong.
    pub(crate) fn place(&self) -> Option<&Place> {
        match self {
            Self::Io { .. } => None,
            Self::Toml { place, .. } => Some(place),
        }
    }
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
        // What the file lacks as a whole is shown at its first line.
        let place = match error.span().filter(|span| span.len() < text.len()) {
            Some(span) => Place::new(path, text, span),
            None => Place::new(path, text, 0..0),
        };
        let message = format!("{message}{}", guess_of(&message));
        ManifestError::Toml { place, message }
    })
}

/// The guess for a key or word of which the parser says that it is unknown, and what it expected:
/// the first name between backticks is the unknown one.
fn guess_of(message: &str) -> String {
    if !message.starts_with("unknown ") {
        return String::new();
    }
    let mut names = message.split('`').skip(1).step_by(2);
    let Some(unknown) = names.next() else { return String::new() };
    guess::hint(unknown, &names.collect::<Vec<_>>().join(", "))
}
