//! The integral of a signal.

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integral_of_a_line_is_exact() {
        assert_eq!(integral(&[0.0, 1.0, 3.0], &[1.0, 3.0, 7.0]), [0.0, 2.0, 12.0]);
        assert_eq!(integral(&[], &[]), [0.0; 0]);
    }
}
