//! Which columns of a table hold what: by their headers, by a row of units below, or as the user has named them.

use super::ColumnNames;
use super::curve::{Place, shown};
use super::frame::unit_of;
use super::label::{Label, Quantity};
use crate::error::{Error, error};
use crate::table::Row;
use crate::unit::UnitSystem;

/// What a column without a unit lacks: a scenario cannot give units beside the file.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Missing {
    OfColumn,
    OfUnit,
}

/// Columns that a message lists.
const LISTED: usize = 20;

/// A column that is taken, or could be.
#[derive(Clone, Debug, PartialEq)]
struct Column {
    /// Counted from 0.
    field: usize,
    name: String,
    label: Label,
    line: u64,
}

/// Which fields hold what.
#[derive(Debug)]
pub(super) struct Layout {
    columns: Vec<Column>,
    /// Columns that could have been taken instead.
    others: Vec<Column>,
}

/// How well a column fits, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum MatchQuality {
    Unit,
    NoUnit,
    UnknownUnit,
}

impl Column {
    /// By its unit, and whether its whole name is that of the quantity.
    fn fit(&self) -> (MatchQuality, bool) {
        let fit = match &self.label.unit {
            None => MatchQuality::NoUnit,
            Some(unit) if self.label.quantity.size_of(unit).is_some() => MatchQuality::Unit,
            Some(_) => MatchQuality::UnknownUnit,
        };
        (fit, Label::parse(&self.name).is_none())
    }

    /// Takes its unit from the row below the header.
    fn with_unit(mut self, units: Option<&Row>) -> Result<Self, Error> {
        let Some(row) = units else { return Ok(self) };
        let unit = unit_of(row.field(self.field));
        let size = |unit: &str| self.label.quantity.size_of(unit);
        match &self.label.unit {
            _ if unit.is_empty() => {}
            None => (self.label.unit, self.line) = (Some(unit.into()), row.line),
            Some(own) if size(own).is_some() && size(own) != size(unit) => {
                return Err(error!(
                    CurveFile,
                    "{place}: expected {expected}, found \"{found}\"",
                    expected = format!("the unit of the header, {}", shown(own)),
                    found = shown(unit),
                    place = Place::Field { line: row.line, field: self.field + 1 }
                ));
            }
            Some(_) => {}
        }
        Ok(self)
    }
}

impl Layout {
    /// By the header's names and the row of units below it, if there is one.
    pub(super) fn of(
        names: &[String],
        line: u64,
        units: Option<&Row>,
        lack: Missing,
        asked: &ColumnNames,
    ) -> Result<Self, Error> {
        let mut layout = Self { columns: Vec::new(), others: Vec::new() };
        let named = |quantity: Quantity| match asked.of(quantity) {
            Some(asked) => named(names, line, quantity, asked).map(Some),
            None => Ok(None),
        };
        let named = Quantity::ALL.map(named);
        for (quantity, named) in Quantity::ALL.into_iter().zip(named) {
            if let Some(column) = named? {
                layout.columns.push(column.with_unit(units)?);
                continue;
            }
            if quantity == Quantity::Time && asked.is_without_times() {
                continue;
            }
            let is_free = |field: usize| layout.columns.iter().all(|c| c.field != field);
            let of_quantity = names.iter().enumerate().filter_map(|(field, name)| {
                let label = Label::of_column(name).filter(|label| label.quantity == quantity)?;
                is_free(field).then(|| Column { field, name: name.clone(), label, line })
            });
            let found: Vec<Column> =
                of_quantity.map(|c| c.with_unit(units)).collect::<Result<_, _>>()?;
            layout.take(quantity, found, (names, line), lack)?;
        }
        Ok(layout)
    }

    /// Takes the best of the columns that can be this quantity.
    fn take(
        &mut self,
        quantity: Quantity,
        mut found: Vec<Column>,
        (names, line): (&[String], u64),
        lack: Missing,
    ) -> Result<(), Error> {
        let place = Place::Line(line);
        found.retain(|column| lack == Missing::OfUnit || column.label.unit.is_some());
        found.sort_by_key(Column::fit);
        let best = found.first().map(Column::fit);
        let alike = found.iter().filter(|c| Some(c.fit()) == best);
        let alike: Vec<String> = alike.map(|c| format!("\"{}\"", shown(&c.name))).collect();
        if alike.len() > 1 && lack == Missing::OfUnit {
            let (what, option) = (quantity.name(), quantity.option());
            let found = alike[..alike.len().min(LISTED)].join(", ");
            return Err(error!(
                CurveFile,
                "{place}: several columns could be the {what}: {found}; choose one with {option}, by its name or number"
            ));
        }
        let mut found = found.into_iter();
        match found.next() {
            Some(column) => self.columns.push(column),
            None if quantity == Quantity::Time => {}
            None => {
                let usual = usize::from(quantity == Quantity::Force);
                let found = shown(names.get(usual).map_or("", |name| name));
                let remedy = match lack {
                    Missing::OfUnit => {
                        format!("; or say which column it is with {}", quantity.option())
                    }
                    Missing::OfColumn => String::new(),
                };
                let (wanted, example) = (quantity.name(), quantity.example());
                return Err(error!(
                    CurveFile,
                    "{place}: expected a column {wanted} with its unit, such as {example}, found \"{found}\"{remedy}"
                ));
            }
        }
        self.others.extend(found);
        Ok(())
    }

    /// Deflection, then force, in the units that were given.
    pub(super) fn without_header(
        row: &Row,
        units: Option<UnitSystem>,
        asked: &ColumnNames,
    ) -> Result<Self, Error> {
        if units.is_none() {
            return Err(error!(
                CurveFile,
                "{place}: the {what} has no unit (\"{found}\"): write it as {example}, or give the file's units with --units (of crumple export: --input-units), such as mm-t-s or SI",
                example = "\"d_mm,force_kN\" above the values",
                found = shown(&format!("{} {}", row.field(0), row.field(1))),
                place = Place::Line(row.line),
                what = "header (the names of the columns)"
            ));
        }
        let names: Vec<String> =
            (1..=row.fields().count()).map(|k| format!("column {k}")).collect();
        let mut columns = Vec::new();
        for (usual, quantity) in Quantity::ALL.into_iter().enumerate() {
            let label = Label { quantity, unit: None };
            match (asked.of(quantity), names.get(usual)) {
                (Some(asked), _) => columns.push(named(&names, row.line, quantity, asked)?),
                (None, Some(name)) if quantity != Quantity::Time => {
                    columns.push(Column {
                        field: usual,
                        name: name.clone(),
                        label,
                        line: row.line,
                    });
                }
                _ => {}
            }
        }
        Ok(Self { columns, others: Vec::new() })
    }

    /// Which columns could have been taken instead, in one line.
    pub(super) fn note(&self) -> Option<String> {
        let shown = |column: &Column| {
            format!("\"{}\" ({})", shown(&column.name), column.label.quantity.name())
        };
        let others: Vec<String> = self.others.iter().map(shown).collect();
        (!others.is_empty()).then(|| format!("columns: not taken: {}", others.join(", ")))
    }

    /// What each field is and the SI value of its unit; says what was taken.
    pub(super) fn sizes(
        &self,
        units: Option<UnitSystem>,
        units_used: &mut bool,
        notes: &mut Vec<String>,
    ) -> Result<Vec<(Quantity, usize, f64)>, Error> {
        let mut taken = Vec::new();
        let mut said = Vec::new();
        for Column { field, name, label, line } in &self.columns {
            let place = Place::Line(*line);
            taken.push((label.quantity, *field, label.size(name, units, place)?));
            let name = shown(name);
            said.push(match (&label.unit, units) {
                (None, Some(units)) => {
                    *units_used = true;
                    format!("{} of \"{name}\" in units {units} as given", label.quantity.name())
                }
                (Some(unit), _) => {
                    format!("{} of \"{name}\" in {unit}", label.quantity.name())
                }
                (None, None) => continue,
            });
        }
        notes.push(format!("columns: {}", said.join(", ")));
        Ok(taken)
    }
}

/// The column of that name, or of that number counted from 1.
fn named(names: &[String], line: u64, quantity: Quantity, asked: &str) -> Result<Column, Error> {
    let asked = asked.trim();
    let by_name = names.iter().position(|name| name == asked);
    let by_case = || names.iter().position(|name| name.eq_ignore_ascii_case(asked));
    let by_number = || asked.parse::<usize>().ok()?.checked_sub(1).filter(|k| *k < names.len());
    match by_name.or_else(by_case).or_else(by_number) {
        Some(field) => {
            let name = names[field].clone();
            Ok(Column { field, label: Label::of_named(quantity, &name), name, line })
        }
        None => {
            let known: Vec<String> =
                names.iter().take(LISTED).map(|n| format!("\"{}\"", shown(n))).collect();
            Err(error!(
                CurveFile,
                "{place}: {option} \"{asked}\" is not a column: expected a number from 1, or one of {known}",
                asked = shown(asked),
                known = known.join(", "),
                option = quantity.option(),
                place = Place::Line(line)
            ))
        }
    }
}
