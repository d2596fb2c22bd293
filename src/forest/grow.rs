//! Growing one tree over ranges of samples that stay sorted by every feature.
//!
//! Samples are sorted by every feature once, for all trees. A tree keeps its drawn samples in an order per feature and
//! partitions each order, stably, at every split. A node is therefore a range of all orders, and nothing is sorted again. An entry of
//! an order carries value, target and number of draws: a scan reads memory in one direction, where access by sample would miss
//! the cache at every step. What needs the sample is one flag, left or right; samples are numbered along the first feature, and
//! again in nodes of 4 096, so that the flags stay in the cache.
//!
//! Most of an unpruned tree is nodes of a few samples, where a mispredicted branch costs more than the arithmetic. So gains are
//! computed without branches and searched afterwards, samples are written to both sides of which one counts, and nodes whose
//! children are leaves are not partitioned.

use std::ops::Range;

use linfa::Float;

use super::params::ForestValidParams;
use super::splitter::{self, Drawn, Room, Rules, Sums, stops};
use super::walk::Tree;
use crate::stream::Stream;

/// Training data by columns; shared by all trees.
///
/// Samples are numbered by increasing value of the first feature, so that those of a node
/// lie near each other in memory.
pub(crate) struct Table<F> {
    /// By feature: its values in increasing order.
    pub columns: Vec<Vec<F>>,
    /// By feature: the samples of these values; of equal values the lower sample first.
    pub orders: Vec<Vec<u32>>,
    /// Targets by sample, centred on their mean.
    pub targets: Vec<f64>,
    /// Mean that was taken off the targets.
    pub offset: f64,
    /// By sample: its row in the records.
    pub rows: Vec<u32>,
}

/// Distinct samples up to which a node's samples are numbered again, so that what is noted by
/// sample lies in the first-level cache until the node's last leaf.
const LOCAL: usize = 4096;

/// A tree that grows.
///
/// Invariant: for every feature, `orders[feature][start..end]` are the samples of the
/// open node that owns the range `start..end`, by increasing value.
struct Grower<'a, F> {
    params: &'a ForestValidParams<F>,
    rules: Rules,
    offset: f64,
    stream: &'a mut Stream,
    tree: Tree<F>,
    /// What the splits on each feature gained.
    gains: Vec<f64>,
    orders: Vec<Vec<Drawn<F>>>,
    open: Vec<Open>,
    /// By sample: whether it goes left at the present split.
    goes_left: Vec<bool>,
    right: Vec<Drawn<F>>,
    /// By sample: its new number.
    numbers: Vec<u32>,
    room: Room,
}

/// A node that waits to be split.
#[derive(Clone, Copy)]
struct Open {
    start: usize,
    end: usize,
    depth: usize,
    node: usize,
    sums: Sums,
}

/// Grows a tree on samples drawn `times[sample]` times. Returns it and what its splits on
/// each feature gained.
pub(crate) fn grow<F: Float>(
    table: &Table<F>,
    times: &[u32],
    params: &ForestValidParams<F>,
    stream: &mut Stream,
) -> (Tree<F>, Vec<f64>) {
    let count = times.iter().filter(|&&t| t > 0).count();
    // Side by side, so that each of the jumps through a feature's order meets both.
    let drawn: Vec<(f64, u32)> = table.targets.iter().copied().zip(times.iter().copied()).collect();
    let orders: Vec<Vec<Drawn<F>>> = table
        .columns
        .iter()
        .zip(&table.orders)
        .map(|(values, order)| {
            let mut samples = Vec::with_capacity(count);
            for (&value, &sample) in values.iter().zip(order) {
                let (target, times) = drawn[sample as usize];
                if times > 0 {
                    samples.push(Drawn { target, value, sample, times });
                }
            }
            samples
        })
        .collect();
    let mut grower = Grower {
        params,
        rules: Rules::new(params),
        offset: table.offset,
        stream,
        tree: Tree::with_capacity(0),
        gains: vec![0.0; table.columns.len()],
        open: Vec::new(),
        goes_left: vec![false; times.len()],
        right: orders[0].clone(),
        numbers: vec![0; times.len()],
        room: Room::default(),
        orders,
    };
    let sums = sums(&grower.orders[0]);
    let node = grower.push(&sums);
    grower.split_all(Open { start: 0, end: count, depth: 0, node, sums });
    (grower.tree, grower.gains)
}

impl<F: Float> Grower<'_, F> {
    fn push(&mut self, sums: &Sums) -> usize {
        self.tree.push_leaf(F::cast(sums.mean() + self.offset))
    }

    fn is_leaf(&self, open: &Open) -> bool {
        open.end - open.start < 2
            || open.sums.is_pure()
            || self.params.max_depth == Some(open.depth)
            || open.sums.weight < 2.0 * self.rules.min_samples_leaf
            || stops(self.params.stop, &open.sums, self.offset)
    }

    /// Splits a node and all that come of it, left before right.
    fn split_all(&mut self, root: Open) {
        if self.is_leaf(&root) {
            return;
        }
        self.open.push(root);
        let mut renumbered = 0..0;
        while let Some(open) = self.open.pop() {
            if open.end - open.start <= LOCAL && open.start >= renumbered.end {
                renumbered = open.start..open.end;
                self.renumber(renumbered.clone());
            }
            self.split(open);
        }
    }

    /// Numbers the samples of a range again, in the first feature's order.
    fn renumber(&mut self, range: Range<usize>) {
        for (new, drawn) in (0..).zip(&self.orders[0][range.clone()]) {
            self.numbers[drawn.sample as usize] = new;
        }
        for order in &mut self.orders {
            for drawn in &mut order[range.clone()] {
                drawn.sample = self.numbers[drawn.sample as usize];
            }
        }
    }

    fn split(&mut self, Open { start, end, depth, node, sums: all }: Open) {
        let found = splitter::best(
            &self.orders,
            (start, end),
            &all,
            &self.rules,
            self.stream,
            &mut self.room,
        );
        let Some(split) = found else { return };
        self.gains[split.feature] += split.gain;
        let middle = start + split.left;
        let order = &self.orders[split.feature];
        let (left_sums, right_sums) = (sums(&order[start..middle]), sums(&order[middle..end]));
        let left = self.push(&left_sums);
        let right = self.push(&right_sums);
        self.tree.split(node, split.feature, split.threshold, left);
        let depth = depth + 1;
        let left = Open { start, end: middle, depth, node: left, sums: left_sums };
        let right = Open { start: middle, end, depth, node: right, sums: right_sums };
        let (left_waits, right_waits) = (!self.is_leaf(&left), !self.is_leaf(&right));
        if left_waits || right_waits {
            self.partition(split.feature, start, middle, end);
        }
        if right_waits {
            self.open.push(right);
        }
        if left_waits {
            self.open.push(left);
        }
    }

    /// Moves the samples of every order that are before `middle` in that of `feature` to
    /// the front of `start..end`; both sides stay sorted.
    fn partition(&mut self, feature: usize, start: usize, middle: usize, end: usize) {
        let goes_left = &mut self.goes_left[..];
        for drawn in &self.orders[feature][start..middle] {
            goes_left[drawn.sample as usize] = true;
        }
        for drawn in &self.orders[feature][middle..end] {
            goes_left[drawn.sample as usize] = false;
        }
        for (_, order) in self.orders.iter_mut().enumerate().filter(|(other, _)| *other != feature)
        {
            let range = &mut order[start..end];
            let (mut left, mut right) = (0, 0);
            for at in 0..range.len() {
                let drawn = range[at];
                // Written to both sides, of which one counts: there is nothing to predict.
                range[left] = drawn;
                self.right[right] = drawn;
                let goes_left = usize::from(goes_left[drawn.sample as usize]);
                left += goes_left;
                right += 1 - goes_left;
            }
            range[left..].copy_from_slice(&self.right[..right]);
        }
    }
}

fn sums<F>(drawn: &[Drawn<F>]) -> Sums {
    let mut sums = Sums::default();
    for drawn in drawn {
        sums.add(drawn.weight(), drawn.target);
    }
    sums
}
