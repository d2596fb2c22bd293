//! The state of a run from step to step, and the small moves on it.

use std::ops::Range;

use super::super::chain::Chain;
use super::super::contacts::{Contacts, Move, StepPoint};
use super::super::recorder::EventRecorder;
use super::super::rows::{Layout, Rows, Slot, each};
use super::super::run::Method;

/// Everything that changes from step to step.
pub(super) struct Engine<'a> {
    pub(super) chain: &'a Chain,
    pub(super) layout: Layout,
    pub(super) x_m: Rows,
    /// Between the outputs half a step (Verlet) or a sixth (fourth order) ahead of `x`.
    pub(super) v: Rows,
    pub(super) a: Rows,
    /// At the start of the step.
    pub(super) a_start: Rows,
    /// Without resistance, where there is some.
    pub(super) by_contacts: Option<Rows>,
    pub(super) mass_kg: Rows,
    pub(super) per_kg: Rows,
    pub(super) push: Contacts<'a>,
    pub(super) pull: Option<Contacts<'a>>,
    /// Net forces if more than the pushing ones act; for a while their gradient.
    pub(super) net_n: Option<Rows>,
    pub(super) missed: Vec<Crossing>,
    /// Interfaces that have left their pieces, pulling ones after pushing ones.
    pub(super) left: Vec<(bool, Slot)>,
    pub(super) step_s: f64,
    /// End of the present step.
    pub(super) end_s: f64,
    pub(super) rates: Rates,
    pub(super) wall_impulse: f64,
    pub(super) events: EventRecorder,
}

/// Work and impulse of what depends on speeds.
#[derive(Default)]
pub(super) struct Rates {
    pub(super) damped_j: f64,
    pub(super) resisted_j: f64,
    pub(super) impulse: f64,
    /// Power of dampers and resistance, and resisting force, at the last step.
    pub(super) damper_w: f64,
    pub(super) resistance_w: f64,
    pub(super) resistance_n: f64,
}

/// An interface that has left its piece within the step.
pub(super) struct Crossing {
    pub(super) pulls: bool,
    pub(super) k: usize,
    pub(super) slot: Slot,
    /// Work done up to the start of the step in J, and its integral over the deflection.
    pub(super) work_j: f64,
    pub(super) sum_jm: f64,
    pub(super) what: Move,
    pub(super) turn: Option<Turn>,
}

/// The deflection was largest `after_s` after the step's start (or before it); there the
/// stiffness changed by `stiffer_n_per_m`. `rate` is the second derivative of the deflection.
#[derive(Clone, Copy)]
pub(super) struct Turn {
    pub(super) after_s: f64,
    pub(super) rate: f64,
    pub(super) stiffer_n_per_m: f64,
}

impl<'a> Engine<'a> {
    /// The bodies at interface `k`.
    pub(super) fn sides(&self, k: usize) -> Range<usize> {
        k..self.chain.bodies().len().min(k + 2)
    }

    /// Net force of interface `k`.
    pub(super) fn force_n(&self, at: StepPoint, k: usize) -> f64 {
        self.forces_n(at)[self.layout.of(k)]
    }

    /// Net forces of all interfaces.
    #[inline(always)]
    pub(super) fn forces_n(&self, at: StepPoint) -> &Rows {
        self.net_n.as_ref().unwrap_or(self.push.forces_n(at))
    }

    /// Rate of deflection of interface `k`: of the body behind it against what is in front.
    pub(super) fn closing(&self, k: usize) -> f64 {
        self.between(&self.v, k)
    }

    /// By how much a value of the body behind interface `k` exceeds that of what is in front.
    pub(super) fn between(&self, values: &Rows, k: usize) -> f64 {
        values[self.layout.of(k)] - values[self.layout.of(k + 1)]
    }

    #[inline(always)]
    pub(super) fn kick<const N: usize>(&mut self, dt: f64) {
        let n = self.layout.known::<N>();
        let (v, a) = (self.v.values_mut(n), self.a.values(n));
        for c in 0..n {
            v[c] = each(|j| v[c][j] + dt * a[c][j]);
        }
    }

    #[inline(always)]
    pub(super) fn drift<const N: usize>(&mut self, dt: f64) {
        let n = self.layout.known::<N>();
        let (x, v) = (self.x_m.values_mut(n), self.v.values(n));
        for c in 0..n {
            x[c] = each(|j| x[c][j] + dt * v[c][j]);
        }
    }

    /// Impulse of the wall over `dt` at the present forces.
    #[inline(always)]
    pub(super) fn on_wall(&mut self, at: StepPoint, dt: f64) {
        if self.chain.has_wall() {
            self.wall_impulse += dt * self.force_n(at, self.chain.bodies().len() - 1);
        }
    }

    /// An impulse between the bodies at interface `k`, and its moment about the step's end.
    pub(super) fn push_apart(&mut self, k: usize, impulse: f64, moment: f64) {
        let (behind, ahead) = (self.layout.of(k), self.layout.of(k + 1));
        self.v[behind] -= impulse * self.per_kg[behind];
        self.v[ahead] += impulse * self.per_kg[ahead];
        self.x_m[behind] -= moment * self.per_kg[behind];
        self.x_m[ahead] += moment * self.per_kg[ahead];
        if k + 1 == self.chain.bodies().len() {
            self.wall_impulse += impulse;
        }
    }

    #[inline(always)]
    pub(super) fn next(&mut self) {
        std::mem::swap(&mut self.a, &mut self.a_start);
        self.push.next();
        if let Some(pull) = &mut self.pull {
            pull.next();
        }
    }

    #[inline(always)]
    pub(super) fn contacts(&self, pulls: bool) -> &Contacts<'a> {
        match &self.pull {
            Some(pull) if pulls => pull,
            _ => &self.push,
        }
    }

    #[inline(always)]
    pub(super) fn contacts_mut(&mut self, pulls: bool) -> &mut Contacts<'a> {
        match &mut self.pull {
            Some(pull) if pulls => pull,
            _ => &mut self.push,
        }
    }
}

/// The part of a step by which speeds are ahead of positions between the steps.
pub(super) fn ahead(method: Method) -> f64 {
    match method {
        Method::FourthOrder => 1.0 / 6.0,
        Method::Verlet | Method::Reference => 0.5,
    }
}
