//! Forces and accelerations at the present positions and speeds.

use super::super::contacts::{Contacts, StepPoint};
use super::super::rows::{LANES, Neighbours, Rows, each, larger};
use super::events::Speeds;
use super::state::{Engine, Fixed, Taken};
use crate::multibody::chain::RateFactor;
use multiversion::multiversion;

/// Accelerations with tension, dampers, rates and resistance, then speeds by `kick_s`.
#[multiversion(targets("x86_64+avx+avx2"))]
fn accelerate_by_all<'a>(engine: &mut Engine<'a>, at: StepPoint, lag_s: f64, kick_s: f64) {
    let n = engine.fixed.layout.rows();
    let Some(mut net) = engine.net_n.take() else { return };
    net.values_mut(n).copy_from_slice(engine.push.forces_n(at).values(n));
    if let Some(pull) = &engine.pull {
        let pulls = pull.forces_n(at).values(n);
        for (net, pull) in net.values_mut(n).iter_mut().zip(pulls) {
            *net = each(|j| net[j] - pull[j]);
        }
    }
    engine.losses.power_of_w.values_mut(n).fill([0.0; LANES]);
    if !(engine.fixed.rated.is_empty() && engine.fixed.plain_rows.is_empty()) {
        engine.find_closing(lag_s);
    }
    engine.add_rates(&mut net, at, lag_s);
    engine.add_plain_dampers(&mut net, at);
    engine.losses.power.damper_w = engine.losses.power_of_w.sum(n);
    engine.add_dampers(&mut net, at, lag_s);
    if engine.by_contacts.is_some() {
        engine.accelerate_against_resistance(&net, lag_s);
        engine.kick::<0>(kick_s);
    } else {
        let (net, per_kg) = (net.values(n), engine.per_kg.values(n));
        let neighbours = Neighbours::behind(net);
        let (a, v) = (engine.a.values_mut(n), engine.v.values_mut(n));
        for c in 0..n {
            let behind = neighbours.before(c);
            a[c] = each(|j| (behind[j] - net[c][j]) * per_kg[c][j]);
            v[c] = each(|j| v[c][j] + kick_s * a[c][j]);
        }
    }
    engine.net_n = Some(net);
}

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
            return accelerate_by_all(self, at, lag_s, kick_s);
        }
        let n = self.fixed.layout.known::<N>();
        let forces = self.push.forces_n(at).values(n);
        let per_kg = self.per_kg.values(n);
        let (a, v) = (self.a.values_mut(n), self.v.values_mut(n));
        let neighbours = Neighbours::behind(forces);
        for c in 0..n {
            let behind = neighbours.before(c);
            a[c] = each(|j| (behind[j] - forces[c][j]) * per_kg[c][j]);
            v[c] = each(|j| v[c][j] + kick_s * a[c][j]);
        }
    }

    /// Multiplies the forces of crush zones by what the speeds of their vehicles make of them.
    #[inline(always)]
    fn add_rates(&mut self, net_n: &mut Rows, at: StepPoint, lag_s: f64) {
        let Fixed { rated, layout, sensitivity, share, .. } = &self.fixed;
        if rated.is_empty() {
            return;
        }
        let n = layout.rows();
        let (sensitivity, share) = (sensitivity.values(n), share.values(n));
        let (v, a) = (self.v.values(n), self.a_start.values(n));
        let forces = self.push.forces_n(at).values(n);
        let mut most = [0.0; LANES];
        for &(c, _) in rated {
            most = larger(most, each(|j| share[c][j] * forces[c][j].abs()));
        }
        // Nothing times any factor; what crosses its begin in this step needs the factor all the same.
        let acts = most.iter().any(|&n| n > 0.0) || !self.crossings.is_empty();
        if !acts {
            return;
        }
        for (c, speed) in self.speeds.values_mut(n).iter_mut().enumerate() {
            *speed = each(|j| v[c][j] + lag_s * a[c][j]);
        }
        let speeds = self.speeds.flat();
        let factors = self.rate_factors.values_mut(n);
        for &(c, sides) in rated {
            let closing = each(|j| speeds[sides[j][0]] - speeds[sides[j][1]]);
            factors[c] = each(|j| RateFactor::of(sensitivity[c][j], share[c][j] * closing[j]));
        }
        let power = self.losses.power_of_w.values_mut(n);
        let peaks = self.peaks_n.values_mut(n);
        let (net, closing) = (net_n.values_mut(n), self.closing_m_per_s.values(n));
        for &(c, _) in rated {
            let (force, factor, closing) = (forces[c], factors[c], closing[c]);
            let extra = each(|j| (factor[j] - 1.0) * force[j]);
            power[c] = each(|j| extra[j] * closing[j]);
            net[c] = each(|j| net[c][j] + extra[j]);
            peaks[c] = larger(peaks[c], net[c]);
        }
    }

    /// Closing speeds of all interfaces. Apart from the passes that need them, so that these load whole rows.
    #[inline(always)]
    fn find_closing(&mut self, lag_s: f64) {
        let n = self.fixed.layout.rows();
        let (v, a) = (self.v.values(n), self.a_start.values(n));
        let (next_v, next_a) = (Neighbours::ahead(v), Neighbours::ahead(a));
        for (c, closing) in self.closing_m_per_s.values_mut(n).iter_mut().enumerate() {
            let (v_ahead, a_ahead) = (next_v.after(c), next_a.after(c));
            *closing = each(|j| v[c][j] - v_ahead[j] + lag_s * (a[c][j] - a_ahead[j]));
        }
    }

    /// Adds the dampers that only push and have one coefficient, such as those of end plates.
    #[inline(always)]
    fn add_plain_dampers(&mut self, net_n: &mut Rows, at: StepPoint) {
        let n = self.fixed.layout.rows();
        let deflections = self.push.deflections_m(at).values(n);
        let power = self.losses.power_of_w.values_mut(n);
        let peaks = self.peaks_n.values_mut(n);
        let damping = self.fixed.plain_n_s_per_m.values(n);
        let closing = self.closing_m_per_s.values(n);
        for &c in &self.fixed.plain_rows {
            let net = &mut net_n.values_mut(n)[c];
            let (all, deflection, from_m) = (damping[c], deflections[c], self.push.begins_m(c));
            let (closing, spring) = (closing[c], *net);
            // At 0 only where bodies meet at the start.
            let touching = each(|j| if deflection[j] >= 0.0 { all[j] } else { 0.0 });
            let acting = each(|j| if from_m[j] > f64::NEG_INFINITY { touching[j] } else { 0.0 });
            // No tension where it opens fast.
            let least = each(|j| if acting[j] > 0.0 { 0.0 } else { f64::NEG_INFINITY });
            let force = larger(each(|j| spring[j] + acting[j] * closing[j]), least);
            *net = force;
            power[c] = each(|j| power[c][j] + (force[j] - spring[j]) * closing[j]);
            peaks[c] = larger(peaks[c], each(|j| if acting[j] > 0.0 { force[j] } else { 0.0 }));
        }
    }

    /// Crush zones take the mass that has been stopped in the step; their speed and that of what
    /// they take become one, which loses energy and no momentum.
    ///
    /// `turned` says whether a deflection may have been larger within the step than at its end.
    #[inline(always)]
    pub(super) fn stop_mass(&mut self, turned: bool) {
        let ahead_s = self.fixed.ahead_s();
        let deflections_m = self.push.deflections_m(StepPoint::End).flat();
        let (v, a) = (self.v.flat_mut(), self.a.flat_mut());
        let (mass_kg, per_kg) = (self.mass_kg.flat_mut(), self.per_kg.flat_mut());
        let damped_of_j = self.losses.damped_of_j.flat_mut();
        for taken in &mut self.taken {
            // Only a zone that is crushed further takes mass.
            if !turned && deflections_m[taken.slot] <= taken.largest_m {
                continue;
            }
            let largest_m = self.push.largest_m(StepPoint::End, taken.interface).max(0.0);
            if largest_m == taken.largest_m {
                continue;
            }
            taken.largest_m = largest_m;
            let Taken { body, zone, .. } = *taken;
            let before_kg = mass_kg[zone];
            let now_kg = taken.stopped_kg.force_near(&mut taken.segment, largest_m);
            let now_kg = now_kg.max(taken.least_kg);
            let taken_kg = now_kg - before_kg;
            if taken_kg <= 0.0 {
                continue;
            }
            let difference = v[body] - v[zone];
            // At the step's end: speeds are `ahead_s` ahead, and the force of what is taken stays with the body.
            let mean = 0.5 * difference + ahead_s * a[zone];
            let lost_j = before_kg * taken_kg / now_kg * difference * mean;
            self.losses.damped_j += lost_j;
            damped_of_j[taken.slot] += lost_j;
            v[zone] += taken_kg / now_kg * difference;
            for (i, now_kg) in [(zone, now_kg), (body, mass_kg[body] - taken_kg)] {
                // The forces stay, and so does the momentum that the next half step takes back.
                let now_per_kg = 1.0 / now_kg;
                a[i] *= mass_kg[i] * now_per_kg;
                mass_kg[i] = now_kg;
                per_kg[i] = now_per_kg;
            }
        }
    }

    /// Adds the dampers that are not plain.
    fn add_dampers(&mut self, net_n: &mut Rows, at: StepPoint, lag_s: f64) {
        for &k in &self.fixed.other_dampers {
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
        let neighbours = Neighbours::behind(gradient);
        for c in 0..n {
            let behind = neighbours.before(c);
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
