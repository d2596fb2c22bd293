//! Curating databases: cases are chosen, removed, renamed, copied, joined, tagged, compared and
//! written as tables.
//!
//! Every function that changes a database locks it, reads it, changes it in memory and puts the new
//! file in the old one's place: a killed program leaves the one or the other, and a second writer
//! gets an error.

mod compare;
mod join;
mod labels;
mod names;
mod selection;
mod tables;

use crate::error::Error;
use std::path::Path;

use crate::database::Database;
pub(crate) use compare::Difference;
pub(crate) use compare::compare;
pub(crate) use join::Joined;
pub(crate) use join::OnConflict;
pub(crate) use join::Target;
pub(crate) use join::copy;
pub(crate) use join::merge;
pub(crate) use labels::Labels;
pub(crate) use labels::label;
pub(crate) use names::remove;
pub(crate) use names::rename_case;
pub(crate) use names::rename_group;
pub(crate) use selection::Selection;
pub(crate) use selection::SpeedRange;
pub(crate) use tables::Tables;
pub(crate) use tables::write_tables;

/// Whether a database is changed, or only the changes are reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Effect {
    Written,
    DryRun,
}

/// Writes a database, unless this is a dry run.
fn write(database: &Database, path: &Path, effect: Effect) -> Result<(), Error> {
    match effect {
        Effect::Written => Ok(database.write(path)?),
        Effect::DryRun => Ok(()),
    }
}
