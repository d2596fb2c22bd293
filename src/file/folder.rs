//! Folders of files that are to be made: which one, and why nothing can be made in it.

use std::fs;
use std::io;
use std::path::Path;

/// The folder that `path` stands in.
pub(super) fn folder_of(path: &Path) -> &Path {
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
            "the file would be larger than the limit of this session (ulimit -f) or of the disk"
                .into()
        }
        (io::ErrorKind::NotFound | io::ErrorKind::NotADirectory, Err(_)) => {
            match folder.ancestors().find(|part| part.exists()) {
                Some(part) if !part.is_dir() => {
                    format!("{} is a file and no folder: name another", part.display())
                }
                _ => format!(
                    "the folder {} does not exist: make it, or name another",
                    folder.display()
                ),
            }
        }
        (io::ErrorKind::NotADirectory, Ok(meta)) if !meta.is_dir() => {
            format!("{} is a file and no folder: name another", folder.display())
        }
        (io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem, Ok(meta))
            if meta.is_dir() && source.raw_os_error().is_some() =>
        {
            format!(
                "nothing can be written in the folder {} ({source}): name another",
                folder.display()
            )
        }
        _ => return source,
    };
    io::Error::new(source.kind(), message)
}
