//! One interface on its law: its current branch, and what happens when it leaves a segment.

use super::super::law::{Branch, ForceLaw, Piece};

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
