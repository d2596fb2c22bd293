//! Piecewise linear functions: which segment holds a value, and the straight line over it.
//!
//! Curves, dampers, springs and warps are tables over increasing nodes. The continuation beyond the ends
//! differs, so each defines its own; the search and the line are here.

/// Index of the segment that holds `at`: `nodes[i] <= at < nodes[i + 1]`, the first or last one
/// beyond the ends. `nodes`: rising, at least two.
#[inline]
pub(crate) fn segment(nodes: &[f64], at: f64) -> usize {
    nodes.partition_point(|&node| node <= at).clamp(1, nodes.len() - 1) - 1
}

/// The line through segment `i` at `at`, as a share of the rise: `y₀ + (x − x₀)/(x₁ − x₀) · Δy`.
#[inline]
pub(crate) fn by_share(nodes: &[f64], values: &[f64], i: usize, at: f64) -> f64 {
    let share = (at - nodes[i]) / (nodes[i + 1] - nodes[i]);
    values[i] + share * (values[i + 1] - values[i])
}

/// The same line as a product first: `y₀ + Δy · (x − x₀)/(x₁ − x₀)`. It rounds otherwise in the
/// last bit, and those that have always rounded so keep their results.
#[inline]
pub(crate) fn by_product(nodes: &[f64], values: &[f64], i: usize, at: f64) -> f64 {
    values[i] + (values[i + 1] - values[i]) * (at - nodes[i]) / (nodes[i + 1] - nodes[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_segment_begins_at_its_node() {
        let nodes = [0.0, 1.0, 3.0];
        let at = [-1.0, 0.0, 0.5, 1.0, 2.9, 3.0, 9.0, f64::NAN];
        assert_eq!(at.map(|at| segment(&nodes, at)), [0, 0, 0, 1, 1, 1, 1, 0]);
    }

    #[test]
    fn both_lines_go_through_their_ends() {
        let (nodes, values) = ([0.0, 1.0, 3.0], [5.0, 7.0, 1.0]);
        for line in [by_share, by_product] {
            assert_eq!([1.0, 2.0, 3.0].map(|at| line(&nodes, &values, 1, at)), [7.0, 4.0, 1.0]);
        }
    }
}
