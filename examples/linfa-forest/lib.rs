//! The forest of `src/forest` as a crate of its own: it needs linfa and ndarray, and nothing of crumple.

#[path = "../../src/forest/mod.rs"]
mod forest;
#[path = "../../src/stream.rs"]
mod stream;

pub use forest::*;
