//! Targets of what is read from files only: curve files, databases, sweep plans and results.

use std::fs;
use std::path::{Path, PathBuf};

use crumple::database::Database;
use crumple::formats::{ReadOptions, read};
use crumple::sweep;

/// A folder of this process, in memory where the system has one.
fn folder() -> PathBuf {
    let shared = Path::new("/dev/shm");
    let base = if shared.is_dir() { shared.into() } else { std::env::temp_dir() };
    let folder = base.join(format!("crumple-fuzz-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("the folder can be made");
    folder
}

fn written(name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder().join(name);
    fs::write(&path, bytes).expect("the file can be written");
    path
}

/// Endings of curve files; the first byte chooses one.
const ENDINGS: [&str; 13] =
    ["csv", "txt", "json", "k", "rad", "mo", "mat", "crv", "cur", "tab", "chn", "dat", "mf4"];

/// Any bytes give a curve whose points are numbers, or an error that begins with the file.
pub fn curve(bytes: &[u8]) {
    let Some((first, bytes)) = bytes.split_first() else { return };
    let ending = ENDINGS[usize::from(*first) % ENDINGS.len()];
    let path = written(&format!("a.{ending}"), bytes);
    match read(&path, &ReadOptions::default()) {
        Ok((curve, _)) => {
            assert_eq!(curve.deflection_m.len(), curve.force_n.len());
            assert!(curve.force_n.iter().chain(&curve.deflection_m).all(|v| v.is_finite()));
        }
        Err(error) => assert!(error.to_string().starts_with(&path.display().to_string()), "{error}"),
    }
}

pub fn database(bytes: &[u8]) {
    let path = written("a.h5", bytes);
    if let Ok(database) = Database::read(&path) {
        for case in database.all() {
            assert!(case.curves.original.force_n().iter().all(|f| f.is_finite()));
        }
    }
}

pub fn plan(bytes: &[u8]) {
    if let Ok(plan) = sweep::Sweep::load(&written("a.toml", bytes), None) {
        assert!(plan.values(0).len() < plan.columns().len());
    }
}

/// Two result files, or shards of one, cut at the first byte 0.
pub fn results(bytes: &[u8]) {
    let mut parts = bytes.splitn(2, |b| *b == 0);
    let inputs: Vec<PathBuf> = parts
        .by_ref()
        .enumerate()
        .map(|(k, part)| written(&format!("{k}.csv"), part))
        .collect();
    let output = folder().join("merged.csv");
    let _ = fs::remove_file(&output);
    if sweep::merge(&inputs, &output).is_err() {
        assert!(!output.exists(), "an error leaves no output");
    }
}
