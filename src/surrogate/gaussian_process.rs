//! `gaussian-process`: a Gaussian process on speed and deflection, the textbook method that the other models must beat.
//!
//! Anisotropic Matérn 3/2 covariance with noise (Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, ch. 2,
//! 4.2 and 5.4): both length scales and the noise have the largest marginal likelihood, the variance of the signal follows from them.
//! 45 points of a curve, and 20 for the scales, keep the cost of leaving speeds out near that of the other models.

use std::sync::Arc;

use multiversion::multiversion;
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use super::models::{ModelEntry, loaded};
use super::{CaseCurve, QueryPoint, Surrogate};
use crate::error::{Error, error};

pub(super) const ENTRY: ModelEntry = ModelEntry {
    name: "gaussian-process",
    about: "Gaussian process on speed and deflection (Matérn 3/2)",
    complexity: 3,
    sees_features: false,
    follows_closing: false,
    needs_crush_law: false,
    least_curves: 2,
    forest: None,
    fit: |input| Ok(Arc::new(GaussianProcess::fit(input.curves)?)),
    load: loaded::<GaussianProcess>,
};

/// Points of each curve that answers are made from.
const POINTS: usize = 45;
/// Points of each curve that the scales are made from.
const POINTS_FOR_SCALES: usize = 20;
/// Most curves it is fitted to, evenly chosen from the speeds: the cost grows with the third power.
const MOST_CURVES: usize = 12;
/// Natural logarithms of the scales of speed and deflection, as shares of the ranges, and of the noise's variance over
/// the signal's: lowest, first and highest.
const SCALES: [[f64; 3]; 3] = [[-3.0, 1.0, 2.0], [-5.0, -3.0, 1.0], [-12.0, -5.0, 0.0]];
/// First and last step of the search for the scales.
const STEPS: [f64; 2] = [1.0, 0.5];
/// Added to the diagonal, as a share of the signal's variance, so that rounding leaves the matrix positive definite.
const JITTER: f64 = 1e-8;

/// A process fitted to points of curves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct GaussianProcess {
    speed_scale_m_per_s: f64,
    deflection_scale_m: f64,
    /// Variance of the noise over that of the signal.
    noise: f64,
    mean_n: f64,
    /// Speed in m/s and end in m of each curve, whose points are even from 0 on.
    curves: Vec<[f64; 2]>,
    /// Of each point, in N: the force is the mean and the sum of these times the correlations.
    weights_n: Vec<f64>,
}

impl GaussianProcess {
    fn fit(curves: &[CaseCurve]) -> Result<Self, Error> {
        let step = curves.len().div_ceil(MOST_CURVES).max(1);
        let chosen: Vec<&CaseCurve> = match step {
            1 => curves.iter().collect(),
            _ => (0..MOST_CURVES)
                .map(|k| &curves[k * (curves.len() - 1) / (MOST_CURVES - 1)])
                .collect(),
        };
        let ends: Vec<[f64; 2]> = chosen.iter().map(|c| [c.speed_m_per_s, c.end_m()]).collect();
        let longest_m = ends.iter().map(|c| c[1]).fold(0.0, f64::max);
        let span = ends[ends.len() - 1][0] - ends[0][0];
        // All at one speed: no scale of speed is needed.
        let span = if span > 0.0 { span } else { 1.0 };
        let of = |points: usize| {
            let at = points_of(&ends, points, [span, longest_m]);
            let force = chosen.iter().flat_map(|c| {
                (0..points).map(|k| c.force_at(c.end_m() * k as f64 / (points - 1) as f64))
            });
            (at, force.collect::<Vec<f64>>())
        };
        let (at, force_n) = of(POINTS_FOR_SCALES);
        let mean_n = force_n.iter().sum::<f64>() / force_n.len() as f64;
        let centred: Vec<f64> = force_n.iter().map(|f| f - mean_n).collect();
        let [speed, deflection, noise] = scales(&at, &centred).map(libm::exp);
        let (at, force_n) = of(POINTS);
        let centred: Vec<f64> = force_n.iter().map(|f| f - mean_n).collect();
        let (_, weights_n) =
            solved(&at, &centred, [speed, deflection, noise]).ok_or_else(|| {
                error!(
                    Model,
                    "model gaussian-process: its covariances have no inverse: use another --model"
                )
            })?;
        Ok(Self {
            speed_scale_m_per_s: speed * span,
            deflection_scale_m: deflection * longest_m,
            noise,
            mean_n,
            curves: ends,
            weights_n,
        })
    }
}

impl Surrogate for GaussianProcess {
    fn parameters(&self) -> Option<Result<Box<RawValue>, serde_json::Error>> {
        Some(serde_json::value::to_raw_value(self))
    }

    fn check(&self, _: usize) -> Result<(), String> {
        let sound = |x: &f64| x.is_finite() && *x > 0.0;
        let scales = [self.speed_scale_m_per_s, self.deflection_scale_m];
        if !scales.iter().chain(self.curves.iter().flatten()).all(sound) {
            return Err("a scale, speed or end of its Gaussian process is not above 0".into());
        }
        let (found, expected) = (self.weights_n.len(), POINTS * self.curves.len());
        if found != expected || expected == 0 {
            return Err(format!("its Gaussian process has {found} weights instead of {expected}"));
        }
        Ok(())
    }

    fn answers_from_curves(&self) -> bool {
        false
    }

    /// Held beyond the longest curve, where a process only returns to its mean.
    fn force_n(&self, _: &[CaseCurve], at: &QueryPoint<'_>, deflection_m: &[f64]) -> Vec<f64> {
        let furthest_m = self.curves.iter().map(|c| c[1]).fold(0.0, f64::max);
        let scales = [self.speed_scale_m_per_s, self.deflection_scale_m];
        let points = points_of(&self.curves, POINTS, scales);
        let force_at = |d: f64| {
            let at = [at.speed_m_per_s / scales[0], d / scales[1]];
            (self.mean_n + weighted_sum(&points, &self.weights_n, at)).max(0.0)
        };
        let held_n = force_at(furthest_m);
        let force_at = |&d: &f64| if d < furthest_m { force_at(d) } else { held_n };
        deflection_m.iter().map(force_at).collect()
    }
}

/// Speed and deflection of even points of curves of these speeds and ends, over two scales.
fn points_of(curves: &[[f64; 2]], points: usize, scales: [f64; 2]) -> Vec<[f64; 2]> {
    let along = |&[speed, end]: &[f64; 2]| {
        (0..points)
            .map(move |k| [speed / scales[0], end * k as f64 / (points - 1) as f64 / scales[1]])
    };
    curves.iter().flat_map(along).collect()
}

/// Correlations that are computed at once.
const LANES: usize = 8;
/// Rows of a matrix that are decomposed at once.
const ROWS: usize = 4;

/// The sum of weights times the correlations of their points with another.
#[multiversion(targets("x86_64+avx+avx2"))]
fn weighted_sum(points: &[[f64; 2]], weights: &[f64], at: [f64; 2]) -> f64 {
    let mut sums = [0.0; LANES];
    for first in (0..points.len()).step_by(LANES) {
        let last = points.len().min(first + LANES);
        let (mut distances, mut factors) = ([0.0; LANES], [0.0; LANES]);
        for k in first..last {
            distances[k - first] = distance(points[k], at);
            factors[k - first] = weights[k];
        }
        let correlations = correlations(distances);
        for k in 0..LANES {
            sums[k] += factors[k] * correlations[k];
        }
    }
    sums.into_iter().sum()
}

/// A distance in length scales, times √3.
#[inline(always)]
fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (3.0 * ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2))).sqrt()
}

/// Matérn 3/2 of distances, `(1 + x) e^-x` within 5e-16, several at once, as libm cannot: most of a fit is this. `e^-x` is `2^-k e^r` with
/// |r| ≤ ln 2/2, of which the Taylor series to r¹³/13! is exact to the last digit.
#[inline(always)]
fn correlations<const N: usize>(distances: [f64; N]) -> [f64; N] {
    // 1/n!
    const SERIES: [f64; 14] = {
        let (mut series, mut n) = ([1.0; 14], 1);
        while n < 14 {
            series[n] = series[n - 1] / n as f64;
            n += 1;
        }
        series
    };
    // Adding it rounds to a whole number, which then stands in the last bits.
    const ROUNDING: f64 = 6_755_399_441_055_744.0;
    // ln 2 in two parts, the first with zeros at its end, so that its multiples are exact (as in fdlibm's e_exp.c).
    const LN_2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];
    let (mut rounded, mut r, mut sum) = ([0.0; N], [0.0; N], [SERIES[13]; N]);
    for k in 0..N {
        let x = -distances[k].min(700.0);
        rounded[k] = x * std::f64::consts::LOG2_E + ROUNDING;
        let whole = rounded[k] - ROUNDING;
        r[k] = x - whole * LN_2[0] - whole * LN_2[1];
    }
    for n in (0..13).rev() {
        for k in 0..N {
            sum[k] = sum[k] * r[k] + SERIES[n];
        }
    }
    for k in 0..N {
        sum[k] *= f64::from_bits((rounded[k].to_bits().wrapping_add(1023)) << 52);
        sum[k] *= 1.0 + distances[k];
    }
    sum
}

/// Logarithms of the scales with the largest marginal likelihood of all that are a step apart; the steps shrink.
fn scales(at: &[[f64; 2]], centred_n: &[f64]) -> [f64; 3] {
    // A step back is where it came from.
    let mut known: Vec<([f64; 3], f64)> = Vec::new();
    let mut cost = |scales: [f64; 3]| {
        if let Some((_, cost)) = known.iter().find(|(before, _)| *before == scales) {
            return *cost;
        }
        let solved = solved(at, centred_n, scales.map(libm::exp));
        let cost = solved.map_or(f64::INFINITY, |(cost, _)| cost);
        known.push((scales, cost));
        cost
    };
    let mut best = SCALES.map(|[_, first, _]| first);
    let mut least = cost(best);
    let mut step = STEPS[0];
    while step >= STEPS[1] {
        let before = least;
        for k in 0..3 {
            for direction in [step, -step] {
                let mut next = best;
                next[k] = (best[k] + direction).clamp(SCALES[k][0], SCALES[k][2]);
                let found = cost(next);
                if found < least {
                    (best, least) = (next, found);
                    break;
                }
            }
        }
        if least == before {
            step /= 2.0;
        }
    }
    best
}

/// The negative logarithm of the marginal likelihood, but for constants, and the weights of the points; `None` if the
/// covariances have no inverse. Vectors as wide as the machine has them; the bits are the same for any width.
#[multiversion(targets("x86_64+avx+avx2"))]
fn solved(
    at: &[[f64; 2]],
    centred_n: &[f64],
    [speed, deflection, noise]: [f64; 3],
) -> Option<(f64, Vec<f64>)> {
    let n = at.len();
    let scaled: Vec<[f64; 2]> = at.iter().map(|p| [p[0] / speed, p[1] / deflection]).collect();
    // The lower triangle by rows, decomposed in place (Cholesky); several rows at once, since the products of one wait for
    // one another.
    let mut rows: Vec<Vec<f64>> = Vec::with_capacity(n);
    let mut log_root = 0.0;
    for first_row in (0..n).step_by(ROWS) {
        let mut block: Vec<Vec<f64>> = Vec::with_capacity(ROWS);
        for i in first_row..n.min(first_row + ROWS) {
            let mut row = Vec::with_capacity(i + LANES);
            for first in (0..i).step_by(LANES) {
                let mut distances = [0.0; LANES];
                for k in first..i.min(first + LANES) {
                    distances[k - first] = distance(scaled[k], scaled[i]);
                }
                row.extend(correlations(distances));
            }
            row.truncate(i);
            block.push(row);
        }
        for (k, above) in rows.iter().enumerate() {
            for row in &mut block {
                row[k] = (row[k] - dot(&row[..k], &above[..k])) / above[k];
            }
        }
        for mut row in block {
            for k in first_row..row.len() {
                row[k] = (row[k] - dot(&row[..k], &rows[k][..k])) / rows[k][k];
            }
            let square = 1.0 + noise + JITTER - dot(&row, &row);
            if square.is_nan() || square <= 0.0 {
                return None;
            }
            row.push(square.sqrt());
            log_root += libm::log(square.sqrt());
            rows.push(row);
        }
    }
    let mut half: Vec<f64> = Vec::with_capacity(n);
    for (i, row) in rows.iter().enumerate() {
        half.push((centred_n[i] - dot(&row[..i], &half)) / row[i]);
    }
    let squares = dot(&half, &half);
    let mut weights = half;
    for i in (0..n).rev() {
        weights[i] /= rows[i][i];
        let last = weights[i];
        for (weight, factor) in weights[..i].iter_mut().zip(&rows[i]) {
            *weight -= factor * last;
        }
    }
    Some((log_root + 0.5 * n as f64 * libm::log(squares.max(f64::MIN_POSITIVE)), weights))
}

/// The sum of products, in sixteen parts at once.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    const PARTS: usize = 16;
    let mut sums = [0.0; PARTS];
    let ((a, rest_of_a), (b, rest_of_b)) = (a.as_chunks::<PARTS>(), b.as_chunks::<PARTS>());
    // Indices, since iterators are not compiled for the wider vectors of the caller.
    for i in 0..a.len().min(b.len()) {
        for k in 0..PARTS {
            sums[k] += a[i][k] * b[i][k];
        }
    }
    let mut rest = 0.0;
    for i in 0..rest_of_a.len().min(rest_of_b.len()) {
        rest += rest_of_a[i] * rest_of_b[i];
    }
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn correlation(a: [f64; 2], b: [f64; 2]) -> f64 {
        correlations([distance(a, b)])[0]
    }

    #[test]
    fn exponentials_are_exact() {
        for k in 0..200_000 {
            let x = f64::from(k) * 3.3e-3;
            let exact = (1.0 + x) * libm::exp(-x);
            assert!((correlations([x, 0.0])[0] / exact - 1.0).abs() < 5e-16, "{x}");
        }
        let [one, nothing] = correlations([0.0, 1e9]);
        assert!(one == 1.0 && nothing < 1e-290, "{one} {nothing}");
    }

    /// A product of the covariance with the weights gives the data back; the cost is that of the determinant of a 2 × 2 matrix.
    #[test]
    fn weights_and_likelihood_are_those_of_the_equations() {
        let at = [[0.0, 0.0], [0.5, 1.0], [1.0, 0.2]];
        let data = [2.0, -1.0, 0.5];
        let noise = 0.1;
        let (_, weights) = solved(&at, &data, [1.0, 0.5, noise]).unwrap();
        let scaled = at.map(|p| [p[0], p[1] / 0.5]);
        for (i, expected) in data.iter().enumerate() {
            let product: f64 = (0..3)
                .map(|k| {
                    let own = if i == k { noise + JITTER } else { 0.0 };
                    (correlation(scaled[i], scaled[k]) + own) * weights[k]
                })
                .sum();
            assert!((product - expected).abs() < 1e-12, "{product} {expected}");
        }
        let (cost, _) = solved(&at[..2], &data[..2], [1.0, 0.5, noise]).unwrap();
        let (own, other) = (1.0 + noise + JITTER, correlation(scaled[0], scaled[1]));
        let determinant = own * own - other * other;
        let squares = (own * (4.0 + 1.0) + 2.0 * other * 2.0) / determinant;
        assert!((cost - (0.5 * determinant.ln() + squares.ln())).abs() < 1e-12, "{cost}");
    }

    /// At its own points the process follows a smooth force, and between two speeds it lies between them.
    #[test]
    fn a_smooth_force_is_followed() {
        let curve = |v: f64| {
            let d: Vec<f64> = (0..=200).map(|i| f64::from(i) / 200.0).collect();
            let f = d.iter().map(|d| 1e6 * (1.0 + 0.05 * v) * (3.0 * d).sin().abs()).collect();
            CaseCurve::new(v, Vec::new(), d, f, Vec::new()).unwrap()
        };
        let curves = [curve(8.0), curve(10.0), curve(12.0)];
        let process = GaussianProcess::fit(&curves).unwrap();
        assert_eq!(process.check(0), Ok(()));
        for v in [8.0, 9.0, 11.0] {
            let at =
                QueryPoint { speed_m_per_s: v, features: &[], mass_kg: 1.0, closing_m_per_s: None };
            let (along, truth) = ([0.1, 0.33, 0.5, 0.9], curve(v));
            for (found, d) in process.force_n(&curves, &at, &along).iter().zip(along) {
                assert!(
                    (found / truth.force_at(d) - 1.0).abs() < 0.02,
                    "{found} at {d} m, {v} m/s"
                );
            }
        }
        let broken = GaussianProcess { weights_n: vec![1.0; 7], ..process };
        assert!(broken.check(0).unwrap_err().contains("7 weights instead of 135"));
    }
}
