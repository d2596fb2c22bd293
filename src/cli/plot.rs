//! `crumple plot`: pictures of databases, models, curves, runs and solver files.

use std::path::{Path, PathBuf};

use crate::assess::ComparisonSettings;
use crate::assess::choose::Purpose;
use crate::assess::train::compare_train;
use crate::assess::validate::Choice;
use crate::charts::{self, Motion, Quantity};
use crate::curve::{ForceKind, Parameter};
use crate::database::Database;
use crate::dataset::{TrainingSet, is_same_speed};
use crate::file::{self, write_all_whole};
use crate::formats::read::{self, json};
use crate::formats::{ReadOptions, run_table};
use crate::plot::Chart;
use crate::scenario::{self, CurveOrigin};
use crate::solver::{self, WantedId};
use crate::surrogate::{Model, ModelCase, PredictedCurve, Query, predict};
use crate::sweep::SweepColumns;
use crate::unit::{UnitSystem, km_per_h, speed_m_per_s};

use super::arguments::{self, FileKind, Reading, one_of, selection};
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
  crumple plot result.csv --quantity crush --interface 'A1|A2' -o crush.svg
  crumple plot one.csv other.csv --quantity acceleration -o both.svg    # over one another
  crumple plot sweep.csv --over 'speed_m_per_s[A]' --result mean_deceleration -o sweep.svg
  crumple plot train-set.toml --train -o train.svg                      # FE's train and the methods
  crumple plot run/nodout --id 900001 --component x_velocity --units mm-t-s --cfc 60 -o nodout.svg
The kind of file is recognised by its content. SVG and PNG show the same drawing; \"-o -\" is SVG on standard output.")]
pub(super) struct Args {
    /// Database, model, predicted curve, scenario, result (CSV, MDF), sweep (CSV, HDF5), solver file, or a curve's file (crumple db
    /// add --list); several scenarios or results are drawn over one another
    #[arg(required = true)]
    files: Vec<PathBuf>,
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
    #[arg(long, value_parser = speed_m_per_s, value_name = "SPEED", conflicts_with = "force")]
    left_out: Option<f64>,
    /// Of a database: which case is left out, where several have the speed
    #[arg(long, requires = "left_out")]
    case: Option<String>,
    /// Of a model: speed of the curve
    #[arg(long, value_parser = speed_m_per_s)]
    speed: Option<f64>,
    /// Of a model: value of a further parameter, as NAME=VALUE; may be repeated
    #[arg(long, value_parser = arguments::parameter, value_name = "NAME=VALUE")]
    parameter: Vec<(String, Parameter)>,
    /// Of a scenario or result: quantity to draw (default: velocity)
    #[arg(long, value_parser = one_of(QUANTITIES))]
    quantity: Option<Quantity>,
    /// Of a scenario or result: body to draw; may be repeated (default: every vehicle)
    #[arg(long = "body", value_name = "NAME")]
    bodies: Vec<String>,
    /// Of a scenario or result: interface to draw; may be repeated (default: all)
    #[arg(long = "interface", value_name = "NAME")]
    interfaces: Vec<String>,
    /// Of a sweep: varied quantity to draw over, by its column; may be given twice, for a map
    #[arg(long, value_name = "COLUMN")]
    over: Vec<String>,
    /// Of a sweep: result to draw, by its column, or all of a kind such as peak_force; may be repeated (default:
    /// max_deflection)
    #[arg(long = "result", value_name = "RESULT")]
    results: Vec<String>,
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
    #[arg(long, value_parser = UnitSystem::parse)]
    units: Option<UnitSystem>,
    /// Channel frequency class: of a solver file, also draw filtered lines; of a scenario or result, the class of
    /// accelerations (default: 60)
    #[arg(long, value_name = "CLASS", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    cfc: Option<u32>,
    #[command(flatten)]
    reading: Reading,
    /// Title above the picture (default: what is drawn)
    #[arg(long)]
    title: Option<String>,
    /// Width in pixels (default: 780)
    #[arg(long, value_parser = pixels)]
    width: Option<f64>,
    /// Height of each plot area in pixels (default: 320, of many panels 110)
    #[arg(long, value_parser = pixels)]
    height: Option<f64>,
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
    (
        "acceleration",
        Quantity::Acceleration,
        "Accelerations of the bodies over time, in g, filtered",
    ),
    ("force", Quantity::Force, "Forces of the interfaces over time"),
    ("crush", Quantity::Crush, "Forces of the interfaces over their deflection"),
    ("energy", Quantity::Energy, "Energy over time: taken by each interface, and still kinetic"),
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
    for (file, output) in args.files.iter().flat_map(|f| args.output.iter().map(move |o| (f, o))) {
        keep_input(file, output)?;
    }
    args.output.iter().try_for_each(|output| options.keep_others(output, FileKind::Curve))?;
    let to_stdout = options.on_stdout(&args.output)?;
    let mut chart = chart(args, options)?;
    if let Some(title) = &args.title {
        chart.title.clone_from(title);
    }
    chart.width = args.width.unwrap_or(chart.width);
    chart.height = args.height.unwrap_or(chart.height);
    let drawing = chart.drawing();
    let boxes: String = drawing.boxes().into_iter().take(20).collect();
    if !boxes.is_empty() {
        options.warn(&format!(
            "the pictures' font lacks {boxes:?}: boxes stand for these characters; give another --title or other names, or use crumple report, whose texts are in the browser's fonts"
        ));
    }
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
    let [file, others @ ..] = &args.files[..] else { return usage("name the file") };
    let kind = FileKind::of(file)?;
    args.refuse_unused(file, kind)?;
    for other in others {
        let is_run = |kind| matches!(kind, FileKind::Scenario | FileKind::Result);
        let of_other = FileKind::of(other)?;
        if args.train || !is_run(kind) || !is_run(of_other) {
            let (not, kind) = if is_run(kind) { (other, of_other) } else { (file, kind) };
            return usage(format!(
                "several files: only scenarios and results are drawn over one another: {} is {}",
                not.display(),
                kind.name()
            ));
        }
    }
    match kind {
        FileKind::Database => of_database(args, file, options),
        FileKind::Model => of_model(args, file, options),
        FileKind::Curve => of_force(args, json::predicted(file)?, &[], options),
        FileKind::Scenario if args.train => of_train(file, options),
        FileKind::Scenario | FileKind::Result => of_runs(args, options),
        FileKind::Sweep => {
            let columns = SweepColumns::read(file)?;
            Ok(charts::sweep(&stem(file), &columns, &args.over, &args.results)?)
        }
        FileKind::Solver => of_solver_file(args, file, options),
    }
}

impl Args {
    /// Refuses options that have no use for the kind of file.
    fn refuse_unused(&self, file: &Path, kind: FileKind) -> Result<(), Failure> {
        let is = |kinds: &[FileKind]| kinds.contains(&kind);
        let of_solver = is(&[FileKind::Solver]);
        let of_run = is(&[FileKind::Scenario, FileKind::Result]);
        for (given, allowed, what) in [
            (self.group.is_some(), is(&[FileKind::Database]), "--group is for a database"),
            (
                self.force.is_some(),
                is(&[FileKind::Database, FileKind::Model, FileKind::Curve]),
                "--force is for a database, model or curve",
            ),
            (self.left_out.is_some(), is(&[FileKind::Database]), "--left-out is for a database"),
            (self.speed.is_some(), is(&[FileKind::Model]), "--speed is for a model"),
            (!self.parameter.is_empty(), is(&[FileKind::Model]), "--parameter is for a model"),
            (self.train, is(&[FileKind::Scenario]), "--train is for a scenario"),
            (!self.ids.is_empty(), of_solver, "--id is for a solver file"),
            (!self.components.is_empty(), of_solver, "--component is for a solver file"),
            (self.section.is_some(), of_solver, "--section is for a solver file"),
            (self.format.is_some(), of_solver, "--format is for a solver file"),
            (self.units.is_some(), of_solver, "--units is for a solver file"),
            (
                self.cfc.is_some(),
                of_solver || of_run,
                "--cfc is for a solver file, scenario or result",
            ),
            (self.quantity.is_some(), of_run, "--quantity is for a scenario or result"),
            (!self.bodies.is_empty(), of_run, "--body is for a scenario or result"),
            (!self.interfaces.is_empty(), of_run, "--interface is for a scenario or result"),
            (!self.over.is_empty(), is(&[FileKind::Sweep]), "--over is for a sweep"),
            (!self.results.is_empty(), is(&[FileKind::Sweep]), "--result is for a sweep"),
            (self.reading.is_asked(), of_solver, "--curve and the like are for a curve's file"),
        ] {
            if given && !allowed {
                return usage(format!("{what}: {} is {}", file.display(), kind.name()));
            }
        }
        if of_solver && self.cfc.is_some() && self.units.is_none() {
            return usage("--cfc needs the units of the solver file: give --units, such as mm-t-s");
        }
        let chooses = !self.bodies.is_empty() || !self.interfaces.is_empty();
        if self.train && (self.quantity.is_some() || chooses || self.cfc.is_some()) {
            return usage(
                "--train draws the speeds of all vehicles: remove --quantity, --body, --interface and --cfc",
            );
        }
        let quantity = self.quantity();
        if of_run && self.cfc.is_some() && quantity != Quantity::Acceleration {
            return usage("--cfc is for accelerations: add --quantity acceleration");
        }
        let (unused, of) = match quantity.is_of_interfaces() {
            true => (&self.bodies, "--interface"),
            false => (&self.interfaces, "--body"),
        };
        if !unused.is_empty() {
            return usage(format!("this quantity is chosen with {of}, see --quantity"));
        }
        Ok(())
    }

    fn quantity(&self) -> Quantity {
        self.quantity.unwrap_or(Quantity::Velocity)
    }
}

fn stem(file: &Path) -> String {
    file.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default()
}

fn of_database(args: &Args, file: &Path, options: GlobalOptions) -> Result<Chart, Failure> {
    let database = Database::read(file)?;
    let (group, cases) = database.group_or_only(file, args.group.as_deref())?;
    let Some(speed) = args.left_out else {
        let own = cases.first().map_or(ForceKind::Contact, |case| case.curves.force_kind);
        return Ok(charts::group_curves(group, cases, args.force.unwrap_or(own)));
    };
    let _bar = Bar::new(options, "leaving the speed out");
    let choice = Choice::Auto { purpose: Purpose::Vehicle, seed: 0, trees: None };
    let set = TrainingSet::new(group, cases)?;
    let there = set.cases.iter().filter(|case| is_same_speed(case.speed_m_per_s, speed));
    let names: Vec<&str> = there.map(|case| &*case.name).collect();
    let named = args.case.as_deref();
    if let Some(name) = named.filter(|name| !names.is_empty() && !names.contains(name)) {
        let at = km_per_h(speed);
        return usage(format!("--case {name}: at {at} there is {}", names.join(", ")));
    }
    if let (None, [first, _, ..]) = (named, &names[..]) {
        options.warn(&format!(
            "at {} there are several cases, of which {first} is drawn: choose by --case among {}",
            km_per_h(speed),
            names.join(", ")
        ));
    }
    Ok(charts::left_out_at(group, cases, (speed, named), choice)?)
}

/// A model's curve over its neighbours.
fn of_model(args: &Args, file: &Path, options: GlobalOptions) -> Result<Chart, Failure> {
    let model = Model::read(file)?;
    let Some(speed) = args.speed else { return Err(speed_of_model(&model)) };
    let parameters = arguments::parameters(&args.parameter)?;
    let named: Vec<String> =
        parameters.iter().map(|(name, value)| format!(", {name} = {value}")).collect();
    let query = Query { parameters, ..Query::at(speed) };
    let mut chart = of_force(args, predict(&model, &query)?, &query.runs_of(&model), options)?;
    chart.title += &named.concat();
    Ok(chart)
}

/// A curve, or its part of one force.
fn of_force(
    args: &Args,
    curve: PredictedCurve,
    neighbours: &[ModelCase],
    options: GlobalOptions,
) -> Result<Chart, Failure> {
    options.warn_all(&curve.warnings);
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

fn of_train(file: &Path, options: GlobalOptions) -> Result<Chart, Failure> {
    let scenario = scenario::read(file)?;
    let settings = ComparisonSettings { nsdm_seeds: 0, ..ComparisonSettings::default() };
    let _bar = Bar::new(options, "comparing in the train");
    let comparison = compare_train(file, &scenario, &settings)?;
    Ok(charts::train_speeds("Train: FE and the methods", &comparison))
}

/// One run, or several over one another.
fn of_runs(args: &Args, options: GlobalOptions) -> Result<Chart, Failure> {
    let mut runs: Vec<(String, Motion)> = Vec::new();
    for file in &args.files {
        let motion = if FileKind::of(file)? == FileKind::Scenario {
            let (prepared, origins) = scenario::load_with_origins(file)?;
            let run = prepared.run()?;
            options.warn_all(prepared.warnings.iter().chain(&run.all_warnings()));
            let notes = origins.iter().map(CurveOrigin::text).collect();
            Motion::of_run(&prepared, &run, notes)
        } else {
            let text = file::read(file, MOST_RESULT).map_err(|e| failed_at(file, e))?;
            let table = run_table(text).and_then(|table| Motion::of_csv(&table));
            let motion = table.map_err(|e| failed_at(file, e))?;
            options.warn_of(file, &motion.gaps());
            motion
        };
        let is_alone = args.files.iter().filter(|other| stem(other) == stem(file)).count() == 1;
        runs.push((if is_alone { stem(file) } else { file.display().to_string() }, motion));
    }
    let drawn = args.quantity();
    let (quantity, ..) = QUANTITIES.iter().find(|(_, q, _)| *q == drawn).expect("one of the list");
    let names: Vec<&str> = runs.iter().map(|(name, _)| &**name).collect();
    let title = format!("{}: {quantity}", names.join(", "));
    let chosen = if drawn.is_of_interfaces() { &args.interfaces } else { &args.bodies };
    let class = args.cfc.unwrap_or(charts::USUAL_CLASS);
    Ok(charts::motion(&title, &runs, drawn, chosen, class)?)
}

fn of_solver_file(args: &Args, file: &Path, options: GlobalOptions) -> Result<Chart, Failure> {
    let selection = selection(&args.ids, &args.components, args.section.as_deref());
    let found = match solver::read(file, args.format.as_deref(), &selection) {
        // Not what a solver wrote, so a curve's file, if any reader of these knows it.
        Err(error)
            if args.format.is_none() && (error.is_about("format") || error.is_about("deck")) =>
        {
            let how = ReadOptions { units: args.units, ..args.reading.options() };
            let (curve, _) = read::read(file, &how)
                .map_err(|of_curve| error.followed_by(&format!("; and as a curve: {of_curve}")))?;
            let (title, name) = (file.display().to_string(), curve.title.as_deref());
            let (d, f) = (&curve.deflection_m, &curve.force_n);
            let mut chart = charts::file_curve(&title, name.unwrap_or("curve"), d, f);
            let is_change = |n: &&String| n.starts_with("points: ") || n.starts_with("sign: ");
            chart.notes.extend(curve.notes.iter().filter(is_change).cloned());
            return Ok(chart);
        }
        found => found?,
    };
    options.warn_of(file, &found.problems);
    let title = match &found.title {
        Some(title) => format!("{}: {title}", file.display()),
        None => file.display().to_string(),
    };
    let histories: Vec<_> = found.histories.iter().collect();
    charts::histories(&title, &histories, args.units, args.cfc).map_err(|e| failed_at(file, e))
}
