//! Round numbers along an axis, and how they are written.

/// Positions of ticks with the digits that they need after the point.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Ticks {
    pub(super) values: Vec<f64>,
    pub(super) step: f64,
    decimals: usize,
}

/// A power of ten, by multiplication: the same bits everywhere.
fn ten_to(power: i32) -> f64 {
    let mut value = 1.0;
    for _ in 0..power.abs() {
        value *= 10.0;
    }
    if power < 0 { 1.0 / value } else { value }
}

/// The smallest of 1, 2, 5 times a power of ten that is not below `least`, and the power.
fn round_up(least: f64) -> (f64, i32) {
    let mut power = 0;
    while power > -300 && ten_to(power) > least {
        power -= 1;
    }
    while power < 307 && ten_to(power + 1) <= least {
        power += 1;
    }
    for digit in [1.0, 2.0, 5.0] {
        if digit * ten_to(power) >= least {
            return (digit * ten_to(power), power);
        }
    }
    (10.0 * ten_to(power), power + 1)
}

/// The largest power of ten that is not above a value.
fn magnitude(value: f64) -> i32 {
    let mut power = 0;
    while power > -300 && ten_to(power) > value * (1.0 + 1e-9) {
        power -= 1;
    }
    while power < 308 && ten_to(power + 1) <= value * (1.0 + 1e-9) {
        power += 1;
    }
    power
}

/// Number of ticks above which a span is refused by all callers' sizes.
const MOST: f64 = 1e3;

impl Ticks {
    /// Ticks between `low` and `high`, about `most` of them at the most.
    pub(super) fn new(low: f64, high: f64, most: usize) -> Self {
        let width = (high - low).clamp(f64::MIN_POSITIVE, f64::MAX);
        // Numbers this close together relative to their size cannot be written apart.
        let least = (width / most.max(1) as f64).max(1e-9 * low.abs().max(high.abs()));
        let (step, power) = round_up(least);
        // In steps, so that nothing overflows.
        let slack = 1e-9;
        let first = (low / step - slack).ceil();
        let count = ((high / step + slack).floor() - first).clamp(-1.0, MOST) + 1.0;
        let values = (0..count as usize)
            .map(|k| (first + k as f64) * step)
            .filter(|v| v.is_finite())
            .collect();
        Self { values, step, decimals: usize::try_from(-power).unwrap_or(0) }
    }

    /// A tick's number: `-1.5`, `0`, `2e12`.
    pub(super) fn text(&self, value: f64) -> String {
        let value = if value.abs() < 1e-6 * self.step { 0.0 } else { value };
        if value == 0.0 && (self.decimals > 6 || self.step >= 1e6) {
            return "0".into();
        }
        if self.decimals > 6 || value.abs() >= 1e7 {
            // As many digits as distinguish neighbours.
            let digits = magnitude(value.abs()) - magnitude(self.step);
            let digits = usize::try_from(digits).unwrap_or_default();
            return format!("{value:.digits$e}").replace('-', "−");
        }
        format!("{value:.*}", self.decimals).replace('-', "−")
    }

    pub(super) fn texts(&self) -> impl Iterator<Item = (f64, String)> + '_ {
        self.values.iter().map(|&v| (v, self.text(v)))
    }
}

/// What an axis spans for these values: up to the next round numbers, with 0 where it is near.
pub(super) fn span(low: f64, high: f64, most: usize) -> (f64, f64) {
    if !(low.is_finite() && high.is_finite()) || low > high {
        return (0.0, 1.0);
    }
    let (mut low, mut high) = (low, high);
    if low > 0.0 && low < 0.5 * high {
        low = 0.0;
    }
    if high < 0.0 && high > 0.5 * low {
        high = 0.0;
    }
    let near = low.abs().max(high.abs());
    if high - low <= 1e-9 * near || near == 0.0 {
        let half = if near == 0.0 { 0.5 } else { 0.05 * near };
        (low, high) = (low - half, high + half);
    }
    let (step, _) = round_up((high - low) / most.max(1) as f64);
    let slack = 1e-6;
    let (low, high) = ((low / step + slack).floor() * step, (high / step - slack).ceil() * step);
    // The next round number may be none any more.
    (low.max(f64::MIN), high.min(f64::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(low: f64, high: f64, most: usize) -> Vec<String> {
        Ticks::new(low, high, most).texts().map(|(_, t)| t).collect()
    }

    #[test]
    fn ticks_are_round() {
        assert_eq!(texts(0.0, 5.0, 6), ["0", "1", "2", "3", "4", "5"]);
        assert_eq!(texts(-1.0, 5.5, 4), ["0", "2", "4"]);
        assert_eq!(texts(-0.3, 0.3, 6), ["−0.3", "−0.2", "−0.1", "0.0", "0.1", "0.2", "0.3"]);
        assert_eq!(texts(0.0, 2e12, 2), ["0", "1e12", "2e12"]);
        assert_eq!(texts(1e9, 1.2e9, 2), ["1.0e9", "1.1e9", "1.2e9"]);
        assert_eq!(texts(1e-9, 3e-9, 4), ["1.0e−9", "1.5e−9", "2.0e−9", "2.5e−9", "3.0e−9"]);
    }

    #[test]
    fn spans_end_at_round_numbers() {
        assert_eq!(span(0.2, 4.3, 5), (0.0, 5.0));
        assert_eq!(span(-0.4, 4.3, 5), (-1.0, 5.0));
        let near = |(low, high): (f64, f64), (a, b): (f64, f64)| {
            assert!((low - a).abs() < 1e-12 && (high - b).abs() < 1e-12, "{low} {high}");
        };
        near(span(3.0, 3.0, 5), (2.8, 3.2));
        near(span(0.0, 0.0, 5), (-0.6, 0.6));
        assert_eq!(span(f64::NAN, 1.0, 5), (0.0, 1.0));
        assert_eq!(span(f64::INFINITY, f64::NEG_INFINITY, 5), (0.0, 1.0));
        let (low, high) = span(0.0, f64::MAX, 8);
        assert_eq!((low, high), (0.0, f64::MAX));
        assert_eq!(texts(low, high, 8), ["0", "5e307", "1.0e308", "1.5e308"]);
    }
}
