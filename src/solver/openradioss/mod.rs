//! OpenRadioss time history `T01`: binary records framed as Fortran writes them.
//!
//! Its groups are returned as the equivalent sections of LS-DYNA: nodes as `nodout`,
//! rigid walls as `rwforc`, contact interfaces as `rcforc`, cross sections as `secforc` (never
//! seen in a file), rigid bodies as `rbdout`, springs as `deforc`, parts as `matsum`, global variables as
//! `glstat`; other groups have their own sections (`variables`). T01 stores the *impulse* of walls, contacts,
//! sections and rigid bodies; the forces here are its central difference over time (one-sided at both
//! ends), means over two output intervals.
//!
//! All states of a T01 have one length, so a damaged state is skipped and the next one is found. The file has no
//! checksums. A restart continues in `T02`, with the impulses of `T01`: both are one record.

mod header;
mod states;
mod variables;

use std::io;
use std::sync::Arc;

use super::Format;
use super::problem::{Problem, ProblemCode};
use super::source::{Source, Stream};
use super::{Selection, SolverFile};
use crate::history::{EntityId, History};
use header::{Header, Records};
use states::StateReader;

/// Global variables in their order, named as in `glstat` where it has them.
const GLOBAL_COMPONENTS: [&str; 22] = [
    "internal_energy",
    "kinetic_energy",
    "x_momentum",
    "y_momentum",
    "z_momentum",
    "mass",
    "time_step",
    "rotational_energy",
    "external_work",
    "spring_and_damper_energy",
    "sliding_interface_energy",
    "hourglass_energy",
    "elastic_contact_energy",
    "frictional_contact_energy",
    "damping_contact_energy",
    "plastic_work",
    "added_mass",
    "added_mass_percentage",
    "inlet_mass",
    "outlet_mass",
    "inlet_energy",
    "outlet_energy",
];
pub(crate) const FORMAT: Format = Format::binary("t01", recognises, read);

/// Whether a file begins like a T01: a record of a code and a title of 80 characters.
fn recognises(head: &[u8]) -> bool {
    let Some(words) = head.get(..8) else { return false };
    let code = i32::from_be_bytes([words[4], words[5], words[6], words[7]]);
    words[..4] == 84i32.to_be_bytes() && (1_000..100_000).contains(&code)
}

/// Reads the selected histories of every section, or of the one selected.
fn read(parts: &[Box<dyn Source>], selection: &Selection) -> io::Result<Vec<SolverFile>> {
    let Some((first, restarts)) = parts.split_first() else { return Ok(Vec::new()) };
    let mut records = Records::new(Stream::new(&**first));
    let Some(header) = Header::read(&mut records)? else {
        let message = format!("the header is damaged or cut at byte {}", records.position());
        let file = SolverFile {
            problems: vec![Problem::new(ProblemCode::CutRecord, message)],
            ..empty(selection.section.as_deref().unwrap_or("glstat"))
        };
        return Ok(vec![file]);
    };
    let mut states = StateReader::new(&header, selection);
    states.read(&header, &mut records)?;
    for (k, part) in restarts.iter().enumerate() {
        let mut records = Records::new(Stream::new(&**part));
        match Header::read(&mut records)? {
            Some(own) if own.is_like(&header) => states.read(&header, &mut records)?,
            own => {
                let what = if own.is_some() { "holds other histories" } else { "is damaged" };
                states.end_before(k + 2, what);
                break;
            }
        }
    }
    Ok(states.finish(&header, selection))
}

fn history(
    entity: Option<EntityId>,
    component: &str,
    values: Vec<f64>,
    time: &Arc<[f64]>,
) -> History {
    History { entity, component: component.into(), time: time.clone(), values }
}

fn empty(section: &str) -> SolverFile {
    SolverFile { format: "t01", section: section.into(), ..SolverFile::default() }
}

const DIFFERENTIATED: &str = "forces are the central difference of T01's impulses, a mean over two output intervals; at both ends over one, so the last force changes when the record continues";
