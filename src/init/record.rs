//! The histories of a run that the agreed recipe names, in the file's units.

use std::path::PathBuf;

use super::agree::{Agreed, ChosenForce};
use super::folders::Reason;
use super::sources::{Source, Sources, component, impulse, picked, rising, velocity};
use super::survey::{STOPPED, Survey, bracketed};
use crate::history::{EntityId, History};
use crate::solver::WantedId;
use crate::study::StudyKind;

/// A run that was looked over.
pub(super) struct Surveyed {
    pub path: PathBuf,
    pub name: String,
    pub sources: Sources,
    pub survey: Survey,
}

/// A run with the histories that the recipe names.
pub(super) struct Recorded {
    pub run: Surveyed,
    pub record: Record,
}

/// A force below this share of its largest is none.
const NO_FORCE: f64 = 0.01;
/// A flight after the contact that is shorter than this, in states and as a share of the record,
/// gives no mass.
const FREE: (usize, f64) = (5, 0.03);

/// What the recipe names of a run, up to the last time that motion and force share.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Record {
    pub time: Vec<f64>,
    /// Of the node, and of a pair the other node.
    pub velocities: Vec<Vec<f64>>,
    /// Displacement of the node, less the other node's.
    pub travel: Vec<f64>,
    /// Times and values, if the recipe has a contact force.
    pub force: Option<(Vec<f64>, Vec<f64>)>,
    /// Its impulse at the motion's times.
    pub impulse: Option<Vec<f64>>,
    /// Kinetic energy of the whole model in its first state, if a file states it.
    pub kinetic: Option<f64>,
    /// Damage of the files, for messages.
    pub damage: Vec<String>,
    /// The smaller number of states of its files.
    pub states: usize,
}

/// The two masses of an impact in the file's unit, the second of a pair only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RawMasses {
    pub body: f64,
    pub other: Option<f64>,
    /// Whether they are taken after the contact, where impulse and velocities rest.
    pub in_free_flight: bool,
}

impl Record {
    pub(super) fn read(sources: &Sources, agreed: &Agreed) -> Result<Self, Reason> {
        let bodies = if agreed.kind == StudyKind::Pair { 2 } else { 1 };
        if agreed.nodes.len() != bodies {
            let why = "no node moves with the body, or with one of the two".into();
            return Err(Reason::Unusable { why });
        }
        let motion = &sources.motion;
        let direction = agreed.direction;
        let ids = agreed.nodes.iter().map(|n| WantedId { id: n.id, side: None }).collect();
        let read = motion.read(Some(ids), &[direction.name(), direction.velocity()])?;
        let states = rising(&read.time);
        let mut damage = damage(motion, read.problems.first().map(ToString::to_string));
        let (mut velocities, mut travels) = (Vec::new(), Vec::new());
        for node in &agreed.nodes {
            let entity = Some(EntityId::new(node.id));
            let of: Vec<History> =
                read.histories.iter().filter(|h| h.entity == entity).cloned().collect();
            let lacks =
                |what: &str| Reason::Unusable { why: format!("node {} has no {what}", node.id) };
            velocities.push(
                velocity(&of, direction, &states).ok_or_else(|| lacks(direction.velocity()))?,
            );
            let travel = component(&of, direction.name()).ok_or_else(|| lacks(direction.name()))?;
            travels.push(picked(&travel.values, &states));
        }
        let travel = match &travels[..] {
            [node, other] => node.iter().zip(other).map(|(a, b)| a - b).collect(),
            _ => travels.swap_remove(0),
        };
        let mut record = Self {
            time: picked(&read.time, &states),
            velocities,
            travel,
            force: None,
            impulse: None,
            kinetic: sources.energy.as_ref().and_then(first_kinetic),
            states: read.time.len(),
            damage: Vec::new(),
        };
        if let Some(chosen) = &agreed.force {
            damage.extend(record.take_force(sources, chosen)?);
        }
        record.damage = damage;
        record.check()?;
        Ok(record)
    }

    /// Reads the force, and cuts the motion where the force ends; returns its damage.
    fn take_force(
        &mut self,
        sources: &Sources,
        chosen: &ChosenForce,
    ) -> Result<Vec<String>, Reason> {
        let unusable = |why: String| Reason::Unusable { why };
        let source = sources
            .force(chosen.file)
            .ok_or_else(|| unusable(format!("it has no {}", chosen.file)))?;
        let id = WantedId { id: chosen.id, side: chosen.side };
        let read = source.read(Some(vec![id]), &[&chosen.component])?;
        let history = read.histories.first().ok_or_else(|| {
            unusable(format!("{} has no {} of {id}", source.shown(), chosen.component))
        })?;
        let impulse = impulse(history, &self.time).ok_or_else(|| {
            unusable(format!(
                "{} of {} holds values that are not numbers",
                history.label(),
                source.shown()
            ))
        })?;
        let states = rising(&history.time);
        let time = picked(&history.time, &states);
        let last = time[time.len() - 1];
        // Printed times of two files differ in their last digits.
        let reach = last + 0.5 * (last - time[time.len() - 2]);
        let kept = self.time.iter().take_while(|&&t| t <= reach).count();
        self.time.truncate(kept);
        self.travel.truncate(kept);
        self.velocities.iter_mut().for_each(|v| v.truncate(kept));
        self.impulse = Some(impulse[..kept].to_vec());
        self.force = Some((time, picked(&history.values, &states)));
        self.states = self.states.min(history.time.len());
        Ok(damage(source, read.problems.first().map(ToString::to_string)))
    }

    /// Whether it can be judged at all.
    fn check(&self) -> Result<(), Reason> {
        let numbers = self.velocities.iter().flatten().chain(&self.travel);
        if numbers.into_iter().any(|v| !v.is_finite()) {
            let why = "the motion of its nodes holds values that are not numbers".into();
            return Err(Reason::Unusable { why });
        }
        if self.time.len() < 2 || self.closing(0) == 0.0 {
            let why = "the bodies do not move towards each other in its first state".into();
            return Err(Reason::Unusable { why });
        }
        Ok(())
    }

    /// Velocity of the node against the other body or the wall, in the file's direction.
    fn relative(&self, state: usize) -> f64 {
        match &self.velocities[..] {
            [node, other] => node[state] - other[state],
            _ => self.velocities[0][state],
        }
    }

    /// Closing speed: positive at first.
    pub(super) fn closing(&self, state: usize) -> f64 {
        self.relative(0).signum() * self.relative(state)
    }

    /// The first state in which the bodies do not close any more: the end of the loading.
    pub(super) fn loading_end(&self) -> Result<usize, f64> {
        let last = self.time.len() - 1;
        match (0..=last).find(|&i| self.closing(i) <= 0.0) {
            Some(end) => Ok(end),
            None if self.closing(last) < STOPPED * self.closing(0) => Ok(last),
            None => Err(self.closing(last) / self.closing(0)),
        }
    }

    /// The last state before the force reaches `NO_FORCE` of its largest; 0 without a force.
    pub(super) fn contact(&self) -> usize {
        let Some((time, force)) = &self.force else { return 0 };
        let least = NO_FORCE * force.iter().map(|f| f.abs()).fold(0.0, f64::max);
        let begins = force.iter().position(|f| f.abs() > least).map_or(0.0, |i| time[i]);
        self.time.partition_point(|&t| t < begins).saturating_sub(1)
    }

    /// Damage after a sentence.
    pub(super) fn damage(&self) -> String {
        bracketed(self.damage.first().map(String::as_str))
    }

    /// The bodies' masses by momentum, `∫F dt / Δv`: after the contact, where both rest; while
    /// it never ends, by all states of the loading together.
    pub(super) fn masses(&self) -> Option<RawMasses> {
        let impulse = self.impulse.as_ref()?;
        let end = self.loading_end().ok()?;
        let free = self.free_flight(end);
        let body = |velocity: &[f64]| {
            let change = |i: usize| velocity[i] - velocity[0];
            let (of, by) = match free {
                Some(from) => {
                    let states = from..self.time.len();
                    (
                        states.clone().map(|i| impulse[i]).sum::<f64>(),
                        states.map(change).sum::<f64>(),
                    )
                }
                None => (
                    (0..=end).map(|i| impulse[i] * change(i)).sum::<f64>(),
                    (0..=end).map(|i| change(i).powi(2)).sum::<f64>(),
                ),
            };
            Some((of / by).abs()).filter(|mass| mass.is_finite() && *mass > 0.0)
        };
        let other = match self.velocities.get(1) {
            Some(velocity) => Some(body(velocity)?),
            None => None,
        };
        Some(RawMasses { body: body(&self.velocities[0])?, other, in_free_flight: free.is_some() })
    }

    /// The first state after the contact from which no force acts, if that lasts.
    fn free_flight(&self, loading_end: usize) -> Option<usize> {
        let (time, force) = self.force.as_ref()?;
        let least = NO_FORCE * force.iter().map(|f| f.abs()).fold(0.0, f64::max);
        let last = force.iter().rposition(|f| f.abs() > least)?;
        let from = self.time.partition_point(|&t| t <= time[last]).max(loading_end + 1);
        let states = self.time.len().checked_sub(from)?;
        let share = states as f64 / self.time.len() as f64;
        (states >= FREE.0 && share >= FREE.1).then_some(from)
    }

    /// Mass of the other body over the first one's, by their changes of velocity while loading:
    /// no force is needed for that. `None` for one body.
    pub(super) fn mass_ratio(&self) -> Option<f64> {
        let [node, other] = &self.velocities[..] else { return None };
        let end = self.loading_end().ok()?;
        let changes = (0..=end).map(|i| (node[i] - node[0], other[i] - other[0]));
        let (of, by) = changes.fold((0.0, 0.0), |(of, by), (a, b)| (of - a * b, by + b * b));
        Some(of / by).filter(|ratio| ratio.is_finite() && *ratio > 0.0)
    }

    /// The masses by the kinetic energy of the first state, if all that moves is the bodies: that
    /// of two bodies is shared by the ratio of their changes of velocity.
    pub(super) fn masses_by_energy(&self) -> Option<RawMasses> {
        let kinetic = self.kinetic.filter(|k| *k > 0.0)?;
        let first = |k: usize| self.velocities[k][0];
        let ratio = match self.velocities.len() {
            2 => self.mass_ratio()?,
            _ => 0.0,
        };
        let squares = first(0).powi(2) + if ratio > 0.0 { ratio * first(1).powi(2) } else { 0.0 };
        let body = Some(2.0 * kinetic / squares).filter(|mass| mass.is_finite())?;
        let other = (ratio > 0.0).then_some(ratio * body);
        Some(RawMasses { body, other, in_free_flight: false })
    }
}

/// The first damage of a source, found when it was listed or when it was read.
fn damage(source: &Source, read: Option<String>) -> Vec<String> {
    let found = read.or_else(|| source.damage.clone());
    found.map(|problem| format!("{}: {problem}", source.shown())).into_iter().collect()
}

/// Kinetic energy of the first state.
fn first_kinetic(energy: &Source) -> Option<f64> {
    let read = energy.read(None, &["kinetic_energy"]).ok()?;
    read.history(None, "kinetic_energy")?.values.first().copied().filter(|k| k.is_finite())
}
