//! Ends a file: the histories of its whole states.

use std::sync::Arc;

use super::StateReader;
use super::table::collect_tables;
use crate::history::History;
use crate::solver::problem::ProblemCode;
use crate::solver::{SolverFile, restart};

impl StateReader<'_> {
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
        // Times have few digits: a cycle that does not rise tells the same state, or a time that is
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
        let take = |values: &mut Vec<f64>| restart::take(values, &kept);
        take(&mut self.time);
        for channel in self.tables.iter_mut().flat_map(|t| &mut t.channels) {
            take(&mut channel.values);
        }
        for scalar in &mut self.scalars {
            take(&mut scalar.values);
        }
    }
}
