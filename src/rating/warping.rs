//! Dynamic time warping: which samples of two signals belong together.

/// Which cell a path comes from.
const FROM_FIRST: u8 = 0;
const FROM_SECOND: u8 = 1;
const FROM_BOTH: u8 = 2;

/// The path of pairs `(index of first, index of second)` with the smallest sum of squared
/// distances from the first samples to the last, in steps (1,0), (0,1), (1,1).
///
/// Equal lengths, at least one; pairs lie less than `window` samples apart (at least one).
/// Of equal sums the step that stands first above is taken. Needs one byte for each cell of
/// the window: `n (2 window − 1)`.
pub(crate) fn path(first: &[f64], second: &[f64], window: usize) -> Vec<(usize, usize)> {
    let n = first.len();
    let reach = window - 1;
    let width = 2 * reach + 1;
    // Cell (i, j) stands at j + reach − i of row i.
    let mut from = vec![FROM_BOTH; n * width];
    // The row above, and the row in work: sums, infinite outside of the window.
    let mut above = vec![f64::INFINITY; width + 1];
    let mut row = vec![f64::INFINITY; width + 1];
    for i in 0..n {
        row.fill(f64::INFINITY);
        let within = i.saturating_sub(reach)..(i + reach + 1).min(n);
        for (j, other) in within.clone().zip(&second[within]) {
            let cell = j + reach - i;
            let distance = first[i] - other;
            let left = if cell > 0 { row[cell - 1] } else { f64::INFINITY };
            // One row up the same j stands one further to the right.
            let before = [above[cell + 1], left, above[cell]];
            let mut least = 0;
            for step in 1..3 {
                if before[step] < before[least] {
                    least = step;
                }
            }
            let sum = if (i, j) == (0, 0) { 0.0 } else { before[least] };
            row[cell] = sum + distance * distance;
            from[i * width + cell] = [FROM_FIRST, FROM_SECOND, FROM_BOTH][least];
        }
        std::mem::swap(&mut above, &mut row);
    }
    let (mut i, mut j) = (n - 1, n - 1);
    let mut path = vec![(i, j)];
    while (i, j) != (0, 0) {
        match from[i * width + j + reach - i] {
            FROM_FIRST => i -= 1,
            FROM_SECOND => j -= 1,
            _ => (i, j) = (i - 1, j - 1),
        }
        path.push((i, j));
    }
    path.reverse();
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn path_by_hand() {
        // The peak is one sample late: 0-0, 0-1, 1-2, 2-3, 3-3.
        let path = path(&[0.0, 5.0, 1.0, 1.0], &[0.0, 0.0, 5.0, 1.0], 4);
        assert_eq!(path, [(0, 0), (0, 1), (1, 2), (2, 3), (3, 3)]);
    }

    #[test]
    fn a_window_of_one_is_the_diagonal() {
        let path = path(&[0.0, 5.0, 1.0], &[5.0, 1.0, 0.0], 1);
        assert_eq!(path, [(0, 0), (1, 1), (2, 2)]);
    }

    #[test]
    fn no_path_within_the_window_is_shorter() {
        /// Smallest sum from the first cell to (i, j), by trying all paths.
        fn least(a: &[f64], b: &[f64], i: usize, j: usize, window: usize) -> f64 {
            if i.abs_diff(j) >= window {
                return f64::INFINITY;
            }
            let own = (a[i] - b[j]).powi(2);
            let mut before = f64::INFINITY;
            if i > 0 {
                before = before.min(least(a, b, i - 1, j, window));
            }
            if j > 0 {
                before = before.min(least(a, b, i, j - 1, window));
            }
            if i > 0 && j > 0 {
                before = before.min(least(a, b, i - 1, j - 1, window));
            }
            own + if (i, j) == (0, 0) { 0.0 } else { before }
        }
        let a = [0.0, 3.0, 1.0, 4.0, 1.0, 5.0, 9.0];
        let b = [2.0, 6.0, 5.0, 3.0, 5.0, 8.0, 9.0];
        for window in 1..=7 {
            let sum: f64 = path(&a, &b, window).iter().map(|&(i, j)| (a[i] - b[j]).powi(2)).sum();
            assert_eq!(sum, least(&a, &b, 6, 6, window), "window {window}");
        }
    }
}
