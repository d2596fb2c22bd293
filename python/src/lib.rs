//! The Python module: histories, databases and predictions as arrays, and the program itself.
//!
//! Functions give plain tuples and buffers; `crumple/__init__.py` makes of them what a user meets.

use std::collections::HashMap;
use std::ffi::c_int;
use std::path::PathBuf;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use crumple::curve::{Case, Parameter};
use crumple::database::Database;
use crumple::failure::error_json;
use crumple::forest::{
    FeaturesPerSplit, ForestError, ForestParams, RegressionForest, Thresholds, Ties,
};
use crumple::solver::{self, Selection, SolverFile, WantedId};
use crumple::surrogate::{
    MaxCrushRule, Model, PredictedCurve, Query, SpeedOfCrush, predict, speed_of_crush,
};
use crumple::unit::{length_m, mass_kg, speed_m_per_s};
use linfa::prelude::*;
use ndarray::{Array1, Array2};
use pyo3::exceptions::{PyBufferError, PyRuntimeError, PyValueError};
use pyo3::ffi;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyModule};
use rayon::{ThreadPool, ThreadPoolBuilder};
use serde::Serialize;

/// Numbers that NumPy shows without a copy.
#[pyclass(frozen, module = "crumple._crumple")]
struct Floats(Numbers);

enum Numbers {
    Own(Vec<f64>),
    Shared(Arc<[f64]>),
}

impl Numbers {
    fn get(&self) -> &[f64] {
        match self {
            Self::Own(values) => values,
            Self::Shared(values) => values,
        }
    }
}

#[pymethods]
impl Floats {
    /// # Safety
    /// `view` is Python's. The numbers never change and live as long as the object, which the view holds.
    unsafe fn __getbuffer__(
        slf: Bound<'_, Self>,
        view: *mut ffi::Py_buffer,
        flags: c_int,
    ) -> PyResult<()> {
        let values = slf.get().0.get();
        let length = isize::try_from(size_of_val(values))
            .map_err(|_| PyBufferError::new_err("too large for a buffer"))?;
        let start = values.as_ptr().cast_mut().cast();
        // SAFETY: see above; the last but one argument makes it read-only.
        let code = unsafe { ffi::PyBuffer_FillInfo(view, slf.as_ptr(), start, length, 1, flags) };
        if code == 0 { Ok(()) } else { Err(PyErr::fetch(slf.py())) }
    }
}

fn floats(values: Vec<f64>) -> Floats {
    Floats(Numbers::Own(values))
}

/// Work in the threads of this process: a fork has none of its parent's, and would wait for them.
fn in_threads<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);
    let pool = {
        let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
        let process = std::process::id();
        if pool.as_ref().is_none_or(|(of, _)| *of != process) {
            // To end the parent's is not the child's.
            std::mem::forget(pool.take());
            *pool = ThreadPoolBuilder::new().build().ok().map(|pool| (process, Arc::new(pool)));
        }
        pool.as_ref().map(|(_, pool)| pool.clone())
    };
    match pool {
        Some(pool) => pool.install(work),
        None => work(),
    }
}

/// Work without Python's lock. A signal, such as Ctrl-C, ends the wait for it at once; what it has read is dropped when it
/// ends by itself.
fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let (done, mut result) = mpsc::channel();
    let worker = std::thread::spawn(move || done.send(in_threads(work)));
    loop {
        let waited;
        (waited, result) =
            py.detach(move || (result.recv_timeout(Duration::from_millis(50)), result));
        match waited {
            Ok(value) => return Ok(value),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => match worker.join() {
                Err(panic) => std::panic::resume_unwind(panic),
                Ok(_) => return Err(PyRuntimeError::new_err("the work gave no result")),
            },
        }
    }
}

/// The error of the library with its document, as `crumple.Error`.
fn failed(py: Python<'_>, error: &crumple::Error) -> PyErr {
    let document = error_json(error);
    match py.import("crumple._errors").and_then(|module| module.getattr("Error")) {
        Ok(class) => match class.call_method1("of_document", (document,)) {
            Ok(error) => PyErr::from_value(error),
            Err(error) => error,
        },
        Err(error) => error,
    }
}

/// Name of the section, title, solver with its version, damage, notes; times; and by history the component, the id, the
/// title of the entity and the values.
type Section = (
    String,
    Option<String>,
    Option<String>,
    Vec<String>,
    Vec<String>,
    Floats,
    Vec<(String, Option<String>, Option<String>, Floats)>,
);

fn section(file: SolverFile) -> Section {
    let titles = file.entities.into_iter().filter_map(|entity| Some((entity.id, entity.title?)));
    let titles: HashMap<_, String> = titles.collect();
    let histories = file.histories.into_iter().map(|history| {
        let title = history.entity.and_then(|entity| titles.get(&entity)).cloned();
        let id = history.entity.map(|entity| entity.to_string());
        (history.component.to_string(), id, title, floats(history.values))
    });
    let histories = histories.collect();
    let solver = [file.solver, file.version].into_iter().flatten().collect::<Vec<_>>().join(" ");
    (
        file.section,
        file.title,
        Some(solver).filter(|solver| !solver.is_empty()),
        file.problems.iter().map(ToString::to_string).collect(),
        file.notes,
        Floats(Numbers::Shared(file.time)),
        histories,
    )
}

/// All sections of a solver's file.
#[pyfunction]
#[pyo3(signature = (path, ids, components, section_name, format))]
fn read(
    py: Python<'_>,
    path: PathBuf,
    ids: Option<Vec<String>>,
    components: Option<Vec<String>>,
    section_name: Option<String>,
    format: Option<String>,
) -> PyResult<Vec<Section>> {
    let id = |text: String| {
        text.parse::<WantedId>().map_err(|e| PyValueError::new_err(format!("{text}: {e}")))
    };
    let ids = ids.map(|ids| ids.into_iter().map(id).collect::<PyResult<Vec<_>>>()).transpose()?;
    let section_given = section_name.is_some();
    let selection = Selection { ids, components, section: section_name, ..Selection::all() };
    let read = interruptible(py, move || {
        let sections = solver::read_sections(&path, format.as_deref(), &selection)?;
        // The program knows which section was meant.
        if sections.is_empty() && section_given {
            return Ok(vec![solver::read(&path, format.as_deref(), &selection)?]);
        }
        Ok(sections)
    })?;
    let sections = read.map_err(|error: crumple::Error| failed(py, &error))?;
    Ok(sections.into_iter().map(section).collect())
}

/// The solver files of a folder, by which it is a run.
#[pyfunction]
fn files(py: Python<'_>, folder: PathBuf) -> PyResult<Vec<PathBuf>> {
    py.detach(|| {
        solver::output_files(&folder).map_err(|source| crumple::Error::io(&folder, source))
    })
    .map_err(|error| failed(py, &error))
}

/// Name, speed in m/s and its kind, masses in kg, force's kind; times, deflections, forces, body forces and closing speeds; tags,
/// warnings.
type DatabaseCase = (
    String,
    (f64, &'static str),
    (f64, Option<f64>),
    &'static str,
    [Floats; 5],
    Vec<String>,
    Vec<String>,
);

fn case(case: &Case) -> DatabaseCase {
    let (curves, conditions) = (&case.curves, &case.conditions);
    (
        case.id.name.clone(),
        (conditions.speed.m_per_s, conditions.speed.kind.name()),
        (conditions.masses.body_kg, conditions.masses.other_kg),
        curves.force_kind.name(),
        [
            floats(curves.sampled.time_s().to_vec()),
            floats(curves.sampled.deflection_m().to_vec()),
            floats(curves.sampled.force_n().to_vec()),
            floats(case.body_force_n()),
            floats(curves.closing_speed_m_per_s.clone()),
        ],
        case.provenance.tags.clone(),
        case.quality.warnings.clone(),
    )
}

/// Groups of a database with the names of their cases.
#[pyfunction]
fn database(py: Python<'_>, path: PathBuf) -> PyResult<Vec<(String, Vec<String>)>> {
    interruptible(py, move || Database::names(&path))?.map_err(|error| failed(py, &error))
}

/// One case of a group; no other is read.
#[pyfunction(name = "case")]
fn read_case(py: Python<'_>, path: PathBuf, group: String, name: String) -> PyResult<DatabaseCase> {
    let read = interruptible(py, move || Database::read_case(&path, Some(&group), &name))?;
    read.map(|read| case(&read)).map_err(|error| failed(py, &error))
}

/// A number in SI, or a text.
#[derive(FromPyObject)]
enum Quantity {
    Number(f64),
    Text(String),
}

impl Quantity {
    /// Its value in SI, above 0.
    fn in_si(
        self,
        py: Python<'_>,
        what: &str,
        parse: fn(&str) -> Result<f64, crumple::Error>,
    ) -> PyResult<f64> {
        match self {
            Self::Text(text) => parse(&text).map_err(|error| failed(py, &error)),
            Self::Number(number) if number > 0.0 && number.is_finite() => Ok(number),
            Self::Number(number) => {
                Err(PyValueError::new_err(format!("{what} {number}: expected a number above 0")))
            }
        }
    }

    fn parameter(self) -> Parameter {
        match self {
            Self::Number(number) => Parameter::Number(number),
            Self::Text(text) => Parameter::Category(text),
        }
    }
}

/// The document of `predict --json`.
#[derive(Serialize)]
struct Predicted {
    #[serde(flatten)]
    curve: PredictedCurve,
    #[serde(skip_serializing_if = "Option::is_none")]
    found_by_crush: Option<SpeedOfCrush>,
}

/// A trained model.
#[pyclass(frozen, module = "crumple._crumple")]
struct TrainedModel(Model);

#[pymethods]
impl TrainedModel {
    #[new]
    fn new(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let model = interruptible(py, move || Model::read(&path))?;
        model.map(Self).map_err(|error| failed(py, &error))
    }

    /// What its file holds.
    fn to_json<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = self.0.to_json().map_err(|e| PyValueError::new_err(e.to_string()))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// The model of such bytes; errors name the path.
    #[staticmethod]
    fn of_json(py: Python<'_>, path: PathBuf, json: &[u8]) -> PyResult<Self> {
        Model::parse(&path, json).map(Self).map_err(|error| failed(py, &error))
    }

    /// Name of the group, of the model, and its slowest and fastest speed in m/s.
    fn facts(&self) -> (String, &'static str, (f64, f64)) {
        (self.0.group.clone(), self.0.kind.name(), self.0.range_m_per_s())
    }

    /// The curve at a speed, or at that which gives a crush, as the document of `predict --json`. Speed, crush and mass are
    /// numbers in m/s, m and kg, or texts with units.
    #[pyo3(signature = (speed, crush, extrapolate, mass, max_crush, parameters, energy_correct))]
    #[allow(clippy::too_many_arguments)]
    fn predict(
        &self,
        py: Python<'_>,
        speed: Option<Quantity>,
        crush: Option<Quantity>,
        extrapolate: bool,
        mass: Option<Quantity>,
        max_crush: Option<String>,
        parameters: Vec<(String, Quantity)>,
        energy_correct: bool,
    ) -> PyResult<String> {
        let parameters = parameters.into_iter().map(|(name, value)| (name, value.parameter()));
        let rule = max_crush.map(|name| {
            let named = MaxCrushRule::ALL.into_iter().find(|rule| rule.name() == name);
            let known = MaxCrushRule::ALL.map(MaxCrushRule::name).join(", ");
            let unknown = || format!("max_crush {name:?}: expected one of {known}");
            named.ok_or_else(|| PyValueError::new_err(unknown()))
        });
        let crush = crush.map(|crush| crush.in_si(py, "crush", length_m)).transpose()?;
        let speed = speed.map(|speed| speed.in_si(py, "speed", speed_m_per_s)).transpose()?;
        let query = Query {
            mass_kg: mass.map(|mass| mass.in_si(py, "mass", mass_kg)).transpose()?,
            rule: rule.transpose()?,
            parameters: parameters.collect(),
            energy_correct,
            extrapolate,
            ..Query::at(speed.unwrap_or_else(|| self.0.range_m_per_s().0))
        };
        let predicted = || {
            let found =
                crush.map(|crush_m| speed_of_crush(&self.0, &query, crush_m)).transpose()?;
            let speed_m_per_s = found.map_or(query.speed_m_per_s, |found| found.speed_m_per_s);
            Ok((predict(&self.0, &Query { speed_m_per_s, ..query.clone() })?, found))
        };
        let (curve, found_by_crush) =
            py.detach(|| in_threads(predicted)).map_err(|error| failed(py, &error))?;
        let document = Predicted { curve, found_by_crush };
        serde_json::to_string(&document).map_err(|error| PyValueError::new_err(error.to_string()))
    }
}

/// A fitted regression forest.
#[pyclass(frozen, module = "crumple._crumple")]
struct Forest(RegressionForest<f64>);

/// Numbers of a C-contiguous array of float64, as its bytes.
fn numbers(bytes: &[u8]) -> Vec<f64> {
    bytes
        .chunks_exact(8)
        .map(|of| f64::from_ne_bytes(of.try_into().expect("eight bytes")))
        .collect()
}

/// Records in rows of so many features.
fn records(bytes: &[u8], features: usize) -> PyResult<Array2<f64>> {
    let values = numbers(bytes);
    let rows = values.len().checked_div(features).unwrap_or_default();
    let wrong = |error: ndarray::ShapeError| PyValueError::new_err(error.to_string());
    Array2::from_shape_vec((rows, features), values).map_err(wrong)
}

#[pymethods]
impl Forest {
    /// Fits `trees` trees to records and targets, as bytes of float64.
    #[staticmethod]
    #[allow(clippy::too_many_arguments)]
    fn fit(
        py: Python<'_>,
        x: &[u8],
        features: usize,
        y: &[u8],
        trees: usize,
        seed: u64,
        max_depth: Option<usize>,
        min_samples_leaf: usize,
        max_features: Option<usize>,
        bootstrap: bool,
        random_thresholds: bool,
    ) -> PyResult<Self> {
        let data = Dataset::new(records(x, features)?, Array1::from(numbers(y)));
        let thresholds = if random_thresholds { Thresholds::Random } else { Thresholds::Midpoint };
        let params = ForestParams::new(trees)
            .seed(seed)
            .max_depth(max_depth)
            .min_samples_leaf(min_samples_leaf)
            .features_per_split(max_features.map_or(FeaturesPerSplit::All, FeaturesPerSplit::Count))
            .bootstrap(bootstrap)
            .thresholds(thresholds)
            .ties(Ties::Random);
        let forest = interruptible(py, move || params.fit(&data))?;
        forest.map(Self).map_err(|error: ForestError| PyValueError::new_err(error.to_string()))
    }

    fn predict(&self, py: Python<'_>, x: &[u8], features: usize) -> PyResult<Floats> {
        let records = records(x, features)?;
        let predicted: Array1<f64> = py.detach(|| in_threads(|| self.0.predict(&records)));
        Ok(floats(predicted.to_vec()))
    }

    fn importance(&self) -> Option<Floats> {
        self.0.feature_importance().map(|shares| floats(shares.to_vec()))
    }

    /// The whole forest, bit by bit.
    fn to_json(&self) -> PyResult<String> {
        serde_json::to_string(&self.0).map_err(|error| PyValueError::new_err(error.to_string()))
    }

    #[staticmethod]
    fn of_json(json: &str) -> PyResult<Self> {
        let wrong = |error: &dyn std::fmt::Display| PyValueError::new_err(error.to_string());
        let forest: RegressionForest<f64> = serde_json::from_str(json).map_err(|e| wrong(&e))?;
        forest.check().map_err(|e| wrong(&e))?;
        Ok(Self(forest))
    }
}

/// The program with these arguments, the first its own name; gives its exit code.
#[cfg(feature = "program")]
#[pyfunction]
fn main(py: Python<'_>, arguments: Vec<std::ffi::OsString>) -> u8 {
    py.detach(|| crumple::cli::run_program(arguments))
}

#[pymodule]
fn _crumple(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<Floats>()?;
    module.add_class::<TrainedModel>()?;
    module.add_class::<Forest>()?;
    module.add_function(wrap_pyfunction!(read, module)?)?;
    module.add_function(wrap_pyfunction!(files, module)?)?;
    module.add_function(wrap_pyfunction!(database, module)?)?;
    module.add_function(wrap_pyfunction!(read_case, module)?)?;
    #[cfg(feature = "program")]
    module.add_function(wrap_pyfunction!(main, module)?)?;
    Ok(())
}
