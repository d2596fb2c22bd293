//! Scenario (TOML): trains, wall and curves, resolved into a multi-body chain.

mod assemble;
mod check;
mod layout;
mod local;
mod sources;
mod spring;
mod tables;

use std::path::{Path, PathBuf};

pub use assemble::AssemblyError;
pub(crate) use assemble::adjust;
pub use check::{CheckError, CheckedScenario};
pub(crate) use local::assemble;
pub(crate) use sources::{CurveSource, Sources};
pub use sources::{SourceError, StageError};
pub use spring::SpringError;
pub use tables::*;

use crate::database::DatabaseError;
use crate::formats::read::{ReadCurveError, json};
use crate::manifest::{self, ManifestError};
use crate::multibody::{Chain, ChainError, RunSettings, SimulationError};
use crate::surrogate::ModelError;
use crate::surrogate::predict::PredictError;

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
    pub used: Vec<Used>,
    /// Limits that results are held against.
    pub limits: Option<LimitsTable>,
    /// Bodies that the limits hold for: indices into the chain.
    pub limited: Vec<usize>,
    /// Warnings of the curves used.
    pub warnings: Vec<String>,
}

/// What an interface uses.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Used {
    /// Name of its curve in the scenario.
    pub curve: String,
    /// Which force it is, where that is known: `contact` or `body`.
    pub force: Option<&'static str>,
    /// Speed that its curve was predicted for, in m/s.
    pub speed_m_per_s: Option<f64>,
}

/// Why a scenario cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum ScenarioError {
    /// It is no TOML, or has other keys.
    #[error(transparent)]
    Manifest(#[from] ManifestError),
    /// It is wrong as a whole.
    #[error("{path}: {source}")]
    Check {
        /// The scenario.
        path: PathBuf,
        /// What is wrong.
        source: Box<CheckError>,
    },
    /// A curve's source is wrong.
    #[error("{path}: {source}")]
    Source {
        /// The scenario.
        path: PathBuf,
        /// Which curve, and what is wrong.
        source: SourceError,
    },
    /// A curve cannot stand where the scenario puts it.
    #[error("{path}: {source}")]
    Assembly {
        /// The scenario.
        path: PathBuf,
        /// Which curve, and why not.
        source: Box<AssemblyError>,
    },
    /// A model file cannot be used.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A model gives no curve.
    #[error("curve \"{curve}\": {source}")]
    Predict {
        /// Name of the curve.
        curve: String,
        /// Why.
        source: PredictError,
    },
    /// A database cannot be used.
    #[error(transparent)]
    Database(#[from] DatabaseError),
    /// A predicted curve cannot be used.
    #[error(transparent)]
    CurveFile(#[from] json::CurveFileError),
    /// A table of a curve cannot be used.
    #[error(transparent)]
    Csv(#[from] ReadCurveError),
    /// Its bodies make no chain.
    #[error("{path}: {source}")]
    Chain {
        /// The scenario.
        path: PathBuf,
        /// Why.
        source: ChainError,
    },
    /// The run that looks for the speeds of the interfaces failed.
    #[error("{path}: while the interfaces' speeds were sought: {source}")]
    Local {
        /// The scenario.
        path: PathBuf,
        /// Why.
        source: SimulationError,
    },
}

/// Parses and checks the text of a scenario; curves are not read. `path` is for messages.
///
/// # Errors
/// [`ScenarioError`] names the key.
pub fn parse(path: &Path, text: &str) -> Result<CheckedScenario<'static>, ScenarioError> {
    let scenario: Scenario = manifest::parse(path, text)?;
    Ok(check(path, &scenario)?.into_owned())
}

/// Checks a scenario as [`Scenario::check`] does, with its path in the message.
///
/// # Errors
/// [`ScenarioError::Check`] names the key.
pub(crate) fn check<'a>(
    path: &Path,
    scenario: &'a Scenario,
) -> Result<CheckedScenario<'a>, ScenarioError> {
    scenario
        .check()
        .map_err(|source| ScenarioError::Check { path: path.into(), source: source.into() })
}

/// Reads and checks a scenario; curves are not read.
///
/// # Errors
/// [`ScenarioError`] names the key.
pub fn read(path: &Path) -> Result<CheckedScenario<'static>, ScenarioError> {
    parse(path, &manifest::read_text(path)?)
}

/// Loads a scenario and everything it names.
///
/// # Errors
/// [`ScenarioError`] names the key, curve or file.
pub fn load(path: &Path) -> Result<Prepared, ScenarioError> {
    let scenario = read(path)?;
    let sources = Sources::read(path, &scenario)?;
    assemble(path, &scenario, &sources)
}
