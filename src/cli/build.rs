//! `crumple build`: from a study manifest to a curve database.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::build::{self, BuildReport, BuiltRun, RunOutcome};
use crate::curve::group as siblings;
use crate::database::CasePath;
use crate::plural::counted;
use crate::unit::Shown;
use serde::Serialize;

use super::db::CaseRow;
use super::output;
use super::{CommandResult, Failure, GlobalOptions, Outcome, progress};

/// Read all runs of a study, extract their curves and write the database
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple build                                   # study.toml of this folder, to curves.h5
  crumple build study.toml -o curves.h5
  crumple build other-study.toml -o curves.h5     # adds a group
Only runs that changed since the last build are read again. A run that cannot be used is
reported and left out (exit code 1); the others are built. W/E is the work of a curve over the
energy of its impact: within 5 % of 1 is usual; more points to a wrong mass, speed or unit.")]
pub(super) struct Args {
    /// Study manifest (TOML); study.toml if absent
    study: Option<PathBuf>,
    /// Database to write or to update; curves.h5 next to the study if absent
    #[arg(short, long)]
    output: Option<PathBuf>,
}

/// Name of a study that is not named, and of a database that is not.
const STUDY: &str = "study.toml";
const DATABASE: &str = "curves.h5";

impl Args {
    /// The study and the database.
    fn files(&self) -> Result<(PathBuf, PathBuf), Failure> {
        let study = match &self.study {
            Some(study) => study.clone(),
            None if Path::new(STUDY).is_file() => STUDY.into(),
            None => {
                return Err(Failure::Usage(format!(
                    "there is no {STUDY} in this folder: name a study, or let crumple init write one"
                )));
            }
        };
        let output = self.output.clone().unwrap_or_else(|| study.with_file_name(DATABASE));
        Ok((study, output))
    }
}

#[derive(Serialize)]
struct Document {
    database: String,
    group: String,
    runs: Vec<RunReport>,
    /// What is unusual in a run compared with its group.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    group_warnings: Vec<String>,
    removed: Vec<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    moved: Vec<Moved>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    earlier_groups: Vec<String>,
}

/// A case that has another name or group than before.
#[derive(Serialize)]
struct Moved {
    from: String,
    to: String,
    #[serde(skip)]
    paths: (CasePath, CasePath),
}

#[derive(Serialize)]
struct RunReport {
    name: String,
    outcome: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    case: Option<CaseRow>,
    /// Group and name of the case where the database has others than the manifest.
    #[serde(skip_serializing_if = "Option::is_none")]
    renamed: Option<String>,
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let (study, output) = args.files()?;
    let bar = progress::Bar::new(options, "reading runs");
    let done = AtomicUsize::new(0);
    let report = build::build(&study, &output, |name| {
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        bar.step(&format!("{} read, last {name}", counted(done, "run")));
    });
    bar.end();
    let report = report?;
    let runs: Vec<RunReport> = report.runs.iter().map(|r| run_report(&report, r)).collect();
    let mut outcome = Outcome::Clean;
    for (run, built) in runs.iter().zip(&report.runs) {
        if let Some(error) = &run.error {
            output::say(&format!("error: run {}: {error}", run.name));
            if let RunOutcome::Failed { reason, .. } = &built.outcome {
                output::say_excerpt(reason.place());
            }
            outcome = Outcome::Partly;
        }
        for warning in run.case.iter().flat_map(|c| &c.warnings) {
            options.warn(&format!("{}: {warning}", run.name));
            if outcome == Outcome::Clean {
                outcome = Outcome::Warned;
            }
        }
    }
    let of_group = siblings::remarks(report.database.cases(&report.group));
    let of_group: Vec<String> =
        of_group.into_iter().map(|(case, _, words)| format!("{case}: {words}")).collect();
    for warning in &of_group {
        options.warn(warning);
        if outcome == Outcome::Clean {
            outcome = Outcome::Warned;
        }
    }
    let database = output.display().to_string();
    if options.json {
        output::print_json(&Document::of(report, database, runs, of_group))?;
    } else {
        options.print(|out| print(out, &Document::of(report, database, runs, of_group)))?;
    }
    Ok(outcome)
}

impl Document {
    fn of(
        report: BuildReport,
        database: String,
        runs: Vec<RunReport>,
        group_warnings: Vec<String>,
    ) -> Self {
        let shown = |path: &CasePath| {
            if path.group == report.group { path.name.clone() } else { path.to_string() }
        };
        let moved = |(from, to): &(CasePath, CasePath)| Moved {
            from: from.to_string(),
            to: to.to_string(),
            paths: (from.clone(), to.clone()),
        };
        Self {
            database,
            runs,
            group_warnings,
            removed: report.removed.iter().map(shown).collect(),
            moved: report.moved.iter().map(moved).collect(),
            earlier_groups: report.earlier,
            group: report.group,
        }
    }
}

fn print(out: &mut dyn Write, document: &Document) -> io::Result<()> {
    let Document { database, group, runs, removed, moved, earlier_groups, .. } = document;
    let heading: Vec<&str> = ["run"].into_iter().chain(CaseRow::HEADING).collect();
    let units = CaseRow::units(runs.iter().filter_map(|run| run.case.as_ref()));
    output::table(out, &heading, &runs.iter().map(|run| row(run, units)).collect::<Vec<_>>())?;
    for run in runs {
        for note in run.case.iter().flat_map(|c| &c.notes) {
            writeln!(out, "note: {}: {note}", run.name)?;
        }
    }
    for name in removed {
        writeln!(out, "note: {name}: no longer in the study, removed")?;
    }
    for run in runs {
        if let Some(renamed) = &run.renamed {
            writeln!(out, "note: {}: called {renamed} in the database", run.name)?;
        }
    }
    for line in moved_lines(moved) {
        writeln!(out, "note: {line}")?;
    }
    for group in earlier_groups {
        writeln!(
            out,
            "note: group {group} was built from an earlier version of this manifest and is kept: crumple db rm removes it"
        )?;
    }
    writeln!(out, "wrote {database} (group {group})")
}

/// Says what has moved: a whole group in one line.
fn moved_lines(moved: &[Moved]) -> Vec<String> {
    let mut groups: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    let mut lines = Vec::new();
    for Moved { paths: (from, to), .. } in moved {
        if from.name == to.name {
            *groups.entry((&from.group, &to.group)).or_default() += 1;
        } else {
            lines.push(format!("{from}: renamed since it was built, now {to}"));
        }
    }
    let group = |((from, to), count): (&(&str, &str), &usize)| {
        let cases = output::counted(*count, "case");
        format!("group {from}: renamed since it was built, {cases} moved to {to}")
    };
    lines.extend(groups.iter().map(group));
    lines
}

fn run_report(report: &BuildReport, run: &BuiltRun) -> RunReport {
    let (word, error) = match &run.outcome {
        RunOutcome::Built => ("built", None),
        RunOutcome::Kept => ("unchanged", None),
        RunOutcome::Failed { reason, earlier_kept } => {
            let kept = if *earlier_kept { " (the case of an earlier build is kept)" } else { "" };
            ("failed", Some(format!("{reason}{kept}")))
        }
    };
    let case = report.case(run).map(CaseRow::of);
    let is_renamed = run.case.group != report.group || run.case.name != run.name;
    let renamed = (is_renamed && case.is_some()).then(|| run.case.to_string());
    RunReport { name: run.name.clone(), outcome: word, error, case, renamed }
}

fn row(run: &RunReport, units: [Shown; 3]) -> Vec<String> {
    let cells = match &run.case {
        Some(case) => case.cells(units),
        None => CaseRow::HEADING.iter().map(|_| "-".to_string()).collect(),
    };
    [format!("{} ({})", run.name, run.outcome)].into_iter().chain(cells).collect()
}
