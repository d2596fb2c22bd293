//! `matsum`: energies, momenta and velocities of parts, labelled, several lines per part.

use std::io;

use super::ascii::{self, Body};
use super::line::{Field, Line, integer, real, shown};
use crate::history::EntityId;
use crate::solver::problem::Place;
use crate::solver::source::Source;
use crate::solver::states::{States, TableId};
use crate::solver::{Selection, SolverFile};

const STATE: &[u8] = b" time =";
const PART: &[u8] = b" mat.#=";
/// Width of every number, right behind its label.
const WIDTH: usize = 13;

/// A component and its label.
type Labelled = (&'static str, &'static [u8]);

/// The lines of a part; the last one is there only if hourglass energy is computed.
const LINES: [(&str, &[Labelled]); 4] = [
    (
        "parts' energies",
        &[
            ("internal_energy", b"inten="),
            ("kinetic_energy", b"kinen="),
            ("eroded_internal_energy", b"eroded_ie="),
            ("eroded_kinetic_energy", b"eroded_ke="),
        ],
    ),
    (
        "parts' momenta",
        &[("x_momentum", b"x-mom="), ("y_momentum", b"y-mom="), ("z_momentum", b"z-mom=")],
    ),
    (
        "parts' velocities",
        &[("x_rbvelocity", b"x-rbv="), ("y_rbvelocity", b"y-rbv="), ("z_rbvelocity", b"z-rbv=")],
    ),
    (
        "parts' hourglass energies",
        &[
            ("hourglass_energy", b"hgeng="),
            ("added_mass", b"+mass="),
            ("eroded_hourglass_energy", b"eroded_he="),
        ],
    ),
];

pub fn signature(line: &[u8]) -> bool {
    line.starts_with(PART)
}

pub fn read(source: &dyn Source, selection: &Selection) -> io::Result<SolverFile> {
    ascii::read("matsum", source, selection, Matsum::default)
}

#[derive(Default)]
struct Matsum {
    tables: Option<[TableId; 4]>,
    part: Option<i64>,
}

impl Body for Matsum {
    fn is_signature(&self, line: &[u8]) -> bool {
        signature(line) || line.starts_with(STATE)
    }

    fn line(&mut self, line: &Line<'_>, states: &mut States<'_>) {
        let text = line.text;
        if line.is_blank() {
            return;
        }
        if let Some(rest) = text.strip_prefix(STATE) {
            self.part = None;
            // Five digits: two states may print one time, so the line begins a state.
            match real(rest) {
                Field::Real(time) if line.ended && rest.len() >= WIDTH => {
                    states.begin(Some(time), line.into());
                }
                _ => {
                    states.begin(None, line.into());
                    states.damage(line, None, "expected a time".into());
                }
            }
            return;
        }
        let is_first = |labels: &[Labelled]| memchr::memmem::find(text, labels[0].1).is_some();
        let found = LINES.iter().position(|(_, labels)| is_first(labels));
        if text.starts_with(PART) {
            self.part = memchr::memmem::find(text, b"inten=")
                .and_then(|end| integer(&text[PART.len()..end]));
        }
        match (found, self.part) {
            (Some(index), Some(part)) => self.values(index, part, line, states),
            // "Maximum mass increase in …" and the like, below the parts.
            (None, _) if line.ended && !text.starts_with(PART) => {}
            _ => states.damage(
                line,
                None,
                format!("expected a part's values, found \"{}\"", shown(line.columns(1, 40))),
            ),
        }
    }

    fn end(&mut self, _: Place, _: &mut States<'_>) {}
}

impl Matsum {
    fn values(&mut self, index: usize, part: i64, line: &Line<'_>, states: &mut States<'_>) {
        let tables = *self.tables.get_or_insert_with(|| {
            LINES.map(|(name, labels)| {
                let components: Vec<&str> = labels.iter().map(|(c, _)| *c).collect();
                states.table(name, &components)
            })
        });
        let text = line.text.trim_ascii_end();
        let labels = LINES[index].1;
        let fields: Vec<Option<(usize, usize)>> = labels
            .iter()
            .map(|(_, label)| {
                let at = memchr::memmem::find(text, label)? + label.len();
                Some((at + 1, at + WIDTH))
            })
            .collect();
        // The row ends with its last number; a cut one does not.
        let end = fields.iter().flatten().map(|(_, to)| *to).max();
        if end != Some(text.len()) {
            states.damage(line, end.map(|e| [1, e]), "expected labels and their numbers".into());
            return;
        }
        states.row(tables[index], EntityId::new(part), line, |k| fields[k]);
    }
}
