//! Why a run is left out of a proposed study.

use std::path::PathBuf;

use crate::error::{Error, error};
use serde::Serialize;

/// A folder that a proposed study leaves out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LeftOut {
    /// The folder, as it was found.
    pub path: PathBuf,
    #[serde(flatten)]
    pub(crate) reason: Reason,
    /// The reason in words.
    pub message: String,
    /// Its entry in the study, commented out there, where one can be written.
    #[serde(skip)]
    pub(super) entry: Option<String>,
}

impl LeftOut {
    pub(super) fn new(path: PathBuf, reason: Reason) -> Self {
        Self { path, message: reason.to_string(), reason, entry: None }
    }
}

/// Why a run is left out.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "reason", rename_all = "snake_case")]
pub(crate) enum Reason {
    /// There is nothing in the folder.
    #[error("the folder is empty")]
    Empty,
    #[error("it holds no solver files")]
    NoSolverFiles,
    /// A solver's file has another name than the solver gave it.
    #[error("it holds no file with a solver's name, but {file} looks like a {format}: name it so")]
    Renamed {
        file: String,
        /// What it looks like.
        format: String,
    },
    /// There is a deck and nothing that a solver wrote.
    #[error("it holds a deck and nothing that a solver wrote: it has not run")]
    OnlyDeck,
    /// A folder or file cannot be read.
    #[error("{why}")]
    Unreadable { why: String },
    /// No file holds motions of nodes.
    #[error("it has no histories of nodes (a nodout, or a binout or T01 with one): it has {found}")]
    NoMotion {
        /// Its files, as a list.
        found: String,
    },
    /// The record has hardly begun.
    #[error("it died: {file} holds {states} whole {}{damage}", if *.states == 1 { "state" } else { "states" })]
    FewStates {
        file: String,
        /// How many whole states it holds.
        states: usize,
        /// What is damaged, in brackets; empty if nothing is.
        damage: String,
    },
    /// The record ends before the crash does.
    #[error(
        "it died: the record ends at {end}, while the bodies still close at {} % of their first speed{damage}", (share * 100.0).round()
    )]
    EndsWhileLoading {
        /// Last time that motion and force share, with its unit if that is known.
        end: String,
        /// Closing speed there over that at the start.
        share: f64,
        /// What is damaged, in brackets; empty if nothing is.
        damage: String,
    },
    /// No node moves at the start.
    #[error(
        "nothing moves in its first state, so there is no impact speed to read: if a wall moves, write its study by hand"
    )]
    Stands,
    /// The chosen histories cannot be used.
    #[error("{why}")]
    Unusable { why: String },
    /// Its files are those of another run.
    #[error("its files hold the same bytes as those of {of}")]
    SameBytes {
        /// The other run's folder.
        of: PathBuf,
    },
    /// Its histories are those of another run, in other files.
    #[error("its histories are those of {of}")]
    SameHistories {
        /// The other run's folder.
        of: PathBuf,
    },
    /// The study's recipe does not fit it.
    #[error("it needs another recipe than the other runs: {why}")]
    OtherRecipe {
        /// What differs.
        why: String,
    },
    /// It is of another model than the other runs.
    #[error("it seems to be of another model: {why}")]
    OtherModel {
        /// What differs.
        why: String,
    },
    /// The study's build would refuse it.
    #[error("crumple build would refuse it: {why}")]
    Refused { why: String },
}

/// The error of folders without a usable run, and what may be the cause.
pub(super) fn no_usable_run(left_out: &[LeftOut], doubts: &[String]) -> Error {
    let doubts: String = doubts.iter().map(|d| format!("\n{d}")).collect();
    error!(Study, "no run can be used:\n{}{doubts}", listed(left_out))
}

/// Folders with their reasons, a line each.
pub(super) fn listed(left_out: &[LeftOut]) -> String {
    const SHOWN: usize = 20;
    let lines = left_out.iter().map(|l| format!("  {}: {}", l.path.display(), l.message));
    let mut shown: Vec<String> = lines.take(SHOWN).collect();
    if left_out.len() > SHOWN {
        shown.push(format!("  and {} more", left_out.len() - SHOWN));
    }
    shown.join("\n")
}
