//! Problems: damage found in a file, as values in the result of reading it.

use std::fmt;

use serde::Serialize;

use crate::history::time_gaps;

/// Problems kept per file, and of one kind; further ones are counted only.
const MAX_KEPT: usize = 200;
const MOST_ALIKE: usize = 20;

/// Kinds of damage. The names in snake case are the codes in JSON.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ProblemCode {
    /// A state is not whole: its rows are left out of every history.
    IncompleteState,
    /// A line ends or is damaged within its columns; it is left out.
    BadLine,
    /// A field holds stars; its value is NaN.
    OverflowedField,
    /// A field holds `NaN`, `Infinity` or a number beyond a double; it is returned as such.
    NotFinite,
    /// A field holds no number; its value is NaN.
    BadField,
    /// A row of an entity that the first state does not have; it is left out.
    UnexpectedEntity,
    /// Entities are missing from some states (erosion, failure); their values there are NaN.
    AbsentEntity,
    /// A component is missing from some states; its values there are NaN.
    AbsentComponent,
    /// A binary record that the end of the file cuts.
    CutRecord,
    /// A binary record that makes no sense; it or what follows is left out.
    BadRecord,
    /// States that a restart wrote again; the last ones are kept.
    RepeatedState,
    /// A label that a state already has; its first value is kept.
    RepeatedLabel,
    /// A single state's time is before the one of the state above it; the order of the file
    /// is kept.
    TimeGoesBack,
    /// An interval without a state, far longer than those around it; nothing is put there.
    TimeGap,
    /// Values that are zero between others that are not: the file was overwritten there, or
    /// the quantity really vanished. They are returned as they are.
    SuspectZeros,
    /// Rows of a layout that is not read.
    UnreadRows,
    /// The second line is not LS-DYNA's version line.
    NoVersionLine,
    /// More problems than are listed.
    MoreProblems,
}

/// One problem and its place.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Problem {
    /// Its kind.
    pub code: ProblemCode,
    /// Name of the file that holds the place, where it continues the one that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Line, counted from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<u64>,
    /// Offset in the file of the line's first byte.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub byte: Option<u64>,
    /// First and last column, counted from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub columns: Option<[usize; 2]>,
    /// What was expected and found, without the place.
    pub message: String,
    /// Number of `file` among those that are read together, 0 for the first.
    #[serde(skip)]
    pub(in crate::solver) part: usize,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(line) = self.line {
            write!(f, "line {line}")?;
            if let Some([from, to]) = self.columns {
                write!(f, ", columns {from}-{to}")?;
            }
            write!(f, ": ")?;
        } else if let Some(byte) = self.byte {
            if let Some(file) = &self.file {
                write!(f, "{file}, ")?;
            }
            write!(f, "byte {byte}: ")?;
        }
        f.write_str(&self.message)
    }
}

impl Problem {
    /// A problem without a place.
    pub(in crate::solver) fn new(code: ProblemCode, message: String) -> Self {
        Self::at(code, None, message)
    }

    pub(in crate::solver) fn at_place(self, place: Option<Place>) -> Self {
        let columns = self.columns;
        Self { columns, ..Self::at(self.code, place, self.message) }
    }

    pub(in crate::solver) fn at(code: ProblemCode, place: Option<Place>, message: String) -> Self {
        let line = place.map(|p| p.line).filter(|&line| line > 0);
        let part = place.map_or(0, |p| p.part);
        let byte = place.map(|p| p.byte);
        Self { code, file: None, line, byte, columns: None, message, part }
    }
}

/// Gaps listed of one file; of more the rest is counted.
const MAX_GAPS: usize = 20;

/// The holes in a file's times.
pub(in crate::solver) fn of_time(time: &[f64]) -> Vec<Problem> {
    let gaps = time_gaps(time);
    let more = gaps.len().saturating_sub(MAX_GAPS);
    let listed = gaps.iter().take(MAX_GAPS);
    let mut problems: Vec<Problem> =
        listed.map(|gap| Problem::new(ProblemCode::TimeGap, gap.to_string())).collect();
    if more > 0 {
        let message = format!("{more} further intervals without a state are not listed");
        problems.push(Problem::new(ProblemCode::MoreProblems, message));
    }
    problems
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    /// Counted from 1; 0 in a binary file.
    pub line: u64,
    pub byte: u64,
    /// Which of the files that are read together, 0 for the first.
    pub part: usize,
}

impl Place {
    /// A place in one of the binary files that are read together, which have no lines.
    pub(crate) fn in_part(part: usize, byte: u64) -> Self {
        Self { line: 0, byte, part }
    }
}

/// Collects problems up to a bound.
#[derive(Debug, Default)]
pub(crate) struct Diagnostics {
    kept: Vec<Problem>,
    dropped: usize,
}

impl Diagnostics {
    pub(crate) fn add(&mut self, code: ProblemCode, place: Option<Place>, message: String) {
        self.push(Problem::at(code, place, message));
    }

    pub(crate) fn add_in_columns(
        &mut self,
        code: ProblemCode,
        place: Option<Place>,
        columns: Option<[usize; 2]>,
        message: String,
    ) {
        self.push(Problem { columns, ..Problem::at(code, place, message) });
    }

    pub(crate) fn push(&mut self, problem: Problem) {
        // What every state has must not hide what one has.
        let alike = self.kept.iter().filter(|kept| kept.code == problem.code).count();
        if self.kept.len() < MAX_KEPT && alike < MOST_ALIKE {
            self.kept.push(problem);
        } else {
            self.dropped += 1;
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.kept.is_empty()
    }

    /// Adds the problems of another list after these.
    pub(crate) fn append(&mut self, other: Self) {
        self.dropped += other.dropped;
        self.extend(other.kept);
    }

    pub(crate) fn into_list(mut self) -> Vec<Problem> {
        if self.dropped > 0 {
            let message = format!("{} further problems are not listed", self.dropped);
            self.kept.push(Problem::new(ProblemCode::MoreProblems, message));
        }
        self.kept
    }
}

impl Extend<Problem> for Diagnostics {
    fn extend<T: IntoIterator<Item = Problem>>(&mut self, problems: T) {
        problems.into_iter().for_each(|problem| self.push(problem));
    }
}
