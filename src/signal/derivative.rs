//! The rate of a signal.

/// Rate of `values` over `time`: central differences, one-sided at both ends.
///
/// `time`: strictly increasing, at least two. Over an output interval `h` the result is
/// a mean over `2 h`, as the contact forces derived from impulses are.
pub fn derivative(time: &[f64], values: &[f64]) -> Vec<f64> {
    let last = values.len() - 1;
    (0..values.len())
        .map(|i| {
            let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
            (values[b] - values[a]) / (time[b] - time[a])
        })
        .collect()
}

#[cfg(test)]
mod tests {
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
