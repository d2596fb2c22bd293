//! The filter of the force and the common times of the runs, by what the records hold.

use super::evidence::{Evidence, Proposed};
use super::masses::is_near;
use super::units::{digits, trimmed};
use crate::curve::recipe::{Filter, Sampling};

/// Class that is proposed, that of domain practice for forces of crash structures.
const CFC: u32 = 60;
/// Finer records are sampled at this interval: CFC 60 leaves nothing that needs more.
const FINEST_S: f64 = 1e-4;
const MOST_STATES: f64 = 20_000.0;

/// The times of a run's record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Times {
    pub contact_s: f64,
    pub last_s: f64,
    /// Usual interval of the states.
    pub interval_s: f64,
    pub states: usize,
}

/// Steps that differ from their median by less than this factor are one rate with jitter.
const JITTER: f64 = 0.5;

/// The usual interval of rising times: the mean of those near the median, since solvers write the
/// first cycle behind each multiple. 0 for fewer than two times.
pub(super) fn interval(time: &[f64]) -> f64 {
    let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    let Some(&median) = steps.get(steps.len() / 2) else { return 0.0 };
    let usual = steps.iter().filter(|step| is_near(**step, median, JITTER));
    let (sum, count) = usual.fold((0.0, 0.0), |(sum, count), step| (sum + step, count + 1.0));
    sum / count
}

/// `means`: why the forces are means over their intervals, if they are.
pub(super) fn filter(means: Option<&str>, interval_s: f64) -> Proposed<Filter> {
    let longest_s = 1.0 / (10.0 * f64::from(CFC));
    let ms = digits(interval_s * 1e3);
    match means {
        Some(why) => Proposed::found(Filter::None, Evidence::Read(why.into())),
        None if interval_s <= longest_s => Proposed::found(
            Filter::Cfc(CFC),
            Evidence::Guessed(format!("the usual class; one force each {ms} ms allows it")),
        ),
        None => Proposed::found(
            Filter::None,
            Evidence::Computed(format!(
                "one force each {ms} ms is too coarse for CFC {CFC}, which needs one each {} ms",
                digits(longest_s * 1e3)
            )),
        ),
    }
}

/// Common times that cover every record from its contact on; the coarsest interval of all.
pub(super) fn sampling(runs: &[Times]) -> Option<Proposed<Sampling>> {
    let coarsest = runs.iter().map(|run| run.interval_s).fold(0.0, f64::max);
    let longest = runs.iter().map(|run| run.last_s - run.contact_s).fold(0.0, f64::max);
    if !(coarsest > 0.0 && longest > 0.0) {
        return None;
    }
    let least = coarsest.max(FINEST_S).max(longest / MOST_STATES);
    let interval_s = rounded(least, longest);
    let states = (longest / interval_s * (1.0 + 1e-6)).floor() as usize + 1;
    let alike = runs.iter().all(|run| is_near(run.interval_s, coarsest, 0.01));
    let ms = |s: f64| digits(s * 1e3);
    let from = match (alike, least > 1.01 * coarsest) {
        (_, true) => format!(
            "the records have a state each {} ms at the coarsest; {} ms is enough",
            ms(coarsest),
            ms(interval_s)
        ),
        (true, false) => {
            format!("interval and length of the records, of up to {} states", most(runs))
        }
        (false, false) => "interval of the coarsest record, length of the longest".into(),
    };
    let sampling = Sampling { states: states.max(2), interval_s };
    Some(Proposed::found(sampling, Evidence::Computed(from)))
}

fn most(runs: &[Times]) -> usize {
    runs.iter().map(|run| run.states).max().unwrap_or(0)
}

/// The shortest decimal that is off by less than half an interval at the end of the record:
/// solvers write the first cycle behind each multiple.
fn rounded(interval_s: f64, longest_s: f64) -> f64 {
    let ms = interval_s * 1e3;
    let states = longest_s / interval_s;
    let decimals = (0..12).map(|digits| trimmed(&format!("{ms:.digits$}")));
    decimals
        .filter_map(|text| text.parse::<f64>().ok())
        .find(|short| *short > 0.0 && (short / ms - 1.0).abs() * states < 0.5)
        .map_or(interval_s, |short| short * 1e-3)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(interval_s: f64, contact_s: f64, last_s: f64) -> Times {
        Times { contact_s, last_s, interval_s, states: (last_s / interval_s) as usize + 1 }
    }

    fn proposed(runs: &[Times]) -> Sampling {
        *sampling(runs).unwrap().value().unwrap()
    }

    #[test]
    fn the_records_interval_is_taken_without_the_solvers_jitter() {
        let found = proposed(&[record(0.7500057e-3, 0.0, 0.2992523)]);
        assert_eq!((found.states, found.interval_s), (400, 0.75e-3));
        let found = proposed(&[record(1e-5, 0.01, 0.11)]);
        assert_eq!((found.states, found.interval_s), (1001, 1e-4));
        let found = proposed(&[record(1e-3, 0.0, 0.1), record(0.5e-3, 0.0, 0.2)]);
        assert_eq!((found.states, found.interval_s), (201, 1e-3));
        assert!(sampling(&[]).is_none());
    }

    #[test]
    fn the_filter_is_what_the_interval_allows() {
        assert_eq!(filter(None, 1e-4).value(), Some(&Filter::Cfc(60)));
        assert_eq!(filter(None, 2e-3).value(), Some(&Filter::None));
        assert_eq!(filter(Some("a mean"), 1e-4).to_string(), "read: a mean");
    }
}
