//! Curating databases: cases are chosen, removed, renamed, copied, joined, tagged, compared and
//! written as tables.
//!
//! Every function that changes a database locks it, reads it, changes it in memory and puts the new
//! file in the old one's place: whoever is killed leaves the one or the other, and a second writer
//! is told.

mod compare;
mod error;
mod join;
mod labels;
mod names;
mod selection;
mod tables;

use std::path::Path;

use crate::database::Database;
pub use compare::{Comparison, Difference, compare};
pub use error::CurateError;
pub use join::{Joined, OnConflict, Target, copy, merge};
pub use labels::{Labels, label};
pub use names::{remove, rename_case, rename_group};
pub use selection::{Selection, SpeedRange, SpeedRangeError};
pub use tables::{Tables, write_tables};

/// Whether a database is changed or only asked what would change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// The file is written.
    Written,
    /// It stays as it is.
    OnlySaid,
}

/// Writes a database, unless it is only to be said.
fn write(database: &Database, path: &Path, effect: Effect) -> Result<(), CurateError> {
    match effect {
        Effect::Written => Ok(database.write(path)?),
        Effect::OnlySaid => Ok(()),
    }
}
