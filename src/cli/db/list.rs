//! `crumple db ls`: groups and cases by speed.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::PathBuf;

use crate::curve::{Case, StoppedMass, group as siblings};
use crate::database::Database;
use crate::dataset::of_one_kind;
use serde::Serialize;

use super::chosen::Chosen;
use super::row::CaseRow;
use super::{CommandResult, GlobalOptions, Outcome, output};
use crate::cli::train::stopped_mass_line;

/// A database, and which of its cases.
#[derive(clap::Args)]
pub(super) struct Args {
    /// Curve database
    database: PathBuf,
    #[command(flatten)]
    chosen: Chosen,
}

#[derive(Serialize)]
pub(super) struct Groups<T> {
    pub groups: BTreeMap<String, Vec<T>>,
    /// The mass that the crush zone of a group stops, where its cases give one.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub stopped_mass: BTreeMap<String, StoppedMass>,
    /// What no command can use a group for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
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
    let mut groups: BTreeMap<String, Vec<CaseRow>> = BTreeMap::new();
    for case in cases {
        groups.entry(case.id.group.clone()).or_default().push(CaseRow::of(case));
    }
    let mixed =
        |g: &String| of_one_kind(database.cases(g)).err().map(|e| format!("group {g}: {e}"));
    let mut warnings: Vec<String> = groups.keys().filter_map(mixed).collect();
    let mut of_cases = Vec::new();
    for (group, rows) in &groups {
        let is_listed = |name: &String| rows.iter().any(|row| row.name == *name);
        let beside = siblings::remarks(database.cases(group)).into_iter();
        let beside = beside.filter(|(name, ..)| is_listed(name));
        warnings.extend(beside.map(|(name, _, words)| format!("{group}/{name}: {words}")));
        // Warnings of the builds, which the rows of the document have.
        let of_row = |row: &CaseRow| {
            let name = row.name.clone();
            row.warnings.clone().into_iter().map(move |w| format!("{group}/{name}: {w}"))
        };
        of_cases.extend(rows.iter().flat_map(of_row));
    }
    for warning in warnings.iter().chain(&of_cases) {
        options.warn(warning);
    }
    let of_group = |group: &String| Some((group.clone(), database.stopped_mass(group)?));
    let stopped_mass: BTreeMap<String, StoppedMass> = groups.keys().filter_map(of_group).collect();
    let outcome =
        if warnings.is_empty() && of_cases.is_empty() { Outcome::Clean } else { Outcome::Warned };
    if options.json {
        output::print_json(&Groups { groups, stopped_mass, warnings })?;
    } else {
        options.print(|out| {
            groups.iter().try_for_each(|(group, rows)| {
                print_group(out, group, rows)?;
                if let Some(stopped) = stopped_mass.get(group) {
                    let kind = database.cases(group)[0].conditions.speed.kind;
                    writeln!(out, "{}", stopped_mass_line(stopped, kind))?;
                }
                writeln!(out)
            })
        })?;
    }
    Ok(outcome)
}

/// A table of cases under the name of their group, with their tags if one has any.
pub(super) fn print_group(out: &mut dyn Write, group: &str, rows: &[CaseRow]) -> io::Result<()> {
    let is_tagged = rows.iter().any(|row| !row.tags.is_empty());
    let mut heading: Vec<&str> = [group].into_iter().chain(CaseRow::HEADING).collect();
    heading.extend(is_tagged.then_some("tags"));
    let units = CaseRow::units(rows.iter());
    let cells = |row: &CaseRow| {
        let mut cells: Vec<String> =
            [row.name.clone()].into_iter().chain(row.cells(units)).collect();
        cells.extend(is_tagged.then(|| row.tags.join(", ")));
        cells
    };
    output::table(out, &heading, &rows.iter().map(cells).collect::<Vec<_>>())
}
