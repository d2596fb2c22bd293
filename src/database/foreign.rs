//! Objects of other programs in a database file.

use std::collections::{BTreeSet, HashSet};
use std::fmt;

use super::CasePath;
use super::group::GROUP_ATTRIBUTES;
use super::layout::{BODY_FORCE, CASE_ATTRIBUTES, FoundGroup, ORIGINAL, Opened, ROOT};
use crate::error::Error;
use crate::hdf5::{self, Dataset, Group};

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
        for name in dataset.attr_datatypes()?.keys().filter(|name| !is_of_dimensions(name)) {
            self.add("attribute", place, name);
        }
        Ok(())
    }
}

/// Whether an attribute of a dataset is of its dimension scales, which earlier versions wrote.
pub(super) fn is_of_dimensions(name: &str) -> bool {
    ["CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST"].contains(&name)
}
