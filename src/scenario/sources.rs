//! Sources: the files that a scenario's curves name, read once.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::{CurveTable, Scenario, ScenarioError, StageTable};
use crate::curve::{Case, DrivingCurve, Envelope};
use crate::database::Database;
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
        let mut names = vec![&mut self.contact.curve];
        for train in &mut self.train {
            if train.vehicles.len() > 1 {
                names.extend(&mut train.inner);
            }
            for vehicle in &mut train.vehicles {
                names.extend(&mut vehicle.behind);
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
    pub(crate) fn read(path: &Path, scenario: &Scenario) -> Result<Self, ScenarioError> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let mut databases = BTreeMap::new();
        let mut curves = BTreeMap::new();
        for (name, table) in &scenario.curves {
            let source =
                CurveSource::read(table, name, folder, &mut databases).map_err(|e| match e {
                    ReadError::Message(message) => {
                        ScenarioError::Invalid { path: path.into(), message }
                    }
                    ReadError::Scenario(error) => *error,
                })?;
            curves.insert(name.clone(), source);
        }
        Ok(Self { curves })
    }

    /// Puts another source in place of a curve's.
    pub(crate) fn replace(&mut self, curve: &str, source: CurveSource) {
        self.curves.insert(curve.into(), source);
    }
}

enum ReadError {
    Message(String),
    Scenario(Box<ScenarioError>),
}

impl<E: Into<ScenarioError>> From<E> for ReadError {
    fn from(error: E) -> Self {
        Self::Scenario(Box::new(error.into()))
    }
}

impl CurveSource {
    fn read(
        table: &CurveTable,
        name: &str,
        folder: &Path,
        databases: &mut BTreeMap<PathBuf, Database>,
    ) -> Result<Self, ReadError> {
        match (&table.model, &table.file, &table.database, &table.stages) {
            (Some(model), None, None, None) => {
                Ok(Self::Model(Box::new(Model::read(&folder.join(model))?)))
            }
            (None, Some(file), None, None) => {
                let path = folder.join(file);
                if path.extension().is_some_and(|e| e == "json") {
                    return Ok(Self::Predicted(Box::new(json::predicted(&path)?)));
                }
                let mut held = csv::driving(&path)?;
                let stated = table.force.or(held.force);
                if held.force.is_some() && stated != held.force {
                    return Err(ReadError::Message(format!(
                        "curve \"{name}\": force names another force than {} says it holds: remove force",
                        path.display()
                    )));
                }
                held.force = stated;
                Ok(Self::Curve(Box::new(held)))
            }
            (None, None, Some(database), None) => {
                let case = table.case.as_deref().and_then(|c| c.split_once('/'));
                let (group, case) = case.ok_or_else(|| {
                    ReadError::Message(format!(
                        "curve \"{name}\": write case = \"group/case\" beside database"
                    ))
                })?;
                let path = folder.join(database);
                if !databases.contains_key(&path) {
                    databases.insert(path.clone(), Database::read(&path)?);
                }
                Ok(Self::Case(Box::new(databases[&path].case(&path, group, case)?.clone())))
            }
            (None, None, None, Some(stages)) => staged(stages)
                .map(Self::Stages)
                .map_err(|message| ReadError::Message(format!("curve \"{name}\": {message}"))),
            _ => Err(ReadError::Message(format!(
                "curve \"{name}\" needs exactly one of model, file, database and stages"
            ))),
        }
    }
}

/// Stages in series on one stroke.
fn staged(stages: &[StageTable]) -> Result<Envelope, String> {
    let (mut d, mut f) = (Vec::new(), Vec::new());
    let mut begin = 0.0;
    for (i, stage) in stages.iter().enumerate() {
        let from = stage.from.map_or(0.0, |f| f.0);
        let to = stage.to.map_or(from, |f| f.0);
        let stroke = stage.stroke.0;
        if stroke <= 2.0 * STEP_M {
            let name = stage.name.clone().unwrap_or_else(|| format!("{}", i + 1));
            return Err(format!("stage {name} has a stroke of {stroke} m: expected over 0.2 mm"));
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
        begin += stroke;
        d.push(begin);
        f.push(to);
    }
    Envelope::new(d, f).map_err(|e| format!("its stages make no curve: {e}"))
}
