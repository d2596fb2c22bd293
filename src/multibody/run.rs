//! What a run is asked for and what it gives: method, times, histories, warnings, errors.

use super::ledger::Ledger;

/// Default step of velocity Verlet: at 0.05 ms (a fifteenth of the output interval) the crush
/// of a 24 t car on a 40 MN/m spring is off in the sixth digit; at 0.01 ms all seven printed
/// ones hold.
pub const DEFAULT_STEP_S: f64 = 1e-5;
/// Default step of the fourth-order scheme.
pub const FOURTH_ORDER_STEP_S: f64 = 3.5e-4;

/// How the motion is integrated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Velocity Verlet: order 2, takes everything.
    #[default]
    Verlet,
    /// Two forces and a gradient per step: order 4, for forces that do not depend on speeds.
    FourthOrder,
    /// Extrapolation with adaptive order and step: slow, for checks. Its extremes are those of its
    /// steps and its contacts those of the outputs; it gives no restitution.
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

/// What is kept of a run beside its summary.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Record {
    /// Histories of all bodies and interfaces.
    #[default]
    Histories,
    /// Nothing: histories stay empty.
    Summary,
}

/// Times of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunSettings {
    pub duration_s: f64,
    pub output_interval_s: f64,
    /// Longest step; shortened to divide the output interval and to keep the step rule.
    pub step_s: f64,
    pub method: Method,
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
    pub x_m: Vec<f64>,
    pub v_m_per_s: Vec<f64>,
    pub a_m_per_s2: Vec<f64>,
    pub final_v_m_per_s: f64,
    /// Mean of `−a` while the body's net contact force acts for the first time, until it ends or
    /// changes its sign. Up to 1 kN, longer than a look of 0.25 ms, it does not act; contacts that
    /// change the speed by less than 0.5 % of the largest change do not count.
    pub mean_deceleration_m_per_s2: f64,
    /// That net contact force still acts when the run ends: the mean is of a part.
    pub is_loaded_at_end: bool,
    /// Mean of `−a` over the 120 ms in which its magnitude is largest, with windows that end at
    /// the outputs; `None` in a shorter run and for outputs more than 5 ms apart.
    pub moving_mean_deceleration_m_per_s2: Option<f64>,
}

/// Histories of one interface, one value per output, and its extremes over all steps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InterfaceHistory {
    pub deflection_m: Vec<f64>,
    /// Net force, below 0 where a coupling pulls.
    pub force_n: Vec<f64>,
    /// Largest deflection so far.
    pub largest_deflection_m: Vec<f64>,
    pub stored_j: Vec<f64>,
    pub dissipated_j: Vec<f64>,
    pub peak_force_n: f64,
    /// Of the coupling, with the largest extension; 0 without one.
    pub peak_tension_n: f64,
    pub max_extension_m: f64,
    pub max_deflection_m: f64,
    /// Time of the largest deflection.
    pub max_deflection_time_s: f64,
    /// When both sides first had the same velocity.
    pub common_velocity_time_s: Option<f64>,
    /// Speed of separation over speed of approach at the interface, once it has opened again;
    /// above 1 where neighbours drive the vehicles apart. `None` below 0.1 m/s of approach.
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
    pub warnings: Vec<RunWarning>,
}

/// What a user must know about a run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RunWarning {
    #[error(
        "the step of {asked_s:.3e} s is too long for interface {interface}: {used_s:.3e} s was used"
    )]
    StepShortened { asked_s: f64, used_s: f64, interface: String },
    #[error(
        "interface {interface} is {what} {deflection_m:.4} m, beyond the end of its curve at {end_m:.4} m"
    )]
    BeyondEnd { interface: String, what: &'static str, deflection_m: f64, end_m: f64 },
    #[error(
        "the run ends at {end_s} s while the contact still loads {bodies}: the mean deceleration is that up to there, and what comes may be more; lengthen duration"
    )]
    StillLoaded { end_s: f64, bodies: String },
}

/// Why a run has no result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimulationError {
    #[error("{what} is {value_s} s: expected a time above 0")]
    Time { what: &'static str, value_s: f64 },
    #[error("output_interval is {output_interval_s} s, longer than the duration of {duration_s} s")]
    Interval { output_interval_s: f64, duration_s: f64 },
    #[error(
        "the run would take {steps:.3e} steps of {step_s:.3e} s for {outputs:.3e} outputs: shorten the duration or lengthen step and output interval; the shortest step is asked for by interface {interface}"
    )]
    TooLong { steps: f64, step_s: f64, outputs: f64, interface: String },
    #[error(
        "interface {interface} is {what} {deflection_m:.4} m at {time_s:.6} s, beyond the end of its curve ({end_m:.4} m): give a longer curve, or end = \"hold\""
    )]
    CurveEnd { interface: String, what: &'static str, deflection_m: f64, time_s: f64, end_m: f64 },
    #[error(
        "the motion is not finite any more at {time_s:.6} s, first at {body}: check masses, speeds, curves and resistance"
    )]
    Diverged { body: String, time_s: f64 },
    #[error(
        "{what} depends on the speed, which the fourth-order method does not take: use method = \"verlet\""
    )]
    Rates { what: String },
    #[error(
        "the step fell below {step_s:e} s at {time_s:.6} s: the reference method cannot follow this motion"
    )]
    Stuck { step_s: f64, time_s: f64 },
}

impl Run {
    /// All that a user must know, as text.
    pub fn all_warnings(&self) -> Vec<String> {
        let mut warnings = self.ledger.warnings();
        warnings.extend(self.warnings.iter().map(|w| w.to_string()));
        warnings
    }

    pub(super) fn reserve(&mut self, outputs: usize, record: Record) {
        for b in &mut self.bodies {
            // The moving mean needs the speeds in any case.
            b.v_m_per_s.reserve_exact(outputs);
        }
        if record == Record::Summary {
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
            ] {
                values.reserve_exact(outputs);
            }
        }
    }
}
