//! TOML files written by users: parsing, with errors that name file, line and column and show the line.

use std::path::Path;

use serde::de::DeserializeOwned;

use crate::error::{Error, Place, error};
use crate::file;
use crate::guess;

/// Manifests have a few kilobytes; anything beyond this is another kind of file.
const MAX_BYTES: u64 = 16 << 20;

/// Reads and parses the TOML file at `path`.
pub(crate) fn load<T: DeserializeOwned>(path: &Path) -> Result<T, Error> {
    parse(path, &read_text(path)?)
}

/// Reads the text of the TOML file at `path`.
pub(crate) fn read_text(path: &Path) -> Result<String, Error> {
    file::read_text(path, MAX_BYTES).map_err(|source| Error::io(path, source))
}

/// Parses TOML text; `path` is for messages.
pub(crate) fn parse<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T, Error> {
    toml::from_str(text).map_err(|error| {
        let message = in_words(error.message().trim().replace('\n', "; "));
        // What the file lacks as a whole is shown at its first line.
        let place = match error.span().filter(|span| span.len() < text.len()) {
            Some(span) => Place::new(path, text, span),
            None => Place::new(path, text, 0..0),
        };
        // As a proposal marks what it could not determine.
        let is_to_fill_in = message.starts_with("missing field") && text.contains("# fill in");
        let hint = if is_to_fill_in { ": fill in the lines marked \"fill in\"" } else { "" };
        let guess = of_another_kind(text, &message).unwrap_or_else(|| guess_of(&message));
        let message = format!("{message}{guess}{hint}");
        error!(Toml, "{message}").placed(|_| place)
    })
}

/// What a text is, and what takes it, if the keys or signs that the parser does not know are those of another kind of file.
fn of_another_kind(text: &str, message: &str) -> Option<String> {
    let unknown = message.strip_prefix("unknown field `").and_then(|rest| rest.split('`').next());
    let has = |head: &str| text.lines().any(|line| line.trim_start().starts_with(head));
    let (is_study, is_scenario) = (has("[study]"), has("[[train]]") || has("train ="));
    let what = match unknown {
        Some("study" | "recipe") if is_study && !is_scenario => {
            "a study, which crumple build takes"
        }
        Some("curves" | "train" | "wall" | "contact") if is_scenario && !is_study => {
            "a scenario, which crumple simulate takes"
        }
        None if ["{\"", "{\n", "{\r"].iter().any(|head| text.trim_start().starts_with(head)) => {
            "JSON, as of models and curves, which crumple predict, export and plot take"
        }
        _ => return None,
    };
    Some(format!(": this is {what}"))
}

/// The message of a value of another type in the words of TOML: the parser names types of the program.
fn in_words(message: String) -> String {
    let Some((found, expected)) =
        message.strip_prefix("invalid type: ").and_then(|both| both.split_once(", expected "))
    else {
        return message;
    };
    let expected = match expected {
        "a sequence" => "a list",
        "a map" => "a table",
        other if other.starts_with("struct ") => "a table",
        "usize" | "u8" | "u16" | "u32" | "u64" | "i32" | "i64" => "a whole number",
        "f32" | "f64" => "a number",
        other => other,
    };
    let found = match found {
        "map" => "a table".into(),
        "sequence" => "a list".into(),
        other => other.replace('`', ""),
    };
    format!("expected {expected}, found {found}")
}

/// The guess for a key or word of which the parser says that it is unknown, and what it expected:
/// the first name between backticks is the unknown one.
fn guess_of(message: &str) -> String {
    if !message.starts_with("unknown ") {
        return String::new();
    }
    let mut names = message.split('`').skip(1).step_by(2);
    let Some(unknown) = names.next() else { return String::new() };
    guess::hint(unknown, &names.collect::<Vec<_>>().join(", "))
}
