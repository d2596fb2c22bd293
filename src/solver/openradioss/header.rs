//! Records of a T01, and its header, which lists the histories.

use std::io::{self, BufRead, Read};

use super::variables::{PART, SUBSET};
use crate::solver::source::Stream;

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

    /// Position of the next byte.
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

    fn header(&mut self) -> io::Result<Option<Vec<u8>>> {
        Ok(self.next()?.filter(|r| r.len() <= MAX_HEADER_RECORD))
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

fn text(bytes: &[u8]) -> Option<String> {
    let text = String::from_utf8_lossy(bytes);
    let text = text.trim_matches(|c: char| c.is_whitespace() || c == '\0');
    (!text.is_empty()).then(|| text.to_string())
}

/// A count that a sane file can have.
fn count(value: Option<&i32>) -> Option<usize> {
    value.filter(|v| (0..=MAX_COUNT).contains(*v)).map(|&v| v as usize)
}

impl Header {
    /// `None` if the header is cut or makes no sense.
    pub(crate) fn read(records: &mut Records<'_>) -> io::Result<Option<Self>> {
        let Some(first) = records.header()? else { return Ok(None) };
        let Some(&code) = integers(first.get(..4).unwrap_or_default()).first() else {
            return Ok(None);
        };
        let title_length = match code {
            ..3041 => 40,
            3041..4021 => 80,
            _ => 100,
        };
        let Some(solver) = records.header()? else { return Ok(None) };
        if code > 3050 {
            let Some(extra) = records.header()? else { return Ok(None) };
            if !skip(records, count(integers(&extra).first()).unwrap_or(0))? {
                return Ok(None);
            }
        }
        let Some(counts) = records.header()? else { return Ok(None) };
        let counts = integers(&counts);
        let sizes: Option<Vec<usize>> = (0..6).map(|i| count(counts.get(i))).collect();
        let Some([parts, materials, properties, subsets, groups, globals]) =
            sizes.and_then(|s| <[usize; 6]>::try_from(s).ok())
        else {
            return Ok(None);
        };
        if globals > 0 && !skip(records, 1)? {
            return Ok(None);
        }
        let Some(of_parts) = parts_of(records, parts, title_length)? else { return Ok(None) };
        if !skip(records, materials + properties)? {
            return Ok(None);
        }
        let Some(of_subsets) = subsets_of(records, subsets)? else { return Ok(None) };
        let mut header = Self {
            title: text(first.get(4..).unwrap_or_default()),
            solver: text(&solver),
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
            let Some(group) = Group::read(records)? else { return Ok(None) };
            let record = header.lengths.len();
            header.lengths.push(4 * group.objects.len() * group.codes.len());
            header.groups.push(Group { record, ..group });
        }
        header.groups.extend(of_model);
        Ok(Some(header))
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

/// Passes over records of the header; false if it ends before.
fn skip(records: &mut Records<'_>, count: usize) -> io::Result<bool> {
    for _ in 0..count {
        if records.header()?.is_none() {
            return Ok(false);
        }
    }
    Ok(true)
}

/// The parts that have values.
fn parts_of(
    records: &mut Records<'_>,
    parts: usize,
    title_length: usize,
) -> io::Result<Option<Vec<Group>>> {
    let mut found = Vec::new();
    for _ in 0..parts {
        // Id, title, four integers: the last is the number of history variables.
        let Some(part) = records.header()? else { return Ok(None) };
        let tail = integers(part.get(4 + title_length..).unwrap_or_default());
        let Some(variables) = count(tail.get(3)) else { return Ok(None) };
        let title = part.get(4..4 + title_length).unwrap_or_default();
        if variables > 0 {
            let Some(codes) = records.header()? else { return Ok(None) };
            let Some(group) = Group::of_one(PART, &part, title, &codes, variables) else {
                return Ok(None);
            };
            found.push(group);
        }
    }
    Ok(Some(found))
}

/// The subsets that have values.
fn subsets_of(records: &mut Records<'_>, subsets: usize) -> io::Result<Option<Vec<Group>>> {
    let mut found = Vec::new();
    for _ in 0..subsets {
        // Id, parent, number of child subsets, of parts, of variables, title.
        let Some(subset) = records.header()? else { return Ok(None) };
        let head = integers(subset.get(..20).unwrap_or_default());
        for k in 2..5 {
            let Some(number) = count(head.get(k)) else { return Ok(None) };
            if number == 0 {
                continue;
            }
            let Some(codes) = records.next()? else { return Ok(None) };
            if k == 4 {
                let title = subset.get(20..).unwrap_or_default();
                let Some(group) = Group::of_one(SUBSET, &subset, title, &codes, number) else {
                    return Ok(None);
                };
                found.push(group);
            }
        }
    }
    Ok(Some(found))
}

impl Group {
    /// A part or a subset, whose record begins with its id.
    fn of_one(
        kind: i32,
        record: &[u8],
        title: &[u8],
        codes: &[u8],
        variables: usize,
    ) -> Option<Self> {
        let id = i64::from(*integers(record.get(..4)?).first()?);
        let codes = integers(codes);
        let objects = vec![(id, text(title))];
        (codes.len() == variables).then_some(Self { kind, objects, codes, record: 0, start: 0 })
    }

    pub(crate) fn read(records: &mut Records<'_>) -> io::Result<Option<Self>> {
        // Id, type, one integer, number of objects, number of variables, title.
        let Some(head) = records.header()? else { return Ok(None) };
        let head = integers(head.get(..20).unwrap_or_default());
        let (Some(&kind), Some(objects), Some(variables)) =
            (head.get(1), count(head.get(3)), count(head.get(4)))
        else {
            return Ok(None);
        };
        let mut named = Vec::new();
        for _ in 0..objects {
            let Some(object) = records.header()? else { return Ok(None) };
            let Some(&id) = integers(object.get(..4).unwrap_or_default()).first() else {
                return Ok(None);
            };
            named.push((i64::from(id), text(&object[4..])));
        }
        let codes = match variables {
            0 => Vec::new(),
            _ => match records.next()? {
                Some(codes) => integers(&codes),
                None => return Ok(None),
            },
        };
        if codes.len() == variables {
            Ok(Some(Self { kind, objects: named, codes, record: 0, start: 0 }))
        } else {
            Ok(None)
        }
    }

    /// Where the value of a variable of its `object`-th object is in a state: the record, and the place in it.
    pub(crate) fn place(&self, object: usize, code: i32) -> Option<(usize, usize)> {
        let at = self.codes.iter().position(|&c| c == code)?;
        Some((self.record, self.start + object * self.codes.len() + at))
    }
}
