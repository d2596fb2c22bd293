//! Where bytes come from: files, memory maps and memory, read at a position.
//!
//! Plain reading is the default, because the file of a running job may grow or
//! shrink at any time: a plain read then ends early, while the access to a map beyond the
//! end of its file kills the process. Data written after opening are ignored by a
//! reader: its end would move while it reads, and half a line would be followed by another.

use std::borrow::Cow;
use std::fs::File;
use std::io::{self, BufRead, Read};
use std::path::Path;

use crate::file;
use crate::os;

/// Bytes that can be read at any position, from several threads at once.
pub trait Source: Send + Sync {
    /// Number of bytes; of a file those that it had when it was opened.
    fn size(&self) -> io::Result<u64>;

    /// Reads up to `buffer.len()` bytes from `offset`; 0 at the end.
    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize>;

    /// All bytes, where they are in memory already.
    fn bytes(&self) -> Option<&[u8]> {
        None
    }
}

/// How files are read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Access {
    /// By positional reads: safe whatever happens to the file meanwhile.
    #[default]
    Plain,
    /// Through a memory map, which saves a copy. Only for files that nothing writes to: if
    /// the file is cut while it is read, the operating system ends the process.
    Map,
}

/// Opens a file. A pipe, which has no positions, is copied to a temporary file.
pub(crate) fn open(path: &Path, access: Access) -> io::Result<Box<dyn Source>> {
    let kind = file::kind(path)?;
    let mut file = File::open(path)?;
    if kind == file::Kind::Pipe {
        let mut copy = tempfile::tempfile()?;
        io::copy(&mut file, &mut copy)?;
        file = copy;
    }
    Ok(match access {
        Access::Plain => Box::new(Opened::new(file)?),
        Access::Map => Box::new(map(&file)?),
    })
}

/// A file with the size that it had when it was opened.
pub(crate) struct Opened {
    file: File,
    size: u64,
}

impl Opened {
    /// The file with its size of now.
    pub(crate) fn new(file: File) -> io::Result<Self> {
        let size = file.metadata()?.len();
        Ok(Self { file, size })
    }
}

impl Source for Opened {
    fn size(&self) -> io::Result<u64> {
        Ok(self.size)
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        let there = usize::try_from(self.size.saturating_sub(offset)).unwrap_or(usize::MAX);
        let count = there.min(buffer.len());
        os::read_at(&self.file, &mut buffer[..count], offset)
    }
}

#[allow(unsafe_code, reason = "a map is only as safe as its file; see Access::Map")]
fn map(file: &File) -> io::Result<memmap2::Mmap> {
    // SAFETY: the user requested a map and so promised that nothing writes to the file.
    unsafe { memmap2::Mmap::map(file) }
}

/// Bytes in memory, a map of a file among them.
impl<T: AsRef<[u8]> + Send + Sync> Source for T {
    fn size(&self) -> io::Result<u64> {
        Ok(self.as_ref().len() as u64)
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        let rest = usize::try_from(offset).ok().and_then(|from| self.as_ref().get(from..));
        let rest = rest.unwrap_or_default();
        let count = rest.len().min(buffer.len());
        buffer[..count].copy_from_slice(&rest[..count]);
        Ok(count)
    }

    fn bytes(&self) -> Option<&[u8]> {
        Some(self.as_ref())
    }
}

/// What a file is that begins so, and what to do, if it is compressed or no plain text.
pub(crate) fn encoded(head: &[u8]) -> Option<&'static str> {
    const ENCODED: [(&[u8], &str); 7] = [
        (b"\x1f\x8b", "this is compressed with gzip (unpack it with gunzip)"),
        (b"BZh", "this is compressed with bzip2 (unpack it with bunzip2)"),
        (b"\xfd7zXZ\0", "this is compressed with xz (unpack it with unxz)"),
        (b"\x28\xb5\x2f\xfd", "this is compressed with zstd (unpack it with unzstd)"),
        (b"PK\x03\x04", "this is a zip archive (unpack it with unzip)"),
        (b"\xff\xfe", UTF_16),
        (b"\xfe\xff", UTF_16),
    ];
    if let Some((_, what)) = ENCODED.iter().find(|(start, _)| head.starts_with(start)) {
        return Some(what);
    }
    // Without a byte order mark: every second byte of plain text is 0.
    let pairs = head.as_chunks::<2>().0;
    let is_text = |b: u8| matches!(b, b' '..=b'~' | b'\t' | b'\r' | b'\n');
    let is_utf_16 = |high: usize| pairs.iter().all(|p| p[high] == 0 && is_text(p[1 - high]));
    (pairs.len() >= 4 && (is_utf_16(0) || is_utf_16(1))).then_some(UTF_16)
}

const UTF_16: &str = "this is UTF-16 text (convert it with iconv -f UTF-16 -t UTF-8)";

/// Shorter lines are not cut by the width of a field.
const LEAST_WIDTH: usize = 70;

/// A title to the end of its line: UTF-8, of which a fixed width may have cut the last character, or else Latin-1, as in decks that
/// were written on Windows.
pub(super) fn title(bytes: &[u8]) -> Cow<'_, str> {
    title_in(bytes, bytes.len() >= LEAST_WIDTH)
}

/// A title in a field, which may be as wide as that. Blanks after it show that nothing is cut.
fn title_in(bytes: &[u8], is_full: bool) -> Cow<'_, str> {
    let text = bytes.trim_ascii_end();
    let is_full = is_full && text.len() == bytes.len();
    match std::str::from_utf8(text) {
        Ok(text) => text.into(),
        Err(error) => {
            let whole = &text[..error.valid_up_to()];
            if error.error_len().is_none() && (is_full || !whole.is_ascii()) {
                String::from_utf8_lossy(whole)
            } else {
                text.iter().map(|&byte| char::from(byte)).collect::<String>().into()
            }
        }
    }
}

/// The text of a field of a binary file without its padding; `None` if there is nothing else.
pub(super) fn unpadded(bytes: &[u8]) -> Option<String> {
    let end = bytes.iter().rposition(|byte| *byte != 0).map_or(0, |last| last + 1);
    let text = title_in(&bytes[..end], end == bytes.len());
    let text = text.trim_matches(|c: char| c.is_whitespace() || c == '\0');
    (!text.is_empty()).then(|| text.to_string())
}

/// Fills as much of `buffer` as the source has from `offset` on; returns how much.
pub(crate) fn fill_at(source: &dyn Source, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
    let mut filled = 0;
    while filled < buffer.len() {
        match source.read_at(offset + filled as u64, &mut buffer[filled..]) {
            Ok(0) => break,
            Ok(count) => filled += count,
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(filled)
}

/// [`Read::read`] of anything that has a buffer.
pub(super) fn read_buffered(input: &mut impl BufRead, out: &mut [u8]) -> io::Result<usize> {
    let there = input.fill_buf()?;
    let count = there.len().min(out.len());
    out[..count].copy_from_slice(&there[..count]);
    input.consume(count);
    Ok(count)
}

const STREAM_BUFFER: usize = 1 << 16;

/// A source read from front to back, with jumps.
pub(crate) struct Stream<'a> {
    source: &'a dyn Source,
    /// Position of the buffer's end.
    at: u64,
    buffer: Vec<u8>,
    used: usize,
}

impl<'a> Stream<'a> {
    pub(crate) fn new(source: &'a dyn Source) -> Self {
        Self { source, at: 0, buffer: Vec::new(), used: 0 }
    }

    pub(crate) fn position(&self) -> u64 {
        self.at - (self.buffer.len() - self.used) as u64
    }

    /// Goes on at `position`; bytes that are in the buffer are not read again.
    pub(crate) fn go_to(&mut self, position: u64) {
        let start = self.at - self.buffer.len() as u64;
        if (start..=self.at).contains(&position) {
            self.used = (position - start) as usize;
        } else {
            self.buffer.clear();
            self.used = 0;
            self.at = position;
        }
    }
}

impl Read for Stream<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        read_buffered(self, out)
    }
}

impl BufRead for Stream<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.used == self.buffer.len() {
            self.buffer.resize(STREAM_BUFFER, 0);
            self.used = 0;
            let read = fill_at(self.source, self.at, &mut self.buffer);
            self.buffer.truncate(*read.as_ref().unwrap_or(&0));
            self.at += read? as u64;
        }
        Ok(&self.buffer[self.used..])
    }

    fn consume(&mut self, count: usize) {
        self.used += count.min(self.buffer.len() - self.used);
    }
}

/// Reads ranges that lie close together with few calls, in a buffer that is used again.
pub(crate) struct Window<'a> {
    source: &'a dyn Source,
    buffer: Vec<u8>,
    /// The first byte of the source that the buffer holds, and how many of them.
    start: u64,
    held: usize,
}

impl<'a> Window<'a> {
    pub(crate) fn new(source: &'a dyn Source) -> Self {
        Self { source, buffer: Vec::new(), start: 0, held: 0 }
    }

    /// `length` bytes from `offset`, or `None` if the source ends before. Up to `ahead`
    /// further bytes are read in the same call.
    pub(crate) fn get(
        &mut self,
        offset: u64,
        length: usize,
        ahead: usize,
    ) -> io::Result<Option<&[u8]>> {
        if let Some(bytes) = self.source.bytes() {
            let from = usize::try_from(offset).unwrap_or(usize::MAX);
            let end = from.saturating_add(length);
            return Ok(bytes.get(from..end));
        }
        let held = self.start..self.start + self.held as u64;
        if offset < held.start || offset + length as u64 > held.end {
            // What is held and wanted again moves to the front; the rest is read.
            let first =
                if held.contains(&offset) { (offset - held.start) as usize } else { self.held };
            self.buffer.copy_within(first..self.held, 0);
            let kept = self.held - first;
            (self.start, self.held) = (offset, kept);
            if self.buffer.len() < length + ahead {
                self.buffer.resize(length + ahead, 0);
            }
            let rest = &mut self.buffer[kept..length + ahead];
            self.held += fill_at(self.source, offset + kept as u64, rest)?;
        }
        let from = (offset - self.start) as usize;
        Ok(self.buffer[..self.held].get(from..from + length))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_jumps_back_and_forth() {
        let bytes: Vec<u8> = (0..200_000u32).map(|i| i as u8).collect();
        let source = &bytes[..];
        let mut stream = Stream::new(&source);
        for at in [0u64, 70_000, 69_999, 3, 199_999, 65_536] {
            stream.go_to(at);
            let mut byte = [0];
            assert_eq!(stream.read(&mut byte).unwrap(), 1);
            assert_eq!((byte[0], stream.position()), (at as u8, at + 1));
        }
        stream.go_to(1_000_000);
        assert!(stream.fill_buf().unwrap().is_empty());
    }

    /// A field that ends in half a character is cut only if it is full.
    #[test]
    fn titles_keep_their_last_letter() {
        for (bytes, expected) in [
            (&b"Sto\xdf   \0\0"[..], "Sto\u{df}"),
            (b"Sto\xdf\0", "Sto\u{df}"),
            (b"\xdc ", "\u{dc}"),
            (b"Sto\xc3\x9f, Caf\xc3", "Sto\u{df}, Caf"),
            (b"Caf\xc3", "Caf"),
            (b"Sto\xc3\x9f ", "Sto\u{df}"),
        ] {
            assert_eq!(unpadded(bytes).as_deref(), Some(expected), "{bytes:?}");
        }
        assert_eq!(title(b"Sto\xdf"), "Sto\u{df}");
        let wide = [&[b'a'; 79][..], b"\xc3"].concat();
        assert_eq!(title(&wide), "a".repeat(79));
    }

    #[test]
    fn what_is_no_plain_text_is_known_by_its_beginning() {
        let wide = |text: &str| text.bytes().flat_map(|b| [b, 0]).collect::<Vec<u8>>();
        assert_eq!(encoded(&wide("*KEYWORD")), Some(UTF_16));
        assert_eq!(encoded(&wide("*KEYWORD")[1..15]), Some(UTF_16), "the other byte order");
        assert!(encoded(b"\x1f\x8b\x08\x00").unwrap().contains("gunzip"));
        for plain in [&b"*KEYWORD\n*TITLE\n"[..], b"", b" \0", &[0; 16], b"\0\0\0\x54\0\0\x0b\xd3"]
        {
            assert_eq!(encoded(plain), None, "{plain:?}");
        }
    }

    #[test]
    fn a_window_reads_ahead_and_ends() {
        let mut file = tempfile::tempfile().unwrap();
        let bytes: Vec<u8> = (0..100u8).collect();
        io::Write::write_all(&mut file, &bytes).unwrap();
        let opened = Opened::new(file.try_clone().unwrap()).unwrap();
        io::Write::write_all(&mut file, &bytes).unwrap();
        let mut window = Window::new(&opened);
        assert_eq!(window.get(10, 5, 20).unwrap(), Some(&bytes[10..15]));
        assert_eq!(window.get(30, 5, 0).unwrap(), Some(&bytes[30..35]), "was read ahead");
        assert_eq!(window.get(33, 40, 0).unwrap(), Some(&bytes[33..73]));
        assert_eq!(window.get(90, 10, 50).unwrap(), Some(&bytes[90..100]));
        assert_eq!(window.get(95, 10, 0).unwrap(), None, "what was written later is not there");
        assert_eq!(window.get(0, 2, 0).unwrap(), Some(&bytes[..2]));
    }
}
