//! Why a file gives no curve.

use crate::guess;
use std::fmt;
use std::io;
use std::path::PathBuf;

use super::json::CurveFileError;
use crate::curve::EnvelopeError;

/// Why a file gives no curve.
#[derive(Debug, thiserror::Error)]
pub enum ReadCurveError {
    /// It cannot be read.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// There is no reader of that name.
    #[error(
        "there is no format \"{name}\" of curves that can be read: use one of {known}{}",
        guess::hint(name, known)
    )]
    NoSuchFormat {
        /// What was asked for.
        name: String,
        /// The names there are.
        known: String,
    },
    /// Neither content nor extension tell what it is.
    #[error(
        "{path}: neither content nor extension tell the format of this file: expected one of {known}; name it with --from"
    )]
    Unrecognised {
        /// The file.
        path: PathBuf,
        /// The names there are.
        known: String,
    },
    /// Columns are asked for, and its format has none.
    #[error(
        "{path}: this is read as {format}, which has no columns to choose: remove {option}, or read it as a table with --from csv"
    )]
    NoColumns {
        /// The file.
        path: PathBuf,
        /// As which it is read.
        format: &'static str,
        /// What was asked for.
        option: &'static str,
    },
    /// It is no predicted curve.
    #[error(transparent)]
    Predicted(#[from] CurveFileError),
    /// Its content is no curve.
    #[error("{path}: {source}")]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong, with its place.
        source: Box<ContentError>,
    },
}

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

/// What of a file's content makes no curve.
#[derive(Debug, thiserror::Error)]
pub enum ContentError {
    /// It is no table.
    #[error("{0}")]
    Csv(#[from] csv::Error),
    /// A column is not there, or has no unit (read for a scenario).
    #[error(
        "{place}: expected a column {wanted} with its unit, such as {example}, found \"{found}\"{remedy}"
    )]
    Header {
        /// Of the header.
        place: Place,
        /// Which column.
        wanted: &'static str,
        /// What it could be called.
        example: &'static str,
        /// What stands there.
        found: String,
        /// How to say which column it is, where that can be said.
        remedy: String,
    },
    /// Several columns could be it.
    #[error(
        "{place}: several columns could be the {what}: {found}; choose one with {option}, by its name or number"
    )]
    WhichColumn {
        /// Of the header.
        place: Place,
        /// Deflection, force or time.
        what: &'static str,
        /// The columns.
        found: String,
        /// The option that chooses.
        option: &'static str,
    },
    /// The column that was asked for is not there.
    #[error(
        "{place}: {option} \"{asked}\" is no column: expected a number from 1, or one of {known}"
    )]
    NoSuchColumn {
        /// Of the header.
        place: Place,
        /// The option.
        option: &'static str,
        /// What was asked for.
        asked: String,
        /// The columns there are.
        known: String,
    },
    /// The values have no unit.
    #[error(
        "{place}: the {what} has no unit (\"{found}\"): write it as {example}, or give the file's units with --units (of crumple export: --input-units), such as mm-t-s or SI"
    )]
    NoUnit {
        /// Of the header, or of the first values.
        place: Place,
        /// Deflection or force.
        what: &'static str,
        /// What stands there.
        found: String,
        /// What it could be called.
        example: &'static str,
    },
    /// A file of a format without units.
    #[error(
        "the file does not say its units: give them with --units (of crumple export: --input-units), such as mm-t-s or SI{remedy}"
    )]
    NoUnits {
        /// How the file can say them.
        remedy: &'static str,
    },
    /// A unit that is not known.
    #[error(
        "{place}: the unit \"{unit}\" of the {what} is not known: use one of {known}{}",
        guess::hint(unit, known)
    )]
    UnknownUnit {
        /// Of the unit.
        place: Place,
        /// Deflection, force or time.
        what: &'static str,
        /// The unit.
        unit: String,
        /// The units there are.
        known: String,
    },
    /// A line `# key: value` that means something has no such value.
    #[error("{place}: \"{key}: {found}\": expected {expected}")]
    Fact {
        /// Of the line.
        place: Place,
        /// With the comment's mark.
        key: String,
        /// What stands there.
        found: String,
        /// What could.
        expected: &'static str,
    },
    /// No number where one should be, or none that is finite.
    #[error("{place}: expected a number, found \"{found}\"")]
    Number {
        /// Where.
        place: Place,
        /// What stands there.
        found: String,
    },
    /// Something else than what should be there.
    #[error("{place}: expected {expected}, found \"{found}\"")]
    Expected {
        /// Where.
        place: Place,
        /// What, and what to do.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// A size that the file declares is not that of its content.
    #[error("{place}: {what} declares {declared}, but the file has {found}: {remedy}")]
    Declared {
        /// Of the declaration.
        place: Place,
        /// What declares it.
        what: String,
        /// What it declares.
        declared: String,
        /// What there is.
        found: String,
        /// What to do.
        remedy: &'static str,
    },
    /// It holds no curve of its format.
    #[error("expected {expected}, found {found}")]
    NoCurve {
        /// What would be one.
        expected: &'static str,
        /// What there is.
        found: String,
    },
    /// It holds several.
    #[error("the file holds several curves: choose one with --curve: {known}")]
    WhichCurve {
        /// The names there are.
        known: String,
    },
    /// It does not hold the one that was asked for.
    #[error("the file has no curve \"{asked}\": it has {known}{}", guess::hint(asked, known))]
    NoSuchCurve {
        /// What was asked for.
        asked: String,
        /// The names there are.
        known: String,
    },
    /// A folder of several ISO-MME tests.
    #[error(
        "the folder holds {tests} ISO-MME tests: give those that are meant, each by itself: {known}"
    )]
    SeveralTests {
        /// How many there are.
        tests: usize,
        /// Their paths.
        known: String,
    },
    /// The channel of an ISO-MME channel's times is not there.
    #[error(
        "{place}: the times are those of another channel: expected \"Reference channel :implicit\" with an interval, or \"Reference channel name :\" with the code of a channel of time (…TI…) beside it; there are {known}"
    )]
    NoTimes {
        /// Of the reference channel.
        place: Place,
        /// The channels of time there are.
        known: String,
    },
    /// It has too few points.
    #[error("the curve has {}{of}: expected at least {least}", crate::plural::counted(*points, "point"))]
    TooFew {
        /// How many there are.
        points: usize,
        /// What has been removed.
        of: &'static str,
        /// How many there must be.
        least: usize,
    },
    /// It has too many points.
    #[error("the curve has more than {most} points: thin it")]
    TooMany {
        /// How many there may be.
        most: usize,
    },
    /// It holds too many curves.
    #[error("the file has more than {most} curves: take out the one that is meant")]
    TooManyCurves {
        /// How many there may be.
        most: usize,
    },
    /// A value that is not finite.
    #[error("{place}: the {what} is {value}: expected a finite number")]
    NotFinite {
        /// Where.
        place: Place,
        /// Deflection, force or time.
        what: &'static str,
        /// NaN or infinite.
        value: f64,
    },
    /// All values of a column are zero.
    #[error("the {what} is 0 in every point: expected a curve")]
    Nothing {
        /// Deflection or force.
        what: &'static str,
    },
    /// Forces on both sides of zero deflection.
    #[error(
        "{place}: the force is {force_n} N on the other side of zero deflection ({deflection_m} m): expected one side, compression; remove the points of tension"
    )]
    BothSides {
        /// Of the first such point.
        place: Place,
        /// Its deflection.
        deflection_m: f64,
        /// Its force.
        force_n: f64,
    },
    /// The force pulls.
    #[error(
        "{place}: the force is {force_n} N against the others' sign: an interface only pushes, so write pull as 0"
    )]
    PullsAt {
        /// Of the first such point.
        place: Place,
        /// Positive in compression.
        force_n: f64,
    },
    /// The force pulls (read for a scenario).
    #[error(
        "the force of point {point} is below 0: an interface only pushes, so write compression positive and pull as 0"
    )]
    Pulling {
        /// The first such point.
        point: usize,
    },
    /// The deflection goes neither up, nor up and then down.
    #[error(
        "{place}: the deflection must {way}, found {deflection_m} m after {before_m} m: give the loading branch and at most one unloading branch behind it, or a column of times"
    )]
    Order {
        /// Of the first point that does not.
        place: Place,
        /// What it must do there.
        way: &'static str,
        /// Its deflection.
        deflection_m: f64,
        /// That of the point before.
        before_m: f64,
    },
    /// Of a file that was read beside the one that was given.
    #[error("{file}: {source}")]
    Beside {
        /// Its name.
        file: String,
        /// What is wrong with it.
        source: Box<ContentError>,
    },
    /// A file beside the one that was given cannot be read.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// The points are no loading branch (read for a scenario).
    #[error("{0}")]
    Envelope(#[from] EnvelopeError),
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
