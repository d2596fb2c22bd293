//! Histories as HDF5: one dataset per component, states by entities.

mod units;

use crate::error::{Error, error};
use std::collections::{HashMap, HashSet};
use std::fs::File;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use crate::file::{write_at, write_whole};
use crate::hdf5::Skeleton;
use crate::hdf5::{self, AttrValue, DatasetBuilder, FileBuilder, OpenError};
use crate::history::{EntityId, History, Side};
use crate::os::write_all_at;
use crate::solver::lsdyna::deck::Deck;
use crate::solver::{self, Blocks, Selection, SolverFile, decks};
use crate::unit::UnitSystem;
use units::unit_of;

/// Converts the selected histories of the file at `input` to HDF5, in the solver's units.
///
/// An undamaged LS-DYNA file is written state by state while it is read, on all threads, and
/// never held as a whole; any other file is read first. Gives back what the file says of
/// itself, with its problems; the histories are left out where they went straight on.
pub(crate) fn convert(
    input: &Path,
    format: Option<&str>,
    selection: &Selection,
    units: Option<UnitSystem>,
    deck: Option<&Deck>,
    storage: Storage,
    output: &Path,
) -> Result<SolverFile, Error> {
    if !storage.by_entity
        && can_stream(input, Some(output))
        && let Some(blocks) = solver::blocks(input, format, selection)?
        && let Some(file) = stream(input, blocks, units, deck, storage, output)?
    {
        return Ok(file);
    }
    let file = solver::read(input, format, selection)?;
    write_whole(output, &encode_in(storage, &file, units, deck, Some(input))?)?;
    Ok(file)
}

/// Whether a file can be opened twice, and another be written at any place.
pub(crate) fn can_stream(input: &Path, output: Option<&Path>) -> bool {
    let is_file = |path: &Path| path.metadata().is_ok_and(|meta| meta.is_file());
    output.is_none_or(|output| !output.exists() || is_file(output)) && is_file(input)
}

/// Whether a file is HDF5 but no file of histories: a curve database, or of someone else.
/// What cannot be read as HDF5 to its root counts as such, since a table may be damaged.
pub(crate) fn is_other_hdf5(path: &Path) -> bool {
    let format = match hdf5::open(path) {
        Ok((file, _)) => {
            let attributes = file.root().attrs().ok();
            attributes.and_then(|a| Some(a.get("format")?.as_str()?.to_string()))
        }
        Err(OpenError::Damaged { .. } | OpenError::Cut { .. } | OpenError::InUse) => None,
        Err(OpenError::Io(_) | OpenError::NoSignature) => return false,
    };
    format.as_deref() != Some(FORMAT)
}

/// Encodes the selected histories of a file, in the solver's units; `source` is its path.
///
/// `/time` holds one time per state; `/<component>` has the shape states × entities (or
/// states, for a global quantity) and the attribute `ids`, for interfaces also `sides`.
/// What no attribute holds is a dataset: of more than 8 000 entities the ids in
/// `/ids/<component>`, of more than 4 000 the sides in `/sides/<component>`. A component whose
/// name cannot be a dataset's has `_` in it, and its own name in the attribute `component`.
///
/// Beside `time` a dataset that is called by the word for the entities, such as `node`, holds the
/// ids and has the attributes `ids`, `sides` and `titles`, where there are any (of more than 4 000
/// entities the dataset `/titles/node`). Other entities have one of their own, `node_2`. Where the units are known, every dataset whose name determines its quantity
/// has the attribute `units`.
///
/// # Errors
/// If HDF5 cannot hold them, or a history has another number of values than there are times.
pub fn encode(
    file: &SolverFile,
    units: Option<UnitSystem>,
    deck: Option<&Deck>,
    source: Option<&Path>,
) -> Result<Vec<u8>, Error> {
    encode_in(Storage::default(), file, units, deck, source)
}

/// How values are stored; times are always doubles.
#[derive(Clone, Copy, Default)]
pub(crate) struct Storage {
    /// In single precision.
    pub single: bool,
    /// In chunks of all states of some entities instead of state by state.
    pub by_entity: bool,
}

/// Bytes of a chunk, if one entity does not have more.
const CHUNK: usize = 1 << 16;

impl Storage {
    fn size(self) -> usize {
        if self.single { size_of::<f32>() } else { size_of::<f64>() }
    }

    /// Writes the bytes of values into their place.
    #[inline]
    fn put(self, values: &[f64], place: &mut [u8]) {
        match self.single {
            false => {
                let place = &mut place.as_chunks_mut().0[..values.len()];
                (0..values.len()).for_each(|k| place[k] = values[k].to_le_bytes());
            }
            true => {
                let place = &mut place.as_chunks_mut().0[..values.len()];
                (0..values.len()).for_each(|k| place[k] = (values[k] as f32).to_le_bytes());
            }
        }
    }

    /// Gives a dataset its values, state by state.
    fn fill(self, dataset: &mut DatasetBuilder, values: &[f64], shape: &[u64]) {
        match self.single {
            false => dataset.with_f64_data(values),
            true => dataset.with_f32_data(&values.iter().map(|v| *v as f32).collect::<Vec<_>>()),
        };
        dataset.with_shape(shape);
        if let (true, &[states, entities]) = (self.by_entity && !values.is_empty(), shape) {
            let together = (CHUNK / self.size()) as u64 / states;
            dataset.with_chunks(&[states, together.clamp(1, entities)]);
        }
    }
}

/// The same with another storage.
pub(crate) fn encode_in(
    storage: Storage,
    file: &SolverFile,
    units: Option<UnitSystem>,
    deck: Option<&Deck>,
    source: Option<&Path>,
) -> Result<Vec<u8>, Error> {
    if let Some(history) = file.histories.iter().find(|h| h.values.len() != file.time.len()) {
        let (label, values, times) = (history.label(), history.values.len(), file.time.len());
        return Err(not_encoded(format!("{label} has {values} values for {times} times")));
    }
    let mut layout = Layout::of(file, units, deck, source);
    let mut components: Vec<(&Arc<str>, Vec<&History>)> = Vec::new();
    let mut index: HashMap<&Arc<str>, usize> = HashMap::new();
    for history in &file.histories {
        let k = *index.entry(&history.component).or_insert_with(|| {
            components.push((&history.component, Vec::new()));
            components.len() - 1
        });
        components[k].1.push(history);
    }
    for (component, channels) in components {
        let entities: Vec<EntityId> = channels.iter().filter_map(|h| h.entity).collect();
        let dataset = layout.component(component, &entities);
        let states = file.time.len() as u64;
        if entities.is_empty() {
            storage.fill(dataset, &channels[0].values, &[states]);
            continue;
        }
        let mut rows = Vec::with_capacity(file.time.len() * channels.len());
        for state in 0..file.time.len() {
            rows.extend(channels.iter().map(|h| h.values[state]));
        }
        storage.fill(dataset, &rows, &[states, channels.len() as u64]);
    }
    layout.finish()?.finish().map_err(not_encoded)
}

fn not_encoded(error: impl std::fmt::Display) -> Error {
    error!(SolverFile, "cannot encode the histories: {error}")
}

/// A file of histories under work: everything but the values of components.
struct Layout {
    out: FileBuilder,
    names: Names,
    /// Section of the solver file.
    section: String,
    units: Option<UnitSystem>,
    titles: HashMap<EntityId, String>,
    entities: Vec<Vec<EntityId>>,
    /// Components, and dimensions with titles, of more entities than an attribute holds texts of.
    long: Vec<(String, Vec<EntityId>)>,
    titles_of: Vec<(String, Vec<EntityId>)>,
}

impl Layout {
    /// A file with what describes the source, and the times.
    fn of(
        file: &SolverFile,
        units: Option<UnitSystem>,
        deck: Option<&Deck>,
        source: Option<&Path>,
    ) -> Self {
        let mut out = FileBuilder::new();
        let mut attr = |name: &str, value: &str| {
            out.set_attr(name, AttrValue::VarLenString(value.into()));
        };
        attr("format", FORMAT);
        attr("source_format", file.format);
        for (name, value) in [("title", &file.title), ("version", &file.version)] {
            value.iter().for_each(|value| attr(name, value));
        }
        if let Some(path) = source.and_then(|path| std::path::absolute(path).ok()) {
            attr("source", &path.display().to_string());
        }
        let stated = || deck?.units.as_ref()?.system;
        let units = units.or_else(stated);
        units.iter().for_each(|units| attr("units", &units.to_string()));
        let dataset = out.create_dataset(TIME);
        dataset.with_f64_data(&file.time);
        if let Some(units) = units {
            dataset.set_attr(UNITS, AttrValue::VarLenString(units.names().2.into()));
        }
        let mut entities = file.entities.clone();
        if let Some(deck) = deck {
            decks::fill_entity_titles(&file.section, &mut entities, deck);
        }
        let titles = entities.into_iter().filter_map(|e| Some((e.id, e.title?)));
        Self {
            out,
            names: Names::default(),
            section: file.section.clone(),
            units,
            titles: titles.collect(),
            entities: Vec::new(),
            long: Vec::new(),
            titles_of: Vec::new(),
        }
    }

    /// The dataset of a component, with everything but its values.
    fn component(&mut self, component: &str, entities: &[EntityId]) -> &mut DatasetBuilder {
        if !entities.is_empty() && !self.entities.iter().any(|known| known == entities) {
            self.entities(entities);
        }
        let name = self.names.of(component);
        if entities.len() > MAX_TEXTS {
            self.long.push((name.clone(), entities.to_vec()));
        }
        let dataset = self.out.create_dataset(&name);
        if name != component {
            dataset.set_attr("component", AttrValue::VarLenString(component.into()));
        }
        let unit = self.units.and_then(|units| unit_of(&self.section, component, units));
        if let Some(unit) = unit {
            dataset.set_attr(UNITS, AttrValue::VarLenString(unit));
        }
        describe(dataset, entities);
        dataset
    }

    /// The dataset with the ids of these entities.
    fn entities(&mut self, entities: &[EntityId]) {
        let word = solver::entity_word(&self.section).replace(' ', "_");
        let name = match self.entities.len() {
            0 => word,
            before => format!("{word}_{}", before + 1),
        };
        let name = self.names.of(&name);
        let dataset = self.out.create_dataset(&name);
        dataset.with_i64_data(&ids(entities));
        describe(dataset, entities);
        let title = |e: &EntityId| self.titles.get(e).map_or("", String::as_str);
        let titles: Vec<&str> = entities.iter().map(title).collect();
        if titles.iter().any(|title| !title.is_empty()) {
            if titles.len() <= MAX_TEXTS {
                dataset.set_attr(TITLES, texts(&titles));
            } else {
                self.titles_of.push((name.clone(), entities.to_vec()));
            }
        }
        self.entities.push(entities.to_vec());
    }

    /// Adds what no attribute holds.
    fn finish(mut self) -> Result<FileBuilder, Error> {
        let many = |most: usize| self.long.iter().filter(move |(_, e)| e.len() > most);
        let with_ids: Vec<_> = many(MAX_IDS).collect();
        if !with_ids.is_empty() {
            let mut group = self.out.create_group(IDS);
            for (name, entities) in with_ids {
                group.create_dataset(name).with_i64_data(&ids(entities));
            }
            self.out.add_group(group.finish());
        }
        let with_sides = many(MAX_TEXTS).filter_map(|(name, e)| Some((name, sides(e)?)));
        let title = |e: &EntityId| self.titles.get(e).map_or("", String::as_str);
        let titles = self.titles_of.iter().map(|(n, e)| (n, e.iter().map(title).collect()));
        for (group, texts) in
            [(SIDES, with_sides.collect::<Vec<_>>()), (TITLES, titles.collect::<Vec<_>>())]
        {
            if texts.is_empty() {
                continue;
            }
            let mut group = self.out.create_group(group);
            for (name, texts) in texts {
                group.create_dataset(name).with_strings(&texts).map_err(not_encoded)?;
            }
            self.out.add_group(group.finish());
        }
        Ok(self.out)
    }
}

/// Entities whose ids an attribute can hold (64 KiB), and whose sides or titles, which take twice
/// that.
const MAX_IDS: usize = 8_000;
const MAX_TEXTS: usize = 4_000;

/// Writes the entities of a dataset as its attributes, as far as these hold them.
fn describe(dataset: &mut DatasetBuilder, entities: &[EntityId]) {
    if !entities.is_empty() && entities.len() <= MAX_IDS {
        dataset.set_attr("ids", AttrValue::I64Array(ids(entities)));
    }
    if let Some(sides) = sides(entities).filter(|sides| sides.len() <= MAX_TEXTS) {
        dataset.set_attr("sides", texts(&sides));
    }
}

fn ids(entities: &[EntityId]) -> Vec<i64> {
    entities.iter().map(|e| e.id).collect()
}

fn texts(texts: &[&str]) -> AttrValue {
    AttrValue::VarLenStringArray(texts.iter().map(ToString::to_string).collect())
}

/// Names of the sides, if there are entities and all have one.
fn sides(entities: &[EntityId]) -> Option<Vec<&'static str>> {
    let sides: Option<Vec<&str>> = entities.iter().map(|e| e.side.map(Side::name)).collect();
    sides.filter(|sides| !sides.is_empty())
}

/// Root attribute `format` of these files.
const FORMAT: &str = "crumple histories";
const TIME: &str = "time";
const IDS: &str = "ids";
const SIDES: &str = "sides";
const TITLES: &str = "titles";
/// Attribute of a dataset with the unit of its values.
const UNITS: &str = "units";

/// Gives components names that datasets can have, each another.
#[derive(Default)]
struct Names {
    taken: HashSet<String>,
}

impl Names {
    /// A dataset's name has no `/`, which would be a path, and is not a name of this layout.
    fn of(&mut self, component: &str) -> String {
        let mut name = component.replace(['/', '\0'], "_");
        while matches!(&*name, "" | "." | TIME | IDS | SIDES | TITLES) || self.taken.contains(&name)
        {
            name.push('_');
        }
        self.taken.insert(name.clone());
        name
    }
}

/// Values that are handed on together, so that writes are not too short, but at least two states
/// unless each has more values than this.
const TOGETHER: usize = 1 << 17;
const MANY_VALUES: usize = 1 << 18;

/// Writes a file state by state. `None` if it turns out to be damaged.
fn stream(
    input: &Path,
    blocks: Blocks,
    units: Option<UnitSystem>,
    deck: Option<&Deck>,
    storage: Storage,
    output: &Path,
) -> Result<Option<SolverFile>, Error> {
    let states = blocks.file.time.len();
    let mut layout = Layout::of(&blocks.file, units, deck, Some(input));
    let mut skeleton = Skeleton::default();
    for column in &blocks.columns {
        let dataset = layout.component(&column.component, &column.entities);
        let shape = [states as u64, column.entities.len() as u64];
        let shape = if column.entities.is_empty() { &shape[..1] } else { &shape };
        match storage.single {
            false => skeleton.reserve(dataset, shape),
            true => skeleton.reserve_single(dataset, shape),
        }
    }
    let out = layout.finish()?;
    let mut read_error = None;
    let written = write_at(output, |file| {
        let Some(offsets) = skeleton.write(out, file)? else { return Ok(None) };
        match fill(&blocks, storage, &offsets, file) {
            Ok(whole) => Ok(whole.then_some(())),
            Err(Trouble::Writing(error)) => Err(error),
            Err(Trouble::Reading(error)) => {
                read_error = Some(error);
                Ok(None)
            }
        }
    })?;
    if let Some(error) = read_error {
        return Err(Error::io(input, error));
    }
    Ok(written.map(|()| blocks.file))
}

/// What has failed.
pub(crate) enum Trouble {
    Reading(io::Error),
    Writing(io::Error),
}

/// Reads all states and writes their values to `offsets`, one per column; false if a state
/// is damaged.
fn fill(blocks: &Blocks, storage: Storage, offsets: &[u64], file: &File) -> Result<bool, Trouble> {
    let states = blocks.file.time.len();
    let values = blocks.values();
    let least = if values > MANY_VALUES { 1 } else { 2 };
    let together = (TOGETHER / values).clamp(least, states.max(least));
    let damaged = AtomicBool::new(false);
    (0..states.div_ceil(together)).into_par_iter().try_for_each_init(
        || (blocks.reader(), vec![0.0; values * together], Vec::new()),
        |(reader, read, bytes), group| {
            let first = group * together;
            let count = together.min(states - first);
            for (k, state) in read.chunks_exact_mut(values).take(count).enumerate() {
                if damaged.load(Ordering::Relaxed) {
                    return Ok(());
                }
                if !reader(first + k, state).map_err(Trouble::Reading)? {
                    damaged.store(true, Ordering::Relaxed);
                }
            }
            let mut start = 0;
            for (column, offset) in blocks.columns.iter().zip(offsets) {
                let width = column.width();
                let of_state = width * storage.size();
                bytes.resize(count * of_state, 0);
                for k in 0..count {
                    let state = &read[k * values..];
                    storage.put(&state[start..start + width], &mut bytes[k * of_state..]);
                }
                let at = offset + (first * of_state) as u64;
                write_all_at(file, bytes, at).map_err(Trouble::Writing)?;
                start += width;
            }
            Ok(())
        },
    )?;
    Ok(!damaged.into_inner() && blocks.are_plausible())
}
