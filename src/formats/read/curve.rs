//! A curve as in its file, in SI, with the metadata of the file.

use crate::error::{Error, error};
use std::path::Path;

use super::super::export_curve::LINE_STIFFNESS;
use super::encoding::number;
use crate::curve::contact::{THRESHOLD, onset, threshold_n};
use crate::curve::loading::{loading_branch, stiffness_of_unloading_energy};
use crate::curve::{Curve, CurveUnloading, Envelope, ForceCurve, ForceKind, SourceFile};
use crate::file::absolute;
use crate::unit::{SpeedKind, UnitSystem};
use std::fmt;

/// A curve read from a file: the loading branch, after it the unloading branch if the file has
/// one; or a record over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadCurve {
    /// In m; without times increasing from 0 to the largest, then falling.
    pub deflection_m: Vec<f64>,
    /// In N, one per deflection; without times positive in compression.
    pub force_n: Vec<f64>,
    /// In s, one per deflection, if the file has them.
    pub time_s: Option<Vec<f64>>,
    /// In N, one per deflection: the force that moves the body, where the file has it beside the
    /// one that the obstacle feels.
    pub body_force_n: Option<Vec<f64>>,
    /// Metadata of the curve in the file.
    pub facts: Metadata,
    /// Title of the curve in the file.
    pub title: Option<String>,
    /// Units of the file, if they are one system.
    pub units: Option<UnitSystem>,
    /// How it was read.
    pub notes: Vec<String>,
    /// The files that were read.
    pub files: Vec<SourceFile>,
    /// Line of each point, for messages; empty for a file without lines.
    pub(super) lines: Vec<u64>,
    /// Whether signs and order are those of a curve: it is a predicted one.
    pub(super) is_ready: bool,
}

impl ReadCurve {
    /// The curve as it drives an interface, and what was changed for that. Of a record over time it is
    /// the loading branch from where contact begins.
    pub(super) fn driving(self) -> Result<(ForceCurve, Vec<String>), Error> {
        let is_change = |note: &String| note.starts_with("points: ") || note.starts_with("sign: ");
        let mut changes: Vec<String> =
            self.notes.iter().filter(|n| is_change(n)).cloned().collect();
        let (d, mut f) = (self.deflection_m, self.force_n);
        let curve = match self.time_s {
            None => Curve::new((0..d.len()).map(|i| i as f64).collect(), d, f)?,
            Some(time_s) => {
                let impulse: f64 = time_s
                    .windows(2)
                    .zip(f.windows(2))
                    .map(|(t, f)| (t[1] - t[0]) * (f[0] + f[1]))
                    .sum();
                f.iter_mut().for_each(|f| *f *= impulse.signum());
                let onset = onset(&time_s, &f, threshold_n(&f, THRESHOLD)).ok_or_else(|| {
                    error!(CurveFile, "its force never rises: there is no contact in this record")
                })?;
                let first = time_s.iter().position(|t| *t >= onset.time_s).unwrap_or(0);
                let rest = &d[first..];
                // While the body is crushed; afterwards it may go back by more than that, with the offset of a load cell.
                let threshold = threshold_n(&f, THRESHOLD);
                let above = f[first..].iter().map(|f| (f - threshold).max(0.0));
                let pushed: f64 = rest.iter().zip(above).map(|(v, f)| f * (v - rest[0])).sum();
                let deflection_m = rest.iter().map(|v| (v - rest[0]) * pushed.signum()).collect();
                changes.push(format!(
                    "it is a record over time: its loading branch from {:.2} ms on drives the interface (crumple db add keeps all of it)",
                    1e3 * time_s[first]
                ));
                changes.extend(onset.warnings);
                Curve::new(time_s[first..].to_vec(), deflection_m, f[first..].to_vec())?
            }
        };
        let envelope = loading_branch(&curve)?.envelope;
        if let Some(point) = envelope.first_pulling_point() {
            return Err(error!(
                CurveFile,
                "the force of point {point} of its loading branch is below 0: an interface only pushes, so write compression positive and tension as 0"
            ));
        }
        let known = self.facts.unloading_stiffness_n_per_m;
        let stiffness = known.or_else(|| stiffness_of_unloading_energy(&curve));
        let unloading = CurveUnloading::of(stiffness);
        Ok((ForceCurve { unloading, ..self.facts.driving(envelope) }, changes))
    }
}

/// A file as it was read.
pub(super) fn source_file(path: &Path, bytes: &[u8]) -> SourceFile {
    SourceFile {
        path: path.display().to_string(),
        absolute_path: Some(absolute(path)),
        size_bytes: bytes.len() as u64,
        blake3: blake3::hash(bytes).to_hex().to_string(),
        format: String::new(),
        solver: None,
        version: None,
        title: None,
        problems: 0,
    }
}

/// Metadata of a curve in its file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Metadata {
    /// Which force it is.
    pub force: Option<ForceKind>,
    /// Impact speed in m/s.
    pub speed_m_per_s: Option<f64>,
    /// What the speed is measured against.
    pub speed_kind: Option<SpeedKind>,
    /// From the maximum deflection, in N/m.
    pub unloading_stiffness_n_per_m: Option<f64>,
    /// That of the straight line which stands for it in the file, where that is another.
    pub(super) line_stiffness_n_per_m: Option<f64>,
    /// The same for the force that moves the body, where that is another.
    pub body_unloading_stiffness_n_per_m: Option<f64>,
    /// Mass of the body in kg.
    pub mass_kg: Option<f64>,
    /// Mass of the other body in kg.
    pub other_mass_kg: Option<f64>,
    /// Time of the first contact, in s, whatever the force there.
    pub contact_time_s: Option<f64>,
    /// Maximum crush in m; points after it are what other tools need beyond it.
    pub max_deflection_m: Option<f64>,
    /// Where its runs' data end before that, in m.
    pub data_end_m: Option<f64>,
}

impl Metadata {
    /// Takes the metadata of a comment `key: value`; other comments are ignored. `mark` is the
    /// comment's, for messages.
    pub(super) fn take(&mut self, mark: &str, comment: &str, place: Place) -> Result<(), Error> {
        let Some((key, value)) = comment.split_once(':') else { return Ok(()) };
        let (key, value) = (key.trim(), value.trim());
        let wrong = |expected| {
            error!(
                CurveFile,
                "{place}: \"{key}: {found}\": expected {expected}",
                found = shown(value),
                key = format!("{mark} {key}")
            )
        };
        let above_zero = || {
            let number = value.parse::<f64>().ok().filter(|v| *v > 0.0 && v.is_finite());
            number.map(Some).ok_or_else(|| wrong("a number above 0"))
        };
        match key {
            "unloading_stiffness_N_per_m" => self.unloading_stiffness_n_per_m = above_zero()?,
            LINE_STIFFNESS => self.line_stiffness_n_per_m = above_zero()?,
            "speed_m_per_s" => self.speed_m_per_s = above_zero()?,
            "mass_kg" => self.mass_kg = above_zero()?,
            "other_mass_kg" => self.other_mass_kg = above_zero()?,
            "contact_time_s" => {
                let time_s = value.parse().ok().filter(|t: &f64| t.is_finite());
                self.contact_time_s = Some(time_s.ok_or_else(|| wrong("a time in s"))?);
            }
            "max_deflection_m" => self.max_deflection_m = above_zero()?,
            "data_end_m" => self.data_end_m = above_zero()?,
            "force_kind" => {
                let kind = ForceKind::parse(value);
                self.force = Some(kind.ok_or_else(|| wrong("\"body\" or \"contact\""))?);
            }
            "speed_kind" => {
                let kind = SpeedKind::parse(value);
                self.speed_kind = Some(kind.ok_or_else(|| wrong("\"wall\" or \"closing\""))?);
            }
            _ => {}
        }
        Ok(())
    }

    /// A loading branch with the data needed to drive an interface.
    pub(super) fn driving(&self, loading: Envelope) -> ForceCurve {
        ForceCurve {
            unloading: CurveUnloading::of(self.unloading_stiffness_n_per_m),
            kind: self.force,
            speed_kind: self.speed_kind,
            speed_m_per_s: self.speed_m_per_s,
            data_end_m: self.data_end_m.or(self.max_deflection_m),
            ..ForceCurve::bare(loading)
        }
    }
}

/// Characters of a title that are kept.
const TITLE: usize = 200;

/// A title, cut to what a list can show; `None` if it is empty.
pub(super) fn title(text: &str, notes: &mut Vec<String>) -> Option<String> {
    let text: String = text.trim().chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let kept: String = text.chars().take(TITLE).collect();
    if kept.len() < text.len() {
        notes.push(format!("title: cut to its first {TITLE} characters"));
    }
    (!kept.is_empty()).then_some(kept)
}

/// The system that a comment such as `units of the points: mm-t-s (…)` names.
pub(super) fn stated_units(comment: &str) -> Option<UnitSystem> {
    let (key, value) = comment.split_once(':')?;
    if !key.trim().to_ascii_lowercase().starts_with("units") {
        return None;
    }
    UnitSystem::parse(value.split_whitespace().next()?).ok()
}

/// The units of a file without columns that name them: those of its own comment, else those that
/// were given; which it is goes to the notes.
pub(super) fn units(
    stated: Option<(UnitSystem, u64)>,
    given: Option<UnitSystem>,
    remedy: &'static str,
    notes: &mut Vec<String>,
) -> Result<UnitSystem, Error> {
    match (stated, given) {
        (Some((units, line)), None) => {
            notes.push(format!("units: {units} from line {line} of the file"));
            Ok(units)
        }
        (Some((stated, line)), Some(given)) if stated != given => {
            notes.push(format!("units: {given} as given; line {line} of the file states {stated}"));
            Ok(given)
        }
        (_, Some(given)) => {
            notes.push(format!("units: {given} as given"));
            Ok(given)
        }
        (None, None) => Err(error!(
            CurveFile,
            "the file does not state its units: give them with --units (of crumple export: --input-units), such as mm-t-s or SI{remedy}"
        )),
    }
}

/// An error of content, of the file at `path`.
pub(super) fn content(path: &Path) -> impl Fn(Error) -> Error {
    move |error| error!(CurveFile, "{path}: {error}", path = path.display()).caused_by(error)
}

/// A place in a file, counted from 1; bytes from 0.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    Line(u64),
    /// A field of a line whose fields are separated.
    Field {
        line: u64,
        field: usize,
    },
    Columns {
        line: u64,
        from: usize,
        to: usize,
    },
    Byte(usize),
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

/// Expected and actual content of a place.
pub(super) fn expected(place: Place, what: impl fmt::Display, found: &str) -> Error {
    let found = shown(found);
    error!(CurveFile, "{place}: expected {what}, found \"{found}\"")
}

pub(super) fn value(place: Place, text: &str) -> Result<f64, Error> {
    number(text).ok_or_else(|| expected(place, "a number", text))
}

/// Remedy for a file that is shorter than it declares.
pub(super) const CUT: &str = "write the file again: it may be truncated";

/// Another number of values than the file declares.
pub(super) fn miscounted(
    place: Place,
    what: impl fmt::Display,
    declared: impl fmt::Display,
    found: impl fmt::Display,
    remedy: &str,
) -> Error {
    error!(CurveFile, "{place}: {what} declares {declared}, but the file has {found}: {remedy}")
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
