//! Longitudinal multi-body crash: masses on a line, interfaces with a force law.
//!
//! `m_i x_i'' = F_{i−1} − F_i − R_i`, with `F_i` the force of the interface in front of
//! body `i`, acting on its deflection `δ = (x_i − x_{i+1}) − gap`, and `R_i` the resistance of
//! the track.

mod chain;
mod contacts;
mod damping;
mod engine;
mod law;
mod ledger;
mod recorder;
mod reference;
mod rows;
mod run;

pub use chain::{
    Body, Chain, ChainError, Interface, Resistance, STANDARD_GRAVITY_M_PER_S2, Tension,
};
pub use damping::{Damping, DampingError};
pub use law::{EnvelopeEnd, ForceLaw, Unloading, UnloadingShape};
pub use ledger::Ledger;
pub use run::{
    BodyHistory, InterfaceHistory, Method, Record, Run, RunSettings, RunWarning, SimulationError,
};

/// A curve's own run ends where the curve does, but for rounding.
const AT_END_M: f64 = 1e-4;
/// Bounds that no real scenario reaches; they keep a mistyped duration from running for days.
const MAX_STEPS: f64 = 1e8;
const MAX_OUTPUTS: f64 = 1e6;

/// Runs the chain from the first contact (t = 0) for `duration_s`.
///
/// x counts from where each body stands before gaps close; bodies move freely up to the
/// first contact.
///
/// # Errors
/// [`SimulationError`] names the interface or body.
pub fn simulate(chain: &Chain, settings: &RunSettings) -> Result<Run, SimulationError> {
    let (step_s, per_output, outputs) = steps(chain, settings)?;
    if settings.method == Method::FourthOrder && chain.has_rates() {
        let damped = chain.interfaces().iter().find(|i| i.damping.is_some());
        let what = match damped {
            Some(interface) => format!("the damper of interface {}", interface.name),
            None => "running or braking resistance".into(),
        };
        return Err(SimulationError::Rates { what });
    }
    let mut run = Run {
        time_s: Vec::new(),
        bodies: vec![BodyHistory::default(); chain.bodies().len()],
        interfaces: vec![InterfaceHistory::default(); chain.interfaces().len()],
        ledger: Ledger::default(),
        step_s,
        warnings: Vec::new(),
    };
    let (shortest_s, k) = chain.shortest_time_s();
    let interface = |k: usize| chain.interfaces()[k].name.clone();
    // The default step is not what anybody asked for.
    let is_asked = settings.step_s != settings.method.default_step_s();
    if is_asked && settings.step_s > settings.method.step_rule() * shortest_s {
        let (asked_s, used_s) = (settings.step_s, step_s);
        run.warnings.push(RunWarning::StepShortened { asked_s, used_s, interface: interface(k) });
    }
    run.reserve(outputs + 1, settings.record);
    match settings.method {
        Method::Reference => reference::run(chain, settings, &mut run, outputs)?,
        method => {
            let times = (outputs, settings.output_interval_s);
            engine::run(chain, method, settings.record, &mut run, per_output, times)?;
        }
    }
    for (k, history) in run.interfaces.iter().enumerate() {
        let tension = chain.interfaces()[k].tension.as_ref();
        let reached = [
            ("crushed", history.max_deflection_m, chain.interfaces()[k].law.end_m()),
            (
                "pulled apart by",
                history.max_extension_m,
                tension.map_or(f64::INFINITY, |t| t.law.end_m()),
            ),
        ];
        for (what, deflection_m, end_m) in reached {
            if deflection_m > end_m + AT_END_M {
                let interface = interface(k);
                run.warnings.push(RunWarning::BeyondEnd { interface, what, deflection_m, end_m });
            }
        }
    }
    let loaded = chain.bodies().iter().zip(&run.bodies).filter(|(_, b)| b.is_loaded_at_end);
    let bodies: Vec<&str> = loaded.map(|(body, _)| body.name.as_str()).collect();
    if !bodies.is_empty() {
        let end_s = outputs as f64 * settings.output_interval_s;
        // Without the rounding of a product.
        let (end_s, bodies) = ((end_s * 1e9).round() / 1e9, bodies.join(", "));
        run.warnings.push(RunWarning::StillLoaded { end_s, bodies });
    }
    Ok(run)
}

/// Step, steps per output and outputs.
fn steps(chain: &Chain, settings: &RunSettings) -> Result<(f64, usize, usize), SimulationError> {
    let RunSettings { duration_s, output_interval_s, step_s, method, .. } = *settings;
    let times =
        [("duration", duration_s), ("output_interval", output_interval_s), ("step", step_s)];
    for (what, value_s) in times {
        if !(value_s > 0.0 && value_s.is_finite()) {
            return Err(SimulationError::Time { what, value_s });
        }
    }
    if output_interval_s > duration_s * (1.0 + 1e-12) {
        return Err(SimulationError::Interval { output_interval_s, duration_s });
    }
    let (shortest_s, k) = chain.shortest_time_s();
    let longest = step_s.min(method.step_rule() * shortest_s);
    let per_output = (output_interval_s / longest * (1.0 - 1e-12)).ceil().max(1.0);
    let outputs = (duration_s / output_interval_s * (1.0 + 1e-12)).floor().max(1.0);
    let steps = per_output * outputs;
    let step_s = output_interval_s / per_output;
    if !(steps <= MAX_STEPS && outputs <= MAX_OUTPUTS) {
        let interface = chain.interfaces().get(k).map_or("none".into(), |i| i.name.clone());
        return Err(SimulationError::TooLong { steps, step_s, outputs, interface });
    }
    Ok((step_s, per_output as usize, outputs as usize))
}
