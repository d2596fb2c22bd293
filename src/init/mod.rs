//! Proposals: a study from run folders, and a scenario from models, with where each value is from.
//!
//! Nothing is made up: a value is read, computed from what was read, or the likely one of several,
//! and says so; what cannot be found is left to fill in.

mod agree;
mod describe;
mod describe_runs;
mod evidence;
mod explain;
mod folders;
mod given;
mod left_out;
mod masses;
mod measure;
mod proposal;
mod propose;
mod record;
mod sampling;
mod scenario;
mod series;
mod sources;
mod survey;
mod text;
mod units;
mod write;

use crate::error::{Error, error};
use std::path::Path;

pub(crate) use evidence::Proposed;
pub(crate) use given::GivenForce;
pub use given::UserHints;
pub use left_out::LeftOut;
pub use proposal::Proposal;
pub(crate) use proposal::ProposedRun;
pub use propose::Request;
pub use propose::propose;
pub(crate) use scenario::ScenarioProposal;
pub(crate) use scenario::propose_scenario;

/// Refuses a file that is there already.
pub(crate) fn refuse_existing(path: &Path) -> Result<(), Error> {
    let is_there = std::fs::symlink_metadata(path)
        .is_ok_and(|meta| meta.is_file() || meta.is_dir() || meta.is_symlink());
    if is_there {
        Err(error!(
            Study,
            "{path} is there already, and nothing is written over it: name another with -o, or remove it",
            path = path.display()
        ))
    } else {
        Ok(())
    }
}
