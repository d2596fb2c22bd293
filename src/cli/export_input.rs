//! The input of `crumple export`: a predicted curve, a model, a database or another curve's file, by content.

use std::path::{Path, PathBuf};

use crate::curate::Selection;
use crate::curve::{Case, Quality};
use crate::database::Database;
use crate::dataset::is_same_speed;
use crate::formats::read::{is_folder_of_tests, json};
use crate::import::{self, Item, Settings};
use crate::surrogate::{Model, PredictedCurve, Query, predict};
use crate::unit::km_per_h;

use super::arguments::{self, FileKind};
use super::export::{Args, Which};
use super::{Failure, usage};

/// The input of an export.
pub(super) enum Input {
    Curve(Box<PredictedCurve>),
    Model(Box<Model>),
    Database(PathBuf, Database),
    /// A measured or legacy curve's.
    File(PathBuf),
}

impl Input {
    pub(super) fn read(path: &Path) -> Result<Self, Failure> {
        if is_folder_of_tests(path) {
            return Ok(Self::File(path.into()));
        }
        Ok(match FileKind::of(path)? {
            FileKind::Database => Self::Database(path.into(), Database::read(path)?),
            FileKind::Model => Self::Model(Box::new(Model::read(path)?)),
            FileKind::Curve => Self::Curve(Box::new(json::predicted(path)?)),
            FileKind::Sweep => {
                let (path, of) = (path.display(), "give a curve, a model or a database");
                return usage(format!("{path} is the result of a sweep and holds no curve: {of}"));
            }
            FileKind::Scenario | FileKind::Result | FileKind::Solver => Self::File(path.into()),
        })
    }

    /// Refuses options about a curve's file if the input is not one.
    pub(super) fn check_said(&self, args: &Args) -> Result<(), Failure> {
        let is_said = args.file.is_asked() || args.input_units.is_some();
        match (self, is_said) {
            (Self::File(_), _) | (_, false) => Ok(()),
            (_, true) => usage(
                "--kind, --other-mass, --unloading, --from, --curve, --deflection-column, --force-column, --time-column, --accept-energy and --input-units apply only to the file of a measured or legacy curve: predicted curves, models and databases hold these values",
            ),
        }
    }

    /// The model, for a format that is made of one.
    pub(super) fn model(&self, format: &str) -> Result<&Model, Failure> {
        match self {
            Self::Model(model) => Ok(model),
            Self::Curve(_) | Self::Database(..) | Self::File(_) => usage(format!(
                "{format} is made of a whole model: crumple export MODEL --to {format} (crumple train makes one)"
            )),
        }
    }

    /// The recorded cases, for a format that is made of histories.
    pub(super) fn cases(&self, args: &Args, format: &str) -> Result<Vec<Case>, Failure> {
        match self {
            Self::Database(path, database) => args.which.of_database(path, database),
            Self::File(path) => Ok(vec![args.of_file(path)?]),
            Self::Curve(_) | Self::Model(_) => usage(format!(
                "{format} takes histories over time, which a predicted curve does not have: give a curve database, or write a run's with crumple simulate -o"
            )),
        }
    }

    /// The curves; with the notes and warnings of reading a measured or legacy one.
    pub(super) fn curves(
        &self,
        args: &Args,
    ) -> Result<(Vec<PredictedCurve>, Option<Quality>), Failure> {
        let inputs = match self {
            Self::Curve(curve) => {
                args.which.refuse_all("a predicted curve")?;
                vec![(**curve).clone()]
            }
            Self::Model(model) => args.which.of_model(model)?,
            Self::Database(path, database) => {
                let cases = args.which.of_database(path, database)?;
                cases.iter().map(PredictedCurve::of_case).collect::<Result<_, _>>()?
            }
            Self::File(path) => {
                let case = args.of_file(path)?;
                return Ok((vec![PredictedCurve::of_case(&case)?], Some(case.quality)));
            }
        };
        Ok((inputs, None))
    }
}

impl Which {
    /// The query to the model; the speed is set for each curve.
    pub(super) fn query(&self) -> Result<Query, Failure> {
        Ok(Query {
            mass_kg: self.mass,
            rule: self.max_crush,
            extrapolate: self.extrapolate,
            parameters: arguments::parameters(&self.parameter)?,
            ..Query::at(0.0)
        })
    }

    fn refuse_all(&self, what: &str) -> Result<(), Failure> {
        let is_asked = !self.speed.is_empty()
            || self.asks_a_model()
            || self.group.is_some()
            || !self.case.is_empty();
        if is_asked {
            usage(format!(
                "{what} has one speed and mass: remove --speed, --mass, --max-crush, --extrapolate, --parameter, --group, --case, or give the model or the database"
            ))
        } else {
            Ok(())
        }
    }

    /// Whether any option is given that only applies to a model.
    fn asks_a_model(&self) -> bool {
        let has_rule = self.max_crush.is_some() || self.extrapolate;
        self.mass.is_some() || has_rule || !self.parameter.is_empty()
    }

    /// Refuses options that an export of a whole model does not use; a table accepts all options of
    /// a model.
    pub(super) fn check_for_model(&self, is_table: bool) -> Result<(), Failure> {
        self.refuse_cases()?;
        let of_curve = self.asks_a_model() || !self.speed.is_empty();
        if of_curve && !is_table {
            return usage(
                "this holds a whole model: remove --speed, --mass, --max-crush, --extrapolate, --parameter",
            );
        }
        Ok(())
    }

    fn refuse_cases(&self) -> Result<(), Failure> {
        if self.group.is_some() || !self.case.is_empty() {
            return usage("--group and --case are for a database: a model has only one group");
        }
        Ok(())
    }

    fn of_model(&self, model: &Model) -> Result<Vec<PredictedCurve>, Failure> {
        self.refuse_cases()?;
        if self.speed.is_empty() {
            let (low, high) = model.range_m_per_s();
            return usage(format!(
                "name the speeds of the model's curves with --speed ({} to {})",
                km_per_h(low),
                km_per_h(high)
            ));
        }
        let curve = |&speed: &f64| {
            let query = Query { speed_m_per_s: speed, ..self.query()? };
            Ok(predict(model, &query)?)
        };
        self.speed.iter().map(curve).collect()
    }

    fn of_database(&self, path: &Path, database: &Database) -> Result<Vec<Case>, Failure> {
        if self.asks_a_model() {
            return usage(
                "--mass, --max-crush, --extrapolate and --parameter are for a model: a recorded case has its own mass and crush",
            );
        }
        let cases: Vec<&Case> = if self.case.is_empty() {
            database.group_or_only(path, self.group.as_deref())?.1.iter().collect()
        } else {
            let groups = self.group.iter().cloned().collect();
            let named = Selection { groups, cases: self.case.clone(), ..Selection::default() };
            named.find(path, database)?
        };
        let has_speed = |case: &Case, v: f64| is_same_speed(case.conditions.speed.m_per_s, v);
        if let Some(&v) = self.speed.iter().find(|&&v| !cases.iter().any(|c| has_speed(c, v))) {
            let known: Vec<String> =
                cases.iter().map(|c| km_per_h(c.conditions.speed.m_per_s)).collect();
            let (group, v, known) = (&cases[0].id.group, km_per_h(v), known.join(", "));
            return usage(if self.case.is_empty() {
                format!(
                    "group {group} has no case at {v}: it has {known}; a model gives curves at other speeds"
                )
            } else {
                format!("none of the cases of --case is at {v}: they are at {known}")
            });
        }
        let speeds = &self.speed;
        let is_chosen =
            |case: &&Case| speeds.is_empty() || speeds.iter().any(|&v| has_speed(case, v));
        Ok(cases.into_iter().filter(is_chosen).cloned().collect())
    }
}

impl Args {
    /// The case that a measured or legacy curve's file makes.
    fn of_file(&self, path: &Path) -> Result<Case, Failure> {
        if self.which.speed.len() > 1 || self.which.case.len() > 1 {
            return usage("a file holds the curve of one impact: give one --speed and one --case");
        }
        if self.which.max_crush.is_some() || self.which.extrapolate {
            return usage(
                "--max-crush and --extrapolate are for a model: a curve has its own crush",
            );
        }
        let item = Item {
            path: path.into(),
            case: self.which.case.first().cloned(),
            speed_m_per_s: self.which.speed.first().copied(),
        };
        let stem = path.file_stem().map_or("curve".into(), |stem| stem.to_string_lossy());
        let mut settings = Settings {
            group: self.which.group.as_deref().unwrap_or(&stem).into(),
            mass_kg: self.which.mass,
            parameters: self.which.query()?.parameters,
            ..self.file.settings()
        };
        settings.read.units = self.input_units;
        Ok(import::case_of(&item, &settings, None)?)
    }
}
