//! `rwforc`: forces on rigid walls, one line per wall and state.

use super::ascii::{self, Body};
use super::line::{Field, Line, integer, real, shown};
use crate::history::EntityId;
use crate::solver::format::Format;
use crate::solver::problem::{Place, ProblemCode};
use crate::solver::states::{StateReader, TableId};

const COMPONENTS: [&str; 4] = ["normal_force", "x_force", "y_force", "z_force"];
/// "time columns 1–12 E12.5, wall id 13–20, four values of 15 (E15.6)".
const TIME: (usize, usize) = (1, 12);
const WALL: (usize, usize) = (13, 20);
const VALUE_WIDTH: usize = 15;

fn signature(line: &[u8]) -> bool {
    is_column_line(line) || is_node_set_heading(line)
}

pub(crate) const FORMAT: Format =
    Format::text("rwforc", "rigid wall", signature, ascii::read_default::<Rwforc>);

#[derive(Default)]
struct Rwforc {
    table: Option<TableId>,
    /// Inside rows of a layout that is not read: wall segments, node-set transducers.
    unread: Option<&'static str>,
    unread_rows: usize,
    first_unread: Option<Place>,
}

impl Body for Rwforc {
    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) {
        let text = line.text;
        if line.is_blank() {
            return;
        }
        let heading = line.is_heading();
        if is_column_line(text) && heading {
            self.unread = None;
        } else if heading && text.trim_ascii().starts_with(b"seg#") {
            self.unread = Some("wall segments");
        } else if is_node_set_heading(text) && heading {
            self.unread = Some("node-set transducers");
        } else if heading && text.trim_ascii().starts_with(b"total force") {
            self.unread = None;
        } else if self.unread.is_some() {
            self.unread_rows += 1;
            self.first_unread.get_or_insert(line.into());
        } else {
            self.row(line, states);
        }
    }

    fn end(&mut self, _: Place, states: &mut StateReader<'_>) {
        if self.unread_rows > 0 {
            states.problems.add(
                ProblemCode::UnreadRows,
                self.first_unread,
                None,
                format!(
                    "{} rows of wall segments or node-set transducers are not read",
                    self.unread_rows
                ),
            );
        }
    }
}

impl Rwforc {
    fn row(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) {
        let text = line.text.trim_ascii_end();
        // A wide wall id pushes the forces to the right.
        let forces = text.len().saturating_sub(COMPONENTS.len() * VALUE_WIDTH).max(WALL.1);
        let wall_field = text.get(TIME.1..forces).unwrap_or_default();
        let wall_width = wall_field.trim_ascii().len().max(WALL.1 - TIME.1);
        let width = TIME.1 + wall_width + COMPONENTS.len() * VALUE_WIDTH;
        let time = match real(line.columns(TIME.0, TIME.1)) {
            Field::Real(time) => Some(time),
            _ => None,
        };
        let (Some(time), Some(wall), true) = (time, integer(wall_field), text.len() == width)
        else {
            states.damage(
                line,
                Some([1, width]),
                format!(
                    "expected time, wall and {} forces in {width} columns, found \"{}\"",
                    COMPONENTS.len(),
                    shown(line.columns(1, 40)).trim_end()
                ),
            );
            return;
        };
        let table = *self.table.get_or_insert_with(|| states.table("walls", &COMPONENTS));
        let entity = EntityId::new(wall);
        if states.pending_time() != Some(time) || states.has_row(table, entity) {
            states.begin(Some(time), line.into());
        }
        states.row(table, entity, line, |k| {
            let from = forces + k * VALUE_WIDTH;
            Some((from + 1, from + VALUE_WIDTH))
        });
    }
}

fn is_column_line(text: &[u8]) -> bool {
    let mut words = text.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
    words.next() == Some(b"time") && words.next() == Some(b"wall#")
}

fn is_node_set_heading(text: &[u8]) -> bool {
    text.trim_ascii_start().starts_with(b"r i g i d   w a l l")
}
