//! The forest: trees grown in parallel, predictions as their mean.
//!
//! The training samples of every leaf, and the weighted quantiles of their targets
//! (Meinshausen, "Quantile Regression Forests", JMLR 7, 2006).

use std::cmp::Ordering;

use linfa::Float;
use linfa::dataset::{AsSingleTargets, DatasetBase};
use linfa::traits::{Fit, PredictInplace};
use ndarray::{Array1, Array2, ArrayBase, ArrayView1, ArrayView2, Axis, Data, Ix2};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use super::grow::{Table, grow};
use super::params::{FeaturesPerSplit, ForestError, ForestParams, ForestValidParams, MOST_SAMPLES};
use super::threads::*;
use super::walk::{BATCH, Rows, Tree, groups, visit};
use crate::stream::Stream;

/// A fitted regression forest.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(serialize = "F: Float + Serialize", deserialize = "F: Float + Deserialize<'de>"))
)]
pub struct RegressionForest<F> {
    features: usize,
    params: ForestValidParams<F>,
    trees: Vec<Tree<F>>,
    out_of_bag: Option<OutOfBag>,
    /// Empty in files of programs that did not know it.
    #[cfg_attr(feature = "serde", serde(default))]
    importance: Vec<f64>,
    #[cfg_attr(
        feature = "serde",
        serde(default = "Option::default", skip_serializing_if = "Option::is_none")
    )]
    pub(super) members: Option<Box<Members<F>>>,
}

/// Error on the samples that the trees did not see.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct OutOfBag {
    /// Root of the mean squared error, in the unit of the target.
    pub rmse: f64,
    /// Coefficient of determination; `None` if all targets are equal.
    pub r2: Option<f64>,
    /// Samples that at least one tree did not see.
    pub samples: usize,
}

impl<F: Float> RegressionForest<F> {
    /// Parameters of a forest of `trees` trees: see [`ForestParams::new`].
    pub fn params(trees: usize) -> ForestParams<F> {
        ForestParams::new(trees)
    }

    /// The trees, in the order of their seeds.
    pub fn trees(&self) -> &[Tree<F>] {
        &self.trees
    }

    /// Number of features that it was fitted to.
    pub fn features(&self) -> usize {
        self.features
    }

    /// The parameters that it was fitted with.
    pub fn fitted_with(&self) -> &ForestValidParams<F> {
        &self.params
    }

    /// Out-of-bag error, if it was requested.
    pub fn out_of_bag(&self) -> Option<OutOfBag> {
        self.out_of_bag
    }

    /// Share of each feature in what all splits gained, 1 in sum (0 if no tree has a split):
    /// mean over the trees of each tree's shares, as scikit-learn's `feature_importances_`
    /// (Breiman's mean decrease in impurity). `None` for a forest read from a file without it.
    pub fn feature_importance(&self) -> Option<ArrayView1<'_, f64>> {
        (!self.importance.is_empty()).then(|| ArrayView1::from(&self.importance))
    }

    /// Checks a forest that was read from a file.
    ///
    /// # Errors
    /// If a tree's arrays do not fit together.
    pub fn check(&self) -> Result<(), ForestError> {
        if self.trees.is_empty() || self.features == 0 {
            return Err(ForestError::Damaged("it has no trees or no features".into()));
        }
        self.trees.iter().try_for_each(|tree| tree.check(self.features))?;
        if !self.importance.is_empty() && self.importance.len() != self.features {
            return Err(ForestError::Damaged(
                "the shares of the features do not fit their number".into(),
            ));
        }
        self.members.as_ref().map_or(Ok(()), |members| members.check(&self.trees))
    }

    /// Mean over the trees for one record: a value for each feature of the training samples.
    pub fn predict_one(&self, record: &ArrayView1<'_, F>) -> F {
        // Of many trees single precision would lose digits.
        let sum: f64 = self.trees.iter().map(|tree| as_f64(tree.predict(record))).sum();
        F::cast(sum / self.trees.len() as f64)
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
    fn fit(
        &self,
        dataset: &DatasetBase<ArrayBase<D, Ix2>, T>,
    ) -> Result<RegressionForest<F>, ForestError> {
        let targets = dataset.targets().as_single_targets();
        let table = table(dataset.records().view(), targets)?;
        let (samples, features) = dataset.records().dim();
        if let FeaturesPerSplit::Count(count) = self.features_per_split
            && count > features
        {
            return Err(ForestError::TooManyFeaturesPerSplit { count, features });
        }
        let (trees, gains): (Vec<Tree<F>>, Vec<Vec<f64>>) = (0..self.trees)
            .into_par_iter()
            .map(|tree| {
                let mut stream = Stream::new(self.seed, tree as u64);
                let times = draw(samples, self.bootstrap, &mut stream);
                grow(&table, &times, self, &mut stream)
            })
            .unzip();
        let mut forest = RegressionForest {
            features,
            params: self.clone(),
            trees,
            out_of_bag: None,
            importance: importance(&gains),
            members: None,
        };
        if self.out_of_bag {
            forest.out_of_bag = Some(out_of_bag(&forest, dataset.records().view(), &table));
        }
        if self.quantiles {
            let targets = targets.iter().copied();
            forest.members =
                Some(Box::new(members(&forest, dataset.records().view(), targets, &table)));
        }
        Ok(forest)
    }
}

fn as_f64<F: Float>(value: F) -> f64 {
    value.to_f64().unwrap_or(f64::NAN)
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
    if samples > MOST_SAMPLES {
        return Err(ForestError::TooManySamples { samples });
    }
    let finite = |v: &F| v.is_finite();
    if !records.iter().all(finite)
        && let Some(((row, feature), &value)) = records.indexed_iter().find(|(_, v)| !finite(v))
    {
        return Err(ForestError::RecordNotFinite { row, feature, value: as_f64(value) });
    }
    if let Some((row, &value)) = targets.indexed_iter().find(|(_, v)| !finite(v)) {
        return Err(ForestError::TargetNotFinite { row, value: as_f64(value) });
    }
    let offset = targets.iter().map(|&t| as_f64(t)).sum::<f64>() / samples as f64;
    let (_, rows) = sort(records.column(0).iter().copied());
    let targets = rows.iter().map(|&row| as_f64(targets[row as usize]) - offset).collect();
    let (columns, orders) = records
        .axis_iter(Axis(1))
        .into_par_iter()
        .map(|column| sort(rows.iter().map(|&row| column[row as usize])))
        .unzip();
    Ok(Table { columns, orders, targets, offset, rows })
}

/// The values in increasing order, and their numbers; of equal values the lower number first.
fn sort<F: Float>(values: impl Iterator<Item = F>) -> (Vec<F>, Vec<u32>) {
    let mut numbered: Vec<(F, u32)> = values.zip(0..).collect();
    // Values are finite, so the comparison always answers.
    numbered.sort_unstable_by(|a, b| a.partial_cmp(b).unwrap_or(Ordering::Equal));
    numbered.into_iter().unzip()
}

/// How often each sample is drawn for a tree: N draws with replacement, or all once.
fn draw(samples: usize, bootstrap: bool, stream: &mut Stream) -> Vec<u32> {
    if !bootstrap {
        return vec![1; samples];
    }
    let mut times = vec![0; samples];
    for _ in 0..samples {
        times[stream.below(samples)] += 1;
    }
    times
}

/// The draws of a tree of a fitted forest: its stream draws the samples first.
fn drawn_again<F>(params: &ForestValidParams<F>, tree: usize, samples: usize) -> Vec<u32> {
    draw(samples, params.bootstrap, &mut Stream::new(params.seed, tree as u64))
}

fn out_of_bag<F: Float>(
    forest: &RegressionForest<F>,
    records: ArrayView2<'_, F>,
    table: &Table<F>,
) -> OutOfBag {
    let samples = table.targets.len();
    let mut sums = vec![(0.0, 0u32); samples];
    let mut streams = 0..;
    for trees in groups(&forest.trees) {
        let times: Vec<Vec<u32>> = trees
            .iter()
            .zip(&mut streams)
            .map(|(_, tree)| drawn_again(&forest.params, tree, samples))
            .collect();
        sums.par_chunks_mut(BATCH).enumerate().for_each(|(batch, sums)| {
            let rows = &table.rows[batch * BATCH..][..sums.len()];
            let records: Vec<F> = rows
                .iter()
                .flat_map(|&row| records.row(row as usize).into_iter())
                .copied()
                .collect();
            let (mut unseen, mut walking) = (Vec::new(), Vec::new());
            for (tree, times) in trees.iter().zip(&times) {
                let times = &times[batch * BATCH..];
                unseen.clear();
                unseen.extend((0..sums.len()).filter(|&at| times[at] == 0));
                walking.clear();
                for at in &unseen {
                    walking.extend_from_slice(&records[at * forest.features..][..forest.features]);
                }
                tree.leaves(&Rows::new(&walking, forest.features), |row, leaf| {
                    let (sum, trees) = &mut sums[unseen[row]];
                    *sum += as_f64(tree.value(leaf)) - table.offset;
                    *trees += 1;
                });
            }
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
    let differ = table.targets.windows(2).any(|pair| pair[0] != pair[1]);
    let r2 = (differ && spread > 0.0).then(|| 1.0 - error / spread);
    OutOfBag { rmse: (error / count).sqrt(), r2, samples: samples as usize }
}

/// The samples of every leaf: the training records walk each tree again.
fn members<F: Float>(
    forest: &RegressionForest<F>,
    records: ArrayView2<'_, F>,
    targets: impl Iterator<Item = F>,
    table: &Table<F>,
) -> Members<F> {
    let (targets, by_target) = sort(targets);
    let mut members = Members::new(targets);
    let rows: Vec<F> = by_target.iter().flat_map(|&r| records.row(r as usize).to_vec()).collect();
    let mut samples = vec![0; by_target.len()];
    (0..).zip(&table.rows).for_each(|(sample, &row)| samples[row as usize] = sample);
    let mut leaves = vec![0; by_target.len()];
    for (index, tree) in forest.trees.iter().enumerate() {
        let times = drawn_again(&forest.params, index, by_target.len());
        let tree_alone = std::slice::from_ref(tree);
        visit(tree_alone, &rows, forest.features, &mut leaves, |of_row, _, leaf| *of_row = leaf);
        let times = by_target.iter().map(|&row| times[samples[row as usize] as usize]);
        members.push(tree.nodes(), leaves.iter().copied().zip(times));
    }
    members
}

/// Mean over the trees that have a split of each feature's share in its gains.
fn importance(gains: &[Vec<f64>]) -> Vec<f64> {
    let mut shares = vec![0.0; gains.first().map_or(0, Vec::len)];
    for gains in gains {
        let sum: f64 = gains.iter().sum();
        if sum > 0.0 {
            shares.iter_mut().zip(gains).for_each(|(share, gain)| *share += gain / sum);
        }
    }
    let sum: f64 = shares.iter().sum();
    if sum > 0.0 {
        shares.iter_mut().for_each(|share| *share /= sum);
    }
    shares
}

/// Trees from which on rows walk in the order of the first tree's leaves, which costs about
/// as much as four trees: neighbours take nearly the same ways in all trees, so that those in
/// step arrive together and their nodes are in the cache.
const TREES_WORTH_ORDERING: usize = 8;

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
        let trees = self.trees.len() as f64;
        let x = x.view();
        let mut rows: Vec<F> = x.iter().copied().collect();
        let order = (self.trees.len() >= TREES_WORTH_ORDERING).then(|| {
            let mut leaves: Vec<(usize, usize)> = (0..x.nrows()).map(|row| (0, row)).collect();
            let first = &self.trees[..1];
            visit(first, &rows, self.features, &mut leaves, |(of_row, _), _, leaf| *of_row = leaf);
            leaves.par_sort_unstable();
            leaves
        });
        if let Some(order) = &order {
            let row = |&(_, row): &(usize, usize)| &rows[row * self.features..][..self.features];
            rows = order.iter().flat_map(row).copied().collect();
        }
        let mut sums = vec![0.0; x.nrows()];
        visit(&self.trees, &rows, self.features, &mut sums, |sum, tree, leaf| {
            *sum += as_f64(tree.value(leaf));
        });
        let means = sums.into_iter().map(|sum| F::cast(sum / trees));
        match order {
            Some(order) => order.iter().zip(means).for_each(|(&(_, row), mean)| y[row] = mean),
            None => y.iter_mut().zip(means).for_each(|(y, mean)| *y = mean),
        }
    }

    fn default_target(&self, x: &ArrayBase<D, Ix2>) -> Array1<F> {
        Array1::zeros(x.nrows())
    }
}

impl<F: Float> RegressionForest<F> {
    /// Quantiles of the target at `levels` (0 to 1) for each record, as records × levels, in
    /// the unit of the target: the smallest training target at which the weights of the
    /// samples, summed by increasing target, reach the level.
    ///
    /// A sample's weight is the mean over the trees of its share in the leaf that the record
    /// falls into, counted as often as the tree drew it (Meinshausen 2006, eqs. 4 to 6), so
    /// the weighted mean is the forest's prediction. Leaves of one sample make rough
    /// quantiles: see [`min_samples_leaf`](super::ForestParams::min_samples_leaf).
    ///
    /// # Errors
    /// [`ForestError`] if the forest was not fitted with
    /// [`quantiles(true)`](super::ForestParams::quantiles), a level is not between 0 and 1,
    /// or the records have another number of features.
    pub fn quantiles(
        &self,
        records: ArrayView2<'_, F>,
        levels: &[f64],
    ) -> Result<Array2<F>, ForestError> {
        let members = self.members.as_ref().ok_or(ForestError::NoMembers)?;
        if let Some(&level) = levels.iter().find(|level| !(0.0..=1.0).contains(*level)) {
            return Err(ForestError::Level { level });
        }
        if records.ncols() != self.features() {
            let (found, fitted) = (records.ncols(), self.features());
            return Err(ForestError::Features { found, fitted });
        }
        let mut found = Array2::zeros((records.nrows(), levels.len()));
        found.axis_iter_mut(Axis(0)).into_par_iter().zip(records.axis_iter(Axis(0))).for_each(
            |(mut row, record)| {
                let quantiles = members.quantiles(self.trees(), &record, levels);
                row.iter_mut().zip(quantiles).for_each(|(to, quantile)| *to = quantile);
            },
        );
        Ok(found)
    }
}

/// The training samples of every leaf.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub(crate) struct Members<F> {
    /// Training targets in increasing order.
    targets: Vec<F>,
    trees: Vec<Leaves>,
}

/// The samples of one tree's leaves, as places among the training targets.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
struct Leaves {
    /// By node, and one more: where its members begin and those of the node before end.
    first: Vec<u32>,
    /// By increasing target within a leaf; a sample that was drawn twice stands twice.
    members: Vec<u32>,
}

impl Leaves {
    fn of(&self, node: usize) -> &[u32] {
        &self.members[self.first[node] as usize..self.first[node + 1] as usize]
    }
}

/// Cumulated weights are sums of shares: below this, what they lack of a level is rounding.
const ROUNDING: f64 = 1e-12;

impl<F: Float> Members<F> {
    /// `targets` in increasing order; trees follow by [`push`](Self::push).
    pub(crate) fn new(targets: Vec<F>) -> Self {
        Self { targets, trees: Vec::new() }
    }

    /// Adds a tree of `nodes` nodes. `drawn` gives leaf and number of draws of each sample,
    /// in the order of the targets; it is gone through twice.
    pub(crate) fn push(&mut self, nodes: usize, drawn: impl Iterator<Item = (usize, u32)> + Clone) {
        let mut first = vec![0u32; nodes + 1];
        for (leaf, times) in drawn.clone() {
            first[leaf + 1] += times;
        }
        for node in 0..nodes {
            first[node + 1] += first[node];
        }
        let mut next = first.clone();
        let mut members = vec![0; first[nodes] as usize];
        for (place, (leaf, times)) in (0..).zip(drawn) {
            for _ in 0..times {
                members[next[leaf] as usize] = place;
                next[leaf] += 1;
            }
        }
        self.trees.push(Leaves { first, members });
    }

    /// Checks members that were read from a file against the trees.
    pub(crate) fn check(&self, trees: &[Tree<F>]) -> Result<(), ForestError> {
        let fits = |(leaves, tree): (&Leaves, &Tree<F>)| {
            leaves.first.len() == tree.nodes() + 1
                && leaves.first[0] == 0
                && leaves.first.is_sorted()
                && leaves.first[tree.nodes()] as usize == leaves.members.len()
                && leaves.members.iter().all(|&m| (m as usize) < self.targets.len())
                && (0..tree.nodes()).all(|n| tree.split_at(n).is_some() || !leaves.of(n).is_empty())
        };
        let whole = self.trees.len() == trees.len()
            && self.targets.iter().all(|t| t.is_finite())
            && self.trees.iter().zip(trees).all(fits);
        if whole {
            Ok(())
        } else {
            Err(ForestError::Damaged("the samples of the leaves do not fit the trees".into()))
        }
    }

    /// One quantile per level for one record.
    pub(crate) fn quantiles(
        &self,
        trees: &[Tree<F>],
        record: &ArrayView1<'_, F>,
        levels: &[f64],
    ) -> Vec<F> {
        let mut weights: Vec<(u32, f64)> = Vec::new();
        for (tree, leaves) in trees.iter().zip(&self.trees) {
            let members = leaves.of(tree.leaf(record));
            let weight = 1.0 / (trees.len() * members.len()) as f64;
            weights.extend(members.iter().map(|&member| (member, weight)));
        }
        weights.sort_by_key(|(member, _)| *member);
        let mut sum = 0.0;
        for (_, weight) in &mut weights {
            sum += *weight;
            *weight = sum;
        }
        let quantile = |&level: &f64| {
            let at = weights.partition_point(|(_, sum)| *sum < level - ROUNDING);
            // The last sum is 1 up to rounding, and no level is above 1.
            self.targets[weights[at.min(weights.len() - 1)].0 as usize]
        };
        levels.iter().map(quantile).collect()
    }
}
