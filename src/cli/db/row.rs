//! What lists and documents say of one case.

use crate::curve::Case;
use crate::table::TableOf;
use crate::unit::{Shown, km_per_h};
use serde::Serialize;

use super::Failure;

/// Adds the columns of a table of cases; an item without one has dashes.
pub(crate) fn case_columns<'c, T>(
    table: TableOf<T>,
    case: impl Fn(&T) -> Option<&'c Case>,
) -> TableOf<T> {
    let largest = |value: fn(&Case) -> f64| {
        table.items().iter().filter_map(&case).map(value).fold(0.0, f64::max)
    };
    let mass = Shown::mass(largest(|c| c.conditions.masses.body_kg));
    let force = Shown::force(largest(Case::peak_force_n));
    let stiffness =
        Shown::stiffness(largest(|c| c.curves.unloading_stiffness_n_per_m.unwrap_or(0.0)));
    let speed = |c: &Case| {
        let speed = &c.conditions.speed;
        format!("{} ({})", km_per_h(speed.m_per_s), speed.kind.name())
    };
    let crush = |c: &Case| {
        let truncated = if c.is_truncated() { " (truncated)" } else { "" };
        format!("{:.4} m{truncated}", c.max_deflection_m())
    };
    type Cell<'a> = &'a dyn Fn(&Case) -> String;
    let columns: [(&str, Cell<'_>); 6] = [
        ("speed", &speed),
        ("mass", &|c| mass.text(c.conditions.masses.body_kg)),
        ("peak force", &|c| force.text(c.peak_force_n())),
        ("max crush", &crush),
        ("W/E", &|c| format!("{:.4}", c.quality.audit.ratio())),
        ("unloading", &|c| {
            c.curves.unloading_stiffness_n_per_m.map_or("-".into(), |k| stiffness.text(k))
        }),
    ];
    columns.into_iter().fold(table, |table, (name, cell)| {
        table.column(name, |item| case(item).map_or("-".into(), cell))
    })
}

/// What a list says of one case.
pub(crate) fn case_row(case: &Case) -> impl Serialize {
    let (conditions, curves, audit) = (&case.conditions, &case.curves, &case.quality.audit);
    document! {
        name: &case.id.name,
        speed_m_per_s: conditions.speed.m_per_s,
        speed_kind: conditions.speed.kind,
        mass_kg: conditions.masses.body_kg,
        other_mass_kg if_any: conditions.masses.other_kg,
        parameters if_any: &conditions.parameters,
        force_kind: curves.force_kind,
        states: curves.sampled.time_s().len(),
        peak_force_N: case.peak_force_n(),
        max_deflection_m: case.max_deflection_m(),
        loading_end: case.loading_end(),
        truncated: case.is_truncated(),
        unloading_stiffness_N_per_m: curves.unloading_stiffness_n_per_m,
        work_J: audit.work_j,
        kinetic_energy_J: audit.kinetic_j,
        work_over_energy: audit.ratio(),
        contact_time_s: curves.contact_time_s,
        notes: &case.quality.notes,
        warnings: &case.quality.warnings,
        tags if_any: &case.provenance.tags,
        user_notes if_any: &case.provenance.user_notes,
    }
}

/// Everything of one case.
pub(super) fn full_case(case: &Case) -> Result<impl Serialize, Failure> {
    let (sampled, original) = (&case.curves.sampled, &case.curves.original);
    let provenance = &case.provenance;
    let recipe: serde_json::Value = serde_json::from_str(&provenance.recipe)?;
    Ok(document! {
        #[serde(flatten)]
        row: case_row(case),
        study: &case.id.study,
        time_s: sampled.time_s(),
        deflection_m: sampled.deflection_m(),
        force_N: sampled.force_n(),
        closing_speed_m_per_s: &case.curves.closing_speed_m_per_s,
        original: document! {
            time_s: original.time_s(),
            deflection_m: original.deflection_m(),
            force_N: original.force_n(),
        },
        recipe: recipe,
        sources: &provenance.sources,
        built_utc if_any: &provenance.built_utc,
        origin if_any: &provenance.origin,
        fingerprint: &provenance.fingerprint,
    })
}
