//! `crumple inspect`: what a solver file, a deck or a file of crumple holds.

use std::fmt::Display;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::arguments::FileKind;
use super::{CommandResult, Failure, GlobalOptions, Outcome, failed_at, output};
use crate::database;
use crate::error::{Error, error};
use crate::solver::decks::{self, Search};
use crate::solver::lsdyna::deck::{Deck, DeckEntity};
use crate::solver::runs::{is_named_like_output, output_files, renamed_files, run_folders};
use crate::solver::{self, Access, Selection, SolverFile, Value};
use crate::table::Table;

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

/// One section of a file, or a deck, which has no states.
struct Section {
    path: PathBuf,
    file: SolverFile,
    /// Deck that titles were taken from, and how many.
    titles_from: Option<(PathBuf, usize)>,
    deck: Option<Deck>,
}

/// What was read: sections, and what could not be read.
struct Inspected {
    /// The run's folder, if it was found by its folder.
    run: Option<PathBuf>,
    sections: Vec<Section>,
    unread: Vec<Error>,
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let mut outcome = Outcome::Clean;
    let mut inspected = Vec::new();
    for (run, files) in asked(&args.files)? {
        let one = inspect(run, files, args);
        match (&one.run, &one.unread[..]) {
            (_, []) => {}
            (None, [error]) if args.files.len() > 1 => {
                output::eprint_line(&format!("error: {error}"));
                outcome = Outcome::Partly;
            }
            (None, _) => {
                if let Some(error) = one.unread.into_iter().next() {
                    return Err(error.into());
                }
                continue;
            }
            // A file of a run may only be named like a solver's.
            (Some(_), errors) => _ = options.warn_all(errors),
        }
        inspected.push(one);
    }
    let is_damaged = |one: &Inspected| {
        one.run.is_some() && !one.unread.is_empty()
            || one.sections.iter().any(|section| !section.file.problems.is_empty())
    };
    outcome = outcome.max(Outcome::warned_if(inspected.iter().any(is_damaged)));
    let files = inspected.iter().flat_map(|one| one.sections.iter().map(document));
    options.show(&document! { files: files.collect::<Vec<_>>() }, |out| {
        inspected.iter().try_for_each(|one| match &one.run {
            None => one.sections.iter().try_for_each(|section| print(out, section)),
            Some(folder) => {
                writeln!(out, "{}", folder.display())?;
                output::table(out, table(&one.sections))?;
                let renamed = renamed(folder);
                match renamed.is_empty() {
                    true => Ok(()),
                    false => writeln!(out, "not read, by their names: {}", renamed.join(", ")),
                }
            }
        })
    })?;
    Ok(outcome)
}

fn inspect(run: Option<PathBuf>, files: Vec<PathBuf>, args: &Args) -> Inspected {
    let access = if args.map { Access::Map } else { Access::Plain };
    let selection = Selection { access, ..Selection::nothing() };
    let mut inspected = Inspected { run, sections: Vec::new(), unread: Vec::new() };
    for path in files {
        match read(&path, args.format.as_deref(), &selection) {
            Ok(sections) => inspected.sections.extend(sections),
            Err(error) => inspected.unread.push(of_crumple(&path).unwrap_or(error)),
        }
    }
    inspected
}

/// That a file is one of crumple's own, if it is, and what shows it.
fn of_crumple(path: &Path) -> Option<Error> {
    let what = match FileKind::of(path).ok()? {
        FileKind::Database if database::is_database(path) => {
            "a curve database: crumple db ls lists its cases, crumple plot draws them"
        }
        FileKind::Model => "a model: crumple predict takes it, crumple plot draws it",
        FileKind::Sweep => "the results of a sweep: crumple plot draws them",
        FileKind::Result => {
            "a table over time, as crumple simulate writes it: crumple plot draws such results, crumple rate compares two"
        }
        _ => return None,
    };
    Some(error!(SolverFile, "{path}: this is {what}", path = path.display()))
}

/// The sections of a file, or the deck that it is.
fn read(path: &Path, format: Option<&str>, selection: &Selection) -> Result<Vec<Section>, Error> {
    let sections = match solver::read_sections(path, format, selection) {
        Ok(sections) => sections,
        Err(error) if error.is_about("deck") => {
            let deck = decks::read_deck(path)?;
            let (format, solver) =
                if deck.is_starter { ("starter", "OpenRadioss") } else { ("keyword", "LS-DYNA") };
            let file = SolverFile {
                format,
                section: format.into(),
                solver: Some(solver.into()),
                title: deck.title.clone(),
                problems: deck.problems.clone(),
                ..SolverFile::default()
            };
            let (path, deck) = (path.into(), Some(deck));
            return Ok(vec![Section { path, file, titles_from: None, deck }]);
        }
        Err(error) => return Err(error),
    };
    let deck = deck_for(path, &sections);
    let with_titles = |mut file: SolverFile| {
        let filled =
            deck.as_ref().map(|(from, deck)| (from.clone(), decks::fill_titles(&mut file, deck)));
        let titles_from = filled.filter(|(_, count)| *count > 0);
        Section { path: path.into(), file, titles_from, deck: None }
    };
    Ok(sections.into_iter().map(with_titles).collect())
}

/// The deck next to a file, if an entity of the file lacks a title.
fn deck_for(path: &Path, sections: &[SolverFile]) -> Option<(PathBuf, Deck)> {
    let lacks = |file: &SolverFile| file.entities.iter().any(|e| e.title.is_none());
    if !sections.iter().any(lacks) {
        return None;
    }
    decks::deck_next_to(path)
}

impl Section {
    /// Section of a binary file; absent for text.
    fn name(&self) -> Option<&str> {
        (self.file.section != self.file.format).then_some(self.file.section.as_str())
    }

    /// First and last time in the solver's unit; absent if there is no state.
    fn times(&self) -> Option<[f64; 2]> {
        let time = &self.file.time;
        time.first().zip(time.last()).map(|(&first, &last)| [first, last])
    }
}

fn document(section: &Section) -> impl Serialize {
    let file = &section.file;
    document! {
        path: section.path.display().to_string(),
        format: file.format,
        section if_any: section.name(),
        solver: &file.solver,
        version: &file.version,
        title: &file.title,
        states: file.time.len(),
        time: section.times(),
        entities: &file.entities,
        without_data: &file.without_data,
        components: file.components.iter().map(|c| &**c).collect::<Vec<_>>(),
        problems: &file.problems,
        notes if_any: &file.notes,
        deck if_any: deck_document(section.titles_from.as_ref(), section.deck.as_ref()),
    }
}

/// A run's files, a line for each section.
fn table(sections: &[Section]) -> impl Into<Table> {
    let time = |section: &Section, k: usize| {
        section.times().map_or("-".into(), |times| format!("{:?}", times[k]))
    };
    Table::of(sections)
        .column("file", |section| {
            section.path.file_name().map_or(String::new(), |n| n.to_string_lossy().into_owned())
        })
        .column("holds", |section| &section.file.section)
        .column("states", |section| section.file.time.len().to_string())
        .column("first time", move |section| time(section, 0))
        .column("last", move |section| time(section, 1))
        .column("entities", |section| section.file.entities.len().to_string())
        .column("problems", |section| section.file.problems.len().to_string())
}

fn print(out: &mut dyn Write, section: &Section) -> io::Result<()> {
    let file = &section.file;
    writeln!(out, "{}", section.path.display())?;
    match section.name() {
        Some(section) => writeln!(out, "  format      {}, section {section}", file.format)?,
        None => writeln!(out, "  format      {}", file.format)?,
    }
    if let Some(solver) = &file.solver {
        let version = file.version.as_deref().unwrap_or_default();
        writeln!(out, "{}", format!("  solver      {solver} {version}").trim_end())?;
    }
    writeln!(out, "  title       {}", file.title.as_deref().unwrap_or("(none)"))?;
    if let Some((path, count)) = &section.titles_from {
        writeln!(out, "  titles      {count} taken from the deck {}", path.display())?;
    }
    if let Some(deck) = &section.deck {
        print_deck(out, deck)?;
    }
    match section.times() {
        _ if section.deck.is_some() => {}
        Some([first, last]) => {
            writeln!(out, "  states      {}, time {first:?} to {last:?}", file.time.len())?;
        }
        None => writeln!(out, "  states      0")?,
    }
    if !file.components.is_empty() {
        writeln!(out, "  components  {}", file.components.join(", "))?;
    }
    let entities = file.entities.iter();
    list(out, "entities", entities.map(|entity| titled(entity.id, &entity.title)))?;
    for entity in file.without_data.iter().take(SHOWN) {
        let reason = match entity.reason {
            solver::NoDataReason::SingleSurfaceContact => "single surface: resultants undefined",
            solver::NoDataReason::LegendOnly => "in the legend only",
        };
        writeln!(out, "    {}  ({reason})", titled(entity.id, &entity.title))?;
    }
    for note in &file.notes {
        writeln!(out, "  note        {note}")?;
    }
    for problem in &file.problems {
        writeln!(out, "  problem     {problem}")?;
    }
    Ok(())
}

/// Files of a folder that hold histories under names which no solver gives, with the kind.
fn renamed(folder: &Path) -> Vec<String> {
    let named = renamed_files(folder).into_iter().filter_map(|(path, kind)| {
        let name = path.file_name()?.to_string_lossy().into_owned();
        (!is_named_like_output(&name)).then(|| format!("{name} ({kind})"))
    });
    named.collect()
}

/// What is to be inspected: files, with the folder of the run where it was found by that.
type Asked = (Option<PathBuf>, Vec<PathBuf>);

/// The files that were named, and those of every run at or below the folders that were.
fn asked(paths: &[PathBuf]) -> Result<Vec<Asked>, Failure> {
    let mut asked = Vec::new();
    for path in paths {
        if !path.is_dir() {
            asked.push((None, vec![path.clone()]));
            continue;
        }
        let named = |e| failed_at(path, e);
        let found = run_folders(path).map_err(named)?;
        if found.runs.is_empty() {
            let renamed = renamed(path);
            let renamed = match renamed.is_empty() {
                true => String::new(),
                false => format!(": name a file to have it inspected, as {}", renamed.join(" or ")),
            };
            let why = format!("none of its folders holds solver files{renamed}");
            return Err(failed_at(path, why));
        }
        for folder in found.runs {
            let mut files = output_files(&folder).map_err(named)?;
            files.extend(match decks::find(&folder).map_err(named)? {
                Search::None => Vec::new(),
                Search::One(deck) => vec![deck],
                Search::Several(decks) => decks,
            });
            asked.push((Some(folder), files));
        }
    }
    Ok(asked)
}

/// Where titles were taken from, and what a deck says of its run, in its units.
pub(super) fn deck_document(
    titles_from: Option<&(PathBuf, usize)>,
    deck: Option<&Deck>,
) -> impl Serialize {
    let parameters = deck.map(|deck| {
        let all = deck.parameters.iter();
        all.map(|(name, value)| document! { name: name, value: value }).collect::<Vec<_>>()
    });
    document! {
        titles_from if_any: titles_from.map(|(path, _)| path.display().to_string()),
        titles if_any: titles_from.map(|(_, count)| count),
        units if_any: deck.and_then(|deck| Some(deck.units.as_ref()?.text.trim())),
        impact_speed if_any: deck.and_then(|deck| Some(deck.impact_speed()?.0)),
        outputs if_any: deck.map(|deck| &deck.outputs),
        history_nodes if_any: deck.map(|deck| &deck.history_nodes),
        contacts if_any: deck.map(|deck| &deck.contacts),
        rigid_walls if_any: deck.map(|deck| &deck.rigid_walls),
        parts if_any: deck.map(|deck| &deck.parts),
        parameters if_any: parameters,
        includes if_any: deck.map(|deck| &deck.includes),
    }
}

pub(super) fn print_deck(out: &mut dyn Write, deck: &Deck) -> io::Result<()> {
    if let Some(units) = &deck.units {
        writeln!(out, "  units       {}", units.text.trim())?;
    }
    if let Some((speed, _)) = deck.impact_speed() {
        writeln!(out, "  speed       {speed} (initial velocity, in the deck's units)")?;
    }
    let outputs: Vec<String> = deck
        .outputs
        .iter()
        .map(|o| o.interval.map_or(o.file.to_string(), |dt| format!("{} every {dt}", o.file)))
        .collect();
    if !outputs.is_empty() {
        writeln!(out, "  outputs     {}", outputs.join(", "))?;
    }
    list(out, "nodes", deck.history_nodes.iter().map(titled_entity))?;
    for (what, interfaces) in [("contacts", &deck.contacts), ("walls", &deck.rigid_walls)] {
        list(out, what, interfaces.iter().map(titled_entity))?;
    }
    list(out, "parts", deck.parts.iter().map(titled_entity))?;
    let parameters = deck.parameters.iter().map(|(name, value)| match value {
        Value::Real(value) => format!("{name} = {value:?}"),
        Value::Integer(value) => format!("{name} = {value}"),
        Value::Text(value) => format!("{name} = \"{value}\""),
        Value::Unknown => format!("{name} = (not known)"),
    });
    list(out, "parameters", parameters)?;
    for include in &deck.includes {
        let missing = if include.found { "" } else { "  (not found)" };
        writeln!(out, "  include     {}{missing}", include.name)?;
    }
    Ok(())
}

fn titled_entity(of: &DeckEntity) -> String {
    titled(of.id.map_or("(no id)".into(), |id| id.to_string()), &of.title)
}

pub(super) fn titled(id: impl Display, title: &Option<String>) -> String {
    format!("{id}{}", title.as_ref().map_or(String::new(), |title| format!("  {title}")))
}

/// Entries printed in full; of longer lists the rest is counted.
pub(super) const SHOWN: usize = 20;

/// Entries below their number.
pub(super) fn list(
    out: &mut dyn Write,
    what: &str,
    entries: impl ExactSizeIterator<Item = String>,
) -> io::Result<()> {
    let count = entries.len();
    if count > 0 {
        writeln!(out, "  {what:<11} {count}")?;
    }
    for entry in entries.take(SHOWN) {
        writeln!(out, "    {entry}")?;
    }
    match count.checked_sub(SHOWN) {
        Some(more @ 1..) => writeln!(out, "    … and {more} more (--json lists all)"),
        _ => Ok(()),
    }
}
