//! Standard output and standard error: text, tables and JSON documents; a closed pipe is not
//! an error. Everything printed goes through here, where control characters are taken out:
//! a title in a solver file may hold an escape sequence, which a terminal would obey. Progress is
//! shown on a terminal, or to the program that asks for it.

use std::borrow::Cow;
use std::error::Error;
use std::fmt::Arguments;
use std::io::{self, BufWriter, IsTerminal, Write};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use super::{CommandResult, Failure, GlobalOptions};
use crate::error::Place;
use crate::os::terminal_width;
use crate::table::{Cell, Table};

/// Writes text to standard output.
pub(super) fn print(write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Failure> {
    print_with(|_| REPLACED.into(), write)
}

/// Writes data to standard output, byte for byte; to a terminal as text.
pub(super) fn print_data<T, E: Error + 'static>(
    write: impl FnOnce(&mut dyn Write) -> Result<T, E>,
) -> Result<T, Failure> {
    if io::stdout().is_terminal() {
        return print_with(|_| REPLACED.into(), write);
    }
    let mut out = BufWriter::new(NamedStdout(io::stdout().lock()));
    let written = write(&mut out)?;
    out.flush()?;
    Ok(written)
}

pub(super) fn print_json(document: &impl Serialize) -> Result<(), Failure> {
    // JSON escapes the others itself; they stand within strings only.
    print_with(
        |code| format!("\\u{code:04x}"),
        |out| {
            serde_json::to_writer_pretty(&mut *out, document).map_err(io::Error::from)?;
            writeln!(out)
        },
    )
}

/// Writes to standard output through a buffer and flushes it.
fn print_with<T, E: Error + 'static>(
    instead: Instead,
    write: impl FnOnce(&mut dyn Write) -> Result<T, E>,
) -> Result<T, Failure> {
    let out = NamedStdout(io::stdout().lock());
    let mut out = BufWriter::new(ControlFilter { out, instead, pending_lead: false });
    let written = write(&mut out)?;
    out.flush()?;
    Ok(written)
}

/// Standard output, whose errors say so.
struct NamedStdout<'a>(io::StdoutLock<'a>);

fn of_stdout(e: io::Error) -> io::Error {
    match e.kind() {
        io::ErrorKind::Interrupted => e,
        kind => io::Error::new(kind, format!("cannot write to standard output: {e}")),
    }
}

impl Write for NamedStdout<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write(bytes).map_err(of_stdout)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush().map_err(of_stdout)
    }
}

/// Prints a line on standard error.
pub(super) fn eprint_line(line: &str) {
    // With standard error closed or full nobody would read it.
    let _ = writeln!(io::stderr().lock(), "{}", plain(line));
}

/// Characters of a file's line that are shown where no terminal bounds them: a log is not the place for
/// a file of one long line.
const WIDEST: usize = 200;

/// Prints the line of a file that an error is about on standard error, with carets below.
pub(super) fn eprint_excerpt(place: Option<&Place>) {
    let width = error_width().unwrap_or(WIDEST);
    if let Some(excerpt) = place.and_then(|place| place.excerpt(width)) {
        eprint_line(&excerpt);
    }
}

/// A text without control characters but line ends and tabs.
pub(super) fn plain(text: &str) -> Cow<'_, str> {
    let is_control = |c: char| c.is_control() && c != '\n' && c != '\t';
    if text.contains(is_control) {
        Cow::Owned(text.replace(is_control, REPLACED))
    } else {
        Cow::Borrowed(text)
    }
}

/// Replacement of a control character.
const REPLACED: &str = "\u{fffd}";

/// Replacement of a control character of a code.
type Instead = fn(u8) -> String;

/// Passes bytes on without control characters but line ends and tabs: those of ASCII, and
/// those from U+0080 to U+009F, which UTF-8 writes as `0xc2` and a byte.
struct ControlFilter<W> {
    out: W,
    instead: Instead,
    /// Whether a `0xc2` waits for the byte after it.
    pending_lead: bool,
}

/// First byte of the characters from U+0080 to U+00BF.
const LEAD: u8 = 0xc2;

fn is_control(byte: u8) -> bool {
    byte.is_ascii_control() && byte != b'\n' && byte != b'\t'
}

impl<W: Write> Write for ControlFilter<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if !self.pending_lead && !bytes.iter().any(|&byte| byte == LEAD || is_control(byte)) {
            self.out.write_all(bytes)?;
            return Ok(bytes.len());
        }
        let mut passed = Vec::with_capacity(bytes.len());
        for &byte in bytes {
            if std::mem::take(&mut self.pending_lead) {
                if (0x80..=0x9f).contains(&byte) {
                    passed.extend((self.instead)(byte).bytes());
                    continue;
                }
                passed.push(LEAD);
            }
            match byte {
                LEAD => self.pending_lead = true,
                _ if is_control(byte) => passed.extend((self.instead)(byte).bytes()),
                _ => passed.push(byte),
            }
        }
        self.out.write_all(&passed)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        if std::mem::take(&mut self.pending_lead) {
            self.out.write_all(&[LEAD])?;
        }
        self.out.flush()
    }
}

/// Whether an error only says that the reader of a pipe went away.
pub(super) fn is_closed_pipe(error: &(dyn Error + 'static)) -> bool {
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
/// column is set left, the others right. What is wider than the terminal is shown in blocks of
/// columns, each with the first one, or with a line for each cell.
pub(super) fn table(out: &mut dyn Write, table: impl Into<Table>) -> io::Result<()> {
    table_within(out, width().unwrap_or(usize::MAX), &table.into())
}

fn table_within(out: &mut dyn Write, width: usize, table: &Table) -> io::Result<()> {
    // A name with a line's end or a tab in it is one cell all the same.
    let shown = |cell: &str| plain(cell).replace(['\n', '\t'], REPLACED);
    let heading: Vec<String> = table.heading.iter().map(|name| shown(name)).collect();
    let cells = |row: &Vec<Cell>| row.iter().map(|cell| shown(&cell.text)).collect();
    let rows: Vec<Vec<String>> = table.rows.iter().map(cells).collect();
    let width_of = |k: usize| {
        let cells = rows.iter().filter_map(|r| r.get(k)).map(|c| c.chars().count());
        cells.chain([heading[k].chars().count()]).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..heading.len()).map(width_of).collect();
    let first = widths.first().copied().unwrap_or(0);
    let widest = widths.iter().skip(1).copied().max().map_or(0, |other| other + GAP.len());
    if first + widest > width {
        return list(out, width, &heading, &rows);
    }
    let mut from = 1;
    loop {
        let mut to = from;
        let mut taken = first;
        while to < widths.len() && taken + GAP.len() + widths[to] <= width {
            taken += GAP.len() + widths[to];
            to += 1;
        }
        for row in std::iter::once(&heading).chain(&rows) {
            // Not by a width in the format, which has 16 bits.
            let blanks = |cell: &str, width: usize| " ".repeat(width - cell.chars().count());
            let mut line =
                row.first().map_or(String::new(), |cell| format!("{cell}{}", blanks(cell, first)));
            for (cell, &width) in row.iter().zip(&widths).take(to).skip(from) {
                line.push_str(&format!("{GAP}{}{cell}", blanks(cell, width)));
            }
            writeln!(out, "{}", line.trim_end())?;
        }
        if to >= widths.len() {
            return Ok(());
        }
        writeln!(out)?;
        from = to;
    }
}

/// Writes columns of numbers as CSV; names may hold commas and quotes, numbers cannot.
pub(super) fn csv(
    out: &mut dyn Write,
    columns: &[(String, &[f64])],
    mut number: impl FnMut(&mut Vec<u8>, f64) -> io::Result<()>,
) -> io::Result<()> {
    let mut heading = csv::Writer::from_writer(&mut *out);
    heading.write_record(columns.iter().map(|(name, _)| name))?;
    heading.flush()?;
    drop(heading);
    let mut line = Vec::new();
    for row in 0..columns.first().map_or(0, |(_, values)| values.len()) {
        line.clear();
        for (_, values) in columns {
            number(&mut line, values[row])?;
            line.push(b',');
        }
        line.pop();
        line.push(b'\n');
        out.write_all(&line)?;
    }
    Ok(())
}

/// Between columns.
const GAP: &str = "  ";

/// A table as a list: each row by its first cell, below it a line for each other one; what is
/// longer than a line continues in the next.
fn list(
    out: &mut dyn Write,
    width: usize,
    heading: &[String],
    rows: &[Vec<String>],
) -> io::Result<()> {
    for row in rows {
        for (k, (name, cell)) in heading.iter().zip(row).enumerate() {
            let text = if name.is_empty() { cell.clone() } else { format!("{name}: {cell}") };
            let (indent, more) = if k == 0 { ("", "  ") } else { ("  ", "    ") };
            let mut line = indent.to_string();
            for word in text.split(' ') {
                let length = line.chars().count();
                if !line.trim().is_empty() && length + 1 + word.chars().count() > width {
                    writeln!(out, "{line}")?;
                    line = more.into();
                }
                if !line.trim().is_empty() {
                    line.push(' ');
                }
                // A word may be longer than a line.
                for c in word.chars() {
                    if line.chars().count() >= width {
                        writeln!(out, "{line}")?;
                        line = more.into();
                    }
                    line.push(c);
                }
            }
            writeln!(out, "{}", line.trim_end())?;
        }
    }
    Ok(())
}

/// Prints the formats that a command knows: name, extensions and description of each.
pub(super) fn formats(
    formats: impl Iterator<Item = (&'static str, &'static [&'static str], &'static str)>,
    options: GlobalOptions,
) -> CommandResult {
    let formats: Vec<_> = formats.collect();
    let listed = formats.iter().map(|(name, extensions, description)| {
        document! { name: name, extensions: extensions, description: description }
    });
    let joined = |extensions: &[&str]| format!(".{}", extensions.join(" ."));
    let name = formats.iter().map(|format| format.0.len()).max().unwrap_or(0);
    let endings = formats.iter().map(|format| joined(format.1).len()).max().unwrap_or(0);
    options.show(&document! { formats: listed.collect::<Vec<_>>() }, |out| {
        formats.iter().try_for_each(|(own, extensions, description)| {
            writeln!(out, "{own:<name$}  {:<endings$}  {description}", joined(extensions))
        })
    })
}

/// Narrower is taken as this.
const LEAST: usize = 40;

/// Characters in a line of the terminal that standard output is; `None` if it is none.
pub(super) fn width() -> Option<usize> {
    let out = io::stdout();
    out.is_terminal().then(|| stated().or_else(|| terminal_width(&out)).unwrap_or(80).max(LEAST))
}

/// The same for standard error.
pub(super) fn error_width() -> Option<usize> {
    let err = io::stderr();
    err.is_terminal().then(|| stated().or_else(|| terminal_width(&err)).unwrap_or(80).max(LEAST))
}

/// The user's choice, whatever the terminal supports.
fn stated() -> Option<usize> {
    std::env::var("COLUMNS").ok()?.parse().ok().filter(|width| *width > 0)
}

/// A spinner that names the step just done, or a bar over a known number of items; gone when it is dropped. For the
/// program that sets CRUMPLE_PROGRESS=lines, lines on standard error instead: `progress: STEP` or
/// `progress: DONE/ITEMS`, at most ten a second.
pub(super) enum Bar {
    None,
    Drawn(ProgressBar),
    Lines { items: u64, last: Mutex<Option<Instant>> },
}

impl Bar {
    pub(super) fn new(options: GlobalOptions, what: &'static str) -> Self {
        Self::visible(options, || {
            let bar = ProgressBar::new_spinner().with_message(what);
            bar.enable_steady_tick(Duration::from_millis(100));
            bar
        })
    }

    /// With the time that is left.
    pub(super) fn over(options: GlobalOptions, items: u64) -> Self {
        Self::visible(options, || {
            let bar = ProgressBar::new(items);
            let template = "{wide_bar} {human_pos}/{human_len}, {per_sec}, {eta} left";
            match ProgressStyle::with_template(template) {
                Ok(style) => bar.with_style(style),
                Err(_) => bar,
            }
        })
    }

    fn visible(options: GlobalOptions, make: impl FnOnce() -> ProgressBar) -> Self {
        if options.quiet {
            Self::None
        } else if std::env::var_os("CRUMPLE_PROGRESS").is_some_and(|how| how == "lines") {
            Self::Lines { items: make().length().unwrap_or_default(), last: Mutex::default() }
        } else if std::io::stderr().is_terminal() {
            Self::Drawn(make())
        } else {
            Self::None
        }
    }

    pub(super) fn step(&self, done: &str) {
        match self {
            Self::None => {}
            Self::Drawn(bar) => bar.set_message(plain(done).into_owned()),
            Self::Lines { .. } => self.line(false, format_args!("{}", plain(done))),
        }
    }

    /// Sets how many items are done; what was done before the first call says nothing of the time left.
    pub(super) fn set(&self, done: u64, is_first: bool) {
        match self {
            Self::None => {}
            Self::Drawn(bar) => {
                bar.set_position(done);
                if is_first {
                    bar.reset_eta();
                }
            }
            Self::Lines { items, .. } => {
                self.line(is_first || done == *items, format_args!("{done}/{items}"));
            }
        }
    }

    fn line(&self, is_due: bool, text: Arguments<'_>) {
        let Self::Lines { last, .. } = self else { return };
        let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
        if is_due || last.is_none_or(|at| at.elapsed() >= Duration::from_millis(100)) {
            *last = Some(Instant::now());
            // Who does not listen gets the results all the same.
            let _ = writeln!(io::stderr(), "progress: {text}");
        }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        if let Self::Drawn(bar) = self {
            bar.finish_and_clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn passed(chunks: &[&[u8]], instead: Instead) -> String {
        let mut out = Vec::new();
        let mut plain = ControlFilter { out: &mut out, instead, pending_lead: false };
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
        let one = Table::of(["a\nb\u{1b}[A"]).column("name", |name| *name).column("v", |_| "1");
        table(&mut out, one).unwrap();
        let text = String::from_utf8(out).unwrap();
        assert_eq!(text, "name    v\na\u{fffd}b\u{fffd}[A  1\n");
    }

    #[test]
    fn a_wide_table_fits_the_terminal() {
        let table = |width: usize| {
            let mut out = Vec::new();
            let rows = [["a", "10.5", "7"], ["bcd", "1", "8"]];
            let names = ["run", "speed km/h", "mass"];
            let table = names.iter().enumerate();
            let table = table.fold(Table::of(rows), |t, (k, name)| t.column(*name, |row| row[k]));
            table_within(&mut out, width, &table.into()).unwrap();
            String::from_utf8(out).unwrap()
        };
        let whole = "run  speed km/h  mass\na          10.5     7\nbcd           1     8\n";
        assert_eq!(table(usize::MAX), whole);
        assert_eq!(table(21), whole);
        let blocks = "run  speed km/h\na          10.5\nbcd           1\n\nrun  mass\na       7\nbcd     8\n";
        assert_eq!(table(20), blocks);
        assert_eq!(table(15), blocks);
        let list = "run: a\n  speed km/h:\n    10.5\n  mass: 7\nrun: bcd\n  speed km/h:\n    1\n  mass: 8\n";
        assert_eq!(table(14), list);
        for width in 6..30 {
            assert!(table(width).lines().all(|line| line.len() <= width), "{}", table(width));
        }
    }
}
