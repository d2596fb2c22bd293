//! From records (rows of entities) to histories (columns of states).

use std::collections::HashMap;
use std::ops::Range;

use crate::history::EntityId;

/// Where the kept entities' values are in a state's record.
pub(crate) struct Pick {
    /// `None` for an entity that the state lacks.
    pub positions: Vec<Option<usize>>,
    /// From the first to after the last of them.
    pub span: Range<usize>,
    /// Whether they are neighbours in their order.
    pub is_run: bool,
}

impl Pick {
    pub(crate) fn new(positions: Vec<Option<usize>>) -> Self {
        let known = || positions.iter().flatten().copied();
        let span = match known().min().zip(known().max()) {
            Some((first, last)) => first..last + 1,
            None => 0..0,
        };
        let is_run = positions.iter().copied().eq(span.clone().map(Some));
        Self { positions, span, is_run }
    }

    /// The values of a record that hold those of the kept entities at one of the points that
    /// each entity has. The span must not be empty.
    pub(crate) fn range(&self, per_entity: usize, point: usize) -> Range<usize> {
        self.span.start * per_entity..(self.span.end - 1) * per_entity + point + 1
    }

    /// Takes a state's values from the record's `row`, which begins with the span's first
    /// entity; returns how many of them are not finite.
    pub(crate) fn fill(
        &self,
        values: &mut [f64],
        row: &[f64],
        per_entity: usize,
        point: usize,
    ) -> usize {
        if self.is_run && per_entity == 1 && row.len() == values.len() {
            values.copy_from_slice(row);
            return row.iter().filter(|v| !v.is_finite()).count();
        }
        let mut not_finite = 0;
        for (value, position) in values.iter_mut().zip(&self.positions) {
            let read = position.and_then(|p| row.get((p - self.span.start) * per_entity + point));
            *value = read.copied().unwrap_or(f64::NAN);
            not_finite += usize::from(read.is_some_and(|v| !v.is_finite()));
        }
        not_finite
    }
}

/// Rows of states turned into columns, several rows at a time: a value alone would cost a
/// cache line.
pub(crate) struct Columns {
    columns: Vec<Vec<f64>>,
    rows: Vec<f64>,
    pending: usize,
}

/// Rows turned at once: the values of a cache line and more.
const ROWS: usize = 16;

impl Columns {
    pub(crate) fn new(columns: usize, states: usize) -> Self {
        Self {
            columns: (0..columns).map(|_| Vec::with_capacity(states)).collect(),
            rows: vec![f64::NAN; columns * ROWS],
            pending: 0,
        }
    }

    /// The next state's row, to be filled.
    pub(crate) fn row(&mut self) -> &mut [f64] {
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

    pub(crate) fn finish(mut self) -> Vec<Vec<f64>> {
        self.turn();
        self.columns
    }
}

/// For every kept entity its position among a state's ids.
pub(crate) fn positions_of(kept: &[(usize, Option<EntityId>)], ids: &[i64]) -> Vec<Option<usize>> {
    let of: HashMap<i64, usize> = ids.iter().enumerate().map(|(k, &id)| (id, k)).collect();
    kept.iter().map(|(_, entity)| entity.and_then(|e| of.get(&e.id).copied())).collect()
}
