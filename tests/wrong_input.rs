//! Wrong input: the message names file, place and remedy, the exit code is 1 or 2, and
//! nothing half-written stays behind.

use std::fs;
use std::path::Path;

use crate::common::{
    build_fixture, crumple_fails, crumple_in, crumple_ok, demo_folder, entries, fixture,
    held_by_another, python, says, shared,
};

/// The run of each group that is studied.
const RUNS: [(&str, &str); 3] =
    [("lead-car-wall", "25kmh"), ("lead-car-pair", "36kmh"), ("vehicle-pair", "6kmh")];

/// A study of one run, changed by one replacement.
struct Study {
    folder: tempfile::TempDir,
}

impl Study {
    fn new(group: &str, from: &str, to: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let source = fixture(&format!("fe/{group}"));
        let text = fs::read_to_string(source.join("study.toml")).unwrap();
        assert!(text.contains(from), "{from} is in the manifest");
        let run = RUNS.iter().find(|(g, _)| *g == group).unwrap().1;
        let mut parts = text.split("[[run]]");
        let head = parts.next().unwrap();
        let entry = parts.find(|entry| entry.contains(&format!("\"{run}\""))).unwrap();
        let one_run = format!("{head}[[run]]{entry}");
        assert!(one_run.contains(from));
        fs::write(folder.path().join("study.toml"), one_run.replace(from, to)).unwrap();
        fs::create_dir(folder.path().join(run)).unwrap();
        for entry in source.join(run).read_dir().unwrap() {
            let entry = entry.unwrap();
            fs::copy(entry.path(), folder.path().join(run).join(entry.file_name())).unwrap();
        }
        Self { folder }
    }

    /// Builds, which must fail and leave nothing; returns the message.
    fn fails(&self) -> String {
        let before = entries(self.folder.path());
        let error = crumple_fails(self.folder.path(), 1, "build study.toml -o c.h5");
        assert_eq!(entries(self.folder.path()), before, "nothing is left behind");
        error
    }
}

#[test]
#[ignore = "needs ../shared (the real files)"]
fn near_ids_come_first() {
    let folder = shared("samples/lsdyna/nodout");
    let path = folder.join("mlp6_113151_smp_d_1000nodes");
    let error =
        crumple_fails(Path::new("."), 1, &["histories", path.to_str().unwrap(), "--id", "1004"]);
    says(&error, "nodout has no node 1004: the nearest of its ids are 1000, 999, 998");
}

/// What inspect finds in a file that cannot be used is in build's message.
#[test]
fn a_run_that_fails_says_what_is_wrong_with_its_files() {
    let study = Study::new("lead-car-wall", "\"24t\"", "\"24t\"");
    let run = entries(study.folder.path()).into_iter().find(|name| name != "study.toml").unwrap();
    let path = study.folder.path().join(&run).join("rwforc");
    let text = fs::read_to_string(&path).unwrap();
    // Every row but one is overwritten.
    let mut rows = 0;
    let lines: Vec<String> = text
        .lines()
        .map(|line| {
            let is_row = line.split_whitespace().count() == 6
                && line.split_whitespace().all(|word| word.parse::<f64>().is_ok());
            rows += usize::from(is_row);
            if is_row && rows > 1 { line.replace('.', "?") } else { line.to_string() }
        })
        .collect();
    assert!(rows > 100);
    fs::write(&path, lines.join("\n") + "\n").unwrap();
    let error = study.fails();
    let inspected = crumple_ok(study.folder.path(), &["inspect", path.to_str().unwrap(), "--json"]);
    let inspected: serde_json::Value = serde_json::from_str(&inspected).unwrap();
    let first = inspected["files"][0]["problems"][0]["message"].as_str().unwrap();
    says(&error, "(damage in the run's files: rwforc: line ");
    says(&error, first);
    says(&error, " more, which crumple inspect lists)");
}

/// One bad run among good ones is reported; the others are built.
#[test]
fn the_other_runs_go_on() {
    let folder = tempfile::tempdir().unwrap();
    let source = fixture("fe/lead-car-wall");
    let text = fs::read_to_string(source.join("study.toml")).unwrap();
    let absolute = text.replace("path  = \"", &format!("path  = \"{}/", source.display()));
    let absolute = absolute.replace("/36kmh\"", "/37kmh\"");
    fs::write(folder.path().join("study.toml"), absolute).unwrap();
    says(&crumple_fails(folder.path(), 1, "build study.toml -o c.h5"), "37kmh does not exist");
    let list = crumple_ok(folder.path(), "db ls c.h5 --json");
    let list: serde_json::Value = serde_json::from_str(&list).unwrap();
    assert_eq!(list["groups"]["lead-car-wall"].as_array().unwrap().len(), 6);
}

/// A run that died: its complete states are used, and it is reported.
#[test]
fn a_cut_run_is_used_as_far_as_it_goes() {
    let study = Study::new("lead-car-wall", "\"24t\"", "\"24t\"");
    let path = study.folder.path().join("25kmh/nodout");
    let text = fs::read(&path).unwrap();
    fs::write(&path, &text[..text.len() - 250]).unwrap();
    let output = crumple_in(study.folder.path(), "build study.toml -o c.h5 --strict");
    assert_eq!(output.status.code(), Some(3));
    let error = String::from_utf8(output.stderr).unwrap();
    says(&error, "the state at time 0.2992515 is not complete");
    says(&error, "is not complete and is left out");
}

/// A run that ended before its largest crush is a lower bound: no reference, but a training curve.
#[test]
fn methods_are_compared_where_runs_are_whole() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    crate::common::write_contents(here, &crate::common::contents(&fixture("fe/lead-car-wall")));
    let path = here.join("48kmh/nodout");
    let text = fs::read_to_string(&path).unwrap();
    let (cut, _) = text.match_indices("n o d a l").nth(130).unwrap();
    fs::write(&path, &text[..text[..cut].rfind('\n').unwrap()]).unwrap();
    crumple_in(here, &["build", "study.toml", "-o", "c.h5"]);
    let output = crumple_in(here, &["compare", "c.h5", "--nsdm-seeds", "0"]);
    let (table, error) =
        (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    assert!(output.status.success(), "{error}");
    assert!(error.contains("case \"48kmh\" ended while loading and cannot serve"), "{error}");
    let means = table.lines().find(|line| line.contains(": means over ")).unwrap();
    assert!(means.contains("36 km/h") && !means.contains("48 km/h"), "{means}");
    assert!(!table.contains("FE at 48 km/h"), "{table}");
    let error = crumple_fails(here, 1, &["compare", "c.h5", "--speed", "48km/h"]);
    assert!(error.contains("compare at another speed"), "{error}");
}

/// The old database survives a target that cannot be replaced.
#[test]
fn a_second_writer_is_known_and_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = build_fixture(folder.path(), "lead-car-wall");
    let before = fs::read(&path).unwrap();
    let lock = held_by_another(&path);
    let study = fixture("fe/lead-car-pair/study.toml");
    let error =
        crumple_fails(folder.path(), 1, &["build", study.to_str().unwrap(), "-o", "curves.h5"]);
    says(&error, "is being written by another process: try again");
    // A link to the database is the database.
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(&path, folder.path().join("link.h5")).unwrap();
        let arguments = ["build", study.to_str().unwrap(), "-o", "link.h5"];
        assert!(crumple_fails(folder.path(), 1, &arguments).contains("being written"));
    }
    drop(lock);
    assert_eq!(fs::read(&path).unwrap(), before);
}

/// A database that another program writes, or whose writer has died, is named as that.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn a_database_in_use_by_h5py_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let path = build_fixture(here, "lead-car-wall");
    fs::copy(&path, here.join("died.h5")).unwrap();
    let died =
        "import h5py, os\nf = h5py.File('died.h5', 'r+')\nf.attrs['x'] = 1\nf.flush()\nos._exit(0)";
    assert!(python().args(["-c", died]).current_dir(here).status().unwrap().success());
    let open =
        "import h5py, sys\nf = h5py.File('curves.h5', 'r+')\nprint(flush=True)\nsys.stdin.read()";
    let mut writer = python()
        .args(["-c", open])
        .current_dir(here)
        .stdin(std::process::Stdio::piped())
        .stdout(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let mut is_open = [0];
    std::io::Read::read_exact(writer.stdout.as_mut().unwrap(), &mut is_open).unwrap();
    let study = fixture("fe/lead-car-pair/study.toml");
    let study = study.to_str().unwrap();
    for file in ["curves.h5", "died.h5"] {
        for command in
            [&["db", "ls", file][..], &["db", "check", file], &["build", study, "-o", file]]
        {
            let error = crumple_fails(here, 1, command);
            says(&error, "another program has this HDF5 file open for writing");
            assert!(error.contains("h5clear -s") && !error.contains("::"), "{error}");
        }
    }
    drop(writer.stdin.take());
    assert!(writer.wait().unwrap().success());
    crumple_ok(here, "db ls curves.h5");
}

/// Flipped bits in a database: an error or a result, never a panic.
#[test]
fn damaged_databases_never_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = build_fixture(folder.path(), "lead-car-wall");
    let bytes = fs::read(&path).unwrap();
    let damaged = folder.path().join("damaged.h5");
    let mut state = 1u64;
    for _ in 0..1_500 {
        let mut copy = bytes.clone();
        for _ in 0..3 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let at = (state >> 20) as usize % copy.len();
            copy[at] ^= 1 << (state >> 60 & 7);
        }
        if state.is_multiple_of(5) {
            copy.truncate((state >> 15) as usize % copy.len());
        }
        fs::write(&damaged, &copy).unwrap();
        let _ = crumple::database::Database::read(&damaged);
    }
}

/// h5py's own files of the newest layout are refused or read, not crashed on.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn foreign_files_of_h5py_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let script = "import h5py\n\
        for v in ['earliest', 'latest']:\n    \
        with h5py.File(v + '.h5', 'w', libver=v) as f:\n        f['a'] = [1, 2, 3]\n        f.create_dataset('b', data=range(100), chunks=(10,), compression='gzip')\n";
    assert!(python().arg("-c").arg(script).current_dir(folder.path()).status().unwrap().success());
    for name in ["earliest.h5", "latest.h5"] {
        says(&crumple_fails(folder.path(), 1, &["db", "ls", name]), "is not a curve database");
    }
}

/// A format that does not fit gives no table of nothing, but says what the file is.
#[test]
fn a_named_format_that_does_not_fit_is_an_error() {
    let nodout = fixture("fe/lead-car-wall/25kmh/nodout");
    let nodout = nodout.to_str().unwrap();
    let here = Path::new(".");
    for format in ["rcforc", "glstat", "t01"] {
        for command in ["histories", "inspect"] {
            let error = crumple_fails(here, 1, &[command, nodout, "--format", format]);
            let expected =
                format!("this is not a {format}: it looks like a nodout: read it as such");
            says(&error, &expected);
        }
    }
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("notes"), "a\nb\nc\n").unwrap();
    let error = crumple_fails(folder.path(), 1, "histories notes --format nodout");
    says(&error, "no solver output is recognised in it");
    // A file that ends after its header tells no format: it is the one that was named.
    let header = " title\n                    ls-dyna smp d R14 R14.0 date 12/12/2022\n";
    fs::write(folder.path().join("out"), header).unwrap();
    crumple_ok(folder.path(), "inspect --strict out --format nodout");
}

/// A title may hold an escape sequence, which a terminal would obey.
#[test]
fn text_of_files_is_printed_without_control_characters() {
    let folder = tempfile::tempdir().unwrap();
    let text = fs::read_to_string(fixture("fe/lead-car-wall/25kmh/nodout")).unwrap();
    let (_, rest) = text.split_once('\n').unwrap();
    let hostile = format!(
        "\x1b]0;owned\x07 \u{9b}31m title \r\n{}x\x1b[2Jx\n",
        rest.replace("{END LEGEND}", "   900009     \x1b[31mred\u{9b}\n{END LEGEND}")
    );
    fs::write(folder.path().join("nodout"), hostile).unwrap();
    let control = |text: &str| text.chars().any(|c| c.is_control() && c != '\n' && c != '\t');
    for arguments in [
        vec!["inspect", "nodout"],
        vec!["inspect", "nodout", "--json"],
        vec!["histories", "nodout"],
        vec!["histories", "nodout", "--id", "5"],
        vec!["histories", "\x1b[31mnodout"],
    ] {
        let output = crumple_in(folder.path(), &arguments);
        for stream in [&output.stdout, &output.stderr] {
            let stream = String::from_utf8(stream.clone()).unwrap();
            assert!(!control(&stream), "{arguments:?} printed {stream:?}");
        }
    }
    // JSON loses nothing.
    let text = crumple_ok(folder.path(), "inspect nodout --json");
    let report: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(report["files"][0]["title"], "\x1b]0;owned\x07 \u{9b}31m title");
}

/// A database of curves is not lost to a name that was meant for histories.
#[test]
fn histories_replace_no_other_hdf5_file() {
    let folder = tempfile::tempdir().unwrap();
    let database = build_fixture(folder.path(), "lead-car-wall");
    let before = fs::read(&database).unwrap();
    let rwforc = fixture("fe/lead-car-wall/25kmh/rwforc");
    let rwforc = rwforc.to_str().unwrap();
    let write = |name: &str| vec!["histories".to_string(), rwforc.into(), "-o".into(), name.into()];
    let arguments = write("curves.h5");
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    for more in [&[][..], &["--json"]] {
        let output = crumple_in(folder.path(), &[&arguments[..], more].concat());
        assert_eq!(output.status.code(), Some(2));
        // As text on standard error, as JSON on standard output.
        let error = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
        says(
            &error,
            "curves.h5 is an HDF5 file without histories, such as a curve database: name another file, or replace it with --overwrite",
        );
    }
    assert_eq!(fs::read(&database).unwrap(), before);
    crumple_ok(folder.path(), &[&arguments[..], &["--overwrite"]].concat());
    assert_ne!(fs::read(&database).unwrap(), before);
    // A file of histories is replaced, as any other output.
    crumple_ok(folder.path(), &arguments);
}

/// What is not the command's own kind of output is not replaced by a name that was mistyped.
#[test]
fn outputs_replace_no_other_kind_of_file() {
    let folder = demo_folder();
    let here = folder.path();
    let nodout = fixture("fe/lead-car-wall/25kmh/nodout");
    fs::copy(&nodout, here.join("kept")).unwrap();
    fs::copy(&nodout, here.join("other.csv")).unwrap();
    fs::copy(here.join("lead.model"), here.join("cases.csv")).unwrap();
    fs::write(here.join("own.csv"), "t_s,a_g\n0,1\n").unwrap();
    fs::write(here.join("model.k"), "*KEYWORD\n*END\n").unwrap();
    fs::write(here.join("Train.mo"), "model Train\nend Train;\n").unwrap();
    let before = |name: &str| fs::read(here.join(name)).unwrap();
    for (line, name, what) in [
        (
            "train curves.h5 --group lead-car-wall --model linear -o scenario.toml",
            "scenario.toml",
            "a study",
        ),
        ("train curves.h5 --group lead-car-wall --model linear -o kept", "kept", "a solver's file"),
        (
            "train curves.h5 --group lead-car-wall --model linear -o own.csv",
            "own.csv",
            "a file of another kind",
        ),
        ("predict lead.model --speed 50km/h --to csv -o pair.model", "pair.model", "a model"),
        ("export lead50.json --to csv -o curves.h5", "curves.h5", "an HDF5 file"),
        ("export lead.model --to table -o curves.h5", "curves.h5", "an HDF5 file"),
        ("export lead50.json --to lsdyna --units mm-t-s -o kept", "kept", "a solver's file"),
        ("report curves.h5 -o lead.model", "lead.model", "a model"),
        (
            "export lead50.json --to lsdyna -o model.k",
            "model.k",
            "an input that crumple did not write",
        ),
        (
            "predict lead.model --speed 50km/h -o model.k",
            "model.k",
            "an input that crumple did not write",
        ),
        ("export lead50.json -o Train.mo", "Train.mo", "an input that crumple did not write"),
        ("histories fe/lead-car-wall/25kmh/rwforc -o other.csv", "other.csv", "a solver's file"),
        ("db export curves.h5 -o .", "./cases.csv", "a model"),
        ("sweep scenario.toml --restart -o curves.h5", "curves.h5", "an HDF5 file"),
        ("sweep scenario.toml -o other.csv", "other.csv", "a solver's file"),
        ("sweep merge own.csv -o cases.csv", "cases.csv", "a model"),
    ] {
        let old = before(name);
        let words: Vec<&str> = line.split(' ').collect();
        let error = crumple_fails(here, 2, &words);
        let expected = format!("-o {name} exists and is {what}");
        assert!(error.contains(&expected) && error.contains("--overwrite"), "{line}: {error}");
        assert!(before(name) == old, "{line}");
        if name == "kept" {
            crumple_ok(here, &[&words[..], &["--overwrite"]].concat());
            fs::write(here.join(name), old).unwrap();
        }
    }
    // What an earlier export wrote is.
    for _ in 0..2 {
        for file in ["o.k", "o.rad", "o.inp", "o.cmd", "o.adm", "o.spr", "o.mo", "o.txt", "o.fmu"] {
            crumple_ok(here, &format!("export lead50.json -q -o {file}"));
        }
        for to in ["radioss -o decks", "lsdyna -o deck.k", "calculix -o deck.inp"] {
            crumple_ok(here, &format!("export lead50.json --deck -q --to {to}"));
        }
    }
    crumple_ok(here, "sweep scenario.toml -o other.csv -q --overwrite");
    assert!(before("other.csv").starts_with(b"# crumple sweep"));
    fs::copy(&nodout, here.join("other.csv")).unwrap();
    // Models, databases and folders are not written to standard output, nor to a file named "-".
    for line in ["train curves.h5", "build study.toml", "demo", "man", "db export curves.h5"] {
        let error = crumple_fails(here, 2, &format!("{line} -o -"));
        says(&error, "this cannot be written to standard output: name it");
        assert!(!here.join("-").exists(), "{line}");
    }
    // Its own kind is replaced as before.
    for _ in 0..2 {
        crumple_ok(here, "db export curves.h5 -o tables -q");
        crumple_ok(here, "histories fe/lead-car-wall/25kmh/rwforc -o own-histories.csv");
    }
    let train = ["train", "curves.h5", "--group", "lead-car-wall", "--model", "linear", "-o"];
    crumple_ok(here, &[&train[..], &["lead.model"]].concat());
    // A demo keeps scenarios that were edited.
    let elsewhere = tempfile::tempdir().unwrap();
    fs::create_dir(elsewhere.path().join("crumple-demo")).unwrap();
    fs::write(elsewhere.path().join("crumple-demo/scenario.toml"), "# mine\n").unwrap();
    let error = crumple_fails(elsewhere.path(), 2, "demo");
    says(&error, "scenario.toml exists and differs from what the demo writes");
}
