//! The numbers of a law as the C sources hold them (c/table.h): the block of a ready binary, and a C
//! file.

use crate::error::{Error, error};
use crate::multibody::{ForceLaw, StoredBy};
use std::fmt::Write;

/// Begins the block. `c/blank.c` has the same, and a test compares the rest of the layout.
const MARK: &[u8; 16] = b"CRUMPLE TABLE 1\0";
const VERSION: u32 = 2;
const POINTS: usize = 4096;
const SHAPE: usize = 1024;
const TOKEN: usize = 64;
const HAS_MEMORY: u32 = 1;
const BY_MEAN_FORCE: u32 = 2;

/// Bytes before the numbers: mark, sum, six counts, token.
const HEAD: usize = 16 + 8 + 6 * 4 + TOKEN;
/// Bytes of the block.
const SIZE: usize = HEAD + 8 * (3 + 4 * POINTS + 3 * SHAPE);

/// A checked table.
pub(super) struct Table {
    points: u32,
    shape_points: u32,
    flags: u32,
    token: [u8; TOKEN],
    /// Stiffness, its scale, largest share.
    numbers: [f64; 3],
    /// Deflection, force, slope, work.
    envelope: [Vec<f64>; 4],
    /// Length, force, rest.
    shape: [Vec<f64>; 3],
}

impl Table {
    pub(super) fn new(law: &ForceLaw, token: &str) -> Result<Self, Error> {
        let (envelope, shape) = (&law.envelope, &law.shape);
        let deflection_m = envelope.deflection_m();
        let (points, shape_points) = (deflection_m.len(), shape.length.len());
        if points > POINTS {
            return Err(error!(
                Export,
                "an FMU holds at most {POINTS} points of a curve, found {points}"
            ));
        }
        if shape_points > SHAPE {
            return Err(error!(
                Export,
                "an FMU holds at most {SHAPE} points of an unloading branch, found {shape_points}"
            ));
        }
        let (flags, numbers) = match &law.memory {
            // Never read, but no divisor should be 0.
            None => (0, [1.0, 1.0, 0.5]),
            Some(memory) => (
                HAS_MEMORY
                    | if memory.stored_by == StoredBy::MeanForce { BY_MEAN_FORCE } else { 0 },
                [memory.stiffness_n_per_m, memory.scale, memory.largest_share],
            ),
        };
        let [force, slope, work] =
            [envelope.force_n(), &law.slope_n_per_m, envelope.work_j()].map(<[f64]>::to_vec);
        let checks = [
            ("stiffness", &numbers[..]),
            ("force", &force),
            ("slope", &slope),
            ("work", &work),
            ("unloading branch", &shape.rest),
        ];
        for (what, values) in checks {
            if values.iter().any(|v| !v.is_finite()) {
                return Err(error!(Export, "the curve's {what} is not a finite number"));
            }
        }
        let mut bytes = [0; TOKEN];
        // One byte stays 0.
        for (to, from) in bytes[..TOKEN - 1].iter_mut().zip(token.bytes()) {
            *to = from;
        }
        Ok(Self {
            // Both are below 5000.
            points: points as u32,
            shape_points: shape_points as u32,
            flags,
            token: bytes,
            numbers,
            envelope: [deflection_m.to_vec(), force, slope, work],
            shape: [&shape.length, &shape.force, &shape.rest].map(Vec::clone),
        })
    }

    /// Columns with the room that the block has for each.
    fn columns(&self) -> impl Iterator<Item = (&Vec<f64>, usize)> {
        let envelope = self.envelope.iter().map(|column| (column, POINTS));
        envelope.chain(self.shape.iter().map(|column| (column, SHAPE)))
    }

    /// As `crumple_table_sum` in c/sum.c: detects a damaged table.
    fn sum(&self) -> u64 {
        let mix = |sum: u64, word: u64| {
            let sum = (sum ^ word).wrapping_mul(0x9E37_79B9_7F4A_7C15);
            sum ^ (sum >> 29)
        };
        let counts = [self.points, self.shape_points, self.flags].map(u64::from);
        let token = self.token.iter().map(|byte| u64::from(*byte));
        let numbers = self.numbers.iter().chain(self.columns().flat_map(|(column, _)| column));
        let words = counts.into_iter().chain(token).chain(numbers.map(|number| number.to_bits()));
        words.fold(u64::from(VERSION), mix).max(1)
    }

    /// The block of a ready binary.
    pub(super) fn bytes(&self) -> Vec<u8> {
        let mut block = Vec::with_capacity(SIZE);
        block.extend(MARK);
        block.extend(self.sum().to_le_bytes());
        let room = [POINTS as u32, SHAPE as u32];
        for count in [VERSION, room[0], room[1], self.points, self.shape_points, self.flags] {
            block.extend(count.to_le_bytes());
        }
        block.extend(self.token);
        block.extend(self.numbers.iter().flat_map(|number| number.to_le_bytes()));
        for (column, room) in self.columns() {
            block.extend(column.iter().flat_map(|number| number.to_le_bytes()));
            block.resize(block.len() + 8 * (room - column.len()), 0);
        }
        block
    }

    /// A ready binary with this table in its block.
    pub(super) fn written_into(
        &self,
        binary: &[u8],
        platform: &'static str,
    ) -> Result<Vec<u8>, Error> {
        let no_place = error!(Export, "the FMU binary of {platform} has no place for a curve");
        let mut found = memchr::memmem::find_iter(binary, MARK);
        let (Some(at), None) = (found.next(), found.next()) else { return Err(no_place) };
        let block = self.bytes();
        // The version and the capacity are those of the blank block.
        let layout = 24..36;
        let is_fit = binary.get(at + layout.start..at + layout.end) == block.get(layout)
            && binary.len() >= at + block.len();
        if !is_fit {
            return Err(no_place);
        }
        let mut with = binary.to_vec();
        with.splice(at..at + block.len(), block);
        Ok(with)
    }

    /// The table as a C file. Shortest decimal numbers, which every compiler reads back as the
    /// same double.
    pub(super) fn source(&self) -> String {
        let mut c = String::from(
            "/* The curve of this FMU, written by crumple; see table.h. */\n#include \"table.h\"\n\n\
             const crumple_table_t crumple_table = {\n",
        );
        let token: String =
            self.token.iter().take_while(|b| **b != 0).map(|b| *b as char).collect();
        // Writing to a string cannot fail.
        let _ = write!(
            c,
            "    \"CRUMPLE TABLE 1\",\n    {}u,\n    CRUMPLE_TABLE_VERSION,\n    CRUMPLE_POINTS,\n    \
             CRUMPLE_SHAPE,\n    {},\n    {},\n    {},\n    \"{token}\",\n",
            self.sum(),
            self.points,
            self.shape_points,
            self.flags,
        );
        for number in self.numbers {
            let _ = writeln!(c, "    {number:e},");
        }
        for (column, _) in self.columns() {
            c.push_str("    {\n");
            for number in column {
                let _ = writeln!(c, "        {number:e},");
            }
            c.push_str("    },\n");
        }
        c.push_str("};\n");
        c
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::Envelope;
    use crate::multibody::{EnvelopeEnd, Unloading};

    fn table() -> Table {
        let envelope = Envelope::new(vec![0.0, 0.1, 0.5], vec![0.0, 1e6, 0.6e6]).unwrap();
        let law = ForceLaw::new(envelope, Unloading::Elastic, EnvelopeEnd::Hold);
        Table::new(&law, "{token}").unwrap()
    }

    #[test]
    fn the_block_has_the_layout_of_the_header() {
        let header = super::super::TABLE_HEADER;
        for (name, value) in [("VERSION", VERSION as usize), ("POINTS", POINTS), ("SHAPE", SHAPE)] {
            let found = header.lines().filter(|l| l.starts_with("#define"));
            assert!(found.clone().any(|l| l.ends_with(&format!("{name} {value}"))), "{name}");
        }
        assert_eq!(table().bytes().len(), SIZE);
        assert!(super::super::BINARIES.iter().all(|b| b.bytes.len() > SIZE));
    }

    #[test]
    fn a_binary_without_one_block_is_refused() {
        let table = table();
        let mut blank = vec![7; 10];
        blank.extend(table.bytes());
        let with = table.written_into(&blank, "x").unwrap();
        assert_eq!(with, blank);
        for wrong in [vec![7; SIZE], blank[..SIZE].to_vec(), [blank.clone(), blank].concat()] {
            let error = table.written_into(&wrong, "x").unwrap_err();
            assert_eq!(error.to_string(), "the FMU binary of x has no place for a curve");
        }
    }
}
