//! Tables of named columns in HDF5, written and read in pieces of rows.

use std::collections::HashSet;
use std::fs::File as DiskFile;
use std::io;
use std::path::{Path, PathBuf};

use hdf5_pure::{CharacterSet, Datatype, StringPadding, make_f64_type, make_i64_type};

use super::Skeleton;
use super::{AttrValue, Dataset, Fault, File, FileBuilder, OpenError, declared_bytes};
use crate::error::{Error, error};
use crate::file::write_at;
use crate::os::write_all_at;

/// What the values of a column are; all have a fixed number of bytes, little endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Values {
    /// 64 bits, signed.
    Integer,
    Real,
    /// UTF-8, filled up with zero bytes.
    Text {
        /// Bytes of each value.
        width: usize,
    },
}

/// A column: a dataset of one dimension.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Column {
    /// Name of the column; that of its dataset where a dataset can have it.
    pub name: String,
    /// Kind of its values.
    pub values: Values,
    /// Number of its values.
    pub rows: u64,
}

/// An attribute of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Attribute {
    /// UTF-8.
    Text(String),
    /// 64 bits, signed.
    Integer(i64),
}

/// Takes values of a column from a row on, as bytes.
pub(crate) type Put<'a> = dyn FnMut(usize, u64, &[u8]) -> io::Result<()> + 'a;

impl Values {
    /// Bytes of one value.
    pub(crate) fn size(self) -> usize {
        match self {
            Self::Integer | Self::Real => 8,
            Self::Text { width } => width,
        }
    }

    fn datatype(self) -> Datatype {
        match self {
            Self::Integer => make_i64_type(),
            Self::Real => make_f64_type(),
            Self::Text { width } => Datatype::String {
                size: width as u32,
                padding: StringPadding::NullPad,
                charset: CharacterSet::Utf8,
            },
        }
    }
}

/// Name of the dataset that lists the columns in their order.
const COLUMNS: &str = "columns";
/// Bounds of what is held of a file, whatever it declares: the columns' names, and what is read
/// at once.
const MAX_COLUMNS_BYTES: u64 = 1 << 24;
const MAX_PIECE_BYTES: u64 = 1 << 30;
/// Columns up to this size are held in memory.
const SMALL_BYTES: u64 = 1 << 16;

/// Writes a table to `path` as a whole; `fill` puts the values of all columns, in any order.
///
/// A column is a dataset of its name, in which `_` replaces `/`; the dataset `columns` lists
/// the names in their order. Nothing is held but what `fill` holds and columns up to 64 KiB,
/// and the same values give the same bytes in whatever pieces they are put.
pub(crate) fn write_table(
    path: &Path,
    attributes: &[(&str, Attribute)],
    columns: &[Column],
    fill: impl FnOnce(&mut Put<'_>) -> io::Result<()>,
) -> Result<(), Error> {
    let mut held: Vec<Option<Vec<u8>>> = columns
        .iter()
        .map(|c| {
            let bytes = c.rows.saturating_mul(c.values.size() as u64);
            (bytes <= SMALL_BYTES).then(|| vec![0; bytes as usize])
        })
        .collect();
    let written = write_at(path, |file: &DiskFile| {
        // The places of the large columns do not depend on what the small ones hold, so the
        // file is laid out before there are values, and again with those that were held.
        let (out, skeleton) = lay_out(attributes, columns, &held)?;
        let Some(offsets) = skeleton.write(out, file)? else { return Ok(None) };
        let mut large = offsets.iter();
        let offsets: Vec<Option<u64>> =
            held.iter().map(|h| if h.is_none() { large.next().copied() } else { None }).collect();
        fill(&mut |column, row, values| {
            let from = row * columns[column].values.size() as u64;
            match (&mut held[column], offsets[column]) {
                (None, Some(offset)) => write_all_at(file, values, offset + from),
                (Some(held), _) => {
                    let target = held.get_mut(from as usize..from as usize + values.len());
                    target.ok_or(io::ErrorKind::InvalidInput)?.copy_from_slice(values);
                    Ok(())
                }
                (None, None) => Err(io::ErrorKind::InvalidInput.into()),
            }
        })?;
        let (out, skeleton) = lay_out(attributes, columns, &held)?;
        let again = skeleton.write(out, file)?;
        if again.is_none_or(|again| !again.iter().copied().eq(offsets.iter().copied().flatten())) {
            return Ok(None);
        }
        file.sync_all().map(Some)
    })?;
    written.ok_or_else(|| {
        error!(Other, "{}: a large column is not written in one piece", path.display())
    })
}

/// The file with the values of the columns that are held, and places for the others.
fn lay_out(
    attributes: &[(&str, Attribute)],
    columns: &[Column],
    held: &[Option<Vec<u8>>],
) -> io::Result<(FileBuilder, Skeleton)> {
    let mut out = FileBuilder::new();
    for (name, value) in attributes {
        let value = match value {
            Attribute::Text(text) => AttrValue::VarLenString(text.clone()),
            Attribute::Integer(number) => AttrValue::I64(*number),
        };
        out.set_attr(name, value);
    }
    let names: Vec<&str> = columns.iter().map(|c| c.name.as_str()).collect();
    out.create_dataset(COLUMNS).with_strings(&names).map_err(io::Error::other)?;
    let mut skeleton = Skeleton::default();
    for ((column, name), held) in columns.iter().zip(&dataset_names(&names)).zip(held) {
        let (datatype, size) = (column.values.datatype(), column.values.size());
        let dataset = out.create_dataset(name);
        match held {
            Some(held) => {
                dataset.with_raw_data(datatype, held.clone(), column.rows);
            }
            None => skeleton.reserve_values(dataset, datatype, size, &[column.rows]),
        }
    }
    Ok((out, skeleton))
}

/// Names that datasets can have, each another.
fn dataset_names(columns: &[&str]) -> Vec<String> {
    let mut taken = HashSet::from([COLUMNS.to_string()]);
    let mut name = |column: &&str| {
        let mut name = column.replace('/', "_");
        while taken.contains(&name) || name.is_empty() || name == "." {
            name.push('_');
        }
        taken.insert(name.clone());
        name
    };
    columns.iter().map(&mut name).collect()
}

/// Whether a file is HDF5 and its root attribute `format` is `format`.
pub(crate) fn has_format(path: &Path, format: &str) -> bool {
    let attributes = super::open(path).ok().and_then(|(file, _)| file.root().attrs().ok());
    let found = attributes.and_then(|mut all| all.remove("format"));
    found.is_some_and(|found| found.as_str() == Some(format))
}

/// Bytes of values that a table may declare for each byte of its file, if another program has compressed it, and
/// beside that: an empty dataset of any length takes none.
const DECLARED_PER_BYTE: u64 = 32;
const DECLARED_BYTES: u64 = 64 << 20;

/// An open table.
pub(crate) struct Table {
    path: PathBuf,
    file: File,
    fault: Fault,
    /// The columns' datasets: a dataset is looked up among all others by its name, so once.
    datasets: Vec<Dataset>,
    /// The columns in their order.
    pub columns: Vec<Column>,
}

impl Table {
    /// Opens a table whose root attribute `format` is `format`; values are not read yet.
    pub(crate) fn open(path: &Path, format: &str) -> Result<Self, Error> {
        let (file, fault) = super::open(path).map_err(|source| match source {
            OpenError::Io(source) => Error::io(path, source),
            source => error!(Other, "{}: {source}", path.display()),
        })?;
        let mut table =
            Self { path: path.into(), file, fault, datasets: Vec::new(), columns: Vec::new() };
        match table.attribute("format")? {
            Some(Attribute::Text(found)) if found == format => {}
            _ => return Err(table.damaged("format", format!("this is not a {format}"))),
        }
        let names = table.file.dataset(COLUMNS).and_then(|d| {
            let bytes = declared_bytes(&d)?;
            (bytes <= MAX_COLUMNS_BYTES).then(|| d.read_string()).transpose()
        });
        let too_many = || table.damaged(COLUMNS, "it declares more names than a table has".into());
        let names = names.map_err(|e| table.damaged(COLUMNS, e.to_string()))?;
        let names = names.ok_or_else(too_many)?;
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        for (name, dataset) in names.iter().zip(&dataset_names(&names)) {
            let dataset = table.file.dataset(dataset);
            let dataset = dataset.map_err(|e| table.damaged(name, e.to_string()))?;
            table.columns.push(table.column(name, &dataset)?);
            table.datasets.push(dataset);
        }
        let declared = |column: &Column| column.rows.saturating_mul(column.values.size() as u64);
        let declared = table.columns.iter().map(declared).fold(0, u64::saturating_add);
        let most = DECLARED_BYTES + DECLARED_PER_BYTE.saturating_mul(table.file.file_size());
        if declared > most {
            let what = "it declares more values than a file of this size holds";
            return Err(table.damaged(COLUMNS, what.into()));
        }
        Ok(table)
    }

    fn column(&self, name: &str, dataset: &Dataset) -> Result<Column, Error> {
        let failed = |e: hdf5_pure::Error| self.damaged(name, e.to_string());
        let values = match dataset.datatype().map_err(failed)? {
            Datatype::String { size, .. } if size > 0 => Values::Text { width: size as usize },
            found if found == make_i64_type() => Values::Integer,
            found if found == make_f64_type() => Values::Real,
            _ => return Err(self.damaged(name, "values of an unknown kind".into())),
        };
        let rows = dataset.shape().map_err(failed)?;
        let rows = rows.first().copied().unwrap_or(0);
        Ok(Column { name: name.into(), values, rows })
    }

    pub(crate) fn attribute(&self, name: &str) -> Result<Option<Attribute>, Error> {
        let all = self.file.root().attrs();
        self.fault.check().map_err(|source| Error::io(&self.path, source))?;
        let mut all = all.map_err(|e| self.damaged(name, e.to_string()))?;
        Ok(match all.remove(name) {
            Some(AttrValue::VarLenString(text) | AttrValue::String(text)) => {
                Some(Attribute::Text(text))
            }
            Some(AttrValue::I64(number)) => Some(Attribute::Integer(number)),
            _ => None,
        })
    }

    pub(crate) fn read(&self, column: usize, row: u64, rows: u64) -> Result<Vec<u8>, Error> {
        let name = &self.columns[column].name;
        let bytes = rows.saturating_mul(self.columns[column].values.size() as u64);
        if bytes > MAX_PIECE_BYTES {
            return Err(self.damaged(name, format!("its texts have {bytes} bytes in {rows} rows")));
        }
        let bytes = self.datasets[column].read_raw_rows(row, rows);
        let bytes = bytes.map_err(|e| self.damaged(name, e.to_string()))?;
        if bytes.len() as u64 == rows * self.columns[column].values.size() as u64 {
            Ok(bytes)
        } else {
            Err(self.damaged(name, format!("{} bytes of {rows} rows", bytes.len())))
        }
    }

    fn damaged(&self, place: &str, detail: String) -> Error {
        error!(Other, "{}: {place}: {detail}", self.path.display())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Small and large, put in pieces of any size: the values come back.
    #[test]
    fn tables_come_back() {
        let folder = tempfile::tempdir().unwrap();
        for (rows, others) in
            [(0u64, 1), (1, 0), (5, 5), (70_000, 70_000), (70_000, 1), (70_000, 0)]
        {
            let path = folder.path().join(format!("{rows}-{others}.h5"));
            let column = |name: &str, values, rows| Column { name: name.into(), values, rows };
            let columns = [
                column("item", Values::Integer, rows),
                column("x_m[A/1]", Values::Real, rows),
                column("name", Values::Text { width: 7 }, rows),
                // As of a large table in which hardly any row has a message.
                column("message", Values::Text { width: 3 }, others),
            ];
            let value = |c: usize, row: u64| match c {
                0 => (row as i64 - 3).to_le_bytes().to_vec(),
                1 => (row as f64 * 0.1).to_le_bytes().to_vec(),
                2 => format!("{:<7}", row % 1000).into_bytes(),
                _ => format!("{:<3}", row % 10).into_bytes(),
            };
            let bytes = |c: usize, from: u64, to: u64| -> Vec<u8> {
                (from..to).flat_map(|row| value(c, row)).collect()
            };
            let mut files = Vec::new();
            for piece in [3, 7_777] {
                write_table(
                    &path,
                    &[("format", Attribute::Text("a table".into())), ("n", Attribute::Integer(5))],
                    &columns,
                    |put| {
                        for (c, column) in columns.iter().enumerate() {
                            for from in (0..column.rows).step_by(piece) {
                                let to = column.rows.min(from + piece as u64);
                                put(c, from, &bytes(c, from, to))?;
                            }
                        }
                        Ok(())
                    },
                )
                .unwrap();
                files.push(std::fs::read(&path).unwrap());
            }
            assert!(files[0] == files[1]);
            let table = Table::open(&path, "a table").unwrap();
            assert_eq!(table.columns, columns);
            assert_eq!(table.attribute("n").unwrap(), Some(Attribute::Integer(5)));
            for (c, column) in columns.iter().enumerate() {
                let rows = column.rows;
                assert!(table.read(c, 0, rows).unwrap() == bytes(c, 0, rows));
                if rows > 2 {
                    assert!(table.read(c, 1, 2).unwrap() == bytes(c, 1, 3));
                }
            }
            assert!(Table::open(&path, "another").is_err());
        }
    }
}
