//! `nearest` (FDRM): the FE curve at the nearest speed, unchanged.

use std::sync::Arc;

use super::entry::ModelEntry;
use super::{CaseCurve, QueryPoint, Surrogate};
use crate::dataset::least;

pub(super) const ENTRY: ModelEntry = ModelEntry {
    name: "nearest",
    about: "The FE curve of the nearest speed (FDRM)",
    complexity: 6,
    sees_features: true,
    follows_closing: false,
    needs_crush_law: false,
    least_curves: 1,
    forest: None,
    fit: |_| Ok(Arc::new(Nearest)),
    load: |_| Ok(Arc::new(Nearest)),
};

/// The measured curve that lies nearest answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Nearest;

impl Surrogate for Nearest {
    fn force_n(&self, cases: &[CaseCurve], at: &QueryPoint<'_>, deflection_m: &[f64]) -> Vec<f64> {
        match cases.get(nearest(cases, at)) {
            Some(case) => deflection_m.iter().map(|&d| case.force_at(d)).collect(),
            None => vec![f64::NAN; deflection_m.len()],
        }
    }
}

/// Index of the case nearest in speed and features, each relative to its range; of equally
/// near ones the first, which is the slowest.
fn nearest(cases: &[CaseCurve], at: &QueryPoint<'_>) -> usize {
    let value = |case: &CaseCurve, k: usize| match k {
        0 => case.speed_m_per_s,
        _ => case.features[k - 1],
    };
    let asked = |k: usize| if k == 0 { at.speed_m_per_s } else { at.features[k - 1] };
    let ranges: Vec<f64> = (0..=at.features.len())
        .map(|k| {
            let values = || cases.iter().map(|c| value(c, k));
            let range =
                values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min);
            if range > 0.0 { range } else { 1.0 }
        })
        .collect();
    let distance = |case: &CaseCurve| -> f64 {
        let share = |(k, range): (usize, &f64)| (value(case, k) - asked(k)) / range;
        // One feature: the plain distance, so that midpoints are where they are expected.
        if ranges.len() == 1 {
            return (case.speed_m_per_s - at.speed_m_per_s).abs();
        }
        ranges.iter().enumerate().map(|r| share(r).powi(2)).sum()
    };
    least(cases.iter().map(distance))
}
