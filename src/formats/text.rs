//! Numbers, titles, names and lines as text of other tools' files.

/// Adds a line to a text: `line!(text, "…")`.
macro_rules! line {
    ($text:expr, $($line:tt)+) => {{
        use std::fmt::Write as _;
        // Writing to a string cannot fail.
        let _ = writeln!($text, $($line)+);
    }};
}
pub(super) use line;

/// Nine significant digits in Fortran's form: `3.80000000E+06`.
pub(crate) fn nine_digits(value: f64) -> String {
    if let Some(text) = rounded_at_once(value) {
        return text;
    }
    let mut text = String::with_capacity("-3.80000000E-100".len());
    // A negative zero would only puzzle readers.
    line!(text, "{:.8E}", value + 0.0);
    text.pop();
    if let Some(mut at) = text.rfind('E').map(|e| e + 1) {
        if !text[at..].starts_with('-') {
            text.insert(at, '+');
        }
        at += 1;
        if text.len() - at < 2 {
            text.insert(at, '0');
        }
    }
    text
}

/// The same of usual sizes, of which a product with an exact power of ten decides the digits; `None` where rounding of the
/// product could, and of zero.
fn rounded_at_once(value: f64) -> Option<String> {
    let size = value.abs();
    if !(1e-9..1e12).contains(&size) {
        return None;
    }
    let exponent = libm::log10(size).floor() as i32;
    let power = 10_f64.powi((8 - exponent).abs());
    let scaled = if exponent <= 8 { size * power } else { size / power };
    let digits = scaled.round();
    if !(1e8..1e9).contains(&digits) || (scaled - digits).abs() > 0.5 - 1e-6 {
        return None;
    }
    let mut text = *b"-0.00000000E+00";
    let digit = |rest: u32| b'0' + (rest % 10) as u8;
    let mut rest = digits as u32;
    for k in [10, 9, 8, 7, 6, 5, 4, 3, 1] {
        text[k] = digit(rest);
        rest /= 10;
    }
    text[12] = if exponent < 0 { b'-' } else { b'+' };
    (text[13], text[14]) = (digit(exponent.unsigned_abs() / 10), digit(exponent.unsigned_abs()));
    let text = if value < 0.0 { &text[..] } else { &text[1..] };
    std::str::from_utf8(text).ok().map(String::from)
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

/// Longest identifier: importers unpack into folders of that name, and paths have their limits.
const LONGEST: usize = 60;

/// A C identifier made from a name: its ASCII letters and digits, and one `_` for what lies between.
pub(crate) fn identifier(name: &str) -> String {
    let mut plain = String::new();
    for c in name.chars() {
        match c {
            c if c.is_ascii_alphanumeric() => plain.push(c),
            _ if plain.ends_with('_') || plain.is_empty() => {}
            _ => plain.push('_'),
        }
    }
    // It must not begin with a digit, be empty, or be a word of C.
    let begins_well = plain.starts_with(|c: char| c.is_ascii_alphabetic());
    let is_long_enough = plain.len() > 8;
    if !(begins_well && (is_long_enough || plain.contains('_'))) {
        plain = format!("spring_{plain}");
    }
    plain.truncate(LONGEST);
    plain.trim_end_matches('_').to_string()
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
        // As the library rounds them: of any size, ties, and powers of ten with their neighbours.
        let powers = (-12..14).map(|n| 10_f64.powi(n));
        let near =
            powers.flat_map(|x| [x, x.next_down(), x.next_up(), 1.000000005 * x, 9.999999995 * x]);
        let any = (0..200_000).map(|k| (f64::from(k) * 0.731).sin() * 10_f64.powi(k % 24 - 11));
        let ties = (0..1000).map(|k| f64::from(k) + 123_456_789.5);
        for value in near.chain(any).chain(ties).flat_map(|x| [x, -x]) {
            let exact = format!("{:.8E}", value + 0.0);
            let (mantissa, exponent) = exact.split_once('E').unwrap();
            let exponent: i32 = exponent.parse().unwrap();
            let sign = if exponent < 0 { '-' } else { '+' };
            assert_eq!(nine_digits(value), format!("{mantissa}E{sign}{:02}", exponent.abs()));
        }
    }

    #[test]
    fn titles_are_plain() {
        assert_eq!(title("$*lead, car é", 80), "lead  car  ");
        assert_eq!(title(&"x".repeat(200), 80).len(), 80);
    }

    #[test]
    fn identifiers_are_plain() {
        fn t(name: &str, expected: &str) {
            assert_eq!(identifier(name), expected, "{name:?}");
        }
        t("lead-car-wall 50 km/h (wall)", "lead_car_wall_50_km_h_wall");
        t("Stoß <&> vorn", "Sto_vorn");
        t("900001", "spring_900001");
        t("int", "spring_int");
        t("volatile", "spring_volatile");
        t("", "spring");
        t("äöü", "spring");
        assert_eq!(identifier(&"a".repeat(200)).len(), LONGEST);
    }
}
