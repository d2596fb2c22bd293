//! Arguments that several commands share.

use crumple::surrogate::max_crush::MaxCrushRule;
use crumple::unit::{MASS, SPEED};

/// A speed with its unit, in m/s.
pub fn speed(text: &str) -> Result<f64, String> {
    SPEED.parse_positive(text).map_err(|e| e.to_string())
}

/// A mass with its unit, in kg.
pub fn mass(text: &str) -> Result<f64, String> {
    MASS.parse_positive(text).map_err(|e| e.to_string())
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub enum MaxCrush {
    /// Cubic spline through the training speeds (reference method)
    Spline,
    /// Monotone cubic through (0, 0) and the training speeds
    Monotone,
    /// Where the curve has taken up the kinetic energy
    Energy,
}

impl From<MaxCrush> for MaxCrushRule {
    fn from(rule: MaxCrush) -> Self {
        match rule {
            MaxCrush::Spline => Self::Spline,
            MaxCrush::Monotone => Self::Monotone,
            MaxCrush::Energy => Self::Energy,
        }
    }
}
