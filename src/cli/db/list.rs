//! `crumple db ls`: groups and cases by speed.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::PathBuf;

use crate::curve::{Case, StoppedMass, group as siblings};
use crate::database::Database;
use crate::dataset::of_one_kind;
use crate::table::Table;

use super::chosen::Chosen;
use super::row::{case_columns, case_row};
use super::{CommandResult, GlobalOptions, output};
use crate::cli::train::stopped_mass_line;

/// A database, and which of its cases.
#[derive(clap::Args)]
pub(super) struct Args {
    /// Curve database
    database: PathBuf,
    #[command(flatten)]
    chosen: Chosen,
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let database = Database::read(&args.database)?;
    let selection = args.chosen.selection();
    // A database without cases has nothing to list, which is not error.
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
    let of_group = |group: &&'_ str| Some((group.to_string(), database.stopped_mass(group)?));
    let stopped_mass: BTreeMap<String, StoppedMass> = groups.keys().filter_map(of_group).collect();
    let rows = groups.iter().map(|(group, cases)| {
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
