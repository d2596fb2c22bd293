//! Which cases of a database belong to a study, and where they belong now.
//!
//! A case records its study by name, and by [`Origin`](crate::curve::Origin) the manifest, group and
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

use crate::curve::Case;
use crate::curve::from_table::IMPORTED;
use crate::database::{CasePath, Database};
use crate::file;
use crate::study::Study;

/// The cases of a study as a database has them.
#[derive(Default)]
pub(super) struct Previous {
    /// The case of each run that has one, by the run's name: where it is, and where it belongs.
    pub of_run: HashMap<String, (CasePath, CasePath)>,
    /// Cases whose run the study no longer has.
    pub left: Vec<CasePath>,
    /// If the database has no case of the study: groups with cases that were built from the manifest
    /// when it was of another study or group, and are no run's.
    pub earlier: BTreeSet<String>,
}

/// Names of a study's runs, each with the hash of what its case is made of if its files were found.
pub(super) type RunHashes = Vec<(String, Option<String>)>;

impl Previous {
    pub(super) fn find(study: &Study, runs: &RunHashes, database: &Database) -> Self {
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
        previous.left = source_hash.into_values().flatten().map(CasePath::of).collect();
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

/// The run that a case was built from.
fn run_of(case: &Case) -> &str {
    case.provenance.origin.as_ref().map_or(&case.id.name, |origin| &origin.run)
}
