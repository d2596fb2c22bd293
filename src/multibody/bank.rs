//! Bank: all interfaces of a chain side by side, each on one straight piece of its law.
//!
//! A step's forces are one pass of multiply-adds over arrays; only an interface that has left
//! its piece is looked at by itself.

use super::interface::{Branch, ForceLaw, Piece};
use super::rows::{LANES, Place, Places, Row, Rows, ahead, each, larger};

/// Which of the states a bank keeps: at the start of a step, inside it, at its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum At {
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

/// What only the outputs ask of a row of interfaces: a point of the current piece and the work
/// done up to it; the largest deflection and what is dissipated once it has fallen from there.
#[derive(Clone, Debug)]
struct Totals {
    known_m: Row,
    known_n: Row,
    known_j: Row,
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

/// A piece of a law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Spot {
    /// No force.
    Open,
    /// On the unloading branch, counted from its top.
    Branch(usize),
    /// On the envelope, counted from 0.
    Envelope(usize),
}

/// What changes seldom.
#[derive(Clone, Debug)]
struct Contact<'a> {
    law: Option<&'a ForceLaw>,
    stage: Stage,
    spot: Spot,
    /// Piece of the envelope that holds the largest deflection.
    index: usize,
    /// From the largest deflection, once the deflection has fallen.
    branch: Branch,
    peak_n: f64,
}

impl Contact<'_> {
    #[inline(always)]
    fn piece(&self, law: &ForceLaw) -> Piece {
        match (self.spot, self.stage) {
            (Spot::Envelope(i), Stage::Loading) => law.envelope_piece(i),
            (Spot::Envelope(i), Stage::Below) => {
                let piece = law.envelope_piece(i);
                Piece { to_m: piece.to_m.min(self.branch.largest_m), ..piece }
            }
            (Spot::Branch(j), _) => law.branch_piece(&self.branch, j),
            (Spot::Open, _) => law.below_branch(&self.branch),
        }
    }

    /// To the next piece of more deflection.
    #[inline(always)]
    fn up(&mut self, law: &ForceLaw) {
        let pieces = law.branch_pieces(&self.branch);
        match (self.spot, self.stage) {
            (Spot::Envelope(i), Stage::Loading) => self.load(law, i + 1),
            // Without memory the envelope is also the way back.
            (Spot::Envelope(i), Stage::Below) if i < self.index => {
                self.spot = Spot::Envelope(i + 1);
            }
            (Spot::Open, _) if !law.has_memory() && self.branch.largest_m > 0.0 => {
                self.spot = Spot::Envelope(0);
            }
            (Spot::Open, _) if pieces > 0 => self.spot = Spot::Branch(pieces - 1),
            (Spot::Branch(j), _) if j > 0 => self.spot = Spot::Branch(j - 1),
            _ => self.load(law, self.index),
        }
    }

    #[inline(always)]
    fn load(&mut self, law: &ForceLaw, index: usize) {
        (self.stage, self.spot, self.index) = (Stage::Loading, Spot::Envelope(index), index);
        let force_n = law.envelope_piece(index).known.force_n;
        if force_n > self.peak_n {
            self.peak_n = force_n;
        }
    }

    /// To the next piece of less deflection, once it has fallen below its largest.
    fn down(&mut self, law: &ForceLaw) {
        self.spot = match self.spot {
            Spot::Branch(j) if j + 1 < law.branch_pieces(&self.branch) => Spot::Branch(j + 1),
            Spot::Envelope(i) if i > 0 => Spot::Envelope(i - 1),
            Spot::Envelope(_) | Spot::Branch(_) | Spot::Open => Spot::Open,
        };
    }

    /// From here on the deflection is below its largest.
    fn turn(&mut self, law: &ForceLaw, largest_m: f64) {
        self.index = law.piece_index(self.index, largest_m);
        self.branch = law.branch(self.index, largest_m);
        self.peak_n = self.peak_n.max(self.branch.top_n);
        self.stage = Stage::Below;
        self.spot = match law.has_memory() {
            true if law.branch_pieces(&self.branch) > 0 => Spot::Branch(0),
            true => Spot::Open,
            false => Spot::Envelope(self.index),
        };
    }
}

/// All interfaces' compression, or all their tension.
pub(super) struct Bank<'a> {
    places: Places,
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

/// Where an interface went from one piece to another: beyond, the force differs by
/// `jump_n + stiffer_n_per_m (δ − at_m)` from what the former piece would have given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Kink {
    pub at_m: f64,
    pub stiffer_n_per_m: f64,
    pub jump_n: f64,
    pub way: Way,
    pub event: Option<Event>,
}

/// The deflection's motion at a kink.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    Up,
    Down,
    /// At the largest deflection.
    Turn,
}

/// What a kink is beside a change of stiffness.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Event {
    /// The first contact, from no force.
    Contact,
    /// From no force to some.
    Closed,
    /// The force has fallen to zero.
    Opened,
}

impl<'a> Bank<'a> {
    /// Laws and gaps of the interfaces, all open.
    pub fn new(places: &Places, laws: &[(Option<&'a ForceLaw>, f64)], sign: f64) -> Self {
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
            largest_m: [0.0; LANES],
            dissipated_j: [0.0; LANES],
        };
        let contact = |&(law, _): &(Option<&'a ForceLaw>, f64)| Contact {
            law,
            stage: Stage::Below,
            spot: Spot::Open,
            index: 0,
            branch: Branch::default(),
            peak_n: 0.0,
        };
        let mut bank = Self {
            contacts: laws.iter().map(contact).collect(),
            sign,
            lanes: vec![open; places.rows()],
            totals: vec![none; places.rows()],
            deflection_m: std::array::from_fn(|_| Rows::zeros(places)),
            force_n: std::array::from_fn(|_| Rows::zeros(places)),
            gradient_n: Rows::zeros(places),
            outside_m: Rows::zeros(places),
            places: places.clone(),
        };
        for (k, &(law, gap_m)) in laws.iter().enumerate() {
            let place = places.of(k);
            bank.lanes[place.row()].gap_m[place.lane()] = gap_m;
            if law.is_some() {
                bank.set(k, place, Piece::open_to(0.0, 0.0));
            }
        }
        bank
    }

    #[inline(always)]
    fn set(&mut self, k: usize, place: Place, piece: Piece) {
        let lane = place.lane();
        let contact = &self.contacts[k];
        let lanes = &mut self.lanes[place.row()];
        lanes.from_m[lane] = piece.from_m;
        lanes.to_m[lane] = piece.to_m;
        lanes.at_zero_n[lane] = piece.at_zero_n;
        lanes.slope_n_per_m[lane] = piece.slope_n_per_m;
        let totals = &mut self.totals[place.row()];
        totals.known_m[lane] = piece.known.deflection_m;
        totals.known_n[lane] = piece.known.force_n;
        totals.known_j[lane] = piece.known.work_j;
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

    pub fn deflection_m(&self, at: At, k: usize) -> f64 {
        self.deflection_m[at as usize][self.places.of(k)]
    }

    pub fn force_n(&self, at: At, k: usize) -> f64 {
        self.force_n[at as usize][self.places.of(k)]
    }

    #[inline(always)]
    pub fn deflections_m(&self, at: At) -> &Rows {
        &self.deflection_m[at as usize]
    }

    #[inline(always)]
    pub fn forces_n(&self, at: At) -> &Rows {
        &self.force_n[at as usize]
    }

    pub fn has_law(&self, k: usize) -> bool {
        self.contacts[k].law.is_some()
    }

    /// Largest force on the law up to the end of the last step.
    pub fn peak_n(&self, k: usize) -> f64 {
        self.contacts[k].peak_n.max(self.force_n(At::End, k))
    }

    /// Sets the deflection at the end of the flight to first contact, and the piece it is on.
    pub fn place(&mut self, k: usize, deflection_m: f64, closes: bool) {
        let place = self.places.of(k);
        self.deflection_m[At::End as usize][place] = deflection_m;
        // Bodies that touch and close are already on the envelope: a curve may begin above 0.
        if deflection_m == 0.0
            && closes
            && let Some(law) = self.contacts[k].law
        {
            self.contacts[k].load(law, 0);
            self.set(k, place, Piece { from_m: 0.0, ..law.envelope_piece(0) });
            self.force_n[At::End as usize][place] = law.envelope_n(0.0);
        }
    }

    /// The end of a step becomes the start of the next.
    #[inline(always)]
    pub fn next(&mut self) {
        self.deflection_m.swap(At::Start as usize, At::End as usize);
        self.force_n.swap(At::Start as usize, At::End as usize);
    }

    /// Deflections and forces at positions `x_m`; whether some interface has left its piece. At
    /// the end of a step the largest deflections follow.
    #[inline(always)]
    pub fn evaluate<const N: usize>(&mut self, x_m: &Rows, at: At) -> bool {
        match at {
            At::End => self.pass::<N, true>(x_m, at as usize),
            At::Start | At::Inside => self.pass::<N, false>(x_m, at as usize),
        }
    }

    #[inline(always)]
    fn pass<const N: usize, const FOLLOW: bool>(&mut self, x_m: &Rows, at: usize) -> bool {
        let sign = self.sign;
        let mut out = [0.0_f64; LANES];
        let n = self.places.known::<N>();
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
        let n = self.places.known::<N>();
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

    /// Calls `leave` with the place of each interface that has left its piece in the last
    /// [`Self::evaluate`].
    #[inline(always)]
    pub fn left(&self, mut leave: impl FnMut(Place)) {
        for (row, outside) in self.outside_m.values(self.lanes.len()).iter().enumerate() {
            for (lane, &outside) in outside.iter().enumerate() {
                if outside > 0.0 {
                    leave(Place::new(row, lane));
                }
            }
        }
    }

    /// Whether the deflection of `k` has fallen below its largest, along the envelope so far.
    #[inline(always)]
    pub fn turns(&self, at: At, k: usize, place: Place) -> bool {
        self.contacts[k].stage == Stage::Loading
            && self.deflections_m(at)[place] < self.lanes[place.row()].from_m[place.lane()]
    }

    /// Follows the law to the piece that holds the deflection of `k`, over `kink` after kink. If
    /// it [turns](Self::turns), it was largest at `top_m`.
    #[inline(always)]
    pub fn settle(
        &mut self,
        at: At,
        k: usize,
        place: Place,
        top_m: Option<f64>,
        mut kink: impl FnMut(Kink),
    ) {
        let contact = &mut self.contacts[k];
        let Some(law) = contact.law else { return };
        let deflection = self.deflection_m[at as usize][place];
        let start = self.deflection_m[At::Start as usize][place];
        let mut before = contact.piece(law);
        let mut go = |contact: &Contact<'_>, before: &mut Piece, at_m: f64, way, event| {
            let piece = contact.piece(law);
            let stiffer_n_per_m = piece.slope_n_per_m - before.slope_n_per_m;
            let jump_n = piece.at_zero_n - before.at_zero_n + stiffer_n_per_m * at_m;
            kink(Kink { at_m, stiffer_n_per_m, jump_n, way, event });
            *before = piece;
        };
        if let Some(top_m) = top_m {
            let top_m = top_m.max(start);
            while top_m > before.to_m {
                let at_m = before.to_m;
                contact.up(law);
                go(contact, &mut before, at_m, Way::Up, None);
            }
            contact.turn(law, top_m);
            before = law.envelope_piece(contact.index);
            let had_force = before.slope_n_per_m != 0.0 || before.at_zero_n != 0.0;
            let opens = contact.spot == Spot::Open && had_force;
            go(contact, &mut before, top_m, Way::Turn, opens.then_some(Event::Opened));
        }
        while deflection > before.to_m {
            let at_m = before.to_m;
            let never = contact.branch.largest_m <= 0.0;
            let event = match contact.spot {
                Spot::Open if never => Some(Event::Contact),
                Spot::Open => Some(Event::Closed),
                Spot::Branch(_) | Spot::Envelope(_) => None,
            };
            contact.up(law);
            go(contact, &mut before, at_m, Way::Up, event);
        }
        while deflection < before.from_m && contact.stage == Stage::Below {
            let at_m = before.from_m;
            contact.down(law);
            let event = (contact.spot == Spot::Open).then_some(Event::Opened);
            go(contact, &mut before, at_m, Way::Down, event);
        }
        if contact.stage == Stage::Loading {
            before.from_m = deflection;
        }
        let force = before.at_zero_n + before.slope_n_per_m * deflection;
        if at == At::End && force > contact.peak_n {
            contact.peak_n = force;
        }
        self.set(k, place, before);
        self.force_n[at as usize][place] = force;
    }

    /// The work of all interfaces, into `out_j`.
    #[inline(always)]
    pub fn works_j<const N: usize>(&self, out_j: &mut Rows) {
        let n = self.places.known::<N>();
        let (d, f) = (self.deflections_m(At::End).values(n), self.forces_n(At::End).values(n));
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
        let n = self.places.known::<N>();
        let (d, f) = (self.deflections_m(At::End).values(n), self.forces_n(At::End).values(n));
        let (largest, lost) = (largest_m.values_mut(n), lost_j.values_mut(n));
        let (all, work_j) = (&self.totals[..n], work_j.values(n));
        for c in 0..n {
            let totals = &all[c];
            largest[c] = larger(larger(d[c], totals.largest_m), [0.0; LANES]);
            lost[c] = totals.dissipated_j;
            for j in 0..LANES {
                if totals.largest_m[j] == f64::NEG_INFINITY {
                    let contact = &self.contacts[self.places.index(Place::new(c, j))];
                    let Some(law) = contact.law else { continue };
                    let stored = law.stored_j(contact.index, d[c][j], f[c][j], work_j[c][j]);
                    lost[c][j] = work_j[c][j] - stored;
                }
            }
        }
    }

    /// Largest deflection so far.
    pub fn largest_m(&self, at: At, k: usize) -> f64 {
        match self.contacts[k].stage {
            Stage::Loading => self.deflection_m(at, k),
            Stage::Below => self.contacts[k].branch.largest_m,
        }
    }

    /// Whether the deflection of `k` has not yet fallen since it was last at its largest.
    pub fn is_loading(&self, k: usize) -> bool {
        self.contacts[k].stage == Stage::Loading
    }

    pub fn is_open(&self, k: usize) -> bool {
        let place = self.places.of(k);
        self.lanes[place.row()].from_m[place.lane()] == f64::NEG_INFINITY
    }
}
