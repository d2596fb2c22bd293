//! EventRecorder: extremes and events of a run between its outputs.

use super::chain::Chain;
use super::rows::{LANES, Layout, Row, Rows, Slot, each, larger};
use super::run::{Record, Run};

/// Window of the moving mean deceleration, in s (EN 15227).
const MOVING_MEAN_S: f64 = 0.120;

/// Between outputs further apart the largest mean would be missed by too much.
const COARSEST_S: f64 = 0.005;

pub(super) struct EventRecorder {
    interfaces: Vec<Extremes>,
    bodies: Vec<Phase>,
    layout: Layout,
    present: Present,
}

/// What looks and outputs ask of all bodies.
struct Present {
    /// 1 for bodies that no force acts on, else 0.
    is_free: Rows,
    /// Between these an acceleration is nothing new: too small ones of a free body, all of its
    /// sign in a span of known sign; in a span that is still to be looked at, everything is new.
    least: Rows,
    most: Rows,
    /// Accelerations by contacts at the last look.
    seen_a: Rows,
    seen_s: f64,
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

/// A stretch of time in which a body's net contact force has one sign.
#[derive(Clone, Copy, Default)]
struct Span {
    begin_s: f64,
    begin_v: f64,
    /// Known once it is closed or fades.
    end_s: f64,
    end_v: f64,
    /// 0 until it is looked at.
    sign: f64,
    /// The force was too small to count at the last look.
    fades: bool,
    /// The run ended before the force did.
    is_cut: bool,
}

#[derive(Clone, Default)]
struct Phase {
    mass_kg: f64,
    open: Option<Span>,
    closed: Vec<Span>,
    /// Largest change of speed so far.
    most: f64,
}

/// Contacts that counted when they ended, of which the first that does so at last is among them.
const MOST_SPANS: usize = 64;
/// A contact counts while its net force exceeds this, as in finding the contact of an FE run, if it
/// changes the body's speed by this share of the largest change. Without it rounding would decide:
/// where vehicles touch without closing, what runs ahead of a shock grows from it, and where
/// neighbours come to press equally, the force dies away without an end. What is back at the next
/// look has not ended.
const LEAST_N: f64 = 1e3;
const LEAST_SHARE: f64 = 0.005;
/// Time between looks, if steps are not longer: a line joins the forces there.
pub(super) const LOOK_S: f64 = 0.25e-3;
/// No restitution of what meets more slowly, in m/s: it would be a ratio to nothing.
const SLOWEST_APPROACH: f64 = 0.1;

impl EventRecorder {
    pub fn new(chain: &Chain, layout: &Layout) -> Self {
        let bodies = chain.bodies();
        let of = |value: &dyn Fn(usize) -> f64| Rows::of(layout, bodies.len(), value);
        let none = || of(&|_| 0.0);
        let present = Present {
            is_free: of(&|_| 1.0),
            least: of(&|i| -LEAST_N / bodies[i].mass_kg),
            most: of(&|i| LEAST_N / bodies[i].mass_kg),
            seen_a: none(),
            seen_s: 0.0,
            free_speed: of(&|i| bodies[i].speed_m_per_s),
            time_s: 0.0,
            v: none(),
        };
        let phase = |b: &super::Body| Phase { mass_kg: b.mass_kg, ..Phase::default() };
        Self {
            interfaces: vec![Extremes::default(); chain.interfaces().len()],
            bodies: bodies.iter().map(phase).collect(),
            layout: layout.clone(),
            present,
        }
    }

    /// Contact began at interface `k` with this closing speed.
    pub fn contact(&mut self, k: usize, closing: f64) {
        let seen = &mut self.interfaces[k];
        seen.approach = seen.approach.or(Some(closing));
    }

    /// The force of interface `k` has fallen to zero while it opened with this speed.
    pub fn released(&mut self, k: usize, separation: f64) {
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
        let slot = self.layout.of(i);
        match (touched, self.bodies[i].open) {
            (true, None) => {
                let begin_v = self.present.free_speed[slot];
                self.open(i, slot, Span { begin_s: time_s, begin_v, ..Span::default() });
            }
            (false, Some(_)) => {
                self.close_span(i, slot, time_s, speed);
                self.present.free_speed[slot] = speed;
            }
            _ => {}
        }
    }

    fn open(&mut self, i: usize, slot: Slot, span: Span) {
        self.bodies[i].open = Some(span);
        self.present.is_free[slot] = 0.0;
        self.bound(slot, (f64::INFINITY, f64::NEG_INFINITY));
    }

    fn close_span(&mut self, i: usize, slot: Slot, end_s: f64, end_v: f64) {
        let Some(span) = self.free(i, slot) else { return };
        self.bodies[i].close(Span { end_s, end_v, ..span });
    }

    /// From here on no force acts on the body; the span that was open.
    fn free(&mut self, i: usize, slot: Slot) -> Option<Span> {
        let phase = &mut self.bodies[i];
        let (least, span) = (LEAST_N / phase.mass_kg, phase.open.take());
        self.present.is_free[slot] = 1.0;
        self.bound(slot, (-least, least));
        span
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
        let n = self.layout.known::<N>();
        let (least, most) = (self.present.least.values(n), self.present.most.values(n));
        let mut outside: Row = [0.0; LANES];
        for (c, a) in a.values(n).iter().enumerate() {
            let below = each(|j| least[c][j] - a[j]);
            outside = larger(outside, larger(below, each(|j| a[j] - most[c][j])));
        }
        outside.iter().any(|&o| o > 0.0)
    }

    /// Closes the span of body `i` if its net force has ended or changed its sign since the last
    /// look; learns the sign of a new one; opens those that no contact has announced.
    pub fn follow(&mut self, i: usize, end_s: f64, end_v: f64, end_a: f64) {
        let slot = self.layout.of(i);
        let present = &self.present;
        let (start_s, start_a) = (present.seen_s, present.seen_a[slot]);
        if end_a >= present.least[slot] && end_a <= present.most[slot] {
            return;
        }
        let least = LEAST_N / self.bodies[i].mass_kg;
        let is_small = end_a.abs() <= least;
        // As if the force had grown evenly since it began.
        let since_s = 2.0 * (end_v - present.free_speed[slot]) / end_a;
        let begin_s = end_s - since_s.clamp(0.0, end_s - start_s);
        let mut begin = (begin_s, present.free_speed[slot]);
        match self.bodies[i].open {
            None => {}
            Some(span) if span.sign == 0.0 => begin = (span.begin_s, span.begin_v),
            Some(_) if end_a == 0.0 => {
                self.close_span(i, slot, 0.5 * (start_s + end_s), end_v);
            }
            Some(span) if is_small && !span.fades => {
                // Somewhere in between.
                let ends_s = 0.5 * (start_s + end_s);
                self.bodies[i].open = Some(Span { fades: true, end_s: ends_s, end_v, ..span });
                return self.bound(slot, (f64::INFINITY, f64::NEG_INFINITY));
            }
            Some(span) if !is_small && end_a * span.sign > 0.0 => {
                self.bodies[i].open = Some(Span { fades: false, ..span });
                return self.bound_sign(slot, span.sign, least);
            }
            Some(span) if is_small && end_s - span.end_s < LOOK_S => return,
            Some(span) if span.fades => {
                begin = (span.end_s, span.end_v);
                self.close_span(i, slot, span.end_s, span.end_v);
            }
            Some(_) => {
                let left_s = (end_s - start_s) * (end_a / (end_a - start_a)).clamp(0.0, 1.0);
                begin = (end_s - left_s, end_v - 0.5 * end_a * left_s);
                self.close_span(i, slot, begin.0, begin.1);
            }
        }
        if is_small {
            self.free(i, slot);
            self.present.free_speed[slot] = end_v;
            return;
        }
        let ((begin_s, begin_v), sign) = (begin, end_a.signum());
        self.open(i, slot, Span { begin_s, begin_v, sign, ..Span::default() });
        self.bound_sign(slot, sign, least);
    }

    /// An acceleration between these will be nothing new.
    fn bound(&mut self, slot: Slot, (least, most): (f64, f64)) {
        (self.present.least[slot], self.present.most[slot]) = (least, most);
    }

    fn bound_sign(&mut self, slot: Slot, sign: f64, least: f64) {
        self.bound(
            slot,
            match sign > 0.0 {
                true => (least, f64::INFINITY),
                false => (f64::NEG_INFINITY, -least),
            },
        );
    }

    /// Ends a look at accelerations by contact forces.
    #[inline(always)]
    pub fn looked<const N: usize>(&mut self, a: &Rows, at_s: f64) {
        let n = self.layout.known::<N>();
        self.present.seen_a.values_mut(n).copy_from_slice(a.values(n));
        self.present.seen_s = at_s;
    }

    /// Speeds of all bodies at an output.
    #[inline(always)]
    pub fn output_bodies<const N: usize>(&mut self, v: &Rows, time_s: f64) {
        let n = self.layout.known::<N>();
        let vs = v.values(n);
        let Present { is_free, free_speed, .. } = &mut self.present;
        let (is_free, free_speed) = (is_free.values(n), free_speed.values_mut(n));
        for c in 0..n {
            let v = vs[c];
            free_speed[c] = each(|j| if is_free[c][j] > 0.0 { v[j] } else { free_speed[c][j] });
        }
        self.present.v.values_mut(n).copy_from_slice(vs);
        self.present.time_s = time_s;
    }

    /// Fills in the summary; `interval_s` lies between the outputs.
    pub fn close(mut self, run: &mut Run, record: Record, interval_s: f64) {
        for i in 0..self.bodies.len() {
            let slot = self.layout.of(i);
            let mut end = (self.present.time_s, self.present.v[slot]);
            if let Some(span) = &mut self.bodies[i].open {
                // A force that was never looked at is none that counts.
                span.is_cut = !span.fades && span.sign != 0.0;
                if span.fades {
                    end = (span.end_s, span.end_v);
                }
            }
            self.close_span(i, slot, end.0, end.1);
            run.bodies[i].final_v_m_per_s = self.present.v[slot];
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
            if let Some(contact) = phase.first() {
                history.mean_deceleration_m_per_s2 = contact.mean_deceleration();
                history.is_loaded_at_end = contact.is_cut;
            }
        }
    }
}

impl Span {
    /// Magnitude of the change of speed.
    fn change(&self) -> f64 {
        (self.begin_v - self.end_v).abs()
    }

    fn mean_deceleration(&self) -> f64 {
        (self.begin_v - self.end_v) / (self.end_s - self.begin_s)
    }
}

impl Phase {
    /// Keeps a span that may count: those before it may be many that do not.
    fn close(&mut self, span: Span) {
        self.most = self.most.max(span.change());
        if self.counts(&span) && self.closed.len() < MOST_SPANS {
            self.closed.push(span);
        }
    }

    /// Whether a span counts beside the largest so far.
    fn counts(&self, span: &Span) -> bool {
        span.change() >= LEAST_SHARE * self.most && span.end_s > span.begin_s
    }

    /// The first contact that counts.
    fn first(&self) -> Option<&Span> {
        self.closed.iter().find(|span| self.counts(span))
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
