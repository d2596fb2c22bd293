//! Curve database: cases in HDF5, by group and impact speed.
//!
//! The layout is described in `schemas/curve_database.md`; `hdf5` reads and
//! writes its parts. A file is always written as a whole and renamed into place,
//! so an interrupted command leaves the old content readable.
//!
//! ```
//! use crumple::build::build;
//! use crumple::database::Database;
//! use std::path::Path;
//!
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("curves.h5");
//! let study = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/fe/lead-car-wall/study.toml");
//! build(&study, &path, |_run| {})?;
//!
//! let database = Database::read(&path)?;
//! for case in database.cases("lead-car-wall") {
//!     // The curve absorbs the energy of the impact.
//!     assert!((case.quality.audit.ratio() - 1.0).abs() < 0.06, "{}", case.id.name);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub(crate) mod check;
mod edit;
mod group;
mod layout;
mod opened;

pub(crate) use edit::replace_labels;
pub(crate) use layout::record_hash;

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;
use std::{fmt, io};

use crate::curve::from_table::IMPORTED;
use crate::curve::{Case, CaseId, Origin, StoppedMass};
use crate::error::{Error, error};
use crate::file::{accepts_changed, is_file, write_at, write_whole};
use crate::hdf5;
use crate::order;
use opened::FoundCase;

/// The cases of one database file.
///
/// Invariant: within a group, cases are in order of speed, then name; names are unique.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Database {
    groups: BTreeMap<String, Vec<Case>>,
    /// Cases whose content is not what their hashes are of, with these.
    altered: BTreeMap<CasePath, BTreeMap<String, String>>,
    /// Where cases are that the file has elsewhere: what others put next to them goes along.
    moved: BTreeMap<CasePath, CasePath>,
}

/// A case by its names; no name has a `/`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct CasePath {
    pub group: String,
    pub name: String,
}

impl CasePath {
    /// The names of a case.
    pub(crate) fn of(case: &Case) -> Self {
        Self { group: case.id.group.clone(), name: case.id.name.clone() }
    }
}

impl fmt::Display for CasePath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.group, self.name)
    }
}

impl Database {
    /// Reads a database file.
    ///
    /// # Errors
    /// If the file is missing, not HDF5, not a curve database, of
    /// another layout, or damaged, or holds values that are not those that were written; it names the
    /// case and dataset.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let database = Self::read_as_it_is(path)?;
        match database.altered.keys().next() {
            Some(case) if !accepts_changed() => Err(changed(path, case, database.altered.len())),
            _ => Ok(database),
        }
    }

    /// Reads a database file, also with cases whose values are not those that were written.
    pub(crate) fn read_as_it_is(path: &Path) -> Result<Self, Error> {
        opened::decode(path)
    }

    /// The names of the groups of a database file and of their cases in order of speed, without reading a case.
    ///
    /// # Errors
    /// If the file is missing, not HDF5, not a curve database, of another layout, or damaged.
    pub fn names(path: &Path) -> Result<Vec<(String, Vec<String>)>, Error> {
        let opened = opened::open(path)?;
        let names = opened.groups()?.into_iter().map(|group| {
            let found: Vec<String> = group.cases.into_iter().map(|(name, _)| name).collect();
            let mut names = group.listed.unwrap_or_default();
            let there: HashSet<&String> = found.iter().collect();
            names.retain(|name| there.contains(name));
            // A file that others have changed lists fewer.
            let names = if names.len() == found.len() { names } else { found };
            (group.name, names)
        });
        Ok(names.filter(|(_, names)| !names.is_empty()).collect())
    }

    /// Reads one case of a database file, and no other: of `group`, or of the only group there
    /// is.
    ///
    /// # Errors
    /// As for [`Database::read`], if the group is not named and there are several, and if the
    /// group has no such case.
    pub fn read_case(path: &Path, group: Option<&str>, case: &str) -> Result<Case, Error> {
        let opened = opened::open(path)?;
        if let Some((group, found)) = opened.find(group, case) {
            let FoundCase { case, hashes, .. } = opened.case(&group, case, &found)?;
            if layout::is_altered(&case, &hashes)? && !accepts_changed() {
                return Err(changed(path, &CasePath::of(&case), 1));
            }
            return Ok(case);
        }
        // What there is instead, for the message; or a database with groups of others in it.
        let all = Self::read(path)?;
        let (group, _) = all.group_or_only(path, group)?;
        all.case(path, group, case).cloned()
    }

    /// Reads one case, of `group` or of the only group that has it, without a look at the others; `None` if there is no such case,
    /// or several, or the file is of an earlier layout.
    ///
    /// # Errors
    /// As for [`Database::read_case`].
    pub(crate) fn read_case_alone(
        path: &Path,
        group: Option<&str>,
        case: &str,
    ) -> Result<Option<Case>, Error> {
        let opened = opened::open(path)?;
        if opened.version != layout::VERSION {
            return Ok(None);
        }
        let groups = match group {
            Some(group) => vec![group.to_string()],
            None => opened.file.root().groups().unwrap_or_default(),
        };
        let mut found = groups.iter().filter(|group| opened.find(Some(group), case).is_some());
        match (found.next(), found.next()) {
            (Some(group), None) => Self::read_case(path, Some(group), case).map(Some),
            _ => Ok(None),
        }
    }

    /// Writes the database to `path` as a whole. What others have put into the file that is
    /// there, attributes, datasets and groups, stays in it.
    ///
    /// # Errors
    /// If the target cannot be written, and if
    /// something of others would be lost; the old file is unchanged.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        let is_there = is_file(path)?;
        if is_there {
            let opened = opened::open(path)?;
            let foreign = edit::found(&opened)?;
            let is_current = opened.version == layout::VERSION;
            if !foreign.is_empty() || is_current && edit::may_have_links(path)? {
                return edit::write_keeping(self, path, &foreign);
            }
        }
        let is_device = path.exists() && !is_there;
        if !is_device && self.all().nth(edit::AT_ONCE).is_some() {
            return edit::write_in_parts(self, path, edit::AT_ONCE);
        }
        let file = layout::encode(self, usize::MAX)?;
        if is_device {
            return write_whole(path, &file.finish().map_err(layout::not_encoded)?);
        }
        write_at(path, |mut draft| {
            hdf5::write_to(file, &mut draft).map_err(|error| match error {
                hdf5::Error::Io(source) => source,
                other => io::Error::other(other),
            })?;
            draft.sync_all().map(Some)
        })?;
        Ok(())
    }

    /// Whether a case is not what it was when it was written: its hashes are of something else.
    pub(crate) fn is_altered(&self, group: &str, case: &str) -> bool {
        self.altered.contains_key(&CasePath { group: group.into(), name: case.into() })
    }

    /// The group that was requested, or the only one there is, with its cases in order of speed.
    ///
    /// # Errors
    /// It lists the groups there are;
    /// `path` is for the message.
    pub(crate) fn group_or_only<'a>(
        &'a self,
        path: &Path,
        asked: Option<&str>,
    ) -> Result<(&'a str, &'a [Case]), Error> {
        let mut groups = self.groups.iter();
        let (name, cases) = match (asked, groups.next(), groups.next()) {
            (Some(asked), _, _) => {
                let cases = self.group(path, asked)?;
                let name = self.groups.get_key_value(asked).map_or("", |(name, _)| name);
                return Ok((name, cases));
            }
            (None, Some(only), None) => only,
            (None, Some(_), Some(_)) => {
                let (path, known) = (path.display(), listed(self.groups()));
                return Err(error!(
                    Database,
                    "{path} has several groups: choose one with --group: {known}"
                ));
            }
            (None, None, _) => return Err(no_groups(path)),
        };
        Ok((name, cases))
    }

    /// Names of the groups, one at least.
    ///
    /// # Errors
    /// Where there is none; `path` is for the message.
    pub(crate) fn all_groups(&self, path: &Path) -> Result<Vec<&str>, Error> {
        let groups: Vec<&str> = self.groups().collect();
        if groups.is_empty() { Err(no_groups(path)) } else { Ok(groups) }
    }

    /// Group names in alphabetical order.
    pub fn groups(&self) -> impl Iterator<Item = &str> {
        self.groups.keys().map(String::as_str)
    }

    /// Cases of a group in order of speed; empty if there is no such group.
    pub fn cases(&self, group: &str) -> &[Case] {
        self.groups.get(group).map_or(&[], Vec::as_slice)
    }

    /// Cases of a group in order of speed.
    ///
    /// # Errors
    /// It lists the groups there are; `path` is for the message.
    pub fn group(&self, path: &Path, group: &str) -> Result<&[Case], Error> {
        self.groups.get(group).map(Vec::as_slice).ok_or_else(|| {
            let path = path.display();
            error!(Database at "case", "{path}: there is no group \"{group}\": it has")
                .names(group, self.groups())
        })
    }

    /// One case by group and name.
    ///
    /// # Errors
    /// If one of them is missing, with the names there are.
    pub fn case(&self, path: &Path, group: &str, name: &str) -> Result<&Case, Error> {
        let cases = self.group(path, group)?;
        cases.iter().find(|c| c.id.name == name).ok_or_else(|| {
            let path = path.display();
            error!(Database at "case", "{path}: group \"{group}\" has no case \"{name}\": it has")
                .names(name, cases.iter().map(|c| c.id.name.as_str()))
        })
    }

    /// Adds a case or replaces the one of the same group, name and study.
    ///
    /// # Errors
    /// If its numbers or names are not possible, and if the name is taken by another study.
    pub fn put(&mut self, case: Case) -> Result<(), Error> {
        self.put_all([case])
    }

    /// Adds cases or replaces those of the same group, name and study, as [`Database::put`]; the
    /// work grows with the number of cases, not with its square.
    pub(crate) fn put_all(&mut self, cases: impl IntoIterator<Item = Case>) -> Result<(), Error> {
        let mut places: BTreeMap<String, HashMap<String, usize>> = BTreeMap::new();
        for case in cases {
            case.check()?;
            for (what, name) in [("group", &case.id.group), ("case", &case.id.name)] {
                check_name(name).map_err(|why| {
                    error!(Database, "\"{}\" cannot name a {what}: {why}", shown(name))
                })?;
            }
            let there = self.groups.entry(case.id.group.clone()).or_default();
            let places = places.entry(case.id.group.clone()).or_insert_with(|| {
                there.iter().enumerate().map(|(k, case)| (case.id.name.clone(), k)).collect()
            });
            let Some(&k) = places.get(&case.id.name) else {
                places.insert(case.id.name.clone(), there.len());
                there.push(case);
                continue;
            };
            if there[k].id.study != case.id.study {
                let (CaseId { group, name, .. }, other) = (&case.id, &there[k].id.study);
                return Err(error!(
                    Database,
                    "case \"{name}\" of group \"{group}\" belongs to the study \"{other}\": name this run or group differently, or remove that case (crumple db rm)"
                ));
            }
            self.altered.remove(&CasePath::of(&case));
            there[k] = case;
        }
        for group in places.keys() {
            self.groups.get_mut(group).into_iter().for_each(|cases| sort(cases));
        }
        Ok(())
    }

    /// Removes cases.
    pub(crate) fn remove(&mut self, paths: &HashSet<CasePath>) {
        for cases in self.groups.values_mut() {
            cases.retain(|case| !paths.contains(&CasePath::of(case)));
        }
        self.groups.retain(|_, cases| !cases.is_empty());
        self.altered.retain(|path, _| !paths.contains(path));
        self.moved.retain(|_, to| !paths.contains(to));
    }

    /// Gives cases other names and groups, all at once.
    pub(crate) fn relocate(&mut self, moves: &BTreeMap<CasePath, CasePath>) -> Result<(), Error> {
        let mut places = HashSet::new();
        for case in self.groups.values().flatten() {
            let path = CasePath::of(case);
            let place = moves.get(&path).unwrap_or(&path);
            if !places.insert(place.clone()) {
                let CasePath { group, name } = place;
                return Err(error!(
                    Database,
                    "group \"{group}\" has a case \"{name}\" already: choose another name"
                ));
            }
        }
        let mut cases: Vec<Case> =
            std::mem::take(&mut self.groups).into_values().flatten().collect();
        for case in &mut cases {
            if let Some(to) = moves.get(&CasePath::of(case)) {
                remember_origin(case);
                (case.id.group, case.id.name) = (to.group.clone(), to.name.clone());
            }
        }
        self.insert(cases);
        let place = |path: CasePath| moves.get(&path).cloned().unwrap_or(path);
        let altered = std::mem::take(&mut self.altered);
        self.altered = altered.into_iter().map(|(path, hashes)| (place(path), hashes)).collect();
        // A case that was moved before is in the file where it was first.
        let before = std::mem::take(&mut self.moved);
        let now: HashSet<CasePath> = before.values().cloned().collect();
        self.moved = before.into_iter().map(|(from, to)| (from, place(to))).collect();
        let first = moves.iter().filter(|(from, _)| !now.contains(from));
        self.moved.extend(first.map(|(from, to)| (from.clone(), to.clone())));
        Ok(())
    }

    fn insert(&mut self, cases: Vec<Case>) {
        for case in cases {
            self.groups.entry(case.id.group.clone()).or_default().push(case);
        }
        self.groups.values_mut().for_each(|cases| sort(cases));
    }

    /// Adds cases, or puts them in the place of those of the same names, whatever study these are
    /// of; each with the hashes that it was written with if it is not what it was then.
    pub(crate) fn replace_all(&mut self, cases: Vec<(Case, Option<BTreeMap<String, String>>)>) {
        let paths: HashSet<CasePath> = cases.iter().map(|(case, _)| CasePath::of(case)).collect();
        for cases in self.groups.values_mut() {
            cases.retain(|case| !paths.contains(&CasePath::of(case)));
        }
        self.altered.retain(|path, _| !paths.contains(path));
        let altered = cases.iter().filter_map(|(c, a)| Some((CasePath::of(c), a.clone()?)));
        self.altered.extend(altered);
        self.insert(cases.into_iter().map(|(case, _)| case).collect());
    }

    /// Changes cases in a way that leaves their names and order.
    pub(crate) fn change(&mut self, change: impl FnMut(&mut Case)) {
        self.groups.values_mut().flatten().for_each(change);
    }

    /// All cases, each with the hashes that it was written with if it is not what it was then.
    pub(crate) fn into_cases(mut self) -> Vec<(Case, Option<BTreeMap<String, String>>)> {
        let cases = self.groups.into_values().flatten();
        cases
            .map(|case| (self.altered.remove(&CasePath::of(&case)), case))
            .map(|(a, c)| (c, a))
            .collect()
    }

    /// The masses that the crush zones of groups stop at each deflection, as the file at `path` stores them, of which this is
    /// the content; as they follow from the cases where these are not those it lists. `db check` compares the stored ones.
    pub(crate) fn stopped_masses<'g>(
        &self,
        path: &Path,
        groups: impl Iterator<Item = &'g str>,
    ) -> BTreeMap<String, StoppedMass> {
        let opened = opened::open(path).ok();
        let of_group = |group: &'g str| {
            let cases = self.cases(group);
            let is_as_written = !self.altered.keys().any(|case| case.group == group);
            let attributes = opened.as_ref().filter(|_| is_as_written);
            let attributes = attributes.and_then(|opened| opened.group_attributes(group).ok());
            let stored = attributes.and_then(|found| group::stored_stopped_mass(&found, cases));
            Some((group.to_string(), stored.or_else(|| group::stopped_mass(group, cases))?))
        };
        groups.filter_map(of_group).collect()
    }

    /// All cases, by group, speed and name.
    pub fn all(&self) -> impl Iterator<Item = &Case> {
        self.groups.values().flatten()
    }

    /// Whether both hold the same cases, altered in the same way.
    fn same_content(&self, other: &Self) -> bool {
        self.groups == other.groups && self.altered == other.altered
    }
}

/// Lets a case of an earlier version, which does not record what it was built from, keep its names
/// before it gets others: a build of its study knows it by them.
pub(crate) fn remember_origin(case: &mut Case) {
    if case.provenance.origin.is_none() && case.id.study != IMPORTED {
        let (group, run) = (case.id.group.clone(), case.id.name.clone());
        case.provenance.origin = Some(Origin { manifest: String::new(), group, run });
    }
}

/// What other programs have put into the file at `path`, as a message lists it; `None` if nothing. And whether they may have put
/// links into it.
pub(crate) fn foreign_items(path: &Path) -> Result<(Option<String>, bool), Error> {
    let items = edit::found(&opened::open(path)?)?;
    Ok(((!items.is_empty()).then(|| edit::listed(&items)), edit::may_have_links(path)?))
}

/// Whether the file at `path` is a curve database.
pub(crate) fn is_database(path: &Path) -> bool {
    opened::open(path).is_ok()
}

/// Puts the cases of a group into their order: by speed, then name.
fn sort(cases: &mut [Case]) {
    order::sort(cases, |a, b| {
        a.conditions
            .speed
            .m_per_s
            .total_cmp(&b.conditions.speed.m_per_s)
            .then_with(|| a.id.name.cmp(&b.id.name))
    });
}

fn listed<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<_> = names.collect();
    if names.is_empty() { "none".into() } else { names.join(", ") }
}

fn no_groups(path: &Path) -> Error {
    error!(Database, "{} has no groups: build a study into it", path.display())
}

/// The error of cases whose values are not those that were written.
fn changed(path: &Path, case: &CasePath, count: usize) -> Error {
    let more = if count > 1 { format!(" (and {} more)", count - 1) } else { String::new() };
    error!(
        Database,
        "{}: the values of case {case}{more} do not match their fingerprint: crumple db check shows which; build the case again or remove it (crumple db rm), or use --accept-changed",
        path.display()
    )
}

/// The error of what a database holds and should not.
fn damaged(path: &Path, place: &str, detail: impl fmt::Display) -> Error {
    error!(Database, "{}: {place}: {detail}", path.display())
}

/// Longest name of a case or group, in bytes.
const MAX_NAME: usize = 200;

/// Why a text is not a name of a group or case, as a message says it of "it".
pub(crate) fn check_name(name: &str) -> Result<(), &'static str> {
    if name.trim().is_empty() {
        Err("it is blank")
    } else if name == "." || name == ".." {
        Err("it has a special meaning in HDF5")
    } else if name.contains(|c: char| c.is_control() || c == '/') {
        Err("it may not contain \"/\" or control characters")
    } else if name.len() > MAX_NAME {
        Err("it has more than 200 bytes")
    } else {
        Ok(())
    }
}

/// The name as a message shows it.
pub(crate) fn shown(name: &str) -> String {
    name.chars().take(MAX_NAME).collect()
}
