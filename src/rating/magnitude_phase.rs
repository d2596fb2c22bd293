//! Magnitude and phase errors: Sprague and Geers, Russell.

use std::f64::consts::{FRAC_PI_4, PI};

use schemars::JsonSchema;
use serde::Serialize;

/// Errors of magnitude and of phase, and their combination; 0 where the signals agree.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct MagnitudePhase {
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
