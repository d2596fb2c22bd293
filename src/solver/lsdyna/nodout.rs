//! `nodout`: displacements, velocities, accelerations and coordinates of nodes.
//!
//! A state is a translational block and, where nodes have rotations, a rotational block
//! under its own state line with the same cycle and time. The column line shows
//! which block it is. Ends of fields are counted from the right, because l2a pushes rows with wide ids to the right. `nodout`
//! writes the cycle of a state, so states of one time are only repeated if the cycle does not increase.

use super::ascii::{self, Body, boxed};
use super::line::{Line, integer, real, shown};
use crate::history::EntityId;
use crate::solver::Format;
use crate::solver::problem::Place;
use crate::solver::states::repeat::Part;
use crate::solver::states::{StateReader, TableId};

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
/// From the letter or the sign of an exponent to the end of its field.
const EXPONENT: usize = 4;
/// Digits, point and exponent of a time.
const TIME: usize = 13;

pub(crate) const FORMAT: Format =
    Format::text("nodout", "node", boxed::<Nodout>, |line| line.starts_with(STATE));

/// Tables of both blocks.
const TABLES: [TableId; 2] = [TableId(0), TableId(1)];

#[derive(Clone, Default)]
struct Nodout {
    /// Cycle and time of the state line above, until its column line comes.
    announced: Option<(i64, f64, Place)>,
    cycle: Option<i64>,
    /// The table that the rows belong to, inside a block.
    block: Option<TableId>,
}

impl Body for Nodout {
    fn is_by_time(&self) -> bool {
        true
    }

    fn may_skip(&self) -> bool {
        true
    }

    fn tables(&self) -> ascii::Tables {
        &[("translational rows", &TRANSLATIONS), ("rotational rows", &ROTATIONS)]
    }

    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        if line.text.starts_with(STATE) {
            self.block = None;
            self.announced = self.state_line(line, states);
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

    fn continue_cycle(&mut self, cycle: &[u8]) {
        self.cycle = integer(cycle);
    }

    fn end(&mut self, states: &mut StateReader<'_>) {
        // A state line without the rows it announces.
        if self.continue_announced(states) {
            states.mark_damaged();
        }
    }
}

impl Nodout {
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
        let cycle = memchr::memmem::find(line.text, b"(").unwrap_or_default();
        states.part(line, line.text.get(STATE.len()..cycle).unwrap_or_default(), Part::Cycle);
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

/// One node. Ids of more than nine digits push l2a's rows to the right, so the first field begins one column behind the
/// id, unless ten digits fill the id's columns; a row of any other width is damaged or cut.
fn row(table: TableId, line: &Line<'_>, states: &mut StateReader<'_>) {
    let text = line.text.trim_ascii_end();
    let id_end = id_end(text);
    let fields = [TRANSLATIONS.len(), ROTATIONS.len()][table.0];
    let is_filled = id_end == ID_WIDTH
        && text.len() == ID_WIDTH + fields * FIELD_WIDTH
        && b"Ee+-".contains(&text[ID_WIDTH + FIELD_WIDTH - EXPONENT]);
    let first = if is_filled { ID_WIDTH } else { id_end.max(ID_WIDTH - 1) + 1 };
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
