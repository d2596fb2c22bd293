//! Solver files: from bytes to [`History`](crate::history::History).
//!
//! A reader takes a [`Source`] and a [`Selection`], returns a [`SolverFile`], and treats
//! damage as part of the result ([`Problem`]): complete states are returned, missing
//! parts are named. It never prints, panics, or holds more than was selected.
//!
//! ```
//! use crumple::solver::{Selection, read};
//! use std::path::{Path, PathBuf};
//!
//! let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/fe/lead-car-wall/36kmh/nodout");
//! let selection = Selection {
//!     ids: Some(vec!["900001".parse()?]),
//!     components: Some(vec!["x_velocity".into()]),
//!     ..Selection::all()
//! };
//! let file = read(&path, None, &selection)?;
//! assert_eq!((file.histories.len(), file.time.len()), (1, 400));
//! // In the solver's units: mm/s.
//! assert_eq!(file.histories[0].values[0], -10_000.0);
//! assert!(file.problems.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod blocks;
pub(crate) mod decks;
mod detect;
pub(crate) mod lsdyna;
mod openradioss;
mod problem;
pub(crate) mod runs;
mod selection;
pub(crate) mod source;
mod states;
mod zeros;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::error::{Error, error};
use crate::guess;
pub use blocks::{Blocks, Column};
pub use decks::read_deck;
pub use detect::formats;
pub(crate) use detect::{Format, entity_word, format_names, is_named_like_binary, without_job_id};
use detect::{check_format, detect, files_in, named};
pub use lsdyna::deck::context::Value;
pub use lsdyna::deck::{
    Deck, DeckEntity, DeckInclude, DeckOutput, DeckPlace, StatedUnits, parse_deck,
};
pub use problem::{Problem, ProblemCode};
pub(crate) use runs::family;
use runs::missing_continuation;
pub use runs::output_files;
pub(crate) use runs::unread_restart;
use selection::check_selection;
pub(crate) use selection::no_component;
pub use selection::{Entity, NoDataReason, Selection, SolverFile, WantedId, WithoutData};
pub use source::{Access, Source};

/// Reads the selected histories of the file at `path`, of one section.
///
/// `format` names the kind of file; without it the kind is recognised by the content and,
/// for a file that ends after its header, by the name of the file or of its folder.
///
/// # Errors
/// If the file cannot be opened, its kind is not known, it has several
/// sections and none is selected, or a selected section, id or component is not in it.
/// Damage within the file is not an error: see [`SolverFile::problems`].
pub fn read(path: &Path, format: Option<&str>, selection: &Selection) -> Result<SolverFile, Error> {
    let mut sections = sections_of(path, format, selection)?;
    if sections.len() > 1 {
        return Err(error!(
            SolverFile,
            "{}: it has several sections: select one of {} (with --section; in a recipe the section's name is the file's)",
            path.display(),
            listed(&sections)
        ));
    }
    match sections.pop() {
        Some(file) => {
            check_selection(path, &file, selection)?;
            Ok(file)
        }
        None => {
            let section = selection.section.as_deref().unwrap_or_default();
            let known = if path.is_file() {
                let names =
                    Selection { audit: false, access: selection.access, ..Selection::nothing() };
                listed(&read_sections(path, format, &names)?)
            } else {
                "others".into()
            };
            let hint = guess::hint(section, &known);
            Err(error!(
                SolverFile,
                "{}: it has no section \"{section}\": it has {known}{hint}",
                path.display()
            ))
        }
    }
}

fn listed(sections: &[SolverFile]) -> String {
    sections.iter().map(|s| s.section.as_str()).collect::<Vec<_>>().join(", ")
}

/// Reads the selected histories of every section of the file at `path`, or of the one
/// selected. Each id and component must be in one section at least.
///
/// # Errors
/// If the file cannot be opened or its kind is not known.
pub fn read_sections(
    path: &Path,
    format: Option<&str>,
    selection: &Selection,
) -> Result<Vec<SolverFile>, Error> {
    let sections = sections_of(path, format, selection)?;
    match &sections[..] {
        [] => {}
        [section] => check_selection(path, section, selection)?,
        _ if selection.ids.is_none() && selection.components.is_none() => {}
        several => check_selection(path, &joined(several), selection)?,
    }
    Ok(sections)
}

/// The same without holding the selection against what the sections have.
fn sections_of(
    path: &Path,
    format: Option<&str>,
    selection: &Selection,
) -> Result<Vec<SolverFile>, Error> {
    let io = |source| Error::io(path, source);
    let is_forced = format.is_some();
    let family = family(path)?;
    let (format, parts) = open(&family, format, selection)?;
    let mut sections = format.read(&parts, selection).map_err(io)?;
    for problem in sections.iter_mut().flat_map(|section| &mut section.problems) {
        let continues = family.get(problem.part).filter(|_| problem.part > 0);
        problem.file = continues.map(|path| runs::name_of(path));
    }
    if is_forced {
        check_format(path, format, &*parts[0], &sections)?;
    }
    let mut head = [0; 16];
    let count = source::fill_at(&*parts[0], 0, &mut head).map_err(io)?;
    let is_container = lsdyna::binout::recognises(&head[..count]);
    if let Some(problem) = unread_beside(path, format)? {
        sections.iter_mut().for_each(|section| section.problems.push(problem.clone()));
    }
    if !format.is_binary() || !sections.is_empty() || selection.section.is_some() {
        return Ok(sections);
    }
    let looks_like = match format.name {
        "binout" if is_container => "this is an LSDA container, but it has no section of a binout",
        "binout" => "this is not an LSDA container",
        _ => "it has no history that is read",
    };
    Err(unknown_format(path, looks_like))
}

/// Of files that continue this one, what is not read.
fn unread_beside(path: &Path, format: &Format) -> Result<Option<Problem>, Error> {
    let (code, message) = match format.is_binary() {
        true => (ProblemCode::CutRecord, missing_continuation(path)?),
        false => (ProblemCode::UnreadRows, unread_restart(path)),
    };
    Ok(message.map(|message| Problem::new(code, message)))
}

/// What can be selected from several sections.
fn joined(sections: &[SolverFile]) -> SolverFile {
    let (mut ids, mut names) = (BTreeSet::new(), BTreeSet::new());
    let entities = sections.iter().flat_map(|s| &s.entities);
    let components = sections.iter().flat_map(|s| &s.components);
    let longest = sections.iter().map(|s| &s.time).max_by_key(|time| time.len());
    SolverFile {
        section: "the file".into(),
        entities: entities.filter(|entity| ids.insert(entity.id)).cloned().collect(),
        without_data: sections.iter().flat_map(|s| s.without_data.iter().cloned()).collect(),
        components: components.filter(|name| names.insert(&***name)).cloned().collect(),
        time: longest.cloned().unwrap_or_default(),
        ..SolverFile::default()
    }
}

/// The error of a file that no reader knows.
fn unknown_format(path: &Path, looks_like: impl std::fmt::Display) -> Error {
    let (path, known) = (path.display(), format_names());
    error!(SolverFile at "format", "{path}: {looks_like}: the readers take {known}")
}

type Parts = Vec<Box<dyn Source>>;

/// Opens a file and what continues it. They are looked for before the first is opened: its size is then fixed, and what a run wrote
/// into a continuation that began later would be after a hole.
fn open(
    family: &[PathBuf],
    format: Option<&str>,
    selection: &Selection,
) -> Result<(&'static Format, Parts), Error> {
    let path = &family[0];
    let io = |source| Error::io(path, source);
    if path.is_dir() {
        return Err(error!(
            SolverFile,
            "{}: this is a folder: name a file in it{}",
            path.display(),
            files_in(path)
        ));
    }
    let first = source::open(path, selection.access).map_err(io)?;
    let format = match format {
        Some(name) => named(name)?,
        None => detect(path, &*first)?,
    };
    if let Some(section) = selection.section.as_deref().filter(|name| *name != format.name)
        && !format.is_binary()
    {
        return Err(error!(
            SolverFile,
            "{}: it has no section \"{section}\": it is a text file with the one section \"{}\"",
            path.display(),
            format.name
        ));
    }
    let mut parts = vec![first];
    if format.is_binary() {
        for part in &family[1..] {
            parts.push(source::open(part, selection.access).map_err(io)?);
        }
    }
    Ok((format, parts))
}

/// Whether a solver has written the file at `path`, by its content.
pub(crate) fn is_output(path: &Path) -> bool {
    let source = source::open(path, Access::Plain);
    source.is_ok_and(|source| detect(path, &*source).is_ok())
}

/// Opens the file at `path` for reading state by state, if it is an LS-DYNA file without damage
/// that is laid out evenly; [`read`] takes any other.
///
/// # Errors
/// As [`read`].
pub fn blocks(
    path: &Path,
    format: Option<&str>,
    selection: &Selection,
) -> Result<Option<Blocks>, Error> {
    let (format, parts) = open(&family(path)?, format, selection)?;
    if unread_beside(path, format)?.is_some() {
        return Ok(None);
    }
    let io = |source| Error::io(path, source);
    let blocks = format.blocks(parts, selection).map_err(io)?;
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
/// If there is no such format, or a source cannot be read (without a path).
pub fn read_from(
    format: &str,
    parts: &[Box<dyn Source>],
    selection: &Selection,
) -> Result<Vec<SolverFile>, Error> {
    let io = |source| Error::io(Path::new(""), source);
    named(format)?.read(parts, selection).map_err(io)
}
