//! `rcforc`: resultant forces of contact interfaces, one line per side and state.

use super::ascii::{self, Body};
use super::label_values::Widths;
use super::line::{Field, Line, integer, is_whole_real, real, shown};
use crate::history::{EntityId, Side};
use crate::solver::format::Format;
use crate::solver::states::{StateReader, TableId};

/// Printed twice per state, without a time, for single-surface contacts.
const UNDEFINED: &[u8] = b"is single surface";
const INTERFACE: &[u8] = b"interface number,";
const TIME: &[u8] = b" time";
/// Width of the time and of every real number.
const WIDTH: usize = 12;

/// A component, its label, and where its number begins after the start of ` time`.
/// The number of a label starts right after it.
struct Column {
    component: &'static str,
    label: &'static [u8],
    offset: usize,
    width: usize,
    /// Present in every file; the others depend on release and contact type.
    always: bool,
}

const fn column(
    component: &'static str,
    label: &'static [u8],
    offset: usize,
    always: bool,
) -> Column {
    Column { component, label, offset, width: WIDTH, always }
}

const COLUMNS: [Column; 9] = [
    column("x_force", b"  x ", 21, true),
    column("y_force", b"  y ", 37, true),
    column("z_force", b"  z ", 53, true),
    column("mass", b" mass ", 71, true),
    column("x_moment", b"  mx ", 88, false),
    column("y_moment", b"  my ", 105, false),
    column("z_moment", b"  mz ", 122, false),
    Column { component: "tie_count", label: b"  tied ", offset: 141, width: 10, always: false },
    column("tie_area", b"  tied area ", 163, false),
];

fn signature(line: &[u8]) -> bool {
    undefined_interface(line).is_some() || (side(line).is_some() && time_at(line).is_some())
}

pub(crate) const FORMAT: Format =
    Format::text("rcforc", "interface", signature, ascii::read_default::<Rcforc>);

#[derive(Default)]
struct Rcforc {
    table: Option<TableId>,
    /// Whether a row had moments: then a row without them is cut.
    moments: bool,
    undefined: Vec<i64>,
    widths: Widths,
}

impl Body for Rcforc {
    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) {
        if line.is_blank() {
            return;
        }
        if let Some(id) = undefined_interface(line.text) {
            if !self.undefined.contains(&id) {
                self.undefined.push(id);
            }
        } else if let Some((side, rest)) = side(line.text) {
            self.row(side, rest, line, states);
        } else {
            states.damage(
                line,
                Some([1, 8]),
                format!(
                    "expected slave, master, SURFA or SURFB, found \"{}\"",
                    shown(line.columns(1, 40)).trim_end()
                ),
            );
        }
    }

    fn single_surfaces(&self) -> &[i64] {
        &self.undefined
    }
}

impl Rcforc {
    fn row(&mut self, side: Side, id_from: usize, line: &Line<'_>, states: &mut StateReader<'_>) {
        let text = line.text;
        let parsed = time_at(text).and_then(|at| {
            let id = integer(text.get(id_from..at)?)?;
            let usual = in_columns(text, at);
            let excess = isize::from(usual.is_none());
            let (time, fields) = usual.or_else(|| by_labels(text, at))?;
            self.widths.allow("row", excess, line, states).then_some((id, time, fields))
        });
        let Some((id, time, fields)) = parsed else {
            self.damage(id_from, line, states);
            return;
        };
        let moments =
            COLUMNS.iter().zip(&fields).all(|(c, field)| !c.is_moment() || field.is_some());
        if !moments && self.moments {
            let message = "expected moments, as the rows above have them";
            states.damage(line, Some([text.len(), text.len()]), message.into());
            return;
        }
        self.moments |= moments;
        let table = *self
            .table
            .get_or_insert_with(|| states.table("sides", &COLUMNS.each_ref().map(|c| c.component)));
        let entity = EntityId { id, side: Some(side) };
        // Times have six digits, so two states can print the same one: a repeated side
        // begins a state as well.
        let begins = states.pending_time() != Some(time) || states.has_row(table, entity);
        if begins {
            states.begin(Some(time), line.into());
        }
        states.row(table, entity, line, |k| fields[k]);
    }

    /// Says what a row lacks.
    fn damage(&self, id_from: usize, line: &Line<'_>, states: &mut StateReader<'_>) {
        let text = line.text;
        let at = time_at(text).filter(|&at| {
            let time = text.get(at + TIME.len()..at + TIME.len() + WIDTH);
            text.get(id_from..at).and_then(integer).is_some()
                && time.is_some_and(|time| matches!(real(time), Field::Real(_)))
        });
        let Some(at) = at else {
            states.damage(line, Some([9, 36]), "expected an interface id and a time".into());
            return;
        };
        if let Some(bad) = COLUMNS.iter().find(|c| c.always && !c.fits(text, at)) {
            let label = shown(bad.label);
            states.damage(
                line,
                Some([at + bad.offset + 1 - bad.label.len(), at + bad.offset + bad.width]),
                format!("expected \"{}\" and a number of {} columns", label.trim(), bad.width),
            );
            return;
        }
        let end = end_of_columns(text, at);
        states.damage(
            line,
            Some([end + 1, text.len().max(end + 1)]),
            "expected the row's further columns, or its end".into(),
        );
    }
}

/// Time and columns of a row.
type Row = (f64, [Option<(usize, usize)>; COLUMNS.len()]);

/// A row as every known release prints it; `None` if anything stands elsewhere.
fn in_columns(text: &[u8], at: usize) -> Option<Row> {
    let from = at + TIME.len();
    let Field::Real(time) = real(text.get(from..from + WIDTH)?) else { return None };
    let whole = COLUMNS.iter().all(|c| !c.always || c.fits(text, at));
    let rest = text.get(end_of_columns(text, at)..).unwrap_or_default();
    let fields = COLUMNS.each_ref().map(|column| {
        let from = at + column.offset;
        column.fits(text, at).then_some((from + 1, from + column.width))
    });
    (whole && rest.trim_ascii().is_empty()).then_some((time, fields))
}

/// Where the last column ends that is there.
fn end_of_columns(text: &[u8], at: usize) -> usize {
    let ends = COLUMNS.iter().filter(|c| c.fits(text, at)).map(|c| at + c.offset + c.width);
    ends.max().unwrap_or(0)
}

/// A row whose numbers have other widths, or that has further labels: each label with the
/// number after it.
fn by_labels(text: &[u8], at: usize) -> Option<Row> {
    let mut end = at + TIME.len();
    let mut word = || {
        let from = end + text[end..].iter().position(|b| !b.is_ascii_whitespace())?;
        let length = text[from..].iter().position(u8::is_ascii_whitespace);
        end = length.map_or(text.len(), |length| from + length);
        Some((from, end))
    };
    let (from, to) = word()?;
    let Field::Real(time) = real(&text[from..to]) else { return None };
    if !is_whole_real(&text[from..to]) {
        return None;
    }
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
        if let Some(k) = COLUMNS.iter().position(|c| c.label.trim_ascii() == label)
            && fields[k].replace((value.0 + 1, value.1)).is_some()
        {
            return None;
        }
    }
    let whole = COLUMNS.iter().zip(&fields).all(|(c, field)| !c.always || field.is_some());
    whole.then_some((time, fields))
}

impl Column {
    fn is_moment(&self) -> bool {
        self.component.ends_with("moment")
    }

    /// Whether the label is in its place and the number after it is all there.
    fn fits(&self, text: &[u8], at: usize) -> bool {
        let number = at + self.offset;
        text.get(number - self.label.len()..number) == Some(self.label)
            && text.len() >= number + self.width
    }
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
