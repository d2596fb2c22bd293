//! Curve as CSV: deflection and force under `#` header lines, written and read.

use std::path::{Path, PathBuf};

use super::text::{Lines, nine_digits};
use super::{ExportCurve, ExportError, Exported, MAX_CURVE_BYTES, Options};
use crate::curve::{CurveUnloading, DrivingCurve, Envelope, EnvelopeError, ForceKind};
use crate::file;
use crate::table::{CsvTable, NoNumber};
use crate::unit::{Dimension, FORCE, LENGTH, SpeedKind, UnitSystem};

pub fn write(curve: &ExportCurve, options: &Options) -> Result<Exported, ExportError> {
    let units = options.units.unwrap_or(UnitSystem::SI);
    let (length, force) =
        LENGTH.name_of(units.length_m).zip(FORCE.name_of(units.force())).ok_or_else(|| {
            ExportError::NoUnitNames { lengths: LENGTH.known_units(), forces: FORCE.known_units() }
        })?;
    let mut lines = Lines::default();
    for (key, value) in curve.facts() {
        lines.add(format_args!("# {key}: {}", value.replace('\n', " ")));
    }
    for warning in curve.warnings() {
        lines.add(format_args!("# warning: {}", warning.message.replace('\n', " ")));
    }
    let edges = if curve.band.is_some() { ",lo,hi" } else { "" };
    lines.add(format_args!("d_{length},force_{force}{edges}"));
    let shown = |force_n: f64| nine_digits(force_n / units.force());
    for (i, (d, f)) in curve.deflection_m().iter().zip(curve.force_n()).enumerate() {
        let edges = match &curve.band {
            Some((low, high)) => format!(",{},{}", shown(low[i]), shown(high[i])),
            None => String::new(),
        };
        lines.add(format_args!("{},{}{edges}", nine_digits(d / units.length_m), shown(*f)));
    }
    Ok(Exported::file(format!("{}.csv", curve.file_stem()), lines.into_bytes()))
}

/// Why a CSV file is no curve.
#[derive(Debug, thiserror::Error)]
pub enum CsvError {
    #[error("{path}: {source}")]
    Io { path: PathBuf, source: std::io::Error },
    #[error("{path}: {source}")]
    Csv { path: PathBuf, source: csv::Error },
    #[error(
        "{path}: line {line}: expected a column {wanted} with its unit, such as {example}, found \"{found}\""
    )]
    Header { path: PathBuf, line: u64, wanted: &'static str, example: &'static str, found: String },
    #[error("{path}: line {line}: \"# {key}: {found}\": expected {expected}")]
    Fact { path: PathBuf, line: u64, key: String, found: String, expected: &'static str },
    #[error("{path}: line {line}, field {field}: expected a number, found \"{found}\"")]
    Number { path: PathBuf, line: u64, field: usize, found: String },
    #[error("{path}: {source}")]
    Envelope { path: PathBuf, source: EnvelopeError },
    #[error(
        "{path}: the force of point {point} is below 0: an interface only pushes, so write compression positive and pull as 0"
    )]
    Pulling { path: PathBuf, point: usize },
}

/// Reads a curve from a CSV file: its first column is the deflection (`d_m`, `d_mm`,
/// `deflection_m`), its second the force (`force_N`, `force_kN`, `force_MN`); further columns
/// are ignored. Separated by commas, semicolons or tabs, whichever stand in the header. Of the
/// `# key: value` lines in front, those of force kind, speed, speed kind and unloading
/// stiffness are read.
///
/// # Errors
/// [`CsvError`] with line and field.
pub fn read(path: &Path) -> Result<DrivingCurve, CsvError> {
    let io = |source| CsvError::Io { path: path.into(), source };
    let malformed = |source| CsvError::Csv { path: path.into(), source };
    let bytes = file::read(path, MAX_CURVE_BYTES).map_err(io)?;
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&bytes);
    let facts = Facts::read(path, bytes)?;
    let mut table = CsvTable::open(&bytes[facts.bytes..], facts.lines).map_err(malformed)?;
    let (header, header_line) = (table.header().clone(), table.header_line());
    let unit = |field: usize, prefixes: &[&str], of: &Dimension, wanted, example| {
        let found = header.get(field).unwrap_or_default();
        let size = prefixes.iter().find_map(|prefix| of.size_of(found.strip_prefix(prefix)?));
        size.ok_or_else(|| CsvError::Header {
            path: path.into(),
            line: header_line,
            wanted,
            example,
            found: found.into(),
        })
    };
    let length = unit(0, &["d_", "deflection_"], &LENGTH, "deflection", "d_m or d_mm")?;
    let force = unit(1, &["force_"], &FORCE, "force", "force_N or force_kN")?;
    let (mut deflection_m, mut force_n) = (Vec::new(), Vec::new());
    for row in table.rows() {
        let row = row.map_err(malformed)?;
        let number = |field: usize| {
            row.number(field).map_err(|NoNumber { line, column, found, .. }| CsvError::Number {
                path: path.into(),
                line,
                field: column,
                found,
            })
        };
        deflection_m.push(number(0)? * length);
        force_n.push(number(1)? * force);
    }
    let envelope = Envelope::new(deflection_m, force_n)
        .map_err(|source| CsvError::Envelope { path: path.into(), source })?;
    match envelope.first_pulling_point() {
        Some(point) => Err(CsvError::Pulling { path: path.into(), point }),
        None => Ok(DrivingCurve { loading: envelope, ..facts.curve }),
    }
}

/// What stands in the `#` lines in front of a table.
struct Facts {
    /// With a loading branch that is still to come.
    curve: DrivingCurve,
    /// Lines and bytes of them.
    lines: u64,
    bytes: usize,
}

impl Facts {
    fn read(path: &Path, bytes: &[u8]) -> Result<Self, CsvError> {
        let nothing = Envelope::new(vec![0.0, 1.0], vec![0.0, 0.0]);
        let nothing = nothing.map_err(|source| CsvError::Envelope { path: path.into(), source })?;
        let mut facts = Self { curve: DrivingCurve::bare(nothing), lines: 0, bytes: 0 };
        for line in bytes.split_inclusive(|&b| b == b'\n').take_while(|l| {
            let l = l.trim_ascii();
            l.is_empty() || l.starts_with(b"#")
        }) {
            facts.lines += 1;
            facts.bytes += line.len();
            let line = String::from_utf8_lossy(line);
            if let Some((key, value)) = line.trim_start().trim_start_matches('#').split_once(':') {
                facts.note(path, key.trim(), value.trim())?;
            }
        }
        Ok(facts)
    }

    fn note(&mut self, path: &Path, key: &str, value: &str) -> Result<(), CsvError> {
        let line = self.lines;
        let wrong = |expected| CsvError::Fact {
            path: path.into(),
            line,
            key: key.into(),
            found: value.into(),
            expected,
        };
        let above_zero = || {
            let number = value.parse::<f64>().ok().filter(|v| *v > 0.0 && v.is_finite());
            number.ok_or_else(|| wrong("a number above 0"))
        };
        let curve = &mut self.curve;
        match key {
            "unloading_stiffness_N_per_m" => {
                curve.unloading = CurveUnloading::Stiffness(above_zero()?);
            }
            "speed_m_per_s" => curve.speed_m_per_s = Some(above_zero()?),
            "force_kind" => {
                let kind = ForceKind::parse(value);
                curve.force = Some(kind.ok_or_else(|| wrong("\"body\" or \"contact\""))?);
            }
            "speed_kind" => {
                let kind = SpeedKind::parse(value);
                curve.speed_kind = Some(kind.ok_or_else(|| wrong("\"wall\" or \"closing\""))?);
            }
            _ => {}
        }
        Ok(())
    }
}
