//! A block of a nodout's state: rows of equal width below one heading, verified and read by
//! their places.

use std::io;
use std::ops::Range;

use super::{FIELD_WIDTH, cycle_and_time, id_end};
use crate::history::EntityId;
use crate::solver::lsdyna::e12;
use crate::solver::lsdyna::line::{integer, real};
use crate::solver::source::Window;
use crate::solver::states::TableId;

/// Bytes read at once where all rows are read.
pub(crate) const DENSE_READ: usize = 1 << 18;
/// Bytes below which two wanted rows are read together rather than apart.
const PAGE: usize = 4096;

/// Rows of equal width, and what is above them.
pub(crate) struct Block {
    pub table: TableId,
    /// Bytes above the rows, and where in them the state line is.
    pub head: Vec<u8>,
    pub state_line: Range<usize>,
    /// Where the rows begin, from the state's start.
    pub rows_at: u64,
    pub rows: usize,
    /// Width of a row with its line end.
    pub width: usize,
    /// Columns before the first field: the id.
    pub first: usize,
    pub fields: usize,
    /// Id columns of all rows.
    pub ids: Vec<u8>,
    pub line_end: &'static [u8],
}

/// What is wanted of a block.
#[derive(Default)]
pub(crate) struct Wanted {
    pub rows: Vec<usize>,
    pub columns: Vec<usize>,
    /// Index of the block's first value in the output, and the distance between the values
    /// of neighbouring rows and columns there.
    pub start: usize,
    pub row_step: usize,
    pub column_step: usize,
}

impl Wanted {
    pub(crate) fn values(&self) -> usize {
        self.rows.len() * self.columns.len()
    }

    /// Whether enough pages of the block are wanted to read it as a whole.
    pub(crate) fn reads_most(&self, block: &Block) -> bool {
        let pages = self.rows.len() * (PAGE + block.width);
        !self.columns.is_empty() && 2 * pages > block.rows * block.width
    }
}

impl Block {
    /// A block without rows yet, which begin `rows_at` bytes after the state's start.
    pub(crate) fn below(
        head: Vec<u8>,
        state_line: Range<usize>,
        table: TableId,
        rows_at: u64,
        fields: usize,
    ) -> Self {
        let line_end: &'static [u8] = if head.ends_with(b"\r\n") { b"\r\n" } else { b"\n" };
        let (rows, width, first, ids) = (0, 0, 0, Vec::new());
        Self { table, head, state_line, rows_at, rows, width, first, fields, ids, line_end }
    }

    /// Adds a row of the state that is learnt; false if it differs from those above it.
    pub(crate) fn add(&mut self, text: &[u8]) -> bool {
        let fields = self.fields * FIELD_WIDTH;
        let width = text.len() + self.line_end.len();
        let Some(first) = text.len().checked_sub(fields) else { return false };
        if self.rows == 0 {
            (self.width, self.first) = (width, first);
        }
        self.rows += 1;
        self.ids.extend_from_slice(&text[..first]);
        (width, first) == (self.width, self.first) && id_end(text) <= first
    }

    fn id(&self, row: usize) -> &[u8] {
        &self.ids[row * self.first..(row + 1) * self.first]
    }

    pub(crate) fn entities(&self) -> impl Iterator<Item = Option<EntityId>> {
        (0..self.rows).map(|row| {
            let id = self.id(row);
            integer(&id[..id_end(id)]).map(EntityId::new)
        })
    }

    /// Cycle and time, if all else is as in the state that was learnt.
    pub(crate) fn verify_head(&self, head: &[u8]) -> Option<(i64, f64)> {
        let Range { start, end } = self.state_line;
        let same = head[..start] == self.head[..start] && head[end..] == self.head[end..];
        cycle_and_time(&head[start..end]).filter(|_| same)
    }

    /// Whether `row` has its id and its line end.
    fn verify_row(&self, number: usize, row: &[u8]) -> bool {
        row[..self.first] == *self.id(number) && row.ends_with(self.line_end)
    }

    /// Parses one field; `None` if it holds no number.
    #[inline(always)]
    fn field(&self, row: &[u8], column: usize) -> Option<f64> {
        let from = self.first + column * FIELD_WIDTH;
        let field: &[u8; FIELD_WIDTH] = row.get(from..from + FIELD_WIDTH)?.try_into().ok()?;
        e12::parse(field).or_else(|| real(field).number())
    }

    fn store(&self, row: &[u8], k: usize, wanted: &Wanted, out: &mut [f64]) -> Option<()> {
        let first = wanted.start + k * wanted.row_step;
        for (i, &column) in wanted.columns.iter().enumerate() {
            *out.get_mut(first + i * wanted.column_step)? = self.field(row, column)?;
        }
        Some(())
    }

    /// Every column of a row whose columns are all wanted.
    fn store_all(&self, row: &[u8], k: usize, wanted: &Wanted, out: &mut [f64]) -> Option<()> {
        let first = wanted.start + k * wanted.row_step;
        let fields = row.get(self.first..self.first + self.fields * FIELD_WIDTH)?;
        for (i, field) in fields.chunks_exact(FIELD_WIDTH).enumerate() {
            let field: &[u8; FIELD_WIDTH] = field.try_into().ok()?;
            let value = match e12::parse(field) {
                Some(value) => value,
                None => self.field(row, i)?,
            };
            *out.get_mut(first + i * wanted.column_step)? = value;
        }
        Some(())
    }

    /// Reads and verifies all rows.
    pub(crate) fn read_all(
        &self,
        window: &mut Window<'_>,
        at: u64,
        wanted: &Wanted,
        audit: bool,
        out: &mut [f64],
    ) -> io::Result<Option<()>> {
        let all_columns = wanted.columns.len() == self.fields;
        let mut next = wanted.rows.iter().enumerate().peekable();
        let at_once = (DENSE_READ / self.width).max(1);
        let mut number = 0;
        while number < self.rows {
            let count = at_once.min(self.rows - number);
            let from = at + (number * self.width) as u64;
            let Some(bytes) = window.get(from, count * self.width, 0)? else { return Ok(None) };
            for row in bytes.chunks_exact(self.width) {
                let k = next.next_if(|(_, wanted)| **wanted == number).map(|(k, _)| k);
                let stored = match k {
                    _ if !self.verify_row(number, row) => None,
                    Some(k) if all_columns => self.store_all(row, k, wanted, out),
                    Some(k) if !audit => self.store(row, k, wanted, out),
                    None if !audit => Some(()),
                    _ => (0..self.fields)
                        .try_for_each(|c| self.field(row, c).map(drop))
                        .and_then(|()| k.map_or(Some(()), |k| self.store(row, k, wanted, out))),
                };
                if stored.is_none() {
                    return Ok(None);
                }
                number += 1;
            }
        }
        Ok(Some(()))
    }

    /// Reads the wanted rows and verifies the first and the last one as well.
    pub(crate) fn read_some(
        &self,
        window: &mut Window<'_>,
        at: u64,
        wanted: &Wanted,
        out: &mut [f64],
    ) -> io::Result<Option<()>> {
        let last = self.rows - 1;
        let mut numbers: Vec<(usize, Option<usize>)> =
            wanted.rows.iter().enumerate().map(|(k, &row)| (row, Some(k))).collect();
        numbers.extend([(0, None), (last, None)]);
        numbers.sort_unstable_by_key(|&(row, _)| row);
        let together = 1 + PAGE / self.width;
        let mut rest = &numbers[..];
        while let Some(&(from, _)) = rest.first() {
            let near = rest.windows(2).take_while(|w| w[1].0 - w[0].0 < together).count() + 1;
            let (group, others) = rest.split_at(near);
            rest = others;
            let to = group.last().map_or(from, |g| g.0);
            let start = at + (from * self.width) as u64;
            // After the last row comes the head of what follows, with its first row.
            let ahead = if to == last { self.head.len() + self.width + 64 } else { 0 };
            let Some(bytes) = window.get(start, (to + 1 - from) * self.width, ahead)? else {
                return Ok(None);
            };
            for &(number, k) in group {
                let row = &bytes[(number - from) * self.width..][..self.width];
                let stored = k.map_or(Some(()), |k| self.store(row, k, wanted, out));
                if !self.verify_row(number, row) || stored.is_none() {
                    return Ok(None);
                }
            }
        }
        Ok(Some(()))
    }
}
