//! Curve database: cases in HDF5, by group and impact speed.
//!
//! The only module that names HDF5. The layout is described in
//! `schemas/curve_database.md`. A file is always written whole and renamed into place,
//! so an interrupted command leaves the old content readable.

mod histories;
mod layout;
mod lock;
mod skeleton;
pub mod table;

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::curve::{Case, CurveError};
use crate::file::{WriteError, write_whole};
pub use histories::{ConvertError, convert_histories, histories_to_hdf5, is_other_hdf5};
pub use lock::{LockError, WriterLock};

/// The cases of one database file.
///
/// Invariant: within a group, cases are in order of speed, then name; names are unique.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Database {
    groups: BTreeMap<String, Vec<Case>>,
}

/// Why a database cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum DatabaseError {
    #[error("{path}: {source}")]
    Io { path: PathBuf, source: io::Error },
    #[error("{path}: this is no HDF5 file ({detail}): give a database made by crumple build")]
    NotHdf5 { path: PathBuf, detail: String },
    #[error("{path}: this HDF5 file is no curve database (its root has no attribute format = \"{expected}\"): give one made by crumple build", expected = layout::FORMAT)]
    NotOurs { path: PathBuf },
    #[error("{path}: layout version {found} is not known: this program reads up to version {known}", known = layout::VERSION)]
    Version { path: PathBuf, found: i64 },
    #[error("{path}: {place}: {detail}")]
    Damaged { path: PathBuf, place: String, detail: String },
    #[error("{path}: there is no group \"{group}\": it has {known}")]
    NoGroup { path: PathBuf, group: String, known: String },
    #[error("{path}: group \"{group}\" has no case \"{case}\": it has {known}")]
    NoCase { path: PathBuf, group: String, case: String, known: String },
    #[error(
        "case \"{name}\" of group \"{group}\" belongs to the study \"{other}\": if the study was renamed, build into a new database; else name this run or group differently"
    )]
    OtherStudy { group: String, name: String, other: String },
    #[error("cannot encode the database: {detail}")]
    Encode { detail: String },
    #[error(transparent)]
    Write(#[from] WriteError),
}

impl Database {
    /// Reads a database file.
    ///
    /// # Errors
    /// [`DatabaseError`] if the file is missing, not HDF5, not a curve database, of a
    /// newer layout, or damaged; it names the case and dataset.
    pub fn read(path: &Path) -> Result<Self, DatabaseError> {
        let bytes =
            fs::read(path).map_err(|source| DatabaseError::Io { path: path.into(), source })?;
        layout::decode(path, bytes)
    }

    /// Writes the database to `path` as a whole.
    ///
    /// # Errors
    /// [`DatabaseError::Write`] if the target cannot be written; the old file is unchanged.
    pub fn write(&self, path: &Path) -> Result<(), DatabaseError> {
        Ok(write_whole(path, &layout::encode(self)?)?)
    }

    /// Group names in alphabetical order.
    pub fn groups(&self) -> impl Iterator<Item = &str> {
        self.groups.keys().map(String::as_str)
    }

    /// Cases of a group in order of speed; empty if there is no such group.
    pub fn cases(&self, group: &str) -> &[Case] {
        self.groups.get(group).map_or(&[], Vec::as_slice)
    }

    /// Cases of a group in order of speed.
    ///
    /// # Errors
    /// [`DatabaseError::NoGroup`] lists the groups there are; `path` is for the message.
    pub fn group(&self, path: &Path, group: &str) -> Result<&[Case], DatabaseError> {
        self.groups.get(group).map(Vec::as_slice).ok_or_else(|| DatabaseError::NoGroup {
            path: path.into(),
            group: group.into(),
            known: listed(self.groups()),
        })
    }

    /// One case by group and name.
    ///
    /// # Errors
    /// [`DatabaseError::NoGroup`] or [`DatabaseError::NoCase`], with the names there are.
    pub fn case(&self, path: &Path, group: &str, name: &str) -> Result<&Case, DatabaseError> {
        let cases = self.group(path, group)?;
        cases.iter().find(|c| c.name == name).ok_or_else(|| DatabaseError::NoCase {
            path: path.into(),
            group: group.into(),
            case: name.into(),
            known: listed(cases.iter().map(|c| c.name.as_str())),
        })
    }

    /// Adds a case or replaces the one of the same group, name and study.
    ///
    /// # Errors
    /// [`DatabaseError::OtherStudy`] if the name is taken by another study.
    pub fn put(&mut self, case: Case) -> Result<(), DatabaseError> {
        let cases = self.groups.entry(case.group.clone()).or_default();
        if let Some(old) = cases.iter().find(|c| c.name == case.name)
            && old.study != case.study
        {
            return Err(DatabaseError::OtherStudy {
                group: case.group,
                name: case.name,
                other: old.study.clone(),
            });
        }
        cases.retain(|c| c.name != case.name);
        cases.push(case);
        cases.sort_by(|a, b| {
            a.speed.m_per_s.total_cmp(&b.speed.m_per_s).then_with(|| a.name.cmp(&b.name))
        });
        Ok(())
    }

    /// Removes the cases of a group for which `keep` is false; returns their names.
    pub fn retain(&mut self, group: &str, keep: impl Fn(&Case) -> bool) -> Vec<String> {
        let Some(cases) = self.groups.get_mut(group) else { return Vec::new() };
        let removed = cases.iter().filter(|c| !keep(c)).map(|c| c.name.clone()).collect();
        cases.retain(keep);
        if cases.is_empty() {
            self.groups.remove(group);
        }
        removed
    }
}

fn listed<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<_> = names.collect();
    if names.is_empty() { "none".into() } else { names.join(", ") }
}

/// Turns a curve that breaks its invariant into a database error.
fn damaged_curve(path: &Path, place: &str, error: CurveError) -> DatabaseError {
    DatabaseError::Damaged { path: path.into(), place: place.into(), detail: error.to_string() }
}
