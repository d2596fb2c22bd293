//! `deforc`: forces of discrete elements (springs and dampers).

use std::io;

use super::ascii;
use super::dotted::{self, Dotted};
use crate::solver::source::Source;
use crate::solver::{Selection, SolverFile};

const ENTITIES: &[&str] = &["spring/damper number"];

pub(crate) fn signature(line: &[u8]) -> bool {
    dotted::label(line).is_some_and(|label| ENTITIES.contains(&label))
}

pub(crate) fn read(source: &dyn Source, selection: &Selection) -> io::Result<SolverFile> {
    ascii::read("deforc", source, selection, || Dotted::new(ENTITIES))
}
