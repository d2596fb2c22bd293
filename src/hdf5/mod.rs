//! HDF5: the only module that uses the crate hdf5-pure, with everything built on it for the others.
//!
//! The names below are all that the program uses of that crate: a replacement has to provide
//! these.

pub(crate) mod skeleton;
pub(crate) mod table;

use std::path::Path;
use std::sync::{Arc, OnceLock};
use std::{fs, io};

use crate::file;
pub(crate) use hdf5_pure::{
    AttrValue, Dataset, DatasetBuilder, Error, File, FileAccessProperties, FileBuilder,
    FileLocking, FormatError, Group, ReadSeekSource, Source,
};

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

/// A file that notes its fault.
struct Noting(ReadSeekSource<fs::File>, Fault);

impl Source for Noting {
    fn len(&self) -> u64 {
        self.0.len()
    }

    fn read_at(&self, offset: u64, bytes: &mut [u8]) -> Result<(), FormatError> {
        let read = self.0.read_at(offset, bytes);
        if let Err(FormatError::Source(fault)) = &read {
            self.1.0.get_or_init(|| fault.clone());
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
    let source = ReadSeekSource::new(file).map_err(|e| io::Error::other(e.to_string()))?;
    let opened = File::from_source(Noting(source, fault.clone()));
    fault.check()?;
    match opened {
        Ok(file) => Ok((file, fault)),
        Err(Error::FileMarkedInUse(_) | Error::FileLocked(_)) => Err(OpenError::InUse),
        Err(other) => Err(OpenError::Damaged { detail: other.to_string() }),
    }
}

/// Bytes of a dataset's values, at least as many as they take as doubles.
pub(crate) fn declared_bytes(dataset: &Dataset) -> Result<u64, Error> {
    let size = dataset.element_size()?.max(8);
    Ok(dataset.shape()?.iter().fold(size, |bytes, &n| bytes.saturating_mul(n)))
}
