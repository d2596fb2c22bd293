//! A proposed study: every value with its source.

use std::path::PathBuf;

use serde::Serialize;

use super::folders::LeftOut;
use super::recipe::Alternative;
use crate::curve::recipe::{DeflectionSource, Filter, ForceSource, Sampling};
use crate::study::StudyKind;
use crate::unit::UnitSystem;

/// A proposed study.
#[derive(Clone, Debug, Serialize)]
pub struct Proposal {
    /// Group of the curve database, and name of the study.
    pub(crate) group: Proposed<String>,
    pub(crate) units: Proposed<UnitSystem>,
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
    pub(crate) force_title: Option<String>,
    /// Whether the other side of the interface has the same force.
    pub(crate) other_side: bool,
    pub(crate) other_forces: Vec<Alternative>,
    pub(crate) filter: Proposed<Filter>,
    pub(crate) sampling: Proposed<Sampling>,
    /// In order of speed.
    pub(crate) runs: Vec<ProposedRun>,
    pub(crate) left_out: Vec<LeftOut>,
    /// What was chosen on the way.
    pub(crate) notes: Vec<String>,
    pub(crate) warnings: Vec<String>,
}

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
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) notes: Vec<String>,
}

impl Proposal {
    /// What is left to fill in before the study can be built.
    pub(crate) fn missing(&self) -> Vec<String> {
        let keys = ["units", "deflection", "force", "sampling"].map(String::from);
        let whys = [self.units.why(), self.deflection.why(), self.force.why(), self.sampling.why()];
        let mut all: Vec<(String, Option<&str>)> = keys.into_iter().zip(whys).collect();
        for run in &self.runs {
            all.push((format!("speed of {}", run.name), run.speed_m_per_s.why()));
            all.push((format!("mass of {}", run.name), run.mass_kg.why()));
            let other = run.other_mass_kg.as_ref().and_then(Proposed::why);
            all.push((format!("other_mass of {}", run.name), other));
        }
        all.into_iter().filter_map(|(key, why)| Some(format!("{key}: {}", why?))).collect()
    }
}

/// Where a value is from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Evidence {
    /// The caller gave it.
    Given,
    /// Found in a file.
    Read,
    /// It follows from what was read.
    Computed,
    /// It is the likely one of several.
    Guessed,
}

impl Evidence {
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Given => "given",
            Self::Read => "read",
            Self::Computed => "computed",
            Self::Guessed => "guessed",
        }
    }
}

/// A value of a proposal, or why there is none.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub(crate) enum Proposed<T> {
    Found {
        value: T,
        evidence: Evidence,
        /// What it was taken or made from.
        from: String,
    },
    /// It could not be determined: the user has to fill it in.
    Missing {
        /// Why not, and what to do.
        missing: String,
    },
}

impl<T> Proposed<T> {
    pub(super) fn found(value: T, evidence: Evidence, from: impl Into<String>) -> Self {
        Self::Found { value, evidence, from: from.into() }
    }

    pub(super) fn missing(why: impl Into<String>) -> Self {
        Self::Missing { missing: why.into() }
    }

    pub(crate) fn value(&self) -> Option<&T> {
        match self {
            Self::Found { value, .. } => Some(value),
            Self::Missing { .. } => None,
        }
    }

    fn why(&self) -> Option<&str> {
        match self {
            Self::Found { .. } => None,
            Self::Missing { missing } => Some(missing),
        }
    }
}

impl<T> std::fmt::Display for Proposed<T> {
    /// Where it is from: `read: …`, or `fill in: …`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Found { evidence, from, .. } => write!(f, "{}: {from}", evidence.word()),
            Self::Missing { missing } => write!(f, "fill in: {missing}"),
        }
    }
}
