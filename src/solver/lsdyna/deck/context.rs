//! State of reading a deck: its contents so far, its parameters, the
//! files that are open, and its problems.

use super::card::Field;
use super::contents::{Deck, DeckPlace};
use super::keyword::{Keyword, Kind};
use super::parameters::{NoNumber, Parameters};
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

    /// The deck with its parameters and problems.
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
