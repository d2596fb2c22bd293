//! A study manifest as written.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

use crate::curve::Parameter;
use crate::curve::recipe::Recipe;
use crate::unit::{
    ImpactSpeedText, InstantText, LengthText, MassText, SignedLengthText, UnitSystem,
};

/// A study manifest as written (TOML).
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Manifest {
    /// What all runs share.
    pub(crate) study: StudyHeader,
    /// How a curve is made of a run.
    pub recipe: Recipe,
    /// One entry per FE run.
    pub(crate) run: Vec<RunEntry>,
}

/// What all runs of a study share.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct StudyHeader {
    /// Name of the study.
    pub name: String,
    /// Units of the solver files: "SI", "mm-t-s", "kg-mm-ms", …; taken from the runs' decks
    /// if absent.
    #[schemars(with = "Option<String>")]
    pub units: Option<UnitSystem>,
    /// Group of the curve database.
    pub group: String,
    /// Kind of impact.
    pub kind: StudyKind,
    /// The pair is modelled as one body against its symmetry plane: closing speed and
    /// deflection are twice the run's.
    #[serde(default)]
    pub half_model: bool,
    /// Take runs whose energy or impulse cannot be an impact's (0.67 to 1.5 of what mass and
    /// speed ask for).
    #[serde(default)]
    pub accept_energy: bool,
}

/// Kind of impact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
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
#[derive(Clone, Debug, Deserialize, JsonSchema)]
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
    /// Solver's time at which contact begins; found in the force if absent.
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
    #[schemars(with = "Option<i64>", extend("enum" = [1, -1]))]
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
        name.trim_start_matches("./").trim_matches('/').replace('/', "_")
    }
}
