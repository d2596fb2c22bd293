//! `binout`: LS-DYNA's binary histories, an LSDA container.
//!
//! First all records are noted with their places ([`records`]), then the selected values
//! are read: for each section its metadata ([`metadata`]), its complete states
//! ([`states`]), the owners of its component values ([`owners`]) and the values
//! ([`values`]).
//!
//! A file that continues as `name%001`, `name%002`, … and the files `binout0000`,
//! `binout0001`, … of the processes of one run are one tree over several containers.
//!
//! Any directory with states is a section, whatever its name; other content of the container is listed.
//!
//! If a record occurs twice, the later one counts: a restart wrote it again. Entities
//! may differ between states (eroded elements): a state that lacks one has NaN there.
//!
//! A binout is walked record by record without its symbol tables, because a run that terminated early has not written them. The
//! walk only notes where records are, from 64 bytes each; then the selected values are read. The ids of a section apply
//! to the states written after them, until others are written. The file has no checksums: flipped bits within a
//! value cannot be detected.

mod owners;
mod records;
mod section;
mod states;
mod values;

use std::io;

use super::lsda::Header;
use crate::plural::counted;
use crate::solver::Format;
use crate::solver::problem::{Problem, ProblemCode};
use crate::solver::source::Source;
use crate::solver::{Selection, SolverFile};
use records::Bytes;
use records::{Section, Tree};
use section::SectionReader;

pub(crate) const FORMAT: Format = Format::binary("binout", recognises, read);

/// Whether a file begins with the header of an LSDA container.
pub(crate) fn recognises(head: &[u8]) -> bool {
    Header::parse(head).is_some()
}

/// Reads the selected histories of every section, or of the one selected. Empty if the container
/// has no section of histories: other data have no states with times.
fn read(parts: &[Box<dyn Source>], selection: &Selection) -> io::Result<Vec<SolverFile>> {
    let mut tree = Tree::default();
    for (number, part) in parts.iter().enumerate() {
        tree.walk(number, &**part)?;
    }
    let wanted = |name: &str| selection.section.as_ref().is_none_or(|s| s == name);
    let bytes = Bytes::new(parts, &tree.headers);
    // Damaged records concern all sections: what they held is not known.
    let common = std::mem::take(&mut tree.problems).into_list();
    let has_times = |s: &Section| s.component("time").is_some();
    let is_binout = |s: &Section| has_times(s) || s.states.is_empty();
    if !tree.sections.iter().any(is_binout) {
        return Ok(Vec::new());
    }
    let mut files = Vec::new();
    for section in tree.sections.iter().filter(|s| wanted(&s.name)) {
        let (mut file, problems) = SectionReader::open(section, bytes, selection)?.read()?;
        file.problems = common.iter().cloned().chain(problems.into_list()).collect();
        files.push(file);
    }
    let others = tree.others.iter().filter(|(name, _)| wanted(name));
    files.extend(others.map(|(name, &records)| unread(name, records)));
    Ok(files)
}

/// A directory whose data are not histories.
fn unread(name: &str, records: usize) -> SolverFile {
    let message = format!(
        "{name}: {} not read: they are not in states (d000001, d000002, …) with times",
        counted(records, "record")
    );
    SolverFile {
        format: FORMAT.name,
        section: name.into(),
        problems: vec![Problem::new(ProblemCode::UnreadRows, message)],
        ..SolverFile::default()
    }
}
