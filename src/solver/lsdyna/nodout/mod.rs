//! `nodout`: displacements, velocities, accelerations and coordinates of nodes.
//!
//! A state is a translational block and, where nodes have rotations, a rotational block
//! under its own state line with the same cycle and time. The column line shows
//! which block it is. Ends of fields are counted from the right, because l2a pushes rows with wide ids to the right. `nodout`
//! writes the cycle of a state, so states of one time are only repeated if the cycle does not increase.
//!
//! A block is rows of equal width below one heading, verified and read by their places.

pub(crate) mod stride;

use std::io;
use std::ops::Range;

use super::ascii::{self, Body};
use super::e12;
use super::line::{Line, integer, real, shown};
use crate::history::EntityId;
use crate::solver::Format;
use crate::solver::problem::Place;
use crate::solver::source::{Source, Window};
use crate::solver::states::{StateReader, TableId};
pub use stride::Blocks;
use stride::Stride;

/// Opens every block's state line.
const STATE: &[u8] = b" n o d a l   p r i n t   o u t   f o r   t i m e  s t e p";
const COLUMN_LINE: &[u8] = b" nodal point";

/// Components of the translational block, in order of its columns.
pub(in crate::solver) const TRANSLATIONS: [&str; 12] = [
    "x_displacement",
    "y_displacement",
    "z_displacement",
    "x_velocity",
    "y_velocity",
    "z_velocity",
    "x_acceleration",
    "y_acceleration",
    "z_acceleration",
    "x_coordinate",
    "y_coordinate",
    "z_coordinate",
];
const ROTATIONS: [&str; 9] = [
    "rx_displacement",
    "ry_displacement",
    "rz_displacement",
    "rx_velocity",
    "ry_velocity",
    "rz_velocity",
    "rx_acceleration",
    "ry_acceleration",
    "rz_acceleration",
];

/// "id columns 1–9, first value columns 10–22 (13 wide), then eleven fields of 12":
/// one column rule for E12.5 and E12.4. The blank of column 10 counts as the id's.
const ID_WIDTH: usize = 10;
const FIELD_WIDTH: usize = 12;
/// Digits, point and exponent of a time.
const TIME: usize = 13;

pub(crate) const FORMAT: Format =
    Format::text("nodout", "node", |line| line.starts_with(STATE), ascii::read::<Nodout>);

/// Tables of both blocks.
const TABLES: [TableId; 2] = [TableId(0), TableId(1)];

#[derive(Default)]
struct Nodout {
    /// Cycle and time of the state line above, until its column line comes.
    announced: Option<(i64, f64, Place)>,
    cycle: Option<i64>,
    /// The table that the rows belong to, inside a block.
    block: Option<TableId>,
    /// Where the pending state and the announced one begin, if the latter is a new state.
    pending_start: Option<Place>,
    new_start: Option<Place>,
    /// How states are laid out, from the last one that was read line by line.
    stride: Option<Stride>,
}

impl Body for Nodout {
    const TABLES: ascii::Tables =
        &[("translational rows", &TRANSLATIONS), ("rotational rows", &ROTATIONS)];

    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        if line.text.starts_with(STATE) {
            self.block = None;
            self.announced = self.state_line(line, states);
            self.note_start(states);
        } else if line.text.starts_with(COLUMN_LINE) && line.is_heading() {
            self.block = self.column_line(line, states);
        } else if let Some(block) = self.block {
            row(block, line, states);
        } else {
            self.unfinished(line, states);
            states.unexpected(line, None, "a state line", 60);
        }
        Some(())
    }

    /// The blank line between state line and column line ends nothing.
    fn blank(&mut self, _: &mut StateReader<'_>) {
        self.block = None;
    }

    fn unfinished(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) {
        // Outside a block, the state above is over; without a state line the rows below
        // cannot be placed.
        if self.block.is_none() && !self.continue_announced(states) {
            states.begin(None, line.into());
        }
    }

    fn interrupt(&mut self) {
        self.block = None;
        self.announced = None;
    }

    fn leap(
        &mut self,
        source: &dyn Source,
        states: &mut StateReader<'_>,
    ) -> io::Result<Option<Place>> {
        let Some(start) = self.new_start.take() else { return Ok(None) };
        let above = self.pending_start.replace(start);
        let kept = states.kept();
        states.close(false);
        // A state that was left out shows no layout, but an earlier one may have.
        let above = above.filter(|_| states.kept() > kept);
        for known in [true, false] {
            if !known {
                let Some(above) = above else { break };
                self.stride = Stride::learn(source, above, start, states)?;
            }
            let Some(stride) = &self.stride else { continue };
            if let Some(end) = stride.leap(source, start, states)? {
                self.announced = None;
                self.pending_start = None;
                return Ok(Some(end));
            }
        }
        Ok(None)
    }

    fn end(&mut self, states: &mut StateReader<'_>) {
        // A state line without the rows it announces.
        if self.continue_announced(states) {
            states.mark_damaged();
        }
    }
}

impl Nodout {
    /// Notes the place of the announced state if it is not the pending one's other block.
    fn note_start(&mut self, states: &StateReader<'_>) {
        if let Some((cycle, time, place)) = self.announced
            && (states.pending_time() != Some(time) || self.cycle != Some(cycle))
        {
            self.new_start = Some(place);
        }
    }

    /// Cycle number right after `s t e p`, time between `( at time` and `)`.
    fn state_line(
        &mut self,
        line: &Line<'_>,
        states: &mut StateReader<'_>,
    ) -> Option<(i64, f64, Place)> {
        let parsed = cycle_and_time(line.text).filter(|_| {
            super::heading_time(super::at_time(line.text), TIME, line, states).is_some()
        });
        let parsed = parsed.map(|(cycle, time)| (cycle, time, line.into()));
        if parsed.is_none() {
            // Without its time the block cannot be placed: what was pending ends here.
            states.begin(None, line.into());
            let columns = [STATE.len() + 1, line.text.len()];
            let message = "expected a cycle number and \"( at time … )\"";
            states.damage(line, Some(columns), message.into());
        }
        parsed
    }

    /// Makes the announced state the pending one, unless its other block already did.
    /// Returns whether a state was announced.
    fn continue_announced(&mut self, states: &mut StateReader<'_>) -> bool {
        let Some((cycle, time, place)) = self.announced.take() else { return false };
        if states.pending_time() != Some(time) || self.cycle != Some(cycle) {
            states.begin(Some(time), place);
            states.set_cycle(cycle);
            self.cycle = Some(cycle);
        }
        true
    }

    fn column_line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<TableId> {
        let heading = &line.text[COLUMN_LINE.len()..];
        let starts = |name: &[u8]| heading.trim_ascii_start().starts_with(name);
        let table = if starts(b"x-disp") {
            TABLES[0]
        } else if starts(b"x-rot") {
            TABLES[1]
        } else {
            if self.continue_announced(states) {
                states.mark_damaged();
            }
            states.damage(line, None, "expected columns from x-disp or from x-rot".into());
            return None;
        };
        let (cycle, time, place) = self.announced?;
        self.continue_announced(states);
        if states.has_rows(table) {
            // A second block of the same kind: a state of its own, at the same time.
            states.begin(Some(time), place);
            states.set_cycle(cycle);
        }
        Some(table)
    }
}

fn cycle_and_time(line: &[u8]) -> Option<(i64, f64)> {
    const AT: &[u8] = b"( at time";
    let rest = line.strip_prefix(STATE)?;
    let at = memchr::memmem::find(rest, AT)?;
    let close = memchr::memchr(b')', rest)?;
    let cycle = integer(&rest[..at])?;
    let time = real(rest.get(at + AT.len()..close)?).number()?;
    rest[close + 1..].trim_ascii().is_empty().then_some((cycle, time))
}

/// One node. Ids of more than nine digits push l2a's rows to the right, so the first
/// field begins where the id ends; a row of any other width is damaged or cut.
fn row(table: TableId, line: &Line<'_>, states: &mut StateReader<'_>) {
    let text = line.text.trim_ascii_end();
    let id_end = id_end(text);
    let first = id_end.max(ID_WIDTH - 1) + 1;
    let fields = Nodout::TABLES[table.0].1.len();
    let width = first + fields * FIELD_WIDTH;
    let Some(id) = integer(&text[..id_end]).filter(|_| text.len() == width) else {
        let message = format!(
            "expected a node id and {fields} numbers in {width} columns, found {} columns, \"{}\"",
            text.len(),
            shown(line.columns(1, 40)).trim_end()
        );
        return states.damage(line, Some([1, width]), message);
    };
    states.row(table, EntityId::new(id), line, |k| {
        let from = first + k * FIELD_WIDTH;
        Some((from + 1, from + FIELD_WIDTH))
    });
}

/// Where the leading blanks and digits of a row end.
fn id_end(text: &[u8]) -> usize {
    let digits = text.iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(text.len());
    let after = text[digits..].iter().position(|b| !b.is_ascii_digit());
    after.map_or(text.len(), |n| digits + n)
}

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
