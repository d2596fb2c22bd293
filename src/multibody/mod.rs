//! Longitudinal multi-body crash: masses on a line, interfaces with a force law.
//!
//! `m_i x_i'' = F_{i−1} − F_i`, with `F_i ≥ 0` the force of the interface in front of
//! body `i`, acting on its deflection `δ = (x_i − x_{i+1}) − gap`.

pub mod integrator;
pub mod interface;
pub mod ledger;
pub mod train;

pub use integrator::{Run, RunSettings, SimulationError, simulate};
pub use interface::{EnvelopeEnd, ForceLaw, Unloading};
pub use train::{Body, Chain, ChainError, Interface};
