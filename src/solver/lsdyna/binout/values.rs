//! The values of one component over the complete states: from records (rows of entities) to histories (columns
//! of states).

use std::collections::HashMap;
use std::io;
use std::ops::Range;
use std::sync::Arc;

use super::owners::{Entities, MAX_ROWS, ordinals, row_name};
use super::records::{Bytes, Component, DataRecord, Scratch, Section};
use super::states::{Ids, StateReader};
use crate::history::{EntityId, History};
use crate::solver::Selection;
use crate::solver::problem::{Problem, ProblemCode};
use crate::solver::states::{ABSENT_CELLS, ABSENT_PER_PRESENT};

/// A component of a section, of one integration point where it has several.
pub(super) struct Series<'a> {
    pub section: &'a Section,
    pub component: &'a Component,
    pub name: Arc<str>,
    pub owners: Entities,
    /// Which of the values that each entity has in a state; `None` if it has one.
    pub point: Option<usize>,
}

/// Index of an entity among the owners, and the entity itself.
pub(super) type Kept = (usize, Option<EntityId>);

#[derive(Default)]
struct Lacks {
    /// States without it, or with another number of values.
    absent: usize,
    not_finite: usize,
}

impl Series<'_> {
    /// The histories of the selected entities; of all of them for an audit.
    pub(crate) fn histories(
        &self,
        states: &StateReader,
        selection: &Selection,
        bytes: Bytes<'_>,
    ) -> io::Result<(Vec<History>, Vec<Problem>)> {
        let ordinals = ordinals(self.owners.entities());
        let kept = self.kept(&ordinals, selection);
        if let Some(problem) = self.too_sparse(kept.len(), states) {
            return Ok((Vec::new(), vec![problem]));
        }
        let (columns, lacks) = self.columns(&kept, states, bytes)?;
        let history = |((k, entity), values): (Kept, Vec<f64>)| History {
            entity,
            component: ordinals
                .get(k)
                .map_or_else(|| self.name.clone(), |&ordinal| row_name(&self.name, ordinal)),
            time: states.time.clone(),
            values,
        };
        let problems = self.problems(&lacks, kept.is_empty(), states);
        Ok((kept.into_iter().zip(columns.finish()).map(history).collect(), problems))
    }

    pub(super) fn kept(&self, ordinals: &[usize], selection: &Selection) -> Vec<Kept> {
        if matches!(self.owners, Entities::Global) {
            return vec![(0, None)];
        }
        let all = self.owners.entities().iter().enumerate();
        all.filter(|(k, _)| ordinals.get(*k).is_none_or(|&ordinal| ordinal <= MAX_ROWS))
            .filter(|(_, id)| selection.audit || selection.wants(**id))
            .filter(|(_, id)| !self.section.is_lost(id.id))
            .map(|(k, id)| (k, Some(*id)))
            .collect()
    }

    /// Damage can spread few values over very many entities and states.
    fn too_sparse(&self, kept: usize, states: &StateReader) -> Option<Problem> {
        let states = &states.whole;
        let records = states.iter().filter_map(|state| self.component.records.get(state));
        let present: usize = records.map(DataRecord::width).sum();
        let cells = kept.saturating_mul(states.len());
        let most = ABSENT_CELLS.saturating_add(present.saturating_mul(ABSENT_PER_PRESENT));
        (cells > most).then(|| {
            let message = format!(
                "{} is left out: its {present} values would be spread over {cells} of {kept} entities and {} states",
                self.name,
                states.len()
            );
            self.section.problem(ProblemCode::UnreadRows, &message)
        })
    }

    fn columns(
        &self,
        kept: &[Kept],
        states: &StateReader,
        bytes: Bytes<'_>,
    ) -> io::Result<(Columns, Lacks)> {
        let mut columns = Columns::new(kept.len(), states.whole.len());
        let mut lacks = Lacks::default();
        let (mut scratch, mut row) = (Scratch::new(), Vec::new());
        // Where each entity's value is, while the states' ids stay the same.
        let mut pick = Pick::new(kept.iter().map(|&(k, _)| Some(k)).collect());
        let mut current: Option<&Ids> = None;
        for (k, state) in states.whole.iter().enumerate() {
            let values = columns.row();
            let width = match &self.owners {
                Entities::Global => 1,
                Entities::Fixed(ids) => ids.len(),
                Entities::OfState(_) => {
                    let Some(ids) = states.ids.as_ref().map(|ids| &ids[k]) else {
                        values.fill(f64::NAN);
                        continue;
                    };
                    if current != Some(ids) {
                        current = Some(ids);
                        pick = Pick::new(positions_of(kept, ids));
                    }
                    ids.len()
                }
            };
            let place = self.component.records.get(state).copied();
            let per_entity = self.point.and(place).map_or(1, |place| place.width() / width.max(1));
            let Some(place) = place.filter(|p| p.width() == width * per_entity) else {
                lacks.absent += 1;
                values.fill(f64::NAN);
                continue;
            };
            let point = self.point.unwrap_or(0);
            row.clear();
            if !pick.span.is_empty() {
                bytes.reals(place, pick.range(per_entity, point), &mut scratch, &mut row)?;
            }
            lacks.not_finite += pick.fill(values, &row, per_entity, point);
        }
        Ok((columns, lacks))
    }

    fn problems(&self, lacks: &Lacks, is_none_kept: bool, states: &StateReader) -> Vec<Problem> {
        let mut problems = Vec::new();
        let Self { section, name, .. } = self;
        if lacks.absent > 0 && !is_none_kept {
            let message = format!(
                "{name} is missing from {} of {} states, or has another number of values; its values there are NaN",
                lacks.absent,
                states.whole.len()
            );
            problems.push(section.problem(ProblemCode::AbsentComponent, &message));
        }
        if lacks.not_finite > 0 {
            let message = format!(
                "{name} has {} values that are not finite numbers; they are returned as such",
                lacks.not_finite
            );
            problems.push(section.problem(ProblemCode::NotFinite, &message));
        }
        problems
    }
}

/// Where the kept entities' values are in a state's record.
pub(super) struct Pick {
    /// `None` for an entity that the state lacks.
    positions: Vec<Option<usize>>,
    /// From the first to after the last of them.
    span: Range<usize>,
    /// Whether they are neighbours in their order.
    is_run: bool,
}

impl Pick {
    pub(super) fn new(positions: Vec<Option<usize>>) -> Self {
        let known = || positions.iter().flatten().copied();
        let span = match known().min().zip(known().max()) {
            Some((first, last)) => first..last + 1,
            None => 0..0,
        };
        let is_run = positions.iter().copied().eq(span.clone().map(Some));
        Self { positions, span, is_run }
    }

    /// The values of a record that hold those of the kept entities at one of the points that
    /// each entity has. The span must not be empty.
    pub(super) fn range(&self, per_entity: usize, point: usize) -> Range<usize> {
        self.span.start * per_entity..(self.span.end - 1) * per_entity + point + 1
    }

    /// Takes a state's values from the record's `row`, which begins with the span's first
    /// entity; returns how many of them are not finite.
    pub(super) fn fill(
        &self,
        values: &mut [f64],
        row: &[f64],
        per_entity: usize,
        point: usize,
    ) -> usize {
        if self.is_run && per_entity == 1 && row.len() == values.len() {
            values.copy_from_slice(row);
            return row.iter().filter(|v| !v.is_finite()).count();
        }
        let mut not_finite = 0;
        for (value, position) in values.iter_mut().zip(&self.positions) {
            let read = position.and_then(|p| row.get((p - self.span.start) * per_entity + point));
            *value = read.copied().unwrap_or(f64::NAN);
            not_finite += usize::from(read.is_some_and(|v| !v.is_finite()));
        }
        not_finite
    }
}

/// Rows of states turned into columns, several rows at a time: a value alone would cost a
/// cache line.
struct Columns {
    columns: Vec<Vec<f64>>,
    rows: Vec<f64>,
    pending: usize,
}

/// Rows turned at once: the values of a cache line and more.
const ROWS: usize = 16;

impl Columns {
    fn new(columns: usize, states: usize) -> Self {
        Self {
            columns: (0..columns).map(|_| Vec::with_capacity(states)).collect(),
            rows: vec![f64::NAN; columns * ROWS],
            pending: 0,
        }
    }

    /// The next state's row, to be filled.
    fn row(&mut self) -> &mut [f64] {
        if self.pending == ROWS {
            self.turn();
        }
        let width = self.columns.len();
        self.pending += 1;
        &mut self.rows[(self.pending - 1) * width..self.pending * width]
    }

    fn turn(&mut self) {
        let (width, pending) = (self.columns.len(), self.pending);
        for (k, column) in self.columns.iter_mut().enumerate() {
            column.extend((0..pending).map(|row| self.rows[row * width + k]));
        }
        self.pending = 0;
    }

    fn finish(mut self) -> Vec<Vec<f64>> {
        self.turn();
        self.columns
    }
}

/// For every kept entity its position among a state's ids.
fn positions_of(kept: &[(usize, Option<EntityId>)], ids: &[i64]) -> Vec<Option<usize>> {
    let of: HashMap<i64, usize> = ids.iter().enumerate().map(|(k, &id)| (id, k)).collect();
    kept.iter().map(|(_, entity)| entity.and_then(|e| of.get(&e.id).copied())).collect()
}
