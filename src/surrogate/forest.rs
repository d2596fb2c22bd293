//! `forest` (DDTCM), the reference method's random forest on {v, d} → F, and `extra`.

use std::sync::Arc;

use linfa::traits::{Fit, Predict};
use ndarray::{Array1, Array2};
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use super::entry::{ModelEntry, loaded};
pub use super::forest_options::ForestOptions;
use super::{CaseCurve, QueryPoint, Surrogate, Warning};
use crate::curve::ForceKind;
use crate::dataset::TrainingSet;
use crate::forest::{ForestError, RegressionForest, Thresholds};

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
