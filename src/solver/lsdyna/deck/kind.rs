//! Which keywords are read, and by which cards.

use super::keyword::Keyword;

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
    HistoryNodes,
    HistoryNodesWithHeadings,
    HistoryNodesLocal,
    HistoryNodeSets,
    HistoryNodeSetsLocal,
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
        ["DATABASE", "HISTORY", "NODE"] => Kind::HistoryNodes,
        ["DATABASE", "HISTORY", "NODE", "ID"] => Kind::HistoryNodesWithHeadings,
        ["DATABASE", "HISTORY", "NODE", "LOCAL"] => Kind::HistoryNodesLocal,
        ["DATABASE", "HISTORY", "NODE", "SET"] => Kind::HistoryNodeSets,
        ["DATABASE", "HISTORY", "NODE", "SET", "LOCAL"] => Kind::HistoryNodeSetsLocal,
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
