//! LS-DYNA keyword decks: the metadata that names and sizes a run; not its mesh.
//!
//! Cards as in the LS-DYNA Keyword User's Manual, Volume I. A deck is read in one pass:
//! a parameter applies to the cards below it, an include is read in place. Keywords
//! that are not listed here are skipped; nothing of them is kept.

mod card;
mod cards;
pub(crate) mod contents;
pub(crate) mod context;
mod keyword;
mod reader;

use std::io::{self, BufRead};

pub use contents::Deck;
pub use contents::DeckInterface;
pub(crate) use contents::Include;
pub use contents::TitledEntity;
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

#[cfg(test)]
mod tests {
    use super::contents::Scope;
    use super::*;

    #[test]
    fn reads_velocities_of_all_cards() {
        fn t(cards: &str, expected: &[(Scope, Option<[f64; 3]>)], speed: Option<(f64, u64)>) {
            let d = parse_deck(&mut cards.as_bytes(), &mut |_| None).unwrap();
            let read: Vec<_> = d.initial_velocities.iter().map(|v| (v.scope, v.velocity)).collect();
            assert_eq!(read, expected, "{cards}");
            assert_eq!(d.impact_speed().map(|s| (s.speed, s.at.line)), speed, "{cards}");
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
