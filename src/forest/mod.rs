//! Regression forest behind linfa's traits, for any number of features.
//!
//! Knows arrays, never curves. The algorithm is that of the reference method (domain
//! terms: variance reduction, bootstrap, mean over trees) and of Breiman, "Random
//! Forests", Machine Learning 45 (2001); with random thresholds that of Geurts, Ernst and
//! Wehenkel, "Extremely randomized trees", Machine Learning 63 (2006). Besides predictions it
//! gives feature importance, out-of-bag error, quantiles and an ONNX model.
//!
//! ```
//! use crumple::forest::ForestParams;
//! use linfa::prelude::*;
//! use ndarray::{Array1, array};
//!
//! let x = array![[0.0], [1.0], [2.0], [3.0]];
//! let y = array![0.0, 0.0, 1.0, 1.0];
//! let forest = ForestParams::new(10).seed(1).bootstrap(false).fit(&Dataset::new(x, y))?;
//! let predicted: Array1<f64> = forest.predict(&array![[0.2], [2.8]]);
//! assert_eq!(predicted, array![0.0, 1.0]);
//! # Ok::<(), crumple::forest::ForestError>(())
//! ```

#[allow(clippy::module_inception, reason = "the forest itself, beside its parts")]
mod forest;
mod grow;
mod onnx;
mod params;
mod splitter;
mod threads;
mod walk;

pub use forest::{OutOfBag, RegressionForest};
pub use onnx::OnnxDescription;
pub use params::{
    FeaturesPerSplit, ForestError, ForestParams, ForestValidParams, StopRule, Thresholds, Ties,
};
pub use walk::Tree;
