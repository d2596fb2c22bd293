//! The relative L1 difference of two signals.

/// `Σ|p − r| / Σ|r|`: the headline error for velocity, acceleration and force.
///
/// Equal lengths, same times or deflections. Infinite if the reference is all zero and
/// the prediction is not; 0 if both are.
pub fn l1_ratio(reference: &[f64], prediction: &[f64]) -> f64 {
    let difference: f64 = reference.iter().zip(prediction).map(|(r, p)| (p - r).abs()).sum();
    let scale: f64 = reference.iter().map(|r| r.abs()).sum();
    if difference == 0.0 { 0.0 } else { difference / scale }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn l1_ratio_by_hand() {
        assert_eq!(l1_ratio(&[1.0, -2.0, 1.0], &[1.5, -2.0, 0.5]), 0.25);
        assert_eq!(l1_ratio(&[0.0, 0.0], &[0.0, 0.0]), 0.0);
        assert_eq!(l1_ratio(&[0.0], &[1.0]), f64::INFINITY);
    }
}
