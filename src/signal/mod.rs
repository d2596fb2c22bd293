//! Signal processing: arrays of values over time, of whatever quantity.

pub mod cfc;
mod derivative;
mod l1;
pub mod peaks;
pub mod resample;

pub use derivative::derivative;
pub use l1::l1_ratio;
