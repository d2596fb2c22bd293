//! Ends a file: the histories of its whole states.

use std::sync::Arc;

use super::StateReader;
use super::table::collect_tables;
use crate::history::{EntityId, History};
use crate::solver::problem::{Problem, ProblemCode};
use crate::solver::restart;

pub(crate) struct Collected {
    pub entities: Vec<EntityId>,
    pub components: Vec<Arc<str>>,
    pub time: Arc<[f64]>,
    pub histories: Vec<History>,
    pub problems: Vec<Problem>,
}

impl StateReader<'_> {
    pub(crate) fn finish(mut self) -> Collected {
        self.close(true);
        self.resolve_restarts();
        let time: Arc<[f64]> = self.time.into();
        let mut collected = Collected {
            entities: Vec::new(),
            components: Vec::new(),
            time: time.clone(),
            histories: Vec::new(),
            problems: Vec::new(),
        };
        if self.sealed {
            let found = collect_tables(self.tables, &mut collected);
            self.problems.append(found);
            for scalar in self.scalars {
                if scalar.absent > 0 {
                    self.problems.add(
                        ProblemCode::AbsentComponent,
                        None,
                        format!(
                            "{} is missing from {} of {} states; its values there are NaN",
                            scalar.component,
                            scalar.absent,
                            time.len()
                        ),
                    );
                }
                collected.components.push(scalar.component.clone());
                if scalar.kept {
                    collected.histories.push(History {
                        entity: None,
                        component: scalar.component,
                        time: time.clone(),
                        values: scalar.values,
                    });
                }
            }
        }
        collected.problems = self.problems.into_list();
        collected
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
