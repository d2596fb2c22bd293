//! Reads a deck card by card, with includes in place: `*INCLUDE` and `*INCLUDE_PATH`.

use std::cell::Cell;
use std::io::{self, BufRead, Read};
use std::rc::Rc;

use super::super::line::{Line, Lines};
use super::context::{Block, Context, MAX_INCLUDES};
use super::keyword::{Card, Keyword, Kind, STANDARD, kind, start, text};
use super::{Deck, DeckEntity, DeckInclude, Scope, cards};
use crate::solver::problem::{Place, ProblemCode};
use crate::solver::source::{self, read_buffered};

/// Bytes read of a deck and its includes, each as often as it is included; real ones have a
/// tenth of it.
const MAX_BYTES: u64 = 4_000_000_000;

pub(super) fn read(source: &mut dyn BufRead, open: &mut Open<'_>) -> io::Result<Deck> {
    let left = Rc::new(Cell::new(MAX_BYTES));
    let mut reader = Reader { context: Context::default(), includes: Includes::new(open) };
    let mut files = vec![OpenFile::new(Box::new(source), &left, STANDARD, None)];
    while let Some(file) = files.last_mut() {
        let failed = match reader.read_on(file) {
            Ok(Some(Included { source, name, place, width })) => {
                files.push(OpenFile::new(source, &left, width, Some((name, place))));
                continue;
            }
            Ok(None) => None,
            Err(error) => Some(error),
        };
        let included = files.pop().and_then(|file| file.included);
        reader.context.reading.pop();
        match (failed, included) {
            (None, _) => {}
            (Some(error), None) => return Err(error),
            (Some(error), Some((name, place))) => {
                let message = format!("include \"{name}\" cannot be read to its end: {error}");
                reader.context.problem(ProblemCode::UnreadRows, place, None, message);
            }
        }
    }
    number_interfaces(&mut reader.context.deck);
    Ok(reader.context.finish())
}

struct OpenFile<'a> {
    lines: Lines<SizeLimited<'a>>,
    /// Default width of the fields of its cards.
    width: usize,
    block: Option<Block>,
    /// Its name, and where in the file below on the stack it is included; `None` for the deck
    /// itself.
    included: Option<(String, Place)>,
}

impl<'a> OpenFile<'a> {
    fn new(
        source: Box<dyn BufRead + 'a>,
        left: &Rc<Cell<u64>>,
        width: usize,
        included: Option<(String, Place)>,
    ) -> Self {
        let lines = Lines::new(SizeLimited { source, left: left.clone() });
        Self { lines, width, block: None, included }
    }
}

/// A file of the deck, read as long as the whole deck keeps within its bound.
struct SizeLimited<'a> {
    source: Box<dyn BufRead + 'a>,
    left: Rc<Cell<u64>>,
}

impl Read for SizeLimited<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        read_buffered(self, out)
    }
}

impl BufRead for SizeLimited<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.left.get() == 0 {
            let message = format!(
                "at most {} GB of a deck and its includes are read; this one is larger",
                MAX_BYTES / 1_000_000_000
            );
            return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
        }
        self.source.fill_buf()
    }

    fn consume(&mut self, count: usize) {
        self.left.set(self.left.get().saturating_sub(count as u64));
        self.source.consume(count);
    }
}

struct Reader<'a, 'o> {
    context: Context,
    includes: Includes<'a, 'o>,
}

impl Reader<'_, '_> {
    /// Reads on up to an include that is there; `None` at the end of the file.
    fn read_on(&mut self, file: &mut OpenFile<'_>) -> io::Result<Option<Included>> {
        while let Some(line) = file.lines.next_line()? {
            match line.text.first() {
                Some(b'$') => self.comment(&line),
                Some(b'*') => {
                    self.end(file.block.take());
                    let Some(keyword) = Keyword::parse(line.text) else {
                        let found = format!("expected a keyword, found \"{}\"", start(line.text));
                        self.context.problem(ProblemCode::BadLine, (&line).into(), None, found);
                        continue;
                    };
                    if keyword.name == "END" {
                        return Ok(None);
                    }
                    file.width = keyword.deck_width().unwrap_or(file.width);
                    file.block = self.begin(keyword, &line, file.width);
                }
                _ => {
                    if let Some(block) = &mut file.block
                        && let Some(included) = self.card(block, &line)
                    {
                        return Ok(Some(included));
                    }
                }
            }
        }
        self.end(file.block.take());
        Ok(None)
    }

    fn comment(&mut self, line: &Line<'_>) {
        // Of what units a comment speaks is not always what the deck is in: a system must be named.
        let named = |text: &String| text.trim() == "SI" || cards::system(text).is_some();
        if let Some(stated) = cards::in_comment(line.text).filter(named) {
            self.context.units(stated, line.into(), false);
        }
    }

    fn begin(&mut self, keyword: Keyword, line: &Line<'_>, deck: usize) -> Option<Block> {
        let kind = kind(&keyword);
        let place: Place = line.into();
        let at = self.context.at(place);
        match kind {
            Kind::Skipped => return None,
            Kind::Unread(what) => {
                let message = format!("*{}: {what} are not read", keyword.name);
                self.context.problem(ProblemCode::UnreadRows, place, None, message);
                return None;
            }
            Kind::UnreadVelocity => {
                let message = format!("*{}: its velocities are not read", keyword.name);
                self.context.problem(ProblemCode::UnreadRows, place, None, message);
                self.context.velocity(&keyword.name, at, Scope::Unknown, None, true);
                return None;
            }
            Kind::Contact | Kind::Wall if !has_id_card(&keyword.name) => {
                self.context.interface(kind, keyword.name, at, None, None);
                return None;
            }
            _ => {}
        }
        let width = keyword.width.unwrap_or(deck);
        Some(Block { kind, keyword, place, width, cards: 0, ids: [None; 3], text: None })
    }

    /// Reads a card; `Some` if it includes a file that is there.
    fn card(&mut self, block: &mut Block, line: &Line<'_>) -> Option<Included> {
        if line.overlong {
            let message =
                "expected a card, found a line of more than 4096 bytes; the rest of it is left out";
            self.context.problem(ProblemCode::BadLine, line.into(), None, message.into());
        }
        let card = Card::new(line, block.width);
        let first = block.cards == 0;
        block.cards += 1;
        match block.kind {
            Kind::Title if first && self.context.deck.title.is_none() => {
                self.context.deck.title = text(card.text);
            }
            Kind::ControlUnits if first => {
                self.context.units(cards::on_card(&card), card.place, true);
            }
            Kind::VelocityOfSet => self.context.velocity_of_set(block, &card),
            Kind::VelocityOfNodes => self.context.velocity_of_id(block, &card, Scope::Node),
            Kind::VelocityOfRigidBodies => self.context.velocity_of_id(block, &card, Scope::Part),
            Kind::VelocityGeneration => self.context.velocity_generation(block, &card),
            Kind::InertiaBody { part, velocity } => {
                if block.cards == part + 1 {
                    block.ids[0] = self.context.integer(card.field(0)).unwrap_or(None);
                } else if block.cards == velocity + 1 {
                    self.context.velocity_of_inertia(block, &card);
                }
            }
            Kind::Output(file) if first => self.context.output(file, block, &card),
            Kind::History { sets, on_card } => {
                for k in 0..card.fields().count().min(on_card) {
                    self.context.history(sets, &card, k);
                }
            }
            Kind::HistoryWithHeadings => self.context.history_with_heading(&card),
            Kind::Contact | Kind::Wall if first => {
                let (field, title) = card.id_and_text();
                let id = self.context.integer(field).unwrap_or(None);
                let name = block.keyword.name.clone();
                self.context.interface(block.kind, name, self.context.at(block.place), id, title);
            }
            Kind::Parts { .. } | Kind::OnePart => self.context.part(block, &card),
            Kind::Material { titled } if block.cards == 1 + usize::from(titled) => {
                self.context.material(&card);
            }
            Kind::Parameters => self.context.parameters(&card),
            Kind::Expressions => self.context.expression(&card),
            Kind::Include | Kind::IncludePath => {
                return self.includes.file_name(&mut self.context, block, &card);
            }
            _ => {}
        }
        None
    }

    /// Names what a keyword left open.
    fn end(&mut self, block: Option<Block>) {
        let Some(block) = block else { return };
        let expected = match block.kind {
            Kind::Contact | Kind::Wall if block.cards == 0 => "a card with its id",
            Kind::Output(_) if block.cards == 0 => "a card with its interval",
            Kind::VelocityOfSet if block.cards < 2 => "two cards",
            Kind::InertiaBody { velocity, .. } if block.cards <= velocity => "a card of velocity",
            Kind::Parts { .. } | Kind::OnePart if block.cards == 1 && block.text.is_some() => {
                "a card with the part's id below its title"
            }
            Kind::Include | Kind::IncludePath if block.text.is_some() => "a file name that ends",
            _ => return,
        };
        let message = format!("*{}: expected {expected}, found its end", block.keyword.name);
        self.context.problem(ProblemCode::BadLine, block.place, None, message);
    }
}

/// Gives contacts and walls without ids the numbers that the solver gives them.
fn number_interfaces(deck: &mut Deck) {
    number_in_order(&mut deck.contacts, |keyword| {
        let counted = !keyword.starts_with("CONTACT_2D") && !keyword.contains("RIGID_SURFACE");
        counted.then_some("3D")
    });
    number_in_order(&mut deck.rigid_walls, |keyword| {
        Some(if keyword.starts_with("RIGIDWALL_PLANAR") { "planar" } else { "geometric" })
    });
}

/// Without ids the solver counts. How it counts through a mixture of kinds is not
/// documented, so a mixture stays without.
fn number_in_order(list: &mut [DeckEntity], kind: impl Fn(&str) -> Option<&'static str>) {
    let Some(first) = list.first().and_then(|i| kind(&i.keyword)) else { return };
    if list.iter().all(|i| !has_id_card(&i.keyword) && kind(&i.keyword) == Some(first)) {
        for (id, interface) in (1..).zip(list) {
            interface.id = Some(id);
        }
    }
}

fn has_id_card(keyword: &str) -> bool {
    keyword.split('_').any(|option| option == "ID" || option == "TITLE")
}

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

    /// One name per card; " +" at the end of a card says that the name continues below. `Some`
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
        name.push_str(&source::title(part));
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
        context.deck.includes.push(DeckInclude { name: name.clone(), at, found });
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
            None => format!("include \"{name}\" is missing"),
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
