//! `crumple validate`: every model at every left-out speed.

use crate::error::Error;
use crate::plural::counted;
use std::io::{self, Write};
use std::path::PathBuf;

use crate::assess::choose::{NextRun, Purpose, Selection, next_run};
use crate::assess::validate::{GroupReport, Report, add_nested, validate};
use crate::curve::Case;
use crate::database::Database;
use crate::dataset::{TrainingSet, is_same_speed};
use crate::surrogate::ModelKind;
use crate::surrogate::band::{Band, LeftOutSpeeds, POWER_OF_GAP};
use crate::surrogate::leave_one_out::{
    Floor, LeftOut, Means, PeakError, Scatter, SpeedScatter, Validation,
};
use crate::surrogate::max_crush::MaxCrushRule;
use crate::unit::km_per_h;

use super::output;
use super::progress::Bar;
use super::{CommandResult, Failure, GlobalOptions, Outcome};

/// Leave out every speed in turn, predict it with every model, and compare with FE
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple validate curves.h5
  crumple validate curves.h5 --group lead-car-wall --next
  crumple validate curves.h5 --json
Without --verbose, only mean errors, choice and bands are printed.
Columns: force is sum|p-r|/sum|r| along FE's crush; energy and crush are prediction over FE (the
means show crush by each rule, with the model's own marked); peaks are the first two of FE's curve
(force and position); velocity and acceleration (CFC 60; unfiltered in brackets) are those of a
multi-body run of one mass, driven by the model's body force, sum|p-r|/sum|r| to 30 ms after FE's
maximum crush. The means are over inner speeds; the ends of the range are extrapolation and are listed
separately. FE contact (floor) is FE's own contact force in that run: no prediction of that force
can be expected to do better. FE body (check) is derived from FE's own speeds and only checks curve,
force law and run. FE scatter (floor) is how far a run deviates from the mean of repeated runs at its
speed: no model can remove this part of an error, though the mean over n runs has
only its 1/sqrt(n). forest is the reference method (DDTCM), nearest is FDRM. --nested adds auto:
model and rule chosen without the left-out speed.")]
pub(super) struct Args {
    /// Curve database
    database: PathBuf,
    /// Group to validate (default: all)
    #[arg(long)]
    group: Option<String>,
    /// Propose the speed whose FE run would help most
    #[arg(long)]
    next: bool,
    /// Also leave speeds out of the choice itself, for an unbiased error of auto (takes longer)
    #[arg(long)]
    nested: bool,
    /// Seed of the forests
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let database = Database::read(&args.database)?;
    let groups: Vec<&str> = match &args.group {
        Some(group) => vec![group],
        None => database.groups().collect(),
    };
    if groups.is_empty() {
        return Err(Failure::Usage(format!(
            "{} has no groups: build a study into it",
            args.database.display()
        )));
    }
    let bar = Bar::new(options, "validating");
    let mut report = Report { groups: Vec::new() };
    let mut outcome = Outcome::Clean;
    for &group in &groups {
        bar.step(&format!("validating {group}"));
        let cases = database.group(&args.database, group)?;
        report.groups.push(match validated(args, group, cases) {
            Ok((validation, next_run)) => {
                if !validation.notes.is_empty() && outcome == Outcome::Clean {
                    outcome = Outcome::Warned;
                }
                GroupReport::Validated { validation: Box::new(validation), next_run }
            }
            Err(error) if groups.len() == 1 => return Err(error.into()),
            // The others can be validated all the same.
            Err(error) => {
                outcome = Outcome::Partly;
                GroupReport::Failed { group: group.into(), error: error.to_string() }
            }
        });
    }
    bar.end();
    say_notes(&report, options);
    if options.json {
        output::print_json(&report)?;
    } else {
        options.print(|out| {
            let mut first = true;
            for group in &report.groups {
                let GroupReport::Validated { validation, next_run } = group else { continue };
                if !std::mem::take(&mut first) {
                    writeln!(out)?;
                }
                if options.verbose {
                    print_group(out, validation)?;
                } else {
                    print_summary(out, validation)?;
                }
                if let Some(next) = next_run {
                    print_next(out, next)?;
                }
            }
            Ok(())
        })?;
    }
    Ok(outcome)
}

/// Says what was left out of the tables, and which groups have none.
fn say_notes(report: &Report, options: GlobalOptions) {
    for group in &report.groups {
        match group {
            GroupReport::Validated { validation, .. } => {
                for note in &validation.notes {
                    options.warn(&format!("{}: {note}", validation.group));
                }
            }
            GroupReport::Failed { group, error } => {
                output::say(&format!("error: {group}: {error}"));
            }
        }
    }
}

fn validated(
    args: &Args,
    group: &str,
    cases: &[Case],
) -> Result<(Validation, Option<NextRun>), Error> {
    let mut validation = validate(
        group,
        cases,
        &ModelKind::candidates(args.seed),
        Selection::Best(Purpose::Vehicle),
    )?;
    if args.nested {
        add_nested(&mut validation, cases, args.seed)?;
    }
    let mut next = None;
    if args.next {
        next = next_run(&TrainingSet::new(group, cases)?, &validation);
        if next.is_none() {
            let note = "there is no interval between speeds yet: first run a second speed, far from the first";
            validation.notes.push(note.into());
        }
    }
    Ok((validation, next))
}

fn percent(error: f64) -> String {
    format!("{:.1} %", error * 100.0)
}

fn signed(error: f64) -> String {
    format!("{:+.1} %", error * 100.0)
}

/// Every table and line of a validation.
fn print_group(out: &mut dyn Write, validation: &Validation) -> io::Result<()> {
    print_means(out, validation)?;
    for (inner, title) in [
        (true, "every inner speed left out"),
        (false, "the ends of the range left out: extrapolation"),
    ] {
        let rows: Vec<Vec<String>> = validation
            .rows
            .iter()
            .filter(|r| r.inner == inner)
            .map(|r| row(r, &validation.chosen))
            .chain(validation.floors.iter().filter(|f| f.inner == inner).map(floor))
            .chain(scatter_rows(validation, inner))
            .collect();
        if !rows.is_empty() {
            writeln!(out, "\n{}: {title}", validation.group)?;
            let heading = [
                "model",
                "speed",
                "force",
                "energy",
                "crush",
                "peak 1",
                "peak 2",
                "velocity",
                "acceleration",
                "in band",
            ];
            output::table(out, &heading, &rows)?;
        }
    }
    Ok(())
}

fn print_next(out: &mut dyn Write, next: &NextRun) -> io::Result<()> {
    writeln!(out, "\nnext run: {}: {}", km_per_h(next.speed_m_per_s), next.reason)?;
    let then = next.other_gaps.iter().filter_map(|gap| {
        let (low, high) = gap.between_m_per_s;
        let error = gap.expected_force_l1? * 100.0;
        Some(format!("{} to {} ({error:.1} %)", km_per_h(low), km_per_h(high)))
    });
    let then: Vec<String> = then.collect();
    if then.is_empty() { Ok(()) } else { writeln!(out, "then: {}", then.join(", ")) }
}

/// The mean errors of each model, which is chosen and why, and a line for each band.
pub(super) fn print_summary(out: &mut dyn Write, validation: &Validation) -> io::Result<()> {
    let group = &validation.group;
    if let Some(first) = validation.means.first() {
        writeln!(out, "{group}: mean errors over {} inner speeds left out in turn", first.speeds)?;
        let of_model = |m: &Means| {
            let mark = if m.model == validation.chosen { " *" } else { "" };
            let errors = [m.force_l1, m.max_crush_error, m.velocity_l1, m.acceleration_l1];
            [format!("{}{mark}", m.model)].into_iter().chain(errors.map(percent)).collect()
        };
        let rows: Vec<Vec<String>> = validation.means.iter().map(of_model).collect();
        output::table(out, &["model", "force", "crush", "velocity", "acceleration"], &rows)?;
    }
    writeln!(out, "{} chosen (*): {}", validation.chosen, validation.reason)?;
    for (force, band) in bands(validation) {
        let span = km_per_h(band.span_m_per_s);
        let place = match band.left_out {
            LeftOutSpeeds::Inner => format!("between speeds {span} apart"),
            LeftOutSpeeds::Ends => format!("{span} outside the range"),
        };
        let coverage = match band.coverage {
            Some(share) => format!("covers {:.0} % of the left-out points", share * 100.0),
            None => "not checked".into(),
        };
        writeln!(
            out,
            "band of the {force} {place}: ±{:.0} %, {coverage}",
            band.pointwise_share * 100.0
        )?;
    }
    Ok(())
}

fn row(row: &LeftOut, chosen: &str) -> Vec<String> {
    let mark = if row.model == chosen { " *" } else { "" };
    let peak = |k: usize| row.peaks.get(k).map_or("-".into(), peak);
    vec![
        format!("{}{mark}", row.model),
        km_per_h(row.speed_m_per_s),
        percent(row.force_l1),
        signed(row.energy_error),
        signed(row.max_crush_error),
        peak(0),
        peak(1),
        percent(row.velocity_l1),
        acceleration(row.acceleration_l1, row.acceleration_unfiltered_l1),
        row.coverage.map_or("-".into(), percent),
    ]
}

fn acceleration(filtered: f64, unfiltered: f64) -> String {
    format!("{} ({:.1})", percent(filtered), unfiltered * 100.0)
}

fn peak(peak: &PeakError) -> String {
    match (peak.force_error, peak.shift_m) {
        (Some(force), Some(shift)) => format!("{} {:+.0} mm", signed(force), shift * 1e3),
        _ => "missing".into(),
    }
}

/// What the row of FE's own curve is called. That of the body force is made from FE's speeds, so
/// it is not a floor for predictions.
fn own_curve(force: &str) -> String {
    match force {
        "body" => "FE body (check)".into(),
        force => format!("FE {force} (floor)"),
    }
}

fn floor(floor: &Floor) -> Vec<String> {
    let mut cells = vec![own_curve(&floor.force), km_per_h(floor.speed_m_per_s)];
    cells.extend(["-"; 5].map(String::from));
    cells.push(percent(floor.velocity_l1));
    cells.push(acceleration(floor.acceleration_l1, floor.acceleration_unfiltered_l1));
    cells.push("-".into());
    cells
}

/// The means over the inner speeds with the floors, and the choice.
pub(super) fn print_means(out: &mut dyn Write, validation: &Validation) -> io::Result<()> {
    let group = &validation.group;
    if let Some(first) = validation.means.first() {
        let speeds = first.speeds;
        writeln!(
            out,
            "{group}: means over {speeds} inner speeds left out in turn; the body force drives the runs"
        )?;
        let by_rule = MaxCrushRule::ALL.map(|rule| format!("by {}", rule.name()));
        let mut heading = vec!["model", "force", "energy", "crush"];
        heading.extend(by_rule.iter().map(String::as_str));
        heading.extend(["velocity", "acceleration"]);
        let rows: Vec<Vec<String>> = validation
            .means
            .iter()
            .map(|m| means(m, &validation.chosen))
            .chain(["contact", "body"].iter().filter_map(|f| mean_floor(validation, f)))
            .chain(validation.scatter.as_ref().map(mean_scatter))
            .collect();
        output::table(out, &heading, &rows)?;
    }
    writeln!(out, "{group}: {} chosen (*): {}", validation.chosen, validation.reason)?;
    for model in &validation.unsuited {
        writeln!(out, "{group}: without {model}")?;
    }
    if let Some(scatter) = &validation.scatter {
        writeln!(out, "{group}: {}", scatter_line(scatter))?;
    }
    for (force, band) in bands(validation) {
        writeln!(out, "{group}: {}", band_line(force, band))?;
    }
    Ok(())
}

/// The bands of a validation, with the name of the force where there are two.
fn bands(validation: &Validation) -> impl Iterator<Item = (&'static str, &Band)> {
    let Validation { band, band_outside, body_band, body_band_outside, .. } = validation;
    let body = [body_band, body_band_outside].into_iter().flatten();
    let declared = [band, band_outside].into_iter().flatten();
    let name = if body.clone().next().is_some() { "contact force" } else { "force" };
    declared.map(move |band| (name, band)).chain(body.map(|band| ("body force", band)))
}

/// What the rows of the scatter are called.
const SCATTER: &str = "FE scatter (floor)";

/// The scatter at the speeds that have several runs and rows of models, inner or not.
fn scatter_rows(validation: &Validation, inner: bool) -> impl Iterator<Item = Vec<String>> + '_ {
    let is_in_table = move |at: &&SpeedScatter| {
        let mut rows = validation.rows.iter().filter(|row| row.inner == inner);
        rows.any(|row| is_same_speed(row.speed_m_per_s, at.speed_m_per_s))
    };
    validation.scatter.iter().flat_map(|of| &of.speeds).filter(is_in_table).map(|at| {
        let mut cells = vec![SCATTER.into(), km_per_h(at.speed_m_per_s), percent(at.force_l1)];
        cells.extend(["-"; 4].map(String::from));
        cells.push(percent(at.velocity_l1));
        cells.extend(["-"; 2].map(String::from));
        cells
    })
}

/// The scatter, pooled over the speeds that have several runs.
fn mean_scatter(scatter: &Scatter) -> Vec<String> {
    let mut cells = vec![SCATTER.into(), percent(scatter.force_l1)];
    cells.extend(["-"; 6].map(String::from));
    cells.push(percent(scatter.velocity_l1));
    cells.push("-".into());
    cells
}

/// How far repeated runs lie from their mean.
fn scatter_line(scatter: &Scatter) -> String {
    let at = |at: &SpeedScatter| {
        format!("{} at {}", counted(at.runs.len(), "run"), km_per_h(at.speed_m_per_s))
    };
    format!(
        "scatter of {}: force {}, velocity {}: no model can remove this part",
        scatter.speeds.iter().map(at).collect::<Vec<_>>().join(", "),
        percent(scatter.force_l1),
        percent(scatter.velocity_l1)
    )
}

/// A band of the validation around this force, with the span that it is stated for.
fn band_line(force: &str, band: &Band) -> String {
    let span = km_per_h(band.span_m_per_s);
    let (of, place) = match band.left_out {
        LeftOutSpeeds::Inner => (
            "curve",
            format!(
                "between training speeds {span} apart, otherwise scaled by the interval to the power {POWER_OF_GAP}"
            ),
        ),
        LeftOutSpeeds::Ends => (
            "end",
            format!("{span} outside the training speeds, elsewhere in proportion to the distance"),
        ),
    };
    let coverage = match band.coverage {
        Some(share) => {
            format!("covers {} of the points of the other left-out curves", percent(share))
        }
        None => format!("one {of} cannot be checked against others"),
    };
    let parts = match band.scatter {
        Some(scatter) => format!(
            " (interpolation ±{}, scatter of repeated runs ±{}, whatever the interval)",
            percent(band.interpolation_share()),
            percent(scatter.pointwise_share)
        ),
        None => String::new(),
    };
    format!(
        "band ±{} of the local {force}{parts} {place}; empirical range for {:.0} %, from {}; {coverage}",
        percent(band.pointwise_share),
        band.level * 100.0,
        counted(band.curves, of)
    )
}

fn means(means: &Means, chosen: &str) -> Vec<String> {
    let mark = if means.model == chosen { " *" } else { "" };
    let mut cells = vec![
        format!("{}{mark}", means.model),
        percent(means.force_l1),
        percent(means.energy_error),
        percent(means.max_crush_error),
    ];
    cells.extend(MaxCrushRule::ALL.iter().map(|rule| {
        let mark = if *rule == means.max_crush_rule { " *" } else { "" };
        let error = means.max_crush_errors.get(rule);
        error.map_or("-".into(), |e| format!("{}{mark}", percent(*e)))
    }));
    cells.push(percent(means.velocity_l1));
    cells.push(acceleration(means.acceleration_l1, means.acceleration_unfiltered_l1));
    cells
}

/// FE's own curves over the inner speeds.
fn mean_floor(validation: &Validation, force: &str) -> Option<Vec<String>> {
    let inner: Vec<&Floor> =
        validation.floors.iter().filter(|f| f.inner && f.force == force).collect();
    let mean =
        |of: fn(&Floor) -> f64| inner.iter().map(|f| of(f)).sum::<f64>() / inner.len() as f64;
    (!inner.is_empty()).then(|| {
        let mut cells = vec![own_curve(force)];
        cells.extend(["-"; 7].map(String::from));
        cells.push(percent(mean(|f| f.velocity_l1)));
        cells.push(acceleration(
            mean(|f| f.acceleration_l1),
            mean(|f| f.acceleration_unfiltered_l1),
        ));
        cells
    })
}
