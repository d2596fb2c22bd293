//! Building a database: every run of a study becomes a case; unchanged runs are kept.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::curve::Case;
use crate::database::{Database, DatabaseError};
use crate::file::{LockError, WriterLock};
use crate::study::{self, RunError, Study, StudyError};

/// Why nothing could be built.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// The manifest is wrong.
    #[error(transparent)]
    Study(#[from] StudyError),
    /// The database is not ours, or damaged.
    #[error(transparent)]
    Database(#[from] DatabaseError),
    /// Another process writes the database.
    #[error(transparent)]
    Lock(#[from] LockError),
    /// No run is usable.
    #[error("{path}: no run of the study can be used; the database is not changed:\n{reasons}")]
    NoRun {
        /// The manifest.
        path: PathBuf,
        /// A line for each run.
        reasons: String,
    },
}

/// Why a run could not be used, and what is wrong with its files, which may be the cause.
#[derive(Debug, thiserror::Error)]
#[error("{reason}{}", listed(.problems))]
pub struct RunFailure {
    /// Why the run is not usable.
    #[source]
    pub reason: RunError,
    /// As `crumple inspect` finds them.
    pub problems: Vec<String>,
}

/// Problems that a message repeats.
const LISTED: usize = 3;

fn listed(problems: &[String]) -> String {
    if problems.is_empty() {
        return String::new();
    }
    let shown = problems.iter().take(LISTED).cloned().collect::<Vec<_>>().join("; ");
    let more = match problems.len().saturating_sub(LISTED) {
        0 => String::new(),
        more => format!("; and {more} more, which crumple inspect lists"),
    };
    format!(" (damage in the run's files: {shown}{more})")
}

/// How one run ended.
#[derive(Debug)]
pub enum RunOutcome {
    /// Read and extracted.
    Built,
    /// Unchanged since it was built.
    Kept,
    /// Not usable, with the reason; an earlier build of it stays in the database.
    Failed {
        /// Why, with the damage of its files.
        reason: RunFailure,
        /// Whether the database has the run from an earlier build.
        earlier_kept: bool,
    },
}

/// What a build did.
#[derive(Debug)]
pub struct BuildReport {
    /// Group of the study.
    pub group: String,
    /// Name and end of every run, in the order of the manifest.
    pub runs: Vec<(String, RunOutcome)>,
    /// Cases that the study no longer has.
    pub removed: Vec<String>,
    /// The database as it is now.
    pub database: Database,
}

/// Builds the study at `manifest` into the database at `path`.
///
/// Runs whose recipe, entry and files are unchanged are not read again. A run that cannot
/// be used is reported, and the others go on; the file is written once, whole.
/// `progress` is called with the name of each run when it is done, from any thread.
///
/// # Errors
/// [`BuildError`] if the manifest is wrong, the database is not ours, busy or cannot be
/// written, or no run is usable. The database is then unchanged.
pub fn build(
    manifest: &Path,
    path: &Path,
    progress: impl Fn(&str) + Sync,
) -> Result<BuildReport, BuildError> {
    let study = study::load(manifest)?;
    let _lock = WriterLock::take(path)?;
    let mut database = match path.is_file() {
        true => Database::read(path)?,
        false => Database::default(),
    };
    let before: HashMap<&str, &Case> =
        database.cases(study.group()).iter().map(|case| (case.name.as_str(), case)).collect();
    let results: Vec<(String, Result<Option<Case>, RunFailure>)> = study
        .runs()
        .par_iter()
        .map(|entry| {
            let name = entry.case_name();
            // A case that somebody has changed since is made again.
            let is_altered = database.is_altered(study.group(), &name);
            let before = before.get(name.as_str()).filter(|_| !is_altered);
            let result = case(&study, entry, before.map(|case| case.fingerprint.as_str()));
            progress(&name);
            (name, result)
        })
        .collect();
    let before: HashSet<String> = before.into_keys().map(String::from).collect();
    if results.iter().all(|(_, r)| r.is_err()) {
        let reasons: Vec<String> = results
            .iter()
            .filter_map(|(name, r)| r.as_ref().err().map(|e| format!("  {name}: {e}")))
            .collect();
        return Err(BuildError::NoRun { path: manifest.into(), reasons: reasons.join("\n") });
    }
    let (mut runs, mut built) = (Vec::new(), Vec::new());
    for (name, result) in results {
        let outcome = match result {
            Ok(Some(case)) => {
                built.push(case);
                RunOutcome::Built
            }
            Ok(None) => RunOutcome::Kept,
            Err(reason) => {
                let earlier_kept = before.contains(&name);
                RunOutcome::Failed { reason, earlier_kept }
            }
        };
        runs.push((name, outcome));
    }
    database.put_all(built)?;
    let names: HashSet<&str> = runs.iter().map(|(name, _)| name.as_str()).collect();
    let removed = database.retain(study.group(), |case| {
        case.study != study.name() || names.contains(case.name.as_str())
    });
    let changed = !removed.is_empty() || runs.iter().any(|(_, o)| matches!(o, RunOutcome::Built));
    if changed || !path.is_file() {
        database.write(path)?;
    }
    Ok(BuildReport { group: study.group().into(), runs, removed, database })
}

/// The run's case, or `None` if its fingerprint is the one it had before.
fn case(
    study: &Study,
    entry: &study::RunEntry,
    before: Option<&str>,
) -> Result<Option<Case>, RunFailure> {
    let located =
        study.locate(entry).map_err(|reason| RunFailure { reason, problems: Vec::new() })?;
    if before == Some(&*located.fingerprint) {
        return Ok(None);
    }
    let failure = |reason| RunFailure { reason, problems: located.problems() };
    located.extract().map(Some).map_err(failure)
}
