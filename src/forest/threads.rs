//! Threads by rayon; without its feature the same methods, which do one thing after another.

#[cfg(feature = "rayon")]
pub(super) use rayon::prelude::*;

#[cfg(not(feature = "rayon"))]
pub(super) use in_turn::*;

#[cfg(not(feature = "rayon"))]
mod in_turn {
    use std::slice::{Chunks, ChunksMut};

    pub(in super::super) trait IntoParallelIterator: IntoIterator + Sized {
        fn into_par_iter(self) -> Self::IntoIter {
            self.into_iter()
        }
    }
    impl<I: IntoIterator> IntoParallelIterator for I {}

    pub(in super::super) trait ParallelSlice<T>: AsRef<[T]> + AsMut<[T]> {
        fn par_chunks(&self, size: usize) -> Chunks<'_, T> {
            self.as_ref().chunks(size)
        }

        fn par_chunks_mut(&mut self, size: usize) -> ChunksMut<'_, T> {
            self.as_mut().chunks_mut(size)
        }

        fn par_sort_unstable(&mut self)
        where
            T: Ord,
        {
            self.as_mut().sort_unstable();
        }
    }
    impl<T> ParallelSlice<T> for [T] {}
}
