//! The report on a scenario: motion, crush and energy of its run, and the comparison with FE's train.

use std::path::Path;

use super::figure::Figure;
use super::page::{energy, file_name, force, mass, metres, percent};
use super::{Cell, Content, KeyFigure, MethodSpeeds, Part, ReportSettings, Section, Table};
use crate::assess::ComparisonSettings;
use crate::assess::train::{TrainComparison, compare_train};
use crate::charts::{Motion, Quantity, train_speeds};
use crate::error::Error;
use crate::multibody::{Run, STANDARD_GRAVITY_M_PER_S2};
use crate::scenario::{self, Prepared};
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
    parts.push(Part::Table(vehicles(&prepared, &run)));
    parts.push(Part::Table(interfaces(&prepared, &run)));
    if let Some(limits) = limits(&prepared, &run) {
        parts.push(Part::Text(limits));
    }
    let crush = run.interfaces.iter().map(|i| i.max_deflection_m).fold(0.0, f64::max);
    content
        .figures
        .push(KeyFigure { value: metres(crush), name: format!("maximum crush, {name}") });
    let mut warnings = prepared.warnings.clone();
    warnings.extend(run.all_warnings());
    warnings.into_iter().for_each(|warning| content.warn(format!("{name}: {warning}")));
    if read.reference.is_some() && settings.methods != MethodSpeeds::None {
        let (seed, nsdm_seeds) = (settings.seed, settings.nsdm_seeds);
        let asked = ComparisonSettings { seed, nsdm_seeds, ..ComparisonSettings::default() };
        let comparison = compare_train(path, &read, &asked)?;
        parts.push(Part::Heading("Comparison with FE's run of the whole train".into()));
        let chart = train_speeds(&format!("{name}: speeds by FE and by the methods"), &comparison);
        parts.push(Part::Figure(Figure::new(format!("s{number}-train"), chart)));
        parts.push(Part::Table(methods(&comparison)));
    }
    content.sections.push(Section {
        id: format!("scenario-{number}"),
        title: format!("Scenario {name}"),
        parts,
    });
    Ok(())
}

fn table(caption: &str, heading: &[&str], rows: Vec<Vec<Cell>>) -> Table {
    Table { caption: caption.into(), heading: heading.iter().map(|h| (*h).into()).collect(), rows }
}

fn in_g(a_m_per_s2: f64) -> String {
    format!("{:.2} g", a_m_per_s2 / STANDARD_GRAVITY_M_PER_S2)
}

/// Masses, speeds and decelerations.
fn vehicles(prepared: &Prepared, run: &Run) -> Table {
    let row = |&i: &usize| {
        let (body, history) = (&prepared.chain.bodies()[i], &run.bodies[i]);
        let so_far = if history.is_loaded_at_end { " so far" } else { "" };
        vec![
            body.name.as_str().into(),
            mass(body.mass_kg).into(),
            format!("{:.2} m/s", body.speed_m_per_s).into(),
            format!("{:.2} m/s", history.final_v_m_per_s).into(),
            format!("{}{so_far}", in_g(history.mean_deceleration_m_per_s2)).into(),
            history.moving_mean_deceleration_m_per_s2.map_or("–".into(), in_g).into(),
        ]
    };
    table(
        "Vehicles",
        &[
            "vehicle",
            "mass",
            "speed before",
            "speed at the end",
            "mean deceleration",
            "largest over 120 ms",
        ],
        prepared.order.iter().map(row).collect(),
    )
}

/// Crush and energy of each interface.
fn interfaces(prepared: &Prepared, run: &Run) -> Table {
    let all = prepared.chain.interfaces().iter().zip(&run.interfaces).zip(&prepared.used);
    let row = all.map(|((interface, history), used)| {
        let last = |values: &[f64]| values.last().copied().unwrap_or_default();
        vec![
            interface.name.as_str().into(),
            force(history.peak_force_n).into(),
            metres(history.max_deflection_m).into(),
            format!("{:.1} ms", 1e3 * history.max_deflection_time_s).into(),
            energy(last(&history.dissipated_j)).into(),
            energy(last(&history.stored_j)).into(),
            used.curve.as_str().into(),
            used.force.unwrap_or("unknown").into(),
            used.speed_m_per_s.map_or("–".into(), km_per_h).into(),
        ]
    });
    let rows = row.collect();
    let heading = [
        "interface",
        "peak force",
        "maximum crush",
        "at",
        "energy lost",
        "energy stored",
        "curve",
        "force",
        "curve for",
    ];
    table("Interfaces", &heading, rows)
}

/// How the mean decelerations stand to the scenario's limits.
fn limits(prepared: &Prepared, run: &Run) -> Option<String> {
    let limits = prepared.limits.as_ref()?;
    let limit = limits.mean_deceleration_g * STANDARD_GRAVITY_M_PER_S2;
    let is_over = |i: &&usize| run.bodies[**i].mean_deceleration_m_per_s2.abs() > limit;
    let over: Vec<&str> = prepared
        .limited
        .iter()
        .filter(is_over)
        .map(|i| prepared.chain.bodies()[*i].name.as_str())
        .collect();
    let beyond = run.beyond_data().map(|k| prepared.chain.interfaces()[k].name.as_str());
    let beyond: Vec<&str> = beyond.collect();
    let over = if !beyond.is_empty() {
        format!("unknown, because {} went beyond the data of its curve", beyond.join(", "))
    } else if over.is_empty() {
        "no vehicle".into()
    } else {
        over.join(", ")
    };
    Some(format!(
        "Mean deceleration over {} g ({}:{}): {over}. They come from a one-dimensional model, say nothing about survival space, and are not evidence of conformity.",
        limits.mean_deceleration_g, limits.standard, limits.edition
    ))
}

/// Errors of each method in the whole train.
fn methods(comparison: &TrainComparison) -> Table {
    let vehicles: Vec<&str> = comparison.fe.keys().map(String::as_str).collect();
    let mut heading = vec!["method", "driven by", "mean"];
    heading.extend(&vehicles);
    let rows = comparison.rows.iter().map(|row| {
        let mut cells: Vec<Cell> = vec![
            row.method.as_str().into(),
            row.driven_by.as_str().into(),
            percent(row.mean_velocity_l1).into(),
        ];
        cells.extend(row.vehicles.iter().map(|v| percent(v.velocity_l1).into()));
        cells
    });
    let caption =
        format!("Velocity errors up to {:.0} ms, Σ|p − r|/Σ|r|", 1e3 * comparison.until_s);
    table(&caption, &heading, rows.collect())
}
