//! Interface-local speeds: curves for the speed at which each interface closes itself.
//!
//! The interfaces inside a train close far more slowly than the trains meet. The closing speed of an interface
//! depends on all curves, so both are determined together, by iteration.
//!
//! Local speeds are a fixed point: curves for the present speeds; a run; each interface's largest closing speed up to the
//! first peak of its force, to 0.01 m/s; and again, until none changes by 0.1 m/s. Models are used beyond their maximum crush here,
//! because neighbours keep pushing; the closing speed that rate effects follow is then zero.

use std::collections::BTreeMap;
use std::path::Path;

use super::assemble::assemble_at;
use super::layout::{ConnectionKind, Role, layout};
use super::{CheckedScenario, CurveSource, InterfaceSpeed, Prepared, Sources};
use crate::error::Error;
use crate::multibody::{Chain, Method, Record, Run, RunSettings, simulate};
use crate::signal::peaks::first_peak;
use crate::unit::km_per_h;

/// The speeds are found when none changes by more, in m/s.
const CHANGE_M_PER_S: f64 = 0.1;
const ROUNDS: usize = 10;
/// The first guess, as a share of the speed at which the trains meet: most interfaces close at 0.2 to 0.3 of it.
const START: f64 = 0.25;
/// Curves are predicted for multiples of 0.01 m/s, so that many interfaces share one.
const GRID_PER_M_PER_S: f64 = 100.0;
/// Of a change that goes back and forth only this share is made.
const RELAXATION: f64 = 0.5;
/// The first maximum of the force is one that stands out by this share of the largest.
const PROMINENCE: f64 = 0.1;
/// States for the speeds, in s; forces rise within some milliseconds.
const INTERVAL_S: f64 = 0.5e-3;
/// Outputs further apart do not show how fast an interface closes at first, in s.
const LONGEST_INTERVAL_S: f64 = 5e-3;
/// What closes for the first time after this is not looked for, in s.
const LONGEST_S: f64 = 5.0;
/// No curve is requested below this speed, in m/s: an interface that hardly closes.
const SLOWEST_M_PER_S: f64 = 0.1;

/// Puts a scenario together with what its files hold; `path` is for messages. Interfaces whose
/// curves come from models get them for their own closing speeds, unless the scenario sets
/// the trains' speed.
pub(crate) fn assemble(
    path: &Path,
    scenario: &CheckedScenario<'_>,
    sources: &Sources,
) -> Result<Prepared, Error> {
    let own: Vec<bool> = layout(scenario)
        .slots
        .iter()
        .map(|slot| is_local(&slot.joint, slot.role, sources))
        .collect();
    let meeting_m_per_s = scenario.meeting_m_per_s;
    if scenario.run.interface_speed != InterfaceSpeed::Local || !own.contains(&true) {
        return assemble_at(path, scenario, sources, &vec![meeting_m_per_s; own.len()]);
    }
    let start_m_per_s = (START * meeting_m_per_s).max(SLOWEST_M_PER_S);
    // To the tolerance, so that the runs of a sweep begin with the same curves.
    let start_m_per_s = on_grid(start_m_per_s, 1.0 / CHANGE_M_PER_S);
    let first = |is_own: &bool| if *is_own { start_m_per_s } else { meeting_m_per_s };
    let mut speeds_m_per_s: Vec<f64> = own.iter().map(first).collect();
    let mut prepared = assemble_at(path, scenario, sources, &speeds_m_per_s)?;
    let mut before = vec![0.0; own.len()];
    for _ in 0..ROUNDS {
        let mut settings = closing(prepared.settings);
        if !prepared.chain.has_rates() {
            settings = settings.with_method(Method::FourthOrder);
        }
        let failed =
            |error: Error| prepared.failed(error.of("while the interface speeds were determined"));
        let run = simulate(&prepared.chain, &settings).map_err(failed)?;
        let largest =
            follow(&prepared.chain, &run, &own, meeting_m_per_s, &mut speeds_m_per_s, &mut before);
        prepared = assemble_at(path, scenario, sources, &speeds_m_per_s)?;
        // The next change would be smaller still.
        if largest < CHANGE_M_PER_S {
            prepared.warnings.extend(slow_interfaces(&prepared, sources));
            return Ok(prepared);
        }
    }
    let unsettled = before
        .iter()
        .enumerate()
        .filter(|(_, change)| change.abs() >= CHANGE_M_PER_S)
        .map(|(k, change)| {
            let name = &prepared.chain.interfaces()[k].name;
            format!("{name} ({} last changed by {change:+.2} m/s)", km_per_h(speeds_m_per_s[k]))
        })
        .collect::<Vec<_>>();
    if !unsettled.is_empty() {
        prepared.warnings.push(format!(
            "the closing speed of interface {} did not settle in {ROUNDS} rounds: compare with interface_speed = \"train\"",
            unsettled.join(", ")
        ));
    }
    prepared.warnings.extend(slow_interfaces(&prepared, sources));
    Ok(prepared)
}

/// Settings of a run of which only the closing speeds are needed.
fn closing(settings: RunSettings) -> RunSettings {
    let duration_s = settings.duration_s.min(LONGEST_S);
    let output_interval_s = INTERVAL_S.min(duration_s);
    RunSettings { record: Record::Closing, duration_s, output_interval_s, ..settings }
}

/// Speeds of a curve and of an interface inside a train that differ by this factor are two: one curve drives many interfaces.
const OTHER_SPEED: f64 = 1.5;
/// A crush below this share of a curve's data says nothing of it.
const HARDLY_CRUSHED: f64 = 0.1;
/// Interfaces that a warning names.
const NAMED: usize = 3;

impl Prepared {
    /// Warnings of a run and of its curves, with those of curves of one impact that drive interfaces inside a train which close at
    /// another speed.
    pub fn warnings_of(&self, run: &Run) -> Vec<String> {
        let mut warnings = self.warnings.clone();
        warnings.extend(self.other_speeds(run, &[]));
        warnings.extend(run.all_warnings());
        warnings
    }

    /// Warnings of curves of one impact that drive interfaces inside the train which close at another speed in a run.
    fn other_speeds(&self, run: &Run, replaced: &[&str]) -> Vec<String> {
        let interfaces = self.chain.interfaces().iter().zip(&run.interfaces).zip(&self.used);
        let mut others: BTreeMap<&str, (f64, Vec<String>)> = BTreeMap::new();
        for (k, ((interface, history), used)) in interfaces.enumerate() {
            let is_of_one = self.of_one.0.iter().any(|of| of.curve == used.curve);
            let is_crushed = history.max_deflection_m > HARDLY_CRUSHED * history.data_end_m;
            let is_replaced = replaced.contains(&&*used.curve);
            let (true, true, Some(own), Some(closing)) = (
                k != self.meeting && is_of_one && is_crushed && !is_replaced,
                self.settings.output_interval_s <= LONGEST_INTERVAL_S,
                used.speed_m_per_s,
                closing_speed(&self.chain, run, k),
            ) else {
                continue;
            };
            if (closing / own).max(own / closing) > OTHER_SPEED {
                let (_, closes) = others.entry(&used.curve).or_insert((own, Vec::new()));
                closes.push(format!("{} at {}", interface.name, km_per_h(closing)));
            }
        }
        let warning = |(curve, (own, closes)): (&str, (f64, Vec<String>))| {
            let more = closes.len().saturating_sub(NAMED);
            let more = if more > 0 { format!(", and {more} more") } else { String::new() };
            format!(
                "curve \"{curve}\": it is for {}, but what it drives closes at other speeds ({}{more}): forces depend on the speed; a model (crumple train) gives each interface the curve of its own",
                km_per_h(own),
                closes.iter().take(NAMED).cloned().collect::<Vec<_>>().join(", ")
            )
        };
        others.into_iter().map(warning).collect()
    }

    /// The same of a run of its own, but for curves that are replaced; none if it has no curve of one impact, or does not run.
    pub(crate) fn other_speeds_as_it_stands(&self, replaced: &[&str]) -> Vec<String> {
        let is_idle = self.of_one.0.iter().all(|of| replaced.contains(&&*of.curve));
        if is_idle || self.settings.output_interval_s > LONGEST_INTERVAL_S {
            return Vec::new();
        }
        let run = simulate(&self.chain, &closing(self.settings));
        run.map_or_else(|_| Vec::new(), |run| self.other_speeds(&run, replaced))
    }
}

/// Takes the closing speeds of a run for the interfaces with curves of their `own`, and the trains' for those that never
/// close; `before` holds the last changes. The largest change in m/s.
fn follow(
    chain: &Chain,
    run: &Run,
    own: &[bool],
    meeting_m_per_s: f64,
    speeds_m_per_s: &mut [f64],
    before: &mut [f64],
) -> f64 {
    let mut largest: f64 = 0.0;
    for k in (0..own.len()).filter(|&k| own[k]) {
        let Some(closing) = closing_speed(chain, run, k) else {
            largest = largest.max((meeting_m_per_s - speeds_m_per_s[k]).abs());
            (speeds_m_per_s[k], before[k]) = (meeting_m_per_s, 0.0);
            continue;
        };
        let mut change = closing.max(SLOWEST_M_PER_S) - speeds_m_per_s[k];
        largest = largest.max(change.abs());
        if change * before[k] < 0.0 {
            change *= RELAXATION;
        }
        before[k] = change;
        speeds_m_per_s[k] = on_grid(speeds_m_per_s[k] + change, GRID_PER_M_PER_S);
    }
    largest
}

/// The nearest multiple of a decimal step, of which `per_m_per_s` are 1 m/s.
fn on_grid(speed_m_per_s: f64, per_m_per_s: f64) -> f64 {
    (speed_m_per_s * per_m_per_s).round() / per_m_per_s
}

/// Advice for every model whose interfaces close below its slowest run: one run there shows what no
/// model can.
fn slow_interfaces(prepared: &Prepared, sources: &Sources) -> Vec<String> {
    let mut slowest: BTreeMap<&str, f64> = BTreeMap::new();
    for used in &prepared.used {
        let Some(speed) = used.speed_m_per_s else { continue };
        let least = slowest.entry(&used.curve).or_insert(speed);
        *least = least.min(speed);
    }
    let advice = |(curve, speed): (&str, f64)| {
        let (low, _) = sources.model(curve)?.range_m_per_s();
        (speed < low * (1.0 - 1e-9)).then(|| {
            format!(
                "curve \"{curve}\": an interface closes at {}, below its slowest run ({}): one more FE run at about that speed would help most",
                km_per_h(speed),
                km_per_h(low)
            )
        })
    };
    slowest.into_iter().filter_map(advice).collect()
}

/// Whether a slot's curve depends on its own closing speed: between vehicles, from a model.
fn is_local(joint: &ConnectionKind<'_>, role: Role, sources: &Sources) -> bool {
    match joint {
        ConnectionKind::Curve(curve) => {
            role == Role::Vehicles
                && matches!(sources.curves.get(*curve), Some(CurveSource::Model(_)))
        }
        ConnectionKind::End(end) => end.at == Role::Vehicles,
        ConnectionKind::Plates => false,
    }
}

/// Largest closing speed of interface `k` from its contact to the first maximum of its force;
/// `None` if it never closes.
fn closing_speed(chain: &Chain, run: &Run, k: usize) -> Option<f64> {
    let interface = &run.interfaces[k];
    let begin = interface.deflection_m.iter().position(|&d| d > 0.0)?;
    let forces = &interface.force_n[begin..];
    let most = forces.iter().copied().fold(0.0, f64::max);
    let until = first_peak(forces, PROMINENCE * most).map_or(forces.len(), |peak| peak + 1);
    let ahead = (k + 1 < chain.bodies().len()).then_some(k + 1);
    // An end follows its vehicles.
    let rate = chain.interfaces()[k].rate.as_ref();
    let (behind, ahead) = rate.map_or((k, ahead), |rate| (rate.behind, rate.ahead));
    let speed = |i: usize, row: usize| run.bodies[i].v_m_per_s[row];
    // The state before the contact still has the whole speed.
    let rows = begin.saturating_sub(1)..begin + until;
    rows.map(|row| speed(behind, row) - ahead.map_or(0.0, |i| speed(i, row))).reduce(f64::max)
}
