//! The layout of a state: which bytes are the same in every state, and which are fields.
//!
//! Most solvers print every state of a file in the same number of bytes, line by line as the one above it. The line
//! reader shows of one state what the parts of its lines are ([`Part`]); a state after it is read by
//! their places if all other bytes are equal and every field is filled like the one that was shown: digits where
//! it has digits, a sign or a blank where it can have a sign. A field may also hold any other whole number. So a
//! state is either read as the line reader would, or left to the line reader.

use std::collections::HashMap;
use std::io;
use std::ops::Range;

use super::e12;
use super::line::{integer, is_whole_real, real};
use crate::order;
use crate::solver::source::Window;
use crate::solver::states::repeat::{Part, Zone};

/// Bytes of a state whose layout is learnt; those of a longer one would take too much memory.
pub(crate) const MAX_STATE: u64 = 32 << 20;
/// Bytes read at once where all lines are read.
pub(crate) const DENSE_READ: usize = 1 << 18;
/// Bytes below which two wanted lines are read together rather than apart.
const PAGE: usize = 4096;
/// Index of no value.
const NOWHERE: u32 = u32::MAX;

/// How a byte may differ from the expected one: not at all, as a digit from `0`, as `-` from a blank, as `-` from
/// `+`, or in any way. (A digit's mark is itself the difference of a digit.)
const SAME: u8 = 0;
const DIGIT: u8 = 5;
const SIGN: u8 = b' ' ^ b'-';
const EXPONENT_SIGN: u8 = b'+' ^ b'-';
const ANY: u8 = 0xff;

/// What a field of a line is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Kind {
    /// `d.dddddE±dd` and `d.ddddE±dd` with their sign at the field's end.
    E12,
    E11,
    Real,
    Integer,
    Time,
    Cycle,
    Unread,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Field {
    from: usize,
    to: usize,
    kind: Kind,
    /// Whether a number may begin at its first byte: it is not known apart by blanks.
    is_fixed: bool,
}

/// What lines have in common.
#[derive(PartialEq, Eq, Hash)]
struct Class {
    /// Whether all fields are of twelve columns that nothing else is in.
    is_of_e12: bool,
    /// Per byte of the line how it may differ.
    free: Vec<u8>,
    fields: Vec<Field>,
}

#[derive(Clone, Copy)]
struct Row {
    /// First byte in the state.
    at: u32,
    class: u32,
    /// Where the indices of its values begin, if any of them is wanted.
    values: u32,
}

/// One state's bytes and their meaning.
pub(crate) struct Layout {
    expected: Vec<u8>,
    /// Per byte how it may differ, unless the state is long.
    free: Vec<u8>,
    classes: Vec<Class>,
    rows: Vec<Row>,
    /// Indices of the values in the output, field by field.
    outs: Vec<u32>,
    /// Bytes after the last line with a field.
    tail: usize,
    /// First byte of the cycle.
    cycle: Option<Range<usize>>,
    /// Index after the line that holds the time.
    head: usize,
}

/// Which lines are read, in reads of neighbours.
pub(crate) struct Plan {
    reads: Vec<Range<usize>>,
    /// Whether all of it is read.
    is_dense: bool,
    /// Whether the wanted values are stored, and whether other fields are parsed as well.
    stores: bool,
    audit: bool,
    /// The fields that are read once all bytes conform, where few lines are wanted.
    looks: Option<Vec<Look>>,
}

/// A field of the line that begins at a byte of the state, and the index of its value.
struct Look {
    at: usize,
    field: Field,
    out: u32,
}

/// Time and cycle of a state.
pub(crate) type Found = (f64, Option<i64>);

impl Layout {
    /// The layout of a state of these bytes, which begin at byte `start` of the file, from the parts of its lines. `out`: the index of
    /// a part's value in the output. `None` if something in it is not like a field.
    pub(crate) fn new(
        bytes: Vec<u8>,
        start: u64,
        zones: &[Zone],
        out: impl Fn(Part) -> Option<usize>,
    ) -> Option<Self> {
        let mut zones: Vec<(usize, &Zone)> =
            zones.iter().map(|zone| ((zone.at - start) as usize, zone)).collect();
        order::sort_by_key(&mut zones, |(at, _)| *at);
        let mut zones = zones.into_iter().peekable();
        let mut layout = Self {
            expected: bytes,
            free: Vec::new(),
            classes: Vec::new(),
            rows: Vec::new(),
            outs: Vec::new(),
            tail: 0,
            cycle: None,
            head: 0,
        };
        let mut known: HashMap<Class, u32> = HashMap::new();
        let (mut at, mut time, mut last) = (0, None, 0);
        while at < layout.expected.len() {
            let rest = &mut layout.expected[at..];
            let width = memchr::memchr(b'\n', rest)? + 1;
            let line = &mut rest[..width];
            let mut class = Class { is_of_e12: false, free: vec![SAME; width], fields: Vec::new() };
            let (values, mut is_wanted) = (layout.outs.len(), false);
            let mut end = 0;
            while let Some((from, zone)) = zones.next_if(|(from, _)| *from < at + width) {
                let field = Field::of(line, from.checked_sub(at)?, zone, end, &mut class.free)?;
                end = field.to;
                let text = at + field.from..at + field.to;
                match field.kind {
                    Kind::Time => {
                        layout.head =
                            if time.is_none() { layout.rows.len() + 1 } else { layout.head };
                        time.get_or_insert(text);
                    }
                    Kind::Cycle => drop(layout.cycle.get_or_insert(text)),
                    _ => {}
                }
                let index = out(zone.part).map_or(NOWHERE, |index| index as u32);
                is_wanted |= index != NOWHERE;
                layout.outs.push(index);
                class.fields.push(field);
                last = at + width;
            }
            if !is_wanted {
                layout.outs.truncate(values);
            }
            if layout.expected.len() <= DENSE_READ {
                layout.free.extend(&class.free);
            }
            class.is_of_e12 = !class.fields.is_empty()
                && class.fields.iter().all(|f| f.kind == Kind::E12 && f.to - f.from <= 12)
                && class.fields.windows(2).all(|pair| pair[0].to + 12 <= pair[1].to);
            let next = known.len() as u32;
            let class = *known.entry(class).or_insert(next);
            let values = if is_wanted { values as u32 } else { NOWHERE };
            layout.rows.push(Row { at: at as u32, class, values });
            at += width;
        }
        layout.tail = at - last;
        let mut classes: Vec<(Class, u32)> = known.into_iter().collect();
        order::sort_by_key(&mut classes, |(_, number)| *number);
        layout.classes = classes.into_iter().map(|(class, _)| class).collect();
        time.filter(|_| zones.next().is_none())?;
        Some(layout)
    }

    /// Puts every value where `places` says instead; whether they are all there.
    pub(crate) fn redirect(&mut self, places: &[Option<usize>], values: usize) -> bool {
        let mut is_there = vec![false; values];
        for out in self.outs.iter_mut().filter(|out| **out != NOWHERE) {
            let place = places.get(*out as usize).copied().flatten();
            place
                .and_then(|place| is_there.get_mut(place))
                .into_iter()
                .for_each(|there| *there = true);
            *out = place.map_or(NOWHERE, |place| place as u32);
        }
        is_there.iter().all(|there| *there)
    }

    pub(crate) fn period(&self) -> u64 {
        self.expected.len() as u64
    }

    pub(crate) fn lines(&self) -> u64 {
        self.rows.len() as u64
    }

    /// Where the cycle is in the state.
    pub(crate) fn cycle(&self) -> Option<Range<usize>> {
        self.cycle.clone()
    }

    /// Number of states between byte `at` and the end of the file, of which the last may lack lines
    /// after its last field.
    pub(crate) fn count(&self, size: u64, at: u64) -> usize {
        let body = self.period() - self.tail as u64;
        match size.saturating_sub(at).checked_sub(body) {
            Some(rest) => usize::try_from(rest / self.period()).unwrap_or(usize::MAX - 1) + 1,
            None => 0,
        }
    }

    /// Reads all lines. `audit`: parse the fields that are not wanted as well.
    pub(crate) fn all(&self, audit: bool) -> Plan {
        self.plan(self.reads(0..self.rows.len()), (true, true, audit))
    }

    /// Verifies all lines.
    pub(crate) fn check(&self) -> Plan {
        self.plan(self.reads(0..self.rows.len()), (true, false, true))
    }

    /// Reads only the lines up to the time.
    pub(crate) fn head(&self) -> Plan {
        let is_dense = self.period() < DENSE_READ as u64 / 16;
        self.plan(self.reads(0..self.head), (is_dense, false, false))
    }

    fn plan(
        &self,
        reads: Vec<Range<usize>>,
        (is_dense, stores, audit): (bool, bool, bool),
    ) -> Plan {
        let stored = self.rows.iter().filter(|row| stores && row.values != NOWHERE).count();
        let is_sweep = !self.free.is_empty() && 2 * stored < self.rows.len();
        let looks = self.rows.iter().flat_map(|row| {
            let (at, class) = (row.at as usize, &self.classes[row.class as usize]);
            self.fields(row, class).map(move |(&field, out)| Look { at, field, out })
        });
        let is_read = |look: &Look| match look.field.kind {
            Kind::Time | Kind::Cycle | Kind::Unread | Kind::Integer => true,
            Kind::Real => audit || (stores && look.out != NOWHERE),
            Kind::E12 | Kind::E11 => stores && look.out != NOWHERE,
        };
        let looks = is_sweep.then(|| looks.filter(is_read).collect());
        Plan { reads, is_dense, stores, audit, looks }
    }

    /// Reads the wanted lines and those that are not rows, and the first and last of the rows between them,
    /// unless most pages are wanted.
    pub(crate) fn some(&self) -> Plan {
        let is_plain = |row: &Row| {
            let fields = &self.classes[row.class as usize].fields;
            !fields.is_empty() && fields.iter().all(|f| !matches!(f.kind, Kind::Time | Kind::Cycle))
        };
        let plain: Vec<bool> = self.rows.iter().map(is_plain).collect();
        let is_end = |k: usize| k == 0 || k + 1 == plain.len() || !plain[k - 1] || !plain[k + 1];
        let taken = |&k: &usize| self.rows[k].values != NOWHERE || !plain[k] || is_end(k);
        let reads = self.reads((0..plain.len()).filter(taken));
        let pages: usize = reads.iter().map(|read| self.bytes(read).len() + PAGE).sum();
        match 2 * pages > self.expected.len() {
            true => self.all(false),
            false => self.plan(reads, (false, true, false)),
        }
    }

    fn reads(&self, lines: impl Iterator<Item = usize>) -> Vec<Range<usize>> {
        let mut reads: Vec<Range<usize>> = Vec::new();
        for line in lines {
            match reads.last_mut() {
                Some(read)
                    if self.from(line) - self.from(read.end) < PAGE
                        && self.from(line + 1) - self.from(read.start) <= DENSE_READ =>
                {
                    read.end = line + 1
                }
                _ => reads.push(line..line + 1),
            }
        }
        reads
    }

    fn from(&self, line: usize) -> usize {
        self.rows.get(line).map_or(self.expected.len(), |row| row.at as usize)
    }

    fn bytes(&self, lines: &Range<usize>) -> Range<usize> {
        self.from(lines.start)..self.from(lines.end)
    }

    /// Reads the state at byte `at` of a file of `size` bytes into `out`; its time and cycle, or `None` if it is laid
    /// out in another way. At the end of the file lines after the last field may be missing.
    pub(crate) fn state(
        &self,
        window: &mut Window<'_>,
        (at, size): (u64, u64),
        plan: &Plan,
        out: &mut [f64],
    ) -> io::Result<Option<Found>> {
        let there = size.saturating_sub(at).min(self.period()) as usize;
        let ends = self.rows.partition_point(|row| (row.at as usize) < there);
        if there + self.tail < self.expected.len() || self.from(ends) != there {
            return Ok(None);
        }
        let mut found = State::default();
        for (k, lines) in plan.reads.iter().enumerate() {
            let lines = lines.start..lines.end.min(ends).max(lines.start);
            let range = self.bytes(&lines);
            let ahead = match (plan.is_dense, k + 1 < plan.reads.len()) {
                (true, _) => DENSE_READ,
                // After the last line comes the head of what follows.
                (false, false) => self.bytes(&plan.reads[0]).len(),
                (false, true) => 0,
            };
            let bytes = window.get(at + range.start as u64, range.len(), ahead)?;
            let read = bytes.and_then(|bytes| self.read(bytes, lines, plan, &mut found, out));
            if read.is_none() {
                return Ok(None);
            }
        }
        Ok(found.time.map(|time| (time, found.cycle)))
    }

    fn read(
        &self,
        bytes: &[u8],
        lines: Range<usize>,
        plan: &Plan,
        found: &mut State,
        out: &mut [f64],
    ) -> Option<()> {
        let start = self.from(lines.start);
        if let Some(looks) = &plan.looks
            && let whole = self.bytes(&lines)
            && conforms(bytes, self.expected.get(whole.clone())?, self.free.get(whole.clone())?)
        {
            let first = looks.partition_point(|look| look.at < whole.start);
            for look in looks[first..].iter().take_while(|look| look.at < whole.end) {
                look.field.read(bytes.get(look.at - start..)?, look.out, plan, found, out)?;
            }
            return Some(());
        }
        for row in &self.rows[lines] {
            let class = self.classes.get(row.class as usize)?;
            let (at, width) = (row.at as usize, class.free.len());
            let line = bytes.get(at - start..at - start + width)?;
            let expected = self.expected.get(at..at + width)?;
            let outs = self.outs.get(row.values as usize..).unwrap_or_default();
            if plan.stores && class.reads_numbers(line, expected, outs, out) {
                continue;
            }
            if !conforms(line, expected, &class.free) && !class.holds_numbers(line, expected) {
                return None;
            }
            for (field, index) in self.fields(row, class) {
                field.read(line, index, plan, found, out)?;
            }
        }
        Some(())
    }

    /// The fields of a line with the indices of their values.
    fn fields<'a>(&'a self, row: &Row, class: &'a Class) -> impl Iterator<Item = (&'a Field, u32)> {
        let outs = self.outs.get(row.values as usize..).unwrap_or_default();
        let out = |k: usize| outs.get(k).copied().unwrap_or(NOWHERE);
        class.fields.iter().enumerate().map(move |(k, field)| (field, out(k)))
    }
}

/// Time and cycle of a state, as far as it is read, with the printed time.
#[derive(Default)]
struct State {
    time: Option<f64>,
    printed: [u8; MAX_TIME],
    columns: usize,
    cycle: Option<i64>,
}

/// Columns of the longest time that is read.
const MAX_TIME: usize = 24;

impl State {
    /// Reads a field that is not a value; `None` if it contradicts those above it.
    fn note(&mut self, field: &Field, line: &[u8]) -> Option<()> {
        let text = field.text(line);
        match field.kind {
            Kind::Time if self.time.is_some() => {
                (self.printed.get(..self.columns)? == text).then_some(())
            }
            Kind::Time => {
                self.printed.get_mut(..text.len())?.copy_from_slice(text);
                self.columns = text.len();
                let quick = line.get(..field.to).and_then(|line| line.last_chunk::<12>());
                let quick = quick.filter(|_| text.len() == 11).filter(|chunk| chunk[0] == b' ');
                self.time = Some(quick.and_then(e12::parse).or_else(|| real(text).number())?);
                Some(())
            }
            Kind::Cycle => {
                let cycle = integer(text)?;
                (*self.cycle.get_or_insert(cycle) == cycle).then_some(())
            }
            _ => {
                let is_word = |b: &u8| b.is_ascii_alphanumeric() | (*b == b' ');
                text.iter().fold(true, |words, b| words & is_word(b)).then_some(())
            }
        }
    }
}

/// Bytes that are compared at once.
const WIDE: usize = 16;

/// Whether every byte differs from the expected one only as it may.
fn conforms(line: &[u8], expected: &[u8], free: &[u8]) -> bool {
    let mut differs = [0; WIDE];
    let (lines, rest) = line.as_chunks();
    let n = lines.len();
    let (expecteds, frees) = (&expected.as_chunks().0[..n], &free.as_chunks().0[..n]);
    for k in 0..n {
        compare(&mut differs, &lines[k], &expecteds[k], &frees[k]);
    }
    // The rest with what is above it, so that it is as wide.
    match (line.last_chunk(), expected.last_chunk(), free.last_chunk()) {
        _ if rest.is_empty() => {}
        (Some(line), Some(expected), Some(free)) => compare(&mut differs, line, expected, free),
        _ => {
            for k in 0..line.len() {
                let mut byte = [0];
                compare(&mut byte, &[line[k]], &[expected[k]], &[free[k]]);
                differs[k] |= byte[0];
            }
        }
    }
    differs == [0; WIDE]
}

/// Notes the bytes that differ in another way than they may.
#[inline(always)]
fn compare<const N: usize>(
    differs: &mut [u8; N],
    line: &[u8; N],
    expected: &[u8; N],
    free: &[u8; N],
) {
    for k in 0..N {
        let difference = line[k] ^ expected[k];
        let is_digit = (free[k] == DIGIT) & (difference < 10);
        let is_free = is_digit | (difference == SAME) | (difference == free[k]) | (free[k] == ANY);
        differs[k] |= u8::from(!is_free);
    }
}

impl Class {
    /// Reads a line of twelve-column numbers alone, whose parser looks at every byte of theirs; false if the line has other
    /// fields, or others are wanted than there are, or if it needs a closer look.
    #[inline(always)]
    fn reads_numbers(&self, line: &[u8], expected: &[u8], outs: &[u32], out: &mut [f64]) -> bool {
        if !self.is_of_e12 || outs.len() < self.fields.len() {
            return false;
        }
        let mut from = 0;
        for (k, field) in self.fields.iter().enumerate() {
            let start = field.to - 12;
            // With the beginning of the first number, so that it is as wide as a comparison.
            let between =
                from..if from == 0 && line.len() >= WIDE { start.max(WIDE) } else { start };
            from = field.to;
            if !between.is_empty()
                && !conforms(
                    &line[between.clone()],
                    &expected[between.clone()],
                    &self.free[between],
                )
            {
                return false;
            }
            let Some(value) = line[start..].first_chunk().and_then(e12::parse) else {
                return false;
            };
            if let Some(place) = out.get_mut(outs[k] as usize) {
                *place = value;
            }
        }
        conforms(&line[from..], &expected[from..], &self.free[from..])
    }

    /// The same for a line some of whose fields hold numbers in another form.
    fn holds_numbers(&self, line: &[u8], expected: &[u8]) -> bool {
        let part = |range: Range<usize>| {
            conforms(&line[range.clone()], &expected[range.clone()], &self.free[range])
        };
        let mut from = 0;
        self.fields.iter().all(|field| {
            let before = part(from..field.from);
            from = field.to;
            before && (part(field.from..field.to) || field.holds_number(line))
        }) && part(from..line.len())
    }
}

impl Field {
    /// The field of a zone, which begins at byte `from` of a line and after byte `end`; notes how its bytes may differ.
    fn of(line: &mut [u8], from: usize, zone: &Zone, end: usize, free: &mut [u8]) -> Option<Self> {
        let to = from + zone.length;
        if from < end || to > line.len() {
            return None;
        }
        let (kind, is_number) = match zone.part {
            Part::Time => (Kind::Time, true),
            Part::Cycle => (Kind::Cycle, false),
            Part::Unread => (Kind::Unread, false),
            Part::Row { .. } | Part::Scalar(_) => (Kind::Real, true),
        };
        if !is_number {
            free[from..to].fill(ANY);
            return Some(Self { from, to, kind, is_fixed: true });
        }
        let text = line[from..to].trim_ascii();
        if kind == Kind::Time {
            let from = from + line[from..to].len() - line[from..to].trim_ascii_start().len();
            let to = from + text.len();
            is_form(text).then_some(())?;
            free_digits(&mut line[from..to], &mut free[from..to]);
            return Some(Self { from, to, kind, is_fixed: true });
        }
        // Before a number that begins without one there may be room for a sign, if not for that alone.
        let is_fixed = !line[from].is_ascii_digit();
        let is_blank = |byte: &&u8| **byte == b' ';
        let room = line[end..from].iter().rev().take_while(is_blank).count();
        let from = if is_fixed { from } else { from - room };
        if !line[..to].ends_with(text) {
            return None;
        }
        if !text.is_empty() && text.iter().all(u8::is_ascii_digit) {
            free[from..to].fill(ANY);
            return Some(Self { from, to, kind: Kind::Integer, is_fixed });
        }
        let digits = text.strip_prefix(b"-").unwrap_or(text);
        is_form(digits).then_some(())?;
        let (start, has_sign) =
            (to - digits.len(), digits.len() + usize::from(!is_fixed) < to - from);
        let kind = match digits {
            [_, b'.', fraction @ .., b'E', b'+' | b'-', _, _]
                if has_sign && fraction.len() == 5 =>
            {
                Kind::E12
            }
            [_, b'.', fraction @ .., b'E', b'+' | b'-', _, _]
                if has_sign && fraction.len() == 4 =>
            {
                Kind::E11
            }
            _ => Kind::Real,
        };
        if has_sign {
            free[start - 1] = SIGN;
        }
        free_digits(&mut line[start..to], &mut free[start..to]);
        Some(Self { from, to, kind, is_fixed })
    }

    /// Reads the field of a line that conforms, a value into its place; `None` if it does not hold one.
    #[inline(always)]
    fn read(
        &self,
        line: &[u8],
        out: u32,
        plan: &Plan,
        found: &mut State,
        values: &mut [f64],
    ) -> Option<()> {
        match self.kind {
            Kind::Time | Kind::Cycle | Kind::Unread => found.note(self, line)?,
            _ if out != NOWHERE && plan.stores => {
                *values.get_mut(out as usize)? = self.number(line)?
            }
            Kind::Integer => self.is_integer(line).then_some(())?,
            Kind::Real if plan.audit => drop(self.number(line)?),
            _ => {}
        }
        Some(())
    }

    fn text<'a>(&self, line: &'a [u8]) -> &'a [u8] {
        &line[self.from..self.to]
    }

    /// The number of a line that conforms; `None` if it is not finite.
    #[inline(always)]
    fn number(&self, line: &[u8]) -> Option<f64> {
        let quick = match self.kind {
            Kind::E12 => line[..self.to].last_chunk::<12>().and_then(e12::parse),
            Kind::E11 => line[..self.to].last_chunk::<11>().and_then(
                |&[s, d, p, a, b, c, f, e, es, e1, e2]| {
                    e12::parse(&[s, d, p, a, b, c, f, b'0', e, es, e1, e2])
                },
            ),
            _ => None,
        };
        if self.kind == Kind::Integer && !self.is_integer(line) {
            return None;
        }
        quick.or_else(|| real(self.text(line)).number())
    }

    fn is_integer(&self, line: &[u8]) -> bool {
        let number = self.text(line).trim_ascii_start();
        !number.is_empty() && number.iter().all(u8::is_ascii_digit)
    }

    /// Whether a value is a whole number to the end of the field.
    fn holds_number(&self, line: &[u8]) -> bool {
        let text = self.text(line);
        let number = text.trim_ascii_start();
        matches!(self.kind, Kind::E12 | Kind::E11 | Kind::Real)
            && (self.is_fixed || number.len() < text.len())
            && is_whole_real(number)
            && real(number).number().is_some()
    }
}

/// Whether a text is a real with all its digits.
fn is_form(text: &[u8]) -> bool {
    text.first().is_some_and(u8::is_ascii_digit) && is_whole_real(text)
}

/// Lets digits and the exponent's sign differ.
fn free_digits(text: &mut [u8], free: &mut [u8]) {
    for (byte, free) in text.iter_mut().zip(free) {
        match byte {
            b'0'..=b'9' => (*byte, *free) = (b'0', DIGIT),
            b'+' | b'-' => *free = EXPONENT_SIGN,
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn zone(at: usize, length: usize, part: Part) -> Zone {
        Zone { at: at as u64, length, part }
    }

    /// A state of one row and blank lines.
    fn layout(row: &str, tail: &str, zones: &[Zone]) -> Option<Layout> {
        Layout::new(format!("{row}\n{tail}").into_bytes(), 0, zones, |part| match part {
            Part::Scalar(number) => Some(number),
            _ => None,
        })
    }

    /// Every size of a file and place in it, against counting; and the largest numbers of all.
    #[test]
    fn states_are_counted_as_by_hand() {
        for tail in 0..6_u64 {
            let blank = "\n".repeat(tail as usize);
            let layout = layout("1.0E+00", &blank, &[zone(0, 7, Part::Time)]).unwrap();
            let period = 8 + tail;
            assert_eq!((layout.period(), layout.lines()), (period, 1 + tail));
            for (size, at) in (0..60_u64).flat_map(|size| (0..65).map(move |at| (size, at))) {
                let by_hand = (1..).take_while(|k| at + k * period - tail <= size).count();
                assert_eq!(layout.count(size, at), by_hand, "{tail} {size} {at}");
            }
            assert_eq!(layout.count(u64::MAX, u64::MAX), 0);
            assert!(layout.count(u64::MAX, 0) as u64 >= u64::MAX / period);
        }
    }

    /// What a state of the layout may hold, and its value; all else is left to the line reader.
    #[test]
    fn a_state_is_read_by_its_layout_or_not_at_all() {
        let shown = "t 1.00000E+00 x  2.50000E-01 y=  3.0000E+00   7 words";
        let zones = [
            zone(2, 11, Part::Time),
            zone(16, 12, Part::Scalar(0)),
            zone(33, 10, Part::Scalar(1)),
            zone(46, 1, Part::Scalar(2)),
            zone(47, 6, Part::Unread),
        ];
        let layout = layout(shown, "", &zones).unwrap();
        let read = |text: &str| {
            let source = format!("{text}\n").into_bytes();
            let (mut window, mut out) = (Window::new(&source), [0.0; 3]);
            let size = source.len() as u64;
            let found = layout.state(&mut window, (0, size), &layout.all(false), &mut out).unwrap();
            // All bytes at once, as where no value of most lines is wanted.
            let checked = layout.state(&mut window, (0, size), &layout.check(), &mut []).unwrap();
            assert_eq!(checked, found, "{text}");
            found.map(|(time, _)| (time, out))
        };
        assert_eq!(read(shown), Some((1.0, [0.25, 3.0, 7.0])));
        let other = "t 9.12345E-02 x -1.23456E+05 y= -4.5678E-11 421 other";
        assert_eq!(read(other), Some((0.0912345, [-123456.0, -4.5678e-11, 421.0])));
        // A number in another form, but whole.
        let other = "t 1.00000E+00 x  2.50000-101 y=  3.0000E+00   7 words";
        assert_eq!(read(other), Some((1.0, [2.5e-101, 3.0, 7.0])));
        for text in [
            "t 1.00000E+00 X  2.50000E-01 y=  3.0000E+00   7 words",
            "t 1.00000E+00 x ************ y=  3.0000E+00   7 words",
            "t 1.00000E+00 x  2.5000:E-01 y=  3.0000E+00   7 words",
            "t 1.00000E+00 x  2.50000E-01 y=13.00000E+00   7 words",
            "t 1.00000E+00 x  2.50000E-01 y=  3.0000E+00     words",
            "t 1.00000E+00 x  2.50000E-01 y=  3.0000E+00   7 w*rds",
            "t *.00000E+00 x  2.50000E-01 y=  3.0000E+00   7 words",
            "t 1.00000E+00 x          NaN y=  3.0000E+00   7 words",
            "t 1.00000E+00 x  2.50000E-01 y=  3.0000E+00   7 word",
        ] {
            assert_eq!(read(text), None, "{text}");
        }
    }
}
