//! Reads the values of a section from the places that were noted.

use std::collections::{HashMap, HashSet};
use std::io;
use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use super::columns::{Columns, Pick, positions_of};
use super::metadata::{Metadata, titles, trimmed};
use super::{Component, LISTS, Place, Section};
use crate::history::{EntityId, History};
use crate::solver::lsdyna::lsda::{Header, Kind};
use crate::solver::problem::{Place as FilePlace, ProblemCode, Problems};
use crate::solver::restart;
use crate::solver::source::{Source, fill_at};
use crate::solver::states::{ABSENT_CELLS, ABSENT_PER_PRESENT};
use crate::solver::zeros;
use crate::solver::{Entity, NoDataReason, Selection, SolverFile, WithoutData};

/// Components of a state that are no results.
const NOT_RESULTS: [&str; 4] = ["time", "cycle", "ids", "system"];

/// Largest text of titles that is read, and ids of one list; real ones are far shorter. A
/// longer list fits no values, which are then said to be left out.
const MAX_METADATA: u64 = 256 << 20;
const MAX_IDS: u64 = 4_000_000;
/// Values of one entity for several integration points that are told apart.
const MAX_POINTS: usize = 128;

/// Reads the noted records.
pub(super) struct Reader<'a> {
    parts: &'a [Box<dyn Source>],
    headers: &'a [Option<Header>],
    selection: &'a Selection,
}

/// The whole states of a section.
struct States {
    /// Indices of the states, in order of their numbers.
    whole: Vec<usize>,
    time: Arc<[f64]>,
    /// Ids of each of them where states name their own.
    ids: Option<Vec<Ids>>,
}

/// A state's ids; states with the same ones share them.
type Ids = Arc<[i64]>;

/// Rows that one entity has in a state; a node is in so many sets of constraints at most.
const MAX_ROWS: usize = 20;
/// Sections in which an id that is there twice is a fault of the file.
const HAVE_ONE_ROW: [&str; 6] =
    ["nodout", "matsum", "rwforc/forces", "secforc", "rbdout", "abstat"];

/// Whom the values of a component belong to.
#[derive(Clone)]
enum Owners {
    Global,
    /// One value per entity, in this order in every state.
    Fixed(Arc<[EntityId]>),
    /// Each state names its own entities; here all of them.
    OfState(Arc<[EntityId]>),
}

impl<'a> Reader<'a> {
    pub fn new(
        parts: &'a [Box<dyn Source>],
        headers: &'a [Option<Header>],
        selection: &'a Selection,
    ) -> Self {
        Self { parts, headers, selection }
    }

    fn bytes(&self, place: Place, from: u64, length: usize) -> io::Result<Vec<u8>> {
        let mut bytes = vec![0; length];
        let read = fill_at(&*self.parts[place.part], place.payload.at + from, &mut bytes)?;
        bytes.truncate(read);
        Ok(bytes)
    }

    fn whole(&self, place: Place) -> io::Result<(Kind, Header, Vec<u8>)> {
        let header = self.headers[place.part].ok_or(io::ErrorKind::InvalidData)?;
        let length = place.payload.bytes.min(MAX_METADATA) as usize;
        Ok((place.payload.kind, header, self.bytes(place, 0, length)?))
    }

    fn integers(&self, mut place: Place) -> io::Result<Vec<i64>> {
        let size = place.payload.kind.size().unwrap_or(1) as u64;
        place.payload.bytes = place.payload.bytes.min(MAX_IDS * size);
        let (kind, header, bytes) = self.whole(place)?;
        Ok(kind.integers(header, &bytes))
    }

    /// What a section says of itself, and its selected histories.
    pub fn section(&self, section: &Section, problems: &mut Problems) -> io::Result<SolverFile> {
        let metadata = self.metadata(section)?;
        let states = self.states(section, problems)?;
        if section.left_out > 0 {
            let message = format!(
                "{}: there are too many components; {} records of further ones are left out",
                section.name, section.left_out
            );
            problems.add(ProblemCode::UnreadRows, None, None, message);
        }
        if let Some(ids) = &states.ids {
            let mut states_with: HashMap<i64, usize> = HashMap::new();
            for id in ids.iter().flat_map(|ids| ids.iter()) {
                *states_with.entry(*id).or_default() += 1;
            }
            let partly = states_with.values().filter(|&&n| n < ids.len()).count();
            if partly > 0 {
                let message = format!(
                    "{}: {partly} of {} entities are missing from some states (eroded or failed); their values there are NaN",
                    section.name,
                    states_with.len()
                );
                problems.add(ProblemCode::AbsentEntity, None, None, message);
            }
        }
        let lists = [&metadata.ids, &metadata.force_ids, &metadata.moment_ids];
        let of_states = states.ids.iter().flatten().flat_map(|ids| ids.iter());
        let named = lists.into_iter().flatten().flatten().chain(of_states);
        let lost = named.filter(|id| is_lost(section, **id)).count();
        if lost > 0 {
            let message = format!(
                "{}: {lost} ids are zero (was the file overwritten there?); what belongs to them is left out",
                section.name
            );
            problems.add(ProblemCode::BadRecord, None, None, message);
        }
        let mut entities: Vec<EntityId> = Vec::new();
        let mut known: HashSet<EntityId> = HashSet::new();
        let mut components: Vec<Arc<str>> = Vec::new();
        let mut wanted: Vec<(&Component, Arc<str>, Owners, Option<usize>)> = Vec::new();
        let mut lists: Vec<EntityList> = Vec::new();
        for component in section.components.iter().filter(|c| !is_not_result(&c.name)) {
            let Some((owners, points)) =
                self.owners(section, component, &metadata, &states, problems)?
            else {
                continue;
            };
            let list = match lists.iter().position(|l| *l.entities == *owners.entities()) {
                Some(known) => known,
                None => {
                    lists.push(EntityList::new(section, &owners, problems));
                    lists.len() - 1
                }
            };
            let (list, owners) = (&lists[list], owners.sharing(&lists[list]));
            for id in list.entities.iter().filter(|id| !is_lost(section, id.id)) {
                if !states.whole.is_empty() && known.insert(*id) {
                    entities.push(*id);
                }
            }
            for point in 0..points {
                let name = match point {
                    0 => component.name.clone(),
                    _ => format!("{}_ip{}", component.name, point + 1).into(),
                };
                let names: Vec<Arc<str>> =
                    (1..=list.most_rows).map(|row| row_name(&name, row)).collect();
                let audited = self.selection.audit && component.is_real();
                let is_wanted = names.iter().any(|name| self.selection.wants_component(name));
                components.extend(names);
                if audited || is_wanted {
                    wanted.push((component, name, owners.clone(), (points > 1).then_some(point)));
                }
            }
        }
        let together = zeros::may_vanish(&section.name);
        let read: Vec<(Vec<History>, Problems)> = wanted
            .into_par_iter()
            .map(|(component, name, owners, point)| {
                let (mut histories, mut found) =
                    self.histories(section, component, &name, &owners, point, &states)?;
                if !together {
                    zeros::suspect(&section.name, &histories, &mut found);
                    self.keep_selected(&mut histories);
                }
                Ok((histories, found))
            })
            .collect::<io::Result<_>>()?;
        let mut histories: Vec<History> = Vec::new();
        for (read, found) in read {
            histories.extend(read);
            problems.append(found);
        }
        if together {
            zeros::suspect(&section.name, &histories, problems);
            self.keep_selected(&mut histories);
        }
        let rank: HashMap<EntityId, usize> =
            entities.iter().enumerate().map(|(k, &id)| (id, k)).collect();
        // Entity by entity, as in the text files.
        histories.sort_by_cached_key(|h: &History| h.entity.and_then(|e| rank.get(&e).copied()));
        let ids: HashSet<i64> = known.iter().map(|e| e.id).collect();
        let mut legend: Vec<(&i64, &String)> =
            metadata.titles.iter().filter(|(id, _)| !ids.contains(id)).collect();
        legend.sort();
        let without_data = legend.into_iter().map(|(&id, title)| WithoutData {
            id,
            title: Some(title.clone()),
            reason: NoDataReason::LegendOnly,
        });
        let version = match (&metadata.version, &metadata.revision) {
            (Some(version), Some(revision)) => Some(format!("{version} {revision}")),
            (version, _) => version.clone(),
        };
        let titled =
            |id: &EntityId| Entity { id: *id, title: metadata.titles.get(&id.id).cloned() };
        Ok(SolverFile {
            format: "binout",
            section: section.name.clone(),
            solver: version.is_some().then(|| "LS-DYNA".to_string()),
            version,
            title: metadata.title.clone(),
            entities: entities.iter().map(titled).collect(),
            without_data: without_data.collect(),
            components: if states.whole.is_empty() { Vec::new() } else { components },
            time: states.time,
            histories,
            problems: Vec::new(),
            notes: Vec::new(),
        })
    }

    /// Drops what was read for an audit only.
    fn keep_selected(&self, histories: &mut Vec<History>) {
        let selection = self.selection;
        histories.retain(|h| {
            selection.wants_component(&h.component) && h.entity.is_none_or(|e| selection.wants(e))
        });
    }

    fn metadata(&self, section: &Section) -> io::Result<Metadata> {
        let text = |key: &str| -> io::Result<Option<Vec<u8>>> {
            let place = section.metadata.get(key).filter(|p| p.payload.kind.is_text());
            place.map(|&place| self.whole(place).map(|(_, _, bytes)| bytes)).transpose()
        };
        let numbers = |key: &str| -> io::Result<Option<Vec<i64>>> {
            section.metadata.get(key).map(|&place| self.integers(place)).transpose()
        };
        let plain = |bytes: Option<Vec<u8>>| bytes.and_then(|b| trimmed(&b));
        Ok(Metadata {
            title: plain(text("title")?),
            version: plain(text("version")?),
            revision: plain(text("revision")?),
            titles: titles(numbers("legend_ids")?, text("legend")?),
            ids: numbers("ids")?,
            side: numbers("side")?,
            force_ids: numbers("force_ids")?,
            moment_ids: numbers("moment_ids")?,
        })
    }

    /// The whole states, in order of their numbers. A state is whole if it has a time and
    /// no damage; the last one must also have what the one before has.
    fn states(&self, section: &Section, problems: &mut Problems) -> io::Result<States> {
        let mut order: Vec<usize> = (0..section.states.len()).collect();
        order.sort_by_key(|&i| section.states[i]);
        if section.repeated > 0 {
            let message = format!(
                "{}: {} records are there again, the first of state d{} (a restart, or another file of the run with this section); the last ones are kept",
                section.name,
                section.repeated,
                section.first_repeated.unwrap_or_default()
            );
            let state = section.first_repeated.and_then(|n| section.state_index.get(&n));
            let place = state.and_then(|&state| place_of(section, state));
            problems.add(ProblemCode::RepeatedState, place, None, message);
        } else if !section.states.is_sorted() {
            let message = format!(
                "{}: states are not in order of their numbers; they are returned in it",
                section.name
            );
            problems.add(ProblemCode::TimeGoesBack, None, None, message);
        }
        let times = section.component("time");
        let last = order.last().copied();
        let before = order.len().checked_sub(2).map(|k| order[k]);
        let mut whole = Vec::new();
        let mut time: Vec<f64> = Vec::new();
        for state in order {
            let record = times.and_then(|t| t.records.get(&state));
            let value = match record {
                Some(&place) => {
                    let (kind, header, bytes) = self.whole(place)?;
                    let mut values = Vec::new();
                    kind.reals(header, &bytes, &mut values);
                    values.first().copied().filter(|t| t.is_finite())
                }
                None => None,
            };
            let lacks = || {
                let has = |c: &Component, s: usize| c.records.contains_key(&s);
                let lost = |c: &&Component| before.is_some_and(|b| has(c, b)) && !has(c, state);
                section.components.iter().find(lost).map(|c| c.name.clone())
            };
            let why = match value {
                _ if section.damaged.contains(&state) => Some("a record of it is damaged".into()),
                None => Some("its time is missing".into()),
                Some(_) if Some(state) == last => {
                    lacks().map(|name| format!("it lacks {name}, which the state before has"))
                }
                Some(_) => None,
            };
            match (why, value) {
                (None, Some(value)) => {
                    whole.push(state);
                    time.push(value);
                }
                (why, _) => {
                    let message = format!(
                        "{}: state d{} is left out: {}",
                        section.name,
                        section.states[state],
                        why.unwrap_or_default()
                    );
                    let place = place_of(section, state);
                    problems.add(ProblemCode::IncompleteState, place, None, message);
                }
            }
        }
        let of = format!("{}: ", section.name);
        let place = |i: usize| place_of(section, whole[i]);
        let kept = restart::resolve(&time, |_, _| Some(true), place, &of, problems);
        time = kept.iter().map(|&i| time[i]).collect();
        whole = kept.iter().map(|&i| whole[i]).collect();
        self.leave_out_other_lists(section, &mut whole, &mut time, problems)?;
        let ids = match section.component("ids") {
            None => self.ids_by_order(section, &whole)?,
            Some(component) => {
                let mut ids: Vec<Ids> = Vec::with_capacity(whole.len());
                for state in &whole {
                    let read = match component.records.get(state) {
                        Some(&place) => self.integers(place)?,
                        None => Vec::new(),
                    };
                    let above = ids.last().filter(|above| ***above == *read).cloned();
                    ids.push(above.unwrap_or_else(|| read.into()));
                }
                Some(ids)
            }
        };
        let twice = |ids: &Ids| ids.len() - ids.iter().collect::<HashSet<_>>().len();
        let mut above: Option<&Ids> = None;
        let mut changed = ids.iter().flatten().filter(|&ids| {
            let same = above.replace(ids).is_some_and(|above| Arc::ptr_eq(above, ids));
            !same
        });
        let twice = changed.by_ref().map(twice).max().unwrap_or(0);
        if twice > 0 {
            let message = format!(
                "{}: {twice} ids are there twice in one state; the last value of each is returned",
                section.name
            );
            problems.add(ProblemCode::RepeatedLabel, None, None, message);
        }
        Ok(States { whole, time: time.into(), ids })
    }

    /// The ids in force when each state was written, if they changed; sections whose rows
    /// are told by more than an id are not asked.
    fn ids_by_order(&self, section: &Section, whole: &[usize]) -> io::Result<Option<Vec<Ids>>> {
        let places: Vec<Place> =
            section.lists.iter().filter(|(name, _)| *name == "ids").map(|(_, p)| *p).collect();
        let lists: Vec<Ids> = places
            .iter()
            .map(|&place| self.integers(place).map(Ids::from))
            .collect::<io::Result<_>>()?;
        let more = section.lists.iter().any(|(name, _)| *name != "ids");
        if more || lists.windows(2).all(|w| w[0] == w[1]) {
            return Ok(None);
        }
        let of = |state: &usize| {
            let time = section.component("time").and_then(|t| t.records.get(state));
            let before = |p: &Place| time.is_some_and(|t| p.order() < t.order());
            let last = places.iter().rposition(before).unwrap_or(0);
            lists[last].clone()
        };
        Ok(Some(whole.iter().map(of).collect()))
    }

    /// Leaves out states that were written before a list of sides or of several kinds of ids
    /// changed: their rows cannot be told by one id.
    fn leave_out_other_lists(
        &self,
        section: &Section,
        whole: &mut Vec<usize>,
        time: &mut Vec<f64>,
        problems: &mut Problems,
    ) -> io::Result<()> {
        let is_plain = section.lists.iter().all(|(name, _)| *name == "ids");
        let mut last_change = None;
        for name in LISTS.into_iter().filter(|_| !is_plain) {
            let mut above: Option<Vec<i64>> = None;
            for (_, place) in section.lists.iter().filter(|(n, _)| *n == name) {
                let list = self.integers(*place)?;
                if above.as_ref().is_some_and(|above| *above != list) {
                    last_change = last_change.max(Some(place.order()));
                }
                above = Some(list);
            }
        }
        let Some(change) = last_change else { return Ok(()) };
        let times = section.component("time");
        let is_behind = |state: usize| {
            times.and_then(|t| t.records.get(&state)).is_some_and(|t| t.order() > change)
        };
        let keep: Vec<bool> = whole.iter().map(|&state| is_behind(state)).collect();
        let lost = keep.iter().filter(|k| !**k).count();
        let mut flags = keep.iter();
        whole.retain(|_| flags.next().copied().unwrap_or(true));
        let mut flags = keep.iter();
        time.retain(|_| flags.next().copied().unwrap_or(true));
        if lost > 0 {
            let message = format!(
                "{}: the ids change; {lost} states that were written before are left out",
                section.name
            );
            let place = Some(FilePlace::at_byte(change.1));
            problems.add(ProblemCode::UnexpectedEntity, place, None, message);
        }
        Ok(())
    }

    /// Whom a component's values belong to, and how many values each has; `None` (said)
    /// where the number of values fits no ids.
    fn owners(
        &self,
        section: &Section,
        component: &Component,
        metadata: &Metadata,
        states: &States,
        problems: &mut Problems,
    ) -> io::Result<Option<(Owners, usize)>> {
        let first = states.whole.iter().find_map(|state| component.records.get(state));
        let any = first.or_else(|| component.records.values().next());
        let Some(width) = any.filter(|p| !p.payload.kind.is_text()).map(Place::width) else {
            return Ok(None);
        };
        if width == 0 || is_total(&component.name) {
            return Ok((width == 1).then_some((Owners::Global, 1)));
        }
        if let Some(ids) = &states.ids {
            let with = (0..states.whole.len())
                .find(|&k| component.records.contains_key(&states.whole[k]) && !ids[k].is_empty());
            let count = with.map_or(0, |k| ids[k].len());
            let points = self.points(section, states, count, width)?;
            if let Some(points) = points {
                let mut all: Vec<EntityId> = Vec::new();
                let mut known = HashSet::new();
                let each = ids.iter().flat_map(|ids| ids.iter());
                for id in each.filter(|&&id| known.insert(id)) {
                    all.push(EntityId::new(*id));
                }
                return Ok(Some((Owners::OfState(all.into()), points)));
            }
        }
        if let Some(ids) = metadata.entities(&component.name, width) {
            return Ok(Some((Owners::Fixed(ids.into()), 1)));
        }
        if width == 1 {
            return Ok(Some((Owners::Global, 1)));
        }
        let message = format!(
            "{}: {} has {width} values a state and no ids of that number; it is not read",
            section.name, component.name
        );
        problems.add(ProblemCode::UnreadRows, None, None, message);
        Ok(None)
    }

    /// Values of each of `count` entities: one, or as many as integration points if the
    /// section says that all have the same number of them (`nip`).
    fn points(
        &self,
        section: &Section,
        states: &States,
        count: usize,
        width: usize,
    ) -> io::Result<Option<usize>> {
        if count == 0 || width == count {
            return Ok((width == count).then_some(1));
        }
        let record = section
            .component("nip")
            .and_then(|nip| states.whole.iter().find_map(|state| nip.records.get(state)));
        let Some(&record) = record else { return Ok(None) };
        let nip = self.integers(record)?;
        let points = width / count;
        let agrees = nip.len() == count
            && points * count == width
            && (2..=MAX_POINTS).contains(&points)
            && nip.iter().all(|&n| usize::try_from(n) == Ok(points));
        Ok(agrees.then_some(points))
    }

    /// The histories of one component over the whole states.
    fn histories(
        &self,
        section: &Section,
        component: &Component,
        name: &Arc<str>,
        owners: &Owners,
        point: Option<usize>,
        states: &States,
    ) -> io::Result<(Vec<History>, Problems)> {
        let mut problems = Problems::default();
        let rows = rows_of_one(owners.entities());
        let kept: Vec<(usize, Option<EntityId>)> = match owners {
            Owners::Global => vec![(0, None)],
            _ => {
                let all = owners.entities().iter().enumerate();
                let all = all.filter(|(k, _)| rows.get(*k).is_none_or(|&row| row <= MAX_ROWS));
                let audit = self.selection.audit;
                all.filter(|(_, id)| audit || self.selection.wants(**id))
                    .filter(|(_, id)| !is_lost(section, id.id))
                    .map(|(k, id)| (k, Some(*id)))
                    .collect()
            }
        };
        let records = states.whole.iter().filter_map(|state| component.records.get(state));
        let present: usize = records.map(Place::width).sum();
        let cells = kept.len().saturating_mul(states.whole.len());
        if cells > ABSENT_CELLS.saturating_add(present.saturating_mul(ABSENT_PER_PRESENT)) {
            let message = format!(
                "{}: {name} is left out: its {present} values would be spread over {cells} of {} entities and {} states",
                section.name,
                kept.len(),
                states.whole.len()
            );
            problems.add(ProblemCode::UnreadRows, None, None, message);
            return Ok((Vec::new(), problems));
        }
        let mut columns = Columns::new(kept.len(), states.whole.len());
        let (mut absent, mut not_finite) = (0, 0);
        let (mut bytes, mut row) = (Vec::new(), Vec::new());
        // Where each entity's value is, while the states' ids stay the same.
        let mut pick = Pick::new(kept.iter().map(|&(k, _)| Some(k)).collect());
        let mut current: Option<&Ids> = None;
        for (k, state) in states.whole.iter().enumerate() {
            let width = match owners {
                Owners::Global => 1,
                Owners::Fixed(ids) => ids.len(),
                Owners::OfState(_) => {
                    let Some(ids) = states.ids.as_ref().map(|ids| &ids[k]) else {
                        columns.row().fill(f64::NAN);
                        continue;
                    };
                    if current != Some(ids) {
                        current = Some(ids);
                        pick = Pick::new(positions_of(&kept, ids));
                    }
                    ids.len()
                }
            };
            let place = component.records.get(state).copied();
            let per_entity = point.and(place).map_or(1, |place| place.width() / width.max(1));
            let Some(place) = place.filter(|p| p.width() == width * per_entity) else {
                absent += 1;
                columns.row().fill(f64::NAN);
                continue;
            };
            let values = columns.row();
            let (point, span) = (point.unwrap_or(0), pick.span.clone());
            if span.is_empty() {
                values.fill(f64::NAN);
                continue;
            }
            let range = span.start * per_entity..(span.end - 1) * per_entity + point + 1;
            row.clear();
            self.values(place, range, &mut bytes, &mut row)?;
            if pick.is_run && per_entity == 1 && row.len() == values.len() {
                values.copy_from_slice(&row);
                not_finite += row.iter().filter(|v| !v.is_finite()).count();
                continue;
            }
            for (value, position) in values.iter_mut().zip(&pick.positions) {
                let read = position.and_then(|p| row.get((p - span.start) * per_entity + point));
                *value = read.copied().unwrap_or(f64::NAN);
                not_finite += usize::from(read.is_some_and(|v| !v.is_finite()));
            }
        }
        if absent > 0 && !kept.is_empty() {
            let message = format!(
                "{}: {name} is missing from {absent} of {} states, or has another number of values; its values there are NaN",
                section.name,
                states.whole.len()
            );
            problems.add(ProblemCode::AbsentComponent, None, None, message);
        }
        if not_finite > 0 {
            let message = format!(
                "{}: {name} has {not_finite} values that are no finite numbers; they are returned as such",
                section.name
            );
            problems.add(ProblemCode::NotFinite, None, None, message);
        }
        let history = |((k, entity), values): ((usize, Option<EntityId>), Vec<f64>)| History {
            entity,
            component: rows.get(k).map_or_else(|| name.clone(), |&row| row_name(name, row)),
            time: states.time.clone(),
            values,
        };
        Ok((kept.into_iter().zip(columns.finish()).map(history).collect(), problems))
    }

    /// Appends some values of a record to `out`; `bytes` is scratch.
    fn values(
        &self,
        place: Place,
        range: Range<usize>,
        bytes: &mut Vec<u8>,
        out: &mut Vec<f64>,
    ) -> io::Result<()> {
        let (kind, header) = (place.payload.kind, self.headers[place.part]);
        let (Some(size), Some(header)) = (kind.size(), header) else { return Ok(()) };
        let source = &*self.parts[place.part];
        let at = place.payload.at + (range.start * size) as u64;
        let length = range.len() * size;
        if let Some(all) = source.bytes() {
            let from = usize::try_from(at).unwrap_or(usize::MAX);
            let there = all.get(from..from.saturating_add(length)).unwrap_or_default();
            kind.reals(header, there, out);
        } else {
            bytes.resize(length, 0);
            let read = fill_at(source, at, bytes)?;
            kind.reals(header, &bytes[..read], out);
        }
        Ok(())
    }
}

impl Owners {
    fn entities(&self) -> &[EntityId] {
        match self {
            Self::Global => &[],
            Self::Fixed(ids) | Self::OfState(ids) => ids,
        }
    }

    /// The same with a list that other components have as well.
    fn sharing(self, list: &EntityList) -> Self {
        match self {
            Self::Global => self,
            Self::Fixed(_) => Self::Fixed(list.entities.clone()),
            Self::OfState(_) => Self::OfState(list.entities.clone()),
        }
    }
}

/// Entities that one component or several have values of.
struct EntityList {
    entities: Arc<[EntityId]>,
    /// Rows of the entity that has most, as far as they are read.
    most_rows: usize,
}

impl EntityList {
    /// Says which entities are there more often than they can be.
    fn new(section: &Section, owners: &Owners, problems: &mut Problems) -> Self {
        let entities: Arc<[EntityId]> = owners.entities().into();
        let rows = rows_of_one(&entities);
        let rows = || rows.iter().zip(&*entities).filter(|(_, id)| !is_lost(section, id.id));
        let most_rows = rows().map(|(&row, _)| row).max().unwrap_or(1);
        let limit = if HAVE_ONE_ROW.contains(&&*section.name) { 1 } else { MAX_ROWS };
        if most_rows > limit {
            let again = rows().filter(|(row, _)| **row == limit + 1).count();
            let first = rows().find(|(row, _)| **row == limit + 1).map(|(_, id)| id.to_string());
            let message = format!(
                "{}: {again} ids, the first {}, are there more than {} in one state; rows beyond the first {MAX_ROWS} are left out",
                section.name,
                first.unwrap_or_default(),
                if limit == 1 { "once".to_string() } else { format!("{limit} times") },
            );
            problems.add(ProblemCode::RepeatedLabel, None, None, message);
        }
        Self { entities, most_rows: most_rows.min(MAX_ROWS) }
    }
}

/// Where a state is in its file.
fn place_of(section: &Section, state: usize) -> Option<FilePlace> {
    let records = || section.components.iter().filter_map(|c| c.records.get(&state));
    let time = section.component("time").and_then(|t| t.records.get(&state));
    let place = time.or_else(|| records().min_by_key(|p| p.order()))?;
    Some(FilePlace::at_byte(place.payload.at))
}

/// Whether an id can only be one that was overwritten with zeros: LS-DYNA counts from 1, but
/// prints a part 0 for lumped masses.
fn is_lost(section: &Section, id: i64) -> bool {
    id == 0 && section.name != "matsum"
}

fn is_not_result(name: &str) -> bool {
    NOT_RESULTS.contains(&name)
}

/// Sums over all entities of a section (bndout, spcforc), whose number of values tells
/// nothing where there is one entity.
fn is_total(name: &str) -> bool {
    name == "etotal" || name.ends_with("_total") || name.ends_with("_resultant")
}

/// For each row of a state, the how-manieth of its entity it is: a node in two sets of
/// constraints has two. Empty if every entity has one.
fn rows_of_one(entities: &[EntityId]) -> Vec<usize> {
    if entities.windows(2).all(|pair| pair[0].id < pair[1].id) {
        return Vec::new();
    }
    let mut seen: HashMap<EntityId, usize> = HashMap::new();
    let rows: Vec<usize> = entities
        .iter()
        .map(|&entity| {
            let count = seen.entry(entity).or_default();
            *count += 1;
            *count
        })
        .collect();
    if seen.len() == entities.len() { Vec::new() } else { rows }
}

/// The name of the values of an entity's `row`-th row, as in the text files.
fn row_name(component: &Arc<str>, row: usize) -> Arc<str> {
    if row > 1 { format!("{component}_{row}").into() } else { component.clone() }
}
