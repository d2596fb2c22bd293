//! The values of one component over the whole states, a history for each entity.

use std::io;
use std::sync::Arc;

use super::bytes::{Bytes, Scratch};
use super::columns::{Columns, Pick, positions_of};
use super::owners::{Entities, MAX_ROWS, ordinals, row_name};
use super::records::{Component, DataRecord, Section};
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
type Kept = (usize, Option<EntityId>);

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

    fn kept(&self, ordinals: &[usize], selection: &Selection) -> Vec<Kept> {
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
