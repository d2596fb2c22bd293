//! Draws by counter: the uniform value of item `k` and its quantile, independent of earlier items.
//!
//! Exponential, logarithm and error function are those of `libm`, so that the values do not
//! depend on the machine's C library.

use crate::error::{Error, error};
use crate::stream::{Stream, mix};

/// Least share of a distribution that its bounds may leave.
const LEAST_SHARE: f64 = 1e-9;

pub(crate) fn key(seed: u64, number: u64) -> u64 {
    mix(mix(seed).wrapping_add(mix(number.wrapping_add(1))))
}

/// Uniform in (0, 1), both excluded, for one variable of one item.
pub(crate) fn unit(seed: u64, variable: u64, item: u64) -> f64 {
    let mut stream = Stream::new(key(seed, variable), item);
    // Moved by half a step of the 53 bits off 0; just below 1 this may round to 1.
    (stream.unit() + 0.5 / (1u64 << 53) as f64).min(1.0 - f64::EPSILON / 2.0)
}

/// Place of `k` in a random order of `0..n` (`k < n`), without holding the order.
///
/// A Feistel network is a bijection of a power of two at least as large as `n`; what falls
/// beyond `n` is sent through again until it does not, which keeps it a bijection.
pub(crate) fn permuted(k: u64, n: u64, key_of_order: u64) -> u64 {
    let bits = (u64::BITS - n.saturating_sub(1).leading_zeros()).max(2);
    let half = bits.div_ceil(2);
    let mask = (1u64 << half) - 1;
    let mut at = k;
    loop {
        let (mut left, mut right) = (at >> half, at & mask);
        for round in 0..6 {
            (left, right) = (right, left ^ (mix(key(key_of_order, round) ^ right) & mask));
        }
        at = (left << half) | right;
        if at < n {
            return at;
        }
    }
}

/// A distribution by its quantile function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Distribution {
    /// Every value between the ends is equally likely.
    Uniform {
        from: f64,
        to: f64,
    },
    /// The density rises to the mode and falls behind it.
    Triangular {
        from: f64,
        mode: f64,
        to: f64,
    },
    /// Of the quantity itself.
    Normal(Truncated),
    Lognormal(Truncated),
}

/// A normal distribution between bounds.
///
/// Bounds in the upper tail are mirrored into the lower one, where shares keep their digits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Truncated {
    mean: f64,
    /// Below zero if mirrored.
    sd: f64,
    min: f64,
    max: f64,
    /// Share below the bounds, and between them.
    below: f64,
    between: f64,
}

impl Truncated {
    fn new(mean: f64, sd: f64, min: f64, max: f64) -> Result<Self, Error> {
        let (low, high) = ((min - mean) / sd, (max - mean) / sd);
        let (signed_sd, low, high) = if low > 0.0 { (-sd, -high, -low) } else { (sd, low, high) };
        let below = normal_share(low);
        let between = normal_share(high) - below;
        if between.is_nan() || between <= LEAST_SHARE {
            return Err(
                error!(Sweep at "distribution", "min and max cut off almost all of the distribution"),
            );
        }
        Ok(Self { mean, sd: signed_sd, min, max, below, between })
    }

    fn quantile(&self, share: f64) -> f64 {
        let share = if self.sd < 0.0 { 1.0 - share } else { share };
        let z = normal_quantile(self.below + share * self.between);
        (self.mean + self.sd * z).clamp(self.min, self.max)
    }
}

impl Distribution {
    /// Every value between the ends is equally likely.
    pub(crate) fn uniform(from: f64, to: f64) -> Result<Self, Error> {
        if from < to {
            Ok(Self::Uniform { from, to })
        } else {
            Err(error!(Sweep at "to", "from must be less than to"))
        }
    }

    /// The density rises from 0 at `from` to `mode`, and falls to 0 at `to`.
    pub(crate) fn triangular(from: f64, mode: f64, to: f64) -> Result<Self, Error> {
        if from < to && from <= mode && mode <= to {
            Ok(Self::Triangular { from, mode, to })
        } else {
            Err(error!(Sweep at "mode", "from, mode and to must increase"))
        }
    }

    /// Normal of mean and standard deviation, truncated to `[min, max]` (infinite: not).
    pub(crate) fn normal(mean: f64, sd: f64, min: f64, max: f64) -> Result<Self, Error> {
        if !(sd > 0.0 && min < max) {
            return Err(order(sd));
        }
        Truncated::new(mean, sd, min, max).map(Self::Normal)
    }

    /// Lognormal; mean and deviation are those of the quantity itself.
    pub(crate) fn lognormal(mean: f64, sd: f64, min: f64, max: f64) -> Result<Self, Error> {
        if !(sd > 0.0 && min < max) {
            return Err(order(sd));
        }
        if !(mean > 0.0 && max > 0.0) {
            return Err(error!(
                Sweep at "distribution",
                "a lognormal distribution needs mean and max above 0"
            ));
        }
        let variance = libm::log1p((sd / mean) * (sd / mean));
        let log = |bound: f64| if bound > 0.0 { libm::log(bound) } else { f64::NEG_INFINITY };
        let centre = libm::log(mean) - 0.5 * variance;
        Truncated::new(centre, variance.sqrt(), log(min), log(max)).map(Self::Lognormal)
    }

    /// The value below which this share lies (`0 < share < 1`).
    pub(crate) fn quantile(&self, share: f64) -> f64 {
        match self {
            Self::Uniform { from, to } => (from + share * (to - from)).clamp(*from, *to),
            Self::Triangular { from, mode, to } => {
                let (width, rise) = (to - from, mode - from);
                let value = if share * width < rise {
                    from + (share * width * rise).sqrt()
                } else {
                    to - ((1.0 - share) * width * (to - mode)).sqrt()
                };
                value.clamp(*from, *to)
            }
            Self::Normal(normal) => normal.quantile(share),
            Self::Lognormal(normal) => libm::exp(normal.quantile(share)),
        }
    }
}

fn order(sd: f64) -> Error {
    if sd > 0.0 {
        error!(Sweep at "max", "min must be less than max")
    } else {
        error!(Sweep at "sd", "sd must be above 0")
    }
}

/// Share of the standard normal distribution below `z`.
fn normal_share(z: f64) -> f64 {
    0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2)
}

/// Quantile of the standard normal distribution, to about 1 part in 10¹⁶: algorithm AS 241,
/// PPND16 (Wichura, Applied Statistics 37, 1988).
fn normal_quantile(share: f64) -> f64 {
    let q = share - 0.5;
    if q.abs() <= 0.425 {
        let r = 0.180625 - q * q;
        return q * ratio(r, &CENTRE);
    }
    let tail = if q < 0.0 { share } else { 1.0 - share };
    // Below the smallest double the quantile is about −38.
    let r = (-libm::log(tail.max(f64::MIN_POSITIVE))).sqrt();
    let z = if r <= 5.0 { ratio(r - 1.6, &MIDDLE) } else { ratio(r - 5.0, &TAIL) };
    if q < 0.0 { -z } else { z }
}

/// Ratio of two polynomials, coefficients from the constant up.
fn ratio(r: f64, [above, below]: &[[f64; 8]; 2]) -> f64 {
    let at = |c: &[f64; 8]| c.iter().rev().fold(0.0, |sum, c| sum * r + c);
    at(above) / at(below)
}

/// `|share − 1/2| ≤ 0.425`.
#[rustfmt::skip]
const CENTRE: [[f64; 8]; 2] = [
    [
        3.387_132_872_796_366_5, 1.331_416_678_917_843_8e2, 1.971_590_950_306_551_3e3, 1.373_169_376_550_946e4,
        4.592_195_393_154_987e4, 6.726_577_092_700_87e4, 3.343_057_558_358_813e4, 2.509_080_928_730_122_7e3,
    ],
    [
        1.0, 4.231_333_070_160_091e1, 6.871_870_074_920_579e2, 5.394_196_021_424_751e3,
        2.121_379_430_158_659_7e4, 3.930_789_580_009_271e4, 2.872_908_573_572_194_3e4, 5.226_495_278_852_854e3,
    ],
];
/// Shares of the tail down to `exp(−25)`.
#[rustfmt::skip]
const MIDDLE: [[f64; 8]; 2] = [
    [
        1.423_437_110_749_683_5, 4.630_337_846_156_546, 5.769_497_221_460_691, 3.647_848_324_763_204_5,
        1.270_458_252_452_368_4, 2.417_807_251_774_506e-1, 2.272_384_498_926_918_4e-2, 7.745_450_142_783_414e-4,
    ],
    [
        1.0, 2.053_191_626_637_759, 1.676_384_830_183_803_8, 6.897_673_349_851e-1,
        1.481_039_764_274_800_8e-1, 1.519_866_656_361_645_7e-2, 5.475_938_084_995_345e-4, 1.050_750_071_644_416_9e-9,
    ],
];
/// Shares of the tail below that.
#[rustfmt::skip]
const TAIL: [[f64; 8]; 2] = [
    [
        6.657_904_643_501_103, 5.463_784_911_164_114, 1.784_826_539_917_291_3, 2.965_605_718_285_048_7e-1,
        2.653_218_952_657_612_4e-2, 1.242_660_947_388_078_4e-3, 2.711_555_568_743_487_6e-5, 2.010_334_399_292_288_1e-7,
    ],
    [
        1.0, 5.998_322_065_558_88e-1, 1.369_298_809_227_358e-1, 1.487_536_129_085_061_5e-2,
        7.868_691_311_456_133e-4, 1.846_318_317_510_054_8e-5, 1.421_511_758_316_446e-7, 2.044_263_103_389_939_8e-15,
    ],
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the error function, which is another algorithm.
    #[test]
    fn quantile_inverts_the_share() {
        for i in 1..400 {
            let z = f64::from(i) * -0.02;
            let share = normal_share(z);
            let back = normal_quantile(share);
            assert!((back / z - 1.0).abs() < 1e-13, "{z} came back as {back}");
        }
        // Wichura's own test values.
        for (share, z) in [
            (0.25, -0.674_489_750_196_081_7),
            (0.001, -3.090_232_306_167_813_5),
            (1e-20, -9.262_340_089_798_408),
        ] {
            assert!((normal_quantile(share) / z - 1.0_f64).abs() < 1e-15, "{share}");
        }
        assert_eq!(normal_quantile(0.5), 0.0);
    }

    #[test]
    fn orders_are_permutations() {
        for n in [1, 2, 3, 4, 5, 63, 64, 65, 1000] {
            let order: Vec<u64> = (0..n).map(|k| permuted(k, n, 11)).collect();
            let mut sorted = order.clone();
            sorted.sort();
            assert_eq!(sorted, (0..n).collect::<Vec<_>>());
            if n > 60 {
                assert_ne!(order, sorted);
                assert_ne!(order, (0..n).map(|k| permuted(k, n, 12)).collect::<Vec<_>>());
            }
        }
        assert!(permuted(999_999_999_999, 1_000_000_000_000, 1) < 1_000_000_000_000);
    }

    /// Mean and deviation of 20 000 draws against the textbook's, within 4 standard errors.
    #[test]
    fn moments() {
        fn t(distribution: Distribution, mean: f64, sd: f64) {
            let n = 20_000;
            let draws: Vec<f64> = (0..n).map(|k| distribution.quantile(unit(5, 1, k))).collect();
            let found = draws.iter().sum::<f64>() / n as f64;
            let squares = draws.iter().map(|x| (x - found) * (x - found)).sum::<f64>();
            let found_sd = (squares / n as f64).sqrt();
            let error = sd / (n as f64).sqrt();
            assert!((found - mean).abs() < 4.0 * error, "{distribution:?}: mean {found}");
            assert!((found_sd / sd - 1.0).abs() < 0.03, "{distribution:?}: sd {found_sd}");
        }
        let open = (f64::NEG_INFINITY, f64::INFINITY);
        t(Distribution::uniform(2.0, 5.0).unwrap(), 3.5, 0.75_f64.sqrt());
        // Mean (a + b + c)/3, variance (a² + b² + c² − ab − ac − bc)/18.
        t(Distribution::triangular(0.0, 1.0, 5.0).unwrap(), 2.0, (21.0_f64 / 18.0).sqrt());
        t(Distribution::normal(24e3, 1e3, open.0, open.1).unwrap(), 24e3, 1e3);
        t(Distribution::lognormal(1.1, 0.3, open.0, open.1).unwrap(), 1.1, 0.3);
        // A half normal: sqrt(2/π) and sqrt(1 − 2/π).
        let half = std::f64::consts::FRAC_2_PI;
        t(Distribution::normal(0.0, 1.0, 0.0, open.1).unwrap(), half.sqrt(), (1.0 - half).sqrt());
        t(Distribution::normal(0.0, 1.0, open.0, 0.0).unwrap(), -half.sqrt(), (1.0 - half).sqrt());
    }

    #[test]
    fn bounds_hold_and_far_tails_keep_their_shape() {
        for (min, max) in [(5.0, 6.0), (-6.0, -5.0), (-0.5, 0.1)] {
            let d = Distribution::normal(0.0, 1.0, min, max).unwrap();
            let draws: Vec<f64> = (0..2000).map(|k| d.quantile(unit(1, 0, k))).collect();
            assert!(draws.iter().all(|x| (min..=max).contains(x)));
            let mut distinct = draws.clone();
            distinct.sort_by(f64::total_cmp);
            distinct.dedup();
            assert!(distinct.len() > 1990, "{} of 2000 differ", distinct.len());
            assert!(d.quantile(0.25) < d.quantile(0.75));
        }
        let d = Distribution::lognormal(1.0, 0.5, 0.8, 1.2).unwrap();
        assert!(
            (0..2000).all(|k| (0.8 - 1e-15..=1.2 + 1e-15).contains(&d.quantile(unit(1, 0, k))))
        );
        assert!(Distribution::normal(0.0, 1.0, 40.0, 41.0).is_err());
        assert!(Distribution::normal(0.0, 0.0, -1.0, 1.0).is_err());
        assert!(Distribution::lognormal(-1.0, 1.0, 0.0, 1.0).is_err());
        assert!(Distribution::uniform(1.0, 1.0).is_err());
        assert!(Distribution::triangular(0.0, 3.0, 2.0).is_err());
    }

    #[test]
    fn units_lie_inside_and_differ_by_item_and_variable() {
        assert!((0..10_000).all(|k| unit(0, 0, k) > 0.0 && unit(0, 0, k) < 1.0));
        assert_ne!(unit(1, 2, 3), unit(1, 3, 2));
        assert_ne!(unit(1, 2, 3), unit(2, 1, 3));
    }
}
