//! The report on a scenario: motion, crush and energy of its run, and the comparison with FE's train.

use std::path::Path;

use super::figure::Figure;
use super::page::{energy, file_name, force, mass, metres, percent};
use super::{Content, KeyFigure, MethodSpeeds, Part, ReportSettings, Section};
use crate::assess::ComparisonSettings;
use crate::assess::train::{TrainComparison, compare_train};
use crate::charts::{Motion, Quantity, train_speeds};
use crate::error::Error;
use crate::scenario;
use crate::scenario::summary::{Limits, Summary};
use crate::table::Table;
use crate::unit::km_per_h;

/// Runs a scenario and adds its section; with FE's run as reference also the comparison of methods.
pub(super) fn add(
    content: &mut Content,
    path: &Path,
    settings: &ReportSettings,
) -> Result<(), Error> {
    let read = scenario::read(path)?;
    let prepared = scenario::load(path)?;
    let run = prepared.run()?;
    let number = content.sections.len() + 1;
    let name = file_name(path);
    let motion = Motion::of_run(&prepared.chain, &run, &prepared.order);
    let mut parts = Vec::new();
    for (quantity, what) in [
        (Quantity::Velocity, "speeds"),
        (Quantity::Crush, "force over crush at each interface"),
        (Quantity::Energy, "energy"),
    ] {
        if let Some(chart) = motion.chart(&format!("{name}: {what}"), quantity) {
            let id = format!("s{number}-{}", what.split(' ').next().unwrap_or_default());
            parts.push(Part::Figure(Figure::new(id, chart)));
        }
    }
    let summary = prepared.summary(&run);
    parts.push(Part::table("Vehicles", vehicles(&summary)));
    parts.push(Part::table("Interfaces", interfaces(&summary)));
    parts.extend(summary.limits.as_ref().map(|of| Part::Text(limits(of))));
    let crush = run.interfaces.iter().map(|i| i.max_deflection_m).fold(0.0, f64::max);
    content
        .figures
        .push(KeyFigure { value: metres(crush), name: format!("maximum crush, {name}") });
    for warning in prepared.warnings.iter().chain(&run.all_warnings()) {
        content.warn(format!("{name}: {warning}"));
    }
    if read.reference.is_some() && settings.methods != MethodSpeeds::None {
        let (seed, nsdm_seeds) = (settings.seed, settings.nsdm_seeds);
        let asked = ComparisonSettings { seed, nsdm_seeds, ..ComparisonSettings::default() };
        let comparison = compare_train(path, &read, &asked)?;
        parts.push(Part::Heading("Comparison with FE's run of the whole train".into()));
        let chart = train_speeds(&format!("{name}: speeds by FE and by the methods"), &comparison);
        parts.push(Part::Figure(Figure::new(format!("s{number}-train"), chart)));
        let caption =
            format!("Velocity errors up to {:.0} ms, Σ|p − r|/Σ|r|", 1e3 * comparison.until_s);
        parts.push(Part::table(caption, methods(&comparison)));
    }
    content.sections.push(Section {
        id: format!("scenario-{number}"),
        title: format!("Scenario {name}"),
        parts,
    });
    Ok(())
}

/// Masses, speeds and decelerations.
fn vehicles(summary: &Summary<'_>) -> impl Into<Table> {
    Table::of(&summary.bodies)
        .column("vehicle", |body| body.name)
        .column("mass", |body| mass(body.mass_kg))
        .column("speed before", |body| format!("{:.2} m/s", body.initial_v_m_per_s))
        .column("speed at the end", |body| format!("{:.2} m/s", body.final_v_m_per_s))
        .column("mean deceleration", |body| {
            let so_far = if body.still_loaded_at_end { " so far" } else { "" };
            format!("{:.2} g{so_far}", body.mean_deceleration_g)
        })
        .column("largest over 120 ms", |body| {
            body.moving_mean_deceleration_g.map_or("–".into(), |a| format!("{a:.2} g"))
        })
}

/// Crush and energy of each interface.
fn interfaces(summary: &Summary<'_>) -> impl Into<Table> {
    let last = |values: &[f64]| energy(values.last().copied().unwrap_or_default());
    Table::of(&summary.interfaces)
        .column("interface", |of| of.name)
        .column("peak force", |of| force(of.history.peak_force_n))
        .column("maximum crush", |of| metres(of.history.max_deflection_m))
        .column("at", |of| format!("{:.1} ms", 1e3 * of.history.max_deflection_time_s))
        .column("energy lost", move |of| last(&of.history.dissipated_j))
        .column("energy stored", move |of| last(&of.history.stored_j))
        .column("curve", |of| &of.used.curve)
        .column("force", |of| of.used.force.unwrap_or("unknown"))
        .column("curve for", |of| of.used.speed_m_per_s.map_or("–".into(), km_per_h))
}

/// How the mean decelerations stand to the scenario's limits.
fn limits(limits: &Limits<'_>) -> String {
    let over = if !limits.beyond_data.is_empty() {
        let beyond = limits.beyond_data.join(", ");
        format!("unknown, because {beyond} went beyond the data of its curve")
    } else if limits.over.is_empty() {
        "no vehicle".into()
    } else {
        limits.over.join(", ")
    };
    format!(
        "Mean deceleration over {} g ({}:{}): {over}. They come from a one-dimensional model, say nothing about survival space, and are not evidence of conformity.",
        limits.mean_deceleration_limit_g, limits.standard, limits.edition
    )
}

/// Errors of each method in the whole train.
fn methods(comparison: &TrainComparison) -> impl Into<Table> {
    let table = Table::of(&comparison.rows)
        .column("method", |row| &row.method)
        .column("driven by", |row| &row.driven_by)
        .column("mean", |row| percent(row.mean_velocity_l1));
    comparison.fe.keys().enumerate().fold(table, |table, (k, vehicle)| {
        table.column(vehicle, |row| percent(row.vehicles[k].velocity_l1))
    })
}
