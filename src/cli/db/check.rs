//! `crumple db check`: every stored value checked against the others.

use std::path::Path;

use crate::database::check::{self, Checked};
use crate::plural::counted;

use super::{CommandResult, GlobalOptions, Outcome};

pub(super) fn run(path: &Path, options: GlobalOptions) -> CommandResult {
    let checked = check::check(path)?;
    let Checked { cases, findings } = &checked;
    options.show(&checked, |out| {
        for f in findings {
            writeln!(out, "{}/{}: {}", f.group, f.case, f.message)?;
        }
        let (cases, found) = (counted(*cases, "case"), counted(findings.len(), "finding"));
        writeln!(out, "{cases} checked, {found}")
    })?;
    Ok(Outcome::warned_if(!findings.is_empty()))
}
