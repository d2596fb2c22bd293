//! Why a validation or a comparison cannot be made.

use std::path::PathBuf;

use super::reference::MotionError;
use crate::curve::EnvelopeError;
use crate::database::DatabaseError;
use crate::dataset::DatasetError;
use crate::multibody::SimulationError;
use crate::nsdm::NsdmError;
use crate::rating::SignalError;
use crate::scenario::ScenarioError;
use crate::solver::ReadError;
use crate::surrogate::ModelError;
use crate::surrogate::predict::PredictError;

/// Why there is no validation or no model.
#[derive(Debug, thiserror::Error)]
pub enum ValidateError {
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Predict(#[from] PredictError),
    #[error(transparent)]
    Motion(#[from] MotionError),
    #[error("without this speed: {0}")]
    NotFitted(String),
    #[error("its errors against FE are no finite numbers")]
    NotFinite,
}

/// Why a case cannot be left out.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NotLeftOut {
    /// Its largest deflection is not known.
    #[error("case \"{case}\" ended while loading: not left out")]
    Truncated {
        /// Its name.
        case: String,
    },
    /// There is no motion to compare with.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// Ratios to its energy would divide by zero.
    #[error("case \"{case}\" has no energy to compare with")]
    NoEnergy {
        /// Its name.
        case: String,
    },
    /// Fewer than two speeds remain.
    #[error("without case \"{case}\" fewer than 2 speeds remain")]
    TooFew {
        /// Its name.
        case: String,
    },
}

/// Why there is no comparison.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    #[error("group \"{group}\" has no case at {asked}: it has {known}")]
    NoCase {
        group: String,
        asked: String,
        known: String,
    },
    #[error("leaving out one of {cases} cases leaves too few: a comparison needs at least 3")]
    TooFew {
        cases: usize,
    },
    #[error("case \"{case}\" ended while loading: it is no reference; compare at another speed")]
    Truncated {
        case: String,
    },
    #[error("the fixed curve is that of {asked}, the speed that is left out: choose another one")]
    FixedIsLeftOut {
        asked: String,
    },
    #[error(transparent)]
    Validate(#[from] ValidateError),
    #[error(transparent)]
    Nsdm(#[from] NsdmError),
    #[error(transparent)]
    Signal(#[from] SignalError),
    #[error(transparent)]
    Train(#[from] TrainError),
    #[error(transparent)]
    NotLeftOut(#[from] NotLeftOut),
}

/// Causes that validation names as well.
macro_rules! through_validate {
    ($($error:ty),*) => {$(
        impl From<$error> for CompareError {
            fn from(error: $error) -> Self {
                Self::Validate(error.into())
            }
        }
    )*};
}
through_validate!(DatasetError, ModelError, PredictError, MotionError);

impl From<EnvelopeError> for CompareError {
    fn from(error: EnvelopeError) -> Self {
        PredictError::from(error).into()
    }
}

impl From<SimulationError> for CompareError {
    fn from(error: SimulationError) -> Self {
        MotionError::from(error).into()
    }
}

/// Why a train cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    #[error(
        "curve \"{curve}\" is no case of a database: to compare methods, write database = \"…\" and case = \"group/case\""
    )]
    NotACase {
        curve: String,
    },
    #[error("the scenario has no vehicle \"{name}\": its vehicles are {known}")]
    NoVehicle {
        name: String,
        known: String,
    },
    #[error("FE's record has {states} states up to {until_s} s: at least 3 are needed")]
    TooShort {
        states: usize,
        until_s: f64,
    },
    #[error(
        "{path}: the run ends at {duration_s} s, before FE's record or until ({until_s} s): lengthen duration, or set until in [reference]"
    )]
    RunTooShort {
        path: PathBuf,
        duration_s: f64,
        until_s: f64,
    },
    #[error("{path}: [reference] nodes names no vehicle: write nodes = {{ A1 = 900001 }}")]
    NoNodes {
        path: PathBuf,
    },
    #[error(
        "{path}: in FE's record {vehicle} begins at {fe_m_per_s:.3} m/s, in the scenario at {m_per_s:.3} m/s: check units, nodes and speeds"
    )]
    OtherSpeed {
        path: PathBuf,
        vehicle: String,
        fe_m_per_s: f64,
        m_per_s: f64,
    },
    #[error("{path}: the scenario has no [reference]: add one that names FE's run of the train")]
    NoReference {
        path: PathBuf,
    },
    #[error(
        "{path}: node {node} has no complete {component}: look with crumple inspect, and name another node or component in [reference]"
    )]
    NoHistory {
        path: PathBuf,
        node: i64,
        component: String,
    },
    #[error(transparent)]
    Read(#[from] ReadError),
    #[error(transparent)]
    Scenario(#[from] Box<ScenarioError>),
    #[error(transparent)]
    Database(#[from] DatabaseError),
}

impl From<ScenarioError> for CompareError {
    fn from(error: ScenarioError) -> Self {
        TrainError::from(Box::new(error)).into()
    }
}
