//! Integration by velocity Verlet with a fixed step.

use super::ledger::{Account, Ledger};
use super::train::Chain;

/// Default step: at 0.05 ms (a fifteenth of the output interval) the crush of a 24 t car
/// on a 40 MN/m spring is off in the sixth digit; at 0.01 ms all seven printed ones hold.
pub const DEFAULT_STEP_S: f64 = 1e-5;
/// Bounds that no real scenario reaches; they keep a mistyped duration from running for days.
const MAX_STEPS: f64 = 1e8;
const MAX_OUTPUTS: f64 = 1e6;

/// Times of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunSettings {
    pub duration_s: f64,
    pub output_interval_s: f64,
    /// Longest step; shortened to divide the output interval and to keep the step rule.
    pub step_s: f64,
}

/// Histories of one body, one value per output.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BodyHistory {
    pub x_m: Vec<f64>,
    pub v_m_per_s: Vec<f64>,
    pub a_m_per_s2: Vec<f64>,
    /// Mean of `−a` while the body's net contact force first differs from zero.
    pub mean_deceleration_m_per_s2: f64,
}

/// Histories of one interface, one value per output, and its extremes over all steps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InterfaceHistory {
    pub deflection_m: Vec<f64>,
    pub force_n: Vec<f64>,
    pub peak_force_n: f64,
    pub max_deflection_m: f64,
    /// Time of the largest deflection.
    pub max_deflection_time_s: f64,
    /// Speed of separation over speed of approach at the interface, once it has opened again.
    pub restitution: Option<f64>,
}

/// What a run gives.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    pub time_s: Vec<f64>,
    pub bodies: Vec<BodyHistory>,
    pub interfaces: Vec<InterfaceHistory>,
    pub ledger: Ledger,
    /// The step used.
    pub step_s: f64,
}

/// Why a run has no result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimulationError {
    #[error("{what} is {value_s} s: expected a time above 0")]
    Time { what: &'static str, value_s: f64 },
    #[error(
        "the run would take {steps:.0} steps of {step_s:e} s for {outputs:.0} outputs: shorten the duration or lengthen step and output interval"
    )]
    TooLong { steps: f64, step_s: f64, outputs: f64 },
    #[error(
        "interface {interface} is crushed {deflection_m:.4} m at {time_s:.6} s, beyond the end of its curve ({end_m:.4} m): give a longer curve, or end = \"hold\""
    )]
    CurveEnd { interface: String, deflection_m: f64, time_s: f64, end_m: f64 },
    #[error(
        "the motion is not finite any more at {time_s:.6} s, first at {body}: check masses, speeds and curves"
    )]
    Diverged { body: String, time_s: f64 },
}

/// Work space of a run: everything that changes from step to step.
struct State {
    x_m: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    deflection_m: Vec<f64>,
    largest_m: Vec<f64>,
    force_n: Vec<f64>,
}

/// Runs the chain from the first contact (t = 0) for `duration_s`.
///
/// x counts from where each body stands before gaps close; bodies move freely up to the
/// first contact.
///
/// # Errors
/// [`SimulationError`] names the interface or body.
pub fn simulate(chain: &Chain, settings: &RunSettings) -> Result<Run, SimulationError> {
    let (step_s, per_output, outputs) = steps(chain, settings)?;
    let interfaces = chain.interfaces();
    let has_wall = interfaces.len() == chain.bodies().len();
    let mut state = State {
        x_m: vec![0.0; chain.bodies().len()],
        v: chain.bodies().iter().map(|b| b.speed_m_per_s).collect(),
        a: vec![0.0; chain.bodies().len()],
        deflection_m: interfaces.iter().map(|i| -i.gap_m).collect(),
        largest_m: vec![0.0; interfaces.len()],
        force_n: vec![0.0; interfaces.len()],
    };
    state.move_to_first_contact(chain);
    // Bodies that touch and close are already on the envelope: a curve may begin above 0.
    for (k, interface) in interfaces.iter().enumerate() {
        if state.deflection_m[k] == 0.0 && state.closing(k) > 0.0 {
            state.force_n[k] = interface.law.envelope_n(0.0);
        }
    }
    state.accelerate(chain);
    let mut account = Account::open(chain);
    let mut watch = Watch::new(chain, &state);
    let mut run = Run {
        time_s: Vec::with_capacity(outputs + 1),
        bodies: vec![BodyHistory::default(); chain.bodies().len()],
        interfaces: vec![InterfaceHistory::default(); interfaces.len()],
        ledger: Ledger::default(),
        step_s,
    };
    let mut wall_impulse = 0.0;
    state.record(&mut run, 0.0);
    for output in 1..=outputs {
        for step in 1..=per_output {
            let time_s = ((output - 1) * per_output + step) as f64 * step_s;
            let wall_before = if has_wall { state.force_n[interfaces.len() - 1] } else { 0.0 };
            state.step(chain, step_s, time_s, &mut watch)?;
            let wall_after = if has_wall { state.force_n[interfaces.len() - 1] } else { 0.0 };
            wall_impulse += 0.5 * step_s * (wall_before + wall_after);
        }
        let time_s = output as f64 * settings.output_interval_s;
        if let Some(body) = state.v.iter().position(|v| !v.is_finite()) {
            let body = chain.bodies()[body].name.clone();
            return Err(SimulationError::Diverged { body, time_s });
        }
        state.record(&mut run, time_s);
        account.audit(chain, &state.v, &state.deflection_m, &state.largest_m, wall_impulse);
    }
    watch.close(chain, &mut run);
    run.ledger = account.close();
    Ok(run)
}

/// Step, steps per output and outputs.
fn steps(chain: &Chain, settings: &RunSettings) -> Result<(f64, usize, usize), SimulationError> {
    let RunSettings { duration_s, output_interval_s, step_s } = *settings;
    let times =
        [("duration", duration_s), ("output_interval", output_interval_s), ("step", step_s)];
    for (what, value_s) in times {
        if !(value_s > 0.0 && value_s.is_finite()) {
            return Err(SimulationError::Time { what, value_s });
        }
    }
    let longest = step_s.min(chain.longest_step_s());
    let per_output = (output_interval_s / longest * (1.0 - 1e-12)).ceil().max(1.0);
    let outputs = (duration_s / output_interval_s * (1.0 + 1e-12)).floor().max(1.0);
    let steps = per_output * outputs;
    let step_s = output_interval_s / per_output;
    if !(steps <= MAX_STEPS && outputs <= MAX_OUTPUTS) {
        return Err(SimulationError::TooLong { steps, step_s, outputs });
    }
    Ok((step_s, per_output as usize, outputs as usize))
}

impl State {
    /// Rate of deflection of interface `k`: of the body behind it against what is in front.
    fn closing(&self, k: usize) -> f64 {
        self.v[k] - self.v.get(k + 1).copied().unwrap_or(0.0)
    }

    /// Free motion until the first gap closes; none if no interface closes.
    fn move_to_first_contact(&mut self, chain: &Chain) {
        let time_to = |k: usize, gap_m: f64| match self.closing(k) {
            closing if closing > 0.0 => gap_m / closing,
            _ => f64::INFINITY,
        };
        let gaps = || chain.interfaces().iter().map(|i| i.gap_m).enumerate();
        let flight_s = gaps().map(|(k, gap)| time_to(k, gap)).fold(f64::INFINITY, f64::min);
        if !(flight_s > 0.0 && flight_s.is_finite()) {
            return;
        }
        let touching: Vec<bool> = gaps().map(|(k, gap)| time_to(k, gap) == flight_s).collect();
        for (x, v) in self.x_m.iter_mut().zip(&self.v) {
            *x = v * flight_s;
        }
        for (k, interface) in chain.interfaces().iter().enumerate() {
            let moved = self.closing(k) * flight_s - interface.gap_m;
            // Exactly 0 where contact begins, whatever the rounding.
            self.deflection_m[k] = if touching[k] { 0.0 } else { moved };
        }
    }

    /// One velocity Verlet step to `time_s`.
    fn step(
        &mut self,
        chain: &Chain,
        h: f64,
        time_s: f64,
        watch: &mut Watch,
    ) -> Result<(), SimulationError> {
        for ((x, v), a) in self.x_m.iter_mut().zip(&mut self.v).zip(&self.a) {
            *v += 0.5 * h * a;
            *x += h * *v;
        }
        for (k, interface) in chain.interfaces().iter().enumerate() {
            let ahead = self.x_m.get(k + 1).copied().unwrap_or(0.0);
            let deflection = self.x_m[k] - ahead - interface.gap_m;
            if interface.law.is_beyond_end(deflection) {
                return Err(SimulationError::CurveEnd {
                    interface: interface.name.clone(),
                    deflection_m: deflection,
                    time_s,
                    end_m: interface.law.end_m(),
                });
            }
            self.deflection_m[k] = deflection;
            self.largest_m[k] = self.largest_m[k].max(deflection);
            self.force_n[k] = interface.law.force_n(deflection, self.largest_m[k]);
        }
        self.accelerate(chain);
        for (v, a) in self.v.iter_mut().zip(&self.a) {
            *v += 0.5 * h * a;
        }
        watch.see(chain, self, h, time_s);
        Ok(())
    }

    /// Accelerations from the forces behind and in front of each body.
    fn accelerate(&mut self, chain: &Chain) {
        for (i, body) in chain.bodies().iter().enumerate() {
            let behind = if i == 0 { 0.0 } else { self.force_n[i - 1] };
            let ahead = self.force_n.get(i).copied().unwrap_or(0.0);
            self.a[i] = (behind - ahead) / body.mass_kg;
        }
    }

    fn record(&self, run: &mut Run, time_s: f64) {
        run.time_s.push(time_s);
        for (i, body) in run.bodies.iter_mut().enumerate() {
            body.x_m.push(self.x_m[i]);
            body.v_m_per_s.push(self.v[i]);
            body.a_m_per_s2.push(self.a[i]);
        }
        for (k, interface) in run.interfaces.iter_mut().enumerate() {
            interface.deflection_m.push(self.deflection_m[k]);
            interface.force_n.push(self.force_n[k]);
        }
    }
}

/// Follows extremes over all steps, not only the outputs.
struct Watch {
    interfaces: Vec<Extremes>,
    bodies: Vec<Phase>,
}

#[derive(Clone, Default)]
struct Extremes {
    peak_force_n: f64,
    max_deflection_m: f64,
    max_deflection_time_s: f64,
    closing: f64,
    deflection_m: f64,
    /// Rate of deflection when contact began, and when it ended for the first time.
    approach: Option<f64>,
    separation: Option<f64>,
}

/// The first time a body's net contact force differs from zero.
#[derive(Clone, Default)]
struct Phase {
    begun_s: Option<f64>,
    ended: bool,
    entry_speed: f64,
    duration_s: f64,
    lost_speed: f64,
}

impl Watch {
    fn new(chain: &Chain, state: &State) -> Self {
        let interface = |k: usize| Extremes {
            peak_force_n: state.force_n[k],
            closing: state.closing(k),
            deflection_m: state.deflection_m[k],
            approach: (state.deflection_m[k] == 0.0 && state.closing(k) > 0.0)
                .then(|| state.closing(k)),
            ..Extremes::default()
        };
        let body = |i: usize| Phase {
            begun_s: (state.a[i] != 0.0).then_some(0.0),
            entry_speed: state.v[i],
            ..Phase::default()
        };
        Self {
            interfaces: (0..chain.interfaces().len()).map(interface).collect(),
            bodies: (0..chain.bodies().len()).map(body).collect(),
        }
    }

    fn see(&mut self, chain: &Chain, state: &State, h: f64, time_s: f64) {
        for (k, seen) in self.interfaces.iter_mut().enumerate() {
            let (closing, deflection) = (state.closing(k), state.deflection_m[k]);
            seen.peak_force_n = seen.peak_force_n.max(state.force_n[k]);
            if deflection > seen.max_deflection_m {
                seen.max_deflection_m = deflection;
                seen.max_deflection_time_s = time_s;
            }
            if seen.closing > 0.0 && closing <= 0.0 {
                // The top lies within the step: where the rate, taken as linear, is zero.
                let share = seen.closing / (seen.closing - closing);
                let top = seen.deflection_m + 0.5 * seen.closing * share * h;
                if top > seen.max_deflection_m {
                    seen.max_deflection_m = top;
                    let law = &chain.interfaces()[k].law;
                    seen.peak_force_n = seen.peak_force_n.max(law.force_n(top, top));
                }
                if top >= seen.max_deflection_m {
                    seen.max_deflection_time_s = time_s - (1.0 - share) * h;
                }
            }
            if seen.approach.is_none() && deflection > 0.0 {
                seen.approach = Some(seen.closing);
            }
            let open = deflection > 0.0 && state.force_n[k] == 0.0 || deflection <= 0.0;
            if seen.approach.is_some() && seen.separation.is_none() && open && closing < 0.0 {
                seen.separation = Some(-closing);
            }
            (seen.closing, seen.deflection_m) = (closing, deflection);
        }
        for (i, phase) in self.bodies.iter_mut().enumerate() {
            let pushed = state.a[i] != 0.0;
            if phase.begun_s.is_none() && pushed {
                phase.begun_s = Some(time_s - h);
            } else if phase.begun_s.is_none() {
                phase.entry_speed = state.v[i];
            }
            if let Some(begun_s) = phase.begun_s
                && !phase.ended
            {
                phase.duration_s = time_s - begun_s;
                phase.lost_speed = phase.entry_speed - state.v[i];
                phase.ended = !pushed;
            }
        }
    }

    fn close(self, chain: &Chain, run: &mut Run) {
        debug_assert_eq!(self.bodies.len(), chain.bodies().len());
        for (history, seen) in run.interfaces.iter_mut().zip(self.interfaces) {
            history.peak_force_n = seen.peak_force_n;
            history.max_deflection_m = seen.max_deflection_m;
            history.max_deflection_time_s = seen.max_deflection_time_s;
            history.restitution = match (seen.approach, seen.separation) {
                (Some(approach), Some(separation)) if approach > 0.0 => Some(separation / approach),
                _ => None,
            };
        }
        for (history, phase) in run.bodies.iter_mut().zip(self.bodies) {
            if phase.duration_s > 0.0 {
                history.mean_deceleration_m_per_s2 = phase.lost_speed / phase.duration_s;
            }
        }
    }
}
