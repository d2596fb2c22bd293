//! Memory of a law: what of the work done on the envelope comes back.

use super::OnEnvelope;

/// What tells how much energy a structure has stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StoredBy {
    /// The force at the largest deflection.
    Force,
    /// The mean force up to there: a recorded force swings, what is stored does not.
    MeanForce,
}

/// Energy of the unloading branches of an envelope; see [`super::ForceLaw`] for the rule.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Memory {
    /// Unloading stiffness `k`.
    pub(super) stiffness_n_per_m: f64,
    /// `k_s`: steepest rise of the envelope, or the unloading stiffness if that is more.
    pub(super) steepest_n_per_m: f64,
    /// `c`: a branch stores at most this share of force times deflection, since it would reach
    /// zero deflection with a force left otherwise.
    pub(super) largest_share: f64,
    pub(super) stored_by: StoredBy,
    /// Energy that is lost once the deflection has been at each point of the envelope.
    pub(super) dissipated_j: Vec<f64>,
}

impl Memory {
    /// `largest_share` is that of the branch's shape: ½ for a line. `points` are those of the
    /// envelope.
    pub(super) fn new(
        stiffness_n_per_m: f64,
        steepest_rise_n_per_m: f64,
        largest_share: f64,
        stored_by: StoredBy,
        points: impl Iterator<Item = OnEnvelope>,
    ) -> Self {
        let mut memory = Self {
            stiffness_n_per_m,
            steepest_n_per_m: steepest_rise_n_per_m.max(stiffness_n_per_m),
            largest_share,
            stored_by,
            dissipated_j: Vec::new(),
        };
        let mut dissipated_j = 0.0_f64;
        for point in points {
            dissipated_j = dissipated_j.max(point.work_j - memory.by_stiffness_j(&point));
            memory.dissipated_j.push(dissipated_j);
        }
        memory
    }

    pub(super) fn steepest_n_per_m(&self) -> f64 {
        self.steepest_n_per_m
    }

    /// Energy that comes back from a largest deflection.
    #[inline]
    pub(super) fn stored_j(&self, top: &OnEnvelope) -> f64 {
        // Within a piece work − storable is monotone for either bound, so its ends and the top
        // decide.
        let dissipated = self.dissipated_j[top.piece].max(top.work_j - self.by_stiffness_j(top));
        let least = self.storable_j(top, self.steepest_n_per_m);
        let stored = (top.work_j - dissipated).max(least);
        match self.stored_by {
            StoredBy::Force => stored,
            StoredBy::MeanForce => stored.min(top.force_n * self.largest_share * top.deflection_m),
        }
    }

    /// Energy of the branch of the unloading stiffness, were there no other.
    fn by_stiffness_j(&self, top: &OnEnvelope) -> f64 {
        match self.stored_by {
            StoredBy::Force => self.storable_j(top, self.stiffness_n_per_m),
            StoredBy::MeanForce => {
                let (d, work_j) = (top.deflection_m, top.work_j);
                let mean_n = if d > 0.0 { work_j / d } else { 0.0 };
                (0.5 * mean_n * mean_n / self.stiffness_n_per_m).min(work_j)
            }
        }
    }

    /// Energy that a branch of this stiffness, or the stiffer one to (0, 0), can store.
    fn storable_j(&self, top: &OnEnvelope, stiffness_n_per_m: f64) -> f64 {
        let bound_m = self.largest_share * top.deflection_m;
        top.force_n * (0.5 * top.force_n / stiffness_n_per_m).min(bound_m)
    }
}
