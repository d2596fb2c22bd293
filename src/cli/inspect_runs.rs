//! `crumple inspect` of folders: the files of every run below them.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::solver::decks::{self, Search};
use crate::solver::runs::{output_files, run_folders};

use super::Failure;
use super::output;

/// What is to be inspected: a file that was named, or the files of a run that was found.
pub(super) enum Asked {
    File(PathBuf),
    Run { folder: PathBuf, files: Vec<PathBuf> },
}

/// The files that were named, and those of every run at or below the folders that were.
pub(super) fn asked(paths: &[PathBuf]) -> Result<Vec<Asked>, Failure> {
    let mut asked = Vec::new();
    for path in paths {
        if !path.is_dir() {
            asked.push(Asked::File(path.clone()));
            continue;
        }
        let failed = |e| Failure::Failed(format!("{}: {e}", path.display()).into());
        let found = run_folders(path).map_err(failed)?;
        if found.runs.is_empty() {
            let message = format!("{}: no folder in it holds solver files", path.display());
            return Err(Failure::Failed(message.into()));
        }
        for folder in found.runs {
            let mut files = output_files(&folder).map_err(failed)?;
            files.extend(match decks::find(&folder) {
                Search::None => Vec::new(),
                Search::One(deck) => vec![deck],
                Search::Several(decks) => decks,
            });
            asked.push(Asked::Run { folder, files });
        }
    }
    Ok(asked)
}

/// Columns of a run's table.
pub(super) const HEADING: [&str; 7] =
    ["file", "holds", "states", "first time", "last", "entities", "problems"];

/// A run's files, a line for each section.
pub(super) fn print(out: &mut dyn Write, folder: &Path, rows: &[Vec<String>]) -> io::Result<()> {
    writeln!(out, "{}", folder.display())?;
    output::table(out, &HEADING, rows)
}
