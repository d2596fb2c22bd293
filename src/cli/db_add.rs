//! `crumple db add`: measured and legacy curves from files into a curve database.

use std::path::PathBuf;

use crumple::curve::{Case, ForceKind, Parameter};
use crumple::formats::read::{READERS, ReadOptions};
use crumple::import::{self, ImportError, Item, Settings};
use crumple::unit::{STIFFNESS, SpeedKind, UnitSystem};
use serde::Serialize;

use super::arguments::{mass, one_of, parameter, speed};
use super::db::CaseRow;
use super::export::{FORCES, units};
use super::output;
use super::{CommandResult, Failure, GlobalOptions, Outcome};

/// Files, the group they join, and what they do not say of themselves.
#[derive(clap::Args)]
pub struct Args {
    /// Curve database; made if it is not there
    #[arg(required_unless_present = "list")]
    database: Option<PathBuf>,
    /// Curves: CSV, JSON, LS-DYNA, Modelica, MAT v4, ISO-MME (a folder), two columns
    #[arg(required_unless_present = "list")]
    files: Vec<PathBuf>,
    /// List the formats that are read
    #[arg(long)]
    list: bool,
    /// Group of the database
    #[arg(long, required_unless_present = "list")]
    group: Option<String>,
    /// Impact speed, one for each file in their order; repeated or after commas [default: what the
    /// file says]
    #[arg(long, value_parser = speed, value_delimiter = ',', allow_hyphen_values = true)]
    speed: Vec<f64>,
    /// What the speed is measured against [default: what the file says, else the group's]
    #[arg(long, value_parser = one_of(KINDS))]
    kind: Option<SpeedKind>,
    /// Mass of the body [default: what the file says]
    #[arg(long, value_parser = mass, allow_hyphen_values = true)]
    mass: Option<f64>,
    /// Mass of the other body of a pair [default: what the file says, else that of the body]
    #[arg(long, value_parser = mass, allow_hyphen_values = true)]
    other_mass: Option<f64>,
    /// Which force the curves are [default: what the file says, else contact]
    #[arg(long, value_parser = one_of(FORCES))]
    force: Option<ForceKind>,
    /// Unloading stiffness from the largest deflection, such as 80MN/m [default: the file's]
    #[arg(long, value_parser = stiffness, allow_hyphen_values = true)]
    unloading: Option<f64>,
    /// Units of values that do not say their own, such as mm-t-s or SI
    #[arg(long, value_parser = units)]
    units: Option<UnitSystem>,
    /// Format, if the content shall not tell (--list)
    #[arg(long)]
    from: Option<String>,
    /// Number or name of the curve in a file of several
    #[arg(long)]
    curve: Option<String>,
    /// Name of the case, once for each file in their order [default: the file's name]
    #[arg(long)]
    case: Vec<String>,
    /// Further parameter of the cases: NAME=NUMBER or NAME=CATEGORY
    #[arg(long, value_parser = parameter)]
    parameter: Vec<(String, Parameter)>,
    /// Replace cases of the same name that were added before
    #[arg(long)]
    replace: bool,
    /// Take curves whose energy cannot be that of speed and mass
    #[arg(long)]
    accept_energy: bool,
}

const KINDS: &[(&str, SpeedKind, &str)] = &[
    ("wall", SpeedKind::Wall, "Of one body against a rigid wall"),
    ("closing", SpeedKind::Closing, "Of two bodies against each other"),
];

fn stiffness(text: &str) -> Result<f64, String> {
    STIFFNESS.parse_positive(text).map_err(|e| e.to_string())
}

#[derive(Serialize)]
struct Document {
    database: String,
    group: String,
    cases: Vec<CaseRow>,
}

#[derive(Serialize)]
struct List {
    formats: Vec<Listed>,
}

#[derive(Serialize)]
struct Listed {
    name: &'static str,
    extensions: &'static [&'static str],
    description: &'static str,
}

pub fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let (Some(database), Some(group), false) = (&args.database, &args.group, args.list) else {
        return list(options);
    };
    let items = items(args)?;
    let settings = Settings {
        group: group.clone(),
        kind: args.kind,
        mass_kg: args.mass,
        other_mass_kg: args.other_mass,
        unloading_stiffness_n_per_m: args.unloading,
        read: ReadOptions {
            format: args.from.clone(),
            units: args.units,
            curve: args.curve.clone(),
            force: args.force,
        },
        parameters: args.parameter.iter().cloned().collect(),
        replace: args.replace,
        accept_energy: args.accept_energy,
    };
    let cases = import::add(database, &items, &settings).map_err(|error| match error {
        // The command line lacks something, or says what cannot be.
        ImportError::Missing { .. }
        | ImportError::MassOfWall { .. }
        | ImportError::OtherForce { .. } => Failure::Usage(error.to_string()),
        other => other.into(),
    })?;
    report(&cases, &database.display().to_string(), group, options)
}

/// A file each, with its speed and name.
fn items(args: &Args) -> Result<Vec<Item>, Failure> {
    let files = args.files.len();
    for (option, given) in [("--speed", args.speed.len()), ("--case", args.case.len())] {
        if given != 0 && given != files {
            return Err(Failure::Usage(format!(
                "{option} is given {given} times for {files} files: give it once for each file, in their order"
            )));
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
    let rows: Vec<CaseRow> = cases.iter().map(CaseRow::of).collect();
    let mut outcome = Outcome::Clean;
    for (case, row) in cases.iter().zip(&rows) {
        for warning in &row.warnings {
            options.warn(&format!("{}: {warning}", case.name));
            outcome = Outcome::Warned;
        }
    }
    if options.json {
        let (database, group) = (database.into(), group.into());
        output::print_json(&Document { database, group, cases: rows })?;
        return Ok(outcome);
    }
    output::print(|out| {
        let heading: Vec<&str> = ["case"].into_iter().chain(CaseRow::HEADING).collect();
        let cells = cases.iter().zip(&rows);
        let cells: Vec<Vec<String>> = cells
            .map(|(case, row)| [case.name.clone()].into_iter().chain(row.cells()).collect())
            .collect();
        output::table(out, &heading, &cells)?;
        for (case, row) in cases.iter().zip(&rows) {
            for note in &row.notes {
                writeln!(out, "note: {}: {note}", case.name)?;
            }
        }
        writeln!(out, "wrote {database} (group {group})")
    })?;
    Ok(outcome)
}

fn list(options: GlobalOptions) -> CommandResult {
    if options.json {
        let listed = READERS.iter().map(|r| Listed {
            name: r.name,
            extensions: r.extensions,
            description: r.description,
        });
        output::print_json(&List { formats: listed.collect() })?;
        return Ok(Outcome::Clean);
    }
    output::print(|out| {
        READERS.iter().try_for_each(|r| {
            let extensions = r.extensions.join(" .");
            writeln!(out, "{:<12} .{extensions:<20} {}", r.name, r.description)
        })
    })?;
    Ok(Outcome::Clean)
}
