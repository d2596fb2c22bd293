//! Random streams keyed by seed and number: one per tree or individual, whichever thread draws.

use rand::{RngCore, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Random draws of one tree of a forest, or of one pair of parents.
pub(crate) struct Stream(Xoshiro256PlusPlus);

impl Stream {
    /// The stream number `number` under `seed`: the two are mixed by SplitMix64, whose
    /// output function is a bijection with full avalanche, so neighbouring keys give
    /// unrelated streams.
    pub(crate) fn new(seed: u64, number: u64) -> Self {
        let key = mix(seed).wrapping_add(mix(number.wrapping_add(0x9E37_79B9_7F4A_7C15)));
        Self(Xoshiro256PlusPlus::seed_from_u64(mix(key)))
    }

    /// Uniform integer in `0..n` (`n > 0`) by multiplication; its bias is below `n / 2⁶⁴`.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.0.next_u64()) * n as u128) >> 64) as usize
    }

    /// Uniform double in `[0, 1)` with 53 bits.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }
}

/// Output function of SplitMix64 (Steele, Lea, Flood, OOPSLA 2014).
pub(crate) fn mix(mut z: u64) -> u64 {
    z = z.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_depend_on_seed_and_number() {
        let first = |seed, number| Stream::new(seed, number).below(usize::MAX);
        assert_eq!(first(1, 2), first(1, 2));
        assert_ne!(first(1, 2), first(2, 1));
        assert_ne!(first(1, 2), first(1, 3));
    }

    #[test]
    fn draws_cover_their_range_evenly() {
        let mut stream = Stream::new(7, 0);
        let mut counts = [0; 10];
        for _ in 0..100_000 {
            counts[stream.below(10)] += 1;
            assert!((0.0..1.0).contains(&stream.unit()));
        }
        // Standard deviation of a count is 95.
        assert!(counts.iter().all(|c| (9_500..10_500).contains(c)), "{counts:?}");
    }
}
