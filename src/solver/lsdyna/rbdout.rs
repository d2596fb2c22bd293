//! `rbdout`: motion of rigid bodies in global and in local directions.
//!
//! Never tested with real data; read as the source of LSTC's converter `l2a` writes it.

use super::ascii::{Body, boxed};
use super::label_values::numbers;
use super::line::{Line, integer};
use crate::history::EntityId;
use crate::solver::Format;
use crate::solver::states::repeat::Part;
use crate::solver::states::{StateReader, TableId};

const STATE: &[u8] = b"  r i g i d   b o d y   m o t i o n";
const BODIES: [&[u8]; 2] = [b" nodal rigid body", b" rigid body"];
const LOCAL: &[u8] = b" output in principal or user defined local";
/// Lines that hold no values.
const HEADINGS: [&[u8]; 5] = [b"1", b"global", b"principal or user defined", b"a ", b"output in"];
/// After the label, fields of 12; in rows of direction cosines of 15.
const WIDTH: usize = 12;
const ROW_WIDTH: usize = 15;
/// Digits, point and exponent of a time.
const TIME: usize = 12;

/// Labels of lines, with their components in global and in local directions.
const LINES: [(&[u8], &[&str], &[&str]); 7] = [
    (b"coordinates:", &["global_x", "global_y", "global_z"], &[]),
    (
        b"displacements:",
        &["global_dx", "global_dy", "global_dz", "global_rdx", "global_rdy", "global_rdz"],
        &["local_dx", "local_dy", "local_dz", "local_rdx", "local_rdy", "local_rdz"],
    ),
    (
        b"velocities:",
        &["global_vx", "global_vy", "global_vz", "global_rvx", "global_rvy", "global_rvz"],
        &["local_vx", "local_vy", "local_vz", "local_rvx", "local_rvy", "local_rvz"],
    ),
    (
        b"accelerations:",
        &["global_ax", "global_ay", "global_az", "global_rax", "global_ray", "global_raz"],
        &["local_ax", "local_ay", "local_az", "local_rax", "local_ray", "local_raz"],
    ),
    (b"row 1", &["dircos_11", "dircos_12", "dircos_13"], &[]),
    (b"row 2", &["dircos_21", "dircos_22", "dircos_23"], &[]),
    (b"row 3", &["dircos_31", "dircos_32", "dircos_33"], &[]),
];

pub(crate) const FORMAT: Format =
    Format::text("rbdout", "rigid body", boxed::<Rbdout>, |line| line.starts_with(STATE));

#[derive(Clone, Default)]
struct Rbdout {
    /// Of global and of local directions, by line.
    tables: Option<[[TableId; 2]; LINES.len()]>,
    is_local: bool,
}

impl Body for Rbdout {
    fn expected(&self) -> &'static str {
        "a rigid body's motion"
    }

    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let text = line.text.trim_ascii_end();
        if text.starts_with(STATE) {
            states.entity = None;
            let at = memchr::memmem::find(text, b"time=").map(|at| &text[at + 5..]);
            let cycle = memchr::memmem::find(text, b"cycle=").map(|at| &text[at + 6..]);
            let digits =
                |cycle: &[u8]| cycle.iter().take_while(|b| !b.is_ascii_alphabetic()).count();
            let cycle = cycle.map_or(&[][..], |cycle| &cycle[..digits(cycle)]);
            states.part(line, cycle, Part::Unread);
            let time = super::heading_time(at, TIME, line, states);
            states.begin(time, line.into());
            return time.map(drop);
        }
        if let Some(rest) = BODIES.iter().find_map(|label| text.strip_prefix(*label)) {
            self.is_local = false;
            states.entity = integer(rest).map(EntityId::new);
            return states.entity.map(drop);
        }
        let start = text.trim_ascii_start();
        if text.starts_with(LOCAL) {
            self.is_local = true;
        }
        if HEADINGS.iter().any(|heading| start.starts_with(heading)) && line.is_heading() {
            return Some(());
        }
        let index = LINES.iter().position(|(label, ..)| start.starts_with(label))?;
        let tables = *self.tables.get_or_insert_with(|| {
            LINES.map(|(_, global, local)| {
                [global, local].map(|names| states.table("rigid bodies", names))
            })
        });
        let (label, global, local) = LINES[index];
        let components = if self.is_local { local } else { global };
        let width = if label.starts_with(b"row") { ROW_WIDTH } else { WIDTH };
        if components.is_empty() {
            return None;
        }
        let from = text.len() - start.len() + label.len();
        let fields = numbers(line, from, text.len(), components.len(), width)?;
        let usual = components.len() * width;
        if !states.allows_width(components[0], text.len() - from, usual, line) {
            return None;
        }
        let table = tables[index][usize::from(self.is_local)];
        states.row(table, states.entity?, line, |k| fields.get(k).copied());
        Some(())
    }
}
