//! One section: its metadata and its selected histories.

use std::collections::{HashMap, HashSet};
use std::io;
use std::sync::Arc;

use rayon::prelude::*;

use super::owners::Metadata;
use super::owners::{Entities, EntityList, OwnerSearch, row_name};
use super::records::Bytes;
use super::records::Section;
use super::states::StateReader;
use super::values::Series;
use crate::history::{EntityId, History};
use crate::solver::problem::{Diagnostics, Problem, ProblemCode};
use crate::solver::zeros;
use crate::solver::{Entity, NoDataReason, Selection, SolverFile, WithoutData};

/// Components of a state that are not results.
const NOT_RESULTS: [&str; 4] = ["time", "cycle", "ids", "system"];

pub(super) struct SectionReader<'a> {
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
        self.problems.extend(self.beyond_bound());
        self.problems.extend(self.states.absent(self.section));
        self.problems.extend(self.lost_ids());
        let Contents { entities, components, wanted } = self.contents()?;
        let histories = self.histories(wanted, &entities)?;
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
        Ok((file, self.problems))
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
        let read: Vec<(Vec<History>, Vec<Problem>)> = wanted
            .into_par_iter()
            .map(|series| {
                let (mut histories, mut found) = series.histories(states, selection, bytes)?;
                if !together {
                    found.extend(zeros::suspect(name, &histories));
                    keep_selected(&mut histories, selection);
                }
                Ok((histories, found))
            })
            .collect::<io::Result<_>>()?;
        let mut histories: Vec<History> = Vec::new();
        for (read, found) in read {
            histories.extend(read);
            self.problems.extend(found);
        }
        if together {
            self.problems.extend(zeros::suspect(name, &histories));
            keep_selected(&mut histories, selection);
        }
        let rank: HashMap<EntityId, usize> =
            entities.iter().enumerate().map(|(k, &id)| (id, k)).collect();
        histories.sort_by_cached_key(|h: &History| h.entity.and_then(|e| rank.get(&e).copied()));
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

/// Drops what was read for an audit only.
fn keep_selected(histories: &mut Vec<History>, selection: &Selection) {
    histories.retain(|h| {
        selection.wants_component(&h.component) && h.entity.is_none_or(|e| selection.wants(e))
    });
}
