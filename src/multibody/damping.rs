//! Dampers: a coefficient over the closing speed.

use crate::piecewise;

/// A damper's coefficient over the magnitude of its speed, piecewise linear, held beyond its
/// ends.
///
/// Invariant: at least one point; speeds at least 0 and strictly increasing; coefficients
/// finite and at least 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Damping {
    speed_m_per_s: Vec<f64>,
    coefficient_n_s_per_m: Vec<f64>,
}

/// Why two columns are not a damper.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DampingError {
    /// Columns that differ in length or are empty.
    #[error(
        "a damper needs as many coefficients as speeds, at least one: found {speeds} and {coefficients}"
    )]
    Lengths {
        /// Number of speeds.
        speeds: usize,
        /// Number of coefficients.
        coefficients: usize,
    },
    /// A point that breaks the invariant.
    #[error(
        "point {point} of the damper is ({speed_m_per_s} m/s, {coefficient_n_s_per_m} N s/m): expected speeds that increase from 0 or more and coefficients of 0 or more"
    )]
    Point {
        /// Counted from 1.
        point: usize,
        /// Speed in m/s.
        speed_m_per_s: f64,
        /// Coefficient in N s/m.
        coefficient_n_s_per_m: f64,
    },
}

impl Damping {
    /// # Errors
    /// [`DampingError`] names the first point that breaks the invariant, counted from 1.
    pub fn new(
        speed_m_per_s: Vec<f64>,
        coefficient_n_s_per_m: Vec<f64>,
    ) -> Result<Self, DampingError> {
        let (speeds, coefficients) = (speed_m_per_s.len(), coefficient_n_s_per_m.len());
        if speeds != coefficients || speeds == 0 {
            return Err(DampingError::Lengths { speeds, coefficients });
        }
        let mut before = -f64::MIN_POSITIVE;
        for (i, (&v, &c)) in speed_m_per_s.iter().zip(&coefficient_n_s_per_m).enumerate() {
            if !(v > before && v >= 0.0 && v.is_finite() && c >= 0.0 && c.is_finite()) {
                return Err(DampingError::Point {
                    point: i + 1,
                    speed_m_per_s: v,
                    coefficient_n_s_per_m: c,
                });
            }
            before = v;
        }
        Ok(Self { speed_m_per_s, coefficient_n_s_per_m })
    }

    /// The same coefficient in N s/m at all speeds.
    ///
    /// # Errors
    /// [`DampingError::Point`] for a coefficient below 0.
    pub fn constant(coefficient_n_s_per_m: f64) -> Result<Self, DampingError> {
        Self::new(vec![0.0], vec![coefficient_n_s_per_m])
    }

    /// Coefficient in N s/m at a speed of either sign.
    pub(crate) fn at(&self, speed_m_per_s: f64) -> f64 {
        let (v, c) = (&self.speed_m_per_s, &self.coefficient_n_s_per_m);
        let speed = speed_m_per_s.abs();
        let last = v.len() - 1;
        if speed >= v[last] {
            c[last]
        } else if speed >= v[0] {
            piecewise::by_product(v, c, piecewise::segment(v, speed), speed)
        } else {
            c[0]
        }
    }

    /// Largest coefficient, in N s/m.
    pub(super) fn largest(&self) -> f64 {
        self.coefficient_n_s_per_m.iter().copied().fold(0.0, f64::max)
    }
}
