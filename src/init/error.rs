//! Why nothing can be proposed: the folders that were left out, each with its reason.

use super::LeftOut;
use crate::error::{Error, error};

/// The error of folders without a usable run, and what may be the cause.
pub(super) fn no_usable_run(left_out: &[LeftOut], doubts: &[String]) -> Error {
    let doubts: String = doubts.iter().map(|d| format!("\n{d}")).collect();
    error!(Study, "no run can be used:\n{}{doubts}", listed(left_out))
}

/// Folders with their reasons, a line each.
pub(super) fn listed(left_out: &[LeftOut]) -> String {
    const SHOWN: usize = 20;
    let lines = left_out.iter().map(|l| format!("  {}: {}", l.path.display(), l.message));
    let mut shown: Vec<String> = lines.take(SHOWN).collect();
    if left_out.len() > SHOWN {
        shown.push(format!("  and {} more", left_out.len() - SHOWN));
    }
    shown.join("\n")
}
