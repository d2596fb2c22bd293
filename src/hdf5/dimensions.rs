//! Dimension scales: names for the dimensions of datasets, by which xarray and netCDF's tools know
//! them.
//!
//! A dataset tells its dimensions by the attribute `DIMENSION_LIST`, which refers to the datasets
//! that are their scales. hdf5-pure writes no attribute of references. So a dataset is given a
//! text of just the bytes that this attribute needs; when the file is encoded, and the address of
//! every scale known, the message of the text is replaced by that of the references. What they
//! point through, a global heap, is put behind the file's end.
//!
//! HDF5 File Format Specification 3.0: superblock II.A, object headers IV.A.1.b, attribute message
//! IV.A.2.m, global heap III.E. HDF5 Dimension Scale Specification 1.

use super::checksum::lookup3;
use super::{AttrValue, DatasetBuilder};

/// A dataset that names a dimension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Scale(usize);

/// The scales of a file that is being encoded, and how many dimensions they were given to.
#[derive(Debug, Default)]
pub(crate) struct Dimensions {
    names: Vec<String>,
    /// Datasets that have scales.
    attached: usize,
}

/// Why dimensions could not be named.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum DimensionError {
    /// What was put into the file's headers is not found there.
    #[error("{what} of {expected} dimension scales: {found} found in the encoded file")]
    Count {
        what: &'static str,
        /// As many as were put in.
        expected: usize,
        found: usize,
    },
    /// The attribute's text has not the bytes that the references need.
    #[error("the attribute {DIMENSION_LIST} has no room for its references")]
    Room,
    /// The file does not begin with a superblock of version 2 or 3.
    #[error("the file does not begin with a superblock of version 2 or 3")]
    Superblock,
}

/// Attributes of datasets that name dimensions; none is anybody else's.
pub(crate) const ATTRIBUTES: [&str; 4] = [CLASS, NAME, DIMENSION_LIST, "REFERENCE_LIST"];

const CLASS: &str = "CLASS";
const NAME: &str = "NAME";
const DIMENSION_LIST: &str = "DIMENSION_LIST";
/// The value of `CLASS`, which ends with a zero byte.
const SCALE_CLASS: &str = "DIMENSION_SCALE";

/// Texts that stand where numbers and references come: of 16 bytes each.
const REFERENCES_COME: &str = "dimension scales";
const NAME_COMES: &str = "scale ";
const TEXT_BYTES: usize = 16;

/// Bytes of the datatype (a sequence of references), the dataspace (one dimension) and an element
/// of `DIMENSION_LIST`, and of datatype and dataspace of a text.
const LIST_TYPE: [u8; 16] = [0x19, 0, 0, 0, 16, 0, 0, 0, 0x17, 0, 0, 0, 8, 0, 0, 0];
const LIST_SPACE_BYTES: usize = 12;
const ELEMENT_BYTES: usize = 16;
const TEXT_TYPE_BYTES: usize = 8;
const TEXT_SPACE_BYTES: usize = 4;

impl Dimensions {
    /// Makes a dataset of one dimension the scale of that dimension; the name is the dataset's.
    pub(crate) fn scale(&mut self, dataset: &mut DatasetBuilder, name: &str) -> Scale {
        let scale = Scale(self.names.len());
        for (name, value) in self.scale_attributes(name) {
            dataset.set_attr(name, value);
        }
        scale
    }

    /// Gives the dimensions of a dataset their scales.
    pub(crate) fn attach(&mut self, dataset: &mut DatasetBuilder, scales: &[Scale]) {
        let (name, value) = self.list_attribute(scales);
        dataset.set_attr(name, value);
    }

    /// The attributes that make a dataset the next scale.
    fn scale_attributes(&mut self, name: &str) -> [(&'static str, AttrValue); 2] {
        let number = format!("{NAME_COMES}{:010}", self.names.len());
        self.names.push(name.into());
        let width = name.len().max(TEXT_BYTES - 1) + 1;
        let number = format!("{number:<width$}");
        // As wide as the text itself with the zero byte that ends it.
        let class = format!("{SCALE_CLASS}\0");
        [(CLASS, AttrValue::AsciiString(class)), (NAME, AttrValue::AsciiString(number))]
    }

    /// The attribute of a dataset whose dimensions have these scales.
    fn list_attribute(&mut self, scales: &[Scale]) -> (&'static str, AttrValue) {
        self.attached += 1;
        let numbers = scales.iter().map(|scale| format!("{:016}", scale.0));
        let text = [REFERENCES_COME.to_string()].into_iter().chain(numbers).collect();
        (DIMENSION_LIST, AttrValue::AsciiString(text))
    }

    /// Puts the references into an encoded file.
    pub(crate) fn finish(&self, file: &mut Vec<u8>) -> Result<(), DimensionError> {
        let end = file.len() as u64;
        let mut pieces = vec![Piece { at: 0, bytes: std::mem::take(file) }];
        self.finish_pieces(&mut pieces, end)?;
        let mut pieces = pieces.into_iter();
        *file = pieces.next().map(|piece| piece.bytes).unwrap_or_default();
        for piece in pieces {
            file.resize(piece.at as usize, 0);
            file.extend(piece.bytes);
        }
        Ok(())
    }

    /// Puts the references into the pieces of a file that ends at `end` and whose headers they
    /// hold; what comes behind its end is a further piece.
    pub(crate) fn finish_pieces(
        &self,
        pieces: &mut Vec<Piece>,
        end: u64,
    ) -> Result<(), DimensionError> {
        if self.names.is_empty() && self.attached == 0 {
            return Ok(());
        }
        let found = Found::of(pieces, self.names.len());
        let addresses: Vec<u64> = found.scales.iter().copied().flatten().collect();
        for (what, expected, found) in [
            ("addresses", self.names.len(), addresses.len()),
            ("names", self.names.len(), found.names.len()),
            ("lists", self.attached, found.lists.len()),
        ] {
            if expected != found {
                return Err(DimensionError::Count { what, expected, found });
            }
        }
        let start = end.next_multiple_of(8);
        let mut heap = Heap::at(start);
        for (place, scales) in &found.lists {
            let elements: Option<Vec<[u8; ELEMENT_BYTES]>> =
                scales.iter().map(|&k| Some(heap.put(*addresses.get(k)?))).collect();
            let elements = elements.ok_or(DimensionError::Room)?;
            place.message(pieces).put_list(&elements)?;
        }
        for place in &found.classes {
            place.message(pieces).end_with_zero();
        }
        for (place, number) in &found.names {
            place.message(pieces).put_name(&self.names[*number]);
        }
        for header in &found.headers {
            header.seal(&mut pieces[header.piece].bytes);
        }
        let heap = heap.finish();
        set_end(pieces, start + heap.len() as u64)?;
        pieces.push(Piece { at: start, bytes: heap });
        Ok(())
    }
}

/// Bytes of a file from a position on.
#[derive(Debug)]
pub(crate) struct Piece {
    /// Position in the file.
    pub at: u64,
    /// What stands there.
    pub bytes: Vec<u8>,
}

/// What the headers of a file hold of scales.
struct Found {
    headers: Vec<Header>,
    /// Address of each scale by its number.
    scales: Vec<Option<u64>>,
    names: Vec<(Place, usize)>,
    classes: Vec<Place>,
    /// Attributes with the numbers of their scales.
    lists: Vec<(Place, Vec<usize>)>,
}

/// Where an attribute's message stands.
#[derive(Clone, Copy)]
struct Place {
    piece: usize,
    from: usize,
    to: usize,
}

impl Place {
    fn message<'a>(&self, pieces: &'a mut [Piece]) -> Message<'a> {
        Message(&mut pieces[self.piece].bytes[self.from..self.to])
    }
}

impl Found {
    fn of(pieces: &[Piece], scales: usize) -> Self {
        let mut found = Self {
            headers: Vec::new(),
            scales: vec![None; scales],
            names: Vec::new(),
            classes: Vec::new(),
            lists: Vec::new(),
        };
        let finder = memchr::memmem::Finder::new(SIGNATURE);
        for (k, piece) in pieces.iter().enumerate() {
            for at in finder.find_iter(&piece.bytes) {
                if let Some(header) = Header::at(k, &piece.bytes, at) {
                    found.look_into(header, piece);
                }
            }
        }
        found
    }

    fn look_into(&mut self, header: Header, piece: &Piece) {
        let (mut name, mut class, mut is_ours) = (None, None, false);
        for place in header.attributes(&piece.bytes) {
            let Some(attribute) = Attribute::of(&piece.bytes[place.from..place.to]) else {
                continue;
            };
            match attribute.name {
                name if name == CLASS.as_bytes() => class = Some(place),
                text if text == NAME.as_bytes() => {
                    name = number_of(attribute.data).map(|number| (place, number));
                }
                list if list == DIMENSION_LIST.as_bytes() => {
                    let Some(scales) = attribute.scales() else { continue };
                    self.lists.push((place, scales));
                    is_ours = true;
                }
                _ => {}
            }
        }
        if let Some((place, number)) = name
            && let Some(scale) = self.scales.get_mut(number)
        {
            *scale = Some(piece.at + header.from as u64);
            self.names.push((place, number));
            self.classes.extend(class);
            is_ours = true;
        }
        if is_ours {
            self.headers.push(header);
        }
    }
}

/// The number of the scale whose name comes where this text stands.
fn number_of(text: &[u8]) -> Option<usize> {
    let text = std::str::from_utf8(text.get(..TEXT_BYTES)?).ok()?;
    text.strip_prefix(NAME_COMES)?.parse().ok()
}

/// First bytes of an object header of version 2.
const SIGNATURE: &[u8] = b"OHDR";
/// Type of the message that holds an attribute.
const ATTRIBUTE: u8 = 0x0c;

/// The first chunk of an object header.
struct Header {
    piece: usize,
    from: usize,
    messages: usize,
    /// Where its checksum stands.
    to: usize,
    /// Bytes before the data of a message.
    prefix: usize,
}

impl Header {
    /// The header that stands at `from`, if one does: its checksum tells.
    fn at(piece: usize, bytes: &[u8], from: usize) -> Option<Self> {
        let flags = *bytes.get(from + 5)?;
        if bytes[from + 4] != 2 {
            return None;
        }
        let times = if flags & 0x20 != 0 { 16 } else { 0 };
        let counts = if flags & 0x10 != 0 { 4 } else { 0 };
        let size_at = from + 6 + times + counts;
        let width = 1usize << (flags & 3);
        let size = bytes.get(size_at..size_at + width)?;
        let size = size.iter().rev().fold(0usize, |size, &b| size << 8 | usize::from(b));
        let messages = size_at + width;
        let to = messages.checked_add(size)?;
        let stored = bytes.get(to..to.checked_add(4)?)?;
        let is_whole = lookup3(&bytes[from..to]).to_le_bytes() == stored;
        let prefix = if flags & 4 != 0 { 6 } else { 4 };
        is_whole.then_some(Self { piece, from, messages, to, prefix })
    }

    /// Where the attributes stand.
    fn attributes(&self, bytes: &[u8]) -> Vec<Place> {
        let (mut places, mut at) = (Vec::new(), self.messages);
        while at + self.prefix <= self.to {
            let size = usize::from(u16::from_le_bytes([bytes[at + 1], bytes[at + 2]]));
            let from = at + self.prefix;
            if from + size > self.to {
                break;
            }
            if bytes[at] == ATTRIBUTE {
                places.push(Place { piece: self.piece, from, to: from + size });
            }
            at = from + size;
        }
        places
    }

    fn seal(&self, bytes: &mut [u8]) {
        let sum = lookup3(&bytes[self.from..self.to]);
        bytes[self.to..self.to + 4].copy_from_slice(&sum.to_le_bytes());
    }
}

/// Bytes of an attribute's message before its name, by its version; version 1 has other paddings.
fn bytes_before_name(version: u8) -> Option<usize> {
    match version {
        2 => Some(8),
        3 => Some(9),
        _ => None,
    }
}

/// An attribute as its message holds it.
struct Attribute<'a> {
    name: &'a [u8],
    data: &'a [u8],
}

impl<'a> Attribute<'a> {
    fn of(message: &'a [u8]) -> Option<Self> {
        let name_at = bytes_before_name(*message.first()?)?;
        let size = |at: usize| {
            Some(usize::from(u16::from_le_bytes([*message.get(at)?, *message.get(at + 1)?])))
        };
        let behind_name = name_at + size(2)?;
        let name = message.get(name_at..behind_name.checked_sub(1)?)?;
        let data = message.get(behind_name + size(4)? + size(6)?..)?;
        Some(Self { name, data })
    }

    /// The numbers of the scales, if this is a text that waits for its references.
    fn scales(&self) -> Option<Vec<usize>> {
        let numbers = self.data.strip_prefix(REFERENCES_COME.as_bytes())?;
        let number = |text: &[u8]| std::str::from_utf8(text).ok()?.parse().ok();
        numbers.chunks(TEXT_BYTES).map(number).collect()
    }
}

/// The message of an attribute that is changed; it keeps its size.
struct Message<'a>(&'a mut [u8]);

impl Message<'_> {
    /// Where the datatype begins.
    fn behind_name(&self) -> usize {
        // Others are not found.
        let name_at = bytes_before_name(self.0[0]).unwrap_or_default();
        name_at + usize::from(u16::from_le_bytes([self.0[2], self.0[3]]))
    }

    /// Makes the text a list of references.
    fn put_list(self, elements: &[[u8; ELEMENT_BYTES]]) -> Result<(), DimensionError> {
        let from = self.behind_name();
        let mut list = LIST_TYPE.to_vec();
        // Version 2, one dimension, no largest size, simple.
        list.extend([2, 1, 0, 1]);
        list.extend((elements.len() as u64).to_le_bytes());
        list.extend(elements.iter().flatten());
        if self.0.len() != from + list.len() {
            return Err(DimensionError::Room);
        }
        self.0[4..6].copy_from_slice(&(LIST_TYPE.len() as u16).to_le_bytes());
        self.0[6..8].copy_from_slice(&(LIST_SPACE_BYTES as u16).to_le_bytes());
        self.0[from..].copy_from_slice(&list);
        Ok(())
    }

    /// Says of a text that a zero byte ends it, as the scales' specification asks for.
    fn end_with_zero(self) {
        // The first four bits behind class and version are the padding.
        let padding = self.behind_name() + 1;
        self.0[padding] &= 0xf0;
    }

    /// Puts a name in the place of its number.
    fn put_name(self, name: &str) {
        let from = self.behind_name() + TEXT_TYPE_BYTES + TEXT_SPACE_BYTES;
        let text = &mut self.0[from..];
        text.fill(0);
        text[..name.len()].copy_from_slice(name.as_bytes());
        self.end_with_zero();
    }
}

/// Objects that one collection of a global heap can number.
const MAX_OBJECTS: usize = 60_000;
/// Bytes that a collection has at least.
const MIN_COLLECTION: usize = 4096;
/// Bytes of a collection before its objects, of an object before its data, and of an address.
const COLLECTION_HEAD: usize = 16;
const OBJECT_HEAD: usize = 16;
const ADDRESS_BYTES: usize = 8;

/// A global heap of addresses, as collections one behind the other.
struct Heap {
    start: u64,
    done: Vec<u8>,
    /// Addresses of the collection that is being filled.
    open: Vec<u64>,
}

impl Heap {
    fn at(start: u64) -> Self {
        Self { start, done: Vec::new(), open: Vec::new() }
    }

    /// Holds an address; gives the element of `DIMENSION_LIST` that points to it.
    fn put(&mut self, address: u64) -> [u8; ELEMENT_BYTES] {
        if self.open.len() == MAX_OBJECTS {
            self.close();
        }
        self.open.push(address);
        let mut element = [0; ELEMENT_BYTES];
        element[..4].copy_from_slice(&1u32.to_le_bytes());
        let collection = self.start + self.done.len() as u64;
        element[4..12].copy_from_slice(&collection.to_le_bytes());
        element[12..].copy_from_slice(&(self.open.len() as u32).to_le_bytes());
        element
    }

    fn close(&mut self) {
        let objects = self.open.len() * (OBJECT_HEAD + ADDRESS_BYTES);
        // Free space follows, which has a head of its own.
        let size = (COLLECTION_HEAD + objects + OBJECT_HEAD).max(MIN_COLLECTION);
        let mut collection = b"GCOL\x01\0\0\0".to_vec();
        collection.extend((size as u64).to_le_bytes());
        for (k, address) in self.open.drain(..).enumerate() {
            collection.extend((k as u16 + 1).to_le_bytes());
            collection.extend([1, 0, 0, 0, 0, 0]);
            collection.extend((ADDRESS_BYTES as u64).to_le_bytes());
            collection.extend(address.to_le_bytes());
        }
        let free = size - collection.len();
        collection.extend([0; 8]);
        collection.extend((free as u64).to_le_bytes());
        collection.resize(size, 0);
        self.done.extend(collection);
    }

    fn finish(mut self) -> Vec<u8> {
        if !self.open.is_empty() {
            self.close();
        }
        self.done
    }
}

/// Where a superblock of version 2 or 3 holds the file's end and its own checksum.
const END_AT: usize = 28;
const SUPERBLOCK_SUM_AT: usize = 44;

/// Tells the superblock where the file ends.
fn set_end(pieces: &mut [Piece], end: u64) -> Result<(), DimensionError> {
    let first = pieces.first_mut().filter(|piece| piece.at == 0);
    let bytes = first.map(|piece| &mut piece.bytes).ok_or(DimensionError::Superblock)?;
    let is_known = bytes.starts_with(b"\x89HDF\r\n\x1a\n")
        && bytes.len() >= SUPERBLOCK_SUM_AT + 4
        && [2, 3].contains(&bytes[8]);
    if !is_known {
        return Err(DimensionError::Superblock);
    }
    bytes[END_AT..END_AT + 8].copy_from_slice(&end.to_le_bytes());
    let sum = lookup3(&bytes[..SUPERBLOCK_SUM_AT]);
    bytes[SUPERBLOCK_SUM_AT..SUPERBLOCK_SUM_AT + 4].copy_from_slice(&sum.to_le_bytes());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hdf5::{File, FileBuilder};

    /// Times, three nodes, and a table of both.
    fn encoded(dimensions: &mut Dimensions) -> Vec<u8> {
        let mut file = FileBuilder::new();
        let time = file.create_dataset("time");
        let t = dimensions.scale(time.with_f64_data(&[0.0, 0.5]), "time");
        let node = file.create_dataset("a rather long name of nodes");
        let n = dimensions.scale(node.with_i64_data(&[7, 8, 9]), "a rather long name of nodes");
        let table = file.create_dataset("table");
        table.with_f64_data(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).with_shape(&[2, 3]);
        dimensions.attach(table, &[t, n]);
        file.finish().unwrap()
    }

    /// What the attributes of all headers hold: address, name and data.
    fn attributes(bytes: &[u8]) -> Vec<(u64, String, Vec<u8>)> {
        let mut found = Vec::new();
        for at in memchr::memmem::find_iter(bytes, SIGNATURE) {
            let Some(header) = Header::at(0, bytes, at) else { continue };
            for Place { from, to, .. } in header.attributes(bytes) {
                let attribute = Attribute::of(&bytes[from..to]).unwrap();
                let name = String::from_utf8(attribute.name.to_vec()).unwrap();
                found.push((at as u64, name, attribute.data.to_vec()));
            }
        }
        found
    }

    #[test]
    fn references_lead_to_the_scales() {
        let mut dimensions = Dimensions::default();
        let mut bytes = encoded(&mut dimensions);
        dimensions.finish(&mut bytes).unwrap();
        let all = attributes(&bytes);
        let named = |text: &str| {
            let is_named = |data: &[u8]| data.starts_with(text.as_bytes()) && data[text.len()] == 0;
            all.iter().find(|(_, name, data)| name == NAME && is_named(data)).unwrap().0
        };
        let (_, _, list) = all.iter().find(|(_, name, _)| name == DIMENSION_LIST).unwrap();
        let addresses: Vec<u64> = list
            .chunks(ELEMENT_BYTES)
            .map(|element| {
                let number =
                    |at: usize| u64::from_le_bytes(element[at..at + 8].try_into().unwrap());
                let (heap, object) = (number(4) as usize, element[12] as usize);
                assert_eq!(&bytes[heap..heap + 4], b"GCOL");
                let size = OBJECT_HEAD + ADDRESS_BYTES;
                let at = heap + COLLECTION_HEAD + (object - 1) * size + OBJECT_HEAD;
                u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap())
            })
            .collect();
        assert_eq!(addresses, [named("time"), named("a rather long name of nodes")]);
        // The values are what they were.
        let file = File::from_bytes(bytes).unwrap();
        assert_eq!(file.dataset("table").unwrap().read_f64().unwrap()[4], 5.0);
        let class = file.dataset("time").unwrap().attrs().unwrap();
        assert_eq!(class[CLASS].as_str(), Some(SCALE_CLASS));
    }

    #[test]
    fn what_is_not_found_is_an_error() {
        let mut dimensions = Dimensions::default();
        let mut bytes = encoded(&mut dimensions);
        // Another scale and dataset that are not in the file.
        dimensions.scale(FileBuilder::new().create_dataset("x"), "x");
        let error = dimensions.finish(&mut bytes.clone()).unwrap_err();
        assert_eq!(
            error.to_string(),
            "addresses of 3 dimension scales: 2 found in the encoded file"
        );
        let mut dimensions = Dimensions::default();
        let mut two = encoded(&mut dimensions);
        // A header that is there twice: which one is meant?
        two.extend_from_within(..);
        assert!(matches!(dimensions.finish(&mut two), Err(DimensionError::Count { .. })));
        let mut dimensions = Dimensions::default();
        encoded(&mut dimensions);
        bytes[8] = 0;
        assert_eq!(dimensions.finish(&mut bytes), Err(DimensionError::Superblock));
    }

    #[test]
    fn a_heap_of_many_references_has_several_collections() {
        let mut heap = Heap::at(4096);
        let elements: Vec<[u8; ELEMENT_BYTES]> =
            (0..MAX_OBJECTS as u64 + 2).map(|k| heap.put(k * 8)).collect();
        let bytes = heap.finish();
        for k in [0, 1, MAX_OBJECTS - 1, MAX_OBJECTS, MAX_OBJECTS + 1] {
            let element = &elements[k];
            let start = u64::from_le_bytes(element[4..12].try_into().unwrap()) as usize - 4096;
            let object = u32::from_le_bytes(element[12..].try_into().unwrap()) as usize;
            let at = start + COLLECTION_HEAD + (object - 1) * (OBJECT_HEAD + ADDRESS_BYTES);
            assert_eq!(&bytes[at..at + 2], (object as u16).to_le_bytes());
            let address = &bytes[at + OBJECT_HEAD..at + OBJECT_HEAD + ADDRESS_BYTES];
            assert_eq!(address, (k as u64 * 8).to_le_bytes());
        }
    }
}
