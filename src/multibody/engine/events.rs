//! Events: what happens where an interface leaves its piece within a step.

use super::super::contacts::{Move, StepPoint};
use super::super::rows::Slot;
use super::super::run::{Method, SimulationError};
use super::state::{Crossing, Engine, Turn, ahead};

/// Rounding of a sum of works, and the share of a force from which on it counts as noise.
const ROUNDING: f64 = 4.0 * f64::EPSILON;
const NOISE: f64 = 1e-5;

impl Engine<'_> {
    /// Finds the pieces of all interfaces that have left theirs.
    #[cold]
    #[inline(never)]
    pub(super) fn settle(&mut self, at: StepPoint, h: f64, share: f64) {
        let mut left = std::mem::take(&mut self.left);
        self.push.left(|slot| left.push((false, slot)));
        if let Some(pull) = &self.pull {
            pull.left(|slot| left.push((true, slot)));
        }
        for &(pulls, slot) in &left {
            self.settle_one(pulls, slot, at, h, share);
        }
        left.clear();
        self.left = left;
    }

    #[inline(always)]
    fn settle_one(&mut self, pulls: bool, slot: Slot, at: StepPoint, h: f64, share: f64) {
        let k = self.layout.index(slot);
        let known = self.missed.iter().position(|m| m.k == k && m.pulls == pulls);
        let known = known.unwrap_or_else(|| {
            let (work_j, sum_jm) = self.contacts(pulls).work(StepPoint::Start, slot);
            let what = Move::default();
            self.missed.push(Crossing { pulls, k, slot, work_j, sum_jm, what, turn: None });
            self.missed.len() - 1
        });
        let what = if self.contacts(pulls).turns(at, k, slot) {
            self.turn(pulls, k, known, at, h, share)
        } else {
            self.contacts_mut(pulls).settle(at, k, slot, None)
        };
        let seen = &mut self.missed[known].what;
        seen.loads |= what.loads;
        seen.closed_m = seen.closed_m.or(what.closed_m);
        seen.pressed_m = seen.pressed_m.or(what.pressed_m);
        seen.released_m = seen.released_m.or(what.released_m);
        seen.opened |= what.opened;
    }

    /// The deflection of an interface has begun to fall.
    fn turn(
        &mut self,
        pulls: bool,
        k: usize,
        missed: usize,
        at: StepPoint,
        h: f64,
        share: f64,
    ) -> Move {
        let slot = self.layout.of(k);
        // Where it was largest: the vertex of the parabola through the nearest state whose speed
        // is known.
        let sign = if pulls { -1.0 } else { 1.0 };
        let rate = sign * self.between(if share >= 0.0 { &self.a_start } else { &self.a }, k);
        let speed = sign * self.closing(k) - share * h * rate;
        let into = if rate < 0.0 { speed / -rate } else { 0.0 };
        // In this step or the last: next to no rate would put the vertex anywhere.
        let near_s = if share >= 0.0 { 0.0 } else { h };
        let after_s = (near_s + into).clamp(-h, h);
        let into_s = after_s - near_s;
        let contacts = self.contacts_mut(pulls);
        let near = contacts.deflection_m(if share >= 0.0 { StepPoint::Start } else { at }, k);
        let top_m = near + (speed + 0.5 * rate * into_s) * into_s;
        let stiffness = contacts.slope_n_per_m(slot);
        let what = contacts.settle(at, k, slot, Some(top_m));
        let stiffer_n_per_m = contacts.slope_n_per_m(slot) - stiffness;
        let largest_m = contacts.largest_m(at, k);
        self.events.turned(pulls, k, largest_m, self.end_s - h + after_s);
        let turn = &mut self.missed[missed].turn;
        *turn = turn.or(Some(Turn { after_s, rate, stiffer_n_per_m }));
        what
    }

    /// What the quadrature of the step has missed, and what happened in it.
    #[cold]
    #[inline(never)]
    pub(super) fn finish(&mut self, h: f64, method: Method) -> Result<(), SimulationError> {
        let missed = std::mem::take(&mut self.missed);
        let mut happened = false;
        for m in &missed {
            self.check_end(m)?;
            let (impulse, moment) = match m.turn {
                Some(turn) if !(m.what.loads || m.what.released_m.is_some()) => {
                    turn.missed(h, method)
                }
                Some(_) => (0.0, 0.0),
                None => self.missed_along(m, h, method),
            };
            let sign = if m.pulls { -1.0 } else { 1.0 };
            self.push_apart(m.k, sign * impulse, sign * moment);
            if m.what != Move::default() {
                happened = true;
                self.damp_part_of_step(m, h);
            }
        }
        if happened {
            self.record_contacts(&missed, h, method);
        }
        self.missed = missed;
        self.missed.clear();
        Ok(())
    }

    /// Fails if a curve that must not be left has ended.
    #[inline(always)]
    fn check_end(&self, m: &Crossing) -> Result<(), SimulationError> {
        let interface = &self.chain.interfaces()[m.k];
        let (law, contacts, what) = match (&interface.tension, &self.pull) {
            (Some(tension), Some(pull)) if m.pulls => (&tension.law, pull, "pulled apart by"),
            _ => (&interface.law, &self.push, "crushed"),
        };
        let deflection_m = contacts.deflection_m(StepPoint::End, m.k);
        if !law.is_beyond_end(deflection_m) {
            return Ok(());
        }
        let (interface, time_s) = (interface.name.clone(), self.end_s);
        let end_m = law.end_m();
        Err(SimulationError::CurveEnd { interface, what, deflection_m, time_s, end_m })
    }

    /// Forces that began or ended in the step; restitution is that of compression.
    fn record_contacts(&mut self, missed: &[Crossing], h: f64, method: Method) {
        for m in missed {
            let k = m.k;
            let behind = ahead(method) * h;
            let rate = self.between(&self.a, k);
            let closing = self.closing(k) - behind * rate;
            let contacts = self.contacts(m.pulls);
            let (start, end) = (
                contacts.deflection_m(StepPoint::Start, k),
                contacts.deflection_m(StepPoint::End, k),
            );
            let end_s = self.end_s;
            let crossing = |at_m: f64| end_s - h * ((end - at_m) / (end - start)).clamp(0.0, 1.0);
            if m.what.loads && start <= 0.0 && !m.pulls {
                // What the contact has not yet braked.
                let before = closing - h * rate * end / (end - start);
                self.events.contact(k, before.max(closing));
            }
            if let Some(at_m) = m.what.pressed_m {
                self.record_sides(k, crossing(at_m), behind);
            }
            if let Some(at_m) = m.what.released_m {
                if !m.pulls {
                    self.events.released(k, -closing);
                }
                self.record_sides(k, crossing(at_m), behind);
            }
        }
    }

    /// Impulse and moment about the step's end that the quadrature has missed where the
    /// deflection went on in one direction.
    #[inline(always)]
    fn missed_along(&self, m: &Crossing, h: f64, method: Method) -> (f64, f64) {
        let contacts = self.contacts(m.pulls);
        let slot = m.slot;
        let moved = contacts.deflections_m(StepPoint::End)[slot]
            - contacts.deflections_m(StepPoint::Start)[slot];
        if moved == 0.0 {
            return (0.0, 0.0);
        }
        let (first, last) =
            (contacts.forces_n(StepPoint::Start)[slot], contacts.forces_n(StepPoint::End)[slot]);
        // Means over the step of the force, and of the force times the share of the step that is
        // still to come, as the quadrature has them.
        let (by_rule, ahead_by_rule) = match method {
            Method::FourthOrder => {
                let inside =
                    contacts.forces_n(StepPoint::Inside)[slot] + contacts.gradient_n()[slot];
                ((first + 4.0 * inside + last) / 6.0, first / 6.0 + inside / 3.0)
            }
            Method::Verlet | Method::Reference => (0.5 * (first + last), 0.5 * first),
        };
        // The same from the law, at constant speed.
        let (work_j, sum_jm) = contacts.work(StepPoint::End, slot);
        let mean = (work_j - m.work_j) / moved;
        // Over next to no way the difference of two works is nothing but their rounding.
        let scale = mean.abs().max(first.abs()).max(last.abs());
        let noise = ROUNDING * (work_j.abs() + m.work_j.abs()) / moved.abs();
        if noise > NOISE * scale {
            return (0.0, 0.0);
        }
        let ahead = (sum_jm - m.sum_jm - m.work_j * moved) / (moved * moved);
        // What the speed's change adds to the mean: the path leaves the straight one by
        // `bend τ(τ − 1)`, whose product with the law's slope is integrated by parts. Not near a
        // turn.
        let sign = if m.pulls { -1.0 } else { 1.0 };
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
    fn damp_part_of_step(&mut self, m: &Crossing, h: f64) {
        let interface = &self.chain.interfaces()[m.k];
        let Some(damping) = &interface.damping else { return };
        let contacts = self.contacts(m.pulls);
        let (start, end) = (
            contacts.deflection_m(StepPoint::Start, m.k),
            contacts.deflection_m(StepPoint::End, m.k),
        );
        let mut part = 0.0;
        if let Some(closed_m) = m.what.closed_m {
            part += ((end - closed_m) / (end - start)).clamp(0.0, 1.0) - 0.5;
        }
        // What only pushes has no force any more when it opens.
        if m.what.opened && interface.tension.is_some() {
            part += ((contacts.opens_at_m(m.k) - start) / (end - start)).clamp(0.0, 1.0) - 0.5;
        }
        let closing = self.closing(m.k) - ahead(Method::Verlet) * h * self.between(&self.a, m.k);
        let impulse = part * h * damping.at(closing) * closing;
        if impulse.is_finite() {
            self.rates.damped_j += impulse * closing;
            self.push_apart(m.k, impulse, 0.0);
        }
    }

    /// Tells the recorder whether forces act on the bodies at interface `k` from `at_s` on; `v` is
    /// `ahead_s` ahead.
    fn record_sides(&mut self, k: usize, at_s: f64, ahead_s: f64) {
        for i in self.sides(k) {
            let forces = |j: usize| {
                j < self.chain.interfaces().len() && self.force_n(StepPoint::End, j) != 0.0
            };
            let touched = forces(i) || i > 0 && forces(i - 1);
            let slot = self.layout.of(i);
            self.events.body(i, touched, at_s, self.v[slot] - ahead_s * self.a[slot]);
        }
    }
}

impl Turn {
    /// Impulse and moment about the step's end that the quadrature has missed: after the turn
    /// the force differs by `stiffer × ½ rate (t − after)²` from what it was before.
    fn missed(self, h: f64, method: Method) -> (f64, f64) {
        let factor = 0.5 * self.rate * self.stiffer_n_per_m;
        let left = h - self.after_s;
        let inside = (0.5 * h - self.after_s).max(0.0);
        let (impulse, moment) = match method {
            Method::FourthOrder => {
                (h / 6.0 * (4.0 * inside * inside + left * left), h * h / 3.0 * inside * inside)
            }
            Method::Verlet | Method::Reference => (0.5 * h * left * left, 0.0),
        };
        (factor * (left.powi(3) / 3.0 - impulse), factor * (left.powi(4) / 12.0 - moment))
    }
}
