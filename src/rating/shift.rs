//! Shift: by how many samples a prediction must be moved to match its reference best.

use std::ops::Range;

/// A correlation must rise by more than this to count as larger: two shifts that correlate
/// equally well differ by rounding, and the standard takes the smaller of them.
const ROUNDING: f64 = 1e-12;

/// A shift of the prediction against the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shift {
    /// Samples by which the prediction is late; negative if it is early.
    pub late: isize,
    /// Correlation of what overlaps.
    pub correlation: f64,
}

impl Shift {
    /// What overlaps of two signals of `n` samples: ranges of the reference and of the
    /// prediction.
    fn ranges(late: isize, n: usize) -> (Range<usize>, Range<usize>) {
        let by = late.unsigned_abs();
        if late >= 0 { (0..n - by, by..n) } else { (by..n, 0..n - by) }
    }

    /// The parts of reference and prediction that overlap after the shift.
    pub(crate) fn overlap<'a>(
        &self,
        reference: &'a [f64],
        prediction: &'a [f64],
    ) -> [&'a [f64]; 2] {
        let (r, p) = Self::ranges(self.late, reference.len());
        [&reference[r], &prediction[p]]
    }
}

/// The shift of at most a fifth of the samples with the largest correlation; of equal ones the
/// smallest, and of these the one that moves the prediction to the left.
///
/// Equal lengths, at least two. `correlation` takes the two overlapping parts; where it is not
/// defined it is not the largest. `None` if it is not defined without a shift.
pub(crate) fn best(
    reference: &[f64],
    prediction: &[f64],
    correlation: fn(&[f64], &[f64]) -> Option<f64>,
) -> Option<Shift> {
    let mut best = Shift { late: 0, correlation: correlation(reference, prediction)? };
    let most = (reference.len() / 5) as isize;
    for late in (1..=most).flat_map(|by| [by, -by]) {
        let shift = Shift { late, ..best };
        let [r, p] = shift.overlap(reference, prediction);
        if let Some(correlation) = correlation(r, p)
            && correlation > best.correlation + ROUNDING
        {
            best = Shift { late, correlation };
        }
    }
    Some(best)
}

/// Correlation coefficient of Pearson; `None` if one is constant.
pub(crate) fn centred(a: &[f64], b: &[f64]) -> Option<f64> {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (mean_a, mean_b) = (mean(a), mean(b));
    // A mean is rounded, and what a constant then leaves would correlate by chance.
    let least = |mean: f64| (ROUNDING * mean).powi(2) * a.len() as f64;
    let pairs = a.iter().zip(b).map(|(x, y)| (x - mean_a, y - mean_b));
    normalised(pairs, [least(mean_a), least(mean_b)])
}

/// Correlation of the values as they are; `None` if one is zero throughout.
pub(crate) fn plain(a: &[f64], b: &[f64]) -> Option<f64> {
    normalised(a.iter().zip(b).map(|(x, y)| (*x, *y)), [0.0; 2])
}

/// `Σxy/√(Σx² Σy²)`; `None` unless the squares are above the least.
fn normalised(pairs: impl Iterator<Item = (f64, f64)>, least: [f64; 2]) -> Option<f64> {
    let (mut xy, mut xx, mut yy) = (0.0, 0.0, 0.0);
    for (x, y) in pairs {
        xy += x * y;
        xx += x * x;
        yy += y * y;
    }
    (xx > least[0] && yy > least[1]).then(|| (xy / (xx.sqrt() * yy.sqrt())).clamp(-1.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn correlations_by_hand() {
        assert_eq!(plain(&[3.0, 4.0], &[4.0, 3.0]), Some(24.0 / 25.0));
        assert!((centred(&[3.0, 4.0], &[4.0, 3.0]).unwrap() + 1.0).abs() < 1e-15);
        assert_eq!(plain(&[0.0, 0.0], &[4.0, 3.0]), None);
        assert_eq!(centred(&[2.0, 2.0], &[4.0, 3.0]), None);
        // 0.1 has no exact mean.
        let wave: Vec<f64> = (0..1000).map(|i| f64::from(i).sin()).collect();
        assert_eq!(centred(&[0.1; 1000], &wave), None);
    }

    #[test]
    fn finds_a_delay_and_an_advance() {
        let wave = |late: f64| -> Vec<f64> {
            (0..100).map(|i| (-((f64::from(i) - 50.0 - late) / 10.0).powi(2)).exp()).collect()
        };
        for late in [0, 7, -7, 20, -20] {
            let found = best(&wave(0.0), &wave(late as f64), centred).unwrap();
            assert_eq!(found.late, late);
        }
        assert_eq!(best(&wave(0.0), &wave(30.0), centred).unwrap().late, 20, "a fifth at most");
    }

    #[test]
    fn equal_correlations_take_the_smallest_shift() {
        let ramp: Vec<f64> = (0..100).map(|i| 0.1 * f64::from(i)).collect();
        assert_eq!(best(&ramp, &ramp, centred).unwrap().late, 0);
        let saw: Vec<f64> = (0..100).map(|i| f64::from(i % 10)).collect();
        let late: Vec<f64> = (0..100).map(|i| f64::from((i + 5) % 10)).collect();
        assert_eq!(best(&saw, &late, plain).unwrap().late, 5, "left before right");
    }
}
