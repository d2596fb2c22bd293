//! What can be wrong with a plan.

use super::MAX_ITEMS;
use super::draw::DistributionError;
use crate::unit::UnitError;

/// What is wrong with a plan as a whole.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// No draw at all.
    #[error("sweep.samples is 0: expected 1 or more")]
    NoSample,
    /// A variable is drawn from a distribution, and the number of draws is missing.
    #[error(
        "a variable has a distribution: add samples = … to [sweep], the draws at each point of the grid"
    )]
    SamplesMissing,
    /// Nothing is drawn.
    #[error("sweep.samples is given, but no variable has a distribution: remove samples")]
    SamplesUnused,
    /// Nothing is drawn.
    #[error("sweep.sampling = \"latin_hypercube\" is given, but no variable has a distribution")]
    SamplingUnused,
    /// More items than any cluster could run.
    #[error(
        "the sweep has {} items: {MAX_ITEMS} at most; shorten values, steps or samples",
        .factors.iter().map(u64::to_string).collect::<Vec<_>>().join(" × ")
    )]
    TooMany {
        /// Samples, then the values of each variable, without those of one.
        factors: Vec<u64>,
    },
}

/// What is wrong with the values or the distribution of one variable.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VaryError {
    /// No value at all.
    #[error("values is empty: give one or more")]
    NoValues,
    /// Curves have no numbers between them.
    #[error("a curve needs values = [\"…\"], names in [curves]")]
    CurveValues,
    /// One step is no range.
    #[error("steps is {found}: expected 2 or more")]
    Steps {
        /// As written.
        found: u64,
    },
    /// Neither values nor a range nor a distribution, or several of them.
    #[error("give values = […], or from, to and steps, or a distribution")]
    NoSpread,
    /// A key that the distribution needs.
    #[error("the distribution needs {key} = …")]
    Missing {
        /// The key.
        key: &'static str,
    },
    /// A key that does not go with another.
    #[error("{key} does not go with {with}: remove one of them")]
    Together {
        /// The key.
        key: &'static str,
        /// What it does not go with.
        with: &'static str,
    },
    /// A value without a unit, or with one of another quantity.
    #[error("{key}: {source}")]
    Unit {
        /// The key.
        key: &'static str,
        /// What is wrong with it.
        source: UnitError,
    },
    /// A factor that is no number.
    #[error("{key}: \"{text}\" is no number: write a plain one, such as 0.9")]
    NoNumber {
        /// The key.
        key: &'static str,
        /// As written.
        text: String,
    },
    /// A value that the quantity cannot have.
    #[error("{key}: {text} is out of range: expected {}", range(*.low, *.high))]
    Range {
        /// The key.
        key: &'static str,
        /// As written.
        text: String,
        /// Least value that is allowed.
        low: f64,
        /// Largest value that is allowed; may be infinite.
        high: f64,
    },
    /// The numbers make no distribution.
    #[error(transparent)]
    Distribution(#[from] DistributionError),
}

fn range(low: f64, high: f64) -> String {
    match high.is_finite() {
        true => format!("from {low} to {high}"),
        false => format!("{low} or more"),
    }
}
