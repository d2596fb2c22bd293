//! Histories as HDF5: one dataset per component, states by entities.

use std::collections::{HashMap, HashSet};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use crate::file::{WriteError, write_at, write_whole};
use crate::hdf5::skeleton::{Skeleton, write_all_at};
use crate::hdf5::{self, AttrValue, DatasetBuilder, FileBuilder, OpenError};
use crate::history::{EntityId, History, Side};
use crate::solver::{self, Blocks, ReadError, Selection, SolverFile};

/// Why a solver's file could not be converted.
#[derive(Debug, thiserror::Error)]
pub enum ConvertError {
    /// The solver's file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// HDF5 cannot hold the histories.
    #[error("cannot encode the histories: {detail}")]
    Encode {
        /// Why not, in the words of the library.
        detail: String,
    },
    /// The output cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Converts the selected histories of the file at `input` to HDF5, in the solver's units.
///
/// An undamaged nodout is written state by state while it is read, on all threads, and
/// never held as a whole; any other file is read first. Gives back what the file says of
/// itself, with its problems; the histories are left out where they went straight on.
///
/// # Errors
/// [`ConvertError`] if the file cannot be read or the output not be written; the output is
/// then unchanged.
pub fn convert(
    input: &Path,
    format: Option<&str>,
    selection: &Selection,
    output: &Path,
) -> Result<SolverFile, ConvertError> {
    // Neither can be opened twice, nor be written at any place.
    let is_file = |path: &Path| path.metadata().is_ok_and(|meta| meta.is_file());
    let is_device = output.exists() && !is_file(output);
    if !is_device
        && is_file(input)
        && let Some(blocks) = solver::blocks(input, format, selection)?
        && let Some(file) = stream(input, blocks, output)?
    {
        return Ok(file);
    }
    let file = solver::read(input, format, selection)?;
    write_whole(output, &encode(&file)?)?;
    Ok(file)
}

/// Whether a file is HDF5 but no file of histories: a curve database, or of someone else.
/// What cannot be read as HDF5 to its root counts as such, since a table may be damaged.
pub fn is_other_hdf5(path: &Path) -> bool {
    let format = match hdf5::open(path) {
        Ok(file) => match file.root().attrs().ok().and_then(|mut a| a.remove("format")) {
            Some(AttrValue::String(format)) => Some(format),
            _ => None,
        },
        Err(OpenError::Damaged { .. }) => None,
        Err(OpenError::Io(_) | OpenError::NoSignature) => return false,
    };
    format.as_deref() != Some(FORMAT)
}

/// Encodes the selected histories of a file, in the solver's units.
///
/// `/time` holds one time per state; `/<component>` has the shape states × entities (or
/// states, for a global quantity) and the attribute `ids`, for interfaces also `sides`.
/// Of more than 8 000 entities, which no attribute holds, the ids are the dataset
/// `/ids/<component>` and the sides `/sides/<component>`. A component whose name cannot be a
/// dataset's has `_` in it, and its own name in the attribute `component`.
pub fn encode(file: &SolverFile) -> Result<Vec<u8>, ConvertError> {
    let mut out = builder(file);
    let mut components: Vec<(&Arc<str>, Vec<&History>)> = Vec::new();
    let mut index: HashMap<&Arc<str>, usize> = HashMap::new();
    for history in &file.histories {
        let k = *index.entry(&history.component).or_insert_with(|| {
            components.push((&history.component, Vec::new()));
            components.len() - 1
        });
        components[k].1.push(history);
    }
    let mut long = Vec::new();
    let mut names = Names::default();
    for (component, channels) in components {
        let name = names.of(component);
        let dataset = out.create_dataset(&name);
        if *name != **component {
            dataset.set_attr("component", AttrValue::String(component.to_string()));
        }
        let entities: Vec<EntityId> = channels.iter().filter_map(|h| h.entity).collect();
        if entities.is_empty() {
            dataset.with_f64_data(&channels[0].values);
            continue;
        }
        let mut rows = Vec::with_capacity(file.time.len() * channels.len());
        for state in 0..file.time.len() {
            rows.extend(channels.iter().map(|h| h.values[state]));
        }
        dataset.with_f64_data(&rows).with_shape(&[file.time.len() as u64, channels.len() as u64]);
        if !describe(dataset, &entities) {
            long.push((name, entities));
        }
    }
    long_ids(&mut out, &long)?;
    out.finish().map_err(not_encoded)
}

fn not_encoded(error: hdf5::Error) -> ConvertError {
    ConvertError::Encode { detail: error.to_string() }
}

/// A file with what describes the source, and the times.
fn builder(file: &SolverFile) -> FileBuilder {
    let mut out = FileBuilder::new();
    out.set_attr("format", AttrValue::String(FORMAT.into()));
    out.set_attr("source_format", AttrValue::String(file.format.into()));
    for (name, value) in [("title", &file.title), ("version", &file.version)] {
        if let Some(value) = value {
            out.set_attr(name, AttrValue::String(value.clone()));
        }
    }
    out.create_dataset(TIME).with_f64_data(&file.time);
    out
}

/// Entities whose ids an attribute can hold (64 KiB).
const MAX_IDS: usize = 8_000;

/// Writes the entities of a dataset as its attributes; false if there are too many.
fn describe(dataset: &mut DatasetBuilder, entities: &[EntityId]) -> bool {
    if entities.len() > MAX_IDS {
        return false;
    }
    dataset.set_attr("ids", AttrValue::I64Array(entities.iter().map(|e| e.id).collect()));
    if let Some(sides) = sides(entities) {
        let sides = sides.into_iter().map(String::from).collect();
        dataset.set_attr("sides", AttrValue::StringArray(sides));
    }
    true
}

/// Names of the sides, if all entities have one.
fn sides(entities: &[EntityId]) -> Option<Vec<&'static str>> {
    entities.iter().map(|e| e.side.map(Side::name)).collect()
}

/// Writes the entities that no attribute holds.
fn long_ids(out: &mut FileBuilder, long: &[(String, Vec<EntityId>)]) -> Result<(), ConvertError> {
    if long.is_empty() {
        return Ok(());
    }
    let mut group = out.create_group(IDS);
    for (name, entities) in long {
        let ids: Vec<i64> = entities.iter().map(|e| e.id).collect();
        group.create_dataset(name).with_i64_data(&ids);
    }
    out.add_group(group.finish());
    let with_sides: Vec<_> =
        long.iter().filter_map(|(name, entities)| Some((name, sides(entities)?))).collect();
    if with_sides.is_empty() {
        return Ok(());
    }
    let mut group = out.create_group(SIDES);
    for (name, sides) in with_sides {
        let failed = |error| ConvertError::Encode { detail: format!("{error}") };
        group.create_dataset(name).with_ascii_strings(&sides).map_err(failed)?;
    }
    out.add_group(group.finish());
    Ok(())
}

/// Root attribute `format` of these files.
const FORMAT: &str = "crumple histories";
const TIME: &str = "time";
const IDS: &str = "ids";
const SIDES: &str = "sides";

/// Gives components names that datasets can have, each another.
#[derive(Default)]
struct Names {
    taken: HashSet<String>,
}

impl Names {
    /// A dataset's name has no `/`, which would be a path, and is no name of this layout.
    fn of(&mut self, component: &str) -> String {
        let mut name = component.replace(['/', '\0'], "_");
        while matches!(&*name, "" | "." | TIME | IDS | SIDES) || self.taken.contains(&name) {
            name.push('_');
        }
        self.taken.insert(name.clone());
        name
    }
}

/// States that are handed on together, so that writes are not too short; of states with
/// more values than this each alone.
const TOGETHER: usize = 2;
const MANY_VALUES: usize = 1 << 18;

/// Writes a nodout state by state. `None` if it turns out to be damaged.
fn stream(input: &Path, blocks: Blocks, output: &Path) -> Result<Option<SolverFile>, ConvertError> {
    let states = blocks.file.time.len();
    let mut out = builder(&blocks.file);
    let mut skeleton = Skeleton::default();
    let mut long = Vec::new();
    for column in &blocks.columns {
        let dataset = out.create_dataset(&column.component);
        skeleton.reserve(dataset, states, column.entities.len());
        if !describe(dataset, &column.entities) {
            long.push((column.component.clone(), column.entities.clone()));
        }
    }
    long_ids(&mut out, &long)?;
    let failed_read = |source| ReadError::Io { path: PathBuf::from(input), source };
    let mut read_error = None;
    let written = write_at(output, |file| {
        let Some(offsets) = skeleton.write(out, file)? else { return Ok(None) };
        match fill(&blocks, &offsets, file) {
            Ok(whole) => Ok(whole.then_some(())),
            Err(Trouble::Writing(error)) => Err(error),
            Err(Trouble::Reading(error)) => {
                read_error = Some(error);
                Ok(None)
            }
        }
    })?;
    if let Some(error) = read_error {
        return Err(failed_read(error).into());
    }
    Ok(written.map(|()| blocks.file))
}

enum Trouble {
    Reading(io::Error),
    Writing(io::Error),
}

/// Reads all states and writes their values to `offsets`, one per column; false if a state
/// is damaged.
fn fill(blocks: &Blocks, offsets: &[u64], file: &File) -> Result<bool, Trouble> {
    let states = blocks.file.time.len();
    let values = blocks.values();
    let together = if values > MANY_VALUES { 1 } else { TOGETHER };
    let damaged = AtomicBool::new(false);
    (0..states.div_ceil(together)).into_par_iter().try_for_each_init(
        || (blocks.window(), vec![0.0; values * together], Vec::new()),
        |(window, read, bytes), group| {
            let first = group * together;
            let count = together.min(states - first);
            for (k, state) in read.chunks_exact_mut(values).take(count).enumerate() {
                if damaged.load(Ordering::Relaxed) {
                    return Ok(());
                }
                if !blocks.read(window, first + k, state).map_err(Trouble::Reading)? {
                    damaged.store(true, Ordering::Relaxed);
                }
            }
            let mut start = 0;
            for (column, offset) in blocks.columns.iter().zip(offsets) {
                let width = column.entities.len();
                bytes.clear();
                for state in read.chunks_exact(values).take(count) {
                    let row = &state[start..start + width];
                    bytes.extend(row.iter().flat_map(|value| value.to_le_bytes()));
                }
                let at = offset + (first * width * size_of::<f64>()) as u64;
                write_all_at(file, bytes, at).map_err(Trouble::Writing)?;
                start += width;
            }
            Ok(())
        },
    )?;
    Ok(!damaged.into_inner())
}
