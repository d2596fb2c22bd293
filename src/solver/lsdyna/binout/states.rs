//! The complete states of a section, in order of their numbers, and the ids of each.

use std::collections::{HashMap, HashSet};
use std::io;
use std::sync::Arc;

use super::records::{Bytes, Component, DataRecord, LISTS, Section};
use crate::order;
use crate::solver::problem::{Diagnostics, Place, Problem, ProblemCode};
use crate::solver::states::finish::{resolve, take};

pub(super) struct StateReader {
    /// Indices of the states, in order of their numbers.
    pub whole: Vec<usize>,
    pub time: Arc<[f64]>,
    /// Ids of each of them where states name their own.
    pub ids: Option<Vec<Ids>>,
}

/// A state's ids; states with the same ones share them.
pub(super) type Ids = Arc<[i64]>;

impl StateReader {
    /// A state is complete if it has a time and no damage; the last one must also have what the
    /// one before has. Of states that a restart wrote again the last ones are kept.
    pub(crate) fn of(section: &Section, bytes: Bytes<'_>) -> io::Result<(Self, Diagnostics)> {
        let mut problems = Diagnostics::default();
        problems.extend(order_of(section));
        let (mut timed, left_out) = Timed::of(section, bytes)?;
        problems.append(left_out);
        let name = format!("{}: ", section.name);
        let place = |i: usize| place_of(section, timed.states[i]);
        let (kept, repeated) = resolve(&timed.time, |_, _| Some(true), place, &name);
        problems.append(repeated);
        timed.keep(&kept);
        if let Some(change) = last_change_of_lists(section, bytes)? {
            problems.extend(timed.leave_out_before(change, section));
        }
        let Timed { states: whole, time } = timed;
        let ids = match section.component("ids") {
            None => ids_by_order(section, &whole, bytes)?,
            Some(component) => Some(ids_of_states(component, &whole, bytes)?),
        };
        problems.extend(repeated_ids(section, ids.as_deref().unwrap_or_default()));
        Ok((Self { whole, time: time.into(), ids }, problems))
    }

    /// Entities that some states lack.
    pub(crate) fn absent(&self, section: &Section) -> Option<Problem> {
        let ids = self.ids.as_ref()?;
        let mut states_with: HashMap<i64, usize> = HashMap::new();
        for id in ids.iter().flat_map(|ids| ids.iter()) {
            *states_with.entry(*id).or_default() += 1;
        }
        let partly = states_with.values().filter(|&&n| n < ids.len()).count();
        let message = format!(
            "{partly} of {} entities are missing from some states (eroded or failed); their values there are NaN",
            states_with.len()
        );
        (partly > 0).then(|| section.problem(ProblemCode::AbsentEntity, &message))
    }
}

/// States that are in the file twice or not in order.
fn order_of(section: &Section) -> Option<Problem> {
    if section.repeated > 0 {
        let message = format!(
            "{} records occur again, the first of state d{} (a restart, or another file of the run with this section); the last ones are kept",
            section.repeated,
            section.first_repeated.unwrap_or_default()
        );
        let state = section.first_repeated.and_then(|n| section.state_index.get(&n));
        let place = state.and_then(|&state| place_of(section, state));
        return Some(section.problem(ProblemCode::RepeatedState, &message).at_place(place));
    }
    let message = "states are not in the order of their numbers; they are returned in that order";
    (!section.states.is_sorted()).then(|| section.problem(ProblemCode::TimeGoesBack, message))
}

struct Timed {
    states: Vec<usize>,
    time: Vec<f64>,
}

impl Timed {
    /// The states without damage, in order of their numbers, and why others are left out.
    fn of(section: &Section, bytes: Bytes<'_>) -> io::Result<(Self, Diagnostics)> {
        let mut order: Vec<usize> = (0..section.states.len()).collect();
        order::sort_by_key(&mut order, |&i| section.states[i]);
        let last = order.last().copied();
        let before = order.len().checked_sub(2).map(|k| order[k]);
        let (mut states, mut time, mut problems) = (Vec::new(), Vec::new(), Diagnostics::default());
        for state in order {
            let value = match section.time_of(state) {
                Some(&place) => bytes.first_real(place)?.filter(|t| t.is_finite()),
                None => None,
            };
            let lacks = || {
                let has = |c: &Component, s: usize| c.records.contains_key(&s);
                let lost = |c: &&Component| before.is_some_and(|b| has(c, b)) && !has(c, state);
                section.components.iter().find(lost).map(|c| c.name.clone())
            };
            let why = match value {
                _ if section.damaged.contains(&state) => Some("a record of it is damaged".into()),
                None => Some("its time is missing".into()),
                Some(_) if Some(state) == last => {
                    lacks().map(|name| format!("it lacks {name}, which the state before has"))
                }
                Some(_) => None,
            };
            match (why, value) {
                (None, Some(value)) => {
                    states.push(state);
                    time.push(value);
                }
                (why, _) => {
                    let (number, why) = (section.states[state], why.unwrap_or_default());
                    let message = format!("state d{number} is left out: {why}");
                    let problem = section.problem(ProblemCode::IncompleteState, &message);
                    problems.push(problem.at_place(place_of(section, state)));
                }
            }
        }
        Ok((Self { states, time }, problems))
    }

    fn keep(&mut self, kept: &[usize]) {
        take(&mut self.time, kept);
        take(&mut self.states, kept);
    }

    /// Leaves out states that were written before a list of ids changed: their rows cannot be
    /// recognised by one id.
    fn leave_out_before(&mut self, change: (usize, u64), section: &Section) -> Option<Problem> {
        let is_behind =
            |k: &usize| section.time_of(self.states[*k]).is_some_and(|time| time.order() > change);
        let kept: Vec<usize> = (0..self.states.len()).filter(is_behind).collect();
        let lost = self.states.len() - kept.len();
        self.keep(&kept);
        let message =
            format!("the ids change; {lost} states that were written before are left out");
        let problem = section.problem(ProblemCode::UnexpectedEntity, &message);
        (lost > 0).then(|| problem.at_place(Some(Place::in_part(change.0, change.1))))
    }
}

/// Where the last list was written that differs from the one above it, in a section with lists
/// of sides or of several kinds of ids.
fn last_change_of_lists(section: &Section, bytes: Bytes<'_>) -> io::Result<Option<(usize, u64)>> {
    let is_plain = section.lists.iter().all(|(name, _)| *name == "ids");
    let mut last_change = None;
    for name in LISTS.into_iter().filter(|_| !is_plain) {
        let mut above: Option<Vec<i64>> = None;
        for (_, place) in section.lists.iter().filter(|(n, _)| *n == name) {
            let list = bytes.integers(*place)?;
            if above.as_ref().is_some_and(|above| *above != list) {
                last_change = last_change.max(Some(place.order()));
            }
            above = Some(list);
        }
    }
    Ok(last_change)
}

/// The ids that each state names itself.
fn ids_of_states(component: &Component, whole: &[usize], bytes: Bytes<'_>) -> io::Result<Vec<Ids>> {
    let mut ids: Vec<Ids> = Vec::with_capacity(whole.len());
    for state in whole {
        let read = match component.records.get(state) {
            Some(&place) => bytes.integers(place)?,
            None => Vec::new(),
        };
        let above = ids.last().filter(|above| ***above == *read).cloned();
        ids.push(above.unwrap_or_else(|| read.into()));
    }
    Ok(ids)
}

/// The ids in force when each state was written, if they changed; sections whose rows
/// need more than an id are not checked.
fn ids_by_order(
    section: &Section,
    whole: &[usize],
    bytes: Bytes<'_>,
) -> io::Result<Option<Vec<Ids>>> {
    let places: Vec<DataRecord> =
        section.lists.iter().filter(|(name, _)| *name == "ids").map(|(_, p)| *p).collect();
    let lists: Vec<Ids> = places
        .iter()
        .map(|&place| bytes.integers(place).map(Ids::from))
        .collect::<io::Result<_>>()?;
    let more = section.lists.iter().any(|(name, _)| *name != "ids");
    if more || lists.windows(2).all(|w| w[0] == w[1]) {
        return Ok(None);
    }
    let of = |state: &usize| {
        let time = section.time_of(*state);
        let before = |p: &DataRecord| time.is_some_and(|t| p.order() < t.order());
        let last = places.iter().rposition(before).unwrap_or(0);
        lists[last].clone()
    };
    Ok(Some(whole.iter().map(of).collect()))
}

fn repeated_ids(section: &Section, ids: &[Ids]) -> Option<Problem> {
    let twice = |ids: &Ids| ids.len() - ids.iter().collect::<HashSet<_>>().len();
    let mut above: Option<&Ids> = None;
    let changed = ids.iter().filter(|&ids| {
        let same = above.replace(ids).is_some_and(|above| Arc::ptr_eq(above, ids));
        !same
    });
    let twice = changed.map(twice).max().unwrap_or(0);
    let message =
        format!("{twice} ids occur twice in one state; the last value of each is returned");
    (twice > 0).then(|| section.problem(ProblemCode::RepeatedLabel, &message))
}

fn place_of(section: &Section, state: usize) -> Option<Place> {
    let records = || section.components.iter().filter_map(|c| c.records.get(&state));
    let place = section.time_of(state).or_else(|| records().min_by_key(|p| p.order()))?;
    Some(Place::in_part(place.part, place.payload.at))
}
