//! The bytes of noted records, as text, integers or reals.

use std::io;
use std::ops::Range;

use super::super::lsda::{Header, Kind};
use super::records::DataRecord;
use crate::solver::source::{Source, fill_at};

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
