//! Lines of a deck: cards with their fields, and keywords: names, options, the card format they select, and which cards read which keyword.

use crate::solver::lsdyna::line::{Line, integer, shown};
use crate::solver::problem::Place;
use crate::solver::source;

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
    /// Its first card, below a title or not.
    Material {
        titled: bool,
    },
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
        ["MAT", options @ ..] => Kind::Material { titled: options.contains(&"TITLE") },
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

/// Bytes kept of a title or heading; the manual's end at 80.
const MAX_TEXT: usize = 200;

/// One field, its columns, counted from 1, and the place of its card.
#[derive(Clone, Copy)]
pub(super) struct Field<'a> {
    pub text: &'a [u8],
    pub columns: [usize; 2],
    pub place: Place,
}

pub(super) struct Card<'a> {
    pub text: &'a [u8],
    pub place: Place,
    width: usize,
    fields: Vec<Field<'a>>,
}

impl<'a> Card<'a> {
    /// Cuts a card into fields of that width, or at commas.
    pub(crate) fn new(line: &Line<'a>, width: usize) -> Self {
        let (text, place) = (line.text.trim_ascii_end(), line.into());
        let comma = usize::from(text.contains(&b','));
        let cut: Vec<&[u8]> = match comma {
            1 => text.split(|b| *b == b',').collect(),
            _ => text.chunks(width).collect(),
        };
        let mut start = 1;
        let fields = cut.into_iter().map(|text| {
            let columns = [start, start + text.len().max(1) - 1];
            start += text.len() + comma;
            Field { text: text.trim_ascii(), columns, place }
        });
        Self { text, place, width, fields: fields.collect() }
    }

    pub(crate) fn is_blank(&self) -> bool {
        self.text.trim_ascii().is_empty()
    }

    /// Field `k`, counted from 0; blank beyond the end of the card.
    pub(crate) fn field(&self, k: usize) -> Field<'a> {
        let beyond = Field { text: b"", columns: [0, 0], place: self.place };
        self.fields.get(k).copied().unwrap_or(beyond)
    }

    pub(crate) fn fields(&self) -> impl Iterator<Item = Field<'a>> + use<'a, '_> {
        self.fields.iter().copied()
    }

    /// An id and the text after it. The text may hold commas, so the card counts as
    /// free only when its first columns are not a number by themselves.
    pub(crate) fn id_and_text(&self) -> (Field<'a>, Option<String>) {
        let width = self.width.min(self.text.len());
        let (id, title) = self.text.split_at(width);
        let free_id = self.field(0);
        let is_free =
            free_id.columns[1] < width && integer(id).is_none() && !id.trim_ascii().is_empty();
        if is_free && let Some(title) = self.text.get(free_id.columns[1]..) {
            return (free_id, text(title.strip_prefix(b",").unwrap_or(title)));
        }
        let columns = [1, width.max(1)];
        (Field { text: id.trim_ascii(), columns, place: self.place }, text(title))
    }
}

/// Text as the solver takes it, without the blanks around it; `None` when blank.
pub(super) fn text(bytes: &[u8]) -> Option<String> {
    let bytes = bytes.trim_ascii();
    let kept = bytes.get(..MAX_TEXT).unwrap_or(bytes);
    let plain = |c: char| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c };
    let text: String = source::title(kept).chars().map(plain).collect();
    (!text.is_empty()).then_some(text)
}

/// Bytes of damaged text shown in a message.
const MAX_SHOWN: usize = 80;

/// Enough of a line to know it again, for messages.
pub(super) fn start(line: &[u8]) -> String {
    shown(line.get(..MAX_SHOWN).unwrap_or(line))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::lsdyna::deck::keyword::{LONG, STANDARD};

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

    fn card(text: &str, width: usize) -> Card<'_> {
        let text = text.as_bytes();
        Card::new(&Line { text, number: 1, byte: 0, ended: true, overlong: false }, width)
    }

    #[test]
    fn cuts_fixed_and_free_cards() {
        fn t(text: &str, width: usize, expected: &[(&str, [usize; 2])]) {
            let card = card(text, width);
            let fields: Vec<_> = card.fields().map(|f| (f.text, f.columns)).collect();
            let expected: Vec<_> = expected.iter().map(|(t, c)| (t.as_bytes(), *c)).collect();
            assert_eq!(fields, expected, "{text:?}");
        }
        let (standard, long) = (STANDARD, LONG);
        t("         1       2.5", standard, &[("1", [1, 10]), ("2.5", [11, 20])]);
        t("11.00000E10", standard, &[("11.00000E1", [1, 10]), ("0", [11, 11])]);
        t("         1       2.5", long, &[("1       2.5", [1, 20])]);
        t("1, 2.5,,x ", standard, &[("1", [1, 1]), ("2.5", [3, 6]), ("", [8, 8]), ("x", [9, 9])]);
        t(",7", standard, &[("", [1, 1]), ("7", [2, 2])]);
        t("", standard, &[]);
    }

    #[test]
    fn splits_ids_from_titles() {
        fn t(line: &str, width: usize, id: &str, title: Option<&str>) {
            let card = card(line, width);
            let (field, text) = card.id_and_text();
            assert_eq!((field.text, text.as_deref()), (id.as_bytes(), title), "{line:?}");
        }
        let (standard, long) = (STANDARD, LONG);
        t("     80085Left_on_left", standard, "80085", Some("Left_on_left"));
        t("         2 Between sheets", standard, "2", Some("Between sheets"));
        t("         1front, left", standard, "1", Some("front, left"));
        t("12, front, left", standard, "12", Some("front, left"));
        t("                   3nose", long, "3", Some("nose"));
        t("          no id", standard, "", Some("no id"));
        t("         1", standard, "1", None);
        t("7", standard, "7", None);
        t("", standard, "", None);
    }
}
