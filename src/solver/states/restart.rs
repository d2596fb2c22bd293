//! States that a restart wrote again.

use super::States;
use crate::solver::problem::ProblemCode;

impl States<'_> {
    /// Leaves out the states that a restart wrote again: of equal times the last one counts.
    /// A single state whose time is before its neighbours' stays where the file has it.
    pub(super) fn resolve_restarts(&mut self) {
        let time = &self.time;
        let goes_back = |i: usize| time[i] < time[i - 1];
        let repeats = |i: usize| self.distinct_times && time[i] == time[i - 1];
        let mut kept: Vec<usize> = Vec::with_capacity(time.len());
        for i in 0..time.len() {
            let is_single = time.get(i + 1).is_none_or(|&next| i > 0 && next > time[i - 1]);
            if i > 0 && goes_back(i) && is_single {
                self.problems.add(
                    ProblemCode::TimeGoesBack,
                    self.places.get(i).copied(),
                    None,
                    format!(
                        "time {:?} of state {} is before the time of the state above it",
                        time[i],
                        i + 1
                    ),
                );
            } else if i > 0 && (goes_back(i) || repeats(i)) {
                let again = kept.iter().rposition(|&k| time[k] < time[i]).map_or(0, |k| k + 1);
                let left_out = kept.split_off(again);
                if let (Some(&first), Some(&last)) = (left_out.first(), left_out.last()) {
                    self.problems.add(
                        ProblemCode::RepeatedState,
                        self.places.get(i).copied(),
                        None,
                        format!(
                            "a restart writes again from time {:?} on: {} states above, from time {:?} to {:?}, are left out",
                            time[i],
                            left_out.len(),
                            time[first],
                            time[last]
                        ),
                    );
                }
            }
            kept.push(i);
        }
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
