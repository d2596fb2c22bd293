//! One writer at a time: a lock beside the database, freed when its holder ends.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use crate::file;

/// Why the lock was not given.
#[derive(Debug, thiserror::Error)]
pub enum LockError {
    #[error("{path} is being written by another process: try again when it has finished")]
    Busy { path: PathBuf },
    #[error("cannot write {path}, because no lock can be made beside it: {source}")]
    Io { path: PathBuf, source: io::Error },
}

/// Held while a database is read, changed and written back.
#[derive(Debug)]
pub struct WriterLock {
    /// The kernel frees the lock with the file, however the process ends.
    _file: File,
    path: PathBuf,
}

impl WriterLock {
    /// Takes the lock of the database at `database`.
    ///
    /// # Errors
    /// [`LockError::Busy`] if another process holds it.
    pub fn take(database: &Path) -> Result<Self, LockError> {
        let error = |source| {
            let source = file::explained(database, source);
            LockError::Io { path: database.into(), source }
        };
        // A link and its target are one database.
        let real = fs::canonicalize(database).unwrap_or_else(|_| database.to_path_buf());
        let mut name = real.file_name().unwrap_or_default().to_os_string();
        name.push(".lock");
        let path = real.with_file_name(name);
        match file::lock(&path).map_err(error)? {
            Some(file) => Ok(Self { _file: file, path }),
            None => Err(LockError::Busy { path: database.into() }),
        }
    }
}

impl Drop for WriterLock {
    fn drop(&mut self) {
        // Nothing depends on the file being gone.
        let _ = fs::remove_file(&self.path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_writer_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let database = folder.path().join("a.h5");
        let held = WriterLock::take(&database).unwrap();
        assert!(matches!(WriterLock::take(&database), Err(LockError::Busy { .. })));
        drop(held);
        WriterLock::take(&database).unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
