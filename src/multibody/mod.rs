//! Longitudinal multi-body crash: masses on a line, interfaces with a force law.
//!
//! `m_i x_i'' = F_{i−1} − F_i − R_i`, with `F_i` the force of the interface in front of
//! body `i`, acting on its deflection `δ = (x_i − x_{i+1}) − gap`, and `R_i` the resistance of
//! the track.
//!
//! ```
//! use crumple::curve::Envelope;
//! use crumple::multibody::{Body, Chain, EnvelopeEnd, ForceLaw, Interface, RunSettings, Unloading, simulate};
//!
//! // 24 t at 10 m/s against a wall, on an elastic spring of 40 MN/m: crush v √(m/k).
//! let curve = Envelope::new(vec![0.0, 1.0], vec![0.0, 40e6])?;
//! let law = ForceLaw::new(curve, Unloading::Elastic, EnvelopeEnd::Hold);
//! let bodies = vec![Body::new("car", 24e3, 10.0)];
//! let chain = Chain::new(bodies, vec![Interface::new("car|wall", law, 0.0)])?;
//! let run = simulate(&chain, &RunSettings::new(0.1, 0.75e-3))?;
//! let crush_m = 10.0 * (24e3_f64 / 40e6).sqrt();
//! assert!((run.interfaces[0].max_deflection_m / crush_m - 1.0).abs() < 1e-6);
//! assert!(run.ledger.max_energy_error < 1e-3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod chain;
mod contacts;
mod engine;
mod law;
pub(crate) mod recorder;
mod reference;
mod rows;
mod run;

use crate::curve::is_beyond;
use crate::error::{Error, error};
pub(crate) use chain::Tension;
pub use chain::{
    Body, Chain, Damping, Interface, RateFactor, Resistance, STANDARD_GRAVITY_M_PER_S2, Stopping,
};
use engine::Scheme;
pub(crate) use law::StoredBy;
pub use law::{EnvelopeEnd, ForceLaw, Unloading, UnloadingShape};
use run::Grid;
pub use run::{BodyHistory, InterfaceHistory, Ledger, Method, Record, Run, RunSettings};

/// Runs the chain from the first contact (t = 0) for `duration_s`.
///
/// x counts from where each body is before gaps close; bodies move freely up to the
/// first contact.
///
/// # Errors
/// It names the interface or body.
pub fn simulate(chain: &Chain, settings: &RunSettings) -> Result<Run, Error> {
    let grid = Grid::new(chain, settings)?;
    let mut run = Run::new(chain, &grid, settings.record);
    for (history, interface) in run.interfaces.iter_mut().zip(chain.interfaces()) {
        history.data_end_m = interface.law.end_m();
        let tension = interface.tension.as_ref();
        history.tension_end_m = tension.map_or(f64::INFINITY, |tension| tension.law.end_m());
    }
    run.warnings.extend(shortened_step(chain, settings, grid.step_s));
    match settings.method {
        Method::Reference => reference::run(chain, settings, &grid, &mut run)?,
        Method::Verlet => engine::run(chain, Scheme::Verlet, settings.record, &grid, &mut run)?,
        Method::FourthOrder => {
            refuse_rates(chain)?;
            engine::run(chain, Scheme::FourthOrder, settings.record, &grid, &mut run)?;
        }
    }
    run.warnings.extend(beyond_ends(chain, &run));
    run.warnings.extend(untouched(chain, &run));
    run.warnings.extend(free_travel(chain, &run));
    // Contacts that repeat, and neighbours that push, would make a ratio of what is not one impact; the plate of an end is
    // stopped at once, whatever its vehicle does.
    let stopping = chain.interfaces().iter().filter_map(|i| i.stopping.as_ref());
    let plates: Vec<usize> = stopping.map(|stopping| stopping.zone).collect();
    for (k, history) in run.interfaces.iter_mut().enumerate() {
        let is_of_plate = plates.contains(&k) || plates.contains(&(k + 1));
        let is_of_impact = |ratio: &f64| *ratio <= MOST_RESTITUTION && !is_of_plate;
        history.restitution = history.restitution.filter(is_of_impact);
    }
    let end_s = grid.output_s(grid.outputs);
    run.warnings.extend(still_loaded(chain, &run, end_s));
    run.warnings.extend(still_crushed(chain, &run, end_s));
    Ok(run)
}

/// The fourth-order scheme takes no forces that depend on speeds.
fn refuse_rates(chain: &Chain) -> Result<(), Error> {
    if !chain.has_rates() {
        return Ok(());
    }
    let named = |what: &str, has: fn(&Interface) -> bool| {
        let interface = chain.interfaces().iter().find(|i| has(i))?;
        Some(format!("{what} of interface {}", interface.name))
    };
    let what = named("the damper", |i| i.damping.is_some())
        .or_else(|| named("the force", |i| i.rate.is_some() || i.stopping.is_some()))
        .unwrap_or_else(|| "running or braking resistance".into());
    Err(error!(
        Simulation at "run.method",
        "{what} depends on the speed, which the fourth-order method does not support: use method = \"verlet\""
    ))
}

/// For a requested step that is too long; the default step is not reported.
fn shortened_step(chain: &Chain, settings: &RunSettings, used_s: f64) -> Option<String> {
    let RunSettings { step_s: asked_s, method, .. } = *settings;
    let (shortest_s, k) = chain.shortest_time_s();
    if asked_s == method.default_step_s() || asked_s <= method.step_rule() * shortest_s {
        return None;
    }
    let interface = &chain.interfaces()[k].name;
    Some(format!(
        "the step of {asked_s:.3e} s is too long for interface {interface}: {used_s:.3e} s was used"
    ))
}

/// Of interfaces that went beyond the end of their curves.
fn beyond_ends(chain: &Chain, run: &Run) -> Vec<String> {
    let mut warnings = Vec::new();
    for (interface, history) in chain.interfaces().iter().zip(&run.interfaces) {
        let reached = [
            ("crushed", history.max_deflection_m, history.data_end_m),
            ("pulled apart by", history.max_extension_m, history.tension_end_m),
        ];
        for (what, deflection_m, end_m) in reached {
            if is_beyond(deflection_m, end_m) {
                warnings.push(format!(
                    "interface {} is {what} {deflection_m:.4} m, beyond the end of its curve's data at {end_m:.4} m: the force there is an assumption",
                    interface.name
                ));
            }
        }
    }
    warnings
}

/// Of interfaces whose gap never closes.
fn untouched(chain: &Chain, run: &Run) -> Vec<String> {
    let both = chain.interfaces().iter().zip(&run.interfaces);
    let never = both.filter(|(interface, history)| interface.gap_m > 0.0 && !history.has_touched());
    let said = |(interface, _): (&Interface, _)| {
        format!(
            "interface {} never touches: its gap of {} m stays open up to the end of the run; is the gap in another unit, or duration too short?",
            interface.name, interface.gap_m
        )
    };
    never.map(said).collect()
}

/// An elastic contact gives 1 but for rounding.
const MOST_RESTITUTION: f64 = 1.0 + 1e-4;
/// Free travel of a coupling after the crush, in m, that deserves a warning.
const FREE_TRAVEL_M: f64 = 0.05;

/// Of couplings that pull from the length at first, though what lies between was crushed.
fn free_travel(chain: &Chain, run: &Run) -> Vec<String> {
    let mut warnings = Vec::new();
    for (interface, history) in chain.interfaces().iter().zip(&run.interfaces) {
        let Some(tension) = &interface.tension else { continue };
        let largest_m = history.max_deflection_m;
        // The deflection at which the force has gone on the way back, by halving.
        let (mut gone_m, mut pressed_m) = (0.0, largest_m);
        for _ in 0..50 {
            let middle_m = 0.5 * (gone_m + pressed_m);
            let is_gone = interface.law.force_n(middle_m, largest_m) <= 0.0;
            *(if is_gone { &mut gone_m } else { &mut pressed_m }) = middle_m;
        }
        let travel_m = gone_m + interface.gap_m + tension.slack_m;
        if gone_m > FREE_TRAVEL_M && history.restitution.is_some() {
            warnings.push(format!(
                "interface {}: after a crush of {largest_m:.3} m its coupling carries tension only beyond its initial length, after {travel_m:.3} m of free travel; a real one would engage sooner, or be broken",
                interface.name
            ));
        }
    }
    warnings
}

/// Growth of a crush after the end of the run, as a share of it, that deserves a warning.
const GROWTH: f64 = 0.01;
/// How long an interface whose closing speed does not fall goes on at least, in s.
const PUSHED_S: f64 = 0.1;

/// Of interfaces that are crushed further after the end of the run, between bodies whose main contact is over: by how much follows from
/// the closing speed and how fast it falls.
fn still_crushed(chain: &Chain, run: &Run, end_s: f64) -> Option<String> {
    let last_s = end_s - 1.5 * run.step_s;
    let is_loaded = |k: usize| run.bodies.get(k).is_some_and(is_cut);
    // A wall stands still.
    let of = |k: usize| {
        run.bodies.get(k).map_or((0.0, 0.0), |b| (b.final_v_m_per_s, b.final_a_m_per_s2))
    };
    let grows = |k: usize| {
        let (history, (v, a), (v_ahead, a_ahead)) = (&run.interfaces[k], of(k), of(k + 1));
        let (closing, falls) = (v - v_ahead, a_ahead - a);
        let crush_m = history.max_deflection_m;
        let further_m = match falls > 0.0 {
            true => 0.5 * closing * closing / falls,
            false => closing * PUSHED_S,
        };
        closing > 0.0
            && crush_m > 0.0
            && history.max_deflection_time_s >= last_s
            && further_m > GROWTH * crush_m
            && !is_loaded(k)
            && !is_loaded(k + 1)
    };
    let names: Vec<&str> = chain
        .interfaces()
        .iter()
        .enumerate()
        .filter(|(k, _)| grows(*k))
        .map(|(_, interface)| interface.name.as_str())
        .collect();
    (!names.is_empty()).then(|| {
        format!(
            "the run ends at {} s while these are still being crushed, so crush and energy are not final: {}; lengthen duration",
            (end_s * 1e9).round() / 1e9,
            names.join(", ")
        )
    })
}

fn is_cut(body: &BodyHistory) -> bool {
    body.main_contact.map_or(body.is_loaded_at_end, |(.., is_cut)| is_cut)
}

/// Of bodies that a contact still loads at the end of the run.
fn still_loaded(chain: &Chain, run: &Run, end_s: f64) -> Option<String> {
    let loaded = chain.bodies().iter().zip(&run.bodies).filter(|(_, b)| is_cut(b));
    let bodies: Vec<&str> = loaded.map(|(body, _)| body.name.as_str()).collect();
    if bodies.is_empty() {
        return None;
    }
    // Without the rounding of a product.
    let end_s = (end_s * 1e9).round() / 1e9;
    Some(format!(
        "the run ends at {end_s} s while the contact still loads {}: crush and energy may still grow, and the mean deceleration covers the time up to then; lengthen duration",
        bodies.join(", ")
    ))
}
