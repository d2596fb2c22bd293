//! The numbers of a law, for programs that compute it elsewhere.

use super::{ForceLaw, StoredBy};

/// All that [`ForceLaw::force_n`] and [`ForceLaw::energies_j`] are computed from. SI.
#[derive(Clone, Copy, Debug)]
pub struct LawTables<'a> {
    /// Points of the envelope: deflections, strictly increasing from 0.
    pub deflection_m: &'a [f64],
    /// Force at each point, 0 at least.
    pub force_n: &'a [f64],
    /// Slope of the piece from each point on; the last is that beyond the end, where
    /// [`super::EnvelopeEnd::Error`] holds the force.
    pub slope_n_per_m: &'a [f64],
    /// `∫F dd` from 0 to each point.
    pub work_j: &'a [f64],
    /// Shares of an unloading branch's length, from 0 to 1.
    pub shape_length: &'a [f64],
    /// Share of the force at the top, from 1 to 0.
    pub shape_force: &'a [f64],
    /// `∫` of the shares of the force from each point to the end.
    pub shape_rest: &'a [f64],
    /// `None` where the envelope is followed back.
    pub memory: Option<MemoryTables<'a>>,
}

/// What of the work done on the envelope comes back; see [`ForceLaw`] for the rule.
#[derive(Clone, Copy, Debug)]
pub struct MemoryTables<'a> {
    /// Energy that is lost once the deflection has been at each point of the envelope.
    pub dissipated_j: &'a [f64],
    /// Unloading stiffness `k`.
    pub stiffness_n_per_m: f64,
    /// Steepest rise of the envelope, or `k` if that is more.
    pub steepest_n_per_m: f64,
    /// A branch stores at most this share of force times deflection.
    pub largest_share: f64,
    /// Whether what is stored follows from the mean force up to the largest deflection, and not
    /// from the force there.
    pub is_by_mean_force: bool,
}

impl ForceLaw {
    /// The numbers that the law is computed from.
    pub fn tables(&self) -> LawTables<'_> {
        LawTables {
            deflection_m: self.envelope.deflection_m(),
            force_n: self.envelope.force_n(),
            slope_n_per_m: &self.slope_n_per_m,
            work_j: self.envelope.work_j(),
            shape_length: &self.shape.length,
            shape_force: &self.shape.force,
            shape_rest: &self.shape.rest,
            memory: self.memory.as_ref().map(|memory| MemoryTables {
                dissipated_j: &memory.dissipated_j,
                stiffness_n_per_m: memory.stiffness_n_per_m,
                steepest_n_per_m: memory.steepest_n_per_m,
                largest_share: memory.largest_share,
                is_by_mean_force: memory.stored_by == StoredBy::MeanForce,
            }),
        }
    }
}
