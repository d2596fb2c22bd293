//! `crumple db add`: measured and legacy curves from files into a curve database.

use crate::words::counted;
use std::path::PathBuf;

use crate::curve::{Case, ForceKind, Parameter};
use crate::formats::read::{READERS, ReadOptions};
use crate::import::{self, Item, Settings};
use crate::unit::{UnitSystem, mass_kg, speed_m_per_s};

use super::super::arguments::CurveFile;
use super::arguments::{FORCES, one_of, parameter, parameters};
use super::list::{case_row, print_group};
use super::{CommandResult, Failure, GlobalOptions, output, usage};

/// Files, the group they join, and data missing from them.
#[derive(clap::Args)]
pub(super) struct Args {
    /// Curve database; created if it does not exist
    #[arg(required_unless_present = "list")]
    database: Option<PathBuf>,
    /// Curves: tables (CSV and similar), JSON, LS-DYNA, Radioss, Modelica, MAT v4, MDF 4, ISO-MME (a folder)
    #[arg(required_unless_present = "list")]
    files: Vec<PathBuf>,
    /// List the formats that are read
    #[arg(long)]
    list: bool,
    /// Group of the database
    #[arg(long, required_unless_present = "list")]
    group: Option<String>,
    /// Impact speed, one for each file in the same order; repeated or separated by commas [default: as the
    /// file states]
    #[arg(long, value_parser = speed_m_per_s, value_delimiter = ',', allow_hyphen_values = true)]
    speed: Vec<f64>,
    /// Mass of the body [default: as the file states]
    #[arg(long, value_parser = mass_kg, allow_hyphen_values = true)]
    mass: Option<f64>,
    /// Which force the curves hold [default: as the file states, else contact]
    #[arg(long, value_parser = one_of(FORCES))]
    force: Option<ForceKind>,
    /// Units of values that state none, such as mm-t-s or SI
    #[arg(long, value_parser = UnitSystem::parse)]
    units: Option<UnitSystem>,
    /// Name of the case, once for each file in the same order [default: the file's name]
    #[arg(long)]
    case: Vec<String>,
    /// Further parameter of the cases: NAME=NUMBER or NAME=CATEGORY
    #[arg(long, value_parser = parameter)]
    parameter: Vec<(String, Parameter)>,
    /// Replace cases of the same name that were added before
    #[arg(long)]
    replace: bool,
    #[command(flatten)]
    file: CurveFile,
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let (Some(database), Some(group), false) = (&args.database, &args.group, args.list) else {
        let listed = READERS.iter().map(|r| (r.name, r.extensions, r.description));
        return output::formats(listed, options);
    };
    let items = items(args)?;
    let said = args.file.settings();
    let settings = Settings {
        group: group.clone(),
        mass_kg: args.mass,
        read: ReadOptions { units: args.units, force: args.force, ..said.read },
        parameters: parameters(&args.parameter)?,
        replace: args.replace,
        ..said
    };
    let cases = import::add(database, &items, &settings)?;
    report(&cases, &database.display().to_string(), group, options)
}

/// A file each, with its speed and name.
fn items(args: &Args) -> Result<Vec<Item>, Failure> {
    let files = args.files.len();
    for (option, given) in [("--speed", args.speed.len()), ("--case", args.case.len())] {
        if given != 0 && given != files {
            return usage(format!(
                "{option} is given {} for {}: give it once for each file, in the same order",
                counted(given, "time"),
                counted(files, "file")
            ));
        }
    }
    let items = args.files.iter().enumerate().map(|(k, path)| Item {
        path: path.clone(),
        case: args.case.get(k).cloned(),
        speed_m_per_s: args.speed.get(k).copied(),
    });
    Ok(items.collect())
}

fn report(cases: &[Case], database: &str, group: &str, options: GlobalOptions) -> CommandResult {
    let warnings = |case: &Case| -> Vec<String> {
        case.quality.warnings.iter().map(|w| format!("{}: {w}", case.id.name)).collect()
    };
    let outcome = options.warn_all(cases.iter().flat_map(warnings));
    let rows: Vec<_> = cases.iter().map(case_row).collect();
    options.show(&document! { database: database, group: group, cases: rows }, |out| {
        print_group(out, "case", &cases.iter().collect::<Vec<_>>())?;
        for case in cases {
            for note in &case.quality.notes {
                writeln!(out, "note: {}: {note}", case.id.name)?;
            }
        }
        writeln!(out, "wrote {database} (group {group})")
    })?;
    Ok(outcome)
}
