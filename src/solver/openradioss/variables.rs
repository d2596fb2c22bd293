//! The groups of a T01: a section for each type, its variables by code, and derived quantities.

use std::sync::Arc;

use crate::history::{EntityId, Side};
use crate::solver::lsdyna::nodout::TRANSLATIONS;

/// Types of history groups.
pub(crate) const NODES: i32 = 0;
pub(crate) const INTERFACE: i32 = 101;
pub(crate) const RIGID_WALL: i32 = 102;
const RIGID_BODY: i32 = 103;
pub(crate) const SECTION: i32 = 104;
/// Parts and subsets are not groups of the file; here each is a group of one object.
pub(crate) const PART: i32 = -1;
pub(crate) const SUBSET: i32 = -2;

/// A section, the type it is of, and its variables by code, from 1, named as in a binout where that has them.
/// Others are called by their code.
type Kind = (i32, &'static str, &'static [&'static str]);

const KINDS: [Kind; 17] = [
    (NODES, "nodout", TRANSLATIONS.split_at(9).0),
    (1, "solid", &[]),
    (2, "quad", &[]),
    (3, "shell", &[]),
    (4, "truss", &["off", "force", "internal_energy", "area", "length", "plastic_strain"]),
    (5, "beam", &BEAM),
    (6, "deforc", &SPRING),
    (7, "shell_3_nodes", &[]),
    (INTERFACE, "rcforc", &[]),
    (RIGID_WALL, "rwforc", &[]),
    (RIGID_BODY, "rbdout", &["", "", "", "", "", "", "x_rotation", "y_rotation", "z_rotation"]),
    (SECTION, "secforc", &[]),
    (105, "joint", &[]),
    (107, "abstat", &["total_mass", "volume", "pressure", "surface_area", "gas_temp"]),
    (108, "accelerometer", &["x_acceleration", "y_acceleration", "z_acceleration"]),
    (PART, "matsum", &PART_VARIABLES),
    (SUBSET, "subset", &PART_VARIABLES),
];
const BEAM: [&str; 8] =
    ["off", "axial", "shear_s", "shear_t", "torsion", "moment_s", "moment_t", "internal_energy"];
const SPRING: [&str; 14] = [
    "off",
    "x_force",
    "y_force",
    "z_force",
    "x_moment",
    "y_moment",
    "z_moment",
    "x_elongation",
    "y_elongation",
    "z_elongation",
    "x_rotation",
    "y_rotation",
    "z_rotation",
    "internal_energy",
];
const PART_VARIABLES: [&str; 7] = [
    "internal_energy",
    "kinetic_energy",
    "x_momentum",
    "y_momentum",
    "z_momentum",
    "mass",
    "hourglass_energy",
];
const AXES: [&str; 3] = ["x", "y", "z"];

fn kind_of(number: i32) -> Option<&'static Kind> {
    KINDS.iter().find(|kind| kind.0 == number)
}

/// The section of a type of groups.
pub(crate) fn section(number: i32) -> String {
    kind_of(number).map_or_else(|| format!("group_{number}"), |kind| kind.1.into())
}

/// Names of an object in its section: both sides of an interface.
pub(crate) fn entities(number: i32, id: i64) -> Vec<EntityId> {
    match number {
        INTERFACE => {
            [Side::SurfA, Side::SurfB].map(|side| EntityId { id, side: Some(side) }).to_vec()
        }
        _ => vec![EntityId::new(id)],
    }
}

/// A component, and what of the file it is made of.
pub(crate) struct Component {
    pub name: Arc<str>,
    pub made: Made,
}

pub(crate) enum Made {
    /// The variable of this code.
    Value(i32),
    /// The rate of a sum of impulses.
    Rate(Vec<i32>),
    /// The size of such rates along the three axes.
    Size([Vec<i32>; 3]),
}

impl Made {
    /// The codes of all variables that it needs.
    pub(crate) fn codes(&self) -> Vec<i32> {
        match self {
            Self::Value(code) => vec![*code],
            Self::Rate(codes) => codes.clone(),
            Self::Size(axes) => axes.concat(),
        }
    }

    pub(crate) fn is_rate(&self) -> bool {
        !matches!(self, Self::Value(_))
    }
}

/// What an object of a type has whose variables have these codes.
///
/// Walls, interfaces and sections have impulses, normal ones by the codes 1 to 3 and tangential ones by 4 to 6, of
/// which a run may record the normal ones alone. Rigid bodies have impulses (1 to 3) and their moments.
pub(crate) fn components(number: i32, codes: &[i32]) -> Vec<Component> {
    let has = |code: i32| codes.contains(&code);
    let is_contact = [INTERFACE, RIGID_WALL, SECTION].contains(&number);
    let mut made = Vec::new();
    let mut used: Vec<i32> = Vec::new();
    if is_contact {
        let whole = |axis: i32| [axis, axis + 3].into_iter().filter(|&c| has(c)).collect();
        let size = |of: fn(i32) -> Vec<i32>| Made::Size([of(1), of(2), of(3)]);
        if (1..=3).all(has) {
            match number {
                RIGID_WALL => {
                    made.push(("normal_force".to_string(), size(|axis| vec![axis])));
                }
                SECTION => {
                    made.push(("total_force".into(), Made::Size([whole(1), whole(2), whole(3)])))
                }
                _ => {}
            }
        }
        for (axis, name) in (1..).zip(AXES).filter(|&(axis, _)| has(axis)) {
            let codes: Vec<i32> = whole(axis);
            used.extend(&codes);
            made.push((format!("{name}_force"), Made::Rate(codes)));
        }
    }
    if number == RIGID_BODY {
        for (first, what) in [(1, "force"), (4, "moment")] {
            for (code, name) in (first..).zip(AXES).filter(|&(code, _)| has(code)) {
                used.push(code);
                made.push((format!("{name}_{what}"), Made::Rate(vec![code])));
            }
        }
    }
    for &code in codes.iter().filter(|code| !used.contains(code)) {
        made.push((variable(number, code), Made::Value(code)));
    }
    made.into_iter().map(|(name, made)| Component { name: name.into(), made }).collect()
}

/// The name of a variable.
pub(crate) fn variable(number: i32, code: i32) -> String {
    let names = kind_of(number).map_or(&[][..], |kind| kind.2);
    let known = usize::try_from(code - 1).ok().and_then(|at| names.get(at));
    known.filter(|name| !name.is_empty()).map_or(format!("variable_{code}"), ToString::to_string)
}

/// Whether forces of this object lack their tangential part.
pub(crate) fn is_normal_only(number: i32, codes: &[i32]) -> bool {
    let is_contact = [INTERFACE, RIGID_WALL, SECTION].contains(&number);
    is_contact && (1..=3).any(|code| codes.contains(&code) && !codes.contains(&(code + 3)))
}
