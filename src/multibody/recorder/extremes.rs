//! Extremes of an interface, and what happened first at it.

use super::super::run::InterfaceHistory;

/// No restitution of what meets more slowly, in m/s: it would be a ratio to nothing.
const SLOWEST_APPROACH_M_PER_S: f64 = 0.1;

/// What is known of an interface over all steps.
#[derive(Clone, Debug, Default)]
pub(in super::super) struct Extremes {
    peak_n: f64,
    peak_tension_n: f64,
    max_extension_m: f64,
    max_deflection_m: f64,
    max_deflection_time_s: f64,
    /// When the deflection first stopped growing.
    common_velocity_s: Option<f64>,
    /// Rate of deflection when contact began, and when it ended for the first time.
    approach_m_per_s: Option<f64>,
    separation_m_per_s: Option<f64>,
}

impl Extremes {
    pub(crate) fn contact_began(&mut self, closing_m_per_s: f64) {
        self.approach_m_per_s = self.approach_m_per_s.or(Some(closing_m_per_s));
    }

    pub(crate) fn released(&mut self, separation_m_per_s: f64) {
        if separation_m_per_s > 0.0 {
            self.separation_m_per_s = self.separation_m_per_s.or(Some(separation_m_per_s));
        }
    }

    pub(crate) fn turned(&mut self, largest_m: f64, time_s: f64) {
        self.common_velocity_s = self.common_velocity_s.or(Some(time_s));
        self.deflected(largest_m, time_s);
    }

    pub(crate) fn deflected(&mut self, deflection_m: f64, time_s: f64) {
        if deflection_m > self.max_deflection_m {
            (self.max_deflection_m, self.max_deflection_time_s) = (deflection_m, time_s);
        }
    }

    pub(crate) fn pressed(&mut self, force_n: f64) {
        self.peak_n = self.peak_n.max(force_n);
    }

    pub(crate) fn pulled(&mut self, tension_n: f64) {
        self.peak_tension_n = self.peak_tension_n.max(tension_n);
    }

    pub(crate) fn extended(&mut self, extension_m: f64) {
        self.max_extension_m = self.max_extension_m.max(extension_m);
    }

    /// Fills in the summary of the interface.
    pub(crate) fn close(self, history: &mut InterfaceHistory) {
        history.peak_force_n = self.peak_n;
        history.max_deflection_m = self.max_deflection_m;
        history.max_deflection_time_s = self.max_deflection_time_s;
        history.common_velocity_time_s = self.common_velocity_s;
        history.peak_tension_n = self.peak_tension_n;
        history.max_extension_m = self.max_extension_m;
        history.restitution = match (self.approach_m_per_s, self.separation_m_per_s) {
            (Some(approach), Some(separation)) if approach >= SLOWEST_APPROACH_M_PER_S => {
                Some(separation / approach)
            }
            _ => None,
        };
    }
}
