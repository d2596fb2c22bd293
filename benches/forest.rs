//! Fit and prediction times of the regression forest, by size of the table.
//!
//!     cargo bench --bench forest

mod samples;

use crumple::forest::ForestParams;
use divan::{Bencher, black_box};
use linfa::traits::{Fit, Predict};
use ndarray::Array1;
use samples::smooth;

fn main() {
    divan::main();
}

#[divan::bench(args = [1_600, 10_000, 100_000], sample_count = 5)]
fn fit(bencher: Bencher, rows: usize) {
    let data = smooth(rows, 2, 0);
    bencher.bench(|| ForestParams::new(50).fit(black_box(&data)));
}

#[divan::bench(args = [1_600, 100_000], sample_count = 5)]
fn predict(bencher: Bencher, rows: usize) {
    let data = smooth(rows, 2, 0);
    let forest = ForestParams::new(50).fit(&data).expect("the table is fit for a forest");
    bencher.bench(|| -> Array1<f64> { forest.predict(black_box(data.records())) });
}
