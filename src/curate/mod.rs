//! Curating databases: cases are chosen, removed, renamed, copied, joined, tagged, compared and
//! written as tables.
//!
//! Every function that changes a database locks it, reads it, changes it in memory (one case of a large file: in a copy of the
//! file) and puts the new file in the old one's place: a killed program leaves the one or the other, and a second writer
//! gets an error.

mod croissant;
mod join;
mod labels;
mod selection;
mod tables;

pub(crate) use croissant::FILE as DESCRIPTION;
pub(crate) use join::{Joined, JoinedCase, OnConflict, copy, merge};
pub(crate) use labels::{Labels, label, remove, rename_case, rename_group};
pub(crate) use selection::{Selection, SpeedRange};
pub(crate) use tables::{Difference, TABLES, compare, write_tables};
