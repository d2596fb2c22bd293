//! Files and databases: what is not a file is refused, sizes are bounded, what is half-written or
//! altered is found, and what others have put into a database stays.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use crate::common::{
    build_fixture, crumple_fails, crumple_in, crumple_ok, crumple_started, demo_folder, edited,
    entries, fixture, json, python, read_json, says, study_in,
};
use hdf5_pure::{AttrValue, File as Hdf5};
use serde_json::Value;

const WALL: &str = "lead-car-wall";

/// Runs the program, which must end within a minute, and in less than 1 GiB.
#[cfg(target_os = "linux")]
fn soon(folder: &Path, arguments: &[&str]) -> Output {
    let mut child = Command::new("sh")
        .args(["-c", "ulimit -v 1048576; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_crumple")])
        .args(arguments)
        .env("RAYON_NUM_THREADS", "2")
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if begun.elapsed() > Duration::from_secs(60) {
            child.kill().unwrap();
            panic!("crumple {arguments:?} hangs");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.wait_with_output().unwrap()
}

#[cfg(target_os = "linux")]
fn soon_fails(folder: &Path, arguments: &[&str], expected: &str) {
    let output = soon(folder, arguments);
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "crumple {arguments:?} said:\n{error}");
    assert!(error.contains(expected), "{arguments:?} said:\n{error}");
}

/// Every command with a path that it reads, `FILE` for the path.
const READING: [&str; 14] = [
    "db ls FILE",
    "db check FILE",
    "train FILE -o x.model",
    "validate FILE",
    "compare FILE",
    "build FILE -o x.h5",
    "simulate FILE",
    "sweep FILE -o x.csv",
    "sweep s.toml --plan FILE -o x.csv",
    "sweep merge FILE -o x.csv",
    "predict FILE --speed 40km/h",
    "export FILE --to csv",
    "export FILE --to onnx",
    "rate FILE FILE --column f",
];

const SCENARIO: &str = "[run]\nduration = \"60ms\"\noutput_interval = \"1ms\"\n\
    [[train]]\nname = \"A\"\nspeed = \"36km/h\"\nvehicles = [ { name = \"A1\", mass = \"24t\" } ]\n\
    [wall]\n[contact]\ncurve = \"nose\"\n[curves]\nnose = ";

#[cfg(target_os = "linux")]
#[test]
fn devices_pipes_and_folders_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    fs::write(here.join("nose.csv"), "d_m,force_N\n0,0\n1,1e6\n").unwrap();
    let nose = format!("{SCENARIO}{{ file = \"nose.csv\", unloading = \"80MN/m\" }}\n");
    fs::write(here.join("s.toml"), nose).unwrap();
    assert!(Command::new("mkfifo").arg(here.join("pipe")).status().unwrap().success());
    fs::create_dir(here.join("inner")).unwrap();
    let kinds = [
        ("pipe", "pipe: this is a pipe: write its content to a file"),
        ("inner", "inner: this is a folder: give a file"),
        ("/dev/zero", "/dev/zero: this is a device or a socket: give a file"),
    ];
    for (path, expected) in kinds {
        for command in READING {
            // A solver file may come through a pipe, and is asked first.
            if command.starts_with("rate") && path == "pipe" {
                continue;
            }
            let says_more = ["rate", "build"].iter().any(|with| command.starts_with(with));
            let expected =
                if says_more && path == "inner" { "inner: this is a folder" } else { expected };
            let words: Vec<&str> =
                command.split(' ').map(|w| if w == "FILE" { path } else { w }).collect();
            soon_fails(here, &words, expected);
        }
        // As the source of a curve, of every kind.
        for source in [
            format!("{{ model = \"{path}\" }}"),
            format!("{{ file = \"{path}\", unloading = \"80MN/m\" }}"),
            format!("{{ database = \"{path}\", case = \"a/b\" }}"),
        ] {
            fs::write(here.join("t.toml"), format!("{SCENARIO}{source}\n")).unwrap();
            soon_fails(here, &["simulate", "t.toml"], expected);
        }
    }
    // A predicted curve is recognised by its ending.
    fs::rename(here.join("pipe"), here.join("pipe.json")).unwrap();
    fs::write(here.join("t.toml"), format!("{SCENARIO}{{ file = \"pipe.json\" }}\n")).unwrap();
    soon_fails(here, &["simulate", "t.toml"], "pipe.json: this is a pipe");
}

/// The files that a study's run has beside its histories.
#[cfg(target_os = "linux")]
#[test]
fn pipes_in_a_runs_folder_do_not_hold_up_a_build() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let source = fixture("fe/lead-car-wall");
    let text = fs::read_to_string(source.join("study.toml")).unwrap();
    let one: Vec<&str> = text.splitn(3, "[[run]]").collect();
    fs::write(here.join("study.toml"), format!("{}[[run]]{}", one[0], one[1])).unwrap();
    let run = one[1].split("path  = \"").nth(1).unwrap().split('"').next().unwrap();
    fs::create_dir(here.join(run)).unwrap();
    for name in ["nodout", "rwforc"] {
        fs::copy(source.join(run).join(name), here.join(run).join(name)).unwrap();
    }
    for name in ["case.json", "binout0000", "main.k"] {
        let path = here.join(run).join(name);
        assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
    }
    let output = soon(here, &["build", "study.toml", "-o", "c.h5"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[cfg(target_os = "linux")]
#[test]
fn sizes_are_bounded() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    // Files with holes take no space.
    let sparse = |name: &str, bytes: u64| {
        fs::File::create(here.join(name)).unwrap().set_len(bytes).unwrap();
    };
    sparse("s.toml", (16 << 20) + 1);
    sparse("c.json", (64 << 20) + 1);
    sparse("c.csv", (64 << 20) + 1);
    sparse("m.model", (1 << 30) + 1);
    sparse("r.csv", (256 << 20) + 1);
    let most = |bytes: u64| format!("bytes, expected at most {bytes} ({} MiB)", bytes >> 20);
    soon_fails(here, &["simulate", "s.toml"], &most(16 << 20));
    soon_fails(here, &["build", "s.toml", "-o", "x.h5"], &most(16 << 20));
    soon_fails(here, &["export", "c.json", "--to", "csv"], &most(64 << 20));
    soon_fails(here, &["predict", "m.model", "--speed", "40km/h"], &most(1 << 30));
    soon_fails(here, &["rate", "r.csv", "r.csv"], &most(256 << 20));
    let curve = format!("{SCENARIO}{{ file = \"c.csv\", unloading = \"80MN/m\" }}\n");
    fs::write(here.join("t.toml"), curve).unwrap();
    soon_fails(here, &["simulate", "t.toml"], &most(64 << 20));
    // Within its bound, but more than there is memory for.
    sparse("m.model", 1 << 30);
    let there_is_none = format!("m.model: not enough memory to read {} bytes", 1u64 << 30);
    soon_fails(here, &["predict", "m.model", "--speed", "40km/h"], &there_is_none);
    assert_eq!(entries(here), ["c.csv", "c.json", "m.model", "r.csv", "s.toml", "t.toml"]);
}

/// 10⁹ values that nobody has written take a few kilobytes of file and 8 GB of memory.
#[cfg(target_os = "linux")]
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn a_dataset_of_h5py_declares_no_more_than_its_file_holds() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    build_fixture(here, WALL);
    let script = "import h5py\n\
        f = h5py.File('curves.h5', 'a')\n\
        case = f['lead-car-wall/36kmh']\n\
        del case['force_N']\n\
        case.create_dataset('force_N', shape=(10**9,), chunks=(10**5,), dtype='f8')\n";
    assert!(python().args(["-c", script]).current_dir(here).status().unwrap().success());
    for line in [vec!["db", "ls", "curves.h5"], vec!["train", "curves.h5", "-o", "x.model"]] {
        soon_fails(
            here,
            &line,
            "curves.h5: lead-car-wall/36kmh: force_N: it declares 1000000000 values",
        );
    }
    let output = soon(here, &["db", "check", "curves.h5", "--strict"]);
    assert_eq!(output.status.code(), Some(3));
    let text = String::from_utf8(output.stdout).unwrap();
    says(&text, "lead-car-wall/36kmh: force_N: it declares 1000000000 values");
}

/// The findings of `db check`, which must be some.
fn findings(folder: &Path) -> Vec<Value> {
    let output = crumple_in(folder, "db check curves.h5 --json --strict");
    assert_eq!(output.status.code(), Some(3), "{}", String::from_utf8_lossy(&output.stderr));
    let document = json(&String::from_utf8(output.stdout).unwrap());
    document["findings"].as_array().unwrap().clone()
}

#[test]
fn db_check_finds_nothing_in_what_was_just_built() {
    for group in [WALL, "lead-car-pair", "vehicle-pair"] {
        let folder = tempfile::tempdir().unwrap();
        build_fixture(folder.path(), group);
        let document = json(&crumple_ok(folder.path(), "db check curves.h5 --json"));
        for finding in document["findings"].as_array().unwrap() {
            let code = finding["code"].as_str().unwrap();
            assert!(["extraction", "energy_mismatch"].contains(&code), "{finding}");
        }
    }
}

/// Whether `db check` finds nothing.
fn is_sound(here: &Path) -> bool {
    crumple_in(here, "db check curves.h5 --strict").status.success()
}

/// The stopped mass that the file at `path` has for lead-car-wall: its deflections, masses, rates and residual.
fn stopped_mass(path: &Path) -> Option<[Vec<f64>; 4]> {
    let attributes = Hdf5::open(path).unwrap().root().group(WALL).unwrap().attrs().unwrap();
    let of = |name: &str| match attributes.get(&format!("stopped_mass_{name}"))? {
        AttrValue::F64Array(values) => Some(values.clone()),
        other => Some(vec![other.as_f64()?]),
    };
    Some([of("deflection_m")?, of("kg")?, of("rate_kg_per_m")?, of("residual_kg")?])
}

/// A study can be built in parts, which joined are the bytes of the whole.
#[test]
fn runs_are_built_one_by_one() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let study = fixture("fe/lead-car-pair/study.toml").display().to_string();
    let build = |output: &str, runs: &[&str]| {
        let runs: Vec<&str> = runs.iter().flat_map(|run| ["--run", run]).collect();
        let arguments = [&["build", &study, "-o", output], &runs[..]].concat();
        let output = crumple_in(here, &arguments);
        (output.status.code().unwrap(), String::from_utf8(output.stderr).unwrap())
    };
    assert_eq!(build("whole.h5", &[]).0, 0);
    assert_eq!(build("a.h5", &["48kmh"]).0, 0);
    assert_eq!(build("b.h5", &["72kmh", "36kmh", "60kmh"]).0, 0);
    crumple_ok(here, "db merge a.h5 b.h5 -o joined.h5");
    assert!(fs::read(here.join("joined.h5")).unwrap() == fs::read(here.join("whole.h5")).unwrap());
    // One after the other into one file, too.
    for run in ["60kmh", "36kmh", "72kmh", "48kmh"] {
        assert_eq!(build("grown.h5", &[run]).0, 0);
    }
    assert!(fs::read(here.join("grown.h5")).unwrap() == fs::read(here.join("whole.h5")).unwrap());
    let (code, error) = build("whole.h5", &["48kmh", "48km"]);
    assert_eq!(code, 1);
    says(
        &error,
        "there is no run \"48km\": it has 36kmh, 48kmh, 60kmh, 72kmh; did you mean \"48kmh\"?",
    );
}

/// A group's stopped mass is in its file, that of the model trained on it; it changes with the cases,
/// whether the file is written again or edited, and goes with those that determine it.
#[test]
fn the_stopped_mass_stands_in_the_database() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let path = build_fixture(here, WALL);
    build_fixture(here, "lead-car-pair");
    let built = stopped_mass(&path).unwrap();
    let [d, m, rate, residual] = &built;
    crumple_ok(here, &["train", "curves.h5", "--group", WALL, "--model", "rate", "-o", "a.model"]);
    let model = read_json(&here.join("a.model"));
    let of_model = |key: &str| -> Vec<f64> {
        serde_json::from_value(model["crush_law"][key].clone()).unwrap()
    };
    assert_eq!((d, m), (&of_model("deflection_m"), &of_model("stopped_kg")));
    assert_eq!(model["crush_law"]["residual_kg"], residual[0]);
    for i in 0..d.len() - 1 {
        assert!((m[i + 1] - m[i] - rate[i] * (d[i + 1] - d[i])).abs() < 1e-9 * m[m.len() - 1]);
    }
    let pair = Hdf5::open(&path).unwrap().root().group("lead-car-pair").unwrap().attrs().unwrap();
    let has_stopped_mass = pair.keys().any(|name| name.starts_with("stopped_mass"));
    assert!(!has_stopped_mass, "its noses bend into each other: {pair:?}");
    let listed = crumple_ok(here, "db ls curves.h5");
    let said =
        format!("crush law: {:.0} kg of the crush zone come to rest within ", m[m.len() - 1]);
    assert_eq!(listed.matches(&said).count(), 1, "{listed}");
    // Written again, then edited because something of others is in it.
    crumple_ok(here, &["db", "rm", "curves.h5", "--group", WALL, "--case", "72kmh"]);
    let without = stopped_mass(&path).unwrap();
    assert!(without != built && is_sound(here));
    // So many attributes are stored in another way than few.
    edited(&path, |file| {
        let group = file.root().group(WALL).unwrap();
        (0..8).for_each(|k| group.set_attr(&format!("theirs {k}"), AttrValue::F64(1.0)).unwrap());
    });
    crumple_ok(
        here,
        &["build", fixture("fe/lead-car-wall/study.toml").to_str().unwrap(), "-o", "curves.h5"],
    );
    assert!(stopped_mass(&path).unwrap() == built && is_sound(here));
    for to in ["other", WALL] {
        let from = if to == WALL { "other" } else { WALL };
        crumple_ok(here, &["db", "rename", "curves.h5", "--group", from, "--to", to]);
        assert!(is_sound(here), "{to}");
    }
    crumple_ok(here, &["db", "tag", "curves.h5", "--group", WALL, "--add", "seen"]);
    let group = Hdf5::open(&path).unwrap().root().group(WALL).unwrap().attrs().unwrap();
    assert_eq!((group.len(), stopped_mass(&path).unwrap() == built), (15, true), "{group:?}");
    for case in ["18kmh", "25kmh", "36kmh", "48kmh", "60kmh", "72kmh"] {
        crumple_ok(here, &["db", "rm", "curves.h5", "--group", WALL, "--case", case]);
    }
    assert_eq!(stopped_mass(&path), None, "one run tells none");
    assert!(is_sound(here));
}

/// A stopped mass that is not that of the cases is found, and made good by the next change.
#[test]
fn db_check_finds_a_stopped_mass_of_other_cases() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let path = build_fixture(here, WALL);
    let (built, bytes) = (stopped_mass(&path).unwrap(), fs::read(&path).unwrap());
    for (name, value) in [
        ("stopped_mass_kg", AttrValue::F64Array(vec![0.0, 1.0])),
        ("stopped_mass_kg", AttrValue::F64Array(built[1].iter().map(|m| 1.1 * m).collect())),
        ("stopped_mass_residual_kg", AttrValue::VarLenString("none".into())),
    ] {
        fs::write(&path, &bytes).unwrap();
        edited(&path, |file| file.root().group(WALL).unwrap().set_attr(name, value).unwrap());
        let found = findings(here);
        let message = found[0]["message"].as_str().unwrap();
        assert_eq!((found.len(), &found[0]["code"]), (1, &"stopped_mass_differs".into()));
        assert!(message.starts_with(&format!("the group's {name} is not that of its cases")));
        crumple_ok(here, &["db", "tag", "curves.h5", "--group", WALL, "--add", "seen"]);
        assert!(is_sound(here) && stopped_mass(&path).unwrap() == built);
    }
}

#[test]
fn db_check_names_the_value_that_was_changed() {
    let folder = tempfile::tempdir().unwrap();
    let path = build_fixture(folder.path(), WALL);
    let built = fs::read(&path).unwrap();
    let case = "lead-car-wall/36kmh";
    let datasets = "time_s deflection_m force_N closing_speed_m_per_s body_force_N original/time_s original/deflection_m original/force_N";
    for dataset in datasets.split(' ') {
        for (index, value) in [(0, 1e300), (37, 1e300), (37, f64::NAN), (120, -3.5)] {
            fs::write(&path, &built).unwrap();
            edited(&path, |file| {
                let mut found = file.dataset(&format!("{case}/{dataset}")).unwrap();
                let mut values = found.read_f64().unwrap();
                values[index] = value;
                found.write(&values).unwrap();
            });
            let found = findings(folder.path());
            let named = found
                .iter()
                .any(|f| f["case"] == "36kmh" && f["dataset"] == dataset && f["index"] == index);
            // A force of −3.5 N is like its neighbours where the force is small: the dataset is
            // named all the same, by its hash.
            let altered = found.iter().any(|f| f["dataset"] == dataset && f["code"] == "altered");
            assert!(altered && (named || value == -3.5), "{dataset}[{index}] = {value}: {found:?}");
            assert!(
                found.iter().all(|f| f["case"] == "36kmh" || f["code"] == "extraction"),
                "{found:?}"
            );
        }
    }
}

#[test]
fn db_check_holds_attributes_against_the_curves() {
    let folder = tempfile::tempdir().unwrap();
    let path = build_fixture(folder.path(), WALL);
    let built = fs::read(&path).unwrap();
    let t = |name: &str, value: AttrValue, code: &str, message: &str| {
        fs::write(&path, &built).unwrap();
        edited(&path, |file| {
            file.group("lead-car-wall/36kmh").unwrap().set_attr(name, value).unwrap();
        });
        let found = findings(folder.path());
        let named = found.iter().any(|f| {
            f["case"] == "36kmh"
                && f["code"] == code
                && f["message"].as_str().is_some_and(|m| m.starts_with(message))
        });
        assert!(named, "{name}: {found:?}");
    };
    let number = AttrValue::F64;
    #[rustfmt::skip]
    let cases = [
        ("loading_end", AttrValue::I64(3), "attribute_differs", "loading_end is 3, by the case's other values "),
        ("max_deflection_m", number(0.2), "attribute_differs", "max_deflection_m is 0.2, by the case's other values "),
        ("truncated", AttrValue::U8(1), "attribute_differs", "truncated is 1, by the case's other values 0"),
        ("work_over_energy", number(1.0), "attribute_differs", "work_over_energy is 1, "),
        ("work_J", number(1e300), "audit_differs", "the stored work "),
        ("kinetic_energy_J", number(5.0), "audit_differs", "the stored kinetic energy 5 J is not"),
        ("unloading_stiffness_N_per_m", number(7e6), "attribute_differs", "unloading_stiffness_N_per_m is 7000000 N/m"),
        ("mass_kg", number(12e3), "altered", "its attributes differ from those"),
        ("mass_kg", number(12e3), "energy_impossible", "W/E is 2.04"),
        ("speed_m_per_s", number(8.0), "energy_impossible", "W/E is 1.59"),
        ("speed_m_per_s", number(f64::NAN), "damaged", "attribute speed_m_per_s is not finite"),
        ("speed_kind", AttrValue::String("closing".into()), "speed_kinds", "has a closing speed, "),
        ("notes", AttrValue::String("[\"mine\"]".into()), "altered", "its attributes differ from those"),
    ];
    cases.into_iter().for_each(|(name, value, code, message)| t(name, value, code, message));
}

#[test]
fn db_check_finds_wrong_lengths_order_and_holes() {
    let folder = tempfile::tempdir().unwrap();
    let path = build_fixture(folder.path(), WALL);
    let built = fs::read(&path).unwrap();
    let t = |edit: &dyn Fn(&Hdf5), expected: &[(&str, &str)]| {
        fs::write(&path, &built).unwrap();
        edited(&path, |file| edit(file));
        let found = findings(folder.path());
        for (code, message) in expected {
            let named = found.iter().any(|f| {
                f["code"] == *code && f["message"].as_str().is_some_and(|m| m.contains(message))
            });
            assert!(named, "{code}, {message}: {found:?}");
        }
    };
    let replace = |file: &Hdf5, name: &str, values: &[f64]| {
        let case = file.group("lead-car-wall/36kmh").unwrap();
        case.delete(name).unwrap();
        case.create_dataset(name, |d| {
            d.with_f64_data(values);
        })
        .unwrap();
    };
    let values = |file: &Hdf5, name: &str| {
        file.dataset(&format!("lead-car-wall/36kmh/{name}")).unwrap().read_f64().unwrap()
    };
    t(
        &|file| {
            let force = values(file, "force_N");
            replace(file, "force_N", &force[..force.len() - 1]);
        },
        &[("length", "force_N has "), ("altered", "the values of force_N differ")],
    );
    t(
        &|file| replace(file, "original/force_N", &[]),
        &[("length", "original/force_N has 0 values")],
    );
    t(
        &|file| {
            let mut time = values(file, "original/time_s");
            time.swap(50, 51);
            replace(file, "original/time_s", &time);
        },
        &[("time_order", "original/time_s[51] is ")],
    );
    // States cut out of all columns, as for a run that was cleared of them: only the hole shows.
    t(
        &|file| {
            for name in ["original/time_s", "original/deflection_m", "original/force_N"] {
                let all = values(file, name);
                replace(file, name, &[&all[..60], &all[100..]].concat());
            }
        },
        &[("time_gap", "original/time_s: there is no state between time ")],
    );
    t(
        &|file| {
            let group = file.group(WALL).unwrap();
            let mut cases = group.groups().unwrap();
            cases.sort();
            cases.reverse();
            group.set_attr("cases", AttrValue::VarLenStringArray(cases)).unwrap();
        },
        &[("case_order", "the group's cases are listed as 72kmh, 60kmh")],
    );
    t(
        &|file| {
            let group = file.group(WALL).unwrap();
            let mut cases = group.groups().unwrap();
            cases.push("48kmh".into());
            group.set_attr("cases", AttrValue::VarLenStringArray(cases)).unwrap();
            let mut force = file.dataset("lead-car-wall/36kmh/force_N").unwrap();
            force.set_attr("units", AttrValue::String("kN".into())).unwrap();
        },
        &[
            ("case_list", "is listed more than once in the group's cases"),
            ("attribute_differs", "the units of force_N are \"kN\", and its values are read in N"),
        ],
    );
    t(
        &|file| file.group(WALL).unwrap().delete("48kmh").unwrap(),
        &[("case_list", "is listed in the group's cases, but is missing")],
    );
}

/// There is one layout: what is of another is not guessed at.
#[test]
fn other_layouts_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = build_fixture(folder.path(), WALL);
    edited(&path, |file| {
        let case = file.group("lead-car-wall/36kmh").unwrap();
        case.remove_attr("hashes").unwrap();
    });
    let error = crumple_fails(folder.path(), 1, "db ls curves.h5");
    let expected = "lead-car-wall/36kmh: attribute hashes is missing or not text";
    says(&error, expected);
    assert!(findings(folder.path()).iter().any(|f| f["code"] == "damaged"));
    for version in [1, 4] {
        edited(&path, |file| {
            file.root().set_attr("layout_version", AttrValue::I64(version)).unwrap();
        });
        let error = crumple_fails(folder.path(), 1, "db ls curves.h5");
        let expected = format!(
            "curves.h5: its layout has version {version}, this program reads versions 2 to 3: build the database again"
        );
        says(&error, &expected);
    }
}

/// One case is read by itself: damage of another is not a hindrance.
#[test]
fn a_case_is_shown_without_reading_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let path = build_fixture(folder.path(), WALL);
    let show = |extra: &[&str]| {
        let arguments = [&["db", "show", "curves.h5", "--json", "--case", "36kmh"], extra].concat();
        crumple_ok(folder.path(), &arguments)
    };
    let before = show(&[]);
    assert!(show(&["--group", WALL]) == before);
    edited(&path, |file| {
        file.group("lead-car-wall/48kmh").unwrap().remove_attr("recipe").unwrap();
    });
    assert!(show(&[]) == before);
    let fails = |arguments: &[&str], expected: &str| {
        let error =
            crumple_fails(folder.path(), 1, &[&["db", "show", "curves.h5"], arguments].concat());
        says(&error, expected);
    };
    fails(&["--case", "48kmh"], "48kmh: attribute recipe is missing");
    fs::remove_file(&path).unwrap();
    build_fixture(folder.path(), WALL);
    fails(&["--case", "1kmh"], "group \"lead-car-wall\" has no case \"1kmh\": it has 12kmh");
    fails(&["--group", "a/b", "--case", "36kmh"], "there is no group \"a/b\"");
    // As GROUP/CASE.
    fails(&["--case", "36kmh/original"], "there is no group \"36kmh\"");
    let both = ["db", "show", "curves.h5", "--json", "--case", "lead-car-wall/36kmh"];
    assert!(crumple_ok(folder.path(), &both) == before);
}

/// Damage is not made good by writing it again; the study's own runs are read again.
#[test]
fn an_altered_case_stays_altered_until_it_is_built_anew() {
    let folder = tempfile::tempdir().unwrap();
    let path = build_fixture(folder.path(), WALL);
    let built = crumple::database::Database::read(&path).unwrap();
    edited(&path, |file| {
        let mut force = file.dataset("lead-car-wall/36kmh/force_N").unwrap();
        let mut values = force.read_f64().unwrap();
        values[40] *= 1.5;
        force.write(&values).unwrap();
    });
    let pair = fixture("fe/lead-car-pair/study.toml");
    crumple_ok(folder.path(), &["build", pair.to_str().unwrap(), "-o", "curves.h5"]);
    assert!(findings(folder.path()).iter().any(|f| f["code"] == "altered" && f["index"] == 40));
    let wall = fixture("fe/lead-car-wall/study.toml");
    let report = json(&crumple_ok(
        folder.path(),
        &["build", wall.to_str().unwrap(), "-o", "curves.h5", "--json"],
    ));
    for run in report["runs"].as_array().unwrap() {
        let expected = if run["name"] == "36kmh" { "built" } else { "unchanged" };
        assert_eq!(run["outcome"], expected, "{run}");
    }
    let now = crumple::database::Database::read(&path).unwrap();
    assert!(now.cases(WALL) == built.cases(WALL));
}

#[test]
fn build_keeps_what_others_put_into_the_database() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let study = study_in(here, WALL);
    let path = here.join("curves.h5");
    let build = |study: &Path| {
        json(&crumple_ok(here, &["build", study.to_str().unwrap(), "-o", "curves.h5", "--json"]))
    };
    build(&study);
    edited(&path, |file| {
        let root = file.root();
        root.set_attr("project", AttrValue::String("nose 3".into())).unwrap();
        root.create_group_with("tests", |group| {
            group.set_attr("laboratory", AttrValue::String("B".into()));
            group.create_group_with("run 1", |run| {
                run.create_dataset("acceleration", |d| {
                    d.with_f64_data(&[1.0, 2.0, 3.0]);
                });
            });
        })
        .unwrap();
        root.create_dataset("lead-car-wall/measured", |d| {
            d.with_i32_data(&[7, 8]);
        })
        .unwrap();
        let case = file.group("lead-car-wall/36kmh").unwrap();
        case.set_attr("reviewed_by", AttrValue::String("Ada".into())).unwrap();
        case.create_dataset("photo", |d| {
            d.with_f64_data(&[0.5]);
        })
        .unwrap();
        file.dataset("lead-car-wall/36kmh/force_N")
            .unwrap()
            .set_attr("sensor", AttrValue::String("N".into()))
            .unwrap();
    });
    let all_there = || {
        let file = Hdf5::open(&path).unwrap();
        let text = |attrs: std::collections::HashMap<String, AttrValue>, name: &str| {
            attrs[name].as_str().unwrap().to_string()
        };
        assert_eq!(text(file.root().attrs().unwrap(), "project"), "nose 3");
        assert_eq!(text(file.group("tests").unwrap().attrs().unwrap(), "laboratory"), "B");
        let read = |name: &str| file.dataset(name).unwrap().read_f64().unwrap();
        assert_eq!(read("tests/run 1/acceleration"), [1.0, 2.0, 3.0]);
        assert_eq!(read("lead-car-wall/measured"), [7.0, 8.0]);
        assert_eq!(read("lead-car-wall/36kmh/photo"), [0.5]);
        let case = file.group("lead-car-wall/36kmh").unwrap();
        assert_eq!(text(case.attrs().unwrap(), "reviewed_by"), "Ada");
        let force = file.dataset("lead-car-wall/36kmh/force_N").unwrap();
        assert_eq!(text(force.attrs().unwrap(), "sensor"), "N");
    };
    all_there();
    // Nothing changed, another group, another mass, another number of states.
    build(&study);
    all_there();
    build(&study_in(here, "lead-car-pair"));
    all_there();
    for (from, to) in [("\"24t\"", "\"24.5t\""), ("states = 400", "states = 300")] {
        let text = fs::read_to_string(&study).unwrap();
        assert!(text.contains(from));
        fs::write(&study, text.replace(from, to)).unwrap();
        let report = build(&study);
        assert!(report["runs"].as_array().unwrap().iter().all(|r| r["outcome"] == "built"));
        all_there();
        // The cases are those that a new database has.
        let expected = here.join("new.h5");
        let _ = fs::remove_file(&expected);
        crumple_ok(here, &["build", study.to_str().unwrap(), "-o", "new.h5"]);
        let read = |path: &Path| crumple::database::Database::read(path).unwrap();
        assert!(read(&path).cases(WALL) == read(&expected).cases(WALL));
    }
    let found = crumple_ok(here, "db check curves.h5 --json");
    assert!(!found.contains("altered") && !found.contains("differs"), "{found}");
    // A case that leaves the study would take the notes on it along.
    let text = fs::read_to_string(&study).unwrap();
    let runs: Vec<&str> = text.split("[[run]]").collect();
    let without: Vec<&str> =
        runs.iter().copied().filter(|run| !run.contains("\"36kmh\"")).collect();
    assert_eq!(without.len(), runs.len() - 1);
    fs::write(&study, without.join("[[run]]")).unwrap();
    let before = fs::read(&path).unwrap();
    let error = crumple_fails(here, 1, &["build", study.to_str().unwrap(), "-o", "curves.h5"]);
    says(
        &error,
        "curves.h5 holds objects that crumple did not write and would lose by rewriting the file: attribute lead-car-wall/36kmh/force_N/sensor, attribute lead-car-wall/36kmh/reviewed_by, dataset lead-car-wall/36kmh/photo",
    );
    assert!(fs::read(&path).unwrap() == before);
    // Taken out, it goes.
    edited(&path, |file| file.root().delete("lead-car-wall/36kmh").unwrap());
    build(&study);
    let file = Hdf5::open(&path).unwrap();
    assert!(file.group("lead-car-wall/36kmh").is_err());
    assert_eq!(file.dataset("tests/run 1/acceleration").unwrap().read_f64().unwrap().len(), 3);
}

/// h5py's links, types and compressed datasets, and attributes of every kind.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn build_keeps_what_h5py_put_into_the_database() {
    let folder = tempfile::tempdir().unwrap();
    build_fixture(folder.path(), WALL);
    let put = "import h5py, numpy as np\n\
        f = h5py.File('curves.h5', 'a')\n\
        f.attrs['matrix'] = np.arange(6).reshape(2, 3)\n\
        f.attrs['flag'] = True\n\
        case = f['lead-car-wall/36kmh']\n\
        case.attrs['when'] = np.array([1, 2], dtype='>i2')\n\
        f.create_dataset('mine/raw', data=np.arange(1000.0), compression='gzip', chunks=(100,))\n\
        f['mine/pairs'] = np.array([(1, 2.5)], dtype=[('a', 'i4'), ('b', 'f8')])\n\
        f['mine/names'] = ['a', 'bcd']\n\
        f['kind'] = np.dtype('f4')\n\
        f['alias'] = h5py.SoftLink('/lead-car-wall/36kmh')\n\
        f['mine/elsewhere'] = h5py.ExternalLink('other.h5', '/x')\n\
        f['mine/same'] = f['mine/raw']\n";
    assert!(python().args(["-c", put]).current_dir(folder.path()).status().unwrap().success());
    let pair = fixture("fe/lead-car-pair/study.toml");
    crumple_ok(folder.path(), &["build", pair.to_str().unwrap(), "-o", "curves.h5"]);
    let look = "import h5py, numpy as np\n\
        f = h5py.File('curves.h5', 'r')\n\
        assert (f.attrs['matrix'] == np.arange(6).reshape(2, 3)).all()\n\
        assert f.attrs['flag'] == True and f.attrs['flag'].dtype == bool\n\
        assert f['lead-car-wall/36kmh'].attrs['when'].dtype == np.dtype('>i2')\n\
        assert (f['mine/raw'][:] == np.arange(1000.0)).all() and f['mine/raw'].compression == 'gzip'\n\
        assert f['mine/pairs'][0]['b'] == 2.5\n\
        assert f['mine/names'][1] == b'bcd'\n\
        assert f['kind'].dtype == np.dtype('f4')\n\
        assert f['alias']['force_N'].shape == f['lead-car-wall/36kmh/force_N'].shape\n\
        assert f['mine'].get('elsewhere', getlink=True).filename == 'other.h5'\n\
        assert f['mine/same'] == f['mine/raw']\n\
        assert '36kmh' in f['lead-car-pair'] and '72kmh' in f['lead-car-wall']\n";
    assert!(python().args(["-c", look]).current_dir(folder.path()).status().unwrap().success());
}

/// Links are seen by nothing else that they leave.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn links_of_h5py_alone_are_kept_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let path = build_fixture(here, WALL);
    let run = |text: &str| {
        let text = format!("import h5py\n{text}\n");
        assert!(python().args(["-c", &text]).current_dir(here).status().unwrap().success());
    };
    run("f = h5py.File('curves.h5', 'a')\n\
         f['lead-car-wall/reference'] = h5py.SoftLink('/lead-car-wall/36kmh')\n\
         f['lead-car-wall/36kmh/video'] = h5py.ExternalLink('video.h5', '/frames')");
    for command in [
        "note curves.h5 --case 12kmh --add checked",
        "tag curves.h5 --case 36kmh --add main",
        "rename curves.h5 --case 25kmh --to slow",
    ] {
        crumple_ok(here, &format!("db {command}"));
        run("f = h5py.File('curves.h5', 'r')\n\
             assert f['lead-car-wall'].get('reference', getlink=True).path == '/lead-car-wall/36kmh'\n\
             assert f['lead-car-wall/36kmh'].get('video', getlink=True).filename == 'video.h5'");
    }
    let copied = crumple_ok(here, "db copy curves.h5 --case 36kmh --to other.h5 --strict");
    says(
        &copied,
        "note: another program has edited curves.h5: soft and external links in it, if any, are not copied",
    );
    // With more, the group's links move into a heap, where they cannot be edited.
    run("f = h5py.File('curves.h5', 'a')\n\
         for k in range(8): f['lead-car-wall'][f'l{k}'] = h5py.SoftLink('/x')");
    let before = fs::read(&path).unwrap();
    let error = crumple_fails(here, 1, "db tag curves.h5 --case 36kmh --add other");
    says(
        &error,
        "curves.h5 holds objects that crumple did not write and would lose by rewriting the file: links",
    );
    assert!(fs::read(&path).unwrap() == before);
}

/// What a file says of itself may be meant for the terminal.
#[test]
fn text_of_files_is_printed_without_control_characters() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let path = build_fixture(here, WALL);
    let evil = "\u{1b}]0;owned\u{7}\u{9b}31m\r";
    let listed = serde_json::to_string(&[evil]).unwrap();
    edited(&path, |file| {
        let case = file.group("lead-car-wall/36kmh").unwrap();
        for name in ["notes", "warnings"] {
            case.set_attr(name, AttrValue::String(listed.clone())).unwrap();
        }
        file.copy("lead-car-wall", &format!("wall{evil}")).unwrap();
    });
    fs::write(here.join("s.toml"), format!("[run]\n\"a{evil}b\" = 1\n").replace('\r', "")).unwrap();
    fs::write(here.join("t.toml"), "[run]\n\"a\\u001b[2Jb\" = 1\n").unwrap();
    fs::write(here.join("nose.csv"), format!("d{evil},force_N\n0,0\n")).unwrap();
    let nose = format!("{SCENARIO}{{ file = \"nose.csv\", unloading = \"80MN/m\" }}\n");
    fs::write(here.join("u.toml"), nose).unwrap();
    let model = format!("{{\"format\":\"{evil}\",\"version\":1}}").replace('\r', "");
    fs::write(here.join("m.model"), model).unwrap();
    fs::write(here.join("e.model"), "{\"format\":\"\\u001b[2J\",\"version\":1}").unwrap();
    for line in [
        "db ls curves.h5",
        "db show curves.h5",
        "db ls curves.h5 --accept-changed",
        "db show curves.h5 --accept-changed",
        "db check curves.h5",
        "train curves.h5 -o x.model",
        "validate curves.h5 --group none",
        "simulate s.toml",
        "simulate t.toml",
        "simulate u.toml",
        "build t.toml -o x.h5",
        "predict m.model --speed 40km/h",
        "predict e.model --speed 40km/h",
    ] {
        let words: Vec<&str> = line.split(' ').collect();
        let output = crumple_in(here, &words);
        for text in [output.stdout, output.stderr] {
            let text = String::from_utf8(text).unwrap();
            let hidden: Vec<char> = text.chars().filter(|c| c.is_control() && *c != '\n').collect();
            assert!(hidden.is_empty(), "{line} printed {hidden:?}:\n{}", text.escape_debug());
        }
    }
    let show = ["db", "show", "curves.h5", "--group", WALL, "--case", "36kmh", "--accept-changed"];
    says(&crumple_ok(here, &show), "note: \u{fffd}]0;owned\u{fffd}\u{fffd}31m\u{fffd}\n");
}

/// Kills leave at most one file, under a name that the next run clears.
#[cfg(unix)]
#[test]
fn killed_writers_leave_nothing_that_stays() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    build_fixture(here, WALL);
    let nodout = fixture("fe/lead-car-wall/36kmh/nodout");
    let study = fixture("fe/lead-car-wall/study.toml");
    crumple_ok(here, "train curves.h5 --group lead-car-wall --model nearest -o m.model");
    let lines: Vec<Vec<&str>> = vec![
        vec!["histories", nodout.to_str().unwrap(), "-o", "out.csv"],
        vec!["histories", nodout.to_str().unwrap(), "-o", "out.h5"],
        vec!["build", study.to_str().unwrap(), "-o", "new.h5"],
        vec!["predict", "m.model", "--speed", "40km/h", "-o", "p.json", "-o", "p.csv"],
    ];
    for line in &lines {
        let begun = Instant::now();
        crumple_ok(here, line);
        let whole = begun.elapsed();
        for kill in 0..25 {
            if line[0] == "build" {
                let _ = fs::remove_file(here.join("new.h5"));
            }
            let mut child = crumple_started(here, line);
            std::thread::sleep(whole * kill / 24);
            child.kill().unwrap();
            child.wait().unwrap();
            let left = entries(here).iter().filter(|n| n.starts_with(".crumple-")).count();
            assert!(left <= 2, "{:?}", entries(here));
        }
        crumple_ok(here, line);
    }
    let expected = ["curves.h5", "m.model", "new.h5", "out.csv", "out.h5", "p.csv", "p.json"];
    assert_eq!(entries(here), expected);
}

/// Each of many writers of one file writes it whole or says that another does.
#[test]
fn writers_of_one_file_do_not_mix() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let inputs =
        ["25kmh", "36kmh", "72kmh"].map(|run| fixture(&format!("fe/lead-car-wall/{run}/nodout")));
    let whole: Vec<Vec<u8>> = inputs
        .iter()
        .map(|input| {
            crumple_ok(here, &["histories", input.to_str().unwrap(), "-o", "one.csv"]);
            fs::read(here.join("one.csv")).unwrap()
        })
        .collect();
    for _ in 0..12 {
        let spawn = |input: &PathBuf| {
            crumple_started(here, &["histories", input.to_str().unwrap(), "-o", "out.csv"])
        };
        let children: Vec<_> = inputs.iter().map(spawn).collect();
        let mut done = 0;
        for child in children {
            let output = child.wait_with_output().unwrap();
            let error = String::from_utf8(output.stderr).unwrap();
            match output.status.code() {
                Some(0) => done += 1,
                _ => assert!(
                    error.contains("cannot write out.csv: another process is writing it"),
                    "{error}"
                ),
            }
        }
        assert!(done > 0);
        assert!(whole.contains(&fs::read(here.join("out.csv")).unwrap()));
    }
    let before = fs::read(here.join("out.csv")).unwrap();
    crumple::file::write_at(&here.join("out.csv"), |_| {
        let input = inputs[0].to_str().unwrap();
        let error = crumple_fails(here, 1, &["histories", input, "-o", "out.csv"]);
        assert_eq!(
            error,
            "error: cannot write out.csv: another process is writing it: try again when it has finished; the previous content is unchanged\n"
        );
        Ok(None::<()>)
    })
    .unwrap();
    assert!(fs::read(here.join("out.csv")).unwrap() == before);
    assert_eq!(entries(here), ["one.csv", "out.csv"]);
}

/// A limit on the size of files is an error with a message, not the end of the process.
#[cfg(target_os = "linux")]
#[test]
fn a_file_beyond_the_limit_of_the_session_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    build_fixture(here, WALL);
    let nodout = fixture("fe/lead-car-wall/36kmh/nodout");
    let nodout = nodout.to_str().unwrap();
    let binout = fixture("samples/lasso-python/binout/lasso_r12_smp_s_sph_rwforc");
    let binout = binout.to_str().unwrap();
    let pair = fixture("fe/lead-car-pair/study.toml");
    fs::write(here.join("out.csv"), "old").unwrap();
    fs::write(here.join("out.h5"), "old").unwrap();
    fs::write(here.join("s.toml"), format!("{SCENARIO}{{ file = \"nose.csv\", unloading = \"80MN/m\" }}\n[sweep]\nvary = [ {{ what = \"speed\", train = \"A\", from = \"10km/h\", to = \"40km/h\", steps = 500 }} ]\n")).unwrap();
    fs::write(here.join("nose.csv"), "d_m,force_N\n0,0\n1,1e6\n").unwrap();
    let before = fs::read(here.join("curves.h5")).unwrap();
    let limited = |arguments: &[&str]| {
        Command::new("sh")
            .args(["-c", "ulimit -f 16; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_crumple")])
            .args(arguments)
            .current_dir(here)
            .output()
            .unwrap()
    };
    for (arguments, path) in [
        (vec!["histories", nodout, "-o", "out.csv"], "out.csv"),
        (vec!["histories", nodout, "-o", "out.h5"], "out.h5"),
        (vec!["histories", binout, "--section", "glstat", "-o", "out.h5"], "out.h5"),
        (vec!["build", pair.to_str().unwrap(), "-o", "curves.h5"], "curves.h5"),
    ] {
        let output = limited(&arguments);
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {error}");
        assert_eq!(
            error,
            format!(
                "error: cannot write {path}: the file would be larger than the limit of this session (ulimit -f) or the disk allows; the previous content is unchanged\n"
            )
        );
    }
    assert_eq!(fs::read(here.join("out.csv")).unwrap(), b"old");
    assert_eq!(fs::read(here.join("out.h5")).unwrap(), b"old");
    assert!(fs::read(here.join("curves.h5")).unwrap() == before);
    assert_eq!(entries(here), ["curves.h5", "nose.csv", "out.csv", "out.h5", "s.toml"]);
    // What a sweep has written stays for the next time.
    let sweep = ["sweep", "s.toml", "-q", "-o", "sweep.csv"];
    let output = limited(&sweep);
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{error}");
    says(&error, "cannot write sweep.csv: the file would be larger");
    crumple_ok(here, &sweep);
    crumple_ok(here, "sweep s.toml -q -o whole.csv");
    let read = |name: &str| fs::read(here.join(name)).unwrap();
    assert!(read("sweep.csv") == read("whole.csv"));
    // Standard output into a file.
    let line = format!("ulimit -f 16; exec \"$0\" histories {nodout} > stdout.csv");
    let output = Command::new("sh")
        .args(["-c", &line, env!("CARGO_BIN_EXE_crumple")])
        .current_dir(here)
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    let error = String::from_utf8(output.stderr).unwrap();
    says(&error, "cannot write to standard output: File too large");
}

#[test]
fn a_folder_that_is_not_there_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    build_fixture(here, WALL);
    crumple_ok(here, "train curves.h5 --group lead-car-wall --model nearest -o m.model");
    let nodout = fixture("fe/lead-car-wall/36kmh/nodout");
    let study = fixture("fe/lead-car-wall/study.toml");
    let commands: [&[&str]; 5] = [
        &["histories", nodout.to_str().unwrap(), "-o"],
        &["histories", nodout.to_str().unwrap(), "--section", "nodout", "-o"],
        &["build", study.to_str().unwrap(), "-o"],
        &["train", "curves.h5", "--group", WALL, "--model", "nearest", "-o"],
        &["predict", "m.model", "--speed", "40km/h", "-o"],
    ];
    let t = |target: &str, expected: &str| {
        for command in commands {
            // A database is not named like a table.
            let target =
                if command[0] == "build" { &target.replace(".csv", ".h5") } else { target };
            let line = [command, &[target]].concat();
            let error = crumple_fails(here, 1, &line);
            assert!(error.contains(&format!("cannot write {target}")), "{line:?} said:\n{error}");
            assert!(error.contains(expected), "{line:?} said:\n{error}");
            assert!(!error.contains("unchanged"), "nothing was there: {error}");
        }
    };
    t("nodir/x.csv", "the folder nodir does not exist: create it, or name another");
    t("no/dir/x.csv", "the folder no/dir does not exist: create it, or name another");
    t("m.model/x.csv", "m.model is a file, not a folder: name another");
    t("m.model/in/x.csv", "m.model is a file, not a folder: name another");
    assert_eq!(entries(here), ["curves.h5", "m.model"]);
}

/// A database of one group needs no --group, one of several says which there are.
#[test]
fn the_only_group_needs_no_name() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    build_fixture(here, WALL);
    crumple_ok(here, "train curves.h5 --model nearest -o a.model");
    crumple_ok(here, "train curves.h5 --group lead-car-wall --model nearest -o b.model");
    let read = |name: &str| fs::read(here.join(name)).unwrap();
    assert!(read("a.model") == read("b.model"));
    let compare = ["compare", "curves.h5", "--speed", "48km/h", "--nsdm-seeds", "0"];
    assert!(crumple_ok(here, &compare).starts_with("lead-car-wall at 48 km/h (wall), left out"));
    let shown = crumple_ok(here, "db show curves.h5 --case 36kmh");
    assert_eq!(
        shown,
        crumple_ok(here, &["db", "show", "curves.h5", "--group", WALL, "--case", "36kmh"])
    );
    let pair = fixture("fe/lead-car-pair/study.toml");
    crumple_ok(here, &["build", pair.to_str().unwrap(), "-o", "curves.h5"]);
    for line in
        ["train curves.h5 -o c.model", "compare curves.h5", "db show curves.h5 --case 36kmh"]
    {
        let error = crumple_fails(here, 1, &line.split(' ').collect::<Vec<_>>());
        says(
            &error,
            "curves.h5 has several groups: choose one with --group: lead-car-pair, lead-car-wall",
        );
    }
    assert!(!here.join("c.model").exists());
}

/// Runs that were built by a recipe of another filter are named, but not where a parameter tells them apart.
#[test]
fn a_group_of_several_filters_is_said() {
    let folder = demo_folder();
    let here = folder.path();
    let study = here.join("fe/lead-car-wall/study.toml");
    crumple_ok(here, "build fe/lead-car-wall/study.toml -o g.h5 -q");
    let text = fs::read_to_string(&study).unwrap();
    let (none, cfc) = ("filter     = \"none\"", "filter = \"CFC60\"");
    assert!(text.contains(none), "{text}");
    fs::write(&study, text.replace(none, cfc)).unwrap();
    let said = |line: &str| String::from_utf8(crumple_in(here, line).stderr).unwrap();
    let build = said("build fe/lead-car-wall/study.toml -o g.h5 --run 25kmh");
    let filter =
        "25kmh: the filter of its recipe is \"CFC60\", that of others in the group \"none\"";
    says(&build, filter);
    says(&said("db ls g.h5"), filter);
    assert!(
        !said("build fe/lead-car-wall/study.toml -o g.h5").contains("the filter of its recipe")
    );
}

/// What was cut off in copying is that, wherever it was cut: not another kind of file, and not whole.
#[test]
fn a_database_that_is_cut_off_is_known() {
    let folder = demo_folder();
    let here = folder.path();
    let whole = fs::read(here.join("curves.h5")).unwrap();
    let of = whole.len();
    for bytes in [40, 3000, of / 2, of - 3000, of - 1] {
        fs::write(here.join("cut.h5"), &whole[..bytes]).unwrap();
        let said = format!(
            "cut.h5: this HDF5 file is cut off: it has {bytes} of {of} bytes; copy it again"
        );
        for command in
            ["db check cut.h5", "db ls cut.h5", "train cut.h5 --group lead-car-wall -o x.model"]
        {
            says(&crumple_fails(here, 1, command), &said);
        }
    }
}

/// Changed numbers of a database stop every command that reads them, with the case named;
/// `--accept-changed` continues, and what changes or removes the case is let through.
#[test]
fn changed_numbers_are_not_read_in_silence() {
    let folder = demo_folder();
    let here = folder.path();
    edited(&here.join("curves.h5"), |file| {
        let case = file.root().group(WALL).unwrap().group("48kmh").unwrap();
        let force = case.dataset("force_N").unwrap().read_f64().unwrap();
        case.delete("force_N").unwrap();
        let force: Vec<f64> = force.iter().map(|f| 1.1 * f).collect();
        case.create_dataset("force_N", |dataset| {
            dataset.with_f64_data(&force);
        })
        .unwrap();
    });
    let scenario =
        SCENARIO.to_string() + "{ database = \"curves.h5\", case = \"lead-car-wall/48kmh\" }\n";
    fs::write(here.join("changed.toml"), scenario).unwrap();
    for line in [
        "db ls curves.h5",
        "db show curves.h5",
        "db tag curves.h5 --group lead-car-wall --add seen",
        "train curves.h5 --group lead-car-wall --model linear -o x.model",
        "validate curves.h5 --group lead-car-wall",
        "export curves.h5 --group lead-car-wall --case 48kmh --to csv",
        "plot curves.h5 --group lead-car-wall -o x.svg",
        "report curves.h5 -o x.html",
        "simulate changed.toml",
    ] {
        let words: Vec<&str> = line.split(' ').collect();
        let error = crumple_fails(here, 1, &words);
        says(&error, "the values of case lead-car-wall/48kmh do not match");
        if !line.starts_with("validate") && !line.starts_with("report") {
            crumple_ok(here, &[&words[..], &["--accept-changed"]].concat());
        }
    }
    // What does not change the numbers of the others, or takes the changed ones away.
    crumple_ok(here, &["db", "show", "curves.h5", "--group", WALL, "--case", "36kmh"]);
    crumple_ok(here, &["db", "rm", "curves.h5", "--group", WALL, "--case", "48kmh"]);
    crumple_ok(here, "db ls curves.h5");
    // Nor is anything left to be read where all are gone.
    fs::copy(here.join("curves.h5"), here.join("empty.h5")).unwrap();
    crumple_ok(here, "db rm empty.h5 --speed 1km/h..200km/h");
    for command in [
        "validate empty.h5",
        "compare empty.h5",
        "train empty.h5 -o x.model",
        "export empty.h5 -o x.csv",
        "plot empty.h5 -o x.svg",
        "report empty.h5 -o x.html",
    ] {
        says(&crumple_fails(here, 1, command), "empty.h5 has no groups");
    }
    // Models, by one digit.
    let text = fs::read_to_string(here.join("lead.model")).unwrap();
    assert!(text.contains("\"mass_kg\":24000.0"), "{}", &text[..300]);
    fs::write(here.join("x.model"), text.replacen("\"mass_kg\":24000.0", "\"mass_kg\":24001.0", 1))
        .unwrap();
    let predict = ["predict", "x.model", "--speed", "50km/h"];
    says(&crumple_fails(here, 1, &predict), "x.model: the model does not match its fingerprint");
    crumple_ok(here, &[&predict[..], &["--accept-changed"]].concat());
    // A file without a fingerprint, of an earlier program: what its energies show.
    let (old, _) = text.split_once(",\"fingerprint\"").unwrap();
    fs::write(here.join("x.model"), format!("{old}}}\n")).unwrap();
    crumple_ok(here, &predict);
    let old = old.replacen("\"mass_kg\":24000.0", "\"mass_kg\":12000.0", 1);
    fs::write(here.join("x.model"), format!("{old}}}\n")).unwrap();
    let error = crumple_fails(here, 1, &predict);
    says(&error, "of the impact's energy: a mass, speed or force was changed");
}

/// A run above the study's folder is named without the way up.
#[test]
fn runs_beside_the_study_have_names_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let from = fixture("fe/lead-car-wall");
    fs::create_dir_all(here.join("studies")).unwrap();
    for run in ["36kmh", "48kmh"] {
        fs::create_dir_all(here.join("runs").join(run)).unwrap();
        for file in ["nodout", "rwforc"] {
            fs::copy(from.join(run).join(file), here.join("runs").join(run).join(file)).unwrap();
        }
    }
    crumple_ok(here, "init runs -o studies/study.toml");
    let study = here.join("studies/study.toml");
    let text = fs::read_to_string(&study).unwrap();
    fs::write(&study, text.replace("name = \"36kmh\"\n", "")).unwrap();
    crumple_ok(here, "build studies/study.toml -o curves.h5 -q");
    let database = crumple::database::Database::read(&here.join("curves.h5")).unwrap();
    let names: Vec<&str> = database.all().map(|case| &*case.id.name).collect();
    assert_eq!(names, ["runs_36kmh", "48kmh"]);
}
