//! Curves: force over deflection, extracted from histories by a declared recipe.
//!
//! Deflection is positive in compression, force pushes the bodies apart; SI throughout.

pub(crate) mod body;
pub(crate) mod contact;
pub(crate) mod energy;
pub(crate) mod envelope;
pub(crate) mod extract;
pub(crate) mod force_curve;
pub(crate) mod from_table;
pub(crate) mod group;
pub(crate) mod loading;
pub(crate) mod recipe;
pub(crate) mod replicates;
pub(crate) mod retrace;
pub(crate) mod stopped_mass;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use serde::{Deserialize, Serialize};

use crate::error::{Error, error};
use crate::unit::{Speed, UnitSystem};
pub use body::BodyMotion;
pub use energy::audit;
pub use envelope::Envelope;
pub use extract::{Extracted, Measured, MeasuredForce, Setup, Stated, StatedContact, extract};
pub(crate) use force_curve::is_beyond;
pub use force_curve::{CurveUnloading, ForceCurve, Tail};
pub use from_table::from_table;
pub use loading::{Loading, unloading_stiffness};
pub use recipe::{Filter, ForceSource, Recipe, RecordedMotion, Sampling};
pub use retrace::{Impact, Table};
pub(crate) use stopped_mass::StoppedMass;

/// A force–deflection history: what one run measured at an interface.
///
/// Invariant: equal lengths of at least two, all finite, time strictly increasing.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    time_s: Vec<f64>,
    deflection_m: Vec<f64>,
    force_n: Vec<f64>,
}

impl Curve {
    /// Checks the invariant once.
    ///
    /// # Errors
    /// It names the first state that breaks it, counted from 1.
    pub fn new(time_s: Vec<f64>, deflection_m: Vec<f64>, force_n: Vec<f64>) -> Result<Self, Error> {
        let (time, deflection, force) = (time_s.len(), deflection_m.len(), force_n.len());
        if time != deflection || time != force {
            return Err(error!(
                Other,
                "columns differ in length: {time} times, {deflection} deflections, {force} forces"
            ));
        }
        if time < 2 {
            return Err(error!(Other, "a curve needs at least 2 states, found {time}"));
        }
        let columns = [("time", &time_s), ("deflection", &deflection_m), ("force", &force_n)];
        for (column, values) in columns {
            if let Some(i) = values.iter().position(|v| !v.is_finite()) {
                return Err(error!(
                    Other,
                    "the {column} of state {state} is {value}: expected a finite number",
                    state = i + 1,
                    value = values[i]
                ));
            }
        }
        if let Some(i) = time_s.windows(2).position(|w| w[1] <= w[0]) {
            let (before_s, time_s) = (time_s[i], time_s[i + 1]);
            return Err(error!(
                Other,
                "time does not increase at state {state}: {time_s} s follows {before_s} s",
                state = i + 2
            ));
        }
        Ok(Self { time_s, deflection_m, force_n })
    }

    /// Times in s, strictly increasing; 0 is the first contact.
    pub fn time_s(&self) -> &[f64] {
        &self.time_s
    }

    /// Deflections in m, positive in compression, one per time.
    pub fn deflection_m(&self) -> &[f64] {
        &self.deflection_m
    }

    /// Forces in N, positive in compression, one per time.
    pub fn force_n(&self) -> &[f64] {
        &self.force_n
    }
}

/// Which force a curve is: the two differ by what is stopped inside the crush zone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum ForceKind {
    /// The force on the obstacle: wall, contact side, section.
    Contact,
    /// Mass times acceleration of the body.
    Body,
}

impl ForceKind {
    /// The name in files: `contact` or `body`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Contact => "contact",
            Self::Body => "body",
        }
    }

    pub(crate) fn parse(name: &str) -> Option<Self> {
        [Self::Contact, Self::Body].into_iter().find(|kind| kind.name() == name)
    }

    /// Which runs a curve of this force may drive, for headers and messages.
    pub fn drives(self) -> &'static str {
        match self {
            Self::Body => "single-mass bodies",
            Self::Contact => "bodies whose crush zone is a separate mass, not a single rigid mass",
        }
    }
}

/// Masses of a case: one body against a wall, or two bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Masses {
    /// Mass of the body, or of the first body of a pair, in kg.
    pub body_kg: f64,
    /// The other body of a pair; `None` against a rigid wall.
    pub other_kg: Option<f64>,
}

/// Whether a number of a case is above 0; what is wrong with it, if not.
pub(crate) fn above_0(what: &str, value: f64) -> Result<(), Error> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(error!(Other, "{what} is {value}: expected a finite number above 0"))
}

impl Masses {
    /// Whether both are above 0.
    pub(crate) fn check(&self) -> Result<(), Error> {
        above_0("the mass", self.body_kg)?;
        self.other_kg.map_or(Ok(()), |other| above_0("the mass of the other body", other))
    }

    /// The mass that moves along the deflection: the body's against a wall, the reduced
    /// mass `m_a m_b / (m_a + m_b)` of a pair.
    pub fn effective_kg(&self) -> f64 {
        match self.other_kg {
            Some(other) => self.body_kg * other / (self.body_kg + other),
            None => self.body_kg,
        }
    }

    /// The mass of a body against a wall, or of each of two equal ones with the same reduced mass.
    pub(crate) fn equal_kg(&self) -> f64 {
        self.other_kg.map_or(self.body_kg, |_| 2.0 * self.effective_kg())
    }

    /// Kinetic energy that a stop at a common velocity takes up, in J.
    pub(crate) fn kinetic_energy_j(&self, speed: Speed) -> f64 {
        0.5 * self.effective_kg() * speed.m_per_s * speed.m_per_s
    }
}

/// A file a case was made from, so that a curve can be traced to its bytes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SourceFile {
    /// As found from the manifest: `25kmh/nodout`.
    pub path: String,
    /// Where that was when the case was built: from the root on, as given, links not followed;
    /// `None` in databases before version 3.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub absolute_path: Option<String>,
    /// Size in bytes when it was read.
    pub size_bytes: u64,
    /// BLAKE3 hash of its bytes, in hexadecimal.
    pub blake3: String,
    /// Name of the file's format, such as `nodout`.
    pub format: String,
    /// Solver that wrote it, if the file states it.
    pub solver: Option<String>,
    /// Version of that solver, if the file states it.
    pub version: Option<String>,
    /// Title of the run, if the file has one.
    pub title: Option<String>,
    /// How many damaged places the reader found.
    pub problems: usize,
}

/// A further case parameter besides speed: a number whose name carries its unit
/// (`angle_deg`), or a category (`obstacle`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(untagged, expecting = "expected a number, or a text such as \"yes\"")]
pub enum Parameter {
    /// A number, in the unit that the parameter's name ends with.
    Number(f64),
    /// One of some names.
    Category(String),
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number}"),
            Self::Category(name) => f.write_str(name),
        }
    }
}

/// Energy of the loading branch against the kinetic energy it stopped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnergyAudit {
    /// `W`: integral of force over deflection up to the maximum deflection.
    pub work_j: f64,
    /// `E`: kinetic energy of the impact.
    pub kinetic_j: f64,
}

impl EnergyAudit {
    /// Imbalance over which a warning is due.
    pub(crate) const TOLERANCE: f64 = 0.05;

    /// `W/E`; 1 where the curve absorbs exactly the impact's energy.
    pub fn ratio(&self) -> f64 {
        self.work_j / self.kinetic_j
    }
}

/// What a case was built from, by the names in the manifest at that time: a case that was renamed
/// since, here or there, is recognised by it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Origin {
    /// Path of the study's manifest from the root on, as given.
    pub manifest: String,
    /// The study's group.
    pub group: String,
    /// Name of the run.
    pub run: String,
}

/// What a case is called: its name is unique in its group.
#[derive(Clone, Debug, PartialEq)]
pub struct CaseId {
    /// Name of the study that it comes from.
    pub study: String,
    /// Group of cases that differ in speed and parameters alone.
    pub group: String,
    /// Name of the case.
    pub name: String,
}

/// How the bodies of a case met.
#[derive(Clone, Debug, PartialEq)]
pub struct Conditions {
    /// Speed before contact, and what it is measured against.
    pub speed: Speed,
    /// The masses that meet.
    pub masses: Masses,
    /// What else distinguishes the case from others of its group, by name.
    pub parameters: BTreeMap<String, Parameter>,
}

/// What a case's run recorded, from contact on.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedCurves {
    /// Which force the curves hold.
    pub force_kind: ForceKind,
    /// At the common interval.
    pub sampled: Curve,
    /// Rate of the deflection at the sampled times, in m/s.
    pub closing_speed_m_per_s: Vec<f64>,
    /// At the solver's rate (filtered if the recipe says so).
    pub original: Curve,
    /// Solver's time of the first contact, in s; curves count from it.
    pub contact_time_s: f64,
    /// Secant of the unloading branch between 90 % and 10 % of its force, in N/m;
    /// `None` if the record ends before.
    pub unloading_stiffness_n_per_m: Option<f64>,
}

/// How far a case can be trusted.
#[derive(Clone, Debug, PartialEq)]
pub struct Quality {
    /// Work of the force against the kinetic energy.
    pub audit: EnergyAudit,
    /// What the extraction did beyond the manifest.
    pub notes: Vec<String>,
    /// What the user should check before trusting the case.
    pub warnings: Vec<String>,
}

/// Where a case comes from, and its tags and notes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Provenance {
    /// The recipe and the run's entry, as JSON.
    pub recipe: String,
    /// Hash over recipe, entry and sources: equal hashes need no new extraction.
    pub fingerprint: String,
    /// Files that it was made from.
    pub sources: Vec<SourceFile>,
    /// Wall-clock time of the solver for the run, in s, if the run's folder has it.
    pub solver_wall_time_s: Option<f64>,
    /// When it was built, in UTC (ISO 8601) (`2026-05-04T13:37:00Z`); `None` in databases
    /// before version 3.
    pub built_utc: Option<String>,
    /// What it was built from; `None` if from a file, and in databases before version 3.
    pub origin: Option<Origin>,
    /// Users' tags, in alphabetical order, each once.
    pub tags: Vec<String>,
    /// Users' notes, in their order.
    pub user_notes: Vec<String>,
}

/// One FE run as the database keeps it.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Study, group and name.
    pub id: CaseId,
    /// Speed, masses and parameters.
    pub conditions: Conditions,
    /// Force over deflection, sampled and as recorded.
    pub curves: RecordedCurves,
    /// Energy audit, notes and warnings.
    pub quality: Quality,
    /// Recipe, sources, history and labels.
    pub provenance: Provenance,
}

impl Case {
    /// Whether a database can keep it, and a model learn from it.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let (of, curves) = (&self.conditions, &self.curves);
        let finite = |what: &str, value: f64| match value.is_finite() {
            true => Ok(()),
            false => Err(error!(Other, "{what} is {value}: expected a finite number")),
        };
        let found = || {
            above_0("the speed", of.speed.m_per_s)?;
            of.masses.check()?;
            above_0("the kinetic energy", self.quality.audit.kinetic_j)?;
            finite("the work", self.quality.audit.work_j)?;
            finite("the time of contact", curves.contact_time_s)?;
            curves
                .unloading_stiffness_n_per_m
                .map_or(Ok(()), |k| finite("the unloading stiffness", k))?;
            for (name, parameter) in &of.parameters {
                if let Parameter::Number(number) = parameter {
                    finite(name, *number)?;
                }
            }
            let (speeds, times) = (&curves.closing_speed_m_per_s, curves.sampled.time_s().len());
            if speeds.len() != times {
                let speeds = speeds.len();
                return Err(error!(Other, "there are {speeds} closing speeds for {times} times"));
            }
            speeds.iter().try_for_each(|v| finite("a closing speed", *v))
        };
        found().map_err(|e| error!(Dataset, "case \"{}\": {e}", self.id.name))
    }

    /// The force that slows the body, at the sampled times, in N: its effective mass times its deceleration, filtered and
    /// scaled to the energy that it loses; of a table without times, its own force.
    pub fn body_force_n(&self) -> Vec<f64> {
        body::body_force_n(self)
    }

    /// The loading branch at the solver's rate, with its share of dropped samples.
    pub fn loading(&self) -> Result<loading::Loading, Error> {
        loading::loading_branch(&self.curves.original)
    }

    /// Index of the maximum deflection in the original curve.
    pub fn loading_end(&self) -> usize {
        loading::loading_end(&self.curves.original)
    }

    /// Units of the solver files, as the recipe has them; `None` in databases of earlier
    /// versions.
    pub(crate) fn units(&self) -> Option<UnitSystem> {
        let recipe: serde_json::Value = self.provenance.recipe.parse().ok()?;
        UnitSystem::parse(recipe.get("units")?.as_str()?).ok()
    }

    /// Whether its motion was made of its own force, as for an imported table without times: then
    /// that force is also the one that moves the body.
    pub(crate) fn moves_by_its_force(&self) -> bool {
        self.imported("moves_by_its_force")
    }

    /// Whether nothing but its contact force is known: its file has no times, and is said to hold that force.
    pub(crate) fn has_contact_alone(&self) -> bool {
        self.imported("contact_alone")
    }

    fn imported(&self, key: &str) -> bool {
        let recipe: Option<serde_json::Value> = self.provenance.recipe.parse().ok();
        recipe.is_some_and(|recipe| recipe["imported"][key] == true)
    }

    /// How pictures and tables call it: a curve from a file may be a test's.
    pub(crate) fn origin(&self) -> &'static str {
        if self.id.study == from_table::IMPORTED { "recorded" } else { "FE" }
    }

    /// Maximum deflection, in m.
    pub fn max_deflection_m(&self) -> f64 {
        self.curves.original.deflection_m[self.loading_end()]
    }

    /// Peak force of the original states, in N: contact or body force, as in the recipe.
    pub fn peak_force_n(&self) -> f64 {
        self.curves.original.force_n.iter().copied().fold(0.0, f64::max)
    }

    /// In what kind it differs from another, so that no model can be trained on both: of what, its own
    /// and the other's.
    pub(crate) fn other_kind(
        &self,
        other: &Self,
    ) -> Option<(&'static str, &'static str, &'static str)> {
        let (speed, force) = (self.conditions.speed.kind, self.curves.force_kind);
        if speed != other.conditions.speed.kind {
            Some(("speed", speed.name(), other.conditions.speed.kind.name()))
        } else {
            (force != other.curves.force_kind)
                .then(|| ("force", force.name(), other.curves.force_kind.name()))
        }
    }

    /// Whether the run ended before the bodies moved apart again.
    pub fn is_truncated(&self) -> bool {
        self.loading_end() + 1 == self.curves.original.time_s.len()
    }
}

impl Case {
    /// Hash over the recipe without names and paths, and over the bytes of the sources: equal for
    /// a run and for its case under an earlier name. `None` if the case is of no run.
    pub(crate) fn source_hash(&self) -> Option<String> {
        source_hash(
            &self.provenance.recipe,
            self.provenance.sources.iter().map(|source| source.blake3.as_str()),
        )
    }
}

/// The same for a run's recipe, as JSON, and the hashes of its files.
pub(crate) fn source_hash<'a>(
    recipe: &str,
    files: impl Iterator<Item = &'a str>,
) -> Option<String> {
    let mut recipe: serde_json::Value = recipe.parse().ok()?;
    let run = recipe.get_mut("run")?.as_object_mut()?;
    run.remove("path");
    run.remove("deck");
    let recipe = recipe.as_object_mut()?;
    recipe.remove("study");
    // Found in the deck where the manifest has none; the files agree.
    recipe.remove("units");
    let mut hash = blake3::Hasher::new();
    hash.update(serde_json::to_string(recipe).ok()?.as_bytes());
    for file in files.collect::<BTreeSet<_>>() {
        hash.update(file.as_bytes());
    }
    Some(hash.finalize().to_hex().to_string())
}
