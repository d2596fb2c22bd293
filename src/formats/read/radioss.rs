//! Curve of a Radioss deck: a function `/FUNCT/id`.
//!
//! Behind the keyword stand a title and points of two fields of 20 columns; the next keyword ends them. Lines
//! that begin with `#` or `$` are comments. Units are those of a comment (`units: mm-t-s`) or of `/BEGIN`, where
//! the fourth line has mass, length and time, by name or by their size in SI.

use super::Input;
use super::columns::{Columns, MAX_POINTS, Places, check_curves};
use super::curve::{Metadata, stated_units, title, units};
use super::curve::{Place, shown};
use super::lsdyna::Fields;
use super::text::{lines, number};
use crate::error::{Error, error};
use crate::guess;
use crate::unit::UnitSystem;

const REMEDY: &str = " (or in a comment of the file: \"# units: mm-t-s\")";

/// Columns of a field.
const WIDTH: usize = 20;
/// Functions that a message lists.
const LISTED: usize = 20;

pub(super) fn recognise(input: &Input<'_>) -> bool {
    let is_comment = |line: &str| line.trim().is_empty() || line.starts_with(['#', '$']);
    let first = lines(input.beginning()).find(|(_, line)| !is_comment(line));
    first.is_some_and(|(_, line)| is_keyword(&line))
}

pub(super) fn read(input: &Input<'_>) -> Result<Columns, Error> {
    let mut deck = Deck::read(input.text)?;
    let found = deck.choose(input.options.curve.as_deref())?;
    let mut notes = vec![format!("curve: /FUNCT/{} of the deck", found.id)];
    let system = units(found.units, input.options.units, REMEDY, &mut notes)?;
    let (length, force) = (system.length_m, system.force());
    Ok(Columns {
        deflection_m: found.points.iter().map(|(x, _)| x * length).collect(),
        force_n: found.points.iter().map(|(_, y)| y * force).collect(),
        facts: found.facts,
        title: title(&found.title, &mut notes),
        units: Some(system),
        notes,
        ..Columns::at(Places::Lines(found.lines))
    })
}

/// Whether a line is one of `/NAME/…`.
fn is_keyword(line: &str) -> bool {
    line.strip_prefix('/').is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_uppercase()))
}

/// A function of the deck, as it is written.
#[derive(Clone, Debug, Default)]
struct Found {
    id: String,
    title: String,
    points: Vec<(f64, f64)>,
    lines: Vec<u64>,
    /// What the comments in front of it say.
    facts: Metadata,
    units: Option<(UnitSystem, u64)>,
}

/// What the next line is.
#[derive(Clone, Copy, PartialEq)]
enum Next {
    /// Nothing of a function.
    Other,
    Title,
    Point,
    /// So many lines of `/BEGIN` before that of the units.
    Begin(u8),
}

/// The functions of a deck, and what its comments say.
#[derive(Default)]
struct Deck {
    functions: Vec<Found>,
    facts: Metadata,
    units: Option<(UnitSystem, u64)>,
}

impl Deck {
    fn read(text: &[u8]) -> Result<Self, Error> {
        let mut deck = Self::default();
        let mut next = Next::Other;
        for (at, line) in lines(text) {
            if let Some(comment) = line.strip_prefix(['#', '$']) {
                let comment = comment.trim_start_matches(['#', '$']);
                deck.units = stated_units(comment).map(|units| (units, at)).or(deck.units);
                deck.facts.take(&line[..1], comment, Place::Line(at))?;
                continue;
            }
            if is_keyword(&line) {
                next = deck.keyword(&line);
                check_curves(deck.functions.len())?;
                continue;
            }
            next = deck.line(next, &line, at)?;
        }
        Ok(deck)
    }

    /// What follows a keyword.
    fn keyword(&mut self, line: &str) -> Next {
        let mut parts = line.trim_end().split('/').skip(1);
        match parts.next() {
            Some("BEGIN") => Next::Begin(2),
            Some("FUNCT") => {
                let id = parts.next().unwrap_or_default().trim().to_string();
                let (facts, units) = (self.facts, self.units);
                self.functions.push(Found { id, facts, units, ..Found::default() });
                Next::Title
            }
            _ => Next::Other,
        }
    }

    /// Takes a line that is neither comment nor keyword; gives what the one behind it is.
    fn line(&mut self, next: Next, line: &str, at: u64) -> Result<Next, Error> {
        let Some(function) = self.functions.last_mut() else {
            return Ok(match next {
                Next::Begin(0) => {
                    self.units = self.units.or(begin_units(line).map(|units| (units, at)));
                    Next::Other
                }
                Next::Begin(more) => Next::Begin(more - 1),
                _ => Next::Other,
            });
        };
        match next {
            Next::Title => {
                function.title = line.trim().into();
                Ok(Next::Point)
            }
            Next::Point if !line.trim().is_empty() => {
                let fields = Fields::of(line, at, WIDTH);
                function.points.push((fields.number(0, false)?, fields.number(1, false)?));
                function.lines.push(at);
                if function.points.len() > MAX_POINTS {
                    Err(error!(
                        CurveFile,
                        "the curve has more than {most} points: thin it",
                        most = MAX_POINTS
                    ))
                } else {
                    Ok(Next::Point)
                }
            }
            other => Ok(other),
        }
    }

    /// The function of that number, or the only one.
    fn choose(&mut self, asked: Option<&str>) -> Result<Found, Error> {
        let known = || {
            let shown = |f: &Found| format!("{} (\"{}\")", shown(&f.id), shown(&f.title));
            self.functions.iter().take(LISTED).map(shown).collect::<Vec<_>>().join(", ")
        };
        let at = match (asked, self.functions.len()) {
            (_, 0) => {
                let found = "none in this file (of a run's files the starter, _0000.rad, has them)";
                return Err(error!(
                    CurveFile,
                    "expected {expected}, found {found}",
                    expected = "a /FUNCT"
                ));
            }
            (None, 1) => 0,
            (None, _) => {
                return Err(error!(
                    CurveFile,
                    "the file holds several curves: choose one with --curve: {known}",
                    known = known()
                ));
            }
            (Some(asked), _) => {
                let by_id = self.functions.iter().position(|f| f.id == asked.trim());
                by_id.ok_or_else(|| {
                    let asked = shown(asked);
                    let known = known();
                    error!(
                        CurveFile,
                        "the file has no curve \"{asked}\": it has {known}{}",
                        guess::hint(&asked, &known)
                    )
                })?
            }
        };
        Ok(self.functions.swap_remove(at))
    }
}

/// The units of the input in `/BEGIN`: mass, length and time.
fn begin_units(line: &str) -> Option<UnitSystem> {
    let fields = Fields::of(line, 0, WIDTH);
    let [mass, length, time] = [0, 1, 2].map(|k| fields.text(k).trim());
    let named =
        || UnitSystem::parse(&format!("{length}-{mass}-{}", time.replace("mus", "us"))).ok();
    let sized = || {
        let above_zero = |text| number(text).filter(|size| *size > 0.0);
        let (mass_kg, length_m) = (above_zero(mass)?, above_zero(length)?);
        Some(UnitSystem { length_m, mass_kg, time_s: above_zero(time)? })
    };
    named().or_else(sized)
}
