//! Rows of the same components, and the end of states and files: a complete state is kept, an incomplete one is left out and reported; complete states
//! become histories. States that a restart wrote again are resolved.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use super::{ABSENT_CELLS, ABSENT_PER_PRESENT, Pending, StateReader};
use crate::history::{EntityId, History};
use crate::solver::problem::{Diagnostics, Place, Problem, ProblemCode};
use crate::solver::{Entity, Selection, SolverFile};

impl StateReader<'_> {
    /// Ends the pending state; keeps it if it is complete.
    pub(crate) fn close(&mut self, at_end: bool) {
        let Some(pending) = self.pending.take() else { return };
        match (pending.time, self.missing(&pending, at_end)) {
            (Some(time), None) if self.skip > 0 => {
                self.skip -= 1;
                let message = format!(
                    "the state at time {time:?} has other entities than the states below it; it is left out"
                );
                self.problems.add(ProblemCode::IncompleteState, Some(pending.place), message);
                for table in &mut self.tables {
                    table.forget_rows();
                }
                self.scalars.clear();
            }
            (Some(time), None) => self.keep(time, &pending),
            (time, missing) => {
                self.disagreeing += usize::from(pending.disagrees);
                let missing = missing.unwrap_or_else(|| "its time is missing".into());
                let states = self.time.len();
                // Counted by those that are kept it would have the number of the next one.
                let which =
                    time.map_or("a state".into(), |time| format!("the state at time {time:?}"));
                let message = format!("{which} is not complete and is left out: {missing}");
                self.problems.add(ProblemCode::IncompleteState, Some(pending.place), message);
                // Labels that only dropped states had must not become components.
                self.scalars.retain(|s| s.absent < states);
            }
        }
        self.clear_pending();
    }

    /// Forgets what the pending state has.
    pub(super) fn clear_pending(&mut self) {
        for table in &mut self.tables {
            table.next_row = 0;
            let width = table.wanted_columns.len();
            for row in table.filled_rows.drain(..) {
                table.filled[row] = false;
                // What a state that was left out had must not be in the next one.
                if let Some(first) = table.channel_of[row] {
                    for channel in &mut table.channels[first..first + width] {
                        (channel.pending, channel.pending_seen) = (f64::NAN, false);
                    }
                }
            }
        }
        for scalar in &mut self.scalars {
            scalar.pending = None;
        }
    }

    /// What a pending state lacks to be complete.
    pub(super) fn missing(&self, pending: &Pending, at_end: bool) -> Option<String> {
        for table in &self.tables {
            let (have, want) = (table.filled_rows.len(), table.rows.len());
            if table.varies {
                // Rows come in order, so that a cut takes the last ones.
                let cut = table.last_row.filter(|&last| at_end && !table.filled[last]);
                if let Some(last) = cut {
                    return Some(format!("its {} end before {}", table.name, table.rows[last]));
                }
            } else if have < want {
                let first = table.filled.iter().position(|f| !f)?;
                return Some(format!(
                    "{} of {want} {} are missing, the first of {}",
                    want - have,
                    table.name,
                    table.rows[first]
                ));
            }
        }
        if pending.damaged {
            return Some("a row of it is damaged".into());
        }
        // A cut takes labels from the end; labels missing elsewhere are a choice of the solver.
        let last = self.scalars.iter().rev().find(|s| s.absent == 0);
        match last {
            Some(last) if at_end && self.sealed && last.pending.is_none() => {
                Some(format!("its labels end before \"{}\"", last.component))
            }
            _ if !self.allow_empty_states
                && self.tables.iter().all(|t| t.filled_rows.is_empty())
                && pending.labels == 0 =>
            {
                Some("it has no rows".into())
            }
            _ if self.lacks_most() => {
                Some("the states above already lack most of their entities".into())
            }
            _ => None,
        }
    }

    /// Whether the kept states lack most of their values.
    pub(super) fn lacks_most(&self) -> bool {
        self.absent_cells > ABSENT_CELLS + ABSENT_PER_PRESENT * self.present_cells
    }

    fn keep(&mut self, time: f64, pending: &Pending) {
        self.sealed = true;
        self.time.push(time);
        self.places.push(pending.place);
        self.cycles.push(pending.cycle);
        for table in &mut self.tables {
            table.lines = HashMap::new();
            if table.varies {
                table.last_row = table.filled_rows.iter().max().copied();
                for &row in &table.filled_rows {
                    table.states_with[row] += 1;
                }
                let (rows, filled) = (table.rows.len(), table.filled_rows.len());
                self.absent_cells += (rows - filled) * table.components.len();
                self.present_cells += filled * table.components.len();
            }
            for channel in &mut table.channels {
                channel.values.push(channel.pending);
                channel.seen += usize::from(channel.pending_seen);
            }
        }
        for scalar in &mut self.scalars {
            let absent = usize::from(scalar.pending.is_none());
            scalar.absent += absent;
            self.absent_cells += absent;
            self.present_cells += 1 - absent;
            if scalar.kept {
                scalar.values.push(scalar.pending.unwrap_or(f64::NAN));
            }
        }
    }

    /// The file without what its header says.
    pub(crate) fn finish(mut self) -> SolverFile {
        self.close(true);
        self.resolve_restarts();
        let time: Arc<[f64]> = self.time.into();
        let mut file = SolverFile { time: time.clone(), ..SolverFile::default() };
        if self.sealed {
            let found = collect_tables(self.tables, &mut file);
            self.problems.append(found);
            for scalar in self.scalars {
                if scalar.absent > 0 {
                    let message = format!(
                        "{} is missing from {} of {} states; its values there are NaN",
                        scalar.component,
                        scalar.absent,
                        time.len()
                    );
                    self.problems.add(ProblemCode::AbsentComponent, None, message);
                }
                file.components.push(scalar.component.clone());
                if scalar.kept {
                    file.histories.push(History {
                        entity: None,
                        component: scalar.component,
                        time: time.clone(),
                        values: scalar.values,
                    });
                }
            }
        }
        file.problems = self.problems.into_list();
        file
    }

    /// Leaves out the states that a restart wrote again.
    fn resolve_restarts(&mut self) {
        let place = |i: usize| self.places.get(i).copied();
        let (kept, found) = restarts(&self.time, &self.cycles, self.time_digits, place);
        self.problems.append(found);
        if kept.len() == self.time.len() {
            return;
        }
        let take = |values: &mut Vec<f64>| take(values, &kept);
        take(&mut self.time);
        for channel in self.tables.iter_mut().flat_map(|t| &mut t.channels) {
            take(&mut channel.values);
        }
        for scalar in &mut self.scalars {
            take(&mut scalar.values);
        }
    }
}

/// The states of a text file that count, and what was left out.
pub(crate) fn restarts(
    time: &[f64],
    cycles: &[Option<i64>],
    digits: i32,
    place: impl Fn(usize) -> Option<Place>,
) -> (Vec<usize>, Diagnostics) {
    // Times have few digits: a cycle that does not increase means the same state, or a time that is
    // known far better than states lie apart.
    let is_same = |above: usize, below: usize| match (cycles[above], cycles[below]) {
        (Some(above), Some(below)) => Some(below <= above),
        _ => Some(is_known_apart(time, above, below, digits)),
    };
    resolve(time, is_same, place, "")
}

/// Indices of the states that count, by one rule for all files: of what was written again the
/// last writing. A single state whose time is before its neighbours' stays where the file has
/// it, and is named.
///
/// `is_same`: whether a state is written again by another of its time below it; `None` if the
/// file does not state it.
/// `place`: where a state begins. `of`: what stands ahead of each message.
///
/// Returns the indices, increasing, and what was left out or is out of order.
pub(crate) fn resolve(
    time: &[f64],
    is_same: impl Fn(usize, usize) -> Option<bool>,
    place: impl Fn(usize) -> Option<Place>,
    of: &str,
) -> (Vec<usize>, Diagnostics) {
    let mut problems = Diagnostics::default();
    let mut kept: Vec<usize> = Vec::with_capacity(time.len());
    for i in 0..time.len() {
        let goes_back = i > 0 && time[i] < time[i - 1];
        let again = i > 0 && time[i] == time[i - 1] && is_same(i - 1, i) == Some(true);
        let is_single = time.get(i + 1).is_none_or(|&next| i > 0 && next > time[i - 1]);
        if goes_back && is_single {
            let message = format!(
                "{of}time {:?} of state {} is before the time of the state above it",
                time[i],
                i + 1
            );
            problems.push(Problem::at(ProblemCode::TimeGoesBack, place(i), message));
        } else if goes_back || again {
            // Where time goes back, a restart may count its cycles from 0.
            let stays = |k: usize| {
                let is_other = || again && is_same(k, i) == Some(false);
                time[k] < time[i] || time[k] == time[i] && is_other()
            };
            let from = kept.iter().rposition(|&k| stays(k)).map_or(0, |k| k + 1);
            let left_out = kept.split_off(from);
            if let (Some(&first), Some(&last)) = (left_out.first(), left_out.last()) {
                let (at, from, to, count) = (time[i], time[first], time[last], left_out.len());
                let message = if again && first == last {
                    format!("{of}the state at time {at:?} is written twice: the last one counts")
                } else {
                    format!(
                        "{of}a restart writes again from time {at:?} on: {count} states above, from time {from:?} to {to:?}, are left out"
                    )
                };
                problems.push(Problem::at(ProblemCode::RepeatedState, place(i), message));
            }
        }
        kept.push(i);
    }
    (kept, problems)
}

/// Steps of the last digit by which neighbours lie apart where an equal time is the same state.
const STEPS: f64 = 10.0;

/// Whether two states of one time are the same one: neighbours at other times are much further
/// away than the last digit of the times can resolve.
pub(crate) fn is_known_apart(time: &[f64], above: usize, below: usize, digits: i32) -> bool {
    let at = time[below];
    let before = time[..above].iter().rev().find(|&&t| t != at);
    let behind = time[below..].iter().find(|&&t| t != at);
    let nearest = before.into_iter().chain(behind).map(|t| (t - at).abs()).reduce(f64::min);
    let exponent = if at == 0.0 { f64::NEG_INFINITY } else { libm::log10(at.abs()).floor() };
    nearest.is_some_and(|gap| gap >= STEPS * libm::pow(10.0, exponent - f64::from(digits - 1)))
}

/// Keeps the values of some states; none where no history is kept.
pub(crate) fn take<T: Copy>(values: &mut Vec<T>, kept: &[usize]) {
    if !values.is_empty() {
        *values = kept.iter().map(|&i| values[i]).collect();
    }
}

#[derive(Clone, Default)]
pub(crate) struct Table {
    pub name: &'static str,
    pub components: Vec<Arc<str>>,
    /// Indices into `components` that are selected.
    pub wanted_columns: Vec<usize>,
    /// Whether any row of a kept state had the column.
    pub seen_columns: Vec<bool>,
    pub rows: Vec<EntityId>,
    pub row_of: HashMap<EntityId, usize>,
    /// Whether a state may lack rows, or have new ones: elements erode, welds fail.
    pub varies: bool,
    /// Last row of the state above; a state that is cut lacks it.
    pub last_row: Option<usize>,
    /// Per row: kept states that have it.
    pub states_with: Vec<usize>,
    /// Per row: its first channel in `channels`, or `None` if the entity is not selected.
    pub channel_of: Vec<Option<usize>>,
    pub channels: Vec<Channel>,
    /// Per row: whether the pending state has it.
    pub filled: Vec<bool>,
    /// The rows that it has, so that a state costs what it has and not what others had.
    pub filled_rows: Vec<usize>,
    pub next_row: usize,
    /// Per row, until a state is kept: a hash of its line.
    pub lines: HashMap<usize, u64>,
    /// Rows that stand twice in the first state, with the same bytes: two lists of the deck name the entity.
    pub twice: HashSet<usize>,
}

/// One kept history: values of complete states, and the pending state's value.
#[derive(Clone)]
pub(crate) struct Channel {
    pub values: Vec<f64>,
    pub pending: f64,
    /// Kept states in which its row had this column.
    pub seen: usize,
    pub pending_seen: bool,
}

impl Table {
    pub(crate) fn new(
        name: &'static str,
        components: Vec<Arc<str>>,
        wanted_columns: Vec<usize>,
    ) -> Self {
        Self {
            name,
            seen_columns: vec![false; components.len()],
            components,
            wanted_columns,
            ..Self::default()
        }
    }

    pub(crate) fn find(&self, entity: EntityId) -> Option<usize> {
        match self.rows.get(self.next_row) {
            Some(&expected) if expected == entity => Some(self.next_row),
            _ => self.row_of.get(&entity).copied(),
        }
    }

    /// Whether a row that the pending state has already only repeats it: an entity of which the first state had two equal lines,
    /// with the same values in all selected columns.
    pub(crate) fn is_repeated(&self, row: usize, value: impl Fn(usize) -> Option<f64>) -> bool {
        let Some(first) = self.channel_of[row].filter(|_| self.twice.contains(&row)) else {
            return self.twice.contains(&row);
        };
        self.wanted_columns.iter().zip(&self.channels[first..]).all(|(&column, channel)| {
            let value = value(column).unwrap_or(f64::NAN);
            value == channel.pending || value.is_nan() && channel.pending.is_nan()
        })
    }

    pub(crate) fn forget_rows(&mut self) {
        let (components, wanted) = (self.components.clone(), self.wanted_columns.clone());
        *self = Self { varies: self.varies, ..Self::new(self.name, components, wanted) };
    }

    /// Adds a row that the first `states` kept states do not have.
    pub(crate) fn add_row(
        &mut self,
        entity: EntityId,
        selection: &Selection,
        states: usize,
    ) -> usize {
        let row = self.rows.len();
        self.rows.push(entity);
        self.row_of.insert(entity, row);
        self.filled.push(false);
        let wanted = selection.wants(entity) && !self.wanted_columns.is_empty();
        self.states_with.push(0);
        self.channel_of.push(wanted.then_some(self.channels.len()));
        if wanted {
            self.channels.extend(self.wanted_columns.iter().map(|_| Channel {
                values: vec![f64::NAN; states],
                pending: f64::NAN,
                seen: 0,
                pending_seen: false,
            }));
        }
        row
    }

    /// Rows that some states lack, in a table whose rows may come and go.
    fn absent_rows(&self, states: usize) -> Option<Problem> {
        let partly = self.states_with.iter().filter(|&&n| self.varies && 0 < n && n < states);
        let partly = partly.count();
        let message = format!(
            "{partly} of {} {} are missing from some states (eroded or failed); their values there are NaN",
            self.rows.len(),
            self.name
        );
        (partly > 0).then(|| Problem::new(ProblemCode::AbsentEntity, message))
    }
}

/// Histories entity by entity, each with the components of all tables in order.
/// Columns that an entity's rows never have make no history of it.
pub(crate) fn collect_tables(tables: Vec<Table>, file: &mut SolverFile) -> Diagnostics {
    let states = file.time.len();
    let mut problems = Diagnostics::default();
    let mut of_entity: HashMap<EntityId, Vec<History>> = HashMap::new();
    for mut table in tables.into_iter().filter(|table| !table.rows.is_empty()) {
        problems.extend(table.absent_rows(states));
        let mut channels = std::mem::take(&mut table.channels).into_iter();
        for (row, &entity) in table.rows.iter().enumerate() {
            if table.varies && table.states_with[row] == 0 {
                // Only states that were left out had it.
                if table.channel_of[row].is_some() {
                    channels.by_ref().take(table.wanted_columns.len()).for_each(drop);
                }
                continue;
            }
            let histories = of_entity.entry(entity).or_insert_with(|| {
                file.entities.push(Entity { id: entity, title: None });
                Vec::new()
            });
            if table.channel_of[row].is_none() {
                continue;
            }
            for (&column, channel) in table.wanted_columns.iter().zip(channels.by_ref()) {
                if channel.seen == 0 {
                    continue;
                }
                let component = &table.components[column];
                if channel.seen < states && !table.varies {
                    let message = format!(
                        "{component} of {entity} is missing from {} of {states} states; its values there are NaN",
                        states - channel.seen
                    );
                    problems.push(Problem::new(ProblemCode::AbsentComponent, message));
                }
                histories.push(History {
                    entity: Some(entity),
                    component: component.clone(),
                    time: file.time.clone(),
                    values: channel.values,
                });
            }
        }
        let seen = table.components.into_iter().zip(table.seen_columns);
        file.components.extend(seen.filter(|(_, seen)| *seen).map(|(name, _)| name));
    }
    for entity in &file.entities {
        file.histories.extend(of_entity.remove(&entity.id).into_iter().flatten());
    }
    problems
}
