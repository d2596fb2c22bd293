//! Scenario (TOML): trains, wall and curves, resolved into a multi-body chain.
//!
//! ```
//! use crumple::multibody::simulate;
//! use std::path::Path;
//!
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("scenario.toml");
//! # let nose = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/nose.csv");
//! # let text = format!(r#"
//! # [run]
//! # duration = "300ms"
//! # output_interval = "0.75ms"
//! # [curves]
//! # nose = {{ file = '{}' }}
//! # [[train]]
//! # name = "A"
//! # speed = "36km/h"
//! # vehicles = [{{ name = "A1", mass = "24t" }}]
//! # [wall]
//! # [contact]
//! # curve = "nose"
//! # "#, nose.display());
//! # std::fs::write(&path, text)?;
//! let prepared = crumple::scenario::load(&path)?;
//! let run = simulate(&prepared.chain, &prepared.settings)?;
//! assert!(run.interfaces[0].max_deflection_m > 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod assemble;
mod check;
mod layout;
mod local;
mod place;
mod sources;
mod spring;
mod tables;

use std::path::Path;

use serde::Serialize;

use crate::error::{Document, Error, Place};
use crate::manifest;
use crate::multibody::{
    Chain, Interface, InterfaceHistory, Run, RunSettings, STANDARD_GRAVITY_M_PER_S2, simulate,
};
use assemble::OfOneImpact;
pub(crate) use assemble::{PLATES, adjust};
pub use check::CheckedScenario;
pub(crate) use local::assemble;
use place::Origin;
pub(crate) use sources::{CurveOrigin, CurveSource, Sources};
pub use tables::Scenario;
pub(crate) use tables::*;

/// A scenario ready to run.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// Bodies and interfaces.
    pub chain: Chain,
    /// Times and method of the run.
    pub settings: RunSettings,
    /// Bodies as the scenario lists them: indices into the chain, first train first.
    pub order: Vec<usize>,
    /// What each interface of the chain uses.
    pub(crate) used: Vec<CurveInUse>,
    /// Bodies that are vehicles, or what is left of them: the others are masses of crush zones.
    pub(crate) vehicles: Vec<usize>,
    /// Limits that results are compared with.
    pub(crate) limits: Option<LimitsTable>,
    /// Bodies that the limits hold for: indices into the chain.
    pub limited: Vec<usize>,
    /// Warnings of the curves used.
    pub warnings: Vec<String>,
    /// Curves that are of one impact, and the number of warnings before those on them, which follow speeds and masses.
    of_one: (Vec<OfOneImpact>, usize),
    origin: Origin,
}

impl Prepared {
    /// Runs it.
    ///
    /// # Errors
    /// At the place of the key that decides it.
    pub fn run(&self) -> Result<Run, Error> {
        simulate(&self.chain, &self.settings).map_err(|error| self.failed(error))
    }

    /// The error of a run, at the place of the key that decides it.
    fn failed(&self, error: Error) -> Error {
        error.placed(|key| self.place(key))
    }
}

/// What an interface uses.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct CurveInUse {
    /// Name of its curve in the scenario.
    pub(crate) curve: String,
    /// Which force it is, where that is known: `contact` or `body`.
    #[serde(rename = "curve_force")]
    pub(crate) force: Option<&'static str>,
    /// Speed that its curve was predicted for, in m/s.
    #[serde(rename = "curve_speed_m_per_s")]
    pub(crate) speed_m_per_s: Option<f64>,
}

/// Parses and checks the text of a scenario; curves are not read. `path` is for messages.
///
/// # Errors
/// It names the key.
pub fn parse(path: &Path, text: &str) -> Result<CheckedScenario<'static>, Error> {
    let scenario: Scenario = manifest::parse(path, text)?;
    let document = Document::new(path, text);
    let checked = scenario.check().map_err(|error| error.placed(|key| document.place(key)))?;
    Ok(checked.with(document).into_owned())
}

/// Checks a scenario that is not as in its file, with the file's path in the message.
pub(crate) fn check<'a>(path: &Path, scenario: &'a Scenario) -> Result<CheckedScenario<'a>, Error> {
    scenario.check().map_err(|error| error.placed(|_| Place::of_file(path)))
}

/// Reads and checks a scenario; curves are not read.
///
/// # Errors
/// It names the key.
pub fn read(path: &Path) -> Result<CheckedScenario<'static>, Error> {
    parse(path, &manifest::read_text(path)?)
}

/// Loads a scenario and everything it names.
///
/// # Errors
/// It names the key, curve or file.
pub fn load(path: &Path) -> Result<Prepared, Error> {
    load_with_origins(path).map(|(prepared, _)| prepared)
}

/// The same, with what its curves come from.
pub(crate) fn load_with_origins(path: &Path) -> Result<(Prepared, Vec<CurveOrigin>), Error> {
    let scenario = read(path)?;
    let sources = Sources::read(path, &scenario)?;
    Ok((assemble(path, &scenario, &sources)?, sources.origins(&scenario)))
}

/// A run in numbers.
#[derive(Serialize)]
pub(crate) struct Summary<'a> {
    /// In the order of the scenario.
    pub(crate) bodies: Vec<BodySummary<'a>>,
    pub(crate) interfaces: Vec<InterfaceSummary<'a>>,
    pub(crate) step_s: f64,
    /// Time of the last output, which the final speeds are for.
    pub(crate) end_s: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) limits: Option<Limits<'a>>,
}

#[derive(Serialize)]
pub(crate) struct BodySummary<'a> {
    pub(crate) name: &'a str,
    #[serde(skip)]
    pub(crate) mass_kg: f64,
    #[serde(skip)]
    pub(crate) initial_v_m_per_s: f64,
    pub(crate) final_v_m_per_s: f64,
    mean_deceleration_m_per_s2: f64,
    pub(crate) mean_deceleration_g: f64,
    /// Whether it is the crush zone of a vehicle's end, which stops at once: its decelerations are
    /// no vehicle's.
    pub(crate) is_crush_zone: bool,
    /// The run ended before the contact of that mean did: it is the mean of a part.
    pub(crate) still_loaded_at_end: bool,
    /// Over the 120 ms in which it is largest in magnitude; null in a shorter run.
    pub(crate) moving_mean_deceleration_g: Option<f64>,
    /// Speed at which an unrestrained occupant meets the interior after 0.6 m; null for a crush zone, and if the run
    /// ends before.
    pub(crate) secondary_impact_m_per_s: Option<f64>,
    /// Occupant load criterion: 65 mm of slack, then stopped within 235 mm; null as above.
    pub(crate) occupant_load_g: Option<f64>,
}

#[derive(Serialize)]
pub(crate) struct InterfaceSummary<'a> {
    pub(crate) name: &'a str,
    #[serde(flatten)]
    pub(crate) history: &'a InterfaceHistory,
    /// Stored, dissipated and damped until the end; null if the last is not known.
    #[serde(rename = "energy_J")]
    pub(crate) energy_j: Option<f64>,
    /// Its share of what all interfaces have taken.
    pub(crate) energy_share: Option<f64>,
    #[serde(flatten)]
    pub(crate) used: &'a CurveInUse,
}

/// Mean decelerations against a limit.
#[derive(Serialize)]
pub(crate) struct Limits<'a> {
    pub(crate) standard: &'a str,
    pub(crate) edition: &'a str,
    pub(crate) mean_deceleration_limit_g: f64,
    /// Trains that it is for; null for all.
    pub(crate) trains: &'a Option<Vec<String>>,
    /// Bodies whose mean deceleration is over it.
    pub(crate) over: Vec<&'a str>,
    /// Limits on what occupants meet.
    pub(crate) occupants: Vec<OccupantLimit<'a>>,
    /// Interfaces that were crushed beyond the data of their curves: then nothing here is a verdict.
    pub(crate) beyond_data: Vec<&'a str>,
    pub(crate) statement: String,
}

impl Limits<'_> {
    /// Whether a vehicle is over any of them; `None` if that is not known.
    pub(crate) fn are_broken(&self) -> Option<bool> {
        let is_broken =
            !self.over.is_empty() || self.occupants.iter().any(|of| !of.over.is_empty());
        let is_known = is_broken || self.occupants.iter().all(|of| of.unknown.is_empty());
        (is_known && self.beyond_data.is_empty()).then_some(is_broken)
    }
}

/// What occupants meet against a limit.
#[derive(Serialize)]
pub(crate) struct OccupantLimit<'a> {
    /// `secondary_impact_m_per_s` or `occupant_load_g`.
    pub(crate) what: &'static str,
    pub(crate) limit: f64,
    pub(crate) over: Vec<&'a str>,
    /// Bodies whose run ended before it was known.
    pub(crate) unknown: Vec<&'a str>,
}

impl OccupantLimit<'_> {
    /// In words.
    pub(crate) fn text(&self) -> String {
        let (what, unit) = match self.what {
            "occupant_load_g" => ("occupant load", "g"),
            _ => ("secondary impact", "m/s"),
        };
        let known = match (&*self.over, &*self.unknown) {
            ([], []) => "no vehicle".into(),
            ([], _) => "no vehicle of which it is known".into(),
            (over, _) => over.join(", "),
        };
        let unknown = match &*self.unknown {
            [] => String::new(),
            names => format!("; the run ended before it is known of {}", names.join(", ")),
        };
        format!("{what} over {} {unit}: {known}{unknown}", self.limit)
    }
}

impl Prepared {
    /// What `run`, a run of this scenario, comes to.
    pub(crate) fn summary<'a>(&'a self, run: &'a Run) -> Summary<'a> {
        let (bodies, interfaces) = (self.chain.bodies(), self.chain.interfaces());
        let is_crush_zone = |i: usize| !self.vehicles.contains(&i);
        let of_body = |&i: &usize| {
            let (body, history) = (&bodies[i], &run.bodies[i]);
            let in_g = |a_m_per_s2: f64| a_m_per_s2 / STANDARD_GRAVITY_M_PER_S2;
            BodySummary {
                name: &body.name,
                mass_kg: body.mass_kg,
                initial_v_m_per_s: body.speed_m_per_s,
                final_v_m_per_s: history.final_v_m_per_s,
                mean_deceleration_m_per_s2: history.mean_deceleration_m_per_s2,
                mean_deceleration_g: in_g(history.mean_deceleration_m_per_s2),
                is_crush_zone: is_crush_zone(i),
                still_loaded_at_end: history.is_loaded_at_end,
                moving_mean_deceleration_g: history.moving_mean_deceleration_m_per_s2.map(in_g),
                secondary_impact_m_per_s: history
                    .secondary_impact_m_per_s
                    .filter(|_| !is_crush_zone(i)),
                occupant_load_g: history
                    .occupant_load_m_per_s2
                    .filter(|_| !is_crush_zone(i))
                    .map(in_g),
            }
        };
        let bodies: Vec<BodySummary<'a>> = self.order.iter().map(of_body).collect();
        let judged = || {
            let all = self.order.iter().zip(&bodies).filter(|(i, _)| self.limited.contains(i));
            all.map(|(_, body)| body)
        };
        let occupants = |limits: &LimitsTable| {
            type Met<'a> = fn(&BodySummary<'a>) -> Option<f64>;
            let speed = limits.secondary_impact.as_ref().map(|speed| speed.0);
            let of: [(_, _, Met<'a>); 2] = [
                ("secondary_impact_m_per_s", speed, |body| body.secondary_impact_m_per_s),
                ("occupant_load_g", limits.occupant_load_g, |body| body.occupant_load_g),
            ];
            let asked = of.into_iter().filter_map(|(what, limit, met)| Some((what, limit?, met)));
            let judged = |(what, limit, met): (_, f64, Met<'a>)| OccupantLimit {
                what,
                limit,
                over: judged()
                    .filter(|body| met(body).is_some_and(|met| met.abs() > limit))
                    .map(|body| body.name)
                    .collect(),
                unknown: judged().filter(|b| met(b).is_none()).map(|body| body.name).collect(),
            };
            asked.map(judged).collect()
        };
        let limits = self.limits.as_ref().map(|limits| Limits {
            standard: &limits.standard,
            edition: &limits.edition,
            mean_deceleration_limit_g: limits.mean_deceleration_g,
            trains: &limits.trains,
            over: judged()
                .filter(|body| body.mean_deceleration_g.abs() > limits.mean_deceleration_g)
                .map(|body| body.name)
                .collect(),
            occupants: occupants(limits),
            beyond_data: run.beyond_data().map(|k| &*interfaces[k].name).collect(),
            statement: format!(
                "these values come from a one-dimensional model and say nothing about survival space; they are not evidence of conformity with {}:{}",
                limits.standard, limits.edition
            ),
        });
        let energy_j = InterfaceHistory::energy_at_end_j;
        let all_j: Option<f64> = run.interfaces.iter().map(energy_j).sum();
        let of_interface = |((of, history), used): ((&'a Interface, &'a InterfaceHistory), _)| {
            let energy_j = energy_j(history);
            let share = |(energy_j, all_j): (f64, f64)| energy_j / all_j;
            let energy_share = energy_j.zip(all_j.filter(|all_j| *all_j > 0.0)).map(share);
            InterfaceSummary { name: &of.name, history, energy_j, energy_share, used }
        };
        let interfaces = interfaces.iter().zip(&run.interfaces).zip(&self.used);
        Summary {
            bodies,
            interfaces: interfaces.map(of_interface).collect(),
            step_s: run.step_s,
            end_s: run.time_s.last().copied().unwrap_or_default(),
            limits,
        }
    }
}
