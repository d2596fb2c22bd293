//! Resampling of histories.

use crate::piecewise;

/// Why a history has no value at a time.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("time {time_s} s lies outside the history ({first_s} s to {last_s} s)")]
pub(crate) struct OutOfRange {
    /// The time that was asked for.
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
