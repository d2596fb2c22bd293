//! Trees, and the evaluation of many rows: several in step.
//!
//! Rows walk tree by tree in the order of the first tree's leaves, because neighbours take nearly the same paths in every
//! tree: 32 of them go as one while their ranges lie on one side of the thresholds, then eight in step. Sums are taken in the
//! order of the trees, so the bits are those of one row by itself.

#[cfg(feature = "serde")]
use std::borrow::Cow;

#[cfg(feature = "serde")]
use base64::{Engine, prelude::BASE64_STANDARD as BASE64};
use linfa::Float;
use ndarray::ArrayView1;
#[cfg(feature = "serde")]
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error as _};

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

/// Nodes up to which trees are walked together, so that small ones do not each wait for all
/// threads: as many as a second-level cache likes.
const TOGETHER: usize = 1 << 16;

/// The trees in groups to be walked together.
pub(crate) fn groups<F: Float>(trees: &[Tree<F>]) -> impl Iterator<Item = &[Tree<F>]> {
    let mut nodes = 0;
    trees.chunk_by(move |tree, next| {
        nodes += tree.nodes();
        let fits = nodes + next.nodes() <= TOGETHER;
        nodes = if fits { nodes } else { 0 };
        fits
    })
}

/// Calls `found` with the row's own `out`, a tree and the row's leaf in it, for each of `rows`
/// (row after row, `features` values each) in each tree in turn, on all threads.
pub(crate) fn visit<F: Float, T: Send>(
    trees: &[Tree<F>],
    rows: &[F],
    features: usize,
    out: &mut [T],
    found: impl Fn(&mut T, &Tree<F>, usize) + Sync,
) {
    for trees in groups(trees) {
        let batches = out.par_chunks_mut(BATCH).zip(rows.par_chunks(BATCH * features));
        batches.for_each(|(out, rows)| {
            let rows = Rows::new(rows, features);
            for tree in trees {
                tree.leaves(&rows, |row, leaf| found(&mut out[row], tree, leaf));
            }
        });
    }
}

/// A node in as few bytes as a walk needs. A leaf is its own right child: nothing is below
/// its threshold, so a walk that arrives stays, without a branch.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Node<F> {
    /// Left if the feature's value is below; −∞ for a leaf, and finite otherwise.
    threshold: F,
    /// 0 for a leaf.
    feature: u32,
    /// The left child, which the right one follows; of a leaf, the node before it, which may wrap.
    left: u32,
}

impl<F: Float> Node<F> {
    fn leaf(node: usize) -> Self {
        Self { threshold: F::neg_infinity(), feature: 0, left: (node as u32).wrapping_sub(1) }
    }

    fn is_leaf(&self) -> bool {
        self.threshold == F::neg_infinity()
    }
}

/// Marks a leaf among the features of a stored tree.
#[cfg(feature = "serde")]
const LEAF: i32 = -1;

/// A regression tree as flat arrays over its nodes; node 0 is the root.
///
/// Invariant: children stand side by side after their parent, so every walk ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Tree<F> {
    nodes: Vec<Node<F>>,
    /// Mean target of a leaf's training samples; 0 for a split.
    value: Vec<F>,
}

/// A tree in files: numbers as the Base64 of their bytes, little endian, which is shorter than their digits and read faster.
#[cfg(feature = "serde")]
#[derive(Serialize, Deserialize)]
struct StoredTree<'a> {
    /// Features that the nodes split on, or −1 for a leaf, as integers of 32 bits.
    #[serde(borrow)]
    feature: Cow<'a, str>,
    /// Left children as unsigned integers of 32 bits; the right one is the next node.
    #[serde(borrow)]
    left: Cow<'a, str>,
    /// Thresholds of splits and values of leaves as doubles.
    #[serde(borrow)]
    number: Cow<'a, str>,
}

#[cfg(feature = "serde")]
impl<F: Float> Serialize for Tree<F> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let (mut features, mut lefts, mut numbers) = (Vec::new(), Vec::new(), Vec::new());
        for node in 0..self.nodes() {
            let leaf = (LEAF, self.value[node], 0);
            let split = self.split_at(node).map(|(feature, at, left)| (feature as i32, at, left));
            let (feature, number, left) = split.unwrap_or(leaf);
            features.extend(feature.to_le_bytes());
            lefts.extend(left.to_le_bytes());
            numbers.extend(number.to_f64().unwrap_or(f64::NAN).to_le_bytes());
        }
        let text = |bytes| BASE64.encode::<Vec<u8>>(bytes).into();
        StoredTree { feature: text(features), left: text(lefts), number: text(numbers) }
            .serialize(serializer)
    }
}

#[cfg(feature = "serde")]
impl<'de, F: Float> Deserialize<'de> for Tree<F> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let stored = StoredTree::deserialize(deserializer)?;
        let bytes = |name: &str, text: &str| {
            BASE64
                .decode(text)
                .map_err(|error| D::Error::custom(format_args!("{name} of a tree: {error}")))
        };
        let features = bytes("feature", &stored.feature)?;
        let (lefts, numbers) = (bytes("left", &stored.left)?, bytes("number", &stored.number)?);
        if features.len() % 4 != 0
            || (lefts.len(), numbers.len()) != (features.len(), 2 * features.len())
        {
            return Err(D::Error::custom("the node arrays of a tree differ in length"));
        }
        let (features, lefts) = (features.as_chunks().0, lefts.as_chunks().0);
        let numbers = numbers.as_chunks().0;
        let mut tree = Self::with_capacity(features.len());
        for ((&feature, &left), &number) in features.iter().zip(lefts).zip(numbers) {
            let (feature, number) = (i32::from_le_bytes(feature), f64::from_le_bytes(number));
            let node = tree.push_leaf(F::cast(number));
            if feature != LEAF {
                // What is not finite is found by the check, and must not look like a leaf.
                let threshold = F::cast(if number.is_finite() { number } else { f64::NAN });
                tree.split(node, feature as usize, threshold, u32::from_le_bytes(left) as usize);
            }
        }
        Ok(tree)
    }
}

impl<F: Float> Tree<F> {
    /// A tree without nodes.
    pub(super) fn with_capacity(nodes: usize) -> Self {
        Self { nodes: Vec::with_capacity(nodes), value: Vec::with_capacity(nodes) }
    }

    /// Appends a leaf and returns its number.
    pub(super) fn push_leaf(&mut self, value: F) -> usize {
        let node = self.nodes();
        self.nodes.push(Node::leaf(node));
        self.value.push(value);
        node
    }

    /// Splits a leaf; its children are `left` and the node after it.
    pub(super) fn split(&mut self, node: usize, feature: usize, threshold: F, left: usize) {
        self.nodes[node] = Node { threshold, feature: feature as u32, left: left as u32 };
        self.value[node] = F::zero();
    }

    /// Feature, threshold and left child of a split; `None` for a leaf.
    pub(super) fn split_at(&self, node: usize) -> Option<(u32, F, u32)> {
        let node = &self.nodes[node];
        (!node.is_leaf()).then_some((node.feature, node.threshold, node.left))
    }

    /// What a leaf predicts; 0 for a split.
    pub(super) fn value(&self, node: usize) -> F {
        self.value[node]
    }

    /// The mean of the leaf that `record` falls into.
    pub fn predict(&self, record: &ArrayView1<'_, F>) -> F {
        self.value[self.leaf(record)]
    }

    /// The leaf that `record` falls into. NaN is never below a threshold and goes right.
    pub(super) fn leaf(&self, record: &ArrayView1<'_, F>) -> usize {
        let mut at = 0;
        while let Some((feature, threshold, left)) = self.split_at(at) {
            let below = record[feature as usize] < threshold;
            at = left as usize + usize::from(!below);
        }
        at
    }

    /// Calls `found` with number and leaf of each of `rows`. NaN is never below a threshold
    /// and goes right.
    pub(crate) fn leaves(&self, rows: &Rows<'_, F>, mut found: impl FnMut(usize, usize)) {
        let features = rows.features;
        let groups = rows.values.chunks(GROUP * features);
        let mut number = 0;
        for (values, ranges) in groups.zip(rows.ranges.chunks_exact(features)) {
            let start = self.common(ranges);
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

    /// The last node that all rows within the ranges come to.
    fn common(&self, ranges: &[(F, F)]) -> usize {
        let mut at = 0;
        while let Some((feature, threshold, left)) = self.split_at(at) {
            let (low, high) = ranges[feature as usize];
            if high < threshold {
                at = left as usize;
            } else if low >= threshold {
                at = left as usize + 1;
            } else {
                break;
            }
        }
        at
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

    /// Number of nodes, leaves among them.
    pub fn nodes(&self) -> usize {
        self.nodes.len()
    }

    /// Checks the invariant of stored arrays against the number of features.
    pub(crate) fn check(&self, features: usize) -> Result<(), ForestError> {
        let damaged = |what: String| Err(ForestError::Damaged(what));
        let nodes = self.nodes();
        if nodes == 0 {
            return damaged("a tree has no nodes".into());
        }
        for node in 0..nodes {
            let split = self.split_at(node);
            if !split.map_or(self.value[node], |(_, threshold, _)| threshold).is_finite() {
                return damaged(format!("node {node} holds a value that is not finite"));
            }
            let Some((feature, _, left)) = split else { continue };
            if feature as usize >= features {
                let feature = feature as i32;
                return damaged(format!("node {node} splits on feature {feature} of {features}"));
            }
            let left = left as usize;
            if left <= node || left.saturating_add(1) >= nodes {
                return damaged(format!(
                    "node {node} has children that are not next to each other after it"
                ));
            }
        }
        Ok(())
    }
}
