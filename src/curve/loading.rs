//! Loading and unloading branches of a curve.

use super::{Curve, Envelope};
use crate::error::Error;

/// A sample joins the loading branch if its deflection exceeds the running maximum by
/// this share of the maximum deflection.
const MIN_ADVANCE: f64 = 1e-6;

/// The loading branch of a curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Loading {
    /// Force over deflection, from (0, 0) to the maximum deflection.
    pub envelope: Envelope,
    /// Samples left out because the deflection did not advance.
    pub dropped: usize,
}

/// Index of the maximum deflection: the end of the loading branch.
pub(crate) fn loading_end(curve: &Curve) -> usize {
    let deflection = curve.deflection_m();
    (1..deflection.len()).fold(0, |best, i| if deflection[i] > deflection[best] { i } else { best })
}

/// The samples up to the maximum deflection whose deflection advances, begun at 0. A record
/// that begins with a deflection (an offset) rises to it in a straight line.
pub(crate) fn loading_branch(curve: &Curve) -> Result<Loading, Error> {
    let end = loading_end(curve);
    let (d, f) = (curve.deflection_m(), curve.force_n());
    let advance = MIN_ADVANCE * d[end];
    // The force at contact is the one of the first sample, whose deflection is 0.
    let (mut deflection_m, mut force_n) =
        if d[0] <= advance { (vec![0.0], vec![f[0]]) } else { (vec![0.0, d[0]], vec![0.0, f[0]]) };
    let mut dropped = 0;
    for i in 1..=end {
        if d[i] > deflection_m[deflection_m.len() - 1] + advance {
            deflection_m.push(d[i]);
            force_n.push(f[i]);
        } else {
            dropped += 1;
        }
    }
    let envelope = Envelope::new(deflection_m, force_n)?;
    Ok(Loading { envelope, dropped })
}

/// Secant of the unloading branch between 90 % and 10 % of the force at the maximum
/// deflection, in N/m.
///
/// `None` if the record ends before, or the deflection does not fall between the two.
pub fn unloading_stiffness(curve: &Curve) -> Option<f64> {
    let end = loading_end(curve);
    let (d, f) = (curve.deflection_m(), curve.force_n());
    let top = f[end];
    if top <= 0.0 {
        return None;
    }
    let crossing = |level: f64| {
        let i = (end + 1..f.len()).find(|&i| f[i] <= level * top)?;
        let share = (f[i - 1] - level * top) / (f[i - 1] - f[i]);
        Some(d[i - 1] + share * (d[i] - d[i - 1]))
    };
    let (high, low) = (crossing(0.9)?, crossing(0.1)?);
    (high > low).then(|| 0.8 * top / (high - low))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(points: &[(f64, f64)]) -> Curve {
        let time = (0..points.len()).map(|i| i as f64).collect();
        let (d, f) = points.iter().copied().unzip();
        Curve::new(time, d, f).unwrap()
    }

    #[test]
    fn splits_at_the_largest_deflection() {
        let c = curve(&[(0.0, 1.0), (1.0, 4.0), (0.9, 9.0), (2.0, 5.0), (1.5, 2.5), (1.0, 0.0)]);
        assert_eq!(loading_end(&c), 3);
        let loading = loading_branch(&c).unwrap();
        assert_eq!(loading.envelope.deflection_m(), [0.0, 1.0, 2.0]);
        assert_eq!(loading.envelope.force_n(), [1.0, 4.0, 5.0]);
        assert_eq!(loading.dropped, 1);
    }

    #[test]
    fn unloading_stiffness_of_a_straight_line() {
        let c = curve(&[(0.0, 0.0), (2.0, 100.0), (1.9, 50.0), (1.8, 0.0), (1.7, 0.0)]);
        assert!((unloading_stiffness(&c).unwrap() - 500.0).abs() < 1e-9);
        let truncated = curve(&[(0.0, 0.0), (1.0, 50.0), (2.0, 100.0)]);
        assert_eq!(unloading_stiffness(&truncated), None);
    }
}
