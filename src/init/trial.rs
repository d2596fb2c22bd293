//! A proposed study tried: what its build would refuse is left out before anybody meets it.

use super::error::no_usable_run;
use crate::error::Error;
use std::path::Path;

use super::left_out::{LeftOut, Reason};
use super::proposal::Proposal;
use crate::study::{self, RunError};
use rayon::prelude::*;

/// Extracts every run of a complete proposal, and leaves out those that give no curve.
pub(super) fn leave_out_refused(proposal: &mut Proposal, path: &Path) -> Result<(), Error> {
    if !proposal.missing().is_empty() {
        return Ok(());
    }
    let study = study::parse(path, &proposal.to_toml())?;
    let refused: Vec<Option<RunError>> = study
        .runs()
        .par_iter()
        .map(|entry| study.locate(entry).and_then(|run| run.extract()).err())
        .collect();
    let runs = std::mem::take(&mut proposal.runs);
    for (run, refused) in runs.into_iter().zip(refused) {
        match refused {
            None => proposal.runs.push(run),
            Some(error) => {
                let reason = Reason::Refused { why: error.to_string() };
                let mut out = LeftOut::new(run.folder, reason);
                out.entry = Some(run.path);
                proposal.left_out.push(out);
            }
        }
    }
    if proposal.runs.is_empty() {
        Err(no_usable_run(&proposal.left_out, &proposal.warnings))
    } else {
        Ok(())
    }
}
