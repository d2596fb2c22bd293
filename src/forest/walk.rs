//! Many rows through the trees: nodes packed, several rows in step.
//!
//! Predictions of many rows go tree by tree, packed into 16 bytes a node. Rows walk in the order of the first tree's leaves,
//! because neighbours take nearly the same ways in every tree: 32 of them go as one while their ranges lie on one side of the
//! thresholds, then eight in step. Sums are taken in the order of the trees, so the bits are those of one row by itself.

use linfa::Float;
use rayon::prelude::*;

use super::tree::{LEAF, Tree};

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

/// A node in as few bytes as a walk needs. The right child stands behind the left, and a leaf
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
