//! Maximum crush as a function of impact speed: four rules, and their spread.
//!
//! Four rules: a cubic spline over the speeds, a monotone interpolation, the kinetic energy, and the motion: where the
//! body force stops the body. `energy` solves the same with the declared force, which as a contact force absorbs the
//! energy too early (W/E in `db ls`). A model uses the motion, unless another rule has answers at more of the speeds that
//! were left out; never the spline, which need not be monotone, but for `--paper`.

use serde::{Deserialize, Serialize};

use super::Model;
use crate::curve::Envelope;
use crate::dataset::{is_within, nearly_same};
use crate::error::{Error, error};

/// Rule for the maximum crush.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum MaxCrushRule {
    /// Cubic spline through the training cases (reference method).
    Spline,
    /// Monotone cubic through (0, 0) and the training cases.
    #[default]
    Monotone,
    /// Where the predicted curve has absorbed the kinetic energy.
    Energy,
    /// Where the body force has stopped the body; the same as `energy` if the predicted
    /// curve is that force. A contact curve takes up the energy too early, because mass in the
    /// crush zone is stopped before the body.
    Motion,
}

impl MaxCrushRule {
    /// Every rule, in the order of tables.
    pub const ALL: [Self; 4] = [Self::Spline, Self::Monotone, Self::Energy, Self::Motion];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Spline => "spline",
            Self::Monotone => "monotone",
            Self::Energy => "energy",
            Self::Motion => "motion",
        }
    }
}

/// The maximum crush by all rules, in m; `None` where a rule has no answer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct MaxCrush {
    /// By a cubic spline over the speeds.
    pub spline_m: Option<f64>,
    /// By a cubic that never decreases with the speed.
    pub monotone_m: Option<f64>,
    /// Where the curve has absorbed the impact's energy.
    pub energy_m: Option<f64>,
    /// Absent in files of earlier versions.
    #[serde(default)]
    pub motion_m: Option<f64>,
    /// Largest minus smallest.
    pub spread_m: f64,
}

impl MaxCrush {
    /// No rule has an answer.
    pub(super) const NONE: Self =
        Self { spline_m: None, monotone_m: None, energy_m: None, motion_m: None, spread_m: 0.0 };
}

/// Cubic spline through `points` (speed in m/s increasing, crush in m) at `v`.
///
/// Natural ends, continued straight beyond them; through two points a straight line,
/// through three a parabola. `None` for fewer than two points.
pub(crate) fn spline(points: &[(f64, f64)], v: f64) -> Option<f64> {
    match points {
        [] | [_] => None,
        [a, b] => Some(a.1 + (b.1 - a.1) / (b.0 - a.0) * (v - a.0)),
        [a, b, c] => {
            // Newton's divided differences.
            let ab = (b.1 - a.1) / (b.0 - a.0);
            let bc = (c.1 - b.1) / (c.0 - b.0);
            let abc = (bc - ab) / (c.0 - a.0);
            Some(a.1 + ab * (v - a.0) + abc * (v - a.0) * (v - b.0))
        }
        _ => Some(natural_spline(points, v)),
    }
}

fn natural_spline(points: &[(f64, f64)], v: f64) -> f64 {
    let n = points.len();
    let h = |i: usize| points[i + 1].0 - points[i].0;
    let slope = |i: usize| (points[i + 1].1 - points[i].1) / h(i);
    // Second derivatives m[1..n-1] by the Thomas algorithm; m[0] = m[n-1] = 0.
    let mut upper = vec![0.0; n];
    let mut m = vec![0.0; n];
    for i in 1..n - 1 {
        let pivot = 2.0 * (h(i - 1) + h(i)) - h(i - 1) * upper[i - 1];
        upper[i] = h(i) / pivot;
        m[i] = (6.0 * (slope(i) - slope(i - 1)) - h(i - 1) * m[i - 1]) / pivot;
    }
    for i in (1..n - 1).rev() {
        m[i] -= upper[i] * m[i + 1];
    }
    let first_slope = slope(0) - h(0) * m[1] / 6.0;
    let last_slope = slope(n - 2) + h(n - 2) * m[n - 2] / 6.0;
    if v <= points[0].0 {
        return points[0].1 + first_slope * (v - points[0].0);
    }
    if v >= points[n - 1].0 {
        return points[n - 1].1 + last_slope * (v - points[n - 1].0);
    }
    let i = points.partition_point(|p| p.0 <= v) - 1;
    let (a, b) = (points[i + 1].0 - v, v - points[i].0);
    (m[i] * a.powi(3) + m[i + 1] * b.powi(3)) / (6.0 * h(i))
        + (points[i].1 / h(i) - m[i] * h(i) / 6.0) * a
        + (points[i + 1].1 / h(i) - m[i + 1] * h(i) / 6.0) * b
}

/// Monotone cubic (Fritsch and Carlson, SIAM J. Numer. Anal. 17, 1980) through (0, 0) and
/// `points` at `v`; continued straight above the last point. `None` without points.
pub(crate) fn monotone(points: &[(f64, f64)], v: f64) -> Option<f64> {
    if points.is_empty() {
        return None;
    }
    let mut p = vec![(0.0, 0.0)];
    p.extend_from_slice(points);
    let n = p.len();
    let h = |i: usize| p[i + 1].0 - p[i].0;
    let slope = |i: usize| (p[i + 1].1 - p[i].1) / h(i);
    let mut tangent = vec![0.0; n];
    tangent[0] = slope(0);
    tangent[n - 1] = slope(n - 2);
    for (i, tangent) in tangent.iter_mut().enumerate().skip(1).take(n - 2) {
        let (a, b) = (slope(i - 1), slope(i));
        *tangent = if a * b <= 0.0 { 0.0 } else { 0.5 * (a + b) };
    }
    for i in 0..n - 1 {
        let s = slope(i);
        if s == 0.0 {
            (tangent[i], tangent[i + 1]) = (0.0, 0.0);
            continue;
        }
        let (a, b) = (tangent[i] / s, tangent[i + 1] / s);
        let length = libm::hypot(a, b);
        if length > 3.0 {
            tangent[i] = 3.0 * a / length * s;
            tangent[i + 1] = 3.0 * b / length * s;
        }
    }
    if v >= p[n - 1].0 {
        return Some(p[n - 1].1 + tangent[n - 1] * (v - p[n - 1].0));
    }
    let i = p.partition_point(|q| q.0 <= v).max(1) - 1;
    let t = (v - p[i].0) / h(i);
    let (t2, t3) = (t * t, t * t * t);
    Some(
        (2.0 * t3 - 3.0 * t2 + 1.0) * p[i].1
            + (t3 - 2.0 * t2 + t) * h(i) * tangent[i]
            + (3.0 * t2 - 2.0 * t3) * p[i + 1].1
            + (t3 - t2) * h(i) * tangent[i + 1],
    )
}

/// The deflection at which `curve` has absorbed `kinetic_j`; beyond its end the force
/// holds its last value.
pub(crate) fn energy(curve: &Envelope, kinetic_j: f64) -> Option<f64> {
    curve.deflection_for_work(kinetic_j)
}

/// The maximum crush by every rule; `v` is the speed at which the training mass has this energy.
pub(super) fn by_all_rules(
    model: &Model,
    v: f64,
    declared: &Envelope,
    body: &Envelope,
    kinetic_j: f64,
) -> MaxCrush {
    // Crush over speed is a function only if nothing else differs.
    let points: Vec<(f64, f64)> = if model.features.is_empty() {
        let whole = model.cases.iter().filter(|c| !c.truncated);
        one_for_repeats(whole.map(|c| (c.speed_m_per_s, c.max_deflection_m)).collect())
    } else {
        Vec::new()
    };
    let spline_m = spline(&points, v);
    let monotone_m = monotone(&points, v);
    let energy_m = energy(declared, kinetic_j);
    let motion_m = energy(body, kinetic_j);
    let all = || [spline_m, monotone_m, energy_m, motion_m].into_iter().flatten();
    let spread_m = all().fold(f64::NEG_INFINITY, f64::max) - all().fold(f64::INFINITY, f64::min);
    MaxCrush { spline_m, monotone_m, energy_m, motion_m, spread_m: spread_m.max(0.0) }
}

/// The mean of points whose speeds nearly repeat each other, by rising speed: their scatter over a short interval would be a slope.
fn one_for_repeats(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let speeds: Vec<f64> = points.iter().map(|p| p.0).collect();
    let repeat = |a: &(f64, f64), b: &(f64, f64)| is_within(b.0, nearly_same(&speeds, a.0));
    let mean = |of: &[(f64, f64)]| {
        let over =
            |value: fn(&(f64, f64)) -> f64| of.iter().map(value).sum::<f64>() / of.len() as f64;
        (over(|p| p.0), over(|p| p.1))
    };
    points.chunk_by(repeat).map(mean).collect()
}

impl MaxCrush {
    /// The answer of one rule.
    pub(crate) fn by(&self, rule: MaxCrushRule) -> Option<f64> {
        match rule {
            MaxCrushRule::Spline => self.spline_m,
            MaxCrushRule::Monotone => self.monotone_m,
            MaxCrushRule::Energy => self.energy_m,
            MaxCrushRule::Motion => self.motion_m,
        }
    }
}

/// The answer of one rule, which must be a length.
pub(super) fn chosen(crush: &MaxCrush, rule: MaxCrushRule) -> Result<f64, Error> {
    match crush.by(rule) {
        Some(end) if end > 0.0 && end.is_finite() => Ok(end),
        found => Err(
            error!(Prediction at "max_crush", "the maximum crush by the {rule} rule is {found}: expected a length above 0; {other}", found = found.map_or("not defined for these cases".into(), |d| format!("{d:.3} m")), other = MaxCrushRule::ALL
                .into_iter()
                .find(|&r| crush.by(r).is_some_and(|d| d > 0.0 && d.is_finite()))
                .map_or("no rule has one".into(), |r| format!("the {} rule has one (--max-crush of crumple predict and export)", r.name())), rule = rule.name()),
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const POINTS: [(f64, f64); 5] =
        [(6.94, 0.31), (10.0, 0.57), (13.3, 0.87), (16.7, 1.24), (20.0, 1.63)];

    #[test]
    fn rules_pass_through_their_points() {
        for (v, d) in POINTS {
            assert!((spline(&POINTS, v).unwrap() - d).abs() < 1e-12);
            assert!((monotone(&POINTS, v).unwrap() - d).abs() < 1e-12);
        }
        assert!(monotone(&POINTS, 0.0).unwrap().abs() < 1e-15);
    }

    #[test]
    fn few_points_give_line_and_parabola() {
        assert_eq!(spline(&[(1.0, 1.0), (2.0, 3.0)], 3.0), Some(5.0));
        let square = [(1.0, 1.0), (2.0, 4.0), (4.0, 16.0)];
        assert!((spline(&square, 3.0).unwrap() - 9.0).abs() < 1e-12);
        assert_eq!(spline(&[(1.0, 1.0)], 3.0), None);
        assert_eq!(monotone(&[(2.0, 1.0)], 1.0), Some(0.5));
    }

    #[test]
    fn natural_spline_is_smooth_and_exact_for_lines() {
        let line: Vec<(f64, f64)> = (1..=5).map(|i| (f64::from(i), 2.0 * f64::from(i))).collect();
        for v in [0.5, 1.3, 2.9, 4.4, 7.0] {
            assert!((spline(&line, v).unwrap() - 2.0 * v).abs() < 1e-12);
        }
        // Continuous first derivative over an inner knot and over an end.
        for knot in [10.0, 20.0] {
            let f = |v| spline(&POINTS, v).unwrap();
            let (left, right) =
                ((f(knot) - f(knot - 1e-6)) * 1e6, (f(knot + 1e-6) - f(knot)) * 1e6);
            assert!((left - right).abs() < 1e-4, "{left} and {right} at {knot}");
        }
    }

    #[test]
    fn monotone_stays_monotone_where_the_spline_does_not() {
        let steep = [(1.0, 0.01), (2.0, 0.02), (3.0, 1.0), (4.0, 1.01), (5.0, 1.02)];
        let speeds: Vec<f64> = (100..=500).map(|i| f64::from(i) / 100.0).collect();
        let falls = |crush: Vec<f64>| crush.windows(2).any(|w| w[1] < w[0]);
        assert!(!falls(speeds.iter().map(|&v| monotone(&steep, v).unwrap()).collect()));
        assert!(falls(speeds.iter().map(|&v| spline(&steep, v).unwrap()).collect()));
    }

    #[test]
    fn energy_rule_of_a_constant_force() {
        let curve = Envelope::new(vec![0.0, 0.5], vec![2e6, 2e6]).unwrap();
        let kinetic = 0.5 * 24e3 * (40.0_f64 / 3.0).powi(2);
        assert!((energy(&curve, kinetic).unwrap() - 1.0666666667).abs() < 1e-9);
    }
}
