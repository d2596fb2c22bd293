//! Why a validation or a comparison cannot be made.

use std::path::PathBuf;

use super::reference::MotionError;
use crate::curve::EnvelopeError;
use crate::dataset::DatasetError;
use crate::error::Error;
use crate::error::Place;
use crate::guess;
use crate::multibody::SimulationError;
use crate::nsdm::NsdmError;
use crate::rating::SignalError;
use crate::solver::ReadError;
use crate::surrogate::ModelError;
use crate::surrogate::predict::PredictError;

/// Why there is no validation or no model.
#[derive(Debug, thiserror::Error)]
pub enum ValidateError {
    /// The cases are no training set.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// A model cannot be fitted.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A model gives no curve.
    #[error(transparent)]
    Predict(#[from] PredictError),
    /// A motion cannot be compared.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// No model can be fitted without this speed; the text says why.
    #[error("without this speed: {0}")]
    NotFitted(String),
    /// An error against FE is no finite number.
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
    /// The group has no case at the speed that is asked for.
    #[error("group \"{group}\" has no case at {asked}: it has {known}")]
    NoCase {
        /// Name of the group.
        group: String,
        /// The speed, as text.
        asked: String,
        /// The speeds it has, as a list.
        known: String,
    },
    /// Too few cases would remain.
    #[error("leaving out one of {} leaves too few: a comparison needs at least 3", crate::plural::counted(*cases, "case"))]
    TooFew {
        /// How many cases there are.
        cases: usize,
    },
    /// The record of the case ended while loading.
    #[error("case \"{case}\" ended while loading: it is no reference; compare at another speed")]
    Truncated {
        /// Name of the case.
        case: String,
    },
    /// The fixed curve of FDRM is that of the speed that is left out.
    #[error("the fixed curve is that of {asked}, the speed that is left out: choose another one")]
    FixedIsLeftOut {
        /// The speed, as text.
        asked: String,
    },
    /// The models cannot be validated.
    #[error(transparent)]
    Validate(#[from] ValidateError),
    /// No spring and damper can be fitted.
    #[error(transparent)]
    Nsdm(#[from] NsdmError),
    /// The signals cannot be compared.
    #[error(transparent)]
    Signal(#[from] SignalError),
    /// The train cannot be compared.
    #[error("{0}")]
    Train(#[from] TrainError),
    /// The case cannot be left out.
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
    /// It is about a key of the scenario.
    #[error("{place}: {source}")]
    InScenario {
        /// Where in the scenario.
        place: Place,
        /// Why.
        source: Box<TrainError>,
    },
    /// A curve of the scenario does not come from a database.
    #[error(
        "curve \"{curve}\" is no case of a database: to compare methods, write database = \"…\" and case = \"group/case\""
    )]
    NotACase {
        /// Its name in the scenario.
        curve: String,
    },
    /// `[reference]` names a vehicle that the scenario does not have.
    #[error(
        "the scenario has no vehicle \"{name}\": its vehicles are {known}{}",
        guess::hint(name, known)
    )]
    NoVehicle {
        /// The name.
        name: String,
        /// The scenario's vehicles, as a list.
        known: String,
    },
    /// FE's record is too short.
    #[error("FE's record has {} up to {until_s} s: at least 3 are needed", crate::plural::counted(*states, "state"))]
    TooShort {
        /// Number of its states.
        states: usize,
        /// End of the comparison that is asked for, in s.
        until_s: f64,
    },
    /// The multi-body run ends before what it is compared with.
    #[error(
        "the run ends at {duration_s} s, before FE's record or until ({until_s} s): lengthen duration, or set until in [reference]"
    )]
    RunTooShort {
        /// End of the run, in s.
        duration_s: f64,
        /// End of the comparison, in s.
        until_s: f64,
    },
    /// `[reference]` names no node of any vehicle.
    #[error("[reference] nodes names no vehicle: write nodes = {{ A1 = 900001 }}")]
    NoNodes,
    /// FE's vehicle begins at another speed than the scenario's.
    #[error(
        "in FE's record {vehicle} begins at {fe_m_per_s:.3} m/s, in the scenario at {m_per_s:.3} m/s: check units, nodes and speeds"
    )]
    OtherSpeed {
        /// Name of the vehicle.
        vehicle: String,
        /// Speed in FE's record, in m/s.
        fe_m_per_s: f64,
        /// Speed in the scenario, in m/s.
        m_per_s: f64,
    },
    /// The scenario names no FE run.
    #[error("the scenario has no [reference]: add one that names FE's run of the train")]
    NoReference,
    /// FE's record lacks a history, or part of it.
    #[error(
        "{path}: node {node} has no complete {component}: look with crumple inspect, and name another node or component in [reference]"
    )]
    NoHistory {
        /// The record.
        path: PathBuf,
        /// Number of the node.
        node: i64,
        /// Name of the component.
        component: String,
    },
    /// FE's record cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The scenario cannot be run.
    #[error("{0}")]
    Scenario(#[from] Error),
}

impl TrainError {
    /// Where in the scenario it is wrong.
    pub(crate) fn place(&self) -> Option<&Place> {
        match self {
            Self::InScenario { place, .. } => Some(place),
            Self::Scenario(error) => error.place(),
            _ => None,
        }
    }
}

impl From<Error> for CompareError {
    fn from(error: Error) -> Self {
        TrainError::from(error).into()
    }
}
