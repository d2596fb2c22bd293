//! What others have put into a database file: found, and kept when the database is written again.
//!
//! Where others have put something into a database, a copy of the file is edited and, after it was read back and nothing of theirs
//! is missing, renamed into place. So their links, types and attributes stay as they were encoded.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::fs;
use std::path::Path;

use super::layout::{self, CASE_ATTRIBUTES, CASES, Content, FoundGroup, ORIGINAL, Opened, ROOT};
use super::{Database, DatabaseError};
use crate::curve::Case;
use crate::file::write_by_path;
use crate::hdf5::{self, Dataset, File, FileAccessProperties, FileLocking, Group};

/// Attributes, datasets, groups and types of a file that are not the layout's, as a message
/// names them.
pub(crate) fn found(opened: &Opened<'_>) -> Result<BTreeSet<String>, DatabaseError> {
    let damaged = |e: hdf5::Error| DatabaseError::Damaged {
        path: opened.path.into(),
        place: "/".into(),
        detail: e.to_string(),
    };
    let ours = opened.groups()?;
    let mut foreign = Foreign(BTreeSet::new());
    let mut walk = || -> Result<(), hdf5::Error> {
        let root = opened.file.root();
        let names = ours.iter().map(|group| group.name.as_str()).collect();
        foreign.members("", &root, |name| ROOT.contains(&name), &names, &[])?;
        for FoundGroup { name, cases, .. } in &ours {
            let names = cases.iter().map(|(name, _)| name.as_str()).collect();
            foreign.members(name, &root.group(name)?, |name| name == CASES, &names, &[])?;
            for (case, group) in cases {
                foreign.of_case(&format!("{name}/{case}"), group)?;
            }
        }
        Ok(())
    };
    walk().map_err(damaged)?;
    Ok(foreign.0)
}

/// Datasets of a curve; a case has one more.
const CURVE: [&str; 3] = ["time_s", "deflection_m", "force_N"];
const OF_A_CASE: [&str; 4] = ["time_s", "deflection_m", "force_N", "closing_speed_m_per_s"];

struct Foreign(BTreeSet<String>);

impl Foreign {
    fn add(&mut self, what: &str, place: &str, name: &str) {
        self.0.insert(format!("{what} {place}/{name}"));
    }

    fn of_case(&mut self, place: &str, group: &Group) -> Result<(), hdf5::Error> {
        let is_ours = |name: &str| CASE_ATTRIBUTES.contains(&name);
        self.members(place, group, is_ours, &HashSet::from([ORIGINAL]), &OF_A_CASE)?;
        self.members(
            &format!("{place}/{ORIGINAL}"),
            &group.group(ORIGINAL)?,
            |_| false,
            &HashSet::new(),
            &CURVE,
        )
    }

    /// What a group holds besides the attributes, groups and datasets that are the layout's.
    fn members(
        &mut self,
        place: &str,
        group: &Group,
        is_ours: impl Fn(&str) -> bool,
        groups: &HashSet<&str>,
        datasets: &[&str],
    ) -> Result<(), hdf5::Error> {
        for name in group.attr_datatypes()?.keys().filter(|name| !is_ours(name)) {
            self.add("attribute", place, name);
        }
        for name in group.groups()?.iter().filter(|name| !groups.contains(name.as_str())) {
            self.add("group", place, name);
        }
        for name in group.named_datatypes()? {
            self.add("type", place, &name);
        }
        for (name, dataset) in group.iter_datasets()? {
            match datasets.contains(&name.as_str()) {
                true => self.of_dataset(&format!("{place}/{name}"), &dataset)?,
                false => self.add("dataset", place, &name),
            }
        }
        Ok(())
    }

    fn of_dataset(&mut self, place: &str, dataset: &Dataset) -> Result<(), hdf5::Error> {
        for name in dataset.attr_datatypes()?.keys() {
            self.add("attribute", place, name);
        }
        Ok(())
    }
}

/// Writes a database over the file at `path` with all that others have put into it: into a copy
/// of the file, in which only what differs is changed, and which then takes its place.
///
/// # Errors
/// [`DatabaseError::WouldDrop`] if something would be lost; the file is then unchanged.
pub(crate) fn write_keeping(
    database: &Database,
    path: &Path,
    before: &BTreeSet<String>,
) -> Result<(), DatabaseError> {
    let old = layout::decode(path)?;
    let would_drop = |what: String| DatabaseError::WouldDrop { path: path.into(), what };
    write_by_path(path, |draft| {
        fs::copy(path, draft).map_err(|source| DatabaseError::Io { path: path.into(), source })?;
        edit(draft, &old, database).map_err(|e| match e {
            EditError::Hdf5(e) => would_drop(format!("{} ({e})", listed(before))),
            EditError::Content(e) => e,
        })?;
        // Whatever went wrong in it is seen here, before the old file is replaced.
        let after = found(&layout::open(draft)?)?;
        let lost: BTreeSet<String> = before.difference(&after).cloned().collect();
        if !lost.is_empty() {
            return Err(would_drop(listed(&lost)));
        }
        match layout::decode(draft)? == *database {
            true => Ok(()),
            false => Err(would_drop(listed(before))),
        }
    })
}

/// Places that a message lists.
const LISTED: usize = 10;

fn listed(places: &BTreeSet<String>) -> String {
    let names: Vec<&str> = places.iter().take(LISTED).map(String::as_str).collect();
    let more = places.len() - names.len();
    match more {
        0 => names.join(", "),
        _ => format!("{} and {more} more", names.join(", ")),
    }
}

enum EditError {
    Hdf5(hdf5::Error),
    Content(DatabaseError),
}

impl From<hdf5::Error> for EditError {
    fn from(error: hdf5::Error) -> Self {
        Self::Hdf5(error)
    }
}

impl From<DatabaseError> for EditError {
    fn from(error: DatabaseError) -> Self {
        Self::Content(error)
    }
}

/// Makes the file at `path`, which holds `old`, hold `new`.
fn edit(path: &Path, old: &Database, new: &Database) -> Result<(), EditError> {
    // The draft is locked already.
    let access = FileAccessProperties::new().with_locking(FileLocking::Disabled);
    let file = File::open_rw_with_options(path, access)?;
    let root = file.root();
    for (name, value) in layout::root_attributes() {
        root.set_attr(name, value)?;
    }
    let by_name = |database, group| -> HashMap<&str, &Case> {
        Database::cases(database, group).iter().map(|case| (case.name.as_str(), case)).collect()
    };
    for name in old.groups() {
        let kept = by_name(new, name);
        for case in old.cases(name).iter().filter(|case| !kept.contains_key(&*case.name)) {
            root.delete(&format!("{name}/{}", case.name))?;
        }
        if kept.is_empty() {
            root.group(name)?.remove_attr(CASES)?;
        }
    }
    let there = root.groups()?;
    for name in new.groups() {
        let group = match there.iter().any(|group| group == name) {
            true => root.group(name)?,
            false => root.create_group(name)?,
        };
        group.set_attr(CASES, layout::case_names(new.cases(name)))?;
        let before = by_name(old, name);
        for case in new.cases(name) {
            match before.get(&*case.name) {
                Some(before) if *before == case => {}
                Some(_) => replace(&group, case, layout::with_hashes(new, case)?)?,
                None => add(&group, case, layout::with_hashes(new, case)?)?,
            }
        }
    }
    drop(root);
    file.commit()?;
    Ok(file.close()?)
}

fn add(group: &Group, case: &Case, content: Content<'_>) -> Result<(), EditError> {
    group.create_group_with(&case.name, |group| {
        for (name, value) in content.attributes {
            group.set_attr(name, value);
        }
        group.create_group(ORIGINAL);
        for (path, values) in content.datasets {
            group.create_dataset(&path, |dataset| {
                dataset.with_f64_data(values);
            });
        }
    })?;
    Ok(())
}

fn replace(group: &Group, case: &Case, content: Content<'_>) -> Result<(), EditError> {
    let group = group.group(&case.name)?;
    let there = group.attr_datatypes()?;
    for name in CASE_ATTRIBUTES.iter().filter(|name| there.contains_key(**name)) {
        if !content.attributes.iter().any(|(n, _)| n == name) {
            group.remove_attr(name)?;
        }
    }
    for (name, value) in content.attributes {
        group.set_attr(name, value)?;
    }
    for (path, values) in content.datasets {
        let mut dataset = group.dataset(&path)?;
        // Written in place it keeps its attributes.
        if dataset.shape()? == [values.len() as u64] {
            dataset.write(values)?;
        } else {
            let attributes = dataset.attrs()?;
            group.delete(&path)?;
            group.create_dataset(&path, |dataset| {
                dataset.with_f64_data(values);
                for (name, value) in attributes {
                    dataset.set_attr(&name, value);
                }
            })?;
        }
    }
    Ok(())
}
