//! Fuzz target of the reader that the binary is named after: any bytes give a result.
#![no_main]

use crumple::solver::{Selection, read_from};
use libfuzzer_sys::fuzz_target;

const FORMAT: &str = env!("CARGO_BIN_NAME");

fuzz_target!(|bytes: &[u8]| {
    // One selection each, told by the input, so that an execution is one reading.
    let selection = match bytes.last().map_or(0, |last| last % 4) {
        0 | 1 => Selection::all(),
        2 => Selection::nothing(),
        _ => Selection {
            ids: ["1", "7", "3:surfa"].map(|id| id.parse().ok()).into_iter().collect(),
            ..Selection::all()
        },
    };
    for file in read_from(FORMAT, &[Box::new(bytes.to_vec())], &selection).unwrap() {
        for history in &file.histories {
            assert_eq!(history.values.len(), file.time.len());
        }
    }
});
