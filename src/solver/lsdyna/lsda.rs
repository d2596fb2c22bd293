//! LSDA: the container of binout. Header, records and paths; no meaning of content.
//!
//! Records are walked in order and symbol tables skipped: a run that terminated early has no last table,
//! so nothing may depend on one. After an invalid record, the walk continues at the next
//! record that changes to an absolute path.

use std::io;

use crate::solver::source::{Source, Window};

/// Widths of the container's own fields.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Header {
    length: u8,
    width: u8,
    big_endian: bool,
}

impl Header {
    /// "header length, bytes in LENGTH, OFFSET, COMMAND and TYPEID fields, byte order
    /// (1 little, 0 big), float format (0 IEEE), unused".
    pub(crate) fn parse(head: &[u8]) -> Option<Self> {
        match *head.get(..7)? {
            [length @ 8..=64, width @ (4 | 8), 4 | 8, 1, 1, order @ (0 | 1), 0] => {
                Some(Self { length, width, big_endian: order == 0 })
            }
            _ => None,
        }
    }

    fn unsigned(self, bytes: &[u8]) -> u64 {
        let fold = |value: u64, byte: &u8| value << 8 | u64::from(*byte);
        if self.big_endian { bytes.iter().fold(0, fold) } else { bytes.iter().rev().fold(0, fold) }
    }
}

/// Types of values: 1–4 signed of 1, 2, 4, 8 bytes, 5–8 unsigned, 9 float32, 10 float64.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Kind(pub u8);

impl Kind {
    /// Bytes of one value; `None` for a type that does not exist.
    pub(crate) fn size(self) -> Option<usize> {
        match self.0 {
            1 | 5 => Some(1),
            2 | 6 => Some(2),
            3 | 7 | 9 => Some(4),
            4 | 8 | 10 => Some(8),
            _ => None,
        }
    }

    pub(crate) fn is_text(self) -> bool {
        matches!(self.0, 1 | 5)
    }

    pub(crate) fn is_real(self) -> bool {
        matches!(self.0, 9 | 10)
    }

    /// Appends the values of `bytes` to `out`, as doubles.
    pub(crate) fn reals(self, header: Header, bytes: &[u8], out: &mut Vec<f64>) {
        let words = |size| bytes.chunks_exact(size).map(move |w| header.unsigned(w));
        match (self.0, header.big_endian) {
            // The two that matter, without going byte by byte.
            (9, false) => {
                out.extend(bytes.as_chunks().0.iter().map(|w| f64::from(f32::from_le_bytes(*w))));
            }
            (10, false) => out.extend(bytes.as_chunks().0.iter().map(|w| f64::from_le_bytes(*w))),
            (9, true) => out.extend(words(4).map(|w| f64::from(f32::from_bits(w as u32)))),
            (10, true) => out.extend(words(8).map(f64::from_bits)),
            (5..=8, _) => out.extend(words(self.size().unwrap_or(1)).map(|w| w as f64)),
            _ => out.extend(self.integers(header, bytes).into_iter().map(|v| v as f64)),
        }
    }

    /// The values of `bytes`, as integers; empty for reals.
    pub(crate) fn integers(self, header: Header, bytes: &[u8]) -> Vec<i64> {
        let words = |size| bytes.chunks_exact(size).map(move |w| header.unsigned(w));
        match self.0 {
            1 => words(1).map(|w| i64::from(w as u8 as i8)).collect(),
            2 => words(2).map(|w| i64::from(w as u16 as i16)).collect(),
            3 => words(4).map(|w| i64::from(w as u32 as i32)).collect(),
            4..=8 => words(self.size().unwrap_or(8)).map(|w| w as i64).collect(),
            _ => Vec::new(),
        }
    }
}

/// Where the values of a data record are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Payload {
    pub kind: Kind,
    pub at: u64,
    pub bytes: u64,
}

/// What the walk meets.
pub(crate) enum Event<'a> {
    /// Change to a directory; the path may be relative.
    Directory(&'a str),
    Data {
        name: &'a str,
        payload: Payload,
    },
    /// A record that makes no sense, at this byte; the walk continues after it, or not.
    Damage {
        at: u64,
        resumed: Option<u64>,
        message: String,
    },
    /// The end of the file cuts a record at this byte.
    Cut {
        at: u64,
    },
}

const CD: u8 = 2;
const DATA: u8 = 3;
const TABLE: u8 = 5;
/// Changes of directory, variables and the end of a symbol table.
const IN_TABLE: [u8; 3] = [CD, 4, 6];
/// Commands: null, cd, data, variable, begin and end of a symbol table, its offset.
const COMMANDS: std::ops::RangeInclusive<u8> = 1..=7;
/// Longest path that is taken for one; real ones are far shorter.
const MAX_PATH: usize = 1024;
/// Bytes read with a record's head: enough for the names of real records, and where
/// records are small, for several of them.
const NEAR: usize = 64;
const MANY: usize = 1 << 14;

pub(crate) fn header(source: &dyn Source) -> io::Result<Option<Header>> {
    let mut window = Window::new(source);
    Ok(window.get(0, 8, 0)?.and_then(Header::parse))
}

/// Walks all records of a container.
pub(crate) fn walk(
    source: &dyn Source,
    header: Header,
    mut each: impl FnMut(Event<'_>),
) -> io::Result<()> {
    let size = source.size()?;
    let mut window = Window::new(source);
    let mut at = u64::from(header.length);
    let mut ahead = NEAR;
    while at < size {
        match record(&mut window, header, at, size, ahead)? {
            Ok(Record { length, event }) => {
                if let Some(event) = event {
                    each(event);
                }
                at += length;
                // Twice as far as long as records are small: one that is not ends what is near.
                ahead = if length < MANY as u64 / 4 { (2 * ahead).min(MANY) } else { NEAR };
            }
            Err(None) if is_cut_table(source, header, at)? => {
                each(Event::Cut { at });
                return Ok(());
            }
            Err(message) => {
                let resumed = resume(source, header, at + 1, size)?;
                let cut = resumed.is_none() && message.is_none();
                each(match message {
                    None if cut => Event::Cut { at },
                    message => {
                        let message =
                            message.unwrap_or_else(|| "it is longer than the file".into());
                        Event::Damage { at, resumed, message }
                    }
                });
                let Some(resumed) = resumed else { return Ok(()) };
                at = resumed;
            }
        }
    }
    Ok(())
}

/// Whether the end of the file cuts a symbol table at `at`: up to there it holds nothing but
/// what a table does. Its records change directories too, but hold no data to continue with.
fn is_cut_table(source: &dyn Source, header: Header, at: u64) -> io::Result<bool> {
    let mut window = Window::new(source);
    let frame = usize::from(header.width) + 1;
    let mut next = at;
    while let Some(head) = window.get(next, frame, NEAR)? {
        let (length, command) = (header.unsigned(&head[..frame - 1]), head[frame - 1]);
        let is_of_table = if next == at { command == TABLE } else { IN_TABLE.contains(&command) };
        if !is_of_table || length < frame as u64 {
            return Ok(false);
        }
        // The length of the first record is that of the whole table.
        next = if next == at { at + frame as u64 } else { next.saturating_add(length) };
    }
    Ok(next > at)
}

struct Record<'a> {
    length: u64,
    event: Option<Event<'a>>,
}

/// The record at `at`; what is wrong with it, or `None` if the file ends within it.
fn record<'a>(
    window: &'a mut Window<'_>,
    header: Header,
    at: u64,
    size: u64,
    ahead: usize,
) -> io::Result<Result<Record<'a>, Option<String>>> {
    let width = usize::from(header.width);
    let frame = width + 1;
    let Some(head) = window.get(at, frame, ahead)? else { return Ok(Err(None)) };
    let (length, command) = (header.unsigned(&head[..width]), head[width]);
    if !COMMANDS.contains(&command) || length < frame as u64 {
        return Ok(Err(Some(format!("command {command} and {length} bytes are not a record"))));
    }
    if length > size - at {
        return Ok(Err(None));
    }
    let payload = length - frame as u64;
    let (from, near) = (at + frame as u64, payload.min(MAX_PATH as u64) as usize);
    match command {
        CD => {
            if payload > MAX_PATH as u64 {
                return Ok(Err(Some(format!("a path of {payload} bytes is too long"))));
            }
            let Some(path) = window.get(from, near, 0)? else { return Ok(Err(None)) };
            match text(path) {
                Some(path) => Ok(Ok(Record { length, event: Some(Event::Directory(path)) })),
                None => Ok(Err(Some("expected a path, found bytes that are not text".into()))),
            }
        }
        DATA => {
            // The length of the name first: what is read ahead holds all of a real one, and no more is needed.
            let Some(head) = window.get(from, near.min(2), 0)? else { return Ok(Err(None)) };
            let [kind, name_length] = *head else {
                return Ok(Err(Some("expected a type and a name".into())));
            };
            let (kind, end) = (Kind(kind), 2 + usize::from(name_length));
            let Some(head) = window.get(from, near.min(end), 0)? else { return Ok(Err(None)) };
            let name = head.get(2..end).and_then(text);
            let (Some(name), Some(item)) = (name.filter(|n| !n.is_empty()), kind.size()) else {
                return Ok(Err(Some(format!(
                    "expected a type from 1 to 10 and a name, found type {}",
                    kind.0
                ))));
            };
            let before = 2 + name.len() as u64;
            let bytes = payload - before;
            if !bytes.is_multiple_of(item as u64) {
                return Ok(Err(Some(format!(
                    "{name} has {bytes} bytes, not a whole number of values"
                ))));
            }
            let payload = Payload { kind, at: from + before, bytes };
            Ok(Ok(Record { length, event: Some(Event::Data { name, payload }) }))
        }
        _ => Ok(Ok(Record { length, event: None })),
    }
}

fn text(bytes: &[u8]) -> Option<&str> {
    let is_printable = bytes.iter().all(|b| (b' '..=b'~').contains(b));
    std::str::from_utf8(bytes).ok().filter(|_| is_printable)
}

/// The next record after a damaged one that changes to an absolute path and is followed
/// by a possible record.
fn resume(source: &dyn Source, header: Header, from: u64, size: u64) -> io::Result<Option<u64>> {
    const CHUNK: usize = 1 << 16;
    let width = usize::from(header.width);
    let mut window = Window::new(source);
    let mut probe = Window::new(source);
    let mut at = from;
    while at < size {
        // Chunks overlap by one byte, so that the pattern cannot fall between two.
        let length = CHUNK.min((size - at) as usize);
        let Some(bytes) = window.get(at, length, 0)? else { return Ok(None) };
        for found in memchr::memmem::find_iter(bytes, [CD, b'/'].as_slice()) {
            let Some(start) = (at + found as u64).checked_sub(width as u64) else { continue };
            // Most candidates are recognised by the length before them, without a read.
            let length = found.checked_sub(width).map(|k| header.unsigned(&bytes[k..k + width]));
            if start < from || length.is_some_and(|n| n > (width + 1 + MAX_PATH) as u64) {
                continue;
            }
            let Ok(Record { length, event: Some(Event::Directory(_)) }) =
                record(&mut probe, header, start, size, NEAR)?
            else {
                continue;
            };
            let next = start + length;
            if next == size || record(&mut probe, header, next, size, NEAR)?.is_ok() {
                return Ok(Some(start));
            }
        }
        at += (length - 1).max(1) as u64;
    }
    Ok(None)
}

/// Follows an absolute or relative path with `..`.
pub(crate) fn change_directory(path: &mut Vec<String>, to: &str) {
    if to.starts_with('/') {
        path.clear();
    }
    for part in to.split('/').filter(|p| !p.is_empty() && *p != ".") {
        if part == ".." {
            path.pop();
        } else if path.len() < MAX_DEPTH {
            path.push(part.to_string());
        }
    }
}

/// Directories within each other; real containers have four.
const MAX_DEPTH: usize = 16;
