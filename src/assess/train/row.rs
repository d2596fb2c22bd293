//! One method in a train: its run, compared with FE's.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use super::methods::Method;
use super::{FeTrain, InterfaceCrush, TrainRow, VehicleErrors};
use crate::curve::body::filtered;
use crate::error::{Error, KeyPath, error};
use crate::multibody::{Chain, Run, RunSettings, simulate};
use crate::scenario::{self, Prepared};
use crate::signal::{derivative, integral, interpolate, l1_ratio};

/// Runs a method's scenario and compares the vehicles with FE's at `time_s`, the first times of
/// FE's run.
pub(super) fn row(
    path: &Path,
    method: Method,
    fe: &FeTrain,
    time_s: &[f64],
) -> Result<TrainRow, Error> {
    let start = Instant::now();
    let scenario = scenario::check(path, &method.scenario)?;
    let prepared = scenario::assemble(path, &scenario, &method.sources)?;
    let settings =
        RunSettings { output_interval_s: interval_s(&prepared, time_s), ..prepared.settings };
    let run = simulate(&prepared.chain, &settings)?;
    let simulation_time_s = start.elapsed().as_secs_f64();
    let bodies = prepared.chain.bodies();
    let (mut vehicles, mut velocities) = (Vec::new(), BTreeMap::new());
    for (name, reference) in &fe.velocities {
        let Some(i) = bodies.iter().position(|b| b.name == *name) else {
            let known: Vec<&str> = bodies.iter().map(|b| b.name.as_str()).collect();
            return Err(error!(
                Comparison,
                "the scenario has no vehicle \"{name}\": its vehicles are"
            )
            .names(name, known.into_iter())
            .at(KeyPath::of("reference.nodes").key(name).itself()));
        };
        let reference = &reference[..time_s.len()];
        let ours = interpolate(&run.time_s, &run.bodies[i].v_m_per_s, time_s).map_err(|_| {
            error!(Comparison, "the run ends at {duration_s} s, before FE's record or until ({until_s} s): lengthen duration, or set until in [reference]", duration_s = run.time_s.last().copied().unwrap_or(0.0), until_s = time_s[time_s.len() - 1]).at_key("run.duration")
        })?;
        vehicles.push(vehicle_errors(name, time_s, reference, &ours, fe.fastest_m_per_s()));
        velocities.insert(name.clone(), ours);
    }
    let mean = |of: fn(&VehicleErrors) -> f64| {
        vehicles.iter().map(of).sum::<f64>() / vehicles.len().max(1) as f64
    };
    let mut warnings = prepared.warnings.clone();
    warnings.extend(run.all_warnings());
    Ok(TrainRow {
        method: method.name.into(),
        driven_by: method.driven_by.into(),
        mean_velocity_l1: mean(|v| v.velocity_l1),
        mean_velocity_difference_m_per_s: mean(|v| v.velocity_difference_m_per_s),
        mean_velocity_share_of_initial: mean(|v| v.velocity_share_of_initial),
        mean_acceleration_l1: mean(|v| v.acceleration_l1),
        interface_speeds_m_per_s: prepared
            .chain
            .interfaces()
            .iter()
            .zip(&prepared.used)
            .filter(|(_, used)| used.curve != scenario::PLATES)
            .map(|(interface, used)| (interface.name.clone(), used.speed_m_per_s))
            .collect(),
        interfaces: between_vehicles(&prepared.chain, &run, fe, time_s),
        vehicles,
        fit_time_s: method.fit_time_s,
        simulation_time_s,
        warnings,
        velocities,
    })
}

/// FE's interval may be coarse for the work of a force, and the scenario's for FE's speeds: each state of FE has several outputs of its
/// own, down to 0.1 ms.
fn interval_s(prepared: &Prepared, time_s: &[f64]) -> f64 {
    const OUTPUTS_PER_STATE: f64 = 8.0;
    const FINEST_S: f64 = 1e-4;
    let fe_s = (time_s[time_s.len() - 1] - time_s[0]) / (time_s.len() - 1) as f64;
    // A whole part of the scenario's own, whose last output remains.
    let own_s = prepared.settings.output_interval_s;
    own_s / (own_s / fe_s.min(FINEST_S.max(fe_s / OUTPUTS_PER_STATE))).ceil()
}

fn vehicle_errors(
    name: &str,
    time_s: &[f64],
    reference: &[f64],
    ours: &[f64],
    fastest_m_per_s: f64,
) -> VehicleErrors {
    let acceleration = |v: &[f64]| filtered(time_s, derivative(time_s, v));
    let differences = reference.iter().zip(ours).map(|(r, p)| (p - r).abs());
    let difference_m_per_s = differences.sum::<f64>() / reference.len() as f64;
    VehicleErrors {
        vehicle: name.into(),
        velocity_l1: l1_ratio(reference, ours),
        velocity_difference_m_per_s: difference_m_per_s,
        velocity_share_of_initial: difference_m_per_s / fastest_m_per_s,
        acceleration_l1: l1_ratio(&acceleration(reference), &acceleration(ours)),
    }
}

/// Crush and work between each two vehicles, or a vehicle and the wall, until the comparison ends.
///
/// An interface whose two bodies are vehicles is counted by itself; the plates of ends, and the crush
/// zones that follow the same two vehicles, belong together.
fn between_vehicles(chain: &Chain, run: &Run, fe: &FeTrain, time_s: &[f64]) -> Vec<InterfaceCrush> {
    let until_s = time_s[time_s.len() - 1];
    // The comparison may end between two outputs.
    let before = run.time_s.iter().copied().take_while(|&t| t < until_s);
    let at: Vec<f64> = before.chain([until_s]).collect();
    let until = |values: &[f64]| interpolate(&run.time_s, values, &at).unwrap_or_default();
    let interfaces = chain.interfaces();
    let mut crushes = Vec::new();
    for (k, interface) in interfaces.iter().enumerate() {
        if interface.stopping.is_some() {
            continue;
        }
        let stands_at = |j: usize| interfaces.get(j).is_some_and(|i| i.stopping.is_some());
        let before = k.checked_sub(1).filter(|&j| stands_at(j));
        let after = Some(k + 1).filter(|&j| stands_at(j));
        let rate = before.or(after).and_then(|j| interfaces[j].rate.as_ref());
        let ahead = (k + 1 < chain.bodies().len()).then_some(k + 1);
        let (behind, ahead) = rate.map_or((k, ahead), |rate| (rate.behind, rate.ahead));
        let parts: Vec<usize> = [before, Some(k), after].into_iter().flatten().collect();
        let moved = |i: usize| until(&run.bodies[i].x_m);
        let mut approach_m: Vec<f64> =
            moved(behind).into_iter().map(|x| x - interface.gap_m).collect();
        if let Some(ahead) = ahead {
            approach_m.iter_mut().zip(moved(ahead)).for_each(|(a, x)| *a -= x);
        }
        // The run begins at the first contact, whose gap is closed.
        let still_open_m = approach_m.first().map_or(interface.gap_m, |a| -a);
        let name = |i: usize| chain.bodies()[i].name.as_str();
        crushes.push(InterfaceCrush {
            interface: interface.name.clone(),
            crush_m: approach_m.iter().copied().fold(0.0, f64::max),
            fe_crush_m: fe_crush_m(fe, time_s, name(behind), ahead.map(name), still_open_m),
            work_j: parts
                .iter()
                .map(|&j| {
                    let of = &run.interfaces[j];
                    work_j(&until(&of.deflection_m), &until(&of.force_n))
                })
                .sum(),
        });
    }
    crushes
}

/// FE's maximum approach of two vehicles, or a vehicle and the wall, from contact on, minus the gap that is open there.
fn fe_crush_m(
    fe: &FeTrain,
    time_s: &[f64],
    behind: &str,
    ahead: Option<&str>,
    gap_m: f64,
) -> Option<f64> {
    let moved = |name: &str| {
        let (_, v) = fe.velocities.iter().find(|(vehicle, _)| vehicle == name)?;
        let moved = integral(time_s, &v[..time_s.len()]);
        // The contact may lie between two states.
        Some(moved.into_iter().map(|m| m + v[0] * time_s[0]).collect::<Vec<f64>>())
    };
    let behind = moved(behind)?;
    let ahead = match ahead {
        Some(name) => moved(name)?,
        None => vec![0.0; behind.len()],
    };
    let crush = behind.iter().zip(&ahead).map(|(b, a)| b - a - gap_m);
    Some(crush.fold(0.0, f64::max))
}

/// Work of a force over its deflection.
fn work_j(d: &[f64], f: &[f64]) -> f64 {
    (1..d.len()).map(|i| 0.5 * (f[i - 1] + f[i]) * (d[i] - d[i - 1])).sum()
}
