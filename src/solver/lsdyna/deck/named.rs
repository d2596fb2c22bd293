//! Cards that name what a run holds: outputs, history nodes, contacts, walls, parts.

use super::card::{Card, text};
use super::contents::{DeckInterface, DeckPlace, Output, TitledEntity};
use super::context::{Block, Context};
use super::kind::Kind;

impl Context {
    /// DT BINARY LCUR IOOPT.
    pub(super) fn output(&mut self, file: &'static str, block: &Block, card: &Card<'_>) {
        let interval = self.real(card, 0).unwrap_or(None);
        let binary = self.integer(card, 1).unwrap_or(None);
        let output = Output { file, interval, binary, at: self.at(block.place) };
        self.keep(|deck| &mut deck.outputs, output, "output files");
    }

    pub(super) fn history(&mut self, kind: Kind, card: &Card<'_>, k: usize) {
        let Ok(Some(id)) = self.integer(card, k) else { return };
        if id == 0 {
            return;
        }
        if matches!(kind, Kind::HistoryNodeSets | Kind::HistoryNodeSetsLocal) {
            self.keep(|deck| &mut deck.history_node_sets, id, "history node sets");
        } else {
            let node = TitledEntity { id, title: None, at: self.at(card.place) };
            self.keep(|deck| &mut deck.history_nodes, node, "history nodes");
        }
    }

    pub(super) fn history_with_heading(&mut self, card: &Card<'_>) {
        if card.is_blank() {
            return;
        }
        let (field, title) = card.id_and_text();
        if let Some(id) = self.required_id_of(field, card.place) {
            let node = TitledEntity { id, title, at: self.at(card.place) };
            self.keep(|deck| &mut deck.history_nodes, node, "history nodes");
        }
    }

    pub(super) fn interface(
        &mut self,
        kind: Kind,
        keyword: String,
        at: DeckPlace,
        id: Option<i64>,
        title: Option<String>,
    ) {
        let interface = DeckInterface { id: id.filter(|&id| id != 0), title, keyword, at };
        if kind == Kind::Wall {
            self.keep(|deck| &mut deck.rigid_walls, interface, "rigid walls");
        } else {
            self.keep(|deck| &mut deck.contacts, interface, "contacts");
        }
    }

    /// Heading; PID SECID MID …; then the cards of the options, for each part. Those of
    /// `_INERTIA` come first: XC YC ZC TM IRCS …; inertias; velocities; axes when IRCS is 1.
    pub(super) fn part(&mut self, block: &mut Block, card: &Card<'_>) {
        match (block.cards, block.kind) {
            (1, _) => {
                block.text = text(card.text);
                block.ids = [None; 3];
            }
            (2, _) => {
                // Two blank lines are the end of a keyword, not a part.
                if !card.is_blank() || block.text.is_some() {
                    block.ids[0] = self.required_id(card, 0);
                }
                if let Some(id) = block.ids[0] {
                    let part =
                        TitledEntity { id, title: block.text.take(), at: self.at(card.place) };
                    self.keep(|deck| &mut deck.parts, part, "parts");
                }
            }
            (3, Kind::Parts { inertia: true, .. }) => {
                block.ids[1] = self.integer(card, 4).unwrap_or(None);
            }
            (5, Kind::Parts { inertia: true, .. }) => self.velocity_of_inertia(block, card),
            _ => {}
        }
        if let Kind::Parts { cards, inertia } = block.kind {
            let axes = usize::from(block.ids[1] == Some(1));
            if block.cards >= cards + if inertia { 3 + axes } else { 0 } {
                block.cards = 0;
            }
        }
    }
}
