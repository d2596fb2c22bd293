//! Leave-one-speed-out: predict every inner speed from the others.

use serde::{Deserialize, Serialize};

use super::max_crush::MaxCrushRule;
use super::model::{Model, ModelError, Options};
use super::predict::{Query, predict};
use crate::curve::rating::l1_ratio;
use crate::dataset::{GRID_M, TrainingSet};

/// Errors of a model at a speed it was not trained on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeftOut {
    pub case: String,
    pub speed_m_per_s: f64,
    /// Force along the FE case's crush.
    pub force_l1: f64,
    /// Energy of the predicted curve over FE's, less 1.
    pub energy_error: f64,
    /// Predicted maximal crush (monotone rule) over FE's, less 1.
    pub max_crush_error: f64,
}

/// Leaves each inner speed out in turn; empty with fewer than three cases.
///
/// # Errors
/// [`ModelError`] if the remaining cases make no model.
pub fn validate(set: &TrainingSet, options: Options) -> Result<Vec<LeftOut>, ModelError> {
    (1..set.cases.len().saturating_sub(1))
        .filter_map(|i| left_out(set, options, i).transpose())
        .collect()
}

fn left_out(set: &TrainingSet, options: Options, i: usize) -> Result<Option<LeftOut>, ModelError> {
    let case = &set.cases[i];
    let model = Model::fit_only(&without(set, i), options)?;
    let end = case.envelope.end_m();
    let steps = (end / GRID_M).ceil().clamp(2.0, 1e6) as usize;
    let grid: Vec<f64> = (0..=steps).map(|k| end * k as f64 / steps as f64).collect();
    let reference: Vec<f64> = grid.iter().map(|&d| case.envelope.force_at(d)).collect();
    let predicted = model.force_n(case.speed_m_per_s, &grid);
    let query =
        Query { speed_m_per_s: case.speed_m_per_s, mass_kg: None, rule: MaxCrushRule::Monotone };
    // Without a maximal crush (all runs truncated) there is nothing to report.
    let Ok(curve) = predict(&model, &query) else { return Ok(None) };
    let left_out = LeftOut {
        case: case.name.clone(),
        speed_m_per_s: case.speed_m_per_s,
        force_l1: l1_ratio(&reference, &predicted),
        energy_error: curve.energy_j / case.envelope.work() - 1.0,
        max_crush_error: curve.max_deflection_m / end - 1.0,
    };
    // A reference without force has no relative errors; JSON could not hold them either.
    let errors = [left_out.force_l1, left_out.energy_error, left_out.max_crush_error];
    Ok(errors.iter().all(|e| e.is_finite()).then_some(left_out))
}

/// The set without its `i`-th case.
pub fn without(set: &TrainingSet, i: usize) -> TrainingSet {
    let mut rest = set.clone();
    rest.cases.remove(i);
    rest
}
