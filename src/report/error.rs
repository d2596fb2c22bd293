//! Why there is no report.

use crate::assess::error::{CompareError, ValidateError};
use crate::error::Error;

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ReportError {
    /// A group cannot be validated.
    #[error("{0}")]
    Validate(#[from] ValidateError),
    /// Methods cannot be compared.
    #[error("{0}")]
    Compare(#[from] CompareError),
    /// A room below says why.
    #[error("{0}")]
    Below(#[from] Error),
}
