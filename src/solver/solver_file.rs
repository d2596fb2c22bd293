//! The result of reading a file.

use std::sync::Arc;

use serde::Serialize;

use super::Problem;
use crate::history::{EntityId, History};

/// An entity that has histories, with its title where the file's legend gives one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Entity {
    /// Id and side.
    #[serde(flatten)]
    pub id: EntityId,
    /// `None` where the file gives none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
}

/// An entity that the file names without giving it values.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WithoutData {
    /// As in the legend.
    pub id: i64,
    /// `None` where the legend gives none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
    /// Why it has no values.
    pub reason: NoDataReason,
}

/// Why an entity has no values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum NoDataReason {
    /// A single-surface contact: LS-DYNA prints that its resultants are undefined.
    SingleSurfaceContact,
    /// Named in the legend, but no state has a row of it.
    LegendOnly,
}

/// What a solver file holds: its own description, the selected histories, its damage.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SolverFile {
    /// Name of the format, one of [`FORMATS`](super::FORMATS).
    pub format: &'static str,
    /// Section of a binary file; of a text file its format's name.
    pub section: String,
    /// Name of the solver, if the file states it.
    pub solver: Option<String>,
    /// Version of the solver, if the file states it.
    pub version: Option<String>,
    /// Title of the run.
    pub title: Option<String>,
    /// In the order of the first state.
    pub entities: Vec<Entity>,
    /// Entities that are named without values.
    pub without_data: Vec<WithoutData>,
    /// All components of the file, selected or not.
    pub components: Vec<Arc<str>>,
    /// One time per complete state, in the solver's unit.
    pub time: Arc<[f64]>,
    /// The selected ones, entity by entity.
    pub histories: Vec<History>,
    /// Damage, in the order of the file.
    pub problems: Vec<Problem>,
    /// What was done to the file's values, such as differentiating impulses.
    pub notes: Vec<String>,
}

impl SolverFile {
    /// The history of `component` of `entity` (`None`: a global quantity).
    pub fn history(&self, entity: Option<EntityId>, component: &str) -> Option<&History> {
        self.histories.iter().find(|h| h.entity == entity && &*h.component == component)
    }
}
