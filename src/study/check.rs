//! Checks of a study manifest across several keys.

use std::collections::HashSet;

use super::manifest::{Manifest, RunEntry, StudyHeader, StudyKind};
use crate::curve::Parameter;
use crate::curve::from_table::IMPORTED;
use crate::curve::recipe::{ForceSource, Recipe};
use crate::error::{Error, KeyPath, error};

pub(super) fn check(manifest: &Manifest) -> Result<(), Error> {
    let StudyHeader { name, group, kind, half_model, .. } = &manifest.study;
    check_name("study.name", name, true)?;
    // A build removes the cases of its study that it does not know.
    if name == IMPORTED {
        return Err(error!(
            Study at "study.name",
            "study.name = \"{IMPORTED}\" is the name of the curves that crumple db add takes from files: give the study another"
        ));
    }
    check_name("study.group", group, false)?;
    let minus_node = manifest.recipe.deflection.minus_node.is_some();
    match (kind, half_model, minus_node) {
        (StudyKind::Pair, false, false) => {
            return Err(error!(
                Study at "study.kind",
                "a pair needs the other body: deflection.minus_node = …, or half_model = true in [study] for one body against its symmetry plane"
            ));
        }
        (StudyKind::Pair, true, true) => {
            return Err(error!(
                Study at "study.half_model",
                "half_model = true doubles the deflection, which minus_node already completes: keep one of them"
            ));
        }
        (StudyKind::Wall, true, _) => {
            return Err(error!(
                Study at "study.half_model",
                "half_model = true needs kind = \"pair\": a wall run has no symmetry plane"
            ));
        }
        _ => {}
    }
    if manifest.run.is_empty() {
        return Err(error!(Study at "run", "there is no [[run]]"));
    }
    check_contact(&manifest.recipe)?;
    let mut names = HashSet::new();
    for (k, run) in manifest.run.iter().enumerate() {
        let of_run = KeyPath::of("run").item(k);
        check_run(run, *kind).map_err(|error| error.inside(of_run.clone()))?;
        let name = run.case_name();
        if !names.insert(name.clone()) {
            return Err(error!(
                Study at name_key(run),
                "two runs are named \"{name}\": give one of them a name = …"
            )
            .inside(of_run));
        }
    }
    Ok(())
}

fn check_contact(recipe: &Recipe) -> Result<(), Error> {
    if let Some(share) = recipe.contact_threshold.filter(|share| !(*share > 0.0 && *share < 1.0)) {
        return Err(error!(
            Study at "recipe.contact_threshold",
            "recipe.contact_threshold = {share} is not a fraction of the peak force: write a number above 0 and below 1, such as 0.005"
        ));
    }
    match (&recipe.contact, &recipe.force) {
        (Some(ForceSource::Body { .. }), _) => Err(error!(
            Study at "recipe.contact",
            "recipe.contact must be a contact force (id = … of a wall or contact): a body slows down after the first touch"
        )),
        (Some(_), ForceSource::Contact { .. }) => Err(error!(
            Study at "recipe.contact",
            "recipe.contact is for a body force: contact is found in recipe.force itself"
        )),
        _ => Ok(()),
    }
}

fn name_key(entry: &RunEntry) -> &'static str {
    if entry.name.is_some() { "name" } else { "path" }
}

/// Checks a run; keys are those of its table.
fn check_run(entry: &RunEntry, kind: StudyKind) -> Result<(), Error> {
    check_parameters(entry)?;
    let run = &entry.path;
    if entry.contact_time.is_some() && entry.gap.is_some() {
        return Err(error!(
            Study at "gap",
            "run \"{run}\": contact_time and gap both say when contact begins: keep one of them"
        )
        .itself());
    }
    if run.trim().is_empty() {
        return Err(error!(Study at "path", "a [[run]] has an empty path"));
    }
    if kind == StudyKind::Wall && entry.other_mass.is_some() {
        return Err(error!(
            Study at "other_mass",
            "run \"{run}\": other_mass needs kind = \"pair\""
        )
        .itself());
    }
    check_name("run.name", &entry.case_name(), false).map_err(|_| {
        let run = run.escape_debug();
        error!(
            Study at name_key(entry),
            "run \"{run}\" gives no name for its case: add name = \"…\" to it"
        )
    })
}

/// Names that the models use themselves.
const TAKEN: [&str; 4] = ["speed_m_per_s", "deflection_m", "mass_kg", "other_mass_kg"];

fn check_parameters(entry: &RunEntry) -> Result<(), Error> {
    for (name, value) in &entry.parameters {
        let at = KeyPath::of("parameters").key(name);
        let of = format!("run \"{}\": parameter \"{}\"", entry.path, name.escape_debug());
        if name.trim().is_empty() || name.contains(|c: char| c.is_control() || c == '=') {
            return Err(error!(Study, "{of} is not a name").at(at.itself()));
        }
        if TAKEN.contains(&name.as_str()) {
            return Err(
                error!(Study, "{of} has a key of its own: use speed or mass").at(at.itself())
            );
        }
        if matches!(value, Parameter::Number(v) if !v.is_finite()) {
            return Err(error!(Study, "{of} is not finite").at(at));
        }
    }
    Ok(())
}

/// Longest name, in bytes, as databases take it.
const MAX_NAME: usize = 200;

/// Names appear in files, tables and HDF5 paths.
fn check_name(key: &str, name: &str, slash: bool) -> Result<(), Error> {
    let shown = name.escape_debug();
    if name.trim().is_empty() || name == "." || name == ".." {
        return Err(error!(Study at key, "{key} = \"{shown}\" is not a name"));
    }
    if name.len() > MAX_NAME {
        let (begin, bytes) = (name.chars().take(20).collect::<String>(), name.len());
        return Err(error!(
            Study at key,
            "{key} = \"{}…\" has {bytes} bytes: expected at most {MAX_NAME}",
            begin.escape_debug()
        ));
    }
    if name.contains(|c: char| c.is_control() || (c == '/' && !slash)) {
        return Err(error!(
            Study at key,
            "{key} = \"{shown}\" may not contain \"/\" or control characters"
        ));
    }
    Ok(())
}
