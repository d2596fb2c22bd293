//! TOML with comments, as proposals write it.

use serde::Serialize;

use super::evidence::Proposed;
use super::units::trimmed;

/// Comments are broken at this column.
const WIDTH: usize = 100;

/// A text as it grows.
#[derive(Default)]
pub(super) struct Text(String);

impl Text {
    pub(super) fn done(self) -> String {
        self.0
    }

    pub(super) fn blank(&mut self) {
        if !self.0.is_empty() {
            self.0.push('\n');
        }
    }

    pub(super) fn line(&mut self, line: &str) {
        self.0.push_str(line);
        self.0.push('\n');
    }

    /// A comment over as many lines as it needs.
    pub(super) fn comment(&mut self, comment: &str) {
        self.broken(comment, "# ", "#   ");
    }

    /// A point of a list.
    pub(super) fn item(&mut self, item: &str) {
        self.broken(item, "#   ", "#     ");
    }

    fn broken(&mut self, comment: &str, first: &str, further: &str) {
        let mut line = first.to_string();
        // A file's title may hold anything; a comment of TOML may not.
        let plain: String = comment.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        for word in words(&plain) {
            let is_begun = line.len() > further.len().max(first.len());
            if is_begun && line.chars().count() + 1 + word.chars().count() > WIDTH {
                self.line(&line);
                line = further.into();
            }
            if !line.ends_with(' ') {
                line.push(' ');
            }
            line.push_str(&word);
        }
        self.line(&line);
    }

    /// A key with its value under where it is from, or commented out with what to fill in.
    pub(super) fn value<T>(
        &mut self,
        key: &str,
        proposed: &Proposed<T>,
        shown: impl Fn(&T) -> String,
    ) {
        self.comment(&proposed.to_string());
        match proposed.value() {
            Some(value) => self.line(&format!("{key} = {}", shown(value))),
            None => self.line(&format!("# {key} =     # fill in")),
        }
    }
}

/// Units stay on the line of their number.
const UNITS: [&str; 10] = ["%", "ms", "µs", "s", "m", "m/s", "mm/s", "km/h", "t", "kg"];

/// The words of a comment, each number together with its unit.
fn words(text: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        let is_unit = UNITS.contains(&word.trim_end_matches([',', ';', ':', '.', ')']));
        match words.last_mut().filter(|last| is_unit && last.ends_with(|c: char| c.is_numeric())) {
            Some(last) => *last = format!("{last} {word}"),
            None => words.push(word.into()),
        }
    }
    words
}

/// A text as TOML writes it.
pub(super) fn quoted(text: &str) -> String {
    toml::Value::String(text.into()).to_string()
}

/// A table on one line.
pub(super) fn inline<T: Serialize>(table: &T) -> String {
    let mut text = String::new();
    match table.serialize(toml::ser::ValueSerializer::new(&mut text)) {
        Ok(_) => text,
        Err(_) => String::new(),
    }
}

/// A speed with five significant digits: texts have six.
pub(super) fn speed_text(m_per_s: f64) -> String {
    let km_per_h = m_per_s * 3.6;
    if km_per_h <= 0.0 {
        return "0km/h".into();
    }
    let digits = (4 - km_per_h.log10().floor() as i32).clamp(0, 9) as usize;
    format!("{}km/h", trimmed(&format!("{km_per_h:.digits$}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_their_units() {
        assert_eq!(
            words("within 3.1 %, at 36 km/h or m"),
            ["within", "3.1 %,", "at", "36 km/h", "or", "m"]
        );
        let mut text = Text::default();
        text.comment(&format!("{} 3.1 %", "x".repeat(WIDTH - 6)));
        text.comment("a\u{7f}b\nc");
        let long = format!("# {}\n#   3.1 %\n# a b c\n", "x".repeat(WIDTH - 6));
        assert_eq!(text.done(), long);
    }

    #[test]
    fn speeds_have_five_digits() {
        let shown = [24.999_984, 36.0, 0.123_456, 123.456_78].map(|v| speed_text(v / 3.6));
        assert_eq!(shown, ["25km/h", "36km/h", "0.12346km/h", "123.46km/h"]);
        assert_eq!(speed_text(0.0), "0km/h");
    }
}
