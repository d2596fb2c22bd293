//! Tables: a signal from a CSV file with a header line, whose first column is the time.

use std::io::Read;

use crate::error::{Error, ErrorCode, error};
use crate::guess;
use crate::table::{CsvTable, NoNumber};

/// Columns of a table that hold a signal: its times as they stand, and its values.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Columns {
    /// Name of the time's column.
    pub time_name: String,
    /// Name of the values' column.
    pub name: String,
    /// Times in the table's unit, strictly increasing.
    pub time: Vec<f64>,
    /// Values in the table's unit, one per time.
    pub values: Vec<f64>,
}

/// Reads the first column and the one called `wanted`; without a name, the only other one.
///
/// Separated by commas, semicolons or tabs, whichever stand in the header; lines that begin
/// with `#` are comments. Other columns are not looked at.
pub(crate) fn read(source: &mut dyn Read, wanted: Option<&str>) -> Result<Columns, Error> {
    let mut text = Vec::new();
    source.read_to_end(&mut text).map_err(|e| not_csv(e.into()))?;
    let mut table = CsvTable::open(&text, 0).map_err(not_csv)?;
    let (header, line) = (table.header().clone(), table.header_line());
    if header.iter().all(str::is_empty) {
        return Err(error!(
            Rating,
            "the table is empty: expected a header line, then a time and values in every line"
        ));
    }
    if header.iter().all(|name| name.parse::<f64>().is_ok()) {
        return Err(error!(
            Rating,
            "line {line}: expected a header with the names of the columns, found numbers: write for example \"time_s,a_m_per_s2\" above them"
        ));
    }
    if header.len() < 2 {
        return Err(error!(
            Rating,
            "line {line}: expected at least two columns separated by commas, semicolons or tabs, the first of them the time, found \"{found}\"",
            found = &header[0]
        ));
    }
    let column = column(&header, wanted)?;
    let (mut time, mut values) = (Vec::<f64>::new(), Vec::new());
    for row in table.rows() {
        let row = row.map_err(not_csv)?;
        let line = row.line;
        let number = |field: usize| {
            row.number(field).map_err(|NoNumber { line, column, found, is_number }| {
                let name = header[field].to_string();
                if is_number { error!(Rating, "line {line}, column {column} (\"{name}\"): expected a finite number, found \"{found}\": remove the lines without a value") } else { error!(Rating, "line {line}, column {column} (\"{name}\"): expected a number, found \"{found}\"") }
            })
        };
        let (at, value) = (number(0)?, number(column)?);
        if let Some(&before) = time.last().filter(|&&before| before >= at) {
            let name = header[0].to_string();
            return Err(error!(
                Rating,
                "line {line}, column 1 (\"{name}\"): time {found} does not come after {before}: times must rise strictly, so cut or sort the file first",
                found = at
            ));
        }
        time.push(at);
        values.push(value);
    }
    Ok(Columns { time_name: header[0].into(), name: header[column].into(), time, values })
}

fn not_csv(error: csv::Error) -> Error {
    Error::below(ErrorCode::Rating, error)
}

/// The column to read.
fn column(header: &csv::StringRecord, wanted: Option<&str>) -> Result<usize, Error> {
    let known = || {
        let names: Vec<String> = header.iter().skip(1).map(|name| format!("\"{name}\"")).collect();
        names.join(", ")
    };
    let Some(wanted) = wanted else {
        return match header.len() {
            2 => Ok(1),
            _ => Err(
                error!(Rating at "column", "there are several columns: name one of {known}", known = known()),
            ),
        };
    };
    let found: Vec<usize> = (1..header.len()).filter(|&i| &header[i] == wanted).collect();
    match found[..] {
        [column] => Ok(column),
        [] => Err({
            let known = known();
            error!(Rating at "column", "there is no column \"{wanted}\": name one of {known}{}", guess::hint(wanted, &known))
        }),
        _ => Err(error!(
            Rating,
            "{count} columns are called \"{name}\": rename all but one",
            count = found.len(),
            name = wanted
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str, wanted: Option<&str>) -> Result<Columns, String> {
        read(&mut text.as_bytes(), wanted).map_err(|e| e.to_string())
    }

    #[test]
    fn reads_the_named_column() {
        for text in ["# b\ntime,a,b\n0,1,x\n1,2,y\n", "\u{feff}time;a;b\r\n0;1;x\r\n1;2;\r\n"] {
            let columns = read_text(text, Some("a")).unwrap();
            assert_eq!((columns.time, columns.values), (vec![0.0, 1.0], vec![1.0, 2.0]));
            assert_eq!((&*columns.time_name, &*columns.name), ("time", "a"));
        }
        assert_eq!(read_text("t\tv\n0\t7\n", None).unwrap().values, [7.0]);
    }

    #[test]
    fn errors_say_where_and_what_to_do() {
        fn t(text: &str, wanted: Option<&str>, message: &str) {
            assert_eq!(read_text(text, wanted).unwrap_err(), message, "{text}");
        }
        t("t,a,b\n", Some("c"), "there is no column \"c\": name one of \"a\", \"b\"");
        t("t,a,b\n", None, "there are several columns: name one of \"a\", \"b\"");
        t("t,a,a\n", Some("a"), "2 columns are called \"a\": rename all but one");
        t("t,a\n0,1\n1,x\n", None, "line 3, column 2 (\"a\"): expected a number, found \"x\"");
        t("t,a\n0,1\n1\n", None, "line 3, column 2 (\"a\"): expected a number, found \"\"");
        t(
            "t,a\n0,NaN\n",
            None,
            "line 2, column 2 (\"a\"): expected a finite number, found \"NaN\": remove the lines without a value",
        );
        t(
            "#\nt,a\n0,1\n2,1\n1,1\n",
            None,
            "line 5, column 1 (\"t\"): time 1 does not come after 2: times must rise strictly, so cut or sort the file first",
        );
        t(
            "",
            None,
            "the table is empty: expected a header line, then a time and values in every line",
        );
        t(
            "0,1\n1,2\n",
            None,
            "line 1: expected a header with the names of the columns, found numbers: write for example \"time_s,a_m_per_s2\" above them",
        );
        t(
            "time a\n0 1\n",
            None,
            "line 1: expected at least two columns separated by commas, semicolons or tabs, the first of them the time, found \"time a\"",
        );
    }
}
