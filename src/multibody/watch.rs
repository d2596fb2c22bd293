//! Watch: extremes and events of a run between its outputs.

use super::integrator::{Record, Run};
use super::train::Chain;

/// Window of the moving mean deceleration, in s (EN 15227).
const MOVING_MEAN_S: f64 = 0.120;

pub(super) struct Watch {
    interfaces: Vec<Extremes>,
    bodies: Vec<Phase>,
}

#[derive(Clone, Default)]
struct Extremes {
    peak_n: f64,
    max_deflection_m: f64,
    max_deflection_time_s: f64,
    /// When the deflection first stopped growing.
    common_velocity_s: Option<f64>,
    /// Rate of deflection when contact began, and when it ended for the first time.
    approach: Option<f64>,
    separation: Option<f64>,
}

/// The first time a body's net contact force differs from zero.
#[derive(Clone, Default)]
struct Phase {
    begun_s: Option<f64>,
    ended: bool,
    entry_speed: f64,
    /// Direction of the net force.
    sign: f64,
    end_s: f64,
    end_speed: f64,
    /// The last output: time, speed, acceleration.
    last: (f64, f64, f64),
}

impl Watch {
    pub fn new(chain: &Chain) -> Self {
        let body = |b: &super::Body| Phase { entry_speed: b.speed_m_per_s, ..Phase::default() };
        Self {
            interfaces: vec![Extremes::default(); chain.interfaces().len()],
            bodies: chain.bodies().iter().map(body).collect(),
        }
    }

    /// Contact began at interface `k` with this closing speed.
    pub fn contact(&mut self, k: usize, closing: f64) {
        let seen = &mut self.interfaces[k];
        seen.approach = seen.approach.or(Some(closing).filter(|c| *c > 0.0));
    }

    /// The force of interface `k` has fallen to zero while it opened with this speed.
    pub fn opened(&mut self, k: usize, separation: f64) {
        let seen = &mut self.interfaces[k];
        if separation > 0.0 {
            seen.separation = seen.separation.or(Some(separation));
        }
    }

    /// The deflection of interface `k` was largest.
    pub fn turned(&mut self, pulls: bool, k: usize, largest_m: f64, time_s: f64) {
        if pulls {
            return;
        }
        let seen = &mut self.interfaces[k];
        seen.common_velocity_s = seen.common_velocity_s.or(Some(time_s));
        if largest_m > seen.max_deflection_m {
            (seen.max_deflection_m, seen.max_deflection_time_s) = (largest_m, time_s);
        }
    }

    pub fn peak_n(&mut self, k: usize, force_n: f64) {
        let seen = &mut self.interfaces[k];
        seen.peak_n = seen.peak_n.max(force_n);
    }

    /// Contact forces on body `i` began or ended at `time_s`, with its speed.
    pub fn body(&mut self, i: usize, touched: bool, time_s: f64, speed: f64) {
        let phase = &mut self.bodies[i];
        if touched && phase.begun_s.is_none() {
            phase.begun_s = Some(time_s);
        } else if !touched && phase.begun_s.is_some() {
            phase.end(time_s, speed);
        }
    }

    pub fn output_interface(&mut self, k: usize, deflection_m: f64, force_n: f64, time_s: f64) {
        self.peak_n(k, force_n);
        let seen = &mut self.interfaces[k];
        if deflection_m > seen.max_deflection_m {
            (seen.max_deflection_m, seen.max_deflection_time_s) = (deflection_m, time_s);
        }
    }

    pub fn output_body(&mut self, i: usize, v: f64, a: f64, time_s: f64) {
        let phase = &mut self.bodies[i];
        match phase.begun_s {
            None => phase.entry_speed = v,
            Some(_) if phase.sign == 0.0 => phase.sign = a.signum() * f64::from(a != 0.0),
            Some(_) if a * phase.sign < 0.0 => {
                // The net force has changed its sign since the last output.
                let (before_s, before_v, before_a) = phase.last;
                let until = (time_s - before_s) * before_a / (before_a - a);
                phase.end(before_s + until, before_v + 0.5 * before_a * until);
            }
            Some(_) => {}
        }
        phase.last = (time_s, v, a);
    }

    /// Fills in the summary; `interval_s` lies between the outputs.
    pub fn close(self, run: &mut Run, record: Record, interval_s: f64) {
        for (history, seen) in run.interfaces.iter_mut().zip(self.interfaces) {
            history.peak_force_n = seen.peak_n;
            history.max_deflection_m = seen.max_deflection_m;
            history.max_deflection_time_s = seen.max_deflection_time_s;
            history.common_velocity_time_s = seen.common_velocity_s;
            history.restitution = match (seen.approach, seen.separation) {
                (Some(approach), Some(separation)) => Some(separation / approach),
                _ => None,
            };
        }
        for (history, mut phase) in run.bodies.iter_mut().zip(self.bodies) {
            let (last_s, last_v, _) = phase.last;
            phase.end(last_s, last_v);
            history.final_v_m_per_s = last_v;
            history.moving_mean_deceleration_m_per_s2 = moving_mean(&history.v_m_per_s, interval_s);
            if record == Record::Summary {
                history.v_m_per_s = Vec::new();
            }
            let duration = phase.end_s - phase.begun_s.unwrap_or(phase.end_s);
            if duration > 0.0 {
                history.mean_deceleration_m_per_s2 =
                    (phase.entry_speed - phase.end_speed) / duration;
            }
        }
    }
}

impl Phase {
    fn end(&mut self, time_s: f64, speed: f64) {
        if !self.ended {
            (self.ended, self.end_s, self.end_speed) = (true, time_s, speed);
        }
    }
}

/// Mean deceleration over the 120 ms in which its magnitude is largest, from the speeds at the
/// ends.
fn moving_mean(speeds: &[f64], interval_s: f64) -> Option<f64> {
    let window = MOVING_MEAN_S / interval_s;
    // Rounding shall not make 160 intervals of 0.75 ms a little more than 120 ms.
    let back = (window - 1e-9).ceil();
    let share = back - window;
    let back = back as usize;
    let mean = |j: usize| {
        let (before, after) = (speeds[j - back], speeds[j - back + 1]);
        (before + share * (after - before) - speeds[j]) / MOVING_MEAN_S
    };
    (back.max(1)..speeds.len()).map(mean).reduce(|a, b| if b.abs() > a.abs() { b } else { a })
}
