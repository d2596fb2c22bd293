//! Separated values: what separates the columns of a table that somebody else has written.

/// What separates the columns of the first line of `text` that is no comment (`#`): the first
/// comma, semicolon or tab outside of quotes.
pub fn separator(text: &[u8]) -> u8 {
    let text = text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(text);
    let mut lines = text.split(|&byte| byte == b'\n').map(<[u8]>::trim_ascii);
    let header = lines.find(|line| !line.is_empty() && line[0] != b'#').unwrap_or_default();
    let mut quoted = false;
    let found = header.iter().find(|&&byte| {
        quoted ^= byte == b'"';
        !quoted && matches!(byte, b',' | b';' | b'\t')
    });
    found.copied().unwrap_or(b',')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_decides() {
        let t =
            |text: &str, expected: u8| assert_eq!(separator(text.as_bytes()), expected, "{text}");
        t("d_m,force_N\n0;0\n", b',');
        t("d_m;force_N;\"a, b\"\n", b';');
        t("\"a, b\"\td\n", b'\t');
        t("\u{feff}# by hand; run 3\r\n\r\nd_m,force_N\n", b',');
        t("\r\nd_m;force_N\n", b';');
        t("d_m\n", b',');
        t("", b',');
    }
}
