//! Reference integrator: extrapolation with adaptive order and step, independent of the
//! engine's pieces.
//!
//! Memory advances on accepted steps only; inside a step the force takes the larger of memory and
//! deflection. That force is smooth where a deflection turns, so the error does not show a step
//! over the turn, which would leave the memory short of the top: steps end at turns.
//!
//! Shares no code with the other methods but the law: tests and `cargo bench --bench trains` measure their errors against it.

use super::chain::{Chain, Interface};
use super::law::ForceLaw;
use super::recorder::{EventRecorder, Moment};
use super::rows::{Layout, Rows};
use super::run::{Account, Balance, Grid, Record, Run, RunSettings, curve_ended, diverged};
use crate::error::{Error, error};

/// Between two outputs; smooth motions take some hundred.
const MOST_STEPS: usize = 20_000;
/// A shorter step, in s, says that the force is not a function of the state.
const SHORTEST_S: f64 = 1e-15;
/// A closing speed below this share of the fastest body's counts as zero: the deflection then is
/// within `(1e-8)²` of its top.
const TURNED: f64 = 1e-8;

/// Runs the chain and fills in `run`; extremes are those of its steps, contacts those of the
/// outputs, and there is no restitution.
pub(super) fn run(
    chain: &Chain,
    settings: &RunSettings,
    grid: &Grid,
    run: &mut Run,
) -> Result<(), Error> {
    let mut reference = Reference::new(chain, settings);
    let mut interfaces_j = reference.output(0.0, run);
    for output in 1..=grid.outputs {
        reference.go_on(grid.output_s(output - 1), grid.output_s(output))?;
        interfaces_j = reference.output(grid.output_s(output), run);
    }
    reference.events.close(run, settings.record, settings.output_interval_s);
    run.ledger = reference.account.close(interfaces_j.0, interfaces_j.1);
    Ok(())
}

/// A run by extrapolation.
struct Reference<'a> {
    motion: Motion<'a>,
    record: Record,
    longest_s: f64,
    fastest_m_per_s: f64,
    /// What the error of each value of the state is measured by.
    scale: Vec<f64>,
    layout: Layout,
    y: Vec<f64>,
    /// The step to try next.
    h: f64,
    events: EventRecorder,
    account: Account,
}

impl<'a> Reference<'a> {
    /// The chain at its first contact.
    fn new(chain: &'a Chain, settings: &RunSettings) -> Self {
        let bodies = chain.bodies();
        let n = bodies.len();
        let fastest = bodies.iter().map(|b| b.speed_m_per_s.abs()).fold(1e-3, f64::max);
        let heaviest = bodies.iter().map(|b| b.mass_kg).fold(0.0, f64::max);
        let momentum = fastest * heaviest;
        let scale = (0..2 * n + 3)
            .map(|i| match i {
                _ if i < n => fastest * 0.1,
                _ if i < 2 * n => fastest,
                _ if i == 2 * n => momentum,
                _ => momentum * fastest,
            })
            .collect();
        let mut y = chain.first_contact();
        y.extend(bodies.iter().map(|body| body.speed_m_per_s));
        y.extend([0.0; 3]);
        let layout = Layout::new(n);
        Self {
            motion: Motion::new(chain),
            record: settings.record,
            longest_s: settings.output_interval_s,
            fastest_m_per_s: fastest,
            scale,
            y,
            h: settings.step_s.min(settings.output_interval_s) / 64.0,
            events: EventRecorder::new(chain, &layout),
            layout,
            account: Account::open(chain),
        }
    }

    /// Steps from one output to the next.
    fn go_on(&mut self, from_s: f64, to_s: f64) -> Result<(), Error> {
        let (mut time_s, mut steps) = (from_s, 0);
        while time_s < to_s {
            steps += 1;
            if steps > MOST_STEPS {
                return Err(error!(
                    Simulation at "run.method",
                    "the reference method needs more than {MOST_STEPS} steps between {from_s:.6} s and {to_s:.6} s, at {time_s:.6} s: forces that jump, as those of stages do, are for verlet and fourth_order"
                ));
            }
            let left = to_s - time_s;
            let is_last = self.h >= left;
            let step = if is_last { left } else { self.h };
            let (next, error) = self.motion.step(&self.y, step, &self.scale);
            let is_exact = error <= 1.0;
            let slow = TURNED * self.fastest_m_per_s;
            let turn = if is_exact { self.motion.turn(&self.y, &next, slow) } else { None };
            if let Some(share) = turn {
                // The secant's step; it is taken again until it ends at the turn.
                self.h = share * step;
            } else if is_exact {
                self.y = next;
                time_s = if is_last { to_s } else { time_s + step };
                self.accept(time_s)?;
                if !is_last || error < 0.01 {
                    self.h = (1.5 * self.h).min(self.longest_s);
                }
            } else {
                self.h = 0.3 * step;
            }
            self.check(time_s)?;
        }
        Ok(())
    }

    /// Fails where the motion cannot be followed.
    fn check(&self, time_s: f64) -> Result<(), Error> {
        if !self.y.iter().all(|y| y.is_finite()) {
            let bodies = self.motion.chain.bodies();
            let speeds = &self.y[bodies.len()..];
            let i = (0..bodies.len()).find(|&i| !speeds[i].is_finite()).unwrap_or(0);
            return Err(diverged(&bodies[i], time_s));
        }
        if self.h < SHORTEST_S {
            return Err(error!(
                Simulation at "run.method",
                "the step fell below {SHORTEST_S:e} s at {time_s:.6} s: the reference method cannot follow this motion"
            ));
        }
        Ok(())
    }

    /// Memory and events of an accepted step.
    fn accept(&mut self, time_s: f64) -> Result<(), Error> {
        let n = self.motion.chain.bodies().len();
        let a = self.motion.by_contacts(&self.y);
        for (i, &a) in a.iter().enumerate() {
            self.events.look(i, Moment { time_s, v_m_per_s: self.y[n + i] }, a);
        }
        self.events.looked::<0>(&Rows::of(&self.layout, n, |i| a[i]), time_s);
        for (k, interface) in self.motion.chain.interfaces().iter().enumerate() {
            let contact = self.motion.contact(&self.y, k);
            if interface.law.is_beyond_end(contact.deflection_m) {
                let (law, deflection_m) = (&interface.law, contact.deflection_m);
                return Err(curve_ended((k, interface), law, false, deflection_m, time_s));
            }
            self.record_contact(k, &contact, time_s);
            self.events.interfaces[k].pulled(-contact.force_n());
            self.events.interfaces[k].extended(contact.extension_m);
            self.motion.remember(k, &contact);
        }
        Ok(())
    }

    fn record_contact(&mut self, k: usize, contact: &Contact, time_s: f64) {
        self.events.interfaces[k].pressed(contact.force_n());
        self.events.interfaces[k].deflected(contact.deflection_m, time_s);
    }

    /// Records the state; gives what the interfaces have stored and dissipated, in J.
    fn output(&mut self, time_s: f64, run: &mut Run) -> (f64, f64) {
        let bodies = self.motion.chain.bodies();
        let n = bodies.len();
        let (stored_j, dissipated_j) = self.output_interfaces(time_s, run);
        let rates = self.motion.rates(&self.y);
        let masses_kg = self.motion.masses_kg(&self.y);
        let (x, rest) = self.y.split_at(n);
        let (v, [impulse, damped_j, resisted_j]) =
            (&rest[..n], [rest[n], rest[n + 1], rest[n + 2]]);
        let (mut kinetic_j, mut momentum) = (0.0, 0.0);
        for (i, history) in run.bodies.iter_mut().enumerate() {
            let mass_kg = masses_kg[i];
            kinetic_j += 0.5 * mass_kg * v[i] * v[i];
            momentum += mass_kg * v[i];
            history.v_m_per_s.push(v[i]);
            if self.record != Record::Summary {
                history.x_m.push(x[i]);
                history.a_m_per_s2.push(rates[n + i]);
            }
        }
        self.events.output_bodies::<0>(&Rows::of(&self.layout, n, |i| v[i]), time_s);
        if self.record != Record::Summary {
            run.time_s.push(time_s);
        }
        self.account.audit(&Balance {
            kinetic_j,
            interfaces_j: stored_j + dissipated_j,
            damped_j,
            resisted_j,
            momentum,
            impulse,
        });
        (stored_j, dissipated_j)
    }

    /// The part of [`Self::output`] of the interfaces.
    fn output_interfaces(&mut self, time_s: f64, run: &mut Run) -> (f64, f64) {
        let (mut all_stored_j, mut all_dissipated_j) = (0.0, 0.0);
        for (k, history) in run.interfaces.iter_mut().enumerate() {
            let contact = self.motion.contact(&self.y, k);
            let (stored_j, dissipated_j) = self.motion.energies_j(k, &contact);
            all_stored_j += stored_j;
            all_dissipated_j += dissipated_j;
            self.record_contact(k, &contact, time_s);
            (history.stored_at_end_j, history.dissipated_at_end_j) = (stored_j, dissipated_j);
            if self.record != Record::Summary {
                history.deflection_m.push(contact.deflection_m);
                history.force_n.push(contact.force_n());
                history.largest_deflection_m.push(self.motion.pushed_m[k]);
                history.stored_j.push(stored_j);
                history.dissipated_j.push(dissipated_j);
            }
        }
        (all_stored_j, all_dissipated_j)
    }
}

/// A chain with the memory of its interfaces.
///
/// A state `y` holds the positions of all bodies, then their speeds, then the impulse of wall and
/// track, the damped and the resisted energy.
struct Motion<'a> {
    chain: &'a Chain,
    /// Maximum deflection and extension so far.
    pushed_m: Vec<f64>,
    pulled_m: Vec<f64>,
}

/// Deflection, extension and forces at an interface.
struct Contact {
    deflection_m: f64,
    extension_m: f64,
    spring_n: f64,
    damper_n: f64,
    closing: f64,
}

impl Contact {
    /// Net force, below 0 where a coupling pulls.
    fn force_n(&self) -> f64 {
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
    fn new(chain: &'a Chain) -> Self {
        let none = vec![0.0; chain.interfaces().len()];
        Self { chain, pushed_m: none.clone(), pulled_m: none }
    }

    fn contact(&self, y: &[f64], k: usize) -> Contact {
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
    fn rates(&self, y: &[f64]) -> Vec<f64> {
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
    fn masses_kg(&self, y: &[f64]) -> Vec<f64> {
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
    fn by_contacts(&self, y: &[f64]) -> Vec<f64> {
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
    fn turn(&self, y: &[f64], next: &[f64], slow: f64) -> Option<f64> {
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
    fn remember(&mut self, k: usize, contact: &Contact) {
        self.pushed_m[k] = self.pushed_m[k].max(contact.deflection_m);
        self.pulled_m[k] = self.pulled_m[k].max(contact.extension_m);
    }

    fn energies_j(&self, k: usize, contact: &Contact) -> (f64, f64) {
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

/// Error per step, relative to the speeds and crushes of the run.
const TOLERANCE: f64 = 1e-12;
/// Rows of the extrapolation, with `2 (j + 1)` substeps each.
const ROWS: usize = 8;

impl Motion<'_> {
    /// Gragg's rule over `h` with `2 (row + 1)` substeps.
    fn midpoint(&self, y: &[f64], first: &[f64], h: f64, row: usize) -> Vec<f64> {
        let substeps = 2 * (row + 1);
        let step = h / substeps as f64;
        let mut before = y.to_vec();
        let mut now: Vec<f64> = y.iter().zip(first).map(|(y, f)| y + step * f).collect();
        for _ in 1..substeps {
            let rates = self.rates(&now);
            for ((before, now), rate) in before.iter_mut().zip(&mut now).zip(&rates) {
                let next = *before + 2.0 * step * rate;
                (*before, *now) = (*now, next);
            }
        }
        let rates = self.rates(&now);
        before.iter().zip(&now).zip(&rates).map(|((b, n), r)| 0.5 * (b + n + step * r)).collect()
    }

    /// The state after `h`, and its error over the tolerance, infinite if no two rows are
    /// within it.
    fn step(&self, y: &[f64], h: f64, scale: &[f64]) -> (Vec<f64>, f64) {
        let first = self.rates(y);
        let mut table: Vec<Vec<f64>> = Vec::with_capacity(ROWS);
        let mut error = f64::INFINITY;
        for row in 0..ROWS {
            let before = error;
            let mut value = self.midpoint(y, &first, h, row);
            // Aitken and Neville in h², along the last row of the table: `previous` is the row
            // before in the same column.
            for (column, previous) in table.iter_mut().enumerate() {
                let ratio = ((row + 1) as f64 / (row - column) as f64).powi(2);
                error = 0.0;
                for ((v, p), s) in value.iter_mut().zip(previous.iter_mut()).zip(scale) {
                    let improved = *v + (*v - *p) / (ratio - 1.0);
                    error = error.max((improved - *v).abs() / (TOLERANCE * s));
                    (*p, *v) = (*v, improved);
                }
            }
            // Over a kink two values may agree by chance, but hardly twice.
            if error <= 1.0 && before <= 1.0 {
                return (value, error);
            }
            table.push(value);
        }
        (y.to_vec(), f64::INFINITY)
    }
}
