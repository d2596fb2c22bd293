//! Options of a forest surrogate.

use linfa::ParamGuard;
use serde::{Deserialize, Serialize};

use crate::dataset::TableKind;
use crate::forest::{ForestError, ForestParams, StopRule, Thresholds};

/// Choices of the forest surrogate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ForestOptions {
    /// Number of trees.
    pub trees: usize,
    /// Seed of the random draws: the same seed gives the same bytes.
    pub seed: u64,
    /// Where the thresholds of splits are tried.
    pub thresholds: Thresholds,
    /// When a branch stops growing.
    pub stop: StopRule,
    /// Minimum number of samples in a leaf.
    pub min_samples_leaf: usize,
    /// Which points of the loading branches it learns from.
    pub table: TableKind,
    /// Whether each tree sees a sample drawn with replacement, or all points.
    #[serde(default = "default_true")]
    pub bootstrap: bool,
    /// Whether the leaves keep their members, for quantiles.
    #[serde(default)]
    pub quantiles: bool,
    /// Most rows that it learns from, those of the curves nearest to a speed in m/s: a forest that is judged at that speed needs
    /// no others.
    #[serde(skip)]
    pub most_rows: Option<(usize, f64)>,
}

fn default_true() -> bool {
    true
}

impl Default for ForestOptions {
    /// 50 trees on a deflection grid from the solver's rate.
    fn default() -> Self {
        Self {
            trees: 50,
            seed: 0,
            thresholds: Thresholds::Midpoint,
            stop: StopRule::StdOverMean(0.01),
            min_samples_leaf: 1,
            table: TableKind::Grid,
            bootstrap: true,
            quantiles: false,
            most_rows: None,
        }
    }
}

impl ForestOptions {
    /// The reference method: 50 trees, the states at the common interval, and the stop
    /// rule as printed, `Var/Mean`. Its threshold is not printed with a unit; 0.01 (in N)
    /// leaves the trees practically unpruned.
    pub fn paper() -> Self {
        Self { stop: StopRule::VarOverMean(0.01), table: TableKind::Samples, ..Self::default() }
    }
}

impl ForestOptions {
    /// Whether they make a forest.
    pub(crate) fn check(&self) -> Result<(), ForestError> {
        self.params().check_ref().map(|_| ())
    }

    pub(super) fn params(&self) -> ForestParams<f64> {
        ForestParams::new(self.trees)
            .seed(self.seed)
            .thresholds(self.thresholds)
            .stop(self.stop)
            .min_samples_leaf(self.min_samples_leaf)
            .bootstrap(self.bootstrap)
            .out_of_bag(self.bootstrap)
    }
}
