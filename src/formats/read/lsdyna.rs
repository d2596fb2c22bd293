//! Curve of an LS-DYNA deck: `*DEFINE_CURVE`, with a title or without.
//!
//! Card 1 has eight fields of 10 columns (20 in the long format, `*DEFINE_CURVE+` or `LONG=Y`):
//! LCID, SIDR, SFA, SFO, OFFA, OFFO, DATTYP, LCINT; points have two fields of 20. Lines with a
//! comma are free format. A value is `SFA (abscissa + OFFA)`, likewise the ordinate; a scale factor
//! of 0 means 1. Lines that begin with `$` are comments, also in place of a title.

use super::Input;
use super::columns::{check_curves, choose};
use super::curve::{ReadCurve, expected};
use super::deck::{DeckCurve, Fields, Said, WIDTH};
use super::encoding::lines;
use crate::error::{Error, error};

const REMEDY: &str = " (or in a comment of the file: \"$ units: mm-t-s\")";

pub(super) fn recognise(input: &Input<'_>) -> bool {
    lines(input.beginning()).any(|(_, line)| {
        let line = line.to_ascii_uppercase();
        line.starts_with("*KEYWORD") || line.starts_with("*DEFINE_CURVE")
    })
}

pub(super) fn read(input: &Input<'_>) -> Result<ReadCurve, Error> {
    let mut deck = Deck::read(input.text)?;
    if deck.curves.is_empty() {
        return Err(error!(CurveFile, "expected a *DEFINE_CURVE, found none in this deck"));
    }
    let names = deck.curves.iter().map(|curve| (curve.id.clone(), curve.title.clone()));
    let at = choose(names, input.options.curve.as_deref())?;
    deck.curves.swap_remove(at).columns(input.options.units, REMEDY)
}

/// Factors and offsets of card 1: of abscissas, then of ordinates.
type Scale = [(f64, f64); 2];

/// Kind of the next line of a curve.
#[derive(Clone, Copy, PartialEq)]
enum Next {
    /// Not part of a curve.
    Other,
    Title,
    Card,
    Point,
}

/// The curves of a deck, and the metadata of its comments.
#[derive(Default)]
struct Deck {
    curves: Vec<DeckCurve>,
    said: Said,
    /// Of the last curve.
    scale: Scale,
    /// The last comment between a keyword and its first card: it may have been meant as a title.
    comment_line: Option<u64>,
    is_long: bool,
}

impl Deck {
    fn read(bytes: &str) -> Result<Self, Error> {
        let mut deck = Self::default();
        let (mut next, mut is_long) = (Next::Other, false);
        for (number, line) in lines(bytes) {
            if line.starts_with('$') {
                deck.said.comment(line, number)?;
                if next != Next::Point {
                    deck.comment_line = Some(number);
                }
                continue;
            }
            if line.starts_with('*') {
                (next, is_long) = deck.keyword(line);
                check_curves(deck.curves.len())?;
                continue;
            }
            next = match (next, deck.curves.last_mut()) {
                (Next::Title, _) => {
                    let title = line.trim().into();
                    deck.curves.push(DeckCurve { title, ..DeckCurve::default() });
                    Next::Card
                }
                (Next::Card, _) => {
                    deck.card(line, number, if is_long { WIDTH } else { WIDTH / 2 })?;
                    Next::Point
                }
                (Next::Point, Some(curve)) => {
                    let before = curve.points.len();
                    curve.point(line, number)?;
                    let [(sfa, offa), (sfo, offo)] = deck.scale;
                    for (a, o) in &mut curve.points[before..] {
                        (*a, *o) = (sfa * (*a + offa), sfo * (*o + offo));
                    }
                    Next::Point
                }
                (next, _) => next,
            };
        }
        // A curve whose card never came has no number.
        deck.curves.retain(|curve| !curve.id.is_empty());
        Ok(deck)
    }

    /// What follows a keyword, and whether its cards are long.
    fn keyword(&mut self, line: &str) -> (Next, bool) {
        self.comment_line = None;
        let line = line.trim_end().to_ascii_uppercase();
        if line.starts_with("*KEYWORD") {
            self.is_long = line.contains("LONG=Y");
        }
        let (name, is_long) = match line.strip_suffix('+') {
            Some(name) => (name.trim_end(), true),
            None => (line.as_str(), self.is_long),
        };
        match name {
            "*DEFINE_CURVE" => {
                self.curves.push(DeckCurve::default());
                (Next::Card, is_long)
            }
            "*DEFINE_CURVE_TITLE" => (Next::Title, is_long),
            _ => (Next::Other, false),
        }
    }

    fn card(&mut self, line: &str, number: u64, width: usize) -> Result<(), Error> {
        let comment_line = self.comment_line;
        let Some(curve) = self.curves.last_mut() else { return Ok(()) };
        curve.said = self.said;
        let fields = Fields::of(line, number, width);
        let id = fields.text(0).trim();
        let Some(id) = id.parse::<u64>().ok().filter(|id| *id > 0) else {
            let hint = comment_line.map_or(String::new(), |line| {
                format!(" (line {line} begins with $, which makes it a comment and no title)")
            });
            let what = format_args!("the number of a curve (LCID){hint}");
            return Err(expected(fields.place(0), what, id));
        };
        curve.id = id.to_string();
        curve.notes.push(format!("curve: {id} of the deck"));
        let or_one = |value: f64| if value == 0.0 { 1.0 } else { value };
        let (sfa, sfo) = (or_one(fields.number(2, true)?), or_one(fields.number(3, true)?));
        let (offa, offo) = (fields.number(4, true)?, fields.number(5, true)?);
        self.scale = [(sfa, offa), (sfo, offo)];
        if self.scale != [(1.0, 0.0); 2] {
            curve.notes.push(format!(
                "scale: abscissas times {sfa} after {offa} is added, ordinates times {sfo} after {offo}"
            ));
        }
        Ok(())
    }
}
