//! Forces and accelerations at the present positions and speeds.

use super::super::contacts::{Contacts, StepPoint};
use super::super::rows::{behind, each};
use super::state::Engine;

impl Engine<'_> {
    /// Forces at the present positions; interfaces that have left their piece are settled.
    /// `share` is the part of a step by which `v` is ahead of the step's start, below 0 if it
    /// lags behind the step's end (and `a` is that of its middle).
    #[inline(always)]
    pub(super) fn evaluate<const N: usize>(&mut self, at: StepPoint, h: f64, share: f64) {
        let pushed = self.push.evaluate::<N>(&self.x_m, at);
        let pulled = self.pull.as_mut().is_some_and(|pull| pull.evaluate::<N>(&self.x_m, at));
        if pushed || pulled {
            self.settle(at, h, share);
        }
    }

    /// Accelerations from the forces, then speeds by `kick_s`; where forces depend on speeds,
    /// `v` is `lag` seconds behind.
    #[inline(always)]
    pub(super) fn accelerate_and_kick<const N: usize>(
        &mut self,
        at: StepPoint,
        lag_s: f64,
        kick_s: f64,
    ) {
        if self.net_n.is_some() {
            self.accelerate_by_all(at, lag_s);
            return self.kick::<N>(kick_s);
        }
        let n = self.layout.known::<N>();
        let forces = self.push.forces_n(at).values(n);
        let per_kg = self.per_kg.values(n);
        let (a, v) = (self.a.values_mut(n), self.v.values_mut(n));
        for c in 0..n {
            let behind = behind(forces, c);
            a[c] = each(|j| (behind[j] - forces[c][j]) * per_kg[c][j]);
            v[c] = each(|j| v[c][j] + kick_s * a[c][j]);
        }
    }

    /// Accelerations with tension, dampers and resistance.
    #[inline(never)]
    pub(super) fn accelerate_by_all(&mut self, at: StepPoint, lag_s: f64) {
        let n = self.layout.rows();
        let Some(mut net) = self.net_n.take() else { return };
        net.clone_from(self.push.forces_n(at));
        if let Some(pull) = &self.pull {
            let pulls = pull.forces_n(at).values(n);
            for (net, pull) in net.values_mut(n).iter_mut().zip(pulls) {
                *net = each(|j| net[j] - pull[j]);
            }
        }
        self.rates.damper_w = 0.0;
        for (k, interface) in self.chain.interfaces().iter().enumerate() {
            let Some(damping) = &interface.damping else { continue };
            // At 0 only where bodies meet at the start.
            let touches = |contacts: &Contacts<'_>| {
                contacts.deflection_m(at, k) >= 0.0 && !contacts.is_open(k)
            };
            let pulls = self.pull.as_ref().is_some_and(|pull| pull.has_law(k) && touches(pull));
            if !(touches(&self.push) || pulls) {
                continue;
            }
            let closing = self.closing(k) + lag_s * self.between(&self.a_start, k);
            let spring = net[self.layout.of(k)];
            let mut force = spring + damping.at(closing) * closing;
            if interface.tension.is_none() {
                // What only pushes does not pull when it opens fast.
                force = force.max(0.0);
            }
            net[self.layout.of(k)] = force;
            self.rates.damper_w += (force - spring) * closing;
            self.events.peak_n(k, force);
            self.events.tension(k, -force, 0.0);
        }
        (self.rates.resistance_w, self.rates.resistance_n) = (0.0, 0.0);
        let mut behind = 0.0;
        for (i, body) in self.chain.bodies().iter().enumerate() {
            let slot = self.layout.of(i);
            let mut resistance = 0.0;
            if !body.resistance.is_none() {
                let v = self.v[slot] + lag_s * self.a_start[slot];
                resistance = body.resistance.force_n(body.mass_kg, v);
                self.rates.resistance_w += resistance * v;
                self.rates.resistance_n += resistance;
            }
            self.a[slot] = (behind - net[slot] - resistance) * self.per_kg[slot];
            if let Some(by_contacts) = &mut self.by_contacts {
                by_contacts[slot] = (behind - net[slot]) * self.per_kg[slot];
            }
            behind = net[slot];
        }
        self.net_n = Some(net);
    }

    /// Adds `h²/24` times the change of the accelerations along themselves; then speeds by
    /// `kick_s` and positions by `drift_s` in the same pass.
    #[inline(always)]
    pub(super) fn add_gradient_kick_and_drift<const N: usize>(
        &mut self,
        h: f64,
        kick_s: f64,
        drift_s: f64,
    ) {
        let n = self.layout.known::<N>();
        let factor = h * h / 24.0;
        self.push.take_gradient::<N>(&self.a, factor);
        if let (Some(pull), Some(net)) = (&mut self.pull, &mut self.net_n) {
            pull.take_gradient::<0>(&self.a, factor);
            let gradients =
                self.push.gradient_n().values(n).iter().zip(pull.gradient_n().values(n));
            for (net, (push, pull)) in net.values_mut(n).iter_mut().zip(gradients) {
                *net = each(|j| push[j] - pull[j]);
            }
        }
        let gradient = self.net_n.as_ref().unwrap_or(self.push.gradient_n());
        let gradient = gradient.values(n);
        let (a, v) = (self.a.values_mut(n), self.v.values_mut(n));
        let x = self.x_m.values_mut(n);
        let per_kg = self.per_kg.values(n);
        for c in 0..n {
            let behind = behind(gradient, c);
            a[c] = each(|j| a[c][j] + (behind[j] - gradient[c][j]) * per_kg[c][j]);
            v[c] = each(|j| v[c][j] + kick_s * a[c][j]);
            x[c] = each(|j| x[c][j] + drift_s * v[c][j]);
        }
        if self.chain.has_wall() {
            let last = self.layout.of(self.chain.bodies().len() - 1);
            let gradient = self.net_n.as_ref().unwrap_or(self.push.gradient_n());
            self.wall_impulse += kick_s * gradient[last];
        }
    }
}
