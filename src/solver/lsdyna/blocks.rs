//! The states of a text file without damage, one by one.
//!
//! The first states are read line by line until one shows the layout of all that follow. The times of these are read first,
//! so that their number is known; then any state can be read, from any thread.

use std::collections::HashMap;
use std::io;
use std::sync::Arc;

use super::ascii::{AsciiReader, Body};
use super::layout::{Layout, Plan};
use super::leap::{Leaps, read};
use crate::solver::blocks::{Blocks, ReadState, States, columns};
use crate::solver::source::{Source, Window};
use crate::solver::states::finish::restarts;
use crate::solver::{Format, Selection, problem};

/// Values of a text file below which reading state by state saves nothing.
const MIN_VALUES: usize = 1 << 19;

/// States that may have another layout than those that follow.
const MAX_LEAD: usize = 32;

/// The states of an undamaged text file, which all have the same layout, but for some first ones.
struct Text {
    source: Box<dyn Source>,
    layout: Layout,
    plan: Plan,
    size: u64,
    /// Values of the states before the one that begins at byte `start`.
    lead: Vec<f64>,
    start: u64,
    time: Arc<[f64]>,
}

/// `None` if the file is damaged, has too few states to show their layout, or too few
/// values to be worth it: then the line reader gives what there is.
pub(crate) fn open(
    format: &'static Format,
    body: &dyn Body,
    mut parts: Vec<Box<dyn Source>>,
    selection: &Selection,
) -> io::Result<Option<Blocks>> {
    let Some(source) = parts.pop() else { return Ok(None) };
    let size = source.size()?;
    let mut frame = AsciiReader::new(format, body, &*source, selection);
    let (mut body, mut leaps) = (body.copied(), Leaps::default());
    let (mut layout, start) = loop {
        if frame.states.kept() > MAX_LEAD || !frame.step(&mut *body)? {
            return Ok(None);
        }
        let Some((Some(above), at)) = leaps.between(&frame.states) else { continue };
        let learnt = frame.learn(&*body, above, at)?;
        let Some(layout) = learnt.map(|learnt| learnt.layout) else { continue };
        let (mut window, mut values) = (Window::new(&*source), vec![0.0; frame.states.channels()]);
        let plan = layout.all(false);
        if layout.state(&mut window, (at.byte, size), &plan, &mut values)?.is_some() {
            break (layout, at.byte);
        }
    };
    frame.states.forget_pending();
    let labels = frame.states.labels();
    let mut cycles = frame.states.cycles.clone();
    let digits = frame.states.time_digits;
    let mut file = frame.finish(&mut *body);
    let count = layout.count(size, start);
    let width = file.histories.len();
    if !file.problems.is_empty() || width.saturating_mul(count) < MIN_VALUES {
        return Ok(None);
    }
    let (found, _) = read(&*source, &layout, &layout.head(), start, count, 0)?;
    let mut time = file.time.to_vec();
    let lead = time.len();
    time.extend(found.iter().map(|(time, _)| time));
    cycles.extend(found.iter().map(|(_, cycle)| cycle));
    let ends_there = found.len() == count && size <= start + count as u64 * layout.period();
    let is_plain = lead + count == cycles.len() && {
        let (kept, problems) = restarts(&time, &cycles, digits, |_| None);
        kept.len() == time.len() && problems.is_empty()
    };
    let grouped = columns(&file).filter(|_| ends_there && is_plain);
    let Some((columns, order)) = grouped else { return Ok(None) };
    let place_of: HashMap<_, usize> = std::iter::zip(&file.histories, &order)
        .map(|(history, place)| ((history.entity, history.component.clone()), *place))
        .collect();
    let places: Vec<Option<usize>> =
        labels.iter().map(|label| place_of.get(label).copied()).collect();
    if place_of.len() < width || !layout.redirect(&places, width) {
        return Ok(None);
    }
    let mut values = vec![0.0; lead * width];
    for (history, place) in std::iter::zip(&file.histories, &order) {
        for (state, value) in history.values.iter().enumerate() {
            values[state * width + place] = *value;
        }
    }
    file.problems = problem::of_time(&time);
    file.time = time.into();
    file.histories.clear();
    let plan = if body.may_skip() { layout.some() } else { layout.all(false) };
    let time = file.time.clone();
    let states = Box::new(Text { source, layout, plan, size, lead: values, start, time });
    Ok(Some(Blocks { states, file, columns, order }))
}

impl States for Text {
    fn reader(&self) -> ReadState<'_> {
        let mut window = Window::new(&*self.source);
        Box::new(move |state, out| {
            let Some(number) = (state * out.len()).checked_sub(self.lead.len()) else {
                out.copy_from_slice(&self.lead[state * out.len()..][..out.len()]);
                return Ok(true);
            };
            let at = self.start + (number / out.len()) as u64 * self.layout.period();
            let found = self.layout.state(&mut window, (at, self.size), &self.plan, out)?;
            Ok(found.map(|(time, _)| time) == Some(self.time[state]))
        })
    }

    fn are_whole(&self) -> io::Result<bool> {
        let count = self.layout.count(self.size, self.start);
        let found = read(&*self.source, &self.layout, &self.layout.check(), self.start, count, 0)?;
        Ok(found.0.len() == count)
    }
}
