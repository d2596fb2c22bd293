//! Why one of the runs of a study cannot be used.

use crate::curve::ExtractError;
use crate::guess;
use crate::solver::ReadError;
use std::io;
use std::path::PathBuf;

/// Why one run gives no case.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The run's folder is not there.
    #[error("the run's folder {path} does not exist: check path in the manifest")]
    NoFolder {
        /// The folder.
        path: PathBuf,
    },
    /// A file that the recipe names is not there.
    #[error(
        "the run's folder {folder} has no file \"{file}\": it has {found}{}",
        guess::hint(file, found)
    )]
    NoFile {
        /// The run's folder.
        folder: PathBuf,
        /// Name of the file.
        file: String,
        /// What the folder has, as a list.
        found: String,
    },
    /// A file cannot be opened or hashed.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A solver's file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The histories give no curve.
    #[error("{path}: {source}")]
    Extract {
        /// The file that tells so.
        path: PathBuf,
        /// Why.
        source: ExtractError,
    },
    /// Neither manifest nor deck say the units.
    #[error(
        "the manifest gives no units and {}: add units = \"mm-t-s\" (or what they are) to [study]",
        deck.as_ref().map_or("the run has no deck that could".into(), |deck| {
            format!("the deck {} states none", deck.display())
        })
    )]
    NoUnits {
        /// The run's deck, if it has one.
        deck: Option<PathBuf>,
    },
}
