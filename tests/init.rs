//! `crumple init`: studies proposed for run folders, compared with the ones that were written by
//! hand and against crashes whose numbers are known; scenarios proposed for models; and the commands
//! that go with them, `inspect` of folders and `build` without arguments.

use std::fs;
use std::path::{Path, PathBuf};

use crumple::curve::Case;
use crumple::database::Database;
use serde_json::Value;
use toml::Table;

use crate::common::containers::{binout_of, binout_with};
use crate::common::crash::{Crash, Force, History, Layout, MM_KG_MS, MM_T_S, Motions, Node, SI};
use crate::common::{
    crumple_fails, crumple_in, crumple_ok, demo_folder, entries, fixture, is_thorough,
    is_with_shared, json, samples_by_kind, says, shared,
};

fn study(folder: &Path, name: &str) -> Table {
    fs::read_to_string(folder.join(name)).unwrap().parse().unwrap()
}

/// What a run that does its work says on standard error.
fn warned(folder: &Path, line: &str) -> String {
    let output = crumple_in(folder, line);
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stderr).unwrap()
}

/// Copies files of a run by name.
fn copy_run(from: &Path, to: &Path, files: &[&str]) {
    fs::create_dir_all(to).unwrap();
    for file in files.iter().filter(|file| from.join(file).exists()) {
        fs::copy(from.join(file), to.join(file)).unwrap();
    }
}

const TEXTS: &[&str] = &["nodout", "rwforc", "rcforc"];
const T01: &[&str] = &["crashT01"];

/// The runs of a group with some of their files, and beside them the study that was written by hand.
fn group(source: &Path, files: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    // The name of the folder is the group's.
    let group = folder.path().join(source.file_name().unwrap());
    for run in entries(source).iter().filter(|run| source.join(run).is_dir()) {
        copy_run(&source.join(run), &group.join(run), files);
    }
    let all = source.join("study-all.toml");
    let study = if all.exists() { all } else { source.join("study.toml") };
    fs::copy(study, group.join("shipped.toml")).unwrap();
    folder
}

/// A mass or speed of a study in its unit.
fn number(text: &toml::Value, unit: &str) -> f64 {
    text.as_str().unwrap().strip_suffix(unit).unwrap().parse().unwrap()
}

fn by_path(study: &Table) -> Vec<(String, f64, f64)> {
    let mut runs: Vec<(String, f64, f64)> = study["run"]
        .as_array()
        .unwrap()
        .iter()
        .map(|run| {
            let path = run["path"].as_str().unwrap().to_string();
            let mass = &run["mass"];
            let tonnes = match mass.as_str().unwrap().ends_with("kg") {
                true => 1e-3 * number(mass, "kg"),
                false => number(mass, "t"),
            };
            (path, number(&run["speed"], "km/h"), tonnes)
        })
        .collect();
    runs.sort_by(|a, b| a.0.cmp(&b.0));
    runs
}

/// The study by init says what the shipped one says, and its curves are the same; returns init's
/// cases.
fn like_shipped(source: &Path, files: &[&str], options: &[&str]) -> Vec<Case> {
    let folder = group(source, files);
    let name = source.file_name().unwrap().to_str().unwrap();
    let here = folder.path().join(name);
    crumple_ok(&here, &[&["init"], options].concat());
    let (ours, shipped) = (study(&here, "study.toml"), study(&here, "shipped.toml"));
    for key in ["group", "units", "kind", "half_model"] {
        assert_eq!(ours["study"].get(key), shipped["study"].get(key), "{name}: {key}");
    }
    for key in ["deflection", "force", "filter", "sampling"] {
        let (ours, shipped) = (&ours["recipe"][key], &shipped["recipe"][key]);
        // The shipped number of states is short by one or two where the contact comes later.
        let is_short = key == "sampling"
            && ours["interval_ms"] == shipped["interval_ms"]
            && (398..=400).contains(&ours["states"].as_integer().unwrap());
        assert!(ours == shipped || is_short, "{name}: {key}: {ours}");
    }
    let (ours, shipped) = (by_path(&ours), by_path(&shipped));
    assert_eq!(ours.len(), shipped.len(), "{name}");
    for ((path, speed, mass), (of, speed_of, mass_of)) in ours.iter().zip(&shipped) {
        assert_eq!(path, of);
        assert!((speed / speed_of - 1.0).abs() < 1e-3, "{name}/{path}: {speed} km/h");
        assert!((mass / mass_of - 1.0).abs() < 1e-2, "{name}/{path}: {mass} t");
    }
    crumple_ok(&here, "build -q");
    crumple_ok(&here, "build shipped.toml -o shipped.h5 -q");
    let cases = |file: &str| Database::read(&here.join(file)).unwrap().cases(name).to_vec();
    let (ours, shipped) = (cases("curves.h5"), cases("shipped.h5"));
    assert_eq!(ours.len(), shipped.len());
    for (ours, shipped) in ours.iter().zip(&shipped) {
        assert_eq!(ours.id.name, shipped.id.name);
        assert_eq!(
            ours.curves.original, shipped.curves.original,
            "{name}: the curve of {} in bits",
            ours.id.name
        );
        let (a, b) = (ours.curves.sampled.deflection_m(), shipped.curves.sampled.deflection_m());
        let both = a.len().min(b.len());
        assert!(both >= 397, "{}", ours.id.name);
        assert_eq!(a[..both], b[..both]);
        assert_eq!(ours.curves.sampled.force_n()[..both], shipped.curves.sampled.force_n()[..both]);
    }
    ours
}

#[test]
fn bundled_runs_give_the_shipped_studies() {
    like_shipped(&fixture("fe/lead-car-wall"), TEXTS, &[]);
    like_shipped(&fixture("fe/lead-car-pair"), TEXTS, &[]);
    like_shipped(&fixture("fe/vehicle-pair"), TEXTS, &["--half-model"]);
    like_shipped(&fixture("fe/steel-rail"), T01, &[]);
}

/// What holds for many runs is said once.
#[test]
fn notes_of_many_runs_are_lines_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let study = fixture("fe/steel-rail/study.toml");
    let printed = crumple_ok(folder.path(), &["build", study.to_str().unwrap(), "-o", "c.h5"]);
    let notes: Vec<&str> = printed.lines().filter_map(|line| line.strip_prefix("note: ")).collect();
    let of_all = notes.iter().filter(|note| note.starts_with("all 7 runs: ")).count();
    assert_eq!(of_all, 4, "{printed}");
    says(&printed, "\nnote: all 7 runs: rwforc: read from section rwforc of crashT01\n");
    says(
        &printed,
        "\nnote: 27kmh, 34kmh: short: the record holds 447 of 449 states from contact on\n",
    );
    assert_eq!(notes.len(), 7, "{printed}");
}

/// Of text and T01 of one run the curves differ by what the text's six digits round: in deflection
/// by 2e-5 m at most (bodies move by up to 6 m), in force by 1e-5 of the peak.
#[test]
#[ignore = "needs ../shared (the real files)"]
fn shared_runs_give_the_shipped_studies_from_text_and_from_t01() {
    for (name, options) in [
        ("lead-car-wall", &[][..]),
        ("lead-car-pair", &[]),
        ("vehicle-pair", &["--half-model"]),
        ("lead-car-b-wall", &[]),
        ("lead-car-wall-perturbed", &[]),
        ("vehicle-ends", &[]),
    ] {
        let source = shared(&format!("fe/{name}"));
        let text = like_shipped(&source, TEXTS, options);
        let binary = like_shipped(&source, T01, options);
        for (text, binary) in text.iter().zip(&binary) {
            let far = |a: &[f64], b: &[f64]| {
                assert_eq!(a.len(), b.len());
                a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
            };
            let (a, b) = (&text.curves.original, &binary.curves.original);
            let peak = a.force_n().iter().copied().fold(0.0, f64::max);
            let deflection_m = far(a.deflection_m(), b.deflection_m());
            assert!(deflection_m < 2e-5, "{name}/{}: {deflection_m}", text.id.name);
            let force = far(a.force_n(), b.force_n()) / peak;
            assert!(force < 1e-5, "{name}/{}: {force}", text.id.name);
        }
    }
}

/// The runs of a bundled group again, each as one binout.
fn as_binouts(group: &str) -> tempfile::TempDir {
    let source = fixture(&format!("fe/{group}"));
    let folder = tempfile::tempdir().unwrap();
    for run in entries(&source).iter().filter(|run| source.join(run).is_dir()) {
        let to = folder.path().join(group).join(run);
        fs::create_dir_all(&to).unwrap();
        fs::write(to.join("binout0000"), binout_of(&source.join(run))).unwrap();
    }
    folder
}

/// What text files say, a binout of the same histories says in the same words.
#[test]
fn a_binout_gives_the_proposal_of_its_texts() {
    for (group_name, options) in
        [("lead-car-wall", &[][..]), ("lead-car-pair", &[]), ("vehicle-pair", &["--half-model"])]
    {
        let (text, binout) =
            (group(&fixture(&format!("fe/{group_name}")), TEXTS), as_binouts(group_name));
        let proposed = |folder: &tempfile::TempDir| {
            let here = folder.path().join(group_name);
            let document = json(&crumple_ok(&here, &[&["init", "--json"], options].concat()));
            (document, study(&here, "study.toml"), here)
        };
        let (mut of_text, texts_study, _) = proposed(&text);
        let (mut of_binout, binouts_study, here) = proposed(&binout);
        assert_eq!(texts_study, binouts_study, "{group_name}");
        let said = |document: &mut Value, by: &str| {
            let from = document["filter"]["from"].take();
            let means = "\"smp d R14 (from OpenRadioss T01)\": a mean over two intervals";
            assert!(from.as_str().unwrap().starts_with(&format!("{by} {means}")), "{from}");
        };
        said(&mut of_text, "its second line reads");
        said(&mut of_binout, "its version is");
        assert_eq!(of_text, of_binout, "{group_name}");
        crumple_ok(&here, "build -q");
    }
}

/// Slow impacts in millimetres have numbers that are small for mm and large for m.
const SLOW: [(&str, &str, f64); 3] = [
    ("vehicle-pair", "3kmh", 1.5),
    ("vehicle-pair", "6kmh", 3.0),
    ("lead-car-wall", "12kmh", 12.0),
];

/// A run alone tells its units by itself, with nothing to guess if its folder states the speed.
fn tells_millimetres(run: &Path, km_per_h: f64) {
    let document = json(&crumple_ok(run, "init --json -o alone.toml"));
    let units = &document["units"];
    assert_eq!(units["value"], "mm-t-s", "{}: {units}", run.display());
    // Slow ones could be fast in inches; a folder's name that states the speed settles it.
    let is_named = run.file_name().unwrap().to_str().unwrap().ends_with("kmh");
    let expected = if is_named || km_per_h > 10.0 { "computed" } else { "guessed" };
    assert_eq!(units["evidence"], expected, "{}: {units}", run.display());
    let speed = document["runs"][0]["speed_m_per_s"]["value"].as_f64().unwrap();
    assert!((speed * 3.6 / km_per_h - 1.0).abs() < 1e-3, "{}: {speed} m/s", run.display());
}

#[test]
fn slow_runs_alone_tell_their_units() {
    for (group, run, km_per_h) in SLOW {
        let from = fixture(&format!("fe/{group}")).join(run);
        let folder = tempfile::tempdir().unwrap();
        let (text, binout) = (folder.path().join("text"), folder.path().join(run));
        copy_run(&from, &text, TEXTS);
        // Without a force nothing tells the mass, which is half of what tells the units.
        let motion = folder.path().join("motion");
        copy_run(&from, &motion, &["nodout"]);
        fs::create_dir(&binout).unwrap();
        fs::write(binout.join("binout"), binout_of(&from)).unwrap();
        [text, binout, motion].iter().for_each(|run| tells_millimetres(run, km_per_h));
    }
}

#[test]
#[ignore = "needs ../shared (the real files)"]
fn slow_runs_alone_tell_their_units_from_t01_and_full_texts() {
    for (group, run, km_per_h) in SLOW {
        let from = shared("fe").join(group).join(run);
        for files in [T01, TEXTS] {
            let folder = tempfile::tempdir().unwrap();
            copy_run(&from, &folder.path().join(run), files);
            tells_millimetres(&folder.path().join(run), km_per_h);
        }
    }
}

/// What the text of a study says above a key.
fn comment_above<'a>(text: &'a str, key: &str) -> Vec<&'a str> {
    let lines: Vec<&str> = text.lines().collect();
    let at = lines.iter().position(|line| line.starts_with(&format!("{key} ="))).unwrap();
    let from = lines[..at].iter().rposition(|line| !line.starts_with('#')).unwrap_or(0);
    lines[from + 1..at].to_vec()
}

#[test]
fn every_value_says_where_it_is_from() {
    let folder = group(&fixture("fe/lead-car-wall"), TEXTS);
    let here = folder.path().join("lead-car-wall");
    let text = crumple_ok(&here, "init -o -");
    assert_eq!(entries(&here).iter().filter(|name| *name == "study.toml").count(), 0);
    let above = |key: &str| comment_above(&text, key).join(" ").replace(" #  ", "");
    assert!(above("name").contains("guessed: name of the folder above the runs"));
    let units = above("units");
    for why in [
        "computed: the only usual system",
        "SI would give an impact at 3333 m/s",
        "mm-kg-ms would give a crush that takes 53.3 µs",
    ] {
        says(&units, why);
    }
    assert!(above("kind").contains("guessed: one body moves, and a rigid wall stops it"));
    assert!(above("deflection").contains("node \"COG of the rigid trailing mass\""));
    assert!(above("filter").contains("read: its second line reads"), "{}", above("filter"));
    assert!(text.contains("# CANNOT BE DETERMINED: is this one body of a pair"));
    assert!(text.contains("\n# half_model = true\n"));
    says(
        &text,
        "# read: x_velocity of 900001 in the first state: -3333.33 mm/s\nspeed = \"12km/h\"",
    );
    says(&text, "# mass: computed: impulse of the force over the change of velocity, after");
    assert!(text.lines().all(|line| line.chars().count() <= 110), "no line is too long");
    // The same as one document.
    let document = json(&crumple_ok(&here, "init --json -o other.toml"));
    assert_eq!(document["study"], "other.toml");
    assert_eq!(document["complete"], true);
    assert_eq!(document["units"]["value"], "mm-t-s");
    assert_eq!(document["units"]["evidence"], "computed");
    assert_eq!(document["deflection"]["value"]["node"], 900001);
    assert_eq!(document["kind"]["value"], "wall");
    assert_eq!(document["runs"].as_array().unwrap().len(), 7);
    assert_eq!(document["runs"][0]["speed_m_per_s"]["evidence"], "read");
    assert_eq!(fs::read_to_string(here.join("other.toml")).unwrap(), text);
}

/// A half model cannot be seen, but the names of its folders may tell.
#[test]
fn half_models_are_asked_for() {
    let folder = group(&fixture("fe/vehicle-pair"), TEXTS);
    let here = folder.path().join("vehicle-pair");
    let said = warned(&here, "init");
    says(&said, "the folders' names state twice the recorded speeds");
    let ours = study(&here, "study.toml");
    assert_eq!(ours["study"]["kind"].as_str(), Some("wall"));
    assert_eq!(by_path(&ours)[0].1, 6.0, "12kmh");
    fs::remove_file(here.join("study.toml")).unwrap();
    let output = crumple_in(&here, "init --half-model --strict");
    assert_eq!(String::from_utf8(output.stderr).unwrap(), "");
    assert_eq!(output.status.code(), Some(0));
    // Their names may state the record's own speed, half of the closing speed, too.
    for (from, to, looks) in [("12kmh", "a-6kmh", 0), ("25kmh", "b-13kmh", 1)] {
        fs::rename(here.join(from), here.join(to)).unwrap();
        let said = warned(&here, "init --half-model -o named.toml");
        assert_eq!(said.matches("the folder's name states").count(), looks, "{said}");
        let text = fs::read_to_string(here.join("named.toml")).unwrap();
        let look = "the folder's name states 13 km/h, the record 12.5 km/h";
        assert_eq!(text.matches(look).count(), looks, "{text}");
        says(&text, "# computed: twice the x_velocity of");
        fs::remove_file(here.join("named.toml")).unwrap();
    }
    // Two bodies are not a half model, one body is not a pair.
    let pair = group(&fixture("fe/lead-car-pair"), TEXTS);
    let there = pair.path().join("lead-car-pair");
    says(&crumple_fails(&there, 1, "init --half-model"), "two bodies move in these runs");
    fs::remove_file(here.join("study.toml")).unwrap();
    says(&crumple_fails(&here, 1, "init --kind pair"), "only one body moves in these runs");
    assert_eq!(entries(&here).iter().filter(|name| *name == "study.toml").count(), 0);
}

fn node(id: i64, title: &'static str, body: usize, mass: usize, shakes: f64) -> Node {
    Node { id, title, on: Some((body, mass)), shakes }
}

/// The nodes that the user names are taken, also where another one follows the force better.
#[test]
fn the_nodes_of_the_user_are_taken() {
    let crash =
        Crash { body_kg: 24e3, other_kg: Some(48e3), speed_m_per_s: 15.0, ..Crash::default() };
    let mut history = crash.run();
    // It has half of what the force alone would give both, without waves in a crush zone.
    let mut third = Motions::default();
    let (mut x_m, mut v_m_per_s) = (0.0, 0.5 * crash.speed_m_per_s);
    for force_n in &history.contact_n {
        v_m_per_s -= 0.5 * force_n * crash.interval_s * (1.0 / 24e3 - 1.0 / 48e3);
        x_m += v_m_per_s * crash.interval_s;
        third.displacement_m[4].push(x_m);
        third.velocity_m_per_s[4].push(v_m_per_s);
    }
    history.bodies.push(third);
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("pair/a");
    let layout = Layout { units: MM_T_S, axis: 0, sign: 1.0 };
    let nodes = [(101, 0, 0.03), (202, 1, 0.0), (303, 2, 0.0)];
    let nodes = nodes.map(|(id, body, shakes)| node(id, "", body, 4, shakes));
    layout.nodout(&run, &history, &nodes);
    let contact = Force { id: 1, title: "contact", along_n: &history.contact_n, across_n: 0.0 };
    layout.rcforc(&run, &history, &[contact]);
    let here = folder.path().join("pair");
    crumple_ok(
        &here,
        "init --kind pair --node 101 --minus-node 202 --mass 24t --other-mass 48t --units mm-t-s",
    );
    let found = study(&here, "study.toml");
    let deflection = &found["recipe"]["deflection"];
    assert_eq!(deflection["node"].as_integer(), Some(101));
    assert_eq!(deflection["minus_node"].as_integer(), Some(202));
}

/// Nodes of a car with its crush zone, some hundred on its body, and some that stand still.
fn car_nodes() -> Vec<Node> {
    let on = |id, mass, shakes| Node { id, title: "", on: Some((0, mass)), shakes };
    let mut nodes = vec![
        Node { id: 1, title: "ground", on: None, shakes: 0.0 },
        on(11, 0, 0.0),
        on(12, 1, 0.0),
        on(13, 2, 0.0),
    ];
    nodes.extend((0..150).map(|k| on(1_000 + k, 4, 0.02 + 0.001 * (k % 7) as f64)));
    nodes.push(on(777, 4, 0.001));
    nodes
}

/// A run with several walls and interfaces, of which one stops the car.
fn write_car(layout: Layout, folder: &Path, history: &History, nodes: &[Node]) {
    let weight = vec![30.0; history.time_s.len()];
    let inner = &history.bodies[0].section_n;
    let left: Vec<f64> = inner.iter().map(|f| 0.4 * f).collect();
    layout.nodout(folder, history, nodes);
    layout.rwforc(
        folder,
        history,
        &[
            Force { id: 1, title: "ground", along_n: &weight, across_n: 12_000.0 },
            Force { id: 7, title: "barrier", along_n: &history.contact_n, across_n: 0.0 },
        ],
    );
    layout.rcforc(
        folder,
        history,
        &[
            Force { id: 3, title: "box to body", along_n: inner, across_n: 0.0 },
            Force { id: 4, title: "left box to body", along_n: &left, across_n: 0.0 },
        ],
    );
}

/// A car of 1.2 t at 50 km/h with hundreds of nodes and several forces, in units and directions of
/// all kinds: the wall is found, the smoothest node of the body, speed and mass.
#[test]
fn node_force_units_and_mass_are_found_in_any_units_and_direction() {
    let history = Crash::default().run();
    for (units, name) in [(MM_T_S, "mm-t-s"), (MM_KG_MS, "mm-kg-ms"), (SI, "SI")] {
        for (axis, sign) in [(0, 1.0), (1, -1.0), (2, 1.0)] {
            let folder = tempfile::tempdir().unwrap();
            let layout = Layout { units, axis, sign };
            write_car(layout, &folder.path().join("cars/50kmh"), &history, &car_nodes());
            let here = folder.path().join("cars");
            let printed = crumple_ok(&here, "init");
            let found = study(&here, "study.toml");
            let what = format!("{name} along {axis}:\n{printed}");
            assert_eq!(found["study"]["units"].as_str(), Some(name), "{what}");
            let direction = ["x", "y", "z"][axis];
            let deflection = &found["recipe"]["deflection"];
            assert_eq!(deflection["node"].as_integer(), Some(777), "{what}");
            let component = format!("{direction}_displacement");
            assert_eq!(deflection["component"].as_str(), Some(&*component), "{what}");
            let force = &found["recipe"]["force"];
            assert_eq!(force["file"].as_str(), Some("rwforc"), "{what}");
            assert_eq!(force["id"].as_integer(), Some(7), "{what}");
            assert_eq!(force["component"].as_str(), Some("normal_force"), "{what}");
            assert_eq!(found["recipe"]["filter"].as_str(), Some("CFC60"), "{what}");
            let run = &found["run"][0];
            assert!((number(&run["speed"], "km/h") / 50.0 - 1.0).abs() < 1e-3, "{what}");
            assert!((number(&run["mass"], "t") / 1.2 - 1.0).abs() < 1e-2, "{what}");
            crumple_ok(&here, "build -q");
        }
    }
}

/// Two bodies of different mass, both moving: both nodes, both masses, the closing speed.
#[test]
fn pairs_have_both_bodies() {
    let crash = Crash {
        other_kg: Some(2_000.0),
        speed_m_per_s: 12.0,
        other_speed_m_per_s: 4.0,
        gap_m: 0.05,
        ..Crash::default()
    };
    let history = crash.run();
    let nodes = [
        node(5, "", 0, 0, 0.0),
        node(6, "", 0, 4, 0.01),
        node(8, "CG of truck", 1, 4, 0.004),
        node(9, "", 1, 4, 0.001),
        node(10, "", 1, 0, 0.0),
    ];
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("pair/a");
    let layout = Layout { units: MM_KG_MS, axis: 0, sign: -1.0 };
    layout.nodout(&run, &history, &nodes);
    let inner = &history.bodies[1].section_n;
    layout.rcforc(
        &run,
        &history,
        &[
            Force { id: 2, title: "car to truck", along_n: &history.contact_n, across_n: 300.0 },
            Force { id: 1, title: "box of truck", along_n: inner, across_n: 0.0 },
        ],
    );
    let here = folder.path().join("pair");
    crumple_ok(&here, "init");
    let found = study(&here, "study.toml");
    assert_eq!(found["study"]["kind"].as_str(), Some("pair"));
    let deflection = &found["recipe"]["deflection"];
    assert_eq!(deflection["node"].as_integer(), Some(6));
    assert_eq!(deflection["minus_node"].as_integer(), Some(8), "its title says so");
    let force = &found["recipe"]["force"];
    assert_eq!((force["id"].as_integer(), force["side"].as_str()), (Some(2), Some("surfa")));
    let run = &found["run"][0];
    assert!((number(&run["speed"], "km/h") / (16.0 * 3.6) - 1.0).abs() < 1e-3);
    assert!((number(&run["mass"], "t") / 1.2 - 1.0).abs() < 1e-2);
    assert!((number(&run["other_mass"], "t") / 2.0 - 1.0).abs() < 1e-2);
    let text = fs::read_to_string(here.join("study.toml")).unwrap();
    says(&text, "or side = \"surfb\", which has the same force");
    says(&text, "or node 9: follows the impulse within");
    says(&text, "or rcforc 1: \"box of truck\", bodies follow it within");
    // In the other order if that is requested.
    crumple_ok(&here, "init --node 9 --minus-node 6 -o turned.toml");
    let turned = study(&here, "turned.toml");
    assert_eq!(turned["recipe"]["deflection"]["node"].as_integer(), Some(9));
    assert!((number(&turned["run"][0]["mass"], "t") / 2.0 - 1.0).abs() < 1e-2);
    crumple_ok(&here, "build -q");
    let exchanged = fs::read_to_string(here.join("study.toml")).unwrap();
    let (mass, other) = (run["mass"].as_str().unwrap(), run["other_mass"].as_str().unwrap());
    let exchanged = exchanged.replace(&format!("mass = \"{mass}\""), "mass = \"M\"");
    let exchanged = exchanged.replace(&format!("\"{other}\""), &format!("\"{mass}\""));
    fs::write(here.join("exchanged.toml"), exchanged.replace("\"M\"", &format!("\"{other}\"")))
        .unwrap();
    let said = warned(&here, "build exchanged.toml -o exchanged.h5");
    says(&said, "mass: by the velocity changes of the two bodies, the other one has 1.6");
    says(&said, "they are swapped");
    // A quarter too light or too heavy is the same to it, and not swapped.
    for (factor, name) in [(1.3, "heavy"), (1.0 / 1.3, "light")] {
        let text = fs::read_to_string(here.join("study.toml")).unwrap();
        let off = format!("\"{}t\"", factor * number(&run["other_mass"], "t"));
        let text = text.replace(&format!("\"{other}\""), &off);
        fs::write(here.join("off.toml"), text).unwrap();
        let said = warned(&here, &format!("build off.toml -o {name}.h5"));
        says(&said, "one of them is wrong, the node of another body");
    }
    // What a model says of them has both masses, too.
    crumple_ok(&here, "train curves.h5 --model nearest -o pair.model -q");
    crumple_ok(&here, "predict pair.model --speed 57.6km/h -o pair.csv -q");
    let csv = fs::read_to_string(here.join("pair.csv")).unwrap();
    for (name, kg) in [("mass_kg", 1_200.0), ("other_mass_kg", 2_000.0)] {
        let line = csv.lines().find_map(|line| line.strip_prefix(&format!("# {name}: ")));
        let found: f64 = line.unwrap().parse().unwrap();
        assert!((found / kg - 1.0).abs() < 1e-2, "{name}: {found}");
    }
    // A body force is the mass of its node's body times its acceleration, also of the other body.
    let recipe = fs::read_to_string(here.join("study.toml")).unwrap();
    let line = recipe.lines().find(|line| line.starts_with("force =")).unwrap();
    let contact = line.replacen("force", "contact", 1);
    let work_over_energy = |node: i64| {
        let force = format!(
            "force = {{ file = \"nodout\", node = {node}, times = \"mass\", component = \"x_velocity\" }}\n{contact}"
        );
        fs::write(here.join("body.toml"), recipe.replace(line, &force)).unwrap();
        crumple_ok(&here, "build body.toml -o body.h5 -q");
        let shown: Value = json(&crumple_ok(&here, "db ls body.h5 --json"));
        fs::remove_file(here.join("body.h5")).unwrap();
        let groups = shown["groups"].as_object().unwrap();
        groups.values().next().unwrap()[0]["work_over_energy"].as_f64().unwrap()
    };
    let [own, others] = [6, 8].map(work_over_energy);
    assert!((others / own - 1.0).abs() < 0.05, "{others} for {own}");

    // Where the truck is the faster one in another run, its nodes are still those of the truck.
    let crash = Crash { speed_m_per_s: 3.0, other_speed_m_per_s: 12.0, ..crash };
    let history = crash.run();
    let b = folder.path().join("pair/b");
    layout.nodout(&b, &history, &nodes);
    let truck =
        Force { id: 2, title: "car to truck", along_n: &history.contact_n, across_n: 300.0 };
    layout.rcforc(&b, &history, &[truck]);
    assert!(!warned(&here, "init -o both.toml").contains("left out"));
    let both = study(&here, "both.toml");
    assert_eq!(both["run"].as_array().unwrap().len(), 2, "{both}");
    for run in both["run"].as_array().unwrap() {
        assert!((number(&run["mass"], "t") / 1.2 - 1.0).abs() < 1e-2, "{run}");
        let closing = if run["path"].as_str() == Some("a") { 16.0 } else { 15.0 };
        assert!((number(&run["speed"], "km/h") / (closing * 3.6) - 1.0).abs() < 1e-3, "{run}");
    }
}

/// Bodies that meet each other and of which nothing but their motion is recorded.
const MOTION_ONLY: Crash = Crash {
    body_kg: 1_200.0,
    other_kg: Some(2_000.0),
    speed_m_per_s: 12.0,
    other_speed_m_per_s: 4.0,
    gap_m: 0.05,
    duration_s: 0.12,
    interval_s: 2e-4,
};

/// A kinetic energy at the start is that of the body that moves; the other one's mass follows from both changes of velocity.
#[test]
fn a_standing_body_is_as_heavy_as_it_is() {
    let crash = Crash { other_kg: Some(2_000.0), duration_s: 0.2, ..Crash::default() };
    let history = crash.run();
    let nodes = [node(5, "CG of car", 0, 4, 0.0), node(9, "CG of other", 1, 4, 0.0)];
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let run = here.join("pair/a");
    let layout = Layout { units: MM_T_S, axis: 0, sign: 1.0 };
    layout.nodout(&run, &history, &nodes);
    let contact = Force { id: 2, title: "", along_n: &history.contact_n, across_n: 0.0 };
    layout.rcforc(&run, &history, &[contact]);
    layout.glstat(&run, &history);
    crumple_ok(here, "init pair -o s.toml");
    let found = study(here, "s.toml");
    let run = &found["run"][0];
    for (key, tonnes) in [("mass", 1.2), ("other_mass", 2.0)] {
        let mass = number(&run[key], "t");
        assert!((mass / tonnes - 1.0).abs() < 2e-3, "{key}: {mass} t");
    }
    let text = fs::read_to_string(here.join("s.toml")).unwrap();
    assert!(text.contains("shared by"), "{text}");
    // Another run with another such body, and a pair that is nearly alike.
    for (run, kg) in [("pair/b", 2_400.0), ("near/a", 1_180.0)] {
        let (run, history) = (here.join(run), Crash { other_kg: Some(kg), ..crash }.run());
        layout.nodout(&run, &history, &nodes);
        let contact = Force { id: 2, title: "", along_n: &history.contact_n, across_n: 0.0 };
        layout.rcforc(&run, &history, &[contact]);
        layout.glstat(&run, &history);
    }
    let said = warned(here, "init pair -o two.toml");
    says(&said, "other mass: the runs' masses differ (2, 2.4 t): do they belong to one vehicle?");
    assert_eq!(said.matches("the runs' masses differ").count(), 1, "{said}");
    crumple_ok(here, "init near -o exact.toml");
    let exact = study(here, "exact.toml");
    assert!((number(&exact["run"][0]["other_mass"], "t") / 1.18 - 1.0).abs() < 2e-3, "{exact}");
    fs::remove_file(here.join("near/a/glstat")).unwrap();
    crumple_ok(here, "init near -o estimated.toml");
    let text = fs::read_to_string(here.join("estimated.toml")).unwrap();
    assert!(!text.contains("other_mass"), "{text}");
    says(&text, "1.18 t, is taken as equal");
}

/// Momentum alone says that two bodies meet, that they are of different mass, and that it is a
/// guess.
#[test]
fn a_pair_without_forces_is_guessed() {
    let history = MOTION_ONLY.run();
    let nodes = [
        Node { id: 4, title: "ground", on: None, shakes: 0.0 },
        node(5, "", 0, 0, 0.0),
        node(6, "", 0, 4, 0.01),
        node(7, "", 0, 4, 0.02),
        node(8, "CG of truck", 1, 4, 0.004),
        node(10, "", 1, 0, 0.0),
    ];
    let folder = tempfile::tempdir().unwrap();
    let (run, here) = (folder.path().join("pair/a"), folder.path().join("pair"));
    let layout = Layout { units: MM_T_S, axis: 1, sign: -1.0 };
    layout.nodout(&run, &history, &nodes);
    let document = json(&crumple_ok(&here, "init --json"));
    let kind = &document["kind"];
    assert_eq!(
        (kind["value"].as_str(), kind["evidence"].as_str()),
        (Some("pair"), Some("guessed"))
    );
    let why = kind["from"].as_str().unwrap();
    assert!(why.starts_with("two bodies move, and their changes of momentum balance"));
    let deflection = &document["deflection"];
    assert_eq!(deflection["evidence"], "guessed");
    assert_eq!(deflection["value"]["node"], 6);
    assert_eq!(deflection["value"]["minus_node"], 8, "its title says so");
    assert_eq!(document["other_nodes"][0][0]["about"], "starts at the same velocity");
    let force = &document["force"];
    assert_eq!(
        (force["evidence"].as_str(), force["value"]["times"].as_str()),
        (Some("guessed"), Some("mass"))
    );
    says(&document["fill_in"].to_string(), "other_mass of a: judging by their velocities, 1.6");
    let text = fs::read_to_string(here.join("study.toml")).unwrap();
    says(&text, "\nkind = \"pair\"\n");
    says(&text, "\n# other_mass =     # fill in\n");
    let speed = document["runs"][0]["speed_m_per_s"]["value"].as_f64().unwrap();
    assert!((speed / 16.0 - 1.0).abs() < 1e-3, "{speed}");
    // One mass for both is not what the velocities say.
    let said = warned(&here, "init --mass 1.2t -o one.toml");
    says(&said, "mass: judging by their velocities, the other body is 1.6");
    let both = ["init", "--mass", "1.2t", "--other-mass", "2t", "-o", "both.toml"];
    assert_eq!(String::from_utf8(crumple_in(&here, &both).stderr).unwrap(), "");
    crumple_ok(&here, "build both.toml -q");
    let cases = Database::read(&here.join("curves.h5")).unwrap();
    let case = &cases.cases("pair")[0];
    assert!(case.curves.sampled.force_n().iter().copied().fold(0.0, f64::max) > 1e5);
    // What the caller says of the bodies is above it.
    crumple_ok(&here, "init --node 8 --minus-node 6 -o turned.toml");
    let turned = study(&here, "turned.toml");
    assert_eq!(turned["study"]["kind"].as_str(), Some("pair"));
    assert_eq!(turned["recipe"]["deflection"]["node"].as_integer(), Some(8));
    let error = crumple_fails(&here, 1, "init --half-model -o half.toml");
    says(&error, "two bodies move in these runs");
}

/// A struck body that stands at first is one of a pair; two that are stopped by walls of their own
/// are none, and neither is one body with nodes that start alike.
#[test]
fn bodies_that_do_not_meet_are_no_pair() {
    let layout = Layout { units: MM_T_S, axis: 0, sign: 1.0 };
    let node = |id, body| Node { id, title: "", on: Some((body, 4)), shakes: 0.002 };
    let proposed = |history: &History, nodes: &[Node]| {
        let folder = tempfile::tempdir().unwrap();
        layout.nodout(&folder.path().join("group/a"), history, nodes);
        json(&crumple_ok(&folder.path().join("group"), &["init", "--json"]))
    };
    let standing = Crash { other_speed_m_per_s: 0.0, ..MOTION_ONLY }.run();
    let document = proposed(&standing, &[node(1, 0), node(2, 1)]);
    assert_eq!(document["kind"]["value"], "pair");
    assert_eq!(document["deflection"]["value"]["node"], 1, "the one that moves");
    assert_eq!(document["deflection"]["value"]["minus_node"], 2);
    let mut apart = Crash::default().run();
    apart.bodies.extend(Crash { speed_m_per_s: 8.0, gap_m: 0.2, ..Crash::default() }.run().bodies);
    let document = proposed(&apart, &[node(1, 0), node(2, 1)]);
    assert_eq!(document["kind"]["value"], "wall");
    assert_eq!(document["kind"]["evidence"], "guessed");
    assert!(
        document["kind"]["from"].as_str().unwrap().starts_with("several bodies move, no force")
    );
    assert_eq!(document["deflection"]["value"]["node"], 1, "the fastest");
    let document = proposed(&Crash::default().run(), &[node(1, 0), node(2, 0)]);
    assert_eq!(document["kind"]["value"], "wall");
    assert!(document["kind"]["from"].as_str().unwrap().starts_with("one body moves in the files"));
}

/// Where momentum and kinetic energy agree, the energy's mass is taken; where nothing tells it,
/// it is left to fill in.
#[test]
fn masses_are_never_made_up() {
    let history = Crash::default().run();
    let layout = Layout { units: MM_T_S, axis: 0, sign: 1.0 };
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("cars/50kmh");
    let here = folder.path().join("cars");
    layout.nodout(&run, &history, &car_nodes());
    let said = warned(&here, "init");
    says(&said, "fill in mass of 50kmh: no force and no energy give it: use --mass");
    let text = fs::read_to_string(here.join("study.toml")).unwrap();
    says(&text, "# NOT COMPLETE");
    says(&text, "\n# mass =     # fill in\n");
    says(&text, "times = \"mass\"");
    assert!(crumple_fails(&here, 1, "build").contains("missing field `mass`"));
    // Without a force the build finds the contact, and with it the crush.
    let crush = |document: &str| json(document)["runs"][0]["crush_m"].as_f64();
    assert_eq!(crush(&crumple_ok(&here, "init --json -o none.toml")), None);
    let crush_m = crush(&crumple_ok(&here, "init --mass 1.2t --json -o given.toml"));
    crumple_ok(&here, "build given.toml -q");
    let built = Database::read(&here.join("curves.h5")).unwrap();
    assert_eq!(crush_m, Some(built.cases("cars")[0].max_deflection_m()));
    layout.glstat(&run, &history);
    crumple_ok(&here, "init -o energy.toml");
    assert_eq!(study(&here, "energy.toml")["run"][0]["mass"].as_str(), Some("1.2t"));
    write_car(layout, &run, &history, &car_nodes());
    crumple_ok(&here, "init -o both.toml");
    let text = fs::read_to_string(here.join("both.toml")).unwrap();
    says(&text, "mass = \"1.2t\"");
    says(&text, "kinetic energy of the model at the start over ½v² (momentum gives");
    // The energy is that of the whole speed: the car also slides along the wall, at 5 m/s.
    let mut oblique = history;
    oblique.kinetic_j.iter_mut().for_each(|kinetic_j| *kinetic_j += 0.5 * 1_200.0 * 25.0);
    layout.glstat(&run, &oblique);
    let nodout = fs::read_to_string(run.join("nodout")).unwrap();
    let across = |line: &str| match line.len() {
        154 if &line[46..58] != " 0.00000E+00" => {
            format!("{} 5.00000E+03{}\n", &line[..58], &line[70..])
        }
        _ => format!("{line}\n"),
    };
    fs::write(run.join("nodout"), nodout.lines().map(across).collect::<String>()).unwrap();
    let said = warned(&here, "init -o oblique.toml");
    says(&said, "only 94 % of the initial speed lies along x");
    assert!(!said.contains("kinetic energy"), "{said}");
    assert_eq!(study(&here, "oblique.toml")["run"][0]["mass"].as_str(), Some("1.2t"));
}

/// A force that is larger than what stops the body makes no mass that is heavier than all that moves.
#[test]
fn a_force_counted_twice_gives_no_mass() {
    let history = Crash::default().run();
    let layout = Layout { units: MM_T_S, axis: 0, sign: 1.0 };
    let folder = tempfile::tempdir().unwrap();
    let (run, here) = (folder.path().join("cars/50kmh"), folder.path().join("cars"));
    layout.nodout(&run, &history, &car_nodes());
    layout.glstat(&run, &history);
    let more: Vec<f64> = history.contact_n.iter().map(|f| 1.12 * f).collect();
    let wall = Force { id: 7, title: "barrier", along_n: &more, across_n: 0.0 };
    layout.rwforc(&run, &history, &[wall]);
    let said = warned(&here, "init");
    says(&said, "mass: in 50kmh momentum gives 1.34 t, the kinetic energy at the start 1.2 t");
    says(&said, "the force is larger than what stops the body: is it counted twice");
    assert_eq!(study(&here, "study.toml")["run"][0]["mass"].as_str(), Some("1.2t"));
}

/// One run with the force of another is left out, and costs the others nothing.
#[test]
fn one_run_with_a_foreign_force_is_singled_out() {
    let folder = tempfile::tempdir().unwrap();
    let group = |run: &str| fixture("fe/lead-car-wall").join(run);
    let here = folder.path().join("cars");
    for run in ["25kmh", "36kmh", "48kmh", "60kmh"] {
        copy_run(&group(run), &here.join(run), TEXTS);
    }
    fs::copy(group("60kmh").join("rwforc"), here.join("36kmh/rwforc")).unwrap();
    let said = crumple_ok(&here, "init");
    says(&said, "36kmh: it does not fit the other runs' recipe: impulse of the force and");
    says(&said, "differ by 12 %, in the others by at most 2.4 %: is its force that of another run");
    assert!(!said.contains("fill in"), "{said}");
    let runs = study(&here, "study.toml")["run"].as_array().unwrap().clone();
    let masses: Vec<&str> = runs.iter().map(|run| run["mass"].as_str().unwrap()).collect();
    assert_eq!(masses, ["24t"; 3]);
    // A force that the user names keeps the run.
    let said = warned(&here, "init --force rwforc:1 -o all.toml");
    says(&said, "fill in mass of 36kmh");
    assert_eq!(study(&here, "all.toml")["run"].as_array().unwrap().len(), 4);
}

/// A section is used for the force only if nothing else is, and gives no mass.
#[test]
fn a_section_is_the_last_choice() {
    let history = Crash::default().run();
    let layout = Layout { units: MM_T_S, axis: 0, sign: 1.0 };
    let folder = tempfile::tempdir().unwrap();
    let (run, here) = (folder.path().join("cars/50kmh"), folder.path().join("cars"));
    let inner = &history.bodies[0].section_n;
    let section = |id, title, along_n| Force { id, title, along_n, across_n: 0.0 };
    layout.nodout(&run, &history, &car_nodes());
    layout.secforc(&run, &history, &[section(5, "both boxes", inner)]);
    let said = warned(&here, "init");
    says(&said, "the force is that of a section, which may carry only part");
    says(&said, "fill in mass of 50kmh: a section may carry only part");
    let force = &study(&here, "study.toml")["recipe"]["force"];
    assert_eq!((force["file"].as_str(), force["id"].as_integer()), (Some("secforc"), Some(5)));
    assert_eq!(force["component"].as_str(), Some("x_force"));
    layout.glstat(&run, &history);
    crumple_ok(&here, "init -o energy.toml");
    assert_eq!(study(&here, "energy.toml")["run"][0]["mass"].as_str(), Some("1.2t"));
    crumple_ok(&here, "build energy.toml -q");
    write_car(layout, &run, &history, &car_nodes());
    crumple_ok(&here, "init -o wall.toml");
    let force = &study(&here, "wall.toml")["recipe"]["force"];
    assert_eq!(force["file"].as_str(), Some("rwforc"));
}

/// A last state right after the one before would keep the force from being filtered.
#[test]
fn a_last_state_off_the_raster_is_cut() {
    let mut history = Crash::default().run();
    let end = history.time_s.len() - 1;
    history.time_s.push(history.time_s[end] + 1e-6);
    history.contact_n.push(0.0);
    for motions in &mut history.bodies {
        motions.section_n.push(0.0);
        for of in motions.displacement_m.iter_mut().chain(&mut motions.velocity_m_per_s) {
            of.push(of[end]);
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let layout = Layout { units: MM_T_S, axis: 0, sign: 1.0 };
    write_car(layout, &folder.path().join("cars/50kmh"), &history, &car_nodes());
    let here = folder.path().join("cars");
    crumple_ok(&here, "init");
    let text = fs::read_to_string(here.join("study.toml")).unwrap();
    says(&text, "filter = \"CFC60\"");
    says(&text, "truncate = \"120.0005ms\"");
    crumple_ok(&here, "build -q");
}

/// A copy of the bundled runs at four speeds.
fn four_runs() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path().join("lead-car-wall");
    for run in ["25kmh", "36kmh", "48kmh", "60kmh"] {
        copy_run(&fixture("fe/lead-car-wall").join(run), &here.join(run), TEXTS);
    }
    (folder, here)
}

/// What init left out, as folder and message.
fn left_out(document: &Value) -> Vec<(String, String)> {
    let all = document["left_out"].as_array().unwrap();
    let text = |value: &Value| value.as_str().unwrap().to_string();
    all.iter().map(|out| (text(&out["path"]), text(&out["message"]))).collect()
}

/// Cuts a text behind its nth state.
fn cut(path: &Path, state_line: &str, states: usize) {
    let text = fs::read_to_string(path).unwrap();
    let end = text.match_indices(state_line).nth(states).unwrap().0;
    fs::write(path, &text[..end + state_line.len()]).unwrap();
}

#[test]
fn what_is_no_run_is_named_and_left_out() {
    let (_folder, here) = four_runs();
    let from = fixture("fe/lead-car-wall");
    copy_run(&from.join("48kmh"), &here.join("again"), TEXTS);
    // The same numbers in other bytes.
    copy_run(&from.join("36kmh"), &here.join("converted"), TEXTS);
    let path = here.join("converted/nodout");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replacen("smp d R14", "smp d R13", 1)).unwrap();
    // Died at once, while loading, and late in it; cut behind the crash.
    for (name, states) in [("died", 3), ("aborted", 90), ("late", 120), ("short", 250)] {
        copy_run(&from.join("72kmh"), &here.join(name), TEXTS);
        let lines = " n o d a l   p r i n t   o u t ";
        cut(&here.join(name).join("nodout"), lines, states);
    }
    fs::create_dir_all(here.join("empty")).unwrap();
    fs::create_dir_all(here.join("planned")).unwrap();
    fs::write(here.join("planned/main.k"), "*KEYWORD\n*TITLE\nnot run\n*END\n").unwrap();
    fs::create_dir_all(here.join("energies")).unwrap();
    fs::write(here.join("energies/glstat"), "").unwrap();
    let document = json(&crumple_ok(&here, "init --json"));
    let runs = document["runs"].as_array().unwrap();
    let names: Vec<&str> = runs.iter().map(|run| run["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["25kmh", "36kmh", "48kmh", "60kmh", "late", "short"]);
    // What died late has a curve as far as it goes, and the others' mass.
    for run in runs {
        assert_eq!(run["mass_kg"]["value"], 24e3, "{run}");
        assert_eq!(run["truncated"], run["name"] == "late", "{run}");
    }
    let notes = runs[4]["notes"][0].as_str().unwrap();
    says(
        notes,
        "the record ends at 89.25 ms, while the bodies still close at 45 % of their first speed",
    );
    assert_eq!(runs[4]["mass_kg"]["from"], "that of the other runs");
    let out = left_out(&document);
    let text = fs::read_to_string(here.join("study.toml")).unwrap();
    let said = |folder: &str, expected: &str| {
        let (_, message) = out.iter().find(|(path, _)| path == folder).unwrap();
        assert!(message.starts_with(expected), "{folder}: {message}");
        assert!(
            text.replace("\n#     ", " ").contains(&format!("#   {folder}: {message}")),
            "{text}"
        );
    };
    said("again", "its files are identical to those of 48kmh");
    said("converted", "its histories are identical to those of 36kmh");
    said("died", "it terminated early: nodout holds 3 complete states (line 33: the file ends");
    said(
        "aborted",
        "it terminated early: the record ends at 66.754 ms, while the bodies still close at 62 % of",
    );
    said("empty", "the folder is empty");
    said("planned", "it holds a deck but no solver output: it has not been run");
    said(
        "energies",
        "it has no histories of nodes (a nodout, or a binout or T01 with one): it has glstat",
    );
    assert_eq!(out.len(), 7);
    says(&text, "\n# [[run]]\n# path = \"aborted\"\n");
    crumple_ok(&here, "build -q");
}

/// Keeps the first states of a text, as a killed solver leaves them.
fn keep(path: &Path, state_line: &str, states: usize) {
    let text = fs::read_to_string(path).unwrap();
    let end = text.match_indices(state_line).nth(states).unwrap().0;
    fs::write(path, &text[..end]).unwrap();
}

/// A run that ended late in the crash is added to the study, and changes nothing of the other runs.
#[test]
fn a_run_that_ended_in_the_crash_is_kept_beside_whole_ones() {
    let (_folder, here) = four_runs();
    let alone = study(&here, {
        crumple_ok(&here, "init -o alone.toml");
        "alone.toml"
    });
    let cut_at = |states: usize| {
        copy_run(&fixture("fe/lead-car-wall/72kmh"), &here.join("72kmh"), TEXTS);
        let lines = "\n\n\n n o d a l   p r i n t";
        keep(&here.join("72kmh/nodout"), lines, states);
        let printed = crumple_ok(&here, "init -o cut.toml --overwrite");
        (printed, study(&here, "cut.toml"))
    };
    for states in [115, 140, 170, 190] {
        let (printed, with) = cut_at(states);
        let row = printed.lines().find(|line| line.starts_with("72kmh ")).unwrap();
        assert!(row.starts_with("72kmh  72 km/h  24.00 t        > "), "{row}");
        assert_eq!(with["recipe"], alone["recipe"], "{states}");
        assert_eq!(with["run"].as_array().unwrap()[..4], alone["run"].as_array().unwrap()[..]);
        assert_eq!(with["run"][4]["mass"], alone["run"][0]["mass"]);
        crumple_ok(&here, "build -q cut.toml -o cut.h5");
    }
    let (printed, _) = cut_at(100);
    says(&printed, "left out: 72kmh: it terminated early: the record ends at 74.25");
    // Its impulse does not fit another mass.
    let (_, whole) = cut_at(170);
    assert_eq!(whole["run"].as_array().unwrap().len(), 5);
    for wrong in ["--mass 20t", "--mass 30t"] {
        let printed = crumple_ok(&here, &format!("init -o wrong.toml --overwrite {wrong}"));
        says(&printed, "left out: 72kmh: it terminated early");
    }
}

/// A run that was killed early says where its record ends, alone and among others.
#[test]
fn a_run_that_died_early_says_where_its_record_ends() {
    let (_folder, here) = four_runs();
    let killed = here.join("killed");
    copy_run(&fixture("fe/lead-car-wall/72kmh"), &killed, TEXTS);
    keep(&killed.join("nodout"), "\n\n\n n o d a l   p r i n t", 20);
    let document = json(&crumple_ok(&here, "init --json"));
    assert_eq!(document["runs"].as_array().unwrap().len(), 4);
    let died = "it terminated early: the record ends at 14.253 ms, while the bodies still close at 93 % of their first speed";
    assert_eq!(left_out(&document), [("killed".into(), died.into())]);
    let text = fs::read_to_string(here.join("study.toml")).unwrap();
    says(&text, "\n# [[run]]\n# path = \"killed\"\n");
    // Alone its units are not known.
    let error = crumple_fails(&here, 1, "init killed -o killed.toml");
    says(&error, "  killed: it terminated early: the record ends at 0.0142");
    says(&error, "while the bodies still close at 93 %");
    assert!(!here.join("killed.toml").exists());
    // A force that ends early ends the record, too.
    copy_run(&fixture("fe/lead-car-wall/72kmh"), &killed, &["nodout"]);
    let forces = fs::read_to_string(killed.join("rwforc")).unwrap();
    let whole: Vec<&str> = forces.split_inclusive('\n').take(9 + 20).collect();
    fs::write(killed.join("rwforc"), whole.concat()).unwrap();
    let document = json(&crumple_ok(&here, "init --json -o force.toml"));
    let died = died.replace("ms,", "ms, where rwforc ends but the motion goes on,");
    assert_eq!(left_out(&document), [("killed".into(), died)]);
}

#[test]
fn runs_of_another_recipe_are_reported_and_not_merged() {
    let (_folder, here) = four_runs();
    // The same crash with other numbers of node and wall.
    let from = fixture("fe/lead-car-wall/18kmh");
    for (run, node, wall) in [("other_node", "    5001", 1), ("other_wall", "  900001", 2)] {
        copy_run(&from, &here.join(run), TEXTS);
        let path = here.join(run).join("nodout");
        fs::write(&path, fs::read_to_string(&path).unwrap().replace("  900001", node)).unwrap();
        let path = here.join(run).join("rwforc");
        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, text.replace("       1   ", &format!("       {wall}   "))).unwrap();
    }
    let pair = fixture("fe/lead-car-pair/60kmh");
    copy_run(&pair, &here.join("pair"), TEXTS);
    let document = json(&crumple_ok(&here, "init --json"));
    let out = left_out(&document);
    let said = |folder: &str| &out.iter().find(|(path, _)| path == folder).unwrap().1;
    assert_eq!(
        said("other_node"),
        "it does not fit the other runs' recipe: it has no moving node 900001; there 5001 \"COG of the rigid trailing mass\" would be taken"
    );
    assert_eq!(
        said("other_wall"),
        "it does not fit the other runs' recipe: rwforc 1 does not move its bodies, rwforc 2 does"
    );
    assert!(said("pair").starts_with("it does not fit the other runs' recipe: "));
    assert_eq!(document["runs"].as_array().unwrap().len(), 4);
}

#[test]
fn groups_in_one_folder_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    for (group, run) in [
        ("lead-car-wall", "25kmh"),
        ("lead-car-wall", "36kmh"),
        ("vehicle-pair", "25kmh"),
        ("vehicle-pair", "36kmh"),
    ] {
        let below = format!("{group}/{run}");
        copy_run(&fixture("fe").join(&below), &folder.path().join(&below), TEXTS);
    }
    let error = crumple_fails(folder.path(), 1, "init");
    says(
        &error,
        "lead-car-wall (2 runs), vehicle-pair (2 runs). Give one of them (crumple init lead-car-wall)",
    );
    assert_eq!(entries(folder.path()), ["lead-car-wall", "vehicle-pair"]);
    // As one group their masses show that they are none.
    let said = warned(folder.path(), "init --group all");
    says(&said, "the runs' masses differ (20.24, 24 t): do they belong to one vehicle?");
    let found = study(folder.path(), "study.toml");
    assert_eq!(found["study"]["group"].as_str(), Some("all"));
    assert_eq!(found["run"][0]["path"].as_str(), Some("vehicle-pair/25kmh"));
    assert_eq!(found["run"][0]["name"].as_str(), Some("vehicle-pair_25kmh"));
    crumple_ok(folder.path(), "build -q");
}

/// One run, given as a folder, as several, and from inside.
#[test]
fn a_single_run_is_enough() {
    let (_folder, here) = four_runs();
    let above = here.parent().unwrap();
    crumple_ok(above, "init lead-car-wall/36kmh -o one.toml");
    let one = study(above, "one.toml");
    assert_eq!(one["study"]["group"].as_str(), Some("lead-car-wall"));
    assert_eq!(one["run"][0]["path"].as_str(), Some("lead-car-wall/36kmh"));
    assert_eq!(one["run"][0]["name"].as_str(), Some("36kmh"));
    crumple_ok(above, "build one.toml -q");
    let inside = here.join("36kmh");
    crumple_ok(&inside, "init");
    let found = study(&inside, "study.toml");
    assert_eq!(found["run"][0]["path"].as_str(), Some("."));
    assert_eq!(found["run"][0]["name"].as_str(), Some("36kmh"));
    crumple_ok(&inside, "build -q");
    crumple_ok(above, "init lead-car-wall/25kmh lead-car-wall/48kmh -o two.toml");
    assert_eq!(study(above, "two.toml")["run"].as_array().unwrap().len(), 2);
}

#[test]
fn nothing_is_overwritten() {
    let (_folder, here) = four_runs();
    fs::write(here.join("study.toml"), "[study]\nname = \"mine\"\n").unwrap();
    let error = crumple_fails(&here, 1, "init");
    says(
        &error,
        "study.toml exists already and is not overwritten: name another with -o, or replace it with --overwrite",
    );
    assert!(fs::read_to_string(here.join("study.toml")).unwrap().contains("mine"));
    crumple_fails(&here, 1, "init -o 25kmh");
    let error = crumple_fails(&here, 1, "init -o 25kmh --overwrite");
    says(
        &error,
        "25kmh exists already and is not a study, which init writes: name another with -o",
    );
    // Runs are only read, whatever is asked.
    let nodout = fs::read(here.join("25kmh/nodout")).unwrap();
    let error = crumple_fails(&here, 1, "init -o 25kmh/nodout --overwrite");
    says(&error, "is not a study");
    fs::write(here.join("Cargo.toml"), "[package]\n").unwrap();
    fs::write(here.join("notes.md"), "study =\n").unwrap();
    for other in ["Cargo.toml", "notes.md"] {
        let error = crumple_fails(&here, 1, &["init", "-o", other, "--overwrite"]);
        says(&error, "is not a study");
    }
    fs::write(here.join("empty.toml"), "").unwrap();
    crumple_ok(&here, "init -o empty.toml --overwrite");
    assert!(fs::read(here.join("25kmh/nodout")).unwrap() == nodout);
    crumple_ok(&here, "init --overwrite");
    crumple_ok(&here, "build -q");
    let error = crumple_fails(&here, 2, "init -o - --json");
    says(&error, "-o - and --json both write to standard output");
    says(&crumple_fails(&here, 1, "init -o none/study.toml"), "the folder none does not exist");
}

/// A mass that the records contradict is taken, with a warning: it may be that of a wrong unit.
#[test]
fn a_given_mass_is_compared_with_the_records() {
    let (_folder, here) = four_runs();
    let said = |line: &str| {
        let words: Vec<&str> = line.split(' ').collect();
        String::from_utf8(crumple_in(&here, &words).stderr).unwrap()
    };
    let warned = said("init --mass 30t -o heavy.toml");
    says(
        &warned,
        "mass: --mass is 30 t, but the record of 25kmh gives 24 t: check it, and its unit",
    );
    assert_eq!(warned.matches("--mass is").count(), 1);
    assert!(!said("init --mass 25t -o near.toml").contains("--mass is"));
    assert_eq!(study(&here, "heavy.toml")["run"][0]["mass"].as_str(), Some("30t"));
}

#[test]
fn wrong_units_are_not_believed() {
    let (_folder, here) = four_runs();
    let error = crumple_fails(&here, 1, "init --units SI");
    says(&error, "crumple build would refuse it");
    says(
        &error,
        "units: SI as given would imply an impact at 6944 m/s, which is not a crash; mm-t-s would fit",
    );
    assert!(!here.join("study.toml").exists());
    crumple_fails(&here, 2, "init --units mm-t-fortnight");
    // A deck that states them is read; one that cannot be right is named.
    let deck = |units: &str| {
        let text = format!("*KEYWORD\n$ units: {units}\n*TITLE\na deck\n*END\n");
        fs::write(here.join("36kmh/main.k"), text).unwrap();
    };
    deck("Mg mm s");
    let text = crumple_ok(&here, "init -o -");
    says(&text, "# read: the deck main.k, line 2: \"Mg mm s\"; and the only usual system");
    deck("kg m s");
    let output = crumple_in(&here, "init");
    says(&String::from_utf8(output.stderr).unwrap(), "states SI, which would give an impact at");
    assert_eq!(study(&here, "study.toml")["study"]["units"].as_str(), Some("mm-t-s"));
}

/// The numbers of a crash in inches are possible in millimetres too: the folder's name decides, without it the user is warned.
#[test]
fn inches_are_taken_where_the_folder_says_so() {
    let history = Crash::default().run();
    let inches = (0.0254, 0.45359237 * 9.80665 / 0.0254, 1.0);
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    for run in ["named/50kmh", "unnamed/a"] {
        let layout = Layout { units: inches, axis: 0, sign: 1.0 };
        write_car(layout, &here.join(run), &history, &car_nodes());
    }
    assert_eq!(warned(here, "init named -o named.toml"), "");
    let named = study(here, "named.toml");
    assert_eq!(named["study"]["units"].as_str(), Some("in-slinch-s"));
    let run = &named["run"][0];
    assert!((number(&run["speed"], "km/h") / 50.0 - 1.0).abs() < 1e-3, "{run}");
    assert!((number(&run["mass"], "t") / 1.2 - 1.0).abs() < 1e-2, "{run}");
    crumple_ok(here, "build named.toml -o named.h5 -q");
    // Where the names contradict them they are not taken: numbers of kg, mm and s are an impact in no usual system but this.
    for speed in [20, 40] {
        let mass_in_kg = Layout { units: (1e-3, 1e-3, 1.0), axis: 0, sign: 1.0 };
        let crash = Crash { speed_m_per_s: f64::from(speed) / 3.6, ..Crash::default() }.run();
        write_car(mass_in_kg, &here.join(format!("kg/{speed}kmh")), &crash, &car_nodes());
    }
    let output = crumple_in(here, "init kg -o kg.toml");
    let said =
        String::from_utf8(output.stderr).unwrap() + &String::from_utf8(output.stdout).unwrap();
    assert!(!said.contains("slinch") && said.contains("fill in units"), "{said}");
    let said = warned(here, "init unnamed -o unnamed.toml");
    says(
        &said,
        "units: mm-t-s is assumed, which gives an impact at 1.97 km/h; if the model is in inches or feet, such as in-slinch-s with 50 km/h, use --units",
    );
    let found = study(here, "unnamed.toml");
    assert_eq!(found["study"]["units"].as_str(), Some("mm-t-s"));
    assert_eq!(warned(here, "init unnamed --units in-slinch-s -o given.toml"), "");

    // The steel of the deck settles them, also above a comment that was copied from elsewhere.
    let steel =
        "*MAT_PIECEWISE_LINEAR_PLASTICITY_TITLE\nsteel\n         17.324e-04    3.0e+07       0.3\n";
    let deck = here.join("unnamed/a/car.k");
    let metal = "density 0.0007324 and Young's modulus 30000000.0 of the deck car.k, line 4, are those of a metal in in-slinch-s";
    fs::write(&deck, format!("*KEYWORD\n{steel}*END\n")).unwrap();
    assert_eq!(warned(here, "init unnamed -o steel.toml"), "");
    let text = fs::read_to_string(here.join("steel.toml")).unwrap();
    says(&text.replace("\n#   ", " "), &format!("# computed: {metal}\nunits = \"in-slinch-s\""));
    crumple_ok(here, "build steel.toml -o steel.h5 -q");
    let none: String = text
        .lines()
        .filter(|line| !line.starts_with("units ="))
        .map(|l| format!("{l}\n"))
        .collect();
    fs::write(here.join("none.toml"), none).unwrap();
    crumple_ok(here, "build none.toml -o none.h5 -q");
    let said = crumple_ok(here, "db show none.h5");
    says(&said, &format!("units: {metal}, which is taken"));
    let without_speed: Vec<&str> = text.lines().filter(|l| !l.starts_with("speed =")).collect();
    let as_mm = without_speed.join("\n").replace("mass = \"1.2", "mass = \"6.7");
    let as_mm = as_mm.replace("\"in-slinch-s\"", "\"mm-t-s\"");
    fs::write(here.join("mm.toml"), as_mm).unwrap();
    says(
        &warned(here, "build mm.toml -o mm.h5"),
        &format!("units: the study states mm-t-s, but {metal}"),
    );
    let said = warned(here, "init unnamed --units mm-t-s -o given-mm.toml");
    says(&said, &format!("units: mm-t-s as given, but {metal}"));
    fs::write(&deck, format!("*KEYWORD\n{steel}$ units: mm t s\n*END\n")).unwrap();
    let said = warned(here, "init unnamed -o stated.toml");
    says(
        &said,
        &format!(
            "units: the deck car.k, line 5: \"mm t s\" states mm-t-s, but {metal}, which is taken"
        ),
    );
    let found = study(here, "stated.toml");
    assert_eq!(found["study"]["units"].as_str(), Some("in-slinch-s"));

    // OpenRadioss' starter deck states those of the run.
    fs::remove_file(&deck).unwrap();
    let starter = here.join("unnamed/a/car_0000.rad");
    let begin = "#RADIOSS STARTER\n/BEGIN\ncar\n 2022 0\n kg mm ms\n t mm s\n/TITLE\na car\n/END\n";
    fs::write(&starter, begin).unwrap();
    assert_eq!(warned(here, "init unnamed -o starter.toml"), "");
    let text = fs::read_to_string(here.join("starter.toml")).unwrap();
    says(&text, "# read: the deck car_0000.rad, line 6: \"t mm s\"; and ");
    let shown = crumple_ok(here, "inspect unnamed/a/car_0000.rad");
    says(
        &shown,
        "format      starter\n  solver      OpenRadioss\n  title       a car\n  units       t mm s\n",
    );
}

#[test]
fn what_the_caller_knows_stands_above_what_is_found() {
    let history = Crash::default().run();
    let folder = tempfile::tempdir().unwrap();
    let layout = Layout { units: MM_T_S, axis: 0, sign: 1.0 };
    write_car(layout, &folder.path().join("cars/50kmh"), &history, &car_nodes());
    let here = folder.path().join("cars");
    let options = "init|--units|t-mm-s|--kind|wall|--node|1003|--force|rcforc:3:surfb:x_force|--mass|1.25t|--group|cars at walls";
    crumple_ok(&here, &options.split('|').collect::<Vec<_>>());
    let text = fs::read_to_string(here.join("study.toml")).unwrap();
    for line in [
        "# given: by --group\nname = \"cars at walls\"",
        "# given: by --units\nunits = \"mm-t-s\"",
        "# given: by --kind\nkind = \"wall\"",
        "# given: by --node\ndeflection = { file = \"nodout\", node = 1003, component = \"x_displacement\" }",
        "# given: by --force\nforce = { file = \"rcforc\", id = 3, side = \"surfb\", component = \"x_force\" }",
        "# given: by --mass\nmass = \"1.25t\"",
    ] {
        assert!(text.contains(line), "{line} in\n{text}");
    }
    crumple_ok(&here, "build -q");
    says(&crumple_fails(&here, 1, "init --node 4 -o x.toml"), "it has no moving node 4; there");
    let error = crumple_fails(&here, 2, "init --force nodout:1 -o x.toml");
    says(&error, "is not a force: write FILE:ID[:SIDE][:COMPONENT]");
    crumple_fails(&here, 2, "init --scenario --mass 1t a.model");
    let error = crumple_fails(&here, 1, "init --force rcforc:9 -o x.toml");
    says(
        &error,
        "no run has a force rcforc 9 along the motion: there are rcforc 3, rcforc 4, rwforc 1, rwforc 7",
    );
}

/// A run that holds its histories as text and as T01 is read from the text, and it is reported.
#[test]
#[ignore = "needs ../shared (the real files)"]
fn of_several_files_with_one_history_one_is_chosen() {
    let source = shared("fe/lead-car-wall");
    let folder = group(&source, &["nodout", "rwforc", "glstat", "crashT01"]);
    let here = folder.path().join("lead-car-wall");
    // The T01 of a run beside its text, as a run of its own.
    copy_run(&source.join("36kmh"), &here.join("copy"), T01);
    let document = json(&crumple_ok(&here, "init --json"));
    let notes: Vec<&str> =
        document["notes"].as_array().unwrap().iter().map(|n| n.as_str().unwrap()).collect();
    assert_eq!(
        notes,
        ["nodout is read; crashT01 also holds it", "rwforc is read; crashT01 also holds it"]
    );
    assert_eq!(
        left_out(&document),
        [("copy".into(), "its histories are identical to those of 36kmh".into())]
    );
    assert_eq!(document["runs"][0]["mass_kg"]["value"], 24_000.0);
}

/// Files that are cut or overwritten anywhere give a study or a reason, never a panic.
#[test]
fn damaged_files_give_a_study_or_a_reason() {
    let source = fixture("fe/vehicle-pair/9kmh");
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    let mut random = 1u64;
    let mut below = |most: usize| {
        random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (random >> 33) as usize % most
    };
    let study = folder.path().join("study.toml");
    let (mut studies, mut reasons) = (0, 0);
    for k in 0..if is_thorough() { 2_000 } else { 150 } {
        copy_run(&source, &run, TEXTS);
        let path = run.join(if k % 2 == 0 { "nodout" } else { "rwforc" });
        let mut bytes = fs::read(&path).unwrap();
        match k % 3 {
            0 => bytes.truncate(below(bytes.len())),
            1 => {
                let at = below(bytes.len());
                let end = (at + below(5_000)).min(bytes.len());
                bytes[at..end].fill(b" 0*-9\n"[below(6)]);
            }
            _ => (0..20).for_each(|_| {
                let at = below(bytes.len());
                bytes[at] = b"\0 eE+-.19\xff"[below(10)];
            }),
        }
        fs::write(&path, bytes).unwrap();
        let found = crumple_in(folder.path(), "init run -o study.toml -q");
        if found.status.success() {
            studies += 1;
            fs::read_to_string(&study).unwrap().parse::<Table>().unwrap();
            fs::remove_file(&study).unwrap();
        } else {
            reasons += 1;
            assert_eq!(found.status.code(), Some(1));
            assert!(!found.stderr.is_empty() && !study.exists());
        }
    }
    assert!(studies > 10 && reasons > 10, "{studies} studies, {reasons} reasons");
}

/// No real file makes init stop or tell nonsense: none of the samples is an impact.
#[test]
fn real_files_that_are_no_impact_give_no_study() {
    let mut seen = 0;
    for (kind, files) in samples_by_kind().into_iter().filter(|(kind, _)| kind != "d3plot") {
        for file in files.into_values() {
            let name = match kind.as_str() {
                "binout" => "binout0000",
                "keyword" => "main.k",
                name => name,
            };
            for name in [name, file.file_name().unwrap().to_str().unwrap()] {
                let folder = tempfile::tempdir().unwrap();
                let run = folder.path().join("run");
                fs::create_dir(&run).unwrap();
                fs::copy(&file, run.join(name)).unwrap();
                let error = crumple_fails(folder.path(), 1, "init");
                let is_said =
                    error.contains("  run: it ") || error.contains("  run: nothing moves");
                assert!(is_said, "{}: {error}", file.display());
                seen += 1;
            }
        }
    }
    let least = if is_with_shared() { 101 } else { 40 };
    assert!(seen >= least, "{seen}");
}

#[test]
fn scenarios_run_as_they_are_written() {
    let folder = demo_folder();
    let here = folder.path();
    for (models, bodies) in [
        (&["lead.model"][..], 2),
        (&["pair.model"], 2),
        // Each vehicle with its ends, but for the last one's rear.
        (&["lead.model", "vehicle.model"], 8),
        // The runs of this nose agree on no stopped mass.
        (&["pair.model", "vehicle.model"], 6),
        (&["lead.model", "vehicle.model", "--one-mass"], 4),
        (&["pair.model", "vehicle.model", "--one-mass"], 6),
    ] {
        let arguments = [&["init", "--scenario"], models, &["-o", "new.toml"]].concat();
        crumple_ok(here, &arguments);
        let result = json(&crumple_ok(here, "simulate new.toml --json"));
        let masses = result["summary"]["bodies"].as_array().unwrap().len();
        // A wall is a body of the result too, or not: only vehicles are counted.
        assert!(masses == bodies || masses + 1 == bodies, "{models:?}: {masses} bodies");
        says(&crumple_fails(here, 1, &arguments), "new.toml exists already");
        let scenario = study(here, "new.toml");
        let speed = number(&scenario["train"][0]["speed"], "km/h");
        assert!((12.0..=72.0).contains(&speed));
        assert_eq!(scenario["train"][0]["vehicles"][0]["mass"].as_str(), Some("24t"));
        assert_eq!(scenario.contains_key("wall"), models[0] == "lead.model");
        fs::remove_file(here.join("new.toml")).unwrap();
    }
    let document = json(&crumple_ok(here, "init --scenario lead.model -o s.toml --json"));
    assert_eq!(document["scenario"], "s.toml");
    assert_eq!(document["trains"][0]["vehicles"][0]["mass_kg"]["evidence"], "read");
    let t = |code: i32, models: &[&str], expected: &str| {
        let error =
            crumple_fails(here, code, &[&["init", "--scenario", "-o", "t.toml"], models].concat());
        says(&error, expected);
    };
    t(1, &["pair.model", "lead.model"], "lead.model: its speeds are wall speeds");
    t(2, &[], "a scenario takes one model or two, found 0");
    t(1, &["curves.h5"], "curves.h5: ");
    t(1, &["none.model"], "none.model: ");
}

#[test]
fn inspect_takes_folders() {
    let (_folder, here) = four_runs();
    fs::write(here.join("25kmh/main.k"), "*KEYWORD\n*TITLE\na deck\n*END\n").unwrap();
    let above = here.parent().unwrap();
    let text = crumple_ok(above, "inspect lead-car-wall");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "lead-car-wall/25kmh");
    assert_eq!(lines[1], "file      holds  states  first time       last  entities  problems");
    assert_eq!(lines[2], "nodout   nodout     400         0.0  0.2992515         1         0");
    assert_eq!(lines[4], "main.k  keyword       0           -          -         0         0");
    assert_eq!(lines.len(), 4 + 5 + 3 * 4 - 4);
    let document = json(&crumple_ok(above, "inspect lead-car-wall --json"));
    let files = document["files"].as_array().unwrap();
    assert_eq!(files.len(), 9);
    assert_eq!(files[0]["path"], "lead-car-wall/25kmh/nodout");
    assert_eq!(files[0]["states"], 400);
    assert_eq!(files[0]["entities"][0]["id"], 900001);
    // What holds histories under another name is named.
    fs::copy(here.join("36kmh/nodout"), here.join("36kmh/nodes.txt")).unwrap();
    let listed = crumple_ok(above, "inspect lead-car-wall/36kmh");
    says(&listed, "not read, by their names: nodes.txt (nodout)");
    // A damaged file is a warning, one that is only named like a solver's too.
    let nodout = here.join("36kmh/nodout");
    cut(&nodout, " n o d a l   p r i n t ", 100);
    fs::write(here.join("36kmh/binout_notes.txt"), "no binout").unwrap();
    let output = crumple_in(above, "inspect lead-car-wall/36kmh --strict");
    assert_eq!(output.status.code(), Some(3));
    assert!(
        String::from_utf8(output.stderr).unwrap().contains("binout_notes.txt: no solver output")
    );
    fs::create_dir(above.join("empty")).unwrap();
    let error = crumple_fails(above, 1, "inspect empty");
    says(&error, "empty: none of its folders holds solver files");
    fs::rename(here.join("36kmh/nodes.txt"), above.join("empty/nodes.txt")).unwrap();
    let error = crumple_fails(above, 1, "inspect empty");
    says(&error, "solver files: name a file to have it inspected, as nodes.txt (nodout)");
}

#[test]
fn build_needs_no_arguments_beside_a_study() {
    let (_folder, here) = four_runs();
    let error = crumple_fails(&here, 2, "build");
    says(
        &error,
        "there is no study.toml in this folder: name a study, or let crumple init write one",
    );
    // A folder of runs stands for the study in it, if there is one.
    fs::create_dir(here.join("runs")).unwrap();
    says(
        &crumple_fails(&here, 1, "build runs -o a.h5"),
        "runs: this is a folder without a study.toml: give a study, or let crumple init runs -o runs/study.toml write one",
    );
    // As it says.
    for speed in ["12kmh", "18kmh", "25kmh"] {
        let run = here.join("runs").join(speed);
        fs::create_dir(&run).unwrap();
        for name in ["nodout", "rwforc"] {
            fs::copy(fixture("fe/lead-car-wall").join(speed).join(name), run.join(name)).unwrap();
        }
    }
    crumple_ok(&here, "init runs -o runs/study.toml");
    assert!(crumple_ok(&here, "build runs").ends_with("wrote runs/curves.h5 (group runs)\n"));
    fs::remove_dir_all(here.join("runs")).unwrap();
    let bundled = fixture("fe/lead-car-pair");
    let build = ["build", bundled.to_str().unwrap(), "-o", "b.h5"];
    crumple_ok(&here, &build);
    crumple_ok(&here, "init");
    let printed = crumple_ok(&here, "build");
    assert!(printed.ends_with("wrote curves.h5 (group lead-car-wall)\n"), "{printed}");
    assert!(here.join("curves.h5").is_file());
    let above = here.parent().unwrap();
    fs::remove_file(here.join("curves.h5")).unwrap();
    let printed = crumple_ok(above, "build lead-car-wall/study.toml");
    assert!(printed.contains("wrote lead-car-wall/curves.h5"), "the database is beside the study");
    let document = json(&crumple_ok(&here, "build -o other.h5 --json"));
    assert_eq!(document["database"], "other.h5");
}

/// A solver that writes the binary file alone may leave a text's header: the binary is built.
#[test]
#[ignore = "needs ../shared (the real files)"]
fn a_texts_header_does_not_hide_the_binary_file() {
    let source = shared("fe/lead-car-wall");
    let folder = group(&source, T01);
    let here = folder.path().join("lead-car-wall");
    for run in entries(&here).iter().filter(|run| here.join(run).is_dir()) {
        let text = fs::read_to_string(source.join(run).join("nodout")).unwrap();
        let header: Vec<&str> = text.lines().take(2).collect();
        fs::write(here.join(run).join("nodout"), header.join("\n") + "\n").unwrap();
    }
    crumple_ok(&here, "init");
    crumple_ok(&here, "build -q");
}

/// A link that leads out of the folder is followed to a run, not through a whole disk.
#[cfg(unix)]
#[test]
fn links_out_of_the_folder_are_followed_to_runs_only() {
    use std::os::unix::fs::symlink;
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::create_dir(here.join("runs")).unwrap();
    for run in ["25kmh", "36kmh"] {
        symlink(fixture(&format!("fe/lead-car-wall/{run}")), here.join("runs").join(run)).unwrap();
    }
    symlink("/", here.join("runs/root")).unwrap();
    let output = crumple_in(here, "init runs -o -");
    let (text, said) =
        (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    assert!(text.contains("36kmh"), "{text}{said}");
    let why = "runs/root: it is a link to /, which is not a run and lies outside";
    assert!(format!("{text}{said}").contains(why), "{text}{said}");
}

/// Two load cells with one half each: added where the kinetic energy says so, else the user is asked.
#[test]
fn forces_that_share_the_load_are_added() {
    let history = Crash::default().run();
    let half: Vec<f64> = history.contact_n.iter().map(|f| 0.5 * f).collect();
    let cell = |id, title| Force { id, title, along_n: &half, across_n: 0.0 };
    let layout = Layout { units: MM_T_S, axis: 0, sign: 1.0 };
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    for (run, with_energy) in [("known/50kmh", true), ("asked/50kmh", false)] {
        let run = here.join(run);
        layout.nodout(&run, &history, &car_nodes());
        layout.rwforc(&run, &history, &[cell(1, "left"), cell(2, "right")]);
        if with_energy {
            layout.glstat(&run, &history);
        }
    }
    crumple_ok(here, "init known -o known.toml");
    let known = study(here, "known.toml");
    assert_eq!(known["recipe"]["force"]["id"], toml::Value::from(vec![1, 2]));
    assert!((number(&known["run"][0]["mass"], "t") / 1.2 - 1.0).abs() < 1e-2);
    crumple_ok(here, "build known.toml -o known.h5 -q");

    let said = warned(here, "init asked -o asked.toml");
    says(
        &said,
        "the bodies follow rwforc 2 as they follow rwforc 1: if these share the load, write id = [1, 2] in force, and 2.00 times the masses",
    );
    let asked = study(here, "asked.toml");
    assert_eq!(asked["recipe"]["force"]["id"].as_integer(), Some(1));
    let text = fs::read_to_string(here.join("asked.toml")).unwrap();
    let mass = asked["run"][0]["mass"].as_str().unwrap();
    let doubled = format!("{}kg", 2.0 * number(&asked["run"][0]["mass"], "kg"));
    let text = text.replace("id = 1,", "id = [1, 2],").replace(mass, &doubled);
    fs::write(here.join("asked.toml"), text).unwrap();
    crumple_ok(here, "build asked.toml -o asked.h5 -q");
    let peak_n = |database: &str| -> f64 {
        let database = Database::read(&here.join(database)).unwrap();
        let case = database.all().next().unwrap();
        case.curves.original.force_n().iter().copied().fold(0.0, f64::max)
    };
    assert!((peak_n("asked.h5") / peak_n("known.h5") - 1.0).abs() < 1e-6);
    // Contacts that name the bodies in another order cannot be added.
    let turned: Vec<f64> = half.iter().map(|f| -f).collect();
    let contact = |id, along_n| Force { id, title: "", along_n, across_n: 0.0 };
    let run = here.join("turned/50kmh");
    layout.nodout(&run, &history, &car_nodes());
    layout.rcforc(&run, &history, &[contact(1, &half), contact(2, &turned)]);
    let said = warned(here, "init turned -o turned.toml");
    says(&said, "on opposite sides: if these share the load, force and masses are those of a part");
    // A wall that is not there, or twice.
    for (ids, what) in [
        ("[1, 7]", "7"),
        ("[1, 1]", "id is a number, or a list of different numbers"),
        ("[]", "id is"),
    ] {
        let text = fs::read_to_string(here.join("known.toml")).unwrap();
        fs::write(here.join("wrong.toml"), text.replace("id = [1, 2]", &format!("id = {ids}")))
            .unwrap();
        says(&crumple_fails(here, 1, "build wrong.toml -o wrong.h5"), what);
    }
}

/// Two walls of which the second is reached at the higher speed only: neither alone moves the body, the sum does.
#[test]
fn walls_that_act_one_after_the_other_are_added() {
    let layout = Layout { units: MM_T_S, axis: 0, sign: 1.0 };
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    // A run with two walls, of which the second takes a share of the contact that depends on the crush, and a blow besides.
    let two_walls = |run: &str, km_per_h: f64, share: &dyn Fn(f64) -> f64, blow_n: f64| {
        let history = Crash { speed_m_per_s: km_per_h / 3.6, ..Crash::default() }.run();
        let crush = &history.bodies[0].displacement_m[4];
        let taken: Vec<f64> =
            history.contact_n.iter().zip(crush).map(|(f, x)| f * share(*x)).collect();
        let first: Vec<f64> = history.contact_n.iter().zip(&taken).map(|(f, s)| f - s).collect();
        let blow = |t: f64| if t < 0.02 { blow_n } else { 0.0 };
        let second: Vec<f64> =
            history.time_s.iter().zip(&taken).map(|(t, f)| f + blow(*t)).collect();
        let run = here.join(run);
        layout.nodout(&run, &history, &car_nodes());
        let wall = |id, along_n| Force { id, title: "", along_n, across_n: 0.0 };
        layout.rwforc(&run, &history, &[wall(1, &first), wall(2, &second)]);
    };
    // The second takes over from the first: it is not reached at 20 km/h, hardly loaded at 30.
    let takes_over = |x: f64| ((x - 0.25) / 0.02).clamp(0.0, 1.0);
    for km_per_h in [20.0, 30.0, 50.0, 60.0] {
        two_walls(&format!("walls/{km_per_h}kmh"), km_per_h, &takes_over, 0.0);
    }
    assert_eq!(warned(here, "init walls -o found.toml"), "");
    let found = study(here, "found.toml");
    assert_eq!(found["recipe"]["force"]["id"], toml::Value::from(vec![1, 2]));
    let runs = found["run"].as_array().unwrap();
    assert_eq!(runs.len(), 4);
    for run in runs {
        assert!((number(&run["mass"], "t") / 1.2 - 1.0).abs() < 1e-2, "{run}");
    }
    let text = fs::read_to_string(here.join("found.toml")).unwrap();
    says(&text, "they act together or one after the other: the bodies follow their");
    crumple_ok(here, "build found.toml -o found.h5 -q");
    // Where the second takes so little that no run shows it, it is named.
    let hardly = |x: f64| if x > 0.2 { 0.03 } else { 0.0 };
    for km_per_h in [40.0, 50.0] {
        two_walls(&format!("share/{km_per_h}kmh"), km_per_h, &hardly, 0.0);
    }
    let said = warned(here, "init share -o share.toml");
    says(&said, "rwforc 2 also acts along the motion, in 40kmh with ");
    says(&said, "if it stops the body, use --force rwforc:1+2");
    let said = warned(here, "init share --force rwforc:1 -o one.toml");
    assert!(!said.contains("also acts"), "{said}");
    // One odd run does not make a sum of what the others must not add, whose second wall takes the blow of something else.
    two_walls("odd/40kmh", 40.0, &|_| 0.0, 100e3);
    two_walls("odd/50kmh", 50.0, &|_| 0.0, 100e3);
    two_walls("odd/55kmh", 55.0, &takes_over, 0.0);
    let said = warned(here, "init odd -o odd.toml");
    let odd = study(here, "odd.toml");
    assert!(!said.contains("residual"), "{said}");
    let text = fs::read_to_string(here.join("odd.toml")).unwrap();
    says(&text, "odd/55kmh: it does not fit the other runs' recipe");
    assert_eq!(odd["recipe"]["force"]["id"].as_integer(), Some(1));
    let runs = odd["run"].as_array().unwrap();
    assert_eq!(runs.len(), 2);
    for run in runs {
        assert!((number(&run["mass"], "t") / 1.2 - 1.0).abs() < 1e-2, "{run}");
    }
    // The user may ask for the sum.
    crumple_ok(here, "init walls --force rwforc:2+1 -o given.toml");
    let given = study(here, "given.toml");
    assert_eq!(given["recipe"]["force"]["id"], toml::Value::from(vec![2, 1]));
    says(
        &crumple_fails(here, 1, "init walls --force rwforc:1+9 -o none.toml"),
        "no run has a force rwforc 1 + 9 along the motion: there are rwforc 1, rwforc 2",
    );
}

/// One record with few states makes the study coarse for all, which is said.
#[test]
fn a_coarse_record_is_named() {
    let layout = Layout { units: MM_T_S, axis: 0, sign: 1.0 };
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    for (km_per_h, interval_s) in [(30.0, 1e-3), (40.0, 2e-4), (50.0, 2e-4)] {
        let crash = Crash { speed_m_per_s: km_per_h / 3.6, interval_s, ..Crash::default() };
        write_car(layout, &here.join(format!("car/{km_per_h}kmh")), &crash.run(), &car_nodes());
    }
    let coarse = "states: 30kmh every 1 ms, most of the others every 0.2 ms";
    says(&warned(here, "init car -o all.toml"), coarse);
    let said = warned(here, "init car/40kmh car/50kmh -o fine.toml");
    assert!(!said.contains("a state every"), "{said}");
}

/// What a restart has written into files of its own is named.
#[test]
fn parts_of_a_restart_are_named() {
    let history = Crash::default().run();
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("car/50kmh");
    let layout = Layout { units: MM_T_S, axis: 0, sign: 1.0 };
    write_car(layout, &run, &history, &car_nodes());
    assert!(!warned(folder.path(), "init car -o whole.toml").contains("restart"));
    fs::copy(run.join("nodout"), run.join("nodout01")).unwrap();
    let said = warned(folder.path(), "init car -o parts.toml");
    let unread = "nodout01 is not read: it is named like the file of a restart";
    says(&said, unread);
    says(&crumple_ok(folder.path(), "inspect car/50kmh/nodout"), unread);
    for output in ["h.h5", "h.csv"] {
        let arguments = ["histories", "car/50kmh/nodout", "-o", output, "--strict"];
        says(&crumple_fails(folder.path(), 3, &arguments), unread);
    }
    let build = || warned(folder.path(), "build parts.toml -o c.h5");
    says(&build(), &format!("50kmh: nodout: {unread}"));
    // The case is made anew when it is moved away, and when another comes.
    fs::rename(run.join("nodout01"), folder.path().join("elsewhere")).unwrap();
    assert!(!build().contains("restart"));
    fs::write(run.join("nodout12"), "").unwrap();
    says(&build(), "nodout12 is not read");
}

/// CFC 60 would smooth away the pulse of a crash of some milliseconds.
#[test]
fn short_impacts_get_a_filter_that_leaves_their_work() {
    // 50 kg stopped from 3 m/s by a constant force within 5 ms.
    let (mass_kg, speed, deceleration, contact_s) = (50.0, 3.0, 600.0, 0.02);
    let mut history = History { bodies: vec![Default::default()], ..History::default() };
    for k in 0..600 {
        let time_s = 1e-4 * f64::from(k);
        let braked_s = (time_s - contact_s).clamp(0.0, speed / deceleration);
        let is_braked = time_s > contact_s && time_s <= contact_s + speed / deceleration;
        history.time_s.push(time_s);
        history.contact_n.push(if is_braked { mass_kg * deceleration } else { 0.0 });
        let body = &mut history.bodies[0];
        let moved_m = speed * (time_s.min(contact_s) + braked_s);
        body.displacement_m[4].push(moved_m - 0.5 * deceleration * braked_s * braked_s);
        body.velocity_m_per_s[4].push(speed - deceleration * braked_s);
    }
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    one_body(&here.join("sled/a"), &history);
    crumple_ok(here, "init sled --units mm-t-s --mass 50kg -o s.toml");
    let filter = study(here, "s.toml")["recipe"]["filter"].as_str().unwrap().to_string();
    assert_ne!(filter, "CFC60");
    let text = fs::read_to_string(here.join("s.toml")).unwrap();
    says(&text, "the impacts are short or begin with a sharp peak: CFC 60 would");
    let said = warned(here, "build s.toml -o s.h5");
    assert!(!said.contains("filter:"), "{said}");
    let usual = text.replace(&format!("filter = \"{filter}\""), "filter = \"CFC60\"");
    fs::write(here.join("s.toml"), usual).unwrap();
    says(&warned(here, "build s.toml -o s.h5"), "filter: CFC60 removes");
}

/// Writes the run of one body that a wall stops.
fn one_body(run: &Path, history: &History) {
    let layout = Layout { units: MM_T_S, axis: 0, sign: 1.0 };
    let ground = Node { id: 1, title: "ground", on: None, shakes: 0.0 };
    layout.nodout(run, history, &[ground, node(5, "", 0, 4, 0.0)]);
    let wall = Force { id: 1, title: "", along_n: &history.contact_n, across_n: 0.0 };
    layout.rwforc(run, history, &[wall]);
}

/// A body that slows down shortly before the force begins: nothing that acts on it all the time.
#[test]
fn a_late_force_is_not_taken_for_gravity() {
    let history = Crash { gap_m: 0.3, ..Crash::default() }.run();
    let late = 25;
    let mut force_n = vec![0.0; late];
    force_n.extend(&history.contact_n[..history.contact_n.len() - late]);
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let layout = Layout { units: MM_T_S, axis: 0, sign: 1.0 };
    let run = here.join("car/a");
    layout.nodout(&run, &history, &car_nodes());
    let wall = |along_n| Force { id: 1, title: "", along_n, across_n: 0.0 };
    layout.rwforc(&run, &history, &[wall(&history.contact_n)]);
    crumple_ok(here, "init car -o s.toml");
    let said = warned(here, "build s.toml -o s.h5");
    assert!(!said.contains("free flight"), "{said}");
    layout.rwforc(&run, &history, &[wall(&force_n)]);
    let late = "in a way that neither gravity nor brakes explain: the force is recorded late";
    says(&warned(here, "build s.toml -o s.h5"), late);
    // A motion that is coarser than the force is interpolated across the contact, which is no flight.
    for (states, force_n, is_late) in [(10, &force_n, true), (50, &history.contact_n, false)] {
        let some = |values: &[f64]| values.iter().copied().step_by(states).collect::<Vec<f64>>();
        let body = &history.bodies[0];
        let bodies = vec![Motions {
            displacement_m: body.displacement_m.each_ref().map(|of| some(of)),
            velocity_m_per_s: body.velocity_m_per_s.each_ref().map(|of| some(of)),
            section_n: Vec::new(),
        }];
        let coarse = History { time_s: some(&history.time_s), bodies, ..History::default() };
        layout.nodout(&run, &coarse, &car_nodes());
        layout.rwforc(&run, &history, &[wall(force_n)]);
        let said = warned(here, "build s.toml -o s.h5");
        assert_eq!(said.contains(late), is_late, "{said}");
        assert!(is_late || !said.contains("free flight"), "{said}");
    }
}

/// What cannot be read of a node or a force is said of it, and lets init take no other.
#[test]
fn damage_does_not_choose() {
    let history = Crash::default().run();
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let layout = Layout { units: MM_T_S, axis: 0, sign: 1.0 };
    let runs = ["car/a", "car/b"].map(|run| here.join(run));
    let damage = |path: &Path, line: usize, columns: std::ops::Range<usize>| {
        let mut text = fs::read(path).unwrap();
        let start =
            text.split_inclusive(|&b| b == b'\n').take(line).map(<[u8]>::len).sum::<usize>();
        text[start + columns.start..start + columns.end].fill(b'*');
        fs::write(path, text).unwrap();
    };
    for run in &runs {
        layout.nodout(run, &history, &car_nodes());
        let wall = Force { id: 1, title: "", along_n: &history.contact_n, across_n: 0.0 };
        layout.rwforc(run, &history, &[wall]);
    }
    crumple_ok(here, "init car -o whole.toml");
    let whole = study(here, "whole.toml");
    // The node's velocity across the motion, in one state.
    let node = whole["recipe"]["deflection"]["node"].as_integer().unwrap();
    let text = fs::read_to_string(runs[1].join("nodout")).unwrap();
    let is_node = |line: &(usize, &str)| line.1.starts_with(&format!("{node:>9} "));
    let line = text.lines().enumerate().filter(is_node).nth(50).unwrap().0;
    damage(&runs[1].join("nodout"), line, 59..70);
    crumple_ok(here, "init car -o across.toml");
    assert_eq!(study(here, "across.toml")["recipe"], whole["recipe"]);
    // A force.
    damage(&runs[1].join("rwforc"), 40, 21..35);
    let found: Value =
        serde_json::from_str(&crumple_ok(here, "init car -o force.toml --json")).unwrap();
    assert_eq!(study(here, "force.toml")["recipe"], whole["recipe"]);
    let left_out = left_out(&found);
    says(&left_out[0].1, "of rwforc holds values that are not numbers (line 41, columns 2");
    damage(&runs[0].join("rwforc"), 40, 21..35);
    let error = crumple_fails(here, 1, "init car -o none.toml");
    says(&error, "correct them, or name another force with --force");
    assert!(!here.join("none.toml").exists());
}

/// A wall whose force grows over that of a contact, as of a body that another one runs into: the contact alone is followed closely.
#[test]
fn a_larger_force_is_named() {
    let history = Crash::default().run();
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let run = here.join("car/a");
    let layout = Layout { units: MM_T_S, axis: 0, sign: 1.0 };
    layout.nodout(&run, &history, &car_nodes());
    let grows = |(i, f): (usize, &f64)| f * (1.0 + 0.01 * i as f64);
    let wall_n: Vec<f64> = history.contact_n.iter().enumerate().map(grows).collect();
    let force = |along_n| Force { id: 1, title: "", along_n, across_n: 0.0 };
    layout.rwforc(&run, &history, &[force(&wall_n)]);
    layout.rcforc(&run, &history, &[force(&history.contact_n)]);
    let said = warned(here, "init car -o s.toml");
    says(&said, "force: the impulse of rwforc 1 is ");
    says(&said, "% of that of rcforc 1, which the body of node ");
    assert_eq!(study(here, "s.toml")["recipe"]["force"]["file"].as_str(), Some("rcforc"));
    // Named, it is not asked about.
    let said = warned(here, "init car --force rcforc:1 -o named.toml");
    assert!(!said.contains("the impulse of rwforc 1"), "{said}");
}

/// A wall of fixed nodes is known by its reaction, and the mass by the energies of the parts.
#[test]
fn a_support_may_be_the_wall() {
    let history = Crash::default().run();
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let run = here.join("car/a");
    Layout { units: SI, axis: 0, sign: 1.0 }.nodout(&run, &history, &car_nodes());
    let (mut support, mut parts) = (
        " made up\n\n single point constraint forces\n\n".to_string(),
        " made up\n\n\n".to_string(),
    );
    for (i, t) in history.time_s.iter().enumerate() {
        let (force, kinetic) = (-history.contact_n[i], 0.5 * history.kinetic_j[i]);
        support += &format!(
            " output at time ={t:14.5E}\n node= 19381 local x,y,z forces ={force:14.4E}{zero:14.4E}{zero:14.4E}  setid=       0\n             force resultants   ={force:14.4E}{zero:14.4E}{zero:14.4E}\n",
            zero = 0.0
        );
        parts += &format!("\n time ={t:13.4E}\n");
        for part in 1..=2 {
            parts += &format!(
                " mat.#={part:5}             inten=   0.0000E+00     kinen={kinetic:13.4E}     eroded_ie=   0.0000E+00     eroded_ke=   0.0000E+00\n x-mom=   0.0000E+00 y-mom=   0.0000E+00 z-mom=   0.0000E+00\n x-rbv=   0.0000E+00 y-rbv=   0.0000E+00 z-rbv=   0.0000E+00\n                         hgeng=   0.0000E+00     +mass=   0.0000E+00     eroded_he=   0.0000E+00\n"
            );
        }
    }
    fs::write(run.join("spcforc"), support).unwrap();
    fs::write(run.join("matsum"), parts).unwrap();
    crumple_ok(here, "init car -o s.toml --units SI");
    let found = study(here, "s.toml");
    let force = &found["recipe"]["force"];
    assert_eq!((force["file"].as_str(), force["id"].as_integer()), (Some("spcforc"), Some(19381)));
    let mass = number(&found["run"][0]["mass"], "t");
    assert!((mass / 1.2 - 1.0).abs() < 2e-3, "{mass} t");
    // One of two has a part of the reaction.
    let text = fs::read_to_string(run.join("spcforc")).unwrap();
    let second = |line: &str| match line.strip_prefix(" node= 19381") {
        Some(rest) => format!("{line}\n node= 19382{rest}\n"),
        None => format!("{line}\n"),
    };
    let two: String = text.lines().map(second).collect();
    fs::write(run.join("spcforc"), two).unwrap();
    crumple_ok(here, "init car -o two.toml --units SI");
    assert!(study(here, "two.toml")["recipe"]["force"].get("id").is_none());
    // Beside a wall supports are not looked at.
    let wall = Force { id: 1, title: "", along_n: &history.contact_n, across_n: 0.0 };
    Layout { units: SI, axis: 0, sign: 1.0 }.rwforc(&run, &history, &[wall]);
    crumple_ok(here, "init car -o wall.toml --units SI");
    let text = fs::read_to_string(here.join("wall.toml")).unwrap();
    assert!(text.contains("file = \"rwforc\"") && !text.contains("spcforc"), "{text}");
}

/// A body that falls through its impact takes more impulse than its mass times its change of speed: the fall before it shows how
/// much more. A brake turns with the motion, so that nothing says how much of it the impulse holds.
#[test]
fn gravity_does_not_falsify_the_mass() {
    let (mass_kg, speed, force_n) = (24e3, 10.0, 3e6);
    let gravity = |_: f64, _: f64| 9.81;
    let brakes = |v: f64, _: f64| -5.0 * v.signum();
    let coupler = |_: f64, time_s: f64| if time_s < 0.02 { -9.81 } else { 0.0 };
    type Beside = dyn Fn(f64, f64) -> f64;
    let beside: [(&str, &Beside); 3] =
        [("drop", &gravity), ("braked", &brakes), ("coupled", &coupler)];
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    for (name, beside) in beside {
        let mut history = History { bodies: vec![Default::default()], ..History::default() };
        let (mut x, mut v): (f64, f64) = (0.0, speed);
        // It leaves the ground again at 1 m/s.
        let mut is_over = false;
        for k in 0..1800 {
            let time_s = 1e-4 * f64::from(k);
            is_over |= v <= -1.0;
            let acting_n = if time_s > 0.02 && !is_over { force_n } else { 0.0 };
            history.time_s.push(time_s);
            history.contact_n.push(acting_n);
            history.kinetic_j.push(0.5 * mass_kg * v * v);
            history.bodies[0].displacement_m[4].push(x);
            history.bodies[0].velocity_m_per_s[4].push(v);
            x += 1e-4 * v;
            v += 1e-4 * (beside(v, time_s) - acting_n / mass_kg);
        }
        let run = here.join(name).join("a");
        one_body(&run, &history);
        let said = warned(here, &format!("init {name} --units mm-t-s -o {name}.toml"));
        let other =
            "the body's speed also changes without the force (gravity, brakes, another contact)";
        assert_eq!(said.contains(other), name != "drop", "{said}");
        let text = fs::read_to_string(here.join(format!("{name}.toml"))).unwrap();
        let mass =
            study(here, &format!("{name}.toml"))["run"][0]["mass"].as_str().map(String::from);
        if name == "drop" {
            says(&text, "less that of the force that");
            let found: f64 = mass.unwrap().trim_end_matches('t').parse().unwrap();
            assert!((found / 24.0 - 1.0).abs() < 0.01, "{found}");
        }
        Layout { units: MM_T_S, axis: 0, sign: 1.0 }.glstat(&run, &history);
        crumple_ok(here, &format!("init {name} --units mm-t-s -o with.toml --overwrite"));
        assert_eq!(study(here, "with.toml")["run"][0]["mass"].as_str(), Some("24t"));
    }
}

/// Files whose names are nearly those of the missing ones, and empty ones, are named, also for runs that are left out; without
/// them the run's force would silently be the body's mass times its acceleration.
#[test]
fn what_lies_unread_beside_a_run_is_named() {
    let (_folder, here) = four_runs();
    assert_eq!(warned(&here, "init -o whole.toml"), "");
    let rename = |run: &str, from: &str, to: &str| {
        fs::rename(here.join(run).join(from), here.join(run).join(to)).unwrap();
    };
    rename("36kmh", "rwforc", "rwforc.gz");
    let document = json(&crumple_ok(&here, "init --json -o packed.toml"));
    let [(run, why)] = &left_out(&document)[..] else { panic!("{document}") };
    assert_eq!(run, "36kmh");
    says(why, "(not read: 36kmh/rwforc.gz: if it is the rwforc, unpack it and name it rwforc)");
    let said = warned(&here, "init 36kmh -o alone.toml");
    says(&said, "warning: not read: 36kmh/rwforc.gz: if it is the rwforc, unpack it");
    says(&fs::read_to_string(here.join("alone.toml")).unwrap(), "times = \"mass\"");
    // A backup beside the file itself is none of the run's, nor is a picture.
    rename("36kmh", "rwforc.gz", "rwforc");
    // Nor are decks and folders that have the name of a force.
    for name in ["rwforc.bak", "nodout.png", "database_spcforc.k", "secforc.inc", "plot_rcforc.gp"]
    {
        fs::write(here.join("36kmh").join(name), "").unwrap();
    }
    fs::create_dir(here.join("36kmh/rcforc_plots")).unwrap();
    assert_eq!(warned(&here, "init -o backup.toml"), "");
    for run in ["25kmh", "36kmh", "48kmh", "60kmh"] {
        fs::write(here.join(run).join("rwforc"), "").unwrap();
    }
    let said = warned(&here, "init -o empty.toml");
    assert_eq!(said.matches("rwforc: there is no complete state in it").count(), 4, "{said}");
    // All names in capital letters.
    rename("48kmh", "rwforc", "RWFORC");
    rename("48kmh", "nodout", "NODOUT");
    copy_run(&fixture("fe/lead-car-wall/48kmh"), &here.join("48kmh/own"), &["rwforc"]);
    fs::copy(here.join("48kmh/own/rwforc"), here.join("48kmh/RWFORC")).unwrap();
    fs::remove_dir_all(here.join("48kmh/own")).unwrap();
    let files: Vec<String> = entries(&here.join("48kmh"));
    assert_eq!(files, ["NODOUT", "RWFORC"]);
    let error = crumple_fails(&here, 1, "init 48kmh -o capital.toml");
    says(&error, "by their contents NODOUT is the nodout, RWFORC is the rwforc: rename them");
}

/// A motion that starts late starts in contact: its first speed is not that of the impact, but its changes still give the mass.
#[test]
fn a_record_that_starts_in_contact_is_named() {
    let (_folder, here) = four_runs();
    let path = here.join("60kmh/nodout");
    let text = fs::read_to_string(&path).unwrap();
    let state = "\n\n\n n o d a l   p r i n t";
    let at = |n: usize| text.match_indices(state).nth(n).unwrap().0;
    fs::write(&path, format!("{}{}", &text[..at(0)], &text[at(40)..])).unwrap();
    let said = warned(&here, "init 60kmh -o late.toml");
    says(
        &said,
        "warning: run 60kmh: the record starts in contact, so the speed of its first state",
    );
    assert!(!said.contains("fill in"), "{said}");
    let late = study(&here, "late.toml");
    let mass = number(&late["run"][0]["mass"], "t");
    // Its nose was stopped before.
    assert!((mass / 24.0 - 1.0).abs() < 0.03, "{mass} t");
    let said = warned(&here, "build late.toml -o late.h5");
    says(&said, "are missing, and the run's speed is that of its first state, by when it has been");
    // No offset makes up for the work of a third of the crush.
    says(&said, "(37.3 %, less any gap that the body had to cross first) are missing");
    says(&said, "slowed down: provide the earlier states, or leave the run out");
    let text = fs::read_to_string(here.join("late.toml")).unwrap();
    let speed = text.lines().find(|l| l.starts_with("speed = ")).unwrap().to_string();
    let stated = text.replace(&speed, "speed = \"60km/h\"\noffset = \"461.6mm\"");
    fs::write(here.join("stated.toml"), stated).unwrap();
    let said = warned(&here, "build stated.toml -o stated.h5");
    assert!(!said.contains("contribute less than"), "{said}");
    let stated = fs::read_to_string(here.join("stated.toml")).unwrap();
    fs::write(here.join("stated.toml"), stated.replace("60km/h\"\noffset", "80km/h\"\noffset"))
        .unwrap();
    let error = crumple_fails(&here, 1, "build stated.toml -o faster.h5");
    says(&error, "likely the offset: the record lacks that crush, and the work done there");
}

/// A record may begin at a moment without force within the crash.
#[test]
fn a_record_that_may_start_in_contact_is_named() {
    let (_folder, here) = four_runs();
    let path = here.join("60kmh/nodout");
    let text = fs::read_to_string(&path).unwrap();
    let at = |n: usize| text.match_indices("\n\n\n n o d a l   p r i n t").nth(n).unwrap().0;
    fs::write(&path, format!("{}{}", &text[..at(0)], &text[at(12)..])).unwrap();
    let path = here.join("60kmh/rwforc");
    let text = fs::read_to_string(&path).unwrap();
    let (head, states) = text.split_once("z-force\n").unwrap();
    let states: Vec<&str> = states.lines().skip(12).collect();
    // Two states of the record without a force.
    let bounce =
        states[..2].iter().map(|line| format!("{}{}\n", &line[..20], "   0.000000E+00".repeat(4)));
    let bounce: String = bounce.collect();
    fs::write(&path, format!("{head}z-force\n{bounce}{}\n", states[2..].join("\n"))).unwrap();
    let said = warned(&here, "init 60kmh -o bounce.toml");
    says(&said, "run 60kmh: the record may start in contact: the body had moved");
    let said = warned(&here, "build bounce.toml -o bounce.h5");
    says(&said, "contact: the body had moved 148.1 mm before the record's first state");
}

/// In tonnes and metres only the masses differ from SI: a train of some kilograms is doubted.
#[test]
fn tonnes_and_metres_are_considered() {
    let history = Crash::default().run();
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    // A car of 1.2 t, whose numbers in tonnes and metres are those of 1.2 kg in SI.
    let tonnes = crumple::unit::UnitSystem::parse("m-t-s").unwrap();
    let tonnes = (tonnes.length_m, tonnes.mass_kg, tonnes.time_s);
    for (name, units) in [("si", SI), ("tonnes", tonnes)] {
        let layout = Layout { units, axis: 0, sign: 1.0 };
        write_car(layout, &here.join(name).join("50kmh"), &history, &car_nodes());
    }
    let of = |name: &str| warned(here, &format!("init {name} -o {name}.toml"));
    assert!(!of("si").contains("m-t-s"));
    says(
        &of("tonnes"),
        "warning: units: SI is assumed, which gives a body of 1.2 kg; if the model is in m-t-s (forces in kN), which gives 1.2 t, use --units m-t-s",
    );
    assert!(!warned(here, "init tonnes --units m-t-s -o stated.toml").contains("units:"));
}

/// Of the motion one component is enough, and of that one the displacement.
#[test]
fn one_component_of_the_motion_is_enough() {
    let (_folder, here) = four_runs();
    let run = here.join("48kmh");
    for (lacks, from) in [
        (&["y_", "z_"][..], "# read: x_velocity of 900001 in the first state"),
        (
            &["y_", "z_", "x_v"],
            "# computed: rate of the x_displacement of 900001 in the first state",
        ),
    ] {
        let is_kept = |component: &str| {
            component.ends_with("_force") || !lacks.iter().any(|lack| component.starts_with(lack))
        };
        let folder = here.join(format!("lacks{}", lacks.len()));
        fs::create_dir(&folder).unwrap();
        fs::write(folder.join("binout0000"), binout_with(&run, is_kept)).unwrap();
        let name = folder.file_name().unwrap().to_str().unwrap().to_string();
        let text = crumple_ok(&here, &["init", &name, "-o", "-"]);
        says(&text, from);
        let study: Table = text.parse().unwrap();
        let speed = number(&study["run"][0]["speed"], "km/h");
        assert!((speed / 48.0 - 1.0).abs() < 2e-3, "{speed}");
    }
}

/// Speed and crush of a body that meets a moving wall are not those of the impact.
#[test]
fn a_wall_that_moves_is_named() {
    let (_folder, here) = four_runs();
    let deck = "*KEYWORD\n*RIGIDWALL_PLANAR_MOVING\n         0\n       0.0       0.0       0.0       1.0\n      1.25    3333.3\n*END\n";
    fs::write(here.join("36kmh/main.k"), deck).unwrap();
    let said = warned(&here, "init 36kmh -o moving.toml");
    says(&said, "run 36kmh: the wall of the deck main.k, line 2, moves: speed and crush");
    let said = warned(&here, "build moving.toml -o moving.h5");
    says(&said, "36kmh: the wall of the deck main.k, line 2, moves: speed, deflection and energy");
    // Another wall than that of the force.
    let two = "*KEYWORD\n*RIGIDWALL_PLANAR_ID\n         1wall\n         0\n       0.0       0.0       0.0       1.0\n*RIGIDWALL_PLANAR_MOVING_ID\n         2ram\n         0\n       0.0       0.0       0.0       1.0\n      1.25    3333.3\n*END\n";
    fs::write(here.join("36kmh/main.k"), two).unwrap();
    for command in ["init 36kmh -o fixed.toml", "build fixed.toml -o fixed.h5"] {
        let said = String::from_utf8(crumple_in(&here, command).stderr).unwrap();
        assert!(!said.contains("moves"), "{said}");
    }
}

/// A plate that is driven through a tube at a constant speed: no impact, and no run that died either.
#[test]
fn a_prescribed_motion_is_named() {
    let mut history = History { bodies: vec![Default::default()], ..History::default() };
    for k in 0..400 {
        let time_s = 1e-4 * f64::from(k);
        history.time_s.push(time_s);
        history.contact_n.push(60e3 * (time_s / 2e-3).min(1.0));
        history.bodies[0].displacement_m[4].push(5.0 * time_s);
        history.bodies[0].velocity_m_per_s[4].push(5.0);
    }
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    one_body(&here.join("tube/a"), &history);
    let error = crumple_fails(here, 1, "init tube");
    says(&error, "it terminated early: the record ends at 0.0399");
    says(&error, "(if their motion is prescribed, write a table of deflection and force");

    // A wall that hits a body at rest.
    let motion = &mut history.bodies[0];
    for (k, time_s) in history.time_s.iter().enumerate() {
        motion.displacement_m[4][k] = 25.0 * time_s * time_s;
        motion.velocity_m_per_s[4][k] = 50.0 * time_s;
    }
    one_body(&here.join("hit/a"), &history);
    let error = crumple_fails(here, 1, "init hit");
    says(
        &error,
        "if a moving wall hits the body, write a table of deflection (the wall's way less",
    );
    fs::write(here.join("hit.toml"), "[study]\nname = \"hit\"\ngroup = \"hit\"\nunits = \"mm-t-s\"\nkind = \"wall\"\n[recipe]\ndeflection = { file = \"nodout\", node = 5, component = \"x_displacement\" }\nforce = { file = \"rwforc\", id = 1, component = \"x_force\" }\nfilter = \"none\"\nsampling = { states = 300, interval_ms = 0.1 }\n[[run]]\npath = \"hit/a\"\nspeed = \"40km/h\"\nmass = \"1.2t\"\n").unwrap();
    let error = crumple_fails(here, 1, "build hit.toml");
    says(&error, "the body does not move at first and gains speed under the force");
    says(
        &error,
        "write a table of deflection and force, which crumple histories gives, and add it",
    );
}
