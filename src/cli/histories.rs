//! `crumple histories`: the histories of a solver file as a table.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::error::Error;
use crate::file::{write_at, write_whole};
use crate::history_hdf5::{Storage, Trouble, can_stream, convert, encode_in};
use crate::solver::{self, Access, Blocks, Selection, SolverFile, WantedId, decks};
use crate::unit::UnitSystem;

use super::arguments::{FileKind, selection};
use super::output::{self, Bar};
use super::{CommandResult, Failure, GlobalOptions, is_stdout, keep_input, usage};

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
    #[arg(long, value_parser = UnitSystem::parse)]
    units: Option<UnitSystem>,
    /// Write the values in HDF5 in single precision: half the size, and all six digits that solvers print (above 3.4e38 infinite)
    #[arg(long)]
    f32: bool,
    /// Store the values in HDF5 entity by entity, in chunks of all states, for programs that read few of many
    /// entities [default: state by state]
    #[arg(long)]
    chunk: bool,
    /// The same as --overwrite
    #[arg(long, hide = true)]
    force: bool,
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let selection = Selection {
        access: if args.map { Access::Map } else { Access::Plain },
        ..selection(&args.ids, &args.components, args.section.as_deref())
    };
    let output = args.output.as_deref().filter(|path| !is_stdout(path));
    let is_hdf5 = is_hdf5(args, output, options)?;
    let deck = is_hdf5.then(|| decks::deck_next_to(&args.file)).flatten().map(|(_, deck)| deck);
    let (units, deck) = (args.units, deck.as_ref());
    let storage = Storage { single: args.f32, by_entity: args.chunk };
    // JSON on standard output next to a file needs the values themselves.
    let straight = output.filter(|_| is_hdf5 && !options.json);
    let format = args.format.as_deref();
    let bar = Bar::new(options, "reading");
    let streamed = match is_hdf5 || options.json {
        true => None,
        false => stream_csv(&args.file, format, &selection, output)?,
    };
    let is_streamed = streamed.is_some();
    let file = match (streamed, straight) {
        (Some(file), _) => file,
        (None, Some(path)) => convert(&args.file, format, &selection, units, deck, storage, path)?,
        (None, None) => solver::read(&args.file, format, &selection)?,
    };
    drop(bar);
    let outcome = options.warn_of(&args.file, &file.problems);
    if !options.quiet {
        file.notes.iter().for_each(|note| output::eprint_line(&format!("note: {note}")));
    }
    match output.filter(|_| straight.is_none() && !is_streamed) {
        Some(path) => {
            let _bar = Bar::new(options, "writing");
            if is_hdf5 {
                write_whole(path, &encode_in(storage, &file, units, deck, Some(&args.file))?)?;
            } else {
                let mut csv = Vec::new();
                write_csv(&mut csv, &file)?;
                write_whole(path, &csv)?;
            }
        }
        None if options.json || straight.is_some() || is_streamed => {}
        None => output::print_data(|out| write_csv(out, &file))?,
    }
    if options.json {
        // JSON has no NaN: a value that the file does not hold is null.
        let channels = file.histories.iter().map(|history| {
            document! {
                label: history.label(),
                id if_any: history.entity.map(|entity| entity.id),
                side if_any: history.entity.and_then(|entity| entity.side),
                component: &*history.component,
                values: &history.values,
            }
        });
        output::print_json(&document! {
            path: args.file.display().to_string(),
            format: file.format,
            time: &*file.time,
            histories: channels.collect::<Vec<_>>(),
            problems: &file.problems,
        })?;
    }
    Ok(outcome)
}

/// Whether HDF5 is written, else CSV; refuses what would be written over.
fn is_hdf5(args: &Args, output: Option<&Path>, options: GlobalOptions) -> Result<bool, Failure> {
    if let Some(output) = output {
        let parts = solver::family(&args.file)?;
        parts.iter().try_for_each(|part| keep_input(part, output))?;
        if !(args.force || options.overwrite) && crate::history_hdf5::is_other_hdf5(output) {
            return usage(format!(
                "{} is an HDF5 file without histories, such as a curve database: name another file, or replace it with --overwrite",
                output.display()
            ));
        }
        let is_hdf5 = output.extension().is_some_and(|e| e != "csv");
        let own = if is_hdf5 { FileKind::Database } else { FileKind::Result };
        if !args.force {
            options.keep_others(output, own)?;
        }
    }
    let extension = output.and_then(Path::extension).and_then(|e| e.to_str());
    let is_hdf5 = match extension {
        Some("h5" | "hdf5") => true,
        Some("csv") | None => false,
        Some(other) => {
            return usage(format!(
                "cannot write \".{other}\": histories are written as .csv, .h5 or .hdf5"
            ));
        }
    };
    if args.units.is_some() && !is_hdf5 {
        return usage(
            "--units is for HDF5 (-o FILE.h5): CSV holds the values as they are in the file",
        );
    }
    for (name, is_set) in [("--f32", args.f32), ("--chunk", args.chunk)] {
        if is_set && !is_hdf5 {
            return usage(format!("{name} is for HDF5 (-o FILE.h5)"));
        }
    }
    Ok(is_hdf5)
}

/// Writes a file as CSV state by state while it is read, if that can be done; `None` if not.
fn stream_csv(
    input: &Path,
    format: Option<&str>,
    selection: &Selection,
    output: Option<&Path>,
) -> Result<Option<SolverFile>, Failure> {
    if !can_stream(input, output) {
        return Ok(None);
    }
    let Some(blocks) = solver::blocks(input, format, selection)? else { return Ok(None) };
    let mut read_error = None;
    let mut write = |out: &mut dyn Write| match write_rows(&blocks, out) {
        Ok(whole) => Ok(whole.then_some(())),
        Err(Trouble::Writing(error)) => Err(error),
        Err(Trouble::Reading(error)) => {
            read_error = Some(error);
            Ok(None)
        }
    };
    let written = match output {
        Some(path) => write_at(path, |mut file| write(&mut file))?,
        // What is printed cannot be taken back: little is held until all of it is there.
        None if blocks.file.time.len().saturating_mul(blocks.values()) <= HELD => {
            let mut text = Vec::new();
            match write(&mut text) {
                Ok(Some(())) => output::print_data(|out| out.write_all(&text).map(Some))?,
                _ => None,
            }
        }
        None if !blocks.are_whole().map_err(|error| Error::io(input, error))? => return Ok(None),
        None => {
            let written = output::print_data(write)?;
            if written.is_none() {
                read_error.get_or_insert(io::Error::other("it changed while it was being read"));
            }
            written
        }
    };
    if let Some(error) = read_error {
        return Err(Error::io(input, error).into());
    }
    Ok(written.map(|()| blocks.file))
}

/// Values whose text is held until all of it is known to be whole.
const HELD: usize = 1 << 18;

/// Values of states that one thread writes at once.
const TOGETHER: usize = 1 << 16;

/// Writes all states, some at once; false if one is damaged.
fn write_rows(blocks: &Blocks, out: &mut dyn Write) -> Result<bool, Trouble> {
    let labels = blocks.labels();
    let columns: Vec<(String, &[f64])> =
        ["time".into()].into_iter().chain(labels).map(|label| (label, &[][..])).collect();
    output::csv(out, &columns, |_, _| Ok(())).map_err(Trouble::Writing)?;
    let (time, width) = (&blocks.file.time, blocks.values());
    let together = (TOGETHER / width).max(1);
    let round = 2 * rayon::current_num_threads();
    let groups: Vec<&[f64]> = time.chunks(together).collect();
    for (k, groups) in groups.chunks(round).enumerate() {
        let texts: Vec<Option<Vec<u8>>> = (0..)
            .map(|group| (k * round + group) * together)
            .zip(groups)
            .collect::<Vec<_>>()
            .into_par_iter()
            .map_init(
                || (blocks.reader(), vec![0.0; width], zmij::Buffer::new()),
                |(reader, values, digits), (first, times)| {
                    let mut text = Vec::new();
                    for (state, time) in (first..).zip(*times) {
                        if !reader(state, values).map_err(Trouble::Reading)? {
                            return Ok(None);
                        }
                        text.extend_from_slice(digits.format(*time).as_bytes());
                        for &place in &blocks.order {
                            text.push(b',');
                            text.extend_from_slice(digits.format(values[place]).as_bytes());
                        }
                        text.push(b'\n');
                    }
                    Ok(Some(text))
                },
            )
            .collect::<Result<_, _>>()?;
        for text in texts {
            let Some(text) = text else { return Ok(false) };
            out.write_all(&text).map_err(Trouble::Writing)?;
        }
    }
    Ok(blocks.are_plausible())
}

/// A `time` column and one column per history, with enough digits to read back the same numbers.
fn write_csv(out: &mut dyn Write, file: &SolverFile) -> io::Result<()> {
    let mut columns = vec![("time".to_string(), &*file.time)];
    columns.extend(file.histories.iter().map(|history| (history.label(), &*history.values)));
    let mut digits = zmij::Buffer::new();
    output::csv(out, &columns, |line, number| {
        line.extend_from_slice(digits.format(number).as_bytes());
        Ok(())
    })
}
