//! Reads a deck card by card.

use std::cell::Cell;
use std::io::{self, BufRead, Read};
use std::rc::Rc;

use super::super::line::{Line, Lines, shown};
use super::card::{Card, Field, text};
use super::includes::MAX_INCLUDES;
use super::keyword::{Format, Keyword};
use super::kind::{Kind, kind};
use super::parameters::{NoNumber, Parameters};
use super::units;
use super::{At, Deck, Interface, Scope};
use crate::solver::problem::{Place, Problem, ProblemCode, Problems};

/// Bytes of damaged text shown in a message.
const MAX_SHOWN: usize = 80;
/// Bytes read of a deck and its includes, each as often as it is included; real ones have a
/// tenth of it.
const MAX_BYTES: u64 = 4_000_000_000;
/// Entries kept of each list.
pub(super) const MAX_ENTRIES: usize = 100_000;

pub(super) type Open<'a> = dyn FnMut(&str) -> Option<Box<dyn BufRead>> + 'a;

pub(super) fn read(source: &mut dyn BufRead, open: &mut Open<'_>) -> io::Result<Deck> {
    let mut reader = Reader {
        left: Rc::new(Cell::new(MAX_BYTES)),
        deck: Deck::default(),
        problems: Problems::default(),
        parameters: Parameters::default(),
        open,
        folders: Vec::new(),
        reading: Vec::new(),
        units_differ: false,
        full: Vec::new(),
    };
    reader.file(source, Format::Standard)?;
    Ok(reader.finish())
}

/// A keyword and what its cards said so far.
pub(super) struct Block {
    pub kind: Kind,
    pub keyword: Keyword,
    pub place: Place,
    pub format: Format,
    /// Cards read, or cards of the definition that is being read when a keyword has many.
    pub cards: usize,
    /// Numbers that a later card of the definition needs.
    pub ids: [Option<i64>; 3],
    /// Text that a later card of the definition needs.
    pub text: Option<String>,
}

pub(super) struct Reader<'a, 'o> {
    /// Bytes that may still be read.
    left: Rc<Cell<u64>>,
    pub deck: Deck,
    pub problems: Problems,
    pub parameters: Parameters,
    pub open: &'a mut Open<'o>,
    /// Of `*INCLUDE_PATH`.
    pub folders: Vec<String>,
    /// Files that are being read, outermost first: index in the deck's includes, and the
    /// name they were opened by.
    pub reading: Vec<(usize, String)>,
    /// Whether two statements of units differ.
    pub units_differ: bool,
    /// Lists that had to leave entries out.
    pub full: Vec<&'static str>,
}

/// A file of the deck, read as long as the whole deck keeps within its bound.
struct Bounded<'a> {
    source: &'a mut dyn BufRead,
    left: Rc<Cell<u64>>,
}

impl Read for Bounded<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let there = self.fill_buf()?;
        let count = there.len().min(out.len());
        out[..count].copy_from_slice(&there[..count]);
        self.consume(count);
        Ok(count)
    }
}

impl BufRead for Bounded<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.left.get() == 0 {
            let message = format!(
                "a deck is read up to {} GB with its includes; it has more",
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

/// A field without a number, which a problem says.
pub(super) struct Missing;

impl Reader<'_, '_> {
    pub(super) fn file(
        &mut self,
        source: &mut dyn BufRead,
        mut deck_format: Format,
    ) -> io::Result<()> {
        let mut lines = Lines::new(Bounded { source, left: self.left.clone() });
        let mut block: Option<Block> = None;
        while let Some(line) = lines.next_line()? {
            match line.text.first() {
                Some(b'$') => self.comment(&line),
                Some(b'*') => {
                    self.end(block.take());
                    let Some(keyword) = Keyword::parse(line.text) else {
                        let found = format!("expected a keyword, found \"{}\"", start(line.text));
                        self.problem(ProblemCode::BadLine, (&line).into(), None, found);
                        continue;
                    };
                    if keyword.name == "END" {
                        return Ok(());
                    }
                    deck_format = keyword.deck_format().unwrap_or(deck_format);
                    block = self.begin(keyword, &line, deck_format);
                }
                _ => {
                    if let Some(block) = &mut block {
                        self.card(block, &line);
                    }
                }
            }
        }
        self.end(block);
        Ok(())
    }

    fn comment(&mut self, line: &Line<'_>) {
        if let Some(stated) = units::in_comment(line.text) {
            self.units(stated, line.into(), false);
        }
    }

    fn begin(&mut self, keyword: Keyword, line: &Line<'_>, deck: Format) -> Option<Block> {
        let kind = kind(&keyword);
        let place: Place = line.into();
        let at = self.at(place);
        match kind {
            Kind::Skipped => return None,
            Kind::Unread(what) => {
                let message = format!("*{}: {what} are not read", keyword.name);
                self.problem(ProblemCode::UnreadRows, place, None, message);
                return None;
            }
            Kind::UnreadVelocity => {
                let message = format!("*{}: its velocities are not read", keyword.name);
                self.problem(ProblemCode::UnreadRows, place, None, message);
                self.velocity(&keyword.name, at, Scope::Unknown, None, true);
                return None;
            }
            Kind::Contact | Kind::Wall if !has_id_card(&keyword.name) => {
                self.interface(kind, keyword.name, at, None, None);
                return None;
            }
            _ => {}
        }
        let format = keyword.format.unwrap_or(deck);
        Some(Block { kind, keyword, place, format, cards: 0, ids: [None; 3], text: None })
    }

    fn card(&mut self, block: &mut Block, line: &Line<'_>) {
        if line.overlong {
            let message = "expected a card, found a line beyond 4096 bytes; its rest is left out";
            self.problem(ProblemCode::BadLine, line.into(), None, message.into());
        }
        let card = Card::new(line, block.format);
        let first = block.cards == 0;
        block.cards += 1;
        match block.kind {
            Kind::Title if first && self.deck.title.is_none() => self.deck.title = text(card.text),
            Kind::ControlUnits if first => self.units(units::on_card(&card), card.place, true),
            Kind::VelocityOfSet => self.velocity_of_set(block, &card),
            Kind::VelocityOfNodes => self.velocity_of_id(block, &card, Scope::Node),
            Kind::VelocityOfRigidBodies => self.velocity_of_id(block, &card, Scope::Part),
            Kind::VelocityGeneration => self.velocity_generation(block, &card),
            Kind::InertiaBody { part, velocity } => {
                if block.cards == part + 1 {
                    block.ids[0] = self.integer(&card, 0).unwrap_or(None);
                } else if block.cards == velocity + 1 {
                    self.velocity_of_inertia(block, &card);
                }
            }
            Kind::Output(file) if first => self.output(file, block, &card),
            Kind::HistoryNodes | Kind::HistoryNodeSets => {
                for k in 0..card.fields().count().min(8) {
                    self.history(block.kind, &card, k);
                }
            }
            Kind::HistoryNodesLocal | Kind::HistoryNodeSetsLocal => {
                self.history(block.kind, &card, 0);
            }
            Kind::HistoryNodesWithHeadings => self.history_with_heading(&card),
            Kind::Contact | Kind::Wall if first => {
                let (field, title) = card.id_and_text();
                let id = self.integer_of(field, card.place).unwrap_or(None);
                let name = block.keyword.name.clone();
                self.interface(block.kind, name, self.at(block.place), id, title);
            }
            Kind::Parts { .. } | Kind::OnePart => self.part(block, &card),
            Kind::Parameters => self.parameters(&card),
            Kind::Expressions => self.expression(&card),
            Kind::Include | Kind::IncludePath => self.file_name(block, &card),
            _ => {}
        }
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
        self.problem(ProblemCode::BadLine, block.place, None, message);
    }

    pub(super) fn real(&mut self, card: &Card<'_>, k: usize) -> Result<Option<f64>, Missing> {
        self.real_of(card.field(k), card.place)
    }

    pub(super) fn integer(&mut self, card: &Card<'_>, k: usize) -> Result<Option<i64>, Missing> {
        self.integer_of(card.field(k), card.place)
    }

    pub(super) fn real_of(
        &mut self,
        field: Field<'_>,
        place: Place,
    ) -> Result<Option<f64>, Missing> {
        let number = self.parameters.real(field);
        self.named(number, field, place)
    }

    pub(super) fn integer_of(
        &mut self,
        field: Field<'_>,
        place: Place,
    ) -> Result<Option<i64>, Missing> {
        let number = self.parameters.integer(field);
        self.named(number, field, place)
    }

    fn named<T>(
        &mut self,
        number: Result<T, NoNumber>,
        field: Field<'_>,
        place: Place,
    ) -> Result<T, Missing> {
        number.map_err(|e| {
            if let NoNumber::Bad(message) = e {
                self.problem(ProblemCode::BadField, place, Some(field.columns), message);
            }
            Missing
        })
    }

    pub(super) fn required_id(&mut self, card: &Card<'_>, k: usize) -> Option<i64> {
        self.required_id_of(card.field(k), card.place)
    }

    pub(super) fn required_id_of(&mut self, field: Field<'_>, place: Place) -> Option<i64> {
        match self.integer_of(field, place) {
            Ok(Some(id)) => Some(id),
            Ok(None) => {
                let message = "expected an id, found blanks".into();
                self.problem(ProblemCode::BadField, place, Some(field.columns), message);
                None
            }
            Err(Missing) => None,
        }
    }

    pub(super) fn at(&self, place: Place) -> At {
        At { line: place.line, include: self.reading.last().map(|&(index, _)| index) }
    }

    pub(super) fn problem(
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
        self.problems.add(code, Some(place), columns, message);
    }

    fn finish(mut self) -> Deck {
        let contact_kind = |keyword: &str| {
            let counted = !keyword.starts_with("CONTACT_2D") && !keyword.contains("RIGID_SURFACE");
            counted.then_some("3D")
        };
        number_in_order(&mut self.deck.contacts, contact_kind);
        number_in_order(&mut self.deck.rigid_walls, |keyword| {
            Some(if keyword.starts_with("RIGIDWALL_PLANAR") { "planar" } else { "geometric" })
        });
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

/// Without ids the solver counts. How it counts through a mixture of kinds is not
/// documented, so a mixture stays without.
fn number_in_order(list: &mut [Interface], kind: impl Fn(&str) -> Option<&'static str>) {
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

/// Enough of a line to know it again.
pub(super) fn start(line: &[u8]) -> String {
    shown(line.get(..MAX_SHOWN).unwrap_or(line))
}

pub(super) fn keep<T>(
    list: &mut Vec<T>,
    entry: T,
    what: &'static str,
    full: &mut Vec<&'static str>,
) {
    if list.len() < MAX_ENTRIES {
        list.push(entry);
    } else {
        note_full(what, full);
    }
}

pub(super) fn note_full(what: &'static str, full: &mut Vec<&'static str>) {
    if !full.contains(&what) {
        full.push(what);
    }
}
