//! Building a database: every run of a study becomes a case; unchanged runs are kept.
//!
//! # Which cases of a database belong to a study
//!
//! A case records its study by name, and by [`Origin`] the manifest, group and
//! run that it was built from, by their names at that time.
//!
//! 1. The cases of a study are those of its name and group.
//! 2. If there are none, study or group may have been renamed: then the study's cases are those of
//!    a study and group that were built from the same manifest, or from one that no longer exists, and of
//!    which at least one has the same bytes and recipe as a run of this study.
//! 3. The case of a run is the one with its name; for a run without one, a case made of the same data whose
//!    name no run has any more.
//! 4. A case moves to the place given by the manifest if the manifest has changed since the
//!    case was built. Otherwise it stays: it may have been renamed in the database.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::path::Path;

use crate::clock;
use crate::curve::from_table::IMPORTED;
use crate::curve::{Case, Origin};
use crate::database::{CasePath, Database};
use crate::error::{Error, ErrorCode, error};
use crate::file::{self, WriterLock, is_file};
use crate::guess;
use crate::parallel;
use crate::study::{self, LocatedRun, Study};

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
pub(crate) enum RunOutcome {
    Built,
    /// Unchanged since it was built.
    Kept,
    /// Not usable, with the reason; an earlier build of it stays in the database.
    Failed {
        reason: Error,
        earlier_kept: bool,
    },
}

/// One run of a study after a build.
#[derive(Debug)]
pub(crate) struct BuiltRun {
    pub name: String,
    /// Where its case is, if the database has one.
    pub case: CasePath,
    pub outcome: RunOutcome,
}

/// What a build did.
#[derive(Debug)]
pub struct BuildReport {
    /// Group of the study.
    pub group: String,
    /// Every run, in the order of the manifest.
    pub(crate) runs: Vec<BuiltRun>,
    /// Cases that the study no longer has.
    pub(crate) removed: Vec<CasePath>,
    /// The manifest that some of these were built from, if it is another one that is still there.
    pub(crate) removed_of: Option<String>,
    /// Runs whose case was built from another manifest that is still there, and that one.
    pub(crate) replaced: BTreeMap<String, String>,
    /// Cases of runs that have another name or group than before: from where to where.
    pub(crate) moved: Vec<(CasePath, CasePath)>,
    /// Groups that were built from the manifest when it had another study or group and other runs
    /// or recipe, and that stay; looked for when the database has nothing of the study yet.
    pub earlier: Vec<String>,
    /// Whether the file was written: not if nothing has changed.
    pub(crate) is_written: bool,
    /// The database as it is now.
    pub database: Database,
    /// Where it has the cases.
    places: HashMap<CasePath, usize>,
}

impl BuildReport {
    /// Where the database has the runs' cases: a group that was renamed there keeps its name.
    pub(crate) fn groups(&self) -> BTreeSet<&str> {
        let known = self.runs.iter().filter(|run| self.case(run).is_some());
        known.map(|run| &*run.case.group).collect()
    }

    pub(crate) fn case(&self, run: &BuiltRun) -> Option<&Case> {
        self.database.cases(&run.case.group).get(*self.places.get(&run.case)?)
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
    build_runs(manifest, path, &[], progress)
}

/// The same of these runs only, or of all if there are none; the others stay as the database has them.
pub(crate) fn build_runs(
    manifest: &Path,
    path: &Path,
    only: &[String],
    progress: impl Fn(&str) + Sync,
) -> Result<BuildReport, Error> {
    let study = study::load(manifest)?;
    let known: Vec<String> = study.runs().iter().map(|entry| entry.case_name()).collect();
    if let Some(unknown) = only.iter().find(|name| !known.contains(name)) {
        let (path, known) = (manifest.display(), known.join(", "));
        let hint = guess::hint(unknown, &known);
        return Err(error!(Study, "{path}: there is no run \"{unknown}\": it has {known}{hint}"));
    }
    let _lock = WriterLock::take(path)?;
    let is_there = is_file(path)?;
    let mut database = if is_there { Database::read_as_it_is(path)? } else { Database::default() };
    let located = parallel::map(study.runs(), |entry| study.locate(entry));
    let hash = |run: &Result<LocatedRun<'_>, _>| run.as_ref().ok()?.source_hash();
    let runs = study.runs().iter().map(|entry| entry.case_name());
    let runs = runs.zip(located.iter().map(hash)).collect();
    let previous = Previous::find(&study, &runs, &database);
    // A case that somebody has changed since is made again.
    let unaltered = database.all().filter(|c| !database.is_altered(&c.id.group, &c.id.name));
    let fingerprints: HashMap<CasePath, &str> =
        unaltered.map(|case| (CasePath::of(case), &*case.provenance.fingerprint)).collect();
    let wanted = study.runs().iter().zip(located);
    let wanted = wanted.filter(|(entry, _)| only.is_empty() || only.contains(&entry.case_name()));
    let results = parallel::map(wanted, |(entry, located)| {
        let name = entry.case_name();
        let before = previous.of_run.get(&name);
        let before = before.and_then(|(path, _)| fingerprints.get(path).copied());
        let result = case(&study, located, before);
        progress(&name);
        (name, result)
    });
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
    let mut replaced = previous.of_others;
    replaced.retain(|name, _| {
        runs.iter().any(|run| run.name == *name && matches!(run.outcome, RunOutcome::Built))
    });
    let changed = !previous.left.is_empty()
        || !moved.is_empty()
        || runs.iter().any(|run| matches!(run.outcome, RunOutcome::Built));
    let is_written = changed || !is_there;
    if is_written {
        database.write(path)?;
    }
    let all = database.groups().flat_map(|group| database.cases(group).iter().enumerate());
    Ok(BuildReport {
        places: all.map(|(i, case)| (CasePath::of(case), i)).collect(),
        group: study.group().into(),
        runs,
        removed: previous.left,
        removed_of: previous.left_of,
        replaced,
        moved,
        earlier: previous.earlier.into_iter().collect(),
        is_written,
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

/// The cases of a study as a database has them.
#[derive(Default)]
struct Previous {
    /// The case of each run that has one, by the run's name: where it is, and where it belongs.
    pub of_run: HashMap<String, (CasePath, CasePath)>,
    /// Cases whose run the study no longer has.
    pub left: Vec<CasePath>,
    /// Another manifest that is still there and that some of these were built from.
    pub left_of: Option<String>,
    /// The same of the runs' cases, by the runs' names.
    pub of_others: BTreeMap<String, String>,
    /// If the database has no case of the study: groups with cases that were built from the manifest
    /// when it belonged to another study or group; no run of this one has them.
    pub earlier: BTreeSet<String>,
}

/// Names of a study's runs, each with the hash of what its case is made of if its files were found.
type RunHashes = Vec<(String, Option<String>)>;

impl Previous {
    fn find(study: &Study, runs: &RunHashes, database: &Database) -> Self {
        let built: Vec<&Case> = database.all().filter(|case| case.id.study != IMPORTED).collect();
        let is_own =
            |case: &&&Case| case.id.study == study.name() && group_of(case) == study.group();
        let mut cases: Vec<&Case> = built.iter().filter(is_own).copied().collect();
        if cases.is_empty() {
            cases = renamed(study, runs, &built);
        }
        let names: HashSet<&str> = runs.iter().map(|(name, _)| name.as_str()).collect();
        let mut previous = Self::default();
        let mut without: Vec<&Case> = Vec::new();
        for case in cases {
            if names.contains(run_of(case)) {
                let (run, place) = (run_of(case), place(study, case, run_of(case)));
                // Of several, as after a merge, the one of the run's own name.
                if case.id.name == run || !previous.of_run.contains_key(run) {
                    previous.of_run.insert(run.into(), (CasePath::of(case), place));
                }
            } else {
                without.push(case);
            }
        }
        // Made of each, for runs that have no case of their name.
        let mut source_hash: HashMap<Option<String>, Vec<&Case>> = HashMap::new();
        for case in without {
            source_hash.entry(case.source_hash()).or_default().push(case);
        }
        for (name, made) in runs {
            if previous.of_run.contains_key(name) || made.is_none() {
                continue;
            }
            if let Some(case) = source_hash.get_mut(made).and_then(Vec::pop) {
                let place = (CasePath::of(case), place(study, case, name));
                previous.of_run.insert(name.clone(), place);
            }
        }
        if previous.of_run.is_empty() {
            let manifest = study.path();
            let is_ours = |case: &&&Case| {
                let origin = case.provenance.origin.as_ref();
                origin.is_some_and(|origin| origin.manifest == manifest)
                    && case.id.group != study.group()
            };
            previous.earlier = built.iter().filter(is_ours).map(|c| c.id.group.clone()).collect();
        }
        let left: Vec<&Case> = source_hash.into_values().flatten().collect();
        let now = study.path();
        let is_other = |then: &&String| {
            let path = Path::new(then);
            **then != now && path.exists() && !file::is_same(path, Path::new(&now))
        };
        previous.left_of =
            left.iter().filter_map(|case| manifest_of(case)).filter(is_other).min().cloned();
        let places: HashMap<CasePath, &Case> =
            built.iter().map(|case| (CasePath::of(case), *case)).collect();
        for (run, (path, _)) in &previous.of_run {
            let then = places.get(path).and_then(|case| manifest_of(case)).filter(is_other);
            previous.of_others.extend(then.map(|then| (run.clone(), then.clone())));
        }
        previous.left = left.into_iter().map(CasePath::of).collect();
        previous.left.sort();
        previous
    }
}

/// The cases that this study had under another name or in another group.
fn renamed<'a>(study: &Study, runs: &RunHashes, built: &[&'a Case]) -> Vec<&'a Case> {
    let ours: HashSet<&String> = runs.iter().filter_map(|(_, hash)| hash.as_ref()).collect();
    // Of one study and group, so that two under one path are both kept.
    let mut found: BTreeMap<(&str, &str, &str), Vec<&Case>> = BTreeMap::new();
    for &case in built {
        if let Some(origin) = &case.provenance.origin {
            let key = (&*case.id.study, &*origin.group, &*origin.manifest);
            found.entry(key).or_default().push(case);
        }
    }
    let manifest = study.path();
    found.retain(|(_, _, then), _| {
        let (then, now) = (Path::new(then), Path::new(&manifest));
        then == now || then.try_exists().is_ok_and(|is| !is) || file::is_same(then, now)
    });
    let same = |cases: &[&Case]| {
        let hashes = cases.iter().filter_map(|case| case.source_hash());
        hashes.filter(|hash| ours.contains(hash)).count()
    };
    let counted = found.into_values().map(|cases| (same(&cases), cases));
    let most = counted.filter(|(same, _)| *same > 0).max_by_key(|(same, _)| *same);
    most.map(|(_, cases)| cases).unwrap_or_default()
}

/// Where a case belongs that is of the run of this name.
fn place(study: &Study, case: &Case, run: &str) -> CasePath {
    let now = |then: &str, wanted: &str, is: &String| {
        if then == wanted { is.clone() } else { wanted.into() }
    };
    CasePath {
        group: now(group_of(case), study.group(), &case.id.group),
        name: now(run_of(case), run, &case.id.name),
    }
}

/// The group that the manifest had for a case.
fn group_of(case: &Case) -> &str {
    case.provenance.origin.as_ref().map_or(&case.id.group, |origin| &origin.group)
}

fn manifest_of(case: &Case) -> Option<&String> {
    case.provenance.origin.as_ref().map(|origin| &origin.manifest)
}

/// The run that a case was built from.
fn run_of(case: &Case) -> &str {
    case.provenance.origin.as_ref().map_or(&case.id.name, |origin| &origin.run)
}
