//! `nodfor`: forces of groups of nodes.
//!
//! Never tested with real data; read as the source of LSTC's converter `l2a` writes it. A group is
//! numbered by its order, not by the id of its node set.

use super::ascii;
use super::line::integer;
use super::node_forces::{Layout, NodeForces};
use crate::solver::format::Format;

const LAYOUT: Layout = Layout {
    time_digits: 4,
    state: b" n o d a l   f o r c e   g r o u p    o u t p u t",
    block: heading,
};
const GROUP: &[u8] = b" nodal group output number";

fn heading(line: &[u8]) -> Option<String> {
    let number = integer(line.strip_prefix(GROUP)?)?;
    Some(format!("group{number}"))
}

fn signature(line: &[u8]) -> bool {
    line.starts_with(LAYOUT.state)
}

pub(crate) const FORMAT: Format =
    Format::text("nodfor", "node", signature, |format, source, selection| {
        ascii::read(format, source, selection, || NodeForces::new(&LAYOUT))
    });
