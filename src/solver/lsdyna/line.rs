//! Lines, columns, Fortran numbers and the header, common to all LS-DYNA ASCII files.

use std::io::{self, BufRead};

use crate::solver::problem::Place;
use crate::solver::source::{self, Stream};

/// Bytes kept of one line. The longest line of any known file has 170; what lies
/// beyond is skipped, so that a file without line ends cannot fill the memory.
const MAX_LINE: usize = 4096;

/// One line without its line end.
#[derive(Debug)]
pub(crate) struct Line<'a> {
    pub text: &'a [u8],
    /// Counted from 1, as editors do.
    pub number: u64,
    /// Offset of the line's first byte in the file.
    pub byte: u64,
    /// Whether a line end follows; only the last line of a cut file has none.
    pub ended: bool,
    /// Whether bytes beyond the first 4096 were skipped.
    pub overlong: bool,
}

impl Line<'_> {
    pub(crate) fn is_blank(&self) -> bool {
        self.text.iter().all(u8::is_ascii_whitespace)
    }

    /// Whether the line has bytes that no text has: the file was overwritten there.
    pub(crate) fn is_binary(&self) -> bool {
        self.text.iter().any(|b| b.is_ascii_control() && !matches!(b, b'\t' | b'\r' | b'\x0c'))
    }

    /// Whether a line that holds no numbers is as the solver wrote it: without stars, which
    /// stand only where a number should be.
    pub(crate) fn is_heading(&self) -> bool {
        memchr::memmem::find(self.text, b"**").is_none()
    }

    /// Columns `from..=to`, counted from 1, as far as the line reaches.
    pub(crate) fn columns(&self, from: usize, to: usize) -> &[u8] {
        let end = to.min(self.text.len());
        self.text.get(from - 1..end).unwrap_or(&[])
    }
}

impl From<&Line<'_>> for Place {
    fn from(line: &Line<'_>) -> Self {
        Self { line: line.number, byte: line.byte, part: 0 }
    }
}

/// Reads lines ended by LF or CRLF with a bounded buffer.
pub(crate) struct Lines<R> {
    input: R,
    buffer: Vec<u8>,
    number: u64,
    byte: u64,
}

impl<R: BufRead> Lines<R> {
    pub(crate) fn new(input: R) -> Self {
        Self { input, buffer: Vec::with_capacity(256), number: 0, byte: 0 }
    }

    /// Number of the last line read, counted from 1, and the byte after it.
    pub(crate) fn place(&self) -> Place {
        Place { line: self.number, byte: self.byte, part: 0 }
    }

    /// The next line, or `None` at the end of the file.
    pub(crate) fn next_line(&mut self) -> io::Result<Option<Line<'_>>> {
        self.buffer.clear();
        let start = self.byte;
        let (mut ended, mut overlong) = (false, false);
        loop {
            let chunk = match self.input.fill_buf() {
                Ok(chunk) => chunk,
                Err(e) if e.kind() == io::ErrorKind::Interrupted => continue,
                Err(e) => return Err(e),
            };
            if chunk.is_empty() {
                break;
            }
            let end = memchr::memchr(b'\n', chunk);
            let taken = end.unwrap_or(chunk.len());
            let room = MAX_LINE - self.buffer.len();
            overlong |= taken > room;
            self.buffer.extend_from_slice(&chunk[..taken.min(room)]);
            let used = taken + usize::from(end.is_some());
            self.input.consume(used);
            self.byte += used as u64;
            if end.is_some() {
                ended = true;
                break;
            }
        }
        if self.byte == start {
            return Ok(None);
        }
        if ended && self.buffer.last() == Some(&b'\r') {
            self.buffer.pop();
        }
        self.number += 1;
        // Editors of Windows begin a file with it.
        let mark = if start == 0 { "\u{feff}" } else { "" };
        let text = self.buffer.strip_prefix(mark.as_bytes()).unwrap_or(&self.buffer);
        Ok(Some(Line { text, number: self.number, byte: start, ended, overlong }))
    }
}

impl Lines<Stream<'_>> {
    /// Goes on with the line that begins at `place`.
    pub(crate) fn go_to(&mut self, place: Place) {
        self.number = place.line - 1;
        self.byte = place.byte;
        self.input.go_to(place.byte);
    }
}

/// What a numeric field holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Field {
    /// The nearest double. A number too small for a double is the zero of its sign.
    Real(f64),
    /// Stars: the number did not fit its Fortran format.
    Overflow,
    /// `NaN` or `Infinity` as Fortran prints them, or a number too large for a double.
    NotFinite(f64),
    /// Anything else.
    Bad,
}

impl Field {
    /// The number, if it is a finite one.
    #[inline]
    pub(crate) fn number(self) -> Option<f64> {
        match self {
            Self::Real(value) => Some(value),
            _ => None,
        }
    }
}

/// Reads one Fortran real: the whole field, blanks around it allowed, nothing else.
///
/// Accepts what solvers write beyond C's syntax: `1.5D+00`, and exponents whose `E`
/// was dropped to make room (`-1.5000-345`, `0.00+00`). Fortran prints no exponent without a point: of
/// `192E+09` the beginning is missing.
pub(crate) fn real(field: &[u8]) -> Field {
    let text = field.trim_ascii();
    match free_real(text) {
        Field::Real(_) if !text.contains(&b'.') && integer(text).is_none() => Field::Bad,
        read => read,
    }
}

/// The same for what people write: `5E5` is a number, too.
pub(crate) fn free_real(field: &[u8]) -> Field {
    let text = field.trim_ascii();
    let plain = match text {
        [] => return Field::Bad,
        [b'0'..=b'9' | b'.' | b'-' | b'+', ..] => {
            text.iter().all(|b| matches!(b, b'0'..=b'9' | b'.' | b'-' | b'+' | b'E' | b'e'))
        }
        _ => return named_value(text),
    };
    if plain && let Ok(value) = fast_float2::parse::<f64, _>(text) {
        return finite(value);
    }
    fortran_real(text)
}

fn finite(value: f64) -> Field {
    if value.is_finite() { Field::Real(value) } else { Field::NotFinite(value) }
}

/// Stars, `NaN`, `Infinity`.
fn named_value(text: &[u8]) -> Field {
    if text.iter().all(|&b| b == b'*') {
        return Field::Overflow;
    }
    match text.to_ascii_lowercase().as_slice() {
        b"nan" => Field::NotFinite(f64::NAN),
        b"inf" | b"infinity" => Field::NotFinite(f64::INFINITY),
        _ => Field::Bad,
    }
}

/// Puts the exponent letter that C's syntax wants, then parses the whole field.
fn fortran_real(text: &[u8]) -> Field {
    let signless = &text[usize::from(matches!(text[0], b'+' | b'-'))..];
    if matches!(signless.to_ascii_lowercase().as_slice(), b"inf" | b"infinity") {
        return Field::NotFinite(if text[0] == b'-' { f64::NEG_INFINITY } else { f64::INFINITY });
    }
    let is_exponent = |b: u8| matches!(b, b'E' | b'e' | b'D' | b'd');
    let mut repaired = Vec::with_capacity(text.len() + 1);
    let mut seen_exponent = false;
    for (i, &b) in text.iter().enumerate() {
        match b {
            b'0'..=b'9' | b'.' => repaired.push(b),
            _ if is_exponent(b) && !seen_exponent => {
                seen_exponent = true;
                repaired.push(b'E');
            }
            b'+' | b'-' if i == 0 || is_exponent(text[i - 1]) => repaired.push(b),
            b'+' | b'-' if !seen_exponent => {
                seen_exponent = true;
                repaired.extend([b'E', b]);
            }
            _ => return Field::Bad,
        }
    }
    fast_float2::parse(&repaired).map_or(Field::Bad, finite)
}

/// Whether a text is a real as solvers print it, with nothing cut from it: a point between
/// digits and an exponent of two or three digits; or stars, or no finite number.
pub(crate) fn is_whole_real(text: &[u8]) -> bool {
    let digits = |text: &[u8]| text.iter().take_while(|b| b.is_ascii_digit()).count();
    let rest = text.strip_prefix(b"-").or_else(|| text.strip_prefix(b"+")).unwrap_or(text);
    let before = digits(rest);
    let Some(fraction) = rest[before..].strip_prefix(b".") else {
        return !text.is_empty() && matches!(real(text), Field::Overflow | Field::NotFinite(_));
    };
    let behind = digits(fraction);
    let exponent = match &fraction[behind..] {
        [b'E' | b'e' | b'D' | b'd', exponent @ ..] => exponent,
        exponent => exponent,
    };
    let [b'+' | b'-', exponent @ ..] = exponent else { return false };
    before > 0
        && behind > 0
        && (2..=3).contains(&exponent.len())
        && digits(exponent) == exponent.len()
}

/// Reads one integer: the whole field, blanks around it allowed.
pub(crate) fn integer(field: &[u8]) -> Option<i64> {
    std::str::from_utf8(field.trim_ascii()).ok()?.parse().ok()
}

/// A field's text for messages, with bytes that are not text replaced.
pub(crate) fn shown(field: &[u8]) -> String {
    String::from_utf8_lossy(field)
        .chars()
        .map(|c| if c.is_control() { '\u{fffd}' } else { c })
        .collect()
}

/// The text between `ls-dyna` and `date` on the second line, blanks folded:
/// `smp d R13 R13.1.1_27_8731a0`, `smp.123264 s`, `(version 970)`.
pub(crate) fn version(line: &[u8]) -> Option<String> {
    const NAME: usize = b"ls-dyna".len();
    let text = &line[blanks(line)..];
    let name = text.get(..NAME)?;
    let end = memchr::memmem::find(&text[NAME..], b"date ").map_or(text.len(), |at| NAME + at);
    let version = String::from_utf8_lossy(&text[NAME..end]);
    let version = version.split_whitespace().collect::<Vec<_>>().join(" ");
    name.eq_ignore_ascii_case(b"ls-dyna").then_some(version)
}

/// One entry of a legend: id in columns 1-9, five blanks, title from column 15.
/// The width of the title differs by file and writer, so it runs to the line's end.
pub(crate) fn legend_entry(line: &[u8]) -> Option<(i64, Option<String>)> {
    let text = &line[blanks(line)..];
    let is_of_id = |k: usize, b: u8| b.is_ascii_digit() || k == 0 && matches!(b, b'+' | b'-');
    let end = (0..text.len()).find(|&k| !is_of_id(k, text[k])).unwrap_or(text.len());
    let title = source::title(&text[end..]).trim().to_string();
    Some((integer(&text[..end])?, (!title.is_empty()).then_some(title)))
}

fn blanks(line: &[u8]) -> usize {
    line.iter().take_while(|b| matches!(b, b' ' | b'\t')).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_fortran_reals() {
        fn t(field: &str, expected: Field) {
            assert_eq!(real(field.as_bytes()), expected, "{field:?}");
        }
        t(" 1.5000E+00", Field::Real(1.5));
        t("-7.90000E+00", Field::Real(-7.9));
        t("-2.0-101", Field::Real(-2.0e-101)); // exponent too wide for its E
        t("-1.5000-345", Field::Real(-0.0)); // below the smallest double
        t("0.00+00", Field::Real(0.0));
        t(" 0.4873010E-02", Field::Real(0.4873010e-2));
        t("1.5D+03", Field::Real(1500.0));
        t("1.0+400", Field::NotFinite(f64::INFINITY));
        t("-Infinity", Field::NotFinite(f64::NEG_INFINITY));
        t("***********", Field::Overflow); // overflowed field
        t("", Field::Bad);
        t("1.234-1OO", Field::Bad);
        t("00E+00-1.200", Field::Bad); // a row shifted by some columns
        t("1.0 2.0", Field::Bad);
        t("E+05", Field::Bad);
        t("\0\0\0", Field::Bad);
        t("-", Field::Bad);
        t("0x10", Field::Bad);
        t("  192E+09", Field::Bad); // 1.71192E+09 that was cut
        t("192+09", Field::Bad);
        t(" 12", Field::Real(12.0));
        assert_eq!(free_real(b"192E+09"), Field::Real(192e9));
    }

    /// Every shape that a column can hold, of digits that differ and of digits that carry: what the
    /// standard library reads once the exponent has its letter.
    #[test]
    fn every_shape_equals_the_standard_library() {
        let exponents =
            ["", "E+05", "E-5", "E+105", "e-12", "D+03", "d-03", "+07", "-101", "+300", "-320"];
        let mut shapes = 0;
        for (sign, before, behind) in ["", "-", "+"].into_iter().flat_map(|sign| {
            (0..5).flat_map(move |before| (0..9).map(move |behind| (sign, before, behind)))
        }) {
            for digits in ["123456789", "999999999", "000000000", "100000000", "000000001"] {
                for exponent in exponents {
                    for blanks in ["", "  "] {
                        let (whole, decimals) = (&digits[..before], &digits[9 - behind..]);
                        let text = format!("{blanks}{sign}{whole}.{decimals}{exponent}{blanks}");
                        let letter = match exponent.bytes().next() {
                            Some(b'+' | b'-') => format!("E{exponent}"),
                            _ => exponent.to_uppercase().replace('D', "E"),
                        };
                        let plain: Result<f64, _> =
                            format!("{sign}{whole}.{decimals}{letter}").parse();
                        match (real(text.as_bytes()), plain) {
                            (Field::Real(value), Ok(expected)) => {
                                assert_eq!(value.to_bits(), expected.to_bits(), "{text}");
                            }
                            (Field::NotFinite(value), Ok(expected)) => {
                                assert_eq!(value, expected, "{text}")
                            }
                            (found, plain) => {
                                assert!(found == Field::Bad && plain.is_err(), "{text}: {found:?}")
                            }
                        }
                        shapes += 1;
                    }
                }
            }
        }
        assert_eq!(shapes, 3 * 5 * 9 * 5 * 11 * 2);
    }

    #[test]
    fn a_real_that_was_cut_is_not_whole() {
        for whole in ["1.5000E+00", "-0.5D-03", "0.00+00", "-1.5000-345", "***", "NaN"] {
            assert!(is_whole_real(whole.as_bytes()), "{whole}");
        }
        for cut in ["1.5000E+0", "1.5000E+", "1.5000", "1.", "5000E+00", "", "7", "1.5E+00-2.5E+00"]
        {
            assert!(!is_whole_real(cut.as_bytes()), "{cut}");
        }
    }

    #[test]
    fn lines_know_their_place() {
        let mut lines = Lines::new(&b"ab\r\n\ncd"[..]);
        let l = lines.next_line().unwrap().unwrap();
        assert_eq!((l.text, l.number, l.byte, l.ended), (&b"ab"[..], 1, 0, true));
        let l = lines.next_line().unwrap().unwrap();
        assert_eq!((l.text, l.number, l.byte), (&b""[..], 2, 4));
        let l = lines.next_line().unwrap().unwrap();
        assert_eq!((l.text, l.byte, l.ended), (&b"cd"[..], 5, false));
        assert!(lines.next_line().unwrap().is_none());
    }

    #[test]
    fn a_file_without_line_ends_stays_small() {
        let flood = vec![b'x'; 1_000_000];
        let mut lines = Lines::new(io::BufReader::new(&flood[..]));
        let line = lines.next_line().unwrap().unwrap();
        assert!(line.overlong);
        assert_eq!(line.text.len(), MAX_LINE);
    }

    #[test]
    fn reads_version_lines_of_all_generations() {
        fn t(line: &str, expected: Option<&str>) {
            assert_eq!(version(line.as_bytes()).as_deref(), expected, "{line:?}");
        }
        #[rustfmt::skip]
        let cases = [
            ("                         ls-dyna smp.123264 s           date 01/12/2018", Some("smp.123264 s")),
            ("                    ls-dyna smp d R13 R13.1.1_27_8731a0 date 07/28/2023", Some("smp d R13 R13.1.1_27_8731a0")),
            ("                         ls-dyna (version 970)     date 1/1/2004", Some("(version 970)")),
            ("                    ls-dyna smp d R16", Some("smp d R16")),
            (" some other text", None),
        ];
        cases.into_iter().for_each(|(line, expected)| t(line, expected));
    }

    #[test]
    fn reads_legend_entries() {
        fn t(line: &str, expected: Option<(i64, Option<&str>)>) {
            let entry = legend_entry(line.as_bytes());
            let entry = entry.as_ref().map(|(id, title)| (*id, title.as_deref()));
            assert_eq!(entry, expected, "{line:?}");
        }
        t("        1     FERRULE_TO_ANVIL    ", Some((1, Some("FERRULE_TO_ANVIL"))));
        t("  1100002                         ", Some((1100002, None)));
        t(" 84340382     slave of 2", Some((84340382, Some("slave of 2"))));
        t(" Entity #        Title", None);
        t("", None);
    }
}
