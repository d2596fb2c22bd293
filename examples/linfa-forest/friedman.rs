//! Fits the forest to Friedman's first function, of ten features of which five matter, from outside of crumple:
//!
//!     cargo run --example linfa_forest

use linfa::prelude::*;
use linfa_forest::{FeaturesPerSplit, OnnxDescription, RegressionForest};
use ndarray::{Array1, Array2};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

const FEATURES: usize = 10;

/// y = 10 sin(π x₁ x₂) + 20 (x₃ − ½)² + 10 x₄ + 5 x₅ (Friedman, The Annals of Statistics 19, 1991), without noise.
fn friedman(samples: usize, seed: u64) -> Dataset<f64, f64, ndarray::Ix1> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let x = Array2::from_shape_simple_fn((samples, FEATURES), || random.r#gen::<f64>());
    let y: Array1<f64> = x
        .rows()
        .into_iter()
        .map(|x| {
            let wave = 10.0 * (std::f64::consts::PI * x[0] * x[1]).sin();
            wave + 20.0 * (x[2] - 0.5).powi(2) + 10.0 * x[3] + 5.0 * x[4]
        })
        .collect();
    Dataset::new(x, y)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (train, test) = (friedman(2_000, 1), friedman(1_000, 2));
    let forest = RegressionForest::params(100)
        .features_per_split(FeaturesPerSplit::Count(4))
        .out_of_bag(true)
        .fit(&train)?;
    println!("R² of records not seen: {:.3}", forest.predict(&test).r2(&test)?);
    let out_of_bag = forest.out_of_bag().and_then(|found| found.r2).ok_or("no error out of bag")?;
    println!("R² out of bag: {out_of_bag:.3}");
    let importance = forest.feature_importance().ok_or("no importance")?;
    println!("importance: {importance:.3}");
    let names: Vec<String> = (1..=FEATURES).map(|k| format!("x{k}")).collect();
    let onnx = forest.to_onnx(&OnnxDescription {
        name: "friedman",
        text: "Friedman's first function",
        features: &names.iter().map(String::as_str).collect::<Vec<_>>(),
        target: "y",
    })?;
    println!("ONNX: {} bytes", onnx.len());
    Ok(())
}
