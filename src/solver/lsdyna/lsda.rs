//! LSDA: the container of binout. Header, record payloads and paths; no meaning of content.

use std::io::{self, BufRead, Read};

/// Widths of the container's own fields.
#[derive(Clone, Copy)]
pub(super) struct Header {
    pub(super) header: usize,
    pub(super) length: usize,
    pub(super) big_endian: bool,
}

impl Header {
    /// "header length, bytes in LENGTH, OFFSET, COMMAND and TYPEID fields, byte order
    /// (1 little, 0 big), float format (0 IEEE), unused".
    pub(super) fn parse(head: &[u8]) -> Option<Self> {
        match *head.get(..7)? {
            [header @ 8..=64, length @ (4 | 8), 4 | 8, 1, 1, order @ (0 | 1), 0] => {
                Some(Self { header: header.into(), length: length.into(), big_endian: order == 0 })
            }
            _ => None,
        }
    }

    pub(super) fn unsigned(&self, bytes: &[u8]) -> u64 {
        let fold = |value: u64, byte: &u8| value << 8 | u64::from(*byte);
        match self.big_endian {
            true => bytes.iter().fold(0, fold),
            false => bytes.iter().rev().fold(0, fold),
        }
    }
}

/// The values of one data record.
pub(super) enum Values {
    Text(Vec<u8>),
    Integers(Vec<i64>),
    Reals(Vec<f64>),
}

impl Values {
    /// Types 1–4 signed of 1, 2, 4, 8 bytes, 5–8 unsigned, 9 float32, 10 float64.
    pub(super) fn decode(kind: u8, bytes: Vec<u8>, header: Header) -> Option<Self> {
        let size = match kind {
            1 | 5 => return Some(Self::Text(bytes)),
            2 | 6 => 2,
            3 | 7 | 9 => 4,
            4 | 8 | 10 => 8,
            _ => return None,
        };
        if !bytes.len().is_multiple_of(size) {
            return None;
        }
        let words = bytes.chunks_exact(size).map(|w| header.unsigned(w));
        Some(match kind {
            2 => Self::Integers(words.map(|w| i64::from(w as u16 as i16)).collect()),
            3 => Self::Integers(words.map(|w| i64::from(w as u32 as i32)).collect()),
            4 | 6 | 7 | 8 => Self::Integers(words.map(|w| w as i64).collect()),
            9 => Self::Reals(words.map(|w| f64::from(f32::from_bits(w as u32))).collect()),
            _ => Self::Reals(words.map(f64::from_bits).collect()),
        })
    }

    pub(super) fn into_integers(self) -> Vec<i64> {
        match self {
            Self::Integers(values) => values,
            Self::Text(_) | Self::Reals(_) => Vec::new(),
        }
    }

    /// As real numbers; `None` for text.
    pub(super) fn into_reals(self) -> Option<Vec<f64>> {
        match self {
            Self::Reals(values) => Some(values),
            Self::Integers(values) => Some(values.into_iter().map(|v| v as f64).collect()),
            Self::Text(_) => None,
        }
    }

    pub(super) fn into_text(self) -> Vec<u8> {
        match self {
            Self::Text(text) => text,
            Self::Integers(_) | Self::Reals(_) => Vec::new(),
        }
    }
}

/// Fills `buffer`; false if the file ends before.
pub(super) fn fill(input: &mut dyn BufRead, buffer: &mut [u8]) -> io::Result<bool> {
    match input.read_exact(buffer) {
        Ok(()) => Ok(true),
        Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
        Err(e) => Err(e),
    }
}

/// The next `length` bytes, or `None` if the file ends before. Grows with what is there,
/// whatever length a damaged record claims.
pub(super) fn take(input: &mut dyn BufRead, length: u64) -> io::Result<Option<Vec<u8>>> {
    let mut bytes = Vec::new();
    input.take(length).read_to_end(&mut bytes)?;
    Ok((bytes.len() as u64 == length).then_some(bytes))
}

/// Skips `length` bytes; false if the file ends before.
pub(super) fn skip(input: &mut dyn BufRead, mut length: u64) -> io::Result<bool> {
    while length > 0 {
        let there = input.fill_buf()?.len() as u64;
        if there == 0 {
            return Ok(false);
        }
        let step = there.min(length);
        input.consume(step as usize);
        length -= step;
    }
    Ok(true)
}

/// Follows an absolute or relative path with `..`.
pub(super) fn change_directory(path: &mut Vec<String>, to: &str) {
    if to.starts_with('/') {
        path.clear();
    }
    for part in to.split('/').filter(|p| !p.is_empty() && *p != ".") {
        if part == ".." {
            path.pop();
        } else {
            path.push(part.to_string());
        }
    }
}
