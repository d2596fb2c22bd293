//! Recorder of events: extremes of interfaces and contacts of bodies between the outputs.
//!
//! Mean decelerations need the instants at which a body's net contact force begins, ends and changes its sign. Contacts
//! that close and open within a step give these instants. Everything else is seen at looks, a quarter of a millisecond apart
//! at most, so that nothing depends on the interval of the outputs.
//!
//! - A net force up to 1 kN, of a body below 1 t up to 1 m/s² of its mass, counts as none. Vehicles that touch without closing are
//!   reached by a precursor that grows from rounding, and where neighbours come to press equally, the force dies away
//!   without an end.
//! - The force may fall below that for less than a look; beside a push of less than four looks, where vehicles rattle, it may be
//!   gone or have the other sign for as long.
//! - A contact that changes the speed by less than 0.5 % of the range of the body's speeds does not count, nor one shorter than four
//!   looks by less than 5 %.

mod occupant;
mod spans;

use super::chain::Chain;
use super::rows::{LANES, LaneIndex, Layout, Row, Rows, each, larger};
use super::run::{InterfaceHistory, Record, Run};
use occupant::Flight;
use spans::{LEAST_M_PER_S2, LEAST_N, Look, Phase, Spans};
pub(super) use spans::{LOOK_S, Moment};

/// What happens in a run between its outputs.
pub(super) struct EventRecorder {
    layout: Layout,
    pub(crate) interfaces: Vec<Extremes>,
    bodies: Vec<BodyEvents>,
    present: Present,
}

/// What looks and outputs ask of all bodies.
struct Present {
    /// 1 for bodies that no force acts on, else 0.
    is_free: Rows,
    /// Accelerations between these change nothing: see [`Phase::unchanged_between`].
    least: Rows,
    most: Rows,
    /// Accelerations by contacts at the last look, and its time.
    seen_a: Rows,
    seen_s: f64,
    /// Speed before the contact.
    free_speed: Rows,
    /// Speeds at the last output, and its time.
    v: Rows,
    time_s: f64,
}

/// Contact forces on one body.
#[derive(Clone, Debug)]
struct BodyEvents {
    /// Magnitude up to which an acceleration does not count.
    least_a: f64,
    phase: Phase,
    spans: Spans,
}

impl EventRecorder {
    pub(crate) fn new(chain: &Chain, layout: &Layout) -> Self {
        let bodies = chain.bodies();
        let of = |value: &dyn Fn(usize) -> f64| Rows::of(layout, bodies.len(), value);
        let none = || of(&|_| 0.0);
        let events: Vec<BodyEvents> = (bodies.iter())
            .map(|body| BodyEvents {
                least_a: (LEAST_N / body.mass_kg).min(LEAST_M_PER_S2),
                phase: Phase::Free,
                spans: Spans::default(),
            })
            .collect();
        let present = Present {
            is_free: of(&|_| 1.0),
            least: of(&|i| -events[i].least_a),
            most: of(&|i| events[i].least_a),
            seen_a: none(),
            seen_s: 0.0,
            free_speed: of(&|i| bodies[i].speed_m_per_s),
            v: none(),
            time_s: 0.0,
        };
        Self {
            layout: layout.clone(),
            interfaces: vec![Extremes::default(); chain.interfaces().len()],
            bodies: events,
            present,
        }
    }

    /// Contact forces act on body `i` from `at_s` on.
    pub(crate) fn touched(&mut self, i: usize, at_s: f64) {
        if self.bodies[i].phase == Phase::Free {
            let slot = self.layout.of(i);
            let begin = Moment { time_s: at_s, v_m_per_s: self.present.free_speed[slot] };
            self.enter(i, slot, Phase::Announced { begin });
        }
    }

    /// No contact force acts on body `i` any more.
    pub(crate) fn left_alone(&mut self, i: usize, at: Moment) {
        let body = &mut self.bodies[i];
        if let Some(span) = body.phase.closed_at(at) {
            body.spans.close(span);
            let slot = self.layout.of(i);
            self.present.free_speed[slot] = at.v_m_per_s;
            self.enter(i, slot, Phase::Free);
        }
    }

    fn enter(&mut self, i: usize, slot: LaneIndex, phase: Phase) {
        let body = &mut self.bodies[i];
        body.phase = phase;
        let (least, most) = phase.unchanged_between(body.least_a);
        (self.present.least[slot], self.present.most[slot]) = (least, most);
        self.present.is_free[slot] = if phase == Phase::Free { 1.0 } else { 0.0 };
    }

    /// Whether [`Self::look`] has anything to do with these accelerations by contact forces.
    #[inline(always)]
    pub(crate) fn is_news<const N: usize>(&self, a: &Rows) -> bool {
        let n = self.layout.known::<N>();
        let (least, most) = (self.present.least.values(n), self.present.most.values(n));
        let mut outside: Row = [0.0; LANES];
        for (c, a) in a.values(n).iter().enumerate() {
            let below = each(|j| least[c][j] - a[j]);
            outside = larger(outside, larger(below, each(|j| a[j] - most[c][j])));
        }
        outside.iter().any(|&o| o > 0.0)
    }

    /// Looks at body `i` with this acceleration by contact forces: its span ends if the net force
    /// has ended or changed its sign since the last look, and one begins that nothing has
    /// announced.
    pub(crate) fn look(&mut self, i: usize, now: Moment, a: f64) {
        let slot = self.layout.of(i);
        let present = &self.present;
        if a >= present.least[slot] && a <= present.most[slot] {
            return;
        }
        let body = &mut self.bodies[i];
        let look = Look {
            before_s: present.seen_s,
            before_a: present.seen_a[slot],
            now,
            a,
            least_a: body.least_a,
            free_speed: present.free_speed[slot],
        };
        let (phase, ended) = body.phase.after(&look);
        if let Some(span) = ended {
            body.spans.close(span);
        }
        if phase == Phase::Free {
            self.present.free_speed[slot] = now.v_m_per_s;
        }
        self.enter(i, slot, phase);
    }

    /// Ends a look at all bodies, with their accelerations by contact forces.
    #[inline(always)]
    pub(crate) fn looked<const N: usize>(&mut self, a: &Rows, at_s: f64) {
        let n = self.layout.known::<N>();
        self.present.seen_a.values_mut(n).copy_from_slice(a.values(n));
        self.present.seen_s = at_s;
    }

    /// Takes the speeds of all bodies at an output.
    #[inline(always)]
    pub(crate) fn output_bodies<const N: usize>(&mut self, v: &Rows, time_s: f64) {
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
    pub(crate) fn close(self, run: &mut Run, record: Record, interval_s: f64) {
        for (history, extremes) in run.interfaces.iter_mut().zip(self.interfaces) {
            extremes.close(history);
        }
        for (i, (history, body)) in run.bodies.iter_mut().zip(self.bodies).enumerate() {
            let BodyEvents { phase, mut spans, .. } = body;
            let final_v_m_per_s = self.present.v[self.layout.of(i)];
            let end = Moment { time_s: self.present.time_s, v_m_per_s: final_v_m_per_s };
            if let Some(span) = phase.at_end_of_run(end) {
                spans.close(span);
            }
            let running = spans.running();
            let spans = spans.ended();
            history.running_and_largest_change = (running, spans.largest_change());
            history.final_v_m_per_s = final_v_m_per_s;
            history.final_a_m_per_s2 = self.present.seen_a[self.layout.of(i)];
            if record != Record::Closing && interval_s <= COARSEST_S {
                let speeds = &history.v_m_per_s;
                let flight = Flight::new(speeds, interval_s);
                history.moving_mean_deceleration_m_per_s2 = moving_mean(speeds, interval_s);
                history.secondary_impact_m_per_s = flight.secondary_impact_m_per_s();
                history.occupant_load_m_per_s2 = flight.occupant_load_m_per_s2();
            }
            if record == Record::Summary {
                history.v_m_per_s = Vec::new();
            }
            if let Some(contact) = spans.first() {
                history.mean_deceleration_m_per_s2 = contact.mean_deceleration();
                history.is_loaded_at_end = contact.is_cut;
                history.loaded_s = Some(contact.times_s());
            }
            history.main_contact =
                spans.main().map(|span| (span.mean_deceleration(), span.times_s(), span.is_cut));
        }
    }
}

/// Window of the moving mean deceleration, in s (EN 15227).
const MOVING_MEAN_S: f64 = 0.120;
/// Between outputs further apart, in s, the largest mean would be missed by too much.
pub(crate) const COARSEST_S: f64 = 0.005;

/// Mean deceleration in m/s² over the 120 ms in which its magnitude is largest, from the speeds
/// at both ends, one of which is an output's; `None` for a record that is shorter or too coarse.
pub(super) fn moving_mean(speeds: &[f64], interval_s: f64) -> Option<f64> {
    if interval_s > COARSEST_S {
        return None;
    }
    let window = MOVING_MEAN_S / interval_s;
    // Rounding must not make 160 intervals of 0.75 ms a little more than 120 ms.
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
    // Windows that end at an output have been tried; those that begin at one are others.
    if share > 0.0 {
        for ((from, to), last) in speeds.iter().zip(now).zip(&speeds[back - 1..]) {
            most = larger(most, from - (to + share * (last - to)));
        }
    }
    (!now.is_empty()).then_some(most / MOVING_MEAN_S)
}

/// No restitution of what meets more slowly, in m/s: it would be a ratio to nothing.
const SLOWEST_APPROACH_M_PER_S: f64 = 0.1;
/// Crushed further than so many times its crush at the first separation, an interface has that of another contact.
const AS_FAR: f64 = 1.01;

/// What is known about an interface over all steps.
#[derive(Clone, Debug, Default)]
pub(in self::super) struct Extremes {
    peak_n: f64,
    peak_tension_n: f64,
    max_extension_m: f64,
    max_deflection_m: f64,
    max_deflection_time_s: f64,
    /// When the deflection first stopped growing.
    common_velocity_s: Option<f64>,
    /// When contact began for the first time, with the rate of deflection, and that when it ended.
    contact_s: Option<f64>,
    approach_m_per_s: Option<f64>,
    /// With the largest deflection until then.
    separation: Option<(f64, f64)>,
}

impl Extremes {
    pub(crate) fn contact_began(&mut self, time_s: f64, closing_m_per_s: f64) {
        self.contact_s = self.contact_s.or(Some(time_s));
        self.approach_m_per_s = self.approach_m_per_s.or(Some(closing_m_per_s));
    }

    pub(crate) fn released(&mut self, separation_m_per_s: f64) {
        if separation_m_per_s > 0.0 {
            self.separation = self.separation.or(Some((separation_m_per_s, self.max_deflection_m)));
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
        history.contact_time_s = self.contact_s;
        history.peak_tension_n = self.peak_tension_n;
        history.max_extension_m = self.max_extension_m;
        let separation = self.separation.filter(|(_, m)| self.max_deflection_m <= AS_FAR * m);
        history.restitution = match (self.approach_m_per_s, separation) {
            (Some(approach), Some((separation, _))) if approach >= SLOWEST_APPROACH_M_PER_S => {
                Some(separation / approach)
            }
            _ => None,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_restitution_of_what_is_crushed_further_is_not_known() {
        let mut extremes = Extremes::default();
        let restitution = |extremes: &Extremes| {
            let mut history = InterfaceHistory::default();
            extremes.clone().close(&mut history);
            history.restitution
        };
        extremes.contact_began(0.0, 5.0);
        extremes.turned(0.1, 0.01);
        extremes.released(1.0);
        assert_eq!(restitution(&extremes), Some(0.2));
        // It only touches again, or is crushed anew.
        extremes.turned(0.1005, 0.2);
        assert_eq!(restitution(&extremes), Some(0.2));
        extremes.turned(0.3, 0.4);
        assert_eq!(restitution(&extremes), None);
    }
}
