//! Arguments that several commands share.

use crumple::curve::Parameter;
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

/// A case parameter: `angle_deg=10` or `obstacle=pole`.
pub fn parameter(text: &str) -> Result<(String, Parameter), String> {
    let (name, value) = text
        .split_once('=')
        .filter(|(name, value)| !name.is_empty() && !value.is_empty())
        .ok_or_else(|| format!("\"{text}\" is no parameter: write NAME=VALUE"))?;
    let value = match value.parse::<f64>() {
        Ok(number) if number.is_finite() => Parameter::Number(number),
        Ok(_) => return Err(format!("\"{value}\" is not finite")),
        Err(_) => Parameter::Category(value.into()),
    };
    Ok((name.into(), value))
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub enum MaxCrush {
    /// Cubic spline through the training speeds (reference method)
    Spline,
    /// Monotone cubic through (0, 0) and the training speeds
    Monotone,
    /// Where the curve has taken up the kinetic energy
    Energy,
    /// Where the body's own force has stopped it
    Motion,
}

impl From<MaxCrush> for MaxCrushRule {
    fn from(rule: MaxCrush) -> Self {
        match rule {
            MaxCrush::Spline => Self::Spline,
            MaxCrush::Monotone => Self::Monotone,
            MaxCrush::Energy => Self::Energy,
            MaxCrush::Motion => Self::Motion,
        }
    }
}
