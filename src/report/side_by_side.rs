//! Designs beside one another: groups of several databases, and several scenarios.

use std::iter;

use super::figure::Figure;
use super::group::Design;
use super::train::Ran;
use super::{Content, Part, Section, metres, percent};
use crate::charts::{self, Motion, Quantity};
use crate::dataset::SAME_MASS;
use crate::error::Error;
use crate::surrogate::PredictedCurve;
use crate::table::Table;
use crate::unit::{Shown, km_per_h};

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
        .column("at", |of| {
            let (speed, kind) = (km_per_h(of.curve.speed_m_per_s), of.curve.speed_kind.name());
            format!("{speed} ({kind})")
        })
        .column("mass", |of| {
            let masses = iter::once(of.curve.mass_kg).chain(of.curve.other_mass_kg());
            masses.map(Shown::one_mass).collect::<Vec<_>>().join(" against ")
        })
        .column("force", |of| of.curve.provenance.force_kind.name())
        .column("peak force", |of| Shown::one_force(of.curve.peak_force_n()))
        .column("maximum crush", |of| metres(of.curve.max_deflection_m))
        .column("energy", |of| Shown::one_energy(of.curve.energy_j));
    let differ = differences(&designs.iter().map(|of| &of.curve).collect::<Vec<_>>());
    let curves = designs.iter().map(|of| (&*of.title, &of.curve));
    let chart = charts::predictions("Predicted curves of all designs", curves);
    let mut parts = vec![
        Part::table("Predicted curves of all designs", table),
        Part::Figure(Figure::new("designs".into(), chart)),
    ];
    if !differ.is_empty() {
        let differ = differ.join(" and ");
        let text =
            format!("These curves cannot be compared point by point: they differ in {differ}.");
        parts.insert(0, Part::Text(text));
    }
    let (id, title) = ("designs".into(), "Designs side by side".into());
    content.sections.insert(0, Section { id, title, parts });
}

/// What the impacts of the curves differ in.
fn differences(curves: &[&PredictedCurve]) -> Vec<&'static str> {
    let of_one = |value: fn(&PredictedCurve) -> f64| {
        curves.iter().all(|curve| (value(curve) / value(curves[0]) - 1.0).abs() <= SAME_MASS)
    };
    if curves.iter().any(|curve| curve.speed_kind != curves[0].speed_kind) {
        return vec!["kind of speed"];
    }
    let force = |curve: &PredictedCurve| curve.provenance.force_kind;
    let is_one_force = curves.iter().all(|curve| force(curve) == force(curves[0]));
    let is_one_speed = of_one(|curve| curve.speed_m_per_s);
    let both = |curve: &PredictedCurve| curve.other_mass_kg().unwrap_or(1.0);
    let is_one_mass = of_one(|curve| curve.mass_kg) && of_one(both);
    let all = [("force", is_one_force), ("speed", is_one_speed), ("mass", is_one_mass)];
    all.iter().filter(|(_, is_one)| !is_one).map(|(what, _)| *what).collect()
}

/// Adds a section at the front, if there are runs of much the same vehicles to compare.
pub(super) fn add_scenarios(content: &mut Content, ran: Vec<Ran>) -> Result<(), Error> {
    let is_alike: Vec<bool> = (0..ran.len())
        .map(|k| (0..ran.len()).any(|other| other != k && are_alike(&ran[k], &ran[other])))
        .collect();
    let apart: Vec<String> =
        ran.iter().zip(&is_alike).filter(|(_, is)| !**is).map(|(of, _)| of.name.clone()).collect();
    let ran: Vec<Ran> =
        ran.into_iter().zip(is_alike).filter(|(_, is)| *is).map(|(r, _)| r).collect();
    if ran.len() < 2 {
        return Ok(());
    }
    let vehicles = names(ran.iter().flat_map(|of| &of.numbers.vehicles).map(|(name, _)| name));
    let interfaces = names(ran.iter().flat_map(|of| &of.numbers.interfaces).map(|(name, _)| name));
    let conditions = Table::of(&ran)
        .column("scenario", |of| &of.name)
        .column("impact", |of| &of.impact)
        .column("curves", |of| &of.curves);
    let mut parts = vec![Part::table("What is compared", conditions)];
    if !apart.is_empty() {
        let apart = apart.join(", ");
        parts.push(Part::Text(format!("Not compared, because the vehicles differ: {apart}.")));
    }
    let g = |digits: usize| move |g: f64| format!("{g:.digits$} g");
    let m_per_s = |v: f64| format!("{v:.1} m/s");
    let of_vehicles = |k: usize| move |of: &Ran, name: &str| found(&of.numbers.vehicles, name)?[k];
    let of_interfaces =
        |k: usize| move |of: &Ran, name: &str| found(&of.numbers.interfaces, name)?[k];
    let vehicle = Beside { what: "vehicle", names: &vehicles, ran: &ran };
    let interface = Beside { what: "interface", names: &interfaces, ran: &ran };
    parts.push(vehicle.part("Mean deceleration, each over its own contact", of_vehicles(0), g(2)));
    parts.push(vehicle.part("Peak deceleration (CFC 60)", of_vehicles(1), g(1)));
    parts.push(vehicle.part("Largest 120 ms mean of the deceleration", of_vehicles(2), g(2)));
    parts.push(vehicle.part("Secondary impact after 0.6 m", of_vehicles(3), m_per_s));
    parts.push(vehicle.part("Occupant load", of_vehicles(4), g(1)));
    parts.push(interface.part("Maximum crush", of_interfaces(0), metres));
    let energies =
        ran.iter().flat_map(|of| &of.numbers.interfaces).filter_map(|(_, [_, energy])| *energy);
    let shown = Shown::energy(energies.fold(0.0, f64::max));
    parts
        .push(interface.part("Energy absorbed", of_interfaces(1), |energy_j| shown.text(energy_j)));
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

/// Whether most vehicles of both are in both: others are not variants of one design.
fn are_alike(a: &Ran, b: &Ran) -> bool {
    let names = |of: &Ran| {
        of.numbers.vehicles.iter().map(|(name, _)| name.clone()).collect::<Vec<String>>()
    };
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

/// The numbers of a name.
fn found<'a, const N: usize>(
    all: &'a [(String, [Option<f64>; N])],
    name: &str,
) -> Option<&'a [Option<f64>; N]> {
    all.iter().find(|(other, _)| other == name).map(|(_, numbers)| numbers)
}

/// Tables with a row for each name, a column for each scenario.
struct Beside<'a> {
    what: &'static str,
    names: &'a [String],
    ran: &'a [Ran],
}

impl Beside<'_> {
    fn part(
        &self,
        caption: &str,
        value: impl Fn(&Ran, &str) -> Option<f64>,
        text: impl Fn(f64) -> String,
    ) -> Part {
        let table = Table::of(self.names).column(self.what, |name| *name);
        let table = self.ran.iter().fold(table, |table, of| {
            let cell = |name: &&String| value(of, name).map_or("–".into(), &text);
            table.column(&*of.name, cell)
        });
        Part::table(caption, table)
    }
}
