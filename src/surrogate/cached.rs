//! A cache: a value that follows from others and is computed once.

use std::sync::OnceLock;

/// Ignored by `==` and not written to files.
#[derive(Clone, Debug)]
pub(super) struct Cached<T>(OnceLock<T>);

impl<T> Default for Cached<T> {
    fn default() -> Self {
        Self(OnceLock::new())
    }
}

impl<T> PartialEq for Cached<T> {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl<T> Cached<T> {
    /// The value, computed now if it has not been before.
    pub(crate) fn get_or_compute(&self, compute: impl FnOnce() -> T) -> &T {
        self.0.get_or_init(compute)
    }
}
