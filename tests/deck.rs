//! LS-DYNA decks: those of our own runs, and those of others.

use std::fs;
use std::io::{self, BufRead};
use std::path::Path;

use crate::common::{crumple_ok, fixture, says, shared};
use crumple::solver::{Deck, DeckEntity, DeckPlace, ProblemCode, Value, parse_deck};
use crumple::unit::UnitSystem;
use proptest::prelude::*;

fn messages(deck: &Deck) -> Vec<String> {
    deck.problems.iter().map(ToString::to_string).collect()
}

/// Ids and titles; of interfaces that have ids.
fn named(list: &[DeckEntity]) -> Vec<(i64, Option<&str>)> {
    list.iter().map(|n| (n.id.unwrap(), n.title.as_deref())).collect()
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
        let (impact, at) = d.impact_speed().unwrap();
        assert_eq!((impact, at.line), (speed, line), "{name}");
        assert_eq!(d.units.unwrap().system, Some(UnitSystem::parse("mm-t-s").unwrap()));
        assert_eq!((d.parts.len(), d.history_nodes.len(), d.outputs.len()), (6, 12, 5));
        assert_eq!(d.history_nodes[0].id, Some(900_001));
        assert_eq!(named(&d.parts)[0], (1, Some("long_beam_stage1")));
        assert_eq!(named(&d.rigid_walls), [(1, Some("rigid wall"))]);
        assert_eq!(named(&d.contacts), [(1, Some("self contact"))]);
        assert!(d.outputs.iter().all(|o| o.interval == Some(0.00075) && o.binary == Some(0)));
    }
}

/// A comment states units if it names a system.
#[test]
fn comments_on_other_units_state_none() {
    let units = |comment: &str| deck(&format!("$ {comment}\n*KEYWORD\n*END\n")).units;
    assert!(units("unloading stiffness in these units: 1.9e8").is_none());
    assert_eq!(units("units: mm-t-s").unwrap().system, UnitSystem::parse("mm-t-s").ok());
    assert_eq!(units("units: SI").unwrap().text, "SI");
}

/// Editors of Windows begin a file with a byte order mark, and write Latin-1: nothing is lost, not even a last letter.
#[test]
fn reads_decks_of_windows() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    fs::write(here.join("Träger.k"), "\u{feff}*INITIAL_VELOCITY\n0\n-15000.\n*END\n").unwrap();
    let latin1 = |text: &str| -> Vec<u8> { text.chars().map(|c| c as u8).collect() };
    let main =
        "*KEYWORD\n*TITLE\nFrontaler Stoß\n*PART\nCafé\n         7\n*INCLUDE\nTräger.k\n*END\n";
    fs::write(here.join("main.k"), latin1(main)).unwrap();
    let d = deck_in(here, "main.k");
    assert_eq!(messages(&d), [""; 0]);
    assert_eq!(d.title.as_deref(), Some("Frontaler Stoß"));
    assert_eq!(named(&d.parts), [(7, Some("Café"))]);
    let (speed, at) = d.impact_speed().unwrap();
    assert_eq!((speed, at), (15000.0, DeckPlace { line: 1, include: Some(0) }));
    fs::write(
        here.join("long.k"),
        "\u{feff}*KEYWORD LONG=Y\n*PART\nbox\n                   8\n*END\n",
    )
    .unwrap();
    assert_eq!(named(&deck_in(here, "long.k").parts), [(8, Some("box"))]);
}

fn ids(list: &[DeckEntity]) -> Vec<Option<i64>> {
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
    assert_eq!(d.impact_speed().map(|(speed, at)| (speed, at.line)), Some((50.0, 64)));
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
    assert_eq!(ids(&d.parts), [10, 20, 100, 110, 120, 101, 310].map(Some));
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
    let expected = "at most 4 GB of a deck and its includes are read; this one is larger";
    assert_eq!(error.to_string(), expected);
}

#[test]
fn a_deck_that_is_no_plain_text_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("main.k");
    let wide: Vec<u8> = "*KEYWORD\n*TITLE\nrun\n".bytes().flat_map(|b| [b, 0]).collect();
    for bytes in [[&[0xff, 0xfe], &wide[..]].concat(), wide.clone()] {
        fs::write(&path, bytes).unwrap();
        let error = crumple::solver::read_deck(&path).unwrap_err().to_string();
        says(&error, "main.k: this is UTF-16 text (convert it with iconv");
    }
}

fn deck(text: &str) -> Deck {
    deck_with(text, &[])
}

/// A deck with its included files.
fn deck_with(text: &str, files: &[(&str, &str)]) -> Deck {
    let mut open = |name: &str| {
        let (_, text) = files.iter().find(|(n, _)| *n == name)?;
        Some(Box::new(io::Cursor::new(text.as_bytes().to_vec())) as Box<dyn BufRead>)
    };
    parse_deck(&mut text.as_bytes(), &mut open).unwrap()
}

const CAR: &str = "\
*KEYWORD
*TITLE
$#                                                                         title
a car against a wall
$ units: Mg mm s N MPa
*DATABASE_NODOUT
$#      dt    binary
   0.00075         2
*DATABASE_RCFORC_MOMENT
    1.0E-4
*DATABASE_BINARY_D3PLOT
      0.01
*PART
crossbeam, left
         5         5         1

$ a blank title
         6         5         1
*INITIAL_VELOCITY
         2

 -6944.444         0         0
*RIGIDWALL_PLANAR_ID
         1rigid wall
         3         0         0         0
    -120.5         0         0     -20.5         0         0       0.2
*CONTACT_AUTOMATIC_SINGLE_SURFACE_ID
         7 self contact
         0         0         5         0
*DATABASE_HISTORY_NODE
    900001      5017      5145      2801      3153      3537      3889      4241
      4593
*DATABASE_HISTORY_NODE_ID
       201nose, upper
*DATABASE_HISTORY_NODE_SET
         3         4
*end
*PART
after the end
        99
";

#[test]
fn reads_what_names_and_sizes_a_run() {
    // The blank line is a card in *PART, so it must not be one in *INITIAL_VELOCITY here.
    let text = CAR.replace("         2\n\n -6944", "         2\n -6944");
    let d = deck(&text);
    assert_eq!(messages(&d), [""; 0]);
    assert_eq!(d.title.as_deref(), Some("a car against a wall"));
    let units = d.units.as_ref().unwrap();
    assert_eq!(units.at, DeckPlace { line: 5, include: None });
    assert_eq!(units.system, Some(UnitSystem::parse("t-mm-s").unwrap()));
    let outputs: Vec<_> = d.outputs.iter().map(|o| (o.file, o.interval, o.binary)).collect();
    assert_eq!(outputs, [("nodout", Some(0.00075), Some(2)), ("rcforc", Some(1.0e-4), None)]);
    assert_eq!(named(&d.parts), [(5, Some("crossbeam, left")), (6, None)]);
    assert_eq!(named(&d.rigid_walls), [(1, Some("rigid wall"))]);
    assert_eq!(named(&d.contacts), [(7, Some("self contact"))]);
    assert_eq!(d.history_nodes.len(), 10);
    assert_eq!(named(&d.history_nodes)[8..], [(4593, None), (201, Some("nose, upper"))]);
    assert_eq!(d.history_node_sets, [3, 4]);
    let (speed, at) = d.impact_speed().unwrap();
    assert_eq!((speed, at.line), (6944.444, 19));
    let mut crlf = deck(&text.replace('\n', "\r\n").replace("*PART", "*part  "));
    crlf.problems.clear();
    assert_eq!(crlf, d);
}

/// What `inspect` prints of it: units, speed, outputs, numbers with their titles, parameters, files.
#[test]
fn a_deck_is_printed() {
    let folder = tempfile::tempdir().unwrap();
    let more = "*PARAMETER\nR   speed    -6944.\nI   state         3\n*INCLUDE\nmesh.k\n*end\n";
    let text = CAR.replace("         2\n\n -6944", "         2\n -6944").replace("*end\n", more);
    fs::write(folder.path().join("car.k"), text).unwrap();
    let printed = crumple_ok(folder.path(), &["inspect", "car.k"]);
    for expected in [
        "units       Mg mm s N MPa",
        "speed       6944.444 (initial velocity, in the deck's units)",
        "nodout every 0.00075",
        "solver      LS-DYNA\n",
        "201  nose, upper",
        "7  self contact",
        "1  rigid wall",
        "5  crossbeam, left",
        "speed = -6944",
        "state = 3",
        "mesh.k  (not found)",
    ] {
        assert!(printed.contains(expected), "{printed}\nlacks {expected}");
    }
}

#[test]
fn a_blank_line_is_a_card() {
    let d = deck(CAR);
    assert_eq!(d.impact_speed(), None);
}

#[test]
fn interfaces_are_counted_when_none_has_an_id() {
    fn t(keywords: &str, expected: &[Option<i64>]) {
        let d = deck(keywords);
        let ids: Vec<_> = d.contacts.iter().chain(&d.rigid_walls).map(|i| i.id).collect();
        assert_eq!(ids, expected, "{keywords}");
    }
    t("*CONTACT_INTERIOR\n*CONTACT_A_B\n*CONTACT_C_D_MPP\n", &[Some(1), Some(2)]);
    t("*CONTACT_A_ID\n7\n*CONTACT_B\n", &[Some(7), None]);
    t("*CONTACT_A_ID_MPP\n\n*CONTACT_B\n", &[None, None]);
    t("*CONTACT_A\n*CONTACT_2D_AUTOMATIC\n", &[None, None]);
    t("*RIGIDWALL_PLANAR_FORCES\n*RIGIDWALL_PLANAR\n", &[Some(1), Some(2)]);
    t("*RIGIDWALL_PLANAR\n*RIGIDWALL_GEOMETRIC_FLAT\n", &[None, None]);
}

#[test]
fn parameters_hold_below_and_in_any_case() {
    let d = deck(
        "*DATABASE_GLSTAT\n&dt\n*PARAMETER\nR       dt     0.001I      bin         2\n\
         C     name      nose\nR speed,-10.5\n*PARAMETER_EXPRESSION\nR   dtplot         DT*2\n\
         R      two       2.0\n*DATABASE_NODOUT\n       &DT      &bin\n*DATABASE_RCFORC\n\
         &dtplot\n*DATABASE_RWFORC\n      &bin     &name\n*INITIAL_VELOCITY\n\n-&speed,&two\n",
    );
    let intervals: Vec<_> = d.outputs.iter().map(|o| (o.interval, o.binary)).collect();
    assert_eq!(intervals, [(None, None), (Some(0.001), Some(2)), (None, None), (Some(2.0), None)]);
    let value = |name: &str| &d.parameters.iter().find(|(n, _)| n == name).unwrap().1;
    assert_eq!(*value("name"), Value::Text("nose".into()));
    assert_eq!(*value("dtplot"), Value::Unknown);
    assert_eq!(
        messages(&d),
        [
            "line 2, columns 1-3: parameter \"dt\" is not defined above",
            "line 8: parameter \"dtplot\" is not evaluated: it is the expression DT*2",
            "line 15, columns 11-20: expected an integer, found \"&name\"",
        ]
    );
    let twice = deck("*PARAMETER\nR a,1.\nR A,1.\nR b,1.\nR b,2.\n");
    assert_eq!(twice.parameters, [("a".into(), Value::Real(1.0)), ("b".into(), Value::Unknown)]);
}

#[test]
fn includes_are_read_where_they_stand() {
    let main = "*INCLUDE_PATH\nmesh +\n/fine/\n*INCLUDE\ndt.k\nparts.k\n\ngone.k\n\
                *DATABASE_NODOUT\n&dt\n*INCLUDE_TRANSFORM\nx.k\n";
    let d = deck_with(
        main,
        &[
            ("dt.k", "*PARAMETER\nR dt,0.5\n*END\n*TITLE\nnever read\n"),
            ("mesh/fine/parts.k", "*PART\nnose\n1\n*INCLUDE\nparts.k\n*PART\ntail\nx\n"),
        ],
    );
    assert_eq!(d.title, None);
    assert_eq!(d.outputs[0].interval, Some(0.5));
    assert_eq!(d.parts[0].at, DeckPlace { line: 3, include: Some(1) });
    let includes: Vec<_> = d.includes.iter().map(|i| (&*i.name, i.found, i.at.line)).collect();
    assert_eq!(
        includes,
        [("dt.k", true, 5), ("parts.k", true, 6), ("parts.k", true, 5), ("gone.k", false, 8)]
    );
    assert_eq!(
        messages(&d),
        [
            "line 5: include \"parts.k\" includes itself; it is not read again (in \"mesh/fine/parts.k\")",
            "line 8, columns 1-1: expected an integer, found \"x\" (in \"mesh/fine/parts.k\")",
            "line 8: include \"gone.k\" is missing",
            "line 11: *INCLUDE_TRANSFORM: files included by this keyword are not read",
        ]
    );
}

#[test]
fn includes_end_somewhere() {
    // Every name opens a file that includes two new names.
    let mut open = |name: &str| {
        let text = format!("*INCLUDE\n{name}a\n{name}b\n");
        Some(Box::new(io::Cursor::new(text.into_bytes())) as Box<dyn BufRead>)
    };
    let d = parse_deck(&mut &b"*INCLUDE\nx\n"[..], &mut open).unwrap();
    assert_eq!(d.includes.len(), 1000);
    let messages = messages(&d);
    let deep = "include \"xaaaaaaaaaaaaaaaa\" is more than 16 files deep; it is left out";
    assert!(messages.iter().any(|m| m.contains(deep)), "{messages:?}");
    assert!(messages.iter().any(|m| m == "includes beyond the first 1000 are left out"));
}

#[test]
fn reads_the_long_format() {
    let long = "*CONTACT_TIED_ID\n                   3nose\n*DATABASE_NODOUT\n             \
                0.00075                   2\n*DATABASE_HISTORY_NODE -\n        11        12\n";
    let d = deck(&format!("*KEYWORD LONG=Y\n{long}"));
    assert_eq!(named(&d.contacts), [(3, Some("nose"))]);
    assert_eq!((d.outputs[0].interval, d.outputs[0].binary), (Some(0.00075), Some(2)));
    assert_eq!(named(&d.history_nodes), [(11, None), (12, None)]);
    let one = deck("*DATABASE_NODOUT +\n                0.25                   2\n");
    assert_eq!((one.outputs[0].interval, one.outputs[0].binary), (Some(0.25), Some(2)));
}

#[test]
fn units_of_the_card_stand_above_comments() {
    let card = "*CONTROL_UNITS\n$   LENGTH      TIME      MASS\n        mm       sec  mtrc_ton\n";
    let d = deck(&format!("$ units: Mg mm s N MPa\n{card}$ units: mm-t-s\n"));
    assert_eq!(messages(&d), [""; 0]);
    let units = d.units.unwrap();
    assert_eq!((&*units.text, units.at.line), ("mm sec mtrc_ton", 4));
    assert_eq!(units.system, Some(UnitSystem::parse("mm-t-s").unwrap()));
    let d = deck(&format!("$ units: kg mm ms\n{card}$ units: mm-t-s\n"));
    assert_eq!(
        messages(&d),
        ["line 4: units \"mm sec mtrc_ton\" contradict \"kg mm ms\" of line 1"]
    );
    assert_eq!(d.units.unwrap().system, None);
    assert_eq!(deck("*CONTROL_UNITS\n\n").units.unwrap().system, Some(UnitSystem::SI));
    // Blanks part no fields.
    assert_eq!(deck("*CONTROL_UNITS\nmm sec mtrc_ton\n").units.unwrap().system, None);
}

#[test]
fn damage_is_named_and_the_deck_goes_on() {
    let d = deck(
        "* \n*PART\nnose\n     x2\n*PART\ntail\n*DATABASE_NODOUT\n 1.2.3\n*CONTACT_A_ID\n\
         *INITIAL_VELOCITY\n\n1E999\n*DATABASE_HISTORY_NODE\n1,2x,3\n*PARAMETER\nX y,1\n\
         *INCLUDE\nname +\n",
    );
    assert_eq!(named(&d.history_nodes), [(1, None), (3, None)]);
    assert_eq!(
        messages(&d),
        [
            "line 1: expected a keyword, found \"* \"",
            "line 4, columns 1-7: expected an integer, found \"x2\"",
            "line 5: *PART: expected a card with the part's id below its title, found its end",
            "line 8, columns 1-6: expected a real number, found \"1.2.3\"",
            "line 9: *CONTACT_A_ID: expected a card with its id, found its end",
            "line 12, columns 1-5: expected a real number, found \"1E999\"",
            "line 14, columns 3-4: expected an integer, found \"2x\"",
            "line 16, columns 1-3: expected R, I or C and a parameter's name, found \"X y\"",
            "line 17: *INCLUDE: expected a file name that ends, found its end",
        ]
    );
    assert_eq!((d.problems[3].code, d.problems[3].byte), (ProblemCode::BadField, Some(50)));
}

#[test]
fn lists_are_bounded() {
    let mut text = String::from("*DATABASE_HISTORY_NODE\n");
    for id in 1..=100_001 {
        text.push_str(&format!("{id}\n"));
    }
    let d = deck(&text);
    assert_eq!(d.history_nodes.len(), 100_000);
    assert_eq!(messages(&d), ["history nodes beyond the first 100000 are left out"]);
}

proptest! {
    #[test]
    fn any_bytes_are_read(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        parse_deck(&mut &bytes[..], &mut |_| None).unwrap();
    }

    /// Damaged decks reach further than bytes without sense.
    #[test]
    fn damaged_decks_are_read(at in 0..CAR.len(), with: u8, cut in 0..CAR.len()) {
        let mut bytes = CAR.as_bytes().to_vec();
        bytes[at] = with;
        bytes.truncate(cut);
        parse_deck(&mut &bytes[..], &mut |_| None).unwrap();
    }
}
