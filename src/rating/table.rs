//! Tables: a signal from a CSV file with a header line, whose first column is the time.

use crate::guess;
use std::io::Read;

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

/// Why a table holds no signal. Lines and columns count from 1.
#[derive(Debug, thiserror::Error)]
pub(crate) enum TableError {
    /// The text is no table.
    #[error("{0}")]
    Csv(#[from] csv::Error),
    /// The text is empty.
    #[error("the table is empty: expected a header line, then a time and values in every line")]
    Empty,
    /// The first line holds numbers.
    #[error(
        "line {line}: expected a header with the names of the columns, found numbers: write for example \"time_s,a_m_per_s2\" above them"
    )]
    NoHeader {
        /// Line in the file.
        line: u64,
    },
    /// There is only one column.
    #[error(
        "line {line}: expected at least two columns separated by commas, semicolons or tabs, the first of them the time, found \"{found}\""
    )]
    OneColumn {
        /// Line in the file.
        line: u64,
        /// Its text.
        found: String,
    },
    /// No column has the wanted name.
    #[error("there is no column \"{wanted}\": name one of {known}{}", guess::hint(wanted, known))]
    NoColumn {
        /// The wanted name.
        wanted: String,
        /// The columns there are, as a list.
        known: String,
    },
    /// Several columns have the wanted name.
    #[error("{count} columns are called \"{name}\": rename all but one")]
    SameNames {
        /// The name.
        name: String,
        /// How many have it.
        count: usize,
    },
    /// There are several columns, and none is named.
    #[error("there are several columns: name one of {known}")]
    SeveralColumns {
        /// The columns there are, as a list.
        known: String,
    },
    /// A field is no number.
    #[error("line {line}, column {column} (\"{name}\"): expected a number, found \"{found}\"")]
    NotANumber {
        /// Line in the file.
        line: u64,
        /// Column in that line.
        column: usize,
        /// Name of the column.
        name: String,
        /// The field's text.
        found: String,
    },
    /// A field is infinite, no number or empty.
    #[error(
        "line {line}, column {column} (\"{name}\"): expected a finite number, found \"{found}\": remove the lines without a value"
    )]
    NotFinite {
        /// Line in the file.
        line: u64,
        /// Column in that line.
        column: usize,
        /// Name of the column.
        name: String,
        /// The field's text.
        found: String,
    },
    /// A time is not later than the one before it.
    #[error(
        "line {line}, column 1 (\"{name}\"): time {found} does not come after {before}: times must rise strictly, so cut or sort the file first"
    )]
    TimeGoesBack {
        /// Line in the file.
        line: u64,
        /// Name of the time's column.
        name: String,
        /// The time, in the table's unit.
        found: f64,
        /// The time before it, in the table's unit.
        before: f64,
    },
}

/// Reads the first column and the one called `wanted`; without a name, the only other one.
///
/// Separated by commas, semicolons or tabs, whichever stand in the header; lines that begin
/// with `#` are comments. Other columns are not looked at.
///
/// # Errors
/// [`TableError`] with line and column.
pub(crate) fn read(source: &mut dyn Read, wanted: Option<&str>) -> Result<Columns, TableError> {
    let mut text = Vec::new();
    source.read_to_end(&mut text).map_err(csv::Error::from)?;
    let mut table = CsvTable::open(&text, 0)?;
    let (header, line) = (table.header().clone(), table.header_line());
    if header.iter().all(str::is_empty) {
        return Err(TableError::Empty);
    }
    if header.iter().all(|name| name.parse::<f64>().is_ok()) {
        return Err(TableError::NoHeader { line });
    }
    if header.len() < 2 {
        return Err(TableError::OneColumn { line, found: header[0].into() });
    }
    let column = column(&header, wanted)?;
    let (mut time, mut values) = (Vec::<f64>::new(), Vec::new());
    for row in table.rows() {
        let row = row?;
        let line = row.line;
        let number = |field: usize| {
            row.number(field).map_err(|NoNumber { line, column, found, is_number }| {
                let name = header[field].to_string();
                match is_number {
                    true => TableError::NotFinite { line, column, name, found },
                    false => TableError::NotANumber { line, column, name, found },
                }
            })
        };
        let (at, value) = (number(0)?, number(column)?);
        if let Some(&before) = time.last().filter(|&&before| before >= at) {
            let name = header[0].to_string();
            return Err(TableError::TimeGoesBack { line, name, found: at, before });
        }
        time.push(at);
        values.push(value);
    }
    Ok(Columns { time_name: header[0].into(), name: header[column].into(), time, values })
}

/// The column to read.
fn column(header: &csv::StringRecord, wanted: Option<&str>) -> Result<usize, TableError> {
    let known = || {
        let names: Vec<String> = header.iter().skip(1).map(|name| format!("\"{name}\"")).collect();
        names.join(", ")
    };
    let Some(wanted) = wanted else {
        return match header.len() {
            2 => Ok(1),
            _ => Err(TableError::SeveralColumns { known: known() }),
        };
    };
    let found: Vec<usize> = (1..header.len()).filter(|&i| &header[i] == wanted).collect();
    match found[..] {
        [column] => Ok(column),
        [] => Err(TableError::NoColumn { wanted: wanted.into(), known: known() }),
        _ => Err(TableError::SameNames { name: wanted.into(), count: found.len() }),
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
