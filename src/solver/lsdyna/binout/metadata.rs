//! Metadata of a section: title, version, ids, sides, titles of entities.

use std::collections::HashMap;
use std::io;

use super::bytes::Bytes;
use super::records::{LISTS, Section};
use crate::history::{EntityId, Side};
use crate::solver::source::unpadded;

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
