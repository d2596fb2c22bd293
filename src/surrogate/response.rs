//! Response of the body: what its force in the runs has beyond that of their crush law.
//!
//! The law moves the body as one mass. A real one follows the crush late and rings. What the body force of the two
//! neighbouring runs has of that is blended linearly in speed and added to the law's: half of it at equal deflection, as what
//! follows the force has it, half at equal time, as what rings has it. The runs of a group cannot separate the two.
//!
//! Over the second half of a run's crush it fades, because runs end at other deflections and times. Below the slowest run it fades
//! over as much speed as lies between the two slowest, above the fastest likewise: nothing shows how it goes on. A lighter body
//! than that of the runs has less of it, in proportion to its mass.

use super::cached::Cached;
use super::curves::neighbouring;
use super::{CaseCurve, QueryPoint};
use crate::dataset::is_same_speed;
use crate::piecewise;

/// Share of a run's maximum deflection from which its response fades.
const FADES_FROM: f64 = 0.5;
/// Closing speeds below this share of the impact speed count as that: a body at rest has no time of its own.
const LEAST_SPEED: f64 = 1e-3;

/// What the body force of a run has beyond the law's, along deflections.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Response {
    deflection_m: Vec<f64>,
    force_n: Vec<f64>,
    /// Since the contact.
    time_s: Vec<f64>,
}

impl Response {
    fn of(
        run: &CaseCurve,
        mass_kg: f64,
        deflection_m: &[f64],
        law_n: impl Fn(&QueryPoint<'_>) -> Vec<f64>,
    ) -> Self {
        let closing: Vec<f64> = deflection_m.iter().map(|&d| run.closing_at(d)).collect();
        let in_run = QueryPoint {
            speed_m_per_s: run.speed_m_per_s,
            features: &run.features,
            mass_kg,
            closing_m_per_s: Some(&closing),
        };
        let beyond_n = |(&d, law_n): (&f64, f64)| {
            let left = remaining(d / run.end_m());
            if left > 0.0 { left * (run.force_at(d) - law_n) } else { 0.0 }
        };
        Self {
            force_n: deflection_m.iter().zip(law_n(&in_run)).map(beyond_n).collect(),
            time_s: times_s(deflection_m, &closing, run.speed_m_per_s),
            deflection_m: deflection_m.to_vec(),
        }
    }

    fn at_time_n(&self, time_s: f64) -> f64 {
        let is_later = self.time_s.last().is_none_or(|last| time_s > *last);
        if is_later || self.time_s.len() < 2 {
            return 0.0;
        }
        let i = piecewise::segment(&self.time_s, time_s);
        piecewise::by_share(&self.time_s, &self.force_n, i, time_s)
    }
}

/// The force in N of a body at increasing deflections: `law_n` of the query with the response of the `runs`, given by their body
/// force in order of speed, and the mass that moved in each. Never below 0. `kept` has the responses along the deflections asked for first.
pub(super) fn with_response(
    runs: &[CaseCurve],
    kept: &[Cached<Response>],
    mass_kg: impl Fn(&CaseCurve) -> f64,
    at: &QueryPoint<'_>,
    deflection_m: &[f64],
    law_n: impl Fn(&QueryPoint<'_>) -> Vec<f64>,
) -> Vec<f64> {
    let mut force_n = law_n(at);
    let speeds: Vec<f64> = runs.iter().map(|run| run.speed_m_per_s).collect();
    let inside = share_inside(&speeds, at.speed_m_per_s);
    if inside == 0.0 {
        return force_n;
    }
    let own;
    let closing = match at.closing_m_per_s {
        Some(closing) => closing,
        None => {
            own = closing_m_per_s(deflection_m, &force_n, at);
            &own
        }
    };
    let time_s = times_s(deflection_m, closing, at.speed_m_per_s);
    let (low, high, share) = neighbouring(runs, (at.speed_m_per_s, at.features));
    let beside = [(low, 1.0 - share), (high, share)];
    let beside = beside.into_iter().flat_map(|(of, weight)| of.map(|(i, own)| (i, weight * own)));
    for (i, weight) in beside {
        if weight == 0.0 {
            continue;
        }
        let mass_kg = mass_kg(&runs[i]);
        let weight = inside * (at.mass_kg / mass_kg).min(1.0) * weight;
        let response = || Response::of(&runs[i], mass_kg, deflection_m, &law_n);
        let of_others;
        let mut of = kept[i].get_or_compute(response);
        if of.deflection_m != deflection_m {
            of_others = response();
            of = &of_others;
        }
        let both = of.force_n.iter().zip(&time_s).map(|(own, &t)| 0.5 * (own + of.at_time_n(t)));
        force_n.iter_mut().zip(both).for_each(|(f, response)| *f += weight * response);
    }
    force_n.iter_mut().for_each(|f| *f = f.max(0.0));
    force_n
}

/// 1 between the speeds of the runs, less outside of them, 0 from as far on as the outermost two lie apart.
fn share_inside(speeds: &[f64], v: f64) -> f64 {
    let [first, .., last] = speeds else { return 0.0 };
    let end = v.clamp(*first, *last);
    // Runs of other masses may have the same speed.
    let others = speeds.iter().filter(|s| !is_same_speed(**s, end)).map(|s| (s - end).abs());
    let outside = |gap: f64| (1.0 - (v - end).abs() / gap).max(0.0);
    if v == end { 1.0 } else { others.reduce(f64::min).map_or(0.0, outside) }
}

/// How much of a response is left at a share of the maximum deflection: 1 up to the half, 0 at the end, without kinks.
fn remaining(share: f64) -> f64 {
    let x = ((share - FADES_FROM) / (1.0 - FADES_FROM)).clamp(0.0, 1.0);
    1.0 - x * x * (3.0 - 2.0 * x)
}

/// Closing speeds in m/s of the query's body that the force slows down.
fn closing_m_per_s(along_m: &[f64], force_n: &[f64], at: &QueryPoint<'_>) -> Vec<f64> {
    let mut squared = at.speed_m_per_s * at.speed_m_per_s;
    let mut before = (0.0, 0.0);
    let closing = |(&d, &f): (&f64, &f64)| {
        squared -= (before.1 + f) * (d - before.0) / at.mass_kg;
        before = (d, f);
        squared.max(0.0).sqrt()
    };
    along_m.iter().zip(force_n).map(closing).collect()
}

/// Times in s since the contact at increasing deflections.
fn times_s(along_m: &[f64], closing_m_per_s: &[f64], impact_m_per_s: f64) -> Vec<f64> {
    let (mut time_s, mut before) = (0.0, (0.0, impact_m_per_s));
    let time = |(&d, &u): (&f64, &f64)| {
        time_s += (d - before.0) / (0.5 * (before.1 + u)).max(LEAST_SPEED * impact_m_per_s);
        before = (d, u);
        time_s
    };
    along_m.iter().zip(closing_m_per_s).map(time).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const MASS_KG: f64 = 20e3;

    /// A run under a constant law of 1 MN, whose body has `extra` of deflection and time beside it.
    fn run(speed: f64, extra: impl Fn(f64, f64) -> f64) -> CaseCurve {
        let n = 2000;
        let end_m = 0.5 * MASS_KG * speed * speed / 1e6;
        let d: Vec<f64> = (0..=n).map(|i| end_m * f64::from(i) / f64::from(n)).collect();
        let closing = |d: f64| (speed * speed - 2e6 * d / MASS_KG).max(0.0).sqrt();
        let force = |&d: &f64| 1e6 + extra(d, (speed - closing(d)) * MASS_KG / 1e6);
        let force_n = d.iter().map(force).collect();
        let closing = d.iter().map(|&d| closing(d)).collect();
        CaseCurve::new(speed, vec![], d, force_n, closing).unwrap()
    }

    fn asked(runs: &[CaseCurve], speed_m_per_s: f64, along_m: &[f64]) -> Vec<f64> {
        let kept = vec![Cached::default(); runs.len()];
        let at =
            QueryPoint { speed_m_per_s, features: &[], mass_kg: MASS_KG, closing_m_per_s: None };
        with_response(runs, &kept, |_| MASS_KG, &at, along_m, |_| vec![1e6; along_m.len()])
    }

    fn along() -> Vec<f64> {
        (0..=1000).map(|i| 5e-4 * f64::from(i)).collect()
    }

    /// 100 kN more up to 100 mm in both runs, at any speed; and a wave of 10 ms at any speed: half of each comes out.
    #[test]
    fn half_follows_the_deflection_and_half_the_time() {
        let along = along();
        let step = |d: f64, _: f64| if d < 0.1 { 1e5 } else { 0.0 };
        let found = asked(&[run(7.0, step), run(9.0, step)], 8.0, &along);
        assert!((found[100] - 1.1e6).abs() < 1.0, "{} N at 50 mm", found[100]);
        // Beyond 100 mm the half that follows the time of the faster run goes on for a while.
        assert!((found[400] - 1e6).abs() < 1.0, "{} N at 200 mm", found[400]);
        let wave = |_: f64, t: f64| 1e5 * (std::f64::consts::TAU * t / 0.01).sin();
        let found = asked(&[run(7.0, wave), run(9.0, wave)], 8.0, &along);
        let own = run(8.0, wave);
        let (mut with, mut without) = (0.0, 0.0);
        for (&d, f) in along.iter().zip(found).take_while(|(d, _)| **d < 0.2) {
            with += (f - own.force_at(d)).abs();
            without += (1e6 - own.force_at(d)).abs();
        }
        assert!(with < 0.75 * without, "{}", with / without);
    }

    #[test]
    fn a_run_has_its_own_until_half_of_its_crush() {
        let along = along();
        let cases = [run(7.0, |d, _| 2e5 * (20.0 * d).cos()), run(9.0, |_, _| 0.0)];
        let found = asked(&cases, 7.0, &along);
        for (&d, f) in along.iter().zip(&found).take_while(|(d, _)| **d < 0.24) {
            assert!((f - cases[0].force_at(d)).abs() < 200.0, "{f} N at {d} m");
        }
        // From its end on at 490 mm nothing is left of it.
        assert!((found[985] - 1e6).abs() < 1.0, "{} N", found[985]);
    }

    #[test]
    fn outside_the_speeds_it_fades() {
        let along = along();
        let runs = [run(7.0, |_, _| 2e5), run(9.0, |_, _| 2e5)];
        let at = |speed: f64| asked(&runs, speed, &along)[100] - 1e6;
        assert!((at(9.0) - 2e5).abs() < 1.0 && (at(10.0) - 1e5).abs() < 1.0, "{}", at(10.0));
        assert_eq!([at(11.0), at(20.0), at(5.0), at(1.0)], [0.0; 4]);
        // Nothing pulls.
        let late = [run(7.0, |_, _| -2e6), run(9.0, |_, _| -2e6)];
        assert_eq!(asked(&late, 8.0, &along)[100], 0.0);
        // A single run, or a single point.
        assert_eq!(asked(&runs[..1], 7.0, &along)[100], 1e6);
        assert_eq!(asked(&runs, 8.0, &[0.0]).len(), 1);
    }
}
