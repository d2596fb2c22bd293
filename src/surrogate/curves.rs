//! The training curves of a model, one force of each case, and how they are blended.

use std::borrow::Cow;

use crate::curve::Envelope;
use crate::dataset::is_same_speed;
use crate::error::{Error, ErrorCode};
use crate::order;

/// One force of one training case over its loading branch.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CaseCurve {
    pub speed_m_per_s: f64,
    /// Values of the further features.
    pub features: Vec<f64>,
    /// Whether the run ended while loading, so that the curve is its beginning.
    pub truncated: bool,
    envelope: Envelope,
    /// Closing speed in m/s over deflection, if it is known: an envelope by its shape.
    closing: Option<Envelope>,
}

impl CaseCurve {
    pub(crate) fn new(
        speed_m_per_s: f64,
        features: Vec<f64>,
        deflection_m: Vec<f64>,
        force_n: Vec<f64>,
        closing_m_per_s: Vec<f64>,
    ) -> Result<Self, Error> {
        let closing = if closing_m_per_s.is_empty() {
            None
        } else {
            Some(
                Envelope::new(deflection_m.clone(), closing_m_per_s)
                    .map_err(|e| e.coded(ErrorCode::Model))?,
            )
        };
        let envelope =
            Envelope::new(deflection_m, force_n).map_err(|e| e.coded(ErrorCode::Model))?;
        Ok(Self { speed_m_per_s, features, truncated: false, envelope, closing })
    }

    pub(crate) fn envelope(&self) -> &Envelope {
        &self.envelope
    }

    /// The same curve with forces in N made of its deflections and forces, which are finite.
    pub(crate) fn map_forces(&self, force_n: impl Fn(f64, f64) -> f64) -> Self {
        let (d, f) = (self.envelope.deflection_m(), self.envelope.force_n());
        let mapped = d.iter().zip(f).map(|(&d, &f)| force_n(d, f)).collect();
        // Deflections are those of an envelope already.
        let envelope = Envelope::new(d.to_vec(), mapped).unwrap_or_else(|_| self.envelope.clone());
        Self { envelope, ..self.clone() }
    }

    /// The same curve with further points on its lines, at these deflections in m.
    pub(crate) fn with_points(&self, at_m: impl Iterator<Item = f64>) -> Self {
        let mut d = self.envelope.deflection_m().to_vec();
        // The first and the last point stay.
        let inside = LEAST_WAY_M..self.end_m() - LEAST_WAY_M;
        d.extend(at_m.filter(|at_m| inside.contains(at_m)));
        d.sort_by(f64::total_cmp);
        d.dedup_by(|next, d| *next - *d < LEAST_WAY_M);
        let force_n = d.iter().map(|&d| self.force_at(d)).collect();
        let envelope = Envelope::new(d, force_n).unwrap_or_else(|_| self.envelope.clone());
        Self { envelope, ..self.clone() }
    }

    /// The same forces and speeds at the deflections that a growing map makes of its own.
    pub(crate) fn placed(&self, to_m: impl Fn(f64) -> f64) -> Option<Self> {
        let placed = |e: &Envelope| {
            let to_m = e.deflection_m().iter().map(|&d| to_m(d)).collect();
            Envelope::new(to_m, e.force_n().to_vec()).ok()
        };
        let closing = match &self.closing {
            Some(closing) => Some(placed(closing)?),
            None => None,
        };
        Some(Self { envelope: placed(&self.envelope)?, closing, ..self.clone() })
    }

    /// Force in N; the last one beyond the end.
    pub(crate) fn force_at(&self, deflection_m: f64) -> f64 {
        self.envelope.force_at(deflection_m)
    }

    /// Maximum deflection, in m.
    pub(crate) fn end_m(&self) -> f64 {
        self.envelope.end_m()
    }

    pub(crate) fn reaches(&self, deflection_m: f64) -> bool {
        deflection_m <= self.end_m()
    }

    /// Closing speed in m/s; 0 beyond the end, and the impact speed where it is not known.
    pub(crate) fn closing_at(&self, deflection_m: f64) -> f64 {
        match &self.closing {
            None => self.speed_m_per_s,
            Some(_) if !self.reaches(deflection_m) => 0.0,
            Some(closing) => closing.force_at(deflection_m).max(0.0),
        }
    }
}

/// Means of a force, given at increasing deflections from 0 on or later, over `half_m` to both sides of each. Before the contact the force
/// is taken for the opposite of that after it, so that it still begins at 0.
pub(super) fn mean_over(
    along_m: &[f64],
    force_n: &[f64],
    half_m: impl Fn(usize) -> f64,
) -> Vec<f64> {
    let (mut d, mut f) = (along_m.to_vec(), force_n.to_vec());
    if d.first().is_some_and(|d| *d > 0.0) {
        d.insert(0, 0.0);
        f.insert(0, force_n[0]);
    }
    // One point, or a force that is not a number, has no mean.
    let (Some(&end_m), Ok(force)) = (along_m.last(), Envelope::new(d, f)) else {
        return force_n.to_vec();
    };
    let mean_n = |(i, (&d, &f)): (usize, (&f64, &f64))| {
        let half_m = half_m(i).min(end_m - d);
        if half_m > LEAST_WAY_M {
            (force.work_to(d + half_m) - force.work_to((d - half_m).abs())) / (2.0 * half_m)
        } else {
            f
        }
    };
    along_m.iter().zip(force_n).enumerate().map(mean_n).collect()
}

/// Over a shorter way a mean is the force itself, and the difference of works their rounding.
pub(super) const LEAST_WAY_M: f64 = 1e-6;

/// The two neighbours of `v` among increasing speeds and the share of the second, 0 to 1:
/// beyond the ends the outermost alone. Of equal speeds, the last, that of the heaviest body, counts.
pub(crate) fn neighbours(speeds: &[f64], v: f64) -> (usize, usize, f64) {
    let above = speeds.partition_point(|&s| s <= v);
    match above {
        0 => (0, 0, 0.0),
        n if n == speeds.len() => (n - 1, n - 1, 0.0),
        n => {
            let high = speeds.partition_point(|&s| s <= speeds[n]) - 1;
            // Speeds that differ by rounding are one.
            if is_same_speed(speeds[n - 1], speeds[n]) {
                return (n - 1, n - 1, 0.0);
            }
            (n - 1, high, (v - speeds[n - 1]) / (speeds[n] - speeds[n - 1]))
        }
    }
}

/// Runs of one speed that stand for it, with their shares, which add up to 1: of the masses on both sides of the query's.
pub(super) type Twins = [(usize, f64); 2];

/// The two neighbours as [`neighbours`] has them, with the runs of each that have the masses on both sides of the query's.
pub(super) fn neighbouring(
    cases: &[CaseCurve],
    (v, features): (f64, &[f64]),
) -> (Twins, Twins, f64) {
    let speeds: Vec<f64> = cases.iter().map(|c| c.speed_m_per_s).collect();
    let (low, high, share) = neighbours(&speeds, v);
    let apart = apart(cases, features);
    let of = |run| twins(&speeds, &apart, run, 0);
    (of(low), of(high), share)
}

/// By how much the masses of each run, its features, exceed those of a query, as logarithms: their sum, and that of their
/// magnitudes; 0 where the query gives none.
pub(super) fn apart(cases: &[CaseCurve], features: &[f64]) -> Vec<(f64, f64)> {
    let of = |case: &CaseCurve| {
        let pairs = case.features.iter().zip(features);
        let off = pairs.map(|(run, asked)| libm::log(run / asked));
        off.fold((0.0, 0.0), |(sum, all), off| (sum + off, all + off.abs()))
    };
    cases.iter().map(of).collect()
}

/// Of the runs from the `first` on at the speed of one of them, those that stand for it.
pub(super) fn twins(speeds: &[f64], apart: &[(f64, f64)], run: usize, first: usize) -> Twins {
    let all = || (first..speeds.len()).filter(|&i| is_same_speed(speeds[i], speeds[run]));
    let alone = |i| [(i, 1.0), (i, 0.0)];
    let by_sum = |a: &usize, b: &usize| apart[*a].0.total_cmp(&apart[*b].0);
    let same = all().rfind(|&i| apart[i].1 == 0.0);
    let lighter = all().filter(|&i| apart[i].0 <= 0.0).max_by(by_sum);
    let heavier = all().filter(|&i| apart[i].0 > 0.0).min_by(by_sum);
    match (same, lighter, heavier) {
        (Some(i), ..) | (None, Some(i), None) | (None, None, Some(i)) => alone(i),
        (None, Some(a), Some(b)) => {
            let share = apart[a].0 / (apart[a].0 - apart[b].0);
            [(a, 1.0 - share), (b, share)]
        }
        (None, None, None) => alone(run),
    }
}

/// Most runs that answer a query together: with more of them the cost would grow with the third power of their number.
const MOST_RUNS: usize = 20;

/// Indices of the curves that answer at a speed, in their order: all, or of more than 20 the ten around it and ten that are spread
/// over the others.
fn answering(speeds: &[f64], v: f64) -> Vec<usize> {
    let all = speeds.len();
    if all <= MOST_RUNS {
        return (0..all).collect();
    }
    let near = MOST_RUNS / 2;
    let first = speeds.partition_point(|s| *s < v).saturating_sub(near / 2).min(all - near);
    let others = all - near;
    let spread = (0..MOST_RUNS - near).map(|k| k * (others - 1) / (MOST_RUNS - near - 1));
    // Counted without those around the speed.
    let spread = spread.map(|i| if i < first { i } else { i + near });
    let mut chosen: Vec<usize> = spread.chain(first..first + near).collect();
    chosen.sort_unstable();
    chosen
}

/// The curves that answer at a speed.
pub(super) fn answering_at<'a>(cases: &'a [CaseCurve], at: (f64, &[f64])) -> Cow<'a, [CaseCurve]> {
    if cases.len() <= MOST_RUNS {
        return Cow::Borrowed(cases);
    }
    let speeds: Vec<f64> = cases.iter().map(|c| c.speed_m_per_s).collect();
    let mut chosen = answering(&speeds, at.0);
    let (low, high, _) = neighbouring(cases, at);
    chosen.extend(low.iter().chain(&high).filter(|(_, share)| *share > 0.0).map(|(i, _)| i));
    chosen.sort_unstable();
    chosen.dedup();
    chosen.into_iter().map(|i| cases[i].clone()).collect()
}

/// Points in order of x, with one mean of those of equal x.
pub(super) fn mean_points(points: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    let mut points: Vec<(f64, f64)> = points.collect();
    order::sort(&mut points, |a, b| a.0.total_cmp(&b.0));
    let mut known: Vec<(f64, f64, f64)> = Vec::new();
    for (x, y) in points {
        match known.last_mut() {
            Some(last) if last.0 == x => {
                last.1 += y;
                last.2 += 1.0;
            }
            _ => known.push((x, y, 1.0)),
        }
    }
    known.into_iter().map(|(x, sum, n)| (x, sum / n)).collect()
}

/// Linear interpolation over points of increasing abscissa, held beyond the ends; `None`
/// without points.
pub(crate) fn interpolate_held(points: &[(f64, f64)], x: f64) -> Option<f64> {
    let (first, last) = (points.first()?, points.last()?);
    if x <= first.0 {
        return Some(first.1);
    }
    if x >= last.0 {
        return Some(last.1);
    }
    let i = points.partition_point(|p| p.0 <= x);
    let (a, b) = (points[i - 1], points[i]);
    Some(a.1 + (b.1 - a.1) * (x - a.0) / (b.0 - a.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_hold_the_outermost() {
        let speeds = [1.0, 2.0, 4.0];
        assert_eq!(neighbours(&speeds, 0.5), (0, 0, 0.0));
        assert_eq!(neighbours(&speeds, 3.0), (1, 2, 0.5));
        assert_eq!(neighbours(&speeds, 2.0), (1, 2, 0.0));
        assert_eq!(neighbours(&speeds, 9.0), (2, 2, 0.0));
    }

    #[test]
    fn the_runs_around_a_speed_and_some_of_the_others_answer() {
        let speeds: Vec<f64> = (0..200).map(f64::from).collect();
        assert_eq!(answering(&speeds[..20], 3.0), (0..20).collect::<Vec<_>>());
        for v in [-5.0, 0.0, 3.0, 77.5, 198.0, 300.0] {
            let chosen = answering(&speeds, v);
            assert!(chosen.len() == 20 && chosen.windows(2).all(|w| w[0] < w[1]), "{chosen:?}");
            assert_eq!((chosen[0], chosen[19]), (0, 199), "{chosen:?}");
            let (low, high, _) = neighbours(&speeds, v);
            assert!(chosen.contains(&low) && chosen.contains(&high), "{v}: {chosen:?}");
        }
    }

    /// At 2 m/s and 10 ms the mean is over 10 mm to both sides.
    #[test]
    fn a_force_is_averaged_over_the_way_of_an_interval() {
        let along: Vec<f64> = (0..=100).map(|i| 0.001 * f64::from(i)).collect();
        let of = |force: &dyn Fn(f64) -> f64| {
            let force_n: Vec<f64> = along.iter().map(|&d| force(d)).collect();
            mean_over(&along, &force_n, |_| 0.01)
        };
        // A constant force rises over the first half and stays; a line stays one, up to the end.
        for (i, (found, d)) in of(&|_| 1e6).iter().zip(&along).enumerate() {
            let expected = if i < 10 { 1e6 * d / 0.01 } else { 1e6 };
            assert!((found - expected).abs() < 1.0, "{found} N at {d} m");
        }
        for (found, d) in of(&|d| 1e7 * d).iter().zip(&along) {
            assert!((found - 1e7 * d).abs() < 1.0, "{found} N at {d} m");
        }
        // A wave as long as the whole way is gone, away from both ends.
        let wave = of(&|d| 1e6 + 1e5 * (std::f64::consts::TAU * d / 0.02).sin());
        assert!(wave[20..=80].iter().all(|f| (f - 1e6).abs() < 100.0), "{wave:?}");
        // Not from 0 on: the same away from the start.
        let later = mean_over(&along[30..], &vec![1e6; 71], |_| 0.01);
        assert!(later.iter().all(|f| (f - 1e6).abs() < 1.0), "{later:?}");
        assert_eq!(mean_over(&[0.0], &[5.0], |_| 0.01), [5.0]);
        assert_eq!(mean_over(&along, &vec![1e6; 101], |_| 0.0), vec![1e6; 101]);
    }
}
