//! OpenRadioss time history `T01`: binary records framed as Fortran writes them.
//!
//! Its groups are returned as the equivalent sections of LS-DYNA: nodes as `nodout`,
//! rigid walls as `rwforc`, contact interfaces as `rcforc`, cross sections as `secforc` (never
//! seen in a file), rigid bodies as `rbdout`, springs as `deforc`, parts as `matsum`, global variables as
//! `glstat`; other groups have their own sections (`variables`). T01 stores the *impulse* of walls, contacts,
//! sections and rigid bodies; the forces here are its central difference over time (one-sided at both
//! ends), means over two output intervals.
//!
//! All states of a T01 have one length, so a damaged state is skipped and the next one is found. The file has no
//! checksums. A restart continues in `T02`, with the impulses of `T01`: both are one record.

pub(crate) mod starter;
mod states;
mod variables;

use std::io::{self, BufRead, Read};
use std::sync::Arc;

use super::problem::{Problem, ProblemCode};
use super::source::{Source, Stream, unpadded};
use super::{Format, Selection, SolverFile};
use crate::history::{EntityId, History};
use states::StateReader;
use variables::{PART, SUBSET};

/// Global variables in their order, named as in `glstat` where it has them.
const GLOBAL_COMPONENTS: [&str; 22] = [
    "internal_energy",
    "kinetic_energy",
    "x_momentum",
    "y_momentum",
    "z_momentum",
    "mass",
    "time_step",
    "rotational_energy",
    "external_work",
    "spring_and_damper_energy",
    "sliding_interface_energy",
    "hourglass_energy",
    "elastic_contact_energy",
    "frictional_contact_energy",
    "damping_contact_energy",
    "plastic_work",
    "added_mass",
    "added_mass_percentage",
    "inlet_mass",
    "outlet_mass",
    "inlet_energy",
    "outlet_energy",
];
pub(crate) const FORMAT: Format = Format::binary("t01", recognises, read, |_, _| Ok(None));

/// Whether a file begins like a T01: a record of a code and a title of 80 characters.
fn recognises(head: &[u8]) -> bool {
    let Some(words) = head.get(..8) else { return false };
    let code = i32::from_be_bytes([words[4], words[5], words[6], words[7]]);
    words[..4] == 84i32.to_be_bytes() && (1_000..100_000).contains(&code)
}

/// Reads the selected histories of every section, or of the one selected.
fn read(parts: &[Box<dyn Source>], selection: &Selection) -> io::Result<Vec<SolverFile>> {
    let Some((first, restarts)) = parts.split_first() else { return Ok(Vec::new()) };
    let mut records = Records::new(Stream::new(&**first));
    let Some(header) = Header::read(&mut records)? else {
        let message = format!("the header is damaged or cut at byte {}", records.position());
        let file = SolverFile {
            problems: vec![Problem::new(ProblemCode::CutRecord, message)],
            ..empty(selection.section.as_deref().unwrap_or("glstat"))
        };
        return Ok(vec![file]);
    };
    let mut states = StateReader::new(&header, selection);
    states.read(&header, &mut records)?;
    for part in restarts {
        let mut records = Records::new(Stream::new(&**part));
        let own = Header::read(&mut records)?;
        if !states.read_restart(&header, own, &mut records)? {
            break;
        }
    }
    Ok(states.finish(&header, selection))
}

fn history(
    entity: Option<EntityId>,
    component: &str,
    values: Vec<f64>,
    time: &Arc<[f64]>,
) -> History {
    History { entity, component: component.into(), time: time.clone(), values }
}

fn empty(section: &str) -> SolverFile {
    SolverFile { format: "t01", section: section.into(), ..SolverFile::default() }
}

const DIFFERENTIATED: &str = "forces are the central difference of T01's impulses, a mean over two output intervals; at both ends over one, so the last force changes when the record continues";

/// A record of the header is at most this long; a state's may be as long as the file.
const MAX_HEADER_RECORD: usize = 1 << 20;
/// Objects or variables of one group; bounds what a damaged count can ask for.
const MAX_COUNT: i32 = 50_000_000;

/// Records: 4-byte length, that many bytes, the same length again, all big-endian.
pub(crate) struct Records<'a> {
    input: Stream<'a>,
}

impl<'a> Records<'a> {
    pub(crate) fn new(input: Stream<'a>) -> Self {
        Self { input }
    }

    pub(crate) fn position(&self) -> u64 {
        self.input.position()
    }

    /// Goes on at `position`; false if there is nothing.
    pub(crate) fn go_to(&mut self, position: u64) -> io::Result<bool> {
        self.input.go_to(position);
        Ok(!self.input.fill_buf()?.is_empty())
    }

    fn length(&mut self) -> io::Result<Option<usize>> {
        let mut word = [0; 4];
        match self.input.read_exact(&mut word) {
            Ok(()) => Ok(usize::try_from(i32::from_be_bytes(word)).ok()),
            Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => Ok(None),
            Err(e) => Err(e),
        }
    }

    /// The next record, or `None` where there is none, or none that is whole.
    pub(crate) fn next(&mut self) -> io::Result<Option<Vec<u8>>> {
        let Some(length) = self.length()? else { return Ok(None) };
        let mut bytes = Vec::new();
        self.input.by_ref().take(length as u64).read_to_end(&mut bytes)?;
        if bytes.len() < length || self.length()? != Some(length) {
            return Ok(None);
        }
        Ok(Some(bytes))
    }

    fn header(&mut self) -> Result<Vec<u8>, Stop> {
        self.next()?.filter(|r| r.len() <= MAX_HEADER_RECORD).ok_or(Stop::Damaged)
    }

    /// Passes over records of the header.
    fn skip(&mut self, count: usize) -> Result<(), Stop> {
        (0..count).try_for_each(|_| self.header().map(drop))
    }
}

/// Why a header ends before its end.
enum Stop {
    Io(io::Error),
    /// It is cut or makes no sense.
    Damaged,
}

impl From<io::Error> for Stop {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

/// Bytes of the length before and after each record.
pub(crate) const FRAME: u64 = 4;

/// A group of histories: objects with the same variables.
pub(crate) struct Group {
    pub kind: i32,
    pub objects: Vec<(i64, Option<String>)>,
    pub codes: Vec<i32>,
    /// Where its values are in a state: the record, and the first of them in it.
    pub record: usize,
    pub start: usize,
}

#[derive(Default)]
pub(crate) struct Header {
    pub title: Option<String>,
    pub solver: Option<String>,
    pub globals: usize,
    /// Those of the file, then parts and subsets.
    pub groups: Vec<Group>,
    /// Lengths of a state's records in bytes: time, globals, parts, subsets, groups.
    pub lengths: Vec<usize>,
}

fn integers(record: &[u8]) -> Vec<i32> {
    record.chunks_exact(4).map(|w| i32::from_be_bytes([w[0], w[1], w[2], w[3]])).collect()
}

/// A count that a sane file can have.
fn count(value: Option<&i32>) -> Result<usize, Stop> {
    value.filter(|v| (0..=MAX_COUNT).contains(*v)).map(|&v| v as usize).ok_or(Stop::Damaged)
}

impl Header {
    /// `None` if the header is cut or makes no sense.
    pub(crate) fn read(records: &mut Records<'_>) -> io::Result<Option<Self>> {
        match Self::read_all(records) {
            Ok(header) => Ok(Some(header)),
            Err(Stop::Damaged) => Ok(None),
            Err(Stop::Io(error)) => Err(error),
        }
    }

    fn read_all(records: &mut Records<'_>) -> Result<Self, Stop> {
        let first = records.header()?;
        let title_length = match first_integer(&first)? {
            ..3041 => 40,
            3041..4021 => 80,
            _ => 100,
        };
        let solver = records.header()?;
        if first_integer(&first)? > 3050 {
            let extra = records.header()?;
            records.skip(count(integers(&extra).first()).unwrap_or(0))?;
        }
        let counts = integers(&records.header()?);
        let size = |k: usize| count(counts.get(k));
        let (parts, materials, properties) = (size(0)?, size(1)?, size(2)?);
        let (subsets, groups, globals) = (size(3)?, size(4)?, size(5)?);
        records.skip(usize::from(globals > 0))?;
        let of_parts = parts_of(records, parts, title_length)?;
        records.skip(materials + properties)?;
        let of_subsets = subsets_of(records, subsets)?;
        let mut header = Self {
            title: unpadded(first.get(4..).unwrap_or_default()),
            solver: unpadded(&solver),
            globals,
            groups: Vec::new(),
            lengths: vec![4],
        };
        if globals > 0 {
            header.lengths.push(4 * globals);
        }
        let mut of_model = Vec::new();
        for kind in [of_parts, of_subsets] {
            let words: usize = kind.iter().map(|group| group.codes.len()).sum();
            let record = header.lengths.len();
            header.lengths.extend((words > 0).then_some(4 * words));
            let mut start = 0;
            for group in kind {
                let words = group.codes.len();
                of_model.push(Group { record, start, ..group });
                start += words;
            }
        }
        for _ in 0..groups {
            let group = Group::read(records)?;
            let record = header.lengths.len();
            header.lengths.push(4 * group.objects.len() * group.codes.len());
            header.groups.push(Group { record, ..group });
        }
        header.groups.extend(of_model);
        Ok(header)
    }

    /// Whether a state has the same values of the same objects as one below the other header.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        self.lengths == other.lengths
            && self.groups.iter().zip(&other.groups).all(|(a, b)| {
                let ids = |group: &Group| group.objects.iter().map(|o| o.0).collect::<Vec<_>>();
                a.kind == b.kind && a.codes == b.codes && ids(a) == ids(b)
            })
    }
}

/// The integer that a record begins with.
fn first_integer(record: &[u8]) -> Result<i32, Stop> {
    integers(record.get(..4).unwrap_or_default()).first().copied().ok_or(Stop::Damaged)
}

/// The parts that have values.
fn parts_of(
    records: &mut Records<'_>,
    parts: usize,
    title_length: usize,
) -> Result<Vec<Group>, Stop> {
    let mut found = Vec::new();
    for _ in 0..parts {
        // Id, title, four integers: the last is the number of history variables.
        let part = records.header()?;
        let tail = integers(part.get(4 + title_length..).unwrap_or_default());
        let variables = count(tail.get(3))?;
        let title = part.get(4..4 + title_length).unwrap_or_default();
        if variables > 0 {
            let codes = records.header()?;
            found.push(Group::of_one(PART, &part, title, &codes, variables)?);
        }
    }
    Ok(found)
}

/// The subsets that have values.
fn subsets_of(records: &mut Records<'_>, subsets: usize) -> Result<Vec<Group>, Stop> {
    let mut found = Vec::new();
    for _ in 0..subsets {
        // Id, parent, number of child subsets, of parts, of variables, title.
        let subset = records.header()?;
        let head = integers(subset.get(..20).unwrap_or_default());
        for k in 2..5 {
            let number = count(head.get(k))?;
            if number == 0 {
                continue;
            }
            let codes = records.next()?.ok_or(Stop::Damaged)?;
            if k == 4 {
                let title = subset.get(20..).unwrap_or_default();
                found.push(Group::of_one(SUBSET, &subset, title, &codes, number)?);
            }
        }
    }
    Ok(found)
}

impl Group {
    fn new(
        kind: i32,
        objects: Vec<(i64, Option<String>)>,
        codes: &[u8],
        variables: usize,
    ) -> Result<Self, Stop> {
        let group = Self { kind, objects, codes: integers(codes), record: 0, start: 0 };
        if group.codes.len() == variables { Ok(group) } else { Err(Stop::Damaged) }
    }

    /// A part or a subset, whose record begins with its id.
    fn of_one(
        kind: i32,
        record: &[u8],
        title: &[u8],
        codes: &[u8],
        variables: usize,
    ) -> Result<Self, Stop> {
        let id = i64::from(first_integer(record)?);
        Self::new(kind, vec![(id, unpadded(title))], codes, variables)
    }

    fn read(records: &mut Records<'_>) -> Result<Self, Stop> {
        // Id, type, one integer, number of objects, number of variables, title.
        let head = records.header()?;
        let head = integers(head.get(..20).unwrap_or_default());
        let kind = *head.get(1).ok_or(Stop::Damaged)?;
        let (objects, variables) = (count(head.get(3))?, count(head.get(4))?);
        let mut named = Vec::new();
        for _ in 0..objects {
            let object = records.header()?;
            named.push((i64::from(first_integer(&object)?), unpadded(&object[4..])));
        }
        let codes = match variables {
            0 => Vec::new(),
            _ => records.next()?.ok_or(Stop::Damaged)?,
        };
        Self::new(kind, named, &codes, variables)
    }

    /// Where the value of a variable of its `object`-th object is in a state: the record, and the place in it.
    pub(crate) fn place(&self, object: usize, code: i32) -> Option<(usize, usize)> {
        let at = self.codes.iter().position(|&c| c == code)?;
        Some((self.record, self.start + object * self.codes.len() + at))
    }
}
