//! Sources: the files that a scenario's curves name, read once.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::place;
use super::{CheckedScenario, CurveTable, Scenario, ScenarioError, SourceFileError, StageTable};
use crate::curve::{Case, DrivingCurve, Envelope, EnvelopeError};
use crate::database::{Database, DatabaseError};
use crate::formats::read::{csv, json};
use crate::surrogate::{Model, PredictedCurve};

/// What the curves of a scenario are made of: the same for every variation of it.
#[derive(Clone, Debug)]
pub(crate) struct Sources {
    pub(super) curves: BTreeMap<String, CurveSource>,
}

/// What a curve is made of.
#[derive(Clone, Debug)]
pub(crate) enum CurveSource {
    Model(Box<Model>),
    Predicted(Box<PredictedCurve>),
    /// Of a file.
    Curve(Box<DrivingCurve>),
    /// Stages of a device between two bodies.
    Stages(Envelope),
    Case(Box<Case>),
}

/// Over this length the force steps from one stage to the next: a step is no function.
const STEP_M: f64 = 1e-4;

impl Scenario {
    /// Every place that names a curve, in a fixed order: the contact, the trains' inner curves, those
    /// behind vehicles, of crush zones, of tension.
    pub(crate) fn curve_names_mut(&mut self) -> Vec<&mut String> {
        let mut names: Vec<&mut String> = self.contact.curve.iter_mut().collect();
        for train in &mut self.train {
            if train.vehicles.len() > 1 {
                names.extend(&mut train.inner);
            }
            for vehicle in &mut train.vehicles {
                names.extend(&mut vehicle.behind);
                names.extend(&mut vehicle.ends);
                let zones = [&mut vehicle.front, &mut vehicle.rear].into_iter().flatten();
                names.extend(zones.map(|zone| &mut zone.curve));
            }
        }
        names.extend(self.curves.values_mut().filter_map(|curve| curve.tension.as_mut()));
        names
    }

    /// The files that the scenario names, from its own place `path`.
    pub fn files(&self, path: &Path) -> Vec<PathBuf> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let curves = self.curves.values().flat_map(|c| [&c.model, &c.file, &c.database]);
        let reference = self.reference.as_ref().map(|r| &r.file);
        curves.flatten().chain(reference).map(|file| folder.join(file)).collect()
    }
}

impl Sources {
    /// Reads what `scenario`, which stands at `path`, names.
    ///
    /// # Errors
    /// [`ScenarioError`] names the curve or file.
    pub(crate) fn read(path: &Path, scenario: &CheckedScenario<'_>) -> Result<Self, ScenarioError> {
        let mut curves = BTreeMap::new();
        for (name, table) in &scenario.curves {
            let source = CurveSource::read(path, name, table).map_err(|wrong| match wrong {
                NoSource::Table(source) => {
                    let place = scenario.place(path, &scenario.source_key(&source));
                    ScenarioError::Source { place, source }
                }
                NoSource::File(key, source) => {
                    let place = scenario.place(path, &place::curve(name).key(key));
                    ScenarioError::File { place, curve: name.clone(), source: source.into() }
                }
            })?;
            curves.insert(name.clone(), source);
        }
        Ok(Self { curves })
    }

    /// The model of a curve, if it comes from one.
    pub(crate) fn model(&self, curve: &str) -> Option<&Model> {
        match self.curves.get(curve)? {
            CurveSource::Model(model) => Some(model),
            _ => None,
        }
    }

    /// Makes a model's crush law one without stopped mass, in which the contact force itself has the
    /// rate.
    pub(crate) fn forget_stopped_mass(&mut self, curve: &str) {
        if let Some(CurveSource::Model(model)) = self.curves.get_mut(curve) {
            model.forget_stopped_mass();
        }
    }

    /// Puts another source in place of a curve's.
    pub(crate) fn replace(&mut self, curve: &str, source: CurveSource) {
        self.curves.insert(curve.into(), source);
    }
}

/// Why a curve's table does not say where the curve comes from.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SourceError {
    /// It names no source, or several.
    #[error("curve \"{curve}\" needs exactly one of model, file, database and stages")]
    NotOne {
        /// Name of the curve.
        curve: String,
    },
    /// It names a database and no case in it.
    #[error("curve \"{curve}\": write case = \"group/case\" beside database")]
    NoCase {
        /// Name of the curve.
        curve: String,
    },
    /// It says which force the curve is, and the file says another.
    #[error(
        "curve \"{curve}\": force names another force than {} says it holds: remove force",
        .file.display()
    )]
    OtherForce {
        /// Name of the curve.
        curve: String,
        /// The curve's file.
        file: PathBuf,
    },
    /// Its stages make no curve.
    #[error("curve \"{curve}\": {source}")]
    Stages {
        /// Name of the curve.
        curve: String,
        /// Why not.
        source: StageError,
    },
}

/// Why a curve has no source: its table, or the file that it names with a key.
enum NoSource {
    Table(SourceError),
    File(&'static str, SourceFileError),
}

/// Why stages in series make no curve.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StageError {
    /// A stage is shorter than what joins it to the next.
    #[error("stage {stage} has a stroke of {stroke_m} m: expected over 0.2 mm")]
    Short {
        /// Name of the stage, or its number.
        stage: String,
        /// Its number, counted from 1.
        number: usize,
        /// Its stroke, in m.
        stroke_m: f64,
    },
    /// The points that they give are no envelope.
    #[error("its stages make no curve: {0}")]
    NoCurve(#[from] EnvelopeError),
}

impl CurveSource {
    /// Reads what the table of curve `name` in the scenario at `path` asks for.
    fn read(path: &Path, name: &str, table: &CurveTable) -> Result<Self, NoSource> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let curve = || name.to_string();
        let wrong = NoSource::Table;
        match (&table.model, &table.file, &table.database, &table.stages) {
            (Some(model), None, None, None) => {
                let read = Model::read(&folder.join(model));
                Ok(Self::Model(Box::new(read.map_err(|e| NoSource::File("model", e.into()))?)))
            }
            (None, Some(file), None, None) => {
                let file = folder.join(file);
                if file.extension().is_some_and(|e| e == "json") {
                    let read =
                        json::predicted(&file).map_err(|e| NoSource::File("file", e.into()))?;
                    return Ok(Self::Predicted(Box::new(read)));
                }
                let read = csv::driving(&file);
                let mut held = read.map_err(|e| NoSource::File("file", e.into()))?;
                let stated = table.force.or(held.force);
                if held.force.is_some() && stated != held.force {
                    return Err(wrong(SourceError::OtherForce { curve: curve(), file }));
                }
                held.force = stated;
                Ok(Self::Curve(Box::new(held)))
            }
            (None, None, Some(database), None) => {
                let case = table.case.as_deref().and_then(|c| c.split_once('/'));
                let (group, case) =
                    case.ok_or_else(|| wrong(SourceError::NoCase { curve: curve() }))?;
                let database = folder.join(database);
                let read = Database::read_case(&database, Some(group), case);
                let read = read.map_err(|e| {
                    let is_name =
                        matches!(e, DatabaseError::NoGroup { .. } | DatabaseError::NoCase { .. });
                    NoSource::File(if is_name { "case" } else { "database" }, e.into())
                })?;
                Ok(Self::Case(Box::new(read)))
            }
            (None, None, None, Some(stages)) => staged(stages)
                .map(Self::Stages)
                .map_err(|source| wrong(SourceError::Stages { curve: curve(), source })),
            _ => Err(wrong(SourceError::NotOne { curve: curve() })),
        }
    }
}

/// Stages in series on one stroke.
fn staged(stages: &[StageTable]) -> Result<Envelope, StageError> {
    let (mut d, mut f) = (Vec::new(), Vec::new());
    let mut begin = 0.0;
    for (i, stage) in stages.iter().enumerate() {
        let from = stage.from.map_or(0.0, |f| f.0);
        let to = stage.to.map_or(from, |f| f.0);
        let stroke_m = stage.stroke.0;
        if stroke_m <= 2.0 * STEP_M {
            let stage = stage.name.clone().unwrap_or_else(|| format!("{}", i + 1));
            return Err(StageError::Short { stage, number: i + 1, stroke_m });
        }
        match f.last() {
            None => {
                d.push(0.0);
                f.push(from);
            }
            Some(&before) if before != from => {
                d.push(begin + STEP_M);
                f.push(from);
            }
            Some(_) => {}
        }
        begin += stroke_m;
        d.push(begin);
        f.push(to);
    }
    Ok(Envelope::new(d, f)?)
}
