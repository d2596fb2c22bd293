//! Stopped mass: how much of the moving mass a crush zone has stopped at each deflection.
//!
//! A crush zone comes to rest from its tip on. Contact force and body speed alone determine by momentum
//! `m_s = M − (M v₀ − J)/v` with the impulse `J = ∫F dt` at each deflection, as long as `v` is not small.
//! All runs of a group share one `λ = dm_s/dd`, constant between nodes, by least squares with smoothing. It
//! is not negative, and never so large that the crush force `F − λv²` would become tensile. Forces take it linear between the
//! middles of the nodes.

use serde::{Deserialize, Serialize};

use super::Envelope;
use crate::parallel;
use crate::piecewise;
use crate::signal::bounded;

/// Stopped mass of the runs of a group, over the deflection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct StoppedMass {
    /// Nodes in m, from 0.
    pub deflection_m: Vec<f64>,
    /// Stopped mass in kg at each node, never falling: that of the body against a wall; of a pair
    /// the reduced mass, so that of two equal ends half of one's. 0 where the runs do not agree on one.
    pub stopped_kg: Vec<f64>,
    /// Root mean square deviation of the runs' momentum from it, in kg.
    pub residual_kg: f64,
}

/// The loading branch of a run: contact force in N and closing speed in m/s over the same deflections.
pub(crate) struct LoadingRun {
    /// What moves along the deflections.
    pub mass_kg: f64,
    pub contact_n: Envelope,
    /// An envelope by its shape, not a force.
    pub closing_m_per_s: Envelope,
}

impl LoadingRun {
    fn end_m(&self) -> f64 {
        self.contact_n.end_m()
    }

    fn closing_at(&self, deflection_m: f64) -> f64 {
        self.closing_m_per_s.force_at(deflection_m).max(0.0)
    }
}

/// Segments of the stopped mass; they are shorter at the tip, where most happens.
const SEGMENTS: usize = 64;
const SHORTER_AT_TIP: f64 = 1.5;
/// Momentum determines the mass while the body has at least this share of its initial speed.
const FAST: f64 = 0.25;
/// Largest part of the mass that a crush zone may stop: beyond it the runs are inconsistent.
const MOST_STOPPED: f64 = 0.5;
/// Crush zones with their equipment are up to about a tenth of a vehicle.
const USUAL_SHARE: f64 = 0.15;
/// The runs' momentum must agree on the stopped mass within this share of it; otherwise it is unknown.
const AGREES: f64 = 0.5;
/// Points of a segment at which a run's force and speed are averaged.
const MEAN_POINTS: usize = 9;

impl StoppedMass {
    /// Fits it to the runs of a group. `None` if there are fewer than two runs, or more than half of the lightest mass would be
    /// stopped.
    pub(crate) fn fit(runs: &[LoadingRun]) -> Option<Self> {
        if runs.len() < 2 {
            return None;
        }
        let end_m = runs.iter().map(LoadingRun::end_m).fold(0.0, f64::max);
        let node = |i: usize| end_m * libm::pow(i as f64 / SEGMENTS as f64, SHORTER_AT_TIP);
        let deflection_m: Vec<f64> = (0..=SEGMENTS).map(node).collect();
        let states = parallel::map(runs, stopped_by_momentum);
        let most_kg_per_m = most_kg_per_m(&deflection_m, runs);
        let rates = rates_kg_per_m(&deflection_m, &states, &most_kg_per_m);
        let mut stopped_kg = vec![0.0];
        for (i, rate) in rates.iter().enumerate() {
            let step_m = deflection_m[i + 1] - deflection_m[i];
            stopped_kg.push(stopped_kg[i] + rate * step_m);
        }
        let most = stopped_kg[SEGMENTS];
        let lightest_kg = runs.iter().map(|run| run.mass_kg).fold(f64::INFINITY, f64::min);
        if !(most.is_finite() && most < MOST_STOPPED * lightest_kg) {
            return None;
        }
        let mut found = Self { deflection_m, stopped_kg, residual_kg: 0.0 };
        let square = |(d, m): &(f64, f64)| (found.at(*d) - m).powi(2);
        let of_run = |s: &Vec<(f64, f64)>| s.iter().map(square).sum::<f64>() / s.len() as f64;
        found.residual_kg = (states.iter().map(of_run).sum::<f64>() / states.len() as f64).sqrt();
        if !found.residual_kg.is_finite() {
            return None;
        }
        if found.residual_kg > AGREES * most {
            found.stopped_kg.fill(0.0);
        }
        Some(found)
    }

    /// The same nodes without any stopped mass.
    pub(crate) fn without_any(&self) -> Self {
        Self { stopped_kg: vec![0.0; self.stopped_kg.len()], ..self.clone() }
    }

    /// Whether the runs agree on one.
    pub(crate) fn is_known(&self) -> bool {
        self.stopped_kg.iter().any(|&m| m > 0.0)
    }

    /// The deflection in m over which mass is stopped, and how much in kg.
    pub(crate) fn in_all(&self) -> (f64, f64) {
        let all_kg = self.stopped_kg[self.stopped_kg.len() - 1];
        let i = self.stopped_kg.iter().position(|&m| m >= all_kg).unwrap_or(0);
        (self.deflection_m[i], all_kg)
    }

    /// Whether crush zones with their equipment hold so much of the moving mass. More of it stands for what else lies
    /// between contact force and body, such as an engine, or parts that turn or vibrate.
    pub(crate) fn is_usual(&self, moved_kg: f64) -> bool {
        self.in_all().1 <= USUAL_SHARE * moved_kg
    }

    pub(crate) fn at(&self, deflection_m: f64) -> f64 {
        let (d, m) = (&self.deflection_m, &self.stopped_kg);
        if deflection_m < d[d.len() - 1] {
            piecewise::by_share(d, m, piecewise::segment(d, deflection_m), deflection_m)
        } else {
            m[m.len() - 1]
        }
    }

    /// `λ`, stopped mass per deflection, in kg/m; beyond the last node 0. Linear between the middles of the nodes, where [`at`](Self::at)
    /// has steps of its slope: a step of `λ` at an inner node would be one in every force that is made of it.
    pub(crate) fn rate_kg_per_m(&self, deflection_m: f64) -> f64 {
        let nodes = &self.deflection_m;
        let last = nodes.len() - 2;
        if deflection_m >= nodes[last + 1] {
            return 0.0;
        }
        let rate =
            |i: usize| (self.stopped_kg[i + 1] - self.stopped_kg[i]) / (nodes[i + 1] - nodes[i]);
        let middle = |i: usize| 0.5 * (nodes[i] + nodes[i + 1]);
        let i = piecewise::segment(nodes, deflection_m);
        let (a, b) = if deflection_m < middle(i) {
            (i.saturating_sub(1), i)
        } else {
            (i, (i + 1).min(last))
        };
        if a == b {
            return rate(a);
        }
        piecewise::by_share(&[middle(a), middle(b)], &[rate(a), rate(b)], 0, deflection_m)
    }

    /// Where `λ` bends, in m.
    pub(crate) fn bends_m(&self) -> impl Iterator<Item = f64> {
        self.deflection_m.windows(2).map(|nodes| 0.5 * (nodes[0] + nodes[1]))
    }

    /// Whether it is what a fit gives, which a file might not hold.
    pub(crate) fn is_sound(&self) -> bool {
        let Self { deflection_m: d, stopped_kg: m, residual_kg } = self;
        let rises = |values: &[f64]| values.windows(2).all(|w| w[0] <= w[1]);
        Envelope::new(d.clone(), m.clone()).is_ok()
            && m[0] == 0.0
            && rises(m)
            && residual_kg.is_finite()
    }
}

/// Deflection in m and stopped mass in kg along a curve, from its momentum.
fn stopped_by_momentum(run: &LoadingRun) -> Vec<(f64, f64)> {
    let LoadingRun { mass_kg, .. } = run;
    let first = run.closing_at(0.0);
    let (mut impulse, mut before) = (0.0, (0.0, run.contact_n.force_at(0.0) / first));
    let mut states = Vec::new();
    for &d in &run.contact_n.deflection_m()[1..] {
        let u = run.closing_at(d);
        if u.is_nan() || u <= FAST * first {
            break;
        }
        // dt = dd/u.
        let now = (d, run.contact_n.force_at(d) / u);
        impulse += 0.5 * (before.1 + now.1) * (d - before.0);
        states.push((d, mass_kg - (mass_kg * first - impulse) / u));
        before = now;
    }
    states
}

/// `λ` in kg/m between the nodes, from 0 to `most`: least squares over all states, every run with the
/// same weight, with its second differences kept small against the residuals.
fn rates_kg_per_m(nodes_m: &[f64], states: &[Vec<(f64, f64)>], most: &[f64]) -> Vec<f64> {
    let n = nodes_m.len() - 1;
    let (mut a, mut b) = (vec![vec![0.0; n]; n], vec![0.0; n]);
    let length_m = |i: usize| nodes_m[i + 1] - nodes_m[i];
    for states in states.iter().filter(|s| !s.is_empty()) {
        let weight = 1.0 / states.len() as f64;
        // Of the states inside each segment: number, stopped masses, ways into it, and their products.
        let mut inside = vec![[0.0; 5]; n];
        for &(d, stopped_kg) in states {
            let i = nodes_m[1..n].partition_point(|node| *node < d);
            let way_m = d - nodes_m[i];
            let sums = [1.0, stopped_kg, way_m, way_m * way_m, way_m * stopped_kg];
            inside[i].iter_mut().zip(sums).for_each(|(sum, x)| *sum += weight * x);
        }
        // A state has the whole length of each segment after it, and its way into its own.
        let (mut beyond, mut beyond_kg) = (0.0, 0.0);
        for i in (0..n).rev() {
            let [number, kg, ways_m, squares_m2, products] = inside[i];
            let l = length_m(i);
            b[i] += l * beyond_kg + products;
            a[i][i] += l * l * beyond + squares_m2;
            (0..i).for_each(|k| {
                let both = length_m(k) * (l * beyond + ways_m);
                a[i][k] += both;
                a[k][i] += both;
            });
            beyond += number;
            beyond_kg += kg;
        }
    }
    let smoothing = states.len() as f64 / n as f64;
    let middle = |i: usize| 0.5 * (nodes_m[i] + nodes_m[i + 1]);
    for i in 1..n - 1 {
        // By how far the middle of three leaves the line through the others, times its length.
        let share = (middle(i) - middle(i - 1)) / (middle(i + 1) - middle(i - 1));
        let row = [(i - 1, 1.0 - share), (i, -1.0), (i + 1, share)];
        let weight = smoothing * (2.0 * length_m(i)).powi(2);
        for (r, p) in row {
            for (c, q) in row {
                a[r][c] += weight * p * q;
            }
        }
    }
    // Segments that no state reaches have nothing to go by: not even rounding may decide.
    let trace: f64 = (0..n).map(|i| a[i][i]).sum();
    (0..n).for_each(|i| a[i][i] += 1e-12 * trace);
    bounded(&a, &b, most)
}

/// The most that `λ` in kg/m can be between the nodes: a crush force never pulls, so no run's mean of
/// `λ u²` over a segment exceeds that of its contact force.
fn most_kg_per_m(nodes_m: &[f64], runs: &[LoadingRun]) -> Vec<f64> {
    let of_run = |segment: &[f64], run: &LoadingRun| {
        let (from, to) = (segment[0], segment[1].min(run.end_m()));
        let at = |k: usize| from + (to - from) * k as f64 / (MEAN_POINTS - 1) as f64;
        let mean = |of: &dyn Fn(f64) -> f64| {
            (0..MEAN_POINTS).map(|k| of(at(k))).sum::<f64>() / MEAN_POINTS as f64
        };
        let is_fast = mean(&|d| run.closing_at(d)) > FAST * run.closing_at(0.0);
        let most = mean(&|d| run.contact_n.force_at(d)) / mean(&|d| run.closing_at(d).powi(2));
        (from < to && is_fast).then_some(most.max(0.0))
    };
    let of_segment = |segment: &[f64]| {
        runs.iter().filter_map(|run| of_run(segment, run)).fold(f64::INFINITY, f64::min)
    };
    nodes_m.windows(2).map(of_segment).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 20 t that 1 MN stops from 5 m/s, without any mass stopped before the body.
    fn run() -> LoadingRun {
        let d: Vec<f64> = (0..=100).map(|i| 0.25 * f64::from(i) / 100.0).collect();
        let closing = d.iter().map(|d| (25.0 - 100.0 * d).max(0.0).sqrt()).collect();
        let contact_n = Envelope::new(d.clone(), vec![1e6; d.len()]).unwrap();
        LoadingRun { mass_kg: 20e3, contact_n, closing_m_per_s: Envelope::new(d, closing).unwrap() }
    }

    #[test]
    fn one_run_tells_none() {
        assert_eq!(StoppedMass::fit(&[run()]), None);
        let found = StoppedMass::fit(&[run(), run()]).unwrap();
        assert!(found.is_sound() && found.stopped_kg.len() == SEGMENTS + 1);
        // Half of the speed is left there; nearer to the stop small errors of the speed weigh more.
        assert!(found.at(0.19) < 1.0, "{found:?}");
    }

    #[test]
    fn a_mass_that_falls_is_not_sound() {
        let made = |stopped_kg: [f64; 3]| StoppedMass {
            deflection_m: vec![0.0, 0.1, 0.2],
            stopped_kg: stopped_kg.to_vec(),
            residual_kg: 1.0,
        };
        let sound = made([0.0, 100.0, 200.0]);
        assert!(sound.is_sound() && sound.is_known());
        assert_eq!((sound.at(0.05), sound.at(3.0)), (50.0, 200.0));
        assert_eq!((sound.rate_kg_per_m(0.15), sound.rate_kg_per_m(3.0)), (1000.0, 0.0));
        assert_eq!(sound.in_all(), (0.2, 200.0));
        // Between the middles of the nodes it is linear.
        let rate = |d: f64| made([0.0, 100.0, 300.0]).rate_kg_per_m(d).round();
        assert_eq!(
            [0.0, 0.05, 0.1, 0.125, 0.15, 0.19].map(rate),
            [1e3, 1e3, 1.5e3, 1.75e3, 2e3, 2e3]
        );
        assert!(!made([0.0, 200.0, 100.0]).is_sound() && !made([1.0, 2.0, 3.0]).is_sound());
        assert!(!sound.without_any().is_known());
    }
}
