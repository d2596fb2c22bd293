//! Draws the speeds of three vehicles in a train crash: FE's run of the whole train, and the
//! multi-body run with the curves of some methods, as SVG on standard output.
//!
//!     cargo run --example train_set > examples/train_set.svg

use std::error::Error;
use std::fs;
use std::path::Path;

use crumple::assess::ComparisonSettings;
use crumple::assess::compare_train;
use crumple::build::build;
use crumple::charts;
use crumple::scenario;

/// Methods that are drawn.
const METHODS: [&str; 4] = ["fdrm", "best_train", "best_local", "split_ends"];

fn main() -> Result<(), Box<dyn Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir()?;
    for group in ["lead-car-wall", "vehicle-pair"] {
        let study = root.join("fixtures/fe").join(group).join("study.toml");
        build(&study, &folder.path().join("curves.h5"), |_| {})?;
    }
    let fe = folder.path().join("fe/train-set/36kmh");
    fs::create_dir_all(&fe)?;
    fs::copy(root.join("fixtures/train-set/36kmh/nodout"), fe.join("nodout"))?;
    let path = folder.path().join("train-set.toml");
    fs::copy(root.join("examples/trains/train-set.toml"), &path)?;
    let settings = ComparisonSettings { nsdm_seeds: 0, ..ComparisonSettings::default() };
    let scenario = scenario::read(&path)?;
    let mut comparison = compare_train(&path, &scenario, &settings)?;
    comparison.rows.retain(|row| METHODS.contains(&row.method.as_str()));

    let title = "Three vehicles at 36 km/h: FE's run of the whole train, and multi-body runs";
    print!("{}", charts::train_speeds(title, &comparison).drawing().svg());
    Ok(())
}
