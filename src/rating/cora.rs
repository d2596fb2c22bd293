//! CORA: correlation and analysis, a corridor and a cross-correlation.
//!
//! Gehre, Gades, Wernicke: Objective rating of signals using test and simulation responses,
//! ESV 2009, paper 09-0407, with that paper's parameters.

use schemars::JsonSchema;
use serde::Serialize;

use super::iso18571::{MOST_SAMPLES, corridor};
use super::signal::{best, plain};

/// Exponent K_V of the progression.
const PROGRESSION_EXPONENT: i32 = 10;
/// Shifts up to D_MIN of the interval count as none, from D_MAX on as the worst.
const D_MIN: f64 = 0.01;
const D_MAX: f64 = 0.12;
/// Weights of progression, size and phase.
const WEIGHTS: [f64; 3] = [0.5, 0.25, 0.25];

/// Ratings of CORA, each from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Cora {
    /// Corridor of 5 % and 50 % of the reference's largest magnitude, exponent 2.
    pub corridor: f64,
    /// `(½ (K + 1))¹⁰` of the largest correlation K.
    pub progression: f64,
    /// The smaller over the larger sum of squares after the shift.
    pub size: f64,
    /// 1 for a shift up to 1 % of the interval, falling to 0 at 12 %.
    pub phase: f64,
    /// Half the progression, a quarter of size and of phase each.
    pub cross_correlation: f64,
    /// Mean of corridor and cross-correlation.
    pub rating: f64,
    /// By how much the prediction is late, in s; negative if it is early. At most a fifth of
    /// the interval.
    pub late_s: f64,
}

/// Rates a prediction by CORA over the whole interval that is given: the program's automatic
/// choice of an interval is left to the caller.
///
/// Equal lengths of 2 to [`MOST_SAMPLES`], samples at `interval_s`; `None` otherwise. Signals are
/// shifted within the interval, and 80 % of it (INT_MIN) must overlap. A signal of zeros
/// correlates with nothing: progression, size and phase are 0, unless both are zero.
pub(crate) fn cora(reference: &[f64], prediction: &[f64], interval_s: f64) -> Option<Cora> {
    let n = reference.len();
    if !(2..=MOST_SAMPLES).contains(&n) || prediction.len() != n {
        return None;
    }
    let corridor = corridor(reference, prediction);
    let shift = best(reference, prediction, plain);
    let [progression, size, phase] = match shift {
        Some(shift) => {
            let [r, p] = shift.overlap(reference, prediction);
            let share = shift.late.unsigned_abs() as f64 / (n - 1) as f64;
            [
                (0.5 * (shift.correlation + 1.0)).powi(PROGRESSION_EXPONENT),
                size(r, p),
                ((D_MAX - share) / (D_MAX - D_MIN)).clamp(0.0, 1.0),
            ]
        }
        None if reference == prediction => [1.0; 3],
        None => [0.0; 3],
    };
    let parts = [progression, size, phase];
    let cross_correlation = parts.iter().zip(WEIGHTS).map(|(part, weight)| part * weight).sum();
    Some(Cora {
        corridor,
        progression,
        size,
        phase,
        cross_correlation,
        rating: 0.5 * (corridor + cross_correlation),
        late_s: shift.map_or(0.0, |s| s.late as f64 * interval_s),
    })
}

/// The smaller over the larger sum of squares.
fn size(a: &[f64], b: &[f64]) -> f64 {
    let squares = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>();
    let (a, b) = (squares(a), squares(b));
    if a == b { 1.0 } else { a.min(b) / a.max(b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scaled_signal_by_hand() {
        // 1.3 times a plateau: distance 0.3 of the maximum, squares 1.69.
        let p = [1.3; 100];
        let rated = cora(&[1.0; 100], &p, 1e-4).unwrap();
        let corridor = (0.2_f64 / 0.45).powi(2);
        assert!((rated.corridor - corridor).abs() < 1e-14);
        assert!((rated.progression - 1.0).abs() < 1e-14 && rated.phase == 1.0);
        assert!((rated.size - 1.0 / 1.69).abs() < 1e-14);
        let cross = 0.5 + 0.25 / 1.69 + 0.25;
        assert!((rated.cross_correlation - cross).abs() < 1e-14);
        assert!((rated.rating - 0.5 * (corridor + cross)).abs() < 1e-14);
    }

    #[test]
    fn the_phase_falls_between_one_and_twelve_percent() {
        let pulse = |at: usize| -> Vec<f64> { (0..1001).map(|i| f64::from(i == at)).collect() };
        let phase = |late: usize| cora(&pulse(400), &pulse(400 + late), 1e-4).unwrap().phase;
        assert_eq!([phase(0), phase(10), phase(120), phase(150)], [1.0, 1.0, 0.0, 0.0]);
        assert!((phase(65) - 0.5).abs() < 1e-12);
        assert!((cora(&pulse(400), &pulse(465), 1e-4).unwrap().late_s - 0.0065).abs() < 1e-15);
    }

    #[test]
    fn the_progression_of_an_opposite_constant_is_nothing() {
        let rated = cora(&[1.0; 100], &[-1.0; 100], 1e-4).unwrap();
        assert_eq!((rated.progression, rated.size, rated.corridor), (0.0, 1.0, 0.0));
    }

    #[test]
    fn zeros_correlate_with_nothing_but_zeros() {
        assert_eq!(cora(&[0.0; 20], &[0.0; 20], 1e-4).unwrap().rating, 1.0);
        assert_eq!(cora(&[0.0; 20], &[1.0; 20], 1e-4).unwrap().rating, 0.0);
        assert_eq!(cora(&vec![0.0; MOST_SAMPLES + 1], &vec![0.0; MOST_SAMPLES + 1], 1e-4), None);
    }
}
