//! Landmarks of curves: peaks and valleys, followed from speed to speed.

use super::CaseCurve;
use super::curves::least_squares;
use crate::piecewise;
use crate::signal::peaks::{PROMINENCE, peaks};

/// Landmarks of neighbouring cases match if they lie no further apart than this share of
/// the larger maximum crush.
const NEAR: f64 = 0.15;
/// Step at which curves are searched, as a share of their end.
const STEPS: usize = 500;
/// A change between neighbours that is this much larger than the typical one is a jump,
const JUMP: f64 = 3.0;
/// if it is also more than this share of the crush: smaller ones are scatter of the search.
const LEAST_JUMP: f64 = 0.03;
/// A curve's start and this last share of it are not landmarks: a force that still rises when
/// the body stops has not reached its peak.
const END: f64 = 0.02;
/// Slopes that a warp may have between landmarks.
const SLOPES: (f64, f64) = (0.25, 4.0);

/// One landmark over the cases that have it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Track {
    /// Case and deflection in m, in order of speed; at least two.
    positions: Vec<(usize, f64)>,
}

/// A landmark that is being followed down to slower cases.
struct Trail {
    is_peak: bool,
    /// Case and deflection, the fastest case first.
    positions: Vec<(usize, f64)>,
    /// Found in every case so far that is long enough to have it.
    alive: bool,
}

impl Trail {
    /// Case and deflection where it was last seen.
    fn at(&self) -> Option<(usize, f64)> {
        self.positions.last().copied()
    }
}

/// The one of `among` with the smallest value, if any is finite.
fn nearest(among: &[usize], value: impl Fn(usize) -> f64) -> Option<usize> {
    let best = among.iter().copied().min_by(|&a, &b| value(a).total_cmp(&value(b)))?;
    value(best).is_finite().then_some(best)
}

/// Landmarks matched over the cases, and where they jump.
#[derive(Clone, Debug, PartialEq, Default)]
pub(crate) struct Landmarks {
    tracks: Vec<Track>,
    /// Pairs of neighbouring cases between which the collapse changes its mode.
    pub jumps: Vec<(usize, usize)>,
}

/// Peaks and the valleys between them, by deflection: `(is a peak, deflection in m)`.
fn extrema(case: &CaseCurve) -> Vec<(bool, f64)> {
    let at = |i: usize| case.end_m() * i as f64 / STEPS as f64;
    let force: Vec<f64> = (0..=STEPS).map(|i| case.force_at(at(i))).collect();
    let mut tops = peaks(&force, PROMINENCE * case.envelope().peak_force_n());
    tops.retain(|&i| i > 0 && at(i) <= (1.0 - END) * case.end_m());
    let mut found = Vec::new();
    for (k, &top) in tops.iter().enumerate() {
        if k > 0 {
            let between = tops[k - 1]..=top;
            let lowest = between.min_by(|&a, &b| force[a].total_cmp(&force[b])).unwrap_or(top);
            found.push((false, at(lowest)));
        }
        found.push((true, at(top)));
    }
    found
}

impl Landmarks {
    /// Follows the landmarks of the fastest case down to the slowest. A landmark that a case
    /// should have, because it goes that far, but lacks is dropped for all cases.
    pub(crate) fn of(cases: &[CaseCurve]) -> Self {
        let Some(last) = cases.len().checked_sub(1) else { return Self::default() };
        let found: Vec<Vec<(bool, f64)>> = cases.iter().map(extrema).collect();
        let begin = |&(is_peak, d): &(bool, f64)| Trail {
            is_peak,
            positions: vec![(last, d)],
            alive: true,
        };
        let mut trails: Vec<Trail> = found[last].iter().map(begin).collect();
        for i in (0..last).rev() {
            let near = NEAR * cases[i].end_m().max(cases[i + 1].end_m());
            let live: Vec<usize> = (0..trails.len())
                .filter(|&k| trails[k].alive && trails[k].at().is_some_and(|(of, _)| of == i + 1))
                .collect();
            let distance = |k: usize, m: usize| -> f64 {
                let (is_peak, d) = found[i][m];
                match trails[k].at() {
                    Some((_, before)) if trails[k].is_peak == is_peak => (d - before).abs(),
                    _ => f64::INFINITY,
                }
            };
            let all: Vec<usize> = (0..found[i].len()).collect();
            // A pair matches if each is the other's nearest; a third one between the two has
            // no partner then, instead of taking that of its neighbour.
            let matches: Vec<(usize, Option<f64>)> = live
                .iter()
                .map(|&k| {
                    let mutual = nearest(&all, |m| distance(k, m))
                        .filter(|&m| nearest(&live, |k| distance(k, m)) == Some(k))
                        .filter(|&m| distance(k, m) <= near);
                    (k, mutual.map(|m| found[i][m].1))
                })
                .collect();
            for (k, matched) in matches {
                let before = trails[k].at().map_or(0.0, |(_, d)| d);
                match matched {
                    Some(d) => trails[k].positions.push((i, d)),
                    // It ends before the landmark, or about there.
                    None if cases[i].end_m() < before + near => {}
                    None => trails[k].alive = false,
                }
            }
        }
        let mut landmarks = Self::default();
        for Trail { mut positions, alive, .. } in trails {
            positions.reverse();
            if alive && positions.len() > 1 {
                landmarks.tracks.push(Track { positions });
            }
        }
        landmarks.find_jumps(cases);
        landmarks
    }

    /// Drops landmarks that jump and notes between which cases.
    fn find_jumps(&mut self, cases: &[CaseCurve]) {
        let changes = |track: &Track| -> Vec<(usize, f64)> {
            let change = |w: &[(usize, f64)]| {
                let by = cases[w[1].0].speed_m_per_s - cases[w[0].0].speed_m_per_s;
                (w[0].0, (w[1].1 - w[0].1).abs() / by)
            };
            track.positions.windows(2).map(change).collect()
        };
        let mut all: Vec<f64> =
            self.tracks.iter().flat_map(&changes).map(|(_, change)| change).collect();
        if all.len() < 3 {
            return;
        }
        all.sort_by(f64::total_cmp);
        let typical = all[all.len() / 2];
        let mut jumps = Vec::new();
        self.tracks.retain(|track| {
            let jumping: Vec<usize> = changes(track)
                .into_iter()
                .filter(|&(i, change)| {
                    let by = cases[i + 1].speed_m_per_s - cases[i].speed_m_per_s;
                    change > JUMP * typical && change * by > LEAST_JUMP * cases[i + 1].end_m()
                })
                .map(|(i, _)| i)
                .collect();
            jumps.extend(jumping.iter().map(|&i| (i, i + 1)));
            jumping.is_empty()
        });
        jumps.sort_unstable();
        jumps.dedup();
        self.jumps = jumps;
    }

    /// Where the landmarks lie at speed `v`, with their track, in order of deflection.
    pub(crate) fn at(&self, cases: &[CaseCurve], v: f64) -> Vec<(usize, f64)> {
        let mut found: Vec<(usize, f64)> = self
            .tracks
            .iter()
            .enumerate()
            .filter_map(|(k, track)| {
                let points: Vec<(f64, f64)> =
                    track.positions.iter().map(|&(i, d)| (cases[i].speed_m_per_s, d)).collect();
                let (low, high) = (points.first()?.0, points.last()?.0);
                // Beyond the speeds that have it a parabola would run away.
                let degree = if (low..=high).contains(&v) { (points.len() - 1).min(2) } else { 1 };
                let d = least_squares(&points, degree)?.at(v);
                (d > 0.0).then_some((k, d))
            })
            .collect();
        found.sort_by(|a, b| a.1.total_cmp(&b.1));
        found
    }

    /// Position of track `k` in a case, if it has it.
    pub(crate) fn position(&self, k: usize, case: usize) -> Option<f64> {
        self.tracks[k].positions.iter().find(|p| p.0 == case).map(|p| p.1)
    }
}

/// A monotone piecewise linear map of deflections that keeps 0 and continues with slope 1
/// beyond its last landmark.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Warp {
    from_m: Vec<f64>,
    to_m: Vec<f64>,
}

impl Warp {
    /// From pairs of landmarks `(from, to)` in m, in order of `from`. A pair that would
    /// stretch or squeeze its neighbourhood by more than a factor of four is left out.
    pub(crate) fn new(pairs: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let (mut from_m, mut to_m) = (vec![0.0], vec![0.0]);
        let mut last = (0.0, 0.0);
        for (from, to) in pairs {
            let slope = (to - last.1) / (from - last.0);
            if from > last.0 && (SLOPES.0..=SLOPES.1).contains(&slope) {
                from_m.push(from);
                to_m.push(to);
                last = (from, to);
            }
        }
        Self { from_m, to_m }
    }

    pub(crate) fn at(&self, d: f64) -> f64 {
        let (from, to) = (&self.from_m, &self.to_m);
        let last = from.len() - 1;
        if last == 0 || d >= from[last] {
            return to[last] + (d - from[last]);
        }
        piecewise::by_product(from, to, piecewise::segment(from, d), d)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A base with two humps at given places, to a given end.
    fn humps(speed: f64, places: &[f64], end: f64) -> CaseCurve {
        let d: Vec<f64> = (0..=400).map(|i| end * f64::from(i) / 400.0).collect();
        let hump = |d: f64, at: f64| (-((d - at) / 0.05).powi(2)).exp();
        let f = d.iter().map(|&d| 1e6 + places.iter().map(|&p| 1e6 * hump(d, p)).sum::<f64>());
        CaseCurve::new(speed, vec![], d.clone(), f.collect(), vec![]).unwrap()
    }

    #[test]
    fn landmarks_are_followed_and_interpolated() {
        let cases = [
            humps(10.0, &[0.2], 0.4),
            humps(14.0, &[0.24, 0.6], 0.9),
            humps(20.0, &[0.30, 0.66], 1.2),
        ];
        let landmarks = Landmarks::of(&cases);
        let at: Vec<f64> = landmarks.at(&cases, 12.0).iter().map(|l| l.1).collect();
        assert!((at[0] - 0.22).abs() < 3e-3, "{at:?}");
        assert!(landmarks.jumps.is_empty());
        // The second hump is not reached at 10 m/s, and that is no reason to drop it.
        assert!(at.iter().any(|d| (d - 0.58).abs() < 5e-3), "{at:?}");
    }

    /// A hump that only the fastest case has does not take its neighbour's partner.
    #[test]
    fn landmarks_that_stand_alone_are_dropped() {
        let cases = [humps(10.0, &[0.6], 1.0), humps(20.0, &[0.42, 0.66], 1.0)];
        let at: Vec<f64> = Landmarks::of(&cases).at(&cases, 15.0).iter().map(|l| l.1).collect();
        assert_eq!(at.len(), 1);
        assert!((at[0] - 0.63).abs() < 3e-3, "{at:?}");
    }

    #[test]
    fn a_jump_is_found_and_not_warped_across() {
        let cases = [
            humps(10.0, &[0.20, 0.50], 1.0),
            humps(12.0, &[0.205, 0.51], 1.0),
            humps(14.0, &[0.21, 0.52], 1.0),
            humps(16.0, &[0.215, 0.62], 1.0),
        ];
        let landmarks = Landmarks::of(&cases);
        assert_eq!(landmarks.jumps, [(2, 3)]);
        let at: Vec<f64> = landmarks.at(&cases, 15.0).iter().map(|l| l.1).collect();
        assert!(at.iter().all(|d| (d - 0.57).abs() > 0.04), "{at:?}");
    }

    #[test]
    fn warps_are_monotone() {
        let warp = Warp::new([(0.2, 0.3), (0.21, 0.9), (0.4, 0.6)]);
        assert_eq!(warp.at(0.1), 0.15);
        assert!((warp.at(0.3) - 0.45).abs() < 1e-12, "the pair that folds is left out");
        assert!((warp.at(1.0) - 1.2).abs() < 1e-12);
        assert_eq!(Warp::new([]).at(0.7), 0.7);
    }
}
