//! `*INCLUDE` and `*INCLUDE_PATH`.

use std::io::BufRead;

use super::card::Card;
use super::contents::Include;
use super::context::{Block, Context, MAX_INCLUDES};
use super::keyword::Kind;
use crate::solver::lsdyna::line::shown;
use crate::solver::problem::{Place, ProblemCode};

const MAX_DEPTH: usize = 16;
/// The manual allows 236 characters; file systems allow more.
const MAX_FILE_NAME: usize = 1024;

/// Gives the bytes of an included file by its name.
pub(super) type Open<'a> = dyn FnMut(&str) -> Option<Box<dyn BufRead>> + 'a;

pub(super) struct Includes<'a, 'o> {
    open: &'a mut Open<'o>,
    /// Of `*INCLUDE_PATH`.
    folders: Vec<String>,
}

pub(super) struct Included {
    pub source: Box<dyn BufRead>,
    pub name: String,
    pub place: Place,
    /// Width of fields where it is included, with which it begins.
    pub width: usize,
}

impl<'a, 'o> Includes<'a, 'o> {
    pub(crate) fn new(open: &'a mut Open<'o>) -> Self {
        Self { open, folders: Vec::new() }
    }

    /// One name per card; " +" at the end of a card says that the name goes on below. `Some`
    /// for a file that is to be read before the next card.
    pub(crate) fn file_name(
        &mut self,
        context: &mut Context,
        block: &mut Block,
        card: &Card<'_>,
    ) -> Option<Included> {
        let line = card.text.trim_ascii();
        if line.is_empty() {
            return None;
        }
        let (part, goes_on) = match line.strip_suffix(b" +") {
            Some(part) => (part.trim_ascii_end(), true),
            None => (line, false),
        };
        let mut name = block.text.take().unwrap_or_default();
        name.push_str(&shown(part));
        if name.len() > MAX_FILE_NAME {
            let message = format!("expected a file name, found more than {MAX_FILE_NAME} bytes");
            context.problem(ProblemCode::BadLine, card.place, None, message);
        } else if goes_on {
            block.text = Some(name);
        } else if block.kind == Kind::Include {
            return self.include(context, name, card.place, block.width);
        } else if self.folders.len() < MAX_INCLUDES {
            self.folders.push(name.trim_end_matches(['/', '\\']).to_string());
        } else {
            context.note_full("include folders");
        }
        None
    }

    fn include(
        &mut self,
        context: &mut Context,
        name: String,
        place: Place,
        width: usize,
    ) -> Option<Included> {
        let index = context.deck.includes.len();
        if index >= MAX_INCLUDES {
            context.note_full("includes");
            return None;
        }
        let too_deep = context.reading.len() >= MAX_DEPTH;
        let opened = if too_deep { None } else { self.find(&name) };
        let (at, found) = (context.at(place), opened.is_some());
        context.deck.includes.push(Include { name: name.clone(), at, found });
        let problem = match opened {
            Some((path, _)) if context.reading.iter().any(|(_, open)| *open == path) => {
                format!("include \"{name}\" includes itself; it is not read again")
            }
            Some((path, source)) => {
                context.reading.push((index, path));
                return Some(Included { source, name, place, width });
            }
            None if too_deep => {
                format!("include \"{name}\" is more than {MAX_DEPTH} files deep; it is left out")
            }
            None => format!("include \"{name}\" is not there"),
        };
        context.problem(ProblemCode::UnreadRows, place, None, problem);
        None
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
