//! `secforc`: forces, moments and centroids of cross sections, three lines per section.
//!
//! Tested with data only as LSTC's converter `l2a` writes it; of the solver's own files only
//! ones that end after the header.

use super::ascii::{self, Body, boxed};
use super::line::{Line, integer, real};
use crate::history::EntityId;
use crate::solver::Format;
use crate::solver::states::{StateReader, TableId};

/// "(1) id I12, time E15.5, then fields of 15, 12, 12, 12; (2), (3) 27 columns of system or
/// blanks, then the same fields".
const ID_END: usize = 12;
const TIME_END: usize = 27;
const FIELDS: [(usize, usize); 4] = [(28, 42), (43, 54), (55, 66), (67, 78)];
const WIDTH: usize = FIELDS[3].1;

pub(crate) const FORMAT: Format = Format::text("secforc", "section", boxed::<Secforc>, |line| {
    line.trim_ascii_start().starts_with(b"line#1  section#")
});

#[derive(Clone, Default)]
struct Secforc {
    /// Lines read of the section that the states are at.
    seen: usize,
}

impl Body for Secforc {
    /// One for each line of a section.
    fn tables(&self) -> ascii::Tables {
        &[
            ("sections' forces", &["x_force", "y_force", "z_force", "total_force"]),
            ("sections' moments", &["x_moment", "y_moment", "z_moment", "total_moment"]),
            ("sections' centroids", &["x_centroid", "y_centroid", "z_centroid", "area"]),
        ]
    }

    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        if line.text.trim_ascii_start().starts_with(b"line#") && line.is_heading() {
            return Some(());
        }
        // The second line names a system there, the third has blanks.
        let number = match line.columns(1, TIME_END).trim_ascii().first() {
            None => 2,
            Some(first) if first.is_ascii_alphabetic() => 1,
            Some(_) => 0,
        };
        let id = || integer(line.columns(1, ID_END)).map(EntityId::new);
        let printed = line.columns(ID_END + 1, TIME_END);
        let time = || real(printed).number();
        let head = match states.entity.take() {
            Some(section) if self.seen == number => Some((section, None)),
            _ if number == 0 => time().and_then(|time| Some((id()?, Some(time)))),
            _ => None,
        };
        let whole = head.filter(|_| line.text.trim_ascii_end().len() == WIDTH);
        let Some((section, time)) = whole else {
            let expected = format!("a section's forces, moments or centroid in {WIDTH} columns");
            states.unexpected(line, Some([1, WIDTH]), &expected, 40);
            return Some(());
        };
        let field = |k: usize| Some(FIELDS[k]);
        match time {
            Some(time) => states.timed_row(TableId(0), section, (time, printed), line, field),
            None => states.row(TableId(number), section, line, field),
        }
        states.entity = Some(section);
        self.seen = number + 1;
        Some(())
    }

    fn blank(&mut self, states: &mut StateReader<'_>) {
        states.entity = None;
    }
}
