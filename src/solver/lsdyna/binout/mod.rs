//! `binout`: LS-DYNA's binary histories, an LSDA container.
//!
//! First all records are noted with their places ([`records`]), then the selected values
//! are read: for each section its complete states ([`states`]), its metadata and the owners of
//! its component values ([`owners`]) and the values ([`values`]).
//!
//! A file that continues as `name%001`, `name%002`, … and the files `binout0000`,
//! `binout0001`, … of the processes of one run are one tree over several containers.
//!
//! Any directory with states is a section, whatever its name; other content of the container is listed.
//!
//! If a record occurs twice, the later one counts: a restart wrote it again. Entities
//! may differ between states (eroded elements): a state that lacks one has NaN there.
//!
//! A binout is walked record by record without its symbol tables, because a run that terminated early has not written them. The
//! walk only notes where records are, from 64 bytes each; then the selected values are read. The ids of a section apply
//! to the states written after them, until others are written. The file has no checksums: flipped bits within a
//! value cannot be detected.

mod blocks;
mod owners;
mod records;
mod states;
mod values;

use std::collections::{HashMap, HashSet};
use std::io;
use std::sync::Arc;

use super::lsda::Header;
use crate::history::{EntityId, History};
use crate::parallel;
use crate::solver::problem::{Diagnostics, Problem, ProblemCode};
use crate::solver::source::Source;
use crate::solver::{Entity, Format, NoDataReason, Selection, SolverFile, WithoutData, zeros};
use crate::words::counted;
use owners::{Entities, EntityList, Metadata, OwnerSearch, row_name};
use records::{Bytes, Section, Tree};
use states::StateReader;
use values::Series;

pub(crate) const FORMAT: Format = Format::binary("binout", recognises, read, blocks::open);

/// Whether a file begins with the header of an LSDA container.
pub(crate) fn recognises(head: &[u8]) -> bool {
    Header::parse(head).is_some()
}

/// Reads the selected histories of every section, or of the one selected. Empty if the container
/// has no section of histories: other data have no states with times.
fn read(parts: &[Box<dyn Source>], selection: &Selection) -> io::Result<Vec<SolverFile>> {
    let mut tree = Tree::default();
    for (number, part) in parts.iter().enumerate() {
        tree.walk(number, &**part)?;
    }
    let wanted = |name: &str| selection.section.as_ref().is_none_or(|s| s == name);
    let bytes = Bytes::new(parts, &tree.headers);
    // Damaged records concern all sections: what they held is not known.
    let common = std::mem::take(&mut tree.problems).into_list();
    let has_times = |s: &Section| s.component("time").is_some();
    let is_binout = |s: &Section| has_times(s) || s.states.is_empty();
    if !tree.sections.iter().any(is_binout) {
        return Ok(Vec::new());
    }
    let mut files = Vec::new();
    for section in tree.sections.iter().filter(|s| wanted(&s.name)) {
        let (mut file, problems) = SectionReader::open(section, bytes, selection)?.read()?;
        file.problems = common.iter().cloned().chain(problems.into_list()).collect();
        files.push(file);
    }
    let others = tree.others.iter().filter(|(name, _)| wanted(name));
    files.extend(others.map(|(name, &records)| unread(name, records)));
    Ok(files)
}

/// A directory whose data are not histories.
fn unread(name: &str, records: usize) -> SolverFile {
    let message = format!(
        "{name}: {} not read: they are not in states (d000001, d000002, …) with times",
        counted(records, "record")
    );
    SolverFile {
        format: FORMAT.name,
        section: name.into(),
        problems: vec![Problem::new(ProblemCode::UnreadRows, message)],
        ..SolverFile::default()
    }
}

/// Components of a state that are not results.
const NOT_RESULTS: [&str; 4] = ["time", "cycle", "ids", "system"];

struct SectionReader<'a> {
    section: &'a Section,
    bytes: Bytes<'a>,
    selection: &'a Selection,
    metadata: Metadata,
    states: StateReader,
    problems: Diagnostics,
}

/// What the section has, and what of it is to be read.
#[derive(Default)]
struct Contents<'a> {
    entities: Vec<EntityId>,
    components: Vec<Arc<str>>,
    wanted: Vec<Series<'a>>,
}

impl<'a> SectionReader<'a> {
    pub(crate) fn open(
        section: &'a Section,
        bytes: Bytes<'a>,
        selection: &'a Selection,
    ) -> io::Result<Self> {
        let metadata = Metadata::of(section, bytes)?;
        let (states, problems) = StateReader::of(section, bytes)?;
        Ok(Self { section, bytes, selection, metadata, states, problems })
    }

    pub(crate) fn read(mut self) -> io::Result<(SolverFile, Diagnostics)> {
        let Contents { entities, components, wanted } = self.contents()?;
        let histories = self.histories(wanted, &entities)?;
        Ok(self.file(entities, components, histories))
    }

    fn file(
        self,
        entities: Vec<EntityId>,
        components: Vec<Arc<str>>,
        histories: Vec<History>,
    ) -> (SolverFile, Diagnostics) {
        let version = match (&self.metadata.version, &self.metadata.revision) {
            (Some(version), Some(revision)) => Some(format!("{version} {revision}")),
            (version, _) => version.clone(),
        };
        let titles = &self.metadata.titles;
        let titled = |id: &EntityId| Entity { id: *id, title: titles.get(&id.id).cloned() };
        let file = SolverFile {
            format: "binout",
            section: self.section.name.clone(),
            solver: version.is_some().then(|| "LS-DYNA".to_string()),
            version,
            title: self.metadata.title.clone(),
            entities: entities.iter().map(titled).collect(),
            without_data: self.without_data(&entities),
            components: if self.states.whole.is_empty() { Vec::new() } else { components },
            time: self.states.time,
            histories,
            ..SolverFile::default()
        };
        (file, self.problems)
    }

    fn beyond_bound(&self) -> Option<Problem> {
        let left_out = self.section.left_out;
        let message = format!(
            "there are too many components; {left_out} records of further ones are left out"
        );
        (left_out > 0).then(|| self.section.problem(ProblemCode::UnreadRows, &message))
    }

    fn lost_ids(&self) -> Option<Problem> {
        let lists = [&self.metadata.ids, &self.metadata.force_ids, &self.metadata.moment_ids];
        let of_states = self.states.ids.iter().flatten().flat_map(|ids| ids.iter());
        let named = lists.into_iter().flatten().flatten().chain(of_states);
        let lost = named.filter(|id| self.section.is_lost(**id)).count();
        let message = format!(
            "{lost} ids are zero (was the file overwritten there?); what belongs to them is left out"
        );
        (lost > 0).then(|| self.section.problem(ProblemCode::BadRecord, &message))
    }

    fn contents(&mut self) -> io::Result<Contents<'a>> {
        let section = self.section;
        self.problems.extend(self.beyond_bound());
        self.problems.extend(self.states.absent(section));
        self.problems.extend(self.lost_ids());
        let mut contents = Contents::default();
        let mut known: HashSet<EntityId> = HashSet::new();
        let mut lists: Vec<EntityList> = Vec::new();
        let results = section.components.iter().filter(|c| !NOT_RESULTS.contains(&&*c.name));
        for component in results {
            let found = Entities::of(section, component, &self.metadata, &self.states, self.bytes)?;
            let (owners, points) = match found {
                OwnerSearch::Found(owners, points) => (owners, points),
                OwnerSearch::NoValues => continue,
                OwnerSearch::NoIds(problem) => {
                    self.problems.push(problem);
                    continue;
                }
            };
            let list = match lists.iter().position(|l| *l.entities == *owners.entities()) {
                Some(known) => known,
                None => {
                    let (list, problem) = EntityList::of(section, &owners);
                    self.problems.extend(problem);
                    lists.push(list);
                    lists.len() - 1
                }
            };
            let (list, owners) = (&lists[list], owners.sharing(&lists[list]));
            for id in list.entities.iter().filter(|id| !section.is_lost(id.id)) {
                if !self.states.whole.is_empty() && known.insert(*id) {
                    contents.entities.push(*id);
                }
            }
            for point in 0..points {
                let name = match point {
                    0 => component.name.clone(),
                    _ => format!("{}_ip{}", component.name, point + 1).into(),
                };
                let names: Vec<Arc<str>> =
                    (1..=list.most_rows).map(|ordinal| row_name(&name, ordinal)).collect();
                let audited = self.selection.audit && component.is_real();
                let is_wanted = names.iter().any(|name| self.selection.wants_component(name));
                contents.components.extend(names);
                if audited || is_wanted {
                    let (owners, point) = (owners.clone(), (points > 1).then_some(point));
                    contents.wanted.push(Series { section, component, name, owners, point });
                }
            }
        }
        Ok(contents)
    }

    /// The selected histories, entity by entity as in the text files.
    fn histories(
        &mut self,
        wanted: Vec<Series<'_>>,
        entities: &[EntityId],
    ) -> io::Result<Vec<History>> {
        let (states, selection, bytes) = (&self.states, self.selection, self.bytes);
        let name = &self.section.name;
        // Zeros of quantities that may vanish are recognised by the entity's other components.
        let together = zeros::may_vanish(name);
        let all = parallel::map(wanted, |series| -> io::Result<_> {
            let (mut histories, mut found) = series.histories(states, selection, bytes)?;
            if !together {
                found.extend(zeros::suspect(name, &histories));
                keep_selected(&mut histories, selection);
            }
            Ok((histories, found))
        });
        let mut histories: Vec<History> = Vec::new();
        for read in all {
            let (read, found) = read?;
            histories.extend(read);
            self.problems.extend(found);
        }
        if together {
            self.problems.extend(zeros::suspect(name, &histories));
            keep_selected(&mut histories, selection);
        }
        sort(&mut histories, entities);
        Ok(histories)
    }

    /// Entities of the legend without values.
    fn without_data(&self, entities: &[EntityId]) -> Vec<WithoutData> {
        let ids: HashSet<i64> = entities.iter().map(|e| e.id).collect();
        let titles = &self.metadata.titles;
        let mut legend: Vec<(&i64, &String)> =
            titles.iter().filter(|(id, _)| !ids.contains(id)).collect();
        legend.sort();
        let reason = NoDataReason::LegendOnly;
        let listed = legend.into_iter();
        listed.map(|(&id, title)| WithoutData { id, title: Some(title.clone()), reason }).collect()
    }
}

/// Sorts histories by their entities, as these are sorted.
fn sort(histories: &mut [History], entities: &[EntityId]) {
    let rank: HashMap<EntityId, usize> =
        entities.iter().enumerate().map(|(k, &id)| (id, k)).collect();
    histories.sort_by_cached_key(|h: &History| h.entity.and_then(|e| rank.get(&e).copied()));
}

/// Drops what was read for an audit only.
fn keep_selected(histories: &mut Vec<History>, selection: &Selection) {
    histories.retain(|h| {
        selection.wants_component(&h.component) && h.entity.is_none_or(|e| selection.wants(e))
    });
}
