//! Joining databases, and copying cases between them and between groups.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};

use super::names::check;
use super::{Effect, Selection, write};
use crate::curve::Case;
use crate::database::{self, CasePath, Database};
use crate::error::{Error, error};
use crate::file::{WriterLock, is_same};

fn is_there(database: &Path) -> Result<bool, Error> {
    database.try_exists().map_err(|source| Error::io(database, source))
}

/// What happens to a case whose name another curve has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum OnConflict {
    /// Nothing is joined.
    Refuse,
    /// The new case gets another name: `36kmh_2`.
    Rename,
    /// The new case takes the place of the other.
    Replace,
}

/// What joining did, or would do: cases by where they were, with their databases.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Joined {
    /// Cases that were added under their own names.
    pub added: Vec<(PathBuf, CasePath)>,
    /// Cases that exist already, under these names.
    pub equal: Vec<(PathBuf, CasePath, CasePath)>,
    /// Cases that were added under these names.
    pub renamed: Vec<(PathBuf, CasePath, CasePath)>,
    /// Cases that took the place of others.
    pub replaced: Vec<(PathBuf, CasePath)>,
    /// What other programs have put into the databases and is not taken along.
    pub not_taken: Vec<(PathBuf, String)>,
}

/// Where cases are copied to.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Target {
    /// Another database, which is created if it does not exist; the cases' own if absent.
    pub database: Option<PathBuf>,
    /// Their group there; their own if absent.
    pub group: Option<String>,
}

/// Joins the databases at `inputs`, in their order, into the file at `output`, which is one of them
/// and then comes first, or does not exist yet. Equal curves of a group are taken once, with the tags and notes of both.
pub(crate) fn merge(
    inputs: &[PathBuf],
    output: &Path,
    on_conflict: OnConflict,
    effect: Effect,
) -> Result<Joined, Error> {
    let _lock = WriterLock::take(output)?;
    let is_input = inputs.iter().any(|input| is_same(input, output));
    if !is_input && is_there(output)? {
        return Err(error!(
            Database,
            "{} exists already: name it among the databases to be joined, or write to another file",
            output.display()
        ));
    }
    let there = if is_input { Database::read(output)? } else { Database::default() };
    let mut join = Join::new(there, on_conflict);
    for (k, input) in inputs.iter().enumerate() {
        // Named twice it is one.
        let is_in = |earlier: &Path| is_same(earlier, input);
        if is_in(output) || inputs[..k].iter().any(|earlier| is_in(earlier)) {
            continue;
        }
        let foreign = database::foreign_items(input)?;
        join.joined.not_taken.extend(foreign.map(|items| (input.clone(), items)));
        let cases = Database::read(input)?.into_cases();
        join.take(input, cases.into_iter().map(|(case, hashes)| Incoming::of(case, hashes)))?;
    }
    write(&join.database, output, effect)?;
    Ok(join.joined)
}

/// Copies the chosen cases of the database at `path`. A copy in another group is no longer its
/// study's: building that leaves it as it is.
pub(crate) fn copy(
    path: &Path,
    selection: &Selection,
    target: &Target,
    on_conflict: OnConflict,
    effect: Effect,
) -> Result<Joined, Error> {
    if let Some(group) = &target.group {
        check("group", group)?;
    }
    let output = target.database.as_deref().unwrap_or(path);
    let _lock = WriterLock::take(output)?;
    let source = Database::read(path)?;
    let chosen = selection.find(path, &source)?;
    let chosen: HashSet<CasePath> = chosen.into_iter().map(CasePath::of).collect();
    let is_itself = target.database.is_none() || is_same(path, output);
    let there = match (is_itself, is_there(output)?) {
        (true, _) => source.clone(),
        (false, true) => Database::read(output)?,
        (false, false) => Database::default(),
    };
    let mut incoming = Vec::new();
    for (case, hashes) in source.into_cases() {
        if !chosen.contains(&CasePath::of(&case)) {
            continue;
        }
        let mut new = Incoming::of(case, hashes);
        if let Some(group) = target.group.as_ref().filter(|group| **group != new.case.id.group) {
            new.case.id.group.clone_from(group);
            new.case.provenance.origin = None;
        } else if is_itself {
            let case = new.from;
            return Err(error!(
                Database,
                "the copy of {case} would be {case} itself: choose another group (--to-group) or database (--to)"
            ));
        }
        incoming.push(new);
    }
    let mut join = Join::new(there, on_conflict);
    join.take(path, incoming)?;
    if let Some(items) = database::foreign_items(path)? {
        join.joined.not_taken.push((path.into(), items));
    }
    write(&join.database, output, effect)?;
    Ok(join.joined)
}

/// A case that is to be joined.
struct Incoming {
    case: Case,
    from: CasePath,
    /// The hashes that it was written with if somebody has changed it since.
    altered: Option<BTreeMap<String, String>>,
}

impl Incoming {
    fn of(case: Case, altered: Option<BTreeMap<String, String>>) -> Self {
        Self { from: CasePath::of(&case), case, altered }
    }
}

/// A database that others are joined to.
struct Join {
    database: Database,
    on_conflict: OnConflict,
    joined: Joined,
}

impl Join {
    fn new(database: Database, on_conflict: OnConflict) -> Self {
        Self { database, on_conflict, joined: Joined::default() }
    }

    /// Takes the cases of one database.
    fn take(
        &mut self,
        path: &Path,
        incoming: impl IntoIterator<Item = Incoming>,
    ) -> Result<(), Error> {
        // What came with the same database is not its double.
        let records: HashMap<(String, String), CasePath> = self
            .database
            .all()
            .map(|case| {
                Ok(((case.id.group.clone(), database::record_hash(case)?), CasePath::of(case)))
            })
            .collect::<Result<_, Error>>()?;
        let mut names: HashSet<CasePath> = self.database.all().map(CasePath::of).collect();
        let (mut conflicts, mut doubles, mut new) = (Vec::new(), HashMap::new(), Vec::new());
        for Incoming { mut case, from, altered } in incoming {
            if let Some(there) =
                records.get(&(case.id.group.clone(), database::record_hash(&case)?))
            {
                self.joined.equal.push((path.into(), from, there.clone()));
                doubles.insert(there.clone(), (case.provenance.tags, case.provenance.user_notes));
                continue;
            }
            self.check_kinds(path, &case)?;
            let own = CasePath::of(&case);
            match (names.contains(&own), self.on_conflict) {
                (false, _) => self.joined.added.push((path.into(), own)),
                (true, OnConflict::Refuse) => conflicts.push(own.to_string()),
                (true, OnConflict::Replace) => self.joined.replaced.push((path.into(), own)),
                (true, OnConflict::Rename) => {
                    database::remember_origin(&mut case);
                    case.id.name = free_name(&own, &names);
                    self.joined.renamed.push((path.into(), from, CasePath::of(&case)));
                }
            }
            names.insert(CasePath::of(&case));
            new.push((case, altered));
        }
        if !conflicts.is_empty() {
            let (path, names) = (path.display(), conflicts.join(", "));
            return Err(error!(
                Database,
                "{path}: other curves have these names already: {names}: rename the new ones with --rename, or replace the old ones with --replace"
            ));
        }
        self.database.change(|case| {
            if let Some((tags, notes)) = doubles.remove(&CasePath::of(case)) {
                merge_labels(case, tags, notes);
            }
        });
        self.database.replace_all(new);
        Ok(())
    }

    /// Whether a case is of the kinds of its group.
    fn check_kinds(&self, path: &Path, case: &Case) -> Result<(), Error> {
        let replaces = |other: &&Case| {
            other.id.name == case.id.name && self.on_conflict == OnConflict::Replace
        };
        let mut there = self.database.cases(&case.id.group).iter().filter(|c| !replaces(c));
        let Some(other) = there.next() else { return Ok(()) };
        let kinds = [
            ("speed", case.conditions.speed.kind.name(), other.conditions.speed.kind.name()),
            ("force", case.curves.force_kind.name(), other.curves.force_kind.name()),
        ];
        match kinds.into_iter().find(|(_, found, expected)| found != expected) {
            None => Ok(()),
            Some((what, found, expected)) => {
                let (path, case, there) = (path.display(), CasePath::of(case), CasePath::of(other));
                Err(error!(
                    Database,
                    "{path}: {case} has a {found} {what}, {there} a {expected} {what}: no model can be trained on both: use another group"
                ))
            }
        }
    }
}

/// A name that no case of the group has.
fn free_name(path: &CasePath, taken: &HashSet<CasePath>) -> String {
    let numbered =
        |k: usize| CasePath { group: path.group.clone(), name: format!("{}_{k}", path.name) };
    // One of as many as there are names, and one more, is free.
    let free = (2..taken.len() + 3).map(numbered).find(|name| !taken.contains(name));
    free.map_or_else(|| path.name.clone(), |free| free.name)
}

/// Gives a case the tags and notes of its double.
fn merge_labels(case: &mut Case, tags: Vec<String>, notes: Vec<String>) {
    case.provenance.tags.extend(tags);
    case.provenance.tags.sort();
    case.provenance.tags.dedup();
    for note in notes {
        if !case.provenance.user_notes.contains(&note) {
            case.provenance.user_notes.push(note);
        }
    }
}
