//! OpenRadioss T01 against the text of the same runs, and damaged files.

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::{crumple_in, crumple_ok, fixture, shared};
use crumple::history::EntityId;
use crumple::solver::{ProblemCode, Selection, SolverFile, read, read_sections};

fn section(path: &Path, name: &str) -> SolverFile {
    read(path, None, &Selection { section: Some(name.into()), ..Selection::all() }).unwrap()
}

/// Every value of the text equals T01's to the six digits (rwforc: seven) that it prints.
fn agrees(text: &SolverFile, binary: &SolverFile, digits: f64) -> usize {
    assert_eq!(text.time.len(), binary.time.len());
    let mut compared = 0;
    for history in &text.histories {
        // T01 has no coordinates, no moments, and no total energy.
        let Some(other) = binary.history(history.entity, &history.component) else { continue };
        // Where differences cancel, the last bits of the impulses count.
        let largest = other.values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        for (a, b) in history.values.iter().zip(&other.values) {
            let unit = 10f64.powf(b.abs().log10().floor() - digits + 1.0);
            let close = (a - b).abs() <= 0.5000001 * unit + 1e-13 * largest;
            assert!(a == b || close, "{}: {a} and {b}", history.label());
            compared += 1;
        }
    }
    compared
}

/// Holds T01 against the text of a run, of whose nodout `nodes` are left.
fn run_agrees(text: &Path, t01: &Path, nodes: usize) {
    let read = |name: &str| read(&text.join(name), None, &Selection::all()).unwrap();
    let compared = agrees(&read("nodout"), &section(t01, "nodout"), 6.0);
    assert!(compared >= 400 * 9 * nodes, "{compared} values of {}", text.display());
    if text.join("glstat").is_file() {
        assert!(agrees(&read("glstat"), &section(t01, "glstat"), 6.0) >= 400 * 5);
    }
    if text.join("rwforc").is_file() {
        assert!(agrees(&read("rwforc"), &section(t01, "rwforc"), 7.0) >= 400 * 4);
    }
    if text.parent().is_some_and(|group| group.ends_with("lead-car-pair")) {
        assert_eq!(agrees(&read("rcforc"), &section(t01, "rcforc"), 6.0), 400 * 6);
    }
}

/// The runs whose T01 is in the fixtures, and of how many nodes the text there is.
const RUNS: [(&str, usize); 2] = [("lead-car-pair/36kmh", 2), ("lead-car-wall/25kmh", 1)];

fn t01_of(run: &str) -> PathBuf {
    fixture(&format!("t01/{run}/crashT01"))
}

#[test]
fn t01_and_text_of_a_run_agree_and_it_is_clean() {
    for (run, nodes) in RUNS {
        run_agrees(&fixture(&format!("fe/{run}")), &t01_of(run), nodes);
        crumple_ok(Path::new("."), &["inspect", "--strict", t01_of(run).to_str().unwrap()]);
    }
}

#[test]
#[ignore = "needs ../shared (the real files)"]
fn t01_and_text_of_every_run_agree() {
    let folder = shared("fe");
    let mut runs = 0;
    for group in ["lead-car-wall", "lead-car-pair", "vehicle-pair", "train-set"] {
        for run in folder.join(group).read_dir().unwrap() {
            let run = run.unwrap().path();
            if !run.is_dir() {
                continue;
            }
            assert!(run.join("glstat").is_file(), "{}", run.display());
            run_agrees(&run, &run.join("crashT01"), 4);
            runs += 1;
        }
    }
    assert!(runs >= 17, "{runs} runs");
}

/// Nodes that stand on a wall for one state are not damage.
#[test]
#[ignore = "needs ../shared (the real files)"]
fn every_t01_of_the_fe_runs_is_clean() {
    let folder = shared("fe");
    let mut files = 0;
    for group in folder.read_dir().unwrap().map(|entry| entry.unwrap().path()) {
        for run in group.read_dir().into_iter().flatten().map(|entry| entry.unwrap().path()) {
            let path = run.join("crashT01");
            if path.is_file() {
                crumple_ok(Path::new("."), &["inspect", "--strict", path.to_str().unwrap()]);
                files += 1;
            }
        }
    }
    assert!(files >= 17, "{files} files");
}

/// A range of zeros names what it took.
#[test]
fn overwritten_values_are_named_with_entity_and_component() {
    let mut bytes = fs::read(t01_of("lead-car-wall/25kmh")).unwrap();
    // A state has records of 4, 88, 24, 24, 432 (12 nodes with 9 values each) and 36 bytes.
    let at = bytes.len() - 200 * (608 + 6 * 8) + (4 + 88 + 24 + 24 + 4 * 8) + 4;
    bytes[at + 36..at + 3 * 36].fill(0);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("runT01");
    fs::write(&path, bytes).unwrap();
    let file = section(&path, "nodout");
    let said: Vec<String> = file.problems.iter().map(|p| p.message.clone()).collect();
    let (first, last) = (file.entities[1].id, file.entities[2].id);
    assert!(
        said.iter().any(|m| m.contains(&format!("x_displacement[{first}] to ")))
            && said.iter().any(|m| m.contains(&format!("[{last}], are zero"))),
        "{said:?}"
    );
}

/// A study whose folders hold nothing but T01 gives the curves of the text.
#[test]
fn a_study_of_t01_alone() {
    let folder = tempfile::tempdir().unwrap();
    let text = fs::read_to_string(fixture("fe/lead-car-pair/study.toml")).unwrap();
    let one_run: Vec<&str> = text.splitn(3, "[[run]]").take(2).collect();
    for (study, files) in [("t01", &[][..]), ("both", &["nodout", "rcforc"])] {
        let run = folder.path().join(study).join("36kmh");
        fs::create_dir_all(&run).unwrap();
        fs::write(folder.path().join(study).join("study.toml"), one_run.join("[[run]]")).unwrap();
        fs::copy(t01_of("lead-car-pair/36kmh"), run.join("crashT01")).unwrap();
        for file in files {
            fs::copy(fixture("fe/lead-car-pair/36kmh").join(file), run.join(file)).unwrap();
        }
    }
    let build = |study: &str, output: &str| -> serde_json::Value {
        serde_json::from_str(&crumple_ok(folder.path(), &["build", study, "-o", output, "--json"]))
            .unwrap()
    };
    let binary = build("t01/study.toml", "t01.h5");
    let text = build("both/study.toml", "text.h5");
    assert_eq!(text["runs"].as_array().unwrap().len(), 1);
    for (a, b) in binary["runs"].as_array().unwrap().iter().zip(text["runs"].as_array().unwrap()) {
        for key in ["work_J", "max_deflection_m", "peak_force_N"] {
            let (a, b) = (a["case"][key].as_f64().unwrap(), b["case"][key].as_f64().unwrap());
            assert!((a / b - 1.0).abs() < 1e-5, "{key}: {a} and {b}");
        }
        assert!(a["case"]["notes"].to_string().contains("read from section nodout of crashT01"));
        assert!(
            b["case"]["notes"].to_string().contains("section rcforc of crashT01 agrees with it")
        );
    }
}

/// States some milliseconds apart do not show where in the first of them the contact lies.
#[test]
fn a_contact_in_a_long_first_interval_is_uncertain() {
    let folder = tempfile::tempdir().unwrap();
    let text = fs::read_to_string(fixture("fe/lead-car-wall/study.toml")).unwrap();
    let (head, runs) = text.split_once("[[run]]").unwrap();
    let run = runs.split("[[run]]").find(|run| run.contains("25kmh")).unwrap();
    fs::write(folder.path().join("study.toml"), format!("{head}[[run]]{run}")).unwrap();
    fs::create_dir(folder.path().join("25kmh")).unwrap();
    let path = folder.path().join("25kmh/crashT01");
    let bytes = fs::read(t01_of("lead-car-wall/25kmh")).unwrap();
    fs::write(&path, &bytes).unwrap();
    let states = section(&path, "nodout").time.len();
    let (header, states) = bytes.split_at(bytes.len() - states * STATE);
    for (every, is_uncertain) in [(1, false), (4, true)] {
        let kept: Vec<&[u8]> = states.chunks(STATE).step_by(every).collect();
        fs::write(&path, [header, &kept.concat()].concat()).unwrap();
        let build = "build study.toml -o c.h5 --overwrite";
        let said = String::from_utf8(crumple_in(folder.path(), build).stderr).unwrap();
        let warning = "taken at the first state; the crush may be up to 20.8";
        assert_eq!(said.contains(warning), is_uncertain, "{every}: {said}");
    }
}

#[test]
fn cut_anywhere_gives_the_whole_states() {
    let bytes = fs::read(t01_of("lead-car-pair/36kmh")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("runT01");
    fs::write(&path, &bytes).unwrap();
    let whole = section(&path, "nodout");
    let mut kept_before = 0;
    for step in 0..400 {
        let cut = bytes.len() * step / 400;
        fs::write(&path, &bytes[..cut]).unwrap();
        let Ok(sections) = read_sections(&path, Some("t01"), &Selection::all()) else { panic!() };
        let Some(file) = sections.iter().find(|s| s.section == "nodout") else { continue };
        let kept = file.time.len();
        assert!(kept >= kept_before);
        kept_before = kept;
        for (a, b) in file.histories.iter().zip(&whole.histories) {
            assert_eq!(a.values, b.values[..kept], "cut at {cut}");
        }
        // Every state is 1 of 400 equal parts, so hardly any cut falls between two.
        let said = file.problems.iter().any(|p| p.code == ProblemCode::IncompleteState);
        assert!(said || kept == 0 || cut == 0, "cut at {cut}");
    }
    assert!(kept_before > 390);
}

#[test]
fn damaged_files_never_panic() {
    let bytes = fs::read(t01_of("lead-car-pair/36kmh")).unwrap();
    let bytes = &bytes[..8_000];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("runT01");
    let mut state = 3u64;
    let mut random = |n: usize| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % n
    };
    for _ in 0..2_000 {
        let mut copy = bytes.to_vec();
        for _ in 0..4 {
            let at = random(copy.len());
            copy[at] ^= 1 << random(8);
        }
        copy.truncate(random(copy.len()) + 1);
        fs::write(&path, &copy).unwrap();
        for file in read_sections(&path, Some("t01"), &Selection::all()).into_iter().flatten() {
            assert!(file.histories.iter().all(|h| h.values.len() == file.time.len()));
        }
    }
}

/// A T01 written here: `code` tells the length of titles; one object per group, its values
/// rise by its id in every state of 1 ms.
fn written(code: i32, groups: &[(i32, i32, usize)], states: usize) -> Vec<u8> {
    let mut out = Vec::new();
    let mut record = |payload: &[u8]| {
        let length = (payload.len() as i32).to_be_bytes();
        out.extend([&length, payload, &length].concat());
    };
    let integers =
        |values: &[i32]| values.iter().flat_map(|v| v.to_be_bytes()).collect::<Vec<u8>>();
    let reals = |values: &[f32]| values.iter().flat_map(|v| v.to_be_bytes()).collect::<Vec<u8>>();
    let title = vec![
        b't';
        match code {
            ..3041 => 40,
            3041..4021 => 80,
            _ => 100,
        }
    ];
    record(&[&integers(&[code])[..], &[b'r'; 80]].concat());
    record(&[b'd'; 80]);
    if code > 3050 {
        record(&integers(&[1]));
        record(&integers(&[0; 4]));
    }
    record(&integers(&[0, 0, 0, 0, groups.len() as i32, 0]));
    for &(kind, id, variables) in groups {
        record(&[&integers(&[1, kind, 0, 1, variables as i32])[..], &title].concat());
        record(&[&integers(&[id])[..], &title].concat());
        record(&integers(&(1..=variables as i32).collect::<Vec<_>>()));
    }
    for state in 0..states {
        record(&reals(&[state as f32 / 1024.0]));
        for &(_, id, variables) in groups {
            record(&reals(&vec![(state as i32 * id) as f32; variables]));
        }
    }
    out
}

/// Sections (type 104) and every length of titles: forces are the rate of the impulses.
#[test]
fn sections_and_titles_of_other_lengths() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("runT01");
    for code in [3040, 3041, 4021] {
        fs::write(&path, written(code, &[(0, 9, 9), (104, 2, 6)], 5)).unwrap();
        let sections = section(&path, "secforc");
        assert_eq!(sections.problems, []);
        let force = sections.history(Some(EntityId::new(2)), "x_force").unwrap();
        // Normal and tangential impulse rise by 2 each in 1/1024 s.
        assert_eq!(force.values, [4.0 * 1024.0; 5], "{code}");
        assert!(sections.notes[0].contains("central difference"), "{:?}", sections.notes);
        let nodes = section(&path, "nodout");
        assert_eq!(
            nodes.history(Some(EntityId::new(9)), "z_acceleration").unwrap().values[4],
            36.0
        );
        assert!(nodes.notes.is_empty());
    }
}

/// A damaged state is left out; those behind it are found by the length of a state.
#[test]
fn damage_in_the_middle_costs_one_state() {
    let bytes = written(3040, &[(0, 9, 9)], 100);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("runT01");
    let stride = (4 + 8) + (36 + 8);
    let at = bytes.len() - 50 * stride;
    let mut damaged = bytes.clone();
    damaged[at..at + 10].fill(0);
    fs::write(&path, &damaged).unwrap();
    let file = section(&path, "nodout");
    assert_eq!(file.time.len(), 99);
    assert_eq!(
        file.problems[0].to_string(),
        format!("byte {at}: state 51 is cut or damaged; it is left out")
    );
    // Zeros among values are known only by those around them.
    let mut zeroed = bytes;
    zeroed[at + 20..at + 48].fill(0);
    fs::write(&path, &zeroed).unwrap();
    let file = section(&path, "nodout");
    assert_eq!(file.time.len(), 100);
    assert_eq!(file.problems[0].code, ProblemCode::SuspectZeros);
}

/// A run with several groups of one kind has one section of them all.
#[test]
fn groups_of_one_kind_are_joined() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("runT01");
    fs::write(&path, written(3040, &[(0, 9, 9), (104, 2, 6), (0, 5, 9)], 5)).unwrap();
    let nodes = section(&path, "nodout");
    assert_eq!(nodes.problems, []);
    for id in [9, 5] {
        let values = &nodes.history(Some(EntityId::new(id)), "x_displacement").unwrap().values;
        assert_eq!(values[4], 4.0 * id as f64);
    }
}

/// Bytes of a state of lead-car-wall's T01, in records of 4, 88, 24, 24, 432 and 36.
const STATE: usize = 608 + 6 * 8;

/// The bytes of a T01 in two files as a restart leaves them: each with the header, and states of its own.
fn restarted(bytes: &[u8], header: usize, first: usize, again: usize) -> [Vec<u8>; 2] {
    let states = &bytes[header..];
    let part = |states: &[u8]| [&bytes[..header], states].concat();
    [part(&states[..first * STATE]), part(&states[(first - again) * STATE..])]
}

/// T01 and T02 are one record, whose impulses continue.
#[test]
fn a_restart_goes_on_where_the_run_ended() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let bytes = fs::read(t01_of("lead-car-wall/25kmh")).unwrap();
    fs::write(at("wholeT01"), &bytes).unwrap();
    let header = bytes.len() - section(&at("wholeT01"), "nodout").time.len() * STATE;
    for again in [0, 20] {
        let [first, second] = restarted(&bytes, header, 100, again);
        fs::write(at("runT01"), first).unwrap();
        fs::write(at("runT02"), second).unwrap();
        for name in ["nodout", "rwforc", "glstat", "rbdout"] {
            let (whole, joined) = (section(&at("wholeT01"), name), section(&at("runT01"), name));
            assert_eq!(whole.histories, joined.histories, "{name}");
            let said: Vec<ProblemCode> = joined.problems.iter().map(|p| p.code).collect();
            let expected = if again > 0 { vec![ProblemCode::RepeatedState] } else { Vec::new() };
            assert_eq!(said, expected);
            let place = format!("runT02, byte {header}: a restart writes again from time ");
            assert!(joined.problems.iter().all(|p| p.to_string().starts_with(&place)));
        }
    }
    // A state that is cut off the first is missing in the middle.
    let [first, second] = restarted(&bytes, header, 100, 0);
    fs::write(at("runT01"), &first[..first.len() - 10]).unwrap();
    fs::write(at("runT02"), second).unwrap();
    let joined = section(&at("runT01"), "rwforc");
    let before = joined.time[98];
    let expected = format!(
        "states after time {before:?} are missing: the forces on both sides are differences across the gap"
    );
    assert!(
        joined.problems.iter().any(|p| p.message.starts_with(&expected)),
        "{:?}",
        joined.problems
    );
    assert!(joined.problems.iter().all(|p| !p.message.contains("will change")));
    // So is one that is damaged, and one whose time goes back.
    for (at_byte, number, expected) in [
        (0, [0x7f, 0, 0, 0], expected.as_str()),
        (4, 0.0009765625_f32.to_be_bytes(), "the state at time 0.0009765625 is left out"),
    ] {
        let mut damaged = bytes.clone();
        damaged[header + 99 * STATE + at_byte..][..4].copy_from_slice(&number);
        fs::write(at("damagedT01"), damaged).unwrap();
        let read = section(&at("damagedT01"), "rwforc");
        assert_eq!(read.time.len(), section(&at("wholeT01"), "rwforc").time.len() - 1);
        let is_said = read.problems.iter().any(|p| p.message.starts_with(expected));
        assert!(is_said, "{expected}: {:?}", read.problems);
    }
    let [first, second] = restarted(&bytes, header, 100, 20);
    fs::write(at("runT01"), first).unwrap();
    fs::write(at("runT02"), second).unwrap();
    let alone = section(&at("runT02"), "nodout");
    assert_eq!(alone.time.len(), section(&at("wholeT01"), "nodout").time.len() - 80);
    let message = alone.problems[0].to_string();
    assert_eq!(message, "it continues runT01: read runT01 for the whole record");
    // Both are one file of the run; without the first the beginning is missing.
    let listed = crumple_ok(folder.path(), "inspect .");
    assert!(listed.contains("runT01") && !listed.contains("runT02"), "{listed}");
    fs::rename(at("runT02"), at("runT03")).unwrap();
    let message = section(&at("runT01"), "nodout").problems[0].to_string();
    assert_eq!(message, "runT02 is missing, so its continuation is not read");
    fs::remove_file(at("runT01")).unwrap();
    let message = section(&at("runT03"), "nodout").problems[0].to_string();
    assert_eq!(message, "runT02 is missing, so the record starts late");
    for (name, copy) in [("runT02", "runT03"), ("runT06", "runT03")] {
        fs::copy(at(copy), at(name)).unwrap();
    }
    let message = section(&at("runT03"), "nodout").problems[0].to_string();
    assert_eq!(
        message,
        "it continues runT02: read runT02 for all there is, since runT01 is missing; runT04 is missing, so its continuation is not read"
    );
    fs::remove_file(at("runT06")).unwrap();
    // What does not hold the same is not joined.
    fs::write(at("runT01"), written(3040, &[(0, 9, 9), (102, 1, 6)], 5)).unwrap();
    fs::write(at("runT02"), written(3040, &[(0, 8, 9), (102, 1, 6)], 5)).unwrap();
    let file = section(&at("runT01"), "nodout");
    assert_eq!(file.time.len(), 5);
    assert_eq!(
        file.problems[0].to_string(),
        "runT02, byte 0: this continuation holds other histories: neither it nor what follows is read"
    );
    // Nor is another run, by its title or by its begin.
    let mut titled = bytes.clone();
    titled[8] ^= 1;
    for (other, expected) in [
        (titled, "is of another run: its title is "),
        (
            bytes.clone(),
            "begins at time 0.0, where the run does: it is another run: neither it nor",
        ),
    ] {
        fs::write(at("runT01"), &restarted(&bytes, header, 100, 0)[0]).unwrap();
        fs::write(at("runT02"), other).unwrap();
        let file = section(&at("runT01"), "nodout");
        assert_eq!(file.time.len(), 100);
        let said = file.problems[0].to_string();
        let expected = format!("runT02, byte 0: this continuation {expected}");
        assert!(file.problems.len() == 1 && said.starts_with(&expected), "{said}");
    }
}

/// A run of OpenRadioss' own tests that was restarted, and the same in one piece.
#[test]
#[ignore = "needs ../shared (the real files)"]
fn a_real_restart_is_the_uninterrupted_run() {
    let folder = shared("samples/openradioss");
    for name in ["rwforc", "nodout", "matsum", "glstat"] {
        let joined = section(&folder.join("BOULE1V4T01"), name);
        let whole = section(&folder.join("uninterrupted_BOULE1V4T01"), name);
        assert_eq!((joined.time.len(), joined.problems.len()), (130, 0));
        assert_eq!(joined.histories, whole.histories, "{name}");
    }
    let wall = section(&folder.join("BOXBEAM_SUBT01"), "rwforc");
    assert!(
        wall.history(Some(EntityId::new(1)), "z_force").unwrap().values.iter().any(|f| *f != 0.0)
    );
    let accelerations = section(&folder.join("ACCELEROT01"), "accelerometer");
    assert_eq!((accelerations.entities.len(), accelerations.histories.len()), (1, 3));
}

/// A wall that records normal impulses alone; rigid bodies, springs, accelerometers and what has no name here.
#[test]
fn every_group_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("runT01");
    let groups = [(102, 3, 3), (103, 4, 9), (6, 5, 14), (108, 6, 3), (3, 7, 2), (77, 8, 1)];
    fs::write(&path, written(3040, &groups, 5)).unwrap();
    let value = |name: &str, id: i64, component: &str| {
        let file = section(&path, name);
        assert_eq!(file.problems, []);
        let history = file.history(Some(EntityId::new(id)), component);
        history.unwrap_or_else(|| panic!("{name}: {:?}", file.components)).values[4]
    };
    // Values rise by the id in each of 1/1024 s.
    assert_eq!(value("rwforc", 3, "x_force"), 3.0 * 1024.0);
    assert_eq!(value("rwforc", 3, "normal_force"), 3.0 * 1024.0 * 3f64.sqrt());
    assert_eq!(value("rbdout", 4, "y_force"), 4.0 * 1024.0);
    assert_eq!(value("rbdout", 4, "z_moment"), 4.0 * 1024.0);
    assert_eq!(value("rbdout", 4, "x_rotation"), 16.0);
    assert_eq!(value("deforc", 5, "x_force"), 20.0);
    assert_eq!(value("accelerometer", 6, "z_acceleration"), 24.0);
    assert_eq!(value("shell", 7, "variable_2"), 28.0);
    assert_eq!(value("group_77", 8, "variable_1"), 32.0);
    let notes = section(&path, "rwforc").notes;
    assert_eq!(
        notes[1],
        "no tangential impulses are recorded for 3: their forces are the normal components only"
    );
    // The variables of one object may be in several groups: no force is then half of one.
    fs::write(&path, written(3040, &[(102, 3, 3), (102, 3, 6)], 5)).unwrap();
    assert_eq!(value("rwforc", 3, "x_force"), 6.0 * 1024.0);
}

/// The last force of a record that continues is a difference over one interval.
#[test]
fn a_cut_record_says_that_its_last_force_will_change() {
    let bytes = written(3040, &[(0, 9, 9), (102, 3, 6)], 50);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("runT01");
    fs::write(&path, &bytes[..bytes.len() - 10]).unwrap();
    let said = |name: &str| {
        section(&path, name).problems.iter().any(|p| p.message.contains("will change"))
    };
    assert!(said("rwforc") && !said("nodout"));
    fs::write(&path, &bytes).unwrap();
    assert!(!said("rwforc"));
    assert!(
        section(&path, "rwforc").notes[0]
            .ends_with("the last force changes when the record continues")
    );
}
