//! Impurity of a node: the variance of its targets (divided by N).

use super::params::StopRule;

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
