//! Corridor: how near to the reference a prediction stays, sample by sample.

/// Half width of the inner corridor, as a share of the reference's largest magnitude.
const INNER: f64 = 0.05;
/// Half width of the outer corridor.
const OUTER: f64 = 0.5;
/// Exponent between the two.
const EXPONENT: i32 = 2;

/// Mean over the samples of 1 inside the inner corridor, 0 outside the outer one, and
/// `((b − |p − r|)/(b − a))²` between them. ISO/TS 18571:2014 and CORA have the same.
///
/// Equal lengths, at least one. 0 to 1. Of a reference that is zero throughout the corridors
/// have no width: samples that are zero as well count 1.
pub(crate) fn corridor(reference: &[f64], prediction: &[f64]) -> f64 {
    let scale = reference.iter().fold(0.0, |m: f64, r| m.max(r.abs()));
    let (inner, outer) = (INNER * scale, OUTER * scale);
    let score = |(r, p): (&f64, &f64)| {
        let distance = (p - r).abs();
        if distance < inner || distance == 0.0 {
            1.0
        } else if distance > outer || outer == 0.0 {
            0.0
        } else {
            ((outer - distance) / (outer - inner)).powi(EXPONENT)
        }
    };
    reference.iter().zip(prediction).map(score).sum::<f64>() / reference.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corridor_by_hand() {
        // Distances of 0.2, 2.75, 5 and 6 in a signal of 10: inside, half way, edge, outside.
        let score = corridor(&[10.0, 0.0, 0.0, 0.0], &[10.2, 2.75, 5.0, -6.0]);
        assert!((score - (1.0 + 0.25 + 0.0 + 0.0) / 4.0).abs() < 1e-15);
    }

    #[test]
    fn a_reference_of_zeros_has_a_corridor_without_width() {
        assert_eq!(corridor(&[0.0, 0.0], &[0.0, 1e-9]), 0.5);
    }
}
