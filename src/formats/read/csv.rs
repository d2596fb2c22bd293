//! Curve of a CSV file: columns by their headers, with their units.

use crate::error::{Error, ErrorCode, error};
use std::path::Path;

use super::columns::{Columns, MAX_POINTS, Places};
use super::curve::{self, Metadata, title};
use super::curve::{Place, shown};
use super::encoding::decoded;
use super::frame::{self, Frame, MatchQuality};
use super::label::Quantity;
use super::layout::{Layout, Missing};
use super::{ColumnNames, Input, open};
use crate::curve::{Envelope, ForceCurve};
use crate::table::{CsvTable, NoNumber, Row, separator};
use crate::unit::UnitSystem;

/// Reads a curve that drives an interface from a CSV file, as it stands: increasing deflections
/// from 0, forces of 0 or above, no titles above the header. Which columns it takes and what of the
/// `# key: value` lines: [`super`]. An error of the points is about `points`.
pub(super) fn driving(path: &Path) -> Result<ForceCurve, Error> {
    let (bytes, _) = open(path)?;
    let text = decoded(&bytes).bytes;
    let table = Table::read(&text, None, &ColumnNames::default(), Missing::OfColumn)
        .map_err(curve::content(path))?;
    let of_points = |error| curve::content(path)(error).at_key("points");
    let envelope = Envelope::new(table.deflection_m, table.force_n).map_err(of_points)?;
    match envelope.first_pulling_point() {
        Some(point) => Err(of_points(error!(
            CurveFile,
            "the force of point {point} is below 0: an interface only pushes, so write compression positive and pull as 0"
        ))),
        None => Ok(table.facts.driving(envelope)),
    }
}

/// Whether the extension says so, as that of no other tool's files does, or a header that names a
/// deflection and a force stands above rows of numbers, or the first line is such a header or row. Two
/// plain columns with blanks between are those of another reader.
pub(super) fn recognise(input: &Input<'_>) -> bool {
    let has = |wanted| input.path.extension().is_some_and(|e| e.eq_ignore_ascii_case(wanted));
    if has("csv") || has("tsv") {
        return true;
    }
    let Some(frame) = Frame::find(input.beginning(), &[], true) else { return false };
    match frame.fit {
        MatchQuality::Header => !frame.is_plain_pair,
        MatchQuality::Named | MatchQuality::Numbers => {
            frame.titles.is_empty() && !frame.is_plain_pair
        }
        MatchQuality::Above => false,
    }
}

pub(super) fn read(input: &Input<'_>) -> Result<Columns, Error> {
    let options = input.options;
    let mut table = Table::read(input.text, options.units, &options.columns, Missing::OfUnit)?;
    Ok(Columns {
        deflection_m: table.deflection_m,
        force_n: table.force_n,
        time_s: table.time_s,
        facts: table.facts,
        title: title(&table.title, &mut table.notes),
        notes: table.notes,
        units: options.units.filter(|_| table.units_used),
        ..Columns::at(Places::Lines(table.lines))
    })
}

/// The columns of a file.
#[derive(Default)]
struct Table {
    deflection_m: Vec<f64>,
    force_n: Vec<f64>,
    time_s: Option<Vec<f64>>,
    lines: Vec<u64>,
    facts: Metadata,
    /// The first line above the header.
    title: String,
    notes: Vec<String>,
    /// Whether a column took its unit from those that were given.
    units_used: bool,
}

impl Table {
    fn read(
        text: &[u8],
        units: Option<UnitSystem>,
        asked: &ColumnNames,
        lack: Missing,
    ) -> Result<Self, Error> {
        let mut table = Self::default();
        let found = Frame::find(text, &asked.all(), lack == Missing::OfUnit);
        let frame = found.unwrap_or_else(|| Frame::at_first_line(text, separator(text)));
        let comment = table.comments(&text[..frame.begin])?;
        table.title = frame.titles.first().map_or(String::new(), |(_, title)| title.clone());
        table.notes.extend(frame.note());
        let rest = frame.table(text);
        let mut csv =
            CsvTable::separated(&rest, frame.lines, frame.separator.byte()).map_err(not_csv)?;
        let header = csv.header_row();
        let mut names: Vec<String> =
            csv.header().iter().take(frame::MOST_COLUMNS).map(Into::into).collect();
        let mut rows = csv.rows().peekable();
        let is_bare = frame.fit == MatchQuality::Numbers && lack == Missing::OfUnit;
        let above = comment.and_then(|(line, text)| {
            let names = frame::names(&text, frame.separator, names.len())?;
            (is_bare && frame::names_both(&names, &[])).then_some((line, names))
        });
        let line = above.as_ref().map_or(header.line, |(line, _)| *line);
        let has_names = above.is_some() || !is_bare;
        names = above.map_or(names, |(_, names)| names);
        let units_row = rows.next_if(|row| match row {
            Ok(row) => !is_bare && frame::is_row_of_units(&row.fields().collect::<Vec<_>>()),
            Err(_) => false,
        });
        let layout = if has_names {
            Layout::of(&names, line, units_row.transpose().map_err(not_csv)?.as_ref(), lack, asked)?
        } else {
            Layout::without_header(&header, units, asked)?
        };
        table.notes.extend(layout.note());
        let taken = layout.sizes(units, &mut table.units_used, &mut table.notes)?;
        if is_bare {
            table.push(&header, &taken)?;
        }
        for row in rows {
            let row = row.map_err(not_csv)?;
            // Spreadsheets write rows of separators alone.
            if row.fields().any(|field| !field.is_empty()) {
                table.push(&row, &taken)?;
            }
        }
        Ok(table)
    }

    /// Takes the facts of the comments in front of the table; gives the last one with its line.
    fn comments(&mut self, text: &[u8]) -> Result<Option<(u64, String)>, Error> {
        let mut last = None;
        for (k, line) in text.split(|&b| b == b'\n').enumerate() {
            let line = String::from_utf8_lossy(line);
            let Some(comment) = line.trim().strip_prefix('#') else { continue };
            let comment = comment.trim_start_matches('#').trim();
            self.facts.take("#", comment, Place::Line(k as u64 + 1))?;
            last = Some((k as u64 + 1, comment.to_string()));
        }
        Ok(last)
    }

    fn push(&mut self, row: &Row, taken: &[(Quantity, usize, f64)]) -> Result<(), Error> {
        for &(quantity, field, size) in taken {
            let value = row.number(field).map_err(|NoNumber { line, column, found, .. }| {
                let place = Place::Field { line, field: column };
                error!(
                    CurveFile,
                    "{place}: expected a number, found \"{found}\"",
                    found = shown(&found)
                )
            })?;
            match quantity {
                Quantity::Deflection => self.deflection_m.push(value * size),
                Quantity::Force => self.force_n.push(value * size),
                Quantity::Time => self.time_s.get_or_insert_default().push(value * size),
            }
        }
        self.lines.push(row.line);
        if self.lines.len() > MAX_POINTS {
            Err(error!(
                CurveFile,
                "the curve has more than {most} points: thin it",
                most = MAX_POINTS
            ))
        } else {
            Ok(())
        }
    }
}
fn not_csv(error: csv::Error) -> Error {
    Error::below(ErrorCode::CurveFile, error)
}
