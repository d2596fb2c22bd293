//! Designs beside one another: groups of several databases, and several scenarios.

use super::figure::Figure;
use super::group::Design;
use super::train::Ran;
use super::{Content, Part, Section, energy, force, metres, percent};
use crate::charts::{self, Motion, Quantity};
use crate::error::Error;
use crate::table::Table;
use crate::unit::km_per_h;

/// Adds a section at the front, if there are designs to compare.
pub(super) fn add_designs(content: &mut Content, designs: &[Design]) {
    if designs.len() < 2 {
        return;
    }
    let error = |of: &Design, error: fn(&crate::surrogate::leave_one_out::Means) -> f64| {
        of.chosen.as_ref().map_or("–".into(), |means| percent(error(means)))
    };
    let table = Table::of(designs)
        .column("design", |of| &of.title)
        .column("FE runs", |of| of.runs.to_string())
        .column("model", |of| &of.curve.model)
        .column("left-out force error", |of| error(of, |means| means.force_l1))
        .column("velocity", |of| error(of, |means| means.velocity_l1))
        .column("at", |of| km_per_h(of.curve.speed_m_per_s))
        .column("peak force", |of| force(of.curve.peak_force_n()))
        .column("maximum crush", |of| metres(of.curve.max_deflection_m))
        .column("energy", |of| energy(of.curve.energy_j));
    let curves = designs.iter().map(|of| (&*of.title, &of.curve));
    let chart = charts::predictions("Predicted curves of all designs", curves);
    let parts = vec![
        Part::table("Predicted curves of all designs", table),
        Part::Figure(Figure::new("designs".into(), chart)),
    ];
    let (id, title) = ("designs".into(), "Designs side by side".into());
    content.sections.insert(0, Section { id, title, parts });
}

/// Adds a section at the front, if there are runs of much the same vehicles to compare.
pub(super) fn add_scenarios(content: &mut Content, ran: Vec<Ran>) -> Result<(), Error> {
    let is_alike: Vec<bool> = (0..ran.len())
        .map(|k| (0..ran.len()).any(|other| other != k && are_alike(&ran[k], &ran[other])))
        .collect();
    let ran: Vec<Ran> =
        ran.into_iter().zip(is_alike).filter(|(_, is)| *is).map(|(r, _)| r).collect();
    if ran.len() < 2 {
        return Ok(());
    }
    let vehicles = names(ran.iter().flat_map(|of| &of.vehicles).map(|(name, _)| name));
    let interfaces = names(ran.iter().flat_map(|of| &of.interfaces).map(|(name, _)| name));
    let mut parts = Vec::new();
    let of_vehicles: [(&str, fn(f64) -> String); 4] = [
        ("Mean deceleration", |g| format!("{g:.2} g")),
        ("Peak deceleration (CFC 60)", |g| format!("{g:.1} g")),
        ("Secondary impact after 0.6 m", |v| format!("{v:.1} m/s")),
        ("Occupant load", |g| format!("{g:.1} g")),
    ];
    for (k, (caption, text)) in of_vehicles.into_iter().enumerate() {
        let rows = |of: &Ran, name: &str| {
            let found = of.vehicles.iter().find(|(other, _)| other == name);
            found.and_then(|(_, numbers)| numbers[k])
        };
        parts.push(Part::table(caption, beside("vehicle", &vehicles, &ran, rows, text)));
    }
    let of_interfaces: [(&str, fn(f64) -> String); 2] =
        [("Maximum crush", metres), ("Energy taken", energy)];
    for (k, (caption, text)) in of_interfaces.into_iter().enumerate() {
        let rows = |of: &Ran, name: &str| {
            let found = of.interfaces.iter().find(|(other, _)| other == name);
            found.and_then(|(_, numbers)| numbers[k])
        };
        parts.push(Part::table(caption, beside("interface", &interfaces, &ran, rows, text)));
    }
    let runs: Vec<(String, Motion)> = ran.into_iter().map(|of| (of.name, of.motion)).collect();
    for (id, quantity, what) in [
        ("both-speeds", Quantity::Velocity, "Speeds"),
        ("both-accelerations", Quantity::Acceleration, "Accelerations"),
        ("both-crush", Quantity::Crush, "Force over crush"),
    ] {
        let chart = charts::motion(what, &runs, quantity, &[], charts::USUAL_CLASS)?;
        parts.push(Part::Figure(Figure::new(id.into(), chart)));
    }
    let (id, title) = ("scenarios".into(), "Scenarios side by side".into());
    content.sections.insert(0, Section { id, title, parts });
    Ok(())
}

/// Whether most vehicles of both are in both: others are no variants of one design.
fn are_alike(a: &Ran, b: &Ran) -> bool {
    let names =
        |of: &Ran| of.vehicles.iter().map(|(name, _)| name.clone()).collect::<Vec<String>>();
    let (a, b) = (names(a), names(b));
    let common = a.iter().filter(|name| b.contains(name)).count();
    2 * common >= a.len() + b.len() - common
}

/// Each name once, in the order in which they come.
fn names<'a>(all: impl Iterator<Item = &'a String>) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for name in all {
        if !names.contains(name) {
            names.push(name.clone());
        }
    }
    names
}

/// A row for each name, a column for each scenario.
fn beside(
    what: &str,
    names: &[String],
    ran: &[Ran],
    value: impl Fn(&Ran, &str) -> Option<f64>,
    text: fn(f64) -> String,
) -> impl Into<Table> {
    let table = Table::of(names).column(what, |name| *name);
    ran.iter().fold(table, |table, of| {
        table.column(&*of.name, |name| value(of, name).map_or("–".into(), text))
    })
}
