//! Targets of the readers: any bytes give a result.

use crumple::solver::{Selection, read_from};

pub fn target(format: &'static str, bytes: &[u8]) {
    // One selection each, recognised by the input, so that an execution is one reading.
    let selection = match bytes.last().map_or(0, |last| last % 4) {
        0 | 1 => Selection::all(),
        2 => Selection::nothing(),
        _ => Selection {
            ids: ["1", "7", "3:surfa"].map(|id| id.parse().ok()).into_iter().collect(),
            ..Selection::all()
        },
    };
    for file in read_from(format, &[Box::new(bytes.to_vec())], &selection).unwrap() {
        for history in &file.histories {
            assert_eq!(history.values.len(), file.time.len());
        }
    }
}
