//! One best guess for an unknown name: the most similar known one.

/// Least Jaro–Winkler similarity of a guess; below it a guess would mislead.
const LEAST: f64 = 0.8;

/// The known name that is most like `name`, if one is like it at all. Capitals count as small
/// letters; of equally near names the first.
pub(crate) fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let name = name.to_lowercase();
    let mut best = None;
    for candidate in known {
        let similarity = strsim::jaro_winkler(&name, &candidate.to_lowercase());
        if similarity >= LEAST && best.is_none_or(|(most, _)| similarity > most) {
            best = Some((similarity, candidate));
        }
    }
    best.map(|(_, candidate)| candidate)
}

/// What a message says after the list of known names: `; did you mean "x"?`, or nothing.
/// `known` is the list as in the message: names with commas between, in quotes or not.
pub(crate) fn hint(name: &str, known: &str) -> String {
    let names = known.split(", ").map(|name| name.trim_matches(['"', '`']));
    match nearest(name, names) {
        Some(guess) => format!("; did you mean \"{}\"?", guess.escape_debug()),
        None => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_or_none() {
        let known = ["normal_force", "x_force", "y_force", "z_force"];
        let t = |name: &str, expected| assert_eq!(nearest(name, known), expected, "{name}");
        t("norm_force", Some("normal_force"));
        t("X_FORCE", Some("x_force"));
        t("q_force", Some("x_force"));
        t("mass", None);
        t("", None);
        assert_eq!(nearest("a", []), None);
    }

    /// Similarities from the definition: (m/a + m/b + (m−t)/m)/3 and 0.1 for each of up to four
    /// equal first letters of what is missing to 1.
    #[test]
    fn four_fifths_is_the_bound() {
        // Two of four letters, in order, none of them first: (1/2 + 1/2 + 1)/3 = 2/3.
        assert_eq!(nearest("abcd", ["xbcy"]), None);
        // Three of five: (0.6 + 0.6 + 1)/3 = 0.733, with three first letters 0.813.
        assert_eq!(nearest("abcde", ["abcxy"]), Some("abcxy"));
        // With two first letters and another one: 0.733 + 0.2 * 0.267 = 0.787.
        assert_eq!(nearest("abcde", ["abxcy"]), None);
    }

    #[test]
    fn hints_read_lists_of_messages() {
        assert_eq!(hint("lead-wall", "lead-car-wall, pair"), "; did you mean \"lead-car-wall\"?");
        assert_eq!(hint("grop", "`name`, `group`"), "; did you mean \"group\"?");
        assert_eq!(hint("wall", "none"), "");
    }
}
