//! Joining the files of all shards.

use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use super::draft::{Tally, each_line, is_hdf5};
use super::hdf5::{self, Shelf};
use super::row::Head;
use super::{Report, Shard, SweepError};
use crate::file::{self, WriterLock, write_at};

/// First bytes of an HDF5 file.
const HDF5_SIGNATURE: &[u8; 8] = b"\x89HDF\r\n\x1a\n";

/// Joins the files of all shards of one sweep, given in any order, to what the sweep gives
/// without shards. CSV is joined to CSV or HDF5, HDF5 to HDF5.
///
/// # Errors
/// [`SweepError::Merge`] names what is missing, twice or foreign; [`SweepError::Damaged`] the
/// first row that is not there; [`SweepError::Lock`] another writer. The output is then unchanged.
pub fn merge(inputs: &[PathBuf], output: &Path) -> Result<Report, SweepError> {
    let _lock = WriterLock::take(output)?;
    let mut tables = Vec::new();
    let mut shelves = Vec::new();
    for path in inputs {
        match is_hdf5_file(path)? {
            true => shelves.push((path.clone(), Shelf::open(path)?)),
            false => tables.push((path.clone(), read_head(path)?)),
        }
    }
    if let (Some((a, _)), Some((b, _))) = (tables.first(), shelves.first()) {
        let (a, b) = (a.display(), b.display());
        return Err(failed(format!("{a} is CSV, {b} is HDF5: merge files of one kind")));
    }
    if let Some((path, _)) = shelves.first() {
        if !is_hdf5(output) {
            let (path, output) = (path.display(), output.display());
            return Err(failed(format!(
                "{path} is HDF5, so its merged file is, too: name {output} .h5 or .hdf5"
            )));
        }
        let whole = ordered(&mut shelves, |shelf| &shelf.head)?;
        let mut tally = Tally::new(&whole);
        let shelves: Vec<Shelf> = shelves.into_iter().map(|(_, shelf)| shelf).collect();
        hdf5::join(&shelves, &whole, output)?;
        for shelf in &shelves {
            shelf.tally(&mut tally)?;
        }
        return Ok(tally.close());
    }
    let whole = ordered(&mut tables, |head| head)?;
    let mut tally = Tally::new(&whole);
    if is_hdf5(output) {
        for (path, head) in &tables {
            lines(path, head, |line| tally.see_line(line).then_some(()))?;
        }
        hdf5::convert(&tables, &whole, output)?;
        return Ok(tally.close());
    }
    let mut failure = None;
    let written = write_at(output, |file| {
        let mut out = BufWriter::new(file);
        out.write_all(whole.text().as_bytes())?;
        for (path, head) in &tables {
            let mut trouble = Ok(());
            let read = lines(path, head, |line| {
                tally.see_line(line).then_some(())?;
                trouble = out.write_all(line);
                trouble.is_ok().then_some(())
            });
            trouble?;
            if let Err(error) = read {
                failure = Some(error);
                return Ok(None);
            }
        }
        out.flush()?;
        file.sync_all().map(Some)
    });
    match (failure, written) {
        (Some(error), _) => Err(error),
        (None, Err(error)) => Err(error.into()),
        (None, Ok(_)) => Ok(tally.close()),
    }
}

fn failed(message: String) -> SweepError {
    SweepError::Merge { message }
}

fn is_hdf5_file(path: &Path) -> Result<bool, SweepError> {
    let io = |source| SweepError::Read { path: path.into(), source };
    let mut first = Vec::new();
    file::open(path).map_err(io)?.take(8).read_to_end(&mut first).map_err(io)?;
    Ok(first == HDF5_SIGNATURE)
}

fn read_head(path: &Path) -> Result<Head, SweepError> {
    let io = |source| SweepError::Read { path: path.into(), source };
    let mut reader = BufReader::new(file::open(path).map_err(io)?);
    let head = Head::read(&mut reader).map_err(io)?;
    head.map(|(head, _)| head).ok_or_else(|| {
        let path = path.display();
        failed(format!("{path} is no result of crumple sweep: give the files of its shards"))
    })
}

fn lines(path: &Path, head: &Head, see: impl FnMut(&[u8]) -> Option<()>) -> Result<(), SweepError> {
    let io = |source: io::Error| SweepError::Read { path: path.into(), source };
    let mut reader = BufReader::with_capacity(1 << 16, file::open(path).map_err(io)?);
    Head::read(&mut reader).map_err(io)?;
    each_line(path, &mut reader, see, head)
}

/// Puts files in the order of their shards and checks that they are all of one sweep; the head
/// of the whole.
fn ordered<T>(files: &mut [(PathBuf, T)], head: impl Fn(&T) -> &Head) -> Result<Head, SweepError> {
    let Some((first_path, first)) = files.first() else {
        return Err(failed("there is nothing to merge: give the files of the shards".into()));
    };
    let (first_path, first) = (first_path.display().to_string(), head(first).clone());
    for (path, file) in files.iter() {
        let head = head(file);
        let path = path.display();
        if head.differs_from(&Head { shard: head.shard, ..first.clone() }).is_some() {
            return Err(failed(format!(
                "{path} and {first_path} are of different sweeps: plan, scenario, a file it names or crumple's version differ"
            )));
        }
        if head.shard.count() != first.shard.count() {
            let (n, other) = (head.shard.count(), first.shard.count());
            return Err(failed(format!(
                "{path} is one of {n} shards, {first_path} one of {other}: merge those of one division"
            )));
        }
    }
    files.sort_by_key(|(_, file)| head(file).shard.index());
    for pair in files.windows(2) {
        let index = head(&pair[0].1).shard.index();
        if index == head(&pair[1].1).shard.index() {
            let (a, b) = (pair[0].0.display(), pair[1].0.display());
            return Err(failed(format!("{a} and {b} are both shard {index}: give each once")));
        }
    }
    let count = first.shard.count();
    let there: std::collections::BTreeSet<u64> =
        files.iter().map(|(_, file)| head(file).shard.index()).collect();
    // Only so many are looked for as a message can hold.
    let missing: Vec<String> = (1..=count)
        .filter(|index| !there.contains(index))
        .take(10)
        .map(|index| index.to_string())
        .collect();
    if !missing.is_empty() {
        let more = (count - there.len() as u64) as usize > missing.len();
        return Err(failed(format!(
            "of {count} shards {} given: missing {}{}",
            if there.len() == 1 { "1 is".into() } else { format!("{} are", there.len()) },
            missing.join(", "),
            if more { ", …" } else { "" }
        )));
    }
    Ok(Head { shard: Shard::WHOLE, ..first })
}
