//! `rwforc`: forces on rigid walls, one line per wall and state.

use super::ascii::{self, Body, boxed};
use super::line::{Line, integer, real};
use crate::history::EntityId;
use crate::solver::Format;
use crate::solver::problem::{Place, ProblemCode};
use crate::solver::states::{StateReader, TableId};

const COMPONENTS: [&str; 4] = ["normal_force", "x_force", "y_force", "z_force"];
/// "time columns 1–12 E12.5, wall id 13–20, four values of 15 (E15.6)".
const TIME_END: usize = 12;
const WALL_END: usize = 20;
const VALUE_WIDTH: usize = 15;

pub(crate) const FORMAT: Format = Format::text("rwforc", "rigid wall", boxed::<Rwforc>, |line| {
    is_column_line(line) || is_node_set_heading(line)
});

#[derive(Clone, Default)]
struct Rwforc {
    /// Inside rows of a layout that is not read: wall segments, node-set transducers.
    is_unread: bool,
    unread_rows: usize,
    first_unread: Option<Place>,
}

impl Body for Rwforc {
    fn tables(&self) -> ascii::Tables {
        &[("walls", &COMPONENTS)]
    }

    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let begins = |heading: &[u8]| line.text.trim_ascii().starts_with(heading);
        let is_heading = line.is_heading();
        if is_heading && (is_column_line(line.text) || begins(b"total force")) {
            self.is_unread = false;
        } else if is_heading && (begins(b"seg#") || is_node_set_heading(line.text)) {
            self.is_unread = true;
        } else if self.is_unread {
            self.unread_rows += 1;
            states.mark_unlike();
            self.first_unread.get_or_insert(line.into());
        } else {
            row(line, states);
        }
        Some(())
    }

    fn end(&mut self, states: &mut StateReader<'_>) {
        if self.unread_rows > 0 {
            let message = format!(
                "{} rows of wall segments or node-set transducers are not read",
                self.unread_rows
            );
            states.problems.add(ProblemCode::UnreadRows, self.first_unread, message);
        }
    }
}

fn row(line: &Line<'_>, states: &mut StateReader<'_>) {
    let text = line.text.trim_ascii_end();
    // A wide wall id pushes the forces to the right.
    let forces = text.len().saturating_sub(COMPONENTS.len() * VALUE_WIDTH).max(WALL_END);
    let wall = text.get(TIME_END..forces).unwrap_or_default();
    let wall_width = wall.trim_ascii().len().max(WALL_END - TIME_END);
    let width = TIME_END + wall_width + COMPONENTS.len() * VALUE_WIDTH;
    let printed = line.columns(1, TIME_END);
    let time = real(printed).number();
    let Some((time, wall)) = time.zip(integer(wall)).filter(|_| text.len() == width) else {
        let expected = format!("time, wall and {} forces in {width} columns", COMPONENTS.len());
        states.unexpected(line, Some([1, width]), &expected, 40);
        return;
    };
    states.timed_row(TableId(0), EntityId::new(wall), (time, printed), line, |k| {
        let from = forces + k * VALUE_WIDTH;
        Some((from + 1, from + VALUE_WIDTH))
    });
}

fn is_column_line(text: &[u8]) -> bool {
    let mut words = text.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
    words.next() == Some(b"time") && words.next() == Some(b"wall#")
}

fn is_node_set_heading(text: &[u8]) -> bool {
    text.trim_ascii_start().starts_with(b"r i g i d   w a l l")
}
