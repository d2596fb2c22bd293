//! `linear`: the force at equal deflection interpolated linearly in speed.

use std::sync::Arc;

use super::curves::{interpolate_held, neighbours};
use super::models::ModelEntry;
use super::{CaseCurve, QueryPoint, Surrogate};

pub(super) const ENTRY: ModelEntry = ModelEntry {
    name: "linear",
    about: "Linear in speed at equal deflection",
    complexity: 0,
    sees_features: false,
    follows_closing: false,
    needs_crush_law: false,
    least_curves: 2,
    forest: None,
    fit: |_| Ok(Arc::new(Linear)),
    load: |_| Ok(Arc::new(Linear)),
};

/// Interpolates over the cases that reach a deflection; holds the outermost beyond them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Linear;

impl Surrogate for Linear {
    fn force_n(&self, cases: &[CaseCurve], at: &QueryPoint<'_>, deflection_m: &[f64]) -> Vec<f64> {
        let furthest = cases.iter().map(CaseCurve::end_m).fold(0.0, f64::max);
        let mut reaching: Vec<&CaseCurve> = Vec::with_capacity(cases.len());
        let mut speeds: Vec<f64> = Vec::with_capacity(cases.len());
        let mut at_deflection = |&d: &f64| {
            let d = d.min(furthest);
            reaching.clear();
            reaching.extend(cases.iter().filter(|c| c.reaches(d)));
            speeds.clear();
            speeds.extend(reaching.iter().map(|c| c.speed_m_per_s));
            if speeds.is_empty() {
                return f64::NAN;
            }
            let (low, high, _) = neighbours(&speeds, at.speed_m_per_s);
            let point = |i: usize| (speeds[i], reaching[i].force_at(d));
            interpolate_held(&[point(low), point(high)], at.speed_m_per_s).unwrap_or(f64::NAN)
        };
        deflection_m.iter().map(&mut at_deflection).collect()
    }
}
