//! Errors as one document for programs: a code for each kind, the message, its causes and its place.

use std::error::Error;
use std::io;

use serde::Serialize;

use crate::error::{self, ErrorCode, Place};

/// Exit code of a command that did its work.
pub(crate) const DONE: u8 = 0;
/// Exit code of a command that could not do its work, or only part of it.
pub(crate) const FAILED: u8 = 1;
/// Exit code for arguments that make no sense or do not fit together.
pub(crate) const USAGE: u8 = 2;
/// Exit code of a command that did its work, but with damage or warnings, under `--strict`.
pub(crate) const DONE_WITH_WARNINGS: u8 = 3;

/// The exit codes with their meanings, as docs/error-codes.md has them.
pub const EXIT_CODES: [(u8, &str); 4] = [
    (DONE, "done"),
    (FAILED, "failed: nothing was done, or only part of it; standard error says which"),
    (USAGE, "the arguments are invalid, or do not fit each other or the file"),
    (DONE_WITH_WARNINGS, "done, but with damage or warnings, and `--strict` was given"),
];

/// What `--json` prints on standard output when a command fails.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct ErrorDocument {
    /// The error.
    pub(crate) error: ErrorReport,
}

/// One error.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct ErrorReport {
    /// Its kind; a code never changes its meaning.
    pub code: ErrorCode,
    /// What standard error would have shown, without the excerpt.
    pub message: String,
    /// Causes that the message does not contain itself, the nearest first.
    pub causes: Vec<String>,
    /// File that is wrong, where one is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Line in the file, counted from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<usize>,
    /// Column in the line, in characters counted from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub column: Option<usize>,
    /// What may have been meant, such as `did you mean "x"?`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hint: Option<String>,
}

/// The error as a type, also where it is boxed.
fn of<'e, T: Error + 'static>(error: &'e (dyn Error + 'static)) -> Option<&'e T> {
    error.downcast_ref::<T>().or_else(|| Some(&**error.downcast_ref::<Box<T>>()?))
}

/// The codes of error types, those that are in others after these.
fn own_code(error: &(dyn Error + 'static)) -> Option<ErrorCode> {
    let io = || of::<io::Error>(error).map(|_| ErrorCode::Io);
    of::<error::Error>(error).map(error::Error::code).or_else(io)
}

/// The error and its causes, the outermost first.
fn chain<'e>(error: &'e (dyn Error + 'static)) -> impl Iterator<Item = &'e (dyn Error + 'static)> {
    std::iter::successors(Some(error), |error| (*error).source())
}

/// Code of an error: that of the innermost cause whose kind is known.
pub(crate) fn code(error: &(dyn Error + 'static)) -> ErrorCode {
    chain(error).filter_map(own_code).last().unwrap_or(ErrorCode::Other)
}

/// The place in a TOML file that an error is about.
pub(crate) fn place<'e>(error: &'e (dyn Error + 'static)) -> Option<&'e Place> {
    chain(error).find_map(|error| of::<error::Error>(error).and_then(error::Error::place))
}

/// The causes of an error that the messages above them do not contain, the nearest first.
pub(crate) fn causes(error: &(dyn Error + 'static)) -> Vec<String> {
    let mut shown = error.to_string();
    let mut causes = Vec::new();
    for cause in chain(error).skip(1) {
        let text = cause.to_string();
        if !shown.contains(&text) {
            causes.push(text.clone());
        }
        shown = text;
    }
    causes
}

impl ErrorDocument {
    /// The document of an error.
    pub(crate) fn new(error: &(dyn Error + 'static)) -> Self {
        let message = error.to_string();
        let place = place(error);
        let error = ErrorReport {
            code: code(error),
            hint: hint(&message),
            message,
            causes: causes(error),
            file: place.map(|place| place.path().display().to_string()),
            line: place.and_then(Place::line),
            column: place.and_then(Place::column),
        };
        Self { error }
    }
}

/// The document that `--json` prints for an error, as JSON.
pub fn error_json(error: &(dyn Error + 'static)) -> String {
    serde_json::to_string(&ErrorDocument::new(error)).unwrap_or_default()
}

/// The question of a message, as `guess` puts it, or the tip for a wrong command line.
fn hint(message: &str) -> Option<String> {
    if let Some((_, tip)) = message.split_once("tip: ") {
        return tip.split("; ").next().map(String::from);
    }
    let begin = message.find("did you mean ")?;
    let end = begin + message[begin..].find('?')? + 1;
    Some(message[begin..end].into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn the_innermost_known_kind_gives_the_code() {
        let study = crate::study::parse(Path::new("s.toml"), "[study]\ngrop = 1\n").unwrap_err();
        let document = ErrorDocument::new(&study).error;
        assert_eq!(document.code, ErrorCode::Toml);
        assert_eq!((document.file.as_deref(), document.line), (Some("s.toml"), Some(2)));
        assert_eq!(document.hint.as_deref(), Some("did you mean \"group\"?"));
        let missing = crate::scenario::load(Path::new("/none/s.toml")).unwrap_err();
        assert_eq!(code(&missing), ErrorCode::Io);
        assert_eq!(code(&Box::new(missing)), ErrorCode::Io, "also where it is boxed");
        assert_eq!(code(&std::fmt::Error), ErrorCode::Other);
    }
}
