//! A text file and the binary file beside it that should hold the same.

use super::files::{Located, shown_name};
use crate::curve::extract::Notes;
use crate::history::History;
use crate::solver::{self, Selection, SolverFile, WantedId};

/// Text and binary of one run agree up to the text's digits.
const SAME_VALUE: f64 = 1e-5;

/// Which of text file and binout was read, and whether they differ.
pub(super) fn compare_twin(file: &Located, read: &SolverFile) -> Notes {
    let mut remarks = Notes::default();
    let name = &file.file;
    if let Some(section) = &file.section {
        remarks.note(format!("{name}: read from section {section} of {}", shown_name(&file.path)));
    }
    let Some((path, section)) = &file.twin else { return remarks };
    let selection = same_histories(read, section);
    match solver::read(path, None, &selection) {
        Ok(twin) if is_same(read, &twin) => remarks
            .note(format!("{name}: section {section} of {} agrees with it", shown_name(path))),
        Ok(_) => remarks.warn(format!(
            "{name} and section {section} of {} differ; the text file was used",
            shown_name(path)
        )),
        Err(error) => {
            remarks.warn(format!("{name}: the binary file beside it cannot be compared: {error}"));
        }
    }
    remarks
}

fn same_histories(read: &SolverFile, section: &str) -> Selection {
    let ids = read.histories.iter().filter_map(|h| h.entity);
    Selection {
        ids: Some(ids.map(|e| WantedId { id: e.id, side: e.side }).collect()),
        components: Some(read.histories.iter().map(|h| h.component.to_string()).collect()),
        section: Some(section.into()),
        ..Selection::all()
    }
}

fn is_same(read: &SolverFile, twin: &SolverFile) -> bool {
    let has = |a: &History| {
        twin.history(a.entity, &a.component).is_some_and(|b| is_alike(&a.values, &b.values))
    };
    is_alike(&read.time, &twin.time) && read.histories.iter().all(has)
}

/// Whether two columns are the same up to the digits of text files.
pub(crate) fn is_alike(a: &[f64], b: &[f64]) -> bool {
    let finite = a.iter().filter(|v| v.is_finite());
    let largest = finite.fold(0.0, |m: f64, v| m.max(v.abs()));
    // A number that is not there must not be there in the other either.
    let differ =
        |a: f64, b: f64| (a - b).abs() > SAME_VALUE * largest || a.is_finite() != b.is_finite();
    a.len() == b.len() && !a.iter().zip(b).any(|(a, b)| differ(*a, *b))
}
