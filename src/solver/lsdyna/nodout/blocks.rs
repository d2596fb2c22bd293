//! A complete nodout state by state, for a consumer that writes each state immediately.
//!
//! `histories -o x.h5` of a large nodout never holds the file in memory. This module first verifies the frame of all states, so
//! that their number is known. `hdf5/skeleton` then lets hdf5-pure encode a file whose large datasets are untouched
//! zeros, and notes where the encoder places them. Finally the states are parsed and written to these
//! places from all threads.

use std::io;

use rayon::prelude::*;

use super::Nodout;
use super::rows::Wanted;
use super::stride::Stride;
use crate::history::EntityId;
use crate::solver::lsdyna::ascii::{AsciiReader, Body};
use crate::solver::problem;
use crate::solver::source::{Source, Window};
use crate::solver::{Selection, SolverFile};

/// Values below which reading state by state saves nothing.
const MIN_VALUES: usize = 1 << 17;

/// An undamaged nodout whose states all have the same layout.
pub struct Blocks {
    source: Box<dyn Source>,
    stride: Stride,
    /// Byte of the first state.
    start: u64,
    wanted: Vec<Wanted>,
    /// What the file says of itself, with the times of all states and no history.
    pub file: SolverFile,
    /// What a state's values are, in their order.
    pub columns: Vec<Column>,
}

/// One component of some entities: neighbouring values of a state.
pub struct Column {
    /// Name of the component, as in binout: `x_displacement`.
    pub component: String,
    /// The nodes whose values these are, in their order.
    pub entities: Vec<EntityId>,
}

impl Blocks {
    /// `None` if the file is damaged, has too few states to show their layout, or too few
    /// values to be worth it: then the line reader gives what there is.
    pub(crate) fn open(source: Box<dyn Source>, selection: &Selection) -> io::Result<Option<Self>> {
        let mut frame = AsciiReader::new::<Nodout>(&super::FORMAT, &*source, selection);
        let mut body = Nodout::default();
        let mut above = None;
        let start = loop {
            if !frame.step(&mut body)? {
                return Ok(None);
            }
            match (above, body.new_start.take()) {
                (Some(above), Some(new)) => break (above, new),
                (None, Some(first)) => above = Some(first),
                _ => {}
            }
        };
        frame.states.close(false);
        body.announced = None;
        if frame.states.kept() != 1 {
            return Ok(None);
        }
        let learnt = Stride::learn(&*source, start.0, start.1, &frame.states)?;
        let Some(stride) = learnt else { return Ok(None) };
        let wanted = stride.wanted_by_column(&frame.states);
        let rows: Vec<Vec<EntityId>> = (0..wanted.len())
            .map(|k| {
                let all = frame.states.rows(stride.table(k));
                wanted[k].rows.iter().map(|&row| all[row]).collect()
            })
            .collect();
        let start = start.0.byte;
        let size = source.size()?;
        let count = stride.count(size, start);
        let values = wanted.iter().map(Wanted::values).sum::<usize>();
        if values.saturating_mul(count) < MIN_VALUES {
            return Ok(None);
        }
        let times = times(&*source, &stride, start, count)?;
        let mut file = frame.finish(&mut body);
        let ends_there = size <= start + count as u64 * stride.period;
        let rising = times.as_ref().is_some_and(|t| t.is_sorted_by(|a, b| a < b));
        let (Some(times), true) = (times, ends_there && rising && file.problems.is_empty()) else {
            return Ok(None);
        };
        file.problems = problem::of_time(&times);
        file.time = times.into();
        file.histories.clear();
        let mut columns: Vec<(usize, Column)> = Vec::new();
        for ((k, wanted), rows) in wanted.iter().enumerate().zip(&rows) {
            let (_, components) = Nodout::TABLES[stride.table(k).0];
            for (i, &column) in wanted.columns.iter().enumerate() {
                let first = wanted.start + i * rows.len();
                let component = components[column].to_string();
                columns.push((first, Column { component, entities: rows.clone() }));
            }
        }
        columns.sort_by_key(|(first, _)| *first);
        let columns = columns.into_iter().map(|(_, column)| column).collect();
        Ok(Some(Self { source, stride, start, wanted, file, columns }))
    }

    /// Number of values of one state.
    pub fn values(&self) -> usize {
        self.wanted.iter().map(Wanted::values).sum()
    }

    /// A buffer for [`Blocks::read`], of one thread.
    pub fn window(&self) -> Window<'_> {
        Window::new(&*self.source)
    }

    /// Reads one state into `out`, column by column; false if it is damaged.
    pub fn read(&self, window: &mut Window<'_>, state: usize, out: &mut [f64]) -> io::Result<bool> {
        let at = self.start + state as u64 * self.stride.period;
        let found = self.stride.state(window, at, &self.wanted, false, out)?;
        Ok(found.map(|(_, time)| time) == Some(self.file.time[state]))
    }
}

/// The times of all states; `None` if what stands around the rows of any differs.
fn times(
    source: &dyn Source,
    stride: &Stride,
    start: u64,
    count: usize,
) -> io::Result<Option<Vec<f64>>> {
    let nothing: Vec<Wanted> = stride.nothing();
    (0..count)
        .into_par_iter()
        .map_init(
            || Window::new(source),
            |window, k| {
                let at = start + k as u64 * stride.period;
                let found = stride.state(window, at, &nothing, false, &mut [])?;
                Ok(found.map(|(_, time)| time))
            },
        )
        .collect()
}
