//! A text file without damage state by state, for a consumer that writes each state immediately.
//!
//! The first states are read line by line until one shows the layout of all that follow. The times of these are read first,
//! so that their number is known; then any state can be read, from any thread.

use std::collections::HashMap;
use std::io;

use super::ascii::{AsciiReader, Body};
use super::layout::{Layout, Plan};
use super::leap::{Leaps, read};
use crate::history::EntityId;
use crate::solver::problem;
use crate::solver::source::{Source, Window};
use crate::solver::states::finish::restarts;
use crate::solver::{Format, Selection, SolverFile};

/// Values below which reading state by state saves nothing.
const MIN_VALUES: usize = 1 << 17;
/// States that may have another layout than those that follow.
const MAX_LEAD: usize = 32;

/// An undamaged text file whose states all have the same layout, but for some first ones.
pub struct Blocks {
    source: Box<dyn Source>,
    layout: Layout,
    plan: Plan,
    size: u64,
    /// Values of the states before the one that begins at byte `start`.
    lead: Vec<f64>,
    start: u64,
    /// What the file says of itself, with the times of all states and no history.
    pub file: SolverFile,
    /// What a state's values are, in their order.
    pub columns: Vec<Column>,
    /// The index of each history's value, in the order of [`SolverFile::histories`].
    pub order: Vec<usize>,
}

/// One component of some entities: neighbouring values of a state.
pub struct Column {
    /// Name of the component, as in binout: `x_displacement`.
    pub component: String,
    /// The entities whose values these are, in their order; none of a global quantity.
    pub entities: Vec<EntityId>,
}

impl Column {
    /// Number of values of a state.
    pub fn width(&self) -> usize {
        self.entities.len().max(1)
    }
}

impl Blocks {
    /// `None` if the file is damaged, has too few states to show their layout, or too few
    /// values to be worth it: then the line reader gives what there is.
    pub(crate) fn open<B: Body>(
        format: &'static Format,
        source: Box<dyn Source>,
        selection: &Selection,
    ) -> io::Result<Option<Self>> {
        let size = source.size()?;
        let mut frame = AsciiReader::new::<B>(format, &*source, selection);
        let (mut body, mut leaps) = (B::of(format), Leaps::<B>::default());
        let (mut layout, start) = loop {
            if frame.states.kept() > MAX_LEAD || !frame.step(&mut body)? {
                return Ok(None);
            }
            let Some((Some(above), at)) = leaps.between(&frame.states) else { continue };
            let learnt = frame.learn(&body, above, at, |states, part| states.channel(part))?;
            let Some(layout) = learnt.map(|learnt| learnt.layout) else { continue };
            let (mut window, mut values) =
                (Window::new(&*source), vec![0.0; frame.states.channels()]);
            let plan = layout.all(false);
            if layout.state(&mut window, (at.byte, size), &plan, &mut values)?.is_some() {
                break (layout, at.byte);
            }
        };
        frame.states.forget_pending();
        let labels = frame.states.labels();
        let mut cycles = frame.states.cycles().to_vec();
        let digits = frame.states.time_digits;
        let mut file = frame.finish(&mut body);
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
        let plan = if B::MAY_SKIP { layout.some() } else { layout.all(false) };
        Ok(Some(Self { source, layout, plan, size, lead: values, start, file, columns, order }))
    }

    /// Number of values of one state.
    pub fn values(&self) -> usize {
        self.order.len()
    }

    /// A buffer for [`Blocks::read`], of one thread.
    pub fn window(&self) -> Window<'_> {
        Window::new(&*self.source)
    }

    /// Whether all states can be read.
    pub fn are_whole(&self) -> io::Result<bool> {
        let count = self.layout.count(self.size, self.start);
        let found = read(&*self.source, &self.layout, &self.layout.check(), self.start, count, 0)?;
        Ok(found.0.len() == count)
    }

    /// Labels of the values, in [`Blocks::order`].
    pub fn labels(&self) -> Vec<String> {
        let of = |column: &Column| {
            let entities = column.entities.iter().map(|e| format!("{}[{e}]", column.component));
            let global = column.entities.is_empty().then(|| column.component.clone());
            entities.chain(global).collect::<Vec<_>>()
        };
        let mut labels: Vec<String> = self.columns.iter().flat_map(of).collect();
        self.order.iter().map(|&k| std::mem::take(&mut labels[k])).collect()
    }

    /// Reads one state into `out`, column by column; false if it is damaged.
    pub fn read(&self, window: &mut Window<'_>, state: usize, out: &mut [f64]) -> io::Result<bool> {
        let lead = self.lead.len() / self.values().max(1);
        let Some(number) = state.checked_sub(lead) else {
            out.copy_from_slice(&self.lead[state * self.values()..(state + 1) * self.values()]);
            return Ok(true);
        };
        let at = self.start + number as u64 * self.layout.period();
        let found = self.layout.state(window, (at, self.size), &self.plan, out)?;
        Ok(found.map(|(time, _)| time) == Some(self.file.time[state]))
    }
}

/// The histories of a file by component, and the index of each one's value among them; `None` if a
/// component is of entities and of the whole model.
fn columns(file: &SolverFile) -> Option<(Vec<Column>, Vec<usize>)> {
    let mut columns: Vec<Column> = Vec::new();
    let mut number_of = HashMap::new();
    let mut members: Vec<Vec<usize>> = Vec::new();
    for (k, history) in file.histories.iter().enumerate() {
        let number = *number_of.entry(history.component.clone()).or_insert_with(|| {
            let component = history.component.to_string();
            columns.push(Column { component, entities: Vec::new() });
            members.push(Vec::new());
            members.len() - 1
        });
        columns[number].entities.extend(history.entity);
        members[number].push(k);
    }
    let mut order = vec![0; file.histories.len()];
    for (place, history) in members.iter().flatten().enumerate() {
        order[*history] = place;
    }
    let fits = |(column, members): (&Column, &Vec<usize>)| column.width() == members.len();
    columns.iter().zip(&members).all(fits).then_some((columns, order))
}
