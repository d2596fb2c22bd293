//! The CSV file of a shard: its head, and its rows in order, all of which must be there.

use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};

use super::damaged;
use super::row::{MAX_HEAD_BYTES, ShardHeader, bad_row};
use crate::error::Error;
use crate::file;

/// The finished CSV file of a shard.
pub(super) struct ShardFile {
    pub path: PathBuf,
    pub head: ShardHeader,
}

impl ShardFile {
    /// Reads the head of a file; `None` if this program has not written it.
    pub(crate) fn read_head(path: &Path) -> Result<Option<Self>, Error> {
        let io = |source| Error::io(path, source);
        let mut reader = BufReader::new(file::open(path).map_err(io)?);
        let head = ShardHeader::read(&mut reader).map_err(io)?;
        Ok(head.map(|(head, _)| Self { path: path.into(), head }))
    }

    /// Hands on every row with its line feed, in order; `see` gives `None` for one that is not
    /// whole.
    pub(crate) fn rows(&self, see: impl FnMut(&[u8]) -> Option<()>) -> Result<(), Error> {
        let io = |source| Error::io(&self.path, source);
        let file = file::open(&self.path).map_err(io)?;
        let mut reader = BufReader::with_capacity(1 << 16, file);
        ShardHeader::read(&mut reader).map_err(io)?;
        each_line(&self.path, &mut reader, see, &self.head)
    }
}

/// Longer lines are not rows: the columns' names fit into as much.
const MAX_LINE_BYTES: u64 = MAX_HEAD_BYTES as u64;

/// Reads the next line, or as much of it as a row can have; how many bytes.
pub(super) fn read_line(reader: &mut impl BufRead, line: &mut Vec<u8>) -> io::Result<usize> {
    line.clear();
    io::Read::take(reader, MAX_LINE_BYTES).read_until(b'\n', line)
}

/// Hands on every row behind the head.
fn each_line(
    path: &Path,
    reader: &mut impl BufRead,
    mut see: impl FnMut(&[u8]) -> Option<()>,
    head: &ShardHeader,
) -> Result<(), Error> {
    let io = |source| Error::io(path, source);
    let mut line = Vec::new();
    for item in head.rows() {
        if read_line(reader, &mut line).map_err(io)? == 0 {
            let last = head.rows().end - 1;
            let what = format!(
                "its rows end before item {item}, they should go on to {last}: let its sweep run to the end"
            );
            return Err(damaged(path, &what));
        }
        see(&line).ok_or_else(|| bad_row(path, item))?;
    }
    match read_line(reader, &mut line).map_err(io)? {
        0 => Ok(()),
        _ => Err(damaged(
            path,
            "there is something behind the last row: run its sweep again with --restart",
        )),
    }
}
