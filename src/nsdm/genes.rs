//! The 30 variables of a fit, each between 0 and 1, and the law that they stand for.
//!
//! Distances between nodes are bounded to ten times the previous one and its inverse, in logarithms: without a bound a segment
//! could become narrower than a step.

use super::law::{Nsdm, PiecewiseLinear};
use super::motion::Laws;
use super::{DAMPING_N_S_PER_M, STIFFNESS_N_PER_M};
use crate::error::Error;

/// Nodes of the stiffness: 10 segments.
pub(super) const STIFFNESS_NODES: usize = 11;
/// Nodes of the damping: 5 segments.
pub(super) const DAMPING_NODES: usize = 6;
/// Values at the nodes and the inner nodes of both.
pub(super) const VARIABLES: usize = 2 * (STIFFNESS_NODES + DAMPING_NODES) - 4;
/// A gap between nodes is at most this many times the last one, and at least its inverse.
///
/// Without a bound a segment could shrink below a step of the integration, where it would be
/// passed over by chance.
const GAP_RATIO: f64 = 10.0;

/// Stiffnesses, inner displacements, dampings, inner speeds.
pub(super) type Genes = [f64; VARIABLES];

/// Where the axes end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scales {
    pub displacement_m: f64,
    pub speed_m_per_s: f64,
}

/// Nodes and values of a law.
pub(super) struct Nodes {
    pub x_m: [f64; STIFFNESS_NODES],
    pub stiffness: [f64; STIFFNESS_NODES],
    pub v_m_per_s: [f64; DAMPING_NODES],
    pub damping: [f64; DAMPING_NODES],
}

impl Scales {
    /// Decodes: stiffness evenly in its logarithm, damping evenly, positions by their gaps.
    pub(crate) fn nodes(&self, genes: &Genes) -> Nodes {
        let (stiffness, rest) = genes.split_at(STIFFNESS_NODES);
        let (x_gaps, rest) = rest.split_at(STIFFNESS_NODES - 2);
        let (damping, v_gaps) = rest.split_at(DAMPING_NODES);
        let [soft, stiff] = STIFFNESS_N_PER_M;
        let [low, high] = DAMPING_N_S_PER_M;
        Nodes {
            x_m: positions(x_gaps, self.displacement_m),
            stiffness: std::array::from_fn(|i| {
                (soft * (stiffness[i] * (stiff / soft).ln()).exp()).clamp(soft, stiff)
            }),
            v_m_per_s: positions(v_gaps, self.speed_m_per_s),
            damping: std::array::from_fn(|i| low + damping[i] * (high - low)),
        }
    }

    /// Puts values into the genes, clipped into their bounds.
    pub(crate) fn set_values(
        genes: &mut Genes,
        stiffness: &[f64; STIFFNESS_NODES],
        damping: &[f64; DAMPING_NODES],
    ) {
        let [soft, stiff] = STIFFNESS_N_PER_M;
        let [low, high] = DAMPING_N_S_PER_M;
        for (gene, k) in genes.iter_mut().zip(stiffness) {
            *gene = (k.clamp(soft, stiff) / soft).ln() / (stiff / soft).ln();
        }
        for (gene, c) in genes[2 * STIFFNESS_NODES - 2..].iter_mut().zip(damping) {
            *gene = (c.clamp(low, high) - low) / (high - low);
        }
    }

    /// Stiffness and damping in the middle of what is searched.
    pub(crate) fn middle() -> (f64, f64) {
        let ([soft, stiff], [low, high]) = (STIFFNESS_N_PER_M, DAMPING_N_S_PER_M);
        ((soft * stiff).sqrt(), 0.5 * (low + high))
    }

    pub(crate) fn laws(&self, genes: &Genes, mass_kg: f64) -> Laws {
        let nodes = self.nodes(genes);
        Laws::new(mass_kg, [&nodes.x_m, &nodes.v_m_per_s], [&nodes.stiffness, &nodes.damping])
    }

    pub(crate) fn law(&self, genes: &Genes) -> Result<Nsdm, Error> {
        let nodes = self.nodes(genes);
        Ok(Nsdm {
            stiffness: PiecewiseLinear::new(nodes.x_m.into(), nodes.stiffness.into())?,
            damping: PiecewiseLinear::new(nodes.v_m_per_s.into(), nodes.damping.into())?,
        })
    }
}

/// Nodes from 0 to `end`, always ordered: gaps relative to the last one, normalised to their
/// sum. N nodes have N − 2 free gaps; a gene of a half makes a gap equal to the last one.
fn positions<const N: usize>(genes: &[f64], end: f64) -> [f64; N] {
    let gap = |i: usize| genes.get(i).map_or(1.0, |g| ((2.0 * g - 1.0) * GAP_RATIO.ln()).exp());
    let total: f64 = (0..N - 1).map(gap).sum();
    let mut at = [0.0; N];
    for i in 1..N {
        at[i] = at[i - 1] + gap(i - 1) * end / total;
    }
    at[N - 1] = end;
    at
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::Stream;

    const SCALES: Scales = Scales { displacement_m: 0.8, speed_m_per_s: 13.0 };

    #[test]
    fn there_are_thirty_variables() {
        assert_eq!(VARIABLES, 30);
    }

    #[test]
    fn genes_of_a_half_are_the_middle() {
        let nodes = SCALES.nodes(&[0.5; VARIABLES]);
        for (i, x) in nodes.x_m.iter().enumerate() {
            assert!((x - 0.08 * i as f64).abs() < 1e-15);
        }
        let middle = (1e5_f64 * 1e8).sqrt();
        assert!(nodes.stiffness.iter().all(|k| (k / middle - 1.0).abs() < 1e-12));
        assert!(nodes.damping.iter().all(|&c| c == 2.5e5));
        assert_eq!(nodes.v_m_per_s[DAMPING_NODES - 1], 13.0);
    }

    #[test]
    fn any_genes_are_an_ordered_law_within_bounds() {
        let mut all: Vec<Genes> = vec![[0.0; VARIABLES], [1.0; VARIABLES]];
        all.extend((0..100).map(|number| {
            let mut stream = Stream::new(3, number);
            std::array::from_fn(|_| (3.0 * stream.unit() - 1.0).clamp(0.0, 1.0))
        }));
        for genes in all {
            let law = SCALES.law(&genes).unwrap();
            assert!(law.stiffness.values().iter().all(|k| (1e5..=1e8).contains(k)));
            assert!(law.damping.values().iter().all(|c| (0.0..=5e5).contains(c)));
            assert_eq!((law.stiffness.end(), law.damping.end()), (0.8, 13.0));
        }
    }

    #[test]
    fn values_are_set_clipped_and_found_again() {
        let mut genes = [0.3; VARIABLES];
        let mut stiffness = [2e6; STIFFNESS_NODES];
        (stiffness[0], stiffness[1]) = (-1.0, 1e9);
        let mut damping = [1e5; DAMPING_NODES];
        (damping[0], damping[5]) = (-1.0, 1e9);
        let before = SCALES.nodes(&genes);
        Scales::set_values(&mut genes, &stiffness, &damping);
        let after = SCALES.nodes(&genes);
        assert_eq!((before.x_m, before.v_m_per_s), (after.x_m, after.v_m_per_s));
        let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
        assert!(near(after.stiffness[0], 1e5) && near(after.stiffness[1], 1e8));
        assert!(after.stiffness[2..].iter().all(|&k| near(k, 2e6)));
        assert!(after.damping[0] == 0.0 && near(after.damping[5], 5e5));
        assert!(after.damping[1..5].iter().all(|&c| near(c, 1e5)));
    }
}
