//! LS-DYNA's time histories: one module per file, named as the solver names it.

pub(super) mod abstat;
pub(super) mod ascii;
pub(super) mod binout;
pub(super) mod blocks;
pub(super) mod curvout;
pub(crate) mod deck;
pub(super) mod dotted;
mod e12;
pub(super) mod elout;
pub(super) mod glstat;
pub(super) mod label_values;
mod layout;
pub(super) mod leap;
pub(super) mod line;
mod lsda;
pub(super) mod matsum;
pub(super) mod node_forces;
pub(super) mod nodout;
pub(super) mod rbdout;
pub(super) mod rcforc;
pub(super) mod rwforc;
pub(super) mod secforc;
pub(super) mod sleout;
pub(super) mod spcforc;
pub(super) mod swforc;

use super::states::StateReader;
use super::states::repeat::Part;
use line::{Line, real};

/// What is in `( at time … )` of a state's heading.
fn at_time(line: &[u8]) -> Option<&[u8]> {
    const AT: &[u8] = b"( at time";
    let from = memchr::memmem::find(line, AT)? + AT.len();
    let to = from + memchr::memchr(b')', line.get(from..)?)?;
    line.get(from..to)
}

/// Digits, point and exponent of a printed time: `0.00000E+00`.
const TIME: usize = 11;

/// The time that a heading holds; `None` if it has lost some of its `usual` columns, or of those that others have.
fn heading_time(
    text: Option<&[u8]>,
    usual: usize,
    line: &Line<'_>,
    states: &mut StateReader<'_>,
) -> Option<f64> {
    let text = text?.trim_ascii();
    states.part(line, text, Part::Time);
    let time = real(text).number()?;
    if !line::is_whole_real(text) {
        return text.iter().all(|b| !b.is_ascii_alphabetic()).then_some(time);
    }
    let width = text.strip_prefix(b"-").unwrap_or(text).len();
    states.allows_width("time", width, usual, line).then_some(time)
}

/// Begins the state whose line ends with its time, `rest`, in `width` columns.
fn begin_at(rest: &[u8], width: usize, line: &Line<'_>, states: &mut StateReader<'_>) {
    states.part(line, rest.trim_ascii_end(), Part::Time);
    let time = real(rest).number().filter(|_| rest.trim_ascii_end().len() == width);
    states.begin(time, line.into());
    if time.is_none() {
        states.damage(line, None, format!("expected a time of {width} columns"));
    }
}
