//! Why a case cannot be left out, which a comparison says in its own words.

use crate::error::Error;

/// Why a case cannot be left out.
#[derive(Debug, thiserror::Error)]
pub enum NotLeftOut {
    /// Its largest deflection is not known.
    #[error("case \"{case}\" ended while loading: not left out")]
    Truncated {
        /// Its name.
        case: String,
    },
    /// There is no motion to compare with.
    #[error(transparent)]
    Motion(#[from] Error),
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
