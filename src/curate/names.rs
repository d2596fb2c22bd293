//! Removing cases, and giving cases and groups other names.

use crate::error::{Error, error};
use std::collections::BTreeMap;
use std::path::Path;

use super::Selection;
use crate::curve::Case;
use crate::database::{CasePath, Database, names};
use crate::file::WriterLock;

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
    names::check(name).map_err(|why| {
        let name = names::shown(name);
        error!(Database, "\"{}\" is not a valid name for a {what}: {why}", name.escape_debug())
    })
}
