//! `bndout`: forces and energies of prescribed motions, pressures and discrete forces.
//!
//! Rigid bodies (`mat#`), pressures and discrete forces have only been seen in the source of
//! LSTC's converter `l2a`.

use super::ascii;
use super::node_forces::{Layout, NodeForces};
use crate::solver::format::Format;

const LAYOUT: Layout = Layout {
    time_digits: 6,
    state: b" n o d a l   f o r c e/e n e r g y    o u t p u t",
    block: heading,
};

/// Headings are "velocity boundary condition forces/…", "pressure boundary condition …",
/// "discrete nodal point forces": the first word distinguishes them.
fn heading(line: &[u8]) -> Option<String> {
    let text = std::str::from_utf8(line).ok()?;
    let first = text.split_whitespace().next()?;
    (text.contains("forces") && first.bytes().all(|b| b.is_ascii_alphabetic()))
        .then(|| first.to_ascii_lowercase())
}

fn signature(line: &[u8]) -> bool {
    line.starts_with(LAYOUT.state)
}

pub(crate) const FORMAT: Format =
    Format::text("bndout", "node", signature, |format, source, selection| {
        ascii::read(format, source, selection, || NodeForces::new(&LAYOUT))
    });
