//! Rows: values of a chain's bodies or interfaces, laid out for vectors.
//!
//! Lane `j` holds the `j`-th stretch of the chain. The neighbour of each value then is in
//! the next row and the same lane, and a pass over the chain loads no vector that overlaps two
//! others; only the ends of the stretches have their neighbours in another lane.

use std::ops::{Index, IndexMut};

/// Values are worked on in groups of as many, so that the compiler works on whole vectors.
pub(super) const LANES: usize = 4;

pub(super) type Row = [f64; LANES];

#[inline(always)]
pub(super) fn each(value: impl Fn(usize) -> f64) -> Row {
    // Not `std::array::from_fn`: without link-time optimisation its closures stay calls.
    let mut row = [0.0; LANES];
    for (j, lane) in row.iter_mut().enumerate() {
        *lane = value(j);
    }
    row
}

#[inline(always)]
pub(super) fn larger(a: Row, b: Row) -> Row {
    each(|j| if a[j] > b[j] { a[j] } else { b[j] })
}

/// Where a body, or the interface in front of it, stands: counted along the rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct LaneIndex(usize);

impl LaneIndex {
    pub(crate) fn new(row: usize, lane: usize) -> Self {
        Self(row * LANES + lane)
    }

    #[inline(always)]
    pub(crate) fn row(self) -> usize {
        self.0 / LANES
    }

    /// Counted along the rows.
    pub(crate) fn flat(self) -> usize {
        self.0
    }

    #[inline(always)]
    pub(crate) fn lane(self) -> usize {
        self.0 % LANES
    }
}

/// The layout of a chain.
#[derive(Clone, Debug)]
pub(super) struct Layout(Vec<LaneIndex>);

impl Layout {
    /// Of as many bodies, and of a last one that never moves.
    pub(crate) fn new(bodies: usize) -> Self {
        let rows = bodies.div_ceil(LANES);
        // Without a body that is only a pad, the last one lies after the end.
        let slot = |i: usize| {
            if i < rows * LANES {
                LaneIndex::new(i % rows, i / rows)
            } else {
                LaneIndex::new(rows, 0)
            }
        };
        Self((0..=bodies).map(slot).collect())
    }

    #[inline(always)]
    pub(crate) fn of(&self, i: usize) -> LaneIndex {
        self.0[i]
    }

    /// Rows that hold the bodies: `N`, or as many as there are if that is 0. With `N` the
    /// compiler unrolls the passes.
    #[inline(always)]
    pub(crate) fn known<const N: usize>(&self) -> usize {
        if N > 0 { N } else { self.rows() }
    }

    /// Rows that hold the bodies.
    #[inline(always)]
    pub(crate) fn rows(&self) -> usize {
        (self.0.len() - 1).div_ceil(LANES)
    }

    /// What stands at a slot.
    #[inline(always)]
    pub(crate) fn index(&self, slot: LaneIndex) -> usize {
        slot.lane() * self.rows() + slot.row()
    }
}

/// One value per body, 0 for pads and in a last row.
#[derive(Clone, Debug, Default)]
pub(super) struct Rows(Vec<Row>);

impl Rows {
    pub(crate) fn zeros(layout: &Layout) -> Self {
        Self(vec![[0.0; LANES]; layout.rows() + 1])
    }

    /// A value for each of the first `count` bodies.
    pub(crate) fn of(layout: &Layout, count: usize, value: impl Fn(usize) -> f64) -> Self {
        let mut rows = Self::zeros(layout);
        for i in 0..count {
            rows[layout.of(i)] = value(i);
        }
        rows
    }

    #[inline(always)]
    pub(crate) fn values(&self, n: usize) -> &[Row] {
        &self.0[..n]
    }

    #[inline(always)]
    pub(crate) fn values_mut(&mut self, n: usize) -> &mut [Row] {
        &mut self.0[..n]
    }

    /// All values, row by row, those of the last row too.
    #[inline(always)]
    pub(crate) fn flat(&self) -> &[f64] {
        self.0.as_flattened()
    }

    #[inline(always)]
    pub(crate) fn flat_mut(&mut self) -> &mut [f64] {
        self.0.as_flattened_mut()
    }

    /// Sum of the first `n` rows.
    #[inline(always)]
    pub(crate) fn sum(&self, n: usize) -> f64 {
        let mut lanes = [0.0; LANES];
        for row in self.values(n) {
            lanes = each(|j| lanes[j] + row[j]);
        }
        lanes.iter().sum()
    }
}

/// The neighbours of rows: those of an end of the stretches are put together before a pass, so that it loads whole vectors. They
/// are given by value, because the compiler selects from rows behind references lane by lane.
pub(super) struct Neighbours<'r> {
    rows: &'r [Row],
    at_end: Row,
}

impl<'r> Neighbours<'r> {
    /// In front; the last body never moves.
    #[inline(always)]
    pub(crate) fn ahead(rows: &'r [Row]) -> Self {
        Self { rows, at_end: [rows[0][1], rows[0][2], rows[0][3], 0.0] }
    }

    /// Behind; there is nothing behind the first body.
    #[inline(always)]
    pub(crate) fn behind(rows: &'r [Row]) -> Self {
        let last = &rows[rows.len() - 1];
        Self { rows, at_end: [0.0, last[0], last[1], last[2]] }
    }

    /// In front of row `c`.
    #[inline(always)]
    pub(crate) fn after(&self, c: usize) -> Row {
        *self.rows.get(c + 1).unwrap_or(&self.at_end)
    }

    /// Behind row `c`.
    #[inline(always)]
    pub(crate) fn before(&self, c: usize) -> Row {
        if c > 0 { self.rows[c - 1] } else { self.at_end }
    }
}

impl Index<LaneIndex> for Rows {
    type Output = f64;

    #[inline(always)]
    fn index(&self, slot: LaneIndex) -> &f64 {
        // Not `as_flattened`: without link-time optimisation it stays a call.
        &self.0[slot.row()][slot.lane()]
    }
}

impl IndexMut<LaneIndex> for Rows {
    #[inline(always)]
    fn index_mut(&mut self, slot: LaneIndex) -> &mut f64 {
        &mut self.0[slot.row()][slot.lane()]
    }
}
