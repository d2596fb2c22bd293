//! Scenario (TOML): trains, wall and curves, resolved into a multi-body chain.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Deserialize;

use crate::curve::body::body_motion;
use crate::curve::{Case, Envelope, ForceKind, Parameter};
use crate::database::{Database, DatabaseError};
use crate::export::{csv, json};
use crate::manifest::{self, ManifestError};
use crate::multibody::{
    Body, Chain, ChainError, EnvelopeEnd, ForceLaw, Interface, RunSettings, Unloading,
};
use crate::plan::Plan;
use crate::surrogate::max_crush::MaxCrushRule;
use crate::surrogate::predict::PredictError;
use crate::surrogate::{Model, ModelError, PredictedCurve, Query, predict};
use crate::unit::{LengthText, MassText, SpeedKind, SpeedText, StiffnessText, TimeText, km_per_h};

/// A scenario as written.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    pub run: RunTable,
    /// Curves, used below by name.
    pub curves: BTreeMap<String, CurveTable>,
    /// The moving train, then the one it meets, if any.
    pub train: Vec<TrainTable>,
    /// A rigid wall in place of a second train.
    pub wall: Option<WallTable>,
    /// Between the two noses, or nose and wall.
    pub contact: ContactTable,
    /// What `crumple sweep` varies; a single run takes no notice of it.
    pub sweep: Option<Plan>,
}

/// Times of the run.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RunTable {
    pub duration: TimeText,
    #[serde(default = "default_interval")]
    pub output_interval: TimeText,
    /// Longest integration step.
    pub step: Option<TimeText>,
    /// Which speed an interface's model curve is predicted for.
    #[serde(default)]
    pub interface_speed: InterfaceSpeed,
}

/// 0.75 ms, as in the reference data.
fn default_interval() -> TimeText {
    TimeText(0.75e-3)
}

/// Which speed an interface's model curve is predicted for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum InterfaceSpeed {
    /// The speed at which the trains meet.
    Train,
    /// The interface's own closing speed.
    #[default]
    Local,
}

/// One curve: exactly one of `model`, `file` and `database`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CurveTable {
    /// Model file; the curve is predicted for the speed of the interface.
    pub model: Option<PathBuf>,
    /// Curve file: predicted curve (.json) or table (.csv).
    pub file: Option<PathBuf>,
    /// Curve database, with `case`.
    pub database: Option<PathBuf>,
    /// Case of the database, as "group/case".
    pub case: Option<String>,
    /// Unloading stiffness; the curve's own if absent.
    pub unloading: Option<StiffnessText>,
    /// Free distance before contact.
    pub gap: Option<LengthText>,
    #[serde(default)]
    pub law: LawName,
    #[serde(default)]
    pub end: EndName,
    /// Of a model: the rule for the maximal crush; the model's own if absent.
    #[serde(default)]
    pub max_crush: Option<MaxCrushRule>,
    /// Of a model: values of its further parameters.
    #[serde(default)]
    pub parameters: BTreeMap<String, Parameter>,
    /// Of a model, predicted curve or database case: the force of the recipe, or the one that moves a body of one
    /// mass.
    #[serde(default)]
    pub force: ForceName,
    /// Of a model or predicted curve: member of its band, from −1 (lower edge) over 0 (the
    /// curve) to 1 (upper edge).
    pub band: Option<f64>,
    /// Factor on the force.
    pub scale: Option<f64>,
}

/// Which force of a predicted curve drives an interface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ForceName {
    /// The force of the recipe (contact or body).
    #[default]
    Declared,
    /// The force of the body's motion, with its rebound.
    Body,
}

/// Force law of an interface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LawName {
    /// Elastic-plastic: unloads on a line of the unloading stiffness.
    #[default]
    Memory,
    /// Follows the curve back, as the reference model.
    Elastic,
}

/// What the force does beyond the curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EndName {
    /// Holds the last force.
    #[default]
    Hold,
    /// Continues the last segment.
    Slope,
    /// Ends the run with an error.
    Error,
}

/// A train.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrainTable {
    pub name: String,
    pub speed: SpeedText,
    /// Curve of the interfaces between its vehicles.
    pub inner: Option<String>,
    /// From the nose back.
    pub vehicles: Vec<VehicleTable>,
}

/// A vehicle.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VehicleTable {
    pub name: String,
    pub mass: MassText,
}

/// A rigid wall.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WallTable {
    #[serde(default = "wall_name")]
    pub name: String,
}

fn wall_name() -> String {
    "wall".into()
}

/// The first contact.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactTable {
    /// Name of its curve.
    pub curve: String,
    /// Free distance before contact; the curve's own if absent.
    pub gap: Option<LengthText>,
}

/// A scenario ready to run.
#[derive(Clone, Debug)]
pub struct Prepared {
    pub chain: Chain,
    pub settings: RunSettings,
    /// Bodies as the scenario lists them: indices into the chain, first train first.
    pub order: Vec<usize>,
    /// Warnings of the curves used.
    pub warnings: Vec<String>,
}

/// Why a scenario cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum ScenarioError {
    #[error(transparent)]
    Manifest(#[from] ManifestError),
    #[error("{path}: {message}")]
    Invalid { path: PathBuf, message: String },
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error("curve \"{curve}\": {source}")]
    Predict { curve: String, source: PredictError },
    #[error(transparent)]
    Database(#[from] DatabaseError),
    #[error(transparent)]
    CurveFile(#[from] json::CurveFileError),
    #[error(transparent)]
    Csv(#[from] csv::CsvError),
    #[error("{path}: {source}")]
    Chain { path: PathBuf, source: ChainError },
}

/// Parses and checks the text of a scenario; curves are not read. `path` is for messages.
///
/// # Errors
/// [`ScenarioError`] as of [`load`].
pub fn parse(path: &Path, text: &str) -> Result<Scenario, ScenarioError> {
    Ok(checked(path, manifest::parse(path, text)?)?.0)
}

/// The scenario and the speed of what the first train meets.
fn checked(path: &Path, scenario: Scenario) -> Result<(Scenario, f64), ScenarioError> {
    let invalid = |message: String| ScenarioError::Invalid { path: path.into(), message };
    let obstacle_speed = check(&scenario).map_err(invalid)?;
    Ok((scenario, obstacle_speed))
}

/// The files that a scenario's curves name, read once: the same for every variation of it.
#[derive(Clone, Debug)]
pub struct Sources {
    curves: BTreeMap<String, Source>,
}

/// What the file of a curve holds.
#[derive(Clone, Debug)]
enum Source {
    Model(Box<Model>),
    Predicted(Box<PredictedCurve>),
    Table(Envelope),
    Case(Box<Case>),
}

impl Sources {
    /// Reads what `scenario`, which stands at `path`, names.
    ///
    /// # Errors
    /// [`ScenarioError`] names the curve or file.
    pub fn read(path: &Path, scenario: &Scenario) -> Result<Self, ScenarioError> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let mut databases = BTreeMap::new();
        let mut curves = BTreeMap::new();
        for (name, table) in &scenario.curves {
            let source =
                Source::read(table, name, folder, &mut databases).map_err(|e| match e {
                    ReadError::Message(message) => {
                        ScenarioError::Invalid { path: path.into(), message }
                    }
                    ReadError::Scenario(error) => *error,
                })?;
            curves.insert(name.clone(), source);
        }
        Ok(Self { curves })
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

impl Source {
    fn read(
        table: &CurveTable,
        name: &str,
        folder: &Path,
        databases: &mut BTreeMap<PathBuf, Database>,
    ) -> Result<Self, ReadError> {
        match (&table.model, &table.file, &table.database) {
            (Some(model), None, None) => {
                Ok(Self::Model(Box::new(Model::read(&folder.join(model))?)))
            }
            (None, Some(file), None) => {
                let path = folder.join(file);
                match (is_json(&path), table.force) {
                    (true, _) => Ok(Self::Predicted(Box::new(json::read(&path)?))),
                    (false, ForceName::Body) => Err(ReadError::Message(format!(
                        "curve \"{name}\": a CSV file does not say which force it holds: leave force away"
                    ))),
                    (false, ForceName::Declared) => Ok(Self::Table(csv::read(&path)?)),
                }
            }
            (None, None, Some(database)) => {
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
            _ => Err(ReadError::Message(format!(
                "curve \"{name}\" needs exactly one of model, file and database"
            ))),
        }
    }
}

/// Loads a scenario and everything it names.
///
/// # Errors
/// [`ScenarioError`] names the key, curve or file.
pub fn load(path: &Path) -> Result<Prepared, ScenarioError> {
    let scenario = manifest::load(path)?;
    let (scenario, _) = checked(path, scenario)?;
    let sources = Sources::read(path, &scenario)?;
    assemble(path, &scenario, &sources)
}

/// Puts a scenario together with what its files hold; `path` is for messages.
///
/// # Errors
/// [`ScenarioError`] names the key or curve.
pub fn assemble(
    path: &Path,
    scenario: &Scenario,
    sources: &Sources,
) -> Result<Prepared, ScenarioError> {
    let invalid = |message: String| ScenarioError::Invalid { path: path.into(), message };
    let obstacle_speed = check(scenario).map_err(invalid)?;
    let meeting =
        Meeting { sources, path, speed_m_per_s: scenario.train[0].speed.0 - obstacle_speed };
    let mut builder = Builder::default();
    // From the back of the first train to its nose.
    let first = &scenario.train[0];
    for (i, vehicle) in first.vehicles.iter().enumerate().rev() {
        builder.body(vehicle, first.speed.0);
        if i > 0 {
            let sides = Sides::Vehicles(&first.vehicles[i - 1], vehicle);
            builder.interface(scenario, &meeting, inner(first), sides, None)?;
        }
    }
    let nose = &first.vehicles[0];
    let contact = match (&scenario.wall, scenario.train.get(1)) {
        (None, Some(second)) => Sides::Noses(nose, &second.vehicles[0]),
        (wall, _) => Sides::Wall(nose, wall.as_ref().map_or("wall", |w| &w.name)),
    };
    let gap = scenario.contact.gap.map(|g| g.0);
    builder.interface(scenario, &meeting, &scenario.contact.curve, contact, gap)?;
    if let Some(second) = scenario.train.get(1) {
        for (i, vehicle) in second.vehicles.iter().enumerate() {
            builder.body(vehicle, second.speed.0);
            if let Some(next) = second.vehicles.get(i + 1) {
                let sides = Sides::Vehicles(vehicle, next);
                builder.interface(scenario, &meeting, inner(second), sides, None)?;
            }
        }
    }
    let front = first.vehicles.len();
    let order = (0..front).rev().chain(front..builder.bodies.len()).collect();
    let chain = Chain::new(builder.bodies, builder.interfaces)
        .map_err(|source| ScenarioError::Chain { path: path.into(), source })?;
    let settings = RunSettings::new(scenario.run.duration.0, scenario.run.output_interval.0);
    let settings = scenario.run.step.map_or(settings, |step| settings.with_step(step.0));
    builder.warnings.dedup();
    Ok(Prepared { chain, settings, order, warnings: builder.warnings })
}

/// Gives a chain put together by [`assemble`] the masses, speeds and gaps of `scenario`, which
/// differs from the one it was made of in nothing else; the force laws stay as they are. That
/// is right wherever no law depends on these: a model's curve does, on masses and speeds.
///
/// # Errors
/// [`ScenarioError`] as of [`assemble`]; the chain is then not to be run.
pub fn adjust(
    path: &Path,
    scenario: &Scenario,
    prepared: &mut Prepared,
) -> Result<(), ScenarioError> {
    let invalid = |message: String| ScenarioError::Invalid { path: path.into(), message };
    check(scenario).map_err(invalid)?;
    let (first, second) = (&scenario.train[0], scenario.train.get(1));
    let bodies = |train: &TrainTable| {
        let speed = train.speed.0;
        train.vehicles.iter().map(move |v| (v.mass.0, speed)).collect::<Vec<_>>()
    };
    let mut motions = bodies(first);
    motions.reverse();
    motions.extend(second.iter().flat_map(|train| bodies(train)));
    let own = |curve: &str| scenario.curves.get(curve).and_then(|c| c.gap).map_or(0.0, |g| g.0);
    let mut gaps = vec![own(inner(first)); first.vehicles.len() - 1];
    gaps.push(scenario.contact.gap.map_or_else(|| own(&scenario.contact.curve), |g| g.0));
    if let Some(second) = second {
        gaps.resize(gaps.len() + second.vehicles.len() - 1, own(inner(second)));
    }
    let failed = |source| ScenarioError::Chain { path: path.into(), source };
    prepared.chain.adjust(&motions, &gaps).map_err(failed)
}

fn inner(train: &TrainTable) -> &str {
    train.inner.as_deref().unwrap_or_default()
}

/// Names stand in the columns of the result.
fn check_name(name: &str) -> Result<(), String> {
    let breaks = |c: char| c.is_control() || [',', '|', '[', ']', '"'].contains(&c);
    if name.is_empty() || name.contains(breaks) {
        return Err(format!(
            "the name \"{}\" may not be empty or contain , | [ ] or quotes",
            name.escape_debug()
        ));
    }
    Ok(())
}

/// Checks what a single key cannot show; returns the speed of the obstacle.
fn check(scenario: &Scenario) -> Result<f64, String> {
    let obstacle_speed = match (&scenario.wall, scenario.train.as_slice()) {
        (Some(_), [_]) => 0.0,
        (None, [_, second]) => second.speed.0,
        (Some(_), trains) => {
            return Err(format!("a [wall] needs exactly one [[train]], found {}", trains.len()));
        }
        (None, trains) => {
            return Err(format!(
                "expected two [[train]], or one and a [wall], found {} [[train]] and no [wall]",
                trains.len()
            ));
        }
    };
    if let Some(wall) = &scenario.wall {
        check_name(&wall.name)?;
    }
    let mut names = std::collections::HashSet::new();
    for train in &scenario.train {
        if train.vehicles.is_empty() {
            return Err(format!("train \"{}\" has no vehicles", train.name));
        }
        if train.vehicles.len() > 1 && train.inner.is_none() {
            return Err(format!(
                "train \"{}\" has {} vehicles but no inner = \"…\" curve between them",
                train.name,
                train.vehicles.len()
            ));
        }
        for vehicle in &train.vehicles {
            let name = &vehicle.name;
            check_name(name)?;
            if !names.insert(name) {
                return Err(format!("two vehicles are named \"{name}\""));
            }
        }
    }
    if scenario.train[0].speed.0 <= obstacle_speed {
        return Err(format!(
            "train \"{}\" at {} never meets what is in front of it: it must be faster",
            scenario.train[0].name,
            km_per_h(scenario.train[0].speed.0)
        ));
    }
    Ok(obstacle_speed)
}

/// What all interfaces share.
struct Meeting<'a> {
    sources: &'a Sources,
    path: &'a Path,
    speed_m_per_s: f64,
}

/// What an interface lies between.
#[derive(Clone, Copy)]
enum Sides<'a> {
    Wall(&'a VehicleTable, &'a str),
    Noses(&'a VehicleTable, &'a VehicleTable),
    /// Of one train, the one nearer to the nose first.
    Vehicles(&'a VehicleTable, &'a VehicleTable),
}

impl Sides<'_> {
    fn name(&self) -> String {
        match self {
            Self::Wall(vehicle, wall) => format!("{}|{wall}", vehicle.name),
            Self::Noses(a, b) | Self::Vehicles(a, b) => format!("{}|{}", a.name, b.name),
        }
    }

    /// Mass of the body, or of each of two equal bodies with the same reduced mass.
    fn mass_kg(&self) -> f64 {
        match self {
            Self::Wall(vehicle, _) => vehicle.mass.0,
            Self::Noses(a, b) | Self::Vehicles(a, b) => {
                2.0 * a.mass.0 * b.mass.0 / (a.mass.0 + b.mass.0)
            }
        }
    }
}

#[derive(Default)]
struct Builder {
    bodies: Vec<Body>,
    interfaces: Vec<Interface>,
    /// Curves of files, whether at a wall, and the first interface that has their law.
    made: Vec<(String, bool, usize)>,
    warnings: Vec<String>,
}

/// An envelope with what its source knows of unloading.
struct Spring {
    envelope: Envelope,
    unloading_n_per_m: Option<f64>,
    kind: Option<SpeedKind>,
    warnings: Vec<String>,
}

impl Builder {
    fn body(&mut self, vehicle: &VehicleTable, speed_m_per_s: f64) {
        self.bodies.push(Body::new(vehicle.name.clone(), vehicle.mass.0, speed_m_per_s));
    }

    fn interface(
        &mut self,
        scenario: &Scenario,
        meeting: &Meeting<'_>,
        curve: &str,
        sides: Sides<'_>,
        gap: Option<f64>,
    ) -> Result<(), ScenarioError> {
        let name = sides.name();
        let invalid =
            |message: String| ScenarioError::Invalid { path: meeting.path.into(), message };
        let table = scenario.curves.get(curve).ok_or_else(|| {
            let known: Vec<&str> = scenario.curves.keys().map(String::as_str).collect();
            invalid(format!(
                "there is no curve \"{curve}\" in [curves]: it has {}",
                known.join(", ")
            ))
        })?;
        if matches!(sides, Sides::Vehicles(..))
            && table.model.is_some()
            && scenario.run.interface_speed == InterfaceSpeed::Local
        {
            return Err(invalid(format!(
                "interface {name} takes its curve from a model at its own closing speed, which this version does not iterate: write interface_speed = \"train\" in [run], or give curve \"{curve}\" as a file or database case"
            )));
        }
        // A file's curve has one law wherever it stands; to copy it takes far less than to make it.
        let at_wall = matches!(sides, Sides::Wall(..));
        let made = self.made.iter().find(|(c, wall, _)| c == curve && *wall == at_wall);
        if let Some(&(_, _, at)) = made {
            let law = self.interfaces[at].law.clone();
            let gap_m = gap.or(table.gap.map(|g| g.0)).unwrap_or(0.0);
            self.interfaces.push(Interface::new(name, law, gap_m));
            return Ok(());
        }
        let source = meeting
            .sources
            .curves
            .get(curve)
            .ok_or_else(|| invalid(format!("curve \"{curve}\" has not been read")))?;
        let source = spring(source, table, curve, sides.mass_kg(), meeting)?;
        let source =
            source.scaled(table.scale).map_err(|m| invalid(format!("curve \"{curve}\": {m}")))?;
        let expected = match sides {
            Sides::Wall(..) => SpeedKind::Wall,
            Sides::Noses(..) | Sides::Vehicles(..) => SpeedKind::Closing,
        };
        if let Some(kind) = source.kind
            && kind != expected
        {
            return Err(invalid(format!(
                "curve \"{curve}\" was measured at {} speeds, but interface {name} needs one of {} speeds",
                kind.name(),
                expected.name()
            )));
        }
        self.warnings.extend(source.warnings.iter().map(|w| format!("curve \"{curve}\": {w}")));
        let unloading = match table.law {
            LawName::Elastic => Unloading::Elastic,
            LawName::Memory => {
                let asked = table.unloading.map(|u| u.0);
                let steepest = source.envelope.max_slope();
                let stiffness = asked.or(source.unloading_n_per_m).unwrap_or(steepest);
                if let Some(asked) = asked
                    && asked < steepest
                {
                    self.warnings.push(format!(
                        "curve \"{curve}\": unloading {:.4} MN/m is softer than the curve's steepest rise ({:.4} MN/m): where it rises so, unloading is stiffer",
                        asked / 1e6,
                        steepest / 1e6
                    ));
                }
                if stiffness.max(steepest) <= 0.0 {
                    return Err(invalid(format!(
                        "curve \"{curve}\" never rises, so its unloading stiffness must be given: unloading = \"…MN/m\", or law = \"elastic\""
                    )));
                }
                Unloading::Memory { stiffness_n_per_m: stiffness }
            }
        };
        let end = match table.end {
            EndName::Hold => EnvelopeEnd::Hold,
            EndName::Slope => EnvelopeEnd::Slope,
            EndName::Error => EnvelopeEnd::Error,
        };
        if table.model.is_none() {
            self.made.push((curve.into(), at_wall, self.interfaces.len()));
        }
        let law = ForceLaw::new(source.envelope, unloading, end);
        let gap_m = gap.or(table.gap.map(|g| g.0)).unwrap_or(0.0);
        self.interfaces.push(Interface::new(name, law, gap_m));
        Ok(())
    }
}

/// The curve of a source that an interface needs.
fn spring(
    source: &Source,
    table: &CurveTable,
    name: &str,
    mass_kg: f64,
    meeting: &Meeting<'_>,
) -> Result<Spring, ScenarioError> {
    let failed = |source| ScenarioError::Predict { curve: name.into(), source };
    match source {
        Source::Model(model) => {
            let query = Query {
                mass_kg: Some(mass_kg),
                rule: table.max_crush,
                parameters: table.parameters.clone(),
                ..Query::at(meeting.speed_m_per_s)
            };
            from_curve(&predict(model, &query).map_err(failed)?, table).map_err(failed)
        }
        Source::Predicted(curve) => from_curve(curve, table).map_err(failed),
        Source::Table(_) | Source::Case(_) if table.band.is_some() => {
            let path = meeting.path.into();
            let message = format!(
                "curve \"{name}\": band needs a model or a predicted curve (.json), which has one"
            );
            Err(ScenarioError::Invalid { path, message })
        }
        Source::Table(envelope) => Ok(Spring {
            envelope: envelope.clone(),
            unloading_n_per_m: None,
            kind: None,
            warnings: Vec::new(),
        }),
        Source::Case(case) => from_case(case, table.force).map_err(|message| {
            let path = meeting.path.into();
            ScenarioError::Invalid { path, message: format!("curve \"{name}\": {message}") }
        }),
    }
}

/// The force that was asked for, with the unloading that goes with it.
fn from_curve(curve: &PredictedCurve, table: &CurveTable) -> Result<Spring, PredictError> {
    let mut envelope = match table.force {
        ForceName::Declared => curve.envelope()?,
        ForceName::Body => curve.driving_envelope()?,
    };
    if let Some(member) = table.band {
        envelope = band_member(curve, &envelope, member)?;
    }
    // The force law keeps to its bounds by itself; the one constant is for other tools.
    let unloading_n_per_m = Some(curve.stiffness_at_end(&envelope));
    Ok(Spring {
        envelope,
        unloading_n_per_m,
        kind: Some(curve.speed_kind),
        warnings: curve.warnings.iter().map(|w| w.to_string()).collect(),
    })
}

/// Member of the band around `envelope`, a force of `curve`. The band is that of the declared
/// force; around the body's force it has the same width.
fn band_member(
    curve: &PredictedCurve,
    envelope: &Envelope,
    member: f64,
) -> Result<Envelope, PredictError> {
    if !(-1.0..=1.0).contains(&member) {
        return Err(PredictError::Damaged(format!("band = {member}: expected from -1 to 1")));
    }
    let edge = if member < 0.0 { &curve.force_low_n } else { &curve.force_high_n };
    let edge = edge.as_ref().ok_or_else(|| {
        PredictError::Damaged("there is no band around it: leave band away".into())
    })?;
    let declared = curve.force_n.iter().zip(edge);
    let force_n = envelope
        .force_n()
        .iter()
        .zip(declared)
        .map(|(force, (declared, edge))| (force + member.abs() * (edge - declared)).max(0.0))
        .collect();
    Ok(Envelope::new(envelope.deflection_m().to_vec(), force_n)?)
}

impl Spring {
    /// With the force times `factor`, and the unloading stiffness with it.
    fn scaled(mut self, factor: Option<f64>) -> Result<Self, String> {
        let Some(factor) = factor else { return Ok(self) };
        if !(factor > 0.0 && factor.is_finite()) {
            return Err(format!("scale = {factor}: expected more than 0"));
        }
        let force_n = self.envelope.force_n().iter().map(|f| f * factor).collect();
        self.envelope = Envelope::new(self.envelope.deflection_m().to_vec(), force_n)
            .map_err(|e| e.to_string())?;
        self.unloading_n_per_m = self.unloading_n_per_m.map(|k| k * factor);
        Ok(self)
    }
}

fn is_json(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "json")
}

fn from_case(case: &Case, force: ForceName) -> Result<Spring, String> {
    let is_motion = force == ForceName::Body && case.force_kind == ForceKind::Contact;
    let (envelope, unloading_n_per_m) = match is_motion {
        true => {
            let motion = body_motion(case).ok_or("its sampled states make no loading branch")?;
            let unloading = motion.end_stiffness_n_per_m(case.masses.effective_kg());
            (motion.force, unloading.or(case.unloading_stiffness_n_per_m))
        }
        false => {
            let loading = case.loading().map_err(|e| e.to_string())?;
            (loading.envelope, case.unloading_stiffness_n_per_m)
        }
    };
    let truncated = case.is_truncated().then(|| "the run ended while loading".to_string());
    Ok(Spring {
        envelope,
        unloading_n_per_m,
        kind: Some(case.speed.kind),
        warnings: truncated.into_iter().collect(),
    })
}
