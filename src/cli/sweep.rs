//! `crumple sweep`: many runs of a scenario, and `crumple sweep merge`.

use crate::order;
use crate::words::counted;
use std::fs::OpenOptions;
use std::io::{self, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use crate::plan::OVER_LIMITS;
use crate::sweep::{
    self, Precision, Report, Sensitivity, Shard, Sweep, WriteOptions, is_hdf5, share_interval,
};
use crate::table::Table;

use super::arguments::FileKind;
use super::output::{self, Bar};
use super::{
    CommandResult, Failure, GlobalOptions, Outcome, failed, is_stdout, keep_input, keep_inputs,
    usage,
};

/// Run a scenario many times with varied speeds, masses, gaps and curves; a row of results each
///
/// The scenario's [sweep] table, or a separate file (--plan), defines what is varied. Rows
/// are in order of items and do not depend on the number of threads (RAYON_NUM_THREADS) and
/// shards. An interrupted sweep resumes when the same command is given again.
#[derive(clap::Args)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "Examples:
  crumple sweep scenario.toml --dry-run
  crumple sweep scenario.toml -o results.csv
  crumple sweep scenario.toml --plan plan.toml -o results.h5
  crumple sweep scenario.toml --shard 2/3 -o part2.csv
  crumple sweep scenario.toml --until over_limits=0.02 -o results.csv      # the share within ±2 %
  crumple sweep merge -o results.csv part1.csv part2.csv part3.csv
Results that [sweep] may name: peak_force, max_deflection, max_deflection_time, restitution, final_speed,
mean_deceleration, energy_error, momentum_error (these if none are named), moving_mean_deceleration,
main_mean_deceleration, secondary_impact, occupant_load, energy, over_limits."
)]
pub(super) struct Args {
    #[command(subcommand)]
    command: Option<Command>,
    /// Scenario (TOML) with a [sweep] table
    #[arg(required = true)]
    scenario: Option<PathBuf>,
    /// File (TOML) whose [sweep] table replaces the scenario's
    #[arg(long, value_name = "PLAN")]
    plan: Option<PathBuf>,
    /// Where to write: .csv, .h5 or .hdf5; "-" is CSV on standard output
    #[arg(short, long, required_unless_present = "dry_run")]
    output: Option<PathBuf>,
    /// Run block I of N blocks of the items
    #[arg(long, value_name = "I/N", value_parser = shard)]
    shard: Option<Shard>,
    /// Stop as soon as the mean of a result (of over_limits the share of runs) is known within ±HALFWIDTH, in the
    /// column's unit, with 95 % confidence. All variables must be drawn at random; the plan's samples are the upper limit
    #[arg(long, value_name = "COLUMN=HALFWIDTH", value_parser = precision, conflicts_with_all = ["shard", "dry_run"])]
    until: Option<Precision>,
    /// Start from the beginning and discard the results of an earlier run
    #[arg(long)]
    restart: bool,
    /// Show what would be run, without running it
    #[arg(long)]
    dry_run: bool,
}

#[derive(clap::Subcommand)]
enum Command {
    /// Join the files of all shards of a sweep, in any order
    #[command(after_help = "Examples:
  crumple sweep merge -o results.csv part*.csv
  crumple sweep merge -o results.h5 part*.csv")]
    Merge {
        /// Files of all shards (.csv)
        #[arg(required = true)]
        shards: Vec<PathBuf>,
        /// Where to write: .csv, .h5 or .hdf5
        #[arg(short, long)]
        output: PathBuf,
    },
}

/// A share of the work: `2/3`.
fn shard(text: &str) -> Result<Shard, String> {
    let parsed = text
        .split_once('/')
        .and_then(|(index, count)| Shard::new(index.parse().ok()?, count.parse().ok()?));
    parsed.ok_or_else(|| {
        format!("\"{text}\" is not a shard: write for example 2/3, the second of three")
    })
}

/// A precision: `over_limits=0.02`.
fn precision(text: &str) -> Result<Precision, String> {
    let parsed = text.rsplit_once('=').and_then(|(column, half_width)| {
        let half_width = half_width.parse::<f64>().ok()?;
        let is_sound = half_width > 0.0 && half_width.is_finite() && !column.is_empty();
        is_sound.then(|| Precision { column: column.into(), half_width })
    });
    parsed.ok_or_else(|| format!("\"{text}\" is not a precision: write for example over_limits=0.02, or max_deflection_m[A1|wall]=0.005"))
}

/// Rows that a dry run shows.
const SHOWN: u64 = 5;

pub(super) fn run(args: &Args, global: GlobalOptions) -> CommandResult {
    if let Some(Command::Merge { shards, output }) = &args.command {
        return merge(shards, output, global);
    }
    let Some(scenario) = &args.scenario else {
        return usage("name the scenario");
    };
    if let Some(output) = &args.output {
        keep_inputs(scenario, output)?;
        if let Some(plan) = &args.plan {
            keep_input(plan, output)?;
        }
        check_output(output)?;
        global.keep_others(output, FileKind::Sweep)?;
        if args.shard.is_some_and(|shard| shard != Shard::WHOLE) && is_hdf5(output) {
            return usage(format!(
                "-o {}: a shard is written as .csv, which merge joins and writes as .csv, .h5 or .hdf5",
                output.display()
            ));
        }
        global.on_stdout([output])?;
    }
    let begun = Instant::now();
    let mut sweep = Sweep::load(scenario, args.plan.as_deref())?;
    global.warn_all(sweep.warnings().iter().map(|w| format!("the scenario as written: {w}")));
    let shard = args.shard.unwrap_or(Shard::WHOLE);
    let output = match &args.output {
        Some(output) if !args.dry_run => output,
        _ => return dry_run(&sweep, shard, global),
    };
    // What is of another kind is not resumed.
    let replaces = global.overwrite && output.is_file() && FileKind::of(output)? != FileKind::Sweep;
    let restart = args.restart || replaces;
    let options = WriteOptions { shard, restart, ..WriteOptions::default() };
    let (report, reached) = match &args.until {
        Some(precision) => until(&mut sweep, output, precision, &options, global)?,
        None => (write(&sweep, output, &options, global)?, None),
    };
    if !report.is_complete() {
        let Report { done, rows, .. } = report;
        let message =
            format!("stopped after {done} of {rows} rows; the same command resumes there");
        return Err(failed(message));
    }
    let design = Design { is_random: sweep.is_random(), is_grid: sweep.is_grid() };
    say(&report, design, reached.as_ref(), begun, output, global)
}

/// Both kinds of results, by the name of the file; a device takes CSV.
fn check_output(output: &Path) -> Result<(), Failure> {
    let is_device = output.metadata().is_ok_and(|meta| !meta.is_file());
    match output.extension().and_then(|e| e.to_str()) {
        _ if is_stdout(output) || is_device => Ok(()),
        Some("csv" | "h5" | "hdf5") => Ok(()),
        _ => usage(format!("-o {}: results are written as .csv, .h5 or .hdf5", output.display())),
    }
}

fn write(
    sweep: &Sweep,
    output: &Path,
    options: &WriteOptions,
    global: GlobalOptions,
) -> Result<Report, Failure> {
    let items = options.shard.items(sweep.items());
    let bar = Bar::over(global, items.end - items.start);
    let is_device = output.metadata().is_ok_and(|meta| !meta.is_file() && !meta.is_dir());
    if is_stdout(output) || is_device {
        let mut progress = progress(&bar, None);
        let mut write =
            |out: &mut dyn Write| sweep::write_rows(sweep, out, output, options, &mut progress);
        if is_stdout(output) {
            output::print_data(write)
        } else {
            let device = OpenOptions::new().write(true).open(output);
            let failed = |source| crate::file::not_written(output, source);
            Ok(write(&mut device.map_err(failed)?)?)
        }
    } else {
        Ok(sweep::write(sweep, output, options, progress(&bar, Some(stop_flag())))?)
    }
}

/// Moves a bar, and breaks once a flag is set.
fn progress(bar: &Bar, stop: Option<Arc<AtomicBool>>) -> impl FnMut(u64) -> ControlFlow<()> {
    let mut is_first = true;
    move |done| {
        bar.set(done, std::mem::take(&mut is_first));
        match stop.as_ref().is_some_and(|stop| stop.load(Ordering::Relaxed)) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }
}

/// Set by the first Ctrl-C (or SIGTERM), so that a run ends after the chunk it is at; the
/// second one ends it at once, which loses that chunk only.
fn stop_flag() -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        // In this order: the first signal sets what the second one finds. Without the handlers Ctrl-C ends the run at
        // once, and nothing is lost either.
        let _ = flag::register_conditional_shutdown(signal, 130, Arc::clone(&stop));
        let _ = flag::register(signal, Arc::clone(&stop));
    }
    stop
}

fn merge(shards: &[PathBuf], output: &Path, global: GlobalOptions) -> CommandResult {
    check_output(output)?;
    global.keep_others(output, FileKind::Sweep)?;
    for input in shards {
        keep_input(input, output)?;
    }
    let begun = Instant::now();
    let design = Design { is_random: false, is_grid: false };
    say(&sweep::merge(shards, output)?, design, None, begun, output, global)
}

/// What is known about the items: whether they are a random sample, or a grid alone.
#[derive(Clone, Copy)]
struct Design {
    is_random: bool,
    is_grid: bool,
}

/// Prints what was done, with what was reached of a stated precision.
fn say(
    report: &Report,
    Design { is_random, is_grid }: Design,
    reached: Option<&Reached>,
    begun: Instant,
    output: &Path,
    global: GlobalOptions,
) -> CommandResult {
    let seconds = begun.elapsed().as_secs_f64();
    if report.failed > 0 {
        let mut text = format!(
            "{} of {} items failed; their rows give the reason",
            report.failed, report.rows
        );
        for (item, message) in &report.messages {
            text.push_str(&format!("\n  item {item}: {message}"));
        }
        global.warn(&text);
    }
    if report.warned > 0 {
        let mut reasons: Vec<&(String, u64)> = report.reasons.iter().collect();
        order::sort_by_key(&mut reasons, |(_, count)| std::cmp::Reverse(*count));
        let shown =
            reasons.iter().take(SHOWN_REASONS).map(|(text, count)| format!("{count} × {text}"));
        let mut shown: Vec<String> = shown.collect();
        if reasons.len() > SHOWN_REASONS {
            shown.push(counted(reasons.len() - SHOWN_REASONS, "further kind"));
        }
        let (warned, rows, reasons) = (report.warned, report.rows, shown.join("\n  "));
        global.warn(&format!("{warned} of {rows} items have warnings in their rows:\n  {reasons}"));
    }
    let is_short = reached.is_some_and(|reached| !reached.is_reached);
    let outcome = match report.failed {
        // A shard is a part: that all of its items fail says nothing of the sweep, and its rows are joined with the others.
        failed if failed > 0 && failed == report.rows && report.shard == Shard::WHOLE => {
            Outcome::Partly
        }
        failed => Outcome::warned_if(failed + report.warned > 0 || is_short),
    };
    if is_stdout(output) {
        return Ok(outcome);
    }
    let share = ShareOverLimits::of(report, is_random);
    let most_varied = if global.verbose { usize::MAX } else { MOST_VARIED };
    let document = document! { #[serde(flatten)] report: report, share_over_limits if_any: share.as_ref(), until if_any: reached, seconds: seconds, output: output };
    global.show(&document, |out| {
        output::table(out, statistics(report, is_grid, most_varied))?;
        let varied = varied(report, most_varied);
        let chosen = varied.iter().flatten().any(|varied| is_choice(varied));
        if let Some(least) = varied.and(report.sensitivities.iter().map(|s| s.rows).min()) {
            // Values drawn at the points of a grid are as random as those of a sample.
            let chance = match is_grid {
                false => format!("; below {:.2} it may be chance", 2.0 / (least as f64).sqrt()),
                true => String::new(),
            };
            let chosen = match chosen {
                true => "; of a choice of curves, which have no order, the correlation ratio of the ranks (0 to 1)",
                false => "",
            };
            writeln!(out, "rank corr.: Spearman's rank correlation{chance}{chosen}")?;
        } else if !report.sensitivities.is_empty() {
            writeln!(
                out,
                "rank correlations of more than {MOST_VARIED} varied quantities: with --verbose or --json"
            )?;
        }
        print_unknown(out, report)?;
        if let Some(share) = &share {
            writeln!(out, "over a limit: {}", share.text())?;
        }
        if let Some(reached) = reached {
            writeln!(out, "{}", reached.text(report.rows))?;
        }
        let resumed = match report.resumed {
            0 => String::new(),
            n if n == report.rows => ", all from an earlier run".into(),
            n => format!(", {n} of them from an earlier run"),
        };
        let (items, failed) = (counted(report.rows, "item"), report.failed);
        writeln!(out, "{items}{resumed}, {failed} failed, {seconds:.1} s")?;
        if report.resumed == report.rows && report.rows > 0 {
            writeln!(out, "{} is complete: nothing was left to run", output.display())
        } else {
            writeln!(out, "wrote {}", output.display())
        }
    })?;
    Ok(outcome)
}

/// Reasons of warnings that are printed.
const SHOWN_REASONS: usize = 3;

/// Runs samples until the precision is reached; the report, and a sentence about it.
fn until(
    sweep: &mut Sweep,
    output: &Path,
    precision: &Precision,
    options: &WriteOptions,
    global: GlobalOptions,
) -> Result<(Report, Option<Reached>), Failure> {
    if is_stdout(output) {
        return usage("--until writes one .csv file, which it makes longer: name it with -o");
    }
    let bar = Bar::over(global, sweep.items());
    let step = progress(&bar, Some(stop_flag()));
    let (report, half_width) = sweep::write_until(sweep, output, precision, options, step)?;
    let Precision { column, half_width: wanted } = precision;
    let of = report.columns.iter().find(|of| of.column == *column);
    let reached = Reached {
        column: column.clone(),
        mean: of.and_then(|of| of.mean),
        half_width,
        wanted: *wanted,
        numbers: of.map_or(0, |of| of.count),
        is_reached: half_width.is_some_and(|half_width| half_width <= *wanted),
    };
    if !reached.is_reached && report.is_complete() {
        let lasting = of.map_or(0.0, |of| of.lasting_half_width(report.rows));
        let why = if lasting > *wanted {
            let unknown = report.rows - reached.numbers;
            format!(
                "it is not known in {unknown} of {}, {} of which failed; that alone leaves ± {}, however many there are: give longer curves or a longer duration",
                counted(report.rows, "run"),
                report.failed,
                digits(lasting)
            )
        } else {
            "state more samples in [sweep]".into()
        };
        global.warn(&format!("{column}: ± {wanted} is not reached: {why}"));
    }
    Ok((report, Some(reached)))
}

/// What was reached of a stated precision.
#[derive(serde::Serialize)]
struct Reached {
    column: String,
    mean: Option<f64>,
    /// Half of the 95 % confidence interval.
    half_width: Option<f64>,
    wanted: f64,
    /// Rows that have a number.
    numbers: u64,
    is_reached: bool,
}

impl Reached {
    fn text(&self, rows: u64) -> String {
        let Self { column, wanted, numbers, is_reached, .. } = self;
        let known = match self.mean.zip(self.half_width) {
            Some((mean, half_width)) => {
                let verdict = if *is_reached { "reached" } else { "not reached" };
                format!("{} ± {} (95 %); ± {wanted} {verdict}", digits(mean), digits(half_width))
            }
            None => "not known: too few runs have a number".into(),
        };
        let without = match rows - numbers {
            0 => String::new(),
            without => format!(" ({without} have no number)"),
        };
        format!("{column} after {}{without}: {known}", counted(rows, "run"))
    }
}

/// Percentiles are those of a distribution: a grid has none.
fn statistics(report: &Report, is_grid: bool, most_varied: usize) -> impl Into<Table> {
    let number = |value: Option<f64>| value.map_or("-".into(), digits);
    let table =
        Table::of(&report.columns).column("column", |c| &c.column).column("min", |c| number(c.min));
    let table = match is_grid {
        true => table,
        false => table
            .column("5 %", |c| number(c.p5))
            .column("median", |c| number(c.median))
            .column("95 %", |c| number(c.p95)),
    };
    let table = table.column("max", |c| number(c.max)).column("mean", |c| number(c.mean));
    let sensitivities = &report.sensitivities;
    varied(report, most_varied).unwrap_or_default().into_iter().fold(table, |table, varied| {
        table.column(format!("rank corr. {varied}"), move |column| {
            let mut of = sensitivities.iter();
            let of = of.find(|of| of.varied == varied && of.result == column.column);
            let text = |of: &Sensitivity| match is_choice(varied) {
                true => format!("{:.2}", of.rank_correlation),
                false => format!("{:+.2}", of.rank_correlation),
            };
            of.map_or("-".into(), text)
        })
    })
}

/// Varied quantities that a table has room for; with --verbose and as JSON there are all.
const MOST_VARIED: usize = 6;

/// Whether a column holds names of curves.
fn is_choice(column: &str) -> bool {
    column.starts_with("curve[")
}

/// What results may follow, if a table has room for it.
fn varied(report: &Report, most: usize) -> Option<Vec<&str>> {
    let mut varied: Vec<&str> = report.sensitivities.iter().map(|s| &*s.varied).collect();
    varied.sort_unstable();
    varied.dedup();
    Some(varied).filter(|varied| (1..=most).contains(&varied.len()))
}

/// Which columns' numbers are those of some rows only.
fn print_unknown(out: &mut dyn Write, report: &Report) -> io::Result<()> {
    let done = report.rows - report.failed;
    let unknown: Vec<_> = report.columns.iter().filter(|c| c.count < done).collect();
    if unknown.is_empty() {
        return Ok(());
    }
    let shown = unknown.iter().take(MOST_VARIED);
    let mut shown: Vec<String> =
        shown.map(|c| format!("{} (known in {} of {done})", c.column, c.count)).collect();
    if unknown.len() > MOST_VARIED {
        shown.push(format!("{} further columns", unknown.len() - MOST_VARIED));
    }
    writeln!(out, "numbers of some rows only: {}", shown.join(", "))
}

/// Of how many runs a vehicle is over a limit.
#[derive(serde::Serialize)]
struct ShareOverLimits {
    over: u64,
    /// Runs of which it is not known.
    unknown: u64,
    rows: u64,
    /// What holds the share of all possible runs with 95 % probability, if these were drawn at random and each has a verdict.
    #[serde(rename = "interval_95")]
    interval: Option<(f64, f64)>,
}

impl ShareOverLimits {
    fn of(report: &Report, is_random: bool) -> Option<Self> {
        let column = report.columns.iter().find(|c| c.column == OVER_LIMITS)?;
        let (rows, unknown) = (report.rows, report.rows - column.count);
        if rows == 0 {
            return None;
        }
        let over = (column.mean.unwrap_or(0.0) * column.count as f64).round();
        // A run over a limit is known sooner than one that keeps to all: the known ones are not a random sample.
        let interval =
            (is_random && unknown == 0).then(|| share_interval(over / rows as f64, rows));
        Some(Self { over: over as u64, unknown, rows, interval })
    }

    fn text(&self) -> String {
        let Self { over, unknown, rows, interval } = self;
        let percent = |runs: u64| 1e2 * runs as f64 / *rows as f64;
        let share = if *unknown > 0 {
            let (least, most) = (percent(*over), percent(over + unknown));
            format!("{least:.1} to {most:.1} %: {unknown} are not known")
        } else {
            let known = interval.map(|(low, high)| {
                let (low, high) = (digits(1e2 * low), digits(1e2 * high));
                format!("; 95 % confidence interval {low} to {high} %")
            });
            format!("{:.1} %{}", percent(*over), known.unwrap_or_default())
        };
        format!("{over} of {} ({share})", counted(*rows, "run"))
    }
}

/// Three digits, as many as curves that are some per cent off deserve.
fn digits(value: f64) -> String {
    let magnitude = value.abs();
    if value == 0.0 || (1e-3..1e7).contains(&magnitude) {
        let before = if value == 0.0 { 1 } else { libm::log10(magnitude).floor() as i32 + 1 };
        format!("{value:.*}", (3 - before).clamp(0, 6) as usize)
    } else {
        format!("{value:.2e}")
    }
}

fn dry_run(sweep: &Sweep, shard: Shard, global: GlobalOptions) -> CommandResult {
    let items = shard.items(sweep.items());
    let (rows, from) = (items.end - items.start, items.start);
    let (variables, columns) = (sweep.variables(), sweep.columns());
    let first: Vec<(u64, Vec<String>)> =
        items.take(SHOWN as usize).map(|item| (item, sweep.values(item))).collect();
    let document = document! {
        items: sweep.items(),
        shard: shard,
        rows: rows,
        hash: sweep.hash(),
        variables: &variables,
        columns: &columns,
        first: &first,
    };
    global.show(&document, |out| {
        writeln!(out, "{}", counted(sweep.items(), "item"))?;
        if shard != Shard::WHOLE {
            let (index, count) = (shard.index(), shard.count());
            writeln!(out, "shard {index}/{count}: {} from {from} on", counted(rows, "item"))?;
        }
        for variable in &variables {
            match variable.values {
                Some(count) => writeln!(out, "{}: {}", variable.column, counted(count, "value"))?,
                None => writeln!(out, "{}: drawn", variable.column)?,
            }
        }
        writeln!(out, "columns: {}", columns.join(", "))?;
        let items = Table::of(&first).column("item", |(item, _)| item.to_string());
        let table = variables.iter().enumerate().fold(items, |table, (k, variable)| {
            table.column(&variable.column, |(_, values)| &values[k])
        });
        output::table(out, table)
    })
}
