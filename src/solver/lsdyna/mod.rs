//! LS-DYNA's time histories: one module per file, named as the solver names it.

pub(super) mod abstat;
mod ascii;
pub(super) mod binout;
pub(super) mod bndout;
pub(super) mod curvout;
pub(crate) mod deck;
pub(super) mod deforc;
mod dotted;
mod e12;
pub(super) mod elout;
pub(super) mod glstat;
pub(super) mod header;
pub(super) mod jntforc;
mod label_values;
pub(super) mod line;
mod lsda;
pub(super) mod matsum;
mod node_forces;
pub(super) mod nodfor;
pub(super) mod nodout;
pub(super) mod rbdout;
pub(super) mod rcforc;
pub(super) mod rwforc;
pub(super) mod secforc;
pub(super) mod sleout;
pub(super) mod spcforc;
pub(super) mod swforc;

use super::states::StateReader;

/// The time in `( at time … )` of a state's heading.
fn at_time(line: &[u8]) -> Option<f64> {
    const AT: &[u8] = b"( at time";
    let from = memchr::memmem::find(line, AT)? + AT.len();
    let to = from + memchr::memchr(b')', line.get(from..)?)?;
    match line::real(&line[from..to]) {
        line::Field::Real(time) => Some(time),
        _ => None,
    }
}

/// Begins the state whose line ends with its time, `rest`, in `width` columns.
fn begin_at(rest: &[u8], width: usize, line: &line::Line<'_>, states: &mut StateReader<'_>) {
    match line::real(rest) {
        line::Field::Real(time) if rest.trim_ascii_end().len() == width => {
            states.begin(Some(time), line.into());
        }
        _ => {
            states.begin(None, line.into());
            states.damage(line, None, format!("expected a time of {width} columns"));
        }
    }
}
