//! Curve of a CSV file: columns by their headers, with their units.

use std::path::Path;

use super::columns::{Columns, MAX_POINTS, Places};
use super::curve::{self, Facts};
use super::error::{ContentError, Place, ReadCurveError, shown};
use super::label::{Label, Quantity};
use super::{Input, open};
use crate::curve::{DrivingCurve, Envelope};
use crate::table::{CsvTable, NoNumber, Row};
use crate::unit::UnitSystem;

/// Reads a curve that drives an interface from a CSV file, as it stands: increasing deflections
/// from 0, forces of 0 or above. Which columns it takes and what of the `# key: value` lines:
/// [`super`].
///
/// # Errors
/// [`ReadCurveError`] with line and field.
pub fn driving(path: &Path) -> Result<DrivingCurve, ReadCurveError> {
    let (bytes, _) = open(path)?;
    let read = || {
        let table = Table::read(&bytes, None, Lack::OfColumn)?;
        let envelope = Envelope::new(table.deflection_m, table.force_n)?;
        match envelope.first_pulling_point() {
            Some(point) => Err(ContentError::Pulling { point }),
            None => Ok(table.facts.driving(envelope)),
        }
    };
    read().map_err(curve::content(path))
}

/// Whether the extension says so, as that of no other tool's files does, or the first line that is
/// no comment separates two columns of a curve, or two numbers.
pub(super) fn recognise(input: &Input<'_>) -> bool {
    if input.path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv")) {
        return true;
    }
    let Ok(table) = CsvTable::open(input.beginning(), 0) else { return false };
    let row = table.header_row();
    let is_ours = |field| Label::parse(row.field(field)).is_some() || row.number(field).is_ok();
    table.header().len() > 1 && (0..table.header().len()).filter(|&k| is_ours(k)).count() > 1
}

pub(super) fn read(input: &Input<'_>) -> Result<Columns, ContentError> {
    let table = Table::read(input.bytes, input.options.units, Lack::OfUnit)?;
    Ok(Columns {
        deflection_m: table.deflection_m,
        force_n: table.force_n,
        time_s: table.time_s,
        facts: table.facts,
        notes: table.notes,
        units: input.options.units.filter(|_| table.units_used),
        ..Columns::at(Places::Lines(table.lines))
    })
}

/// What a column without a unit lacks: a scenario cannot give units beside the file.
#[derive(Clone, Copy, PartialEq)]
enum Lack {
    OfColumn,
    OfUnit,
}

/// The columns of a file.
#[derive(Default)]
struct Table {
    deflection_m: Vec<f64>,
    force_n: Vec<f64>,
    time_s: Option<Vec<f64>>,
    lines: Vec<u64>,
    facts: Facts,
    notes: Vec<String>,
    /// Whether a column took its unit from those that were given.
    units_used: bool,
}

impl Table {
    fn read(bytes: &[u8], units: Option<UnitSystem>, lack: Lack) -> Result<Self, ContentError> {
        let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
        let mut table = Self::default();
        let (lines, begin) = table.comments(bytes)?;
        let mut csv = CsvTable::open(&bytes[begin..], lines)?;
        let header = csv.header_row();
        let names: Vec<String> = csv.header().iter().map(Into::into).collect();
        let mut rows = csv.rows().peekable();
        let mut layout = match header.number(0).is_ok() && header.number(1).is_ok() {
            true if lack == Lack::OfUnit => Layout::without_header(&header, units)?,
            _ => Layout::of(&names, header.line, lack)?,
        };
        if let Some(Ok(row)) = rows.peek()
            && layout.take_units(row)
        {
            rows.next();
        }
        let taken = layout.sizes(&header, units, &mut table)?;
        if layout.is_bare {
            table.push(&header, &taken)?;
        }
        for row in rows {
            table.push(&row?, &taken)?;
        }
        Ok(table)
    }

    /// Takes the facts of the lines in front of the header; gives the number of these lines and
    /// their bytes.
    fn comments(&mut self, bytes: &[u8]) -> Result<(u64, usize), ContentError> {
        let (mut lines, mut begin) = (0, 0);
        for line in bytes.split_inclusive(|&b| b == b'\n').take_while(|l| {
            let l = l.trim_ascii();
            l.is_empty() || l.starts_with(b"#")
        }) {
            lines += 1;
            begin += line.len();
            let line = String::from_utf8_lossy(line);
            self.facts.take("#", line.trim().trim_start_matches('#'), Place::Line(lines))?;
        }
        Ok((lines, begin))
    }

    fn push(&mut self, row: &Row, taken: &[(Quantity, usize, f64)]) -> Result<(), ContentError> {
        for &(quantity, field, size) in taken {
            let value = row.number(field).map_err(|NoNumber { line, column, found, .. }| {
                let place = Place::Field { line, field: column };
                ContentError::Number { place, found: shown(&found) }
            })?;
            match quantity {
                Quantity::Deflection => self.deflection_m.push(value * size),
                Quantity::Force => self.force_n.push(value * size),
                Quantity::Time => self.time_s.get_or_insert_default().push(value * size),
            }
        }
        self.lines.push(row.line);
        match self.lines.len() > MAX_POINTS {
            true => Err(ContentError::TooMany { most: MAX_POINTS }),
            false => Ok(()),
        }
    }
}

/// Which fields hold what.
struct Layout {
    /// Field, counted from 0, its header, and what that names.
    columns: Vec<(usize, String, Label)>,
    /// Whether the file has no header.
    is_bare: bool,
}

impl Layout {
    /// By the header's names; the first field of each quantity.
    fn of(names: &[String], line: u64, lack: Lack) -> Result<Self, ContentError> {
        let mut columns = Vec::new();
        for (quantity, usual) in
            [(Quantity::Deflection, 0), (Quantity::Force, 1), (Quantity::Time, 2)]
        {
            let found = names.iter().enumerate().find_map(|(field, name)| {
                let label = Label::parse(name).filter(|label| label.quantity == quantity)?;
                let is_whole = lack == Lack::OfUnit || label.unit.is_some();
                is_whole.then(|| (field, name.clone(), label))
            });
            match found {
                Some(column) => columns.push(column),
                None if quantity == Quantity::Time => {}
                None => {
                    return Err(ContentError::Header {
                        place: Place::Line(line),
                        wanted: quantity.name(),
                        example: quantity.example(),
                        found: shown(names.get(usual).map_or("", |name| name)),
                    });
                }
            }
        }
        Ok(Self { columns, is_bare: false })
    }

    /// Deflection, then force, in the units that were given.
    fn without_header(row: &Row, units: Option<UnitSystem>) -> Result<Self, ContentError> {
        if units.is_none() {
            return Err(ContentError::NoUnit {
                place: Place::Line(row.line),
                what: "header (the names of the columns)",
                found: shown(&format!("{} {}", row.field(0), row.field(1))),
                example: "\"d_mm,force_kN\" above the values",
            });
        }
        let columns = [Quantity::Deflection, Quantity::Force]
            .into_iter()
            .enumerate()
            .map(|(field, quantity)| {
                (field, format!("column {}", field + 1), Label { quantity, unit: None })
            })
            .collect();
        Ok(Self { columns, is_bare: true })
    }

    /// Takes the units from a row of units below the header; false if the row is none.
    fn take_units(&mut self, row: &Row) -> bool {
        let unit = |field: usize, label: &Label| {
            let unit = row.field(field).trim_matches(['[', ']', '(', ')']);
            label.quantity.dimension().size_of(unit).map(|_| unit.to_string())
        };
        let units: Option<Vec<String>> = self
            .columns
            .iter()
            .map(|(field, _, label)| match label.unit {
                None => unit(*field, label),
                Some(_) => None,
            })
            .collect();
        let Some(units) = units else { return false };
        for ((_, _, label), unit) in self.columns.iter_mut().zip(units) {
            label.unit = Some(unit);
        }
        true
    }

    /// What each field is and the SI value of its unit; says what was taken.
    fn sizes(
        &self,
        header: &Row,
        units: Option<UnitSystem>,
        table: &mut Table,
    ) -> Result<Vec<(Quantity, usize, f64)>, ContentError> {
        let place = Place::Line(header.line);
        let mut taken = Vec::new();
        let mut said = Vec::new();
        for (field, name, label) in &self.columns {
            taken.push((label.quantity, *field, label.size(name, units, place.clone())?));
            let name = shown(name);
            said.push(match (&label.unit, units) {
                (None, Some(units)) => {
                    table.units_used = true;
                    format!("{} of \"{name}\" in units {units} as given", label.quantity.name())
                }
                (Some(unit), _) => {
                    format!("{} of \"{name}\" in {unit}", label.quantity.name())
                }
                (None, None) => continue,
            });
        }
        table.notes.push(format!("columns: {}", said.join(", ")));
        Ok(taken)
    }
}
