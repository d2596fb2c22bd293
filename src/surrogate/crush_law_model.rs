//! `crush-law`: contact force and body force from one law of stopped mass, rate and impact speed.
//!
//! The other models fit the two forces separately. Here both follow from [`CrushLaw`]: the contact force is
//! `F_f + λu²`, the body moves as one mass under `F_f M/(M − m_s)`.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use super::crush_law::{CrushLaw, per_crush_force};
use super::entry::{ModelEntry, loaded};
use super::max_crush::MaxCrushRule;
use super::{CaseCurve, QueryPoint, Surrogate};
use crate::curve::{Envelope, ForceKind};
use crate::dataset::{TrainingCase, TrainingSet};

pub(super) const ENTRY: ModelEntry = ModelEntry {
    name: "crush-law",
    about: "Contact and body force from one law of stopped mass and rate",
    // One law instead of two fits: before `rate`.
    complexity: 1,
    baseline: false,
    sees_features: false,
    follows_closing: true,
    needs_crush_law: true,
    least_curves: 2,
    crush_rule: MaxCrushRule::Motion,
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
    let of = |case: &TrainingCase| {
        let time_s = case.case.curves.sampled.time_s();
        (time_s[time_s.len() - 1] - time_s[0]) / (time_s.len() - 1) as f64
    };
    set.cases.iter().map(of).sum::<f64>() / set.cases.len() as f64
}

/// Means of a force, given at increasing deflections, over the way that a body goes within `interval_s` at
/// its closing speed there: as fine as these deflections are. Before the contact the force is taken for the
/// opposite of that behind it, so that it still begins at 0; before the first deflection it is held.
fn over_interval(
    interval_s: f64,
    along_m: &[f64],
    force_n: &[f64],
    closing_m_per_s: &[f64],
) -> Vec<f64> {
    let (mut d, mut f) = (along_m.to_vec(), force_n.to_vec());
    if d.first().is_some_and(|d| *d > 0.0) {
        d.insert(0, 0.0);
        f.insert(0, force_n[0]);
    }
    // One point, or a force that is not a number, has no mean.
    let (Some(&end_m), Ok(force)) = (along_m.last(), Envelope::new(d, f)) else {
        return force_n.to_vec();
    };
    let mean_n = |((&d, &f), u): ((&f64, &f64), &f64)| {
        let half_m = (0.5 * interval_s * u).min(end_m - d);
        if half_m > LEAST_WAY_M {
            (force.work_to(d + half_m) - force.work_to((d - half_m).abs())) / (2.0 * half_m)
        } else {
            f
        }
    };
    along_m.iter().zip(force_n).zip(closing_m_per_s).map(mean_n).collect()
}

/// Over a shorter way a mean is the force itself, and the difference of works their rounding.
const LEAST_WAY_M: f64 = 1e-6;

impl OfCrushLaw {
    /// Force on a body of one mass for each newton of crush force.
    fn per_crush_force(&self, deflection_m: f64, mass_kg: f64) -> f64 {
        per_crush_force(self.law.stopped.at(deflection_m), mass_kg)
    }

    /// Closing speeds in m/s at increasing deflections, of a body that the law itself slows down from the
    /// speed of the query: trapezoids, each end's force once corrected by the speed that it leads to.
    fn closing_m_per_s(
        &self,
        standing_n: &[f64],
        at: &QueryPoint<'_>,
        along_m: &[f64],
    ) -> Vec<f64> {
        let mut squared = at.speed_m_per_s * at.speed_m_per_s;
        let force_n = |i: usize, squared: f64| {
            let force = standing_n[i] * self.law.factor(squared.max(0.0).sqrt());
            force * self.per_crush_force(along_m[i], at.mass_kg)
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
        let standing_n = self.law.standing_n(cases, at.speed_m_per_s, deflection_m);
        let own;
        let closing = match at.closing_m_per_s {
            Some(closing) => closing,
            None => {
                own = self.closing_m_per_s(&standing_n, at, deflection_m);
                &own
            }
        };
        let crush_n: Vec<f64> =
            standing_n.iter().zip(closing).map(|(q, &u)| q * self.law.factor(u)).collect();
        // A contact's spikes are as short as that. What the runs' states do not resolve of the force on the
        // body would only make it jagged. A crush law that drives a train has it, as the contact has.
        let crush_n = match self.force {
            ForceKind::Contact => crush_n,
            ForceKind::Body => over_interval(self.interval_s, deflection_m, &crush_n, closing),
        };
        let force = |((&d, &crush_n), &u): ((&f64, &f64), &f64)| match self.force {
            ForceKind::Contact => crush_n + self.law.stopped.rate_kg_per_m(d) * u * u,
            ForceKind::Body => crush_n * self.per_crush_force(d, at.mass_kg),
        };
        deflection_m.iter().zip(&crush_n).zip(closing).map(force).collect()
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

    fn answers_from_contact(&self) -> bool {
        true
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

    /// At 2 m/s and 10 ms the mean is over 10 mm to both sides.
    #[test]
    fn a_force_is_averaged_over_the_way_of_an_interval() {
        let along: Vec<f64> = (0..=100).map(|i| 0.001 * f64::from(i)).collect();
        let closing = vec![2.0; along.len()];
        let of = |force: &dyn Fn(f64) -> f64| {
            let force_n: Vec<f64> = along.iter().map(|&d| force(d)).collect();
            over_interval(0.01, &along, &force_n, &closing)
        };
        // A constant force rises over the first half and stays; a line stays one, up to the end.
        for (i, (found, d)) in of(&|_| 1e6).iter().zip(&along).enumerate() {
            let expected = if i < 10 { 1e6 * d / 0.01 } else { 1e6 };
            assert!((found - expected).abs() < 1.0, "{found} N at {d} m");
        }
        for (found, d) in of(&|d| 1e7 * d).iter().zip(&along) {
            assert!((found - 1e7 * d).abs() < 1.0, "{found} N at {d} m");
        }
        // A wave as long as the whole way is gone, away from both ends.
        let wave = of(&|d| 1e6 + 1e5 * (std::f64::consts::TAU * d / 0.02).sin());
        assert!(wave[20..=80].iter().all(|f| (f - 1e6).abs() < 100.0), "{wave:?}");
        // Not from 0 on: the same away from the start.
        let later = over_interval(0.01, &along[30..], &vec![1e6; 71], &closing[30..]);
        assert!(later.iter().all(|f| (f - 1e6).abs() < 1.0), "{later:?}");
        assert_eq!(over_interval(0.01, &[0.0], &[5.0], &[2.0]), [5.0]);
        assert_eq!(over_interval(0.0, &along, &vec![1e6; 101], &closing), vec![1e6; 101]);
    }
}
