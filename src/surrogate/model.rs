//! Models: a surrogate fitted to a group, with everything needed to predict and to trust.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::band::{self, Band};
use super::forest::{ForestOptions, ForestSurrogate};
use super::gp::Gp;
use super::kept::Kept;
use super::landmarks::Landmarks;
use super::leave_one_out::Validation;
use super::linear::Linear;
use super::max_crush::MaxCrushRule;
use super::nearest::Nearest;
use super::rate::Rate;
use super::registered::Registered;
use super::{At, CaseCurve, Surrogate, Warning};
use crate::curve::{EnvelopeError, ForceKind, Masses};
use crate::dataset::{DatasetError, Feature, Force, TrainingCase, TrainingSet, grid, nearest};
use crate::file::{self, WriteError, write_whole};
use crate::forest::ForestError;
use crate::unit::{SpeedKind, UnitSystem};

/// Value of a model file's `format`.
const FORMAT: &str = "crumple model";
/// Version of model files this program writes; it reads this and every older one.
const VERSION: u32 = 3;
/// Most bytes of a model file: a forest of 500 trees has some ten million.
const MAX_BYTES: u64 = 1 << 30;
/// Fewest steps of a stored curve: short crushes need more than one each 2 mm.
const STEPS: usize = 200;
/// Forces beyond this are damage, not measurement.
const LARGEST_N: f64 = 1e15;
/// A nearest training speed further away than this share of the speed needs a word.
const FAR: f64 = 0.25;

/// Which surrogate, with its choices.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "model", rename_all = "snake_case")]
pub enum Options {
    Nearest,
    Linear,
    Rate,
    Registered,
    Extra(ForestOptions),
    Forest(ForestOptions),
    Gp,
}

impl Options {
    pub fn name(&self) -> &'static str {
        match self {
            Self::Nearest => "nearest",
            Self::Linear => "linear",
            Self::Rate => "rate",
            Self::Registered => "registered",
            Self::Extra(_) => "extra",
            Self::Forest(_) => "forest",
            Self::Gp => "gp",
        }
    }

    /// Whether the model sees more than the speed.
    fn takes_features(&self) -> bool {
        match self {
            Self::Nearest | Self::Extra(_) | Self::Forest(_) | Self::Gp => true,
            Self::Linear | Self::Rate | Self::Registered => false,
        }
    }
}

/// A fitted surrogate. Those without content answer from the training curves alone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fitted {
    Nearest,
    Linear,
    Rate(Rate),
    Registered,
    Extra(ForestSurrogate),
    Forest(ForestSurrogate),
    Gp,
}

impl Fitted {
    fn of(
        set: &TrainingSet,
        cases: &[CaseCurve],
        force: Force,
        options: &Options,
    ) -> Result<Self, ModelError> {
        Ok(match options {
            Options::Nearest => Self::Nearest,
            Options::Linear => Self::Linear,
            Options::Rate => Self::Rate(Rate::fit(cases)),
            Options::Registered => Self::Registered,
            Options::Extra(options) => Self::Extra(ForestSurrogate::fit(set, force, options)?),
            Options::Forest(options) => Self::Forest(ForestSurrogate::fit(set, force, options)?),
            Options::Gp => Self::Gp,
        })
    }

    fn name(&self) -> &'static str {
        match self {
            Self::Nearest => "nearest",
            Self::Linear => "linear",
            Self::Rate(_) => "rate",
            Self::Registered => "registered",
            Self::Extra(_) => "extra",
            Self::Forest(_) => "forest",
            Self::Gp => "gp",
        }
    }

    fn surrogate(&self) -> &dyn Surrogate {
        match self {
            Self::Nearest => &Nearest,
            Self::Linear => &Linear,
            Self::Rate(rate) => rate,
            Self::Registered => &Registered,
            Self::Extra(forest) | Self::Forest(forest) => forest,
            Self::Gp => &Gp,
        }
    }

    fn check(&self, features: usize) -> Result<(), String> {
        match self {
            Self::Rate(rate) => rate.check(),
            Self::Extra(forest) | Self::Forest(forest) => forest.check(2 + features),
            Self::Nearest | Self::Linear | Self::Registered | Self::Gp => Ok(()),
        }
    }
}

/// What a model keeps of a training case: its curves over even deflections, no coarser than
/// 2 mm, and its ends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelCase {
    pub name: String,
    pub speed_m_per_s: f64,
    /// Values of the model's features.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub features: Vec<f64>,
    pub max_deflection_m: f64,
    pub truncated: bool,
    #[serde(rename = "unloading_stiffness_N_per_m")]
    pub unloading_stiffness_n_per_m: Option<f64>,
    /// Speed of separation when the body force has first fallen to zero.
    #[serde(default)]
    pub rebound_speed_m_per_s: Option<f64>,
    /// Empty in files of version 1.
    #[serde(default)]
    pub deflection_m: Vec<f64>,
    #[serde(rename = "force_N", default)]
    pub force_n: Vec<f64>,
    /// The force of the body's motion; empty where the declared force is one.
    #[serde(rename = "body_force_N", default)]
    pub body_force_n: Vec<f64>,
    #[serde(default)]
    pub closing_speed_m_per_s: Vec<f64>,
}

impl ModelCase {
    fn of(case: &TrainingCase, kind: ForceKind) -> Self {
        let deflection_m = grid(case.envelope.end_m(), STEPS);
        let over = |at: &dyn Fn(f64) -> f64| deflection_m.iter().map(|&d| at(d)).collect();
        Self {
            name: case.name.clone(),
            speed_m_per_s: case.speed_m_per_s,
            features: case.features.clone(),
            max_deflection_m: case.envelope.end_m(),
            truncated: case.truncated,
            unloading_stiffness_n_per_m: case.unloading_stiffness_n_per_m,
            rebound_speed_m_per_s: case.motion.rebound_speed_m_per_s,
            force_n: over(&|d| case.envelope.force_at(d)),
            body_force_n: match kind {
                ForceKind::Contact => over(&|d| case.motion.force.force_at(d)),
                ForceKind::Body => Vec::new(),
            },
            closing_speed_m_per_s: over(&|d| case.motion.closing_speed.force_at(d).max(0.0)),
            deflection_m,
        }
    }

    /// What a fit guarantees of a case.
    fn check(&self) -> Result<(), String> {
        let positive = |value: Option<f64>| value.is_none_or(|v| v > 0.0 && v.is_finite());
        if !positive(self.unloading_stiffness_n_per_m) || !positive(self.rebound_speed_m_per_s) {
            return Err("its unloading stiffness or rebound speed is not above 0".into());
        }
        let forces = self.force_n.iter().chain(&self.body_force_n);
        if let Some(force) = forces.into_iter().find(|f| f.abs() > LARGEST_N) {
            return Err(format!("a force of {force} N is beyond any vehicle's"));
        }
        if let Some(end) = self.deflection_m.last()
            && (end / self.max_deflection_m - 1.0).abs() > 1e-9
        {
            let max = self.max_deflection_m;
            return Err(format!("its curve ends at {end} m, its maximal deflection is {max} m"));
        }
        Ok(())
    }

    fn curve(&self, force_n: &[f64]) -> Result<CaseCurve, EnvelopeError> {
        CaseCurve::new(
            self.speed_m_per_s,
            self.features.clone(),
            self.deflection_m.clone(),
            force_n.to_vec(),
            self.closing_speed_m_per_s.clone(),
        )
    }
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
    /// Units of the solver's files that the training cases come from, for exports.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub study_units: Option<UnitSystem>,
    /// Parameters beside speed that queries must give.
    #[serde(default)]
    pub features: Vec<Feature>,
    /// Hash over the fingerprints of the training cases.
    pub training_hash: String,
    /// In order of speed.
    pub cases: Vec<ModelCase>,
    pub options: Options,
    /// How the maximal crush is found if a query does not say.
    #[serde(default)]
    pub max_crush_rule: MaxCrushRule,
    /// Pairs of neighbouring training speeds between which the collapse changes its mode.
    #[serde(default)]
    pub mode_switches_m_per_s: Vec<(f64, f64)>,
    /// Leave-one-speed-out of the group, if it was asked for.
    #[serde(default)]
    pub leave_one_out: Option<Validation>,
    /// For the declared force.
    fitted: Fitted,
    /// For the force of the body's motion, where that is another.
    #[serde(default)]
    fitted_body: Option<Fitted>,
    /// The curves of `cases`, made when the model is fitted or read.
    #[serde(skip)]
    curves: Curves,
}

/// Training curves by force.
#[derive(Clone, Debug, Default, PartialEq)]
struct Curves {
    declared: Vec<CaseCurve>,
    body: Vec<CaseCurve>,
    /// Of the curves of the declared force and of the body's, once it was asked for.
    kinks: [Kept<Kink>; 2],
}

/// How far single points of the curves lie above or below both of their neighbours, in N.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Kink {
    /// Distance of the neighbours.
    step_m: f64,
    most_n: f64,
}

impl Curves {
    fn of(cases: &[ModelCase]) -> Result<Self, EnvelopeError> {
        let with = |force: fn(&ModelCase) -> &[f64]| -> Result<Vec<_>, _> {
            cases.iter().filter(|c| !force(c).is_empty()).map(|c| c.curve(force(c))).collect()
        };
        Ok(Self {
            declared: with(|c| &c.force_n)?,
            body: with(|c| &c.body_force_n)?,
            kinks: Default::default(),
        })
    }
}

/// Why a model cannot be fitted, read or written.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    #[error(transparent)]
    Forest(#[from] ForestError),
    #[error(
        "model {model} needs at least 2 curves, the group has 1: only --model nearest can use a single curve, as it is"
    )]
    OneCurve { model: &'static str },
    #[error(
        "model {model} sees only the speed, but the cases also differ in {features}: use --model forest, extra or gp, or keep cases that differ in speed alone"
    )]
    OneParameter { model: &'static str, features: String },
    #[error("{0}")]
    Curve(#[from] EnvelopeError),
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
    /// Fits the model to both forces of the set. The choice of a model by leaving speeds
    /// out is `validate::train`'s.
    ///
    /// # Errors
    /// [`ModelError`] if the set is too small for the model, differs in more than the model
    /// sees, or its options are wrong.
    pub fn fit(set: &TrainingSet, options: Options) -> Result<Self, ModelError> {
        let model = options.name();
        if set.cases.len() < 2 && options != Options::Nearest {
            return Err(ModelError::OneCurve { model });
        }
        if !set.features.is_empty() && !options.takes_features() {
            let features: Vec<String> = set.features.iter().map(Feature::name).collect();
            return Err(ModelError::OneParameter { model, features: features.join(", ") });
        }
        let cases: Vec<ModelCase> =
            set.cases.iter().map(|c| ModelCase::of(c, set.force_kind)).collect();
        let curves = Curves::of(&cases)?;
        let switches = match set.features.is_empty() {
            true => Landmarks::of(&curves.declared).jumps,
            false => Vec::new(),
        };
        let speed = |i: usize| cases[i].speed_m_per_s;
        Ok(Self {
            format: FORMAT.into(),
            version: VERSION,
            written_by: concat!("crumple ", env!("CARGO_PKG_VERSION")).into(),
            group: set.group.clone(),
            speed_kind: set.speed_kind,
            force_kind: set.force_kind,
            mass_kg: set.masses.body_kg,
            other_mass_kg: set.masses.other_kg,
            study_units: set.units,
            features: set.features.clone(),
            training_hash: set.hash(),
            max_crush_rule: default_rule(&options, set),
            mode_switches_m_per_s: switches.iter().map(|&(i, k)| (speed(i), speed(k))).collect(),
            leave_one_out: None,
            fitted: Fitted::of(set, &curves.declared, Force::Declared, &options)?,
            fitted_body: match set.force_kind {
                ForceKind::Contact => Some(Fitted::of(set, &curves.body, Force::Body, &options)?),
                ForceKind::Body => None,
            },
            options,
            cases,
            curves,
        })
    }

    /// Reads a model file.
    ///
    /// # Errors
    /// [`ModelError`] with the place in the file where it is no model of ours.
    pub fn read(path: &Path) -> Result<Self, ModelError> {
        let text = file::read(path, MAX_BYTES)
            .map_err(|source| ModelError::Io { path: path.into(), source })?;
        Self::parse(path, &text)
    }

    /// Parses and checks the bytes of a model file; `path` is for messages.
    ///
    /// # Errors
    /// As of [`read`](Self::read).
    pub fn parse(path: &Path, text: &[u8]) -> Result<Self, ModelError> {
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
        let head: Head = serde_json::from_slice(text).map_err(no_model)?;
        if head.format != FORMAT {
            let detail = format!("its format is \"{}\"", head.format);
            return Err(ModelError::NotAModel { path: path.into(), line: 1, column: 1, detail });
        }
        if head.version > VERSION {
            return Err(ModelError::Version { path: path.into(), found: head.version });
        }
        let mut model: Self = match head.version {
            1 => from_version_1(text).map_err(no_model)?,
            _ => serde_json::from_slice(text).map_err(no_model)?,
        };
        model.curves = Curves::of(&model.cases)
            .map_err(|e| ModelError::Damaged { path: path.into(), detail: e.to_string() })?;
        model.check().map_err(|detail| ModelError::Damaged { path: path.into(), detail })?;
        Ok(model)
    }

    /// What a fitted model guarantees and a file might not.
    fn check(&self) -> Result<(), String> {
        if self.cases.is_empty() {
            return Err("it has no cases".into());
        }
        let speeds = || self.cases.iter().map(|c| c.speed_m_per_s);
        let several = !self.features.is_empty();
        if !speeds().zip(speeds().skip(1)).all(|(a, b)| a < b || several && a == b)
            || !speeds().all(|v| v > 0.0 && v.is_finite())
        {
            return Err("its speeds are not increasing".into());
        }
        if self.cases.iter().any(|c| c.features.len() != self.features.len()) {
            return Err("its cases have not as many features as it names".into());
        }
        if !self.cases.iter().all(|c| c.max_deflection_m > 0.0 && c.max_deflection_m.is_finite()) {
            return Err("a maximal deflection is not above 0".into());
        }
        for case in &self.cases {
            case.check().map_err(|detail| format!("case \"{}\": {detail}", case.name))?;
        }
        let kinds = [Some(&self.fitted), self.fitted_body.as_ref()];
        if kinds.into_iter().flatten().any(|f| f.name() != self.options.name()) {
            return Err("its options name another model than it holds".into());
        }
        if self.fitted_body.is_some() && self.force_kind == ForceKind::Body {
            return Err("it holds two forces, but its force is the body's".into());
        }
        let bands = self.leave_one_out.iter().flat_map(|v| [v.band, v.band_outside]);
        if !bands.flatten().all(|band| band.is_sound()) {
            return Err("the widths or the span of its band are no measurement".into());
        }
        let masses = [Some(self.mass_kg), self.other_mass_kg];
        if !masses.into_iter().flatten().all(|m| m > 0.0 && m.is_finite()) {
            return Err("a mass is not above 0".into());
        }
        let answers = |fitted: &Fitted, curves: usize| match fitted {
            Fitted::Forest(_) | Fitted::Extra(_) => true,
            _ => curves == self.cases.len(),
        };
        let body = self.fitted_body.as_ref();
        if !answers(&self.fitted, self.curves.declared.len())
            || !body.is_none_or(|b| answers(b, self.curves.body.len()))
        {
            return Err("it lacks the curves of its cases".into());
        }
        self.fitted.check(self.features.len())?;
        body.map_or(Ok(()), |b| b.check(self.features.len()))
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

    /// The band at a query's place, or why there is none although speeds were left out.
    pub(super) fn band(&self, at: &At<'_>) -> Result<Option<Band>, Warning> {
        let Some(of) = &self.leave_one_out else { return Ok(None) };
        if of.band.or(of.band_outside).is_none() {
            return Ok(None);
        }
        if of.band.is_some_and(|band| band.span_m_per_s.is_none()) {
            let why = "that of the model file, of an earlier version, does not know the gaps that it holds for: train the model again";
            return Err(Warning::no_band(why));
        }
        if let Some((feature, ..)) = self.features_outside(at).next() {
            let name = feature.name();
            let why = format!("no case outside the training cases' {name} was left out");
            return Err(Warning::no_band(&why));
        }
        let speeds: Vec<f64> = self.cases.iter().map(|c| c.speed_m_per_s).collect();
        match band::at(of.band, of.band_outside, &speeds, at.speed_m_per_s) {
            Some(band) => Ok(Some(band)),
            None => Err(Warning::no_band(
                "no speed that was left out tells how far FE may lie from a curve here",
            )),
        }
    }

    /// Numbers among the parameters that lie outside the training cases', as feature, value,
    /// lowest and highest.
    fn features_outside(&self, at: &At<'_>) -> impl Iterator<Item = (&Feature, f64, f64, f64)> {
        let numbers = self.features.iter().enumerate().filter(|(_, f)| f.category.is_none());
        numbers.filter_map(|(k, feature)| {
            let known = || self.cases.iter().map(|c| c.features[k]);
            let (low, high) =
                (known().fold(f64::INFINITY, f64::min), known().fold(f64::NEG_INFINITY, f64::max));
            let asked = at.features[k];
            (!(low..=high).contains(&asked)).then_some((feature, asked, low, high))
        })
    }

    /// The declared forces in N at increasing deflections.
    pub fn force_n(&self, at: &At<'_>, deflection_m: &[f64]) -> Vec<f64> {
        self.fitted.surrogate().force_n(&self.curves.declared, at, deflection_m)
    }

    /// The forces in N that move the body: of its motion, or the declared ones if the model
    /// has no others.
    pub fn body_force_n(&self, at: &At<'_>, deflection_m: &[f64]) -> Vec<f64> {
        match &self.fitted_body {
            Some(body) => body.surrogate().force_n(&self.curves.body, at, deflection_m),
            None => self.force_n(at, deflection_m),
        }
    }

    /// Whether declared force and body force are two.
    pub fn has_body_force(&self) -> bool {
        self.fitted_body.is_some()
    }

    /// The training curves: of the declared force, and of the body's where it is another.
    pub fn curves(&self) -> (&[CaseCurve], &[CaseCurve]) {
        (&self.curves.declared, &self.curves.body)
    }

    /// The most by which a point of the training curves lies above both neighbours at
    /// `step_m`, or below both, in N; `most` finds it in curves. Kept for the first step that is
    /// asked for.
    pub(super) fn most_kink_n(
        &self,
        of_body: bool,
        step_m: f64,
        most: impl Fn(&[CaseCurve]) -> f64,
    ) -> f64 {
        let (declared, body) = self.curves();
        let of_body = of_body && !body.is_empty();
        let curves = if of_body { body } else { declared };
        let kept = self.curves.kinks[usize::from(of_body)]
            .or_find(|| Kink { step_m, most_n: most(curves) });
        if kept.step_m == step_m { kept.most_n } else { most(curves) }
    }

    /// What a query here must say, for any mass and rule.
    pub fn warnings(&self, at: &At<'_>) -> Vec<Warning> {
        let v = at.speed_m_per_s;
        let (low, high) = self.range_m_per_s();
        let mut warnings = Vec::new();
        if self.cases.len() < 3 {
            warnings.push(Warning::too_few_curves(self.cases.len()));
        }
        let speeds = || self.cases.iter().map(|c| c.speed_m_per_s);
        let nearest = self.cases[nearest(speeds(), v)].speed_m_per_s;
        if !(low..=high).contains(&v) {
            warnings.push(Warning::out_of_range(v, low, high));
        } else if (nearest / v - 1.0).abs() > FAR {
            warnings.push(Warning::far_from_training(v, nearest));
        }
        warnings.extend(self.features_outside(at).map(|(feature, asked, low, high)| {
            Warning::parameter_out_of_range(&feature.name(), asked, low, high)
        }));
        for &(below, above) in &self.mode_switches_m_per_s {
            if below < v && v < above {
                warnings.push(Warning::mode_switch(below, above));
            }
        }
        warnings.extend(self.fitted.surrogate().warnings(&self.curves.declared, at));
        let truncated = self.cases.iter().filter(|c| c.truncated);
        warnings.extend(truncated.map(|c| Warning::truncated_training_run(&c.name)));
        warnings
    }
}

/// The body's own motion; the reference method's forest knows only crush over speed.
fn default_rule(options: &Options, set: &TrainingSet) -> MaxCrushRule {
    match options {
        Options::Forest(_) if set.features.is_empty() => MaxCrushRule::Monotone,
        _ => MaxCrushRule::Motion,
    }
}

/// Files of version 1 have one force; `nearest` kept its curves beside the cases.
fn from_version_1(text: &[u8]) -> Result<Model, serde_json::Error> {
    let mut json: serde_json::Value = serde_json::from_slice(text)?;
    let curves = json.pointer("/fitted/nearest/curves").cloned();
    if let Some(serde_json::Value::Array(curves)) = curves {
        if let Some(cases) = json.pointer_mut("/cases").and_then(|c| c.as_array_mut()) {
            for (case, mut curve) in cases.iter_mut().zip(curves) {
                // What is no object is refused when the whole is read.
                let (Some(case), Some(curve)) = (case.as_object_mut(), curve.as_object_mut())
                else {
                    continue;
                };
                for key in ["deflection_m", "force_N"] {
                    case.insert(key.into(), curve.remove(key).unwrap_or_default());
                }
            }
        }
        json["fitted"] = "nearest".into();
    }
    serde_json::from_value(json)
}
