//! Assembly: bodies, interfaces and their laws become a chain, for given speeds.

use std::path::Path;
use std::sync::Arc;

use super::layout::{Layout, Role, Slot, layout};
use super::place::{self, Origin};
use super::spring::{NoSpring, SpringError, spring};
use super::{CheckedScenario, CurveSource, LimitsTable, Prepared, ScenarioError, Sources, Used};
use crate::multibody::{
    Chain, ChainError, Damping, DampingError, ForceLaw, Interface, Method, RunSettings, Tension,
};
use crate::unit::SpeedKind;

/// Why a curve cannot stand where the scenario puts it.
#[derive(Debug, thiserror::Error)]
pub enum AssemblyError {
    /// The sources are those of another scenario.
    #[error("curve \"{curve}\" has not been read")]
    NotRead {
        /// The curve.
        curve: String,
    },
    /// It gives no force law.
    #[error("curve \"{curve}\": {source}")]
    NoSpring {
        /// The curve.
        curve: String,
        /// Why not.
        source: SpringError,
    },
    /// Its damper breaks the rules of a damper.
    #[error("curve \"{curve}\": {source}")]
    Damping {
        /// The curve.
        curve: String,
        /// What is wrong with it.
        source: DampingError,
    },
    /// It was measured at speeds of the other kind.
    #[error(
        "curve \"{curve}\" was measured at {} speeds, but interface {interface} needs one of {} speeds",
        .kind.name(),
        .expected.name()
    )]
    Speeds {
        /// The curve.
        curve: String,
        /// Kind of its speeds.
        kind: SpeedKind,
        /// The interface that it should stand at.
        interface: String,
        /// Kind of that interface's speed.
        expected: SpeedKind,
    },
}

/// Puts a scenario together with what its files hold, with curves for given speeds of the
/// interfaces, in the order of the chain; `path` is for messages.
///
/// # Errors
/// [`ScenarioError`] names the key or curve.
pub(super) fn assemble_at(
    path: &Path,
    scenario: &CheckedScenario<'_>,
    sources: &Sources,
    speeds_m_per_s: &[f64],
) -> Result<Prepared, ScenarioError> {
    let Layout { bodies, slots, order } = layout(scenario);
    let mut builder = Builder { path, scenario, sources, made: Vec::new(), warnings: Vec::new() };
    let (mut interfaces, mut used) = (Vec::new(), Vec::new());
    for (slot, &speed) in slots.iter().zip(speeds_m_per_s) {
        let made = builder.law(slot, slot.curve, speed)?;
        let table = &scenario.curves[slot.curve];
        let gap_m = slot.gap_m.or(table.gap.map(|g| g.0)).unwrap_or(0.0);
        let mut interface = Interface::new(slot.name.clone(), made.law, gap_m);
        if let Some(name) = &table.tension {
            let slack_m = scenario.curves[name].gap.map_or(0.0, |g| g.0);
            interface.tension = Some(Tension { law: builder.law(slot, name, speed)?.law, slack_m });
        }
        if let Some(damping) = &table.damping {
            let points = (damping.speed_m_per_s.clone(), damping.coefficient_n_s_per_m.clone());
            let damping = Damping::new(points.0, points.1).map_err(|source| {
                builder.failed(AssemblyError::Damping { curve: slot.curve.into(), source })
            })?;
            interface.damping = Some(damping);
        }
        interfaces.push(interface);
        used.push(made.used);
    }
    let chain =
        Chain::new(bodies, interfaces).map_err(|source| no_chain(path, scenario, source))?;
    let settings = RunSettings::new(scenario.run.duration.0, scenario.run.output_interval.0)
        .with_method(Method::from(scenario.run.method));
    let settings = scenario.run.step.map_or(settings, |step| settings.with_step(step.0));
    let mut warnings: Vec<String> = Vec::new();
    for warning in builder.warnings {
        if !warnings.contains(&warning) {
            warnings.push(warning);
        }
    }
    let gaps = chain.interfaces().iter().map(|i| i.gap_m);
    if scenario.train.iter().any(|t| t.resistance.is_some())
        && gaps.fold(f64::INFINITY, f64::min) > 0.0
    {
        warnings.push(
            "resistance acts from the first contact on: the trains run up to it at the speeds given".into(),
        );
    }
    let limits = scenario.limits.clone();
    let limited = match &limits {
        Some(limits) => limited(scenario, &order, limits),
        None => Vec::new(),
    };
    let origin = Origin::new(path, scenario);
    Ok(Prepared { chain, settings, order, used, limits, limited, warnings, origin })
}

/// The bodies of the vehicles that limits hold for; `order` lists those of all trains, each vehicle
/// before its crush zones.
fn limited(scenario: &CheckedScenario<'_>, order: &[usize], limits: &LimitsTable) -> Vec<usize> {
    let mut bodies = order.iter();
    let mut limited = Vec::new();
    for train in &scenario.train {
        let counts = limits.trains.as_ref().is_none_or(|trains| trains.contains(&train.name));
        for vehicle in &train.vehicles {
            limited.extend(bodies.next().filter(|_| counts));
            for _zone in vehicle.front.iter().chain(&vehicle.rear) {
                bodies.next();
            }
        }
    }
    limited
}

/// Gives a chain put together by [`assemble`](super::assemble) the masses, speeds and gaps of `scenario`, which
/// differs from the one it was made of in nothing else; the force laws stay as they are. That
/// is right wherever no law depends on these: a model's curve does, on masses and speeds, and
/// on gaps too if it is sought for the interface's own speed.
///
/// # Errors
/// [`ScenarioError`] as of [`assemble`](super::assemble); the chain is then not to be run.
pub(crate) fn adjust(
    path: &Path,
    scenario: &CheckedScenario<'_>,
    prepared: &mut Prepared,
) -> Result<(), ScenarioError> {
    let Layout { bodies, slots, .. } = layout(scenario);
    let motions: Vec<(f64, f64)> = bodies.iter().map(|b| (b.mass_kg, b.speed_m_per_s)).collect();
    let own = |curve: &str| scenario.curves.get(curve).and_then(|c| c.gap).map_or(0.0, |g| g.0);
    let gaps: Vec<f64> =
        slots.iter().map(|slot| slot.gap_m.unwrap_or_else(|| own(slot.curve))).collect();
    let slacks: Vec<f64> = slots
        .iter()
        .map(|slot| scenario.curves.get(slot.curve).and_then(|c| c.tension.as_ref()))
        .map(|tension| tension.map_or(0.0, |curve| own(curve)))
        .collect();
    let adjusted = prepared.chain.adjust(&motions, &gaps, &slacks);
    adjusted.map_err(|source| no_chain(path, scenario, source))
}

fn no_chain(path: &Path, scenario: &CheckedScenario<'_>, source: ChainError) -> ScenarioError {
    ScenarioError::Chain { place: scenario.place(path, &scenario.chain_key(&source)), source }
}

/// A law that has been made, and for what.
#[derive(Clone)]
struct Made {
    curve: String,
    /// What decides it: role, speed and mass if a model gives it, whether vehicles are split.
    key: (bool, bool, bool, u64, u64),
    law: Arc<ForceLaw>,
    used: Used,
}

struct Builder<'a> {
    path: &'a Path,
    scenario: &'a CheckedScenario<'a>,
    sources: &'a Sources,
    made: Vec<Made>,
    warnings: Vec<String>,
}

impl Builder<'_> {
    fn failed(&self, source: AssemblyError) -> ScenarioError {
        let place = self.scenario.place(self.path, &place::assembly_key(&source));
        ScenarioError::Assembly { place, source: source.into() }
    }

    fn no_spring(&self, curve: &str, source: SpringError) -> ScenarioError {
        self.failed(AssemblyError::NoSpring { curve: curve.into(), source })
    }

    /// The law of a curve at a slot: made once for all slots that need the same.
    fn law(&mut self, slot: &Slot<'_>, curve: &str, speed: f64) -> Result<Made, ScenarioError> {
        let table = &self.scenario.curves[curve];
        let source = self.sources.curves.get(curve);
        let source =
            source.ok_or_else(|| self.failed(AssemblyError::NotRead { curve: curve.into() }))?;
        let is_model = matches!(source, CurveSource::Model(_));
        let of_model = |value: f64| if is_model { value.to_bits() } else { 0 };
        let key = (
            slot.role == Role::Wall,
            slot.role == Role::Within,
            slot.split,
            of_model(speed),
            of_model(slot.mass_kg),
        );
        if let Some(made) = self.made.iter().find(|m| m.curve == curve && m.key == key) {
            return Ok(made.clone());
        }
        let spring = spring(source, table, slot, speed).map_err(|e| match e {
            NoSpring::Spring(source) => self.no_spring(curve, source),
            NoSpring::Predict(source) => {
                let place = self.scenario.place(self.path, &place::predict_key(curve, &source));
                ScenarioError::Predict { place, curve: curve.into(), source }
            }
        })?;
        let expected = match slot.role {
            Role::Wall => Some(SpeedKind::Wall),
            Role::Noses | Role::Vehicles => Some(SpeedKind::Closing),
            Role::Within => None,
        };
        if let (Some(kind), Some(expected)) = (spring.curve.speed_kind, expected)
            && kind != expected
        {
            let (curve, interface) = (curve.into(), slot.name.clone());
            return Err(self.failed(AssemblyError::Speeds { curve, kind, interface, expected }));
        }
        let (law, of_law) = spring.law(table).map_err(|source| self.no_spring(curve, source))?;
        let used = Used {
            curve: curve.into(),
            force: spring.curve.force.map(|f| f.name()),
            speed_m_per_s: spring.curve.speed_m_per_s,
        };
        self.warnings.extend(
            spring.warnings.iter().chain(&of_law).map(|w| format!("curve \"{curve}\": {w}")),
        );
        let made = Made { curve: curve.into(), key, law: Arc::new(law), used };
        self.made.push(made.clone());
        Ok(made)
    }
}
