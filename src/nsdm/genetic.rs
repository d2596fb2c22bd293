//! A real-coded genetic algorithm over the unit cube, and the genes of an NSDM in it.
//!
//! Parents by tournament, children by simulated binary crossover (Deb and Agrawal, Complex
//! Systems 9, 1995) and polynomial mutation (Deb and Goyal, Computer Science and Informatics
//! 26, 1996), both with their distributions cut at the bounds (Deb, Computer Methods in
//! Applied Mechanics and Engineering 186, 2000). The best two survive.

use super::law::{Nsdm, PiecewiseLinear};
use super::motion::Laws;
use super::{DAMPING_N_S_PER_M, STIFFNESS_N_PER_M};
use crate::error::Error;
use crate::order;
use crate::parallel;
use crate::stream::Stream;

const TOURNAMENT: usize = 3;
const CROSSOVER_PROBABILITY: f64 = 0.9;
const CROSSOVER_ETA: f64 = 15.0;
const MUTATION_ETA: f64 = 20.0;
pub(super) const ELITES: usize = 2;

/// Genes and what they are worth; less is better.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Individual<const N: usize> {
    pub genes: [f64; N],
    pub objective: f64,
}

/// The best individual, and the best objective of the first population and of each generation.
pub(super) struct Evolved<const N: usize> {
    pub best: Individual<N>,
    pub history: Vec<f64>,
    pub evaluations: usize,
}

/// Minimises `objective`, which must not return NaN, over `[0, 1]^N`.
///
/// `start` stands at the beginning of the first population; the rest is drawn evenly. Every
/// individual of the first population and every pair of parents has its own random stream,
/// and the population is kept sorted with ties in the order of birth, so the result has the
/// same bits for any number of threads.
pub(super) fn minimise<const N: usize>(
    objective: impl Fn(&[f64; N]) -> f64 + Sync,
    start: &[[f64; N]],
    population: usize,
    generations: usize,
    seed: u64,
) -> Evolved<N> {
    let individual = |genes| Individual { genes, objective: objective(&genes) };
    let sort = |individuals: &mut Vec<Individual<N>>| {
        order::sort(individuals, |a, b| a.objective.total_cmp(&b.objective));
    };
    let first = |i: usize| {
        let mut stream = stream(seed, 0, i);
        let drawn = std::array::from_fn(|_| stream.unit());
        individual(start.get(i).copied().unwrap_or(drawn))
    };
    let mut parents = parallel::map(0..population, first);
    sort(&mut parents);
    let mut history = vec![parents[0].objective];
    let pairs = (population - ELITES).div_ceil(2);
    for generation in 1..=generations {
        let pair = |i: usize| {
            let mut stream = stream(seed, generation, i);
            // The population is sorted: the winner of a tournament is the smallest index.
            let mut winner =
                || (0..TOURNAMENT).map(|_| stream.below(population)).min().unwrap_or_default();
            let (mut a, mut b) = (parents[winner()].genes, parents[winner()].genes);
            cross(&mut a, &mut b, &mut stream);
            mutate(&mut a, &mut stream);
            mutate(&mut b, &mut stream);
            [individual(a), individual(b)]
        };
        let children = parallel::map(0..pairs, pair);
        // Of an odd number of children the last one is not needed.
        parents.truncate(ELITES);
        parents.extend(children.into_iter().flatten().take(population - ELITES));
        sort(&mut parents);
        history.push(parents[0].objective);
    }
    let evaluations = population + generations * 2 * pairs;
    Evolved { best: parents[0], history, evaluations }
}

/// The stream of an individual of the first population or of a pair of parents.
fn stream(seed: u64, generation: usize, i: usize) -> Stream {
    Stream::new(seed, ((generation as u64) << 32) | i as u64)
}

/// Simulated binary crossover: each gene of the children lies about one of the parents', as
/// far as the parents lie apart; their mean is kept.
fn cross<const N: usize>(a: &mut [f64; N], b: &mut [f64; N], stream: &mut Stream) {
    if stream.unit() >= CROSSOVER_PROBABILITY {
        return;
    }
    for (a, b) in a.iter_mut().zip(b) {
        if stream.unit() < 0.5 {
            continue;
        }
        let (u, swap) = (stream.unit(), stream.unit() < 0.5);
        let (low, high) = (a.min(*b), a.max(*b));
        let apart = high - low;
        if apart < 1e-14 {
            continue;
        }
        let power = CROSSOVER_ETA + 1.0;
        // The larger child may not pass the bound that is nearer to its parent.
        let beta = 1.0 + 2.0 / apart * low.min(1.0 - high);
        let alpha = 2.0 - libm::pow(beta, -power);
        let share = if u * alpha <= 1.0 { u * alpha } else { 1.0 / (2.0 - u * alpha) };
        let spread = libm::pow(share, 1.0 / power) * apart;
        let children = (0.5 * (low + high - spread), 0.5 * (low + high + spread));
        let (first, second) = if swap { (children.1, children.0) } else { children };
        (*a, *b) = (first.clamp(0.0, 1.0), second.clamp(0.0, 1.0));
    }
}

/// Polynomial mutation of one gene in N on average.
fn mutate<const N: usize>(genes: &mut [f64; N], stream: &mut Stream) {
    let power = MUTATION_ETA + 1.0;
    for gene in genes {
        if stream.unit() >= 1.0 / N as f64 {
            continue;
        }
        let u = stream.unit();
        let shift = if u < 0.5 {
            libm::pow(2.0 * u + (1.0 - 2.0 * u) * libm::pow(1.0 - *gene, power), 1.0 / power) - 1.0
        } else {
            1.0 - libm::pow(
                2.0 * (1.0 - u) + (2.0 * u - 1.0) * libm::pow(*gene, power),
                1.0 / power,
            )
        };
        *gene = (*gene + shift).clamp(0.0, 1.0);
    }
}

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
                (soft * libm::exp(stiffness[i] * libm::log(stiff / soft))).clamp(soft, stiff)
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
            *gene = libm::log(k.clamp(soft, stiff) / soft) / libm::log(stiff / soft);
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
    let gap =
        |i: usize| genes.get(i).map_or(1.0, |g| libm::exp((2.0 * g - 1.0) * libm::log(GAP_RATIO)));
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

    fn bowl(genes: &[f64; 5]) -> f64 {
        (0..5).map(|i| (genes[i] - 0.1 * (i + 1) as f64).powi(2)).sum()
    }

    #[test]
    fn finds_the_bottom_of_a_bowl() {
        let evolved = minimise(bowl, &[], 40, 100, 1);
        assert!(evolved.best.objective < 1e-4, "{}", evolved.best.objective);
        assert_eq!(evolved.best.objective, bowl(&evolved.best.genes));
        assert_eq!(evolved.history.len(), 101);
        assert!(evolved.history.windows(2).all(|w| w[1] <= w[0]), "elites survive");
        assert_eq!(evolved.evaluations, 40 + 100 * 38);
    }

    #[test]
    fn an_odd_population_keeps_its_size() {
        let evolved = minimise(bowl, &[], 7, 20, 1);
        assert_eq!(evolved.evaluations, 7 + 20 * 6);
    }

    #[test]
    fn start_is_part_of_the_first_population() {
        let bottom = [0.1, 0.2, 0.3, 0.4, 0.5];
        let evolved = minimise(bowl, &[bottom], 10, 0, 1);
        assert!(evolved.history[0] < 1e-30);
    }

    /// The children's mean is the parents', and each lies nearer to its own parent the
    /// larger eta is: P(|β − 1| < w) follows from the density 0.5 (η + 1) β^η.
    #[test]
    fn children_lie_about_their_parents() {
        let mut stream = Stream::new(2, 0);
        let (mut changed, mut within) = (0, 0);
        for _ in 0..100_000 {
            let (mut a, mut b) = ([0.45], [0.55]);
            cross(&mut a, &mut b, &mut stream);
            assert!((a[0] + b[0] - 1.0).abs() < 1e-12);
            let beta = (a[0] - b[0]).abs() / 0.1;
            if (beta - 1.0).abs() > 1e-12 {
                changed += 1;
                within += usize::from(beta < 0.95);
            }
        }
        // A pair crosses in 0.9 of cases, a gene in half of these.
        assert!((changed as f64 / 45_000.0 - 1.0).abs() < 0.03, "{changed}");
        let expected = 0.5 * 0.95_f64.powi(16);
        assert!((within as f64 / changed as f64 - expected).abs() < 0.01, "{within}");
    }

    #[test]
    fn mutation_keeps_to_the_bounds_and_to_its_distribution() {
        let mut stream = Stream::new(2, 1);
        let mut shifts = Vec::new();
        for start in [0.0, 0.5, 1.0] {
            for _ in 0..20_000 {
                let mut genes = [start];
                mutate(&mut genes, &mut stream);
                assert!((0.0..=1.0).contains(&genes[0]));
                if start == 0.5 {
                    shifts.push((genes[0] - 0.5).abs());
                }
            }
        }
        // Median of |δ|: δ = 1 − (2(1 − u))^{1/21} at u = 3/4; the bounds are far.
        shifts.sort_by(f64::total_cmp);
        let median = 1.0 - 0.5_f64.powf(1.0 / 21.0);
        assert!((shifts[10_000] / median - 1.0).abs() < 0.05, "{} {median}", shifts[10_000]);
    }
}

#[cfg(test)]
mod genes_tests {
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
