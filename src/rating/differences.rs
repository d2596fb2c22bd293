//! Differences of two signals, sample by sample and over all of them; in magnitude and in phase;
//! and the mean decelerations by which a collision is judged.
//!
//! And CORA: correlation and analysis, a corridor and a cross-correlation.
//!
//! Gehre, Gades, Wernicke: Objective rating of signals using test and simulation responses,
//! ESV 2009, paper 09-0407, with that paper's parameters.

use std::f64::consts::{FRAC_PI_4, PI};

use serde::Serialize;

use super::iso18571::{MOST_SAMPLES, corridor};
use super::signal::{best, plain};

/// Values below this share of the largest magnitude have no relative error worth its name.
const SMALL: f64 = 0.05;
/// An integral below this share of that of the magnitudes is a difference of large numbers.
const CANCELS: f64 = 0.05;

/// Mean of `|p − r|/|r|` over the samples where `|r|` is at least 5 % of its maximum.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Pointwise {
    /// The mean; 0 where the signals agree.
    pub mean: f64,
    /// Share of the samples that are left out.
    pub left_out: f64,
}

/// The largest difference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct MaxAbs {
    /// `|p − r|`, in the unit of the signals.
    pub value: f64,
    /// Where it is, in s.
    pub time_s: f64,
}

/// Largest magnitude.
fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m: f64, v| m.max(v.abs()))
}

/// Pairs `(r, |p − r|)`.
fn pairs<'a>(r: &'a [f64], p: &'a [f64]) -> impl Iterator<Item = (f64, f64)> + 'a {
    r.iter().zip(p).map(|(r, p)| (*r, (p - r).abs()))
}

/// `‖p − r‖₂ / ‖r‖₂`; `None` if the reference is zero throughout. Equal lengths.
pub(crate) fn rms_ratio(reference: &[f64], prediction: &[f64]) -> Option<f64> {
    let squares: f64 = reference.iter().map(|r| r * r).sum();
    let differences: f64 = pairs(reference, prediction).map(|(_, d)| d * d).sum();
    (squares > 0.0).then(|| (differences / squares).sqrt())
}

/// Mean of `|p − r|` over the largest `|r|`; `None` if that is zero. Equal lengths.
pub(crate) fn peak_norm(reference: &[f64], prediction: &[f64]) -> Option<f64> {
    let scale = largest(reference);
    let sum: f64 = pairs(reference, prediction).map(|(_, d)| d).sum();
    (scale > 0.0).then(|| sum / reference.len() as f64 / scale)
}

/// See [`Pointwise`]; `None` if the reference is zero throughout. Equal lengths.
pub(crate) fn pointwise(reference: &[f64], prediction: &[f64]) -> Option<Pointwise> {
    let least = SMALL * largest(reference);
    let kept = pairs(reference, prediction).filter(|(r, _)| r.abs() >= least && *r != 0.0);
    let errors: Vec<f64> = kept.map(|(r, d)| d / r.abs()).collect();
    (!errors.is_empty()).then(|| Pointwise {
        mean: errors.iter().sum::<f64>() / errors.len() as f64,
        left_out: 1.0 - errors.len() as f64 / reference.len() as f64,
    })
}

/// The largest difference and its time; equal lengths, at least one.
pub(crate) fn max_abs(time_s: &[f64], reference: &[f64], prediction: &[f64]) -> MaxAbs {
    let mut found = MaxAbs { value: 0.0, time_s: time_s[0] };
    for (&time_s, (_, value)) in time_s.iter().zip(pairs(reference, prediction)) {
        if value > found.value {
            found = MaxAbs { value, time_s };
        }
    }
    found
}

/// Trapezoid sum of `values` over `along`; equal lengths.
pub(crate) fn integral(along: &[f64], values: &[f64]) -> f64 {
    let steps = along.windows(2).zip(values.windows(2));
    steps.map(|(x, v)| 0.5 * (v[0] + v[1]) * (x[1] - x[0])).sum()
}

/// `∫p / ∫r − 1` by trapezoids over `along`: over a deflection a force's error of energy, over
/// time a force's of impulse, an acceleration's of the change of speed.
///
/// Equal lengths; `along` increasing. `None` where it makes no sense, as the reference's positive
/// and negative parts nearly cancel (less than 5 % is left) or it is zero throughout.
pub(crate) fn integral_error(along: &[f64], reference: &[f64], prediction: &[f64]) -> Option<f64> {
    let magnitude: Vec<f64> = reference.iter().map(|r| r.abs()).collect();
    let of_reference = integral(along, reference);
    let of_magnitude = integral(along, &magnitude);
    let makes_sense = of_magnitude > 0.0 && of_reference.abs() >= CANCELS * of_magnitude;
    makes_sense.then(|| integral(along, prediction) / of_reference - 1.0)
}

/// Errors of magnitude and of phase, and their combination; 0 where the signals agree.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct MagnitudePhase {
    /// Above 0 if the prediction is larger.
    pub magnitude: f64,
    /// 0 to 1.
    pub phase: f64,
    /// Of Sprague and Geers the root of the sum of the two squares; of Russell that, times √(π/4).
    pub combined: f64,
}

/// `√Σr²`, `√Σp²` and `acos(Σrp / √(Σr² Σp²)) / π`; `None` if one of the signals is zero
/// throughout.
///
/// Near a cosine of 1 the inverse cosine makes 1e-8 of a rounding of 1e-16, so the angle is taken
/// from the sides of the rhombus that the two signals, each of length 1, span.
fn norms_and_phase(reference: &[f64], prediction: &[f64]) -> Option<[f64; 3]> {
    let norm = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>().sqrt();
    let (of_r, of_p) = (norm(reference), norm(prediction));
    let (mut apart, mut together) = (0.0, 0.0);
    for (r, p) in reference.iter().zip(prediction) {
        let (r, p) = (r / of_r, p / of_p);
        apart += (r - p) * (r - p);
        together += (r + p) * (r + p);
    }
    let angle = 2.0 * libm::atan2(apart.sqrt(), together.sqrt());
    (of_r > 0.0 && of_p > 0.0).then_some([of_r, of_p, angle / PI])
}

/// `M = √(Σp²/Σr²) − 1`, `P = acos(Σrp/√(Σr² Σp²))/π`, `C = √(M² + P²)`.
///
/// Equal lengths. Sprague, Geers: A spectral-element method for modelling cavitation in
/// transient fluid–structure interaction, Int. J. Numer. Meth. Eng. 60 (2004). `None` if one of
/// the signals is zero throughout.
pub(crate) fn sprague_geers(reference: &[f64], prediction: &[f64]) -> Option<MagnitudePhase> {
    let [of_r, of_p, phase] = norms_and_phase(reference, prediction)?;
    let magnitude = of_p / of_r - 1.0;
    Some(MagnitudePhase { magnitude, phase, combined: libm::hypot(magnitude, phase) })
}

/// `m = (Σp² − Σr²)/√(Σr² Σp²)`, `M = sgn(m) lg(1 + |m|)`, P as above, `C = √(π/4 (M² + P²))`.
///
/// Equal lengths. Russell: Error measures for comparing transient data, 68th Shock and
/// Vibration Symposium (1997). `None` if one of the signals is zero throughout.
pub(crate) fn russell(reference: &[f64], prediction: &[f64]) -> Option<MagnitudePhase> {
    let [of_r, of_p, phase] = norms_and_phase(reference, prediction)?;
    let m = of_p / of_r - of_r / of_p;
    let magnitude = libm::log10(1.0 + m.abs()).copysign(m);
    let combined = FRAC_PI_4.sqrt() * libm::hypot(magnitude, phase);
    Some(MagnitudePhase { magnitude, phase, combined })
}

/// Exponent K_V of the progression.
const PROGRESSION_EXPONENT: i32 = 10;
/// Shifts up to D_MIN of the interval count as none, from D_MAX on as the worst.
const D_MIN: f64 = 0.01;
const D_MAX: f64 = 0.12;
/// Weights of progression, size and phase.
const WEIGHTS: [f64; 3] = [0.5, 0.25, 0.25];

/// Ratings of CORA, each from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Cora {
    /// Corridor of 5 % and 50 % of the reference's largest magnitude, exponent 2.
    pub corridor: f64,
    /// `(½ (K + 1))¹⁰` of the largest correlation K.
    pub progression: f64,
    /// The smaller over the larger sum of squares after the shift.
    pub size: f64,
    /// 1 for a shift up to 1 % of the interval, falling to 0 at 12 %.
    pub phase: f64,
    /// Half the progression, plus a quarter each of size and phase.
    pub cross_correlation: f64,
    /// Mean of corridor and cross-correlation.
    pub rating: f64,
    /// By how much the prediction is late, in s; negative if it is early. At most a fifth of
    /// the interval.
    pub late_s: f64,
}

/// Rates a prediction by CORA over the whole interval that is given: the program's automatic
/// choice of an interval is left to the caller.
///
/// Equal lengths of 2 to [`MOST_SAMPLES`], samples at `interval_s`; `None` otherwise. Signals are
/// shifted within the interval, and 80 % of it (INT_MIN) must overlap. A signal of zeros
/// correlates with nothing: progression, size and phase are 0, unless both are zero.
pub(crate) fn cora(reference: &[f64], prediction: &[f64], interval_s: f64) -> Option<Cora> {
    let n = reference.len();
    if !(2..=MOST_SAMPLES).contains(&n) || prediction.len() != n {
        return None;
    }
    let corridor = corridor(reference, prediction);
    let shift = best(reference, prediction, plain);
    let [progression, size, phase] = match shift {
        Some(shift) => {
            let [r, p] = shift.overlap(reference, prediction);
            let share = shift.late.unsigned_abs() as f64 / (n - 1) as f64;
            [
                (0.5 * (shift.correlation + 1.0)).powi(PROGRESSION_EXPONENT),
                size(r, p),
                ((D_MAX - share) / (D_MAX - D_MIN)).clamp(0.0, 1.0),
            ]
        }
        None if reference == prediction => [1.0; 3],
        None => [0.0; 3],
    };
    let parts = [progression, size, phase];
    let cross_correlation = parts.iter().zip(WEIGHTS).map(|(part, weight)| part * weight).sum();
    Some(Cora {
        corridor,
        progression,
        size,
        phase,
        cross_correlation,
        rating: 0.5 * (corridor + cross_correlation),
        late_s: shift.map_or(0.0, |s| s.late as f64 * interval_s),
    })
}

/// The smaller over the larger sum of squares.
fn size(a: &[f64], b: &[f64]) -> f64 {
    let squares = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>();
    let (a, b) = (squares(a), squares(b));
    if a == b { 1.0 } else { a.min(b) / a.max(b) }
}

/// The deceleration begins above this share of its largest value.
const THRESHOLD: f64 = 0.05;
/// Spells of deceleration that change the speed by less than this share of the largest do not count, as in a run.
const LEAST_CHANGE: f64 = 0.005;
const MOVING_MEAN_S: f64 = 0.120;

/// Means of a deceleration, in the unit of the signal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Deceleration {
    /// Mean of −a from the first instant at which it exceeds 5 % of its largest value until it
    /// next returns to zero or the interval ends; null if it is never above zero. Where only the
    /// contact decelerates, that is the time in which the net contact force is above zero. Spells that
    /// change the speed by less than 0.5 % of what the largest does, as noise does, do not count.
    pub mean: Option<f64>,
    /// Time at which that mean begins, in s.
    pub from_s: Option<f64>,
    /// Time at which it ends, in s.
    pub to_s: Option<f64>,
    /// Last time before that at which −a exceeds 5 % of its largest value, in s.
    pub above_to_s: Option<f64>,
    /// Whether the interval ends while −a still exceeds 5 % of its largest value: the mean then
    /// covers only part of the deceleration.
    pub is_cut: bool,
    /// Share of that time in all that −a, where it is above zero, takes off the speed.
    pub share_of_change: Option<f64>,
    /// Times above zero that count, of which it is the first.
    pub pulses: usize,
    /// Largest mean of −a over 120 ms; null if the interval is shorter.
    pub largest_120ms_mean: Option<f64>,
}

impl Deceleration {
    /// Of an acceleration `a` over `time_s` (s, increasing, equal intervals, at least two).
    ///
    /// Between samples −a is linear. EN 15227 limits the mean while the net contact force is
    /// above zero; of a signal without its force the deceleration itself gives start and end.
    pub(crate) fn of(time_s: &[f64], acceleration: &[f64]) -> Self {
        let deceleration: Vec<f64> = acceleration.iter().map(|a| -a).collect();
        let largest_120ms_mean = largest_moving_mean(time_s, &deceleration, MOVING_MEAN_S);
        let largest = deceleration.iter().copied().fold(0.0, f64::max);
        let above = |d: f64| d > THRESHOLD * largest && d > 0.0;
        let spells = spells(time_s, &deceleration, above);
        let most = spells.iter().map(|spell| spell.change).fold(0.0, f64::max);
        let counts = |spell: &&Spell| spell.change >= LEAST_CHANGE * most;
        let Some(Spell { first, last, to_s, change }) = spells.iter().find(counts).copied() else {
            return Self { largest_120ms_mean, ..Self::default() };
        };
        let above_to = (first..=last).rev().find(|&k| above(deceleration[k]));
        let from_s = time_s[first];
        let mean = if to_s > from_s { change / (to_s - from_s) } else { deceleration[first] };
        let positive: Vec<f64> = deceleration.iter().map(|d| d.max(0.0)).collect();
        let all = integral(time_s, &positive);
        Self {
            mean: Some(mean),
            from_s: Some(from_s),
            to_s: Some(to_s),
            above_to_s: above_to.map(|k| time_s[k]),
            is_cut: last + 1 == deceleration.len() && above(deceleration[last]),
            pulses: spells.iter().filter(counts).count(),
            share_of_change: (all > 0.0).then(|| (change / all).min(1.0)),
            largest_120ms_mean,
        }
    }
}

/// Samples above zero, from one that exceeds the threshold on.
#[derive(Clone, Copy)]
struct Spell {
    first: usize,
    last: usize,
    /// Where it returns to zero, or the last sample.
    to_s: f64,
    /// Integral.
    change: f64,
}

fn spells(time_s: &[f64], deceleration: &[f64], above: impl Fn(f64) -> bool) -> Vec<Spell> {
    let (mut found, mut from) = (Vec::new(), 0);
    while let Some(first) = (from..deceleration.len()).find(|&k| above(deceleration[k])) {
        let after = first + deceleration[first..].iter().take_while(|&&d| d > 0.0).count();
        let last = after - 1;
        let mut change = integral(&time_s[first..after], &deceleration[first..after]);
        let mut to_s = time_s[last];
        // The zero lies between two samples.
        if let Some(&below) = deceleration.get(after) {
            let share = deceleration[last] / (deceleration[last] - below);
            let part_s = share * (time_s[after] - time_s[last]);
            change += 0.5 * deceleration[last] * part_s;
            to_s += part_s;
        }
        found.push(Spell { first, last, to_s, change });
        from = after;
    }
    found
}

/// Largest mean of `values` over any `length_s` that begins at a sample; equal intervals.
fn largest_moving_mean(time_s: &[f64], values: &[f64], length_s: f64) -> Option<f64> {
    let interval_s = (time_s[time_s.len() - 1] - time_s[0]) / (time_s.len() - 1) as f64;
    let steps = (length_s / interval_s).round() as usize;
    if steps == 0 || steps >= values.len() {
        return None;
    }
    let mut sums = vec![0.0];
    let mut sum = 0.0;
    for pair in values.windows(2) {
        sum += 0.5 * (pair[0] + pair[1]);
        sums.push(sum);
    }
    let means = sums.iter().zip(&sums[steps..]).map(|(a, b)| (b - a) / steps as f64);
    means.max_by(f64::total_cmp)
}

#[cfg(test)]
mod tests {
    use super::*;

    const R: [f64; 4] = [0.0, -10.0, 4.0, 0.4];
    const P: [f64; 4] = [1.0, -8.0, 5.0, 0.4];

    #[test]
    fn differences_by_hand() {
        let rms = rms_ratio(&R, &P).unwrap();
        assert!((rms - (6.0_f64 / 116.16).sqrt()).abs() < 1e-15);
        assert!((peak_norm(&R, &P).unwrap() - 0.1).abs() < 1e-15);
        // 0.2 and 0.25; 0 and 0.4 are left out.
        let pointwise = pointwise(&R, &P).unwrap();
        assert!((pointwise.mean - 0.225).abs() < 1e-15 && pointwise.left_out == 0.5);
        let time = [0.0, 0.1, 0.2, 0.3];
        assert_eq!(max_abs(&time, &R, &P), MaxAbs { value: 2.0, time_s: 0.1 });
    }

    #[test]
    fn integral_by_hand() {
        let along = [0.0, 1.0, 3.0];
        // 1 + 6 against 1.5 + 8.
        let error = integral_error(&along, &[0.0, 2.0, 4.0], &[0.0, 3.0, 5.0]).unwrap();
        assert!((error - (9.5 / 7.0 - 1.0)).abs() < 1e-15);
        assert_eq!(integral_error(&[0.0, 1.0, 2.0], &[1.0, 0.0, -1.0], &[1.0; 3]), None);
    }

    #[test]
    fn a_reference_of_zeros_has_no_ratio() {
        let (zero, one) = ([0.0; 3], [1.0; 3]);
        assert_eq!(rms_ratio(&zero, &one), None);
        assert_eq!(peak_norm(&zero, &one), None);
        assert_eq!(pointwise(&zero, &one), None);
        assert_eq!(integral_error(&[0.0, 1.0, 2.0], &zero, &one), None);
        assert_eq!(max_abs(&zero, &zero, &one).value, 1.0);
    }

    #[test]
    fn a_scaled_signal_by_hand() {
        // 1.3 times a plateau: distance 0.3 of the maximum, squares 1.69.
        let p = [1.3; 100];
        let rated = cora(&[1.0; 100], &p, 1e-4).unwrap();
        let corridor = (0.2_f64 / 0.45).powi(2);
        assert!((rated.corridor - corridor).abs() < 1e-14);
        assert!((rated.progression - 1.0).abs() < 1e-14 && rated.phase == 1.0);
        assert!((rated.size - 1.0 / 1.69).abs() < 1e-14);
        let cross = 0.5 + 0.25 / 1.69 + 0.25;
        assert!((rated.cross_correlation - cross).abs() < 1e-14);
        assert!((rated.rating - 0.5 * (corridor + cross)).abs() < 1e-14);
    }

    #[test]
    fn the_phase_falls_between_one_and_twelve_percent() {
        let pulse = |at: usize| -> Vec<f64> { (0..1001).map(|i| f64::from(i == at)).collect() };
        let phase = |late: usize| cora(&pulse(400), &pulse(400 + late), 1e-4).unwrap().phase;
        assert_eq!([phase(0), phase(10), phase(120), phase(150)], [1.0, 1.0, 0.0, 0.0]);
        assert!((phase(65) - 0.5).abs() < 1e-12);
        assert!((cora(&pulse(400), &pulse(465), 1e-4).unwrap().late_s - 0.0065).abs() < 1e-15);
    }

    #[test]
    fn the_progression_of_an_opposite_constant_is_nothing() {
        let rated = cora(&[1.0; 100], &[-1.0; 100], 1e-4).unwrap();
        assert_eq!((rated.progression, rated.size, rated.corridor), (0.0, 1.0, 0.0));
    }

    #[test]
    fn zeros_correlate_with_nothing_but_zeros() {
        assert_eq!(cora(&[0.0; 20], &[0.0; 20], 1e-4).unwrap().rating, 1.0);
        assert_eq!(cora(&[0.0; 20], &[1.0; 20], 1e-4).unwrap().rating, 0.0);
        assert_eq!(cora(&vec![0.0; MOST_SAMPLES + 1], &vec![0.0; MOST_SAMPLES + 1], 1e-4), None);
    }

    fn times(samples: usize) -> Vec<f64> {
        (0..samples).map(|i| i as f64 * 1e-3).collect()
    }

    #[test]
    fn half_a_sine_has_the_mean_of_two_over_pi() {
        // 100 ms of deceleration from 10 ms on, then a rebound.
        let time = times(200);
        let sine = |t: &f64| -50.0 * ((t - 0.01) / 0.1 * PI).sin();
        let a: Vec<f64> = time.iter().map(|t| if *t < 0.01 { 0.0 } else { sine(t) }).collect();
        let of = Deceleration::of(&time, &a);
        // 5 % are passed 1.6 ms after the begin: the next sample is the first.
        assert!((of.from_s.unwrap() - 0.012).abs() < 1e-12);
        assert!((of.to_s.unwrap() - 0.110).abs() < 1e-6);
        let x = 0.002 / 0.1 * PI;
        let mean = 50.0 * (1.0 + x.cos()) / (PI - x);
        assert!((of.mean.unwrap() - mean).abs() < 1e-2, "{of:?}");
    }

    #[test]
    fn a_triangle_by_hand() {
        // 0, 2, 4, 2, −2: above 0 from the first 2 to half way after the last: 2.5 steps.
        let of = Deceleration::of(&times(5), &[0.0, -2.0, -4.0, -2.0, 2.0]);
        assert!((of.mean.unwrap() - (3.0 + 3.0 + 0.5) / 2.5).abs() < 1e-12);
        assert!((of.to_s.unwrap() - 3.5e-3).abs() < 1e-12);
        assert_eq!(of.largest_120ms_mean, None);
    }

    #[test]
    fn an_interval_that_ends_in_the_pulse_is_said() {
        let cut = |a: &[f64]| Deceleration::of(&times(a.len()), a).is_cut;
        assert!(cut(&[0.0, -2.0, -40.0, -20.0]));
        assert!(!cut(&[0.0, -2.0, -40.0, -20.0, 1.0]));
        assert!(!cut(&[0.0, -2.0, -40.0, -1.9]), "what remains is below 5 %");
        assert!(!cut(&[0.0, -40.0, 1.0, -40.0]), "a second pulse is not in the mean");
    }

    /// Noise before the impact rises above 5 % of its peak, but changes the speed by next to nothing.
    #[test]
    fn noise_before_the_impact_does_not_count() {
        let mut a = vec![0.0, -3.0, 1.0];
        a.extend([-40.0; 80]);
        a.extend([1.0, 0.0]);
        let of = Deceleration::of(&times(a.len()), &a);
        assert!(of.from_s.unwrap() > 2.9e-3 && of.mean.unwrap() > 39.0, "{of:?}");
        assert!(of.share_of_change.unwrap() > 0.99);
        // Two pulses: the mean is that of the first, which is half of it.
        let two = [[-40.0; 40], [1.0; 40], [-40.0; 40]].concat();
        let of = Deceleration::of(&times(120), &two);
        assert!((of.share_of_change.unwrap() - 0.5).abs() < 0.01, "{of:?}");
    }

    #[test]
    fn the_moving_mean_finds_the_plateau() {
        let time = times(400);
        let a: Vec<f64> =
            time.iter().map(|t| if (0.1..0.2).contains(t) { -60.0 } else { 0.0 }).collect();
        // 99 whole steps and two halves of one.
        let mean = Deceleration::of(&time, &a).largest_120ms_mean.unwrap();
        assert!((mean - 60.0 * 100.0 / 120.0).abs() < 1e-9, "{mean}");
    }

    #[test]
    fn what_only_speeds_up_has_no_mean() {
        assert_eq!(Deceleration::of(&times(5), &[1.0; 5]).mean, None);
        assert_eq!(Deceleration::of(&times(5), &[0.0; 5]).mean, None);
    }

    #[test]
    fn a_doubled_signal_has_no_phase_error() {
        let (r, p) = ([3.0, -4.0], [6.0, -8.0]);
        let sg = sprague_geers(&r, &p).unwrap();
        assert_eq!((sg.magnitude, sg.phase, sg.combined), (1.0, 0.0, 1.0));
        // m = (100 − 25)/50 = 1.5.
        let russell = russell(&r, &p).unwrap();
        assert!((russell.magnitude - 2.5_f64.log10()).abs() < 1e-15);
        assert!((russell.combined - FRAC_PI_4.sqrt() * 2.5_f64.log10()).abs() < 1e-15);
    }

    #[test]
    fn a_quarter_wave_is_half_and_the_opposite_all() {
        for rate in [sprague_geers, russell] {
            let quarter = rate(&[1.0, 0.0], &[0.0, 1.0]).unwrap();
            assert!(quarter.magnitude == 0.0 && (quarter.phase - 0.5).abs() < 1e-15);
            assert_eq!(rate(&[1.0, 2.0], &[-1.0, -2.0]).unwrap().phase, 1.0);
            let angle = rate(&[1.0, 0.0], &[1.0, 1e-12]).unwrap().phase * PI;
            assert!((angle - 1e-12).abs() < 1e-24, "{angle}");
            assert_eq!(rate(&[0.0, 0.0], &[1.0, 2.0]), None);
        }
        assert!(russell(&[2.0, 0.0], &[1.0, 0.0]).unwrap().magnitude < 0.0);
    }
}
