//! The mass that the crush zone of a group stops, where its runs tell it.

use super::{TrainingCase, TrainingSet, grid};
use crate::curve::stopped_mass::{LoadingRun, StoppedMass};
use crate::curve::{Envelope, ForceKind};

/// Masses of a pair that differ by no more are those of equal bodies, as a share.
const EVEN: f64 = 0.01;
/// Fewest steps of a run's curve: short crushes need more than one each 2 mm.
pub(crate) const STEPS: usize = 200;

impl TrainingSet {
    /// The mass that is stopped at each deflection, of a group whose runs differ in speed alone and know a
    /// contact force on one body, or between two of the same mass. Its
    /// `is_told` says whether the runs agree on one.
    pub fn stopped_mass(&self) -> Option<StoppedMass> {
        let is_even =
            self.masses.other_kg.is_none_or(|m| (m / self.masses.body_kg - 1.0).abs() <= EVEN);
        let may_tell = self.force_kind == ForceKind::Contact && self.features.is_empty() && is_even;
        if !may_tell {
            return None;
        }
        let runs: Option<Vec<LoadingRun>> = self.cases.iter().map(loading_run).collect();
        StoppedMass::fit(&runs?, self.masses.effective_kg())
    }
}

fn loading_run(case: &TrainingCase) -> Option<LoadingRun> {
    let deflection_m = grid(case.envelope.end_m(), STEPS);
    let over = |of: &Envelope| {
        let values = deflection_m.iter().map(|&d| of.force_at(d)).collect();
        Envelope::new(deflection_m.clone(), values).ok()
    };
    Some(LoadingRun {
        contact_n: over(&case.envelope)?,
        closing_m_per_s: over(&case.motion.closing_speed)?,
    })
}
