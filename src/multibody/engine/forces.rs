//! Forces and accelerations at the present positions and speeds.

use super::super::contacts::{Contacts, StepPoint};
use super::super::rows::{LANES, LaneIndex, Rows, ahead, behind, each, larger};
use super::events::Speeds;
use super::state::Engine;

impl Engine<'_> {
    /// Forces at the present positions; interfaces that have left their piece are settled.
    #[inline(always)]
    pub(super) fn evaluate<const N: usize>(&mut self, at: StepPoint, speeds: Speeds) {
        let pushed = self.push.evaluate::<N>(&self.x_m, at);
        let pulled = self.pull.as_mut().is_some_and(|pull| pull.evaluate::<N>(&self.x_m, at));
        if pushed || pulled {
            self.settle(at, speeds);
        }
    }

    /// Accelerations from the forces, then speeds by `kick_s`; where forces depend on speeds,
    /// `v` is `lag_s` behind.
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
        let n = self.fixed.layout.known::<N>();
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
    fn accelerate_by_all(&mut self, at: StepPoint, lag_s: f64) {
        let n = self.fixed.layout.rows();
        let Some(mut net) = self.net_n.take() else { return };
        net.clone_from(self.push.forces_n(at));
        if let Some(pull) = &self.pull {
            let pulls = pull.forces_n(at).values(n);
            for (net, pull) in net.values_mut(n).iter_mut().zip(pulls) {
                *net = each(|j| net[j] - pull[j]);
            }
        }
        self.add_rates(&mut net, at, lag_s);
        self.add_dampers(&mut net, at, lag_s);
        if self.by_contacts.is_some() {
            self.accelerate_against_resistance(&net, lag_s);
        } else {
            let (net, per_kg) = (net.values(n), self.per_kg.values(n));
            for (c, a) in self.a.values_mut(n).iter_mut().enumerate() {
                let behind = behind(net, c);
                *a = each(|j| (behind[j] - net[c][j]) * per_kg[c][j]);
            }
        }
        self.net_n = Some(net);
    }

    /// Multiplies the forces of crush zones by what the speeds of their vehicles make of them.
    fn add_rates(&mut self, net_n: &mut Rows, at: StepPoint, lag_s: f64) {
        let n = self.fixed.layout.rows();
        self.losses.power.damper_w = 0.0;
        self.losses.power_of_w.values_mut(n).fill([0.0; LANES]);
        let (v, a, forces) = (&self.v, &self.a_start, self.push.forces_n(at));
        let mut acts = false;
        for rated in &self.fixed.rated {
            // Nothing times any factor; what crosses its begin in this step needs the factor all the same.
            if forces[rated.slot] == 0.0 && self.crossings.is_empty() {
                continue;
            }
            let speed = |slot: LaneIndex| v[slot] + lag_s * a[slot];
            let closing = speed(rated.behind) - rated.ahead.map_or(0.0, speed);
            self.rate_factors[rated.slot] = rated.rate.at(closing);
            acts = true;
        }
        if !acts {
            return;
        }
        let (v, a, forces) = (v.values(n), a.values(n), forces.values(n));
        let power = self.losses.power_of_w.values_mut(n);
        let peaks = self.peaks_n.values_mut(n);
        for (c, net) in net_n.values_mut(n).iter_mut().enumerate() {
            let factors = &self.rate_factors.values(n)[c];
            let extra = each(|j| (factors[j] - 1.0) * forces[c][j]);
            let (v_ahead, a_ahead) = (ahead(v, c), ahead(a, c));
            power[c] = each(|j| extra[j] * (v[c][j] - v_ahead[j] + lag_s * (a[c][j] - a_ahead[j])));
            *net = each(|j| net[j] + extra[j]);
            peaks[c] = larger(peaks[c], *net);
        }
        self.losses.power.damper_w = self.losses.power_of_w.sum(n);
    }

    /// Crush zones take the mass that has been stopped in the step; their speed and that of what
    /// they take become one, which loses energy and no momentum.
    pub(super) fn stop_mass(&mut self) {
        let ahead_s = self.fixed.ahead_s();
        for taken in &mut self.taken {
            let k = taken.interface;
            // Only a zone that is crushed further takes mass.
            let largest_m = self.push.largest_m(StepPoint::End, k).max(0.0);
            if largest_m == taken.largest_m {
                continue;
            }
            taken.largest_m = largest_m;
            let Some(stopping) = &self.fixed.chain.interfaces()[k].stopping else { continue };
            let least_kg = self.fixed.chain.bodies()[stopping.zone].mass_kg;
            let body = self.fixed.layout.of(stopping.body);
            let zone = self.fixed.layout.of(stopping.zone);
            let before_kg = self.mass_kg[zone];
            let now_kg = stopping.zone_near_kg(&mut taken.segment, largest_m, least_kg);
            let taken_kg = now_kg - before_kg;
            if taken_kg <= 0.0 {
                continue;
            }
            let difference = self.v[body] - self.v[zone];
            // At the step's end: speeds are `ahead_s` ahead, and the force of what is taken stays with the body.
            let mean = 0.5 * difference + ahead_s * self.a[zone];
            let lost_j = before_kg * taken_kg / now_kg * difference * mean;
            self.losses.damped_j += lost_j;
            self.losses.damped_of_j[self.fixed.layout.of(k)] += lost_j;
            self.v[zone] += taken_kg / now_kg * difference;
            for (slot, mass_kg) in [(zone, now_kg), (body, self.mass_kg[body] - taken_kg)] {
                // The forces stay, and so does the momentum that the next half step takes back.
                let per_kg = 1.0 / mass_kg;
                self.a[slot] *= self.mass_kg[slot] * per_kg;
                self.mass_kg[slot] = mass_kg;
                self.per_kg[slot] = per_kg;
            }
        }
    }

    fn add_dampers(&mut self, net_n: &mut Rows, at: StepPoint, lag_s: f64) {
        for &k in &self.fixed.damped {
            let slot = self.fixed.layout.of(k);
            // At 0 only where bodies meet at the start.
            let touches = |contacts: &Contacts<'_>| {
                contacts.deflections_m(at)[slot] >= 0.0 && !contacts.is_open(k)
            };
            let pulls = self.pull.as_ref().is_some_and(|pull| pull.has_law(k) && touches(pull));
            if !(touches(&self.push) || pulls) {
                continue;
            }
            let interface = &self.fixed.chain.interfaces()[k];
            let Some(damping) = &interface.damping else { continue };
            let closing = self.closing(k) + lag_s * self.between(&self.a_start, k);
            let spring = net_n[slot];
            let mut force = spring + damping.at(closing) * closing;
            if interface.tension.is_none() {
                // An interface that only pushes has no tension when it opens fast.
                force = force.max(0.0);
            }
            net_n[slot] = force;
            self.losses.power.damper_w += (force - spring) * closing;
            self.losses.power_of_w[slot] += (force - spring) * closing;
            self.events.interfaces[k].pressed(force);
            self.events.interfaces[k].pulled(-force);
        }
    }

    fn accelerate_against_resistance(&mut self, net_n: &Rows, lag_s: f64) {
        let power = &mut self.losses.power;
        (power.resistance_w, power.resistance_n) = (0.0, 0.0);
        let mut behind = 0.0;
        for (i, body) in self.fixed.chain.bodies().iter().enumerate() {
            let slot = self.fixed.layout.of(i);
            let (per_kg, net) = (self.per_kg[slot], net_n[slot]);
            let mut resistance = 0.0;
            if !body.resistance.is_none() {
                let v = self.v[slot] + lag_s * self.a_start[slot];
                resistance = body.resistance.force_n(body.mass_kg, v);
                power.resistance_w += resistance * v;
                power.resistance_n += resistance;
            }
            self.a[slot] = (behind - net - resistance) * per_kg;
            if let Some(by_contacts) = &mut self.by_contacts {
                by_contacts[slot] = (behind - net) * per_kg;
            }
            behind = net;
        }
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
        let n = self.fixed.layout.known::<N>();
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
        if self.fixed.chain.has_wall() {
            let last = self.fixed.layout.of(self.fixed.chain.bodies().len() - 1);
            let gradient = self.net_n.as_ref().unwrap_or(self.push.gradient_n());
            self.wall_impulse += kick_s * gradient[last];
        }
    }
}
