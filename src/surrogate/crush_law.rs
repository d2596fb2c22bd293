//! Crush law: one law behind the contact force and the body force of a group.
//!
//! A crush zone is stopped from its tip on. With `m_s(d)` the mass that has been stopped,
//! `λ = dm_s/dd` and `u` the speed of the body against what has been stopped,
//! - the crush force `F_f = Q(d; v) (1 + β√u)` acts between crush zone and body,
//! - the contact feels `F_c = F_f + λ u²`, by the momentum of what is being stopped,
//! - the body moves by `(M − m_s) dv/dt = −F_f`.
//!
//! Identified from contact force and body speed alone: momentum tells `m_s = M − (M v₀ − J)/v`
//! with the impulse `J = ∫F_c dt` at each deflection, as long as `v` is not small. All runs of a
//! group share one `λ`, constant between nodes, by least squares with smoothing. It is not negative,
//! and nowhere so large that `F_f = F_c − λ u²` would pull. Of the β that makes the `Q` of
//! neighbouring speeds most alike where they overlap, half is taken, as by the model `rate`. What this
//! leaves of their levels is put down to the impact speed, as `1 + γ√v`: between two runs the blend
//! has it, and beyond the end of the slower one γ carries it on.
//!
//! The same equations hold in the closing coordinates of two equal bodies, with the reduced mass.

use serde::{Deserialize, Serialize};

use super::CaseCurve;
use super::cached::Cached;
use super::rate::{self, Rate};
use crate::curve::Envelope;
use crate::dataset::grid;
use crate::piecewise;
use crate::signal::bounded;

/// Least share of the moved mass that is never stopped: lighter vehicles than those of the runs have
/// no crush zones as heavy.
const LEAST_FREE: f64 = 0.5;

/// What a body of one mass feels for each newton of crush force: `M / (M − m_s)`.
pub(crate) fn per_crush_force(stopped_kg: f64, mass_kg: f64) -> f64 {
    mass_kg / (mass_kg - stopped_kg).max(LEAST_FREE * mass_kg)
}

/// What a group's runs say of the mass that is stopped, and of the force behind it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CrushLaw {
    /// β in (s/m)^½, over the closing speed of the model's kind.
    #[serde(rename = "sensitivity_sqrt_s_per_m")]
    pub sensitivity: f64,
    /// γ in (s/m)^½, over the impact speed.
    #[serde(rename = "impact_sensitivity_sqrt_s_per_m", default)]
    pub of_impact: f64,
    /// Nodes of the stopped mass, in m, from 0.
    pub deflection_m: Vec<f64>,
    /// Stopped mass in kg at each node, never falling: that of the body against a wall; of a pair
    /// the reduced mass, so that of two equal ends half of one's.
    pub stopped_kg: Vec<f64>,
    /// Root mean square of what the runs' momentum says beside it, in kg.
    pub residual_kg: f64,
    #[serde(skip)]
    forces: Cached<CrushForces>,
}

/// The curves of the crush force, and the speeds by which the curves they come from are known.
#[derive(Clone, Debug)]
struct CrushForces {
    of: Vec<[f64; 2]>,
    curves: Vec<CaseCurve>,
    rate: Rate,
}

/// The law at one impact speed, as functions of the deflection.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CrushCurve {
    /// `Q` in N, from (0, 0).
    pub standing_n: Envelope,
    /// Stopped mass in kg: an envelope by its shape, not a force.
    pub stopped_kg: Envelope,
}

/// Segments of the stopped mass; they are shorter at the tip, where most happens.
const SEGMENTS: usize = 64;
const SHORTER_AT_TIP: f64 = 1.5;
/// Momentum tells the mass while the body has at least this share of its first speed.
const FAST: f64 = 0.25;
/// Most of the mass that a crush zone may stop: beyond it the runs say something else.
const MOST_STOPPED: f64 = 0.5;
/// The runs' momentum must agree on the stopped mass within this share of it; else it tells none.
const AGREES: f64 = 0.5;
/// Points of a segment at which a run's force and speed are averaged.
const MEAN_POINTS: usize = 9;
/// Fewest points of a law at one speed.
const POINTS: usize = 400;

impl CrushLaw {
    /// Fits the law to the contact curves of a group; `mass_kg` moves along their deflections.
    /// `None` if a curve has no closing speeds, there are fewer than two curves, or they say that more
    /// than half of the mass is stopped.
    pub(crate) fn fit(contact: &[CaseCurve], mass_kg: f64) -> Option<Self> {
        if contact.len() < 2 || !contact.iter().all(CaseCurve::knows_closing) {
            return None;
        }
        let end_m = contact.iter().map(CaseCurve::end_m).fold(0.0, f64::max);
        let node = |i: usize| end_m * (i as f64 / SEGMENTS as f64).powf(SHORTER_AT_TIP);
        let deflection_m: Vec<f64> = (0..=SEGMENTS).map(node).collect();
        let states: Vec<Vec<(f64, f64)>> =
            contact.iter().map(|curve| stopped_by_momentum(curve, mass_kg)).collect();
        let most_kg_per_m = most_kg_per_m(&deflection_m, contact);
        let rates = rates_kg_per_m(&deflection_m, &states, &most_kg_per_m);
        let mut stopped_kg = vec![0.0];
        for (i, rate) in rates.iter().enumerate() {
            let step_m = deflection_m[i + 1] - deflection_m[i];
            stopped_kg.push(stopped_kg[i] + rate * step_m);
        }
        let most = stopped_kg[SEGMENTS];
        if !(most.is_finite() && most < MOST_STOPPED * mass_kg) {
            return None;
        }
        let stopped = Envelope::new(deflection_m.clone(), stopped_kg.clone()).ok()?;
        let square = |(d, m): &(f64, f64)| (stopped.force_at(*d) - m).powi(2);
        let of_case = |s: &Vec<(f64, f64)>| s.iter().map(square).sum::<f64>() / s.len() as f64;
        let residual_kg = (states.iter().map(of_case).sum::<f64>() / states.len() as f64).sqrt();
        if !residual_kg.is_finite() {
            return None;
        }
        if residual_kg > AGREES * most {
            stopped_kg.fill(0.0);
        }
        let law = Self {
            sensitivity: 0.0,
            of_impact: 0.0,
            deflection_m,
            stopped_kg,
            residual_kg,
            forces: Cached::default(),
        };
        Some(law.with_rate_of(contact))
    }

    /// The same with the β and γ of its crush forces.
    fn with_rate_of(self, contact: &[CaseCurve]) -> Self {
        let forces = self.crush_forces(contact);
        let (sensitivity, of_impact) = Rate::of_speed_and_impact(&forces);
        Self { sensitivity, of_impact, forces: Cached::default(), ..self }
    }

    /// Whether the runs agree on a stopped mass.
    pub fn tells_stopped_mass(&self) -> bool {
        self.stopped_kg.iter().any(|&m| m > 0.0)
    }

    /// The deflection in m over which mass is stopped, and how much in kg.
    pub fn in_all(&self) -> (f64, f64) {
        let all_kg = self.stopped_kg[self.stopped_kg.len() - 1];
        let i = self.stopped_kg.iter().position(|&m| m >= all_kg).unwrap_or(0);
        (self.deflection_m[i], all_kg)
    }

    /// The law that takes the contact force for the crush force, with its own β.
    pub(super) fn without_stopped_mass(&self, contact: &[CaseCurve]) -> Self {
        Self { stopped_kg: vec![0.0; self.stopped_kg.len()], ..self.clone() }.with_rate_of(contact)
    }

    /// What a fit guarantees and a file might not.
    ///
    /// # Errors
    /// What is wrong, to follow "the model is damaged: ".
    pub(super) fn check(&self) -> Result<(), String> {
        let Self { deflection_m: d, stopped_kg: m, residual_kg, .. } = self;
        Rate::of(self.sensitivity, None).check_sensitivity()?;
        Rate::of(self.of_impact, None).check_sensitivity()?;
        let rises = |values: &[f64]| values.windows(2).all(|w| w[0] <= w[1]);
        let is_sound = Envelope::new(d.clone(), m.clone()).is_ok()
            && m[0] == 0.0
            && rises(m)
            && residual_kg.is_finite();
        if is_sound { Ok(()) } else { Err("the stopped mass of its crush law is none".into()) }
    }

    /// Stopped mass in kg at a deflection in m.
    pub(super) fn stopped_at(&self, deflection_m: f64) -> f64 {
        let (d, m) = (&self.deflection_m, &self.stopped_kg);
        match deflection_m < d[d.len() - 1] {
            true => piecewise::by_share(d, m, piecewise::segment(d, deflection_m), deflection_m),
            false => m[m.len() - 1],
        }
    }

    /// The factor `1 + β√u` of a closing speed.
    pub(super) fn factor(&self, closing_m_per_s: f64) -> f64 {
        rate::factor(self.sensitivity, closing_m_per_s)
    }

    fn rate(&self) -> Rate {
        Rate::of(self.sensitivity, Some(self.of_impact))
    }

    /// Stopped mass per deflection, in kg/m.
    pub(super) fn rate_kg_per_m(&self, d: f64) -> f64 {
        let nodes = &self.deflection_m;
        if d >= nodes[nodes.len() - 1] {
            return 0.0;
        }
        let i = piecewise::segment(nodes, d);
        (self.stopped_kg[i + 1] - self.stopped_kg[i]) / (nodes[i + 1] - nodes[i])
    }

    /// The crush forces `F_c − λu²` of the contact curves, over their deflections.
    fn crush_forces(&self, contact: &[CaseCurve]) -> Vec<CaseCurve> {
        let of = |curve: &CaseCurve| {
            curve.map_forces(|d, force_n| {
                let u = curve.closing_at(d);
                (force_n - self.rate_kg_per_m(d) * u * u).max(0.0)
            })
        };
        contact.iter().map(of).collect()
    }

    /// `Q` in N at an impact speed of the model's kind, along deflections; beyond the training speeds that
    /// of the outermost. `contact` are the curves that it was fitted to.
    pub(super) fn standing_n(
        &self,
        contact: &[CaseCurve],
        speed_m_per_s: f64,
        deflection_m: &[f64],
    ) -> Vec<f64> {
        let of = || contact.iter().map(|c| [c.speed_m_per_s, c.end_m()]);
        let kept = self.forces.get_or_compute(|| CrushForces {
            of: of().collect(),
            curves: self.crush_forces(contact),
            rate: self.rate(),
        });
        match kept.of.iter().copied().eq(of()) {
            true => kept.rate.standing_n(&kept.curves, speed_m_per_s, deflection_m),
            false => {
                let curves = self.crush_forces(contact);
                self.rate().standing_n(&curves, speed_m_per_s, deflection_m)
            }
        }
    }

    /// The law at an impact speed, as [`standing_n`](Self::standing_n) takes it.
    pub(crate) fn at(&self, contact: &[CaseCurve], speed_m_per_s: f64) -> Option<CrushCurve> {
        let end_m = contact.iter().map(CaseCurve::end_m).fold(0.0, f64::max);
        let deflection_m = grid(end_m, POINTS);
        let mut standing_n = self.standing_n(contact, speed_m_per_s, &deflection_m);
        // Nothing is crushed before the contact.
        standing_n[0] = 0.0;
        Some(CrushCurve {
            standing_n: Envelope::new(deflection_m, standing_n).ok()?.pushing(),
            stopped_kg: Envelope::new(self.deflection_m.clone(), self.stopped_kg.clone()).ok()?,
        })
    }
}

/// Deflection in m and stopped mass in kg along a curve, from its momentum.
fn stopped_by_momentum(curve: &CaseCurve, mass_kg: f64) -> Vec<(f64, f64)> {
    let deflection_m = curve.envelope().deflection_m();
    let first = curve.closing_at(0.0);
    let (mut impulse, mut before) = (0.0, (0.0, curve.force_at(0.0) / first));
    let mut states = Vec::new();
    for &d in &deflection_m[1..] {
        let u = curve.closing_at(d);
        if u.is_nan() || u <= FAST * first {
            break;
        }
        // dt = dd/u.
        let now = (d, curve.force_at(d) / u);
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
        // A state has the whole length of each segment behind it, and its way into its own.
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
fn most_kg_per_m(nodes_m: &[f64], contact: &[CaseCurve]) -> Vec<f64> {
    let of_run = |segment: &[f64], curve: &CaseCurve| {
        let (from, to) = (segment[0], segment[1].min(curve.end_m()));
        let at = |k: usize| from + (to - from) * k as f64 / (MEAN_POINTS - 1) as f64;
        let mean = |of: &dyn Fn(f64) -> f64| {
            (0..MEAN_POINTS).map(|k| of(at(k))).sum::<f64>() / MEAN_POINTS as f64
        };
        let is_fast = mean(&|d| curve.closing_at(d)) > FAST * curve.closing_at(0.0);
        let most = mean(&|d| curve.force_at(d)) / mean(&|d| curve.closing_at(d).powi(2));
        (from < to && is_fast).then_some(most.max(0.0))
    };
    let of_segment = |segment: &[f64]| {
        contact.iter().filter_map(|curve| of_run(segment, curve)).fold(f64::INFINITY, f64::min)
    };
    nodes_m.windows(2).map(of_segment).collect()
}

/// Runs made by a crush law, for tests.
#[cfg(test)]
pub(super) mod made {
    use super::*;

    pub const MASS_KG: f64 = 20e3;

    /// A run's loading, by deflection.
    #[derive(Default)]
    pub struct Motion {
        pub deflection_m: Vec<f64>,
        pub contact_n: Vec<f64>,
        pub body_n: Vec<f64>,
        pub closing_m_per_s: Vec<f64>,
    }

    /// `Q` a wave, β = 0.06, and 300 kg stopped evenly in the first 100 mm.
    pub fn motion(speed_m_per_s: f64) -> Motion {
        let (beta, step) = (0.06, 5e-5);
        let (mut d, mut u, mut stopped) = (0.0_f64, speed_m_per_s, 0.0_f64);
        let mut motion = Motion::default();
        while u > 0.0 {
            let rate = if d < 0.1 { 3000.0 } else { 0.0 };
            let crush = (1.5e6 + 0.6e6 * (25.0 * d).sin()) * (1.0 + beta * u.sqrt());
            motion.deflection_m.push(d);
            motion.contact_n.push(crush + rate * u * u);
            motion.body_n.push(crush * MASS_KG / (MASS_KG - stopped));
            motion.closing_m_per_s.push(u);
            // (M − m_s) u du = −F dd
            let squared = u * u - 2.0 * crush / (MASS_KG - stopped) * step;
            u = squared.max(0.0).sqrt();
            stopped += rate * step;
            d += step;
        }
        motion
    }

    pub fn made(speed_m_per_s: f64) -> CaseCurve {
        let Motion { deflection_m, contact_n, closing_m_per_s, .. } = motion(speed_m_per_s);
        CaseCurve::new(speed_m_per_s, vec![], deflection_m, contact_n, closing_m_per_s).unwrap()
    }
}

#[cfg(test)]
mod tests {
    use super::made::made;
    use super::*;

    #[test]
    fn stopped_mass_and_rate_are_found_again() {
        let cases = [3.0, 5.0, 8.0, 12.0].map(made);
        let law = CrushLaw::fit(&cases, 20e3).unwrap();
        let end = law.stopped_kg[SEGMENTS];
        assert!((end / 300.0 - 1.0).abs() < 0.03, "{end} kg in all");
        let half = law.stopped_at(0.05);
        assert!((half / 150.0 - 1.0).abs() < 0.05, "{half} kg at 50 mm");
        // Half of β; γ has the rest.
        assert!((law.sensitivity - 0.03).abs() <= 0.003, "{}", law.sensitivity);
        assert!((0.01..0.06).contains(&law.of_impact), "{}", law.of_impact);
        assert!(law.residual_kg < 10.0, "{} kg", law.residual_kg);
        // The crush force of a run between them, at its own speeds.
        let (at, run) = (law.at(&cases, 6.5).unwrap(), made(6.5));
        for d in [0.12_f64, 0.15, 0.18, 0.21] {
            let (u, truth) = (run.closing_at(d), run.force_at(d));
            let found = at.standing_n.force_at(d) * law.factor(u);
            assert!((found / truth - 1.0).abs() < 0.02, "{found} N instead of {truth} N at {d} m");
        }
    }

    #[test]
    fn runs_without_stopped_mass_have_none() {
        let plain = |speed: f64| {
            let n = 400;
            let end = speed * speed / 150.0;
            let d: Vec<f64> = (0..=n).map(|i| end * f64::from(i) / f64::from(n)).collect();
            let u = d.iter().map(|d| (speed * speed - 150.0 * d).max(0.0).sqrt()).collect();
            CaseCurve::new(speed, vec![], d.clone(), vec![1.5e6; d.len()], u).unwrap()
        };
        let law = CrushLaw::fit(&[5.0, 8.0].map(plain), 20e3).unwrap();
        assert!(law.stopped_kg[SEGMENTS] < 5.0, "{:?}", law.stopped_kg);
        assert!(law.sensitivity < 0.01, "{}", law.sensitivity);
    }

    #[test]
    fn what_tells_no_law_gives_none() {
        let silent = CaseCurve::new(5.0, vec![], vec![0.0, 1.0], vec![1e6, 1e6], vec![]).unwrap();
        assert_eq!(CrushLaw::fit(&[silent.clone(), silent], 20e3), None, "no closing speeds");
        assert_eq!(CrushLaw::fit(&[made(5.0)], 20e3), None, "one curve");
    }
}
