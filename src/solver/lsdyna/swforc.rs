//! `swforc`: forces of spot welds and other connections, one row each.

use super::ascii::{Body, boxed};
use super::label_values::{is_number, numbers};
use super::line::{Line, integer, real};
use crate::history::EntityId;
use crate::solver::Format;
use crate::solver::states::{KeyedTables, StateReader};

const COLUMN_LINE: &[u8] = b" constraint #";
const COMPONENTS: [&str; 7] =
    ["axial", "shear", "failure", "length", "resultant_moment", "torsion", "failure_time"];
/// Columns: order number 1–11 (not the id), axial, shear and time of 13, failure to 59, kind,
/// `ID` and the id, then up to three numbers of 13, or the time of failure.
const AXIAL: (usize, usize) = (12, 24);
const SHEAR: (usize, usize) = (25, 37);
const TIME: (usize, usize) = (38, 50);
const FAILURE: (usize, usize) = (51, 59);
const ID: &[u8] = b"ID";
const WIDTH: usize = 13;
const FAILED: &[u8] = b"failure time=";
const FAILURE_TIME_WIDTH: usize = 12;
/// Kinds of connection, each with ids of its own.
const MAX_KINDS: usize = 20;

pub(crate) const FORMAT: Format =
    Format::text("swforc", "weld", boxed::<Swforc>, |line| line.starts_with(COLUMN_LINE));

#[derive(Clone, Default)]
struct Swforc {
    kinds: KeyedTables<Vec<u8>>,
}

impl Body for Swforc {
    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let is_column_line = line.text.starts_with(COLUMN_LINE) && line.is_heading();
        if !is_column_line && self.row(line, states).is_none() {
            let expected = "axial and shear force, time, kind and id of a weld";
            states.unexpected(line, Some([1, line.text.len()]), expected, 60);
        }
        Some(())
    }
}

impl Swforc {
    fn row(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let text = line.text.trim_ascii_end();
        integer(text.get(..AXIAL.0 - 1)?)?;
        let printed = line.columns(TIME.0, TIME.1);
        let time = real(printed).number()?;
        let at = FAILURE.1 + memchr::memmem::find(text.get(FAILURE.1..)?, ID)?;
        let kind = text[FAILURE.1..at].trim_ascii().to_vec();
        if kind.is_empty() || kind.contains(&b'*') {
            return None;
        }
        let id_from = at + ID.len();
        let blanks = text[id_from..].iter().take_while(|b| b.is_ascii_whitespace()).count();
        let digits = text[id_from + blanks..].iter().take_while(|b| b.is_ascii_digit()).count();
        let rest = id_from + blanks + digits;
        let entity = EntityId::new(integer(&text[id_from..rest])?);
        let failed = memchr::memmem::find(&text[rest..], FAILED).map(|at| rest + at + FAILED.len());
        let fields = match failed {
            Some(from) => {
                let behind = &text[from..];
                let blanks = behind.iter().take_while(|b| b.is_ascii_whitespace()).count();
                let word = behind[blanks..].iter().position(u8::is_ascii_whitespace);
                let end = from + word.map_or(behind.len(), |length| blanks + length);
                if !is_number(&text[from..end], FAILURE_TIME_WIDTH) {
                    return None;
                }
                vec![(from + 1, end)]
            }
            None => {
                let length = text.len() - rest;
                let words = text[rest..].split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
                let in_columns = length.is_multiple_of(WIDTH);
                let count = if in_columns { length / WIDTH } else { words.count() };
                if count > 3
                    || count > 0 && !states.allows_width("weld", length, count * WIDTH, line)
                {
                    return None;
                }
                numbers(line, rest, text.len(), count, WIDTH)?
            }
        };
        let table = self.kinds.get(kind, MAX_KINDS, |_| states.table("welds", COMPONENTS))?;
        // Words and blanks are there as well.
        let failure = line.columns(FAILURE.0, FAILURE.1).trim_ascii();
        let failure = failure.first().is_some_and(u8::is_ascii_digit);
        states.timed_row(table, entity, (time, printed), line, |k| match k {
            0 => Some(AXIAL),
            1 => Some(SHEAR),
            2 => failure.then_some(FAILURE),
            6 => failed.and(fields.first().copied()),
            _ => fields.get(k - 3).copied().filter(|_| failed.is_none()),
        });
        Some(())
    }
}
