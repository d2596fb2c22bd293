//! Fixed steps over a chain: velocity Verlet, and a scheme of fourth order.
//!
//! Where an interface goes from one piece of its law to another within a step, the quadrature
//! misses some of the impulse and of its moment. Both follow from the law's tables (`events.rs`):
//! along the step's path the mean force is the work done over the change of deflection. Without
//! it every knot, contact and opening would leave an error of the order h².

mod events;
mod forces;
mod outputs;
mod start;
mod state;

use multiversion::multiversion;

use super::chain::Chain;
use super::contacts::StepPoint;
use super::recorder::LOOK_S;
use super::run::{Method, Record, Run, SimulationError};
use outputs::OutputRecorder;
use state::{Engine, ahead};

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
    let mut recorder = OutputRecorder::new(chain, &engine.layout, record);
    engine.output::<0>(&mut recorder, run, 0.0)?;
    let times = (outputs, interval_s);
    let run_outputs = match engine.layout.rows() {
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

/// All outputs of a run, with `steps_per_output` steps before each. Vectors as wide as the
/// machine has them; the bits are the same for any width.
#[multiversion(targets("x86_64+avx+avx2"))]
fn outputs<'a, const N: usize>(
    engine: &mut Engine<'a>,
    method: Method,
    recorder: &mut OutputRecorder,
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
        engine.on_wall(StepPoint::End, ahead * h);
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
        engine.on_wall(StepPoint::End, -ahead * h);
        engine.output::<N>(recorder, run, output as f64 * interval_s)?;
    }
    Ok(())
}

impl Engine<'_> {
    /// One step of velocity Verlet; `v` is half a step ahead before and after.
    #[inline(always)]
    fn verlet<const N: usize>(&mut self, h: f64) {
        let (damper_w, resistance_w, resistance_n) =
            (self.rates.damper_w, self.rates.resistance_w, self.rates.resistance_n);
        self.next();
        self.drift::<N>(h);
        self.evaluate::<N>(StepPoint::End, h, 0.5);
        self.accelerate_and_kick::<N>(StepPoint::End, 0.5 * h, h);
        self.on_wall(StepPoint::End, h);
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
        self.evaluate::<N>(StepPoint::Inside, h, 1.0 / 6.0);
        self.accelerate_and_kick::<N>(StepPoint::Inside, 0.0, 0.0);
        self.on_wall(StepPoint::Inside, 2.0 / 3.0 * h);
        self.add_gradient_kick_and_drift::<N>(h, 2.0 / 3.0 * h, 0.5 * h);
        self.evaluate::<N>(StepPoint::End, h, -1.0 / 6.0);
        self.accelerate_and_kick::<N>(StepPoint::End, 0.0, h / 3.0);
        self.on_wall(StepPoint::End, h / 3.0);
    }

    /// Tells the recorder where forces on bodies have begun or changed their sign since the last
    /// look.
    #[inline(always)]
    fn look<const N: usize>(&mut self, ahead_s: f64) {
        let a = self.by_contacts.as_ref().unwrap_or(&self.a);
        if self.events.is_news::<N>(a) {
            self.follow_bodies(ahead_s);
        }
        let a = self.by_contacts.as_ref().unwrap_or(&self.a);
        self.events.looked::<N>(a, self.end_s);
    }

    #[cold]
    #[inline(never)]
    fn follow_bodies(&mut self, ahead_s: f64) {
        for i in 0..self.chain.bodies().len() {
            let slot = self.layout.of(i);
            let a = self.by_contacts.as_ref().unwrap_or(&self.a)[slot];
            let v = self.v[slot] - ahead_s * self.a[slot];
            self.events.follow(i, self.end_s, v, a);
        }
    }
}
