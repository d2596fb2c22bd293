//! From a file to its case: reading, metadata, extraction, provenance.

use serde::Serialize;

use super::metadata::StatedAndFound;
use super::{Item, Settings};
use crate::curve::from_table::{IMPORTED, from_table};
use crate::curve::recipe::{Filter, Sampling};
use crate::curve::{
    Case, CaseId, Conditions, ForceKind, Impact, Parameter, Provenance, Quality, SourceFile, Table,
};
use crate::database::names;
use crate::error::{Error, ErrorCode, error};
use crate::file::absolute;
use crate::formats::read::{self, ReadCurve};
use crate::unit::{SpeedKind, UnitSystem};

pub(super) fn of(item: &Item, settings: &Settings, group: Option<&Case>) -> Result<Case, Error> {
    check_name(item, "group", &settings.group)?;
    let (curve, reader) = read::read(&item.path, &settings.read)?;
    let name = case_name(item)?;
    check_name(item, "case", &name)?;
    let (notes, warnings) = (Vec::new(), Vec::new());
    let mut both = StatedAndFound { item, settings, facts: &curve.facts, notes, warnings };
    let (speed, masses, force_kind) = both.impact(group)?;
    let stiffness = settings.unloading_stiffness_n_per_m;
    let impact = Impact {
        force_kind,
        speed,
        masses,
        unloading_stiffness_n_per_m: stiffness.or(curve.facts.unloading_stiffness_n_per_m),
        // One that was given belongs to the force of the curve.
        body_unloading_stiffness_n_per_m: match stiffness {
            Some(_) => None,
            None => curve.facts.body_unloading_stiffness_n_per_m,
        },
        units: curve.units.unwrap_or(UnitSystem::SI),
        accept_energy: settings.accept_energy,
    };
    let table = Table {
        deflection_m: &curve.deflection_m,
        force_n: &curve.force_n,
        time_s: curve.time_s.as_deref(),
        body_force_n: curve.body_force_n.as_deref(),
    };
    let (curves, quality) = from_table(&table, &impact)
        .map_err(|error| error.coded(ErrorCode::Import).of(item.path.display()))?;
    let recipe = recipe(item, settings, &curve, reader.name, &impact);
    let mut hash = blake3::Hasher::new();
    hash.update(recipe.as_bytes());
    for file in &curve.files {
        hash.update(file.blake3.as_bytes());
    }
    let sources = curve.files.iter().map(|file| SourceFile {
        path: file.path.display().to_string(),
        absolute_path: Some(absolute(&file.path)),
        size_bytes: file.size_bytes,
        blake3: file.blake3.clone(),
        format: reader.name.into(),
        solver: None,
        version: None,
        title: curve.title.clone(),
        problems: 0,
    });
    let notes = curve.notes.iter().cloned().chain(both.notes).chain(quality.notes);
    Ok(Case {
        id: CaseId { study: IMPORTED.into(), group: settings.group.clone(), name },
        conditions: Conditions { speed, masses, parameters: settings.parameters.clone() },
        curves,
        quality: Quality {
            audit: quality.audit,
            notes: notes.collect(),
            warnings: both.warnings.into_iter().chain(quality.warnings).collect(),
        },
        provenance: Provenance {
            fingerprint: hash.finalize().to_hex().to_string(),
            recipe,
            sources: sources.collect(),
            ..Provenance::default()
        },
    })
}

/// Everything besides the file that determines the case's numbers.
#[derive(Serialize)]
struct Recipe<'a> {
    study: &'a str,
    /// Of the file, if they are one system.
    units: Option<UnitSystem>,
    kind: SpeedKind,
    imported: Imported<'a>,
}

#[derive(Serialize)]
struct Imported<'a> {
    path: String,
    format: &'a str,
    curve: Option<&'a str>,
    /// Whether the motion is that of the file's times.
    has_times: bool,
    /// Whether the motion was made of the case's own force, which then moves the body, too.
    moves_by_its_force: bool,
    force: ForceKind,
    speed_m_per_s: f64,
    mass_kg: f64,
    other_mass_kg: Option<f64>,
    #[serde(rename = "unloading_stiffness_N_per_m")]
    unloading_stiffness_n_per_m: Option<f64>,
    parameters: &'a std::collections::BTreeMap<String, Parameter>,
    accept_energy: bool,
    filter: Filter,
    sampling_interval_ms: f64,
}

fn recipe(
    item: &Item,
    settings: &Settings,
    curve: &ReadCurve,
    format: &str,
    impact: &Impact,
) -> String {
    let Impact { speed, masses, force_kind, .. } = *impact;
    let recipe = Recipe {
        study: IMPORTED,
        units: curve.units,
        kind: speed.kind,
        imported: Imported {
            path: item.path.display().to_string(),
            format,
            curve: settings.read.curve.as_deref(),
            has_times: curve.time_s.is_some(),
            moves_by_its_force: curve.time_s.is_none() && curve.body_force_n.is_none(),
            force: force_kind,
            speed_m_per_s: speed.m_per_s,
            mass_kg: masses.body_kg,
            other_mass_kg: masses.other_kg,
            unloading_stiffness_n_per_m: impact.unloading_stiffness_n_per_m,
            parameters: &settings.parameters,
            accept_energy: settings.accept_energy,
            filter: Filter::None,
            sampling_interval_ms: Sampling::default().interval_s * 1e3,
        },
    };
    // A structure of texts and finite numbers is always JSON.
    serde_json::to_string(&recipe).unwrap_or_default()
}

/// The name that was given, else the file's without its extension.
fn case_name(item: &Item) -> Result<String, Error> {
    if let Some(name) = &item.case {
        return Ok(name.clone());
    }
    let stem = if item.path.is_dir() { item.path.file_name() } else { item.path.file_stem() };
    let name = stem.map(|stem| stem.to_string_lossy().into_owned());
    name.ok_or_else(|| {
        error!(
            Import,
            "{}: \"\" cannot be the name of a case: give one with --case",
            item.path.display()
        )
    })
}

fn check_name(item: &Item, what: &'static str, name: &str) -> Result<(), Error> {
    names::check(name).map_err(|why| {
        error!(
            Import,
            "{path}: \"{name}\" cannot be the name of a {what}: {why}",
            name = name.escape_debug(),
            path = item.path.display()
        )
    })
}
