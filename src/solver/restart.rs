//! States that a restart wrote again, and states whose time is out of order.

use super::problem::{Place, ProblemCode, Problems};

/// Indices of the states that count, by one rule for all files: of what was written again the
/// last writing. A single state whose time is before its neighbours' stays where the file has
/// it, and is named.
///
/// `repeats`: whether a state with the time of the one above it is that state again.
/// `place`: where a state begins.
pub fn resolve(
    time: &[f64],
    repeats: impl Fn(usize) -> bool,
    place: impl Fn(usize) -> Option<Place>,
    of: &str,
    problems: &mut Problems,
) -> Vec<usize> {
    let mut kept: Vec<usize> = Vec::with_capacity(time.len());
    for i in 0..time.len() {
        let goes_back = i > 0 && time[i] < time[i - 1];
        let again = i > 0 && time[i] == time[i - 1] && repeats(i);
        let is_single = time.get(i + 1).is_none_or(|&next| i > 0 && next > time[i - 1]);
        if goes_back && is_single {
            let message = format!(
                "{of}time {:?} of state {} is before the time of the state above it",
                time[i],
                i + 1
            );
            problems.add(ProblemCode::TimeGoesBack, place(i), None, message);
        } else if goes_back || again {
            let from = kept.iter().rposition(|&k| time[k] < time[i]).map_or(0, |k| k + 1);
            let left_out = kept.split_off(from);
            if let (Some(&first), Some(&last)) = (left_out.first(), left_out.last()) {
                let message = format!(
                    "{of}a restart writes again from time {:?} on: {} states above, from time {:?} to {:?}, are left out",
                    time[i],
                    left_out.len(),
                    time[first],
                    time[last]
                );
                problems.add(ProblemCode::RepeatedState, place(i), None, message);
            }
        }
        kept.push(i);
    }
    kept
}
