//! A law as straight pieces, along which the engine steps.

use super::ForceLaw;

/// A point of the envelope in one of its pieces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct OnEnvelope {
    pub piece: usize,
    pub deflection_m: f64,
    pub force_n: f64,
    /// Work done up to here.
    pub work_j: f64,
}

/// The unloading branch from the maximum deflection so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in super::super) struct Branch {
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
pub(in super::super) struct Piece {
    /// −∞ where the interface is open.
    pub from_m: f64,
    pub to_m: f64,
    pub at_zero_n: f64,
    pub slope_n_per_m: f64,
    pub known: Known,
}

/// A point of a piece, and the work done up to it: what is stored and dissipated there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct Known {
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

impl ForceLaw {
    /// Index of the envelope's piece that holds δ ≥ 0, searched from a piece near by; the last
    /// one reaches beyond the end.
    #[inline]
    pub(in super::super) fn piece_index(&self, near: usize, deflection_m: f64) -> usize {
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
    pub(in super::super) fn envelope_piece(&self, i: usize) -> Piece {
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
    pub(in super::super) fn peak_between_n(&self, from: usize, to: usize) -> f64 {
        self.envelope.force_n()[from..=to].iter().copied().fold(0.0, f64::max)
    }

    /// The point of the envelope at δ ≥ 0 in piece `i`.
    pub(super) fn on_envelope(&self, i: usize, deflection_m: f64) -> OnEnvelope {
        let (d, f) = (self.envelope.deflection_m()[i], self.envelope.force_n()[i]);
        let along = (deflection_m - d).max(0.0);
        let force_n = f + self.slope_n_per_m[i] * along;
        let work_j = self.envelope.work_j()[i] + 0.5 * (f + force_n) * along;
        OnEnvelope { piece: i, deflection_m, force_n, work_j }
    }

    /// Energy that is returned from a point of the envelope: all of it without memory.
    #[inline]
    pub(in super::super) fn stored_j(&self, top: &OnEnvelope) -> f64 {
        self.memory.as_ref().map_or(top.work_j, |memory| memory.stored_j(top))
    }

    /// The unloading branch from δ in piece `i` of the envelope.
    pub(in super::super) fn branch(&self, i: usize, largest_m: f64) -> Branch {
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
    pub(in super::super) fn branch_piece(&self, branch: &Branch, deflection_m: f64) -> Piece {
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
    pub(super) fn stored_on_j(&self, branch: &Branch, deflection_m: f64) -> f64 {
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
