//! Lines and numbers of text files.

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
