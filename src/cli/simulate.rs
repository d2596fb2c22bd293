//! `crumple simulate`: the multi-body run of a scenario, also as MDF 4 or an ISO-MME folder with a channel per history.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use super::arguments::FileKind;
use super::export::warn_of_other_channels;
use super::{CommandResult, Failure, GlobalOptions, is_stdout, keep_inputs, output, usage};
use crate::file::{not_written, write_all_whole, write_whole};
use crate::formats::iso_mme::{Channel, Test, folder, interval_s, object};
use crate::formats::mdf;
use crate::multibody::{BodyHistory, Ledger, Run};
use crate::scenario::{self, Limits, Prepared, Summary};
use crate::table::Table;
use crate::unit::{Shown, km_per_h};

/// Run a scenario and write the histories of every body and interface
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple simulate scenario.toml -o result.csv
  crumple simulate scenario.toml --json > result.json
  crumple simulate scenario.toml -o result.mf4      # MDF 4
  crumple simulate scenario.toml -o result.mme      # an ISO-MME folder
  crumple simulate scenario.toml -o - | head        # CSV on standard output")]
pub(super) struct Args {
    /// Scenario (TOML)
    scenario: PathBuf,
    /// Result as CSV, as MDF 4 (.mf4) or as a folder of ISO-MME (.mme); "-" is standard output
    #[arg(short, long)]
    output: Option<PathBuf>,
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    if let Some(output) = &args.output {
        keep_inputs(&args.scenario, output)?;
        options.keep_others(output, FileKind::Result)?;
        let is_csv = output.extension().is_none_or(|e| e.eq_ignore_ascii_case("csv"));
        if !is_stdout(output) && !is_csv && !is_mme(output) && !is_mdf(output) {
            return usage(format!(
                "-o {}: a run is written as CSV, MDF 4 or ISO-MME: name a .csv or .mf4 file or an .mme folder, or use --json",
                output.display()
            ));
        }
    }
    let prepared = scenario::load(&args.scenario)?;
    let run = prepared.run()?;
    let warnings = prepared.warnings_of(&run);
    let outcome = options.warn_all(&warnings);
    let columns = columns(&prepared, &run);
    let to_stdout = args.output.as_deref().is_some_and(is_stdout);
    if let Some(path) = args.output.as_ref().filter(|_| !to_stdout) {
        if is_mme(path) {
            write_channels(path, &prepared, &run, options)?;
        } else if is_mdf(path) {
            write_whole(path, &mdf::of_run(&columns))?;
        } else {
            let mut csv = Vec::new();
            write_csv(&mut csv, &columns)?;
            write_whole(path, &csv)?;
        }
    }
    let summary = prepared.summary(&run);
    if to_stdout && !options.json {
        output::print_data(|out| write_csv(out, &columns))?;
        return Ok(outcome);
    }
    // The columns by name, and what is beside them.
    let columns = columns.into_iter().chain(further_columns(&prepared, &run));
    let mut document: Map<String, Value> =
        columns.map(|(name, values)| (name, json!(values))).collect();
    document.insert("summary".into(), json!(summary));
    document.insert("ledger".into(), json!(run.ledger));
    document.insert("warnings".into(), json!(warnings));
    options.show(&document, |out| {
        print(out, &summary, &run.ledger, options.verbose)?;
        match &args.output {
            Some(path) => writeln!(out, "wrote {}", path.display()),
            None => Ok(()),
        }
    })?;
    Ok(outcome)
}

/// Whether an output is a folder of ISO-MME.
fn is_mme(output: &Path) -> bool {
    output.extension().is_some_and(|e| e.eq_ignore_ascii_case("mme"))
}

fn is_mdf(output: &Path) -> bool {
    output.extension().is_some_and(|e| e.eq_ignore_ascii_case("mf4"))
}

/// Column names and values, in the order of the scenario.
fn columns<'a>(prepared: &Prepared, run: &'a Run) -> Vec<(String, &'a [f64])> {
    let mut columns: Vec<(String, &[f64])> = vec![("time_s".into(), &run.time_s)];
    for &i in &prepared.order {
        let name = &prepared.chain.bodies()[i].name;
        let BodyHistory { x_m, v_m_per_s, a_m_per_s2, .. } = &run.bodies[i];
        columns.push((format!("x_m[{name}]"), x_m));
        columns.push((format!("v_m_per_s[{name}]"), v_m_per_s));
        columns.push((format!("a_m_per_s2[{name}]"), a_m_per_s2));
    }
    for (interface, history) in prepared.chain.interfaces().iter().zip(&run.interfaces) {
        columns.push((format!("deflection_m[{}]", interface.name), &history.deflection_m));
        columns.push((format!("force_N[{}]", interface.name), &history.force_n));
    }
    columns
}

/// What the document has besides the columns of the table.
fn further_columns<'a>(prepared: &Prepared, run: &'a Run) -> Vec<(String, &'a [f64])> {
    let mut columns: Vec<(String, &[f64])> = Vec::new();
    for (interface, history) in prepared.chain.interfaces().iter().zip(&run.interfaces) {
        let name = &interface.name;
        columns.push((format!("largest_deflection_m[{name}]"), &history.largest_deflection_m));
        columns.push((format!("stored_J[{name}]"), &history.stored_j));
        columns.push((format!("dissipated_J[{name}]"), &history.dissipated_j));
    }
    columns
}

fn write_csv(out: &mut dyn Write, columns: &[(String, &[f64])]) -> io::Result<()> {
    output::csv(out, columns, |line, number| write!(line, "{number:?}"))
}

/// A crush that is largest that close to the end of the run may still grow.
const ROUNDING_S: f64 = 1e-9;
/// Events that are printed without being asked for.
const SHOWN_EVENTS: usize = 12;

fn print(
    out: &mut dyn Write,
    summary: &Summary<'_>,
    ledger: &Ledger,
    is_verbose: bool,
) -> io::Result<()> {
    let loads_n = summary.interfaces.iter().filter_map(|i| i.load_n());
    let largest_n = loads_n.fold(0.0, f64::max);
    let force = Shown::force(largest_n);
    let energy = Shown::energy(ledger.initial_kinetic_j);
    let interfaces = Table::of(&summary.interfaces)
        .column("interface", |i| i.name)
        .column("peak force", |i| i.load_n().map_or("-".into(), |n| force.text(n)));
    let interfaces = match summary.pulls() {
        true => interfaces.column("peak tension", |i| force.text(i.history.peak_tension_n)),
        false => interfaces,
    };
    let interfaces = interfaces
        .column("max crush", |i| {
            let is_last = (i.history.max_deflection_time_s - summary.end_s).abs() < ROUNDING_S;
            let so_far = if is_last { " so far" } else { "" };
            format!("{:.3} m{so_far}", i.history.max_deflection_m)
        })
        .column("at", |i| format!("{:.1} ms", i.history.max_deflection_time_s * 1e3))
        .column("energy", |i| i.energy_j.map_or("-".into(), |j| energy.text(j)))
        .column("share of energy", |i| {
            i.energy_share.map_or("-".into(), |s| format!("{:.0} %", 1e2 * s))
        })
        .column("restitution", |i| i.history.restitution.map_or("-".into(), |e| format!("{e:.3}")))
        .column("force", |i| i.used.force.unwrap_or("unknown"))
        .column("curve for", |i| i.used.speed_m_per_s.map_or("-".into(), km_per_h));
    output::table(out, interfaces)?;
    let speed = format!("speed at {} ms", (summary.end_s * 1e6).round() / 1e3);
    let bodies = Table::of(summary.bodies.iter().filter(|body| !body.is_crush_zone))
        .column("body", |b| b.name)
        .column(speed, |b| format!("{:.2} m/s", b.final_v_m_per_s))
        .column("peak (CFC 60)", |b| b.peak_text().unwrap_or("-".into()))
        .column("mean deceleration", |b| b.mean_text())
        .column("over 120 ms", |b| {
            b.moving_mean_deceleration_g.map_or("-".into(), |a| format!("{a:.2} g"))
        })
        .column("secondary impact", |b| {
            b.secondary_impact_m_per_s.map_or("-".into(), |v| format!("{v:.1} m/s"))
        })
        .column("occupant load", |b| b.occupant_load_g.map_or("-".into(), |a| format!("{a:.1} g")));
    output::table(out, bodies)?;
    let shown = if is_verbose { summary.sequence.len() } else { SHOWN_EVENTS };
    let events = Table::of(summary.sequence.iter().take(shown))
        .column("at", |event| format!("{:.1} ms", 1e3 * event.time_s))
        .column("interface", |event| event.interface)
        .column("event", |event| event.what.text());
    output::table(out, events)?;
    match summary.sequence.len().saturating_sub(shown) {
        0 => {}
        further => writeln!(out, "{further} further events: --verbose")?,
    }
    if let Some(time_s) = summary.common_speed_time_s {
        writeln!(out, "common speed at {:.1} ms", 1e3 * time_s)?;
    }
    if let Some(limits) = &summary.limits {
        print_limits(out, limits)?;
    }
    print_energy(out, ledger)
}

fn print_energy(out: &mut dyn Write, ledger: &Ledger) -> io::Result<()> {
    let energy = Shown::energy(ledger.initial_kinetic_j);
    // What only some trains have.
    let further = [("damped", ledger.damped_j), ("resisted", ledger.resisted_j)];
    let further = further.into_iter().filter(|(_, energy_j)| *energy_j != 0.0);
    let further: String =
        further.map(|(what, energy_j)| format!(", {} {what}", energy.text(energy_j))).collect();
    writeln!(
        out,
        "energy of {}: {} kinetic, {} stored, {} dissipated{further}; largest imbalance {:.1e}",
        energy.text(ledger.initial_kinetic_j),
        energy.text(ledger.kinetic_j),
        energy.text(ledger.stored_j),
        energy.text(ledger.dissipated_j),
        ledger.max_energy_error
    )
}

fn print_limits(out: &mut dyn Write, limits: &Limits<'_>) -> io::Result<()> {
    let over = limits.text();
    let of = match &limits.trains {
        Some(trains) => format!(", of train {}", trains.join(", ")),
        None => String::new(),
    };
    let occupants: String =
        limits.occupants.iter().map(|of| format!("{}\n", limits.occupants_text(of))).collect();
    writeln!(
        out,
        "over {} g ({}:{}{of}): {over}\n{occupants}{}",
        limits.mean_deceleration_limit_g, limits.standard, limits.edition, limits.statement
    )
}

/// Writes the run into the folder at `path`, whose name without its extension names the files.
fn write_channels(
    path: &Path,
    prepared: &Prepared,
    run: &Run,
    options: GlobalOptions,
) -> Result<(), Failure> {
    let name = path.file_stem().and_then(|s| s.to_str()).unwrap_or("run");
    let bodies = prepared.chain.bodies();
    if bodies.len() > OBJECTS {
        return usage(format!(
            "-o {}: ISO-MME names at most {OBJECTS} test objects, the chain has {} bodies: write a .csv file",
            path.display(),
            bodies.len()
        ));
    }
    let of = |k: usize| object(k).unwrap_or('?');
    let mut channels = Vec::new();
    for (k, &i) in prepared.order.iter().enumerate() {
        let (history, body) = (&run.bodies[i], &bodies[i].name);
        for (dimension, what, unit, values) in [
            ("DS", "position", "m", &history.x_m),
            ("VE", "speed", "m/s", &history.v_m_per_s),
            ("AC", "acceleration", "m/s2", &history.a_m_per_s2),
        ] {
            channels.push(Channel {
                code: format!("{}1VEHCCG0000{dimension}XP", of(k)),
                name: format!("{what} of {body}"),
                unit,
                values: values.clone(),
            });
        }
    }
    for (k, (interface, history)) in
        prepared.chain.interfaces().iter().zip(&run.interfaces).enumerate()
    {
        for (dimension, what, unit, values) in [
            ("DS", "deflection", "m", &history.deflection_m),
            ("FO", "force", "N", &history.force_n),
        ] {
            channels.push(Channel {
                code: format!("{}1VEHC000000{dimension}XP", of(k)),
                name: format!("{what} at {}", interface.name),
                unit,
                values: values.clone(),
            });
        }
    }
    let test = Test {
        name,
        title: "multi-body run of crumple",
        bodies: prepared.order.iter().map(|&i| (bodies[i].mass_kg, bodies[i].speed_m_per_s)).collect(),
        start_s: run.time_s.first().copied().unwrap_or_default(),
        interval_s: interval_s(&run.time_s)?,
        remarks: vec![
            "x positive in the direction in which the first train moves; time 0 is the first contact; the first character of a code is the body's, or the interface's, in the chain".into(),
        ],
    };
    let exported = folder(&test, &channels)?;
    let inside = path.join("Channel");
    std::fs::create_dir_all(&inside).map_err(|e| not_written(&inside, e))?;
    let paths: Vec<PathBuf> = exported.files.iter().map(|(name, _)| path.join(name)).collect();
    let files = paths.iter().zip(&exported.files).map(|(path, file)| (&**path, &*file.1));
    write_all_whole(&files.collect::<Vec<(&Path, &[u8])>>())?;
    warn_of_other_channels(&paths, options);
    Ok(())
}

/// Test objects that ISO-MME's codes distinguish.
const OBJECTS: usize = 35;
