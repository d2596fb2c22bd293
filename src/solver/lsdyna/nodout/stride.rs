//! States of a nodout that repeat the layout of the one above them: found by arithmetic,
//! verified, and read without going through their lines.
//!
//! Every state with the same nodes has the same number of bytes. What stands around its
//! rows (blank lines, state line, column line) must equal the state above but for cycle and
//! time, and the id columns of the first and last row of each block must equal theirs; where
//! all rows are read, those of all rows. At the first surprise the line reader goes on.

use std::io;
use std::ops::Range;

use rayon::prelude::*;

use super::{COLUMN_LINE, FIELD_WIDTH, ROTATIONS, STATE, TRANSLATIONS, cycle_and_time, id_end};
use crate::history::EntityId;
use crate::solver::lsdyna::e12;
use crate::solver::lsdyna::line::{Field, Lines, integer, real};
use crate::solver::problem::Place;
use crate::solver::source::{Source, Stream, Window};
use crate::solver::states::{States, TableId};

/// Bytes read at once where all rows are read.
const DENSE_READ: usize = 1 << 18;
/// Bytes below which two wanted rows are read together rather than apart.
const PAGE: usize = 4096;
/// Values held while a batch of states waits to be handed on.
const BATCH_VALUES: usize = 1 << 20;
const MAX_BATCH: usize = 256;

/// Cycle and time of a state, and the values wanted of it.
type ReadState = ((i64, f64), Vec<f64>);

/// The layout of one state.
pub struct Stride {
    blocks: Vec<Block>,
    /// Bytes and lines from one state to the next.
    period: u64,
    lines: u64,
    /// Blank lines behind the last row.
    tail: Vec<u8>,
    /// What the states keep of each block.
    wanted: Vec<Wanted>,
}

/// Rows of equal width, and what stands above them.
struct Block {
    table: TableId,
    /// Bytes above the rows, and where in them the state line is.
    head: Vec<u8>,
    state_line: Range<usize>,
    /// Where the rows begin, from the state's start.
    rows_at: u64,
    rows: usize,
    /// Width of a row with its line end.
    width: usize,
    /// Columns before the first field: the id.
    first: usize,
    fields: usize,
    /// Id columns of all rows.
    ids: Vec<u8>,
    line_end: &'static [u8],
}

/// What is wanted of a block.
pub struct Wanted {
    rows: Vec<usize>,
    columns: Vec<usize>,
    /// Index of the block's first value in the output, and the distance between the values
    /// of neighbouring rows and columns there.
    start: usize,
    row_step: usize,
    column_step: usize,
}

impl Stride {
    /// The layout of the state between `from` and `to`, if its rows are those of the tables.
    pub fn learn(
        source: &dyn Source,
        from: Place,
        to: Place,
        states: &States<'_>,
        tables: [TableId; 2],
    ) -> io::Result<Option<Self>> {
        let mut lines = Lines::new(Stream::new(source));
        lines.go_to(from);
        let mut blocks: Vec<Block> = Vec::new();
        let mut head: Vec<u8> = Vec::new();
        let mut state_line = 0..0;
        let mut open = false;
        while lines.place().byte < to.byte {
            let Some(line) = lines.next_line()? else { return Ok(None) };
            let text = line.text;
            let (is_blank, byte) = (line.is_blank(), line.byte);
            let is_column = text.starts_with(COLUMN_LINE) && line.is_heading();
            if text.starts_with(STATE) {
                state_line = head.len()..head.len() + text.len();
            }
            let is_row = open && !is_blank;
            if is_row {
                let Some(block) = blocks.last_mut() else { return Ok(None) };
                if !block.add(text) {
                    return Ok(None);
                }
                let end = lines.place().byte;
                if end - byte != block.width as u64 {
                    return Ok(None);
                }
                continue;
            }
            open = is_column;
            head.extend_from_slice(text);
            let (length, end) = (text.len(), lines.place().byte);
            head.extend_from_slice(match end - byte - length as u64 {
                1 => b"\n".as_slice(),
                2 => b"\r\n",
                _ => return Ok(None),
            });
            if head.len() > DENSE_READ {
                return Ok(None);
            }
            if is_column {
                let rotations = memchr::memmem::find(&head, b" x-rot").is_some();
                let crlf = head.ends_with(b"\r\n");
                blocks.push(Block {
                    table: tables[usize::from(rotations)],
                    rows_at: end - from.byte,
                    state_line: std::mem::take(&mut state_line),
                    head: std::mem::take(&mut head),
                    rows: 0,
                    width: 0,
                    first: 0,
                    fields: if rotations { ROTATIONS.len() } else { TRANSLATIONS.len() },
                    ids: Vec::new(),
                    line_end: if crlf { b"\r\n" } else { b"\n" },
                });
            }
        }
        let mut stride = Self {
            blocks,
            period: to.byte - from.byte,
            lines: to.line - from.line,
            tail: head,
            wanted: Vec::new(),
        };
        stride.wanted = stride.wanted(states);
        Ok(stride.fits(states, tables).then_some(stride))
    }

    /// Whether the blocks hold the rows of the tables, in their order.
    fn fits(&self, states: &States<'_>, tables: [TableId; 2]) -> bool {
        let is_once = |table| self.blocks.iter().filter(|b| b.table == table).count() <= 1;
        tables.into_iter().all(|table| {
            let block = self.blocks.iter().find(|b| b.table == table);
            let ids = block.into_iter().flat_map(Block::entities);
            is_once(table) && ids.eq(states.rows(table).iter().map(|&e| Some(e)))
        }) && self.blocks.iter().all(|b| b.rows > 0 && !b.state_line.is_empty())
    }

    /// Reads the states from `start` on as long as they repeat the layout; the place behind
    /// them, or `None` if there is none.
    pub fn leap(
        &self,
        source: &dyn Source,
        start: Place,
        states: &mut States<'_>,
    ) -> io::Result<Option<Place>> {
        let wanted = &self.wanted;
        let audit = states.is_audit();
        let values = wanted.iter().map(Wanted::values).sum::<usize>();
        let largest = (BATCH_VALUES / values.max(1)).clamp(2, MAX_BATCH);
        // Grows while states are read without surprise, so that little work is lost at one.
        let mut batch = 2;
        let mut place = start;
        loop {
            let there = self.count(source.size()?, place.byte).min(batch);
            let read: Vec<Option<ReadState>> = (0..there)
                .into_par_iter()
                .map_init(
                    || Window::new(source),
                    |window, k| {
                        let at = place.byte + k as u64 * self.period;
                        // Most surprises show in the first lines: before there is a cost.
                        if !self.begins(window, at)? {
                            return Ok(None);
                        }
                        let mut out = vec![0.0; values];
                        let found = self.state(window, at, wanted, audit, &mut out)?;
                        Ok(found.map(|found| (found, out)))
                    },
                )
                .collect::<io::Result<_>>()?;
            let whole: Vec<ReadState> = read.into_iter().map_while(|state| state).collect();
            let count = whole.len();
            let (times, values): (Vec<(i64, f64)>, Vec<Vec<f64>>) = whole.into_iter().unzip();
            let places = (0..).map(|k| self.place(place, k));
            states.extend(&times.into_iter().zip(places).collect::<Vec<_>>(), &values);
            place = self.place(place, count);
            if count < batch {
                return Ok((place.byte > start.byte).then_some(place));
            }
            batch = (2 * batch).min(largest);
        }
    }

    /// Beginning of the `k`-th state behind the one at `place`.
    fn place(&self, place: Place, k: usize) -> Place {
        let k = k as u64;
        Place { line: place.line + k * self.lines, byte: place.byte + k * self.period }
    }

    /// Number of states between byte `at` and the end of the file; the last one may lack
    /// the blank lines behind it.
    pub fn count(&self, size: u64, at: u64) -> usize {
        let body = self.period - self.tail.len() as u64;
        match size.saturating_sub(at).checked_sub(body) {
            Some(rest) => usize::try_from(rest / self.period).unwrap_or(usize::MAX - 1) + 1,
            None => 0,
        }
    }

    pub fn period(&self) -> u64 {
        self.period
    }

    /// What the states keep of each block, in their order of values.
    fn wanted(&self, states: &States<'_>) -> Vec<Wanted> {
        let mut wanted: Vec<Wanted> = self
            .blocks
            .iter()
            .map(|block| {
                let columns = states.wanted_columns(block.table).to_vec();
                let rows = states.wanted_rows(block.table);
                Wanted { start: 0, row_step: columns.len(), column_step: 1, rows, columns }
            })
            .collect();
        // The values stand in order of the tables, which need not be that of the blocks.
        let mut order: Vec<usize> = (0..wanted.len()).collect();
        order.sort_by_key(|&k| self.blocks[k].table);
        let mut start = 0;
        for k in order {
            wanted[k].start = start;
            start += wanted[k].values();
        }
        wanted
    }

    /// The same for a table whose columns are to stand one behind the other.
    pub fn wanted_by_column(&self, states: &States<'_>) -> Vec<Wanted> {
        let mut wanted = self.wanted(states);
        for wanted in &mut wanted {
            (wanted.row_step, wanted.column_step) = (1, wanted.rows.len());
        }
        wanted
    }

    /// No value of any block.
    pub fn nothing(&self) -> Vec<Wanted> {
        let none = || Wanted {
            rows: Vec::new(),
            columns: Vec::new(),
            start: 0,
            row_step: 0,
            column_step: 0,
        };
        self.blocks.iter().map(|_| none()).collect()
    }

    pub fn table(&self, block: usize) -> TableId {
        self.blocks[block].table
    }

    /// Whether the first block's head stands at byte `at`.
    fn begins(&self, window: &mut Window<'_>, at: u64) -> io::Result<bool> {
        let Some(block) = self.blocks.first() else { return Ok(false) };
        let head = window.get(at, block.head.len(), block.width)?;
        Ok(head.is_some_and(|head| block.verify_head(head).is_some()))
    }

    /// Reads the state at byte `at` into `out`; its cycle and time, or `None` at any surprise.
    /// `audit`: parse the fields that are not wanted as well.
    pub fn state(
        &self,
        window: &mut Window<'_>,
        at: u64,
        wanted: &[Wanted],
        audit: bool,
        out: &mut [f64],
    ) -> io::Result<Option<(i64, f64)>> {
        let mut found = None;
        for (block, wanted) in self.blocks.iter().zip(wanted) {
            let dense = audit || wanted.reads_most(block);
            let ahead = if dense { DENSE_READ } else { block.width };
            let head_at = at + block.rows_at - block.head.len() as u64;
            let Some(head) = window.get(head_at, block.head.len(), ahead)? else {
                return Ok(None);
            };
            let Some(cycle_and_time) = block.verify_head(head) else { return Ok(None) };
            if *found.get_or_insert(cycle_and_time) != cycle_and_time {
                return Ok(None);
            }
            let rows_at = at + block.rows_at;
            let read = match dense {
                true => block.read_all(window, rows_at, wanted, audit, out)?,
                false => block.read_some(window, rows_at, wanted, out)?,
            };
            if read.is_none() {
                return Ok(None);
            }
        }
        let tail_at = at + self.period - self.tail.len() as u64;
        if let Some(tail) = window.get(tail_at, self.tail.len(), 0)? {
            return Ok(found.filter(|_| tail == self.tail));
        }
        // At the end of the file the blank lines may be missing.
        for length in (0..self.tail.len()).rev() {
            if let Some(tail) = window.get(tail_at, length, 0)? {
                return Ok(found.filter(|_| *tail == self.tail[..length]));
            }
        }
        Ok(None)
    }
}

impl Wanted {
    pub fn values(&self) -> usize {
        self.rows.len() * self.columns.len()
    }

    pub fn rows(&self) -> &[usize] {
        &self.rows
    }

    pub fn columns(&self) -> &[usize] {
        &self.columns
    }

    pub fn range(&self) -> Range<usize> {
        self.start..self.start + self.values()
    }

    /// Whether so many pages of the block are wanted that it is read as a whole.
    fn reads_most(&self, block: &Block) -> bool {
        let pages = self.rows.len() * (PAGE + block.width);
        !self.columns.is_empty() && 2 * pages > block.rows * block.width
    }
}

impl Block {
    /// Adds a row of the state that is learnt; false if it differs from those above it.
    fn add(&mut self, text: &[u8]) -> bool {
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

    fn entities(&self) -> impl Iterator<Item = Option<EntityId>> {
        (0..self.rows).map(|row| {
            let id = self.id(row);
            integer(&id[..id_end(id)]).map(EntityId::new)
        })
    }

    /// Cycle and time, if all else is as in the state that was learnt.
    fn verify_head(&self, head: &[u8]) -> Option<(i64, f64)> {
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
        e12::parse(field).or_else(|| match real(field) {
            Field::Real(value) => Some(value),
            _ => None,
        })
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
    fn read_all(
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
    fn read_some(
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
            // Behind the last row comes the head of what follows, with its first row.
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
