//! Curves of other tools: one file per format, each giving a [`ReadCurve`] in SI that states how
//! it was read.
//!
//! **Units** are those of the column's header (`d_mm`, `Force [kN]`), of a comment
//! (`units: mm-t-s`), or those that are given ([`ReadOptions::units`]); without any, a file is
//! refused. **Comments** `key: value` that our own exports write give force kind, speed, speed
//! kind, mass and unloading stiffness. **Signs**: compression becomes positive. **Points** that
//! repeat the previous one, and guard points (below zero deflection with no force; the last force
//! repeated equally far beyond the end) are removed. Each of these leaves a note.

mod columns;
pub(crate) mod curve;
mod deck;
mod encoding;
mod iso_mme;
pub(crate) mod json;
mod label;
mod layout;
mod lsdyna;
mod mat;
mod mdf;
mod modelica;
mod radioss;
mod table;
mod tables;

use crate::error::{Error, error};
use crate::file;
use crate::guess;
use std::path::Path;

use super::{MAX_CURVE_BYTES, MIN_POINTS};
use crate::curve::{ForceCurve, ForceKind};
use crate::surrogate::PredictedCurve;
use crate::unit::UnitSystem;

pub use curve::{Metadata, ReadCurve};
use label::Quantity;
pub(crate) use mdf::is_run;

/// One format of curves.
#[derive(Debug)]
pub(crate) struct Reader {
    pub name: &'static str,
    /// Without the dot; the first is the usual one.
    pub extensions: &'static [&'static str],
    pub description: &'static str,
    /// Whether a file's content is of this format.
    recognise: fn(&Input<'_>) -> bool,
    read: fn(&Input<'_>) -> Result<ReadCurve, Error>,
}

/// Every format we read, in the order in which content is tried. To add one: write its module, add
/// its line here.
pub(crate) const READERS: &[Reader] = &[
    Reader {
        name: MAT,
        extensions: &["mat"],
        description: "MAT file of version 4: fd_load, or the only matrix of two columns",
        recognise: mat::recognise,
        read: mat::read,
    },
    Reader {
        name: MDF,
        extensions: &["mf4", "mdf"],
        description: "MDF 4 (ASAM) with a deflection and a force over time in one group",
        recognise: mdf::recognise,
        read: mdf::read,
    },
    Reader {
        name: JSON,
        extensions: &["json"],
        description: "predicted curve (of crumple predict)",
        recognise: json::recognise,
        read: json::read,
    },
    Reader {
        name: "lsdyna",
        extensions: &["k", "key", "dyn"],
        description: "LS-DYNA *DEFINE_CURVE and *DEFINE_CURVE_TITLE",
        recognise: lsdyna::recognise,
        read: lsdyna::read,
    },
    Reader {
        name: "radioss",
        extensions: &["rad"],
        description: "Radioss /FUNCT of a starter or include file",
        recognise: radioss::recognise,
        read: radioss::read,
    },
    Reader {
        name: "mo",
        extensions: &["mo"],
        description: "Modelica package that crumple export wrote",
        recognise: modelica::recognise_package,
        read: modelica::read_package,
    },
    Reader {
        name: "modelica",
        extensions: &["txt"],
        description: "Modelica CombiTable text (#1, double name(n,2))",
        recognise: modelica::recognise,
        read: modelica::read,
    },
    Reader {
        name: "iso-mme",
        extensions: &["mme", "001", "002"],
        description: "ISO-MME: a test's folder or .mme file, or one of its channel files",
        recognise: iso_mme::recognise,
        read: iso_mme::read,
    },
    Reader {
        name: TABLES,
        extensions: &["csv", "tsv"],
        description: "columns below a header and titles, with commas, semicolons, tabs or blanks between",
        recognise: tables::recognise,
        read: tables::read,
    },
    Reader {
        name: CURVES,
        extensions: &["cur", "crv", "dat", "xy"],
        description: "two columns below titles and labels, as in T/HIS .cur and LS-PrePost .crv files",
        recognise: tables::recognise_pairs,
        read: tables::read_pairs,
    },
];

/// The values over time called `wanted` of a table or MDF file; without a name, the only ones.
pub(crate) fn history(bytes: &[u8], wanted: Option<&str>) -> Result<tables::History, Error> {
    match mdf::history(bytes, wanted)? {
        Some((table, called)) => tables::history(table.as_bytes(), called.as_deref().or(wanted)),
        None => tables::history(bytes, wanted),
    }
}

/// The table of a multi-body run: of an MDF file, as its CSV file would be.
pub(crate) fn run_table(bytes: Vec<u8>) -> Result<Vec<u8>, Error> {
    if mdf::is_run(&bytes) { Ok(mdf::run(&bytes)?.into_bytes()) } else { Ok(bytes) }
}

/// What the user gives besides the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadOptions {
    /// Name of a reader, to override recognition by content.
    pub format: Option<String>,
    /// Units of values that state none.
    pub units: Option<UnitSystem>,
    /// Number or name of the curve in a file that holds several.
    pub curve: Option<String>,
    /// The force, where the file has both.
    pub force: Option<ForceKind>,
    /// The deflection's column of a table whose header does not name it: its header, or its number counted from 1.
    pub deflection_column: Option<String>,
    /// The same of the force.
    pub force_column: Option<String>,
    /// The same of the time; `none` for force over deflection without times, whatever the file has.
    pub time_column: Option<String>,
}

/// The readers of binary files.
const MAT: &str = "mat";
const MDF: &str = "mdf";
/// The reader of predicted curves.
const JSON: &str = "json";
/// The readers that have columns to choose.
const TABLES: &str = "csv";
const CURVES: &str = "two-columns";
/// The table's times are not read.
const NO_TIMES: &str = "none";

impl ReadOptions {
    fn column(&self, quantity: Quantity) -> Option<&str> {
        let asked = match quantity {
            Quantity::Deflection => &self.deflection_column,
            Quantity::Force => &self.force_column,
            Quantity::Time => &self.time_column,
        };
        asked.as_deref().filter(|asked| quantity != Quantity::Time || *asked != NO_TIMES)
    }

    fn is_without_times(&self) -> bool {
        self.time_column.as_deref() == Some(NO_TIMES)
    }

    /// The first option that is given.
    fn column_option(&self) -> Option<&'static str> {
        let is_given = |q: &Quantity| self.column(*q).is_some();
        Quantity::ALL.into_iter().find(is_given).map(|q| q.terms().option)
    }

    fn columns(&self) -> Vec<&str> {
        Quantity::ALL.into_iter().filter_map(|quantity| self.column(quantity)).collect()
    }
}

/// A file, as readers get it.
pub(super) struct Input<'a> {
    path: &'a Path,
    /// Empty for a folder.
    bytes: &'a [u8],
    /// The same as a text.
    text: &'a str,
    options: &'a ReadOptions,
}

/// With these every ZIP archive begins, workbooks too.
const ZIP: &[u8] = b"PK\x03\x04";
/// Bytes by which a format is recognised.
const BEGINNING: usize = 64 << 10;

impl Input<'_> {
    /// The part of a file used to recognise its format.
    fn beginning(&self) -> &str {
        let fits = |end: &usize| self.text.is_char_boundary(*end);
        let end = (0..=self.text.len().min(BEGINNING)).rev().find(fits);
        &self.text[..end.unwrap_or_default()]
    }
}

/// Whether `path` is a folder of ISO-MME tests; other folders are not curves.
pub(crate) fn is_folder_of_tests(path: &Path) -> bool {
    path.is_dir() && !iso_mme::tests(path).is_empty()
}

/// The names of the formats that are read.
pub fn readers() -> impl Iterator<Item = &'static str> {
    READERS.iter().map(|reader| reader.name)
}

/// Reads the curve at `path`, a file, or for ISO-MME a test's folder; with the name of its format.
///
/// # Errors
/// It names the file, the place in it, what was expected there and what to do.
pub fn read(path: &Path, options: &ReadOptions) -> Result<(ReadCurve, &'static str), Error> {
    let (found, format) = parse(path, options)?;
    Ok((found.sorted().map_err(curve::content(path))?, format))
}

/// A curve as it is in its file, and the name of the format.
fn parse(path: &Path, options: &ReadOptions) -> Result<(ReadCurve, &'static str), Error> {
    let tests = if path.is_dir() { iso_mme::tests(path) } else { Vec::new() };
    let (bytes, own) = if !tests.is_empty() {
        iso_mme::check_one(path, &tests).map_err(curve::content(path))?;
        (Vec::new(), None)
    } else {
        let bytes = file::read(path, MAX_CURVE_BYTES);
        let bytes = bytes.map_err(|e| curve::content(path)(e.into()))?;
        let own = curve::source_file(path, &bytes);
        (bytes, Some(own))
    };
    if bytes.starts_with(ZIP) {
        return Err(curve::content(path)(error!(
            CurveFile,
            "expected a curve, found a ZIP archive: unpack it and give the files in it (of ISO-MME the test's folder), or save the sheet of a workbook as CSV"
        )));
    }
    let text = encoding::decoded(&bytes);
    let input = Input { path, bytes: &bytes, text: &text.text, options };
    if bytes.is_empty() && own.is_some() {
        return Err(curve::content(path)(error!(
            CurveFile,
            "expected a curve, found an empty file"
        )));
    }
    let reader = reader(&input)?;
    if let (Some(option), true) =
        (options.column_option(), ![TABLES, CURVES, MDF].contains(&reader.name))
    {
        let format = reader.name;
        return Err(error!(
            CurveFile,
            "{path}: this is read as {format}, which has no columns to choose: remove {option}, or read it as a table with --from csv",
            path = path.display()
        ));
    }
    let mut found = (reader.read)(&input).map_err(curve::content(path))?;
    if options.is_without_times() {
        found.time_s = None;
    }
    found.notes.extend(text.note.filter(|_| ![MAT, MDF].contains(&reader.name)).map(String::from));
    found.files.splice(0..0, own);
    Ok((found, reader.name))
}

/// A curve that can drive an interface, as in its file.
pub(crate) enum DrivingFile {
    Predicted(Box<PredictedCurve>),
    /// With the changes needed to drive an interface.
    Curve(Box<ForceCurve>, Vec<String>),
}

/// Reads a file of any format as the curve of an interface. A plain table of increasing deflections from 0 is taken as it
/// stands; of a record over time the loading branch drives.
///
/// # Errors
/// As for [`read`], and if the curve cannot drive an interface.
pub(crate) fn driving(path: &Path, options: &ReadOptions) -> Result<DrivingFile, Error> {
    let (mut found, format) = parse(path, options)?;
    if format == JSON {
        return json::predicted(path).map(|curve| DrivingFile::Predicted(Box::new(curve)));
    }
    let has = |e: &str| path.extension().is_some_and(|found| found.eq_ignore_ascii_case(e));
    let mut error = None;
    if has("csv") || has("tsv") {
        match found.as_they_stand() {
            Ok(curve) => return Ok(DrivingFile::Curve(Box::new(curve), Vec::new())),
            Err(plain) => error = Some(curve::content(path)(plain).at_key("points")),
        }
    }
    // What lies beyond the maximum crush is of no use to a database; here it drives.
    let crush_m = found.facts.max_deflection_m.take();
    let found = found.sorted().map_err(curve::content(path));
    let mut curve = found.map_err(|sorted| error.unwrap_or(sorted))?;
    curve.facts.max_deflection_m = crush_m;
    let (curve, changes) = curve.driving().map_err(curve::content(path))?;
    Ok(DrivingFile::Curve(Box::new(curve), changes))
}

/// The reader that was named, else the first that knows the content, else that of the extension.
fn reader(input: &Input<'_>) -> Result<&'static Reader, Error> {
    let known = || readers().collect::<Vec<_>>().join(", ");
    if let Some(name) = &input.options.format {
        let found = READERS.iter().find(|r| r.name == name);
        return found.ok_or_else(|| {
            let known = known();
            error!(
                Usage,
                "there is no format \"{name}\" of curves that can be read: use one of {known}{}",
                guess::hint(name, &known)
            )
        });
    }
    let extension = input.path.extension().and_then(|e| e.to_str()).unwrap_or_default();
    let extension = extension.to_ascii_lowercase();
    READERS
        .iter()
        .find(|r| (r.recognise)(input))
        .or_else(|| READERS.iter().find(|r| r.extensions.contains(&&*extension)))
        .ok_or_else(|| error!(CurveFile, "{path}: the format of this file cannot be recognised by its content or extension: expected one of {known}; name it with --from", known = known(), path = input.path.display()))
}
