//! FE's run of a whole train: the vehicles' speeds from a solver's file.

use crate::error::{Error, KeyPath, error};
use crate::file;
use crate::history::EntityId;
use crate::scenario::ReferenceTable;
use crate::solver::{self, Selection, WantedId};
use std::path::Path;

/// FE's motion of a train: time from the first contact on, speeds positive in the direction
/// in which the first train moves.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FeTrain {
    pub time_s: Vec<f64>,
    /// Vehicle, as the scenario names it, and its speed in m/s at each time.
    pub velocities: Vec<(String, Vec<f64>)>,
    /// Time by the clock that FE took, in s.
    pub wall_time_s: Option<f64>,
}

impl FeTrain {
    /// Speed of the fastest vehicle at the contact, in m/s.
    pub(super) fn fastest_m_per_s(&self) -> f64 {
        let firsts = self.velocities.iter().filter_map(|(_, v)| v.first());
        firsts.fold(0.0, |most: f64, v| most.max(v.abs()))
    }

    /// Reads what a scenario's reference names; `path` is the scenario's.
    pub(crate) fn read(path: &Path, reference: &ReferenceTable) -> Result<Self, Error> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let file = folder.join(&reference.file);
        let selection = Selection {
            ids: Some(reference.nodes.values().map(|&id| WantedId { id, side: None }).collect()),
            components: Some(vec![reference.component.clone()]),
            ..Selection::all()
        };
        let read = solver::read(&file, None, &selection).map_err(|error| {
            // Ids were selected in the order of the nodes.
            let mut nodes = reference.nodes.keys().enumerate();
            let node = nodes.find(|(k, _)| *error.key() == KeyPath::of("ids").item(*k));
            let key = match node {
                Some((_, name)) => KeyPath::of("nodes").key(name),
                None if error.is_about("component") => KeyPath::of("component"),
                None => KeyPath::of("file"),
            };
            error.at(KeyPath::of("reference").then(key))
        })?;
        let units = reference.units;
        let contact_s = reference.contact.map_or(0.0, |t| t.0);
        let first = read.time.iter().take_while(|&&t| t * units.time_s < contact_s).count();
        let time_s = read.time[first..].iter().map(|t| t * units.time_s - contact_s).collect();
        let mut velocities = Vec::new();
        for (name, &node) in &reference.nodes {
            let missing = || {
                error!(Comparison, "{path}: node {node} has no complete {component}: look with crumple inspect, and name another node or component in [reference]", component = reference.component, path = file.display()).at(KeyPath::of("reference.nodes").key(name))
            };
            let history = read.history(Some(EntityId::new(node)), &reference.component);
            let values = &history.ok_or_else(missing)?.values[first..];
            if values.iter().any(|v| !v.is_finite()) {
                return Err(missing());
            }
            velocities.push((name.clone(), values.iter().map(|v| v * units.speed()).collect()));
        }
        // The first train moves forwards, whichever way it went in FE.
        let fastest = velocities
            .iter()
            .filter_map(|(_, v): &(String, Vec<f64>)| v.first().copied())
            .fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
        if fastest < 0.0 {
            velocities.iter_mut().for_each(|(_, v)| v.iter_mut().for_each(|v| *v = -*v));
        }
        let case = file::read_text(&file.with_file_name("case.json"), 1 << 20).ok();
        let wall_time_s = case
            .and_then(|text| serde_json::from_str::<serde_json::Value>(&text).ok())
            .and_then(|case| case.get("engine_wall_time_s")?.as_f64());
        Ok(Self { time_s, velocities, wall_time_s })
    }
}
