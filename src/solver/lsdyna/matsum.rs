//! `matsum`: energies, momenta and velocities of parts, labelled, several lines per part.

use super::ascii::{Body, boxed};
use super::label_values::{Label, fields};
use super::line::{Line, integer, shown};
use crate::history::EntityId;
use crate::solver::Format;
use crate::solver::states::{StateReader, TableId};

const STATE: &[u8] = b" time =";
const PART: &[u8] = b" mat.#=";
/// Digits, point and exponent of a time.
const TIME: usize = 10;
/// Begins what may be below the parts.
const BELOW: &[u8] = b"Maximum mass increase";
/// Width of every number, right after its label.
const WIDTH: usize = 13;

/// The lines of a part; the last one is there only if hourglass energy is computed.
const LINES: [(&str, &[Label]); 4] = [
    (
        "parts' energies",
        &[
            ("internal_energy", "inten="),
            ("kinetic_energy", "kinen="),
            ("eroded_internal_energy", "eroded_ie="),
            ("eroded_kinetic_energy", "eroded_ke="),
        ],
    ),
    (
        "parts' momenta",
        &[("x_momentum", "x-mom="), ("y_momentum", "y-mom="), ("z_momentum", "z-mom=")],
    ),
    (
        "parts' velocities",
        &[("x_rbvelocity", "x-rbv="), ("y_rbvelocity", "y-rbv="), ("z_rbvelocity", "z-rbv=")],
    ),
    (
        "parts' hourglass energies",
        &[
            ("hourglass_energy", "hgeng="),
            ("added_mass", "+mass="),
            ("eroded_hourglass_energy", "eroded_he="),
        ],
    ),
];

pub(crate) const FORMAT: Format =
    Format::text("matsum", "part", boxed::<Matsum>, |line| line.starts_with(PART));

#[derive(Clone, Default)]
struct Matsum {
    tables: Option<[TableId; 4]>,
}

impl Body for Matsum {
    fn is_signature(&self, line: &[u8]) -> bool {
        line.starts_with(STATE)
    }

    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let text = line.text;
        if let Some(rest) = text.strip_prefix(STATE) {
            states.entity = None;
            states.time_digits = 5;
            // Five digits: two states may print one time, so the line begins a state.
            let time = super::heading_time(Some(rest), TIME, line, states);
            let time = time.filter(|_| rest.len() >= WIDTH);
            states.begin(time, line.into());
            if time.is_none() {
                states.damage(line, None, "expected a time".into());
            }
            return Some(());
        }
        let has = |label: &str| {
            memchr::memchr_iter(b'=', text).any(|at| text[..=at].ends_with(label.as_bytes()))
        };
        let found = LINES.iter().position(|(_, labels)| has(labels[0].1));
        if text.starts_with(PART) {
            let end = memchr::memmem::find(text, b"inten=");
            let id = end.and_then(|end| integer(&text[PART.len()..end]));
            states.entity = id.map(EntityId::new);
        }
        match (found, states.entity) {
            (Some(index), Some(part)) => self.values(index, part, line, states),
            (None, _) if line.is_heading() && !text.starts_with(PART) => {
                if !text.trim_ascii_start().starts_with(BELOW) {
                    states.skip_line(line);
                }
            }
            _ => {
                let found = shown(line.columns(1, 40));
                states.damage(line, None, format!("expected a part's values, found \"{found}\""));
            }
        }
        Some(())
    }
}

impl Matsum {
    fn values(
        &mut self,
        index: usize,
        part: EntityId,
        line: &Line<'_>,
        states: &mut StateReader<'_>,
    ) {
        let tables = *self.tables.get_or_insert_with(|| {
            LINES.map(|(what, labels)| states.table(what, labels.iter().map(|(name, _)| name)))
        });
        match fields(line, LINES[index].1, WIDTH, states) {
            Some(fields) => states.row(tables[index], part, line, |k| fields[k]),
            None => states.damage(line, None, "expected labels and their numbers".into()),
        }
    }
}
