//! Times of fitting, predicting and validating by every model, on a bundled group.
//!
//!     cargo bench --bench models

use std::path::Path;
use std::sync::OnceLock;

use crumple::assess::validate;
use crumple::assess::{Purpose, Selection};
use crumple::curve::Case;
use crumple::dataset::TrainingSet;
use crumple::surrogate::{Model, ModelKind, Query, predict};

use divan::{Bencher, black_box};

const GROUP: &str = "lead-car-wall";

fn main() {
    divan::main();
}

fn cases() -> &'static [Case] {
    static CASES: OnceLock<Vec<Case>> = OnceLock::new();
    CASES.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let study =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/fe/lead-car-wall/study.toml");
        let report = crumple::build::build(&study, &folder.path().join("curves.h5"), |_| {});
        report.expect("the bundled runs make a database").database.cases(GROUP).to_vec()
    })
}

fn kind(name: &str) -> ModelKind {
    ModelKind::named(name, 0).expect("a model of that name")
}

const MODELS: [&str; 6] = ["nearest", "linear", "rate", "crush-law", "forest", "extra"];

#[divan::bench(args = MODELS, sample_count = 5)]
fn fit(bencher: Bencher, name: &str) {
    let set = TrainingSet::new(GROUP, cases()).expect("a training set");
    bencher.bench(|| Model::fit(black_box(&set), kind(name)));
}

#[divan::bench(args = MODELS, sample_count = 5)]
fn predict_one_curve(bencher: Bencher, name: &str) {
    let set = TrainingSet::new(GROUP, cases()).expect("a training set");
    let model = Model::fit(&set, kind(name)).expect("a model");
    bencher.bench(|| predict(black_box(&model), &Query::at(13.9)));
}

#[divan::bench(sample_count = 3)]
fn validate_all_models() {
    black_box(
        validate(GROUP, cases(), &ModelKind::all(0), Selection::Best(Purpose::Vehicle))
            .expect("a validation"),
    );
}
