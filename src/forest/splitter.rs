//! The best split of a node.

use linfa::Float;

use super::criterion::{Sums, proxy};
use super::params::{FeaturesPerSplit, Thresholds, Ties};
use super::stream::Stream;

/// Training data by columns; shared by all trees.
pub struct Table<F> {
    /// Feature values: `columns[feature][sample]`.
    pub columns: Vec<Vec<F>>,
    /// Targets, centred on their mean.
    pub targets: Vec<f64>,
    /// Mean that was taken off the targets.
    pub offset: f64,
    /// Samples by increasing value of each feature, ties by sample.
    pub orders: Vec<Vec<u32>>,
}

/// The samples of one tree.
///
/// Invariant: for every feature, `orders[feature][start..end]` are the samples of the
/// node that owns the range `start..end`, by increasing value.
pub struct Samples {
    pub orders: Vec<Vec<u32>>,
    /// How often each sample was drawn.
    pub weights: Vec<f64>,
}

/// A split: left if `value < threshold`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Split<F> {
    pub feature: usize,
    pub threshold: F,
    gain: f64,
}

/// What a split must keep to.
pub struct Rules {
    pub thresholds: Thresholds,
    pub features: FeaturesPerSplit,
    pub ties: Ties,
    pub min_samples_leaf: f64,
}

impl<F: Float> Split<F> {
    /// Higher gain first. Of ties, the lowest feature wins or, if they are random, the
    /// one that came first in a random order; within a feature the lowest threshold.
    /// Gains that differ by less than `rounding` tie.
    fn beats(&self, other: &Option<Self>, ties: Ties, rounding: f64) -> bool {
        let Some(best) = other else { return true };
        let lower = ties == Ties::LowestFeature && self.feature < best.feature;
        let difference = self.gain - best.gain;
        difference > rounding || (difference >= -rounding && lower)
    }
}

/// The best split of the node that owns `start..end`, or `None` if no split gains.
pub fn best<F: Float>(
    table: &Table<F>,
    samples: &Samples,
    (start, end): (usize, usize),
    node: &Sums,
    rules: &Rules,
    stream: &mut Stream,
) -> Option<Split<F>> {
    let features = table.columns.len();
    let mut best: Option<Split<F>> = None;
    let consider = |feature: usize, best: &mut Option<Split<F>>, stream: &mut Stream| {
        let column = &table.columns[feature];
        let order = &samples.orders[feature][start..end];
        let (low, high) = (column[order[0] as usize], column[order[order.len() - 1] as usize]);
        if low >= high {
            return false; // constant in this node
        }
        let found = match rules.thresholds {
            Thresholds::Midpoint => midpoints(table, samples, feature, order, node, rules),
            Thresholds::Random => {
                let threshold = draw(low, high, stream);
                at(table, samples, feature, order, threshold, node, rules)
            }
        };
        if let Some(split) = found
            && split.beats(best, rules.ties, node.rounding())
        {
            *best = Some(split);
        }
        true
    };
    let wanted = match rules.features {
        FeaturesPerSplit::All => features,
        FeaturesPerSplit::Count(count) => count,
    };
    if wanted >= features && rules.ties == Ties::LowestFeature {
        for feature in 0..features {
            consider(feature, &mut best, stream);
        }
    } else {
        let mut untried: Vec<usize> = (0..features).collect();
        let mut tried = 0;
        while tried < wanted && !untried.is_empty() {
            let feature = untried.swap_remove(stream.below(untried.len()));
            tried += usize::from(consider(feature, &mut best, stream));
        }
    }
    let unsplit = node.target * node.target / node.weight;
    best.filter(|split| split.gain > unsplit + node.rounding())
}

/// The best of all midpoints between consecutive distinct values.
fn midpoints<F: Float>(
    table: &Table<F>,
    samples: &Samples,
    feature: usize,
    order: &[u32],
    node: &Sums,
    rules: &Rules,
) -> Option<Split<F>> {
    let column = &table.columns[feature];
    let (mut left_weight, mut left_target) = (0.0, 0.0);
    let mut best: Option<(f64, F, F)> = None;
    let mut best_gain = f64::NEG_INFINITY;
    let rounding = node.rounding();
    let mut value = column[order[0] as usize];
    for pair in order.windows(2) {
        let sample = pair[0] as usize;
        let weight = samples.weights[sample];
        left_weight += weight;
        left_target += weight * table.targets[sample];
        let next = column[pair[1] as usize];
        let (low, high) = (value, next);
        value = next;
        if low >= high {
            continue;
        }
        let right_weight = node.weight - left_weight;
        if left_weight < rules.min_samples_leaf || right_weight < rules.min_samples_leaf {
            continue;
        }
        let gain = proxy(left_target, left_weight, node.target - left_target, right_weight);
        if gain > best_gain + rounding {
            best_gain = gain;
            best = Some((gain, low, high));
        }
    }
    best.map(|(gain, low, high)| Split { feature, threshold: between(low, high), gain })
}

/// The split at a given threshold, if both sides are large enough.
fn at<F: Float>(
    table: &Table<F>,
    samples: &Samples,
    feature: usize,
    order: &[u32],
    threshold: F,
    node: &Sums,
    rules: &Rules,
) -> Option<Split<F>> {
    let column = &table.columns[feature];
    let (mut left_weight, mut left_target) = (0.0, 0.0);
    for &sample in order.iter().take_while(|&&s| column[s as usize] < threshold) {
        let weight = samples.weights[sample as usize];
        left_weight += weight;
        left_target += weight * table.targets[sample as usize];
    }
    let right_weight = node.weight - left_weight;
    if left_weight < rules.min_samples_leaf || right_weight < rules.min_samples_leaf {
        return None;
    }
    let gain = proxy(left_target, left_weight, node.target - left_target, right_weight);
    Some(Split { feature, threshold, gain })
}

/// A threshold with `low < threshold <= high`, so that both sides are never empty.
fn between<F: Float>(low: F, high: F) -> F {
    let half = F::cast(0.5);
    // Halved before adding, so that large values do not overflow.
    let middle = low * half + high * half;
    if middle > low && middle <= high { middle } else { high }
}

fn draw<F: Float>(low: F, high: F, stream: &mut Stream) -> F {
    let share = F::cast(stream.unit());
    let threshold = low * (F::one() - share) + high * share;
    if threshold > low && threshold <= high { threshold } else { high }
}
