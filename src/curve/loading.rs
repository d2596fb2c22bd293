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
    let mut best = (0, f64::NEG_INFINITY);
    for (i, &d) in curve.deflection_m().iter().enumerate() {
        if d > best.1 {
            best = (i, d);
        }
    }
    best.0
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

/// Where a file jumps, its points of one deflection are set apart by this share of the largest: negligible in energy, and less
/// steep than would ask runs for tiny steps.
pub(crate) const STEP_WIDTH_SHARE: f64 = 1e-4;
/// More such steps in a row are a fine record and no jump.
const MOST_AT_ONE: usize = 3;

/// Steepest rise of a loading branch, in N/m: jumps, whose width is ours, count only if it rises nowhere else.
pub(crate) fn steepest_rise(deflection_m: &[f64], force_n: &[f64]) -> f64 {
    let [rise, of_jumps] = steepest_rises(deflection_m, force_n);
    if rise > 0.0 { rise } else { of_jumps }
}

/// The steepest rise that is not a jump, and that of jumps, in N/m; 0 if there is none.
pub(super) fn steepest_rises(deflection_m: &[f64], force_n: &[f64]) -> [f64; 2] {
    let step_m = |i: &usize| deflection_m[*i] - deflection_m[i - 1];
    let jump_m = STEP_WIDTH_SHARE * (1.0 + 1e-6) * deflection_m.last().copied().unwrap_or(0.0);
    let is_narrow = |i: &usize| step_m(i) <= jump_m;
    let steps: Vec<usize> = (1..deflection_m.len()).collect();
    let alike = steps.chunk_by(|a, b| is_narrow(a) == is_narrow(b));
    let (jumps, others): (Vec<&[usize]>, Vec<&[usize]>) =
        alike.partition(|run| is_narrow(&run[0]) && run.len() <= MOST_AT_ONE);
    let slope = |i: &usize| (force_n[*i] - force_n[i - 1]) / step_m(i);
    let steepest = |of: Vec<&[usize]>| of.into_iter().flatten().map(slope).fold(0.0, f64::max);
    [steepest(others), steepest(jumps)]
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

/// Stiffness in N/m of the straight line from the maximum deflection that gives back the energy of the unloading branch up to
/// where its force is first zero, or to its end, `F²/2E`: a branch that is not straight rebounds by its energy, not by its slope.
///
/// `None` where the branch has no [`unloading_stiffness`], or gives back nothing.
pub(crate) fn stiffness_of_unloading_energy(curve: &Curve) -> Option<f64> {
    unloading_stiffness(curve)?;
    let end = loading_end(curve);
    let (d, f) = (&curve.deflection_m()[end..], &curve.force_n()[end..]);
    let until = f.iter().position(|f| *f <= 0.0).unwrap_or(f.len() - 1);
    let step = |i: usize| match f[i] {
        // To where the force passes zero.
        after if after < 0.0 => 0.5 * f[i - 1] * (d[i - 1] - d[i]) * f[i - 1] / (f[i - 1] - after),
        after => 0.5 * (f[i - 1] + after) * (d[i - 1] - d[i]),
    };
    let energy_j: f64 = (1..=until).map(step).sum();
    (energy_j > 0.0).then(|| f[0] * f[0] / (2.0 * energy_j))
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
    fn a_jump_is_not_a_stiffness() {
        let d = [0.0, 0.06, 0.06 + 4.5e-5, 0.45];
        assert!((steepest_rise(&d, &[0.0, 0.6, 1.2, 1.2]) - 10.0).abs() < 1e-9);
        assert!((steepest_rise(&d, &[0.0, 0.0, 1.2, 1.2]) - 1.2 / 4.5e-5).abs() < 1e-6);
        let fine: Vec<f64> = (0..=20_000).map(|i| f64::from(i) / 2e4).collect();
        let force: Vec<f64> = fine.iter().map(|d| d * d).collect();
        assert!((steepest_rise(&fine, &force) - 2.0).abs() < 1e-3);
    }

    #[test]
    fn unloading_stiffness_of_a_straight_line() {
        let c = curve(&[(0.0, 0.0), (2.0, 100.0), (1.9, 50.0), (1.8, 0.0), (1.7, 0.0)]);
        assert!((unloading_stiffness(&c).unwrap() - 500.0).abs() < 1e-9);
        assert!((stiffness_of_unloading_energy(&c).unwrap() - 500.0).abs() < 1e-9);
        let c = curve(&[(0.0, 0.0), (2.0, 100.0), (1.9, 20.0), (1.4, 0.0), (1.3, -1.0)]);
        assert!((stiffness_of_unloading_energy(&c).unwrap() - 1e4 / 22.0).abs() < 1e-9);
        let truncated = curve(&[(0.0, 0.0), (1.0, 50.0), (2.0, 100.0)]);
        assert_eq!(unloading_stiffness(&truncated), None);
    }
}
