//! Watch: extremes and events of a run between its outputs.

use super::integrator::{Record, Run};
use super::rows::{LANES, Place, Places, Row, Rows, each, larger};
use super::train::Chain;

/// Window of the moving mean deceleration, in s (EN 15227).
const MOVING_MEAN_S: f64 = 0.120;

/// Between outputs further apart the largest mean would be missed by too much.
const COARSEST_S: f64 = 0.005;

pub(super) struct Watch {
    interfaces: Vec<Extremes>,
    bodies: Vec<Phase>,
    places: Places,
    present: Present,
}

/// What every step and output asks of all bodies.
struct Present {
    /// 1 for bodies that no force acts on, else 0.
    is_free: Rows,
    /// Between these an acceleration is nothing new: 0 and ±∞ in a span of known sign, else both
    /// 0.
    least: Rows,
    most: Rows,
    /// Accelerations by contacts at the last look.
    seen_a: Rows,
    seen_s: f64,
    /// Largest magnitude of the acceleration known of the open span.
    peak: Rows,
    /// Speed before the contact.
    free_speed: Rows,
    /// Speeds at the last output.
    time_s: f64,
    v: Rows,
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
    /// Largest magnitude of the acceleration at outputs and ends.
    peak: f64,
}

#[derive(Clone, Default)]
struct Phase {
    mass_kg: f64,
    open: Option<Span>,
    closed: Vec<Span>,
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
    pub fn new(chain: &Chain, places: &Places) -> Self {
        let bodies = chain.bodies();
        let of = |value: &dyn Fn(usize) -> f64| Rows::of(places, bodies.len(), value);
        let none = || of(&|_| 0.0);
        let present = Present {
            is_free: of(&|_| 1.0),
            least: none(),
            most: none(),
            seen_a: none(),
            seen_s: 0.0,
            peak: none(),
            free_speed: of(&|i| bodies[i].speed_m_per_s),
            time_s: 0.0,
            v: none(),
        };
        let phase = |b: &super::Body| Phase { mass_kg: b.mass_kg, ..Phase::default() };
        Self {
            interfaces: vec![Extremes::default(); chain.interfaces().len()],
            bodies: bodies.iter().map(phase).collect(),
            places: places.clone(),
            present,
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
        let place = self.places.of(i);
        match (touched, self.bodies[i].open) {
            (true, None) => {
                let begin_v = self.present.free_speed[place];
                self.open(i, place, Span { begin_s: time_s, begin_v, ..Span::default() });
            }
            (false, Some(_)) => {
                self.close_span(i, place, time_s, speed);
                self.present.free_speed[place] = speed;
            }
            _ => {}
        }
    }

    fn open(&mut self, i: usize, place: Place, span: Span) {
        self.bodies[i].open = Some(span);
        let present = &mut self.present;
        (present.is_free[place], present.peak[place]) = (0.0, 0.0);
        (present.least[place], present.most[place]) = (0.0, 0.0);
    }

    fn close_span(&mut self, i: usize, place: Place, end_s: f64, end_v: f64) {
        let (phase, present) = (&mut self.bodies[i], &mut self.present);
        present.is_free[place] = 1.0;
        (present.least[place], present.most[place]) = (0.0, 0.0);
        let peak = present.peak[place];
        if let Some(span) = phase.open.take()
            && phase.closed.len() < MOST_SPANS
        {
            phase.closed.push(Span { end_s, end_v, peak, ..span });
        }
    }

    pub fn output_interface(&mut self, k: usize, deflection_m: f64, force_n: f64, time_s: f64) {
        self.peak_n(k, force_n);
        let seen = &mut self.interfaces[k];
        if deflection_m > seen.max_deflection_m {
            (seen.max_deflection_m, seen.max_deflection_time_s) = (deflection_m, time_s);
        }
    }

    /// Whether the accelerations by contact forces are news to [`Self::follow`].
    #[inline(always)]
    pub fn is_news<const N: usize>(&self, a: &Rows) -> bool {
        let n = self.places.known::<N>();
        let (least, most) = (self.present.least.values(n), self.present.most.values(n));
        let mut outside: Row = [0.0; LANES];
        for (c, a) in a.values(n).iter().enumerate() {
            let below = each(|j| least[c][j] - a[j]);
            outside = larger(outside, larger(below, each(|j| a[j] - most[c][j])));
        }
        outside.iter().any(|&o| o > 0.0)
    }

    /// Closes the span of body `i` where its net force has changed its sign since the last look;
    /// learns the sign of a new one; opens those that no contact has announced: of couplings that
    /// pull, and where a curve begins without force.
    pub fn follow(&mut self, i: usize, end_s: f64, end_v: f64, end_a: f64) {
        let place = self.places.of(i);
        let present = &self.present;
        let (start_s, start_a) = (present.seen_s, present.seen_a[place]);
        if end_a == 0.0 || end_a >= present.least[place] && end_a <= present.most[place] {
            return;
        }
        if self.bodies[i].open.is_none() {
            // As if the force had grown evenly since it began.
            let begin_v = present.free_speed[place];
            let since_s = 2.0 * (end_v - begin_v) / end_a;
            let begin_s = end_s - since_s.clamp(0.0, end_s - start_s);
            self.open(i, place, Span { begin_s, begin_v, ..Span::default() });
        } else if present.least[place] != present.most[place] {
            let left_s = (end_s - start_s) * (end_a / (end_a - start_a)).clamp(0.0, 1.0);
            let (begin_s, begin_v) = (end_s - left_s, end_v - 0.5 * end_a * left_s);
            self.present.peak[place] = present.peak[place].max(start_a.abs());
            self.close_span(i, place, begin_s, begin_v);
            self.open(i, place, Span { begin_s, begin_v, ..Span::default() });
        }
        let present = &mut self.present;
        present.peak[place] = end_a.abs();
        match end_a > 0.0 {
            true => present.most[place] = f64::INFINITY,
            false => present.least[place] = f64::NEG_INFINITY,
        }
    }

    /// Ends a look at the accelerations by contact forces.
    #[inline(always)]
    pub fn looked<const N: usize>(&mut self, a: &Rows, at_s: f64) {
        let n = self.places.known::<N>();
        self.present.seen_a.values_mut(n).copy_from_slice(a.values(n));
        self.present.seen_s = at_s;
    }

    /// Speeds of all bodies at an output, and accelerations by contact forces.
    #[inline(always)]
    pub fn output_bodies<const N: usize>(&mut self, v: &Rows, a: &Rows, time_s: f64) {
        let n = self.places.known::<N>();
        let (vs, accelerations) = (v.values(n), a.values(n));
        let Present { is_free, peak, free_speed, .. } = &mut self.present;
        let (is_free, peak) = (is_free.values(n), peak.values_mut(n));
        let free_speed = free_speed.values_mut(n);
        for c in 0..n {
            let (v, a) = (vs[c], accelerations[c]);
            peak[c] = larger(peak[c], each(|j| a[j].abs()));
            free_speed[c] = each(|j| if is_free[c][j] > 0.0 { v[j] } else { free_speed[c][j] });
        }
        self.present.v.values_mut(n).copy_from_slice(vs);
        self.present.time_s = time_s;
    }

    /// Fills in the summary; `interval_s` lies between the outputs.
    pub fn close(mut self, run: &mut Run, record: Record, interval_s: f64) {
        for i in 0..self.bodies.len() {
            let place = self.places.of(i);
            self.close_span(i, place, self.present.time_s, self.present.v[place]);
            run.bodies[i].final_v_m_per_s = self.present.v[place];
        }
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
        for (history, phase) in run.bodies.iter_mut().zip(self.bodies) {
            history.moving_mean_deceleration_m_per_s2 = moving_mean(&history.v_m_per_s, interval_s);
            if record == Record::Summary {
                history.v_m_per_s = Vec::new();
            }
            history.mean_deceleration_m_per_s2 = phase.mean_deceleration();
        }
    }
}

impl Phase {
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
    let back = (back as usize).max(1);
    let now = speeds.get(back..)?;
    let (before, after) = (&speeds[..now.len()], &speeds[1..][..now.len()]);
    let larger = |a: f64, b: f64| if b.abs() > a.abs() { b } else { a };
    let fall = |before: f64, after: f64, now: f64| before + share * (after - before) - now;
    let mut most = [0.0; LANES];
    let (rows, rest) = now.as_chunks::<LANES>();
    for ((now, before), after) in
        rows.iter().zip(before.as_chunks::<LANES>().0).zip(after.as_chunks::<LANES>().0)
    {
        most = each(|j| larger(most[j], fall(before[j], after[j], now[j])));
    }
    let mut most = most.into_iter().fold(0.0, larger);
    for j in now.len() - rest.len()..now.len() {
        most = larger(most, fall(before[j], after[j], now[j]));
    }
    (!now.is_empty()).then_some(most / MOVING_MEAN_S)
}
