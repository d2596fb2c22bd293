//! Events: corrections where an interface leaves its segment within a step.

use super::super::contacts::{Direction, Move, StepPoint};
use super::super::recorder::Moment;
use super::super::rows::LaneIndex;
use super::super::run::curve_ended;
use super::state::{Crossing, Engine, Scheme, Turn};
use crate::error::Error;

/// Rounding of a sum of works, and the share of a force from which on it counts as noise.
const ROUNDING: f64 = 4.0 * f64::EPSILON;
const NOISE: f64 = 1e-5;

/// To which time in the step the speeds belong while forces are evaluated, as a share of the step.
#[derive(Clone, Copy, Debug)]
pub(super) enum Speeds {
    /// So much after its start, whose accelerations are known.
    AfterStart(f64),
    /// So much before its end; the accelerations are those of its middle.
    BeforeEnd(f64),
}

impl Engine<'_> {
    /// Finds the pieces of all interfaces that have left theirs.
    #[cold]
    #[inline(never)]
    pub(super) fn settle(&mut self, at: StepPoint, speeds: Speeds) {
        let mut left = std::mem::take(&mut self.left);
        self.push.left(|slot| left.push((Direction::Compression, slot)));
        if let Some(pull) = &self.pull {
            pull.left(|slot| left.push((Direction::Tension, slot)));
        }
        for &(direction, slot) in &left {
            self.settle_one(direction, slot, at, speeds);
        }
        left.clear();
        self.left = left;
    }

    #[inline(always)]
    fn settle_one(&mut self, direction: Direction, slot: LaneIndex, at: StepPoint, speeds: Speeds) {
        let k = self.fixed.layout.index(slot);
        let known = self.crossings.iter().position(|c| c.k == k && c.direction == direction);
        let known = known.unwrap_or_else(|| {
            let (work_j, sum_jm) = self.contacts(direction).work(StepPoint::Start, slot);
            let what = Move::default();
            self.crossings.push(Crossing { direction, k, slot, work_j, sum_jm, what, turn: None });
            self.crossings.len() - 1
        });
        let what = if self.contacts(direction).turns(at, k, slot) {
            let (what, turn) = self.turn(direction, k, at, speeds);
            let seen = &mut self.crossings[known].turn;
            *seen = seen.or(Some(turn));
            what
        } else {
            self.contacts_mut(direction).settle(at, k, slot, None)
        };
        let seen = &mut self.crossings[known].what;
        *seen = seen.then(what);
    }

    /// The deflection of an interface has begun to fall.
    fn turn(
        &mut self,
        direction: Direction,
        k: usize,
        at: StepPoint,
        speeds: Speeds,
    ) -> (Move, Turn) {
        let (slot, h) = (self.fixed.layout.of(k), self.fixed.step_s);
        // Where it was largest: the vertex of the parabola through the nearest state whose speed
        // is known.
        let (accelerations, share, near, near_s) = match speeds {
            Speeds::AfterStart(share) => (&self.a_start, share, StepPoint::Start, 0.0),
            Speeds::BeforeEnd(share) => (&self.a, -share, at, h),
        };
        let sign = direction.sign();
        let rate = sign * self.between(accelerations, k);
        let speed = sign * self.closing(k) - share * h * rate;
        let into = if rate < 0.0 { speed / -rate } else { 0.0 };
        // In this step or the last: next to no rate would put the vertex anywhere.
        let after_s = (near_s + into).clamp(-h, h);
        let into_s = after_s - near_s;
        let contacts = self.contacts_mut(direction);
        let top_m = contacts.deflection_m(near, k) + (speed + 0.5 * rate * into_s) * into_s;
        let stiffness = contacts.slope_n_per_m(slot);
        let what = contacts.settle(at, k, slot, Some(top_m));
        let stiffer_n_per_m = contacts.slope_n_per_m(slot) - stiffness;
        let largest_m = contacts.largest_m(at, k);
        match direction {
            Direction::Compression => {
                self.events.interfaces[k].turned(largest_m, self.end_s - h + after_s);
            }
            Direction::Tension => self.events.interfaces[k].extended(largest_m),
        }
        (what, Turn { after_s, rate, stiffer_n_per_m })
    }

    /// What the quadrature of the step has missed, and what happened in it.
    #[cold]
    #[inline(never)]
    pub(super) fn finish(&mut self) -> Result<(), Error> {
        let crossings = std::mem::take(&mut self.crossings);
        let mut happened = false;
        for crossing in &crossings {
            self.check_end(crossing)?;
            let Crossing { direction, k, what, turn, .. } = *crossing;
            let (impulse, moment) = match turn {
                Some(turn) if !(what.loads || what.released_m.is_some()) => {
                    turn.missed(self.fixed.step_s, self.fixed.scheme)
                }
                Some(_) => (0.0, 0.0),
                None => self.missed_along(crossing),
            };
            let sign = direction.sign();
            let factor = self.rate_factors[crossing.slot];
            if factor != 1.0 {
                let lost_j = (factor - 1.0) * impulse * self.closing(k);
                self.losses.damped_j += lost_j;
                self.losses.damped_of_j[self.fixed.layout.of(k)] += lost_j;
            }
            self.push_apart(k, factor * sign * impulse, factor * sign * moment);
            if what != Move::default() {
                happened = true;
                self.damp_part_of_step(crossing);
            }
        }
        if happened {
            for crossing in &crossings {
                self.record_contact(crossing);
            }
        }
        self.crossings = crossings;
        self.crossings.clear();
        Ok(())
    }

    /// Fails if a curve that must not be left has ended.
    #[inline(always)]
    fn check_end(&self, m: &Crossing) -> Result<(), Error> {
        let interface = &self.fixed.chain.interfaces()[m.k];
        let (law, contacts, is_tension) = match (&interface.tension, &self.pull) {
            (Some(tension), Some(pull)) if m.direction == Direction::Tension => {
                (&tension.law, pull, true)
            }
            _ => (&interface.law, &self.push, false),
        };
        let deflection_m = contacts.deflection_m(StepPoint::End, m.k);
        if !law.is_beyond_end(deflection_m) {
            return Ok(());
        }
        Err(curve_ended((m.k, interface), law, is_tension, deflection_m, self.end_s))
    }

    /// A force that began or ended in the step; restitution is that of compression.
    fn record_contact(&mut self, crossing: &Crossing) {
        let Crossing { direction, k, what, .. } = *crossing;
        let (h, end_s, ahead_s) = (self.fixed.step_s, self.end_s, self.fixed.ahead_s());
        let rate = self.between(&self.a, k);
        let closing = self.closing(k) - ahead_s * rate;
        let contacts = self.contacts(direction);
        let start = contacts.deflection_m(StepPoint::Start, k);
        let end = contacts.deflection_m(StepPoint::End, k);
        let time_of = |at_m: f64| end_s - h * ((end - at_m) / (end - start)).clamp(0.0, 1.0);
        let compresses = direction == Direction::Compression;
        if what.loads && start <= 0.0 && compresses {
            // What the contact has not yet braked.
            let before = closing - h * rate * end / (end - start);
            self.events.interfaces[k].contact_began(time_of(0.0), before.max(closing));
        }
        if let Some(at_m) = what.pressed_m {
            self.record_sides(k, time_of(at_m));
        }
        if let Some(at_m) = what.released_m {
            let time_s = time_of(at_m);
            if compresses {
                // Without what the neighbours have done to the two since.
                let closing = closing - (end_s - time_s) * rate;
                self.events.interfaces[k].released(-closing);
            }
            self.record_sides(k, time_s);
        }
    }

    /// Impulse and moment about the step's end that the quadrature has missed where the
    /// deflection went on in one direction.
    #[inline(always)]
    fn missed_along(&self, m: &Crossing) -> (f64, f64) {
        let contacts = self.contacts(m.direction);
        let (slot, h) = (m.slot, self.fixed.step_s);
        let moved = contacts.deflections_m(StepPoint::End)[slot]
            - contacts.deflections_m(StepPoint::Start)[slot];
        if moved == 0.0 {
            return (0.0, 0.0);
        }
        let (first, last) =
            (contacts.forces_n(StepPoint::Start)[slot], contacts.forces_n(StepPoint::End)[slot]);
        // Means over the step of the force, and of the force times the share of the step that is
        // still to come, as the quadrature has them.
        let (by_rule, ahead_by_rule) = match self.fixed.scheme {
            Scheme::FourthOrder => {
                let inside =
                    contacts.forces_n(StepPoint::Inside)[slot] + contacts.gradient_n()[slot];
                ((first + 4.0 * inside + last) / 6.0, first / 6.0 + inside / 3.0)
            }
            Scheme::Verlet => (0.5 * (first + last), 0.5 * first),
        };
        // The same from the law, at constant speed.
        let (work_j, sum_jm) = contacts.work(StepPoint::End, slot);
        let mean = (work_j - m.work_j) / moved;
        // Where the deflection hardly moves, the difference of two works is only their rounding.
        let scale = mean.abs().max(first.abs()).max(last.abs());
        let noise = ROUNDING * (work_j.abs() + m.work_j.abs()) / moved.abs();
        if noise > NOISE * scale {
            return (0.0, 0.0);
        }
        let ahead = (sum_jm - m.sum_jm - m.work_j * moved) / (moved * moved);
        // What the speed's change adds to the mean: the path leaves the straight one by
        // `bend τ(τ − 1)`, whose product with the law's slope is integrated by parts. Not near a
        // turn.
        let sign = m.direction.sign();
        let rates = self.between(&self.a_start, m.k) + self.between(&self.a, m.k);
        let bend = 0.25 * h * h * sign * rates;
        let sums = sum_jm.abs() + m.sum_jm.abs() + (m.work_j * moved).abs();
        let noise = ROUNDING * sums / (moved * moved) * (bend.abs() + 1e-3 * moved.abs());
        if bend.abs() > 0.5 * moved.abs() || noise > NOISE * scale * moved.abs() {
            return (h * (mean - by_rule), 0.0);
        }
        let mean = mean + bend / moved * (2.0 * ahead - mean);
        (h * (mean - by_rule), h * h * (ahead - ahead_by_rule))
    }

    /// Impulse of a damper that acted over a part of the step only, where its contact closed or
    /// a coupling opened; the quadrature has half of it.
    fn damp_part_of_step(&mut self, m: &Crossing) {
        let interface = &self.fixed.chain.interfaces()[m.k];
        let Some(damping) = &interface.damping else { return };
        let contacts = self.contacts(m.direction);
        let (start, end) = (
            contacts.deflection_m(StepPoint::Start, m.k),
            contacts.deflection_m(StepPoint::End, m.k),
        );
        let mut part = 0.0;
        if let Some(closed_m) = m.what.closed_m {
            part += ((end - closed_m) / (end - start)).clamp(0.0, 1.0) - 0.5;
        }
        // An interface that only pushes has no force when it opens.
        if m.what.opened && interface.tension.is_some() {
            part += ((contacts.opens_at_m(m.k) - start) / (end - start)).clamp(0.0, 1.0) - 0.5;
        }
        let closing = self.closing(m.k) - self.fixed.ahead_s() * self.between(&self.a, m.k);
        let impulse = part * self.fixed.step_s * damping.at(closing) * closing;
        if impulse.is_finite() {
            self.losses.damped_j += impulse * closing;
            self.losses.damped_of_j[m.slot] += impulse * closing;
            self.push_apart(m.k, impulse, 0.0);
        }
    }

    /// Notifies the recorder whether forces act on the bodies at interface `k` from `time_s` on.
    fn record_sides(&mut self, k: usize, time_s: f64) {
        let interfaces = self.fixed.chain.interfaces().len();
        for i in self.sides(k) {
            let acts = |j: usize| j < interfaces && self.force_n(StepPoint::End, j) != 0.0;
            if acts(i) || i > 0 && acts(i - 1) {
                self.events.touched(i, time_s);
            } else {
                let slot = self.fixed.layout.of(i);
                let v_m_per_s = self.v[slot] - self.fixed.ahead_s() * self.a[slot];
                self.events.left_alone(i, Moment { time_s, v_m_per_s });
            }
        }
    }
}

impl Turn {
    /// Impulse and moment about the step's end that the quadrature has missed: after the turn
    /// the force differs by `stiffer × ½ rate (t − after)²` from what it was before.
    fn missed(self, h: f64, scheme: Scheme) -> (f64, f64) {
        let factor = 0.5 * self.rate * self.stiffer_n_per_m;
        let left = h - self.after_s;
        let inside = (0.5 * h - self.after_s).max(0.0);
        let (impulse, moment) = match scheme {
            Scheme::FourthOrder => {
                (h / 6.0 * (4.0 * inside * inside + left * left), h * h / 3.0 * inside * inside)
            }
            Scheme::Verlet => (0.5 * h * left * left, 0.0),
        };
        (factor * (left.powi(3) / 3.0 - impulse), factor * (left.powi(4) / 12.0 - moment))
    }
}
