//! Sweeps: many runs of one scenario, one row of results each.
//!
//! Item `k` has the same row whatever the threads, the chunks or the shard
//! (`shard`) it is run in. Rows are in order of items and are written immediately, so
//! memory does not grow with their number. The unfinished file is its own journal: a run that was
//! stopped continues after its last complete row.
//!
//! Item k is a function of plan and k alone: grids by division, draws by a stream keyed by seed, variable and item, the strata
//! of a Latin hypercube by a permutation that is computed (a Feistel network) and never stored. So threads, chunks and shards
//! cannot change a row. Quantiles are inverse distribution functions with `libm`'s logarithm and exponential, so that the nodes of
//! a cluster agree to the last bit.
//!
//! Rows are written in order, as CSV, to `OUT.part`; this file is the journal. Its header holds a hash of the plan, the scenario,
//! the files it names and the program's version. A run that finds it keeps every complete row in sequence, removes what
//! follows (a torn line, blocks of zeros) and continues; at the end the file is renamed. A separate journal could contradict
//! the result. HDF5 is written from the complete CSV, which is read twice: the sizes of datasets and the widths of texts are then known, and
//! nothing is kept in memory.
//!
//! If only masses, speeds and gaps vary, an item needs no new force law: each thread keeps chains by the values that decided their
//! laws and only changes the numbers in them (`scenario::adjust`). `cargo bench --bench sweep` prints the saving.

mod journal;
mod results;
mod row;
mod run;
mod statistics;
mod to_hdf5;
mod until;
mod variables;

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::error::{Document, Error, KeyPath, error};
use crate::file;
use crate::manifest;
use crate::plan::{Design, Plan, PlanFile, RESULTS, ResultName, Spread, USUAL_RESULTS, Vary, What};
use crate::scenario::{self, CheckedScenario, Prepared, Scenario, Sources};
pub use journal::{WriteOptions, merge, write, write_rows};
pub(crate) use results::ResultColumn;
pub(crate) use results::SweepColumns;
pub use run::Chunk;
use run::Measure;
pub(crate) use statistics::{ColumnStatistics, Sensitivity, share_interval};
pub(crate) use to_hdf5::{is_hdf5, is_table};
pub(crate) use until::Precision;
pub(crate) use until::write_until;
use variables::Variable;
pub(crate) use variables::VariableSummary;

/// A share of a sweep: block `index` of `count` blocks of neighbouring items.
///
/// Invariant: `1 ≤ index ≤ count`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Shard {
    index: u64,
    count: u64,
}

impl Shard {
    /// The whole sweep.
    pub(crate) const WHOLE: Self = Self { index: 1, count: 1 };

    /// Shard `index` of `count`, counted from 1.
    pub fn new(index: u64, count: u64) -> Option<Self> {
        (1 <= index && index <= count).then_some(Self { index, count })
    }

    /// Which block, counted from 1.
    pub fn index(self) -> u64 {
        self.index
    }

    /// How many blocks there are.
    pub fn count(self) -> u64 {
        self.count
    }

    /// Its items of `0..items`.
    pub fn items(self, items: u64) -> std::ops::Range<u64> {
        let end =
            |index: u64| (u128::from(items) * u128::from(index) / u128::from(self.count)) as u64;
        end(self.index - 1)..end(self.index)
    }
}

/// The error of rows that are missing or not whole.
fn damaged(path: &Path, what: &str) -> Error {
    error!(Sweep, "{}: {what}", path.display())
}

/// The error of a file that this program has not written.
fn foreign(path: &Path) -> Error {
    error!(
        Sweep,
        "{} exists and is not a sweep result: use --restart to replace it, or another -o",
        path.display()
    )
}

/// What has been done.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Items of the whole sweep.
    pub items: u64,
    /// Which part of them was to be run.
    pub shard: Shard,
    /// Rows of this shard.
    pub rows: u64,
    /// Rows that an earlier run had left.
    pub resumed: u64,
    /// Rows there are now: fewer than `rows` if the run was stopped.
    pub done: u64,
    /// Rows without a result.
    pub failed: u64,
    /// Rows with a warning.
    pub warned: u64,
    /// The first few messages of rows that failed, by item.
    pub messages: Vec<(u64, String)>,
    /// What warnings say, the first of each kind, and how many rows say so.
    pub reasons: Vec<(String, u64)>,
    /// Statistics of the columns of numbers.
    pub(crate) columns: Vec<ColumnStatistics>,
    /// How the results follow what is varied.
    pub(crate) sensitivities: Vec<Sensitivity>,
}

impl Report {
    /// Whether all rows are there.
    pub fn is_complete(&self) -> bool {
        self.done == self.rows
    }
}

/// A scenario with a plan, checked, its files read.
pub struct Sweep {
    path: PathBuf,
    /// Text of the scenario, and the file and table of the plan: they decide the hash.
    text: String,
    plan_path: PathBuf,
    plan: Plan,
    scenario: CheckedScenario<'static>,
    sources: Sources,
    design: Design,
    variables: Vec<Variable>,
    results: Vec<Kept>,
    /// The scenario as it stands, put together.
    base: Prepared,
    hash: String,
}

impl Sweep {
    /// Loads a scenario with its `[sweep]`, or with that of `plan`, and all it names.
    ///
    /// # Errors
    /// It names file and key.
    pub fn load(path: &Path, plan: Option<&Path>) -> Result<Self, Error> {
        let text = manifest::read_text(path)?;
        let scenario = scenario::parse(path, &text)?;
        let plan_path = plan.unwrap_or(path);
        let plan_text = match plan {
            Some(file) => &manifest::read_text(file)?,
            None => &text,
        };
        let of_file = match plan {
            Some(file) => Some(manifest::parse::<PlanFile>(file, plan_text)?.sweep),
            None => None,
        };
        let document = Document::new(plan_path, plan_text);
        let plan = of_file.or_else(|| scenario.sweep.clone()).ok_or_else(|| {
            error!(Sweep, "there is no [sweep]: add one, or give it in another file with --plan")
                .placed(|key| document.place(key))
        })?;
        let invalid =
            |error: Error| error.inside(KeyPath::of("sweep")).placed(|key| document.place(key));
        let (variables, design) = variables::bind(&plan, &scenario).map_err(invalid)?;
        let results = results(&plan, scenario.limits.is_some()).map_err(invalid)?;
        let sources = Sources::read(path, &scenario)?;
        let mut base = scenario::assemble(path, &scenario, &sources)?;
        let replaced = plan.vary.iter().filter(|v| v.what == What::Curve).filter_map(|v| {
            let curve = v.curve.as_deref()?;
            let is_kept = v.values.iter().flatten().any(|value| value.0 == curve);
            (!is_kept).then_some(curve)
        });
        let replaced: Vec<&str> = replaced.collect();
        base.warnings.extend(base.other_speeds_as_it_stands(&replaced));
        for variable in &variables {
            let Some(curve) = variable.gap_of() else { continue };
            let (_, others) = scenario::takes_gap_of(&scenario, curve)?;
            base.warnings.extend((!others.is_empty()).then(|| {
                format!(
                    "the gap of curve \"{curve}\" is varied, but not at {}: there contact, train or vehicle states one",
                    others.join(", ")
                )
            }));
        }
        // Where another curve stands in its place, what a row varies of a curve is idle.
        let mut all = (*scenario).clone();
        let named: Vec<String> =
            all.curve_names_mut().into_iter().map(|name| name.clone()).collect();
        for vary in
            plan.vary.iter().filter(|v| [What::Band, What::Force, What::Gap].contains(&v.what))
        {
            let Some(curve) = &vary.curve else { continue };
            let is_own = |other: &str| {
                let same = |v: &Vary| v.what == vary.what && v.curve.as_deref() == Some(other);
                plan.vary.iter().any(same)
            };
            let choices = plan.vary.iter().filter(|v| v.what == What::Curve).filter_map(|v| {
                let values: Vec<&str> = v.values.iter().flatten().map(|value| &*value.0).collect();
                let is_here = v.curve.as_ref() == Some(curve);
                let is_chosen = !named.contains(curve) && values.contains(&&**curve);
                (is_here || is_chosen).then_some(values)
            });
            let others = choices.flatten().filter(|other| *other != curve && !is_own(other));
            let others: Vec<&str> = others.collect();
            base.warnings.extend((!others.is_empty()).then(|| {
                format!(
                    "the {} of curve \"{curve}\" is varied, but has no effect in rows with {} in its place: vary it for these, too, or sweep them apart",
                    vary.what.name(),
                    others.join(", ")
                )
            }));
        }
        let hash = hash(path, &text, plan_path, &scenario, None)?;
        let (path, plan_path) = (path.to_path_buf(), plan_path.to_path_buf());
        Ok(Self {
            path,
            text,
            plan_path,
            plan,
            scenario,
            sources,
            design,
            variables,
            results,
            base,
            hash,
        })
    }

    /// Makes it the sweep of the same plan with another number of samples.
    fn set_samples(&mut self, samples: u64) -> Result<(), Error> {
        let plan = Plan { samples: Some(samples), ..self.plan.clone() };
        (self.variables, self.design) = variables::bind(&plan, &self.scenario)?;
        let (path, plan_path) = (&self.path, &self.plan_path);
        self.hash = hash(path, &self.text, plan_path, &self.scenario, Some(samples))?;
        Ok(())
    }

    /// Items of the whole sweep.
    pub fn items(&self) -> u64 {
        self.design.items
    }

    /// The names that the values of each variable are indices of; none if they are numbers.
    fn names(&self) -> Vec<Vec<String>> {
        self.variables.iter().map(|v| v.names.clone()).collect()
    }

    /// Identifies the sweep: BLAKE3 of plan, scenario, the files it names and
    /// this program's version.
    pub fn hash(&self) -> &str {
        &self.hash
    }

    /// Warnings of the scenario as it stands, without what is varied.
    pub fn warnings(&self) -> &[String] {
        &self.base.warnings
    }

    /// Names of all columns of the result.
    pub fn columns(&self) -> Vec<String> {
        let mut columns = vec!["item".to_string()];
        columns.extend(self.variables.iter().map(|v| v.column.clone()));
        columns.extend(result_columns(&self.results, &self.base));
        columns.extend(["status", "message"].map(String::from));
        columns
    }

    /// The variables: columns and how many values they have.
    pub(crate) fn variables(&self) -> Vec<VariableSummary> {
        let variables = self.variables.iter().zip(&self.design.spreads);
        let summary = |(variable, spread): (&Variable, &Spread)| VariableSummary {
            column: variable.column.clone(),
            values: (!matches!(spread, Spread::Drawn(_))).then(|| spread.len()),
        };
        variables.map(summary).collect()
    }

    /// Whether its items are a random sample, so that their shares estimate probabilities.
    pub(crate) fn is_random(&self) -> bool {
        self.design.is_random()
    }

    /// Whether nothing is drawn: a grid has no distribution.
    pub(crate) fn is_grid(&self) -> bool {
        !self.design.spreads.iter().any(|spread| matches!(spread, Spread::Drawn(_)))
    }

    /// The varied values of an item, as they are in its row; none if there is no such item.
    pub fn values(&self, item: u64) -> Vec<String> {
        if item >= self.items() {
            return Vec::new();
        }
        let mut values = Vec::new();
        self.design.values(item, &mut values);
        let texts = values.iter().enumerate();
        texts.map(|(k, value)| row::text(*value, &self.variables[k].names)).collect()
    }
}

/// A result that is kept, and what its columns begin with.
type Kept = (ResultName, &'static str);

fn results(plan: &Plan, has_limits: bool) -> Result<Vec<Kept>, Error> {
    let Some(asked) = &plan.results else { return Ok(RESULTS[..USUAL_RESULTS].to_vec()) };
    if asked.contains(&ResultName::OverLimits) && !has_limits {
        return Err(error!(
            Sweep at "results",
            "sweep.results: over_limits needs limits: give the scenario [limits]"
        ));
    }
    let kept: Vec<Kept> = RESULTS.into_iter().filter(|(r, _)| asked.contains(r)).collect();
    if kept.len() == asked.len() && !kept.is_empty() {
        Ok(kept)
    } else {
        Err(error!(
            Sweep at "results",
            "sweep.results: name at least one result, and each only once"
        ))
    }
}

/// Columns of the results, which begin with the quantities' names.
fn result_columns(results: &[Kept], base: &Prepared) -> Vec<String> {
    let Prepared { chain, order, vehicles, .. } = base;
    let columns = results.iter().flat_map(|(result, quantity)| {
        let of = |name: &str| format!("{quantity}[{name}]");
        let body = |&i: &usize| of(&chain.bodies()[i].name);
        match Measure::of(*result) {
            Measure::Interface(_) => chain.interfaces().iter().map(|i| of(&i.name)).collect(),
            Measure::Body(_) => order.iter().map(body).collect(),
            Measure::Vehicle(_) => {
                order.iter().filter(|i| vehicles.contains(i)).map(body).collect()
            }
            Measure::Run(_) => vec![quantity.to_string()],
        }
    });
    columns.collect()
}

/// BLAKE3 of everything that decides the rows. Comments and order of keys do not.
///
/// `samples` take the place of those that the plan states.
fn hash(
    path: &Path,
    text: &str,
    plan_path: &Path,
    scenario: &Scenario,
    samples: Option<u64>,
) -> Result<String, Error> {
    let mut table: toml::Table = manifest::parse(path, text)?;
    if plan_path != path
        && let Some(plan) = manifest::load::<toml::Table>(plan_path)?.remove("sweep")
    {
        table.insert("sweep".into(), plan);
    }
    if let (Some(samples), Some(toml::Value::Table(plan))) = (samples, table.get_mut("sweep")) {
        let samples = i64::try_from(samples).unwrap_or(i64::MAX);
        plan.insert("samples".into(), toml::Value::Integer(samples));
    }
    let mut hasher = blake3::Hasher::new();
    // Each part with its length, so that no two lists of parts run together to the same bytes.
    let mut part = |bytes: &[u8]| {
        hasher.update(&(bytes.len() as u64).to_le_bytes()).update(bytes);
    };
    part(concat!("crumple sweep ", env!("CARGO_PKG_VERSION")).as_bytes());
    part(table.to_string().as_bytes());
    let folder = path.parent().unwrap_or(Path::new(""));
    for curve in scenario.curves.values() {
        for file in [&curve.model, &curve.file, &curve.database].into_iter().flatten() {
            let file = folder.join(file);
            let io = |source| Error::io(&file, source);
            let mut hash = blake3::Hasher::new();
            hash.update_reader(file::open(&file).map_err(io)?).map_err(io)?;
            part(hash.finalize().as_bytes());
        }
    }
    Ok(hasher.finalize().to_hex().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_blocks_that_make_the_whole() {
        for (items, count) in [(10, 3), (2, 5), (0, 2), (1_000_000_000_000, 7)] {
            let mut at = 0;
            for index in 1..=count {
                let block = Shard::new(index, count).unwrap().items(items);
                assert_eq!(block.start, at);
                assert!(block.end - block.start <= items / count + 1);
                at = block.end;
            }
            assert_eq!(at, items);
        }
        assert_eq!(Shard::new(0, 3), None);
        assert_eq!(Shard::new(4, 3), None);
    }
}
