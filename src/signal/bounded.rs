//! Least squares with unknowns between 0 and an upper bound.

/// Where an unknown stands.
#[derive(Clone, Copy, PartialEq)]
enum Stand {
    AtZero,
    AtUpper,
    Free,
}

/// The `0 ≤ x ≤ upper` with the smallest `xᵀ A x − 2 bᵀ x`, for a symmetric matrix `A` (rows) that
/// is positive definite, by an active set: that of Lawson and Hanson (Solving Least Squares
/// Problems, 1974, chapter 23) on the normal equations, with a second bound (Stark and Parker,
/// Computational Statistics 10, 1995). An upper bound may be infinite.
pub(crate) fn bounded(a: &[Vec<f64>], b: &[f64], upper: &[f64]) -> Vec<f64> {
    let n = b.len();
    let mut x = vec![0.0; n];
    let mut stands = vec![Stand::AtZero; n];
    let scale = b.iter().fold(0.0_f64, |most, b| most.max(b.abs()));
    // Each round frees one unknown; more rounds than these would be rounding going in circles.
    for _ in 0..6 * n {
        let gain = |i: usize| match stands[i] {
            Stand::AtZero if upper[i] > 0.0 => b[i] - dot(&a[i], &x),
            Stand::AtUpper => dot(&a[i], &x) - b[i],
            _ => f64::NEG_INFINITY,
        };
        let best = (0..n).map(|i| (i, gain(i))).max_by(|p, q| p.1.total_cmp(&q.1));
        let Some((next, most)) = best else { break };
        if most <= 1e-10 * scale {
            break;
        }
        stands[next] = Stand::Free;
        while step_to_bound(a, b, upper, &mut x, &mut stands) {}
    }
    x
}

/// Moves the free unknowns to their solution, or towards it until the first of them meets a bound
/// and is there; whether one did.
fn step_to_bound(
    a: &[Vec<f64>],
    b: &[f64],
    upper: &[f64],
    x: &mut [f64],
    stands: &mut [Stand],
) -> bool {
    let solved = solve_free(a, b, x, stands);
    let bound = |i: usize| if solved[i] <= 0.0 { 0.0 } else { upper[i] };
    let leaves =
        |i: &usize| stands[*i] == Stand::Free && !(solved[*i] > 0.0 && solved[*i] < upper[*i]);
    let share_of = |i: usize| {
        let share = (bound(i) - x[i]) / (solved[i] - x[i]);
        if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 }
    };
    let leaving: Vec<(usize, f64)> =
        (0..x.len()).filter(leaves).map(|i| (i, share_of(i))).collect();
    let Some(share) = leaving.iter().map(|(_, share)| *share).reduce(f64::min) else {
        x.copy_from_slice(&solved);
        return false;
    };
    let bounds: Vec<(usize, f64)> =
        leaving.iter().filter(|(_, s)| *s <= share).map(|&(i, _)| (i, bound(i))).collect();
    for i in (0..x.len()).filter(|&i| stands[i] == Stand::Free) {
        x[i] += share * (solved[i] - x[i]);
    }
    for (i, bound) in bounds {
        x[i] = bound;
        stands[i] = if bound == 0.0 { Stand::AtZero } else { Stand::AtUpper };
    }
    true
}

/// The solution of the equations of the free unknowns, with the others where they are.
fn solve_free(a: &[Vec<f64>], b: &[f64], x: &[f64], stands: &[Stand]) -> Vec<f64> {
    let free: Vec<usize> = (0..b.len()).filter(|&i| stands[i] == Stand::Free).collect();
    let held: Vec<usize> = (0..b.len()).filter(|&i| stands[i] == Stand::AtUpper).collect();
    let right = |r: usize| b[free[r]] - held.iter().map(|&k| a[free[r]][k] * x[k]).sum::<f64>();
    let right: Vec<f64> = (0..free.len()).map(right).collect();
    let solved = Cholesky::of(free.len(), |r, c| a[free[r]][free[c]]).solve(&right);
    let mut x = x.to_vec();
    for (&i, found) in free.iter().zip(solved) {
        x[i] = found;
    }
    x
}

/// The lower factor of a symmetric matrix that is positive definite.
pub(crate) struct Cholesky {
    rows: Vec<Vec<f64>>,
}

impl Cholesky {
    /// Of the matrix of `n` rows with these entries; only those up to the diagonal are requested.
    pub(crate) fn of(n: usize, entry: impl Fn(usize, usize) -> f64) -> Self {
        let mut l = vec![vec![0.0; n]; n];
        for r in 0..n {
            for c in 0..=r {
                let rest = entry(r, c) - dot(&l[r][..c], &l[c][..c]);
                l[r][c] = if r == c { rest.max(f64::MIN_POSITIVE).sqrt() } else { rest / l[c][c] };
            }
        }
        Self { rows: l }
    }

    /// The solution of the first equations, as many as right sides are given, for as many unknowns.
    pub(crate) fn solve(&self, right: &[f64]) -> Vec<f64> {
        let l = &self.rows;
        let n = right.len();
        let mut y = vec![0.0; n];
        for r in 0..n {
            y[r] = (right[r] - dot(&l[r][..r], &y[..r])) / l[r][r];
        }
        for r in (0..n).rev() {
            let above: f64 = (r + 1..n).map(|k| l[k][r] * y[k]).sum();
            y[r] = (y[r] - above) / l[r][r];
        }
        y
    }

    /// The logarithm of the determinant of the first `n` rows and columns.
    pub(crate) fn log_determinant(&self, n: usize) -> f64 {
        self.rows[..n].iter().enumerate().map(|(i, row)| 2.0 * libm::log(row[i])).sum()
    }
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn normal(rows: &[[f64; 3]], right: &[f64]) -> (Vec<Vec<f64>>, Vec<f64>) {
        let sum = |f: &dyn Fn(usize) -> f64| (0..rows.len()).map(f).sum();
        let a =
            (0..3).map(|i| (0..3).map(|j| sum(&|r| rows[r][i] * rows[r][j])).collect()).collect();
        (a, (0..3).map(|i| sum(&|r| rows[r][i] * right[r])).collect())
    }

    #[test]
    fn a_solution_that_is_not_negative_is_that_of_least_squares() {
        let rows = [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 2.0], [1.0, 0.0, 1.0]];
        let x = [2.0, 0.5, 3.0];
        let right: Vec<f64> = rows.iter().map(|r| dot(r, &x)).collect();
        let (a, b) = normal(&rows, &right);
        for (found, x) in bounded(&a, &b, &[f64::INFINITY; 3]).iter().zip(x) {
            assert!((found - x).abs() < 1e-9);
        }
    }

    #[test]
    fn an_unknown_that_would_be_negative_is_zero_and_the_others_make_up_for_it() {
        // Without the bound: x = (3, −1, 1).
        let rows = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 1.0]];
        let (a, b) = normal(&rows, &[3.0, -1.0, 3.0]);
        let x = bounded(&a, &b, &[f64::INFINITY; 3]);
        assert_eq!(x[1], 0.0);
        // The residual's gradient is zero along free unknowns and not above along held ones.
        let gain = |i: usize| b[i] - dot(&a[i], &x);
        assert!(gain(0).abs() < 1e-9 && gain(2).abs() < 1e-9 && gain(1) <= 1e-9);
    }

    /// With x₁ held at its bound the others are those of least squares without it.
    #[test]
    fn an_unknown_that_would_be_above_its_bound_stays_there() {
        let rows = [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 2.0], [1.0, 0.0, 1.0]];
        let right: Vec<f64> = rows.iter().map(|r| dot(r, &[2.0, 0.5, 3.0])).collect();
        let (a, b) = normal(&rows, &right);
        let x = bounded(&a, &b, &[1.5, f64::INFINITY, 2.5]);
        assert_eq!((x[0], x[2]), (1.5, 2.5));
        // The second alone: rows 2 and 3 have it once each.
        let alone = ((right[1] - 1.5) + (right[2] - 5.0)) / 2.0;
        assert!((x[1] - alone).abs() < 1e-12, "{} {alone}", x[1]);
        assert_eq!(bounded(&a, &b, &[0.0; 3]), [0.0; 3]);
    }
}

#[cfg(test)]
mod cholesky_tests {
    use super::*;

    #[test]
    fn equations_are_solved() {
        let a = [[4.0, 2.0, -2.0], [2.0, 10.0, 2.0], [-2.0, 2.0, 6.0]];
        let x = [1.0, -2.0, 3.0];
        let right = a.map(|row| dot(&row, &x));
        let of = Cholesky::of(3, |r, c| a[r][c]);
        let two = a[0][0] * a[1][1] - a[0][1] * a[1][0];
        assert!((of.log_determinant(2) - two.ln()).abs() < 1e-12);
        let found = of.solve(&right);
        assert!(found.iter().zip(x).all(|(found, x)| (found - x).abs() < 1e-12), "{found:?}");
        // The first two alone: 4 x + 2 y = 8, 2 x + 10 y = 22.
        let found = Cholesky::of(3, |r, c| a[r][c]).solve(&[8.0, 22.0]);
        assert!((found[0] - 1.0).abs() < 1e-12 && (found[1] - 2.0).abs() < 1e-12, "{found:?}");
    }
}
