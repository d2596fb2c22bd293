//! OpenRadioss time history `T01`: binary records framed as Fortran writes them.
//!
//! Its groups are given as the sections of LS-DYNA that hold the same: nodes as `nodout`,
//! rigid walls as `rwforc`, contact interfaces as `rcforc`, cross sections as `secforc` (never
//! seen in a file), global variables as `glstat`. T01 stores the *impulse* of walls, contacts
//! and sections; the forces here are its central difference over time (one-sided at both
//! ends), means over two output intervals.
//!
//! All states of a T01 have one length, so a damaged state is passed over and the next one is found. The file has no
//! check sums.

mod header;
mod states;

use std::io;
use std::sync::Arc;

use super::format::Format;
use super::lsdyna::nodout::TRANSLATIONS;
use super::problem::{Problem, ProblemCode};
use super::source::{Source, Stream};
use super::{Selection, SolverFile};
use crate::history::{EntityId, History, Side};
use crate::signal::derivative;
use header::{Header, Records};
use states::StateReader;

/// Types of history groups that are read.
const NODES: i32 = 0;
const INTERFACE: i32 = 101;
const RIGID_WALL: i32 = 102;
const SECTION: i32 = 104;

/// Node variables by code, from 1: those of a nodout without its coordinates.
const NODE_COMPONENTS: &[&str] = TRANSLATIONS.split_at(9).0;
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
/// Components made from the impulses FNX FNY FNZ FTX FTY FTZ (codes 1 to 6).
const FORCE_COMPONENTS: [&str; 3] = ["x_force", "y_force", "z_force"];
const IMPULSES: usize = 6;

pub(crate) const FORMAT: Format = Format::binary("t01", recognises, read);

/// Whether a file begins like a T01: a record of a code and a title of 80 characters.
fn recognises(head: &[u8]) -> bool {
    let Some(words) = head.get(..8) else { return false };
    let code = i32::from_be_bytes([words[4], words[5], words[6], words[7]]);
    words[..4] == 84i32.to_be_bytes() && (1_000..100_000).contains(&code)
}

/// Reads the selected histories of every section, or of the one selected.
fn read(parts: &[Box<dyn Source>], selection: &Selection) -> io::Result<Vec<SolverFile>> {
    let Some(source) = parts.first() else { return Ok(Vec::new()) };
    let input = Stream::new(&**source);
    let mut records = Records::new(input);
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
    Ok(states.finish(&header, selection))
}

/// Names of an object in its section: both sides of an interface.
fn entities(section: &str, id: i64) -> Vec<EntityId> {
    match section {
        "rcforc" => {
            [Side::SurfA, Side::SurfB].map(|side| EntityId { id, side: Some(side) }).to_vec()
        }
        _ => vec![EntityId::new(id)],
    }
}

/// The component that is the size of a force, where the section has one.
fn magnitude(section: &str) -> &'static [&'static str] {
    match section {
        "rwforc" => &["normal_force"],
        "secforc" => &["total_force"],
        _ => &[],
    }
}

/// The histories of one object from its variables by code.
fn histories(
    section: &str,
    entity: EntityId,
    own: &[(usize, Vec<f64>)],
    time: &Arc<[f64]>,
) -> Vec<History> {
    if section == "nodout" {
        let component = |code: usize| NODE_COMPONENTS.get(code.wrapping_sub(1));
        return own
            .iter()
            .filter_map(|(code, values)| {
                Some(history(Some(entity), component(*code)?, values.clone(), time))
            })
            .collect();
    }
    let impulse = |code: usize| own.iter().find(|(c, _)| *c == code).map(|(_, v)| v);
    let all: Option<Vec<&Vec<f64>>> = (1..=IMPULSES).map(impulse).collect();
    let Some(all) = all.filter(|_| time.len() > 1) else { return Vec::new() };
    // SURFB feels the opposite of what T01 writes for the interface.
    let sign = if entity.side == Some(Side::SurfB) { -1.0 } else { 1.0 };
    let rate = |values: &[f64]| derivative(time, values);
    let normal: Vec<Vec<f64>> = (0..3).map(|k| rate(all[k])).collect();
    let mut made = Vec::new();
    let total: Vec<Vec<f64>> = (0..3)
        .map(|k| {
            let tangential = rate(all[k + 3]);
            normal[k].iter().zip(tangential).map(|(n, t)| sign * (n + t)).collect()
        })
        .collect();
    for &component in magnitude(section) {
        // A wall's normal force, but the whole force of a section.
        let of = if section == "rwforc" { &normal } else { &total };
        let length = |i: usize| of.iter().map(|n| n[i] * n[i]).sum::<f64>().sqrt();
        let values = (0..time.len()).map(length).collect();
        made.push(history(Some(entity), component, values, time));
    }
    for (component, values) in FORCE_COMPONENTS.into_iter().zip(total) {
        made.push(history(Some(entity), component, values, time));
    }
    made
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
    SolverFile {
        format: "t01",
        section: section.into(),
        solver: None,
        version: None,
        title: None,
        entities: Vec::new(),
        without_data: Vec::new(),
        components: Vec::new(),
        time: Arc::new([]),
        histories: Vec::new(),
        problems: Vec::new(),
        notes: match section {
            "rwforc" | "rcforc" | "secforc" => vec![DIFFERENTIATED.into()],
            _ => Vec::new(),
        },
    }
}

const DIFFERENTIATED: &str =
    "forces are the central difference of T01's impulses, a mean over two output intervals";
