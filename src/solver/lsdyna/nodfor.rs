//! `nodfor`: forces of groups of nodes.
//!
//! Never seen with data; read as the source of LSTC's converter `l2a` writes it. A group is
//! numbered by its order, not by the id of its node set.

use std::io;

use super::ascii;
use super::line::integer;
use super::node_forces::{Layout, NodeForces};
use crate::solver::source::Source;
use crate::solver::{Selection, SolverFile};

const LAYOUT: Layout =
    Layout { state: b" n o d a l   f o r c e   g r o u p    o u t p u t", block: heading };
const GROUP: &[u8] = b" nodal group output number";

fn heading(line: &[u8]) -> Option<String> {
    let number = integer(line.strip_prefix(GROUP)?)?;
    Some(format!("group{number}"))
}

pub(crate) fn signature(line: &[u8]) -> bool {
    line.starts_with(LAYOUT.state)
}

pub(crate) fn read(source: &dyn Source, selection: &Selection) -> io::Result<SolverFile> {
    ascii::read("nodfor", source, selection, || NodeForces::new(&LAYOUT))
}
