//! The kinds of files that are read: how each is recognised, and what reads it.

use std::io;

use super::source::Source;
use super::{Selection, SolverFile, problem};

/// One kind of file: its name, how to recognise it, how to read it.
pub struct Format {
    /// Named as the solver names the file.
    pub name: &'static str,
    /// Kind of its entities, for messages.
    pub(super) entity: &'static str,
    reader: Reader,
}

/// Reads a family of files; one result per section.
type ReadSections = fn(&[Box<dyn Source>], &Selection) -> io::Result<Vec<SolverFile>>;
type ReadText = fn(&'static Format, &dyn Source, &Selection) -> io::Result<SolverFile>;

enum Reader {
    /// Lines of text. A signature is a line below the header that shows the kind.
    Text { signature: fn(&[u8]) -> bool, read: ReadText },
    /// Bytes, recognised by the first of them; over one or several files; sections inside.
    Binary { recognises: fn(&[u8]) -> bool, read: ReadSections },
}

impl Format {
    pub(super) const fn text(
        name: &'static str,
        entity: &'static str,
        signature: fn(&[u8]) -> bool,
        read: ReadText,
    ) -> Self {
        Self { name, entity, reader: Reader::Text { signature, read } }
    }

    pub(super) const fn binary(
        name: &'static str,
        recognises: fn(&[u8]) -> bool,
        read: ReadSections,
    ) -> Self {
        Self { name, entity: "entity", reader: Reader::Binary { recognises, read } }
    }

    pub(super) fn is_signature(&self, line: &[u8]) -> bool {
        match self.reader {
            Reader::Text { signature, .. } => signature(line),
            Reader::Binary { .. } => false,
        }
    }

    pub(super) fn is_binary(&self) -> bool {
        matches!(self.reader, Reader::Binary { .. })
    }

    pub(super) fn recognises(&self, head: &[u8]) -> bool {
        match self.reader {
            Reader::Text { .. } => false,
            Reader::Binary { recognises, .. } => recognises(head),
        }
    }

    /// One result per section; a text file is one section.
    pub(super) fn read(
        &'static self,
        parts: &[Box<dyn Source>],
        selection: &Selection,
    ) -> io::Result<Vec<SolverFile>> {
        let mut sections = match (&self.reader, parts) {
            (Reader::Text { read, .. }, [first, ..]) => vec![read(self, &**first, selection)?],
            (Reader::Text { .. }, []) => Vec::new(),
            (Reader::Binary { read, .. }, parts) => read(parts, selection)?,
        };
        for section in &mut sections {
            section.problems.extend(problem::of_time(&section.time));
        }
        Ok(sections)
    }
}
