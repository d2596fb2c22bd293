//! Curves and histories of text tables, whatever program or instrument wrote them.

use super::Input;
use super::columns::{check_points, choose};
use super::curve::{Metadata, Place, ReadCurve, expected, shown, stated_units, title};
use super::encoding::{decoded, lines};
use super::label::{Label, Quantity};
use super::layout::layout;
use super::table::{Fit, Purpose, Table, check_last, is_pair, unit_of};
use crate::error::{Error, error};
use crate::guess;

/// Lines before the points of a curve of two columns, when a file is recognised.
const HEADS: usize = 20;

/// Whether the extension says so, as that of no other tool's files does, or a header that names a
/// deflection and a force is above rows of numbers, or the first line is such a header or row. Two
/// plain columns with blanks between are those of another reader.
pub(super) fn recognise(input: &Input<'_>) -> bool {
    let has = |wanted| input.path.extension().is_some_and(|e| e.eq_ignore_ascii_case(wanted));
    if has("csv") || has("tsv") {
        return true;
    }
    let table = Table::of(input.beginning(), Purpose::Curve, &[]);
    let fits = match table.fit {
        Fit::Header => true,
        Fit::Named | Fit::Numbers => table.titles.is_empty(),
        Fit::Above => false,
    };
    fits && !table.is_plain_pair()
}

/// Whether two numbers are below at most so many lines.
pub(super) fn recognise_pairs(input: &Input<'_>) -> bool {
    let is_data = |line: &str| !line.trim().is_empty() && !line.starts_with(['$', '#']);
    let mut data = lines(input.beginning()).filter(|(_, line)| is_data(line)).take(HEADS);
    data.any(|(_, line)| is_pair(line))
}

/// The curve of a table with a header, or of one without.
pub(super) fn read(input: &Input<'_>) -> Result<ReadCurve, Error> {
    let mut table = Table::of(input.text, Purpose::Curve, &input.options.columns());
    if table.fit == Fit::Numbers {
        if let Some((line, _, comment)) = comments(input.text, table.begin()).last() {
            table.named_by(line, comment);
        }
        check_last(&table.titles)?;
    }
    let name = table.titles.first().map_or(String::new(), |(_, title)| title.clone());
    let notes = table.note().into_iter().collect();
    columns(input, &table, &name, notes)
}

/// The curve of two columns below its labels, or one of several.
pub(super) fn read_pairs(input: &Input<'_>) -> Result<ReadCurve, Error> {
    let tables = Table::pairs(input.text)?;
    if tables.is_empty() {
        return Err(error!(
            CurveFile,
            "expected a curve: lines of two numbers, found no such line"
        ));
    }
    let table = &tables[chosen(&tables, input.options.curve.as_deref())?];
    columns(input, table, &table.name, Vec::new())
}

/// Which curve was requested by its name or number, else the only one.
fn chosen(tables: &[Table<'_>], asked: Option<&str>) -> Result<usize, Error> {
    let by_name = |asked: &&str| tables.iter().any(|table| table.name.trim() == asked.trim());
    if asked.filter(by_name).is_some() {
        return choose(tables.iter().map(|t| (t.name.trim().into(), String::new())), asked);
    }
    choose((1..).zip(tables).map(|(k, t)| (k.to_string(), t.name.clone())), asked)
}

/// The comments before a line: their lines, marks and texts.
fn comments(text: &str, before: u64) -> impl Iterator<Item = (u64, &str, &str)> {
    lines(text).take_while(move |(line, _)| *line < before).filter_map(|(at, line)| {
        let line = line.trim();
        let comment = line.strip_prefix(['$', '#'])?.trim_start_matches(['$', '#']);
        Some((at, &line[..1], comment.trim()))
    })
}

/// The columns of a table that are a curve.
fn columns(
    input: &Input<'_>,
    table: &Table<'_>,
    name: &str,
    mut notes: Vec<String>,
) -> Result<ReadCurve, Error> {
    let (mut facts, mut stated) = (Metadata::default(), None);
    for (line, mark, comment) in comments(input.text, table.begin()) {
        facts.take(mark, comment, Place::Line(line))?;
        stated = stated.or(stated_units(comment));
    }
    let units = input.options.units.or(stated);
    let (taken, units_used) = layout(table, units, input.options, &mut notes)?;
    let mut lines = Vec::new();
    let mut values: [Vec<f64>; 3] = Default::default();
    let used: Vec<usize> = taken.iter().map(|column| column.field).collect();
    table.each_row(&used, |row| {
        for column in &taken {
            let place = Place::Field { line: row.line, field: column.field + 1 };
            let value = row.number(column.field).map_err(|found| {
                let has_none = found.is_empty() || found.parse::<f64>().is_ok();
                let remedy = if has_none { ": remove the lines without a value" } else { "" };
                expected(place, "a number", found).followed_by(remedy)
            })?;
            values[column.quantity as usize].push(value * column.size);
        }
        lines.push(row.line);
        check_points(lines.len())
    })?;
    let [deflection_m, force_n, time_s] = values;
    Ok(ReadCurve {
        deflection_m,
        force_n,
        time_s: taken.iter().any(|c| c.quantity == Quantity::Time).then_some(time_s),
        facts,
        title: title(name, &mut notes),
        notes,
        units: units.filter(|_| units_used),
        lines,
        ..ReadCurve::default()
    })
}

/// Values over time, as a table or a curve's file has them.
#[derive(Clone, Debug)]
pub(crate) struct History {
    /// Name of the time's column, and its line.
    pub time_name: (u64, String),
    pub name: String,
    /// First title above them.
    pub title: String,
    /// Times in the file's unit, strictly increasing.
    pub time: Vec<f64>,
    /// Values in the file's unit, one per time.
    pub values: Vec<f64>,
}

/// Reads the values called `wanted`; without a name, the only ones. Their times are in the last column of times before
/// them, else in the first column.
pub(crate) fn history(bytes: &[u8], wanted: Option<&str>) -> Result<History, Error> {
    let text = decoded(bytes).text;
    let asked: Vec<&str> = wanted.into_iter().collect();
    let table = Table::of(&text, Purpose::History, &asked);
    let mut curves = Vec::new();
    if table.fit == Fit::Numbers {
        curves = Table::pairs(&text)?;
        curves.retain(|curve| !curve.names.is_empty());
        if curves.is_empty() {
            return Err(error!(
                Rating,
                "line {line}: expected a header with the names of the columns, found numbers: write for example \"time_s,a_m_per_s2\" above them",
                line = table.line()
            ));
        }
    }
    let names: Vec<String> = match &curves[..] {
        [] => table.names.iter().map(|(_, name)| name.clone()).collect(),
        [curve] => vec![curve.names[0].1.clone(), curve.name.clone()],
        _ => std::iter::once(String::new()).chain(curves.iter().map(|c| c.name.clone())).collect(),
    };
    if names.iter().all(String::is_empty) {
        return Err(error!(
            Rating,
            "the table is empty: expected a header line, then a time and values in every line"
        ));
    }
    if names.len() < 2 {
        return Err(error!(
            Rating,
            "line {line}: expected at least two columns separated by commas, semicolons, tabs or blanks, the first of them the time, found \"{found}\"",
            found = shown(&names[0]),
            line = table.line()
        ));
    }
    let is_time =
        |name: &String| Label::of_column(name).is_some_and(|l| l.quantity == Quantity::Time);
    let all = if curves.is_empty() { names.len() } else { 1 };
    let times: Vec<usize> = (0..all).filter(|&k| is_time(&names[k])).collect();
    let first = times.first().copied().unwrap_or(0);
    let values = |k: &usize| *k != first && !times.contains(k);
    let column = column(&names, (0..names.len()).filter(values), wanted)?;
    let time = times.iter().copied().rfind(|&k| k < column).unwrap_or(first);
    let (table, time, field) = match column.checked_sub(1).and_then(|k| curves.get(k)) {
        Some(curve) => (curve, 0, 1),
        None => (&table, time, column),
    };
    // A unit from the row below the header joins the name, as in headers that hold units.
    let with_unit = |name: &str, field: usize| {
        let unit = table.units.as_ref().map(|row| unit_of(row.field(field))).unwrap_or_default();
        match unit.is_empty() || name.ends_with([']', ')']) {
            true => name.to_string(),
            false => format!("{name} [{unit}]"),
        }
    };
    let (line, time_name) = &table.names[time];
    let mut history = History {
        time_name: (*line, with_unit(time_name, time)),
        name: with_unit(&names[column], field),
        title: table.titles.first().map_or(String::new(), |(_, title)| title.clone()),
        time: Vec::new(),
        values: Vec::new(),
    };
    let name_of = |field: usize| &table.names[field].1;
    table.each_row(&[time, field], |row| {
        let line = row.line;
        // Beside a longer curve with times of its own.
        if times.len() > 1 && row.field(time).is_empty() && row.field(field).is_empty() {
            return Ok(());
        }
        let number = |field: usize| {
            row.number(field).map_err(|found| {
                let (column, name) = (field + 1, name_of(field));
                let is_number = found.parse::<f64>().is_ok();
                let kind = if is_number { "a finite number" } else { "a number" };
                let has_none = is_number || !found.contains(|c: char| c.is_ascii_digit());
                let remedy = if has_none { ": remove the lines without a value" } else { "" };
                error!(
                    Rating,
                    "line {line}, column {column} (\"{name}\"): expected {kind}, found \"{found}\"{remedy}",
                    found = shown(found)
                )
            })
        };
        let (at, value) = (number(time)?, number(field)?);
        if let Some(&before) = history.time.last().filter(|&&before| before >= at) {
            return Err(error!(
                Rating,
                "line {line}, column {column} (\"{name}\"): time {at} does not come after {before}: times must increase strictly, so cut or sort the file first",
                column = time + 1,
                name = name_of(time)
            ));
        }
        history.time.push(at);
        history.values.push(value);
        Ok(())
    })?;
    Ok(history)
}

/// The column that was requested, of those that hold values.
fn column(
    names: &[String],
    mut values: impl Iterator<Item = usize> + Clone,
    wanted: Option<&str>,
) -> Result<usize, Error> {
    let known = values.clone().map(|k| format!("\"{}\"", names[k])).collect::<Vec<_>>().join(", ");
    let is_wanted = |k: &usize| wanted.is_none_or(|wanted| names[*k] == wanted);
    let found: Vec<usize> = values.by_ref().filter(is_wanted).collect();
    match (&found[..], wanted) {
        ([column], _) => Ok(*column),
        (_, None) => {
            Err(error!(Rating at "column", "there are several columns: name one of {known}"))
        }
        ([], Some(wanted)) => Err(
            error!(Rating at "column", "there is no column \"{wanted}\": name one of {known}{}", guess::hint(wanted, &known)),
        ),
        (_, Some(name)) => Err(error!(
            Rating,
            "{count} columns are called \"{name}\": rename all but one",
            count = found.len()
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_the_named_column() {
        fn t(text: &str, wanted: Option<&str>, expected: (&[f64], &[f64])) {
            let read = history(text.as_bytes(), wanted).unwrap();
            assert_eq!((&read.time[..], &read.values[..]), expected, "{text}");
        }
        let expected: (&[f64], &[f64]) = (&[0.0, 1.0], &[1.0, 2.0]);
        t("# b\ntime,a,b\n0,1,x\n1,2,y\n", Some("a"), expected);
        t("\u{feff}time;a;b\r\n0;1;x\r\n1;2;\r\n", Some("a"), expected);
        t("t\tv\n0\t1\n1\t2\n", None, expected);
        t("time a\n0 1\n1 2\n", None, expected);
        // An index in front; columns with times of their own; the first column of times, wherever it stands.
        t(",t_s,a\n7,0,1\n8,1,2\n", Some("a"), expected);
        t("Title,x\nTime,A,Time,B,\n5,7,0,1,\n6,8,1,2,\n7,9,,,\n", Some("B"), expected);
        t("a,time\n1,0\n2,1\n", None, expected);
        let axes = "T\nTime (s)\nForce\nnode 1\n0, 1\n1, 2\nCONTINUE\n";
        t(axes, None, expected);
        t(&(axes.to_string() + &axes.replace("node 1", "b")), Some("b"), expected);
    }
}
