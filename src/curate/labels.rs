//! Names, tags and notes of cases; removing cases.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::path::Path;

use super::Selection;
use crate::curve::Case;
use crate::database::{self, CasePath, Database};
use crate::error::{Error, error};
use crate::file::{WriterLock, accepts_changed};

/// What is added to cases and taken from them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Labels {
    pub add_tags: Vec<String>,
    pub remove_tags: Vec<String>,
    pub clear_tags: bool,
    /// Notes that they get, after those that they have.
    pub add_notes: Vec<String>,
    pub remove_notes: Vec<String>,
    pub clear_notes: bool,
}

/// Longest tag and note, in characters.
const MAX_TAG: usize = 100;
const MAX_NOTE: usize = 10_000;

fn refused(what: &str, text: &str, why: &str) -> Error {
    let text: String = text.chars().take(MAX_TAG).collect();
    error!(Database, "\"{}\" is not a {what}: {why}", text.escape_debug())
}

impl Labels {
    fn check(&self) -> Result<(), Error> {
        for tag in &self.add_tags {
            let why = if tag.trim().is_empty() || tag.trim() != tag {
                "it is blank, or has blanks around it"
            } else if tag.contains(|c: char| c.is_control() || [',', ';'].contains(&c)) {
                "it may not contain \",\", \";\" or control characters"
            } else if tag.chars().count() > MAX_TAG {
                "it has more than 100 characters; put it in a note"
            } else {
                continue;
            };
            return Err(refused("tag", tag, why));
        }
        for note in &self.add_notes {
            let why = if note.trim().is_empty() {
                "it is blank"
            } else if note.contains(|c: char| c.is_control() && c != '\n') {
                "it may not contain control characters"
            } else if note.chars().count() > MAX_NOTE {
                "it has more than 10000 characters"
            } else {
                continue;
            };
            return Err(refused("note", note, why));
        }
        Ok(())
    }

    /// Whether every tag and note that is to be taken away is that of a case.
    fn check_removed(&self, path: &Path, cases: &[&Case]) -> Result<(), Error> {
        let tags = cases.iter().flat_map(|case| &case.provenance.tags).collect();
        let notes = cases.iter().flat_map(|case| &case.provenance.user_notes).collect();
        let all: [(_, _, BTreeSet<&String>); 2] =
            [("tag", &self.remove_tags, tags), ("note", &self.remove_notes, notes)];
        for (what, removed, there) in all {
            if let Some(text) = removed.iter().find(|text| !there.contains(text)) {
                let known: Vec<String> = there.iter().map(|text| format!("\"{text}\"")).collect();
                let known = if known.is_empty() { "none".into() } else { known.join(", ") };
                let (path, count, text) = (path.display(), cases.len(), text.escape_debug());
                return Err(error!(
                    Database,
                    "{path}: none of the {count} chosen cases has the {what} \"{text}\": they have {known}"
                ));
            }
        }
        Ok(())
    }

    fn apply(&self, case: &mut Case) {
        case.provenance.tags.retain(|tag| !self.clear_tags && !self.remove_tags.contains(tag));
        case.provenance
            .user_notes
            .retain(|note| !self.clear_notes && !self.remove_notes.contains(note));
        merge_labels(case, self.add_tags.clone(), self.add_notes.clone());
    }
}

/// Gives a case further tags and notes, each once.
pub(super) fn merge_labels(case: &mut Case, tags: Vec<String>, notes: Vec<String>) {
    let own = &mut case.provenance;
    own.tags.extend(tags);
    own.tags.sort();
    own.tags.dedup();
    for note in notes {
        if !own.user_notes.contains(&note) {
            own.user_notes.push(note);
        }
    }
}

/// From this size on one case is changed without the others. Smaller files are written anew, which leaves no gaps where texts
/// were.
const LARGE_BYTES: u64 = 32 << 20;

/// The case, if the selection names one and no more, and the file is large.
fn one_of_a_large_file(path: &Path, selection: &Selection) -> Result<Option<Case>, Error> {
    let Some((group, name)) = selection.only() else { return Ok(None) };
    // What is not a file is found, and said, where all cases are read.
    if accepts_changed() || !std::fs::metadata(path).is_ok_and(|meta| meta.len() >= LARGE_BYTES) {
        return Ok(None);
    }
    Database::read_case_alone(path, group, name)
}

/// Changes tags and notes of the chosen cases of the database at `path`; returns these as they are
/// now. Where nothing changes the file is not written.
pub(crate) fn label(
    path: &Path,
    selection: &Selection,
    labels: &Labels,
) -> Result<Vec<Case>, Error> {
    labels.check()?;
    let _lock = WriterLock::take(path)?;
    if let Some(mut case) = one_of_a_large_file(path, selection)? {
        labels.check_removed(path, &[&case])?;
        let before = case.provenance.clone();
        labels.apply(&mut case);
        if before == case.provenance || database::replace_labels(path, &case)? {
            return Ok(vec![case]);
        }
    }
    let mut database = Database::read(path)?;
    let chosen = selection.find(path, &database)?;
    labels.check_removed(path, &chosen)?;
    let chosen: HashSet<CasePath> = chosen.into_iter().map(CasePath::of).collect();
    let (mut changed, mut cases) = (false, Vec::new());
    database.change(|case| {
        if chosen.contains(&CasePath::of(case)) {
            let before = case.provenance.clone();
            labels.apply(case);
            changed |= before != case.provenance;
            cases.push(case.clone());
        }
    });
    if changed {
        database.write(path)?;
    }
    Ok(cases)
}

/// Removes the chosen cases from the database at `path`, unless it is a `dry_run`; returns them.
pub(crate) fn remove(
    path: &Path,
    selection: &Selection,
    dry_run: bool,
) -> Result<Vec<Case>, Error> {
    let _lock = WriterLock::take(path)?;
    let mut database = Database::read_as_it_is(path)?;
    let chosen: Vec<Case> = selection.find(path, &database)?.into_iter().cloned().collect();
    database.remove(&chosen.iter().map(CasePath::of).collect());
    if !dry_run {
        database.write(path)?;
    }
    Ok(chosen)
}

/// Gives the one chosen case another name in its group; returns both.
pub(crate) fn rename_case(
    path: &Path,
    group: Option<&str>,
    case: &str,
    name: &str,
) -> Result<(CasePath, CasePath), Error> {
    check("case", name)?;
    let _lock = WriterLock::take(path)?;
    let mut database = Database::read(path)?;
    let groups = group.map(String::from).into_iter().collect();
    let selection = Selection { groups, cases: vec![case.into()], ..Selection::default() };
    let from = CasePath::of(selection.find(path, &database)?[0]);
    let to = CasePath { group: from.group.clone(), name: name.into() };
    if from != to {
        database.relocate(&BTreeMap::from([(from.clone(), to.clone())]))?;
        database.write(path)?;
    }
    Ok((from, to))
}

/// Gives a group another name; returns its cases as they are called now.
pub(crate) fn rename_group(path: &Path, group: &str, name: &str) -> Result<Vec<CasePath>, Error> {
    check("group", name)?;
    let _lock = WriterLock::take(path)?;
    let mut database = Database::read(path)?;
    let cases: Vec<CasePath> = database.group(path, group)?.iter().map(CasePath::of).collect();
    if group == name {
        return Ok(cases);
    }
    if !database.cases(name).is_empty() {
        return Err(error!(
            Database,
            "{}: there is a group \"{name}\" already: choose another name, or join them with crumple db copy --to-group",
            path.display()
        ));
    }
    let moved = |case: &CasePath| CasePath { group: name.into(), name: case.name.clone() };
    let moves: BTreeMap<CasePath, CasePath> =
        cases.iter().map(|case| (case.clone(), moved(case))).collect();
    database.relocate(&moves)?;
    database.write(path)?;
    Ok(moves.into_values().collect())
}

pub(super) fn check(what: &'static str, name: &str) -> Result<(), Error> {
    database::check_name(name).map_err(|why| {
        let name = database::shown(name);
        error!(Database, "\"{}\" is not a valid name for a {what}: {why}", name.escape_debug())
    })
}
