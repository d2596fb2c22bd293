//! The forest: trees grown in parallel, predictions as their mean.

use linfa::Float;
use linfa::dataset::{AsSingleTargets, DatasetBase};
use linfa::traits::{Fit, PredictInplace};
use ndarray::{Array1, ArrayBase, ArrayView1, ArrayView2, Axis, Data, Ix2};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::params::{FeaturesPerSplit, ForestError, ForestValidParams};
use super::splitter::{Samples, Table};
use super::stream::Stream;
use super::tree::{Tree, TreeError};

/// A fitted regression forest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegressionForest<F> {
    features: usize,
    params: ForestValidParams<F>,
    trees: Vec<Tree<F>>,
    out_of_bag: Option<OutOfBag>,
}

/// Error on the samples that the trees did not see.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OutOfBag {
    /// Root of the mean squared error, in the unit of the target.
    pub rmse: f64,
    /// Coefficient of determination; `None` if all targets are equal.
    pub r2: Option<f64>,
    /// Samples that at least one tree did not see.
    pub samples: usize,
}

impl<F: Float> RegressionForest<F> {
    pub fn trees(&self) -> &[Tree<F>] {
        &self.trees
    }

    pub fn features(&self) -> usize {
        self.features
    }

    pub fn params(&self) -> &ForestValidParams<F> {
        &self.params
    }

    /// Out-of-bag error, if it was asked for.
    pub fn out_of_bag(&self) -> Option<OutOfBag> {
        self.out_of_bag
    }

    /// Checks a forest that was read from a file.
    ///
    /// # Errors
    /// [`TreeError`] if a tree's arrays do not fit together.
    pub fn check(&self) -> Result<(), TreeError> {
        if self.trees.is_empty() || self.features == 0 {
            return Err(TreeError::Lengths);
        }
        self.trees.iter().try_for_each(|tree| tree.check(self.features))
    }

    /// Mean over the trees for one record of [`features`](Self::features) values.
    pub fn predict_one(&self, record: &ArrayView1<'_, F>) -> F {
        let sum = self.trees.iter().fold(F::zero(), |sum, tree| sum + tree.predict(record));
        sum / F::cast(self.trees.len())
    }
}

impl<F, D, T> Fit<ArrayBase<D, Ix2>, T, ForestError> for ForestValidParams<F>
where
    F: Float,
    D: Data<Elem = F>,
    T: AsSingleTargets<Elem = F>,
{
    type Object = RegressionForest<F>;

    /// Fits the forest to records (samples × features) and one target per sample.
    ///
    /// # Errors
    /// [`ForestError`] for an empty data set, NaN or infinity, or more features per split
    /// than there are.
    fn fit(
        &self,
        dataset: &DatasetBase<ArrayBase<D, Ix2>, T>,
    ) -> Result<RegressionForest<F>, ForestError> {
        let targets = dataset.targets().as_single_targets();
        let table = table(dataset.records().view(), targets)?;
        let features = table.columns.len();
        if let FeaturesPerSplit::Count(count) = self.features_per_split
            && count > features
        {
            return Err(ForestError::TooManyFeaturesPerSplit { count, features });
        }
        let trees: Vec<Tree<F>> = (0..self.trees)
            .into_par_iter()
            .map(|tree| {
                let mut stream = Stream::new(self.seed, tree as u64);
                let samples = draw(&table, self.bootstrap, &mut stream);
                Tree::grow(&table, samples, self, &mut stream)
            })
            .collect();
        let mut forest =
            RegressionForest { features, params: self.clone(), trees, out_of_bag: None };
        if self.out_of_bag {
            forest.out_of_bag = Some(out_of_bag(&forest, dataset.records().view(), &table));
        }
        Ok(forest)
    }
}

/// Columns, centred targets and the order of every feature; checks the data once.
fn table<F: Float>(
    records: ArrayView2<'_, F>,
    targets: ArrayView1<'_, F>,
) -> Result<Table<F>, ForestError> {
    let (samples, features) = records.dim();
    if samples != targets.len() {
        return Err(ForestError::Lengths { records: samples, targets: targets.len() });
    }
    if samples == 0 {
        return Err(ForestError::NoSamples);
    }
    if features == 0 {
        return Err(ForestError::NoFeatures);
    }
    if samples > u32::MAX as usize {
        return Err(ForestError::TooManySamples { samples });
    }
    let as_f64 = |v: F| v.to_f64().unwrap_or(f64::NAN);
    for ((row, feature), &value) in records.indexed_iter() {
        if !value.is_finite() {
            return Err(ForestError::RecordNotFinite { row, feature, value: as_f64(value) });
        }
    }
    if let Some((row, &value)) = targets.indexed_iter().find(|(_, v)| !v.is_finite()) {
        return Err(ForestError::TargetNotFinite { row, value: as_f64(value) });
    }
    let raw: Vec<f64> = targets.iter().map(|&t| as_f64(t)).collect();
    let offset = raw.iter().sum::<f64>() / samples as f64;
    let columns: Vec<Vec<F>> =
        records.axis_iter(Axis(1)).map(|column| column.iter().copied().collect()).collect();
    let orders = columns
        .par_iter()
        .map(|column| {
            let mut order: Vec<u32> = (0..samples as u32).collect();
            order.sort_by(|&a, &b| {
                let (a, b) = (column[a as usize], column[b as usize]);
                // Values are finite, so the comparison always answers.
                a.partial_cmp(&b).unwrap_or(std::cmp::Ordering::Equal)
            });
            order
        })
        .collect();
    let targets = raw.iter().map(|t| t - offset).collect();
    Ok(Table { columns, targets, offset, orders })
}

/// The samples of one tree: N draws with replacement, or all once.
fn draw<F>(table: &Table<F>, bootstrap: bool, stream: &mut Stream) -> Samples {
    let n = table.targets.len();
    if !bootstrap {
        return Samples { orders: table.orders.clone(), weights: vec![1.0; n] };
    }
    let mut weights = vec![0.0; n];
    for _ in 0..n {
        weights[stream.below(n)] += 1.0;
    }
    let drawn =
        |order: &Vec<u32>| order.iter().copied().filter(|&s| weights[s as usize] > 0.0).collect();
    Samples { orders: table.orders.iter().map(drawn).collect(), weights }
}

fn out_of_bag<F: Float>(
    forest: &RegressionForest<F>,
    records: ArrayView2<'_, F>,
    table: &Table<F>,
) -> OutOfBag {
    let n = table.targets.len();
    let mut sums = vec![(0.0, 0u32); n];
    for (index, tree) in forest.trees.iter().enumerate() {
        // The tree's stream draws its samples first, so they can be drawn again.
        let mut seen = vec![false; n];
        let mut stream = Stream::new(forest.params.seed, index as u64);
        for _ in 0..n {
            seen[stream.below(n)] = true;
        }
        sums.par_iter_mut().enumerate().filter(|(row, _)| !seen[*row]).for_each(|(row, sum)| {
            let value = tree.predict(&records.row(row)).to_f64().unwrap_or(f64::NAN);
            sum.0 += value - table.offset;
            sum.1 += 1;
        });
    }
    let (mut error, mut spread, mut samples) = (0.0, 0.0, 0);
    for (target, (sum, trees)) in table.targets.iter().zip(sums).filter(|(_, s)| s.1 > 0) {
        let residual = sum / f64::from(trees) - target;
        error += residual * residual;
        spread += target * target;
        samples += 1;
    }
    let count = f64::from(samples.max(1));
    let r2 = (spread > 0.0).then(|| 1.0 - error / spread);
    OutOfBag { rmse: (error / count).sqrt(), r2, samples: samples as usize }
}

/// Rows predicted together: few enough that they stay in the first-level cache while
/// tree after tree passes over them.
const BATCH: usize = 512;

impl<F, D> PredictInplace<ArrayBase<D, Ix2>, Array1<F>> for RegressionForest<F>
where
    F: Float,
    D: Data<Elem = F>,
{
    /// Predicts one value per row of `x`.
    ///
    /// # Panics
    /// As linfa's other models: if `x` does not have the fitted number of features, or `y`
    /// not one element per row.
    fn predict_inplace<'a>(&'a self, x: &'a ArrayBase<D, Ix2>, y: &mut Array1<F>) {
        assert_eq!(x.ncols(), self.features, "the forest was fitted to another number of features");
        assert_eq!(x.nrows(), y.len(), "one target is needed per record");
        let trees = F::cast(self.trees.len());
        let x = x.view();
        y.axis_chunks_iter_mut(Axis(0), BATCH)
            .into_par_iter()
            .zip(x.axis_chunks_iter(Axis(0), BATCH))
            .for_each(|(mut y, x)| {
                y.fill(F::zero());
                for tree in &self.trees {
                    for (y, record) in y.iter_mut().zip(x.rows()) {
                        *y += tree.predict(&record);
                    }
                }
                y.mapv_inplace(|sum| sum / trees);
            });
    }

    fn default_target(&self, x: &ArrayBase<D, Ix2>) -> Array1<F> {
        Array1::zeros(x.nrows())
    }
}
