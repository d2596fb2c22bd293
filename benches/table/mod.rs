//! The table that the forest's benches share.

use linfa::Dataset;
use ndarray::{Array2, Axis, Ix1};

/// A smooth function of quasi-random points in the unit square, rows × 2.
pub fn smooth(rows: usize) -> Dataset<f64, f64, Ix1> {
    let x = Array2::from_shape_fn((rows, 2), |(i, k)| {
        (0.5 + i as f64 * [0.754_877_666_246_692_7, 0.569_840_290_998_053_3][k]).fract()
    });
    let y = x.map_axis(Axis(1), |r| (6.0 * r[0]).sin() + r[1] * r[1] * r[0]);
    Dataset::new(x, y)
}
