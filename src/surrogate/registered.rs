//! `registered`: landmarks matched and warped onto each other before curves are blended.

use std::sync::Arc;

use super::curves::{interpolate_held, least_squares};
use super::entry::ModelEntry;
use super::landmarks::{Landmarks, Warp};
use super::linear::Linear;
use super::max_crush::MaxCrushRule;
use super::{CaseCurve, QueryPoint, Surrogate};

pub(super) const ENTRY: ModelEntry = ModelEntry {
    name: "registered",
    about: "Peaks matched and warped onto each other before curves are blended",
    complexity: 3,
    baseline: false,
    sees_features: false,
    follows_closing: false,
    needs_crush_law: false,
    least_curves: 2,
    crush_rule: MaxCrushRule::Motion,
    forest: None,
    fit: |_| Ok(Arc::new(Registered)),
    load: |_| Ok(Arc::new(Registered)),
};

/// Peaks sit at nearly fixed crush, and move a little with speed: where a query expects a
/// landmark, each case contributes the force of its own landmark. Only inside the training
/// speeds; outside, the outermost curve as `linear` holds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Registered;

impl Surrogate for Registered {
    fn force_n(&self, cases: &[CaseCurve], at: &QueryPoint<'_>, deflection_m: &[f64]) -> Vec<f64> {
        let v = at.speed_m_per_s;
        let (Some(first), Some(last)) = (cases.first(), cases.last()) else {
            return vec![f64::NAN; deflection_m.len()];
        };
        if !(first.speed_m_per_s..=last.speed_m_per_s).contains(&v) || cases.len() < 2 {
            return Linear.force_n(cases, at, deflection_m);
        }
        let landmarks = Landmarks::of(cases);
        let expected = landmarks.at(cases, v);
        let warps: Vec<Warp> =
            (0..cases.len()).map(|i| to_case(&landmarks, &expected, i)).collect();
        let mut before = 0.0;
        deflection_m
            .iter()
            .map(|&d| {
                let points: Vec<(f64, f64)> = cases
                    .iter()
                    .zip(&warps)
                    .map(|(case, warp)| (case, warp.at(d)))
                    .filter(|(case, d)| case.reaches(*d))
                    .map(|(case, d)| (case.speed_m_per_s, case.force_at(d)))
                    .collect();
                before = blend(&points, v).unwrap_or(before);
                before
            })
            .collect()
    }
}

/// The map from the query's deflections to those of case `i`.
fn to_case(landmarks: &Landmarks, expected: &[(usize, f64)], i: usize) -> Warp {
    Warp::new(expected.iter().filter_map(|&(k, d)| Some((d, landmarks.position(k, i)?))))
}

/// The least-squares parabola of four and more points that lie on both sides of `v`, else
/// the straight line between neighbours.
fn blend(points: &[(f64, f64)], v: f64) -> Option<f64> {
    let inside = points.first()?.0 <= v;
    if points.len() >= 4 && inside {
        return Some(least_squares(points, 2)?.at(v).max(0.0));
    }
    interpolate_held(points, v)
}
