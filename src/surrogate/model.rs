//! Models: a surrogate fitted to a group, with everything needed to predict and to trust.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::forest::{ForestOptions, ForestSurrogate};
use super::leave_one_out::{self, LeftOut};
use super::nearest::Nearest;
use super::{Surrogate, Warning};
use crate::curve::{ForceKind, Masses};
use crate::dataset::{DatasetError, TrainingSet};
use crate::file::{WriteError, write_whole};
use crate::forest::ForestError;
use crate::unit::SpeedKind;

/// Value of a model file's `format`.
const FORMAT: &str = "crumple model";
/// Version of model files this program writes; it reads this and every older one.
const VERSION: u32 = 1;

/// Which surrogate, with its choices.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "model", rename_all = "snake_case")]
pub enum Options {
    Forest(ForestOptions),
    Nearest,
}

impl Options {
    pub fn name(&self) -> &'static str {
        match self {
            Self::Forest(_) => "forest",
            Self::Nearest => "nearest",
        }
    }
}

/// A fitted surrogate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fitted {
    Forest(ForestSurrogate),
    Nearest(Nearest),
}

impl Fitted {
    fn surrogate(&self) -> &dyn Surrogate {
        match self {
            Self::Forest(forest) => forest,
            Self::Nearest(nearest) => nearest,
        }
    }
}

/// What a model keeps of a training case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelCase {
    pub name: String,
    pub speed_m_per_s: f64,
    pub max_deflection_m: f64,
    pub truncated: bool,
    #[serde(rename = "unloading_stiffness_N_per_m")]
    pub unloading_stiffness_n_per_m: Option<f64>,
}

/// A model file: versioned, self-describing JSON, readable without this program.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Model {
    format: String,
    version: u32,
    written_by: String,
    pub group: String,
    pub speed_kind: SpeedKind,
    pub force_kind: ForceKind,
    pub mass_kg: f64,
    pub other_mass_kg: Option<f64>,
    /// Hash over the fingerprints of the training cases.
    pub training_hash: String,
    /// In order of speed.
    pub cases: Vec<ModelCase>,
    pub options: Options,
    /// Errors when each inner speed was left out; empty with fewer than three cases.
    pub validation: Vec<LeftOut>,
    fitted: Fitted,
}

/// Why a model cannot be fitted, read or written.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    #[error(transparent)]
    Forest(#[from] ForestError),
    #[error(
        "a forest needs at least 2 speeds, the group has 1: only --model nearest can use a single curve"
    )]
    OneSpeed,
    #[error("{path}: {source}")]
    Io { path: PathBuf, source: std::io::Error },
    #[error(
        "{path}: line {line}, column {column}: this is no model file ({detail}): give one made by crumple train"
    )]
    NotAModel { path: PathBuf, line: usize, column: usize, detail: String },
    #[error("{path}: model file version {found} is newer than this program reads ({known})", known = VERSION)]
    Version { path: PathBuf, found: u32 },
    #[error("{path}: the model is damaged: {detail}")]
    Damaged { path: PathBuf, detail: String },
    #[error(transparent)]
    Write(#[from] WriteError),
}

impl Model {
    /// Fits the model and validates it by leaving each inner speed out.
    ///
    /// # Errors
    /// [`ModelError`] if the set is too small for the model or its options are wrong.
    pub fn fit(set: &TrainingSet, options: Options) -> Result<Self, ModelError> {
        let mut model = Self::fit_only(set, options)?;
        model.validation = leave_one_out::validate(set, options)?;
        Ok(model)
    }

    /// Fits the model without validating it.
    ///
    /// # Errors
    /// As [`Model::fit`].
    pub fn fit_only(set: &TrainingSet, options: Options) -> Result<Self, ModelError> {
        let fitted = match &options {
            Options::Forest(_) if set.cases.len() < 2 => return Err(ModelError::OneSpeed),
            Options::Forest(options) => Fitted::Forest(ForestSurrogate::fit(set, options)?),
            Options::Nearest => Fitted::Nearest(Nearest::fit(set)),
        };
        let case = |c: &crate::dataset::TrainingCase| ModelCase {
            name: c.name.clone(),
            speed_m_per_s: c.speed_m_per_s,
            max_deflection_m: c.envelope.end_m(),
            truncated: c.truncated,
            unloading_stiffness_n_per_m: c.unloading_stiffness_n_per_m,
        };
        Ok(Self {
            format: FORMAT.into(),
            version: VERSION,
            written_by: concat!("crumple ", env!("CARGO_PKG_VERSION")).into(),
            group: set.group.clone(),
            speed_kind: set.speed_kind,
            force_kind: set.force_kind,
            mass_kg: set.masses.body_kg,
            other_mass_kg: set.masses.other_kg,
            training_hash: set.hash(),
            cases: set.cases.iter().map(case).collect(),
            options,
            validation: Vec::new(),
            fitted,
        })
    }

    /// Reads a model file.
    ///
    /// # Errors
    /// [`ModelError`] with the place in the file where it is no model of ours.
    pub fn read(path: &Path) -> Result<Self, ModelError> {
        let text = fs::read(path).map_err(|source| ModelError::Io { path: path.into(), source })?;
        let no_model = |e: serde_json::Error| ModelError::NotAModel {
            path: path.into(),
            line: e.line(),
            column: e.column(),
            detail: e.to_string(),
        };
        #[derive(Deserialize)]
        struct Head {
            format: String,
            version: u32,
        }
        let head: Head = serde_json::from_slice(&text).map_err(no_model)?;
        if head.format != FORMAT {
            let detail = format!("its format is \"{}\"", head.format);
            return Err(ModelError::NotAModel { path: path.into(), line: 1, column: 1, detail });
        }
        if head.version > VERSION {
            return Err(ModelError::Version { path: path.into(), found: head.version });
        }
        let model: Self = serde_json::from_slice(&text).map_err(no_model)?;
        model.check().map_err(|detail| ModelError::Damaged { path: path.into(), detail })?;
        Ok(model)
    }

    /// What a fitted model guarantees and a file might not.
    fn check(&self) -> Result<(), String> {
        if self.cases.is_empty() {
            return Err("it has no cases".into());
        }
        let speeds = || self.cases.iter().map(|c| c.speed_m_per_s);
        if !speeds().zip(speeds().skip(1)).all(|(a, b)| a < b)
            || !speeds().all(|v| v > 0.0 && v.is_finite())
        {
            return Err("its speeds are not increasing".into());
        }
        if !self.cases.iter().all(|c| c.max_deflection_m > 0.0 && c.max_deflection_m.is_finite()) {
            return Err("a maximal deflection is not above 0".into());
        }
        let masses = [Some(self.mass_kg), self.other_mass_kg];
        if !masses.into_iter().flatten().all(|m| m > 0.0 && m.is_finite()) {
            return Err("a mass is not above 0".into());
        }
        match &self.fitted {
            Fitted::Forest(forest) => forest.check(),
            Fitted::Nearest(nearest) => nearest.check(),
        }
    }

    /// The model file's bytes.
    pub fn to_json(&self) -> Result<Vec<u8>, serde_json::Error> {
        let mut bytes = serde_json::to_vec(self)?;
        bytes.push(b'\n');
        Ok(bytes)
    }

    /// Writes the model file as a whole.
    ///
    /// # Errors
    /// [`ModelError::Write`] if the target cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), ModelError> {
        let bytes = self
            .to_json()
            .map_err(|e| ModelError::Damaged { path: path.into(), detail: e.to_string() })?;
        Ok(write_whole(path, &bytes)?)
    }

    pub fn masses(&self) -> Masses {
        Masses { body_kg: self.mass_kg, other_kg: self.other_mass_kg }
    }

    pub fn fitted(&self) -> &Fitted {
        &self.fitted
    }

    /// Lowest and highest training speed, in m/s.
    pub fn range_m_per_s(&self) -> (f64, f64) {
        (self.cases[0].speed_m_per_s, self.cases[self.cases.len() - 1].speed_m_per_s)
    }

    /// Forces in N at a speed and increasing deflections.
    pub fn force_n(&self, speed_m_per_s: f64, deflection_m: &[f64]) -> Vec<f64> {
        self.fitted.surrogate().force_n(speed_m_per_s, deflection_m)
    }

    /// What a query at this speed must say, for any mass and rule.
    pub fn warnings(&self, speed_m_per_s: f64) -> Vec<Warning> {
        let (low, high) = self.range_m_per_s();
        let mut warnings = Vec::new();
        if !(low..=high).contains(&speed_m_per_s) {
            warnings.push(Warning::out_of_range(speed_m_per_s, low, high));
        }
        warnings.extend(self.fitted.surrogate().warnings(speed_m_per_s));
        let truncated = self.cases.iter().filter(|c| c.truncated);
        warnings.extend(truncated.map(|c| Warning::truncated_training_run(&c.name)));
        warnings
    }
}
