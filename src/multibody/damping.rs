//! Dampers: a coefficient over the closing speed.

use crate::error::{Error, error};
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

impl Damping {
    /// # Errors
    /// It names the first point that breaks the invariant, counted from 1.
    pub fn new(speed_m_per_s: Vec<f64>, coefficient_n_s_per_m: Vec<f64>) -> Result<Self, Error> {
        let (speeds, coefficients) = (speed_m_per_s.len(), coefficient_n_s_per_m.len());
        if speeds != coefficients || speeds == 0 {
            return Err(error!(
                Other,
                "a damper needs as many coefficients as speeds, at least one: found {speeds} and {coefficients}"
            ));
        }
        let mut before = -f64::MIN_POSITIVE;
        for (i, (&v, &c)) in speed_m_per_s.iter().zip(&coefficient_n_s_per_m).enumerate() {
            if !(v > before && v >= 0.0 && v.is_finite() && c >= 0.0 && c.is_finite()) {
                return Err(error!(
                    Other,
                    "point {} of the damper is ({v} m/s, {c} N s/m): expected speeds that increase from 0 or more and coefficients of 0 or more",
                    i + 1
                ));
            }
            before = v;
        }
        Ok(Self { speed_m_per_s, coefficient_n_s_per_m })
    }

    /// The same coefficient in N s/m at all speeds.
    ///
    /// # Errors
    /// For a coefficient below 0.
    pub fn constant(coefficient_n_s_per_m: f64) -> Result<Self, Error> {
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
