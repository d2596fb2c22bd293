//! Why nothing was chosen or changed.

use crate::error::Error;
use std::path::PathBuf;

use crate::database::{CasePath, DatabaseError};

/// Why nothing was chosen or changed; the databases are as they were.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CurateError {
    /// A database cannot be read or written.
    #[error(transparent)]
    Database(#[from] DatabaseError),
    /// A room below says why.
    #[error(transparent)]
    Below(#[from] Error),
    /// No case has such a name.
    #[error("{path}: there is no case \"{name}\": there are {known}")]
    NoCase {
        /// The database.
        path: PathBuf,
        /// As asked for.
        name: String,
        /// The cases there are.
        known: String,
    },
    /// Several groups have a case of this name.
    #[error(
        "{path}: several groups have a case \"{name}\": choose one with --group, or write {known}"
    )]
    WhichCase {
        /// The database.
        path: PathBuf,
        /// As asked for.
        name: String,
        /// The cases of this name with their groups.
        known: String,
    },
    /// No case is chosen by speed, tag and names together.
    #[error("{path}: no case {asked}: there are {known}")]
    NoMatch {
        /// The database.
        path: PathBuf,
        /// What was asked for, in words.
        asked: String,
        /// The cases there are, with speeds and tags.
        known: String,
    },
    /// A name that none can have.
    #[error("\"{name}\" is no name of a {what}: {why}", name = name.escape_debug())]
    Name {
        /// `group` or `case`.
        what: &'static str,
        /// The name.
        name: String,
        /// Why not.
        why: &'static str,
    },
    /// The group that another is to be called is there.
    #[error(
        "{path}: there is a group \"{group}\" already: choose another name, or join them with crumple db copy --to-group"
    )]
    GroupTaken {
        /// The database.
        path: PathBuf,
        /// The group.
        group: String,
    },
    /// A text that is no tag or note.
    #[error("\"{text}\" is no {what}: {why}", text = text.escape_debug())]
    Label {
        /// `tag` or `note`.
        what: &'static str,
        /// The text.
        text: String,
        /// Why not.
        why: &'static str,
    },
    /// None of the chosen cases has what is to be taken away.
    #[error("{path}: none of the {count} chosen cases has the {what} \"{text}\": they have {known}", text = text.escape_debug())]
    NoLabel {
        /// The database.
        path: PathBuf,
        /// Number of cases.
        count: usize,
        /// `tag` or `note`.
        what: &'static str,
        /// The text.
        text: String,
        /// What they have instead.
        known: String,
    },
    /// Different cases would have one name.
    #[error(
        "{path}: other curves have these names already: {names}: rename the new ones with --rename, or take their place with --replace"
    )]
    Conflict {
        /// The database that the new cases are from.
        path: PathBuf,
        /// The names.
        names: String,
    },
    /// Cases of two kinds would be in one group.
    #[error(
        "{path}: {case} has a {found} {what}, {there} a {expected} {what}: no model can be trained on both: use another group"
    )]
    Kinds {
        /// The database that the new case is from.
        path: PathBuf,
        /// The new case.
        case: Box<CasePath>,
        /// `speed` or `force`.
        what: &'static str,
        /// Kind of the new case.
        found: &'static str,
        /// A case of the group.
        there: Box<CasePath>,
        /// Its kind.
        expected: &'static str,
    },
    /// The file that a merge would write over is none of those that it joins.
    #[error(
        "{path} is there already: name it among the databases that are joined, or write to another file"
    )]
    OutputExists {
        /// The file.
        path: PathBuf,
    },
    /// The place that cases are copied to is their own.
    #[error(
        "the copy of {case} would be {case} itself: choose another group (--to-group) or database (--to)"
    )]
    OwnPlace {
        /// The case.
        case: CasePath,
    },
}
