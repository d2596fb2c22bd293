//! Solver files: from bytes to [`History`].
//!
//! A reader takes `BufRead` and a [`Selection`], returns a [`SolverFile`], and treats
//! damage as part of the result ([`Problem`]): complete states are returned, what is
//! missing is named. It never prints, panics, or holds more than was selected.

pub mod lsdyna;
mod problem;
mod states;

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Serialize;

use crate::history::{EntityId, History, Side};
pub use problem::{Problem, ProblemCode};

/// One kind of file: its name, how to recognise it, how to read it.
pub struct Format {
    /// Named as the solver names the file.
    pub name: &'static str,
    /// Whether a line below the header shows that the file is of this kind.
    signature: fn(&[u8]) -> bool,
    read: fn(&mut dyn BufRead, &Selection) -> io::Result<SolverFile>,
}

/// Every file we read. To add one: write its module, add its line here.
pub const FORMATS: &[Format] = &[
    Format { name: "nodout", signature: lsdyna::nodout::signature, read: lsdyna::nodout::read },
    Format { name: "rcforc", signature: lsdyna::rcforc::signature, read: lsdyna::rcforc::read },
    Format { name: "rwforc", signature: lsdyna::rwforc::signature, read: lsdyna::rwforc::read },
    Format { name: "glstat", signature: lsdyna::glstat::signature, read: lsdyna::glstat::read },
];

/// Which entity is wanted: an id, on both sides of an interface unless one is named.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WantedId {
    pub id: i64,
    pub side: Option<Side>,
}

impl WantedId {
    fn matches(&self, entity: EntityId) -> bool {
        self.id == entity.id && (self.side.is_none() || self.side == entity.side)
    }
}

impl std::fmt::Display for WantedId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { id, side } = *self;
        EntityId { id, side }.fmt(f)
    }
}

impl std::str::FromStr for WantedId {
    type Err = String;

    /// Reads `"900001"` or `"3:surfa"`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (id, side) = match text.split_once(':') {
            Some((id, side)) => (id, Some(side)),
            None => (text, None),
        };
        let parsed = id.trim().parse().ok().zip(match side {
            Some(side) => Side::parse(side).map(Some),
            None => Some(None),
        });
        parsed
            .map(|(id, side)| Self { id, side })
            .ok_or_else(|| format!("\"{text}\" is not an id: write for example 900001 or 3:surfa"))
    }
}

/// Which histories a reader keeps. `None` keeps all, an empty list none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    pub ids: Option<Vec<WantedId>>,
    pub components: Option<Vec<String>>,
    /// Whether fields that are not kept are read as well, so that the problems of the
    /// whole file are found.
    pub audit: bool,
}

impl Selection {
    /// Every history of the file.
    pub fn all() -> Self {
        Self::default()
    }

    /// No history: only what the file says of itself, and all its problems.
    pub fn nothing() -> Self {
        Self { ids: Some(Vec::new()), components: Some(Vec::new()), audit: true }
    }

    fn wants(&self, entity: EntityId) -> bool {
        self.ids.as_ref().is_none_or(|ids| ids.iter().any(|id| id.matches(entity)))
    }

    fn wants_component(&self, component: &str) -> bool {
        self.components.as_ref().is_none_or(|all| all.iter().any(|c| c == component))
    }
}

/// An entity that has histories, with its title where the file's legend gives one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Entity {
    #[serde(flatten)]
    pub id: EntityId,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
}

/// An entity that the file names without giving it values.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WithoutData {
    pub id: i64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
    pub reason: NoDataReason,
}

/// Why an entity has no values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum NoDataReason {
    /// A single-surface contact: LS-DYNA prints that its resultants are undefined.
    SingleSurfaceContact,
    /// Named in the legend, but no state has a row of it.
    LegendOnly,
}

/// What a solver file holds: its own description, the selected histories, its damage.
#[derive(Clone, Debug, PartialEq)]
pub struct SolverFile {
    pub format: &'static str,
    pub solver: Option<String>,
    pub version: Option<String>,
    pub title: Option<String>,
    /// In the order of the first state.
    pub entities: Vec<Entity>,
    pub without_data: Vec<WithoutData>,
    /// All components of the file, selected or not.
    pub components: Vec<Arc<str>>,
    /// One time per complete state, in the solver's unit.
    pub time: Arc<[f64]>,
    pub histories: Vec<History>,
    pub problems: Vec<Problem>,
}

impl SolverFile {
    /// The history of `component` of `entity` (`None`: a global quantity).
    pub fn history(&self, entity: Option<EntityId>, component: &str) -> Option<&History> {
        self.histories.iter().find(|h| h.entity == entity && &*h.component == component)
    }
}

/// Why a file could not be read at all, or not what was asked of it.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    #[error("{path}: {source}")]
    Io { path: PathBuf, source: io::Error },
    #[error("{path}: {looks_like}: the readers take {known}")]
    UnknownFormat { path: PathBuf, looks_like: String, known: String },
    #[error("there is no format \"{name}\": the readers take {known}")]
    NoSuchFormat { name: String, known: String },
    #[error("{path}: {format} has no {what} {id}: {near}", what = entity_word(format))]
    NoSuchEntity { path: PathBuf, format: &'static str, id: WantedId, near: String },
    #[error(
        "{path}: interface {id} is a single-surface contact, for which LS-DYNA prints no resultants: ask for a two-sided contact or a force transducer ({with_data})"
    )]
    SingleSurface { path: PathBuf, id: i64, with_data: String },
    #[error("{path}: {format} has no component \"{component}\": it has {known}")]
    NoSuchComponent { path: PathBuf, format: &'static str, component: String, known: String },
}

/// What an id of this format counts, for messages.
fn entity_word(format: &str) -> &'static str {
    match format {
        "nodout" => "node",
        "rwforc" => "rigid wall",
        "rcforc" => "interface",
        _ => "entity",
    }
}

/// The formats' names, for messages: `nodout, rcforc, …`.
pub fn format_names() -> String {
    FORMATS.iter().map(|f| f.name).collect::<Vec<_>>().join(", ")
}

/// Reads the selected histories of the file at `path`.
///
/// `format` names the kind of file; without it the kind is told by the content and,
/// for a file that ends after its header, by the name of the file or of its folder.
///
/// # Errors
/// [`ReadError`] if the file cannot be opened, its kind is not known, or a selected id
/// or component is not in it. Damage within the file is no error: see
/// [`SolverFile::problems`].
pub fn read(
    path: &Path,
    format: Option<&str>,
    selection: &Selection,
) -> Result<SolverFile, ReadError> {
    let io = |source| ReadError::Io { path: path.into(), source };
    let format = match format {
        Some(name) => named(name)?,
        None => detect(path)?,
    };
    let mut input = BufReader::with_capacity(1 << 16, File::open(path).map_err(io)?);
    let file = (format.read)(&mut input, selection).map_err(io)?;
    check_selection(path, &file, selection)?;
    Ok(file)
}

/// Reads the selected histories of a format's file from `input`.
///
/// Unlike [`read`], it does not hold the selection against what the file has.
///
/// # Errors
/// [`ReadError::NoSuchFormat`], or [`ReadError::Io`] (without a path) from `input`.
pub fn read_from(
    format: &str,
    input: &mut dyn BufRead,
    selection: &Selection,
) -> Result<SolverFile, ReadError> {
    (named(format)?.read)(input, selection)
        .map_err(|source| ReadError::Io { path: PathBuf::new(), source })
}

fn named(name: &str) -> Result<&'static Format, ReadError> {
    FORMATS
        .iter()
        .find(|f| f.name == name)
        .ok_or_else(|| ReadError::NoSuchFormat { name: name.into(), known: format_names() })
}

/// Lines looked at before a file counts as unknown: more than the longest legend seen,
/// few enough that a large foreign file is refused at once.
const DETECT_LINES: u64 = 100_000;

fn detect(path: &Path) -> Result<&'static Format, ReadError> {
    let io = |source| ReadError::Io { path: path.into(), source };
    let unknown = |looks_like: &str| ReadError::UnknownFormat {
        path: path.into(),
        looks_like: looks_like.into(),
        known: format_names(),
    };
    if path.is_dir() {
        return Err(unknown("this is a folder"));
    }
    let mut file = File::open(path).map_err(io)?;
    let mut head = Vec::new();
    file.by_ref().take(16).read_to_end(&mut head).map_err(io)?;
    if head.starts_with(b"\x89HDF\r\n\x1a\n") {
        return Err(unknown("this is an HDF5 file"));
    }
    if let [8 | 4, 8 | 4, 8 | 4, 1, 1, 0 | 1, 0, ..] = head[..] {
        return Err(unknown("this is an LSDA container such as binout, which is not read yet"));
    }
    let mut lines = lsdyna::line::Lines::new(BufReader::new(io::Cursor::new(head).chain(file)));
    let mut is_lsdyna = false;
    while let Some(line) = lines.next_line().map_err(io)? {
        if line.number > DETECT_LINES {
            return Err(unknown("no solver output is recognised in it"));
        }
        is_lsdyna |= line.number == 2 && lsdyna::header::version(line.text).is_some();
        if line.number <= 2 {
            continue;
        }
        // Titles in a legend are free text, but none begins like a line of a body, whose
        // signature also ends a legend that lost its closing line.
        if let Some(format) = FORMATS.iter().find(|f| (f.signature)(line.text)) {
            return Ok(format);
        }
    }
    let named_so = |f: &&Format| path.file_name().is_some_and(|name| name == f.name);
    if let Some(format) = FORMATS.iter().find(named_so) {
        return Ok(format);
    }
    let by_name = path.iter().rev().take(2).find_map(|part| {
        let part = part.to_string_lossy().to_ascii_lowercase();
        FORMATS.iter().find(|f| part.starts_with(f.name))
    });
    match by_name {
        Some(format) if is_lsdyna => Ok(format),
        _ if is_lsdyna => Err(unknown(
            "this is an LS-DYNA text file of a kind that is not read, or one that ends after its header",
        )),
        _ => Err(unknown("no solver output is recognised in it")),
    }
}

/// Holds every selected id and component against what the file has.
fn check_selection(path: &Path, file: &SolverFile, selection: &Selection) -> Result<(), ReadError> {
    for wanted in selection.ids.iter().flatten() {
        if file.entities.iter().any(|e| wanted.matches(e.id)) {
            continue;
        }
        let single_surface = file
            .without_data
            .iter()
            .any(|w| w.id == wanted.id && w.reason == NoDataReason::SingleSurfaceContact);
        if single_surface {
            return Err(ReadError::SingleSurface {
                path: path.into(),
                id: wanted.id,
                with_data: near_ids(file, wanted.id),
            });
        }
        return Err(ReadError::NoSuchEntity {
            path: path.into(),
            format: file.format,
            id: *wanted,
            near: near_ids(file, wanted.id),
        });
    }
    for wanted in selection.components.iter().flatten() {
        if !file.components.iter().any(|c| **c == **wanted) {
            return Err(ReadError::NoSuchComponent {
                path: path.into(),
                format: file.format,
                component: wanted.clone(),
                known: if file.components.is_empty() {
                    "none, because the file holds no complete state".into()
                } else {
                    file.components.join(", ")
                },
            });
        }
    }
    Ok(())
}

/// The ids nearest to one that is missing, with titles: what the user may have meant.
fn near_ids(file: &SolverFile, id: i64) -> String {
    const SHOWN: usize = 8;
    if file.entities.is_empty() && file.time.is_empty() {
        return "it holds no complete state".into();
    }
    if file.entities.is_empty() {
        return "it holds no ids".into();
    }
    let mut entities: Vec<&Entity> = file.entities.iter().collect();
    entities.sort_by_key(|e| (e.id.id.abs_diff(id), e.id));
    let shown: Vec<String> = entities
        .iter()
        .take(SHOWN)
        .map(|e| match &e.title {
            Some(title) => format!("{} \"{title}\"", e.id),
            None => e.id.to_string(),
        })
        .collect();
    let rest = file.entities.len().saturating_sub(SHOWN);
    if rest > 0 {
        format!("the nearest of its ids are {} and {rest} more", shown.join(", "))
    } else {
        format!("it has {}", shown.join(", "))
    }
}
