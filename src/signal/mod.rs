//! Signal processing: arrays of values over time, of whatever quantity.

pub(crate) mod cfc;
mod derivative;
mod integral;
mod l1;
mod non_negative;
pub(crate) mod peaks;
pub(crate) mod resample;

pub use cfc::CfcError;
pub use derivative::derivative;
pub(crate) use integral::integral;
pub use l1::l1_ratio;
pub(crate) use non_negative::non_negative;
