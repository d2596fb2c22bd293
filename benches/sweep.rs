//! What a sweep costs around the integrator: 16 masses, curves of 200 points, runs of one step.

use std::fs;
use std::ops::ControlFlow;
use std::path::Path;

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
    let sweep = Sweep::load(&path, None).expect("a sweep");
    bencher.counter(ItemsCount::new(ITEMS)).bench_local(|| {
        let go_on = |_| ControlFlow::Continue(());
        let mut sink = std::io::sink();
        let name = Path::new("sink");
        write_rows(&sweep, &mut sink, name, &WriteOptions::default(), go_on).expect("rows").failed
    });
}
