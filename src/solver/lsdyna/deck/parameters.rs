//! Parameter values, and numbers in fields that may refer to them.

use std::collections::HashMap;

use serde::Serialize;

use super::super::line;
use super::card::{Field, start};

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
