//! Work of the contacts, needed only for outputs and corrections: exact from the laws' tables.

use super::super::law::{OnEnvelope, Piece};
use super::super::rows::{LANES, LaneIndex, Row, Rows, each, larger};
use super::contact::{Contact, Stage};
use super::{Contacts, StepPoint};

/// A point of the current piece of a row of interfaces and the work done up to it; the maximum
/// deflection and what is dissipated once the deflection has fallen from there.
#[derive(Clone, Debug)]
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
    pub(crate) fn none() -> Self {
        let zero = [0.0; LANES];
        Self {
            known_m: zero,
            known_n: zero,
            known_j: zero,
            known_jm: zero,
            largest_m: zero,
            dissipated_j: zero,
        }
    }

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
