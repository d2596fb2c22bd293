//! `crumple build`: from a study manifest to a curve database.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::build::{self, BuildReport, BuiltRun, RunOutcome};
use crate::curve::group as siblings;
use crate::database::CasePath;
use crate::error::error;
use crate::table::Table;
use crate::words::counted;

use super::arguments::named;
use super::db::{case_columns, case_row};
use super::output::{self, Bar};
use super::{CommandResult, Failure, GlobalOptions, Outcome, usage};

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
    /// Study (TOML), or a folder with a study.toml; study.toml if absent
    study: Option<PathBuf>,
    /// Database to write or to update; curves.h5 next to the study if absent
    #[arg(short, long, value_parser = named())]
    output: Option<PathBuf>,
    /// Build this run only, as a part of the work; may be repeated [default: all]
    #[arg(long)]
    run: Vec<String>,
}

/// Name of a study that is not named, and of a database that is not.
const STUDY: &str = "study.toml";
const DATABASE: &str = "curves.h5";
/// Endings of files that no database has.
const TEXTS: [&str; 5] = ["csv", "json", "toml", "txt", "model"];

impl Args {
    /// The study and the database.
    fn files(&self) -> Result<(PathBuf, PathBuf), Failure> {
        let study = match &self.study {
            Some(folder) if folder.is_dir() => {
                let study = folder.join(STUDY);
                if !study.is_file() {
                    let folder = folder.display();
                    return Err(error!(Study, "{folder}: this is a folder without a {STUDY}: give a study, or let crumple init {folder} -o {folder}/{STUDY} write one").into());
                }
                study
            }
            Some(study) => study.clone(),
            None if Path::new(STUDY).is_file() => STUDY.into(),
            None => {
                return usage(format!(
                    "there is no {STUDY} in this folder: name a study, or let crumple init write one"
                ));
            }
        };
        let output = self.output.clone().unwrap_or_else(|| study.with_file_name(DATABASE));
        let ending = output.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        let ending = ending.unwrap_or_default();
        if TEXTS.contains(&&*ending) {
            return usage(format!(
                "{}: the database is an HDF5 file, not .{ending}: name it .h5 (crumple export and crumple db show write curves as text)",
                output.display()
            ));
        }
        Ok((study, output))
    }
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let (study, output) = args.files()?;
    let bar = Bar::new(options, "reading runs");
    let done = AtomicUsize::new(0);
    let report = build::build_runs(&study, &output, &args.run, |name| {
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        bar.step(&format!("{} read, last {name}", counted(done, "run")));
    })?;
    drop(bar);
    let mut outcome = Outcome::Clean;
    let mut warnings = Vec::new();
    for run in &report.runs {
        if let (_, Some(error)) = outcome_of(run) {
            output::eprint_line(&format!("error: run {}: {error}", run.name));
            if let RunOutcome::Failed { reason, .. } = &run.outcome {
                output::eprint_excerpt(reason.place());
            }
            outcome = Outcome::Partly;
        }
        let own = report.case(run).into_iter().flat_map(|case| &case.quality.warnings);
        warnings.extend(own.map(|warning| format!("{}: {warning}", run.name)));
    }
    // What is unusual in a run compared with its group.
    let of_groups = report.groups().into_iter().map(|group| report.database.cases(group));
    let of_group: Vec<String> = of_groups
        .flat_map(siblings::remarks)
        .map(|(case, _, words)| format!("{case}: {words}"))
        .collect();
    let of_others = |what: String, other: &String| {
        format!(
            "{what}, built from {other}: both studies have one name and group; with another name in [study] of one of them a database keeps both"
        )
    };
    let gone = report.removed_of.as_ref();
    let gone =
        gone.map(|other| of_others(format!("removed {}", removed(&report).join(", ")), other));
    let mut by_manifest: BTreeMap<&String, Vec<&str>> = BTreeMap::new();
    for (name, other) in &report.replaced {
        by_manifest.entry(other).or_default().push(name);
    }
    let replaced = by_manifest.into_iter().map(|(other, names)| {
        of_others(format!("replaced {} and kept tags and notes", names.join(", ")), other)
    });
    let replaced: Vec<String> = replaced.collect();
    let of_others = gone.iter().chain(&replaced);
    outcome = outcome.max(options.warn_all(warnings.iter().chain(&of_group).chain(of_others)));
    let database = output.display().to_string();
    let runs = report.runs.iter().map(|run| {
        let (word, error) = outcome_of(run);
        document! {
            name: &run.name,
            outcome: word,
            error if_any: error,
            case if_any: report.case(run).map(case_row),
            renamed if_any: renamed(&report, run),
        }
    });
    let moved = report.moved.iter().map(|(from, to)| {
        document! { from: from.to_string(), to: to.to_string() }
    });
    let document = document! {
        database: &database,
        group: &report.group,
        runs: runs.collect::<Vec<_>>(),
        group_warnings if_any: &of_group,
        removed: removed(&report),
        moved if_any: moved.collect::<Vec<_>>(),
        earlier_groups if_any: &report.earlier,
    };
    options.show(&document, |out| print(out, &report, &database))?;
    Ok(outcome)
}

/// A note of more runs than these says how many they are, not which.
const MOST_NAMED: usize = 5;

/// What became of a run, in a word and in the sentence of its error.
fn outcome_of(run: &BuiltRun) -> (&'static str, Option<String>) {
    match &run.outcome {
        RunOutcome::Built => ("built", None),
        RunOutcome::Kept => ("unchanged", None),
        RunOutcome::Failed { reason, earlier_kept } => {
            let kept = if *earlier_kept { " (the case of an earlier build is kept)" } else { "" };
            ("failed", Some(format!("{reason}{kept}")))
        }
    }
}

/// Group and name of a run's case where the database has others than the manifest.
fn renamed(report: &BuildReport, run: &BuiltRun) -> Option<String> {
    let is_renamed = run.case.group != report.group || run.case.name != run.name;
    (is_renamed && report.case(run).is_some()).then(|| run.case.to_string())
}

/// Cases that were removed, with the name of their group where that is another one.
fn removed(report: &BuildReport) -> Vec<String> {
    let shown = |path: &CasePath| {
        if path.group == report.group { path.name.clone() } else { path.to_string() }
    };
    report.removed.iter().map(shown).collect()
}

fn print(out: &mut dyn Write, report: &BuildReport, database: &str) -> io::Result<()> {
    let runs = Table::of(&report.runs)
        .column("run", |run| format!("{} ({})", run.name, outcome_of(run).0));
    output::table(out, case_columns(runs, |run| report.case(run)))?;
    // What holds for many runs is said once.
    let (mut notes, mut runs_of) = (Vec::new(), BTreeMap::<&str, Vec<&str>>::new());
    for run in &report.runs {
        for note in report.case(run).into_iter().flat_map(|case| &case.quality.notes) {
            let runs = runs_of.entry(note).or_default();
            if runs.is_empty() {
                notes.push(note);
            }
            runs.push(&run.name);
        }
    }
    for note in notes {
        let runs = &runs_of[&**note];
        let named = match runs.len() {
            2 if report.runs.len() == 2 => "both runs".into(),
            all if all > 1 && all == report.runs.len() => format!("all {all} runs"),
            many if many > MOST_NAMED => format!("{many} of {} runs", report.runs.len()),
            _ => runs.join(", "),
        };
        writeln!(out, "note: {named}: {note}")?;
    }
    for name in removed(report) {
        writeln!(out, "note: {name}: no longer in the study, removed")?;
    }
    for run in &report.runs {
        if let Some(renamed) = renamed(report, run) {
            writeln!(out, "note: {}: called {renamed} in the database", run.name)?;
        }
    }
    for line in moved_lines(&report.moved) {
        writeln!(out, "note: {line}")?;
    }
    for group in &report.earlier {
        writeln!(
            out,
            "note: group {group} was built from an earlier version of this study and is kept: crumple db rm removes it"
        )?;
    }
    let mut groups = Vec::from_iter(report.groups());
    if groups.is_empty() {
        groups.push(&report.group);
    }
    let word = if groups.len() > 1 { "groups" } else { "group" };
    let done = if report.is_written { "wrote" } else { "nothing has changed in" };
    writeln!(out, "{done} {database} ({word} {})", groups.join(", "))
}

/// Says what has moved: a whole group in one line.
fn moved_lines(moved: &[(CasePath, CasePath)]) -> Vec<String> {
    let mut groups: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    let mut lines = Vec::new();
    for (from, to) in moved {
        if from.name == to.name {
            *groups.entry((&from.group, &to.group)).or_default() += 1;
        } else {
            lines.push(format!("{from}: renamed since it was built, now {to}"));
        }
    }
    let group = |((from, to), count): (&(&str, &str), &usize)| {
        let cases = counted(*count, "case");
        format!("group {from}: renamed since it was built, {cases} moved to {to}")
    };
    lines.extend(groups.iter().map(group));
    lines
}
