//! The metadata of a run in its deck, and the resulting speed.

use serde::Serialize;

use super::context::Value;
use crate::solver::problem::Problem;
use crate::unit::UnitSystem;

/// Metadata of a run in a deck and its includes, in the deck's own units.
///
/// Each list ends at 100,000 entries; a problem says when there were more.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Deck {
    /// The first `*TITLE` that is not blank.
    pub title: Option<String>,
    /// As a comment or `*CONTROL_UNITS` states them.
    pub units: Option<StatedUnits>,
    /// In the order of the deck.
    pub(crate) initial_velocities: Vec<InitialVelocity>,
    /// `*DATABASE_…` of the ASCII files, in order.
    pub outputs: Vec<Output>,
    /// `*DATABASE_HISTORY_NODE`.
    pub history_nodes: Vec<TitledEntity>,
    /// `*DATABASE_HISTORY_NODE_SET`.
    pub history_node_sets: Vec<i64>,
    /// `*CONTACT_…`, in order.
    pub contacts: Vec<DeckInterface>,
    /// `*PART`, in order.
    pub parts: Vec<TitledEntity>,
    /// `*RIGIDWALL_…`, in order.
    pub rigid_walls: Vec<DeckInterface>,
    /// `*PARAMETER`, names in lower case.
    pub parameters: Vec<(String, Value)>,
    /// `*INCLUDE`, in order of reading. Folders of `*INCLUDE_PATH` are tried, not listed.
    pub includes: Vec<Include>,
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
pub struct Output {
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

/// An id and the title that goes with it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TitledEntity {
    /// As in the deck.
    pub id: i64,
    /// `None` where the deck gives none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
    /// Where its card is.
    #[serde(skip)]
    pub at: DeckPlace,
}

/// A contact or a rigid wall.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeckInterface {
    /// From `_ID`, or the order number when no contact (no wall) of the deck has an id
    /// and all are of a kind that is numbered together; else `None`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<i64>,
    /// `None` where the deck gives none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
    /// In capitals and without its star.
    #[serde(skip)]
    pub keyword: String,
    /// Where its keyword is.
    #[serde(skip)]
    pub at: DeckPlace,
}

/// One included file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Include {
    /// As the deck writes it.
    pub name: String,
    /// Where it is included.
    #[serde(skip)]
    pub at: DeckPlace,
    /// Whether the file is there.
    pub found: bool,
}

/// A speed taken from a deck.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImpactSpeed {
    /// Above zero, in the deck's units.
    pub speed: f64,
    /// Where the first velocity is given.
    pub at: DeckPlace,
}

impl Deck {
    /// The speed at which the model starts to move: that of all initial velocities that
    /// are not zero, when they agree in size and direction (to 1e-6, since decks write
    /// seven digits). `None` when there is none, when they differ, when one turns or is
    /// not known, or when a wall moves. An include that is missing may hide more.
    pub fn impact_speed(&self) -> Option<ImpactSpeed> {
        let moves =
            |w: &DeckInterface| w.keyword.split('_').any(|o| o == "MOVING" || o == "MOTION");
        if self.rigid_walls.iter().any(moves) {
            return None;
        }
        let mut first: Option<([f64; 3], ImpactSpeed)> = None;
        for given in &self.initial_velocities {
            let velocity = given.velocity.filter(|_| !given.rotates)?;
            let speed = norm(velocity);
            if speed == 0.0 {
                continue;
            }
            match first {
                None => first = Some((velocity, ImpactSpeed { speed, at: given.at })),
                Some((v, known)) => {
                    let difference = [v[0] - velocity[0], v[1] - velocity[1], v[2] - velocity[2]];
                    if norm(difference) > 1e-6 * known.speed {
                        return None;
                    }
                }
            }
        }
        first.map(|(_, known)| known).filter(|known| known.speed.is_finite())
    }
}

fn norm([x, y, z]: [f64; 3]) -> f64 {
    x.hypot(y).hypot(z)
}
