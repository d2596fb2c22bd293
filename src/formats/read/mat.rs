//! Curve of a MAT file of version 4: full matrices of doubles, of either byte order.
//!
//! A matrix has five int32 (type, rows, columns, whether it is complex, length of the name), the
//! name with a zero byte, and the values column by column. The type is `1000 M + 100 O + 10 P + T`:
//! M the byte order (0 little, 1 big), P the kind of numbers (0 double), T the kind of matrix (0
//! full). The curve is `fd_load`, which our exports write in SI, or the only matrix of two columns;
//! `k_u`, one number, is the unloading stiffness.

use super::Input;
use super::columns::{LISTED, check_curves, check_points, choose};
use super::curve::{CUT, Place, ReadCurve, expected, miscounted, shown, units};
use super::modelica::{OURS, ours_of};
use crate::error::{Error, error};
use crate::unit::UnitSystem;

/// Longest name of a matrix, with its zero byte.
const NAME: usize = 1024;
/// Bytes of a matrix' five integers.
const HEAD: usize = 20;

pub(super) fn recognise(input: &Input<'_>) -> bool {
    is_later(input.bytes) || head(input.bytes, 0).is_some()
}

pub(super) fn read(input: &Input<'_>) -> Result<ReadCurve, Error> {
    if is_later(input.bytes) {
        return Err(error!(
            CurveFile,
            "expected a MAT file of version 4, found one of a later version: save it with -v4"
        ));
    }
    let matrices = matrices(input.bytes)?;
    let table = chosen(&matrices, input.options.curve.as_deref())?;
    let mut notes = vec![format!("curve: matrix {} of the file", table.name)];
    let ours = table.name.strip_prefix(OURS);
    let system = match (ours.is_some(), input.options.units) {
        (true, None) => {
            notes.push(format!("units: SI, as crumple export writes {OURS}"));
            UnitSystem::SI
        }
        (_, given) => units(None, given, "", &mut notes)?,
    };
    let mut columns = ReadCurve::default();
    let rows = table.head.rows;
    columns.deflection_m = table.values(0, rows).map(|v| v * system.length_m).collect();
    columns.force_n = table.values(rows, rows).map(|v| v * system.force()).collect();
    // Further curves of one file have numbers after their names.
    let beside = |name: &str| {
        let name = format!("{name}{}", ours.unwrap_or_default());
        matrices.iter().find(move |m| m.name == name)
    };
    if let Some(facts) = beside("facts").filter(|m| m.head.is_text) {
        for (line, text) in facts.texts().enumerate() {
            columns.facts.take("facts:", &text, Place::Row(line + 1))?;
        }
    }
    let stiffness = beside("k_u").filter(|m| m.head.rows * m.head.columns == 1);
    let stiffness = stiffness.and_then(|m| m.values(0, 1).next());
    let stiffness = stiffness.map(|k| k * system.force() / system.length_m);
    let stiffness = stiffness.filter(|k| *k > 0.0 && k.is_finite());
    // A line that stands for the curve's own stiffness is not that; another one is a change by hand.
    let stands = |k: &f64| {
        columns.facts.line_stiffness_n_per_m.is_some_and(|line| (k / line - 1.0).abs() < 1e-8)
    };
    columns.facts.unloading_stiffness_n_per_m =
        stiffness.filter(|k| !stands(k)).or(columns.facts.unloading_stiffness_n_per_m);
    if beside("fd_unload").is_some() {
        notes.push("unloading: that of k_u, fd_unload is not read".into());
    }
    columns.title = Some(table.name.clone());
    columns.units = Some(system);
    columns.notes = notes;
    Ok(columns)
}

/// Whether it is a MAT file of version 5 or later.
fn is_later(bytes: &[u8]) -> bool {
    bytes.starts_with(b"MATLAB ")
}

/// A matrix; of a text, one value for each character.
struct Matrix<'a> {
    head: Head,
    name: String,
    bytes: &'a [u8],
}

impl Matrix<'_> {
    /// So many values from the one at `from`, column by column.
    fn values(&self, from: usize, count: usize) -> impl Iterator<Item = f64> {
        self.bytes.chunks_exact(8).skip(from).take(count).map(|bytes| {
            let bytes = <[u8; 8]>::try_from(bytes).unwrap_or_default();
            if self.head.is_big { f64::from_be_bytes(bytes) } else { f64::from_le_bytes(bytes) }
        })
    }
}

/// Maximum number of lines and columns of a text that is read.
const MOST_TEXT: usize = 1_000;

impl Matrix<'_> {
    fn texts(&self) -> impl Iterator<Item = String> {
        let (rows, columns) = (self.head.rows.min(MOST_TEXT), self.head.columns.min(MOST_TEXT));
        let character = |code: f64| char::from_u32(code as u32).unwrap_or(' ');
        (0..rows).map(move |row| {
            let code = |column: usize| self.values(column * self.head.rows + row, 1).next();
            let line: String = (0..columns).filter_map(code).map(character).collect();
            line.trim_end().to_string()
        })
    }
}

/// The integers before a matrix.
struct Head {
    is_big: bool,
    number: usize,
    /// Whether it is full or a text, and of doubles.
    is_read: bool,
    is_text: bool,
    rows: usize,
    columns: usize,
    is_complex: bool,
    name: usize,
}

/// The integers at `at`; `None` if they are those of no matrix.
fn head(bytes: &[u8], at: usize) -> Option<Head> {
    let bytes: &[u8; HEAD] = bytes.get(at..)?.first_chunk()?;
    let integers = |read: fn([u8; 4]) -> i32| {
        let mut all = [0; 5];
        for (integer, four) in all.iter_mut().zip(bytes.chunks_exact(4)) {
            *integer = read(<[u8; 4]>::try_from(four).unwrap_or_default());
        }
        all
    };
    let little = integers(i32::from_le_bytes);
    let is_big = !(0..5000).contains(&little[0]);
    let [kind, rows, columns, complex, name] =
        if is_big { integers(i32::from_be_bytes) } else { little };
    let (order, zero) = (kind / 1000, kind / 100 % 10);
    let (numbers, form) = (kind / 10 % 10, kind % 10);
    let number = *[8, 4, 4, 2, 2, 1].get(usize::try_from(numbers).ok()?)?;
    let fits = order == i32::from(is_big)
        && zero == 0
        && (0..=2).contains(&form)
        && (0..=1).contains(&complex);
    let name = usize::try_from(name).ok().filter(|name| (2..=NAME).contains(name))?;
    let (rows, columns) = (usize::try_from(rows).ok()?, usize::try_from(columns).ok()?);
    let (is_read, is_complex) = (numbers == 0 && form < 2 && complex == 0, complex == 1);
    let is_text = form == 1;
    fits.then_some(Head { is_big, number, is_read, is_text, rows, columns, is_complex, name })
}

/// The full matrices of doubles; others are passed over.
fn matrices(bytes: &[u8]) -> Result<Vec<Matrix<'_>>, Error> {
    let mut found = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let head = head(bytes, at).ok_or_else(|| {
            let found = format!("{} bytes of something else", bytes.len() - at);
            let what = "a matrix of a MAT file of version 4 (save it with -v4)";
            expected(Place::Byte(at), what, &found)
        })?;
        let begin = at + HEAD + head.name;
        let name = bytes.get(at + HEAD..begin).unwrap_or_default();
        let name = String::from_utf8_lossy(name.split(|&b| b == 0).next().unwrap_or_default());
        let values = head.rows.checked_mul(head.columns);
        let size = values.and_then(|n| n.checked_mul(head.number << usize::from(head.is_complex)));
        let end = size.and_then(|size| begin.checked_add(size)).filter(|end| *end <= bytes.len());
        let Some(end) = end else {
            return Err(miscounted(
                Place::Byte(at),
                format_args!("matrix {}", shown(&name)),
                format_args!("{} rows of {}", head.rows, head.columns),
                format_args!("{} bytes after its name", bytes.len().saturating_sub(begin)),
                CUT,
            ));
        };
        if head.is_read {
            found.push(Matrix { head, name: name.into_owned(), bytes: &bytes[begin..end] });
        }
        check_curves(found.len())?;
        at = end;
    }
    Ok(found)
}

/// The matrix that was requested, else ours, else the only one of two columns.
fn chosen<'a>(matrices: &'a [Matrix<'_>], asked: Option<&str>) -> Result<&'a Matrix<'a>, Error> {
    let fitting: Vec<&Matrix> =
        matrices.iter().filter(|m| m.head.columns == 2 && !m.head.is_text).collect();
    if fitting.is_empty() {
        let sizes = matrices
            .iter()
            .map(|m| format!("{} ({} x {})", shown(&m.name), m.head.rows, m.head.columns));
        let found = match matrices.len() {
            0 => "none".into(),
            _ => sizes.take(LISTED).collect::<Vec<_>>().join(", "),
        };
        let expected = "a full matrix of doubles with two columns, such as fd_load";
        return Err(error!(CurveFile, "expected {expected}, found {found}"));
    }
    let names = fitting.iter().map(|m| (m.name.clone(), String::new()));
    let table = fitting[choose(names.clone(), asked.or(ours_of(names)))?];
    check_points(table.head.rows)?;
    Ok(table)
}
