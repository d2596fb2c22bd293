//! One writer at a time: locks that the kernel frees when their holder ends.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use super::{explained, target_of};
use crate::error::{Error, error};

/// Held while a database or the result of a sweep is read, changed and written back.
#[derive(Debug)]
pub struct WriterLock {
    /// The kernel frees the lock with the file, however the process ends.
    _file: File,
    path: PathBuf,
}

impl WriterLock {
    /// Takes the lock of the file at `target`: one next to it, of its name and `.lock`.
    ///
    /// # Errors
    /// Of code [`ErrorCode::Locked`](crate::error::ErrorCode::Locked) if another process holds it, and of code
    /// [`ErrorCode::Io`](crate::error::ErrorCode::Io) if its file cannot be created.
    pub fn take(target: &Path) -> Result<Self, Error> {
        let error = |source| {
            let source = explained(target, source);
            error!(
                Io,
                "cannot write {}, because its lock file cannot be created: {source}",
                target.display()
            )
            .caused_by(source)
        };
        // A link and its target are one file.
        let real = target_of(target).map_err(error)?;
        let mut name = real.file_name().unwrap_or_default().to_os_string();
        name.push(".lock");
        let path = real.with_file_name(name);
        match lock(&path).map_err(error)? {
            Some(file) => Ok(Self { _file: file, path }),
            None => Err(error!(
                Locked,
                "{} is being written by another process: try again when it has finished",
                target.display()
            )),
        }
    }
}

impl Drop for WriterLock {
    fn drop(&mut self) {
        // Nothing depends on the file being gone.
        let _ = fs::remove_file(&self.path);
    }
}

/// Opens the file at `path`, which is made if need be, and locks it; `None` if another process
/// holds it. The kernel frees the lock with the file, however the process ends.
pub(super) fn lock(path: &Path) -> io::Result<Option<File>> {
    loop {
        // Only a file: opening a pipe would wait, and a link leads elsewhere.
        if fs::symlink_metadata(path).is_ok_and(|meta| !meta.is_file()) {
            fs::remove_file(path)?;
        }
        let file =
            OpenOptions::new().create(true).truncate(false).read(true).write(true).open(path)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Ok(None),
            Err(TryLockError::Error(error)) => return Err(error),
        }
        // The last holder removes the file or renames it; a lock on that protects nothing.
        if is_at(&file, path) {
            return Ok(Some(file));
        }
    }
}

#[cfg(unix)]
pub(super) fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let identity = |m: fs::Metadata| (m.dev(), m.ino());
    file.metadata().map(identity).ok() == fs::symlink_metadata(path).map(identity).ok()
}

#[cfg(not(unix))]
pub(super) fn is_at(_: &File, path: &Path) -> bool {
    path.exists()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::ErrorCode;

    #[test]
    fn a_second_writer_is_known() {
        let folder = tempfile::tempdir().unwrap();
        let database = folder.path().join("a.h5");
        let held = WriterLock::take(&database).unwrap();
        assert_eq!(WriterLock::take(&database).unwrap_err().code(), ErrorCode::Locked);
        drop(held);
        WriterLock::take(&database).unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
