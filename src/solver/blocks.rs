//! A file without damage state by state, for a consumer that writes each state immediately.

use std::collections::HashMap;
use std::io;

use super::SolverFile;
use crate::history::EntityId;

/// An undamaged file whose states can be read in any order, from several threads. It has histories.
pub struct Blocks {
    pub(super) states: Box<dyn States>,
    /// What the file says of itself, with the times of all states and no history.
    pub file: SolverFile,
    /// What a state's values are, in their order.
    pub columns: Vec<Column>,
    /// The index of each history's value, in the order of [`SolverFile::histories`].
    pub order: Vec<usize>,
}

/// Reads one state into a buffer, column by column; false if it is damaged.
pub(super) type ReadState<'a> = Box<dyn FnMut(usize, &mut [f64]) -> io::Result<bool> + Send + 'a>;

/// How the states of a kind of file are read.
pub(super) trait States: Send + Sync {
    /// A reader for one thread.
    fn reader(&self) -> ReadState<'_>;

    /// Whether all states can be read.
    fn are_whole(&self) -> io::Result<bool>;

    /// Whether nothing in the states, which were all read, needs a look at the whole file.
    fn are_plausible(&self) -> bool {
        true
    }
}

/// One component of some entities: neighbouring values of a state.
pub struct Column {
    /// Name of the component, as in binout: `x_displacement`.
    pub component: String,
    /// The entities whose values these are, in their order; none of a global quantity.
    pub entities: Vec<EntityId>,
}

impl Column {
    /// Number of values of a state.
    pub(crate) fn width(&self) -> usize {
        self.entities.len().max(1)
    }
}

impl Blocks {
    /// Number of values of one state.
    pub fn values(&self) -> usize {
        self.order.len()
    }

    /// Reads one state into a buffer, column by column; false if it is damaged. For one thread.
    pub fn reader(&self) -> impl FnMut(usize, &mut [f64]) -> io::Result<bool> + Send + '_ {
        self.states.reader()
    }

    /// Whether all states can be read and are plausible.
    pub(crate) fn are_whole(&self) -> io::Result<bool> {
        self.states.are_whole()
    }

    /// Whether the values of all states, which were read, are plausible; if not, the file must be read as a
    /// whole, which says why.
    pub(crate) fn are_plausible(&self) -> bool {
        self.states.are_plausible()
    }

    /// Labels of the values, in [`Blocks::order`].
    pub(crate) fn labels(&self) -> Vec<String> {
        let of = |column: &Column| {
            let entities = column.entities.iter().map(|e| format!("{}[{e}]", column.component));
            let global = column.entities.is_empty().then(|| column.component.clone());
            entities.chain(global).collect::<Vec<_>>()
        };
        let mut labels: Vec<String> = self.columns.iter().flat_map(of).collect();
        self.order.iter().map(|&k| std::mem::take(&mut labels[k])).collect()
    }
}

/// The histories of a file by component, and the index of each one's value among them; `None` if a
/// component is of entities and of the whole model.
pub(super) fn columns(file: &SolverFile) -> Option<(Vec<Column>, Vec<usize>)> {
    let mut columns: Vec<Column> = Vec::new();
    let mut number_of = HashMap::new();
    let mut members: Vec<Vec<usize>> = Vec::new();
    for (k, history) in file.histories.iter().enumerate() {
        let number = *number_of.entry(history.component.clone()).or_insert_with(|| {
            let component = history.component.to_string();
            columns.push(Column { component, entities: Vec::new() });
            members.push(Vec::new());
            members.len() - 1
        });
        columns[number].entities.extend(history.entity);
        members[number].push(k);
    }
    let mut order = vec![0; file.histories.len()];
    for (place, history) in members.iter().flatten().enumerate() {
        order[*history] = place;
    }
    let fits = |(column, members): (&Column, &Vec<usize>)| column.width() == members.len();
    columns.iter().zip(&members).all(fits).then_some((columns, order))
}
