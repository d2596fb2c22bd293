//! `crumple rate` as a user runs it: what it reads, what it says, and how it refuses.

use std::fmt::Write;
use std::path::Path;

use crate::common::{crumple_fails, crumple_in, crumple_ok, demo_folder, fixture, says};
use serde_json::Value;

/// Writes a table of `time` and `value` over samples of 1 ms.
fn write(folder: &Path, name: &str, header: &str, samples: usize, line: impl Fn(f64) -> String) {
    let mut text = format!("{header}\n");
    for i in 0..samples {
        let t = i as f64 / 1000.0;
        writeln!(text, "{}", line(t)).unwrap();
    }
    std::fs::write(folder.join(name), text).unwrap();
}

fn pulse(t: f64) -> f64 {
    -100.0 * (std::f64::consts::PI * t / 0.1).sin().max(0.0)
}

/// A folder with a.csv, a half sine of 100 ms as an acceleration, and b.csv, 1.1 times that.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write(here, "a.csv", "time_s,a_m_per_s2[A1]", 200, |t| format!("{t:?},{:?}", pulse(t)));
    write(here, "b.csv", "time_s,v,a_m_per_s2[B1]", 200, |t| {
        format!("{t:?},x,{:?}", 1.1 * pulse(t))
    });
    folder
}

const BOTH: [&str; 2] = ["a.csv:a_m_per_s2[A1]", "b.csv:a_m_per_s2[B1]"];

fn rate(folder: &Path, arguments: &[&str]) -> Value {
    let all = [&["rate"], arguments, &["--json"]].concat();
    serde_json::from_str(&crumple_ok(folder, &all)).unwrap()
}

fn assert_close(value: &Value, expected: f64, tolerance: f64) {
    let value = value.as_f64().unwrap();
    assert!((value - expected).abs() < tolerance, "{value} against {expected}");
}

/// What ends in the pulse has the mean of a part of it.
/// Two results by the acceptance rule: the same run passes; a slower one, whose noses are crushed far less, does not.
#[test]
fn runs_are_rated_by_the_acceptance_rule() {
    let folder = demo_folder();
    let folder = folder.path();
    let text = std::fs::read_to_string(folder.join("two-sets.toml")).unwrap();
    crumple_ok(folder, "simulate two-sets.toml -o one.csv");
    for (name, speed) in [("near", "35.5km/h"), ("slower", "30km/h")] {
        std::fs::write(folder.join(format!("{name}.toml")), text.replace("36km/h", speed)).unwrap();
        crumple_ok(folder, &format!("simulate {name}.toml -o {name}.csv"));
    }
    let rate = |other: &str| -> serde_json::Value {
        serde_json::from_str(&crumple_ok(folder, &format!("rate one.csv {other}.csv --json")))
            .unwrap()
    };
    let same = rate("one");
    assert_eq!((&same["passes"], &same["same_sequence"]), (&true.into(), &true.into()));
    assert_eq!(same["sequences"][0][0], "A1|B1");
    assert_eq!(rate("near")["passes"], true);
    let slower = rate("slower");
    assert_eq!(slower["passes"], false);
    // Against the summaries of both runs, which know extremes of every step.
    let summary = |name: &str| -> serde_json::Value {
        serde_json::from_str(&crumple_ok(folder, &format!("simulate {name}.toml --json -q")))
            .unwrap()
    };
    let (one, other) = (summary("two-sets"), summary("slower"));
    let of = |run: &serde_json::Value, name: &str, key: &str| {
        let all = run["summary"]["interfaces"].as_array().unwrap();
        all.iter().find(|i| i["name"] == name).unwrap()[key].as_f64().unwrap()
    };
    for stage in slower["stages"].as_array().unwrap() {
        let name = stage["stage"].as_str().unwrap();
        let expected =
            of(&other, name, "max_deflection_m") / of(&one, name, "max_deflection_m") - 1.0;
        assert!((stage["displacement_error"].as_f64().unwrap() - expected).abs() < 2e-3, "{name}");
        let lost = |run| of(run, name, "dissipated_at_end_J") + of(run, name, "stored_at_end_J");
        let expected = lost(&other) - lost(&one);
        let found =
            stage["energy_error"].as_f64().unwrap() * slower["initial_energy_J"].as_f64().unwrap();
        assert!((found - expected).abs() < 3e-3 * lost(&one), "{name}: {found} and {expected}");
    }
    let said = crumple_ok(folder, "rate one.csv slower.csv");
    assert!(
        said.contains("fails: dissipated energy within 10 %")
            && said.contains("EN 15227:2020+A1:2024"),
        "{said}"
    );
    // A run that ends before the crush does has no crush to judge.
    let whole = std::fs::read_to_string(folder.join("one.csv")).unwrap();
    let lines: Vec<&str> = whole.lines().take(40).collect();
    std::fs::write(folder.join("cut.csv"), lines.join("\n") + "\n").unwrap();
    for (a, b, who) in [("one", "cut", "prediction"), ("cut", "cut", "reference")] {
        let output = crumple_in(folder, &format!("rate {a}.csv {b}.csv --strict"));
        assert_eq!(output.status.code(), Some(3));
        let said = String::from_utf8(output.stderr).unwrap();
        says(&said, &format!("the {who} ends while these are still being crushed"));
        let table = String::from_utf8(output.stdout).unwrap();
        says(&table, "not final in one of the runs: A1|B1");
        says(&table, "; fails: ");
    }
    // Rows that are missing are said, here and in a picture.
    let gap = |k: &usize| !(60..110).contains(k);
    let lines = whole.lines().enumerate().filter(|(k, _)| gap(k)).map(|(_, line)| line);
    std::fs::write(folder.join("gap.csv"), lines.collect::<Vec<_>>().join("\n") + "\n").unwrap();
    for command in ["rate one.csv gap.csv --strict", "plot gap.csv -o gap.svg --overwrite"] {
        let output = crumple_in(folder, command);
        let said = String::from_utf8(output.stderr).unwrap();
        says(&said, "gap.csv: there is no state between time 0.0435");
        assert_eq!(output.status.code(), Some(if command.contains("strict") { 3 } else { 0 }));
    }
    // The file that is not a result is named.
    std::fs::write(folder.join("other.csv"), "time_s,a,b\n0,1,2\n0.1,1,2\n").unwrap();
    for line in ["rate one.csv other.csv", "rate other.csv one.csv"] {
        let error = crumple_fails(folder, 2, line);
        says(&error, "error: other.csv is not the result of a run, as one.csv is");
    }
    let error = crumple_fails(folder, 1, "rate one.csv gone.csv");
    assert!(error.starts_with("error: gone.csv: "), "{error}");
    // An interface that one of both lacks, and what is for single signals.
    let less: String = std::fs::read_to_string(folder.join("one.csv")).unwrap();
    let header: Vec<&str> = less.lines().next().unwrap().split(',').collect();
    let kept = |line: &str| -> String {
        let fields = line.split(',').zip(&header).filter(|(_, name)| !name.contains("A1|B1"));
        fields.map(|(field, _)| field).collect::<Vec<_>>().join(",")
    };
    let less: Vec<String> = less.lines().map(kept).collect();
    std::fs::write(folder.join("less.csv"), less.join("\n") + "\n").unwrap();
    for (a, b) in [("one", "less"), ("less", "one")] {
        let found: serde_json::Value =
            serde_json::from_str(&crumple_ok(folder, &format!("rate {a}.csv {b}.csv --json")))
                .unwrap();
        assert_eq!(
            (&found["passes"], &found["missing"]),
            (&false.into(), &serde_json::json!(["A1|B1"]))
        );
    }
    for option in ["--to 50ms", "--cfc 60", "--quantity other"] {
        let all = format!("rate one.csv one.csv {option}");
        let error = crumple_fails(folder, 2, &all.split(' ').collect::<Vec<_>>());
        assert!(error.contains("is for one signal"), "{error}");
    }
    let error = crumple_fails(folder, 2, &["rate", "one.csv,scale=2", "one.csv"]);
    assert!(error.contains("scale= is for one signal"), "{error}");
    std::fs::write(folder.join("none.csv"), "time_s,deflection_m[x],force_N[x]\n0,0,0\n0.1,1,1\n")
        .unwrap();
    let error = crumple_fails(folder, 2, &["rate", "one.csv", "none.csv"]);
    assert!(error.contains("have no interface in common"), "{error}");
}

#[test]
fn signals_that_end_while_decelerated_are_said() {
    let folder = folder();
    let both = BOTH;
    for (to, is_cut) in [("60ms", true), ("190ms", false)] {
        let of = rate(folder.path(), &[&both[..], &["--to", to]].concat());
        let warnings = of["warnings"].as_array().unwrap();
        for who in ["reference", "prediction"] {
            assert_eq!(of["deceleration"][who]["is_cut"], is_cut, "{who} to {to}");
            let said =
                format!("the {who} is still decelerated at 60.0 ms, where the interval ends");
            let is_said = warnings.iter().any(|w| w.as_str().unwrap().starts_with(&said));
            assert_eq!(is_said, is_cut, "{warnings:?}");
        }
    }
    let all = [&["rate"], &both[..], &["--to", "60ms", "--strict"]].concat();
    assert!(crumple_fails(folder.path(), 3, &all).contains("still decelerated"));
}

#[test]
fn a_scaled_acceleration_by_hand() {
    let folder = folder();
    let of = rate(folder.path(), &BOTH);
    assert_eq!(of["quantity"], "acceleration");
    assert_eq!((&of["samples"], &of["interval_s"]), (&1991.into(), &1e-4.into()));
    assert_eq!(of["reference"]["name"], "a.csv: a_m_per_s2[A1]");
    assert_eq!(of["reference"]["samples"], 200);
    for key in ["l1_ratio", "rms_ratio", "integral_error"] {
        assert_close(&of[key], 0.1, 1e-12);
    }
    assert_close(&of["max_abs"]["value"], 10.0, 1e-9);
    assert_close(&of["max_abs"]["time_s"], 0.05, 1e-12);
    assert_close(&of["pointwise"]["mean"], 0.1, 1e-12);
    assert_close(&of["peaks"][0]["error"], 0.1, 1e-12);
    assert_close(&of["peaks"][0]["value"], -100.0, 1e-9);
    assert_close(&of["sprague_geers"]["magnitude"], 0.1, 1e-12);
    assert_close(&of["cora"]["size"], 1.0 / 1.21, 1e-12);
    // 200/π over the half sine, a little more from 5 % of the peak on; over 120 ms 100/120 of it.
    let mean = 200.0 / std::f64::consts::PI;
    assert_close(&of["deceleration"]["reference"]["mean"], mean, 1.5);
    let largest = &of["deceleration"]["prediction"]["largest_120ms_mean"];
    assert_close(largest, 1.1 * mean * 100.0 / 120.0, 0.02);
    assert_eq!(of["warnings"], serde_json::json!([]));
}

#[test]
fn the_table_shows_every_measure() {
    let folder = folder();
    let text = crumple_ok(folder.path(), &[&["rate"], &BOTH[..]].concat());
    for line in [
        "interpolated at 1991 common times from 0 ms to 199 ms, 0.1 ms apart (10 kHz)",
        "l1_ratio             10.00 %  sum|p-r|/sum|r|",
        "peak 1               10.00 %  of -100.00 at 50 ms, 0 ms later",
        "CORA                   0.955  corridor 0.953, cross-correlation 0.957 (progression 1.000, size 0.826, phase 1.000)",
    ] {
        assert!(text.lines().any(|l| l == line), "no line {line}\n{text}");
    }
    for measure in ["rms_ratio", "peak_norm", "pointwise", "max_abs", "integral", "Sprague-Geers"]
        .into_iter()
        .chain(["Russell", "ISO/TS 18571", "mean deceleration", "largest 120 ms mean"])
    {
        assert!(text.lines().any(|l| l.starts_with(measure)), "{measure}\n{text}");
    }
}

/// A prediction of a part of the reference is rated on that part, and units that differ are not converted: both are said.
#[test]
fn parts_and_units_are_said() {
    let folder = folder();
    let here = folder.path();
    write(here, "short.csv", "time_s,a_m_per_s2[A1]", 120, |t| format!("{t:?},{:?}", pulse(t)));
    let of = rate(here, &["a.csv:a_m_per_s2[A1]", "short.csv:a_m_per_s2[A1]"]);
    let said = of["warnings"][0].as_str().unwrap();
    says(said, "the prediction goes from 0 s to 0.119 s: 40 % of the reference");
    let asked = ["--to", "110ms"];
    let of =
        rate(here, &[&["a.csv:a_m_per_s2[A1]", "short.csv:a_m_per_s2[A1]"], &asked[..]].concat());
    assert!(!of["warnings"].to_string().contains("is not rated"), "{of}");
    // A longer prediction covers its reference.
    let of = rate(here, &["short.csv:a_m_per_s2[A1]", "a.csv:a_m_per_s2[A1]"]);
    assert!(!of["warnings"].to_string().contains("is not rated"), "{of}");
    let columns = [
        ("time_s,acc_g", "g", "write the factor after the file's name: c.csv,scale=9.80665"),
        ("time_s,acc [mm/s^2]", "mm/s²", "c.csv,scale=0.001"),
        ("time_s,force_kN", "kN", "they are different quantities"),
    ];
    for (header, unit, remedy) in columns {
        write(here, "c.csv", header, 200, |t| format!("{t:?},{:?}", pulse(t)));
        let column = header.split_once(',').unwrap().1;
        let other = format!("c.csv:{column}");
        let of = rate(here, &["a.csv:a_m_per_s2[A1]", &other]);
        let expected = format!(
            "according to their names, the reference is in m/s² and the prediction in {unit}"
        );
        says(&of["warnings"].to_string(), &expected);
        says(&of["warnings"].to_string(), remedy);
        let of = rate(here, &["a.csv:a_m_per_s2[A1]", &format!("{other},scale=0.5")]);
        assert!(!of["warnings"].to_string().contains("according to their names"), "{of}");
    }
    // Without units in the names the factor shows.
    write(here, "c.csv", "time_s,value", 200, |t| format!("{t:?},{:?}", 1e3 * pulse(t)));
    let of = rate(here, &["a.csv:a_m_per_s2[A1]", "c.csv:value"]);
    says(&of["warnings"].to_string(), "is 1000 times the reference throughout");
    says(&of["warnings"].to_string(), "write ,scale=0.001 after what names the prediction");
    let of = rate(here, &["a.csv:a_m_per_s2[A1]", "c.csv:value,scale=1000"]);
    says(&of["warnings"].to_string(), "write ,scale=0.001 after");
    let of = rate(here, &["a.csv:a_m_per_s2[A1]", "c.csv:value,scale=0.001"]);
    assert!(!of["warnings"].to_string().contains("throughout"), "{of}");
}

/// The way over crumple histories and the direct one are the same.
#[test]
fn a_solver_file_rates_as_its_csv() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let paths = ["36", "48"].map(|s| fixture(&format!("fe/lead-car-wall/{s}kmh/nodout")));
    let [a, b] = paths.each_ref().map(|path| path.to_str().unwrap());
    crumple_ok(here, &["histories", b, "-o", "b.csv"]);
    let direct = rate(here, &[a, b, "--id", "900001", "--component", "x_velocity"]);
    let addressed = format!("{a}:900001:x_velocity");
    let mixed = rate(here, &[&addressed, "b.csv:x_velocity[900001]"]);
    let by_id = format!("{a}:900001");
    let shared = rate(here, &[&by_id, b, "--id", "900001", "--component", "x_velocity"]);
    assert_eq!(direct["l1_ratio"], shared["l1_ratio"], "the address gives the id alone");
    for key in ["l1_ratio", "iso18571", "cora", "peaks", "russell"] {
        assert_eq!(direct[key], mixed[key], "{key}");
    }
    assert!(direct["l1_ratio"].as_f64().unwrap() > 0.4, "they are different runs");
}

#[test]
fn units_and_factors_are_those_of_the_arguments() {
    let folder = folder();
    let here = folder.path();
    write(here, "ms.csv", "time [ms],a_mm", 200, |t| {
        format!("{:?},{:?}", t * 1e3, -1e3 * pulse(t))
    });
    let error = crumple_fails(here, 1, "rate a.csv ms.csv");
    assert_eq!(
        error,
        "error: ms.csv: line 1, column 1 (\"time [ms]\"): expected a time in s: write ms.csv,time=ms\n"
    );
    // The same in a row of units.
    write(here, "row.csv", "time,a\nms,m/s2", 200, |t| format!("{:?},{:?}", t * 1e3, pulse(t)));
    let error = crumple_fails(here, 1, "rate a.csv row.csv");
    says(&error, "(\"time [ms]\"): expected a time in s: write row.csv,time=ms");
    write(here, "row_g.csv", "time,a\ns,g", 200, |t| format!("{t:?},{:?}", pulse(t) / 9.80665));
    let output = crumple_in(here, "rate row.csv,time=ms row_g.csv");
    let said = String::from_utf8(output.stderr).unwrap();
    says(&said, "the reference is in m/s² and the prediction in g");
    write(here, "us.csv", "Time [µS],a", 200, |t| format!("{:?},{:?}", t * 1e6, pulse(t)));
    let error = crumple_fails(here, 1, "rate a.csv us.csv");
    says(&error, "expected a time in s: write us.csv,time=us");
    let of = rate(here, &["a.csv", "ms.csv,scale=-1e-3,time=ms"]);
    assert!(of["l1_ratio"].as_f64().unwrap() < 1e-12, "{of}");
    assert_eq!(of["quantity"], "other", "only one name says acceleration");
    // Nothing in this header tells the unit.
    write(here, "t.csv", "t,a", 200, |t| format!("{:?},{:?}", t * 1e3, pulse(t)));
    let error = crumple_fails(here, 1, "rate a.csv t.csv");
    assert_eq!(
        error,
        "error: a.csv lasts 0.199 s and t.csv 199 s, if both count time in s: write the unit of each after its name, such as a.csv,time=s and t.csv,time=ms\n"
    );
    let said = ["a.csv,time=s", "t.csv,time=ms"];
    assert!(rate(here, &said)["l1_ratio"].as_f64().unwrap() < 1e-12);
    // Both in ms: nothing compares them, but a filter sees it.
    let error = crumple_fails(here, 1, "rate t.csv t.csv --cfc 60");
    says(
        &error,
        "it lasts 199 s, so its times may be in ms: then write ,time=ms after the file's name; else use a lower class",
    );
    let both = rate(here, &["t.csv,time=ms", "t.csv,time=ms", "--cfc", "60"]);
    assert_eq!(both["to_s"], 0.199);
    // Samples that are missing are said, not bridged in silence.
    let text = std::fs::read_to_string(here.join("a.csv")).unwrap();
    let kept = text.lines().enumerate().filter(|(k, _)| !(80..100).contains(k)).map(|(_, l)| l);
    std::fs::write(here.join("gap.csv"), kept.collect::<Vec<_>>().join("\n") + "\n").unwrap();
    let output = crumple_in(here, "rate a.csv gap.csv --strict");
    assert_eq!(output.status.code(), Some(3));
    let said = String::from_utf8(output.stderr).unwrap();
    says(&said, "gap.csv: there is no state between time 0.078 and 0.099");
}

/// Histories as LS-PrePost and T/HIS write them.
#[test]
fn histories_of_other_programs() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let csv = "Nodal History,X-acceleration\nTime,A900001,B900002,";
    write(here, "a.csv", csv, 200, |t| format!("  {t:?},  {:?},  {:?},", pulse(t), 1.1 * pulse(t)));
    let crv = "Curveplot\nbox\nTime\nX-acceleration\nA-1 #pts=200\n* Minval= 0 at time= 0";
    write(here, "a.crv", crv, 200, |t| format!("  {t:?}  {:?}", pulse(t)));
    let cur = "box\nTime <TIME/0.001>;\nAcceleration <ACCELERATION/1>;\nnode 1";
    write(here, "a.cur", cur, 200, |t| format!("{:?}, {:?}", 1e3 * t, 1.1 * pulse(t)));
    let is_tenth = |of: &Value| {
        let ratio = of["l1_ratio"].as_f64().unwrap();
        assert!((ratio - 0.1).abs() < 1e-9, "{of}");
    };
    let of = rate(here, &["a.csv:A900001", "a.csv:B900002"]);
    is_tenth(&of);
    assert_eq!(of["quantity"], "acceleration", "the title says so");
    is_tenth(&rate(here, &["a.crv", "a.csv:B900002"]));
    is_tenth(&rate(here, &["a.crv:A-1", "a.cur,time=ms"]));
    let error = crumple_fails(here, 1, "rate a.crv a.cur");
    says(
        &error,
        "a.cur: line 2, column 1 (\"Time <TIME/0.001>;\"): expected a time in s: write a.cur,time=ms",
    );
    let error = crumple_fails(here, 1, "rate a.csv a.cur");
    says(&error, "name one of \"A900001\", \"B900002\" after the file's name: a.csv:COLUMN");
    // Whatever its name says.
    std::fs::rename(here.join("a.crv"), here.join("a")).unwrap();
    is_tenth(&rate(here, &["a", "a.cur,time=ms"]));
}

#[test]
fn filter_and_interval_are_those_asked_for() {
    let folder = folder();
    let here = folder.path();
    let noisy = |t: f64| pulse(t) + 20.0 * (2.0 * std::f64::consts::PI * 400.0 * t).sin();
    write(here, "noisy.csv", "t,a", 200, |t| format!("{t:?},{:?}", noisy(t)));
    let window = ["a.csv", "noisy.csv", "--from", "20ms", "--to=0.08s"];
    let raw = rate(here, &window);
    assert_eq!(
        (&raw["from_s"], &raw["samples"], &raw["cfc"]),
        (&0.02.into(), &601.into(), &Value::Null)
    );
    let smooth = rate(here, &[&window[..], &["--cfc", "60"]].concat());
    assert_eq!(smooth["cfc"], 60);
    let ratio = |of: &Value| of["rms_ratio"].as_f64().unwrap();
    assert!(ratio(&raw) > 0.1 && ratio(&smooth) < 0.01, "{} {}", ratio(&raw), ratio(&smooth));
}

#[test]
fn wrong_input_says_where_and_what_to_do() {
    let folder = folder();
    let here = folder.path();
    let file = |name: &str, text: &str| std::fs::write(here.join(name), text).unwrap();
    file("text.csv", "t,a\n0,1\n0.1,n/a\n0.2,1\n");
    file("nan.csv", "t,a\n0,1\n0.1,NaN\n0.2,1\n");
    file("back.csv", "t,a\n0,1\n0.2,1\n0.1,1\n");
    file("few.csv", "t,a\n0,1\n0.1,1\n");
    file("late.csv", "t,a\n5,1\n5.1,1\n5.2,1\n5.3,1\n5.4,2\n");
    file("note", "no solver wrote this\n");
    file("twice.csv", "t,a,a\n");
    file("short.csv", "t,a\n0,1\n1\n");
    file("thousands.csv", "t;a\n0.0;990\n0.1;1,012\n");
    file("wide.csv", "t,a\n0,1\n0,5,2\n");
    file("bare.csv", "0,1\n1,2\n");
    file("one.csv", "time\n0\n");
    file("empty.csv", "");
    let t = |arguments: &[&str], code: i32, message: &str| {
        let error = crumple_fails(here, code, &[&["rate"], arguments].concat());
        assert!(error.starts_with(&format!("error: {message}")), "{arguments:?}: {error}");
    };
    #[rustfmt::skip]
    let cases = [
        (&["a.csv", "b.csv"][..], 1, "b.csv: there are several columns: name one of \"v\", \"a_m_per_s2[B1]\" after the file's name: b.csv:COLUMN"),
        (&["a.csv:w", "b.csv"][..], 1, "a.csv: there is no column \"w\": name one of \"a_m_per_s2[A1]\" after the file's name: a.csv:COLUMN"),
        (&["a.csv", "b.csv:v"][..], 1, "b.csv: line 2, column 2 (\"v\"): expected a number"),
        (&["a.csv", "text.csv"][..], 1, "text.csv: line 3, column 2 (\"a\"): expected a number, found \"n/a\""),
        (&["a.csv", "nan.csv"][..], 1, "nan.csv: line 3, column 2 (\"a\"): expected a finite number, found \"NaN\": remove the lines without a value"),
        (&["a.csv", "back.csv"][..], 1, "back.csv: line 4, column 1 (\"t\"): time 0.1 does not come after 0.2: times must increase strictly, so cut or sort the file first"),
        (&["a.csv", "few.csv"][..], 1, "few.csv: a: a signal needs at least 5 samples, found 2"),
        (&["a.csv", "empty.csv"][..], 1, "empty.csv: the table is empty: expected a header line, then a time and values in every line"),
        (&["a.csv", "late.csv"][..], 1, "there are no common times: the reference goes from 0 s to 0.199 s, the prediction from 5 s to 5.4 s; check the units of time"),
        (&["a.csv", "a.csv", "--to=0.001s"][..], 1, "the common times from 0 s to 0.001 s hold 11 samples at 10 kHz: at least 12 are needed; check the units of time and the requested interval"),
        (&["a.csv", "twice.csv:a"][..], 1, "twice.csv: 2 columns are called \"a\": rename all but one"),
        (&["a.csv", "short.csv"][..], 1, "short.csv: line 3, column 2 (\"a\"): expected a number, found \"\""),
        (&["a.csv", "thousands.csv"][..], 1, "thousands.csv: line 3, field 2: \"1,012\" has the sign \",\", and \"0.0\" in line 2 the sign \".\": only one of them can be decimal"),
        (&["a.csv", "wide.csv"][..], 1, "wide.csv: line 3: expected 2 fields, one for each column of the table, found 3: write decimal points, or semicolons between columns, and name every column in the header"),
        (&["a.csv", "bare.csv"][..], 1, "bare.csv: line 1: expected a header with the names of the columns, found numbers: write for example \"time_s,a_m_per_s2\" above them"),
        (&["a.csv", "one.csv"][..], 1, "one.csv: line 1: expected at least two columns separated by commas, semicolons, tabs or blanks, the first of them the time, found \"time\""),
        (&["a.csv", "a.csv", "--from=0.5s"][..], 1, "the requested interval, from 0.5 s, is empty or lies outside the common times from 0 s to 0.199 s"),
        (&["a.csv", "none.csv"][..], 1, "none.csv: No such file"),
        (&["a.csv", "none.csv:v"][..], 1, "none.csv: No such file"),
        (&["a.csv,time=h", "a.csv"][..], 2, "invalid value 'a.csv,time=h' for '<A>': \"h\" is not a unit of time"),
        (&["a.csv,scale=0", "a.csv"][..], 2, "invalid value 'a.csv,scale=0' for '<A>': \"0\" is not a factor"),
    ];
    cases.into_iter().for_each(|(arguments, code, message)| t(arguments, code, message));
    let error = crumple_fails(here, 1, "rate a.csv note");
    says(&error, "a CSV file has the extension .csv, or its column after its name: note:COLUMN");
    #[rustfmt::skip]
    let cases = [
        (&["a.csv", "a.csv", "--cfc=1000"][..], 1, "a.csv: a_m_per_s2[A1]: its samples are 1.00e-3 s apart, too far for CFC 1000: at most 1.00e-4 s; use a lower class or no filter"),
        (&["a.csv", "a.csv", "--id=1"][..], 2, "--id chooses a history of a solver file, but this is a CSV"),
    ];
    cases.into_iter().for_each(|(arguments, code, message)| t(arguments, code, message));
    let nodout = fixture("fe/lead-car-wall/36kmh/nodout");
    let nodout = nodout.to_str().unwrap();
    t(&[nodout, nodout, "--id=1"], 1, &format!("{nodout}: nodout has no node 1"));
    let address = format!("{nodout}:nodout:x:x_velocity");
    t(&[&address, nodout], 2, "\"nodout:x:x_velocity\": \"x\" is not an id");
    t(&[nodout, nodout], 1, &format!("{nodout}: 12 histories match, from x_displacement[900001]"));
    t(
        &[nodout, nodout, "--component=x_velocity", "--column=x"],
        2,
        "--column names a column of a CSV file, but this is a solver",
    );
}

/// Signals with nothing in them, and with too much.
#[test]
fn degenerate_and_long_signals_are_rated() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write(here, "zero.csv", "t,v", 100, |t| format!("{t:?},0"));
    write(here, "one.csv", "t,v", 50, |t| format!("{t:?},1"));
    write(here, "short.csv", "t,v", 50, |t| format!("{t:?},0"));
    let text = crumple_in(here, "rate short.csv one.csv --json --strict");
    assert_eq!(text.status.code(), Some(3), "a warning");
    let of: Value = serde_json::from_slice(&text.stdout).unwrap();
    assert_eq!((&of["l1_ratio"], &of["samples"]), (&Value::Null, &491.into()));
    assert_eq!(
        String::from_utf8_lossy(&text.stderr),
        "warning: the reference is zero throughout: relative measures are undefined\n"
    );
    assert_eq!(rate(here, &["zero.csv", "zero.csv", "-q"])["l1_ratio"], 0.0);
    let of = rate(here, &["one.csv", "one.csv"]);
    assert_eq!((&of["iso18571"]["rating"], &of["cora"]["rating"]), (&1.0.into(), &1.0.into()));
    // 400 s: 200 times as long as the warping takes.
    write(here, "long.csv", "t,v", 400_000, |t| format!("{t:?},{:?}", t.sin()));
    let of = rate(here, &["long.csv", "long.csv", "-q"]);
    assert_eq!((&of["l1_ratio"], &of["iso18571"]), (&0.0.into(), &Value::Null));
    let many = "samples at 10 kHz are too many for ISO/TS 18571 and CORA, which take up to 20000: choose a shorter interval, or check the units of time";
    assert!(of["warnings"][0].as_str().unwrap().ends_with(many));
}

/// A file of a run that died is rated as far as it goes, and that is reported.
#[test]
fn damage_of_a_solver_file_is_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let path = fixture("fe/lead-car-wall/36kmh/nodout");
    let text = std::fs::read(&path).unwrap();
    std::fs::write(folder.path().join("nodout"), &text[..text.len() / 2 + 50]).unwrap();
    let whole = path.to_str().unwrap();
    let output = crumple_in(
        folder.path(),
        &format!("rate {whole} nodout --component=x_velocity --json --strict"),
    );
    assert_eq!(output.status.code(), Some(3));
    assert!(String::from_utf8_lossy(&output.stderr).starts_with("warning: nodout: "));
    let of: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(of["l1_ratio"], 0.0);
    assert!(of["to_s"].as_f64().unwrap() < 0.16);
}
