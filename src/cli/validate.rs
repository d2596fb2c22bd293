//! `crumple validate`: every model at every left-out speed.

use crate::error::{Error, error};
use crate::file;
use crate::words::counted;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde_json::Value;

use crate::assess::against::{Against, Changed, Pair};
use crate::assess::choose::{NextRun, Purpose, Selection, next_run};
use crate::assess::subsets::{OverSubsets, subsets};
use crate::assess::validate::{
    GroupReport, MOST_SPEEDS, Report, acceptance, accepted, add_nested, validate_speeds,
};
use crate::curve::Case;
use crate::database::Database;
use crate::dataset::{TrainingSet, is_same_speed};
use crate::rating::acceptance::{ACCEPTANCE, Acceptance, STANDARD};
use crate::surrogate::ModelKind;
use crate::surrogate::band::{self, Band, LeftOutSpeeds, POWER_OF_GAP};
use crate::surrogate::leave_one_out::{
    Floor, LeftOut, PeakError, Scatter, SpeedScatter, Validation,
};
use crate::surrogate::max_crush::MaxCrushRule;
use crate::table::Table;
use crate::unit::km_per_h;

use super::output::{self, Bar};
use super::{CommandResult, GlobalOptions, Outcome};

/// Most bytes of an earlier report.
const MOST_BYTES: u64 = 64 << 20;

/// Leave out every speed in turn, predict it with every model, and compare with FE
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple validate curves.h5
  crumple validate curves.h5 --group lead-car-wall --next
  crumple validate curves.h5 --json
Without --verbose, only mean errors, choice, acceptance and bands are printed.
Columns: force is sum|p-r|/sum|r| along FE's crush; energy and crush are prediction over FE, each
curve up to its own crush (the means show crush by each rule, with the model's own marked); peaks
are the first two of FE's curve (force and position); velocity and acceleration (CFC 60; unfiltered
in brackets) are those of a multi-body run of one mass, driven by the model's body force,
sum|p-r|/sum|r| to 30 ms after FE's maximum crush. The means are over inner speeds; the ends of the
range are extrapolation and are listed separately. FE contact (floor) is FE's own contact force in
that run: no prediction of that force can be expected to do better. FE body (check) is derived from
FE's own speeds, filtered as models take it (fe_body of crumple compare is not), and only checks
curve, force law and run. Curves without times have neither. FE scatter (floor) is how far a run
deviates from the mean of repeated runs at its speed: no model can remove this part of an error,
though the mean over n runs has only its 1/sqrt(n). forest is the reference method (DDTCM, train
--paper), nearest is FDRM. --nested adds auto: model and rule chosen without the left-out speed.
--subsets adds how auto and each model do with fewer runs; regret is by how much their errors exceed
those of the model that turns out best.")]
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
    /// Assess the choice on every subset of 4 and 5 speeds by predicting the speeds that it lacks (takes longer)
    #[arg(long)]
    subsets: bool,
    /// Leave out every case, even if there are more than 20 (takes longer)
    #[arg(long)]
    thorough: bool,
    /// Show what has changed since an earlier validation: the document that --json printed
    #[arg(long, value_name = "FILE")]
    against: Option<PathBuf>,
    /// Seed of the forests
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let database = Database::read(&args.database)?;
    let groups: Vec<&str> = match &args.group {
        Some(group) => vec![group],
        None => database.all_groups(&args.database)?,
    };
    let earlier = args.against.as_deref().map(earlier).transpose()?;
    let bar = Bar::new(options, "validating");
    let mut report = Report { groups: Vec::new() };
    let mut outcome = Outcome::Clean;
    for &group in &groups {
        bar.step(&format!("validating {group}"));
        let cases = database.group(&args.database, group)?;
        let before = earlier.iter().flatten().find(|validation| validation.group == group);
        report.groups.push(match validated(args, group, cases, before) {
            Ok(validated) => validated,
            Err(error) if groups.len() == 1 => return Err(error.into()),
            // The others can be validated all the same.
            Err(error) => GroupReport::Failed { group: group.into(), error: error.to_string() },
        });
    }
    drop(bar);
    for group in &report.groups {
        outcome = outcome.max(match group {
            GroupReport::Validated { validation, .. } => {
                let (group, notes) = (&validation.group, &validation.notes);
                options.warn_all(notes.iter().map(|note| format!("{group}: {note}")))
            }
            GroupReport::Failed { group, error } => {
                output::eprint_line(&format!("error: {group}: {error}"));
                Outcome::Partly
            }
        });
    }
    options.show(&report, |out| {
        let mut first = true;
        for group in &report.groups {
            let GroupReport::Validated { validation, next_run, subsets, against, .. } = group
            else {
                continue;
            };
            if !std::mem::take(&mut first) {
                writeln!(out)?;
            }
            if options.verbose {
                print_means(out, validation)?;
                print_speeds(out, validation)?;
            } else {
                print_summary(out, validation)?;
            }
            if let Some(against) = against {
                print_against(out, validation, against)?;
            }
            if let Some(next) = next_run {
                print_next(out, next)?;
            }
            print_subsets(out, &validation.group, subsets)?;
        }
        Ok(())
    })?;
    Ok(outcome)
}

/// How good the models of a group are, in as much detail as was requested.
pub(super) fn print_validation(
    out: &mut dyn Write,
    validation: &Validation,
    options: GlobalOptions,
) -> io::Result<()> {
    if options.verbose { print_means(out, validation) } else { print_summary(out, validation) }
}

/// The groups of an earlier report; those that failed are not in it.
fn earlier(path: &Path) -> Result<Vec<Validation>, Error> {
    let wrong = |detail: String| {
        let path = path.display();
        error!(Validation, "{path}: {detail}: give what crumple validate --json has printed")
    };
    let text = file::read_text(path, MOST_BYTES).map_err(|source| Error::io(path, source))?;
    let document: Value = text.parse().map_err(|e: serde_json::Error| wrong(e.to_string()))?;
    let groups = document.get("groups").and_then(Value::as_array);
    let groups = groups.ok_or_else(|| wrong("there are no groups in it".into()))?;
    let validated = groups.iter().filter(|group| group.get("error").is_none());
    validated
        .map(|group| Validation::deserialize(group).map_err(|e| wrong(e.to_string())))
        .collect()
}

fn validated(
    args: &Args,
    group: &str,
    cases: &[Case],
    before: Option<&Validation>,
) -> Result<GroupReport, Error> {
    let candidates = ModelKind::all(args.seed);
    let best = Selection::Best(Purpose::Vehicle);
    let most = if args.thorough { usize::MAX } else { MOST_SPEEDS };
    let mut validation = validate_speeds(group, cases, &candidates, best, most)?;
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
    let mut over_subsets = Vec::new();
    if args.subsets {
        match subsets(group, cases, &ModelKind::all(args.seed))? {
            Ok(all) => over_subsets = all,
            Err(note) => validation.notes.push(note),
        }
    }
    if args.against.is_some() && before.is_none() {
        validation.notes.push("the earlier validation does not have this group".into());
    }
    let against = before.map(|before| Box::new(Against::of(before, &validation)));
    let acceptance = accepted(&validation);
    let (validation, subsets) = (Box::new(validation), over_subsets);
    Ok(GroupReport::Validated { validation, acceptance, next_run: next, subsets, against })
}

fn percent(error: f64) -> String {
    format!("{:.1} %", error * 100.0)
}

fn signed(error: f64) -> String {
    format!("{:+.1} %", error * 100.0)
}

/// A model's name, marked if it is the chosen one.
fn marked(model: &str, chosen: &str) -> String {
    format!("{model}{}", if model == chosen { " *" } else { "" })
}

/// The errors at each speed that was left out.
fn print_speeds(out: &mut dyn Write, validation: &Validation) -> io::Result<()> {
    for (inner, title) in [
        (true, "every inner speed left out"),
        (false, "the ends of the range left out: extrapolation"),
    ] {
        let rows = validation.rows.iter().filter(|row| row.inner == inner);
        let peak = |row: &LeftOut, k: usize| row.peaks.get(k).map_or("-".into(), peak);
        let mut table = Table::of(rows.clone())
            .column("model", |row| marked(&row.model, &validation.chosen))
            .column("speed", |row| {
                let is_other = |of: &&LeftOut| of.model == row.model && of.case != row.case;
                let mut others = rows.clone().filter(is_other);
                match others.any(|of| is_same_speed(of.speed_m_per_s, row.speed_m_per_s)) {
                    true => format!("{}, {}", km_per_h(row.speed_m_per_s), row.case),
                    false => km_per_h(row.speed_m_per_s),
                }
            })
            .column("force", |row| percent(row.force_l1))
            .column("energy", |row| signed(row.energy_error))
            .column("crush", |row| signed(row.max_crush_error))
            .column("peak 1", |row| peak(row, 0))
            .column("peak 2", |row| peak(row, 1))
            .column("velocity", |row| percent(row.velocity_l1))
            .column("acceleration", |row| {
                acceleration(row.acceleration_l1, row.acceleration_unfiltered_l1)
            })
            .column("in band", |row| row.coverage.map_or("-".into(), percent))
            .column("within 10 %", |row| if acceptance(row).passes { "yes" } else { "no" });
        for floor in validation.floors.iter().filter(|floor| floor.inner == inner) {
            let unfiltered = floor.acceleration_unfiltered_l1;
            table = table.row(&[
                ("model", own_curve(&floor.force)),
                ("speed", km_per_h(floor.speed_m_per_s)),
                ("velocity", percent(floor.velocity_l1)),
                ("acceleration", acceleration(floor.acceleration_l1, unfiltered)),
            ]);
        }
        for at in validation.scatter.iter().flat_map(|scatter| &scatter.speeds) {
            // Of speeds that have rows of models.
            if rows.clone().any(|row| is_same_speed(row.speed_m_per_s, at.speed_m_per_s)) {
                table = table.row(&[
                    ("model", SCATTER.into()),
                    ("speed", km_per_h(at.speed_m_per_s)),
                    ("force", percent(at.force_l1)),
                    ("velocity", percent(at.velocity_l1)),
                ]);
            }
        }
        let table = Table::from(table);
        if !table.rows.is_empty() {
            writeln!(out, "\n{}: {title}", validation.group)?;
            output::table(out, table)?;
        }
    }
    Ok(())
}

fn print_against(out: &mut dyn Write, now: &Validation, against: &Against) -> io::Result<()> {
    let changed = |[before, now]: Pair| {
        let text = |share: Option<f64>| share.map_or("-".into(), percent);
        format!("{} -> {}", text(before), text(now))
    };
    let table = |first: &'static str, rows| {
        Table::of(rows)
            .column(first, |of: &&Changed| of.name.clone())
            .column("force", |of| changed(of.force_l1))
            .column("crush", |of| changed(of.max_crush_error))
            .column("velocity", |of| changed(of.velocity_l1))
            .column("acceleration", |of| changed(of.acceleration_l1))
    };
    let chosen = match against.chosen_before == now.chosen {
        true => format!("{} is still chosen", now.chosen),
        false => format!("{} is chosen, it was {}", now.chosen, against.chosen_before),
    };
    let group = &now.group;
    let [then, today, both] = against.inner_speeds;
    let band = match against.band_span_m_per_s {
        [Some(a), Some(b)] if !is_same_speed(a, b) => {
            format!(" (between speeds {} and {} apart)", km_per_h(a), km_per_h(b))
        }
        _ => String::new(),
    };
    writeln!(
        out,
        "{group}: since the earlier validation: {chosen}; band {}{band}",
        changed(against.band_share)
    )?;
    if then.max(today) > both {
        writeln!(
            out,
            "{group}: means over {} that both left out, of {then} before and {today} now",
            counted(both, "inner speed")
        )?;
    }
    output::table(out, table("mean of", &against.models))?;
    output::table(out, table("left out", &against.speeds))
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

/// The choice and each model over the subsets of a group.
fn print_subsets(out: &mut dyn Write, group: &str, of: &[OverSubsets]) -> io::Result<()> {
    let Some(first) = of.first() else { return Ok(()) };
    writeln!(
        out,
        "\n{group}: mean errors at the speeds that subsets of 4 and 5 speeds lack, over {} subsets",
        first.subsets
    )?;
    let table = Table::of(of)
        .column("model", |m| m.model.clone())
        .column("force", |m| percent(m.force_l1))
        .column("crush", |m| percent(m.max_crush_error))
        .column("velocity", |m| percent(m.velocity_l1))
        .column("acceleration", |m| percent(m.acceleration_l1))
        .column("regret", |m| format!("{:.0} %", m.mean_regret * 100.0))
        .column("at most", |m| format!("{:.0} %", m.worst_regret * 100.0))
        .column("band holds", |m| m.coverage.map_or("-".into(), percent));
    output::table(out, table)
}

/// The mean errors of each model, which is chosen and why, and a line for each band.
fn print_summary(out: &mut dyn Write, validation: &Validation) -> io::Result<()> {
    let group = &validation.group;
    if let Some(first) = validation.means.first() {
        let left_out = validation.inner_speeds(first);
        writeln!(out, "{group}: mean errors over {left_out} left out in turn")?;
        let table = Table::of(&validation.means)
            .column("model", |m| marked(&m.model, &validation.chosen))
            .column("force", |m| percent(m.force_l1))
            .column("peak force", |m| m.peak_force_error.map_or("-".into(), percent))
            .column("crush", |m| percent(m.max_crush_error))
            .column("velocity", |m| percent(m.velocity_l1))
            .column("acceleration", |m| percent(m.acceleration_l1));
        output::table(out, table)?;
    }
    writeln!(out, "{} chosen (*): {}", validation.chosen, validation.reason)?;
    // The other models need what few groups have.
    let is_rate = |unsuited: &&String| unsuited.starts_with("rate: ");
    if let Some(unsuited) = validation.unsuited.iter().find(is_rate) {
        writeln!(out, "without {unsuited}")?;
    }
    print_acceptance(out, validation, "")?;
    for (force, band) in bands(validation) {
        let width = band.pointwise_share * 100.0;
        let digits = usize::from(width < 1.0);
        let place = match band.left_out {
            LeftOutSpeeds::Inner => {
                let span = km_per_h(band.span_m_per_s);
                format!("between speeds {span} apart: ±{width:.digits$} %")
            }
            LeftOutSpeeds::Ends => format!("outside the range: {}", outside(validation, band)),
        };
        let coverage = match band.coverage {
            Some(share) => format!("covers {:.0} % of the left-out points", share * 100.0),
            None => "not checked".into(),
        };
        writeln!(out, "band of the {force} {place}, {coverage}")?;
    }
    Ok(())
}

/// The chosen model at the inner speeds by the acceptance rule.
fn print_acceptance(out: &mut dyn Write, validation: &Validation, prefix: &str) -> io::Result<()> {
    let all: Vec<Acceptance> = accepted(validation).into_iter().map(|of| of.rule).collect();
    if all.is_empty() {
        return Ok(());
    }
    let passed = all.iter().filter(|acceptance| acceptance.passes).count();
    let worst = all.iter().map(Acceptance::worst).fold(0.0, f64::max);
    writeln!(
        out,
        "{prefix}{passed} of {} predictions at left-out speeds pass the acceptance rule (largest error {}): {ACCEPTANCE} ({STANDARD})",
        all.len(),
        percent(worst)
    )
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

/// The means over the inner speeds with the floors, and the choice.
fn print_means(out: &mut dyn Write, validation: &Validation) -> io::Result<()> {
    let group = &validation.group;
    if let Some(first) = validation.means.first() {
        let left_out = validation.inner_speeds(first);
        writeln!(
            out,
            "{group}: means over {left_out} left out in turn; the body force drives the runs"
        )?;
        let mut table = Table::of(&validation.means)
            .column("model", |m| marked(&m.model, &validation.chosen))
            .column("force", |m| percent(m.force_l1))
            .column("peak", |m| m.peak_force_error.map_or("-".into(), percent))
            .column("energy", |m| percent(m.energy_error))
            .column("crush", |m| percent(m.max_crush_error));
        for rule in MaxCrushRule::ALL {
            table = table.column(format!("by {}", rule.name()), |m| {
                let mark = if rule == m.max_crush_rule { " *" } else { "" };
                let error = m.max_crush_errors.get(&rule);
                error.map_or("-".into(), |e| format!("{}{mark}", percent(*e)))
            });
        }
        table = table
            .column("rebound", |m| m.rebound_error.map_or("-".into(), percent))
            .column("velocity", |m| percent(m.velocity_l1))
            .column("acceleration", |m| {
                acceleration(m.acceleration_l1, m.acceleration_unfiltered_l1)
            });
        for force in ["contact", "body"] {
            let floors = validation.floors.iter().filter(|f| f.inner && f.force == force);
            let count = floors.clone().count();
            let mean = |of: fn(&Floor) -> f64| floors.clone().map(of).sum::<f64>() / count as f64;
            if count > 0 {
                let unfiltered = mean(|f| f.acceleration_unfiltered_l1);
                table = table.row(&[
                    ("model", own_curve(force)),
                    ("velocity", percent(mean(|f| f.velocity_l1))),
                    ("acceleration", acceleration(mean(|f| f.acceleration_l1), unfiltered)),
                ]);
            }
        }
        // Pooled over the speeds that have several runs.
        if let Some(scatter) = &validation.scatter {
            table = table.row(&[
                ("model", SCATTER.into()),
                ("force", percent(scatter.force_l1)),
                ("velocity", percent(scatter.velocity_l1)),
            ]);
        }
        output::table(out, table)?;
    }
    writeln!(out, "{group}: {} chosen (*): {}", validation.chosen, validation.reason)?;
    print_acceptance(out, validation, &format!("{group}: "))?;
    for model in &validation.unsuited {
        writeln!(out, "{group}: without {model}")?;
    }
    if let Some(scatter) = &validation.scatter {
        writeln!(out, "{group}: {}", scatter_line(scatter))?;
    }
    for (force, band) in bands(validation) {
        writeln!(out, "{group}: {}", band_line(validation, force, band))?;
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

/// Half widths of a band of ends, as far outside as these lay: above and below the speeds of a validation.
fn outside(validation: &Validation, band: &Band) -> String {
    let of_model = validation.rows.iter().filter(|row| row.model == validation.chosen);
    let speeds = of_model.clone().map(|row| row.speed_m_per_s);
    let (low, high) =
        speeds.fold((f64::INFINITY, 0.0_f64), |(low, high), v| (low.min(v), high.max(v)));
    let span = band.span_m_per_s;
    let width = |v: f64, distance: f64| {
        let share = band.over(band::outside(&[low, high], v)?)?.pointwise_share;
        Some(format!("±{} {}", percent(share), km_per_h(distance)))
    };
    // An end that was not left out has no row.
    let are_ends = of_model.filter(|row| !row.inner).count() == 2;
    let below = span.min(0.5 * low);
    match (width(high + span, span), width(low - below, below)) {
        (Some(above), Some(under)) if are_ends => {
            format!("{above} above {} and {under} below {}", km_per_h(high), km_per_h(low))
        }
        _ => format!("±{} {} away", percent(band.pointwise_share), km_per_h(span)),
    }
}

/// A band of the validation around this force, with the span that it is stated for.
fn band_line(validation: &Validation, force: &str, band: &Band) -> String {
    let of = if band.left_out == LeftOutSpeeds::Inner { "curve" } else { "end" };
    let coverage = match band.coverage {
        Some(share) => format!(
            "covers {} of the points of the other left-out curves (calibration error {:.2}; ±{} for whole curves, which holds {:.0} of {})",
            percent(share),
            band.calibration_error.unwrap_or_default(),
            percent(band.simultaneous_share),
            band.whole_curves.unwrap_or_default() * band.curves as f64,
            band.curves
        ),
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
    let of_what = format!("of the local {force}{parts}");
    let widths = match band.left_out {
        LeftOutSpeeds::Inner => format!(
            "±{} {of_what} between training speeds {} apart around {}, otherwise scaled by the interval between the roots of both speeds to the power {POWER_OF_GAP}",
            percent(band.pointwise_share),
            km_per_h(band.span_m_per_s),
            km_per_h((band.around_m_per_s * 3.6).round() / 3.6)
        ),
        LeftOutSpeeds::Ends => format!(
            "{of_what} outside the training speeds {}, in proportion to the interval between the roots of both speeds but no narrower than inside",
            outside(validation, band)
        ),
    };
    format!(
        "band {widths}; empirical range for {:.0} %, from {}; {coverage}",
        band.level * 100.0,
        counted(band.curves, of)
    )
}
