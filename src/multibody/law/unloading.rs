//! Unloading of a law: which part of the work done on the envelope is returned, and along which branch.

use super::{EnvelopeEnd, ForceLaw, OnEnvelope, Unloading};
use crate::curve::{CurveUnloading, ForceCurve};

/// What the stored energy of a structure follows from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StoredBy {
    /// The force at the maximum deflection.
    Force,
    /// The mean force up to there: a recorded force oscillates, the stored energy does not.
    MeanForce,
}

/// Energy of the unloading branches of an envelope; see [`super::ForceLaw`] for the rule.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Memory {
    /// Unloading stiffness `k`.
    pub(crate) stiffness_n_per_m: f64,
    /// Of `k` with the mean force, whose line then returns the energy that `k` does with the force; else 1.
    pub(crate) scale: f64,
    /// `k_s`: steepest rise of the envelope, or the unloading stiffness if that is more.
    pub(crate) steepest_n_per_m: f64,
    /// `c`: a branch stores at most this share of force times deflection, since it would reach
    /// zero deflection with a force left otherwise.
    pub(crate) largest_share: f64,
    pub(crate) stored_by: StoredBy,
    /// Energy that is lost once the deflection has been at each point of the envelope.
    pub(crate) dissipated_j: Vec<f64>,
}

impl Memory {
    /// `largest_share` is that of the branch's shape: ½ for a line. `points` are those of the
    /// envelope.
    pub(super) fn new(
        (stiffness_n_per_m, scale): (f64, f64),
        steepest_rise_n_per_m: f64,
        largest_share: f64,
        stored_by: StoredBy,
        points: impl Iterator<Item = OnEnvelope>,
    ) -> Self {
        let mut memory = Self {
            stiffness_n_per_m,
            scale,
            steepest_n_per_m: steepest_rise_n_per_m.max(stiffness_n_per_m * scale),
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

    /// Energy that is returned from a maximum deflection.
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
                (0.5 * mean_n * mean_n / (self.stiffness_n_per_m * self.scale)).min(work_j)
            }
        }
    }

    /// Energy that a branch of this stiffness, or the stiffer one to (0, 0), can store.
    fn storable_j(&self, top: &OnEnvelope, stiffness_n_per_m: f64) -> f64 {
        let bound_m = self.largest_share * top.deflection_m;
        top.force_n * (0.5 * top.force_n / stiffness_n_per_m).min(bound_m)
    }
}

/// Shape of an unloading branch: share of the force at the top over the share of the
/// branch's length that has been returned.
///
/// Invariant: shares of the length rise from 0 to 1, those of the force are at least 0, begin
/// at 1 and end at 0.
#[derive(Clone, Debug, PartialEq)]
pub struct UnloadingShape {
    pub(crate) length: Vec<f64>,
    pub(crate) force: Vec<f64>,
    /// `∫` of the force from each point to the end; the first is the share of force × length that
    /// is returned.
    pub(crate) rest: Vec<f64>,
    /// `∫` of `rest` from the first point to each.
    pub(super) rest_so_far: Vec<f64>,
}

impl UnloadingShape {
    /// The straight line.
    pub fn line() -> Self {
        Self::new(vec![0.0, 1.0], vec![1.0, 0.0])
    }

    fn new(length: Vec<f64>, force: Vec<f64>) -> Self {
        let n = length.len();
        let mut rest = vec![0.0; n];
        for j in (0..n - 1).rev() {
            rest[j] = rest[j + 1] + 0.5 * (force[j] + force[j + 1]) * (length[j + 1] - length[j]);
        }
        let mut rest_so_far = vec![0.0; n];
        for j in 0..n - 1 {
            let step = length[j + 1] - length[j];
            rest_so_far[j + 1] = rest_so_far[j]
                + rest[j + 1] * step
                + (force[j] / 6.0 + force[j + 1] / 3.0) * step * step;
        }
        Self { length, force, rest, rest_so_far }
    }

    /// From a branch that was recorded: deflections in m, falling, and forces in N. Points at
    /// which the deflection does not fall are left out; forces end at the first that is not
    /// above 0. `None` if that leaves fewer than three points or no force.
    pub fn of_branch(deflection_m: &[f64], force_n: &[f64]) -> Option<Self> {
        let (&top_m, &top_n) = (deflection_m.first()?, force_n.first()?);
        if top_n.is_nan() || top_n <= 0.0 {
            return None;
        }
        let mut points = vec![(top_m, 1.0)];
        for (&d, &f) in deflection_m.iter().zip(force_n).skip(1) {
            let (before_m, before) = points[points.len() - 1];
            if !(d < before_m && f.is_finite()) {
                continue;
            }
            let force = f / top_n;
            if force <= 0.0 {
                // Where the straight line between the two samples reaches zero.
                points.push((before_m - (before_m - d) * before / (before - force), 0.0));
                break;
            }
            points.push((d, force));
        }
        let (end_m, last) = points[points.len() - 1];
        if points.len() < 3 || last > 0.0 || end_m >= points[points.len() - 2].0 {
            return None;
        }
        let length = points.iter().map(|(d, _)| (top_m - d) / (top_m - end_m)).collect();
        Some(Self::new(length, points.iter().map(|p| p.1).collect()))
    }

    /// Share of force × length that is returned: ½ for the line.
    pub(super) fn share(&self) -> f64 {
        self.rest[0]
    }

    /// The piece that holds a share of the length.
    pub(super) fn piece(&self, length: f64) -> usize {
        let above = self.length.partition_point(|&s| s <= length);
        above.clamp(1, self.length.len() - 1) - 1
    }

    /// Change of the force over the length in piece `j`, at most 0 where it falls.
    pub(super) fn slope(&self, j: usize) -> f64 {
        (self.force[j + 1] - self.force[j]) / (self.length[j + 1] - self.length[j])
    }

    /// `∫` of the force from a share of the length below 1 to the end.
    pub(super) fn rest_at(&self, length: f64) -> f64 {
        let j = self.piece(length);
        let along = self.length[j + 1] - length;
        let force = self.force[j + 1] - self.slope(j) * along;
        self.rest[j + 1] + 0.5 * (self.force[j + 1] + force) * along
    }

    /// Steepest fall, 1 for the line.
    pub(super) fn steepest(&self) -> f64 {
        (0..self.length.len() - 1).map(|j| self.slope(j).abs()).fold(0.0, f64::max)
    }
}

impl ForceLaw {
    /// The law that follows a curve; on straight lines of a stiffness that is given. Without a
    /// choice it unloads as the curve knows it; with the steepest rise of its loading branch if it
    /// does not, and along the loading branch if that never rises.
    pub fn of_curve(curve: &ForceCurve, unloading: Option<Unloading>, end: EnvelopeEnd) -> Self {
        Self::along(curve, unloading, end).with_data_to(curve.data_end_m)
    }

    fn along(curve: &ForceCurve, unloading: Option<Unloading>, end: EnvelopeEnd) -> Self {
        let loading = curve.loading.clone();
        let own = || {
            let known = curve.unloading.stiffness_n_per_m();
            let stiffness_n_per_m = known.unwrap_or_else(|| loading.steepest_rise());
            if stiffness_n_per_m > 0.0 {
                Unloading::Memory { stiffness_n_per_m }
            } else {
                Unloading::Elastic
            }
        };
        let law = match unloading {
            Some(line @ Unloading::Memory { .. }) => return Self::new(loading, line, end),
            Some(Unloading::Elastic) => Unloading::Elastic,
            None => own(),
        };
        match &curve.unloading {
            CurveUnloading::Recorded { deflection_m, force_n, .. } => {
                let shape = UnloadingShape::of_branch(deflection_m, force_n);
                let shape = shape.unwrap_or_else(UnloadingShape::line);
                let turned_m = curve.data_end_m.unwrap_or(loading.end_m());
                Self::recorded(loading, law, shape, (turned_m, end))
            }
            CurveUnloading::Unknown | CurveUnloading::Stiffness(_) => Self::new(loading, law, end),
        }
    }
}
