//! Sweeps: values of items, the same bytes on any number of threads, pieces and shards, runs
//! that were killed, files that do not belong together, wrong plans.

use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::common::{
    crumple_fails, crumple_in, crumple_ok, demo_folder, python, python_of, root, says,
};
use crumple::sweep::{Chunk, Shard, Sweep, WriteOptions, merge, write};
use serde_json::Value;

/// Two trains with two cars each; short, with long steps.
const SCENARIO: &str = "[run]\nduration = \"60ms\"\noutput_interval = \"1ms\"\nstep = \"0.2ms\"\n\
    [curves]\n\
    nose = { file = \"nose.csv\", unloading = \"200MN/m\" }\n\
    soft = { file = \"nose.csv\", unloading = \"200MN/m\", scale = 0.8 }\n\
    inner = { file = \"inner.csv\", unloading = \"100MN/m\", gap = \"1mm\" }\n\
    [[train]]\nname = \"A\"\nspeed = \"10m/s\"\ninner = \"inner\"\n\
    vehicles = [ { name = \"A1\", mass = \"24t\" }, { name = \"A2\", mass = \"20t\" } ]\n\
    [[train]]\nname = \"B\"\nspeed = \"0m/s\"\ninner = \"inner\"\n\
    vehicles = [ { name = \"B1\", mass = \"24t\" }, { name = \"B2\", mass = \"20t\" } ]\n\
    [contact]\ncurve = \"nose\"\n";

const GRID: &str = "[sweep]\n\
    vary = [ { what = \"speed\", train = \"A\", values = [\"36km/h\", \"5m/s\"] },\n\
    { what = \"curve\", curve = \"nose\", values = [\"nose\", \"soft\"] },\n\
    { what = \"mass\", vehicle = \"A2\", from = \"10t\", to = \"30t\", steps = 3 } ]\n";

const DRAWN: &str = "[sweep]\nseed = 7\nsamples = 40\n\
    vary = [ { what = \"mass\", vehicles = \"all\", each = true, factor = true, distribution = \"uniform\", from = 0.9, to = 1.2 },\n\
    { what = \"force\", curve = \"inner\", values = [1.0, 1.5] },\n\
    { what = \"gap\", curve = \"inner\", distribution = \"triangular\", from = \"0mm\", mode = \"1mm\", to = \"5mm\" } ]\n";

const SPEEDS: &str = "[sweep]\nseed = 7\nsamples = 40\n\
    vary = [ { what = \"speed\", train = \"A\", distribution = \"uniform\", from = \"20km/h\", to = \"60km/h\" } ]\n";

struct Folder(tempfile::TempDir);

impl Folder {
    fn new(plan: &str) -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        folder.put("nose.csv", "d_m,force_MN\n0,0\n0.02,3\n0.05,1.6\n0.6,2\n");
        folder.put("inner.csv", "d_m,force_MN\n0,0\n0.05,1.2\n0.4,1.4\n");
        folder.put("s.toml", &format!("{SCENARIO}{plan}"));
        folder
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    fn put(&self, name: &str, text: &str) {
        fs::write(self.path().join(name), text).unwrap();
    }

    fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    fn text(&self, name: &str) -> String {
        String::from_utf8(self.read(name)).unwrap()
    }

    fn names(&self) -> Vec<String> {
        let entries = self.path().read_dir().unwrap();
        let mut names: Vec<String> =
            entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.retain(|name| !["nose.csv", "inner.csv", "s.toml"].contains(&name.as_str()));
        names.sort();
        names
    }

    fn ok(&self, line: &str) -> String {
        crumple_ok(self.path(), &line.split(' ').collect::<Vec<_>>())
    }

    fn fails(&self, code: i32, line: &str) -> String {
        crumple_fails(self.path(), code, &line.split(' ').collect::<Vec<_>>())
    }

    fn json(&self, line: &str) -> Value {
        serde_json::from_str(&self.ok(line)).unwrap()
    }

    fn load(&self) -> Sweep {
        Sweep::load(&self.path().join("s.toml"), None).unwrap()
    }

    fn write(
        &self,
        sweep: &Sweep,
        name: &str,
        options: &WriteOptions,
    ) -> Result<u64, crumple::Error> {
        write(sweep, &self.path().join(name), options, |_| ControlFlow::Continue(()))
            .map(|report| report.resumed)
    }
}

/// Header and rows of a result as fields.
fn rows(text: &str) -> (Vec<String>, Vec<Vec<String>>) {
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
    let fields = |r: &csv::StringRecord| r.iter().map(String::from).collect::<Vec<_>>();
    let header = fields(reader.headers().unwrap());
    (header, reader.records().map(|r| fields(&r.unwrap())).collect())
}

#[test]
fn a_grid_is_run_in_its_stated_order() {
    let folder = Folder::new(GRID);
    folder.ok("sweep s.toml -q -o out.csv");
    let (header, rows) = rows(&folder.text("out.csv"));
    assert_eq!(header[..4], ["item", "speed_m_per_s[A]", "curve[nose]", "mass_kg[A2]"]);
    assert_eq!(header[4], "peak_force_N[A1|A2]");
    assert_eq!(header[header.len() - 4..], ["energy_error", "momentum_error", "status", "message"]);
    let values: Vec<String> = rows.iter().map(|r| r[..4].join(" ")).collect();
    let mut expected = Vec::new();
    for speed in ["10.0", "5.0"] {
        for curve in ["nose", "soft"] {
            for mass in ["10000.0", "20000.0", "30000.0"] {
                expected.push(format!("{} {speed} {curve} {mass}", expected.len()));
            }
        }
    }
    assert_eq!(values, expected);
}

/// A choice of curves has no order: the correlation ratio of the ranks, whichever way the rows come.
#[test]
fn a_choice_of_curves_has_a_correlation_ratio() {
    let folder = Folder::new(GRID);
    let of_choice = |line: &str| {
        let report = folder.json(&format!("{line} --json -q"));
        let all = report["sensitivities"].as_array().unwrap().clone();
        all.into_iter().filter(|s| s["varied"] == "curve[nose]").collect::<Vec<Value>>()
    };
    let found = of_choice("sweep s.toml -o out.csv");
    let of = |result: &str| {
        let of = found.iter().find(|s| s["result"] == result).unwrap();
        of["rank_correlation"].as_f64().unwrap()
    };
    // All peaks of the soft nose are below those of the other.
    assert_eq!(of("peak_force_N[A1|B1]"), 1.0);
    // By the numbers of the rows, by another route: mean ranks of both noses.
    let (header, rows) = rows(&folder.text("out.csv"));
    for result in ["peak_force_N[B1|B2]", "max_deflection_m[A1|B1]", "final_v_m_per_s[A2]"] {
        let column = header.iter().position(|name| name == result).unwrap();
        let value = |row: &[String]| row[column].parse::<f64>().unwrap();
        let mut order: Vec<&Vec<String>> = rows.iter().collect();
        order.sort_by(|a, b| value(a).total_cmp(&value(b)));
        assert!(order.windows(2).all(|w| value(w[0]) < value(w[1])), "{result} has no ties");
        let soft: usize = (0..12).filter(|&k| order[k][2] == "soft").map(|k| k + 1).sum();
        let off = soft as f64 / 6.0 - 6.5;
        let within = (143.0 - 12.0 * off * off) / 10.0;
        let expected = (1.0 - within / 13.0).max(0.0).sqrt();
        assert!((of(result) - expected).abs() < 1e-12, "{result}: {} {expected}", of(result));
    }
    assert_eq!(of_choice("sweep s.toml -o out.csv"), found, "read from the file");
    assert_eq!(of_choice("sweep s.toml -o out.h5"), found);
    assert_eq!(of_choice("sweep s.toml -o out.h5"), found, "read from the file");
    folder.ok("sweep s.toml --shard 1/2 -q -o 1.csv");
    folder.ok("sweep s.toml --shard 2/2 -q -o 2.csv");
    assert_eq!(of_choice("sweep merge 1.csv 2.csv -o merged.csv"), found);
    let printed = folder.ok("sweep s.toml -o again.csv");
    says(&printed, "rank corr. curve[nose]");
    says(
        &printed,
        "of a choice of curves, which have no order, the correlation ratio of the ranks",
    );
}

/// A crush zone is joined to its body: no gap of its curve can be varied.
#[test]
fn crush_zones_have_no_gap() {
    let folder = Folder::new("");
    let split = SCENARIO.replace(
        "{ name = \"A1\", mass = \"24t\" }",
        "{ name = \"A1\", mass = \"24t\", front = { mass = \"1t\", curve = \"soft\" } }",
    );
    let plan = "[sweep]\nvary = [ { what = \"gap\", curve = \"soft\", values = [\"1mm\"] } ]\n";
    folder.put("s.toml", &format!("{split}{plan}"));
    let error = folder.fails(1, "sweep s.toml -q -o out.csv");
    says(&error, "joins a crush zone to its body, where there is no gap");
    assert_eq!(folder.names(), Vec::<String>::new());
}

/// What has no effect is not varied: the gap of a curve where the train has its own, the band of an end or of a rate.
#[test]
fn what_has_no_effect_is_refused() {
    let folder = Folder::new("");
    let refused = |scenario: &str, vary: &str, expected: &str| {
        folder.put("s.toml", &format!("{scenario}[sweep]\nvary = [ {{ {vary} }} ]\n"));
        says(&folder.fails(1, "sweep s.toml -q -o out.csv"), expected);
    };
    // Readers take "#" in a column's name for a comment.
    refused(
        &SCENARIO.replace("\"A2\"", "\"#2\""),
        "what = \"speed\", train = \"A\", values = [\"9m/s\"]",
        "the name \"#2\" appears in the result and may not be empty or contain , | [ ] # or quotes",
    );
    let gap = "what = \"gap\", curve = \"inner\", values = [\"1mm\", \"9mm\"]";
    let own = SCENARIO.replace("inner = \"inner\"", "gap = \"30mm\"\ninner = \"inner\"");
    assert_ne!(own, SCENARIO);
    refused(
        &own,
        gap,
        "the contact, a train or a vehicle has its own gap, so that of the curve has no effect",
    );
    // One train of two.
    let of_one = SCENARIO.replacen("inner = \"inner\"", "gap = \"30mm\"\ninner = \"inner\"", 1);
    folder.put("s.toml", &format!("{of_one}[sweep]\nvary = [ {{ {gap} }} ]\n"));
    let said = crumple_in(folder.0.path(), "sweep s.toml --dry-run");
    says(
        &String::from_utf8(said.stderr).unwrap(),
        "the gap of curve \"inner\" is varied, but not at A1|A2: there contact, train or vehicle states one",
    );
    let band = "what = \"band\", curve = \"nose\", values = [-1, 1]";
    let train = "[[train]]\nname = \"A\"\nspeed = \"36km/h\"\n";
    let run = "[run]\nduration = \"0.1s\"\n[wall]\n[contact]\n";
    let rate = format!(
        "{run}curve = \"nose\"\n[curves]\nnose = {{ model = \"lead.model\", law = \"rate\" }}\n{train}vehicles = [ {{ name = \"A1\", mass = \"24t\" }} ]\n"
    );
    refused(&rate, band, "band belongs to law = \"memory\"");
    let end = format!(
        "{run}[curves]\nnose = {{ model = \"lead.model\" }}\n{train}vehicles = [ {{ name = \"A1\", mass = \"24t\", ends = \"nose\" }} ]\n"
    );
    refused(&end, band, "and this one is the end of a vehicle");
    // A curve that another variable replaces everywhere; among several it has an effect.
    let force = "what = \"force\", curve = \"nose\", values = [1, 2]";
    let by = |values: &str| {
        format!("{force} }}, {{ what = \"curve\", curve = \"nose\", values = [{values}]")
    };
    refused(SCENARIO, &by("\"soft\""), "another variable replaces curve \"nose\" in every item");
    let both = by("\"soft\", \"nose\"");
    folder.put("s.toml", &format!("{SCENARIO}[sweep]\nvary = [ {{ {both} }} ]\n"));
    let said = crumple_in(folder.0.path(), "sweep s.toml --dry-run");
    says(
        &String::from_utf8(said.stderr).unwrap(),
        "the force of curve \"nose\" is varied, but has no effect in rows with soft in its place",
    );
    let both = both.replace(force, "what = \"gap\", curve = \"nose\", values = [\"1mm\", \"9mm\"]");
    folder.put("s.toml", &format!("{SCENARIO}[sweep]\nvary = [ {{ {both} }} ]\n"));
    let said = crumple_in(folder.0.path(), "sweep s.toml --dry-run");
    says(
        &String::from_utf8(said.stderr).unwrap(),
        "the gap of curve \"nose\" is varied, but has no effect in rows with soft in its place",
    );
    // A curve that has a place of its own, whatever it is chosen for elsewhere.
    let own = "what = \"force\", curve = \"nose\", values = [1, 2] }, { what = \"curve\", curve = \"inner\", values = [\"inner\", \"nose\"]";
    folder.put("s.toml", &format!("{SCENARIO}[sweep]\nvary = [ {{ {own} }} ]\n"));
    let said = crumple_in(folder.0.path(), "sweep s.toml --dry-run");
    assert!(!String::from_utf8(said.stderr).unwrap().contains("has no effect"));
    assert_eq!(folder.names(), Vec::<String>::new());
}

/// A train that comes against the other has a speed below 0.
#[test]
fn oncoming_trains_have_their_speeds() {
    let folder = Folder::new(
        "[sweep]\nvary = [ { what = \"speed\", train = \"B\", values = [\"-1m/s\", \"-2m/s\"] } ]\n",
    );
    folder.ok("sweep s.toml -q -o out.csv");
    let (header, rows) = rows(&folder.text("out.csv"));
    let peak = header.iter().position(|h| h == "max_deflection_m[A1|B1]").unwrap();
    let peaks: Vec<f64> = rows.iter().map(|r| r[peak].parse().unwrap()).collect();
    assert_eq!([&*rows[0][1], &*rows[1][1]], ["-1.0", "-2.0"]);
    assert!(peaks[1] > peaks[0], "{peaks:?}");
}

/// Each row is what `simulate` says of a scenario with these values written into it.
#[test]
fn rows_are_those_of_single_runs() {
    let folder = Folder::new(GRID);
    folder.ok("sweep s.toml -q -o out.csv");
    let (header, rows) = rows(&folder.text("out.csv"));
    for row in &rows {
        let at = |column: &str| row[header.iter().position(|h| h == column).unwrap()].clone();
        let text = SCENARIO
            .replace("speed = \"10m/s\"", &format!("speed = \"{}m/s\"", at("speed_m_per_s[A]")))
            .replace("curve = \"nose\"", &format!("curve = \"{}\"", at("curve[nose]")))
            .replace(
                "{ name = \"A2\", mass = \"20t\" }",
                &format!("{{ name = \"A2\", mass = \"{}kg\" }}", at("mass_kg[A2]")),
            );
        folder.put("one.toml", &text);
        let run = folder.json("simulate one.toml -q --json");
        let number = |column: String| at(&column).parse::<f64>().ok();
        for interface in run["summary"]["interfaces"].as_array().unwrap() {
            let name = interface["name"].as_str().unwrap();
            for key in ["peak_force_N", "max_deflection_m", "max_deflection_time_s", "restitution"]
            {
                assert_eq!(number(format!("{key}[{name}]")), interface[key].as_f64(), "{key}");
            }
        }
        for body in run["summary"]["bodies"].as_array().unwrap() {
            let name = body["name"].as_str().unwrap();
            for key in ["final_v_m_per_s", "mean_deceleration_m_per_s2"] {
                assert_eq!(number(format!("{key}[{name}]")), body[key].as_f64(), "{key}");
            }
        }
        assert_eq!(number("energy_error".into()), run["ledger"]["max_energy_error"].as_f64());
    }
    assert_eq!(rows.len(), 12);
}

/// Results that are named: as those of single runs; the share of runs over a limit; what follows what.
#[test]
fn further_results_and_what_they_follow() {
    let plan = "[sweep]\nseed = 5\nsamples = 60\n\
        results = [\"peak_force\", \"moving_mean_deceleration\", \"main_mean_deceleration\", \"secondary_impact\", \"occupant_load\", \"energy\", \"over_limits\"]\n\
        vary = [ { what = \"speed\", train = \"A\", distribution = \"uniform\", from = \"20km/h\", to = \"60km/h\" },\n\
        { what = \"mass\", vehicle = \"B2\", distribution = \"uniform\", from = \"19t\", to = \"21t\" } ]\n";
    let limits = "[limits]\nstandard = \"own\"\nedition = \"1\"\nmean_deceleration_g = 100.0\n\
        secondary_impact = \"4m/s\"\ntrains = [\"A\"]\n";
    let folder = Folder::new("");
    let scenario = SCENARIO.replace("duration = \"60ms\"", "duration = \"500ms\"");
    assert_ne!(scenario, SCENARIO);
    for (nose, inner) in [(0.6, 0.4), (3.0, 3.0)] {
        // Short curves end before the crush does, and then no limit is judged.
        folder.put("nose.csv", &format!("d_m,force_MN\n0,0\n0.02,3\n0.05,1.6\n{nose},2\n"));
        folder.put("inner.csv", &format!("d_m,force_MN\n0,0\n0.05,1.2\n{inner},1.4\n"));
        folder.put("s.toml", &format!("{scenario}{limits}{plan}"));
        let printed = folder.ok("sweep s.toml -o out.csv --restart");
        let (header, rows) = rows(&folder.text("out.csv"));
        let mut over = [0, 0];
        for row in &rows {
            let at = |column: &str| row[header.iter().position(|h| h == column).unwrap()].clone();
            let text = scenario
                .replace("speed = \"10m/s\"", &format!("speed = \"{}m/s\"", at("speed_m_per_s[A]")))
                .replace(
                    "{ name = \"B2\", mass = \"20t\" }",
                    &format!("{{ name = \"B2\", mass = \"{}kg\" }}", at("mass_kg[B2]")),
                );
            folder.put("one.toml", &format!("{text}{limits}"));
            let run = folder.json("simulate one.toml -q --json");
            let number = |column: String| at(&column).parse::<f64>().ok();
            let g = |value: &Value| value.as_f64().map(|g| g * 9.80665);
            let close = |a: Option<f64>, b: Option<f64>| match (a, b) {
                (Some(a), Some(b)) => (a - b).abs() <= 1e-12 * b.abs(),
                (a, b) => a == b,
            };
            for body in run["summary"]["bodies"].as_array().unwrap() {
                let name = body["name"].as_str().unwrap();
                for (key, expected) in [
                    ("moving_mean_deceleration_m_per_s2", g(&body["moving_mean_deceleration_g"])),
                    (
                        "main_mean_deceleration_m_per_s2",
                        g(&body["main_mean_deceleration_g"]).or(g(&body["mean_deceleration_g"])),
                    ),
                    ("secondary_impact_m_per_s", body["secondary_impact_m_per_s"].as_f64()),
                    ("occupant_load_m_per_s2", g(&body["occupant_load_g"])),
                ] {
                    assert!(close(number(format!("{key}[{name}]")), expected), "{key} {name}");
                }
            }
            for interface in run["summary"]["interfaces"].as_array().unwrap() {
                let name = interface["name"].as_str().unwrap();
                assert_eq!(number(format!("energy_J[{name}]")), interface["energy_J"].as_f64());
            }
            let judged = &run["summary"]["limits"];
            let list = |value: &Value| value.as_array().unwrap().clone();
            let names = list(&judged["occupants"][0]["over"]);
            let has_all = list(&judged["occupants"][0]["unknown"]).is_empty();
            let is_known =
                list(&judged["beyond_data"]).is_empty() && (has_all || !names.is_empty());
            assert!(names.iter().all(|name| name.as_str().unwrap().starts_with('A')), "{names:?}");
            let expected = is_known.then_some(if names.is_empty() { 0.0 } else { 1.0 });
            assert_eq!(number("over_limits".into()), expected);
            over[0] += usize::from(expected == Some(1.0));
            over[1] += usize::from(is_known);
        }
        assert!(over[0] > 0 && over[0] < over[1], "{over:?}");
        assert_eq!(over[1] == 60, nose == 3.0, "{over:?}");
        let unknown = 60 - over[1];
        let expected = match unknown {
            0 => "confidence interval".to_string(),
            _ => format!("%: {unknown} are not known)"),
        };
        says(&printed, &format!("over a limit: {} of 60 runs (", over[0]));
        says(&printed, &expected);
        let report = folder.json("sweep s.toml --json -q -o out.csv");
        let found = |varied: &str, result: &str| {
            let of = report["sensitivities"].as_array().unwrap().iter();
            let of = of.filter(|s| s["varied"] == varied && s["result"] == result);
            of.map(|s| s["rank_correlation"].as_f64().unwrap()).next().unwrap()
        };
        let peak = "energy_J[A1|B1]";
        assert!(found("speed_m_per_s[A]", peak) > 0.98, "{report}");
        assert!(found("mass_kg[B2]", peak).abs() < 0.4, "{report}");
        says(&printed, "rank corr. mass_kg[B2]");
        let share = &report["share_over_limits"];
        assert_eq!((&share["over"], &share["unknown"]), (&over[0].into(), &unknown.into()));
        assert_eq!(share["interval_95"].is_array(), unknown == 0, "{share}");
    }
    // Of more quantities than a table has room for, --verbose shows what follows them.
    let many: String = ["A1", "A2", "B1", "B2"]
        .map(|name| format!("{{ what = \"mass\", vehicle = \"{name}\", distribution = \"uniform\", from = \"19t\", to = \"21t\" }}, "))
        .concat();
    let many = plan
        .replace("samples = 60", "samples = 12")
        .replace(", \"over_limits\"", "")
        .replace("vary = [", &format!("vary = [ {many}{{ what = \"force\", curve = \"nose\", distribution = \"normal\", mean = 1, sd = 0.1 }}, {{ what = \"force\", curve = \"inner\", distribution = \"normal\", mean = 1, sd = 0.1 }},"))
        .replace("{ what = \"mass\", vehicle = \"B2\", distribution = \"uniform\", from = \"19t\", to = \"21t\" } ]", "]");
    folder.put("s.toml", &format!("{scenario}{many}"));
    says(&folder.ok("sweep s.toml -o many.csv"), "quantities: with --verbose or --json");
    says(&folder.ok("sweep s.toml -o many.csv --verbose"), "rank corr. force_factor[inner]");
    folder.put("s.toml", &format!("{scenario}{plan}"));
    let said = folder.fails(1, "sweep s.toml -o other.csv");
    says(&said, "sweep.results: over_limits needs limits: give the scenario [limits]");
}

/// A member of a band drives as the edge of the same force's band does that another export wrote; gives the crushes.
fn members_are_between_the_edges(here: &Path, force: &str, sweep: &str) -> Vec<f64> {
    crumple_ok(here, &["export", "lead50.json", "--force", force, "-o", "own.csv"]);
    let csv = fs::read_to_string(here.join("own.csv")).unwrap();
    for (name, column) in [("low", 2), ("high", 3)] {
        let lines = csv.lines().filter(|l| !l.starts_with('#')).skip(1);
        let points = lines.map(|l| l.split(',').collect::<Vec<_>>());
        let points: Vec<String> = points.map(|p| format!("{},{}\n", p[0], p[column])).collect();
        fs::write(here.join(format!("{name}.csv")), format!("d_m,force_N\n{}", points.concat()))
            .unwrap();
    }
    fs::write(here.join("s.toml"), scenario_of("lead50.json", force, sweep)).unwrap();
    let out = format!("{force}.csv");
    crumple_ok(here, &["sweep", "s.toml", "-q", "-o", &out]);
    let (header, rows) = rows(&fs::read_to_string(here.join(&out)).unwrap());
    assert_eq!(header, ["item", "band[c]", "max_deflection_m[A1|wall]", "status", "message"]);
    let crush: Vec<f64> = rows.iter().map(|r| r[2].parse().unwrap()).collect();
    for (row, file) in [(0, "low.csv"), (1, "lead50.json"), (2, "high.csv")] {
        fs::write(here.join("one.toml"), scenario_of(file, force, "")).unwrap();
        let run = crumple_ok(here, "simulate one.toml -q --json");
        let run: Value = serde_json::from_str(&run).unwrap();
        let expected = run["summary"]["interfaces"][0]["max_deflection_m"].as_f64().unwrap();
        assert!((crush[row] / expected - 1.0).abs() < 1e-6, "{file}: {} {expected}", crush[row]);
    }
    assert!(crush[0] > 1.03 * crush[1] && crush[1] > 1.03 * crush[2], "{crush:?}");
    crush
}

/// One vehicle against a wall by a curve of this file and force.
fn scenario_of(file: &str, force: &str, sweep: &str) -> String {
    format!(
        "[run]\nduration = \"150ms\"\nstep = \"0.1ms\"\n[curves]\nc = {{ file = \"{file}\", force = \"{force}\" }}\n\
         [[train]]\nname = \"A\"\nspeed = \"12m/s\"\nvehicles = [ {{ name = \"A1\", mass = \"24t\" }} ]\n\
         [wall]\n[contact]\ncurve = \"c\"\n{sweep}"
    )
}

#[test]
fn band_members_are_between_the_edges() {
    let folder = demo_folder();
    let here = folder.path();
    let plan = "[sweep]\nvary = [ { what = \"band\", curve = \"c\", from = -1, to = 1, steps = 3 } ]\nresults = [\"max_deflection\"]\n";
    let [contact, body] =
        ["contact", "body"].map(|force| members_are_between_the_edges(here, force, plan));
    assert_ne!(contact, body);
    // The demo's own plan: a model's curve at each speed and member, and with other masses.
    let demo = fs::read_to_string(here.join("scenario.toml")).unwrap();
    let (own, rest) = demo.split_once("[sweep]").unwrap();
    let masses = "    { what = \"mass\", vehicle = \"A1\", values = [\"24t\", \"26t\"] },\n]";
    fs::write(
        here.join("s.toml"),
        format!("{own}[sweep]{}", rest.replacen("\n]", &format!("\n{masses}"), 1)),
    )
    .unwrap();
    crumple_ok(here, "sweep s.toml -q -o demo.csv");
    let (header, rows) = self::rows(&fs::read_to_string(here.join("demo.csv")).unwrap());
    assert_eq!(header[..4], ["item", "speed_m_per_s[A]", "band[nose]", "mass_kg[A1]"]);
    assert_eq!(rows.len(), 30);
    for row in [&rows[1], &rows[16], &rows[28]] {
        let text = own
            .replace("\"50km/h\"", &format!("\"{}m/s\"", row[1]))
            .replace("force = \"body\" }", &format!("force = \"body\", band = {} }}", row[2]))
            .replace("\"24t\"", &format!("\"{}kg\"", row[3]));
        fs::write(here.join("one.toml"), text).unwrap();
        let run = crumple_ok(here, "simulate one.toml -q --json");
        let run: Value = serde_json::from_str(&run).unwrap();
        let interface = &run["summary"]["interfaces"][0];
        assert_eq!(row[4].parse().ok(), interface["peak_force_N"].as_f64(), "{row:?}");
        assert_eq!(row[5].parse().ok(), interface["max_deflection_m"].as_f64(), "{row:?}");
    }
    // What has no band says so.
    fs::write(here.join("s.toml"), scenario_of("low.csv", "contact", plan)).unwrap();
    let error = crumple_fails(here, 1, "sweep s.toml -o no.csv");
    says(&error, "sweep.vary 1 (band): curve \"c\" has no band: only a model");
}

/// Factors multiply what the scenario has; `each` draws for every vehicle by itself.
#[test]
fn factors_and_each() {
    let folder = Folder::new(DRAWN);
    let preview = folder.json("sweep s.toml --dry-run --json");
    assert_eq!(preview["items"], 80);
    let columns: Vec<&str> =
        preview["columns"].as_array().unwrap().iter().map(|c| c.as_str().unwrap()).collect();
    assert_eq!(
        columns[..7],
        [
            "item",
            "mass_factor[A1]",
            "mass_factor[A2]",
            "mass_factor[B1]",
            "mass_factor[B2]",
            "force_factor[inner]",
            "gap_m[inner]"
        ]
    );
    let first = preview["first"].as_array().unwrap();
    let values = |k: usize| -> Vec<f64> {
        let values = first[k][1].as_array().unwrap();
        values.iter().map(|v| v.as_str().unwrap().parse().unwrap()).collect()
    };
    let of_first = values(0);
    assert!(of_first[..4].iter().all(|f| (0.9..1.2).contains(f)));
    assert!((1..4).all(|k| of_first[k] != of_first[0]), "{of_first:?}");
    // One factor for all: twice the masses and forces is the same motion.
    let folder = Folder::new(
        "[sweep]\nvary = [ { what = \"mass\", vehicles = \"all\", factor = true, values = [1, 2] },\n\
         { what = \"force\", curve = \"inner\", values = [1, 2] },\n\
         { what = \"force\", curve = \"nose\", values = [1, 2] } ]\n",
    );
    // An unloading stiffness that is requested is not scaled, the curve's own is.
    let text = folder.text("s.toml");
    folder.put(
        "s.toml",
        &text.replace(", unloading = \"200MN/m\"", "").replace(", unloading = \"100MN/m\"", ""),
    );
    folder.ok("sweep s.toml -q -o out.csv");
    let (header, rows) = rows(&folder.text("out.csv"));
    let at = |row: usize, column: &str| -> f64 {
        rows[row][header.iter().position(|h| h == column).unwrap()].parse().unwrap()
    };
    for column in ["max_deflection_m[A1|B1]", "final_v_m_per_s[B2]", "max_deflection_m[A1|A2]"] {
        assert!((at(0, column) / at(7, column) - 1.0).abs() < 1e-9, "{column}");
        assert!((at(0, column) / at(3, column) - 1.0).abs() > 1e-3, "{column}");
    }
    assert!((2.0 * at(0, "peak_force_N[A1|B1]") / at(7, "peak_force_N[A1|B1]") - 1.0).abs() < 1e-9);
}

#[test]
fn the_same_bytes_for_any_threads_pieces_and_shards() {
    for (plan, of_one_impact) in [(GRID, false), (DRAWN, false), (SPEEDS, true)] {
        let folder = Folder::new(plan);
        if of_one_impact {
            let head = "# force_kind: body\n# speed_m_per_s: 10\n# speed_kind: closing\n";
            folder.put("nose.csv", &format!("{head}{}", folder.text("nose.csv")));
        }
        let run = |threads: &str, name: &str| {
            let status = Command::new(env!("CARGO_BIN_EXE_crumple"))
                .args(["sweep", "s.toml", "-q", "-o", name])
                .env("RAYON_NUM_THREADS", threads)
                .current_dir(folder.path())
                .stdout(Stdio::null())
                .status();
            assert!(status.unwrap().success());
            folder.read(name)
        };
        let whole = run("1", "one.csv");
        if of_one_impact {
            // What is said of the curve is said of the speed of the row itself.
            let (names, rows) = rows(std::str::from_utf8(&whole).unwrap());
            for row in rows {
                let speed: f64 = row[1].parse::<f64>().unwrap() * 3.6;
                let message = &row[names.len() - 1];
                match message.split_once("closes at ") {
                    Some((_, rest)) => {
                        let shown: f64 = rest.split_once(" km/h").unwrap().0.parse().unwrap();
                        assert!((shown - speed).abs() < 0.01, "{row:?}");
                    }
                    None => assert!((speed / 36.0 - 1.0).abs() <= 0.05, "{row:?}"),
                }
            }
        }
        assert!(whole == run("2", "two.csv"));
        assert!(whole == run("5", "five.csv"));
        let whole_h5 = run("2", "two.h5");
        let stdout = crumple_in(folder.path(), "sweep s.toml -q -o -");
        assert!(stdout.stdout == whole);
        let sweep = folder.load();
        for items in [1, 3, 1000] {
            let name = format!("by{items}.csv");
            let options = WriteOptions { chunk: Chunk::Items(items), ..WriteOptions::default() };
            folder.write(&sweep, &name, &options).unwrap();
            assert!(folder.read(&name) == whole, "in pieces of {items}");
        }
        for count in [1, 2, 3, 7, 100] {
            let mut parts = Vec::new();
            for index in 1..=count {
                let name = format!("{index}of{count}.csv");
                let shard = Shard::new(index, count).unwrap();
                let options = WriteOptions { shard, ..WriteOptions::default() };
                folder.write(&sweep, &name, &options).unwrap();
                parts.push(folder.path().join(name));
            }
            parts.rotate_left(count as usize / 2);
            let merged = folder.path().join(format!("merged{count}.csv"));
            let report = merge(&parts, &merged).unwrap();
            assert_eq!(report.done, sweep.items());
            assert!(fs::read(&merged).unwrap() == whole, "{count} shards");
            let merged = folder.path().join("converted.h5");
            merge(&parts, &merged).unwrap();
            assert!(fs::read(&merged).unwrap() == whole_h5);
        }
    }
}

/// Many items, and no message in any row.
const MANY: &str = "[sweep]\nseed = 3\nsamples = 9000\n\
    vary = [ { what = \"mass\", vehicle = \"A2\", distribution = \"uniform\", from = \"18t\", to = \"22t\" } ]\n";

/// Values of HDF5 and CSV are the same numbers; h5py is the judge.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn h5py_finds_in_hdf5_what_csv_holds() {
    let folder = Folder::new(FAILING);
    assert!(compare_with_csv(&folder) > 20);
}

/// The same for a file that is not put together in memory, and of its shards.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn h5py_finds_in_large_hdf5_what_csv_holds() {
    let folder = Folder::new(MANY);
    // Some interface of every row has not opened: no restitution.
    compare_with_csv(&folder);
    assert!(!folder.text("out.csv").contains("warning"), "no row has a message");
    for k in 1..=2 {
        folder.ok(&format!("sweep s.toml -q --shard {k}/2 -o p{k}.csv"));
    }
    folder.ok("sweep -q merge -o all.h5 p1.csv p2.csv");
    folder.ok("sweep merge -q -o converted.h5 out.csv");
    // Options of a sweep are none of its merge.
    says(&folder.fails(2, "sweep --restart merge -o all.csv p1.csv p2.csv"), "cannot be used with");
    let whole = folder.read("out.h5");
    assert!(whole.len() > 1 << 20);
    assert!(folder.read("all.h5") == whole && folder.read("converted.h5") == whole);
}

/// Runs the sweep to both; how many fields are empty in CSV.
fn compare_with_csv(folder: &Folder) -> usize {
    folder.ok("sweep s.toml -q -o out.csv");
    folder.ok("sweep s.toml -q -o out.h5");
    let script = "import csv, h5py, math\n\
        lines = [l for l in open('out.csv', newline='') if not l.startswith('#')]\n\
        rows = list(csv.DictReader(lines))\n\
        f = h5py.File('out.h5')\n\
        assert f.attrs['format'] == 'crumple sweep' and f.attrs['items'] == len(rows)\n\
        names = [n.decode() for n in f['columns'][:]]\n\
        assert names[:-2] == list(rows[0])[:-1], names\n\
        failed = 0\n\
        for name in names[:-2]:\n\
        \x20   column = f[name][:]\n\
        \x20   assert len(column) == len(rows)\n\
        \x20   for row, value in zip(rows, column):\n\
        \x20       if column.dtype.kind in 'SO':\n\
        \x20           assert value.decode() == row[name]\n\
        \x20       elif row[name] == '':\n\
        \x20           assert math.isnan(value); failed += 1\n\
        \x20       else:\n\
        \x20           assert float(row[name]) == value\n\
        for row, number in zip(rows, f['message_number'][:]):\n\
        \x20   assert f['message'][number].decode() == row['message']\n\
        print(failed)\n";
    let output = python().args(["-c", script]).current_dir(folder.path()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap().trim().parse().unwrap()
}

/// Of six items two never meet, one has no mass.
const FAILING: &str = "[sweep]\n\
    vary = [ { what = \"speed\", train = \"B\", values = [\"0m/s\", \"10m/s\"] },\n\
    { what = \"mass\", vehicle = \"A1\", values = [\"24t\", \"0t\", \"30t\"] } ]\n";

#[test]
fn items_that_fail_are_rows_with_their_reason() {
    let folder = Folder::new(FAILING);
    let error = crumple_fails(folder.path(), 0, "sweep s.toml -o out.csv");
    says(&error, "4 of 6 items failed; their rows give the reason");
    says(&error, "item 1: the mass of A1 is 0 kg: expected more than 0");
    let (_, rows) = rows(&folder.text("out.csv"));
    let status: Vec<&str> = rows.iter().map(|r| r[r.len() - 2].as_str()).collect();
    // The others end while the trains still load each other.
    assert_eq!(status, ["warned", "failed", "warned", "failed", "failed", "failed"]);
    assert!(rows[0].last().unwrap().contains("while the contact still loads A2, A1, B1, B2"));
    let message = rows[3].last().unwrap();
    assert!(
        message.starts_with("train \"A\" at 36 km/h never meets what is in front"),
        "{message}"
    );
    assert!(rows[3][3..rows[3].len() - 2].iter().all(String::is_empty), "no results");
    // The same again is done, and --strict says that there are failures.
    let again = crumple_in(folder.path(), "sweep s.toml -q --strict -o out.csv");
    assert_eq!(again.status.code(), Some(3));
    // The last shard has failures alone; it is one like the others, and joins them.
    for shard in ["1", "2"] {
        folder.ok(&format!("sweep s.toml -q --shard {shard}/2 -o p{shard}.csv"));
    }
    folder.ok("sweep merge -q p1.csv p2.csv -o joined.csv");
    assert_eq!(folder.text("joined.csv"), folder.text("out.csv"));
    // None is done.
    let folder = Folder::new(
        "[sweep]\nvary = [ { what = \"speed\", train = \"A\", values = [\"0m/s\", \"-1m/s\"] } ]\n",
    );
    let error = crumple_fails(folder.path(), 1, "sweep s.toml -o out.csv");
    says(&error, "2 of 2 items failed; their rows give the reason");
    // A curve that ends.
    let folder = Folder::new(
        "[sweep]\nvary = [ { what = \"speed\", train = \"A\", values = [\"3m/s\", \"40m/s\"] } ]\n",
    );
    let text = folder.text("s.toml");
    folder.put(
        "s.toml",
        &text.replace("unloading = \"200MN/m\" }", "unloading = \"200MN/m\", end = \"error\" }"),
    );
    folder.ok("sweep s.toml -q -o out.csv");
    assert!(folder.text("out.csv").contains("beyond the end of its curve's data (0.6000 m)"));
    // The crush beyond the end of a curve that is held is a warning.
    folder.put("s.toml", &text);
    folder.ok("sweep s.toml -q -o held.csv");
    let text = folder.text("held.csv");
    says(&text, ",warned,");
    says(&text, "beyond the end of its curve's data at 0.6000 m");
}

/// A sweep ends with as many draws as a stated precision needs: the bytes are those of a plan with so many samples, also
/// after an interruption, and whatever was run before is kept.
#[test]
fn a_stated_precision_ends_a_sweep() {
    let plan = SPEEDS.replace("samples = 40", "samples = 4000");
    let folder = Folder::new(&plan);
    let column = "max_deflection_m[A1|B1]";
    let asked = |half_width: f64| {
        format!("sweep s.toml -o out.csv --until {column}={half_width} --json -q")
    };
    let report = |half_width: f64| folder.json(&asked(half_width));
    let width = |report: &Value| {
        let columns = report["columns"].as_array().unwrap();
        let of = columns.iter().find(|of| of["column"] == column).unwrap();
        1.959_964 * of["sd"].as_f64().unwrap() / of["count"].as_f64().unwrap().sqrt()
    };
    let rough = report(0.02);
    let rows = rough["rows"].as_u64().unwrap();
    assert!(width(&rough) <= 0.02 && rows >= 100, "{rough}");
    let until = &rough["until"];
    assert_eq!(
        (&until["is_reached"], &until["numbers"], &rough["resumed"]),
        (&true.into(), &rows.into(), &0.into())
    );
    assert!((until["half_width"].as_f64().unwrap() / width(&rough) - 1.0).abs() < 1e-6);
    let fine = report(0.008);
    let more = fine["rows"].as_u64().unwrap();
    assert!(width(&fine) <= 0.008 && more > rows && more < 4000, "{rows} and {more}");
    let out = folder.read("out.csv");
    // Of the values themselves, by a second route.
    let (header, lines) = self::rows(&String::from_utf8(out.clone()).unwrap());
    let at = header.iter().position(|h| h == column).unwrap();
    let values: Vec<f64> = lines.iter().map(|line| line[at].parse().unwrap()).collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let sd =
        (values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / (more - 1) as f64).sqrt();
    assert!((1.959_964 * sd / (more as f64).sqrt() / width(&fine) - 1.0).abs() < 1e-9);
    folder.put("s.toml", &format!("{SCENARIO}{}", plan.replace("4000", &more.to_string())));
    folder.ok("sweep s.toml -o plain.csv -q");
    assert_eq!(folder.read("plain.csv"), out, "the sweep of so many samples");
    folder.put("s.toml", &format!("{SCENARIO}{plan}"));
    // Asked for less again, nothing is run; what cannot be reached ends with the plan's samples, and says so.
    assert_eq!(report(0.02)["resumed"], more);
    let said = folder.ok(&asked(1e-4).replace(" --json -q", ""));
    assert!(said.contains("after 4000 runs") && said.contains("± 0.0001 not reached"), "{said}");
    // A link keeps its place, and its target grows.
    #[cfg(unix)]
    {
        fs::create_dir(folder.path().join("there")).unwrap();
        std::os::unix::fs::symlink("there/real.csv", folder.path().join("link.csv")).unwrap();
        for (path, half_width) in [("there/real.csv", 0.5), ("link.csv", 0.02)] {
            folder.ok(&format!("sweep s.toml -o {path} --until {column}={half_width} -q"));
        }
        assert!(folder.path().join("link.csv").is_symlink());
        assert_eq!(self::rows(&folder.text("there/real.csv")).1.len() as u64, rows);
    }
    for (arguments, says) in [
        ("--until max_deflection_m[A1|B1]=1 -o -", "name it with -o"),
        (
            "--until nothing=1 -o a.csv",
            "there is no result \"nothing\": name it in results of [sweep], or one of ",
        ),
        ("--until x -o a.csv", "is not a precision"),
        ("--until max_deflection_m[A1|B1]=-1 -o a.csv", "is not a precision"),
        ("--until max_deflection_m[A1|B1]=1 -o a.h5", "--until writes one .csv file"),
        ("--until max_deflection_m[A1|B1]=1 -o a.csv --plan grid.toml", "drawn at random"),
    ] {
        folder.put("grid.toml", GRID);
        let all = format!("sweep s.toml {arguments}");
        let code = if ["is not a precision", "name it with -o"].contains(&says) { 2 } else { 1 };
        let error = crumple_fails(folder.path(), code, &all.split(' ').collect::<Vec<_>>());
        assert!(error.contains(says), "{arguments}: {error}");
    }
}

/// Runs without a known verdict are left out of the sample: the share they leave open is in the interval.
#[test]
fn what_is_not_known_is_not_precise() {
    let plan = SPEEDS
        .replace("samples = 40", "samples = 300\nresults = [\"max_deflection\", \"over_limits\"]");
    let limits = "[limits]\nstandard = \"own\"\nedition = \"1\"\nmean_deceleration_g = 1.0\nsecondary_impact = \"50m/s\"\n";
    let folder = Folder::new("");
    // Too short for some of the runs: vehicles are still loaded at the end.
    let text = SCENARIO.replace("60ms", "200ms");
    folder.put("nose.csv", "d_m,force_MN\n0,0\n0.02,3\n0.05,1.6\n5,2\n");
    folder.put("s.toml", &format!("{text}{limits}{plan}"));
    let report = folder.json("sweep s.toml -o out.csv --until over_limits=0.02 --json -q");
    let until = &report["until"];
    let (numbers, rows) = (until["numbers"].as_u64().unwrap(), report["rows"].as_u64().unwrap());
    assert!(numbers < rows, "some are not known: {report}");
    assert!(
        until["half_width"].as_f64().unwrap() >= 0.5 * (rows - numbers) as f64 / rows as f64,
        "{until}"
    );
    // More rows would not help, so that it ends early.
    assert_eq!((rows, &until["is_reached"]), (100, &false.into()));
    let output = crumple_in(folder.path(), "sweep s.toml -o again.csv --until over_limits=0.02");
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("it is not known in") && said.contains("that alone leaves ±"), "{said}");
    // The table says of how many rows its numbers are.
    let printed = folder.ok("sweep s.toml -o table.csv");
    let said = "numbers of some rows only: over_limits (known in ";
    assert!(printed.contains(said) && printed.contains(" of 300)"), "{printed}");
    assert!(printed.contains("rank correlation; below 0."), "{printed}");
}

/// Values that are drawn at each point of a grid may follow one another by chance, too.
#[test]
fn correlations_of_drawn_values_on_a_grid_may_be_chance() {
    let vary = "{ what = \"speed\", train = \"A\", from = \"10m/s\", to = \"12m/s\", steps = 2 }";
    let mass = "{ what = \"mass\", vehicles = \"all\", factor = true, distribution = \"uniform\", from = 0.9, to = 1.1 }";
    let folder = Folder::new(&format!("[sweep]\nsamples = 40\nvary = [ {vary}, {mass} ]\n"));
    let printed = folder.ok("sweep s.toml -o out.csv");
    assert!(printed.contains("rank correlation; below 0.22 it may be chance"), "{printed}");
    let grid =
        Folder::new(&format!("[sweep]\nvary = [ {} ]\n", vary.replace("steps = 2", "steps = 9")));
    let printed = grid.ok("sweep s.toml -o out.csv");
    assert!(!printed.contains("may be chance"), "{printed}");
}

/// What a row's own numbers are in is the row's, whether or not the scenario as written has the like.
#[test]
fn rows_are_warned_of_whatever_the_scenario_says() {
    let demo = demo_folder();
    let here = demo.path();
    let warned = |speed: &str| {
        let text = format!(
            "[run]\nduration = \"250ms\"\n[curves]\nnose = {{ database = \"curves.h5\", case = \"lead-car-wall/72kmh\" }}\n\
             [[train]]\nname = \"A\"\nspeed = \"{speed}\"\nvehicles = [ {{ name = \"A1\", mass = \"24t\" }} ]\n\
             [wall]\n[contact]\ncurve = \"nose\"\n[sweep]\n\
             vary = [ {{ what = \"speed\", train = \"A\", values = [\"20km/h\", \"36km/h\"] }} ]\n"
        );
        std::fs::write(here.join("warned.toml"), text).unwrap();
        let output = crumple_in(here, "sweep warned.toml -o warned.csv --json --restart");
        let report: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        (report["warned"].as_u64().unwrap(), String::from_utf8(output.stderr).unwrap())
    };
    let (rows, said) = warned("36km/h");
    // At 36 km/h the row repeats what was said of the scenario.
    assert_eq!(rows, 1, "{said}");
    assert!(said.contains("the scenario as written: curve \"nose\": it is for 72 km/h"), "{said}");
    assert_eq!(warned("72km/h").0, 2);
}

/// Warnings of many rows are counted by what they say, and a grid has no percentiles.
#[test]
fn reasons_are_counted_and_grids_have_no_percentiles() {
    let grid = "[sweep]\nvary = [ { what = \"speed\", train = \"A\", from = \"10m/s\", to = \"30m/s\", steps = 9 } ]\n";
    let folder = Folder::new(grid);
    let output = crumple_in(folder.path(), &["sweep", "s.toml", "-o", "out.csv"]);
    let (said, table) =
        (String::from_utf8_lossy(&output.stderr), String::from_utf8_lossy(&output.stdout));
    let (_, rows) = rows(&folder.text("out.csv"));
    let warned = rows.iter().filter(|row| row[row.len() - 2] == "warned").count();
    assert!(warned > 1, "{said}");
    assert!(
        said.contains(&format!("{warned} of 9 items have warnings in their rows:\n")),
        "{said}"
    );
    // With the range of the numbers that differ.
    let reason = said.split(" × interface ").nth(1).unwrap();
    let (_, crushed) = reason.split_once(" is crushed ").unwrap();
    let [low, "to", high, "m,", ..] = crushed.split(' ').collect::<Vec<_>>()[..] else {
        panic!("{said}")
    };
    assert!(low.parse::<f64>().unwrap() < high.parse().unwrap(), "{said}");
    assert!(!table.contains("median") && table.contains("mean"), "{table}");
    let drawn = Folder::new(SPEEDS);
    says(&drawn.ok("sweep s.toml -o out.csv"), "median");
}

#[test]
fn the_report_counts_and_summarises() {
    let folder = Folder::new(FAILING);
    let report = folder.json("sweep s.toml --json -q -o out.csv");
    assert_eq!(report["items"], 6);
    let counts = ["failed", "warned", "done", "resumed"].map(|key| report[key].as_u64().unwrap());
    assert_eq!(counts, [4, 2, 6, 0]);
    let columns = report["columns"].as_array().unwrap();
    let mass = &columns[1];
    assert_eq!(mass["column"], "mass_kg[A1]");
    assert_eq!((mass["min"].as_f64(), mass["max"].as_f64()), (Some(0.0), Some(30e3)));
    assert_eq!((mass["mean"].as_f64(), mass["median"].as_f64()), (Some(18e3), Some(24e3)));
    let again = folder.json("sweep s.toml --json -q -o out.csv");
    assert_eq!(again["resumed"], 6);
    assert_eq!(again["columns"], report["columns"]);
    let converted = folder.json("sweep s.toml --json -q -o out.h5");
    let again = folder.json("sweep s.toml --json -q -o out.h5");
    assert_eq!(converted["columns"], report["columns"]);
    assert_eq!((&again["columns"], &again["failed"]), (&report["columns"], &report["failed"]));
    assert_eq!(again["messages"], report["messages"]);
}

/// Killed at any moment and started again until it is done: the file of a run that was not.
#[cfg(unix)]
#[test]
fn a_killed_run_goes_on_without_loss() {
    for name in ["out.csv", "out.h5"] {
        let folder = Folder::new(DRAWN);
        let text = folder.text("s.toml").replace("samples = 40", "samples = 300");
        let text = text.replace("\"0.2ms\"", "\"0.01ms\"").replace("\"60ms\"", "\"600ms\"");
        folder.put("s.toml", &text);
        let arguments = ["sweep", "s.toml", "-q", "-o", name];
        let part = folder.path().join(format!("{name}.part"));
        let length = || fs::metadata(&part).map_or(0, |m| m.len());
        let mut kills = 0;
        for round in 0u64.. {
            let before = length();
            let mut child = Command::new(env!("CARGO_BIN_EXE_crumple"))
                .args(arguments)
                .current_dir(folder.path())
                .stdout(Stdio::null())
                .spawn()
                .unwrap();
            // Each round gets further; then it is killed, at moments that differ.
            let ended = loop {
                match child.try_wait().unwrap() {
                    Some(status) => break Some(status),
                    None if length() > before + 4000 => break None,
                    None => std::thread::sleep(Duration::from_millis(1)),
                }
            };
            if let Some(status) = ended {
                assert!(status.success());
                break;
            }
            std::thread::sleep(Duration::from_micros(round * 7919 % 40_000));
            child.kill().unwrap();
            child.wait().unwrap();
            kills += 1;
        }
        assert!(kills >= 1);
        assert_eq!(folder.names(), [name], "neither part nor lock stays");
        folder.ok(&format!("sweep s.toml -q -o whole-{name}"));
        assert!(folder.read(name) == folder.read(&format!("whole-{name}")), "{kills} kills");
    }
}

/// A kill while rows that are all there are put into their last form.
#[test]
fn what_a_kill_left_of_the_last_form_is_cleared() {
    let folder = Folder::new(GRID);
    for shard in ["1", "2"] {
        folder.ok(&format!("sweep s.toml -q --shard {shard}/2 -o p{shard}.csv"));
    }
    let before = folder.names();
    for (name, command) in [
        ("out.h5", "sweep s.toml -q -o out.h5"),
        ("all.h5", "sweep merge -q -o all.h5 p1.csv p2.csv"),
        ("all.csv", "sweep merge -q -o all.csv p1.csv p2.csv"),
    ] {
        folder.ok(command);
        let whole = folder.read(name);
        fs::remove_file(folder.path().join(name)).unwrap();
        folder.put(&format!(".crumple-{name}.part"), "half");
        folder.ok(command);
        assert!(folder.read(name) == whole, "{name}");
        if command.starts_with("sweep s.toml") {
            folder.put(&format!("{name}.part"), "rows");
            folder.ok(command);
            assert!(folder.read(name) == whole, "{name}");
        }
        fs::remove_file(folder.path().join(name)).unwrap();
        assert_eq!(folder.names(), before, "{name}");
    }
}

/// What a kill or a lost disk can leave at the end of the file under work.
#[test]
fn a_torn_end_is_cut() {
    let folder = Folder::new(GRID);
    let sweep = folder.load();
    let options = WriteOptions::default();
    folder.write(&sweep, "whole.csv", &options).unwrap();
    let whole = folder.read("whole.csv");
    let part = folder.path().join("out.csv.part");
    let sum = |line: &[u8]| format!("{}\n", &blake3::hash(line).to_hex()[..16]);
    let sums: String = whole.split_inclusive(|b| *b == b'\n').skip(8).map(sum).collect();
    let go_on = |left: &[u8]| {
        fs::write(&part, left).unwrap();
        fs::write(folder.path().join("out.csv.part.sums"), &sums).unwrap();
        let resumed = folder.write(&sweep, "out.csv", &options).unwrap();
        assert!(folder.read("out.csv") == whole, "after {} bytes", left.len());
        assert_eq!(folder.names().iter().filter(|name| name.contains(".part")).count(), 0);
        fs::remove_file(folder.path().join("out.csv")).unwrap();
        resumed
    };
    let head = whole.split(|b| *b == b'\n').take(8).map(|line| line.len() + 1).sum::<usize>();
    for length in (0..=head).step_by(13) {
        assert_eq!(go_on(&whole[..length]), 0);
    }
    let lines = |bytes: &[u8]| bytes.iter().filter(|b| **b == b'\n').count() as u64;
    let last_two = whole.len() - 600;
    for length in last_two..=whole.len() {
        assert_eq!(go_on(&whole[..length]), lines(&whole[..length]) - 8);
    }
    // Blocks that never reached the disk are zeros.
    for from in [last_two, last_two + 5, whole.len() - 1] {
        let mut zeros = whole.clone();
        zeros[from..].fill(0);
        assert_eq!(go_on(&zeros), lines(&whole[..from]) - 8);
    }
    // A row that is not the next one, and what stands behind the last one.
    let text = String::from_utf8(whole.clone()).unwrap();
    let skipped = text.lines().filter(|l| !l.starts_with("5,")).collect::<Vec<_>>().join("\n");
    assert_eq!(go_on(skipped.as_bytes()), 5);
    assert_eq!(go_on(format!("{text}12,rest\n").as_bytes()), 12);
    // One digit that is another: from its row on all is run again.
    let row = text.lines().position(|line| line.starts_with("7,")).unwrap();
    let changed: Vec<String> = text
        .lines()
        .enumerate()
        .map(|(k, line)| {
            let line = line.to_string();
            if k == row { line.replacen(",3000000.0,", ",3000001.0,", 1) } else { line }
        })
        .collect();
    let changed = changed.join("\n") + "\n";
    assert!(changed != text);
    assert_eq!(go_on(changed.as_bytes()), 7);
}

#[test]
fn another_sweeps_file_is_not_taken_up() {
    let folder = Folder::new(GRID);
    let sweep = folder.load();
    let stop = |_| ControlFlow::Break(());
    let report =
        write(&sweep, &folder.path().join("out.csv"), &WriteOptions::default(), stop).unwrap();
    assert!(!report.is_complete());
    let begun = folder.read("out.csv.part");
    let text = folder.text("s.toml");
    let changes: [(&str, &str, &str); 4] = [
        ("s.toml", "\"30t\"", "\"31t\""),
        ("s.toml", "\"10t\"", "\"11t\""),
        ("nose.csv", "0.6,2", "0.6,2.1"),
        ("s.toml", "duration = \"60ms\"", "duration = \"61ms\""),
    ];
    for (file, from, to) in changes {
        let old = folder.text(file);
        assert!(old.contains(from));
        folder.put(file, &old.replace(from, to));
        let error = folder.fails(1, "sweep s.toml -q -o out.csv");
        says(
            &error,
            "out.csv.part belongs to another sweep: the plan, the scenario or a file it names has changed since; --restart replaces it",
        );
        assert!(folder.read("out.csv.part") == begun);
        folder.put(file, &old);
    }
    let error = folder.fails(1, "sweep s.toml -q --shard 1/2 -o out.csv");
    says(&error, "it is shard 1/1, this is 1/2");
    // Comments are not a change.
    folder.put("s.toml", &format!("# a comment\n{text}"));
    folder.ok("sweep s.toml -q -o out.csv");
    // A complete one of another plan, and files that are none.
    folder.put("s.toml", &text.replace("\"30t\"", "\"31t\""));
    let before = folder.read("out.csv");
    says(&folder.fails(1, "sweep s.toml -q -o out.csv"), "out.csv belongs to another sweep");
    assert!(folder.read("out.csv") == before);
    folder.ok("sweep s.toml -q --restart -o out.csv");
    assert!(folder.read("out.csv") != before);
    for name in ["mine.csv", "mine.h5", "new.csv.part"] {
        folder.put(name, "my own numbers\n");
        let error =
            folder.fails(1, &format!("sweep s.toml -q -o {}", name.trim_end_matches(".part")));
        says(&error, &format!("{name} exists and is not a sweep result: use --restart"));
        assert_eq!(folder.text(name), "my own numbers\n");
    }
    // A complete file that lost its end.
    let whole = folder.read("out.csv");
    fs::write(folder.path().join("out.csv"), &whole[..whole.len() - 1]).unwrap();
    let error = folder.fails(1, "sweep s.toml -q -o out.csv");
    says(&error, "the row of item 11 is missing or damaged");
}

/// What cannot be written is reported; rows that are there stay for the next time.
#[cfg(target_os = "linux")]
#[test]
fn full_disks_and_missing_folders() {
    let folder = Folder::new(GRID);
    let error = folder.fails(1, "sweep s.toml -q -o /dev/full");
    says(&error, "cannot write /dev/full: No space left on device");
    says(&folder.fails(1, "sweep s.toml -q -o no/out.csv"), "cannot write no/out.csv");
    folder.ok("sweep s.toml -q -o out.csv");
    folder.ok("sweep s.toml -q -o /dev/null");
    says(&folder.fails(1, "sweep merge -o no/all.csv out.csv"), "cannot write no/all.csv");
    assert_eq!(folder.names(), ["out.csv"]);
}

#[test]
fn a_second_writer_is_known() {
    let folder = Folder::new(GRID);
    let sweep = folder.load();
    let out = folder.path().join("out.csv");
    write(&sweep, &out, &WriteOptions::default(), |_| {
        let error = folder.fails(1, "sweep s.toml -q -o out.csv");
        says(&error, "out.csv is being written by another process");
        ControlFlow::Continue(())
    })
    .unwrap();
    assert_eq!(folder.names(), ["out.csv"]);
}

/// Ctrl-C: what is done stays, and it is reported how to continue.
#[cfg(unix)]
#[test]
fn an_interrupt_ends_behind_the_rows_that_are_done() {
    let folder = Folder::new(DRAWN);
    let text = folder.text("s.toml").replace("samples = 40", "samples = 100000");
    folder.put("s.toml", &text);
    let part = folder.path().join("out.csv.part");
    let mut child = Command::new(env!("CARGO_BIN_EXE_crumple"))
        .args(["sweep", "s.toml", "-o", "out.csv"])
        .current_dir(folder.path())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while fs::metadata(&part).map_or(0, |m| m.len()) < 5000 {
        assert!(child.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(2));
    }
    let interrupt = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(interrupt.unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let error = String::from_utf8(output.stderr).unwrap();
    says(&error, "of 200000 rows; the same command resumes there");
    let done: usize =
        error.split("stopped after ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert_eq!(folder.text("out.csv.part").lines().count(), 8 + done);
    assert!(!folder.path().join("out.csv").exists());
}

#[test]
fn only_all_shards_of_one_sweep_are_merged() {
    let folder = Folder::new(GRID);
    for shard in 1..=3 {
        folder.ok(&format!("sweep s.toml -q --shard {shard}/3 -o p{shard}.csv"));
    }
    for output in ["all.csv", "all.h5"] {
        let fails = |parts: &str, expected: &str| {
            let parts = parts.replace('*', "csv");
            let error = folder.fails(1, &format!("sweep merge -o {output} {parts}"));
            assert!(error.contains(expected), "{parts}: {error}");
            assert!(!folder.names().iter().any(|n| n.starts_with("all.")), "nothing is written");
        };
        fails("p1.* p3.*", "of 3 shards 2 are given: missing 2");
        fails("p2.*", "of 3 shards 1 is given: missing 1, 3");
        fails("p1.* p2.* p1.* p3.*", "are both shard 1: give each once");
        folder.ok("sweep s.toml -q --restart --shard 2/2 -o half.csv");
        fails("p1.* half.*", "is one of 2 shards, ");
        let old = folder.text("s.toml");
        folder.put("s.toml", &old.replace("\"30t\"", "\"31t\""));
        folder.ok("sweep s.toml -q --restart --shard 3/3 -o foreign.csv");
        folder.put("s.toml", &old);
        fails("p1.* p2.* foreign.*", "are of different sweeps");
        let whole = folder.read("p2.csv");
        fs::write(folder.path().join("cut.csv"), &whole[..whole.len() - 700]).unwrap();
        fails("p1.* cut.* p3.*", "cut.csv");
        fs::write(folder.path().join("cut.csv"), &whole[..8]).unwrap();
        fails("p1.* cut.* p3.*", "cut.csv");
        folder.put("crlf.csv", &folder.text("p2.csv").replace('\n', "\r\n"));
        fails("p1.* crlf.* p3.*", "crlf.csv: another program has saved this result with");
        folder.put("s.csv", "d_m,force_N\n0,0\n1,1\n");
        fails("s.csv", "s.csv is not a result of crumple sweep");
        folder.put("empty.csv", "");
        fails("empty.csv", "empty.csv is not a result of crumple sweep");
        fails("no.csv", "no.csv: No such file");
    }
    folder.ok("sweep s.toml -q -o finished.h5");
    let error = folder.fails(1, "sweep merge -o all.csv p1.csv finished.h5 p3.csv");
    says(&error, "finished.h5 is HDF5: merge the shards as .csv");
    says(&folder.fails(2, "sweep merge -o p1.csv p1.csv p2.csv p3.csv"), "names the input itself");
    // Rows that end early, named by the first that is missing; those of a run that continues, too.
    let text = folder.text("p2.csv");
    let lines: Vec<&str> = text.lines().collect();
    folder.put("cut.csv", &(lines[..lines.len() - 1].join("\n") + "\n"));
    let error = folder.fails(1, "sweep merge -o all.csv p3.csv cut.csv p1.csv");
    says(
        &error,
        "cut.csv: its rows end before item 7, they should go on to 7: let its sweep run to the end",
    );
    folder.put("cut.csv", &text.replace("\n5,", "\n6,"));
    let error = folder.fails(1, "sweep merge -o all.csv p3.csv cut.csv p1.csv");
    says(&error, "cut.csv: the row of item 5 is missing or damaged");
    folder.put("cut.csv", &format!("{text}8,more\n"));
    let error = folder.fails(1, "sweep merge -o all.csv p3.csv cut.csv p1.csv");
    says(&error, "there is unexpected data after the last row");
}

#[test]
fn wrong_plans_are_named_by_file_and_key() {
    fn t(plan: &str, expected: &str) {
        let folder = Folder::new(&format!("[sweep]\n{plan}\n"));
        let error = folder.fails(1, "sweep s.toml -o out.csv");
        assert!(error.contains("s.toml:") && error.contains(expected), "{plan} said:\n{error}");
        assert_eq!(folder.names(), [""; 0]);
    }
    let vary = |vary: &str, expected: &str| t(&format!("vary = [ {{ {vary} }} ]"), expected);
    t("vary = []", "[sweep] varies nothing: add [[sweep.vary]]");
    t("vari = []", "s.toml:22:1: unknown field `vari`, expected one of `seed`, `samples`");
    t("seed = -1\nvary = []", "invalid value: integer `-1`");
    t(
        "sampling = \"sobol\"\nvary = []",
        "unknown variant `sobol`, expected `random` or `latin_hypercube`",
    );
    t("results = [\"peak\"]\nvary = []", "unknown variant `peak`");
    #[rustfmt::skip]
    let cases = [
        ("what = \"spede\"", "unknown variant `spede`, expected one of `speed`, `mass`"),
        ("what = \"speed\", value = [1]", "unknown field `value`"),
        ("what = \"speed\", values = [\"1m/s\"]", "sweep.vary 1 (speed): name the train: train = "),
        ("what = \"speed\", train = \"C\", values = [\"1m/s\"]", "there is no train \"C\": the scenario has A, B"),
        ("what = \"speed\", train = \"A\", values = [\"1\"]", "values: speed \"1\" has no unit"),
        ("what = \"gap\", curve = \"inner\", values = [\"-1mm\"]", "values: -1mm is out of range: expected 0 or more"),
        ("what = \"speed\", train = \"A\", vehicle = \"A1\"", "vehicle does not go with what = \"speed\""),
        ("what = \"speed\", train = \"A\", values = [true]", "expected a number, or text"),
        ("what = \"mass\", values = [\"1t\"]", "give vehicle = \"…\", or vehicles = […] or \"all\""),
        ("what = \"mass\", vehicle = \"Z9\", values = [\"1t\"]", "there is no vehicle \"Z9\": the scenario has A1, A2, B1, B2"),
        ("what = \"mass\", vehicles = \"some\", values = [\"1t\"]", "vehicles = \"some\": expected a list, or \"all\""),
        ("what = \"mass\", vehicles = 3, values = [\"1t\"]", "expected a list of vehicles, or \"all\""),
        ("what = \"mass\", vehicles = [\"A1\", \"A1\"], values = [\"1t\"]", "vehicles names \"A1\" twice"),
        ("what = \"mass\", vehicle = \"A1\", factor = true, values = [\"1t\"]", "values: \"1t\" is not a number"),
        ("what = \"gap\", interface = \"A1|A2\", values = [\"1mm\"]", "interface = \"A1|A2\": expected \"contact\""),
        ("what = \"gap\", curve = \"inner\", values = [\"1t\"]", "length \"1t\" has the unknown unit \"t\""),
        ("what = \"gap\", interface = \"contact\", factor = true, values = [1]", "the contact has no gap that a factor could change"),
        ("what = \"band\", curve = \"nose\", values = [1]", "curve \"nose\" has no band"),
        ("what = \"force\", curve = \"soft\", values = [1]", "no interface has curve \"soft\", so varying it has no effect"),
        ("what = \"force\", values = [1]", "name the curve: curve = "),
        ("what = \"curve\", curve = \"nose\", values = [\"hard\"]", "there is no curve \"hard\": the scenario has inner, nose, soft"),
        ("what = \"curve\", curve = \"nose\", from = 1, to = 2, steps = 2", "a curve needs values"),
        ("what = \"force\", curve = \"nose\", distribution = \"cauchy\"", "unknown variant `cauchy`"),
        ("what = \"force\", curve = \"nose\", distribution = \"normal\", mean = 1, sd = 0", "sd must be above 0"),
        ("what = \"force\", curve = \"nose\", distribution = \"normal\", mean = 1, sd = 1, min = 3, max = 2", "min must be less than max"),
        ("what = \"force\", curve = \"nose\", distribution = \"uniform\", from = 1, to = 1", "from must be less than to"),
        ("what = \"force\", curve = \"nose\", distribution = \"triangular\", from = 1, mode = 3, to = 2", "from, mode and to must increase"),
        ("what = \"force\", curve = \"nose\", distribution = \"uniform\", from = 1, to = 2", "add samples = … to [sweep]"),
        ("what = \"force\", curve = \"nose\", from = 1, to = 2, steps = 1000000000000000000", "the sweep has 1000000000000000000 items: 1000000000000 at most"),
    ];
    cases.into_iter().for_each(|(text, expected)| vary(text, expected));
    #[rustfmt::skip]
    let cases = [
        ("samples = 0\nvary = [ { what = \"force\", curve = \"nose\", distribution = \"uniform\", from = 1, to = 2 } ]", "sweep.samples is 0"),
        ("sampling = \"latin_hypercube\"\nvary = [ { what = \"force\", curve = \"nose\", values = [1] } ]", "sweep.sampling = \"latin_hypercube\" is given, but no variable has a distribution"),
        ("vary = [ { what = \"force\", curve = \"nose\", values = [1] }, { what = \"force\", curve = \"nose\", values = [2] } ]", "sweep.vary 2 (force): force_factor[nose] is varied twice"),
        ("vary = [ { what = \"mass\", vehicle = \"A2\", values = [\"10t\", \"60t\"] }, { what = \"mass\", vehicles = \"all\", values = [\"20t\"] } ]", "sweep.vary 2 (mass): mass_kg[all] would replace what mass_kg[A2] has set"),
        ("vary = [ { what = \"mass\", vehicles = \"all\", factor = true, values = [1.1] }, { what = \"mass\", vehicle = \"A2\", values = [\"10t\"] } ]", "sweep.vary 2 (mass): mass_kg[A2] would replace what mass_factor[all] has set"),
    ];
    cases.into_iter().for_each(|(plan, expected)| t(plan, expected));
    // Without a plan, with one elsewhere, with arguments that make no sense.
    let folder = Folder::new("");
    let error = folder.fails(1, "sweep s.toml -o out.csv");
    says(
        &error,
        "s.toml:1:1: there is no [sweep]: add one, or give it in another file with --plan",
    );
    folder.put("p.toml", GRID);
    folder.ok("sweep s.toml -q --plan p.toml -o out.csv");
    let inside = Folder::new(GRID);
    inside.ok("sweep s.toml -q -o out.csv");
    assert!(folder.read("out.csv") == inside.read("out.csv"));
    folder.put("p.toml", &GRID.replace("\"A2\"", "\"A3\""));
    let error = folder.fails(1, "sweep s.toml --plan p.toml -o new.csv");
    says(&error, ": sweep.vary 3 (mass): there is no vehicle \"A3\"");
    for (line, expected) in [
        ("sweep s.toml", "--output"),
        ("sweep", "SCENARIO"),
        ("sweep s.toml -o out.xyz", "-o out.xyz: results are written as .csv, .h5 or .hdf5"),
        ("sweep s.toml --shard 1/3 -o a.h5", "-o a.h5: a shard is written as .csv, which merge"),
        ("sweep s.toml --shard 0/3 -o a.csv", "\"0/3\" is not a shard: write for example 2/3"),
        ("sweep s.toml --shard 4/3 -o a.csv", "\"4/3\" is not a shard"),
        ("sweep s.toml --json -o -", "both write to standard output"),
        ("sweep merge -o all.csv", "SHARDS"),
    ] {
        let error = folder.fails(2, line);
        assert!(error.contains(expected), "{line}: {error}");
    }
}

/// A sweep larger than any memory is planned, and its last shard run.
#[test]
fn nothing_grows_with_the_number_of_items() {
    let folder = Folder::new(
        "[sweep]\nsamples = 1000000000000\nsampling = \"latin_hypercube\"\n\
         vary = [ { what = \"force\", curve = \"nose\", distribution = \"lognormal\", mean = 1, sd = 0.1 } ]\n",
    );
    let preview = folder.json("sweep s.toml --dry-run --json --shard 3/3");
    assert_eq!(preview["items"], 1_000_000_000_000u64);
    assert_eq!(preview["first"][0][0], 666_666_666_666u64);
    folder.ok("sweep s.toml -q --shard 250000000000/250000000000 -o out.csv");
    let (_, rows) = rows(&folder.text("out.csv"));
    assert_eq!(rows.len(), 4);
    assert_eq!(rows[3][0], "999999999999");
}

/// The example's plan is one that runs.
#[test]
fn the_example_runs() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["sweep.toml", "nose.csv", "coupler.csv"] {
        fs::copy(root().join("examples").join(name), folder.path().join(name)).unwrap();
    }
    crumple_ok(folder.path(), "sweep sweep.toml --strict -o out.csv");
    let (_, rows) = rows(&fs::read_to_string(folder.path().join("out.csv")).unwrap());
    assert_eq!(rows.len(), 100);
}

#[test]
fn help_has_examples() {
    // Every result that a plan may name.
    let help = crumple_ok(Path::new("."), "sweep --help");
    let plan = fs::read_to_string(root().join("schemas/plan.schema.json")).unwrap();
    let plan: Value = serde_json::from_str(&plan).unwrap();
    let results = plan["$defs"]["ResultName"]["oneOf"].as_array().unwrap();
    assert!(results.len() > 10);
    for result in results {
        let name = result["const"].as_str().unwrap();
        assert!(help.split([' ', ',', '.', '\n', '(']).any(|word| word == name), "{name}");
    }
    for arguments in [&["sweep", "--help"][..], &["sweep", "merge", "--help"]] {
        let help = crumple_ok(Path::new("."), arguments);
        assert!(help.contains("Examples:") && help.contains("crumple sweep merge -o"), "{help}");
    }
}

/// The Dask example on a cluster of two workers, of which one is killed at work: sweep, build and validation have the
/// bytes of one process.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn a_dask_cluster_gives_the_bytes_of_one_process() {
    let folder = demo_folder();
    let here = folder.path();
    let scenario = fs::read_to_string(here.join("scenario.toml")).unwrap();
    let scenario = scenario.split("[sweep]").next().unwrap();
    let speed = "{ what = \"speed\", train = \"A\", distribution = \"uniform\", from = \"30km/h\", to = \"70km/h\" }";
    let scenario = format!("{scenario}\n[sweep]\nsamples = 2000\nvary = [{speed}]\n");
    fs::write(here.join("many.toml"), scenario).unwrap();
    let output = python_of("CRUMPLE_PYTHON_TABLES")
        .arg(root().join("tests/python/dask_same_bytes.py"))
        .arg(root().join("examples/dask"))
        .arg(here)
        .args(["many.toml", "fe/lead-car-wall/study.toml", "curves.h5"])
        .env("CRUMPLE", env!("CARGO_BIN_EXE_crumple"))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}\n{error}");
    assert_eq!(said.matches(": the same bytes").count(), 4, "{said}\n{error}");
    says(&said, "a worker of 2 was killed");
}
