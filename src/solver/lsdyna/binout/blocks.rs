//! The states of one section without damage, one by one.

use std::io;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use rayon::prelude::*;

use super::owners::{Entities, ordinals};
use super::records::{Bytes, DataRecord, Scratch, Tree};
use super::states::StateReader;
use super::values::{Pick, Series};
use super::{Contents, SectionReader, sort};
use crate::history::History;
use crate::solver::blocks::{Blocks, ReadState, States, columns};
use crate::solver::source::Source;
use crate::solver::zeros::{Zeros, may_be_suspect, zeros_of_state};
use crate::solver::{Selection, problem};

/// Opens the only section that is selected. `None` if anything in it needs a look at the whole, or if it has
/// no histories.
pub(super) fn open(
    parts: Vec<Box<dyn Source>>,
    selection: &Selection,
) -> io::Result<Option<Blocks>> {
    let mut tree = Tree::default();
    for (number, part) in parts.iter().enumerate() {
        tree.walk(number, &**part)?;
    }
    let is_wanted = |name: &str| selection.section.as_ref().is_none_or(|s| s == name);
    let mut sections = tree.sections.iter().filter(|section| is_wanted(&section.name));
    let (Some(section), None) = (sections.next(), sections.next()) else { return Ok(None) };
    let has_others = tree.others.keys().any(|name| is_wanted(name));
    if has_others || selection.audit || !tree.problems.is_empty() {
        return Ok(None);
    }
    let mut reader = SectionReader::open(section, Bytes::new(&parts, &tree.headers), selection)?;
    let Contents { entities, components, wanted } = reader.contents()?;
    let mut histories: Vec<History> = Vec::new();
    let mut values = Vec::new();
    for series in &wanted {
        let Some(of) = Values::of(series, &reader.states, selection, &mut histories) else {
            return Ok(None);
        };
        values.push(of);
    }
    sort(&mut histories, &entities);
    let (mut file, problems) = reader.file(entities, components, histories);
    let found = columns(&file).filter(|(columns, _)| problems.is_empty() && !columns.is_empty());
    let Some((columns, order)) = found else { return Ok(None) };
    // Component by component, each with its entities in the order of its records.
    let mut sorted = Vec::with_capacity(values.len());
    for column in &columns {
        let at = values.iter().position(|of| *of.name == *column.component);
        let of = at.map(|at| values.swap_remove(at));
        let entities = column.entities.iter().copied();
        let Some(of) = of.filter(|of| of.entities().eq(entities)) else { return Ok(None) };
        sorted.push(of);
    }
    file.histories.clear();
    file.problems = problem::of_time(&file.time);
    let zeros = Mutex::new(vec![Zeros::new(); file.time.len()]);
    let states = Box::new(Binout { tree, parts, values: sorted, zeros, runs: AtomicUsize::new(0) });
    Ok(Some(Blocks { states, file, columns, order }))
}

/// Where the values of a component are.
struct Values {
    name: Arc<str>,
    kept: Vec<super::values::Kept>,
    records: Vec<DataRecord>,
    pick: Pick,
    per_entity: usize,
    point: usize,
}

impl Values {
    /// The records of all states, if they all have one of the same entities; adds the histories without values.
    fn of(
        series: &Series<'_>,
        states: &StateReader,
        selection: &Selection,
        histories: &mut Vec<History>,
    ) -> Option<Self> {
        let width = match &series.owners {
            Entities::Global => 1,
            Entities::Fixed(ids) => ids.len(),
            Entities::OfState(ids) => {
                let mut of_states = states.ids.iter().flatten();
                of_states.all(|of| of.iter().eq(ids.iter().map(|e| &e.id))).then_some(ids.len())?
            }
        };
        let has_one_row = ordinals(series.owners.entities()).is_empty();
        let kept = series.kept(&[], selection);
        let name = series.name.clone();
        let records: Option<Vec<DataRecord>> =
            states.whole.iter().map(|state| series.component.records.get(state).copied()).collect();
        let records = records.filter(|_| has_one_row)?;
        let per_entity = match series.point {
            Some(_) => records.first()?.width() / width.max(1),
            None => 1,
        };
        let fits = |record: &DataRecord| record.width() == width * per_entity;
        histories.extend(kept.iter().map(|&(_, entity)| History {
            entity,
            component: name.clone(),
            time: states.time.clone(),
            values: Vec::new(),
        }));
        let pick = Pick::new(kept.iter().map(|&(k, _)| Some(k)).collect());
        let point = series.point.unwrap_or(0);
        let is_whole = records.iter().all(fits) && !kept.is_empty();
        is_whole.then_some(Self { name, kept, records, pick, per_entity, point })
    }

    fn entities(&self) -> impl Iterator<Item = crate::history::EntityId> {
        self.kept.iter().filter_map(|(_, entity)| *entity)
    }
}

struct Binout {
    tree: Tree,
    parts: Vec<Box<dyn Source>>,
    values: Vec<Values>,
    /// Of the states that were read, and how many there are in all.
    zeros: Mutex<Vec<Zeros>>,
    runs: AtomicUsize,
}

/// Runs of zeros that are kept; a file with more is read as a whole.
const MAX_RUNS: usize = 1 << 20;

impl States for Binout {
    fn reader(&self) -> ReadState<'_> {
        let bytes = Bytes::new(&self.parts, &self.tree.headers);
        let (mut scratch, mut row) = (Scratch::new(), Vec::new());
        Box::new(move |state, out| {
            let mut rest = &mut *out;
            for of in &self.values {
                let (values, after) = rest.split_at_mut(of.kept.len());
                rest = after;
                row.clear();
                let range = of.pick.range(of.per_entity, of.point);
                let wanted = range.len();
                bytes.reals(of.records[state], range, &mut scratch, &mut row)?;
                if row.len() < wanted || of.pick.fill(values, &row, of.per_entity, of.point) > 0 {
                    return Ok(false);
                }
            }
            let zeros = zeros_of_state(self.values.iter().map(|of| of.kept.len()), out);
            let is_bounded =
                self.runs.fetch_add(zeros.len(), Ordering::Relaxed) + zeros.len() <= MAX_RUNS;
            if is_bounded && !zeros.is_empty() {
                self.zeros.lock().unwrap_or_else(PoisonError::into_inner)[state] = zeros;
            }
            Ok(is_bounded)
        })
    }

    fn are_whole(&self) -> io::Result<bool> {
        let width = self.values.iter().map(|of| of.kept.len()).sum();
        let states = self.zeros.lock().unwrap_or_else(PoisonError::into_inner).len();
        let whole = (0..states).into_par_iter().map_init(
            || (self.reader(), vec![0.0; width]),
            |(reader, out), state| reader(state, out),
        );
        let whole = whole.collect::<io::Result<Vec<bool>>>()?.iter().all(|whole| *whole);
        self.runs.store(0, Ordering::Relaxed);
        Ok(whole && self.are_plausible())
    }

    fn are_plausible(&self) -> bool {
        !may_be_suspect(&self.zeros.lock().unwrap_or_else(PoisonError::into_inner))
    }
}
