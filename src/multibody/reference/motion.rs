//! Forces and rates at any state of a chain, straight from the force laws.

use super::super::chain::{Chain, Interface};
use super::super::law::ForceLaw;

/// A chain with the memory of its interfaces.
///
/// A state `y` holds the positions of all bodies, then their speeds, then the impulse of wall and
/// track, the damped and the resisted energy.
pub(super) struct Motion<'a> {
    pub chain: &'a Chain,
    /// Maximum deflection and extension so far.
    pub pushed_m: Vec<f64>,
    pub pulled_m: Vec<f64>,
}

/// Deflection, extension and forces at an interface.
pub(super) struct Contact {
    pub deflection_m: f64,
    pub extension_m: f64,
    pub spring_n: f64,
    pub damper_n: f64,
    pub closing: f64,
}

impl Contact {
    /// Net force, below 0 where a coupling pulls.
    pub(crate) fn force_n(&self) -> f64 {
        self.spring_n + self.damper_n
    }
}

/// Whether a law is in contact at deflection `d`: it has a force, or is not below its memory.
fn touches(law: &ForceLaw, d: f64, largest_m: f64, force_n: f64, closing: f64) -> bool {
    let begins = d == 0.0 && closing > 0.0;
    (d > 0.0 || begins) && (force_n != 0.0 || d >= largest_m || !law.has_memory())
}

impl<'a> Motion<'a> {
    /// Without any memory yet.
    pub(crate) fn new(chain: &'a Chain) -> Self {
        let none = vec![0.0; chain.interfaces().len()];
        Self { chain, pushed_m: none.clone(), pulled_m: none }
    }

    pub(crate) fn contact(&self, y: &[f64], k: usize) -> Contact {
        let n = self.chain.bodies().len();
        let interface = &self.chain.interfaces()[k];
        let of = |values: &[f64], i: usize| if i < n { values[i] } else { 0.0 };
        let moved = of(y, k) - of(y, k + 1);
        let closing = of(&y[n..], k) - of(&y[n..], k + 1);
        let force = |law: &ForceLaw, d: f64, largest: f64| law.force_n(d, largest.max(d).max(0.0));
        let deflection_m = moved - interface.gap_m;
        let pushes = force(&interface.law, deflection_m, self.pushed_m[k]);
        let mut in_contact =
            touches(&interface.law, deflection_m, self.pushed_m[k], pushes, closing);
        let (mut extension_m, mut pulls) = (-1.0, 0.0);
        if let Some(tension) = &interface.tension {
            extension_m = -moved - tension.slack_m;
            pulls = force(&tension.law, extension_m, self.pulled_m[k]);
            in_contact |= touches(&tension.law, extension_m, self.pulled_m[k], pulls, -closing);
        }
        let spring_n = pushes - pulls;
        let mut damper_n = if in_contact { damper_n(interface, closing, spring_n) } else { 0.0 };
        if let Some(rate) = &interface.rate {
            damper_n += (rate.at(rate.closing_m_per_s(|i| of(&y[n..], i))) - 1.0) * pushes;
        }
        Contact { deflection_m, extension_m, spring_n, damper_n, closing }
    }

    /// Rates of positions, speeds, then of the impulse of wall and track, of damped and of
    /// resisted energy.
    pub(crate) fn rates(&self, y: &[f64]) -> Vec<f64> {
        let bodies = self.chain.bodies();
        let n = bodies.len();
        let mut rates = vec![0.0; 2 * n + 3];
        let masses_kg = self.masses_kg(y);
        let mut behind = 0.0;
        for (i, body) in bodies.iter().enumerate() {
            let mut ahead = 0.0;
            if i < self.chain.interfaces().len() {
                let contact = self.contact(y, i);
                ahead = contact.force_n();
                rates[2 * n + 1] += contact.damper_n * contact.closing;
            }
            let v = y[n + i];
            let resistance = body.resistance.force_n(body.mass_kg, v);
            rates[i] = v;
            rates[n + i] = (behind - ahead - resistance) / masses_kg[i];
            rates[2 * n] += resistance;
            rates[2 * n + 2] += resistance * v;
            behind = ahead;
        }
        if self.chain.has_wall() {
            rates[2 * n] += behind;
        }
        self.add_stopping(y, &masses_kg, &mut rates);
        rates
    }

    /// Masses of the bodies in kg, with what crush zones have taken.
    pub(crate) fn masses_kg(&self, y: &[f64]) -> Vec<f64> {
        let mut masses_kg: Vec<f64> = self.chain.bodies().iter().map(|b| b.mass_kg).collect();
        for (k, interface) in self.chain.interfaces().iter().enumerate() {
            let Some(stopping) = &interface.stopping else { continue };
            let largest_m = self.contact(y, k).deflection_m.max(self.pushed_m[k]);
            let least_kg = self.chain.bodies()[stopping.zone].mass_kg;
            let taken_kg = stopping.zone_kg(largest_m, least_kg) - least_kg;
            masses_kg[stopping.zone] += taken_kg;
            masses_kg[stopping.body] -= taken_kg;
        }
        masses_kg
    }

    /// What the mass that is being stopped does to its crush zone, and the energy that it loses.
    fn add_stopping(&self, y: &[f64], masses_kg: &[f64], rates: &mut [f64]) {
        let n = masses_kg.len();
        for (k, interface) in self.chain.interfaces().iter().enumerate() {
            let Some(stopping) = &interface.stopping else { continue };
            let contact = self.contact(y, k);
            if contact.deflection_m < self.pushed_m[k] || contact.closing <= 0.0 {
                continue;
            }
            let least_kg = self.chain.bodies()[stopping.zone].mass_kg;
            let per_s = stopping.rate_kg_per_m(contact.deflection_m, least_kg) * contact.closing;
            let difference = y[n + stopping.body] - y[n + stopping.zone];
            rates[n + stopping.zone] += per_s * difference / masses_kg[stopping.zone];
            rates[2 * n + 1] += 0.5 * per_s * difference * difference;
        }
    }

    /// Accelerations of the bodies by the forces between them.
    pub(crate) fn by_contacts(&self, y: &[f64]) -> Vec<f64> {
        let mut behind_n = 0.0;
        let of = |(i, mass_kg): (usize, &f64)| {
            let mut ahead_n = 0.0;
            if i < self.chain.interfaces().len() {
                let contact = self.contact(y, i);
                ahead_n = contact.force_n();
            }
            let a = (behind_n - ahead_n) / mass_kg;
            behind_n = ahead_n;
            a
        };
        self.masses_kg(y).iter().enumerate().map(of).collect()
    }

    /// The share of a step from `y` to `next` up to the first turn of a law with memory at its
    /// maximum deflection, if one lies before the step's end.
    pub(crate) fn turn(&self, y: &[f64], next: &[f64], slow: f64) -> Option<f64> {
        let turn = |law: &ForceLaw, before: f64, now: f64, reached: bool| {
            let turned = law.has_memory() && reached && before > slow && now < -slow;
            turned.then(|| before / (before - now))
        };
        let mut first: Option<f64> = None;
        for (k, interface) in self.chain.interfaces().iter().enumerate() {
            let (was, is) = (self.contact(y, k), self.contact(next, k));
            let reached = |was_m: f64, is_m: f64, most_m: f64| was_m.max(is_m) >= most_m.max(0.0);
            let pushes = reached(was.deflection_m, is.deflection_m, self.pushed_m[k]);
            let pushed = turn(&interface.law, was.closing, is.closing, pushes);
            let pulled = interface.tension.as_ref().and_then(|tension| {
                let pulls = reached(was.extension_m, is.extension_m, self.pulled_m[k]);
                turn(&tension.law, -was.closing, -is.closing, pulls)
            });
            for share in pushed.into_iter().chain(pulled) {
                first = Some(first.map_or(share, |f: f64| f.min(share)));
            }
        }
        first
    }

    /// The memory follows to an accepted state.
    pub(crate) fn remember(&mut self, k: usize, contact: &Contact) {
        self.pushed_m[k] = self.pushed_m[k].max(contact.deflection_m);
        self.pulled_m[k] = self.pulled_m[k].max(contact.extension_m);
    }

    pub(crate) fn energies_j(&self, k: usize, contact: &Contact) -> (f64, f64) {
        let interface = &self.chain.interfaces()[k];
        let (mut stored_j, mut dissipated_j) =
            interface.law.energies_j(contact.deflection_m, self.pushed_m[k]);
        if let Some(tension) = &interface.tension {
            let pulls = tension.law.energies_j(contact.extension_m, self.pulled_m[k]);
            (stored_j, dissipated_j) = (stored_j + pulls.0, dissipated_j + pulls.1);
        }
        (stored_j, dissipated_j)
    }
}

/// Force of the damper of an interface in contact. One that only pushes does not pull.
fn damper_n(interface: &Interface, closing: f64, spring_n: f64) -> f64 {
    let Some(damping) = &interface.damping else { return 0.0 };
    let force_n = damping.at(closing) * closing;
    if interface.tension.is_none() { force_n.max(-spring_n) } else { force_n }
}
