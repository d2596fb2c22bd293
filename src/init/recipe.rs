//! The recipe that most runs agree on: kind, direction, force and nodes; runs that need another
//! one are distinguished, never merged. Which force of a run moved which of its bodies; without one,
//! which bodies pushed each other.

use std::collections::{BTreeMap, HashSet};

use super::UserHints;
use super::sources::Fit;
use super::survey::{Body, ForceCandidate, Named, NodeCandidate, STOPPED, Survey, fit};
use crate::curve::recipe::DisplacementComponent;
use crate::order;
use crate::study::StudyKind;

/// A node represents its body if it leaves at most this much more of the impulse than the best
/// one: as a factor and as a share of the impulse.
const AS_GOOD: (f64, f64) = (1.5, 0.01);
/// The same for a node whose title says that it is the centre of gravity.
const CENTRE_AS_GOOD: f64 = 0.05;
/// Steps of the roughness below which velocities are equally smooth, for each whole.
const EVEN: f64 = 10.0;
/// Of fewer runs none is the odd one.
const LEAST_TO_COMPARE: usize = 3;
/// A run that leaves so many times more of the impulse than most has the force of something else.
const MUCH_MORE: f64 = 4.0;
const NAMED: usize = 5;

#[derive(Clone, Debug)]
pub(super) struct CommonRecipe {
    pub kind: StudyKind,
    pub direction: DisplacementComponent,
    pub nodes: Vec<ChosenNode>,
    /// `None` if no force moves the bodies: then mass times acceleration is used.
    pub force: Option<ForceCandidate>,
    pub other_forces: Vec<Alternative>,
    /// Walls or contacts that may share the load with the force.
    pub beside: Beside,
    /// What the chosen nodes leave of the impulse in the run where they follow it worst.
    pub residual: f64,
    /// The same for what one body of a pair leaves of the other's change of velocity, if no force
    /// moves them.
    pub opposed: Option<f64>,
    /// Bodies that move in the run with most of them.
    pub bodies: usize,
    /// For each run whether it can take the recipe, or why not.
    pub members: Vec<Result<(), String>>,
}

/// A node and those that could represent the same body.
#[derive(Clone, Debug)]
pub(super) struct ChosenNode {
    pub id: i64,
    pub title: Option<String>,
    pub residual: f64,
    /// A run in which it leaves as much is left out.
    pub limit: f64,
    pub others: Vec<Alternative>,
}

/// Forces of the same file that the bodies follow as well as the chosen one.
#[derive(Clone, Debug, Default)]
pub(super) struct Beside {
    pub ids: Vec<i64>,
    /// The impulse of all, the chosen one among them, over that of the chosen one.
    pub whole: f64,
    /// Others of the file act against it on the side that would be added, so that no recipe adds them.
    pub opposite: Vec<i64>,
    /// A force with a larger impulse, which the bodies follow less closely, as a warning says it.
    pub larger: Option<String>,
}

/// What else could be meant, and how well it would do.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub(crate) struct Alternative {
    /// As a recipe would name it.
    pub(crate) id: String,
    /// Title and how well it does.
    pub(crate) about: String,
}

/// What runs must share to have one recipe.
type Key = (StudyKind, DisplacementComponent, Option<(&'static str, Vec<i64>)>);

/// A run's survey with what explains it best.
struct RunView<'a> {
    survey: &'a Survey,
    best: Option<Explanation>,
    /// Whether it counts: the record covers the crash up to its end, or no run's does.
    counts: bool,
    /// What the agreed force explains of it, or why it needs a different recipe.
    explained: Result<Option<Explanation>, String>,
}

impl CommonRecipe {
    /// The recipe of most of the runs; `None` if there are no runs.
    pub(super) fn of(surveys: &[&Survey], hints: &UserHints) -> Option<Self> {
        // A node of the other body means two.
        let two = hints.minus_node.map(|_| StudyKind::Pair);
        let kind = if hints.half_model { Some(StudyKind::Wall) } else { hints.kind.or(two) };
        let mut views = RunView::all(surveys, hints, kind);
        let mut votes: Vec<(Key, Vec<usize>)> = Vec::new();
        for (k, view) in views.iter().enumerate().filter(|(_, view)| view.counts) {
            let key = view.key();
            match votes.iter_mut().find(|(known, _)| *known == key) {
                Some((_, voters)) => voters.push(k),
                None => votes.push((key, vec![k])),
            }
        }
        // Of equally many votes the force that explains more, then the first run's.
        let left = |runs: &[usize]| -> f64 { runs.iter().map(|&k| views[k].residual()).sum() };
        let (key, _) = votes.into_iter().min_by(|(_, a), (_, b)| {
            let by_votes = b.len().cmp(&a.len());
            by_votes.then(left(a).total_cmp(&left(b))).then(a[0].cmp(&b[0]))
        })?;
        for view in &mut views {
            view.explained = view.takes(&key, kind, hints);
        }
        in_one_order(&mut views);
        let (kind, direction, force) = key;
        let (force, other_forces, beside) = match force.and_then(|_| chosen_force(&views)) {
            Some((force, others, beside)) => (Some(force), others, beside),
            None => Default::default(),
        };
        let explained = views.iter().filter_map(|view| view.explained.as_ref().ok()?.as_ref());
        let opposed = explained.map(|explained| explained.residual).fold(0.0, f64::max);
        let given = [hints.node, hints.minus_node];
        let are_given = hints.node.is_some() || hints.force.is_some();
        let nodes: Vec<ChosenNode> = (0..if kind == StudyKind::Pair { 2 } else { 1 })
            .filter_map(|slot| choose(&views, slot, given[slot], force.is_some(), are_given))
            .collect();
        Some(Self {
            kind,
            direction,
            opposed: (force.is_none() && kind == StudyKind::Pair).then_some(opposed),
            force,
            other_forces,
            beside,
            residual: nodes.iter().map(|node| node.residual).fold(0.0, f64::max),
            bodies: surveys.iter().map(|survey| survey.bodies.len()).max().unwrap_or(0),
            members: views.iter().map(|view| view.check_nodes(&nodes)).collect(),
            nodes,
        })
    }
}

impl<'a> RunView<'a> {
    /// All runs, each with what explains it best: the force that the caller names if he does.
    fn all(surveys: &[&'a Survey], hints: &UserHints, kind: Option<StudyKind>) -> Vec<Self> {
        let best = |survey: &Survey| match &hints.force {
            Some(named) => of_force(survey, survey.force(&named.file, &named.ids)?, kind),
            None => best_of(survey, kind).or_else(|| without_force(survey, kind)),
        };
        let view = |survey: &&'a Survey| {
            let best = best(survey);
            let counts = best.as_ref().is_some_and(|best| reaches_the_end(survey, best));
            Self { survey: *survey, best, counts, explained: Ok(None) }
        };
        let mut views: Vec<Self> = surveys.iter().map(view).collect();
        if !views.iter().any(|view| view.counts) {
            views.iter_mut().for_each(|view| view.counts = true);
        }
        views
    }

    fn key(&self) -> Key {
        let best = self.best.as_ref();
        let force =
            best.and_then(|best| self.moved_by(best)).map(|force| (force.file, force.ids.clone()));
        (best.map_or(StudyKind::Wall, |best| best.kind), self.survey.direction, force)
    }

    fn residual(&self) -> f64 {
        let by_force = self.best.as_ref().filter(|best| best.force.is_some());
        by_force.map_or(1.0, |best| best.residual)
    }

    fn moved_by(&self, explanation: &Explanation) -> Option<&'a ForceCandidate> {
        explanation.force.map(|force| &self.survey.forces[force])
    }

    /// Whether as many bodies move in it as in the others.
    fn check_kind(&self, others: StudyKind) -> Result<(), String> {
        match &self.best {
            Some(best) if best.kind != others && self.counts => Err(match others {
                StudyKind::Pair => "one body moves in it, two bodies do in the others",
                StudyKind::Wall => "two bodies move in it, one does in the others",
            }
            .into()),
            _ => Ok(()),
        }
    }

    /// What the recipe's force explains of the run, or why the run needs a different recipe.
    fn takes(
        &self,
        (of_others, direction, force): &Key,
        kind: Option<StudyKind>,
        hints: &UserHints,
    ) -> Result<Option<Explanation>, String> {
        if self.survey.direction != *direction {
            return Err(format!("it moves along {}", self.survey.direction.axis()));
        }
        let explained = if let Some((file, ids)) = force {
            let wanted = kind.unwrap_or(*of_others);
            let force = self.survey.force(file, ids);
            let found = force.and_then(|force| of_force(self.survey, force, Some(wanted)));
            let is_related =
                |e: &Explanation| e.residual < RELATED || hints.force.is_some() || !self.counts;
            let own = self.best.as_ref().and_then(|best| self.moved_by(best));
            let ids = ids.iter().map(i64::to_string).collect::<Vec<_>>().join(" + ");
            Some(found.filter(is_related).ok_or_else(|| match (own, force) {
                (Some(own), _) => {
                    format!("{file} {ids} does not move its bodies, {} does", own.label())
                }
                (None, Some(_)) => format!("{file} {ids} does not move its bodies"),
                (None, None) => format!("it has no {file} {ids} along the motion"),
            })?)
        } else if self.best.as_ref().is_some_and(|best| best.force.is_some()) {
            return Err("it has a contact force, the others have none".into());
        } else {
            self.best.clone()
        };
        self.check_kind(*of_others)?;
        explained.map(|explained| self.with_named(explained, hints)).transpose()
    }

    /// The bodies of the nodes that the caller names are the ones, whatever the force explains better.
    fn with_named(&self, mut of: Explanation, hints: &UserHints) -> Result<Explanation, String> {
        let body = |id: Option<i64>| {
            let has = |body: &Body| body.nodes.iter().any(|node| Some(node.id) == id);
            self.survey.bodies.iter().position(has)
        };
        let named = [body(hints.node), body(hints.minus_node)];
        if let ([Some(a), Some(b)], [Some(node), Some(other)]) =
            (named, [hints.node, hints.minus_node])
            && a == b
        {
            return Err(format!("nodes {node} and {other} move as one body"));
        }
        for (slot, body) in named.into_iter().enumerate().take(of.bodies.len()) {
            let Some(body) = body else { continue };
            let is_pushed_alike = |other: usize| match of.force {
                Some(force) => {
                    let sign = |k: usize| best(&self.survey.bodies[k], force).1;
                    sign(body) == sign(other)
                }
                None => false,
            };
            match of.bodies.iter().position(|other| *other == body) {
                Some(place) => of.bodies.swap(slot, place),
                // Alone, it takes the place of the body that the force pushes the same way.
                None if named.contains(&None)
                    && of.bodies.len() == 2
                    && is_pushed_alike(of.bodies[1 - slot]) =>
                {
                    of.bodies.swap(0, 1);
                    of.bodies[slot] = body;
                }
                None => of.bodies[slot] = body,
            }
        }
        Ok(of)
    }

    /// The nodes of one of the bodies that the force explains, each with what it leaves of the
    /// impulse; without a force those of the body in that place.
    fn nodes_of(&self, slot: usize) -> Vec<(&'a NodeCandidate, f64)> {
        let (body, force) = match &self.explained {
            Ok(Some(explained)) => (explained.bodies.get(slot).copied(), explained.force),
            Ok(None) => (Some(slot), None),
            Err(_) => (None, None),
        };
        let body = body.and_then(|body| self.survey.bodies.get(body));
        let nodes = body.map(|body| &body.nodes[..]).unwrap_or_default();
        let residual = |node: &NodeCandidate| force.map_or(0.0, |f| node.fits[f].residual);
        nodes.iter().map(|node| (node, residual(node))).collect()
    }

    /// Whether the run has the recipe's nodes, and they follow the force.
    fn check_nodes(&self, nodes: &[ChosenNode]) -> Result<(), String> {
        self.explained.as_ref().map_err(String::clone)?;
        for (slot, ChosenNode { id, residual: usual, limit, .. }) in nodes.iter().enumerate() {
            let all = self.nodes_of(slot);
            let best = all.iter().min_by(|a, b| a.1.total_cmp(&b.1)).map(|(node, _)| {
                let title = node.title.as_ref();
                let title = title.map_or(String::new(), |title| format!(" \"{title}\""));
                format!("; there {}{title} would be taken", node.id)
            });
            let best = best.unwrap_or_default();
            match all.iter().find(|(node, _)| node.id == *id) {
                None => return Err(format!("it has no moving node {id}{best}")),
                Some((_, residual)) if self.counts && *residual >= RELATED.max(*limit) => {
                    return Err(format!("node {id} does not follow the force{best}"));
                }
                Some((_, residual)) if self.counts && residual >= limit => {
                    return Err(format!(
                        "impulse of the force and change of velocity differ by {} %, in the others by at most {} %: is its force that of another run or in other units, or does another force act as well? To keep it, name the force with --force",
                        percent(*residual),
                        percent(*usual)
                    ));
                }
                Some(_) => {}
            }
        }
        Ok(())
    }
}

/// Puts the two bodies of each run in the order of the first run's: the faster one, which comes first, may be the other.
fn in_one_order(views: &mut [RunView<'_>]) {
    let ids = |view: &RunView<'_>, slot: usize| -> HashSet<i64> {
        view.nodes_of(slot).iter().map(|(node, _)| node.id).collect()
    };
    let mut first: Option<HashSet<i64>> = None;
    for view in views {
        if !matches!(&view.explained, Ok(Some(explained)) if explained.bodies.len() == 2) {
            continue;
        }
        let first = first.get_or_insert_with(|| ids(view, 0));
        let shares = |slot: usize| !first.is_disjoint(&ids(view, slot));
        let is_other = !shares(0) && shares(1);
        if let Ok(Some(explained)) = &mut view.explained
            && is_other
        {
            explained.bodies.swap(0, 1);
        }
    }
}

/// The verdicts of all runs on a node.
struct NodeTally<'a> {
    node: &'a NodeCandidate,
    is_centre: bool,
    /// In which it can represent the body.
    runs: usize,
    /// Of each run, and the largest of those that are not left out for it.
    residuals: Vec<f64>,
    residual: f64,
    /// Of all runs together, and how many that are.
    roughness: f64,
    seen: f64,
}

/// The residual from which on a run is left out: that of a node that does not follow the force at all; or, where most runs follow it
/// closely, many times theirs.
fn left_out_from(residuals: &[f64]) -> f64 {
    let mut sorted = residuals.to_vec();
    sorted.sort_by(f64::total_cmp);
    let median = sorted[sorted.len() / 2];
    if sorted.len() >= LEAST_TO_COMPARE && median <= FOLLOWS {
        (MUCH_MORE * median).clamp(FOLLOWS, RELATED)
    } else {
        RELATED
    }
}

/// The node that can represent the body in most runs: a centre of gravity first, then the one
/// with the smoothest velocity.
fn choose(
    views: &[RunView<'_>],
    slot: usize,
    given: Option<i64>,
    by_force: bool,
    are_given: bool,
) -> Option<ChosenNode> {
    let mut tallies: BTreeMap<i64, NodeTally<'_>> = BTreeMap::new();
    for run in views.iter().filter(|view| view.counts).map(|view| view.nodes_of(slot)) {
        let best = run.iter().map(|(_, residual)| *residual).fold(f64::INFINITY, f64::min);
        for (node, residual) in run {
            let is_centre = names_centre_of_gravity(node.title.as_deref());
            let limit =
                if is_centre { best + CENTRE_AS_GOOD } else { AS_GOOD.0 * best + AS_GOOD.1 };
            let (runs, roughness, seen) = (0, 0.0, 0.0);
            let tally = tallies.entry(node.id).or_insert(NodeTally {
                node,
                is_centre,
                runs,
                residuals: Vec::new(),
                residual: 0.0,
                roughness,
                seen,
            });
            tally.runs += usize::from(residual <= limit);
            tally.residuals.push(residual);
            tally.roughness += node.roughness;
            tally.seen += 1.0;
        }
    }
    // Of equally smooth ones, such as the nodes of a rigid body, the one that follows best.
    let roughness = |tally: &NodeTally<'_>| (tally.roughness / tally.seen * EVEN).round();
    let mut tallies: Vec<NodeTally<'_>> = tallies.into_values().collect();
    // A run in which a node does not follow the force is left out, and says nothing of the others.
    let largest = |tally: &NodeTally<'_>, limit: f64| {
        let all = || tally.residuals.iter().copied();
        let kept = all().filter(|left| *left < limit).reduce(f64::max);
        kept.unwrap_or_else(|| all().fold(0.0, f64::max))
    };
    for tally in &mut tallies {
        tally.residual = largest(tally, if are_given { f64::INFINITY } else { RELATED });
    }
    order::sort(&mut tallies, |a, b| {
        (Some(b.node.id) == given)
            .cmp(&(Some(a.node.id) == given))
            .then(b.runs.cmp(&a.runs))
            .then(b.is_centre.cmp(&a.is_centre))
            .then(roughness(a).total_cmp(&roughness(b)))
            .then(a.residual.total_cmp(&b.residual))
            .then(a.node.id.cmp(&b.node.id))
    });
    if let Some(id) = given
        && tallies.first().is_none_or(|first| first.node.id != id)
    {
        // Each run without it is left out, with the reason.
        let (residual, limit) = (1.0, f64::INFINITY);
        return Some(ChosenNode { id, title: None, residual, limit, others: Vec::new() });
    }
    let (first, others) = tallies.split_first()?;
    let about = |tally: &NodeTally<'_>| {
        let title = title_before(&tally.node.title);
        if by_force {
            format!("{title}follows the impulse within {} %", percent(tally.residual))
        } else {
            format!("{title}starts at the same velocity")
        }
    };
    let others = others
        .iter()
        .filter(|tally| tally.residual <= FOLLOWS.max(2.0 * first.residual))
        .take(NAMED)
        .map(|tally| Alternative { id: tally.node.id.to_string(), about: about(tally) })
        .collect();
    let title = first.node.title.clone();
    let limit = if are_given { f64::INFINITY } else { left_out_from(&first.residuals) };
    let residual = largest(first, limit);
    Some(ChosenNode { id: first.node.id, title, residual, limit, others })
}

/// The force that the members share, as the recipe names it, and those that could be meant; `None`
/// if none moves them.
fn chosen_force(views: &[RunView<'_>]) -> Option<(ForceCandidate, Vec<Alternative>, Beside)> {
    let of_members: Vec<(&Survey, &ForceCandidate)> = views
        .iter()
        .filter_map(|view| {
            let explained = view.explained.as_ref().ok()?.as_ref()?;
            Some((view.survey, view.moved_by(explained)?))
        })
        .collect();
    let (first, force) = *of_members.first()?;
    let others = first.forces.iter().enumerate();
    let others: Vec<(&ForceCandidate, f64)> = others
        .filter(|(_, other)| {
            let is_part = other.file == force.file && force.ids.contains(&other.ids[0]);
            other.ids.len() == 1 && !is_part
        })
        .filter_map(|(k, other)| Some((other, of_force(first, k, None)?.residual)))
        .filter(|(_, residual)| *residual < RELATED)
        .collect();
    let own = first.force(force.file, &force.ids).and_then(|k| of_force(first, k, None));
    let own_left = own.map_or(1.0, |own| own.residual);
    let last = |force: &ForceCandidate| force.impulse.last().copied().unwrap_or(0.0);
    let shares = others.iter().filter(|(other, residual)| {
        let is_contact = ["rwforc", "rcforc"].contains(&force.file);
        other.file == force.file && is_contact && *residual < FOLLOWS
    });
    let is_alike =
        |other: &&ForceCandidate| other.side == force.side && last(other) * last(force) > 0.0;
    let (alike, opposite): (Vec<_>, Vec<_>) = shares.map(|(other, _)| *other).partition(is_alike);
    let beside = Beside {
        ids: alike.iter().flat_map(|other| &other.ids).copied().collect(),
        whole: 1.0 + alike.iter().map(|other| other.size() / force.size()).sum::<f64>(),
        opposite: opposite.iter().flat_map(|other| &other.ids).copied().collect(),
        larger: others
            .iter()
            .find(|(other, left)| {
                other.size() > LARGER * force.size() && *left > LESS_CLOSELY * own_left
            })
            .map(|(other, _)| {
                let times = percent(other.size() / force.size());
                format!(
                    "the impulse of {} is {times} % of that of {}",
                    other.label(),
                    force.label()
                )
            }),
    };
    let others = others
        .into_iter()
        .take(NAMED)
        .map(|(other, residual)| Alternative {
            id: other.label(),
            about: format!(
                "{}bodies follow it within {} %; its impulse is {} % of the chosen one's",
                title_before(&other.title),
                percent(residual),
                percent(other.size() / force.size())
            ),
        })
        .collect();
    // Where a wall's normal force is not that along the motion in one run, the latter is taken.
    let mut components = of_members.iter().map(|(_, force)| force.component);
    let component = components.find(|c| *c != "normal_force").unwrap_or(force.component);
    let other_side = of_members.iter().all(|(_, force)| force.other_side);
    Some((ForceCandidate { component, other_side, ..force.clone() }, others, beside))
}

fn title_before(title: &Option<String>) -> String {
    title.as_ref().map_or(String::new(), |title| format!("\"{title}\", "))
}

/// A share in percent, with one digit below ten.
pub(super) fn percent(share: f64) -> String {
    let percent = share * 100.0;
    if percent < 9.95 { format!("{percent:.1}") } else { format!("{percent:.0}") }
}

/// Whether a title names a body's centre of gravity.
pub(super) fn names_centre_of_gravity(title: Option<&str>) -> bool {
    let Some(title) = title.map(str::to_lowercase) else { return false };
    let word = |wanted: &str| title.split(|c: char| !c.is_alphanumeric()).any(|w| w == wanted);
    let centre = ["centre", "center"].iter().any(|c| title.contains(c));
    let of_mass = ["gravity", "mass"].iter().any(|c| title.contains(c));
    word("cog")
        || word("cg")
        || title.contains("c.g.")
        || title.contains("c.o.g")
        || centre && of_mass
}

/// A node follows an impulse if it leaves less than this share of it.
pub(super) const FOLLOWS: f64 = 0.1;
/// A node that leaves more than this share of an impulse has nothing to do with it.
pub(super) const RELATED: f64 = 0.3;
/// A force joins a sum if the bodies follow that so much more closely.
const WORTH: f64 = 0.8;
/// A sum leaves at most this much more than the part of it that the bodies follow best: as a factor and of the impulse.
const NO_WORSE: (f64, f64) = (1.1, 0.002);
/// A force with an impulse so many times larger than the chosen one's, and a residual so many times larger, acts on other bodies, too.
const LARGER: f64 = 1.2;
const LESS_CLOSELY: f64 = 1.5;
/// What printed digits leave.
const ROUNDED: f64 = 2e-3;
/// A body that leaves less of an impulse follows it too closely for another interface's to show.
const CLOSELY: f64 = 0.03;
/// Impulses that differ by less are equal.
const EQUAL: f64 = 0.02;

/// A force and the bodies that it acts on, or without one the bodies alone.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Explanation {
    pub kind: StudyKind,
    /// Index into the survey's forces.
    pub force: Option<usize>,
    /// Indices into the survey's bodies: the moving one, and of a pair the other.
    pub bodies: Vec<usize>,
    /// What the best node of each body leaves of the impulse, the larger one of a pair. Without a
    /// force what one body's change of velocity leaves of the other's.
    pub residual: f64,
}

/// The best node of a body for a force: its residual, and the sign of its mass.
fn best(body: &Body, force: usize) -> (f64, f64) {
    let fits = body.nodes.iter().map(|node| node.fits[force]);
    fits.fold((1.0, 0.0), |best, fit| {
        if fit.residual < best.0 { (fit.residual, fit.mass.signum()) } else { best }
    })
}

/// The pair of bodies with the smallest residual, and that.
fn best_pair(
    bodies: usize,
    residual: impl Fn(usize, usize) -> Option<f64>,
) -> Option<(f64, Vec<usize>)> {
    let pairs = (0..bodies).flat_map(|a| (a + 1..bodies).map(move |b| (a, b)));
    let known = pairs.filter_map(|(a, b)| Some((residual(a, b)?, vec![a, b])));
    known.min_by(|x, y| x.0.total_cmp(&y.0))
}

/// The kind that is requested; else a pair that is related, or a single body.
fn chosen(
    kind: Option<StudyKind>,
    force: Option<usize>,
    pair: Option<(f64, Vec<usize>)>,
    single: Option<(f64, Vec<usize>)>,
) -> Option<Explanation> {
    let is_pair = match kind {
        Some(kind) => kind == StudyKind::Pair,
        None => pair.as_ref().is_some_and(|(residual, _)| *residual < RELATED),
    };
    let kind = if is_pair { StudyKind::Pair } else { StudyKind::Wall };
    let (residual, bodies) = if is_pair { pair } else { single }?;
    Some(Explanation { kind, force, bodies, residual })
}

/// What a force explains: two bodies that it drives apart, or one that it stops.
pub(super) fn of_force(
    survey: &Survey,
    force: usize,
    kind: Option<StudyKind>,
) -> Option<Explanation> {
    let bodies: Vec<(f64, f64)> = survey.bodies.iter().map(|body| best(body, force)).collect();
    let pair = best_pair(bodies.len(), |a, b| {
        let is_apart = bodies[a].1 * bodies[b].1 < 0.0;
        is_apart.then_some(bodies[a].0.max(bodies[b].0))
    });
    let single = bodies.iter().enumerate().map(|(a, body)| (body.0, vec![a]));
    chosen(kind, Some(force), pair, single.min_by(|x, y| x.0.total_cmp(&y.0)))
}

/// The force that explains most: of those that a node follows, the one with the largest impulse.
pub(super) fn best_of(survey: &Survey, kind: Option<StudyKind>) -> Option<Explanation> {
    let forces = survey.forces.iter().enumerate();
    let explained: Vec<(&ForceCandidate, Explanation)> = forces
        .filter_map(|(k, force)| Some((force, of_force(survey, k, kind)?)))
        .filter(|(_, e)| e.residual < RELATED)
        .collect();
    let least = explained.iter().map(|(_, e)| e.residual).fold(f64::INFINITY, f64::min);
    // A sum that another run needs is one here, too, unless the bodies follow a part of it more closely.
    let is_sum = |(force, e): &(&ForceCandidate, Explanation)| {
        let parts = explained.iter().filter(|(part, _)| part.file == force.file);
        let parts =
            parts.filter(|(part, _)| part.ids.len() == 1 && force.ids.contains(&part.ids[0]));
        let part = parts.map(|(_, e)| e.residual).fold(f64::INFINITY, f64::min);
        force.ids.len() == 1 || e.residual <= NO_WORSE.0 * part + NO_WORSE.1
    };
    let explained: Vec<_> = explained.iter().filter(|one| is_sum(one)).collect();
    let largest = |files: &[&str]| {
        let of_kind = || {
            let following =
                explained.iter().filter(|(_, e)| e.residual <= FOLLOWS.max(2.0 * least));
            following.filter(move |(force, _)| files.contains(&force.file)).copied()
        };
        let most = of_kind().map(|(force, _)| force.size()).fold(0.0, f64::max);
        // The survey has them by size: of equal ones a wall's comes before an interface's.
        let equal = of_kind().filter(|(force, _)| force.size() >= (1.0 - EQUAL) * most);
        equal.min_by_key(|(force, _)| force.rank()).map(|(_, e)| e.clone())
    };
    // A section carries only what passes through it, and a rigid body may be the one that is stopped: neither represents
    // a contact that is there.
    let [contacts, bodies, sections] = [&["rwforc", "rcforc"][..], &["rbdout"], &["secforc"]];
    let other = largest(contacts).or_else(|| largest(bodies)).or_else(|| largest(sections));
    // Of several supports each has a part of the reaction.
    let is_one = survey.forces.iter().filter(|force| force.file == "spcforc").count() == 1;
    other.or_else(|| largest(&["spcforc"]).filter(|_| is_one))
}

/// The choice if no force explains a run: two bodies whose velocities change against each
/// other at one ratio all along, as m₁Δv₁ = −m₂Δv₂ has it for two that meet only each other; else
/// the fastest one. A pair that is requested is the two that come closest to it.
pub(super) fn without_force(survey: &Survey, kind: Option<StudyKind>) -> Option<Explanation> {
    let bodies = survey.bodies.len();
    let pair = best_pair(bodies, |a, b| Some(opposed(survey, a, b)));
    chosen(kind, None, pair, (bodies > 0).then(|| (1.0, vec![0])))
}

/// Walls or interfaces of a file that act together or one after the other: the bodies follow their sum far more closely
/// than any of them. What acts between parts of a body is an interface, too, never a wall: walls are added as soon as it
/// is worth it.
pub(super) fn sum_of_forces(survey: &Survey) -> Option<Named> {
    let pair = best_of(survey, None).filter(|best| best.kind == StudyKind::Pair);
    let judged = match pair {
        Some(pair) => vec![pair.bodies],
        None => (0..survey.bodies.len()).map(|k| vec![k]).collect(),
    };
    let sums = judged.iter().filter_map(|bodies| sum_on(survey, bodies));
    let (_, file, mut ids) = sums.min_by(|a, b| a.0.total_cmp(&b.0))?;
    ids.sort_unstable();
    Some((file.into(), ids))
}

/// The sum that some bodies follow far more closely than any force, and what they leave of it.
fn sum_on(survey: &Survey, bodies: &[usize]) -> Option<(f64, &'static str, Vec<i64>)> {
    let changes: Vec<&[f64]> = bodies.iter().map(|&k| &survey.bodies[k].change[..]).collect();
    if changes.iter().any(|change| change.is_empty()) {
        return None;
    }
    let left = |of: &ForceCandidate| {
        let each = changes.iter().map(|change| fit(&of.impulse, of.covers, change).residual);
        each.fold(0.0, f64::max)
    };
    let contacts = || survey.forces.iter().filter(|f| ["rwforc", "rcforc"].contains(&f.file));
    let least = contacts().map(left).fold(f64::INFINITY, f64::min);
    let followed = best_of(survey, None).map_or(1.0, |best| best.residual);
    let from = |first: &ForceCandidate| {
        let mut sum = first.clone();
        loop {
            let others = contacts().filter(|other| {
                (other.file, other.side) == (sum.file, sum.side)
                    && !sum.ids.contains(&other.ids[0])
                    && other.size() > EQUAL * sum.size()
            });
            let sums = others.map(|other| {
                let mut sum = sum.clone();
                sum.impulse.iter_mut().zip(&other.impulse).for_each(|(a, b)| *a += b);
                sum.covers = sum.covers.min(other.covers);
                sum.ids.push(other.ids[0]);
                (left(&sum), sum)
            });
            let next = sums.min_by(|a, b| a.0.total_cmp(&b.0));
            match next.filter(|(residual, _)| *residual < WORTH * left(&sum)) {
                Some((_, next)) => sum = next,
                None => return (left(&sum), sum.file, sum.ids),
            }
        }
    };
    let is_better = |(residual, file, ids): &(f64, &str, Vec<i64>)| {
        let most = match *file {
            "rwforc" if least > ROUNDED => WORTH * least,
            "rcforc" if least.min(followed) > CLOSELY => 0.5 * least,
            _ => 0.0,
        };
        ids.len() > 1 && *residual <= most.min(FOLLOWS)
    };
    contacts().map(from).filter(is_better).min_by(|a, b| a.0.total_cmp(&b.0))
}

/// Whether the bodies of an explanation stop closing within the record: a run that died before says
/// little of how well its nodes follow the force.
pub(super) fn reaches_the_end(survey: &Survey, explanation: &Explanation) -> bool {
    let bodies: Vec<&Body> = explanation.bodies.iter().map(|&k| &survey.bodies[k]).collect();
    let covers = explanation.force.map_or(usize::MAX, |force| survey.forces[force].covers);
    let states = bodies.iter().map(|body| body.change.len()).fold(covers, usize::min);
    let closing = |velocity: &dyn Fn(&Body) -> f64| match &bodies[..] {
        [body, other] => velocity(body) - velocity(other),
        _ => bodies.first().map_or(0.0, |body| velocity(body)),
    };
    let first = closing(&|body| body.first_velocity);
    let later = |state: usize| closing(&|body| body.first_velocity + body.change[state]);
    first != 0.0 && (0..states).any(|state| later(state) / first < STOPPED)
}

/// What a body's change of velocity leaves of another's, 1 if they do not go against each other.
fn opposed(survey: &Survey, a: usize, b: usize) -> f64 {
    let change = |body: usize| &survey.bodies[body].change[..];
    match Fit::of(change(a), change(b)) {
        fit if fit.mass < 0.0 => fit.residual,
        _ => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn centres_of_gravity_are_known_by_their_titles() {
        fn t(title: &str, expected: bool) {
            assert_eq!(names_centre_of_gravity(Some(title)), expected, "{title}");
        }
        t("COG of the rigid body of car A", true);
        t("N900001_COG", true);
        t("vehicle CG", true);
        t("c.g. of car body", true);
        t("Centre of gravity", true);
        t("center of mass", true);
        t("centre of the nose plate of car A", false);
        t("cogwheel", false);
        t("mass of equipment", false);
        assert!(!names_centre_of_gravity(None));
    }
}
