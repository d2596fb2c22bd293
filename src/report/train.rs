//! The report on a scenario: what drives it, what came of it, and how far that can be trusted.

use std::collections::BTreeSet;
use std::path::Path;

use super::figure::Figure;
use super::{
    Content, KeyFigure, MethodSpeeds, Part, ReportSettings, Section, ToDo, Verdict, metres, percent,
};
use crate::assess::ComparisonSettings;
use crate::assess::train::{TrainComparison, compare_train};
use crate::charts::{self, Motion, Quantity, train_speeds};
use crate::error::Error;
use crate::multibody::{Body, Ledger, Method, Resistance, Run};
use crate::scenario::{
    self, CurveOrigin, Limits, Prepared, Scenario, Sources, Summary, TrainTable,
};
use crate::table::Table;
use crate::unit::{Shown, km_per_h};

/// A scenario that was run.
pub(super) struct Ran {
    pub name: String,
    /// Trains and speeds.
    pub impact: String,
    /// Curve and source, of each curve.
    pub curves: String,
    pub motion: Motion,
    pub numbers: Numbers,
}

/// What a run comes to.
pub(super) struct Numbers {
    /// By vehicle: mean as held against limits, largest filtered and largest 120 ms mean deceleration, in g, and what its occupants meet.
    pub vehicles: Vec<(String, [Option<f64>; 5])>,
    /// By interface: largest crush in m and energy in J.
    pub interfaces: Vec<(String, [Option<f64>; 2])>,
    /// Interfaces that went beyond the data of their curves.
    pub beyond_data: Vec<String>,
}

/// Histories that a page shows.
const SHOWN: [(Quantity, &str); 5] = [
    (Quantity::Velocity, "speeds"),
    (Quantity::Acceleration, "accelerations"),
    (Quantity::Force, "forces over time"),
    (Quantity::Crush, "force over crush at each interface"),
    (Quantity::Energy, "energy absorbed at each interface, and remaining kinetic energy"),
];

/// Runs a scenario and adds its section; with FE's run as reference also the comparison of methods.
pub(super) fn add(
    content: &mut Content,
    path: &Path,
    name: &str,
    settings: &ReportSettings,
) -> Result<Ran, Error> {
    let read = scenario::read(path)?;
    let sources = Sources::read(path, &read)?;
    let prepared = scenario::assemble(path, &read, &sources)?;
    let origins = sources.origins(&read);
    let run = prepared.run()?;
    let number = content.sections.len() + 1;
    let name = name.to_string();
    let summary = prepared.summary(&run);
    let uncertainty = origins.iter().filter_map(|of| Some(of.left_out.as_ref()?.force_l1));
    let uncertainty = uncertainty.fold(0.0, f64::max);
    let found = Numbers::of(&summary);
    let edges = edges(path, &read, &sources).unwrap_or_else(|error| {
        let text = format!("no results over the bands of the curves: {}", error.message());
        content.warn(ToDo::CheckScenario, &name, text);
        Vec::new()
    });
    add_verdicts(content, &name, &summary, uncertainty, &edges);
    let mut parts = vec![
        Part::Text(conditions(&prepared, &read, &run)),
        Part::table("Vehicles", vehicles(&summary)),
    ];
    parts.push(Part::Text(VEHICLES.into()));
    parts.push(Part::table("Interfaces", interfaces(&summary)));
    parts.push(Part::Text(ledger(&run.ledger)));
    if !edges.is_empty() {
        let caption = |of: &str| format!("{of} over the bands of the curves");
        parts.push(Part::table(caption("Vehicles"), ranges_of_vehicles(&found, &edges)));
        parts.push(Part::table(caption("Interfaces"), ranges_of_interfaces(&found, &edges)));
        parts.push(Part::Text(RANGES.into()));
    }
    parts.push(Part::table("What drives the interfaces", curves(&origins)));
    parts.push(Part::table("Sequence", sequence(&summary)));
    if let Some(time_s) = summary.common_speed_time_s {
        let what = if prepared.chain.bodies().len() > prepared.meeting + 1 {
            "The centres of mass of both trains first have one speed"
        } else {
            "The train stands"
        };
        parts.push(Part::Text(format!("{what} at {:.1} ms.", 1e3 * time_s)));
    }
    let runs = [(name.clone(), Motion::of_run(&prepared, &run, Vec::new()))];
    for (k, (quantity, what)) in SHOWN.into_iter().enumerate() {
        let title = format!("{name}: {what}");
        let chart = charts::motion(&title, &runs, quantity, &[], charts::USUAL_CLASS)?;
        parts.push(Part::Figure(Figure::new(format!("s{number}-{k}"), chart)));
    }
    let crush = run.interfaces.iter().map(|i| i.max_deflection_m).fold(0.0, f64::max);
    let key = KeyFigure { value: metres(crush), name: format!("maximum crush, {name}") };
    content.figures.push(key);
    for warning in prepared.warnings_of(&run) {
        content.warn(ToDo::CheckScenario, &name, warning);
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
    let ran = Ran {
        numbers: found,
        motion: runs.into_iter().next().map(|(_, motion)| motion).expect("there is one"),
        impact: impact(&prepared),
        curves: origins
            .iter()
            .map(|of| match &*of.stated {
                "" => format!("{}: {}", of.curve, of.what),
                stated => format!("{}: {}, {stated}", of.curve, of.what),
            })
            .collect::<Vec<String>>()
            .join("; "),
        name: name.clone(),
    };
    let (id, title) = (format!("scenario-{number}"), format!("Scenario {name}"));
    content.sections.push(Section { id, title, parts });
    Ok(ran)
}

impl Numbers {
    fn of(summary: &Summary<'_>) -> Self {
        let vehicles = summary.bodies.iter().filter(|body| !body.is_crush_zone);
        let of_vehicle = vehicles.map(|body| {
            // Beyond the data of a curve nothing is known, which is said of the curve.
            let is_unknown = |limits: &Limits<'_>| {
                limits.beyond_data.is_empty() && limits.unknown.contains(&body.name)
            };
            let of = [
                body.largest_mean_g()
                    .or(Some(body.mean_deceleration_g))
                    .filter(|_| !summary.limits.as_ref().is_some_and(is_unknown)),
                body.peak_deceleration_g,
                body.moving_mean_deceleration_g,
                body.secondary_impact_m_per_s,
                body.occupant_load_g,
            ];
            (body.name.into(), of)
        });
        let of_interface = summary
            .interfaces
            .iter()
            .map(|of| (of.name.into(), [Some(of.history.max_deflection_m), of.energy_j]));
        let beyond = summary.interfaces.iter().filter(|of| of.history.is_beyond_data());
        Self {
            vehicles: of_vehicle.collect(),
            interfaces: of_interface.collect(),
            beyond_data: beyond.map(|of| of.name.into()).collect(),
        }
    }
}

/// The runs with all curves at the lower, and at the upper edge of their bands; none if no curve has a band.
fn edges(path: &Path, read: &Scenario, sources: &Sources) -> Result<Vec<Numbers>, Error> {
    let mut edges = Vec::new();
    for member in [-1.0, 1.0] {
        if let Some(prepared) = scenario::at_band_edge(path, read, sources, member)? {
            let run = prepared.run()?;
            edges.push(Numbers::of(&prepared.summary(&run)));
        }
    }
    Ok(edges)
}

/// The least and the largest of the value that `of` finds in a run and at the edges.
fn range(
    found: &Numbers,
    edges: &[Numbers],
    of: impl Fn(&Numbers) -> Option<f64>,
) -> Option<(f64, f64)> {
    let all = std::iter::once(found).chain(edges).map(of).collect::<Option<Vec<f64>>>()?;
    Some((
        all.iter().copied().fold(f64::INFINITY, f64::min),
        all.into_iter().fold(f64::NEG_INFINITY, f64::max),
    ))
}

/// What the ranges say.
const RANGES: &str = "Smallest and largest of three runs: with the curves as they are, with all curves that have a band at its lower edge, and at its upper edge. Ends of vehicles, curves with a rate and recorded curves have no band and stay the same. Mean decelerations are those compared with limits. A band holds 90 % of the points of a curve that was left out; all at the same edge together are less likely than that.";

/// Each vehicle's results over the bands.
fn ranges_of_vehicles(found: &Numbers, edges: &[Numbers]) -> impl Into<Table> {
    let of = |i: usize, k: usize, unit: &str| {
        let range = range(found, edges, |n| n.vehicles.get(i)?.1[k]);
        range.map_or("–".into(), |(low, high)| {
            format!("{low:.2} to {high:.2} {unit}").replace('-', "−")
        })
    };
    Table::of(found.vehicles.iter().enumerate())
        .column("vehicle", |(_, (name, _))| name)
        .column("mean deceleration", move |(i, _)| of(*i, 0, "g"))
        .column("peak (CFC 60)", move |(i, _)| of(*i, 1, "g"))
        .column("120 ms mean", move |(i, _)| of(*i, 2, "g"))
        .column("secondary impact", move |(i, _)| of(*i, 3, "m/s"))
        .column("occupant load", move |(i, _)| of(*i, 4, "g"))
}

/// Each interface's results over the bands.
fn ranges_of_interfaces(found: &Numbers, edges: &[Numbers]) -> impl Into<Table> {
    let of = |i: usize, k: usize, shown: &dyn Fn(f64) -> String| {
        let range = range(found, edges, |n| n.interfaces.get(i)?.1[k]);
        range.map_or("–".into(), |(low, high)| format!("{} to {}", shown(low), shown(high)))
    };
    let energies = found.interfaces.iter().filter_map(|(_, [_, energy_j])| *energy_j);
    let energy = Shown::energy(energies.fold(0.0, f64::max));
    Table::of(found.interfaces.iter().enumerate())
        .column("interface", |(_, (name, _))| name)
        .column("maximum crush", move |(i, _)| of(*i, 0, &metres))
        .column("energy absorbed", move |(i, _)| of(*i, 1, &|energy_j| energy.text(energy_j)))
}

/// What is over a limit, what is not known, and where most of the energy goes.
///
/// Too close to call is a limit that lies between the results at the `edges` of the bands; without them what is nearer to it than
/// `force_error`, the largest mean error of its curves at left-out speeds.
fn add_verdicts(
    content: &mut Content,
    name: &str,
    summary: &Summary<'_>,
    force_error: f64,
    edges: &[Numbers],
) {
    if let Some(limits) = &summary.limits {
        add_limits(content, name, summary, limits, (force_error, edges));
    } else {
        let text = "no limits are stated ([limits] in the scenario)".into();
        content.verdict(Verdict::known(name, text));
    }
    let most = summary.interfaces.iter().filter(|of| of.energy_j.is_some());
    let most = most.max_by(|a, b| a.energy_j.unwrap_or(0.0).total_cmp(&b.energy_j.unwrap_or(0.0)));
    if let Some(of) = most
        && let Some((energy_j, share)) = of.energy_j.zip(of.energy_share)
    {
        let text = format!(
            "most energy is absorbed at {}: {}, {} of what all interfaces absorb",
            of.name,
            Shown::one_energy(energy_j),
            percent(share)
        );
        content.verdict(Verdict::known(name, text));
    }
    let beyond = summary.interfaces.iter().filter(|of| of.history.is_beyond_data());
    let beyond: Vec<&str> = beyond.map(|of| of.name).collect();
    if !beyond.is_empty() {
        let text = format!(
            "beyond the data of its curve, where the force is an assumption: {}",
            beyond.join(", ")
        );
        content.verdict(Verdict { state: "unknown", about: name.into(), text });
    }
}

fn add_limits(
    content: &mut Content,
    name: &str,
    summary: &Summary<'_>,
    limits: &Limits<'_>,
    (force_error, edges): (f64, &[Numbers]),
) {
    let what = format!(
        "mean deceleration above {} g ({}:{})",
        limits.mean_deceleration_limit_g, limits.standard, limits.edition
    );
    let mut verdict = |state, text| content.verdict(Verdict { state, about: name.into(), text });
    let over: Vec<String> = summary
        .bodies
        .iter()
        .filter(|body| limits.over.contains(&body.name))
        .map(|body| format!("{} ({})", body.name, body.mean_text().replace('-', "−")))
        .collect();
    // A value of a vehicle that a limit lies so close to that it may be on either side.
    let found = Numbers::of(summary);
    let close = |k: usize, limit: f64, unit: &str| {
        let judged = found.vehicles.iter().enumerate();
        let judged = judged.filter(|(_, (name, _))| limits.judged.contains(&&**name));
        let mut open: Vec<&str> = Vec::new();
        let close = judged.filter_map(|(i, (name, values))| {
            if edges.is_empty() {
                let value = values[k]?;
                let is_close = (value.abs() / limit - 1.0).abs() < force_error;
                return is_close.then(|| format!("{name} ({value:.2} {unit})"));
            }
            let of = |n: &Numbers| n.vehicles.get(i)?.1[k].map(f64::abs);
            let known: Vec<f64> = std::iter::once(&found).chain(edges).filter_map(of).collect();
            let low = known.iter().copied().fold(f64::INFINITY, f64::min);
            let high = known.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            if high < limit && values[k].is_some() && known.len() <= edges.len() {
                open.push(name);
            }
            (low..=high).contains(&limit).then(|| format!("{name} ({low:.2} to {high:.2} {unit})"))
        });
        let close = close.collect::<Vec<_>>().join(", ");
        let than = match edges {
            [] => format!(
                "closer to the limit of {limit} {unit} than the curves' own mean force error of {}",
                percent(force_error)
            ),
            _ => format!("the limit of {limit} {unit} lies within what the curves' bands give"),
        };
        let close = (!close.is_empty()).then(|| format!("{than}: {close}"));
        let open = (!open.is_empty()).then(|| {
            let open = open.join(", ");
            format!(
                "not known at an edge of the curves' bands, where the run ends too early: {open}"
            )
        });
        let said: Vec<String> = close.into_iter().chain(open).collect();
        (!said.is_empty() && limits.beyond_data.is_empty()).then(|| said.join("; "))
    };
    let beyond: BTreeSet<&str> =
        edges.iter().flat_map(|edge| &edge.beyond_data).map(String::as_str).collect();
    let beyond = match &*Vec::from_iter(beyond).join(", ") {
        "" => String::new(),
        beyond => format!(
            ", but at an edge of the curves' bands {beyond} goes beyond the data of its curve"
        ),
    };
    let within = if beyond.is_empty() { "kept" } else { "unknown" };
    let limit_g = limits.mean_deceleration_limit_g;
    let close_g = close(0, limit_g, "g");
    if !limits.beyond_data.is_empty() {
        let beyond = limits.beyond_data.join(", ");
        verdict(
            "unknown",
            format!("{what}: not known, because {beyond} went beyond the data of its curve"),
        );
    } else if !over.is_empty() {
        verdict("over", format!("{what}: {}", over.join(", ")));
    } else if limits.unknown.is_empty() && close_g.is_none() {
        verdict(within, format!("{what}: no vehicle{beyond}"));
    }
    if !limits.unknown.is_empty() && limits.beyond_data.is_empty() {
        let unknown = limits.unknown.join(", ");
        verdict("unknown", format!("{what}: the run ended before it was known for {unknown}"));
    }
    if let Some(close) = close_g {
        verdict("unknown", close);
    }
    for of in &limits.occupants {
        let (k, unit) = if of.what == "occupant_load_g" { (4, "g") } else { (3, "m/s") };
        let close = close(k, of.limit, unit);
        let text = format!("occupants, {}", limits.occupants_text(of));
        match (of.over.is_empty(), of.unknown.is_empty()) {
            (false, _) => verdict("over", text),
            (true, false) => verdict("unknown", text),
            (true, true) if close.is_none() => verdict(within, format!("{text}{beyond}")),
            (true, true) => {}
        }
        if let Some(close) = close {
            verdict("unknown", format!("occupants, {close}"));
        }
    }
}

/// Masses and speeds of the trains.
fn impact(prepared: &Prepared) -> String {
    let (first, second) = prepared.chain.bodies().split_at(prepared.meeting + 1);
    let of = |bodies: &[Body]| {
        let total_kg = bodies.iter().map(|body| body.mass_kg).sum();
        let speed = bodies.first().map_or(0.0, |body| body.speed_m_per_s);
        format!("{} at {}", Shown::one_mass(total_kg), km_per_h(speed))
    };
    let against = if second.is_empty() { "a wall".into() } else { of(second) };
    format!("{} against {against}", of(first))
}

/// The same, and how the motion was integrated.
fn conditions(prepared: &Prepared, scenario: &Scenario, run: &Run) -> String {
    let count = prepared.chain.bodies().len();
    let method = match prepared.settings.method {
        Method::Verlet => "velocity Verlet",
        Method::FourthOrder => "a method of order 4",
        Method::Reference => "the reference method",
    };
    format!(
        "{}: {} on one line, over {:.0} ms by {method} in steps of {:.3} ms. Speeds are positive in the direction of the first train.{}",
        impact(prepared),
        if count == 1 { "1 body".into() } else { format!("{count} bodies") },
        1e3 * scenario.run.duration.0,
        1e3 * run.step_s,
        scenario.train.iter().map(resistance).collect::<String>()
    )
}

/// What resists a train's motion.
fn resistance(train: &TrainTable) -> String {
    let Some(of) = train.resistance else { return String::new() };
    let Resistance { constant_m_per_s2: a, linear_per_s: b, quadratic_per_m: c, braking } = of;
    let terms = [(a, "m/s²", ""), (b, "1/s", " v"), (c, "1/m", " v²")];
    let terms = terms.into_iter().filter(|(factor, ..)| *factor != 0.0);
    let mut parts: Vec<String> =
        terms.map(|(factor, unit, of)| format!("{factor} {unit}{of}")).collect();
    if braking != 0.0 {
        parts.push(format!("brakes with a friction coefficient of {braking}"));
    }
    match &*parts {
        [] => String::new(),
        _ => format!(" Resistance of train {}, per mass: {}.", train.name, parts.join(" + ")),
    }
}

fn ledger(ledger: &Ledger) -> String {
    let shown = Shown::energy(ledger.initial_kinetic_j);
    let energy = |energy_j: f64| shown.text(energy_j);
    let further = [
        ("taken by dampers, rates and stopped mass", ledger.damped_j),
        ("by resistance", ledger.resisted_j),
    ];
    let further = further.into_iter().filter(|(_, energy_j)| *energy_j != 0.0);
    let further: String =
        further.map(|(what, energy_j)| format!(", {} {what}", energy(energy_j))).collect();
    format!(
        "Energy: {} before the impact; at the end {} kinetic, {} stored, {} dissipated{further}; the balance closes within {:.0e} of it.",
        energy(ledger.initial_kinetic_j),
        energy(ledger.kinetic_j),
        energy(ledger.stored_j),
        energy(ledger.dissipated_j),
        ledger.max_energy_error
    )
}

/// What the columns of vehicles mean.
const VEHICLES: &str = "Positive: slowed down in the direction of the first train. Mean deceleration: while the net contact force acts for the first time, until it ends or changes its sign (what rattles for less than 1 ms left aside), and then in the contact that changes the speed most, if that is a later one; limits apply to both. Secondary impact: speed of an unrestrained occupant against the interior after 0.6 m. Occupant load: deceleration that stops an occupant within 235 mm after 65 mm of slack.";

/// Masses, speeds and decelerations.
fn vehicles(summary: &Summary<'_>) -> impl Into<Table> {
    let missing = || "–".to_string();
    Table::of(summary.bodies.iter().filter(|body| !body.is_crush_zone))
        .column("vehicle", |body| body.name)
        .column("mass", |body| Shown::one_mass(body.mass_kg))
        .column("speed", |body| {
            format!("{:.2} to {:.2} m/s", body.initial_v_m_per_s, body.final_v_m_per_s)
        })
        .column("peak (CFC 60)", |body| body.peak_text().unwrap_or_else(missing))
        .column("mean deceleration", |body| body.mean_text().replace('-', "−"))
        .column("120 ms mean", |body| {
            body.moving_mean_deceleration_g.map_or_else(missing, |a| format!("{a:.2} g"))
        })
        .column("secondary impact", |body| {
            body.secondary_impact_m_per_s.map_or_else(missing, |v| format!("{v:.1} m/s"))
        })
        .column("occupant load", |body| {
            body.occupant_load_g.map_or_else(missing, |a| format!("{a:.1} g"))
        })
}

/// Crush and energy of each interface.
fn interfaces(summary: &Summary<'_>) -> impl Into<Table> {
    let largest_n = summary.interfaces.iter().filter_map(|of| of.load_n()).fold(0.0, f64::max);
    let largest_j = summary.interfaces.iter().filter_map(|of| of.energy_j).fold(0.0, f64::max);
    let (force, energy) = (Shown::force(largest_n), Shown::energy(largest_j));
    let table = Table::of(&summary.interfaces)
        .column("interface", |of| of.name)
        .column("peak force", |of| of.load_n().map_or("–".into(), |n| force.text(n)));
    let table = match summary.pulls() {
        true => table.column("peak tension", |of| force.text(of.history.peak_tension_n)),
        false => table,
    };
    table
        .column("maximum crush", |of| metres(of.history.max_deflection_m))
        .column("time of it", |of| format!("{:.1} ms", 1e3 * of.history.max_deflection_time_s))
        .column("energy dissipated or damped", |of| {
            energy.text(of.history.dissipated_at_end_j + of.history.damped_j.unwrap_or(0.0))
        })
        .column("stored", |of| energy.text(of.history.stored_at_end_j))
        .column("share of energy", |of| of.energy_share.map_or("–".into(), percent))
        .column("curve", |of| &of.used.curve)
        .column("force", |of| of.used.force.unwrap_or("unknown"))
        .column("for a speed of", |of| of.used.speed_m_per_s.map_or("–".into(), km_per_h))
}

/// Where each curve comes from, and how wrong its model was at speeds that it did not know.
fn curves(origins: &[CurveOrigin]) -> impl Into<Table> {
    let left_out = |of: &CurveOrigin, error: fn(&crate::surrogate::leave_one_out::Means) -> f64| {
        of.left_out.as_ref().map_or("–".into(), |means| percent(error(means)))
    };
    Table::of(origins)
        .column("curve", |of| &of.curve)
        .column("from", |of| &of.from)
        .column("what", |of| &of.what)
        .column("FE runs", |of| match of.speeds_m_per_s {
            Some((low, high)) if of.runs > 1 => {
                format!("{}, {} to {}", of.runs, km_per_h(low), km_per_h(high))
            }
            Some((speed, _)) => km_per_h(speed),
            None => "–".into(),
        })
        .column("left-out force error", |of| left_out(of, |means| means.force_l1))
        .column("left-out velocity error", |of| left_out(of, |means| means.velocity_l1))
        .column("as stated", |of| if of.stated.is_empty() { "–" } else { &of.stated })
}

fn sequence(summary: &Summary<'_>) -> impl Into<Table> {
    Table::of(&summary.sequence)
        .column("at", |event| format!("{:.1} ms", 1e3 * event.time_s))
        .column("interface", |event| event.interface)
        .column("event", |event| event.what.text())
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
