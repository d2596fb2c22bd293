//! The frame shared by all LS-DYNA ASCII readers: header, legend, then the body of the file.
//!
//! # How states of a text file are found
//!
//! This module reads header and legend, and passes every other line to the `Body` of the file. The body recognises
//! lines and says where their fields are. `solver/states` collects rows into states, parses only the selected
//! fields, and decides whether a state is complete. A body never counts lines, because the number of blank lines
//! differs between versions.
//!
//! - A state begins when the time changes, or when the entity of a row is already present. (Times have six digits, so two
//!   states may print the same one.)
//! - A row without labels must have the width that its id requires. So a row that is cut or shifted cannot pass for
//!   another number.
//! - In rows with labels (`label_values`), a number is the text between its label and the next one. It must be complete;
//!   labels and widths may differ between releases.
//! - A legend that is not closed ends at the first line of the body.

use std::collections::{HashMap, HashSet};
use std::io;

use super::leap::Leaps;
use super::line::{Line, Lines, legend_entry, version};
use crate::solver::problem::ProblemCode;
use crate::solver::source::{self, Source, Stream};
use crate::solver::states::StateReader;
use crate::solver::{Format, NoDataReason, Selection, SolverFile, WithoutData};

/// Names of tables, for messages, each with its components.
pub(crate) type Tables = &'static [(&'static str, &'static [&'static str])];

/// What one kind of file adds to the frame: the meaning of its lines.
pub(crate) trait Body: CloneBody {
    /// Tables of every file of the kind, known by their order.
    fn tables(&self) -> Tables {
        &[]
    }

    fn has_empty_states(&self) -> bool {
        false
    }

    /// Whether a state begins only where its time, or its cycle, is another one.
    fn is_by_time(&self) -> bool {
        false
    }

    /// Whether lines between the first and the last row need not be read where none of them is wanted.
    fn may_skip(&self) -> bool {
        false
    }

    /// What a line holds, for the message about one that holds something else.
    fn expected(&self) -> &'static str {
        ""
    }

    /// Whether a line that is not the format's signature can only be below the header.
    fn is_signature(&self, _line: &[u8]) -> bool {
        false
    }

    /// One line below the header that is not blank, outside a legend, with its line end; `None` if it is
    /// not what is expected.
    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()>;

    /// A blank line below the header.
    fn blank(&mut self, _states: &mut StateReader<'_>) {}

    /// A damaged line was left out: what was begun before it cannot continue after it.
    fn interrupt(&mut self) {}

    /// The file ends within `line`: ends the pending state if the line cannot belong to it.
    fn unfinished(&mut self, _line: &Line<'_>, _states: &mut StateReader<'_>) {}

    /// The end of the file.
    fn end(&mut self, _states: &mut StateReader<'_>) {}

    /// The state above, which was read by its layout, has this cycle.
    fn continue_cycle(&mut self, _cycle: &[u8]) {}
}

/// Copies a body whose type the frame does not know: the frame is compiled once, not once per kind of file.
pub(crate) trait CloneBody {
    fn copied(&self) -> Box<dyn Body>;
}

impl<B: Body + Clone + 'static> CloneBody for B {
    fn copied(&self) -> Box<dyn Body> {
        Box::new(self.clone())
    }
}

/// The body of a kind of file before its first line.
pub(crate) fn boxed<B: Body + Default + 'static>() -> Box<dyn Body> {
    Box::<B>::default()
}

/// Header, legend and states of a file, while it is read.
pub(crate) struct AsciiReader<'a> {
    pub format: &'static Format,
    pub source: &'a dyn Source,
    pub lines: Lines<Stream<'a>>,
    pub states: StateReader<'a>,
    in_legend: bool,
    legend: Vec<(i64, Option<String>)>,
    title: Option<String>,
    version: Option<String>,
    /// Whether the line above is the title once more: a restart has put a header below the states before it.
    is_title_again: bool,
}

/// Longest line of a header or legend; real ones have at most 94 columns.
const MAX_HEADER_LINE: usize = 132;
/// Entries kept of a legend; real ones have one per entity.
const MAX_LEGEND: usize = 2_000_000;
/// Leading states that may be too damaged to show the entities.
const MAX_SKIPPED: usize = 3;

/// Reads a whole file.
///
/// The first complete state determines which entities a state has. If more states disagree with it
/// than agree, it is the damaged one: the file is read again without it.
pub(crate) fn read(
    format: &'static Format,
    body: &dyn Body,
    source: &dyn Source,
    selection: &Selection,
) -> io::Result<SolverFile> {
    let (mut best, mut is_disputed) = read_from_state(0, format, body, source, selection)?;
    for skipped in 1..=MAX_SKIPPED {
        if !is_disputed {
            break;
        }
        let (next, disputed) = read_from_state(skipped, format, body, source, selection)?;
        if next.time.len() > best.time.len() {
            (best, is_disputed) = (next, disputed);
        }
    }
    Ok(best)
}

/// The file after the first `skipped` complete states, and whether more states disagree with the first
/// complete one than agree.
fn read_from_state(
    skipped: usize,
    format: &'static Format,
    body: &dyn Body,
    source: &dyn Source,
    selection: &Selection,
) -> io::Result<(SolverFile, bool)> {
    let mut frame = AsciiReader::new(format, body, source, selection);
    frame.states.skip = skipped;
    let (mut body, mut leaps) = (body.copied(), Leaps::default());
    while frame.step(&mut *body)? {
        leaps.leap(&mut frame, &mut body)?;
    }
    let is_disputed = frame.states.is_disputed();
    Ok((frame.finish(&mut *body), is_disputed))
}

impl<'a> AsciiReader<'a> {
    pub(crate) fn new(
        format: &'static Format,
        body: &dyn Body,
        source: &'a dyn Source,
        selection: &'a Selection,
    ) -> Self {
        let mut states = StateReader::new(selection);
        states.allow_empty_states = body.has_empty_states();
        for (name, components) in body.tables() {
            states.table(name, *components);
        }
        Self {
            format,
            source,
            lines: Lines::new(Stream::new(source)),
            states,
            in_legend: false,
            legend: Vec::new(),
            title: None,
            version: None,
            is_title_again: false,
        }
    }

    pub(crate) fn step(&mut self, body: &mut dyn Body) -> io::Result<bool> {
        let Some(line) = self.lines.next_line()? else { return Ok(false) };
        let states = &mut self.states;
        let in_header = line.number <= 2 || self.in_legend;
        if in_header && (line.text.len() > MAX_HEADER_LINE || line.is_binary()) {
            let message =
                "the line is not a title, version or legend entry: was the file overwritten?";
            states.note(ProblemCode::BadLine, &line, message);
        }
        if line.number == 1 {
            let text = source::title(line.text).trim().to_string();
            self.title = (!text.is_empty()).then_some(text);
        } else if line.number == 2 {
            self.version = version(line.text);
            if self.version.is_none() {
                let message = "expected LS-DYNA's version line (\"ls-dyna … date …\")";
                states.note(ProblemCode::NoVersionLine, &line, message);
            }
        } else if !line.ended && !line.is_blank() {
            // What is missing from it is not known, not even where all its numbers seem whole.
            if !self.in_legend {
                body.unfinished(&line, states);
                if !states.is_pending() {
                    states.begin(None, (&line).into());
                }
                states.damage(&line, None, "the file ends within this line".into());
                states.entity = None;
                body.interrupt();
            }
        } else if is_text(&line, states) {
            if self.in_legend
                && (self.format.is_signature(line.text) || body.is_signature(line.text))
            {
                self.in_legend = false;
                let message = "expected {END LEGEND} before the first state";
                states.note(ProblemCode::BadLine, &line, message);
            }
            // One l2a release wrote the opening line without its closing brace.
            let text = line.text.trim_ascii_start();
            let (opens, closes) =
                (text.starts_with(b"{BEGIN LEGEND"), text.starts_with(b"{END LEGEND"));
            if self.in_legend || opens || closes {
                self.in_legend = !closes;
                if self.legend.len() < MAX_LEGEND {
                    self.legend.extend(legend_entry(line.text));
                }
            } else if text.is_empty() {
                body.blank(states);
            } else if self.is_title_again && version(text).is_some() {
                self.is_title_again = false;
            } else if self.version.is_some() && is_title(text, self.title.as_deref()) {
                self.is_title_again = true;
                body.blank(states);
            } else if body.line(&line, states).is_none() {
                states.unexpected(&line, None, body.expected(), 40);
            }
        } else {
            states.entity = None;
            body.interrupt();
        }
        Ok(true)
    }

    pub(crate) fn finish(mut self, body: &mut dyn Body) -> SolverFile {
        if self.lines.place().line < 2 {
            let message = "the file ends before its header (title and version line) is complete";
            self.states.problems.add(ProblemCode::NoVersionLine, None, message.into());
        }
        if self.in_legend {
            let message = "the file ends within its legend: expected {END LEGEND}";
            self.states.problems.add(ProblemCode::BadLine, None, message.into());
        }
        body.end(&mut self.states);
        self.states.end_skipped_lines();
        let singles = std::mem::take(&mut self.states.single_surfaces);
        let titles: HashMap<i64, &Option<String>> =
            self.legend.iter().map(|(id, t)| (*id, t)).collect();
        let title_of = |id: i64| titles.get(&id).and_then(|t| (*t).clone());
        let mut file = self.states.finish();
        file.entities.iter_mut().for_each(|entity| entity.title = title_of(entity.id.id));
        let with_data: HashSet<i64> = file.entities.iter().map(|e| e.id.id).collect();
        let single = singles.iter().map(|&id| (id, title_of(id)));
        let single = single.map(|of| (of, NoDataReason::SingleSurfaceContact));
        let known: HashSet<i64> = singles.iter().copied().collect();
        let legend = self.legend.iter().filter(|(id, _)| !known.contains(id)).cloned();
        let legend = legend.map(|of| (of, NoDataReason::LegendOnly));
        let without_data = single
            .chain(legend)
            .filter(|((id, _), _)| !with_data.contains(id))
            .map(|((id, title), reason)| WithoutData { id, title, reason })
            .collect();
        SolverFile {
            format: self.format.name,
            section: self.format.name.to_string(),
            solver: self.version.is_some().then(|| "LS-DYNA".to_string()),
            version: self.version,
            title: self.title,
            without_data,
            ..file
        }
    }
}

/// Whether a line is the title of the file.
fn is_title(text: &[u8], title: Option<&str>) -> bool {
    let rest = title.and_then(|title| text.strip_prefix(title.as_bytes()));
    rest.is_some_and(|rest| rest.trim_ascii().is_empty())
}

/// Whether a line is text; says if not, or if it is too long.
fn is_text(line: &Line<'_>, states: &mut StateReader<'_>) -> bool {
    if line.overlong {
        let message = "the line is longer than any line of this file can be; its end is left out";
        states.note(ProblemCode::BadLine, line, message);
    }
    let is_binary = line.is_binary();
    if is_binary {
        let message = "expected text, found bytes that are not text: was the file overwritten?";
        states.damage(line, None, message.into());
    }
    !is_binary
}
