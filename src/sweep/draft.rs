//! The file under work: CSV beside the output, taken up again where it ends, renamed or
//! converted when it is complete.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use super::hdf5;
use super::row::{Head, Line, MAX_HEAD_BYTES, Status, bad_row};
use super::run::{self, Chunk, Written};
use super::statistics::Statistics;
use super::{Report, Shard, Sweep, SweepError};
use crate::file::{self, WriteError, WriterLock};

/// How a sweep is written.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    pub shard: Shard,
    /// Begin anew, whatever stands at the output or is left of an earlier run.
    pub restart: bool,
    pub chunk: Chunk,
}

impl Default for Settings {
    fn default() -> Self {
        Self { shard: Shard::WHOLE, restart: false, chunk: Chunk::default() }
    }
}

/// Whether a path is to become HDF5.
pub(super) fn is_hdf5(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "h5" || e == "hdf5")
}

/// Longer lines are no rows: the columns' names fit into as much.
const MAX_LINE_BYTES: u64 = MAX_HEAD_BYTES as u64;

fn beside(path: &Path, suffix: &str) -> PathBuf {
    let mut name = OsString::from(path.file_name().unwrap_or_default());
    name.push(suffix);
    path.with_file_name(name)
}

/// Runs a shard of the sweep and writes its rows to `output`: HDF5 by the extensions `.h5` and
/// `.hdf5`, else CSV.
///
/// Rows go to `OUTPUT.part` first. If that is there from an earlier run of the same sweep, its
/// whole rows are kept and the run goes on behind them; if `output` itself is there and is this
/// sweep's, nothing is run. `progress` is told the number of rows there are, before the first
/// run and after each chunk, and may break: then `OUTPUT.part` stays for the next time.
///
/// # Errors
/// [`SweepError::Changed`] if what is there is another sweep's, [`SweepError::Lock`] if another
/// process is writing it; items that fail are rows and no errors.
pub fn write(
    sweep: &Sweep,
    output: &Path,
    settings: &Settings,
    mut progress: impl FnMut(u64) -> ControlFlow<()>,
) -> Result<Report, SweepError> {
    // A link is followed, so that its target is replaced and not the link.
    let output = &fs::canonicalize(output).unwrap_or_else(|_| output.to_path_buf());
    let _lock = WriterLock::take(output)?;
    let head = Head::of(sweep, settings.shard);
    let part = beside(output, ".part");
    let mut tally = Tally::new(&head);
    if settings.restart {
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
    let mut file = take_up(&part, &head, &mut tally)?;
    tally.resumed = tally.done;
    let write_failed = failed(output);
    let mut flow = progress(tally.done);
    if flow.is_continue() {
        let rows = head.rows().start + tally.done..head.rows().end;
        run::rows(sweep, rows, settings.chunk, |chunk| {
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
        match is_hdf5(output) {
            true => {
                hdf5::convert(&[(part.clone(), head.clone())], &head, output)?;
                // What remains is only the space it takes.
                let _ = fs::remove_file(&part);
            }
            false => fs::rename(&part, output).map_err(&write_failed)?,
        }
    }
    Ok(tally.close())
}

/// Runs a shard of the sweep and writes its rows as CSV to a stream, which nothing can take up
/// again.
///
/// # Errors
/// [`SweepError::Write`] with `name` if the stream cannot be written.
pub fn write_rows(
    sweep: &Sweep,
    out: &mut dyn Write,
    name: &Path,
    settings: &Settings,
    mut progress: impl FnMut(u64) -> ControlFlow<()>,
) -> Result<Report, SweepError> {
    let head = Head::of(sweep, settings.shard);
    let mut tally = Tally::new(&head);
    out.write_all(head.text().as_bytes()).map_err(failed(name))?;
    run::rows(sweep, head.rows(), settings.chunk, |chunk| {
        for written in chunk {
            out.write_all(&written.line).map_err(failed(name))?;
            tally.see(written);
        }
        Ok(progress(tally.done))
    })?;
    out.flush().map_err(failed(name))?;
    Ok(tally.close())
}

fn failed(path: &Path) -> impl Fn(io::Error) -> SweepError + '_ {
    move |source| WriteError::new(path, source).into()
}

/// What a report needs, row by row.
pub(super) struct Tally {
    head: Head,
    statistics: Statistics,
    pub rows: u64,
    pub done: u64,
    resumed: u64,
    failed: u64,
    warned: u64,
    messages: Vec<(u64, String)>,
}

/// Messages of failed rows that a report repeats.
const MESSAGES: usize = 3;

impl Tally {
    pub fn new(head: &Head) -> Self {
        let rows = head.rows().end - head.rows().start;
        let numbers: Vec<String> = (1..head.columns.len())
            .filter(|&c| !head.is_text(c))
            .map(|c| head.columns[c].clone())
            .collect();
        Self {
            head: head.clone(),
            statistics: Statistics::new(&numbers, rows),
            rows,
            done: 0,
            resumed: 0,
            failed: 0,
            warned: 0,
            messages: Vec::new(),
        }
    }

    fn see(&mut self, Written { row, .. }: &Written) {
        let head = &self.head;
        let numbers = row.values.iter().enumerate().filter(|(k, _)| !head.is_text(k + 1));
        self.statistics.see(row.item, numbers.map(|(_, value)| *value));
        self.count(row.item, row.status, &row.message);
    }

    /// Takes the numbers of a row that is counted by itself.
    pub fn statistics_see(&mut self, item: u64, values: impl Iterator<Item = f64>) {
        self.statistics.see(item, values);
    }

    pub fn count(&mut self, item: u64, status: Status, message: &str) {
        self.done += 1;
        match status {
            Status::Ok => {}
            Status::Warned => self.warned += 1,
            Status::Failed => {
                self.failed += 1;
                if self.messages.len() < MESSAGES {
                    self.messages.push((item, message.into()));
                }
            }
        }
    }

    /// Takes a line that ought to be the next one; false if it is not, or is not whole.
    pub fn see_line(&mut self, line: &[u8]) -> bool {
        let head = &self.head;
        let next = head.rows().start + self.done;
        let parsed = Line::parse(line, head.columns.len())
            .filter(|line| line.item == next && next < head.rows().end);
        let Some(line) = parsed else { return false };
        let numbers = line.values.iter().enumerate().filter(|(k, _)| !head.is_text(k + 1));
        let numbers: Option<Vec<f64>> = numbers.map(|(_, field)| Line::number(field)).collect();
        let Some(numbers) = numbers else { return false };
        self.statistics.see(next, numbers.into_iter());
        self.count(next, line.status, &line.message);
        true
    }

    pub fn close(self) -> Report {
        Report {
            items: self.head.items,
            shard: self.head.shard,
            rows: self.rows,
            resumed: self.resumed,
            done: self.done,
            failed: self.failed,
            warned: self.warned,
            messages: self.messages,
            columns: self.statistics.close(),
        }
    }
}

/// Opens the file under work behind its last whole row; makes it if it is not there.
fn take_up(part: &Path, head: &Head, tally: &mut Tally) -> Result<File, SweepError> {
    let io = |source| SweepError::Read { path: part.into(), source };
    let open = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(part);
    let mut file = open.map_err(failed(part))?;
    let wanted = head.text();
    let mut reader = BufReader::new(&file);
    let end = match Head::read(&mut reader).map_err(io)? {
        Some((found, length)) => {
            if let Some(differs) = found.differs_from(head) {
                return Err(SweepError::Changed { path: part.into(), differs });
            }
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
                return Err(SweepError::Foreign { path: part.into() });
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

/// Reads the next line, or as much of it as a row can have; how many bytes.
fn read_line(reader: &mut impl BufRead, line: &mut Vec<u8>) -> io::Result<usize> {
    line.clear();
    reader.take(MAX_LINE_BYTES).read_until(b'\n', line)
}

/// Checks an output that is there: this sweep's, with all its rows.
fn complete(output: &Path, head: &Head, tally: &mut Tally) -> Result<(), SweepError> {
    if is_hdf5(output) {
        return hdf5::complete(output, head, tally);
    }
    let io = |source| SweepError::Read { path: output.into(), source };
    let mut reader = BufReader::new(file::open(output).map_err(io)?);
    let found = Head::read(&mut reader).map_err(io)?;
    let (found, _) = found.ok_or_else(|| SweepError::Foreign { path: output.into() })?;
    if let Some(differs) = found.differs_from(head) {
        return Err(SweepError::Changed { path: output.into(), differs });
    }
    each_line(output, &mut reader, |line| tally.see_line(line).then_some(()), head)
}

/// Hands on every row of a file behind its head, all of which must be there.
pub(super) fn each_line(
    path: &Path,
    reader: &mut impl BufRead,
    mut see: impl FnMut(&[u8]) -> Option<()>,
    head: &Head,
) -> Result<(), SweepError> {
    let io = |source| SweepError::Read { path: path.into(), source };
    let mut line = Vec::new();
    for item in head.rows() {
        if read_line(reader, &mut line).map_err(io)? == 0 {
            let last = head.rows().end - 1;
            return Err(SweepError::Damaged {
                path: path.into(),
                message: format!(
                    "its rows end before item {item}, they should go on to {last}: let its sweep run to the end"
                ),
            });
        }
        see(&line).ok_or_else(|| bad_row(path, item))?;
    }
    match read_line(reader, &mut line).map_err(io)? {
        0 => Ok(()),
        _ => Err(SweepError::Damaged {
            path: path.into(),
            message: "there is something behind the last row: run its sweep again with --restart"
                .into(),
        }),
    }
}
