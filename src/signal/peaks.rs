//! Peaks of a signal by their prominence, and those of two signals that match.

/// A peak counts if it stands out by this share of the largest value.
pub(crate) const PROMINENCE: f64 = 0.1;
/// Peaks of the reference that are looked for in the prediction.
const PEAKS: usize = 2;
/// A predicted peak matches if it lies no further off than this share of the range.
const MATCH: f64 = 0.1;

/// Indices of the local maxima of `values` whose prominence is at least `prominence`.
///
/// Prominence is the height over the higher of the two lowest values that must be passed on
/// the way to a larger maximum, or to the end. Of a plateau the first point counts; the
/// ends count if the values fall from them. Takes a time in proportion to the number of values.
pub(crate) fn peaks(values: &[f64], prominence: f64) -> Vec<usize> {
    let left = saddles(values.iter());
    let mut right = saddles(values.iter().rev());
    right.reverse();
    (0..values.len())
        .filter(|&i| is_maximum(values, i) && values[i] - base(left[i], right[i]) >= prominence)
        .collect()
}

/// The first of [`peaks`], in a time in proportion to what lies before it and up to the next larger value.
pub(crate) fn first_peak(values: &[f64], prominence: f64) -> Option<usize> {
    let mut passed = Passed::default();
    (0..values.len()).find(|&i| {
        let left = passed.saddle_before(values[i]);
        // Between two larger values the base is not below either saddle.
        if left.higher && values[i] - left.lowest < prominence || !is_maximum(values, i) {
            return false;
        }
        let after = &values[i + 1..];
        let larger = after.iter().position(|&v| v > values[i]);
        let lower = &after[..larger.unwrap_or(after.len())];
        let lowest = lower.iter().copied().fold(values[i], f64::min);
        values[i] - base(left, Saddle { lowest, higher: larger.is_some() }) >= prominence
    })
}

/// Whether a value is larger than the one before, and than the next that differs.
fn is_maximum(values: &[f64], i: usize) -> bool {
    let falls = || {
        let after = values[i..].iter().find(|&&v| v != values[i]);
        after.is_none_or(|&v| v < values[i])
    };
    (i == 0 || values[i - 1] < values[i]) && falls()
}

/// What the prominence of a value counts from, of the saddles on both sides.
fn base(left: Saddle, right: Saddle) -> f64 {
    match (left, right) {
        (Saddle { lowest, higher: true }, Saddle { higher: false, .. })
        | (Saddle { higher: false, .. }, Saddle { lowest, higher: true }) => lowest,
        // The highest of all, or between two higher ones.
        (l, r) if l.higher => l.lowest.max(r.lowest),
        (l, r) => l.lowest.min(r.lowest),
    }
}

/// What lies before a value, back to the first larger one.
#[derive(Clone, Copy)]
struct Saddle {
    lowest: f64,
    /// Whether there is a larger one.
    higher: bool,
}

/// What no later value has yet exceeded, falling from bottom to top, each with the lowest value after the one
/// below it.
#[derive(Default)]
struct Passed(Vec<(f64, f64)>);

impl Passed {
    /// The saddle before the next value.
    fn saddle_before(&mut self, value: f64) -> Saddle {
        let mut lowest = value;
        while let Some((_, low)) = self.0.pop_if(|(top, _)| *top <= value) {
            lowest = lowest.min(low);
        }
        let higher = !self.0.is_empty();
        self.0.push((value, lowest));
        Saddle { lowest, higher }
    }
}

fn saddles<'a>(values: impl Iterator<Item = &'a f64>) -> Vec<Saddle> {
    let mut passed = Passed::default();
    values.map(|&value| passed.saddle_before(value)).collect()
}

/// A peak of a reference and the one of a prediction that matches it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MatchedPeak {
    /// Abscissa and value of the reference.
    pub reference: (f64, f64),
    /// Abscissa and value of the prediction; `None` if it has no peak there.
    pub prediction: Option<(f64, f64)>,
}

/// The first two peaks of `reference` along `along`, and the peaks of `prediction` nearest to
/// them.
///
/// Equal lengths, at least one; `along` increasing. Prominence is a tenth of each one's
/// largest value; a peak further off than a tenth of the range of `along` is missing.
pub(crate) fn matched_peaks(
    along: &[f64],
    reference: &[f64],
    prediction: &[f64],
) -> Vec<MatchedPeak> {
    let prominent =
        |values: &[f64]| peaks(values, PROMINENCE * values.iter().copied().fold(0.0, f64::max));
    let found = prominent(prediction);
    let near = MATCH * (along[along.len() - 1] - along[0]);
    prominent(reference)
        .into_iter()
        .take(PEAKS)
        .map(|peak| {
            let distance = |&i: &usize| (along[i] - along[peak]).abs();
            let matched = found
                .iter()
                .filter(|i| distance(i) <= near)
                .min_by(|a, b| distance(a).total_cmp(&distance(b)));
            MatchedPeak {
                reference: (along[peak], reference[peak]),
                prediction: matched.map(|&i| (along[i], prediction[i])),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_by_prominence() {
        let values = [0.0, 3.0, 1.0, 1.5, 1.2, 5.0, 5.0, 2.0, 4.0];
        assert_eq!(peaks(&values, 1.0), [1, 5, 8]);
        assert_eq!(peaks(&values, 0.2), [1, 3, 5, 8]);
        assert_eq!(peaks(&values, 2.5), [5]);
        assert_eq!(peaks(&[2.0, 1.0, 3.0], 0.5), [0, 2]);
        assert_eq!(peaks(&[1.0, 1.0], 0.5), [] as [usize; 0]);
    }

    /// Prominence by its definition: walks away from the peak until a value is larger.
    fn prominence(values: &[f64], i: usize) -> f64 {
        let lowest = |side: Vec<f64>| {
            let end = side.iter().position(|&v| v > values[i]);
            let passed = &side[..end.unwrap_or(side.len())];
            (passed.iter().copied().fold(values[i], f64::min), end.is_some())
        };
        let left = lowest(values[..i].iter().rev().copied().collect());
        let right = lowest(values[i + 1..].to_vec());
        values[i]
            - match (left.1, right.1) {
                (true, false) => left.0,
                (false, true) => right.0,
                (true, true) => left.0.max(right.0),
                (false, false) => left.0.min(right.0),
            }
    }

    #[test]
    fn prominence_is_that_of_its_definition() {
        let mut state = 7_u64;
        for _ in 0..200 {
            let values: Vec<f64> = (0..30)
                .map(|_| {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                    (state >> 60) as f64
                })
                .collect();
            let all = peaks(&values, 0.0);
            for least in [1.0, 4.0, 9.0] {
                let expected: Vec<usize> =
                    all.iter().copied().filter(|&i| prominence(&values, i) >= least).collect();
                assert_eq!(peaks(&values, least), expected, "{values:?}");
                assert_eq!(first_peak(&values, least), expected.first().copied(), "{values:?}");
            }
        }
    }

    /// Every peak of a falling saw would have to look at all that follows.
    #[test]
    fn a_million_peaks_take_no_square_of_the_time() {
        let saw: Vec<f64> = (0..1_000_000).map(|i| f64::from(i % 2) - f64::from(i)).collect();
        assert_eq!(peaks(&saw, 0.5).len(), 1);
        let saw: Vec<f64> = (0..1_000_000).map(|i| f64::from(i % 2 * 4 - i)).collect();
        assert_eq!(peaks(&saw, 0.5).len(), 500_000);
        assert_eq!([first_peak(&saw, 0.5), first_peak(&saw, 2e6)], [Some(1), None]);
    }

    #[test]
    fn peaks_are_matched_or_missing() {
        let along: Vec<f64> = (0..=10).map(f64::from).collect();
        let reference = [0.0, 4.0, 1.0, 1.0, 1.0, 1.0, 3.0, 1.0, 1.0, 2.0, 0.0];
        let prediction = [0.0, 2.0, 5.0, 1.0, 1.0, 1.0, 1.0, 1.0, 3.0, 1.0, 0.0];
        let matched = matched_peaks(&along, &reference, &prediction);
        assert_eq!(
            matched,
            [
                MatchedPeak { reference: (1.0, 4.0), prediction: Some((2.0, 5.0)) },
                MatchedPeak { reference: (6.0, 3.0), prediction: None },
            ]
        );
    }
}
