//! Settings and results of a run: method, times, histories, the ledger of energy and momentum, warnings, errors.

use serde::{Deserialize, Serialize};

use super::chain::{Body, Chain, Interface};
use super::law::ForceLaw;
use crate::curve::is_beyond;
use crate::error::{Error, KeyPath, error};

/// Default step of velocity Verlet: at 0.05 ms (a fifteenth of the output interval) the crush
/// of a 24 t car on a 40 MN/m spring is off in the sixth digit; at 0.01 ms all seven printed
/// ones hold.
const DEFAULT_STEP_S: f64 = 1e-5;
/// Default step of the fourth-order scheme.
const FOURTH_ORDER_STEP_S: f64 = 3.5e-4;

/// How the motion is integrated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Velocity Verlet, of order 2.
    #[default]
    Verlet,
    /// Two forces and a gradient per step: order 4, about five times faster; not for dampers and
    /// resistance, nor for rates.
    FourthOrder,
    /// Extrapolation with adaptive order and step: slow, for checks. Its extremes are those of its
    /// steps and its contacts those of the outputs; it gives no restitution, and no energy of single interfaces in its summary.
    Reference,
}

impl Method {
    /// Its default step in s; the first to be tried if the method chooses by itself.
    pub fn default_step_s(self) -> f64 {
        match self {
            Self::Verlet => DEFAULT_STEP_S,
            Self::FourthOrder => FOURTH_ORDER_STEP_S,
            Self::Reference => 0.75e-3,
        }
    }

    /// Longest step over the shortest `sqrt(m/k)`.
    ///
    /// Verlet's energy swings by about `(ω h)²/8` with `ω² ≤ 4 k_max/m_min`, so 0.03 keeps
    /// the ledger within its 1e-3; the usual 0.1 would not. The fourth order keeps it at 0.1.
    pub(super) fn step_rule(self) -> f64 {
        match self {
            Self::Verlet => 0.03,
            Self::FourthOrder => 0.1,
            Self::Reference => f64::INFINITY,
        }
    }
}

/// What is kept of a run besides its summary.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Record {
    /// Histories of all bodies and interfaces.
    #[default]
    Histories,
    /// Nothing: histories stay empty.
    Summary,
    /// Speeds of bodies, deflections and forces of interfaces alone: a run of which nobody asks what its bodies meet.
    Closing,
}

/// Times of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunSettings {
    /// From the first contact, in s.
    pub duration_s: f64,
    /// Time between outputs in s.
    pub output_interval_s: f64,
    /// Longest step in s; shortened to divide the output interval and to keep the step rule.
    pub step_s: f64,
    /// How the motion is integrated.
    pub method: Method,
    /// What is kept besides the summary.
    pub record: Record,
}

impl RunSettings {
    /// Histories by velocity Verlet with its default step.
    pub fn new(duration_s: f64, output_interval_s: f64) -> Self {
        Self {
            duration_s,
            output_interval_s,
            step_s: DEFAULT_STEP_S,
            method: Method::Verlet,
            record: Record::Histories,
        }
    }

    /// The same by a method, with its default step.
    pub fn with_method(self, method: Method) -> Self {
        Self { method, step_s: method.default_step_s(), ..self }
    }

    /// The same with another longest step.
    pub fn with_step(self, step_s: f64) -> Self {
        Self { step_s, ..self }
    }
}

/// Histories of one body, one value per output.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BodyHistory {
    /// Position in m.
    pub x_m: Vec<f64>,
    /// Speed in m/s.
    pub v_m_per_s: Vec<f64>,
    /// Acceleration in m/s².
    pub a_m_per_s2: Vec<f64>,
    /// Speed at the end of the run, in m/s.
    pub final_v_m_per_s: f64,
    /// Acceleration by contacts at the end of the run, in m/s².
    pub(crate) final_a_m_per_s2: f64,
    /// Mean of `−a` while the body's net contact force acts for the first time, until it ends or
    /// changes its sign. Up to 1 kN, of a body below 1 t 1 m/s², longer than a look of 0.25 ms, it does not act. Where vehicles rattle, beside
    /// a push of less than 1 ms, it may be gone or have the other sign for as long. Contacts that change the speed by less
    /// than 0.5 % of the range of the body's speeds (5 % in less than 1 ms) do not count.
    pub mean_deceleration_m_per_s2: f64,
    /// That net contact force still acts when the run ends: the mean is of a part.
    pub is_loaded_at_end: bool,
    /// From when until when, in s; `None` without contact.
    pub loaded_s: Option<(f64, f64)>,
    /// Of a later contact that changes the speed more than any other: the mean of `−a` in m/s², from when until when in s,
    /// and whether the run ends while it acts. `None` if the first contact does.
    pub main_contact: Option<(f64, (f64, f64), bool)>,
    /// Changes of speed in m/s, in magnitude: by the contact that acts when the run ends, and by the one that changes it most.
    pub(crate) running_and_largest_change: (Option<f64>, f64),
    /// Mean of `−a` over the 120 ms in which its magnitude is largest, with windows that end at
    /// the outputs; `None` in a shorter run and for outputs more than 5 ms apart.
    pub moving_mean_deceleration_m_per_s2: Option<f64>,
    /// Speed in m/s at which an unrestrained occupant, who goes on at the body's first speed, meets the interior after
    /// a free flight of 0.6 m relative to the body; above 0 if the occupant goes on in the direction of positive speeds,
    /// below 0 if against it. `None` if the run ends
    /// before, and for outputs more than 5 ms apart.
    pub secondary_impact_m_per_s: Option<f64>,
    /// Occupant load criterion in m/s²: the constant deceleration that stops an occupant relative to the body within
    /// 235 mm after a free flight of 65 mm, with the same sign. `None` as above.
    pub occupant_load_m_per_s2: Option<f64>,
}

/// Histories of one interface, one value per output, and its extremes over all steps.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct InterfaceHistory {
    /// Deflection in m, below 0 while a gap is open.
    #[serde(skip)]
    pub deflection_m: Vec<f64>,
    /// Net force in N, below 0 where a coupling pulls.
    #[serde(skip)]
    pub force_n: Vec<f64>,
    /// Maximum deflection so far, in m.
    #[serde(skip)]
    pub largest_deflection_m: Vec<f64>,
    /// Energy that is returned, in J.
    #[serde(skip)]
    pub stored_j: Vec<f64>,
    /// Energy that is lost, in J.
    #[serde(skip)]
    pub dissipated_j: Vec<f64>,
    /// What `damped_j` is so far; empty by the reference method.
    #[serde(skip)]
    pub damped_so_far_j: Vec<f64>,
    /// Energy that is stored at the end, in J.
    #[serde(rename = "stored_at_end_J")]
    pub stored_at_end_j: f64,
    /// Energy that the curve has dissipated by the end, in J.
    #[serde(rename = "dissipated_at_end_J")]
    pub dissipated_at_end_j: f64,
    /// Energy taken by dampers, by the share of the force that follows speeds, and where mass is stopped, in J;
    /// `None` by the reference method, which knows the sum only.
    #[serde(rename = "damped_J")]
    pub damped_j: Option<f64>,
    /// Largest pushing force in N.
    #[serde(rename = "peak_force_N")]
    pub peak_force_n: f64,
    /// Largest pulling force in N; 0 without a coupling.
    #[serde(rename = "peak_tension_N")]
    pub peak_tension_n: f64,
    /// Largest extension of the coupling in m; 0 without one.
    pub max_extension_m: f64,
    /// Maximum deflection in m.
    pub max_deflection_m: f64,
    /// Deflection up to which the curve has data, in m: beyond it the force is an assumption.
    pub data_end_m: f64,
    /// The same of the tension curve's extension; infinite without one.
    #[serde(skip)]
    pub(crate) tension_end_m: f64,
    /// Time of the maximum deflection in s.
    pub max_deflection_time_s: f64,
    /// When both sides first had the same velocity, in s.
    pub common_velocity_time_s: Option<f64>,
    /// When contact began, in s. `None` without contact, and by the reference method.
    #[serde(skip)]
    pub contact_time_s: Option<f64>,
    /// Separation speed over speed of approach at the interface, when it first opens again.
    /// `None` below 0.1 m/s of approach, above 1 (where contacts repeat or neighbours push), where it is crushed further
    /// later, and at the plate of an end.
    pub restitution: Option<f64>,
}

impl InterfaceHistory {
    /// Whether it was crushed, or pulled, beyond the data of its curve, by more than another unloading or step explains.
    pub(crate) fn is_beyond_data(&self) -> bool {
        is_beyond(self.max_deflection_m, self.data_end_m)
            || is_beyond(self.max_extension_m, self.tension_end_m)
    }

    pub(crate) fn has_touched(&self) -> bool {
        self.max_deflection_m > 0.0 || self.peak_force_n > 0.0
    }

    /// All energy that it has taken by the end, in J, what it stores among it; `None` if a part is not known.
    pub fn energy_at_end_j(&self) -> Option<f64> {
        Some(self.stored_at_end_j + self.dissipated_at_end_j + self.damped_j?)
    }
}

/// What a run gives.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Times of the outputs in s.
    pub time_s: Vec<f64>,
    /// In the order of the chain.
    pub bodies: Vec<BodyHistory>,
    /// In the order of the chain.
    pub interfaces: Vec<InterfaceHistory>,
    /// Where the energy is at the end.
    pub ledger: Ledger,
    /// The step used, in s.
    pub step_s: f64,
    /// What a user must know; see [`Self::all_warnings`] for those of the ledger too.
    pub warnings: Vec<String>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    pub step_s: f64,
    pub steps_per_output: usize,
    /// Beside the one at the start.
    pub outputs: usize,
    interval_s: f64,
}

/// Bounds that no real scenario reaches; they keep a mistyped duration from running for days.
const MAX_STEPS: f64 = 1e8;
const MAX_OUTPUTS: f64 = 1e6;
/// Most values that histories keep: 4 GB.
const MAX_VALUES: f64 = 5e8;

/// Steps of runs for closing speeds by Verlet, in those of others.
const CLOSING_STEPS: f64 = 3.0;

impl Grid {
    /// The longest step that divides the output interval and keeps to the step rule.
    pub(crate) fn new(chain: &Chain, settings: &RunSettings) -> Result<Self, Error> {
        let RunSettings { duration_s, output_interval_s, step_s, method, record } = *settings;
        let times =
            [("duration", duration_s), ("output_interval", output_interval_s), ("step", step_s)];
        for (what, value_s) in times {
            if !(value_s > 0.0 && value_s.is_finite()) {
                let key = format!("run.{what}");
                return Err(
                    error!(Simulation at &key, "{what} is {value_s} s: expected a time above 0"),
                );
            }
        }
        if output_interval_s > duration_s * (1.0 + 1e-12) {
            return Err(error!(
                Simulation at "run.output_interval",
                "output_interval is {output_interval_s} s, longer than the duration of {duration_s} s"
            ));
        }
        let (shortest_s, k) = chain.shortest_time_s();
        let longest = step_s.min(method.step_rule() * shortest_s);
        // Verlet is stable up to 10 times as long steps, and closing speeds need no energies to 1e-4.
        let is_coarse = record == Record::Closing && method == Method::Verlet;
        let longest = if is_coarse { CLOSING_STEPS * longest } else { longest };
        let per_output = (output_interval_s / longest * (1.0 - 1e-12)).ceil().max(1.0);
        let outputs = (duration_s / output_interval_s * (1.0 + 1e-12)).floor().max(1.0);
        let steps = per_output * outputs;
        let step_s = output_interval_s / per_output;
        if !(steps <= MAX_STEPS && outputs <= MAX_OUTPUTS) {
            let interface = chain.interfaces().get(k).map_or("none", |i| i.name.as_str());
            let is_asked = settings.step_s <= method.step_rule() * shortest_s
                && settings.step_s < method.default_step_s();
            let is_usual = longest >= method.default_step_s();
            let (key, remedy) = match (outputs <= MAX_OUTPUTS, is_asked) {
                (true, true) => ("run.step", "lengthen the step".into()),
                (true, false) if is_usual => {
                    ("run.duration", "shorten the duration, or set a longer step".into())
                }
                (true, false) => (
                    "run.duration",
                    format!(
                        "such short steps are needed by interface {interface}: check its stiffness and the masses beside it, or shorten the duration"
                    ),
                ),
                _ => {
                    ("run.duration", "shorten the duration or lengthen the output interval".into())
                }
            };
            return Err(error!(
                Simulation at key,
                "the run would take {steps:.3e} steps of {step_s:.3e} s for {outputs:.3e} outputs: {remedy}"
            ));
        }
        let (bodies, interfaces) = (chain.bodies().len(), chain.interfaces().len());
        let values = outputs * (3 * bodies + 5 * interfaces) as f64;
        if settings.record != Record::Summary && values > MAX_VALUES {
            return Err(error!(
                Simulation at "run.output_interval",
                "the run would keep {values:.1e} values of {bodies} bodies at {outputs} outputs, more than {MAX_VALUES:.0e}: lengthen output_interval or shorten the train"
            ));
        }
        Ok(Self {
            step_s,
            steps_per_output: per_output as usize,
            outputs: outputs as usize,
            interval_s: output_interval_s,
        })
    }

    /// Time of an output.
    pub(crate) fn output_s(&self, output: usize) -> f64 {
        output as f64 * self.interval_s
    }

    /// Time of the steps between two outputs: the interval, with the rounding of the steps.
    pub(crate) fn steps_s(&self) -> f64 {
        self.step_s * self.steps_per_output as f64
    }
}

impl Run {
    /// A run to be filled in.
    pub(super) fn new(chain: &Chain, grid: &Grid, record: Record) -> Self {
        let mut run = Self {
            time_s: Vec::new(),
            bodies: vec![BodyHistory::default(); chain.bodies().len()],
            interfaces: vec![InterfaceHistory::default(); chain.interfaces().len()],
            ledger: Ledger::default(),
            step_s: grid.step_s,
            warnings: Vec::new(),
        };
        run.reserve(grid.outputs + 1, record);
        run
    }

    /// Masses of the chain's bodies in kg at output `t` of its histories: crush zones have taken what they have stopped.
    pub(crate) fn masses_kg(&self, chain: &Chain, t: usize) -> Vec<f64> {
        let mut masses_kg: Vec<f64> = chain.bodies().iter().map(|body| body.mass_kg).collect();
        for (interface, history) in chain.interfaces().iter().zip(&self.interfaces) {
            if let Some(stopping) = &interface.stopping {
                let before_kg = masses_kg[stopping.zone];
                let now_kg = stopping.zone_kg(history.largest_deflection_m[t], before_kg);
                masses_kg[stopping.zone] = now_kg;
                masses_kg[stopping.body] -= now_kg - before_kg;
            }
        }
        masses_kg
    }

    /// Interfaces, counted from back to front, that were crushed or pulled beyond the data of their curves.
    pub fn beyond_data(&self) -> impl Iterator<Item = usize> {
        self.interfaces.iter().enumerate().filter(|(_, i)| i.is_beyond_data()).map(|(k, _)| k)
    }

    /// All that a user must know, as text.
    pub fn all_warnings(&self) -> Vec<String> {
        let mut warnings = self.ledger.warnings();
        warnings.extend(self.warnings.iter().cloned());
        warnings
    }

    fn reserve(&mut self, outputs: usize, record: Record) {
        for b in &mut self.bodies {
            // The moving mean needs the speeds in any case.
            b.v_m_per_s.reserve_exact(outputs);
        }
        if record == Record::Closing {
            for i in &mut self.interfaces {
                i.deflection_m.reserve_exact(outputs);
                i.force_n.reserve_exact(outputs);
            }
        }
        if record != Record::Histories {
            return;
        }
        self.time_s.reserve_exact(outputs);
        for b in &mut self.bodies {
            for values in [&mut b.x_m, &mut b.a_m_per_s2] {
                values.reserve_exact(outputs);
            }
        }
        for i in &mut self.interfaces {
            for values in [
                &mut i.deflection_m,
                &mut i.force_n,
                &mut i.largest_deflection_m,
                &mut i.stored_j,
                &mut i.dissipated_j,
                &mut i.damped_so_far_j,
            ] {
                values.reserve_exact(outputs);
            }
        }
    }
}

/// The error of a curve that must not be left and has ended, in compression or as the law of tension.
pub(super) fn curve_ended(
    (k, interface): (usize, &Interface),
    law: &ForceLaw,
    is_tension: bool,
    deflection_m: f64,
    time_s: f64,
) -> Error {
    let (name, end_m) = (&interface.name, law.end_m());
    let (what, curve, of) = match is_tension {
        true => ("pulled apart by", "tension curve", " in that"),
        false => ("crushed", "curve", ""),
    };
    let key = KeyPath::of("interfaces").item(k);
    error!(
        Simulation,
        "interface {name} is {what} {deflection_m:.4} m at {time_s:.6} s, beyond the end of its {curve}'s data ({end_m:.4} m): give a longer {curve} (a model: train it with faster runs), or end = \"hold\"{of}"
    )
    .at(if is_tension { key.key("tension") } else { key })
}

/// The error of a position or speed that is not finite any more.
pub(super) fn diverged(body: &Body, time_s: f64) -> Error {
    let body = &body.name;
    error!(
        Simulation at "train",
        "the motion is no longer finite at {time_s:.6} s, first at {body}: check masses, speeds, curves and resistance"
    )
}

/// Energies in J and the worst imbalances over a run.
///
/// `KE + ΣU + ΣD + W = KE₀`, with stored and dissipated energy of the interfaces exact from
/// their tables, and `W` what dampers and resistance took, by the trapezoidal rule over the
/// steps. The trapezoidal work of the interfaces' forces would balance for any step and so
/// check nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Ledger {
    /// At the first contact.
    #[serde(rename = "initial_kinetic_J")]
    pub initial_kinetic_j: f64,
    /// At the end, as all that follow.
    #[serde(rename = "kinetic_J")]
    pub kinetic_j: f64,
    /// In all interfaces.
    #[serde(rename = "stored_J")]
    pub stored_j: f64,
    /// In all interfaces.
    #[serde(rename = "dissipated_J")]
    pub dissipated_j: f64,
    /// By dampers, by the share of forces that follows speeds, and where mass is stopped.
    #[serde(rename = "damped_J")]
    pub damped_j: f64,
    /// By running and braking resistance.
    #[serde(rename = "resisted_J")]
    pub resisted_j: f64,
    /// Largest imbalance of energy at any output, as a share of the initial kinetic energy.
    pub max_energy_error: f64,
    /// Largest imbalance of momentum at any output, as a share of `Σ m|v₀|`.
    pub max_momentum_error: f64,
}

impl Ledger {
    /// What is out of tolerance.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.max_energy_error > ENERGY_TOLERANCE {
            warnings.push(format!(
                "energy is off by {:.2e} of the initial kinetic energy (tolerance {ENERGY_TOLERANCE:e}): shorten the step",
                self.max_energy_error
            ));
        }
        if self.max_momentum_error > MOMENTUM_TOLERANCE {
            warnings.push(format!(
                "momentum is off by {:.2e} (tolerance {MOMENTUM_TOLERANCE:e}): shorten the step",
                self.max_momentum_error
            ));
        }
        warnings
    }
}

const ENERGY_TOLERANCE: f64 = 1e-3;
/// Imbalance of momentum over which a warning is due.
const MOMENTUM_TOLERANCE: f64 = 1e-10;

/// What is where at an output: energies in J, momentum and impulse in N s.
pub(super) struct Balance {
    pub kinetic_j: f64,
    /// Stored and dissipated by all interfaces.
    pub interfaces_j: f64,
    pub damped_j: f64,
    pub resisted_j: f64,
    pub momentum: f64,
    /// What wall and track have taken so far.
    pub impulse: f64,
}

/// The running account of a simulation.
pub(super) struct Account {
    ledger: Ledger,
    initial_momentum: f64,
    momentum_scale: f64,
}

impl Account {
    pub(crate) fn open(chain: &Chain) -> Self {
        let bodies = chain.bodies();
        let kinetic = |b: &super::Body| 0.5 * b.mass_kg * b.speed_m_per_s * b.speed_m_per_s;
        let ledger =
            Ledger { initial_kinetic_j: bodies.iter().map(kinetic).sum(), ..Ledger::default() };
        Self {
            ledger,
            initial_momentum: bodies.iter().map(|b| b.mass_kg * b.speed_m_per_s).sum(),
            momentum_scale: bodies.iter().map(|b| b.mass_kg * b.speed_m_per_s.abs()).sum(),
        }
    }

    /// Audits an output.
    pub(crate) fn audit(&mut self, now: &Balance) {
        let ledger = &mut self.ledger;
        (ledger.kinetic_j, ledger.damped_j, ledger.resisted_j) =
            (now.kinetic_j, now.damped_j, now.resisted_j);
        let energy = now.kinetic_j + now.interfaces_j + now.damped_j + now.resisted_j;
        let share = |difference: f64, scale: f64| {
            if difference == 0.0 {
                0.0
            } else {
                Some(difference.abs() / scale).filter(|e| !e.is_nan()).unwrap_or(f64::INFINITY)
            }
        };
        let energy_error = share(energy - ledger.initial_kinetic_j, ledger.initial_kinetic_j);
        let momentum_error =
            share(now.momentum + now.impulse - self.initial_momentum, self.momentum_scale);
        ledger.max_energy_error = ledger.max_energy_error.max(energy_error);
        ledger.max_momentum_error = ledger.max_momentum_error.max(momentum_error);
    }

    /// Stored and dissipated are those of the last output.
    pub(crate) fn close(self, stored_j: f64, dissipated_j: f64) -> Ledger {
        Ledger { stored_j, dissipated_j, ..self.ledger }
    }
}
