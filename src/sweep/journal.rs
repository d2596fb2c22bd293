//! The journal of a run: CSV beside the output, taken up again where it ends, renamed or
//! converted when it is complete.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use super::row::{ShardFile, ShardHeader, read_line};
use super::run::{self, Chunk};
use super::statistics::Tally;
use super::to_hdf5::{self, is_hdf5};
use super::{Report, Shard, Sweep, foreign};
use crate::error::Error;
use crate::file::{WriterLock, not_written};

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

fn beside(path: &Path, suffix: &str) -> PathBuf {
    let mut name = OsString::from(path.file_name().unwrap_or_default());
    name.push(suffix);
    path.with_file_name(name)
}

/// Runs a shard of the sweep and writes its rows to `output`: HDF5 by the extensions `.h5` and
/// `.hdf5`, else CSV.
///
/// Rows go to `OUTPUT.part` first. If that is there from an earlier run of the same sweep, its
/// whole rows are kept and the run goes on after them; if `output` itself is there and is this
/// sweep's, nothing is run. `progress` is told the number of rows there are, before the first
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
    let output = &fs::canonicalize(output).unwrap_or_else(|_| output.to_path_buf());
    let _lock = WriterLock::take(output)?;
    let head = ShardHeader::of(sweep, options.shard);
    let part = beside(output, ".part");
    let mut tally = Tally::new(&head);
    if options.restart {
        match fs::remove_file(&part) {
            Err(e) if e.kind() != io::ErrorKind::NotFound => return Err(failed(&part)(e)),
            _ => {}
        }
    } else if output.exists() {
        complete(output, &head, &mut tally)?;
        // Left if a kill came just before its removal; it holds nothing more.
        let _ = fs::remove_file(&part);
        tally.resumed = tally.done;
        return Ok(tally.close());
    }
    let mut file = resume(&part, &head, &mut tally)?;
    tally.resumed = tally.done;
    let write_failed = failed(output);
    let mut flow = progress(tally.done);
    if flow.is_continue() {
        let rows = head.rows().start + tally.done..head.rows().end;
        run::rows(sweep, rows, options.chunk, |chunk| {
            let bytes: Vec<u8> = chunk.iter().flat_map(|w| w.line.iter().copied()).collect();
            file.write_all(&bytes).map_err(&write_failed)?;
            chunk.iter().for_each(|written| tally.see(written));
            flow = progress(tally.done);
            Ok(flow)
        })?;
    }
    file.sync_all().map_err(&write_failed)?;
    drop(file);
    if tally.done == tally.rows {
        if is_hdf5(output) {
            let finished = ShardFile { path: part.clone(), head: head.clone() };
            to_hdf5::convert(&[finished], &head, output)?;
            // What remains is only the space it takes.
            let _ = fs::remove_file(&part);
        } else {
            fs::rename(&part, output).map_err(&write_failed)?;
        }
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
    run::rows(sweep, head.rows(), options.chunk, |chunk| {
        for written in chunk {
            out.write_all(&written.line).map_err(failed(name))?;
            tally.see(written);
        }
        Ok(progress(tally.done))
    })?;
    out.flush().map_err(failed(name))?;
    Ok(tally.close())
}

fn failed(path: &Path) -> impl Fn(io::Error) -> Error + '_ {
    move |source| not_written(path, source)
}

/// Opens the file under work behind its last whole row; makes it if it is not there.
fn resume(part: &Path, head: &ShardHeader, tally: &mut Tally) -> Result<File, Error> {
    let io = |source| Error::io(part, source);
    let open = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(part);
    let mut file = open.map_err(failed(part))?;
    let wanted = head.text();
    let mut reader = BufReader::new(&file);
    let end = match ShardHeader::read(&mut reader).map_err(io)? {
        Some((found, length)) => {
            found.check_same(part, head)?;
            let mut end = length;
            let mut line = Vec::new();
            loop {
                let read = read_line(&mut reader, &mut line).map_err(io)?;
                if read == 0 || !tally.see_line(&line) {
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
    Ok(file)
}

/// Checks an output that is there: this sweep's, with all its rows.
fn complete(output: &Path, head: &ShardHeader, tally: &mut Tally) -> Result<(), Error> {
    if is_hdf5(output) {
        return to_hdf5::complete(output, head, tally);
    }
    let found = ShardFile::read_head(output)?;
    let found = found.ok_or_else(|| foreign(output))?;
    found.head.check_same(output, head)?;
    found.rows(|line| tally.see_line(line).then_some(()))
}
