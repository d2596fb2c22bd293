//! Work on all processors, compiled once: a parallel iterator of rayon is compiled again wherever it is used.

use std::sync::{Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;

/// What `work` makes of each item, in their order.
pub(crate) fn map<I: Send, T: Send>(
    items: impl IntoIterator<Item = I>,
    work: impl Fn(I) -> T + Sync,
) -> Vec<T> {
    let pairs: Vec<Mutex<(Option<I>, Option<T>)>> =
        items.into_iter().map(|item| Mutex::new((Some(item), None))).collect();
    // No lock is held during the work, which may do work of its own on all processors.
    each(pairs.len(), &|at| {
        let item = locked(&pairs[at]).0.take();
        let made = item.map(&work);
        locked(&pairs[at]).1 = made;
    });
    let made = |pair: Mutex<(_, Option<T>)>| {
        let (_, made) = pair.into_inner().unwrap_or_else(PoisonError::into_inner);
        made.expect("every item has been worked on")
    };
    pairs.into_iter().map(made).collect()
}

fn each(count: usize, work: &(dyn Fn(usize) + Sync)) {
    (0..count).into_par_iter().for_each(work);
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_keep_their_order_and_may_work_in_parallel_themselves() {
        let squares = |n: u64| map(0..n, |k| k * k).into_iter().sum::<u64>();
        let expected: Vec<u64> = (0..200).map(|n| (0..n).map(|k| k * k).sum()).collect();
        assert_eq!(map((0..200).collect::<Vec<_>>(), squares), expected);
        assert!(map(Vec::<String>::new(), |text| text.len()).is_empty());
    }
}
