//! What curves in solver decks share: comments with metadata, points of two fields, fields of a line.

use super::columns::check_points;
use super::curve::{Metadata, Place, ReadCurve, expected, stated_units, title, units, value};
use crate::error::Error;
use crate::unit::UnitSystem;

/// Columns of a point's field.
pub(super) const WIDTH: usize = 20;

/// Metadata of the comments so far.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Said {
    pub facts: Metadata,
    pub units: Option<(UnitSystem, u64)>,
}

impl Said {
    pub(super) fn comment(&mut self, line: &str, at: u64) -> Result<(), Error> {
        let comment = line.trim_start_matches(['$', '#']);
        self.units = stated_units(comment).map(|units| (units, at)).or(self.units);
        self.facts.take(&line[..1], comment, Place::Line(at))
    }
}

/// A curve of a deck, in the deck's units.
#[derive(Clone, Debug, Default)]
pub(super) struct DeckCurve {
    pub id: String,
    pub title: String,
    /// Metadata of the comments before its points.
    pub said: Said,
    pub points: Vec<(f64, f64)>,
    pub notes: Vec<String>,
    pub lines: Vec<u64>,
}

impl DeckCurve {
    /// Takes a line of two numbers, or nothing.
    pub(super) fn point(&mut self, line: &str, at: u64) -> Result<(), Error> {
        if line.trim().is_empty() {
            return Ok(());
        }
        let fields = Fields::of(line, at, WIDTH);
        self.points.push((fields.number(0, false)?, fields.number(1, false)?));
        self.lines.push(at);
        check_points(self.points.len())
    }

    /// The same in SI; `remedy` is a way to state the units in the file.
    pub(super) fn columns(
        mut self,
        given: Option<UnitSystem>,
        remedy: &'static str,
    ) -> Result<ReadCurve, Error> {
        let system = units(self.said.units, given, remedy, &mut self.notes)?;
        let (length, force) = (system.length_m, system.force());
        Ok(ReadCurve {
            deflection_m: self.points.iter().map(|(x, _)| x * length).collect(),
            force_n: self.points.iter().map(|(_, y)| y * force).collect(),
            facts: self.said.facts,
            title: title(&self.title, &mut self.notes),
            units: Some(system),
            notes: self.notes,
            lines: self.lines,
            ..ReadCurve::default()
        })
    }
}

/// The fields of a line: between commas, or of one width.
pub(super) struct Fields<'a> {
    line: u64,
    width: usize,
    list: Vec<&'a str>,
    is_free: bool,
}

/// Fields of a line that are examined: card 1 has eight.
const FIELDS: usize = 8;

impl<'a> Fields<'a> {
    pub(super) fn of(text: &'a str, line: u64, width: usize) -> Self {
        if text.contains(',') {
            let list = text.split(',').take(FIELDS).collect();
            return Self { line, width, list, is_free: true };
        }
        // By characters: a column of a text that is not ASCII may lie within one.
        let at = |k: usize| text.char_indices().nth(k * width).map_or(text.len(), |(at, _)| at);
        let list = (0..FIELDS).map(|k| &text[at(k)..at(k + 1)]).take_while(|f| !f.is_empty());
        Self { line, width, list: list.collect(), is_free: false }
    }

    pub(super) fn text(&self, field: usize) -> &'a str {
        self.list.get(field).copied().unwrap_or_default()
    }

    pub(super) fn place(&self, field: usize) -> Place {
        if self.is_free {
            Place::Field { line: self.line, field: field + 1 }
        } else {
            Place::Columns {
                line: self.line,
                from: field * self.width + 1,
                to: (field + 1) * self.width,
            }
        }
    }

    /// A number; 0 for an empty field where that may be.
    pub(super) fn number(&self, field: usize, allow_empty_states: bool) -> Result<f64, Error> {
        let text = self.text(field).trim();
        if text.is_empty() && allow_empty_states {
            return Ok(0.0);
        }
        if text.split_whitespace().count() < 2 {
            return value(self.place(field), text);
        }
        let what = format_args!(
            "one number in each field of {} columns, or fields with commas between",
            self.width
        );
        Err(expected(self.place(field), what, text))
    }
}
