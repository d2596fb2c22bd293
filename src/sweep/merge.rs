//! Joining the files of all shards.

use std::collections::BTreeSet;
use std::io::{BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use super::row::Head;
use super::shard_file::ShardFile;
use super::tally::Tally;
use super::to_hdf5::{self, is_hdf5};
use super::{Report, Shard, SweepError};
use crate::file::{self, WriterLock, write_at};

/// Why files cannot be joined.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    /// No file was given.
    #[error("there is nothing to merge: give the files of the shards")]
    Nothing,
    /// A file is not of this program.
    #[error("{path} is no result of crumple sweep: give the files of its shards")]
    NoResult {
        /// The file.
        path: PathBuf,
    },
    /// A file is HDF5, which a finished sweep is converted to and which is not joined.
    #[error("{path} is HDF5: merge the shards as .csv and name the output .h5 or .hdf5")]
    Hdf5 {
        /// The file.
        path: PathBuf,
    },
    /// Two files are of two sweeps.
    #[error(
        "{path} and {first} are of different sweeps: plan, scenario, a file it names or crumple's version differ"
    )]
    OtherSweep {
        /// The file.
        path: PathBuf,
        /// The file that was given first.
        first: PathBuf,
    },
    /// Two files are of two divisions of one sweep.
    #[error(
        "{path} is one of {count} shards, {first} one of {first_count}: merge those of one division"
    )]
    OtherDivision {
        /// The file.
        path: PathBuf,
        /// How many shards there are of its division.
        count: u64,
        /// The file that was given first.
        first: PathBuf,
        /// How many shards there are of that one's.
        first_count: u64,
    },
    /// Two files are the same shard.
    #[error("{a} and {b} are both shard {index}: give each once")]
    Twice {
        /// One file.
        a: PathBuf,
        /// The other.
        b: PathBuf,
        /// Which shard they are.
        index: u64,
    },
    /// Some shards are not given.
    #[error("of {count} shards {} given: missing {}", are(*.given), some(.missing, *.count - *.given))]
    Missing {
        /// Shards of the division.
        count: u64,
        /// How many are given.
        given: u64,
        /// The first that are not, counted from 1.
        missing: Vec<u64>,
    },
}

/// Missing shards that a message lists.
const LISTED: usize = 10;

fn are(given: u64) -> String {
    if given == 1 { "1 is".into() } else { format!("{given} are") }
}

fn some(listed: &[u64], all: u64) -> String {
    let names: Vec<String> = listed.iter().map(u64::to_string).collect();
    let more = if all > listed.len() as u64 { ", …" } else { "" };
    names.join(", ") + more
}

/// Joins the CSV files of all shards of one sweep, given in any order, to what the sweep gives
/// without shards: CSV, or HDF5 by the extensions `.h5` and `.hdf5`.
///
/// # Errors
/// [`SweepError::Merge`] names what is missing, twice or foreign; [`SweepError::Damaged`] the
/// first row that is not there; [`SweepError::Lock`] another writer. The output is then unchanged.
pub fn merge(inputs: &[PathBuf], output: &Path) -> Result<Report, SweepError> {
    let _lock = WriterLock::take(output)?;
    let mut files = inputs.iter().map(|path| open(path)).collect::<Result<Vec<_>, _>>()?;
    let whole = ordered(&mut files)?;
    let mut tally = Tally::new(&whole);
    if is_hdf5(output) {
        for file in &files {
            file.rows(|line| tally.see_line(line).then_some(()))?;
        }
        to_hdf5::convert(&files, &whole, output)?;
        return Ok(tally.close());
    }
    let mut failure = None;
    let written = write_at(output, |target| {
        let mut out = BufWriter::new(target);
        out.write_all(whole.text().as_bytes())?;
        for file in &files {
            let mut trouble = Ok(());
            let read = file.rows(|line| {
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
        target.sync_all().map(Some)
    });
    match (failure, written) {
        (Some(error), _) => Err(error),
        (None, Err(error)) => Err(error.into()),
        (None, Ok(_)) => Ok(tally.close()),
    }
}

/// First bytes of an HDF5 file.
const HDF5_SIGNATURE: &[u8; 8] = b"\x89HDF\r\n\x1a\n";

fn open(path: &Path) -> Result<ShardFile, SweepError> {
    if let Some(file) = ShardFile::read_head(path)? {
        return Ok(file);
    }
    let io = |source| SweepError::Read { path: path.into(), source };
    let mut first = Vec::new();
    file::open(path).map_err(io)?.take(8).read_to_end(&mut first).map_err(io)?;
    Err(match first == HDF5_SIGNATURE {
        true => MergeError::Hdf5 { path: path.into() },
        false => MergeError::NoResult { path: path.into() },
    }
    .into())
}

/// Puts files in the order of their shards and checks that they are all of one sweep; the head
/// of the whole.
fn ordered(files: &mut [ShardFile]) -> Result<Head, MergeError> {
    let Some(ShardFile { path: first_path, head: first }) = files.first() else {
        return Err(MergeError::Nothing);
    };
    let (first_path, first) = (first_path.clone(), first.clone());
    for ShardFile { path, head } in files.iter() {
        if head.differs_from(&Head { shard: head.shard, ..first.clone() }).is_some() {
            return Err(MergeError::OtherSweep { path: path.clone(), first: first_path });
        }
        if head.shard.count() != first.shard.count() {
            let (path, count) = (path.clone(), head.shard.count());
            let (first, first_count) = (first_path, first.shard.count());
            return Err(MergeError::OtherDivision { path, count, first, first_count });
        }
    }
    files.sort_by_key(|file| file.head.shard.index());
    for pair in files.windows(2) {
        let (a, b) = (&pair[0], &pair[1]);
        let index = a.head.shard.index();
        if index == b.head.shard.index() {
            return Err(MergeError::Twice { a: a.path.clone(), b: b.path.clone(), index });
        }
    }
    let count = first.shard.count();
    let there: BTreeSet<u64> = files.iter().map(|file| file.head.shard.index()).collect();
    let missing: Vec<u64> =
        (1..=count).filter(|index| !there.contains(index)).take(LISTED).collect();
    match missing.is_empty() {
        true => Ok(Head { shard: Shard::WHOLE, ..first }),
        false => Err(MergeError::Missing { count, given: there.len() as u64, missing }),
    }
}
