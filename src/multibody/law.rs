//! Force law of an interface: elastic, or elastic-plastic with memory.

use crate::curve::Envelope;

/// What happens when the deflection falls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unloading {
    /// The envelope is followed back (the reference model, which has no memory).
    Elastic,
    /// A straight line of this stiffness in N/m; reloading follows it back up. Where the
    /// envelope rises more steeply than that, the line is stiffer: see [`ForceLaw`].
    Memory { stiffness_n_per_m: f64 },
}

/// What the force does beyond the envelope's last point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EnvelopeEnd {
    /// The last force is held.
    Hold,
    /// The last segment is continued if it rises, else the last force is held.
    Slope,
    /// The run ends with an error that names the interface.
    Error,
}

/// Shape of an unloading branch: share of the force at the top over the share of the
/// branch's length that has been given back.
///
/// Invariant: shares of the length rise from 0 to 1, those of the force are at least 0, begin
/// at 1 and end at 0.
#[derive(Clone, Debug, PartialEq)]
pub struct UnloadingShape {
    length: Vec<f64>,
    force: Vec<f64>,
    /// `∫` from each point to the end; the first is the share of `F δ` that is given back.
    rest: Vec<f64>,
    /// `∫` of `rest` from the first point to each.
    rest_so_far: Vec<f64>,
}

impl UnloadingShape {
    /// The straight line.
    pub fn line() -> Self {
        Self::of(vec![0.0, 1.0], vec![1.0, 0.0])
    }

    fn of(length: Vec<f64>, force: Vec<f64>) -> Self {
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
        Some(Self::of(length, points.iter().map(|p| p.1).collect()))
    }

    /// Share of force × length that is given back: ½ for the line.
    fn share(&self) -> f64 {
        self.rest[0]
    }

    fn piece(&self, length: f64) -> usize {
        let above = self.length.partition_point(|&s| s <= length);
        above.clamp(1, self.length.len() - 1) - 1
    }

    fn slope(&self, j: usize) -> f64 {
        (self.force[j + 1] - self.force[j]) / (self.length[j + 1] - self.length[j])
    }

    /// Steepest fall, 1 for the line.
    fn steepest(&self) -> f64 {
        (0..self.length.len() - 1).map(|j| self.slope(j).abs()).fold(0.0, f64::max)
    }
}

/// Force over deflection at an interface.
///
/// Invariant: with memory, the dissipated energy never falls while the deflection grows, so
/// that no deflection creates energy. One stiffness `k` for all deflections keeps to this
/// only if it is at least the envelope's steepest rise `k_s`: FE curves begin with a spike
/// whose flank is far steeper than the line on which the vehicle rebounds at the end, and
/// one stiff line for both would lose most of the rebound. Therefore the branch from δ stores
/// `U = max(A − D, S(k_s))` with `S(k) = F_e min(F_e/2k, cδ)` and
/// `D = max over s ≤ δ of A(s) − S(k)(s)`, not below 0; `c = ½` for a straight line, whose
/// stiffness is `F_e²/2U`, and less for a shape that gives back less. The bound `cδF_e` keeps
/// the branch from reaching zero deflection with a force left, whose energy would be lost.
/// With `k ≥ k_s` and an envelope from (0, 0) this is the law of one stiffness.
#[derive(Clone, Debug, PartialEq)]
pub struct ForceLaw {
    envelope: Envelope,
    unloading: Unloading,
    shape: UnloadingShape,
    end: EnvelopeEnd,
    /// Slope of the piece from each point of the envelope on; the last one beyond the end.
    slope_n_per_m: Vec<f64>,
    /// Steepest rise of the envelope, or the unloading stiffness if that is more.
    steepest_n_per_m: f64,
    /// Integral of the work over the deflection at each point of the envelope.
    sum_jm: Vec<f64>,
    /// `D` at each point of the envelope, in J; empty without memory.
    dissipated_j: Vec<f64>,
    /// Whether the mean force so far, not the force itself, tells what is stored.
    by_mean: bool,
}

/// The unloading branch from the largest deflection so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Branch {
    pub largest_m: f64,
    pub top_n: f64,
    pub stored_j: f64,
    pub dissipated_j: f64,
    /// Deflection given back until the force is zero.
    pub length_m: f64,
    /// Integral of the work over the deflection up to the top.
    pub sum_jm: f64,
}

/// A straight piece of the law: `F = at_zero_n + slope δ` between two deflections.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
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
    pub fn open_to(to_m: f64, work_j: f64, sum_jm: f64) -> Self {
        let known = Known { deflection_m: to_m, force_n: 0.0, work_j, sum_jm };
        Self { from_m: f64::NEG_INFINITY, to_m, at_zero_n: 0.0, slope_n_per_m: 0.0, known }
    }

    /// Whether it has no force.
    pub fn is_idle(&self) -> bool {
        self.slope_n_per_m == 0.0 && self.at_zero_n == 0.0
    }
}

impl ForceLaw {
    /// Forces below zero become zero, because an interface only pushes.
    pub fn new(envelope: Envelope, unloading: Unloading, end: EnvelopeEnd) -> Self {
        Self::with(envelope, unloading, UnloadingShape::line(), end, false)
    }

    /// The same with an unloading branch that is no straight line; its energy is that of the
    /// line of the unloading stiffness.
    pub fn shaped(
        envelope: Envelope,
        unloading: Unloading,
        shape: UnloadingShape,
        end: EnvelopeEnd,
    ) -> Self {
        Self::with(envelope, unloading, shape, end, false)
    }

    /// The law of a recorded motion: the unloading branch has its shape, and the energy of the
    /// line of the unloading stiffness from the envelope's end.
    ///
    /// A recorded force swings, and what a structure has stored does not swing with it.
    /// Therefore `S` is taken from the mean force `A(δ)/δ`, scaled to that energy at the end,
    /// and only bounded by `cδF_e`.
    pub fn recorded(
        envelope: Envelope,
        unloading: Unloading,
        shape: UnloadingShape,
        end: EnvelopeEnd,
    ) -> Self {
        let unloading = match unloading {
            Unloading::Elastic => unloading,
            Unloading::Memory { stiffness_n_per_m } => {
                let (top, end_m) = (envelope.force_at(envelope.end_m()), envelope.end_m());
                let mean = envelope.work() / end_m;
                let scale = (mean / top).powi(2);
                let scale = if scale > 0.0 && scale.is_finite() { scale } else { 1.0 };
                Unloading::Memory { stiffness_n_per_m: stiffness_n_per_m * scale }
            }
        };
        Self::with(envelope, unloading, shape, end, true)
    }

    fn with(
        envelope: Envelope,
        unloading: Unloading,
        shape: UnloadingShape,
        end: EnvelopeEnd,
        by_mean: bool,
    ) -> Self {
        let envelope = envelope.pushing();
        let n = envelope.deflection_m().len();
        let (d, f) = (envelope.deflection_m(), envelope.force_n());
        let mut slope_n_per_m: Vec<f64> =
            (1..n).map(|i| (f[i] - f[i - 1]) / (d[i] - d[i - 1])).collect();
        slope_n_per_m.push(match end {
            EnvelopeEnd::Slope => slope_n_per_m[n - 2].max(0.0),
            EnvelopeEnd::Hold | EnvelopeEnd::Error => 0.0,
        });
        let mut sum_jm = vec![0.0; n];
        for i in 1..n {
            let step = d[i] - d[i - 1];
            let along = envelope.work_j()[i - 1] + (f[i - 1] / 3.0 + f[i] / 6.0) * step;
            sum_jm[i] = sum_jm[i - 1] + along * step;
        }
        let steepest_n_per_m = match unloading {
            Unloading::Elastic => envelope.max_slope(),
            Unloading::Memory { stiffness_n_per_m } => envelope.max_slope().max(stiffness_n_per_m),
        };
        let mut law = Self {
            envelope,
            unloading,
            shape,
            end,
            slope_n_per_m,
            steepest_n_per_m,
            sum_jm,
            dissipated_j: Vec::new(),
            by_mean,
        };
        if let Unloading::Memory { stiffness_n_per_m } = unloading {
            let mut most = 0.0_f64;
            for i in 0..n {
                let (d, f) = (law.envelope.deflection_m()[i], law.envelope.force_n()[i]);
                let work = law.envelope.work_j()[i];
                most = most.max(work - law.stored_by_rule(d, f, work, stiffness_n_per_m));
                law.dissipated_j.push(most);
            }
        }
        law
    }

    /// `S`: energy that a branch of this stiffness, or the stiffer one to (0, 0), can store.
    fn storable(&self, deflection_m: f64, force_n: f64, stiffness_n_per_m: f64) -> f64 {
        let bound = self.shape.share().min(0.5) * deflection_m;
        force_n * (0.5 * force_n / stiffness_n_per_m).min(bound)
    }

    /// `S` by the law's rule.
    fn stored_by_rule(&self, deflection_m: f64, force_n: f64, work_j: f64, stiffness: f64) -> f64 {
        if !self.by_mean {
            return self.storable(deflection_m, force_n, stiffness);
        }
        let mean = if deflection_m > 0.0 { work_j / deflection_m } else { 0.0 };
        (0.5 * mean * mean / stiffness).min(work_j)
    }

    pub fn unloading(&self) -> Unloading {
        self.unloading
    }

    /// Whether the largest deflection changes the force.
    pub(super) fn has_memory(&self) -> bool {
        matches!(self.unloading, Unloading::Memory { .. })
    }

    /// Whether the run may not go to this deflection.
    pub fn is_beyond_end(&self, deflection_m: f64) -> bool {
        self.end == EnvelopeEnd::Error && deflection_m > self.envelope.end_m()
    }

    /// Deflection at which the envelope's table ends, in m.
    pub fn end_m(&self) -> f64 {
        self.envelope.end_m()
    }

    /// Largest stiffness the integrator meets, in N/m.
    pub fn max_stiffness_n_per_m(&self) -> f64 {
        match self.unloading {
            Unloading::Elastic => self.slope_n_per_m.iter().map(|s| s.abs()).fold(0.0, f64::max),
            // Line of stiffness k: slope k. Shape: k × 2 share × its steepest fall.
            Unloading::Memory { .. } => {
                self.steepest_n_per_m * (2.0 * self.shape.share() * self.shape.steepest()).max(1.0)
            }
        }
    }

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

    /// Piece `i` of the envelope.
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

    /// Largest force of the envelope's points `from..=to`.
    #[inline(always)]
    pub(super) fn peak_between_n(&self, from: usize, to: usize) -> f64 {
        self.envelope.force_n()[from..=to].iter().copied().fold(0.0, f64::max)
    }

    /// Force and work on the envelope at δ ≥ 0 in piece `i`, in N and J.
    fn on_envelope(&self, i: usize, deflection_m: f64) -> (f64, f64) {
        let (d, f) = (self.envelope.deflection_m()[i], self.envelope.force_n()[i]);
        let along = (deflection_m - d).max(0.0);
        let force = f + self.slope_n_per_m[i] * along;
        (force, self.envelope.work_j()[i] + 0.5 * (f + force) * along)
    }

    /// The unloading branch from δ in piece `i` of the envelope.
    pub(super) fn branch(&self, i: usize, largest_m: f64) -> Branch {
        let (top_n, work) = self.on_envelope(i, largest_m);
        let stored_j = self.stored_j(i, largest_m, top_n, work);
        let length_m = match self.has_memory() && top_n > 0.0 && stored_j > 0.0 {
            true => stored_j / (top_n * self.shape.share()),
            false => 0.0, // the envelope itself has no force here
        };
        let (i_m, i_n) = (self.envelope.deflection_m()[i], self.envelope.force_n()[i]);
        let along = largest_m - i_m;
        let sum_jm = self.sum_jm[i]
            + (self.envelope.work_j()[i] + (i_n / 3.0 + top_n / 6.0) * along) * along;
        Branch { largest_m, top_n, stored_j, dissipated_j: work - stored_j, length_m, sum_jm }
    }

    /// Integral of the work over the deflection up to point `j` of a branch.
    fn sum_on_jm(&self, branch: &Branch, j: usize) -> f64 {
        let Branch { stored_j, dissipated_j, length_m, sum_jm, .. } = *branch;
        let shape = &self.shape;
        let stored = stored_j * shape.rest_so_far[j] / shape.share();
        sum_jm - length_m * (stored + dissipated_j * shape.length[j])
    }

    /// Energy that would come back from δ in piece `i` of the envelope, with force and work there.
    #[inline]
    pub(super) fn stored_j(&self, i: usize, largest_m: f64, top_n: f64, work_j: f64) -> f64 {
        let Unloading::Memory { stiffness_n_per_m } = self.unloading else { return work_j };
        // Within a piece A − S is monotone for either bound, so its ends and δ decide.
        let stored = self.stored_by_rule(largest_m, top_n, work_j, stiffness_n_per_m);
        let dissipated = self.dissipated_j[i].max(work_j - stored);
        let least = self.storable(largest_m, top_n, self.steepest_n_per_m);
        let stored = (work_j - dissipated).max(least);
        match self.by_mean {
            true => stored.min(top_n * self.shape.share().min(0.5) * largest_m),
            false => stored,
        }
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
    fn stored_on(&self, branch: &Branch, deflection_m: f64) -> f64 {
        if branch.length_m <= 0.0 {
            return 0.0;
        }
        let length = (branch.largest_m - deflection_m.max(0.0)) / branch.length_m;
        if length >= 1.0 {
            return 0.0;
        }
        let shape = &self.shape;
        let j = shape.piece(length);
        let along = shape.length[j + 1] - length;
        let force = shape.force[j + 1] - shape.slope(j) * along;
        let rest = shape.rest[j + 1] + 0.5 * (shape.force[j + 1] + force) * along;
        branch.stored_j * rest / shape.share()
    }

    /// Stored and dissipated energy in J at δ on the branch (at its top: `δ = largest`), with a
    /// piece of the envelope near by. Their sum is the work done so far.
    pub(super) fn energies_on_j(
        &self,
        near: usize,
        branch: &Branch,
        deflection_m: f64,
    ) -> (f64, f64) {
        match self.unloading {
            Unloading::Elastic if deflection_m <= 0.0 => (0.0, 0.0),
            Unloading::Elastic => {
                (self.on_envelope(self.piece_index(near, deflection_m), deflection_m).1, 0.0)
            }
            Unloading::Memory { .. } => (self.stored_on(branch, deflection_m), branch.dissipated_j),
        }
    }

    /// `F_e(δ)` on the loading branch, in N; `δ ≥ 0`.
    pub fn envelope_n(&self, deflection_m: f64) -> f64 {
        self.on_envelope(self.piece_index(0, deflection_m), deflection_m).0
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

    /// Stored and dissipated energy in J at a deflection, given the largest so far.
    pub fn energies_j(&self, deflection_m: f64, largest_m: f64) -> (f64, f64) {
        if largest_m <= 0.0 {
            return (0.0, 0.0); // never in contact
        }
        let i = self.piece_index(0, largest_m);
        self.energies_on_j(i, &self.branch(i, largest_m), deflection_m)
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

    /// Softer than the spike's flank: the rebound at the end follows the stiffness asked
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
