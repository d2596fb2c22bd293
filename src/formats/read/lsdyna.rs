//! Curve of an LS-DYNA deck: `*DEFINE_CURVE`, with a title or without.
//!
//! Card 1 has eight fields of 10 columns (20 in the long format, `*DEFINE_CURVE+` or `LONG=Y`):
//! LCID, SIDR, SFA, SFO, OFFA, OFFO, DATTYP, LCINT; points have two fields of 20. Lines with a
//! comma are free format. A value is `SFA (abscissa + OFFA)`, likewise the ordinate; a scale factor
//! of 0 means 1. Lines that begin with `$` are comments, also where a title should stand.

use super::Input;
use super::columns::{Columns, Places, check_curves, check_points, choose};
use super::curve::{Place, shown};
use super::curve::{stated_units, title, units};
use super::text::{lines, number};
use crate::error::{Error, error};

const REMEDY: &str = " (or in a comment of the file: \"$ units: mm-t-s\")";

pub(super) fn recognise(input: &Input<'_>) -> bool {
    lines(input.beginning()).any(|(_, line)| {
        let line = line.to_ascii_uppercase();
        line.starts_with("*KEYWORD") || line.starts_with("*DEFINE_CURVE")
    })
}

pub(super) fn read(input: &Input<'_>) -> Result<Columns, Error> {
    let mut deck = Deck::read(input.text)?;
    if deck.curves.is_empty() {
        return Err(error!(CurveFile, "expected a *DEFINE_CURVE, found none in this deck"));
    }
    let names = deck.curves.iter().map(|curve| (curve.id.to_string(), curve.title.clone()));
    let at = choose(names, input.options.curve.as_deref())?;
    let Found { id, title: found, scale, points, lines, facts, units: stated } =
        deck.curves.swap_remove(at);
    let mut notes = vec![format!("curve: {id} of the deck")];
    let system = units(stated, input.options.units, REMEDY, &mut notes)?;
    if scale != Scale::default() {
        notes.push(format!(
            "scale: abscissas times {} after {} is added, ordinates times {} after {}",
            scale.sfa, scale.offa, scale.sfo, scale.offo
        ));
    }
    let (length, force) = (system.length_m, system.force());
    Ok(Columns {
        deflection_m: points.iter().map(|(a, _)| scale.sfa * (a + scale.offa) * length).collect(),
        force_n: points.iter().map(|(_, o)| scale.sfo * (o + scale.offo) * force).collect(),
        facts,
        title: title(&found, &mut notes),
        units: Some(system),
        notes,
        ..Columns::at(Places::Lines(lines))
    })
}

/// Factors and offsets of card 1.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Scale {
    sfa: f64,
    sfo: f64,
    offa: f64,
    offo: f64,
}

impl Default for Scale {
    fn default() -> Self {
        Self { sfa: 1.0, sfo: 1.0, offa: 0.0, offo: 0.0 }
    }
}

/// A curve of the deck, as it is written.
#[derive(Clone, Debug, Default)]
struct Found {
    id: u64,
    title: String,
    scale: Scale,
    points: Vec<(f64, f64)>,
    lines: Vec<u64>,
    /// What the comments in front of its points say.
    facts: super::Metadata,
    units: Option<(crate::unit::UnitSystem, u64)>,
}

/// What the next line of a curve is.
#[derive(Clone, Copy, PartialEq)]
enum Next {
    /// Nothing of a curve.
    Other,
    Title,
    Card,
    Point,
}

/// The curves of a deck, and what its comments say.
#[derive(Default)]
struct Deck {
    curves: Vec<Found>,
    facts: super::Metadata,
    units: Option<(crate::unit::UnitSystem, u64)>,
    /// The last comment between a keyword and its first card: it may have been meant as a title.
    comment_line: Option<u64>,
    is_long: bool,
}

impl Deck {
    fn read(bytes: &str) -> Result<Self, Error> {
        let mut deck = Self::default();
        let (mut next, mut is_long) = (Next::Other, false);
        for (number, line) in lines(bytes) {
            if let Some(comment) = line.strip_prefix('$') {
                deck.comment(comment, number)?;
                if next != Next::Point {
                    deck.comment_line = Some(number);
                }
                continue;
            }
            if line.starts_with('*') {
                (next, is_long) = deck.keyword(&line);
                check_curves(deck.curves.len())?;
                continue;
            }
            next = match next {
                Next::Other => Next::Other,
                Next::Title => {
                    deck.curves.push(Found { title: line.trim().into(), ..Found::default() });
                    Next::Card
                }
                Next::Card => {
                    deck.card(&line, number, if is_long { 20 } else { 10 })?;
                    Next::Point
                }
                Next::Point => {
                    deck.point(&line, number)?;
                    Next::Point
                }
            };
        }
        // A curve whose card never came has no number.
        deck.curves.retain(|curve| curve.id > 0);
        Ok(deck)
    }

    fn comment(&mut self, comment: &str, line: u64) -> Result<(), Error> {
        let comment = comment.trim_start_matches(['$', '#']);
        if let Some(units) = stated_units(comment) {
            self.units = Some((units, line));
        }
        self.facts.take("$", comment, Place::Line(line))
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
                self.curves.push(Found::default());
                (Next::Card, is_long)
            }
            "*DEFINE_CURVE_TITLE" => (Next::Title, is_long),
            _ => (Next::Other, false),
        }
    }

    fn card(&mut self, line: &str, number: u64, width: usize) -> Result<(), Error> {
        let (comment_line, facts, units) = (self.comment_line, self.facts, self.units);
        let Some(curve) = self.curves.last_mut() else { return Ok(()) };
        (curve.facts, curve.units) = (facts, units);
        let fields = Fields::of(line, number, width);
        let id = fields.text(0).trim();
        curve.id = id.parse().ok().filter(|id| *id > 0).ok_or_else(|| {
            let hint = match comment_line {
                Some(line) => {
                    format!(" (line {line} begins with $, which makes it a comment and no title)")
                }
                None => String::new(),
            };
            error!(
                CurveFile,
                "{place}: expected {expected}, found \"{found}\"",
                expected = format!("the number of a curve (LCID){hint}"),
                found = shown(id),
                place = fields.place(0)
            )
        })?;
        let or_one = |value: f64| if value == 0.0 { 1.0 } else { value };
        curve.scale = Scale {
            sfa: or_one(fields.number(2, true)?),
            sfo: or_one(fields.number(3, true)?),
            offa: fields.number(4, true)?,
            offo: fields.number(5, true)?,
        };
        Ok(())
    }

    fn point(&mut self, line: &str, number: u64) -> Result<(), Error> {
        let Some(curve) = self.curves.last_mut() else { return Ok(()) };
        if line.trim().is_empty() {
            return Ok(());
        }
        let fields = Fields::of(line, number, 20);
        curve.points.push((fields.number(0, false)?, fields.number(1, false)?));
        curve.lines.push(number);
        check_points(curve.points.len())
    }
}

/// The fields of a line: between commas, or of one width.
pub(super) struct Fields<'a> {
    line: u64,
    width: usize,
    list: Vec<&'a str>,
    is_free: bool,
}

/// Fields of a line that are looked at: card 1 has eight.
const FIELDS: usize = 8;

impl<'a> Fields<'a> {
    pub(super) fn of(text: &'a str, line: u64, width: usize) -> Self {
        if text.contains(',') {
            let list = text.split(',').take(FIELDS).collect();
            return Self { line, width, list, is_free: true };
        }
        // By characters: a column of a text that is no ASCII may lie within one.
        let at = |k: usize| text.char_indices().nth(k * width).map_or(text.len(), |(at, _)| at);
        let list = (0..FIELDS).map(|k| &text[at(k)..at(k + 1)]).take_while(|f| !f.is_empty());
        Self { line, width, list: list.collect(), is_free: false }
    }

    pub(super) fn text(&self, field: usize) -> &'a str {
        self.list.get(field).copied().unwrap_or_default()
    }

    fn place(&self, field: usize) -> Place {
        if self.is_free {
            Place::Field { line: self.line, field: field + 1 }
        } else {
            Place::Columns {
                line: self.line,
                from: field * self.width + 1,
                to: (field + 1) * self.width,
            }
        }
    }

    /// A number; 0 for an empty field where that may be.
    pub(super) fn number(&self, field: usize, allow_empty_states: bool) -> Result<f64, Error> {
        let text = self.text(field).trim();
        if text.is_empty() && allow_empty_states {
            return Ok(0.0);
        }
        number(text).ok_or_else(|| match text.split_whitespace().count() {
            0 | 1 => error!(
                CurveFile,
                "{place}: expected a number, found \"{found}\"",
                found = shown(text),
                place = self.place(field)
            ),
            _ => error!(
                CurveFile,
                "{place}: expected {expected}, found \"{found}\"",
                expected = format!(
                    "one number in each field of {} columns, or fields with commas between",
                    self.width
                ),
                found = shown(text),
                place = self.place(field)
            ),
        })
    }
}
