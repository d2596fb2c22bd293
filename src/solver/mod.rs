//! Solver files: from bytes to [`History`].
//!
//! A reader takes a [`Source`] and a [`Selection`], returns a [`SolverFile`], and treats
//! damage as part of the result ([`Problem`]): complete states are returned, what is
//! missing is named. It never prints, panics, or holds more than was selected.

pub mod decks;
mod family;
pub mod lsdyna;
pub mod openradioss;
mod problem;
mod restart;
pub mod source;
mod states;
mod zeros;

use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Serialize;

use crate::history::{EntityId, History, Side};
pub use family::family;
use family::missing_continuation;
pub use lsdyna::nodout::Blocks;
pub use problem::{Problem, ProblemCode};
pub use source::Access;
use source::{Source, Stream};

/// One kind of file: its name, how to recognise it, how to read it.
pub struct Format {
    /// Named as the solver names the file.
    pub name: &'static str,
    reader: Reader,
}

/// A file and what continues it.
type Parts = Vec<Box<dyn Source>>;

/// Reads a family of files; one result per section.
type ReadSections = fn(&[Box<dyn Source>], &Selection) -> io::Result<Vec<SolverFile>>;

enum Reader {
    /// Lines of text. A signature is a line below the header that shows the kind.
    Text {
        signature: fn(&[u8]) -> bool,
        read: fn(&dyn Source, &Selection) -> io::Result<SolverFile>,
    },
    /// Bytes, told by the first of them; over one or several files; sections inside.
    Binary { recognises: fn(&[u8]) -> bool, read: ReadSections },
}

const fn text(
    name: &'static str,
    signature: fn(&[u8]) -> bool,
    read: fn(&dyn Source, &Selection) -> io::Result<SolverFile>,
) -> Format {
    Format { name, reader: Reader::Text { signature, read } }
}

/// Every file we read. To add one: write its module, add its line here.
pub const FORMATS: &[Format] = &[
    text("nodout", lsdyna::nodout::signature, lsdyna::nodout::read),
    text("rcforc", lsdyna::rcforc::signature, lsdyna::rcforc::read),
    text("rwforc", lsdyna::rwforc::signature, lsdyna::rwforc::read),
    text("secforc", lsdyna::secforc::signature, lsdyna::secforc::read),
    text("glstat", lsdyna::glstat::signature, lsdyna::glstat::read),
    text("matsum", lsdyna::matsum::signature, lsdyna::matsum::read),
    text("spcforc", lsdyna::spcforc::signature, lsdyna::spcforc::read),
    text("bndout", lsdyna::bndout::signature, lsdyna::bndout::read),
    text("sleout", lsdyna::sleout::signature, lsdyna::sleout::read),
    text("swforc", lsdyna::swforc::signature, lsdyna::swforc::read),
    text("abstat", lsdyna::abstat::signature, lsdyna::abstat::read),
    text("curvout", lsdyna::curvout::signature, lsdyna::curvout::read),
    text("deforc", lsdyna::deforc::signature, lsdyna::deforc::read),
    text("jntforc", lsdyna::jntforc::signature, lsdyna::jntforc::read),
    text("rbdout", lsdyna::rbdout::signature, lsdyna::rbdout::read),
    text("nodfor", lsdyna::nodfor::signature, lsdyna::nodfor::read),
    // Before elout, whose name begins the same.
    text("eloutdet", lsdyna::elout::signature_of_details, lsdyna::elout::read_details),
    text("elout", lsdyna::elout::signature, lsdyna::elout::read),
    Format {
        name: "binout",
        reader: Reader::Binary {
            recognises: lsdyna::binout::recognises,
            read: lsdyna::binout::read,
        },
    },
    Format {
        name: "t01",
        reader: Reader::Binary { recognises: openradioss::recognises, read: openradioss::read },
    },
];

impl Format {
    fn is_signature(&self, line: &[u8]) -> bool {
        match self.reader {
            Reader::Text { signature, .. } => signature(line),
            Reader::Binary { .. } => false,
        }
    }

    fn is_binary(&self) -> bool {
        matches!(self.reader, Reader::Binary { .. })
    }

    fn recognises(&self, head: &[u8]) -> bool {
        match self.reader {
            Reader::Text { .. } => false,
            Reader::Binary { recognises, .. } => recognises(head),
        }
    }

    /// One result per section; a text file is one section.
    fn read(
        &self,
        parts: &[Box<dyn Source>],
        selection: &Selection,
    ) -> io::Result<Vec<SolverFile>> {
        let mut sections = match (&self.reader, parts) {
            (Reader::Text { read, .. }, [first, ..]) => vec![read(&**first, selection)?],
            (Reader::Text { .. }, []) => Vec::new(),
            (Reader::Binary { read, .. }, parts) => read(parts, selection)?,
        };
        for section in &mut sections {
            section.problems.extend(problem::of_time(&section.time));
        }
        Ok(sections)
    }
}

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
    /// Section of a binary file, such as `nodout` or `rwforc/forces`; `None` for all.
    pub section: Option<String>,
    /// How the file's bytes are read.
    pub access: Access,
}

impl Selection {
    /// Every history of the file.
    pub fn all() -> Self {
        Self::default()
    }

    /// No history: only what the file says of itself, and all its problems.
    pub fn nothing() -> Self {
        Self { ids: Some(Vec::new()), components: Some(Vec::new()), audit: true, ..Self::default() }
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
    /// Section of a binary file; of a text file its format's name.
    pub section: String,
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
    /// What was done to the file's values, such as differentiating impulses.
    pub notes: Vec<String>,
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
    #[error("{path}: this is no {format}: it looks like a {looks_like}, read it as that")]
    OtherFormat { path: PathBuf, format: String, looks_like: &'static str },
    #[error("{path}: this is a folder: name a file in it{files}")]
    Folder { path: PathBuf, files: String },
    #[error(
        "{path}: this is a keyword deck, which holds no histories; crumple inspect shows what it says of its run"
    )]
    Deck { path: PathBuf },
    #[error(
        "{path}: it has several sections: select one of {known} (with --section; in a recipe the section's name is the file's)"
    )]
    SeveralSections { path: PathBuf, known: String },
    #[error("{path}: it has no section \"{section}\": it has {known}")]
    NoSuchSection { path: PathBuf, section: String, known: String },
    #[error("there is no format \"{name}\": the readers take {known}")]
    NoSuchFormat { name: String, known: String },
    #[error("{path}: {format} has no {what} {id}: {near}", what = entity_word(format))]
    NoSuchEntity { path: PathBuf, format: String, id: WantedId, near: String },
    #[error(
        "{path}: interface {id} is a single-surface contact, for which LS-DYNA prints no resultants: ask for a two-sided contact or a force transducer ({with_data})"
    )]
    SingleSurface { path: PathBuf, id: i64, with_data: String },
    #[error("{path}: {format} has no component \"{component}\": it has {known}")]
    NoSuchComponent { path: PathBuf, format: String, component: String, known: String },
}

/// What an id of this format counts, for messages.
fn entity_word(format: &str) -> &'static str {
    match format {
        "nodout" => "node",
        "rwforc" | "rwforc/forces" => "rigid wall",
        "secforc" => "section",
        "matsum" => "part",
        "rcforc" | "sleout" => "interface",
        "spcforc" | "bndout" | "nodfor" | "eloutdet" => "node",
        "elout" | "deforc" => "element",
        "swforc" => "weld",
        "abstat" => "airbag",
        "jntforc" => "joint",
        "rbdout" => "rigid body",
        "curvout" => "curve",
        _ => "entity",
    }
}

/// The formats' names, for messages: `nodout, rcforc, …`.
pub fn format_names() -> String {
    FORMATS.iter().map(|f| f.name).collect::<Vec<_>>().join(", ")
}

/// Reads the selected histories of the file at `path`, of one section.
///
/// `format` names the kind of file; without it the kind is told by the content and,
/// for a file that ends after its header, by the name of the file or of its folder.
///
/// # Errors
/// [`ReadError`] if the file cannot be opened, its kind is not known, it has several
/// sections and none is selected, or a selected section, id or component is not in it.
/// Damage within the file is no error: see [`SolverFile::problems`].
pub fn read(
    path: &Path,
    format: Option<&str>,
    selection: &Selection,
) -> Result<SolverFile, ReadError> {
    let mut sections = read_sections(path, format, selection)?;
    if sections.len() > 1 {
        return Err(ReadError::SeveralSections { path: path.into(), known: listed(&sections) });
    }
    match sections.pop() {
        Some(file) => {
            check_selection(path, &file, selection)?;
            Ok(file)
        }
        None => Err(ReadError::NoSuchSection {
            path: path.into(),
            section: selection.section.clone().unwrap_or_default(),
            known: if path.is_file() {
                let names =
                    Selection { audit: false, access: selection.access, ..Selection::nothing() };
                listed(&read_sections(path, format, &names)?)
            } else {
                "others".into()
            },
        }),
    }
}

fn listed(sections: &[SolverFile]) -> String {
    sections.iter().map(|s| s.section.as_str()).collect::<Vec<_>>().join(", ")
}

/// Reads the selected histories of every section of the file at `path`, or of the one
/// selected. Ids and components are not held against what a section has.
///
/// # Errors
/// [`ReadError`] if the file cannot be opened or its kind is not known.
pub fn read_sections(
    path: &Path,
    format: Option<&str>,
    selection: &Selection,
) -> Result<Vec<SolverFile>, ReadError> {
    let io = |source| ReadError::Io { path: path.into(), source };
    let is_forced = format.is_some();
    let (format, parts) = open(path, format, selection)?;
    let mut sections = format.read(&parts, selection).map_err(io)?;
    if is_forced {
        check_format(path, format, &*parts[0], &sections)?;
    }
    let mut head = [0; 16];
    let count = source::fill_at(&*parts[0], 0, &mut head).map_err(io)?;
    let is_container = lsdyna::binout::recognises(&head[..count]);
    if let Some(missing) = missing_continuation(path).filter(|_| format.is_binary()) {
        let message =
            format!("{missing} is not there, so that what continues behind it is not read");
        let problem = Problem::new(ProblemCode::CutRecord, message);
        sections.iter_mut().for_each(|section| section.problems.push(problem.clone()));
    }
    if !format.is_binary() || !sections.is_empty() || selection.section.is_some() {
        return Ok(sections);
    }
    Err(ReadError::UnknownFormat {
        path: path.into(),
        looks_like: match format.name {
            "binout" if is_container => {
                "this is an LSDA container, but it has no section of a binout"
            }
            "binout" => "this is no LSDA container",
            _ => "it has no history that is read",
        }
        .into(),
        known: format_names(),
    })
}

/// Opens a file and what continues it.
fn open(
    path: &Path,
    format: Option<&str>,
    selection: &Selection,
) -> Result<(&'static Format, Parts), ReadError> {
    let io = |source| ReadError::Io { path: path.into(), source };
    if path.is_dir() {
        return Err(ReadError::Folder { path: path.into(), files: files_in(path) });
    }
    // Before the first is opened: its size is then fixed, and what a run wrote into a
    // continuation that began later would stand behind a hole.
    let family = family(path);
    let first = source::open(path, selection.access).map_err(io)?;
    let format = match format {
        Some(name) => named(name)?,
        None => detect(path, &*first)?,
    };
    let mut parts = vec![first];
    if format.is_binary() {
        for part in family.into_iter().skip(1) {
            parts.push(source::open(&part, selection.access).map_err(io)?);
        }
    }
    Ok((format, parts))
}

/// Holds a named format against what the file looks like, if nothing was read by it.
fn check_format(
    path: &Path,
    format: &Format,
    source: &dyn Source,
    sections: &[SolverFile],
) -> Result<(), ReadError> {
    if sections.iter().any(|s| !s.time.is_empty()) {
        return Ok(());
    }
    match look_at(path, source)? {
        (Some(found), _) if found.name != format.name => Err(ReadError::OtherFormat {
            path: path.into(),
            format: format.name.into(),
            looks_like: found.name,
        }),
        // A file that ends after its header tells no format, nor does one that has just begun.
        (None, false) if source.size().is_ok_and(|size| size > 0) => {
            Err(ReadError::UnknownFormat {
                path: path.into(),
                looks_like: NOT_RECOGNISED.into(),
                known: format_names(),
            })
        }
        _ => Ok(()),
    }
}

/// The files of a folder that are named like a solver's, for messages: `, such as nodout`.
fn files_in(folder: &Path) -> String {
    const LOOKED_AT: usize = 1_000;
    let entries = folder.read_dir().into_iter().flatten().filter_map(Result::ok);
    let mut named: Vec<String> = entries
        .take(LOOKED_AT)
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .filter(|name| name.ends_with(T01) || FORMATS.iter().any(|f| name.starts_with(f.name)))
        .collect();
    named.sort();
    named.truncate(3);
    if named.is_empty() { String::new() } else { format!(", such as {}", named.join(" or ")) }
}

/// How OpenRadioss names its time history: the run's name and this.
const T01: &str = "T01";

/// Opens the file at `path` for reading state by state, if it is a nodout without damage
/// that is laid out evenly; [`read`] takes any other.
///
/// # Errors
/// As [`read`].
pub fn blocks(
    path: &Path,
    format: Option<&str>,
    selection: &Selection,
) -> Result<Option<Blocks>, ReadError> {
    let (format, mut parts) = open(path, format, selection)?;
    let Some(source) = parts.pop().filter(|_| format.name == "nodout") else { return Ok(None) };
    let io = |source| ReadError::Io { path: path.into(), source };
    let blocks = Blocks::open(source, selection).map_err(io)?;
    if let Some(blocks) = &blocks {
        check_selection(path, &blocks.file, selection)?;
    }
    Ok(blocks)
}

/// Reads the selected histories of every section from sources: a file and, of a binary
/// format, its continuations.
///
/// Unlike [`read`], it does not hold the selection against what the file has.
///
/// # Errors
/// [`ReadError::NoSuchFormat`] if there is no such format, or [`ReadError::Io`] (without a
/// path) from a source.
pub fn read_from(
    format: &str,
    parts: &[Box<dyn Source>],
    selection: &Selection,
) -> Result<Vec<SolverFile>, ReadError> {
    let io = |source| ReadError::Io { path: PathBuf::new(), source };
    named(format)?.read(parts, selection).map_err(io)
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

fn detect(path: &Path, source: &dyn Source) -> Result<&'static Format, ReadError> {
    let (by_content, is_lsdyna) = look_at(path, source)?;
    if let Some(format) = by_content {
        return Ok(format);
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
        _ => Err(ReadError::UnknownFormat {
            path: path.into(),
            looks_like: match is_lsdyna {
                true => "this is an LS-DYNA text file of a kind that is not read, or one that ends after its header",
                false => NOT_RECOGNISED,
            }
            .into(),
            known: format_names(),
        }),
    }
}

const NOT_RECOGNISED: &str = "no solver output is recognised in it";

/// The format that the content tells, and whether it has the header of LS-DYNA's text files.
fn look_at(path: &Path, source: &dyn Source) -> Result<(Option<&'static Format>, bool), ReadError> {
    let io = |source| ReadError::Io { path: path.into(), source };
    let unknown = |looks_like: &str| ReadError::UnknownFormat {
        path: path.into(),
        looks_like: looks_like.into(),
        known: format_names(),
    };
    let mut head = Vec::new();
    Stream::new(source).take(16).read_to_end(&mut head).map_err(io)?;
    if head.starts_with(b"\x89HDF\r\n\x1a\n") {
        return Err(unknown("this is an HDF5 file"));
    }
    if let Some(what) = source::encoded(&head) {
        return Err(unknown(what));
    }
    if let Some(format) = FORMATS.iter().find(|f| f.recognises(&head)) {
        return Ok((Some(format), false));
    }
    let is_named_t01 = path.file_name().is_some_and(|n| n.to_string_lossy().ends_with(T01));
    if is_named_t01 && !head.is_empty() {
        return Err(unknown("it is named like a T01, but does not begin like one: is it damaged?"));
    }
    let mut lines = lsdyna::line::Lines::new(Stream::new(source));
    let mut is_lsdyna = false;
    while let Some(line) = lines.next_line().map_err(io)? {
        if line.number > DETECT_LINES {
            return Err(unknown(NOT_RECOGNISED));
        }
        if lsdyna::deck::signature(line.text) {
            return Err(ReadError::Deck { path: path.into() });
        }
        is_lsdyna |= line.number == 2 && lsdyna::header::version(line.text).is_some();
        if line.number <= 2 {
            continue;
        }
        // Titles in a legend are free text, but none begins like a line of a body, whose
        // signature also ends a legend that lost its closing line.
        if let Some(format) = FORMATS.iter().find(|f| f.is_signature(line.text)) {
            return Ok((Some(format), is_lsdyna));
        }
    }
    Ok((None, is_lsdyna))
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
            format: file.section.clone(),
            id: *wanted,
            near: near_ids(file, wanted.id),
        });
    }
    for wanted in selection.components.iter().flatten() {
        if !file.components.iter().any(|c| **c == **wanted) {
            return Err(ReadError::NoSuchComponent {
                path: path.into(),
                format: file.section.clone(),
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
