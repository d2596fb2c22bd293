//! `crumple compare`: FE against the methods at left-out speeds, or in a whole train.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::PathBuf;

use crate::assess::compare::{self, Comparison, NsdmReport};
use crate::assess::train::{TrainComparison, TrainRow, compare_train};
use crate::assess::{ComparisonSettings, Row};
use crate::curve::ForceKind;
use crate::database::Database;
use crate::dataset::TrainingSet;
use crate::nsdm::Start;
use crate::rating::Rating;
use crate::rating::acceptance::{ACCEPTANCE, STANDARD};
use crate::scenario;
use crate::table::Table;
use crate::unit::{Shown, km_per_h, speed_m_per_s};
use crate::words::counted;

use super::arguments::one_of;
use super::output::{self, Bar};
use super::{CommandResult, GlobalOptions, Outcome, usage};

/// Compare FE with FDRM, NSDM, DDTCM and the best model, all in the same multi-body model
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple compare curves.h5 --group lead-car-wall --speed 48km/h
  crumple compare curves.h5 --group lead-car-wall                 # every inner speed, and means
  crumple compare curves.h5 --group lead-car-wall --fixed-speed 36km/h --nsdm-start least-squares
  crumple compare --train train-set.toml
Rows: fe is FE's own force, as the recipe extracted it, in the one-mass model: the floor for its
predictions;
fe_body is derived from FE's own speeds, unfiltered, and checks that curve, force law and run agree;
fdrm is FE's curve at one other speed; nsdm is the spring and damper fitted to that run; ddtcm is
the reference method's random forest and spline; best is the model chosen by leaving speeds out,
without this one, driven by its body force. Errors are sum|p-r|/sum|r| from contact to 30 ms after
FE's maximum crush; accelerations are filtered with CFC 60, unfiltered in brackets. --json has
every measure: as one document if --speed has one case, else in the list comparisons; those of
velocity and acceleration are evaluated at 10 kHz, as by crumple rate.
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
    #[arg(long, value_parser = speed_m_per_s, allow_hyphen_values = true, conflicts_with = "train")]
    speed: Option<f64>,
    /// Speed of the one FE run for FDRM and NSDM; the nearest other one if absent, in speed and parameters
    #[arg(long, value_parser = speed_m_per_s, conflicts_with = "train")]
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
    ("random", Start::Random, "From values drawn evenly, as in the reference method"),
    (
        "least-squares",
        Start::LeastSquares,
        "A quarter from the values that fit the accelerations best",
    ),
];

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
        return usage("name a database, or --train");
    };
    let database = Database::read(path)?;
    let (group, cases) = database.group_or_only(path, args.group.as_deref())?;
    let (compared, others) = match args.speed {
        Some(speed) => compare::cases_at(group, cases, speed)?,
        None => compare::inner_cases(group, cases, args.fixed_speed)?,
    };
    let outcome = options.warn_all(&others);
    let bar = Bar::new(options, "comparing");
    let mut comparisons = Vec::new();
    let speeds = TrainingSet::new(group, cases)?.speeds_m_per_s();
    for index in compared {
        bar.step(&format!("comparing at {}", km_per_h(speeds[index])));
        comparisons.push(compare::compare(group, cases, index, &settings)?);
    }
    drop(bar);
    let inner = comparisons.iter().all(|c| c.inner);
    let missing = comparisons.iter().flat_map(|c| {
        let at = km_per_h(c.speed_m_per_s);
        c.missing.iter().map(move |why| format!("at {at} ({}) {why}", c.case))
    });
    let outcome = outcome.max(options.warn_all(missing));
    if !inner {
        options.warn("the left-out speed is an end of the range: the models extrapolate");
    }
    if let (Some(_), [comparison]) = (args.speed, &comparisons[..]) {
        options.show(comparison, |out| print(out, comparison, true))?;
    } else {
        several(&comparisons, options)?;
    }
    Ok(outcome.max(Outcome::warned_if(!inner)))
}

fn percent(error: f64) -> String {
    format!("{:.2} %", error * 100.0)
}

fn print(out: &mut dyn Write, comparison: &Comparison, is_alone: bool) -> io::Result<()> {
    // Where a speed has several cases, which one it is.
    let case = if is_alone { String::new() } else { format!(", {}", comparison.case) };
    let mut more = comparison.fe_time_s.map_or(String::new(), |t| format!(", run in {t:.0} s"));
    if comparison.window_is_cut {
        let window_ms = comparison.window_s * 1e3;
        more += &format!("; its record ends at {window_ms:.0} ms, and the comparison with it");
    }
    writeln!(
        out,
        "{} at {} ({}){case}, left out; FE: peak force {}, max crush {:.4} m{more}",
        comparison.group,
        km_per_h(comparison.speed_m_per_s),
        comparison.speed_kind.name(),
        Shown::one_force(comparison.reference_peak_force_n),
        comparison.reference_max_crush_m
    )?;
    let milliseconds = |time_s: f64| format!("{:.2} ms", time_s * 1e3);
    let factor = |f: Option<f64>| match f {
        None => "-".into(),
        Some(f) if (0.01..1e3).contains(&f) => format!("{f:.2}"),
        Some(f) => format!("{f:.1e}"),
    };
    let table = Table::of(&comparison.rows)
        .column("method", |row| &row.method)
        .column("driven by", |row| driven_by(row.driven_by))
        .column("curve", |row| match row.held_from_m() {
            Some(end) => format!("{}, held from {end:.3} m", row.curve),
            None => row.curve.clone(),
        })
        .column("velocity", |row| percent(row.velocity_l1))
        .column("acceleration", |row| {
            let unfiltered = row.acceleration_unfiltered_l1 * 100.0;
            format!("{} ({unfiltered:.2})", percent(row.acceleration_l1))
        })
        .column("ISO v/a", |row| {
            let score = |of: &Rating| score(of).map_or("-".into(), |score| format!("{score:.3}"));
            format!("{}/{}", score(&row.velocity), score(&row.acceleration))
        })
        .column("force", |row| row.force_l1.map_or("-".into(), percent))
        .column("peak force", |row| Shown::one_force(row.peak_force_n))
        .column("max crush", |row| format!("{:.4} m", row.max_crush_m))
        .column("within 10 %", |row| match row.acceptance.passes {
            true => "yes".into(),
            false => format!("no, {:.0} %", 100.0 * row.acceptance.worst()),
        })
        .column("fit", |row| format!("{:.1} ms", row.fit_time_s * 1e3))
        .column("predict", |row| milliseconds(row.predict_time_s))
        .column("run", |row| milliseconds(row.simulation_time_s))
        .column("speed-up", |row| factor(row.speed_up))
        .column("with training", |row| factor(row.speed_up_with_training));
    output::table(out, table)?;
    match &comparison.nsdm {
        Some(nsdm) => print_nsdm(out, nsdm),
        None => Ok(()),
    }
}

/// The score of ISO/TS 18571.
fn score(rating: &Rating) -> Option<f64> {
    rating.iso18571.map(|iso| iso.rating)
}

fn driven_by(force: Option<ForceKind>) -> &'static str {
    force.map_or("spring and damper", ForceKind::name)
}

/// What the fits of the spring and damper are worth.
fn print_nsdm(out: &mut dyn Write, nsdm: &NsdmReport) -> io::Result<()> {
    let range = |of: fn(&compare::NsdmFit) -> f64| {
        let all = || nsdm.fits.iter().map(of);
        let (low, high) = (all().fold(f64::INFINITY, f64::min), all().fold(0.0, f64::max));
        match nsdm.fits.len() {
            1 => percent(low),
            _ => format!("{:.2} to {:.2} %", low * 100.0, high * 100.0),
        }
    };
    writeln!(
        out,
        "nsdm over {} ({} start): velocity {} at its own {}, {} here; acceleration {} and {}",
        counted(nsdm.fits.len(), "seed"),
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

/// Comparisons at several speeds, and their means by method.
fn several(comparisons: &[Comparison], options: GlobalOptions) -> CommandResult {
    let rows = comparisons.first().map_or(&[][..], |first| &first.rows);
    let rows = rows.iter().filter(|row| compare::has_all(comparisons, &row.method));
    let means = rows.map(|row| {
        let mean = |of: &dyn Fn(&Row) -> f64| compare::mean(comparisons, &row.method, of);
        let score = |rating: &Rating| score(rating).unwrap_or(f64::NAN);
        document! {
            method: &row.method,
            driven_by: row.driven_by,
            velocity_l1: mean(&|r| r.velocity_l1),
            acceleration_l1: mean(&|r| r.acceleration_l1),
            acceleration_unfiltered_l1: mean(&|r| r.acceleration_unfiltered_l1),
            velocity_iso18571: mean(&|r| score(&r.velocity)),
            acceleration_iso18571: mean(&|r| score(&r.acceleration)),
            accepted: comparisons.iter().flat_map(|c| &c.rows)
                .filter(|r| r.method == row.method && r.acceptance.passes)
                .count(),
        }
    });
    let means: Vec<_> = means.collect();
    options.show(&document! { comparisons: comparisons, means: &means }, |out| {
        let at = |c: &Comparison| km_per_h(c.speed_m_per_s);
        let is_alone = |c: &Comparison| comparisons.iter().filter(|o| at(o) == at(c)).count() == 1;
        let named = |c: &Comparison| match is_alone(c) {
            true => at(c),
            false => format!("{} ({})", at(c), c.case),
        };
        for comparison in comparisons {
            print(out, comparison, is_alone(comparison))?;
            writeln!(out)?;
        }
        let speeds: Vec<String> = comparisons.iter().map(named).collect();
        let group = comparisons.first().map_or("", |c| &c.group);
        writeln!(out, "{group}: means over {}, each left out in turn", speeds.join(", "))?;
        let table = Table::of(&means)
            .column("method", |m| m.method)
            .column("driven by", |m| driven_by(m.driven_by))
            .column("velocity", |m| format!("{:.1} %", m.velocity_l1 * 100.0))
            .column("acceleration", |m| {
                let unfiltered = m.acceleration_unfiltered_l1 * 100.0;
                format!("{:.1} % ({unfiltered:.1})", m.acceleration_l1 * 100.0)
            })
            .column("ISO/TS 18571 velocity", |m| format!("{:.3}", m.velocity_iso18571))
            .column("acceleration", |m| format!("{:.3}", m.acceleration_iso18571))
            .column("within 10 %", |m| format!("{} of {}", m.accepted, comparisons.len()));
        output::table(out, table)?;
        for m in &means {
            let held = comparisons.iter().filter(|c| {
                c.rows.iter().any(|row| row.method == *m.method && row.held_from_m().is_some())
            });
            let speeds: Vec<String> = held.map(named).collect();
            if !speeds.is_empty() {
                writeln!(
                    out,
                    "{}: at {} the mass goes beyond its curve's data, where the last force is held",
                    m.method,
                    speeds.join(", ")
                )?;
            }
        }
        writeln!(out, "within 10 %: {ACCEPTANCE} ({STANDARD})")
    })
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
        trains.push((path, compare_train(path, &scenario, settings)?));
    }
    drop(bar);
    let mut outcome = Outcome::Clean;
    for (path, train) in &trains {
        let of_train =
            if trains.len() == 1 { String::new() } else { format!("{}: ", path.display()) };
        // What several methods say is said once.
        let mut said: Vec<(&str, Vec<&str>)> = Vec::new();
        for row in &train.rows {
            for warning in &row.warnings {
                match said.iter_mut().find(|(text, _)| text == warning) {
                    Some((_, methods)) => methods.push(&row.method),
                    None => said.push((warning, vec![&row.method])),
                }
            }
        }
        let of_rows = said.iter().map(|(text, methods)| format!("{}: {text}", methods.join(", ")));
        let warnings = train.warnings.iter().cloned().chain(of_rows);
        outcome = outcome.max(options.warn_all(warnings.map(|w| format!("{of_train}{w}"))));
    }
    if let [(_, one)] = &trains[..] {
        options.show(one, |out| print_train(out, one))?;
        return Ok(outcome);
    }
    // By method, of those that every train has.
    let rows = trains.first().map_or(&[][..], |(_, first)| &first.rows);
    let means = rows.iter().filter_map(|row| {
        let of_train =
            trains.iter().map(|(_, train)| train.rows.iter().find(|r| r.method == row.method));
        let all = of_train.collect::<Option<Vec<&TrainRow>>>()?;
        let mean =
            |of: fn(&TrainRow) -> f64| all.iter().map(|r| of(r)).sum::<f64>() / all.len() as f64;
        Some(document! {
            method: &row.method,
            mean_velocity_l1: mean(|r| r.mean_velocity_l1),
            mean_velocity_difference_m_per_s: mean(|r| r.mean_velocity_difference_m_per_s),
            mean_velocity_share_of_initial: mean(|r| r.mean_velocity_share_of_initial),
            mean_acceleration_l1: mean(|r| r.mean_acceleration_l1),
        })
    });
    let means: Vec<_> = means.collect();
    let documents = trains.iter().map(|(path, comparison)| {
        document! { scenario: path, #[serde(flatten)] comparison: comparison }
    });
    let document = document! { trains: documents.collect::<Vec<_>>(), means: &means };
    options.show(&document, |out| {
        for (path, train) in &trains {
            writeln!(out, "{}", path.display())?;
            print_train(out, train)?;
            writeln!(out)?;
        }
        writeln!(out, "means over {} trains", trains.len())?;
        let share = |share: f64| format!("{:.1} %", share * 100.0);
        let table = Table::of(&means)
            .column("method", |m| m.method)
            .column("velocity", |m| share(m.mean_velocity_l1))
            .column("difference", |m| format!("{:.3} m/s", m.mean_velocity_difference_m_per_s))
            .column("of the first speed", |m| share(m.mean_velocity_share_of_initial))
            .column("acceleration", |m| format!("{:.0} %", m.mean_acceleration_l1 * 100.0));
        output::table(out, table)
    })?;
    Ok(outcome)
}

/// Crush and work between the vehicles, by method.
fn print_crush(out: &mut dyn Write, comparison: &TrainComparison) -> io::Result<()> {
    let Some(first) = comparison.rows.first() else { return Ok(()) };
    writeln!(out, "\nlargest crush between vehicles, work of the forces in brackets")?;
    // FE's row comes first.
    let rows = std::iter::once(None).chain(comparison.rows.iter().map(Some));
    let methods = Table::of(rows).column("method", |row| row.map_or("fe", |row| &row.method));
    let table = first.interfaces.iter().fold(methods, |table, interface| {
        table.column(&interface.interface, |row| match row {
            None => interface.fe_crush_m.map_or("-".into(), |m| format!("{m:.4} m")),
            Some(row) => {
                let own = row.interfaces.iter().find(|own| own.interface == interface.interface);
                own.map_or("-".into(), |own| {
                    format!("{:.4} m ({:.3} MJ)", own.crush_m, own.work_j / 1e6)
                })
            }
        })
    });
    output::table(out, table)
}

/// Rows of the table of speeds.
const SPEED_ROWS: usize = 9;

fn print_train(out: &mut dyn Write, comparison: &TrainComparison) -> io::Result<()> {
    let vehicles: Vec<&String> = comparison.fe.keys().collect();
    let fe_time = comparison.fe_time_s.map_or(String::new(), |t| format!("; FE took {t:.0} s"));
    writeln!(
        out,
        "velocity errors up to {:.1} ms, accelerations ({}) in brackets{fe_time}",
        comparison.until_s * 1e3,
        comparison.filter()
    )?;
    let cell = |v: f64, a: f64| format!("{:.1} % ({:.0})", v * 100.0, a * 100.0);
    let mut table = Table::of(&comparison.rows)
        .column("method", |row| &row.method)
        .column("driven by", |row| &row.driven_by)
        .column("mean", |row| cell(row.mean_velocity_l1, row.mean_acceleration_l1))
        .column("mean, of initial speed", |row| {
            let share = row.mean_velocity_share_of_initial * 100.0;
            format!("{:.3} m/s, {share:.1} %", row.mean_velocity_difference_m_per_s)
        });
    for (k, vehicle) in vehicles.iter().enumerate() {
        let of =
            |row: &&TrainRow| cell(row.vehicles[k].velocity_l1, row.vehicles[k].acceleration_l1);
        table = table.column(*vehicle, of);
    }
    table = table.column("curves at", |row| {
        let speed = |(name, v): (&String, &Option<f64>)| {
            format!("{name} {}", v.map_or("-".into(), km_per_h))
        };
        row.interface_speeds_m_per_s.iter().map(speed).collect::<Vec<_>>().join(", ")
    });
    output::table(out, table)?;
    print_crush(out, comparison)?;
    let time = |row: &TrainRow| format!("{} {:.2} ms", row.method, row.simulation_time_s * 1e3);
    let times: Vec<String> = comparison.rows.iter().map(time).collect();
    writeln!(out, "time for curves and run: {}", times.join(", "))?;
    writeln!(out, "\nspeeds in m/s")?;
    let step = comparison.time_s.len().div_ceil(SPEED_ROWS).max(1);
    let speeds = |of: &BTreeMap<String, Vec<f64>>, i: usize| {
        vehicles.iter().map(|v| format!("{:.2}", of[*v][i])).collect::<Vec<_>>().join(" ")
    };
    let mut table = Table::of((0..comparison.time_s.len()).step_by(step))
        .column("time", |i| format!("{:.1} ms", comparison.time_s[*i] * 1e3))
        .column("fe", |i| speeds(&comparison.fe, *i));
    for row in &comparison.rows {
        table = table.column(&row.method, |i| speeds(&row.velocities, *i));
    }
    output::table(out, table)
}
