//! Continuation of a curve beyond the maximum crush of its own impact, in runs and in exports.
//!
//! A train crushes an end further than a single vehicle does, and most tools end a table with an error, a constant
//! force or the last slope. The rule, in three steps:
//!
//! 1. If faster runs show how the force continues (the curve comes from a model), it follows them, at the level with
//!    which the curve ends. Otherwise the force changes within 5 % of the maximum crush to the mean over the curve's last tenth, if
//!    that is more than its last force, and stays there.
//! 2. At 1.5 times the maximum crush, or where the faster runs end, the structure is assumed to be fully crushed.
//! 3. From there the force rises with the unloading stiffness (a steeper rise would change the unloading of tools that use the
//!    steepest rise for it) to three times the curve's peak force.

use super::Envelope;
use crate::error::Error;

/// How a curve continues beyond its maximum crush.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tail {
    /// Not at all: the last point is the maximum crush.
    None,
    /// By steps 1 and 2 of the rule: the force never rises by bottoming.
    Hold,
    /// By all three steps.
    Bottom,
}

/// Deflection at which the structure is fully crushed, as a multiple of the maximum crush.
const FULLY_CRUSHED: f64 = 1.5;
/// Over this share of the maximum crush the force goes to its mean over the last tenth.
const JOIN: f64 = 0.05;
/// The bottoming ends at so many times the largest force.
const HIGHEST: f64 = 3.0;
/// Share of the crush over which the level at the end is a mean.
const LAST: f64 = 0.1;

/// The curve with its tail. `beyond` is the same force along deflections of which some lie
/// beyond the curve's end, where that is known.
///
/// Points stand at multiples of the curve's last interval, so that a table of even deflections
/// stays one.
pub(crate) fn with_tail(
    curve: &Envelope,
    beyond: Option<&Envelope>,
    stiffness_n_per_m: f64,
    tail: Tail,
) -> Result<Envelope, Error> {
    if tail == Tail::None {
        return Ok(curve.clone());
    }
    let (mut d, mut f) = (curve.deflection_m().to_vec(), curve.force_n().to_vec());
    let (end_m, end_n) = (curve.end_m(), f[f.len() - 1]);
    let interval_m = end_m - d[d.len() - 2];
    // The first point of the grid at or beyond a deflection.
    let on_grid = |deflection_m: f64| {
        end_m + ((deflection_m - end_m) / interval_m - 1e-9).ceil().max(1.0) * interval_m
    };
    let mut push = |deflection_m: f64, force_n: f64| {
        if deflection_m > d[d.len() - 1] + 1e-9 * end_m {
            d.push(deflection_m);
            f.push(force_n.max(0.0));
        }
    };
    let mut level_n = end_n;
    let mut crushed_m = on_grid(FULLY_CRUSHED * end_m);
    match beyond.filter(|b| b.end_m() > end_m && b.force_at(end_m) > 0.0) {
        Some(beyond) => {
            let share = end_n / beyond.force_at(end_m);
            for &x in beyond.deflection_m().iter().filter(|&&x| x > end_m) {
                push(on_grid(x), share * beyond.force_at(on_grid(x)));
            }
            crushed_m = crushed_m.max(on_grid(beyond.end_m()));
            level_n = share * beyond.force_at(beyond.end_m());
        }
        None => {
            let from = (1.0 - LAST) * end_m;
            let mean = (curve.work() - curve.work_to(from)) / (end_m - from);
            level_n = level_n.max(mean);
            push(on_grid((1.0 + JOIN) * end_m), level_n);
        }
    }
    push(crushed_m, level_n);
    let held = Envelope::new(d, f)?;
    match tail {
        Tail::Bottom => bottomed(&held, curve.peak_force_n(), interval_m, stiffness_n_per_m),
        Tail::None | Tail::Hold => Ok(held),
    }
}

/// Step 3: the rise from the end of a curve, over a whole number of intervals.
pub(crate) fn bottomed(
    held: &Envelope,
    peak_n: f64,
    interval_m: f64,
    stiffness_n_per_m: f64,
) -> Result<Envelope, Error> {
    let (mut d, mut f) = (held.deflection_m().to_vec(), held.force_n().to_vec());
    let (crushed_m, level_n) = (held.end_m(), held.force_at(held.end_m()));
    let to_highest_m = (HIGHEST * peak_n - level_n) / stiffness_n_per_m;
    let rise_m = (to_highest_m / interval_m - 1e-9).ceil().max(1.0) * interval_m;
    d.push(crushed_m + rise_m);
    f.push(level_n + stiffness_n_per_m * rise_m);
    Envelope::new(d, f)
}

impl Tail {
    /// The rule in one line, for a file's header.
    pub fn rule(self, follows_faster_runs: bool) -> &'static str {
        match (self, follows_faster_runs) {
            (Self::None, _) => "none: the last point is the maximum crush",
            (Self::Hold, true) => {
                "beyond max_deflection_m along faster runs, then the force is held"
            }
            (Self::Hold, false) => "beyond max_deflection_m the level of its last tenth is held",
            (Self::Bottom, true) => {
                "beyond max_deflection_m along faster runs, then the force rises with the unloading stiffness"
            }
            (Self::Bottom, false) => {
                "beyond max_deflection_m the level of its last tenth is held to 1.5 times that, then the force rises with the unloading stiffness"
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve() -> Envelope {
        let d: Vec<f64> = (0..=100).map(|i| f64::from(i) / 100.0).collect();
        let f = d.iter().map(|d| 1e6 * (10.0 * d).min(1.0)).collect();
        Envelope::new(d, f).unwrap()
    }

    #[test]
    fn holds_and_then_rises_with_the_unloading_stiffness() {
        let with = with_tail(&curve(), None, 50e6, Tail::Bottom).unwrap();
        assert_eq!(with.deflection_m()[..101], curve().deflection_m()[..]);
        assert!((with.force_at(1.4) - 1e6).abs() < 1e-3);
        let rise = with.force_at(1.53) - with.force_at(1.52);
        assert!((rise / 0.01 / 50e6 - 1.0).abs() < 1e-9);
        assert!(with.peak_force_n() >= 3e6);
        let held = with_tail(&curve(), None, 50e6, Tail::Hold).unwrap();
        assert!((held.end_m() - 1.5).abs() < 1e-9);
        assert!((held.peak_force_n() - 1e6).abs() < 1e-3);
        assert_eq!(with_tail(&curve(), None, 50e6, Tail::None).unwrap(), curve());
    }

    #[test]
    fn keeps_an_even_table_even() {
        let with = with_tail(&curve(), None, 50e6, Tail::Bottom).unwrap();
        for d in with.deflection_m() {
            let steps = d / 0.01;
            assert!((steps - steps.round()).abs() < 1e-6, "{d}");
        }
    }

    #[test]
    fn follows_faster_runs_at_its_own_level() {
        let beyond = Envelope::new(vec![0.0, 1.0, 1.8], vec![0.0, 2e6, 4e6]).unwrap();
        let with = with_tail(&curve(), Some(&beyond), 50e6, Tail::Hold).unwrap();
        assert!((with.force_at(1.4) - 1.5e6).abs() < 1.0);
        assert!((with.end_m() - 1.8).abs() < 0.02);
    }

    #[test]
    fn a_force_that_has_fallen_returns_to_its_level() {
        let fallen = Envelope::new(vec![0.0, 0.5, 0.99, 1.0], vec![0.0, 1e6, 1e6, 0.0]).unwrap();
        let with = with_tail(&fallen, None, 50e6, Tail::Hold).unwrap();
        assert!((with.force_at(1.2) - 0.95e6).abs() < 1e3);
    }
}
