//! One interface on its law: its current branch, what happens when it leaves a segment, and its work, exact from the law's tables.

use super::{Contacts, StepPoint};
use crate::multibody::law::{Branch, ForceLaw, OnEnvelope, Piece};
use crate::multibody::rows::{LANES, LaneIndex, Row, Rows, each, larger};

/// Where an interface is on its law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    /// At the maximum deflection so far.
    Loading,
    /// Below it: on an unloading branch, open, or not yet in contact.
    Below,
}

/// What changes seldom at an interface.
#[derive(Clone, Debug)]
pub(super) struct Contact {
    pub stage: Stage,
    /// Piece of the envelope near the maximum deflection; while loading, the current one.
    pub index: usize,
    /// From the maximum deflection, once the deflection has fallen.
    pub branch: Branch,
    /// Largest force, up to the end of the last step but one.
    pub peak_n: f64,
}

/// What happened when an interface left a segment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in super::super) struct Move {
    /// From no force or an unloading branch to a new maximum deflection.
    pub loads: bool,
    /// From no contact to some, at this deflection.
    pub closed_m: Option<f64>,
    /// The force has begun, at this deflection.
    pub pressed_m: Option<f64>,
    /// The force has fallen to zero, at this deflection.
    pub released_m: Option<f64>,
    /// From contact to none.
    pub opened: bool,
}

impl Move {
    /// This and what happened later in the same step.
    pub(crate) fn then(self, later: Self) -> Self {
        Self {
            loads: self.loads || later.loads,
            closed_m: self.closed_m.or(later.closed_m),
            pressed_m: self.pressed_m.or(later.pressed_m),
            released_m: self.released_m.or(later.released_m),
            opened: self.opened || later.opened,
        }
    }
}

impl Contact {
    /// An interface that has never been in contact.
    pub(crate) fn open() -> Self {
        Self { stage: Stage::Below, index: 0, branch: Branch::default(), peak_n: 0.0 }
    }

    /// The piece of the envelope that holds a new maximum deflection.
    #[inline(always)]
    pub(crate) fn load(&mut self, law: &ForceLaw, deflection_m: f64) -> Piece {
        let before = self.index;
        self.index = law.piece_index(before, deflection_m);
        let passed_n = law.peak_between_n(before, self.index);
        if passed_n > self.peak_n {
            self.peak_n = passed_n;
        }
        self.stage = Stage::Loading;
        Piece { from_m: deflection_m, ..law.envelope_piece(self.index) }
    }

    /// From here on the deflection is below its largest.
    pub(crate) fn turn(&mut self, law: &ForceLaw, largest_m: f64) {
        let before = self.index;
        self.index = law.piece_index(before, largest_m);
        self.branch = law.branch(self.index, largest_m);
        let passed_n = law.peak_between_n(before.min(self.index), self.index);
        self.peak_n = self.peak_n.max(self.branch.top_n).max(passed_n);
        self.stage = Stage::Below;
    }

    /// The piece that holds a deflection after a stretch below the largest: the envelope's if it
    /// is a new largest one.
    pub(crate) fn unload_or_load(&mut self, law: &ForceLaw, deflection_m: f64) -> Piece {
        if deflection_m > 0.0 && deflection_m >= self.branch.largest_m {
            return self.load(law, deflection_m);
        }
        match law.has_memory() {
            true => law.branch_piece(&self.branch, deflection_m),
            false if deflection_m <= 0.0 => Piece::open_to(0.0, 0.0, 0.0),
            false => {
                let piece = law.envelope_piece(law.piece_index(self.index, deflection_m));
                Piece { to_m: piece.to_m.min(self.branch.largest_m), ..piece }
            }
        }
    }
}

/// A point of the current piece of a row of interfaces and the work done up to it; the maximum
/// deflection and what is dissipated once the deflection has fallen from there.
#[derive(Clone, Debug, Default)]
pub(super) struct Totals {
    known_m: Row,
    known_n: Row,
    known_j: Row,
    known_jm: Row,
    /// −∞ while loading.
    largest_m: Row,
    dissipated_j: Row,
}

impl Totals {
    #[inline(always)]
    pub(crate) fn set(&mut self, lane: usize, contact: &Contact, piece: &Piece) {
        self.known_m[lane] = piece.known.deflection_m;
        self.known_n[lane] = piece.known.force_n;
        self.known_j[lane] = piece.known.work_j;
        self.known_jm[lane] = piece.known.sum_jm;
        match contact.stage {
            Stage::Loading => self.largest_m[lane] = f64::NEG_INFINITY,
            Stage::Below => {
                self.largest_m[lane] = contact.branch.largest_m;
                self.dissipated_j[lane] = contact.branch.dissipated_j;
            }
        }
    }
}

impl Contacts<'_> {
    /// Work done at an interface so far in J (what is stored and dissipated, from the law's
    /// tables), and its integral over the deflection in J m.
    #[inline(always)]
    pub(crate) fn work(&self, at: StepPoint, slot: LaneIndex) -> (f64, f64) {
        let (totals, lane) = (&self.totals[slot.row()], slot.lane());
        let along = self.deflections_m(at)[slot] - totals.known_m[lane];
        let (known, force) = (totals.known_n[lane], self.forces_n(at)[slot]);
        let work_j = totals.known_j[lane] + 0.5 * (known + force) * along;
        let mean_j = totals.known_j[lane] + (2.0 * known + force) * (1.0 / 6.0) * along;
        (work_j, totals.known_jm[lane] + mean_j * along)
    }

    /// The work of all interfaces, into `out_j`.
    #[inline(always)]
    pub(crate) fn works_j<const N: usize>(&self, out_j: &mut Rows) {
        let n = self.fixed.layout.known::<N>();
        let (d, f) =
            (self.deflections_m(StepPoint::End).values(n), self.forces_n(StepPoint::End).values(n));
        let (all, out) = (&self.totals[..n], out_j.values_mut(n));
        for c in 0..n {
            let Totals { known_m, known_n, known_j, .. } = &all[c];
            out[c] = each(|j| known_j[j] + 0.5 * (known_n[j] + f[c][j]) * (d[c][j] - known_m[j]));
        }
    }

    /// Largest deflections so far (0 before contact), and what of the work of all interfaces is
    /// dissipated.
    #[inline(always)]
    pub(crate) fn largest_and_dissipated<const N: usize>(
        &self,
        work_j: &Rows,
        largest_m: &mut Rows,
        lost_j: &mut Rows,
    ) {
        let n = self.fixed.layout.known::<N>();
        let (d, f) =
            (self.deflections_m(StepPoint::End).values(n), self.forces_n(StepPoint::End).values(n));
        let (largest, lost) = (largest_m.values_mut(n), lost_j.values_mut(n));
        let (all, work_j) = (&self.totals[..n], work_j.values(n));
        for c in 0..n {
            let totals = &all[c];
            largest[c] = larger(larger(d[c], totals.largest_m), [0.0; LANES]);
            lost[c] = totals.dissipated_j;
            for j in 0..LANES {
                if totals.largest_m[j] == f64::NEG_INFINITY {
                    let k = self.fixed.layout.index(LaneIndex::new(c, j));
                    let Some(law) = self.fixed.laws[k] else { continue };
                    let (deflection_m, force_n, work_j) = (d[c][j], f[c][j], work_j[c][j]);
                    let piece = self.contacts[k].index;
                    let top = OnEnvelope { piece, deflection_m, force_n, work_j };
                    lost[c][j] = work_j - law.stored_j(&top);
                }
            }
        }
    }
}
