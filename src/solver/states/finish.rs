//! Ends states and files: a complete state is kept, an incomplete one is left out and reported; complete states
//! become histories. States that a restart wrote again are resolved.

use std::sync::Arc;

use super::table::collect_tables;
use super::{ABSENT_CELLS, ABSENT_PER_PRESENT, Pending, StateReader};
use crate::history::History;
use crate::solver::SolverFile;
use crate::solver::problem::{Diagnostics, Place, Problem, ProblemCode};

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
                let at = time.map_or(String::new(), |t| format!(" at time {t:?}"));
                let states = self.time.len();
                let message =
                    format!("state {}{at} is not complete and is left out: {missing}", states + 1);
                self.problems.add(ProblemCode::IncompleteState, Some(pending.place), message);
                // Labels that only dropped states had must not become components.
                self.scalars.retain(|s| s.absent < states);
            }
        }
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
            _ if self.absent_cells > ABSENT_CELLS + ABSENT_PER_PRESENT * self.present_cells => {
                Some("the states above already lack most of their entities".into())
            }
            _ => None,
        }
    }

    fn keep(&mut self, time: f64, pending: &Pending) {
        self.sealed = true;
        self.time.push(time);
        self.places.push(pending.place);
        self.cycles.push(pending.cycle);
        for table in &mut self.tables {
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
        let cycles = &self.cycles;
        // Times have few digits: a cycle that does not increase means the same state, or a time that is
        // known far better than states lie apart.
        let is_same = |above: usize, below: usize| match (cycles[above], cycles[below]) {
            (Some(above), Some(below)) => Some(below <= above),
            _ => Some(is_known_apart(&self.time, above, below, self.time_digits)),
        };
        let places = &self.places;
        let place = |i: usize| places.get(i).copied();
        let (kept, found) = resolve(&self.time, is_same, place, "");
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
    let exponent = if at == 0.0 { f64::NEG_INFINITY } else { at.abs().log10().floor() };
    nearest.is_some_and(|gap| gap >= STEPS * 10f64.powf(exponent - f64::from(digits - 1)))
}

/// Keeps the values of some states; none where no history is kept.
pub(crate) fn take<T: Copy>(values: &mut Vec<T>, kept: &[usize]) {
    if !values.is_empty() {
        *values = kept.iter().map(|&i| values[i]).collect();
    }
}
