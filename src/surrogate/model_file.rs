//! Model files: versioned, self-describing JSON, readable without this program
//! (`schemas/model.md`).

use std::collections::BTreeMap;
use std::panic::resume_unwind;
use std::path::Path;
use std::sync::Arc;
use std::thread;

use serde::{Deserialize, Serialize};
use serde_json::value::{RawValue, to_raw_value};

use super::cases::{Curves, ModelCase};
use super::crush_law::CrushLaw;
use super::leave_one_out::Validation;
use super::max_crush::MaxCrushRule;
use super::models::ModelKind;
use super::{Model, Surrogate};
use crate::curve::energy::POSSIBLE;
use crate::curve::{Envelope, ForceKind, Masses};
use crate::dataset::Feature;
use crate::error::{Error, error};
use crate::file::{self, write_whole};
use crate::unit::{Speed, SpeedKind, UnitSystem};

/// Value of a model file's `format`.
const FORMAT: &str = "crumple model";
/// Version of the model files that this program writes and reads.
pub(super) const VERSION: u32 = 7;
/// Maximum number of bytes of a model file: a forest of 50 trees has some millions, one of 200 runs a hundred.
const MAX_BYTES: u64 = 1 << 30;

/// Bytes of a model file from which its two forces are read at once.
const LARGE: usize = 1 << 20;

/// What identifies a model file.
#[derive(Deserialize)]
struct Head {
    format: String,
    version: u32,
}

/// The keys of a model file, in their order.
#[derive(Serialize, Deserialize)]
struct ModelFile<'a> {
    format: String,
    version: u32,
    written_by: String,
    group: String,
    speed_kind: SpeedKind,
    force_kind: ForceKind,
    mass_kg: f64,
    other_mass_kg: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    study_units: Option<UnitSystem>,
    #[serde(default)]
    features: Vec<Feature>,
    training_hash: String,
    cases: Vec<ModelCase>,
    options: ModelKind,
    #[serde(default)]
    max_crush_rule: MaxCrushRule,
    #[serde(default)]
    mode_switches_m_per_s: Vec<(f64, f64)>,
    #[serde(default)]
    leave_one_out: Option<Validation>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    crush_law: Option<CrushLaw>,
    /// The model's name, or `{ name: parameters }` where it has parameters.
    #[serde(borrow)]
    fitted: &'a RawValue,
    #[serde(borrow, default)]
    fitted_body: Option<&'a RawValue>,
    /// BLAKE3 of the file without this key; absent in files of earlier versions of the program.
    #[serde(default, skip_serializing)]
    fingerprint: Option<String>,
}

/// The key of the fingerprint, the last of the file, as it is written.
const FINGERPRINT: &str = ",\"fingerprint\":\"";

/// Whether a file's text is that of its fingerprint.
fn is_as_written(text: &[u8], fingerprint: &str) -> bool {
    let end = format!("{FINGERPRINT}{fingerprint}\"}}");
    let without = text.trim_ascii_end().strip_suffix(end.as_bytes());
    without.is_some_and(|without| hash(without) == fingerprint)
}

/// The hash of a model file up to its last brace.
fn hash(without_brace: &[u8]) -> String {
    blake3::Hasher::new().update(without_brace).update(b"}").finalize().to_hex().to_string()
}

impl Model {
    /// Reads a model file.
    ///
    /// # Errors
    /// With the place in the file where it is not a model of ours.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = file::read(path, MAX_BYTES).map_err(|source| {
            error!(Model, "{path}: {source}", path = path.display()).caused_by(source)
        })?;
        Self::parse(path, &text)
    }

    /// Parses and checks the bytes of a model file; `path` is for messages.
    ///
    /// # Errors
    /// As for [`read`](Self::read).
    pub fn parse(path: &Path, text: &[u8]) -> Result<Self, Error> {
        let no_model = |line, column, detail| {
            error!(
                Model,
                "{path}: line {line}, column {column}: this is not a model file ({detail}): give one made by crumple train",
                path = path.display()
            )
        };
        let at_its_place = |e: serde_json::Error| match e.to_string().starts_with("missing field") {
            true => no_model(1, 1, "it has no \"format\", as curves have none".into()),
            false => no_model(e.line(), e.column(), e.to_string()),
        };
        let file: Result<ModelFile<'_>, _> = serde_json::from_slice(text);
        let file = match file {
            Ok(file) if file.format == FORMAT && file.version == VERSION => file,
            // What another file or version is shows in its head.
            other => {
                let head: Head = serde_json::from_slice(text).map_err(at_its_place)?;
                if head.format != FORMAT {
                    return Err(no_model(1, 1, format!("its format is \"{}\"", head.format)));
                }
                if head.version != VERSION {
                    return Err(error!(
                        Model,
                        "{path}: the model file has version {found}, this program reads version {known}: train the model again with crumple train",
                        known = VERSION,
                        found = head.version,
                        path = path.display()
                    ));
                }
                other.map_err(at_its_place)?
            }
        };
        let fitted = |raw: &RawValue| {
            fitted_of(&file.options, raw).map_err(|e| {
                // The place of the value in the file; what is wrong in it is counted from there.
                let before = raw.get().as_ptr() as usize - text.as_ptr() as usize;
                let before = &text[..before.min(text.len())];
                let line = before.iter().filter(|&&byte| byte == b'\n').count() + 1;
                let column = before.iter().rev().take_while(|&&byte| byte != b'\n').count() + 1;
                no_model(line, column, e.to_string())
            })
        };
        let declared = || fitted(file.fitted);
        let of_body = || file.fitted_body.map(fitted).transpose();
        // A thread costs more than a small model; one of rayon's pool would be missing in a process that was forked.
        let (declared, of_body) = if text.len() < LARGE {
            (declared(), of_body())
        } else {
            thread::scope(|scope| {
                let of_body = scope.spawn(of_body);
                (declared(), of_body.join().unwrap_or_else(|panic| resume_unwind(panic)))
            })
        };
        let damaged =
            |detail| error!(Model, "{path}: the model is damaged: {detail}", path = path.display());
        let model = Self {
            fitted: declared?,
            fitted_body: of_body?,
            curves: Arc::new(Curves::of(&file.cases).map_err(|e| damaged(e.to_string()))?),
            written_by: file.written_by,
            group: file.group,
            speed_kind: file.speed_kind,
            force_kind: file.force_kind,
            mass_kg: file.mass_kg,
            other_mass_kg: file.other_mass_kg,
            study_units: file.study_units,
            features: file.features,
            training_hash: file.training_hash,
            cases: file.cases,
            kind: file.options,
            max_crush_rule: file.max_crush_rule,
            mode_switches_m_per_s: file.mode_switches_m_per_s,
            leave_one_out: file.leave_one_out,
            crush_law: file.crush_law,
        };
        model.check().map_err(damaged)?;
        let laws =
            [model.fitted_body.as_ref().and_then(|f| f.crush_law()), model.crush_law.as_ref()];
        for (law, other) in model.fitted.crush_law().iter().flat_map(|a| laws.map(|b| (a, b))) {
            other.into_iter().for_each(|other| law.share(other));
        }
        match &file.fingerprint {
            Some(fingerprint) if !is_as_written(text, fingerprint) && !file::accepts_changed() => {
                Err(error!(
                    Model,
                    "{}: the model does not match its fingerprint: train it again with crumple train, or use --accept-changed",
                    path.display()
                ))
            }
            None if !file::accepts_changed() => match model.impossible_case() {
                Some(found) => Err(error!(
                    Model,
                    "{}: {found}: a mass, speed or force was changed in it, and the file has no fingerprint that would show it: train the model again with crumple train, or use --accept-changed",
                    path.display()
                )),
                None => Ok(model),
            },
            _ => Ok(model),
        }
    }

    /// The first case whose work cannot be that of its impact, in words.
    fn impossible_case(&self) -> Option<String> {
        let (least, most) = POSSIBLE;
        let found = self.work_over_energy().find(|(_, ratio)| !(least..=most).contains(ratio));
        found.map(|(name, ratio)| {
            format!("the work of its case \"{name}\" is {ratio:.3} of the impact's energy")
        })
    }

    /// Name of each whole case of the group's mass, and the work of its force over the impact's energy.
    pub(super) fn work_over_energy(&self) -> impl Iterator<Item = (&str, f64)> {
        let masses = Masses { body_kg: self.mass_kg, other_kg: self.other_mass_kg };
        let whole = self.cases.iter().filter(|case| !case.truncated && case.features.is_empty());
        whole.filter_map(move |case| {
            let curve = Envelope::new(case.deflection_m.clone(), case.force_n.clone()).ok()?;
            let speed = Speed { m_per_s: case.speed_m_per_s, kind: self.speed_kind };
            Some((&*case.name, curve.work() / masses.kinetic_energy_j(speed)))
        })
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
            return Err("its cases do not have as many features as it names".into());
        }
        if !self.cases.iter().all(|c| c.max_deflection_m > 0.0 && c.max_deflection_m.is_finite()) {
            return Err("a maximum deflection is not above 0".into());
        }
        for case in &self.cases {
            case.check().map_err(|detail| format!("case \"{}\": {detail}", case.name))?;
        }
        if self.fitted_body.is_some() && self.force_kind == ForceKind::Body {
            return Err("it holds two forces, but its force is the body's".into());
        }
        let bands = self
            .leave_one_out
            .iter()
            .flat_map(|of| [of.band, of.band_outside, of.body_band, of.body_band_outside]);
        if !bands.flatten().all(|band| band.is_sound()) {
            return Err("the widths or the span of its band are impossible".into());
        }
        let masses = [Some(self.mass_kg), self.other_mass_kg];
        if !masses.into_iter().flatten().all(|m| m > 0.0 && m.is_finite()) {
            return Err("a mass is not above 0".into());
        }
        let lacks = |fitted: &Arc<dyn Surrogate>, curves: usize| {
            fitted.answers_from_curves() && curves != self.cases.len()
        };
        let body = self.fitted_body.as_ref();
        if lacks(&self.fitted, self.curves.declared.len())
            || body.is_some_and(|b| lacks(b, self.curves.body.len()))
        {
            return Err("it lacks the curves of its cases".into());
        }
        if self.crush_law.is_some() && self.curves.declared.len() != self.cases.len() {
            return Err("it has a crush law but lacks the curves of its cases".into());
        }
        self.crush_law.as_ref().map_or(Ok(()), CrushLaw::check)?;
        self.fitted.check(self.features.len())?;
        body.map_or(Ok(()), |b| b.check(self.features.len()))
    }

    /// The model file's bytes.
    ///
    /// # Errors
    /// Of `serde_json`, which no fitted model causes.
    pub fn to_json(&self) -> Result<Vec<u8>, serde_json::Error> {
        let raw = |fitted: &Arc<dyn Surrogate>| match fitted.parameters() {
            None => to_raw_value(self.name()),
            Some(parameters) => to_raw_value(&BTreeMap::from([(self.name(), parameters?)])),
        };
        let (fitted, fitted_body) =
            (raw(&self.fitted)?, self.fitted_body.as_ref().map(raw).transpose()?);
        let file = ModelFile {
            format: FORMAT.into(),
            version: VERSION,
            written_by: self.written_by.clone(),
            group: self.group.clone(),
            speed_kind: self.speed_kind,
            force_kind: self.force_kind,
            mass_kg: self.mass_kg,
            other_mass_kg: self.other_mass_kg,
            study_units: self.study_units,
            features: self.features.clone(),
            training_hash: self.training_hash.clone(),
            cases: self.cases.clone(),
            options: self.kind,
            max_crush_rule: self.max_crush_rule,
            mode_switches_m_per_s: self.mode_switches_m_per_s.clone(),
            leave_one_out: self.leave_one_out.clone(),
            crush_law: self.crush_law.clone(),
            fitted: &fitted,
            fitted_body: fitted_body.as_deref(),
            fingerprint: None,
        };
        let mut bytes = serde_json::to_vec(&file)?;
        bytes.pop();
        let fingerprint = hash(&bytes);
        bytes.extend(format!("{FINGERPRINT}{fingerprint}\"}}\n").into_bytes());
        Ok(bytes)
    }

    /// Writes the model file as a whole.
    ///
    /// # Errors
    /// If the target cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        let bytes = self.to_json().map_err(|e| {
            error!(
                Model,
                "{path}: the model is damaged: {detail}",
                detail = e,
                path = path.display()
            )
        })?;
        write_whole(path, &bytes)
    }
}

/// What `fitted` or `fitted_body` holds of a model of that kind.
fn fitted_of(kind: &ModelKind, raw: &RawValue) -> Result<Arc<dyn Surrogate>, serde_json::Error> {
    use serde::de::Error;
    let other = |found: &str| {
        let expected = kind.name();
        serde_json::Error::custom(format!("options name the model {expected}, fitted {found}"))
    };
    if raw.get().starts_with('"') {
        let name: String = serde_json::from_slice(raw.get().as_bytes())?;
        return if name == kind.name() { (kind.entry.load)(None) } else { Err(other(&name)) };
    }
    // As this program writes a forest: it is large, and so read once. What follows it would be an error of its own.
    let is_forest = kind.entry.forest.is_some();
    let own = raw.get().strip_prefix(&format!("{{\"{}\":", kind.name())).filter(|_| is_forest);
    if let Some(Ok(found)) =
        own.and_then(|own| own.strip_suffix('}')).map(|own| (kind.entry.load)(Some(own)))
    {
        return Ok(found);
    }
    let named: BTreeMap<String, &RawValue> = serde_json::from_slice(raw.get().as_bytes())?;
    match named.first_key_value() {
        Some((name, parameters)) if name == kind.name() => {
            (kind.entry.load)(Some(parameters.get()))
        }
        Some((name, _)) => Err(other(name)),
        None => Err(other("nothing")),
    }
}
