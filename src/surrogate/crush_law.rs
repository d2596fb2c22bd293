//! Crush law: one law behind the contact force and the body force of a group.
//!
//! A crush zone comes to rest from its tip on. With `m_s(d)` the stopped mass,
//! `λ = dm_s/dd` and `u` the speed of the body relative to the stopped mass,
//! - the crush force `F_f = Q(d; v) (1 + β√u)` acts between crush zone and body,
//! - the contact force is `F_c = F_f + λ u²`, with the momentum of the mass being stopped,
//! - the body moves by `(M − m_s) dv/dt = −F_f`.
//!
//! The stopped mass is that of [`StoppedMass`]. Of the β that makes the `Q` of neighbouring speeds most
//! alike where they overlap, half is taken, as in the model `rate`. The remaining differences in level are attributed
//! to the impact speed, as `1 + γ√v`; divided by it, the `Q` of the runs are blended (`blend.rs`).
//!
//! The same equations hold in the closing coordinates of two equal bodies, with the reduced mass.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::CaseCurve;
use super::cached::Cached;
use super::rate::{self, Rate};
use crate::curve::{Envelope, StoppedMass};
use crate::dataset::grid;

/// Least share of the moved mass that is never stopped: lighter vehicles than those of the runs have
/// no crush zones as heavy.
const LEAST_FREE: f64 = 0.5;

/// Force on a single-mass body for each newton of crush force: `M / (M − m_s)`.
pub(crate) fn per_crush_force(stopped_kg: f64, mass_kg: f64) -> f64 {
    mass_kg / (mass_kg - stopped_kg).max(LEAST_FREE * mass_kg)
}

/// Stopped mass and crush force of the runs of a group.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct CrushLaw {
    /// β in (s/m)^½, over the closing speed of the model's kind.
    #[serde(rename = "sensitivity_sqrt_s_per_m")]
    pub sensitivity: f64,
    /// γ in (s/m)^½, over the impact speed.
    #[serde(rename = "impact_sensitivity_sqrt_s_per_m", default)]
    pub of_impact: f64,
    /// The stopped mass, with the deviation of the runs' momentum.
    #[serde(flatten)]
    pub stopped: StoppedMass,
    /// One for all copies and for the laws of one model.
    #[serde(skip)]
    forces: Cached<Arc<Cached<CrushForces>>>,
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

/// Minimum number of points of a law at one speed.
const POINTS: usize = 400;

impl CrushLaw {
    /// The law of a group of this stopped mass, whose contact curves know their closing speeds.
    pub(crate) fn of(stopped: StoppedMass, contact: &[CaseCurve]) -> Self {
        let (sensitivity, of_impact) = (0.0, 0.0);
        let law = Self { sensitivity, of_impact, stopped, forces: Cached::default() };
        law.with_rate_of(contact)
    }

    /// The same with the β and γ of its crush forces.
    fn with_rate_of(self, contact: &[CaseCurve]) -> Self {
        let forces = self.crush_forces(contact);
        let (sensitivity, of_impact) = Rate::of_speed_and_impact(&forces);
        let law = Self { sensitivity, of_impact, forces: Cached::default(), ..self };
        law.shared();
        law
    }

    fn shared(&self) -> &Arc<Cached<CrushForces>> {
        self.forces.get_or_compute(Arc::default)
    }

    /// Lets an equal law, which has not answered yet, use the crush forces of this one.
    pub(super) fn share(&self, equal: &Self) {
        if equal == self {
            equal.forces.get_or_compute(|| self.shared().clone());
        }
    }

    /// The law that takes the contact force for the crush force, with its own β.
    pub(super) fn without_stopped_mass(&self, contact: &[CaseCurve]) -> Self {
        Self::of(self.stopped.without_any(), contact)
    }

    /// Invariants of a fit that a file might break.
    pub(super) fn check(&self) -> Result<(), String> {
        Rate::of(self.sensitivity, None).check_sensitivity()?;
        Rate::of(self.of_impact, None).check_sensitivity()?;
        if self.stopped.is_sound() {
            Ok(())
        } else {
            Err("the stopped mass of its crush law is impossible".into())
        }
    }

    /// The factor `1 + β√u` of a closing speed.
    pub(super) fn factor(&self, closing_m_per_s: f64) -> f64 {
        rate::factor(self.sensitivity, closing_m_per_s)
    }

    fn rate(&self) -> Rate {
        Rate::of(self.sensitivity, Some(self.of_impact))
    }

    /// The crush forces `F_c − λu²` of the contact curves, over their deflections.
    fn crush_forces(&self, contact: &[CaseCurve]) -> Vec<CaseCurve> {
        let of = |curve: &CaseCurve| {
            // Between two points the force is a line, and λ must not bend.
            curve.with_points(self.stopped.bends_m()).map_forces(|d, force_n| {
                let u = curve.closing_at(d);
                (force_n - self.stopped.rate_kg_per_m(d) * u * u).max(0.0)
            })
        };
        contact.iter().map(of).collect()
    }

    /// `Q` in N at an impact speed of the model's kind, along deflections; beyond the training speeds that
    /// of the outermost, at the level of the impact speed. `contact` are the curves that it was fitted to.
    pub(super) fn standing_n(
        &self,
        contact: &[CaseCurve],
        at: (f64, &[f64]),
        deflection_m: &[f64],
    ) -> Vec<f64> {
        let of = || contact.iter().map(|c| [c.speed_m_per_s, c.end_m()]);
        let kept = self.shared().get_or_compute(|| CrushForces {
            of: of().collect(),
            curves: self.crush_forces(contact),
            rate: self.rate(),
        });
        if kept.of.iter().copied().eq(of()) {
            kept.rate.standing_n(&kept.curves, at, deflection_m)
        } else {
            let curves = self.crush_forces(contact);
            self.rate().standing_n(&curves, at, deflection_m)
        }
    }

    /// The law at an impact speed, as [`standing_n`](Self::standing_n) takes it.
    pub(crate) fn at(&self, contact: &[CaseCurve], speed_m_per_s: f64) -> Option<CrushCurve> {
        let end_m = contact.iter().map(CaseCurve::end_m).fold(0.0, f64::max);
        let deflection_m = grid(end_m, POINTS);
        let mut standing_n = self.standing_n(contact, (speed_m_per_s, &[]), &deflection_m);
        // Nothing is crushed before the contact.
        standing_n[0] = 0.0;
        Some(CrushCurve {
            standing_n: Envelope::new(deflection_m, standing_n).ok()?.pushing(),
            stopped_kg: {
                let StoppedMass { deflection_m, stopped_kg, .. } = &self.stopped;
                Envelope::new(deflection_m.clone(), stopped_kg.clone()).ok()?
            },
        })
    }
}

/// Runs made by a crush law, for tests.
#[cfg(test)]
pub(super) mod made {
    use super::*;
    use crate::curve::stopped_mass::LoadingRun;

    pub(crate) const MASS_KG: f64 = 20e3;

    /// A run's loading, by deflection.
    #[derive(Default)]
    pub(crate) struct Motion {
        pub deflection_m: Vec<f64>,
        pub contact_n: Vec<f64>,
        pub body_n: Vec<f64>,
        pub closing_m_per_s: Vec<f64>,
    }

    /// `Q` a wave, β = 0.06, and 300 kg stopped evenly in the first 100 mm.
    pub(crate) fn motion(speed_m_per_s: f64) -> Motion {
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

    pub(crate) fn made(speed_m_per_s: f64) -> CaseCurve {
        let Motion { deflection_m, contact_n, closing_m_per_s, .. } = motion(speed_m_per_s);
        CaseCurve::new(speed_m_per_s, vec![], deflection_m, contact_n, closing_m_per_s).unwrap()
    }

    /// The law of made runs.
    pub(crate) fn law(cases: &[CaseCurve], mass_kg: f64) -> CrushLaw {
        let run = |case: &CaseCurve| {
            let contact_n = case.envelope().clone();
            let d = contact_n.deflection_m().to_vec();
            let closing = d.iter().map(|&d| case.closing_at(d)).collect();
            LoadingRun { mass_kg, contact_n, closing_m_per_s: Envelope::new(d, closing).unwrap() }
        };
        let runs: Vec<LoadingRun> = cases.iter().map(run).collect();
        CrushLaw::of(StoppedMass::fit(&runs).unwrap(), cases)
    }
}

#[cfg(test)]
mod tests {
    use super::made::{law, made};
    use super::*;

    #[test]
    fn stopped_mass_and_rate_are_found_again() {
        let cases = [3.0, 5.0, 8.0, 12.0].map(made);
        let law = law(&cases, 20e3);
        let (_, end) = law.stopped.in_all();
        assert!((end / 300.0 - 1.0).abs() < 0.03, "{end} kg in all");
        let half = law.stopped.at(0.05);
        assert!((half / 150.0 - 1.0).abs() < 0.05, "{half} kg at 50 mm");
        // Half of β; γ has the rest.
        assert!((law.sensitivity - 0.03).abs() <= 0.003, "{}", law.sensitivity);
        assert!((0.01..0.06).contains(&law.of_impact), "{}", law.of_impact);
        assert!(law.stopped.residual_kg < 10.0, "{} kg", law.stopped.residual_kg);
        // The crush force of a run between them, at its own speeds.
        let (at, run) = (law.at(&cases, 6.5).unwrap(), made(6.5));
        for d in [0.12_f64, 0.15, 0.18, 0.21] {
            let (u, truth) = (run.closing_at(d), run.force_at(d));
            let found = at.standing_n.force_at(d) * law.factor(u);
            assert!((found / truth - 1.0).abs() < 0.02, "{found} N instead of {truth} N at {d} m");
        }
    }

    /// The run between the others ended early, as one that was cut: the slower one still comes out to its own end.
    #[test]
    fn a_run_comes_out_as_it_is_though_a_faster_one_ended_before() {
        let cut = |speed: f64, end_m: f64| {
            let made::Motion { deflection_m, contact_n, closing_m_per_s, .. } = made::motion(speed);
            let n = deflection_m.partition_point(|d| *d <= end_m);
            let first = |values: Vec<f64>| values[..n].to_vec();
            let (d, f, u) = (first(deflection_m), first(contact_n), first(closing_m_per_s));
            CaseCurve::new(speed, vec![], d, f, u).unwrap()
        };
        let cases = [cut(5.0, 1.0), cut(8.0, 0.08), cut(12.0, 1.0)];
        assert!(cases[1].end_m() < 0.8 * cases[0].end_m(), "{} m", cases[0].end_m());
        let law = law(&cases, 20e3);
        for case in [&cases[0], &cases[2]] {
            for share in [0.3, 0.6, 0.7, 0.8, 0.9, 0.99] {
                let d = share * case.end_m();
                let u = case.closing_at(d);
                let found =
                    law.standing_n(&cases, (case.speed_m_per_s, &[]), &[d])[0] * law.factor(u);
                let expected = case.force_at(d) - law.stopped.rate_kg_per_m(d) * u * u;
                // Between the points of a curve λu² is not on a line.
                assert!((found / expected - 1.0).abs() < 1e-7, "{found} N, {expected} N at {d} m");
            }
        }
    }

    /// Between its points a run comes out, too: λ bends there, and what it adds must be what was taken.
    #[test]
    fn a_run_comes_out_between_its_points() {
        let thinned = |speed: f64| {
            let made::Motion { deflection_m, contact_n, closing_m_per_s, .. } = made::motion(speed);
            let thin = |values: Vec<f64>| values.into_iter().step_by(40).collect::<Vec<f64>>();
            let (d, f, u) = (thin(deflection_m), thin(contact_n), thin(closing_m_per_s));
            CaseCurve::new(speed, vec![], d, f, u).unwrap()
        };
        let cases = [5.0, 8.0].map(thinned);
        let stopped = StoppedMass {
            deflection_m: vec![0.0, 0.011, 0.023, 0.05, 0.1],
            stopped_kg: vec![0.0, 150.0, 160.0, 250.0, 300.0],
            residual_kg: 1.0,
        };
        let law = CrushLaw::of(stopped, &cases);
        for case in &cases {
            // Beyond the last node nothing more is stopped, at once.
            for i in
                (1..1000).filter(|i| (case.end_m() * f64::from(*i) / 1000.0 - 0.1).abs() > 0.002)
            {
                let d = case.end_m() * f64::from(i) / 1000.0;
                let u = case.closing_at(d);
                let crush_n =
                    law.standing_n(&cases, (case.speed_m_per_s, &[]), &[d])[0] * law.factor(u);
                let found = crush_n + law.stopped.rate_kg_per_m(d) * u * u;
                let off = found / case.force_at(d) - 1.0;
                assert!(off.abs() < 3e-4, "{off} at {d} m, {} m/s", case.speed_m_per_s);
            }
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
        let law = law(&[5.0, 8.0].map(plain), 20e3);
        assert!(law.stopped.in_all().1 < 5.0, "{:?}", law.stopped);
        assert!(law.sensitivity < 0.01, "{}", law.sensitivity);
    }
}
