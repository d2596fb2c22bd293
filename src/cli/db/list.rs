//! `crumple db ls`: groups and cases by speed; what lists and documents say of one case.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::mem::ManuallyDrop;
use std::path::PathBuf;

use serde::Serialize;

use super::{Chosen, CommandResult, Failure, GlobalOptions, output};
use crate::cli::train::stopped_mass_line;
use crate::curve::{Case, Masses, group as siblings};
use crate::database::Database;
use crate::dataset::of_one_kind;
use crate::table::{Table, TableOf};
use crate::unit::{Shown, km_per_h};

/// A database, and which of its cases.
#[derive(clap::Args)]
pub(super) struct Args {
    /// Curve database
    database: PathBuf,
    #[command(flatten)]
    chosen: Chosen,
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    // Given back with the process: to free thousands of cases piece by piece takes a tenth of the time.
    let database = ManuallyDrop::new(Database::read(&args.database)?);
    let selection = args.chosen.selection();
    // A database without cases has nothing to list, which is not an error.
    let cases: Vec<&Case> = if selection.is_all() {
        database.all().collect()
    } else {
        selection.find(&args.database, &database)?
    };
    let mut groups: BTreeMap<&str, Vec<&Case>> = BTreeMap::new();
    for case in cases {
        groups.entry(&case.id.group).or_default().push(case);
    }
    let mixed = |g: &&str| of_one_kind(database.cases(g)).err().map(|e| format!("group {g}: {e}"));
    let mut warnings: Vec<String> = groups.keys().filter_map(mixed).collect();
    let mut of_cases = Vec::new();
    for (group, cases) in &groups {
        let is_listed = |name: &String| cases.iter().any(|case| case.id.name == *name);
        let beside = siblings::remarks(database.cases(group)).into_iter();
        let beside = beside.filter(|(name, ..)| is_listed(name));
        warnings.extend(beside.map(|(name, _, words)| format!("{group}/{name}: {words}")));
        // Warnings of the builds, which the rows of the document have.
        for case in cases {
            let own = case.quality.warnings.iter();
            of_cases.extend(own.map(|warning| format!("{group}/{}: {warning}", case.id.name)));
        }
    }
    let outcome = options.warn_all(warnings.iter().chain(&of_cases));
    let stopped_mass = database.stopped_masses(&args.database, groups.keys().copied());
    // A text has tables instead.
    let rows = groups.iter().filter(|_| options.json).map(|(group, cases)| {
        (*group, cases.iter().map(|case| case_row(case)).collect::<Vec<_>>())
    });
    let document = document! {
        groups: rows.collect::<BTreeMap<_, _>>(),
        stopped_mass if_any: &stopped_mass,
        warnings if_any: &warnings,
    };
    options.show(&document, |out| {
        groups.iter().try_for_each(|(group, cases)| {
            print_group(out, group, cases)?;
            if let Some(stopped) = stopped_mass.get(*group) {
                let of = &database.cases(group)[0].conditions;
                let moved_kg = of.masses.effective_kg();
                writeln!(out, "{}", stopped_mass_line(stopped, of.speed.kind, moved_kg))?;
            }
            writeln!(out)
        })
    })?;
    Ok(outcome)
}

/// A table of cases under the name of their group, with their tags if one has any.
pub(super) fn print_group(out: &mut dyn Write, group: &str, cases: &[&Case]) -> io::Result<()> {
    let named = Table::of(cases).column(group, |case| &case.id.name);
    let mut table = case_columns(named, |case| Some(case));
    if cases.iter().any(|case| !case.provenance.tags.is_empty()) {
        table = table.column("tags", |case| case.provenance.tags.join(", "));
    }
    output::table(out, table)
}

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
    let masses = |c: &Case| {
        let Masses { body_kg, other_kg } = c.conditions.masses;
        let other = other_kg.filter(|other| *other != body_kg);
        mass.text(body_kg) + &other.map_or(String::new(), |kg| format!(" on {}", mass.text(kg)))
    };
    type Cell<'a> = &'a dyn Fn(&Case) -> String;
    let columns: [(&str, Cell<'_>); 6] = [
        ("speed", &speed),
        ("mass", &masses),
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
    let recipe: serde_json::Value = provenance.recipe.parse()?;
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
