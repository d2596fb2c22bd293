//! `spcforc`: forces and moments of single point constraints, and their resultant.

use std::io;

use super::ascii::{self, Body};
use super::line::{Line, integer, shown};
use crate::history::EntityId;
use crate::solver::problem::Place;
use crate::solver::source::Source;
use crate::solver::states::{States, TableId};
use crate::solver::{Selection, SolverFile};

const HEADING: &[u8] = b"single point constraint forces";
const STATE: &[u8] = b" output at time =";
const TIME_WIDTH: usize = 14;
const NODE: &[u8] = b" node=";
const FORCES: &[u8] = b"local x,y,z forces =";
const MOMENTS: &[u8] = b"local x,y,z moments=";
const RESULTANT: &[u8] = b"force resultants   =";
/// Three `E14.4` behind each label, then `  setid=` and eight digits (absent in old files).
const WIDTH: usize = 14;
const SET_ID: &[u8] = b"  setid=";
const SET_ID_WIDTH: usize = 8;

pub fn signature(line: &[u8]) -> bool {
    line.trim_ascii() == HEADING || line.starts_with(STATE)
}

pub fn read(source: &dyn Source, selection: &Selection) -> io::Result<SolverFile> {
    ascii::read("spcforc", source, selection, Spcforc::default)
}

#[derive(Default)]
struct Spcforc {
    tables: Option<[TableId; 2]>,
    /// Whether rows end with the id of a set: then a row without it is cut.
    has_set_ids: bool,
}

impl Body for Spcforc {
    fn is_signature(&self, line: &[u8]) -> bool {
        signature(line)
    }

    fn line(&mut self, line: &Line<'_>, states: &mut States<'_>) {
        if line.is_blank() || line.text.trim_ascii() == HEADING {
            return;
        }
        if let Some(rest) = line.text.strip_prefix(STATE) {
            super::begin_at(rest, TIME_WIDTH, line, states);
        } else if self.values(line, states).is_none() {
            let found = shown(line.columns(1, 40));
            let message = format!(
                "expected a node's forces or moments, or the resultant, found \"{}\"",
                found.trim_end()
            );
            states.damage(line, None, message);
        }
    }

    fn end(&mut self, _: Place, _: &mut States<'_>) {}
}

impl Spcforc {
    fn values(&mut self, line: &Line<'_>, states: &mut States<'_>) -> Option<()> {
        let text = line.text.trim_ascii_end();
        let [forces, moments] = *self.tables.get_or_insert_with(|| {
            [
                states.table("nodes' forces", &["x_force", "y_force", "z_force"]),
                states.table("nodes' moments", &["x_moment", "y_moment", "z_moment"]),
            ]
        });
        let labels = [(FORCES, Some(forces)), (MOMENTS, Some(moments)), (RESULTANT, None)];
        let (at, label, table) = labels.into_iter().find_map(|(label, table)| {
            memchr::memmem::find(text, label).map(|at| (at, label, table))
        })?;
        let from = at + label.len();
        let end = from + 3 * WIDTH;
        let field = |k: usize| (from + k * WIDTH + 1, from + (k + 1) * WIDTH);
        let Some(table) = table else {
            let is_alone = text[..at].trim_ascii().is_empty();
            (text.len() == end && is_alone).then_some(())?;
            for (k, name) in ["x_resultant", "y_resultant", "z_resultant"].iter().enumerate() {
                let (first, last) = field(k);
                states.scalar(name, line.columns(first, last), line, [first, last]);
            }
            return Some(());
        };
        let rest = text.get(end..)?;
        match rest.strip_prefix(SET_ID) {
            Some(id) if id.len() == SET_ID_WIDTH && integer(id).is_some() => {
                self.has_set_ids = true;
            }
            None if rest.is_empty() && !self.has_set_ids => {}
            _ => return None,
        }
        // The width of the node's field is 6 or 8 by release.
        let id = integer(text[..at].strip_prefix(NODE)?)?;
        states.row(table, EntityId::new(id), line, |k| Some(field(k)));
        Some(())
    }
}
