//! The one error of the library: what is wrong, in words, with its kind and the place where it was found.

mod place;

use std::error::Error as StdError;
use std::fmt;
use std::io;
use std::path::Path;
use std::sync::Arc;

use serde::Serialize;

use crate::guess;
pub(crate) use place::Place;
pub(crate) use place::{Document, KeyPath};

/// Why something could not be done: its text names what is wrong, where, and what to do.
#[derive(Clone)]
pub struct Error(Box<Inner>);

#[derive(Clone)]
struct Inner {
    code: ErrorCode,
    message: String,
    /// Of a TOML document whose text is not at hand where the fault is found.
    key: KeyPath,
    place: Option<Place>,
    /// The text says itself where; the place only shows the line.
    names_place: bool,
    source: Option<Arc<dyn StdError + Send + Sync>>,
}

/// Makes an [`Error`] of a code and a formatted text; with `at KEY` it is about that key of a document.
macro_rules! error {
    ($code:ident at $key:expr, $($text:tt)*) => {
        $crate::error::error!($code, $($text)*).at_key($key)
    };
    ($code:ident, $($text:tt)*) => {
        $crate::error::Error::new($crate::error::ErrorCode::$code, format!($($text)*))
    };
}
pub(crate) use error;

impl Error {
    pub(crate) fn new(code: ErrorCode, message: impl Into<String>) -> Self {
        let message = message.into();
        let key = KeyPath::default();
        Self(Box::new(Inner { code, message, key, place: None, names_place: false, source: None }))
    }

    /// A file that cannot be opened, read or written.
    pub fn io(path: &Path, source: io::Error) -> Self {
        Self::new(ErrorCode::Io, format!("{}: {source}", path.display())).caused_by(source)
    }

    /// The error of a room below, of this kind unless a cause has a kind of its own.
    pub(crate) fn below(code: ErrorCode, source: impl StdError + Send + Sync + 'static) -> Self {
        let (mut code, mut cause) = (code, Some(&source as &(dyn StdError + 'static)));
        while let Some(error) = cause {
            if let Some(error) = error.downcast_ref::<Self>() {
                code = if error.code() == ErrorCode::Other { code } else { error.code() };
            } else if error.is::<io::Error>() {
                code = ErrorCode::Io;
            }
            cause = error.source();
        }
        Self::new(code, source.to_string()).caused_by(source)
    }

    /// Its kind.
    pub fn code(&self) -> ErrorCode {
        self.0.code
    }

    /// The place in a text file that it is about, where one is known.
    pub(crate) fn place(&self) -> Option<&Place> {
        self.0.place.as_ref()
    }

    /// Whether it is about this key.
    pub(crate) fn is_about(&self, keys: &str) -> bool {
        self.0.key == KeyPath::of(keys)
    }

    /// The key or item that it is about.
    pub(crate) fn key(&self) -> &KeyPath {
        &self.0.key
    }

    /// What is wrong, without the place.
    pub(crate) fn message(&self) -> &str {
        &self.0.message
    }

    /// The causes, as the sources of this error.
    pub(crate) fn caused_by(mut self, source: impl StdError + Send + Sync + 'static) -> Self {
        self.0.source = Some(Arc::new(source));
        self
    }

    /// Of this kind, whatever the room that found it took it for, unless a file cannot be read.
    pub(crate) fn coded_as(mut self, code: ErrorCode) -> Self {
        if self.0.code != ErrorCode::Io {
            self.0.code = code;
        }
        self
    }

    /// Of this kind, if the room that found it did not know one.
    pub(crate) fn coded(mut self, code: ErrorCode) -> Self {
        if self.0.code == ErrorCode::Other {
            self.0.code = code;
        }
        self
    }

    /// About keys of the table at hand, with dots between; about the table itself if `keys` is empty.
    pub(crate) fn at_key(self, keys: &str) -> Self {
        if keys.is_empty() { self } else { self.at(KeyPath::of(keys)) }
    }

    /// About a key or item of the document at hand.
    pub(crate) fn at(mut self, key: KeyPath) -> Self {
        self.0.key = key;
        self
    }

    /// About this key if it is about none yet.
    pub(crate) fn or_at_key(self, keys: &str) -> Self {
        if self.0.key == KeyPath::default() { self.at_key(keys) } else { self }
    }

    /// The key is wrong, not its value.
    pub(crate) fn itself(mut self) -> Self {
        self.0.key = std::mem::take(&mut self.0.key).itself();
        self
    }

    /// Lists the names there are, and guesses which of them was meant.
    pub(crate) fn names<'a>(mut self, name: &str, known: impl Iterator<Item = &'a str>) -> Self {
        let known: Vec<&str> = known.collect();
        self.0.message = format!("{} {}", self.0.message, known.join(", "));
        if let Some(guess) = guess::nearest(name, known) {
            self.0.message += &format!("; did you mean \"{}\"?", guess.escape_debug());
        }
        self
    }

    /// The error of a table, seen from the table around it.
    pub(crate) fn inside(mut self, outer: KeyPath) -> Self {
        self.0.key = outer.then(std::mem::take(&mut self.0.key));
        self
    }

    /// Says before the text what it is about.
    pub(crate) fn of(mut self, what: impl fmt::Display) -> Self {
        self.0.message = format!("{what}: {}", self.0.message);
        self
    }

    /// Says after the text what else may matter.
    pub(crate) fn followed_by(mut self, text: &str) -> Self {
        self.0.message += text;
        self
    }

    /// Shows a line of a file with a self-contained text.
    pub(crate) fn showing(mut self, place: Option<Place>) -> Self {
        self.0.place = place;
        self.0.names_place = true;
        self
    }

    /// As [`Error::placed`], for an error that is about a key.
    pub(crate) fn placed_if_keyed(self, place: impl FnOnce(&KeyPath) -> Place) -> Self {
        if self.0.key == KeyPath::default() { self } else { self.placed(place) }
    }

    /// What an error says that was found without knowing the document: at the place of its key.
    pub(crate) fn placed(mut self, place: impl FnOnce(&KeyPath) -> Place) -> Self {
        if self.0.place.is_none() {
            self.0.place = Some(place(&self.0.key));
        }
        self
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(place) = self.0.place.as_ref().filter(|_| !self.0.names_place) {
            write!(f, "{place}: ")?;
        }
        f.write_str(&self.0.message)
    }
}

impl PartialEq for Error {
    fn eq(&self, other: &Self) -> bool {
        self.0.code == other.0.code && self.to_string() == other.to_string()
    }
}

impl fmt::Debug for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}: {self}", self.0.code)
    }
}

/// Lets `?` pass errors of a room below on, with a code of their own.
macro_rules! passes_on {
    ($($error:ty => $code:ident),+ $(,)?) => {$(
        impl From<$error> for $crate::error::Error {
            fn from(error: $error) -> Self {
                Self::below($crate::error::ErrorCode::$code, error)
            }
        }
    )+};
}
pub(crate) use passes_on;

passes_on!(io::Error => Io);

impl StdError for Error {
    fn source(&self) -> Option<&(dyn StdError + 'static)> {
        Some(self.0.source.as_deref()?)
    }
}

/// Kinds of errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum ErrorCode {
    /// The arguments are invalid, or do not fit each other or the file.
    Usage,
    /// A file cannot be opened, read or written.
    Io,
    /// Another process writes the file.
    Locked,
    /// A file is not TOML, or has an unknown key or an impossible value.
    Toml,
    /// A study contradicts itself, or none of its runs can be used.
    Study,
    /// No curve can be extracted from a run of a study.
    Run,
    /// A scenario contradicts itself, or what it names does not fit.
    Scenario,
    /// The plan of a sweep is wrong, or its results belong to another sweep.
    Sweep,
    /// A file is not a curve database, is damaged, or has no such group or case.
    Database,
    /// A solver file cannot be read, or lacks what was selected.
    SolverFile,
    /// A curve file cannot be read.
    CurveFile,
    /// Curves cannot be added to a database.
    Import,
    /// Cases do not form a training set.
    Dataset,
    /// A model cannot be fitted or read.
    Model,
    /// A model cannot predict a curve.
    Prediction,
    /// Models cannot be validated.
    Validation,
    /// Methods cannot be compared.
    Comparison,
    /// A multi-body run fails.
    Simulation,
    /// A file for another tool cannot be written.
    Export,
    /// Signals cannot be rated.
    Rating,
    /// A chart cannot be drawn.
    Plot,
    /// A report cannot be written.
    Report,
    /// Anything else.
    Other,
}
