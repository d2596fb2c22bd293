//! The moving mean deceleration of EN 15227.

use super::super::rows::{LANES, each};

/// Window of the moving mean deceleration, in s (EN 15227).
const MOVING_MEAN_S: f64 = 0.120;
/// Between outputs further apart, in s, the largest mean would be missed by too much.
const COARSEST_S: f64 = 0.005;

/// Mean deceleration in m/s² over the 120 ms in which its magnitude is largest, from the speeds
/// at both ends; `None` for a record that is shorter or too coarse.
pub(super) fn moving_mean(speeds: &[f64], interval_s: f64) -> Option<f64> {
    if interval_s > COARSEST_S {
        return None;
    }
    let window = MOVING_MEAN_S / interval_s;
    // Rounding shall not make 160 intervals of 0.75 ms a little more than 120 ms.
    let back = (window - 1e-9).ceil();
    let share = back - window;
    let back = (back as usize).max(1);
    let now = speeds.get(back..)?;
    let (before, after) = (&speeds[..now.len()], &speeds[1..][..now.len()]);
    let larger = |a: f64, b: f64| if b.abs() > a.abs() { b } else { a };
    let fall = |before: f64, after: f64, now: f64| before + share * (after - before) - now;
    let mut most = [0.0; LANES];
    let (rows, rest) = now.as_chunks::<LANES>();
    for ((now, before), after) in
        rows.iter().zip(before.as_chunks::<LANES>().0).zip(after.as_chunks::<LANES>().0)
    {
        most = each(|j| larger(most[j], fall(before[j], after[j], now[j])));
    }
    let mut most = most.into_iter().fold(0.0, larger);
    for j in now.len() - rest.len()..now.len() {
        most = larger(most, fall(before[j], after[j], now[j]));
    }
    (!now.is_empty()).then_some(most / MOVING_MEAN_S)
}
