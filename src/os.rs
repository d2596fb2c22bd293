//! All in which operating systems differ, so that the rest is the same on each: identity and kind of files, access at a position,
//! reserved space, a signal, the width of a terminal.

use std::fs::{self, File};
use std::io;
use std::path::Path;

/// Whether the open file is the one at `path`. Windows cannot tell in a stable way: there a file that is open cannot
/// be replaced.
pub(crate) fn is_at(file: &File, path: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let identity = |m: fs::Metadata| (m.dev(), m.ino());
        file.metadata().map(identity).ok() == fs::symlink_metadata(path).map(identity).ok()
    }
    #[cfg(not(unix))]
    {
        let _ = file;
        path.exists()
    }
}

/// Whether it is a named pipe or the output of another program.
pub(crate) fn is_pipe(kind: fs::FileType) -> bool {
    #[cfg(unix)]
    return std::os::unix::fs::FileTypeExt::is_fifo(&kind);
    #[cfg(not(unix))]
    {
        let _ = kind;
        false
    }
}

/// Whether a locked file is written and read by the handle alone that holds the lock, so that not even its own process
/// opens it once more.
pub(crate) const LOCKS_EXCLUDE_ALL: bool = cfg!(windows);

/// Reads bytes at a position; how many there were.
pub(crate) fn read_at(file: &File, buffer: &mut [u8], offset: u64) -> io::Result<usize> {
    #[cfg(unix)]
    return std::os::unix::fs::FileExt::read_at(file, buffer, offset);
    #[cfg(windows)]
    return std::os::windows::fs::FileExt::seek_read(file, buffer, offset);
}

/// Writes all bytes at a position.
pub(crate) fn write_all_at(file: &File, bytes: &[u8], at: u64) -> io::Result<()> {
    #[cfg(unix)]
    return std::os::unix::fs::FileExt::write_all_at(file, bytes, at);
    #[cfg(windows)]
    {
        let (mut bytes, mut at) = (bytes, at);
        while !bytes.is_empty() {
            let written = std::os::windows::fs::FileExt::seek_write(file, bytes, at)?;
            bytes = &bytes[written..];
            at += written as u64;
        }
        Ok(())
    }
}

/// Reserves the file's blocks at once, which makes writing them cheaper.
pub(crate) fn allocate(file: &File, length: u64) -> io::Result<()> {
    #[cfg(target_os = "linux")]
    if rustix::fs::fallocate(file, rustix::fs::FallocateFlags::empty(), 0, length).is_ok() {
        return Ok(());
    }
    file.set_len(length)
}

/// Lets a write beyond the limit on the size of files (`ulimit -f`) fail, with a message that
/// names the file, where the signal's default would end the process without one.
pub(crate) fn survive_file_size_limit() {
    // Without the handler the process ends, and the old file is there all the same.
    #[cfg(unix)]
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, std::sync::Arc::default());
}

/// Characters in a line of the terminal that a standard stream is.
pub(crate) fn terminal_width(stream: &impl Stream) -> Option<usize> {
    let width = terminal_size::terminal_size_of(stream).map(|(width, _)| width.0.into());
    width.filter(|width| *width > 0)
}

#[cfg(unix)]
pub(crate) use std::os::fd::AsFd as Stream;
#[cfg(windows)]
pub(crate) use std::os::windows::io::AsHandle as Stream;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_read_and_written_where_they_belong() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let file = File::options().create_new(true).read(true).write(true).open(&path).unwrap();
        allocate(&file, 10).unwrap();
        write_all_at(&file, b"56", 5).unwrap();
        write_all_at(&file, b"0", 0).unwrap();
        let mut bytes = [0; 16];
        assert_eq!(read_at(&file, &mut bytes, 4).unwrap(), 6);
        assert_eq!(&bytes[..6], b"\x0056\0\0\0");
        assert_eq!(fs::read(&path).unwrap(), b"0\0\0\0\x0056\0\0\0");
        assert!(is_at(&file, &path) && !is_at(&file, &folder.path().join("b")));
        assert!(!is_pipe(file.metadata().unwrap().file_type()));
    }
}
