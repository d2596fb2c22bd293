//! The kinds of files that are read: how each is recognised, and what reads it.

use std::io;

use super::source::Source;
use super::{Selection, SolverFile, problem};

/// One kind of file: its name, how to recognise it, how to read it.
pub struct Format {
    /// Named as the solver names the file.
    pub name: &'static str,
    /// What an id in it counts, for messages.
    pub(super) entity: &'static str,
    /// Whether a line below the header of a text file, or the first bytes of a binary one, show the kind.
    signature: fn(&[u8]) -> bool,
    reader: Reader,
}

/// Reads a family of files; one result per section.
type ReadSections = fn(&[Box<dyn Source>], &Selection) -> io::Result<Vec<SolverFile>>;
type ReadText = fn(&'static Format, &dyn Source, &Selection) -> io::Result<SolverFile>;

enum Reader {
    /// Lines of text.
    Text(ReadText),
    /// Bytes, over one or several files; sections inside.
    Binary(ReadSections),
}

impl Format {
    pub(super) const fn text(
        name: &'static str,
        entity: &'static str,
        signature: fn(&[u8]) -> bool,
        read: ReadText,
    ) -> Self {
        Self { name, entity, signature, reader: Reader::Text(read) }
    }

    pub(super) const fn binary(
        name: &'static str,
        signature: fn(&[u8]) -> bool,
        read: ReadSections,
    ) -> Self {
        Self { name, entity: "entity", signature, reader: Reader::Binary(read) }
    }

    pub(super) fn is_signature(&self, line: &[u8]) -> bool {
        !self.is_binary() && (self.signature)(line)
    }

    pub(super) fn recognises(&self, head: &[u8]) -> bool {
        self.is_binary() && (self.signature)(head)
    }

    pub(super) fn is_binary(&self) -> bool {
        matches!(self.reader, Reader::Binary(_))
    }

    /// One result per section; a text file is one section.
    pub(super) fn read(
        &'static self,
        parts: &[Box<dyn Source>],
        selection: &Selection,
    ) -> io::Result<Vec<SolverFile>> {
        let mut sections = match (&self.reader, parts) {
            (Reader::Text(read), [first, ..]) => vec![read(self, &**first, selection)?],
            (Reader::Text(_), []) => Vec::new(),
            (Reader::Binary(read), parts) => read(parts, selection)?,
        };
        for section in &mut sections {
            section.problems.extend(problem::of_time(&section.time));
        }
        Ok(sections)
    }
}
