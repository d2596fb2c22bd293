//! `spcforc`: forces and moments of single point constraints, and their resultant.
//!
//! A node in several sets of constraints has a row for each. The components of the second are `x_force_2` and so on.

use super::ascii::{self, Body};
use super::label_values::{Widths, numbers};
use super::line::{Line, integer, shown};
use crate::history::EntityId;
use crate::solver::format::Format;
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

fn signature(line: &[u8]) -> bool {
    line.trim_ascii() == HEADING || line.starts_with(STATE)
}

pub(crate) const FORMAT: Format =
    Format::text("spcforc", "node", signature, ascii::read_default::<Spcforc>);

/// Forces and moments.
const COMPONENTS: [[&str; 3]; 2] =
    [["x_force", "y_force", "z_force"], ["x_moment", "y_moment", "z_moment"]];

#[derive(Default)]
struct Spcforc {
    /// Tables of the nodes' first forces and moments, of their second …
    tables: Vec<[TableId; 2]>,
    /// Rows of each node in the pending state: one for each set of constraints it is in.
    rows: HashMap<i64, [usize; 2]>,
    widths: Widths,
}

impl Body for Spcforc {
    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) {
        if line.is_blank() || line.text.trim_ascii() == HEADING {
            return;
        }
        if let Some(rest) = line.text.strip_prefix(STATE) {
            self.rows.clear();
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
        let excess = end as isize - (from + 3 * WIDTH) as isize;
        if !self.widths.allow(what, excess, line, states) {
            return None;
        }
        let Some(kind) = kind else {
            if !(set_id.is_none() && text[..at].trim_ascii().is_empty()) {
                return None;
            }
            let names = ["x_resultant", "y_resultant", "z_resultant"];
            for (name, &(first, last)) in names.iter().zip(&fields) {
                states.scalar(name, line.columns(first, last), line, [first, last]);
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
            let [forces, moments] = COMPONENTS.map(|names| names.map(|n| format!("{n}{suffix}")));
            self.tables.push([
                states.table("nodes' forces", &forces.each_ref().map(String::as_str)),
                states.table("nodes' moments", &moments.each_ref().map(String::as_str)),
            ]);
        }
        Some(self.tables[row - 1][kind])
    }
}
