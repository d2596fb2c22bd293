//! Rating: how far a prediction is from its reference.

/// `Σ|p − r| / Σ|r|`: the headline error for velocity, acceleration and force.
///
/// Equal lengths, same times or deflections. Infinite if the reference is all zero and
/// the prediction is not; 0 if both are.
pub fn l1_ratio(reference: &[f64], prediction: &[f64]) -> f64 {
    let difference: f64 = reference.iter().zip(prediction).map(|(r, p)| (p - r).abs()).sum();
    let scale: f64 = reference.iter().map(|r| r.abs()).sum();
    if difference == 0.0 { 0.0 } else { difference / scale }
}

/// Indices of the local maxima of `values` whose prominence is at least `prominence`.
///
/// Prominence is the height over the higher of the two lowest values that must be passed on
/// the way to a larger maximum, or to the end. Of a plateau the first point counts; the
/// ends count if the values fall from them.
pub fn peaks(values: &[f64], prominence: f64) -> Vec<usize> {
    let n = values.len();
    let rises = |i: usize| i == 0 || values[i - 1] < values[i];
    let falls = |i: usize| {
        let after = values[i..].iter().find(|&&v| v != values[i]);
        after.is_none_or(|&v| v < values[i])
    };
    let saddle = |side: &mut dyn Iterator<Item = &f64>, top: f64| {
        let (mut lowest, mut higher) = (top, false);
        for &v in side {
            if v > top {
                higher = true;
                break;
            }
            lowest = lowest.min(v);
        }
        (lowest, higher)
    };
    (0..n)
        .filter(|&i| rises(i) && falls(i))
        .filter(|&i| {
            let top = values[i];
            let (left, left_higher) = saddle(&mut values[..i].iter().rev(), top);
            let (right, right_higher) = saddle(&mut values[i + 1..].iter(), top);
            let base = match (left_higher, right_higher) {
                (true, false) => left,
                (false, true) => right,
                // The highest of all, or between two higher ones.
                (false, false) => left.min(right),
                (true, true) => left.max(right),
            };
            top - base >= prominence
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_by_prominence() {
        let values = [0.0, 3.0, 1.0, 1.5, 1.2, 5.0, 5.0, 2.0, 4.0];
        assert_eq!(peaks(&values, 1.0), [1, 5, 8]);
        assert_eq!(peaks(&values, 0.2), [1, 3, 5, 8]);
        assert_eq!(peaks(&values, 2.5), [5]);
        assert_eq!(peaks(&[2.0, 1.0, 3.0], 0.5), [0, 2]);
        assert_eq!(peaks(&[1.0, 1.0], 0.5), [] as [usize; 0]);
    }

    #[test]
    fn l1_ratio_by_hand() {
        assert_eq!(l1_ratio(&[1.0, -2.0, 1.0], &[1.5, -2.0, 0.5]), 0.25);
        assert_eq!(l1_ratio(&[0.0, 0.0], &[0.0, 0.0]), 0.0);
        assert_eq!(l1_ratio(&[0.0], &[1.0]), f64::INFINITY);
    }
}
