//! Why there is no report.

use crate::assess::error::{CompareError, ValidateError};
use crate::database::DatabaseError;
use crate::scenario::ScenarioError;

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ReportError {
    /// A group is not there.
    #[error("{0}")]
    Database(#[from] DatabaseError),
    /// A group cannot be validated.
    #[error("{0}")]
    Validate(#[from] ValidateError),
    /// Methods cannot be compared.
    #[error("{0}")]
    Compare(#[from] CompareError),
    /// A scenario is wrong.
    #[error("{0}")]
    Scenario(#[from] Box<ScenarioError>),
}

impl From<ScenarioError> for ReportError {
    fn from(error: ScenarioError) -> Self {
        Self::Scenario(Box::new(error))
    }
}
