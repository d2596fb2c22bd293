//! Least squares with unknowns that may not be negative.

/// The `x ≥ 0` with the smallest `xᵀ A x − 2 bᵀ x`, for a symmetric matrix `A` (rows) that is
/// positive definite, by the active set of Lawson and Hanson (Solving Least Squares Problems,
/// 1974, chapter 23) on the normal equations.
pub(crate) fn non_negative(a: &[Vec<f64>], b: &[f64]) -> Vec<f64> {
    let n = b.len();
    let mut x = vec![0.0; n];
    let mut is_free = vec![false; n];
    let scale = b.iter().fold(0.0_f64, |most, b| most.max(b.abs()));
    // Each round frees one unknown; more rounds than these would be rounding going in circles.
    for _ in 0..3 * n {
        let gain = |i: usize| b[i] - dot(&a[i], &x);
        let held = (0..n).filter(|&i| !is_free[i]);
        let best = held.map(|i| (i, gain(i))).max_by(|p, q| p.1.total_cmp(&q.1));
        let Some((next, most)) = best else { break };
        if most <= 1e-10 * scale {
            break;
        }
        is_free[next] = true;
        loop {
            let solved = solve_free(a, b, &is_free);
            let negative = |i: &usize| is_free[*i] && solved[*i] <= 0.0;
            // As far towards the solution as no unknown becomes negative.
            let share = (0..n).filter(negative).map(|i| x[i] / (x[i] - solved[i])).reduce(f64::min);
            let Some(share) = share else {
                x = solved;
                break;
            };
            let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
            let stays =
                |i: usize| is_free[i] && !(negative(&i) && x[i] / (x[i] - solved[i]) <= share);
            let free_now: Vec<bool> = (0..n).map(stays).collect();
            for i in 0..n {
                x[i] = if free_now[i] { x[i] + share * (solved[i] - x[i]) } else { 0.0 };
            }
            if free_now == is_free {
                break;
            }
            is_free = free_now;
        }
    }
    x
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The solution of the equations of the free unknowns, with the others at zero, by Cholesky.
fn solve_free(a: &[Vec<f64>], b: &[f64], is_free: &[bool]) -> Vec<f64> {
    let free: Vec<usize> = (0..b.len()).filter(|&i| is_free[i]).collect();
    let n = free.len();
    let mut l = vec![vec![0.0; n]; n];
    for r in 0..n {
        for c in 0..=r {
            let rest = a[free[r]][free[c]] - dot(&l[r][..c], &l[c][..c]);
            l[r][c] = match r == c {
                true => rest.max(f64::MIN_POSITIVE).sqrt(),
                false => rest / l[c][c],
            };
        }
    }
    let mut y = vec![0.0; n];
    for r in 0..n {
        y[r] = (b[free[r]] - dot(&l[r][..r], &y[..r])) / l[r][r];
    }
    for r in (0..n).rev() {
        let above: f64 = (r + 1..n).map(|k| l[k][r] * y[k]).sum();
        y[r] = (y[r] - above) / l[r][r];
    }
    let mut x = vec![0.0; b.len()];
    for (&i, y) in free.iter().zip(y) {
        x[i] = y;
    }
    x
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
        for (found, x) in non_negative(&a, &b).iter().zip(x) {
            assert!((found - x).abs() < 1e-9);
        }
    }

    #[test]
    fn an_unknown_that_would_be_negative_is_zero_and_the_others_make_up_for_it() {
        // Without the bound: x = (3, −1, 1).
        let rows = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 1.0]];
        let (a, b) = normal(&rows, &[3.0, -1.0, 3.0]);
        let x = non_negative(&a, &b);
        assert_eq!(x[1], 0.0);
        // The residual's gradient is zero along free unknowns and not above along held ones.
        let gain = |i: usize| b[i] - dot(&a[i], &x);
        assert!(gain(0).abs() < 1e-9 && gain(2).abs() < 1e-9 && gain(1) <= 1e-9);
    }
}
