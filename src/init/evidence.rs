//! Where a proposed value is from.

use serde::Serialize;

/// Where a value is from, with what it was taken or made from.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "evidence", content = "from", rename_all = "snake_case")]
pub(crate) enum Evidence {
    /// The caller gave it.
    UserHints(String),
    /// It stands in a file.
    Read(String),
    /// It follows from what was read.
    Computed(String),
    /// It is the likely one of several.
    Guessed(String),
}

impl Evidence {
    /// `read`, `computed`, …: the word that stands for it in a proposal.
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
