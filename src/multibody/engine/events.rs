//! Events: what happens where an interface leaves its piece within a step.

use super::super::bank::{At, Bank, Event, Kink, Way};
use super::super::integrator::{Method, SimulationError};
use super::super::rows::Place;
use super::{Engine, ahead};

/// A kink that an interface went over within the step.
pub(super) struct Crossed {
    pulls: bool,
    k: usize,
    place: Place,
    /// Whether the force inside the step is already that beyond it.
    inside: bool,
    kink: Kink,
}

impl<'a> Engine<'a> {
    /// Finds the pieces of all interfaces that have left theirs.
    #[cold]
    #[inline(never)]
    pub(super) fn settle(&mut self, at: At, h: f64, share: f64) {
        let mut left = std::mem::take(&mut self.left);
        self.push.left(|place| left.push((false, place)));
        if let Some(pull) = &self.pull {
            pull.left(|place| left.push((true, place)));
        }
        for &(pulls, place) in &left {
            self.settle_one(pulls, place, at, h, share);
        }
        left.clear();
        self.left = left;
    }

    #[inline(always)]
    fn bank(&self, pulls: bool) -> &Bank<'a> {
        match &self.pull {
            Some(pull) if pulls => pull,
            _ => &self.push,
        }
    }

    #[inline(always)]
    fn settle_one(&mut self, pulls: bool, place: Place, at: At, h: f64, share: f64) {
        let k = self.places.index(place);
        let inside = at == At::Inside;
        let turns = self.bank(pulls).turns(at, k, place);
        let top_m = if turns { Some(self.top_m(pulls, k, at, h, share)) } else { None };
        let (crossed, bank) = match &mut self.pull {
            Some(pull) if pulls => (&mut self.crossed, pull),
            _ => (&mut self.crossed, &mut self.push),
        };
        bank.settle(at, k, place, top_m, |kink| {
            crossed.push(Crossed { pulls, k, place, inside, kink });
        });
    }

    /// Where the deflection of an interface was largest: the vertex of the parabola through the
    /// nearest state whose speed is known.
    fn top_m(&mut self, pulls: bool, k: usize, at: At, h: f64, share: f64) -> f64 {
        let sign = if pulls { -1.0 } else { 1.0 };
        let rate = sign * self.between(if share >= 0.0 { &self.a_start } else { &self.a }, k);
        let speed = sign * self.closing(k) - share * h * rate;
        let bank = self.bank(pulls);
        let start_m = bank.deflection_m(At::Start, k);
        let near_m = if share >= 0.0 { start_m } else { bank.deflection_m(at, k) };
        let top_m = if rate < 0.0 { near_m + speed * speed / (-2.0 * rate) } else { near_m };
        let into_s = if rate < 0.0 { speed / -rate } else { 0.0 };
        let after_s = (if share >= 0.0 { into_s } else { h + into_s }).clamp(-h, h);
        self.watch.turned(pulls, k, top_m.max(start_m), self.end_s - h + after_s);
        top_m
    }

    /// What the quadrature of the step has missed, and what happened in it.
    #[cold]
    #[inline(never)]
    pub(super) fn finish(&mut self, h: f64, method: Method) -> Result<(), SimulationError> {
        let all = std::mem::take(&mut self.crossed);
        for crossed in &all {
            self.check_end(crossed)?;
            let Crossed { pulls, k, inside, ref kink, .. } = *crossed;
            let path = self.path(crossed, h);
            let Some(left_s) = path.since(kink, h) else { continue };
            let (impulse, moment) = path.missed(kink, left_s, inside, h, method);
            let sign = if pulls { -1.0 } else { 1.0 };
            self.push_apart(k, sign * impulse, sign * moment);
        }
        for crossed in &all {
            if let Some(event) = crossed.kink.event {
                self.see(crossed, event, h, method);
            }
        }
        self.crossed = all;
        self.crossed.clear();
        Ok(())
    }

    /// Fails if a curve that must not be left has ended.
    #[inline(always)]
    fn check_end(&self, crossed: &Crossed) -> Result<(), SimulationError> {
        let interface = &self.chain.interfaces()[crossed.k];
        let (law, bank, what) = match (&interface.tension, &self.pull) {
            (Some(tension), Some(pull)) if crossed.pulls => (&tension.law, pull, "pulled apart by"),
            _ => (&interface.law, &self.push, "crushed"),
        };
        let deflection_m = bank.deflections_m(At::End)[crossed.place];
        if !law.is_beyond_end(deflection_m) {
            return Ok(());
        }
        let (interface, time_s) = (interface.name.clone(), self.end_s);
        let end_m = law.end_m();
        Err(SimulationError::CurveEnd { interface, what, deflection_m, time_s, end_m })
    }

    /// The deflection over the step.
    #[inline(always)]
    fn path(&self, crossed: &Crossed, h: f64) -> Path {
        let bank = self.bank(crossed.pulls);
        let end_m = bank.deflections_m(At::End)[crossed.place];
        let moved = end_m - bank.deflections_m(At::Start)[crossed.place];
        let sign = if crossed.pulls { -1.0 } else { 1.0 };
        let rates = self.between(&self.a_start, crossed.k) + self.between(&self.a, crossed.k);
        let rate = 0.5 * sign * rates;
        Path { end_m, end_speed: moved / h + 0.5 * rate * h, rate }
    }

    /// A contact has begun or ended.
    fn see(&mut self, crossed: &Crossed, event: Event, h: f64, method: Method) {
        let k = crossed.k;
        let left_s = self.path(crossed, h).since(&crossed.kink, h).unwrap_or(0.0).clamp(0.0, h);
        self.damp_part_of_step(k, event, left_s, h);
        if crossed.pulls {
            return;
        }
        let ahead_s = ahead(method) * h;
        let rate = self.between(&self.a, k);
        let closing = self.closing(k) - ahead_s * rate;
        match event {
            // What the contact has not yet braked.
            Event::Contact => self.watch.contact(k, (closing - left_s * rate).max(closing)),
            Event::Closed => {}
            Event::Opened => self.watch.opened(k, -closing),
        }
        for i in self.sides(k) {
            let forces =
                |j: usize| j < self.chain.interfaces().len() && self.force_n(At::End, j) != 0.0;
            let touched = forces(i) || i > 0 && forces(i - 1);
            let place = self.places.of(i);
            let speed = self.v[place] - ahead_s * self.a[place];
            self.watch.body(i, touched, self.end_s - left_s, speed);
        }
    }

    /// Impulse of a damper that acted over a part of the step only, where its contact closed or
    /// a coupling opened; the quadrature has half of it.
    fn damp_part_of_step(&mut self, k: usize, event: Event, left_s: f64, h: f64) {
        let interface = &self.chain.interfaces()[k];
        let Some(damping) = &interface.damping else { return };
        let acts_s = match event {
            Event::Contact | Event::Closed => left_s,
            Event::Opened if interface.tension.is_some() => h - left_s,
            // What only pushes has no force any more when it opens.
            Event::Opened => return,
        };
        let closing = self.closing(k) - ahead(Method::Verlet) * h * self.between(&self.a, k);
        let impulse = (acts_s - 0.5 * h) * damping.at(closing) * closing;
        self.rates.damped_j += impulse * closing;
        self.push_apart(k, impulse, 0.0);
    }

    /// An impulse between the bodies at interface `k`, and its moment about the step's end.
    #[inline(always)]
    fn push_apart(&mut self, k: usize, impulse: f64, moment: f64) {
        let (behind, ahead) = (self.places.of(k), self.places.of(k + 1));
        self.v[behind] -= impulse * self.per_kg[behind];
        self.v[ahead] += impulse * self.per_kg[ahead];
        self.x_m[behind] -= moment * self.per_kg[behind];
        self.x_m[ahead] += moment * self.per_kg[ahead];
        if k + 1 == self.chain.bodies().len() {
            self.wall_impulse += impulse;
        }
    }
}

/// The parabola of a deflection over a step, seen from its end: `s` seconds before, the
/// deflection is `end − end_speed s + ½ rate s²`.
struct Path {
    end_m: f64,
    end_speed: f64,
    rate: f64,
}

impl Path {
    /// Time from the kink to the end of the step of `h` seconds; `None` if the path does not reach
    /// it. A turn may lie before the step's start, where the law had not yet noticed it.
    #[inline(always)]
    fn since(&self, kink: &Kink, h: f64) -> Option<f64> {
        let Self { end_m, end_speed, rate } = *self;
        let beyond = end_m - kink.at_m;
        if kink.way == Way::Turn {
            return (rate < 0.0).then(|| (end_speed / rate).clamp(0.0, 2.0 * h));
        }
        let squared = end_speed * end_speed - 2.0 * rate * beyond;
        if squared.is_nan() || squared < 0.0 {
            return None;
        }
        let speed = if kink.way == Way::Up { squared.sqrt() } else { -squared.sqrt() };
        let (sum, difference) = (end_speed + speed, end_speed - speed);
        // Of two forms of the root the one that does not cancel.
        let s = match sum.abs() >= difference.abs() {
            true => 2.0 * beyond / sum,
            false => difference / rate,
        };
        // Rates that change their sign within the step may put it anywhere.
        (s >= 0.0).then(|| s.min(h))
    }

    /// Impulse and moment about the step's end of the force that the kink, `s` seconds before
    /// the end, has added, less what the quadrature has of them.
    #[inline(always)]
    fn missed(&self, kink: &Kink, s: f64, inside: bool, h: f64, method: Method) -> (f64, f64) {
        let Self { end_m, end_speed, rate } = *self;
        let Kink { at_m, stiffer_n_per_m, jump_n, .. } = *kink;
        let beyond = end_m - at_m;
        let added = |s: f64| jump_n + stiffer_n_per_m * (beyond - s * (end_speed - 0.5 * rate * s));
        let impulse = s
            * (jump_n
                + stiffer_n_per_m * (beyond - s * (0.5 * end_speed - s * rate * (1.0 / 6.0))));
        let moment = s
            * s
            * (0.5 * jump_n
                + stiffer_n_per_m
                    * (0.5 * beyond - s * (end_speed * (1.0 / 3.0) - s * 0.125 * rate)));
        match method {
            Method::FourthOrder => {
                let inside = if inside { added(0.5 * h) } else { 0.0 };
                (
                    impulse - h * (1.0 / 6.0) * (4.0 * inside + added(0.0)),
                    moment - h * h * (1.0 / 3.0) * inside,
                )
            }
            Method::Verlet | Method::Reference => (impulse - 0.5 * h * added(0.0), moment),
        }
    }
}
