//! Symmetric equations, by their Cholesky factor.

/// The lower factor of a symmetric matrix that is positive definite.
pub(crate) struct Cholesky {
    rows: Vec<Vec<f64>>,
}

impl Cholesky {
    /// Of the matrix of `n` rows with these entries; only those up to the diagonal are asked for.
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
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equations_are_solved() {
        let a = [[4.0, 2.0, -2.0], [2.0, 10.0, 2.0], [-2.0, 2.0, 6.0]];
        let x = [1.0, -2.0, 3.0];
        let right = a.map(|row| dot(&row, &x));
        let found = Cholesky::of(3, |r, c| a[r][c]).solve(&right);
        assert!(found.iter().zip(x).all(|(found, x)| (found - x).abs() < 1e-12), "{found:?}");
        // The first two alone: 4 x + 2 y = 8, 2 x + 10 y = 22.
        let found = Cholesky::of(3, |r, c| a[r][c]).solve(&[8.0, 22.0]);
        assert!((found[0] - 1.0).abs() < 1e-12 && (found[1] - 2.0).abs() < 1e-12, "{found:?}");
    }
}
