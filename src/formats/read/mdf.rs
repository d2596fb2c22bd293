//! Curve of an MDF 4 file (ASAM): one of its groups of channels, read as the table that it is.
//!
//! Test departments' tools write them in many ways; read are sorted groups of numbers in whole bytes, plain, in lists of
//! blocks and compressed, with linear conversions. Everything else is named with what to do about it. Blocks may refer to each
//! other in any way: a file has as many visits as it could hold blocks, several times over.

use std::cell::Cell;
use std::fmt::Write;
use std::io::Read;

use flate2::read::ZlibDecoder;

use super::columns::{check_curves, check_points, choose};
use super::curve::ReadCurve;
use super::label::{Label, Quantity};
use super::{Input, tables};
use crate::error::{Error, error};
use crate::formats::mdf::{RUN, column_of};
use crate::guess;
use crate::words::counted;

/// How every MDF file begins; the version and the program that wrote it follow.
const BEGINNING: &[u8] = b"MDF     ";
/// How one begins whose recording was not closed: its numbers of records may be those of an earlier moment.
const UNFINISHED: &[u8] = b"UnFinMF ";
const OURS: &[u8] = b"crumple ";
/// Bytes of a group's records, unpacked, at most.
const MOST_BYTES: u64 = 1 << 30;
/// The same of one compressed block; writers pack 4 MiB.
const MOST_PACKED: u64 = 64 << 20;
/// Bytes of a name, and of the comment of a file, that are read.
const NAME: usize = 512;
const COMMENT: usize = 64 << 10;
/// Channels that a message lists.
const LISTED: usize = 5;
/// Numbers of a table at most.
const MOST_NUMBERS: usize = 20_000_000;

pub(super) fn recognise(input: &Input<'_>) -> bool {
    is_mdf(input.bytes)
}

fn is_mdf(bytes: &[u8]) -> bool {
    bytes.starts_with(BEGINNING) || bytes.starts_with(UNFINISHED)
}

/// The blocks of a file, its first one, and its groups.
fn opened(bytes: &[u8]) -> Result<(Blocks<'_>, Block<'_>, Vec<Group>), Error> {
    if bytes.starts_with(UNFINISHED) {
        return Err(wrong(
            "the file was never finalised, so that records may be missing: open and save it with the program that recorded it",
        ));
    }
    if bytes.get(8) != Some(&b'4') {
        return Err(wrong("expected MDF of version 4, found an earlier version: save it as MDF 4"));
    }
    let file = Blocks { bytes, visits: Cell::new(bytes.len() / 8 + 100) };
    let header = file.block(64, b"HD")?;
    let groups = groups(&file, &header)?;
    Ok((file, header, groups))
}

/// Whether a file that begins so is a run's, as `crumple simulate -o` writes it.
pub(crate) fn is_run(head: &[u8]) -> bool {
    let mut parts = head.windows(RUN.len());
    head.starts_with(BEGINNING)
        && head.get(2 * BEGINNING.len()..).is_some_and(|writer| writer.starts_with(OURS))
        && parts.any(|part| part == RUN.as_bytes())
}

/// The table of a run's file, with the columns of its CSV file.
pub(super) fn run(bytes: &[u8]) -> Result<String, Error> {
    let (file, _, mut groups) = opened(bytes)?;
    let [group] = &mut groups[..] else {
        return Err(wrong("expected the one group of channels that crumple simulate writes"));
    };
    for channel in &mut group.channels {
        channel.name = column_of(&channel.name, &std::mem::take(&mut channel.unit));
    }
    let mut text = String::new();
    group.rows(&file, &mut text)?;
    Ok(text)
}

/// The table of the group with the channel called `wanted`, and how the table calls it: of that channel and the times.
/// `None` if the file is not MDF.
pub(super) fn history(
    bytes: &[u8],
    wanted: Option<&str>,
) -> Result<Option<(String, Option<String>)>, Error> {
    if !is_mdf(bytes) {
        return Ok(None);
    }
    let (file, _, mut groups) = opened(bytes)?;
    let is_wanted = |channel: &Channel| {
        wanted.is_none_or(|wanted| channel.name == wanted || channel.label() == wanted)
    };
    let has = |group: &Group| group.channels.iter().any(is_wanted);
    let found: Vec<usize> = (0..groups.len()).filter(|k| has(&groups[*k])).collect();
    let [found] = found[..] else {
        let labels = groups.iter().flat_map(|group| &group.channels).map(Channel::label);
        let known = labels.map(|label| format!("\"{label}\"")).collect::<Vec<_>>().join(", ");
        return Err(match (wanted, found.len()) {
            (None, _) => {
                error!(Rating at "column", "there are several groups of channels: name one of {known}")
            }
            (Some(name), 0) => {
                error!(Rating at "column", "there is no channel \"{name}\": name one of {known}{}", guess::hint(name, &known))
            }
            (Some(name), count) => {
                error!(Rating, "{count} groups have a channel \"{name}\": rename all but one")
            }
        });
    };
    let mut group = groups.swap_remove(found);
    let mut called = None;
    if wanted.is_some() {
        let is_time = |channel: &Channel| channel.quantity() == Some(Quantity::Time);
        let first = group.channels[0].at;
        group.channels.retain(|c| c.at == first || is_time(c) || is_wanted(c));
        called = group.channels.iter().find(|c| is_wanted(c)).map(Channel::label);
    }
    let mut text = String::new();
    group.rows(&file, &mut text)?;
    Ok(Some((text, called)))
}

pub(super) fn read(input: &Input<'_>) -> Result<ReadCurve, Error> {
    let (file, header, mut groups) = opened(input.bytes)?;
    let left_out = |of: &[Group]| {
        let all = of.iter().flat_map(|group| &group.left_out).take(LISTED);
        all.map(|why| format!("; left out: channel {why}")).collect::<String>()
    };
    let chosen = chosen(&groups, input.options.curve.as_deref());
    let chosen = chosen.map_err(|error| error.followed_by(&left_out(&groups)))?;
    let mut group = groups.swap_remove(chosen);
    // Columns chosen by the user may be any, by their numbers too.
    if input.options.column_option().is_none() && group.is_curve() {
        group.channels.retain(|channel| channel.quantity().is_some());
    }
    let mut text = String::new();
    // What an import needs to know; comments of other programs are about something else.
    let comment =
        file.text(header.link(5), COMMENT).filter(|_| input.bytes[16..].starts_with(OURS));
    for line in comment.unwrap_or_default().lines() {
        let _ = writeln!(text, "# {line}");
    }
    // Without them it would be a table of deflections and forces alone.
    if let (Some(why), None, false) =
        (&group.lost_times, &input.options.time_column, group.has(Quantity::Time))
    {
        return Err(error!(
            CurveFile,
            "group {}: its times are in channel {why}; choose another with --time-column, or none",
            group.name
        ));
    }
    let notes = group.rows(&file, &mut text)?;
    let found = tables::read(&Input { text: &text, ..*input });
    let mut found =
        found.map_err(|error| error.followed_by(&left_out(std::slice::from_ref(&group))))?;
    found.notes.extend(notes);
    found.notes.insert(0, format!("curve: group {} of the file, read as a table", group.name));
    found.notes.extend(group.left_out.iter().map(|why| format!("left out: channel {why}")));
    Ok(found)
}

fn wrong(what: &str) -> Error {
    error!(CurveFile, "{what}")
}

/// The blocks of a file, by their offsets.
struct Blocks<'a> {
    bytes: &'a [u8],
    /// How many more are visited.
    visits: Cell<usize>,
}

struct Block<'a> {
    links: &'a [u8],
    data: &'a [u8],
}

impl Block<'_> {
    /// 0 where there is none.
    fn link(&self, k: usize) -> u64 {
        integer(self.links, 8 * k, 8)
    }
}

/// An unsigned number of so many bytes, little-endian; 0 beyond the end.
fn integer(bytes: &[u8], at: usize, size: usize) -> u64 {
    let bytes = bytes.get(at..at + size).unwrap_or_default();
    bytes.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte))
}

impl<'a> Blocks<'a> {
    fn kind(&self, at: u64) -> &'a [u8] {
        let at = usize::try_from(at).unwrap_or(usize::MAX);
        at.checked_add(4).and_then(|end| self.bytes.get(at..end)).unwrap_or_default()
    }

    fn block(&self, at: u64, kind: &[u8; 2]) -> Result<Block<'a>, Error> {
        let kind = String::from_utf8_lossy(kind);
        let cut = || {
            error!(
                CurveFile,
                "byte {at}: expected a block ##{kind}, found the end of the file or something else: it may be cut off, or was never finalised; open and save it with the program that recorded it"
            )
        };
        if self.kind(at) != format!("##{kind}").as_bytes() {
            return Err(cut());
        }
        let left = self.visits.get().checked_sub(1);
        self.visits.set(
            left.ok_or_else(|| wrong("the blocks of the file refer to each other in a loop"))?,
        );
        let begin = usize::try_from(at).map_err(|_| cut())?;
        let (length, links) =
            (integer(self.bytes, begin + 8, 8), integer(self.bytes, begin + 16, 8));
        let end = usize::try_from(length).ok().and_then(|length| begin.checked_add(length));
        let whole = end.and_then(|end| self.bytes.get(begin..end)).ok_or_else(cut)?;
        let links = usize::try_from(links).ok().and_then(|n| n.checked_mul(8)?.checked_add(24));
        let (head, data) = links.and_then(|at| whole.split_at_checked(at)).ok_or_else(cut)?;
        Ok(Block { links: head.get(24..).ok_or_else(cut)?, data })
    }

    /// The text of a block of text, or the first in one of XML, as far as it lies in so many bytes.
    fn text(&self, at: u64, most: usize) -> Option<String> {
        let kind = self.kind(at).last_chunk().filter(|kind| [b"TX", b"MD"].contains(kind))?;
        let data = self.block(at, kind).ok()?.data;
        let data = &data[..data.len().min(most)];
        let text = String::from_utf8_lossy(data.split(|byte| *byte == 0).next()?);
        if kind == b"TX" {
            return Some(text.trim().into());
        }
        let inside = text.split_once("<TX")?.1.split_once('>')?.1.split_once("</TX>")?.0;
        let plain = inside.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"");
        let plain = plain.replace("&apos;", "'").replace("&amp;", "&");
        Some(plain.trim().into())
    }
}

/// Blocks that refer to each other one after another, as many as the file has room for.
fn chain<'a>(file: &Blocks<'a>, first: u64, kind: &[u8; 2]) -> Result<Vec<Block<'a>>, Error> {
    let (mut found, mut at) = (Vec::new(), first);
    while at != 0 {
        found.push(file.block(at, kind)?);
        check_curves(found.len())?;
        at = found[found.len() - 1].link(0);
    }
    Ok(found)
}

/// A channel of numbers in the records of its group.
struct Channel {
    name: String,
    unit: String,
    /// First byte and bytes; of none the value is the number of the record.
    at: usize,
    size: usize,
    /// `cn_data_type`: unsigned, signed, floating, each little-endian and then big-endian.
    kind: u8,
    /// value = offset + factor × raw.
    offset: f64,
    factor: f64,
    /// Byte and bit of the mark that a value is invalid.
    invalid: Option<(usize, u8)>,
}

struct Group {
    name: String,
    channels: Vec<Channel>,
    left_out: Vec<String>,
    /// The channel of the times, if it is left out, and why.
    lost_times: Option<String>,
    records: u64,
    record_bytes: usize,
    /// Those before the marks of invalid values.
    value_bytes: usize,
    data: u64,
    /// Why its records cannot be read.
    unread: Option<&'static str>,
}

fn groups(file: &Blocks<'_>, header: &Block<'_>) -> Result<Vec<Group>, Error> {
    let mut groups = Vec::new();
    for data in chain(file, header.link(0), b"DG")? {
        for block in chain(file, data.link(1), b"CG")? {
            let mut group = Group {
                name: (groups.len() + 1).to_string(),
                channels: Vec::new(),
                left_out: Vec::new(),
                lost_times: None,
                records: integer(block.data, 8, 8),
                record_bytes: (integer(block.data, 24, 4) + integer(block.data, 28, 4)) as usize,
                value_bytes: integer(block.data, 24, 4) as usize,
                data: data.link(2),
                unread: (integer(data.data, 0, 1) != 0)
                    .then_some("several groups share its records: sort the file (asammdf does)"),
            };
            for (k, block) in chain(file, block.link(1), b"CN")?.iter().enumerate() {
                let name =
                    file.text(block.link(2), NAME).unwrap_or_else(|| format!("channel {}", k + 1));
                match channel(file, block, name.clone(), &group) {
                    Ok(channel) => group.channels.push(channel),
                    Err(why) => {
                        let why = format!("\"{name}\": {why}");
                        if is_master(block) {
                            group.lost_times = Some(why.clone());
                        }
                        group.left_out.push(why);
                    }
                }
            }
            if group.channels.len() > 1 {
                groups.push(group);
                check_curves(groups.len())?;
            }
        }
    }
    Ok(groups)
}

/// Whether a channel holds the times of its group, in the records or by their numbers.
fn is_master(block: &Block<'_>) -> bool {
    [2, VIRTUAL].contains(&integer(block.data, 0, 1)) && integer(block.data, 1, 1) == 1
}

/// The kind of a channel that counts the records.
const VIRTUAL: u64 = 3;

fn channel(
    file: &Blocks<'_>,
    block: &Block<'_>,
    name: String,
    group: &Group,
) -> Result<Channel, &'static str> {
    let byte = |at: usize| integer(block.data, at, 1) as u8;
    let (kind, at, bits) = (byte(2), integer(block.data, 4, 4), integer(block.data, 8, 4));
    if ![0, 2, 3].contains(&byte(0)) {
        return Err("its values are not in the records");
    }
    if file.kind(block.link(1)) == b"##CA" {
        return Err("it is an array: save its elements as channels");
    }
    let is_virtual = u64::from(byte(0)) == VIRTUAL;
    let (at, size) = if is_virtual { (0, 0) } else { (at as usize, bits as usize / 8) };
    let is_whole = byte(3) == 0 && bits % 8 == 0 && (1..=8).contains(&size);
    let is_number = is_whole && kind <= 5 && (kind <= 3 || [4, 8].contains(&size));
    if !is_virtual && (!is_number || at + size > group.value_bytes) {
        return Err("it does not hold numbers in whole bytes");
    }
    let flags = integer(block.data, 12, 4);
    if flags & 1 != 0 {
        return Err("all its values are marked as invalid");
    }
    let bit = integer(block.data, 16, 4) as usize;
    let mark = (group.value_bytes + bit / 8, 1 << (bit % 8));
    let invalid = Some(mark).filter(|(at, _)| flags & 2 != 0 && *at < group.record_bytes);
    let (offset, factor) = (0.0, 1.0);
    let mut found = Channel { name, unit: String::new(), at, size, kind, offset, factor, invalid };
    let mut unit = file.text(block.link(6), NAME);
    if block.link(4) != 0 {
        let conversion = file.block(block.link(4), b"CC");
        let conversion = conversion.map_err(|_| "its conversion is damaged")?;
        unit = unit.or(file.text(conversion.link(1), NAME));
        // After precision (1), flags (2), references (2), parameters (2) and the physical range (16).
        let parameter = |k: usize| f64::from_bits(integer(conversion.data, 24 + 8 * k, 8));
        match integer(conversion.data, 0, 1) {
            0 => {}
            1 => (found.offset, found.factor) = (parameter(0), parameter(1)),
            _ => return Err("its conversion is not linear: save it with physical values"),
        }
    }
    found.unit = unit.unwrap_or_default();
    Ok(found)
}

impl Channel {
    fn label(&self) -> String {
        match &*self.unit {
            "" => self.name.clone(),
            unit => format!("{} [{unit}]", self.name),
        }
    }

    fn quantity(&self) -> Option<Quantity> {
        Label::of_column(&self.label()).map(|label| label.quantity)
    }

    /// Its value in a record of this number.
    fn of(&self, (k, record): (usize, &[u8])) -> f64 {
        if self.size == 0 {
            return self.offset + self.factor * k as f64;
        }
        let mut bytes = [0; 8];
        let raw = &record[self.at..self.at + self.size];
        bytes[..self.size].copy_from_slice(raw);
        if self.kind % 2 == 1 {
            bytes[..self.size].reverse();
        }
        let raw = u64::from_le_bytes(bytes);
        let unused = 64 - 8 * self.size as u32;
        let raw = match (self.kind / 2, self.size) {
            (0, _) => raw as f64,
            (1, _) => ((raw << unused) as i64 >> unused) as f64,
            (_, 4) => f64::from(f32::from_bits(raw as u32)),
            _ => f64::from_bits(raw),
        };
        if self.factor == 1.0 && self.offset == 0.0 { raw } else { self.offset + self.factor * raw }
    }
}

/// The group that was requested, else the only one with a deflection and a force.
fn chosen(groups: &[Group], asked: Option<&str>) -> Result<usize, Error> {
    if groups.is_empty() {
        return Err(wrong("expected a group with several channels of numbers, found none"));
    }
    let listed = groups.iter().map(|group| {
        let labels: Vec<String> = group.channels.iter().map(Channel::label).collect();
        (group.name.clone(), labels.join(", "))
    });
    let curves: Vec<usize> = (0..groups.len()).filter(|k| groups[*k].is_curve()).collect();
    match (asked, &*curves) {
        (None, [only]) => Ok(*only),
        (None, [])
            if groups.iter().any(|of| of.has(Quantity::Deflection))
                && groups.iter().any(|of| of.has(Quantity::Force)) =>
        {
            let apart = "; deflection and force are in different groups: resample them to the same times, in one group";
            choose(listed, asked).map_err(|error| error.followed_by(apart))
        }
        _ => choose(listed, asked),
    }
}

impl Group {
    fn has(&self, wanted: Quantity) -> bool {
        self.channels.iter().any(|channel| channel.quantity() == Some(wanted))
    }

    fn is_curve(&self) -> bool {
        self.has(Quantity::Deflection) && self.has(Quantity::Force)
    }

    /// Its header and rows as the lines of a table; which rows are left out.
    fn rows(&self, file: &Blocks<'_>, text: &mut String) -> Result<Vec<String>, Error> {
        if let Some(why) = self.unread {
            return Err(error!(CurveFile, "group {}: {why}", self.name));
        }
        let records = usize::try_from(self.records).unwrap_or(usize::MAX);
        check_points(records)?;
        let wanted = self.records.saturating_mul(self.record_bytes as u64);
        if wanted > MOST_BYTES || records.saturating_mul(self.channels.len()) > MOST_NUMBERS {
            return Err(wrong(
                "the group has more than 1 GiB of records or 20 million numbers: export the channels that you need",
            ));
        }
        let mut data = Vec::new();
        // One more than is counted, to see whether there are.
        data_of(file, self.data, wanted as usize + self.record_bytes, &mut data)?;
        let whole = data.len() / self.record_bytes.max(1);
        if whole < records {
            return Err(error!(
                CurveFile,
                "group {}: expected {records} records, found {whole}: the file may be cut off, or was never finalised; open and save it with the program that recorded it",
                self.name
            ));
        }
        let quoted = |label: String| format!("\"{}\"", label.replace(['"', '\n', '\r'], " "));
        let labels: Vec<String> = self.channels.iter().map(|c| quoted(c.label())).collect();
        let _ = writeln!(text, "{}", labels.join(","));
        let (mut digits, mut invalid) = (zmij::Buffer::new(), 0);
        let all = data.chunks_exact(self.record_bytes.max(1)).take(records);
        for (number, record) in all.enumerate() {
            let marks = self.channels.iter().filter_map(|channel| channel.invalid);
            if marks.into_iter().any(|(at, bit)| record[at] & bit != 0) {
                invalid += 1;
                continue;
            }
            for (k, channel) in self.channels.iter().enumerate() {
                text.push_str(if k == 0 { "" } else { "," });
                text.push_str(digits.format(channel.of((number, record))));
            }
            text.push('\n');
        }
        let mut left_out = Vec::new();
        if whole > records {
            left_out.push(format!(
                "left out: what follows the {} that the group counts: if it was not closed, open and save it with the program that recorded it",
                counted(records, "record")
            ));
        }
        if invalid > 0 {
            left_out.push(format!("left out: {} marked as invalid", counted(invalid, "record")));
        }
        Ok(left_out)
    }
}

/// Appends the bytes of a block of data, or of all in a list of them, up to `most`.
fn data_of(file: &Blocks<'_>, at: u64, most: usize, out: &mut Vec<u8>) -> Result<(), Error> {
    let (mut at, mut lists) = (at, 0);
    loop {
        lists += 1;
        check_curves(lists)?;
        match file.kind(at) {
            b"##HL" => at = file.block(at, b"HL")?.link(0),
            b"##DL" => {
                let list = file.block(at, b"DL")?;
                for k in 1..list.links.len() / 8 {
                    piece(file, list.link(k), most, out)?;
                    if out.len() >= most {
                        return Ok(());
                    }
                }
                at = list.link(0);
            }
            _ if at == 0 => return Ok(()),
            _ => return piece(file, at, most, out),
        }
        if at == 0 || out.len() >= most {
            return Ok(());
        }
    }
}

fn piece(file: &Blocks<'_>, at: u64, most: usize, out: &mut Vec<u8>) -> Result<(), Error> {
    if file.kind(at) != b"##DZ" {
        let data = file.block(at, b"DT")?.data;
        out.extend_from_slice(&data[..data.len().min(most.saturating_sub(out.len()))]);
        return Ok(());
    }
    let packed = file.block(at, b"DZ")?.data;
    // Two letters of the kind packed, how (1), one of padding, the row of a transposition (4), bytes unpacked (8), packed (8).
    let (how, columns) = (integer(packed, 2, 1), integer(packed, 4, 4) as usize);
    let size = integer(packed, 8, 8);
    if size > MOST_PACKED {
        return Err(error!(
            CurveFile,
            "byte {at}: a compressed block has more than 64 MiB: save the file without compression"
        ));
    }
    let mut plain = Vec::new();
    let read =
        ZlibDecoder::new(packed.get(24..).unwrap_or_default()).take(size).read_to_end(&mut plain);
    if how > 1 || read.is_err() || plain.len() as u64 != size {
        return Err(error!(
            CurveFile,
            "byte {at}: its compressed block cannot be unpacked: save the file without compression"
        ));
    }
    // Transposed, the first bytes of all rows come first; what fills no row stays as it is.
    if how == 1 && columns > 0 {
        let rows = plain.len() / columns;
        let mut rowwise = plain.clone();
        for (k, byte) in plain[..rows * columns].iter().enumerate() {
            rowwise[k % rows * columns + k / rows] = *byte;
        }
        plain = rowwise;
    }
    plain.truncate(most.saturating_sub(out.len()));
    out.append(&mut plain);
    Ok(())
}
