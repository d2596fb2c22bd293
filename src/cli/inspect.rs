//! `crumple inspect`: what a solver file holds.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::error::Error;
use crate::solver::decks;
use crate::solver::lsdyna::deck::Deck;
use crate::solver::{self, Access, Entity, Problem, Selection, SolverFile, WithoutData};
use serde::Serialize;

use super::Failure;
use super::deck_report::DeckReport;
use super::output;
use super::{CommandResult, GlobalOptions, Outcome};
use crate::solver::decks::Search;
use crate::solver::runs::{output_files, run_folders};

/// Show what solver files hold: format, version, entities, components, states, damage
#[derive(clap::Args)]
#[command(after_help = "Titles missing from a file are taken from the keyword deck next to it.
Examples:
  crumple inspect run/nodout
  crumple inspect run/main.k               # what a deck says about its run
  crumple inspect runs                     # the files of every run below a folder
  crumple inspect run/nodout run/rcforc --json
  crumple inspect --strict run/rwforc      # exit code 3 if the file is damaged")]
pub(super) struct Args {
    /// Files written by a solver, run folders, or folders above them
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Kind of the files (nodout, rcforc, …), if not recognised by their content
    #[arg(long)]
    format: Option<String>,
    /// Read through a memory map: faster, but only for files that no process is writing to
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
    #[serde(skip_serializing_if = "<[String]>::is_empty")]
    notes: &'a [String],
    /// Deck that titles were taken from, or what a deck itself says.
    #[serde(skip_serializing_if = "Option::is_none")]
    deck: Option<DeckReport<'a>>,
}

#[derive(Serialize)]
struct Document<'a> {
    files: Vec<Report<'a>>,
}

/// One section of a file, or a deck.
enum Read {
    Section { file: Box<SolverFile>, titles_from: Option<(PathBuf, usize)> },
    Deck(Box<Deck>),
}

impl Read {
    fn problems(&self) -> &[Problem] {
        match self {
            Self::Section { file, .. } => &file.problems,
            Self::Deck(deck) => &deck.problems,
        }
    }
}

/// What was read of it: files with their sections, and what could not be read.
struct Inspected {
    /// The run's folder, if it was found by its folder.
    run: Option<PathBuf>,
    read: Vec<(PathBuf, Read)>,
    unread: Vec<Error>,
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let mut outcome = Outcome::Clean;
    let mut inspected = Vec::new();
    for asked in asked(&args.files)? {
        let one = inspect(asked, args);
        match (&one.run, &one.unread[..]) {
            (_, []) => {}
            (None, [error]) if args.files.len() > 1 => {
                output::say(&format!("error: {error}"));
                outcome = Outcome::Partly;
            }
            (None, _) => {
                if let Some(error) = one.unread.into_iter().next() {
                    return Err(error.into());
                }
                continue;
            }
            // A file of a run may only be named like a solver's.
            (Some(_), errors) => errors.iter().for_each(|error| options.warn(&error.to_string())),
        }
        inspected.push(one);
    }
    let is_damaged = |one: &Inspected| {
        one.run.is_some() && !one.unread.is_empty()
            || one.read.iter().any(|(_, read)| !read.problems().is_empty())
    };
    if outcome == Outcome::Clean && inspected.iter().any(is_damaged) {
        outcome = Outcome::Warned;
    }
    if options.json {
        let files = inspected.iter().flat_map(reports).collect();
        output::print_json(&Document { files })?;
    } else {
        options.print(|out| {
            inspected.iter().try_for_each(|one| match &one.run {
                None => reports(one).iter().try_for_each(|file| print(out, file)),
                Some(folder) => {
                    let rows: Vec<Vec<String>> = reports(one).iter().map(row).collect();
                    print_runs(out, folder, &rows)
                }
            })
        })?;
    }
    Ok(outcome)
}

fn inspect(asked: Asked, args: &Args) -> Inspected {
    let (run, files) = match asked {
        Asked::File(path) => (None, vec![path]),
        Asked::Run { folder, files } => (Some(folder), files),
    };
    let access = if args.map { Access::Map } else { Access::Plain };
    let selection = Selection { access, ..Selection::nothing() };
    let mut inspected = Inspected { run, read: Vec::new(), unread: Vec::new() };
    for path in files {
        match read(&path, args.format.as_deref(), &selection) {
            Ok(read) => inspected.read.extend(read.into_iter().map(|read| (path.clone(), read))),
            Err(error) => inspected.unread.push(error),
        }
    }
    inspected
}

/// The sections of a file, or the deck that it is.
fn read(path: &Path, format: Option<&str>, selection: &Selection) -> Result<Vec<Read>, Error> {
    let sections = match solver::read_sections(path, format, selection) {
        Ok(sections) => sections,
        Err(error) if error.is_about("deck") => {
            return Ok(vec![Read::Deck(Box::new(decks::read_deck(path)?))]);
        }
        Err(error) => return Err(error),
    };
    let deck = deck_for(path, &sections);
    let with_titles = |mut file: SolverFile| {
        let filled =
            deck.as_ref().map(|(from, deck)| (from.clone(), decks::fill_titles(&mut file, deck)));
        let titles_from = filled.filter(|(_, count)| *count > 0);
        Read::Section { file: Box::new(file), titles_from }
    };
    Ok(sections.into_iter().map(with_titles).collect())
}

fn reports(inspected: &Inspected) -> Vec<Report<'_>> {
    let read = inspected.read.iter();
    read.map(|(path, read)| match read {
        Read::Section { file, titles_from } => report(path, file, titles_from.as_ref()),
        Read::Deck(deck) => deck_report(path, deck),
    })
    .collect()
}

/// The deck next to a file, if an entity of the file lacks a title.
fn deck_for(path: &Path, sections: &[SolverFile]) -> Option<(PathBuf, Deck)> {
    let lacks = |file: &SolverFile| file.entities.iter().any(|e| e.title.is_none());
    if !sections.iter().any(lacks) {
        return None;
    }
    decks::deck_next_to(path)
}

fn deck_report<'a>(path: &Path, deck: &'a Deck) -> Report<'a> {
    Report {
        path: path.display().to_string(),
        format: "keyword",
        section: None,
        solver: Some("LS-DYNA"),
        version: None,
        title: deck.title.as_deref(),
        states: 0,
        time: None,
        entities: &[],
        without_data: &[],
        components: Vec::new(),
        problems: &deck.problems,
        notes: &[],
        deck: Some(DeckReport::of(deck)),
    }
}

fn report<'a>(
    path: &Path,
    file: &'a SolverFile,
    titles_from: Option<&'a (PathBuf, usize)>,
) -> Report<'a> {
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
        notes: &file.notes,
        deck: titles_from.map(|(path, count)| DeckReport::titles(path, *count)),
    }
}

/// Entities printed in full; of longer lists the rest is counted.
const SHOWN_ENTITIES: usize = 20;

/// A section in one line, as [`HEADING`] has it.
fn row(file: &Report<'_>) -> Vec<String> {
    let name = Path::new(&file.path).file_name();
    let times = file.time.map_or(["-".into(), "-".into()], |time| time.map(|t| format!("{t:?}")));
    let [first, last] = times;
    vec![
        name.map_or(String::new(), |name| name.to_string_lossy().into_owned()),
        file.section.unwrap_or(file.format).into(),
        file.states.to_string(),
        first,
        last,
        file.entities.len().to_string(),
        file.problems.len().to_string(),
    ]
}

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
    if let Some(deck) = &file.deck {
        deck.print(out)?;
    }
    match file.time {
        _ if file.format == "keyword" => {}
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
    for note in file.notes {
        writeln!(out, "  note        {note}")?;
    }
    for problem in file.problems {
        writeln!(out, "  problem     {problem}")?;
    }
    Ok(())
}

/// What is to be inspected: a file that was named, or the files of a run that was found.
pub(super) enum Asked {
    File(PathBuf),
    Run { folder: PathBuf, files: Vec<PathBuf> },
}

/// The files that were named, and those of every run at or below the folders that were.
pub(super) fn asked(paths: &[PathBuf]) -> Result<Vec<Asked>, Failure> {
    let mut asked = Vec::new();
    for path in paths {
        if !path.is_dir() {
            asked.push(Asked::File(path.clone()));
            continue;
        }
        let failed = |e| Failure::Failed(format!("{}: {e}", path.display()).into());
        let found = run_folders(path).map_err(failed)?;
        if found.runs.is_empty() {
            let message = format!("{}: none of its folders holds solver files", path.display());
            return Err(Failure::Failed(message.into()));
        }
        for folder in found.runs {
            let mut files = output_files(&folder).map_err(failed)?;
            files.extend(match decks::find(&folder).map_err(failed)? {
                Search::None => Vec::new(),
                Search::One(deck) => vec![deck],
                Search::Several(decks) => decks,
            });
            asked.push(Asked::Run { folder, files });
        }
    }
    Ok(asked)
}

/// Columns of a run's table.
pub(super) const HEADING: [&str; 7] =
    ["file", "holds", "states", "first time", "last", "entities", "problems"];

/// A run's files, a line for each section.
fn print_runs(out: &mut dyn Write, folder: &Path, rows: &[Vec<String>]) -> io::Result<()> {
    writeln!(out, "{}", folder.display())?;
    output::table(out, &HEADING, rows)
}
