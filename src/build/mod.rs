//! Building a database: every run of a study becomes a case; unchanged runs are kept.

mod previous;

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use rayon::prelude::*;

use crate::clock;
use crate::curve::{Case, Origin};
use crate::database::{CasePath, Database};
use crate::error::{Error, ErrorCode, error};
use crate::file::{WriterLock, is_file};
use crate::study::{self, LocatedRun, Study};
use previous::Previous;

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
        reason: Error,
        /// Whether the database has the run from an earlier build.
        earlier_kept: bool,
    },
}

/// One run of a study after a build.
#[derive(Debug)]
pub struct BuiltRun {
    /// Name of the run in the manifest.
    pub name: String,
    /// Where its case is, if the database has one.
    pub(crate) case: CasePath,
    /// How it ended.
    pub outcome: RunOutcome,
}

/// What a build did.
#[derive(Debug)]
pub struct BuildReport {
    /// Group of the study.
    pub group: String,
    /// Every run, in the order of the manifest.
    pub runs: Vec<BuiltRun>,
    /// Cases that the study no longer has.
    pub(crate) removed: Vec<CasePath>,
    /// Cases of runs that have another name or group than before: from where to where.
    pub(crate) moved: Vec<(CasePath, CasePath)>,
    /// Groups that were built from the manifest when it had another study or group and other runs
    /// or recipe, and that stay; looked for when the database has nothing of the study yet.
    pub earlier: Vec<String>,
    /// The database as it is now.
    pub database: Database,
}

impl BuildReport {
    pub(crate) fn case(&self, run: &BuiltRun) -> Option<&Case> {
        self.database.cases(&run.case.group).iter().find(|case| case.id.name == run.case.name)
    }
}

/// Builds the study at `manifest` into the database at `path`.
///
/// Runs whose recipe, entry and files are unchanged are not read again. A run that cannot
/// be used is reported, and the others continue; the file is written once, whole, and not at all if
/// nothing has changed. A study, group or run that was renamed takes its cases along, with their
/// tags and notes. `progress` is called with the name of each run when it is done, from any thread.
///
/// # Errors
/// If the manifest is wrong, the database is not ours, busy or cannot be
/// written, or no run is usable. The database is then unchanged.
pub fn build(
    manifest: &Path,
    path: &Path,
    progress: impl Fn(&str) + Sync,
) -> Result<BuildReport, Error> {
    let study = study::load(manifest)?;
    let _lock = WriterLock::take(path)?;
    let is_there = is_file(path)?;
    let mut database = if is_there { Database::read_as_it_is(path)? } else { Database::default() };
    let located: Vec<Result<LocatedRun<'_>, Error>> =
        study.runs().par_iter().map(|entry| study.locate(entry)).collect();
    let hash = |run: &Result<LocatedRun<'_>, _>| run.as_ref().ok()?.source_hash();
    let runs = study.runs().iter().map(|entry| entry.case_name());
    let runs = runs.zip(located.iter().map(hash)).collect();
    let previous = Previous::find(&study, &runs, &database);
    // A case that somebody has changed since is made again.
    let unaltered = database.all().filter(|c| !database.is_altered(&c.id.group, &c.id.name));
    let fingerprints: HashMap<CasePath, &str> =
        unaltered.map(|case| (CasePath::of(case), &*case.provenance.fingerprint)).collect();
    let results: Vec<(String, Result<Option<Case>, Error>)> = study
        .runs()
        .par_iter()
        .zip(located)
        .map(|(entry, located)| {
            let name = entry.case_name();
            let before = previous.of_run.get(&name);
            let before = before.and_then(|(path, _)| fingerprints.get(path).copied());
            let result = case(&study, located, before);
            progress(&name);
            (name, result)
        })
        .collect();
    if results.iter().all(|(_, r)| r.is_err()) {
        let reasons: Vec<String> = results
            .iter()
            .filter_map(|(name, r)| r.as_ref().err().map(|e| format!("  {name}: {e}")))
            .collect();
        let place = results.iter().find_map(|(_, r)| r.as_ref().err()?.place().cloned());
        let (path, reasons) = (manifest.display(), reasons.join("\n"));
        return Err(error!(
            Study,
            "{path}: no run of the study can be used; the database is not changed:\n{reasons}"
        )
        .showing(place));
    }
    let moved = move_along(&mut database, &study, &previous)?;
    let runs = put(&mut database, &study, &previous, results)?;
    let changed = !previous.left.is_empty()
        || !moved.is_empty()
        || runs.iter().any(|run| matches!(run.outcome, RunOutcome::Built));
    if changed || !is_there {
        database.write(path)?;
    }
    Ok(BuildReport {
        group: study.group().into(),
        runs,
        removed: previous.left,
        moved,
        earlier: previous.earlier.into_iter().collect(),
        database,
    })
}

/// The run's case, or `None` if its fingerprint is the one it had before.
fn case(
    study: &Study,
    located: Result<LocatedRun<'_>, Error>,
    before: Option<&str>,
) -> Result<Option<Case>, Error> {
    let failure = |reason: Error, problems: Vec<String>| {
        study.placed(reason.coded(ErrorCode::Run).followed_by(&listed(&problems)))
    };
    let located = located.map_err(|reason| failure(reason, Vec::new()))?;
    if before == Some(&*located.fingerprint) {
        return Ok(None);
    }
    located.extract().map(Some).map_err(|reason| failure(reason, located.problems()))
}

/// Puts the cases of renamed runs, groups and studies where they belong, and removes those that the
/// study no longer has.
fn move_along(
    database: &mut Database,
    study: &Study,
    previous: &Previous,
) -> Result<Vec<(CasePath, CasePath)>, Error> {
    database.remove(&previous.left.iter().cloned().collect());
    let places = previous.of_run.values().filter(|(from, to)| from != to).cloned();
    let moves: BTreeMap<CasePath, CasePath> = places.collect();
    database.relocate(&moves)?;
    let runs: HashMap<&CasePath, &String> =
        previous.of_run.iter().map(|(run, (_, to))| (to, run)).collect();
    let (manifest, group) = (study.path(), study.group());
    database.change(|case| {
        if let Some(&run) = runs.get(&CasePath::of(case)) {
            case.id.study = study.name().into();
            let (manifest, group, run) = (manifest.clone(), group.into(), run.clone());
            case.provenance.origin = Some(Origin { manifest, group, run });
        }
    });
    Ok(moves.into_iter().collect())
}

fn put(
    database: &mut Database,
    study: &Study,
    previous: &Previous,
    results: Vec<(String, Result<Option<Case>, Error>)>,
) -> Result<Vec<BuiltRun>, Error> {
    let now = clock::now_utc();
    // Tags and notes of users.
    let said = database
        .all()
        .map(|c| (CasePath::of(c), (c.provenance.tags.clone(), c.provenance.user_notes.clone())));
    let said: HashMap<CasePath, (Vec<String>, Vec<String>)> = said.collect();
    let (mut runs, mut built) = (Vec::new(), Vec::new());
    for (name, result) in results {
        let before = previous.of_run.get(&name).map(|(_, path)| path);
        let own = || CasePath { group: study.group().into(), name: name.clone() };
        let path = before.cloned().unwrap_or_else(own);
        let outcome = match result {
            Ok(Some(mut case)) => {
                (case.provenance.tags, case.provenance.user_notes) =
                    before.and_then(|path| said.get(path)).cloned().unwrap_or_default();
                (case.id.group, case.id.name) = (path.group.clone(), path.name.clone());
                case.provenance.built_utc = Some(now.clone());
                built.push(case);
                RunOutcome::Built
            }
            Ok(None) => RunOutcome::Kept,
            Err(reason) => RunOutcome::Failed { reason, earlier_kept: before.is_some() },
        };
        runs.push(BuiltRun { name, case: path, outcome });
    }
    database.put_all(built)?;
    Ok(runs)
}
