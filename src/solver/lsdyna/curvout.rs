//! `curvout`: values of load curves over time.
//!
//! Seen only with states that list no curve.

use super::ascii::{self, Body, boxed};
use super::line::{Line, integer, is_whole_real};
use crate::history::EntityId;
use crate::solver::Format;
use crate::solver::states::repeat::Part;
use crate::solver::states::{StateReader, TableId};

const STATE: &[u8] = b" curve data for time step";
const COLUMN_LINE: &[u8] = b" curve id";

pub(crate) const FORMAT: Format =
    Format::text("curvout", "curve", boxed::<Curvout>, |line| line.starts_with(STATE));

#[derive(Clone, Default)]
struct Curvout;

impl Body for Curvout {
    fn tables(&self) -> ascii::Tables {
        &[("curves", &["ordinate"])]
    }

    fn has_empty_states(&self) -> bool {
        true
    }

    fn expected(&self) -> &'static str {
        "a curve's id and value"
    }

    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let text = line.text.trim_ascii_end();
        if text.starts_with(COLUMN_LINE) && line.is_heading() {
            return Some(());
        }
        if text.starts_with(STATE) {
            let end = memchr::memchr(b'(', text).unwrap_or(STATE.len());
            states.part(line, text.get(STATE.len()..end).unwrap_or_default(), Part::Unread);
            let time = super::heading_time(super::at_time(text), super::TIME, line, states);
            states.begin(time, line.into());
            if time.is_none() {
                states.damage(line, None, "expected \"( at time … )\"".into());
            }
            return Some(());
        }
        let start = text.iter().position(|b| !b.is_ascii_whitespace())?;
        let id_end = start + text[start..].iter().position(u8::is_ascii_whitespace)?;
        let id = integer(&text[..id_end])?;
        if !is_whole_real(text[id_end..].trim_ascii()) {
            return None;
        }
        states.row(TableId(0), EntityId::new(id), line, |_| Some((id_end + 1, text.len())));
        Some(())
    }
}
