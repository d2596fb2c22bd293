//! Rewriting a database file that contains objects of other programs, and one case of a large file: a copy of the file is
//! edited, read back to check that nothing is missing, and renamed into place. So
//! links, types and attributes stay as they were encoded. And writing a large database in parts.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::io::Read;
use std::path::Path;
use std::{fmt, fs};

use super::group::{self, GROUP_ATTRIBUTES};
use super::layout::{self, BODY_FORCE, CASE_ATTRIBUTES, Content, ORIGINAL, PLOT, ROOT, VERSION};
use super::opened::{self, FoundGroup, Opened};
use super::{CasePath, Database};
use crate::curve::{Case, CaseId};
use crate::error::{Error, error};
use crate::file::{not_written, write_by_path};
use crate::hdf5::{self, AttrValue, Dataset, File, FileAccessProperties, FileLocking, Group};

/// Writes a database over the file at `path` with all objects of other programs in it, which is
/// `before`: into a copy of the file, in which only what differs is changed, and which then takes
/// its place.
pub(super) fn write_keeping(
    database: &Database,
    path: &Path,
    before: &BTreeSet<Item>,
) -> Result<(), Error> {
    let is_current = opened::open(path)?.version == VERSION;
    let mut old = opened::decode(path)?;
    let moves = Moves::of(&old, database, before);
    // Where each goes, and where it is.
    let moved: BTreeMap<Item, &Item> =
        before.iter().map(|item| (moves.of_item(item), item)).collect();
    let before: BTreeSet<Item> = moved.keys().cloned().collect();
    let listed = |items: &BTreeSet<Item>| match items.is_empty() {
        true => "links".to_string(),
        false => listed(&items.iter().map(|item| moved[item].clone()).collect()),
    };
    let would_drop = |what: String| {
        error!(
            Database,
            "{} holds objects that crumple did not write and would lose by rewriting the file: {what}; the database is unchanged: copy them to another file and delete them here, or build into a new database",
            path.display()
        )
    };
    write_by_path(path, |draft| {
        fs::copy(path, draft).map_err(|source| Error::io(path, source))?;
        let edited = moves.make(draft, &old, database).and_then(|()| {
            old.remove(&moves.gone);
            old.relocate(&moves.all)?;
            Edit { old: &old, new: database, is_current, moves: &moves }.make(draft)
        });
        edited.map_err(|e| match e {
            // If the copy can be read, the editor cannot do it.
            EditError::Hdf5(e) => match opened::open(draft).and_then(|draft| found(&draft)) {
                Ok(_) => would_drop(format!("{} ({e})", listed(&before))),
                Err(unread) => unread,
            },
            EditError::Content(e) => e,
        })?;
        // Whatever went wrong in it is seen here, before the old file is replaced.
        let after = found(&opened::open(draft)?)?;
        let lost: BTreeSet<Item> = before.difference(&after).cloned().collect();
        if !lost.is_empty() {
            return Err(would_drop(listed(&lost)));
        }
        if opened::decode(draft)?.same_content(database) {
            Ok(())
        } else {
            Err(would_drop(listed(&before)))
        }
    })
}

/// Cases of which the bytes are made at once, 100 kB each. With fewer, the names of those that are in the file would be
/// searched more often.
pub(super) const AT_ONCE: usize = 3000;

/// Writes a large database to a file at `path`, so many cases at once: the first as a whole, the others added to the draft.
pub(super) fn write_in_parts(
    database: &Database,
    path: &Path,
    at_once: usize,
) -> Result<(), Error> {
    let failed = |source| not_written(path, source);
    let written = write_by_path(path, |draft| {
        let mut first = fs::File::create(draft).map_err(failed)?;
        hdf5::write_to(layout::encode(database, at_once)?, &mut first)?;
        let (mut there, mut room) = (at_once, at_once);
        let mut file = open(draft)?;
        for name in database.groups() {
            let cases = database.cases(name);
            let mut rest = &cases[cases.len().min(there)..];
            there -= cases.len() - rest.len();
            while !rest.is_empty() {
                let (part, later) = rest.split_at(rest.len().min(room));
                let group = file.root().group(name)?;
                for (case, content) in layout::contents(database, part) {
                    add(&group, case, content?)?;
                }
                (rest, room) = (later, room - part.len());
                drop(group);
                if room == 0 {
                    file.close()?;
                    (file, room) = (open(draft)?, at_once);
                }
            }
        }
        Ok(file.close()?)
    });
    written.map_err(|e| match e {
        EditError::Hdf5(hdf5::Error::Io(source)) => failed(source),
        EditError::Hdf5(e) => layout::not_encoded(e),
        EditError::Content(e) => e,
    })
}

/// Writes a case, whose tags or notes alone have changed, into a copy of the file at `path`, which takes its place; the
/// other cases are copied, not read. `false` if the file is such that the crate cannot edit it.
///
/// # Errors
/// If the file cannot be written, and if anything else in it would change; the old file is unchanged.
pub(crate) fn replace_labels(path: &Path, case: &Case) -> Result<bool, Error> {
    let CaseId { group, name, .. } = &case.id;
    let failed = |why: &str| {
        let path = path.display();
        error!(Database, "{path}: {group}/{name} cannot be changed: {why}; the file is unchanged")
    };
    let before = around(path, case)?;
    let written = write_by_path(path, |draft| {
        fs::copy(path, draft).map_err(|source| Error::io(path, source))?;
        let file = open(draft)?;
        let found = file.root().group(group)?.group(name)?;
        replace_attributes(&found, layout::with_hashes(&Database::default(), case)?)?;
        drop(found);
        file.close()?;
        if around(draft, case)? != before {
            return Err(failed("other objects of the file would be lost").into());
        }
        if Database::read_case(draft, Some(group), name)? != *case {
            return Err(failed("it does not read back as it was written").into());
        }
        Ok(())
    });
    match written {
        Ok(()) => Ok(true),
        Err(EditError::Hdf5(_)) => Ok(false),
        Err(EditError::Content(error)) => Err(error),
    }
}

/// All members of the root and of the group of a case, and what others have put into it: the objects that an edit of the case
/// writes anew.
fn around(path: &Path, case: &Case) -> Result<BTreeSet<Item>, Error> {
    let CaseId { group, name, .. } = &case.id;
    let opened = opened::open(path)?;
    let mut all = Foreign(BTreeSet::new());
    let mut walk = || -> Result<(), hdf5::Error> {
        let root = opened.file.root();
        let of_group = root.group(group)?;
        let none = HashSet::new();
        all.members("", &root, |_| false, &none, &[])?;
        all.members(group, &of_group, |_| false, &none, &[])?;
        all.of_case(&format!("{group}/{name}"), &of_group.group(name)?)
    };
    opened.check(group, walk())?;
    Ok(all.0)
}

enum EditError {
    Hdf5(hdf5::Error),
    Content(Error),
}

impl From<hdf5::Error> for EditError {
    fn from(error: hdf5::Error) -> Self {
        Self::Hdf5(error)
    }
}

impl From<Error> for EditError {
    fn from(error: Error) -> Self {
        Self::Content(error)
    }
}

/// What of a file's cases is not in its place in the new database. What others have put into a case
/// or group moves with it; a case without such is deleted and written again.
struct Moves {
    /// Cases that are no longer there.
    gone: HashSet<CasePath>,
    /// Groups that have another name with all that is in them.
    groups: BTreeMap<String, String>,
    /// Cases that have to be moved once the groups have been.
    cases: Vec<(CasePath, CasePath)>,
    all: BTreeMap<CasePath, CasePath>,
}

impl Moves {
    fn of(old: &Database, new: &Database, theirs: &BTreeSet<Item>) -> Self {
        let (before, after): (HashSet<CasePath>, HashSet<CasePath>) =
            (old.all().map(CasePath::of).collect(), new.all().map(CasePath::of).collect());
        let mut all = new.moved.clone();
        all.retain(|from, to| from != to && before.contains(from));
        let mut groups = BTreeMap::new();
        for group in old.groups().filter(|group| new.cases(group).is_empty()) {
            let targets = all.iter().filter(|(from, _)| from.group == group);
            let targets: BTreeSet<&str> = targets.map(|(_, to)| to.group.as_str()).collect();
            if let (1, Some(target)) = (targets.len(), targets.first())
                && theirs.iter().any(|item| item.group() == group)
                && old.cases(target).is_empty()
                && !groups.values().any(|taken| taken == target)
            {
                groups.insert(group.to_string(), target.to_string());
            }
        }
        let with_theirs: HashSet<CasePath> = theirs.iter().filter_map(Item::case).collect();
        all.retain(|from, _| groups.contains_key(&from.group) || with_theirs.contains(from));
        let taken: HashSet<&CasePath> = all.values().collect();
        let is_gone = |path: &&CasePath| {
            !all.contains_key(path) && (!after.contains(path) || taken.contains(path))
        };
        let gone: HashSet<CasePath> = before.iter().filter(is_gone).cloned().collect();
        let renamed = |group: &String| groups.get(group).unwrap_or(group).clone();
        let cases = all.iter().map(|(from, to)| {
            (CasePath { group: renamed(&from.group), name: from.name.clone() }, to.clone())
        });
        let cases = cases.filter(|(from, to)| from != to).collect();
        Self { gone, groups, cases, all }
    }

    /// Where objects of other programs are afterwards.
    fn of_item(&self, item: &Item) -> Item {
        let rest = item.place.split_once('/').map_or("", |(_, rest)| rest);
        let place = match (item.case().and_then(|case| self.all.get(&case)), item.group()) {
            (Some(to), _) => {
                let inside = rest.split_once('/').map_or("", |(_, inside)| inside);
                format!("{to}/{inside}")
            }
            (None, group) => match self.groups.get(group) {
                Some(to) => format!("{to}/{rest}"),
                None => return item.clone(),
            },
        };
        Item { what: item.what, place }
    }

    /// Deletes what is gone from the file at `path`, which holds `old`, and moves what has another
    /// place.
    fn make(&self, path: &Path, old: &Database, new: &Database) -> Result<(), EditError> {
        let file = open(path)?;
        let root = file.root();
        for case in &self.gone {
            root.delete(&case.to_string())?;
        }
        for group in old.groups().filter(|group| new.cases(group).is_empty()) {
            let found = root.group(group)?;
            let there = found.attr_datatypes()?;
            for name in GROUP_ATTRIBUTES.iter().filter(|name| there.contains_key(**name)) {
                found.remove_attr(name)?;
            }
        }
        file.commit()?;
        for (from, to) in &self.groups {
            file.copy(from, to)?;
            file.commit()?;
            root.delete(from)?;
        }
        // By way of names of their own, so that two can change places.
        let between = |k: usize| format!("crumple moves case {k}");
        for (k, (from, _)) in self.cases.iter().enumerate() {
            file.copy(&from.to_string(), &between(k))?;
            file.commit()?;
            root.delete(&from.to_string())?;
        }
        file.commit()?;
        let mut there: BTreeSet<String> = root.groups()?.into_iter().collect();
        for (k, (_, to)) in self.cases.iter().enumerate() {
            if there.insert(to.group.clone()) {
                root.create_group(&to.group)?;
                file.commit()?;
            }
            file.copy(&between(k), &to.to_string())?;
            file.commit()?;
            root.delete(&between(k))?;
        }
        file.commit()?;
        drop(root);
        Ok(file.close()?)
    }
}

fn open(path: &Path) -> Result<File, EditError> {
    // The draft is locked already.
    let access = FileAccessProperties::new().with_locking(FileLocking::Disabled);
    Ok(File::open_rw_with_options(path, access)?)
}

/// The change from one database to another in a file whose cases are in their places.
struct Edit<'a> {
    old: &'a Database,
    new: &'a Database,
    /// Whether the file's layout is the one that is written.
    is_current: bool,
    moves: &'a Moves,
}

impl Edit<'_> {
    /// Makes the file at `path`, which holds the old database, hold the new one.
    fn make(&self, path: &Path) -> Result<(), EditError> {
        let file = open(path)?;
        let root = file.root();
        for (name, value) in layout::root_attributes(self.new) {
            root.set_attr(name, value)?;
        }
        self.put(&root)?;
        drop(root);
        Ok(file.close()?)
    }

    fn put(&self, root: &Group) -> Result<(), EditError> {
        let there: HashSet<String> = root.groups()?.into_iter().collect();
        let moved: HashSet<&CasePath> = self.moves.all.values().collect();
        for name in self.new.groups() {
            let attributes = group::attributes(name, self.new.cases(name));
            let group = if there.contains(name) {
                replace_group_attributes(root.group(name)?, attributes)?
            } else {
                with_attributes(root.create_group(name)?, attributes)?
            };
            let before: HashMap<&str, &Case> =
                self.old.cases(name).iter().map(|case| (case.id.name.as_str(), case)).collect();
            for case in self.new.cases(name) {
                let content = || layout::with_hashes(self.new, case);
                let Some(before) = before.get(&*case.id.name) else {
                    add(&group, case, content()?)?;
                    continue;
                };
                let is_in_place = self.is_current && !moved.contains(&CasePath::of(case));
                if *before == case && is_in_place {
                    continue;
                }
                let found = group.group(&case.id.name)?;
                let content = content()?;
                if !(has_same_curves(before, case) && is_in_place) {
                    replace_curves(&found, &content)?;
                }
                replace_attributes(&found, content)?;
            }
        }
        Ok(())
    }
}

fn add(group: &Group, case: &Case, mut content: Content<'_>) -> Result<(), EditError> {
    group.create_group_with(&case.id.name, |group| {
        for (name, value) in content.written() {
            group.set_attr(name, value);
        }
        group.create_group(ORIGINAL);
        for (path, values) in content.datasets {
            group.create_dataset(&path, |dataset| {
                dataset.with_f64_data(&values);
                for (name, value) in layout::labels(&path) {
                    dataset.set_attr(name, value);
                }
            });
        }
    })?;
    Ok(())
}

/// Whether all datasets of two cases hold the same values.
fn has_same_curves(a: &Case, b: &Case) -> bool {
    a.curves.sampled == b.curves.sampled
        && a.curves.original == b.curves.original
        && a.curves.closing_speed_m_per_s == b.curves.closing_speed_m_per_s
        && a.conditions.masses == b.conditions.masses
}

fn with_attributes(
    group: Group,
    attributes: Vec<(&'static str, AttrValue)>,
) -> Result<Group, EditError> {
    for (name, value) in attributes {
        group.set_attr(name, value)?;
    }
    Ok(group)
}

fn replace_group_attributes(
    group: Group,
    mut attributes: Vec<(&'static str, AttrValue)>,
) -> Result<Group, EditError> {
    let there = group.attrs()?;
    for name in GROUP_ATTRIBUTES.iter().filter(|name| there.contains_key(**name)) {
        if !attributes.iter().any(|(n, _)| n == name) {
            group.remove_attr(name)?;
        }
    }
    attributes
        .retain(|(name, value)| !there.get(*name).is_some_and(|t| group::has_numbers_of(t, value)));
    with_attributes(group, attributes)
}

fn replace_attributes(case: &Group, mut content: Content<'_>) -> Result<(), EditError> {
    let there = case.attrs()?;
    for name in CASE_ATTRIBUTES.iter().filter(|name| there.contains_key(**name)) {
        let is_written =
            content.attributes.iter().map(|(n, _)| n).chain(PLOT.iter().map(|(n, _)| n));
        if !is_written.into_iter().any(|n| n == name) {
            case.remove_attr(name)?;
        }
    }
    // Each text that is written takes 4 KiB, whatever it replaces.
    let is_same = |a: &AttrValue, b: &AttrValue| {
        (a.as_str(), a.as_f64(), a.as_i64()) == (b.as_str(), b.as_f64(), b.as_i64())
    };
    for (name, value) in content.written() {
        if !there.get(name).is_some_and(|before| is_same(before, &value)) {
            case.set_attr(name, value)?;
        }
    }
    Ok(())
}

/// Rewrites the datasets of a case, with the attributes added by other programs.
fn replace_curves(case: &Group, content: &Content<'_>) -> Result<(), EditError> {
    for (path, values) in &content.datasets {
        // Absent in files of earlier versions.
        let mut theirs = HashMap::new();
        if let Ok(found) = case.dataset(path) {
            theirs = found.attrs()?;
            theirs.retain(|name, _| !is_ours(name));
            case.delete(path)?;
        }
        case.create_dataset(path, |dataset| {
            dataset.with_f64_data(values);
            for (name, value) in layout::labels(path) {
                dataset.set_attr(name, value);
            }
            for (name, value) in theirs {
                dataset.set_attr(&name, value);
            }
        })?;
    }
    Ok(())
}

/// An object of another program: its kind, and its path in the file.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Item {
    /// `attribute`, `dataset`, `group` or `type`.
    pub what: &'static str,
    /// Path in the file.
    pub place: String,
}

impl Item {
    /// The group that it is in; empty if in none.
    pub(super) fn group(&self) -> &str {
        self.place.split_once('/').map_or("", |(group, _)| group)
    }

    /// The case that it is in, or might be: nothing is in what is not a case.
    pub(super) fn case(&self) -> Option<CasePath> {
        let (group, rest) = self.place.split_once('/')?;
        let (name, _) = rest.split_once('/')?;
        Some(CasePath { group: group.into(), name: name.into() })
    }
}

impl fmt::Display for Item {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.what, self.place)
    }
}

/// Places that a message lists.
const LISTED: usize = 10;

/// The first items as a message names them.
pub(super) fn listed(items: &BTreeSet<Item>) -> String {
    let names: Vec<String> = items.iter().take(LISTED).map(Item::to_string).collect();
    let more = items.len() - names.len();
    match more {
        0 => names.join(", "),
        _ => format!("{} and {more} more", names.join(", ")),
    }
}

/// Bytes of a file that are looked at at once.
const WINDOW: usize = 1 << 20;
/// Signatures of continued headers, and of trees of links that are in a heap (type 5): what crumple writes has neither.
const CONTINUED: &[u8] = b"OCHK";
const LINKS_IN_A_HEAP: [&[u8]; 2] = [b"BTHD\x00\x05", b"BTHD\x01\x05"];

/// Whether another program has edited a file, and so may have put soft or external links into it, which our HDF5 library does not list.
pub(super) fn may_have_links(path: &Path) -> Result<bool, Error> {
    let failed = |source| Error::io(path, source);
    let mut file = crate::file::open(path).map_err(failed)?;
    let longest = LINKS_IN_A_HEAP[0].len();
    let (mut window, mut kept) = (vec![0; WINDOW], 0);
    loop {
        let read = file.read(&mut window[kept..]).map_err(failed)?;
        if read == 0 {
            return Ok(false);
        }
        let seen = &window[..kept + read];
        let mut marks = LINKS_IN_A_HEAP.into_iter().chain([CONTINUED]);
        if marks.any(|mark| memchr::memmem::find(seen, mark).is_some()) {
            return Ok(true);
        }
        let end = seen.len();
        kept = (longest - 1).min(end);
        window.copy_within(end - kept..end, 0);
    }
}

/// Attributes, datasets, groups and types of a file that are not the layout's.
pub(super) fn found(opened: &Opened<'_>) -> Result<BTreeSet<Item>, Error> {
    let ours = opened.groups()?;
    let mut foreign = Foreign(BTreeSet::new());
    let mut walk = || -> Result<(), hdf5::Error> {
        let root = opened.file.root();
        let names = ours.iter().map(|group| group.name.as_str()).collect();
        foreign.members("", &root, |name| ROOT.contains(&name), &names, &[])?;
        for FoundGroup { name, cases, .. } in &ours {
            let names = cases.iter().map(|(name, _)| name.as_str()).collect();
            let is_ours = |name: &str| GROUP_ATTRIBUTES.contains(&name);
            foreign.members(name, &root.group(name)?, is_ours, &names, &[])?;
            for (case, group) in cases {
                foreign.of_case(&format!("{name}/{case}"), group)?;
            }
        }
        Ok(())
    };
    opened.check("/", walk())?;
    Ok(foreign.0)
}

/// Datasets of a curve; a case has one more.
const CURVE: [&str; 3] = ["time_s", "deflection_m", "force_N"];
const OF_A_CASE: [&str; 5] =
    ["time_s", "deflection_m", "force_N", "closing_speed_m_per_s", BODY_FORCE];

struct Foreign(BTreeSet<Item>);

impl Foreign {
    fn add(&mut self, what: &'static str, place: &str, name: &str) {
        self.0.insert(Item { what, place: format!("{place}/{name}") });
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
            if datasets.contains(&name.as_str()) {
                self.of_dataset(&format!("{place}/{name}"), &dataset)?;
            } else {
                self.add("dataset", place, &name);
            }
        }
        Ok(())
    }

    fn of_dataset(&mut self, place: &str, dataset: &Dataset) -> Result<(), hdf5::Error> {
        for name in dataset.attr_datatypes()?.keys().filter(|name| !is_ours(name)) {
            self.add("attribute", place, name);
        }
        Ok(())
    }
}

/// Whether an attribute of a dataset is ours: a label, or of the dimension scales that earlier versions wrote.
pub(super) fn is_ours(name: &str) -> bool {
    ["units", "long_name", "CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST"].contains(&name)
}
