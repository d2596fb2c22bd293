//! `nearest` (FDRM): the FE curve at the nearest speed, unchanged.

use std::sync::Arc;

use super::models::ModelEntry;
use super::{CaseCurve, QueryPoint, Surrogate};
use crate::dataset::nearest_case;

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

/// The measured curve that lies nearest answers; one that ended while loading only if all did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Nearest;

impl Nearest {
    fn answering<'a>(cases: &'a [CaseCurve], at: &QueryPoint<'_>) -> Option<&'a CaseCurve> {
        let is_whole = |case: &&CaseCurve| !case.truncated;
        let all_ended = !cases.iter().any(|case| is_whole(&case));
        let from: Vec<&CaseCurve> = cases.iter().filter(|c| all_ended || is_whole(c)).collect();
        let points = from.iter().map(|case| (case.speed_m_per_s, &case.features[..]));
        from.get(nearest_case(points, (at.speed_m_per_s, at.features))).copied()
    }
}

impl Surrogate for Nearest {
    fn force_n(&self, cases: &[CaseCurve], at: &QueryPoint<'_>, deflection_m: &[f64]) -> Vec<f64> {
        match Self::answering(cases, at) {
            Some(case) => deflection_m.iter().map(|&d| case.force_at(d)).collect(),
            None => vec![f64::NAN; deflection_m.len()],
        }
    }

    fn data_end_m(&self, cases: &[CaseCurve], at: &QueryPoint<'_>) -> Option<f64> {
        Self::answering(cases, at).map(CaseCurve::end_m)
    }
}
