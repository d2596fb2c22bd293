//! Adding curves of files to a database: each becomes a case of the study `IMPORTED`.
//!
//! All files are read, and all cases made, before anything is written; the database is locked
//! meanwhile, and written as a whole.

mod case;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::clock;
use crate::curve::from_table::IMPORTED;
use crate::curve::{Case, Parameter};
use crate::database::Database;
use crate::error::{Error, error};
use crate::file::WriterLock;
use crate::formats::read::ReadOptions;
use crate::unit::SpeedKind;

/// One file that is to become a case, with its metadata.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Item {
    /// The file, or an ISO-MME test's folder.
    pub path: PathBuf,
    /// Name of the case; the file's, without its extension, if absent.
    pub case: Option<String>,
    /// Impact speed in m/s; the file's if absent.
    pub speed_m_per_s: Option<f64>,
}

/// Metadata of all files that are added at once.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Settings {
    pub group: String,
    /// What speeds are measured against; the file's if absent, else the group's.
    pub kind: Option<SpeedKind>,
    /// Mass of the body in kg; the file's if absent.
    pub mass_kg: Option<f64>,
    /// Mass of the other body of a pair in kg; the file's if absent, else that of the body.
    pub other_mass_kg: Option<f64>,
    /// Unloading stiffness in N/m; the file's if absent.
    pub unloading_stiffness_n_per_m: Option<f64>,
    /// How the files are read; its force is also the kind of a curve whose file does not state it.
    pub read: ReadOptions,
    pub parameters: BTreeMap<String, Parameter>,
    /// Replace cases of these names that were added before.
    pub replace: bool,
    /// Accept curves whose energy is impossible for the impact.
    pub accept_energy: bool,
}

/// Adds the curves of `items` to the database at `path`, which is created if it does not exist; returns
/// their cases in the order of the items.
pub(crate) fn add(path: &Path, items: &[Item], settings: &Settings) -> Result<Vec<Case>, Error> {
    let _lock = WriterLock::take(path)?;
    let mut database = if path.try_exists().unwrap_or(true) {
        Database::read_as_it_is(path)?
    } else {
        Database::default()
    };
    let mut cases: Vec<Case> = Vec::with_capacity(items.len());
    let now = clock::now_utc();
    for item in items {
        let mut case = case::of(item, settings, database.cases(&settings.group).first())?;
        case.provenance.built_utc = Some(now.clone());
        if let Some(k) = cases.iter().position(|c| c.id.name == case.id.name) {
            return Err(error!(
                Import,
                "{first} and {second} would both be case \"{name}\": name them with --case",
                first = items[k].path.display(),
                name = case.id.name,
                second = item.path.display()
            ));
        }
        check_place(&database, item, &case, settings.replace)?;
        if let Some(first) = cases.first() {
            check_kinds(item, &case, first)?;
        }
        if let Some(before) = existing_case(&database, &case) {
            // Tags and notes are kept for the case that replaces it.
            (case.provenance.tags, case.provenance.user_notes) =
                (before.provenance.tags.clone(), before.provenance.user_notes.clone());
        }
        cases.push(case);
    }
    database.put_all(cases.iter().cloned())?;
    database.write(path)?;
    Ok(cases)
}

/// The case of the curve of one file, without a database.
pub(crate) fn case_of_file(item: &Item, settings: &Settings) -> Result<Case, Error> {
    case::of(item, settings, None)
}

fn existing_case<'a>(database: &'a Database, case: &Case) -> Option<&'a Case> {
    database.cases(&case.id.group).iter().find(|c| c.id.name == case.id.name)
}

fn check_place(database: &Database, item: &Item, case: &Case, replace: bool) -> Result<(), Error> {
    let (path, group, name) = (item.path.display(), &case.id.group, &case.id.name);
    match existing_case(database, case) {
        Some(other) if other.id.study != IMPORTED => Err(error!(
            Import,
            "{path}: case \"{name}\" of group \"{group}\" belongs to the study \"{study}\", which builds it: give another name with --case",
            study = other.id.study
        )),
        Some(_) if !replace => Err(error!(
            Import,
            "{path}: group \"{group}\" has a case \"{name}\" already: replace it with --replace, or give another name with --case"
        )),
        // A case that is replaced imposes no restriction.
        _ => match database.cases(group).iter().find(|c| c.id.name != *name) {
            Some(other) => check_kinds(item, case, other),
            None => Ok(()),
        },
    }
}

fn check_kinds(item: &Item, case: &Case, other: &Case) -> Result<(), Error> {
    let Some((what, found, there)) = case.other_kind(other) else { return Ok(()) };
    Err(error!(
        Import,
        "{path}: this curve has a {found} {what}, the cases of group \"{group}\" have a {there} one: no model can be trained on both; give another --group",
        group = case.id.group,
        path = item.path.display()
    ))
}
