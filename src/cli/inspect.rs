//! `crumple inspect`: what a solver file holds.

use std::io::{self, Write};
use std::path::PathBuf;

use crumple::solver::{self, Access, Entity, Problem, Selection, SolverFile, WithoutData};
use serde::Serialize;

use super::output;
use super::{CommandResult, Manners, Outcome};

/// Say what solver files hold: format, version, entities, components, states, damage
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple inspect run/nodout
  crumple inspect run/nodout run/rcforc --json
  crumple inspect --strict run/rwforc      # exit code 3 if the file is damaged")]
pub struct Args {
    /// Files written by a solver
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Kind of the files (nodout, rcforc, …), if their content does not tell
    #[arg(long)]
    format: Option<String>,
    /// Read through a memory map: faster, but only for files that nothing writes to
    #[arg(long)]
    map: bool,
}

#[derive(Serialize)]
struct Report<'a> {
    path: String,
    format: &'a str,
    /// Section of a binary file; absent for text.
    #[serde(skip_serializing_if = "Option::is_none")]
    section: Option<&'a str>,
    solver: Option<&'a str>,
    version: Option<&'a str>,
    title: Option<&'a str>,
    states: usize,
    /// First and last time in the solver's unit; absent if there is no state.
    time: Option<[f64; 2]>,
    entities: &'a [Entity],
    without_data: &'a [WithoutData],
    components: Vec<&'a str>,
    problems: &'a [Problem],
}

#[derive(Serialize)]
struct Document<'a> {
    files: Vec<Report<'a>>,
}

pub fn run(args: &Args, manners: Manners) -> CommandResult {
    let mut read = Vec::new();
    let mut outcome = Outcome::Clean;
    let access = if args.map { Access::Map } else { Access::Plain };
    let selection = Selection { access, ..Selection::nothing() };
    for path in &args.files {
        match solver::read_sections(path, args.format.as_deref(), &selection) {
            Ok(sections) => read.extend(sections.into_iter().map(|file| (path, file))),
            Err(error) if args.files.len() == 1 => return Err(error.into()),
            Err(error) => {
                eprintln!("error: {error}");
                outcome = Outcome::Partly;
            }
        }
    }
    if outcome == Outcome::Clean && read.iter().any(|(_, f)| !f.problems.is_empty()) {
        outcome = Outcome::Warned;
    }
    let files: Vec<Report> = read.iter().map(|(path, file)| report(path, file)).collect();
    if manners.json {
        output::print_json(&Document { files })?;
    } else {
        output::print(|out| files.iter().try_for_each(|file| print(out, file)))?;
    }
    Ok(outcome)
}

fn report<'a>(path: &std::path::Path, file: &'a SolverFile) -> Report<'a> {
    Report {
        path: path.display().to_string(),
        format: file.format,
        section: (file.section != file.format).then_some(file.section.as_str()),
        solver: file.solver.as_deref(),
        version: file.version.as_deref(),
        title: file.title.as_deref(),
        states: file.time.len(),
        time: file.time.first().zip(file.time.last()).map(|(&a, &b)| [a, b]),
        entities: &file.entities,
        without_data: &file.without_data,
        components: file.components.iter().map(|c| &**c).collect(),
        problems: &file.problems,
    }
}

/// Entities printed in full; of longer lists the rest is counted.
const SHOWN_ENTITIES: usize = 20;

fn print(out: &mut dyn Write, file: &Report<'_>) -> io::Result<()> {
    writeln!(out, "{}", file.path)?;
    match file.section {
        Some(section) => writeln!(out, "  format      {}, section {section}", file.format)?,
        None => writeln!(out, "  format      {}", file.format)?,
    }
    if let Some(solver) = file.solver {
        writeln!(out, "  solver      {solver} {}", file.version.unwrap_or_default())?;
    }
    writeln!(out, "  title       {}", file.title.unwrap_or("(none)"))?;
    match file.time {
        Some([first, last]) => {
            writeln!(out, "  states      {}, time {first:?} to {last:?}", file.states)?;
        }
        None => writeln!(out, "  states      0")?,
    }
    if !file.components.is_empty() {
        writeln!(out, "  components  {}", file.components.join(", "))?;
    }
    let titled = |title: &Option<String>| match title {
        Some(title) => format!("  {title}"),
        None => String::new(),
    };
    if !file.entities.is_empty() {
        writeln!(out, "  entities    {}", file.entities.len())?;
    }
    for entity in file.entities.iter().take(SHOWN_ENTITIES) {
        writeln!(out, "    {}{}", entity.id, titled(&entity.title))?;
    }
    if file.entities.len() > SHOWN_ENTITIES {
        let more = file.entities.len() - SHOWN_ENTITIES;
        writeln!(out, "    … and {more} more (--json lists all)")?;
    }
    for entity in file.without_data.iter().take(SHOWN_ENTITIES) {
        let reason = match entity.reason {
            solver::NoDataReason::SingleSurfaceContact => "single surface: resultants undefined",
            solver::NoDataReason::LegendOnly => "in the legend only",
        };
        writeln!(out, "    {}{}  ({reason})", entity.id, titled(&entity.title))?;
    }
    for problem in file.problems {
        writeln!(out, "  problem     {problem}")?;
    }
    Ok(())
}
