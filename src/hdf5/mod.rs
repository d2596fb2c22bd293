//! HDF5: the only module that uses the crate hdf5-pure, with everything built on it for the others.
//!
//! The names below are all that the program uses of that crate: a replacement has to provide
//! these.
//!
//! A skeleton is an HDF5 file whose large datasets get their values later, in any order and from any thread.
//!
//! The library encodes a file in memory, data included. Here each large dataset is given
//! untouched zeros, which take no memory, after a mark; where the
//! encoder passes on the marked bytes, their place in the file is noted and nothing is
//! written.
//!
//! This relies on behaviour that hdf5-pure does not guarantee: it passes the raw values of
//! a dataset to its writer in one piece, as they were given to it, if they have 8 KiB or more. (Fewer
//! it gathers with others in the buffer of a `BufWriter`: there the mark is looked for.) The crate's version is pinned
//! exactly, and the test below fails when that changes. [`Skeleton::write`] notices it too, and
//! its callers then report it or write in another way.

pub(crate) mod table;

use std::io::{Read, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::{fs, io};

use crate::file;
use crate::os::{allocate, read_at, write_all_at};
pub(crate) use hdf5_pure::{
    AttrValue, Dataset, DatasetBuilder, Error, File, FileAccessProperties, FileBuilder,
    FileLocking, FormatError, Group, Source,
};
use hdf5_pure::{Datatype, make_f32_type, make_f64_type};

/// Why a file is not opened as HDF5.
#[derive(Debug, thiserror::Error)]
pub(crate) enum OpenError {
    /// It cannot be read, or is not a file.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// It does not begin as HDF5 does.
    #[error("this is not an HDF5 file (its signature is missing)")]
    NoSignature,
    /// A mark in it says that a program writes it, or its lock that one has it open.
    #[error(
        "another program has this HDF5 file open for writing, or ended without closing it: close that program, or clear the mark it has left (h5clear -s FILE, of the HDF5 tools)"
    )]
    InUse,
    /// Its end is missing.
    #[error("this HDF5 file is cut off: it has {bytes} of {of} bytes; copy it again")]
    Cut {
        /// Its length.
        bytes: u64,
        /// The length that it states.
        of: u64,
    },
    /// It begins as HDF5 and cannot be read as such.
    #[error("this is not an HDF5 file ({detail})")]
    Damaged {
        /// What is wrong, in the words of the library.
        detail: String,
    },
}

/// The first read of an open file that the operating system failed. The library leaves out the attributes that
/// it cannot read, silently: callers check here that they got all.
#[derive(Clone, Default)]
pub(crate) struct Fault(Arc<OnceLock<String>>);

impl Fault {
    /// Fails if a read has failed.
    pub(crate) fn check(&self) -> io::Result<()> {
        self.0.get().map_or(Ok(()), |fault| Err(io::Error::other(fault.clone())))
    }
}

/// A file that is read by whole blocks, because the library asks for a few bytes at a time; it notes its fault.
struct Blocks {
    file: fs::File,
    length: u64,
    /// The blocks read last, by their ordinals in the file, the latest at the end.
    latest: Mutex<Vec<(u64, Vec<u8>)>>,
    fault: Fault,
}

impl Blocks {
    const BYTES: u64 = 1 << 14;
    /// Those of one case and of the tables that lead to it.
    const KEPT: usize = 16;

    fn read(&self, offset: u64, bytes: &mut [u8]) -> Result<(), FormatError> {
        let mut filled = 0;
        while filled < bytes.len() {
            let failed = |detail: String| FormatError::Source(detail);
            match read_at(&self.file, &mut bytes[filled..], offset + filled as u64) {
                Ok(0) => return Err(failed("the file has become shorter".into())),
                Ok(count) => filled += count,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(failed(error.to_string())),
            }
        }
        Ok(())
    }

    /// Bytes within one block.
    fn read_block(&self, offset: u64, bytes: &mut [u8]) -> Result<(), FormatError> {
        let (number, from) = (offset / Self::BYTES, (offset % Self::BYTES) as usize);
        let mut latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner);
        let block = match latest.iter().position(|(of, _)| *of == number) {
            Some(k) => latest.remove(k),
            None => {
                let start = number * Self::BYTES;
                // The oldest gives its memory.
                let is_full = latest.len() == Self::KEPT;
                let mut block = if is_full { latest.remove(0).1 } else { Vec::new() };
                block.resize(Self::BYTES.min(self.length - start) as usize, 0);
                self.read(start, &mut block)?;
                (number, block)
            }
        };
        bytes.copy_from_slice(&block.1[from..from + bytes.len()]);
        latest.push(block);
        Ok(())
    }
}

impl Source for Blocks {
    fn len(&self) -> u64 {
        self.length
    }

    fn read_at(&self, offset: u64, bytes: &mut [u8]) -> Result<(), FormatError> {
        let length = bytes.len() as u64;
        let end =
            offset.checked_add(length).ok_or(FormatError::OffsetOverflow { offset, length })?;
        if end > self.length {
            let [expected, available] =
                [end, self.length].map(|n| usize::try_from(n).unwrap_or(usize::MAX));
            return Err(FormatError::UnexpectedEof { expected, available });
        }
        let read = if length >= Self::BYTES {
            self.read(offset, bytes)
        } else {
            let first = (Self::BYTES - offset % Self::BYTES).min(length) as usize;
            let (head, tail) = bytes.split_at_mut(first);
            self.read_block(offset, head).and_then(|()| {
                if tail.is_empty() { Ok(()) } else { self.read_block(offset + first as u64, tail) }
            })
        };
        if let Err(FormatError::Source(fault)) = &read {
            self.fault.0.get_or_init(|| fault.clone());
        }
        read
    }
}

/// Opens an HDF5 file for reading; values are not read yet.
pub(crate) fn open(path: &Path) -> Result<(File, Fault), OpenError> {
    let file = file::open(path)?;
    if !hdf5_pure::is_hdf5(path)? {
        return Err(OpenError::NoSignature);
    }
    let fault = Fault::default();
    let length = file.metadata()?.len();
    let mut head = Vec::new();
    (&file).take(SUPERBLOCK_BYTES).read_to_end(&mut head)?;
    if let Some(of) = stated_length(&head).filter(|of| *of > length) {
        return Err(OpenError::Cut { bytes: length, of });
    }
    let opened =
        File::from_source(Blocks { file, length, latest: Mutex::default(), fault: fault.clone() });
    fault.check()?;
    match opened {
        Ok(file) => Ok((file, fault)),
        Err(Error::FileMarkedInUse(_) | Error::FileLocked(_)) => Err(OpenError::InUse),
        Err(other) => Err(OpenError::Damaged { detail: other.to_string() }),
    }
}

/// As many bytes hold the length that a file states.
const SUPERBLOCK_BYTES: u64 = 52;

/// The end-of-file address of the superblock at the beginning of a file, of addresses of 8 bytes (HDF5 file format specification,
/// section II.A).
fn stated_length(head: &[u8]) -> Option<u64> {
    let (width_at, at) = match *head.get(8)? {
        0 => (13, 40),
        1 => (13, 44),
        // One that a program has open for writing says so, and states more than there is yet.
        2 | 3 if head.get(11)? & 1 == 0 => (9, 28),
        _ => return None,
    };
    let bytes = head.get(at..at + 8).filter(|_| head[width_at] == 8)?;
    bytes.try_into().ok().map(u64::from_le_bytes)
}

/// Writes a file; to any place through one type, since the library would be compiled once more for each.
pub(crate) fn write_to(file: FileBuilder, place: &mut dyn Write) -> Result<(), Error> {
    file.finish_to(place)
}

/// Bytes of a dataset's values, at least as many as they take as doubles.
pub(crate) fn declared_bytes(dataset: &Dataset) -> Result<u64, Error> {
    let size = dataset.element_size()?.max(8);
    Ok(dataset.shape()?.iter().fold(size, |bytes, &n| bytes.saturating_mul(n)))
}

/// First bytes of the values that come later; the number of the dataset follows.
const MARK: &[u8; 16] = b"VALUESCOMELATER!";
const MARK_BYTES: usize = 24;

/// The datasets that get their values later.
#[derive(Default)]
pub(crate) struct Skeleton {
    lengths: Vec<usize>,
}

impl Skeleton {
    /// Gives a dataset of doubles its shape and its place.
    pub(crate) fn reserve(&mut self, dataset: &mut DatasetBuilder, shape: &[u64]) {
        self.reserve_values(dataset, make_f64_type(), size_of::<f64>(), shape);
    }

    /// The same of single precision.
    pub(crate) fn reserve_single(&mut self, dataset: &mut DatasetBuilder, shape: &[u64]) {
        self.reserve_values(dataset, make_f32_type(), size_of::<f32>(), shape);
    }

    /// Gives a dataset of values of `size` bytes its shape and its place. In fewer bytes than a mark has the
    /// place is not found, and [`Skeleton::write`] gives `None`.
    pub(crate) fn reserve_values(
        &mut self,
        dataset: &mut DatasetBuilder,
        datatype: Datatype,
        size: usize,
        shape: &[u64],
    ) {
        let values = shape.iter().product::<u64>();
        let mut bytes = vec![0u8; values as usize * size];
        let mark = mark(self.lengths.len());
        let count = mark.len().min(bytes.len());
        bytes[..count].copy_from_slice(&mark[..count]);
        self.lengths.push(bytes.len());
        dataset.with_raw_data(datatype, bytes, values).with_shape(shape);
    }

    /// Writes everything but the values; where those of each dataset begin. `None` if the
    /// encoder did not hand all of them over in one piece.
    pub(crate) fn write(
        &self,
        builder: FileBuilder,
        file: &fs::File,
    ) -> io::Result<Option<Vec<u64>>> {
        let offsets = vec![None; self.lengths.len()];
        let mut sink = Sink { lengths: &self.lengths, file, at: 0, offsets, others: Vec::new() };
        write_to(builder, &mut sink).map_err(|error| match error {
            Error::Io(error) => error,
            error => io::Error::other(error),
        })?;
        for (number, offset) in sink.offsets.iter_mut().enumerate() {
            let find = |(at, bytes): &(u64, Vec<u8>)| {
                memchr::memmem::find(bytes, &mark(number)).map(|found| at + found as u64)
            };
            *offset = offset.or_else(|| sink.others.iter().find_map(find));
        }
        let offsets: Option<Vec<u64>> = sink.offsets.into_iter().collect();
        if offsets.is_some() {
            allocate(file, sink.at)?;
        }
        Ok(offsets)
    }
}

fn mark(number: usize) -> [u8; MARK_BYTES] {
    let mut mark = [0; MARK_BYTES];
    mark[..16].copy_from_slice(MARK);
    mark[16..].copy_from_slice(&(number as u64).to_le_bytes());
    mark
}

/// Takes the encoder's bytes and leaves out those that are marked.
struct Sink<'a> {
    lengths: &'a [usize],
    file: &'a fs::File,
    at: u64,
    offsets: Vec<Option<u64>>,
    /// The other bytes, in pieces that belong together.
    others: Vec<(u64, Vec<u8>)>,
}

impl Write for Sink<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let marked = bytes.get(16..MARK_BYTES).filter(|_| bytes.starts_with(MARK));
        let number = marked.and_then(|n| n.try_into().ok()).map(u64::from_le_bytes);
        let number = number.and_then(|n| usize::try_from(n).ok());
        match number.filter(|&n| self.lengths.get(n) == Some(&bytes.len())) {
            Some(number) => self.offsets[number] = Some(self.at),
            None => {
                write_all_at(self.file, bytes, self.at)?;
                match self.others.last_mut() {
                    Some((at, above)) if *at + above.len() as u64 == self.at => above.extend(bytes),
                    _ => self.others.push((self.at, bytes.to_vec())),
                }
            }
        }
        self.at += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hdf5;

    /// Whatever is asked for, in one block, over several, at the end or behind it.
    #[test]
    fn blocks_hold_the_bytes_of_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let size = Blocks::BYTES as usize;
        for length in [0, 1, size - 1, size, 20 * size, 20 * size + 7] {
            let bytes: Vec<u8> = (0..length).map(|i| (i * 31 % 251) as u8).collect();
            fs::write(&path, &bytes).unwrap();
            let file = fs::File::open(&path).unwrap();
            let (latest, fault) = (Mutex::default(), Fault::default());
            let blocks = Blocks { file, length: length as u64, latest, fault: fault.clone() };
            let near = |at: usize| [at.saturating_sub(1), at, at + 1];
            for offset in [0, size, 3 * size, 19 * size, length].into_iter().flat_map(near) {
                for count in [0, 1, 2, size - 1, size, size + 1, 2 * size] {
                    let mut found = vec![0; count];
                    let read = blocks.read_at(offset as u64, &mut found);
                    match bytes.get(offset..offset + count) {
                        Some(expected) => assert!(read.is_ok() && found == expected),
                        None => assert!(matches!(read, Err(FormatError::UnexpectedEof { .. }))),
                    }
                }
            }
            assert!(blocks.latest.lock().unwrap().len() <= Blocks::KEPT);
            fault.check().unwrap();
            // Cut meanwhile, it is a fault of the file.
            fs::write(&path, &bytes[..length / 2]).unwrap();
            blocks.latest.lock().unwrap().clear();
            let mut all = vec![0; length];
            assert_eq!(blocks.read_at(0, &mut all).is_ok(), length == 0);
            assert_eq!(fault.check().is_ok(), length == 0);
        }
    }

    /// What the module rests on: if this fails after an update of hdf5-pure, the encoder does not
    /// hand over the values of a dataset in one piece any more. Then histories go through memory
    /// and large sweeps cannot be converted: find another way to learn where the values begin.
    #[test]
    fn the_encoder_hands_over_the_values_of_each_dataset_in_one_piece() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.h5");
        let file = fs::File::create(&path).unwrap();
        let mut out = FileBuilder::new();
        let mut skeleton = Skeleton::default();
        // From 8 KiB on.
        let shapes = [(1024, 1), (1, 1024), (70_000, 11)];
        for (k, (rows, columns)) in shapes.into_iter().enumerate() {
            skeleton.reserve(out.create_dataset(&format!("d{k}")), &[rows as u64, columns as u64]);
        }
        out.create_dataset("small").with_f64_data(&[1.0, 2.0]);
        let offsets = skeleton.write(out, &file).unwrap();
        let offsets = offsets.expect("hdf5-pure hands values over in pieces: see this test");
        let value = |k: usize, i: usize| (k * 1_000_000 + i) as f64;
        for (k, (rows, columns)) in shapes.into_iter().enumerate() {
            let bytes: Vec<u8> =
                (0..rows * columns).flat_map(|i| value(k, i).to_le_bytes()).collect();
            write_all_at(&file, &bytes, offsets[k]).unwrap();
        }
        let (read, _) = hdf5::open(&path).unwrap();
        for (k, (rows, columns)) in shapes.into_iter().enumerate() {
            let dataset = read.dataset(&format!("d{k}")).unwrap();
            assert_eq!(dataset.shape().unwrap(), [rows as u64, columns as u64]);
            let expected: Vec<f64> = (0..rows * columns).map(|i| value(k, i)).collect();
            assert!(dataset.read_f64().unwrap() == expected, "d{k}");
        }
        assert_eq!(read.dataset("small").unwrap().read_f64().unwrap(), [1.0, 2.0]);
    }

    #[test]
    fn values_that_are_not_handed_over_by_themselves_are_noticed() {
        for rows in [1, 2, 3, 1000] {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("a.h5");
            let file = fs::File::create(&path).unwrap();
            let mut out = FileBuilder::new();
            let mut skeleton = Skeleton::default();
            for name in ["c", "d", "e"] {
                skeleton.reserve(out.create_dataset(name), &[rows, 1]);
            }
            let Some(offsets) = skeleton.write(out, &file).unwrap() else {
                assert!(rows < 3, "{rows} values");
                continue;
            };
            for (value, offset) in [1.0f64, 2.0, 3.0].into_iter().zip(offsets) {
                let bytes = value.to_le_bytes().repeat(rows as usize);
                write_all_at(&file, &bytes, offset).unwrap();
            }
            let (read, _) = hdf5::open(&path).unwrap();
            for (value, name) in [(1.0, "c"), (2.0, "d"), (3.0, "e")] {
                let values = read.dataset(name).unwrap().read_f64().unwrap();
                assert_eq!(values, vec![value; rows as usize], "{rows} values");
            }
        }
    }
}
