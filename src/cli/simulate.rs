//! `crumple simulate`: the multi-body run of a scenario.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::file::write_whole;
use crate::multibody::{BodyHistory, Ledger, Run, STANDARD_GRAVITY_M_PER_S2};
use crate::scenario::{self, Prepared};
use crate::unit::{Shown, km_per_h};
use serde::Serialize;
use serde_json::{Map, Value};

use super::file_kind::FileKind;
use super::output;
use super::run_channels;
use super::{CommandResult, Failure, GlobalOptions, Outcome, is_stdout, keep_inputs};

/// Run a scenario and write the histories of every body and interface
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple simulate scenario.toml -o result.csv
  crumple simulate scenario.toml --json > result.json
  crumple simulate scenario.toml -o result.mme      # an ISO-MME folder
  crumple simulate scenario.toml -o - | head        # CSV on standard output")]
pub(super) struct Args {
    /// Scenario (TOML)
    scenario: PathBuf,
    /// Result as CSV, or as a folder of ISO-MME (.mme); "-" is standard output
    #[arg(short, long)]
    output: Option<PathBuf>,
}

#[derive(Serialize)]
struct Summary {
    bodies: Vec<BodySummary>,
    interfaces: Vec<InterfaceSummary>,
    step_s: f64,
    /// Time of the last output, which the final speeds are for.
    end_s: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    limits: Option<Limits>,
}

/// Mean decelerations against a limit.
#[derive(Serialize)]
struct Limits {
    standard: String,
    edition: String,
    mean_deceleration_limit_g: f64,
    /// Trains that it is for; null for all.
    trains: Option<Vec<String>>,
    /// Bodies whose mean deceleration is over it.
    over: Vec<String>,
    /// Interfaces that were crushed beyond the data of their curves: then `over` is not a verdict.
    beyond_data: Vec<String>,
    statement: String,
}

#[derive(Serialize)]
struct BodySummary {
    name: String,
    final_v_m_per_s: f64,
    mean_deceleration_m_per_s2: f64,
    mean_deceleration_g: f64,
    /// Whether it is the crush zone of a vehicle's end, which stops at once: its decelerations are
    /// no vehicle's.
    is_crush_zone: bool,
    /// The run ended before the contact of that mean did: it is the mean of a part.
    still_loaded_at_end: bool,
    /// Over the 120 ms in which it is largest in magnitude; null in a shorter run.
    moving_mean_deceleration_g: Option<f64>,
}

#[derive(Serialize)]
struct InterfaceSummary {
    name: String,
    #[serde(rename = "peak_force_N")]
    peak_force_n: f64,
    max_deflection_m: f64,
    max_deflection_time_s: f64,
    /// When both sides first had the same velocity.
    common_velocity_time_s: Option<f64>,
    restitution: Option<f64>,
    /// Of a coupling; 0 without one.
    #[serde(rename = "peak_tension_N")]
    peak_tension_n: f64,
    max_extension_m: f64,
    /// Name of its curve, which force it is where that is known, and the speed it is for.
    curve: String,
    curve_force: Option<&'static str>,
    curve_speed_m_per_s: Option<f64>,
    /// Deflection up to which the curve has data: beyond it the force is an assumption.
    data_end_m: f64,
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    if let Some(output) = &args.output {
        keep_inputs(&args.scenario, output)?;
        options.keep_others(output, FileKind::Result)?;
        let is_csv = output.extension().is_none_or(|e| e.eq_ignore_ascii_case("csv"));
        if !is_stdout(output) && !is_csv && !is_mme(output) {
            return Err(Failure::Usage(format!(
                "-o {}: a run is written as CSV or ISO-MME: name a .csv file or an .mme folder, or use --json",
                output.display()
            )));
        }
    }
    let prepared = scenario::load(&args.scenario)?;
    let run = prepared.run()?;
    let mut warnings = prepared.warnings.clone();
    warnings.extend(run.all_warnings());
    for warning in &warnings {
        options.warn(warning);
    }
    let columns = columns(&prepared, &run);
    let to_stdout = args.output.as_deref().is_some_and(is_stdout);
    if let Some(path) = args.output.as_ref().filter(|_| !to_stdout) {
        if is_mme(path) {
            run_channels::write(path, &prepared, &run)?;
        } else {
            let mut csv = Vec::new();
            write_csv(&mut csv, &columns)?;
            write_whole(path, &csv)?;
        }
    }
    let summary = summary(&prepared, &run);
    if options.json {
        let mut columns = columns;
        columns.extend(further_columns(&prepared, &run));
        output::print_json(&document(&columns, &summary, &run.ledger, &warnings)?)?;
    } else if to_stdout {
        output::print_data(|out| write_csv(out, &columns))?;
    } else {
        options.print(|out| {
            print(out, &summary, &run.ledger)?;
            match &args.output {
                Some(path) => writeln!(out, "wrote {}", path.display()),
                None => Ok(()),
            }
        })?;
    }
    Ok(if warnings.is_empty() { Outcome::Clean } else { Outcome::Warned })
}

/// Whether an output is a folder of ISO-MME.
fn is_mme(output: &Path) -> bool {
    output.extension().is_some_and(|e| e.eq_ignore_ascii_case("mme"))
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
    let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
    writeln!(out, "{}", names.join(","))?;
    for row in 0..columns[0].1.len() {
        for (k, (_, values)) in columns.iter().enumerate() {
            let comma = if k == 0 { "" } else { "," };
            write!(out, "{comma}{:?}", values[row])?;
        }
        writeln!(out)?;
    }
    Ok(())
}

/// The columns by name, with `summary`, `ledger` and `warnings`.
fn document(
    columns: &[(String, &[f64])],
    summary: &Summary,
    ledger: &Ledger,
    warnings: &[String],
) -> serde_json::Result<Value> {
    let mut document = Map::new();
    for (name, values) in columns {
        document.insert(name.clone(), serde_json::to_value(values)?);
    }
    document.insert("summary".into(), serde_json::to_value(summary)?);
    document.insert("ledger".into(), serde_json::to_value(ledger)?);
    document.insert("warnings".into(), serde_json::to_value(warnings)?);
    Ok(Value::Object(document))
}

fn summary(prepared: &Prepared, run: &Run) -> Summary {
    let stopping = prepared.chain.interfaces().iter().filter_map(|i| i.stopping.as_ref());
    let zones: Vec<usize> = stopping.map(|stopping| stopping.zone).collect();
    let body = |&i: &usize| BodySummary {
        name: prepared.chain.bodies()[i].name.clone(),
        final_v_m_per_s: run.bodies[i].final_v_m_per_s,
        mean_deceleration_m_per_s2: run.bodies[i].mean_deceleration_m_per_s2,
        mean_deceleration_g: run.bodies[i].mean_deceleration_m_per_s2 / STANDARD_GRAVITY_M_PER_S2,
        is_crush_zone: zones.contains(&i),
        still_loaded_at_end: run.bodies[i].is_loaded_at_end,
        moving_mean_deceleration_g: run.bodies[i]
            .moving_mean_deceleration_m_per_s2
            .map(|a| a / STANDARD_GRAVITY_M_PER_S2),
    };
    let interfaces = prepared
        .chain
        .interfaces()
        .iter()
        .zip(&run.interfaces)
        .zip(&prepared.used)
        .map(|((interface, history), used)| InterfaceSummary {
            name: interface.name.clone(),
            peak_force_n: history.peak_force_n,
            max_deflection_m: history.max_deflection_m,
            max_deflection_time_s: history.max_deflection_time_s,
            common_velocity_time_s: history.common_velocity_time_s,
            restitution: history.restitution,
            peak_tension_n: history.peak_tension_n,
            max_extension_m: history.max_extension_m,
            curve: used.curve.clone(),
            curve_force: used.force,
            curve_speed_m_per_s: used.speed_m_per_s,
            data_end_m: history.data_end_m,
        })
        .collect();
    let bodies: Vec<BodySummary> = prepared.order.iter().map(body).collect();
    let limits = prepared.limits.as_ref().map(|limits| Limits {
        standard: limits.standard.clone(),
        edition: limits.edition.clone(),
        mean_deceleration_limit_g: limits.mean_deceleration_g,
        trains: limits.trains.clone(),
        over: prepared
            .order
            .iter()
            .zip(&bodies)
            .filter(|(i, b)| {
                let over = b.mean_deceleration_g.abs() > limits.mean_deceleration_g;
                over && prepared.limited.contains(i)
            })
            .map(|(_, b)| b.name.clone())
            .collect(),
        beyond_data: run
            .beyond_data()
            .map(|k| prepared.chain.interfaces()[k].name.clone())
            .collect(),
        statement: format!(
            "mean decelerations come from a one-dimensional model and say nothing about survival space; they are not evidence of conformity with {}:{}",
            limits.standard, limits.edition
        ),
    });
    let end_s = run.time_s.last().copied().unwrap_or_default();
    Summary { bodies, interfaces, step_s: run.step_s, end_s, limits }
}

fn print(out: &mut dyn Write, summary: &Summary, ledger: &Ledger) -> io::Result<()> {
    let largest_n = summary.interfaces.iter().map(|i| i.peak_force_n).fold(0.0, f64::max);
    let force = Shown::force(largest_n);
    let rows: Vec<Vec<String>> = summary
        .interfaces
        .iter()
        .map(|i| {
            vec![
                i.name.clone(),
                force.text(i.peak_force_n),
                format!("{:.4} m", i.max_deflection_m),
                format!("{:.1} ms", i.max_deflection_time_s * 1e3),
                i.restitution.map_or("-".into(), |e| format!("{e:.3}")),
                i.curve_force.unwrap_or("unknown").into(),
                i.curve_speed_m_per_s.map_or("-".into(), km_per_h),
            ]
        })
        .collect();
    let heading =
        ["interface", "peak force", "max crush", "at", "restitution", "force", "curve for"];
    output::table(out, &heading, &rows)?;
    let rows: Vec<Vec<String>> = summary
        .bodies
        .iter()
        .filter(|b| !b.is_crush_zone)
        .map(|b| {
            vec![
                b.name.clone(),
                format!("{:.3} m/s", b.final_v_m_per_s),
                format!(
                    "{:.2} g{}",
                    b.mean_deceleration_g,
                    if b.still_loaded_at_end { " so far" } else { "" }
                ),
                b.moving_mean_deceleration_g.map_or("-".into(), |a| format!("{a:.2} g")),
            ]
        })
        .collect();
    let speed = format!("speed at {} ms", (summary.end_s * 1e6).round() / 1e3);
    output::table(out, &["body", &speed, "mean deceleration", "over 120 ms"], &rows)?;
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

fn print_limits(out: &mut dyn Write, limits: &Limits) -> io::Result<()> {
    let over = if !limits.beyond_data.is_empty() {
        format!("unknown: {} went beyond the data of its curve", limits.beyond_data.join(", "))
    } else if limits.over.is_empty() {
        "no vehicle".into()
    } else {
        limits.over.join(", ")
    };
    let of = match &limits.trains {
        Some(trains) => format!(", of train {}", trains.join(", ")),
        None => String::new(),
    };
    writeln!(
        out,
        "over {} g ({}:{}{of}): {over}\n{}",
        limits.mean_deceleration_limit_g, limits.standard, limits.edition, limits.statement
    )
}
