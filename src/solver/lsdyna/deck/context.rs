//! State of reading a deck: its contents so far, its parameters, the
//! files that are open, and its problems.

use std::collections::HashMap;

use serde::Serialize;

use super::keyword::{Field, Keyword, Kind, start};
use super::{Deck, DeckPlace};
use crate::solver::lsdyna::line;
use crate::solver::problem::{Diagnostics, Place, Problem, ProblemCode};

/// Entries kept of each list.
pub(super) const MAX_ENTRIES: usize = 100_000;
/// Includes read or tried; folders tried.
pub(super) const MAX_INCLUDES: usize = 1000;

pub(super) struct Block {
    pub kind: Kind,
    pub keyword: Keyword,
    pub place: Place,
    pub width: usize,
    /// Cards read, or cards of the definition that is being read when a keyword has many.
    pub cards: usize,
    /// Numbers that a later card of the definition needs.
    pub ids: [Option<i64>; 3],
    /// Text that a later card of the definition needs.
    pub text: Option<String>,
}

/// A field without a number, which a problem says.
pub(super) struct Missing;

#[derive(Default)]
pub(super) struct Context {
    pub deck: Deck,
    pub problems: Diagnostics,
    pub parameters: Parameters,
    /// Included files that are being read, outermost first: index in the deck's includes, and
    /// the name they were opened by.
    pub reading: Vec<(usize, String)>,
    /// Whether two statements of units differ.
    pub units_differ: bool,
    /// Names of the lists that had to leave out entries.
    full: Vec<&'static str>,
}

impl Context {
    pub(crate) fn real(&mut self, field: Field<'_>) -> Result<Option<f64>, Missing> {
        let number = self.parameters.real(field);
        self.found(number, field)
    }

    pub(crate) fn integer(&mut self, field: Field<'_>) -> Result<Option<i64>, Missing> {
        let number = self.parameters.integer(field);
        self.found(number, field)
    }

    fn found<T>(&mut self, number: Result<T, NoNumber>, field: Field<'_>) -> Result<T, Missing> {
        number.map_err(|message| {
            if let Some(message) = message {
                self.bad_field(field, message);
            }
            Missing
        })
    }

    pub(crate) fn bad_field(&mut self, field: Field<'_>, message: String) {
        self.problem(ProblemCode::BadField, field.place, Some(field.columns), message);
    }

    pub(crate) fn required_id(&mut self, field: Field<'_>) -> Option<i64> {
        let id = self.integer(field).ok()?;
        if id.is_none() {
            self.bad_field(field, "expected an id, found blanks".into());
        }
        id
    }

    pub(crate) fn at(&self, place: Place) -> DeckPlace {
        DeckPlace { line: place.line, include: self.reading.last().map(|&(index, _)| index) }
    }

    pub(crate) fn problem(
        &mut self,
        code: ProblemCode,
        place: Place,
        columns: Option<[usize; 2]>,
        message: String,
    ) {
        let message = match self.reading.last() {
            Some((_, path)) => format!("{message} (in \"{path}\")"),
            None => message,
        };
        // A field beyond the end of its card has no columns.
        let columns = columns.filter(|c| c[0] > 0);
        self.problems.add_in_columns(code, Some(place), columns, message);
    }

    /// Notes that a list had to leave out entries.
    pub(crate) fn note_full(&mut self, what: &'static str) {
        if !self.full.contains(&what) {
            self.full.push(what);
        }
    }

    /// Adds an entry to one of the deck's lists, which `list` picks, up to its bound.
    pub(crate) fn keep<T>(
        &mut self,
        list: impl FnOnce(&mut Deck) -> &mut Vec<T>,
        entry: T,
        what: &'static str,
    ) {
        let list = list(&mut self.deck);
        if list.len() < MAX_ENTRIES {
            list.push(entry);
        } else {
            self.note_full(what);
        }
    }

    pub(crate) fn finish(mut self) -> Deck {
        self.deck.parameters = self.parameters.list;
        self.deck.problems = self.problems.into_list();
        // Added last, so that a deck full of damage cannot push them out.
        self.deck.problems.extend(self.full.into_iter().map(left_out));
        self.deck
    }
}

fn left_out(what: &'static str) -> Problem {
    let limit = if what.starts_with("include") { MAX_INCLUDES } else { MAX_ENTRIES };
    let message = format!("{what} beyond the first {limit} are left out");
    Problem::new(ProblemCode::UnreadRows, message)
}

/// A parameter's value.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Value {
    /// Of type R.
    Real(f64),
    /// Of type I.
    Integer(i64),
    /// Of type C.
    Text(String),
    /// Given by an expression, defined twice with different values, or not readable; a
    /// problem says which.
    Unknown,
}

/// Why a field has no number: what was expected and found; `None` if it names a parameter of which a
/// problem already says that its value is not known.
pub(super) type NoNumber = Option<String>;

/// Parameters in order of definition.
#[derive(Default)]
pub(super) struct Parameters {
    pub list: Vec<(String, Value)>,
    /// Place in the list by name; never iterated.
    places: HashMap<String, usize>,
}

/// What defining a parameter came to.
#[derive(Debug, PartialEq)]
pub(super) enum Defined {
    Kept,
    /// It was there with another value. Which of them holds depends on
    /// `*PARAMETER_DUPLICATION` and on the release, so neither is kept.
    Contradicts,
    Full,
}

impl Parameters {
    /// `name` in lower case.
    pub(crate) fn define(&mut self, name: String, value: Value, limit: usize) -> Defined {
        if let Some((_, known)) = self.places.get(&name).and_then(|&k| self.list.get_mut(k)) {
            if *known == value {
                return Defined::Kept;
            }
            *known = Value::Unknown;
            return Defined::Contradicts;
        }
        if self.list.len() == limit {
            return Defined::Full;
        }
        self.places.insert(name.clone(), self.list.len());
        self.list.push((name, value));
        Defined::Kept
    }

    pub(crate) fn real(&self, field: Field<'_>) -> Result<Option<f64>, NoNumber> {
        let number = match self.named(field)? {
            Some((_, Value::Text(_))) => None,
            Some((_, Value::Unknown)) => return Err(None),
            Some((sign, Value::Real(value))) => Some(sign as f64 * value),
            Some((sign, Value::Integer(value))) => Some(sign as f64 * *value as f64),
            None if field.text.is_empty() => return Ok(None),
            None => line::free_real(field.text).number(),
        };
        number.map(Some).ok_or_else(|| bad("a real number", field))
    }

    pub(crate) fn integer(&self, field: Field<'_>) -> Result<Option<i64>, NoNumber> {
        let number = match self.named(field)? {
            Some((_, Value::Text(_) | Value::Real(_))) => None,
            Some((_, Value::Unknown)) => return Err(None),
            Some((sign, Value::Integer(value))) => value.checked_mul(sign),
            None if field.text.is_empty() => return Ok(None),
            None => line::integer(field.text),
        };
        number.map(Some).ok_or_else(|| bad("an integer", field))
    }

    /// Sign and value of the parameter that the field names as `&name` or `-&name`.
    fn named(&self, field: Field<'_>) -> Result<Option<(i64, &Value)>, NoNumber> {
        let (sign, text) = match field.text {
            [b'-', text @ ..] => (-1, text.trim_ascii_start()),
            text => (1, text),
        };
        let Some(name) = text.strip_prefix(b"&") else { return Ok(None) };
        let name = start(name.trim_ascii()).to_lowercase();
        match self.places.get(&name).and_then(|&k| self.list.get(k)) {
            Some((_, value)) => Ok(Some((sign, value))),
            None => Err(Some(format!("parameter \"{name}\" is not defined above"))),
        }
    }
}

fn bad(expected: &str, field: Field<'_>) -> NoNumber {
    Some(format!("expected {expected}, found \"{}\"", start(field.text)))
}
