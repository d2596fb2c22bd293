//! States of a nodout that repeat the layout of the one above them: found by arithmetic,
//! verified, and read without going through their lines.
//!
//! Every state with the same nodes has the same number of bytes. The text around its
//! rows (blank lines, state line, column line) must equal the state above but for cycle and
//! time, and the id columns of the first and last row of each block must equal theirs; where
//! all rows are read, those of all rows. Batches of states are parsed in parallel and passed on in
//! order. At the first irregularity the line reader takes that state, and skipping continues after it.
//! `tests/stride.rs` compares both ways on intact and on damaged files.
//!
//! A complete nodout state by state, for a consumer that writes each state immediately.
//!
//! `histories -o x.h5` of a large nodout never holds the file in memory. This module first verifies the frame of all states, so
//! that their number is known. `hdf5` then lets hdf5-pure encode a file whose large datasets are untouched
//! zeros, and notes where the encoder places them. Finally the states are parsed and written to these
//! places from all threads.

use std::io;

use rayon::prelude::*;

use super::{
    Block, COLUMN_LINE, DENSE_READ, Nodout, ROTATIONS, STATE, TABLES, TRANSLATIONS, Wanted,
};
use crate::history::EntityId;
use crate::solver::lsdyna::ascii::{AsciiReader, Body};
use crate::solver::lsdyna::line::Lines;
use crate::solver::problem::{self, Place};
use crate::solver::source::{Source, Stream, Window};
use crate::solver::states::{StateReader, TableId};
use crate::solver::{Selection, SolverFile};

/// Values held while a batch of states waits to be handed on.
const BATCH_VALUES: usize = 1 << 20;
const MAX_BATCH: usize = 256;

/// Cycle and time of a state, and the values wanted of it.
type ReadState = ((i64, f64), Vec<f64>);

/// The layout of one state.
pub(crate) struct Stride {
    blocks: Vec<Block>,
    /// Bytes and lines from one state to the next.
    pub period: u64,
    lines: u64,
    /// Blank lines after the last row.
    tail: Vec<u8>,
    /// What the states keep of each block.
    wanted: Vec<Wanted>,
}

/// The blocks of the state between `from` and `to`, and what is below the last; `None` if
/// the rows of a block differ in width.
fn blocks(
    source: &dyn Source,
    from: Place,
    to: Place,
) -> io::Result<Option<(Vec<Block>, Vec<u8>)>> {
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
        if open && !is_blank {
            let Some(block) = blocks.last_mut() else { return Ok(None) };
            if !block.add(text) || lines.place().byte - byte != block.width as u64 {
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
            let fields = if rotations { ROTATIONS.len() } else { TRANSLATIONS.len() };
            let (head, line) = (std::mem::take(&mut head), std::mem::take(&mut state_line));
            let table = TABLES[usize::from(rotations)];
            blocks.push(Block::below(head, line, table, end - from.byte, fields));
        }
    }
    Ok(Some((blocks, head)))
}

impl Stride {
    /// The layout of the state between `from` and `to`, if its rows are those of the tables.
    pub(crate) fn learn(
        source: &dyn Source,
        from: Place,
        to: Place,
        states: &StateReader<'_>,
    ) -> io::Result<Option<Self>> {
        let Some((blocks, tail)) = blocks(source, from, to)? else { return Ok(None) };
        let (period, lines) = (to.byte - from.byte, to.line - from.line);
        let mut stride = Self { blocks, period, lines, tail, wanted: Vec::new() };
        stride.wanted = stride.wanted(states);
        Ok(stride.fits(states).then_some(stride))
    }

    /// Whether the blocks hold the rows of the tables, in their order.
    fn fits(&self, states: &StateReader<'_>) -> bool {
        let is_once = |table| self.blocks.iter().filter(|b| b.table == table).count() <= 1;
        TABLES.into_iter().all(|table| {
            let block = self.blocks.iter().find(|b| b.table == table);
            let ids = block.into_iter().flat_map(Block::entities);
            is_once(table) && ids.eq(states.rows(table).iter().map(|&e| Some(e)))
        }) && self.blocks.iter().all(|b| b.rows > 0 && !b.state_line.is_empty())
    }

    /// Reads the states from `start` on as long as they repeat the layout; the place after
    /// them, or `None` if there is none.
    pub(crate) fn leap(
        &self,
        source: &dyn Source,
        start: Place,
        states: &mut StateReader<'_>,
    ) -> io::Result<Option<Place>> {
        let wanted = &self.wanted;
        let audit = states.selection.audit;
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

    /// Beginning of the `k`-th state after the one at `place`.
    fn place(&self, place: Place, k: usize) -> Place {
        let k = k as u64;
        Place { line: place.line + k * self.lines, byte: place.byte + k * self.period }
    }

    /// Number of states between byte `at` and the end of the file; the last one may lack
    /// the blank lines after it.
    pub(crate) fn count(&self, size: u64, at: u64) -> usize {
        let body = self.period - self.tail.len() as u64;
        match size.saturating_sub(at).checked_sub(body) {
            Some(rest) => usize::try_from(rest / self.period).unwrap_or(usize::MAX - 1) + 1,
            None => 0,
        }
    }

    /// What the states keep of each block, in their order of values.
    fn wanted(&self, states: &StateReader<'_>) -> Vec<Wanted> {
        let mut wanted: Vec<Wanted> = self
            .blocks
            .iter()
            .map(|block| {
                let columns = states.wanted_columns(block.table).to_vec();
                let rows = states.wanted_rows(block.table);
                Wanted { start: 0, row_step: columns.len(), column_step: 1, rows, columns }
            })
            .collect();
        // The values are in order of the tables, which need not be that of the blocks.
        let mut order: Vec<usize> = (0..wanted.len()).collect();
        order.sort_by_key(|&k| self.blocks[k].table);
        let mut start = 0;
        for k in order {
            wanted[k].start = start;
            start += wanted[k].values();
        }
        wanted
    }

    /// The same for a table whose columns are to stand one after the other.
    pub(crate) fn wanted_by_column(&self, states: &StateReader<'_>) -> Vec<Wanted> {
        let mut wanted = self.wanted(states);
        for wanted in &mut wanted {
            (wanted.row_step, wanted.column_step) = (1, wanted.rows.len());
        }
        wanted
    }

    /// No value of any block.
    pub(crate) fn nothing(&self) -> Vec<Wanted> {
        self.blocks.iter().map(|_| Wanted::default()).collect()
    }

    pub(crate) fn table(&self, block: usize) -> TableId {
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
    pub(crate) fn state(
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
            let read = if dense {
                block.read_all(window, rows_at, wanted, audit, out)?
            } else {
                block.read_some(window, rows_at, wanted, out)?
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

/// Values below which reading state by state saves nothing.
const MIN_VALUES: usize = 1 << 17;

/// An undamaged nodout whose states all have the same layout.
pub struct Blocks {
    source: Box<dyn Source>,
    stride: Stride,
    /// Byte of the first state.
    start: u64,
    wanted: Vec<Wanted>,
    /// What the file says of itself, with the times of all states and no history.
    pub file: SolverFile,
    /// What a state's values are, in their order.
    pub columns: Vec<Column>,
}

/// One component of some entities: neighbouring values of a state.
pub struct Column {
    /// Name of the component, as in binout: `x_displacement`.
    pub component: String,
    /// The nodes whose values these are, in their order.
    pub entities: Vec<EntityId>,
}

impl Blocks {
    /// `None` if the file is damaged, has too few states to show their layout, or too few
    /// values to be worth it: then the line reader gives what there is.
    pub(crate) fn open(source: Box<dyn Source>, selection: &Selection) -> io::Result<Option<Self>> {
        let mut frame = AsciiReader::new::<Nodout>(&super::FORMAT, &*source, selection);
        let mut body = Nodout::default();
        let mut above = None;
        let start = loop {
            if !frame.step(&mut body)? {
                return Ok(None);
            }
            match (above, body.new_start.take()) {
                (Some(above), Some(new)) => break (above, new),
                (None, Some(first)) => above = Some(first),
                _ => {}
            }
        };
        frame.states.close(false);
        body.announced = None;
        if frame.states.kept() != 1 {
            return Ok(None);
        }
        let learnt = Stride::learn(&*source, start.0, start.1, &frame.states)?;
        let Some(stride) = learnt else { return Ok(None) };
        let wanted = stride.wanted_by_column(&frame.states);
        let rows: Vec<Vec<EntityId>> = (0..wanted.len())
            .map(|k| {
                let all = frame.states.rows(stride.table(k));
                wanted[k].rows.iter().map(|&row| all[row]).collect()
            })
            .collect();
        let start = start.0.byte;
        let size = source.size()?;
        let count = stride.count(size, start);
        let values = wanted.iter().map(Wanted::values).sum::<usize>();
        if values.saturating_mul(count) < MIN_VALUES {
            return Ok(None);
        }
        let times = times(&*source, &stride, start, count)?;
        let mut file = frame.finish(&mut body);
        let ends_there = size <= start + count as u64 * stride.period;
        let rising = times.as_ref().is_some_and(|t| t.is_sorted_by(|a, b| a < b));
        let (Some(times), true) = (times, ends_there && rising && file.problems.is_empty()) else {
            return Ok(None);
        };
        file.problems = problem::of_time(&times);
        file.time = times.into();
        file.histories.clear();
        let mut columns: Vec<(usize, Column)> = Vec::new();
        for ((k, wanted), rows) in wanted.iter().enumerate().zip(&rows) {
            let (_, components) = Nodout::TABLES[stride.table(k).0];
            for (i, &column) in wanted.columns.iter().enumerate() {
                let first = wanted.start + i * rows.len();
                let component = components[column].to_string();
                columns.push((first, Column { component, entities: rows.clone() }));
            }
        }
        columns.sort_by_key(|(first, _)| *first);
        let columns = columns.into_iter().map(|(_, column)| column).collect();
        Ok(Some(Self { source, stride, start, wanted, file, columns }))
    }

    /// Number of values of one state.
    pub fn values(&self) -> usize {
        self.wanted.iter().map(Wanted::values).sum()
    }

    /// A buffer for [`Blocks::read`], of one thread.
    pub fn window(&self) -> Window<'_> {
        Window::new(&*self.source)
    }

    /// Reads one state into `out`, column by column; false if it is damaged.
    pub fn read(&self, window: &mut Window<'_>, state: usize, out: &mut [f64]) -> io::Result<bool> {
        let at = self.start + state as u64 * self.stride.period;
        let found = self.stride.state(window, at, &self.wanted, false, out)?;
        Ok(found.map(|(_, time)| time) == Some(self.file.time[state]))
    }
}

/// The times of all states; `None` if what stands around the rows of any differs.
fn times(
    source: &dyn Source,
    stride: &Stride,
    start: u64,
    count: usize,
) -> io::Result<Option<Vec<f64>>> {
    let nothing: Vec<Wanted> = stride.nothing();
    (0..count)
        .into_par_iter()
        .map_init(
            || Window::new(source),
            |window, k| {
                let at = start + k as u64 * stride.period;
                let found = stride.state(window, at, &nothing, false, &mut [])?;
                Ok(found.map(|(_, time)| time))
            },
        )
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every size of a file and place in it, for periods and tails of all small sizes, against
    /// counting; and the largest numbers of all.
    #[test]
    fn states_are_counted_as_by_hand() {
        let stride = |period: u64, tail: usize| Stride {
            blocks: Vec::new(),
            period,
            lines: 3,
            tail: vec![b'\n'; tail],
            wanted: Vec::new(),
        };
        for (period, tail) in (1..12_u64).flat_map(|p| (0..p).map(move |t| (p, t))) {
            let stride = stride(period, tail as usize);
            for (size, at) in (0..40_u64).flat_map(|size| (0..45).map(move |at| (size, at))) {
                let by_hand = (1..).take_while(|k| at + k * period - tail <= size).count();
                assert_eq!(stride.count(size, at), by_hand, "{period} {tail} {size} {at}");
                let place = stride.place(Place { line: 7, byte: at }, by_hand);
                assert_eq!(
                    (place.line, place.byte),
                    (7 + 3 * by_hand as u64, at + by_hand as u64 * period)
                );
                assert!(by_hand == 0 || place.byte <= size + tail);
            }
        }
        assert_eq!(stride(1, 0).count(u64::MAX, 0), usize::MAX);
        assert_eq!(stride(u64::MAX, 0).count(u64::MAX, 0), 1);
        assert_eq!(stride(u64::MAX, 0).count(u64::MAX, 1), 0);
    }
}
