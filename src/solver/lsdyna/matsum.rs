//! `matsum`: energies, momenta and velocities of parts, labelled, several lines per part.

use super::ascii::Skipped;
use super::ascii::{self, Body};
use super::label_values::{Labelled, Widths, fields, labelled};
use super::line::{Line, integer, shown};
use crate::history::EntityId;
use crate::solver::format::Format;
use crate::solver::problem::Place;
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
const LINES: [(&str, &[Labelled]); 4] = [
    (
        "parts' energies",
        &[
            labelled("internal_energy", "inten=", WIDTH),
            labelled("kinetic_energy", "kinen=", WIDTH),
            labelled("eroded_internal_energy", "eroded_ie=", WIDTH),
            labelled("eroded_kinetic_energy", "eroded_ke=", WIDTH),
        ],
    ),
    (
        "parts' momenta",
        &[
            labelled("x_momentum", "x-mom=", WIDTH),
            labelled("y_momentum", "y-mom=", WIDTH),
            labelled("z_momentum", "z-mom=", WIDTH),
        ],
    ),
    (
        "parts' velocities",
        &[
            labelled("x_rbvelocity", "x-rbv=", WIDTH),
            labelled("y_rbvelocity", "y-rbv=", WIDTH),
            labelled("z_rbvelocity", "z-rbv=", WIDTH),
        ],
    ),
    (
        "parts' hourglass energies",
        &[
            labelled("hourglass_energy", "hgeng=", WIDTH),
            labelled("added_mass", "+mass=", WIDTH),
            labelled("eroded_hourglass_energy", "eroded_he=", WIDTH),
        ],
    ),
];

fn signature(line: &[u8]) -> bool {
    line.starts_with(PART)
}

pub(crate) const FORMAT: Format =
    Format::text("matsum", "part", signature, ascii::read_default::<Matsum>);

#[derive(Default)]
struct Matsum {
    tables: Option<[TableId; 4]>,
    part: Option<i64>,
    widths: Widths,
    skipped: Skipped,
}

impl Body for Matsum {
    fn is_signature(&self, line: &[u8]) -> bool {
        line.starts_with(STATE)
    }

    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) {
        let text = line.text;
        if line.is_blank() {
            return;
        }
        if let Some(rest) = text.strip_prefix(STATE) {
            self.part = None;
            states.set_time_digits(5);
            // Five digits: two states may print one time, so the line begins a state.
            let time = super::printed_time(rest, TIME, &mut self.widths, line, states);
            match time.filter(|_| rest.len() >= WIDTH) {
                Some(time) => states.begin(Some(time), line.into()),
                None => {
                    states.begin(None, line.into());
                    states.damage(line, None, "expected a time".into());
                }
            }
            return;
        }
        let is_first =
            |labels: &[Labelled]| memchr::memmem::find(text, labels[0].label.as_bytes()).is_some();
        let found = LINES.iter().position(|(_, labels)| is_first(labels));
        if text.starts_with(PART) {
            self.part = memchr::memmem::find(text, b"inten=")
                .and_then(|end| integer(&text[PART.len()..end]));
        }
        match (found, self.part) {
            (Some(index), Some(part)) => self.values(index, part, line, states),
            (None, _) if line.is_heading() && !text.starts_with(PART) => {
                if !text.trim_ascii_start().starts_with(BELOW) {
                    self.skipped.add(line);
                }
            }
            _ => states.damage(
                line,
                None,
                format!("expected a part's values, found \"{}\"", shown(line.columns(1, 40))),
            ),
        }
    }

    fn interrupt(&mut self) {
        self.part = None;
    }

    fn end(&mut self, _: Place, states: &mut StateReader<'_>) {
        self.skipped.tell(states);
    }
}

impl Matsum {
    fn values(&mut self, index: usize, part: i64, line: &Line<'_>, states: &mut StateReader<'_>) {
        let tables = *self.tables.get_or_insert_with(|| {
            LINES.map(|(name, labels)| {
                let components: Vec<&str> = labels.iter().map(|l| l.component).collect();
                states.table(name, &components)
            })
        });
        let Some(fields) = fields(line, LINES[index].1, &mut self.widths, states) else {
            states.damage(line, None, "expected labels and their numbers".into());
            return;
        };
        states.row(tables[index], EntityId::new(part), line, |k| fields[k]);
    }
}
