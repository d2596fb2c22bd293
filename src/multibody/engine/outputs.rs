//! Outputs: the state at the end of each output interval, into the ledger and the histories.

use super::super::chain::Chain;
use super::super::contacts::StepPoint;
use super::super::rows::{LANES, Layout, Row, Rows, each, larger};
use super::super::run::{
    Account, Balance, BodyHistory, Grid, InterfaceHistory, Record, Run, diverged,
};
use super::state::Engine;
use crate::error::Error;

/// Outputs that are kept before they are appended to the histories: one history at a time is
/// written faster than one value of each.
const OUTPUTS: usize = 32;

type OfBody = fn(&mut BodyHistory) -> &mut Vec<f64>;
type OfInterface = fn(&mut InterfaceHistory) -> &mut Vec<f64>;

/// The histories that are kept. The moving mean needs the speeds in any case.
fn kinds(record: Record) -> (&'static [OfBody], &'static [OfInterface]) {
    const OF_BODY: [OfBody; 3] = [|b| &mut b.v_m_per_s, |b| &mut b.x_m, |b| &mut b.a_m_per_s2];
    const OF_INTERFACE: [OfInterface; 6] = [
        |i| &mut i.deflection_m,
        |i| &mut i.force_n,
        |i| &mut i.largest_deflection_m,
        |i| &mut i.stored_j,
        |i| &mut i.dissipated_j,
        |i| &mut i.damped_so_far_j,
    ];
    match record {
        Record::Histories => (&OF_BODY, &OF_INTERFACE),
        Record::Summary => (&OF_BODY[..1], &[]),
        Record::Closing => (&OF_BODY[..1], &OF_INTERFACE[..2]),
    }
}

/// What the outputs gather.
pub(super) struct OutputRecorder {
    account: Account,
    pub(super) record: Record,
    recent: Recent,
    /// Work of the interfaces, their largest deflections, what is dissipated.
    work_j: Rows,
    largest_m: Rows,
    dissipated_j: Rows,
    /// The same for couplings.
    pulled: [Rows; 3],
}

impl OutputRecorder {
    pub(crate) fn new(chain: &Chain, layout: &Layout, record: Record) -> Self {
        let zeros = || Rows::zeros(layout);
        let (of_body, of_interface) = kinds(record);
        let rows = (of_body.len() + of_interface.len()) * layout.rows();
        Self {
            account: Account::open(chain),
            record,
            recent: Recent { values: vec![[[0.0; LANES]; OUTPUTS]; rows], outputs: 0 },
            work_j: zeros(),
            largest_m: zeros(),
            dissipated_j: zeros(),
            pulled: std::array::from_fn(|_| zeros()),
        }
    }
}

/// The last values of the histories, by kind and place.
struct Recent {
    values: Vec<[Row; OUTPUTS]>,
    outputs: usize,
}

impl Recent {
    #[inline(always)]
    fn keep(&mut self, kind: usize, n: usize, row: impl Fn(usize) -> Row) {
        let output = self.outputs % OUTPUTS;
        for (c, recent) in self.values[kind * n..][..n].iter_mut().enumerate() {
            recent[output] = row(c);
        }
    }

    /// Appends the last values to the histories.
    fn flush(&mut self, record: Record, run: &mut Run, layout: &Layout) {
        let (of_body, of_interface) = kinds(record);
        let recent = |kind: usize, i: usize| {
            let slot = layout.of(i);
            let values = &self.values[kind * layout.rows() + slot.row()][..self.outputs];
            values.iter().map(move |row| row[slot.lane()])
        };
        for (i, body) in run.bodies.iter_mut().enumerate() {
            for (kind, of) in of_body.iter().enumerate() {
                of(body).extend(recent(kind, i));
            }
        }
        for (k, interface) in run.interfaces.iter_mut().enumerate() {
            for (kind, of) in of_interface.iter().enumerate() {
                of(interface).extend(recent(of_body.len() + kind, k));
            }
        }
        self.outputs = 0;
    }
}

impl Engine<'_> {
    /// Records the state, with `v` in step with `x`.
    #[inline(always)]
    pub(super) fn output<const N: usize>(
        &mut self,
        recorder: &mut OutputRecorder,
        run: &mut Run,
        time_s: f64,
    ) -> Result<(), Error> {
        let n = self.fixed.layout.known::<N>();
        let (mut twice_kinetic, mut momentum) = ([0.0; LANES], [0.0; LANES]);
        let (m, v) = (self.mass_kg.values(n), self.v.values(n));
        for c in 0..n {
            let of_row = each(|j| m[c][j] * v[c][j]);
            momentum = each(|j| momentum[j] + of_row[j]);
            twice_kinetic = each(|j| twice_kinetic[j] + of_row[j] * v[c][j]);
        }
        let kinetic_j = 0.5 * twice_kinetic.iter().sum::<f64>();
        if !kinetic_j.is_finite()
            && let Some((_, body)) = (self.fixed.chain.bodies().iter().enumerate())
                .find(|&(i, _)| !self.v[self.fixed.layout.of(i)].is_finite())
        {
            return Err(diverged(body, time_s));
        }
        let interfaces_j = self.sum_work::<N>(recorder);
        recorder.account.audit(&Balance {
            kinetic_j,
            interfaces_j,
            damped_j: self.losses.damped_j,
            resisted_j: self.losses.resisted_j,
            momentum: momentum.iter().sum(),
            impulse: self.wall_impulse + self.losses.impulse,
        });
        self.events.output_bodies::<N>(&self.v, time_s);
        let (v, x, a) = (self.v.values(n), self.x_m.values(n), self.a.values(n));
        recorder.recent.keep(0, n, |c| v[c]);
        match recorder.record {
            Record::Histories => {
                run.time_s.push(time_s);
                recorder.recent.keep(1, n, |c| x[c]);
                recorder.recent.keep(2, n, |c| a[c]);
                self.record_contacts::<N>(3, recorder);
                self.record_energies::<N>(5, recorder);
            }
            Record::Closing => self.record_contacts::<N>(1, recorder),
            Record::Summary => {}
        }
        recorder.recent.outputs += 1;
        if recorder.recent.outputs == OUTPUTS {
            recorder.recent.flush(recorder.record, run, &self.fixed.layout);
        }
        Ok(())
    }

    /// Work done at all interfaces so far, in J.
    #[inline(always)]
    fn sum_work<const N: usize>(&self, recorder: &mut OutputRecorder) -> f64 {
        let n = self.fixed.layout.known::<N>();
        self.push.works_j::<N>(&mut recorder.work_j);
        let Some(pull) = &self.pull else { return recorder.work_j.sum(n) };
        pull.works_j::<0>(&mut recorder.pulled[0]);
        recorder.work_j.sum(n) + recorder.pulled[0].sum(n)
    }

    /// After [`Self::sum_work`]: what of it is stored and dissipated, of all interfaces.
    #[inline(always)]
    fn split_work<const N: usize>(&self, recorder: &mut OutputRecorder) {
        let OutputRecorder { work_j, largest_m, dissipated_j, pulled, .. } = recorder;
        self.push.largest_and_dissipated::<N>(work_j, largest_m, dissipated_j);
        if let Some(pull) = &self.pull {
            let n = self.fixed.layout.rows();
            let [pulled_j, largest_m, lost_j] = pulled;
            pull.largest_and_dissipated::<0>(pulled_j, largest_m, lost_j);
            for (ours, pulls) in [(work_j, pulled_j), (dissipated_j, lost_j)] {
                for (ours, pulls) in ours.values_mut(n).iter_mut().zip(pulls.values(n)) {
                    *ours = each(|j| ours[j] + pulls[j]);
                }
            }
        }
    }

    /// Deflections and forces, as kinds from `first` on.
    #[inline(always)]
    fn record_contacts<const N: usize>(&self, first: usize, recorder: &mut OutputRecorder) {
        let n = self.fixed.layout.known::<N>();
        let d = self.push.deflections_m(StepPoint::End).values(n);
        let f = self.forces_n(StepPoint::End).values(n);
        // A branch ends at zero but for rounding.
        let least = [if self.net_n.is_none() { 0.0 } else { f64::NEG_INFINITY }; LANES];
        recorder.recent.keep(first, n, |c| d[c]);
        recorder.recent.keep(first + 1, n, |c| larger(f[c], least));
    }

    /// Largest deflections, what is stored, dissipated and damped, as kinds from `first` on.
    #[inline(always)]
    fn record_energies<const N: usize>(&self, first: usize, recorder: &mut OutputRecorder) {
        let n = self.fixed.layout.known::<N>();
        self.split_work::<N>(recorder);
        let OutputRecorder { recent, work_j, largest_m, dissipated_j, .. } = recorder;
        let (work_j, lost_j) = (work_j.values(n), dissipated_j.values(n));
        let largest_m = largest_m.values(n);
        let stored = |c: usize| each(|j| work_j[c][j] - lost_j[c][j]);
        recent.keep(first, n, |c| largest_m[c]);
        recent.keep(first + 1, n, |c| larger(stored(c), [0.0; LANES]));
        recent.keep(first + 2, n, |c| lost_j[c]);
        let damped_j = self.losses.damped_of_j.values(n);
        recent.keep(first + 3, n, |c| damped_j[c]);
    }

    /// Fills in what is known at the end of the run.
    pub(super) fn close(mut self, mut recorder: OutputRecorder, run: &mut Run, grid: &Grid) {
        recorder.recent.flush(recorder.record, run, &self.fixed.layout);
        self.sum_work::<0>(&mut recorder);
        self.split_work::<0>(&mut recorder);
        let n = self.fixed.layout.rows();
        let dissipated_j = recorder.dissipated_j.sum(n);
        run.ledger = recorder.account.close(recorder.work_j.sum(n) - dissipated_j, dissipated_j);
        let end_s = grid.output_s(grid.outputs);
        for (k, history) in run.interfaces.iter_mut().enumerate() {
            let slot = self.fixed.layout.of(k);
            history.dissipated_at_end_j = recorder.dissipated_j[slot];
            history.stored_at_end_j =
                (recorder.work_j[slot] - recorder.dissipated_j[slot]).max(0.0);
            history.damped_j = Some(self.losses.damped_of_j[slot]);
            self.events.interfaces[k].pressed(self.push.peak_n(k).max(self.peaks_n[slot]));
            self.events.interfaces[k].deflected(self.push.deflection_m(StepPoint::End, k), end_s);
            if let Some(pull) = &self.pull {
                self.events.interfaces[k].pulled(pull.peak_n(k));
                self.events.interfaces[k].extended(pull.largest_m(StepPoint::End, k).max(0.0));
            }
        }
        self.events.close(run, recorder.record, grid.steps_s());
    }
}
