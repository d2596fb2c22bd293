//! Nelder–Mead's simplex search over the unit cube, with coefficients for many variables.
//!
//! Nelder and Mead, The Computer Journal 7 (1965); coefficients of Gao and Han,
//! Computational Optimization and Applications 51 (2012), eq. 4.1: with the usual ones the
//! simplex of 30 variables soon loses its shape. Own code, because argmin 0.11, although well
//! maintained, rejects contractions above 1/2 (0.73 is needed for 30 variables), has
//! no bounds, and counts iterations instead of evaluations.
//!
//! Its start: node values by linear least squares along the reference motion.
//!
//! Bounded Gauss–Seidel on the normal equations. It makes the first population several times better, the last one little.

use super::genetic::{DAMPING_NODES, Genes, Individual, STIFFNESS_NODES, Scales};
use super::{DAMPING_N_S_PER_M, STIFFNESS_N_PER_M, Target};
use crate::order;

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
        order::sort(&mut simplex, |a, b| a.objective.total_cmp(&b.objective));
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

const COLUMNS: usize = STIFFNESS_NODES + DAMPING_NODES;
/// Rounds over all values; the start need not be exact, because the search continues from it.
const ROUNDS: usize = 500;

/// Replaces the node values in `genes` by those that fit the reference best; the positions
/// of the nodes are kept.
///
/// With x and x' those of the reference, `−m a = k(|x|) x + c(|x'|) x'` is linear in the node
/// values. The squares are minimised within the bounds by going through the values in turn,
/// each to its best within its own bounds (projected Gauss–Seidel on the normal equations).
/// The equations are often singular (an empty segment, a spring that does a damper's work), which
/// a factorisation would not bear, and clipping its solution would not be the best in bounds.
pub(super) fn least_squares(genes: &mut Genes, target: &Target) {
    let scales = target.scales();
    let nodes = scales.nodes(genes);
    let mut normal = [[0.0; COLUMNS]; COLUMNS];
    let mut right = [0.0; COLUMNS];
    for i in 0..target.time_s.len() {
        let (x, v) = (target.displacement_m[i], target.velocity[i]);
        let mut row = [0.0; COLUMNS];
        let (k, c) = row.split_at_mut(STIFFNESS_NODES);
        add_shares(k, &nodes.x_m, x);
        add_shares(c, &nodes.v_m_per_s, v);
        let force = -target.mass_kg * target.acceleration[i];
        for (j, value) in row.iter().enumerate().filter(|(_, value)| **value != 0.0) {
            right[j] += value * force;
            for (sum, other) in normal[j].iter_mut().zip(&row) {
                *sum += value * other;
            }
        }
    }
    let bounds = |j: usize| if j < STIFFNESS_NODES { STIFFNESS_N_PER_M } else { DAMPING_N_S_PER_M };
    // A value that no sample determines stays in the middle of the search range.
    let (mut values, middle) = ([0.0; COLUMNS], Scales::middle());
    values[..STIFFNESS_NODES].fill(middle.0);
    values[STIFFNESS_NODES..].fill(middle.1);
    for _ in 0..ROUNDS {
        for j in 0..COLUMNS {
            if normal[j][j] > 0.0 {
                let sum: f64 = normal[j].iter().zip(&values).map(|(n, value)| n * value).sum();
                let [low, high] = bounds(j);
                values[j] = (values[j] + (right[j] - sum) / normal[j][j]).clamp(low, high);
            }
        }
    }
    let stiffness = std::array::from_fn(|i| values[i]);
    let damping = std::array::from_fn(|i| values[STIFFNESS_NODES + i]);
    Scales::set_values(genes, &stiffness, &damping);
}

/// Derivatives of `f(|u|) u` by the node values of a piecewise linear f.
fn add_shares(row: &mut [f64], nodes: &[f64], u: f64) {
    let after = nodes.partition_point(|&node| node <= u.abs());
    if after == nodes.len() {
        row[after - 1] += u;
        return;
    }
    let share = (u.abs() - nodes[after - 1]) / (nodes[after] - nodes[after - 1]);
    row[after - 1] += (1.0 - share) * u;
    row[after] += share * u;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nsdm::genetic::VARIABLES;
    use crate::stream::Stream;
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

    /// A reference made by a law with the same nodes: the squares are nearly zero, and the law's
    /// own values return its acceleration.
    #[test]
    fn finds_the_law_that_made_the_reference() {
        let scales = Scales { displacement_m: 0.6, speed_m_per_s: 12.0 };
        let mut stream = Stream::new(11, 0);
        let mut genes: Genes = std::array::from_fn(|_| 0.3 + 0.3 * stream.unit());
        let law = scales.law(&genes).unwrap();
        let time_s: Vec<f64> = (0..400).map(|i| 0.5e-3 * f64::from(i)).collect();
        let motion = law.run(24e3, 12.0, &time_s).unwrap();
        let mut target =
            Target::new(24e3, 12.0, time_s, motion.v_m_per_s.clone(), motion.a_m_per_s2.clone())
                .unwrap();
        // Exactly what the law saw, so that only the least squares are judged.
        target.displacement_m = motion.x_m.clone();
        target.largest_m = 0.6;
        genes[..STIFFNESS_NODES].fill(0.9);
        genes[2 * STIFFNESS_NODES - 2..VARIABLES - 4].fill(0.9);
        least_squares(&mut genes, &target);
        let found = target.scales().law(&genes).unwrap();
        let (mut off, mut all) = (0.0, 0.0);
        for ((x, v), a) in motion.x_m.iter().zip(&motion.v_m_per_s).zip(&motion.a_m_per_s2) {
            let force = found.spring_force_n(*x) + found.damping.at(*v) * v;
            off += (force / 24e3 + a).abs();
            all += a.abs();
        }
        assert!(off < 1e-3 * all, "{}", off / all);
    }

    #[test]
    fn shares_are_those_of_the_segment() {
        let mut row = [0.0; 3];
        add_shares(&mut row, &[0.0, 1.0, 2.0], -1.25);
        assert_eq!(row, [0.0, -0.75 * 1.25, -0.25 * 1.25]);
        let mut row = [0.0; 3];
        add_shares(&mut row, &[0.0, 1.0, 2.0], 5.0);
        assert_eq!(row, [0.0, 0.0, 5.0]);
    }
}
