//! LS-DYNA's time histories: one module per file, named as the solver names it.

pub mod abstat;
mod ascii;
pub mod binout;
pub mod bndout;
pub mod curvout;
pub mod deck;
pub mod deforc;
mod dotted;
mod e12;
pub mod elout;
pub mod glstat;
pub(super) mod header;
pub mod jntforc;
mod label_values;
pub mod line;
mod lsda;
pub mod matsum;
mod node_forces;
pub mod nodfor;
pub mod nodout;
pub mod rbdout;
pub mod rcforc;
pub mod rwforc;
pub mod secforc;
pub mod sleout;
pub mod spcforc;
pub mod swforc;

use super::states::States;

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
fn begin_at(rest: &[u8], width: usize, line: &line::Line<'_>, states: &mut States<'_>) {
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
