//! Rows of the same components, and the histories built from them.

use std::collections::HashMap;
use std::sync::Arc;

use crate::history::{EntityId, History};
use crate::solver::problem::{Diagnostics, Problem, ProblemCode};
use crate::solver::{Entity, Selection, SolverFile};

#[derive(Default)]
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
}

/// One kept history: values of complete states, and the pending state's value.
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
