//! Kept: a value that follows from others and is found once.

use std::sync::OnceLock;

/// Is no part of what it belongs to: equal to any other, empty in what is read from a file.
#[derive(Clone, Debug)]
pub(super) struct Kept<T>(OnceLock<T>);

impl<T> Default for Kept<T> {
    fn default() -> Self {
        Self(OnceLock::new())
    }
}

impl<T> PartialEq for Kept<T> {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl<T> Kept<T> {
    /// The value, found now if it has not been before.
    pub fn or_find(&self, find: impl FnOnce() -> T) -> &T {
        self.0.get_or_init(find)
    }
}
