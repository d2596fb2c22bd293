//! ISO/TS 18571:2014: objective rating metric of two signals that are not ambiguous.

use schemars::JsonSchema;
use serde::Serialize;

use super::corridor::corridor;
use super::shift::{best, centred};
use super::warping;
use crate::signal::derivative;

/// Largest phase error that has a score, as a share of the samples; nothing is shifted further.
const PHASE_ERROR: f64 = 0.2;
/// Magnitude error at which the score is zero.
const MAGNITUDE_ERROR: f64 = 0.5;
/// Slope error at which the score is zero.
const SLOPE_ERROR: f64 = 2.0;
/// The window of the warping is this part of the samples.
const WINDOW: usize = 10;
/// Slopes are means over this many samples.
const SMOOTHED: usize = 9;

/// Fewest samples: what a shift leaves must hold a mean of nine.
pub(crate) const LEAST_SAMPLES: usize = 12;
/// Most samples: the warping takes a fifth of their square in bytes, here 80 MB, and the
/// search for the shift as many steps.
pub(crate) const MOST_SAMPLES: usize = 20_000;

/// Scores of ISO/TS 18571, each from 0 to 1, and the rating they give.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Iso18571 {
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Grade {
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
/// is taken, as the standard has it for equal ones.
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
    let path = warping::path(prediction, reference, reference.len().div_ceil(WINDOW));
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
