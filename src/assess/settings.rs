//! How the compared methods are set up.

use crate::nsdm::Start;

/// How the methods are set up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ComparisonSettings {
    /// Seed of the forests, and first seed of the genetic algorithm.
    pub seed: u64,
    /// The one speed whose FE run FDRM and NSDM use, in m/s; the nearest other one if absent.
    pub fixed_speed_m_per_s: Option<f64>,
    /// Fits of the spring and damper, each with its own seed; none leaves NSDM out.
    pub nsdm_seeds: u64,
    /// Start of the genetic algorithm.
    pub nsdm_start: Start,
}

impl ComparisonSettings {
    pub(super) fn nsdm_seeds(&self) -> Vec<u64> {
        (0..self.nsdm_seeds).map(|k| self.seed.wrapping_add(k)).collect()
    }
}

impl Default for ComparisonSettings {
    fn default() -> Self {
        Self { seed: 0, fixed_speed_m_per_s: None, nsdm_seeds: 3, nsdm_start: Start::Random }
    }
}
