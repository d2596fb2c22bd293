//! Which force of a run moved which of its bodies.

use super::survey::{Body, ForceCandidate, Survey};
use crate::study::StudyKind;

/// A node follows an impulse if it leaves less than this share of it.
pub(super) const FOLLOWS: f64 = 0.1;
/// A node that leaves more than this share of an impulse has nothing to do with it.
pub(super) const RELATED: f64 = 0.3;
/// Impulses that differ by less are equal.
const EQUAL: f64 = 0.02;

/// A force and the bodies that it acts on.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Explanation {
    pub kind: StudyKind,
    /// Index into the survey's forces.
    pub force: usize,
    /// Indices into the survey's bodies: the moving one, and of a pair the other.
    pub bodies: Vec<usize>,
    /// What the best node of each body leaves of the impulse, the larger one of a pair.
    pub residual: f64,
}

/// The best node of a body for a force: its residual, and the sign of its mass.
fn best(body: &Body, force: usize) -> (f64, f64) {
    let fits = body.nodes.iter().map(|node| node.fits[force]);
    fits.fold((1.0, 0.0), |best, fit| match fit.residual < best.0 {
        true => (fit.residual, fit.mass.signum()),
        false => best,
    })
}

/// What a force explains: two bodies that it drives apart, or one that it stops.
pub(super) fn of_force(
    survey: &Survey,
    force: usize,
    kind: Option<StudyKind>,
) -> Option<Explanation> {
    let bodies: Vec<(f64, f64)> = survey.bodies.iter().map(|body| best(body, force)).collect();
    let indices = 0..bodies.len();
    let pairs = indices.clone().flat_map(|a| (a + 1..bodies.len()).map(move |b| (a, b)));
    let pair = pairs
        .filter(|&(a, b)| bodies[a].1 * bodies[b].1 < 0.0)
        .map(|(a, b)| (bodies[a].0.max(bodies[b].0), vec![a, b]))
        .min_by(|x, y| x.0.total_cmp(&y.0));
    let single = indices.map(|a| (bodies[a].0, vec![a])).min_by(|x, y| x.0.total_cmp(&y.0));
    let explanation = |kind, (residual, bodies)| Explanation { kind, force, bodies, residual };
    match kind {
        Some(StudyKind::Pair) => pair.map(|found| explanation(StudyKind::Pair, found)),
        Some(StudyKind::Wall) => single.map(|found| explanation(StudyKind::Wall, found)),
        None => match pair.filter(|(residual, _)| *residual < RELATED) {
            Some(found) => Some(explanation(StudyKind::Pair, found)),
            None => single.map(|found| explanation(StudyKind::Wall, found)),
        },
    }
}

/// The force that explains most: of those that a node follows, the one with the largest impulse.
pub(super) fn best_of(survey: &Survey, kind: Option<StudyKind>) -> Option<Explanation> {
    let explained: Vec<Explanation> = (0..survey.forces.len())
        .filter_map(|force| of_force(survey, force, kind))
        .filter(|e| e.residual < RELATED)
        .collect();
    let least = explained.iter().map(|e| e.residual).fold(f64::INFINITY, f64::min);
    let follows = |e: &&Explanation| e.residual <= FOLLOWS.max(2.0 * least);
    let size = |e: &Explanation| size(&survey.forces[e.force]);
    let is_section = |e: &Explanation| survey.forces[e.force].file == "secforc";
    let largest = |sections: bool| {
        let of_kind =
            || explained.iter().filter(follows).filter(move |e| is_section(e) == sections);
        let most = of_kind().map(size).fold(0.0, f64::max);
        // The survey has them by size: of equal ones a wall's comes before an interface's.
        let equal = of_kind().filter(|e| size(e) >= (1.0 - EQUAL) * most);
        equal.min_by_key(|e| rank(&survey.forces[e.force])).cloned()
    };
    // A section carries only what passes through it, so it stands for no contact that is there.
    largest(false).or_else(|| largest(true))
}

/// Largest impulse of a force, in the file's units.
pub(super) fn size(force: &ForceCandidate) -> f64 {
    force.impulse.iter().map(|j| j.abs()).fold(0.0, f64::max)
}

fn rank(force: &ForceCandidate) -> (usize, i64) {
    let place = super::sources::FORCES.iter().position(|name| *name == force.file);
    (place.unwrap_or(usize::MAX), force.id)
}
