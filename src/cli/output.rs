//! Standard output and standard error: text, tables and JSON documents; a closed pipe is not
//! an error. Everything printed goes through here, where control characters are taken out:
//! a title in a solver's file may hold an escape sequence, which a terminal would obey.

use std::borrow::Cow;
use std::error::Error;
use std::io::{self, BufWriter, IsTerminal, Write};

use serde::Serialize;

use super::Failure;

/// Writes text to standard output.
pub fn print(write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Failure> {
    print_with(|_| REPLACED.into(), write)
}

/// Writes data to standard output, byte for byte; to a terminal as text.
pub fn print_data<T, E: Error + 'static>(
    write: impl FnOnce(&mut dyn Write) -> Result<T, E>,
) -> Result<T, Failure> {
    if io::stdout().is_terminal() {
        return print_with(|_| REPLACED.into(), write);
    }
    let mut out = BufWriter::new(Named(io::stdout().lock()));
    let written = write(&mut out)?;
    out.flush()?;
    Ok(written)
}

/// Prints one JSON document.
pub fn print_json(document: &impl Serialize) -> Result<(), Failure> {
    // JSON escapes the others itself; they stand within strings only.
    let escaped = |code: u8| format!("\\u{code:04x}");
    print_with(escaped, |out| {
        serde_json::to_writer_pretty(&mut *out, document).map_err(io::Error::from)?;
        writeln!(out)
    })
}

/// Writes to standard output through a buffer and flushes it.
fn print_with<T, E: Error + 'static>(
    instead: impl Fn(u8) -> String,
    write: impl FnOnce(&mut dyn Write) -> Result<T, E>,
) -> Result<T, Failure> {
    let out = Named(io::stdout().lock());
    let mut out = BufWriter::new(Plain { out, instead, held: false });
    let written = write(&mut out)?;
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

/// Prints a line on standard error.
pub fn say(line: &str) {
    // With standard error closed or full there is nobody to tell.
    let _ = writeln!(io::stderr().lock(), "{}", plain(line));
}

/// A text without control characters but line ends and tabs.
pub fn plain(text: &str) -> Cow<'_, str> {
    let is_control = |c: char| c.is_control() && c != '\n' && c != '\t';
    match text.contains(is_control) {
        true => Cow::Owned(text.replace(is_control, REPLACED)),
        false => Cow::Borrowed(text),
    }
}

/// What stands for a control character.
const REPLACED: &str = "\u{fffd}";

/// Passes bytes on without control characters but line ends and tabs: those of ASCII, and
/// those from U+0080 to U+009F, which UTF-8 writes as `0xc2` and a byte.
struct Plain<W, F> {
    out: W,
    /// What stands for a control character of that code.
    instead: F,
    /// Whether a `0xc2` waits for the byte behind it.
    held: bool,
}

/// First byte of the characters from U+0080 to U+00BF.
const LEAD: u8 = 0xc2;

fn is_control(byte: u8) -> bool {
    byte.is_ascii_control() && byte != b'\n' && byte != b'\t'
}

impl<W: Write, F: Fn(u8) -> String> Write for Plain<W, F> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if !self.held && !bytes.iter().any(|&byte| byte == LEAD || is_control(byte)) {
            self.out.write_all(bytes)?;
            return Ok(bytes.len());
        }
        let mut passed = Vec::with_capacity(bytes.len());
        for &byte in bytes {
            if std::mem::take(&mut self.held) {
                if (0x80..=0x9f).contains(&byte) {
                    passed.extend((self.instead)(byte).bytes());
                    continue;
                }
                passed.push(LEAD);
            }
            match byte {
                LEAD => self.held = true,
                _ if is_control(byte) => passed.extend((self.instead)(byte).bytes()),
                _ => passed.push(byte),
            }
        }
        self.out.write_all(&passed)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        if std::mem::take(&mut self.held) {
            self.out.write_all(&[LEAD])?;
        }
        self.out.flush()
    }
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
    // A name with a line's end or a tab in it is one cell all the same.
    let shown = |cell: &str| plain(cell).replace(['\n', '\t'], REPLACED);
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

    fn passed(chunks: &[&[u8]], instead: impl Fn(u8) -> String) -> String {
        let mut out = Vec::new();
        let mut plain = Plain { out: &mut out, instead, held: false };
        chunks.iter().for_each(|chunk| plain.write_all(chunk).unwrap());
        plain.flush().unwrap();
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn control_characters_are_not_printed() {
        let text = "a\x1b[31m\tb\x7f\u{9b}31m µ\r\n";
        let expected = "a\u{fffd}[31m\tb\u{fffd}\u{fffd}31m µ\u{fffd}\n";
        assert_eq!(plain(text), expected);
        // However the text is divided.
        for at in 0..=text.len() {
            let (a, b) = text.as_bytes().split_at(at);
            assert_eq!(passed(&[a, b], |_| REPLACED.into()), expected, "divided at {at}");
        }
        let json = passed(&["\u{9b}µ".as_bytes()], |code| format!("\\u{code:04x}"));
        assert_eq!(json, "\\u009bµ");
    }

    #[test]
    fn a_cell_is_one_line() {
        let mut out = Vec::new();
        table(&mut out, &["name", "v"], &[vec!["a\nb\u{1b}[A".into(), "1".into()]]).unwrap();
        let text = String::from_utf8(out).unwrap();
        assert_eq!(text, "name    v\na\u{fffd}b\u{fffd}[A  1\n");
    }
}
