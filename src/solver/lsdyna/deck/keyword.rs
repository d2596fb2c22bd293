//! Keyword lines: names, options, and the card format they select.

use nom::IResult;
use nom::Parser;
use nom::bytes::complete::{tag, take_till1};
use nom::combinator::rest;
use nom::sequence::preceded;

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

/// Whether cards have fields 20 wide instead of 10.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Standard,
    Long,
}

/// `*NAME_OPTION arguments +`.
#[derive(Debug, PartialEq)]
pub(super) struct Keyword {
    /// In capitals and without its star.
    pub name: String,
    pub arguments: String,
    /// What the keyword requests for itself: `+` long, `-` standard.
    pub format: Option<Format>,
}

impl Keyword {
    pub(crate) fn parse(line: &[u8]) -> Option<Self> {
        fn split(line: &[u8]) -> IResult<&[u8], (&[u8], &[u8])> {
            let end = |b: u8| b.is_ascii_whitespace() || b == b',';
            (preceded(tag("*"), take_till1(end)), rest).parse(line)
        }
        let line = line.get(..line.len().min(MAX_NAME))?.trim_ascii_end();
        let (line, format) = match line.split_last()? {
            (b'+', line) => (line, Some(Format::Long)),
            (b'-', line) => (line, Some(Format::Standard)),
            // Wider ids in the mesh; nothing for the cards that are read here.
            (b'%', line) => (line, None),
            _ => (line, None),
        };
        let (_, (name, arguments)) = split(line).ok()?;
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_ascii_uppercase();
        Some(Self { name: text(name), arguments: text(arguments), format })
    }

    /// The format that `*KEYWORD LONG=Y` sets for the whole deck.
    pub(crate) fn deck_format(&self) -> Option<Format> {
        if self.name != "KEYWORD" {
            return None;
        }
        let set = self.arguments.split([' ', ',']).find_map(|a| a.strip_prefix("LONG="))?;
        Some(if set == "Y" { Format::Long } else { Format::Standard })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_keyword_lines() {
        fn t(line: &str, expected: Option<(&str, &str, Option<Format>)>) {
            let k = Keyword::parse(line.as_bytes());
            let k = k.as_ref().map(|k| (&*k.name, &*k.arguments, k.format));
            assert_eq!(k, expected, "{line:?}");
        }
        t("*Part  ", Some(("PART", "", None)));
        t("*PART +", Some(("PART", "", Some(Format::Long))));
        t("*PART+", Some(("PART", "", Some(Format::Long))));
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
