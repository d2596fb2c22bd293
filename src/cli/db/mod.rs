//! `crumple db`: show and edit a curve database. One file for commands that belong
//! together.

mod add;
mod diff;
mod join;
mod list;
mod rename;
mod show;

use std::path::{Path, PathBuf};

use super::arguments::{FileKind, named};
use super::{CommandResult, Failure, GlobalOptions, Outcome, arguments, output, usage};
use crate::curate::{self, Selection, SpeedRange};
use crate::curve::Case;
use crate::database::Database;
use crate::database::check::{self, Checked};
use crate::words::counted;
pub(super) use list::{case_columns, case_row};

/// List, show, compare, check, add, rename, join, tag and export cases of a curve database
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple db ls curves.h5
  crumple db show curves.h5 --group lead-car-wall --case 36kmh
  crumple db check curves.h5 --strict
  crumple db add curves.h5 test.csv --group tests --speed 36km/h --kind wall --mass 24t
  crumple db rm curves.h5 --group lead-car-wall --speed ..15km/h --dry-run
  crumple db tag curves.h5 --group lead-car-wall --add reviewed
  crumple db merge curves.h5 others.h5 -o all.h5
  crumple db export curves.h5 -o tables
Commands that change a database lock it; if one is interrupted, the old or the new file is intact.")]
pub(super) struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand)]
enum Command {
    /// List groups and cases by speed
    #[command(after_help = "Examples:
  crumple db ls curves.h5
  crumple db ls curves.h5 --group lead-car-wall --speed 20km/h..50km/h
  crumple db ls curves.h5 --tag reviewed --json")]
    Ls(list::Args),
    /// Show cases with their curves, or side by side
    #[command(after_help = "Examples:
  crumple db show curves.h5 --group lead-car-wall --case 36kmh
  crumple db show curves.h5 --json > curves.json
  crumple db show curves.h5 --compare --case lead-car-wall/36kmh --case lead-car-wall/48kmh
  crumple db show curves.h5 --compare --tag reviewed
Differences are relative to the first case. force L1 is sum|F-F0|/sum|F0| of the loading branches, in
equal steps of deflection over their common range.")]
    Show(show::Args),
    /// Say what another database has added, removed and changed
    ///
    /// Cases are compared by group and name: conditions and curves; tags, notes and the date of the build are not.
    #[command(after_help = "Examples:
  crumple db diff before.h5 curves.h5
  crumple db diff before.h5 curves.h5 --group lead-car-wall --json
Differences are relative to the case before. force L1 is sum|F-F0|/sum|F0| of the loading branches.")]
    Diff(diff::Args),
    /// Check every stored value against what follows from the others
    ///
    /// Finds values that were changed, are not finite or out of order, gaps in
    /// time, energies, ends of loading and stiffnesses that differ from the curve's, two kinds of
    /// speed in a group, runs that ended while loading, and repeats the warnings of the
    /// extraction. Indices start at 0, as in HDF5's tools.
    #[command(after_help = "Examples:
  crumple db check curves.h5
  crumple db check curves.h5 --strict    # exit code 3 if there is a finding")]
    Check {
        /// Curve database
        database: PathBuf,
    },
    /// Add measured and legacy curves from files
    ///
    /// Every file becomes a case of the study "imported", with its path, size and hash. A curve
    /// without times is given the motion that its own force implies: its maximum deflection is
    /// taken as the maximum crush. All files are read before anything is written.
    #[command(after_help = "Examples:
  crumple db add curves.h5 test.csv --group tests --speed 36km/h --kind wall --mass 24t
  crumple db add curves.h5 25.json 36.json 50.json --group legacy
  crumple db add curves.h5 a.k b.k --group pairs --speed 36km/h,54km/h --kind closing --mass 24t --units mm-t-s
  crumple db add curves.h5 T123.mme --group tests --speed 36km/h --mass 24t
  crumple db add --list
Column headers name quantity and unit: d_mm, displacement [mm], F_kN, Force [N], time (ms).")]
    Add(Box<add::Args>),
    /// Remove cases or whole groups
    #[command(after_help = "Examples:
  crumple db rm curves.h5 --group lead-car-wall --case 12kmh
  crumple db rm curves.h5 --group lead-car-wall --speed ..15km/h --dry-run
  crumple db rm curves.h5 --tag doubtful
  crumple db rm curves.h5 --group tests
A build adds the runs of its study again: to drop a case for good, remove its run from the study.")]
    Rm(rename::RemoveArgs),
    /// Give a case or a group another name
    ///
    /// The next build of its study keeps a renamed case under its new name.
    #[command(after_help = "Examples:
  crumple db rename curves.h5 --group lead-car-wall --to nose
  crumple db rename curves.h5 --group lead-car-wall --case 36kmh --to reference
  crumple db rename curves.h5 --case lead-car-wall/36kmh --to reference")]
    Rename(rename::RenameArgs),
    /// Join databases
    ///
    /// Equal curves of a group are taken once, with the tags and notes of both. Different curves
    /// with the same name are refused unless --rename or --replace says what to do with them.
    #[command(after_help = "Examples:
  crumple db merge a.h5 b.h5 -o all.h5
  crumple db merge a.h5 b.h5 c.h5 -o a.h5 --dry-run    # into the first
  crumple db merge a.h5 newer.h5 -o a.h5 --replace")]
    Merge(join::MergeArgs),
    /// Copy cases to another group or database
    ///
    /// A copy in another group no longer belongs to its study: builds leave it as it is.
    #[command(after_help = "Examples:
  crumple db copy curves.h5 --group lead-car-wall --speed 20km/h..50km/h --to-group inner-speeds
  crumple db copy curves.h5 --tag reviewed --to approved.h5
  crumple db copy curves.h5 --case lead-car-wall/36kmh --to b.h5 --to-group nose --dry-run")]
    Copy(join::CopyArgs),
    /// Add and remove tags of cases
    #[command(after_help = "Examples:
  crumple db tag curves.h5 --group lead-car-wall --add reviewed,nose
  crumple db tag curves.h5 --case lead-car-wall/72kmh --remove reviewed --add doubtful
  crumple db ls curves.h5 --tag reviewed
Tags and notes stay with a case when it is built again.")]
    Tag(rename::TagArgs),
    /// Add and remove notes on cases
    #[command(after_help = "Examples:
  crumple db note curves.h5 --case lead-car-wall/72kmh --add \"the nose rides up from 80 ms on\"
  crumple db note curves.h5 --case lead-car-wall/72kmh --clear
Tags and notes stay with a case when it is built again.")]
    Note(rename::NoteArgs),
    /// Write cases and their samples as CSV tables
    ///
    /// cases.csv has a line for each case, curves.csv one for each sample at the common interval,
    /// with the names of its case. For single curves in other tools' formats: crumple export.
    #[command(after_help = "Examples:
  crumple db export curves.h5 -o tables
  crumple db export curves.h5 --group lead-car-wall --originals --croissant -o tables
docs/databases.md has recipes for pandas, polars, DuckDB, Parquet and xarray.")]
    Export(ExportArgs),
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    match &args.command {
        Command::Ls(args) => list::run(args, options),
        Command::Show(args) => show::run(args, options),
        Command::Diff(args) => diff::run(args, options),
        Command::Check { database } => check_values(database, options),
        Command::Add(args) => add::run(args, options),
        Command::Rm(args) => rename::remove(args, options),
        Command::Rename(args) => rename::rename(args, options),
        Command::Merge(args) => join::merge(args, options),
        Command::Copy(args) => join::copy(args, options),
        Command::Tag(args) => rename::tag(args, options),
        Command::Note(args) => rename::note(args, options),
        Command::Export(args) => export(args, options),
    }
}

/// Which cases; every option narrows the choice.
#[derive(clap::Args)]
struct Chosen {
    /// Group; may be repeated
    #[arg(long, help_heading = "Which cases")]
    group: Vec<String>,
    /// Case of the group, or GROUP/CASE; may be repeated
    #[arg(long, help_heading = "Which cases")]
    case: Vec<String>,
    /// Impact speeds: 20km/h..40km/h, ..40km/h, 20km/h.. or 36km/h; may be repeated
    #[arg(long, value_name = "RANGE", allow_hyphen_values = true, help_heading = "Which cases")]
    speed: Vec<SpeedRange>,
    /// Tag that the cases have, or one of several; may be repeated
    #[arg(long, help_heading = "Which cases")]
    tag: Vec<String>,
}

impl Chosen {
    fn selection(&self) -> Selection {
        Selection {
            groups: self.group.clone(),
            cases: self.case.clone(),
            speeds: self.speed.clone(),
            tags: self.tag.clone(),
        }
    }

    /// The same, which may not be everything by mistake; `what` is what happens to the cases.
    fn some(&self, what: &str) -> Result<Selection, Failure> {
        let selection = self.selection();
        if selection.is_all() {
            usage(format!("choose the cases to be {what} with --group, --case, --speed or --tag"))
        } else {
            Ok(selection)
        }
    }
}

/// `crumple db check`: every stored value checked against the others.
fn check_values(path: &Path, options: GlobalOptions) -> CommandResult {
    let checked = check::check(path)?;
    let Checked { cases, findings } = &checked;
    options.show(&checked, |out| {
        for f in findings {
            writeln!(out, "{}/{}: {}", f.group, f.case, f.message)?;
        }
        let (cases, found) = (counted(*cases, "case"), counted(findings.len(), "finding"));
        writeln!(out, "{cases} checked, {found}")
    })?;
    Ok(Outcome::warned_if(!findings.is_empty()))
}

/// Cases, and the folder for their tables.
#[derive(clap::Args)]
struct ExportArgs {
    /// Curve database
    database: PathBuf,
    #[command(flatten)]
    chosen: Chosen,
    /// Folder to write to; created if it does not exist
    #[arg(short, long, value_parser = named())]
    output: PathBuf,
    /// Also write originals.csv, the curves at the solver's rate
    #[arg(long)]
    originals: bool,
    /// Also write croissant.json, which describes the tables for machine-learning tools (Croissant 1.0)
    #[arg(long)]
    croissant: bool,
}

fn export(args: &ExportArgs, options: GlobalOptions) -> CommandResult {
    let database = Database::read(&args.database)?;
    let selection = args.chosen.selection();
    let cases: Vec<&Case> = selection.find(&args.database, &database)?;
    let name = args.database.file_stem().unwrap_or_default().to_string_lossy();
    let described_as = args.croissant.then_some(&*name);
    for name in &curate::TABLES[..if args.originals { 3 } else { 2 }] {
        options.keep_others(&args.output.join(name), FileKind::Result)?;
    }
    let files = curate::write_tables(&cases, &args.output, args.originals, described_as)?;
    let files: Vec<String> = files.iter().map(|path| path.display().to_string()).collect();
    let others = [
        (!args.originals, curate::TABLES[2], "--originals"),
        (!args.croissant, curate::DESCRIPTION, "--croissant"),
    ];
    let left = others.into_iter().filter_map(|(is_left, name, option)| {
        let old = args.output.join(name);
        (is_left && old.exists()).then(|| {
            let old = old.display();
            format!("{old} existed before and may be of other cases: {option} rewrites it")
        })
    });
    let outcome = options.warn_all(left);
    let database = args.database.display().to_string();
    let document = document! { database: database, cases: cases.len(), files: &files };
    options
        .show(&document, |out| files.iter().try_for_each(|file| writeln!(out, "wrote {file}")))?;
    Ok(outcome)
}
