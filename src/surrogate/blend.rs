//! How much of each run goes into a value at another impact speed.
//!
//! The values of the runs are modelled as a smooth function of the impact speed with noise, a Gaussian
//! process of unknown mean (ordinary kriging: Rasmussen and Williams, Gaussian Processes for Machine
//! Learning, 2006, sections 2.2, 2.7 and 4.2). A run that deviates from the others does so by an individual
//! fold, which need not occur at neighbouring speeds. How much runs have of their own is what makes their values most likely
//! (ibid., section 5.4). The residual of a run fades with
//! the square of the proximity in speed, so that at its own speed a run is reproduced exactly.
//!
//! Tried and dropped: more variance of its own for what varies over a short way. Neighbouring runs share their folds, too.

use super::curves::{neighbours, twins};
use crate::dataset::is_same_speed;
use crate::signal::Cholesky;

/// Length over which the runs are alike, relative to the range of their speeds.
const LENGTH: f64 = 1.5;
/// Variances of what is a run's own, relative to that of the smooth function: runs that differ by nothing but speed have the first.
const OWN: [f64; 4] = [0.02, 0.05, 0.1, 0.2];
/// Of a hundred places along a crush about five belong to one fold: they are one observation.
const VALUES_OF_STRETCH: f64 = 5.0;
/// By how much the logarithm of the likelihood must exceed that of the first: by 1, as for a further parameter (Akaike, IEEE Trans. Automatic
/// Control 19, 1974).
const EVIDENCE: f64 = 1.0;

/// The runs of a group, by their increasing impact speeds.
pub(super) struct Blend<'a> {
    speeds_m_per_s: &'a [f64],
    length_m_per_s: f64,
    /// Of the runs from the fastest on, so that the faster ones alone have its first equations.
    equations: Cholesky,
}

impl<'a> Blend<'a> {
    /// Of one speed at least, with one of the shares that [`own_share`] gives.
    pub(super) fn of(speeds_m_per_s: &'a [f64], own: f64) -> Self {
        let last = speeds_m_per_s.len() - 1;
        let length_m_per_s = LENGTH * (speeds_m_per_s[last] - speeds_m_per_s[0]);
        let entry = |r: usize, c: usize| {
            let distance = speeds_m_per_s[last - r] - speeds_m_per_s[last - c];
            matern(distance, length_m_per_s) + if r == c { own } else { 0.0 }
        };
        let equations = Cholesky::of(last + 1, entry);
        Self { speeds_m_per_s, length_m_per_s, equations }
    }

    /// The weights of the runs from the `first` on, 0 for those before, at an impact speed; beyond the speeds
    /// of all runs those of the outermost. The runs from the `first` on say nothing about speeds below that of the one
    /// before. Their sum is 1. Of runs of one speed, `apart` from the query, those of the masses beside it are reproduced.
    pub(super) fn weights(
        &self,
        first: usize,
        speed_m_per_s: f64,
        apart: &[(f64, f64)],
    ) -> Vec<f64> {
        let all = self.speeds_m_per_s;
        let v = speed_m_per_s.clamp(all[first.saturating_sub(1)], all[all.len() - 1]);
        let mut weights = vec![0.0; all.len()];
        let smooth = |v: f64| self.smooth(all.len() - first, v);
        weights[first..].copy_from_slice(&smooth(v));
        let (low, high, share) = neighbours(all, v);
        for (run, nearness) in [(low, (1.0 - share).powi(2)), (high, share.powi(2))] {
            if nearness > 0.0 && all[first..].iter().any(|v| is_same_speed(*v, all[run])) {
                for (twin, share) in twins(all, apart, run, first) {
                    weights[twin] += nearness * share;
                }
                let slow = smooth(all[run]);
                weights[first..].iter_mut().zip(slow).for_each(|(w, slow)| *w -= nearness * slow);
            }
        }
        weights
    }

    /// The weights of so many of the fastest runs, by rising speed, of the smooth function at a speed.
    fn smooth(&self, runs: usize, v: f64) -> Vec<f64> {
        let alike = |run: &f64| matern(run - v, self.length_m_per_s);
        let right: Vec<f64> = self.speeds_m_per_s.iter().rev().take(runs).map(alike).collect();
        let known = self.equations.solve(&right);
        let of_mean = self.equations.solve(&vec![1.0; runs]);
        let lacking = (1.0 - known.iter().sum::<f64>()) / of_mean.iter().sum::<f64>();
        known.iter().zip(&of_mean).rev().map(|(known, mean)| known + lacking * mean).collect()
    }
}

/// The variance of what is a run's own under which values are most likely. Each of `values` has those of the fastest runs at one
/// place, the fastest first; the variance of the smooth function is alike where as many runs have a value.
pub(super) fn own_share(speeds_m_per_s: &[f64], values: &[Vec<f64>]) -> f64 {
    let likelihood = |own: f64| {
        let equations = Blend::of(speeds_m_per_s, own).equations;
        let of_runs = |runs: usize| {
            if !values.iter().any(|y| y.len() == runs) {
                return 0.0;
            }
            let ones = vec![1.0; runs];
            let of_mean = equations.solve(&ones);
            let precision: f64 = of_mean.iter().sum();
            let square = |y: &Vec<f64>| {
                let mean = y.iter().zip(&of_mean).map(|(y, w)| y * w).sum::<f64>() / precision;
                let rest: Vec<f64> = y.iter().map(|y| y - mean).collect();
                rest.iter().zip(equations.solve(&rest)).map(|(r, solved)| r * solved).sum::<f64>()
            };
            let own: Vec<f64> = values.iter().filter(|y| y.len() == runs).map(square).collect();
            let freedom = (runs - 1) as f64;
            let variance = own.iter().sum::<f64>() / (own.len() as f64 * freedom);
            let spread = freedom * libm::log(variance)
                + equations.log_determinant(runs)
                + libm::log(precision);
            if variance > 0.0 { -0.5 * own.len() as f64 * spread } else { 0.0 }
        };
        // Two runs say nothing of it.
        (3..=speeds_m_per_s.len()).map(of_runs).sum::<f64>()
    };
    let tried = OWN.map(|own| (own, likelihood(own) / VALUES_OF_STRETCH));
    let usual = (OWN[0], tried[0].1 + EVIDENCE);
    tried.into_iter().fold(usual, |best, next| if next.1 > best.1 { next } else { best }).0
}

/// The correlation of Matérn with ν = 5/2 over a distance; 1 where all speeds are the same.
fn matern(distance: f64, length: f64) -> f64 {
    if distance == 0.0 {
        return 1.0;
    }
    let x = 5.0_f64.sqrt() * distance.abs() / length;
    (1.0 + x + x * x / 3.0) * libm::exp(-x)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPEEDS: [f64; 5] = [3.0, 5.0, 7.0, 12.0, 20.0];
    /// Of queries that give no mass.
    const ALIKE: &[(f64, f64)] = &[(0.0, 0.0); 6];

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-12
    }

    #[test]
    fn weights_add_up_to_one_and_a_run_comes_out_as_it_is() {
        let blend = Blend::of(&SPEEDS, OWN[0]);
        for first in 0..SPEEDS.len() {
            for v in [1.0, 3.0, 4.2, 7.0, 15.0, 20.0, 40.0] {
                let weights = blend.weights(first, v, ALIKE);
                assert!(close(weights.iter().sum(), 1.0), "from {first} at {v}: {weights:?}");
                assert!(weights[..first].iter().all(|w| *w == 0.0));
            }
            for (run, &speed) in SPEEDS.iter().enumerate().skip(first) {
                let weights = blend.weights(first, speed, ALIKE);
                let is_run = |(i, w): (usize, &f64)| close(*w, if i == run { 1.0 } else { 0.0 });
                assert!(weights.iter().enumerate().all(is_run), "{run} from {first}: {weights:?}");
            }
        }
        assert_eq!(Blend::of(&[8.0], OWN[0]).weights(0, 9.0, ALIKE), [1.0]);
    }

    #[test]
    fn between_runs_a_smooth_function_is_followed_and_weights_are_continuous() {
        let blend = Blend::of(&SPEEDS, OWN[0]);
        let of = |v: f64| 1.0 + 0.05 * v - 0.001 * v * v;
        for v in [4.0, 6.0, 9.0, 16.0] {
            let weights = blend.weights(0, v, ALIKE);
            let found: f64 = weights.iter().zip(SPEEDS).map(|(w, s)| w * of(s)).sum();
            assert!((found / of(v) - 1.0).abs() < 0.01, "{found} instead of {} at {v}", of(v));
        }
        for v in SPEEDS {
            let (below, above) =
                (blend.weights(0, v - 1e-9, ALIKE), blend.weights(0, v + 1e-9, ALIKE));
            assert!(below.iter().zip(&above).all(|(b, a)| (b - a).abs() < 1e-6), "at {v}");
        }
    }

    /// Few fast runs used far below their speeds give no weights that would amplify their folds.
    #[test]
    fn weights_are_bounded_wherever_slower_runs_have_ended() {
        let speeds = [18.0, 25.0, 36.0, 48.0, 60.0, 72.0];
        let blend = Blend::of(&speeds, OWN[0]);
        for first in 0..speeds.len() {
            for v in (10..80).map(f64::from) {
                let weights = blend.weights(first, v, ALIKE);
                assert!(weights.iter().all(|w| w.abs() < 1.6), "from {first} at {v}: {weights:?}");
            }
        }
        // Three cases of one speed have equal weights.
        let equal = Blend::of(&[5.0; 3], OWN[0]).weights(0, 5.0, ALIKE);
        assert!(close(equal.iter().sum(), 1.0) && equal.iter().all(|w| w.is_finite()), "{equal:?}");
    }

    /// One run that stands out moves the middle between two runs by less than half.
    #[test]
    fn what_is_a_runs_own_fades_towards_its_neighbours() {
        let middle = Blend::of(&SPEEDS, OWN[0]).weights(0, 6.0, ALIKE);
        assert!(middle[1] < 0.5 && middle[2] < 0.5, "{middle:?}");
    }

    /// Values along a parabola have nothing of their own, values that alternate have as much as is tried.
    #[test]
    fn what_runs_have_of_their_own_is_seen() {
        let of = |odd: f64| {
            let value = |(i, v): (usize, &f64)| {
                10.0 + 0.4 * v - 0.01 * v * v + if i % 2 == 0 { odd } else { -odd }
            };
            let values: Vec<f64> = SPEEDS.iter().enumerate().map(value).rev().collect();
            own_share(&SPEEDS, &vec![values; 20])
        };
        assert_eq!([of(0.0), of(0.02), of(2.0)], [0.02, 0.02, 0.2]);
        assert_eq!(own_share(&SPEEDS, &[]), 0.02);
        assert_eq!(own_share(&[5.0], &[vec![1.0]]), 0.02);
    }
}
