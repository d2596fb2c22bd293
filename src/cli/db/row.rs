//! One line of a list of cases, and everything of one case.

use std::collections::BTreeMap;

use crate::curve::{Case, ForceKind, Origin, Parameter, SourceFile};
use crate::unit::{Shown, SpeedKind, km_per_h};
use serde::Serialize;

use super::Failure;

/// What a list says of one case.
#[derive(Serialize)]
pub(crate) struct CaseRow {
    pub name: String,
    speed_m_per_s: f64,
    speed_kind: SpeedKind,
    mass_kg: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    other_mass_kg: Option<f64>,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    parameters: BTreeMap<String, Parameter>,
    force_kind: ForceKind,
    states: usize,
    #[serde(rename = "peak_force_N")]
    peak_force_n: f64,
    max_deflection_m: f64,
    loading_end: usize,
    truncated: bool,
    #[serde(rename = "unloading_stiffness_N_per_m")]
    unloading_stiffness_n_per_m: Option<f64>,
    #[serde(rename = "work_J")]
    work_j: f64,
    #[serde(rename = "kinetic_energy_J")]
    kinetic_energy_j: f64,
    work_over_energy: f64,
    contact_time_s: f64,
    pub notes: Vec<String>,
    pub warnings: Vec<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tags: Vec<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub user_notes: Vec<String>,
}

impl CaseRow {
    pub(crate) const HEADING: [&str; 6] =
        ["speed", "mass", "peak force", "max crush", "W/E", "unloading"];

    pub(crate) fn of(case: &Case) -> Self {
        Self {
            name: case.id.name.clone(),
            speed_m_per_s: case.conditions.speed.m_per_s,
            speed_kind: case.conditions.speed.kind,
            mass_kg: case.conditions.masses.body_kg,
            parameters: case.conditions.parameters.clone(),
            other_mass_kg: case.conditions.masses.other_kg,
            force_kind: case.curves.force_kind,
            states: case.curves.sampled.time_s().len(),
            peak_force_n: case.peak_force_n(),
            max_deflection_m: case.max_deflection_m(),
            loading_end: case.loading_end(),
            truncated: case.is_truncated(),
            unloading_stiffness_n_per_m: case.curves.unloading_stiffness_n_per_m,
            work_j: case.quality.audit.work_j,
            kinetic_energy_j: case.quality.audit.kinetic_j,
            work_over_energy: case.quality.audit.ratio(),
            contact_time_s: case.curves.contact_time_s,
            notes: case.quality.notes.clone(),
            warnings: case.quality.warnings.clone(),
            tags: case.provenance.tags.clone(),
            user_notes: case.provenance.user_notes.clone(),
        }
    }

    /// The units of mass, force and stiffness in a table of these rows.
    pub(crate) fn units<'a>(rows: impl Iterator<Item = &'a Self>) -> [Shown; 3] {
        let mut largest = [0.0_f64; 3];
        for row in rows {
            let stiffness = row.unloading_stiffness_n_per_m.unwrap_or(0.0);
            let values = [row.mass_kg, row.peak_force_n, stiffness];
            largest.iter_mut().zip(values).for_each(|(most, value)| *most = most.max(value));
        }
        let [mass_kg, force_n, stiffness_n_per_m] = largest;
        [Shown::mass(mass_kg), Shown::force(force_n), Shown::stiffness(stiffness_n_per_m)]
    }

    pub(crate) fn cells(&self, [mass, force, stiffness]: [Shown; 3]) -> Vec<String> {
        vec![
            format!("{} ({})", km_per_h(self.speed_m_per_s), self.speed_kind.name()),
            mass.text(self.mass_kg),
            force.text(self.peak_force_n),
            format!(
                "{:.4} m{}",
                self.max_deflection_m,
                if self.truncated { " (truncated)" } else { "" }
            ),
            format!("{:.4}", self.work_over_energy),
            self.unloading_stiffness_n_per_m.map_or("-".into(), |k| stiffness.text(k)),
        ]
    }
}

/// Everything of one case.
#[derive(Serialize)]
pub(super) struct FullCase<'a> {
    #[serde(flatten)]
    row: CaseRow,
    study: &'a str,
    time_s: &'a [f64],
    deflection_m: &'a [f64],
    #[serde(rename = "force_N")]
    force_n: &'a [f64],
    closing_speed_m_per_s: &'a [f64],
    original: Columns<'a>,
    recipe: serde_json::Value,
    sources: &'a [SourceFile],
    #[serde(skip_serializing_if = "Option::is_none")]
    built_utc: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    origin: Option<&'a Origin>,
    fingerprint: &'a str,
}

#[derive(Serialize)]
struct Columns<'a> {
    time_s: &'a [f64],
    deflection_m: &'a [f64],
    #[serde(rename = "force_N")]
    force_n: &'a [f64],
}

impl<'a> FullCase<'a> {
    pub(super) fn of(case: &'a Case) -> Result<Self, Failure> {
        Ok(Self {
            row: CaseRow::of(case),
            study: &case.id.study,
            time_s: case.curves.sampled.time_s(),
            deflection_m: case.curves.sampled.deflection_m(),
            force_n: case.curves.sampled.force_n(),
            closing_speed_m_per_s: &case.curves.closing_speed_m_per_s,
            original: Columns {
                time_s: case.curves.original.time_s(),
                deflection_m: case.curves.original.deflection_m(),
                force_n: case.curves.original.force_n(),
            },
            recipe: serde_json::from_str(&case.provenance.recipe)?,
            sources: &case.provenance.sources,
            built_utc: case.provenance.built_utc.as_deref(),
            origin: case.provenance.origin.as_ref(),
            fingerprint: &case.provenance.fingerprint,
        })
    }
}
