//! The recipe that most runs agree on: kind, direction, force and nodes; runs that need another
//! one are distinguished, never merged.

use std::collections::BTreeMap;

use super::UserHints;
use super::explain::{self, Explanation, FOLLOWS, RELATED, size};
use super::folders::Reason;
use super::survey::{ForceCandidate, NodeCandidate, Survey};
use crate::curve::recipe::DisplacementComponent;
use crate::history::Side;
use crate::study::StudyKind;

/// A node represents its body if it leaves at most this much more of the impulse than the best
/// one: as a factor and as a share of the impulse.
const AS_GOOD: (f64, f64) = (1.5, 0.01);
/// The same for a node whose title says that it is the centre of gravity.
const CENTRE_AS_GOOD: f64 = 0.05;
/// Steps of the roughness below which velocities are equally smooth, for each whole.
const EVEN: f64 = 10.0;
const NAMED: usize = 5;

/// The recipe that most runs agree on.
#[derive(Clone, Debug)]
pub(super) struct Agreed {
    pub kind: StudyKind,
    pub direction: DisplacementComponent,
    pub nodes: Vec<ChosenNode>,
    /// `None` if no force moves the bodies: then mass times acceleration is used.
    pub force: Option<ChosenForce>,
    /// What the chosen nodes leave of the impulse in the run where they follow it worst.
    pub residual: f64,
    /// The same for what one body of a pair leaves of the other's change of velocity, if no force
    /// moves them.
    pub opposed: Option<f64>,
    /// Bodies that move in the run with most of them.
    pub bodies: usize,
    /// For each run whether it can take the recipe.
    pub(crate) members: Vec<Result<(), Reason>>,
}

/// A node and those that could represent the same body.
#[derive(Clone, Debug)]
pub(super) struct ChosenNode {
    pub id: i64,
    pub title: Option<String>,
    pub residual: f64,
    pub(crate) others: Vec<Alternative>,
}

/// A force and those that could be meant.
#[derive(Clone, Debug)]
pub(super) struct ChosenForce {
    pub file: &'static str,
    pub id: i64,
    pub side: Option<Side>,
    pub component: String,
    pub title: Option<String>,
    /// Whether the other side has the same force.
    pub other_side: bool,
    pub(crate) others: Vec<Alternative>,
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
type Key = (bool, &'static str, Option<(&'static str, i64)>);

/// A run's survey with what explains it best.
struct RunView<'a> {
    survey: &'a Survey,
    best: Option<Explanation>,
    /// Whether it counts: the record covers the crash up to its end, or no run's does.
    counts: bool,
}

impl Agreed {
    /// The recipe of most of the runs; `None` if there are no runs.
    pub(super) fn of(surveys: &[&Survey], given: &UserHints) -> Option<Self> {
        let single = given.half_model.then_some(StudyKind::Wall);
        // A node of the other body means two.
        let two = given.minus_node.map(|_| StudyKind::Pair);
        let kind = single.or(given.kind).or(two);
        let views = RunView::all(surveys, given, kind);
        let mut votes: BTreeMap<Key, Vec<usize>> = BTreeMap::new();
        for (k, view) in views.iter().enumerate().filter(|(_, view)| view.counts) {
            votes.entry(key(view)).or_default().push(k);
        }
        // Of equally many votes the force that explains more, then the first run's.
        let left = |runs: &[usize]| -> f64 { runs.iter().map(|&k| views[k].residual()).sum() };
        let (key, voters) = votes.iter().min_by(|a, b| {
            let by_votes = b.1.len().cmp(&a.1.len());
            by_votes.then(left(a.1).total_cmp(&left(b.1))).then(a.1[0].cmp(&b.1[0]))
        })?;
        let model = &views[voters[0]];
        let explained: Vec<Result<Option<Explanation>, Reason>> =
            views.iter().map(|view| view.takes(key, kind, given)).collect();
        let direction = model.survey.direction;
        let mut agreed = Self {
            kind: if key.0 { StudyKind::Pair } else { StudyKind::Wall },
            direction,
            nodes: Vec::new(),
            force: None,
            residual: 0.0,
            opposed: None,
            bodies: surveys.iter().map(|survey| survey.bodies.len()).max().unwrap_or(0),
            members: Vec::new(),
        };
        agreed.force = key.2.and_then(|_| chosen_force(&views, &explained));
        if agreed.force.is_none() && agreed.kind == StudyKind::Pair {
            let residuals = explained.iter().flatten().flatten().map(|e| e.residual);
            agreed.opposed = Some(residuals.fold(0.0, f64::max));
        }
        agreed.choose_nodes(&views, &explained, given);
        Some(agreed)
    }

    /// Chooses a node for each body, and names the runs that do not have it.
    fn choose_nodes(
        &mut self,
        views: &[RunView<'_>],
        explained: &[Result<Option<Explanation>, Reason>],
        given: &UserHints,
    ) {
        let bodies = if self.kind == StudyKind::Pair { 2 } else { 1 };
        let are_given = given.node.is_some() || given.force.is_some();
        let given = [given.node, given.minus_node];
        for (slot, given) in given.into_iter().take(bodies).enumerate() {
            let of_runs: Vec<Vec<NodeVerdict<'_>>> = views
                .iter()
                .zip(explained)
                .map(|(view, explained)| match explained {
                    Ok(explained) if view.counts => judged(view.survey, explained.as_ref(), slot),
                    _ => Vec::new(),
                })
                .collect();
            self.nodes.extend(choose(&of_runs, given, self.force.is_some()));
        }
        let nodes: Vec<i64> = self.nodes.iter().map(|node| node.id).collect();
        self.members = views
            .iter()
            .zip(explained)
            .map(|(view, explained)| match explained {
                Ok(explained) => view.has_nodes(explained.as_ref(), &nodes, are_given),
                Err(reason) => Err(reason.clone()),
            })
            .collect();
        self.residual = self.nodes.iter().map(|node| node.residual).fold(0.0, f64::max);
    }
}

/// What explains a run best, with the force that the caller names if he does.
fn best(survey: &Survey, given: &UserHints, kind: Option<StudyKind>) -> Option<Explanation> {
    match &given.force {
        Some(named) => {
            let force = survey.force(&named.file, named.id)?;
            explain::of_force(survey, force, kind)
        }
        None => explain::best_of(survey, kind).or_else(|| explain::without_force(survey, kind)),
    }
}

fn key(view: &RunView<'_>) -> Key {
    let direction = view.survey.direction.axis();
    match &view.best {
        Some(best) => {
            let force = view.moved_by(best).map(|force| (force.file, force.id));
            (best.kind == StudyKind::Pair, direction, force)
        }
        None => (false, direction, None),
    }
}

impl<'a> RunView<'a> {
    /// All runs, each with what explains it best.
    fn all(surveys: &[&'a Survey], given: &UserHints, kind: Option<StudyKind>) -> Vec<Self> {
        let view = |survey: &&'a Survey| {
            let best = best(survey, given, kind);
            let counts = best.as_ref().is_some_and(|best| explain::reaches_the_end(survey, best));
            Self { survey: *survey, best, counts }
        };
        let mut views: Vec<Self> = surveys.iter().map(view).collect();
        if !views.iter().any(|view| view.counts) {
            views.iter_mut().for_each(|view| view.counts = true);
        }
        views
    }

    fn residual(&self) -> f64 {
        let by_force = self.best.as_ref().filter(|best| best.force.is_some());
        by_force.map_or(1.0, |best| best.residual)
    }

    fn moved_by(&self, explanation: &Explanation) -> Option<&ForceCandidate> {
        explanation.force.map(|force| &self.survey.forces[force])
    }

    /// Why a run is not a member where one body moves and in the others two do, or the other way.
    fn other_kind(&self, is_pair: bool) -> Option<Reason> {
        let is_other = self.best.as_ref().is_some_and(|b| (b.kind == StudyKind::Pair) != is_pair)
            && self.counts;
        let (own, others) = if is_pair {
            ("one body moves", "two bodies do")
        } else {
            ("two bodies move", "one does")
        };
        let why = format!("{own} in it, {others} in the others");
        is_other.then_some(Reason::OtherRecipe { why })
    }

    /// What the recipe's force explains of the run, or why the run needs another recipe.
    fn takes(
        &self,
        key: &Key,
        kind: Option<StudyKind>,
        given: &UserHints,
    ) -> Result<Option<Explanation>, Reason> {
        let other = |why: String| Err(Reason::OtherRecipe { why });
        let (is_pair, direction, force) = *key;
        if self.survey.direction.axis() != direction {
            return other(format!("it moves along {}", self.survey.direction.axis()));
        }
        let Some((file, id)) = force else {
            let best = self.best.clone();
            if best.as_ref().is_some_and(|best| best.force.is_some()) {
                return other("it has a contact force, the others have none".into());
            }
            return match self.other_kind(is_pair) {
                Some(reason) => Err(reason),
                None => Ok(best.map(|explained| self.with_first(explained, given.node))),
            };
        };
        let wanted = kind.unwrap_or(if is_pair { StudyKind::Pair } else { StudyKind::Wall });
        let found = self
            .survey
            .force(file, id)
            .and_then(|force| explain::of_force(self.survey, force, Some(wanted)))
            .filter(|e| e.residual < RELATED || given.force.is_some() || !self.counts)
            .map(|explained| self.with_first(explained, given.node));
        let own = self.best.as_ref().and_then(|best| self.moved_by(best));
        match (found, self.other_kind(is_pair), own) {
            (Some(_), Some(reason), _) => Err(reason),
            (Some(found), None, _) => Ok(Some(found)),
            (None, _, Some(own)) => {
                other(format!("{file} {id} does not move its bodies, {} {} does", own.file, own.id))
            }
            (None, _, None) => other(match self.survey.force(file, id) {
                Some(_) => format!("{file} {id} does not move its bodies"),
                None => format!("it has no {file} {id} along the motion"),
            }),
        }
    }

    /// The same with the body of the node that the caller names first.
    fn with_first(&self, mut explained: Explanation, node: Option<i64>) -> Explanation {
        let has = |body: &usize| {
            self.survey.bodies[*body].nodes.iter().any(|candidate| Some(candidate.id) == node)
        };
        if let Some(slot) = explained.bodies.iter().position(has) {
            explained.bodies.swap(0, slot);
        }
        explained
    }

    /// Whether the run has the recipe's nodes, and they follow the force.
    fn has_nodes(
        &self,
        explained: Option<&Explanation>,
        nodes: &[i64],
        are_given: bool,
    ) -> Result<(), Reason> {
        for (slot, id) in nodes.iter().enumerate() {
            let judged = judged(self.survey, explained, slot);
            let is_there = judged.iter().find(|j| j.node.id == *id);
            let best = judged.iter().min_by(|a, b| a.residual.total_cmp(&b.residual));
            let own = best.map_or(String::new(), |best| {
                format!("; there {} would be taken", named(best.node))
            });
            match is_there {
                None => {
                    return Err(Reason::OtherRecipe {
                        why: format!("it has no moving node {id}{own}"),
                    });
                }
                Some(found) if self.counts && !are_given && found.residual >= RELATED => {
                    let why = format!("node {id} does not follow the force{own}");
                    return Err(Reason::OtherRecipe { why });
                }
                Some(_) => {}
            }
        }
        Ok(())
    }
}

/// A node of a body with what it leaves of the recipe's impulse.
struct NodeVerdict<'a> {
    node: &'a NodeCandidate,
    residual: f64,
}

/// The nodes of one of the bodies that a force explains; without a force those of the body in
/// that place.
fn judged<'a>(
    survey: &'a Survey,
    explained: Option<&Explanation>,
    slot: usize,
) -> Vec<NodeVerdict<'a>> {
    let (body, force) = match explained {
        Some(explained) => (explained.bodies.get(slot).copied(), explained.force),
        None => (Some(slot), None),
    };
    let body = body.and_then(|body| survey.bodies.get(body));
    let nodes = body.map(|body| &body.nodes[..]).unwrap_or_default();
    nodes
        .iter()
        .map(|node| NodeVerdict {
            node,
            residual: force.map_or(0.0, |force| node.fits[force].residual),
        })
        .collect()
}

/// The verdicts of all runs on a node.
struct NodeTally<'a> {
    node: &'a NodeCandidate,
    /// In which it can represent the body.
    runs: usize,
    /// The largest of all runs.
    residual: f64,
    /// Of all runs together, and how many that are.
    roughness: f64,
    seen: f64,
}

/// The node that can represent the body in most runs: a centre of gravity first, then the one
/// with the smoothest velocity.
fn choose(
    of_runs: &[Vec<NodeVerdict<'_>>],
    given: Option<i64>,
    by_force: bool,
) -> Option<ChosenNode> {
    let mut sums: BTreeMap<i64, NodeTally<'_>> = BTreeMap::new();
    for run in of_runs {
        let best = run.iter().map(|j| j.residual).fold(f64::INFINITY, f64::min);
        for NodeVerdict { node, residual } in run {
            let limit = if names_centre_of_gravity(node.title.as_deref()) {
                best + CENTRE_AS_GOOD
            } else {
                AS_GOOD.0 * best + AS_GOOD.1
            };
            let empty = NodeTally { node, runs: 0, residual: 0.0, roughness: 0.0, seen: 0.0 };
            let sum = sums.entry(node.id).or_insert(empty);
            sum.runs += usize::from(*residual <= limit);
            sum.residual = sum.residual.max(*residual);
            sum.roughness += node.roughness;
            sum.seen += 1.0;
        }
    }
    let centre = |sum: &NodeTally<'_>| names_centre_of_gravity(sum.node.title.as_deref());
    // Of equally smooth ones, such as the nodes of a rigid body, the one that follows best.
    let roughness = |sum: &NodeTally<'_>| (sum.roughness / sum.seen * EVEN).round();
    let mut sums: Vec<NodeTally<'_>> = sums.into_values().collect();
    sums.sort_by(|a, b| {
        (Some(b.node.id) == given)
            .cmp(&(Some(a.node.id) == given))
            .then(b.runs.cmp(&a.runs))
            .then(centre(b).cmp(&centre(a)))
            .then(roughness(a).total_cmp(&roughness(b)))
            .then(a.residual.total_cmp(&b.residual))
            .then(a.node.id.cmp(&b.node.id))
    });
    if let Some(id) = given
        && sums.first().is_none_or(|first| first.node.id != id)
    {
        // Told of each run that does not have it.
        return Some(ChosenNode { id, title: None, residual: 1.0, others: Vec::new() });
    }
    let (first, others) = sums.split_first()?;
    let about = |sum: &NodeTally<'_>| {
        let title = sum.node.title.as_ref().map_or(String::new(), |title| format!("\"{title}\", "));
        if by_force {
            format!("{title}follows the impulse within {} %", percent(sum.residual))
        } else {
            format!("{title}starts at the same velocity")
        }
    };
    let others = others
        .iter()
        .filter(|sum| sum.residual <= FOLLOWS.max(2.0 * first.residual))
        .take(NAMED)
        .map(|sum| Alternative { id: sum.node.id.to_string(), about: about(sum) })
        .collect();
    let title = first.node.title.clone();
    Some(ChosenNode { id: first.node.id, title, residual: first.residual, others })
}

/// The force that the members share, as the recipe names it; `None` if none moves them.
fn chosen_force(
    views: &[RunView<'_>],
    explained: &[Result<Option<Explanation>, Reason>],
) -> Option<ChosenForce> {
    let of_members: Vec<(&Survey, &ForceCandidate)> = views
        .iter()
        .zip(explained)
        .filter_map(|(view, e)| Some((view.survey, view.moved_by(e.as_ref().ok()?.as_ref()?)?)))
        .collect();
    let (first, force) = *of_members.first()?;
    let all = || of_members.iter().map(|(_, force)| *force);
    // Where a wall's normal force is not that along the motion in one run, the latter is taken.
    let along = all().find(|f| f.component != "normal_force").unwrap_or(force);
    let named = |f: &ForceCandidate| (f.file, f.id);
    let others = (0..first.forces.len())
        .filter(|&k| named(&first.forces[k]) != named(force))
        .filter_map(|k| Some((&first.forces[k], explain::of_force(first, k, None)?)))
        .filter(|(_, other)| other.residual < RELATED)
        .take(NAMED)
        .map(|(candidate, other)| {
            let title = candidate.title.as_ref();
            Alternative {
                id: format!("{} {}", candidate.file, candidate.id),
                about: format!(
                    "{}bodies follow it within {} %; its impulse is {} % of the chosen one's",
                    title.map_or(String::new(), |title| format!("\"{title}\", ")),
                    percent(other.residual),
                    percent(size(candidate) / size(force))
                ),
            }
        })
        .collect();
    Some(ChosenForce {
        file: force.file,
        id: force.id,
        side: force.side,
        component: along.component.into(),
        title: force.title.clone(),
        other_side: all().all(|f| f.other_side),
        others,
    })
}

/// A share in percent, with one digit below ten.
pub(super) fn percent(share: f64) -> String {
    let percent = share * 100.0;
    if percent < 9.95 { format!("{percent:.1}") } else { format!("{percent:.0}") }
}

fn named(node: &NodeCandidate) -> String {
    match &node.title {
        Some(title) => format!("{} \"{title}\"", node.id),
        None => node.id.to_string(),
    }
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
