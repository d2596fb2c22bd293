//! Standard output and error: text, tables, data and JSON documents. The only file that prints.
//!
//! Text may hold what a file says of itself, and a terminal obeys control characters: they are
//! shown and not sent. A closed pipe is not an error.

use std::borrow::Cow;
use std::error::Error;
use std::io::{self, BufWriter, IsTerminal, Write};

use serde::Serialize;

use super::Failure;

/// Writes text to standard output, control characters shown.
pub fn print(write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Failure> {
    to_stdout(true, write)
}

/// Writes data to standard output, byte for byte; to a terminal, which obeys some of them, as
/// text.
pub fn print_data<T, E: Error + 'static>(
    write: impl FnOnce(&mut dyn Write) -> Result<T, E>,
) -> Result<T, Failure> {
    to_stdout(io::stdout().is_terminal(), write)
}

/// Writes to standard output through a buffer and flushes it.
fn to_stdout<T, E: Error + 'static>(
    is_text: bool,
    write: impl FnOnce(&mut dyn Write) -> Result<T, E>,
) -> Result<T, Failure> {
    let mut out = BufWriter::new(Named(io::stdout().lock()));
    let written = match is_text {
        true => write(&mut Plain::new(&mut out)),
        false => write(&mut out),
    }?;
    out.flush()?;
    Ok(written)
}

/// Standard output, whose errors say so.
struct Named<'a>(io::StdoutLock<'a>);

fn of_stdout(e: io::Error) -> io::Error {
    match e.kind() {
        io::ErrorKind::Interrupted => e,
        kind => io::Error::new(kind, format!("cannot write to standard output: {e}")),
    }
}

impl Write for Named<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write(bytes).map_err(of_stdout)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush().map_err(of_stdout)
    }
}

/// Writes a line to standard error, control characters shown.
pub fn say(line: &str) {
    // With standard error closed there is nobody to tell.
    let _ = writeln!(io::stderr().lock(), "{}", plain(line));
}

/// Text as it may be sent to a terminal: control characters other than the line's end are
/// written as `\u{1b}`.
pub fn plain(text: &str) -> Cow<'_, str> {
    let is_hidden = |c: char| c.is_control() && c != '\n';
    if !text.contains(is_hidden) {
        return text.into();
    }
    let mut shown = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        match is_hidden(c) {
            true => shown.extend(c.escape_default()),
            false => shown.push(c),
        }
    }
    shown.into()
}

/// Hands on UTF-8 with control characters shown.
struct Plain<'a> {
    out: &'a mut dyn Write,
    /// First byte of a character of two bytes, which may be a control character.
    begun: Option<u8>,
}

impl<'a> Plain<'a> {
    fn new(out: &'a mut dyn Write) -> Self {
        Self { out, begun: None }
    }
}

impl Write for Plain<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        for &byte in bytes {
            match (self.begun.take(), byte) {
                // U+0080 to U+009F, which some terminals obey like an escape.
                (Some(_), 0x80..=0x9f) => write!(self.out, "\\u{{{byte:x}}}")?,
                (Some(first), _) => self.out.write_all(&[first, byte])?,
                (None, 0xc2) => self.begun = Some(byte),
                (None, b'\n' | 0x20..=0x7e | 0x80..) => self.out.write_all(&[byte])?,
                (None, _) => write!(self.out, "{}", char::from(byte).escape_default())?,
            }
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// Prints one JSON document.
pub fn print_json(document: &impl Serialize) -> Result<(), Failure> {
    print_data(|out| {
        serde_json::to_writer_pretty(&mut *out, document).map_err(io::Error::from)?;
        writeln!(out)
    })
}

/// Whether an error only says that the reader of a pipe went away.
pub fn is_closed_pipe(error: &(dyn Error + 'static)) -> bool {
    let mut cause = Some(error);
    while let Some(e) = cause {
        if let Some(io) = e.downcast_ref::<io::Error>()
            && io.kind() == io::ErrorKind::BrokenPipe
        {
            return true;
        }
        cause = e.source();
    }
    false
}

/// Prints rows under a heading with columns as wide as their content; the first
/// column is set left, the others right.
pub fn table(out: &mut dyn Write, heading: &[&str], rows: &[Vec<String>]) -> io::Result<()> {
    // A name with a line's end in it is one cell all the same.
    let shown = |cell: &str| plain(cell).replace('\n', "\\n");
    let heading: Vec<String> = heading.iter().map(|h| shown(h)).collect();
    let rows: Vec<Vec<String>> =
        rows.iter().map(|row| row.iter().map(|cell| shown(cell)).collect()).collect();
    let width = |k: usize| {
        let cells = rows.iter().filter_map(|r| r.get(k)).map(|c| c.chars().count());
        cells.chain([heading[k].chars().count()]).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..heading.len()).map(width).collect();
    for row in std::iter::once(&heading).chain(&rows) {
        let mut line = String::new();
        for (k, (cell, width)) in row.iter().zip(&widths).enumerate() {
            if k == 0 {
                line.push_str(&format!("{cell:<width$}"));
            } else {
                line.push_str(&format!("  {cell:>width$}"));
            }
        }
        writeln!(out, "{}", line.trim_end())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// However the text is cut into pieces, the same is written.
    #[test]
    fn control_characters_are_shown() {
        let t = |text: &str, expected: &str| {
            assert_eq!(plain(text), expected);
            for size in [1, 2, 3, 64] {
                let mut out = Vec::new();
                let mut plain = Plain::new(&mut out);
                text.as_bytes().chunks(size).for_each(|piece| plain.write_all(piece).unwrap());
                assert_eq!(String::from_utf8(out).unwrap(), expected, "in pieces of {size}");
            }
        };
        t("36 km/h, \u{b5}s, \u{4f60}, \u{1f682}\n", "36 km/h, \u{b5}s, \u{4f60}, \u{1f682}\n");
        t("a\u{1b}[2Jb\u{7}", "a\\u{1b}[2Jb\\u{7}");
        t("\u{9b}31m \u{a0}", "\\u{9b}31m \u{a0}");
        t("a\rb\tc\u{7f}\0", "a\\rb\\tc\\u{7f}\\u{0}");
        t("two\nlines", "two\nlines");
    }

    #[test]
    fn a_cell_is_one_line() {
        let mut out = Vec::new();
        table(&mut out, &["name", "v"], &[vec!["a\nb\u{1b}[A".into(), "1".into()]]).unwrap();
        let text = String::from_utf8(out).unwrap();
        assert_eq!(text, "name          v\na\\nb\\u{1b}[A  1\n");
    }
}
