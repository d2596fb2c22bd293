//! `extra`: extremely randomised trees (Geurts et al., Machine Learning 63, 2006).

use std::sync::Arc;

use super::entry::{ModelEntry, loaded};
use super::forest::ForestSurrogate;
use super::forest_options::ForestOptions;
use crate::forest::Thresholds;

pub(super) const ENTRY: ModelEntry = ModelEntry {
    name: "extra",
    about: "Extremely randomised trees",
    complexity: 4,
    sees_features: true,
    follows_closing: false,
    needs_crush_law: false,
    least_curves: 2,
    forest: Some(ForestOptions::extra),
    fit: |input| {
        Ok(Arc::new(ForestSurrogate::fit(input.set, input.force, input.forest_options())?))
    },
    load: loaded::<ForestSurrogate>,
};

impl ForestOptions {
    /// Extremely randomised trees: 50 on all points, thresholds at random, so that the
    /// forest is nearly continuous in speed.
    pub fn extra() -> Self {
        Self { thresholds: Thresholds::Random, bootstrap: false, ..Self::default() }
    }
}
