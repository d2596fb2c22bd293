//! `crumple compare`: FE against the methods at left-out speeds, or in a whole train.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::PathBuf;

use crate::assess::compare::{self, Comparison, NsdmReport};
use crate::assess::train::{TrainComparison, TrainRow, compare_train};
use crate::assess::{ComparisonSettings, Row};
use crate::curve::ForceKind;
use crate::database::Database;
use crate::nsdm::Start;
use crate::rating::Rating;
use crate::scenario;
use crate::unit::{Shown, km_per_h};
use serde::Serialize;

use super::arguments::{self, one_of};
use super::output;
use super::progress::Bar;
use super::{CommandResult, Failure, GlobalOptions, Outcome};

/// Compare FE with FDRM, NSDM, DDTCM and the best model, all in the same multi-body model
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple compare curves.h5 --group lead-car-wall --speed 48km/h
  crumple compare curves.h5 --group lead-car-wall                 # every inner speed, and means
  crumple compare curves.h5 --group lead-car-wall --fixed-speed 36km/h --nsdm-start least-squares
  crumple compare --train train-set.toml
Rows: fe is FE's own contact force in the one-mass model, the floor for predictions of that force;
fe_body is derived from FE's own speeds and checks that curve, force law and run agree; fdrm is
FE's curve at one other speed; nsdm is the spring and damper fitted to that run; ddtcm is the
reference method's random forest and spline; best is the model chosen by leaving speeds out,
without this one, driven by its body force. Errors are sum|p-r|/sum|r| from contact to 30 ms after
FE's maximum crush; accelerations are filtered with CFC 60, unfiltered in brackets. --json has
every measure; those of velocity and acceleration are evaluated at 10 kHz, as by crumple rate.
With --train, a scenario whose curves are database cases is run with the curves of each method, and
the vehicles' speeds are compared with the FE run in its [reference]. rate_live lets the crush
force follow the closing speeds of the run; split_ends gives each vehicle two ends with the mass
that they stop. Several trains are compared one by one and on average.")]
pub(super) struct Args {
    /// Curve database
    #[arg(required_unless_present = "train", conflicts_with = "train")]
    database: Option<PathBuf>,
    /// Group to compare in (default: the only one)
    #[arg(long, conflicts_with = "train")]
    group: Option<String>,
    /// Speed to leave out, with its unit; every inner speed in turn if absent
    #[arg(long, value_parser = arguments::speed, allow_hyphen_values = true, conflicts_with = "train")]
    speed: Option<f64>,
    /// Speed of the one FE run for FDRM and NSDM; the nearest other one if absent
    #[arg(long, value_parser = arguments::speed, conflicts_with = "train")]
    fixed_speed: Option<f64>,
    /// Scenario of a train with FE's run as reference; may be repeated
    #[arg(long)]
    train: Vec<PathBuf>,
    /// Seed of the forest, and first seed of the genetic algorithm
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Fits of the spring and damper, each with its own seed; 0 leaves NSDM out
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u64).range(0..=1000))]
    nsdm_seeds: u64,
    /// Where the genetic algorithm starts
    #[arg(long, value_parser = one_of(STARTS), default_value = "random")]
    nsdm_start: Start,
}

/// Where the genetic algorithm may start.
const STARTS: &[(&str, Start, &str)] = &[
    ("random", Start::Random, "From values drawn evenly, as the reference method has it"),
    (
        "least-squares",
        Start::LeastSquares,
        "A quarter from the values that fit the accelerations best",
    ),
];

/// Comparisons at several speeds.
#[derive(Serialize)]
struct Document {
    comparisons: Vec<Comparison>,
    /// By method, in the order of the rows.
    means: Vec<Mean>,
}

#[derive(Serialize)]
struct Mean {
    method: String,
    /// Which force drives its runs; null for a spring and damper.
    driven_by: Option<ForceKind>,
    velocity_l1: f64,
    acceleration_l1: f64,
    acceleration_unfiltered_l1: f64,
    /// Score of ISO/TS 18571 of velocity and acceleration.
    velocity_iso18571: f64,
    acceleration_iso18571: f64,
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let settings = ComparisonSettings {
        seed: args.seed,
        fixed_speed_m_per_s: args.fixed_speed,
        nsdm_seeds: args.nsdm_seeds,
        nsdm_start: args.nsdm_start,
    };
    if !args.train.is_empty() {
        return trains(&args.train, &settings, options);
    }
    let Some(path) = &args.database else {
        return Err(Failure::Usage("name a database, or --train".into()));
    };
    let database = Database::read(path)?;
    let (group, cases) = database.group_or_only(path, args.group.as_deref())?;
    let speeds = match args.speed {
        Some(speed) => vec![speed],
        None => compare::inner_speeds(group, cases)?,
    };
    let bar = Bar::new(options, "comparing");
    let mut comparisons = Vec::new();
    for speed in speeds {
        bar.step(&format!("comparing at {}", km_per_h(speed)));
        comparisons.push(compare::compare(group, cases, speed, &settings)?);
    }
    bar.end();
    let inner = comparisons.iter().all(|c| c.inner);
    if !inner {
        options.warn("the left-out speed is an end of the range: the models extrapolate");
    }
    if let (Some(_), [comparison]) = (args.speed, &comparisons[..]) {
        if options.json {
            output::print_json(comparison)?;
        } else {
            options.print(|out| print(out, comparison))?;
        }
    } else {
        let document = Document { means: means(&comparisons), comparisons };
        if options.json {
            output::print_json(&document)?;
        } else {
            options.print(|out| {
                for comparison in &document.comparisons {
                    print(out, comparison)?;
                    writeln!(out)?;
                }
                print_means(out, &document)
            })?;
        }
    }
    Ok(if inner { Outcome::Clean } else { Outcome::Warned })
}

fn percent(error: f64) -> String {
    format!("{:.2} %", error * 100.0)
}

fn print(out: &mut dyn Write, comparison: &Comparison) -> io::Result<()> {
    let fe_time = comparison.fe_time_s.map_or(String::new(), |t| format!(", run in {t:.0} s"));
    writeln!(
        out,
        "{} at {} ({}), left out; FE: peak force {}, max crush {:.4} m{fe_time}",
        comparison.group,
        km_per_h(comparison.speed_m_per_s),
        comparison.speed_kind.name(),
        Shown::force(comparison.reference_peak_force_n).text(comparison.reference_peak_force_n),
        comparison.reference_max_crush_m
    )?;
    let rows: Vec<Vec<String>> = comparison.rows.iter().map(cells).collect();
    let heading = [
        "method",
        "driven by",
        "curve",
        "velocity",
        "acceleration",
        "ISO v/a",
        "force",
        "peak force",
        "max crush",
        "fit",
        "predict",
        "run",
        "speed-up",
        "with training",
    ];
    output::table(out, &heading, &rows)?;
    match &comparison.nsdm {
        Some(nsdm) => print_nsdm(out, nsdm),
        None => Ok(()),
    }
}

/// The cells of one method, in the order of the table's heading.
fn cells(row: &Row) -> Vec<String> {
    let score = |rating: &Rating| {
        rating.iso18571.map_or("-".to_string(), |iso| format!("{:.3}", iso.rating))
    };
    let factor = |f: Option<f64>| match f {
        None => "-".into(),
        Some(f) if (0.01..1e3).contains(&f) => format!("{f:.2}"),
        Some(f) => format!("{f:.1e}"),
    };
    let unfiltered = row.acceleration_unfiltered_l1 * 100.0;
    vec![
        row.method.clone(),
        row.driven_by.map_or("spring and damper", ForceKind::name).into(),
        row.curve.clone(),
        percent(row.velocity_l1),
        format!("{} ({unfiltered:.2})", percent(row.acceleration_l1)),
        format!("{}/{}", score(&row.velocity), score(&row.acceleration)),
        row.force_l1.map_or("-".into(), percent),
        Shown::force(row.peak_force_n).text(row.peak_force_n),
        format!("{:.4} m", row.max_crush_m),
        format!("{:.1} ms", row.fit_time_s * 1e3),
        format!("{:.2} ms", row.predict_time_s * 1e3),
        format!("{:.2} ms", row.simulation_time_s * 1e3),
        factor(row.speed_up),
        factor(row.speed_up_with_training),
    ]
}

/// What the fits of the spring and damper are worth.
fn print_nsdm(out: &mut dyn Write, nsdm: &NsdmReport) -> io::Result<()> {
    let range = |of: fn(&compare::NsdmFit) -> f64| {
        let all = || nsdm.fits.iter().map(of);
        let (low, high) = (all().fold(f64::INFINITY, f64::min), all().fold(0.0, f64::max));
        format!("{:.2} to {:.2} %", low * 100.0, high * 100.0)
    };
    writeln!(
        out,
        "nsdm over {} seeds ({} start): velocity {} at its own {}, {} here; acceleration {} and {}",
        nsdm.fits.len(),
        nsdm.start,
        range(|f| f.own_velocity_l1),
        km_per_h(nsdm.fitted_at_m_per_s),
        range(|f| f.velocity_l1),
        range(|f| f.own_acceleration_l1),
        range(|f| f.acceleration_l1),
    )?;
    if let Some(spread) = &nsdm.identifiability {
        writeln!(
            out,
            "nsdm parameters across seeds: stiffness differs by up to {:.0} % of its mean (on average {:.0} %), damping by {:.0} % ({:.0} %)",
            spread.stiffness.largest * 100.0,
            spread.stiffness.mean * 100.0,
            spread.damping.largest * 100.0,
            spread.damping.mean * 100.0
        )?;
    }
    Ok(())
}

fn means(comparisons: &[Comparison]) -> Vec<Mean> {
    let Some(first) = comparisons.first() else { return Vec::new() };
    let score = |rating: &crate::rating::Rating| {
        rating.iso18571.as_ref().map_or(f64::NAN, |iso| iso.rating)
    };
    first
        .rows
        .iter()
        .map(|row| {
            let all = || {
                comparisons.iter().flat_map(|c| &c.rows).filter(|other| other.method == row.method)
            };
            let mean = |of: &dyn Fn(&Row) -> f64| all().map(of).sum::<f64>() / all().count() as f64;
            Mean {
                method: row.method.clone(),
                driven_by: row.driven_by,
                velocity_l1: mean(&|r| r.velocity_l1),
                acceleration_l1: mean(&|r| r.acceleration_l1),
                acceleration_unfiltered_l1: mean(&|r| r.acceleration_unfiltered_l1),
                velocity_iso18571: mean(&|r| score(&r.velocity)),
                acceleration_iso18571: mean(&|r| score(&r.acceleration)),
            }
        })
        .collect()
}

fn print_means(out: &mut dyn Write, document: &Document) -> io::Result<()> {
    let speeds: Vec<String> =
        document.comparisons.iter().map(|c| km_per_h(c.speed_m_per_s)).collect();
    let group = document.comparisons.first().map_or("", |c| &c.group);
    writeln!(out, "{group}: means over {}, each left out in turn", speeds.join(", "))?;
    let rows: Vec<Vec<String>> = document
        .means
        .iter()
        .map(|m| {
            vec![
                m.method.clone(),
                m.driven_by.map_or("spring and damper", ForceKind::name).into(),
                format!("{:.1} %", m.velocity_l1 * 100.0),
                format!(
                    "{:.1} % ({:.1})",
                    m.acceleration_l1 * 100.0,
                    m.acceleration_unfiltered_l1 * 100.0
                ),
                format!("{:.3}", m.velocity_iso18571),
                format!("{:.3}", m.acceleration_iso18571),
            ]
        })
        .collect();
    let heading = [
        "method",
        "driven by",
        "velocity",
        "acceleration",
        "ISO/TS 18571 velocity",
        "acceleration",
    ];
    output::table(out, &heading, &rows)
}

/// Comparisons in several trains.
#[derive(Serialize)]
struct Trains {
    trains: Vec<OneTrain>,
    /// By method, of those that every train has.
    means: Vec<TrainMean>,
}

#[derive(Serialize)]
struct OneTrain {
    scenario: PathBuf,
    #[serde(flatten)]
    comparison: TrainComparison,
}

/// Means over the trains.
#[derive(Serialize)]
struct TrainMean {
    method: String,
    mean_velocity_l1: f64,
    mean_velocity_difference_m_per_s: f64,
    mean_velocity_share_of_initial: f64,
    mean_acceleration_l1: f64,
}

/// `compare --train`.
fn trains(
    paths: &[PathBuf],
    settings: &ComparisonSettings,
    options: GlobalOptions,
) -> CommandResult {
    let bar = Bar::new(options, "comparing in the train");
    let mut trains = Vec::new();
    for path in paths {
        let scenario = scenario::read(path)?;
        let comparison = compare_train(path, &scenario, settings)?;
        trains.push(OneTrain { scenario: path.clone(), comparison });
    }
    bar.end();
    let mut warned = false;
    for train in &trains {
        let of_train = match trains.len() {
            1 => String::new(),
            _ => format!("{}: ", train.scenario.display()),
        };
        for warning in &train.comparison.warnings {
            warned = true;
            options.warn(&format!("{of_train}{warning}"));
        }
        for row in &train.comparison.rows {
            for warning in &row.warnings {
                warned = true;
                options.warn(&format!("{of_train}{}: {warning}", row.method));
            }
        }
    }
    let document = Trains { means: train_means(&trains), trains };
    match (&document.trains[..], options.json) {
        ([one], true) => output::print_json(&one.comparison)?,
        (_, true) => output::print_json(&document)?,
        ([one], false) => options.print(|out| print_train(out, &one.comparison))?,
        (_, false) => options.print(|out| {
            for train in &document.trains {
                writeln!(out, "{}", train.scenario.display())?;
                print_train(out, &train.comparison)?;
                writeln!(out)?;
            }
            print_train_means(out, &document)
        })?,
    }
    Ok(if warned { Outcome::Warned } else { Outcome::Clean })
}

fn train_means(trains: &[OneTrain]) -> Vec<TrainMean> {
    let Some(first) = trains.first() else { return Vec::new() };
    let mut means = Vec::new();
    for row in &first.comparison.rows {
        let all: Option<Vec<&TrainRow>> = trains
            .iter()
            .map(|t| t.comparison.rows.iter().find(|other| other.method == row.method))
            .collect();
        let Some(all) = all else { continue };
        let mean = |of: fn(&TrainRow) -> f64| {
            all.iter().map(|row| of(row)).sum::<f64>() / all.len() as f64
        };
        means.push(TrainMean {
            method: row.method.clone(),
            mean_velocity_l1: mean(|r| r.mean_velocity_l1),
            mean_velocity_difference_m_per_s: mean(|r| r.mean_velocity_difference_m_per_s),
            mean_velocity_share_of_initial: mean(|r| r.mean_velocity_share_of_initial),
            mean_acceleration_l1: mean(|r| r.mean_acceleration_l1),
        });
    }
    means
}

fn print_train_means(out: &mut dyn Write, document: &Trains) -> io::Result<()> {
    writeln!(out, "means over {} trains", document.trains.len())?;
    let row = |m: &TrainMean| {
        vec![
            m.method.clone(),
            format!("{:.1} %", m.mean_velocity_l1 * 100.0),
            format!("{:.3} m/s", m.mean_velocity_difference_m_per_s),
            format!("{:.1} %", m.mean_velocity_share_of_initial * 100.0),
            format!("{:.0} %", m.mean_acceleration_l1 * 100.0),
        ]
    };
    let rows: Vec<Vec<String>> = document.means.iter().map(row).collect();
    output::table(
        out,
        &["method", "velocity", "difference", "of the first speed", "acceleration"],
        &rows,
    )
}

/// Crush and work between the vehicles, by method.
fn print_crush(out: &mut dyn Write, comparison: &TrainComparison) -> io::Result<()> {
    let Some(first) = comparison.rows.first() else { return Ok(()) };
    writeln!(out, "\nlargest crush between vehicles, work of the forces in brackets")?;
    let metres = |m: Option<f64>| m.map_or("-".into(), |m| format!("{m:.4} m"));
    let mut rows = vec![vec!["fe".to_string()]];
    rows[0].extend(first.interfaces.iter().map(|i| metres(i.fe_crush_m)));
    for row in &comparison.rows {
        let mut cells = vec![row.method.clone()];
        let cell = |crush_m: f64, work_j: f64| format!("{crush_m:.4} m ({:.3} MJ)", work_j / 1e6);
        cells.extend(row.interfaces.iter().map(|i| cell(i.crush_m, i.work_j)));
        rows.push(cells);
    }
    let mut heading = vec!["method"];
    heading.extend(first.interfaces.iter().map(|i| i.interface.as_str()));
    output::table(out, &heading, &rows)
}

/// Rows of the table of speeds.
const SPEED_ROWS: usize = 9;

fn print_train(out: &mut dyn Write, comparison: &TrainComparison) -> io::Result<()> {
    let vehicles: Vec<&String> = comparison.fe.keys().collect();
    let fe_time = comparison.fe_time_s.map_or(String::new(), |t| format!("; FE took {t:.0} s"));
    writeln!(
        out,
        "velocity errors up to {:.1} ms, accelerations (CFC 60) in brackets{fe_time}",
        comparison.until_s * 1e3
    )?;
    let rows: Vec<Vec<String>> = comparison
        .rows
        .iter()
        .map(|row| {
            let cell = |v: f64, a: f64| format!("{:.1} % ({:.0})", v * 100.0, a * 100.0);
            let mut cells = vec![
                row.method.clone(),
                row.driven_by.clone(),
                cell(row.mean_velocity_l1, row.mean_acceleration_l1),
                format!(
                    "{:.3} m/s, {:.1} %",
                    row.mean_velocity_difference_m_per_s,
                    row.mean_velocity_share_of_initial * 100.0
                ),
            ];
            cells.extend(row.vehicles.iter().map(|v| cell(v.velocity_l1, v.acceleration_l1)));
            let speeds: Vec<String> = row
                .interface_speeds_m_per_s
                .iter()
                .map(|(name, v)| format!("{name} {}", v.map_or("-".into(), km_per_h)))
                .collect();
            cells.push(speeds.join(", "));
            cells
        })
        .collect();
    let mut heading = vec!["method", "driven by", "mean", "mean, of initial speed"];
    heading.extend(vehicles.iter().map(|v| v.as_str()));
    heading.push("curves at");
    output::table(out, &heading, &rows)?;
    print_crush(out, comparison)?;
    let times: Vec<String> = comparison
        .rows
        .iter()
        .map(|row| format!("{} {:.2} ms", row.method, row.simulation_time_s * 1e3))
        .collect();
    writeln!(out, "time for curves and run: {}", times.join(", "))?;
    writeln!(out, "\nspeeds in m/s")?;
    let step = comparison.time_s.len().div_ceil(SPEED_ROWS).max(1);
    let columns = |of: &BTreeMap<String, Vec<f64>>, i: usize| {
        vehicles.iter().map(|v| format!("{:.2}", of[*v][i])).collect::<Vec<_>>().join(" ")
    };
    let mut rows = Vec::new();
    for i in (0..comparison.time_s.len()).step_by(step) {
        let mut cells = vec![format!("{:.1} ms", comparison.time_s[i] * 1e3)];
        cells.push(columns(&comparison.fe, i));
        cells.extend(comparison.rows.iter().map(|row| columns(&row.velocities, i)));
        rows.push(cells);
    }
    let mut heading = vec!["time", "fe"];
    heading.extend(comparison.rows.iter().map(|row| row.method.as_str()));
    output::table(out, &heading, &rows)
}
