//! Trees, and the evaluation of many rows: packed nodes, several rows in step.
//!
//! Many rows are predicted tree by tree, packed into 16 bytes per node. Rows walk in the order of the first tree's leaves,
//! because neighbours take nearly the same paths in every tree: 32 of them go as one while their ranges lie on one side of the
//! thresholds, then eight in step. Sums are taken in the order of the trees, so the bits are those of one row by itself.

#[cfg(feature = "serde")]
use base64::{Engine, prelude::BASE64_STANDARD as BASE64};
use linfa::Float;
use ndarray::ArrayView1;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use super::params::ForestError;
use super::threads::*;

/// Rows handed to a thread together.
pub(crate) const BATCH: usize = 1024;

/// Rows that walk in step, so that the memory of one is read while another's is awaited.
const LANES: usize = 8;

/// Rows that go together as long as their ranges leave only one way.
const GROUP: usize = 4 * LANES;

/// Rows to walk: `features` values of each, row after row.
pub(crate) struct Rows<'a, F> {
    values: &'a [F],
    features: usize,
    /// By group and feature: the lowest value, and the highest, or NaN if there is one.
    ranges: Vec<(F, F)>,
}

impl<'a, F: Float> Rows<'a, F> {
    pub(crate) fn new(values: &'a [F], features: usize) -> Self {
        let groups = values.chunks(GROUP * features);
        let mut ranges = vec![(F::infinity(), F::neg_infinity()); groups.len() * features];
        for (group, ranges) in groups.zip(ranges.chunks_exact_mut(features)) {
            for row in group.chunks_exact(features) {
                for (&value, (low, high)) in row.iter().zip(ranges.iter_mut()) {
                    *low = if value < *low { value } else { *low };
                    *high = if value > *high || value.is_nan() { value } else { *high };
                }
            }
        }
        Self { values, features, ranges }
    }
}

/// A node in as few bytes as a walk needs. The right child is after the left, and a leaf
/// is its own right child: nothing is below NaN, so a walk that arrives stays, without a branch.
#[derive(Clone, Copy)]
struct Node<F> {
    /// NaN for a leaf.
    threshold: F,
    /// Any for a leaf.
    feature: u32,
    /// The left child; of a leaf, the node before it, which may wrap.
    left: u32,
}

/// Trees packed for walking: as many as a second-level cache likes, or one. A packed forest
/// beside the other would take more than half as much memory again.
pub(crate) struct Walk<F> {
    nodes: Vec<Node<F>>,
    /// What each node predicts.
    values: Vec<F>,
    roots: Vec<usize>,
}

/// Nodes up to which trees are packed together, so that small ones do not each wait for all
/// threads.
const TOGETHER: usize = 1 << 16;

/// The trees in groups to be packed together.
pub(crate) fn groups<F: Float>(trees: &[Tree<F>]) -> impl Iterator<Item = &[Tree<F>]> {
    let mut nodes = 0;
    trees.chunk_by(move |tree, next| {
        nodes += tree.nodes();
        let fits = nodes + next.nodes() <= TOGETHER;
        nodes = if fits { nodes } else { 0 };
        fits
    })
}

impl<F: Float> Walk<F> {
    pub(crate) fn new() -> Self {
        Self { nodes: Vec::new(), values: Vec::new(), roots: Vec::new() }
    }

    /// Packs trees in place of those before.
    pub(crate) fn take(&mut self, trees: &[Tree<F>]) {
        self.nodes.clear();
        self.values.clear();
        self.roots.clear();
        for tree in trees {
            let root = self.nodes.len();
            let pack = |node: usize| match tree.feature[node] {
                LEAF => Node {
                    threshold: F::nan(),
                    feature: 0,
                    left: ((root + node) as u32).wrapping_sub(1),
                },
                feature => Node {
                    threshold: tree.threshold[node],
                    feature: feature as u32,
                    left: root as u32 + tree.left[node],
                },
            };
            let nodes = (0..tree.nodes()).into_par_iter().with_min_len(TOGETHER);
            self.nodes.par_extend(nodes.map(pack));
            self.values.extend_from_slice(&tree.value);
            self.roots.push(root);
        }
    }

    /// Calls `found` with the leaf of each of `rows` (row after row, `features` values each)
    /// in each tree in turn and the row's own `out`, on all threads.
    pub(crate) fn visit<T: Send>(
        &self,
        rows: &[F],
        features: usize,
        out: &mut [T],
        found: impl Fn(&mut T, usize) + Sync,
    ) {
        let batches = out.par_chunks_mut(BATCH).zip(rows.par_chunks(BATCH * features));
        batches.for_each(|(out, rows)| {
            let rows = Rows::new(rows, features);
            for tree in 0..self.roots.len() {
                self.leaves(tree, &rows, |row, leaf| found(&mut out[row], leaf));
            }
        });
    }

    /// Calls `found` with number and leaf of each of `rows` in a tree of those taken. NaN is
    /// never below a threshold and goes right.
    pub(crate) fn leaves(
        &self,
        tree: usize,
        rows: &Rows<'_, F>,
        mut found: impl FnMut(usize, usize),
    ) {
        let features = rows.features;
        let groups = rows.values.chunks(GROUP * features);
        let mut number = 0;
        for (values, ranges) in groups.zip(rows.ranges.chunks_exact(features)) {
            let start = self.common(self.roots[tree], ranges);
            let lanes = values.chunks_exact(LANES * features);
            let rest = lanes.remainder().chunks_exact(features);
            let mut found = |leaf| {
                found(number, leaf);
                number += 1;
            };
            for rows in lanes {
                self.in_step::<LANES>(start, rows, features).into_iter().for_each(&mut found);
            }
            for row in rest {
                self.in_step::<1>(start, row, features).into_iter().for_each(&mut found);
            }
        }
    }

    /// What a leaf predicts.
    pub(crate) fn value(&self, leaf: usize) -> F {
        self.values[leaf]
    }

    /// The last node that all rows within the ranges come to.
    fn common(&self, root: usize, ranges: &[(F, F)]) -> usize {
        let mut at = root;
        loop {
            let Node { threshold, feature, left } = self.nodes[at];
            let (low, high) = ranges[feature as usize];
            if high < threshold {
                at = left as usize;
            } else if low >= threshold {
                at = left as usize + 1;
            } else {
                return at;
            }
        }
    }

    fn in_step<const ROWS: usize>(
        &self,
        start: usize,
        rows: &[F],
        features: usize,
    ) -> [usize; ROWS] {
        let mut at = [start as u32; ROWS];
        loop {
            let mut moved = 0;
            for (row, at) in at.iter_mut().enumerate() {
                let Node { threshold, feature, left } = self.nodes[*at as usize];
                let below = rows[row * features + feature as usize] < threshold;
                let next = left.wrapping_add(u32::from(!below));
                moved |= next ^ *at;
                *at = next;
            }
            if moved == 0 {
                return at.map(|leaf| leaf as usize);
            }
        }
    }
}

/// Marks a leaf in [`Tree::feature`].
pub(crate) const LEAF: i32 = -1;

/// A regression tree as flat arrays over its nodes; node 0 is the root.
///
/// Invariant: children stand side by side after their parent, so every walk ends.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound = "F: Float", into = "StoredTree", try_from = "StoredTree")
)]
pub struct Tree<F> {
    /// Feature that the node splits on, or −1 for a leaf.
    pub(super) feature: Vec<i32>,
    /// Left if the feature's value is below; 0 for a leaf.
    pub(super) threshold: Vec<F>,
    pub(super) left: Vec<u32>,
    pub(super) right: Vec<u32>,
    /// Mean target of a leaf's training samples; 0 for a split.
    pub(super) value: Vec<F>,
}

/// A tree in files: numbers as the Base64 of their bytes, which is shorter than their digits and read faster.
#[cfg(feature = "serde")]
#[derive(Serialize, Deserialize)]
struct StoredTree {
    feature: Vec<i32>,
    /// Left children as unsigned integers of 32 bits, little endian; the right one is the next node.
    left: String,
    /// Threshold of a split or value of a leaf as doubles, little endian.
    number: String,
}

#[cfg(feature = "serde")]
impl<F: Float> From<Tree<F>> for StoredTree {
    fn from(tree: Tree<F>) -> Self {
        let left: Vec<u8> = tree.left.iter().flat_map(|left| left.to_le_bytes()).collect();
        let number = |node: usize| {
            let of = if tree.is_leaf(node) { tree.value[node] } else { tree.threshold[node] };
            of.to_f64().unwrap_or(f64::NAN).to_le_bytes()
        };
        let number: Vec<u8> = (0..tree.nodes()).flat_map(number).collect();
        Self { left: BASE64.encode(left), number: BASE64.encode(number), feature: tree.feature }
    }
}

#[cfg(feature = "serde")]
impl<F: Float> TryFrom<StoredTree> for Tree<F> {
    type Error = String;

    fn try_from(stored: StoredTree) -> Result<Self, String> {
        let bytes = |name: &str, text: &str| {
            BASE64.decode(text).map_err(|error| format!("{name} of a tree: {error}"))
        };
        let (left, number) = (bytes("left", &stored.left)?, bytes("number", &stored.number)?);
        let (left, number) = (left.as_chunks().0, number.as_chunks().0);
        let nodes = stored.feature.len();
        if left.len() != nodes || number.len() != nodes {
            return Err("the node arrays of a tree differ in length".into());
        }
        // A leaf has a value, another node a threshold and children.
        let number = |of_leaf: bool| {
            let here = stored.feature.iter().map(move |&feature| (feature == LEAF) == of_leaf);
            let value = |(here, bytes): (bool, &[u8; 8])| {
                if here { F::cast(f64::from_le_bytes(*bytes)) } else { F::zero() }
            };
            here.zip(number).map(value).collect()
        };
        let (value, threshold) = (number(true), number(false));
        let child = |right: u32| {
            let node = |(&feature, bytes): (&i32, &[u8; 4])| match feature {
                LEAF => 0,
                _ => u32::from_le_bytes(*bytes).saturating_add(right),
            };
            stored.feature.iter().zip(left).map(node).collect()
        };
        let (left, right) = (child(0), child(1));
        Ok(Self { feature: stored.feature, threshold, left, right, value })
    }
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

    /// Splits a leaf; its children are `left` and the node after it.
    pub(super) fn split(&mut self, node: usize, feature: usize, threshold: F, left: usize) {
        self.feature[node] = feature as i32;
        self.threshold[node] = threshold;
        self.left[node] = left as u32;
        self.right[node] = left as u32 + 1;
        self.value[node] = F::zero();
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
    pub(crate) fn check(&self, features: usize) -> Result<(), ForestError> {
        let damaged = |what: String| Err(ForestError::Damaged(what));
        let nodes = self.nodes();
        let lengths = [self.feature.len(), self.threshold.len(), self.left.len(), self.right.len()];
        if nodes == 0 || lengths.iter().any(|&l| l != nodes) {
            return damaged("the node arrays differ in length or are empty".into());
        }
        for node in 0..nodes {
            if !(self.value[node].is_finite() && self.threshold[node].is_finite()) {
                return damaged(format!("node {node} holds a value that is not finite"));
            }
            let feature = self.feature[node];
            if feature == LEAF {
                continue;
            }
            if feature < 0 || feature as usize >= features {
                return damaged(format!("node {node} splits on feature {feature} of {features}"));
            }
            let (left, right) = (self.left[node] as usize, self.right[node] as usize);
            if left <= node || right != left.saturating_add(1) || right >= nodes {
                return damaged(format!(
                    "node {node} has children that are not next to each other after it"
                ));
            }
        }
        Ok(())
    }
}
