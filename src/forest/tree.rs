//! One tree as flat node arrays.

use crate::error::{Error, error};
use linfa::Float;
use ndarray::ArrayView1;
use serde::{Deserialize, Serialize};

/// Marks a leaf in [`Tree::feature`].
pub(crate) const LEAF: i32 = -1;

/// A regression tree as flat arrays over its nodes; node 0 is the root.
///
/// Invariant: children stand side by side after their parent, so every walk ends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tree<F> {
    /// Feature that the node splits on, or −1 for a leaf.
    pub(super) feature: Vec<i32>,
    /// Left if the feature's value is below; 0 for a leaf.
    pub(super) threshold: Vec<F>,
    pub(super) left: Vec<u32>,
    pub(super) right: Vec<u32>,
    /// Mean target of the node's training samples.
    pub(super) value: Vec<F>,
}

impl<F: Float> Tree<F> {
    /// A tree without nodes.
    pub(super) fn empty() -> Self {
        Self {
            feature: Vec::new(),
            threshold: Vec::new(),
            left: Vec::new(),
            right: Vec::new(),
            value: Vec::new(),
        }
    }

    /// Appends a leaf and returns its number.
    pub(super) fn push_leaf(&mut self, value: F) -> usize {
        self.feature.push(LEAF);
        self.threshold.push(F::zero());
        self.left.push(0);
        self.right.push(0);
        self.value.push(value);
        self.value.len() - 1
    }

    /// Splits a leaf; its children are `left` and the node behind it.
    pub(super) fn split(&mut self, node: usize, feature: usize, threshold: F, left: usize) {
        self.feature[node] = feature as i32;
        self.threshold[node] = threshold;
        self.left[node] = left as u32;
        self.right[node] = left as u32 + 1;
    }

    /// The mean of the leaf that `record` falls into.
    pub fn predict(&self, record: &ArrayView1<'_, F>) -> F {
        self.value[self.leaf(record)]
    }

    /// The leaf that `record` falls into. NaN is never below a threshold and goes right.
    pub(super) fn leaf(&self, record: &ArrayView1<'_, F>) -> usize {
        let mut node = 0;
        while !self.is_leaf(node) {
            let next = if record[self.feature[node] as usize] < self.threshold[node] {
                self.left[node]
            } else {
                self.right[node]
            };
            node = next as usize;
        }
        node
    }

    pub(super) fn is_leaf(&self, node: usize) -> bool {
        self.feature[node] == LEAF
    }

    /// Number of nodes, leaves among them.
    pub fn nodes(&self) -> usize {
        self.value.len()
    }

    /// Checks the invariant of stored arrays against the number of features.
    pub(crate) fn check(&self, features: usize) -> Result<(), Error> {
        let nodes = self.nodes();
        let lengths = [self.feature.len(), self.threshold.len(), self.left.len(), self.right.len()];
        if nodes == 0 || lengths.iter().any(|&l| l != nodes) {
            return Err(error!(Other, "the node arrays differ in length or are empty"));
        }
        for node in 0..nodes {
            if !(self.value[node].is_finite() && self.threshold[node].is_finite()) {
                return Err(error!(Other, "node {node} holds a value that is not finite"));
            }
            let feature = self.feature[node];
            if feature == LEAF {
                continue;
            }
            if feature < 0 || feature as usize >= features {
                return Err(error!(Other, "node {node} splits on feature {feature} of {features}"));
            }
            let (left, right) = (self.left[node] as usize, self.right[node] as usize);
            if left <= node || right != left + 1 || right >= nodes {
                return Err(error!(
                    Other,
                    "node {node} has children that do not stand side by side after it"
                ));
            }
        }
        Ok(())
    }
}
