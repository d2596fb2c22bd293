//! A proposed study tried: what its build would refuse is left out before anybody meets it.

use std::path::Path;

use rayon::prelude::*;

use super::error::InitError;
use super::left_out::{LeftOut, Reason};
use super::proposal::Proposal;
use crate::study::{self, RunError};

/// Extracts every run of a complete proposal, and leaves out those that give no curve.
pub(super) fn leave_out_refused(proposal: &mut Proposal, path: &Path) -> Result<(), InitError> {
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
    match proposal.runs.is_empty() {
        true => Err(InitError::NoUsableRun {
            left_out: std::mem::take(&mut proposal.left_out),
            doubts: std::mem::take(&mut proposal.warnings),
        }),
        false => Ok(()),
    }
}
