//! From a force curve to the force law of an interface.

use super::{EnvelopeEnd, ForceLaw, Unloading, UnloadingShape};
use crate::curve::{CurveUnloading, ForceCurve};

/// How a curve unloads in a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum UnloadingChoice {
    /// As the curve knows it; with the steepest rise of its loading branch if it does not, and
    /// along the loading branch if that never rises.
    Own,
    /// Along the loading branch, whatever the curve knows.
    Elastic,
    /// On straight lines of this stiffness in N/m.
    Stiffness(f64),
}

impl ForceLaw {
    /// The law that follows a curve.
    pub fn of_curve(curve: &ForceCurve, unloading: UnloadingChoice, end: EnvelopeEnd) -> Self {
        let loading = curve.loading.clone();
        let memory = |stiffness_n_per_m: f64| {
            if stiffness_n_per_m > 0.0 {
                Unloading::Memory { stiffness_n_per_m }
            } else {
                Unloading::Elastic
            }
        };
        let law = match unloading {
            UnloadingChoice::Own => {
                let known = curve.unloading.stiffness_n_per_m();
                memory(known.unwrap_or_else(|| loading.max_slope()))
            }
            UnloadingChoice::Elastic => Unloading::Elastic,
            UnloadingChoice::Stiffness(asked) => {
                return Self::new(loading, Unloading::Memory { stiffness_n_per_m: asked }, end);
            }
        };
        match &curve.unloading {
            CurveUnloading::Recorded { deflection_m, force_n, .. } => {
                let shape = UnloadingShape::of_branch(deflection_m, force_n);
                Self::recorded(loading, law, shape.unwrap_or_else(UnloadingShape::line), end)
            }
            CurveUnloading::Unknown | CurveUnloading::Stiffness(_) => Self::new(loading, law, end),
        }
    }
}
