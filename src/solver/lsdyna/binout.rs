//! `binout`: LS-DYNA's binary histories, an LSDA container.
//!
//! First all records are noted with their places, then the values that are wanted are read.
//! A file that continues as `name%001`, `name%002`, … and the files `binout0000`,
//! `binout0001`, … of the processes of one run are one tree over several containers.
//!
//! Of a record that is there twice the later one counts: a restart wrote it again. Entities
//! may differ between states (eroded elements): a state that lacks one has NaN there.

use std::collections::{HashMap, HashSet};
use std::io;
use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use super::lsda::{self, Event, Header, Kind, Payload, change_directory};
use crate::history::{EntityId, History, Side};
use crate::solver::problem::{ProblemCode, Problems};
use crate::solver::source::{Source, fill_at};
use crate::solver::zeros;
use crate::solver::{Entity, NoDataReason, Selection, SolverFile, WithoutData};

/// Sections by which a container is known to be a binout.
const SECTIONS: [&str; 24] = [
    "abstat", "bndout", "curvout", "dbsensor", "deforc", "disbout", "elout", "eloutdet", "glstat",
    "jntforc", "matsum", "ncforc", "nodfor", "nodout", "rbdout", "rcforc", "rwforc", "secforc",
    "sleout", "spcforc", "sphout", "swforc", "tprint", "trhist",
];

/// Components of a state that are no results.
const NOT_RESULTS: [&str; 4] = ["time", "cycle", "ids", "system"];

/// Largest array of ids or titles that is read; real ones are far shorter.
const MAX_METADATA: u64 = 256 << 20;
/// Components kept of one section; real ones have at most about forty.
const MAX_COMPONENTS: usize = 2_000;
/// Sections of one run, and records of all of them; more are damage, and would fill the
/// memory.
const MAX_SECTIONS: usize = 1_000;
const MAX_RECORDS: usize = 20_000_000;
/// Values of one entity for several integration points that are told apart.
const MAX_POINTS: usize = 128;

/// Whether a file begins with the header of an LSDA container.
pub fn recognises(head: &[u8]) -> bool {
    Header::parse(head).is_some()
}

/// Reads the selected histories of every section, or of the one selected. Empty if no
/// section is one of a binout.
pub fn read(parts: &[Box<dyn Source>], selection: &Selection) -> io::Result<Vec<SolverFile>> {
    let mut tree = Tree::default();
    for (number, part) in parts.iter().enumerate() {
        tree.walk(number, &**part)?;
    }
    let wanted = |name: &str| selection.section.as_ref().is_none_or(|s| s == name);
    let headers = std::mem::take(&mut tree.headers);
    let reader = Reader { parts, headers: &headers, selection };
    let mut files = Vec::new();
    // Damaged records concern all sections: nobody knows what they held.
    let common = std::mem::take(&mut tree.problems).into_list();
    for section in tree.sections.iter().filter(|s| wanted(&s.name)) {
        let mut problems = Problems::default();
        let mut file = reader.section(section, &mut problems)?;
        file.problems = common.iter().cloned().chain(problems.into_list()).collect();
        files.push(file);
    }
    Ok(files)
}

/// A data record of one of the containers.
#[derive(Clone, Copy)]
struct Place {
    part: usize,
    payload: Payload,
}

/// All sections of the family of containers.
#[derive(Default)]
struct Tree {
    headers: Vec<Option<Header>>,
    sections: Vec<Section>,
    index: HashMap<String, usize>,
    records: usize,
    /// Whether sections were left out.
    is_full: bool,
    problems: Problems,
}

/// The records of one section.
#[derive(Default)]
struct Section {
    name: String,
    metadata: HashMap<String, Place>,
    /// Directory numbers of the states, in order of appearance.
    states: Vec<u64>,
    state_index: HashMap<u64, usize>,
    /// States that damage was found in.
    damaged: HashSet<usize>,
    /// Records that were there before, and the first state of which.
    repeated: usize,
    first_repeated: Option<u64>,
    /// Components in order of appearance.
    components: Vec<Component>,
    component_index: HashMap<String, usize>,
}

/// The records of one component.
struct Component {
    name: Arc<str>,
    /// By state.
    records: HashMap<usize, Place>,
}

impl Tree {
    /// Notes all records of one container.
    fn walk(&mut self, part: usize, source: &dyn Source) -> io::Result<()> {
        let header = lsda::header(source)?;
        self.headers.push(header);
        let Some(header) = header else {
            let message = "this is no LSDA container, or its header is cut";
            self.problems.add(ProblemCode::CutRecord, None, None, message.into());
            return Ok(());
        };
        let mut path: Vec<String> = Vec::new();
        let mut here = None;
        lsda::walk(source, header, |event| match event {
            Event::Directory(to) => {
                change_directory(&mut path, to);
                here = self.place(&path);
            }
            Event::Data { name, payload } => {
                self.records += 1;
                if self.records == MAX_RECORDS {
                    let message = "there are too many records; those that follow are left out";
                    self.problems.add(ProblemCode::UnreadRows, None, None, message.into());
                }
                if let Some((section, state)) = here.filter(|_| self.records < MAX_RECORDS) {
                    self.sections[section].note(name, state, Place { part, payload });
                }
            }
            Event::Damage { at, resumed, message } => {
                let rest = match resumed {
                    Some(byte) => format!("reading goes on at byte {byte}"),
                    None => "what follows is left out".into(),
                };
                let message = format!("damaged record: {message}; {rest}");
                self.damage(here, ProblemCode::BadRecord, at, message);
            }
            Event::Cut { at } => {
                let message = format!(
                    "the file ends within the record at byte {at}; the records before it are read"
                );
                self.damage(here, ProblemCode::CutRecord, at, message);
            }
        })
    }

    /// Notes damage where the walk is.
    fn damage(
        &mut self,
        here: Option<(usize, Option<usize>)>,
        code: ProblemCode,
        byte: u64,
        message: String,
    ) {
        if let Some((section, Some(state))) = here {
            self.sections[section].damaged.insert(state);
        }
        self.problems.add_at_byte(code, byte, message);
    }

    /// The section and state a path names; `None` for what is not a result of a binout.
    /// States are `d` and digits, padded or not; directories below them hold no results.
    fn place(&mut self, path: &[String]) -> Option<(usize, Option<usize>)> {
        let (last, section) = path.split_last()?;
        if !SECTIONS.contains(&section.first()?.as_str()) {
            return None;
        }
        let number = match last.strip_prefix('d') {
            Some(digits) if digits.bytes().all(|b| b.is_ascii_digit()) => {
                Some(digits.parse().ok()?)
            }
            _ if last == "metadata" => None,
            _ => return None,
        };
        let name = section.join("/");
        let index = match self.index.get(&name) {
            Some(&index) => index,
            None if self.sections.len() == MAX_SECTIONS => {
                if !self.is_full {
                    let message =
                        format!("{name} and what follows is left out: there are too many sections");
                    self.problems.add(ProblemCode::UnreadRows, None, None, message);
                }
                self.is_full = true;
                return None;
            }
            None => {
                self.sections.push(Section { name: name.clone(), ..Section::default() });
                self.index.insert(name, self.sections.len() - 1);
                self.sections.len() - 1
            }
        };
        Some((index, number.map(|number| self.sections[index].state(number))))
    }
}

impl Section {
    /// Index of the state of that directory number.
    fn state(&mut self, number: u64) -> usize {
        *self.state_index.entry(number).or_insert_with(|| {
            self.states.push(number);
            self.states.len() - 1
        })
    }

    fn note(&mut self, name: &str, state: Option<usize>, place: Place) {
        let Some(state) = state else {
            self.metadata.insert(name.into(), place);
            return;
        };
        let index = match self.component_index.get(name) {
            Some(&index) => index,
            None if self.components.len() < MAX_COMPONENTS => {
                self.components.push(Component { name: name.into(), records: HashMap::new() });
                self.component_index.insert(name.into(), self.components.len() - 1);
                self.components.len() - 1
            }
            None => return,
        };
        let again = self.components[index].records.insert(state, place).is_some();
        // Within one state a record may be there twice; behind later states it is a restart.
        if again && state + 1 < self.states.len() {
            self.repeated += 1;
            self.first_repeated.get_or_insert(self.states[state]);
        }
    }

    fn component(&self, name: &str) -> Option<&Component> {
        self.component_index.get(name).map(|&index| &self.components[index])
    }
}

/// Reads the noted records.
struct Reader<'a> {
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
    ids: Option<Vec<Vec<i64>>>,
}

/// Whom the values of a component belong to.
enum Owners {
    Global,
    /// One value per entity, in this order in every state.
    Fixed(Vec<EntityId>),
    /// Each state names its own entities; here all of them.
    OfState(Vec<EntityId>),
}

impl Reader<'_> {
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

    fn integers(&self, place: Place) -> io::Result<Vec<i64>> {
        let (kind, header, bytes) = self.whole(place)?;
        Ok(kind.integers(header, &bytes))
    }

    fn section(&self, section: &Section, problems: &mut Problems) -> io::Result<SolverFile> {
        let metadata = self.metadata(section)?;
        let states = self.states(section, problems)?;
        if let Some(ids) = &states.ids {
            let mut states_with: HashMap<i64, usize> = HashMap::new();
            for id in ids.iter().flatten() {
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
        let named = lists.into_iter().flatten().chain(states.ids.iter().flatten()).flatten();
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
        for component in section.components.iter().filter(|c| !is_not_result(&c.name)) {
            let Some((owners, points)) =
                self.owners(section, component, &metadata, &states, problems)?
            else {
                continue;
            };
            for id in owners.entities().iter().filter(|id| !is_lost(section, id.id)) {
                if !states.whole.is_empty() && known.insert(*id) {
                    entities.push(*id);
                }
            }
            for point in 0..points {
                let name = match point {
                    0 => component.name.clone(),
                    _ => format!("{}_ip{}", component.name, point + 1).into(),
                };
                components.push(name.clone());
                let audited = self.selection.audit && component.is_real();
                if audited || self.selection.wants_component(&name) {
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
                "{}: a restart writes {} records again, the first of state d{}; the last ones are kept",
                section.name,
                section.repeated,
                section.first_repeated.unwrap_or_default()
            );
            problems.add(ProblemCode::RepeatedState, None, None, message);
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
                    if time.last().is_some_and(|&last| value < last) {
                        let message = format!(
                            "{}: time {value:?} of state d{} is before the time of the state above it",
                            section.name, section.states[state]
                        );
                        problems.add(ProblemCode::TimeGoesBack, None, None, message);
                    }
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
                    problems.add(ProblemCode::IncompleteState, None, None, message);
                }
            }
        }
        let ids = match section.component("ids") {
            None => None,
            Some(component) => {
                let of = |state: &usize| match component.records.get(state) {
                    Some(&place) => self.integers(place),
                    None => Ok(Vec::new()),
                };
                Some(whole.iter().map(of).collect::<io::Result<_>>()?)
            }
        };
        Ok(States { whole, time: time.into(), ids })
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
                for id in ids.iter().flatten().filter(|&&id| known.insert(id)) {
                    all.push(EntityId::new(*id));
                }
                return Ok(Some((Owners::OfState(all), points)));
            }
        }
        if let Some(ids) = metadata.entities(&component.name, width) {
            return Ok(Some((Owners::Fixed(ids), 1)));
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
        let kept: Vec<(usize, Option<EntityId>)> = match owners {
            Owners::Global => vec![(0, None)],
            _ => {
                let all = owners.entities().iter().enumerate();
                let audit = self.selection.audit;
                all.filter(|(_, id)| audit || self.selection.wants(**id))
                    .filter(|(_, id)| !is_lost(section, id.id))
                    .map(|(k, id)| (k, Some(*id)))
                    .collect()
            }
        };
        let mut columns = Columns::new(kept.len(), states.whole.len());
        let (mut absent, mut not_finite) = (0, 0);
        let (mut bytes, mut row) = (Vec::new(), Vec::new());
        // Where each entity's value is, while the states' ids stay the same.
        let mut pick = Pick::new(kept.iter().map(|&(k, _)| Some(k)).collect());
        let mut current: Option<&Vec<i64>> = None;
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
        let history = |((_, entity), values): ((usize, Option<EntityId>), Vec<f64>)| History {
            entity,
            component: name.clone(),
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

/// Where the kept entities' values are in a state's record.
struct Pick {
    /// `None` for an entity that the state lacks.
    positions: Vec<Option<usize>>,
    /// From the first to behind the last of them.
    span: Range<usize>,
    /// Whether they are neighbours in their order.
    is_run: bool,
}

impl Pick {
    fn new(positions: Vec<Option<usize>>) -> Self {
        let known = || positions.iter().flatten().copied();
        let span = match known().min().zip(known().max()) {
            Some((first, last)) => first..last + 1,
            None => 0..0,
        };
        let is_run = positions.iter().copied().eq(span.clone().map(Some));
        Self { positions, span, is_run }
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

impl Place {
    /// Number of values.
    fn width(&self) -> usize {
        let size = self.payload.kind.size().unwrap_or(1) as u64;
        usize::try_from(self.payload.bytes / size).unwrap_or(usize::MAX)
    }
}

impl Component {
    fn is_real(&self) -> bool {
        self.records.values().next().is_some_and(|p| p.payload.kind.is_real())
    }
}

impl Clone for Owners {
    fn clone(&self) -> Self {
        match self {
            Self::Global => Self::Global,
            Self::Fixed(ids) => Self::Fixed(ids.clone()),
            Self::OfState(ids) => Self::OfState(ids.clone()),
        }
    }
}

impl Owners {
    fn entities(&self) -> &[EntityId] {
        match self {
            Self::Global => &[],
            Self::Fixed(ids) | Self::OfState(ids) => ids,
        }
    }
}

/// What a section says of itself.
struct Metadata {
    title: Option<String>,
    version: Option<String>,
    revision: Option<String>,
    titles: HashMap<i64, String>,
    ids: Option<Vec<i64>>,
    side: Option<Vec<i64>>,
    force_ids: Option<Vec<i64>>,
    moment_ids: Option<Vec<i64>>,
}

impl Metadata {
    /// The entities that the values of a component belong to, by their number.
    fn entities(&self, component: &str, width: usize) -> Option<Vec<EntityId>> {
        let fits = |ids: &Option<Vec<i64>>| ids.clone().filter(|ids| ids.len() == width);
        let ids = fits(&self.ids).or_else(|| match component {
            c if c.ends_with("_force") => fits(&self.force_ids),
            c if c.ends_with("_moment") => fits(&self.moment_ids),
            _ => None,
        })?;
        // Rows of two-sided contacts repeat their id.
        let sides = fits(&self.side);
        let side =
            |k: usize| sides.as_ref().map(|s| if s[k] == 0 { Side::SurfA } else { Side::SurfB });
        Some(ids.into_iter().enumerate().map(|(k, id)| EntityId { id, side: side(k) }).collect())
    }
}

/// A text without its padding.
fn trimmed(bytes: &[u8]) -> Option<String> {
    let text = String::from_utf8_lossy(bytes);
    let text = text.trim_matches(|c: char| c.is_whitespace() || c == '\0');
    (!text.is_empty()).then(|| text.to_string())
}

/// Titles by id: `legend` holds equally long texts, 70 or 80 bytes each.
fn titles(ids: Option<Vec<i64>>, legend: Option<Vec<u8>>) -> HashMap<i64, String> {
    let (Some(ids), Some(legend)) = (ids, legend) else { return HashMap::new() };
    let width = legend.len() / ids.len().max(1);
    if width == 0 {
        return HashMap::new();
    }
    let titled = ids.iter().zip(legend.chunks(width));
    titled.filter_map(|(&id, bytes)| Some((id, trimmed(bytes)?))).collect()
}
