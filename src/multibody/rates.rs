//! Forces that follow speeds: dampers, the rate effect of crush zones, and stopped mass.

use std::sync::Arc;

use crate::curve::Envelope;
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

/// A factor `1 + β √u` on the force of an interface, with `u` the share `share` of the speed at
/// which the body `behind` closes on the body `ahead`.
///
/// The two need not be the interface's own sides: both ends of neighbouring vehicles follow the
/// closing speed of the vehicles. If each followed its own rate, an end that slows down would
/// weaken at once and take all further crush.
#[derive(Clone, Debug, PartialEq)]
pub struct RateFactor {
    /// β in (s/m)^½, 0 at least.
    pub sensitivity_sqrt_s_per_m: f64,
    /// Of the closing speed, above 0: ½ where a curve counts the speed of one vehicle only.
    pub share: f64,
    /// Index of a body of the chain.
    pub behind: usize,
    /// The same; `None` for the wall.
    pub ahead: Option<usize>,
}

impl RateFactor {
    /// At a closing speed of the two bodies in m/s; 1 while they separate.
    pub(super) fn at(&self, closing_m_per_s: f64) -> f64 {
        1.0 + self.sensitivity_sqrt_s_per_m * (self.share * closing_m_per_s).max(0.0).sqrt()
    }

    /// Closing speed in m/s of its two bodies, whose speeds `speed_m_per_s` gives.
    pub(super) fn closing_m_per_s(&self, speed_m_per_s: impl Fn(usize) -> f64) -> f64 {
        speed_m_per_s(self.behind) - self.ahead.map_or(0.0, speed_m_per_s)
    }
}

/// A crush zone that stops part of its body's mass while it is crushed: one side of an interface
/// takes mass from the other, `m(δ) = max(m₀, m_s(δ))` at the maximum deflection δ so far, with
/// `m₀` its mass at first.
#[derive(Clone, Debug, PartialEq)]
pub struct Stopping {
    /// Index of the body that loses mass.
    pub body: usize,
    /// Index of the body that takes it.
    pub zone: usize,
    /// Stopped mass in kg over the deflection in m of the interface, never falling: an envelope
    /// by its shape, not a force. Held beyond its end.
    pub stopped_kg: Arc<Envelope>,
}

impl Stopping {
    /// Mass of the zone in kg once its maximum deflection was `largest_m`; `least_kg` at first.
    pub(super) fn zone_kg(&self, largest_m: f64, least_kg: f64) -> f64 {
        self.stopped_kg.force_at(largest_m.max(0.0)).max(least_kg)
    }

    /// Mass that is stopped per deflection, in kg/m.
    pub(super) fn rate_kg_per_m(&self, deflection_m: f64, least_kg: f64) -> f64 {
        let (d, m) = (self.stopped_kg.deflection_m(), self.stopped_kg.force_n());
        if deflection_m >= self.stopped_kg.end_m() || self.zone_kg(deflection_m, 0.0) < least_kg {
            return 0.0;
        }
        let i = piecewise::segment(d, deflection_m);
        (m[i + 1] - m[i]) / (d[i + 1] - d[i])
    }

    /// Whether the mass never falls and stays between 0 and `most_kg`.
    pub(super) fn is_sound(&self, most_kg: f64) -> bool {
        let m = self.stopped_kg.force_n();
        m[0] >= 0.0 && m.windows(2).all(|w| w[0] <= w[1]) && m[m.len() - 1] < most_kg
    }
}
