//! Exports: the files that other tools take, read or run by these tools or by the closest reader there is.
//!
//! CRUMPLE_PYTHON_EXPORTS names a Python with tests/python/requirements-exports.txt, as tests/run sets it; CalculiX
//! (`ccx`) and Octave (`octave-cli`) are looked for on the path.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::common::{
    crumple_fails, crumple_in, crumple_ok, demo_folder, entries, python, python_of, read_json,
    run_python, says,
};
use crumple::curve::Tail;
use crumple::formats::FORMATS;
use crumple::formats::{ReadOptions, read};
use crumple::unit::UnitSystem;
use serde_json::{Value, json};

/// The edges of both bands in a predicted curve.
const BANDS: [&str; 4] = ["force_low_N", "force_high_N", "body_force_low_N", "body_force_high_N"];
/// Units in which the exports of this test stand; readers of files without units are given them.
const UNITS: &str = "mm-t-s";
/// Exports of one curve, by file.
const FILES: [(&str, &[&str]); 12] = [
    ("a.csv", &[]),
    ("a.k", &[]),
    ("s06.k", &["--material", "s06"]),
    ("mat121.k", &["--material", "mat121", "--deck"]),
    ("deck.k", &["--deck"]),
    ("a.rad", &["--units", UNITS]),
    ("a.inp", &[]),
    ("a.cmd", &[]),
    ("a.adm", &[]),
    ("a.spr", &[]),
    ("a.mat", &[]),
    ("a.txt", &[]),
];

fn exports_python(script: &str, arguments: &[&str]) -> Value {
    run_python(python_of("CRUMPLE_PYTHON_EXPORTS"), script, arguments)
}

fn export(folder: &Path, input: &str, output: &str, more: &[&str]) {
    crumple_ok(folder, &[&["export", input, "-q", "-o", output][..], more].concat());
}

/// A predicted curve with other points: (deflection in m, body force in N).
fn with_points(folder: &Path, name: &str, points: &[(f64, f64)]) {
    let text = fs::read_to_string(folder.join("lead50.json")).unwrap();
    let mut curve: Value = serde_json::from_str(&text).unwrap();
    let (d, f): (Vec<f64>, Vec<f64>) = points.iter().copied().unzip();
    curve["max_deflection_m"] = json!(d[d.len() - 1]);
    curve["deflection_m"] = json!(d);
    curve["force_N"] = json!(f);
    curve["body_force_N"] = json!(f);
    for key in BANDS {
        curve.as_object_mut().unwrap().remove(key);
    }
    fs::write(folder.join(name), curve.to_string()).unwrap();
}

/// A spike of 6 MN at 10 mm in front of folds, as nose plates give it.
fn spike(points: u32) -> Vec<(f64, f64)> {
    let end = 0.9;
    let mut curve: Vec<(f64, f64)> = (0..points)
        .map(|i| {
            let d = end * f64::from(i) / f64::from(points - 1);
            (d, if i == 0 { 0.0 } else { 1.5e6 + 3e5 * (40.0 * d).sin() })
        })
        .collect();
    curve.retain(|p| p.0 == 0.0 || p.0 > 0.021);
    curve.splice(1..1, [(0.01, 6e6), (0.02, 1.5e6)]);
    curve
}

/// Force at 200 deflections within the digits of the format, or within 0.5 % of the largest force where a format
/// takes few points; energy to the maximum crush within 0.1 % as the tool interpolates, also of a sharp spike.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn other_tools_read_the_exported_points() {
    let folder = demo_folder();
    let here = folder.path();
    with_points(here, "spike.json", &spike(401));
    with_points(here, "few.json", &spike(40));
    // Short steep flanks between long intervals.
    let flanks = [(0.0, 0.0), (0.008, 6e6), (0.009, 8e5), (0.2, 1.5e6), (0.201, 3.5e6)];
    with_points(here, "flanks.json", &[&flanks[..], &[(0.205, 9e5), (0.8, 2.4e6)]].concat());
    let recorded = [
        "export",
        "curves.h5",
        "--group",
        "lead-car-wall",
        "--case",
        "48kmh",
        "-o",
        "recorded.json",
    ];
    crumple_ok(here, &recorded);
    // Of a slow impact all points lie close together.
    crumple_ok(here, "predict vehicle.model --speed 5km/h -o slow.json");
    for curve in
        ["lead50.json", "slow.json", "spike.json", "few.json", "flanks.json", "recorded.json"]
    {
        for (file, more) in FILES {
            export(here, curve, file, more);
        }
        export(here, curve, "a.mo", &[]);
        let paths: Vec<String> = FILES
            .iter()
            .map(|f| f.0)
            .chain(["a.mo"])
            .map(|f| here.join(f).display().to_string())
            .collect();
        let json = here.join(curve).display().to_string();
        let arguments: Vec<&str> =
            [json.as_str()].into_iter().chain(paths.iter().map(String::as_str)).collect();
        let found = exports_python("exports_points.py", &arguments);
        let found = found.as_object().unwrap();
        assert_eq!(found.len(), FILES.len() + 1 + 4 * 2, "three readers of each deck");
        for (name, seen) in found {
            let of = |key: &str| seen[key].as_f64().unwrap();
            let is_thinned = name.starts_with("a.inp") || name.starts_with("a.mo");
            // A recorded curve is rougher.
            let thinned = if curve == "recorded.json" { 2e-2 } else { 5e-3 };
            let bound = if is_thinned { thinned } else { 2e-8 };
            assert!(of("force") < bound, "{curve} {name}: force off by {}", of("force"));
            assert!(of("linear").abs() < 1e-3, "{curve} {name}: energy, {seen}");
            assert!(of("beyond") > 1.5, "{curve} {name} ends at the maximum crush: {seen}");
            // Tools that interpolate by splines.
            if ["a.cmd", "a.adm", "a.spr"].iter().any(|f| name.starts_with(f)) {
                assert!(of("akima").abs() < 1e-3, "{curve} {name}: energy, {seen}");
                assert!(of("cubic").abs() < 1e-3, "{curve} {name}: energy, {seen}");
                assert!(of("points") >= 200.0);
                // Neither pulls before the contact, nor overshoots.
                for (place, cubic) in [("before", 5e-3), ("over", 1.5e-2)] {
                    let share = |spline: usize| seen[place][spline].as_f64().unwrap();
                    assert!(share(0) < 5e-3 && share(1) < cubic, "{curve} {name}: {seen}");
                }
            }
        }
    }
}

/// A scenario of one mass on a curve file at the curve's own speed, and crumple's run of it.
fn own_run(folder: &Path, curve: &str, law: &str) -> String {
    let scenario = format!(
        "[run]\nduration = \"150ms\"\noutput_interval = \"0.75ms\"\n\
         [curves]\nnose = {{ file = \"{curve}\", force = \"body\", law = \"{law}\" }}\n\
         [[train]]\nname = \"A\"\nspeed = \"50km/h\"\nvehicles = [ {{ name = \"A1\", mass = \"24.0t\" }} ]\n\
         [wall]\n[contact]\ncurve = \"nose\"\n"
    );
    fs::write(folder.join("one.toml"), scenario).unwrap();
    crumple_ok(folder, "simulate one.toml -q -o own.csv");
    folder.join("own.csv").display().to_string()
}

/// CalculiX runs the deck: an elastic spring of 200 rows.
#[test]
#[ignore = "needs CalculiX (ccx), scipy in the Python clients"]
fn calculix_moves_a_mass_as_our_elastic_run() {
    let found = Command::new("ccx").arg("-v").output();
    assert!(found.is_ok(), "this test needs CalculiX: ccx is not on the path (calculix-ccx)");
    let folder = demo_folder();
    let here = folder.path();
    export(here, "lead50.json", "deck.inp", &["--deck"]);
    let own = own_run(here, "lead50.json", "elastic");
    let deck = here.join("deck.inp").display().to_string();
    let found = exports_python("exports_motion.py", &["calculix", &deck, &own]);
    assert!(found["x"].as_f64().unwrap() < 1e-4, "{found}");
    assert!(found["v"].as_f64().unwrap() < 1e-3, "{found}");
    assert!((found["restitution"].as_f64().unwrap() - 1.0).abs() < 1e-4, "{found}");
}

/// A Modelica compiler runs the package with its memory.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn rumoca_moves_a_mass_as_our_run() {
    let folder = demo_folder();
    let here = folder.path();
    // The compiler reads all packages of a folder: another curve of the same name keeps to its file's.
    fs::create_dir(here.join("packages")).unwrap();
    export(here, "lead50.json", "packages/own.mo", &[]);
    export(here, "lead50.json", "packages/contact.mo", &["--force", "contact"]);
    let own = own_run(here, "lead50.json", "memory");
    let package = here.join("packages/own.mo").display().to_string();
    let found = exports_python("exports_motion.py", &["modelica", &package, &own]);
    assert!(found["x"].as_f64().unwrap() < 1e-5, "{found}");
    assert!(found["v"].as_f64().unwrap() < 1e-4, "{found}");
    assert!(found["force"].as_f64().unwrap() < 2e-3, "{found}");
    let [theirs, ours] = ["restitution", "own_restitution"].map(|k| found[k].as_f64().unwrap());
    assert!((theirs / ours - 1.0).abs() < 1e-3, "{found}");
}

/// An oracle of loading and rebound: the curve file's numbers with the unloading line in a tool of its own.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn exudyn_rebounds_as_our_run() {
    let folder = demo_folder();
    let here = folder.path();
    let own = own_run(here, "lead50.json", "memory");
    let curve = here.join("lead50.json").display().to_string();
    let found = run_python(python(), "exports_motion.py", &["exudyn", &curve, &own]);
    for key in ["x", "v"] {
        assert!(found[key].as_f64().unwrap() < 1e-6, "{found}");
    }
}

/// Octave reads the matrices and interpolates them.
#[test]
#[ignore = "needs Octave (octave-cli)"]
fn octave_reads_the_matrices() {
    let folder = demo_folder();
    let here = folder.path();
    export(here, "lead50.json", "a.mat", &[]);
    export(here, "lead50.json", "band.mat", &["--tail", "none"]);
    let program = "load('a.mat'); x = linspace(0, max_deflection_m, 200); \
        printf('%.17g ', interp1(fd_load(:,1), fd_load(:,2), x)); \
        printf('\\n%.17g %.17g %.17g\\n', k_u, fd_unload(2,1), fd_unload(2,2)); disp(facts(1,:)); \
        load('band.mat'); printf('%.17g ', fd_low(2:end,2)); printf('\\n'); \
        printf('%.17g ', fd_high(2:end,2)); printf('\\n%d\\n', isequal(fd_low(:,1), fd_load(:,1)))";
    let output =
        Command::new("octave-cli").args(["--quiet", "--eval", program]).current_dir(here).output();
    let output = output.expect("this test needs Octave: octave-cli is not on the path (octave)");
    let text = String::from_utf8(output.stdout).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let numbers =
        |line: &str| -> Vec<f64> { line.split_whitespace().map(|n| n.parse().unwrap()).collect() };
    let (forces, unloading) = (numbers(lines[0]), numbers(lines[1]));
    let curve = read_json(&here.join("lead50.json"));
    let column = |key: &str| -> Vec<f64> { serde_json::from_value(curve[key].clone()).unwrap() };
    let (d, f) = (column("deflection_m"), column("body_force_N"));
    let envelope = crumple::curve::Envelope::new(d, f).unwrap();
    assert_eq!(forces.len(), 200);
    for (i, force) in forces.iter().enumerate() {
        let expected = envelope.force_at(envelope.end_m() * i as f64 / 199.0);
        assert!((force - expected).abs() < 1e-6 * envelope.peak_force_n(), "{i}");
    }
    assert_eq!(unloading[0], curve["body_unloading_stiffness_N_per_m"].as_f64().unwrap());
    assert_eq!(unloading[1], envelope.end_m());
    assert!(lines[2].starts_with("curve: lead-car-wall 50 km/h"));
    assert_eq!(numbers(lines[3]), column("body_force_low_N"));
    assert_eq!(numbers(lines[4]), column("body_force_high_N"));
    assert_eq!(lines[5], "1");
}

/// A predicted curve in JSON is exported as one of its forces, which is said.
#[test]
fn json_of_one_force_says_so() {
    let folder = demo_folder();
    let here = folder.path();
    let notes = export_notes(here, "lead50.json", &["-o", "body.json"]);
    assert!(notes.contains("the body force alone is exported"), "{notes}");
    let notes = export_notes(here, "lead.model", &["--speed", "50km/h", "-o", "both.json"]);
    assert!(!notes.contains("alone"), "{notes}");
    export(here, "both.json", "contact.csv", &["--force", "contact"]);
    let error = crumple_fails(here, 1, "export body.json --force contact --to csv -o no.csv");
    says(&error, "or it was exported with --force body");
}

/// Columns, matrices and tables hold the band of the force that they hold: JSON and they agree.
#[test]
fn bands_stand_beside_their_curves() {
    let folder = demo_folder();
    let here = folder.path();
    let curve = read_json(&here.join("lead50.json"));
    let column = |key: &str| -> Vec<f64> { serde_json::from_value(curve[key].clone()).unwrap() };
    assert_ne!(column("force_low_N"), column("body_force_low_N"));
    // The body force is what is written unless another is requested.
    for (force, prefix) in [(&["--force", "contact"][..], ""), (&[], "body_")] {
        let keys = ["force_low_N", "force_high_N"].map(|edge| format!("{prefix}{edge}"));
        let [low, high] = keys.each_ref().map(|key| column(key));
        let d = column("deflection_m");
        // The matrices by our own reader: their points are those of the curve.
        export(here, "lead50.json", "band.mat", &[force, &["--tail", "none"]].concat());
        for (name, edge_n) in [("fd_low", &low), ("fd_high", &high)] {
            let options = ReadOptions {
                units: UnitSystem::parse("SI").ok(),
                curve: Some(name.into()),
                ..ReadOptions::default()
            };
            let (edge, _) = read(&here.join("band.mat"), &options).unwrap();
            assert_eq!((&edge.deflection_m, &edge.force_n), (&d, edge_n), "{name} {prefix}");
        }
        // Columns, to nine digits.
        export(here, "lead50.json", "band.csv", &[force, &["--tail", "none"]].concat());
        let csv = fs::read_to_string(here.join("band.csv")).unwrap();
        says(&csv, "\nd_m,force_N,lo,hi\n");
        let rows = csv.lines().filter(|l| !l.starts_with('#')).skip(1);
        let rows: Vec<Vec<f64>> =
            rows.map(|row| row.split(',').map(|v| v.parse().unwrap()).collect()).collect();
        assert_eq!(rows.len(), d.len());
        for (i, row) in rows.iter().enumerate() {
            let close = |a: f64, b: f64| (a - b).abs() <= 5e-9 * b.abs();
            assert!(close(row[2], low[i]) && close(row[3], high[i]), "{row:?}");
            assert!(row[2] <= row[1] && row[1] <= row[3], "{row:?}");
        }
        table_holds_the_band(here, force, &keys, &curve);
        for to in ["csv", "mat"] {
            let asked = [&["--to", to, "-o", "x"], force].concat();
            assert!(!export_notes(here, "lead50.json", &asked).contains("band"));
        }
    }
}

/// The table of a model has at a speed the band of the curve that is predicted there.
fn table_holds_the_band(here: &Path, force: &[&str], keys: &[String; 2], curve: &Value) {
    let envelope = |key: &String| {
        let column = |key: &str| serde_json::from_value(curve[key].clone()).unwrap();
        crumple::curve::Envelope::new(column("deflection_m"), column(key)).unwrap()
    };
    let [low, high] = keys.each_ref().map(envelope);
    let to_table = ["--to", "table", "--speed", "50km/h,54km/h"];
    export(here, "lead.model", "band.csv", &[force, &to_table].concat());
    let table = fs::read_to_string(here.join("band.csv")).unwrap();
    assert!(table.contains("\nspeed_m_per_s,d_m,force_N,force_low_N,force_high_N\n"));
    assert!(table.contains("\n# band: force_low_N to force_high_N: empirical range for 90 %"));
    let rows = table.lines().filter(|l| l.starts_with("1.38888889E+01"));
    let mut compared = 0;
    for row in rows {
        let values: Vec<f64> = row.split(',').map(|v| v.parse().unwrap()).collect();
        if values[1] < low.end_m() {
            // A row is scaled to its curve's energy.
            let close = |edge: f64, own: f64| (edge - own).abs() < 3e-3 * high.peak_force_n();
            assert!(close(values[3], low.force_at(values[1])), "{row}");
            assert!(close(values[4], high.force_at(values[1])), "{row}");
        }
        assert!(values[3] <= values[2] && values[2] <= values[4], "{row}");
        compared += 1;
    }
    assert!(compared > 900, "{compared}");
}

/// What `export` says beside what it writes.
fn export_notes(here: &Path, input: &str, more: &[&str]) -> String {
    let arguments = [&["export", input, "--json"][..], more].concat();
    let said: Value = serde_json::from_str(&crumple_ok(here, &arguments)).unwrap();
    said["notes"].to_string()
}

/// No band is written, and said, of softened curves, where the model has none, and of the body force where only that of
/// the contact force is known, as of older files.
#[test]
fn a_missing_band_is_said() {
    let folder = demo_folder();
    let here = folder.path();
    let text = fs::read_to_string(here.join("lead50.json")).unwrap();
    let without = |name: &str, keys: &[&str]| {
        let mut curve: Value = serde_json::from_str(&text).unwrap();
        keys.iter().for_each(|key| drop(curve.as_object_mut().unwrap().remove(*key)));
        fs::write(here.join(name), curve.to_string()).unwrap();
    };
    without("older.json", &BANDS[2..]);
    without("bare.json", &BANDS);
    let contact = ["--force", "contact"];
    for to in ["csv", "mat"] {
        let to = ["--to", to, "-o", "x"];
        let older = export_notes(here, "older.json", &to);
        let of_body = "written without a band: only that of the contact force is known (--force contact), until the model is trained again";
        says(&older, of_body);
        let of_contact = export_notes(here, "older.json", &[&to[..], &contact].concat());
        assert!(!of_contact.contains("band"), "{of_contact}");
        let group = ["--group", "lead-car-wall", "--case", "36kmh"];
        let record = export_notes(here, "curves.h5", &[&group[..], &to].concat());
        assert!(!record.contains("band"), "a record has none");
        for force in [&contact[..], &[]] {
            let bare = export_notes(here, "bare.json", &[&to, force].concat());
            says(&bare, "written without a band: the model gives none here");
        }
        // The body force has no rise that is too steep.
        let soft = [&to, &contact[..], &["--soften"]].concat();
        let soft = export_notes(here, "lead50.json", &soft);
        says(&soft, "written without a band: it is not that of a softened");
    }
    assert!(!export_notes(here, "lead.model", &["--to", "table", "-o", "x"]).contains("band"));
}

/// A Modelica package has the name of its file, so that two curves of one name keep apart in a folder.
#[test]
fn packages_have_the_names_of_their_files() {
    let folder = demo_folder();
    let here = folder.path();
    let package = |file: &str| -> String {
        let text = fs::read_to_string(here.join(file)).unwrap();
        let begins = text.lines().find(|l| l.starts_with("package ")).unwrap().to_string();
        let name = begins.split(' ').nth(1).unwrap().to_string();
        assert!(text.trim_end().ends_with(&format!("end {name};")), "{file}");
        name
    };
    for (file, name) in [
        ("one.mo", "one"),
        ("lead-50 b.mo", "lead_50_b"),
        ("50.mo", "curve_50"),
        ("model.mo", "curve_model"),
        ("stream.mo", "curve_stream"),
        ("Real.mo", "curve_Real"),
        ("nöse.mo", "n_se"),
    ] {
        export(here, "lead50.json", file, &[]);
        assert_eq!(package(file), name);
    }
    export(here, "lead.model", "several", &["--to", "modelica", "--speed", "36km/h,50km/h"]);
    assert_eq!(package("several/lead_car_wall_50kmh.mo"), "lead_car_wall_50kmh");
    // Names that differ only in what a name of a file or package cannot hold.
    let add =
        "db add alike.h5 lead50.json --group g --speed 50km/h --mass 24t --kind wall -q --case";
    for case in ["v 10", "v-10", "V_10"] {
        let line: Vec<&str> = add.split(' ').chain([case]).collect();
        crumple_ok(here, &line);
    }
    for (format, names) in [
        ("modelica", &["g_V_10.mo", "g_v_10_2.mo", "g_v_10_3.mo"][..]),
        ("csv", &["g-V_10.csv", "g-v-10-3.csv", "g-v_10-2.csv"]),
        ("mdf", &["V_10", "v-10", "v_10-2"]),
        ("iso-mme", &["V_10", "v-10", "v_10-2"]),
    ] {
        crumple_ok(here, &format!("export alike.h5 --group g --to {format} -o as-{format} -q"));
        assert_eq!(entries(&here.join(format!("as-{format}"))), names, "{format}");
    }
    for name in ["g_V_10", "g_v_10_2", "g_v_10_3"] {
        assert_eq!(package(&format!("as-modelica/{name}.mo")), name);
    }
}

/// Names of groups and cases that are too long for a file are cut, and stay apart.
#[test]
fn long_names_are_cut_for_files() {
    let folder = demo_folder();
    let here = folder.path();
    let (group, case) = ("g".repeat(199), "c".repeat(199));
    fs::write(here.join("legacy.csv"), "d_m,force_N\n0,0\n0.1,2e6\n0.3,1e6\n0.8,3e6\n").unwrap();
    for case in [format!("{case}1"), format!("{case}2")] {
        let add = "db add long.h5 legacy.csv --speed 11m/s --kind wall --mass 24t -q --group";
        crumple_ok(here, &format!("{add} {group} --case {case}"));
    }
    for (to, files) in [("csv", 2), ("modelica", 2), ("fmi2", 2), ("json", 2), ("lsdyna", 1)] {
        let into = here.join(to);
        fs::create_dir(&into).unwrap();
        export(here, "long.h5", to, &["--to", to]);
        let names = entries(&into);
        assert!(names.len() == files && names.iter().all(|n| n.len() < 100), "{to}: {names:?}");
    }
    export(here, "long.h5", "mme", &["--to", "iso-mme"]);
    export(here, "long.h5", "mf4", &["--to", "mdf"]);
}

/// LS-DYNA resamples evenly: that it cannot keep an uneven curve is reported.
#[test]
fn uneven_curves_for_lsdyna_are_noted() {
    let folder = demo_folder();
    let here = folder.path();
    let notes = |more: &[&str]| -> String {
        let arguments =
            [&["export"][..], more, &["--to", "lsdyna", "--json", "-o", "x.k"]].concat();
        crumple_ok(here, &arguments)
    };
    let record = notes(&["curves.h5", "--group", "lead-car-wall", "--case", "48kmh"]);
    says(&record, "its points are unevenly spaced, so LCINT is 20000, the largest used");
    assert!(fs::read_to_string(here.join("x.k")).unwrap().contains("         0     20000\n"));
    assert!(!notes(&["lead50.json"]).contains("LCINT"));
    // The smallest of uneven intervals, 25 mm of 1.2 m, would be 49 points, and cut a fifth off this peak.
    fs::write(
        here.join("peak.csv"),
        "d_m,F_N\n0,0\n0.05,9e5\n0.085,3.2e6\n0.11,1.5e6\n0.5,1.6e6\n1.2,2.5e6\n",
    )
    .unwrap();
    let of = "export peak.csv --speed 50km/h --kind wall --mass 24t --unloading 80MN/m --accept-energy --tail none --units SI -q -o peak.k";
    crumple_ok(here, of);
    assert!(fs::read_to_string(here.join("peak.k")).unwrap().contains("         0       961\n"));
}

/// What OpenRadioss' starter and LS-DYNA demand of a deck.
#[test]
fn decks_suit_their_solvers() {
    let folder = demo_folder();
    let here = folder.path();
    let text = |path: &str| fs::read_to_string(here.join(path)).unwrap();
    for units in ["mm-t-s", "m-kg-s", "cm-g-us", "SI"] {
        let recorded = " --group lead-car-wall --case 48kmh";
        for (input, case) in [("lead50.json", ""), ("curves.h5", recorded)] {
            let to = "--to radioss --deck -q -o deck --units";
            crumple_ok(here, &format!("export {input}{case} {to} {units}"));
            let name = entries(&here.join("deck")).into_iter().find(|n| n.ends_with("_0000.rad"));
            let deck = text(&format!("deck/{}", name.unwrap()));
            fs::remove_dir_all(here.join("deck")).unwrap();
            let ids = deck.lines().filter(|line| line.starts_with("/TH/"));
            let ids: Vec<&str> = ids.filter_map(|line| line.rsplit('/').next()).collect();
            assert_eq!(ids, ["1", "2"], "numbers are unique across types");
            let after = |key: &str| deck.split(key).nth(1).unwrap().lines().skip(1);
            let numbers = |line: &str| -> Vec<f64> {
                line.split_whitespace().map_while(|n| n.parse().ok()).collect()
            };
            let points = after("/FUNCT/").skip(2).map(numbers).take_while(|p| p.len() == 2);
            let points: Vec<Vec<f64>> = points.collect();
            let slopes = points.windows(2).map(|w| (w[1][1] - w[0][1]) / (w[1][0] - w[0][0]));
            let steepest = slopes.fold(0.0, f64::max);
            let k1 = after("#                 K1").next().map(numbers).unwrap()[0];
            assert!(
                points.len() > 100 && (1.0..1.0001).contains(&(k1 / steepest)),
                "{units} {input}: {k1} {steepest}"
            );
        }
    }
    for (material, force) in [("s08", "DEFORC"), ("mat121", "ELOUT")] {
        export(here, "lead50.json", "m.k", &["--deck", "--material", material]);
        assert!(text("m.k").contains(&format!("*DATABASE_{force}\n")), "{material}");
        assert_eq!(text("m.k").contains("*DATABASE_HISTORY_BEAM\n         1\n"), force == "ELOUT");
    }
}

/// Channels of an earlier record stay in a folder that is written anew, and that is said.
#[test]
fn channels_of_an_earlier_record_are_named() {
    let folder = demo_folder();
    let here = folder.path();
    for (command, channels, first) in [
        ("simulate two-sets.toml -o run.mme", "run.mme/Channel", "run.001"),
        (
            "export curves.h5 --group lead-car-wall --case 36kmh --to iso-mme -o case",
            "case/Channel",
            "lead-car-wall-36kmh.001",
        ),
    ] {
        let said = |command| String::from_utf8(crumple_in(here, command).stderr).unwrap();
        crumple_ok(here, command);
        assert!(!said(command).contains("not written now"));
        let channels = here.join(channels);
        fs::copy(channels.join(first), channels.join(first.replace(".001", ".099"))).unwrap();
        says(&said(command), "Channel: holds 1 file that was not written now: remove");
    }
}

/// pyisomme reads the channels of a case, and those of a multi-body run.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn pyisomme_reads_the_channels() {
    let folder = demo_folder();
    let here = folder.path();
    let case = ["--group", "lead-car-wall", "--case", "36kmh", "--to", "iso-mme"];
    export(here, "curves.h5", "case", &case);
    crumple_ok(here, "simulate two-sets.toml -q -o run.mme");
    let read = |path: &str| {
        let path = here.join(path).display().to_string();
        run_python(python_of("CRUMPLE_PYTHON_ISOMME"), "exports_iso_mme.py", &[&path])
    };
    let case = read("case/lead-car-wall-36kmh.mme");
    let shown = crumple_ok(here, "db show curves.h5 --group lead-car-wall --case 36kmh --json");
    let shown: Value = serde_json::from_str(&shown).unwrap();
    let shown = &shown["groups"]["lead-car-wall"][0];
    for (code, key) in [
        ("11VEHC000000DSXP", "deflection_m"),
        ("11VEHC000000VEXP", "closing_speed_m_per_s"),
        ("11VEHC000000FOXP", "force_N"),
    ] {
        same_columns(&case[code], &shown[key]);
    }
    let run = read("run.mme/run.mme");
    let csv = crumple_ok(here, "simulate two-sets.toml -q -o -");
    let mut lines = csv.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let rows: Vec<Vec<f64>> =
        lines.map(|l| l.split(',').map(|n| n.parse().unwrap()).collect()).collect();
    let first = header.iter().position(|h| h.starts_with("v_m_per_s")).unwrap();
    let speeds: Vec<f64> = rows.iter().map(|row| row[first]).collect();
    same_columns(&run["11VEHCCG0000VEXP"], &json!(speeds));
}

fn same_columns(a: &Value, b: &Value) {
    let values = |v: &Value| -> Vec<f64> { serde_json::from_value(v.clone()).unwrap() };
    let (a, b) = (values(a), values(b));
    assert_eq!(a.len(), b.len());
    let largest = b.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for (a, b) in a.iter().zip(&b) {
        assert!((a - b).abs() <= 1e-8 * largest, "{a} and {b}");
    }
}

/// h5py and pandas-like readers get the table over speed and deflection.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn h5py_reads_the_table_of_a_model() {
    let folder = demo_folder();
    let here = folder.path();
    // The vehicle pair has the shortest crush beside the longest.
    let curves: Vec<String> = ["3km/h", "6km/h", "25km/h", "72km/h"]
        .iter()
        .map(|v| crumple_ok(here, &["predict", "vehicle.model", "--speed", v, "--json"]))
        .collect();
    fs::write(here.join("curves.json"), format!("[{}]", curves.join(","))).unwrap();
    export(here, "vehicle.model", "table.h5", &["--to", "table"]);
    export(here, "lead.model", "table.csv", &["--to", "table", "--speed", "36km/h,50km/h"]);
    export(here, "vehicle.model", "contact.h5", &["--to", "table", "--force", "contact"]);
    let files = ["table.h5", "table.csv", "curves.json", "contact.h5"];
    let arguments = files.map(|f| here.join(f).display().to_string());
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let found = run_python(python(), "exports_table.py", &arguments);
    // At 50 km/h, the curve that predict gives.
    let curve = read_json(&here.join("lead50.json"));
    let column = |key: &str| -> Vec<f64> { serde_json::from_value(curve[key].clone()).unwrap() };
    let envelope =
        crumple::curve::Envelope::new(column("deflection_m"), column("body_force_N")).unwrap();
    let (d, f): (Vec<f64>, Vec<f64>) = serde_json::from_value(found["at_50kmh"].clone()).unwrap();
    for (d, f) in d.iter().zip(&f).filter(|p| *p.0 < envelope.end_m()) {
        let off = (f - envelope.force_at(*d)).abs() / envelope.peak_force_n();
        assert!(off < 2e-3, "at {d} m: {off}");
    }
    let worst = found["worst_energy"].as_f64().unwrap();
    assert!(worst < 1e-3, "energy of a speed's row to its maximum crush is off by {worst}");
    assert!(found["speeds"].as_u64().unwrap() >= 25);
    assert_eq!(found["shape"], json!([found["speeds"], found["deflections"]]));
    assert_eq!(found["compared_bands"], 8, "four speeds, two forces: {found}");
    assert!(found["worst_band"].as_f64().unwrap() < 5e-3, "{found}");
}

/// What our own readers have of what we write: the same bits, or the format's nine digits.
#[test]
fn our_readers_give_back_what_was_exported() {
    let folder = demo_folder();
    let here = folder.path();
    let text = fs::read_to_string(here.join("lead50.json")).unwrap();
    let curve: Value = serde_json::from_str(&text).unwrap();
    let column = |key: &str| -> Vec<f64> { serde_json::from_value(curve[key].clone()).unwrap() };
    let (d, f) = (column("deflection_m"), column("body_force_N"));
    for (file, bound) in
        [("a.csv", 5e-9), ("a.k", 5e-9), ("a.txt", 5e-9), ("a.rad", 5e-9), ("a.mat", 0.0)]
    {
        for tail in ["none", "bottom"] {
            export(here, "lead50.json", file, &["--tail", tail]);
            let units = UnitSystem::parse("SI").unwrap();
            // Decks say their own.
            let units = (!["a.k", "a.rad"].contains(&file)).then_some(units);
            let options = ReadOptions { units, ..ReadOptions::default() };
            let (read, _) = read(&here.join(file), &options).unwrap();
            let close = |a: f64, b: f64| (a - b).abs() <= bound * b.abs();
            assert_eq!(read.deflection_m.len(), d.len(), "{file} {tail}: {:?}", read.notes);
            for i in 0..d.len() {
                assert!(close(read.deflection_m[i], d[i]), "{file} {tail} point {i}");
                assert!(close(read.force_n[i], f[i]), "{file} {tail} point {i}");
            }
        }
    }
}

/// The straight line that stands for a curve's unloading is not taken for its own stiffness; one that was changed by hand is.
#[test]
fn a_line_does_not_replace_the_stiffness() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let facts = "# force_kind: body\n# speed_kind: wall\n# speed_m_per_s: 10\n# mass_kg: 6440\n# unloading_stiffness_N_per_m: 7e6\n";
    let table = format!("{facts}d_m,force_N\n0,0\n0.3,1.2e6\n0.37,1.4e6\n0.4,2.0e6\n");
    fs::write(here.join("0.csv"), table).unwrap();
    for (format, extension) in
        [("mat", "mat"), ("lsdyna --material mat121", "k"), ("lsdyna --material s06", "k")]
    {
        crumple_ok(here, &format!("export 0.csv --to {format} -o 1.{extension} -q"));
        let of = if extension == "k" { "1.k --curve 101" } else { "1.mat" };
        let again = format!("export {of} --to {format} -o 2.{extension} -q");
        crumple_ok(here, &again);
        for file in ["1", "2"] {
            let file = here.join(format!("{file}.{extension}"));
            let curve = (extension == "k").then(|| "101".into());
            let (read, _) = read(&file, &ReadOptions { curve, ..ReadOptions::default() }).unwrap();
            let found = read.facts.unloading_stiffness_n_per_m.unwrap();
            assert!((found / 7e6 - 1.0).abs() < 1e-8, "{format}: {found}");
            let text = String::from_utf8_lossy(&fs::read(&file).unwrap()).replace('\0', "");
            assert!(extension == "mat" || text.contains("line_stiffness_N_per_m: "), "{text}");
        }
    }
    let mut bytes = fs::read(here.join("1.mat")).unwrap();
    let at = bytes.windows(4).position(|w| w == b"k_u\0").unwrap() + 4;
    bytes[at..at + 8].copy_from_slice(&9e6_f64.to_le_bytes());
    fs::write(here.join("3.mat"), bytes).unwrap();
    let (read, _) = read(&here.join("3.mat"), &ReadOptions::default()).unwrap();
    assert_eq!(read.facts.unloading_stiffness_n_per_m, Some(9e6));
}

/// A force that has fallen to 0 keeps the stiffness that was given for it; points that nine digits cannot tell from one another are
/// set apart; and what fewer points change is in file and note.
#[test]
fn what_is_given_reaches_the_files() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let table = |name: &str, force: &dyn Fn(f64) -> f64| {
        let row = |i: u32| format!("{},{}\n", f64::from(i) / 2e3, force(f64::from(i) / 2e3));
        let rows: String = (0..=2000).map(row).collect();
        fs::write(here.join(name), format!("d_m,F_N\n{rows}")).unwrap();
    };
    let of = "--speed 50km/h --kind wall --mass 24t --unloading 150MN/m --accept-energy --units SI";
    table("sine.csv", &|d| (3e6 * (std::f64::consts::PI * d).sin()).max(0.0));
    let said = export_notes(
        here,
        "sine.csv",
        &[&of.split(' ').collect::<Vec<_>>()[..], &["-o", "a.k"]].concat(),
    );
    says(&said, "unloading: a line of 150.0 MN/m from the maximum deflection");
    let deck = fs::read_to_string(here.join("a.k")).unwrap();
    says(&deck, "$ unloading_stiffness_N_per_m: 1.50000000E+08\n");
    // As waves of 8 mm are for 200 points.
    table("rough.csv", &|d| 3e6 * (d / 0.05).min(1.0) * (1.0 + 0.2 * (800.0 * d).sin()));
    for output in ["a.inp", "a.mo"] {
        let args = [&of.split(' ').collect::<Vec<_>>()[..], &["-o", output]].concat();
        let args: Vec<&str> = args
            .into_iter()
            .filter(|a| output == "a.inp" || !["--units", "SI"].contains(a))
            .collect();
        let said = export_notes(here, "rough.csv", &args);
        let changed = |text: &str| {
            let share = text.split("where forces change by up to ").nth(1)?;
            share.split(' ').next()?.parse::<f64>().ok()
        };
        let share = changed(&said).unwrap();
        assert!((5.0..30.0).contains(&share), "{output}: {said}");
        let text = fs::read_to_string(here.join(output)).unwrap();
        assert_eq!(changed(&text), Some(share), "{output}");
    }
}

/// Tools refuse equal abscissas: of points a hair apart, of those that fence kinks for splines, and where a curve begins at the origin.
#[test]
fn no_two_points_have_one_abscissa() {
    let folder = demo_folder();
    let here = folder.path();
    let mut near =
        serde_json::from_str::<Value>(&fs::read_to_string(here.join("lead50.json")).unwrap())
            .unwrap();
    near["deflection_m"][201] = json!(near["deflection_m"][200].as_f64().unwrap() * (1.0 + 1e-12));
    fs::write(here.join("near.json"), near.to_string()).unwrap();
    fs::write(here.join("coarse.csv"), "d_m,F_N\n0,0\n0.2,1e6\n0.4,1.5e6\n0.6,2e6\n").unwrap();
    fs::write(here.join("tube.csv"), "d_m,F_N\n0,3e6\n0.03,3e6\n0.3,3e6\n0.5,3.6e6\n").unwrap();
    let impact = "--kind wall --mass 24t --accept-energy";
    for (curve, of) in [
        ("near.json", "--tail bottom".into()),
        ("coarse.csv", format!("--speed 30km/h {impact} --unloading 80MN/m --tail hold")),
        ("tube.csv", format!("--speed 50km/h {impact} --unloading 100MN/m")),
    ] {
        for file in ["a.rad", "a.k", "a.csv", "a.cmd", "a.adm", "a.spr", "a.inp", "a.txt"] {
            crumple_ok(here, &format!("export {curve} {of} -q --overwrite -o {file}"));
            let text = fs::read_to_string(here.join(file)).unwrap();
            let is_spline = ["a.cmd", "a.adm"].contains(&file);
            let number = |word: &str| word.parse::<f64>().ok();
            let abscissas: Vec<f64> = if is_spline {
                let text = text.to_lowercase();
                let x = text.split("x=").nth(1).unwrap().split("y=").next().unwrap();
                x.split([',', ' ', '&', '\n']).filter_map(number).collect()
            } else {
                let pair = |line: &str| {
                    let of: Option<Vec<f64>> =
                        line.split([' ', ',']).filter(|w| !w.is_empty()).map(number).collect();
                    of.filter(|of| of.len() >= 2 && line.contains('E'))
                        .map(|of| of[usize::from(file == "a.inp")])
                };
                text.lines().filter_map(pair).collect()
            };
            assert!(abscissas.len() > 3, "{curve} {file}: {text}");
            assert!(abscissas.windows(2).all(|w| w[0] != w[1]), "{curve} {file}");
        }
    }
}

/// A peak in the last micrometres of a record's crush is exported; what is no peak there makes no stiffness.
#[test]
fn a_peak_where_the_body_turns_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    // 24 t from 10 m/s by 2 MN: 0.6 m in 120 ms.
    let rows = |peak_n: f64| -> String {
        let row = |i: u32| {
            let t = f64::from(i) * 5e-4;
            let [d, f] = match t {
                t if t < 0.1201 => {
                    [10.0 * t - 0.5 * t * t * 1e3 / 12.0, if i == 238 { peak_n } else { 2e6 }]
                }
                t => [0.6 - 0.2 * (t - 0.12), 0.0],
            };
            format!("{t},{d},{f}\n")
        };
        (0..=300).map(row).collect()
    };
    for (name, peak_n, expected_n) in [("peak", 3.2e6, 3.2e6), ("dip", 1.2e6, 2e6)] {
        let file = here.join(format!("{name}.csv"));
        fs::write(file, format!("t_s,d_m,F_N\n{}", rows(peak_n))).unwrap();
        let add = format!(
            "db add {name}.h5 {name}.csv --group g --speed 10m/s --kind wall --mass 24t --force contact -q"
        );
        crumple_ok(here, &add);
        crumple_ok(here, &format!("export {name}.h5 --group g --force contact -q -o {name}.json"));
        let curve: Value =
            serde_json::from_str(&fs::read_to_string(here.join(format!("{name}.json"))).unwrap())
                .unwrap();
        let force: Vec<f64> = serde_json::from_value(curve["force_N"].clone()).unwrap();
        let most = force.iter().copied().fold(0.0, f64::max);
        assert!((most / expected_n - 1.0).abs() < 1e-3, "{name}: {most}");
        let last = force.iter().rev().take(4).copied().fold(f64::INFINITY, f64::min);
        assert!(last > 1.9e6, "{name}: {last}");
    }
}

/// What a format cannot take is refused with its reason, in every format that takes curves.
#[test]
fn odd_curves_are_refused_by_every_format() {
    let folder = demo_folder();
    let here = folder.path();
    let good = [(0.0, 0.0), (0.1, 1e6), (0.2, 1.2e6), (0.3, 1e6), (0.4, 1e6)];
    let change = |at: usize, point: (f64, f64)| {
        let mut points = good.to_vec();
        points[at] = point;
        points
    };
    let cases = [
        (change(2, (0.2, -1e6)), "the force of point 3 is below 0"),
        (
            change(2, (0.05, 1e6)),
            "the deflection must increase, found 0.05 m after 0.1 m at point 3",
        ),
        (good[..3].to_vec(), "takes 4 points or more, found 3"),
        (change(0, (0.1, 0.0)), "the deflection must begin at 0"),
    ];
    for (points, expected) in &cases {
        with_points(here, "odd.json", points);
        for format in FORMATS.iter().filter(|f| !f.takes_model() && !f.takes_case()) {
            let output =
                crumple_in(here, &["export", "odd.json", "--to", format.name, "-o", "odd.out"]);
            let error = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(1), "{}: {error}", format.name);
            let says = error.contains(expected) || error.contains("is below 0");
            assert!(says, "{} does not say {expected}: {error}", format.name);
            assert!(!here.join("odd.out").exists());
        }
    }
    // JSON has no NaN: its reader says so with the place.
    let text = fs::read_to_string(here.join("lead50.json")).unwrap();
    fs::write(
        here.join("nan.json"),
        text.replacen("\"force_N\": [\n    0.0", "\"force_N\": [\n    NaN", 1),
    )
    .unwrap();
    let error = crumple_fails(here, 1, "export nan.json --to csv");
    assert!(error.contains("nan.json") && error.contains("line"), "{error}");
}

/// Names of groups become titles, identifiers and file names that targets read.
#[test]
fn odd_titles_are_handled_by_every_format() {
    let folder = demo_folder();
    let here = folder.path();
    let text = fs::read_to_string(here.join("lead50.json")).unwrap();
    let mut curve: Value = serde_json::from_str(&text).unwrap();
    for (i, name) in [
        "x".repeat(200),
        "Führerstand, vorn".into(),
        "$ $*lead".into(),
        "a\"b\\c<&>\u{7}\nd".into(),
    ]
    .iter()
    .enumerate()
    {
        curve["provenance"]["group"] = json!(name);
        fs::write(here.join("odd.json"), curve.to_string()).unwrap();
        for format in FORMATS.iter().filter(|f| !f.takes_model() && !f.takes_case()) {
            let output = format!("odd{i}.{}", format.extensions[0]);
            export(here, "odd.json", &output, &["--to", format.name]);
            let bytes = fs::read(here.join(&output)).unwrap();
            let Ok(text) = String::from_utf8(bytes) else { continue };
            for (n, line) in text.lines().enumerate() {
                let is_control = |c: char| c.is_control() && c != '\t';
                assert!(!line.contains(is_control), "{output} line {n}: {line:?}");
            }
        }
        let deck = fs::read_to_string(here.join(format!("odd{i}.k"))).unwrap();
        let title = deck.lines().skip_while(|l| *l != "*DEFINE_CURVE_TITLE").nth(1).unwrap();
        assert!(title.is_ascii() && title.len() <= 80 && !title.contains(','), "{title}");
        assert!(!title.starts_with(['$', '*']), "{title}");
    }
}

/// Facts that no impact has are refused when a curve is read.
#[test]
fn impossible_facts_are_refused() {
    let folder = demo_folder();
    let here = folder.path();
    let text = fs::read_to_string(here.join("lead50.json")).unwrap();
    for (key, value) in [
        ("speed_m_per_s", 0.0),
        ("mass_kg", -1.0),
        ("unloading_stiffness_N_per_m", 0.0),
        ("body_unloading_stiffness_N_per_m", -5.0),
        ("max_deflection_m", 2.0),
    ] {
        let mut curve: Value = serde_json::from_str(&text).unwrap();
        curve[key] = json!(value);
        fs::write(here.join("odd.json"), curve.to_string()).unwrap();
        let error = crumple_fails(here, 1, "export odd.json --to fmi2 -o odd.fmu");
        assert!(error.contains(&format!("{key} is")), "{key}: {error}");
    }
}

/// A force at contact keeps its energy where a target needs the origin.
#[test]
fn a_force_at_contact_keeps_its_energy() {
    let folder = demo_folder();
    let here = folder.path();
    let points: Vec<(f64, f64)> = (0..6).map(|i| (0.18 * f64::from(i), 2.47e6)).collect();
    with_points(here, "constant.json", &points);
    export(here, "constant.json", "a.k", &["--tail", "none"]);
    let (read, _) = read(&here.join("a.k"), &ReadOptions::default()).unwrap();
    assert_eq!((read.deflection_m[0], read.force_n[0]), (0.0, 0.0));
    let energy = crumple::curve::Envelope::new(read.deflection_m, read.force_n).unwrap().work();
    assert!((energy / (0.9 * 2.47e6) - 1.0).abs() < 1e-3, "{energy}");
}

/// A constant force: a target that unloads with the steepest rise reaches it on the line of the unloading, which is said; for one that returns
/// all energy the line is steep.
#[test]
fn what_a_rise_from_the_origin_changes_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    fs::write(here.join("tube.csv"), "d_m,F_N\n0,3e5\n0.1,3e5\n0.2,3e5\n0.4,3e5\n").unwrap();
    let of = "tube.csv --speed 10m/s --kind wall --mass 2.4t --unloading 10MN/m --tail none";
    for (output, raised) in
        [("a.k", 0.039), ("a.rad", 0.039), ("a.mat", 0.0), ("a.cmd", 0.0), ("a.inp", 0.0)]
    {
        let args = format!("export {of} -o {output} -v --units SI");
        let args = if output == "a.mat" { args.replace(" --units SI", "") } else { args };
        let said = String::from_utf8(crumple_in(here, &args).stderr).unwrap();
        let is_said = said.contains("the force begins with 0.300 MN, which the file reaches on a line of 10.4 MN/m from the origin; its forces are 3.9 % larger");
        assert_eq!(is_said, raised > 0.0, "{output}: {said}");
        assert_eq!(said.contains("the force begins with"), is_said, "{output}: {said}");
        let file = String::from_utf8_lossy(&fs::read(here.join(output)).unwrap()).into_owned();
        assert_eq!(file.contains("changed: the force begins with 0.300 MN"), is_said, "{output}");
        if ["a.cmd", "a.inp"].contains(&output) {
            continue;
        }
        let (read, _) = read(&here.join(output), &ReadOptions::default()).unwrap();
        let read = crumple::curve::Envelope::new(read.deflection_m, read.force_n).unwrap();
        assert!(
            (read.force_at(0.2) / 3e5 - 1.0 - raised).abs() < 1.5e-3,
            "{output}: {}",
            read.force_at(0.2)
        );
        assert!((read.work_to(0.4) / 1.2e5 - 1.0).abs() < 2e-3, "{output}");
    }
}

/// A recorded curve that begins with a force, as of crushed honeycomb, keeps it: in files that can begin so as it is, in others
/// with its energy.
#[test]
fn a_recorded_force_at_contact_is_exported() {
    let folder = demo_folder();
    let here = folder.path();
    let points = [(0.0, 1000.0), (400.0, 1000.0), (401.0, 1200.0), (600.0, 1200.0)];
    let rows: Vec<String> = points.iter().map(|(d, f)| format!("{d},{f}\n")).collect();
    fs::write(here.join("honey.csv"), format!("d_mm,F_kN\n{}", rows.concat())).unwrap();
    let of = "--speed 6.531m/s --kind wall --mass 30t --unloading 80MN/m";
    crumple_ok(here, &format!("db add honey.h5 honey.csv --group g {of}"));
    let work_j = 0.4 * 1e6 + 0.001 * 1.1e6 + 0.199 * 1.2e6;
    let begins = |text: &str| {
        let mut rows = text.lines().skip_while(|line| !line.starts_with("d_")).skip(1);
        rows.next().unwrap().split_once(',').unwrap().1.parse::<f64>().unwrap()
    };
    for (k, input) in ["honey.csv", "honey.h5"].into_iter().enumerate() {
        let asked: Vec<&str> = if k == 0 { of.split(' ').collect() } else { Vec::new() };
        for output in ["a.csv", "a.json", "a.k", "a.rad", "a.txt", "a.mo", "a.mat"] {
            let more: &[&str] = match output {
                "a.json" => &[],
                "a.rad" => &["--units", "SI", "--tail", "none"],
                _ => &["--tail", "none"],
            };
            export(here, input, output, &[&asked[..], more].concat());
            let (read, _) = read(&here.join(output), &ReadOptions::default()).unwrap();
            let read = crumple::curve::Envelope::new(read.deflection_m, read.force_n).unwrap();
            let off = read.work() / work_j - 1.0;
            assert!(off.abs() < 1e-3, "{input} as {output}: {off}");
        }
        assert_eq!(begins(&fs::read_to_string(here.join("a.csv")).unwrap()), 1e6);
    }
    // What unloads with the steepest rise rebounds all the same.
    for case in ["36kmh", "48kmh", "60kmh"] {
        let of = ["--group", "lead-car-wall", "--case", case, "--force", "contact"];
        let notes = export_notes(here, "curves.h5", &[&of[..], &["-o", "case.k"]].concat());
        let said = notes.split("restitution ").nth(1).unwrap();
        let (theirs, rest) = said.split_once(" in LS-DYNA").unwrap();
        let ours = rest.split_once("), ").unwrap().1.split_once(' ').unwrap().0;
        let [theirs, ours] = [theirs, ours].map(|number| number.parse::<f64>().unwrap());
        assert!((theirs / ours - 1.0).abs() < 0.03, "{case}: {notes}");
    }
    // Crumple's own run of the export is that of the curve.
    let run = |file: &str| {
        let text = format!(
            "[run]\nduration = \"200ms\"\noutput_interval = \"0.75ms\"\n[curves]\nn = {{ file = \"{file}\", unloading = \"80MN/m\", force = \"body\" }}\n[[train]]\nname = \"A\"\nspeed = \"6m/s\"\nvehicles = [ {{ name = \"A1\", mass = \"30t\" }} ]\n[wall]\n[contact]\ncurve = \"n\"\n"
        );
        fs::write(here.join("s.toml"), text).unwrap();
        let run: Value =
            serde_json::from_str(&crumple_ok(here, "simulate s.toml --json -q")).unwrap();
        run["summary"]["interfaces"][0]["max_deflection_m"].as_f64().unwrap()
    };
    let (own, exported) = (run("honey.csv"), run("a.csv"));
    assert!((exported / own - 1.0).abs() < 1e-3, "{exported} m for {own} m");
}

/// An export says which mass and which parameters it is for.
#[test]
fn exports_state_their_conditions() {
    let folder = demo_folder();
    let here = folder.path();
    for output in ["t.csv", "c.csv"] {
        let to = if output == "t.csv" { "table" } else { "csv" };
        let asked = ["--mass", "48t", "--speed", "50km/h", "--to", to];
        export(here, "lead.model", output, &asked);
        let text = fs::read_to_string(here.join(output)).unwrap();
        says(&text, "\n# mass_kg: 48000\n");
        assert_eq!(text.matches("mass_kg").count(), 1, "{output}");
    }
    let text = fs::read_to_string(here.join("fe/lead-car-wall/study.toml")).unwrap();
    let mut runs = 0;
    let text: Vec<String> = text
        .lines()
        .map(|line| {
            let of_run = line.starts_with("path ");
            runs += usize::from(of_run);
            let obstacle = ["post", "wall"][runs % 2];
            let given =
                format!("\nparameters = {{ angle_deg = {runs}, obstacle = \"{obstacle}\" }}");
            format!("{line}{}\n", if of_run { &given } else { "" })
        })
        .collect();
    fs::write(here.join("fe/lead-car-wall/angles.toml"), text.concat()).unwrap();
    crumple_ok(here, "build fe/lead-car-wall/angles.toml -o angles.h5 -q");
    crumple_ok(here, "train angles.h5 --group lead-car-wall --model forest -o angles.model -q");
    let given = ["--parameter", "angle_deg=2.5", "--parameter", "obstacle=post"];
    for to in ["table", "csv"] {
        export(
            here,
            "angles.model",
            "o.csv",
            &[&["--speed", "30km/h", "--to", to], &given[..]].concat(),
        );
        let text = fs::read_to_string(here.join("o.csv")).unwrap();
        says(&text, "\n# parameters: angle_deg = 2.5, obstacle = post\n");
    }
}

/// A table of force over deflection comes out of a database as it went in, also as the force that moves a body: its
/// motion was made of it.
#[test]
fn an_imported_curve_is_exported_as_it_was() {
    let folder = demo_folder();
    let here = folder.path();
    let rows: Vec<String> =
        spike(61).iter().map(|(d, f)| format!("{},{}", d * 1e3, f / 1e3)).collect();
    fs::write(
        here.join("legacy.csv"),
        format!("displacement [mm],Force [kN]\n{}\n", rows.join("\n")),
    )
    .unwrap();
    crumple_ok(here, "db add legacy.h5 legacy.csv --group g --speed 11m/s --kind wall --mass 24t");
    export(here, "legacy.h5", "back.csv", &["--tail", "none"]);
    let text = fs::read_to_string(here.join("back.csv")).unwrap();
    assert!(!text.contains("# filter:"), "its force is the file's: {}", &text[..800]);
    let units = UnitSystem::parse("SI").ok();
    let (back, _) =
        read(&here.join("back.csv"), &ReadOptions { units, ..ReadOptions::default() }).unwrap();
    let back = crumple::curve::Envelope::new(back.deflection_m, back.force_n).unwrap();
    for (d, f) in spike(61) {
        assert!(
            (back.force_at(d) - f).abs() < 1e-3 * 6e6,
            "at {d} m: {} for {f}",
            back.force_at(d)
        );
    }
}

/// What the command line says of an imported curve wins, and the differences from the file are named; a pair keeps its
/// other mass on the way out and in.
#[test]
fn what_is_said_of_an_import_and_what_its_file_says() {
    let folder = demo_folder();
    let here = folder.path();
    export(here, "vehicle.model", "pair.csv", &["--speed", "36km/h", "--tail", "none"]);
    let text = fs::read_to_string(here.join("pair.csv")).unwrap();
    assert!(text.contains("# other_mass_kg: 20240"));
    fs::write(
        here.join("uneven.csv"),
        text.replace("# other_mass_kg: 20240", "# other_mass_kg: 22000"),
    )
    .unwrap();
    let add = |file: &str, group: &str, more: &[&str]| -> Value {
        let arguments =
            [&["db", "add", "said.h5", file, "--group", group, "--json"][..], more].concat();
        serde_json::from_str(&crumple_ok(here, &arguments)).unwrap()
    };
    let added = add("uneven.csv", "pair", &[]).to_string();
    let shown = crumple_ok(here, "db ls said.h5 --json");
    assert!(shown.contains("\"other_mass_kg\": 22000.0"), "{added} {shown}");
    says(&crumple_ok(here, "db ls said.h5"), "20.24 t on 22.00 t");
    let said =
        add("pair.csv", "wall", &["--kind", "wall", "--unloading", "30MN/m", "--accept-energy"]);
    let said = said.to_string();
    says(&said, "the file states closing; wall is used");
    says(&said, "unloading stiffness: the file states");
}

/// A whole group goes into one file or one folder; a model gives any speeds.
#[test]
fn groups_and_several_speeds_are_exported_at_once() {
    let folder = demo_folder();
    let here = folder.path();
    export(here, "curves.h5", "wall.k", &["--group", "lead-car-wall"]);
    let deck = fs::read_to_string(here.join("wall.k")).unwrap();
    assert_eq!(deck.matches("*DEFINE_CURVE_TITLE").count(), 7);
    export(here, "curves.h5", "wall", &["--group", "lead-car-wall", "--to", "csv"]);
    assert_eq!(entries(&here.join("wall")).len(), 7);
    export(here, "lead.model", "fmus", &["--speed", "36km/h,50km/h", "--to", "fmi2"]);
    assert_eq!(
        entries(&here.join("fmus")),
        ["lead-car-wall-36kmh-fmi2.fmu", "lead-car-wall-50kmh-fmi2.fmu"]
    );
    // A case and a prediction have the same keys.
    export(here, "curves.h5", "case.json", &["--group", "lead-car-wall", "--case", "36kmh"]);
    let case = read_json(&here.join("case.json"));
    // The same by its whole name, which needs no group; a name that two groups have is not one.
    export(here, "curves.h5", "whole.json", &["--case", "lead-car-wall/36kmh"]);
    assert_eq!(read_json(&here.join("whole.json")), case);
    for key in ["deflection_m", "force_N", "unloading_stiffness_N_per_m", "provenance", "energy_J"]
    {
        assert!(!case[key].is_null(), "{key}");
    }
    // The body force of a run is exported as it moved the body, and the file says so; others are smooth.
    for (source, force, says) in [
        ("case.json", &[][..], true),
        ("case.json", &["--force", "contact"], false),
        ("lead50.json", &[], false),
    ] {
        export(here, source, "facts.csv", force);
        let head = fs::read_to_string(here.join("facts.csv")).unwrap();
        assert_eq!(
            head.contains("filter: none beyond the recipe's"),
            says,
            "{source} {force:?}\n{}",
            &head[..800]
        );
    }
    let t = |code: i32, arguments: &[&str], expected: &str| {
        let error = crumple_fails(here, code, arguments);
        assert!(error.contains(expected), "{arguments:?} said:\n{error}");
    };
    #[rustfmt::skip]
    let cases = [
        (2, &["export", "lead.model", "--to", "csv"][..], "name the speeds of the model's curves with --speed"),
        (2, &["export", "curves.h5", "--group", "lead-car-wall", "--to", "csv", "-o", "all.csv"][..], "this export gives 7 files: name a folder"),
        (2, &["export", "curves.h5", "--group", "lead-car-wall", "--to", "csv"][..], "gives 7 files"),
        (2, &["export", "curves.h5", "--group", "lead-car-wall", "--speed", "37km/h", "--to", "csv"][..], "has no case at 37 km/h: it has 12 km/h"),
        (2, &["export", "curves.h5", "--case", "lead-car-wall/36kmh", "--speed", "12km/h", "--to", "csv"][..], "none of the cases of --case is at 12 km/h: they are at 36 km/h"),
        (1, &["export", "curves.h5", "--group", "lead-car-wall", "--case", "36kmmh", "--to", "csv"][..], "; did you mean \"36kmh\"?"),
        (1, &["export", "curves.h5", "--case", "36kmh", "--to", "csv"][..], "several groups have a case \"36kmh\": choose one with --group, or write lead-car-pair/36kmh or lead-car-wall/36kmh"),
        (2, &["export", "lead50.json", "--to", "csv", "--speed", "50km/h"][..], "has one speed and mass"),
        (2, &["export", "lead50.json", "--to", "mat", "--units", UNITS][..], "mat is always in SI"),
        (1, &["export", "lead.model", "--speed", "36km/h,50km/h", "--to", "lsdyna", "--deck"][..], "one curve"),
        (2, &["export", "lead50.json", "--to", "iso-mme"][..], "iso-mme takes histories over time"),
        (2, &["export", "lead50.json", "--to", "table"][..], "table is made of a whole model"),
        (1, &["export", "lead.model", "--speed", "36km/h,50km/h", "--to", "csv", "-o", "lead50.json"][..], "lead50.json is a file, not a folder: name another"),
    ];
    cases.into_iter().for_each(|(code, arguments, expected)| t(code, arguments, expected));
    // What a format has no use for is refused.
    #[rustfmt::skip]
    let cases = [
        (&["export", "lead50.json", "--to", "csv", "--deck"][..], "--deck is for lsdyna, radioss, calculix"),
        (&["export", "lead50.json", "--to", "mat", "--material", "s06"][..], "--material is for lsdyna"),
        (&["export", "lead50.json", "--to", "json", "--tail", "hold"][..], "--tail is for csv, lsdyna, radioss, calculix, adams, fmi2, fmi3, modelica, mat, table"),
        (&["export", "lead.model", "--to", "table", "--soften"][..], "--soften is for csv, lsdyna, radioss, calculix, adams, fmi2, fmi3, modelica, mat\n"),
        (&["export", "lead.model", "--to", "onnx", "--speed", "50km/h"][..], "holds a whole model: remove --speed"),
        (&["export", "lead.model", "--to", "table", "--group", "x"][..], "a model has only one group"),
        (&["export", "curves.h5", "--group", "lead-car-wall", "-o", "all.spr"][..], "name a folder, as with -o all --to spr"),
    ];
    cases.into_iter().for_each(|(arguments, expected)| t(2, arguments, expected));
    export(here, "curves.h5", "sprs", &["--group", "lead-car-wall", "--to", "spr"]);
    assert!(entries(&here.join("sprs")).iter().all(|name| name.ends_with(".spr")));
    // Two curves of one speed keep apart, in their files and in the names within.
    export(here, "lead.model", "twice.cmd", &["--speed", "36km/h,36km/h"]);
    let twice = fs::read_to_string(here.join("twice.cmd")).unwrap();
    assert!(twice.contains("lead_car_wall_36kmh ") && twice.contains("lead_car_wall_36kmh_2 "));
}

/// Of a format with several kinds of file, `--to` decides, then the file's extension, and what is usual otherwise.
#[test]
fn the_kind_of_file_is_that_of_to_before_that_of_the_name() {
    let folder = demo_folder();
    let here = folder.path();
    for (input, to, file, head) in [
        ("lead50.json", "spr", "spring.dat", "$ units"),
        ("lead50.json", "spr", "a.cmd", "$ units"),
        ("lead50.json", "adams", "B.SPR", "$ units"),
        ("lead50.json", "adams", "b.adm", "! units"),
        ("lead50.json", "txt", "d.mo", "#1"),
        ("lead50.json", "mo", "c.txt", "// curve"),
        ("lead.model", "hdf5", "tab.csv", "\u{fffd}HDF"),
        ("lead.model", "table", "x.CSV", "#"),
    ] {
        export(here, input, file, &["--to", to]);
        let bytes = fs::read(here.join(file)).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.starts_with(head), "{to} {file}: {}", &text[..20]);
    }
    export(here, "lead.model", "run.v2", &["--to", "spr", "--speed", "36km/h,50km/h"]);
    let names = entries(&here.join("run.v2"));
    assert!(names.len() == 2 && names.iter().all(|name| name.ends_with(".spr")), "{names:?}");
    let said = export_notes(here, "lead50.json", &["--to", "adams", "-o", "spring.x"]);
    says(&said, ".x is written as an Adams View command file (.cmd)");
}

/// The command says the restitution that the target's unloading gives beside ours, and softens on request.
#[test]
fn the_targets_rebound_is_said() {
    let folder = demo_folder();
    let here = folder.path();
    let notes = |more: &[&str]| -> Vec<String> {
        let arguments = [&["export", "lead50.json", "--json", "-o", "x.k"][..], more].concat();
        let said: Value = serde_json::from_str(&crumple_ok(here, &arguments)).unwrap();
        serde_json::from_value(said["notes"].clone()).unwrap()
    };
    let restitutions = |note: &str| -> Vec<f64> {
        let numbers = note.split([' ', ',', '(']).filter_map(|w| w.parse::<f64>().ok());
        numbers.filter(|n| *n < 1.0 && *n > 0.0).collect()
    };
    // S08 is bound to the steepest rise, which the contact force has at its first rise.
    let hard = notes(&["--force", "contact"]);
    let [theirs, ours] = restitutions(&hard[0])[..] else { panic!("{hard:?}") };
    assert!(theirs < 0.7 * ours, "{hard:?}");
    assert!(hard[1].contains("--soften"), "{hard:?}");
    let soft = notes(&["--force", "contact", "--soften"]);
    let [theirs, ours] = restitutions(&soft[0])[..] else { panic!("{soft:?}") };
    assert!((theirs / ours - 1.0).abs() < 0.01, "{soft:?}");
    let own = notes(&["--force", "contact", "--material", "mat121"]);
    let [theirs, ours] = restitutions(&own[0])[..] else { panic!("{own:?}") };
    assert_eq!(theirs, ours);
    assert!(soft.iter().any(|note| note.contains("the peak force changes from")), "{soft:?}");
    assert!(soft.iter().any(|note| note.contains(" % of their mean on average")), "{soft:?}");
    // A change that would be too large is refused.
    let arguments =
        ["export", "curves.h5", "--group", "vehicle-pair", "--speed", "3km/h", "--to", "lsdyna"];
    let error = crumple_fails(here, 1, &[&arguments[..], &["--soften"]].concat());
    says(&error, "error: vehicle-pair 3 km/h: no steep rise can be reduced to");
    says(&error, "without changing the curve's end");
    // Nor is it recommended then.
    let recommended = |group: &str, case: &str| {
        let line = format!(
            "export curves.h5 --group {group} --case {case} --to lsdyna -o n.k --overwrite"
        );
        let said = crate::common::said(&crumple_in(here, &line));
        says(&said, "--material mat121 unloads with its own stiffness");
        said.contains("--soften")
    };
    assert!(recommended("lead-car-wall", "48kmh"));
    assert!(!recommended("lead-car-wall", "12kmh"));
    // The softened curve keeps the energy.
    let work = |file: &str| {
        let units = UnitSystem::parse("SI").unwrap();
        let options = ReadOptions { units: Some(units), ..ReadOptions::default() };
        let (curve, _) = read(&here.join(file), &options).unwrap();
        crumple::curve::Envelope::new(curve.deflection_m, curve.force_n).unwrap().work()
    };
    for (file, more) in [("hard.csv", &[][..]), ("soft.csv", &["--soften"])] {
        export(
            here,
            "lead50.json",
            file,
            &[&["--force", "contact", "--tail", "none"], more].concat(),
        );
        let written = fs::read_to_string(here.join(file)).unwrap();
        let says_so = written.contains("# changed: rises steeper than");
        assert_eq!(says_so, file == "soft.csv", "{file}");
    }
    assert!((work("soft.csv") / work("hard.csv") - 1.0).abs() < 1e-3);
}

/// A curve rebounds by the energy of its own unloading branch, not by a slope of it; and no spring gives back more than
/// crumple's own law, which unloads no less steeply than a curve rises.
#[test]
fn curves_give_back_the_energy_of_their_unloading() {
    let folder = demo_folder();
    let here = folder.path();
    let facts = "# force_kind: body\n# speed_kind: wall\n# speed_m_per_s: 10\n";
    let falling = "0,0\n0.1,1.0e6\n0.3,1.5e6\n0.5,2.0e6\n0.495,0.2e6\n0.40,0\n";
    let file = format!("{facts}# mass_kg: 13000\nd_m,force_N\n{falling}");
    fs::write(here.join("press.csv"), file).unwrap();
    // 15.0 kJ of the 650 kJ come back.
    let restitution = (15.0_f64 / 650.0).sqrt();
    let asked = "db add press.h5 press.csv --group g";
    crumple_ok(here, asked);
    for source in ["file = \"press.csv\"", "database = \"press.h5\"\ncase = \"g/press\""] {
        let text = format!(
            "[run]\nduration = \"300ms\"\n[curves.k]\n{source}\n[[train]]\nname = \"A\"\nspeed = \"10m/s\"\nvehicles = [ {{ name = \"A1\", mass = \"13t\" }} ]\n[wall]\n[contact]\ncurve = \"k\"\n"
        );
        fs::write(here.join("press.toml"), text).unwrap();
        let run: Value =
            serde_json::from_str(&crumple_ok(here, "simulate press.toml --json -q")).unwrap();
        let found = run["summary"]["interfaces"][0]["restitution"].as_f64().unwrap();
        assert!((found / restitution - 1.0).abs() < 2e-3, "{source}: {found}");
    }
    export(here, "press.csv", "press-again.csv", &[]);
    let text = fs::read_to_string(here.join("press-again.csv")).unwrap();
    says(&text, "# unloading_stiffness_N_per_m: 1.33333333E+08\n");
    let file = format!(
        "{facts}# mass_kg: 10000\n# unloading_stiffness_N_per_m: 5e6\nd_m,force_N\n0,0.5e6\n0.1,1.0e6\n0.3,1.5e6\n0.4,2.0e6\n"
    );
    fs::write(here.join("soft.csv"), file).unwrap();
    for material in ["mat121", "s06"] {
        let notes = export_notes(here, "soft.csv", &["--material", material, "-o", "soft.k"]);
        says(&notes, "(it unloads with 7.8 MN/m), 0.894 in crumple's own runs");
        says(&notes, "restitution 0.894 in LS-DYNA's");
    }
}

/// A table that is said to hold the contact force does not become one of the force that moves the body; and a recorded contact
/// force lets a single-mass body rebound as its run does.
#[test]
fn contact_forces_stay_contact_forces() {
    let folder = demo_folder();
    let here = folder.path();
    export(here, "lead50.json", "contact.csv", &["--force", "contact", "--tail", "none"]);
    let error = crumple_fails(here, 2, &["export", "contact.csv", "-o", "body.k"]);
    says(&error, "its file states a contact force without times): use --force contact");
    let said = export_notes(here, "contact.csv", &["--force", "contact", "-o", "again.csv"]);
    says(&fs::read_to_string(here.join("again.csv")).unwrap(), "# force_kind: contact\n");
    assert!(!said.contains("[case_warning]"), "{said}");
    let output = crumple_in(here, "db add contact.h5 contact.csv --group g --strict");
    assert_eq!(output.status.code(), Some(3));
    says(&String::from_utf8_lossy(&output.stderr), "force: only the contact force is known");
    let text = "[run]\nduration = \"300ms\"\n[curves.k]\ndatabase = \"curves.h5\"\ncase = \"lead-car-wall/72kmh\"\nforce = \"contact\"\n[[train]]\nname = \"A\"\nspeed = \"72km/h\"\nvehicles = [ { name = \"A1\", mass = \"24t\" } ]\n[wall]\n[contact]\ncurve = \"k\"\n";
    fs::write(here.join("recorded.toml"), text).unwrap();
    let run: Value =
        serde_json::from_str(&crumple_ok(here, "simulate recorded.toml --json -q")).unwrap();
    let found = run["summary"]["interfaces"][0]["restitution"].as_f64().unwrap();
    let database = crumple::database::Database::read(&here.join("curves.h5")).unwrap();
    let cases = database.cases("lead-car-wall");
    let case = cases.iter().find(|case| case.id.name == "72kmh").unwrap();
    let rebound = case.curves.closing_speed_m_per_s.iter().fold(0.0, |a: f64, v| a.min(*v));
    let recorded = -rebound / case.conditions.speed.m_per_s;
    assert!((found / recorded - 1.0).abs() < 0.03, "{found} for {recorded}");
}

/// The steepest rise of a table is not that of a jump, whose width crumple chooses; and the bottoming ends at three times the peak.
#[test]
fn a_jump_is_not_a_stiffness() {
    let folder = demo_folder();
    let here = folder.path();
    let table = "d_m,force_N\n0,0\n0.06,0.6e6\n0.06,1.2e6\n0.45,1.2e6\n";
    fs::write(here.join("jump.csv"), table).unwrap();
    let of = ["--speed", "5m/s", "--kind", "wall", "--mass", "40t", "-o", "out.csv"];
    let output = crumple_in(here, &[&["export", "jump.csv"], &of[..]].concat());
    let said = String::from_utf8_lossy(&output.stderr);
    says(&said, "the steepest rise, 10.0 MN/m, is used");
    assert_eq!(said.matches("the steepest rise, 10.0 MN/m").count(), 1, "{said}");
    let text = "[run]\nduration = \"300ms\"\n[curves]\nk = { file = \"jump.csv\", force = \"body\" }\n[[train]]\nname = \"A\"\nspeed = \"4m/s\"\nvehicles = [ { name = \"A1\", mass = \"40t\" } ]\n[wall]\n[contact]\ncurve = \"k\"\n";
    fs::write(here.join("jump.toml"), text).unwrap();
    let said = crumple_in(here, "simulate jump.toml").stderr;
    says(&String::from_utf8_lossy(&said), "it unloads with its steepest rise, 10.0 MN/m");
    export(here, "jump.csv", "stiff.csv", &[&of[..6], &["--unloading", "9000MN/m"]].concat());
    let text = fs::read_to_string(here.join("stiff.csv")).unwrap();
    let force = |row: &str| row.split(',').nth(1).unwrap().parse::<f64>().unwrap();
    assert!((force(text.lines().last().unwrap()) / 3.6e6 - 1.0).abs() < 1e-6, "{text}");
}

/// What a format says it can hold it holds, and what it does not say is refused.
#[test]
fn formats_hold_what_they_declare() {
    let folder = demo_folder();
    let here = folder.path();
    for format in FORMATS.iter().filter(|f| !f.takes_model() && !f.takes_case()) {
        let with = |more: &[&str]| {
            // Several files go into a folder of that name.
            let output = format!("{}{}", format.name, more.concat());
            let arguments = ["export", "lead50.json", "--to", format.name, "-o", &output];
            let done = crumple_in(here, &[&arguments, more].concat());
            let path = here.join(&output);
            let first = |path: &Path| fs::read(path.join(&entries(path)[0])).unwrap();
            let bytes =
                if path.is_dir() { first(&path) } else { fs::read(&path).unwrap_or_default() };
            (done.status.code(), bytes)
        };
        let (_, plain) = with(&[]);
        for (more, is_declared) in [
            (&["--deck"][..], format.deck),
            (&["--curve-id", "77"], format.ids),
            (&["--material", "s06"], format.materials),
            (&["--tail", "none"], format.tail != Tail::None),
        ] {
            let (code, bytes) = with(more);
            assert_eq!(code, Some(if is_declared { 0 } else { 2 }), "{} {more:?}", format.name);
            assert!(!is_declared || bytes != plain, "{} {more:?} changes nothing", format.name);
        }
        let has_band = plain.windows(6).any(|w| w == b"fd_low" || w == b",lo,hi");
        assert!(has_band == format.band || format.name == "json", "{}", format.name);
    }
}

/// The header states the sign that the table below it has.
#[test]
fn headers_state_the_sign_of_their_tables() {
    let folder = demo_folder();
    for (words, is_elongation) in [
        ("-o a.csv", false),
        ("-o s08.k", false),
        ("--material s06 -o s06.k", true),
        ("--material mat121 -o m121.k", true),
        ("-o a.rad", true),
        ("-o a.inp", true),
    ] {
        crumple_ok(folder.path(), &format!("export lead50.json {words} -q"));
        let file = words.split(' ').next_back().unwrap();
        let text = std::fs::read_to_string(folder.path().join(file)).unwrap();
        let sign = match is_elongation {
            true => "sign: elongation positive, so a crush has a negative deflection and force",
            false => "sign: deflection and force positive in compression",
        };
        assert!(text.contains(sign), "{file}");
    }
}
