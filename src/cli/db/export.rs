//! `crumple db export`: cases and their samples as CSV tables.

use std::path::PathBuf;

use crate::curate;
use crate::curve::Case;
use crate::database::Database;

use super::{Chosen, CommandResult, GlobalOptions, Outcome};

/// Cases, and the folder for their tables.
#[derive(clap::Args)]
pub(super) struct Args {
    /// Curve database
    database: PathBuf,
    #[command(flatten)]
    chosen: Chosen,
    /// Folder to write to; created if it does not exist
    #[arg(short, long)]
    output: PathBuf,
    /// Also write originals.csv, the curves at the solver's rate
    #[arg(long)]
    originals: bool,
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let database = Database::read(&args.database)?;
    let selection = args.chosen.selection();
    let cases: Vec<&Case> = selection.find(&args.database, &database)?;
    let files = curate::write_tables(&cases, &args.output, args.originals)?;
    let files: Vec<String> = files.iter().map(|path| path.display().to_string()).collect();
    let database = args.database.display().to_string();
    let document = document! { database: database, cases: cases.len(), files: &files };
    options
        .show(&document, |out| files.iter().try_for_each(|file| writeln!(out, "wrote {file}")))?;
    Ok(Outcome::Clean)
}
