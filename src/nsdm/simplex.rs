//! Nelder–Mead's simplex search over the unit cube, with coefficients for many variables.
//!
//! Nelder and Mead, The Computer Journal 7 (1965); coefficients of Gao and Han,
//! Computational Optimization and Applications 51 (2012), eq. 4.1: with the usual ones the
//! simplex of 30 variables soon loses its shape. Own code, because argmin 0.11, although well
//! maintained, rejects contractions above 1/2 (0.73 is needed for 30 variables), has
//! no bounds, and counts iterations instead of evaluations.

use super::genetic::Individual;

/// Edge of the first simplex.
const EDGE: f64 = 0.05;
/// A simplex whose objectives differ by less than this share is exhausted.
const FLAT: f64 = 1e-9;
/// A further simplex is tried only if the last one has gained this share.
const GAIN: f64 = 1e-3;

/// Improves `start` with at most `evaluations` calls of `objective`, which must not return
/// NaN. Points outside of the cube are moved to its surface.
///
/// Returns the best point, never worse than `start`, and the number of calls.
pub(super) fn polish<const N: usize>(
    objective: impl Fn(&[f64; N]) -> f64,
    start: Individual<N>,
    evaluations: usize,
) -> (Individual<N>, usize) {
    let mut best = start;
    let mut used = 0;
    let mut edge = EDGE;
    // A simplex on the surface of the cube may be flat and end early: begin again from its best
    // point, on the other side.
    while used + N < evaluations {
        let counted = |genes: &[f64; N]| Individual { genes: *genes, objective: objective(genes) };
        let (found, calls) = search(counted, best, edge, evaluations - used);
        used += calls;
        let gained = best.objective - found.objective;
        let enough = gained > GAIN * best.objective;
        best = found;
        edge = -edge;
        if !enough && edge > 0.0 {
            break;
        }
    }
    (best, used)
}

/// One simplex, until it is flat or the next step might need more than `evaluations`.
fn search<const N: usize>(
    objective: impl Fn(&[f64; N]) -> Individual<N>,
    start: Individual<N>,
    edge: f64,
    evaluations: usize,
) -> (Individual<N>, usize) {
    let n = N as f64;
    let (expansion, contraction, shrinkage) =
        (1.0 + 2.0 / n, 0.75 - 1.0 / (2.0 * n), 1.0 - 1.0 / n);
    let mut simplex = first_simplex(&objective, start, edge);
    let mut used = N;
    loop {
        simplex.sort_by(|a, b| a.objective.total_cmp(&b.objective));
        let (best, worst) = (simplex[0], simplex[N]);
        let flat = worst.objective - best.objective <= FLAT * best.objective;
        // Reflection, contraction and a shrunken simplex are the dearest step.
        if flat || used + N + 2 > evaluations {
            return (best, used);
        }
        let centroid: [f64; N] =
            std::array::from_fn(|i| simplex[..N].iter().map(|p| p.genes[i]).sum::<f64>() / n);
        // From the centroid, this factor times as far as the worst point lies on the other side.
        let along = |far: f64| -> [f64; N] {
            std::array::from_fn(|i| {
                (centroid[i] + far * (centroid[i] - worst.genes[i])).clamp(0.0, 1.0)
            })
        };
        let reflected = objective(&along(1.0));
        used += 1;
        if reflected.objective < best.objective {
            let expanded = objective(&along(expansion));
            used += 1;
            let further = expanded.objective < reflected.objective;
            simplex[N] = if further { expanded } else { reflected };
            continue;
        }
        if reflected.objective < simplex[N - 1].objective {
            simplex[N] = reflected;
            continue;
        }
        let outside = reflected.objective < worst.objective;
        let contracted = objective(&along(if outside { contraction } else { -contraction }));
        used += 1;
        if contracted.objective < reflected.objective.min(worst.objective) {
            simplex[N] = contracted;
            continue;
        }
        for point in &mut simplex[1..] {
            let genes: [f64; N] = std::array::from_fn(|i| {
                best.genes[i] + shrinkage * (point.genes[i] - best.genes[i])
            });
            *point = objective(&genes);
        }
        used += N;
    }
}

/// The start and a point beside it along each edge of the cube.
fn first_simplex<const N: usize>(
    objective: impl Fn(&[f64; N]) -> Individual<N>,
    start: Individual<N>,
    edge: f64,
) -> Vec<Individual<N>> {
    let beside = |i: usize| {
        let mut genes = start.genes;
        let step = if (0.0..=1.0).contains(&(genes[i] + edge)) { edge } else { -edge };
        genes[i] = (genes[i] + step).clamp(0.0, 1.0);
        objective(&genes)
    };
    std::iter::once(start).chain((0..N).map(beside)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    fn start<const N: usize>(objective: impl Fn(&[f64; N]) -> f64, at: f64) -> Individual<N> {
        Individual { genes: [at; N], objective: objective(&[at; N]) }
    }

    /// Rosenbrock's valley, scaled into the cube: the bottom is at 0.75 in every gene.
    fn valley<const N: usize>(genes: &[f64; N]) -> f64 {
        let x: [f64; N] = std::array::from_fn(|i| 4.0 * genes[i] - 2.0);
        x.windows(2).map(|w| 100.0 * (w[1] - w[0] * w[0]).powi(2) + (1.0 - w[0]).powi(2)).sum()
    }

    #[test]
    fn walks_along_rosenbrocks_valley() {
        let (found, used) = polish(valley::<4>, start(valley, 0.3), 4_000);
        assert!(found.objective < 1e-6, "{found:?}");
        assert!(used <= 4_000);
    }

    #[test]
    fn descends_in_thirty_variables() {
        let bowl =
            |g: &[f64; 30]| (0..30).map(|i| (1 + i) as f64 * (g[i] - 0.4).powi(2)).sum::<f64>();
        let before = start(bowl, 0.6);
        let (found, _) = polish(bowl, before, 20_000);
        assert!(found.objective < 1e-4 * before.objective, "{}", found.objective);
    }

    /// The bottom lies on a corner: the way there goes along the surface.
    #[test]
    fn stays_in_the_cube() {
        let slope = |g: &[f64; 6]| {
            assert!(g.iter().all(|g| (0.0..=1.0).contains(g)));
            1.0 + g.iter().sum::<f64>()
        };
        let (found, _) = polish(slope, start(slope, 0.5), 3_000);
        assert!(found.objective < 1.01, "{found:?}");
    }

    #[test]
    fn counts_and_bounds_its_evaluations() {
        for most in [0, 5, 30, 31, 32, 100, 1_000] {
            let calls = Cell::new(0);
            let counted = |g: &[f64; 30]| {
                calls.set(calls.get() + 1);
                valley(g)
            };
            let before = start(valley, 0.3);
            let (found, used) = polish(counted, before, most);
            assert_eq!(used, calls.get());
            assert!(used <= most, "{used} of {most}");
            assert!(found.objective <= before.objective);
        }
    }
}
