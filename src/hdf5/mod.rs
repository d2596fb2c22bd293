//! HDF5: the one room that names the crate hdf5-pure, and what is built on it for all others.
//!
//! The names below are all that the program uses of that crate: a replacement has to offer
//! these.

pub(crate) mod skeleton;
pub(crate) mod table;

use std::io;
use std::path::Path;

use crate::file;
pub(crate) use hdf5_pure::{
    AttrValue, Dataset, DatasetBuilder, Error, File, FileAccessProperties, FileBuilder,
    FileLocking, Group,
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

/// Opens an HDF5 file for reading; values are not read yet.
pub(crate) fn open(path: &Path) -> Result<File, OpenError> {
    file::open(path)?;
    if !hdf5_pure::is_hdf5(path)? {
        return Err(OpenError::NoSignature);
    }
    File::open_streaming(path).map_err(|e| match e {
        Error::FileMarkedInUse(_) | Error::FileLocked(_) => OpenError::InUse,
        other => OpenError::Damaged { detail: other.to_string() },
    })
}

/// Bytes of a dataset's values, at least as many as they take as doubles.
pub(crate) fn declared_bytes(dataset: &Dataset) -> Result<u64, Error> {
    let size = dataset.element_size()?.max(8);
    Ok(dataset.shape()?.iter().fold(size, |bytes, &n| bytes.saturating_mul(n)))
}

#[cfg(test)]
pub(crate) use hdf5_pure::{FormatError, Source};
