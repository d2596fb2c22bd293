//! Impurity of a node: the variance of its targets (divided by N).

use super::params::StopRule;

/// Sums over the samples of a node; targets are centred on the training mean.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sums {
    pub weight: f64,
    pub target: f64,
    pub target_squared: f64,
    /// Whether all targets so far are equal, and to what.
    equal: Option<Option<f64>>,
}

impl Sums {
    pub fn add(&mut self, weight: f64, target: f64) {
        self.weight += weight;
        self.target += weight * target;
        self.target_squared += weight * target * target;
        self.equal = match self.equal {
            None => Some(Some(target)),
            Some(Some(before)) if before == target => Some(Some(target)),
            Some(_) => Some(None),
        };
    }

    /// Whether all targets are equal. The variance would say so only up to rounding.
    pub fn is_pure(&self) -> bool {
        !matches!(self.equal, Some(None))
    }

    /// Difference of gains that is rounding and not gain.
    pub fn rounding(&self) -> f64 {
        1e-13 * self.target_squared
    }

    pub fn mean(&self) -> f64 {
        self.target / self.weight
    }

    pub fn variance(&self) -> f64 {
        (self.target_squared / self.weight - self.mean() * self.mean()).max(0.0)
    }
}

/// What a split gains, up to terms that are equal for all splits of a node.
///
/// With `s`, `w` sums of targets and weights left and right,
/// `I_p − (N_l/N_p) I_l − (N_r/N_p) I_r = (s_l²/w_l + s_r²/w_r − s²/w) / w`.
#[inline]
pub fn proxy(left_target: f64, left_weight: f64, right_target: f64, right_weight: f64) -> f64 {
    left_target * left_target / left_weight + right_target * right_target / right_weight
}

/// Whether the stop rule keeps a node from being split. `offset` is the training mean
/// that the targets are centred on. A mean of 0 counts as infinite variation.
pub fn stops(rule: StopRule, sums: &Sums, offset: f64) -> bool {
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
    fn proxy_is_the_variance_reduction() {
        let (left, right, all) =
            (sums(&[1.0, 2.0]), sums(&[5.0, 9.0, 4.0]), sums(&[1.0, 2.0, 5.0, 9.0, 4.0]));
        let direct = all.variance() - 0.4 * left.variance() - 0.6 * right.variance();
        let by_proxy =
            (proxy(left.target, 2.0, right.target, 3.0) - all.target * all.target / 5.0) / 5.0;
        assert!((direct - by_proxy).abs() < 1e-12);
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
