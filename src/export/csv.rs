//! Curve as CSV: `d_m,force_N[,lo,hi]` under `#` header lines, written and read.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use super::{ExportError, MAX_CURVE_BYTES, Options, headline, nine_digits};
use crate::curve::{Envelope, EnvelopeError};
use crate::file;
use crate::separated::separator;
use crate::surrogate::PredictedCurve;
use crate::unit::{FORCE, LENGTH};

pub fn write(curve: &PredictedCurve, _: &Options) -> Result<Vec<u8>, ExportError> {
    let mut out = String::new();
    // Writing to a string cannot fail.
    let mut line = |text: std::fmt::Arguments<'_>| {
        let _ = writeln!(out, "{text}");
    };
    line(format_args!("# {}", headline(curve)));
    line(format_args!("# deflection in m, force in N, positive in compression"));
    line(format_args!("# speed_m_per_s: {}", curve.speed_m_per_s));
    line(format_args!("# speed_kind: {}", curve.speed_kind.name()));
    line(format_args!("# mass_kg: {}", curve.mass_kg));
    line(format_args!("# energy_J: {}", nine_digits(curve.energy_j)));
    line(format_args!(
        "# unloading_stiffness_N_per_m: {}",
        nine_digits(curve.unloading_stiffness_n_per_m)
    ));
    line(format_args!("# model: {}", curve.model));
    line(format_args!("# training_hash: {}", curve.provenance.training_hash));
    line(format_args!("# written_by: {}", curve.provenance.written_by));
    for warning in &curve.warnings {
        line(format_args!("# warning: {}", warning.message.replace('\n', " ")));
    }
    let band = curve.force_low_n.as_ref().zip(curve.force_high_n.as_ref());
    line(format_args!("d_m,force_N{}", if band.is_some() { ",lo,hi" } else { "" }));
    for (i, (d, f)) in curve.deflection_m.iter().zip(&curve.force_n).enumerate() {
        let edges = match band {
            Some((low, high)) => format!(",{},{}", nine_digits(low[i]), nine_digits(high[i])),
            None => String::new(),
        };
        line(format_args!("{},{}{edges}", nine_digits(*d), nine_digits(*f)));
    }
    Ok(out.into_bytes())
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
/// are ignored. Separated by commas, semicolons or tabs, whichever stand in the header.
///
/// # Errors
/// [`CsvError`] with line and field.
pub fn read(path: &Path) -> Result<Envelope, CsvError> {
    let io = |source| CsvError::Io { path: path.into(), source };
    let malformed = |source| CsvError::Csv { path: path.into(), source };
    let bytes = file::read(path, MAX_CURVE_BYTES).map_err(io)?;
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .delimiter(separator(&bytes))
        .from_reader(&*bytes);
    let header = reader.headers().map_err(malformed)?.clone();
    let line = header.position().map_or(1, csv::Position::line);
    let unit = |field: usize, prefixes: &[&str], of: &crate::unit::Dimension, wanted, example| {
        let found = header.get(field).unwrap_or_default();
        let size = prefixes.iter().find_map(|prefix| of.size_of(found.strip_prefix(prefix)?));
        size.ok_or_else(|| CsvError::Header {
            path: path.into(),
            line,
            wanted,
            example,
            found: found.into(),
        })
    };
    let length = unit(0, &["d_", "deflection_"], &LENGTH, "deflection", "d_m or d_mm")?;
    let force = unit(1, &["force_"], &FORCE, "force", "force_N or force_kN")?;
    let (mut deflection_m, mut force_n) = (Vec::new(), Vec::new());
    for record in reader.records() {
        let record = record.map_err(malformed)?;
        let number = |field: usize| {
            let found = record.get(field).unwrap_or_default();
            found.parse::<f64>().map_err(|_| CsvError::Number {
                path: path.into(),
                line: record.position().map_or(0, csv::Position::line),
                field: field + 1,
                found: found.into(),
            })
        };
        deflection_m.push(number(0)? * length);
        force_n.push(number(1)? * force);
    }
    let envelope = Envelope::new(deflection_m, force_n)
        .map_err(|source| CsvError::Envelope { path: path.into(), source })?;
    match envelope.first_pulling_point() {
        Some(point) => Err(CsvError::Pulling { path: path.into(), point }),
        None => Ok(envelope),
    }
}
