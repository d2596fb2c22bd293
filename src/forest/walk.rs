//! Many rows through one tree: its nodes packed, several rows in step.

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

/// A tree packed for walking. It is packed when it is needed: a packed forest beside the
/// other would take more than half as much memory again.
pub struct Walk<F>(Vec<Node<F>>);

impl<F: Float> Walk<F> {
    pub fn new() -> Self {
        Self(Vec::new())
    }

    /// Packs a tree in place of the one before.
    pub fn take(&mut self, tree: &Tree<F>) {
        let pack = |node: usize| match tree.feature[node] {
            LEAF => Node { threshold: tree.value[node], feature: 0, left: node as u32 | STAYS },
            feature => Node {
                threshold: tree.threshold[node],
                feature: feature as u32,
                left: tree.left[node],
            },
        };
        (0..tree.nodes())
            .into_par_iter()
            .with_min_len(BATCH)
            .map(pack)
            .collect_into_vec(&mut self.0);
    }

    /// Calls `found` with the leaf of each of `rows` (row after row, `features` values each)
    /// and the row's own `out`, on all threads.
    pub fn visit<T: Send>(
        &self,
        rows: &[F],
        features: usize,
        out: &mut [T],
        found: impl Fn(&mut T, usize) + Sync,
    ) {
        let batches = out.par_chunks_mut(BATCH).zip(rows.par_chunks(BATCH * features));
        batches.for_each(|(out, rows)| {
            self.leaves(rows, features, |row, leaf| found(&mut out[row], leaf));
        });
    }

    /// Calls `found` with number and leaf of each of `rows` (row after row, `features`
    /// values each). NaN is never below a threshold and goes right.
    pub fn leaves(&self, rows: &[F], features: usize, mut found: impl FnMut(usize, usize)) {
        let lanes = rows.chunks_exact(LANES * features);
        let rest = lanes.remainder().chunks_exact(features);
        let whole = lanes.len() * LANES;
        for (lane, rows) in lanes.enumerate() {
            for (at, leaf) in self.in_step::<LANES>(rows, features).into_iter().enumerate() {
                found(lane * LANES + at, leaf);
            }
        }
        for (at, row) in rest.enumerate() {
            found(whole + at, self.in_step::<1>(row, features)[0]);
        }
    }

    pub fn value(&self, leaf: usize) -> F {
        self.0[leaf].threshold
    }

    fn in_step<const ROWS: usize>(&self, rows: &[F], features: usize) -> [usize; ROWS] {
        let mut at = [0usize; ROWS];
        loop {
            let mut moved = 0;
            for (row, at) in at.iter_mut().enumerate() {
                let Node { threshold, feature, left } = self.0[*at];
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
