//! The kinds of files that are read, and which one a file is: recognised by its content, and by its name where that is not enough.

use std::io::{self, Read};
use std::path::Path;

use super::blocks::Blocks;
use super::lsdyna::ascii::{self, Body};
use super::lsdyna::blocks;
use super::runs::restart_number;
use super::source::{self, Source, Stream};
use super::{Selection, SolverFile, lsdyna, openradioss, problem, unknown_format};
use crate::error::{Error, error};
use crate::guess;

/// One kind of file: its name, how to recognise it, how to read it.
pub(crate) struct Format {
    /// Named as the solver names the file.
    pub name: &'static str,
    /// Kind of its entities, for messages.
    pub(super) entity: &'static str,
    /// Whether a line below the header of a text file, or the first bytes of a binary one, show the kind.
    signature: fn(&[u8]) -> bool,
    reader: Reader,
}

/// Reads a family of files; one result per section.
type ReadSections = fn(&[Box<dyn Source>], &Selection) -> io::Result<Vec<SolverFile>>;
type OpenBlocks = fn(Vec<Box<dyn Source>>, &Selection) -> io::Result<Option<Blocks>>;

enum Reader {
    /// Lines of text, read by this.
    Text(fn() -> Box<dyn Body>),
    /// Bytes, recognised by the first of them; over one or several files; sections inside.
    Binary(ReadSections, OpenBlocks),
}

impl Format {
    pub(super) const fn text(
        name: &'static str,
        entity: &'static str,
        body: fn() -> Box<dyn Body>,
        signature: fn(&[u8]) -> bool,
    ) -> Self {
        Self { name, entity, signature, reader: Reader::Text(body) }
    }

    pub(super) const fn binary(
        name: &'static str,
        signature: fn(&[u8]) -> bool,
        read: ReadSections,
        blocks: OpenBlocks,
    ) -> Self {
        Self { name, entity: "entity", signature, reader: Reader::Binary(read, blocks) }
    }

    pub(super) fn is_signature(&self, line: &[u8]) -> bool {
        !self.is_binary() && (self.signature)(line)
    }

    pub(super) fn recognises(&self, head: &[u8]) -> bool {
        self.is_binary() && (self.signature)(head)
    }

    pub(super) fn is_binary(&self) -> bool {
        matches!(self.reader, Reader::Binary(..))
    }

    /// The states of a file one by one, if they are laid out evenly.
    pub(super) fn blocks(
        &'static self,
        parts: Vec<Box<dyn Source>>,
        selection: &Selection,
    ) -> io::Result<Option<Blocks>> {
        match self.reader {
            Reader::Text(body) => blocks::open(self, &*body(), parts, selection),
            Reader::Binary(_, open) => open(parts, selection),
        }
    }

    /// One result per section; a text file is one section.
    pub(super) fn read(
        &'static self,
        parts: &[Box<dyn Source>],
        selection: &Selection,
    ) -> io::Result<Vec<SolverFile>> {
        let mut sections = match (&self.reader, parts) {
            (Reader::Text(body), [first, ..]) => {
                vec![ascii::read(self, &*body(), &**first, selection)?]
            }
            (Reader::Text(_), []) => Vec::new(),
            (Reader::Binary(read, _), parts) => read(parts, selection)?,
        };
        for section in &mut sections {
            section.problems.extend(problem::of_time(&section.time));
        }
        Ok(sections)
    }
}

/// All files we read, in the order in which their signatures are tried. To add one: write its
/// module with its `FORMAT`, and add that here.
pub(crate) const FORMATS: &[Format] = &[
    lsdyna::nodout::FORMAT,
    lsdyna::rcforc::FORMAT,
    lsdyna::rwforc::FORMAT,
    lsdyna::secforc::FORMAT,
    lsdyna::glstat::FORMAT,
    lsdyna::matsum::FORMAT,
    lsdyna::spcforc::FORMAT,
    lsdyna::node_forces::BNDOUT,
    lsdyna::sleout::FORMAT,
    lsdyna::swforc::FORMAT,
    lsdyna::abstat::FORMAT,
    lsdyna::curvout::FORMAT,
    lsdyna::dotted::DEFORC,
    lsdyna::dotted::JNTFORC,
    lsdyna::rbdout::FORMAT,
    lsdyna::node_forces::NODFOR,
    // Before elout, whose name begins the same.
    lsdyna::elout::DETAILS,
    lsdyna::elout::FORMAT,
    lsdyna::binout::FORMAT,
    openradioss::FORMAT,
];

/// Kind of entity of this format or section, for messages.
pub(crate) fn entity_word(section: &str) -> &'static str {
    let name = section.strip_suffix("/forces").unwrap_or(section);
    FORMATS.iter().find(|format| format.name == name).map_or("entity", |format| format.entity)
}

/// The names of the formats that are read, such as `nodout`.
pub fn formats() -> impl Iterator<Item = &'static str> {
    FORMATS.iter().map(|f| f.name)
}

/// The same for messages: `nodout, rcforc, …`.
pub(crate) fn format_names() -> String {
    formats().collect::<Vec<_>>().join(", ")
}

pub(super) fn named(name: &str) -> Result<&'static Format, Error> {
    FORMATS.iter().find(|f| f.name == name).ok_or_else(|| {
        let known = format_names();
        let hint = guess::hint(name, &known);
        error!(Usage, "there is no format \"{name}\": the readers take {known}{hint}")
    })
}

/// Lines examined before a file counts as unknown: more than the longest legend seen,
/// few enough that a large foreign file is refused at once.
const DETECT_LINES: u64 = 100_000;

pub(super) fn detect(path: &Path, source: &dyn Source) -> Result<&'static Format, Error> {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned());
    let name = name.as_deref().map(without_job_id);
    let by_own_name = FORMATS.iter().find(|f| name == Some(f.name));
    let (by_content, is_lsdyna) = look_at(path, source, by_own_name)?;
    if let Some(format) = by_content.or(by_own_name) {
        return Ok(format);
    }
    let by_name = path.iter().rev().take(2).find_map(|part| {
        let part = part.to_string_lossy().to_ascii_lowercase();
        FORMATS.iter().find(|f| without_job_id(&part).starts_with(f.name))
    });
    match by_name {
        Some(format) if is_lsdyna => Ok(format),
        _ if is_lsdyna => Err(unknown_format(
            path,
            "this is an LS-DYNA text file of a kind that is not read, or one that ends after its header",
        )),
        _ if source.size().is_ok_and(|size| size == 0) => {
            Err(unknown_format(path, "this is an empty file"))
        }
        _ => Err(unknown_format(path, NOT_RECOGNISED)),
    }
}

const NOT_RECOGNISED: &str = "no solver output is recognised in it";

/// The format found in the content, and whether it has the header of LS-DYNA's text files. Where lines of several
/// kinds are in a file, those of the kind that it is `named` by count.
fn look_at(
    path: &Path,
    source: &dyn Source,
    named: Option<&'static Format>,
) -> Result<(Option<&'static Format>, bool), Error> {
    let io = |source| Error::io(path, source);
    let unknown = |looks_like: &str| unknown_format(path, looks_like);
    let mut head = Vec::new();
    Stream::new(source).take(16).read_to_end(&mut head).map_err(io)?;
    if head.starts_with(b"\x89HDF\r\n\x1a\n") {
        return Err(unknown("this is an HDF5 file"));
    }
    if let Some(what) = source::encoded(&head) {
        return Err(error!(SolverFile at "format", "{}: {what}", path.display()));
    }
    if let Some(format) = FORMATS.iter().find(|f| f.recognises(&head)) {
        return Ok((Some(format), false));
    }
    let is_named_t01 =
        path.file_name().is_some_and(|n| restart_number(&n.to_string_lossy()) == Some(1));
    if is_named_t01 && !head.is_empty() {
        return Err(unknown("it is named like a T01, but does not begin like one: is it damaged?"));
    }
    let mut lines = lsdyna::line::Lines::new(Stream::new(source));
    let (mut is_lsdyna, mut first) = (false, None);
    while let Some(line) = lines.next_line().map_err(io)? {
        if line.number > DETECT_LINES {
            match first {
                Some(format) => return Ok((Some(format), is_lsdyna)),
                None => return Err(unknown(NOT_RECOGNISED)),
            }
        }
        if lsdyna::deck::signature(line.text) || openradioss::starter::signature(line.text) {
            let path = path.display();
            return Err(
                error!(SolverFile at "deck", "{path}: this is a deck, which holds no histories; crumple inspect shows what it says of its run"),
            );
        }
        is_lsdyna |= line.number == 2 && lsdyna::line::version(line.text).is_some();
        if line.number <= 2 {
            continue;
        }
        // Titles in a legend are free text, but none begins like a line of a body, whose
        // signature also ends a legend that lost its closing line.
        let found = FORMATS.iter().find(|f| f.is_signature(line.text));
        match (found, named) {
            // An eloutdet may hold nothing but what an elout holds.
            (Some(found), Some(named)) if named.name.starts_with(found.name) => {
                return Ok((Some(named), is_lsdyna));
            }
            (Some(found), Some(_)) => drop(first.get_or_insert(found)),
            (Some(found), None) => return Ok((Some(found), is_lsdyna)),
            (None, _) => {}
        }
    }
    Ok((first, is_lsdyna))
}

/// Compares a named format with the content of the file, if nothing was read by it.
pub(super) fn check_format(
    path: &Path,
    format: &Format,
    source: &dyn Source,
    sections: &[SolverFile],
) -> Result<(), Error> {
    if sections.iter().any(|s| !s.time.is_empty()) {
        return Ok(());
    }
    match look_at(path, source, None)? {
        (Some(found), _) if found.name != format.name => Err(error!(
            SolverFile,
            "{}: this is not a {}: it looks like a {}: read it as such",
            path.display(),
            format.name,
            found.name
        )),
        // A file that ends after its header has no recognisable format; neither has one that was just started.
        (None, false) if source.size().is_ok_and(|size| size > 0) => {
            Err(unknown_format(path, NOT_RECOGNISED))
        }
        _ => Ok(()),
    }
}

/// The files of a folder that are named like a solver's, for messages: `, such as nodout`.
pub(super) fn files_in(folder: &Path) -> String {
    const LOOKED_AT: usize = 1_000;
    let entries = folder.read_dir().into_iter().flatten().filter_map(Result::ok);
    let mut named: Vec<String> = entries
        .take(LOOKED_AT)
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .filter(|name| is_named_like_output(name))
        .collect();
    named.sort();
    named.truncate(3);
    if named.is_empty() { String::new() } else { format!(", such as {}", named.join(" or ")) }
}

/// Whether a file is named as a solver names one that can be read.
pub(crate) fn is_named_like_output(name: &str) -> bool {
    let own = without_job_id(name);
    restart_number(name).is_some() || FORMATS.iter().any(|f| own.starts_with(f.name))
}

/// The name of a file without the job id that LS-DYNA puts before it (`jobid=run7`: `run7.nodout`).
pub(crate) fn without_job_id(name: &str) -> &str {
    let is_own = |rest: &&str| {
        let numbered = rest.split('%').next().unwrap_or(rest);
        let bare = numbered.trim_end_matches(|c: char| c.is_ascii_digit());
        FORMATS.iter().any(|f| f.name == bare)
    };
    let behind_points = || name.match_indices('.').map(|(at, _)| &name[at + 1..]);
    match FORMATS.iter().any(|f| name.starts_with(f.name)) {
        true => name,
        false => behind_points().find(is_own).unwrap_or(name),
    }
}

/// Whether a file is named like the first of a binary family: a binout, or a T01.
pub(crate) fn is_named_like_binary(name: &str) -> bool {
    without_job_id(name).starts_with("binout") && !name.contains('%')
        || restart_number(name).is_some()
}
