//! Lines and numbers of text of any usual encoding: UTF-8 or UTF-16 with or without a byte-order mark, else Latin-1.

use std::borrow::Cow;

/// A text as UTF-8 without a byte-order mark, and what was done for it.
pub(super) struct Decoded<'a> {
    pub text: Cow<'a, str>,
    pub note: Option<&'static str>,
}

/// Bytes by which UTF-16 without a mark is recognised.
const BEGINNING: usize = 64;

/// The bytes as text; invalid bytes are replaced, and so are carriage returns where nothing else ends a line.
pub(super) fn decoded(bytes: &[u8]) -> Decoded<'_> {
    let of = of_encoding(bytes);
    // The last line may end in both.
    let inside = of.text.trim_end_matches(['\r', '\n']);
    match inside.contains('\r') && !inside.contains('\n') {
        true => Decoded {
            text: of.text.replace('\r', "\n").into(),
            note: of.note.or(Some("text: lines end in carriage returns")),
        },
        false => of,
    }
}

fn of_encoding(bytes: &[u8]) -> Decoded<'_> {
    let of_pairs = |rest: &[u8], pair: fn([u8; 2]) -> u16, note| {
        let mut units: Vec<u16> = rest.chunks_exact(2).map(|two| pair([two[0], two[1]])).collect();
        if rest.len() % 2 == 1 {
            // Half a character: the file is cut.
            units.push(u16::from(b'?'));
        }
        let text = char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER));
        Decoded { text: text.collect(), note: Some(note) }
    };
    match bytes {
        [0xEF, 0xBB, 0xBF, rest @ ..] => utf8_or_latin1(rest),
        [0xFF, 0xFE, rest @ ..] => {
            of_pairs(rest, u16::from_le_bytes, "text: UTF-16, little-endian")
        }
        [0xFE, 0xFF, rest @ ..] => of_pairs(rest, u16::from_be_bytes, "text: UTF-16, big-endian"),
        _ if is_zero(bytes, 1) => of_pairs(
            bytes,
            u16::from_le_bytes,
            "text: UTF-16, little-endian, without a byte-order mark",
        ),
        _ if is_zero(bytes, 0) => of_pairs(
            bytes,
            u16::from_be_bytes,
            "text: UTF-16, big-endian, without a byte-order mark",
        ),
        _ => utf8_or_latin1(bytes),
    }
}

/// Whether at the beginning the odd bytes, or the even ones, are zero and no others, as in ASCII
/// texts of UTF-16.
fn is_zero(bytes: &[u8], which: usize) -> bool {
    let beginning = &bytes[..bytes.len().min(BEGINNING) / 2 * 2];
    let mut bytes = beginning.iter().enumerate();
    beginning.len() >= 8 && bytes.all(|(k, byte)| (k % 2 == which) == (*byte == 0))
}

fn utf8_or_latin1(bytes: &[u8]) -> Decoded<'_> {
    match std::str::from_utf8(bytes) {
        Ok(text) => Decoded { text: text.into(), note: None },
        // A character of Latin-1 has the number of its byte.
        Err(_) => Decoded {
            text: bytes.iter().copied().map(char::from).collect(),
            note: Some("text: Latin-1, because it is not UTF-8"),
        },
    }
}

/// The finite number that a text is, also in Fortran's forms (`1.5D+03`, `1.5+3`).
pub(super) fn number(text: &str) -> Option<f64> {
    let text = text.trim();
    let parsed = text.parse::<f64>().ok().or_else(|| fortran(text)?.parse().ok());
    // A word such as "nan" or "inf" is not a value of a curve.
    parsed.filter(|value| value.is_finite())
}

/// A number whose exponent has a D, or no letter at all, with an E.
fn fortran(text: &str) -> Option<String> {
    if !text.bytes().all(|b| b.is_ascii_digit() || b"+-.dDeE".contains(&b)) {
        return None;
    }
    let text = text.replace(['d', 'D'], "E");
    if text.contains(['e', 'E']) {
        return Some(text);
    }
    let sign = text.rfind(['+', '-']).filter(|&at| at > 0)?;
    Some(format!("{}E{}", &text[..sign], &text[sign..]))
}

/// The lines of a text, counted from 1, without line ends.
pub(super) fn lines(text: &str) -> impl Iterator<Item = (u64, &str)> {
    let lines = text.split('\n').map(|line| line.strip_suffix('\r').unwrap_or(line));
    (1..).zip(lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_of_every_encoding_are_one() {
        let text = "Kraft/kN µ°ü\n1;2\n";
        let pairs = |of: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(of).collect::<Vec<u8>>();
        let latin1: Vec<u8> = text.chars().map(|c| c as u8).collect();
        let t = |bytes: Vec<u8>, note: Option<&str>| {
            let decoded = decoded(&bytes);
            assert_eq!(decoded.text, text, "{note:?}");
            assert_eq!(decoded.note.map(|n| &n[6..14]), note);
        };
        t(text.into(), None);
        t([b"\xEF\xBB\xBF", text.as_bytes()].concat(), None);
        t([vec![0xFF, 0xFE], pairs(u16::to_le_bytes)].concat(), Some("UTF-16, "));
        t([vec![0xFE, 0xFF], pairs(u16::to_be_bytes)].concat(), Some("UTF-16, "));
        t(latin1, Some("Latin-1,"));
        let plain: Vec<u8> = "d_m;F_N\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
        assert_eq!(decoded(&plain).text, "d_m;F_N\n");
        assert_eq!(decoded(b"d_m;F_N\r0;1\r").text, "d_m;F_N\n0;1\n");
        assert_eq!(decoded(b"d_m;F_N\r0;1\n").text, "d_m;F_N\n0;1\n");
        assert_eq!(decoded(b"d_m;F_N\r\n0;1\r\n").text, "d_m;F_N\r\n0;1\r\n");
        assert_eq!(decoded(&[0xFF, 0xFE, b'a', 0, b'b']).text, "a?");
    }

    #[test]
    fn reads_fortran_reals() {
        fn t(text: &str, expected: Option<f64>) {
            assert_eq!(number(text), expected, "{text:?}");
        }
        t(" 1.5E3", Some(1.5e3));
        t("1.5d+03", Some(1.5e3));
        t("1.5+3", Some(1.5e3));
        t("-2.0-3", Some(-2.0e-3));
        t("-2", Some(-2.0));
        t("nan", None);
        t("inf", None);
        t("1e999", None);
        t("1-2-3", None);
        t("", None);
        t("0.0 0.0", None);
        t("********", None);
    }
}
