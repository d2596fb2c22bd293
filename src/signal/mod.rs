//! Signal processing: arrays of values over time, of whatever quantity.

mod bounded;
pub(crate) mod cfc;
mod derivative;
mod integral;
mod l1;
pub(crate) mod peaks;
pub(crate) mod resample;

pub(crate) use bounded::Cholesky;
pub(crate) use bounded::bounded;
pub use cfc::CfcError;
pub use derivative::derivative;
pub(crate) use integral::integral;
pub use l1::l1_ratio;
