//! Bands: how far FE curves lay from the model at speeds it had not seen.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The level that bands are made for.
pub const LEVEL: f64 = 0.9;
/// Half width, as a share of the curve's end, over which the force's level is averaged.
const WINDOW: f64 = 0.05;

/// An empirical range around a predicted force, from the residuals of left-out speeds.
///
/// Residuals are taken in ratio to the local level of the force. With a handful of curves no
/// level can be guaranteed; the range is the one that a further residual of the same kind
/// would keep to: their root mean square times Student's t for as many curves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Band {
    /// Level that the range is stated for.
    pub level: f64,
    /// Left-out curves it rests on.
    pub curves: usize,
    /// Half width at any one deflection, as a share of the local level of the force.
    pub pointwise_share: f64,
    /// Half width that the whole curve keeps to.
    pub simultaneous_share: f64,
    /// Share of the left-out points inside the band that the other curves give; `None` with
    /// fewer than two curves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coverage: Option<f64>,
}

/// Residuals of one left-out curve in ratio to the local level of the prediction.
pub type Residuals = Vec<f64>;

/// The residuals `(FE − prediction) / level` at even deflections.
pub fn residuals(reference_n: &[f64], predicted_n: &[f64]) -> Residuals {
    let residual = |((r, p), level): ((&f64, &f64), f64)| (r - p) / level;
    reference_n.iter().zip(predicted_n).zip(level(predicted_n)).map(residual).collect()
}

/// Local level of a force at even deflections: its mean over ±5 % of the curve.
fn level(force_n: &[f64]) -> Vec<f64> {
    let n = force_n.len();
    let half = ((WINDOW * n as f64).round() as usize).max(1);
    let mean = force_n.iter().sum::<f64>() / n.max(1) as f64;
    let at = |i: usize| {
        let around = &force_n[i.saturating_sub(half)..(i + half + 1).min(n)];
        // A stretch without force is as uncertain as its neighbourhood, not certain.
        (around.iter().sum::<f64>() / around.len() as f64).max(0.1 * mean).max(f64::MIN_POSITIVE)
    };
    (0..n).map(at).collect()
}

impl Band {
    /// The band that left-out curves give; `None` without any.
    pub fn of(curves: &[Residuals]) -> Option<Self> {
        let mut band = Self::without_coverage(&curves.iter().collect::<Vec<_>>())?;
        let covered: Vec<f64> = (0..curves.len()).filter_map(|i| coverage(curves, i)).collect();
        if !covered.is_empty() {
            band.coverage = Some(covered.iter().sum::<f64>() / covered.len() as f64);
        }
        Some(band)
    }

    fn without_coverage(curves: &[&Residuals]) -> Option<Self> {
        let t = student_t(curves.len())?;
        let mean = |of: &dyn Fn(&Residuals) -> f64| {
            curves.iter().map(|r| of(r)).sum::<f64>() / curves.len() as f64
        };
        let squares = |r: &Residuals| r.iter().map(|x| x * x).sum::<f64>() / r.len().max(1) as f64;
        let largest = |r: &Residuals| r.iter().fold(0.0_f64, |m, x| m.max(x.abs())).powi(2);
        Some(Self {
            level: LEVEL,
            curves: curves.len(),
            pointwise_share: t * mean(&squares).sqrt(),
            simultaneous_share: t * mean(&largest).sqrt(),
            coverage: None,
        })
    }

    /// Lowest and highest force at each of a curve's even deflections, in N; never below 0.
    pub fn around(&self, force_n: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let widths = level(force_n).into_iter().map(|l| self.pointwise_share * l);
        force_n.iter().zip(widths).map(|(f, w)| ((f - w).max(0.0), f + w)).unzip()
    }
}

/// Share of curve `i`'s points inside the band that the other curves give.
pub fn coverage(curves: &[Residuals], i: usize) -> Option<f64> {
    let others: Vec<&Residuals> =
        curves.iter().enumerate().filter(|(k, _)| *k != i).map(|(_, r)| r).collect();
    let band = Band::without_coverage(&others)?;
    let inside = curves[i].iter().filter(|r| r.abs() <= band.pointwise_share).count();
    Some(inside as f64 / curves[i].len().max(1) as f64)
}

/// Two-sided 90 % quantile of Student's t with `n` degrees of freedom.
///
/// Tabulated to 8, then by the expansion of Cornish and Fisher (Abramowitz and Stegun
/// 26.7.5), good to 4 digits.
fn student_t(n: usize) -> Option<f64> {
    const T: [f64; 8] = [6.3138, 2.9200, 2.3534, 2.1318, 2.0150, 1.9432, 1.8946, 1.8595];
    let z: f64 = 1.644_854;
    match n {
        0 => None,
        1..=8 => Some(T[n - 1]),
        _ => {
            let n = n as f64;
            let first = (z.powi(3) + z) / 4.0;
            let second = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0;
            let third = (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / 384.0;
            Some(z + first / n + second / (n * n) + third / (n * n * n))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_curves_give_wide_bands() {
        let curve = vec![0.1, -0.1, 0.1, -0.1];
        let band = |n: usize| Band::of(&vec![curve.clone(); n]).unwrap();
        assert!((band(1).pointwise_share - 0.63138).abs() < 1e-12);
        assert!((band(3).pointwise_share - 0.23534).abs() < 1e-12);
        assert_eq!(band(1).coverage, None);
        assert_eq!(band(2).coverage, Some(1.0));
        assert!(Band::of(&[]).is_none());
    }

    #[test]
    fn coverage_counts_points_outside() {
        let curves = vec![vec![0.01, 0.01], vec![0.01, 0.5]];
        assert_eq!(coverage(&curves, 1), Some(0.5));
        assert_eq!(coverage(&curves, 0), Some(1.0));
    }

    #[test]
    fn tabulated_and_expanded_quantiles_meet() {
        assert!((student_t(9).unwrap() - 1.8331).abs() < 2e-4);
        assert!((student_t(30).unwrap() - 1.6973).abs() < 1e-4);
    }

    #[test]
    fn bands_follow_the_level_of_the_force() {
        let band = Band::of(&[vec![0.1; 4], vec![0.1; 4]]).unwrap();
        let force: Vec<f64> = (0..200).map(|i| if i < 100 { 1e6 } else { 2e6 }).collect();
        let (low, high) = band.around(&force);
        let width = |i: usize| high[i] - low[i];
        assert!((width(150) / width(50) - 2.0).abs() < 1e-12);
    }
}
