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

use super::header::{self, LegendFence};
use super::line::{Line, Lines, shown};
use crate::plural::counted;
use crate::solver::format::Format;
use crate::solver::problem::{Place, ProblemCode};
use crate::solver::source::{Source, Stream};
use crate::solver::states::StateReader;
use crate::solver::{Entity, NoDataReason, Selection, SolverFile, WithoutData};

/// What one kind of file adds to the frame: the meaning of its lines.
pub(crate) trait Body {
    /// Whether a line that is not the format's signature can only be below the header.
    fn is_signature(&self, _line: &[u8]) -> bool {
        false
    }

    /// One line below the header, outside a legend, with its line end.
    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>);

    /// A damaged line was left out: what was begun before it cannot continue after it.
    fn interrupt(&mut self) {}

    /// The file ends within `line`: ends the pending state if the line cannot belong to it.
    fn unfinished(&mut self, _line: &Line<'_>, _states: &mut StateReader<'_>) {}

    /// The end of the file, at `place`.
    fn end(&mut self, _place: Place, _states: &mut StateReader<'_>) {}

    /// Offered after every line: reads the states from there on at once, if they are laid
    /// out like the ones above, and says at which line to continue.
    fn leap(
        &mut self,
        _source: &dyn Source,
        _states: &mut StateReader<'_>,
    ) -> io::Result<Option<Place>> {
        Ok(None)
    }

    /// Contacts that the file declares to have no resultants.
    fn single_surfaces(&self) -> &[i64] {
        &[]
    }
}

/// Lines between those that are read, of unknown meaning: counted, and reported at the end.
#[derive(Default)]
pub(crate) struct Skipped {
    count: usize,
    first: Option<(Place, String)>,
}

impl Skipped {
    pub(crate) fn add(&mut self, line: &Line<'_>) {
        self.count += 1;
        let text = || shown(line.columns(1, 60)).trim().to_string();
        self.first.get_or_insert_with(|| (line.into(), text()));
    }

    pub(crate) fn tell(&self, states: &mut StateReader<'_>) {
        let Some((place, text)) = &self.first else { return };
        let message = format!(
            "{} between those of this file not read, the first \"{text}\": of another file?",
            counted(self.count, "line")
        );
        states.problems.add(ProblemCode::UnreadRows, Some(*place), None, message);
    }
}

/// Header, legend and states of a file, while it is read.
pub(crate) struct AsciiReader<'a> {
    format: &'static Format,
    lines: Lines<Stream<'a>>,
    pub states: StateReader<'a>,
    fence: LegendFence,
    legend: Vec<(i64, Option<String>)>,
    title: Option<String>,
    version: Option<String>,
}

/// Longest line of a header or legend; real ones have at most 94 columns.
const MAX_HEADER_LINE: usize = 132;
/// Entries kept of a legend; real ones have one per entity.
const MAX_LEGEND: usize = 2_000_000;
/// Leading states that may be too damaged to show the entities.
const MAX_SKIPPED: usize = 3;

/// Reads a whole file through a body made by `body`.
///
/// The first complete state determines which entities a state has. If more states disagree with it
/// than agree, it is the damaged one: the file is read again without it.
pub(crate) fn read<B: Body>(
    format: &'static Format,
    source: &dyn Source,
    selection: &Selection,
    body: impl Fn() -> B,
) -> io::Result<SolverFile> {
    let mut best = read_from_state(0, format, source, selection, body())?;
    for skipped in 1..=MAX_SKIPPED {
        if !best.disputed {
            break;
        }
        let next = read_from_state(skipped, format, source, selection, body())?;
        if next.file.time.len() > best.file.time.len() {
            best = next;
        }
    }
    Ok(best.file)
}

/// The same through a body that needs nothing to begin with.
pub(crate) fn read_default<B: Body + Default>(
    format: &'static Format,
    source: &dyn Source,
    selection: &Selection,
) -> io::Result<SolverFile> {
    read(format, source, selection, B::default)
}

struct Attempt {
    file: SolverFile,
    /// Whether more states disagree with the first complete state than agree.
    disputed: bool,
}

fn read_from_state(
    skipped: usize,
    format: &'static Format,
    source: &dyn Source,
    selection: &Selection,
    mut body: impl Body,
) -> io::Result<Attempt> {
    let mut frame = AsciiReader::new(format, source, selection);
    frame.states.skip(skipped);
    while frame.step(&mut body)? {
        if let Some(place) = body.leap(source, &mut frame.states)? {
            frame.lines.go_to(place);
        }
    }
    let disputed = frame.states.is_disputed();
    Ok(Attempt { file: frame.finish(&mut body), disputed })
}

impl<'a> AsciiReader<'a> {
    pub(crate) fn new(
        format: &'static Format,
        source: &'a dyn Source,
        selection: &'a Selection,
    ) -> Self {
        Self {
            format,
            lines: Lines::new(Stream::new(source)),
            states: StateReader::new(selection),
            fence: LegendFence::default(),
            legend: Vec::new(),
            title: None,
            version: None,
        }
    }

    /// Takes one line; false at the end of the file.
    pub(crate) fn step(&mut self, body: &mut impl Body) -> io::Result<bool> {
        let Some(line) = self.lines.next_line()? else { return Ok(false) };
        let states = &mut self.states;
        let in_header = line.number <= 2 || self.fence.is_open();
        if in_header && (line.text.len() > MAX_HEADER_LINE || line.is_binary()) {
            let message =
                "the line is not a title, version or legend entry: was the file overwritten?";
            states.problems.add(ProblemCode::BadLine, Some((&line).into()), None, message.into());
        }
        if line.number == 1 {
            let text = String::from_utf8_lossy(line.text).trim().to_string();
            self.title = (!text.is_empty()).then_some(text);
        } else if line.number == 2 {
            self.version = header::version(line.text);
            if self.version.is_none() {
                let message = "expected LS-DYNA's version line (\"ls-dyna … date …\")";
                let place = Some((&line).into());
                states.problems.add(ProblemCode::NoVersionLine, place, None, message.into());
            }
        } else if !line.ended && !line.is_blank() {
            // What is missing from it is not known, not even where all its numbers seem whole.
            if !self.fence.is_open() {
                body.unfinished(&line, states);
                if !states.is_pending() {
                    states.begin(None, (&line).into());
                }
                states.damage(&line, None, "the file ends within this line".into());
                body.interrupt();
            }
        } else if is_text(&line, states) {
            if self.fence.is_open()
                && (self.format.is_signature(line.text) || body.is_signature(line.text))
            {
                self.fence.close();
                let message = "expected {END LEGEND} before the first state";
                let place = Some((&line).into());
                states.problems.add(ProblemCode::BadLine, place, None, message.into());
            }
            if !self.fence.covers(line.text) {
                body.line(&line, states);
            } else if self.legend.len() < MAX_LEGEND {
                self.legend.extend(header::legend_entry(line.text));
            }
        } else {
            body.interrupt();
        }
        Ok(true)
    }

    /// Ends the file.
    pub(crate) fn finish(mut self, body: &mut impl Body) -> SolverFile {
        let end = self.lines.place();
        if end.line < 2 {
            self.states.problems.add(
                ProblemCode::NoVersionLine,
                None,
                None,
                "the file ends before its header (title and version line) is complete".into(),
            );
        }
        if self.fence.is_open() {
            self.states.problems.add(
                ProblemCode::BadLine,
                None,
                None,
                "the file ends within its legend: expected {END LEGEND}".into(),
            );
        }
        body.end(end, &mut self.states);
        self.assemble(body)
    }

    fn assemble(self, body: &impl Body) -> SolverFile {
        let titles: HashMap<i64, &Option<String>> =
            self.legend.iter().map(|(id, t)| (*id, t)).collect();
        let title_of = |id: i64| titles.get(&id).and_then(|t| (*t).clone());
        let collected = self.states.finish();
        let entities: Vec<Entity> =
            collected.entities.iter().map(|&id| Entity { id, title: title_of(id.id) }).collect();
        let with_data: HashSet<i64> = entities.iter().map(|e| e.id.id).collect();
        let mut without_data: Vec<WithoutData> = body
            .single_surfaces()
            .iter()
            .filter(|id| !with_data.contains(id))
            .map(|&id| WithoutData {
                id,
                title: title_of(id),
                reason: NoDataReason::SingleSurfaceContact,
            })
            .collect();
        let single: HashSet<i64> = without_data.iter().map(|w| w.id).collect();
        let unused =
            self.legend.iter().filter(|(id, _)| !with_data.contains(id) && !single.contains(id));
        without_data.extend(unused.map(|(id, title)| WithoutData {
            id: *id,
            title: title.clone(),
            reason: NoDataReason::LegendOnly,
        }));
        SolverFile {
            format: self.format.name,
            section: self.format.name.to_string(),
            solver: self.version.is_some().then(|| "LS-DYNA".to_string()),
            version: self.version,
            title: self.title,
            entities,
            without_data,
            components: collected.components,
            time: collected.time,
            histories: collected.histories,
            problems: collected.problems,
            notes: Vec::new(),
        }
    }
}

/// Whether a line is text; says if not, or if it is too long.
fn is_text(line: &Line<'_>, states: &mut StateReader<'_>) -> bool {
    if line.overlong {
        let message = "the line is longer than any line of this file can be; its end is left out";
        states.problems.add(ProblemCode::BadLine, Some(line.into()), None, message.into());
    }
    let is_binary = line.is_binary();
    if is_binary {
        let message = "expected text, found bytes that are not text: was the file overwritten?";
        states.damage(line, None, message.into());
    }
    !is_binary
}
