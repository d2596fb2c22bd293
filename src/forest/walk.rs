//! Many rows through the trees: nodes packed, several rows in step.

use linfa::Float;
use rayon::prelude::*;

use super::tree::{LEAF, Tree};

/// Rows handed to a thread together.
pub const BATCH: usize = 1024;

/// Rows that walk in step, so that the memory of one is read while another's is awaited.
const LANES: usize = 8;

/// A node in as few bytes as a walk needs; the right child stands behind the left.
#[derive(Clone, Copy)]
struct Node<F> {
    /// Of a leaf, its value.
    threshold: F,
    /// Of a leaf, 0: it compares that feature and stays where it is.
    feature: u32,
    /// The left child; of a leaf, itself with the highest bit set.
    left: u32,
}

/// Marks a leaf in [`Node::left`].
const STAYS: u32 = 1 << 31;

/// Trees packed for walking: as many as a second-level cache likes, or one. A packed forest
/// beside the other would take more than half as much memory again.
pub struct Walk<F> {
    nodes: Vec<Node<F>>,
    roots: Vec<usize>,
}

/// Nodes up to which trees are packed together, so that small ones do not each wait for all
/// threads.
const TOGETHER: usize = 1 << 16;

/// The trees in groups to be packed together.
pub fn groups<F: Float>(trees: &[Tree<F>]) -> impl Iterator<Item = &[Tree<F>]> {
    let mut nodes = 0;
    trees.chunk_by(move |tree, next| {
        nodes += tree.nodes();
        let fits = nodes + next.nodes() <= TOGETHER;
        nodes = if fits { nodes } else { 0 };
        fits
    })
}

impl<F: Float> Walk<F> {
    pub fn new() -> Self {
        Self { nodes: Vec::new(), roots: Vec::new() }
    }

    /// Packs trees in place of those before.
    pub fn take(&mut self, trees: &[Tree<F>]) {
        self.nodes.clear();
        self.roots.clear();
        for tree in trees {
            let root = self.nodes.len();
            let pack = |node: usize| match tree.feature[node] {
                LEAF => {
                    let left = (root + node) as u32 | STAYS;
                    Node { threshold: tree.value[node], feature: 0, left }
                }
                feature => Node {
                    threshold: tree.threshold[node],
                    feature: feature as u32,
                    left: root as u32 + tree.left[node],
                },
            };
            let nodes = (0..tree.nodes()).into_par_iter().with_min_len(TOGETHER);
            self.nodes.par_extend(nodes.map(pack));
            self.roots.push(root);
        }
    }

    /// Calls `found` with the leaf of each of `rows` (row after row, `features` values each)
    /// in each tree in turn and the row's own `out`, on all threads.
    pub fn visit<T: Send>(
        &self,
        rows: &[F],
        features: usize,
        out: &mut [T],
        found: impl Fn(&mut T, usize) + Sync,
    ) {
        let batches = out.par_chunks_mut(BATCH).zip(rows.par_chunks(BATCH * features));
        batches.for_each(|(out, rows)| {
            for tree in 0..self.roots.len() {
                self.leaves(tree, rows, features, |row, leaf| found(&mut out[row], leaf));
            }
        });
    }

    /// Calls `found` with number and leaf of each of `rows` in a tree of those taken. NaN is
    /// never below a threshold and goes right.
    pub fn leaves(
        &self,
        tree: usize,
        rows: &[F],
        features: usize,
        mut found: impl FnMut(usize, usize),
    ) {
        let root = self.roots[tree];
        let lanes = rows.chunks_exact(LANES * features);
        let rest = lanes.remainder().chunks_exact(features);
        let whole = lanes.len() * LANES;
        for (lane, rows) in lanes.enumerate() {
            for (at, leaf) in self.in_step([root; LANES], rows, features).into_iter().enumerate() {
                found(lane * LANES + at, leaf);
            }
        }
        for (at, row) in rest.enumerate() {
            found(whole + at, self.in_step([root], row, features)[0]);
        }
    }

    /// What a leaf predicts.
    pub fn value(&self, leaf: usize) -> F {
        self.nodes[leaf].threshold
    }

    fn in_step<const ROWS: usize>(
        &self,
        mut at: [usize; ROWS],
        rows: &[F],
        features: usize,
    ) -> [usize; ROWS] {
        loop {
            let mut moved = 0;
            for (row, at) in at.iter_mut().enumerate() {
                let Node { threshold, feature, left } = self.nodes[*at];
                let below = rows[row * features + feature as usize] < threshold;
                let goes = 1 - (left >> 31);
                moved |= goes;
                *at = ((left & !STAYS) + (u32::from(!below) & goes)) as usize;
            }
            if moved == 0 {
                return at;
            }
        }
    }
}
