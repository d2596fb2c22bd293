//! Fixed steps over a chain: velocity Verlet, and a scheme of fourth order.
//!
//! Where an interface goes from one piece of its law to another within a step, the quadrature
//! misses some of the impulse and of its moment. Both follow from the law's tables (`events.rs`):
//! along the step's path the mean force is the work done over the change of deflection. Without
//! it every knot, contact and opening would leave an error of the order h².

mod events;
mod outputs;

use std::ops::Range;

use multiversion::multiversion;

use super::bank::{At, Bank};
use super::integrator::{Method, Record, Run, SimulationError};
use super::rows::{Place, Places, Rows, behind, each};
use super::train::{Chain, Tension};
use super::watch::{LOOK_S, Watch};
use events::Missed;
use outputs::Recorder;

/// Everything that changes from step to step.
pub(super) struct Engine<'a> {
    chain: &'a Chain,
    places: Places,
    x_m: Rows,
    /// Between the outputs half a step (Verlet) or a sixth (fourth order) ahead of `x`.
    v: Rows,
    a: Rows,
    /// At the start of the step.
    a_start: Rows,
    /// Without resistance, where there is some.
    by_contacts: Option<Rows>,
    mass_kg: Rows,
    per_kg: Rows,
    push: Bank<'a>,
    pull: Option<Bank<'a>>,
    /// Net forces if more than the pushing ones act; for a while their gradient.
    net_n: Option<Rows>,
    missed: Vec<Missed>,
    /// Interfaces that have left their pieces, pulling ones after pushing ones.
    left: Vec<(bool, Place)>,
    step_s: f64,
    /// End of the present step.
    end_s: f64,
    rates: Rates,
    wall_impulse: f64,
    watch: Watch,
}

/// Work and impulse of what depends on speeds.
#[derive(Default)]
struct Rates {
    damped_j: f64,
    resisted_j: f64,
    impulse: f64,
    /// Power of dampers and resistance, and resisting force, at the last step.
    damper_w: f64,
    resistance_w: f64,
    resistance_n: f64,
}

impl<'a> Engine<'a> {
    /// The chain at its first contact.
    fn new(chain: &'a Chain, step_s: f64) -> Self {
        let (bodies, interfaces) = (chain.bodies(), chain.interfaces());
        let places = Places::new(bodies.len());
        let laws: Vec<_> = interfaces.iter().map(|i| (Some(&*i.law), i.gap_m)).collect();
        let couples = interfaces.iter().any(|i| i.tension.is_some());
        let pull = couples.then(|| {
            let law = |t: &'a Tension| (Some(&*t.law), t.slack_m);
            let laws: Vec<_> =
                interfaces.iter().map(|i| i.tension.as_ref().map_or((None, 0.0), law)).collect();
            Bank::new(&places, &laws, -1.0)
        });
        let of = |value: &dyn Fn(usize) -> f64| Rows::of(&places, bodies.len(), value);
        let net = couples || chain.has_rates();
        let mut engine = Self {
            chain,
            x_m: of(&|_| 0.0),
            v: of(&|i| bodies[i].speed_m_per_s),
            a: of(&|_| 0.0),
            a_start: of(&|_| 0.0),
            by_contacts: chain.has_resistance().then(|| of(&|_| 0.0)),
            mass_kg: of(&|i| bodies[i].mass_kg),
            per_kg: of(&|i| 1.0 / bodies[i].mass_kg),
            push: Bank::new(&places, &laws, 1.0),
            net_n: net.then(|| of(&|_| 0.0)),
            pull,
            missed: Vec::new(),
            left: Vec::new(),
            step_s,
            end_s: 0.0,
            rates: Rates::default(),
            wall_impulse: 0.0,
            watch: Watch::new(chain, &places),
            places,
        };
        engine.move_to_first_contact();
        engine.accelerate_and_kick::<0>(At::End, 0.0, 0.0);
        for k in 0..interfaces.len() {
            if engine.push.is_loading(k) {
                engine.watch.contact(k, engine.closing(k));
                if !engine.push.presses(k) {
                    continue;
                }
                for i in engine.sides(k) {
                    engine.watch.body(i, true, 0.0, bodies[i].speed_m_per_s);
                }
            }
        }
        engine
    }

    /// The bodies at interface `k`.
    fn sides(&self, k: usize) -> Range<usize> {
        k..self.chain.bodies().len().min(k + 2)
    }

    /// Net force of interface `k`.
    fn force_n(&self, at: At, k: usize) -> f64 {
        self.forces_n(at)[self.places.of(k)]
    }

    /// Net forces of all interfaces.
    #[inline(always)]
    fn forces_n(&self, at: At) -> &Rows {
        self.net_n.as_ref().unwrap_or(self.push.forces_n(at))
    }

    /// Free motion until the first gap closes; none if no interface closes.
    fn move_to_first_contact(&mut self) {
        let (flight_s, flights) = flights(self.chain);
        self.drift::<0>(flight_s);
        for (k, interface) in self.chain.interfaces().iter().enumerate() {
            let closing = self.closing(k);
            // Exactly 0 where contact begins, whatever the rounding.
            let at = |begins_s: f64, closing: f64, gap_m: f64| match begins_s == flight_s {
                true => 0.0,
                false => closing * flight_s - gap_m,
            };
            let deflection = at(flights[k].0, closing, interface.gap_m);
            self.push.place(k, deflection, closing > 0.0);
            if let (Some(pull), Some(tension)) = (&mut self.pull, &interface.tension) {
                pull.place(k, at(flights[k].1, -closing, tension.slack_m), closing < 0.0);
            }
        }
    }

    /// Rate of deflection of interface `k`: of the body behind it against what is in front.
    fn closing(&self, k: usize) -> f64 {
        self.between(&self.v, k)
    }

    /// By how much a value of the body behind interface `k` exceeds that of what is in front.
    fn between(&self, values: &Rows, k: usize) -> f64 {
        values[self.places.of(k)] - values[self.places.of(k + 1)]
    }

    /// Forces at the present positions; interfaces that have left their piece are settled.
    /// `share` is the part of a step by which `v` is ahead of the step's start, below 0 if it
    /// lags behind the step's end (and `a` is that of its middle).
    #[inline(always)]
    fn evaluate<const N: usize>(&mut self, at: At, h: f64, share: f64) {
        let pushed = self.push.evaluate::<N>(&self.x_m, at);
        let pulled = self.pull.as_mut().is_some_and(|pull| pull.evaluate::<N>(&self.x_m, at));
        if pushed || pulled {
            self.settle(at, h, share);
        }
    }

    /// Accelerations from the forces, then speeds by `kick_s`; where forces depend on speeds,
    /// `v` is `lag` seconds behind.
    #[inline(always)]
    fn accelerate_and_kick<const N: usize>(&mut self, at: At, lag_s: f64, kick_s: f64) {
        if self.net_n.is_some() {
            self.accelerate_by_all(at, lag_s);
            return self.kick::<N>(kick_s);
        }
        let n = self.places.known::<N>();
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
    fn accelerate_by_all(&mut self, at: At, lag_s: f64) {
        let n = self.places.rows();
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
            let touches = |bank: &Bank<'_>| bank.deflection_m(at, k) >= 0.0 && !bank.is_open(k);
            let pulls = self.pull.as_ref().is_some_and(|pull| pull.has_law(k) && touches(pull));
            if !(touches(&self.push) || pulls) {
                continue;
            }
            let closing = self.closing(k) + lag_s * self.between(&self.a_start, k);
            let spring = net[self.places.of(k)];
            let mut force = spring + damping.at(closing) * closing;
            if interface.tension.is_none() {
                // What only pushes does not pull when it opens fast.
                force = force.max(0.0);
            }
            net[self.places.of(k)] = force;
            self.rates.damper_w += (force - spring) * closing;
            self.watch.peak_n(k, force);
            self.watch.tension(k, -force, 0.0);
        }
        (self.rates.resistance_w, self.rates.resistance_n) = (0.0, 0.0);
        let mut behind = 0.0;
        for (i, body) in self.chain.bodies().iter().enumerate() {
            let place = self.places.of(i);
            let mut resistance = 0.0;
            if !body.resistance.is_none() {
                let v = self.v[place] + lag_s * self.a_start[place];
                resistance = body.resistance.force_n(body.mass_kg, v);
                self.rates.resistance_w += resistance * v;
                self.rates.resistance_n += resistance;
            }
            self.a[place] = (behind - net[place] - resistance) * self.per_kg[place];
            if let Some(by_contacts) = &mut self.by_contacts {
                by_contacts[place] = (behind - net[place]) * self.per_kg[place];
            }
            behind = net[place];
        }
        self.net_n = Some(net);
    }

    #[inline(always)]
    fn kick<const N: usize>(&mut self, dt: f64) {
        let n = self.places.known::<N>();
        let (v, a) = (self.v.values_mut(n), self.a.values(n));
        for c in 0..n {
            v[c] = each(|j| v[c][j] + dt * a[c][j]);
        }
    }

    #[inline(always)]
    fn drift<const N: usize>(&mut self, dt: f64) {
        let n = self.places.known::<N>();
        let (x, v) = (self.x_m.values_mut(n), self.v.values(n));
        for c in 0..n {
            x[c] = each(|j| x[c][j] + dt * v[c][j]);
        }
    }

    /// Impulse of the wall over `dt` at the present forces.
    #[inline(always)]
    fn on_wall(&mut self, at: At, dt: f64) {
        if self.chain.has_wall() {
            self.wall_impulse += dt * self.force_n(at, self.chain.bodies().len() - 1);
        }
    }

    /// One step of velocity Verlet; `v` is half a step ahead before and after.
    #[inline(always)]
    fn verlet<const N: usize>(&mut self, h: f64) {
        let (damper_w, resistance_w, resistance_n) =
            (self.rates.damper_w, self.rates.resistance_w, self.rates.resistance_n);
        self.next();
        self.drift::<N>(h);
        self.evaluate::<N>(At::End, h, 0.5);
        self.accelerate_and_kick::<N>(At::End, 0.5 * h, h);
        self.on_wall(At::End, h);
        if self.net_n.is_some() {
            let mean = 0.5 * h;
            self.rates.damped_j += mean * (damper_w + self.rates.damper_w);
            self.rates.resisted_j += mean * (resistance_w + self.rates.resistance_w);
            self.rates.impulse += mean * (resistance_n + self.rates.resistance_n);
        }
    }

    /// One step of fourth order (S. A. Chin, Phys. Lett. A 226, 344, 1997, algorithm A): forces
    /// at both ends and in the middle, there with their gradient; `v` is a sixth of a step
    /// ahead before and after.
    #[inline(always)]
    fn fourth_order<const N: usize>(&mut self, h: f64) {
        self.next();
        self.drift::<N>(0.5 * h);
        self.evaluate::<N>(At::Inside, h, 1.0 / 6.0);
        self.accelerate_and_kick::<N>(At::Inside, 0.0, 0.0);
        self.on_wall(At::Inside, 2.0 / 3.0 * h);
        self.add_gradient_kick_and_drift::<N>(h, 2.0 / 3.0 * h, 0.5 * h);
        self.evaluate::<N>(At::End, h, -1.0 / 6.0);
        self.accelerate_and_kick::<N>(At::End, 0.0, h / 3.0);
        self.on_wall(At::End, h / 3.0);
    }

    /// Adds `h²/24` times the change of the accelerations along themselves; then speeds by
    /// `kick_s` and positions by `drift_s` in the same pass.
    #[inline(always)]
    fn add_gradient_kick_and_drift<const N: usize>(&mut self, h: f64, kick_s: f64, drift_s: f64) {
        let n = self.places.known::<N>();
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
            let last = self.places.of(self.chain.bodies().len() - 1);
            let gradient = self.net_n.as_ref().unwrap_or(self.push.gradient_n());
            self.wall_impulse += kick_s * gradient[last];
        }
    }

    /// Tells the watch where forces on bodies have begun or changed their sign since the last
    /// look.
    #[inline(always)]
    fn look<const N: usize>(&mut self, ahead_s: f64) {
        let a = self.by_contacts.as_ref().unwrap_or(&self.a);
        if self.watch.is_news::<N>(a) {
            self.follow_bodies(ahead_s);
        }
        let a = self.by_contacts.as_ref().unwrap_or(&self.a);
        self.watch.looked::<N>(a, self.end_s);
    }

    #[cold]
    #[inline(never)]
    fn follow_bodies(&mut self, ahead_s: f64) {
        for i in 0..self.chain.bodies().len() {
            let place = self.places.of(i);
            let a = self.by_contacts.as_ref().unwrap_or(&self.a)[place];
            let v = self.v[place] - ahead_s * self.a[place];
            self.watch.follow(i, self.end_s, v, a);
        }
    }

    #[inline(always)]
    fn next(&mut self) {
        std::mem::swap(&mut self.a, &mut self.a_start);
        self.push.next();
        if let Some(pull) = &mut self.pull {
            pull.next();
        }
    }
}

/// All outputs of a run, with `steps_per_output` steps before each. Vectors as wide as the
/// machine has them; the bits are the same for any width.
#[multiversion(targets("x86_64+avx+avx2"))]
fn outputs<'a, const N: usize>(
    engine: &mut Engine<'a>,
    method: Method,
    recorder: &mut Recorder,
    run: &mut Run,
    steps_per_output: usize,
    (outputs, interval_s): (usize, f64),
) -> Result<(), SimulationError> {
    let h = engine.step_s;
    let ahead = ahead(method);
    let steps_per_look = (LOOK_S / h).max(1.0) as usize;
    let (mut done, mut until_look) = (0, steps_per_look);
    for output in 1..=outputs {
        engine.kick::<N>(ahead * h);
        engine.on_wall(At::End, ahead * h);
        for step in 1..=steps_per_output {
            done += 1;
            engine.end_s = done as f64 * h;
            match method {
                Method::FourthOrder => engine.fourth_order::<N>(h),
                Method::Verlet | Method::Reference => engine.verlet::<N>(h),
            }
            if !engine.missed.is_empty() {
                engine.finish(h, method)?;
            }
            until_look -= 1;
            if until_look == 0 || step == steps_per_output {
                engine.look::<N>(ahead * h);
                until_look = steps_per_look;
            }
        }
        engine.kick::<N>(-ahead * h);
        engine.on_wall(At::End, -ahead * h);
        engine.output::<N>(recorder, run, output as f64 * interval_s)?;
    }
    Ok(())
}

/// The part of a step by which speeds are ahead of positions between the steps.
fn ahead(method: Method) -> f64 {
    match method {
        Method::FourthOrder => 1.0 / 6.0,
        Method::Verlet | Method::Reference => 0.5,
    }
}

/// Time of free motion until the first gap or slack closes, and the times of each interface's;
/// 0 if none closes.
fn flights(chain: &Chain) -> (f64, Vec<(f64, f64)>) {
    let flight = |gap_m: f64, closing: f64| match closing > 0.0 {
        true => gap_m / closing,
        false => f64::INFINITY,
    };
    let speed = |i: usize| chain.bodies().get(i).map_or(0.0, |b| b.speed_m_per_s);
    let flights: Vec<(f64, f64)> = chain
        .interfaces()
        .iter()
        .enumerate()
        .map(|(k, interface)| {
            let closing = speed(k) - speed(k + 1);
            let slack = interface.tension.as_ref().map_or(f64::INFINITY, |t| t.slack_m);
            (flight(interface.gap_m, closing), flight(slack, -closing))
        })
        .collect();
    let shortest = flights.iter().map(|(a, b)| a.min(*b)).fold(f64::INFINITY, f64::min);
    (if shortest.is_finite() { shortest } else { 0.0 }, flights)
}

/// Positions of the bodies at the first contact, in m.
pub(super) fn first_contact(chain: &Chain) -> Vec<f64> {
    let (flight_s, _) = flights(chain);
    chain.bodies().iter().map(|b| b.speed_m_per_s * flight_s).collect()
}

/// Runs the chain with `steps_per_output` steps of `step_s` each.
pub(super) fn run(
    chain: &Chain,
    method: Method,
    record: Record,
    run: &mut Run,
    steps_per_output: usize,
    (outputs, interval_s): (usize, f64),
) -> Result<(), SimulationError> {
    let mut engine = Engine::new(chain, run.step_s);
    let mut recorder = Recorder::new(chain, &engine.places, record);
    engine.output::<0>(&mut recorder, run, 0.0)?;
    let times = (outputs, interval_s);
    let run_outputs = match engine.places.rows() {
        1 => self::outputs::<1>,
        2 => self::outputs::<2>,
        3 => self::outputs::<3>,
        4 => self::outputs::<4>,
        _ => self::outputs::<0>,
    };
    run_outputs(&mut engine, method, &mut recorder, run, steps_per_output, times)?;
    let used_interval_s = run.step_s * steps_per_output as f64;
    engine.close(recorder, run, outputs as f64 * interval_s, used_interval_s);
    Ok(())
}
