//! What a sweep costs: around the integrator (16 masses, curves of 200 points, runs of one step), and with curves from
//! files, curves from models, and ends of models, in whole runs.

use std::fs;
use std::ops::ControlFlow;
use std::path::Path;

use crumple::build::build;
use crumple::dataset::TrainingSet;
use crumple::surrogate::{Model, ModelKind, Query, predict};
use crumple::sweep::{Sweep, WriteOptions, write_rows};
use divan::counter::ItemsCount;

const ITEMS: u32 = 4000;

fn main() {
    divan::main();
}

/// Masses of all vehicles, a speed and a gap vary; with `force`, the coupler's law as well.
#[divan::bench(args = ["numbers", "force"], sample_count = 20, sample_size = 1)]
fn rows(bencher: divan::Bencher<'_, '_>, what: &str) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("s.toml");
    for (name, level) in [("nose.csv", 2e6), ("inner.csv", 1e6)] {
        let force = |i: i32| level * (1.0 - (-f64::from(i) / 5.0).exp());
        let points: Vec<String> =
            (0..200).map(|i| format!("{},{}\n", f64::from(i) * 0.005, force(i))).collect();
        let text = format!("d_m,force_N\n{}", points.concat());
        fs::write(folder.path().join(name), text).expect("a curve");
    }
    let train = |name: &str, speed: &str| {
        let vehicle = |i| format!("{{ name = \"{name}{i}\", mass = \"20t\" }}");
        let vehicles: Vec<String> = (1..=8).map(vehicle).collect();
        format!(
            "[[train]]\nname = \"{name}\"\nspeed = \"{speed}\"\ninner = \"inner\"\nvehicles = [ {} ]\n",
            vehicles.join(", ")
        )
    };
    let force = match what {
        "force" => {
            "{ what = \"force\", curve = \"inner\", distribution = \"uniform\", from = 0.8, to = 1.2 },\n"
        }
        _ => "",
    };
    let text = format!(
        "[run]\nduration = \"0.01ms\"\noutput_interval = \"0.01ms\"\n\
         [curves]\nnose = {{ file = \"nose.csv\", unloading = \"900MN/m\" }}\n\
         inner = {{ file = \"inner.csv\", unloading = \"900MN/m\", gap = \"10mm\" }}\n{}{}\
         [contact]\ncurve = \"nose\"\n[sweep]\nsamples = {ITEMS}\nvary = [\n\
         {{ what = \"mass\", vehicles = \"all\", each = true, factor = true, distribution = \"normal\", mean = 1, sd = 0.05 }},\n\
         {{ what = \"speed\", train = \"A\", distribution = \"uniform\", from = \"20km/h\", to = \"50km/h\" }},\n{force}\
         {{ what = \"gap\", curve = \"inner\", distribution = \"uniform\", from = \"0mm\", to = \"30mm\" }} ]\n",
        train("A", "36km/h"),
        train("B", "0km/h")
    );
    fs::write(&path, text).expect("a scenario");
    run(bencher, &path, ITEMS);
}

/// Items of whole runs.
const RUNS: u32 = 40;

/// Eight vehicles against eight at 30 to 45 km/h. Compare the rows with that of `files`.
#[divan::bench(args = ["files", "models", "ends"], sample_count = 5, sample_size = 1)]
fn curves(bencher: divan::Bencher<'_, '_>, from: &str) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    let runs = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/fe");
    for (group, speed_m_per_s) in
        [("lead-car-wall", 10.0), ("lead-car-pair", 10.0), ("vehicle-pair", 3.0)]
    {
        let study = runs.join(group).join("study.toml");
        let report = build(&study, &at("curves.h5"), |_run| {}).expect("a database");
        let set = TrainingSet::new(group, report.database.cases(group)).expect("a data set");
        let kind = ModelKind::named("crush-law", 0).filter(|_| group != "lead-car-pair");
        let model = Model::fit(&set, kind.unwrap_or(ModelKind::rate())).expect("a model");
        model.write(&at(&format!("{group}.model"))).expect("a model file");
        let curve = predict(&model, &Query::at(speed_m_per_s)).expect("a curve");
        let text = serde_json::to_string(&curve).expect("a document");
        fs::write(at(&format!("{group}.json")), text).expect("a curve");
    }
    let (key, extension) = if from == "files" { ("file", "json") } else { ("model", "model") };
    let (nose, gap, contact) = match from {
        "ends" => ("lead-car-wall", "", "gap = \"0mm\""),
        _ => ("lead-car-pair", ", gap = \"32mm\"", "curve = \"nose\""),
    };
    let train = |name: &str, speed: &str| {
        let own = |i: usize| match (from, i) {
            ("ends", 1) => ", front = { curve = \"nose\" }, rear = { curve = \"inner\" }",
            ("ends", _) => ", ends = \"inner\"",
            _ => "",
        };
        let vehicle = |i| format!("{{ name = \"{name}{i}\", mass = \"20.24t\"{} }}", own(i));
        let vehicles: Vec<String> = (1..=8).map(vehicle).collect();
        let between = if from == "ends" { "gap = \"32mm\"" } else { "inner = \"inner\"" };
        format!(
            "[[train]]\nname = \"{name}\"\nspeed = \"{speed}\"\n{between}\nvehicles = [ {} ]\n",
            vehicles.join(", ")
        )
    };
    let text = format!(
        "[run]\nduration = \"810ms\"\noutput_interval = \"0.75ms\"\ninterface_speed = \"local\"\n\
         [curves]\nnose = {{ {key} = \"{nose}.{extension}\" }}\n\
         inner = {{ {key} = \"vehicle-pair.{extension}\"{gap} }}\n{}{}\
         [contact]\n{contact}\n[sweep]\nsamples = {RUNS}\nvary = [\n\
         {{ what = \"speed\", train = \"A\", distribution = \"uniform\", from = \"30km/h\", to = \"45km/h\" }} ]\n",
        train("A", "36km/h"),
        train("B", "0km/h")
    );
    fs::write(at("s.toml"), text).expect("a scenario");
    run(bencher, &at("s.toml"), RUNS);
}

/// Measures one sweep, its files read before.
fn run(bencher: divan::Bencher<'_, '_>, path: &Path, items: u32) {
    let sweep = Sweep::load(path, None).expect("a sweep");
    bencher.counter(ItemsCount::new(items)).bench_local(|| {
        let go_on = |_| ControlFlow::Continue(());
        let mut sink = std::io::sink();
        let name = Path::new("sink");
        write_rows(&sweep, &mut sink, name, &WriteOptions::default(), go_on).expect("rows").failed
    });
}
