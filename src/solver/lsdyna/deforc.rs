//! `deforc`: forces of discrete elements (springs and dampers).

use super::ascii;
use super::dotted::{self, Dotted};
use crate::solver::format::Format;

const ENTITIES: &[&str] = &["spring/damper number"];

fn signature(line: &[u8]) -> bool {
    dotted::label(line).is_some_and(|label| ENTITIES.contains(&label))
}

pub(crate) const FORMAT: Format =
    Format::text("deforc", "element", signature, |format, source, selection| {
        ascii::read(format, source, selection, || Dotted::new(ENTITIES))
    });
