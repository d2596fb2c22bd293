//! The font: how wide a text is, and the outlines of its characters.

use std::sync::LazyLock;

use ttf_parser::{Face, GlyphId, OutlineBuilder};

/// A part of DejaVu Sans 2.37 with Latin, Greek, Cyrillic and signs; `font/subset` makes it.
static BYTES: &[u8] = include_bytes!("font/DejaVuSans.ttf");

static FACE: LazyLock<Face<'static>> = LazyLock::new(|| {
    Face::parse(BYTES, 0).expect("the font is part of the program, and its tests read it")
});

/// A piece of an outline, in units of the font with y upwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Piece {
    Move(f64, f64),
    Line(f64, f64),
    /// A quadratic curve: control point and end.
    Quad(f64, f64, f64, f64),
    Close,
}

/// A character of a text: its glyph, and where it begins, in units of the font.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Placed {
    pub(super) glyph: u16,
    pub(super) x: i64,
}

/// Units of the font in the height of a line.
pub(super) fn units_per_em() -> f64 {
    f64::from(FACE.units_per_em())
}

/// Above the baseline, in shares of the size.
pub(super) const ASCENT: f64 = 0.77;
pub(super) const DESCENT: f64 = 0.24;

/// The characters of a text one after the other. A character that the font lacks is a box.
pub(super) fn place(text: &str) -> (Vec<Placed>, i64) {
    let mut x = 0;
    let placed = text.chars().map(|c| {
        let glyph = FACE.glyph_index(c).unwrap_or(GlyphId(0));
        let at = Placed { glyph: glyph.0, x };
        x += i64::from(FACE.glyph_hor_advance(glyph).unwrap_or(FACE.units_per_em()));
        at
    });
    (placed.collect(), x)
}

pub(super) fn has(c: char) -> bool {
    FACE.glyph_index(c).is_some()
}

/// Width of a text in pixels.
pub(super) fn width(text: &str, size: f64) -> f64 {
    place(text).1 as f64 / units_per_em() * size
}

/// A text that is at most so wide: from its middle something is taken away.
pub(super) fn fitted(text: &str, size: f64, most: f64) -> String {
    if width(text, size) <= most {
        return text.into();
    }
    let letters: Vec<char> = text.chars().collect();
    // Longest text first; a text of n characters is tried log2(n) times.
    let shortened = |kept: usize| -> String {
        let (head, tail) = (kept.div_ceil(2), kept / 2);
        let head = letters[..head].iter();
        head.chain(&['…']).chain(&letters[letters.len() - tail..]).collect()
    };
    let (mut fits, mut too_wide) = (0, letters.len());
    while fits + 1 < too_wide {
        let kept = fits.midpoint(too_wide);
        if width(&shortened(kept), size) <= most { fits = kept } else { too_wide = kept }
    }
    shortened(fits)
}

/// Lines of at most a width, broken between words; a longer word is shortened.
pub(super) fn wrapped(text: &str, size: f64, most: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        let word = fitted(word, size, most);
        match lines.last_mut() {
            Some(line) if width(&format!("{line} {word}"), size) <= most => {
                line.push(' ');
                line.push_str(&word);
            }
            _ => lines.push(word),
        }
    }
    lines
}

pub(super) fn outline(glyph: u16) -> Vec<Piece> {
    struct Pieces(Vec<Piece>);
    impl OutlineBuilder for Pieces {
        fn move_to(&mut self, x: f32, y: f32) {
            self.0.push(Piece::Move(x.into(), y.into()));
        }
        fn line_to(&mut self, x: f32, y: f32) {
            self.0.push(Piece::Line(x.into(), y.into()));
        }
        fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
            self.0.push(Piece::Quad(x1.into(), y1.into(), x.into(), y.into()));
        }
        fn curve_to(&mut self, _: f32, _: f32, _: f32, _: f32, x: f32, y: f32) {
            // TrueType outlines have quadratic curves only.
            self.0.push(Piece::Line(x.into(), y.into()));
        }
        fn close(&mut self) {
            self.0.push(Piece::Close);
        }
    }
    let mut pieces = Pieces(Vec::new());
    // A blank has no outline.
    let _ = FACE.outline_glyph(GlyphId(glyph), &mut pieces);
    pieces.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_font_has_what_charts_write() {
        for c in "0123456789 km/h [MN] −…²³·µ°äöüßéñ ≤±Σ→Δ".chars() {
            assert!(FACE.glyph_index(c).is_some(), "{c}");
        }
    }

    #[test]
    fn long_texts_are_shortened_in_the_middle() {
        let text = "lead-car-wall/48kmh with a very long name and its end";
        let short = fitted(text, 13.0, 150.0);
        assert!(width(&short, 13.0) <= 150.0 && width(&short, 13.0) > 130.0, "{short}");
        assert!(short.starts_with("lead-car") && short.ends_with("its end"), "{short}");
        assert_eq!(fitted("abc", 13.0, 150.0), "abc");
        assert_eq!(fitted("abc", 13.0, 0.0), "…");
        let lines = wrapped(text, 13.0, 160.0);
        assert!(lines.len() > 1 && lines.iter().all(|l| width(l, 13.0) <= 160.0), "{lines:?}");
        assert_eq!(lines.join(" "), text);
    }
}
