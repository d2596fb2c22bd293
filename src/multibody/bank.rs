//! Bank: all interfaces of a chain side by side, each on one straight piece of its law.
//!
//! A step's forces are one pass of multiply-adds over arrays; only an interface that has left
//! its piece is looked at by itself.

use super::interface::{Branch, ForceLaw, Piece};

/// Interfaces are kept in groups of as many, so that the compiler works on whole vectors.
pub(super) const LANES: usize = 4;

/// Which of the states a bank keeps: at the start of a step, inside it, at its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum At {
    Start = 0,
    Inside = 1,
    End = 2,
}

/// The current pieces of some interfaces.
#[derive(Clone, Debug)]
struct Lanes {
    gap_m: [f64; LANES],
    from_m: [f64; LANES],
    to_m: [f64; LANES],
    at_zero_n: [f64; LANES],
    slope_n_per_m: [f64; LANES],
    /// +∞ while loading: `from_m` then follows the deflection; else −∞.
    follow: [f64; LANES],
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
struct Contact {
    stage: Stage,
    /// Piece of the envelope near the largest deflection.
    index: usize,
    /// From the largest deflection, once the deflection has fallen.
    branch: Branch,
    peak_n: f64,
}

/// All interfaces' compression, or all their tension.
pub(super) struct Bank<'a> {
    laws: Vec<Option<&'a ForceLaw>>,
    /// 1 for compression, −1 for tension.
    sign: f64,
    lanes: Vec<Lanes>,
    contacts: Vec<Contact>,
    deflection_m: [Vec<[f64; LANES]>; 3],
    /// Forces, the one of interface `k` at `k + 1`.
    force_n: [Vec<f64>; 3],
}

/// What leaving a piece led to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Move {
    /// From no force or an unloading branch to a new largest deflection.
    Loads,
    /// Along the law.
    Along,
    /// The deflection began to fall.
    Turned,
    /// The force has fallen to zero.
    Opened,
}

#[inline(always)]
pub(super) fn each(value: impl Fn(usize) -> f64) -> [f64; LANES] {
    std::array::from_fn(value)
}

#[inline(always)]
fn larger(a: [f64; LANES], b: [f64; LANES]) -> [f64; LANES] {
    each(|j| if a[j] > b[j] { a[j] } else { b[j] })
}

impl<'a> Bank<'a> {
    /// `gaps_m` and laws of the interfaces, all open; `width` is a multiple of [`LANES`].
    pub fn new(laws: Vec<Option<&'a ForceLaw>>, gaps_m: &[f64], sign: f64, width: usize) -> Self {
        let open = Lanes {
            gap_m: [0.0; LANES],
            from_m: [f64::NEG_INFINITY; LANES],
            to_m: [f64::INFINITY; LANES],
            at_zero_n: [0.0; LANES],
            slope_n_per_m: [0.0; LANES],
            follow: [f64::NEG_INFINITY; LANES],
        };
        let contact =
            Contact { stage: Stage::Below, index: 0, branch: Branch::default(), peak_n: 0.0 };
        let mut bank = Self {
            contacts: vec![contact; laws.len()],
            sign,
            lanes: vec![open; width / LANES],
            deflection_m: std::array::from_fn(|_| vec![[0.0; LANES]; width / LANES]),
            force_n: std::array::from_fn(|_| vec![0.0; width + 1]),
            laws,
        };
        for (k, &gap_m) in gaps_m.iter().enumerate() {
            bank.lanes[k / LANES].gap_m[k % LANES] = gap_m;
            if bank.laws[k].is_some() {
                bank.set(k, Piece::open_to(0.0), f64::NEG_INFINITY);
            }
        }
        bank
    }

    fn set(&mut self, k: usize, piece: Piece, follow: f64) {
        let (lanes, j) = (&mut self.lanes[k / LANES], k % LANES);
        lanes.from_m[j] = piece.from_m;
        lanes.to_m[j] = piece.to_m;
        lanes.at_zero_n[j] = piece.at_zero_n;
        lanes.slope_n_per_m[j] = piece.slope_n_per_m;
        lanes.follow[j] = follow;
    }

    pub fn deflection_m(&self, at: At, k: usize) -> f64 {
        self.deflection_m[at as usize][k / LANES][k % LANES]
    }

    pub fn force_n(&self, at: At, k: usize) -> f64 {
        self.force_n[at as usize][k + 1]
    }

    /// All forces, the one of interface `k` at `k + 1`; 0 before the first.
    pub fn forces_n(&self, at: At) -> &[f64] {
        &self.force_n[at as usize]
    }

    pub fn slope_n_per_m(&self, k: usize) -> f64 {
        self.lanes[k / LANES].slope_n_per_m[k % LANES]
    }

    pub fn has_law(&self, k: usize) -> bool {
        self.laws[k].is_some()
    }

    pub fn peak_n(&self, k: usize) -> f64 {
        self.contacts[k].peak_n
    }

    /// Sets the deflection at the end of the flight to first contact, and the piece it is on.
    pub fn place(&mut self, k: usize, deflection_m: f64, closes: bool) {
        self.deflection_m[At::End as usize][k / LANES][k % LANES] = deflection_m;
        // Bodies that touch and close are already on the envelope: a curve may begin above 0.
        if deflection_m == 0.0
            && closes
            && let Some(law) = self.laws[k]
        {
            self.contacts[k].stage = Stage::Loading;
            self.set(k, Piece { from_m: 0.0, ..law.envelope_piece(0) }, f64::INFINITY);
            let force = law.envelope_n(0.0);
            self.force_n[At::End as usize][k + 1] = force;
            self.contacts[k].peak_n = force;
        }
    }

    /// The end of a step becomes the start of the next.
    #[inline(always)]
    pub fn next(&mut self) {
        self.deflection_m.swap(At::Start as usize, At::End as usize);
        self.force_n.swap(At::Start as usize, At::End as usize);
    }

    /// Deflections and forces at positions `x_m` (padded by one); whether some interface has
    /// left its piece. At the end of a step the largest deflections follow.
    #[inline(always)]
    pub fn evaluate<const N: usize>(&mut self, x_m: &[f64], at: At) -> bool {
        match at {
            At::End => self.pass::<N, true>(x_m, at as usize),
            At::Start | At::Inside => self.pass::<N, false>(x_m, at as usize),
        }
    }

    #[inline(always)]
    fn pass<const N: usize, const FOLLOW: bool>(&mut self, x_m: &[f64], at: usize) -> bool {
        let sign = self.sign;
        let mut out = [0.0_f64; LANES];
        let n = if N > 0 { N } else { self.lanes.len() };
        let deflections = &mut self.deflection_m[at][..n];
        let forces = &mut self.force_n[at][1..].as_chunks_mut::<LANES>().0[..n];
        let (here, ahead) =
            (&x_m.as_chunks::<LANES>().0[..n], &x_m[1..].as_chunks::<LANES>().0[..n]);
        let all = &mut self.lanes[..n];
        for c in 0..n {
            let (lanes, here, ahead) = (&mut all[c], &here[c], &ahead[c]);
            // Whole arrays at a time, which the compiler turns into vectors.
            let deflection = each(|j| sign * (here[j] - ahead[j]) - lanes.gap_m[j]);
            forces[c] = each(|j| lanes.at_zero_n[j] + lanes.slope_n_per_m[j] * deflection[j]);
            let below = each(|j| lanes.from_m[j] - deflection[j]);
            let above = each(|j| deflection[j] - lanes.to_m[j]);
            let worse = larger(below, above);
            out = larger(worse, out);
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

    /// Sets `out_n[k + 1]` to `factor` times the change of the force of `k` along `a`.
    #[inline(always)]
    pub fn gradient<const N: usize>(&self, a: &[f64], factor: f64, out_n: &mut [f64]) {
        let n = if N > 0 { N } else { self.lanes.len() };
        let (here, ahead) = (&a.as_chunks::<LANES>().0[..n], &a[1..].as_chunks::<LANES>().0[..n]);
        let out = &mut out_n[1..].as_chunks_mut::<LANES>().0[..n];
        let all = &self.lanes[..n];
        for c in 0..n {
            let slope = &all[c].slope_n_per_m;
            out[c] = each(|j| factor * slope[j] * (here[c][j] - ahead[c][j]));
        }
    }

    /// Whether interface `k` has left its piece.
    pub fn has_left(&self, at: At, k: usize) -> bool {
        let (lanes, j) = (&self.lanes[k / LANES], k % LANES);
        let deflection = self.deflection_m(at, k);
        deflection < lanes.from_m[j] || deflection > lanes.to_m[j]
    }

    /// Finds the piece for the deflection of `k`. `top_m` is where a deflection that falls now
    /// was largest.
    pub fn settle(&mut self, at: At, k: usize, top_m: f64) -> Move {
        let Some(law) = self.laws[k] else { return Move::Along };
        let deflection = self.deflection_m(at, k);
        let (from_m, had_force) = (
            self.lanes[k / LANES].from_m[k % LANES],
            self.lanes[k / LANES].slope_n_per_m[k % LANES] != 0.0
                || self.lanes[k / LANES].at_zero_n[k % LANES] != 0.0,
        );
        let contact = &mut self.contacts[k];
        let turned = contact.stage == Stage::Loading && deflection < from_m;
        if turned {
            let largest = top_m.max(self.deflection_m[At::Start as usize][k / LANES][k % LANES]);
            let before = contact.index;
            contact.index = law.piece_index(before, largest);
            contact.branch = law.branch(contact.index, largest);
            contact.peak_n = contact
                .peak_n
                .max(contact.branch.top_n)
                .max(law.peak_between_n(before, contact.index));
            contact.stage = Stage::Below;
        }
        let loads = deflection > 0.0
            && (contact.stage == Stage::Loading || deflection >= contact.branch.largest_m);
        let (piece, follow, what) = if loads {
            let begins = contact.stage == Stage::Below;
            let before = contact.index;
            contact.index = law.piece_index(before, deflection);
            contact.peak_n = contact.peak_n.max(law.peak_between_n(before, contact.index));
            contact.stage = Stage::Loading;
            let piece = Piece { from_m: deflection, ..law.envelope_piece(contact.index) };
            (piece, f64::INFINITY, if begins { Move::Loads } else { Move::Along })
        } else {
            let piece = match law.has_memory() {
                true => law.branch_piece(&contact.branch, deflection),
                false if deflection <= 0.0 => Piece::open_to(0.0),
                false => {
                    let piece = law.envelope_piece(law.piece_index(contact.index, deflection));
                    Piece { to_m: piece.to_m.min(contact.branch.largest_m), ..piece }
                }
            };
            let is_open = piece.from_m == f64::NEG_INFINITY;
            let what = match (turned, is_open && had_force) {
                (true, _) => Move::Turned,
                (false, true) => Move::Opened,
                (false, false) => Move::Along,
            };
            (piece, f64::NEG_INFINITY, what)
        };
        self.set(k, piece, follow);
        self.force_n[at as usize][k + 1] = piece.at_zero_n + piece.slope_n_per_m * deflection;
        what
    }

    /// Stored and dissipated energy of `k` in J.
    pub fn energies_j(&self, at: At, k: usize) -> (f64, f64) {
        let Some(law) = self.laws[k] else { return (0.0, 0.0) };
        let (contact, deflection) = (&self.contacts[k], self.deflection_m(at, k));
        match contact.stage {
            Stage::Below if self.is_open(k) && deflection <= self.opens_at_m(k) => {
                (0.0, contact.branch.dissipated_j)
            }
            Stage::Loading => {
                let i = law.piece_index(contact.index, deflection);
                let branch = law.branch(i, deflection.max(0.0));
                (branch.stored_j, branch.dissipated_j)
            }
            Stage::Below => law.energies_on_j(contact.index, &contact.branch, deflection),
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

    /// Deflection below which `k` is open.
    pub fn opens_at_m(&self, k: usize) -> f64 {
        self.lanes[k / LANES].to_m[k % LANES]
    }

    pub fn is_open(&self, k: usize) -> bool {
        self.lanes[k / LANES].from_m[k % LANES] == f64::NEG_INFINITY
    }
}
