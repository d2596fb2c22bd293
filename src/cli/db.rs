//! `crumple db`: look into a curve database, and add curves to it.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crumple::curve::{Case, Parameter, SourceFile};
use crumple::database::Database;
use crumple::database::check::{self, Checked};
use crumple::dataset::of_one_kind;
use crumple::unit::{SpeedKind, km_per_h};
use serde::Serialize;

use super::output;
use super::{CommandResult, Failure, GlobalOptions, Outcome, db_add};

/// List, show, check and add cases of a curve database
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple db ls curves.h5
  crumple db show curves.h5 --group lead-car-wall --case 36kmh
  crumple db show curves.h5 --json > curves.json
  crumple db check curves.h5 --strict
  crumple db add curves.h5 test.csv --group tests --speed 36km/h --kind wall --mass 24t")]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand)]
enum Command {
    /// List groups and cases by speed
    #[command(
        after_help = "Examples:\n  crumple db ls curves.h5\n  crumple db ls curves.h5 --json"
    )]
    Ls {
        /// Curve database
        database: PathBuf,
    },
    /// Show cases with their curves: a terminal plot, or everything with --json
    #[command(after_help = "Examples:
  crumple db show curves.h5 --group lead-car-wall --case 36kmh
  crumple db show curves.h5 --json > curves.json")]
    Show {
        /// Curve database
        database: PathBuf,
        /// Group to show (default: all)
        #[arg(long)]
        group: Option<String>,
        /// Case to show (default: all); without a group, of the only one
        #[arg(long)]
        case: Option<String>,
    },
    /// Read every value and hold what is stored against what follows from it
    ///
    /// Finds values that are not those that were written, not finite or out of order, holes in
    /// time, energies, ends of loading and stiffnesses that are not the curve's, two kinds of
    /// speed in a group, runs that ended while loading, and repeats the warnings of the
    /// extraction. Indices count from 0, as in HDF5's tools.
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
    /// without times is given the motion that its own force asks for: its largest deflection is
    /// taken as the largest crush. All files are read before anything is written.
    #[command(after_help = "Examples:
  crumple db add curves.h5 test.csv --group tests --speed 36km/h --kind wall --mass 24t
  crumple db add curves.h5 25.json 36.json 50.json --group legacy
  crumple db add curves.h5 a.k b.k --group pairs --speed 36km/h,54km/h --kind closing --mass 24t --units mm-t-s
  crumple db add curves.h5 T123.mme --group tests --speed 36km/h --mass 24t
  crumple db add --list
Headers of columns name quantity and unit: d_mm, displacement [mm], F_kN, Force [N], time (ms).")]
    Add(Box<db_add::Args>),
}

/// What a list says of one case.
#[derive(Serialize)]
pub struct CaseRow {
    name: String,
    speed_m_per_s: f64,
    speed_kind: SpeedKind,
    mass_kg: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    other_mass_kg: Option<f64>,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    parameters: BTreeMap<String, Parameter>,
    force_kind: crumple::curve::ForceKind,
    states: usize,
    #[serde(rename = "peak_force_N")]
    peak_force_n: f64,
    max_deflection_m: f64,
    loading_end: usize,
    truncated: bool,
    #[serde(rename = "unloading_stiffness_N_per_m")]
    unloading_stiffness_n_per_m: Option<f64>,
    #[serde(rename = "work_J")]
    work_j: f64,
    #[serde(rename = "kinetic_energy_J")]
    kinetic_energy_j: f64,
    work_over_energy: f64,
    contact_time_s: f64,
    pub notes: Vec<String>,
    pub warnings: Vec<String>,
}

impl CaseRow {
    pub const HEADING: [&str; 6] = ["speed", "mass", "peak force", "max crush", "W/E", "unloading"];

    pub fn of(case: &Case) -> Self {
        Self {
            name: case.name.clone(),
            speed_m_per_s: case.speed.m_per_s,
            speed_kind: case.speed.kind,
            mass_kg: case.masses.body_kg,
            parameters: case.parameters.clone(),
            other_mass_kg: case.masses.other_kg,
            force_kind: case.force_kind,
            states: case.sampled.time_s().len(),
            peak_force_n: case.peak_force_n(),
            max_deflection_m: case.max_deflection_m(),
            loading_end: case.loading_end(),
            truncated: case.is_truncated(),
            unloading_stiffness_n_per_m: case.unloading_stiffness_n_per_m,
            work_j: case.audit.work_j,
            kinetic_energy_j: case.audit.kinetic_j,
            work_over_energy: case.audit.ratio(),
            contact_time_s: case.contact_time_s,
            notes: case.notes.clone(),
            warnings: case.warnings.clone(),
        }
    }

    pub fn cells(&self) -> Vec<String> {
        vec![
            format!("{} ({})", km_per_h(self.speed_m_per_s), self.speed_kind.name()),
            format!("{:.2} t", self.mass_kg / 1e3),
            format!("{:.3} MN", self.peak_force_n / 1e6),
            format!(
                "{:.4} m{}",
                self.max_deflection_m,
                if self.truncated { " (truncated)" } else { "" }
            ),
            format!("{:.4}", self.work_over_energy),
            self.unloading_stiffness_n_per_m.map_or("-".into(), |k| format!("{:.1} MN/m", k / 1e6)),
        ]
    }
}

/// Everything of one case.
#[derive(Serialize)]
struct FullCase<'a> {
    #[serde(flatten)]
    row: CaseRow,
    study: &'a str,
    time_s: &'a [f64],
    deflection_m: &'a [f64],
    #[serde(rename = "force_N")]
    force_n: &'a [f64],
    closing_speed_m_per_s: &'a [f64],
    original: Columns<'a>,
    recipe: serde_json::Value,
    sources: &'a [SourceFile],
    fingerprint: &'a str,
}

#[derive(Serialize)]
struct Columns<'a> {
    time_s: &'a [f64],
    deflection_m: &'a [f64],
    #[serde(rename = "force_N")]
    force_n: &'a [f64],
}

pub fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    match &args.command {
        Command::Ls { database } => ls(&Database::read(database)?, options),
        Command::Show { database: path, group, case } => {
            if let Some(name) = case {
                let case = Database::read_case(path, group.as_deref(), name)?;
                return show(&BTreeMap::from([(case.group.clone(), &[case][..])]), options);
            }
            let database = Database::read(path)?;
            let groups: Vec<&str> = match group {
                None => database.groups().collect(),
                Some(group) => vec![database.group_or_only(path, Some(group))?.0],
            };
            let shown = groups.into_iter().map(|g| (g.to_string(), database.cases(g))).collect();
            show(&shown, options)
        }
        Command::Check { database } => check(database, options),
        Command::Add(args) => db_add::run(args, options),
    }
}

#[derive(Serialize)]
struct Groups<T> {
    groups: BTreeMap<String, Vec<T>>,
    /// What no command can use a group for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    warnings: Vec<String>,
}

fn ls(database: &Database, options: GlobalOptions) -> CommandResult {
    let rows = |group: &str| database.cases(group).iter().map(CaseRow::of).collect::<Vec<_>>();
    let mixed = |g: &str| of_one_kind(database.cases(g)).err().map(|e| format!("group {g}: {e}"));
    let warnings: Vec<String> = database.groups().filter_map(mixed).collect();
    for warning in &warnings {
        options.warn(warning);
    }
    let outcome = if warnings.is_empty() { Outcome::Clean } else { Outcome::Warned };
    if options.json {
        let groups = database.groups().map(|g| (g.to_string(), rows(g))).collect();
        output::print_json(&Groups { groups, warnings })?;
    } else {
        output::print(|out| database.groups().try_for_each(|g| print_group(out, g, &rows(g))))?;
    }
    Ok(outcome)
}

fn print_group(out: &mut dyn Write, group: &str, rows: &[CaseRow]) -> io::Result<()> {
    let heading: Vec<&str> = [group].into_iter().chain(CaseRow::HEADING).collect();
    let cells: Vec<Vec<String>> =
        rows.iter().map(|r| [r.name.clone()].into_iter().chain(r.cells()).collect()).collect();
    output::table(out, &heading, &cells)?;
    writeln!(out)
}

fn show(shown: &BTreeMap<String, &[Case]>, options: GlobalOptions) -> CommandResult {
    if options.json {
        let groups = shown
            .iter()
            .map(|(group, cases)| {
                let cases: Result<Vec<_>, Failure> = cases.iter().map(full).collect();
                Ok((group.clone(), cases?))
            })
            .collect::<Result<_, Failure>>()?;
        output::print_json(&Groups { groups, warnings: Vec::new() })?;
        return Ok(Outcome::Clean);
    }
    output::print(|out| {
        for (group, cases) in shown {
            for case in *cases {
                print_case(out, group, case)?;
            }
        }
        Ok(())
    })?;
    Ok(Outcome::Clean)
}

fn full(case: &Case) -> Result<FullCase<'_>, Failure> {
    Ok(FullCase {
        row: CaseRow::of(case),
        study: &case.study,
        time_s: case.sampled.time_s(),
        deflection_m: case.sampled.deflection_m(),
        force_n: case.sampled.force_n(),
        closing_speed_m_per_s: &case.closing_speed_m_per_s,
        original: Columns {
            time_s: case.original.time_s(),
            deflection_m: case.original.deflection_m(),
            force_n: case.original.force_n(),
        },
        recipe: serde_json::from_str(&case.recipe)?,
        sources: &case.sources,
        fingerprint: &case.fingerprint,
    })
}

fn print_case(out: &mut dyn Write, group: &str, case: &Case) -> io::Result<()> {
    print_group(out, group, &[CaseRow::of(case)])?;
    for source in &case.sources {
        writeln!(
            out,
            "from {} ({} bytes, blake3 {}…, {} {})",
            source.path,
            source.size_bytes,
            &source.blake3.get(..12).unwrap_or(&source.blake3),
            source.solver.as_deref().unwrap_or("unknown solver"),
            source.version.as_deref().unwrap_or("")
        )?;
    }
    for (name, value) in &case.parameters {
        match value {
            Parameter::Number(value) => writeln!(out, "parameter: {name} = {value}")?,
            Parameter::Category(value) => writeln!(out, "parameter: {name} = {value}")?,
        }
    }
    for note in &case.notes {
        writeln!(out, "note: {note}")?;
    }
    for warning in &case.warnings {
        writeln!(out, "warning: {warning}")?;
    }
    writeln!(out, "\nforce [MN] over deflection [m]")?;
    let (d, f) = (case.original.deflection_m(), case.original.force_n());
    super::plot::curve(out, d, f)?;
    writeln!(out)
}

fn check(path: &Path, options: GlobalOptions) -> CommandResult {
    let checked = check::check(path)?;
    let Checked { cases, findings } = &checked;
    if options.json {
        output::print_json(&checked)?;
    } else {
        output::print(|out| {
            for f in findings {
                writeln!(out, "{}/{}: {}", f.group, f.case, f.message)?;
            }
            writeln!(out, "{cases} cases checked, {} findings", findings.len())
        })?;
    }
    Ok(if findings.is_empty() { Outcome::Clean } else { Outcome::Warned })
}
