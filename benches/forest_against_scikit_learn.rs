//! CPU time and held-out error beside scikit-learn's RandomForestRegressor, as ratios from
//! one run: 50 trees, bootstrap, unpruned, all features, two threads on both sides, f64.
//!
//!     CRUMPLE_PYTHON=target/venv/bin/python cargo bench --bench forest_against_scikit_learn
//!
//! (`tests/run` installs that Python.) Names of rows behind `--` pick them; the rows of a
//! million samples, of which scikit-learn needs minutes, run only if they are named.

mod samples;

use std::error::Error;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use cpu_time::ProcessTime;
use crumple::build::build;
use crumple::dataset::{TableKind, TrainingSet};
use crumple::forest::{ForestParams, Ties};
use linfa::Dataset;
use linfa::traits::{Fit, Predict};
use ndarray::{Array1, Ix1};
use samples::smooth;

/// Fits and predicts the tables in two files (raw doubles, target last) `repeats` times;
/// prints CPU and wall seconds of a fit and of a prediction, and the rmse of the second table.
const SCRIPT: &str = "
import sys, time
import numpy as np
from sklearn.ensemble import RandomForestRegressor
columns, repeats = int(sys.argv[3]), int(sys.argv[4])
train, test = (np.fromfile(path).reshape(-1, columns) for path in sys.argv[1:3])
def fit(seed):
    forest = RandomForestRegressor(n_estimators=50, random_state=seed, n_jobs=2)
    return forest.fit(train[:, :-1], train[:, -1])
if repeats > 2:
    fit(0)
sums = np.zeros(5)
for seed in range(repeats):
    clocks = [(time.process_time(), time.perf_counter())]
    forest = fit(seed)
    clocks.append((time.process_time(), time.perf_counter()))
    predicted = forest.predict(test[:, :-1])
    clocks.append((time.process_time(), time.perf_counter()))
    rmse = np.sqrt(np.mean((predicted - test[:, -1]) ** 2))
    sums += [*np.diff(clocks, axis=0).ravel(), rmse]
print(*sums / repeats)
";

type Table = Dataset<f64, f64, Ix1>;

fn main() -> Result<(), Box<dyn Error>> {
    let Some(python) = std::env::var_os("CRUMPLE_PYTHON") else {
        println!(
            "CRUMPLE_PYTHON is not set: run tests/run once, then set it to target/venv/bin/python"
        );
        return Ok(());
    };
    rayon::ThreadPoolBuilder::new().num_threads(2).build_global()?;
    let named: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let folder = tempfile::tempdir()?;
    let study = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/fe/lead-car-wall/study.toml");
    let report = build(&study, &folder.path().join("curves.h5"), |_| {})?;
    let set = TrainingSet::new("lead-car-wall", report.database.cases("lead-car-wall"))?;
    println!(
        "{:<10} {:>12} {:>8} {:>8} {:>14} {:>8} {:>8} {:>10}",
        "50 trees", "fit", "CPU", "wall", "predict", "CPU", "wall", "rmse"
    );
    let random = |rows, features| (smooth(rows, features, 0), Some(smooth(1_000_000, features, 1)));
    let paper = set.table(TableKind::Samples);
    // Name, tables to fit and to predict (or the same), ties, repeats; whether it must be named.
    type Make<'a> = &'a dyn Fn() -> (Table, Option<Table>);
    let rows: [(&str, Make, Ties, u32, bool); 5] = [
        ("paper", &|| (paper.clone(), None), Ties::LowestFeature, 20, false),
        ("1600x2", &|| random(1_600, 2), Ties::Random, 10, false),
        ("1e5x2", &|| random(100_000, 2), Ties::Random, 2, false),
        ("1e6x2", &|| random(1_000_000, 2), Ties::Random, 1, true),
        ("1e6x8", &|| random(1_000_000, 8), Ties::Random, 1, true),
    ];
    for (name, make, ties, repeats, must_be_named) in rows {
        if !named.iter().any(|n| n == name) && (must_be_named || !named.is_empty()) {
            continue;
        }
        let (train, test) = make();
        let held_out = test.is_some();
        let test = test.unwrap_or_else(|| train.clone());
        let paths = [folder.path().join("train"), folder.path().join("test")];
        for (path, table) in paths.iter().zip([&train, &test]) {
            write(path, table)?;
        }
        let output = Command::new(&python)
            .args(["-c", SCRIPT])
            .args(&paths)
            .args([(train.records().ncols() + 1).to_string(), repeats.to_string()])
            .output()?;
        if !output.status.success() {
            return Err(String::from_utf8_lossy(&output.stderr).into());
        }
        let answer = String::from_utf8(output.stdout)?;
        let theirs: Vec<f64> =
            answer.split_whitespace().map(str::parse).collect::<Result<_, _>>()?;
        let ours = ours(&train, &test, ties, repeats)?;
        let ratio = |k: usize| ours[k] / theirs[k];
        let rmse = if held_out { format!("{:.4}", ratio(4)) } else { "-".into() };
        println!(
            "{name:<10} {:>9.2} ms {:>8.3} {:>8.3} {:>11.2} ms {:>8.3} {:>8.3} {rmse:>10}",
            ours[1] * 1e3,
            ratio(0),
            ratio(1),
            ours[3] * 1e3,
            ratio(2),
            ratio(3),
        );
    }
    println!(
        "Times are ours, by the clock; all else are ratios to scikit-learn's. rmse: held out."
    );
    Ok(())
}

/// Rows of features and target as raw doubles.
fn write(path: &Path, table: &Table) -> std::io::Result<()> {
    let mut bytes = Vec::new();
    for (record, target) in table.records().rows().into_iter().zip(table.targets()) {
        bytes.extend(record.iter().chain([target]).flat_map(|value| value.to_le_bytes()));
    }
    std::fs::write(path, bytes)
}

/// What the script prints, of our forest.
fn ours(train: &Table, test: &Table, ties: Ties, repeats: u32) -> Result<[f64; 5], Box<dyn Error>> {
    let fit = |seed: u32| ForestParams::new(50).seed(seed.into()).ties(ties).fit(train);
    if repeats > 2 {
        fit(0)?;
    }
    let mut sums = [0.0; 5];
    for seed in 0..repeats {
        let (cpu, wall) = (ProcessTime::try_now()?, Instant::now());
        let forest = fit(seed)?;
        sums[0] += cpu.try_elapsed()?.as_secs_f64();
        sums[1] += wall.elapsed().as_secs_f64();
        let (cpu, wall) = (ProcessTime::try_now()?, Instant::now());
        let predicted: Array1<f64> = forest.predict(test.records());
        sums[2] += cpu.try_elapsed()?.as_secs_f64();
        sums[3] += wall.elapsed().as_secs_f64();
        let squares = (predicted - test.targets()).mapv(|r| r * r);
        sums[4] += (squares.sum() / test.targets().len() as f64).sqrt();
    }
    Ok(sums.map(|sum| sum / f64::from(repeats)))
}
