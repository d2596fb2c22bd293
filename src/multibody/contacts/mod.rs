//! Contacts: all interfaces of a chain side by side, each on one linear segment of its law.
//!
//! A step's forces are one pass of multiply-adds over arrays; only an interface that has left
//! its segment is treated separately.

mod contact;

use super::law::{ForceLaw, Piece};
use super::rows::{LANES, LaneIndex, Layout, Neighbours, Row, Rows, each, larger};
pub(super) use contact::Move;
use contact::{Contact, Stage, Totals};

/// Which state of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StepPoint {
    Start = 0,
    Inside = 1,
    End = 2,
}

/// Which way an interface is loaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Direction {
    Compression,
    Tension,
}

impl Direction {
    /// Of a deflection as counted from the way in which the bodies move towards each other.
    #[inline(always)]
    pub(crate) fn sign(self) -> f64 {
        match self {
            Self::Compression => 1.0,
            Self::Tension => -1.0,
        }
    }
}

/// What stays as it is in a run.
struct Fixed<'a> {
    layout: Layout,
    direction: Direction,
    /// `None` where nothing acts in this direction.
    laws: Vec<Option<&'a ForceLaw>>,
    gaps_m: Rows,
}

/// The current pieces of a row of interfaces.
#[derive(Clone, Debug)]
struct Lanes {
    from_m: Row,
    to_m: Row,
    at_zero_n: Row,
    slope_n_per_m: Row,
    /// +∞ while loading: `from_m` then follows the deflection; else −∞.
    follow: Row,
}

impl Lanes {
    /// Without any law.
    fn none() -> Self {
        Self {
            from_m: [f64::NEG_INFINITY; LANES],
            to_m: [f64::INFINITY; LANES],
            at_zero_n: [0.0; LANES],
            slope_n_per_m: [0.0; LANES],
            follow: [f64::NEG_INFINITY; LANES],
        }
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, stage: Stage, piece: &Piece) {
        self.from_m[lane] = piece.from_m;
        self.to_m[lane] = piece.to_m;
        self.at_zero_n[lane] = piece.at_zero_n;
        self.slope_n_per_m[lane] = piece.slope_n_per_m;
        self.follow[lane] = match stage {
            Stage::Loading => f64::INFINITY,
            Stage::Below => f64::NEG_INFINITY,
        };
    }

    /// Whether the piece has no force.
    #[inline(always)]
    fn is_idle(&self, lane: usize) -> bool {
        self.slope_n_per_m[lane] == 0.0 && self.at_zero_n[lane] == 0.0
    }

    /// Whether the interface is open.
    #[inline(always)]
    fn is_open(&self, lane: usize) -> bool {
        self.from_m[lane] == f64::NEG_INFINITY
    }
}

/// All interfaces under compression, or all under tension.
pub(super) struct Contacts<'a> {
    fixed: Fixed<'a>,
    lanes: Vec<Lanes>,
    totals: Vec<Totals>,
    contacts: Vec<Contact>,
    deflection_m: [Rows; 3],
    force_n: [Rows; 3],
    gradient_n: Rows,
    /// How far outside of their pieces the last deflections are.
    outside_m: Rows,
}

impl<'a> Contacts<'a> {
    /// Laws and gaps (m) of the interfaces, all open.
    pub(crate) fn new(
        layout: &Layout,
        laws: &[(Option<&'a ForceLaw>, f64)],
        direction: Direction,
    ) -> Self {
        let fixed = Fixed {
            layout: layout.clone(),
            direction,
            laws: laws.iter().map(|(law, _)| *law).collect(),
            gaps_m: Rows::of(layout, laws.len(), |k| laws[k].1),
        };
        let mut contacts = Self {
            fixed,
            lanes: vec![Lanes::none(); layout.rows()],
            totals: vec![Totals::default(); layout.rows()],
            contacts: vec![Contact::open(); laws.len()],
            deflection_m: std::array::from_fn(|_| Rows::zeros(layout)),
            force_n: std::array::from_fn(|_| Rows::zeros(layout)),
            gradient_n: Rows::zeros(layout),
            outside_m: Rows::zeros(layout),
        };
        for (k, (law, _)) in laws.iter().enumerate() {
            if law.is_some() {
                contacts.set(k, layout.of(k), &Piece::open_to(0.0, 0.0, 0.0));
            }
        }
        contacts
    }

    #[inline(always)]
    fn set(&mut self, k: usize, slot: LaneIndex, piece: &Piece) {
        let contact = &self.contacts[k];
        self.lanes[slot.row()].set(slot.lane(), contact.stage, piece);
        self.totals[slot.row()].set(slot.lane(), contact, piece);
    }

    pub(crate) fn deflection_m(&self, at: StepPoint, k: usize) -> f64 {
        self.deflection_m[at as usize][self.fixed.layout.of(k)]
    }

    pub(crate) fn force_n(&self, at: StepPoint, k: usize) -> f64 {
        self.force_n[at as usize][self.fixed.layout.of(k)]
    }

    #[inline(always)]
    pub(crate) fn deflections_m(&self, at: StepPoint) -> &Rows {
        &self.deflection_m[at as usize]
    }

    #[inline(always)]
    pub(crate) fn forces_n(&self, at: StepPoint) -> &Rows {
        &self.force_n[at as usize]
    }

    /// Where the present pieces of a row begin; −∞ of what is open.
    #[inline(always)]
    pub(crate) fn begins_m(&self, row: usize) -> Row {
        self.lanes[row].from_m
    }

    pub(crate) fn slope_n_per_m(&self, slot: LaneIndex) -> f64 {
        self.lanes[slot.row()].slope_n_per_m[slot.lane()]
    }

    pub(crate) fn has_law(&self, k: usize) -> bool {
        self.fixed.laws[k].is_some()
    }

    /// Largest force on the law up to the end of the last step.
    pub(crate) fn peak_n(&self, k: usize) -> f64 {
        self.contacts[k].peak_n.max(self.force_n(StepPoint::End, k))
    }

    /// Sets the deflection at the end of the flight to first contact, and the piece it is on.
    pub(crate) fn set_start(&mut self, k: usize, deflection_m: f64, closes: bool) {
        let slot = self.fixed.layout.of(k);
        self.deflection_m[StepPoint::End as usize][slot] = deflection_m;
        // Bodies that touch and close are already on the envelope: a curve may begin above 0.
        if deflection_m == 0.0
            && closes
            && let Some(law) = self.fixed.laws[k]
        {
            self.contacts[k].stage = Stage::Loading;
            self.set(k, slot, &Piece { from_m: 0.0, ..law.envelope_piece(0) });
            self.force_n[StepPoint::End as usize][slot] = law.envelope_n(0.0);
        }
    }

    /// The end of a step becomes the start of the next.
    #[inline(always)]
    pub(crate) fn next(&mut self) {
        self.deflection_m.swap(StepPoint::Start as usize, StepPoint::End as usize);
        self.force_n.swap(StepPoint::Start as usize, StepPoint::End as usize);
    }

    /// Deflections and forces at positions `x_m`; whether some interface has left its piece. At
    /// the end of a step the largest deflections follow.
    #[inline(always)]
    pub(crate) fn evaluate<const N: usize>(&mut self, x_m: &Rows, at: StepPoint) -> bool {
        match at {
            StepPoint::End => self.pass::<N, true>(x_m, at as usize),
            StepPoint::Start | StepPoint::Inside => self.pass::<N, false>(x_m, at as usize),
        }
    }

    #[inline(always)]
    fn pass<const N: usize, const FOLLOW: bool>(&mut self, x_m: &Rows, at: usize) -> bool {
        let sign = self.fixed.direction.sign();
        let mut out = [0.0_f64; LANES];
        let n = self.fixed.layout.known::<N>();
        let gaps = self.fixed.gaps_m.values(n);
        let deflections = self.deflection_m[at].values_mut(n);
        let forces = self.force_n[at].values_mut(n);
        let outside = self.outside_m.values_mut(n);
        let x = x_m.values(n);
        let all = &mut self.lanes[..n];
        let neighbours = Neighbours::ahead(x);
        for c in 0..n {
            let lanes = &mut all[c];
            // Whole rows at a time, which the compiler turns into vectors.
            let ahead = neighbours.after(c);
            let deflection = each(|j| sign * (x[c][j] - ahead[j]) - gaps[c][j]);
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
    pub(crate) fn take_gradient<const N: usize>(&mut self, a: &Rows, factor: f64) {
        let n = self.fixed.layout.known::<N>();
        let factor = self.fixed.direction.sign() * factor;
        let a = a.values(n);
        let gradient = self.gradient_n.values_mut(n);
        let all = &self.lanes[..n];
        let neighbours = Neighbours::ahead(a);
        for c in 0..n {
            let slope = &all[c].slope_n_per_m;
            let ahead = neighbours.after(c);
            gradient[c] = each(|j| factor * slope[j] * (a[c][j] - ahead[j]));
        }
    }

    /// What [`Self::take_gradient`] has taken.
    #[inline(always)]
    pub(crate) fn gradient_n(&self) -> &Rows {
        &self.gradient_n
    }

    /// Calls `leave` with the slot of each interface that has left its piece in the last
    /// [`Self::evaluate`].
    #[inline(always)]
    pub(crate) fn left(&self, mut leave: impl FnMut(LaneIndex)) {
        for (row, outside) in self.outside_m.values(self.lanes.len()).iter().enumerate() {
            for (lane, &outside) in outside.iter().enumerate() {
                if outside > 0.0 {
                    leave(LaneIndex::new(row, lane));
                }
            }
        }
    }

    /// Whether the deflection of `k` has fallen below its largest, along the envelope so far.
    #[inline(always)]
    pub(crate) fn turns(&self, at: StepPoint, k: usize, slot: LaneIndex) -> bool {
        self.is_loading(k)
            && self.deflections_m(at)[slot] < self.lanes[slot.row()].from_m[slot.lane()]
    }

    /// Finds the piece for the deflection of `k`. If it [turns](Self::turns), it was largest at
    /// `top_m`.
    #[inline(always)]
    pub(crate) fn settle(
        &mut self,
        at: StepPoint,
        k: usize,
        slot: LaneIndex,
        top_m: Option<f64>,
    ) -> Move {
        let contact = &mut self.contacts[k];
        let Some(law) = self.fixed.laws[k] else { return Move::default() };
        let deflection = self.deflection_m[at as usize][slot];
        let (lanes, lane) = (&self.lanes[slot.row()], slot.lane());
        let mut what = Move::default();
        let piece = match (contact.stage, top_m) {
            // The next piece of the envelope, as a rule.
            (Stage::Loading, None) => contact.load(law, deflection),
            _ => {
                if let Some(top_m) = top_m {
                    let start_m = self.deflection_m[StepPoint::Start as usize][slot];
                    contact.turn(law, top_m.max(start_m));
                }
                let piece = contact.unload_or_load(law, deflection);
                what.loads = contact.stage == Stage::Loading;
                let was_open = lanes.is_open(lane);
                what.opened = piece.is_open() && !was_open;
                what.closed_m = (was_open && !piece.is_open()).then_some(lanes.to_m[lane]);
                piece
            }
        };
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
        self.set(k, slot, &piece);
        self.force_n[at as usize][slot] = force;
        what
    }

    /// Maximum deflection so far.
    pub(crate) fn largest_m(&self, at: StepPoint, k: usize) -> f64 {
        match self.contacts[k].stage {
            Stage::Loading => self.deflection_m(at, k),
            Stage::Below => self.contacts[k].branch.largest_m,
        }
    }

    /// Whether the deflection of `k` has not yet fallen since it was last at its largest.
    pub(crate) fn is_loading(&self, k: usize) -> bool {
        self.contacts[k].stage == Stage::Loading
    }

    /// Whether the piece of `k` has any force.
    pub(crate) fn presses(&self, k: usize) -> bool {
        let slot = self.fixed.layout.of(k);
        !self.lanes[slot.row()].is_idle(slot.lane())
    }

    /// Deflection below which `k` is open.
    pub(crate) fn opens_at_m(&self, k: usize) -> f64 {
        let slot = self.fixed.layout.of(k);
        self.lanes[slot.row()].to_m[slot.lane()]
    }

    pub(crate) fn is_open(&self, k: usize) -> bool {
        let slot = self.fixed.layout.of(k);
        self.lanes[slot.row()].is_open(slot.lane())
    }
}
