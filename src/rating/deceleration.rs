//! Deceleration: the means by which a collision is judged.

use schemars::JsonSchema;
use serde::Serialize;

use super::differences::integral;

/// The deceleration begins above this share of its largest value.
const THRESHOLD: f64 = 0.05;
const MOVING_MEAN_S: f64 = 0.120;

/// Means of a deceleration, in the unit of the signal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Deceleration {
    /// Mean of −a from the first instant at which it exceeds 5 % of its largest value until it
    /// next returns to zero or the interval ends; null if it is never above zero. Where only the
    /// contact decelerates, that is the time in which the net contact force is above zero.
    pub mean: Option<f64>,
    /// Time at which that mean begins, in s.
    pub from_s: Option<f64>,
    /// Time at which it ends, in s.
    pub to_s: Option<f64>,
    /// Whether the interval ends while −a still exceeds 5 % of its largest value: the mean is then
    /// of a part of the deceleration.
    pub is_cut: bool,
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
        let phase = phase(time_s, &deceleration);
        Self {
            mean: phase.map(|p| p.mean),
            from_s: phase.map(|p| p.from_s),
            to_s: phase.map(|p| p.to_s),
            is_cut: phase.is_some_and(|p| p.is_cut),
            largest_120ms_mean: largest_moving_mean(time_s, &deceleration, MOVING_MEAN_S),
        }
    }
}

#[derive(Clone, Copy)]
struct Phase {
    mean: f64,
    from_s: f64,
    to_s: f64,
    is_cut: bool,
}

fn phase(time_s: &[f64], deceleration: &[f64]) -> Option<Phase> {
    let largest = deceleration.iter().copied().fold(0.0, f64::max);
    let above = |&d: &f64| d > THRESHOLD * largest && d > 0.0;
    let first = deceleration.iter().position(above)?;
    let length = deceleration[first..].iter().take_while(|&&d| d > 0.0).count();
    let after = first + length;
    let last = after - 1;
    let mut area = integral(&time_s[first..after], &deceleration[first..after]);
    let mut to_s = time_s[last];
    // The zero lies between two samples.
    if let Some(&below) = deceleration.get(after) {
        let share = deceleration[last] / (deceleration[last] - below);
        let part_s = share * (time_s[after] - time_s[last]);
        area += 0.5 * deceleration[last] * part_s;
        to_s += part_s;
    }
    let from_s = time_s[first];
    let mean = if to_s > from_s { area / (to_s - from_s) } else { deceleration[first] };
    let is_cut = after == deceleration.len() && above(&deceleration[last]);
    Some(Phase { mean, from_s, to_s, is_cut })
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

    fn times(samples: usize) -> Vec<f64> {
        (0..samples).map(|i| i as f64 * 1e-3).collect()
    }

    #[test]
    fn half_a_sine_has_the_mean_of_two_over_pi() {
        // 100 ms of deceleration from 10 ms on, then a rebound.
        let time = times(200);
        let a: Vec<f64> = time
            .iter()
            .map(|t| {
                if *t < 0.01 {
                    0.0
                } else {
                    -50.0 * ((t - 0.01) / 0.1 * std::f64::consts::PI).sin()
                }
            })
            .collect();
        let of = Deceleration::of(&time, &a);
        // 5 % are passed 1.6 ms after the begin: the next sample is the first.
        assert!((of.from_s.unwrap() - 0.012).abs() < 1e-12);
        assert!((of.to_s.unwrap() - 0.110).abs() < 1e-6);
        let x = 0.002 / 0.1 * std::f64::consts::PI;
        let mean = 50.0 * (1.0 + x.cos()) / (std::f64::consts::PI - x);
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
}
