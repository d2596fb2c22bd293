//! ISO/TS 18571:2014: objective rating metric of two signals that are not ambiguous, with its
//! corridor and dynamic time warping.

use serde::Serialize;

use super::signal::{best, centred};
use crate::signal::derivative;

/// Largest phase error that has a score, as a share of the samples; nothing is shifted further.
const PHASE_ERROR: f64 = 0.2;
const MAGNITUDE_ERROR: f64 = 0.5;
/// Slope error at which the score is zero.
const SLOPE_ERROR: f64 = 2.0;
/// The window of the warping is this part of the samples.
const WINDOW: usize = 10;
/// Slopes are means over this many samples.
const SMOOTHED: usize = 9;

/// Minimum number of samples: what a shift leaves must hold a mean of nine.
pub(crate) const LEAST_SAMPLES: usize = 12;
/// Most samples: the warping takes a fifth of their square in bytes, here 80 MB, and the
/// search for the shift as many steps.
pub(crate) const MOST_SAMPLES: usize = 20_000;

/// Scores of ISO/TS 18571, each from 0 to 1, and the rating they give.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Iso18571 {
    /// Corridor score Z.
    pub corridor: f64,
    /// Phase score E_P.
    pub phase: f64,
    /// Magnitude score E_M.
    pub magnitude: f64,
    /// Slope score E_S.
    pub slope: f64,
    /// `R = 0.4 Z + 0.2 (E_P + E_M + E_S)`.
    pub rating: f64,
    /// The standard's word for this rating.
    pub grade: Grade,
    /// By how much the prediction is late, in s; negative if it is early. At most a fifth of
    /// the interval; 0 if one of the signals is constant.
    pub late_s: f64,
}

/// Grades of ISO/TS 18571, table 3.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub(crate) enum Grade {
    /// R above 0.94.
    Excellent,
    /// Above 0.80.
    Good,
    /// Above 0.58.
    Fair,
    /// All below.
    Poor,
}

impl Grade {
    /// Grade of a rating R.
    pub(crate) fn of(rating: f64) -> Self {
        match rating {
            r if r > 0.94 => Self::Excellent,
            r if r > 0.80 => Self::Good,
            r if r > 0.58 => Self::Fair,
            _ => Self::Poor,
        }
    }

    /// The word in files and tables.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Excellent => "excellent",
            Self::Good => "good",
            Self::Fair => "fair",
            Self::Poor => "poor",
        }
    }
}

/// Rates a prediction by ISO/TS 18571:2014.
///
/// Equal lengths of [`LEAST_SAMPLES`] to [`MOST_SAMPLES`]; samples at `interval_s`, which the
/// standard wants to be 0.1 ms (10 kHz). `None` outside of these lengths.
///
/// A relative error over zeros counts as none if the prediction is zero there as well, else as
/// the worst. Correlations that differ by less than 1e-12 count as equal, and the smaller shift
/// is taken, as in the standard for equal ones.
pub(crate) fn iso18571(reference: &[f64], prediction: &[f64], interval_s: f64) -> Option<Iso18571> {
    let n = reference.len();
    if !(LEAST_SAMPLES..=MOST_SAMPLES).contains(&n) || prediction.len() != n {
        return None;
    }
    let shift = best(reference, prediction, centred);
    let late = shift.map_or(0, |s| s.late);
    let [r, p] = shift.map_or([reference, prediction], |s| s.overlap(reference, prediction));
    let corridor = corridor(reference, prediction);
    let phase = score(late.unsigned_abs() as f64 / n as f64, PHASE_ERROR);
    let magnitude = score(magnitude_error(r, p), MAGNITUDE_ERROR);
    let slope = score(slope_error(r, p, interval_s), SLOPE_ERROR);
    let rating = 0.4 * corridor + 0.2 * (phase + magnitude + slope);
    Some(Iso18571 {
        corridor,
        phase,
        magnitude,
        slope,
        rating,
        grade: Grade::of(rating),
        late_s: late as f64 * interval_s,
    })
}

/// 1 without an error, falling to 0 at the largest.
fn score(error: f64, largest: f64) -> f64 {
    ((largest - error) / largest).max(0.0)
}

/// Relative difference along the path on which the two belong together.
fn magnitude_error(reference: &[f64], prediction: &[f64]) -> f64 {
    let path = warping_path(prediction, reference, reference.len().div_ceil(WINDOW));
    relative(path.into_iter().map(|(p, r)| (reference[r], prediction[p])))
}

/// Relative difference of the smoothed slopes.
fn slope_error(reference: &[f64], prediction: &[f64], interval_s: f64) -> f64 {
    let time: Vec<f64> = (0..reference.len()).map(|i| i as f64 * interval_s).collect();
    let slope = |values: &[f64]| smoothed(&derivative(&time, values));
    relative(slope(reference).into_iter().zip(slope(prediction)))
}

/// `Σ|p − r| / Σ|r|` of pairs `(r, p)`.
fn relative(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut difference, mut scale) = (0.0, 0.0);
    for (r, p) in pairs {
        difference += (p - r).abs();
        scale += r.abs();
    }
    if difference == 0.0 { 0.0 } else { difference / scale }
}

/// Means over nine samples; towards the ends over seven, five, three and one.
fn smoothed(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    (0..n)
        .map(|i| {
            let reach = (SMOOTHED / 2).min(i).min(n - 1 - i);
            let around = &values[i - reach..=i + reach];
            around.iter().sum::<f64>() / around.len() as f64
        })
        .collect()
}

/// Half width of the inner corridor, as a share of the reference's largest magnitude.
const INNER: f64 = 0.05;
/// Half width of the outer corridor.
const OUTER: f64 = 0.5;
/// Exponent between the two.
const EXPONENT: i32 = 2;

/// Mean over the samples of 1 inside the inner corridor, 0 outside the outer one, and
/// `((b − |p − r|)/(b − a))²` between them. ISO/TS 18571:2014 and CORA have the same.
///
/// Equal lengths, at least one. 0 to 1. Of a reference that is zero throughout the corridors
/// have no width: samples that are zero as well count 1.
pub(crate) fn corridor(reference: &[f64], prediction: &[f64]) -> f64 {
    let scale = reference.iter().fold(0.0, |m: f64, r| m.max(r.abs()));
    let (inner, outer) = (INNER * scale, OUTER * scale);
    let score = |(r, p): (&f64, &f64)| {
        let distance = (p - r).abs();
        if distance < inner || distance == 0.0 {
            1.0
        } else if distance > outer || outer == 0.0 {
            0.0
        } else {
            ((outer - distance) / (outer - inner)).powi(EXPONENT)
        }
    };
    reference.iter().zip(prediction).map(score).sum::<f64>() / reference.len() as f64
}

/// Which cell a path comes from.
const FROM_FIRST: u8 = 0;
const FROM_SECOND: u8 = 1;
const FROM_BOTH: u8 = 2;

/// The path of pairs `(index of first, index of second)` with the smallest sum of squared
/// distances from the first samples to the last, in steps (1,0), (0,1), (1,1).
///
/// Equal lengths, at least one; pairs lie less than `window` samples apart (at least one).
/// Of equal sums the step that stands first above is taken. Needs one byte for each cell of
/// the window: `n (2 window − 1)`.
pub(crate) fn warping_path(first: &[f64], second: &[f64], window: usize) -> Vec<(usize, usize)> {
    let n = first.len();
    let reach = window - 1;
    let width = 2 * reach + 1;
    // Cell (i, j) stands at j + reach − i of row i.
    let mut from = vec![FROM_BOTH; n * width];
    // The row above, and the row in work: sums, infinite outside of the window.
    let mut above = vec![f64::INFINITY; width + 1];
    let mut row = vec![f64::INFINITY; width + 1];
    for i in 0..n {
        row.fill(f64::INFINITY);
        let within = i.saturating_sub(reach)..(i + reach + 1).min(n);
        for (j, other) in within.clone().zip(&second[within]) {
            let cell = j + reach - i;
            let distance = first[i] - other;
            let left = if cell > 0 { row[cell - 1] } else { f64::INFINITY };
            // One row up the same j stands one further to the right.
            let before = [above[cell + 1], left, above[cell]];
            let mut least = 0;
            for step in 1..3 {
                if before[step] < before[least] {
                    least = step;
                }
            }
            let sum = if (i, j) == (0, 0) { 0.0 } else { before[least] };
            row[cell] = sum + distance * distance;
            from[i * width + cell] = [FROM_FIRST, FROM_SECOND, FROM_BOTH][least];
        }
        std::mem::swap(&mut above, &mut row);
    }
    let (mut i, mut j) = (n - 1, n - 1);
    let mut path = vec![(i, j)];
    while (i, j) != (0, 0) {
        match from[i * width + j + reach - i] {
            FROM_FIRST => i -= 1,
            FROM_SECOND => j -= 1,
            _ => (i, j) = (i - 1, j - 1),
        }
        path.push((i, j));
    }
    path.reverse();
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    const INTERVAL_S: f64 = 1e-4;

    fn sine(samples: usize, late_s: f64, scale: f64) -> Vec<f64> {
        (0..samples).map(|i| scale * (20.0 * (i as f64 * INTERVAL_S - late_s)).sin()).collect()
    }

    #[test]
    fn scaled_sine_by_two_public_programs() {
        let rated = iso18571(&sine(1501, 0.0, 1.0), &sine(1501, 0.0, 1.3), INTERVAL_S).unwrap();
        assert!((rated.rating - 0.713).abs() < 5e-4, "{rated:?}");
        assert_eq!((rated.phase, rated.grade), (1.0, Grade::Fair));
        // All slopes are 1.3 times as large.
        assert!((rated.slope - 0.85).abs() < 1e-12);
    }

    #[test]
    fn late_sine_by_two_public_programs() {
        // Known from 10 ms on: 1401 common samples.
        let r: Vec<f64> = sine(1501, 0.0, 1.0)[100..].to_vec();
        let p: Vec<f64> = sine(1401, 0.0, 1.0);
        let rated = iso18571(&r, &p, INTERVAL_S).unwrap();
        assert!((rated.rating - 0.815).abs() < 5e-4, "{rated:?}");
        assert!((rated.late_s - 0.010).abs() < 1e-12);
        assert!((rated.phase - (280.2 - 100.0) / 280.2).abs() < 1e-12);
        assert_eq!((rated.magnitude, rated.slope), (1.0, 1.0));
    }

    #[test]
    fn a_constant_offset_by_hand() {
        // r = 1, p = 1.25: corridor ((0.5 − 0.25)/0.45)², e_M = 0.25, no slope at all.
        let rated = iso18571(&[1.0; 50], &[1.25; 50], INTERVAL_S).unwrap();
        assert!((rated.corridor - (0.25_f64 / 0.45).powi(2)).abs() < 1e-15);
        assert_eq!((rated.phase, rated.magnitude, rated.slope), (1.0, 0.5, 1.0));
    }

    #[test]
    fn slopes_of_opposite_sign_score_nothing() {
        let ramp: Vec<f64> = (0..50).map(f64::from).collect();
        let falling: Vec<f64> = ramp.iter().map(|v| -v).collect();
        assert!((slope_error(&ramp, &falling, INTERVAL_S) - 2.0).abs() < 1e-12);
        let rated = iso18571(&ramp, &falling, INTERVAL_S).unwrap();
        assert!(rated.slope < 1e-12 && rated.grade == Grade::Poor);
    }

    #[test]
    fn ends_are_smoothed_over_fewer_samples() {
        let mut values = [0.0; 20];
        (values[1], values[10]) = (3.0, 9.0);
        let smooth = smoothed(&values);
        assert_eq!(smooth[..6], [0.0, 1.0, 0.6, 3.0 / 7.0, 3.0 / 9.0, 3.0 / 9.0]);
        assert_eq!(smooth[6..16], [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0]);
    }

    #[test]
    fn grades_begin_above_their_limits() {
        let grades = [0.94, 0.9401, 0.80, 0.8001, 0.58, 0.5801].map(Grade::of);
        use Grade::{Excellent, Fair, Good, Poor};
        assert_eq!(grades, [Good, Excellent, Fair, Good, Poor, Fair]);
    }

    #[test]
    fn lengths_are_bounded() {
        let long = vec![1.0; MOST_SAMPLES + 1];
        assert_eq!(iso18571(&long, &long, INTERVAL_S), None);
        assert_eq!(iso18571(&[1.0; 11], &[1.0; 11], INTERVAL_S), None);
    }

    #[test]
    fn zeros_are_rated() {
        let (zero, one) = ([0.0; 50], [1.0; 50]);
        assert_eq!(iso18571(&zero, &zero, INTERVAL_S).unwrap().rating, 1.0);
        // Against zeros only phase and slope cannot be wrong.
        assert_eq!(iso18571(&zero, &one, INTERVAL_S).unwrap().rating, 0.4);
    }
}

#[cfg(test)]
mod corridor_tests {
    use super::*;

    #[test]
    fn corridor_by_hand() {
        // Distances of 0.2, 2.75, 5 and 6 in a signal of 10: inside, half way, edge, outside.
        let score = corridor(&[10.0, 0.0, 0.0, 0.0], &[10.2, 2.75, 5.0, -6.0]);
        assert!((score - (1.0 + 0.25 + 0.0 + 0.0) / 4.0).abs() < 1e-15);
    }

    #[test]
    fn a_reference_of_zeros_has_a_corridor_without_width() {
        assert_eq!(corridor(&[0.0, 0.0], &[0.0, 1e-9]), 0.5);
    }
}

#[cfg(test)]
mod warping_tests {
    use super::*;

    #[test]
    fn path_by_hand() {
        // The peak is one sample late: 0-0, 0-1, 1-2, 2-3, 3-3.
        let path = warping_path(&[0.0, 5.0, 1.0, 1.0], &[0.0, 0.0, 5.0, 1.0], 4);
        assert_eq!(path, [(0, 0), (0, 1), (1, 2), (2, 3), (3, 3)]);
    }

    #[test]
    fn a_window_of_one_is_the_diagonal() {
        let path = warping_path(&[0.0, 5.0, 1.0], &[5.0, 1.0, 0.0], 1);
        assert_eq!(path, [(0, 0), (1, 1), (2, 2)]);
    }

    #[test]
    fn no_path_within_the_window_is_shorter() {
        /// Smallest sum from the first cell to (i, j), by trying all paths.
        fn least(a: &[f64], b: &[f64], i: usize, j: usize, window: usize) -> f64 {
            if i.abs_diff(j) >= window {
                return f64::INFINITY;
            }
            let own = (a[i] - b[j]).powi(2);
            let mut before = f64::INFINITY;
            if i > 0 {
                before = before.min(least(a, b, i - 1, j, window));
            }
            if j > 0 {
                before = before.min(least(a, b, i, j - 1, window));
            }
            if i > 0 && j > 0 {
                before = before.min(least(a, b, i - 1, j - 1, window));
            }
            own + if (i, j) == (0, 0) { 0.0 } else { before }
        }
        let a = [0.0, 3.0, 1.0, 4.0, 1.0, 5.0, 9.0];
        let b = [2.0, 6.0, 5.0, 3.0, 5.0, 8.0, 9.0];
        for window in 1..=7 {
            let sum: f64 =
                warping_path(&a, &b, window).iter().map(|&(i, j)| (a[i] - b[j]).powi(2)).sum();
            assert_eq!(sum, least(&a, &b, 6, 6, window), "window {window}");
        }
    }
}
