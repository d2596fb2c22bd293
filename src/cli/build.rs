//! `crumple build`: from a study manifest to a curve database.

use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use crumple::build::{self, BuildReport, RunOutcome};
use serde::Serialize;

use super::db::CaseRow;
use super::output;
use super::{CommandResult, GlobalOptions, Outcome, progress};

/// Read all runs of a study, extract their curves and write the database
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple build study.toml -o curves.h5
  crumple build other-study.toml -o curves.h5     # adds a group
Only runs that changed since the last build are read again. A run that cannot be used is
reported and left out (exit code 1); the others are built.")]
pub struct Args {
    /// Study manifest (TOML)
    study: PathBuf,
    /// Database to write or to update
    #[arg(short, long)]
    output: PathBuf,
}

#[derive(Serialize)]
struct Document {
    database: String,
    group: String,
    runs: Vec<RunReport>,
    removed: Vec<String>,
}

#[derive(Serialize)]
struct RunReport {
    name: String,
    outcome: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    case: Option<CaseRow>,
}

pub fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let bar = progress::Bar::new(options, "reading runs");
    let done = AtomicUsize::new(0);
    let report = build::build(&args.study, &args.output, |name| {
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        bar.step(&format!("{done} runs read, last {name}"));
    });
    bar.end();
    let report = report?;
    let runs: Vec<RunReport> = report.runs.iter().map(|r| run_report(&report, r)).collect();
    let mut outcome = Outcome::Clean;
    for run in &runs {
        if let Some(error) = &run.error {
            output::say(&format!("error: run {}: {error}", run.name));
            outcome = Outcome::Partly;
        }
        for warning in run.case.iter().flat_map(|c| &c.warnings) {
            options.warn(&format!("{}: {warning}", run.name));
            if outcome == Outcome::Clean {
                outcome = Outcome::Warned;
            }
        }
    }
    if options.json {
        output::print_json(&Document {
            database: args.output.display().to_string(),
            group: report.group,
            runs,
            removed: report.removed,
        })?;
    } else {
        output::print(|out| {
            let rows: Vec<Vec<String>> = runs.iter().map(row).collect();
            let heading: Vec<&str> = ["run"].into_iter().chain(CaseRow::HEADING).collect();
            output::table(out, &heading, &rows)?;
            for run in &runs {
                for note in run.case.iter().flat_map(|c| &c.notes) {
                    writeln!(out, "note: {}: {note}", run.name)?;
                }
            }
            for name in &report.removed {
                writeln!(out, "note: {name}: no longer in the study, removed")?;
            }
            writeln!(out, "wrote {} (group {})", args.output.display(), report.group)
        })?;
    }
    Ok(outcome)
}

fn run_report(report: &BuildReport, (name, outcome): &(String, RunOutcome)) -> RunReport {
    let case = report.database.cases(&report.group).iter().find(|c| c.name == *name);
    let (word, error) = match outcome {
        RunOutcome::Built => ("built", None),
        RunOutcome::Kept => ("unchanged", None),
        RunOutcome::Failed { reason, earlier_kept } => {
            let kept = if *earlier_kept { " (the case of an earlier build is kept)" } else { "" };
            ("failed", Some(format!("{reason}{kept}")))
        }
    };
    RunReport { name: name.clone(), outcome: word, error, case: case.map(CaseRow::of) }
}

fn row(run: &RunReport) -> Vec<String> {
    let cells = match &run.case {
        Some(case) => case.cells(),
        None => CaseRow::HEADING.iter().map(|_| "-".to_string()).collect(),
    };
    [format!("{} ({})", run.name, run.outcome)].into_iter().chain(cells).collect()
}
