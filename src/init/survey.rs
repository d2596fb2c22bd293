//! Survey of a run: in which direction it moves, which bodies it has, which nodes could represent
//! them, and which forces could have moved them.
//!
//! A node represents a body if its velocity follows the impulse of the force, `∫F dt = m Δv`: nodes
//! in the crush zone are stopped first and then vibrate, and nodes outside the body do not
//! follow at all. A force is the one between two bodies if some node follows it; a contact within
//! a body is followed as well, but has a smaller impulse than what acts on the body from outside.

use std::collections::HashMap;

use super::folders::Reason;
use super::sources::{
    FORCES, Fit, Source, Sources, by_entity, component, impulse, largest, picked, rising, velocity,
};
use crate::curve::recipe::DisplacementComponent;
use crate::history::{EntityId, History, Side};
use crate::solver::{SolverFile, WantedId};

/// Bodies that still close at more than this share of their first speed have not been stopped.
pub(super) const STOPPED: f64 = 0.05;

/// Minimum number of states of a record that can be judged.
const FEWEST_STATES: usize = 8;
/// First velocities that differ by less than this share of the largest belong to one body; a
/// change smaller than this share is none.
const SAME_VELOCITY: f64 = 0.05;
/// A first speed below this share of the largest of the record is none.
const STANDS: f64 = 0.02;
/// Forces of a run that are kept, those with the largest impulse.
const KEPT_FORCES: usize = 12;
/// A wall's normal force is taken if its impulse differs from that along the motion by less.
const SAME_IMPULSE: f64 = 0.02;

/// What a run has to choose from.
#[derive(Clone, Debug)]
pub(super) struct Survey {
    pub direction: DisplacementComponent,
    /// Speed along it as a share of the speed: 1 if the bodies move along an axis.
    pub aligned: f64,
    /// By their first speed, the fastest first.
    pub bodies: Vec<Body>,
    /// The largest impulse first.
    pub forces: Vec<ForceCandidate>,
}

/// Nodes that start with one velocity.
#[derive(Clone, Debug)]
pub(super) struct Body {
    /// In the file's units, with its sign.
    pub first_velocity: f64,
    pub nodes: Vec<NodeCandidate>,
    /// Change of its smoothest node's velocity over time: how the body moves if no force shows
    /// which node represents it.
    pub change: Vec<f64>,
}

/// A node and how well it follows each force.
#[derive(Clone, Debug)]
pub(super) struct NodeCandidate {
    pub id: i64,
    pub title: Option<String>,
    /// Way of its velocity up and down over its range: 1 if it only falls.
    pub roughness: f64,
    /// One for each of the survey's forces.
    pub fits: Vec<Fit>,
}

/// A wall, an interface or a section, with its force along the motion.
#[derive(Clone, Debug)]
pub(super) struct ForceCandidate {
    pub file: &'static str,
    pub id: i64,
    /// `None` where it has no sides, or is one side only without saying which.
    pub side: Option<Side>,
    /// Whether the other side has the same force.
    pub other_side: bool,
    pub component: &'static str,
    pub title: Option<String>,
    /// Over the motion's times, in the file's units.
    pub impulse: Vec<f64>,
    /// States of the motion that its record covers.
    pub covers: usize,
}

/// A node as it starts.
struct Start {
    id: i64,
    title: Option<String>,
    first: [f64; 3],
    /// Largest change of each velocity.
    change: [f64; 3],
}

impl Survey {
    /// Looks over a run. A recipe's force may be named, which is then kept however small it is.
    pub(super) fn of(sources: &Sources, named: Option<(&str, i64)>) -> Result<Self, Reason> {
        let source = &sources.motion;
        let components = if source.has("x_velocity") {
            DisplacementComponent::ALL.map(DisplacementComponent::velocity)
        } else {
            DisplacementComponent::ALL.map(DisplacementComponent::name)
        };
        let mut nodes = HistoryBatches::new(source, components.to_vec());
        let (starts, time) = starts(&mut nodes, source)?;
        if time.len() < FEWEST_STATES {
            return Err(few_states(source, time.len()));
        }
        let (direction, aligned) = direction(&starts)?;
        let mut forces = Vec::new();
        for source in &sources.forces {
            forces.extend(force_candidates(source, direction, &time, named)?);
        }
        let size = |force: &ForceCandidate| force.impulse[largest(&force.impulse)].abs();
        forces.sort_by(|a, b| size(b).total_cmp(&size(a)).then(rank(a).cmp(&rank(b))));
        let is_named = |f: &ForceCandidate| named == Some((f.file, f.id));
        let mut kept = 0;
        forces.retain(|force| {
            kept += 1;
            kept <= KEPT_FORCES || is_named(force)
        });
        let mut bodies = bodies(&starts, direction);
        judge(&mut nodes, &mut bodies, &forces, direction)?;
        Ok(Self { direction, aligned, bodies, forces })
    }

    pub(super) fn force(&self, file: &str, id: i64) -> Option<usize> {
        self.forces.iter().position(|f| f.file == file && f.id == id)
    }
}

fn few_states(source: &Source, states: usize) -> Reason {
    let damage = bracketed(source.damage.as_deref());
    Reason::FewStates { file: source.shown(), states, damage }
}

/// Damage after a sentence.
pub(super) fn bracketed(damage: Option<&str>) -> String {
    damage.map_or(String::new(), |damage| format!(" ({damage})"))
}

/// Place of a force among those of equal size.
fn rank(force: &ForceCandidate) -> (usize, i64) {
    let kind = FORCES.iter().position(|name| *name == force.file);
    (kind.unwrap_or(FORCES.len()), force.id)
}

/// How each node starts, and the times that rise.
fn starts(
    nodes: &mut HistoryBatches<'_>,
    source: &Source,
) -> Result<(Vec<Start>, Vec<f64>), Reason> {
    let titles: HashMap<EntityId, &Option<String>> =
        source.entities.iter().map(|entity| (entity.id, &entity.title)).collect();
    let (mut starts, mut times) = (Vec::new(), Vec::new());
    nodes.each(&mut |piece| {
        let states = rising(&piece.time);
        times = picked(&piece.time, &states);
        if states.len() < 2 {
            return;
        }
        for node in by_entity(&piece.histories) {
            let Some(entity) = node[0].entity else { continue };
            let title = titles.get(&entity).and_then(|title| (*title).clone());
            starts.extend(start(entity.id, title, node, &states));
        }
    })?;
    Ok((starts, times))
}

/// `None` for a node without velocities, or with one that is not a number: it did not live long.
fn start(id: i64, title: Option<String>, node: &[History], states: &[usize]) -> Option<Start> {
    let (mut first, mut change) = ([0.0; 3], [0.0_f64; 3]);
    for (k, direction) in DisplacementComponent::ALL.into_iter().enumerate() {
        let velocity = velocity(node, direction, states)?;
        if velocity.iter().any(|v| !v.is_finite()) {
            return None;
        }
        first[k] = velocity[0];
        change[k] = velocity.iter().map(|v| (v - velocity[0]).abs()).fold(0.0, f64::max);
    }
    Some(Start { id, title, first, change })
}

/// The axis along which the bodies start, and how much of their speed lies along it.
fn direction(starts: &[Start]) -> Result<(DisplacementComponent, f64), Reason> {
    let speed = |s: &Start| s.first.iter().map(|v| v * v).sum::<f64>().sqrt();
    let fastest = starts.iter().map(speed).fold(0.0, f64::max);
    let changes = starts.iter().flat_map(|s| s.change);
    if !(fastest > STANDS * changes.fold(0.0, f64::max) && fastest > 0.0) {
        return Err(Reason::Stands);
    }
    let moving = || starts.iter().filter(|s| speed(s) > 0.5 * fastest);
    let along = |k: usize| moving().map(|s| s.first[k].abs()).sum::<f64>();
    let k = (0..3).fold(0, |best, k| if along(k) > along(best) { k } else { best });
    Ok((DisplacementComponent::ALL[k], along(k) / moving().map(speed).sum::<f64>()))
}

/// Nodes that start alike, without those that start at rest and stay there.
fn bodies(starts: &[Start], direction: DisplacementComponent) -> Vec<Body> {
    let k = DisplacementComponent::ALL.iter().position(|d| *d == direction).unwrap_or(0);
    let fastest = starts.iter().map(|s| s.first[k].abs()).fold(0.0, f64::max);
    let least = SAME_VELOCITY * fastest;
    let moves = |s: &&Start| s.first[k].abs() > least || s.change[k] > least;
    let mut moving: Vec<&Start> = starts.iter().filter(moves).collect();
    moving.sort_by(|a, b| a.first[k].total_cmp(&b.first[k]).then(a.id.cmp(&b.id)));
    let groups = moving.chunk_by(|a, b| b.first[k] - a.first[k] <= least);
    let mut bodies: Vec<Body> = groups
        .map(|group| Body {
            first_velocity: group[group.len() / 2].first[k],
            nodes: group
                .iter()
                .map(|s| NodeCandidate {
                    id: s.id,
                    title: s.title.clone(),
                    roughness: f64::INFINITY,
                    fits: Vec::new(),
                })
                .collect(),
            change: Vec::new(),
        })
        .collect();
    // Of two that come at each other equally fast, the one with the smaller number.
    let least_id = |body: &Body| body.nodes.iter().map(|n| n.id).min();
    let speed = |body: &Body| (body.first_velocity / least).round().abs();
    bodies
        .sort_by(|a, b| speed(b).total_cmp(&speed(a)).then_with(|| least_id(a).cmp(&least_id(b))));
    bodies
}

/// The forces of a source along the motion.
fn force_candidates(
    source: &Source,
    direction: DisplacementComponent,
    time: &[f64],
    named: Option<(&str, i64)>,
) -> Result<Vec<ForceCandidate>, Reason> {
    let mut components = vec![direction.force()];
    if source.has("normal_force") {
        components.push("normal_force");
    }
    let titles: HashMap<EntityId, &Option<String>> =
        source.entities.iter().map(|entity| (entity.id, &entity.title)).collect();
    let mut found: Vec<ForceCandidate> = Vec::new();
    HistoryBatches::new(source, components).each(&mut |piece| {
        for of in by_entity(&piece.histories) {
            let Some(entity) = of[0].entity else { continue };
            let Some((component, impulse)) = along(of, direction, time) else { continue };
            let last = of[0].time.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let title = titles.get(&entity).and_then(|title| (*title).clone());
            let candidate = ForceCandidate {
                file: source.name,
                id: entity.id,
                side: entity.side,
                other_side: false,
                component,
                title,
                impulse,
                covers: time.partition_point(|&t| t <= last),
            };
            add(&mut found, candidate);
        }
        shorten(&mut found, named);
    })?;
    Ok(found)
}

/// Keeps the forces with the largest impulses, so that thousands of contacts are not held.
fn shorten(found: &mut Vec<ForceCandidate>, named: Option<(&str, i64)>) {
    let size = |force: &ForceCandidate| force.impulse[largest(&force.impulse)].abs();
    found.sort_by(|a, b| size(b).total_cmp(&size(a)).then(rank(a).cmp(&rank(b))));
    let mut kept = 0;
    found.retain(|force| {
        kept += 1;
        kept <= KEPT_FORCES || named == Some((force.file, force.id))
    });
}

/// The component to take and its impulse: a wall's normal force where it acts along the motion.
fn along(
    of: &[History],
    direction: DisplacementComponent,
    time: &[f64],
) -> Option<(&'static str, Vec<f64>)> {
    let force = impulse(component(of, direction.force())?, time)?;
    let at = largest(&force);
    if force.get(at).is_none_or(|j| *j == 0.0) {
        return None;
    }
    let normal = component(of, "normal_force").and_then(|normal| impulse(normal, time));
    let is_same =
        |normal: &Vec<f64>| (normal[at].abs() / force[at].abs() - 1.0).abs() < SAME_IMPULSE;
    match normal.filter(is_same) {
        // Some versions print it without the sign that the body's motion needs here.
        Some(_) => Some(("normal_force", force)),
        None => Some((direction.force(), force)),
    }
}

/// Adds a force; of an interface's two sides the one with the larger impulse counts, the first if
/// they are equal.
fn add(found: &mut Vec<ForceCandidate>, candidate: ForceCandidate) {
    let Some(known) = found.iter_mut().find(|f| f.id == candidate.id) else {
        found.push(candidate);
        return;
    };
    let at = largest(&known.impulse);
    let ratio = candidate.impulse[at].abs() / known.impulse[at].abs();
    if (ratio - 1.0).abs() < SAME_IMPULSE {
        known.other_side = true;
        if candidate.side < known.side {
            *known = ForceCandidate { other_side: true, ..candidate };
        }
    } else if ratio > 1.0 {
        *known = candidate;
    }
}

/// How well each node of the bodies follows each force, and how each body moves.
fn judge(
    nodes: &mut HistoryBatches<'_>,
    bodies: &mut [Body],
    forces: &[ForceCandidate],
    direction: DisplacementComponent,
) -> Result<(), Reason> {
    let ends: Vec<usize> = forces.iter().map(|f| largest(&f.impulse)).collect();
    let mut smoothest = vec![(f64::INFINITY, Vec::new()); bodies.len()];
    let mut candidates: HashMap<i64, (usize, &mut NodeCandidate)> = HashMap::new();
    for (k, body) in bodies.iter_mut().enumerate() {
        candidates.extend(body.nodes.iter_mut().map(|node| (node.id, (k, node))));
    }
    nodes.each(&mut |piece| {
        let states = rising(&piece.time);
        for node in by_entity(&piece.histories) {
            let candidate = node[0].entity.and_then(|entity| candidates.get_mut(&entity.id));
            let (Some((body, candidate)), Some(velocity)) =
                (candidate, velocity(node, direction, &states))
            else {
                continue;
            };
            let change: Vec<f64> = velocity.iter().map(|v| v - velocity[0]).collect();
            if ends.iter().any(|&end| end >= change.len()) {
                continue;
            }
            candidate.roughness = roughness(&velocity);
            candidate.fits = forces
                .iter()
                .zip(&ends)
                .map(|(force, &end)| Fit::of(&force.impulse[..=end], &change[..=end]))
                .collect();
            if candidate.roughness < smoothest[*body].0 {
                smoothest[*body] = (candidate.roughness, change);
            }
        }
    })?;
    // A node whose number repeats in the file has no fits of its own.
    drop(candidates);
    for (body, (_, change)) in bodies.iter_mut().zip(smoothest) {
        body.nodes.retain(|node| node.fits.len() == forces.len());
        body.change = change;
    }
    Ok(())
}

fn roughness(velocity: &[f64]) -> f64 {
    let way: f64 = velocity.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum();
    let highest = velocity.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let lowest = velocity.iter().copied().fold(f64::INFINITY, f64::min);
    if highest > lowest { way / (highest - lowest) } else { f64::INFINITY }
}

/// Values that are held at once: 128 MB.
const MOST_VALUES: usize = 16_000_000;

/// A source's histories, a bounded number of entities at a time.
pub(super) struct HistoryBatches<'a> {
    source: &'a Source,
    components: Vec<&'a str>,
    /// Ids of each piece; one piece of `None` is the whole.
    ids: Vec<Option<Vec<WantedId>>>,
    /// The whole, where it is one piece: read once.
    held: Option<SolverFile>,
}

impl<'a> HistoryBatches<'a> {
    pub(super) fn new(source: &'a Source, components: Vec<&'a str>) -> Self {
        let values_of_one = (source.states * components.len()).max(1);
        let at_once = (MOST_VALUES / values_of_one).max(1);
        let mut all: Vec<i64> = source.entities.iter().map(|entity| entity.id.id).collect();
        all.sort_unstable();
        all.dedup();
        let ids = if all.len() <= at_once {
            vec![None]
        } else {
            all.chunks(at_once)
                .map(|ids| Some(ids.iter().map(|&id| WantedId { id, side: None }).collect()))
                .collect()
        };
        Self { source, components, ids, held: None }
    }

    /// Shows every piece to `look`, in the order of the ids.
    pub(super) fn each(&mut self, look: &mut dyn FnMut(&SolverFile)) -> Result<(), Reason> {
        if let Some(held) = &self.held {
            look(held);
            return Ok(());
        }
        for ids in &self.ids {
            let piece = self.source.read(ids.clone(), &self.components)?;
            look(&piece);
            if ids.is_none() {
                self.held = Some(piece);
            }
        }
        Ok(())
    }
}
