//! Histories as HDF5: one dataset per component, states by entities.

use std::sync::Arc;

use hdf5_pure::{AttrValue, FileBuilder};

use super::DatabaseError;
use crate::history::{EntityId, History};
use crate::solver::SolverFile;

/// Encodes the selected histories of a file, in the solver's units.
///
/// `/time` holds one time per state; `/<component>` has the shape states × entities (or
/// states, for a global quantity) and the attribute `ids`, for interfaces also `sides`.
pub fn histories_to_hdf5(file: &SolverFile) -> Result<Vec<u8>, DatabaseError> {
    let mut out = FileBuilder::new();
    out.set_attr("format", AttrValue::String("crumple histories".into()));
    out.set_attr("source_format", AttrValue::String(file.format.into()));
    for (name, value) in [("title", &file.title), ("version", &file.version)] {
        if let Some(value) = value {
            out.set_attr(name, AttrValue::String(value.clone()));
        }
    }
    let states = file.time.len();
    out.create_dataset("time").with_f64_data(&file.time);
    let mut components: Vec<&Arc<str>> = Vec::new();
    for history in &file.histories {
        if !components.contains(&&history.component) {
            components.push(&history.component);
        }
    }
    for component in components {
        let channels: Vec<&History> =
            file.histories.iter().filter(|h| h.component == *component).collect();
        let dataset = out.create_dataset(component);
        let entities: Vec<EntityId> = channels.iter().filter_map(|h| h.entity).collect();
        if entities.is_empty() {
            dataset.with_f64_data(&channels[0].values);
            continue;
        }
        let rows: Vec<f64> =
            (0..states).flat_map(|state| channels.iter().map(move |h| h.values[state])).collect();
        dataset
            .with_f64_data(&rows)
            .with_shape(&[states as u64, channels.len() as u64])
            .set_attr("ids", AttrValue::I64Array(entities.iter().map(|e| e.id).collect()));
        let sides: Vec<String> =
            entities.iter().filter_map(|e| e.side).map(|s| s.name().to_string()).collect();
        if sides.len() == entities.len() {
            dataset.set_attr("sides", AttrValue::StringArray(sides));
        }
    }
    out.finish().map_err(|e| DatabaseError::Encode { detail: e.to_string() })
}
