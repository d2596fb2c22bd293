//! Zeros that look like an overwritten part of a binary file, which has no checksums.
//!
//! One value, or all of one entity's, may be zero in one state for physical reasons: a node rests on
//! a wall, a contact is lost. So only several values next to each other are named.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use super::problem::{Problem, ProblemCode};
use crate::history::{EntityId, History};
use crate::order;

/// Sections whose quantities may really vanish for one state, such as a contact's force.
const MAY_VANISH: [&str; 12] = [
    "abstat",
    "bndout",
    "deforc",
    "jntforc",
    "ncforc",
    "nodfor",
    "rcforc",
    "rwforc/forces",
    "secforc",
    "sleout",
    "spcforc",
    "swforc",
];

/// Entities next to each other that lose one component in one state before that is named.
const ENTITIES: usize = 3;

/// Whether all components of an entity are needed to distinguish damage from a quantity that is
/// zero for one state.
pub(crate) fn may_vanish(section: &str) -> bool {
    MAY_VANISH.contains(&section)
}

/// Names the states in which a component is exactly zero for several entities next to each
/// other, though it is not in the states around it (at the ends of a history: in the one
/// next to it), and for most of them returns to about what it was.
///
/// The last distinguishes zeros that overwrote values from a front that rests on a wall for
/// one state. Forces may vanish together: there, another component of the entity must be
/// there in that state, because a lost contact loses all.
pub(crate) fn suspect(section: &str, histories: &[History]) -> Vec<Problem> {
    let mut found = runs_of_zeros(section, histories);
    order::sort_by_key(&mut found, |run| run.state);
    found.iter().map(|run| run.problem(section, histories)).collect()
}

fn runs_of_zeros(section: &str, histories: &[History]) -> Vec<Run> {
    let may_vanish = may_vanish(section);
    let mut of_entity: HashMap<Option<EntityId>, Vec<&History>> = HashMap::new();
    if may_vanish {
        for history in histories {
            of_entity.entry(history.entity).or_default().push(history);
        }
    }
    let states = histories.first().map_or(0, |h| h.values.len());
    let mut found: Vec<Run> = Vec::new();
    let mut runs: Vec<Option<Run>> = vec![None; states];
    let mut component: Option<&Arc<str>> = None;
    for (k, history) in histories.iter().enumerate() {
        if component.replace(&history.component) != Some(&history.component) {
            runs.fill(None);
        }
        let values = &history.values;
        // Most have no zero at all, which is found fast.
        if !values.contains(&0.0) {
            continue;
        }
        for state in vanishing(values) {
            let others = of_entity.get(&history.entity);
            let alone = others.is_none_or(|all| all.iter().any(|h| h.values[state] != 0.0));
            if may_vanish && !alone {
                continue;
            }
            let run = Run::with(runs[state], state, k, returns(values, state));
            runs[state] = Some(run);
            if run.is_suspect() {
                let known = found.iter().position(|r| r.state == state && r.first == run.first);
                match known {
                    Some(shorter) => found[shorter] = run,
                    None if found.len() < MAX_RUNS => found.push(run),
                    None => {}
                }
            }
        }
    }
    found
}

/// Entities next to each other whose component vanishes in one state.
#[derive(Clone, Copy)]
struct Run {
    state: usize,
    /// Indices of the first and the last history.
    first: usize,
    last: usize,
    /// How many are after it about what they were before.
    returning: usize,
}

impl Run {
    /// The run that history `k` ends: the one above it, if that ends right above.
    fn with(above: Option<Self>, state: usize, k: usize, returns: bool) -> Self {
        let above = above.filter(|run| run.last + 1 == k);
        let first = above.map_or(k, |run| run.first);
        let returning = above.map_or(0, |run| run.returning) + usize::from(returns);
        Self { state, first, last: k, returning }
    }

    fn problem(&self, section: &str, histories: &[History]) -> Problem {
        let Self { state, first, last, .. } = *self;
        let at = histories[first].time.get(state).copied().unwrap_or(f64::NAN);
        let message = format!(
            "{section}: {} values of state {} (time {at:?}), {} to {}, are zero, but not in the states around it: was the file overwritten there?",
            last - first + 1,
            state + 1,
            histories[first].label(),
            histories[last].label(),
        );
        Problem::new(ProblemCode::SuspectZeros, message)
    }

    fn is_suspect(&self) -> bool {
        let length = self.last - self.first + 1;
        length >= ENTITIES && 2 * self.returning > length
    }
}

/// Runs listed; more are damage that needs no list.
const MAX_RUNS: usize = 100;

/// Where zeros next to each other begin and end among the values of a state.
pub(crate) type Zeros = Vec<Range<usize>>;

/// Where at least as many values of a component next to each other are zero as make a suspicion; `widths`: how many
/// values each component has.
pub(crate) fn zeros_of_state(widths: impl Iterator<Item = usize>, values: &[f64]) -> Zeros {
    let mut runs = Vec::new();
    let mut from = 0;
    for width in widths {
        let to = from + width;
        while from < to {
            let zeros = values[from..to].iter().take_while(|v| **v == 0.0).count();
            if zeros >= ENTITIES {
                runs.push(from..from + zeros);
            }
            from += zeros;
            from += values[from..to].iter().take_while(|v| **v != 0.0).count();
        }
    }
    runs
}

/// Whether [`suspect`] could name any of the zeros of all states: several next to each other that are not zero in
/// the states around.
pub(crate) fn may_be_suspect(states: &[Zeros]) -> bool {
    let none = Vec::new();
    (1..states.len()).any(|state| {
        let around = [&states[state - 1], states.get(state + 1).unwrap_or(&none)];
        states[state].iter().any(|run| longest_outside(run, around) >= ENTITIES)
    })
}

/// The longest part of a range that none of the others covers.
fn longest_outside(run: &Range<usize>, around: [&Zeros; 2]) -> usize {
    let overlapping = |all: &&Zeros| {
        let from = all.partition_point(|other| other.end <= run.start);
        let to = all.partition_point(|other| other.start < run.end);
        all[from..to].to_vec()
    };
    let mut others: Zeros = around.iter().flat_map(overlapping).collect();
    order::sort_by_key(&mut others, |other| other.start);
    let (mut from, mut longest) = (run.start, 0);
    for other in others {
        longest = longest.max(other.start.saturating_sub(from));
        from = from.max(other.end);
    }
    longest.max(run.end.saturating_sub(from))
}

/// States whose value is zero between two that are not.
fn vanishing(values: &[f64]) -> impl Iterator<Item = usize> {
    let is_there = |k: usize| values.get(k).is_some_and(|v| *v != 0.0 && !v.is_nan());
    (1..values.len()).filter(move |&k| {
        let last = k + 1 == values.len();
        values[k] == 0.0 && is_there(k - 1) && (last || is_there(k + 1))
    })
}

/// Whether a value is after a state about what it was before: of the same sign and at most
/// twice as large. At the last state this cannot be determined.
fn returns(values: &[f64], state: usize) -> bool {
    let (before, behind) = (values[state - 1], values.get(state + 1).copied());
    behind.is_none_or(|behind| (0.5..=2.0).contains(&(behind / before)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Problems of one component of several entities.
    fn codes(section: &str, rows: &[&[f64]], others: Option<&[f64]>) -> Vec<String> {
        let history = |component: &str, id: usize, values: &[f64]| History {
            entity: Some(EntityId::new(id as i64)),
            component: component.into(),
            time: (0..values.len()).map(|k| k as f64).collect(),
            values: values.to_vec(),
        };
        let mut histories: Vec<History> =
            rows.iter().enumerate().map(|(k, values)| history("x", k, values)).collect();
        if let Some(values) = others {
            histories.extend((0..rows.len()).map(|k| history("y", k, values)));
        }
        suspect(section, &histories).into_iter().map(|p| p.message).collect()
    }

    #[test]
    fn several_values_beside_each_other_do_not_vanish() {
        let (gap, all): (&[f64], &[f64]) = (&[1.0, 0.0, 1.5], &[1.0, 3.0, 2.0]);
        let said = codes("nodout", &[gap, gap, gap, all], None);
        assert_eq!(said.len(), 1);
        assert!(said[0].contains("3 values of state 2 (time 1.0), x[0] to x[2], are"), "{said:?}");
        assert_eq!(codes("rcforc", &[gap; 3], Some(all)).len(), 1);
    }

    #[test]
    fn a_node_on_a_wall_and_a_lost_contact_are_no_damage() {
        let (gap, all): (&[f64], &[f64]) = (&[1.0, 0.0, 1.5], &[1.0, 3.0, 2.0]);
        let stands: &[f64] = &[10.0, 0.0, -0.3];
        assert_eq!(codes("nodout", &[gap, gap, all, gap, gap], None), [""; 0], "single nodes");
        assert_eq!(codes("nodout", &[stands; 5], None), [""; 0], "a front on a wall");
        let rests: &[f64] = &[0.0, 0.0, 2.0];
        assert_eq!(codes("nodout", &[rests; 5], None), [""; 0], "not yet moving");
        assert_eq!(codes("rcforc", &[gap; 5], Some(gap)), [""; 0], "contact lost");
    }
}
