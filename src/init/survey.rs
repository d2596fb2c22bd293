//! Survey of a run: in which direction it moves, which bodies it has, which nodes could represent
//! them, and which forces could have moved them.
//!
//! A node represents a body if its velocity follows the impulse of the force, `∫F dt = m Δv`: nodes
//! in the crush zone are stopped first and then vibrate, and nodes outside the body do not
//! follow at all. A force is the one between two bodies if some node follows it; a contact within
//! a body is followed as well, but has a smaller impulse than what acts on the body from outside.

use std::cmp::Reverse;
use std::collections::HashMap;

use super::folders::Reason;
use super::sources::{
    FORCES, Fit, Source, Sources, by_entity, component, impulse, largest, picked, rising, velocity,
};
use crate::curve::recipe::DisplacementComponent;
use crate::history::{History, Side};
use crate::order;
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
/// A body's change of velocity is over with this share of its largest.
const CHANGED: f64 = 0.95;
/// Forces of a run that are kept, those with the largest impulse.
const KEPT_FORCES: usize = 12;
/// A record may lack one value in so many.
const FEW: usize = 20;
/// A wall's normal force is taken if its impulse differs from that along the motion by less.
const SAME_IMPULSE: f64 = 0.02;

/// A file of forces and the numbers of those that are added.
pub(super) type Named = (String, Vec<i64>);

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

/// A node, how it starts, and how well it follows each force.
#[derive(Clone, Debug)]
pub(super) struct NodeCandidate {
    pub id: i64,
    pub title: Option<String>,
    /// Along x, y and z.
    first_velocity: [f64; 3],
    largest_change: [f64; 3],
    /// Way of its velocity up and down over its range: 1 if it only falls.
    pub roughness: f64,
    /// One for each of the survey's forces.
    pub fits: Vec<Fit>,
}

/// A wall, an interface or a section, with its force along the motion.
#[derive(Clone, Debug)]
pub(super) struct ForceCandidate {
    pub file: &'static str,
    /// Several that are added: they share the load, or act one after the other.
    pub ids: Vec<i64>,
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

impl Survey {
    /// Looks over a run. A recipe's force may be named, which is then kept however small it is; several are added.
    pub(super) fn of(sources: &Sources, named: &[Named]) -> Result<Self, Reason> {
        let source = &sources.motion;
        let components = DisplacementComponent::ALL.map(|along| match along.velocity() {
            velocity if source.has(velocity) => velocity,
            _ => along.name(),
        });
        let mut held = None;
        let mut each_node =
            |look: &mut dyn FnMut(&SolverFile)| each_batch(source, &components, &mut held, look);
        let (starts, time) = starts(source, &mut each_node)?;
        if time.len() < FEWEST_STATES {
            return Err(Reason::FewStates {
                file: source.shown(),
                states: time.len(),
                damage: bracketed(source.damage.as_deref()),
            });
        }
        let (direction, aligned) = direction(&starts)?;
        let mut forces = Vec::new();
        for source in &sources.forces {
            // Hundreds of supports would stand before smaller contacts: they count where nothing else acts, or by name.
            let is_named = named.iter().any(|(file, _)| file == source.name);
            if source.name == "spcforc" && !forces.is_empty() && !is_named {
                continue;
            }
            forces.extend(force_candidates(source, direction, &time, named)?);
        }
        keep_largest(&mut forces, named);
        for (file, ids) in named.iter().filter(|(_, ids)| ids.len() > 1) {
            let Some(source) = sources.force(file) else { continue };
            let is_there = |id: &i64| source.titles.keys().any(|entity| entity.id == *id);
            let sum = ForceCandidate::sum(&forces, file, ids).filter(|_| ids.iter().all(is_there));
            forces.extend(sum);
        }
        let mut bodies = bodies(starts, direction);
        fit_nodes(&mut each_node, &mut bodies, &forces, direction)?;
        Ok(Self { direction, aligned, bodies, forces })
    }

    /// The square of the first speed of a body's node.
    pub(super) fn first_square(&self, id: i64) -> Option<f64> {
        let node = self.bodies.iter().flat_map(|body| &body.nodes).find(|node| node.id == id)?;
        Some(node.first_velocity.iter().map(|v| v * v).sum())
    }

    pub(super) fn force(&self, file: &str, ids: &[i64]) -> Option<usize> {
        self.forces.iter().position(|f| f.file == file && f.ids == ids)
    }
}

impl ForceCandidate {
    /// Its largest impulse, in the file's units.
    pub(super) fn size(&self) -> f64 {
        self.impulse.get(largest(&self.impulse)).map_or(0.0, |impulse| impulse.abs())
    }

    /// Its place among those of equal size: a sum is asked for where another run needs it.
    pub(super) fn rank(&self) -> (usize, Reverse<usize>, &[i64]) {
        let kind = FORCES.iter().position(|name| *name == self.file);
        (kind.unwrap_or(FORCES.len()), Reverse(self.ids.len()), &self.ids)
    }

    /// As it is called in messages: `rwforc 1`, or `rwforc 1 + 2`.
    pub(super) fn label(&self) -> String {
        let ids: Vec<String> = self.ids.iter().map(i64::to_string).collect();
        format!("{} {}", self.file, ids.join(" + "))
    }

    /// The sum of those of a file that act in a run; `None` if none does, or they are of different sides.
    fn sum(forces: &[Self], file: &str, ids: &[i64]) -> Option<Self> {
        let is_part = |force: &&Self| {
            force.file == file && matches!(force.ids[..], [id] if ids.contains(&id))
        };
        let mut parts = forces.iter().filter(is_part);
        let mut sum = Self { ids: ids.to_vec(), title: None, ..parts.next()?.clone() };
        for part in parts {
            if part.side != sum.side {
                return None;
            }
            sum.impulse.iter_mut().zip(&part.impulse).for_each(|(sum, own)| *sum += own);
            sum.covers = sum.covers.min(part.covers);
            sum.other_side &= part.other_side;
            if part.component != "normal_force" {
                sum.component = part.component;
            }
        }
        Some(sum)
    }
}

/// Damage after a sentence.
pub(super) fn bracketed(damage: Option<&str>) -> String {
    damage.map_or(String::new(), |damage| format!(" ({damage})"))
}

/// Values with each one that is not a number replaced by the one before it: damage is reported once a node or force is chosen,
/// and must not decide which. `None` if many are not numbers.
fn mended(mut values: Vec<f64>) -> Option<Vec<f64>> {
    let lost = values.iter().filter(|v| !v.is_finite()).count();
    if lost * FEW > values.len() {
        return None;
    }
    let mut last = values.iter().copied().find(|v| v.is_finite())?;
    for value in &mut values {
        last = if value.is_finite() { *value } else { last };
        *value = last;
    }
    Some(values)
}

/// How each node starts, and the times that rise. Without nodes whose velocities are
/// missing, or mostly not numbers: these did not live long.
fn starts(
    source: &Source,
    each_node: &mut EachBatch<'_>,
) -> Result<(Vec<NodeCandidate>, Vec<f64>), Reason> {
    let (mut starts, mut times) = (Vec::new(), Vec::new());
    each_node(&mut |piece| {
        let states = rising(&piece.time);
        times = picked(&piece.time, &states);
        if states.len() < 2 {
            return;
        }
        for node in by_entity(&piece.histories) {
            let Some(entity) = node[0].entity else { continue };
            // What is not recorded across the motion is taken to be at rest.
            let velocities = DisplacementComponent::ALL.map(|along| {
                let is_recorded = source.has(along.velocity()) || source.has(along.name());
                match is_recorded {
                    true => velocity(node, along, &states).and_then(mended),
                    false => Some(vec![0.0; states.len()]),
                }
            });
            let [Some(x), Some(y), Some(z)] = velocities else { continue };
            let velocities = [x, y, z];
            let change = |v: &Vec<f64>| v.iter().map(|v_i| (v_i - v[0]).abs()).fold(0.0, f64::max);
            starts.push(NodeCandidate {
                id: entity.id,
                title: source.titles.get(&entity).cloned().flatten(),
                first_velocity: velocities.each_ref().map(|v| v[0]),
                largest_change: velocities.each_ref().map(change),
                roughness: f64::INFINITY,
                fits: Vec::new(),
            });
        }
    })?;
    Ok((starts, times))
}

/// The axis along which the bodies start, and how much of their speed lies along it.
fn direction(starts: &[NodeCandidate]) -> Result<(DisplacementComponent, f64), Reason> {
    let speed = |s: &NodeCandidate| s.first_velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
    let fastest = starts.iter().map(speed).fold(0.0, f64::max);
    let changes = starts.iter().flat_map(|s| s.largest_change);
    if !(fastest > STANDS * changes.fold(0.0, f64::max) && fastest > 0.0) {
        return Err(Reason::Stands);
    }
    let moving = || starts.iter().filter(|s| speed(s) > 0.5 * fastest);
    let along = |k: usize| moving().map(|s| s.first_velocity[k].abs()).sum::<f64>();
    let k = (0..3).fold(0, |best, k| if along(k) > along(best) { k } else { best });
    Ok((DisplacementComponent::ALL[k], along(k) / moving().map(speed).sum::<f64>()))
}

/// Nodes that start alike, without those that start at rest and stay there.
fn bodies(mut nodes: Vec<NodeCandidate>, direction: DisplacementComponent) -> Vec<Body> {
    let k = DisplacementComponent::ALL.iter().position(|d| *d == direction).unwrap_or(0);
    let first = |node: &NodeCandidate| node.first_velocity[k];
    let least = SAME_VELOCITY * nodes.iter().map(|n| first(n).abs()).fold(0.0, f64::max);
    nodes.retain(|n| first(n).abs() > least || n.largest_change[k] > least);
    order::sort(&mut nodes, |a, b| first(a).total_cmp(&first(b)).then(a.id.cmp(&b.id)));
    let mut bodies: Vec<Body> = nodes
        .chunk_by(|a, b| first(b) - first(a) <= least)
        .map(|group| Body {
            first_velocity: first(&group[group.len() / 2]),
            nodes: group.to_vec(),
            change: Vec::new(),
        })
        .collect();
    // Of two that come at each other equally fast, the one with the smaller number.
    let least_id = |body: &Body| body.nodes.iter().map(|n| n.id).min();
    let speed = |body: &Body| (body.first_velocity / least).round().abs();

    order::sort(&mut bodies, |a, b| {
        speed(b).total_cmp(&speed(a)).then_with(|| least_id(a).cmp(&least_id(b)))
    });
    bodies
}

/// The forces of a source along the motion.
fn force_candidates(
    source: &Source,
    direction: DisplacementComponent,
    time: &[f64],
    named: &[Named],
) -> Result<Vec<ForceCandidate>, Reason> {
    let mut components = vec![direction.force()];
    if source.has("normal_force") {
        components.push("normal_force");
    }
    let mut found: Vec<ForceCandidate> = Vec::new();
    each_batch(source, &components, &mut None, &mut |piece| {
        for of in by_entity(&piece.histories) {
            let Some(entity) = of[0].entity else { continue };
            let Some((component, impulse)) = along(of, direction, time) else { continue };
            let last = of[0].time.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let candidate = ForceCandidate {
                file: source.name,
                ids: vec![entity.id],
                side: entity.side,
                other_side: false,
                component,
                title: source.titles.get(&entity).cloned().flatten(),
                impulse,
                covers: time.partition_point(|&t| t <= last),
            };
            add(&mut found, candidate);
        }
        keep_largest(&mut found, named);
    })?;
    Ok(found)
}

/// Keeps the forces with the largest impulses, so that thousands of contacts are not held.
fn keep_largest(forces: &mut Vec<ForceCandidate>, named: &[Named]) {
    order::sort(forces, |a, b| b.size().total_cmp(&a.size()).then(a.rank().cmp(&b.rank())));
    let mut rank = 0;
    forces.retain(|force| {
        rank += 1;
        let is_named = |(file, ids): &Named| file == force.file && ids.contains(&force.ids[0]);
        rank <= KEPT_FORCES || named.iter().any(is_named)
    });
}

/// The component to take and its impulse: a wall's normal force where it acts along the motion.
fn along(
    of: &[History],
    direction: DisplacementComponent,
    time: &[f64],
) -> Option<(&'static str, Vec<f64>)> {
    let impulse = |of: &History| match of.values.iter().all(|v| v.is_finite()) {
        true => impulse(of, time),
        false => impulse(&History { values: mended(of.values.clone())?, ..of.clone() }, time),
    };
    let force = impulse(component(of, direction.force())?)?;
    let at = largest(&force);
    if force.get(at).is_none_or(|j| *j == 0.0) {
        return None;
    }
    let normal = component(of, "normal_force").and_then(impulse);
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
fn add(found: &mut Vec<ForceCandidate>, mut candidate: ForceCandidate) {
    let Some(known) = found.iter_mut().find(|f| f.ids == candidate.ids) else {
        return found.push(candidate);
    };
    let at = largest(&known.impulse);
    let ratio = candidate.impulse[at].abs() / known.impulse[at].abs();
    let is_same = (ratio - 1.0).abs() < SAME_IMPULSE;
    candidate.other_side = is_same;
    known.other_side |= is_same;
    let is_better = if is_same { candidate.side < known.side } else { ratio > 1.0 };
    if is_better {
        *known = candidate;
    }
}

/// How well each node of the bodies follows each force, and how each body moves.
fn fit_nodes(
    each_node: &mut EachBatch<'_>,
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
    each_node(&mut |piece| {
        let states = rising(&piece.time);
        for node in by_entity(&piece.histories) {
            let candidate = node[0].entity.and_then(|entity| candidates.get_mut(&entity.id));
            let (Some((body, candidate)), Some(velocity)) =
                (candidate, velocity(node, direction, &states).and_then(mended))
            else {
                continue;
            };
            let change: Vec<f64> = velocity.iter().map(|v| v - velocity[0]).collect();
            if ends.iter().any(|&end| end >= change.len()) {
                continue;
            }
            candidate.roughness = roughness(&velocity);
            candidate.fits =
                forces.iter().map(|force| fit(&force.impulse, force.covers, &change)).collect();
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

/// How a body's change of velocity follows an impulse: until the impulse is largest, or the body has nearly its largest
/// change, which a force that another one has taken over from does not explain.
pub(super) fn fit(impulse: &[f64], covers: usize, change: &[f64]) -> Fit {
    let most = CHANGED * change.get(largest(change)).map_or(0.0, |v| v.abs());
    let changed = change.iter().position(|v| v.abs() >= most).unwrap_or(0);
    let end = largest(impulse).max(changed.min(covers.saturating_sub(1)));
    let states = (end + 1).min(impulse.len()).min(change.len());
    Fit::of(&impulse[..states], &change[..states])
}

fn roughness(velocity: &[f64]) -> f64 {
    let way: f64 = velocity.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum();
    let highest = velocity.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let lowest = velocity.iter().copied().fold(f64::INFINITY, f64::min);
    if highest > lowest { way / (highest - lowest) } else { f64::INFINITY }
}

/// Shows all nodes of a run, a batch at a time.
type EachBatch<'a> = dyn FnMut(&mut dyn FnMut(&SolverFile)) -> Result<(), Reason> + 'a;

/// Values that are held at once: 128 MB.
const MAX_VALUES: usize = 16_000_000;

/// Shows a source's histories to `look`, a bounded number of entities at a time in the order of their
/// ids; all of them, where they are few, are read once and `held`.
fn each_batch(
    source: &Source,
    components: &[&str],
    held: &mut Option<SolverFile>,
    look: &mut dyn FnMut(&SolverFile),
) -> Result<(), Reason> {
    let mut ids: Vec<i64> = source.titles.keys().map(|entity| entity.id).collect();
    ids.dedup();
    let at_once = (MAX_VALUES / (source.states * components.len()).max(1)).max(1);
    if ids.len() > at_once {
        for ids in ids.chunks(at_once) {
            let ids = ids.iter().map(|&id| WantedId { id, side: None }).collect();
            look(&source.read(Some(ids), components)?);
        }
        return Ok(());
    }
    if held.is_none() {
        *held = Some(source.read(None, components)?);
    }
    held.iter().for_each(look);
    Ok(())
}
