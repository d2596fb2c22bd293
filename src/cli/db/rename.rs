//! `crumple db rm` and `rename`: cases removed, cases and groups renamed.

use std::path::PathBuf;

use crate::curate;
use serde::Serialize;

use super::chosen::Chosen;
use super::list::print_group;
use super::row::CaseRow;
use super::{CommandResult, GlobalOptions, Outcome, output};

/// A database, and which of its cases are removed.
#[derive(clap::Args)]
pub(super) struct RemoveArgs {
    /// Curve database
    database: PathBuf,
    #[command(flatten)]
    chosen: Chosen,
    /// Only show what would be removed
    #[arg(long)]
    dry_run: bool,
}

#[derive(Serialize)]
struct Removed {
    database: String,
    removed: Vec<Named>,
    dry_run: bool,
}

#[derive(Serialize)]
struct Named {
    group: String,
    #[serde(flatten)]
    row: CaseRow,
}

pub(super) fn remove(args: &RemoveArgs, options: GlobalOptions) -> CommandResult {
    let selection = args.chosen.some("removed")?;
    let cases = curate::remove(&args.database, &selection, args.dry_run)?;
    let database = args.database.display().to_string();
    if options.json {
        let removed =
            cases.iter().map(|c| Named { group: c.id.group.clone(), row: CaseRow::of(c) });
        let (removed, dry_run) = (removed.collect(), args.dry_run);
        output::print_json(&Removed { database, removed, dry_run })?;
        return Ok(Outcome::Clean);
    }
    options.print(|out| {
        for cases in cases.chunk_by(|a, b| a.id.group == b.id.group) {
            let rows: Vec<CaseRow> = cases.iter().map(CaseRow::of).collect();
            print_group(out, &cases[0].id.group, &rows)?;
        }
        let did = if args.dry_run { "would remove" } else { "removed" };
        writeln!(out, "{did} {} from {database}", output::counted(cases.len(), "case"))
    })?;
    Ok(Outcome::Clean)
}

/// A database, and what of it is called how.
#[derive(clap::Args)]
pub(super) struct RenameArgs {
    /// Curve database
    database: PathBuf,
    /// Group that is renamed, or the group of the case
    #[arg(long, required_unless_present = "case")]
    group: Option<String>,
    /// Case that is renamed, or GROUP/CASE
    #[arg(long)]
    case: Option<String>,
    /// New name
    #[arg(long, value_name = "NAME")]
    to: String,
}

#[derive(Serialize)]
struct Renamed {
    database: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    from: Option<String>,
    to: String,
    cases: Vec<String>,
}

pub(super) fn rename(args: &RenameArgs, options: GlobalOptions) -> CommandResult {
    let database = args.database.display().to_string();
    let (from, to, cases) = match (&args.case, &args.group) {
        (Some(case), group) => {
            let group = group.as_deref();
            let (from, to) = curate::rename_case(&args.database, group, case, &args.to)?;
            (from.to_string(), to.to_string(), vec![to.to_string()])
        }
        (None, group) => {
            let group = group.clone().unwrap_or_default();
            let cases = curate::rename_group(&args.database, &group, &args.to)?;
            (group, args.to.clone(), cases.iter().map(ToString::to_string).collect())
        }
    };
    if options.json {
        output::print_json(&Renamed { database, from: Some(from), to, cases })?;
    } else {
        let count = output::counted(cases.len(), "case");
        options.print(|out| writeln!(out, "renamed {from} to {to} in {database} ({count})"))?;
    }
    Ok(Outcome::Clean)
}
