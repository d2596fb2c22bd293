//! Body force: what moves the car body, from the rate of the deflection.

use super::loading::{loading_branch, loading_end};
use super::{Case, Curve, Envelope, cfc};
use crate::history::derivative;

/// Class of the filter: that of structural accelerations in SAE J211-1.
const CLASS: u32 = 60;

/// The motion of a case along its loading branch and at the end of it.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyMotion {
    /// Effective mass times deceleration over deflection, in N, CFC 60, never below 0.
    pub force: Envelope,
    /// Closing speed in m/s over deflection: an envelope by its shape, not a force.
    pub closing_speed: Envelope,
    /// Speed of separation in m/s when the body force has first fallen to zero after the
    /// largest deflection; `None` if the record ends before.
    pub rebound_speed_m_per_s: Option<f64>,
}

impl BodyMotion {
    /// Unloading stiffness from the end of the force that gives the rebound, in N/m.
    pub fn end_stiffness_n_per_m(&self, mass_kg: f64) -> Option<f64> {
        let top = self.force.force_at(self.force.end_m());
        let speed = self.rebound_speed_m_per_s?;
        Some(top * top / (mass_kg * speed * speed)).filter(|k| *k > 0.0 && k.is_finite())
    }
}

/// The body force `−m dv/dt` of the closing speed `v`, with the case's effective mass.
///
/// It differs from the contact force by the mass that the crush zone stops before the body
/// (an impact's first spike is the nose being stopped). Filtered with CFC 60 unless the
/// sampling is too coarse for it. `None` if the sampled states make no loading branch.
pub fn body_motion(case: &Case) -> Option<BodyMotion> {
    let sampled = &case.sampled;
    let speeds = &case.closing_speed_m_per_s;
    let mass = case.masses.effective_kg();
    let raw: Vec<f64> =
        derivative(sampled.time_s(), speeds).into_iter().map(|a| -mass * a).collect();
    let mut force_n = filtered(sampled.time_s(), raw);
    let end = loading_end(sampled);
    // The body does not yet feel the contact.
    force_n[0] = 0.0;
    let over_deflection = |values: Vec<f64>| {
        let curve =
            Curve::new(sampled.time_s().to_vec(), sampled.deflection_m().to_vec(), values).ok()?;
        Some(loading_branch(&curve).ok()?.envelope)
    };
    let rebound = (end + 1..speeds.len()).find(|&i| force_n[i] <= 0.0).map(|i| -speeds[i]);
    Some(BodyMotion {
        closing_speed: over_deflection(speeds.clone())?,
        force: over_deflection(force_n)?.pushing(),
        rebound_speed_m_per_s: rebound.filter(|&v| v > 0.0),
    })
}

/// CFC 60 of values at `time_s`, as they are if their interval is too coarse for it.
pub fn filtered(time_s: &[f64], values: Vec<f64>) -> Vec<f64> {
    match cfc::filter(CLASS, time_s, &values) {
        Ok(filtered) => filtered.values,
        Err(_) => values,
    }
}
