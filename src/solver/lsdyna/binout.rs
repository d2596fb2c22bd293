//! `binout`: LS-DYNA's binary histories, an LSDA container.
//!
//! Records are walked in order; symbol tables are skipped. A run that died has no final
//! table, so nothing may depend on one, and a record that overruns the file is the cut.
//! A file that continues as `name%001`, `name%002`, … is one tree over several containers.

use std::collections::{HashMap, HashSet};
use std::io::{self, BufRead};
use std::sync::Arc;

use super::lsda::{Header, Values, change_directory, fill, skip, take};
use crate::history::{EntityId, History, Side};
use crate::solver::problem::{ProblemCode, Problems};
use crate::solver::{Entity, NoDataReason, Selection, SolverFile, WithoutData};

/// Sections by which a container is known to be a binout.
const SECTIONS: [&str; 24] = [
    "abstat", "bndout", "curvout", "dbsensor", "deforc", "disbout", "elout", "eloutdet", "glstat",
    "jntforc", "matsum", "ncforc", "nodfor", "nodout", "rbdout", "rcforc", "rwforc", "secforc",
    "sleout", "spcforc", "sphout", "swforc", "tprint", "trhist",
];

/// Longest path and longest metadata array that are read; real ones are far shorter.
const MAX_PATH: u64 = 4096;
const MAX_METADATA: u64 = 64 << 20;

/// Whether a file begins with the header of an LSDA container.
pub fn recognises(head: &[u8]) -> bool {
    Header::parse(head).is_some()
}

/// Reads the selected histories of every section, or of the one selected. Empty if no
/// section is one of a binout.
pub fn read(parts: &mut [Box<dyn BufRead>], selection: &Selection) -> io::Result<Vec<SolverFile>> {
    let mut tree = Tree { selection, sections: Vec::new(), index: HashMap::new() };
    let mut problems = Problems::default();
    for part in parts {
        walk(part, &mut tree, &mut problems)?;
    }
    Ok(tree.finish(problems))
}

/// Commands of records.
const CD: u64 = 2;
const DATA: u64 = 3;

/// Walks the records of one container.
fn walk(input: &mut dyn BufRead, tree: &mut Tree<'_>, problems: &mut Problems) -> io::Result<()> {
    let mut at = 0;
    let mut head = [0; 8];
    let cut = |at: u64, what: &str, problems: &mut Problems| {
        problems.add(
            ProblemCode::CutRecord,
            None,
            None,
            format!("the file ends within {what} at byte {at}; the records before it are read"),
        );
    };
    if !fill(input, &mut head)? {
        cut(0, "its header", problems);
        return Ok(());
    }
    let Some(header) = Header::parse(&head) else {
        return Err(io::Error::new(io::ErrorKind::InvalidData, "this is no LSDA container"));
    };
    skip(input, header.header as u64 - 8)?;
    at += header.header as u64;
    let mut path = Vec::new();
    let mut frame = vec![0; header.length + 1];
    loop {
        let start = at;
        if input.fill_buf()?.is_empty() {
            return Ok(());
        }
        if !fill(input, &mut frame)? {
            cut(start, "a record's head", problems);
            return Ok(());
        }
        let length = header.unsigned(&frame[..header.length]);
        let command = u64::from(frame[header.length]);
        let Some(payload) = length.checked_sub(frame.len() as u64) else {
            problems.add(
                ProblemCode::BadRecord,
                None,
                None,
                format!("the record at byte {start} says it has {length} bytes; what follows is left out"),
            );
            return Ok(());
        };
        at += length;
        let whole = match command {
            CD if payload <= MAX_PATH => match take(input, payload)? {
                Some(text) => {
                    change_directory(&mut path, &String::from_utf8_lossy(&text));
                    true
                }
                None => false,
            },
            DATA => data(input, payload, header, &path, tree, problems, start)?,
            _ => skip(input, payload)?,
        };
        if !whole {
            tree.cut(&path);
            cut(start, "the record", problems);
            return Ok(());
        }
    }
}

/// Reads one data record, or skips it if nothing of it is wanted. False at a cut.
fn data(
    input: &mut dyn BufRead,
    payload: u64,
    header: Header,
    path: &[String],
    tree: &mut Tree<'_>,
    problems: &mut Problems,
    start: u64,
) -> io::Result<bool> {
    let mut head = [0; 2];
    if payload < 2 || !fill(input, &mut head)? {
        return Ok(false);
    }
    let [kind, name_length] = head;
    let Some(bytes) = (payload - 2).checked_sub(u64::from(name_length)) else { return Ok(false) };
    let Some(name) = take(input, name_length.into())? else { return Ok(false) };
    let name = String::from_utf8_lossy(&name).into_owned();
    let Some(place) = tree.place(path) else { return skip(input, bytes) };
    let wanted = match place.state {
        None => bytes <= MAX_METADATA,
        Some(_) => tree.wants(place, &name),
    };
    if !wanted {
        tree.note(place, &name, bytes, kind);
        return skip(input, bytes);
    }
    let Some(bytes) = take(input, bytes)? else { return Ok(false) };
    match Values::decode(kind, bytes, header) {
        Some(values) => tree.store(place, &name, values, problems),
        None => problems.add(
            ProblemCode::BadRecord,
            None,
            None,
            format!("{name} at byte {start} has the unknown type {kind} or a broken length"),
        ),
    }
    Ok(true)
}

/// Where a record belongs.
#[derive(Clone, Copy)]
struct Place {
    section: usize,
    /// Number of the state's directory; `None` for metadata.
    state: Option<u64>,
}

/// All sections of the family of containers.
struct Tree<'a> {
    selection: &'a Selection,
    sections: Vec<SectionData>,
    index: HashMap<String, usize>,
}

/// What is known of one section.
#[derive(Default)]
struct SectionData {
    name: String,
    metadata: HashMap<String, Vec<u8>>,
    integers: HashMap<String, Vec<i64>>,
    /// Directory numbers of the states, in order of appearance.
    states: Vec<u64>,
    state_index: HashMap<u64, usize>,
    times: Vec<Option<f64>>,
    /// Whether a state names other entities than the first one.
    other_ids: Vec<bool>,
    /// Components in order of appearance, with the states that have them.
    components: Vec<ComponentData>,
    component_index: HashMap<String, usize>,
    /// Index of a state that a cut record belongs to.
    cut_state: Option<usize>,
}

struct ComponentData {
    name: Arc<str>,
    /// Values of the first state that has it.
    width: usize,
    numeric: bool,
    /// Positions of the selected entities; `None` if the ids came later: then all are kept.
    kept: Option<Vec<usize>>,
    /// States that have it, in order of appearance.
    present: Vec<usize>,
    present_in: HashSet<usize>,
    /// Kept values of each of these states; empty if the component is not selected.
    rows: Vec<Vec<f64>>,
}

/// Components of a state that are not results.
const NOT_RESULTS: [&str; 4] = ["time", "cycle", "ids", "system"];

impl Tree<'_> {
    /// The section and state a path names; `None` for what is not a result of a binout.
    /// States are `d` and digits, padded or not; directories below them hold no results.
    fn place(&mut self, path: &[String]) -> Option<Place> {
        let (last, section) = path.split_last()?;
        if !SECTIONS.contains(&section.first()?.as_str()) {
            return None;
        }
        let state = match last.strip_prefix('d').filter(|d| d.bytes().all(|b| b.is_ascii_digit())) {
            Some(digits) => Some(digits.parse().ok()?),
            None if last == "metadata" => None,
            None => return None,
        };
        let name = section.join("/");
        let index = match self.index.get(&name) {
            Some(&index) => index,
            None => {
                self.sections.push(SectionData { name: name.clone(), ..SectionData::default() });
                self.index.insert(name, self.sections.len() - 1);
                self.sections.len() - 1
            }
        };
        Some(Place { section: index, state })
    }

    fn wants(&self, place: Place, name: &str) -> bool {
        let section = &self.sections[place.section].name;
        self.selection.section.as_ref().is_none_or(|s| s == section)
            && (["time", "ids"].contains(&name) || self.selection.wants_component(name))
    }

    /// Notes a component whose values are not kept.
    fn note(&mut self, place: Place, name: &str, bytes: u64, kind: u8) {
        let Some(state) = place.state else { return };
        let section = &mut self.sections[place.section];
        let size = match kind {
            1 | 5 => 1,
            2 | 6 => 2,
            3 | 7 | 9 => 4,
            _ => 8,
        };
        if NOT_RESULTS.contains(&name) {
            return;
        }
        let state = section.state(state);
        let width = usize::try_from(bytes / size).unwrap_or(usize::MAX);
        let index = section.component_index(name, width, self.selection);
        let component = &mut section.components[index];
        component.numeric = !matches!(kind, 1 | 5);
        component.mark(state);
    }

    fn store(&mut self, place: Place, name: &str, values: Values, problems: &mut Problems) {
        let section = &mut self.sections[place.section];
        let Some(number) = place.state else {
            match values {
                Values::Integers(values) => section.integers.insert(name.into(), values).is_some(),
                other => section.metadata.insert(name.into(), other.into_text()).is_some(),
            };
            return;
        };
        let state = section.state(number);
        if name == "ids" {
            let ids = values.into_integers();
            let known = section.integers.entry("ids".into()).or_insert_with(|| ids.clone());
            if *known != ids {
                problems.add(
                    ProblemCode::UnexpectedEntity,
                    None,
                    None,
                    format!("{}: the ids of state d{number} are not those of the states before it; its values are left out", section.name),
                );
                section.other_ids[state] = true;
            }
            return;
        }
        let Some(values) = values.into_reals() else { return };
        if name == "time" {
            if section.times[state].is_some() {
                problems.add(
                    ProblemCode::RepeatedState,
                    None,
                    None,
                    format!(
                        "{}: state d{number} appears again; its first values are kept",
                        section.name
                    ),
                );
            } else {
                section.times[state] = values.first().copied();
            }
            return;
        }
        if NOT_RESULTS.contains(&name) {
            return;
        }
        let index = section.component_index(name, values.len(), self.selection);
        let component = &mut section.components[index];
        if component.mark(state) {
            let row = match &component.kept {
                Some(kept) if values.len() == component.width => {
                    kept.iter().map(|&k| values[k]).collect()
                }
                _ => values,
            };
            component.rows.push(row);
        }
    }

    /// Notes that the container ends within a record of this directory.
    fn cut(&mut self, path: &[String]) {
        if let Some(Place { section, state: Some(state) }) = self.place(path) {
            let section = &mut self.sections[section];
            section.cut_state = Some(section.state(state));
        }
    }
}

impl SectionData {
    /// Index of the state of that directory number.
    fn state(&mut self, number: u64) -> usize {
        if let Some(&index) = self.state_index.get(&number) {
            return index;
        }
        self.states.push(number);
        self.times.push(None);
        self.other_ids.push(false);
        self.state_index.insert(number, self.states.len() - 1);
        self.states.len() - 1
    }

    fn component_index(&mut self, name: &str, width: usize, selection: &Selection) -> usize {
        if let Some(&index) = self.component_index.get(name) {
            return index;
        }
        let index = self.components.len();
        self.component_index.insert(name.to_string(), index);
        let kept = self.entities(name, width).map(|ids| {
            ids.iter().enumerate().filter(|(_, id)| selection.wants(**id)).map(|(k, _)| k).collect()
        });
        self.components.push(ComponentData {
            name: name.into(),
            width,
            numeric: true,
            kept,
            present: Vec::new(),
            present_in: HashSet::new(),
            rows: Vec::new(),
        });
        index
    }

    /// The entities that the values of a component belong to, by their number; `None` for
    /// a global quantity.
    fn entities(&self, component: &str, width: usize) -> Option<Vec<EntityId>> {
        let named = |key: &str| self.integers.get(key).filter(|ids| ids.len() == width);
        let by_kind = if component.ends_with("_moment") { "moment_ids" } else { "force_ids" };
        let ids = match named("ids") {
            Some(ids) => ids,
            None if component.ends_with("_force") || component.ends_with("_moment") => {
                named(by_kind)?
            }
            None => return None,
        };
        // Rows of two-sided contacts repeat their id.
        let sides = self.integers.get("side").filter(|sides| sides.len() == width);
        let entity = |(row, &id): (usize, &i64)| {
            let side = sides.map(|s| if s[row] == 0 { Side::SurfA } else { Side::SurfB });
            EntityId { id, side }
        };
        Some(ids.iter().enumerate().map(entity).collect())
    }

    /// A text of the metadata, without its padding.
    fn text(&self, key: &str) -> Option<String> {
        let text = String::from_utf8_lossy(self.metadata.get(key)?);
        let text = text.trim_matches(|c: char| c.is_whitespace() || c == '\0');
        (!text.is_empty()).then(|| text.to_string())
    }

    /// Titles by id: `legend` holds equally long texts, 70 or 80 bytes each.
    fn titles(&self) -> HashMap<i64, String> {
        let (Some(ids), Some(legend)) =
            (self.integers.get("legend_ids"), self.metadata.get("legend"))
        else {
            return HashMap::new();
        };
        let width = legend.len() / ids.len().max(1);
        if width == 0 {
            return HashMap::new();
        }
        let title = |bytes: &[u8]| {
            let text = String::from_utf8_lossy(bytes);
            text.trim_matches(|c: char| c.is_whitespace() || c == '\0').to_string()
        };
        ids.iter()
            .zip(legend.chunks(width))
            .map(|(&id, bytes)| (id, title(bytes)))
            .filter(|(_, title)| !title.is_empty())
            .collect()
    }

    /// Indices of the whole states in order of their numbers. A state is whole if it has a
    /// time and no record of it is cut; the last one must also have what the one before has.
    fn whole_states(&self, problems: &mut Problems) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.states.len()).collect();
        order.sort_by_key(|&i| self.states[i]);
        if !self.states.is_sorted() {
            problems.add(
                ProblemCode::TimeGoesBack,
                None,
                None,
                format!(
                    "{}: states are not in order of their numbers; they are returned in it",
                    self.name
                ),
            );
        }
        let last = order.last().copied();
        let before = order.len().checked_sub(2).map(|i| order[i]);
        let has = |state| self.components.iter().map(move |c| c.present_in.contains(&state));
        let mut drop = |state: usize, why: &str| {
            let number = self.states[state];
            problems.add(
                ProblemCode::IncompleteState,
                None,
                None,
                format!("{}: state d{number} is left out: {why}", self.name),
            );
            false
        };
        order.retain(|&state| {
            if self.other_ids[state] {
                return false; // said where it was found
            }
            if self.times[state].is_none_or(|t| !t.is_finite()) {
                return drop(state, "its time is missing");
            }
            if self.cut_state == Some(state) {
                return drop(state, "the file ends within it");
            }
            let lacks = before.is_some_and(|before| {
                has(before).zip(has(state)).any(|(before, now)| before && !now)
            });
            if Some(state) == last && lacks {
                return drop(state, "it has fewer components than the state before");
            }
            true
        });
        order
    }

    fn finish(self, selection: &Selection, problems: &mut Problems) -> SolverFile {
        let whole = self.whole_states(problems);
        let time: Arc<[f64]> = whole.iter().filter_map(|&s| self.times[s]).collect();
        let titles = self.titles();
        let mut entities: Vec<Entity> = Vec::new();
        let mut known = HashSet::new();
        let mut components = Vec::new();
        let mut histories = Vec::new();
        for component in self.components.iter().filter(|c| c.numeric) {
            let ids = self.entities(&component.name, component.width);
            if ids.is_none() && component.width != 1 {
                if component.width > 0 {
                    problems.add(
                        ProblemCode::UnreadRows,
                        None,
                        None,
                        format!(
                            "{}: {} has {} values a state and no ids of that number; it is not read",
                            self.name, component.name, component.width
                        ),
                    );
                }
                continue;
            }
            components.push(component.name.clone());
            for id in ids.iter().flatten().filter(|&&id| !whole.is_empty() && known.insert(id)) {
                entities.push(Entity { id: *id, title: titles.get(&id.id).cloned() });
            }
            if !component.rows.is_empty() {
                histories
                    .extend(self.histories(component, ids, &whole, &time, selection, problems));
            }
        }
        // Entity by entity, as in the text files.
        let rank: HashMap<EntityId, usize> =
            entities.iter().enumerate().map(|(k, e)| (e.id, k)).collect();
        histories.sort_by_key(|h: &History| h.entity.and_then(|e| rank.get(&e).copied()));
        let with_data: HashSet<i64> = known.iter().map(|e: &EntityId| e.id).collect();
        let mut legend: Vec<(i64, String)> =
            titles.into_iter().filter(|(id, _)| !with_data.contains(id)).collect();
        legend.sort();
        let without_data = legend
            .into_iter()
            .map(|(id, title)| WithoutData {
                id,
                title: Some(title),
                reason: NoDataReason::LegendOnly,
            })
            .collect();
        let version = match (self.text("version"), self.text("revision")) {
            (Some(version), Some(revision)) => Some(format!("{version} {revision}")),
            (version, _) => version,
        };
        SolverFile {
            format: "binout",
            section: self.name.clone(),
            solver: version.is_some().then(|| "LS-DYNA".to_string()),
            version,
            title: self.text("title"),
            entities,
            without_data,
            components: if whole.is_empty() { Vec::new() } else { components },
            time,
            histories,
            problems: Vec::new(),
        }
    }

    /// The histories of one component over the whole states.
    fn histories(
        &self,
        component: &ComponentData,
        ids: Option<Vec<EntityId>>,
        whole: &[usize],
        time: &Arc<[f64]>,
        selection: &Selection,
        problems: &mut Problems,
    ) -> Vec<History> {
        let entities: Vec<Option<EntityId>> = match &ids {
            Some(ids) => ids.iter().copied().filter(|&id| selection.wants(id)).map(Some).collect(),
            None => vec![None],
        };
        // Where a kept row holds each of them: in order, or by position if all were kept.
        let positions: Vec<usize> = match (&ids, &component.kept) {
            (Some(ids), None) => (0..ids.len()).filter(|&k| selection.wants(ids[k])).collect(),
            _ => (0..entities.len()).collect(),
        };
        let row_width = match component.kept {
            Some(_) => entities.len(),
            None => component.width,
        };
        let mut columns = vec![Vec::with_capacity(whole.len()); entities.len()];
        let row_of: HashMap<usize, &Vec<f64>> =
            component.present.iter().copied().zip(&component.rows).collect();
        let mut absent = 0;
        for state in whole {
            let row = row_of.get(state).filter(|row| row.len() == row_width);
            absent += usize::from(row.is_none());
            for (column, &k) in columns.iter_mut().zip(&positions) {
                column.push(row.map_or(f64::NAN, |row| row[k]));
            }
        }
        if absent > 0 && !entities.is_empty() {
            problems.add(
                ProblemCode::AbsentComponent,
                None,
                None,
                format!(
                    "{}: {} is missing from {absent} of {} states, or has another number of values; its values there are NaN",
                    self.name,
                    component.name,
                    whole.len()
                ),
            );
        }
        let history = |(entity, values)| History {
            entity,
            component: component.name.clone(),
            time: time.clone(),
            values,
        };
        entities.into_iter().zip(columns).map(history).collect()
    }
}

impl ComponentData {
    /// Notes that a state has it; false if it already had.
    fn mark(&mut self, state: usize) -> bool {
        self.present_in.insert(state) && {
            self.present.push(state);
            true
        }
    }
}

impl Tree<'_> {
    fn finish(self, mut problems: Problems) -> Vec<SolverFile> {
        let wanted = |name: &str| self.selection.section.as_ref().is_none_or(|s| s == name);
        let mut files: Vec<SolverFile> = Vec::new();
        for section in self.sections {
            if wanted(&section.name) {
                files.push(section.finish(self.selection, &mut problems));
            }
        }
        // The container's problems concern every section of it.
        let problems = problems.into_list();
        for file in &mut files {
            file.problems.clone_from(&problems);
        }
        files
    }
}
