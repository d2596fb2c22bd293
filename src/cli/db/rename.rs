//! `crumple db rm` and `rename`: cases removed, cases and groups renamed.

use std::path::PathBuf;

use crate::curate;
use crate::plural::counted;

use super::chosen::Chosen;
use super::list::print_group;
use super::row::case_row;
use super::{CommandResult, GlobalOptions, Outcome};

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

pub(super) fn remove(args: &RemoveArgs, options: GlobalOptions) -> CommandResult {
    let selection = args.chosen.some("removed")?;
    let cases = curate::remove(&args.database, &selection, args.dry_run)?;
    let database = args.database.display().to_string();
    let removed = cases.iter().map(|case| {
        document! { group: &case.id.group, #[serde(flatten)] row: case_row(case) }
    });
    let document = document! {
        database: &database,
        removed: removed.collect::<Vec<_>>(),
        dry_run: args.dry_run,
    };
    options.show(&document, |out| {
        for cases in cases.chunk_by(|a, b| a.id.group == b.id.group) {
            print_group(out, &cases[0].id.group, &cases.iter().collect::<Vec<_>>())?;
        }
        let did = if args.dry_run { "would remove" } else { "removed" };
        writeln!(out, "{did} {} from {database}", counted(cases.len(), "case"))
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
    let document = document! { database: &database, from: &from, to: &to, cases: &cases };
    let count = counted(cases.len(), "case");
    options
        .show(&document, |out| writeln!(out, "renamed {from} to {to} in {database} ({count})"))?;
    Ok(Outcome::Clean)
}
