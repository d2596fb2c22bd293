//! Fewer points for tools with small tables, more for tools that interpolate by splines.

use crate::error::Error;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::curve::Envelope;

/// The envelope with at most `most` points (two or more): those are removed first whose removal
/// changes the energy least (the area of the triangle with both neighbours; Visvalingam and
/// Whyatt, Cartographic Journal 30, 1993). The forces at the others are then those of the least squares
/// over the whole curve. `kept` is the index of a point that stays, such as the maximum crush; the forces up
/// to it are scaled so that the energy to it is the same. A curve of so few points stays as it is.
pub(crate) fn thinned(curve: &Envelope, most: usize, kept: usize) -> Result<Envelope, Error> {
    let (d, f) = (curve.deflection_m(), curve.force_n());
    if d.len() <= most.max(3) {
        return Ok(curve.clone());
    }
    let left = kept_points(d, f, most.max(3), kept);
    let mut force_n = least_squares(d, f, &left, kept);
    let deflection_m: Vec<f64> = left.iter().map(|&i| d[i]).collect();
    let plain = Envelope::new(deflection_m.clone(), force_n.clone())?;
    let scale = curve.work_to(d[kept]) / plain.work_to(d[kept]);
    if scale.is_finite() {
        let until = left.partition_point(|&i| i <= kept);
        force_n[..until].iter_mut().for_each(|f| *f *= scale);
    }
    Envelope::new(deflection_m, force_n)
}

/// The forces at the points that are `left`, so that the lines between them have the least squares over the
/// whole curve, with those of the ends and of `kept` as they are; none gets below 0 that was not.
fn least_squares(d: &[f64], f: &[f64], left: &[usize], kept: usize) -> Vec<f64> {
    let n = left.len();
    // ∫φᵢφₖ of the hat functions φ, and ∫Fφᵢ, as rows of a matrix with three diagonals.
    let (mut below, mut diagonal, mut above) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let mut right = vec![0.0; n];
    for k in 0..n - 1 {
        let (from, to) = (left[k], left[k + 1]);
        let length_m = d[to] - d[from];
        diagonal[k] += length_m / 3.0;
        diagonal[k + 1] += length_m / 3.0;
        above[k] = length_m / 6.0;
        below[k + 1] = length_m / 6.0;
        for i in from..to {
            let share = |i: usize| (d[i] - d[from]) / length_m;
            let step_m = d[i + 1] - d[i];
            let product =
                |a: f64, b: f64| step_m / 6.0 * (f[i] * (2.0 * a + b) + f[i + 1] * (a + 2.0 * b));
            right[k] += product(1.0 - share(i), 1.0 - share(i + 1));
            right[k + 1] += product(share(i), share(i + 1));
        }
    }
    for k in (0..n).filter(|&k| k == 0 || k == n - 1 || left[k] == kept) {
        (below[k], diagonal[k], above[k], right[k]) = (0.0, 1.0, 0.0, f[left[k]]);
    }
    for k in 1..n {
        let factor = below[k] / diagonal[k - 1];
        diagonal[k] -= factor * above[k - 1];
        right[k] -= factor * right[k - 1];
    }
    for k in (0..n).rev() {
        let next = right.get(k + 1).copied().unwrap_or(0.0);
        right[k] = (right[k] - above[k] * next) / diagonal[k];
    }
    right.iter().zip(left).map(|(force, &i)| force.max(f[i].min(0.0))).collect()
}

/// What a triangle beyond the maximum crush counts: the force there is less certain.
const TAIL_WEIGHT: f64 = 0.05;

/// Indices of the points that are left when the one with the smallest triangle is removed again and
/// again; the ends and `kept` stay.
fn kept_points(d: &[f64], f: &[f64], most: usize, kept: usize) -> Vec<usize> {
    let n = d.len();
    let (mut before, mut after): (Vec<usize>, Vec<usize>) =
        (0..n).map(|i| (i.saturating_sub(1), (i + 1).min(n - 1))).unzip();
    let area = |a: usize, b: usize, c: usize| {
        let weight = if b > kept { TAIL_WEIGHT } else { 1.0 };
        0.5 * weight * ((d[b] - d[a]) * (f[c] - f[a]) - (d[c] - d[a]) * (f[b] - f[a])).abs()
    };
    let mut areas: Vec<f64> = (0..n).map(|i| area(before[i], i, after[i])).collect();
    // Smallest first: bits of numbers that are not below 0 are in the numbers' order.
    let mut queue: BinaryHeap<Reverse<(u64, usize)>> = (1..n.saturating_sub(1))
        .filter(|&i| i != kept)
        .map(|i| Reverse((areas[i].to_bits(), i)))
        .collect();
    let mut is_left = vec![true; n];
    let mut left = n;
    while left > most {
        let Some(Reverse((bits, i))) = queue.pop() else { break };
        // An entry from before a neighbour was removed.
        if !is_left[i] || bits != areas[i].to_bits() {
            continue;
        }
        is_left[i] = false;
        left -= 1;
        let (a, c) = (before[i], after[i]);
        (after[a], before[c]) = (c, a);
        for k in [a, c] {
            if k != 0 && k != n - 1 && k != kept {
                areas[k] = area(before[k], k, after[k]);
                queue.push(Reverse((areas[k].to_bits(), k)));
            }
        }
    }
    (0..n).filter(|&i| is_left[i]).collect()
}

/// Share of a deflection by which the next must exceed it, so that nine digits of the two differ in any unit: tools refuse equal ones.
const DISTINCT: f64 = 1.1e-8;

/// The curve with each deflection distinct from the one before.
pub(crate) fn set_apart(curve: &Envelope) -> Result<Envelope, Error> {
    let mut deflection_m = curve.deflection_m().to_vec();
    for i in 1..deflection_m.len() {
        deflection_m[i] = deflection_m[i].max(deflection_m[i - 1] * (1.0 + DISTINCT));
    }
    Envelope::new(deflection_m, curve.force_n().to_vec())
}

/// Minimum number of points of a table that splines go through.
const FEWEST: usize = 200;
/// A change of the force's slope over an interval that is a kink, as a share of the peak force.
const KINK: f64 = 0.02;
/// The first points of a fence are so close to their kink that its change of slope is this share of the peak force from there: an
/// Akima spline deviates by 4/27 of it, whichever slope it takes at the kink.
const NEAR: f64 = 0.03;
/// They are at most at this share of the shorter interval, and no point of a fence is beyond the second share of its interval.
const CLOSE: [f64; 2] = [0.25, 0.45];
/// Each further point, twice as far from the kink, leaves two thirds of a cubic spline's swing; below this share of the peak force,
/// as the change of slope over the interval, it may be left.
const SWING: f64 = 0.1;

/// The same function with more points, so that Akima and cubic splines through them keep its energy and hardly overshoot: at
/// least 200, and fences beside each kink. These begin equally close on both sides, since beside a wide interval a spline would
/// carry the slope of a short steep flank far into it. `peak_n` is the largest force without the tail.
pub(crate) fn for_splines(curve: &Envelope, peak_n: f64) -> Result<Envelope, Error> {
    let (d, f) = (curve.deflection_m(), curve.force_n());
    let last = d.len() - 2;
    let widest_m = curve.end_m() / FEWEST as f64;
    let interval_m = |i: usize| (d[i + 1] - d[i]).min(widest_m);
    let slope = |i: usize| (f[i + 1] - f[i]) / (d[i + 1] - d[i]);
    let mut deflection_m = d.to_vec();
    for i in 0..=last {
        let step = d[i + 1] - d[i];
        let parts = (step / widest_m).ceil().max(1.0) as usize;
        deflection_m.extend((1..parts).map(|p| d[i] + step * p as f64 / parts as f64));
    }
    for (k, &kink_m) in d.iter().enumerate() {
        let beside = [k.checked_sub(1), (k <= last).then_some(k)];
        let [before, after] = beside.map(|i| i.map_or(0.0, slope));
        let change = (after - before).abs();
        let widths = || beside.into_iter().flatten().map(interval_m);
        if change * widths().fold(0.0, f64::max) <= KINK * peak_n {
            continue;
        }
        let shorter_m = widths().fold(f64::INFINITY, f64::min);
        let first_m = (CLOSE[0] * shorter_m).min(NEAR * peak_n / change);
        let first_m = first_m.max(2.0 * DISTINCT * kink_m);
        for (i, sign) in beside.into_iter().zip([-1.0, 1.0]) {
            let Some(i) = i else { continue };
            let (mut off_m, mut swing_n) = (first_m, change * interval_m(i));
            while off_m < CLOSE[1] * interval_m(i) {
                deflection_m.push(kink_m + sign * off_m);
                (off_m, swing_n) = (2.0 * off_m, swing_n / 1.5);
                if swing_n < SWING * peak_n {
                    break;
                }
            }
        }
    }
    deflection_m.sort_by(f64::total_cmp);
    deflection_m.dedup_by(|next, d| *next <= *d * (1.0 + DISTINCT));
    let force_n = deflection_m.iter().map(|&d| curve.force_at(d)).collect();
    Envelope::new(deflection_m, force_n)
}

/// Result of softening.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Softened {
    /// No rise is that steep.
    Nothing,
    Curve(Envelope),
    /// The energy could only be kept by changing the curve's end, or forces by more than a quarter.
    Impossible,
}

/// The envelope with no rise steeper than `stiffness_n_per_m` and the same energy to its point
/// `end`: a too steep rise begins earlier on its line, and the forces around it are raised for what
/// the rise has lost, by a quarter at most and not in the last twentieth of the deflection.
pub(crate) fn softened(curve: &Envelope, stiffness_n_per_m: f64, end: usize) -> Softened {
    if curve.max_slope() <= stiffness_n_per_m * (1.0 + 1e-9) {
        return Softened::Nothing;
    }
    let found = soften(curve, stiffness_n_per_m, end);
    // The body rebounds from the end's force.
    let keeps_end = |c: &Envelope| {
        (c.force_n()[end] - curve.force_n()[end]).abs() <= SAME_END * curve.force_n()[end]
    };
    let is_soft = |c: &Envelope| c.max_slope() <= stiffness_n_per_m * (1.0 + 1e-6);
    found.filter(|c| is_soft(c) && keeps_end(c)).map_or(Softened::Impossible, Softened::Curve)
}

fn soften(curve: &Envelope, stiffness_n_per_m: f64, end: usize) -> Option<Envelope> {
    let d = curve.deflection_m();
    let wanted_j = curve.work_to(d[end]);
    // Raised before the rise is limited, so that no limited slope is steep again.
    let with = |raise: f64, until: usize| {
        let mut f = curve.force_n().to_vec();
        f[..=until].iter_mut().for_each(|f| *f *= raise);
        f[0] = f[0].min(0.0);
        for i in 1..f.len() {
            f[i] = f[i].min(f[i - 1] + stiffness_n_per_m * (d[i] - d[i - 1]));
        }
        Envelope::new(d.to_vec(), f).ok()
    };
    let limited = with(1.0, 0)?;
    let last = (0..=end).rfind(|&i| limited.force_n()[i] < curve.force_n()[i])?;
    let most = d.partition_point(|&x| x <= REACH * d[end]).saturating_sub(1).max(1);
    // What is raised: twice as far as the limit reaches, more if that does not suffice.
    let mut until = (2 * last).clamp(1, most);
    loop {
        let (mut low, mut high) = (1.0_f64, MOST_RAISED);
        if with(high, until)?.work_to(d[end]) >= wanted_j {
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if with(middle, until)?.work_to(d[end]) < wanted_j {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            return with(high, until);
        }
        if until == most {
            return None;
        }
        until = (2 * until).min(most);
    }
}

/// Share by which the force at the maximum crush may change.
const SAME_END: f64 = 0.01;
/// Up to this share of the maximum crush forces may be raised: the end, from which a body rebounds,
/// stays.
const REACH: f64 = 0.95;
/// Forces are raised by at most this factor.
const MOST_RAISED: f64 = 1.25;

/// The curve from the origin: a force at zero deflection is reached on a line as steep as the curve's steepest rise, or its
/// `unloading_n_per_m` if that is more, at the same energy to the deflection of `end`; so no rise is new to a tool that
/// unloads with the steepest one. The second value is the index of `end` among the points. `None` for a curve that begins
/// at the origin already.
pub(crate) fn from_origin(
    curve: &Envelope,
    end: usize,
    unloading_n_per_m: f64,
) -> Result<Option<(Envelope, usize)>, Error> {
    let (d, f) = (curve.deflection_m(), curve.force_n());
    if f[0] <= 0.0 {
        return Ok(None);
    }
    // No softer than a line to half of the maximum crush, which the curve goes on from.
    let slope = unloading_n_per_m.max(curve.max_slope()).max(f[0] / (0.5 * d[end]));
    let meets = (1..=end).find(|&i| slope * d[i] >= f[i]).unwrap_or(end);
    let (d0, f0, d1, f1) = (d[meets - 1], f[meets - 1], d[meets], f[meets]);
    // Where the line from the origin crosses the segment.
    let along = (f1 - f0) / (d1 - d0);
    let ramp_m = ((f0 - along * d0) / (slope - along)).clamp(d0, d1);
    let mut deflection_m = vec![0.0, ramp_m];
    let mut force_n = vec![0.0, curve.force_at(ramp_m)];
    let rest = if ramp_m * (1.0 + DISTINCT) < d1 { meets } else { meets + 1 };
    deflection_m.extend_from_slice(&d[rest..]);
    force_n.extend_from_slice(&f[rest..]);
    let end = end + 2 - rest;
    let plain = Envelope::new(deflection_m.clone(), force_n.clone())?;
    let scale = curve.work_to(deflection_m[end]) / plain.work_to(deflection_m[end]);
    force_n[..=end].iter_mut().for_each(|f| *f *= scale);
    Ok(Some((Envelope::new(deflection_m, force_n)?, end)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sharp peak at 10 mm and folds after it.
    fn curve() -> Envelope {
        let d: Vec<f64> = (0..=400).map(|i| f64::from(i) * 2.5e-3).collect();
        let f = d
            .iter()
            .map(|&d| match d {
                0.0 => 0.0,
                d if d < 0.0101 => 6e6 * d / 0.01,
                d => 1.5e6 + 4.5e6 * (-(d - 0.01) / 0.01).exp() + 3e5 * (30.0 * d).sin(),
            })
            .collect();
        Envelope::new(d, f).unwrap()
    }

    #[test]
    fn fewer_points_keep_the_energy_and_the_peak() {
        let few = thinned(&curve(), 200, 400).unwrap();
        assert_eq!(few.deflection_m().len(), 200);
        assert!((few.work() / curve().work() - 1.0).abs() < 1e-12);
        assert!((few.peak_force_n() / curve().peak_force_n() - 1.0).abs() < 1e-3);
        let at = |k: i32| f64::from(k) * 1e-3;
        let worst = (0..1000).map(|k| (few.force_at(at(k)) - curve().force_at(at(k))).abs());
        assert!(worst.fold(0.0, f64::max) < 0.01 * curve().peak_force_n());
    }

    #[test]
    fn a_kept_point_stays() {
        let few = thinned(&curve(), 20, 333).unwrap();
        let end_m = curve().deflection_m()[333];
        assert!(few.deflection_m().contains(&end_m));
        assert!((few.work_to(end_m) / curve().work_to(end_m) - 1.0).abs() < 1e-12);
        assert!(few.force_n().iter().all(|f| *f >= 0.0));
        assert_eq!(thinned(&curve(), 401, 400).unwrap(), curve(), "few enough");
    }

    /// Points on a parabola: chords lie on one side of it, lines of least squares on both.
    #[test]
    fn forces_of_least_squares_are_nearer_than_chords() {
        let d: Vec<f64> = (0..=400).map(|i| f64::from(i) / 400.0).collect();
        let parabola = Envelope::new(d.clone(), d.iter().map(|d| 1e6 * d * (2.0 - d)).collect());
        let parabola = parabola.unwrap();
        let left: Vec<usize> = (0..=400).step_by(50).collect();
        let off = |force_n: Vec<f64>| -> f64 {
            let of = Envelope::new(left.iter().map(|&i| d[i]).collect(), force_n).unwrap();
            d.iter().map(|&d| (of.force_at(d) - parabola.force_at(d)).powi(2)).sum()
        };
        let chords = left.iter().map(|&i| parabola.force_n()[i]).collect();
        let fitted = least_squares(&d, parabola.force_n(), &left, 400);
        assert!(off(fitted) < 0.4 * off(chords));
    }

    #[test]
    fn more_points_are_the_same_function() {
        let coarse = Envelope::new(vec![0.0, 0.01, 0.02, 1.0], vec![0.0, 6e6, 1e6, 1e6]).unwrap();
        let fine = for_splines(&coarse, 6e6).unwrap();
        assert!(fine.deflection_m().len() >= 200);
        assert!((fine.work() / coarse.work() - 1.0).abs() < 1e-12);
        assert_eq!(fine.peak_force_n(), 6e6);
    }

    /// A flank of 2 mm between long intervals, and a jump.
    #[test]
    fn fences_are_equally_close_on_both_sides_of_a_kink() {
        let d = vec![0.0, 0.01, 0.4, 0.402, 0.6, 0.6 * (1.0 + DISTINCT), 0.8];
        let flank = Envelope::new(d, vec![0.0, 1.5e6, 1.5e6, 8e5, 8e5, 3e6, 3e6]).unwrap();
        let fine = for_splines(&flank, 3e6).unwrap();
        let d = fine.deflection_m();
        for kink in [0.01, 0.4, 0.402] {
            let at = d.iter().position(|d| *d == kink).unwrap();
            let sides = [d[at] - d[at - 1], d[at + 1] - d[at], d[at + 2] - d[at + 1]];
            assert!((sides[1] / sides[0] - 1.0).abs() < 1e-9, "{kink}: {sides:?}");
            assert!(sides[2] < 1.1 * sides[1], "{kink}: {sides:?}");
        }
        assert!(d.iter().any(|d| (0.6 - 1e-7..0.6).contains(d)), "beside the jump");
        assert!(d.len() < 300, "{}", d.len());
    }

    #[test]
    fn a_force_at_contact_begins_at_the_origin_with_the_same_energy() {
        let constant = Envelope::new(vec![0.0, 0.2, 1.0], vec![2e6; 3]).unwrap();
        let (ramped, end) = from_origin(&constant, 2, 400e6).unwrap().unwrap();
        assert_eq!((ramped.force_n()[0], ramped.deflection_m()[end]), (0.0, 1.0));
        assert!((ramped.work() / constant.work() - 1.0).abs() < 1e-12);
        assert!((ramped.force_at(0.5) / 2e6 - 1.0).abs() < 3e-3);
        assert!((ramped.max_slope() / 400e6 - 1.0).abs() < 3e-3);
        assert_eq!(from_origin(&ramped, end, 400e6).unwrap(), None);
        // A curve that rises from its first force: the line meets it further on, and nothing is steeper.
        let d = vec![0.0, 0.001, 0.002, 0.1, 1.0];
        let rising = Envelope::new(d, vec![1e6, 1.2e6, 2e6, 1e6, 1e6]).unwrap();
        let (ramped, end) = from_origin(&rising, 4, 100e6).unwrap().unwrap();
        assert_eq!(ramped.deflection_m()[end], 1.0);
        assert!((ramped.work() / rising.work() - 1.0).abs() < 1e-12);
        assert!((ramped.max_slope() / 800e6 - 1.0).abs() < 3e-3, "{}", ramped.max_slope());
    }

    #[test]
    fn a_softened_flank_keeps_the_energy() {
        let Softened::Curve(soft) = softened(&curve(), 200e6, 400) else { panic!("not softened") };
        assert!(soft.max_slope() <= 200e6 * (1.0 + 1e-9));
        assert!((soft.work() / curve().work() - 1.0).abs() < 1e-9);
        assert_eq!(soft.force_n()[0], 0.0);
        assert_eq!(soft.force_n()[381..], curve().force_n()[381..]);
        assert_eq!(softened(&curve(), 700e6, 400), Softened::Nothing);
        assert_eq!(softened(&curve(), 1e6, 400), Softened::Impossible);
    }
}
