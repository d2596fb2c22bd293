//! Why nothing was added.

use crate::error::Error;
use std::path::PathBuf;

use crate::curve::ForceKind;
use crate::curve::from_table::FromTableError;
use crate::formats::read::ReadCurveError;

/// Why nothing was added.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ImportError {
    /// A file is no curve.
    #[error(transparent)]
    Read(#[from] ReadCurveError),
    /// A curve is not that of the impact.
    #[error("{path}: {source}")]
    Table {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: FromTableError,
    },
    /// Something is neither in the file nor said beside it.
    #[error("{path}: the file does not say {what}: give {option}")]
    Missing {
        /// The file.
        path: PathBuf,
        /// What is missing.
        what: &'static str,
        /// How to say it.
        option: &'static str,
    },
    /// A value of the file is no such quantity.
    #[error("{path}: its {what} is {value}: expected more than 0")]
    NotPositive {
        /// The file.
        path: PathBuf,
        /// Speed or mass.
        what: &'static str,
        /// As read.
        value: f64,
    },
    /// The file says another force than was asked for.
    #[error("{path}: the file holds the {} force, not the {}: remove --force", .found.name(), .asked.name())]
    OtherForce {
        /// The file.
        path: PathBuf,
        /// As the file says.
        found: ForceKind,
        /// As was asked for.
        asked: ForceKind,
    },
    /// The mass of another body where there is none.
    #[error("{path}: a wall has no mass: remove --other-mass, or say --kind closing")]
    MassOfWall {
        /// The file.
        path: PathBuf,
    },
    /// The group has speeds or forces of another kind.
    #[error(
        "{path}: this curve has a {found} {what}, the cases of group \"{group}\" have a {there} one: no model can be trained on both; give another --group"
    )]
    OtherKind {
        /// The file.
        path: PathBuf,
        /// Speed or force.
        what: &'static str,
        /// The curve's.
        found: &'static str,
        /// The group's.
        there: &'static str,
        /// The group.
        group: String,
    },
    /// A name that cannot stand in a database.
    #[error("{path}: \"{name}\" cannot be the name of a {what}: {why}", name = name.escape_debug())]
    Name {
        /// The file.
        path: PathBuf,
        /// Group or case.
        what: &'static str,
        /// The name.
        name: String,
        /// Why not, and what to do.
        why: &'static str,
    },
    /// Two files with one name.
    #[error("{first} and {second} would both be case \"{name}\": name them with --case")]
    SameName {
        /// One file.
        first: PathBuf,
        /// The other.
        second: PathBuf,
        /// Their name.
        name: String,
    },
    /// There is such a case.
    #[error(
        "{path}: group \"{group}\" has a case \"{name}\" already: replace it with --replace, or give another name with --case"
    )]
    Taken {
        /// The file.
        path: PathBuf,
        /// The group.
        group: String,
        /// The name.
        name: String,
    },
    /// There is such a case of a study.
    #[error(
        "{path}: case \"{name}\" of group \"{group}\" is of the study \"{study}\", which builds it: give another name with --case"
    )]
    OfStudy {
        /// The file.
        path: PathBuf,
        /// The group.
        group: String,
        /// The name.
        name: String,
        /// The study.
        study: String,
    },
    /// A room below says why.
    #[error(transparent)]
    Below(#[from] Error),
}
