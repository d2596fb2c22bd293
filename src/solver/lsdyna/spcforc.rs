//! `spcforc`: forces and moments of single point constraints, and their resultant.
//!
//! A node in several sets of constraints has a row for each. The components of the second are `x_force_2` and so on.

use super::ascii::{Body, boxed};
use super::label_values::numbers;
use super::line::{Line, integer};
use crate::history::EntityId;
use crate::solver::Format;
use crate::solver::states::{StateReader, TableId};
use std::collections::HashMap;

const HEADING: &[u8] = b"single point constraint forces";
const STATE: &[u8] = b" output at time =";
const TIME_WIDTH: usize = 14;
const NODE: &[u8] = b" node=";
const FORCES: &[u8] = b"local x,y,z forces =";
const MOMENTS: &[u8] = b"local x,y,z moments=";
const RESULTANT: &[u8] = b"force resultants   =";
/// Three `E14.4` after each label, then `setid=` and digits (absent in old files).
const WIDTH: usize = 14;
const SET_ID: &[u8] = b"setid=";
/// Sets of constraints that a node may be in.
const MAX_SETS: usize = 20;

pub(crate) const FORMAT: Format = Format::text("spcforc", "node", boxed::<Spcforc>, |line| {
    line.trim_ascii() == HEADING || line.starts_with(STATE)
});

/// Forces and moments.
const COMPONENTS: [[&str; 3]; 2] =
    [["x_force", "y_force", "z_force"], ["x_moment", "y_moment", "z_moment"]];

#[derive(Clone, Default)]
struct Spcforc {
    /// Tables of the nodes' first forces and moments, of their second …
    tables: Vec<[TableId; 2]>,
    /// Rows of each node in the pending state: one for each set of constraints it is in.
    rows: HashMap<i64, [usize; 2]>,
}

impl Body for Spcforc {
    fn expected(&self) -> &'static str {
        "a node's forces or moments, or the resultant"
    }

    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        if let Some(rest) = line.text.strip_prefix(STATE) {
            self.rows.clear();
            super::begin_at(rest, TIME_WIDTH, line, states);
        } else if line.text.trim_ascii() != HEADING {
            self.values(line, states)?;
        }
        Some(())
    }
}

impl Spcforc {
    fn values(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let text = line.text.trim_ascii_end();
        let labels = [(FORCES, Some(0)), (MOMENTS, Some(1)), (RESULTANT, None)];
        let (at, label, kind) = labels.into_iter().find_map(|(label, kind)| {
            memchr::memmem::find(text, label).map(|at| (at, label, kind))
        })?;
        let from = at + label.len();
        let set_id = memchr::memmem::find(text, SET_ID);
        let end = text[..set_id.unwrap_or(text.len())].trim_ascii_end().len();
        let fields = numbers(line, from, end, 3, WIDTH)?;
        let what = if kind.is_some() { "forces or moments" } else { "force resultants" };
        if !states.allows_width(what, end - from, 3 * WIDTH, line) {
            return None;
        }
        let Some(kind) = kind else {
            if !(set_id.is_none() && text[..at].trim_ascii().is_empty()) {
                return None;
            }
            let names = ["x_resultant", "y_resultant", "z_resultant"];
            for (name, (first, last)) in names.iter().zip(fields) {
                states.scalar(name, line, [first, last]);
            }
            return Some(());
        };
        if let Some(set_id) = set_id {
            integer(&text[set_id + SET_ID.len()..])?;
        }
        // The width of the node's field is 6 or 8 by release.
        let id = integer(text[..at].strip_prefix(NODE)?)?;
        let count = &mut self.rows.entry(id).or_default()[kind];
        *count += 1;
        let row = *count;
        let table = self.table(row, kind, states)?;
        states.row(table, EntityId::new(id), line, |k| Some(fields[k]));
        Some(())
    }

    /// The table of the nodes' `row`-th forces or moments. `None` if there are too many.
    fn table(&mut self, row: usize, kind: usize, states: &mut StateReader<'_>) -> Option<TableId> {
        if row > MAX_SETS {
            return None;
        }
        while self.tables.len() < row {
            // A node's second x force is its `x_force_2`.
            let suffix = match self.tables.len() {
                0 => String::new(),
                others => format!("_{}", others + 1),
            };
            let mut table = |what, kind: usize| {
                states.table(what, COMPONENTS[kind].iter().map(|name| format!("{name}{suffix}")))
            };
            self.tables.push([table("nodes' forces", 0), table("nodes' moments", 1)]);
        }
        Some(self.tables[row - 1][kind])
    }
}
