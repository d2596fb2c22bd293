//! Which force of a run moved which of its bodies; without one, which bodies pushed each other.

use super::sources::Fit;
use super::survey::{Body, ForceCandidate, STOPPED, Survey};
use crate::study::StudyKind;

/// A node follows an impulse if it leaves less than this share of it.
pub(super) const FOLLOWS: f64 = 0.1;
/// A node that leaves more than this share of an impulse has nothing to do with it.
pub(super) const RELATED: f64 = 0.3;
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
    let largest = |files: &[&str]| {
        let of_kind = || {
            let following =
                explained.iter().filter(|(_, e)| e.residual <= FOLLOWS.max(2.0 * least));
            following.filter(move |(force, _)| files.contains(&force.file))
        };
        let most = of_kind().map(|(force, _)| force.size()).fold(0.0, f64::max);
        // The survey has them by size: of equal ones a wall's comes before an interface's.
        let equal = of_kind().filter(|(force, _)| force.size() >= (1.0 - EQUAL) * most);
        equal.min_by_key(|(force, _)| force.rank()).map(|(_, e)| e.clone())
    };
    // A section carries only what passes through it, and a rigid body may be the one that is stopped: neither represents
    // a contact that is there.
    let [contacts, bodies, sections] = [&["rwforc", "rcforc"][..], &["rbdout"], &["secforc"]];
    largest(contacts).or_else(|| largest(bodies)).or_else(|| largest(sections))
}

/// The choice if no force explains a run: two bodies whose velocities change against each
/// other at one ratio all along, as m₁Δv₁ = −m₂Δv₂ has it for two that meet only each other; else
/// the fastest one. A pair that is requested is the two that come closest to it.
pub(super) fn without_force(survey: &Survey, kind: Option<StudyKind>) -> Option<Explanation> {
    let bodies = survey.bodies.len();
    let pair = best_pair(bodies, |a, b| Some(opposed(survey, a, b)));
    chosen(kind, None, pair, (bodies > 0).then(|| (1.0, vec![0])))
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
