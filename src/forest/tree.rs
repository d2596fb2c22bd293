//! One tree: grown over ranges of sorted samples, kept as flat node arrays.

use linfa::Float;
use ndarray::ArrayView1;
use serde::{Deserialize, Serialize};

use super::criterion::{Sums, stops};
use super::params::ForestValidParams;
use super::splitter::{self, Rules, Samples, Table};
use super::stream::Stream;

/// Marks a leaf in [`Tree::feature`].
pub const LEAF: i32 = -1;

/// A regression tree as flat arrays over its nodes; node 0 is the root.
///
/// Invariant: children come after their parent, so every walk ends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tree<F> {
    /// Feature that the node splits on, or −1 for a leaf.
    feature: Vec<i32>,
    /// Left if the feature's value is below; 0 for a leaf.
    threshold: Vec<F>,
    left: Vec<u32>,
    right: Vec<u32>,
    /// Mean target of the node's training samples.
    value: Vec<F>,
}

/// Why stored node arrays are no tree.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TreeError {
    #[error("the node arrays differ in length or are empty")]
    Lengths,
    #[error("node {node} splits on feature {feature} of {features}")]
    Feature { node: usize, feature: i32, features: usize },
    #[error("node {node} has a child that does not come after it")]
    Child { node: usize },
    #[error("node {node} holds a value that is not finite")]
    NotFinite { node: usize },
}

/// A node that waits to be split.
struct Open {
    start: usize,
    end: usize,
    depth: usize,
    node: usize,
    sums: Sums,
}

impl<F: Float> Tree<F> {
    /// Grows a tree on `samples`; consumes their order.
    pub(super) fn grow(
        table: &Table<F>,
        mut samples: Samples,
        params: &ForestValidParams<F>,
        stream: &mut Stream,
    ) -> Self {
        let rules = Rules {
            thresholds: params.thresholds,
            features: params.features_per_split,
            ties: params.ties,
            min_samples_leaf: params.min_samples_leaf as f64,
        };
        let count = samples.orders[0].len();
        let mut tree = Self {
            feature: Vec::new(),
            threshold: Vec::new(),
            left: Vec::new(),
            right: Vec::new(),
            value: Vec::new(),
        };
        let mut goes_left = vec![false; table.targets.len()];
        let mut scratch = Vec::with_capacity(count);
        let root = sums_of(table, &samples, 0, count);
        let node = tree.push(&root, table.offset);
        let mut open = vec![Open { start: 0, end: count, depth: 0, node, sums: root }];
        while let Some(Open { start, end, depth, node, sums }) = open.pop() {
            let done = end - start < 2
                || sums.is_pure()
                || params.max_depth == Some(depth)
                || sums.weight < 2.0 * rules.min_samples_leaf
                || stops(params.stop, &sums, table.offset);
            if done {
                continue;
            }
            let split = splitter::best(table, &samples, (start, end), &sums, &rules, stream);
            let Some(split) = split else { continue };
            let column = &table.columns[split.feature];
            for &sample in &samples.orders[split.feature][start..end] {
                goes_left[sample as usize] = column[sample as usize] < split.threshold;
            }
            let mut middle = start;
            for (feature, order) in samples.orders.iter_mut().enumerate() {
                // The split's own order is already left before right.
                let range = &mut order[start..end];
                middle = start
                    + if feature == split.feature {
                        range.partition_point(|&s| goes_left[s as usize])
                    } else {
                        partition(range, &goes_left, &mut scratch)
                    };
            }
            let left_sums = sums_of(table, &samples, start, middle);
            let right_sums = sums_of(table, &samples, middle, end);
            let left = tree.push(&left_sums, table.offset);
            let right = tree.push(&right_sums, table.offset);
            tree.feature[node] = split.feature as i32;
            tree.threshold[node] = split.threshold;
            tree.left[node] = left as u32;
            tree.right[node] = right as u32;
            let depth = depth + 1;
            open.push(Open { start: middle, end, depth, node: right, sums: right_sums });
            open.push(Open { start, end: middle, depth, node: left, sums: left_sums });
        }
        tree
    }

    fn push(&mut self, sums: &Sums, offset: f64) -> usize {
        self.feature.push(LEAF);
        self.threshold.push(F::zero());
        self.left.push(0);
        self.right.push(0);
        self.value.push(F::cast(sums.mean() + offset));
        self.value.len() - 1
    }

    /// The mean of the leaf that `record` falls into. NaN is never below a threshold and
    /// goes right.
    pub fn predict(&self, record: &ArrayView1<'_, F>) -> F {
        let mut node = 0;
        loop {
            let feature = self.feature[node];
            if feature == LEAF {
                return self.value[node];
            }
            let next = if record[feature as usize] < self.threshold[node] {
                self.left[node]
            } else {
                self.right[node]
            };
            node = next as usize;
        }
    }

    pub fn nodes(&self) -> usize {
        self.value.len()
    }

    /// Checks the invariant of stored arrays against the number of features.
    ///
    /// # Errors
    /// [`TreeError`] names the first node that breaks it.
    pub fn check(&self, features: usize) -> Result<(), TreeError> {
        let nodes = self.nodes();
        let lengths = [self.feature.len(), self.threshold.len(), self.left.len(), self.right.len()];
        if nodes == 0 || lengths.iter().any(|&l| l != nodes) {
            return Err(TreeError::Lengths);
        }
        for node in 0..nodes {
            if !(self.value[node].is_finite() && self.threshold[node].is_finite()) {
                return Err(TreeError::NotFinite { node });
            }
            let feature = self.feature[node];
            if feature == LEAF {
                continue;
            }
            if feature < 0 || feature as usize >= features {
                return Err(TreeError::Feature { node, feature, features });
            }
            let follows = |child: u32| (child as usize) > node && (child as usize) < nodes;
            if !follows(self.left[node]) || !follows(self.right[node]) {
                return Err(TreeError::Child { node });
            }
        }
        Ok(())
    }
}

fn sums_of<F>(table: &Table<F>, samples: &Samples, start: usize, end: usize) -> Sums {
    let mut sums = Sums::default();
    for &sample in &samples.orders[0][start..end] {
        sums.add(samples.weights[sample as usize], table.targets[sample as usize]);
    }
    sums
}

/// Moves the samples that go left to the front, keeping both orders; returns their number.
fn partition(range: &mut [u32], goes_left: &[bool], scratch: &mut Vec<u32>) -> usize {
    scratch.clear();
    let mut left = 0;
    for i in 0..range.len() {
        let sample = range[i];
        if goes_left[sample as usize] {
            range[left] = sample;
            left += 1;
        } else {
            scratch.push(sample);
        }
    }
    range[left..].copy_from_slice(scratch);
    left
}
