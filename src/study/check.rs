//! A study manifest as written, and its checks across several keys.

use std::collections::{BTreeMap, HashSet};

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

use crate::curve::Parameter;
use crate::curve::from_table::IMPORTED;
use crate::curve::recipe::{ForceSource, Recipe};
use crate::error::{Error, KeyPath, error};
use crate::unit::{
    ImpactSpeedText, InstantText, LengthText, MassText, SignedLengthText, UnitSystem,
};

pub(super) fn check(manifest: &Manifest) -> Result<(), Error> {
    let StudyHeader { name, group, kind, half_model, .. } = &manifest.study;
    check_name("study.name", name, true)?;
    // A build removes the cases of its study that it does not know.
    if name == IMPORTED {
        return Err(error!(
            Study at "study.name",
            "study.name = \"{IMPORTED}\" is the name of the curves that crumple db add takes from files: give the study another"
        ));
    }
    check_name("study.group", group, false)?;
    let minus_node = manifest.recipe.deflection.minus_node.is_some();
    match (kind, half_model, minus_node) {
        (StudyKind::Pair, false, false) => {
            return Err(error!(
                Study at "study.kind",
                "a pair needs the other body: deflection.minus_node = …, or half_model = true in [study] for one body against its symmetry plane"
            ));
        }
        (StudyKind::Pair, true, true) => {
            return Err(error!(
                Study at "study.half_model",
                "half_model = true doubles the deflection, but minus_node already makes it that of both bodies: keep one of them"
            ));
        }
        (StudyKind::Wall, true, _) => {
            return Err(error!(
                Study at "study.half_model",
                "half_model = true needs kind = \"pair\": a wall run has no symmetry plane"
            ));
        }
        _ => {}
    }
    if manifest.run.is_empty() {
        return Err(error!(Study at "run", "there is no [[run]]"));
    }
    check_contact(&manifest.recipe)?;
    let mut names = HashSet::new();
    for (k, run) in manifest.run.iter().enumerate() {
        let of_run = KeyPath::of("run").item(k);
        check_run(run, *kind, *half_model).map_err(|error| error.inside(of_run.clone()))?;
        let name = run.case_name();
        if !names.insert(name.clone()) {
            return Err(error!(
                Study at name_key(run),
                "two runs are named \"{name}\": give one of them a name = …"
            )
            .inside(of_run));
        }
    }
    Ok(())
}

fn check_contact(recipe: &Recipe) -> Result<(), Error> {
    if let Some(share) = recipe.contact_threshold.filter(|share| !(*share > 0.0 && *share < 1.0)) {
        return Err(error!(
            Study at "recipe.contact_threshold",
            "recipe.contact_threshold = {share} is not a fraction of the peak force: write a number above 0 and below 1, such as 0.005"
        ));
    }
    match (&recipe.contact, &recipe.force) {
        (Some(ForceSource::Body { .. }), _) => Err(error!(
            Study at "recipe.contact",
            "recipe.contact must be a contact force (id = … of a wall or contact): a body slows down after the first touch"
        )),
        (Some(_), ForceSource::Contact { .. }) => Err(error!(
            Study at "recipe.contact",
            "recipe.contact is for a body force: contact is found in recipe.force itself"
        )),
        _ => Ok(()),
    }
}

fn name_key(entry: &RunEntry) -> &'static str {
    if entry.name.is_some() { "name" } else { "path" }
}

/// Checks a run; keys are those of its table.
fn check_run(entry: &RunEntry, kind: StudyKind, half_model: bool) -> Result<(), Error> {
    check_parameters(entry)?;
    let run = &entry.path;
    if entry.contact_time.is_some() && entry.gap.is_some() {
        return Err(error!(
            Study at "gap",
            "run \"{run}\": contact_time and gap both say when contact begins: keep one of them"
        )
        .itself());
    }
    if run.trim().is_empty() {
        return Err(error!(Study at "path", "a [[run]] has an empty path"));
    }
    if kind == StudyKind::Wall && entry.other_mass.is_some() {
        return Err(error!(
            Study at "other_mass",
            "run \"{run}\": other_mass needs kind = \"pair\""
        )
        .itself());
    }
    if half_model && entry.other_mass.as_ref().is_some_and(|other| other.0 != entry.mass.0) {
        return Err(error!(
            Study at "other_mass",
            "run \"{run}\": the other body of a half model is its mirror image, of the same mass: remove other_mass"
        )
        .itself());
    }
    check_name("name", &entry.case_name(), false).map_err(|why| {
        let run = run.escape_debug();
        let why = match entry.name {
            Some(_) => format!(": {why}"),
            None => " gives no name for its case: add name = \"…\" to it".into(),
        };
        error!(Study at name_key(entry), "run \"{run}\"{why}")
    })
}

/// Names that the models use themselves.
const TAKEN: [&str; 4] = ["speed_m_per_s", "deflection_m", "mass_kg", "other_mass_kg"];

fn check_parameters(entry: &RunEntry) -> Result<(), Error> {
    for (name, value) in &entry.parameters {
        let at = KeyPath::of("parameters").key(name);
        let of = format!("run \"{}\": parameter \"{}\"", entry.path, name.escape_debug());
        if name.trim().is_empty() || name.contains(|c: char| c.is_control() || c == '=') {
            return Err(error!(Study, "{of} is not a name").at(at.itself()));
        }
        if TAKEN.contains(&name.as_str()) {
            return Err(
                error!(Study, "{of} has a key of its own: use speed or mass").at(at.itself())
            );
        }
        if matches!(value, Parameter::Number(v) if !v.is_finite()) {
            return Err(error!(Study, "{of} is not finite").at(at));
        }
    }
    Ok(())
}

/// Longest name, in bytes, as databases take it.
const MAX_NAME: usize = 200;

/// Names appear in files, tables and HDF5 paths.
fn check_name(key: &str, name: &str, slash: bool) -> Result<(), Error> {
    let shown = name.escape_debug();
    if name.trim().is_empty() || name == "." || name == ".." {
        return Err(error!(Study at key, "{key} = \"{shown}\" is not a name"));
    }
    if name.len() > MAX_NAME {
        let (begin, bytes) = (name.chars().take(20).collect::<String>(), name.len());
        return Err(error!(
            Study at key,
            "{key} = \"{}…\" has {bytes} bytes: expected at most {MAX_NAME}",
            begin.escape_debug()
        ));
    }
    if name.contains(|c: char| c.is_control() || (c == '/' && !slash)) {
        return Err(error!(
            Study at key,
            "{key} = \"{shown}\" may not contain \"/\" or control characters"
        ));
    }
    Ok(())
}

/// A study manifest as written (TOML).
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct Manifest {
    /// What all runs share.
    pub(crate) study: StudyHeader,
    /// How a curve is made from a run.
    pub recipe: Recipe,
    /// One entry per FE run.
    pub(crate) run: Vec<RunEntry>,
}

/// What all runs of a study share.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct StudyHeader {
    /// Name of the study.
    pub name: String,
    /// Units of the solver files: "SI", "mm-t-s", "kg-mm-ms", …; taken from the runs' decks
    /// if absent.
    #[cfg_attr(test, schemars(with = "Option<String>"))]
    pub units: Option<UnitSystem>,
    /// Group of the curve database.
    pub group: String,
    /// Kind of impact.
    pub kind: StudyKind,
    /// The pair is modelled as one body against its symmetry plane: closing speed and
    /// deflection are twice the run's.
    #[serde(default)]
    pub half_model: bool,
    /// Take runs whose energy or impulse is impossible for an impact (outside 0.67 to 1.5
    /// times that of mass and speed).
    #[serde(default)]
    pub accept_energy: bool,
}

/// Kind of impact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum StudyKind {
    /// A body against a rigid wall; speeds are wall speeds.
    Wall,
    /// Two bodies; speeds are closing speeds.
    Pair,
}

impl StudyKind {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Wall => "wall",
            Self::Pair => "pair",
        }
    }
}

/// One FE run.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct RunEntry {
    /// Folder with the solver files, relative to the manifest.
    pub path: String,
    /// Name of the case; the path if absent.
    pub name: Option<String>,
    /// Impact speed; taken from the deck or the first state if absent.
    pub speed: Option<ImpactSpeedText>,
    /// Keyword deck of the run, relative to the manifest; looked for in the run's folder if
    /// absent.
    pub deck: Option<String>,
    /// Mass of the body, or of each body of a pair.
    pub mass: MassText,
    /// Mass of the other body, if the bodies of a pair differ.
    pub other_mass: Option<MassText>,
    /// Solver's time at which contact begins; determined from the force if absent.
    pub contact_time: Option<InstantText>,
    /// Contact begins when the bodies have moved this far towards each other from the first
    /// state: the clear distance between their surfaces (between mid-surfaces of shells less
    /// half of each thickness).
    pub gap: Option<LengthText>,
    /// Deflection at contact: above 0 for a record that begins crushed, below 0 for slack that
    /// is not crush.
    pub offset: Option<SignedLengthText>,
    /// Solver's time after which the record is not used.
    pub truncate: Option<InstantText>,
    /// 1 or -1: the factor that makes the file's force positive in compression; found from its
    /// impulse if absent.
    #[serde(default, deserialize_with = "sign")]
    #[cfg_attr(test, schemars(with = "Option<i64>", extend("enum" = [1, -1])))]
    pub sign: Option<i64>,
    /// As in the study's head, for this run.
    pub accept_energy: Option<bool>,
    /// Further parameters of the case, the same names in every run: numbers whose names carry
    /// their units (`angle_deg = 10`), or categories (`obstacle = "pole"`).
    #[serde(default)]
    pub parameters: BTreeMap<String, Parameter>,
}

fn sign<'de, D: Deserializer<'de>>(value: D) -> Result<Option<i64>, D::Error> {
    match i64::deserialize(value)? {
        sign @ (1 | -1) => Ok(Some(sign)),
        found => Err(D::Error::custom(format!("sign = {found}: expected 1 or -1"))),
    }
}

impl RunEntry {
    pub(crate) fn case_name(&self) -> String {
        let name = self.name.as_deref().unwrap_or(&self.path);
        let name = name.trim_start_matches("./").trim_start_matches("../");
        name.trim_matches('/').replace('/', "_")
    }
}
