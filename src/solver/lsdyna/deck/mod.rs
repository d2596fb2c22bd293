//! LS-DYNA keyword decks: the metadata that names and sizes a run; not its mesh.
//!
//! Cards as in the LS-DYNA Keyword User's Manual, Volume I. A deck is read in one pass:
//! a parameter applies to the cards below it, an include is read in place. Keywords
//! that are not listed here are skipped; nothing of them is kept.

mod cards;
pub(crate) mod context;
mod keyword;
mod reader;

use std::io::{self, BufRead};

use serde::Serialize;

use crate::solver::problem::Problem;
use crate::unit::UnitSystem;
pub(crate) use cards::system as unit_system;
use context::Value;
pub(crate) use keyword::signature;

/// Reads a deck.
///
/// `open` gives the bytes of an included file by its name, or `None` when it is missing.
/// It is called with the name as written, then with that name in each folder of
/// `*INCLUDE_PATH`. Includes end 16 deep and at the 1000th.
///
/// # Errors
/// Only those of reading `source`, and where the deck with its includes has more than 4 GB.
/// Anything else is in [`Deck::problems`]; the place of a
/// problem in an included file is in that file, which its message names.
pub fn parse_deck(
    source: &mut dyn BufRead,
    open: &mut dyn FnMut(&str) -> Option<Box<dyn BufRead>>,
) -> io::Result<Deck> {
    reader::read(source, open)
}

/// Metadata of a run in a deck and its includes, in the deck's own units.
///
/// Each list ends at 100,000 entries; a problem says when there were more.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Deck {
    /// Of OpenRadioss, of which title and units are read; else a keyword deck.
    pub(crate) is_starter: bool,
    /// The first `*TITLE` that is not blank.
    pub title: Option<String>,
    /// As a comment or `*CONTROL_UNITS` states them.
    pub units: Option<StatedUnits>,
    /// Of each `*MAT_…` that gives both, in order.
    pub(crate) materials: Vec<Material>,
    /// In the order of the deck.
    pub(crate) initial_velocities: Vec<InitialVelocity>,
    /// `*DATABASE_…` of the ASCII files, in order.
    pub outputs: Vec<DeckOutput>,
    /// `*DATABASE_HISTORY_NODE`.
    pub history_nodes: Vec<DeckEntity>,
    /// `*DATABASE_HISTORY_NODE_SET`.
    pub history_node_sets: Vec<i64>,
    /// `*CONTACT_…`, in order.
    pub contacts: Vec<DeckEntity>,
    /// `*PART`, in order.
    pub parts: Vec<DeckEntity>,
    /// `*RIGIDWALL_…`, in order.
    pub rigid_walls: Vec<DeckEntity>,
    /// `*PARAMETER`, names in lower case.
    pub parameters: Vec<(String, Value)>,
    /// `*INCLUDE`, in order of reading. Folders of `*INCLUDE_PATH` are tried, not listed.
    pub includes: Vec<DeckInclude>,
    /// What could not be read, in order.
    pub problems: Vec<Problem>,
}

/// Where a card or keyword is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeckPlace {
    /// Counted from 1.
    pub line: u64,
    /// Index into [`Deck::includes`]; `None` for the deck itself.
    pub include: Option<usize>,
}

/// Units as stated.
#[derive(Clone, Debug, PartialEq)]
pub struct StatedUnits {
    /// `kg / mm / ms / kN / GPa`, or the fields of `*CONTROL_UNITS`.
    pub text: String,
    /// Where they are stated.
    pub at: DeckPlace,
    /// When length, mass and time are all recognised and nothing contradicts them.
    pub system: Option<UnitSystem>,
}

/// Density and Young's modulus of a material, in the deck's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Material {
    pub density: f64,
    pub modulus: f64,
    pub at: DeckPlace,
}

/// One velocity given at the start: `*INITIAL_VELOCITY`, `_NODE`, `_RIGID_BODY`,
/// `_GENERATION`, or that of an `_INERTIA` body.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct InitialVelocity {
    /// In capitals and without its star.
    pub keyword: String,
    /// Where it is given.
    pub at: DeckPlace,
    /// x, y, z. `None` when it is not known; a problem says why.
    pub velocity: Option<[f64; 3]>,
    /// Whether a rotation is given or not known as well.
    pub rotates: bool,
    /// Its scope.
    pub scope: Scope,
}

/// Scope of an initial velocity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scope {
    /// Every node of the model.
    AllNodes,
    /// The node of that id.
    Node(i64),
    /// The node set of that id.
    NodeSet(i64),
    /// Nodes inside a box, of a set when one is given as well.
    Box(i64),
    /// The part of that id.
    Part(i64),
    /// The part set of that id.
    PartSet(i64),
    /// The card's scope could not be read.
    Unknown,
}

/// One ASCII file that the deck requests.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeckOutput {
    /// As the keyword names it, in small letters: `nodout`.
    pub file: &'static str,
    /// Output interval, in the deck's unit of time. `None` when left out or not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interval: Option<f64>,
    /// 1 ASCII, 2 binout, 3 both; 0 or `None` leaves it to the solver.
    #[serde(skip)]
    pub binary: Option<i64>,
    /// Where its keyword is.
    #[serde(skip)]
    pub at: DeckPlace,
}

/// A part, node, contact or rigid wall.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeckEntity {
    /// As in the deck. Of contacts and walls from `_ID`, or the order number when no contact (no wall)
    /// of the deck has an id and all are of a kind that is numbered together; else `None`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<i64>,
    /// `None` where the deck gives none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
    /// Of a contact or wall, in capitals and without its star.
    #[serde(skip)]
    pub keyword: String,
    /// Where its card is, or its keyword.
    #[serde(skip)]
    pub at: DeckPlace,
}

impl DeckEntity {
    /// Whether it is a wall that moves, by its keyword.
    fn moves(&self) -> bool {
        self.keyword.split('_').any(|option| option == "MOVING" || option == "MOTION")
    }
}

/// One included file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeckInclude {
    /// As the deck writes it.
    pub name: String,
    /// Where it is included.
    #[serde(skip)]
    pub at: DeckPlace,
    /// Whether the file is there.
    pub found: bool,
}

impl Deck {
    /// `line 12`, of an included file with its name.
    pub(crate) fn line(&self, at: DeckPlace) -> String {
        match at.include.and_then(|index| self.includes.get(index)) {
            Some(include) => format!("line {} of {}", at.line, include.name),
            None => format!("line {}", at.line),
        }
    }

    /// The units in which most of its materials that can be metals are such, with what says so of the first of them. `None`
    /// if there is none, or as many are metals in other units.
    pub(crate) fn units_of_metals(&self, name: &str) -> Option<(UnitSystem, String)> {
        let of = |material: &Material| UnitSystem::of_metal(material.density, material.modulus);
        let mut found: Vec<(UnitSystem, Material, usize)> = Vec::new();
        for (units, material) in self.materials.iter().filter_map(|m| Some((of(m)?, *m))) {
            match found.iter_mut().find(|(known, ..)| *known == units) {
                Some((.., count)) => *count += 1,
                None => found.push((units, material, 1)),
            }
        }
        let most = found.iter().map(|(.., count)| *count).max()?;
        let mut most = found.into_iter().filter(|(.., count)| *count == most);
        let (units, Material { density, modulus, at }, _) = most.next()?;
        let said = format!(
            "density {density:?} and Young's modulus {modulus:?} of the deck {name}, {}, are those of a metal in {units}",
            self.line(at)
        );
        most.next().is_none().then_some((units, said))
    }

    /// A wall of these ids that moves, by its keyword; where the deck numbers none of them, the first if all walls move.
    pub(crate) fn moving_wall(&self, ids: &[i64]) -> Option<&DeckEntity> {
        let is_meant = |w: &&DeckEntity| w.id.is_some_and(|id| ids.contains(&id));
        match self.rigid_walls.iter().any(|w| is_meant(&w)) {
            true => self.rigid_walls.iter().filter(is_meant).find(|w| w.moves()),
            false => {
                self.rigid_walls.first().filter(|_| self.rigid_walls.iter().all(DeckEntity::moves))
            }
        }
    }

    /// The speed at which the model starts to move, in the deck's units, and where the first velocity
    /// is given: that of all initial velocities that are not zero, when they agree in size and
    /// direction (to 1e-6, since decks write seven digits). `None` when there is none, when they differ, when one turns or is
    /// not known, or when a wall moves. An include that is missing may hide more.
    pub fn impact_speed(&self) -> Option<(f64, DeckPlace)> {
        if self.rigid_walls.iter().any(DeckEntity::moves) {
            return None;
        }
        let mut first: Option<([f64; 3], f64, DeckPlace)> = None;
        for given in &self.initial_velocities {
            let velocity = given.velocity.filter(|_| !given.rotates)?;
            let speed = norm(velocity);
            if speed == 0.0 {
                continue;
            }
            match first {
                None => first = Some((velocity, speed, given.at)),
                Some((v, known, _)) => {
                    let difference = [v[0] - velocity[0], v[1] - velocity[1], v[2] - velocity[2]];
                    if norm(difference) > 1e-6 * known {
                        return None;
                    }
                }
            }
        }
        first.map(|(_, speed, at)| (speed, at)).filter(|(speed, _)| speed.is_finite())
    }
}

fn norm([x, y, z]: [f64; 3]) -> f64 {
    libm::hypot(libm::hypot(x, y), z)
}

#[cfg(test)]
mod tests {
    use super::Scope;
    use super::*;

    #[test]
    fn most_metals_tell_the_units() {
        fn t(cards: &str, expected: Option<(&str, &str)>) {
            let deck = parse_deck(&mut cards.as_bytes(), &mut |_| None).unwrap();
            let found = deck.units_of_metals("a.k");
            let found = found.as_ref().map(|(units, said)| (units.to_string(), &**said));
            let expected = expected.map(|(units, of)| {
                (units.into(), format!("density {of}, are those of a metal in {units}"))
            });
            assert_eq!(
                found,
                expected.as_ref().map(|(u, s): &(String, String)| (u.clone(), &**s)),
                "{cards}"
            );
            assert!(deck.problems.is_empty(), "{:?}", deck.problems);
        }
        let steel = "*MAT_024_TITLE\nsteel\n1,7.85e-6,210.,0.3\n";
        let of_steel =
            |line: u64| format!("7.85e-6 and Young's modulus 210.0 of the deck a.k, line {line}");
        let other = "*PARAMETER\nR e,70000.\n*MAT_003\n$ aluminium\n2,2.7e-9,&e,0.33\n";
        let alone = "2.7e-9 and Young's modulus 70000.0 of the deck a.k, line 5";
        t(steel, Some(("mm-kg-ms", &of_steel(3))));
        t(other, Some(("mm-t-s", alone)));
        t(&format!("{steel}{other}"), None);
        t(
            &format!("*MAT_RIGID\n3,1.,210.\n{steel}{steel}{other}"),
            Some(("mm-kg-ms", &of_steel(5))),
        );
        let none = "*MAT_SPRING_ELASTIC\n1,500.\n*MAT_ADD_EROSION\n2,none,0.\n*MAT_NULL\n3,&no,1.\n*MAT_024\n";
        t(none, None);
    }

    #[test]
    fn reads_velocities_of_all_cards() {
        fn t(cards: &str, expected: &[(Scope, Option<[f64; 3]>)], speed: Option<(f64, u64)>) {
            let d = parse_deck(&mut cards.as_bytes(), &mut |_| None).unwrap();
            let read: Vec<_> = d.initial_velocities.iter().map(|v| (v.scope, v.velocity)).collect();
            assert_eq!(read, expected, "{cards}");
            assert_eq!(d.impact_speed().map(|(speed, at)| (speed, at.line)), speed, "{cards}");
        }
        let x10 = Some([10.0, 0.0, 0.0]);
        t(
            "*INITIAL_VELOCITY\n\n3.0,4.0\n",
            &[(Scope::AllNodes, Some([3., 4., 0.]))],
            Some((5., 1)),
        );
        t(
            "*INITIAL_VELOCITY\n2\n-9.\n",
            &[(Scope::NodeSet(2), Some([-9., 0., 0.]))],
            Some((9., 1)),
        );
        // The velocity's card is blank, that is zero; the third is for exempted nodes.
        t("*INITIAL_VELOCITY\n2\n\n-9.\n", &[(Scope::NodeSet(2), Some([0.0; 3]))], None);
        t(
            "*PARAMETER\nR speed,-10.5\n*PARAMETER_EXPRESSION\nR      two       2.0\n*INITIAL_VELOCITY\n\n-&speed,&two\n",
            &[(Scope::AllNodes, Some([10.5, 2.0, 0.0]))],
            Some((10.5_f64.hypot(2.0), 5)),
        );
        t("*INITIAL_VELOCITY\n2,,8\n10.\n", &[(Scope::Box(8), x10)], Some((10., 1)));
        t(
            "*INITIAL_VELOCITY\n0,9\n10.\n0,5.\n",
            &[(Scope::AllNodes, x10), (Scope::NodeSet(9), Some([0., 5., 0.]))],
            None, // they differ
        );
        t(
            "*INITIAL_VELOCITY_NODE\n11,10.\n12,10.\n\n13,0\n",
            &[(Scope::Node(11), x10), (Scope::Node(12), x10), (Scope::Node(13), Some([0.0; 3]))],
            Some((10., 2)),
        );
        t("*INITIAL_VELOCITY_RIGID_BODY\n5,10.\n", &[(Scope::Part(5), x10)], Some((10., 2)));
        t(
            "*INITIAL_VELOCITY_RIGID_BODY\n5,10.\n6,-10.\n",
            &[(Scope::Part(5), x10), (Scope::Part(6), Some([-10., 0., 0.]))],
            None, // two bodies that close in
        );
        t(
            "*INITIAL_VELOCITY_GENERATION\n1,1,,10.\n\n2,2,0.0,10.\n0\n3,3,,10.\n\n0,2,,10.\n\n\n",
            &[
                (Scope::PartSet(1), x10),
                (Scope::Part(2), x10),
                (Scope::NodeSet(3), x10),
                (Scope::AllNodes, x10),
            ],
            Some((10., 2)),
        );
        t("*INITIAL_VELOCITY_GENERATION\n2,2,5.,10.\n\n", &[(Scope::Part(2), x10)], None); // turns
        t(
            "*PART_INERTIA_CONTACT\ncar body\n7\n0,0,0,24.,1\n1,1,1\n10.\n\n\nbogie\n8\n0\n1\n0\n\n",
            &[(Scope::Part(7), x10)],
            Some((10., 6)),
        );
        t(
            "*CONSTRAINED_NODAL_RIGID_BODY_SPC_INERTIA_TITLE\ncar\n101\n1\n0\n1\n10.\n",
            &[(Scope::Part(101), x10)],
            Some((10., 7)),
        );
        t("*INITIAL_VELOCITY\n\nfast\n", &[(Scope::AllNodes, None)], None);
        t("*INITIAL_VELOCITY_NEW\n\n10.\n", &[(Scope::Unknown, None)], None);
        t(
            "*INITIAL_VELOCITY\n\n10.\n*RIGIDWALL_PLANAR_MOVING\n",
            &[(Scope::AllNodes, x10)],
            None, // so does the wall
        );
    }
}
