//! From records, a row of entities each, to histories, a column of states each.

use std::collections::HashMap;
use std::ops::Range;

use crate::history::EntityId;

/// Where the kept entities' values are in a state's record.
pub struct Pick {
    /// `None` for an entity that the state lacks.
    pub positions: Vec<Option<usize>>,
    /// From the first to behind the last of them.
    pub span: Range<usize>,
    /// Whether they are neighbours in their order.
    pub is_run: bool,
}

impl Pick {
    pub fn new(positions: Vec<Option<usize>>) -> Self {
        let known = || positions.iter().flatten().copied();
        let span = match known().min().zip(known().max()) {
            Some((first, last)) => first..last + 1,
            None => 0..0,
        };
        let is_run = positions.iter().copied().eq(span.clone().map(Some));
        Self { positions, span, is_run }
    }
}

/// Rows of states turned into columns, several rows at a time: a value alone would cost a
/// cache line.
pub struct Columns {
    columns: Vec<Vec<f64>>,
    rows: Vec<f64>,
    pending: usize,
}

/// Rows turned at once: the values of a cache line and more.
const ROWS: usize = 16;

impl Columns {
    pub fn new(columns: usize, states: usize) -> Self {
        Self {
            columns: (0..columns).map(|_| Vec::with_capacity(states)).collect(),
            rows: vec![f64::NAN; columns * ROWS],
            pending: 0,
        }
    }

    /// The next state's row, to be filled.
    pub fn row(&mut self) -> &mut [f64] {
        if self.pending == ROWS {
            self.turn();
        }
        let width = self.columns.len();
        self.pending += 1;
        &mut self.rows[(self.pending - 1) * width..self.pending * width]
    }

    fn turn(&mut self) {
        let (width, pending) = (self.columns.len(), self.pending);
        for (k, column) in self.columns.iter_mut().enumerate() {
            column.extend((0..pending).map(|row| self.rows[row * width + k]));
        }
        self.pending = 0;
    }

    pub fn finish(mut self) -> Vec<Vec<f64>> {
        self.turn();
        self.columns
    }
}

/// For every kept entity its position among a state's ids.
pub fn positions_of(kept: &[(usize, Option<EntityId>)], ids: &[i64]) -> Vec<Option<usize>> {
    let of: HashMap<i64, usize> = ids.iter().enumerate().map(|(k, &id)| (id, k)).collect();
    kept.iter().map(|(_, entity)| entity.and_then(|e| of.get(&e.id).copied())).collect()
}
