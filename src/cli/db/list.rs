//! `crumple db ls`: groups and cases by speed.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::PathBuf;

use crumple::curve::Case;
use crumple::database::Database;
use crumple::dataset::of_one_kind;
use serde::Serialize;

use super::chosen::Chosen;
use super::row::CaseRow;
use super::{CommandResult, GlobalOptions, Outcome, output};

/// A database, and which of its cases.
#[derive(clap::Args)]
pub struct Args {
    /// Curve database
    database: PathBuf,
    #[command(flatten)]
    chosen: Chosen,
}

#[derive(Serialize)]
pub struct Groups<T> {
    pub groups: BTreeMap<String, Vec<T>>,
    /// What no command can use a group for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
}

pub fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let database = Database::read(&args.database)?;
    let selection = args.chosen.selection();
    // A database without cases has nothing to list, which is no error.
    let cases: Vec<&Case> = match selection.is_all() {
        true => database.all().collect(),
        false => selection.find(&args.database, &database)?,
    };
    let mut groups: BTreeMap<String, Vec<CaseRow>> = BTreeMap::new();
    for case in cases {
        groups.entry(case.group.clone()).or_default().push(CaseRow::of(case));
    }
    let mixed =
        |g: &String| of_one_kind(database.cases(g)).err().map(|e| format!("group {g}: {e}"));
    let warnings: Vec<String> = groups.keys().filter_map(mixed).collect();
    for warning in &warnings {
        options.warn(warning);
    }
    let outcome = if warnings.is_empty() { Outcome::Clean } else { Outcome::Warned };
    if options.json {
        output::print_json(&Groups { groups, warnings })?;
    } else {
        output::print(|out| {
            groups.iter().try_for_each(|(group, rows)| {
                print_group(out, group, rows)?;
                writeln!(out)
            })
        })?;
    }
    Ok(outcome)
}

/// A table of cases under the name of their group, with their tags if one has any.
pub fn print_group(out: &mut dyn Write, group: &str, rows: &[CaseRow]) -> io::Result<()> {
    let is_tagged = rows.iter().any(|row| !row.tags.is_empty());
    let mut heading: Vec<&str> = [group].into_iter().chain(CaseRow::HEADING).collect();
    heading.extend(is_tagged.then_some("tags"));
    let cells = |row: &CaseRow| {
        let mut cells: Vec<String> = [row.name.clone()].into_iter().chain(row.cells()).collect();
        cells.extend(is_tagged.then(|| row.tags.join(", ")));
        cells
    };
    output::table(out, &heading, &rows.iter().map(cells).collect::<Vec<_>>())
}
