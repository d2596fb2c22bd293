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
mod sequence;
mod sources;
mod spring;
mod summary;
mod tables;

use std::path::Path;
use std::sync::Arc;

use serde::Serialize;

use crate::error::{Document, Error, Place};
use crate::manifest;
use crate::multibody::{Chain, Run, RunSettings, simulate};
use assemble::OfOneImpact;
pub(crate) use assemble::{PLATES, adjust};
pub use check::CheckedScenario;
pub(crate) use local::assemble;
use place::Origin;
pub(crate) use sources::{CurveOrigin, CurveSource, Sources};
pub(crate) use summary::{Limits, Summary};
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
    /// The interface at which the trains meet, each other or the wall: the bodies up to it are the first train's.
    pub(crate) meeting: usize,
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
    /// Where its stages begin, in m, and their names, if it has any.
    #[serde(skip)]
    pub(crate) stages: Arc<[(f64, String)]>,
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

/// Whether an interface, or the slack of a coupling, takes the gap of a curve, and the interfaces that do not although they have
/// the curve: where contact, train or vehicle state one.
///
/// # Errors
/// If the scenario is not one.
pub(crate) fn takes_gap_of(scenario: &Scenario, curve: &str) -> Result<(bool, Vec<String>), Error> {
    let checked = scenario.check()?;
    let mut slots = layout::layout(&checked).slots;
    slots.retain(|slot| slot.joint == layout::ConnectionKind::Curve(curve));
    let is_slack = scenario.curves.values().any(|of| of.tension.as_deref() == Some(curve));
    let takes = slots.iter().any(|slot| slot.gap_m.is_none());
    let others = slots.into_iter().filter(|slot| slot.gap_m.is_some()).map(|slot| slot.name);
    Ok((takes || is_slack, others.collect()))
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

/// A scenario whose curves of models and predictions all have the same edge of their bands, the lower (−1) or the upper (1); `None` if
/// none has one. Ends of vehicles and curves with a rate have none, and a `band` of the scenario stays.
///
/// # Errors
/// If a band does not reach to the speed of an interface.
pub(crate) fn at_band_edge(
    path: &Path,
    read: &Scenario,
    sources: &Sources,
    member: f64,
) -> Result<Option<Prepared>, Error> {
    let zones = read.train.iter().flat_map(|train| &train.vehicles).flat_map(VehicleTable::zones);
    let ends: Vec<&str> = zones.map(|zone| zone.curve).collect();
    let mut changed = read.clone();
    let is_free = |(name, table): &(&String, &mut CurveTable)| {
        table.band.is_none()
            && table.law != LawName::Rate
            && !ends.contains(&name.as_str())
            && sources.has_band(name)
    };
    let free = changed.curves.iter_mut().filter(is_free);
    if free.map(|(_, table)| table.band = Some(member)).count() == 0 {
        return Ok(None);
    }
    assemble(path, &check(path, &changed)?, sources).map(Some)
}
