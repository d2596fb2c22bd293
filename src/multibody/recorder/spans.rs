//! Spans: the times in which the net contact force on a body has one sign.
//!
//! The recorder looks at a body every quarter of a millisecond; between two looks the force is
//! taken as a straight line. Contacts that open and close within a step announce themselves.

/// A span counts while its net force exceeds this, in N, as in finding the contact of an FE run,
/// if it changes the body's speed by [`LEAST_SHARE`] of the range of its speeds. Without it rounding
/// would decide: where vehicles touch without closing, what runs ahead of a shock grows from it,
/// and where neighbours come to press equally, the force dies away without an end. What is back
/// at the next look has not ended.
pub(super) const LEAST_N: f64 = 1e3;
/// Of a light body less counts: what it decelerates by a tenth of g.
pub(super) const LEAST_M_PER_S2: f64 = 1.0;
const LEAST_SHARE: f64 = 0.005;
/// The same of one shorter than [`RATTLE_S`].
const LEAST_SHARE_OF_SHORT: f64 = 0.05;
/// By so much a span has to be larger than those before it to be kept, so that few are.
const LARGER: f64 = 1.1;
/// Time between looks in s, if steps are not longer.
pub(in super::super) const LOOK_S: f64 = 0.25e-3;
/// Shorter than this, in s, is a push of vehicles that rattle: those that touch behind a force that begins above zero are pushed both ways
/// in turn. The half period of a vehicle on its buffers is ten times as long. Beside such a push, a pause or a push the other way
/// that is as short does not end a contact.
const RATTLE_S: f64 = 4.0 * LOOK_S;

/// A time and the speed of a body at it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in super::super) struct Moment {
    pub time_s: f64,
    pub v_m_per_s: f64,
}

/// Direction of the net contact force on a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Push {
    Forwards,
    Backwards,
}

/// What the net contact force on a body does, as far as looks have shown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) enum Phase {
    /// No force that counts.
    #[default]
    Free,
    /// A contact has begun; no look has yet seen its force.
    Announced { begin: Moment },
    /// A force that counts has acted since `begin`.
    Pressed { begin: Moment, push: Push },
    /// The force has been too small to count since `end`. It may come back.
    Fading { begin: Moment, push: Push, end: Moment },
}

/// A closed span of time in which the net contact force had one sign.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Span {
    begin: Moment,
    end: Moment,
    /// `None` where no look has seen the force.
    push: Option<Push>,
    /// The run ended before the force did.
    pub is_cut: bool,
}

/// What a look at a body shows: accelerations by contact forces at the last look and now.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    pub before_s: f64,
    pub before_a: f64,
    pub now: Moment,
    pub a: f64,
    /// Magnitude up to which an acceleration does not count.
    pub least_a: f64,
    /// Speed of the body before the force.
    pub free_speed: f64,
}

impl Look {
    /// Direction of the force; `None` if it is too small to count.
    fn push(&self) -> Option<Push> {
        match self.a {
            a if a.abs() <= self.least_a => None,
            a if a > 0.0 => Some(Push::Forwards),
            _ => Some(Push::Backwards),
        }
    }

    /// Begin of a force that nothing has announced, as if it had grown evenly.
    fn grown_from(&self) -> Moment {
        let since_s = 2.0 * (self.now.v_m_per_s - self.free_speed) / self.a;
        let time_s = self.now.time_s - since_s.clamp(0.0, self.now.time_s - self.before_s);
        Moment { time_s, v_m_per_s: self.free_speed }
    }

    /// End of a force that is gone now: somewhere since the last look.
    fn gone_at(&self) -> Moment {
        Moment { time_s: 0.5 * (self.before_s + self.now.time_s), ..self.now }
    }

    /// Where the straight line between the two accelerations crosses zero.
    fn crossed_zero_at(&self) -> Moment {
        let Moment { time_s, v_m_per_s } = self.now;
        let share = (self.a / (self.a - self.before_a)).clamp(0.0, 1.0);
        let left_s = (time_s - self.before_s) * share;
        Moment { time_s: time_s - left_s, v_m_per_s: v_m_per_s - 0.5 * self.a * left_s }
    }
}

impl Phase {
    /// The phase after a look, and the span that has ended by it.
    pub(crate) fn after(self, look: &Look) -> (Self, Option<Span>) {
        let ended = |begin, end, push| Some(Span { begin, end, push: Some(push), is_cut: false });
        match (self, look.push()) {
            (Self::Free, None) => (Self::Free, None),
            (Self::Free, Some(push)) => (Self::Pressed { begin: look.grown_from(), push }, None),
            // What was announced has no force that counts.
            (Self::Announced { .. }, None) => (Self::Free, None),
            (Self::Announced { begin }, Some(push)) => (Self::Pressed { begin, push }, None),
            (Self::Pressed { begin, push } | Self::Fading { begin, push, .. }, None)
                if look.a == 0.0 =>
            {
                (Self::Free, ended(begin, look.gone_at(), push))
            }
            (Self::Pressed { begin, push }, None) => {
                (Self::Fading { begin, push, end: look.gone_at() }, None)
            }
            (Self::Fading { end, .. }, None) if look.now.time_s - end.time_s < LOOK_S => {
                (self, None)
            }
            (Self::Fading { begin, end, push }, None) => (Self::Free, ended(begin, end, push)),
            (Self::Pressed { begin, push } | Self::Fading { begin, push, .. }, Some(now))
                if now == push =>
            {
                (Self::Pressed { begin, push }, None)
            }
            (Self::Fading { begin, end, push }, Some(now)) => {
                (Self::Pressed { begin: end, push: now }, ended(begin, end, push))
            }
            (Self::Pressed { begin, push }, Some(now)) => {
                let crossing = look.crossed_zero_at();
                (Self::Pressed { begin: crossing, push: now }, ended(begin, crossing, push))
            }
        }
    }

    /// The span up to `end`, where contacts have ended; `None` for a body that was free.
    pub(crate) fn closed_at(self, end: Moment) -> Option<Span> {
        match self {
            Self::Free => None,
            Self::Announced { begin } => Some(Span { begin, end, push: None, is_cut: false }),
            Self::Pressed { begin, push } | Self::Fading { begin, push, .. } => {
                Some(Span { begin, end, push: Some(push), is_cut: false })
            }
        }
    }

    /// The span up to the end of the run.
    pub(crate) fn at_end_of_run(self, run_end: Moment) -> Option<Span> {
        match self {
            // A force that was never examined does not count as one that still acts.
            Self::Free | Self::Announced { .. } => self.closed_at(run_end),
            Self::Pressed { begin, push } => {
                Some(Span { begin, end: run_end, push: Some(push), is_cut: true })
            }
            Self::Fading { end, .. } => self.closed_at(end),
        }
    }

    /// Accelerations between these change nothing: those too small to count of a free body, all
    /// of one sign while a force of that sign acts. Everything is new in the other phases.
    pub(crate) fn unchanged_between(self, least_a: f64) -> (f64, f64) {
        match self {
            Self::Free => (-least_a, least_a),
            Self::Announced { .. } | Self::Fading { .. } => (f64::INFINITY, f64::NEG_INFINITY),
            Self::Pressed { push: Push::Forwards, .. } => (least_a, f64::INFINITY),
            Self::Pressed { push: Push::Backwards, .. } => (f64::NEG_INFINITY, -least_a),
        }
    }
}

impl Span {
    /// Begin and end in s.
    pub(super) fn times_s(&self) -> (f64, f64) {
        (self.begin.time_s, self.end.time_s)
    }

    fn follows(&self, before: &Self, within_s: f64) -> bool {
        self.begin.time_s - before.end.time_s < within_s
    }

    fn is_alike(&self, other: &Self) -> bool {
        let gained = |span: &Self| span.end.v_m_per_s - span.begin.v_m_per_s;
        match (self.push, other.push) {
            // Brakes may slow a body that is pushed forwards.
            (Some(push), Some(other)) => push == other,
            _ => gained(self) * gained(other) > 0.0,
        }
    }

    fn is_short(&self) -> bool {
        self.end.time_s - self.begin.time_s < RATTLE_S
    }

    fn extend(&mut self, by: &Self) {
        (self.end, self.is_cut) = (by.end, by.is_cut);
        self.push = self.push.or(by.push);
    }

    /// Magnitude of the change of speed.
    fn change(&self) -> f64 {
        (self.begin.v_m_per_s - self.end.v_m_per_s).abs()
    }

    pub(crate) fn mean_deceleration(&self) -> f64 {
        (self.begin.v_m_per_s - self.end.v_m_per_s) / (self.end.time_s - self.begin.time_s)
    }
}

/// Spans of a body that may count.
#[derive(Clone, Debug, Default)]
pub(super) struct Spans {
    /// The last one, which goes on if a push in its direction follows soon: a contact that chatters is one.
    last: Option<Span>,
    /// Whether it ends in a short push.
    rattles: bool,
    /// A short push the other way since then.
    aside: Option<Span>,
    closed: Vec<Span>,
    /// The one with the largest change of speed so far.
    largest: Option<Span>,
    /// Lowest and highest speed at begins and ends.
    speeds: Option<(f64, f64)>,
}

impl Spans {
    /// Keeps a span that may count: before it there may be many that do not.
    pub(crate) fn close(&mut self, span: Span) {
        for Moment { v_m_per_s: v, .. } in [span.begin, span.end] {
            let (low, high) = self.speeds.unwrap_or((v, v));
            self.speeds = Some((low.min(v), high.max(v)));
        }
        let Some(mut aside) = self.aside.take() else { return self.append(span) };
        let is_alike = self.last.is_some_and(|last| span.is_alike(&last));
        if span.follows(&aside, RATTLE_S) && is_alike && (self.rattles || span.is_short()) {
            self.extend_last(&span);
        } else if span.follows(&aside, RATTLE_S) && !is_alike {
            aside.extend(&span);
            self.append(aside);
        } else {
            self.begin_with(aside);
            self.append(span);
        }
    }

    fn append(&mut self, span: Span) {
        let Some(last) = self.last else { return self.begin_with(span) };
        let within_s = if self.rattles || span.is_short() { RATTLE_S } else { LOOK_S };
        let follows = span.follows(&last, within_s);
        // Nothing shows that the end of the run is that of the contact.
        if follows && (span.is_alike(&last) || span.is_short() && span.is_cut) {
            self.extend_last(&span);
        } else if follows && span.is_short() {
            self.aside = Some(span);
        } else {
            self.begin_with(span);
        }
    }

    fn extend_last(&mut self, by: &Span) {
        self.rattles = by.is_short();
        if let Some(last) = &mut self.last {
            last.extend(by);
        }
    }

    /// The last one has ended.
    fn begin_with(&mut self, span: Span) {
        self.rattles = span.is_short();
        if let Some(before) = self.last.replace(span) {
            self.keep(before);
        }
    }

    /// Magnitude of the change of speed by the span that the end of the run has cut.
    pub(crate) fn running(&self) -> Option<f64> {
        self.last.filter(|last| last.is_cut).map(|last| last.change())
    }

    pub(crate) fn largest_change(&self) -> f64 {
        self.largest.map_or(0.0, |largest| largest.change())
    }

    /// All have been closed.
    pub(crate) fn ended(mut self) -> Self {
        for span in [self.last.take(), self.aside.take()].into_iter().flatten() {
            self.keep(span);
        }
        self
    }

    fn keep(&mut self, span: Span) {
        if self.largest.is_none_or(|largest| span.change() > largest.change()) {
            self.largest = Some(span);
        }
        let mut closed = std::mem::take(&mut self.closed);
        closed.retain(|span| self.counts(span));
        // One that is hardly larger than one before it is never the first that counts.
        let is_new = closed.last().is_none_or(|last| {
            span.change() >= LARGER * last.change() || last.is_short() && !span.is_short()
        });
        if is_new && self.counts(&span) {
            closed.push(span);
        }
        self.closed = closed;
    }

    /// Whether a span counts beside all that has changed the speed so far.
    fn counts(&self, span: &Span) -> bool {
        let range = self.speeds.map_or(0.0, |(low, high)| high - low);
        let least_share = if span.is_short() { LEAST_SHARE_OF_SHORT } else { LEAST_SHARE };
        span.change() >= least_share * range && span.end.time_s > span.begin.time_s
    }

    pub(crate) fn first(&self) -> Option<&Span> {
        // Where many small ones change the speed there is only the largest of them.
        let largest = self.largest.as_ref().filter(|span| span.end.time_s > span.begin.time_s);
        self.closed.iter().find(|span| self.counts(span)).or(largest)
    }

    /// The one that changes the speed most, if a smaller one comes before it.
    pub(crate) fn main(&self) -> Option<&Span> {
        let first = self.first()?;
        self.largest.as_ref().filter(|largest| self.counts(largest) && *largest != first)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BEGIN: Moment = Moment { time_s: 0.001, v_m_per_s: 10.0 };

    fn look(before_a: f64, a: f64) -> Look {
        let now = Moment { time_s: 0.010, v_m_per_s: 8.0 };
        Look { before_s: 0.00975, before_a, now, a, least_a: 0.1, free_speed: 10.0 }
    }

    fn pressed(begin: Moment, push: Push) -> Phase {
        Phase::Pressed { begin, push }
    }

    #[test]
    fn a_force_that_is_announced_begins_where_it_was() {
        let announced = Phase::Announced { begin: BEGIN };
        let (phase, ended) = announced.after(&look(0.0, -50.0));
        assert_eq!((phase, ended), (pressed(BEGIN, Push::Backwards), None));
        assert_eq!(announced.after(&look(0.0, 0.05)), (Phase::Free, None));
    }

    #[test]
    fn a_force_that_changes_its_sign_ends_where_its_line_crosses_zero() {
        let (phase, ended) = pressed(BEGIN, Push::Backwards).after(&look(-30.0, 10.0));
        let span = ended.unwrap();
        assert!((span.end.time_s - (0.010 - 0.25 * 0.25e-3)).abs() < 1e-15);
        assert_eq!(phase, pressed(span.end, Push::Forwards));
    }

    #[test]
    fn a_force_that_fades_ends_unless_it_comes_back() {
        let before = pressed(BEGIN, Push::Backwards);
        let (fading, ended) = before.after(&look(-30.0, -0.05));
        assert!(matches!(fading, Phase::Fading { .. }) && ended.is_none());
        assert_eq!(fading.after(&look(-0.05, -40.0)), (before, None));
        let later = |a| {
            let now = Moment { time_s: 0.0102, v_m_per_s: 8.0 };
            Look { now, before_s: 0.010, ..look(-0.05, a) }
        };
        let (phase, ended) = fading.after(&later(-0.05));
        assert!(phase == Phase::Free && ended.is_some());
        let (phase, _) = fading.after(&later(40.0));
        let Phase::Fading { end, .. } = fading else { panic!("{fading:?}") };
        assert_eq!(phase, pressed(end, Push::Forwards));
    }

    #[test]
    fn only_a_force_that_acts_is_cut_by_the_end_of_the_run() {
        let end = Moment { time_s: 0.3, v_m_per_s: 2.0 };
        let is_cut = |phase: Phase| phase.at_end_of_run(end).map(|span| span.is_cut);
        assert_eq!(is_cut(Phase::Free), None);
        assert_eq!(is_cut(Phase::Announced { begin: BEGIN }), Some(false));
        assert_eq!(is_cut(pressed(BEGIN, Push::Forwards)), Some(true));
        let fading = Phase::Fading { begin: BEGIN, push: Push::Forwards, end };
        assert_eq!(is_cut(fading), Some(false));
    }

    /// Hundreds of short pushes within a look of each other are one contact; others are not.
    #[test]
    fn a_contact_that_chatters_is_one() {
        let moment = |k: i32, since_s: f64, v_m_per_s: f64| Moment {
            time_s: f64::from(k) * 0.15e-3 + since_s,
            v_m_per_s,
        };
        let v = |k: i32| 5.0 + 2e-3 * f64::from(k);
        let mut spans = Spans::default();
        for k in 0..500 {
            let (begin, end) = (moment(k, 0.0, v(k)), moment(k, 0.05e-3, v(k + 1)));
            spans.close(Span { begin, end, push: None, is_cut: false });
        }
        let (begin, end) = (moment(502, 0.0, v(500)), moment(600, 0.0, v(100)));
        let other = Span { begin, end, push: None, is_cut: false };
        spans.close(other);
        let spans = spans.ended();
        let first = spans.first().unwrap();
        assert_eq!(first.times_s(), (0.0, moment(499, 0.05e-3, 0.0).time_s));
        assert!((first.mean_deceleration() * first.end.time_s + 1.0).abs() < 1e-12);
        assert_eq!(spans.main(), None);
    }

    #[test]
    fn spans_of_small_changes_do_not_count() {
        let span = |from: f64, to: f64| Span {
            push: None,
            begin: Moment { time_s: from, v_m_per_s: 10.0 },
            end: Moment { time_s: from + 0.01, v_m_per_s: to },
            is_cut: false,
        };
        let of = |all: &[Span]| {
            let mut spans = Spans::default();
            all.iter().for_each(|span| spans.close(*span));
            spans.ended()
        };
        let all = [span(0.0, 9.99), span(0.1, 5.0), span(0.2, 1.0), span(0.3, 2.0)];
        assert_eq!(of(&all[..1]).first(), Some(&all[0]));
        let two = of(&all[..2]);
        assert_eq!((two.first(), two.main()), (Some(&all[1]), None));
        assert_eq!(of(&all).first(), Some(&all[1]));
        assert_eq!(of(&all).main(), Some(&all[2]));
        // However many small ones come before it, those that count are kept.
        let small = |k: i32| span(f64::from(k), if k % 2 == 0 { 9.999 } else { 10.001 });
        let many: Vec<Span> = (0..200).map(small).chain([span(200.0, 5.0)]).collect();
        assert_eq!(of(&many).first(), many.last());
        let growing: Vec<Span> = (0..300).map(|k| span(f64::from(k), 9.99)).collect();
        let (half, large) = (span(300.0, 9.5), span(301.0, 5.0));
        let found = of(&[&growing[..], &[half, large]].concat());
        assert_eq!((found.first(), found.main()), (Some(&half), Some(&large)));
    }
}
