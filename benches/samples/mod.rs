//! The table that the forest's benches share.

use linfa::Dataset;
use ndarray::{Array2, Axis, Ix1};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// A smooth function with noise of random points in the unit cube, rows × features (2 or
/// more, of which four count).
pub fn smooth(rows: usize, features: usize, seed: u64) -> Dataset<f64, f64, Ix1> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let x = Array2::from_shape_simple_fn((rows, features), || random.r#gen::<f64>());
    let y = x.map_axis(Axis(1), |r| {
        let rest = if features > 3 { r[2] * r[3] } else { 0.0 };
        (6.0 * r[0]).sin() + r[1] * r[1] * r[0] + rest + 0.1 * (random.r#gen::<f64>() - 0.5)
    });
    Dataset::new(x, y)
}
