//! The state of a run from step to step, and the small moves on it.

use std::ops::Range;

use super::super::chain::Chain;
use super::super::contacts::{Contacts, Direction, Move, StepPoint};
use super::super::recorder::EventRecorder;
use super::super::rows::{LANES, LaneIndex, Layout, Rows, each};
use crate::curve::Envelope;

/// How the engine steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) enum Scheme {
    Verlet,
    FourthOrder,
}

/// What stays as it is in a run.
pub(super) struct Fixed<'a> {
    pub chain: &'a Chain,
    pub layout: Layout,
    pub scheme: Scheme,
    pub step_s: f64,
    /// By row that has such: places in [`Rows::flat`] of the two bodies whose closing speed an interface's force follows.
    pub rated: Vec<(usize, [[usize; 2]; LANES])>,
    /// Of the rate factors; 0 where there is none.
    pub sensitivity: Rows,
    pub share: Rows,
    /// Interfaces with other dampers than plain ones.
    pub other_dampers: Vec<usize>,
    /// Coefficients in N s/m of dampers that only push and have one; 0 where there is none.
    pub plain_n_s_per_m: Rows,
    /// The rows that have one.
    pub plain_rows: Vec<usize>,
}

/// A crush zone that takes mass of its body, at the interface with this index and slot.
pub(super) struct Taken<'a> {
    pub interface: usize,
    /// Places in [`Rows::flat`].
    pub slot: usize,
    pub body: usize,
    pub zone: usize,
    pub least_kg: f64,
    pub stopped_kg: &'a Envelope,
    /// Maximum deflection when it last took mass, and the segment of the stopped mass that holds it.
    pub largest_m: f64,
    pub segment: usize,
}

impl Fixed<'_> {
    /// The time by which speeds are ahead of positions between the steps: half a step, or a sixth
    /// in the scheme of fourth order.
    #[inline(always)]
    pub(crate) fn ahead_s(&self) -> f64 {
        match self.scheme {
            Scheme::FourthOrder => 1.0 / 6.0 * self.step_s,
            Scheme::Verlet => 0.5 * self.step_s,
        }
    }
}

/// A run: what stays, and everything that changes from step to step.
pub(super) struct Engine<'a> {
    pub fixed: Fixed<'a>,
    /// A crush zone takes mass from its body; all others stay as they are.
    pub mass_kg: Rows,
    pub per_kg: Rows,
    pub x_m: Rows,
    /// Ahead of `x_m` between the outputs: see [`Fixed::ahead_s`].
    pub v: Rows,
    pub a: Rows,
    /// At the start of the step.
    pub a_start: Rows,
    /// Without resistance, where there is some.
    pub by_contacts: Option<Rows>,
    pub push: Contacts<'a>,
    pub pull: Option<Contacts<'a>>,
    /// Net forces if more than the pushing ones act; for a while their gradient.
    pub net_n: Option<Rows>,
    /// Of the bodies, where forces depend on them, and of the interfaces.
    pub speeds: Rows,
    pub closing_m_per_s: Rows,
    /// What the speeds multiply the force of each interface by, and the largest forces with it and with plain dampers.
    pub rate_factors: Rows,
    pub peaks_n: Rows,
    /// Of every interface with a crush zone.
    pub taken: Vec<Taken<'a>>,
    /// What has happened in the step.
    pub crossings: Vec<Crossing>,
    /// Interfaces that have left their pieces, pulling ones after pushing ones.
    pub left: Vec<(Direction, LaneIndex)>,
    /// End of the present step.
    pub end_s: f64,
    pub losses: Losses,
    /// What the wall has taken so far.
    pub wall_impulse: f64,
    pub events: EventRecorder,
}

/// Work and impulse of what depends on speeds, so far.
#[derive(Default)]
pub(super) struct Losses {
    /// By dampers, by the share of forces that depends on speeds, and where mass is stopped.
    pub damped_j: f64,
    pub resisted_j: f64,
    /// Of the resistance.
    pub impulse: f64,
    pub power: Power,
    /// The part of each interface in `damped_j`, and its power now and a step before.
    pub damped_of_j: Rows,
    pub power_of_w: Rows,
    pub before_of_w: Rows,
}

impl Losses {
    pub(crate) fn new(layout: &Layout) -> Self {
        let [damped_of_j, power_of_w, before_of_w] = std::array::from_fn(|_| Rows::zeros(layout));
        Self { damped_of_j, power_of_w, before_of_w, ..Self::default() }
    }

    /// Adds the work of a step to the interfaces' parts: `half_s`, half its length, times the powers at both ends.
    #[inline(always)]
    pub(crate) fn add_of_interfaces(&mut self, n: usize, half_s: f64) {
        let (before, power) = (self.before_of_w.values(n), self.power_of_w.values(n));
        for (c, of) in self.damped_of_j.values_mut(n).iter_mut().enumerate() {
            *of = each(|j| of[j] + half_s * (before[c][j] + power[c][j]));
        }
        std::mem::swap(&mut self.before_of_w, &mut self.power_of_w);
    }
}

/// Power of dampers and resistance, and the resisting force, at the last step.
#[derive(Clone, Copy, Default)]
pub(super) struct Power {
    pub damper_w: f64,
    pub resistance_w: f64,
    pub resistance_n: f64,
}

/// An interface that has left its piece within the step.
pub(super) struct Crossing {
    pub direction: Direction,
    pub k: usize,
    pub slot: LaneIndex,
    /// Work done up to the start of the step in J, and its integral over the deflection.
    pub work_j: f64,
    pub sum_jm: f64,
    pub what: Move,
    pub turn: Option<Turn>,
}

/// The deflection was largest `after_s` after the step's start (or before it); there the
/// stiffness changed by `stiffer_n_per_m`. `rate` is the second derivative of the deflection.
#[derive(Clone, Copy)]
pub(super) struct Turn {
    pub after_s: f64,
    pub rate: f64,
    pub stiffer_n_per_m: f64,
}

impl<'a> Engine<'a> {
    /// The bodies at interface `k`.
    pub(crate) fn sides(&self, k: usize) -> Range<usize> {
        k..self.fixed.chain.bodies().len().min(k + 2)
    }

    /// Net force of interface `k`.
    pub(crate) fn force_n(&self, at: StepPoint, k: usize) -> f64 {
        self.forces_n(at)[self.fixed.layout.of(k)]
    }

    /// Net forces of all interfaces.
    #[inline(always)]
    pub(crate) fn forces_n(&self, at: StepPoint) -> &Rows {
        self.net_n.as_ref().unwrap_or(self.push.forces_n(at))
    }

    /// Rate of deflection of interface `k`: of the body behind it against what is in front.
    pub(crate) fn closing(&self, k: usize) -> f64 {
        self.between(&self.v, k)
    }

    /// By how much a value of the body behind interface `k` exceeds that of what is in front.
    pub(crate) fn between(&self, values: &Rows, k: usize) -> f64 {
        values[self.fixed.layout.of(k)] - values[self.fixed.layout.of(k + 1)]
    }

    #[inline(always)]
    pub(crate) fn contacts(&self, direction: Direction) -> &Contacts<'a> {
        match &self.pull {
            Some(pull) if direction == Direction::Tension => pull,
            _ => &self.push,
        }
    }

    #[inline(always)]
    pub(crate) fn contacts_mut(&mut self, direction: Direction) -> &mut Contacts<'a> {
        match &mut self.pull {
            Some(pull) if direction == Direction::Tension => pull,
            _ => &mut self.push,
        }
    }

    #[inline(always)]
    pub(crate) fn kick<const N: usize>(&mut self, dt: f64) {
        let n = self.fixed.layout.known::<N>();
        let (v, a) = (self.v.values_mut(n), self.a.values(n));
        for c in 0..n {
            v[c] = each(|j| v[c][j] + dt * a[c][j]);
        }
    }

    #[inline(always)]
    pub(crate) fn drift<const N: usize>(&mut self, dt: f64) {
        let n = self.fixed.layout.known::<N>();
        let (x, v) = (self.x_m.values_mut(n), self.v.values(n));
        for c in 0..n {
            x[c] = each(|j| x[c][j] + dt * v[c][j]);
        }
    }

    /// Impulse of the wall over `dt` at the present forces.
    #[inline(always)]
    pub(crate) fn on_wall(&mut self, at: StepPoint, dt: f64) {
        if self.fixed.chain.has_wall() {
            self.wall_impulse += dt * self.force_n(at, self.fixed.chain.bodies().len() - 1);
        }
    }

    /// An impulse between the bodies at interface `k`, and its moment about the step's end.
    pub(crate) fn push_apart(&mut self, k: usize, impulse: f64, moment: f64) {
        let Fixed { chain, layout, .. } = &self.fixed;
        let per_kg = &self.per_kg;
        let (behind, ahead) = (layout.of(k), layout.of(k + 1));
        self.v[behind] -= impulse * per_kg[behind];
        self.v[ahead] += impulse * per_kg[ahead];
        self.x_m[behind] -= moment * per_kg[behind];
        self.x_m[ahead] += moment * per_kg[ahead];
        if k + 1 == chain.bodies().len() {
            self.wall_impulse += impulse;
        }
    }

    /// The end of a step becomes the start of the next.
    #[inline(always)]
    pub(crate) fn next(&mut self) {
        std::mem::swap(&mut self.a, &mut self.a_start);
        self.push.next();
        if let Some(pull) = &mut self.pull {
            pull.next();
        }
    }
}
