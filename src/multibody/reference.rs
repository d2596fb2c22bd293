//! Reference integrator: extrapolation with adaptive order and step, independent of the
//! engine's pieces.
//!
//! Gragg's modified midpoint rule, extrapolated in h² (E. Hairer, S. P. Nørsett, G. Wanner,
//! Solving Ordinary Differential Equations I, II.8 and II.9). Memory advances on accepted steps
//! only; inside a step the force takes the larger of memory and deflection. That force is smooth
//! where a deflection turns, so the error does not show a step over the turn, which would leave
//! the memory short of the top: steps end at turns.

use super::chain::{Body, Chain};
use super::law::ForceLaw;
use super::ledger::{Account, Balance};
use super::recorder::EventRecorder;
use super::rows::{Layout, Rows};
use super::run::{Record, Run, RunSettings, SimulationError};

/// Error per step, relative to the speeds and crushes of the run.
const TOLERANCE: f64 = 1e-12;
/// Rows of the extrapolation, with `2 (j + 1)` substeps each.
const ROWS: usize = 8;
/// Below this step something is no function.
const SHORTEST_S: f64 = 1e-15;
/// A closing speed as small a share of the fastest body's is none: the deflection then is within
/// `(1e-8)²` of its top.
const TURNED: f64 = 1e-8;

struct Motion<'a> {
    chain: &'a Chain,
    /// Largest deflection and extension so far.
    pushed_m: Vec<f64>,
    pulled_m: Vec<f64>,
}

/// Deflection, extension and net force at an interface.
struct Contact {
    deflection_m: f64,
    extension_m: f64,
    spring_n: f64,
    damper_n: f64,
    closing: f64,
}

impl Motion<'_> {
    fn contact(&self, y: &[f64], k: usize) -> Contact {
        let n = self.chain.bodies().len();
        let interface = &self.chain.interfaces()[k];
        let at = |i: usize, speed: bool| match i < n {
            true => y[if speed { n + i } else { i }],
            false => 0.0,
        };
        let moved = at(k, false) - at(k + 1, false);
        let closing = at(k, true) - at(k + 1, true);
        let deflection_m = moved - interface.gap_m;
        let force = |law: &ForceLaw, d: f64, largest: f64| law.force_n(d, largest.max(d).max(0.0));
        let pushes = force(&interface.law, deflection_m, self.pushed_m[k]);
        let (mut extension_m, mut pulls) = (-1.0, 0.0);
        if let Some(tension) = &interface.tension {
            extension_m = -moved - tension.slack_m;
            pulls = force(&tension.law, extension_m, self.pulled_m[k]);
        }
        let touches = |law: &ForceLaw, d: f64, largest: f64, force: f64, closing: f64| {
            let begins = d == 0.0 && closing > 0.0;
            (d > 0.0 || begins) && (force != 0.0 || d >= largest || !law.has_memory())
        };
        let mut in_contact =
            touches(&interface.law, deflection_m, self.pushed_m[k], pushes, closing);
        if let Some(tension) = &interface.tension {
            in_contact |= touches(&tension.law, extension_m, self.pulled_m[k], pulls, -closing);
        }
        let spring_n = pushes - pulls;
        let mut damper_n = 0.0;
        if let Some(damping) = &interface.damping
            && in_contact
        {
            damper_n = damping.at(closing) * closing;
            if interface.tension.is_none() {
                damper_n = damper_n.max(-spring_n);
            }
        }
        Contact { deflection_m, extension_m, spring_n, damper_n, closing }
    }

    /// Rates of positions, speeds, then of the impulse of wall and track, of damped and of
    /// resisted energy.
    fn rates(&self, y: &[f64]) -> Vec<f64> {
        let bodies = self.chain.bodies();
        let n = bodies.len();
        let mut rates = vec![0.0; 2 * n + 3];
        let mut behind = 0.0;
        for (i, body) in bodies.iter().enumerate() {
            let mut ahead = 0.0;
            if i < self.chain.interfaces().len() {
                let contact = self.contact(y, i);
                ahead = contact.spring_n + contact.damper_n;
                rates[2 * n + 1] += contact.damper_n * contact.closing;
            }
            let v = y[n + i];
            let resistance = body.resistance.force_n(body.mass_kg, v);
            rates[i] = v;
            rates[n + i] = (behind - ahead - resistance) / body.mass_kg;
            rates[2 * n] += resistance;
            rates[2 * n + 2] += resistance * v;
            behind = ahead;
        }
        if self.chain.has_wall() {
            rates[2 * n] += behind;
        }
        rates
    }

    /// Accelerations of the bodies by the forces between them.
    fn by_contacts(&self, y: &[f64]) -> Vec<f64> {
        let mut behind_n = 0.0;
        let of = |(i, body): (usize, &Body)| {
            let mut ahead_n = 0.0;
            if i < self.chain.interfaces().len() {
                let contact = self.contact(y, i);
                ahead_n = contact.spring_n + contact.damper_n;
            }
            let a = (behind_n - ahead_n) / body.mass_kg;
            behind_n = ahead_n;
            a
        };
        self.chain.bodies().iter().enumerate().map(of).collect()
    }

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

impl Motion<'_> {
    /// The share of a step from `y` to `next` up to the first turn of a law with memory at its
    /// largest deflection, if one lies before the step's end.
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
}

/// Runs the chain; extremes are those of its steps, contacts those of the outputs, and there is
/// no restitution.
pub(super) fn run(
    chain: &Chain,
    settings: &RunSettings,
    run: &mut Run,
    outputs: usize,
) -> Result<(), SimulationError> {
    let (bodies, interfaces) = (chain.bodies(), chain.interfaces());
    let n = bodies.len();
    let start = chain.first_contact();
    let mut y = vec![0.0; 2 * n + 3];
    for i in 0..n {
        (y[i], y[n + i]) = (start[i], bodies[i].speed_m_per_s);
    }
    let none = vec![0.0; interfaces.len()];
    let mut motion = Motion { chain, pushed_m: none.clone(), pulled_m: none };
    let fastest = bodies.iter().map(|b| b.speed_m_per_s.abs()).fold(1e-3, f64::max);
    let heaviest = bodies.iter().map(|b| b.mass_kg).fold(0.0, f64::max);
    let momentum = fastest * heaviest;
    let scale: Vec<f64> = (0..2 * n + 3)
        .map(|i| match i {
            _ if i < n => fastest * 0.1,
            _ if i < 2 * n => fastest,
            _ if i == 2 * n => momentum,
            _ => momentum * fastest,
        })
        .collect();
    let mut account = Account::open(chain);
    let layout = Layout::new(n);
    let mut events = EventRecorder::new(chain, &layout);
    let mut h = settings.step_s.min(settings.output_interval_s) / 64.0;
    let mut interfaces_j =
        record(&motion, &y, 0.0, settings.record, run, &mut account, &mut events);
    for output in 1..=outputs {
        let end_s = output as f64 * settings.output_interval_s;
        let mut time_s = (output - 1) as f64 * settings.output_interval_s;
        while time_s < end_s {
            let left = end_s - time_s;
            let last = h >= left;
            let step = if last { left } else { h };
            let (next, error) = motion.step(&y, step, &scale);
            let turn = if error <= 1.0 { motion.turn(&y, &next, TURNED * fastest) } else { None };
            if let Some(share) = turn {
                // The secant's step; it is taken anew until it ends at the turn.
                h = share * step;
            } else if error <= 1.0 {
                y = next;
                time_s = if last { end_s } else { time_s + step };
                let contacts = motion.by_contacts(&y);
                for (i, &a) in contacts.iter().enumerate() {
                    events.follow(i, time_s, y[n + i], a);
                }
                events.looked::<0>(&Rows::of(&layout, n, |i| contacts[i]), time_s);
                for (k, interface) in interfaces.iter().enumerate() {
                    let contact = motion.contact(&y, k);
                    if interface.law.is_beyond_end(contact.deflection_m) {
                        return Err(SimulationError::CurveEnd {
                            interface: interface.name.clone(),
                            what: "crushed",
                            deflection_m: contact.deflection_m,
                            time_s,
                            end_m: interface.law.end_m(),
                        });
                    }
                    let force_n = contact.spring_n + contact.damper_n;
                    events.output_interface(k, contact.deflection_m, force_n, time_s);
                    events.tension(k, -force_n, contact.extension_m);
                    motion.pushed_m[k] = motion.pushed_m[k].max(contact.deflection_m);
                    motion.pulled_m[k] = motion.pulled_m[k].max(contact.extension_m);
                }
                if !last || error < 0.01 {
                    h = (1.5 * h).min(settings.output_interval_s);
                }
            } else {
                h = 0.3 * step;
            }
            if !y.iter().all(|y| y.is_finite()) {
                let i = (0..n).find(|&i| !y[n + i].is_finite()).unwrap_or(0);
                return Err(SimulationError::Diverged { body: bodies[i].name.clone(), time_s });
            }
            if h < SHORTEST_S {
                return Err(SimulationError::Stuck { step_s: SHORTEST_S, time_s });
            }
        }
        interfaces_j = record(&motion, &y, end_s, settings.record, run, &mut account, &mut events);
    }
    events.close(run, settings.record, settings.output_interval_s);
    run.ledger = account.close(interfaces_j.0, interfaces_j.1);
    Ok(())
}

/// Records the state; gives what the interfaces have stored and dissipated, in J.
fn record(
    motion: &Motion<'_>,
    y: &[f64],
    time_s: f64,
    what: Record,
    run: &mut Run,
    account: &mut Account,
    events: &mut EventRecorder,
) -> (f64, f64) {
    let chain = motion.chain;
    let n = chain.bodies().len();
    let rates = motion.rates(y);
    let histories = what == Record::Histories;
    let (mut kinetic_j, mut momentum) = (0.0, 0.0);
    let (mut stored_j, mut dissipated_j) = (0.0, 0.0);
    for (k, history) in run.interfaces.iter_mut().enumerate() {
        let interface = &chain.interfaces()[k];
        let contact = motion.contact(y, k);
        let (mut stored, mut dissipated) =
            interface.law.energies_j(contact.deflection_m, motion.pushed_m[k]);
        if let Some(tension) = &interface.tension {
            let pulls = tension.law.energies_j(contact.extension_m, motion.pulled_m[k]);
            (stored, dissipated) = (stored + pulls.0, dissipated + pulls.1);
        }
        stored_j += stored;
        dissipated_j += dissipated;
        let force_n = contact.spring_n + contact.damper_n;
        events.output_interface(k, contact.deflection_m, force_n, time_s);
        if histories {
            history.deflection_m.push(contact.deflection_m);
            history.force_n.push(force_n);
            history.largest_deflection_m.push(motion.pushed_m[k]);
            history.stored_j.push(stored);
            history.dissipated_j.push(dissipated);
        }
    }
    for (i, history) in run.bodies.iter_mut().enumerate() {
        let (mass_kg, v) = (chain.bodies()[i].mass_kg, y[n + i]);
        kinetic_j += 0.5 * mass_kg * v * v;
        momentum += mass_kg * v;
        history.v_m_per_s.push(y[n + i]);
        if histories {
            history.x_m.push(y[i]);
            history.a_m_per_s2.push(rates[n + i]);
        }
    }
    let layout = Layout::new(n);
    let of = |value: &dyn Fn(usize) -> f64| Rows::of(&layout, n, value);
    events.output_bodies::<0>(&of(&|i| y[n + i]), time_s);
    if histories {
        run.time_s.push(time_s);
    }
    account.audit(&Balance {
        kinetic_j,
        interfaces_j: stored_j + dissipated_j,
        damped_j: y[2 * n + 1],
        resisted_j: y[2 * n + 2],
        momentum,
        impulse: y[2 * n],
    });
    (stored_j, dissipated_j)
}
