//! `sleout`: energies of contact interfaces, one row each, and their sums.

use std::io;

use super::ascii::{self, Body};
use super::line::{Line, integer, shown};
use crate::history::EntityId;
use crate::solver::problem::Place;
use crate::solver::source::Source;
use crate::solver::states::{States, TableId};
use crate::solver::{Selection, SolverFile};

const STATE: &[u8] = b" contact interface energy file, time=";
const TIME_WIDTH: usize = 14;
const COMPONENTS: [&str; 3] = ["slave", "master", "friction_energy"];
const ID: (usize, usize) = (1, 10);
/// Energies of both sides and of friction. Old files have no third column, and for
/// single-surface contacts no second one.
const FIELDS: [(usize, usize); 3] = [(11, 23), (24, 36), (65, 77)];
/// Sums: label to column 28, value behind it.
const SUMS: [(&[u8], &str); 6] = [
    (b"total slave side=", "total_slave"),
    (b"total surfa side=", "total_slave"),
    (b"total mastr side=", "total_master"),
    (b"total surfb side=", "total_master"),
    (b"total energy    =", "total_energy"),
    (b"friction energy =", "total_friction"),
];
const SUM: (usize, usize) = (29, 42);

pub fn signature(line: &[u8]) -> bool {
    line.starts_with(STATE)
}

pub fn read(source: &dyn Source, selection: &Selection) -> io::Result<SolverFile> {
    ascii::read("sleout", source, selection, Sleout::default)
}

#[derive(Default)]
struct Sleout {
    table: Option<TableId>,
    /// Width of the widest row: with friction all rows have it.
    width: usize,
}

impl Body for Sleout {
    fn is_signature(&self, line: &[u8]) -> bool {
        signature(line)
    }

    fn line(&mut self, line: &Line<'_>, states: &mut States<'_>) {
        let text = line.text;
        if line.is_blank() || (text.trim_ascii_start().starts_with(b"#") && line.is_heading()) {
            return;
        }
        if let Some(rest) = text.strip_prefix(STATE) {
            super::begin_at(rest, TIME_WIDTH, line, states);
        } else if self.values(line, states).is_none() {
            let found = shown(line.columns(1, 40));
            let message = format!(
                "expected an interface's energies or a sum, found \"{}\"",
                found.trim_end()
            );
            states.damage(line, None, message);
        }
    }

    fn end(&mut self, _: Place, _: &mut States<'_>) {}
}

impl Sleout {
    fn values(&mut self, line: &Line<'_>, states: &mut States<'_>) -> Option<()> {
        let text = line.text.trim_ascii_end();
        let label = SUMS.iter().find(|(label, _)| memchr::memmem::find(text, label).is_some());
        if let Some((_, name)) = label {
            let stars = memchr::memmem::find(line.columns(1, SUM.0 - 1), b"**");
            (text.len() == SUM.1 && stars.is_none()).then_some(())?;
            states.scalar(name, line.columns(SUM.0, SUM.1), line, [SUM.0, SUM.1]);
            return Some(());
        }
        let id = integer(line.columns(ID.0, ID.1))?;
        let columns = FIELDS.iter().position(|(_, to)| *to == text.len())? + 1;
        let whole = line.ended && (text.len() >= self.width || self.width < FIELDS[2].1);
        let between = line.columns(FIELDS[1].1 + 1, FIELDS[2].0 - 1);
        let is_apart = between.trim_ascii().is_empty();
        (is_apart && (whole || text.len() == FIELDS[2].1)).then_some(())?;
        self.width = self.width.max(text.len());
        let table = *self.table.get_or_insert_with(|| states.table("interfaces", &COMPONENTS));
        states.row(table, EntityId::new(id), line, |k| (k < columns).then_some(FIELDS[k]));
        Some(())
    }
}
