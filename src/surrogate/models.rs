//! The models that can be trained: one line each in `MODELS`.

use std::fmt;
use std::sync::Arc;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::forest::ForestOptions;
use super::{CaseCurve, CrushLaw, Surrogate};
use super::{crush_law_model, forest, gaussian_process, linear, nearest, rate};
use crate::curve::ForceKind;
use crate::dataset::TrainingSet;
use crate::error::{Error, error};
use crate::guess;

/// Every model, in the order of the tables. To add one: write its file with an `ENTRY`, add its
/// line here.
pub(crate) const MODELS: &[ModelEntry] = &[
    nearest::ENTRY,
    linear::ENTRY,
    gaussian_process::ENTRY,
    rate::ENTRY,
    crush_law_model::ENTRY,
    forest::EXTRA,
    forest::ENTRY,
];

/// One model: its name, its requirements, how it is fitted and read.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ModelEntry {
    /// As the command line and model files name it.
    pub name: &'static str,
    /// What it is, in one line.
    pub about: &'static str,
    /// Place from simple (0) to elaborate: of the models that follow the closing speed the simplest is the default.
    pub complexity: u8,
    /// Whether it sees parameters besides the speed.
    pub sees_features: bool,
    /// Whether its force follows the closing speed at each deflection.
    pub follows_closing: bool,
    /// Whether it needs runs that determine a crush law with stopped mass.
    pub needs_crush_law: bool,
    /// Minimum number of training curves that it answers from.
    pub least_curves: usize,
    /// Options of its forest; `None` for a model without one.
    pub(super) forest: Option<fn() -> ForestOptions>,
    pub(super) fit: Fit,
    /// From what [`Surrogate::parameters`] gave; `None` for a model without any.
    pub(super) load: Load,
}

/// Fits a model.
pub(super) type Fit = fn(&FitInput<'_>) -> Result<Arc<dyn Surrogate>, Error>;

/// Makes a model of its parameters in a model file.
pub(super) type Load = fn(Option<&str>) -> Result<Arc<dyn Surrogate>, serde_json::Error>;

/// Input of a fit.
pub(super) struct FitInput<'a> {
    pub set: &'a TrainingSet,
    /// The curves of `force`, in order of speed.
    pub curves: &'a [CaseCurve],
    pub force: ForceKind,
    pub forest: Option<&'a ForestOptions>,
    /// Of the set, if the model needs one and the runs determine one.
    pub crush_law: Option<&'a CrushLaw>,
}

impl FitInput<'_> {
    pub(crate) fn forest_options(&self) -> &ForestOptions {
        self.forest.expect("ModelKind gives options to each model with a forest")
    }

    /// The crush law with stopped mass.
    pub(crate) fn crush_law(&self) -> Result<CrushLaw, Error> {
        self.crush_law.cloned().ok_or(error!(Model, "model crush-law takes the mass stopped in the crush zone from momentum: it needs contact forces and speeds of a body against a wall, or of two bodies of equal mass, whose momentum agrees; the runs of this group do not qualify, or show no stopped mass: use --model rate"))
    }
}

/// `parameters` of a model that has some.
pub(super) fn loaded<T>(parameters: Option<&str>) -> Result<Arc<dyn Surrogate>, serde_json::Error>
where
    T: Surrogate + DeserializeOwned + 'static,
{
    Ok(Arc::new(serde_json::from_slice::<T>(parameters.unwrap_or("null").as_bytes())?))
}

/// Most trees of a forest that is judged with many runs.
const CANDIDATE_TREES: usize = 50;

/// Most rows of a forest that is judged with many runs: those of 10 curves of 400 points, five on either side of the speed.
const MOST_ROWS: usize = 4_000;

/// Which model, with its options.
#[derive(Clone, Copy)]
pub struct ModelKind {
    /// What the table of models says of it.
    pub(crate) entry: &'static ModelEntry,
    forest: Option<ForestOptions>,
}

impl ModelKind {
    /// The model of that name with its own options and this seed for its forest; `None` if there
    /// is none.
    pub fn named(name: &str, seed: u64) -> Option<Self> {
        MODELS.iter().find(|entry| entry.name == name).map(|entry| Self::of(entry, seed))
    }

    fn of(entry: &'static ModelEntry, seed: u64) -> Self {
        Self { entry, forest: entry.forest.map(|options| ForestOptions { seed, ..options() }) }
    }

    /// Every model, in the order of `MODELS`.
    pub fn all(seed: u64) -> Vec<Self> {
        MODELS.iter().map(|entry| Self::of(entry, seed)).collect()
    }

    /// The same to be judged where there are many runs: a forest of at most 50 trees on at most 4 000 rows, those nearest to the
    /// speed that it is judged at ([`ModelKind::near`]).
    pub(crate) fn judged(self) -> Self {
        self.with_forest(|f| ForestOptions {
            trees: f.trees.min(CANDIDATE_TREES),
            most_rows: Some((MOST_ROWS, 0.0)),
            ..f
        })
    }

    /// The same to be judged at a speed in m/s.
    pub(crate) fn near(self, speed_m_per_s: f64) -> Self {
        self.with_forest(|f| ForestOptions {
            most_rows: f.most_rows.map(|(most, _)| (most, speed_m_per_s)),
            ..f
        })
    }

    /// The one run of the nearest speed (FDRM).
    pub fn nearest() -> Self {
        Self::known(nearest::ENTRY.name)
    }

    /// Linear in speed at equal deflection.
    pub fn linear() -> Self {
        Self::known(linear::ENTRY.name)
    }

    /// Linear in speed, with the force following the speed at each deflection.
    pub fn rate() -> Self {
        Self::known(rate::ENTRY.name)
    }

    /// A random forest (DDTCM with [`ForestOptions::paper`]).
    pub fn forest(options: ForestOptions) -> Self {
        Self::known(forest::ENTRY.name).with_forest(|_| options)
    }

    /// Extremely randomised trees.
    pub fn extra(options: ForestOptions) -> Self {
        Self::known(forest::EXTRA.name).with_forest(|_| options)
    }

    fn known(name: &str) -> Self {
        Self::named(name, 0).expect("MODELS has an entry of that name")
    }

    /// The same with other options of its forest, if it has one.
    pub fn with_forest(self, change: impl FnOnce(ForestOptions) -> ForestOptions) -> Self {
        Self { forest: self.forest.map(change), ..self }
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        self.entry.name
    }

    /// Options of its forest, if it has one.
    pub fn forest_options(&self) -> Option<&ForestOptions> {
        self.forest.as_ref()
    }

    /// Whether it is the reference method's forest (DDTCM), whatever its seed.
    pub(crate) fn is_reference_method(&self) -> bool {
        let paper = |f: ForestOptions| ForestOptions {
            seed: f.seed,
            most_rows: f.most_rows,
            ..ForestOptions::paper()
        };
        self.name() == forest::ENTRY.name && self.forest.is_some_and(|f| f == paper(f))
    }
}

impl PartialEq for ModelKind {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name() && self.forest == other.forest
    }
}

impl fmt::Debug for ModelKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ModelKind")
            .field("name", &self.name())
            .field("forest", &self.forest)
            .finish()
    }
}

/// `ModelKind` as model files have it.
#[derive(Serialize, Deserialize)]
struct KindInFile {
    model: String,
    #[serde(flatten)]
    forest: Option<ForestOptions>,
}

impl Serialize for ModelKind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        KindInFile { model: self.name().into(), forest: self.forest }.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for ModelKind {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        use serde::de::Error as _;
        let KindInFile { model, forest } = KindInFile::deserialize(deserializer)?;
        let Some(kind) = Self::named(&model, 0) else {
            let known: Vec<&str> = MODELS.iter().map(|entry| entry.name).collect();
            let known = known.join(", ");
            return Err(D::Error::custom(format!(
                "no model \"{model}\": expected one of {known}{}",
                guess::hint(&model, &known)
            )));
        };
        match (kind.forest.is_some(), forest) {
            (true, None) => {
                Err(D::Error::custom(format!("model \"{model}\" lacks the options of its forest")))
            }
            (true, forest) => Ok(Self { forest, ..kind }),
            (false, _) => Ok(kind),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_complexities_are_distinct() {
        for (i, a) in MODELS.iter().enumerate() {
            for b in &MODELS[i + 1..] {
                assert_ne!(a.name, b.name);
                assert_ne!(a.complexity, b.complexity, "{} and {}", a.name, b.name);
            }
        }
    }

    #[test]
    fn kinds_come_back_from_their_file() {
        for kind in ModelKind::all(7) {
            let json = serde_json::to_string(&kind).unwrap();
            assert_eq!(serde_json::from_str::<ModelKind>(&json).unwrap(), kind, "{json}");
        }
        assert_eq!(serde_json::to_string(&ModelKind::rate()).unwrap(), r#"{"model":"rate"}"#);
        let unknown = serde_json::from_str::<ModelKind>(r#"{"model":"best"}"#).unwrap_err();
        assert!(unknown.to_string().contains("expected one of nearest, linear"), "{unknown}");
    }

    #[test]
    fn the_reference_method_is_known_by_its_options() {
        assert!(
            ModelKind::forest(ForestOptions { seed: 3, ..ForestOptions::paper() })
                .is_reference_method()
        );
        assert!(!ModelKind::forest(ForestOptions::default()).is_reference_method());
        assert!(!ModelKind::rate().is_reference_method());
    }
}
