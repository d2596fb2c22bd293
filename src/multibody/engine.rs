//! Fixed steps over a chain: velocity Verlet, and a scheme of fourth order.
//!
//! Both take the impulse of an interface exactly where it crosses a knot of its table: along
//! the step's path the mean force is the work done over the change of deflection, so
//! `h (ΔW/Δδ − quadrature)` is what the quadrature has missed. Without it every knot, contact
//! and opening would leave an error of the order h².

use multiversion::multiversion;

use super::bank::{At, Bank, LANES, Move, each};
use super::integrator::{Method, Record, Run, SimulationError};
use super::ledger::Account;
use super::train::Chain;
use super::watch::Watch;

/// Everything that changes from step to step. Arrays are padded with bodies that never move.
pub(super) struct Engine<'a> {
    chain: &'a Chain,
    x_m: Vec<f64>,
    /// Change of the interfaces' forces along the accelerations, as the forces are kept.
    gradient_n: Vec<f64>,
    /// Between the outputs half a step (Verlet) or a sixth (fourth order) ahead of `x`.
    v: Vec<f64>,
    a: Vec<f64>,
    per_kg: Vec<f64>,
    push: Bank<'a>,
    pull: Option<Bank<'a>>,
    /// Net forces if more than the pushing ones act, that of interface `k` at `k + 1`.
    net_n: Option<Vec<f64>>,
    missed: Vec<Missed>,
    step_s: f64,
    /// End of the present step.
    end_s: f64,
    rates: Rates,
    wall_impulse: f64,
    watch: Watch,
}

/// An interface that has left its piece within the step.
struct Missed {
    pulls: bool,
    k: usize,
    /// Work done up to the start of the step, in J.
    work_j: f64,
    what: Move,
    turned: bool,
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
        let bodies = chain.bodies();
        let interfaces = chain.interfaces();
        let width = bodies.len().next_multiple_of(LANES);
        let gaps: Vec<f64> = interfaces.iter().map(|i| i.gap_m).collect();
        let laws = interfaces.iter().map(|i| Some(&*i.law)).collect();
        let couples = interfaces.iter().any(|i| i.tension.is_some());
        let pull = couples.then(|| {
            let slacks: Vec<f64> =
                interfaces.iter().map(|i| i.tension.as_ref().map_or(0.0, |t| t.slack_m)).collect();
            let laws = interfaces.iter().map(|i| i.tension.as_ref().map(|t| &*t.law)).collect();
            Bank::new(laws, &slacks, -1.0, width)
        });
        let padded = |value: &dyn Fn(usize) -> f64| {
            (0..=width).map(|i| if i < bodies.len() { value(i) } else { 0.0 }).collect::<Vec<f64>>()
        };
        let mut engine = Self {
            chain,
            x_m: padded(&|_| 0.0),
            gradient_n: vec![0.0; width + 1],
            v: padded(&|i| bodies[i].speed_m_per_s),
            a: padded(&|_| 0.0),
            per_kg: padded(&|i| 1.0 / bodies[i].mass_kg),
            push: Bank::new(laws, &gaps, 1.0, width),
            net_n: (couples || chain.has_rates()).then(|| vec![0.0; width + 1]),
            pull,
            missed: Vec::new(),
            step_s,
            end_s: 0.0,
            rates: Rates::default(),
            wall_impulse: 0.0,
            watch: Watch::new(chain),
        };
        engine.move_to_first_contact();
        engine.accelerate::<0>(At::End, 0.0);
        for k in 0..interfaces.len() {
            if engine.push.is_loading(k) {
                engine.watch.contact(k, engine.closing(k));
                for i in [k, k + 1] {
                    if i < bodies.len() {
                        engine.watch.body(i, true, 0.0, engine.v[i]);
                    }
                }
            }
        }
        engine
    }

    /// Groups of [`LANES`] interfaces.
    fn groups(&self) -> usize {
        self.v.len() / LANES
    }

    /// Free motion until the first gap closes; none if no interface closes.
    fn move_to_first_contact(&mut self) {
        let (flight_s, flights) = flights(self.chain);
        for (x, v) in self.x_m.iter_mut().zip(&self.v) {
            *x = v * flight_s;
        }
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
        self.v[k] - self.v[k + 1]
    }

    /// Forces at the present positions; interfaces that have left their piece are settled.
    /// `share` is the part of a step by which `v` is ahead of the step's start (`a` is that of
    /// the start), below 0 if `v` lags behind the step's end and `a` is that of its middle.
    #[inline(always)]
    fn evaluate<const N: usize>(&mut self, at: At, h: f64, share: f64) {
        let pushed = self.push.evaluate::<N>(&self.x_m, at);
        let pulled = self.pull.as_mut().is_some_and(|pull| pull.evaluate::<N>(&self.x_m, at));
        if pushed || pulled {
            self.settle(at, h, share);
        }
    }

    #[cold]
    #[inline(never)]
    fn settle(&mut self, at: At, h: f64, share: f64) {
        for (pulls, bank) in [(false, Some(&mut self.push)), (true, self.pull.as_mut())] {
            let Some(bank) = bank else { continue };
            let sign = if pulls { -1.0 } else { 1.0 };
            for k in 0..self.chain.interfaces().len() {
                if !bank.has_law(k) || !bank.has_left(at, k) {
                    continue;
                }
                let (stored, dissipated) = bank.energies_j(At::Start, k);
                // Where the deflection turned: the vertex of the parabola through the nearest
                // state whose speed is known.
                let rate = sign * (self.a[k] - self.a[k + 1]);
                let closing = sign * (self.v[k] - self.v[k + 1]);
                let speed = closing - share * h * rate;
                let near = bank.deflection_m(if share >= 0.0 { At::Start } else { at }, k);
                let top_m = if rate < 0.0 { near + speed * speed / (-2.0 * rate) } else { near };
                let what = bank.settle(at, k, top_m);
                let turned = what == Move::Turned;
                if turned {
                    let into = if rate < 0.0 { speed / -rate } else { 0.0 };
                    let from = if share >= 0.0 { 0.0 } else { h };
                    let at_s = self.end_s + (from + into - h).clamp(-2.0 * h, 0.0);
                    self.watch.turned(pulls, k, bank.largest_m(at, k), at_s);
                }
                match self.missed.iter_mut().find(|m| m.pulls == pulls && m.k == k) {
                    Some(missed) => {
                        missed.turned |= turned;
                        if what != Move::Along {
                            missed.what = what;
                        }
                    }
                    None => self.missed.push(Missed {
                        pulls,
                        k,
                        work_j: stored + dissipated,
                        what,
                        turned,
                    }),
                }
            }
        }
    }

    /// Accelerations from the forces; where forces depend on speeds, `v` is `lag` seconds
    /// behind.
    #[inline(always)]
    fn accelerate<const N: usize>(&mut self, at: At, lag_s: f64) {
        self.accelerate_and_kick::<N>(at, lag_s, 0.0);
    }

    /// The same, then speeds by `kick_s` in one pass.
    #[inline(always)]
    fn accelerate_and_kick<const N: usize>(&mut self, at: At, lag_s: f64, kick_s: f64) {
        if self.net_n.is_some() {
            self.accelerate_by_all(at, lag_s);
            return self.kick::<N>(kick_s);
        }
        let forces = self.push.forces_n(at);
        let n = if N > 0 { N } else { self.v.len() / LANES };
        let (behind, ahead) =
            (&forces.as_chunks::<LANES>().0[..n], &forces[1..].as_chunks::<LANES>().0[..n]);
        let (a, v) = (
            &mut self.a.as_chunks_mut::<LANES>().0[..n],
            &mut self.v.as_chunks_mut::<LANES>().0[..n],
        );
        let per_kg = &self.per_kg.as_chunks::<LANES>().0[..n];
        for c in 0..n {
            a[c] = each(|j| (behind[c][j] - ahead[c][j]) * per_kg[c][j]);
            v[c] = each(|j| v[c][j] + kick_s * a[c][j]);
        }
    }

    /// The same with tension, dampers and resistance.
    #[inline(never)]
    fn accelerate_by_all(&mut self, at: At, lag_s: f64) {
        let Some(net_n) = &mut self.net_n else { return };
        net_n.copy_from_slice(self.push.forces_n(at));
        if let Some(pull) = &self.pull {
            for (net, pull) in net_n.iter_mut().zip(pull.forces_n(at)) {
                *net -= pull;
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
            let closing = self.v[k] - self.v[k + 1] + lag_s * (self.a[k] - self.a[k + 1]);
            let spring = net_n[k + 1];
            let mut force = spring + damping.at(closing) * closing;
            if interface.tension.is_none() {
                // What only pushes does not pull when it opens fast.
                force = force.max(0.0);
            }
            net_n[k + 1] = force;
            self.rates.damper_w += (force - spring) * closing;
            self.watch.peak_n(k, force);
        }
        (self.rates.resistance_w, self.rates.resistance_n) = (0.0, 0.0);
        for (i, body) in self.chain.bodies().iter().enumerate() {
            let mut resistance = 0.0;
            if !body.resistance.is_none() {
                let v = self.v[i] + lag_s * self.a[i];
                resistance = body.resistance.force_n(body.mass_kg, v);
                self.rates.resistance_w += resistance * v;
                self.rates.resistance_n += resistance;
            }
            self.a[i] = (net_n[i] - net_n[i + 1] - resistance) * self.per_kg[i];
        }
    }

    #[inline(always)]
    fn kick<const N: usize>(&mut self, dt: f64) {
        let n = if N > 0 { N } else { self.v.len() / LANES };
        let v = &mut self.v.as_chunks_mut::<LANES>().0[..n];
        let a = &self.a.as_chunks::<LANES>().0[..n];
        for c in 0..n {
            v[c] = each(|j| v[c][j] + dt * a[c][j]);
        }
    }

    #[inline(always)]
    fn drift<const N: usize>(&mut self, dt: f64) {
        let n = if N > 0 { N } else { self.v.len() / LANES };
        let x = &mut self.x_m.as_chunks_mut::<LANES>().0[..n];
        let v = &self.v.as_chunks::<LANES>().0[..n];
        for c in 0..n {
            x[c] = each(|j| x[c][j] + dt * v[c][j]);
        }
    }

    /// Impulse of the wall over `dt` at the present forces.
    #[inline(always)]
    fn on_wall(&mut self, at: At, dt: f64) {
        if self.chain.has_wall() {
            let n = self.chain.bodies().len();
            let forces = self.net_n.as_deref().unwrap_or(self.push.forces_n(at));
            self.wall_impulse += dt * forces[n];
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
        self.accelerate::<N>(At::Inside, 0.0);
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
        let factor = h * h / 24.0;
        self.push.gradient::<N>(&self.a, factor, &mut self.gradient_n);
        if let Some(pull) = &self.pull {
            for k in 0..self.chain.interfaces().len() {
                let slope = pull.slope_n_per_m(k);
                self.gradient_n[k + 1] += factor * slope * (self.a[k] - self.a[k + 1]);
            }
        }
        let n = if N > 0 { N } else { self.v.len() / LANES };
        let gradient = &self.gradient_n;
        let (behind, ahead) =
            (&gradient.as_chunks::<LANES>().0[..n], &gradient[1..].as_chunks::<LANES>().0[..n]);
        let (a, v) = (
            &mut self.a.as_chunks_mut::<LANES>().0[..n],
            &mut self.v.as_chunks_mut::<LANES>().0[..n],
        );
        let x = &mut self.x_m.as_chunks_mut::<LANES>().0[..n];
        let per_kg = &self.per_kg.as_chunks::<LANES>().0[..n];
        for c in 0..n {
            a[c] = each(|j| a[c][j] + (behind[c][j] - ahead[c][j]) * per_kg[c][j]);
            v[c] = each(|j| v[c][j] + kick_s * a[c][j]);
            x[c] = each(|j| x[c][j] + drift_s * v[c][j]);
        }
        if self.chain.has_wall() {
            self.wall_impulse += kick_s * gradient[self.chain.bodies().len()];
        }
    }

    #[inline(always)]
    fn next(&mut self) {
        self.push.next();
        if let Some(pull) = &mut self.pull {
            pull.next();
        }
    }

    /// What the quadrature of the step has missed, and what happened in it.
    #[cold]
    #[inline(never)]
    fn finish(&mut self, h: f64, method: Method) -> Result<(), SimulationError> {
        let interfaces = self.chain.interfaces();
        let missed = std::mem::take(&mut self.missed);
        for m in &missed {
            let bank = match &self.pull {
                Some(pull) if m.pulls => pull,
                _ => &self.push,
            };
            let k = m.k;
            let (start, end) = (bank.deflection_m(At::Start, k), bank.deflection_m(At::End, k));
            let law = match &interfaces[k].tension {
                Some(tension) if m.pulls => &tension.law,
                _ => &interfaces[k].law,
            };
            if law.is_beyond_end(end) {
                return Err(SimulationError::CurveEnd {
                    interface: interfaces[k].name.clone(),
                    what: if m.pulls { "pulled apart by" } else { "crushed" },
                    deflection_m: end,
                    time_s: self.end_s,
                    end_m: law.end_m(),
                });
            }
            let (stored, dissipated) = bank.energies_j(At::End, k);
            let ends = bank.force_n(At::Start, k) + bank.force_n(At::End, k);
            let quadrature = match method {
                Method::FourthOrder => h / 6.0 * (ends + 4.0 * bank.force_n(At::Inside, k)),
                Method::Verlet | Method::Reference => 0.5 * h * ends,
            };
            let moved = end - start;
            if moved != 0.0 && !m.turned {
                let impulse = h * (stored + dissipated - m.work_j) / moved - quadrature;
                let impulse = if m.pulls { -impulse } else { impulse };
                self.v[k] -= impulse * self.per_kg[k];
                self.v[k + 1] += impulse * self.per_kg[k + 1];
                if k + 1 == self.chain.bodies().len() {
                    self.wall_impulse += impulse;
                }
            }
        }
        for m in missed.iter().filter(|m| !m.pulls) {
            let k = m.k;
            let behind = ahead(method) * h;
            let closing = self.closing(k) - behind * (self.a[k] - self.a[k + 1]);
            let (start, end) =
                (self.push.deflection_m(At::Start, k), self.push.deflection_m(At::End, k));
            let crossing =
                |at_m: f64| self.end_s - h * ((end - at_m) / (end - start)).clamp(0.0, 1.0);
            let at_s = match m.what {
                Move::Loads if start <= 0.0 => {
                    // What the contact has not yet braked.
                    let before = closing - h * (self.a[k] - self.a[k + 1]) * end / (end - start);
                    self.watch.contact(k, before.max(closing));
                    crossing(0.0)
                }
                Move::Opened => {
                    self.watch.opened(k, -closing);
                    crossing(self.push.opens_at_m(k))
                }
                Move::Loads | Move::Along | Move::Turned => continue,
            };
            let forces = self.net_n.as_deref().unwrap_or(self.push.forces_n(At::End));
            for i in [k, k + 1] {
                if i < self.chain.bodies().len() {
                    let touched = forces[i] != 0.0 || forces[i + 1] != 0.0;
                    self.watch.body(i, touched, at_s, self.v[i] - behind * self.a[i]);
                }
            }
        }
        self.missed = missed;
        self.missed.clear();
        Ok(())
    }

    /// Interfaces at an output.
    fn output_interfaces(
        &mut self,
        run: &mut Run,
        account: &mut Account,
        histories: bool,
        time_s: f64,
    ) {
        account.begin();
        let forces = self.net_n.as_deref().unwrap_or(self.push.forces_n(At::End));
        for (k, history) in run.interfaces.iter_mut().enumerate() {
            let (mut stored, mut dissipated) = self.push.energies_j(At::End, k);
            if let Some(pull) = &self.pull {
                let pulls = pull.energies_j(At::End, k);
                (stored, dissipated) = (stored + pulls.0, dissipated + pulls.1);
            }
            account.interface(stored, dissipated);
            let deflection_m = self.push.deflection_m(At::End, k);
            // A branch ends at zero but for rounding.
            let force_n = if self.net_n.is_none() { forces[k + 1].max(0.0) } else { forces[k + 1] };
            self.watch.output_interface(k, deflection_m, force_n, time_s);
            if histories {
                history.deflection_m.push(deflection_m);
                history.force_n.push(force_n);
                history.largest_deflection_m.push(self.push.largest_m(At::End, k).max(0.0));
                history.stored_j.push(stored);
                history.dissipated_j.push(dissipated);
            }
        }
    }

    /// Records the state at the end of an output interval, with `v` in step with `x`.
    fn output(&mut self, run: &mut Run, account: &mut Account, record: Record, time_s: f64) {
        let histories = record == Record::Histories;
        self.output_interfaces(run, account, histories, time_s);
        for (i, history) in run.bodies.iter_mut().enumerate() {
            let (x, v, a) = (self.x_m[i], self.v[i], self.a[i]);
            account.body(self.chain.bodies()[i].mass_kg, v);
            self.watch.output_body(i, v, a, time_s);
            history.v_m_per_s.push(v);
            if histories {
                history.x_m.push(x);
                history.a_m_per_s2.push(a);
            }
        }
        if histories {
            run.time_s.push(time_s);
        }
        account.rates(self.rates.damped_j, self.rates.resisted_j);
        account.end(self.wall_impulse + self.rates.impulse);
    }
}

/// As many steps, the first one after `done` others. Vectors as wide as the machine has them;
/// the bits are the same for any width. `N` is the number of groups of interfaces, 0 if only the
/// arrays know it: with it the compiler unrolls the passes.
#[multiversion(targets("x86_64+avx+avx2"))]
fn steps<'a, const N: usize>(
    engine: &mut Engine<'a>,
    method: Method,
    done: usize,
    count: usize,
) -> Result<(), SimulationError> {
    let h = engine.step_s;
    for step in 1..=count {
        engine.end_s = (done + step) as f64 * h;
        match method {
            Method::FourthOrder => engine.fourth_order::<N>(h),
            Method::Verlet | Method::Reference => engine.verlet::<N>(h),
        }
        if !engine.missed.is_empty() {
            engine.finish(h, method)?;
        }
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
    let h = run.step_s;
    let ahead = ahead(method);
    let mut engine = Engine::new(chain, h);
    let mut account = Account::open(chain);
    engine.output(run, &mut account, record, 0.0);
    for output in 1..=outputs {
        let time_s = output as f64 * interval_s;
        engine.kick::<0>(ahead * h);
        engine.on_wall(At::End, ahead * h);
        let done = (output - 1) * steps_per_output;
        match engine.groups() {
            1 => steps::<1>(&mut engine, method, done, steps_per_output),
            2 => steps::<2>(&mut engine, method, done, steps_per_output),
            3 => steps::<3>(&mut engine, method, done, steps_per_output),
            4 => steps::<4>(&mut engine, method, done, steps_per_output),
            _ => steps::<0>(&mut engine, method, done, steps_per_output),
        }?;
        engine.kick::<0>(-ahead * h);
        engine.on_wall(At::End, -ahead * h);
        if let Some(body) = engine.v.iter().position(|v| !v.is_finite()) {
            let body = chain.bodies()[body].name.clone();
            return Err(SimulationError::Diverged { body, time_s });
        }
        engine.output(run, &mut account, record, time_s);
    }
    for k in 0..chain.interfaces().len() {
        engine.watch.peak_n(k, engine.push.peak_n(k));
        if let Some(pull) = &engine.pull {
            let force = pull.peak_n(k).max(pull.force_n(At::End, k));
            engine.watch.tension(k, force, pull.largest_m(At::End, k).max(0.0));
        }
    }
    engine.watch.close(run, record, h * steps_per_output as f64);
    run.ledger = account.close();
    Ok(())
}
