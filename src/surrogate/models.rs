//! The models that can be trained: one line each in `MODELS`.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

pub(crate) use super::entry::ModelEntry;
use super::forest_options::ForestOptions;
use super::{crush_law_model, extra, forest, gaussian_process, linear, nearest, rate};
use crate::guess;

/// Every model, in the order of the tables. To add one: write its file with an `ENTRY`, add its
/// line here.
pub(crate) const MODELS: &[ModelEntry] = &[
    nearest::ENTRY,
    linear::ENTRY,
    gaussian_process::ENTRY,
    rate::ENTRY,
    crush_law_model::ENTRY,
    extra::ENTRY,
    forest::ENTRY,
];

/// Most trees of a forest that is judged with many runs.
const CANDIDATE_TREES: usize = 50;

/// Most rows of a forest that is judged with many runs: those of 10 curves of 400 points, five on either side of the speed.
const MOST_ROWS: usize = 4_000;

/// Which model, with its options.
#[derive(Clone, Copy)]
pub struct ModelKind {
    entry: &'static ModelEntry,
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
        Self::known(extra::ENTRY.name).with_forest(|_| options)
    }

    fn known(name: &str) -> Self {
        Self::named(name, 0).expect("MODELS has an entry of that name")
    }

    /// The same with other options of its forest, if it has one.
    pub fn with_forest(self, change: impl FnOnce(ForestOptions) -> ForestOptions) -> Self {
        Self { forest: self.forest.map(change), ..self }
    }

    /// What the table of models says of it.
    pub(crate) fn entry(&self) -> &'static ModelEntry {
        self.entry
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
        use serde::de::Error;
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
