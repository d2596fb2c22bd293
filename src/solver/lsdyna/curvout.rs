//! `curvout`: values of load curves over time.
//!
//! Seen only with states that list no curve.

use super::ascii::{self, Body};
use super::label_values::Widths;
use super::line::{Line, integer, is_whole_real, shown};
use crate::history::EntityId;
use crate::solver::format::Format;
use crate::solver::states::{StateReader, TableId};

const STATE: &[u8] = b" curve data for time step";
const COLUMN_LINE: &[u8] = b" curve id";

fn signature(line: &[u8]) -> bool {
    line.starts_with(STATE)
}

pub(crate) const FORMAT: Format =
    Format::text("curvout", "curve", signature, ascii::read_default::<Curvout>);

#[derive(Default)]
struct Curvout {
    table: Option<TableId>,
    widths: Widths,
}

impl Body for Curvout {
    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) {
        states.allow_empty_states();
        if line.is_blank() || (line.text.starts_with(COLUMN_LINE) && line.is_heading()) {
            return;
        }
        if line.text.starts_with(STATE) {
            let text = super::at_time(line.text);
            let time = text.and_then(|text| {
                super::printed_time(text, super::TIME, &mut self.widths, line, states)
            });
            states.begin(time, line.into());
            if time.is_none() {
                states.damage(line, None, "expected \"( at time … )\"".into());
            }
        } else if self.row(line, states).is_none() {
            let found = shown(line.columns(1, 40));
            let message =
                format!("expected a curve's id and value, found \"{}\"", found.trim_end());
            states.damage(line, None, message);
        }
    }
}

impl Curvout {
    fn row(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let text = line.text.trim_ascii_end();
        let start = text.iter().position(|b| !b.is_ascii_whitespace())?;
        let id_end = start + text[start..].iter().position(u8::is_ascii_whitespace)?;
        let id = integer(&text[..id_end])?;
        if !is_whole_real(text[id_end..].trim_ascii()) {
            return None;
        }
        let table = *self.table.get_or_insert_with(|| states.table("curves", &["ordinate"]));
        states.row(table, EntityId::new(id), line, |_| Some((id_end + 1, text.len())));
        Some(())
    }
}
