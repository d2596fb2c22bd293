//! The kinds of files that are read: how each is recognised, and what reads it.

use std::io;

use super::problem;
use super::source::Source;
use super::{ReadError, Selection, SolverFile, lsdyna, openradioss};

/// One kind of file: its name, how to recognise it, how to read it.
pub struct Format {
    /// Named as the solver names the file.
    pub name: &'static str,
    reader: Reader,
}

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

/// The formats' names, for messages: `nodout, rcforc, …`.
pub(crate) fn format_names() -> String {
    FORMATS.iter().map(|f| f.name).collect::<Vec<_>>().join(", ")
}

pub(super) fn named(name: &str) -> Result<&'static Format, ReadError> {
    FORMATS
        .iter()
        .find(|f| f.name == name)
        .ok_or_else(|| ReadError::NoSuchFormat { name: name.into(), known: format_names() })
}
