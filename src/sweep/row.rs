//! A row of results as numbers and as a line of CSV, and the header above the rows.

use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};

use super::{Shard, Sweep, damaged};
use crate::error::{Error, error};
use crate::file;

/// First line of every file.
pub(crate) const FORMAT: &str = "crumple sweep";
pub(crate) const LAYOUT: i64 = 1;

/// How an item ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Status {
    Ok,
    Warned,
    Failed,
}

impl Status {
    pub(crate) const ALL: [Self; 3] = [Self::Ok, Self::Warned, Self::Failed];

    /// Its name in the column `status`.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Warned => "warned",
            Self::Failed => "failed",
        }
    }
}

/// One item's row.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Row {
    pub item: u64,
    /// Varied values, then results, in SI; NaN where there is none.
    pub values: Vec<f64>,
    pub status: Status,
    /// Why it failed, or its warnings; one line.
    pub message: String,
}

/// Between the warnings of a row.
pub(super) const BETWEEN: &str = " | ";

/// A value as it is in a file: shortest digits that read back the same, a name, or nothing.
pub(crate) fn text(value: f64, names: &[String]) -> String {
    let mut bytes = Vec::new();
    push(&mut bytes, value, names);
    String::from_utf8_lossy(&bytes).into_owned()
}

fn push(out: &mut Vec<u8>, value: f64, names: &[String]) {
    if value.is_nan() {
        return;
    }
    match names.get(value as usize) {
        Some(name) => out.extend_from_slice(name.as_bytes()),
        None if value.is_infinite() => {
            out.extend_from_slice(if value > 0.0 { b"inf" } else { b"-inf" });
        }
        None => out.extend_from_slice(zmij::Buffer::new().format_finite(value).as_bytes()),
    }
}

impl Row {
    /// Appends the row as a line. `names[k]` are those of value `k`, if it is an index.
    pub(crate) fn write(&self, names: &[Vec<String>], out: &mut Vec<u8>) {
        out.extend_from_slice(self.item.to_string().as_bytes());
        for (k, value) in self.values.iter().enumerate() {
            out.push(b',');
            push(out, *value, names.get(k).map_or(&[], Vec::as_slice));
        }
        out.push(b',');
        out.extend_from_slice(self.status.name().as_bytes());
        out.push(b',');
        if self.message.contains([',', '"']) {
            out.push(b'"');
            out.extend_from_slice(self.message.replace('"', "\"\"").as_bytes());
            out.push(b'"');
        } else {
            out.extend_from_slice(self.message.as_bytes());
        }
        out.push(b'\n');
    }
}

/// A line of a file, taken apart; fields of varied values and results are not parsed yet.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Line<'a> {
    pub item: u64,
    pub values: Vec<&'a str>,
    pub status: Status,
    pub message: std::borrow::Cow<'a, str>,
}

impl<'a> Line<'a> {
    /// Takes apart a line with its line feed; `None` if it is not whole.
    pub(crate) fn parse(line: &'a [u8], columns: usize) -> Option<Self> {
        let text = std::str::from_utf8(line.strip_suffix(b"\n")?).ok()?;
        // What a disk that lost power leaves in place of text.
        if text.contains('\0') {
            return None;
        }
        let mut fields = text.splitn(columns, ',');
        let item = fields.next()?.parse().ok()?;
        let mut values = Vec::with_capacity(columns);
        values.extend(fields.by_ref().take(columns.checked_sub(3)?));
        let (status, message) = (fields.next()?, fields.next()?);
        let status = Status::ALL.into_iter().find(|s| s.name() == status)?;
        let message = match message.strip_prefix('"') {
            Some(quoted) => quoted.strip_suffix('"')?.replace("\"\"", "\"").into(),
            None => message.into(),
        };
        Some(Self { item, values, status, message })
    }

    /// Number of a field: NaN if it is empty, `None` if it is not a number.
    pub(crate) fn number(field: &str) -> Option<f64> {
        if field.is_empty() {
            return Some(f64::NAN);
        }
        fast_float2::parse(field).ok().filter(|number: &f64| !number.is_nan())
    }
}

/// What is above the rows: which sweep and which part of it they are.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ShardHeader {
    pub version: String,
    /// Identifies the sweep, see [`Sweep::hash`].
    pub hash: String,
    pub items: u64,
    pub shard: Shard,
    pub columns: Vec<String>,
}

/// Bounds of a header, so that no other file is read for long.
pub(crate) const MAX_HEAD_BYTES: usize = 1 << 24;

impl ShardHeader {
    pub(crate) fn of(sweep: &Sweep, shard: Shard) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            hash: sweep.hash().into(),
            items: sweep.items(),
            shard,
            columns: sweep.columns(),
        }
    }

    pub(crate) fn rows(&self) -> std::ops::Range<u64> {
        self.shard.items(self.items)
    }

    pub(crate) fn count(&self) -> u64 {
        let rows = self.rows();
        rows.end - rows.start
    }

    /// The columns of numbers after the items.
    pub(crate) fn number_columns(&self) -> impl Iterator<Item = usize> {
        (1..self.columns.len()).filter(|&column| !self.is_text(column))
    }

    /// The columns of names of curves.
    pub(crate) fn choice_columns(&self) -> impl Iterator<Item = usize> {
        (1..self.columns.len().saturating_sub(2)).filter(|&column| self.is_text(column))
    }

    pub(crate) fn is_text(&self, column: usize) -> bool {
        let name = &self.columns[column];
        name.starts_with("curve[") || column + 2 >= self.columns.len()
    }

    /// The head as it is above the rows.
    pub(crate) fn text(&self) -> String {
        let Shard { index, count } = self.shard;
        format!(
            "# {FORMAT}, layout {LAYOUT}\n# written_by: crumple {}\n# hash: {}\n# items: {}\n# shard: {index}/{count}\n# first_item: {}\n# rows: {}\n{}\n",
            self.version,
            self.hash,
            self.items,
            self.rows().start,
            self.count(),
            self.columns.join(",")
        )
    }

    /// Reads a head; gives it back with its length in bytes. `None` if this program has not
    /// written it, or not to its end.
    pub(crate) fn read(input: &mut impl BufRead) -> io::Result<Option<(Self, u64)>> {
        let mut text = String::new();
        let mut input = io::Read::take(input, MAX_HEAD_BYTES as u64);
        for _ in 0..8 {
            match input.read_line(&mut text) {
                Ok(_) => {}
                // Not even text.
                Err(e) if e.kind() == io::ErrorKind::InvalidData => return Ok(None),
                Err(e) => return Err(e),
            }
        }
        let head = Self::parse(&text).filter(|head| head.text() == text);
        Ok(head.map(|head| (head, text.len() as u64)))
    }

    fn parse(text: &str) -> Option<Self> {
        let mut lines = text.lines();
        lines.next().filter(|l| *l == format!("# {FORMAT}, layout {LAYOUT}"))?;
        let mut value = |key: &str| {
            lines
                .next()?
                .strip_prefix("# ")?
                .strip_prefix(key)?
                .strip_prefix(": ")
                .map(String::from)
        };
        let version = value("written_by")?.strip_prefix("crumple ")?.to_string();
        let (hash, items, shard) = (value("hash")?, value("items")?, value("shard")?);
        value("first_item").and(value("rows"))?;
        let (index, count) = shard.split_once('/')?;
        let shard = Shard::new(index.parse().ok()?, count.parse().ok()?)?;
        let columns: Vec<String> = lines.next()?.split(',').map(String::from).collect();
        let items = items.parse().ok()?;
        (columns.len() > 3).then_some(Self { version, hash, items, shard, columns })
    }

    /// Why rows under this head do not belong under `wanted`; `None` if they do.
    pub(crate) fn differs_from(&self, wanted: &Self) -> Option<String> {
        if self.version != wanted.version {
            return Some(format!(
                "it was written by crumple {}; this is {}",
                self.version, wanted.version
            ));
        }
        if self.items != wanted.items && self.columns == wanted.columns {
            return Some(format!(
                "it has {} items, this sweep has {}: the plan, the scenario or a file it names has changed since, or it ended at a stated precision (--until)",
                self.items, wanted.items
            ));
        }
        if self.hash != wanted.hash || self.items != wanted.items || self.columns != wanted.columns
        {
            return Some("the plan, the scenario or a file it names has changed since".into());
        }
        let (found, this) = (self.shard, wanted.shard);
        (found != this).then(|| {
            format!(
                "it is shard {}/{}, this is {}/{}",
                found.index, found.count, this.index, this.count
            )
        })
    }

    /// Refuses a file under this head that is there, unless its rows belong under `wanted`.
    pub(crate) fn check_same(&self, path: &Path, wanted: &Self) -> Result<(), Error> {
        let Some(differs) = self.differs_from(wanted) else { return Ok(()) };
        let path = path.display();
        Err(error!(
            Sweep,
            "{path} belongs to another sweep: {differs}; --restart replaces it, another -o keeps it"
        ))
    }
}

pub(crate) fn bad_row(path: &Path, item: u64) -> Error {
    damaged(
        path,
        &format!(
            "the row of item {item} is missing or damaged: run its sweep again with --restart"
        ),
    )
}

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
        let first = reader.fill_buf().map_err(io)?;
        let text = first.strip_prefix(b"\xef\xbb\xbf").unwrap_or(first);
        let line = text.split(|b| *b == b'\n').next().unwrap_or_default();
        if text.starts_with(format!("# {FORMAT}").as_bytes())
            && (text.len() < first.len() || line.ends_with(b"\r"))
        {
            return Err(damaged(
                path,
                "another program has saved this result with a byte order mark or the line ends of Windows: restore the file, or save it in UTF-8 without a mark, with \\n at the end of lines",
            ));
        }
        let head = ShardHeader::read(&mut reader).map_err(io)?;
        Ok(head.map(|(head, _)| Self { path: path.into(), head }))
    }

    /// Hands on every row with its line feed, in order; `see` says whether it is whole.
    pub(crate) fn rows(
        &self,
        mut see: impl FnMut(&[u8]) -> Result<bool, Error>,
    ) -> Result<(), Error> {
        let path = &self.path;
        let io = |source| Error::io(path, source);
        let file = file::open(path).map_err(io)?;
        let mut reader = BufReader::with_capacity(1 << 16, file);
        ShardHeader::read(&mut reader).map_err(io)?;
        let mut line = Vec::new();
        for item in self.head.rows() {
            if read_line(&mut reader, &mut line).map_err(io)? == 0 {
                let last = self.head.rows().end - 1;
                let what = format!(
                    "its rows end before item {item}, they should go on to {last}: let its sweep run to the end"
                );
                return Err(damaged(path, &what));
            }
            if !see(&line)? {
                return Err(bad_row(path, item));
            }
        }
        match read_line(&mut reader, &mut line).map_err(io)? {
            0 => Ok(()),
            _ => Err(damaged(
                path,
                "there is unexpected data after the last row: run its sweep again with --restart",
            )),
        }
    }
}

/// Longer lines are not rows: the columns' names fit into as much.
const MAX_LINE_BYTES: u64 = MAX_HEAD_BYTES as u64;

/// Reads the next line, or as much of it as a row can have; how many bytes.
pub(super) fn read_line(reader: &mut impl BufRead, line: &mut Vec<u8>) -> io::Result<usize> {
    line.clear();
    io::Read::take(reader, MAX_LINE_BYTES).read_until(b'\n', line)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_from_their_lines() {
        let names = [vec!["a".to_string(), "b".to_string()], Vec::new()];
        for (values, status, message, text) in [
            (vec![1.0, 0.1], Status::Ok, "", "7,b,0.1,ok,\n"),
            (vec![0.0, f64::NAN], Status::Failed, "no, \"x\"", "7,a,,failed,\"no, \"\"x\"\"\"\n"),
        ] {
            let row = Row { item: 7, values, status, message: message.into() };
            let mut line = Vec::new();
            row.write(&names, &mut line);
            assert_eq!(String::from_utf8(line.clone()).unwrap(), text);
            let parsed = Line::parse(&line, 5).unwrap();
            assert_eq!((parsed.item, parsed.status, &*parsed.message), (7, status, message));
            assert!(Line::parse(&line[..line.len() - 1], 5).is_none(), "without its line feed");
        }
        assert!(Line::parse(b"7,a,1,ok,\0\n", 5).is_none());
        assert!(Line::parse(b"7,a,1,okay,\n", 5).is_none());
        assert_eq!(Line::number("1e-300"), Some(1e-300));
    }
}
