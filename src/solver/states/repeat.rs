//! States that are laid out like one that was read line by line: what the parts of its lines are,
//! and how states that were read by their layout are added.

use std::collections::HashMap;
use std::sync::Arc;

use super::finish::{Channel, Table};
use super::{ABSENT_PER_PRESENT, Pending, Scalar, StateReader, TableId};
use crate::history::EntityId;
use crate::solver::lsdyna::label_values::Widths;
use crate::solver::lsdyna::line::Line;
use crate::solver::problem::{Diagnostics, Place};

/// What a part of a line is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Part {
    /// The time of the state, and its cycle.
    Time,
    Cycle,
    /// Words and numbers that are not read.
    Unread,
    /// The value of a component in a row of a table, and of a global quantity.
    Row {
        table: TableId,
        row: usize,
        column: usize,
    },
    Scalar(usize),
}

/// A part of a line, by its bytes in the file.
pub(crate) struct Zone {
    pub at: u64,
    pub length: usize,
    pub part: Part,
}

/// The parts of a state's lines that can differ in the next state.
#[derive(Default)]
pub(crate) struct Trace {
    pub zones: Vec<Zone>,
    /// Whether a line has an effect that a state of the same layout must have as well.
    pub is_unlike: bool,
}

impl Trace {
    pub(super) fn note(&mut self, line: &Line<'_>, from: usize, to: usize, part: Part) {
        let length = line.columns(from, to).len();
        self.zones.push(Zone { at: line.byte + from as u64 - 1, length, part });
    }
}

/// What a state has of the tables and global quantities.
pub(crate) struct Shape {
    /// Rows of each table, in their order.
    rows: Vec<Vec<usize>>,
    /// Whether it has a value of each channel, and of each global quantity.
    seen: Vec<bool>,
    scalars: Vec<bool>,
    /// All rows of each table, and all global quantities, in whose order these are.
    known: (Vec<usize>, Vec<Arc<str>>),
    labels: usize,
    entity: Option<EntityId>,
}

/// A state that was read by its layout.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Repeated {
    pub time: f64,
    pub cycle: Option<i64>,
    pub place: Place,
}

impl<'a> StateReader<'a> {
    /// Notes what `text`, which is of the line, is.
    pub(crate) fn part(&mut self, line: &Line<'_>, text: &[u8], part: Part) {
        let Some(trace) = self.trace.as_mut().filter(|_| !text.is_empty()) else { return };
        let from = (text.as_ptr() as usize).saturating_sub(line.text.as_ptr() as usize);
        trace.note(line, from + 1, from + text.len(), part);
    }

    /// Notes that the line has an effect that is not in its parts.
    pub(crate) fn mark_unlike(&mut self) {
        if let Some(trace) = &mut self.trace {
            trace.is_unlike = true;
        }
    }

    /// Where the pending state begins.
    pub(crate) fn begun(&self) -> Option<Place> {
        self.pending.as_ref().map(|pending| pending.place)
    }

    /// Time and cycle of the last state that was kept.
    pub(crate) fn last(&self) -> Option<(f64, Option<i64>)> {
        self.time.last().copied().zip(self.cycles.last().copied())
    }

    /// A reader with the same entities that notes the parts of lines, to learn a layout with.
    pub(crate) fn learner(&self) -> Self {
        let bare = |channel: &Channel| Channel {
            values: Vec::new(),
            pending: f64::NAN,
            seen: channel.seen,
            pending_seen: false,
        };
        let table = |table: &Table| Table {
            name: table.name,
            components: table.components.clone(),
            wanted_columns: table.wanted_columns.clone(),
            seen_columns: table.seen_columns.clone(),
            rows: table.rows.clone(),
            row_of: table.row_of.clone(),
            varies: table.varies,
            last_row: table.last_row,
            states_with: table.states_with.clone(),
            channel_of: table.channel_of.clone(),
            channels: table.channels.iter().map(bare).collect(),
            filled: vec![false; table.rows.len()],
            filled_rows: Vec::new(),
            next_row: 0,
            lines: HashMap::new(),
            twice: table.twice.clone(),
        };
        let scalar = |scalar: &Scalar| Scalar {
            component: scalar.component.clone(),
            kept: scalar.kept,
            values: Vec::new(),
            pending: None,
            absent: scalar.absent,
        };
        Self {
            tables: self.tables.iter().map(table).collect(),
            scalars: self.scalars.iter().map(scalar).collect(),
            sealed: self.sealed,
            allow_empty_states: self.allow_empty_states,
            time_digits: self.time_digits,
            widths: self.widths.clone(),
            single_surfaces: self.single_surfaces.clone(),
            problems: Diagnostics::default(),
            trace: Some(Trace::default()),
            ..Self::new(self.selection)
        }
    }

    /// What the state has that the learner read; `None` if it is not the whole state that `self`
    /// has read before, or if a state of the same layout would not be read like it.
    pub(crate) fn learnt(&self, learner: &StateReader<'_>) -> Option<Shape> {
        let pending = learner.pending.as_ref()?;
        let trace = learner.trace.as_ref()?;
        let is_same = pending.time == Some(self.last()?.0)
            && !(trace.is_unlike || pending.damaged || pending.disagrees)
            && learner.problems.is_empty()
            && learner.missing(pending, false).is_none()
            && learner.tables.len() == self.tables.len()
            && learner.scalars.len() == self.scalars.len()
            && learner.single_surfaces == self.single_surfaces
            && std::iter::zip(&learner.tables, &self.tables)
                .all(|(a, b)| a.rows.len() == b.rows.len())
            && self.widths.agrees(&learner.widths);
        let channels = learner.tables.iter().flat_map(|table| &table.channels);
        is_same.then(|| Shape {
            rows: learner.tables.iter().map(|table| table.filled_rows.clone()).collect(),
            seen: channels.map(|channel| channel.pending_seen).collect(),
            scalars: learner.scalars.iter().map(|scalar| scalar.pending.is_some()).collect(),
            known: self.known(),
            labels: pending.labels,
            entity: learner.entity,
        })
    }

    /// The kept value that a part of a line is, counted over the channels of all tables and then the
    /// global quantities.
    pub(crate) fn channel(&self, part: Part) -> Option<usize> {
        match part {
            Part::Row { table: TableId(number), row, column } => {
                let table = &self.tables[number];
                let before: usize = self.tables[..number].iter().map(|t| t.channels.len()).sum();
                let column = table.wanted_columns.iter().position(|&wanted| wanted == column)?;
                Some(before + table.channel_of[row]? + column)
            }
            Part::Scalar(number) => {
                let kept = |scalars: &[Scalar]| scalars.iter().filter(|s| s.kept).count();
                let channels: usize = self.tables.iter().map(|t| t.channels.len()).sum();
                self.scalars[number].kept.then(|| channels + kept(&self.scalars[..number]))
            }
            _ => None,
        }
    }

    /// Entity and component of every kept value.
    pub(crate) fn labels(&self) -> Vec<(Option<EntityId>, Arc<str>)> {
        let mut labels = Vec::with_capacity(self.channels());
        for table in &self.tables {
            let rows = table.rows.iter().zip(&table.channel_of).filter(|(_, of)| of.is_some());
            for (&row, _) in rows {
                let names = table.wanted_columns.iter().map(|&c| table.components[c].clone());
                labels.extend(names.map(|name| (Some(row), name)));
            }
        }
        let scalars = self.scalars.iter().filter(|scalar| scalar.kept);
        labels.extend(scalars.map(|scalar| (None, scalar.component.clone())));
        labels
    }

    pub(crate) fn channels(&self) -> usize {
        let scalars = self.scalars.iter().filter(|s| s.kept).count();
        self.tables.iter().map(|t| t.channels.len()).sum::<usize>() + scalars
    }

    pub(crate) fn take_widths(&mut self) -> Widths {
        std::mem::take(&mut self.widths)
    }

    pub(crate) fn set_widths(&mut self, widths: &Widths) {
        self.widths.clone_from(widths);
    }

    /// Drops the pending state: it is read again.
    pub(crate) fn forget_pending(&mut self) {
        self.pending = None;
        self.clear_pending();
    }

    /// Values that a state of this shape lacks and has, as they are counted.
    fn cells(&self, shape: &Shape) -> (usize, usize) {
        let (mut absent, mut present) = (0, 0);
        for (table, filled) in self.tables.iter().zip(&shape.rows).filter(|(t, _)| t.varies) {
            absent += (table.rows.len() - filled.len()) * table.components.len();
            present += filled.len() * table.components.len();
        }
        present += shape.scalars.iter().filter(|seen| **seen).count();
        absent += shape.scalars.iter().filter(|seen| !**seen).count();
        (absent, present)
    }

    fn known(&self) -> (Vec<usize>, Vec<Arc<str>>) {
        let rows = self.tables.iter().map(|table| table.rows.len());
        (rows.collect(), self.scalars.iter().map(|scalar| scalar.component.clone()).collect())
    }

    /// Whether any number of states of this shape is kept, whatever they lack, and nothing was added since.
    pub(crate) fn keeps(&self, shape: &Shape) -> bool {
        if self.known() != shape.known {
            return false;
        }
        let (absent, present) = self.cells(shape);
        !self.lacks_most() && absent <= present * ABSENT_PER_PRESENT
    }

    /// Adds complete states of one shape, with the values of all channels of each.
    pub(crate) fn extend(&mut self, shape: &Shape, states: &[Repeated], values: &[f64]) {
        let count = states.len();
        let (absent, present) = self.cells(shape);
        self.absent_cells += absent * count;
        self.present_cells += present * count;
        self.time.extend(states.iter().map(|state| state.time));
        self.cycles.extend(states.iter().map(|state| state.cycle));
        self.places.extend(states.iter().map(|state| state.place));
        for (table, filled) in self.tables.iter_mut().zip(&shape.rows).filter(|(t, _)| t.varies) {
            table.last_row = filled.iter().max().copied().filter(|_| count > 0).or(table.last_row);
            filled.iter().for_each(|&row| table.states_with[row] += count);
        }
        let width = self.channels();
        let of = |k: usize| values.iter().skip(k).step_by(width.max(1)).take(count);
        let channels = self.tables.iter_mut().flat_map(|table| &mut table.channels);
        let mut next = 0;
        for (channel, seen) in channels.zip(&shape.seen) {
            channel.seen += if *seen { count } else { 0 };
            channel.values.extend(of(next));
            next += 1;
        }
        for (scalar, seen) in self.scalars.iter_mut().zip(&shape.scalars) {
            scalar.absent += if *seen { 0 } else { count };
            if scalar.kept {
                scalar.values.extend(of(next));
                next += 1;
            }
        }
    }

    /// Makes a state the pending one, which has all its rows.
    pub(crate) fn pend(&mut self, shape: &Shape, state: Repeated, values: &[f64]) {
        let Repeated { time, cycle, place } = state;
        let (damaged, disagrees, labels) = (false, false, shape.labels);
        self.pending = Some(Pending { time: Some(time), cycle, place, damaged, disagrees, labels });
        self.entity = shape.entity;
        let mut values = values.iter();
        let mut seen = shape.seen.iter();
        for (table, rows) in self.tables.iter_mut().zip(&shape.rows) {
            rows.iter().for_each(|&row| table.filled[row] = true);
            table.filled_rows.clone_from(rows);
            table.next_row = rows.last().map_or(0, |row| row + 1);
            let of_states = values.by_ref().zip(seen.by_ref());
            for (channel, (value, seen)) in table.channels.iter_mut().zip(of_states) {
                (channel.pending, channel.pending_seen) = (*value, *seen);
            }
        }
        for (scalar, seen) in self.scalars.iter_mut().zip(&shape.scalars) {
            let value = if scalar.kept { values.next().copied() } else { Some(f64::NAN) };
            scalar.pending = value.filter(|_| *seen);
        }
    }
}
