//! Writing files so that a reader sees the old content or the new, never half of it.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// A file could not be written; whatever stood there before still does.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {path}: {source}; what was there before is unchanged")]
pub struct WriteError {
    pub path: PathBuf,
    #[source]
    pub source: io::Error,
}

/// Writes `bytes` to `path` as a whole: to a temporary file beside it, then by renaming.
///
/// A device or a pipe cannot be renamed over and is written directly.
///
/// # Errors
/// [`WriteError`] names the path; nothing half-written stays behind.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    write_all_whole(&[(path, bytes)])
}

/// Writes several files as [`write_whole`] does: none is renamed into place before all of
/// them are written.
///
/// # Errors
/// [`WriteError`] names the first path that cannot be written.
pub fn write_all_whole(files: &[(&Path, &[u8])]) -> Result<(), WriteError> {
    let named = |path: &Path| {
        let path = path.to_path_buf();
        move |source| WriteError { path, source }
    };
    let mut prepared = Vec::new();
    for (path, bytes) in files {
        prepared.push((path, prepare(path, bytes).map_err(named(path))?));
    }
    for (path, file) in prepared {
        if let Some((temporary, target)) = file {
            temporary.persist(target).map_err(|e| e.error).map_err(named(path))?;
        }
    }
    Ok(())
}

/// Writes a file as [`write_whole`] does, by a function that fills it at any positions.
/// Gives back what the function gives; nothing is replaced if that is `None`.
///
/// The content is not forced to the disk: it is derived from a file that is still there.
/// What a killed process left half-written is removed by the next that writes to `path`, for
/// which the temporary file has one name: the caller keeps other writers of `path` away.
///
/// # Errors
/// [`WriteError`] names the path; nothing half-written stays behind.
pub fn write_at<T>(
    path: &Path,
    fill: impl FnOnce(&File) -> io::Result<Option<T>>,
) -> Result<Option<T>, WriteError> {
    let write = || -> io::Result<Option<T>> {
        let (temporary, target) = temporary(path, Naming::ByTarget)?;
        let done = fill(temporary.as_file())?;
        if done.is_some() {
            temporary.persist(target).map_err(|e| e.error)?;
        }
        Ok(done)
    };
    write().map_err(|source| WriteError { path: path.into(), source })
}

/// Whether two paths name the same existing file.
pub fn is_same(a: &Path, b: &Path) -> bool {
    matches!((fs::canonicalize(a), fs::canonicalize(b)), (Ok(a), Ok(b)) if a == b)
}

/// Writes the bytes to a temporary file beside their target; to a device at once.
fn prepare(path: &Path, bytes: &[u8]) -> io::Result<Option<(NamedTempFile, PathBuf)>> {
    if fs::metadata(path).is_ok_and(|meta| !meta.is_file() && !meta.is_dir()) {
        let mut device = OpenOptions::new().write(true).open(path)?;
        device.write_all(bytes)?;
        device.flush()?;
        return Ok(None);
    }
    let (mut temporary, target) = temporary(path, Naming::Random)?;
    temporary.write_all(bytes)?;
    temporary.as_file().sync_all()?;
    Ok(Some((temporary, target)))
}

/// How a temporary file is named.
#[derive(Clone, Copy)]
enum Naming {
    Random,
    /// What has that name already was left by a process that was killed.
    ByTarget,
}

/// An empty temporary file beside the target of `path`, and that target.
fn temporary(path: &Path, naming: Naming) -> io::Result<(NamedTempFile, PathBuf)> {
    let existing = match fs::metadata(path) {
        Ok(meta) if meta.is_dir() => return Err(io::ErrorKind::IsADirectory.into()),
        Ok(meta) if !meta.is_file() => return Err(io::ErrorKind::Unsupported.into()),
        Ok(meta) => Some(meta.permissions()),
        Err(_) => None,
    };
    if existing.as_ref().is_some_and(fs::Permissions::readonly) {
        return Err(io::ErrorKind::PermissionDenied.into());
    }
    // A link is followed, so that its target is replaced and not the link.
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    let folder = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut name = OsString::from(".crumple-");
    let mut builder = tempfile::Builder::new();
    match naming {
        Naming::Random => builder.prefix(&name).suffix(".part"),
        Naming::ByTarget => {
            name.push(target.file_name().unwrap_or_default());
            name.push(".part");
            match fs::remove_file(folder.join(&name)) {
                Err(e) if e.kind() != io::ErrorKind::NotFound => return Err(e),
                _ => builder.prefix(&name).rand_bytes(0),
            }
        }
    };
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(existing.unwrap_or_else(|| fs::Permissions::from_mode(0o666)));
    }
    let temporary = builder.tempfile_in(folder)?;
    Ok((temporary, target))
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert!(error.to_string().starts_with("cannot write /no/such/folder/a.txt: "));
    }
}
