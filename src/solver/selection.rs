//! What is selected from a file (which entities, components, section), checked against its content, and the result of reading it.
//!
//! Errors name a key that callers can handle: `format` if no reader knows the file, `deck` for a
//! keyword deck, `ids[k]` and `component` for what was selected and is missing.

use std::path::Path;
use std::sync::Arc;

use serde::Serialize;

use super::detect::entity_word;
use super::{Access, Problem};
use crate::error::{Error, KeyPath, error};
use crate::guess;
use crate::history::{EntityId, History, Side};
use crate::order;

/// Which entity is wanted: an id, on both sides of an interface unless one is named.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WantedId {
    /// As in the file.
    pub id: i64,
    /// `None` for both sides.
    pub side: Option<Side>,
}

impl WantedId {
    pub(super) fn matches(&self, entity: EntityId) -> bool {
        self.id == entity.id && (self.side.is_none() || self.side == entity.side)
    }
}

impl std::fmt::Display for WantedId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { id, side } = *self;
        EntityId { id, side }.fmt(f)
    }
}

impl std::str::FromStr for WantedId {
    type Err = String;

    /// Reads `"900001"` or `"3:surfa"`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (id, side) = match text.split_once(':') {
            Some((id, side)) => (id, Some(side)),
            None => (text, None),
        };
        let parsed = id.trim().parse().ok().zip(match side {
            Some(side) => Side::parse(side).map(Some),
            None => Some(None),
        });
        parsed
            .map(|(id, side)| Self { id, side })
            .ok_or_else(|| format!("\"{text}\" is not an id: write for example 900001 or 3:surfa"))
    }
}

/// Which histories a reader keeps. `None` keeps all, an empty list none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    /// Entities; global quantities have none and are always kept.
    pub ids: Option<Vec<WantedId>>,
    /// Names as in binout, such as `x_displacement`.
    pub components: Option<Vec<String>>,
    /// Whether fields that are not kept are read as well, so that the problems of the
    /// whole file are found.
    pub audit: bool,
    /// Section of a binary file, such as `nodout` or `rwforc/forces`; `None` for all.
    pub section: Option<String>,
    /// How the file's bytes are read.
    pub access: Access,
}

impl Selection {
    /// Every history of the file.
    pub fn all() -> Self {
        Self::default()
    }

    /// No history: only what the file says of itself, and all its problems.
    pub fn nothing() -> Self {
        Self { ids: Some(Vec::new()), components: Some(Vec::new()), audit: true, ..Self::default() }
    }

    pub(super) fn wants(&self, entity: EntityId) -> bool {
        self.ids.as_ref().is_none_or(|ids| ids.iter().any(|id| id.matches(entity)))
    }

    pub(super) fn wants_component(&self, component: &str) -> bool {
        self.components.as_ref().is_none_or(|all| all.iter().any(|c| c == component))
    }
}

/// Checks every selected id and component against the file.
pub(super) fn check_selection(
    path: &Path,
    file: &SolverFile,
    selection: &Selection,
) -> Result<(), Error> {
    let (path, format) = (path.display(), &file.section);
    for (k, wanted) in selection.ids.iter().flatten().enumerate() {
        if file.entities.iter().any(|e| wanted.matches(e.id)) {
            continue;
        }
        let single_surface = file
            .without_data
            .iter()
            .any(|w| w.id == wanted.id && w.reason == NoDataReason::SingleSurfaceContact);
        let (id, near) = (wanted.id, near_ids(file, wanted.id));
        let missing = if single_surface {
            error!(
                SolverFile,
                "{path}: interface {id} is a single-surface contact, for which LS-DYNA prints no resultants: ask for a two-sided contact or a force transducer ({near})"
            )
        } else {
            error!(SolverFile, "{path}: {format} has no {} {wanted}: {near}", entity_word(format))
        };
        return Err(missing.at(KeyPath::of("ids").item(k)));
    }
    for wanted in selection.components.iter().flatten() {
        if !file.components.iter().any(|c| **c == **wanted) {
            let known = if file.components.is_empty() {
                "none, because the file holds no complete state".into()
            } else {
                file.components.join(", ")
            };
            return Err(no_component(path, format, wanted, &known));
        }
    }
    Ok(())
}

/// The error of a component that a file does not have.
pub(crate) fn no_component(
    path: impl std::fmt::Display,
    format: &str,
    component: &str,
    known: &str,
) -> Error {
    let hint = guess::hint(component, known);
    error!(SolverFile at "component", "{path}: {format} has no component \"{component}\": it has {known}{hint}")
}

/// The ids nearest to one that is missing, with titles: what the user may have meant.
fn near_ids(file: &SolverFile, id: i64) -> String {
    const SHOWN: usize = 8;
    if file.entities.is_empty() && file.time.is_empty() {
        return "it holds no complete state".into();
    }
    if file.entities.is_empty() {
        return "it holds no ids".into();
    }
    let mut entities: Vec<&Entity> = file.entities.iter().collect();
    order::sort_by_key(&mut entities, |e| (e.id.id.abs_diff(id), e.id));
    let shown: Vec<String> = entities
        .iter()
        .take(SHOWN)
        .map(|e| match &e.title {
            Some(title) => format!("{} \"{title}\"", e.id),
            None => e.id.to_string(),
        })
        .collect();
    let ids: Vec<String> = entities.iter().map(|e| e.id.to_string()).collect();
    let ids = ids.iter().map(String::as_str).filter(|known| *known != id.to_string());
    let guess = guess::nearest(&id.to_string(), ids);
    let guess = guess.map_or(String::new(), |guess| format!("; did you mean {guess}?"));
    let rest = file.entities.len().saturating_sub(SHOWN);
    if rest > 0 {
        format!("the nearest of its ids are {} and {rest} more{guess}", shown.join(", "))
    } else {
        format!("it has {}{guess}", shown.join(", "))
    }
}

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
    /// Name of the format, one of [`formats`](super::formats).
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

    /// Whether its forces are central differences of impulses: those of a T01, or of a text that says that it was made of one.
    pub(crate) fn differentiates_impulses(&self) -> bool {
        self.format == "t01" || self.version.as_ref().is_some_and(|v| v.contains("OpenRadioss"))
    }
}
