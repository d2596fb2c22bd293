//! Sources: the files that a scenario's curves name, read once.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use super::assemble::LawCache;
use super::{CheckedScenario, CurveTable, DampingTable, LawName, Scenario, StageTable, place};
use crate::curve::{Case, Envelope, ForceCurve, ForceKind};
use crate::database::Database;
use crate::error::{Error, ErrorCode, KeyPath, error};
use crate::formats::ReadOptions;
use crate::formats::read::{self, DrivingFile};
use crate::surrogate::leave_one_out::Means;
use crate::surrogate::{Model, PredictedCurve};
use crate::unit::{Shown, km_per_h};

/// What the curves of a scenario are made of: the same for every variation of it.
#[derive(Debug)]
pub(crate) struct Sources {
    pub(super) curves: BTreeMap<String, CurveSource>,
    pub(super) laws: LawCache,
}

impl Clone for Sources {
    /// Without the laws: the copy may get other curves.
    fn clone(&self) -> Self {
        Self { curves: self.curves.clone(), laws: LawCache::default() }
    }
}

/// What a curve is made of.
#[derive(Clone, Debug)]
pub(crate) enum CurveSource {
    Model(Box<Model>),
    Predicted(Box<PredictedCurve>),
    /// With what its file needed to drive an interface.
    Curve(Box<ForceCurve>, Vec<String>),
    /// Stages of a device between two bodies.
    Stages(Envelope),
    Case(Box<Case>),
}

/// What a curve comes from, in words and with what is known of its errors.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CurveOrigin {
    pub(crate) curve: String,
    /// Such as `lead.model`; `stages`.
    pub(crate) from: String,
    /// Such as `crush-law of lead-car-wall`.
    pub(crate) what: String,
    /// Slowest and fastest FE run, in m/s.
    pub(crate) speeds_m_per_s: Option<(f64, f64)>,
    /// How many FE runs.
    pub(crate) runs: usize,
    /// What leaving its speeds out came to, if that was done.
    pub(crate) left_out: Option<Means>,
    /// Gap, unloading, stages and whatever else its table gives.
    pub(crate) stated: String,
}

impl CurveOrigin {
    /// On one line.
    pub(crate) fn text(&self) -> String {
        let Self { curve, from, what, .. } = self;
        let runs = match self.speeds_m_per_s {
            Some((low, high)) if self.runs > 1 => {
                format!(", {} FE runs, {} to {}", self.runs, km_per_h(low), km_per_h(high))
            }
            Some((speed, _)) => format!(", {}", km_per_h(speed)),
            None => String::new(),
        };
        format!("Curve {curve}: {from}: {what}{runs}.")
    }
}

/// Over this length the force steps from one stage to the next: a step is not a function.
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

/// Most bytes of the files that the curves of a scenario name, a file as often as it is named.
const MAX_BYTES: u64 = 2 << 30;

impl Sources {
    /// Reads what `scenario`, which stands at `path`, names.
    pub(crate) fn read(path: &Path, scenario: &CheckedScenario<'_>) -> Result<Self, Error> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let files = scenario.curves.values().filter_map(|t| t.model.as_ref().or(t.file.as_ref()));
        let sizes = files.filter_map(|file| fs::metadata(folder.join(file)).ok());
        let bytes: u64 = sizes.map(|file| file.len()).sum();
        if bytes > MAX_BYTES {
            let error = error!(
                Scenario at "curves",
                "the files of [curves] total {} MB: expected at most {}; name fewer, or smaller ones",
                bytes >> 20,
                MAX_BYTES >> 20
            );
            return Err(error.placed(|key| scenario.place(path, key)));
        }
        let mut curves = BTreeMap::new();
        for (name, table) in &scenario.curves {
            let read = CurveSource::read(path, name, table);
            let source = read.map_err(|error| {
                error.inside(place::curve(name)).placed(|key| scenario.place(path, key))
            })?;
            curves.insert(name.clone(), source);
        }
        Ok(Self { curves, laws: LawCache::default() })
    }

    /// What each curve comes from, but for those of tension.
    pub(crate) fn origins(&self, scenario: &Scenario) -> Vec<CurveOrigin> {
        let origin = |(name, source): (&String, &CurveSource)| {
            let table = &scenario.curves[name];
            let file = table.model.as_ref().or(table.file.as_ref()).or(table.database.as_ref());
            let from = file.map_or("stages".into(), |file| file.display().to_string());
            let (what, speeds_m_per_s, runs) = source.what();
            let left_out = match source {
                CurveSource::Model(model) => model.leave_one_out.as_ref().and_then(|found| {
                    found.means.iter().find(|means| means.model == model.kind.name()).cloned()
                }),
                _ => None,
            };
            let stated = table.stated();
            CurveOrigin { curve: name.clone(), from, what, speeds_m_per_s, runs, left_out, stated }
        };
        self.curves.iter().map(origin).collect()
    }

    /// The model of a curve, if it comes from one.
    pub(crate) fn model(&self, curve: &str) -> Option<&Model> {
        match self.curves.get(curve)? {
            CurveSource::Model(model) => Some(model),
            _ => None,
        }
    }

    /// Whether a curve comes from a model or prediction with a band.
    pub(super) fn has_band(&self, curve: &str) -> bool {
        match self.curves.get(curve) {
            Some(CurveSource::Model(model)) => {
                let of = model.leave_one_out.as_ref();
                of.is_some_and(|of| of.band.is_some() || of.body_band.is_some())
            }
            Some(CurveSource::Predicted(curve)) => curve.force_low_n.is_some(),
            _ => false,
        }
    }

    /// Makes a model's crush law one without stopped mass, in which the contact force itself has the
    /// rate.
    pub(crate) fn without_stopped_mass(&mut self, curve: &str) {
        if let Some(CurveSource::Model(model)) = self.curves.get_mut(curve) {
            model.without_stopped_mass();
            self.laws = LawCache::default();
        }
    }

    /// Puts another source in place of a curve's.
    pub(crate) fn replace(&mut self, curve: &str, source: CurveSource) {
        self.curves.insert(curve.into(), source);
        self.laws = LawCache::default();
    }
}

impl CurveTable {
    /// Where each stage after the first begins, in m, and its name.
    pub(super) fn stage_begins(&self) -> Vec<(f64, String)> {
        let mut begin_m = 0.0;
        let mut begins = Vec::new();
        for (i, stage) in self.stages.iter().flatten().enumerate() {
            begins.push((begin_m, stage.title(i)));
            begin_m += stage.stroke.0;
        }
        begins.into_iter().skip(1).collect()
    }

    /// What its table states besides the source: designs that differ in it are distinguished on a page.
    fn stated(&self) -> String {
        let mut parts: Vec<String> = Vec::new();
        for (i, stage) in self.stages.iter().flatten().enumerate() {
            let from = stage.from.map_or(0.0, |from| from.0);
            let to = stage.to.map_or(from, |to| to.0);
            let shown = Shown::force(from.max(to));
            let force = match from == to {
                true => shown.text(from),
                false => format!("{} to {}", shown.text(from), shown.text(to)),
            };
            parts.push(format!("{} {:.0} mm, {force}", stage.title(i), 1e3 * stage.stroke.0));
        }
        parts.extend(self.gap.map(|gap| format!("gap {:.0} mm", 1e3 * gap.0)));
        parts.extend(self.unloading.map(|k| format!("unloading {}", Shown::one_stiffness(k.0))));
        parts.extend(self.scale.map(|factor| format!("force times {factor}")));
        parts.extend(self.band.map(|member| match member {
            -1.0 => "lower edge of its band".into(),
            1.0 => "upper edge of its band".into(),
            member => format!("at {member} of its band"),
        }));
        if let Some(DampingTable { speed_m_per_s, coefficient_n_s_per_m: c }) = &self.damping {
            let over = match &**speed_m_per_s {
                [low, .., high] => format!(" over {low} to {high} m/s"),
                _ => String::new(),
            };
            let c: Vec<String> = c.iter().map(|c| (c / 1e3).to_string()).collect();
            parts.push(format!("damper {} kN s/m{over}", c.join(", ")));
        }
        parts.extend(self.tension.as_ref().map(|curve| format!("tension {curve}")));
        parts.extend(self.force.map(|force| format!("{} force", force.name())));
        let law = match self.law {
            LawName::Memory => None,
            LawName::Elastic => Some("law elastic".into()),
            LawName::Rate => Some("law rate".into()),
        };
        parts.extend(law);
        parts.extend(self.end.map(|end| format!("end {}", format!("{end:?}").to_lowercase())));
        parts.extend(self.max_crush.map(|rule| format!("maximum crush by {}", rule.name())));
        let further = self.parameters.iter().map(|(name, value)| format!("{name} = {value}"));
        parts.extend(further);
        parts.join("; ")
    }
}

impl StageTable {
    /// Its name, or its number.
    fn title(&self, i: usize) -> String {
        self.name.clone().unwrap_or_else(|| format!("stage {}", i + 1))
    }
}

impl CurveSource {
    /// In words, with the span of its speeds in m/s and the number of FE runs behind it.
    fn what(&self) -> (String, Option<(f64, f64)>, usize) {
        match self {
            Self::Model(model) => {
                let what = format!("{} of {}", model.kind.name(), model.group);
                (what, Some(model.range_m_per_s()), model.cases.len())
            }
            Self::Predicted(curve) => {
                let speed = curve.speed_m_per_s;
                let what = format!("{} of {}", curve.model, curve.provenance.group);
                (what, Some((speed, speed)), 1)
            }
            Self::Curve(curve, _) => {
                let force = curve.kind.map_or("force", ForceKind::name);
                let speed = curve.speed_m_per_s;
                (format!("{force} of a curve's file"), speed.map(|v| (v, v)), 1)
            }
            Self::Case(case) => {
                let (id, speed) = (&case.id, case.conditions.speed.m_per_s);
                (format!("FE run {}/{}", id.group, id.name), Some((speed, speed)), 1)
            }
            Self::Stages(_) => ("as the scenario states".into(), None, 0),
        }
    }

    /// Reads the source named in the table of curve `name` in the scenario at `path`.
    fn read(path: &Path, name: &str, table: &CurveTable) -> Result<Self, Error> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let of_curve = |error: Error| error.of(format_args!("curve \"{name}\""));
        match (&table.model, &table.file, &table.database, &table.stages) {
            (Some(model), None, None, None) => {
                let read = Model::read(&folder.join(model));
                let below = |e| of_curve(Error::below(ErrorCode::Model, e)).at_key("model");
                Ok(Self::Model(Box::new(read.map_err(below)?)))
            }
            (None, Some(file), None, None) => {
                let file = folder.join(file);
                let options = ReadOptions {
                    units: table.units,
                    curve: table.curve.clone(),
                    ..ReadOptions::default()
                };
                let read = read::driving(&file, &options).map_err(|error| {
                    let here = [
                        ("--units", "; here as units = \"…\" beside file"),
                        ("--curve", "; here as curve = \"…\" beside file"),
                        ("-column", "; here by the names of the columns in the file"),
                    ];
                    let asks = |(option, _): &(&str, &str)| error.message().contains(option);
                    let here = here.into_iter().find(asks).map_or("", |(_, here)| here);
                    let error = Error::below(ErrorCode::CurveFile, error).followed_by(here);
                    of_curve(error).at_key("file")
                })?;
                let (mut held, changes) = match read {
                    DrivingFile::Predicted(curve) => return Ok(Self::Predicted(curve)),
                    DrivingFile::Curve(curve, changes) => (curve, changes),
                };
                let stated = table.force.or(held.kind);
                if held.kind.is_some() && stated != held.kind {
                    return Err(of_curve(error!(
                        Scenario at "force",
                        "force contradicts the force that {} states: remove force",
                        file.display()
                    )));
                }
                held.kind = stated;
                Ok(Self::Curve(held, changes))
            }
            (None, None, Some(database), None) => {
                let case = table.case.as_deref().and_then(|c| c.split_once('/'));
                let (group, case) = case.ok_or_else(|| {
                    let key = if table.case.is_some() { "case" } else { "database" };
                    of_curve(error!(
                        Scenario at key,
                        "write case = \"group/case\" beside database"
                    ))
                })?;
                let database = folder.join(database);
                let read = Database::read_case(&database, Some(group), case);
                let read = read.map_err(|e| of_curve(e).or_at_key("database"))?;
                Ok(Self::Case(Box::new(read)))
            }
            (None, None, None, Some(stages)) => staged(stages).map(Self::Stages).map_err(of_curve),
            _ => Err(error!(
                Scenario,
                "curve \"{name}\" needs exactly one of model, file, database and stages"
            )),
        }
    }
}

/// Stages in series on one stroke.
fn staged(stages: &[StageTable]) -> Result<Envelope, Error> {
    let (mut d, mut f) = (Vec::new(), Vec::new());
    let mut begin = 0.0;
    for (i, stage) in stages.iter().enumerate() {
        let from = stage.from.map_or(0.0, |f| f.0);
        let to = stage.to.map_or(from, |f| f.0);
        let stroke_m = stage.stroke.0;
        if stroke_m <= 2.0 * STEP_M {
            let stage = stage.name.clone().unwrap_or_else(|| format!("{}", i + 1));
            return Err(error!(
                Scenario,
                "stage {stage} has a stroke of {} mm: expected more than 0.2 mm",
                stroke_m * 1e3
            )
            .at(KeyPath::of("stages").item(i).key("stroke")));
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
    Envelope::new(d, f).map_err(|error| {
        Error::below(ErrorCode::Scenario, error)
            .of("its stages do not form a curve")
            .at_key("stages")
    })
}
