//! `*PARAMETER` and `*PARAMETER_EXPRESSION`: cards that define parameters.

use super::super::line::shown;
use super::card::{Card, Field, start, text};
use super::context::{Context, MAX_ENTRIES, Missing};
use super::parameters::{Defined, Value};
use crate::solver::problem::{Place, ProblemCode};

/// Bytes of a name; the manual allows 9.
const MAX_NAME: usize = 80;

impl Context {
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

    /// PRMR1 EXPRESSION1, which continues below where the name is blank. Only one that is
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
            Defined::Full => self.note_full("parameters"),
            Defined::Contradicts => {
                let message = format!(
                    "parameter \"{name}\" has another value above; it is treated as unknown"
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
