//! Proposals: a study from run folders, and a scenario from models, with the source of each value.
//!
//! Nothing is invented: a value is read, computed from what was read, or the most likely of several,
//! and says so; unknown values are left to fill in.

mod describe;
mod folders;
mod measure;
mod propose;
mod recipe;
mod record;
mod scenario;
mod sources;
mod survey;
mod units;
mod write;

use std::path::Path;
use std::str::FromStr;

use self::sources::FORCES;
use crate::error::{Error, error};
use crate::file;
use crate::history::Side;
use crate::study::StudyKind;
use crate::unit::UnitSystem;
pub(crate) use propose::propose;
pub(crate) use scenario::propose_scenario;
pub(crate) use write::Proposal;
pub(crate) use write::Proposed;

/// No study is longer.
const MOST_BYTES: u64 = 16 << 20;

/// Refuses a path where something is; with `overwrite` all but what init writes there, a study or a scenario.
pub(crate) fn refuse_existing(
    path: &Path,
    overwrite: bool,
    is_scenario: bool,
) -> Result<(), Error> {
    let Ok(there) = std::fs::symlink_metadata(path) else { return Ok(()) };
    let (what, table) = if is_scenario { ("a scenario", "train") } else { ("a study", "study") };
    let is_toml = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    let has_table = |text: String| {
        let heads = [format!("[{table}]"), format!("[[{table}]]"), format!("{table} =")];
        // What holds nothing is nobody's.
        let text = text.trim_start_matches('\u{feff}');
        let mut lines = text.lines().map(str::trim_start).filter(|line| !line.starts_with('#'));
        text.trim().is_empty() || lines.any(|line| heads.iter().any(|head| line.starts_with(head)))
    };
    let is_text = || file::read_text(path, MOST_BYTES).is_ok_and(has_table);
    let is_ours = there.is_file() && is_toml && is_text();
    let path = path.display();
    match (is_ours, overwrite) {
        (true, true) => Ok(()),
        (true, false) => Err(error!(
            Study,
            "{path} exists already and is not overwritten: name another with -o, or replace it with --overwrite"
        )),
        (false, _) => Err(error!(
            Study,
            "{path} exists already and is not {what}, which init writes: name another with -o"
        )),
    }
}

/// What the caller already knows; it overrides what is found.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct UserHints {
    /// Units of the solver files.
    pub units: Option<UnitSystem>,
    /// Kind of impact.
    pub(crate) kind: Option<StudyKind>,
    /// The runs model one body of a pair, cut at the symmetry plane.
    pub half_model: bool,
    /// Node of the (moving) body.
    pub node: Option<i64>,
    /// Node of the other body of a pair.
    pub minus_node: Option<i64>,
    pub(crate) force: Option<GivenForce>,
    /// Mass of the body, in kg.
    pub mass_kg: Option<f64>,
    /// Mass of the other body of a pair, in kg.
    pub other_mass_kg: Option<f64>,
    /// Group of the curve database; it says as well that all runs belong to one group.
    pub group: Option<String>,
}

/// A force as `FILE:ID[+ID…][:SIDE][:COMPONENT]`, such as `rcforc:3:surfa` or, of two walls together, `rwforc:1+2`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct GivenForce {
    /// One of `rwforc`, `rcforc`, `secforc`, `rbdout`.
    pub(crate) file: String,
    /// Numbers of the walls, interfaces or sections, each once.
    pub(crate) ids: Vec<i64>,
    pub(crate) side: Option<Side>,
    /// Such as `normal_force`.
    pub(crate) component: Option<String>,
}

impl FromStr for GivenForce {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let wrong = || {
            error!(
                Usage,
                "\"{text}\" is not a force: write FILE:ID[:SIDE][:COMPONENT] with a file of {}, such as rwforc:1 or rcforc:3:surfa:x_force; for the sum of several FILE:ID+ID",
                FORCES.join(", ")
            )
        };
        let mut parts = text.split(':');
        let file = parts.next().filter(|file| FORCES.contains(file)).ok_or_else(wrong)?;
        let ids = parts.next().unwrap_or_default().split('+').map(str::parse);
        let ids: Vec<i64> = ids.collect::<Result<_, _>>().map_err(|_| wrong())?;
        if (1..ids.len()).any(|k| ids[..k].contains(&ids[k])) {
            return Err(wrong());
        }
        let mut given = Self { file: file.into(), ids, side: None, component: None };
        for part in parts {
            match Side::parse(part) {
                Some(side) if given.side.is_none() && given.component.is_none() => {
                    given.side = Some(side);
                }
                None if given.component.is_none() && part.ends_with("_force") => {
                    given.component = Some(part.into());
                }
                _ => return Err(wrong()),
            }
        }
        Ok(given)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_are_read() {
        let force: GivenForce = "rcforc:3:slave:x_force".parse().unwrap();
        assert_eq!(
            (&*force.file, &force.ids[..], force.side),
            ("rcforc", &[3][..], Some(Side::SurfA))
        );
        assert_eq!(force.component.as_deref(), Some("x_force"));
        assert_eq!("rwforc:1".parse::<GivenForce>().unwrap().component, None);
        assert_eq!("rwforc:1+2".parse::<GivenForce>().unwrap().ids, [1, 2]);
        let wrong = [
            "rwforc",
            "nodout:1",
            "rcforc:x",
            "rcforc:3:left",
            "rcforc:3:x_force:surfa",
            "",
            "rwforc:1+1",
            "rwforc:1+",
        ];
        for wrong in wrong {
            assert!(wrong.parse::<GivenForce>().is_err(), "{wrong}");
        }
    }
}
