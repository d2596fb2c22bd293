//! `forest` (DDTCM), the reference method's random forest on {v, d} → F, and `extra`.

use std::sync::Arc;

use linfa::ParamGuard;
use linfa::traits::{Fit, Predict};
use ndarray::{Array1, Array2};
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use super::models::{ModelEntry, loaded};
use super::{CaseCurve, QueryPoint, Surrogate, Warning};
use crate::curve::ForceKind;
use crate::dataset::{TableKind, TrainingSet};
use crate::forest::{ForestError, ForestParams, RegressionForest, StopRule, Thresholds};

crate::error::passes_on!(ForestError => Model);

pub(super) const ENTRY: ModelEntry = ModelEntry {
    name: "forest",
    about: "Random forest on speed and deflection (DDTCM)",
    complexity: 5,
    sees_features: true,
    follows_closing: false,
    needs_crush_law: false,
    least_curves: 2,
    // The reference method knows only crush over speed.
    forest: Some(ForestOptions::paper),
    fit: |input| {
        Ok(Arc::new(ForestSurrogate::fit(input.set, input.force, input.forest_options())?))
    },
    load: loaded::<ForestSurrogate>,
};

/// Extremely randomised trees (Geurts et al., Machine Learning 63, 2006).
pub(super) const EXTRA: ModelEntry = ModelEntry {
    name: "extra",
    about: "Extremely randomised trees",
    complexity: 4,
    forest: Some(ForestOptions::extra),
    ..ENTRY
};

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

    /// Extremely randomised trees: 50 on all points, thresholds at random, so that the
    /// forest is nearly continuous in speed.
    pub fn extra() -> Self {
        Self { thresholds: Thresholds::Random, bootstrap: false, ..Self::default() }
    }

    /// Whether they make a forest.
    pub(crate) fn check(&self) -> Result<(), ForestError> {
        self.params().check_ref().map(|_| ())
    }

    fn params(&self) -> ForestParams<f64> {
        ForestParams::new(self.trees)
            .seed(self.seed)
            .thresholds(self.thresholds)
            .stop(self.stop)
            .min_samples_leaf(self.min_samples_leaf)
            .bootstrap(self.bootstrap)
            .out_of_bag(self.bootstrap)
    }
}

/// A fitted forest and the speeds it jumps between.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ForestSurrogate {
    speeds_m_per_s: Vec<f64>,
    forest: RegressionForest<f64>,
}

/// Distance to a split midpoint below which a warning is due, as a share of the midpoint.
const NEAR_MIDPOINT: f64 = 0.01;

impl ForestSurrogate {
    /// Fits the forest to the table of the set.
    pub(crate) fn fit(
        set: &TrainingSet,
        force: ForceKind,
        options: &ForestOptions,
    ) -> Result<Self, ForestError> {
        let forest = options
            .params()
            .quantiles(options.quantiles && force == set.force_kind)
            .fit(&set.table_of(options.table, force, options.most_rows))?;
        Ok(Self { speeds_m_per_s: set.speeds_m_per_s(), forest })
    }

    /// The forest that was fitted, on speed, deflection and features.
    pub(crate) fn forest(&self) -> &RegressionForest<f64> {
        &self.forest
    }

    /// Lowest and highest force in N at each deflection between which the leaves' members lie
    /// with a weight of `level`; `None` if the leaves kept none.
    pub(crate) fn quantiles(
        &self,
        at: &QueryPoint<'_>,
        deflection_m: &[f64],
        level: f64,
    ) -> Option<(Vec<f64>, Vec<f64>)> {
        let levels = [0.5 * (1.0 - level), 0.5 * (1.0 + level)];
        let found = self.forest.quantiles(records(at, deflection_m).view(), &levels).ok()?;
        Some((found.column(0).to_vec(), found.column(1).to_vec()))
    }
}

impl Surrogate for ForestSurrogate {
    fn parameters(&self) -> Option<Result<Box<RawValue>, serde_json::Error>> {
        Some(serde_json::value::to_raw_value(self))
    }

    fn check(&self, features: usize) -> Result<(), String> {
        // Speed and deflection come first.
        let (found, expected) = (self.forest.features(), 2 + features);
        if found != expected {
            return Err(format!("the forest has {found} features instead of {expected}"));
        }
        self.forest.check().map_err(|e| e.to_string())
    }

    fn answers_from_curves(&self) -> bool {
        false
    }

    fn forest(&self) -> Option<&ForestSurrogate> {
        Some(self)
    }

    fn force_n(&self, _: &[CaseCurve], at: &QueryPoint<'_>, deflection_m: &[f64]) -> Vec<f64> {
        let force: Array1<f64> = self.forest.predict(&records(at, deflection_m));
        force.to_vec()
    }

    fn warnings(&self, _: &[CaseCurve], at: &QueryPoint<'_>) -> Vec<Warning> {
        let speed_m_per_s = at.speed_m_per_s;
        if self.forest.fitted_with().thresholds() == Thresholds::Random {
            return Vec::new();
        }
        let near = |pair: &&[f64]| {
            let middle = 0.5 * (pair[0] + pair[1]);
            (speed_m_per_s - middle).abs() <= NEAR_MIDPOINT * middle
        };
        self.speeds_m_per_s
            .windows(2)
            .filter(|pair| pair[0] < pair[1])
            .filter(near)
            .map(|pair| Warning::near_split_midpoint(speed_m_per_s, pair[0], pair[1]))
            .collect()
    }
}

/// One record per deflection, with the columns of the training table.
fn records(at: &QueryPoint<'_>, deflection_m: &[f64]) -> Array2<f64> {
    let shape = (deflection_m.len(), 2 + at.features.len());
    Array2::from_shape_fn(shape, |(i, k)| match k {
        0 => at.speed_m_per_s,
        1 => deflection_m[i],
        _ => at.features[k - 2],
    })
}
