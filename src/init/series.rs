//! Columns over time as a proposal needs them: rising times, motions of nodes, impulses.

use crate::curve::recipe::DisplacementComponent;
use crate::history::History;
use crate::signal::{derivative, integral, interpolate};

/// The states whose time is later than all before: printed times may repeat, restarts go back.
pub(super) fn rising(time: &[f64]) -> Vec<usize> {
    let mut last = f64::NEG_INFINITY;
    let later = |i: &usize| {
        let is_later = time[*i].is_finite() && time[*i] > last;
        if is_later {
            last = time[*i];
        }
        is_later
    };
    (0..time.len()).filter(later).collect()
}

/// The values of some states.
pub(super) fn picked(values: &[f64], states: &[usize]) -> Vec<f64> {
    states.iter().map(|&i| values[i]).collect()
}

/// The histories of a file, entity by entity.
pub(super) fn by_entity(histories: &[History]) -> impl Iterator<Item = &[History]> {
    histories.chunk_by(|a, b| a.entity == b.entity)
}

/// A component of one entity.
pub(super) fn component<'a>(of: &'a [History], name: &str) -> Option<&'a History> {
    of.iter().find(|history| &*history.component == name)
}

/// Velocity of a node at the rising states: the file's, else the rate of its displacement.
pub(super) fn velocity(
    node: &[History],
    direction: DisplacementComponent,
    states: &[usize],
) -> Option<Vec<f64>> {
    if let Some(velocity) = component(node, direction.velocity()) {
        return Some(picked(&velocity.values, states));
    }
    let displacement = component(node, direction.name())?;
    let time = picked(&displacement.time, states);
    (time.len() > 1).then(|| derivative(&time, &picked(&displacement.values, states)))
}

/// Impulse of a force at other times, held before its first and behind its last.
///
/// `None` if the force holds a value that is not a number, or has fewer than two states.
pub(super) fn impulse(force: &History, times: &[f64]) -> Option<Vec<f64>> {
    let states = rising(&force.time);
    let (time, values) = (picked(&force.time, &states), picked(&force.values, &states));
    if time.len() < 2 || values.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let (first, last) = (time[0], time[time.len() - 1]);
    let within: Vec<f64> = times.iter().map(|t| t.clamp(first, last)).collect();
    interpolate(&time, &integral(&time, &values), &within).ok()
}

/// Position of the value that is largest in magnitude; 0 without any.
pub(super) fn largest(values: &[f64]) -> usize {
    let magnitudes = values.iter().map(|v| v.abs()).enumerate();
    magnitudes.fold((0, 0.0), |best, (i, v)| if v > best.1 { (i, v) } else { best }).0
}

/// How well `impulse = mass × change` holds, in the least squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fit {
    /// In the file's units; its sign is that of the force against the velocity.
    pub mass: f64,
    /// What is left of the impulse, as a share of it; 1 if the node does not follow it at all.
    pub residual: f64,
}

impl Fit {
    /// Of the impulse and a change of velocity, as many states of each.
    pub(super) fn of(impulse: &[f64], change: &[f64]) -> Self {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (own, of_change) = (dot(impulse, impulse), dot(change, change));
        if !(own > 0.0 && of_change > 0.0) {
            return Self { mass: 0.0, residual: 1.0 };
        }
        let mass = dot(impulse, change) / of_change;
        let left: f64 = impulse.iter().zip(change).map(|(j, v)| (j - mass * v).powi(2)).sum();
        let residual = (left / own).sqrt();
        Self { mass, residual: if residual.is_finite() { residual } else { 1.0 } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_follows_the_impulse_that_stops_it() {
        let change = [0.0, -1.0, -3.0, -4.0];
        let impulse: Vec<f64> = change.iter().map(|v| -24.0 * v).collect();
        assert_eq!(Fit::of(&impulse, &change), Fit { mass: -24.0, residual: 0.0 });
        assert_eq!(Fit::of(&impulse, &[0.0; 4]).residual, 1.0, "it stands");
        assert_eq!(Fit::of(&impulse, &[f64::NAN; 4]).residual, 1.0);
    }

    #[test]
    fn times_that_do_not_rise_are_passed_over() {
        assert_eq!(rising(&[0.0, 1.0, 1.0, 0.5, f64::NAN, 2.0]), [0, 1, 5]);
        assert_eq!(rising(&[]), [0; 0]);
    }
}
