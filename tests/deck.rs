//! LS-DYNA decks: those of our own runs, and those of others.

use std::fs;
use std::io::{self, BufRead};
use std::path::Path;

use crate::common::{fixture, shared};
use crumple::solver::{Deck, DeckInterface, TitledEntity, parse_deck};
use crumple::unit::UnitSystem;

fn messages(deck: &Deck) -> Vec<String> {
    deck.problems.iter().map(ToString::to_string).collect()
}

fn named(list: &[TitledEntity]) -> Vec<(i64, Option<&str>)> {
    list.iter().map(|n| (n.id, n.title.as_deref())).collect()
}

fn interfaces(list: &[DeckInterface]) -> Vec<(Option<i64>, Option<&str>)> {
    list.iter().map(|n| (n.id, n.title.as_deref())).collect()
}

/// A deck from its folder, includes from the same.
fn deck_in(folder: &Path, name: &str) -> Deck {
    let mut open = |name: &str| {
        let bytes = fs::read(folder.join(name)).ok()?;
        Some(Box::new(io::Cursor::new(bytes)) as Box<dyn BufRead>)
    };
    let bytes = fs::read(folder.join(name)).unwrap();
    parse_deck(&mut &bytes[..], &mut open).unwrap()
}

/// Expected counts were taken with grep.
#[test]
#[ignore = "needs ../shared (the real files)"]
fn reads_our_decks() {
    let folder = shared("fe");
    for (name, speed, line) in [
        ("lead-car-wall/deck_25kmh.k", 6944.444, 19336),
        ("vehicle-pair/deck_6kmh.k", 833.3333, 16586),
    ] {
        let d = deck_in(&folder, name);
        assert_eq!(messages(&d), [""; 0], "{name}");
        let impact = d.impact_speed().unwrap();
        assert_eq!((impact.speed, impact.at.line), (speed, line), "{name}");
        assert_eq!(d.units.unwrap().system, Some(UnitSystem::parse("mm-t-s").unwrap()));
        assert_eq!((d.parts.len(), d.history_nodes.len(), d.outputs.len()), (6, 12, 5));
        assert_eq!(d.history_nodes[0].id, 900_001);
        assert_eq!(named(&d.parts)[0], (1, Some("long_beam_stage1")));
        assert_eq!(interfaces(&d.rigid_walls), [(Some(1), Some("rigid wall"))]);
        assert_eq!(interfaces(&d.contacts), [(Some(1), Some("self contact"))]);
        assert!(d.outputs.iter().all(|o| o.interval == Some(0.00075) && o.binary == Some(0)));
    }
}

fn ids(list: &[DeckInterface]) -> Vec<Option<i64>> {
    list.iter().map(|i| i.id).collect()
}

#[test]
fn reads_decks_of_others() {
    let d = deck_in(&fixture("samples/dyna_pladebuk/keyword"), "node997_main.k");
    assert_eq!((d.outputs.len(), d.parts.len(), d.includes.len()), (11, 3, 3));
    assert_eq!(ids(&d.contacts), [Some(80085), Some(8008)]);
    assert_eq!(d.problems.len(), 3, "its includes are not among the samples");

    let d = deck_in(&fixture("samples/lasso-python/keyword"), "lasso_sph_test.k");
    assert_eq!(messages(&d), [""; 0]);
    assert_eq!(d.impact_speed().map(|s| (s.speed, s.at.line)), Some((50.0, 64)));
    assert_eq!((named(&d.parts), ids(&d.rigid_walls)), (vec![(101, None)], vec![Some(1)]));
}

#[test]
#[ignore = "needs ../shared (the real files)"]
fn reads_decks_with_parameters_and_includes() {
    let folder = shared("samples/lsdyna/keyword");
    let kg_mm_ms = UnitSystem::parse("kg-mm-ms").ok();

    let d = deck_in(&folder, "pillars_control_explicit.k");
    assert_eq!(messages(&d), [""; 0]);
    assert_eq!(ids(&d.contacts), [Some(10001), Some(2), Some(10013)]);
    assert_eq!(d.units.unwrap().system, kg_mm_ms);

    let d = deck_in(&folder, "pillars_bolted_connection_b.k");
    assert_eq!(messages(&d), [""; 0]);
    let parts: Vec<_> = d.parts.iter().map(|p| p.id).collect();
    assert_eq!(parts, [10, 20, 100, 110, 120, 101, 310]);
    assert_eq!(named(&d.history_nodes), [(1_200_000, None), (1_100_002, None)]);

    let d = deck_in(&folder, "pillars_mainboltbexpl.k");
    assert_eq!((d.outputs.len(), d.parameters.len(), d.includes.len()), (11, 15, 1));
    // Eleven expressions and an include that is not among the samples.
    assert_eq!(d.problems.len(), 12, "{:#?}", messages(&d));

    let d = deck_in(&folder, "rowan_run0010_5_MAIN.key");
    assert_eq!(d.includes.iter().map(|i| i.at.line).collect::<Vec<_>>(), [9, 13, 17]);
    let d = deck_in(&folder, "rowan_run0010_5_DATAbase_cards.key");
    assert_eq!((d.outputs.len(), &*d.history_node_sets), (7, &[3, 4][..]));
    assert_eq!(messages(&d), [""; 0]);
}

/// An include without an end, such as one that the whole world includes again and again.
#[test]
fn a_deck_and_its_includes_are_read_up_to_a_bound() {
    let mut open = |_: &str| -> Option<Box<dyn BufRead>> {
        Some(Box::new(io::BufReader::with_capacity(1 << 20, io::repeat(b' '))))
    };
    let error =
        parse_deck(&mut &b"*KEYWORD\n*INCLUDE\nendless.k\n*END\n"[..], &mut open).unwrap_err();
    assert_eq!(error.to_string(), "a deck is read up to 4 GB with its includes; it has more");
}

#[test]
fn a_deck_that_is_no_plain_text_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("main.k");
    let wide: Vec<u8> = "*KEYWORD\n*TITLE\nrun\n".bytes().flat_map(|b| [b, 0]).collect();
    for bytes in [[&[0xff, 0xfe], &wide[..]].concat(), wide.clone()] {
        fs::write(&path, bytes).unwrap();
        let error = crumple::solver::read_deck(&path).unwrap_err().to_string();
        assert!(error.contains("main.k: this is UTF-16 text (convert it with iconv"), "{error}");
    }
}
