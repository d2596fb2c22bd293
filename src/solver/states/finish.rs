//! Ends a file: the histories of its complete states.

use std::sync::Arc;

use super::StateReader;
use super::table::collect_tables;
use crate::history::{EntityId, History};
use crate::solver::problem::{Problem, ProblemCode};

/// What a file's body hands over at its end.
pub(crate) struct Collected {
    pub entities: Vec<EntityId>,
    pub components: Vec<Arc<str>>,
    pub time: Arc<[f64]>,
    pub histories: Vec<History>,
    pub problems: Vec<Problem>,
}

impl StateReader<'_> {
    /// Ends the file.
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
}
