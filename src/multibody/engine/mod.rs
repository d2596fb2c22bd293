//! Fixed steps over a chain: velocity Verlet, and a fourth-order scheme.
//!
//! Where an interface goes from one piece of its law to another within a step, the quadrature
//! misses some of the impulse and of its moment. Both follow from the law's tables (`events.rs`):
//! along the step's path the mean force is the work done over the change of deflection. Without
//! it every knot, contact and opening would leave an error of the order h².
//!
//! Every interface is kept on one straight piece of its law (`bank`), so that a step is a few passes of multiply-adds
//! over arrays, as wide as the machine's vectors (`multiversion`; no fused operations, so the bits are the same for any
//! width). The chain is laid out in stretches, one per lane (`rows`): neighbours are in the same lane of the next row,
//! and no load waits for two stores. Only an interface that leaves its piece is examined (`events`): its piece is found
//! next to the old one, extremes and phases are noted, and the impulse of the step and its moment are corrected.
//!
//! The correction: along a step the mean force is the work over the change of deflection, and the tables know the work
//! and its integral exactly; what the change of speed adds follows by parts. So knots, contacts and openings leave an error
//! of nearly h⁴ instead of h²: orders of 3.4 to 3.6 are measured on random chains (`tests/engine.rs`). To add up single kinks,
//! each along the step's parabola, is a little more exact and was dropped: where a curve begins above 0 a branch may be
//! 10 nm short and as steep, and two such kinks cancel only if both are found at the right time. Where a step hardly moves,
//! the difference of two works is their rounding, and the correction is skipped. Where a deflection turns, its top is the
//! vertex of the parabola through the step's start; memory has no error of the step.
//!
//! Velocity Verlet is the default: it works with every law and is well known. The fourth-order scheme (Chin's 4A: two
//! forces and a gradient, which a piecewise linear law gives at no cost) takes steps up to 35 times as long with errors of about
//! 1e-6 m/s, for forces that do not depend on speeds.
//!
//! Known limit: vehicles that touch without closing, behind a curve that begins above 0, chatter, and every method needs
//! short steps for them.

mod events;
mod forces;
mod outputs;
mod state;

use multiversion::multiversion;

use super::chain::{Chain, Damping, Interface, RateFactor, Stopping, Tension};
use super::contacts::{Contacts, Direction, StepPoint};
use super::recorder::{EventRecorder, LOOK_S, Moment};
use super::rows::{LANES, Layout, Rows};
use super::run::{Grid, Record, Run};
use crate::error::Error;
use events::Speeds;
use outputs::OutputRecorder;
pub(super) use state::Scheme;
use state::{Engine, Fixed, Losses, Taken};

/// Runs the chain and fills in `run`.
pub(super) fn run(
    chain: &Chain,
    scheme: Scheme,
    record: Record,
    grid: &Grid,
    run: &mut Run,
) -> Result<(), Error> {
    let mut engine = Engine::new(chain, scheme, grid.step_s);
    let mut recorder = OutputRecorder::new(chain, &engine.fixed.layout, record);
    engine.output::<0>(&mut recorder, run, 0.0)?;
    let all_outputs = match engine.fixed.layout.rows() {
        1 => all_outputs::<1>,
        2 => all_outputs::<2>,
        3 => all_outputs::<3>,
        4 => all_outputs::<4>,
        _ => all_outputs::<0>,
    };
    all_outputs(&mut engine, &mut recorder, run, grid)?;
    engine.close(recorder, run, grid);
    Ok(())
}

/// All outputs of a run after the first. Vectors as wide as the machine has them; the bits are
/// the same for any width.
#[multiversion(targets("x86_64+avx+avx2"))]
fn all_outputs<'a, const N: usize>(
    engine: &mut Engine<'a>,
    recorder: &mut OutputRecorder,
    run: &mut Run,
    grid: &Grid,
) -> Result<(), Error> {
    let h = grid.step_s;
    let scheme = engine.fixed.scheme;
    let ahead_s = engine.fixed.ahead_s();
    let steps_per_look = (LOOK_S / h).max(1.0) as usize;
    let stops = !engine.taken.is_empty();
    // What bodies meet is not asked of a run for closing speeds.
    let looks = recorder.record != Record::Closing;
    let (mut done, mut until_look) = (0, steps_per_look);
    for output in 1..=grid.outputs {
        engine.kick::<N>(ahead_s);
        engine.on_wall(StepPoint::End, ahead_s);
        for step in 1..=grid.steps_per_output {
            done += 1;
            engine.end_s = done as f64 * h;
            match scheme {
                Scheme::FourthOrder => engine.fourth_order::<N>(h),
                Scheme::Verlet => engine.verlet::<N>(h),
            }
            let crossed = !engine.crossings.is_empty();
            if crossed {
                engine.finish()?;
            }
            if stops {
                engine.stop_mass(crossed);
            }
            until_look = until_look.saturating_sub(1);
            if looks && (until_look == 0 || step == grid.steps_per_output) {
                engine.look::<N>(ahead_s);
                until_look = steps_per_look;
            }
        }
        engine.kick::<N>(-ahead_s);
        engine.on_wall(StepPoint::End, -ahead_s);
        engine.output::<N>(recorder, run, grid.output_s(output))?;
    }
    Ok(())
}

impl Engine<'_> {
    /// One step of velocity Verlet; `v` is half a step ahead before and after.
    #[inline(always)]
    fn verlet<const N: usize>(&mut self, h: f64) {
        let before = self.losses.power;
        self.next();
        self.drift::<N>(h);
        self.evaluate::<N>(StepPoint::End, Speeds::AfterStart(0.5));
        self.accelerate_and_kick::<N>(StepPoint::End, 0.5 * h, h);
        self.on_wall(StepPoint::End, h);
        if self.net_n.is_some() {
            let mean = 0.5 * h;
            let now = self.losses.power;
            self.losses.damped_j += mean * (before.damper_w + now.damper_w);
            self.losses.add_of_interfaces(self.fixed.layout.known::<N>(), mean);
            self.losses.resisted_j += mean * (before.resistance_w + now.resistance_w);
            self.losses.impulse += mean * (before.resistance_n + now.resistance_n);
        }
    }

    /// One step of fourth order (S. A. Chin, Phys. Lett. A 226, 344, 1997, algorithm A): forces
    /// at both ends and in the middle, there with their gradient; `v` is a sixth of a step
    /// ahead before and after.
    #[inline(always)]
    fn fourth_order<const N: usize>(&mut self, h: f64) {
        self.next();
        self.drift::<N>(0.5 * h);
        self.evaluate::<N>(StepPoint::Inside, Speeds::AfterStart(1.0 / 6.0));
        self.accelerate_and_kick::<N>(StepPoint::Inside, 0.0, 0.0);
        self.on_wall(StepPoint::Inside, 2.0 / 3.0 * h);
        self.add_gradient_kick_and_drift::<N>(h, 2.0 / 3.0 * h, 0.5 * h);
        self.evaluate::<N>(StepPoint::End, Speeds::BeforeEnd(1.0 / 6.0));
        self.accelerate_and_kick::<N>(StepPoint::End, 0.0, h / 3.0);
        self.on_wall(StepPoint::End, h / 3.0);
    }

    /// Notifies the recorder where forces on bodies have begun or changed their sign since the last
    /// look; `v` is `ahead_s` ahead.
    #[inline(always)]
    fn look<const N: usize>(&mut self, ahead_s: f64) {
        let a = self.by_contacts.as_ref().unwrap_or(&self.a);
        if self.events.is_news::<N>(a) {
            self.look_at_bodies(ahead_s);
        }
        let a = self.by_contacts.as_ref().unwrap_or(&self.a);
        self.events.looked::<N>(a, self.end_s);
    }

    #[cold]
    #[inline(never)]
    fn look_at_bodies(&mut self, ahead_s: f64) {
        for i in 0..self.fixed.chain.bodies().len() {
            let slot = self.fixed.layout.of(i);
            let a = self.by_contacts.as_ref().unwrap_or(&self.a)[slot];
            let v_m_per_s = self.v[slot] - ahead_s * self.a[slot];
            self.events.look(i, Moment { time_s: self.end_s, v_m_per_s }, a);
        }
    }
}

impl<'a> Engine<'a> {
    /// The chain at its first contact.
    pub(crate) fn new(chain: &'a Chain, scheme: Scheme, step_s: f64) -> Self {
        let (bodies, interfaces) = (chain.bodies(), chain.interfaces());
        let layout = Layout::new(bodies.len());
        let laws: Vec<_> = interfaces.iter().map(|i| (Some(&*i.law), i.gap_m)).collect();
        let couples = interfaces.iter().any(|i| i.tension.is_some());
        let pull = couples.then(|| {
            let law = |t: &'a Tension| (Some(&*t.law), t.slack_m);
            let laws: Vec<_> =
                interfaces.iter().map(|i| i.tension.as_ref().map_or((None, 0.0), law)).collect();
            Contacts::new(&layout, &laws, Direction::Tension)
        });
        let of = |value: &dyn Fn(usize) -> f64| Rows::of(&layout, bodies.len(), value);
        let has_net = couples || chain.has_rates();
        let zone = |(k, interface): (usize, &'a Interface)| {
            let Stopping { body, zone, stopped_kg } = interface.stopping.as_ref()?;
            let least_kg = bodies[*zone].mass_kg;
            let [slot, body, zone] = [k, *body, *zone].map(|i| layout.of(i).flat());
            Some(Taken {
                interface: k,
                slot,
                body,
                zone,
                least_kg,
                stopped_kg,
                largest_m: f64::NAN,
                segment: 0,
            })
        };
        let taken = interfaces.iter().enumerate().filter_map(zone).collect();
        let nothing = [layout.of(bodies.len()).flat(); 2];
        let mut rated: Vec<(usize, [[usize; 2]; LANES])> = Vec::new();
        for (k, interface) in interfaces.iter().enumerate() {
            let Some(rate) = &interface.rate else { continue };
            // The wall is after the last body and never moves.
            let ahead = rate.ahead.unwrap_or(bodies.len());
            let slot = layout.of(k);
            let sides = [rate.behind, ahead].map(|i| layout.of(i).flat());
            let at = rated.iter().position(|(row, _)| *row == slot.row()).unwrap_or_else(|| {
                rated.push((slot.row(), [nothing; LANES]));
                rated.len() - 1
            });
            rated[at].1[slot.lane()] = sides;
        }
        let of_rate = |value: fn(&RateFactor) -> f64| {
            Rows::of(&layout, interfaces.len(), |k| interfaces[k].rate.as_ref().map_or(0.0, value))
        };
        let sensitivity = of_rate(|rate| rate.sensitivity_sqrt_s_per_m);
        let share = of_rate(|rate| rate.share);
        let plain = |k: usize| {
            let damper = interfaces[k].damping.as_ref().filter(|_| interfaces[k].tension.is_none());
            damper.and_then(Damping::constant_n_s_per_m).filter(|&c| c > 0.0)
        };
        let plain_n_s_per_m = Rows::of(&layout, interfaces.len(), |k| plain(k).unwrap_or(0.0));
        let of_plain = (0..interfaces.len()).filter(|&k| plain(k).is_some());
        let mut plain_rows: Vec<usize> = of_plain.map(|k| layout.of(k).row()).collect();
        plain_rows.sort_unstable();
        plain_rows.dedup();
        let has_other = |k: &usize| interfaces[*k].damping.is_some() && plain(*k).is_none();
        let other_dampers = (0..interfaces.len()).filter(has_other).collect();
        let mut engine = Self {
            mass_kg: of(&|i| bodies[i].mass_kg),
            per_kg: of(&|i| 1.0 / bodies[i].mass_kg),
            speeds: of(&|_| 0.0),
            closing_m_per_s: of(&|_| 0.0),
            rate_factors: of(&|_| 1.0),
            peaks_n: of(&|_| 0.0),
            taken,
            x_m: of(&|_| 0.0),
            v: of(&|i| bodies[i].speed_m_per_s),
            a: of(&|_| 0.0),
            a_start: of(&|_| 0.0),
            by_contacts: chain.has_resistance().then(|| of(&|_| 0.0)),
            push: Contacts::new(&layout, &laws, Direction::Compression),
            net_n: has_net.then(|| of(&|_| 0.0)),
            pull,
            crossings: Vec::new(),
            left: Vec::new(),
            end_s: 0.0,
            losses: Losses::new(&layout),
            wall_impulse: 0.0,
            events: EventRecorder::new(chain, &layout),
            fixed: Fixed {
                chain,
                scheme,
                step_s,
                layout,
                rated,
                sensitivity,
                share,
                other_dampers,
                plain_n_s_per_m,
                plain_rows,
            },
        };
        engine.move_to_first_contact();
        engine.accelerate_and_kick::<0>(StepPoint::End, 0.0, 0.0);
        engine.losses.add_of_interfaces(engine.fixed.layout.rows(), 0.0);
        engine.record_first_contacts();
        engine
    }

    /// Free motion until the first gap closes; none if no interface closes.
    fn move_to_first_contact(&mut self) {
        let (flight_s, flights) = self.fixed.chain.flights();
        self.drift::<0>(flight_s);
        for (k, interface) in self.fixed.chain.interfaces().iter().enumerate() {
            let closing = self.closing(k);
            // Exactly 0 where contact begins, whatever the rounding.
            let at = |begins_s: f64, closing: f64, gap_m: f64| {
                if begins_s == flight_s { 0.0 } else { closing * flight_s - gap_m }
            };
            let deflection = at(flights[k].0, closing, interface.gap_m);
            self.push.set_start(k, deflection, closing > 0.0);
            if let (Some(pull), Some(tension)) = (&mut self.pull, &interface.tension) {
                pull.set_start(k, at(flights[k].1, -closing, tension.slack_m), closing < 0.0);
            }
        }
    }

    fn record_first_contacts(&mut self) {
        for k in 0..self.fixed.chain.interfaces().len() {
            if !self.push.is_loading(k) {
                continue;
            }
            let closing = self.closing(k);
            self.events.interfaces[k].contact_began(0.0, closing);
            if self.push.presses(k) {
                for i in self.sides(k) {
                    self.events.touched(i, 0.0);
                }
            }
        }
    }
}
