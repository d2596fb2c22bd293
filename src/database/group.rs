//! Attributes of a group: its cases in order, and the stopped mass of its crush zone, which follows from
//! them and is rewritten with each change.

use std::collections::HashMap;

use crate::curve::from_table::IMPORTED;
use crate::curve::{Case, ForceKind, StoppedMass};
use crate::dataset::TrainingSet;
use crate::hdf5::AttrValue;

/// Attribute of a group that lists its cases in order of speed.
pub(super) const CASES: &str = "cases";
const DEFLECTION: &str = "stopped_mass_deflection_m";
const STOPPED: &str = "stopped_mass_kg";
const RATE: &str = "stopped_mass_rate_kg_per_m";
const RESIDUAL: &str = "stopped_mass_residual_kg";
/// Every attribute that a group can have; others belong to other programs.
pub(super) const GROUP_ATTRIBUTES: [&str; 7] =
    [CASES, DEFLECTION, STOPPED, RATE, RESIDUAL, "NX_class", "default"];

/// The attributes of a group with these cases, in order of speed.
pub(super) fn attributes(name: &str, cases: &[Case]) -> Vec<(&'static str, AttrValue)> {
    let names = cases.iter().map(|case| case.id.name.clone()).collect();
    let mut all = vec![
        (CASES, AttrValue::VarLenStringArray(names)),
        ("NX_class", AttrValue::String("NXentry".into())),
    ];
    // The case that a tool draws which is asked for the group's picture.
    let last = cases.last();
    all.extend(last.map(|case| ("default", AttrValue::VarLenString(case.id.name.clone()))));
    if let Some(stopped) = stopped_mass(name, cases) {
        all.extend(of_stopped_mass(&stopped));
    }
    all
}

/// The mass that the crush zone of a group stops; `None` if it does not follow from its cases.
pub(super) fn stopped_mass(name: &str, cases: &[Case]) -> Option<StoppedMass> {
    let first = cases.first()?;
    // Looked at before anything is filtered: a group may have thousands of cases.
    let is_uniform = first.curves.force_kind == ForceKind::Contact
        && cases.iter().all(|c| c.conditions.parameters == first.conditions.parameters);
    let set = is_uniform.then(|| TrainingSet::new(name, cases).ok())??;
    set.stopped_mass().filter(StoppedMass::is_known)
}

fn of_stopped_mass(stopped: &StoppedMass) -> [(&'static str, AttrValue); 4] {
    let nodes = &stopped.deflection_m;
    // Slope of the stopped mass from each node to the next one; 0 from the last.
    let pairs = nodes.windows(2).zip(stopped.stopped_kg.windows(2));
    let rates = pairs.map(|(d, kg)| (kg[1] - kg[0]) / (d[1] - d[0])).chain([0.0]).collect();
    [
        (DEFLECTION, AttrValue::F64Array(nodes.clone())),
        (STOPPED, AttrValue::F64Array(stopped.stopped_kg.clone())),
        (RATE, AttrValue::F64Array(rates)),
        (RESIDUAL, AttrValue::F64(stopped.residual_kg)),
    ]
}

/// The stopped mass that is stored with a group of which these are the cases.
pub(super) fn stored_stopped_mass(
    found: &HashMap<String, AttrValue>,
    cases: &[Case],
) -> Option<StoppedMass> {
    let of = |name| {
        found.get(name).map(numbers).filter(|n| !n.is_empty() && n.iter().all(|x| x.is_finite()))
    };
    let (deflection_m, stopped_kg) = (of(DEFLECTION)?, of(STOPPED)?);
    let [residual_kg] = of(RESIDUAL)?[..] else { return None };
    let is_of_these = found.get(CASES)?.as_strings()?.iter().eq(cases.iter().map(|c| &c.id.name));
    let is_whole = deflection_m.len() == stopped_kg.len();
    // Earlier programs took one from motions that were made of their force.
    if cases.iter().any(|case| case.id.study == IMPORTED && case.moves_by_its_force()) {
        return None;
    }
    let stored = StoppedMass { deflection_m, stopped_kg, residual_kg };
    (is_of_these && is_whole && stored.is_known()).then_some(stored)
}

/// The first attribute of a stopped mass that does not follow from the cases, with what is wrong; a group
/// of an earlier version, which has none, differs in nothing.
pub(super) fn differs(
    found: &HashMap<String, AttrValue>,
    name: &str,
    cases: &[Case],
) -> Option<(&'static str, &'static str)> {
    if [DEFLECTION, STOPPED, RATE, RESIDUAL].iter().all(|name| !found.contains_key(*name)) {
        return None;
    }
    let expected = stopped_mass(name, cases).map(|stopped| of_stopped_mass(&stopped));
    let Some(expected) = expected else { return Some((STOPPED, "the cases give none")) };
    expected.into_iter().find_map(|(name, value)| match found.get(name) {
        None => Some((name, "it is missing")),
        Some(there) if !same_value(there, &value) => Some((name, "the cases give another")),
        Some(_) => None,
    })
}

/// Share of the largest number by which stored numbers may differ from what follows from the cases.
const LIKE: f64 = 1e-6;

fn same_value(a: &AttrValue, b: &AttrValue) -> bool {
    let (a, b) = (numbers(a), numbers(b));
    let scale = b.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| (a - b).abs() <= LIKE * scale)
}

fn numbers(value: &AttrValue) -> Vec<f64> {
    match value {
        AttrValue::F64(number) => vec![*number],
        AttrValue::F64Array(numbers) => numbers.clone(),
        _ => Vec::new(),
    }
}

/// Whether both hold equal numbers; texts always count as others.
pub(super) fn has_numbers_of(a: &AttrValue, b: &AttrValue) -> bool {
    !numbers(b).is_empty() && numbers(a) == numbers(b)
}
