//! `secforc`: forces, moments and centroids of cross sections, three lines per section.
//!
//! Tested with data only as LSTC's converter `l2a` writes it; of the solver's own files only
//! ones that end after the header.

use super::ascii::{self, Body};
use super::line::{Field, Line, integer, real, shown};
use crate::history::EntityId;
use crate::solver::format::Format;
use crate::solver::states::{StateReader, TableId};

/// "(1) id I12, time E15.5, then fields of 15, 12, 12, 12; (2), (3) 27 columns of system or
/// blanks, then the same fields".
const ID: (usize, usize) = (1, 12);
const TIME: (usize, usize) = (13, 27);
const FIELDS: [(usize, usize); 4] = [(28, 42), (43, 54), (55, 66), (67, 78)];

/// What the three lines of a section hold.
const LINES: [(&str, [&str; 4]); 3] = [
    ("sections' forces", ["x_force", "y_force", "z_force", "total_force"]),
    ("sections' moments", ["x_moment", "y_moment", "z_moment", "total_moment"]),
    ("sections' centroids", ["x_centroid", "y_centroid", "z_centroid", "area"]),
];

fn signature(line: &[u8]) -> bool {
    line.trim_ascii_start().starts_with(b"line#1  section#")
}

pub(crate) const FORMAT: Format =
    Format::text("secforc", "section", signature, ascii::read_default::<Secforc>);

#[derive(Default)]
struct Secforc {
    tables: Option<[TableId; 3]>,
    /// The section whose lines are being read, and how many of them were.
    section: Option<(i64, usize)>,
}

impl Body for Secforc {
    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) {
        if line.is_blank() {
            self.section = None;
        } else if !(line.text.trim_ascii_start().starts_with(b"line#") && line.is_heading()) {
            self.values(line, states);
        }
    }

    fn interrupt(&mut self) {
        self.section = None;
    }
}

impl Secforc {
    fn values(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) {
        let tables = *self.tables.get_or_insert_with(|| {
            LINES.each_ref().map(|(name, components)| states.table(name, components))
        });
        let width = FIELDS[FIELDS.len() - 1].1;
        // The second line names a system there, the third has blanks.
        let label = line.columns(ID.0, TIME.1).trim_ascii();
        let found = match label.first() {
            None => 2,
            Some(first) if first.is_ascii_alphabetic() => 1,
            Some(_) => 0,
        };
        let head = match (self.section, real(line.columns(TIME.0, TIME.1))) {
            (Some((id, seen)), _) if seen == found => Some((id, seen, None)),
            (_, Field::Real(time)) if found == 0 => {
                integer(line.columns(ID.0, ID.1)).map(|id| (id, 0, Some(time)))
            }
            _ => None,
        };
        let (Some((id, seen, time)), true) = (head, line.text.trim_ascii_end().len() == width)
        else {
            self.section = None;
            states.damage(
                line,
                Some([1, width]),
                format!(
                    "expected a section's forces, moments or centroid in {width} columns, found \"{}\"",
                    shown(line.columns(1, 40)).trim_end()
                ),
            );
            return;
        };
        let entity = EntityId::new(id);
        if let Some(time) = time
            && (states.pending_time() != Some(time) || states.has_row(tables[0], entity))
        {
            states.begin(Some(time), line.into());
        }
        states.row(tables[seen], entity, line, |k| Some(FIELDS[k]));
        self.section = Some((id, seen + 1));
    }
}
