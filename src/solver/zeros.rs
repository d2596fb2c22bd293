//! Zeros that look like an overwritten part of a binary file, which has no check sums.

use std::collections::HashMap;

use super::problem::{ProblemCode, Problems};
use crate::history::{EntityId, History};

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

/// Whether all components of an entity are needed to tell damage from a quantity that is
/// zero for one state.
pub fn may_vanish(section: &str) -> bool {
    MAY_VANISH.contains(&section)
}

/// Names the states in which a value is exactly zero though it is not in the states around
/// it (at the ends of a history: in the one beside it).
///
/// Displacements, velocities and energies do not do that. Forces may: there, another
/// component of the entity must be there in that state, because a lost contact loses all.
pub fn suspect(section: &str, histories: &[History], problems: &mut Problems) {
    let may_vanish = may_vanish(section);
    let mut of_entity: HashMap<Option<EntityId>, Vec<&History>> = HashMap::new();
    if may_vanish {
        for history in histories {
            of_entity.entry(history.entity).or_default().push(history);
        }
    }
    let mut states: Vec<(usize, usize, String)> = Vec::new();
    for history in histories {
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
            if let Some((_, count, _)) = states.iter_mut().find(|(s, ..)| *s == state) {
                *count += 1;
            } else if states.len() < MAX_STATES {
                states.push((state, 1, history.label()));
            }
        }
    }
    states.sort_by_key(|(state, ..)| *state);
    let time = histories.first().map(|h| h.time.clone());
    for (state, count, first) in states {
        let at = time.as_ref().and_then(|t| t.get(state)).copied().unwrap_or(f64::NAN);
        let message = format!(
            "{section}: {count} values of state {} (time {at:?}), the first of {first}, are zero but not so in the states around it: was the file overwritten there?",
            state + 1
        );
        problems.add(ProblemCode::SuspectZeros, None, None, message);
    }
}

/// States listed; more are damage that needs no list.
const MAX_STATES: usize = 100;

/// States whose value is zero between two that are not.
fn vanishing(values: &[f64]) -> impl Iterator<Item = usize> {
    let is_there = |k: usize| values.get(k).is_some_and(|v| *v != 0.0 && !v.is_nan());
    (1..values.len()).filter(move |&k| {
        let last = k + 1 == values.len();
        values[k] == 0.0 && is_there(k - 1) && (last || is_there(k + 1))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn codes(section: &str, rows: &[(&str, &[f64])]) -> usize {
        let histories: Vec<History> = rows
            .iter()
            .map(|(component, values)| History {
                entity: Some(EntityId::new(7)),
                component: (*component).into(),
                time: (0..values.len()).map(|k| k as f64).collect(),
                values: values.to_vec(),
            })
            .collect();
        let mut problems = Problems::default();
        suspect(section, &histories, &mut problems);
        problems.into_list().len()
    }

    #[test]
    fn a_motion_does_not_vanish_but_a_contact_may() {
        let (gap, all): (&[f64], &[f64]) = (&[1.0, 0.0, 2.0], &[1.0, 3.0, 2.0]);
        assert_eq!(codes("nodout", &[("x_velocity", gap), ("y_velocity", all)]), 1);
        assert_eq!(codes("nodout", &[("x_velocity", &[0.0, 0.0, 2.0])]), 0, "not yet moving");
        assert_eq!(codes("rcforc", &[("x_force", gap), ("y_force", gap)]), 0, "contact lost");
        assert_eq!(codes("rcforc", &[("x_force", gap), ("y_force", all)]), 1);
    }
}
