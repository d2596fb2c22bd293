//! What commands print with --json, and what users write, against the schemas; Python's jsonschema
//! judges.

use std::collections::BTreeMap;
use std::path::Path;

use crate::common::{
    build_fixture, crumple_in, crumple_ok, demo_folder, fixture, python, python_of, root, says,
};
use serde_json::{Value, json};

/// Documents by name, each with its schema.
type Documents = Vec<(&'static str, String, Value)>;

/// Errors of each document, by its name.
fn errors(documents: &Documents) -> BTreeMap<String, Vec<String>> {
    let folder = tempfile::tempdir().unwrap();
    let mut command = python();
    command.arg(root().join("tests/python/schemas.py"));
    for (schema, name, document) in documents {
        let path = folder.path().join(name);
        std::fs::write(&path, document.to_string()).unwrap();
        let schema = root().join("schemas").join(schema);
        command.arg(format!("{}={}", schema.display(), path.display()));
    }
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found: BTreeMap<String, Vec<String>> = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found.len(), documents.len(), "every document is judged");
    let named = |path: String| Path::new(&path).file_name().unwrap().to_str().unwrap().to_string();
    found.into_iter().map(|(path, errors)| (named(path), errors)).collect()
}

fn assert_valid(documents: &Documents) {
    for (name, errors) in errors(documents) {
        assert!(errors.is_empty(), "{name}: {errors:#?}");
    }
}

/// The JSON that a command prints, however it ends.
fn printed(folder: &Path, arguments: &[&str]) -> Value {
    let output = crumple_in(folder, &[arguments, &["--json"]].concat());
    let error = String::from_utf8_lossy(&output.stderr);
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{arguments:?}: {e}\n{error}"))
}

/// A database with three groups that can be validated and two that hardly can: two runs, and a
/// mixture of kinds of speed.
fn databases(folder: &Path) {
    for group in ["lead-car-wall", "lead-car-pair", "vehicle-pair"] {
        build_fixture(folder, group);
    }
    let rebuilt = |source: &str, group: &str, name: &str, runs: usize| {
        let study = fixture(&format!("fe/{source}/study.toml"));
        let text = std::fs::read_to_string(&study).unwrap();
        let text = text.replace(&format!("group = \"{source}\""), &format!("group = \"{group}\""));
        let mut parts = text.split("[[run]]");
        let mut text = parts.next().unwrap().to_string();
        for (i, part) in parts.take(runs).enumerate() {
            let path = format!("path  = \"{}/", study.parent().unwrap().display());
            let part = part.replace("path  = \"", &path);
            text += &format!("[[run]]\nname = \"{name}{i}\"{part}");
        }
        // A manifest each: one that is changed is a study that was renamed.
        let path = format!("{group}-{name}.toml");
        std::fs::write(folder.join(&path), text).unwrap();
        crumple_ok(folder, &["build", &path, "-o", "curves.h5", "-q"]);
    };
    rebuilt("lead-car-wall", "two-runs", "w", 2);
    rebuilt("lead-car-wall", "three-runs", "w", 3);
    rebuilt("lead-car-wall", "mixed", "w", 2);
    rebuilt("lead-car-pair", "mixed", "p", 2);
}

#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn documents_are_those_of_the_schemas() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    databases(here);
    let mut documents: Documents = Vec::new();
    let mut add = |schema: &'static str, name: &str, document: Value| {
        documents.push((schema, format!("{name}.json"), document));
    };

    let validation = "validation.schema.json";
    let all = printed(here, &["validate", "curves.h5", "--next"]);
    let groups = all["groups"].as_array().unwrap();
    assert_eq!(groups.len(), 6);
    assert_eq!(groups.iter().filter(|g| g["error"].is_string()).count(), 1, "the mixture");
    assert!(groups.iter().any(|g| g["rows"] == json!([])), "two runs");
    assert!(groups.iter().any(|g| g["next_run"].is_object()));
    add(validation, "validate", all.clone());
    let nested =
        |group: &str| printed(here, &["validate", "curves.h5", "--nested", "--group", group]);
    let rows = |of: &Value| {
        let rows = of["groups"][0]["rows"].as_array().unwrap();
        rows.iter().filter(|r| r["model"] == "auto").count()
    };
    let (pair, three) = (nested("lead-car-pair"), nested("three-runs"));
    assert_eq!((rows(&pair), rows(&three)), (2, 0));
    add(validation, "nested", pair);
    add(validation, "nested-of-three", three);
    for (name, arguments) in [
        ("train", &["--model", "linear"][..]),
        ("train-two", &["--group", "two-runs"]),
        ("train-paper", &["--paper"]),
    ] {
        let group: &[&str] = if name == "train-two" { &[] } else { &["--group", "lead-car-wall"] };
        let train = ["train", "curves.h5", "-o", name];
        let document = printed(here, &[&train[..], group, arguments].concat());
        // A model's own validation is a group of the report.
        add(validation, name, json!({ "groups": [document["validation"]] }));
    }

    let predicted = "predicted_curve.schema.json";
    for (name, model, arguments) in [
        ("inside", "train", &["--speed", "50km/h"][..]),
        ("outside", "train", &["--speed", "80km/h"]),
        ("far", "train", &["--speed", "500km/h", "--extrapolate"]),
        ("corrected", "train", &["--speed", "50km/h", "--energy-correct"]),
        ("without-band", "train-two", &["--speed", "15km/h"]),
        ("forest", "train-paper", &["--speed", "42km/h", "--paper"]),
    ] {
        let document = printed(here, &[&["predict", model], arguments].concat());
        for edge in ["force_low_N", "body_force_low_N"] {
            assert_eq!(document[edge].is_array(), name != "without-band", "{name}");
        }
        add(predicted, name, document);
    }

    let rating = "rating.schema.json";
    let run = |speed: &str| {
        fixture(&format!("fe/lead-car-wall/{speed}/nodout")).to_str().unwrap().to_string()
    };
    let (a, b) = (run("36kmh"), run("48kmh"));
    for component in ["x_acceleration", "x_velocity", "y_displacement"] {
        let of = ["rate", &a, &b, "--id", "900001", "--component", component, "--to", "50ms"];
        add(rating, component, printed(here, &of));
    }
    let zero = "time_s,a\n0,0\n0.01,0\n0.02,0\n0.03,0\n0.04,0\n0.05,0\n";
    std::fs::write(here.join("zero.csv"), zero).unwrap();
    let zeros = ["rate", "zero.csv", "zero.csv", "--quantity", "acceleration"];
    add(rating, "zeros", printed(here, &zeros));

    let result = "time_s,deflection_m[a|b],force_N[a|b]\n0,0,0\n0.1,1,2e6\n0.2,0.9,0\n";
    std::fs::write(here.join("result.csv"), result).unwrap();
    let runs = ["rate", "result.csv", "result.csv"];
    add("acceptance.schema.json", "runs", printed(here, &runs));

    // What users write.
    let read = |path: &Path| -> Value {
        let table: toml::Table = std::fs::read_to_string(path).unwrap().parse().unwrap();
        serde_json::to_value(table).unwrap()
    };
    for group in ["lead-car-wall", "lead-car-pair", "vehicle-pair"] {
        let study = fixture(&format!("fe/{group}/study.toml"));
        add("study.schema.json", group, read(&study));
    }
    for entry in root().join("examples/trains").read_dir().unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "toml") {
            let name = path.file_stem().unwrap().to_str().unwrap();
            add("scenario.schema.json", name, read(&path));
        }
    }
    assert!(documents.len() > 20);
    assert_valid(&documents);

    // The judge sees what is wrong.
    let mut broken = all;
    broken["groups"][0]["rows"][0]["force_l1"] = Value::Null;
    let alone = broken["groups"][0].clone();
    let wrong = vec![
        (validation, "null.json".to_string(), broken),
        (validation, "alone.json".to_string(), alone),
    ];
    let found = errors(&wrong);
    assert!(found.values().all(|errors| !errors.is_empty()), "{found:?}");
}

/// The recipes of docs/databases.md run, one after the other in the demo's folder, and print what
/// stands behind them.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn recipes_for_databases_run() {
    let path = root().join("docs/databases.md");
    let text = std::fs::read_to_string(&path).unwrap();
    let folder = demo_folder();
    let (mut out, mut block, mut printed) = (String::new(), None, None);
    let (mut script, mut recipes) = (String::new(), 0);
    for line in text.split_inclusive('\n') {
        match (block, line.trim_end()) {
            (None, fence) if fence.starts_with("```") => block = Some(&fence[3..]),
            (Some("python"), "```") => {
                let mut python = python_of("CRUMPLE_PYTHON_TABLES");
                let output =
                    python.args(["-c", &script]).current_dir(folder.path()).output().unwrap();
                let error = String::from_utf8_lossy(&output.stderr);
                assert!(output.status.success(), "{script}\n{error}");
                printed = Some(String::from_utf8(output.stdout).unwrap());
                (script, block, recipes) = (String::new(), None, recipes + 1);
            }
            (Some("text"), "```") => {
                out += &printed.take().expect("a recipe stands before its output");
                block = None;
            }
            (Some(_), "```") => block = None,
            (Some("python"), _) => script += line,
            (Some("sh"), command) => drop(crate::readme::run(command, folder.path())),
            (Some("console"), line) => {
                line.strip_prefix("$ ").map(|command| crate::readme::run(command, folder.path()));
            }
            (Some("text"), _) => continue,
            _ => {}
        }
        out += line;
    }
    assert!(recipes >= 6, "{recipes} recipes");
    if std::env::var_os("CRUMPLE_WRITE_DOCS").is_some() {
        std::fs::write(&path, &out).unwrap();
        return;
    }
    for (number, (said, expected)) in text.lines().zip(out.lines()).enumerate() {
        assert_eq!(said, expected, "line {}: the recipe prints something else", number + 1);
    }
    assert!(text == out);
}

/// Both of xarray's engines open databases and histories by the lines of docs/databases.md.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn xarray_opens_databases_and_histories() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    build_fixture(here, "lead-car-pair");
    let run = |file: &str| {
        let path = fixture(&format!("fe/lead-car-pair/48kmh/{file}"));
        path.to_str().unwrap().to_string()
    };
    for file in ["nodout", "rcforc"] {
        let output = format!("{file}.h5");
        crumple_ok(here, &["histories", &run(file), "-o", &output, "--units", "mm-t-s"]);
    }
    let look = "import sys, xarray as xr\n\
        def opened(file, names, engine, **more):\n\
        \x20   more |= {'phony_dims': 'sort'} if engine == 'h5netcdf' else {}\n\
        \x20   data = xr.open_dataset(file, engine=engine, **more)\n\
        \x20   return data.swap_dims({data[name].dims[0]: name for name in names})\n\
        for engine in ('h5netcdf', 'netcdf4'):\n\
        \x20   case = opened('curves.h5', ['time_s'], engine, group='lead-car-pair/48kmh')\n\
        \x20   assert all(v.dims == ('time_s',) for v in case.variables.values()), case\n\
        \x20   assert case.attrs['speed_kind'] == 'closing' and 'body_force_N' in case\n\
        \x20   assert [v.units for v in (case.force_N, case.deflection_m, case.time_s)] == ['N', 'm', 's']\n\
        \x20   forces = opened('rcforc.h5', ['time', 'interface'], engine)\n\
        \x20   assert forces.x_force.dims == ('time', 'interface') and forces.x_force.units == 'N'\n\
        \x20   assert list(forces.interface.attrs['sides']) == ['surfa', 'surfb']\n\
        \x20   assert list(forces.interface.attrs['titles']) == 2 * ['car A against car B']\n\
        \x20   assert isinstance(forces.attrs['title'], str) and forces.attrs['units'] == 'mm-t-s'\n\
        \x20   nodes = opened('nodout.h5', ['time', 'node'], engine)\n\
        \x20   assert nodes.x_acceleration.dims == ('time', 'node') and nodes.time.units == 's'\n\
        \x20   assert nodes.x_acceleration.units == 'mm/s^2' and nodes.attrs['source'] == sys.argv[1]\n";
    let output = python_of("CRUMPLE_PYTHON_TABLES")
        .args(["-c", look, &run("nodout")])
        .current_dir(here)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// mlcroissant accepts the description of exported tables, and reads their records by it.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn mlcroissant_reads_the_tables() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    build_fixture(here, "lead-car-pair");
    crumple_ok(here, "db export curves.h5 --originals --croissant -o tables");
    let look = "import csv, mlcroissant\n\
        data = mlcroissant.Dataset('tables/croissant.json')\n\
        assert not data.metadata.issues.errors, data.metadata.issues.errors\n\
        for name in ('cases', 'curves', 'originals'):\n\
        \x20   rows = list(csv.DictReader(open(f'tables/{name}.csv')))\n\
        \x20   records = list(data.records(name))\n\
        \x20   assert len(records) == len(rows) > 3, name\n\
        \x20   for row, record in list(zip(rows, records))[:50]:\n\
        \x20       assert set(record) == {f'{name}/{column}' for column in row}, name\n\
        \x20       for column, text in row.items():\n\
        \x20           value = record[f'{name}/{column}']\n\
        \x20           if isinstance(value, float): assert value == float(text), (column, value)\n\
        \x20           elif isinstance(value, bytes): assert value.decode() == text, (column, value)\n\
        force = [field for field in data.metadata.record_sets[1].fields if field.name == 'curves/force_N']\n\
        assert 'Float' in str(force[0].data_types), force\n";
    let output = python_of("CRUMPLE_PYTHON_TABLES").args(["-c", look]).current_dir(here).output();
    let output = output.unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    // What somebody has added to the description stays, and that it may be of other tables is said.
    let before = std::fs::read_to_string(here.join("tables/croissant.json")).unwrap();
    let output = crumple_in(here, "db export curves.h5 --group lead-car-pair -o tables");
    assert!(output.status.success());
    says(
        &String::from_utf8(output.stderr).unwrap(),
        "croissant.json existed before and may be of other cases",
    );
    assert_eq!(std::fs::read_to_string(here.join("tables/croissant.json")).unwrap(), before);
}

/// silx, asked for the file's picture, draws force over deflection: also after a case was added to a file that
/// another program has written to, which is edited and not written anew.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn silx_draws_the_curve_of_a_database() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    build_fixture(here, "lead-car-pair");
    let look = "import h5py, sys\n\
        from silx.io import nxdata\n\
        with h5py.File('curves.h5', 'a') as file:\n\
        \x20   for entry in [file, *file.values()]:\n\
        \x20       data = nxdata.get_default(entry)\n\
        \x20       assert data.is_curve and data.signal.name == f'/{sys.argv[1]}/force_N', data.signal.name\n\
        \x20       assert data.axes_dataset_names == ['deflection_m'], data.axes_dataset_names\n\
        \x20   for path in sys.argv[1:]:\n\
        \x20       data = nxdata.NXdata(file[path])\n\
        \x20       assert data.is_valid and (data.signal_name, data.axes_names) == ('Force', ['Deflection'])\n\
        \x20       units = [file[path][name].attrs['units'] for name in ('force_N', 'body_force_N', 'deflection_m')]\n\
        \x20       assert units == [b'N', b'N', b'm'], units\n\
        \x20   file['lead-car-pair'].attrs['ours'] = 1\n";
    let check = |cases: &[&str]| {
        let output = python_of("CRUMPLE_PYTHON_TABLES")
            .args([&["-c", look], cases].concat())
            .current_dir(here)
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    check(&["lead-car-pair/72kmh", "lead-car-pair/36kmh"]);
    crumple_ok(
        here,
        &["db", "rename", "curves.h5", "--case", "lead-car-pair/36kmh", "--to", "slow"],
    );
    crumple_ok(here, &["db", "tag", "curves.h5", "--case", "lead-car-pair/48kmh", "--add", "old"]);
    check(&["lead-car-pair/72kmh", "lead-car-pair/slow", "lead-car-pair/48kmh"]);
}

/// Work that takes long says on a terminal what it is at, and nothing elsewhere.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn long_work_shows_its_progress_on_a_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    // The smallest of the bundled groups.
    build_fixture(here, "lead-car-pair");
    let script = "import pty, sys; sys.exit(pty.spawn(sys.argv[1:]) >> 8)";
    for (arguments, step) in [
        (&["validate", "curves.h5"][..], "validating lead-car-pair"),
        (&["train", "curves.h5", "-o", "m"], "training lead-car-pair"),
        (
            &["compare", "curves.h5", "--speed", "48km/h", "--nsdm-seeds", "0"],
            "comparing at 48 km/h",
        ),
    ] {
        let on_a_terminal = |more: &[&str]| {
            let command = python()
                .args(["-c", script, env!("CARGO_BIN_EXE_crumple")])
                .args(arguments)
                .args(more)
                .current_dir(here)
                .stdin(std::process::Stdio::null())
                .output()
                .unwrap();
            assert!(command.status.success(), "{command:?}");
            String::from_utf8_lossy(&command.stdout).into_owned()
        };
        assert!(on_a_terminal(&[]).contains(step), "{arguments:?}");
        assert!(!on_a_terminal(&["-q"]).contains(step), "{arguments:?} -q");
        let elsewhere = crumple_in(here, arguments);
        assert!(!String::from_utf8_lossy(&elsewhere.stderr).contains(step), "{arguments:?}");
    }
}
