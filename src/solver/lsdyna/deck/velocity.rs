//! Cards that give initial velocities.

use super::card::Card;
use super::contents::{DeckPlace, InitialVelocity, Scope};
use super::context::{Block, Context, Missing};
use super::kind::Kind;

impl Context {
    /// Card 1: NSID NSIDEX BOXID …; card 2: VX VY VZ VXR VYR VZR; card 3, when there is
    /// NSIDEX: velocities of the exempted nodes.
    pub(super) fn velocity_of_set(&mut self, block: &mut Block, card: &Card<'_>) {
        let name = &block.keyword.name;
        let [set, exempted, in_box] = block.ids;
        let scope = match (block.cards, set, in_box) {
            (1, ..) => {
                block.ids = [0, 1, 2].map(|k| match self.integer(card, k) {
                    Ok(id) => Some(id.unwrap_or(0)),
                    Err(Missing) => None,
                });
                return;
            }
            (2, Some(0), Some(0)) => Scope::AllNodes,
            (2, Some(set), Some(0)) => Scope::NodeSet(set),
            (2, Some(_), Some(in_box)) => Scope::Box(in_box),
            (3, ..) if exempted != Some(0) => exempted.map_or(Scope::Unknown, Scope::NodeSet),
            (3.., ..) => return,
            _ => Scope::Unknown,
        };
        // Rotations here are the nodes' own and move nothing.
        let velocity = self.three(card, 0);
        self.velocity(name, self.at(block.place), scope, velocity, false);
    }

    /// NID (or PID) VX VY VZ VXR VYR VZR.
    pub(super) fn velocity_of_id(
        &mut self,
        block: &Block,
        card: &Card<'_>,
        scope: fn(i64) -> Scope,
    ) {
        if card.is_blank() {
            return;
        }
        let id = self.required_id(card, 0);
        let velocity = self.three(card, 1);
        let rotates = block.kind == Kind::VelocityOfRigidBodies && self.rotates(card, 4);
        let scope = id.map_or(Scope::Unknown, scope);
        self.velocity(&block.keyword.name, self.at(card.place), scope, velocity, rotates);
    }

    /// Card 1: ID STYP OMEGA VX VY VZ …; card 2: the axis; for each.
    pub(super) fn velocity_generation(&mut self, block: &mut Block, card: &Card<'_>) {
        if block.cards == 2 || card.is_blank() {
            block.cards = 0;
            return;
        }
        let scope = match (self.integer(card, 0), self.integer(card, 1)) {
            (Ok(None | Some(0)), _) => Scope::AllNodes,
            (Ok(Some(id)), Ok(Some(1))) => Scope::PartSet(id),
            (Ok(Some(id)), Ok(Some(2))) => Scope::Part(id),
            (Ok(Some(id)), Ok(Some(3))) => Scope::NodeSet(id),
            _ => Scope::Unknown,
        };
        let rotates = !matches!(self.real(card, 2), Ok(None | Some(0.0)));
        let velocity = self.three(card, 3);
        self.velocity(&block.keyword.name, self.at(card.place), scope, velocity, rotates);
    }

    /// VTX VTY VTZ VRX VRY VRZ.
    pub(super) fn velocity_of_inertia(&mut self, block: &Block, card: &Card<'_>) {
        let velocity = self.three(card, 0);
        let rotates = self.rotates(card, 3);
        if rotates || velocity != Some([0.0; 3]) {
            let scope = block.ids[0].map_or(Scope::Unknown, Scope::Part);
            self.velocity(&block.keyword.name, self.at(card.place), scope, velocity, rotates);
        }
    }

    pub(super) fn velocity(
        &mut self,
        keyword: &str,
        at: DeckPlace,
        scope: Scope,
        velocity: Option<[f64; 3]>,
        rotates: bool,
    ) {
        let given = InitialVelocity { keyword: keyword.into(), at, velocity, rotates, scope };
        self.keep(|deck| &mut deck.initial_velocities, given, "initial velocities");
    }

    fn three(&mut self, card: &Card<'_>, from: usize) -> Option<[f64; 3]> {
        // All three are read, so that the problems of all three are found.
        let [x, y, z] = [0, 1, 2].map(|k| self.real(card, from + k).map(|v| v.unwrap_or(0.0)));
        Some([x.ok()?, y.ok()?, z.ok()?])
    }

    fn rotates(&mut self, card: &Card<'_>, from: usize) -> bool {
        self.three(card, from) != Some([0.0; 3])
    }
}
