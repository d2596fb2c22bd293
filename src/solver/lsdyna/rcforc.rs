//! `rcforc`: resultant forces of contact interfaces, one line per side and state.

use std::io;

use super::ascii::{self, Body};
use super::line::{Field, Line, integer, real, shown};
use crate::history::{EntityId, Side};
use crate::solver::problem::{Place, ProblemCode};
use crate::solver::source::Source;
use crate::solver::states::{States, TableId};
use crate::solver::{Selection, SolverFile};

/// Printed twice per state, without a time, for single-surface contacts.
const UNDEFINED: &[u8] = b"is single surface";
const INTERFACE: &[u8] = b"interface number,";
const TIME: &[u8] = b" time";
/// Width of the time and of every real number.
const WIDTH: usize = 12;

/// A component, its label, and where its number begins behind the start of ` time`.
/// The number of a label starts right behind it.
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

pub fn signature(line: &[u8]) -> bool {
    undefined_interface(line).is_some() || (side(line).is_some() && time_at(line).is_some())
}

pub fn read(source: &dyn Source, selection: &Selection) -> io::Result<SolverFile> {
    ascii::read("rcforc", source, selection, Rcforc::default)
}

#[derive(Default)]
struct Rcforc {
    table: Option<TableId>,
    /// Whether a row had moments: then a row without them is cut.
    moments: bool,
    undefined: Vec<i64>,
}

impl Body for Rcforc {
    fn is_signature(&self, line: &[u8]) -> bool {
        signature(line)
    }

    fn line(&mut self, line: &Line<'_>, states: &mut States<'_>) {
        if line.is_blank() {
            return;
        }
        if let Some(id) = undefined_interface(line.text) {
            if !self.undefined.contains(&id) {
                self.undefined.push(id);
            }
            if !line.ended && !line.text.ends_with(b"undefined") {
                states.problems.add(
                    ProblemCode::BadLine,
                    Some(line.into()),
                    None,
                    "the line is cut by the end of the file".into(),
                );
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

    fn end(&mut self, _: Place, _: &mut States<'_>) {}

    fn single_surfaces(&self) -> &[i64] {
        &self.undefined
    }
}

impl Rcforc {
    fn row(&mut self, side: Side, id_from: usize, line: &Line<'_>, states: &mut States<'_>) {
        let text = line.text;
        let parsed = time_at(text).and_then(|at| {
            let id = integer(text.get(id_from..at)?)?;
            let from = at + TIME.len();
            match real(text.get(from..from + WIDTH)?) {
                Field::Real(time) => Some((id, time, at)),
                _ => None,
            }
        });
        let Some((id, time, at)) = parsed else {
            states.damage(line, Some([9, 36]), "expected an interface id and a time".into());
            return;
        };
        let missing = COLUMNS.iter().find(|c| c.always && !c.fits(text, at));
        let moments = COLUMNS.iter().filter(|c| c.is_moment()).all(|c| c.fits(text, at));
        if let Some(bad) = missing {
            let label = shown(bad.label);
            states.damage(
                line,
                Some([at + bad.offset + 1 - bad.label.len(), at + bad.offset + bad.width]),
                format!("expected \"{}\" and a number of {} columns", label.trim(), bad.width),
            );
            return;
        }
        // Text behind the last whole column, or a cut file's row that is shorter than others.
        let end =
            COLUMNS.iter().filter(|c| c.fits(text, at)).map(|c| at + c.offset + c.width).max();
        let rest = text.get(end.unwrap_or(0)..).unwrap_or_default();
        if !rest.trim_ascii().is_empty() || (!moments && (self.moments || !line.ended)) {
            states.damage(
                line,
                Some([end.unwrap_or(0) + 1, text.len().max(end.unwrap_or(0) + 1)]),
                "expected the row's further columns, or its end".into(),
            );
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
        states.row(table, entity, line, |k| {
            let column = &COLUMNS[k];
            let from = at + column.offset;
            column.fits(text, at).then_some((from + 1, from + column.width))
        });
    }
}

impl Column {
    fn is_moment(&self) -> bool {
        self.component.ends_with("moment")
    }

    /// Whether the label stands in its place and the number behind it is all there.
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

/// Where ` time` begins: column 20, or further right behind a wide id.
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
