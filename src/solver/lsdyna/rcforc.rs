//! `rcforc`: resultant forces of contact interfaces, one line per side and state.

use super::ascii::{Body, boxed};
use super::line::{Line, integer, is_whole_real, real, shown};
use crate::history::{EntityId, Side};
use crate::solver::Format;
use crate::solver::states::{StateReader, TableId};

/// Printed twice per state, without a time, for single-surface contacts.
const UNDEFINED: &[u8] = b"is single surface";
const INTERFACE: &[u8] = b"interface number,";
const TIME: &[u8] = b" time";
/// Width of the time and of every real number.
const WIDTH: usize = 12;

/// A component and its label, and where its number, right after the label, begins from the start
/// of ` time`, and its width.
type Column = (&'static str, &'static [u8], usize, usize);

const COLUMNS: [Column; 9] = [
    ("x_force", b"  x ", 21, WIDTH),
    ("y_force", b"  y ", 37, WIDTH),
    ("z_force", b"  z ", 53, WIDTH),
    ("mass", b" mass ", 71, WIDTH),
    ("x_moment", b"  mx ", 88, WIDTH),
    ("y_moment", b"  my ", 105, WIDTH),
    ("z_moment", b"  mz ", 122, WIDTH),
    ("tie_count", b"  tied ", 141, 10),
    ("tie_area", b"  tied area ", 163, WIDTH),
];
/// Columns of every file; the others depend on release and contact type.
const ALWAYS: usize = 4;
const MOMENTS: std::ops::Range<usize> = 4..7;

pub(crate) const FORMAT: Format = Format::text("rcforc", "interface", boxed::<Rcforc>, |line| {
    undefined_interface(line).is_some() || (side(line).is_some() && time_at(line).is_some())
});

#[derive(Clone, Default)]
struct Rcforc {
    table: Option<TableId>,
    /// Whether a row had moments: then a row without them is cut.
    moments: bool,
}

impl Body for Rcforc {
    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        if let Some(id) = undefined_interface(line.text) {
            if !states.single_surfaces.contains(&id) {
                states.single_surfaces.push(id);
            }
        } else if let Some((side, rest)) = side(line.text) {
            self.row(side, rest, line, states);
        } else {
            states.unexpected(line, Some([1, 8]), "slave, master, SURFA or SURFB", 40);
        }
        Some(())
    }
}

impl Rcforc {
    fn row(&mut self, side: Side, id_from: usize, line: &Line<'_>, states: &mut StateReader<'_>) {
        let text = line.text;
        let parsed = time_at(text).and_then(|at| {
            let id = integer(text.get(id_from..at)?)?;
            let usual = in_columns(text, at);
            let excess = usize::from(usual.is_none());
            let (time, fields) = usual.or_else(|| by_labels(text, at))?;
            states.allows_width("row", excess, 0, line).then_some((id, time, fields))
        });
        let Some((id, time, fields)) = parsed else { return damage(id_from, line, states) };
        let moments = fields[MOMENTS].iter().all(Option::is_some);
        if !moments && self.moments {
            let message = "expected moments, as the rows above have them";
            states.damage(line, Some([text.len(), text.len()]), message.into());
            return;
        }
        self.moments |= moments;
        let table = *self
            .table
            .get_or_insert_with(|| states.table("sides", COLUMNS.iter().map(|column| column.0)));
        let entity = EntityId { id, side: Some(side) };
        states.timed_row(table, entity, time, line, |k| fields[k]);
    }
}

/// Says what a row lacks.
fn damage(id_from: usize, line: &Line<'_>, states: &mut StateReader<'_>) {
    let text = line.text;
    let at = time_at(text).filter(|&at| {
        let time = text.get(at + TIME.len()..at + TIME.len() + WIDTH);
        text.get(id_from..at).and_then(integer).is_some()
            && time.is_some_and(|time| real(time).number().is_some())
    });
    let Some(at) = at else {
        states.damage(line, Some([9, 36]), "expected an interface id and a time".into());
        return;
    };
    let (columns, message) = match COLUMNS[..ALWAYS].iter().find(|c| fit(c, text, at).is_none()) {
        Some(&(_, label, offset, width)) => (
            [at + offset + 1 - label.len(), at + offset + width],
            format!("expected \"{}\" and a number of {width} columns", shown(label).trim()),
        ),
        None => {
            let end = end_of_columns(text, at) + 1;
            ([end, text.len().max(end)], "expected the row's further columns, or its end".into())
        }
    };
    states.damage(line, Some(columns), message);
}

/// Time and columns of a row.
type Row<'a> = ((f64, &'a [u8]), [Option<(usize, usize)>; COLUMNS.len()]);

/// A row as every known release prints it; `None` if anything stands elsewhere.
fn in_columns(text: &[u8], at: usize) -> Option<Row<'_>> {
    let from = at + TIME.len();
    let printed = text.get(from..from + WIDTH)?;
    let time = real(printed).number()?;
    let fields = COLUMNS.each_ref().map(|column| fit(column, text, at));
    let rest = text.get(end_of_columns(text, at)..).unwrap_or_default();
    let whole = fields[..ALWAYS].iter().all(Option::is_some) && rest.trim_ascii().is_empty();
    whole.then_some(((time, printed), fields))
}

/// Where the last column ends that is there.
fn end_of_columns(text: &[u8], at: usize) -> usize {
    COLUMNS.iter().filter_map(|column| fit(column, text, at)).map(|(_, end)| end).max().unwrap_or(0)
}

/// First and last column of the number, if the label is in its place and all of the number is there.
fn fit(&(_, label, offset, width): &Column, text: &[u8], at: usize) -> Option<(usize, usize)> {
    let number = at + offset;
    let is_there = text.get(number - label.len()..number) == Some(label);
    (is_there && text.len() >= number + width).then_some((number + 1, number + width))
}

/// A row whose numbers have other widths, or that has further labels: each label with the
/// number after it.
fn by_labels(text: &[u8], at: usize) -> Option<Row<'_>> {
    let mut end = at + TIME.len();
    let mut word = || {
        let from = end + text[end..].iter().position(|b| !b.is_ascii_whitespace())?;
        let length = text[from..].iter().position(u8::is_ascii_whitespace);
        end = length.map_or(text.len(), |length| from + length);
        Some((from, end))
    };
    let (from, to) = word()?;
    let end_of_time = to;
    let time = real(&text[from..to]).number().filter(|_| is_whole_real(&text[from..to]))?;
    let mut fields = [None; COLUMNS.len()];
    while let Some((from, mut to)) = word() {
        let mut value = word()?;
        if &text[from..to] == b"tied" && &text[value.0..value.1] == b"area" {
            (to, value) = (value.1, word()?);
        }
        let label = &text[from..to];
        let number = &text[value.0..value.1];
        let is_label = label[0].is_ascii_alphabetic();
        if !(is_label && (is_whole_real(number) || integer(number).is_some())) {
            return None;
        }
        if let Some(k) = COLUMNS.iter().position(|column| column.1.trim_ascii() == label)
            && fields[k].replace((value.0 + 1, value.1)).is_some()
        {
            return None;
        }
    }
    let printed = &text[at + TIME.len()..end_of_time];
    fields[..ALWAYS].iter().all(Option::is_some).then_some(((time, printed), fields))
}

/// The side a line begins with, and where its id begins.
fn side(text: &[u8]) -> Option<(Side, usize)> {
    let start = text.iter().position(|b| !b.is_ascii_whitespace())?;
    let length = text[start..].iter().position(u8::is_ascii_whitespace)?;
    let name = std::str::from_utf8(&text[start..start + length]).ok()?;
    Some((Side::parse(name)?, start + length))
}

/// Where ` time` begins: column 20, or further right after a wide id.
fn time_at(text: &[u8]) -> Option<usize> {
    const FIXED: usize = 19;
    if text.get(FIXED..FIXED + TIME.len()) == Some(TIME) {
        return Some(FIXED);
    }
    memchr::memmem::find(text, TIME)
}

/// The id of an "interface number, …, is single surface – resultants are undefined" line.
fn undefined_interface(text: &[u8]) -> Option<i64> {
    let rest = text.trim_ascii_start().strip_prefix(INTERFACE)?;
    let comma = memchr::memchr(b',', rest)?;
    memchr::memmem::find(rest, UNDEFINED)?;
    let is_whole = memchr::memmem::find(rest, b"**").is_none();
    integer(&rest[..comma]).filter(|_| is_whole)
}
