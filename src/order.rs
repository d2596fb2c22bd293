//! Stable sorting, compiled once: the standard library's sort is compiled again for every type and every order. For lists
//! that are not long.

use std::cmp::Ordering;

/// Sorts by an order; items that are equal in it stay as they are.
pub(crate) fn sort<T>(items: &mut [T], by: impl Fn(&T, &T) -> Ordering) {
    let mut from = order(items.len(), &|a, b| by(&items[a], &items[b]));
    // Swaps along each cycle of the permutation; what is in its place is marked by its own index.
    for first in 0..from.len() {
        let mut to = first;
        while from[to] != first {
            let next = from[to];
            items.swap(to, next);
            from[to] = to;
            to = next;
        }
        from[to] = to;
    }
}

/// Sorts by what each item is sorted by.
pub(crate) fn sort_by_key<T, K: Ord>(items: &mut [T], key: impl Fn(&T) -> K) {
    sort(items, |a, b| key(a).cmp(&key(b)));
}

/// Which item comes first, which second, and so on.
fn order(count: usize, by: &dyn Fn(usize, usize) -> Ordering) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| by(a, b));
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    proptest::proptest! {
        #[test]
        fn it_sorts_as_the_standard_library(keys in proptest::collection::vec(0_u8..8, 0..60)) {
            let mut items: Vec<(u8, usize)> = keys.into_iter().zip(0..).collect();
            let mut expected = items.clone();
            expected.sort_by_key(|item| item.0);
            sort(&mut items, |a, b| a.0.cmp(&b.0));
            assert_eq!(items, expected);
        }
    }
}
