//! One writer at a time: a lock beside the database, freed when its holder ends.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

/// Why the lock was not given.
#[derive(Debug, thiserror::Error)]
pub enum LockError {
    #[error("{path} is being written by another process: try again when it has finished")]
    Busy { path: PathBuf },
    #[error(
        "cannot write {path}, because no lock can be made beside it: {source}; check that the folder exists and is writable"
    )]
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
        let error = |source| LockError::Io { path: database.into(), source };
        // A link and its target are one database.
        let real = fs::canonicalize(database).unwrap_or_else(|_| database.to_path_buf());
        let mut name = real.file_name().unwrap_or_default().to_os_string();
        name.push(".lock");
        let path = real.with_file_name(name);
        loop {
            let file = OpenOptions::new()
                .create(true)
                .truncate(false)
                .write(true)
                .open(&path)
                .map_err(error)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    return Err(LockError::Busy { path: database.into() });
                }
                Err(TryLockError::Error(source)) => return Err(error(source)),
            }
            // The last holder removes the file; a lock on a removed file protects nothing.
            if is_at(&file, &path) {
                return Ok(Self { _file: file, path });
            }
        }
    }
}

#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let identity = |m: fs::Metadata| (m.dev(), m.ino());
    file.metadata().map(identity).ok() == fs::metadata(path).map(identity).ok()
}

#[cfg(not(unix))]
fn is_at(_: &File, path: &Path) -> bool {
    path.exists()
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
