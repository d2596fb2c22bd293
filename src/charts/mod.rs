//! Charts of curves, predictions, runs and histories.
//!
//! Each function takes results and gives a [`Chart`](crate::plot::Chart); `crumple plot` writes it, the report shows it.
//!
//! ```
//! use crumple::build::build;
//! use crumple::charts::group_curves;
//! use crumple::curve::ForceKind;
//! use std::path::Path;
//!
//! let folder = tempfile::tempdir()?;
//! let study = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/fe/lead-car-wall/study.toml");
//! let report = build(&study, &folder.path().join("curves.h5"), |_run| {})?;
//! let cases = report.database.cases("lead-car-wall");
//! let chart = group_curves("lead-car-wall", cases, ForceKind::Contact);
//! assert_eq!(chart.panels[0].series.len(), cases.len());
//! std::fs::write(folder.path().join("curves.png"), chart.drawing().png(2.0)?)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod curves;
mod histories;
mod motion;
mod sweep;

pub use curves::prediction;
pub(crate) use curves::{file_curve, predictions};
pub use curves::{group_curves, left_out_at};
pub use histories::histories;
pub use motion::Motion;
pub(crate) use motion::USUAL_CLASS;
pub use motion::{Quantity, motion, train_speeds};
pub(crate) use sweep::sweep;
