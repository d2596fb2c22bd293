//! The input of `crumple export`: a predicted curve, a model, a database or another curve's file, by content.

use crate::error::error;
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::curve::Case;
use crate::database::Database;
use crate::dataset::is_same_speed;
use crate::file;
use crate::formats::read::is_folder_of_tests;
use crate::formats::read::json;
use crate::import::{self, Item, Settings};
use crate::surrogate::{Model, PredictedCurve, Query, predict};
use crate::unit::{UnitSystem, km_per_h};

use super::Failure;
use super::curve_file::CurveFile;

/// The input of an export.
pub(super) enum Input {
    Curve(Box<PredictedCurve>),
    Model(Box<Model>),
    Database(PathBuf, Database),
    /// A measured or legacy curve's.
    File(PathBuf),
}

/// Which curves of it.
pub(super) struct Chosen<'a> {
    pub speeds_m_per_s: &'a [f64],
    /// The query to a model; its speed is not used.
    pub query: Query,
    pub group: Option<&'a str>,
    pub cases: &'a [String],
    /// Options about a measured or legacy curve, and the units of its file.
    pub file: &'a CurveFile,
    pub input_units: Option<UnitSystem>,
}

/// Curves, and what the user should know of how they were read.
#[derive(Default)]
pub(super) struct Curves {
    pub inputs: Vec<PredictedCurve>,
    pub notes: Vec<String>,
    pub warnings: Vec<String>,
}

/// Bytes in which a model file says that it is one.
const HEAD: u64 = 4096;
/// With these every HDF5 file begins.
const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";

impl Input {
    pub(super) fn read(path: &Path) -> Result<Self, Failure> {
        if is_folder_of_tests(path) {
            return Ok(Self::File(path.into()));
        }
        let mut head = Vec::new();
        let named =
            |source| error!(CurveFile, "{path}: {source}", path = path.display()).caused_by(source);
        file::open(path).and_then(|f| f.take(HEAD).read_to_end(&mut head)).map_err(named)?;
        if head.starts_with(HDF5) {
            return Ok(Self::Database(path.into(), Database::read(path)?));
        }
        let text = String::from_utf8_lossy(&head);
        let is_json = text.trim_start_matches('\u{feff}').trim_start().starts_with('{');
        match (text.contains("\"crumple model\""), is_json) {
            (true, _) => Ok(Self::Model(Box::new(Model::read(path)?))),
            (false, true) => Ok(Self::Curve(Box::new(json::predicted(path)?))),
            (false, false) => Ok(Self::File(path.into())),
        }
    }

    /// Refuses options about a curve's file if the input is not one.
    pub(super) fn check_said(&self, chosen: &Chosen<'_>) -> Result<(), Failure> {
        let is_said = chosen.file.is_asked() || chosen.input_units.is_some();
        match (self, is_said) {
            (Self::File(_), _) | (_, false) => Ok(()),
            (_, true) => Err(Failure::Usage(
                "--kind, --other-mass, --unloading, --from, --curve, --deflection-column, --force-column, --time-column, --accept-energy and --input-units apply only to the file of a measured or legacy curve: predicted curves, models and databases hold these values".into(),
            )),
        }
    }

    /// The model, for a format that is made of one.
    pub(super) fn model(&self, format: &str) -> Result<&Model, Failure> {
        match self {
            Self::Model(model) => Ok(model),
            Self::Curve(_) | Self::Database(..) | Self::File(_) => Err(Failure::Usage(format!(
                "{format} takes a model: crumple train, then crumple export MODEL --to {format}"
            ))),
        }
    }

    /// The recorded cases, for a format that is made of histories.
    pub(super) fn cases(&self, chosen: &Chosen<'_>, format: &str) -> Result<Vec<Case>, Failure> {
        match self {
            Self::Database(path, database) => chosen.of_database(path, database),
            Self::File(path) => Ok(vec![chosen.of_file(path)?]),
            Self::Curve(_) | Self::Model(_) => Err(Failure::Usage(format!(
                "{format} takes histories over time, which a predicted curve does not have: give a curve database, or write a run's with crumple simulate -o"
            ))),
        }
    }

    pub(super) fn curves(&self, chosen: &Chosen<'_>) -> Result<Curves, Failure> {
        let inputs = match self {
            Self::Curve(curve) => {
                chosen.refuse_all("a predicted curve")?;
                vec![(**curve).clone()]
            }
            Self::Model(model) => chosen.of_model(model)?,
            Self::Database(path, database) => {
                let cases = chosen.of_database(path, database)?;
                cases.iter().map(PredictedCurve::of_case).collect::<Result<_, _>>()?
            }
            Self::File(path) => {
                let case = chosen.of_file(path)?;
                let inputs = vec![PredictedCurve::of_case(&case)?];
                return Ok(Curves {
                    inputs,
                    notes: case.quality.notes,
                    warnings: case.quality.warnings,
                });
            }
        };
        Ok(Curves { inputs, ..Curves::default() })
    }
}

impl Chosen<'_> {
    fn refuse_all(&self, what: &str) -> Result<(), Failure> {
        let is_asked = !self.speeds_m_per_s.is_empty()
            || self.asks_a_model()
            || self.group.is_some()
            || !self.cases.is_empty();
        if is_asked {
            Err(Failure::Usage(format!(
                "{what} has one speed and mass: remove --speed, --mass, --max-crush, --extrapolate, --parameter, --group, --case, or give the model or the database"
            )))
        } else {
            Ok(())
        }
    }

    /// Whether any option is given that only applies to a model.
    fn asks_a_model(&self) -> bool {
        let Query { mass_kg, rule, extrapolate, parameters, .. } = &self.query;
        mass_kg.is_some() || rule.is_some() || *extrapolate || !parameters.is_empty()
    }

    /// Refuses options that an export of a whole model does not use; a table accepts all options of
    /// a model.
    pub(super) fn check_for_model(&self, is_table: bool) -> Result<(), Failure> {
        let of_database = self.group.is_some() || !self.cases.is_empty();
        let of_curve = self.asks_a_model() || !self.speeds_m_per_s.is_empty();
        match (of_database, of_curve && !is_table) {
            (true, _) => Err(Failure::Usage(
                "--group and --case are for a database: a model has only one group".into(),
            )),
            (false, true) => Err(Failure::Usage(
                "this holds a whole model: remove --speed, --mass, --max-crush, --extrapolate, --parameter".into(),
            )),
            (false, false) => Ok(()),
        }
    }

    fn of_model(&self, model: &Model) -> Result<Vec<PredictedCurve>, Failure> {
        if self.group.is_some() || !self.cases.is_empty() {
            let message = "--group and --case are for a database: a model has only one group";
            return Err(Failure::Usage(message.into()));
        }
        if self.speeds_m_per_s.is_empty() {
            let (low, high) = model.range_m_per_s();
            return Err(Failure::Usage(format!(
                "name the speeds of the model's curves with --speed ({} to {})",
                km_per_h(low),
                km_per_h(high)
            )));
        }
        let curve = |&speed: &f64| {
            let query = Query { speed_m_per_s: speed, ..self.query.clone() };
            Ok(predict(model, &query)?)
        };
        self.speeds_m_per_s.iter().map(curve).collect()
    }

    /// The case that a measured or legacy curve's file makes.
    fn of_file(&self, path: &Path) -> Result<Case, Failure> {
        if self.speeds_m_per_s.len() > 1 || self.cases.len() > 1 {
            let message = "a file holds the curve of one impact: give one --speed and one --case";
            return Err(Failure::Usage(message.into()));
        }
        if self.query.rule.is_some() || self.query.extrapolate {
            let message =
                "--max-crush and --extrapolate are for a model: a curve has its own crush";
            return Err(Failure::Usage(message.into()));
        }
        let item = Item {
            path: path.into(),
            case: self.cases.first().cloned(),
            speed_m_per_s: self.speeds_m_per_s.first().copied(),
        };
        let stem = path.file_stem().map_or("curve".into(), |stem| stem.to_string_lossy());
        let mut settings = Settings {
            group: self.group.unwrap_or(&stem).into(),
            mass_kg: self.query.mass_kg,
            parameters: self.query.parameters.clone(),
            ..self.file.settings()
        };
        settings.read.units = self.input_units;
        Ok(import::case_of_file(&item, &settings)?)
    }

    fn of_database(&self, path: &Path, database: &Database) -> Result<Vec<Case>, Failure> {
        if self.asks_a_model() {
            let message = "--mass, --max-crush, --extrapolate and --parameter are for a model: a recorded case has its own mass and crush";
            return Err(Failure::Usage(message.into()));
        }
        let (group, cases) = database.group_or_only(path, self.group)?;
        for name in self.cases {
            database.case(path, group, name)?;
        }
        let has_speed = |case: &Case, v: f64| is_same_speed(case.conditions.speed.m_per_s, v);
        if let Some(&v) =
            self.speeds_m_per_s.iter().find(|&&v| !cases.iter().any(|c| has_speed(c, v)))
        {
            let known: Vec<String> =
                cases.iter().map(|c| km_per_h(c.conditions.speed.m_per_s)).collect();
            return Err(Failure::Usage(format!(
                "group {group} has no case at {}: it has {}; a model gives curves at other speeds",
                km_per_h(v),
                known.join(", ")
            )));
        }
        let is_chosen = |case: &&Case| {
            let by_name = self.cases.is_empty() || self.cases.contains(&case.id.name);
            let speeds = self.speeds_m_per_s;
            by_name && (speeds.is_empty() || speeds.iter().any(|&v| has_speed(case, v)))
        };
        Ok(cases.iter().filter(is_chosen).cloned().collect())
    }
}
