//! Atomic writing: to a draft next to the target, which is then renamed over it; one writer at a time.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::{explained, folder_of, if_there, target_of};
use crate::error::{Error, error};
use crate::os::{LOCKS_EXCLUDE_ALL, is_at};

/// The error of a file that cannot be written; what was there before still is.
pub(crate) fn not_written(path: &Path, source: io::Error) -> Error {
    let source = explained(path, source);
    let unchanged = if path.is_file() { "; the previous content is unchanged" } else { "" };
    error!(Io, "cannot write {}: {source}{unchanged}", path.display()).caused_by(source)
}

/// Writes `bytes` to `path` as a whole: to a temporary file next to it, then by renaming.
///
/// A device or a pipe cannot be renamed over and is written directly.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    write_all_whole(&[(path, bytes)])
}

/// Writes several files as `write_whole` does: none is renamed into place before all of
/// them are written.
pub(crate) fn write_all_whole(files: &[(&Path, &[u8])]) -> Result<(), Error> {
    let mut prepared: Vec<(&Path, Draft)> = Vec::new();
    for (path, bytes) in files {
        let failed = |source| not_written(path, source);
        let target = target_of(path).map_err(failed)?;
        if prepared.iter().any(|(_, draft)| draft.target == target) {
            return Err(failed(io::Error::new(
                io::ErrorKind::InvalidInput,
                "it is named twice: name each file once",
            )));
        }
        if let Some(draft) = prepare(path, bytes).map_err(failed)? {
            prepared.push((path, draft));
        }
    }
    for (path, draft) in prepared {
        draft.place().map_err(|source| not_written(path, source))?;
    }
    Ok(())
}

/// Writes a file as `write_whole` does, by a function that fills it at any positions.
/// Gives back what the function gives; nothing is replaced if that is `None`.
///
/// The content is not forced to the disk: it is derived from a file that is still there.
///
/// # Errors
/// [`Error`] names the path; nothing half-written stays behind.
pub fn write_at<T>(
    path: &Path,
    fill: impl FnOnce(&File) -> io::Result<Option<T>>,
) -> Result<Option<T>, Error> {
    let write = || -> io::Result<Option<T>> {
        let draft = Draft::beside(path)?;
        let done = fill(&draft.file)?;
        if done.is_some() {
            draft.place()?;
        }
        Ok(done)
    };
    write().map_err(|source| not_written(path, source))
}

/// Writes a file as `write_whole` does, by a function that is given the path of a temporary
/// file, which it creates or empties and does not remove.
pub(crate) fn write_by_path<E: From<Error>>(
    path: &Path,
    fill: impl FnOnce(&Path) -> Result<(), E>,
) -> Result<(), E> {
    write_beside(path, LOCKS_EXCLUDE_ALL, fill)
}

/// The same; `beside` has a second file filled, where no other handle can write the locked draft.
fn write_beside<E: From<Error>>(
    path: &Path,
    beside: bool,
    fill: impl FnOnce(&Path) -> Result<(), E>,
) -> Result<(), E> {
    let failed = |source| not_written(path, source);
    let draft = Draft::beside(path).map_err(failed)?;
    if !beside {
        fill(&draft.path)?;
        draft.file.sync_all().and_then(|()| draft.place()).map_err(failed)?;
        return Ok(());
    }
    let work = draft.work();
    let place = || {
        fs::set_permissions(&work, fs::metadata(&draft.path)?.permissions())?;
        OpenOptions::new().write(true).open(&work)?.sync_all()?;
        fs::rename(&work, &draft.target)
    };
    let done = fill(&work).and_then(|()| Ok(place().map_err(failed)?));
    if done.is_err() {
        let _ = fs::remove_file(&work);
    }
    done
}

/// Writes the bytes to a draft next to their target; to a device at once.
fn prepare(path: &Path, bytes: &[u8]) -> io::Result<Option<Draft>> {
    if fs::metadata(path).is_ok_and(|meta| !meta.is_file() && !meta.is_dir()) {
        let mut device = OpenOptions::new().write(true).open(path)?;
        device.write_all(bytes)?;
        device.flush()?;
        return Ok(None);
    }
    let mut draft = Draft::beside(path)?;
    draft.file.write_all(bytes)?;
    draft.file.sync_all()?;
    Ok(Some(draft))
}

/// Longer names of targets are shortened to their hash: names of files have up to 255 bytes.
const MAX_NAME_BYTES: usize = 200;

/// A file under work next to its target. Its name is made of the target's, so that what a killed
/// process left is taken up and emptied by the next; it is locked, so that of two processes that
/// write one target the second gets an error.
struct Draft {
    file: File,
    path: PathBuf,
    target: PathBuf,
}

impl Draft {
    fn beside(path: &Path) -> io::Result<Self> {
        let existing = match if_there(fs::metadata(path))? {
            Some(meta) if meta.is_dir() => {
                let message = "this is a folder: name a file in it";
                return Err(io::Error::new(io::ErrorKind::IsADirectory, message));
            }
            Some(meta) if !meta.is_file() => {
                let message = "this is a device or a pipe, which cannot hold a file of this kind";
                return Err(io::Error::new(io::ErrorKind::Unsupported, message));
            }
            there => there.map(|meta| meta.permissions()),
        };
        if existing.as_ref().is_some_and(fs::Permissions::readonly) {
            let message = "the file is read-only: name another, or make it writable";
            return Err(io::Error::new(io::ErrorKind::PermissionDenied, message));
        }
        let target = target_of(path)?;
        let name = target.file_name().unwrap_or_default();
        let mut own = OsString::from(".crumple-");
        if name.len() <= MAX_NAME_BYTES {
            own.push(name);
        } else {
            own.push(&*blake3::hash(name.as_encoded_bytes()).to_hex());
        }
        own.push(".part");
        let path = folder_of(&target).join(own);
        let file = lock(&path)?.ok_or_else(|| {
            let message = "another process is writing it: try again when it has finished";
            io::Error::new(io::ErrorKind::ResourceBusy, message)
        })?;
        let draft = Self { file, path, target };
        draft.file.set_len(0)?;
        if LOCKS_EXCLUDE_ALL {
            // Of a process that was killed.
            let _ = fs::remove_file(draft.work());
        }
        if let Some(permissions) = existing {
            draft.file.set_permissions(permissions)?;
        }
        Ok(draft)
    }

    /// Where a file is made that is written beside it.
    fn work(&self) -> PathBuf {
        self.path.with_extension("work")
    }

    /// Renames it over its target.
    fn place(self) -> io::Result<()> {
        fs::rename(&self.path, &self.target)
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        // Gone if it was placed, and then the name may be another process's.
        if is_at(&self.file, &self.path) {
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Held while a database or the result of a sweep is read, changed and written back.
#[derive(Debug)]
pub(crate) struct WriterLock {
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
    pub(crate) fn take(target: &Path) -> Result<Self, Error> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::ErrorCode;

    #[test]
    fn replaces_a_file_as_a_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_whole(&path, b"old").unwrap();
        write_whole(&path, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary file stays");
    }

    #[test]
    fn names_the_path_it_cannot_write() {
        let error = write_whole(Path::new("/no/such/folder/a.txt"), b"x").unwrap_err();
        assert_eq!(
            error.to_string(),
            "cannot write /no/such/folder/a.txt: the folder /no/such/folder does not exist: create it, or name another"
        );
    }

    #[test]
    fn what_a_killed_writer_left_is_cleared_by_the_next() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.csv".to_string(), "long".repeat(60)] {
            let path = folder.path().join(name);
            // As a killed process does: the draft stays, its lock is freed.
            let draft = Draft::beside(&path).unwrap();
            (&draft.file).write_all(b"half of a longer content").unwrap();
            let left = draft.path.clone();
            fs::hard_link(&left, folder.path().join("kept")).unwrap();
            drop(draft);
            fs::rename(folder.path().join("kept"), &left).unwrap();
            write_whole(&path, b"new").unwrap();
            assert_eq!(fs::read(&path).unwrap(), b"new");
            assert!(!left.exists());
        }
    }

    #[test]
    fn a_second_writer_of_a_file_is_known() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        write_whole(&path, b"old").unwrap();
        write_at(&path, |file| {
            let mut file = file;
            file.write_all(b"first")?;
            let error = write_whole(&path, b"second").unwrap_err().to_string();
            assert!(error.contains("a.csv: another process is writing it: try again"), "{error}");
            assert!(error.ends_with("the previous content is unchanged"), "{error}");
            assert_eq!(fs::read(&path).unwrap(), b"old");
            Ok(Some(()))
        })
        .unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"first");
        let twice = write_all_whole(&[(&path, b"1"), (&folder.path().join("./a.csv"), b"2")]);
        assert!(twice.unwrap_err().to_string().contains("it is named twice"));
        assert_eq!(fs::read(&path).unwrap(), b"first");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_in_the_drafts_place_is_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let victim = folder.path().join("victim");
        fs::write(&victim, "mine").unwrap();
        std::os::unix::fs::symlink(&victim, folder.path().join(".crumple-a.csv.part")).unwrap();
        write_whole(&folder.path().join("a.csv"), b"new").unwrap();
        assert_eq!(fs::read(&victim).unwrap(), b"mine");
        assert_eq!(fs::read(folder.path().join("a.csv")).unwrap(), b"new");
    }

    #[test]
    fn a_file_written_by_its_path_replaces_the_old_one_or_leaves_it() {
        for beside in [false, true] {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("a.h5");
            fs::write(&path, "old").unwrap();
            for left in &[".crumple-a.h5.part", ".crumple-a.h5.work"][..1 + usize::from(beside)] {
                fs::write(folder.path().join(left), "of a process that was killed").unwrap();
            }
            let failed = write_beside(&path, beside, |work| {
                assert_eq!(work.extension().unwrap(), if beside { "work" } else { "part" });
                fs::write(work, "half").unwrap();
                Err(crate::error::error!(Other, "no"))
            });
            assert_eq!(failed.unwrap_err().to_string(), "no");
            assert_eq!(fs::read(&path).unwrap(), b"old");
            assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary file stays");
            let write = |work: &Path| fs::write(work, "new").map_err(|e| Error::io(work, e));
            write_beside(&path, beside, write).unwrap();
            assert_eq!(fs::read(&path).unwrap(), b"new");
            assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary file stays");
        }
    }

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
