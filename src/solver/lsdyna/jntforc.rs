//! `jntforc`: forces of joints and moments of joint stiffnesses.

use super::ascii;
use super::dotted::{self, Dotted};
use crate::solver::format::Format;

const ENTITIES: &[&str] = &["joint number", "joint ID", "joint stiffness id number"];

fn signature(line: &[u8]) -> bool {
    dotted::label(line).is_some_and(|label| ENTITIES.contains(&label))
}

pub(crate) const FORMAT: Format =
    Format::text("jntforc", "joint", signature, |format, source, selection| {
        ascii::read(format, source, selection, || Dotted::new(ENTITIES))
    });
