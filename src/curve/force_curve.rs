//! Force curves: the output of database, models, files and NSDM, and the input of multi-body runs,
//! exports and comparisons.
//!
//! # Continuation of a curve beyond the maximum crush of its own impact, in runs and in exports
//!
//! A train crushes an end further than a single vehicle does, and most tools end a table with an error, a constant
//! force or the last slope. The rule, in three steps:
//!
//! 1. If faster runs show how the force continues (the curve comes from a model), it follows them, at the level with
//!    which the curve ends. Otherwise the force changes within 5 % of the maximum crush to the mean over the curve's last tenth, if
//!    that is more than its last force, and stays there.
//! 2. At 1.5 times the maximum crush, for a model at 1.5 times that of its fastest run, the structure is assumed to be fully crushed.
//! 3. From there the force rises with the unloading stiffness (a steeper rise would change the unloading of tools that use the
//!    steepest rise for it) to three times the curve's peak force.

use super::body::{body_motion, rebound_stiffness_n_per_m, recorded_force};
use super::{Case, Envelope, ForceKind, loading};
use crate::error::Error;
use crate::unit::SpeedKind;

/// A crush beyond a curve's data by less than this share, or less than this in m, is that of another unloading or step.
const BEYOND: (f64, f64) = (0.01, 1e-4);

/// Whether a crush goes so far beyond the data of its curve that the force there matters.
pub(crate) fn is_beyond(crush_m: f64, data_end_m: f64) -> bool {
    crush_m > data_end_m + (BEYOND.0 * data_end_m).max(BEYOND.1)
}

/// A force–deflection curve that can drive an interface, with what its source knows of it.
#[derive(Clone, Debug, PartialEq)]
pub struct ForceCurve {
    /// Loading branch to the maximum crush, from 0 on; of a recorded curve the first force need not be 0.
    pub loading: Envelope,
    /// The same force along deflections of which some lie beyond the maximum crush: neighbours
    /// in a train keep pushing where a body by itself would have stopped.
    pub beyond: Option<Envelope>,
    /// From the end of the loading branch.
    pub unloading: CurveUnloading,
    /// Which force it is; `None` if its source does not state it.
    pub kind: Option<ForceKind>,
    /// What its speed is measured against; `None` for a curve without a speed.
    pub speed_kind: Option<SpeedKind>,
    /// Speed that it belongs to.
    pub speed_m_per_s: Option<f64>,
    /// Deflection up to which its source has data, in m, where the loading branch continues after it.
    pub data_end_m: Option<f64>,
}

/// The known unloading of a curve from its maximum deflection.
#[derive(Clone, Debug, PartialEq)]
pub enum CurveUnloading {
    /// Nothing.
    Unknown,
    /// A straight line of this stiffness in N/m.
    Stiffness(f64),
    /// The recorded branch, from the maximum deflection to where the force is first zero.
    Recorded {
        /// Of the straight line that returns the same energy, in N/m.
        stiffness_n_per_m: f64,
        /// Falling.
        deflection_m: Vec<f64>,
        /// One per deflection.
        force_n: Vec<f64>,
    },
}

/// Why a case has no curve of the force that was requested.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum ForceCurveError {
    /// Its loading branch is not an envelope.
    #[error("{0}")]
    Envelope(#[from] Error),
    /// Its body force cannot be computed from its speeds.
    #[error("its samples contain no loading branch")]
    NoMotion,
}

impl ForceCurve {
    /// A curve without further data.
    pub(crate) fn bare(loading: Envelope) -> Self {
        Self {
            loading,
            beyond: None,
            unloading: CurveUnloading::Unknown,
            kind: None,
            speed_kind: None,
            speed_m_per_s: None,
            data_end_m: None,
        }
    }

    /// A force that drives single-mass bodies, without further data.
    pub(crate) fn of_body(loading: Envelope) -> Self {
        Self { kind: Some(ForceKind::Body), ..Self::bare(loading) }
    }

    /// The force that moved the body of a case, with the recorded unloading; `None` if the
    /// samples contain no loading branch.
    pub fn recorded(case: &Case) -> Option<Self> {
        let recorded = recorded_force(case)?;
        let unloading = match recorded.unloading_stiffness_n_per_m {
            Some(stiffness_n_per_m) => CurveUnloading::Recorded {
                stiffness_n_per_m,
                deflection_m: recorded.unloading_deflection_m,
                force_n: recorded.unloading_force_n,
            },
            None => CurveUnloading::of(case.curves.unloading_stiffness_n_per_m),
        };
        Some(Self {
            unloading,
            kind: Some(ForceKind::Body),
            speed_kind: Some(case.conditions.speed.kind),
            speed_m_per_s: Some(case.conditions.speed.m_per_s),
            ..Self::bare(recorded.loading)
        })
    }

    /// The curve of a case: the recipe's force, or for [`ForceKind::Body`] beside a contact
    /// force the recorded one of the body's motion.
    pub(crate) fn of_case(case: &Case, force: ForceKind) -> Result<Self, ForceCurveError> {
        let is_other = force == ForceKind::Body && case.curves.force_kind == ForceKind::Contact;
        if is_other && !case.moves_by_its_force() {
            return Self::recorded(case).ok_or(ForceCurveError::NoMotion);
        }
        let secant = case.curves.unloading_stiffness_n_per_m;
        let curve = Self {
            unloading: CurveUnloading::of(secant),
            kind: Some(force),
            speed_kind: Some(case.conditions.speed.kind),
            speed_m_per_s: Some(case.conditions.speed.m_per_s),
            ..Self::bare(case.loading()?.envelope)
        };
        // What moves a body lets it rebound as it did.
        if case.moves_by_its_force() {
            let by_energy = loading::stiffness_of_unloading_energy(&case.curves.original);
            return Ok(Self { unloading: CurveUnloading::of(by_energy.or(secant)), ..curve });
        }
        Ok(match force {
            ForceKind::Body => {
                let rebound = body_motion(case).and_then(|motion| motion.rebound_speed_m_per_s);
                curve.rebounding(case.conditions.masses.effective_kg(), rebound, secant)
            }
            ForceKind::Contact => curve,
        })
    }

    /// The same with the unloading that lets a body of `mass_kg` rebound at `rebound_m_per_s`,
    /// or with `otherwise` in N/m where that speed is not known.
    pub(crate) fn rebounding(
        self,
        mass_kg: f64,
        rebound_m_per_s: Option<f64>,
        otherwise: Option<f64>,
    ) -> Self {
        let top_n = self.loading.force_at(self.loading.end_m());
        let stiffness = rebound_m_per_s
            .and_then(|speed| rebound_stiffness_n_per_m(top_n, mass_kg, speed))
            .or(otherwise);
        Self { unloading: CurveUnloading::of(stiffness), ..self }
    }

    /// The same with a known unloading stiffness in N/m.
    pub(crate) fn unloading_with(self, stiffness_n_per_m: f64) -> Self {
        Self { unloading: CurveUnloading::Stiffness(stiffness_n_per_m), ..self }
    }

    /// The same with the loading branch continued by a rule; its data still end where they did. A
    /// branch that goes beyond its data has been continued to where it ends, and can only bottom.
    pub(crate) fn continued(mut self, tail: Tail) -> Result<Self, Error> {
        let data_end_m = self.data_end_m.unwrap_or(self.loading.end_m());
        let known = self.unloading.stiffness_n_per_m().filter(|k| *k > 0.0);
        let stiffness_n_per_m = known.unwrap_or_else(|| self.loading.steepest_rise());
        // A force that never rises bottoms by no slope.
        let tail = if stiffness_n_per_m > 0.0 { tail } else { Tail::Hold };
        let beyond = self.beyond.take();
        let is_followed = beyond.is_none() && data_end_m < self.loading.end_m();
        let fully_m = FULLY_CRUSHED * data_end_m;
        if beyond.is_some() && tail == Tail::Bottom && self.loading.end_m() > fully_m {
            // A prediction for more energy than the structure takes shows no force beyond that.
            let (d, f) = (self.loading.deflection_m(), self.loading.force_n());
            let below = d.partition_point(|d| *d < fully_m * (1.0 - 1e-9));
            let with = |values: &[f64], last: f64| [&values[..below], &[last]].concat();
            let cut = Envelope::new(with(d, fully_m), with(f, self.loading.force_at(fully_m)))?;
            let interval_m = grid_m(&cut, fully_m);
            self.loading = bottomed(&cut, cut.peak_force_n(), interval_m, stiffness_n_per_m)?;
            return Ok(Self { data_end_m: Some(data_end_m), ..self });
        }
        let loading = &self.loading;
        self.loading = if is_followed && tail == Tail::Bottom {
            let interval_m = grid_m(loading, data_end_m);
            bottomed(loading, loading.peak_force_n(), interval_m, stiffness_n_per_m)?
        } else if is_followed {
            return Ok(self);
        } else {
            with_tail(loading, beyond.as_ref(), data_end_m, stiffness_n_per_m, tail)?
        };
        Ok(Self { data_end_m: Some(data_end_m), ..self })
    }

    /// The same with all forces, and the stiffness with them, times `factor` (above 0).
    pub(crate) fn scaled(mut self, factor: f64) -> Result<Self, Error> {
        let times = |e: &Envelope| {
            let force_n = e.force_n().iter().map(|f| f * factor).collect();
            Envelope::new(e.deflection_m().to_vec(), force_n)
        };
        self.loading = times(&self.loading)?;
        self.beyond = self.beyond.as_ref().map(times).transpose()?;
        match &mut self.unloading {
            CurveUnloading::Unknown => {}
            CurveUnloading::Stiffness(k) => *k *= factor,
            CurveUnloading::Recorded { stiffness_n_per_m, force_n, .. } => {
                *stiffness_n_per_m *= factor;
                force_n.iter_mut().for_each(|f| *f *= factor);
            }
        }
        Ok(self)
    }
}

impl CurveUnloading {
    /// A line of that stiffness in N/m, if it is known.
    pub(crate) fn of(stiffness_n_per_m: Option<f64>) -> Self {
        stiffness_n_per_m.map_or(Self::Unknown, Self::Stiffness)
    }

    /// Stiffness in N/m of the line that returns the same energy, if it is known.
    pub fn stiffness_n_per_m(&self) -> Option<f64> {
        match self {
            Self::Unknown => None,
            Self::Stiffness(stiffness_n_per_m) | Self::Recorded { stiffness_n_per_m, .. } => {
                Some(*stiffness_n_per_m)
            }
        }
    }
}

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
pub(crate) const FULLY_CRUSHED: f64 = 1.5;
/// Over this share of the maximum crush the force goes to its mean over the last tenth.
const JOIN: f64 = 0.05;
/// The bottoming ends at so many times the largest force.
const HIGHEST: f64 = 3.0;
/// Largest interval between points at which a tail may begin and end, as a share of the maximum crush.
const COARSEST: f64 = 0.01;
/// Share of the crush over which the level at the end is a mean.
const LAST: f64 = 0.1;

/// The curve with its tail. `beyond` is the same force along deflections of which some lie
/// beyond the curve's end, where that is known; `data_end_m` is how far its source has data.
///
/// Points stand at multiples of the curve's last interval, so that a fine table of even deflections
/// stays one.
pub(crate) fn with_tail(
    curve: &Envelope,
    beyond: Option<&Envelope>,
    data_end_m: f64,
    stiffness_n_per_m: f64,
    tail: Tail,
) -> Result<Envelope, Error> {
    if tail == Tail::None {
        return Ok(curve.clone());
    }
    let (mut d, mut f) = (curve.deflection_m().to_vec(), curve.force_n().to_vec());
    let (end_m, end_n) = (curve.end_m(), f[f.len() - 1]);
    let interval_m = grid_m(curve, end_m);
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
    let mut crushed_m = on_grid(FULLY_CRUSHED * end_m.min(data_end_m));
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

/// Interval of the points of a tail: the curve's last, if it is as fine as a rule in per cent of the maximum crush needs.
fn grid_m(curve: &Envelope, max_crush_m: f64) -> f64 {
    let d = curve.deflection_m();
    (d[d.len() - 1] - d[d.len() - 2]).min(COARSEST * max_crush_m)
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
    let on_grid_m = (to_highest_m / interval_m - 1e-9).ceil().max(1.0) * interval_m;
    // A stiffness that would pass the peak within one interval leaves the grid, so that the force ends where it should.
    let is_steep = to_highest_m > 0.0 && stiffness_n_per_m * interval_m > peak_n;
    let rise_m = if is_steep { to_highest_m } else { on_grid_m };
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
                "beyond max_deflection_m along faster runs to data_end_m, then the force is held"
            }
            (Self::Hold, false) => {
                "beyond max_deflection_m the last force is held, or the mean of the last tenth if that is more"
            }
            (Self::Bottom, true) => {
                "beyond max_deflection_m along faster runs to data_end_m, held to 1.5 times that, then the force rises with the unloading stiffness"
            }
            (Self::Bottom, false) => {
                "beyond max_deflection_m the last force, or the mean of the last tenth if that is more, is held to 1.5 times that, then the force rises with the unloading stiffness"
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve() -> ForceCurve {
        ForceCurve::bare(Envelope::new(vec![0.0, 1.0], vec![0.0, 2e6]).unwrap())
    }

    /// A body of 20 t that leaves 2 MN at 2 m/s takes 40 kJ with it.
    #[test]
    fn a_rebound_tells_the_stiffness() {
        let curve = curve().rebounding(20e3, Some(2.0), None);
        let stiffness = curve.unloading.stiffness_n_per_m().unwrap();
        assert_eq!(stiffness, 5e7);
        assert_eq!(2e6_f64.powi(2) / (2.0 * stiffness), 40e3);
        assert_eq!(rebound_stiffness_n_per_m(0.0, 20e3, 2.0), None);
        let without = super::tests::curve().rebounding(20e3, None, Some(3e7));
        assert_eq!(without.unloading, CurveUnloading::Stiffness(3e7));
    }

    #[test]
    fn what_lies_beyond_joins_at_the_level_of_the_end() {
        let beyond = Envelope::new(vec![0.0, 0.5, 1.5, 2.0], vec![0.0, 1e6, 1e6, 3e6]).unwrap();
        let loading = Envelope::new(vec![0.0, 0.5, 1.0], vec![0.0, 1e6, 2e6]).unwrap();
        let held = ForceCurve { beyond: Some(beyond), ..ForceCurve::bare(loading) };
        let bottoms = held.clone().continued(Tail::Bottom).unwrap();
        let held = held.continued(Tail::Hold).unwrap();
        assert_eq!(held.loading.deflection_m(), [0.0, 0.5, 1.0, 1.5, 2.0]);
        assert_eq!(held.loading.force_n(), [0.0, 1e6, 2e6, 2e6, 6e6]);
        assert_eq!(held.data_end_m, Some(1.0));
        // 6 MN are three times the peak already: one interval more, at the steepest rise.
        assert_eq!(bottoms.loading.deflection_m(), [0.0, 0.5, 1.0, 1.5, 2.0, 2.01]);
        assert_eq!(bottoms.loading.force_at(2.01), 6.02e6);
        // What has been continued before can only bottom.
        assert_eq!(held.clone().continued(Tail::Hold).unwrap(), held);
        let again = held.continued(Tail::Bottom).unwrap();
        assert_eq!(again.loading.deflection_m()[..5], [0.0, 0.5, 1.0, 1.5, 2.0]);
        assert_eq!(again.data_end_m, Some(1.0));
    }

    fn sample() -> Envelope {
        let d: Vec<f64> = (0..=100).map(|i| f64::from(i) / 100.0).collect();
        let f = d.iter().map(|d| 1e6 * (10.0 * d).min(1.0)).collect();
        Envelope::new(d, f).unwrap()
    }

    #[test]
    fn holds_and_then_rises_with_the_unloading_stiffness() {
        let with = with_tail(&sample(), None, f64::INFINITY, 50e6, Tail::Bottom).unwrap();
        assert_eq!(with.deflection_m()[..101], sample().deflection_m()[..]);
        assert!((with.force_at(1.4) - 1e6).abs() < 1e-3);
        let rise = with.force_at(1.53) - with.force_at(1.52);
        assert!((rise / 0.01 / 50e6 - 1.0).abs() < 1e-9);
        assert!(with.peak_force_n() >= 3e6);
        let held = with_tail(&sample(), None, f64::INFINITY, 50e6, Tail::Hold).unwrap();
        assert!((held.end_m() - 1.5).abs() < 1e-9);
        assert!((held.peak_force_n() - 1e6).abs() < 1e-3);
        assert_eq!(with_tail(&sample(), None, f64::INFINITY, 50e6, Tail::None).unwrap(), sample());
    }

    #[test]
    fn keeps_an_even_table_even() {
        let with = with_tail(&sample(), None, f64::INFINITY, 50e6, Tail::Bottom).unwrap();
        for d in with.deflection_m() {
            let steps = d / 0.01;
            assert!((steps - steps.round()).abs() < 1e-6, "{d}");
        }
    }

    /// Where the points are far apart, the rule still counts from the maximum crush, not in their intervals.
    #[test]
    fn a_coarse_table_bottoms_where_a_fine_one_does() {
        let d = vec![0.0, 0.02, 0.04, 0.06, 0.4];
        let coarse = Envelope::new(d, vec![0.0, 0.9e6, 1e6, 1.2e6, 1.2e6]).unwrap();
        let with = with_tail(&coarse, None, f64::INFINITY, 80e6, Tail::Bottom).unwrap();
        assert!((with.force_at(0.6) - 1.2e6).abs() < 1e-3);
        assert!((with.force_at(0.61) - 2e6).abs() < 1.0);
        assert!((3.6e6..3.6e6 + 80e6 * 0.004).contains(&with.peak_force_n()));
    }

    #[test]
    fn follows_faster_runs_at_its_own_level() {
        let beyond = Envelope::new(vec![0.0, 1.0, 1.8], vec![0.0, 2e6, 4e6]).unwrap();
        let with = with_tail(&sample(), Some(&beyond), f64::INFINITY, 50e6, Tail::Hold).unwrap();
        assert!((with.force_at(1.4) - 1.5e6).abs() < 1.0);
        assert!((with.end_m() - 1.8).abs() < 0.02);
    }

    #[test]
    fn a_force_that_has_fallen_returns_to_its_level() {
        let fallen = Envelope::new(vec![0.0, 0.5, 0.99, 1.0], vec![0.0, 1e6, 1e6, 0.0]).unwrap();
        let with = with_tail(&fallen, None, f64::INFINITY, 50e6, Tail::Hold).unwrap();
        assert!((with.force_at(1.2) - 0.95e6).abs() < 1e3);
    }
}
