//! The training curves of a model, one force of each case, and how they are blended.

use crate::curve::Envelope;
use crate::error::{Error, ErrorCode};

/// One force of one training case over its loading branch.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CaseCurve {
    pub speed_m_per_s: f64,
    /// Values of the further features.
    pub features: Vec<f64>,
    envelope: Envelope,
    /// Closing speed in m/s over deflection, if it is known: an envelope by its shape.
    closing: Option<Envelope>,
}

impl CaseCurve {
    pub(crate) fn new(
        speed_m_per_s: f64,
        features: Vec<f64>,
        deflection_m: Vec<f64>,
        force_n: Vec<f64>,
        closing_m_per_s: Vec<f64>,
    ) -> Result<Self, Error> {
        let closing = if closing_m_per_s.is_empty() {
            None
        } else {
            Some(
                Envelope::new(deflection_m.clone(), closing_m_per_s)
                    .map_err(|e| e.coded(ErrorCode::Model))?,
            )
        };
        let envelope =
            Envelope::new(deflection_m, force_n).map_err(|e| e.coded(ErrorCode::Model))?;
        Ok(Self { speed_m_per_s, features, envelope, closing })
    }

    pub(crate) fn envelope(&self) -> &Envelope {
        &self.envelope
    }

    /// The same curve with forces in N made of its deflections and forces, which are finite.
    pub(crate) fn map_forces(&self, force_n: impl Fn(f64, f64) -> f64) -> Self {
        let (d, f) = (self.envelope.deflection_m(), self.envelope.force_n());
        let mapped = d.iter().zip(f).map(|(&d, &f)| force_n(d, f)).collect();
        // Deflections are those of an envelope already.
        let envelope = Envelope::new(d.to_vec(), mapped).unwrap_or_else(|_| self.envelope.clone());
        Self { envelope, ..self.clone() }
    }

    /// Force in N; the last one beyond the end.
    pub(crate) fn force_at(&self, deflection_m: f64) -> f64 {
        self.envelope.force_at(deflection_m)
    }

    /// Maximum deflection, in m.
    pub(crate) fn end_m(&self) -> f64 {
        self.envelope.end_m()
    }

    pub(crate) fn reaches(&self, deflection_m: f64) -> bool {
        deflection_m <= self.end_m()
    }

    /// Closing speed in m/s; 0 beyond the end, and the impact speed where it is not known.
    pub(crate) fn closing_at(&self, deflection_m: f64) -> f64 {
        match &self.closing {
            None => self.speed_m_per_s,
            Some(_) if !self.reaches(deflection_m) => 0.0,
            Some(closing) => closing.force_at(deflection_m).max(0.0),
        }
    }
}

/// The two neighbours of `v` among increasing speeds and the share of the second, 0 to 1:
/// beyond the ends the outermost alone.
pub(crate) fn neighbours(speeds: &[f64], v: f64) -> (usize, usize, f64) {
    let above = speeds.partition_point(|&s| s <= v);
    match above {
        0 => (0, 0, 0.0),
        n if n == speeds.len() => (n - 1, n - 1, 0.0),
        n => (n - 1, n, (v - speeds[n - 1]) / (speeds[n] - speeds[n - 1])),
    }
}

/// Linear interpolation over points of increasing abscissa, held beyond the ends; `None`
/// without points.
pub(crate) fn interpolate_held(points: &[(f64, f64)], x: f64) -> Option<f64> {
    let (first, last) = (points.first()?, points.last()?);
    if x <= first.0 {
        return Some(first.1);
    }
    if x >= last.0 {
        return Some(last.1);
    }
    let i = points.partition_point(|p| p.0 <= x);
    let (a, b) = (points[i - 1], points[i]);
    Some(a.1 + (b.1 - a.1) * (x - a.0) / (b.0 - a.0))
}

/// Coefficients of the polynomial of `degree` (0, 1 or 2) with the least squares, constant
/// first, over centred and scaled abscissae; `None` if the points do not determine it.
pub(crate) fn least_squares(points: &[(f64, f64)], degree: usize) -> Option<Polynomial> {
    let n = points.len();
    if n <= degree || degree > 2 {
        return None;
    }
    let centre = points.iter().map(|p| p.0).sum::<f64>() / n as f64;
    let scale = points.iter().map(|p| (p.0 - centre).abs()).fold(0.0, f64::max).max(1e-300);
    let size = degree + 1;
    let mut m = [[0.0; 4]; 3];
    for &(x, y) in points {
        let t = (x - centre) / scale;
        let powers = [1.0, t, t * t];
        for r in 0..size {
            for c in 0..size {
                m[r][c] += powers[r] * powers[c];
            }
            m[r][3] += powers[r] * y;
        }
    }
    // Gauss with pivoting on at most three equations.
    for k in 0..size {
        let pivot = (k..size).max_by(|&a, &b| m[a][k].abs().total_cmp(&m[b][k].abs()))?;
        m.swap(k, pivot);
        if m[k][k].abs() < 1e-10 * n as f64 {
            return None;
        }
        for r in 0..size {
            if r != k {
                let factor = m[r][k] / m[k][k];
                let row = m[k];
                m[r].iter_mut().zip(row).skip(k).for_each(|(x, p)| *x -= factor * p);
            }
        }
    }
    let mut coefficients = [0.0; 3];
    for (k, c) in coefficients.iter_mut().enumerate().take(size) {
        *c = m[k][3] / m[k][k];
    }
    Some(Polynomial { centre, scale, coefficients })
}

/// A polynomial of up to second degree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Polynomial {
    centre: f64,
    scale: f64,
    coefficients: [f64; 3],
}

impl Polynomial {
    pub(crate) fn at(&self, x: f64) -> f64 {
        let t = (x - self.centre) / self.scale;
        let [a, b, c] = self.coefficients;
        a + t * (b + t * c)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn least_squares_repeats_its_polynomial() {
        let f = |x: f64| 3.0 - 2.0 * x + 0.5 * x * x;
        let points: Vec<(f64, f64)> = [1.0, 2.0, 4.0, 7.0].map(|x| (x, f(x))).to_vec();
        let fit = least_squares(&points, 2).unwrap();
        assert!((fit.at(5.5) - f(5.5)).abs() < 1e-10);
        assert!(least_squares(&points[..2], 2).is_none());
        let line = least_squares(&[(0.0, 0.0), (1.0, 3.0), (2.0, 0.0)], 1).unwrap();
        assert!((line.at(9.0) - 1.0).abs() < 1e-12, "the mean, as the slope is 0");
        assert!(least_squares(&[(1.0, 0.0), (1.0, 3.0)], 1).is_none());
    }

    #[test]
    fn neighbours_hold_the_outermost() {
        let speeds = [1.0, 2.0, 4.0];
        assert_eq!(neighbours(&speeds, 0.5), (0, 0, 0.0));
        assert_eq!(neighbours(&speeds, 3.0), (1, 2, 0.5));
        assert_eq!(neighbours(&speeds, 2.0), (1, 2, 0.0));
        assert_eq!(neighbours(&speeds, 9.0), (2, 2, 0.0));
    }
}
