//! What is selected from a file: which entities, which components, which section.

use super::Access;
use crate::history::{EntityId, Side};

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
