//! Files: only regular files are read, up to a size limit; written so that a reader sees the
//! old content or the new, never half of it.

mod write;

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::Error;
use crate::os::is_pipe;
pub(crate) use write::WriterLock;
pub use write::write_at;
pub(crate) use write::{not_written, write_all_whole, write_by_path, write_whole};

/// Whether content is read that is not what was written, by the fingerprint next to it. The command line
/// sets it once, as it would a level of logging; a library's caller is refused such content.
static ACCEPTS_CHANGED: AtomicBool = AtomicBool::new(false);

/// Lets content be read that is not what was written.
pub(crate) fn accept_changed(is_accepted: bool) {
    ACCEPTS_CHANGED.store(is_accepted, Ordering::Relaxed);
}

/// Whether content is read that is not what was written.
pub(crate) fn accepts_changed() -> bool {
    ACCEPTS_CHANGED.load(Ordering::Relaxed)
}

/// What can be read at a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// It has a size, and can be read again.
    File,
    /// A named pipe or the output of another program: it can be read once and has no size.
    Pipe,
}

/// What stands at `path`. It is not opened: opening a pipe waits for its writer.
pub(crate) fn kind(path: &Path) -> io::Result<Kind> {
    let kind = fs::metadata(path)?.file_type();
    let refused = |what: &str| {
        Err(io::Error::new(io::ErrorKind::InvalidInput, format!("this is {what}: give a file")))
    };
    match kind {
        kind if kind.is_file() => Ok(Kind::File),
        kind if kind.is_dir() => refused("a folder"),
        kind if is_pipe(kind) => Ok(Kind::Pipe),
        // A device may have no end.
        _ => refused("a device or a socket"),
    }
}

/// Opens a file for reading; all else is refused before it is opened.
pub(crate) fn open(path: &Path) -> io::Result<File> {
    match kind(path)? {
        Kind::File => File::open(path),
        Kind::Pipe => Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "this is a pipe: write its content to a file and give that",
        )),
    }
}

/// Reads a file of `most` bytes at most.
pub(crate) fn read(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let file = open(path)?;
    let size = file.metadata()?.len();
    let mut bytes = Vec::new();
    if size <= most {
        bytes.try_reserve_exact(size as usize).map_err(|_| out_of_memory(size))?;
        file.take(most + 1).read_to_end(&mut bytes)?;
    }
    let size = size.max(bytes.len() as u64);
    if size <= most {
        Ok(bytes)
    } else {
        Err(io::Error::new(
            io::ErrorKind::FileTooLarge,
            format!(
                "the file has {size} bytes, expected at most {most} ({} MiB): is this another kind of file?",
                most >> 20
            ),
        ))
    }
}

/// Reads a text file of `most` bytes at most.
pub(crate) fn read_text(path: &Path, most: u64) -> io::Result<String> {
    String::from_utf8(read(path, most)?).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        let message = match e.as_bytes().contains(&0) {
            true => "this is a binary file: expected text".into(),
            false => format!("byte {at} is not UTF-8: save the file as UTF-8 text"),
        };
        io::Error::new(io::ErrorKind::InvalidData, message)
    })
}

/// Why that many bytes of memory cannot be had.
pub(crate) fn out_of_memory(bytes: u64) -> io::Error {
    let message = format!("not enough memory to read {bytes} bytes");
    io::Error::new(io::ErrorKind::OutOfMemory, message)
}

/// The requested fact about a path, or `None` if nothing is there, or something else. A fault stays an error:
/// who takes it for an absence starts a database again, or reads half of a run.
pub(crate) fn if_there<T>(asked: io::Result<T>) -> io::Result<Option<T>> {
    use io::ErrorKind::{InvalidFilename, NotADirectory, NotFound, PermissionDenied};
    match asked {
        Ok(found) => Ok(Some(found)),
        // An error of ours, such as of a pipe, has no number.
        Err(e) if e.raw_os_error().is_none() => Ok(None),
        Err(e) => match e.kind() {
            InvalidFilename | NotADirectory | NotFound | PermissionDenied => Ok(None),
            _ => Err(e),
        },
    }
}

/// Whether there is a file at `path`.
pub(crate) fn is_file(path: &Path) -> Result<bool, Error> {
    let there = if_there(fs::metadata(path)).map_err(|source| Error::io(path, source))?;
    Ok(there.is_some_and(|meta| meta.is_file()))
}

/// The file that is written at `path`: a link is followed, so that its target is and not the link.
pub(crate) fn target_of(path: &Path) -> io::Result<PathBuf> {
    if let Some(target) = if_there(fs::canonicalize(path))? {
        return Ok(target);
    }
    // The link of a file that is not there yet.
    let target = fs::read_link(path).map(|link| folder_of(path).join(link));
    Ok(target.unwrap_or_else(|_| path.to_path_buf()))
}

/// Whether two paths name the same existing file.
pub(crate) fn is_same(a: &Path, b: &Path) -> bool {
    matches!((fs::canonicalize(a), fs::canonicalize(b)), (Ok(a), Ok(b)) if a == b)
}

/// A path from the root on, as given: links are not followed.
pub(crate) fn absolute(path: &Path) -> String {
    std::path::absolute(path).unwrap_or_else(|_| path.into()).display().to_string()
}

pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Why nothing can be made at `path`, where the operating system says too little.
pub(super) fn explained(path: &Path, source: io::Error) -> io::Error {
    let folder = folder_of(path);
    let message = match (source.kind(), fs::metadata(folder)) {
        (io::ErrorKind::FileTooLarge, _) if source.raw_os_error().is_some() => {
            "the file would be larger than the limit of this session (ulimit -f) or the disk allows"
                .into()
        }
        (io::ErrorKind::NotFound | io::ErrorKind::NotADirectory, Err(_)) => {
            match folder.ancestors().find(|part| part.exists()) {
                Some(part) if !part.is_dir() => {
                    format!("{} is a file, not a folder: name another", part.display())
                }
                _ => format!(
                    "the folder {} does not exist: create it, or name another",
                    folder.display()
                ),
            }
        }
        (io::ErrorKind::AlreadyExists, Ok(_)) if !path.is_dir() => {
            format!("{} is a file, not a folder: name another", path.display())
        }
        (io::ErrorKind::NotADirectory, Ok(meta)) if !meta.is_dir() => {
            format!("{} is a file, not a folder: name another", folder.display())
        }
        (io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem, Ok(meta))
            if meta.is_dir() && source.raw_os_error().is_some() =>
        {
            format!("cannot write in the folder {} ({source}): name another", folder.display())
        }
        _ => return source,
    };
    io::Error::new(source.kind(), message)
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use super::*;

    #[test]
    fn only_files_are_read_and_up_to_a_bound() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a"), "12345").unwrap();
        assert_eq!(read(&folder.path().join("a"), 5).unwrap(), b"12345");
        let refused = |path: &Path, expected: &str| {
            let error = read(path, 4).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        };
        refused(&folder.path().join("a"), "the file has 5 bytes, expected at most 4");
        refused(folder.path(), "this is a folder: give a file");
        refused(Path::new("/dev/zero"), "this is a device or a socket: give a file");
        // Files of the system have no size.
        refused(Path::new("/proc/self/status"), "expected at most 4");
    }
}
