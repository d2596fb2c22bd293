//! The fuzz targets: what any bytes must do to each reader and parser. Shared by the fuzzer and by tests/mutations.rs.

use std::fs;
use std::io::{BufRead, Cursor};
use std::path::{Path, PathBuf};

use crumple::database::Database;
use crumple::formats::{ReadOptions, read};
use crumple::solver::{Selection, parse_deck, read_from};
use crumple::surrogate::{Model, Query, predict};
use crumple::{scenario, study, sweep};

/// What a target does with any bytes.
pub type Target = Box<dyn Fn(&[u8]) + Send + Sync>;
type Plain = fn(&[u8]);

/// Formats of solver files, which are one target each.
const FORMATS: &[&str] = &[
    "nodout", "rcforc", "rwforc", "secforc", "glstat", "matsum", "spcforc", "bndout", "sleout",
    "swforc", "abstat", "curvout", "deforc", "jntforc", "rbdout", "nodfor", "eloutdet", "elout",
    "binout", "t01",
];

/// The other targets: any bytes give a result, or an error that says where.
const OTHERS: &[(&str, Plain)] = &[
    ("deck", deck),
    ("study", parsed_study),
    ("model", model),
    ("scenario", parsed_scenario),
    ("curve", curve),
    ("database", database),
    ("plan", plan),
    ("results", results),
];

/// Names of all targets.
pub fn names() -> impl Iterator<Item = &'static str> {
    FORMATS.iter().copied().chain(OTHERS.iter().map(|(name, _)| *name))
}

/// The target of that name.
pub fn target(name: &str) -> Option<Target> {
    let format = FORMATS.iter().find(|format| **format == name);
    let other = OTHERS.iter().find(|(other, _)| *other == name);
    match (format, other) {
        (Some(format), _) => Some(Box::new(|bytes| history(format, bytes))),
        (None, Some((_, target))) => Some(Box::new(target)),
        (None, None) => None,
    }
}

/// Any bytes give histories as long as their time.
fn history(format: &'static str, bytes: &[u8]) {
    // One selection each, recognised by the input, so that an execution is one reading.
    let selection = match bytes.last().map_or(0, |last| last % 4) {
        0 | 1 => Selection::all(),
        2 => Selection::nothing(),
        _ => Selection {
            ids: ["1", "7", "3:surfa"].map(|id| id.parse().ok()).into_iter().collect(),
            ..Selection::all()
        },
    };
    for file in read_from(format, &[Box::new(bytes.to_vec())], &selection).unwrap() {
        for history in &file.histories {
            assert_eq!(history.values.len(), file.time.len());
        }
    }
}

/// Any bytes give a deck.
fn deck(bytes: &[u8]) {
    // Included files hold the deck itself, and are then no longer there: a deck of includes
    // alone would take a thousand readings.
    let mut left = 3;
    let mut open = |_: &str| {
        left -= 1;
        (left >= 0).then(|| Box::new(Cursor::new(bytes.to_vec())) as Box<dyn BufRead>)
    };
    let mut source = bytes;
    let deck = parse_deck(&mut source, &mut open).unwrap();
    deck.impact_speed();
}

/// Any text gives a study, or an error that begins with the file.
fn parsed_study(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Err(error) = study::parse(Path::new("study.toml"), text) {
        assert!(error.to_string().starts_with("study.toml:"));
    }
}

/// Any text gives a scenario, or an error that begins with the file.
fn parsed_scenario(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Err(error) = scenario::parse(Path::new("scenario.toml"), text) {
        assert!(error.to_string().starts_with("scenario.toml:"));
    }
}

/// Any bytes give a model or an error, and a model a curve or an error.
fn model(bytes: &[u8]) {
    let model = match Model::parse(Path::new("a.model"), bytes) {
        Ok(model) => model,
        Err(error) => {
            assert!(error.to_string().starts_with("a.model: "));
            return;
        }
    };
    let (low, high) = model.range_m_per_s();
    for v in [0.5 * low, 0.5 * (low + high), 2.0 * high] {
        let query = Query { extrapolate: true, ..Query::at(v) };
        if let Ok(curve) = predict(&model, &query) {
            assert!(curve.force_n.iter().all(|f| f.is_finite() && *f >= 0.0));
            assert_eq!(curve.deflection_m[0], 0.0);
        }
    }
}

/// A folder of this process; who runs the targets removes it.
pub fn folder() -> PathBuf {
    let folder = std::env::temp_dir().join(format!("crumple-fuzz-{}", std::process::id()));
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
fn curve(bytes: &[u8]) {
    let Some((first, bytes)) = bytes.split_first() else { return };
    let ending = ENDINGS[usize::from(*first) % ENDINGS.len()];
    let path = written(&format!("a.{ending}"), bytes);
    match read(&path, &ReadOptions::default()) {
        Ok((curve, _)) => {
            assert_eq!(curve.deflection_m.len(), curve.force_n.len());
            assert!(curve.force_n.iter().chain(&curve.deflection_m).all(|v| v.is_finite()));
        }
        Err(error) => {
            assert!(error.to_string().starts_with(&path.display().to_string()), "{error}")
        }
    }
}

fn database(bytes: &[u8]) {
    let path = written("a.h5", bytes);
    if let Ok(database) = Database::read(&path) {
        for case in database.all() {
            assert!(case.curves.original.force_n().iter().all(|f| f.is_finite()));
        }
    }
}

fn plan(bytes: &[u8]) {
    if let Ok(plan) = sweep::Sweep::load(&written("a.toml", bytes), None) {
        assert!(plan.values(0).len() < plan.columns().len());
    }
}

/// Two result files, or shards of one, cut at the first byte 0.
fn results(bytes: &[u8]) {
    let mut parts = bytes.splitn(2, |b| *b == 0);
    let inputs: Vec<PathBuf> =
        parts.by_ref().enumerate().map(|(k, part)| written(&format!("{k}.csv"), part)).collect();
    let output = folder().join("merged.csv");
    let _ = fs::remove_file(&output);
    if sweep::merge(&inputs, &output).is_err() {
        assert!(!output.exists(), "an error leaves no output");
    }
}
