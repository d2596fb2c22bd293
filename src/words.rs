//! Numbers of things in messages (`1 run`, `2 runs`), and texts as markup takes them.

/// A number with what it counts: `one` as of a single thing, with an s for any other number.
pub(crate) fn counted(count: impl TryInto<u64> + Copy, one: &str) -> String {
    // A number that is too large for the type is more than one.
    let count = count.try_into().unwrap_or(u64::MAX);
    format!("{count} {one}{}", if count == 1 { "" } else { "s" })
}

/// A text as XML and HTML take it, within quotes or not: in one line, and what XML cannot hold at all is replaced.
pub(crate) fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            '\n' | '\r' | '\t' => safe.push(' '),
            c if c.is_control() || ('\u{fffe}'..='\u{ffff}').contains(&c) => safe.push('\u{fffd}'),
            c => safe.push(c),
        }
    }
    safe
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_of_markup_are_escaped() {
        assert_eq!(
            escaped("a<b & 'c' \"d\"\n\u{1b}[0m"),
            "a&lt;b &amp; &#39;c&#39; &quot;d&quot; \u{fffd}[0m"
        );
    }

    #[test]
    fn one_thing_has_no_plural() {
        assert_eq!([0_usize, 1, 2].map(|n| counted(n, "run")), ["0 runs", "1 run", "2 runs"]);
    }
}
