//! Joining databases, and copying cases between them and between groups.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::Selection;
use super::labels::{check, merge_labels};
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

/// A case with its database, and what it is called now if that is another name.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct JoinedCase {
    pub from: String,
    pub case: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub now: Option<String>,
}

/// What joining did, or would do.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Joined {
    /// Under their own names.
    pub added: Vec<JoinedCase>,
    /// Cases that exist already.
    pub equal: Vec<JoinedCase>,
    pub renamed: Vec<JoinedCase>,
    /// Cases that took the place of others.
    pub replaced: Vec<JoinedCase>,
    /// What other programs have put into the databases and is not taken along.
    #[serde(skip)]
    pub not_taken: Vec<(PathBuf, String)>,
    /// Databases that other programs have edited: links in them are not taken along, either.
    #[serde(skip)]
    pub edited: Vec<PathBuf>,
}

impl Joined {
    fn leave_foreign(&mut self, input: &Path) -> Result<(), Error> {
        let (items, is_edited) = database::foreign_items(input)?;
        self.not_taken.extend(items.map(|items| (input.into(), items)));
        self.edited.extend(is_edited.then(|| input.into()));
        Ok(())
    }
}

/// Joins the databases at `inputs`, in their order, into the file at `output`, which is one of them
/// and then comes first, or does not exist yet. Equal curves of a group are taken once, with the tags and notes of both.
pub(crate) fn merge(
    inputs: &[PathBuf],
    output: &Path,
    on_conflict: OnConflict,
    dry_run: bool,
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
        join.joined.leave_foreign(input)?;
        let cases = Database::read(input)?.into_cases();
        let incoming = cases.into_iter().map(|(case, altered)| {
            let from = CasePath::of(&case);
            (case, from, altered)
        });
        join.take(input, incoming)?;
    }
    join.written(output, dry_run)
}

/// Copies the chosen cases of the database at `path` into another, which is created if it does not exist, or
/// into another group, or both. A copy in another group is no longer its study's: building that leaves
/// it as it is.
pub(crate) fn copy(
    path: &Path,
    selection: &Selection,
    (to, to_group): (Option<&Path>, Option<&str>),
    on_conflict: OnConflict,
    dry_run: bool,
) -> Result<Joined, Error> {
    if let Some(group) = to_group {
        check("group", group)?;
    }
    let output = to.unwrap_or(path);
    let _lock = WriterLock::take(output)?;
    let source = Database::read(path)?;
    let chosen = selection.find(path, &source)?;
    let chosen: HashSet<CasePath> = chosen.into_iter().map(CasePath::of).collect();
    let is_itself = to.is_none_or(|output| is_same(path, output));
    let there = match (is_itself, is_there(output)?) {
        (true, _) => source.clone(),
        (false, true) => Database::read(output)?,
        (false, false) => Database::default(),
    };
    let mut incoming = Vec::new();
    for (mut case, altered) in source.into_cases() {
        let from = CasePath::of(&case);
        if !chosen.contains(&from) {
            continue;
        }
        if let Some(group) = to_group.filter(|group| *group != case.id.group) {
            case.id.group = group.into();
            case.provenance.origin = None;
        } else if is_itself {
            return Err(error!(
                Database,
                "the copy of {from} would be {from} itself: choose another group (--to-group) or database (--to)"
            ));
        }
        incoming.push((case, from, altered));
    }
    let mut join = Join::new(there, on_conflict);
    join.take(path, incoming)?;
    join.joined.leave_foreign(path)?;
    join.written(output, dry_run)
}

/// A case that is to be joined, where it was, and the hashes that it was written with if somebody has
/// changed it since.
type Incoming = (Case, CasePath, Option<BTreeMap<String, String>>);

struct Join {
    database: Database,
    on_conflict: OnConflict,
    joined: Joined,
}

impl Join {
    fn new(database: Database, on_conflict: OnConflict) -> Self {
        Self { database, on_conflict, joined: Joined::default() }
    }

    fn take(
        &mut self,
        path: &Path,
        incoming: impl IntoIterator<Item = Incoming>,
    ) -> Result<(), Error> {
        let joined = |case: &CasePath, now: Option<&CasePath>| JoinedCase {
            from: path.display().to_string(),
            case: case.to_string(),
            now: now.map(ToString::to_string),
        };
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
        for (mut case, from, altered) in incoming {
            if let Some(there) =
                records.get(&(case.id.group.clone(), database::record_hash(&case)?))
            {
                self.joined.equal.push(joined(&from, Some(there)));
                doubles.insert(there.clone(), (case.provenance.tags, case.provenance.user_notes));
                continue;
            }
            self.check_kinds(path, &case)?;
            let own = CasePath::of(&case);
            match (names.contains(&own), self.on_conflict) {
                (false, _) => self.joined.added.push(joined(&own, None)),
                (true, OnConflict::Refuse) => conflicts.push(own.to_string()),
                (true, OnConflict::Replace) => self.joined.replaced.push(joined(&own, None)),
                (true, OnConflict::Rename) => {
                    database::remember_origin(&mut case);
                    case.id.name = free_name(&own, &names);
                    self.joined.renamed.push(joined(&from, Some(&CasePath::of(&case))));
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

    fn check_kinds(&self, path: &Path, case: &Case) -> Result<(), Error> {
        let replaces = |other: &&Case| {
            other.id.name == case.id.name && self.on_conflict == OnConflict::Replace
        };
        let mut there = self.database.cases(&case.id.group).iter().filter(|c| !replaces(c));
        let Some(other) = there.next() else { return Ok(()) };
        let Some((what, found, expected)) = case.other_kind(other) else { return Ok(()) };
        let (path, case, there) = (path.display(), CasePath::of(case), CasePath::of(other));
        Err(error!(
            Database,
            "{path}: {case} has a {found} {what}, {there} a {expected} {what}: no model can be trained on both: use another group"
        ))
    }

    fn written(self, output: &Path, dry_run: bool) -> Result<Joined, Error> {
        if !dry_run {
            self.database.write(output)?;
        }
        Ok(self.joined)
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
