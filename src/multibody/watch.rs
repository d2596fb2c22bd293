//! Watch: extremes and events of a run between its outputs.

use super::integrator::{Record, Run};
use super::train::Chain;

/// Window of the moving mean deceleration, in s (EN 15227).
const MOVING_MEAN_S: f64 = 0.120;

/// Between outputs further apart the largest mean would be missed by too much.
const COARSEST_S: f64 = 0.005;

pub(super) struct Watch {
    interfaces: Vec<Extremes>,
    bodies: Vec<Phase>,
}

#[derive(Clone, Default)]
struct Extremes {
    peak_n: f64,
    peak_tension_n: f64,
    max_extension_m: f64,
    max_deflection_m: f64,
    max_deflection_time_s: f64,
    /// When the deflection first stopped growing.
    common_velocity_s: Option<f64>,
    /// Rate of deflection when contact began, and when it ended for the first time.
    approach: Option<f64>,
    separation: Option<f64>,
}

/// A stretch of time in which a body's net contact force differs from zero, with one sign.
#[derive(Clone, Copy, Default)]
struct Span {
    begin_s: f64,
    begin_v: f64,
    end_s: f64,
    end_v: f64,
    /// Direction of the net force, 0 until it is known.
    sign: f64,
    /// Largest magnitude of the acceleration at the outputs.
    peak: f64,
}

#[derive(Clone, Default)]
struct Phase {
    mass_kg: f64,
    /// Speed before the contact.
    free_speed: f64,
    open: Option<Span>,
    closed: Vec<Span>,
    /// The last output: time, speed, acceleration.
    last: (f64, f64, f64),
}

/// Contacts of which the first that counts is among them.
const MOST_SPANS: usize = 64;
/// A contact counts if its net force reaches this and this share of the body's largest, as in
/// finding the contact of an FE run.
const LEAST_N: f64 = 1e3;
const LEAST_SHARE: f64 = 0.005;
/// No restitution of what meets more slowly, in m/s: it would be a ratio to nothing.
const SLOWEST_APPROACH: f64 = 0.1;

impl Watch {
    pub fn new(chain: &Chain) -> Self {
        let body = |b: &super::Body| Phase {
            mass_kg: b.mass_kg,
            free_speed: b.speed_m_per_s,
            ..Phase::default()
        };
        Self {
            interfaces: vec![Extremes::default(); chain.interfaces().len()],
            bodies: chain.bodies().iter().map(body).collect(),
        }
    }

    /// Contact began at interface `k` with this closing speed.
    pub fn contact(&mut self, k: usize, closing: f64) {
        let seen = &mut self.interfaces[k];
        seen.approach = seen.approach.or(Some(closing));
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
        let seen = &mut self.interfaces[k];
        if pulls {
            seen.max_extension_m = seen.max_extension_m.max(largest_m);
            return;
        }
        seen.common_velocity_s = seen.common_velocity_s.or(Some(time_s));
        if largest_m > seen.max_deflection_m {
            (seen.max_deflection_m, seen.max_deflection_time_s) = (largest_m, time_s);
        }
    }

    pub fn peak_n(&mut self, k: usize, force_n: f64) {
        let seen = &mut self.interfaces[k];
        seen.peak_n = seen.peak_n.max(force_n);
    }

    /// Largest tension and extension that are known beside those of turns.
    pub fn tension(&mut self, k: usize, force_n: f64, extension_m: f64) {
        let seen = &mut self.interfaces[k];
        seen.peak_tension_n = seen.peak_tension_n.max(force_n);
        seen.max_extension_m = seen.max_extension_m.max(extension_m);
    }

    /// Contact forces on body `i` act or have ended at `time_s`, with its speed.
    pub fn body(&mut self, i: usize, touched: bool, time_s: f64, speed: f64) {
        let phase = &mut self.bodies[i];
        match (touched, phase.open) {
            (true, None) => {
                let begin_v = phase.free_speed;
                phase.open = Some(Span { begin_s: time_s, begin_v, ..Span::default() });
            }
            (false, Some(_)) => {
                phase.close(time_s, speed);
                phase.free_speed = speed;
            }
            _ => {}
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
        let (before_s, before_v, before_a) = phase.last;
        match &mut phase.open {
            None => phase.free_speed = v,
            Some(span) => {
                if span.sign * a < 0.0 {
                    // The net force has changed its sign since the last output.
                    let share = before_a / (before_a - a);
                    let until = (time_s - before_s) * share.clamp(0.0, 1.0);
                    let at_v = before_v + 0.5 * before_a * until;
                    phase.close(before_s + until, at_v);
                    let (begin_s, begin_v) = (before_s + until, at_v);
                    phase.open = Some(Span { begin_s, begin_v, ..Span::default() });
                }
                if let Some(span) = &mut phase.open {
                    span.peak = span.peak.max(a.abs());
                    if span.sign == 0.0 && a != 0.0 {
                        span.sign = a.signum();
                    }
                }
            }
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
                (Some(approach), Some(separation)) if approach >= SLOWEST_APPROACH => {
                    Some(separation / approach)
                }
                _ => None,
            };
            history.peak_tension_n = seen.peak_tension_n;
            history.max_extension_m = seen.max_extension_m;
        }
        for (history, mut phase) in run.bodies.iter_mut().zip(self.bodies) {
            let (last_s, last_v, _) = phase.last;
            phase.close(last_s, last_v);
            history.final_v_m_per_s = last_v;
            history.moving_mean_deceleration_m_per_s2 = moving_mean(&history.v_m_per_s, interval_s);
            if record == Record::Summary {
                history.v_m_per_s = Vec::new();
            }
            history.mean_deceleration_m_per_s2 = phase.mean_deceleration();
        }
    }
}

impl Phase {
    fn close(&mut self, time_s: f64, speed: f64) {
        if let Some(span) = self.open.take()
            && self.closed.len() < MOST_SPANS
        {
            self.closed.push(Span { end_s: time_s, end_v: speed, ..span });
        }
    }

    /// Over the first contact that counts; 0 without one.
    fn mean_deceleration(&self) -> f64 {
        let most = self.closed.iter().map(|s| s.peak).fold(0.0, f64::max);
        let counts = |s: &&Span| {
            s.peak >= LEAST_SHARE * most && s.peak * self.mass_kg >= LEAST_N && s.end_s > s.begin_s
        };
        self.closed
            .iter()
            .find(counts)
            .map_or(0.0, |s| (s.begin_v - s.end_v) / (s.end_s - s.begin_s))
    }
}

/// Mean deceleration over the 120 ms in which its magnitude is largest, from the speeds at the
/// ends.
fn moving_mean(speeds: &[f64], interval_s: f64) -> Option<f64> {
    if interval_s > COARSEST_S {
        return None;
    }
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
