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
mod end;
mod layout;
mod local;
mod place;
mod sources;
mod spring;
mod tables;

use std::path::Path;

pub use assemble::AssemblyError;
pub(crate) use assemble::{PLATES, adjust};
pub use check::CheckError;
pub use check::CheckedScenario;
pub(crate) use local::assemble;
pub use sources::SourceError;
pub use sources::StageError;
pub(crate) use sources::{CurveSource, Sources};
pub use spring::SpringError;
pub(crate) use tables::*;

use crate::database::DatabaseError;
use crate::formats::read::{ReadCurveError, json};
use crate::manifest::{self, Document, ManifestError, Place};
use crate::multibody::{Chain, ChainError, Run, RunSettings, SimulationError, simulate};
use crate::surrogate::ModelError;
use crate::surrogate::predict::PredictError;
pub use end::PlatesError;
use place::Origin;
pub use tables::ContactTable;
pub use tables::CrushZoneTable;
pub use tables::CurveTable;
pub use tables::DampingTable;
pub use tables::EndName;
pub use tables::InterfaceSpeed;
pub use tables::LawName;
pub use tables::LimitsTable;
pub use tables::MethodName;
pub use tables::ReferenceTable;
pub use tables::ResistanceTable;
pub use tables::RunTable;
pub use tables::Scenario;
pub use tables::StageTable;
pub use tables::TrainTable;
pub use tables::VehicleTable;
pub use tables::WallTable;

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
    /// Where it comes from.
    origin: Origin,
}

impl Prepared {
    /// Runs it.
    ///
    /// # Errors
    /// [`ScenarioError::Run`] with the place of the key that decides it.
    pub fn run(&self) -> Result<Run, ScenarioError> {
        simulate(&self.chain, &self.settings)
            .map_err(|source| ScenarioError::Run { place: self.place_of(&source), source })
    }
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
    #[error("{0}")]
    Manifest(#[from] ManifestError),
    /// It is wrong as a whole.
    #[error("{place}: {source}")]
    Check {
        /// Where in the scenario.
        place: Place,
        /// What is wrong.
        source: Box<CheckError>,
    },
    /// A curve's source is wrong.
    #[error("{place}: {source}")]
    Source {
        /// Where in the scenario.
        place: Place,
        /// Which curve, and what is wrong.
        source: SourceError,
    },
    /// A curve cannot stand where the scenario puts it.
    #[error("{place}: {source}")]
    Assembly {
        /// Where in the scenario.
        place: Place,
        /// Which curve, and why not.
        source: Box<AssemblyError>,
    },
    /// A file that a curve names cannot be used.
    #[error("{place}: curve \"{curve}\": {source}")]
    File {
        /// Where the scenario names it.
        place: Place,
        /// Name of the curve.
        curve: String,
        /// Why.
        source: Box<SourceFileError>,
    },
    /// A model gives no curve.
    #[error("{place}: curve \"{curve}\": {source}")]
    Predict {
        /// Where in the scenario.
        place: Place,
        /// Name of the curve.
        curve: String,
        /// Why.
        source: PredictError,
    },
    /// Its bodies make no chain.
    #[error("{place}: {source}")]
    Chain {
        /// Where in the scenario.
        place: Place,
        /// Why.
        source: ChainError,
    },
    /// The run that looks for the speeds of the interfaces failed.
    #[error("{place}: while the interfaces' speeds were sought: {source}")]
    Local {
        /// Where in the scenario.
        place: Place,
        /// Why.
        source: SimulationError,
    },
    /// The run failed.
    #[error("{place}: {source}")]
    Run {
        /// Where in the scenario.
        place: Place,
        /// Why.
        source: SimulationError,
    },
}

impl ScenarioError {
    /// Where in the scenario it is wrong.
    pub(crate) fn place(&self) -> Option<&Place> {
        match self {
            Self::Manifest(error) => error.place(),
            Self::Check { place, .. }
            | Self::Source { place, .. }
            | Self::Assembly { place, .. }
            | Self::File { place, .. }
            | Self::Predict { place, .. }
            | Self::Chain { place, .. }
            | Self::Local { place, .. }
            | Self::Run { place, .. } => Some(place),
        }
    }
}

/// Why a file that a curve names cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SourceFileError {
    /// A model file.
    #[error("{0}")]
    Model(#[from] ModelError),
    /// A database.
    #[error("{0}")]
    Database(#[from] DatabaseError),
    /// A predicted curve.
    #[error("{0}")]
    Predicted(#[from] json::CurveFileError),
    /// A table of a curve.
    #[error("{0}")]
    Table(#[from] ReadCurveError),
}

/// Parses and checks the text of a scenario; curves are not read. `path` is for messages.
///
/// # Errors
/// [`ScenarioError`] names the key.
pub fn parse(path: &Path, text: &str) -> Result<CheckedScenario<'static>, ScenarioError> {
    let scenario: Scenario = manifest::parse(path, text)?;
    let document = Document::new(path, text);
    let checked = scenario.check().map_err(|source| {
        let place = document.place(&scenario.check_key(&source));
        ScenarioError::Check { place, source: source.into() }
    })?;
    Ok(checked.with(document).into_owned())
}

/// Checks a scenario that is not as its file has it, with the file's path in the message.
///
/// # Errors
/// [`ScenarioError::Check`] names the key.
pub(crate) fn check<'a>(
    path: &Path,
    scenario: &'a Scenario,
) -> Result<CheckedScenario<'a>, ScenarioError> {
    scenario.check().map_err(|source| ScenarioError::Check {
        place: Place::of_file(path),
        source: source.into(),
    })
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
