//! The best split of a node, by the variance that it removes.

use linfa::Float;

use super::params::{FeaturesPerSplit, ForestValidParams, StopRule, Thresholds, Ties};
use crate::stream::Stream;

/// A drawn sample in a feature's order. What a scan reads stands side by side, so that it
/// goes through memory in one direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drawn<F> {
    /// Centred on the training mean.
    pub target: f64,
    /// The feature's value.
    pub value: F,
    pub sample: u32,
    /// How often it was drawn.
    pub times: u32,
}

impl<F> Drawn<F> {
    #[inline]
    pub(crate) fn weight(&self) -> f64 {
        f64::from(self.times)
    }
}

/// A split: left if `value < threshold`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Split<F> {
    pub feature: usize,
    pub threshold: F,
    /// How many distinct samples go left: the first ones in the feature's order.
    pub left: usize,
    pub gain: f64,
}

/// What a split must keep to.
pub(crate) struct Rules {
    thresholds: Thresholds,
    features: FeaturesPerSplit,
    ties: Ties,
    pub min_samples_leaf: f64,
}

impl Rules {
    pub(crate) fn new<F>(params: &ForestValidParams<F>) -> Self {
        Self {
            thresholds: params.thresholds,
            features: params.features_per_split,
            ties: params.ties,
            min_samples_leaf: params.min_samples_leaf as f64,
        }
    }

    #[inline]
    fn large_enough(&self, node: &Sums, left_weight: f64) -> bool {
        let right_weight = node.weight - left_weight;
        (left_weight >= self.min_samples_leaf) & (right_weight >= self.min_samples_leaf)
    }
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

/// Room that searches share.
#[derive(Default)]
pub(crate) struct Room {
    untried: Vec<usize>,
    gains: Vec<f64>,
}

/// The best split of the node that owns the range `start..end` of every feature's order, or
/// `None` if no split gains.
pub(crate) fn best<F: Float>(
    orders: &[Vec<Drawn<F>>],
    (start, end): (usize, usize),
    node: &Sums,
    rules: &Rules,
    stream: &mut Stream,
    Room { untried, gains }: &mut Room,
) -> Option<Split<F>> {
    let features = orders.len();
    let mut best: Option<Split<F>> = None;
    let mut consider = |feature: usize, stream: &mut Stream| {
        let order = &orders[feature][start..end];
        let (low, high) = (order[0].value, order[order.len() - 1].value);
        if low >= high {
            return false; // constant in this node
        }
        let found = match rules.thresholds {
            Thresholds::Midpoint => midpoints(feature, order, node, rules, gains),
            Thresholds::Random => at(feature, order, draw(low, high, stream), node, rules),
        };
        if let Some(split) = found
            && split.beats(&best, rules.ties, node.rounding())
        {
            best = Some(split);
        }
        true
    };
    let wanted = match rules.features {
        FeaturesPerSplit::All => features,
        FeaturesPerSplit::Count(count) => count,
    };
    if wanted >= features && rules.ties == Ties::LowestFeature {
        for feature in 0..features {
            consider(feature, stream);
        }
    } else {
        untried.clear();
        untried.extend(0..features);
        let mut tried = 0;
        while tried < wanted && !untried.is_empty() {
            let feature = untried.swap_remove(stream.below(untried.len()));
            tried += usize::from(consider(feature, stream));
        }
    }
    best
}

/// The best of all midpoints between consecutive distinct values, if it gains.
///
/// Gains are noted first and searched then: a running best would branch on every gain, and
/// in the small nodes that are most of a tree half of the branches go astray.
fn midpoints<F: Float>(
    feature: usize,
    order: &[Drawn<F>],
    node: &Sums,
    rules: &Rules,
    gains: &mut Vec<f64>,
) -> Option<Split<F>> {
    let (mut left_weight, mut left_target) = (0.0, 0.0);
    let mut most = 0.0;
    let (firsts, seconds) = (&order[..order.len() - 1], &order[1..]);
    gains.resize(firsts.len(), 0.0);
    let noted = &mut gains[..firsts.len()];
    for k in 0..firsts.len() {
        let (left, right) = (&firsts[k], &seconds[k]);
        let weight = left.weight();
        left_weight += weight;
        left_target += weight * left.target;
        let allowed = (left.value < right.value) & rules.large_enough(node, left_weight);
        let found = node.gain(left_weight, left_target);
        noted[k] = if allowed { found } else { 0.0 };
        most = if noted[k] > most { noted[k] } else { most };
    }
    if most <= node.rounding() {
        return None;
    }
    let at = gains.iter().position(|&gain| gain >= most - node.rounding())?;
    let threshold = between(order[at].value, order[at + 1].value);
    Some(Split { feature, threshold, left: at + 1, gain: most })
}

/// The split at a given threshold, if it gains and both sides are large enough.
fn at<F: Float>(
    feature: usize,
    order: &[Drawn<F>],
    threshold: F,
    node: &Sums,
    rules: &Rules,
) -> Option<Split<F>> {
    let (mut left, mut left_weight, mut left_target) = (0, 0.0, 0.0);
    for drawn in order.iter().take_while(|d| d.value < threshold) {
        left += 1;
        left_weight += drawn.weight();
        left_target += drawn.weight() * drawn.target;
    }
    let gain = node.gain(left_weight, left_target);
    let split = Split { feature, threshold, left, gain };
    (gain > node.rounding() && rules.large_enough(node, left_weight)).then_some(split)
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

/// Sums over the samples of a node; targets are centred on the training mean.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sums {
    pub weight: f64,
    pub target: f64,
    pub target_squared: f64,
}

impl Sums {
    #[inline]
    pub(crate) fn add(&mut self, weight: f64, target: f64) {
        self.weight += weight;
        self.target += weight * target;
        self.target_squared += weight * target * target;
    }

    /// Difference of gains that is rounding and not gain.
    pub(crate) fn rounding(&self) -> f64 {
        1e-13 * self.target_squared
    }

    /// Whether no split can gain more than rounding: none gains more than the squares about
    /// the mean.
    pub(crate) fn is_pure(&self) -> bool {
        self.target_squared - self.target * self.target / self.weight <= self.rounding()
    }

    pub(crate) fn mean(&self) -> f64 {
        self.target / self.weight
    }

    pub(crate) fn variance(&self) -> f64 {
        (self.target_squared / self.weight - self.mean() * self.mean()).max(0.0)
    }

    /// What a split gains: the fall of the squares about the means, which is the node's
    /// weight times `I_p − (N_l/N_p) I_l − (N_r/N_p) I_r`.
    ///
    /// With `s`, `w` sums of targets and weights, `s_l²/w_l + s_r²/w_r − s²/w` is
    /// `(s_l w − s w_l)² / (w w_l w_r)`: no difference of large numbers is left.
    #[inline]
    pub(crate) fn gain(&self, left_weight: f64, left_target: f64) -> f64 {
        let difference = left_target * self.weight - self.target * left_weight;
        difference * difference / (self.weight * left_weight * (self.weight - left_weight))
    }
}

/// Whether the stop rule keeps a node from being split. `offset` is the training mean
/// that the targets are centred on. A mean of 0 counts as infinite variation.
pub(crate) fn stops(rule: StopRule, sums: &Sums, offset: f64) -> bool {
    let mean = sums.mean() + offset;
    let below = |variation: f64, threshold: f64| mean != 0.0 && variation < threshold;
    match rule {
        StopRule::Unpruned => false,
        StopRule::VarOverMean(threshold) => below((sums.variance() / mean).abs(), threshold),
        StopRule::StdOverMean(threshold) => below(sums.variance().sqrt() / mean.abs(), threshold),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sums(targets: &[f64]) -> Sums {
        let mut sums = Sums::default();
        for &t in targets {
            sums.add(1.0, t);
        }
        sums
    }

    #[test]
    fn gain_is_the_variance_reduction() {
        let (left, right, all) =
            (sums(&[1.0, 2.0]), sums(&[5.0, 9.0, 4.0]), sums(&[1.0, 2.0, 5.0, 9.0, 4.0]));
        let direct = all.variance() - 0.4 * left.variance() - 0.6 * right.variance();
        assert!((direct - all.gain(2.0, left.target) / 5.0).abs() < 1e-12);
    }

    #[test]
    fn equal_targets_are_pure() {
        assert!(sums(&[0.1; 37]).is_pure());
        assert!(!sums(&[0.1, 0.1 + 1e-6]).is_pure());
    }

    #[test]
    fn both_stop_rules() {
        let node = sums(&[-1.0, 1.0]); // variance 1
        assert!(stops(StopRule::VarOverMean(0.011), &node, 100.0));
        assert!(!stops(StopRule::VarOverMean(0.009), &node, 100.0));
        assert!(stops(StopRule::StdOverMean(0.011), &node, 100.0));
        assert!(!stops(StopRule::StdOverMean(0.009), &node, 100.0));
        assert!(!stops(StopRule::StdOverMean(1e9), &node, 0.0), "mean 0 is infinite variation");
        assert!(!stops(StopRule::Unpruned, &node, 100.0));
    }
}
