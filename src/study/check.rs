//! What of a study manifest only the whole shows.

use std::collections::HashSet;

use super::manifest::{Head, Manifest, RunEntry, StudyKind};
use crate::curve::Parameter;
use crate::curve::from_table::IMPORTED;
use crate::curve::recipe::{ForceSource, Recipe};
use crate::error::KeyPath;

/// What does not fit in a study manifest.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InvalidStudy {
    /// A pair whose recipe names one body only.
    #[error(
        "a pair needs the other body: deflection.minus_node = …, or half_model = true in [study] for one body against its symmetry plane"
    )]
    PairOfOne,
    /// The deflection would be doubled twice.
    #[error(
        "half_model = true doubles the deflection, which a minus_node already makes whole: keep one of them"
    )]
    DoublyWhole,
    /// `half_model` stands beside a wall.
    #[error("half_model = true needs kind = \"pair\": a wall is no symmetry plane of a pair")]
    HalfWall,
    /// There is no run.
    #[error("there is no [[run]]")]
    NoRun,
    /// The force that tells when contact begins is a body force.
    #[error(
        "recipe.contact must be a contact force (id = … of a wall or contact): a body slows down after the first touch"
    )]
    ContactOfBody,
    /// A second contact force stands beside a contact force.
    #[error("recipe.contact is for a body force: contact is found in recipe.force itself")]
    ContactBesideContact,
    /// A run states twice when contact begins.
    #[error("run \"{run}\": contact_time and gap both say when contact begins: keep one of them")]
    TwoContacts {
        /// Path of the run.
        run: String,
    },
    /// A run has an empty path.
    #[error("a [[run]] has an empty path")]
    EmptyPath,
    /// A run against a wall gives the mass of a second body.
    #[error("run \"{run}\": other_mass needs kind = \"pair\"")]
    OtherMassOfWall {
        /// Path of the run.
        run: String,
    },
    /// The path of a run gives no name for its case.
    #[error("run \"{run}\" gives no name for its case: add name = \"…\" to it", run = run.escape_debug())]
    NoCaseName {
        /// Path of the run.
        run: String,
    },
    /// Two runs have the same name.
    #[error("two runs are named \"{name}\": give one of them a name = …")]
    SameName {
        /// The name.
        name: String,
    },
    /// The name of a parameter is empty, or has other characters than a name may have.
    #[error("run \"{run}\": parameter \"{name}\" is no name", name = name.escape_debug())]
    ParameterName {
        /// Path of the run.
        run: String,
        /// Name of the parameter.
        name: String,
    },
    /// A parameter has the name of a key that every run has.
    #[error(
        "run \"{run}\": parameter \"{name}\" has a key of its own: use speed or mass",
        name = name.escape_debug()
    )]
    ParameterTaken {
        /// Path of the run.
        run: String,
        /// Name of the parameter.
        name: String,
    },
    /// A parameter is infinite or no number.
    #[error("run \"{run}\": parameter \"{name}\" is not finite", name = name.escape_debug())]
    ParameterNotFinite {
        /// Path of the run.
        run: String,
        /// Name of the parameter.
        name: String,
    },
    /// The name of what comes from files.
    #[error(
        "study.name = \"{IMPORTED}\" is the name of the curves that crumple db add takes from files: give the study another"
    )]
    NameOfImported,
    /// A name is empty or blank.
    #[error("{key} = \"{name}\" is no name", name = name.escape_debug())]
    NoName {
        /// The key that gives it.
        key: &'static str,
        /// The name.
        name: String,
    },
    /// A name has characters that stand for something else in the database.
    #[error(
        "{key} = \"{name}\" may not contain \"/\" or control characters",
        name = name.escape_debug()
    )]
    NameCharacters {
        /// The key that gives it.
        key: &'static str,
        /// The name.
        name: String,
    },
}

/// What does not fit, and the key that tells so.
type Wrong = (InvalidStudy, KeyPath);

pub(super) fn check(manifest: &Manifest) -> Result<(), Wrong> {
    let Head { name, group, kind, half_model, .. } = &manifest.study;
    let of_name = || KeyPath::of("study.name");
    check_name("study.name", name, true).map_err(|wrong| (wrong, of_name()))?;
    // A build removes the cases of its study that it does not know.
    if name == IMPORTED {
        return Err((InvalidStudy::NameOfImported, of_name()));
    }
    check_name("study.group", group, false).map_err(|wrong| (wrong, KeyPath::of("study.group")))?;
    let minus_node = manifest.recipe.deflection.minus_node.is_some();
    let half = || KeyPath::of("study.half_model");
    match (kind, half_model, minus_node) {
        (StudyKind::Pair, false, false) => {
            return Err((InvalidStudy::PairOfOne, KeyPath::of("study.kind")));
        }
        (StudyKind::Pair, true, true) => return Err((InvalidStudy::DoublyWhole, half())),
        (StudyKind::Wall, true, _) => return Err((InvalidStudy::HalfWall, half())),
        _ => {}
    }
    if manifest.run.is_empty() {
        return Err((InvalidStudy::NoRun, KeyPath::of("run")));
    }
    check_contact(&manifest.recipe)?;
    let mut names = HashSet::new();
    for (k, run) in manifest.run.iter().enumerate() {
        let of_run = KeyPath::of("run").item(k);
        check_run(run, *kind, &of_run)?;
        let name = run.case_name();
        if !names.insert(name.clone()) {
            return Err((InvalidStudy::SameName { name }, name_key(run, &of_run)));
        }
    }
    Ok(())
}

fn check_contact(recipe: &Recipe) -> Result<(), Wrong> {
    let wrong = match (&recipe.contact, &recipe.force) {
        (Some(ForceSource::Body { .. }), _) => InvalidStudy::ContactOfBody,
        (Some(_), ForceSource::Contact { .. }) => InvalidStudy::ContactBesideContact,
        _ => return Ok(()),
    };
    Err((wrong, KeyPath::of("recipe.contact")))
}

/// The key that gives a run's case its name.
fn name_key(entry: &RunEntry, of_run: &KeyPath) -> KeyPath {
    of_run.clone().key(if entry.name.is_some() { "name" } else { "path" })
}

fn check_run(entry: &RunEntry, kind: StudyKind, of_run: &KeyPath) -> Result<(), Wrong> {
    check_parameters(entry, of_run)?;
    let run = || entry.path.clone();
    let key = |name| of_run.clone().key(name);
    if entry.contact_time.is_some() && entry.gap.is_some() {
        return Err((InvalidStudy::TwoContacts { run: run() }, key("gap").itself()));
    }
    if entry.path.trim().is_empty() {
        return Err((InvalidStudy::EmptyPath, key("path")));
    }
    if kind == StudyKind::Wall && entry.other_mass.is_some() {
        return Err((InvalidStudy::OtherMassOfWall { run: run() }, key("other_mass").itself()));
    }
    check_name("run.name", &entry.case_name(), false)
        .map_err(|_| (InvalidStudy::NoCaseName { run: run() }, name_key(entry, of_run)))
}

/// Names that the models use themselves.
const TAKEN: [&str; 4] = ["speed_m_per_s", "deflection_m", "mass_kg", "other_mass_kg"];

fn check_parameters(entry: &RunEntry, of_run: &KeyPath) -> Result<(), Wrong> {
    for (name, value) in &entry.parameters {
        let (run, key) = (entry.path.clone(), name.clone());
        let at = of_run.clone().key("parameters").key(name);
        if name.trim().is_empty() || name.contains(|c: char| c.is_control() || c == '=') {
            return Err((InvalidStudy::ParameterName { run, name: key }, at.itself()));
        }
        if TAKEN.contains(&name.as_str()) {
            return Err((InvalidStudy::ParameterTaken { run, name: key }, at.itself()));
        }
        if matches!(value, Parameter::Number(v) if !v.is_finite()) {
            return Err((InvalidStudy::ParameterNotFinite { run, name: key }, at));
        }
    }
    Ok(())
}

/// Names stand in files, tables and HDF5 paths.
fn check_name(key: &'static str, name: &str, slash: bool) -> Result<(), InvalidStudy> {
    if name.trim().is_empty() || name == "." || name == ".." {
        return Err(InvalidStudy::NoName { key, name: name.into() });
    }
    if name.contains(|c: char| c.is_control() || (c == '/' && !slash)) {
        return Err(InvalidStudy::NameCharacters { key, name: name.into() });
    }
    Ok(())
}
