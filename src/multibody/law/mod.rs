//! Force law of an interface: elastic, or elastic-plastic with memory.
//!
//! Unloading with memory: dissipation is kept from falling locally, so that an interface whose loading branch is steeper
//! than its unloading line creates no energy. With a stiffness above the steepest rise this is the law of one stiffness.
//!
//! Bodies that touch and close at the start are on the envelope (F = F_e(0)), although an open interface has no force:
//! otherwise a constant force would lose half a step.

mod unloading;

use serde::Deserialize;

use crate::curve::Envelope;
use unloading::Memory;
pub(crate) use unloading::StoredBy;
pub use unloading::UnloadingShape;

/// What happens when the deflection decreases.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unloading {
    /// The envelope is followed back (the reference model, which has no memory).
    Elastic,
    /// A straight line of this stiffness in N/m; reloading follows it back up. Where the
    /// envelope rises more steeply than that, the line is stiffer: see [`ForceLaw`].
    Memory {
        /// Unloading stiffness in N/m, above 0.
        stiffness_n_per_m: f64,
    },
}

/// What the force does beyond the envelope's last point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum EnvelopeEnd {
    /// The last force is held.
    #[default]
    Hold,
    /// The last segment is continued if it rises, else the last force is held.
    Slope,
    /// The structure is assumed to be fully crushed at 1.5 times the maximum crush, for a model at 1.5 times that of its
    /// fastest run: from there the force rises with the unloading stiffness. Of a law by itself: as `slope`.
    Bottom,
    /// The run ends with an error that names the interface.
    Error,
}

/// Force over deflection at an interface.
///
/// Invariant: with memory, the dissipated energy never falls while the deflection grows, so
/// that no deflection creates energy. One stiffness `k` for all deflections keeps to this
/// only if it is at least the envelope's steepest rise `k_s`: FE curves begin with a spike
/// whose rise is far steeper than the line on which the vehicle rebounds at the end, and
/// one stiff line for both would lose most of the rebound. Therefore the branch from δ stores
///
/// `stored = max(work − dissipated, storable(k_s))`, with
/// `storable(k) = F min(F/2k, cδ)` and
/// `dissipated = max over s ≤ δ of work(s) − storable(k)(s)`, not below 0.
///
/// `F` is the envelope's force at δ and `work` its integral up to there; `c = ½` for a straight
/// line, whose stiffness is `F²/(2 stored)`, and less for a shape that returns less. The bound
/// `cδF` keeps the branch from reaching zero deflection with a force left, whose energy would be
/// lost. With `k ≥ k_s` and an envelope from (0, 0) this is the law of one stiffness.
#[derive(Clone, Debug, PartialEq)]
pub struct ForceLaw {
    pub(crate) envelope: Envelope,
    pub(crate) shape: UnloadingShape,
    end: EnvelopeEnd,
    /// Deflection up to which the envelope rests on data, in m: its end if nothing else is known.
    data_end_m: f64,
    /// Slope of the piece from each point of the envelope on; the last one beyond the end.
    pub(crate) slope_n_per_m: Vec<f64>,
    /// Integral of the work over the deflection at each point of the envelope.
    sum_jm: Vec<f64>,
    /// `None` where the envelope is followed back.
    pub(crate) memory: Option<Memory>,
}

impl ForceLaw {
    /// A law that unloads on a straight line. Forces below zero become zero, because an
    /// interface only pushes.
    pub fn new(envelope: Envelope, unloading: Unloading, end: EnvelopeEnd) -> Self {
        Self::with(envelope, (unloading, 1.0), UnloadingShape::line(), end, StoredBy::Force)
    }

    /// The same with an unloading branch that is not a straight line; its energy is that of the
    /// line of the unloading stiffness.
    pub fn shaped(
        envelope: Envelope,
        unloading: Unloading,
        shape: UnloadingShape,
        end: EnvelopeEnd,
    ) -> Self {
        Self::with(envelope, (unloading, 1.0), shape, end, StoredBy::Force)
    }

    /// The law of a recorded motion: the unloading branch has its shape, and the energy of the
    /// line of the unloading stiffness from where the motion turned, at `turned_m`. The envelope may go on from there.
    ///
    /// A recorded force oscillates, but the energy stored in a structure does not.
    /// Therefore the storable energy is taken from the mean force `work/δ`, scaled to that
    /// energy at `turned_m`, and only bounded by `cδF`.
    fn recorded(
        envelope: Envelope,
        unloading: Unloading,
        shape: UnloadingShape,
        (turned_m, end): (f64, EnvelopeEnd),
    ) -> Self {
        let mean = envelope.work_to(turned_m) / turned_m;
        let scale = (mean / envelope.force_at(turned_m)).powi(2);
        let scale = if scale > 0.0 && scale.is_finite() { scale } else { 1.0 };
        Self::with(envelope, (unloading, scale), shape, end, StoredBy::MeanForce)
    }

    fn with(
        envelope: Envelope,
        (unloading, scale): (Unloading, f64),
        shape: UnloadingShape,
        end: EnvelopeEnd,
        stored_by: StoredBy,
    ) -> Self {
        let envelope = envelope.pushing();
        let (d, f, work_j) = (envelope.deflection_m(), envelope.force_n(), envelope.work_j());
        let n = d.len();
        let mut slope_n_per_m: Vec<f64> =
            (1..n).map(|i| (f[i] - f[i - 1]) / (d[i] - d[i - 1])).collect();
        slope_n_per_m.push(match end {
            EnvelopeEnd::Slope | EnvelopeEnd::Bottom => slope_n_per_m[n - 2].max(0.0),
            EnvelopeEnd::Hold | EnvelopeEnd::Error => 0.0,
        });
        let mut sum_jm = vec![0.0; n];
        for i in 1..n {
            let step = d[i] - d[i - 1];
            let along = work_j[i - 1] + (f[i - 1] / 3.0 + f[i] / 6.0) * step;
            sum_jm[i] = sum_jm[i - 1] + along * step;
        }
        let memory = match unloading {
            Unloading::Elastic => None,
            Unloading::Memory { stiffness_n_per_m } => {
                let points = (0..n).map(|i| OnEnvelope {
                    piece: i,
                    deflection_m: d[i],
                    force_n: f[i],
                    work_j: work_j[i],
                });
                let (steepest, share) = (envelope.max_slope(), shape.share().min(0.5));
                Some(Memory::new((stiffness_n_per_m, scale), steepest, share, stored_by, points))
            }
        };
        let data_end_m = envelope.end_m();
        Self { envelope, shape, end, data_end_m, slope_n_per_m, sum_jm, memory }
    }

    /// The loading branch.
    pub fn envelope(&self) -> &Envelope {
        &self.envelope
    }

    /// Whether the maximum deflection changes the force.
    pub(super) fn has_memory(&self) -> bool {
        self.memory.is_some()
    }

    /// Whether the run may not go to this deflection.
    pub(super) fn is_beyond_end(&self, deflection_m: f64) -> bool {
        self.end == EnvelopeEnd::Error && deflection_m > self.end_m()
    }

    /// Deflection at which the envelope's data end, in m.
    pub(crate) fn end_m(&self) -> f64 {
        self.data_end_m
    }

    /// The same with data up to this deflection only, in m.
    fn with_data_to(self, data_end_m: Option<f64>) -> Self {
        let end_m = self.envelope.end_m();
        Self { data_end_m: data_end_m.map_or(end_m, |m| m.min(end_m)), ..self }
    }

    /// Largest stiffness that an integrator meets, in N/m.
    pub(super) fn max_stiffness_n_per_m(&self) -> f64 {
        match &self.memory {
            None => self.slope_n_per_m.iter().map(|s| s.abs()).fold(0.0, f64::max),
            // Line of stiffness k: slope k. Shape: k × 2 share × its steepest fall.
            Some(memory) => {
                let line = 2.0 * self.shape.share() * self.shape.steepest();
                memory.steepest_n_per_m * line.max(1.0)
            }
        }
    }

    /// Force on the loading branch, in N, at `deflection_m` of 0 or more.
    pub(super) fn envelope_n(&self, deflection_m: f64) -> f64 {
        self.on_envelope(self.piece_index(0, deflection_m), deflection_m).force_n
    }

    /// Force in N at `deflection_m` after the deflection has once been `largest_m`
    /// (`largest_m ≥ deflection_m`, `largest_m ≥ 0`).
    pub fn force_n(&self, deflection_m: f64, largest_m: f64) -> f64 {
        if deflection_m <= 0.0 {
            return 0.0;
        }
        if !self.has_memory() || deflection_m >= largest_m {
            return self.envelope_n(deflection_m);
        }
        let branch = self.branch(self.piece_index(0, largest_m), largest_m);
        let piece = self.branch_piece(&branch, deflection_m);
        (piece.at_zero_n + piece.slope_n_per_m * deflection_m).max(0.0)
    }

    /// Stored and dissipated energy in J at `deflection_m` after the deflection has once been
    /// `largest_m`. Their sum is the work done so far.
    pub fn energies_j(&self, deflection_m: f64, largest_m: f64) -> (f64, f64) {
        let largest_m = largest_m.max(deflection_m);
        if largest_m <= 0.0 {
            return (0.0, 0.0); // never in contact
        }
        if !self.has_memory() {
            let d = deflection_m.max(0.0);
            return (self.on_envelope(self.piece_index(0, d), d).work_j, 0.0);
        }
        let branch = self.branch(self.piece_index(0, largest_m), largest_m);
        (self.stored_on_j(&branch, deflection_m), branch.dissipated_j)
    }
}

/// A point of the envelope in one of its pieces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct OnEnvelope {
    pub piece: usize,
    pub deflection_m: f64,
    pub force_n: f64,
    /// Work done up to here.
    pub work_j: f64,
}

/// The unloading branch from the maximum deflection so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Branch {
    pub largest_m: f64,
    pub top_n: f64,
    pub stored_j: f64,
    pub dissipated_j: f64,
    /// Deflection returned until the force is zero.
    pub length_m: f64,
    /// Integral of the work over the deflection up to the top.
    pub sum_jm: f64,
}

/// A straight piece of the law: `F = at_zero_n + slope δ` between two deflections.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    /// −∞ where the interface is open.
    pub from_m: f64,
    pub to_m: f64,
    pub at_zero_n: f64,
    pub slope_n_per_m: f64,
    pub known: Known,
}

/// A point of a piece, and the work done up to it: what is stored and dissipated there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Known {
    pub deflection_m: f64,
    pub force_n: f64,
    pub work_j: f64,
    /// Integral of the work over the deflection, from 0 along the envelope.
    pub sum_jm: f64,
}

impl Piece {
    /// No force up to a deflection, after this work with this integral.
    pub(crate) fn open_to(to_m: f64, work_j: f64, sum_jm: f64) -> Self {
        let known = Known { deflection_m: to_m, force_n: 0.0, work_j, sum_jm };
        Self { from_m: f64::NEG_INFINITY, to_m, at_zero_n: 0.0, slope_n_per_m: 0.0, known }
    }

    /// Whether the interface is open here.
    pub(crate) fn is_open(&self) -> bool {
        self.from_m == f64::NEG_INFINITY
    }

    /// Whether it has no force.
    pub(crate) fn is_idle(&self) -> bool {
        self.slope_n_per_m == 0.0 && self.at_zero_n == 0.0
    }
}

/// A law as straight pieces, along which the engine steps.
impl ForceLaw {
    /// Index of the envelope's piece that holds δ ≥ 0, searched from a piece near by; the last
    /// one reaches beyond the end.
    #[inline]
    pub(super) fn piece_index(&self, near: usize, deflection_m: f64) -> usize {
        let d = self.envelope.deflection_m();
        let mut i = near.min(d.len() - 1);
        // A step moves by a piece or two; from far away the search halves.
        for _ in 0..4 {
            if i + 1 < d.len() && deflection_m >= d[i + 1] {
                i += 1;
            } else if i > 0 && deflection_m < d[i] {
                i -= 1;
            } else {
                return i;
            }
        }
        d.partition_point(|&d| d <= deflection_m).max(1) - 1
    }

    #[inline(always)]
    pub(super) fn envelope_piece(&self, i: usize) -> Piece {
        let (d, f) = (self.envelope.deflection_m(), self.envelope.force_n());
        let slope_n_per_m = self.slope_n_per_m[i];
        Piece {
            from_m: d[i],
            to_m: d.get(i + 1).copied().unwrap_or(f64::INFINITY),
            at_zero_n: f[i] - slope_n_per_m * d[i],
            slope_n_per_m,
            known: Known {
                deflection_m: d[i],
                force_n: f[i],
                work_j: self.envelope.work_j()[i],
                sum_jm: self.sum_jm[i],
            },
        }
    }

    /// Peak force of the envelope's points `from..=to`.
    #[inline(always)]
    pub(super) fn peak_between_n(&self, from: usize, to: usize) -> f64 {
        self.envelope.force_n()[from..=to].iter().copied().fold(0.0, f64::max)
    }

    /// The point of the envelope at δ ≥ 0 in piece `i`.
    fn on_envelope(&self, i: usize, deflection_m: f64) -> OnEnvelope {
        let (d, f) = (self.envelope.deflection_m()[i], self.envelope.force_n()[i]);
        let along = (deflection_m - d).max(0.0);
        let force_n = f + self.slope_n_per_m[i] * along;
        let work_j = self.envelope.work_j()[i] + 0.5 * (f + force_n) * along;
        OnEnvelope { piece: i, deflection_m, force_n, work_j }
    }

    /// Energy that is returned from a point of the envelope: all of it without memory.
    #[inline]
    pub(super) fn stored_j(&self, top: &OnEnvelope) -> f64 {
        self.memory.as_ref().map_or(top.work_j, |memory| memory.stored_j(top))
    }

    /// The unloading branch from δ in piece `i` of the envelope.
    pub(super) fn branch(&self, i: usize, largest_m: f64) -> Branch {
        let top = self.on_envelope(i, largest_m);
        let (top_n, stored_j) = (top.force_n, self.stored_j(&top));
        let length_m = if self.has_memory() && top_n > 0.0 && stored_j > 0.0 {
            stored_j / (top_n * self.shape.share())
        } else {
            0.0
        };
        let (i_m, i_n) = (self.envelope.deflection_m()[i], self.envelope.force_n()[i]);
        let along = largest_m - i_m;
        let sum_jm = self.sum_jm[i]
            + (self.envelope.work_j()[i] + (i_n / 3.0 + top_n / 6.0) * along) * along;
        Branch { largest_m, top_n, stored_j, dissipated_j: top.work_j - stored_j, length_m, sum_jm }
    }

    /// Integral of the work over the deflection up to point `j` of a branch.
    fn sum_on_jm(&self, branch: &Branch, j: usize) -> f64 {
        let Branch { stored_j, dissipated_j, length_m, sum_jm, .. } = *branch;
        let shape = &self.shape;
        let stored = stored_j * shape.rest_so_far[j] / shape.share();
        sum_jm - length_m * (stored + dissipated_j * shape.length[j])
    }

    /// The piece of an unloading branch that holds δ below its top.
    pub(super) fn branch_piece(&self, branch: &Branch, deflection_m: f64) -> Piece {
        let zero_m = branch.largest_m - branch.length_m;
        if deflection_m <= zero_m || branch.length_m <= 0.0 {
            let sum_jm = self.sum_on_jm(branch, self.shape.length.len() - 1);
            return Piece::open_to(zero_m.max(0.0), branch.dissipated_j, sum_jm);
        }
        let shape = &self.shape;
        let j = shape.piece((branch.largest_m - deflection_m) / branch.length_m);
        let at = |j: usize| branch.largest_m - shape.length[j] * branch.length_m;
        let slope_n_per_m = -shape.slope(j) * branch.top_n / branch.length_m;
        Piece {
            from_m: at(j + 1),
            to_m: if j == 0 { branch.largest_m } else { at(j) },
            at_zero_n: branch.top_n * shape.force[j] - slope_n_per_m * at(j),
            slope_n_per_m,
            known: Known {
                deflection_m: at(j + 1),
                force_n: branch.top_n * shape.force[j + 1],
                work_j: branch.dissipated_j + branch.stored_j * shape.rest[j + 1] / shape.share(),
                sum_jm: self.sum_on_jm(branch, j + 1),
            },
        }
    }

    /// Stored energy at δ on an unloading branch, in J.
    fn stored_on_j(&self, branch: &Branch, deflection_m: f64) -> f64 {
        if branch.length_m <= 0.0 {
            return 0.0;
        }
        let length = (branch.largest_m - deflection_m.max(0.0)) / branch.length_m;
        if length >= 1.0 {
            return 0.0;
        }
        branch.stored_j * self.shape.rest_at(length) / self.shape.share()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law(unloading: Unloading) -> ForceLaw {
        let envelope = Envelope::new(vec![0.0, 0.1, 0.5], vec![0.0, 1e6, 0.6e6]).unwrap();
        ForceLaw::new(envelope, unloading, EnvelopeEnd::Hold)
    }

    #[test]
    fn unloads_and_reloads_on_one_line() {
        let law = law(Unloading::Memory { stiffness_n_per_m: 40e6 });
        let top = law.force_n(0.3, 0.3);
        assert_eq!(top, 0.8e6);
        assert!((law.force_n(0.29, 0.3) - 0.4e6).abs() < 1e-6);
        assert!(law.force_n(0.28, 0.3) < 1e-6, "residual crush is 0.28 m");
        assert_eq!(law.force_n(0.1, 0.3), 0.0);
        assert_eq!(law.force_n(-0.1, 0.3), 0.0);
    }

    #[test]
    fn stored_and_dissipated_add_up_to_the_work_done() {
        let law = law(Unloading::Memory { stiffness_n_per_m: 40e6 });
        let (stored, dissipated) = law.energies_j(0.3, 0.3);
        assert!((stored + dissipated - (0.05e6 + 0.18e6)).abs() < 1e-6);
        assert!((stored - 0.8e6 * 0.8e6 / 80e6).abs() < 1e-6);
        let (stored, same) = law.energies_j(0.2, 0.3);
        assert_eq!((stored, same), (0.0, dissipated));
    }

    /// Softer than the rise of the spike: the rebound at the end follows the requested stiffness
    /// for, and on the way there no step of the deflection gives energy back.
    #[test]
    fn soft_unloading_never_creates_energy() {
        let envelope =
            || Envelope::new(vec![0.0, 0.01, 0.02, 0.5], vec![0.0, 3e6, 1e6, 2e6]).unwrap();
        let with = |stiffness_n_per_m| {
            let unloading = Unloading::Memory { stiffness_n_per_m };
            ForceLaw::new(envelope(), unloading, EnvelopeEnd::Hold)
        };
        let soft = with(40e6);
        assert_eq!(soft.max_stiffness_n_per_m(), 300e6);
        let (stored, _) = soft.energies_j(0.4, 0.4);
        let top = soft.force_n(0.4, 0.4);
        assert!((stored - top * top / 80e6).abs() < 1e-6, "on its own line at the end");
        let mut before = 0.0;
        for i in 1..=600 {
            let largest = 1e-3 * f64::from(i);
            let (stored, dissipated) = soft.energies_j(largest, largest);
            assert!(dissipated >= before - 1e-9, "at {largest} m");
            let line = with(300e6).energies_j(largest, largest);
            assert!(stored >= line.0 - 1e-9 && dissipated <= line.1 + 1e-9);
            before = dissipated;
            // What is stored comes back on the way to zero deflection, all of it.
            let steps = 20_000;
            let at = |k: i32| largest * f64::from(k) / f64::from(steps);
            let force = |k: i32| soft.force_n(at(k).max(1e-15), largest);
            let work: f64 =
                (0..steps).map(|k| 0.5 * (force(k) + force(k + 1)) * (at(k + 1) - at(k))).sum();
            assert!((work - stored).abs() < 1e-3 * stored, "{work} of {stored} at {largest} m");
        }
    }

    #[test]
    fn ends_of_the_envelope() {
        let envelope = || Envelope::new(vec![0.0, 1.0], vec![0.0, 1.0]).unwrap();
        let hold = ForceLaw::new(envelope(), Unloading::Elastic, EnvelopeEnd::Hold);
        assert_eq!(hold.force_n(3.0, 3.0), 1.0);
        let slope = ForceLaw::new(envelope(), Unloading::Elastic, EnvelopeEnd::Slope);
        assert_eq!(slope.force_n(3.0, 3.0), 3.0);
        assert_eq!(slope.energies_j(3.0, 3.0).0, 4.5);
        let error = ForceLaw::new(envelope(), Unloading::Elastic, EnvelopeEnd::Error);
        assert!(error.is_beyond_end(1.1) && !error.is_beyond_end(1.0));
    }
}
