//! `crumple plot`: pictures of databases, models, curves, runs and solver files.

use std::path::{Path, PathBuf};

use crate::assess::ComparisonSettings;
use crate::assess::choose::Purpose;
use crate::assess::train::compare_train;
use crate::assess::validate::Choice;
use crate::charts::{self, Motion, Quantity};
use crate::curve::ForceKind;
use crate::database::Database;
use crate::file::{self, write_all_whole};
use crate::formats::ReadOptions;
use crate::formats::read::{self, json};
use crate::plot::Chart;
use crate::scenario;
use crate::solver::{self, WantedId};
use crate::surrogate::{Model, ModelCase, PredictedCurve, Query, predict};
use crate::unit::{UnitSystem, km_per_h};

use super::arguments::{self, FileKind, Reading, one_of, selection, units};
use super::output::{self, Bar};
use super::{
    CommandResult, Failure, GlobalOptions, Outcome, failed_at, is_stdout, keep_input, usage,
    usage_error,
};

/// Draw curves, predictions, runs and histories as SVG or PNG
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple plot curves.h5 --group lead-car-wall -o curves.svg            # curves by speed
  crumple plot curves.h5 --group lead-car-wall --left-out 48km/h -o left-out.png
  crumple plot lead.model --speed 50km/h -o lead50.svg                  # with band and neighbouring runs
  crumple plot scenario.toml --quantity energy -o energy.svg            # runs the scenario
  crumple plot result.csv --quantity crush -o crush.svg
  crumple plot train-set.toml --train -o train.svg                      # FE's train and the methods
  crumple plot run/nodout --id 900001 --component x_velocity --units mm-t-s --cfc 60 -o nodout.svg
The kind of file is recognised by its content. SVG and PNG show the same drawing; \"-o -\" is SVG on standard output.")]
pub(super) struct Args {
    /// Database, model, predicted curve, scenario, result (CSV), solver file, or a curve's file (crumple db
    /// add --list)
    file: PathBuf,
    /// Picture to write: .svg or .png; may be repeated
    #[arg(short, long, required = true)]
    output: Vec<PathBuf>,
    /// Of a database: the group (default: the only one)
    #[arg(long)]
    group: Option<String>,
    /// Of a database: which force (default: the recipe's)
    #[arg(long, value_parser = one_of(FORCES))]
    force: Option<ForceKind>,
    /// Of a database: leave this speed out, predict it from the others, and compare
    #[arg(long, value_parser = arguments::speed, value_name = "SPEED", conflicts_with = "force")]
    left_out: Option<f64>,
    /// Of a model: speed of the curve
    #[arg(long, value_parser = arguments::speed)]
    speed: Option<f64>,
    /// Of a scenario or result: quantity to draw
    #[arg(long, value_parser = one_of(QUANTITIES), default_value = "velocity")]
    quantity: Quantity,
    /// Of a scenario with FE's run as reference: compare the methods in the whole train
    #[arg(long)]
    train: bool,
    /// Of a solver file: node, wall or interface; may be repeated
    #[arg(long = "id")]
    ids: Vec<WantedId>,
    /// Of a solver file: component named as in binout, such as x_velocity; may be repeated
    #[arg(long = "component")]
    components: Vec<String>,
    /// Of a solver file: section of a binout
    #[arg(long)]
    section: Option<String>,
    /// Of a solver file: its kind (nodout, rcforc, …), if not recognised by its content
    #[arg(long)]
    format: Option<String>,
    /// Of a solver file: its units, such as mm-t-s; without them axes are in the file's units. Of a
    /// curve's file: its units if it does not state them
    #[arg(long, value_parser = units)]
    units: Option<UnitSystem>,
    /// Of a solver file: also draw filtered lines, by channel frequency class such as 60
    #[arg(long, value_name = "CLASS", requires = "units", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    cfc: Option<u32>,
    #[command(flatten)]
    reading: Reading,
    /// Title above the picture (default: what is drawn)
    #[arg(long)]
    title: Option<String>,
    /// Width in pixels
    #[arg(long, default_value_t = 780.0, value_parser = pixels)]
    width: f64,
    /// Height of the plot area in pixels
    #[arg(long, default_value_t = 320.0, value_parser = pixels)]
    height: f64,
    /// Pixels of a PNG per pixel of the width
    #[arg(long, default_value_t = 2.0, value_parser = scale)]
    scale: f64,
}

const FORCES: &[(&str, ForceKind, &str)] = &[
    ("contact", ForceKind::Contact, "What the obstacle feels"),
    ("body", ForceKind::Body, "What moves the body"),
];

const QUANTITIES: &[(&str, Quantity, &str)] = &[
    ("velocity", Quantity::Velocity, "Speeds of the bodies over time"),
    ("acceleration", Quantity::Acceleration, "Accelerations of the bodies over time"),
    ("force", Quantity::Force, "Forces of the interfaces over time"),
    ("crush", Quantity::Crush, "Forces of the interfaces over their deflection"),
    ("energy", Quantity::Energy, "Kinetic, stored and dissipated energy over time"),
];

fn within(text: &str, low: f64, high: f64) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|n| (low..=high).contains(n));
    number.ok_or_else(|| format!("expected a number from {low} to {high}"))
}

fn pixels(text: &str) -> Result<f64, String> {
    within(text, 80.0, 5000.0)
}

fn scale(text: &str) -> Result<f64, String> {
    within(text, 0.5, 8.0)
}

/// Maximum number of bytes of a result that is drawn.
const MOST_RESULT: u64 = 1 << 30;

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let is_png = args.output.iter().map(|path| is_png(path)).collect::<Result<Vec<_>, _>>()?;
    args.output.iter().try_for_each(|output| keep_input(&args.file, output))?;
    args.output.iter().try_for_each(|output| options.keep_others(output, FileKind::Curve))?;
    let to_stdout = options.on_stdout(&args.output)?;
    let mut chart = chart(args, options)?;
    if let Some(title) = &args.title {
        chart.title.clone_from(title);
    }
    (chart.width, chart.height) = (args.width, args.height);
    let drawing = chart.drawing();
    let mut files = Vec::new();
    for (path, is_png) in args.output.iter().zip(is_png) {
        let bytes = if is_png { drawing.png(args.scale)? } else { drawing.svg().into_bytes() };
        if is_stdout(path) {
            output::print_data(|out| out.write_all(&bytes))?;
        } else {
            files.push((path.as_path(), bytes));
        }
    }
    let all: Vec<(&Path, &[u8])> = files.iter().map(|(path, bytes)| (*path, &bytes[..])).collect();
    write_all_whole(&all)?;
    if to_stdout {
        return Ok(Outcome::Clean);
    }
    let document = document! {
        title: &chart.title,
        series: names(&chart),
        notes: &chart.notes,
        files: &args.output,
    };
    options.show(&document, |out| {
        args.output
            .iter()
            .try_for_each(|file| writeln!(out, "wrote {}: {}", file.display(), chart.title))
    })
}

fn names(chart: &Chart) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for series in chart.panels.iter().flat_map(|panel| &panel.series) {
        if !names.contains(&series.name) {
            names.push(series.name.clone());
        }
    }
    names
}

/// Whether a picture is PNG, else SVG.
fn is_png(path: &Path) -> Result<bool, Failure> {
    match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
        _ if is_stdout(path) => Ok(false),
        Some("svg") => Ok(false),
        Some("png") => Ok(true),
        _ => usage(format!("-o {}: pictures are written as .svg or .png", path.display())),
    }
}

/// The chart of whatever the file is.
fn chart(args: &Args, options: GlobalOptions) -> Result<Chart, Failure> {
    let kind = FileKind::of(&args.file)?;
    args.refuse_unused(kind)?;
    match kind {
        FileKind::Database => of_database(args, options),
        FileKind::Model => of_model(args),
        FileKind::Curve => of_force(args, json::predicted(&args.file)?, &[]),
        FileKind::Scenario if args.train => of_train(args, options),
        FileKind::Scenario => {
            let prepared = scenario::load(&args.file)?;
            let run = prepared.run()?;
            options.warn_all(prepared.warnings.iter().chain(&run.all_warnings()));
            of_motion(args, &Motion::of_run(&prepared.chain, &run, &prepared.order))
        }
        FileKind::Result => {
            let text = file::read(&args.file, MOST_RESULT).map_err(|e| failed_at(&args.file, e))?;
            of_motion(args, &Motion::of_csv(&text).map_err(|e| failed_at(&args.file, e))?)
        }
        FileKind::Solver => of_solver_file(args, options),
    }
}

impl Args {
    /// Refuses options that have no use for the kind of file.
    fn refuse_unused(&self, kind: FileKind) -> Result<(), Failure> {
        let is = |kinds: &[FileKind]| kinds.contains(&kind);
        let of_solver = is(&[FileKind::Solver]);
        for (given, allowed, what) in [
            (self.group.is_some(), is(&[FileKind::Database]), "--group is for a database"),
            (
                self.force.is_some(),
                is(&[FileKind::Database, FileKind::Model, FileKind::Curve]),
                "--force is for a database, model or curve",
            ),
            (self.left_out.is_some(), is(&[FileKind::Database]), "--left-out is for a database"),
            (self.speed.is_some(), is(&[FileKind::Model]), "--speed is for a model"),
            (self.train, is(&[FileKind::Scenario]), "--train is for a scenario"),
            (!self.ids.is_empty(), of_solver, "--id is for a solver file"),
            (!self.components.is_empty(), of_solver, "--component is for a solver file"),
            (self.section.is_some(), of_solver, "--section is for a solver file"),
            (self.format.is_some(), of_solver, "--format is for a solver file"),
            (self.units.is_some(), of_solver, "--units is for a solver file"),
            (self.reading.is_asked(), of_solver, "--curve and the like are for a curve's file"),
        ] {
            if given && !allowed {
                return usage(format!("{what}: {} is {}", self.file.display(), kind.name()));
            }
        }
        Ok(())
    }
}

fn of_database(args: &Args, options: GlobalOptions) -> Result<Chart, Failure> {
    let database = Database::read(&args.file)?;
    let (group, cases) = database.group_or_only(&args.file, args.group.as_deref())?;
    let Some(speed) = args.left_out else {
        let own = cases.first().map_or(ForceKind::Contact, |case| case.curves.force_kind);
        return Ok(charts::group_curves(group, cases, args.force.unwrap_or(own)));
    };
    let _bar = Bar::new(options, "leaving the speed out");
    let choice = Choice::Auto { purpose: Purpose::Vehicle, seed: 0, trees: None };
    Ok(charts::left_out_at(group, cases, speed, choice)?)
}

/// A model's curve over its neighbours.
fn of_model(args: &Args) -> Result<Chart, Failure> {
    let model = Model::read(&args.file)?;
    let Some(speed) = args.speed else { return Err(speed_of_model(&model)) };
    of_force(args, predict(&model, &Query::at(speed))?, &model.cases)
}

/// A curve, or its part of one force.
fn of_force(
    args: &Args,
    curve: PredictedCurve,
    neighbours: &[ModelCase],
) -> Result<Chart, Failure> {
    let curve = match args.force {
        Some(force) => curve.of_force(force)?,
        None => curve,
    };
    Ok(charts::prediction(&curve, neighbours))
}

fn speed_of_model(model: &Model) -> Failure {
    let (low, high) = model.range_m_per_s();
    usage_error(format!(
        "name the speed of the model's curve with --speed ({} to {})",
        km_per_h(low),
        km_per_h(high)
    ))
}

fn of_train(args: &Args, options: GlobalOptions) -> Result<Chart, Failure> {
    let scenario = scenario::read(&args.file)?;
    let settings = ComparisonSettings { nsdm_seeds: 0, ..ComparisonSettings::default() };
    let _bar = Bar::new(options, "comparing in the train");
    let comparison = compare_train(&args.file, &scenario, &settings)?;
    Ok(charts::train_speeds("Train: FE and the methods", &comparison))
}

fn of_motion(args: &Args, motion: &Motion) -> Result<Chart, Failure> {
    let stem = args.file.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let (quantity, ..) =
        QUANTITIES.iter().find(|(_, q, _)| *q == args.quantity).expect("one of the list");
    motion.chart(&format!("{stem}: {quantity}"), args.quantity).ok_or_else(|| {
        usage_error(format!(
            "{} has no energies, which need the masses: give the scenario itself",
            args.file.display()
        ))
    })
}

fn of_solver_file(args: &Args, options: GlobalOptions) -> Result<Chart, Failure> {
    let selection = selection(&args.ids, &args.components, args.section.as_deref());
    let file = match solver::read(&args.file, args.format.as_deref(), &selection) {
        // Not what a solver wrote, so a curve's file, if any reader of these knows it.
        Err(error)
            if args.format.is_none() && (error.is_about("format") || error.is_about("deck")) =>
        {
            let how = ReadOptions { units: args.units, ..args.reading.options() };
            let (curve, _) = read::read(&args.file, &how)
                .map_err(|of_curve| error.followed_by(&format!("; and as a curve: {of_curve}")))?;
            let (title, name) = (args.file.display().to_string(), curve.title.as_deref());
            let (d, f) = (&curve.deflection_m, &curve.force_n);
            let mut chart = charts::file_curve(&title, name.unwrap_or("curve"), d, f);
            let is_change = |n: &&String| n.starts_with("points: ") || n.starts_with("sign: ");
            chart.notes.extend(curve.notes.iter().filter(is_change).cloned());
            return Ok(chart);
        }
        file => file?,
    };
    options.warn_of(&args.file, &file.problems);
    let title = match &file.title {
        Some(title) => format!("{}: {title}", args.file.display()),
        None => args.file.display().to_string(),
    };
    let histories: Vec<_> = file.histories.iter().collect();
    charts::histories(&title, &histories, args.units, args.cfc)
        .map_err(|e| failed_at(&args.file, e))
}
