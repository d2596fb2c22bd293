//! Contacts: all interfaces of a chain side by side, each on one straight piece of its law.
//!
//! A step's forces are one pass of multiply-adds over arrays; only an interface that has left
//! its piece is looked at by itself.

use super::law::{Branch, ForceLaw, Piece};
use super::rows::{LANES, Layout, Row, Rows, Slot, ahead, each, larger};

/// Which of the states of a step is meant: at the start of a step, inside it, at its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StepPoint {
    Start = 0,
    Inside = 1,
    End = 2,
}

/// The current pieces of a row of interfaces.
#[derive(Clone, Debug)]
struct Lanes {
    gap_m: Row,
    from_m: Row,
    to_m: Row,
    at_zero_n: Row,
    slope_n_per_m: Row,
    /// +∞ while loading: `from_m` then follows the deflection; else −∞.
    follow: Row,
}

impl Lanes {
    /// Whether the piece has no force.
    #[inline(always)]
    fn is_idle(&self, lane: usize) -> bool {
        self.slope_n_per_m[lane] == 0.0 && self.at_zero_n[lane] == 0.0
    }
}

/// What only the outputs ask of a row of interfaces: a point of the current piece and the work
/// done up to it; the largest deflection and what is dissipated once it has fallen from there.
#[derive(Clone, Debug)]
struct Totals {
    known_m: Row,
    known_n: Row,
    known_j: Row,
    known_jm: Row,
    /// −∞ while loading.
    largest_m: Row,
    dissipated_j: Row,
}

/// Where an interface is on its law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    /// At the largest deflection so far.
    Loading,
    /// Below it: on an unloading branch, open, or not yet in contact.
    Below,
}

/// What changes seldom.
#[derive(Clone, Debug)]
struct Contact<'a> {
    law: Option<&'a ForceLaw>,
    stage: Stage,
    /// Piece of the envelope near the largest deflection; while loading, the current one.
    index: usize,
    /// From the largest deflection, once the deflection has fallen.
    branch: Branch,
    peak_n: f64,
}

impl Contact<'_> {
    /// The piece of the envelope that holds a new largest deflection.
    #[inline(always)]
    fn load(&mut self, law: &ForceLaw, deflection_m: f64) -> Piece {
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
    fn turn(&mut self, law: &ForceLaw, largest_m: f64) {
        let before = self.index;
        self.index = law.piece_index(before, largest_m);
        self.branch = law.branch(self.index, largest_m);
        let passed_n = law.peak_between_n(before.min(self.index), self.index);
        self.peak_n = self.peak_n.max(self.branch.top_n).max(passed_n);
        self.stage = Stage::Below;
    }

    /// The piece that holds a deflection below its largest.
    fn unload(&self, law: &ForceLaw, deflection_m: f64) -> Piece {
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

/// All interfaces under compression, or all under tension.
pub(super) struct Contacts<'a> {
    layout: Layout,
    /// 1 for compression, −1 for tension.
    sign: f64,
    lanes: Vec<Lanes>,
    totals: Vec<Totals>,
    contacts: Vec<Contact<'a>>,
    deflection_m: [Rows; 3],
    force_n: [Rows; 3],
    gradient_n: Rows,
    /// How far outside of their pieces the last deflections are.
    outside_m: Rows,
}

/// What leaving a piece led to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Move {
    /// From no force or an unloading branch to a new largest deflection.
    pub loads: bool,
    /// From no contact to some, at this deflection.
    pub closed_m: Option<f64>,
    /// The force has begun, at this deflection.
    pub pressed_m: Option<f64>,
    /// The force has fallen to zero, at this deflection.
    pub released_m: Option<f64>,
    /// The force has fallen to zero.
    pub opened: bool,
}

impl<'a> Contacts<'a> {
    /// Laws and gaps of the interfaces, all open.
    pub fn new(layout: &Layout, laws: &[(Option<&'a ForceLaw>, f64)], sign: f64) -> Self {
        let open = Lanes {
            gap_m: [0.0; LANES],
            from_m: [f64::NEG_INFINITY; LANES],
            to_m: [f64::INFINITY; LANES],
            at_zero_n: [0.0; LANES],
            slope_n_per_m: [0.0; LANES],
            follow: [f64::NEG_INFINITY; LANES],
        };
        let none = Totals {
            known_m: [0.0; LANES],
            known_n: [0.0; LANES],
            known_j: [0.0; LANES],
            known_jm: [0.0; LANES],
            largest_m: [0.0; LANES],
            dissipated_j: [0.0; LANES],
        };
        let contact = |&(law, _): &(Option<&'a ForceLaw>, f64)| Contact {
            law,
            stage: Stage::Below,
            index: 0,
            branch: Branch::default(),
            peak_n: 0.0,
        };
        let mut contacts = Self {
            contacts: laws.iter().map(contact).collect(),
            sign,
            lanes: vec![open; layout.rows()],
            totals: vec![none; layout.rows()],
            deflection_m: std::array::from_fn(|_| Rows::zeros(layout)),
            force_n: std::array::from_fn(|_| Rows::zeros(layout)),
            gradient_n: Rows::zeros(layout),
            outside_m: Rows::zeros(layout),
            layout: layout.clone(),
        };
        for (k, &(law, gap_m)) in laws.iter().enumerate() {
            let slot = layout.of(k);
            contacts.lanes[slot.row()].gap_m[slot.lane()] = gap_m;
            if law.is_some() {
                contacts.set(k, slot, Piece::open_to(0.0, 0.0, 0.0));
            }
        }
        contacts
    }

    #[inline(always)]
    fn set(&mut self, k: usize, slot: Slot, piece: Piece) {
        let lane = slot.lane();
        let contact = &self.contacts[k];
        let lanes = &mut self.lanes[slot.row()];
        lanes.from_m[lane] = piece.from_m;
        lanes.to_m[lane] = piece.to_m;
        lanes.at_zero_n[lane] = piece.at_zero_n;
        lanes.slope_n_per_m[lane] = piece.slope_n_per_m;
        let totals = &mut self.totals[slot.row()];
        totals.known_m[lane] = piece.known.deflection_m;
        totals.known_n[lane] = piece.known.force_n;
        totals.known_j[lane] = piece.known.work_j;
        totals.known_jm[lane] = piece.known.sum_jm;
        match contact.stage {
            Stage::Loading => {
                lanes.follow[lane] = f64::INFINITY;
                totals.largest_m[lane] = f64::NEG_INFINITY;
            }
            Stage::Below => {
                lanes.follow[lane] = f64::NEG_INFINITY;
                totals.largest_m[lane] = contact.branch.largest_m;
                totals.dissipated_j[lane] = contact.branch.dissipated_j;
            }
        }
    }

    pub fn deflection_m(&self, at: StepPoint, k: usize) -> f64 {
        self.deflection_m[at as usize][self.layout.of(k)]
    }

    pub fn force_n(&self, at: StepPoint, k: usize) -> f64 {
        self.force_n[at as usize][self.layout.of(k)]
    }

    #[inline(always)]
    pub fn deflections_m(&self, at: StepPoint) -> &Rows {
        &self.deflection_m[at as usize]
    }

    #[inline(always)]
    pub fn forces_n(&self, at: StepPoint) -> &Rows {
        &self.force_n[at as usize]
    }

    pub fn slope_n_per_m(&self, slot: Slot) -> f64 {
        self.lanes[slot.row()].slope_n_per_m[slot.lane()]
    }

    pub fn has_law(&self, k: usize) -> bool {
        self.contacts[k].law.is_some()
    }

    /// Largest force on the law up to the end of the last step.
    pub fn peak_n(&self, k: usize) -> f64 {
        self.contacts[k].peak_n.max(self.force_n(StepPoint::End, k))
    }

    /// Sets the deflection at the end of the flight to first contact, and the piece it is on.
    pub fn set_start(&mut self, k: usize, deflection_m: f64, closes: bool) {
        let slot = self.layout.of(k);
        self.deflection_m[StepPoint::End as usize][slot] = deflection_m;
        // Bodies that touch and close are already on the envelope: a curve may begin above 0.
        if deflection_m == 0.0
            && closes
            && let Some(law) = self.contacts[k].law
        {
            self.contacts[k].stage = Stage::Loading;
            self.set(k, slot, Piece { from_m: 0.0, ..law.envelope_piece(0) });
            self.force_n[StepPoint::End as usize][slot] = law.envelope_n(0.0);
        }
    }

    /// The end of a step becomes the start of the next.
    #[inline(always)]
    pub fn next(&mut self) {
        self.deflection_m.swap(StepPoint::Start as usize, StepPoint::End as usize);
        self.force_n.swap(StepPoint::Start as usize, StepPoint::End as usize);
    }

    /// Deflections and forces at positions `x_m`; whether some interface has left its piece. At
    /// the end of a step the largest deflections follow.
    #[inline(always)]
    pub fn evaluate<const N: usize>(&mut self, x_m: &Rows, at: StepPoint) -> bool {
        match at {
            StepPoint::End => self.pass::<N, true>(x_m, at as usize),
            StepPoint::Start | StepPoint::Inside => self.pass::<N, false>(x_m, at as usize),
        }
    }

    #[inline(always)]
    fn pass<const N: usize, const FOLLOW: bool>(&mut self, x_m: &Rows, at: usize) -> bool {
        let sign = self.sign;
        let mut out = [0.0_f64; LANES];
        let n = self.layout.known::<N>();
        let deflections = self.deflection_m[at].values_mut(n);
        let forces = self.force_n[at].values_mut(n);
        let outside = self.outside_m.values_mut(n);
        let x = x_m.values(n);
        let all = &mut self.lanes[..n];
        for c in 0..n {
            let lanes = &mut all[c];
            // Whole rows at a time, which the compiler turns into vectors.
            let ahead = ahead(x, c);
            let deflection = each(|j| sign * (x[c][j] - ahead[j]) - lanes.gap_m[j]);
            forces[c] = each(|j| lanes.at_zero_n[j] + lanes.slope_n_per_m[j] * deflection[j]);
            let below = each(|j| lanes.from_m[j] - deflection[j]);
            let above = each(|j| deflection[j] - lanes.to_m[j]);
            outside[c] = larger(below, above);
            out = larger(outside[c], out);
            if FOLLOW {
                let follow = lanes.follow;
                let reached =
                    each(|j| if deflection[j] < follow[j] { deflection[j] } else { follow[j] });
                lanes.from_m = larger(lanes.from_m, reached);
            }
            deflections[c] = deflection;
        }
        out.iter().any(|&o| o > 0.0)
    }

    /// Takes `factor` times the change of the forces along `a`.
    #[inline(always)]
    pub fn take_gradient<const N: usize>(&mut self, a: &Rows, factor: f64) {
        let n = self.layout.known::<N>();
        let factor = self.sign * factor;
        let a = a.values(n);
        let gradient = self.gradient_n.values_mut(n);
        let all = &self.lanes[..n];
        for c in 0..n {
            let slope = &all[c].slope_n_per_m;
            let ahead = ahead(a, c);
            gradient[c] = each(|j| factor * slope[j] * (a[c][j] - ahead[j]));
        }
    }

    /// What [`Self::take_gradient`] has taken.
    #[inline(always)]
    pub fn gradient_n(&self) -> &Rows {
        &self.gradient_n
    }

    /// Calls `leave` with the slot of each interface that has left its piece in the last
    /// [`Self::evaluate`].
    #[inline(always)]
    pub fn left(&self, mut leave: impl FnMut(Slot)) {
        for (row, outside) in self.outside_m.values(self.lanes.len()).iter().enumerate() {
            for (lane, &outside) in outside.iter().enumerate() {
                if outside > 0.0 {
                    leave(Slot::new(row, lane));
                }
            }
        }
    }

    /// Whether the deflection of `k` has fallen below its largest, along the envelope so far.
    #[inline(always)]
    pub fn turns(&self, at: StepPoint, k: usize, slot: Slot) -> bool {
        self.contacts[k].stage == Stage::Loading
            && self.deflections_m(at)[slot] < self.lanes[slot.row()].from_m[slot.lane()]
    }

    /// Finds the piece for the deflection of `k`. If it [turns](Self::turns), it was largest at
    /// `top_m`.
    #[inline(always)]
    pub fn settle(&mut self, at: StepPoint, k: usize, slot: Slot, top_m: Option<f64>) -> Move {
        let contact = &mut self.contacts[k];
        let Some(law) = contact.law else { return Move::default() };
        let deflection = self.deflection_m[at as usize][slot];
        let mut what = Move::default();
        let piece = match (contact.stage, top_m) {
            // The next piece of the envelope, as a rule.
            (Stage::Loading, None) => contact.load(law, deflection),
            _ => {
                if let Some(top_m) = top_m {
                    contact
                        .turn(law, top_m.max(self.deflection_m[StepPoint::Start as usize][slot]));
                }
                let piece = if deflection > 0.0 && deflection >= contact.branch.largest_m {
                    what.loads = true;
                    contact.load(law, deflection)
                } else {
                    contact.unload(law, deflection)
                };
                let (lanes, lane) = (&self.lanes[slot.row()], slot.lane());
                let was_open = lanes.from_m[lane] == f64::NEG_INFINITY;
                let is_open = piece.from_m == f64::NEG_INFINITY;
                what.opened = is_open && !was_open;
                what.closed_m = (was_open && !is_open).then_some(lanes.to_m[lane]);
                piece
            }
        };
        let (lanes, lane) = (&self.lanes[slot.row()], slot.lane());
        if lanes.is_idle(lane) != piece.is_idle() {
            let goes_up = deflection > lanes.to_m[lane];
            let left_m = if goes_up { lanes.to_m[lane] } else { lanes.from_m[lane] };
            match piece.is_idle() {
                false => what.pressed_m = Some(left_m),
                // While loading the old piece begins at the deflection reached.
                true if goes_up => what.released_m = Some(left_m),
                true => what.released_m = Some(piece.to_m),
            }
        }
        let force = piece.at_zero_n + piece.slope_n_per_m * deflection;
        if at == StepPoint::End && force > contact.peak_n {
            contact.peak_n = force;
        }
        self.set(k, slot, piece);
        self.force_n[at as usize][slot] = force;
        what
    }

    /// Work done at an interface so far in J (what is stored and dissipated, from the law's
    /// tables), and its integral over the deflection in J m.
    #[inline(always)]
    pub fn work(&self, at: StepPoint, slot: Slot) -> (f64, f64) {
        let (totals, lane) = (&self.totals[slot.row()], slot.lane());
        let along = self.deflections_m(at)[slot] - totals.known_m[lane];
        let (known, force) = (totals.known_n[lane], self.forces_n(at)[slot]);
        let work_j = totals.known_j[lane] + 0.5 * (known + force) * along;
        let mean_j = totals.known_j[lane] + (2.0 * known + force) * (1.0 / 6.0) * along;
        (work_j, totals.known_jm[lane] + mean_j * along)
    }

    /// The work of all interfaces, into `out_j`.
    #[inline(always)]
    pub fn works_j<const N: usize>(&self, out_j: &mut Rows) {
        let n = self.layout.known::<N>();
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
    pub fn largest_and_dissipated<const N: usize>(
        &self,
        work_j: &Rows,
        largest_m: &mut Rows,
        lost_j: &mut Rows,
    ) {
        let n = self.layout.known::<N>();
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
                    let contact = &self.contacts[self.layout.index(Slot::new(c, j))];
                    let Some(law) = contact.law else { continue };
                    let stored = law.stored_j(contact.index, d[c][j], f[c][j], work_j[c][j]);
                    lost[c][j] = work_j[c][j] - stored;
                }
            }
        }
    }

    /// Largest deflection so far.
    pub fn largest_m(&self, at: StepPoint, k: usize) -> f64 {
        match self.contacts[k].stage {
            Stage::Loading => self.deflection_m(at, k),
            Stage::Below => self.contacts[k].branch.largest_m,
        }
    }

    /// Whether the deflection of `k` has not yet fallen since it was last at its largest.
    pub fn is_loading(&self, k: usize) -> bool {
        self.contacts[k].stage == Stage::Loading
    }

    /// Whether the piece of `k` has any force.
    pub fn presses(&self, k: usize) -> bool {
        let slot = self.layout.of(k);
        !self.lanes[slot.row()].is_idle(slot.lane())
    }

    /// Deflection below which `k` is open.
    pub fn opens_at_m(&self, k: usize) -> f64 {
        let slot = self.layout.of(k);
        self.lanes[slot.row()].to_m[slot.lane()]
    }

    pub fn is_open(&self, k: usize) -> bool {
        let slot = self.layout.of(k);
        self.lanes[slot.row()].from_m[slot.lane()] == f64::NEG_INFINITY
    }
}
