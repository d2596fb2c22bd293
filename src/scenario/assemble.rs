//! Assembly: bodies, interfaces and their laws become a chain, for given speeds.

use std::collections::HashMap;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use super::layout::{Connection, ConnectionKind, End, Layout, Role, layout};
use super::place::{self, Origin};
use super::spring::{Crush, Spring, crush_between, crush_end, plates, scale_error, spring};
use super::{
    CheckedScenario, CurveInUse, CurveSource, CurveTable, LawName, LimitsTable, Prepared, Sources,
    TrainTable,
};
use crate::curve::Masses;
use crate::error::{Error, ErrorCode, KeyPath, error};
use crate::multibody::{Chain, Damping, EnvelopeEnd, ForceLaw, Interface, RunSettings, Tension};
use crate::surrogate::Model;
use crate::unit::{Shown, SpeedKind, km_per_h};

/// Puts a scenario together with what its files hold, with curves for given speeds of the
/// interfaces, in the order of the chain; `path` is for messages.
pub(super) fn assemble_at(
    path: &Path,
    scenario: &CheckedScenario<'_>,
    sources: &Sources,
    speeds_m_per_s: &[f64],
) -> Result<Prepared, Error> {
    let layout = layout(scenario);
    let (slots, bodies) = (&layout.slots, &layout.bodies);
    let (of_files, of_one, warnings) = (LawCache::default(), Vec::new(), Vec::new());
    let mut builder = Builder { path, scenario, sources, of_files, of_one, warnings };
    let (mut interfaces, mut used) = (Vec::new(), Vec::new());
    for (k, (slot, &speed)) in slots.iter().zip(speeds_m_per_s).enumerate() {
        let (interface, of_curve) = match &slot.joint {
            ConnectionKind::Curve(curve) if scenario.curves[*curve].law == LawName::Rate => {
                let ahead = (k + 1 < bodies.len()).then_some(k + 1);
                builder.with_rate(slot, curve, (k, ahead), speed)?
            }
            ConnectionKind::Curve(curve) => builder.interface(slot, curve, speed)?,
            ConnectionKind::End(end) => builder.end(slot, end, speed)?,
            ConnectionKind::Plates => builder.plates(slot)?,
        };
        interfaces.push(interface);
        used.push(of_curve);
    }
    let chain = Chain::new(bodies.clone(), interfaces)
        .map_err(|error| no_chain(path, scenario, &layout, error))?;
    let speed_m_per_s = scenario.meeting_m_per_s;
    let of_one = builder.of_one;
    let of_impact = of_one.iter().flat_map(|of| of.warnings(slots, speed_m_per_s));
    let of_impact: Vec<String> = of_impact.collect();
    let is_meeting = |slot: &Connection<'_>| matches!(slot.role, Role::Wall | Role::Noses);
    let meeting = slots.iter().position(is_meeting).unwrap_or_default();
    let Layout { order, vehicles, .. } = layout;
    let settings = RunSettings::new(scenario.run.duration.0, scenario.run.output_interval.0)
        .with_method(scenario.run.method);
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
            "resistance acts from the first contact on: until then the trains move at the given speeds".into(),
        );
    }
    warnings.extend(scenario.train.iter().filter_map(without_use));
    warnings.extend(scenario.train.iter().filter_map(brakes_too_hard));
    let limits = scenario.limits.clone();
    let limited = match &limits {
        Some(limits) => limited(scenario, &vehicles, limits),
        None => Vec::new(),
    };
    let origin = Origin::new(path, scenario);
    let lasting = warnings.len();
    warnings.extend(of_impact);
    let of_one = (of_one, lasting);
    Ok(Prepared {
        chain,
        settings,
        order,
        used,
        vehicles,
        meeting,
        limits,
        limited,
        warnings,
        of_one,
        origin,
    })
}

/// Friction of wheels on dry rails is lower.
const MOST_BRAKING: f64 = 0.5;

/// Brakes that no rail holds: a percentage, most likely.
fn brakes_too_hard(train: &TrainTable) -> Option<String> {
    let braking = train.resistance?.braking;
    (braking > MOST_BRAKING).then(|| {
        format!(
            "train \"{}\": braking = {braking} is a friction coefficient beyond that of wheels on rails, of 0.15 to 0.4: for 15 % write 0.15",
            train.name
        )
    })
}

/// What a train says of interfaces that it does not have.
fn without_use(train: &TrainTable) -> Option<String> {
    let last = train.vehicles.last()?;
    let is_alone = train.vehicles.len() == 1;
    let keys = [
        ("inner", is_alone && train.inner.is_some()),
        ("gap", is_alone && train.gap.is_some()),
        ("the gap of its last vehicle", last.gap.is_some()),
    ];
    let keys: Vec<&str> = keys.into_iter().filter(|(_, given)| *given).map(|(k, _)| k).collect();
    (!keys.is_empty()).then(|| {
        format!(
            "train \"{}\": {} not used, because nothing is behind \"{}\"; the distance to what it hits is [contact] gap",
            train.name,
            if keys.len() == 1 { format!("{} is", keys[0]) } else { format!("{} are", keys.join(" and ")) },
            last.name
        )
    })
}

/// The bodies of the vehicles that limits hold for; `vehicles` lists those of all trains.
fn limited(scenario: &CheckedScenario<'_>, vehicles: &[usize], limits: &LimitsTable) -> Vec<usize> {
    let counts = |train: &str| limits.trains.as_ref().is_none_or(|t| t.iter().any(|t| t == train));
    let trains = scenario.train.iter().flat_map(|t| t.vehicles.iter().map(|_| t.name.as_str()));
    trains.zip(vehicles).filter(|(train, _)| counts(train)).map(|(_, body)| *body).collect()
}

/// Gives a chain put together by [`assemble`](super::assemble) the masses, speeds and gaps of `scenario`, which
/// differs from the one it was made of in nothing else; the force laws stay as they are. That
/// is right wherever no law depends on these: a model's curve does, on masses and speeds, and
/// on gaps too if it is sought for the interface's own speed.
pub(crate) fn adjust(
    path: &Path,
    scenario: &CheckedScenario<'_>,
    prepared: &mut Prepared,
) -> Result<(), Error> {
    let layout = layout(scenario);
    let Layout { bodies, slots, .. } = &layout;
    let motions: Vec<(f64, f64)> = bodies.iter().map(|b| (b.mass_kg, b.speed_m_per_s)).collect();
    let own = |curve: &str| scenario.curves.get(curve).and_then(|c| c.gap).map_or(0.0, |g| g.0);
    let gaps: Vec<f64> = slots
        .iter()
        .map(|slot| slot.gap_m.or(slot.joint.curve().map(own)).unwrap_or(0.0))
        .collect();
    let slacks: Vec<f64> = slots
        .iter()
        .map(|slot| scenario.curves.get(slot.joint.curve()?).and_then(|c| c.tension.as_ref()))
        .map(|tension| tension.map_or(0.0, |curve| own(curve)))
        .collect();
    let (of_one, lasting) = &prepared.of_one;
    let meeting = scenario.meeting_m_per_s;
    prepared.warnings.truncate(*lasting);
    prepared.warnings.extend(of_one.iter().flat_map(|of_one| of_one.warnings(slots, meeting)));
    let adjusted = prepared.chain.adjust(&motions, &gaps, &slacks);
    adjusted.map_err(|error| no_chain(path, scenario, &layout, error))
}

fn no_chain(
    path: &Path,
    scenario: &CheckedScenario<'_>,
    layout: &Layout<'_>,
    error: Error,
) -> Error {
    let place = |key: &KeyPath| scenario.place(path, &scenario.chain_key(key, layout));
    error.coded(ErrorCode::Scenario).placed(place)
}

/// Share by which the speed or mass of a recorded curve may differ from those of the impact unsaid: peaks
/// of neighbouring runs differ by some per cent.
const SAME_RUN: f64 = 0.05;

/// A curve that is of one impact, and the first interface that it drives.
#[derive(Clone, Debug)]
pub(super) struct OfOneImpact {
    pub curve: String,
    interface: String,
    /// Whether the trains meet there; elsewhere bodies close as the run has it.
    is_meeting: bool,
    speed_m_per_s: Option<f64>,
    mass_kg: Option<f64>,
}

impl OfOneImpact {
    fn new(curve: &str, slot: &Connection<'_>, spring: &Spring, source: &CurveSource) -> Self {
        let mass_kg = match source {
            CurveSource::Case(case) => Some(case.conditions.masses.equal_kg()),
            CurveSource::Predicted(curve) => {
                let other_kg = curve.other_mass_kg();
                Some(Masses { body_kg: curve.mass_kg, other_kg }.equal_kg())
            }
            _ => None,
        };
        let speed_m_per_s = spring.curve.speed_m_per_s;
        let is_meeting = matches!(slot.role, Role::Wall | Role::Noses);
        let (curve, interface) = (curve.into(), slot.name.clone());
        Self { curve, interface, is_meeting, speed_m_per_s, mass_kg }
    }

    /// Warns if it is of another speed or mass than the impact it drives, as a model does that is used
    /// outside its range.
    fn warnings(&self, slots: &[Connection<'_>], meeting_m_per_s: f64) -> Vec<String> {
        let differs = |a: f64, b: f64| (a / b - 1.0).abs() > SAME_RUN;
        let Self { curve, interface, .. } = self;
        let mut warnings = Vec::new();
        if !self.is_meeting {
            return warnings;
        }
        if let Some(own) = self.speed_m_per_s.filter(|own| differs(*own, meeting_m_per_s)) {
            warnings.push(format!(
                "curve \"{curve}\": it is for {}, but {interface} closes at {}: forces depend on the impact speed; give the curve of this speed, or a model (crumple train)",
                km_per_h(own),
                km_per_h(meeting_m_per_s)
            ));
        }
        let now_kg =
            slots.iter().find(|slot| slot.name == *interface).map(|slot| slot.masses.equal_kg());
        let masses = self.mass_kg.zip(now_kg).filter(|(own_kg, now_kg)| differs(*own_kg, *now_kg));
        if let Some((own_kg, now_kg)) = masses {
            let shown = Shown::mass(own_kg.max(now_kg));
            warnings.push(format!(
                "curve \"{curve}\": it is for {}, but {interface} moves {}: give the curve of this mass, or a model (crumple train)",
                shown.text(own_kg),
                shown.text(now_kg)
            ));
        }
        warnings
    }
}

/// What results name as the curve where plates meet.
pub(crate) const PLATES: &str = "plates";

/// A law that has been made, and what it said.
#[derive(Clone, Debug)]
struct CachedLaw {
    law: Arc<ForceLaw>,
    used: CurveInUse,
    warnings: Vec<String>,
}

/// What decides a law: its curve; role, and whether vehicles are split; speed and mass if a model gives it.
type LawKey = (String, (u8, bool, [u64; 3]));

/// Laws of models, with the table that each was made for, so that a sweep, whose interfaces close at few different speeds,
/// makes each once.
#[derive(Debug, Default)]
pub(super) struct LawCache(Mutex<HashMap<LawKey, (CurveTable, CachedLaw)>>);

/// Laws that are kept: one of a model takes about 70 kB, so all take up to 35 MB.
const MOST_LAWS: usize = 500;

impl LawCache {
    fn get(&self, key: &LawKey, table: &CurveTable) -> Option<CachedLaw> {
        let laws = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        laws.get(key).filter(|(of, _)| of == table).map(|(_, law)| law.clone())
    }

    fn put(&self, key: LawKey, table: CurveTable, law: CachedLaw) {
        let mut laws = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if laws.len() >= MOST_LAWS {
            laws.clear();
        }
        laws.insert(key, (table, law));
    }
}

struct Builder<'a> {
    path: &'a Path,
    scenario: &'a CheckedScenario<'a>,
    sources: &'a Sources,
    of_files: LawCache,
    of_one: Vec<OfOneImpact>,
    warnings: Vec<String>,
}

impl<'a> Builder<'a> {
    /// Puts an error at the place of its key.
    fn failed(&self, error: Error) -> Error {
        error.placed(|key| self.scenario.place(self.path, key))
    }

    /// Puts an error at the place of its key in the table of a curve.
    fn no_spring(&self, curve: &str, error: Error) -> Error {
        self.failed(error.of(format_args!("curve \"{curve}\"")).inside(place::curve(curve)))
    }

    fn not_read(&self, curve: &str) -> Error {
        let error = error!(Scenario, "curve \"{curve}\" has not been read");
        self.failed(error.at(place::curve(curve)))
    }

    /// An interface whose law is a curve of the scenario.
    fn interface(
        &mut self,
        slot: &Connection<'_>,
        curve: &str,
        speed: f64,
    ) -> Result<(Interface, CurveInUse), Error> {
        let made = self.law(slot, curve, speed)?;
        let table = &self.scenario.curves[curve];
        let gap_m = slot.gap_m.or(table.gap.map(|g| g.0)).unwrap_or(0.0);
        let mut interface = Interface::new(slot.name.clone(), made.law, gap_m);
        if let Some(name) = &table.tension {
            if matches!(slot.role, Role::Wall | Role::Noses) {
                self.warnings.push(format!(
                    "curve \"{curve}\": its tension acts at the first contact {}, too, and pulls what rebounds, as couplers that have engaged do; if nothing engages, name a curve without tension in [contact]",
                    slot.name
                ));
            }
            let slack_m = self.scenario.curves[name].gap.map_or(0.0, |g| g.0);
            interface.tension = Some(Tension { law: self.law(slot, name, speed)?.law, slack_m });
        }
        if let Some(damping) = &table.damping {
            let points = (damping.speed_m_per_s.clone(), damping.coefficient_n_s_per_m.clone());
            let damping = Damping::new(points.0, points.1).map_err(|error| {
                self.no_spring(curve, error.coded(ErrorCode::Scenario).at_key("damping"))
            })?;
            interface.damping = Some(damping);
        }
        Ok((interface, made.used))
    }

    /// The crush zone of a vehicle whose end comes from a model.
    fn end(
        &mut self,
        slot: &Connection<'_>,
        end: &End<'_>,
        speed: f64,
    ) -> Result<(Interface, CurveInUse), Error> {
        let (model, scale) = self.model(end.curve)?;
        let crush = crush_end(model, end, slot.masses.equal_kg(), speed, scale)
            .map_err(|source| self.no_spring(end.curve, source))?;
        let (stopping, (interface, used)) =
            (crush.stopping.clone(), self.crushed(slot, end.curve, crush)?);
        Ok((Interface { stopping, ..interface }, used))
    }

    /// An interface between single-mass vehicles whose crush force follows the run's own speeds;
    /// `sides` are the bodies behind and ahead.
    fn with_rate(
        &mut self,
        slot: &Connection<'_>,
        curve: &str,
        sides: (usize, Option<usize>),
        speed: f64,
    ) -> Result<(Interface, CurveInUse), Error> {
        let (model, scale) = self.model(curve)?;
        self.check_kind(slot, curve, Some(model.speed_kind))?;
        let crush = crush_between(model, slot, sides, speed, scale)
            .map_err(|source| self.no_spring(curve, source))?;
        let (interface, used) = self.crushed(slot, curve, crush)?;
        let own_m = self.scenario.curves[curve].gap.map(|g| g.0);
        Ok((Interface { gap_m: slot.gap_m.or(own_m).unwrap_or(0.0), ..interface }, used))
    }

    /// The model of a curve, and the factor on its forces.
    fn model(&self, curve: &str) -> Result<(&'a Model, f64), Error> {
        let Some(CurveSource::Model(model)) = self.sources.curves.get(curve) else {
            return Err(self.not_read(curve));
        };
        let factor = self.scenario.curves[curve].scale.unwrap_or(1.0);
        if factor > 0.0 && factor.is_finite() {
            Ok((model, factor))
        } else {
            Err(self.no_spring(curve, scale_error(factor)))
        }
    }

    /// The interface of a crush force.
    fn crushed(
        &mut self,
        slot: &Connection<'_>,
        curve: &str,
        crush: Crush,
    ) -> Result<(Interface, CurveInUse), Error> {
        let table = &self.scenario.curves[curve];
        let spring = |source| self.no_spring(curve, source);
        let (law, of_law) =
            Spring { curve: crush.curve, end: EnvelopeEnd::Bottom, warnings: crush.warnings }
                .continued(table)
                .and_then(|spring| spring.law_with_warnings(table))
                .map_err(spring)?;
        self.warnings.extend(of_law.iter().map(|w| format!("curve \"{curve}\": {w}")));
        let interface = Interface::new(slot.name.clone(), law, 0.0).with_rate(crush.rate);
        let used = CurveInUse {
            curve: curve.into(),
            force: Some("crush"),
            speed_m_per_s: Some(crush.speed_m_per_s),
            ..CurveInUse::default()
        };
        Ok((interface, used))
    }

    /// Fails if a curve of one kind of speed stands where the other is meant.
    fn check_kind(
        &self,
        slot: &Connection<'_>,
        curve: &str,
        kind: Option<SpeedKind>,
    ) -> Result<(), Error> {
        let expected = match slot.role {
            Role::Wall => Some(SpeedKind::Wall),
            Role::Noses | Role::Vehicles => Some(SpeedKind::Closing),
            Role::Within => None,
        };
        let (Some(kind), Some(expected)) = (kind, expected) else { return Ok(()) };
        if kind == expected {
            return Ok(());
        }
        let way_out = match kind {
            SpeedKind::Wall => {
                ": train a model on the wall runs and let it be the vehicles' ends (ends, or front and rear), or, if the wall was the plane of symmetry of two vehicles, build the study with half_model = true"
            }
            SpeedKind::Closing => "",
        };
        let (kind, expected, interface) = (kind.name(), expected.name(), &slot.name);
        let error = error!(
            Scenario,
            "curve \"{curve}\" was measured at {kind} speeds, but interface {interface} needs one of {expected} speeds{way_out}"
        );
        Err(self.failed(error.at(place::curve(curve))))
    }

    /// Where the plates of two ends meet.
    fn plates(&mut self, slot: &Connection<'_>) -> Result<(Interface, CurveInUse), Error> {
        let interface = plates(&slot.name, slot.gap_m.unwrap_or(0.0)).map_err(|error| {
            self.failed(error.of("between two plates").at(KeyPath::of("contact")))
        })?;
        Ok((
            interface,
            CurveInUse { curve: PLATES.into(), force: Some("contact"), ..CurveInUse::default() },
        ))
    }

    /// The law of a curve at a slot: made once for all slots that need the same.
    fn law(&mut self, slot: &Connection<'_>, curve: &str, speed: f64) -> Result<CachedLaw, Error> {
        let table = &self.scenario.curves[curve];
        let source = self.sources.curves.get(curve);
        let source = source.ok_or_else(|| self.not_read(curve))?;
        let (is_model, needs) = match source {
            CurveSource::Model(model) => {
                let masses = model.masses_as_trained(slot.masses);
                (true, [speed, masses.body_kg, masses.other_kg.unwrap_or(0.0)].map(f64::to_bits))
            }
            _ => (false, [0; 3]),
        };
        let key = (curve.to_string(), (slot.role as u8, slot.split, needs));
        // What belongs to the interface and not to its law.
        let of_law = CurveTable { gap: None, tension: None, damping: None, ..table.clone() };
        let laws = if is_model { &self.sources.laws } else { &self.of_files };
        let made = match laws.get(&key, &of_law) {
            Some(made) => made,
            None => {
                let made = self.make_law(slot, curve, speed)?;
                let laws = if is_model { &self.sources.laws } else { &self.of_files };
                laws.put(key, of_law, made.clone());
                made
            }
        };
        self.warnings.extend(made.warnings.iter().cloned());
        Ok(made)
    }

    fn make_law(
        &mut self,
        slot: &Connection<'_>,
        curve: &str,
        speed: f64,
    ) -> Result<CachedLaw, Error> {
        let (table, source) = (&self.scenario.curves[curve], &self.sources.curves[curve]);
        if let CurveSource::Model(model) = source {
            self.check_kind(slot, curve, Some(model.speed_kind))?;
        }
        let spring =
            spring(source, table, slot, speed).map_err(|error| self.no_spring(curve, error))?;
        self.check_kind(slot, curve, spring.curve.speed_kind)?;
        let speed_m_per_s = spring.curve.speed_m_per_s;
        let is_model = matches!(source, CurveSource::Model(_));
        if !is_model {
            self.of_one.push(OfOneImpact::new(curve, slot, &spring, source));
        }
        let force = spring.curve.kind.map(super::super::curve::ForceKind::name);
        let (law, said) =
            spring.law_with_warnings(table).map_err(|source| self.no_spring(curve, source))?;
        let stages = table.stage_begins().into();
        let used = CurveInUse { curve: curve.into(), force, speed_m_per_s, stages };
        let warnings = said.iter().map(|w| format!("curve \"{curve}\": {w}")).collect();
        Ok(CachedLaw { law: Arc::new(law), used, warnings })
    }
}
