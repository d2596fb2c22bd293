//! `crumple db check`: every stored value checked against the others.

use std::path::Path;

use crate::database::check::{self, Checked};
use crate::plural::counted;

use super::{CommandResult, GlobalOptions, Outcome, output};

pub(super) fn run(path: &Path, options: GlobalOptions) -> CommandResult {
    let checked = check::check(path)?;
    let Checked { cases, findings } = &checked;
    if options.json {
        output::print_json(&checked)?;
    } else {
        options.print(|out| {
            for f in findings {
                writeln!(out, "{}/{}: {}", f.group, f.case, f.message)?;
            }
            let (cases, found) = (counted(*cases, "case"), counted(findings.len(), "finding"));
            writeln!(out, "{cases} checked, {found}")
        })?;
    }
    Ok(if findings.is_empty() { Outcome::Clean } else { Outcome::Warned })
}
