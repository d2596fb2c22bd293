//! Wrong input: the message names file, place and remedy, the exit code is 1 or 2, and
//! nothing half-written stays behind.

use std::fs;
use std::path::Path;

use crate::common::{
    build_fixture, crumple_fails, crumple_in, crumple_ok, demo_folder, entries, fixture, python,
    shared,
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
        let error = crumple_fails(self.folder.path(), 1, &["build", "study.toml", "-o", "c.h5"]);
        assert_eq!(entries(self.folder.path()), before, "nothing is left behind");
        error
    }
}

#[test]
fn manifests() {
    fn t(from: &str, to: &str, expected: &str) {
        let error = Study::new("lead-car-wall", from, to).fails();
        assert!(error.contains(expected), "{from} → {to} said:\n{error}");
    }
    t(
        "group = \"lead",
        "grop = \"lead",
        "study.toml:5:1: unknown field `grop`, expected one of `name`, `units`, `group`",
    );
    t(
        "mm-t-s",
        "mm-t-fortnight",
        "study.toml:4:9: unit system \"mm-t-fortnight\" is not known: write \"SI\" or",
    );
    t(
        "\"25km/h\"",
        "\"25\"",
        "study.toml:16:9: speed \"25\" has no unit: write for example \"25km/h\" or \"25m/s\"",
    );
    t(
        "\"25km/h\"",
        "25",
        "study.toml:16:9: speed \"25\" has no unit: write for example \"25km/h\"",
    );
    t(
        "\"24t\"",
        "\"24tons\"",
        "mass \"24tons\" has the unknown unit \"tons\": use one of t, kg, g",
    );
    t("\"24t\"", "\"-24t\"", "mass \"-24t\" is out of range: it must be above zero");
    t("\"none\"", "\"CFC61\"", "study.toml:11:14: filter \"CFC61\" is not known: write \"CFC60\"");
    t("id = 1, ", "", "a force needs either id = … (a wall or contact) or node = …");
    t("states = 400", "states = 1", "sampling needs states from 2 to 1000000, found 1");
    t("kind  = \"wall\"", "kind  = \"wal\"", "unknown variant `wal`, expected `wall` or `pair`");
    t(
        "kind  = \"wall\"",
        "kind  = \"wall\"\nhalf_model = true",
        "half_model = true needs kind = \"pair\"",
    );
    t(
        "\"25km/h\"",
        "\"0km/h\"",
        "study.toml:16:9: speed \"0km/h\" is out of range: it must be above zero",
    );
    t("group = \"lead-car-wall\"", "group = \"a/b\"", "study.group = \"a/b\" may not contain");
    t("group = \"lead-car-wall\"", "group = \"a\\u0000b\"", "may not contain");
    t("path  = \"25kmh\"", "path  = \".\"", "run \".\" gives no name for its case: add name = ");
    t(
        "component = \"normal_force\"",
        "component = \"mass\"",
        "\"mass\" of a wall or contact is not a force: use normal_force",
    );
    t("kind  = \"wall\"", "kind  = \"pair\"", "a pair needs the other body: deflection.minus_node");
    t("[study]", "[study", "study.toml:2:");
}

#[test]
fn runs() {
    fn t(group: &str, from: &str, to: &str, expected: &str) {
        let error = Study::new(group, from, to).fails();
        assert!(error.contains(expected), "{from} → {to} said:\n{error}");
    }
    let wall = "lead-car-wall";
    t(
        wall,
        "path  = \"25kmh\"",
        "path  = \"26kmh\"",
        "the run's folder 26kmh does not exist: check path in the manifest",
    );
    t(wall, "\"rwforc\"", "\"rcforc\"", "has no file \"rcforc\": it has case.json, nodout, rwforc");
    t(
        wall,
        "node = 900001",
        "node = 900011",
        "25kmh/nodout: nodout has no node 900011: it has 900001 \"COG of the rigid trailing mass\"",
    );
    t(
        wall,
        "id = 1,",
        "id = 2,",
        "25kmh/rwforc: rwforc has no rigid wall 2: it has 1 \"rigid wall\"",
    );
    t(
        wall,
        "normal_force",
        "norm_force",
        "rwforc has no component \"norm_force\": it has normal_force, x_force",
    );
    t(wall, "\"none\"", "\"CFC180\"", "is too long for CFC180: at most");
    t(
        "lead-car-pair",
        "id = 3",
        "id = 1",
        "interface 1 is a single-surface contact, for which LS-DYNA prints no resultants: ask for a two-sided contact or a force transducer (it has 3:surfa \"car A against car B\"",
    );
}

#[test]
#[ignore = "needs ../shared (the real files)"]
fn near_ids_come_first() {
    let folder = shared("samples/lsdyna/nodout");
    let path = folder.join("mlp6_113151_smp_d_1000nodes");
    let error =
        crumple_fails(Path::new("."), 1, &["histories", path.to_str().unwrap(), "--id", "1004"]);
    assert!(
        error.contains("nodout has no node 1004: the nearest of its ids are 1000, 999, 998"),
        "{error}"
    );
}

/// What inspect finds in a file that cannot be used stands in build's message.
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
    assert!(error.contains("(damage in the run's files: rwforc: line "), "{error}");
    assert!(error.contains(first), "{error}");
    assert!(error.contains(" more, which crumple inspect lists)"), "{error}");
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
    let error = crumple_fails(folder.path(), 1, &["build", "study.toml", "-o", "c.h5"]);
    assert!(error.contains("37kmh does not exist"), "{error}");
    let list = crumple_ok(folder.path(), &["db", "ls", "c.h5", "--json"]);
    let list: serde_json::Value = serde_json::from_str(&list).unwrap();
    assert_eq!(list["groups"]["lead-car-wall"].as_array().unwrap().len(), 6);
}

/// A run that died: its complete states are used, and it is said.
#[test]
fn a_cut_run_is_used_as_far_as_it_goes() {
    let study = Study::new("lead-car-wall", "\"24t\"", "\"24t\"");
    let path = study.folder.path().join("25kmh/nodout");
    let text = fs::read(&path).unwrap();
    fs::write(&path, &text[..text.len() - 250]).unwrap();
    let output =
        crumple_in(study.folder.path(), &["build", "study.toml", "-o", "c.h5", "--strict"]);
    assert_eq!(output.status.code(), Some(3));
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(error.contains("state 400 at time 0.2992515"), "{error}");
    assert!(error.contains("is not complete and is left out"), "{error}");
}

#[test]
fn files_that_are_not_ours() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    fs::write(here.join("text.h5"), "hello\n").unwrap();
    build_fixture(here, "lead-car-wall");
    crumple_ok(
        here,
        &["train", "curves.h5", "--group", "lead-car-wall", "--model", "nearest", "-o", "m.model"],
    );
    let nodout = fixture("fe/lead-car-wall/25kmh/nodout");
    crumple_ok(here, &["histories", nodout.to_str().unwrap(), "-o", "histories.h5"]);
    let study = fixture("fe/lead-car-wall/study.toml");
    let study = study.to_str().unwrap();
    fn t(here: &Path, arguments: &[&str], expected: &str) {
        let before = entries(here);
        let error = crumple_fails(here, 1, arguments);
        assert!(error.contains(expected), "{arguments:?} said:\n{error}");
        assert_eq!(entries(here), before);
    }
    t(here, &["db", "ls", "text.h5"], "text.h5: this is not an HDF5 file");
    t(here, &["db", "ls", "histories.h5"], "histories.h5: this HDF5 file is not a curve database");
    t(here, &["build", study, "-o", "text.h5"], "text.h5: this is not an HDF5 file");
    assert_eq!(
        fs::read(here.join("text.h5")).unwrap(),
        b"hello\n",
        "a file that is not ours stays"
    );
    t(here, &["db", "ls", "none.h5"], "none.h5: No such file");
    t(
        here,
        &["train", "curves.h5", "--group", "wall", "-o", "x"],
        "there is no group \"wall\": it has lead-car-wall",
    );
    t(
        here,
        &["predict", "curves.h5", "--speed", "50km/h"],
        "curves.h5: line 1, column 1: this is not a model file",
    );
    t(here, &["export", "m.model", "--to", "json", "--speed", "500km/h"], "use --extrapolate");
    let error = crumple_fails(here, 2, &["export", "curves.h5", "--to", "onnx"]);
    assert!(error.contains("onnx takes a model: crumple train"), "{error}");
    t(
        here,
        &["export", "m.model", "--to", "onnx"],
        "onnx takes models of --model forest or extra, this is of --model nearest",
    );
    t(
        here,
        &["predict", "m.model", "--speed", "50km/h", "-o", "m.onnx"],
        "onnx takes a model: crumple export MODEL --to onnx",
    );
    t(here, &["inspect", "curves.h5"], "this is an HDF5 file: the readers take nodout, rcforc");
    t(here, &["inspect", "text.h5"], "no solver output is recognised in it");
    t(
        here,
        &["compare", "curves.h5", "--group", "lead-car-wall", "--speed", "50km/h"],
        "has no case at 50 km/h: it has 12 km/h, 18 km/h",
    );
    t(
        here,
        &["db", "show", "curves.h5", "--group", "lead-car-wall", "--case", "x"],
        "has no case \"x\": it has 12kmh, 18kmh",
    );
    fs::write(
        here.join("m2.model"),
        fs::read_to_string(here.join("m.model")).unwrap().replace("\"version\":4", "\"version\":9"),
    )
    .unwrap();
    t(
        here,
        &["predict", "m2.model", "--speed", "50km/h"],
        "the model file has version 9, this program reads version 4",
    );
}

#[test]
fn command_lines() {
    fn t(arguments: &[&str], expected: &str) {
        let error = crumple_fails(Path::new("."), 2, arguments);
        assert!(error.contains(expected), "{arguments:?} said:\n{error}");
    }
    t(
        &["predict", "m", "--speed", "36"],
        "speed \"36\" has no unit: write for example \"36km/h\" or \"36m/s\"",
    );
    t(&["predict", "m", "--speed", "-3m/s"], "it must be above zero");
    t(&["predict", "m", "--speed", "36km/h", "--mass", "24"], "mass \"24\" has no unit");
    t(
        &["predict", "m", "--speed", "36km/h", "-o", "a.xyz"],
        "use one of .json, .csv, .k, .key, .dyn, .rad, .inp, .cmd, .adm, .spr",
    );
    t(
        &["export", "m", "--to", "xyz"],
        "there is no export format \"xyz\": use one of json, csv, lsdyna, radioss, calculix, adams",
    );
    t(&["export", "m"], "name the format with --to (json, csv, lsdyna, radioss, ");
    t(&["histories", "f", "--id", "x"], "\"x\" is not an id: write for example 900001 or 3:surfa");
    t(&["histories", "f", "-o", "a.parquet"], "histories are written as .csv, .h5 or .hdf5");
    t(&["train", "d", "--group", "g", "-o", "m", "--paper", "--trees", "3"], "cannot be used with");
    t(&["frobnicate"], "unrecognized subcommand");
}

#[test]
fn scenarios() {
    fn t(change: impl Fn(String) -> String, expected: &str) {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("c.csv"), "d_m,force_N\n0,0\n1,2e6\n").unwrap();
        let text = "[run]\nduration = \"100ms\"\n[curves]\nc = { file = \"c.csv\" }\n\
            [[train]]\nname = \"A\"\nspeed = \"10m/s\"\nvehicles = [ { name = \"A1\", mass = \"24t\" } ]\n\
            [wall]\n[contact]\ncurve = \"c\"\n";
        fs::write(folder.path().join("s.toml"), change(text.into())).unwrap();
        let error = crumple_fails(folder.path(), 1, &["simulate", "s.toml", "-o", "out.csv"]);
        assert!(error.contains(expected), "expected {expected}, found:\n{error}");
        assert!(!folder.path().join("out.csv").exists());
    }
    t(|s| s.replace("10m/s", "10"), "s.toml:7:9: speed \"10\" has no unit");
    t(
        |s| s.replace("curve = \"c\"", "curve = \"d\""),
        "there is no curve \"d\" in [curves]: it has c",
    );
    t(|s| s.replace("[wall]\n", ""), "expected two [[train]], or one and a [wall]");
    t(|s| s.replace("file = \"c.csv\"", "model = \"no.model\""), "no.model: No such file");
    t(
        |s| s.replace("file = \"c.csv\"", ""),
        "needs exactly one of model, file, database and stages",
    );
    t(|s| s.replace("10m/s", "0m/s"), "never meets what is in front of it");
    t(|s| s.replace("100ms", "1000000000s"), "shorten the duration");
    t(|s| s.replace("c.csv\"", "c.csv\", lawn = 3"), "unknown field `lawn`");
}

#[test]
fn curve_files() {
    fn t(csv: &str, expected: &str) {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("c.csv"), csv).unwrap();
        let text = "[run]\nduration = \"100ms\"\n[curves]\nc = { file = \"c.csv\" }\n\
            [[train]]\nname = \"A\"\nspeed = \"10m/s\"\nvehicles = [ { name = \"A1\", mass = \"24t\" } ]\n\
            [wall]\n[contact]\ncurve = \"c\"\n";
        fs::write(folder.path().join("s.toml"), text).unwrap();
        let error = crumple_fails(folder.path(), 1, &["simulate", "s.toml"]);
        assert!(error.contains(expected), "expected {expected}, found:\n{error}");
    }
    t("d_m;force_N\n0;0\n1;x\n", "c.csv: line 3, field 2: expected a number, found \"x\"");
    t("d_m,force_N\n0,0\n1,x\n", "c.csv: line 3, field 2: expected a number, found \"x\"");
    t(
        "d,force_N\n0,0\n1,1\n",
        "line 1: expected a column deflection with its unit, such as d_m or d_mm, found \"d\"",
    );
    t(
        "d_m,force_N\n0,0\n1,1\n1,2\n",
        "the deflection must increase, found 1 m after 1 m at point 3",
    );
    t("d_m,force_N\n0.1,0\n1,1\n", "the deflection must begin at 0, found 0.1 m");
    t("d_m,force_N\n0,0\n1,-5\n", "the force of point 2 is below 0");
    t("d_m,force_N\n0,5\n1,5\n", "never rises, so its unloading stiffness must be given");
}

/// A band that does not fit its curve is an error, not a panic.
#[test]
fn a_damaged_predicted_curve() {
    let folder = demo_folder();
    let curve = fs::read_to_string(folder.path().join("lead50.json")).unwrap();
    let mut curve: serde_json::Value = serde_json::from_str(&curve).unwrap();
    curve["force_low_N"] = serde_json::json!([1.0, 2.0]);
    curve["force_high_N"] = serde_json::json!([1.0, 2.0]);
    fs::write(folder.path().join("band.json"), curve.to_string()).unwrap();
    let error = crumple_fails(folder.path(), 1, &["export", "band.json", "--to", "csv"]);
    assert!(error.contains("force_low_N has 2 values, force_N 401"), "{error}");
}

#[test]
fn outputs_do_not_destroy_inputs() {
    let folder = demo_folder();
    let here = folder.path();
    for line in [
        "train curves.h5 --group lead-car-wall -o ./curves.h5",
        "histories fe/lead-car-wall/36kmh/rwforc -o fe/lead-car-wall/36kmh/rwforc",
        "export lead50.json --to csv -o lead50.json",
        "export lead.model --to onnx -o lead.model",
        "simulate scenario.toml -o scenario.toml",
        "sweep scenario.toml -o scenario.toml",
    ] {
        let arguments: Vec<&str> = line.split(' ').collect();
        let error = crumple_fails(here, 2, &arguments);
        assert!(error.contains("names the input itself"), "{line}: {error}");
    }
    // Several outputs: none is written if one cannot be.
    let line =
        ["predict", "lead.model", "--speed", "50km/h", "-o", "new.json", "-o", "/no/such/a.csv"];
    crumple_fails(here, 1, &line);
    assert!(!here.join("new.json").exists());
}

#[cfg(target_os = "linux")]
#[test]
fn full_disk_and_unwritable_targets() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    build_fixture(here, "lead-car-wall");
    let nodout = fixture("fe/lead-car-wall/25kmh/nodout");
    let nodout = nodout.to_str().unwrap();
    let study = fixture("fe/lead-car-wall/study.toml");
    let study = study.to_str().unwrap();
    let full = "cannot write /dev/full: No space left on device";
    for (arguments, expected) in [
        (vec!["histories", nodout, "-o", "/dev/full"], full),
        (vec!["build", study, "-o", "/dev/full"], full),
        (vec!["train", "curves.h5", "--group", "lead-car-wall", "-o", "/dev/full"], full),
        (vec!["build", study, "-o", "/no/such/c.h5"], "cannot write /no/such/c.h5"),
        (vec!["histories", nodout, "-o", "/no/such/a.csv"], "cannot write /no/such/a.csv"),
        (vec!["build", study, "-o", "."], "cannot write ."),
    ] {
        let error = crumple_fails(here, 1, &arguments);
        assert!(error.contains(expected), "{arguments:?} said:\n{error}");
    }
    assert_eq!(entries(here), ["curves.h5"]);
}

/// The old database survives a target that cannot be replaced.
#[test]
fn a_second_writer_is_known_and_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = build_fixture(folder.path(), "lead-car-wall");
    let before = fs::read(&path).unwrap();
    let lock = crumple::file::WriterLock::take(&path).unwrap();
    let study = fixture("fe/lead-car-pair/study.toml");
    let error =
        crumple_fails(folder.path(), 1, &["build", study.to_str().unwrap(), "-o", "curves.h5"]);
    assert!(error.contains("is being written by another process: try again"), "{error}");
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
        let error = crumple_fails(folder.path(), 1, &["db", "ls", name]);
        assert!(error.contains("is not a curve database"), "{error}");
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
                format!("this is not a {format}: it looks like a nodout, read it as that");
            assert!(error.contains(&expected), "{error}");
        }
    }
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("notes"), "a\nb\nc\n").unwrap();
    let error = crumple_fails(folder.path(), 1, &["histories", "notes", "--format", "nodout"]);
    assert!(error.contains("no solver output is recognised in it"), "{error}");
    // A file that ends after its header tells no format: it is the one that was named.
    let header = " title\n                    ls-dyna smp d R14 R14.0 date 12/12/2022\n";
    fs::write(folder.path().join("out"), header).unwrap();
    crumple_ok(folder.path(), &["inspect", "--strict", "out", "--format", "nodout"]);
}

/// Compressed files, other encodings, folders and damaged binary files are called by name.
#[test]
fn files_that_are_not_plain_say_what_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let t = |name: &str, bytes: &[u8], expected: &str| {
        fs::write(folder.path().join(name), bytes).unwrap();
        for command in ["inspect", "histories"] {
            let error = crumple_fails(folder.path(), 1, &[command, name]);
            assert!(error.contains(expected), "{command} {name} said:\n{error}");
        }
    };
    t(
        "nodout",
        b"\x1f\x8b\x08\0\0\0\0\0",
        "nodout: this is compressed by gzip, which gunzip undoes",
    );
    let text = fs::read_to_string(fixture("fe/lead-car-wall/25kmh/rwforc")).unwrap();
    let utf_16 =
        |order: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(order).collect::<Vec<u8>>();
    for order in [u16::to_le_bytes, u16::to_be_bytes] {
        let bytes = utf_16(order);
        t(
            "rwforc",
            &bytes,
            "rwforc: this is UTF-16 text, which iconv -f UTF-16 -t UTF-8 makes plain",
        );
        let marked = [&order(0xfeff)[..], &bytes].concat();
        t("rwforc", &marked, "rwforc: this is UTF-16 text");
    }
    t(
        "runT01",
        &[0xee; 400],
        "it is named like a T01, but does not begin like one: is it damaged?",
    );
    let error = crumple_fails(folder.path(), 1, &["histories", "."]);
    assert!(
        error.contains("this is a folder: name a file in it, such as nodout or runT01 or rwforc"),
        "{error}"
    );
    // A header that is cut is not text file with another section.
    let cut = [&84u32.to_be_bytes()[..], &4021u32.to_be_bytes(), &[b' '; 40]].concat();
    fs::write(folder.path().join("cutT01"), cut).unwrap();
    let output = crumple_in(folder.path(), &["histories", "cutT01", "--section", "nodout"]);
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(error.contains("the header is damaged or cut"), "{error}");
    assert!(!error.contains("text file"), "{error}");
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
    let text = crumple_ok(folder.path(), &["inspect", "nodout", "--json"]);
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
        assert!(
            error.contains(
                "curves.h5 is an HDF5 file without histories, such as a curve database: name another file, or replace it with --force"
            ),
            "{error}"
        );
    }
    assert_eq!(fs::read(&database).unwrap(), before);
    crumple_ok(folder.path(), &[&arguments[..], &["--force"]].concat());
    assert_ne!(fs::read(&database).unwrap(), before);
    // A file of histories is replaced, as any other output.
    crumple_ok(folder.path(), &arguments);
}
