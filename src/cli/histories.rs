//! `crumple histories`: the histories of a solver file as a table.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::file::write_whole;
use crate::history::{History, Side};
use crate::history_hdf5::{Beside, convert, encode};
use crate::solver::{self, Access, Problem, Selection, SolverFile, WantedId, decks};
use crate::unit::UnitSystem;
use serde::Serialize;

use super::export::units;
use super::output;
use super::progress::Bar;
use super::{CommandResult, Failure, GlobalOptions, Outcome, is_stdout, keep_input};

/// Write the histories of a solver file as CSV, JSON or HDF5, in the solver's units
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple histories run/nodout --id 900001 --component x_displacement
  crumple histories run/rcforc --id 3:surfa -o force.csv
  crumple histories run/nodout -o nodout.h5
  crumple histories run/nodout -o nodout.h5 --units mm-t-s
HDF5 has named dimensions, titles of nodes and walls (from the file or the deck next to it) and units.")]
pub(super) struct Args {
    /// File written by a solver
    file: PathBuf,
    /// Node, wall or interface to keep; 3:surfa keeps one side (default: all)
    #[arg(long = "id")]
    ids: Vec<WantedId>,
    /// Component to keep, named as in binout, such as x_displacement (default: all)
    #[arg(long = "component")]
    components: Vec<String>,
    /// Section of a binout to read, such as nodout or rwforc/forces
    #[arg(long)]
    section: Option<String>,
    /// Kind of the file (nodout, rcforc, …), if not recognised by its content
    #[arg(long)]
    format: Option<String>,
    /// Read through a memory map: faster, but only for files that no process is writing to
    #[arg(long)]
    map: bool,
    /// Where to write: .csv, .h5 or .hdf5 (default: CSV on standard output)
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Units of the file, such as mm-t-s, to be named in HDF5 [default: those of the deck next to it]
    #[arg(long, value_parser = units)]
    units: Option<UnitSystem>,
    /// Replace an HDF5 file that is not a file of histories, such as a curve database
    #[arg(long)]
    force: bool,
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let some = |empty: bool| !empty;
    let selection = Selection {
        ids: some(args.ids.is_empty()).then(|| args.ids.clone()),
        components: some(args.components.is_empty()).then(|| args.components.clone()),
        section: args.section.clone(),
        access: if args.map { Access::Map } else { Access::Plain },
        audit: false,
    };
    let output = args.output.as_deref().filter(|path| !is_stdout(path));
    let target = checked_target(args, output)?;
    let deck = match target {
        Some(Target::Hdf5) => decks::deck_next_to(&args.file).map(|(_, deck)| deck),
        _ => None,
    };
    let beside = Beside { units: args.units, deck: deck.as_ref() };
    // JSON on standard output next to a file needs the values themselves.
    let straight = output.filter(|_| matches!(target, Some(Target::Hdf5)) && !options.json);
    let format = args.format.as_deref();
    let bar = Bar::new(options, "reading");
    let read = match straight {
        Some(path) => convert(&args.file, format, &selection, &beside, path).map_err(Failure::from),
        None => solver::read(&args.file, format, &selection).map_err(Failure::from),
    };
    bar.end();
    let file = read?;
    if let Some(section) = &args.section
        && *section != file.section
    {
        return Err(Failure::Usage(format!(
            "{} has no section \"{section}\": it is a text file with the one section \"{}\"",
            args.file.display(),
            file.format
        )));
    }
    for problem in &file.problems {
        options.warn(&format!("{}: {problem}", args.file.display()));
    }
    if !options.quiet {
        file.notes.iter().for_each(|note| output::say(&format!("note: {note}")));
    }
    match output.zip(target).filter(|_| straight.is_none()) {
        Some((path, target)) => {
            let bar = Bar::new(options, "writing");
            let written = write(path, target, &file, &beside, &args.file);
            bar.end();
            written?;
        }
        None if options.json || straight.is_some() => {}
        None => output::print_data(|out| write_csv(out, &file))?,
    }
    if options.json {
        output::print_json(&document(args, &file))?;
    }
    Ok(if file.problems.is_empty() { Outcome::Clean } else { Outcome::Warned })
}

/// What is written, if anything is; refuses what would be written over.
fn checked_target(args: &Args, output: Option<&Path>) -> Result<Option<Target>, Failure> {
    if let Some(output) = output {
        let parts = solver::family(&args.file)?;
        parts.iter().try_for_each(|part| keep_input(part, output))?;
        if !args.force && crate::history_hdf5::is_other_hdf5(output) {
            return Err(Failure::Usage(format!(
                "{} is an HDF5 file without histories, such as a curve database: name another file, or replace it with --force",
                output.display()
            )));
        }
    }
    let target = output.map(Target::of).transpose()?;
    if args.units.is_some() && !matches!(target, Some(Target::Hdf5)) {
        return Err(Failure::Usage(
            "--units is for HDF5 (-o FILE.h5): CSV holds the values as they are in the file".into(),
        ));
    }
    Ok(target)
}

enum Target {
    Csv,
    Hdf5,
}

impl Target {
    fn of(path: &Path) -> Result<Self, Failure> {
        match path.extension().and_then(|e| e.to_str()) {
            Some("h5" | "hdf5") => Ok(Self::Hdf5),
            Some("csv") | None => Ok(Self::Csv),
            Some(other) => Err(Failure::Usage(format!(
                "cannot write \".{other}\": histories are written as .csv, .h5 or .hdf5"
            ))),
        }
    }
}

fn write(
    path: &Path,
    target: Target,
    file: &SolverFile,
    beside: &Beside<'_>,
    source: &Path,
) -> Result<(), Failure> {
    let bytes = match target {
        Target::Csv => {
            let mut csv = Vec::new();
            write_csv(&mut csv, file)?;
            csv
        }
        Target::Hdf5 => encode(file, beside, Some(source))?,
    };
    Ok(write_whole(path, &bytes)?)
}

/// A `time` column and one column per history, with enough digits to read back the same
/// numbers.
fn write_csv(out: &mut dyn Write, file: &SolverFile) -> io::Result<()> {
    // Names may hold commas and quotes, numbers cannot.
    let names = file.histories.iter().map(History::label);
    let mut header = csv::Writer::from_writer(&mut *out);
    header.write_record(std::iter::once("time".to_string()).chain(names))?;
    header.flush()?;
    drop(header);
    let mut digits = zmij::Buffer::new();
    for (state, time) in file.time.iter().enumerate() {
        out.write_all(digits.format(*time).as_bytes())?;
        for history in &file.histories {
            out.write_all(b",")?;
            out.write_all(digits.format(history.values[state]).as_bytes())?;
        }
        writeln!(out)?;
    }
    Ok(())
}

#[derive(Serialize)]
struct Document<'a> {
    path: String,
    format: &'a str,
    time: &'a [f64],
    histories: Vec<Channel<'a>>,
    problems: &'a [Problem],
}

#[derive(Serialize)]
struct Channel<'a> {
    label: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    id: Option<i64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    side: Option<Side>,
    component: &'a str,
    /// JSON has no NaN: a value that the file does not hold is null.
    values: &'a [f64],
}

fn document<'a>(args: &Args, file: &'a SolverFile) -> Document<'a> {
    let channel = |h: &'a History| Channel {
        label: h.label(),
        id: h.entity.map(|e| e.id),
        side: h.entity.and_then(|e| e.side),
        component: &h.component,
        values: &h.values,
    };
    Document {
        path: args.file.display().to_string(),
        format: file.format,
        time: &file.time,
        histories: file.histories.iter().map(channel).collect(),
        problems: &file.problems,
    }
}
