//! `*PARAMETER`: named values, and the numbers of fields that may name them.

use std::collections::HashMap;

use super::super::line::{self, shown};
use super::card::{Card, Field, text};
use super::reader::{MAX_ENTRIES, Missing, Reader, note_full, start};
use crate::solver::problem::{Place, ProblemCode};

/// Bytes of a name; the manual allows 9.
const MAX_NAME: usize = 80;

/// A parameter's value.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    Real(f64),
    Integer(i64),
    Text(String),
    /// Given by an expression, defined twice with different values, or not readable; a
    /// problem says which.
    Unknown,
}

/// Why a field has no number.
#[derive(Debug, PartialEq)]
pub(super) enum NoNumber {
    /// It names a parameter of which a problem already says that its value is not known.
    Unknown,
    /// What was expected and found.
    Bad(String),
}

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
    /// The list is full.
    Full,
}

impl Parameters {
    /// `name` in lower case.
    pub fn define(&mut self, name: String, value: Value, limit: usize) -> Defined {
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

    /// The number of a field; `None` when blank.
    pub fn real(&self, field: Field<'_>) -> Result<Option<f64>, NoNumber> {
        let number = match self.named(field)? {
            Some((_, Value::Text(_))) => None,
            Some((_, Value::Unknown)) => return Err(NoNumber::Unknown),
            Some((sign, Value::Real(value))) => Some(sign as f64 * value),
            Some((sign, Value::Integer(value))) => Some(sign as f64 * *value as f64),
            None if field.text.is_empty() => return Ok(None),
            None => match line::real(field.text) {
                line::Field::Real(value) => Some(value),
                _ => None,
            },
        };
        number.map(Some).ok_or_else(|| bad("a real number", field))
    }

    /// The integer of a field; `None` when blank.
    pub fn integer(&self, field: Field<'_>) -> Result<Option<i64>, NoNumber> {
        let number = match self.named(field)? {
            Some((_, Value::Text(_) | Value::Real(_))) => None,
            Some((_, Value::Unknown)) => return Err(NoNumber::Unknown),
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
            None => Err(NoNumber::Bad(format!("parameter \"{name}\" is not defined above"))),
        }
    }
}

fn bad(expected: &str, field: Field<'_>) -> NoNumber {
    NoNumber::Bad(format!("expected {expected}, found \"{}\"", start(field.text)))
}

impl Reader<'_, '_> {
    /// PRMR1 VAL1 PRMR2 VAL2 …: the first column of a name is its type.
    pub(super) fn parameters(&mut self, card: &Card<'_>) {
        for k in (0..card.fields().count().min(8)).step_by(2) {
            let (field, value) = (card.field(k), card.field(k + 1));
            if field.text.is_empty() && value.text.is_empty() {
                continue;
            }
            let Some((letter, name)) = parameter_name(field.text) else {
                self.bad_parameter_name(field, card.place);
                continue;
            };
            let value = match letter {
                b'C' => Value::Text(text(value.text).unwrap_or_default()),
                b'I' => number(self.integer_of(value, card.place), Value::Integer),
                _ => number(self.real_of(value, card.place), Value::Real),
            };
            self.define(name, value, card.place);
        }
    }

    /// PRMR1 EXPRESSION1, which goes on below where the name is blank. Only one that is
    /// a plain number has a value here.
    pub(super) fn expression(&mut self, card: &Card<'_>) {
        let (field, expression) = card.id_and_text();
        let Some(expression) = expression.filter(|_| !field.text.is_empty()) else { return };
        let Some((letter, name)) = parameter_name(field.text) else {
            self.bad_parameter_name(field, card.place);
            return;
        };
        let plain = Field { text: expression.as_bytes(), columns: [0, 0] };
        let plain = match letter {
            b'I' => self.parameters.integer(plain).ok().flatten().map(Value::Integer),
            b'R' => self.parameters.real(plain).ok().flatten().map(Value::Real),
            _ => None,
        };
        if plain.is_none() {
            let message =
                format!("parameter \"{name}\" is not evaluated: it is the expression {expression}");
            self.problem(ProblemCode::UnreadRows, card.place, None, message);
        }
        self.define(name, plain.unwrap_or(Value::Unknown), card.place);
    }

    fn bad_parameter_name(&mut self, field: Field<'_>, place: Place) {
        let message =
            format!("expected R, I or C and a parameter's name, found \"{}\"", start(field.text));
        self.problem(ProblemCode::BadField, place, Some(field.columns), message);
    }

    fn define(&mut self, name: String, value: Value, place: Place) {
        match self.parameters.define(name.clone(), value, MAX_ENTRIES) {
            Defined::Kept => {}
            Defined::Full => note_full("parameters", &mut self.full),
            Defined::Contradicts => {
                let message = format!(
                    "parameter \"{name}\" has another value above; it is taken as not known"
                );
                self.problem(ProblemCode::BadField, place, None, message);
            }
        }
    }
}

/// Type letter and name of a parameter: `R    tEnd` or `Rname`.
fn parameter_name(text: &[u8]) -> Option<(u8, String)> {
    let (letter, name) = text.split_first()?;
    let letter = letter.to_ascii_uppercase();
    let name = shown(name.trim_ascii()).to_lowercase();
    let well = matches!(letter, b'R' | b'I' | b'C') && (1..=MAX_NAME).contains(&name.len());
    well.then_some((letter, name))
}

fn number<T>(read: Result<Option<T>, Missing>, value: fn(T) -> Value) -> Value {
    read.ok().flatten().map_or(Value::Unknown, value)
}
