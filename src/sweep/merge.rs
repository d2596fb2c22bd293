//! Files of shards: their headers, and how they are joined.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use super::row::{ShardFile, ShardHeader};
use super::statistics::Tally;
use super::to_hdf5::{self, is_hdf5};
use super::{Report, Shard};
use crate::error::{Error, error};
use crate::file::{self, WriterLock, not_written, write_by_path};

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
                "{path} and {first_path} are of different sweeps: plan, scenario, a file it names or crumple's version differ"
            ));
        }
        if count != first_count {
            return Err(error!(
                Sweep,
                "{path} is one of {count} shards, {first_path} one of {first_count}: merge shards of one division"
            ));
        }
    }
    files.sort_by_key(|file| file.head.shard.index());
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
