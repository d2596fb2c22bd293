//! Finished CSV converted to HDF5: a dataset per column, described in `schemas/sweep.md`.

use std::borrow::Cow;
use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};

use super::row::{FORMAT, LAYOUT, Line, ShardFile, ShardHeader, Status, bad_row};
use super::statistics::Tally;
use super::{Shard, damaged, foreign};
use crate::error::{Error, ErrorCode};
use crate::file::not_written;
use crate::hdf5::table::{self, Attribute, Column, Put, Table, Values, write_table};

/// Whether a result is written as HDF5, by its name.
pub(crate) fn is_hdf5(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "h5" || e == "hdf5")
}

/// Number of a row's message; 0 is the empty one.
const MESSAGE_NUMBER: &str = "message_number";
const MESSAGE: &str = "message";
/// Rows that are held at once.
const ROWS: u64 = 4096;

/// The datasets of a file of `head`; `widths`: bytes of the texts of each column, the messages' last.
fn datasets(head: &ShardHeader, widths: &[usize], messages: u64) -> Vec<Column> {
    let (rows, message) = (head.count(), head.columns.len() - 1);
    let own = (0..message).map(|c| {
        let values = match (c, head.is_text(c)) {
            (0, _) => Values::Integer,
            (_, true) => Values::Text { width: widths[c] },
            (_, false) => Values::Real,
        };
        Column { name: head.columns[c].clone(), values, rows }
    });
    let number = Column { name: MESSAGE_NUMBER.into(), values: Values::Integer, rows };
    let values = Values::Text { width: widths[message] };
    own.chain([number, Column { name: MESSAGE.into(), values, rows: messages }]).collect()
}

fn attributes(head: &ShardHeader) -> [(&'static str, Attribute); 6] {
    let number = |n: u64| Attribute::Integer(n as i64);
    [
        ("format", Attribute::Text(FORMAT.into())),
        ("layout_version", Attribute::Integer(LAYOUT)),
        ("written_by", Attribute::Text(format!("crumple {}", head.version))),
        ("hash", Attribute::Text(head.hash.clone())),
        ("items", number(head.items)),
        ("shard", Attribute::Text(format!("{}/{}", head.shard.index(), head.shard.count()))),
    ]
}

/// Writes the rows of CSV files, in this order, as one HDF5 file under `head`. The files have
/// been written by this program and are read twice.
pub(super) fn convert(files: &[ShardFile], head: &ShardHeader, output: &Path) -> Result<(), Error> {
    let columns = head.columns.len();
    let (mut widths, mut messages) = (vec![1; columns], 1);
    let each = |see: &mut dyn FnMut(&Line<'_>) -> Result<bool, Error>| -> Result<(), Error> {
        for file in files {
            let mut item = file.head.rows().start;
            file.rows(|bytes| {
                let line = Line::parse(bytes, columns).filter(|line| line.item == item);
                item += 1;
                line.map_or(Ok(false), |line| see(&line))
            })?;
        }
        Ok(())
    };
    each(&mut |line| {
        let texts = line.values.iter().copied().chain([line.status.name(), &line.message]);
        for (width, text) in widths[1..].iter_mut().zip(texts) {
            *width = text.len().max(*width);
        }
        messages += u64::from(!line.message.is_empty());
        Ok(true)
    })?;
    let datasets = datasets(head, &widths, messages);
    let mut failure = None;
    let written = write_table(output, &attributes(head), &datasets, |put| {
        let mut block = Block::new(&datasets, put);
        let taken =
            each(&mut |line| block.take(line, head).map_err(|source| not_written(output, source)));
        match taken {
            Ok(()) => block.flush(),
            Err(error) => {
                failure = Some(error);
                Err(io::Error::other("the rows cannot be read"))
            }
        }
    });
    match failure {
        Some(error) => Err(error),
        None => Ok(written?),
    }
}

/// Rows on their way into the datasets.
struct Block<'a, 'p> {
    datasets: &'a [Column],
    put: &'a mut Put<'p>,
    held: Vec<Vec<u8>>,
    first: u64,
    rows: u64,
    messages: u64,
}

impl<'a, 'p> Block<'a, 'p> {
    fn new(datasets: &'a [Column], put: &'a mut Put<'p>) -> Self {
        // Message 0 is empty, as the file is before anything is put.
        let held = vec![Vec::new(); datasets.len()];
        Self { datasets, put, held, first: 0, rows: 0, messages: 1 }
    }

    /// Takes a row; false if a field is not a number.
    fn take(&mut self, line: &Line<'_>, head: &ShardHeader) -> io::Result<bool> {
        self.held[0].extend((line.item as i64).to_le_bytes());
        for (k, field) in line.values.iter().enumerate() {
            match self.datasets[k + 1].values {
                Values::Text { width } => pad(&mut self.held[k + 1], field, width),
                _ => {
                    let Some(number) = Line::number(field) else { return Ok(false) };
                    self.held[k + 1].extend(number.to_le_bytes());
                }
            }
        }
        let status = head.columns.len() - 2;
        let width = self.datasets[status].values.size();
        pad(&mut self.held[status], line.status.name(), width);
        let mut number = 0;
        if !line.message.is_empty() {
            number = self.messages;
            self.messages += 1;
            let mut bytes = Vec::new();
            pad(&mut bytes, &line.message, self.datasets[status + 2].values.size());
            (self.put)(status + 2, number, &bytes)?;
        }
        self.held[status + 1].extend((number as i64).to_le_bytes());
        self.rows += 1;
        if self.rows == ROWS {
            self.flush()?;
        }
        Ok(true)
    }

    fn flush(&mut self) -> io::Result<()> {
        for (column, held) in self.held.iter_mut().enumerate() {
            if !held.is_empty() {
                (self.put)(column, self.first, held)?;
            }
            held.clear();
        }
        self.first += self.rows;
        self.rows = 0;
        Ok(())
    }
}

/// Whether a file is the HDF5 table of a sweep, whatever its name and its state.
pub(crate) fn is_table(path: &Path) -> bool {
    table::has_format(path, FORMAT)
}

fn pad(out: &mut Vec<u8>, text: &str, width: usize) {
    let end = out.len() + width;
    out.extend(text.as_bytes());
    out.resize(end, 0);
}

pub(super) struct FinishedTable {
    path: PathBuf,
    table: Table,
    pub(super) head: ShardHeader,
}

impl FinishedTable {
    pub(super) fn open(path: &Path) -> Result<Self, Error> {
        let table = Table::open(path, FORMAT).map_err(|e| e.coded(ErrorCode::Sweep))?;
        let head = head(&table)?.ok_or_else(|| {
            damaged(path, "its attributes are not those of a sweep of this layout")
        })?;
        let rows = head.count();
        let messages = table.columns.len() - 1;
        if let Some(short) = table.columns[..messages].iter().find(|c| c.rows != rows) {
            let what = format!("{} has {} rows, expected {rows}", short.name, short.rows);
            return Err(damaged(path, &what));
        }
        // Widths of texts are the file's own, everything else is what this program writes.
        let is_text = |c: &Column| matches!(c.values, Values::Text { .. });
        let expected = datasets(&head, &vec![1; head.columns.len()], 1);
        let is_other = |(found, wanted): &(&Column, &Column)| {
            is_text(found) != is_text(wanted) || !is_text(found) && found.values != wanted.values
        };
        if let Some((other, _)) = table.columns.iter().zip(&expected).find(is_other) {
            let what = format!("{} does not hold the kind of values it should", other.name);
            return Err(damaged(path, &what));
        }
        Ok(Self { path: path.into(), table, head })
    }

    /// Calls `see` with each item that `takes` and its numbers, in the order of their columns.
    pub(super) fn numbers(
        &self,
        takes: impl Fn(u64) -> bool,
        mut see: impl FnMut(&[f64]),
    ) -> Result<(), Error> {
        let numbers: Vec<usize> = self.head.number_columns().collect();
        let read = [&numbers[..], &[0, self.head.columns.len() - 2]].concat();
        self.rows(&read, |item, _, field| {
            if takes(item) {
                see(&numbers.iter().map(|&c| real(field(c))).collect::<Vec<_>>());
            }
            Ok(())
        })
    }

    fn tally(&self, tally: &mut Tally) -> Result<(), Error> {
        let numbers: Vec<usize> = self.head.number_columns().collect();
        let choices: Vec<usize> = self.head.choice_columns().collect();
        let number_of_message = self.head.columns.len() - 1;
        // Every column but the messages.
        let read: Vec<usize> = (0..self.table.columns.len() - 1).collect();
        self.rows(&read, |item, status, field| {
            let message = match integer(field(number_of_message)) {
                0 => String::new(),
                k => text(&self.table.read(number_of_message + 1, k as u64, 1)?).into_owned(),
            };
            let chosen: HashMap<usize, Cow<'_, str>> =
                choices.iter().map(|&c| (c, text(field(c)))).collect();
            let chosen = |c: usize| chosen.get(&c).map(|name| &**name);
            tally.see(item, numbers.iter().map(|&c| real(field(c))), chosen, status, &message);
            Ok(())
        })
    }

    /// Calls `see` with each item, its status, and its bytes by column, of those that are `read`.
    fn rows(
        &self,
        read: &[usize],
        mut see: impl for<'b> FnMut(u64, Status, &dyn Fn(usize) -> &'b [u8]) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let (items, status) = (self.head.rows(), self.head.columns.len() - 2);
        let mut columns = vec![Vec::new(); self.table.columns.len()];
        for first in items.clone().step_by(ROWS as usize) {
            let (row, rows) = (first - items.start, ROWS.min(items.end - first));
            for &c in read {
                columns[c] = self.table.read(c, row, rows)?;
            }
            for (k, item) in (first..first + rows).enumerate() {
                let field = |c: usize| {
                    let size = self.table.columns[c].values.size();
                    &columns[c][k * size..(k + 1) * size]
                };
                let found = text(field(status));
                let found = Status::ALL.into_iter().find(|s| s.name() == found);
                let found = found.filter(|_| integer(field(0)) == item as i64);
                see(item, found.ok_or_else(|| bad_row(&self.path, item))?, &field)?;
            }
        }
        Ok(())
    }
}

fn eight(bytes: &[u8]) -> [u8; 8] {
    bytes.try_into().unwrap_or_default()
}

fn real(bytes: &[u8]) -> f64 {
    f64::from_le_bytes(eight(bytes))
}

fn integer(bytes: &[u8]) -> i64 {
    i64::from_le_bytes(eight(bytes))
}

fn text(bytes: &[u8]) -> Cow<'_, str> {
    let end = bytes.iter().rposition(|b| *b != 0).map_or(0, |at| at + 1);
    String::from_utf8_lossy(&bytes[..end])
}

/// The head that a file's attributes and columns give.
fn head(table: &Table) -> Result<Option<ShardHeader>, Error> {
    let mut texts = Vec::new();
    for name in ["written_by", "hash", "shard"] {
        match table.attribute(name)? {
            Some(Attribute::Text(text)) => texts.push(text),
            _ => return Ok(None),
        }
    }
    if table.attribute("layout_version")? != Some(Attribute::Integer(LAYOUT)) {
        return Ok(None);
    }
    let Some(Attribute::Integer(items)) = table.attribute("items")? else { return Ok(None) };
    let mut columns: Vec<String> = table.columns.iter().map(|c| c.name.clone()).collect();
    let at = columns.iter().position(|c| c == MESSAGE_NUMBER);
    if at.is_none_or(|at| at + 2 != columns.len() || at < 2) {
        return Ok(None);
    }
    at.map(|at| columns.remove(at));
    let shard = texts[2]
        .split_once('/')
        .and_then(|(index, count)| Shard::new(index.parse().ok()?, count.parse().ok()?));
    let version = texts[0].strip_prefix("crumple ").unwrap_or_default().to_string();
    let parts = shard.zip(u64::try_from(items).ok());
    Ok(parts.map(|(shard, items)| ShardHeader {
        version,
        hash: texts[1].clone(),
        items,
        shard,
        columns,
    }))
}

/// Checks an output that is there: this sweep's, with all its rows.
pub(super) fn complete(output: &Path, head: &ShardHeader, tally: &mut Tally) -> Result<(), Error> {
    let file = FinishedTable::open(output).map_err(|_| foreign(output))?;
    file.head.check_same(output, head)?;
    file.tally(tally)
}
