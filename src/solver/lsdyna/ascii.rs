//! The frame all LS-DYNA ASCII readers share: header, legend, then the file's own body.

use std::collections::HashMap;
use std::io::{self, BufRead};

use super::header::{self, LegendFence};
use super::line::{Line, Lines};
use crate::solver::problem::{Place, ProblemCode};
use crate::solver::states::States;
use crate::solver::{Entity, NoDataReason, Selection, SolverFile, WithoutData};

/// What one kind of file adds to the frame: the meaning of its lines.
pub trait Body {
    /// Whether a line can only stand below the header.
    fn is_signature(&self, line: &[u8]) -> bool;

    /// One line below the header, outside a legend.
    fn line(&mut self, line: &Line<'_>, states: &mut States<'_>);

    /// The end of the file, at `place`.
    fn end(&mut self, place: Place, states: &mut States<'_>);

    /// Contacts that the file declares to have no resultants.
    fn single_surfaces(&self) -> &[i64] {
        &[]
    }
}

/// Reads a whole file through `body`.
pub fn read(
    format: &'static str,
    input: &mut dyn BufRead,
    selection: &Selection,
    mut body: impl Body,
) -> io::Result<SolverFile> {
    let mut lines = Lines::new(input);
    let mut states = States::new(selection);
    let mut fence = LegendFence::default();
    let mut legend: Vec<(i64, Option<String>)> = Vec::new();
    let (mut title, mut version) = (None, None);
    while let Some(line) = lines.next_line()? {
        match line.number {
            1 => {
                let text = String::from_utf8_lossy(line.text).trim().to_string();
                title = (!text.is_empty()).then_some(text);
                continue;
            }
            2 => {
                version = header::version(line.text);
                if version.is_none() {
                    states.problems.add(
                        ProblemCode::NoVersionLine,
                        Some((&line).into()),
                        None,
                        "expected LS-DYNA's version line (\"ls-dyna … date …\")".into(),
                    );
                }
                continue;
            }
            _ => {}
        }
        if line.overlong {
            states.problems.add(
                ProblemCode::BadLine,
                Some((&line).into()),
                None,
                "the line is longer than any line of this file can be; its end is left out".into(),
            );
        }
        if fence.is_open() && body.is_signature(line.text) {
            fence.close();
            states.problems.add(
                ProblemCode::BadLine,
                Some((&line).into()),
                None,
                "expected {END LEGEND} before the first state".into(),
            );
        }
        if fence.covers(line.text) {
            legend.extend(header::legend_entry(line.text));
        } else {
            body.line(&line, &mut states);
        }
    }
    if lines.number() < 2 {
        states.problems.add(
            ProblemCode::NoVersionLine,
            None,
            None,
            "the file ends before its header (title and version line) is complete".into(),
        );
    }
    if fence.is_open() {
        states.problems.add(
            ProblemCode::BadLine,
            None,
            None,
            "the file ends within its legend: expected {END LEGEND}".into(),
        );
    }
    let end = Place { line: lines.number(), byte: lines.byte() };
    body.end(end, &mut states);
    Ok(assemble(format, states, &body, legend, title, version))
}

fn assemble(
    format: &'static str,
    states: States<'_>,
    body: &impl Body,
    legend: Vec<(i64, Option<String>)>,
    title: Option<String>,
    version: Option<String>,
) -> SolverFile {
    let titles: HashMap<i64, &Option<String>> = legend.iter().map(|(id, t)| (*id, t)).collect();
    let title_of = |id: i64| titles.get(&id).and_then(|t| (*t).clone());
    let collected = states.finish();
    let entities: Vec<Entity> =
        collected.entities.iter().map(|&id| Entity { id, title: title_of(id.id) }).collect();
    let with_data: std::collections::HashSet<i64> = entities.iter().map(|e| e.id.id).collect();
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
    let single: std::collections::HashSet<i64> = without_data.iter().map(|w| w.id).collect();
    without_data.extend(
        legend.iter().filter(|(id, _)| !with_data.contains(id) && !single.contains(id)).map(
            |(id, title)| WithoutData {
                id: *id,
                title: title.clone(),
                reason: NoDataReason::LegendOnly,
            },
        ),
    );
    SolverFile {
        format,
        section: format.to_string(),
        solver: version.is_some().then(|| "LS-DYNA".to_string()),
        version,
        title,
        entities,
        without_data,
        components: collected.components,
        time: collected.time,
        histories: collected.histories,
        problems: collected.problems,
    }
}
