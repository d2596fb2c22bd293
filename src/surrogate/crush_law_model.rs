//! `crush-law`: contact force and body force from one law of stopped mass, rate and impact speed.
//!
//! The other models fit the two forces separately. Here both follow from [`CrushLaw`]: the contact force is
//! `F_f + λu²`, the body moves as one mass under `F_f M/(M − m_s)`.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use super::crush_law::{CrushLaw, per_crush_force};
use super::curves::mean_over;
use super::models::{ModelEntry, loaded};
use super::{CaseCurve, QueryPoint, Surrogate};
use crate::curve::ForceKind;
use crate::dataset::{TrainingCase, TrainingSet};

pub(super) const ENTRY: ModelEntry = ModelEntry {
    name: "crush-law",
    about: "Contact and body force from one law of stopped mass and rate",
    // One law instead of two fits: before `rate`.
    complexity: 1,
    sees_features: false,
    follows_closing: true,
    needs_crush_law: true,
    least_curves: 2,
    forest: None,
    fit: |input| {
        let law = input.crush_law()?;
        let interval_s = interval_s(input.set);
        Ok(Arc::new(OfCrushLaw { law, force: input.force, interval_s }))
    },
    load: loaded::<OfCrushLaw>,
};

/// One of the two forces of a crush law.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct OfCrushLaw {
    force: ForceKind,
    /// Mean interval of the runs' states in s. What a slow run has within it, over a short way, is nothing
    /// that a faster one could show.
    interval_s: f64,
    law: CrushLaw,
}

fn interval_s(set: &TrainingSet) -> f64 {
    let of = |case: &Arc<TrainingCase>| {
        let time_s = case.case.curves.sampled.time_s();
        (time_s[time_s.len() - 1] - time_s[0]) / (time_s.len() - 1) as f64
    };
    set.cases.iter().map(of).sum::<f64>() / set.cases.len() as f64
}

impl OfCrushLaw {
    /// Force on a single-mass body for each newton of crush force.
    fn per_crush_force(&self, deflection_m: f64, mass_kg: f64) -> f64 {
        per_crush_force(self.law.stopped.at(deflection_m), mass_kg)
    }

    /// Closing speeds in m/s at increasing deflections, of a body that the law itself slows down from the
    /// speed of the query: trapezoids, each end's force once corrected by the speed that it leads to.
    /// `per_crush` is that of a single-mass body at each deflection.
    fn closing_m_per_s(
        &self,
        standing_n: &[f64],
        per_crush: &[f64],
        at: &QueryPoint<'_>,
        along_m: &[f64],
    ) -> Vec<f64> {
        let mut squared = at.speed_m_per_s * at.speed_m_per_s;
        let force_n = |i: usize, squared: f64| {
            let force = standing_n[i] * self.law.factor(squared.max(0.0).sqrt());
            force * per_crush[i]
        };
        let mut closing = Vec::with_capacity(along_m.len());
        for i in 0..along_m.len() {
            if i > 0 {
                let before_n = force_n(i - 1, squared);
                let step_m = along_m[i] - along_m[i - 1];
                let rest = |after_n: f64| squared - (before_n + after_n) * step_m / at.mass_kg;
                let first = rest(force_n(i, rest(before_n)));
                squared = rest(force_n(i, first));
            }
            closing.push(squared.max(0.0).sqrt());
        }
        closing
    }
}

impl Surrogate for OfCrushLaw {
    fn force_n(&self, cases: &[CaseCurve], at: &QueryPoint<'_>, deflection_m: &[f64]) -> Vec<f64> {
        if cases.is_empty() {
            return vec![f64::NAN; deflection_m.len()];
        }
        let standing_n = self.law.standing_n(cases, (at.speed_m_per_s, at.features), deflection_m);
        let per_crush = || -> Vec<f64> {
            deflection_m.iter().map(|&d| self.per_crush_force(d, at.mass_kg)).collect()
        };
        let own;
        let mut per = Vec::new();
        let closing = match at.closing_m_per_s {
            Some(closing) => closing,
            None => {
                per = per_crush();
                own = self.closing_m_per_s(&standing_n, &per, at, deflection_m);
                &own
            }
        };
        let crush_n: Vec<f64> =
            standing_n.iter().zip(closing).map(|(q, &u)| q * self.law.factor(u)).collect();
        // A contact's spikes are as short as that. What the runs' states do not resolve of the force on the
        // body would only make it jagged. A crush law that drives a train has it, as the contact has.
        let crush_n = match self.force {
            ForceKind::Contact => crush_n,
            ForceKind::Body => {
                mean_over(deflection_m, &crush_n, |i| 0.5 * self.interval_s * closing[i])
            }
        };
        match self.force {
            ForceKind::Contact => {
                let force = |((&d, crush_n), &u): ((&f64, &f64), &f64)| {
                    crush_n + self.law.stopped.rate_kg_per_m(d) * u * u
                };
                deflection_m.iter().zip(&crush_n).zip(closing).map(force).collect()
            }
            ForceKind::Body => {
                let per = if per.is_empty() { per_crush() } else { per };
                crush_n.iter().zip(per).map(|(crush_n, per)| crush_n * per).collect()
            }
        }
    }

    fn parameters(&self) -> Option<Result<Box<RawValue>, serde_json::Error>> {
        Some(serde_json::value::to_raw_value(self))
    }

    fn check(&self, _: usize) -> Result<(), String> {
        if !(self.interval_s.is_finite() && self.interval_s >= 0.0) {
            return Err(format!("the interval of its runs' states is {} s", self.interval_s));
        }
        self.law.check()
    }

    fn crush_law(&self) -> Option<&CrushLaw> {
        Some(&self.law)
    }
}

#[cfg(test)]
mod tests {
    use super::super::crush_law::made::{MASS_KG, law, made, motion};
    use super::*;

    fn model(force: ForceKind, cases: &[CaseCurve]) -> OfCrushLaw {
        OfCrushLaw { force, interval_s: 0.0, law: law(cases, MASS_KG) }
    }

    /// Runs of the law itself: a speed between them comes out in both forces and in the motion.
    #[test]
    fn a_law_of_this_form_is_found_again_between_its_runs() {
        let cases = [5.0, 8.0, 12.0].map(made);
        let asked = motion(6.5);
        let end_m = asked.deflection_m[asked.deflection_m.len() - 1];
        let along: Vec<f64> = (1..=200).map(|i| 0.98 * end_m * f64::from(i) / 200.0).collect();
        let at = QueryPoint {
            speed_m_per_s: 6.5,
            features: &[],
            mass_kg: MASS_KG,
            closing_m_per_s: None,
        };
        for (force, truth) in
            [(ForceKind::Contact, &asked.contact_n), (ForceKind::Body, &asked.body_n)]
        {
            let found = model(force, &cases).force_n(&cases, &at, &along);
            let truth = crate::curve::Envelope::new(asked.deflection_m.clone(), truth.clone());
            let truth = truth.unwrap();
            let error = |(f, &d): (&f64, &f64)| (f - truth.force_at(d)).abs();
            let all: f64 = found.iter().zip(&along).map(error).sum();
            let level: f64 = along.iter().map(|&d| truth.force_at(d)).sum();
            assert!(all / level < 0.02, "{force:?}: {}", all / level);
        }
    }

    /// The two forces are one law: of the same motion they differ by what is stopped.
    #[test]
    fn contact_and_body_force_differ_by_the_stopped_mass() {
        let cases = [5.0, 8.0, 12.0].map(made);
        let (contact, body) = (model(ForceKind::Contact, &cases), model(ForceKind::Body, &cases));
        let (d, u) = ([0.05, 0.2], [7.0, 5.0]);
        let at = QueryPoint {
            speed_m_per_s: 8.0,
            features: &[],
            mass_kg: MASS_KG,
            closing_m_per_s: Some(&u),
        };
        let (contact_n, body_n) = (contact.force_n(&cases, &at, &d), body.force_n(&cases, &at, &d));
        for i in 0..2 {
            let stopped = contact.law.stopped.at(d[i]);
            let crush_n = body_n[i] * (MASS_KG - stopped) / MASS_KG;
            let of_stopping = contact.law.stopped.rate_kg_per_m(d[i]) * u[i] * u[i];
            assert!((contact_n[i] - crush_n - of_stopping).abs() < 1e-6 * contact_n[i]);
        }
        assert!(contact_n[0] > 1.05 * body_n[0], "at 50 mm mass is being stopped");
    }
}
