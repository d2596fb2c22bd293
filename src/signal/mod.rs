//! Signal processing: arrays of values over time, of whatever quantity.

mod bounded;
pub(crate) mod cfc;
pub(crate) mod peaks;

use crate::piecewise;
pub(crate) use bounded::{Cholesky, bounded};
pub(crate) use cfc::CfcError;

/// Integral of `values` over `time` from the first state on, by the trapezoidal rule.
///
/// `time`: increasing, as many as `values`. Returns one value per state, 0 first.
pub(crate) fn integral(time: &[f64], values: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    (0..values.len())
        .map(|i| {
            if i > 0 {
                sum += 0.5 * (values[i] + values[i - 1]) * (time[i] - time[i - 1]);
            }
            sum
        })
        .collect()
}

/// `Σ|p − r| / Σ|r|`: the headline error for velocity, acceleration and force.
///
/// At the same times or deflections; NaN if their numbers differ. Infinite if the reference is all zero and
/// the prediction is not; 0 if both are.
pub fn l1_ratio(reference: &[f64], prediction: &[f64]) -> f64 {
    if reference.len() != prediction.len() {
        return f64::NAN;
    }
    let difference: f64 = reference.iter().zip(prediction).map(|(r, p)| (p - r).abs()).sum();
    let scale: f64 = reference.iter().map(|r| r.abs()).sum();
    if difference == 0.0 { 0.0 } else { difference / scale }
}

/// Rate of `values` over `time`: central differences, one-sided at both ends.
///
/// `time`: strictly increasing, at least two. Over an output interval `h` the result is
/// a mean over `2 h`, as the contact forces derived from impulses are.
///
/// # Panics
/// If there are fewer times than values.
pub fn derivative(time: &[f64], values: &[f64]) -> Vec<f64> {
    let last = values.len().saturating_sub(1);
    (0..values.len())
        .map(|i| {
            let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
            (values[b] - values[a]) / (time[b] - time[a])
        })
        .collect()
}

/// Mean rate of `values` in every interval of `time`, with its middle: whatever happens within an interval counts by
/// its mean, where samples of a rate would show it as something slower.
///
/// `time`: strictly increasing, as many as `values`. Returns one pair less.
pub(crate) fn mean_rates(time: &[f64], values: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let intervals = time.windows(2).zip(values.windows(2));
    intervals.map(|(t, v)| (0.5 * (t[0] + t[1]), (v[1] - v[0]) / (t[1] - t[0]))).unzip()
}

/// Why a history has no value at a time.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("time {time_s} s lies outside the history ({first_s} s to {last_s} s)")]
pub(crate) struct OutOfRange {
    /// The time that was requested.
    pub time_s: f64,
    /// The first of the history.
    pub first_s: f64,
    /// The last of the history.
    pub last_s: f64,
}

/// Values at `times_s` by linear interpolation.
///
/// `at_s`: increasing, at least one; `times_s`: increasing, within the range of `at_s`.
/// Returns one value per time, in the unit of `values`.
pub(crate) fn interpolate(
    at_s: &[f64],
    values: &[f64],
    times_s: &[f64],
) -> Result<Vec<f64>, OutOfRange> {
    let (first_s, last_s) = (at_s[0], at_s[at_s.len() - 1]);
    let mut i = 0;
    times_s
        .iter()
        .map(|&time_s| {
            if !(first_s..=last_s).contains(&time_s) {
                return Err(OutOfRange { time_s, first_s, last_s });
            }
            while i + 2 < at_s.len() && at_s[i + 1] <= time_s {
                i += 1;
            }
            if at_s.len() == 1 {
                return Ok(values[0]);
            }
            Ok(piecewise::by_share(at_s, values, i, time_s))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integral_of_a_line_is_exact() {
        assert_eq!(integral(&[0.0, 1.0, 3.0], &[1.0, 3.0, 7.0]), [0.0, 2.0, 12.0]);
        assert_eq!(integral(&[], &[]), [0.0; 0]);
    }
}

#[cfg(test)]
mod l1_tests {
    use super::*;

    #[test]
    fn l1_ratio_by_hand() {
        assert_eq!(l1_ratio(&[1.0, -2.0, 1.0], &[1.5, -2.0, 0.5]), 0.25);
        assert_eq!(l1_ratio(&[0.0, 0.0], &[0.0, 0.0]), 0.0);
        assert_eq!(l1_ratio(&[0.0], &[1.0]), f64::INFINITY);
    }
}

#[cfg(test)]
mod derivative_tests {
    use super::*;

    #[test]
    fn derivative_of_a_parabola_is_exact_inside() {
        let t: Vec<f64> = (0..10).map(|i| f64::from(i) * 0.5).collect();
        let v: Vec<f64> = t.iter().map(|t| t * t).collect();
        let rate = derivative(&t, &v);
        assert_eq!(rate[4], 4.0);
        assert_eq!(rate[0], 0.5, "one-sided at the end");
    }
}

#[cfg(test)]
mod resample_tests {
    use super::*;

    #[test]
    fn interpolates_within_and_refuses_beyond() {
        let (t, v) = ([0.0, 1.0, 3.0], [0.0, 10.0, 30.0]);
        assert_eq!(
            interpolate(&t, &v, &[0.0, 0.5, 1.0, 2.0, 3.0]).unwrap(),
            [0.0, 5.0, 10.0, 20.0, 30.0]
        );
        assert_eq!(
            interpolate(&t, &v, &[3.5]).unwrap_err().to_string(),
            "time 3.5 s lies outside the history (0 s to 3 s)"
        );
    }
}
