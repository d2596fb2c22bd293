//! A start for the search: node values by linear least squares along the reference motion.
//!
//! Bounded Gauss–Seidel on the normal equations. It makes the first population several times better, the last one little.

use super::genetic::{DAMPING_NODES, Genes, STIFFNESS_NODES, Scales};
use super::{DAMPING_N_S_PER_M, STIFFNESS_N_PER_M, Target};

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
    use super::super::genetic::VARIABLES;
    use super::*;
    use crate::stream::Stream;

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
            let force = found.spring_force_n(*x) + found.damping_n_s_per_m(*v) * v;
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
