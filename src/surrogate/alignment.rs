//! Curves whose events move with the impact speed, brought into line before they are blended.
//!
//! Where a fold, a stage or a step begins at another deflection in each run, a blend at equal deflection makes two half steps.
//! Neighbouring runs are therefore aligned by the shift `s(d)` of the faster one that makes
//! `∫ ((q_slow(d) − q_fast(d + s))/q̄)² + s'² dd` smallest, by dynamic programming (time warping: Sakoe and Chiba, IEEE Trans.
//! Acoustics 26, 1978, here with a price per slope besides the window). An event at another speed lies where the straight line over the speed
//! between its places in the two neighbouring runs has it. As it may lie anywhere between these places, the blend is averaged
//! over a length that is as long as their distance in the middle between two speeds, and 0 at the speed of a run.
//!
//! On structures whose events keep their places no pair is aligned, and nothing changes.
//!
//! Tried and dropped: to follow the run nearer in speed where the collapse mode changes, instead of the blend. With speeds of
//! the staged front left out, force, crush, velocity and acceleration all became worse: half of the blend's error is certain, but
//! the whole of the other branch's is as likely.

use super::CaseCurve;
use super::curves::{LEAST_WAY_M, Twins, mean_over, neighbouring};
use crate::curve::group::LEAST_RATIO;
use crate::dataset::is_same_speed;
use crate::piecewise;

/// A pair is aligned if that takes so much away from the mean square of its differences, relative to the level, after the price of the
/// shift: a tenth of the level, RMS.
const GAIN: f64 = 0.01;
/// Steps to the end of the longer curve of a pair. Shifts are whole steps.
const STEPS: usize = 500;
/// Steps between two nodes of the shift.
const NODE: usize = 4;
/// Largest slope of the shift, in steps per node: the place of an event in one run grows at least half as fast as in the other.
const SLOPE: usize = 2;
/// Largest shift, as a share of the end of the longer curve.
const MOST: f64 = 0.15;

/// A shift over speed that is so many times the usual one of a group, and more than a share of the crush, is a jump.
const JUMP: f64 = 3.0;
const LEAST_JUMP: f64 = 0.03;
/// Curves that still differ by this much of their level, RMS, once they are aligned collapse in different modes.
const UNLIKE: f64 = 0.25;

/// A common coordinate of the curves of a group: the deflection that the fastest run has at the same event.
#[derive(Clone, Debug)]
pub(super) struct Alignment {
    /// The curves over the common coordinate, in m.
    pub curves: Vec<CaseCurve>,
    /// Each curve's own deflection over the common coordinate, in m.
    places: Vec<Warp>,
}

impl Alignment {
    /// Of curves in order of speed, by what `level_n` gives as the comparable force of a curve at a deflection.
    /// `None` if no event moves.
    pub(super) fn of(cases: &[CaseCurve], level_n: impl Fn(usize, f64) -> f64) -> Option<Self> {
        let pair = |i: usize| {
            let by =
                |curve: usize| Sampled { end_m: cases[curve].end_m(), level_n: &level_n, curve };
            Pair::of(&by(i), &by(i + 1))
        };
        let pairs: Vec<Pair> = (0..cases.len().saturating_sub(1)).map(pair).collect();
        let shifts: Vec<Option<Warp>> = pairs.into_iter().map(|pair| pair.to_faster).collect();
        if shifts.iter().all(Option::is_none) {
            return None;
        }
        let mut places = vec![Warp::default()];
        for to_faster in shifts.iter().rev() {
            let faster = &places[places.len() - 1];
            let place = match to_faster {
                Some(to_faster) => faster.then(&to_faster.inverse()),
                None => faster.clone(),
            };
            places.push(place);
        }
        places.reverse();
        let curves = cases.iter().zip(&places).map(|(case, own)| {
            let common = own.inverse();
            case.placed(|d| common.at(d))
        });
        Some(Self { curves: curves.collect::<Option<_>>()?, places })
    }

    /// The blend `force_n` of the aligned curves, at an impact speed along increasing deflections in m.
    pub(super) fn blended_n(
        &self,
        at: (f64, &[f64]),
        deflection_m: &[f64],
        force_n: impl Fn(&[CaseCurve], &[f64]) -> Vec<f64>,
    ) -> Vec<f64> {
        let (low, high, share) = neighbouring(&self.curves, at);
        let of = |[(a, _), (b, share)]: Twins| match share > 0.0 {
            true => self.places[a].between(&self.places[b], share),
            false => self.places[a].clone(),
        };
        let (low, high) = (of(low), of(high));
        let place = low.between(&high, share).inverse();
        let common_m: Vec<f64> = deflection_m.iter().map(|&d| place.at(d)).collect();
        let blend_n = force_n(&self.curves, &common_m);
        let parabola = (share * (1.0 - share)).sqrt();
        let half_m = |i: usize| {
            let apart_m = low.at(common_m[i]) - high.at(common_m[i]);
            apart_m.abs() * parabola
        };
        mean_over(deflection_m, &blend_n, half_m)
    }
}

/// One curve as a function of the deflection.
struct Sampled<'a, F: Fn(usize, f64) -> f64> {
    end_m: f64,
    level_n: &'a F,
    curve: usize,
}

impl<F: Fn(usize, f64) -> f64> Sampled<'_, F> {
    fn along(&self, step_m: f64) -> Vec<f64> {
        let count = (self.end_m / step_m) as usize;
        (0..=count).map(|i| (self.level_n)(self.curve, i as f64 * step_m)).collect()
    }
}

/// Pairs of neighbouring curves between which the collapse mode changes: they differ by more than a shift, or by a much larger
/// one than the other pairs, or the faster one is weaker, where rate and inertia only add.
pub(super) fn mode_switches(cases: &[CaseCurve]) -> Vec<(usize, usize)> {
    let pair = |i: usize| {
        let end_m = cases[i].end_m().min(cases[i + 1].end_m());
        // A higher level at the higher speed is not a change of mode.
        let level = |curve: usize| cases[curve].envelope().work_to(end_m) / end_m;
        let levels = [level(i), level(i + 1)];
        let relative = |curve: usize, d: f64| cases[curve].force_at(d) / levels[curve - i];
        let by = |curve: usize| Sampled { end_m: cases[curve].end_m(), level_n: &relative, curve };
        (Pair::of(&by(i), &by(i + 1)), levels[1] < LEAST_RATIO * levels[0])
    };
    let speed = |i: usize| cases[i].speed_m_per_s;
    // Runs of other masses may have the same speed.
    let slow: Vec<usize> = (0..cases.len().saturating_sub(1))
        .filter(|&i| !is_same_speed(speed(i), speed(i + 1)))
        .collect();
    let (pairs, is_weaker): (Vec<Pair>, Vec<bool>) = slow.iter().map(|&i| pair(i)).unzip();
    let mut rates: Vec<f64> =
        slow.iter().zip(&pairs).map(|(&i, p)| p.most_m() / (speed(i + 1) - speed(i))).collect();
    let of: Vec<f64> = rates.clone();
    rates.sort_by(f64::total_cmp);
    let usual = rates.get(rates.len() / 2).copied().unwrap_or(0.0);
    let switches = |&k: &usize| {
        let jumps = pairs.len() > 2
            && of[k] > JUMP * usual
            && pairs[k].most_m() > LEAST_JUMP * cases[slow[k] + 1].end_m();
        jumps || pairs[k].rest > UNLIKE || is_weaker[k]
    };
    (0..pairs.len()).filter(switches).map(|k| (slow[k], slow[k] + 1)).collect()
}

/// Two neighbouring curves.
struct Pair {
    /// The place in the faster curve of what lies at a deflection of the slower one; `None` if the two need no shift.
    to_faster: Option<Warp>,
    /// Root mean square difference that is left, relative to the level.
    rest: f64,
}

impl Pair {
    /// The largest shift in m.
    fn most_m(&self) -> f64 {
        let of = |warp: &Warp| {
            warp.from_m.iter().zip(&warp.to_m).map(|(a, b)| (b - a).abs()).fold(0.0, f64::max)
        };
        self.to_faster.as_ref().map_or(0.0, of)
    }

    fn of<F: Fn(usize, f64) -> f64>(slow: &Sampled<'_, F>, fast: &Sampled<'_, F>) -> Self {
        let step_m = slow.end_m.max(fast.end_m) / STEPS as f64;
        let (slow, fast) = (slow.along(step_m), fast.along(step_m));
        let overlap = slow.len().min(fast.len());
        let level_n =
            slow.iter().chain(&fast[..overlap]).sum::<f64>() / (slow.len() + overlap) as f64;
        let unshifted = |rest: f64| Self { to_faster: None, rest };
        if level_n.is_nan() || level_n <= 0.0 {
            return unshifted(0.0);
        }
        // Costs in steps.
        let misfit = |i: usize, j: usize| ((slow[i] - fast[j]) / level_n).powi(2);
        let nodes = (slow.len() - 1) / NODE;
        // A shift must not push what differs off the end of the faster curve: what that reaches only unshifted is compared there. What it
        // never reaches is not compared.
        let compared = (overlap - 1).min(nodes * NODE);
        let shifted_misfit = |i: usize, j: usize| match (j < fast.len(), i <= compared) {
            (true, _) => misfit(i, j),
            (false, true) => misfit(i, i),
            (false, false) => 0.0,
        };
        let unaligned: f64 = (1..=compared).map(|i| misfit(i, i)).sum();
        let enough = GAIN * compared as f64;
        let rms = |sum: f64| (sum / compared.max(1) as f64).sqrt();
        if unaligned < enough || nodes == 0 {
            return unshifted(rms(unaligned));
        }
        let most = (MOST * STEPS as f64) as usize;
        // Entry k is the shift k − most.
        let mut least = vec![f64::INFINITY; 2 * most + 1];
        least[most] = 0.0;
        let mut from = Vec::with_capacity(nodes);
        for node in 1..=nodes {
            let (mut next, mut steps) = (vec![f64::INFINITY; least.len()], vec![0_u8; least.len()]);
            for (k, (next, steps)) in next.iter_mut().zip(&mut steps).enumerate() {
                // From a shift that is smaller by `turn − SLOPE` steps.
                for turn in 0..=2 * SLOPE {
                    let Some(before) = (k + SLOPE).checked_sub(turn).and_then(|k| least.get(k))
                    else {
                        continue;
                    };
                    let slope = (turn as f64 - SLOPE as f64) / NODE as f64;
                    let cost = before + NODE as f64 * slope * slope;
                    if cost < *next {
                        (*next, *steps) = (cost, turn as u8);
                    }
                }
                for i in (node - 1) * NODE + 1..=node * NODE {
                    let Some(j) = (i + k).checked_sub(most) else {
                        *next = f64::INFINITY;
                        continue;
                    };
                    *next += shifted_misfit(i, j);
                }
            }
            least = next;
            from.push(steps);
        }
        let (mut k, cost) =
            (0..least.len()).map(|k| (k, least[k])).fold((most, f64::INFINITY), |best, next| {
                if next.1 < best.1 { next } else { best }
            });
        if unaligned - cost < enough {
            return unshifted(rms(unaligned));
        }
        let mut left = 0.0;
        let mut shifted = Warp { from_m: Vec::new(), to_m: Vec::new() };
        for node in (0..=nodes).rev() {
            let at = (node * NODE) as f64;
            shifted.from_m.push(at * step_m);
            shifted.to_m.push((at + k as f64 - most as f64) * step_m);
            if node > 0 {
                let compared = (node - 1) * NODE + 1..=node * NODE;
                let pairs = compared.filter_map(|i| Some((i, (i + k).checked_sub(most)?)));
                left += pairs.map(|(i, j)| shifted_misfit(i, j)).sum::<f64>();
                k = k + SLOPE - usize::from(from[node - 1][k]);
            }
        }
        shifted.from_m.reverse();
        shifted.to_m.reverse();
        Self { to_faster: Some(shifted), rest: rms(left) }
    }
}

/// A growing, piecewise linear map of deflections, with slope 1 beyond its ends.
#[derive(Clone, Debug)]
struct Warp {
    from_m: Vec<f64>,
    to_m: Vec<f64>,
}

impl Default for Warp {
    fn default() -> Self {
        Self { from_m: vec![0.0], to_m: vec![0.0] }
    }
}

impl Warp {
    fn at(&self, d: f64) -> f64 {
        let (from, to) = (&self.from_m, &self.to_m);
        let last = from.len() - 1;
        if last == 0 || d >= from[last] {
            return to[last] + (d - from[last]);
        }
        piecewise::by_product(from, to, piecewise::segment(from, d), d)
    }

    fn inverse(&self) -> Self {
        Self { from_m: self.to_m.clone(), to_m: self.from_m.clone() }
    }

    /// First this, then `next`.
    fn then(&self, next: &Self) -> Self {
        let back = self.inverse();
        let mut from_m: Vec<f64> = self.from_m.clone();
        from_m.extend(next.from_m.iter().map(|&d| back.at(d)));
        from_m.sort_by(f64::total_cmp);
        from_m.dedup_by(|a, b| *a - *b < LEAST_WAY_M);
        let to_m = from_m.iter().map(|&d| next.at(self.at(d))).collect();
        Self { from_m, to_m }
    }

    /// The map a share of the way from this one to another.
    fn between(&self, other: &Self, share: f64) -> Self {
        let mut from_m: Vec<f64> = [&self.from_m[..], &other.from_m].concat();
        from_m.sort_by(f64::total_cmp);
        from_m.dedup_by(|a, b| *a - *b < LEAST_WAY_M);
        let to = |&d: &f64| (1.0 - share) * self.at(d) + share * other.at(d);
        let to_m = from_m.iter().map(to).collect();
        Self { from_m, to_m }
    }
}

#[cfg(test)]
mod tests {
    use super::super::curves::neighbours;
    use super::*;

    /// A plateau, and a step to three times its force at a place.
    fn step(speed_m_per_s: f64, place_m: f64) -> CaseCurve {
        let d: Vec<f64> = (0..=500).map(|i| f64::from(i) / 500.0).collect();
        let f = |&d: &f64| 1e6 * (1.0 + 2.0 * ((d - place_m) / 0.02).clamp(0.0, 1.0));
        let force_n = d.iter().map(f).collect();
        CaseCurve::new(speed_m_per_s, vec![], d, force_n, vec![]).unwrap()
    }

    fn aligned(cases: &[CaseCurve]) -> Option<Alignment> {
        Alignment::of(cases, |i, d| cases[i].force_at(d))
    }

    /// As linear blending of the neighbours has it.
    fn between(cases: &[CaseCurve], v: f64, d: &[f64]) -> Vec<f64> {
        let speeds: Vec<f64> = cases.iter().map(|c| c.speed_m_per_s).collect();
        let (low, high, share) = neighbours(&speeds, v);
        let of =
            |d: &f64| (1.0 - share) * cases[low].force_at(*d) + share * cases[high].force_at(*d);
        d.iter().map(of).collect()
    }

    #[test]
    fn a_step_that_moves_lies_between_its_places() {
        let cases = [step(10.0, 0.40), step(12.0, 0.50), step(14.0, 0.52)];
        let alignment = aligned(&cases).unwrap();
        let at = |v: f64, d: f64| {
            let along: Vec<f64> = (0..=1000).map(|i| f64::from(i) / 1000.0).collect();
            let force_n = alignment.blended_n((v, &[]), &along, |cases, d| between(cases, v, d));
            force_n[(d * 1000.0).round() as usize]
        };
        // Half as high in the middle of the step, halfway between 0.40 and 0.50; as wide as the places are apart.
        for (v, d, expected_n) in [
            (11.0, 0.46, 2e6),
            (11.0, 0.38, 1e6),
            (11.0, 0.54, 3e6),
            // At the speed of a run the run itself.
            (10.0, 0.405, 1.5e6),
            (10.0, 0.395, 1e6),
            (14.0, 0.545, 3e6),
        ] {
            let found_n = at(v, d);
            assert!((found_n - expected_n).abs() < 0.08e6, "{found_n} N at {d} m and {v} m/s");
        }
    }

    #[test]
    fn curves_whose_events_stay_are_left_alone() {
        let higher = |c: CaseCurve| c.map_forces(|_, f| 1.08 * f);
        assert!(aligned(&[step(10.0, 0.4), step(12.0, 0.4), higher(step(14.0, 0.4))]).is_none());
        assert!(aligned(&[step(10.0, 0.4)]).is_none());
        assert!(aligned(&[]).is_none());
    }

    /// A step that a run lacks is not pushed off its end.
    #[test]
    fn what_only_one_curve_has_is_not_shifted_away() {
        for end_m in [0.95, 1.0, 1.02] {
            let d: Vec<f64> = (0..=500).map(|i| end_m * f64::from(i) / 500.0).collect();
            let flat = CaseCurve::new(12.0, vec![], d, vec![1e6; 501], vec![]).unwrap();
            assert!(aligned(&[step(10.0, 0.88), flat.clone()]).is_none(), "{end_m}");
            // Nor is the first point a shift.
            let spike = flat.map_forces(|d, f| if d == 0.0 { 30e6 } else { f });
            let mut slow = flat;
            slow.speed_m_per_s = 10.0;
            assert!(aligned(&[slow, spike]).is_none());
        }
    }

    #[test]
    fn a_step_that_jumps_is_a_change_of_mode() {
        let places = [0.30, 0.31, 0.32, 0.43, 0.44];
        let cases: Vec<CaseCurve> =
            (10..).zip(places).map(|(v, place)| step(f64::from(v), place)).collect();
        assert_eq!(mode_switches(&cases), [(2, 3)]);
        let steady: Vec<CaseCurve> =
            (10..16).map(|v| step(f64::from(v), 0.3 + 0.05 * f64::from(v - 10))).collect();
        assert_eq!(mode_switches(&steady), []);
        // A hump that only one of two has is not a shift.
        let hump = |d: f64, f: f64| f + 4e6 * (-((d - 0.7) / 0.1_f64).powi(2)).exp();
        let pair = [step(10.0, 0.9), step(12.0, 0.9).map_forces(hump)];
        assert_eq!(mode_switches(&pair), [(0, 1)]);
        // Nothing but another mode makes a structure weaker at a higher speed.
        let times = |factor: f64| [step(10.0, 0.9), step(12.0, 0.9).map_forces(|_, f| factor * f)];
        assert_eq!(mode_switches(&times(0.8)), [(0, 1)]);
        assert_eq!(mode_switches(&times(0.95)), []);
        assert_eq!(mode_switches(&times(1.3)), []);
    }

    #[test]
    fn warps_are_undone_by_their_inverse() {
        let a = Warp { from_m: vec![0.0, 0.4, 1.0], to_m: vec![0.0, 0.5, 1.1] };
        let b = Warp { from_m: vec![0.0, 0.3, 0.9], to_m: vec![0.0, 0.2, 0.8] };
        for d in [0.0, 0.1, 0.35, 0.6, 0.95, 1.4] {
            assert!((a.inverse().at(a.at(d)) - d).abs() < 1e-12);
            assert!((a.then(&b).at(d) - b.at(a.at(d))).abs() < 1e-12, "{d}");
            assert!((a.between(&b, 0.25).at(d) - (0.75 * a.at(d) + 0.25 * b.at(d))).abs() < 1e-12);
        }
    }
}
