//! Numbers of things in messages: `1 run`, `2 runs`.

/// A number with what it counts: `one` as of a single thing, with an s for any other number.
pub(crate) fn counted(count: impl TryInto<u64> + Copy, one: &str) -> String {
    // A number that is too large for the type is more than one.
    let count = count.try_into().unwrap_or(u64::MAX);
    format!("{count} {one}{}", if count == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_thing_has_no_plural() {
        assert_eq!([0_usize, 1, 2].map(|n| counted(n, "run")), ["0 runs", "1 run", "2 runs"]);
    }
}
