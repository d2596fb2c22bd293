//! Curve of a Modelica table file: `#1`, then `double name(rows,columns)` and the values.
//!
//! Values are separated by blanks, tabs, commas or semicolons, wherever lines end; `#` begins a
//! comment. The first two columns are deflection and force. Units are in a comment of the
//! table's line (`# d [m], F [N]`); the table `fd_load` is ours and in SI.
//!
//! Curve of a Modelica package that `crumple export` wrote: its constants `d` and `f`, in SI.
//!
//! Comments `// key: value` before the package give force, speed, mass and unloading. The package keeps at most
//! 200 points of a curve.

use super::Input;
use super::columns::{check_curves, check_points, choose};
use super::curve::{
    CUT, Metadata, Place, ReadCurve, expected, miscounted, shown, stated_units, title, units, value,
};
use super::encoding::lines;
use super::label::{Label, Quantity};
use crate::error::{Error, error};
use crate::unit::UnitSystem;

/// Name of the table and of the matrix that our exports write, in SI.
pub(super) const OURS: &str = "fd_load";

const REMEDY: &str = " (or after the table's size: \"# d [m], F [N]\")";

pub(super) fn recognise(input: &Input<'_>) -> bool {
    input.text.strip_prefix("#1").is_some_and(|rest| rest.starts_with(['\n', '\r', ' ']))
}

pub(super) fn read(input: &Input<'_>) -> Result<ReadCurve, Error> {
    let file = File::read(input.text)?;
    let table = file.choose(input.options.curve.as_deref())?;
    let mut notes = vec![format!("curve: table {} of the file", table.name)];
    let (length, force, system) = match table.sizes {
        Some((length, force)) => {
            notes.push(format!("units: those of line {}", table.line));
            (length, force, None)
        }
        None => {
            let system = match (file.units, input.options.units) {
                (None, None) if table.name.starts_with(OURS) => {
                    notes.push(format!("units: SI, as crumple export writes {OURS}"));
                    UnitSystem::SI
                }
                (stated, given) => units(stated, given, REMEDY, &mut notes)?,
            };
            (system.length_m, system.force(), Some(system))
        }
    };
    let column = |k: usize, size: f64| {
        table.values.iter().skip(k).step_by(table.columns).map(|v| v * size).collect()
    };
    Ok(ReadCurve {
        deflection_m: column(0, length),
        force_n: column(1, force),
        facts: table.facts,
        title: Some(table.name.clone()),
        units: system,
        notes,
        lines: table.lines.clone(),
        ..ReadCurve::default()
    })
}

/// A table of the file.
struct Table {
    name: String,
    line: u64,
    rows: usize,
    columns: usize,
    /// SI values of the units in its comment: of deflection and force.
    sizes: Option<(f64, f64)>,
    /// Metadata of the comments before it.
    facts: Metadata,
    values: Vec<f64>,
    /// Line of each row's first value.
    lines: Vec<u64>,
}

struct File {
    tables: Vec<Table>,
    facts: Metadata,
    units: Option<(UnitSystem, u64)>,
}

impl File {
    fn read(bytes: &str) -> Result<Self, Error> {
        let mut file = Self { tables: Vec::new(), facts: Metadata::default(), units: None };
        for (at, line) in lines(bytes) {
            let (text, comment) = line.split_once('#').unwrap_or((line, ""));
            if text.trim().is_empty() {
                file.facts.take("#", comment.trim_start_matches('#'), Place::Line(at))?;
                let stated = stated_units(comment).map(|units| (units, at));
                file.units = file.units.or(stated);
                continue;
            }
            match declaration(text, at)? {
                Some(declared) => {
                    file.check_last()?;
                    let (name, rows, columns) = declared;
                    check_size(&name, rows, columns, bytes.len(), at)?;
                    let sizes = sizes(comment);
                    let (values, lines) = (Vec::new(), Vec::new());
                    let facts = file.facts;
                    let table =
                        Table { name, line: at, rows, columns, sizes, facts, values, lines };
                    file.tables.push(table);
                    check_curves(file.tables.len())?;
                }
                None => file.values(text, at)?,
            }
        }
        file.check_last()?;
        Ok(file)
    }

    fn values(&mut self, text: &str, line: u64) -> Result<(), Error> {
        let words = text.split([' ', '\t', ',', ';', '\r']).filter(|w| !w.is_empty());
        for (field, word) in words.enumerate() {
            let place = Place::Field { line, field: field + 1 };
            let Some(table) = self.tables.last_mut() else {
                let what = "a table such as \"double fd_load(4,2)\" before the values";
                return Err(expected(place, what, word));
            };
            let value = value(place.clone(), word)?;
            if table.values.len() == table.rows * table.columns {
                let what = format_args!(
                    "no more than the {} rows of {} that table {} declares",
                    table.rows, table.columns, table.name
                );
                return Err(expected(place, what, word));
            }
            if table.values.len() % table.columns == 0 {
                table.lines.push(line);
            }
            table.values.push(value);
        }
        Ok(())
    }

    /// Whether the last table has all its values.
    fn check_last(&self) -> Result<(), Error> {
        let Some(table) = self.tables.last() else { return Ok(()) };
        if table.values.len() == table.rows * table.columns {
            return Ok(());
        }
        Err(miscounted(
            Place::Line(table.line),
            format_args!("table {}", table.name),
            format_args!("{} rows of {}", table.rows, table.columns),
            format_args!("{} values for it", table.values.len()),
            CUT,
        ))
    }

    /// The table that was requested, else ours, else the only one that can be a curve.
    fn choose(&self, asked: Option<&str>) -> Result<&Table, Error> {
        let fitting: Vec<&Table> = self.tables.iter().filter(|t| t.columns >= 2).collect();
        if fitting.is_empty() {
            let found = format!("{} others", self.tables.len());
            let expected = "a table of two columns, such as \"double fd_load(4,2)\"";
            return Err(error!(CurveFile, "expected {expected}, found {found}"));
        }
        let names = fitting.iter().map(|t| (t.name.clone(), String::new()));
        Ok(fitting[choose(names.clone(), asked.or(ours_of(names)))?])
    }
}

/// Our table, if there is one; several of ours are the curves of several speeds.
pub(super) fn ours_of(names: impl Iterator<Item = (String, String)>) -> Option<&'static str> {
    let ours: Vec<String> =
        names.map(|(name, _)| name).filter(|name| name.starts_with(OURS)).collect();
    (ours == [OURS]).then_some(OURS)
}

/// Name, rows and columns, if the line declares a table.
fn declaration(text: &str, line: u64) -> Result<Option<(String, usize, usize)>, Error> {
    let text = text.trim();
    let rest = ["double", "float"].iter().find_map(|kind| text.strip_prefix(kind));
    let Some(rest) = rest.filter(|rest| rest.starts_with([' ', '\t'])) else { return Ok(None) };
    let parse = || {
        let (name, size) = rest.trim().split_once('(')?;
        let (rows, columns) = size.trim().strip_suffix(')')?.split_once(',')?;
        let (rows, columns) = (rows.trim().parse().ok()?, columns.trim().parse().ok()?);
        (rows > 0 && columns > 0).then(|| (name.trim().to_string(), rows, columns))
    };
    parse()
        .map(Some)
        .ok_or_else(|| expected(Place::Line(line), "a table such as \"double fd_load(4,2)\"", text))
}

/// Refuses sizes that the file cannot hold: a value takes two bytes with its separator.
fn check_size(
    name: &str,
    rows: usize,
    columns: usize,
    bytes: usize,
    line: u64,
) -> Result<(), Error> {
    check_points(rows)?;
    if rows.checked_mul(columns).is_some_and(|values| values <= bytes / 2 + 1) {
        return Ok(());
    }
    Err(miscounted(
        Place::Line(line),
        format_args!("table {}", shown(name)),
        format_args!("{rows} rows of {columns}"),
        format_args!("{bytes} bytes"),
        "correct the size",
    ))
}

/// SI values of the units that a comment such as `d [m], F [N]` names.
fn sizes(comment: &str) -> Option<(f64, f64)> {
    let of = |wanted: Quantity| {
        comment.split([',', ';']).find_map(|text| {
            let label = Label::parse(text).filter(|label| label.quantity == wanted)?;
            wanted.size_of(&label.unit?)
        })
    };
    Some((of(Quantity::Deflection)?, of(Quantity::Force)?))
}

pub(super) fn recognise_package(input: &Input<'_>) -> bool {
    let has_name = input.path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mo"));
    has_name
        || lines(input.beginning()).any(|(_, line)| line.trim().starts_with("constant Real d["))
}

pub(super) fn read_package(input: &Input<'_>) -> Result<ReadCurve, Error> {
    let packages = packages(input.text)?;
    if packages.is_empty() {
        return Err(error!(
            CurveFile,
            "expected a package that crumple export wrote (constant Real d[…], f[…]), found none: write other curves as a table text (#1, double name(n,2)), CSV or MAT file"
        ));
    }
    let names = packages.iter().map(|package| (package.name.clone(), String::new()));
    let package = &packages[choose(names, input.options.curve.as_deref())?];
    for array in [&package.d, &package.f] {
        array.check()?;
    }
    if package.d.values.len() != package.f.values.len() {
        return Err(miscounted(
            Place::Line(package.f.line),
            "constant f",
            format_args!("{} forces", package.f.values.len()),
            format_args!("{} deflections", package.d.values.len()),
            "write the file again",
        ));
    }
    let mut notes = vec![
        format!("curve: constants d and f of package {}, SI", shown(&package.name)),
        "points: a package keeps at most 200 of a curve".into(),
    ];
    Ok(ReadCurve {
        deflection_m: package.d.values.clone(),
        force_n: package.f.values.clone(),
        facts: package.facts,
        title: title(&package.name, &mut notes),
        units: Some(UnitSystem::SI),
        notes,
        ..ReadCurve::default()
    })
}

/// An array of numbers.
#[derive(Clone, Debug, Default)]
struct Array {
    line: u64,
    name: &'static str,
    declared: usize,
    values: Vec<f64>,
    is_closed: bool,
}

impl Array {
    fn check(&self) -> Result<(), Error> {
        if self.is_closed && self.values.len() == self.declared {
            return Ok(());
        }
        let what = format_args!("constant {}", self.name);
        let declared = format_args!("{} values", self.declared);
        Err(miscounted(Place::Line(self.line), what, declared, self.values.len(), CUT))
    }
}

/// A package with its table.
#[derive(Clone, Debug, Default)]
struct Package {
    name: String,
    facts: Metadata,
    d: Array,
    f: Array,
}

/// The packages that hold a table.
fn packages(text: &str) -> Result<Vec<Package>, Error> {
    let (mut packages, mut facts) = (Vec::<Package>::new(), Metadata::default());
    // The array that continues in the next line.
    let mut open: Option<&'static str> = None;
    for (at, line) in lines(text) {
        let line = line.trim();
        if let Some(comment) = line.strip_prefix("//") {
            facts.take("//", comment, Place::Line(at))?;
            continue;
        }
        if let Some(name) = line.strip_prefix("package ") {
            let name = name.split_whitespace().next().unwrap_or_default().to_string();
            packages.push(Package { name, facts, ..Package::default() });
            check_curves(packages.len())?;
            open = None;
            continue;
        }
        let Some(package) = packages.last_mut() else { continue };
        let (name, rest) = match (package_declaration(line), open) {
            (Some((name, declared, rest)), _) => {
                *package.array(name) = Array { line: at, name, declared, ..Array::default() };
                (name, rest)
            }
            (None, Some(name)) => (name, line),
            (None, None) => continue,
        };
        let array = package.array(name);
        array.take(rest, at)?;
        open = (!array.is_closed).then_some(name);
    }
    packages.retain(|package| package.d.line > 0 && package.f.line > 0);
    Ok(packages)
}

/// Name, size and what follows the brace, if the line begins one of the two arrays.
fn package_declaration(line: &str) -> Option<(&'static str, usize, &str)> {
    let rest = line.strip_prefix("constant Real ")?;
    let name = ["d", "f"].into_iter().find(|name| rest.starts_with(&format!("{name}[")))?;
    let (size, values) = rest[2..].split_once(']')?;
    Some((name, size.trim().parse().ok()?, values.split_once('{')?.1))
}

impl Package {
    fn array(&mut self, name: &str) -> &mut Array {
        if name == "d" { &mut self.d } else { &mut self.f }
    }
}

impl Array {
    /// Takes the numbers of a line, up to the closing brace.
    fn take(&mut self, text: &str, line: u64) -> Result<(), Error> {
        let (text, is_closed) = match text.split_once('}') {
            Some((text, _)) => (text, true),
            None => (text, false),
        };
        for (field, word) in text.split(',').enumerate().filter(|(_, word)| !word.trim().is_empty())
        {
            let place = Place::Field { line, field: field + 1 };
            self.values.push(value(place, word)?);
            check_points(self.values.len())?;
        }
        self.is_closed = is_closed;
        Ok(())
    }
}
