//! Assessment: predictions and methods against FE, with speeds left out, in one multi-body model
//! and in whole trains.

pub(crate) mod against;
pub(crate) mod choose;
pub(crate) mod compare;
pub(crate) mod left_out;
mod methods;
pub(crate) mod reference;
mod row;
mod scatter;
pub(crate) mod subsets;
pub(crate) mod train;
pub(crate) mod validate;

pub use choose::{Gap, Purpose, Selection, gaps};
pub use methods::ComparisonSettings;
pub use reference::{MotionErrors, Reference};
pub(crate) use row::Row;
pub use train::{TrainComparison, TrainRow, compare_train};
pub use validate::{Choice, Report, train, validate};
