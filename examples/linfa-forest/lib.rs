//! The forest of `src/forest` as a crate of its own, with the file of its random numbers: it needs nothing else of crumple.

#[path = "../../src/forest/mod.rs"]
mod forest;
#[path = "../../src/stream.rs"]
mod stream;

pub use forest::*;
