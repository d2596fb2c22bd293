//! CFC filter of crash channels: ISO 6487 / SAE J211, forward and backward (zero phase).

use std::f64::consts::{PI, SQRT_2};

use super::interpolate;

/// Why a history cannot be filtered.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum CfcError {
    /// The samples are too far apart for the class.
    #[error(
        "the interval of {:.3} ms is too long for CFC{class}: at most {:.3} ms; use a lower class, no filter, or a shorter output interval", interval_s * 1e3, longest_s * 1e3
    )]
    TooCoarse { class: u32, interval_s: f64, longest_s: f64 },
    /// The samples are not evenly spaced.
    #[error(
        "the filter needs about equal intervals, but they differ by up to {spread_percent:.0} % of their mean: use filter = \"none\""
    )]
    Uneven { spread_percent: f64 },
}

/// Largest deviation of an interval from the mean that still counts as equal.
/// Explicit solvers write at the first cycle past each multiple.
const EQUAL: f64 = 0.02;
/// Largest deviation at which the history is resampled to the mean interval: late cycles
/// and times of six digits, but not a change of the output interval.
const MAX_SPREAD: f64 = 0.6;

/// Of the work of a force a class must keep this share, else it is too low for the impact.
pub(crate) const KEPT: f64 = 0.97;

/// Share of the work that a filtered force still does along a path, both as long as the path.
pub(crate) fn work_kept(filtered: &[f64], recorded: &[f64], path: &[f64]) -> f64 {
    let work = |force: &[f64]| -> f64 {
        let steps = force.windows(2).zip(path.windows(2));
        steps.map(|(f, d)| 0.5 * (f[0] + f[1]) * (d[1] - d[0])).sum()
    };
    work(filtered) / work(recorded)
}

/// A filtered history.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Filtered {
    /// In the unit of the input, one per time.
    pub values: Vec<f64>,
    /// Whether the intervals differed so much that it was filtered at their mean.
    pub resampled: bool,
    /// Largest deviation of an interval from the mean, as a share of it.
    pub spread: f64,
}

/// Length of the mirrored pad at each end: the longer of these.
const PAD_S: f64 = 0.010;
const PAD_SAMPLES: usize = 100;

/// Coefficients of one pass: a two-pole Butterworth low-pass.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Coefficients {
    /// Factor of the input.
    pub a0: f64,
    /// Factor of the input one step before.
    pub a1: f64,
    /// Factor of the input two steps before.
    pub a2: f64,
    /// Factor of the output one step before.
    pub b1: f64,
    /// Factor of the output two steps before.
    pub b2: f64,
}

impl Coefficients {
    /// `class`: CFC in Hz (60, 180, 600, 1000); `interval_s`: sampling interval.
    /// Formulas of SAE J211-1, appendix C.
    pub(crate) fn new(class: u32, interval_s: f64) -> Self {
        let w_d = 2.0 * PI * f64::from(class) * 2.0775;
        let w_a = libm::tan(w_d * interval_s / 2.0);
        let denominator = 1.0 + SQRT_2 * w_a + w_a * w_a;
        let a0 = w_a * w_a / denominator;
        Self {
            a0,
            a1: 2.0 * a0,
            a2: a0,
            b1: -2.0 * (w_a * w_a - 1.0) / denominator,
            b2: (-1.0 + SQRT_2 * w_a - w_a * w_a) / denominator,
        }
    }

    /// One pass in place, begun at rest at the first value.
    fn pass(&self, values: &mut [f64]) {
        let Some(&first) = values.first() else { return };
        let (mut x1, mut x2, mut y1, mut y2) = (first, first, first, first);
        for value in values {
            let x = *value;
            let y = self.a0 * x + self.a1 * x1 + self.a2 * x2 + self.b1 * y1 + self.b2 * y2;
            (x2, x1, y2, y1) = (x1, x, y1, y);
            *value = y;
        }
    }
}

/// `values` at `time_s` (s, increasing, equal intervals), filtered without phase shift.
///
/// Intervals that differ (by up to 60 % of their mean) are resampled linearly to their mean
/// and back. Both ends are padded by point reflection `2 x_0 − x_j`, so that the ends keep their level.
pub(crate) fn filter(class: u32, time_s: &[f64], values: &[f64]) -> Result<Filtered, CfcError> {
    let n = values.len();
    if n < 2 {
        return Ok(Filtered { values: values.to_vec(), resampled: false, spread: 0.0 });
    }
    let interval_s = (time_s[n - 1] - time_s[0]) / (n - 1) as f64;
    let spread =
        time_s.windows(2).map(|w| ((w[1] - w[0]) / interval_s - 1.0).abs()).fold(0.0, f64::max);
    if spread > MAX_SPREAD {
        return Err(CfcError::Uneven { spread_percent: spread * 100.0 });
    }
    let longest_s = 1.0 / (10.0 * f64::from(class));
    if interval_s > longest_s * (1.0 + 1e-9) {
        return Err(CfcError::TooCoarse { class, interval_s, longest_s });
    }
    let resampled = spread > EQUAL;
    if !resampled {
        let values = at_equal_intervals(class, interval_s, values);
        return Ok(Filtered { values, resampled, spread });
    }
    let last_s = time_s[n - 1];
    let even: Vec<f64> = (0..n).map(|i| (time_s[0] + interval_s * i as f64).min(last_s)).collect();
    // Both sets of times span the same range, so none lies outside.
    let uneven = |_| CfcError::Uneven { spread_percent: spread * 100.0 };
    let values = interpolate(time_s, values, &even).map_err(uneven)?;
    let filtered = at_equal_intervals(class, interval_s, &values);
    let back: Vec<f64> = time_s.iter().map(|t| t.min(even[n - 1])).collect();
    let values = interpolate(&even, &filtered, &back).map_err(uneven)?;
    Ok(Filtered { values, resampled, spread })
}

/// The same for what was 0 before the first time, such as the acceleration of a body before its first contact: a step there
/// is filtered like any other, where padding by reflection would keep its first value as it is.
pub(crate) fn filter_from_rest(
    class: u32,
    time_s: &[f64],
    values: &[f64],
) -> Result<Filtered, CfcError> {
    let n = values.len();
    if n < 2 {
        return filter(class, time_s, values);
    }
    let interval_s = (time_s[n - 1] - time_s[0]) / (n - 1) as f64;
    let pad = ((PAD_S / interval_s).round() as usize).max(PAD_SAMPLES);
    let before = (1..=pad).rev().map(|j| time_s[0] - interval_s * j as f64);
    let time_s: Vec<f64> = before.chain(time_s.iter().copied()).collect();
    let rested: Vec<f64> = [&vec![0.0; pad][..], values].concat();
    let mut filtered = filter(class, &time_s, &rested)?;
    filtered.values.drain(..pad);
    Ok(filtered)
}

/// The filter proper, over the padded history.
fn at_equal_intervals(class: u32, interval_s: f64, values: &[f64]) -> Vec<f64> {
    let n = values.len();
    let pad = ((PAD_S / interval_s).round() as usize).max(PAD_SAMPLES).min(n - 1);
    let (first, last) = (values[0], values[n - 1]);
    let mut padded = Vec::with_capacity(n + 2 * pad);
    padded.extend((1..=pad).rev().map(|j| 2.0 * first - values[j]));
    padded.extend_from_slice(values);
    padded.extend((1..=pad).map(|j| 2.0 * last - values[n - 1 - j]));
    let coefficients = Coefficients::new(class, interval_s);
    coefficients.pass(&mut padded);
    padded.reverse();
    coefficients.pass(&mut padded);
    padded.reverse();
    padded[pad..pad + n].to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coefficients_are_the_standards() {
        let c = Coefficients::new(60, 1e-4);
        assert!((c.a0 - 0.0014523675).abs() < 5e-11);
        assert!((c.b1 - 1.8893432).abs() < 5e-8);
        assert!((c.b2 + 0.89515269).abs() < 5e-9);
    }

    fn gain_at(frequency_hz: f64) -> f64 {
        let time_s: Vec<f64> = (0..20_000).map(|i| f64::from(i) * 1e-4).collect();
        let wave: Vec<f64> = time_s.iter().map(|t| (2.0 * PI * frequency_hz * t).sin()).collect();
        let filtered = filter(60, &time_s, &wave).unwrap().values;
        filtered[5_000..15_000].iter().fold(0.0, |m: f64, v| m.max(v.abs()))
    }

    /// A step from rest is halved where it is, as by any filter without phase shift; padding by reflection keeps it.
    #[test]
    fn a_step_from_rest_is_filtered() {
        let time_s: Vec<f64> = (0..400).map(|i| f64::from(i) * 0.25e-3).collect();
        let step = vec![100.0; 400];
        let from_rest = filter_from_rest(60, &time_s, &step).unwrap().values;
        assert!((from_rest[0] / 50.0 - 1.0).abs() < 0.1, "{}", from_rest[0]);
        assert!((from_rest[200] - 100.0).abs() < 0.1);
        assert!((filter(60, &time_s, &step).unwrap().values[0] - 100.0).abs() < 1e-9);
    }

    #[test]
    fn both_passes_lose_3_db_at_1_665_cfc() {
        let half_power = 0.5_f64.sqrt();
        assert!((gain_at(1.665 * 60.0) - half_power).abs() < 2e-3);
        assert!((gain_at(5.0) - 1.0).abs() < 1e-3);
        assert!(gain_at(600.0) < 1e-2);
    }

    #[test]
    fn keeps_a_straight_line() {
        let time_s: Vec<f64> = (0..400).map(|i| f64::from(i) * 0.75e-3).collect();
        let line: Vec<f64> = time_s.iter().map(|t| 3.0 - 20.0 * t).collect();
        for (a, b) in filter(60, &time_s, &line).unwrap().values.iter().zip(&line) {
            assert!((a - b).abs() < 1e-6, "{a} against {b}");
        }
    }

    #[test]
    fn refuses_what_the_standard_does_not_allow() {
        let time_s: Vec<f64> = (0..400).map(|i| f64::from(i) * 0.75e-3).collect();
        assert!(matches!(filter(180, &time_s, &time_s), Err(CfcError::TooCoarse { .. })));
        let uneven: Vec<f64> = time_s.iter().map(|t| t * t / 10.0).collect();
        assert!(matches!(filter(60, &uneven, &uneven), Err(CfcError::Uneven { .. })));
    }

    /// States at the first cycle past each multiple of 10 µs, up to 1 µs late.
    #[test]
    fn late_cycles_are_filtered_at_the_mean_interval() {
        let late = |i: u32| 1e-6 * f64::from(i * 7 % 10) / 10.0;
        let time_s: Vec<f64> = (0..4_000).map(|i| f64::from(i) * 1e-5 + late(i)).collect();
        let wave: Vec<f64> = time_s.iter().map(|t| (2.0 * PI * 10.0 * t).sin()).collect();
        let filtered = filter(60, &time_s, &wave).unwrap();
        assert!(filtered.resampled && filtered.spread > 0.05);
        for (a, b) in filtered.values.iter().zip(&wave).skip(1_200).take(1_600) {
            assert!((a - b).abs() < 2e-3, "{a} against {b}");
        }
    }
}
