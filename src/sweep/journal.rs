//! The journal of a run: CSV next to the output, resumed where it ends, renamed or
//! converted when it is complete. Files of shards have a header and are joined here.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use super::row::{ShardFile, ShardHeader, read_line};
use super::run::{self, Chunk};
use super::statistics::Tally;
use super::to_hdf5::{self, is_hdf5};
use super::{Report, Shard, Sweep, foreign};
use crate::error::{Error, error};
use crate::file::{self, WriterLock, accepts_changed, not_written, target_of, write_by_path};
use crate::order;

/// How a sweep is written.
#[derive(Clone, Copy, Debug)]
pub struct WriteOptions {
    /// Which items are run.
    pub shard: Shard,
    /// Start from the beginning, whatever stands at the output or is left of an earlier run.
    pub restart: bool,
    /// How many items are run before their rows are written.
    pub chunk: Chunk,
}

impl Default for WriteOptions {
    fn default() -> Self {
        Self { shard: Shard::WHOLE, restart: false, chunk: Chunk::default() }
    }
}

pub(super) fn beside(path: &Path, suffix: &str) -> PathBuf {
    let mut name = OsString::from(path.file_name().unwrap_or_default());
    name.push(suffix);
    path.with_file_name(name)
}

/// Runs a shard of the sweep and writes its rows to `output`: HDF5 by the extensions `.h5` and
/// `.hdf5`, else CSV.
///
/// Rows go to `OUTPUT.part` first. If that is there from an earlier run of the same sweep, its
/// rows are kept as far as they are whole and the sums in `OUTPUT.part.sums` are theirs, and the run goes
/// on after them; if `output` itself is there and is this
/// sweep's, nothing is run. `progress` receives the number of existing rows, before the first
/// run and after each chunk, and may break: then `OUTPUT.part` stays for the next time.
///
/// # Errors
/// If what is there is another sweep's, if another
/// process is writing it; items that fail are rows and no errors.
pub fn write(
    sweep: &Sweep,
    output: &Path,
    options: &WriteOptions,
    mut progress: impl FnMut(u64) -> ControlFlow<()>,
) -> Result<Report, Error> {
    // A link is followed, so that its target is replaced and not the link.
    let output = &target_of(output).map_err(failed(output))?;
    let _lock = WriterLock::take(output)?;
    write_locked(sweep, output, options, &mut progress)
}

/// As [`write()`], for a caller that holds the lock; `output` is not a link.
pub(super) fn write_locked(
    sweep: &Sweep,
    output: &Path,
    options: &WriteOptions,
    progress: &mut dyn FnMut(u64) -> ControlFlow<()>,
) -> Result<Report, Error> {
    let head = ShardHeader::of(sweep, options.shard);
    let (part, sums) = (beside(output, ".part"), beside(output, ".part.sums"));
    let mut tally = Tally::new(&head);
    if options.restart {
        for left in [&part, &sums] {
            match fs::remove_file(left) {
                Err(e) if e.kind() != io::ErrorKind::NotFound => return Err(failed(left)(e)),
                _ => {}
            }
        }
    } else if output.try_exists().map_err(failed(output))? {
        complete(output, &head, &mut tally)?;
        // Left if a kill came just before their removal; they hold nothing more.
        let _ = fs::remove_file(&part);
        let _ = fs::remove_file(&sums);
        tally.report.resumed = tally.report.done;
        return Ok(tally.close());
    }
    let (mut file, mut of_rows) = resume(&part, &sums, &head, &mut tally)?;
    tally.report.resumed = tally.report.done;
    let write_failed = failed(output);
    let mut flow = progress(tally.report.done);
    if flow.is_continue() {
        let rows = head.rows().start + tally.report.done..head.rows().end;
        let names = sweep.names();
        run::rows(sweep, rows, options.chunk, |chunk| {
            let bytes: Vec<u8> = chunk.iter().flat_map(|(_, line)| line.iter().copied()).collect();
            file.write_all(&bytes).map_err(&write_failed)?;
            let sums: String = chunk.iter().map(|(_, line)| sum(line)).collect();
            of_rows.write_all(sums.as_bytes()).map_err(&write_failed)?;
            chunk.iter().for_each(|(row, _)| tally.see_row(row, &names));
            flow = progress(tally.report.done);
            Ok(flow)
        })?;
    }
    file.sync_all().map_err(&write_failed)?;
    drop(file);
    if tally.report.is_complete() {
        if is_hdf5(output) {
            let finished = ShardFile { path: part.clone(), head: head.clone() };
            to_hdf5::convert(&[finished], &head, output)?;
            // What remains is only the space it takes.
            let _ = fs::remove_file(&part);
        } else {
            fs::rename(&part, output).map_err(&write_failed)?;
        }
        let _ = fs::remove_file(&sums);
    }
    Ok(tally.close())
}

/// Runs a shard of the sweep and writes its rows as CSV to a stream, which nothing can take up
/// again.
///
/// # Errors
/// With `name` if the stream cannot be written.
pub fn write_rows(
    sweep: &Sweep,
    out: &mut dyn Write,
    name: &Path,
    options: &WriteOptions,
    mut progress: impl FnMut(u64) -> ControlFlow<()>,
) -> Result<Report, Error> {
    let head = ShardHeader::of(sweep, options.shard);
    let mut tally = Tally::new(&head);
    out.write_all(head.text().as_bytes()).map_err(failed(name))?;
    let names = sweep.names();
    run::rows(sweep, head.rows(), options.chunk, |chunk| {
        for (row, line) in chunk {
            out.write_all(line).map_err(failed(name))?;
            tally.see_row(row, &names);
        }
        Ok(progress(tally.report.done))
    })?;
    out.flush().map_err(failed(name))?;
    Ok(tally.close())
}

fn failed(path: &Path) -> impl Fn(io::Error) -> Error + '_ {
    move |source| not_written(path, source)
}

/// The checksum of a row as a line of its own: a digit that a bad block or an editor has changed is run
/// again, not taken for a result.
pub(super) fn sum(line: &[u8]) -> String {
    format!("{}\n", &blake3::hash(line).to_hex()[..SUM - 1])
}

/// Bytes of a checksum with its line feed.
const SUM: usize = 17;

/// Opens the file under work after the last row that is whole and as it was written, and that of the
/// sums; makes them if they are missing.
fn resume(
    part: &Path,
    sums: &Path,
    head: &ShardHeader,
    tally: &mut Tally,
) -> Result<(File, File), Error> {
    let io = |source| Error::io(part, source);
    let open = |path: &Path| {
        let mut options = OpenOptions::new();
        options.read(true).write(true).create(true).truncate(false).open(path).map_err(failed(path))
    };
    let mut file = open(part)?;
    let mut of_rows = open(sums)?;
    let mut written = BufReader::new(&of_rows);
    let wanted = head.text();
    let mut reader = BufReader::new(&file);
    let end = match ShardHeader::read(&mut reader).map_err(io)? {
        Some((found, length)) => {
            found.check_same(part, head)?;
            let mut end = length;
            let mut line = Vec::new();
            loop {
                let read = read_line(&mut reader, &mut line).map_err(io)?;
                let mut sum_there = [0; SUM];
                let is_as_written = read > 0
                    && (accepts_changed()
                        || written.read_exact(&mut sum_there).is_ok()
                            && sum_there == sum(&line).as_bytes());
                if !is_as_written || !tally.see_line(&line) {
                    break end;
                }
                end += read as u64;
            }
        }
        None => {
            // Killed while the head itself was written, or no file of a sweep.
            let mut begun = Vec::new();
            (&file).seek(SeekFrom::Start(0)).map_err(io)?;
            (&file).take(wanted.len() as u64 + 1).read_to_end(&mut begun).map_err(io)?;
            if !wanted.as_bytes().starts_with(&begun) {
                return Err(foreign(part));
            }
            0
        }
    };
    file.set_len(end).and_then(|()| file.seek(SeekFrom::Start(end))).map_err(failed(part))?;
    if end == 0 {
        file.write_all(wanted.as_bytes()).map_err(failed(part))?;
    }
    let end = tally.report.done * SUM as u64;
    let at_end = of_rows.set_len(end).and_then(|()| of_rows.seek(SeekFrom::Start(end)));
    at_end.map_err(failed(sums))?;
    Ok((file, of_rows))
}

/// Checks an output that is there: this sweep's, with all its rows.
fn complete(output: &Path, head: &ShardHeader, tally: &mut Tally) -> Result<(), Error> {
    if is_hdf5(output) {
        return to_hdf5::complete(output, head, tally);
    }
    let found = ShardFile::read_head(output)?.ok_or_else(|| foreign(output))?;
    found.head.check_same(output, head)?;
    found.rows(|line| Ok(tally.see_line(line)))
}

/// Missing shards that a message lists.
const LISTED: usize = 10;

/// Joins the CSV files of all shards of one sweep, given in any order, to what the sweep gives
/// without shards: CSV, or HDF5 by the extensions `.h5` and `.hdf5`.
///
/// # Errors
/// It names what is missing, twice or foreign, the first row that is missing, or another writer. The
/// output is then unchanged.
pub fn merge(inputs: &[PathBuf], output: &Path) -> Result<Report, Error> {
    let _lock = WriterLock::take(output)?;
    let mut files = inputs.iter().map(|path| open(path)).collect::<Result<Vec<_>, _>>()?;
    let whole = ordered(&mut files)?;
    let mut tally = Tally::new(&whole);
    if is_hdf5(output) {
        for file in &files {
            file.rows(|line| Ok(tally.see_line(line)))?;
        }
        to_hdf5::convert(&files, &whole, output)?;
        return Ok(tally.close());
    }
    let failed = |source| not_written(output, source);
    write_by_path(output, |draft| -> Result<(), Error> {
        let mut out = BufWriter::new(File::create(draft).map_err(failed)?);
        out.write_all(whole.text().as_bytes()).map_err(failed)?;
        for file in &files {
            file.rows(|line| {
                out.write_all(line).map_err(failed)?;
                Ok(tally.see_line(line))
            })?;
        }
        out.flush().map_err(failed)
    })?;
    Ok(tally.close())
}

/// First bytes of an HDF5 file.
const HDF5_SIGNATURE: &[u8; 8] = b"\x89HDF\r\n\x1a\n";

fn open(path: &Path) -> Result<ShardFile, Error> {
    if let Some(file) = ShardFile::read_head(path)? {
        return Ok(file);
    }
    let io = |source| Error::io(path, source);
    let mut first = Vec::new();
    file::open(path).map_err(io)?.take(8).read_to_end(&mut first).map_err(io)?;
    let path = path.display();
    Err(if first == HDF5_SIGNATURE {
        error!(Sweep, "{path} is HDF5: merge the shards as .csv and name the output .h5 or .hdf5")
    } else {
        error!(Sweep, "{path} is not a result of crumple sweep: give the files of its shards")
    })
}

/// Puts files in the order of their shards and checks that they are all of one sweep; the head
/// of the whole.
fn ordered(files: &mut [ShardFile]) -> Result<ShardHeader, Error> {
    let Some(ShardFile { path: first_path, head: first }) = files.first() else {
        return Err(error!(Sweep, "there is nothing to merge: give the files of the shards"));
    };
    let (first_path, first) = (first_path.display().to_string(), first.clone());
    for ShardFile { path, head } in files.iter() {
        let (path, count, first_count) = (path.display(), head.shard.count(), first.shard.count());
        if head.differs_from(&ShardHeader { shard: head.shard, ..first.clone() }).is_some() {
            return Err(error!(
                Sweep,
                "{path} and {first_path} are of different sweeps: the plan, the scenario, a file it names or crumple's version differs"
            ));
        }
        if count != first_count {
            return Err(error!(
                Sweep,
                "{path} is one of {count} shards, {first_path} one of {first_count}: merge shards of one division"
            ));
        }
    }
    order::sort_by_key(files, |file| file.head.shard.index());
    for pair in files.windows(2) {
        let (a, b) = (&pair[0], &pair[1]);
        let index = a.head.shard.index();
        if index == b.head.shard.index() {
            let (a, b) = (a.path.display(), b.path.display());
            return Err(error!(Sweep, "{a} and {b} are both shard {index}: give each once"));
        }
    }
    let count = first.shard.count();
    let there: BTreeSet<u64> = files.iter().map(|file| file.head.shard.index()).collect();
    if there.len() as u64 == count {
        return Ok(ShardHeader { shard: Shard::WHOLE, ..first });
    }
    let missing = (1..=count).filter(|index| !there.contains(index));
    let mut listed: Vec<String> = missing.take(LISTED).map(|index| index.to_string()).collect();
    if count > (there.len() + listed.len()) as u64 {
        listed.push("…".into());
    }
    let given = match there.len() {
        1 => "1 is".to_string(),
        given => format!("{given} are"),
    };
    Err(error!(Sweep, "of {count} shards {given} given: missing {}", listed.join(", ")))
}
