//! Assessment: predictions and methods against FE, with speeds left out, in one multi-body model
//! and in whole trains.

pub mod choose;
pub mod compare;
pub mod left_out;
mod methods;
pub mod reference;
mod row;
pub mod train;
pub mod validate;
