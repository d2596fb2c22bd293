//! The regression forest on plain arrays: predictions, what they rest on, how good they are
//! and how far the target may lie from them.
//!
//!     cargo run --release --example forest

use crumple::forest::{ForestError, ForestParams, RegressionForest};
use linfa::prelude::*;
use ndarray::{Array1, Array2, array};

fn main() -> Result<(), ForestError> {
    // A step in the first feature, a slope in the second, and a third that does not matter.
    // What no feature tells grows with the second.
    let share = |i: usize, step: f64| (0.5 + i as f64 * step).fract();
    let x = Array2::from_shape_fn((2_000, 3), |(i, k)| {
        share(i, [0.819_172_5, 0.671_043_6, 0.549_700_5][k])
    });
    let y: Array1<f64> = (0..)
        .zip(x.rows())
        .map(|(i, r)| {
            let step = if r[0] < 0.5 { 0.0 } else { 2.0 };
            step + r[1] * (1.0 + share(i, 0.414_213_6) - 0.5)
        })
        .collect();

    let params = ForestParams::new(100).seed(1).min_samples_leaf(10);
    let params = params.out_of_bag(true).quantiles(true);
    let forest: RegressionForest<f64> = params.fit(&Dataset::new(x, y))?;

    let records = array![[0.2, 0.1, 0.5], [0.2, 0.9, 0.5], [0.8, 0.9, 0.5]];
    let predicted: Array1<f64> = forest.predict(&records);
    let quantiles = forest.quantiles(records.view(), &[0.05, 0.5, 0.95])?;
    for ((record, predicted), q) in records.rows().into_iter().zip(&predicted).zip(quantiles.rows())
    {
        println!("{record}: {predicted:.2}, 90 % within {:.2} to {:.2}", q[0], q[2]);
    }
    if let Some(importance) = forest.feature_importance() {
        println!("importance: {importance:.3}");
    }
    if let Some(out_of_bag) = forest.out_of_bag() {
        println!("out of bag: rmse {:.3} over {} samples", out_of_bag.rmse, out_of_bag.samples);
    }
    Ok(())
}
