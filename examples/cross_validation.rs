//! The regression forest on plain arrays: linfa's own cross-validation, R² and out-of-bag
//! error over the number of trees.
//!
//!     cargo run --release --example cross_validation

use crumple::forest::{ForestError, ForestParams, RegressionForest};
use linfa::prelude::*;
use ndarray::{Array1, Array2};

fn main() -> Result<(), ForestError> {
    // A smooth function of three features, of which the last does not matter.
    let x = Array2::from_shape_fn((600, 3), |(i, k)| {
        (0.5 + i as f64 * [0.819_172_5, 0.671_043_6, 0.549_700_5][k]).fract()
    });
    let y: Array1<f64> = x.rows().into_iter().map(|r| (5.0 * r[0]).sin() + r[1] * r[1]).collect();
    let mut data = Dataset::new(x, y);

    let sizes = [1, 5, 20, 50];
    let models: Vec<ForestParams<f64>> =
        sizes.iter().map(|&trees| ForestParams::new(trees).seed(1)).collect();
    let r2 = data.cross_validate_single(5, &models, |prediction, truth| prediction.r2(truth))?;
    for (trees, r2) in sizes.iter().zip(&r2) {
        println!("{trees:>3} trees: cross-validated R² {r2:.4}");
    }

    let forest: RegressionForest<f64> =
        ForestParams::new(50).seed(1).out_of_bag(true).fit(&data)?;
    if let Some(out_of_bag) = forest.out_of_bag() {
        let r2 = out_of_bag.r2.unwrap_or(f64::NAN);
        println!("out of bag: R² {r2:.4}, rmse {:.4}", out_of_bag.rmse);
    }
    Ok(())
}
