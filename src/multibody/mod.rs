//! Longitudinal multi-body crash: masses on a line, interfaces with a force law.
//!
//! `m_i x_i'' = F_{i−1} − F_i − R_i`, with `F_i` the force of the interface in front of
//! body `i`, acting on its deflection `δ = (x_i − x_{i+1}) − gap`, and `R_i` the resistance of
//! the track.

mod bank;
pub mod damping;
mod driven;
mod engine;
mod extrapolation;
pub mod integrator;
pub mod interface;
pub mod ledger;
mod rows;
pub mod train;
mod watch;

pub use damping::Damping;
pub use driven::UnloadingChoice;
pub use integrator::{Method, Record, Run, RunSettings, RunWarning, SimulationError, simulate};
pub use interface::{EnvelopeEnd, ForceLaw, Unloading, UnloadingShape};
pub use train::{
    Body, Chain, ChainError, Interface, Resistance, STANDARD_GRAVITY_M_PER_S2, Tension,
};
