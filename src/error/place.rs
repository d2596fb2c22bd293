//! Places in a TOML file: found by the keys that an error is about, shown as line and caret.

use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use toml::Spanned;
use toml::de::{DeArray, DeString, DeTable, DeValue};

/// A place in a TOML file, written as `file:line:column`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    path: PathBuf,
    // Boxed, because errors are returned by value everywhere.
    spot: Option<Box<Spot>>,
}

/// Part of a line.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Spot {
    line: usize,
    before: usize,
    /// Its length in characters, 1 or more.
    length: usize,
    /// The whole line.
    text: String,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path().display())?;
        match &self.spot {
            Some(spot) => write!(f, ":{}:{}", spot.line, spot.before + 1),
            None => Ok(()),
        }
    }
}

impl Place {
    /// The place of some bytes of a file's text. Of a part over several lines it is the first one.
    pub(crate) fn new(path: &Path, text: &str, span: Range<usize>) -> Self {
        // After the last line's end there is nothing to show: what is missing is missing there.
        let start = floor(text, span.start.min(text.trim_end().len()));
        let line_start = text[..start].rfind('\n').map_or(0, |at| at + 1);
        let line = text[line_start..].split('\n').next().unwrap_or_default().trim_end();
        let line_end = line_start + line.len();
        let end = floor(text, span.end.clamp(start, line_end.max(start)));
        let spot = Spot {
            line: text[..line_start].matches('\n').count() + 1,
            before: text[line_start..start].chars().count(),
            length: text[start..end].chars().count().max(1),
            text: line.replace('\t', " "),
        };
        Self { path: path.into(), spot: Some(Box::new(spot)) }
    }

    /// A file, no part of which is known to be meant.
    pub(crate) fn of_file(path: &Path) -> Self {
        Self { path: path.into(), spot: None }
    }

    /// The file.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Line in the file, counted from 1.
    pub(crate) fn line(&self) -> Option<usize> {
        self.spot.as_ref().map(|spot| spot.line)
    }

    /// Column in the line, in characters counted from 1.
    pub(crate) fn column(&self) -> Option<usize> {
        self.spot.as_ref().map(|spot| spot.before + 1)
    }

    /// The line with its number, and below it carets under the place: lines of at most `width`
    /// characters (40 or more), for which a longer line is cut on both sides.
    pub(crate) fn excerpt(&self, width: usize) -> Option<String> {
        let spot = self.spot.as_ref()?;
        let number = spot.line.to_string();
        let room = width.max(40) - number.len() - 3;
        let line: Vec<char> = spot.text.chars().collect();
        // A third of the room before the place, and never more than the line needs.
        let first = if line.len() > room {
            spot.before.saturating_sub(room / 3).min(line.len() - room)
        } else {
            0
        };
        let mut shown: Vec<char> = line.iter().skip(first).take(room).copied().collect();
        if first > 0 {
            shown[0] = '…';
        }
        if first + shown.len() < line.len() {
            *shown.last_mut()? = '…';
        }
        let before = spot.before - first;
        let carets = spot.length.min(room.saturating_sub(before)).max(1);
        Some(format!(
            "{blank} |\n{number} | {line}\n{blank} | {space}{carets}",
            blank = " ".repeat(number.len()),
            line = shown.into_iter().collect::<String>(),
            space = " ".repeat(before),
            carets = "^".repeat(carets),
        ))
    }
}

/// The last boundary of a character up to `byte`.
fn floor(text: &str, byte: usize) -> usize {
    (0..=byte.min(text.len())).rev().find(|&at| text.is_char_boundary(at)).unwrap_or(0)
}

/// A TOML file's text and where it stands, kept for the places of errors that only the whole shows.
#[derive(Clone, Debug)]
pub(crate) struct Document {
    path: PathBuf,
    text: Arc<str>,
}

impl Document {
    pub(crate) fn new(path: &Path, text: &str) -> Self {
        Self { path: path.into(), text: text.into() }
    }

    /// The place of a value or key; if the file lacks it, of the table that should have it.
    pub(crate) fn place(&self, wanted: &KeyPath) -> Place {
        let parsed = DeTable::parse(&self.text).ok();
        let span = parsed.and_then(|root| wanted.span(root.get_ref())).unwrap_or(0..0);
        Place::new(&self.path, &self.text, span)
    }
}

/// What an error is about: keys and numbers of list items, from the outermost inwards.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct KeyPath {
    steps: Vec<Step>,
    /// The last key itself is meant, not its value.
    is_key: bool,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Step {
    Key(String),
    Item(usize),
}

impl KeyPath {
    /// Keys of tables within tables, with dots between: `recipe.force.id`.
    pub(crate) fn of(keys: &str) -> Self {
        keys.split('.').fold(Self::default(), KeyPath::key)
    }

    /// A key in the table at this path.
    pub(crate) fn key(mut self, key: &str) -> Self {
        self.steps.push(Step::Key(key.into()));
        self
    }

    /// An item of the list at this path, counted from 0.
    pub(crate) fn item(mut self, item: usize) -> Self {
        self.steps.push(Step::Item(item));
        self
    }

    /// The item if this is a path into a list of that name.
    pub(crate) fn item_of(&self, list: &str) -> Option<usize> {
        match &self.steps[..] {
            [Step::Key(name), Step::Item(item), ..] if name == list => Some(*item),
            _ => None,
        }
    }

    /// Whether its last key is `name`.
    pub(crate) fn ends_with(&self, name: &str) -> bool {
        matches!(self.steps.last(), Some(Step::Key(last)) if last == name)
    }

    /// A path within the value at this one.
    pub(crate) fn then(mut self, inner: Self) -> Self {
        self.steps.extend(inner.steps);
        self.is_key = inner.is_key;
        self
    }

    /// The last key itself instead of its value.
    pub(crate) fn itself(mut self) -> Self {
        self.is_key = true;
        self
    }

    /// Where it stands, or what is left of it.
    fn span(&self, root: &DeTable<'_>) -> Option<Range<usize>> {
        let mut table = Some(root);
        let mut list: Option<&DeArray<'_>> = None;
        let mut found = None;
        for (k, step) in self.steps.iter().enumerate() {
            let is_last = k + 1 == self.steps.len();
            let value: &Spanned<DeValue<'_>> = match step {
                Step::Key(name) => {
                    let entry = table.and_then(|table| entry(table, name));
                    let Some((key, value)) = entry else { break };
                    found = Some(if is_last && self.is_key { key.span() } else { value.span() });
                    value
                }
                Step::Item(at) => {
                    let Some(value) = list.and_then(|list| list.get(*at)) else { break };
                    found = Some(value.span());
                    value
                }
            };
            (table, list) = match value.get_ref() {
                DeValue::Table(table) => (Some(table), None),
                DeValue::Array(items) => (None, Some(items)),
                _ => (None, None),
            };
        }
        found
    }
}

fn entry<'t, 'i>(
    table: &'t DeTable<'i>,
    name: &str,
) -> Option<(&'t Spanned<DeString<'i>>, &'t Spanned<DeValue<'i>>)> {
    table.iter().find(|(key, _)| key.get_ref() == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "title = \"µ\"\n[run]\nduration = \"1s\"   # long\n\n[[train]]\nname = \"A\"\n\
        vehicles = [ { name = \"A1\" }, { name = \"A2\", front.mass = 3 } ]\n[[train]]\nname = \"B\"\n\
        stages = [\n  1,\n  2,\n]\n";

    #[test]
    fn a_path_is_found_where_it_stands() {
        let document = Document::new(Path::new("s.toml"), TEXT);
        let t = |wanted: KeyPath, expected: &str| {
            let place = document.place(&wanted);
            let excerpt = place.excerpt(200).unwrap();
            let (lines, carets) = excerpt.rsplit_once('\n').unwrap();
            let (line, carets) =
                (lines.lines().last().unwrap(), carets.split_once("| ").unwrap().1);
            let line = line.split_once("| ").unwrap().1;
            let marked = line.chars().skip(carets.matches(' ').count());
            let marked: String = marked.take(carets.trim_start().len()).collect();
            let (number, column) = (place.line().unwrap(), place.column().unwrap());
            assert_eq!(format!("{number}:{column} {marked}"), expected, "{wanted:?}");
            assert_eq!(place.to_string(), format!("s.toml:{number}:{column}"));
        };
        let train = || KeyPath::of("train");
        t(KeyPath::of("title"), "1:9 \"µ\"");
        t(KeyPath::of("run"), "2:1 [run]");
        t(KeyPath::of("run.duration"), "3:12 \"1s\"");
        t(KeyPath::of("run.duration").itself(), "3:1 duration");
        t(train(), "5:1 [[train]]");
        t(train().item(1), "8:1 [[train]]");
        t(train().item(1).key("name"), "9:8 \"B\"");
        t(train().item(0).key("vehicles").item(1), "7:31 { name = \"A2\", front.mass = 3 }");
        t(train().item(0).key("vehicles").item(1).key("front").key("mass"), "7:59 3");
        // Of several lines the first.
        t(train().item(1).key("stages"), "10:10 [");
        t(train().item(1).key("stages").item(1), "12:3 2");
        // What is missing: the table that should have it; the whole file's first character.
        t(KeyPath::of("run.step"), "2:1 [run]");
        t(train().item(1).key("speed"), "8:1 [[train]]");
        t(KeyPath::of("wall"), "1:1 t");
        t(train().item(7), "5:1 [[train]]");
    }

    #[test]
    fn long_lines_are_cut_around_the_place() {
        let text = format!("a = \"{}\"\nb = [ {} 7 ]\n", "x".repeat(300), "1, ".repeat(60));
        let document = Document::new(Path::new("s.toml"), &text);
        for (wanted, marked) in [
            (KeyPath::of("a"), '"'),
            (KeyPath::of("b").item(30), '1'),
            (KeyPath::of("b").item(60), '7'),
        ] {
            for width in [0, 40, 60, 80] {
                let excerpt = document.place(&wanted).excerpt(width).unwrap();
                let lines: Vec<Vec<char>> = excerpt.lines().map(|l| l.chars().collect()).collect();
                assert!(lines.iter().all(|line| line.len() <= width.max(40)), "{excerpt}");
                let caret = lines[2].iter().position(|&c| c == '^').unwrap();
                assert_eq!(lines[1][caret], marked, "{excerpt}");
            }
        }
    }

    /// Spans at the ends of any text, also after its last line, show a line.
    #[test]
    fn any_span_has_a_line() {
        for text in ["", "\n", "a", "µ=\n\n", "a = 1\r\nb = 2\r\n"] {
            for start in 0..=text.len() + 1 {
                for end in start..=text.len() + 2 {
                    let place = Place::new(Path::new("x"), text, start..end);
                    let excerpt = place.excerpt(40).unwrap();
                    assert!(excerpt.ends_with('^') && !excerpt.contains('\r'), "{excerpt:?}");
                }
            }
        }
    }
}
