//! Collects rows into states and keeps only complete states of selected histories.
//!
//! A file is a sequence of states; a state is one row per entity in one or more tables
//! (`nodout` has two: translations and rotations). The first complete state fixes the
//! entities of each table, unless its rows may come and go (eroded elements). Invariant:
//! every kept history has one value per kept state.

pub(in crate::solver) mod finish;
pub(in crate::solver) mod repeat;

use std::hash::{DefaultHasher, Hasher};
use std::sync::Arc;

use super::Selection;
use super::lsdyna::label_values::Widths;
use super::lsdyna::line::{Field, Line, real, shown};
use super::problem::{Diagnostics, Place, Problem, ProblemCode};
use crate::history::EntityId;
use crate::words::counted;
use finish::Table;
use repeat::{Part, Trace};

/// Values that states may lack, beyond a multiple of the values they have: more are no
/// erosion but damage, and would fill the memory.
pub(crate) const ABSENT_CELLS: usize = 10_000_000;
pub(crate) const ABSENT_PER_PRESENT: usize = 20;

/// Digits of times in most files.
const TIME_DIGITS: i32 = 6;

/// Labels kept of a file of labels; real ones have about thirty.
const MAX_LABELS: usize = 500;

/// Global quantities, which appear by label rather than by row.
struct Scalar {
    component: Arc<str>,
    kept: bool,
    values: Vec<f64>,
    pending: Option<f64>,
    absent: usize,
}

struct Pending {
    time: Option<f64>,
    cycle: Option<i64>,
    place: Place,
    damaged: bool,
    /// Whether it has a row that the first complete state does not have.
    disagrees: bool,
    labels: usize,
}

/// The states of one file while it is read.
pub(crate) struct StateReader<'a> {
    pub selection: &'a Selection,
    tables: Vec<Table>,
    scalars: Vec<Scalar>,
    time: Vec<f64>,
    pending: Option<Pending>,
    /// Whether a complete state has fixed the entities.
    sealed: bool,
    /// Whole states to leave out before the first that is kept.
    pub skip: usize,
    /// States left out because their rows are not those of the first complete state.
    disagreeing: usize,
    /// Whether a state without rows is complete.
    pub allow_empty_states: bool,
    /// Values that the kept states have and lack, selected or not.
    present_cells: usize,
    absent_cells: usize,
    /// Places of the kept states' beginnings, and their cycles where the file has them.
    places: Vec<Place>,
    pub cycles: Vec<Option<i64>>,
    /// Digits that the file prints of times.
    pub time_digits: i32,
    widths: Widths,
    /// Lines of unknown meaning between those that are read, and the first of them.
    skipped_lines: usize,
    first_skipped: Option<(Place, String)>,
    /// The entity that the lines are of, where one has several; none after a damaged line.
    pub entity: Option<EntityId>,
    /// Contacts that the file declares to have no resultants.
    pub single_surfaces: Vec<i64>,
    pub problems: Diagnostics,
    /// What the parts of the lines are, while the layout of a state is learnt.
    pub trace: Option<Trace>,
}

/// Index of a table, from [`StateReader::table`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct TableId(pub usize);

/// Tables that are made when their first row comes, by what their rows are of.
#[derive(Clone)]
pub(crate) struct KeyedTables<K>(Vec<(K, TableId)>);

impl<K> Default for KeyedTables<K> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<K: PartialEq> KeyedTables<K> {
    /// The table of a key; `None` if it is new and there are `most` already.
    pub(crate) fn get(
        &mut self,
        key: K,
        most: usize,
        new: impl FnOnce(&K) -> TableId,
    ) -> Option<TableId> {
        if let Some((_, table)) = self.0.iter().find(|(known, _)| *known == key) {
            return Some(*table);
        }
        if self.0.len() == most {
            return None;
        }
        let table = new(&key);
        self.0.push((key, table));
        Some(table)
    }
}

impl<'a> StateReader<'a> {
    pub(crate) fn new(selection: &'a Selection) -> Self {
        Self {
            selection,
            tables: Vec::new(),
            scalars: Vec::new(),
            time: Vec::new(),
            pending: None,
            sealed: false,
            skip: 0,
            disagreeing: 0,
            allow_empty_states: false,
            present_cells: 0,
            absent_cells: 0,
            places: Vec::new(),
            cycles: Vec::new(),
            time_digits: TIME_DIGITS,
            widths: Widths::default(),
            skipped_lines: 0,
            first_skipped: None,
            entity: None,
            single_surfaces: Vec::new(),
            problems: Diagnostics::default(),
            trace: None,
        }
    }

    /// Whether more states disagree with the first complete state than agree with it.
    pub(crate) fn is_disputed(&self) -> bool {
        self.disagreeing > self.time.len()
    }

    pub(crate) fn kept(&self) -> usize {
        self.time.len()
    }

    /// Adds a table whose rows may come and go.
    pub(crate) fn varying_table<C: AsRef<str>>(
        &mut self,
        name: &'static str,
        components: impl IntoIterator<Item = C>,
    ) -> TableId {
        let id = self.table(name, components);
        self.tables[id.0].varies = true;
        id
    }

    /// Adds a table. `name` is for messages; `components` name its columns.
    pub(crate) fn table<C: AsRef<str>>(
        &mut self,
        name: &'static str,
        components: impl IntoIterator<Item = C>,
    ) -> TableId {
        let components: Vec<Arc<str>> = components.into_iter().map(|c| c.as_ref().into()).collect();
        let wanted_columns = (0..components.len())
            .filter(|&i| self.selection.wants_component(&components[i]))
            .collect();
        self.tables.push(Table::new(name, components, wanted_columns));
        TableId(self.tables.len() - 1)
    }

    /// Ends the pending state and starts one at `time` (`None`: not yet known).
    pub(crate) fn begin(&mut self, time: Option<f64>, place: Place) {
        self.close(false);
        self.pending =
            Some(Pending { time, cycle: None, place, damaged: false, disagrees: false, labels: 0 });
    }

    pub(crate) fn pending_time(&self) -> Option<f64> {
        self.pending.as_ref().and_then(|p| p.time)
    }

    pub(crate) fn is_pending(&self) -> bool {
        self.pending.is_some()
    }

    pub(crate) fn set_cycle(&mut self, cycle: i64) {
        if let Some(pending) = &mut self.pending {
            pending.cycle = Some(cycle);
        }
    }

    pub(crate) fn set_time(&mut self, time: f64) {
        if let Some(pending) = &mut self.pending {
            pending.time = Some(time);
        }
    }

    pub(crate) fn has_rows(&self, table: TableId) -> bool {
        !self.tables[table.0].filled_rows.is_empty()
    }

    pub(crate) fn has_row(&self, table: TableId, entity: EntityId) -> bool {
        let table = &self.tables[table.0];
        table.row_of.get(&entity).is_some_and(|&row| table.filled[row])
    }

    /// Notes what is odd about a line.
    pub(crate) fn note(&mut self, code: ProblemCode, line: &Line<'_>, message: &str) {
        self.problems.add(code, Some(line.into()), message.into());
    }

    /// Notes a line that cannot be read; the state it belongs to is not whole.
    /// After the last row of a complete state, that is the next state.
    pub(crate) fn damage(&mut self, line: &Line<'_>, columns: Option<[usize; 2]>, message: String) {
        self.problems.add_in_columns(ProblemCode::BadLine, Some(line.into()), columns, message);
        if let Some(pending) = &self.pending
            && self.sealed
            && !pending.damaged
            && pending.time.is_some()
            && self.missing(pending, true).is_none()
        {
            self.begin(None, line.into());
        }
        self.mark_damaged();
    }

    /// Notes a line that holds something else than expected, of which it shows the first `width` columns.
    pub(crate) fn unexpected(
        &mut self,
        line: &Line<'_>,
        columns: Option<[usize; 2]>,
        expected: &str,
        width: usize,
    ) {
        let found = shown(line.columns(1, width));
        self.damage(line, columns, format!("expected {expected}, found \"{}\"", found.trim_end()));
    }

    /// Notes a line of unknown meaning.
    pub(crate) fn skip_line(&mut self, line: &Line<'_>) {
        self.skipped_lines += 1;
        self.mark_unlike();
        let text = || shown(line.columns(1, 60)).trim().to_string();
        self.first_skipped.get_or_insert_with(|| (line.into(), text()));
    }

    /// Reports at the end of a file which lines were skipped.
    pub(crate) fn end_skipped_lines(&mut self) {
        let Some((place, text)) = &self.first_skipped else { return };
        let message = format!(
            "{} between those of this file not read, the first \"{text}\": of another file?",
            counted(self.skipped_lines, "line")
        );
        self.problems.add(ProblemCode::UnreadRows, Some(*place), message);
    }

    /// Whether the number after a label may be that wide, where `usual` is what most files have.
    pub(crate) fn allows_width(
        &mut self,
        label: &str,
        width: usize,
        usual: usize,
        line: &Line<'_>,
    ) -> bool {
        let excess = width as isize - usual as isize;
        self.widths.allow(label, excess, line.into(), &mut self.problems)
    }

    pub(crate) fn mark_damaged(&mut self) {
        if let Some(pending) = &mut self.pending {
            pending.damaged = true;
        }
    }

    pub(crate) fn is_damaged(&self) -> bool {
        self.pending.as_ref().is_some_and(|p| p.damaged)
    }

    /// Stores the selected fields of one row. `field(k)` gives the first and last
    /// column (from 1) of the table's k-th component, `None` if this row does not have it.
    pub(crate) fn row(
        &mut self,
        id: TableId,
        entity: EntityId,
        line: &Line<'_>,
        field: impl Fn(usize) -> Option<(usize, usize)>,
    ) {
        let table = &mut self.tables[id.0];
        let row = match table.find(entity) {
            Some(row) => row,
            None if !self.sealed || table.varies => {
                table.add_row(entity, self.selection, self.time.len())
            }
            None => {
                if let Some(pending) = &mut self.pending {
                    pending.disagrees = true;
                }
                let message = format!("{entity} is not among the entities of the first state");
                return self.note(ProblemCode::UnexpectedEntity, line, &message);
            }
        };
        if std::mem::replace(&mut table.filled[row], true) {
            let is_new = !self.sealed
                && table.lines.get(&row) == Some(&hash(line.text))
                && table.twice.insert(row);
            if table.is_repeated(row, |column| {
                field(column).map(|(from, to)| read_field(line, [from, to]).0)
            }) {
                let message = format!("{entity} is in every state twice; its first row is kept");
                if is_new {
                    self.note(ProblemCode::RepeatedLabel, line, &message);
                }
                // The row of the next state may have other values, so it is to be compared too.
                return self.mark_unlike();
            }
            return self.damage(line, None, format!("{entity} appears twice in one state"));
        }
        if !self.sealed {
            table.lines.insert(row, hash(line.text));
        }
        table.filled_rows.push(row);
        table.next_row = row + 1;
        if let Some(trace) = &mut self.trace {
            for (column, place) in (0..table.components.len()).map(|column| (column, field(column)))
            {
                let part = Part::Row { table: id, row, column };
                place.into_iter().for_each(|(from, to)| trace.note(line, from, to, part));
            }
        }
        for column in 0..table.components.len() {
            table.seen_columns[column] |= field(column).is_some();
        }
        if self.selection.audit {
            for (from, to) in (0..table.components.len()).filter_map(&field) {
                let (_, problem) = read_field(line, [from, to]);
                self.problems.extend(problem.map(|p| *p));
            }
        }
        let Some(first) = table.channel_of[row] else { return };
        for (i, &column) in table.wanted_columns.iter().enumerate() {
            let channel = &mut table.channels[first + i];
            let place = field(column);
            channel.pending_seen = place.is_some();
            channel.pending = place.map_or(f64::NAN, |(from, to)| {
                let (value, problem) = read_field(line, [from, to]);
                self.problems.extend(problem.map(|p| *p));
                value
            });
        }
    }

    /// The same for a row with its time, which begins a state if it has another time than the pending one, or if
    /// that has a row of the entity: times have few digits, so that two states can print the same one.
    pub(crate) fn timed_row(
        &mut self,
        table: TableId,
        entity: EntityId,
        (time, text): (f64, &[u8]),
        line: &Line<'_>,
        field: impl Fn(usize) -> Option<(usize, usize)>,
    ) {
        self.part(line, text, Part::Time);
        if self.pending_time() != Some(time) || self.has_row(table, entity) {
            self.begin(Some(time), line.into());
        }
        self.row(table, entity, line, field);
    }

    /// Stores one global quantity of the pending state.
    pub(crate) fn scalar(&mut self, component: &str, line: &Line<'_>, columns: [usize; 2]) {
        let Some(pending) = &mut self.pending else { return };
        pending.labels += 1;
        // States repeat their labels in the same order: look where the last one was found.
        let guess = pending.labels - 1;
        let found = match self.scalars.get(guess) {
            Some(s) if &*s.component == component => Some(guess),
            _ => self.scalars.iter().position(|s| &*s.component == component),
        };
        if found.is_none() && self.scalars.len() == MAX_LABELS {
            let message =
                format!("{component} is left out: the file has more than {MAX_LABELS} labels");
            return self.note(ProblemCode::UnreadRows, line, &message);
        }
        let index = found.unwrap_or_else(|| {
            let kept = self.selection.wants_component(component);
            self.scalars.push(Scalar {
                component: component.into(),
                kept,
                values: if kept { vec![f64::NAN; self.time.len()] } else { Vec::new() },
                pending: None,
                absent: self.time.len(),
            });
            self.scalars.len() - 1
        });
        if self.scalars[index].pending.is_some() {
            let message =
                format!("{component} appears twice in one state; its first value is kept");
            return self.note(ProblemCode::RepeatedLabel, line, &message);
        }
        let (value, problem) = read_field(line, columns);
        self.problems.extend(problem.map(|p| *p));
        self.scalars[index].pending = Some(value);
        if let Some(trace) = &mut self.trace {
            trace.note(line, columns[0], columns[1], Part::Scalar(index));
        }
    }
}

fn hash(text: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    hasher.write(text);
    hasher.finish()
}

/// The field's value; NaN and a problem where it holds no number. The problem is boxed, so that the
/// usual result fits into registers.
fn read_field(line: &Line<'_>, columns: [usize; 2]) -> (f64, Option<Box<Problem>>) {
    let bytes = line.columns(columns[0], columns[1]);
    let (code, message, value) = match real(bytes) {
        Field::Real(value) => return (value, None),
        Field::NotFinite(value) => (
            ProblemCode::NotFinite,
            format!("expected a finite number, found \"{}\"", shown(bytes).trim()),
            value,
        ),
        Field::Overflow => (
            ProblemCode::OverflowedField,
            format!("expected a real number, found \"{}\" (overflowed field)", shown(bytes).trim()),
            f64::NAN,
        ),
        Field::Bad => (
            ProblemCode::BadField,
            format!("expected a real number, found \"{}\"", shown(bytes)),
            f64::NAN,
        ),
    };
    let problem =
        Problem { columns: Some(columns), ..Problem::at(code, Some(line.into()), message) };
    (value, Some(Box::new(problem)))
}
