//! What the title of a node says of the body that it may stand for.

/// Whether a title names a body's centre of gravity.
pub(super) fn names_centre_of_gravity(title: Option<&str>) -> bool {
    let Some(title) = title.map(str::to_lowercase) else { return false };
    let word = |wanted: &str| title.split(|c: char| !c.is_alphanumeric()).any(|w| w == wanted);
    let centre = ["centre", "center"].iter().any(|c| title.contains(c));
    let of_mass = ["gravity", "mass"].iter().any(|c| title.contains(c));
    word("cog")
        || word("cg")
        || title.contains("c.g.")
        || title.contains("c.o.g")
        || centre && of_mass
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn centres_of_gravity_are_known_by_their_titles() {
        fn t(title: &str, expected: bool) {
            assert_eq!(names_centre_of_gravity(Some(title)), expected, "{title}");
        }
        t("COG of the rigid body of car A", true);
        t("N900001_COG", true);
        t("vehicle CG", true);
        t("c.g. of car body", true);
        t("Centre of gravity", true);
        t("center of mass", true);
        t("centre of the nose plate of car A", false);
        t("cogwheel", false);
        t("mass of equipment", false);
        assert!(!names_centre_of_gravity(None));
    }
}
