//! Signals: checked values over time, brought to common times; the shift that matches two best.

use std::ops::Range;

use crate::error::{Error, error};
use crate::signal::{CfcError, cfc, interpolate};

/// Interval of ISO/TS 18571: 10 kHz.
pub(crate) const INTERVAL_S: f64 = 1e-4;
/// Minimum number of samples of a signal: fewer are points, not a history.
pub(crate) const LEAST_SAMPLES: usize = 5;
/// Most common samples: 500 s, far beyond any collision.
const MOST_COMMON: f64 = 5e6;
/// Larger magnitudes are not measured values, and their squares would overflow.
const LARGEST: f64 = 1e100;

/// A signal: values at times in s.
///
/// Invariant: equal lengths of at least five, all finite, time strictly increasing.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Signal {
    name: String,
    time_s: Vec<f64>,
    values: Vec<f64>,
}

/// Records that last longer than this are probably not of a collision, but count their times in a smaller unit.
const LONG_S: f64 = 2.0;

/// What the filter cannot take of a signal of that length. The filter's own words name the recipe's entry.
fn too_much(error: &CfcError, length_s: f64) -> String {
    match error {
        CfcError::TooCoarse { class, interval_s, longest_s } => {
            let fits = |(_, size): &(&str, f64)| interval_s * size <= *longest_s;
            let unit = [("ms", 1e-3), ("us", 1e-6)].into_iter().find(fits);
            let unit = match unit.filter(|_| length_s > LONG_S) {
                Some((unit, _)) => format!(
                    "it lasts {length_s} s, so its times may be in {unit}: then write ,time={unit} after the file's name; else "
                ),
                None => String::new(),
            };
            format!(
                "its samples are {interval_s:.2e} s apart, too far for CFC {class}: at most {longest_s:.2e} s; {unit}use a lower class or no filter"
            )
        }
        CfcError::Uneven { spread_percent } => format!(
            "its intervals differ by up to {spread_percent:.0} % of their mean, too much for a CFC filter: use no filter"
        ),
    }
}

impl Signal {
    /// `name` appears in messages and results; `time_s` in s.
    ///
    /// # Errors
    /// With the number of the first wrong sample, counted from 1.
    pub(crate) fn new(name: &str, time_s: Vec<f64>, values: Vec<f64>) -> Result<Self, Error> {
        if time_s.len() != values.len() {
            return Err(error!(
                Rating,
                "columns differ in length: {times} times, {values} values",
                times = time_s.len(),
                values = values.len()
            ));
        }
        if values.len() < LEAST_SAMPLES {
            return Err(error!(
                Rating,
                "a signal needs at least {LEAST_SAMPLES} samples, found {samples}",
                samples = values.len()
            ));
        }
        let wrong = |v: &f64| !v.is_finite() || v.abs() > LARGEST;
        for column in [&time_s, &values] {
            if let Some(i) = column.iter().position(wrong) {
                return Err(error!(
                    Rating,
                    "sample {sample}: the value is {value}: expected a finite number up to 1e100",
                    sample = i + 1,
                    value = column[i]
                ));
            }
        }
        if let Some(i) = time_s.windows(2).position(|t| t[1] <= t[0]) {
            let (before_s, time_s) = (time_s[i], time_s[i + 1]);
            return Err(error!(
                Rating,
                "sample {sample}: time {time_s} s does not come after {before_s} s: times must increase strictly, so cut or sort the file first",
                sample = i + 2
            ));
        }
        Ok(Self { name: name.into(), time_s, values })
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    pub(crate) fn values(&self) -> &[f64] {
        &self.values
    }

    /// First and last time, in s.
    pub(crate) fn range_s(&self) -> (f64, f64) {
        (self.time_s[0], self.time_s[self.time_s.len() - 1])
    }

    /// How many of its samples lie from one time to another.
    pub(crate) fn samples_within(&self, from_s: f64, to_s: f64) -> usize {
        self.time_s.iter().filter(|t| (from_s..=to_s).contains(t)).count()
    }

    /// The signal after a CFC filter without phase shift, at its own times.
    pub(crate) fn filtered(&self, class: u32) -> Result<Self, Error> {
        let (first_s, last_s) = self.range_s();
        let filtered = cfc::filter(class, &self.time_s, &self.values).map_err(|source| {
            let why = too_much(&source, last_s - first_s);
            error!(Rating, "{name}: {why}", name = self.name).caused_by(source)
        })?;
        Ok(Self { values: filtered.values, ..self.clone() })
    }
}

/// Two signals at common times, [`INTERVAL_S`] apart.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Pair {
    pub time_s: Vec<f64>,
    pub reference: Vec<f64>,
    pub prediction: Vec<f64>,
}

impl Pair {
    /// Interpolates linearly from the first common time on, within `from_s` and `to_s`.
    pub(crate) fn new(
        reference: &Signal,
        prediction: &Signal,
        (from_s, to_s): (Option<f64>, Option<f64>),
        least: usize,
    ) -> Result<Self, Error> {
        let (r, p) = (reference.range_s(), prediction.range_s());
        // To a nanosecond, since times in milliseconds are not exact in seconds.
        let shown = |time_s: f64| (time_s * 1e9).round() / 1e9;
        let no_overlap = || {
            error!(
                Rating,
                "there are no common times: the reference goes from {} s to {} s, the prediction from {} s to {} s; check the units of time",
                shown(r.0),
                shown(r.1),
                shown(p.0),
                shown(p.1)
            )
        };
        let common = (r.0.max(p.0), r.1.min(p.1));
        if common.0 >= common.1 {
            return Err(no_overlap());
        }
        let ends = [("from", from_s), ("to", to_s)];
        let asked = ends.into_iter().filter_map(|(which, s)| Some(format!("{which} {} s", s?)));
        let asked = asked.collect::<Vec<_>>().join(" ");
        let from_s = common.0.max(from_s.unwrap_or(common.0));
        let to_s = common.1.min(to_s.unwrap_or(common.1));
        if from_s >= to_s {
            return Err(error!(
                Rating,
                "the requested interval, {asked}, is empty or lies outside the common times from {} s to {} s",
                shown(common.0),
                shown(common.1)
            ));
        }
        // Times are rounded: a last sample that is missed by so little still counts.
        let samples = ((to_s - from_s) / INTERVAL_S + 1e-6).floor() + 1.0;
        if samples > MOST_COMMON {
            return Err(error!(
                Rating,
                "the common times from {} s to {} s hold {samples:.0} samples at 10 kHz, {MOST_COMMON:.0} at most; check the units of time, or choose a shorter interval",
                shown(from_s),
                shown(to_s)
            ));
        }
        let samples = samples as usize;
        if samples < least {
            return Err(error!(
                Rating,
                "the common times from {} s to {} s hold {samples} samples at 10 kHz: at least {least} are needed; check the units of time and the requested interval",
                shown(from_s),
                shown(to_s)
            ));
        }
        let time_s: Vec<f64> =
            (0..samples).map(|i| (from_s + i as f64 * INTERVAL_S).min(to_s)).collect();
        let at = |signal: &Signal| interpolate(&signal.time_s, &signal.values, &time_s);
        // The times lie within both signals.
        let outside = |_| no_overlap();
        let reference = at(reference).map_err(outside)?;
        let prediction = at(prediction).map_err(outside)?;
        Ok(Self { time_s, reference, prediction })
    }
}

/// A correlation must rise by more than this to count as larger: two shifts that correlate
/// equally well differ by rounding, and the standard takes the smaller of them.
const ROUNDING: f64 = 1e-12;

/// A shift of the prediction against the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shift {
    /// Samples by which the prediction is late; negative if it is early.
    pub late: isize,
    /// Correlation of what overlaps.
    pub correlation: f64,
}

impl Shift {
    /// What overlaps of two signals of `n` samples: ranges of the reference and of the
    /// prediction.
    fn ranges(late: isize, n: usize) -> (Range<usize>, Range<usize>) {
        let by = late.unsigned_abs();
        if late >= 0 { (0..n - by, by..n) } else { (by..n, 0..n - by) }
    }

    /// The parts of reference and prediction that overlap after the shift.
    pub(crate) fn overlap<'a>(
        &self,
        reference: &'a [f64],
        prediction: &'a [f64],
    ) -> [&'a [f64]; 2] {
        let (r, p) = Self::ranges(self.late, reference.len());
        [&reference[r], &prediction[p]]
    }
}

/// The shift of at most a fifth of the samples with the largest correlation; of equal ones the
/// smallest, and of these the one that moves the prediction to the left.
///
/// Equal lengths, at least two. `correlation` takes the two overlapping parts; where it is not
/// defined it is not the largest. `None` if it is not defined without a shift.
pub(crate) fn best(
    reference: &[f64],
    prediction: &[f64],
    correlation: fn(&[f64], &[f64]) -> Option<f64>,
) -> Option<Shift> {
    let mut best = Shift { late: 0, correlation: correlation(reference, prediction)? };
    let most = (reference.len() / 5) as isize;
    for late in (1..=most).flat_map(|by| [by, -by]) {
        let shift = Shift { late, ..best };
        let [r, p] = shift.overlap(reference, prediction);
        if let Some(correlation) = correlation(r, p)
            && correlation > best.correlation + ROUNDING
        {
            best = Shift { late, correlation };
        }
    }
    Some(best)
}

/// Correlation coefficient of Pearson; `None` if one is constant.
pub(crate) fn centred(a: &[f64], b: &[f64]) -> Option<f64> {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (mean_a, mean_b) = (mean(a), mean(b));
    // A mean is rounded, and what a constant then leaves would correlate by chance.
    let least = |mean: f64| (ROUNDING * mean).powi(2) * a.len() as f64;
    let pairs = a.iter().zip(b).map(|(x, y)| (x - mean_a, y - mean_b));
    normalised(pairs, [least(mean_a), least(mean_b)])
}

/// Correlation of the values as they are; `None` if one is zero throughout.
pub(crate) fn plain(a: &[f64], b: &[f64]) -> Option<f64> {
    normalised(a.iter().zip(b).map(|(x, y)| (*x, *y)), [0.0; 2])
}

/// `Σxy/√(Σx² Σy²)`; `None` unless the squares are above the least.
fn normalised(pairs: impl Iterator<Item = (f64, f64)>, least: [f64; 2]) -> Option<f64> {
    let (mut xy, mut xx, mut yy) = (0.0, 0.0, 0.0);
    for (x, y) in pairs {
        xy += x * y;
        xx += x * x;
        yy += y * y;
    }
    (xx > least[0] && yy > least[1]).then(|| (xy / (xx.sqrt() * yy.sqrt())).clamp(-1.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(first_s: f64, step_s: f64, samples: usize) -> Signal {
        let time_s: Vec<f64> = (0..samples).map(|i| first_s + step_s * i as f64).collect();
        let values = time_s.iter().map(|t| 10.0 * t).collect();
        Signal::new("line", time_s, values).unwrap()
    }

    #[test]
    fn common_times_are_the_overlap() {
        let pair = Pair::new(&line(0.0, 0.75e-3, 400), &line(0.1, 1e-5, 10_001), (None, None), 12)
            .unwrap();
        assert_eq!((pair.time_s[0], pair.time_s[1000]), (0.1, 0.2));
        assert_eq!(pair.time_s.len(), 1001);
        for (t, (r, p)) in pair.time_s.iter().zip(pair.reference.iter().zip(&pair.prediction)) {
            assert!((r - 10.0 * t).abs() < 1e-12 && (p - 10.0 * t).abs() < 1e-12);
        }
        let a = line(0.0, 1e-3, 400);
        let pair = Pair::new(&a, &a, (Some(0.05), Some(0.06)), 12).unwrap();
        assert_eq!((pair.time_s[0], pair.time_s.len()), (0.05, 101));
    }

    #[test]
    fn errors_say_what_to_do() {
        let error = |time: &[f64], values: &[f64]| {
            Signal::new("x", time.to_vec(), values.to_vec()).unwrap_err().to_string()
        };
        assert_eq!(
            error(&[0.0, 1.0, 2.0, 2.0, 3.0], &[0.0; 5]),
            "sample 4: time 2 s does not come after 2 s: times must increase strictly, so cut or sort the file first"
        );
        assert_eq!(
            error(&[0.0, 1.0, 2.0, 3.0, 4.0], &[0.0, f64::NAN, 0.0, 0.0, 0.0]),
            "sample 2: the value is NaN: expected a finite number up to 1e100"
        );
        let long = line(0.0, 100.0, 10);
        let error = Pair::new(&long, &long, (None, None), 12).unwrap_err().to_string();
        assert!(error.contains("samples at 10 kHz, "), "{error}");
    }

    #[test]
    fn correlations_by_hand() {
        assert_eq!(plain(&[3.0, 4.0], &[4.0, 3.0]), Some(24.0 / 25.0));
        assert!((centred(&[3.0, 4.0], &[4.0, 3.0]).unwrap() + 1.0).abs() < 1e-15);
        assert_eq!(plain(&[0.0, 0.0], &[4.0, 3.0]), None);
        assert_eq!(centred(&[2.0, 2.0], &[4.0, 3.0]), None);
        // 0.1 has no exact mean.
        let wave: Vec<f64> = (0..1000).map(|i| f64::from(i).sin()).collect();
        assert_eq!(centred(&[0.1; 1000], &wave), None);
    }

    #[test]
    fn finds_a_delay_and_an_advance() {
        let wave = |late: f64| -> Vec<f64> {
            (0..100).map(|i| (-((f64::from(i) - 50.0 - late) / 10.0).powi(2)).exp()).collect()
        };
        for late in [0, 7, -7, 20, -20] {
            let found = best(&wave(0.0), &wave(late as f64), centred).unwrap();
            assert_eq!(found.late, late);
        }
        assert_eq!(best(&wave(0.0), &wave(30.0), centred).unwrap().late, 20, "a fifth at most");
    }

    #[test]
    fn equal_correlations_take_the_smallest_shift() {
        let ramp: Vec<f64> = (0..100).map(|i| 0.1 * f64::from(i)).collect();
        assert_eq!(best(&ramp, &ramp, centred).unwrap().late, 0);
        let saw: Vec<f64> = (0..100).map(|i| f64::from(i % 10)).collect();
        let late: Vec<f64> = (0..100).map(|i| f64::from((i + 5) % 10)).collect();
        assert_eq!(best(&saw, &late, plain).unwrap().late, 5, "left before right");
    }
}
