//! Leaves out the states that a restart wrote again.

use super::StateReader;
use crate::solver::restart;

impl StateReader<'_> {
    pub(super) fn resolve_restarts(&mut self) {
        let cycles = &self.cycles;
        // Times have few digits: a cycle that does not increase means the same state, or a time that is
        // known far better than states lie apart.
        let is_same = |above: usize, below: usize| match (cycles[above], cycles[below]) {
            (Some(above), Some(below)) => Some(below <= above),
            _ => Some(restart::is_known_apart(&self.time, above, below, self.time_digits)),
        };
        let places = &self.places;
        let place = |i: usize| places.get(i).copied();
        let (kept, found) = restart::resolve(&self.time, is_same, place, "");
        self.problems.append(found);
        if kept.len() == self.time.len() {
            return;
        }
        let take = |values: &mut Vec<f64>| {
            if !values.is_empty() {
                *values = kept.iter().map(|&i| values[i]).collect();
            }
        };
        take(&mut self.time);
        for channel in self.tables.iter_mut().flat_map(|t| &mut t.channels) {
            take(&mut channel.values);
        }
        for scalar in &mut self.scalars {
            take(&mut scalar.values);
        }
    }
}
