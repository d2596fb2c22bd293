//! Differences of two signals, sample by sample and over all of them; in magnitude and in phase.

use std::f64::consts::{FRAC_PI_4, PI};

use schemars::JsonSchema;
use serde::Serialize;

/// Values below this share of the largest magnitude have no relative error worth its name.
const SMALL: f64 = 0.05;
/// An integral below this share of that of the magnitudes is a difference of large numbers.
const CANCELS: f64 = 0.05;

/// Mean of `|p − r|/|r|` over the samples where `|r|` is at least 5 % of its maximum.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Pointwise {
    /// The mean; 0 where the signals agree.
    pub mean: f64,
    /// Share of the samples that are left out.
    pub left_out: f64,
}

/// The largest difference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct MaxAbs {
    /// `|p − r|`, in the unit of the signals.
    pub value: f64,
    /// Where it is, in s.
    pub time_s: f64,
}

/// Largest magnitude.
fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m: f64, v| m.max(v.abs()))
}

/// Pairs `(r, |p − r|)`.
fn pairs<'a>(r: &'a [f64], p: &'a [f64]) -> impl Iterator<Item = (f64, f64)> + 'a {
    r.iter().zip(p).map(|(r, p)| (*r, (p - r).abs()))
}

/// `‖p − r‖₂ / ‖r‖₂`; `None` if the reference is zero throughout. Equal lengths.
pub(crate) fn rms_ratio(reference: &[f64], prediction: &[f64]) -> Option<f64> {
    let squares: f64 = reference.iter().map(|r| r * r).sum();
    let differences: f64 = pairs(reference, prediction).map(|(_, d)| d * d).sum();
    (squares > 0.0).then(|| (differences / squares).sqrt())
}

/// Mean of `|p − r|` over the largest `|r|`; `None` if that is zero. Equal lengths.
pub(crate) fn peak_norm(reference: &[f64], prediction: &[f64]) -> Option<f64> {
    let scale = largest(reference);
    let sum: f64 = pairs(reference, prediction).map(|(_, d)| d).sum();
    (scale > 0.0).then(|| sum / reference.len() as f64 / scale)
}

/// See [`Pointwise`]; `None` if the reference is zero throughout. Equal lengths.
pub(crate) fn pointwise(reference: &[f64], prediction: &[f64]) -> Option<Pointwise> {
    let least = SMALL * largest(reference);
    let kept = pairs(reference, prediction).filter(|(r, _)| r.abs() >= least && *r != 0.0);
    let errors: Vec<f64> = kept.map(|(r, d)| d / r.abs()).collect();
    (!errors.is_empty()).then(|| Pointwise {
        mean: errors.iter().sum::<f64>() / errors.len() as f64,
        left_out: 1.0 - errors.len() as f64 / reference.len() as f64,
    })
}

/// The largest difference and its time; equal lengths, at least one.
pub(crate) fn max_abs(time_s: &[f64], reference: &[f64], prediction: &[f64]) -> MaxAbs {
    let mut found = MaxAbs { value: 0.0, time_s: time_s[0] };
    for (&time_s, (_, value)) in time_s.iter().zip(pairs(reference, prediction)) {
        if value > found.value {
            found = MaxAbs { value, time_s };
        }
    }
    found
}

/// Trapezoid sum of `values` over `along`; equal lengths.
pub(crate) fn integral(along: &[f64], values: &[f64]) -> f64 {
    let steps = along.windows(2).zip(values.windows(2));
    steps.map(|(x, v)| 0.5 * (v[0] + v[1]) * (x[1] - x[0])).sum()
}

/// `∫p / ∫r − 1` by trapezoids over `along`: over a deflection a force's error of energy, over
/// time a force's of impulse, an acceleration's of the change of speed.
///
/// Equal lengths; `along` increasing. `None` where it makes no sense, as the reference's positive
/// and negative parts nearly cancel (less than 5 % is left) or it is zero throughout.
pub(crate) fn integral_error(along: &[f64], reference: &[f64], prediction: &[f64]) -> Option<f64> {
    let magnitude: Vec<f64> = reference.iter().map(|r| r.abs()).collect();
    let of_reference = integral(along, reference);
    let of_magnitude = integral(along, &magnitude);
    let makes_sense = of_magnitude > 0.0 && of_reference.abs() >= CANCELS * of_magnitude;
    makes_sense.then(|| integral(along, prediction) / of_reference - 1.0)
}

/// Errors of magnitude and of phase, and their combination; 0 where the signals agree.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct MagnitudePhase {
    /// Above 0 if the prediction is larger.
    pub magnitude: f64,
    /// 0 to 1.
    pub phase: f64,
    /// Of Sprague and Geers the root of the sum of the two squares; of Russell that, times √(π/4).
    pub combined: f64,
}

/// `√Σr²`, `√Σp²` and `acos(Σrp / √(Σr² Σp²)) / π`; `None` if one of the signals is zero
/// throughout.
///
/// Near a cosine of 1 the inverse cosine makes 1e-8 of a rounding of 1e-16, so the angle is taken
/// from the sides of the rhombus that the two signals, each of length 1, span.
fn norms_and_phase(reference: &[f64], prediction: &[f64]) -> Option<[f64; 3]> {
    let norm = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>().sqrt();
    let (of_r, of_p) = (norm(reference), norm(prediction));
    let (mut apart, mut together) = (0.0, 0.0);
    for (r, p) in reference.iter().zip(prediction) {
        let (r, p) = (r / of_r, p / of_p);
        apart += (r - p) * (r - p);
        together += (r + p) * (r + p);
    }
    let angle = 2.0 * f64::atan2(apart.sqrt(), together.sqrt());
    (of_r > 0.0 && of_p > 0.0).then_some([of_r, of_p, angle / PI])
}

/// `M = √(Σp²/Σr²) − 1`, `P = acos(Σrp/√(Σr² Σp²))/π`, `C = √(M² + P²)`.
///
/// Equal lengths. Sprague, Geers: A spectral-element method for modelling cavitation in
/// transient fluid–structure interaction, Int. J. Numer. Meth. Eng. 60 (2004). `None` if one of
/// the signals is zero throughout.
pub(crate) fn sprague_geers(reference: &[f64], prediction: &[f64]) -> Option<MagnitudePhase> {
    let [of_r, of_p, phase] = norms_and_phase(reference, prediction)?;
    let magnitude = of_p / of_r - 1.0;
    Some(MagnitudePhase { magnitude, phase, combined: magnitude.hypot(phase) })
}

/// `m = (Σp² − Σr²)/√(Σr² Σp²)`, `M = sgn(m) lg(1 + |m|)`, P as above, `C = √(π/4 (M² + P²))`.
///
/// Equal lengths. Russell: Error measures for comparing transient data, 68th Shock and
/// Vibration Symposium (1997). `None` if one of the signals is zero throughout.
pub(crate) fn russell(reference: &[f64], prediction: &[f64]) -> Option<MagnitudePhase> {
    let [of_r, of_p, phase] = norms_and_phase(reference, prediction)?;
    let m = of_p / of_r - of_r / of_p;
    let magnitude = (1.0 + m.abs()).log10().copysign(m);
    let combined = FRAC_PI_4.sqrt() * magnitude.hypot(phase);
    Some(MagnitudePhase { magnitude, phase, combined })
}

#[cfg(test)]
mod tests {
    use super::*;

    const R: [f64; 4] = [0.0, -10.0, 4.0, 0.4];
    const P: [f64; 4] = [1.0, -8.0, 5.0, 0.4];

    #[test]
    fn differences_by_hand() {
        let rms = rms_ratio(&R, &P).unwrap();
        assert!((rms - (6.0_f64 / 116.16).sqrt()).abs() < 1e-15);
        assert!((peak_norm(&R, &P).unwrap() - 0.1).abs() < 1e-15);
        // 0.2 and 0.25; 0 and 0.4 are left out.
        let pointwise = pointwise(&R, &P).unwrap();
        assert!((pointwise.mean - 0.225).abs() < 1e-15 && pointwise.left_out == 0.5);
        let time = [0.0, 0.1, 0.2, 0.3];
        assert_eq!(max_abs(&time, &R, &P), MaxAbs { value: 2.0, time_s: 0.1 });
    }

    #[test]
    fn integral_by_hand() {
        let along = [0.0, 1.0, 3.0];
        // 1 + 6 against 1.5 + 8.
        let error = integral_error(&along, &[0.0, 2.0, 4.0], &[0.0, 3.0, 5.0]).unwrap();
        assert!((error - (9.5 / 7.0 - 1.0)).abs() < 1e-15);
        assert_eq!(integral_error(&[0.0, 1.0, 2.0], &[1.0, 0.0, -1.0], &[1.0; 3]), None);
    }

    #[test]
    fn a_reference_of_zeros_has_no_ratio() {
        let (zero, one) = ([0.0; 3], [1.0; 3]);
        assert_eq!(rms_ratio(&zero, &one), None);
        assert_eq!(peak_norm(&zero, &one), None);
        assert_eq!(pointwise(&zero, &one), None);
        assert_eq!(integral_error(&[0.0, 1.0, 2.0], &zero, &one), None);
        assert_eq!(max_abs(&zero, &zero, &one).value, 1.0);
    }
}

#[cfg(test)]
mod magnitude_phase_tests {
    use super::*;

    #[test]
    fn a_doubled_signal_has_no_phase_error() {
        let (r, p) = ([3.0, -4.0], [6.0, -8.0]);
        let sg = sprague_geers(&r, &p).unwrap();
        assert_eq!((sg.magnitude, sg.phase, sg.combined), (1.0, 0.0, 1.0));
        // m = (100 − 25)/50 = 1.5.
        let russell = russell(&r, &p).unwrap();
        assert!((russell.magnitude - 2.5_f64.log10()).abs() < 1e-15);
        assert!((russell.combined - FRAC_PI_4.sqrt() * 2.5_f64.log10()).abs() < 1e-15);
    }

    #[test]
    fn a_quarter_wave_is_half_and_the_opposite_all() {
        for rate in [sprague_geers, russell] {
            let quarter = rate(&[1.0, 0.0], &[0.0, 1.0]).unwrap();
            assert!(quarter.magnitude == 0.0 && (quarter.phase - 0.5).abs() < 1e-15);
            assert_eq!(rate(&[1.0, 2.0], &[-1.0, -2.0]).unwrap().phase, 1.0);
            let angle = rate(&[1.0, 0.0], &[1.0, 1e-12]).unwrap().phase * PI;
            assert!((angle - 1e-12).abs() < 1e-24, "{angle}");
            assert_eq!(rate(&[0.0, 0.0], &[1.0, 2.0]), None);
        }
        assert!(russell(&[2.0, 0.0], &[1.0, 0.0]).unwrap().magnitude < 0.0);
    }
}
