//! The meaning of the columns of a table: by their headers, by a row of units below, by the title, or as named by
//! the user.

use super::ReadOptions;
use super::columns::LISTED;
use super::curve::{Place, expected, shown};
use super::label::{Label, Quantity, name_and_unit, no_unit};
use super::table::{Purpose, Row, Table, names_all, unit_of};
use crate::error::{Error, error};
use crate::order;
use crate::unit::UnitSystem;

/// A chosen or candidate column.
#[derive(Clone, Debug)]
pub(super) struct Column {
    /// Counted from 0.
    pub field: usize,
    pub quantity: Quantity,
    /// SI value of its unit.
    pub size: f64,
}

/// A column with the name that it has in the file.
#[derive(Clone, Debug)]
struct Named {
    field: usize,
    name: String,
    label: Label,
    line: u64,
}

impl Named {
    /// How well it fits, best first: with a unit that is known, without one, with another; and whether its whole name
    /// is that of the quantity.
    fn fit(&self) -> (u8, bool) {
        let fit = match &self.label.unit {
            None => 1,
            Some(unit) if self.label.quantity.size_of(unit).is_some() => 0,
            Some(_) => 2,
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
                let place = Place::Field { line: row.line, field: self.field + 1 };
                let what = format_args!("the unit of the header, {}", shown(own));
                return Err(expected(place, what, unit));
            }
            Some(_) => {}
        }
        Ok(self)
    }
}

/// The columns of a table, in the given units if they state none; notes say which. Also
/// whether a column took its unit from those.
pub(super) fn layout(
    table: &Table<'_>,
    units: Option<UnitSystem>,
    asked: &ReadOptions,
    notes: &mut Vec<String>,
) -> Result<(Vec<Column>, bool), Error> {
    let is_bare = table.names.is_empty();
    if is_bare && units.is_none() {
        let (place, what) = (Place::Line(table.line()), "header (the names of the columns)");
        let example = "\"d_mm,force_kN\" above the values";
        return Err(no_unit(place, what, &table.first_row(), example));
    }
    let numbered = || (1..=table.columns).map(|k| (table.line(), format!("column {k}")));
    let names = if is_bare { numbered().collect() } else { table.names.clone() };
    let wanted = [Quantity::Deflection, Quantity::Force];
    // Axes without labels are the deflection, then the force.
    let usual = |field: usize, name: &str| {
        let quantity = *wanted.get(field)?;
        Some(if is_bare { Label { quantity, unit: None } } else { Label::of_named(quantity, name) })
    };
    let label = |field: usize, name: &str| match (is_bare, table.has_axes()) {
        (true, _) => usual(field, name),
        (_, true) => {
            Label::of_column(name).or_else(|| Label::of_axis(name)).or_else(|| usual(field, name))
        }
        _ => Label::of_column(name),
    };
    // A header may have any order, an axis not.
    let texts: Vec<String> = table.names.iter().map(|(_, name)| name.clone()).collect();
    let is_header = table.names.windows(2).all(|two| two[0].0 == two[1].0)
        && names_all(&texts, Purpose::Curve, &[]);
    for (field, (quantity, which)) in wanted.into_iter().zip(["first", "second"]).enumerate() {
        let is_asked = wanted.iter().any(|quantity| asked.column(*quantity).is_some());
        let Some((line, name)) =
            table.names.get(field).filter(|_| table.has_axes() && !is_header && !is_asked)
        else {
            continue;
        };
        if label(field, name).is_some_and(|label| label.quantity != quantity) {
            return Err(error!(
                CurveFile,
                "{place}: expected a {what} in the {which} column, found \"{found}\": choose the columns with --deflection-column and --force-column if the label is right",
                found = shown(name),
                place = Place::Line(*line),
                what = quantity.terms().name
            ));
        }
    }
    let (mut taken, mut others): (Vec<Named>, Vec<Named>) = (Vec::new(), Vec::new());
    let asked_for = Quantity::ALL.map(|quantity| match asked.column(quantity) {
        Some(asked) => named(&names, quantity, asked).map(Some),
        None => Ok(None),
    });
    for (quantity, asked_for) in Quantity::ALL.into_iter().zip(asked_for) {
        if let Some(column) = asked_for? {
            taken.push(column.with_unit(table.units.as_ref())?);
            continue;
        }
        if quantity == Quantity::Time && asked.is_without_times() {
            continue;
        }
        let is_free = |field: usize| taken.iter().all(|column| column.field != field);
        let free = names.iter().enumerate().filter(|(field, _)| is_free(*field));
        let of = |(field, (line, name)): (usize, &(u64, String)), label| {
            Named { field, name: name.clone(), label, line: *line }.with_unit(table.units.as_ref())
        };
        let mut found = Vec::new();
        for (field, named) in free.clone() {
            if let Some(label) = label(field, &named.1).filter(|label| label.quantity == quantity) {
                found.push(of((field, named), label)?);
            }
        }
        if found.is_empty() && says(table, quantity) {
            // Legends of curves, such as A1.
            let is_legend = |(_, (_, name)): &(usize, &(u64, String))| {
                Label::of_column(name).is_none() && !name.contains([' ', '_', '[', '(', '/'])
            };
            for column in free.clone().filter(is_legend) {
                found.push(of(column, Label { quantity, unit: None })?);
            }
        }
        let left: Vec<String> =
            free.clone().take(LISTED).map(|(_, (_, n))| format!("\"{}\"", shown(n))).collect();
        let line_left = free.map(|(_, (line, _))| *line).next().unwrap_or(table.line());
        order::sort_by_key(&mut found, Named::fit);
        let best = found.first().map(Named::fit);
        let alike = found.iter().filter(|column| Some(column.fit()) == best);
        let alike: Vec<String> = alike.map(|c| format!("\"{}\"", shown(&c.name))).collect();
        if alike.len() > 1 {
            return Err(error!(
                CurveFile,
                "{place}: several columns could be the {what}: {found}; choose one with {option}, by its name or number",
                found = alike[..alike.len().min(LISTED)].join(", "),
                option = quantity.terms().option,
                place = Place::Line(found[0].line),
                what = quantity.terms().name
            ));
        }
        // Columns with times of their own would be paired row by row.
        let is_other = |(field, (_, name)): &(usize, &(u64, String))| {
            is_free(*field)
                && found.iter().all(|column| column.field != *field)
                && is_of_time(name, found.is_empty())
        };
        let others_of_time = names.iter().enumerate().filter(is_other);
        let others_of_time: Vec<String> =
            others_of_time.map(|(_, (_, name))| format!("\"{}\"", shown(name))).collect();
        if quantity == Quantity::Time && !others_of_time.is_empty() {
            let all: Vec<String> = alike.into_iter().chain(others_of_time).take(LISTED).collect();
            return Err(error!(
                CurveFile,
                "{place}: expected one column of times, such as {example}, found {all}: choose it with {option}, or none for force over deflection without times; histories with different times need to be resampled",
                all = all.join(", "),
                example = quantity.terms().example,
                option = quantity.terms().option,
                place = Place::Line(line_left)
            ));
        }
        let mut found = found.into_iter();
        match found.next() {
            Some(column) => taken.push(column),
            None if quantity == Quantity::Time => {}
            None => {
                let left = if left.is_empty() { "no other".into() } else { left.join(", ") };
                return Err(error!(
                    CurveFile,
                    "{place}: expected a column {wanted} with its unit, such as {example}, found {left}; or choose the column with {option}",
                    example = quantity.terms().example,
                    option = quantity.terms().option,
                    place = Place::Line(line_left),
                    wanted = quantity.terms().name
                ));
            }
        }
        others.extend(found);
    }
    if !others.is_empty() {
        let shown =
            |c: &Named| format!("\"{}\" ({})", shown(&c.name), c.label.quantity.terms().name);
        let others: Vec<String> = others.iter().map(shown).collect();
        notes.push(format!("columns: not used: {}", others.join(", ")));
    }
    let (mut columns, mut said, mut are_used) = (Vec::new(), Vec::new(), false);
    for Named { field, name, label, line } in taken {
        let size = label.size(&name, units, Place::Line(line))?;
        columns.push(Column { field, quantity: label.quantity, size });
        let what = format!("{} of \"{}\" in", label.quantity.terms().name, shown(&name));
        said.push(match (&label.unit, units) {
            (Some(unit), _) => format!("{what} {unit}"),
            (None, Some(units)) => format!("{what} units {units} as given"),
            (None, None) => continue,
        });
        are_used |= label.unit.is_none();
    }
    notes.push(format!("columns: {}", said.join(", ")));
    Ok((columns, are_used))
}

/// Whether a column is in a unit of time and called after it; beside the times only with another quantity or a number behind, as
/// `Time Force [s]`, `t_F [ms]` and `Time2 [s]` are.
fn is_of_time(name: &str, alone: bool) -> bool {
    let (text, unit) = name_and_unit(name);
    if unit.is_none_or(|unit| Quantity::Time.size_of(unit).is_none()) {
        return false;
    }
    let text = text.to_lowercase();
    let mut words = text.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
    let first = words.next().unwrap_or_default();
    let plain = first.trim_end_matches(|c: char| c.is_ascii_digit());
    if alone {
        return plain == "t" || ["time", "zeit"].iter().any(|of| first.contains(of));
    }
    let is_numbered = plain.len() < first.len() && plain != "t";
    let is_other =
        |word| matches!(Quantity::named(word), Some(Quantity::Deflection | Quantity::Force));
    ["t", "time", "zeit"].contains(&plain) && (is_numbered || words.any(is_other))
}

/// Whether a title names this quantity, as `Force vs displacement` does.
fn says(table: &Table<'_>, quantity: Quantity) -> bool {
    let says = |(_, title): &(u64, String)| Quantity::all_within(title).contains(&quantity);
    quantity != Quantity::Time && table.titles.iter().any(says)
}

/// The column of that name, or of that number counted from 1.
fn named(names: &[(u64, String)], quantity: Quantity, asked: &str) -> Result<Named, Error> {
    let asked = asked.trim();
    let by_name = names.iter().position(|(_, name)| name == asked);
    let by_case = || names.iter().position(|(_, name)| name.eq_ignore_ascii_case(asked));
    let by_number = || asked.parse::<usize>().ok()?.checked_sub(1).filter(|k| *k < names.len());
    match by_name.or_else(by_case).or_else(by_number) {
        Some(field) => {
            let (line, name) = names[field].clone();
            Ok(Named { field, label: Label::of_named(quantity, &name), name, line })
        }
        None => {
            let known = names.iter().take(LISTED).map(|(_, name)| format!("\"{}\"", shown(name)));
            Err(error!(
                CurveFile,
                "{place}: {option} \"{asked}\" is not a column: expected a number from 1, or one of {known}",
                asked = shown(asked),
                known = known.collect::<Vec<_>>().join(", "),
                option = quantity.terms().option,
                place = Place::Line(names.first().map_or(1, |(line, _)| *line))
            ))
        }
    }
}
