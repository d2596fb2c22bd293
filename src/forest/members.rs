//! The training samples of every leaf, and the weighted quantiles of their targets
//! (Meinshausen, "Quantile Regression Forests", JMLR 7, 2006).

use linfa::Float;
use ndarray::ArrayView1;
use serde::{Deserialize, Serialize};

use super::walk::Tree;
use crate::error::{Error, error};

/// The training samples of every leaf.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Members<F> {
    /// Training targets in increasing order.
    targets: Vec<F>,
    trees: Vec<Leaves>,
}

/// The samples of one tree's leaves, as places among the training targets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    pub(crate) fn check(&self, trees: &[Tree<F>]) -> Result<(), Error> {
        let fits = |(leaves, tree): (&Leaves, &Tree<F>)| {
            leaves.first.len() == tree.nodes() + 1
                && leaves.first[0] == 0
                && leaves.first.is_sorted()
                && leaves.first[tree.nodes()] as usize == leaves.members.len()
                && leaves.members.iter().all(|&m| (m as usize) < self.targets.len())
                && (0..tree.nodes()).all(|n| !tree.is_leaf(n) || !leaves.of(n).is_empty())
        };
        let whole = self.trees.len() == trees.len()
            && self.targets.iter().all(|t| t.is_finite())
            && self.trees.iter().zip(trees).all(fits);
        if whole {
            Ok(())
        } else {
            Err(error!(Other, "the samples of the leaves do not fit the trees"))
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
