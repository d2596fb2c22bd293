//! `*INCLUDE` and `*INCLUDE_PATH`.

use std::io::BufRead;

use super::Include;
use super::card::Card;
use super::keyword::Format;
use super::kind::Kind;
use super::reader::{Block, Reader, note_full};
use crate::solver::lsdyna::line::shown;
use crate::solver::problem::{Place, ProblemCode};

/// Includes read or tried; folders tried.
pub(super) const MAX_INCLUDES: usize = 1000;
const MAX_DEPTH: usize = 16;
/// The manual allows 236 characters; file systems allow more.
const MAX_FILE_NAME: usize = 1024;

impl Reader<'_, '_> {
    /// One name per card; " +" at the end of a card says that the name goes on below.
    pub(super) fn file_name(&mut self, block: &mut Block, card: &Card<'_>) {
        let line = card.text.trim_ascii();
        if line.is_empty() {
            return;
        }
        let (part, goes_on) = match line.strip_suffix(b" +") {
            Some(part) => (part.trim_ascii_end(), true),
            None => (line, false),
        };
        let mut name = block.text.take().unwrap_or_default();
        name.push_str(&shown(part));
        if name.len() > MAX_FILE_NAME {
            let message = format!("expected a file name, found more than {MAX_FILE_NAME} bytes");
            self.problem(ProblemCode::BadLine, card.place, None, message);
        } else if goes_on {
            block.text = Some(name);
        } else if block.kind == Kind::Include {
            self.include(name, card.place, block.format);
        } else {
            let folder = name.trim_end_matches(['/', '\\']).to_string();
            if self.folders.len() < MAX_INCLUDES {
                self.folders.push(folder);
            } else {
                note_full("include folders", &mut self.full);
            }
        }
    }

    fn include(&mut self, name: String, place: Place, format: Format) {
        let index = self.deck.includes.len();
        let refused = if index >= MAX_INCLUDES {
            note_full("includes", &mut self.full);
            return;
        } else if self.reading.len() >= MAX_DEPTH {
            Some(format!("include \"{name}\" is more than {MAX_DEPTH} files deep; it is left out"))
        } else {
            None
        };
        let opened = if refused.is_some() { None } else { self.find(&name) };
        let at = self.at(place);
        let found = opened.is_some();
        self.deck.includes.push(Include { name: name.clone(), at, found });
        let problem = match (refused, opened) {
            (Some(refused), _) => refused,
            (None, None) => format!("include \"{name}\" is not there"),
            (None, Some((path, _))) if self.reading.iter().any(|(_, open)| *open == path) => {
                format!("include \"{name}\" includes itself; it is not read again")
            }
            (None, Some((path, mut source))) => {
                self.reading.push((index, path));
                let read = self.file(&mut *source, format);
                self.reading.pop();
                match read {
                    Ok(()) => return,
                    Err(e) => format!("include \"{name}\" cannot be read to its end: {e}"),
                }
            }
        };
        self.problem(ProblemCode::UnreadRows, place, None, problem);
    }

    fn find(&mut self, name: &str) -> Option<(String, Box<dyn BufRead>)> {
        if let Some(source) = (self.open)(name) {
            return Some((name.into(), source));
        }
        self.folders.iter().find_map(|folder| {
            let path = format!("{folder}/{name}");
            (self.open)(&path).map(|source| (path, source))
        })
    }
}
