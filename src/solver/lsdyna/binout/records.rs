//! Where the records of a family of containers are: the walk that notes them, and their bytes as text, integers or reals.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::io;
use std::ops::Range;
use std::sync::Arc;

use crate::solver::lsdyna::lsda::{self, Event, Header, Kind, Payload, change_directory};
use crate::solver::problem::{Diagnostics, Place, Problem, ProblemCode};
use crate::solver::source::{Source, fill_at};

/// Metadata that names the owners of values.
pub(super) const LISTS: [&str; 4] = ["ids", "side", "force_ids", "moment_ids"];
/// Components kept of one section; real ones have at most about forty.
const MAX_COMPONENTS: usize = 2_000;
/// Sections of one run, and records of all of them; more are damage, and would fill the
/// memory.
const MAX_SECTIONS: usize = 1_000;
const MAX_RECORDS: usize = 20_000_000;

#[derive(Clone, Copy)]
pub(super) struct DataRecord {
    pub part: usize,
    pub payload: Payload,
}

/// All sections of the family of containers.
#[derive(Default)]
pub(super) struct Tree {
    /// By part; `None` where a part is not a container.
    pub headers: Vec<Option<Header>>,
    pub sections: Vec<Section>,
    /// Directories that hold data but no states, and how many records of each.
    pub others: BTreeMap<String, usize>,
    index: HashMap<String, usize>,
    records: usize,
    is_full: bool,
    pub problems: Diagnostics,
}

#[derive(Default)]
pub(super) struct Section {
    pub name: String,
    pub metadata: HashMap<String, DataRecord>,
    /// Lists of ids and sides, each for the states written after it.
    pub lists: Vec<(&'static str, DataRecord)>,
    /// Directory numbers of the states, in order of appearance.
    pub states: Vec<u64>,
    pub state_index: HashMap<u64, usize>,
    /// States that damage was found in.
    pub damaged: HashSet<usize>,
    /// Records that were there before, and the first state of which.
    pub repeated: usize,
    pub first_repeated: Option<u64>,
    /// Records of components beyond those that are kept.
    pub left_out: usize,
    pub components: Vec<Component>,
    pub component_index: HashMap<String, usize>,
}

pub(super) struct Component {
    pub name: Arc<str>,
    pub records: HashMap<usize, DataRecord>,
}

impl Tree {
    pub(crate) fn walk(&mut self, part: usize, source: &dyn Source) -> io::Result<()> {
        let header = lsda::header(source)?;
        self.headers.push(header);
        let Some(header) = header else {
            let message = "this is not an LSDA container, or its header is cut";
            self.problems.add(
                ProblemCode::CutRecord,
                Some(Place::in_part(part, 0)),
                message.into(),
            );
            return Ok(());
        };
        let mut path: Vec<String> = Vec::new();
        let mut here = None;
        lsda::walk(source, header, |event| match event {
            Event::Directory(to) => {
                change_directory(&mut path, to);
                here = self.place(&path);
            }
            Event::Data { name, payload } => {
                self.records += 1;
                if self.records == MAX_RECORDS {
                    let message = "there are too many records; those that follow are left out";
                    self.problems.add(ProblemCode::UnreadRows, None, message.into());
                }
                let is_within = self.records < MAX_RECORDS;
                if let Some((section, state)) = here.filter(|_| is_within) {
                    self.sections[section].note(name, state, DataRecord { part, payload });
                } else if is_within {
                    self.note_other(&path);
                }
            }
            Event::Damage { at, resumed, message } => {
                let rest = match resumed {
                    Some(byte) => format!("reading continues at byte {byte}"),
                    None => "what follows is left out".into(),
                };
                let message = format!("damaged record: {message}; {rest}");
                self.damage(here, ProblemCode::BadRecord, Place::in_part(part, at), message);
            }
            Event::Cut { at } => {
                let message = format!(
                    "the file ends within the record at byte {at}; the records before it are read"
                );
                self.damage(here, ProblemCode::CutRecord, Place::in_part(part, at), message);
            }
        })
    }

    fn damage(
        &mut self,
        here: Option<(usize, Option<usize>)>,
        code: ProblemCode,
        place: Place,
        message: String,
    ) {
        if let Some((section, Some(state))) = here {
            self.sections[section].damaged.insert(state);
        }
        self.problems.add(code, Some(place), message);
    }

    /// Notes data in a directory that is not a state. Directories below a state are part of it.
    fn note_other(&mut self, path: &[String]) {
        let is_state = |name: &String| name == "metadata" || state_number(name).is_some();
        let name = path.join("/");
        let is_new = !self.others.contains_key(&name);
        if path.is_empty()
            || path.iter().any(is_state)
            || is_new && self.others.len() == MAX_SECTIONS
        {
            return;
        }
        *self.others.entry(name).or_default() += 1;
    }

    /// The section and state a path names; `None` for what is not a result of a binout.
    /// Directories below states hold no results.
    fn place(&mut self, path: &[String]) -> Option<(usize, Option<usize>)> {
        let (last, section) = path.split_last()?;
        section.first()?;
        let number = state_number(last);
        if number.is_none() && last != "metadata" {
            return None;
        }
        let name = section.join("/");
        let index = match self.index.get(&name) {
            Some(&index) => index,
            None if self.sections.len() == MAX_SECTIONS => {
                if !self.is_full {
                    let message = format!(
                        "{name} and what follows are left out: there are too many sections"
                    );
                    self.problems.add(ProblemCode::UnreadRows, None, message);
                }
                self.is_full = true;
                return None;
            }
            None => {
                self.sections.push(Section { name: name.clone(), ..Section::default() });
                self.index.insert(name, self.sections.len() - 1);
                self.sections.len() - 1
            }
        };
        Some((index, number.map(|number| self.sections[index].state(number))))
    }
}

/// The number of a state's directory: `d` and digits, padded or not.
fn state_number(name: &str) -> Option<u64> {
    let digits = name.strip_prefix('d')?;
    digits.bytes().all(|b| b.is_ascii_digit()).then(|| digits.parse().ok()).flatten()
}

impl Section {
    fn state(&mut self, number: u64) -> usize {
        *self.state_index.entry(number).or_insert_with(|| {
            self.states.push(number);
            self.states.len() - 1
        })
    }

    fn note(&mut self, name: &str, state: Option<usize>, place: DataRecord) {
        let Some(state) = state else {
            if let Some(list) = LISTS.into_iter().find(|list| *list == name) {
                self.lists.push((list, place));
            }
            self.metadata.insert(name.into(), place);
            return;
        };
        let index = match self.component_index.get(name) {
            Some(&index) => index,
            None if self.components.len() < MAX_COMPONENTS => {
                self.components.push(Component { name: name.into(), records: HashMap::new() });
                self.component_index.insert(name.into(), self.components.len() - 1);
                self.components.len() - 1
            }
            None => {
                self.left_out += 1;
                return;
            }
        };
        let again = self.components[index].records.insert(state, place).is_some();
        // Within one state a record may be there twice; after later states it is a restart.
        if again && state + 1 < self.states.len() {
            self.repeated += 1;
            self.first_repeated.get_or_insert(self.states[state]);
        }
    }

    /// Whether an id can only be one that was overwritten with zeros: LS-DYNA counts from 1,
    /// but prints a part 0 for lumped masses.
    pub(crate) fn is_lost(&self, id: i64) -> bool {
        id == 0 && self.name != "matsum"
    }

    pub(crate) fn component(&self, name: &str) -> Option<&Component> {
        self.component_index.get(name).map(|&index| &self.components[index])
    }

    pub(crate) fn time_of(&self, state: usize) -> Option<&DataRecord> {
        self.component("time")?.records.get(&state)
    }

    pub(crate) fn problem(&self, code: ProblemCode, message: &str) -> Problem {
        Problem::new(code, format!("{}: {message}", self.name))
    }
}

impl DataRecord {
    /// Order of writing.
    pub(crate) fn order(&self) -> (usize, u64) {
        (self.part, self.payload.at)
    }

    pub(crate) fn width(&self) -> usize {
        let size = self.payload.kind.size().unwrap_or(1) as u64;
        usize::try_from(self.payload.bytes / size).unwrap_or(usize::MAX)
    }
}

impl Component {
    pub(crate) fn is_real(&self) -> bool {
        self.first().is_some_and(|p| p.payload.kind.is_real())
    }

    /// The record that was written first.
    pub(crate) fn first(&self) -> Option<&DataRecord> {
        self.records.values().min_by_key(|record| record.order())
    }
}

/// Largest text of titles that is read, and ids of one list; real ones are far shorter. A
/// longer list fits no values, which are then reported as left out.
const MAX_METADATA: u64 = 256 << 20;
const MAX_IDS: u64 = 4_000_000;

/// Reads noted records from the parts of a family.
#[derive(Clone, Copy)]
pub(super) struct Bytes<'a> {
    parts: &'a [Box<dyn Source>],
    headers: &'a [Option<Header>],
}

/// Space for the bytes of one read, used again by the next.
pub(super) type Scratch = Vec<u8>;

impl<'a> Bytes<'a> {
    pub(crate) fn new(parts: &'a [Box<dyn Source>], headers: &'a [Option<Header>]) -> Self {
        Self { parts, headers }
    }

    /// Kind and bytes of a record, up to the bound of texts.
    fn whole(&self, place: DataRecord) -> io::Result<(Kind, Header, Vec<u8>)> {
        let header = self.headers[place.part].ok_or(io::ErrorKind::InvalidData)?;
        let length = place.payload.bytes.min(MAX_METADATA) as usize;
        let mut bytes = vec![0; length];
        let read = fill_at(&*self.parts[place.part], place.payload.at, &mut bytes)?;
        bytes.truncate(read);
        Ok((place.payload.kind, header, bytes))
    }

    pub(crate) fn text(&self, place: DataRecord) -> io::Result<Vec<u8>> {
        self.whole(place).map(|(_, _, bytes)| bytes)
    }

    pub(crate) fn integers(&self, mut place: DataRecord) -> io::Result<Vec<i64>> {
        let size = place.payload.kind.size().unwrap_or(1) as u64;
        place.payload.bytes = place.payload.bytes.min(MAX_IDS * size);
        let (kind, header, bytes) = self.whole(place)?;
        Ok(kind.integers(header, &bytes))
    }

    pub(crate) fn first_real(&self, place: DataRecord) -> io::Result<Option<f64>> {
        let (kind, header, bytes) = self.whole(place)?;
        let mut values = Vec::new();
        kind.reals(header, &bytes, &mut values);
        Ok(values.first().copied())
    }

    /// Appends some values of a record to `out`.
    pub(crate) fn reals(
        &self,
        place: DataRecord,
        range: Range<usize>,
        scratch: &mut Scratch,
        out: &mut Vec<f64>,
    ) -> io::Result<()> {
        let (kind, header) = (place.payload.kind, self.headers[place.part]);
        let (Some(size), Some(header)) = (kind.size(), header) else { return Ok(()) };
        let source = &*self.parts[place.part];
        let at = place.payload.at + (range.start * size) as u64;
        let length = range.len() * size;
        if let Some(all) = source.bytes() {
            let from = usize::try_from(at).unwrap_or(usize::MAX);
            let there = all.get(from..from.saturating_add(length)).unwrap_or_default();
            kind.reals(header, there, out);
        } else {
            scratch.resize(length, 0);
            let read = fill_at(source, at, scratch)?;
            kind.reals(header, &scratch[..read], out);
        }
        Ok(())
    }
}
