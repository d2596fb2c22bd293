//! Assessment: predictions and methods against FE, with speeds left out, in one multi-body model
//! and in whole trains.

pub mod choose;
pub mod compare;
pub mod error;
pub(crate) mod left_out;
mod methods;
pub mod reference;
mod row;
mod scatter;
pub(crate) mod settings;
pub mod train;
pub mod validate;

pub use row::Row;
pub use settings::ComparisonSettings;
