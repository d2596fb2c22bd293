//! What happened when in a run: contacts, stages, the ends of curves, the largest crush.

use serde::Serialize;

use super::{PLATES, Prepared};
use crate::multibody::{BodyHistory, InterfaceHistory, Run};
use crate::order;

/// Something that happened at an interface.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Event<'a> {
    pub(crate) time_s: f64,
    pub(crate) interface: &'a str,
    #[serde(flatten)]
    pub(crate) what: Happening,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub(crate) enum Happening {
    Contact,
    /// A stage of the curve begins, named as in the scenario.
    Stage {
        name: String,
    },
    /// From here the force is an assumption.
    BeyondData,
    LargestCrush,
    Opened,
    /// After it had opened.
    ContactAgain,
    /// A coupling that has opened begins to pull.
    Pull,
    /// It no longer pulls.
    Slack,
}

impl Happening {
    /// In words.
    pub(crate) fn text(&self) -> String {
        match self {
            Self::Contact => "contact".into(),
            Self::Stage { name } => format!("{name} begins"),
            Self::BeyondData => "crushed beyond the data of its curve".into(),
            Self::LargestCrush => "largest crush".into(),
            Self::Opened => "separation".into(),
            Self::ContactAgain => "contact again".into(),
            Self::Pull => "pull".into(),
            Self::Slack => "slack".into(),
        }
    }
}

/// A gap or a crush below this, in m, is none: outputs round.
const LEAST_M: f64 = 1e-6;
/// What an interface does for less time, in s, is rattle.
const OPEN_S: f64 = 0.01;

/// In order of time; between outputs by linear interpolation, but for the first contact and the largest crush, which the
/// run knows.
pub(super) fn sequence<'a>(prepared: &'a Prepared, run: &Run) -> Vec<Event<'a>> {
    let mut events = Vec::new();
    let interfaces = prepared.chain.interfaces().iter().zip(&run.interfaces).zip(&prepared.used);
    for ((interface, history), used) in interfaces {
        // Plates belong to the ends that they stand between, but tell when these meet.
        let is_plates = used.curve == PLATES;
        let mut add = |time_s, what| {
            events.push(Event { time_s, interface: &interface.name, what });
        };
        let crossing = |level_m| crossing_s(&run.time_s, &history.largest_deflection_m, level_m);
        contacts(&run.time_s, history).into_iter().for_each(|(time_s, what)| add(time_s, what));
        let Some(crushed_s) = crossing(LEAST_M) else { continue };
        let contact_s = history.contact_time_s.unwrap_or(crushed_s);
        add(contact_s, Happening::Contact);
        if is_plates {
            continue;
        }
        for (begin_m, name) in used.stages.iter() {
            let name = name.clone();
            if let Some(time_s) = crossing(*begin_m) {
                add(time_s.max(contact_s), Happening::Stage { name });
            }
        }
        if history.is_beyond_data()
            && let Some(time_s) = crossing(history.data_end_m)
        {
            add(time_s.max(contact_s), Happening::BeyondData);
        }
        // At the end of the run it is still crushed.
        if run.time_s.last().is_some_and(|end_s| history.max_deflection_time_s < *end_s) {
            add(history.max_deflection_time_s, Happening::LargestCrush);
        }
    }
    order::sort(&mut events, |a, b| a.time_s.total_cmp(&b.time_s));
    events
}

/// When a rising history first passes a level.
fn crossing_s(time_s: &[f64], values: &[f64], level: f64) -> Option<f64> {
    let k = values.iter().position(|value| *value > level)?;
    let Some(before) = k.checked_sub(1) else { return Some(time_s[0]) };
    let share = (level - values[before]) / (values[k] - values[before]);
    Some(time_s[before] + share * (time_s[k] - time_s[before]))
}

/// What an interface does at an output.
#[derive(Clone, Copy, PartialEq)]
enum State {
    Open,
    Pushes,
    /// A coupling beyond its initial length, which a damper may push meanwhile.
    Pulls,
}

/// Where the force ends for longer than a rattle, and where it then begins again; of a coupling, where it begins to pull and to push.
/// The contact that the run knows is left out.
fn contacts(time_s: &[f64], history: &InterfaceHistory) -> Vec<(f64, Happening)> {
    let state = |k: usize| match history.force_n[k] {
        0.0 => State::Open,
        _ if history.deflection_m.get(k).is_some_and(|d| *d < -LEAST_M) => State::Pulls,
        _ => State::Pushes,
    };
    let count = time_s.len();
    let lasts = |from: usize, to: usize| time_s[to.min(count - 1)] - time_s[from] >= OPEN_S;
    let next = |from: usize, is_open: bool| {
        (from..count).find(|k| (state(*k) == State::Open) == is_open).unwrap_or(count)
    };
    let mut events = Vec::new();
    let mut begin = next(0, false);
    while begin < count {
        // Up to where it is open for longer.
        let mut end = next(begin, true);
        while end < count && next(end, false) < count && !lasts(end, next(end, false)) {
            end = next(next(end, false), true);
        }
        if end < count && !lasts(end, next(end, false)) {
            end = count;
        }
        // Pushes and pulls in it, of which the first may be short.
        let mut stretches: Vec<(usize, State)> = Vec::new();
        let mut from = begin;
        while from < end {
            let now = state(from);
            let differs = |k: &usize| state(*k) != now && state(*k) != State::Open;
            let to = (from..end).find(differs).unwrap_or(end);
            let is_new = stretches.last().is_none_or(|(_, before)| *before != now);
            if is_new && (stretches.is_empty() || lasts(from, to)) {
                stretches.push((from, now));
            }
            from = to;
        }
        for (k, now) in &stretches {
            let what = if *now == State::Pulls { Happening::Pull } else { Happening::ContactAgain };
            events.push((begun_s(time_s, &history.force_n, *k), what));
        }
        if end < count {
            let pulled = stretches.last().is_some_and(|(_, last)| *last == State::Pulls);
            let what = if pulled { Happening::Slack } else { Happening::Opened };
            events.push((opened_s(time_s, &history.force_n, end), what));
        }
        begin = next(end, false);
    }
    let first = events.iter().position(|(_, what)| *what == Happening::ContactAgain);
    first.into_iter().for_each(|first| drop(events.remove(first)));
    events
}

/// When a force that is 0 at output `open` and was not before ended: along the line through its last two values.
fn opened_s(time_s: &[f64], force_n: &[f64], open: usize) -> f64 {
    let last = open - 1;
    let before = last.checked_sub(1).map_or(0.0, |k| force_n[k]);
    let fall = before - force_n[last];
    let share = if fall * force_n[last] > 0.0 { force_n[last] / fall } else { 1.0 };
    time_s[last] + share.min(1.0) * (time_s[open] - time_s[last])
}

/// When a force that is not 0 at output `k` and was before began: along the line through its first two values.
fn begun_s(time_s: &[f64], force_n: &[f64], k: usize) -> f64 {
    if k == 0 {
        return time_s[0];
    }
    let rise = force_n.get(k + 1).map_or(0.0, |next| next - force_n[k]);
    let share = if rise * force_n[k] > 0.0 { force_n[k] / rise } else { 1.0 };
    time_s[k] - share.min(1.0) * (time_s[k] - time_s[k - 1])
}

/// Between outputs further apart than this, in s, speeds are not straight lines.
const MOST_INTERVAL_S: f64 = 0.02;

/// When the mean speed of the first train no longer exceeds that of the second, or 0 against a wall.
pub(super) fn common_speed_time_s(prepared: &Prepared, run: &Run) -> Option<f64> {
    if prepared.settings.output_interval_s > MOST_INTERVAL_S {
        return None;
    }
    let (first, second) = run.bodies.split_at(prepared.meeting + 1);
    let mean = |masses_kg: &[f64], of: &[BodyHistory], t: usize| {
        let mass_kg: f64 = masses_kg.iter().sum();
        let pairs = masses_kg.iter().zip(of);
        let momentum: f64 = pairs.map(|(mass_kg, h)| mass_kg * h.v_m_per_s[t]).sum();
        if mass_kg > 0.0 { momentum / mass_kg } else { 0.0 }
    };
    // Falls to 0; the sign is turned, so that it rises.
    let closing = |t: usize| {
        let masses_kg = run.masses_kg(&prepared.chain, t);
        let (of_first, of_second) = masses_kg.split_at(first.len());
        mean(of_second, second, t) - mean(of_first, first, t)
    };
    let closing: Vec<f64> = (0..run.time_s.len()).map(closing).collect();
    let is_closing = closing.first().is_some_and(|first| *first < 0.0);
    is_closing.then(|| crossing_s(&run.time_s, &closing, 0.0)).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A damper pushes and pulls wherever it closes or opens; short stretches are rattle.
    #[test]
    fn a_coupling_pulls_beyond_its_length_whatever_its_damper_does() {
        let time_s: Vec<f64> = (0..100).map(|k| f64::from(k) * 1e-3).collect();
        let of = |k: u32| match k {
            0..5 => (-0.001, 0.0),
            5..30 => (0.010, 2e5),
            30..33 => (-0.005, 0.0),
            33..60 => (-0.020, if k.is_multiple_of(2) { 1e4 } else { -3e4 }),
            _ => (-0.005, 0.0),
        };
        let (deflection_m, force_n) = (0..100).map(of).unzip();
        let history = InterfaceHistory { deflection_m, force_n, ..InterfaceHistory::default() };
        let events: Vec<Happening> =
            contacts(&time_s, &history).into_iter().map(|(_, what)| what).collect();
        assert_eq!(events, [Happening::Pull, Happening::Slack]);
        // What chatters is in contact, however short each touch is.
        let of = |k: u32| match k {
            0..5 | 40..=99 if k % 8 < 5 => (0.01, 2e5),
            _ => (-0.001, 0.0),
        };
        let (deflection_m, force_n) = (0..130).map(of).unzip();
        let time_s: Vec<f64> = (0..130).map(|k| f64::from(k) * 1e-3).collect();
        let history = InterfaceHistory { deflection_m, force_n, ..InterfaceHistory::default() };
        let events: Vec<Happening> =
            contacts(&time_s, &history).into_iter().map(|(_, what)| what).collect();
        assert_eq!(events, [Happening::Opened, Happening::ContactAgain, Happening::Opened]);
    }

    /// A force that rises evenly begins where its line does, one that jumps at the output before.
    #[test]
    fn a_contact_begins_again_between_outputs() {
        let time_s: Vec<f64> = (0..60).map(|k| f64::from(k) * 1e-3).collect();
        let force_n = |rise: &dyn Fn(f64) -> f64| -> Vec<f64> {
            let of = |t: f64| if t < 0.0105 { 5e5 } else { rise(t - 0.0304) };
            time_s.iter().map(|t| of(*t)).collect()
        };
        let again = |force_n: Vec<f64>| {
            let history = InterfaceHistory { force_n, ..InterfaceHistory::default() };
            let events = contacts(&time_s, &history);
            assert_eq!(events[1].1, Happening::ContactAgain);
            events[1].0
        };
        assert!((again(force_n(&|since| (1e8 * since).max(0.0))) - 0.0304).abs() < 1e-9);
        assert_eq!(again(force_n(&|since| if since > 0.0 { 2e6 } else { 0.0 })), 0.030);
    }
}
