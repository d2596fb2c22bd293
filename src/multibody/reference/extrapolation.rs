//! Gragg's modified midpoint rule, extrapolated in h² (E. Hairer, S. P. Nørsett, G. Wanner,
//! Solving Ordinary Differential Equations I, II.8 and II.9).

use super::motion::Motion;

/// Error per step, relative to the speeds and crushes of the run.
const TOLERANCE: f64 = 1e-12;
/// Rows of the extrapolation, with `2 (j + 1)` substeps each.
const ROWS: usize = 8;

impl Motion<'_> {
    /// Gragg's rule over `h` with `2 (row + 1)` substeps.
    fn midpoint(&self, y: &[f64], first: &[f64], h: f64, row: usize) -> Vec<f64> {
        let substeps = 2 * (row + 1);
        let step = h / substeps as f64;
        let mut before = y.to_vec();
        let mut now: Vec<f64> = y.iter().zip(first).map(|(y, f)| y + step * f).collect();
        for _ in 1..substeps {
            let rates = self.rates(&now);
            for ((before, now), rate) in before.iter_mut().zip(&mut now).zip(&rates) {
                let next = *before + 2.0 * step * rate;
                (*before, *now) = (*now, next);
            }
        }
        let rates = self.rates(&now);
        before.iter().zip(&now).zip(&rates).map(|((b, n), r)| 0.5 * (b + n + step * r)).collect()
    }

    /// The state after `h`, and its error over the tolerance, infinite if no two rows are
    /// within it.
    pub(crate) fn step(&self, y: &[f64], h: f64, scale: &[f64]) -> (Vec<f64>, f64) {
        let first = self.rates(y);
        let mut table: Vec<Vec<f64>> = Vec::with_capacity(ROWS);
        let mut error = f64::INFINITY;
        for row in 0..ROWS {
            let before = error;
            let mut value = self.midpoint(y, &first, h, row);
            // Aitken and Neville in h², along the last row of the table: `previous` is the row
            // before in the same column.
            for (column, previous) in table.iter_mut().enumerate() {
                let ratio = ((row + 1) as f64 / (row - column) as f64).powi(2);
                error = 0.0;
                for ((v, p), s) in value.iter_mut().zip(previous.iter_mut()).zip(scale) {
                    let improved = *v + (*v - *p) / (ratio - 1.0);
                    error = error.max((improved - *v).abs() / (TOLERANCE * s));
                    (*p, *v) = (*v, improved);
                }
            }
            // Over a kink two values may agree by chance, but hardly twice.
            if error <= 1.0 && before <= 1.0 {
                return (value, error);
            }
            table.push(value);
        }
        (y.to_vec(), f64::INFINITY)
    }
}
