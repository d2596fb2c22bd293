//! Numbers, titles and lines as text of other tools' files.

use std::fmt::{Arguments, Write};

/// Nine significant digits in Fortran's form: `3.80000000E+06`.
pub(crate) fn nine_digits(value: f64) -> String {
    // A negative zero would only puzzle readers.
    let text = format!("{:.8E}", value + 0.0);
    match text.split_once('E') {
        Some((mantissa, exponent)) => {
            let (sign, digits) = match exponent.strip_prefix('-') {
                Some(digits) => ('-', digits),
                None => ('+', exponent),
            };
            format!("{mantissa}E{sign}{digits:0>2}")
        }
        None => text,
    }
}

/// A title of at most `width` characters that no keyword reader misreads: ASCII, no comma
/// (some readers then take the line for free format), no `*`, `$`, `/` or `#` in front.
pub(crate) fn title(text: &str, width: usize) -> String {
    text.trim_start_matches(['*', '$', '/', '#', ' '])
        .chars()
        .map(|c| if c.is_ascii_graphic() && c != ',' { c } else { ' ' })
        .take(width)
        .collect()
}

/// A text that grows line by line.
#[derive(Default)]
pub(crate) struct Lines(String);

impl Lines {
    /// Adds one line: `lines.add(format_args!("…"))`.
    pub(super) fn add(&mut self, line: Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.0, "{line}");
    }

    pub(super) fn into_bytes(self) -> Vec<u8> {
        self.0.into_bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_nine_digits() {
        assert_eq!(nine_digits(3.8e6), "3.80000000E+06");
        assert_eq!(nine_digits(-1.0 / 3.0), "-3.33333333E-01");
        assert_eq!(nine_digits(-0.0), "0.00000000E+00");
        assert_eq!(nine_digits(1e-120), "1.00000000E-120");
    }

    #[test]
    fn titles_are_plain() {
        assert_eq!(title("$*lead, car é", 80), "lead  car  ");
        assert_eq!(title(&"x".repeat(200), 80).len(), 80);
    }
}
