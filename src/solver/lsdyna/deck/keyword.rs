//! Keyword lines: names, options, the card format they select, and which cards read which keyword.

/// Bytes kept of a keyword; the longest of the manual has 70.
const MAX_NAME: usize = 200;

/// Keywords that stand alone, and the first words of families. Other programs have some
/// of them too (Abaqus has `*NODE`), but continue with a comma or a blank.
const KEYWORDS_WITHOUT_OPTIONS: [&str; 6] =
    ["KEYWORD", "TITLE", "NODE", "PART", "INITIAL_VELOCITY", "INCLUDE_PATH"];
const FAMILIES: [&str; 14] = [
    "BOUNDARY_",
    "CONSTRAINED_",
    "CONTACT_",
    "CONTROL_",
    "DATABASE_",
    "DEFINE_",
    "ELEMENT_",
    "INITIAL_",
    "LOAD_",
    "MAT_",
    "PARAMETER_",
    "RIGIDWALL_",
    "SECTION_",
    "SET_",
];

/// Whether only a keyword deck has such a line.
pub(crate) fn signature(line: &[u8]) -> bool {
    Keyword::parse(line).is_some_and(|k| {
        let bare = k.arguments.is_empty() || k.name == "KEYWORD";
        bare && (KEYWORDS_WITHOUT_OPTIONS.contains(&&*k.name)
            || FAMILIES.iter().any(|f| k.name.starts_with(f)))
    })
}

/// Widths of the fields of cards, in the standard and in the long format.
pub(super) const STANDARD: usize = 10;
pub(super) const LONG: usize = 20;

/// `*NAME_OPTION arguments +`.
#[derive(Debug, PartialEq)]
pub(super) struct Keyword {
    /// In capitals and without its star.
    pub name: String,
    pub arguments: String,
    /// Width of fields that the keyword requests for itself: `+` long, `-` standard.
    pub width: Option<usize>,
}

impl Keyword {
    pub(crate) fn parse(line: &[u8]) -> Option<Self> {
        let line = line.get(..line.len().min(MAX_NAME))?.trim_ascii_end();
        let (line, width) = match line.split_last()? {
            (b'+', line) => (line, Some(LONG)),
            (b'-', line) => (line, Some(STANDARD)),
            // Wider ids in the mesh; nothing for the cards that are read here.
            (b'%', line) => (line, None),
            _ => (line, None),
        };
        let line = line.strip_prefix(b"*")?;
        let end = line.iter().position(|b| b.is_ascii_whitespace() || *b == b',');
        let (name, arguments) = line.split_at(end.unwrap_or(line.len()));
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_ascii_uppercase();
        let keyword = Self { name: text(name), arguments: text(arguments), width };
        (!name.is_empty()).then_some(keyword)
    }

    /// The width of fields that `*KEYWORD LONG=Y` sets for the whole deck.
    pub(crate) fn deck_width(&self) -> Option<usize> {
        if self.name != "KEYWORD" {
            return None;
        }
        let set = self.arguments.split([' ', ',']).find_map(|a| a.strip_prefix("LONG="))?;
        Some(if set == "Y" { LONG } else { STANDARD })
    }
}

/// The ASCII files that `*DATABASE_…` requests.
const ASCII_FILES: [&str; 34] = [
    "abstat", "atdout", "avsflt", "bearing", "bndout", "curvout", "defgeo", "deforc", "disbout",
    "elout", "gceout", "glstat", "h3out", "icvout", "jntforc", "matsum", "movie", "mpgs", "ncforc",
    "nodfor", "nodout", "pllyout", "prtube", "rbdout", "rcforc", "rwforc", "sbtout", "secforc",
    "sleout", "spcforc", "sphout", "ssstat", "swforc", "tprint",
];

/// Keywords by the cards they have.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Skipped,
    Title,
    ControlUnits,
    VelocityOfSet,
    VelocityOfNodes,
    VelocityOfRigidBodies,
    VelocityGeneration,
    /// Known to give velocities, by cards that are not read.
    UnreadVelocity,
    /// The card with the part, and the one with its velocity.
    InertiaBody {
        part: usize,
        velocity: usize,
    },
    Output(&'static str),
    /// Nodes, or sets of them, so many on a card.
    History {
        sets: bool,
        on_card: usize,
    },
    HistoryWithHeadings,
    Contact,
    Wall,
    /// Cards of one part, those of `_INERTIA` aside.
    Parts {
        cards: usize,
        inertia: bool,
    },
    /// A part whose further cards are of any number.
    OnePart,
    Parameters,
    Expressions,
    Include,
    IncludePath,
    /// Not read, which a problem says.
    Unread(&'static str),
}

pub(super) fn kind(keyword: &Keyword) -> Kind {
    let words: Vec<&str> = keyword.name.split('_').collect();
    match words.as_slice() {
        ["TITLE"] => Kind::Title,
        ["CONTROL", "UNITS"] => Kind::ControlUnits,
        ["INITIAL", "VELOCITY"] => Kind::VelocityOfSet,
        ["INITIAL", "VELOCITY", "NODE"] => Kind::VelocityOfNodes,
        ["INITIAL", "VELOCITY", "RIGID", "BODY"] => Kind::VelocityOfRigidBodies,
        ["INITIAL", "VELOCITY", "GENERATION"] => Kind::VelocityGeneration,
        ["INITIAL", "VELOCITY", "GENERATION", "START", "TIME"] => Kind::Skipped,
        ["INITIAL", "VELOCITY", ..] => Kind::UnreadVelocity,
        ["CONSTRAINED", "NODAL", "RIGID", "BODY", options @ ..] if options.contains(&"INERTIA") => {
            let part = usize::from(options.contains(&"TITLE"));
            let velocity = part + usize::from(options.contains(&"SPC")) + 3;
            Kind::InertiaBody { part, velocity }
        }
        ["DATABASE", "HISTORY", "NODE"] => Kind::History { sets: false, on_card: 8 },
        ["DATABASE", "HISTORY", "NODE", "ID"] => Kind::HistoryWithHeadings,
        ["DATABASE", "HISTORY", "NODE", "LOCAL"] => Kind::History { sets: false, on_card: 1 },
        ["DATABASE", "HISTORY", "NODE", "SET"] => Kind::History { sets: true, on_card: 8 },
        ["DATABASE", "HISTORY", "NODE", "SET", "LOCAL"] => Kind::History { sets: true, on_card: 1 },
        ["DATABASE", "HISTORY", "NODE", ..] => Kind::Unread("history nodes of this keyword"),
        ["DATABASE", name, ..] => ASCII_FILES
            .iter()
            .find(|file| file.eq_ignore_ascii_case(name))
            .map_or(Kind::Skipped, |file| Kind::Output(file)),
        // Settings of contacts, and couplings with files of their own.
        [
            "CONTACT",
            "ADD" | "AUTO" | "COUPLING" | "ENTITY" | "EXCLUDE" | "GEBOD" | "GUIDED" | "INTERIOR"
            | "1D",
            ..,
        ] => Kind::Skipped,
        ["CONTACT", _, ..] => Kind::Contact,
        ["RIGIDWALL", "PLANAR" | "GEOMETRIC", ..] => Kind::Wall,
        ["PART", options @ ..] => part_kind(options),
        ["PARAMETER"] | ["PARAMETER", "LOCAL" | "GLOBAL"] => Kind::Parameters,
        ["PARAMETER", "EXPRESSION", ..] => Kind::Expressions,
        ["PARAMETER", "DUPLICATION"] => Kind::Skipped,
        ["PARAMETER", ..] => Kind::Unread("parameters of this keyword"),
        ["INCLUDE"] => Kind::Include,
        ["INCLUDE", "PATH"] | ["INCLUDE", "PATH", "RELATIVE"] => Kind::IncludePath,
        // It would need the ids shifted.
        ["INCLUDE", ..] => Kind::Unread("files included by this keyword"),
        _ => Kind::Skipped,
    }
}

fn part_kind(options: &[&str]) -> Kind {
    let mut cards = 2;
    for option in options {
        match *option {
            // "ATTACHMENT_NODES" is one option.
            "INERTIA" | "ATTACHMENT" => {}
            "CONTACT" | "PRINT" | "REPOSITION" | "NODES" => cards += 1,
            "COMPOSITE" => return Kind::OnePart,
            _ => return Kind::Skipped,
        }
    }
    Kind::Parts { cards, inertia: options.contains(&"INERTIA") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_keyword_lines() {
        fn t(line: &str, expected: Option<(&str, &str, Option<usize>)>) {
            let k = Keyword::parse(line.as_bytes());
            let k = k.as_ref().map(|k| (&*k.name, &*k.arguments, k.width));
            assert_eq!(k, expected, "{line:?}");
        }
        t("*Part  ", Some(("PART", "", None)));
        t("*PART +", Some(("PART", "", Some(LONG))));
        t("*PART+", Some(("PART", "", Some(LONG))));
        t("*NODE %", Some(("NODE", "", None)));
        t("*KEYWORD memory=20m long=y", Some(("KEYWORD", "MEMORY=20M LONG=Y", None)));
        t("*", None);
        t("* PART", None);
        t("+", None);
        t("", None);
    }

    #[test]
    fn signatures_are_those_of_decks_only() {
        fn t(line: &str, expected: bool) {
            assert_eq!(signature(line.as_bytes()), expected, "{line:?}");
        }
        t("*KEYWORD LONG=Y", true);
        t("*title", true);
        t("*NODE", true);
        t("*DATABASE_NODOUT", true);
        t("*NODE, NSET=ALL", false); // Abaqus
        t("*Part, name=Body", false);
        t("*Heading", false);
        t(" *KEYWORD", false);
        t("*******", false);
        t("", false);
    }
}
