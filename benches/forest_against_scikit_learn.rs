//! CPU time of fits beside scikit-learn's RandomForestRegressor, as ratios from one run:
//! 50 trees, bootstrap, unpruned, all features, two threads on both sides.
//!
//!     CRUMPLE_PYTHON=target/venv/bin/python cargo bench --bench forest_against_scikit_learn
//!
//! (`tests/run` installs that Python.)

mod table;

use std::error::Error;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use cpu_time::ProcessTime;
use crumple::build::build;
use crumple::dataset::{TableKind, TrainingSet};
use crumple::forest::ForestParams;
use linfa::Dataset;
use linfa::traits::Fit;
use ndarray::Ix1;
use table::smooth;

/// Fits the table in standard input (CSV) `repeats` times; prints CPU and wall seconds a fit.
const SCRIPT: &str = "
import sys, time
import numpy as np
from sklearn.ensemble import RandomForestRegressor
table = np.loadtxt(sys.argv[1], delimiter=',')
repeats = int(sys.argv[2])
def fit(seed):
    RandomForestRegressor(n_estimators=50, random_state=seed, n_jobs=2).fit(table[:, :-1], table[:, -1])
fit(0)
cpu, wall = time.process_time(), time.perf_counter()
for seed in range(repeats):
    fit(seed)
print((time.process_time() - cpu) / repeats, (time.perf_counter() - wall) / repeats)
";

fn main() -> Result<(), Box<dyn Error>> {
    let Some(python) = std::env::var_os("CRUMPLE_PYTHON") else {
        println!(
            "CRUMPLE_PYTHON is not set: run tests/run once, then set it to target/venv/bin/python"
        );
        return Ok(());
    };
    rayon::ThreadPoolBuilder::new().num_threads(2).build_global()?;
    let folder = tempfile::tempdir()?;
    let study = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/fe/lead-car-wall/study.toml");
    let report = build(&study, &folder.path().join("curves.h5"), |_| {})?;
    let set = TrainingSet::new("lead-car-wall", report.database.cases("lead-car-wall"))?;
    let tables = [
        ("FE table, states", set.table(TableKind::Samples), 20),
        ("FE table, 2 mm grid", set.table(TableKind::Grid), 20),
        ("smooth, 1600 x 2", smooth(1_600), 20),
        ("smooth, 100000 x 2", smooth(100_000), 2),
    ];
    println!(
        "{:<20} {:>12} {:>12} {:>10} {:>10}",
        "fit of 50 trees", "ours (CPU)", "sklearn", "CPU ratio", "wall ratio"
    );
    for (name, table, repeats) in tables {
        let path = folder.path().join("table.csv");
        let mut text = String::new();
        for (record, target) in table.records().rows().into_iter().zip(table.targets()) {
            for value in record {
                text.push_str(&format!("{value:?},"));
            }
            text.push_str(&format!("{target:?}\n"));
        }
        std::fs::write(&path, text)?;
        let output = Command::new(&python)
            .args(["-c", SCRIPT])
            .arg(&path)
            .arg(repeats.to_string())
            .output()?;
        if !output.status.success() {
            return Err(String::from_utf8_lossy(&output.stderr).into());
        }
        let answer = String::from_utf8(output.stdout)?;
        let theirs: Vec<f64> =
            answer.split_whitespace().map(str::parse).collect::<Result<_, _>>()?;
        let [cpu, wall] = ours(&table, repeats)?.map(|d| d.as_secs_f64() / f64::from(repeats));
        println!(
            "{name:<20} {:>9.2} ms {:>9.2} ms {:>10.3} {:>10.3}",
            cpu * 1e3,
            theirs[0] * 1e3,
            cpu / theirs[0],
            wall / theirs[1]
        );
    }
    Ok(())
}

/// CPU and wall time of `repeats` fits.
fn ours(table: &Dataset<f64, f64, Ix1>, repeats: u32) -> Result<[Duration; 2], Box<dyn Error>> {
    ForestParams::new(50).fit(table)?;
    let (cpu, wall) = (ProcessTime::try_now()?, Instant::now());
    for seed in 0..repeats {
        ForestParams::new(50).seed(u64::from(seed)).fit(table)?;
    }
    Ok([cpu.try_elapsed()?, wall.elapsed()])
}
