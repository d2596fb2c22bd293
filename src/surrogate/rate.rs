//! `rate`: a force that depends on deflection and on the speed at that deflection.
//!
//! `F = Q(d; v) (1 + β√ḋ)`: the training curves are divided by the factor of their own decreasing speed, blended linearly
//! over speed, and multiplied by the factor of the motion of the query.
//!
//! Why β√ḋ: strain rate and the inertia of folds both raise the force, less than proportionally to speed. The root
//! lies between the power 1/4 of Cowper and Symonds and 1. Why half of the best-fit β: overlapping runs also
//! differ by how they fold and by the nose that is stopped at impact speed, and the curves cannot separate these causes.
//!
//! Tried in prototypes and dropped, because none was better on the bundled runs: a Gaussian process over {d, v} and over
//! {d, v, ḋ}; blending in √v, log v and v²; more than two neighbours; extending a slower curve further.

use std::sync::Arc;

use multiversion::multiversion;
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use super::alignment::Alignment;
use super::blend::{Blend, own_share};
use super::cached::Cached;
use super::curves::{Twins, answering_at, apart, neighbouring};
use super::models::{ModelEntry, loaded};
use super::{CaseCurve, QueryPoint, Surrogate};

pub(super) const ENTRY: ModelEntry = ModelEntry {
    name: "rate",
    about: "Linear in speed, with the force following the speed at each deflection",
    complexity: 2,
    sees_features: false,
    follows_closing: true,
    needs_crush_law: false,
    least_curves: 2,
    forest: None,
    fit: |input| Ok(Arc::new(Rate::fit(input.curves))),
    load: loaded::<Rate>,
};

/// `F = Q(d; v) R(ḋ)` with `R(u) = 1 + β √u`.
///
/// A run that hits slower passes the same deflection at a lower closing speed ḋ, and stands
/// there at its own maximum crush: a curve measured at a higher speed is too strong for it.
/// Each training curve is divided by R of its own decreasing speed, the quotients Q are
/// interpolated linearly in impact speed at equal deflection, and the query's own motion
/// `m ḋ dḋ/dd = −F` brings R back. So crush and energy come out together, other masses and
/// speeds that an interface sees inside a train need no other curve.
///
/// Beyond the end of a slower neighbour, its Q is that of the next faster curve times a ratio that
/// begins at their ratio there and decays to 1, so that the blend has no step. Where no faster curve goes further, a slower one
/// takes its place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Rate {
    /// β, in (s/m)^½.
    #[serde(rename = "sensitivity_sqrt_s_per_m")]
    sensitivity: f64,
    /// γ, in (s/m)^½: the Q of the runs go with `1 + γ√v` of their impact speeds, and what is left of them is
    /// blended; none in the model `rate`.
    #[serde(skip)]
    of_impact: Option<f64>,
    #[serde(skip)]
    prepared: Cached<Prepared>,
}

/// What a group's curves have in common, whatever is asked.
#[derive(Clone, Debug)]
struct Prepared {
    /// Speed, end and work of the curves.
    of: Vec<[f64; 3]>,
    /// `None` where no event moves.
    alignment: Option<Alignment>,
    /// Level of each curve, aligned where that is needed, at its end against the one along which it is carried on; 1 for the longest.
    levels: Vec<f64>,
    /// What the runs have of their own, for [`Blend`].
    own: f64,
    /// Along the deflections that were asked for first: each query follows the body's motion along the same.
    along: Cached<Along>,
}

/// What a blend needs of the curves along deflections, whatever the speed.
#[derive(Clone, Debug)]
struct Along {
    deflection_m: Vec<f64>,
    /// At each deflection the `Q` of each curve in N, carried on beyond its end, and the share of it that is left.
    curves: Vec<Vec<(f64, f64)>>,
}

/// Of the β that fits best, this is taken: two runs that overlap also differ by how they fold.
const SHARE: f64 = 0.5;
/// β is looked for from 0 to this: R doubles between standing and 4 m/s.
const MOST: f64 = 0.5;
const STEPS: usize = 100;
/// Points of an overlap at which two curves are compared.
const POINTS: usize = 200;
/// Points at which the values of all curves are compared.
const OWN_POINTS: usize = 100;
/// A level beyond these factors is not carried on.
const LEVELS: (f64, f64) = (0.5, 2.0);

/// How the level of a curve against the next faster one is carried on beyond its end.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LevelExtrapolation {
    /// The level is the mean over this last share of the curve.
    last: f64,
    /// Length over which it fades, as a share of the curve's end.
    fades: f64,
}

/// The level fades to that of the faster curve.
const ALONE: LevelExtrapolation = LevelExtrapolation { last: 0.15, fades: 0.1 };
/// The impact speed has the level; only the step at the end fades.
const WITH_IMPACT: LevelExtrapolation = LevelExtrapolation { last: 0.005, fades: 0.05 };

/// After so many lengths what is left is below rounding.
const LENGTHS: f64 = 37.0;

impl Rate {
    /// Fits β to the overlaps of neighbouring curves.
    ///
    /// The same deflection is passed at two speeds there, so β can be seen; but two runs
    /// also differ in how they fold, and by what is stopped at the nose at impact speed,
    /// which no ḋ explains. Half of the β that makes the quotients most alike is taken: the
    /// curves cannot distinguish the two causes.
    pub(crate) fn fit(cases: &[CaseCurve]) -> Self {
        Self::of(SHARE * Self::best_sensitivity(cases), None)
    }

    /// With a known β, and γ, in (s/m)^½.
    pub(super) fn of(sensitivity: f64, of_impact: Option<f64>) -> Self {
        Self { sensitivity, of_impact, prepared: Cached::default() }
    }

    /// Half of the β that fits best, in (s/m)^½, and the γ that explains what this leaves of the
    /// levels of neighbouring curves.
    pub(super) fn of_speed_and_impact(cases: &[CaseCurve]) -> (f64, f64) {
        let sensitivity = SHARE * Self::best_sensitivity(cases);
        (sensitivity, impact_sensitivity(cases, sensitivity))
    }

    /// The β in (s/m)^½ that makes the quotients of neighbouring curves most alike.
    pub(super) fn best_sensitivity(cases: &[CaseCurve]) -> f64 {
        let overlaps: Vec<Overlap> = cases.windows(2).map(Overlap::of).collect();
        let trials = std::array::from_fn(trial);
        let found = disagreements(&overlaps, &trials);
        least(|k| found[k]).map_or(0.0, trial)
    }

    fn factor(&self, closing_m_per_s: f64) -> f64 {
        factor(self.sensitivity, closing_m_per_s)
    }

    /// `Q` of case `i`, carried on beyond its end.
    fn quotient(&self, cases: &[CaseCurve], levels: &[f64], i: usize, d: f64) -> f64 {
        let case = &cases[i];
        match carries_on(cases, i).filter(|_| !case.reaches(d)) {
            Some(along) => {
                let along_n = self.quotient(cases, levels, along, d);
                self.carried_n(cases, levels, (i, along), d, along_n)
            }
            // Beyond the longest curve its end is held, where it stood.
            None => case.force_at(d) / self.factor(case.closing_at(d)),
        }
    }

    /// What the impact speed of case `i` makes of the Q of another.
    fn level_of(&self, cases: &[CaseCurve], i: usize, other: usize) -> f64 {
        let of = |i: usize| factor(self.of_impact.unwrap_or(0.0), cases[i].speed_m_per_s);
        of(i) / of(other)
    }

    fn carried(&self) -> LevelExtrapolation {
        if self.of_impact.is_some() { WITH_IMPACT } else { ALONE }
    }

    /// `Q(d; v)` in N at an impact speed: the force of a body that stands still. `cases`: one at
    /// least.
    pub(super) fn standing_n(
        &self,
        cases: &[CaseCurve],
        at: (f64, &[f64]),
        deflection_m: &[f64],
    ) -> Vec<f64> {
        let cases = &*answering_at(cases, at);
        let of = || cases.iter().map(|c| [c.speed_m_per_s, c.end_m(), c.envelope().work()]);
        let prepare = || {
            let alignment = self.alignment(cases);
            let curves = alignment.as_ref().map_or(cases, |alignment| &*alignment.curves);
            let levels = self.find_levels(curves);
            let own = self.of_impact.map_or(0.0, |of_impact| self.own_share(curves, of_impact));
            Prepared { of: of().collect(), alignment, levels, own, along: Cached::default() }
        };
        let kept = self.prepared.get_or_compute(prepare);
        let own;
        let Prepared { alignment, levels, own, along, .. } = if kept.of.iter().copied().eq(of()) {
            kept
        } else {
            own = prepare();
            &own
        };
        let Some(of_impact) = self.of_impact else {
            let blended_n = |cases: &[CaseCurve], d: &[f64]| {
                self.between_n(cases, levels, neighbouring(cases, at), d)
            };
            return match alignment {
                Some(alignment) => alignment.blended_n(at, deflection_m, blended_n),
                None => blended_n(cases, deflection_m),
            };
        };
        let blended_n =
            |cases: &[CaseCurve], along: &Along| self.blended_n(cases, *own, of_impact, at, along);
        if let Some(alignment) = alignment {
            return alignment.blended_n(at, deflection_m, |cases, d| {
                blended_n(cases, &self.along(cases, levels, d))
            });
        }
        let kept = along.get_or_compute(|| self.along(cases, levels, deflection_m));
        if kept.deflection_m == deflection_m {
            blended_n(cases, kept)
        } else {
            blended_n(cases, &self.along(cases, levels, deflection_m))
        }
    }

    /// By the `Q` of the runs, freed of what the impact speed makes of their levels.
    fn alignment(&self, cases: &[CaseCurve]) -> Option<Alignment> {
        let fit = || impact_sensitivity(cases, self.sensitivity);
        let of_impact = self.of_impact.unwrap_or_else(fit);
        Alignment::of(cases, |i, d| {
            let level =
                self.factor(cases[i].closing_at(d)) * factor(of_impact, cases[i].speed_m_per_s);
            cases[i].force_at(d) / level
        })
    }

    /// What the runs have of their own in their `Q`, freed of the impact speed.
    fn own_share(&self, cases: &[CaseCurve], of_impact: f64) -> f64 {
        let speeds: Vec<f64> = cases.iter().map(|c| c.speed_m_per_s).collect();
        let ends_m = furthest_m(cases);
        let level = |i: usize| factor(of_impact, speeds[i]);
        let values = |k: usize| -> Vec<f64> {
            let d = ends_m[ends_m.len() - 1] * k as f64 / OWN_POINTS as f64;
            let reached = (0..cases.len()).rev().take_while(|&i| d <= ends_m[i]);
            reached
                .map(|i| cases[i].force_at(d) / self.factor(cases[i].closing_at(d)) / level(i))
                .collect()
        };
        own_share(&speeds, &(1..OWN_POINTS).map(values).collect::<Vec<_>>())
    }

    /// Between the `Q` of the two neighbouring runs.
    fn between_n(
        &self,
        cases: &[CaseCurve],
        levels: &[f64],
        (low, high, share): (Twins, Twins, f64),
        deflection_m: &[f64],
    ) -> Vec<f64> {
        let standing_n = |d: f64| {
            let own = |(i, share)| match share > 0.0 {
                true => share * self.quotient(cases, levels, i, d),
                false => 0.0,
            };
            let of = |[a, b]: Twins| own(a) + own(b);
            if low == high { of(low) } else { (1.0 - share) * of(low) + share * of(high) }
        };
        deflection_m.iter().map(|&d| standing_n(d)).collect()
    }

    /// The `Q` of all runs, freed of the impact speed, blended and given it again, beyond the speeds of the runs as well. Beyond the
    /// end of a run the faster ones blend alone, after a length over which it fades.
    fn blended_n(
        &self,
        cases: &[CaseCurve],
        own: f64,
        of_impact: f64,
        (speed_m_per_s, features): (f64, &[f64]),
        along: &Along,
    ) -> Vec<f64> {
        let speeds: Vec<f64> = cases.iter().map(|c| c.speed_m_per_s).collect();
        let v = speed_m_per_s.clamp(speeds[0], speeds[speeds.len() - 1]);
        let blend = Blend::of(&speeds, own);
        let apart = apart(cases, features);
        let of_impact = |speed: f64| factor(of_impact, speed);
        let weights: Vec<Vec<f64>> = (0..cases.len())
            .map(|first| {
                let of = blend.weights(first, v, &apart);
                let level = of_impact(speed_m_per_s);
                of.iter().zip(&speeds).map(|(w, &s)| w * level / of_impact(s)).collect()
            })
            .collect();
        let mut now = vec![0.0; cases.len()];
        let mut standing_n = |curves: &[(f64, f64)]| {
            let is_gone = |i: &usize| curves[*i].1 == 0.0;
            let first = (0..curves.len() - 1).rev().find(is_gone).map_or(0, |i| i + 1);
            now.copy_from_slice(&weights[first]);
            let ended = curves[first..].iter().take_while(|(_, left)| *left < 1.0);
            for ((_, left), faster) in ended.zip(&weights[first + 1..]) {
                let fade = |(w, after): (&mut f64, &f64)| *w = left * *w + (1.0 - left) * after;
                now.iter_mut().zip(faster).for_each(fade);
            }
            let parts = (first..curves.len()).rev().map(|i| now[i] * curves[i].0);
            let sum_n = parts.sum::<f64>();
            if sum_n < 0.0 { 0.0 } else { sum_n }
        };
        along.curves.iter().map(|curves| standing_n(curves)).collect()
    }

    /// The curves along deflections in m.
    fn along(&self, cases: &[CaseCurve], levels: &[f64], deflection_m: &[f64]) -> Along {
        let ends_m = furthest_m(cases);
        let along: Vec<Option<usize>> = (0..cases.len()).map(|i| carries_on(cases, i)).collect();
        let curves_at = |&d: &f64| {
            let mut curves = vec![(0.0, 0.0); cases.len()];
            for i in (0..cases.len()).rev() {
                let on = along[i].filter(|_| !cases[i].reaches(d));
                let value_n = match on.filter(|on| *on == i + 1) {
                    // That of the next one is known by now.
                    Some(on) => self.carried_n(cases, levels, (i, on), d, curves[on].0),
                    None => self.quotient(cases, levels, i, d),
                };
                curves[i] = (value_n, self.fading(ends_m[i], d));
            }
            curves
        };
        let curves = deflection_m.iter().map(curves_at).collect();
        Along { deflection_m: deflection_m.to_vec(), curves }
    }

    /// What is left of a run at a deflection, as a share that fades beyond its end.
    fn fading(&self, end_m: f64, d: f64) -> f64 {
        let lengths = (d - end_m) / (self.carried().fades * end_m);
        match lengths {
            ..=0.0 => 1.0,
            ..LENGTHS => libm::exp(-lengths),
            _ => 0.0,
        }
    }

    /// `Q` of case `i` beyond its end from that of the one `along` which it is carried on.
    fn carried_n(
        &self,
        cases: &[CaseCurve],
        levels: &[f64],
        (i, along): (usize, usize),
        d: f64,
        along_n: f64,
    ) -> f64 {
        let level = 1.0 + (levels[i] - 1.0) * self.fading(cases[i].end_m(), d);
        along_n * self.level_of(cases, i, along) * level
    }

    /// Whether β is one that a fit gives.
    pub(super) fn check_sensitivity(&self) -> Result<(), String> {
        if (0.0..=MOST).contains(&self.sensitivity) {
            Ok(())
        } else {
            Err(format!("its rate sensitivity is {}", self.sensitivity))
        }
    }

    fn find_levels(&self, cases: &[CaseCurve]) -> Vec<f64> {
        let mut levels = vec![1.0; cases.len()];
        for i in (0..cases.len()).rev() {
            let Some(along) = carries_on(cases, i) else { continue };
            let end = cases[i].end_m();
            let at = |k: usize| end * (1.0 - self.carried().last * k as f64 / POINTS as f64);
            let sum = |case: usize| -> f64 {
                (0..=POINTS).map(|k| self.quotient(cases, &levels, case, at(k))).sum()
            };
            let (own, next) = (sum(i), self.level_of(cases, i, along) * sum(along));
            if next > 0.0 {
                levels[i] = (own / next).clamp(LEVELS.0, LEVELS.1);
            }
        }
        levels
    }
}

/// The curve along which case `i` is carried on beyond its end: the next faster one if one of the faster ends further, else the nearest of
/// the slower ones that do, which are of heavier bodies or of a faster run that died. `None` for the longest.
fn carries_on(cases: &[CaseCurve], i: usize) -> Option<usize> {
    let is_longer = |other: &CaseCurve| other.end_m() > cases[i].end_m();
    let faster = cases[i + 1..].iter().any(is_longer).then_some(i + 1);
    faster.or_else(|| cases[..i].iter().rposition(is_longer))
}

/// Ends of the curves in m: a run that ends before a slower one does not end the blend of that one.
fn furthest_m(cases: &[CaseCurve]) -> Vec<f64> {
    let furthest = |furthest_m: &mut f64, case: &CaseCurve| {
        *furthest_m = furthest_m.max(case.end_m());
        Some(*furthest_m)
    };
    cases.iter().scan(0.0, furthest).collect()
}

/// `1 + β√u`, 1 for bodies that part.
pub(super) fn factor(sensitivity: f64, closing_m_per_s: f64) -> f64 {
    1.0 + sensitivity * closing_m_per_s.max(0.0).sqrt()
}

/// The `k`-th sensitivity that is tried, in (s/m)^½.
fn trial(k: usize) -> f64 {
    MOST * k as f64 / STEPS as f64
}

/// The first trial with the least error; `None` if no error is a number.
fn least(error: impl Fn(usize) -> f64) -> Option<usize> {
    let best = (0..=STEPS)
        .map(|k| (k, error(k)))
        .fold((STEPS + 1, f64::INFINITY), |best, next| if next.1 < best.1 { next } else { best });
    (best.0 <= STEPS).then_some(best.0)
}

/// The γ by which the mean quotients of neighbouring curves, over their overlaps, differ as
/// `1 + γ√v` of their impact speeds: least squares of the logarithms.
fn impact_sensitivity(cases: &[CaseCurve], sensitivity: f64) -> f64 {
    let quotient = |case: &CaseCurve, end_m: f64| -> f64 {
        let at = |k: usize| end_m * k as f64 / POINTS as f64;
        let q = |d: f64| case.force_at(d) / factor(sensitivity, case.closing_at(d));
        (0..POINTS).map(|k| q(at(k))).sum()
    };
    let of_pair = |pair: &[CaseCurve]| {
        let end_m = pair[0].end_m().min(pair[1].end_m());
        let (slow, fast) = (quotient(&pair[0], end_m), quotient(&pair[1], end_m));
        let known = slow > 0.0 && fast > 0.0;
        known.then(|| (libm::log(slow / fast), pair[0].speed_m_per_s, pair[1].speed_m_per_s))
    };
    let pairs: Vec<(f64, f64, f64)> = cases.windows(2).filter_map(of_pair).collect();
    let error = |k: usize| -> f64 {
        let of = |&(found, slow, fast): &(f64, f64, f64)| {
            (found - libm::log(factor(trial(k), slow) / factor(trial(k), fast))).powi(2)
        };
        pairs.iter().map(of).sum()
    };
    least(error).map_or(0.0, trial)
}

/// Forces in N and roots of the closing speeds of two neighbouring curves over their overlap.
struct Overlap {
    end_m: f64,
    /// Of the slower and the faster curve at each point.
    points: Vec<[(f64, f64); 2]>,
}

impl Overlap {
    fn of(pair: &[CaseCurve]) -> Self {
        let end_m = pair[0].end_m().min(pair[1].end_m());
        let point = |k: usize| {
            let d = end_m * k as f64 / POINTS as f64;
            let of = |c: &CaseCurve| (c.force_at(d), c.closing_at(d).max(0.0).sqrt());
            [of(&pair[0]), of(&pair[1])]
        };
        Self { end_m, points: (1..=POINTS).map(point).collect() }
    }
}

/// Mean difference of neighbouring quotients over their overlaps, relative to their level, by each sensitivity. Vectors
/// as wide as the machine has them; the bits are the same for any width.
#[multiversion(targets("x86_64+avx+avx2"))]
fn disagreements(overlaps: &[Overlap], sensitivities: &[f64; STEPS + 1]) -> [f64; STEPS + 1] {
    let mut sums = [0.0; STEPS + 1];
    for Overlap { end_m, points } in overlaps {
        let (mut differences, mut levels) = ([0.0; STEPS + 1], [0.0; STEPS + 1]);
        for [(slow_n, slow_root), (fast_n, fast_root)] in points {
            for k in 0..=STEPS {
                let a = slow_n / (1.0 + sensitivities[k] * slow_root);
                let b = fast_n / (1.0 + sensitivities[k] * fast_root);
                differences[k] += (a - b).abs();
                levels[k] += 0.5 * (a.abs() + b.abs());
            }
        }
        for k in (0..=STEPS).filter(|&k| levels[k] > 0.0) {
            // Long overlaps count more than short ones.
            sums[k] += end_m * differences[k] / levels[k];
        }
    }
    sums
}

impl Surrogate for Rate {
    fn parameters(&self) -> Option<Result<Box<RawValue>, serde_json::Error>> {
        Some(serde_json::value::to_raw_value(self))
    }

    fn check(&self, _: usize) -> Result<(), String> {
        self.check_sensitivity()
    }

    fn force_n(&self, cases: &[CaseCurve], at: &QueryPoint<'_>, deflection_m: &[f64]) -> Vec<f64> {
        if cases.is_empty() {
            return vec![f64::NAN; deflection_m.len()];
        }
        let standing_n = self.standing_n(cases, (at.speed_m_per_s, at.features), deflection_m);
        if let Some(closing) = at.closing_m_per_s {
            return standing_n.iter().zip(closing).map(|(q, &u)| q * self.factor(u)).collect();
        }
        let mut force_n = Vec::with_capacity(deflection_m.len());
        let mut squared = at.speed_m_per_s * at.speed_m_per_s;
        let mut before: Option<(f64, f64)> = None;
        for (&d, &q) in deflection_m.iter().zip(&standing_n) {
            if let Some((d0, f0)) = before {
                // Trapezoid over the step; the end's force with the speed reached by the
                // start's force, once corrected.
                let rest = |f1: f64| squared - (f0 + f1) * (d - d0) / at.mass_kg;
                let first = q * self.factor(rest(f0).max(0.0).sqrt());
                squared = rest(q * self.factor(rest(first).max(0.0).sqrt()));
            }
            let force = q * self.factor(squared.max(0.0).sqrt());
            force_n.push(force);
            before = Some((d, force));
        }
        force_n
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cases made by a law of the model's own form: any speed must come out again.
    fn made(speed: f64, beta: f64, mass: f64) -> CaseCurve {
        let static_force = |d: f64| 2e6 + 1e6 * (12.0 * d).sin();
        let (mut d, mut squared) = (0.0_f64, speed * speed);
        let (mut deflection, mut force, mut closing) = (vec![], vec![], vec![]);
        let step = 1e-4;
        while squared > 0.0 {
            let f = static_force(d) * factor(beta, squared.sqrt());
            deflection.push(d);
            force.push(f);
            closing.push(squared.sqrt());
            squared -= 2.0 * f * step / mass;
            d += step;
        }
        CaseCurve::new(speed, vec![], deflection, force, closing).unwrap()
    }

    #[test]
    fn a_rate_dependent_law_is_found_again_up_to_the_half_that_is_taken() {
        let cases: Vec<CaseCurve> = [8.0, 12.0, 20.0].map(|v| made(v, 0.06, 24e3)).to_vec();
        let fitted = Rate::fit(&cases);
        assert!((fitted.sensitivity - 0.03).abs() < 0.003, "{}", fitted.sensitivity);
        let exact = Rate::of(0.06, None);
        let asked = made(15.0, 0.06, 24e3);
        let d = asked.envelope().deflection_m();
        let at =
            QueryPoint { speed_m_per_s: 15.0, features: &[], mass_kg: 24e3, closing_m_per_s: None };
        let force = exact.force_n(&cases, &at, d);
        // Not to the very end: there the speed falls to 0 within one step.
        for (i, f) in force.iter().enumerate().take(d.len() - 20) {
            let truth = asked.force_at(d[i]);
            assert!((f / truth - 1.0).abs() < 2e-3, "{f} N instead of {truth} N at {} m", d[i]);
        }
    }

    #[test]
    fn curves_that_do_not_depend_on_speed_give_no_sensitivity() {
        let cases: Vec<CaseCurve> = [8.0, 12.0, 20.0].map(|v| made(v, 0.0, 24e3)).to_vec();
        assert_eq!(Rate::fit(&cases).sensitivity, 0.0);
    }

    #[test]
    fn given_speeds_are_used() {
        let cases: Vec<CaseCurve> = [8.0, 20.0].map(|v| made(v, 0.0, 24e3)).to_vec();
        let rate = Rate::of(0.1, None);
        let at = |closing| QueryPoint {
            speed_m_per_s: 8.0,
            features: &[],
            mass_kg: 24e3,
            closing_m_per_s: Some(closing),
        };
        let fast = rate.force_n(&cases, &at(&[4.0]), &[0.1])[0];
        let still = rate.force_n(&cases, &at(&[0.0]), &[0.1])[0];
        assert!((fast / still - 1.2).abs() < 1e-12);
    }
}
