//! `sleout`: energies of contact interfaces, one row each, and their sums.

use super::ascii::{self, Body, boxed};
use super::label_values::numbers;
use super::line::{Line, integer};
use crate::history::EntityId;
use crate::solver::Format;
use crate::solver::states::repeat::Part;
use crate::solver::states::{StateReader, TableId};

const STATE: &[u8] = b" contact interface energy file, time=";
const TIME_WIDTH: usize = 14;
const ID_END: usize = 10;
/// Energies of both sides and of friction. Old files have no third column, and for
/// single-surface contacts no second one.
const FIELDS: [(usize, usize); 3] = [(11, 23), (24, 36), (65, 77)];
/// Sums: the value is after the label.
const SUMS: [(&[u8], &str); 6] = [
    (b"total slave side=", "total_slave"),
    (b"total surfa side=", "total_slave"),
    (b"total mastr side=", "total_master"),
    (b"total surfb side=", "total_master"),
    (b"total energy    =", "total_energy"),
    (b"friction energy =", "total_friction"),
];
const SUM_WIDTH: usize = 14;

pub(crate) const FORMAT: Format =
    Format::text("sleout", "interface", boxed::<Sleout>, |line| line.starts_with(STATE));

#[derive(Clone, Default)]
struct Sleout {
    /// Width of the widest row: with friction all rows have it.
    width: usize,
}

impl Body for Sleout {
    fn tables(&self) -> ascii::Tables {
        &[("interfaces", &["slave", "master", "friction_energy"])]
    }

    fn expected(&self) -> &'static str {
        "an interface's energies or a sum"
    }

    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        if let Some(rest) = line.text.strip_prefix(STATE) {
            super::begin_at(rest, TIME_WIDTH, line, states);
        } else if line.text.trim_ascii_start().starts_with(b"#") && line.is_heading() {
            let cycle = memchr::memmem::find(line.text, b"cycle=").map(|at| &line.text[at + 6..]);
            states.part(line, cycle.unwrap_or_default(), Part::Unread);
        } else {
            self.values(line, states)?;
        }
        Some(())
    }
}

impl Sleout {
    fn values(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let text = line.text.trim_ascii_end();
        // Rows of interfaces have no sign of equality, and are many.
        let sums = if memchr::memchr(b'=', text).is_some() { &SUMS[..] } else { &[] };
        let sum = sums.iter().find_map(|(label, name)| {
            Some((memchr::memmem::find(text, label)? + label.len(), name))
        });
        if let Some((from, name)) = sum {
            if memchr::memmem::find(&text[..from], b"**").is_some() {
                return None;
            }
            let (first, last) = numbers(line, from, text.len(), 1, SUM_WIDTH)?[0];
            if !states.allows_width(name, text.len() - from, SUM_WIDTH, line) {
                return None;
            }
            states.scalar(name, line, [first, last]);
            return Some(());
        }
        let id = integer(line.columns(1, ID_END))?;
        // Further columns, such as one of transducers, stand apart after the third.
        let last = FIELDS[2].1;
        let is_wider = text.get(last).is_some_and(u8::is_ascii_whitespace);
        let width = if is_wider { last } else { text.len() };
        let columns = FIELDS.iter().position(|(_, to)| *to == width)? + 1;
        let between = line.columns(FIELDS[1].1 + 1, FIELDS[2].0 - 1);
        let is_whole = width >= self.width || self.width < last;
        if !(is_whole && between.trim_ascii().is_empty()) {
            return None;
        }
        self.width = self.width.max(width);
        states.row(TableId(0), EntityId::new(id), line, |k| (k < columns).then_some(FIELDS[k]));
        Some(())
    }
}
