//! Force curves: the output of database, models, files and NSDM, and the input of multi-body runs,
//! exports and comparisons.

use super::body::{rebound_stiffness_n_per_m, recorded_force};
use super::tail::{Tail, bottomed, with_tail};
use super::{Case, Envelope, ForceKind};
use crate::error::Error;
use crate::unit::SpeedKind;

/// A force–deflection curve that can drive an interface, with what its source knows of it.
#[derive(Clone, Debug, PartialEq)]
pub struct ForceCurve {
    /// Loading branch from (0, 0) to the maximum crush.
    pub loading: Envelope,
    /// The same force along deflections of which some lie beyond the maximum crush: neighbours
    /// in a train push on where a body by itself would have stopped.
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

    /// A force that drives bodies of one mass, without further data.
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
        Ok(Self {
            unloading: CurveUnloading::of(case.curves.unloading_stiffness_n_per_m),
            kind: Some(force),
            speed_kind: Some(case.conditions.speed.kind),
            speed_m_per_s: Some(case.conditions.speed.m_per_s),
            ..Self::bare(case.loading()?.envelope)
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
        let stiffness_n_per_m = known.unwrap_or_else(|| self.loading.max_slope());
        // A force that never rises bottoms by no slope.
        let tail = if stiffness_n_per_m > 0.0 { tail } else { Tail::Hold };
        let (loading, beyond) = (&self.loading, self.beyond.take());
        let is_followed = beyond.is_none() && data_end_m < loading.end_m();
        self.loading = if is_followed && tail == Tail::Bottom {
            let d = loading.deflection_m();
            let interval_m = loading.end_m() - d[d.len() - 2];
            bottomed(loading, loading.peak_force_n(), interval_m, stiffness_n_per_m)?
        } else if is_followed {
            return Ok(self);
        } else {
            with_tail(loading, beyond.as_ref(), stiffness_n_per_m, tail)?
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
        assert_eq!(bottoms.loading.deflection_m(), [0.0, 0.5, 1.0, 1.5, 2.0, 2.5]);
        assert_eq!(bottoms.loading.force_at(2.5), 7e6);
        // What has been continued before can only bottom.
        assert_eq!(held.clone().continued(Tail::Hold).unwrap(), held);
        let again = held.continued(Tail::Bottom).unwrap();
        assert_eq!(again.loading.deflection_m()[..5], [0.0, 0.5, 1.0, 1.5, 2.0]);
        assert_eq!(again.data_end_m, Some(1.0));
    }
}
