//! Why a file gives no curve.

use std::fmt;

/// Where something stands in a file; everything is counted from 1 but bytes, from 0.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// A whole line.
    Line(u64),
    /// A field of a line whose fields are separated.
    Field {
        /// The line.
        line: u64,
        /// The field.
        field: usize,
    },
    /// Columns of a line.
    Columns {
        /// The line.
        line: u64,
        /// The first column.
        from: usize,
        /// The last column.
        to: usize,
    },
    /// A byte of a binary file.
    Byte(usize),
    /// A row of a table or matrix.
    Row(usize),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Field { line, field } => write!(f, "line {line}, field {field}"),
            Self::Columns { line, from, to } => write!(f, "line {line}, columns {from}-{to}"),
            Self::Byte(byte) => write!(f, "byte {byte}"),
            Self::Row(row) => write!(f, "row {row}"),
        }
    }
}

/// Characters of a wrong value that a message repeats.
const SHOWN: usize = 40;

/// A text as a message repeats it: its beginning, if it is long.
pub(super) fn shown(text: &str) -> String {
    let text = text.trim();
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.into(),
    }
}
