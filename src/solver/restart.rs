//! States that a restart wrote again, and states whose time is out of order.

use super::problem::{Diagnostics, Place, Problem, ProblemCode};

/// Indices of the states that count, by one rule for all files: of what was written again the
/// last writing. A single state whose time is before its neighbours' stays where the file has
/// it, and is named.
///
/// `is_same`: whether a state is written again by another of its time below it; `None` if the
/// file does not state it.
/// `place`: where a state begins. `of`: what stands ahead of each message.
///
/// Returns the indices, increasing, and what was left out or is out of order.
pub(crate) fn resolve(
    time: &[f64],
    is_same: impl Fn(usize, usize) -> Option<bool>,
    place: impl Fn(usize) -> Option<Place>,
    of: &str,
) -> (Vec<usize>, Diagnostics) {
    let mut problems = Diagnostics::default();
    let mut kept: Vec<usize> = Vec::with_capacity(time.len());
    for i in 0..time.len() {
        let goes_back = i > 0 && time[i] < time[i - 1];
        let again = i > 0 && time[i] == time[i - 1] && is_same(i - 1, i) == Some(true);
        let is_single = time.get(i + 1).is_none_or(|&next| i > 0 && next > time[i - 1]);
        if goes_back && is_single {
            let message = format!(
                "{of}time {:?} of state {} is before the time of the state above it",
                time[i],
                i + 1
            );
            problems.push(Problem::at(ProblemCode::TimeGoesBack, place(i), message));
        } else if goes_back || again {
            // Where time goes back, a restart may count its cycles from 0.
            let stays = |k: usize| {
                let is_other = || again && is_same(k, i) == Some(false);
                time[k] < time[i] || time[k] == time[i] && is_other()
            };
            let from = kept.iter().rposition(|&k| stays(k)).map_or(0, |k| k + 1);
            let left_out = kept.split_off(from);
            if let (Some(&first), Some(&last)) = (left_out.first(), left_out.last()) {
                let (at, from, to, count) = (time[i], time[first], time[last], left_out.len());
                let message = if again && first == last {
                    format!("{of}the state at time {at:?} is written twice: the last one counts")
                } else {
                    format!(
                        "{of}a restart writes again from time {at:?} on: {count} states above, from time {from:?} to {to:?}, are left out"
                    )
                };
                problems.push(Problem::at(ProblemCode::RepeatedState, place(i), message));
            }
        }
        kept.push(i);
    }
    (kept, problems)
}

/// Steps of the last digit by which neighbours lie apart where an equal time is the same state.
const STEPS: f64 = 10.0;

/// Whether two states of one time are the same one: neighbours at other times are much further
/// away than the last digit of the times can resolve.
pub(crate) fn is_known_apart(time: &[f64], above: usize, below: usize, digits: i32) -> bool {
    let at = time[below];
    let before = time[..above].iter().rev().find(|&&t| t != at);
    let behind = time[below..].iter().find(|&&t| t != at);
    let nearest = before.into_iter().chain(behind).map(|t| (t - at).abs()).reduce(f64::min);
    let exponent = if at == 0.0 { f64::NEG_INFINITY } else { at.abs().log10().floor() };
    nearest.is_some_and(|gap| gap >= STEPS * 10f64.powf(exponent - f64::from(digits - 1)))
}

/// Keeps the values of some states; none where no history is kept.
pub(crate) fn take<T: Copy>(values: &mut Vec<T>, kept: &[usize]) {
    if !values.is_empty() {
        *values = kept.iter().map(|&i| values[i]).collect();
    }
}
