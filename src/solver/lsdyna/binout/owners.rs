//! Metadata of a section, and the entities to which the values of a component belong.

use std::collections::{HashMap, HashSet};
use std::io;
use std::sync::Arc;

use super::records::{Bytes, Component, DataRecord, LISTS, Section};
use super::states::StateReader;
use crate::history::{EntityId, Side};
use crate::solver::problem::{Problem, ProblemCode};
use crate::solver::source::unpadded;

/// Values of one entity for several integration points that are distinguished.
const MAX_POINTS: usize = 128;
/// Rows that one entity has in a state; a node is in so many sets of constraints at most.
pub(super) const MAX_ROWS: usize = 20;
/// Sections in which an id that is there twice is a fault of the file.
const HAVE_ONE_ROW: [&str; 6] =
    ["nodout", "matsum", "rwforc/forces", "secforc", "rbdout", "abstat"];

/// Owners of the values of a component.
#[derive(Clone)]
pub(super) enum Entities {
    Global,
    /// One value per entity, in this order in every state.
    Fixed(Arc<[EntityId]>),
    /// Each state names its own entities; here all of them.
    OfState(Arc<[EntityId]>),
}

/// Result of the search for a component's owners.
pub(super) enum OwnerSearch {
    /// Owners, and values of each of them: one, or one for each integration point.
    Found(Entities, usize),
    /// The component has no values.
    NoValues,
    /// Its values fit no ids.
    NoIds(Problem),
}

impl Entities {
    pub(crate) fn of(
        section: &Section,
        component: &Component,
        metadata: &Metadata,
        states: &StateReader,
        bytes: Bytes<'_>,
    ) -> io::Result<OwnerSearch> {
        let first = states.whole.iter().find_map(|state| component.records.get(state));
        let any = first.or_else(|| component.first());
        let Some(width) = any.filter(|p| !p.payload.kind.is_text()).map(DataRecord::width) else {
            return Ok(OwnerSearch::NoValues);
        };
        if width == 0 || is_total(&component.name) {
            let is_one = width == 1;
            return Ok(if is_one {
                OwnerSearch::Found(Self::Global, 1)
            } else {
                OwnerSearch::NoValues
            });
        }
        if let Some(ids) = &states.ids {
            let with = (0..states.whole.len())
                .find(|&k| component.records.contains_key(&states.whole[k]) && !ids[k].is_empty());
            let count = with.map_or(0, |k| ids[k].len());
            if let Some(points) = points(section, states, count, width, bytes)? {
                let mut known = HashSet::new();
                let each = ids.iter().flat_map(|ids| ids.iter());
                let all = each.filter(|&&id| known.insert(id)).map(|id| EntityId::new(*id));
                return Ok(OwnerSearch::Found(Self::OfState(all.collect()), points));
            }
        }
        if let Some(ids) = metadata.entities(&component.name, width) {
            return Ok(OwnerSearch::Found(Self::Fixed(ids.into()), 1));
        }
        if width == 1 {
            return Ok(OwnerSearch::Found(Self::Global, 1));
        }
        let message = format!(
            "{} has {width} values per state but a different number of ids; it is not read",
            component.name
        );
        Ok(OwnerSearch::NoIds(section.problem(ProblemCode::UnreadRows, &message)))
    }

    pub(crate) fn entities(&self) -> &[EntityId] {
        match self {
            Self::Global => &[],
            Self::Fixed(ids) | Self::OfState(ids) => ids,
        }
    }

    /// The same with a list that other components have as well.
    pub(crate) fn sharing(self, list: &EntityList) -> Self {
        match self {
            Self::Global => self,
            Self::Fixed(_) => Self::Fixed(list.entities.clone()),
            Self::OfState(_) => Self::OfState(list.entities.clone()),
        }
    }
}

/// Values of each of `count` entities: one, or as many as integration points if the
/// section says that all have the same number of them (`nip`).
fn points(
    section: &Section,
    states: &StateReader,
    count: usize,
    width: usize,
    bytes: Bytes<'_>,
) -> io::Result<Option<usize>> {
    if count == 0 || width == count {
        return Ok((width == count).then_some(1));
    }
    let record = section
        .component("nip")
        .and_then(|nip| states.whole.iter().find_map(|state| nip.records.get(state)));
    let Some(&record) = record else { return Ok(None) };
    let nip = bytes.integers(record)?;
    let points = width / count;
    let agrees = nip.len() == count
        && points * count == width
        && (2..=MAX_POINTS).contains(&points)
        && nip.iter().all(|&n| usize::try_from(n) == Ok(points));
    Ok(agrees.then_some(points))
}

/// Entities that one component or several have values of.
pub(super) struct EntityList {
    pub entities: Arc<[EntityId]>,
    /// Rows of the entity that has most, as far as they are read.
    pub most_rows: usize,
}

impl EntityList {
    /// The list, and which entities are there more often than they can be.
    pub(crate) fn of(section: &Section, owners: &Entities) -> (Self, Option<Problem>) {
        let entities: Arc<[EntityId]> = owners.entities().into();
        let ordinals = ordinals(&entities);
        let rows = || ordinals.iter().zip(&*entities).filter(|(_, id)| !section.is_lost(id.id));
        let most_rows = rows().map(|(&row, _)| row).max().unwrap_or(1);
        let limit = if HAVE_ONE_ROW.contains(&&*section.name) { 1 } else { MAX_ROWS };
        let problem = (most_rows > limit).then(|| {
            let again = rows().filter(|(row, _)| **row == limit + 1).count();
            let first = rows().find(|(row, _)| **row == limit + 1).map(|(_, id)| id.to_string());
            let message = format!(
                "{again} ids, the first {}, occur more than {} in one state; {}",
                first.unwrap_or_default(),
                if limit == 1 { "once".to_string() } else { format!("{limit} times") },
                if limit == 1 {
                    "their further rows are components whose names end with _2, _3, …".into()
                } else {
                    format!("rows beyond the first {MAX_ROWS} are left out")
                },
            );
            section.problem(ProblemCode::RepeatedLabel, &message)
        });
        (Self { entities, most_rows: most_rows.min(MAX_ROWS) }, problem)
    }
}

/// Sums over all entities of a section (bndout, spcforc), whose number of values shows
/// nothing where there is one entity.
fn is_total(name: &str) -> bool {
    name == "etotal" || name.ends_with("_total") || name.ends_with("_resultant")
}

/// Ordinal of each row of a state among the rows of its entity, from 1: a node in two sets of
/// constraints has two rows. Empty if every entity has one.
pub(super) fn ordinals(entities: &[EntityId]) -> Vec<usize> {
    if entities.windows(2).all(|pair| pair[0].id < pair[1].id) {
        return Vec::new();
    }
    let mut seen: HashMap<EntityId, usize> = HashMap::new();
    let ordinals: Vec<usize> = entities
        .iter()
        .map(|&entity| {
            let count = seen.entry(entity).or_default();
            *count += 1;
            *count
        })
        .collect();
    if seen.len() == entities.len() { Vec::new() } else { ordinals }
}

/// The name of the values of an entity's row of that ordinal, as in the text files.
pub(super) fn row_name(component: &Arc<str>, ordinal: usize) -> Arc<str> {
    if ordinal > 1 { format!("{component}_{ordinal}").into() } else { component.clone() }
}

pub(crate) struct Metadata {
    pub title: Option<String>,
    pub version: Option<String>,
    pub revision: Option<String>,
    pub titles: HashMap<i64, String>,
    pub ids: Option<Vec<i64>>,
    pub side: Option<Vec<i64>>,
    pub force_ids: Option<Vec<i64>>,
    pub moment_ids: Option<Vec<i64>>,
    /// Lists of ids of sections that call them otherwise, such as `ICV_ID.`, with what their names begin with.
    other_ids: Vec<(String, Vec<i64>)>,
}

impl Metadata {
    pub(crate) fn of(section: &Section, bytes: Bytes<'_>) -> io::Result<Self> {
        let text = |key: &str| -> io::Result<Option<Vec<u8>>> {
            let place = section.metadata.get(key).filter(|p| p.payload.kind.is_text());
            place.map(|&place| bytes.text(place)).transpose()
        };
        let numbers = |key: &str| -> io::Result<Option<Vec<i64>>> {
            section.metadata.get(key).map(|&place| bytes.integers(place)).transpose()
        };
        let plain = |bytes: Option<Vec<u8>>| bytes.and_then(|b| unpadded(&b));
        let mut other_ids = Vec::new();
        if !LISTS.iter().any(|list| section.metadata.contains_key(*list)) {
            for (key, &place) in &section.metadata {
                let at = key.to_ascii_lowercase().rfind("id").filter(|_| key != "legend_ids");
                let is_list = !place.payload.kind.is_text() && !place.payload.kind.is_real();
                if let Some(at) = at.filter(|_| is_list && place.payload.kind.size().is_some()) {
                    other_ids.push((key[..at].to_string(), bytes.integers(place)?));
                }
            }
            other_ids.sort();
        }
        Ok(Self {
            other_ids,
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

    /// The entities that the values of a component belong to, by their number.
    pub(crate) fn entities(&self, component: &str, width: usize) -> Option<Vec<EntityId>> {
        let fits = |ids: &Option<Vec<i64>>| ids.clone().filter(|ids| ids.len() == width);
        let ids = fits(&self.ids).or_else(|| match component {
            c if c.ends_with("_force") => fits(&self.force_ids),
            c if c.ends_with("_moment") => fits(&self.moment_ids),
            _ => self.other_ids_of(component, width),
        })?;
        // Rows of two-sided contacts repeat their id.
        let sides = fits(&self.side);
        let side =
            |k: usize| sides.as_ref().map(|s| if s[k] == 0 { Side::SurfA } else { Side::SurfB });
        Some(ids.into_iter().enumerate().map(|(k, id)| EntityId { id, side: side(k) }).collect())
    }
}

impl Metadata {
    /// The list whose name begins most like the component's.
    fn other_ids_of(&self, component: &str, width: usize) -> Option<Vec<i64>> {
        let alike = |start: &str| {
            start
                .bytes()
                .zip(component.bytes())
                .take_while(|(a, b)| a.eq_ignore_ascii_case(b))
                .count()
        };
        let fitting = self.other_ids.iter().filter(|(_, ids)| ids.len() == width);
        // Of equal ones the shortest name: all of it is there.
        let best = fitting.max_by_key(|(start, _)| (alike(start), std::cmp::Reverse(start.len())));
        best.map(|(_, ids)| ids.clone())
    }
}

/// Titles by id: `legend` holds equally long texts, 70 or 80 bytes each.
fn titles(ids: Option<Vec<i64>>, legend: Option<Vec<u8>>) -> HashMap<i64, String> {
    let (Some(ids), Some(legend)) = (ids, legend) else { return HashMap::new() };
    let width = legend.len() / ids.len().max(1);
    if width == 0 {
        return HashMap::new();
    }
    let titled = ids.iter().zip(legend.chunks(width));
    titled.filter_map(|(&id, bytes)| Some((id, unpadded(bytes)?))).collect()
}
