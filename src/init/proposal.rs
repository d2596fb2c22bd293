//! A proposed study: every value with its source.

use std::path::PathBuf;

use serde::Serialize;

use super::agree::Alternative;
use super::folders::LeftOut;
use crate::curve::recipe::{DeflectionSource, Filter, ForceSource, Sampling};
use crate::study::StudyKind;
use crate::unit::UnitSystem;

/// A proposed study.
#[derive(Clone, Debug, Serialize)]
pub struct Proposal {
    /// Group of the curve database, and name of the study.
    pub(crate) group: Proposed<String>,
    /// Units of the solver files.
    pub(crate) units: Proposed<UnitSystem>,
    /// Kind of impact.
    pub(crate) kind: Proposed<StudyKind>,
    /// Whether the runs are of one body against the symmetry plane of a pair: only known if the
    /// caller says so.
    pub(crate) half_model: bool,
    pub(crate) deflection: Proposed<DeflectionSource>,
    /// Title of the node, then of the other body's.
    pub(crate) node_titles: Vec<Option<String>>,
    /// Nodes that could represent the same bodies, a list for each.
    pub(crate) other_nodes: Vec<Vec<Alternative>>,
    pub(crate) force: Proposed<ForceSource>,
    /// Title of the wall or interface.
    pub(crate) force_title: Option<String>,
    /// Whether the other side of the interface has the same force.
    pub(crate) other_side: bool,
    /// Forces that could be meant.
    pub(crate) other_forces: Vec<Alternative>,
    pub(crate) filter: Proposed<Filter>,
    /// Common times of the runs.
    pub(crate) sampling: Proposed<Sampling>,
    /// In order of speed.
    pub(crate) runs: Vec<ProposedRun>,
    pub(crate) left_out: Vec<LeftOut>,
    /// What was chosen on the way.
    pub(crate) notes: Vec<String>,
    /// What the user should check.
    pub(crate) warnings: Vec<String>,
}

/// A run of a proposed study.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct ProposedRun {
    pub(crate) folder: PathBuf,
    /// The folder as the study names it.
    pub(crate) path: String,
    pub(crate) name: String,
    /// Impact speed in m/s: of a pair the closing speed.
    pub(crate) speed_m_per_s: Proposed<f64>,
    /// Mass of the body, or of each body of a pair, in kg.
    pub(crate) mass_kg: Proposed<f64>,
    /// Mass of the other body in kg, where it is another.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) other_mass_kg: Option<Proposed<f64>>,
    /// Solver's time after which the record is not used, in s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) truncate_s: Option<Proposed<f64>>,
    /// Maximum crush in m, if the units are known: doubled for half a model.
    pub(crate) crush_m: Option<f64>,
    /// Whole states that motion and force both have.
    pub(crate) states: usize,
    /// Notes on its speed.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) notes: Vec<String>,
}

impl Proposal {
    /// What is left to fill in before the study can be built.
    pub(crate) fn missing(&self) -> Vec<String> {
        let mut missing = Vec::new();
        let mut add = |key: String, why: Option<&str>| {
            if let Some(why) = why {
                missing.push(format!("{key}: {why}"));
            }
        };
        add("units".into(), why(&self.units));
        add("deflection".into(), why(&self.deflection));
        add("force".into(), why(&self.force));
        add("sampling".into(), why(&self.sampling));
        for run in &self.runs {
            add(format!("speed of {}", run.name), why(&run.speed_m_per_s));
            add(format!("mass of {}", run.name), why(&run.mass_kg));
            let other = run.other_mass_kg.as_ref().and_then(why);
            add(format!("other_mass of {}", run.name), other);
        }
        missing
    }
}

fn why<T>(proposed: &Proposed<T>) -> Option<&str> {
    match proposed {
        Proposed::Found { .. } => None,
        Proposed::Missing { missing } => Some(missing),
    }
}

/// Where a value is from, with what it was taken or made from.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "evidence", content = "from", rename_all = "snake_case")]
pub(crate) enum Evidence {
    /// The caller gave it.
    UserHints(String),
    /// Found in a file.
    Read(String),
    /// It follows from what was read.
    Computed(String),
    /// It is the likely one of several.
    Guessed(String),
}

impl Evidence {
    /// `read`, `computed`, …: its word in a proposal.
    pub(crate) fn word(&self) -> &'static str {
        match self {
            Self::UserHints(_) => "given",
            Self::Read(_) => "read",
            Self::Computed(_) => "computed",
            Self::Guessed(_) => "guessed",
        }
    }

    /// What the value was taken or made from.
    pub(crate) fn from(&self) -> &str {
        let (Self::UserHints(from) | Self::Read(from) | Self::Computed(from) | Self::Guessed(from)) =
            self;
        from
    }
}

impl std::fmt::Display for Evidence {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.word(), self.from())
    }
}

/// A value of a proposal, or why there is none.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub(crate) enum Proposed<T> {
    Found {
        value: T,
        #[serde(flatten)]
        evidence: Evidence,
    },
    /// It could not be determined: the user has to fill it in.
    Missing {
        /// Why not, and what to do.
        missing: String,
    },
}

impl<T> Proposed<T> {
    pub(crate) fn value(&self) -> Option<&T> {
        match self {
            Self::Found { value, .. } => Some(value),
            Self::Missing { .. } => None,
        }
    }

    pub(super) fn found(value: T, evidence: Evidence) -> Self {
        Self::Found { value, evidence }
    }

    pub(super) fn missing(why: impl Into<String>) -> Self {
        Self::Missing { missing: why.into() }
    }
}

impl<T> std::fmt::Display for Proposed<T> {
    /// Where it is from: `read: …`, or `fill in: …`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Found { evidence, .. } => evidence.fmt(f),
            Self::Missing { missing } => write!(f, "fill in: {missing}"),
        }
    }
}
