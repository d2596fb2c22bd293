//! Curve of a Radioss deck: a function `/FUNCT/id`.
//!
//! The keyword is followed by a title and points of two fields of 20 columns; the next keyword ends them. A
//! `/MOVE_FUNCT/id` scales and then shifts the function of that number. Lines that begin with `#` or `$` are
//! comments. Units are those of a comment (`units: mm-t-s`) or of `/BEGIN`, where
//! the fourth line has mass, length and time, by name or by their size in SI.

use super::Input;
use super::columns::{check_curves, choose};
use super::curve::{Place, ReadCurve};
use super::deck::{DeckCurve, Fields, Said, WIDTH};
use super::encoding::{lines, number};
use crate::error::{Error, error};
use crate::unit::UnitSystem;

const REMEDY: &str = " (or in a comment of the file: \"# units: mm-t-s\")";

pub(super) fn recognise(input: &Input<'_>) -> bool {
    let is_comment = |line: &str| line.trim().is_empty() || line.starts_with(['#', '$']);
    let first = lines(input.beginning()).find(|(_, line)| !is_comment(line));
    first.is_some_and(|(_, line)| is_keyword(line))
}

pub(super) fn read(input: &Input<'_>) -> Result<ReadCurve, Error> {
    let mut deck = Deck::read(input.text)?;
    if deck.functions.is_empty() {
        let found = "none in this file (in a run, the starter, _0000.rad, has them)";
        return Err(error!(CurveFile, "expected a /FUNCT, found {found}"));
    }
    let names = deck.functions.iter().map(|f| (f.curve.id.clone(), f.curve.title.clone()));
    let at = choose(names, input.options.curve.as_deref())?;
    let Function { line, keyword, unit, mut curve } = deck.functions.swap_remove(at);
    if keyword != FUNCTION || unit.is_some() {
        return Err(error!(
            CurveFile,
            "{place}: expected /FUNCT/{id} with linear interpolation between its points, in the units of the deck, found /{keyword}/{id}{unit}: write it as such points",
            id = curve.id,
            place = Place::Line(line),
            unit = unit.map(|unit| format!("/{unit}")).unwrap_or_default()
        ));
    }
    curve.notes.push(format!("curve: /FUNCT/{} of the deck", curve.id));
    for Move { line, scale, shift, .. } in deck.moves.iter().filter(|m| m.id == curve.id) {
        for (x, y) in &mut curve.points {
            (*x, *y) = (scale.0 * *x + shift.0, scale.1 * *y + shift.1);
        }
        curve.notes.push(format!(
            "scale: /MOVE_FUNCT of line {line}: abscissas times {} plus {}, ordinates times {} plus {}",
            scale.0, shift.0, scale.1, shift.1
        ));
    }
    curve.columns(input.options.units, REMEDY)
}

/// Whether a line is one of `/NAME/…`.
fn is_keyword(line: &str) -> bool {
    line.strip_prefix('/').is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_uppercase()))
}

/// A function of the deck.
struct Function {
    line: u64,
    /// `FUNCT`, or another that begins so and is not read.
    keyword: String,
    /// Number of units of its own.
    unit: Option<String>,
    curve: DeckCurve,
}

/// Effect of `/MOVE_FUNCT/id` on a function: scaled first, then shifted.
struct Move {
    id: String,
    line: u64,
    scale: (f64, f64),
    shift: (f64, f64),
}

const FUNCTION: &str = "FUNCT";

/// Kind of the next line.
#[derive(Clone, Copy, PartialEq)]
enum Next {
    /// Not part of a function.
    Other,
    Title,
    Point,
    /// So many lines of `/BEGIN` before that of the units.
    Begin(u8),
    /// So many lines of `/MOVE_FUNCT` before that of the factors.
    Move(u8),
}

/// The functions of a deck, and the metadata of its comments.
#[derive(Default)]
struct Deck {
    functions: Vec<Function>,
    moves: Vec<Move>,
    said: Said,
}

impl Deck {
    fn read(text: &str) -> Result<Self, Error> {
        let mut deck = Self::default();
        let mut next = Next::Other;
        for (at, line) in lines(text) {
            if line.starts_with(['#', '$']) {
                deck.said.comment(line, at)?;
            } else if is_keyword(line) {
                next = deck.keyword(line, at);
                check_curves(deck.functions.len().max(deck.moves.len()))?;
            } else {
                next = deck.line(next, line, at)?;
            }
        }
        Ok(deck)
    }

    /// What follows a keyword.
    fn keyword(&mut self, line: &str, at: u64) -> Next {
        let mut parts = line.split('/').skip(1).map(|part| part.trim().to_string());
        let keyword = parts.next().unwrap_or_default();
        let id = parts.next().unwrap_or_default();
        match keyword.as_str() {
            "BEGIN" => Next::Begin(2),
            "MOVE_FUNCT" => {
                self.moves.push(Move { id, line: at, scale: (1.0, 1.0), shift: (0.0, 0.0) });
                Next::Move(1)
            }
            _ if keyword.starts_with(FUNCTION) => {
                let unit = parts.next().filter(|unit| !unit.is_empty() && unit != "0");
                let curve = DeckCurve { id, said: self.said, ..DeckCurve::default() };
                self.functions.push(Function { line: at, keyword, unit, curve });
                Next::Title
            }
            _ => Next::Other,
        }
    }

    /// Takes a line that is neither comment nor keyword; gives what the one after it is.
    fn line(&mut self, next: Next, line: &str, at: u64) -> Result<Next, Error> {
        match (next, self.functions.last_mut(), self.moves.last_mut()) {
            (Next::Begin(0), None, _) => {
                self.said.units = self.said.units.or(begin_units(line).map(|units| (units, at)));
                Ok(Next::Other)
            }
            (Next::Begin(more), ..) => Ok(more.checked_sub(1).map_or(Next::Other, Next::Begin)),
            (Next::Move(0), _, Some(last)) => {
                let fields = Fields::of(line, at, WIDTH);
                let number = |field| fields.number(field, true);
                let or_one = |value: f64| if value == 0.0 { 1.0 } else { value };
                last.scale = (or_one(number(0)?), or_one(number(1)?));
                last.shift = (number(2)?, number(3)?);
                Ok(Next::Other)
            }
            (Next::Move(more), ..) => Ok(more.checked_sub(1).map_or(Next::Other, Next::Move)),
            (Next::Title, Some(function), _) => {
                function.curve.title = line.trim().into();
                Ok(Next::Point)
            }
            (Next::Point, Some(function), _) if function.keyword == FUNCTION => {
                function.curve.point(line, at)?;
                Ok(Next::Point)
            }
            _ => Ok(next),
        }
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
