//! Why nothing can be proposed.

use std::io;
use std::path::PathBuf;

use super::LeftOut;
use crate::error::Error;
use crate::surrogate::ModelError;

/// Why nothing can be proposed.
#[derive(Debug, thiserror::Error)]
pub enum InitError {
    /// A folder cannot be looked into.
    #[error("{path}: {source}{}", guess.as_ref().map_or(String::new(), |guess| format!("; did you mean {}?", guess.display())))]
    Folder {
        /// The folder.
        path: PathBuf,
        /// Why not.
        source: io::Error,
        /// A folder that is there and has a name like it.
        guess: Option<PathBuf>,
    },
    /// There is no run.
    #[error(
        "no folder in {searched} holds solver files (nodout, rwforc, rcforc, binout, …T01): give the runs' folders, or one above them{}",
        if left_out.is_empty() { String::new() } else { format!("\n{}", listed(left_out)) }
    )]
    NoRuns {
        /// Where was looked, as a list.
        searched: String,
        /// The folders there, each with why it is no run.
        left_out: Vec<LeftOut>,
    },
    /// No run is usable.
    #[error("no run can be used:\n{}{}", listed(.left_out), doubts.iter().map(|d| format!("\n{d}")).collect::<String>())]
    NoUsableRun {
        /// The folders, each with its reason.
        left_out: Vec<LeftOut>,
        /// What may be the cause.
        doubts: Vec<String>,
    },
    /// The runs stand in several folders of several runs.
    #[error(
        "the runs stand in {} folders of several runs, which look like different groups: {listed}. Give one of them (crumple init {}), or say with --group NAME that all are one group",
        folders.len(),
        folders.first().map_or(String::new(), |(path, _)| path.display().to_string()),
        listed = folders.iter().map(|(path, runs)| format!("{} ({runs} runs)", path.display())).collect::<Vec<_>>().join(", ")
    )]
    SeveralGroups {
        /// The folders and how many runs each has.
        folders: Vec<(PathBuf, usize)>,
    },
    /// The force that the caller names acts in no run.
    #[error("no run has a force {file} {id} along the motion: there are {known}")]
    NoSuchForce {
        /// Its file.
        file: String,
        /// Its number.
        id: i64,
        /// The forces there are, as a list.
        known: String,
    },
    /// A half model has one body.
    #[error("two bodies move in these runs, and a half model has one: leave out --half-model")]
    HalfModelOfTwo,
    /// A pair has two bodies.
    #[error(
        "only one body moves in these runs: if it stands for a pair, cut at its symmetry plane, say --half-model; if it meets a wall, leave out --kind pair and --minus-node"
    )]
    PairOfOne,
    /// What was asked for stands there already.
    #[error(
        "{path} is there already, and nothing is written over it: name another with -o, or remove it"
    )]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// A scenario takes one model or two.
    #[error(
        "a scenario takes one model or two, found {found}: the curve between the noses, or nose and wall, then that between the vehicles of a train"
    )]
    Models {
        /// How many were given.
        found: usize,
    },
    /// A model of wall speeds cannot stand between vehicles.
    #[error(
        "{path}: its speeds are wall speeds, and between the vehicles of a train stands a curve of closing speeds: name such a model second"
    )]
    WallInside {
        /// The model.
        path: PathBuf,
    },
    /// A model cannot be used.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The proposal itself is no study or scenario.
    #[error(transparent)]
    Below(#[from] Error),
}

fn listed(left_out: &[LeftOut]) -> String {
    const SHOWN: usize = 20;
    let lines = left_out.iter().map(|l| format!("  {}: {}", l.path.display(), l.message));
    let mut shown: Vec<String> = lines.take(SHOWN).collect();
    if left_out.len() > SHOWN {
        shown.push(format!("  and {} more", left_out.len() - SHOWN));
    }
    shown.join("\n")
}
