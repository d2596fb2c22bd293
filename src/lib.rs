//! Force–deflection curves for multi-body crash models, from the histories of FE runs.
//!
//! The whole pipeline; each step only uses the output of the previous one:
//!
//! ```
//! use crumple::build::build;
//! use crumple::dataset::TrainingSet;
//! use crumple::surrogate::{ForestOptions, Model, ModelKind, Query, predict};
//! use std::path::Path;
//!
//! # let folder = tempfile::tempdir()?;
//! # let folder = folder.path();
//! // solver files → histories → curves → database
//! let study = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/fe/lead-car-wall/study.toml");
//! let report = build(&study, &folder.join("curves.h5"), |_run| {})?;
//!
//! // database → data set → forest
//! let set = TrainingSet::new("lead-car-wall", report.database.cases("lead-car-wall"))?;
//! let model = Model::fit(&set, ModelKind::forest(ForestOptions::default()))?;
//!
//! // forest → curve at a speed that was never run
//! let curve = predict(&model, &Query::at(50.0 / 3.6))?;
//! assert!(curve.max_deflection_m > 0.87 && curve.max_deflection_m < 1.24);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The modules below are in the recommended reading order. All values are in SI; units enter at the
//! edges ([`unit`](mod@unit)). A speed always states what it is measured against.

#![deny(missing_docs)]
#![warn(unreachable_pub, unnameable_types)]

#[cfg(not(all(feature = "rayon", feature = "serde")))]
compile_error!(
    "crumple needs its features rayon and serde: only the sources of the forest do without them, elsewhere"
);

pub mod error;
pub use error::Error;

pub mod unit;

mod clock;

mod os;

mod guess;

mod order;

mod parallel;

mod words;

#[macro_use]
mod table;

pub mod plot;

pub mod history;

pub mod signal;

pub mod solver;

pub mod curve;

mod manifest;

pub mod study;

mod hdf5;

pub mod history_hdf5;

pub mod database;

pub mod build;

pub mod init;

pub mod dataset;

mod curate;

mod piecewise;

mod stream;

pub mod forest;

pub mod surrogate;

pub mod multibody;

pub mod nsdm;

pub mod formats;

mod import;

mod plan;

pub mod scenario;

pub mod sweep;

mod rating;

pub mod assess;

pub mod charts;

mod report;

pub mod failure;

pub mod file;

#[doc(hidden)]
pub mod cli;
