//! Hyperparameters: a builder, checked once into the type that can fit.

use linfa::{Float, ParamGuard};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

/// Samples of which the nodes of a tree, twice as many, can still be numbered in 31 bits.
pub(super) const MOST_SAMPLES: usize = 1 << 30;

/// How thresholds are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize), serde(rename_all = "snake_case"))]
pub enum Thresholds {
    /// Every midpoint between consecutive distinct values; the best one is taken.
    Midpoint,
    /// One uniform draw in the node's range per feature (extra-trees).
    Random,
}

/// When a node is not split although it could be: its coefficient of variation is low.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize), serde(rename_all = "snake_case"))]
pub enum StopRule {
    /// Never: grow until leaves are pure.
    Unpruned,
    /// `Var/Mean`, as printed in the reference; in the unit of the target.
    VarOverMean(f64),
    /// `sqrt(Var)/|Mean|`, dimensionless.
    StdOverMean(f64),
}

/// Which of equally good splits on different features is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize), serde(rename_all = "snake_case"))]
pub enum Ties {
    /// The feature with the lowest index (reference method).
    LowestFeature,
    /// Any of them, as scikit-learn does. Splits of two samples are always equally good,
    /// so the rule shows in the error: by some per cent of it.
    Random,
}

/// How many features are candidates at a split.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize), serde(rename_all = "snake_case"))]
pub enum FeaturesPerSplit {
    /// Every feature.
    All,
    /// This many that are not constant in the node, drawn without replacement.
    Count(usize),
}

/// Why a forest cannot be fitted, or asked for quantiles.
#[derive(Debug, thiserror::Error)]
pub enum ForestError {
    /// The number of trees is 0.
    #[error("a forest needs at least 1 tree, found 0")]
    NoTrees,
    /// A leaf may be empty.
    #[error("min_samples_leaf must be at least 1, found 0")]
    MinSamplesLeaf,
    /// The largest depth is 0.
    #[error("max_depth must be at least 1, found 0")]
    MaxDepth,
    /// No feature is tried at a split.
    #[error("features per split must be at least 1, found 0")]
    FeaturesPerSplit,
    /// The threshold at which a branch stops is below 0 or no number.
    #[error("the stop rule's threshold must be a finite number of at least 0, found {threshold}")]
    StopThreshold {
        /// The threshold.
        threshold: f64,
    },
    /// An out-of-bag error is requested, but every tree sees all samples.
    #[error("out-of-bag error needs bootstrap samples: set bootstrap(true)")]
    OutOfBagWithoutBootstrap,
    /// More features are to be tried at a split than there are.
    #[error("features per split are {count}, but the records have {features} features")]
    TooManyFeaturesPerSplit {
        /// Number to be tried.
        count: usize,
        /// Number there are.
        features: usize,
    },
    /// There is no sample.
    #[error("there are no samples to fit")]
    NoSamples,
    /// There is no feature.
    #[error("there are no features to split on")]
    NoFeatures,
    /// There are more samples than a forest can index.
    #[error("{samples} samples are more than a forest can index ({most})", most = MOST_SAMPLES)]
    TooManySamples {
        /// Number of samples.
        samples: usize,
    },
    /// Records and targets differ in number.
    #[error("{records} records but {targets} targets")]
    Lengths {
        /// Number of records.
        records: usize,
        /// Number of targets.
        targets: usize,
    },
    /// A value of a feature is infinite or no number.
    #[error("record {row}, feature {feature} is {value}: expected a finite number")]
    RecordNotFinite {
        /// The sample, counted from 0.
        row: usize,
        /// The feature, counted from 0.
        feature: usize,
        /// The value.
        value: f64,
    },
    /// A target is infinite or no number.
    #[error("target {row} is {value}: expected a finite number")]
    TargetNotFinite {
        /// The sample, counted from 0.
        row: usize,
        /// The value.
        value: f64,
    },
    /// Quantiles are requested from a forest that has not kept the members of its leaves.
    #[error("the forest has not kept the samples of its leaves: fit it with quantiles(true)")]
    NoMembers,
    /// The level of the quantiles is not between 0 and 1.
    #[error("the level of a quantile must be between 0 and 1, found {level}")]
    Level {
        /// The level.
        level: f64,
    },
    /// A record has another number of features than the forest was fitted with.
    #[error("the records have {found} features, the forest was fitted to {fitted}")]
    Features {
        /// Number in the record.
        found: usize,
        /// Number that the forest was fitted with.
        fitted: usize,
    },
    /// A forest that was read from a file is not one; what is wrong in it.
    #[error("{0}")]
    Damaged(String),
    /// As many names of features are needed for an ONNX model as the forest was fitted to.
    #[error("{named} features are named, the forest was fitted to {fitted}")]
    FeatureNames {
        /// Number of names.
        named: usize,
        /// Number of features.
        fitted: usize,
    },
    /// The ONNX model would be larger than protobuf allows.
    #[error("an ONNX file holds less than 2 GiB, this forest needs {bytes} bytes")]
    OnnxTooLarge {
        /// Its size.
        bytes: usize,
    },
    /// An error of linfa itself.
    #[error(transparent)]
    Linfa(#[from] linfa::Error),
}

/// Checked hyperparameters; only these can fit.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct ForestValidParams<F> {
    pub(super) trees: usize,
    pub(super) seed: u64,
    pub(super) bootstrap: bool,
    pub(super) thresholds: Thresholds,
    pub(super) stop: StopRule,
    pub(super) min_samples_leaf: usize,
    pub(super) max_depth: Option<usize>,
    pub(super) features_per_split: FeaturesPerSplit,
    pub(super) ties: Ties,
    pub(super) out_of_bag: bool,
    /// Absent in files of programs that did not know it.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(super) quantiles: bool,
    #[cfg_attr(feature = "serde", serde(skip))]
    float: std::marker::PhantomData<F>,
}

impl<F> ForestValidParams<F> {
    /// How thresholds are chosen.
    pub fn thresholds(&self) -> Thresholds {
        self.thresholds
    }
}

/// Hyperparameters of a regression forest, unchecked.
#[derive(Clone, Debug, PartialEq)]
pub struct ForestParams<F>(ForestValidParams<F>);

impl<F: Float> ForestParams<F> {
    /// A forest of `trees` unpruned trees on bootstrap samples, all features at every
    /// split, midpoint thresholds, seed 0.
    pub fn new(trees: usize) -> Self {
        Self(ForestValidParams {
            trees,
            seed: 0,
            bootstrap: true,
            thresholds: Thresholds::Midpoint,
            stop: StopRule::Unpruned,
            min_samples_leaf: 1,
            max_depth: None,
            features_per_split: FeaturesPerSplit::All,
            ties: Ties::LowestFeature,
            out_of_bag: false,
            quantiles: false,
            float: std::marker::PhantomData,
        })
    }

    /// Random seed. The same seed gives the same forest on any number of threads.
    pub fn seed(mut self, seed: u64) -> Self {
        self.0.seed = seed;
        self
    }

    /// Whether each tree sees N samples drawn with replacement (default) or all once.
    pub fn bootstrap(mut self, bootstrap: bool) -> Self {
        self.0.bootstrap = bootstrap;
        self
    }

    /// How thresholds are chosen.
    pub fn thresholds(mut self, thresholds: Thresholds) -> Self {
        self.0.thresholds = thresholds;
        self
    }

    /// When a node becomes a leaf.
    pub fn stop(mut self, stop: StopRule) -> Self {
        self.0.stop = stop;
        self
    }

    /// Minimum samples per leaf; samples drawn twice count twice.
    pub fn min_samples_leaf(mut self, samples: usize) -> Self {
        self.0.min_samples_leaf = samples;
        self
    }

    /// Most splits between root and leaf; `None` for no limit.
    pub fn max_depth(mut self, depth: Option<usize>) -> Self {
        self.0.max_depth = depth;
        self
    }

    /// How many features are examined for each split.
    pub fn features_per_split(mut self, features: FeaturesPerSplit) -> Self {
        self.0.features_per_split = features;
        self
    }

    /// Which of equally good splits is taken.
    pub fn ties(mut self, ties: Ties) -> Self {
        self.0.ties = ties;
        self
    }

    /// Whether to estimate the error from the samples each tree did not see.
    pub fn out_of_bag(mut self, out_of_bag: bool) -> Self {
        self.0.out_of_bag = out_of_bag;
        self
    }

    /// Whether to keep the samples of every leaf, for
    /// [`RegressionForest::quantiles`](super::RegressionForest::quantiles).
    pub fn quantiles(mut self, quantiles: bool) -> Self {
        self.0.quantiles = quantiles;
        self
    }
}

impl<F: Float> ParamGuard for ForestParams<F> {
    type Checked = ForestValidParams<F>;
    type Error = ForestError;

    fn check_ref(&self) -> Result<&Self::Checked, ForestError> {
        let p = &self.0;
        if p.trees == 0 {
            return Err(ForestError::NoTrees);
        }
        if p.min_samples_leaf == 0 {
            return Err(ForestError::MinSamplesLeaf);
        }
        if p.max_depth == Some(0) {
            return Err(ForestError::MaxDepth);
        }
        if p.features_per_split == FeaturesPerSplit::Count(0) {
            return Err(ForestError::FeaturesPerSplit);
        }
        if let StopRule::VarOverMean(threshold) | StopRule::StdOverMean(threshold) = p.stop
            && !(threshold.is_finite() && threshold >= 0.0)
        {
            return Err(ForestError::StopThreshold { threshold });
        }
        if p.out_of_bag && !p.bootstrap {
            return Err(ForestError::OutOfBagWithoutBootstrap);
        }
        Ok(p)
    }

    fn check(self) -> Result<Self::Checked, ForestError> {
        self.check_ref()?;
        Ok(self.0)
    }
}
