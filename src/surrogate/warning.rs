//! Warnings of a prediction: the same codes in text and JSON.

use serde::{Deserialize, Serialize};

use crate::unit::km_per_h;

/// Something to know before trusting a predicted curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Warning {
    pub code: WarningCode,
    pub message: String,
}

/// Kinds of warnings; in snake case the codes of the JSON.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WarningCode {
    /// The speed lies outside the training speeds.
    OutOfRange,
    /// A midpoint forest jumps here from one training curve to the next.
    NearSplitMidpoint,
    /// The curve takes up another energy than the impact has.
    EnergyMismatch,
    /// A training run ended while loading; it is left out of the maximal crush.
    TruncatedTrainingRun,
    /// No training run holds an unloading branch.
    NoUnloading,
    /// The mass differs from the training runs'.
    OtherMass,
}

impl Warning {
    pub fn out_of_range(speed_m_per_s: f64, low: f64, high: f64) -> Self {
        let (side, by) = match speed_m_per_s < low {
            true => ("below the lowest", low - speed_m_per_s),
            false => ("above the highest", speed_m_per_s - high),
        };
        Self {
            code: WarningCode::OutOfRange,
            message: format!(
                "{} is {} {side} training speed ({} to {}): this is extrapolation",
                km_per_h(speed_m_per_s),
                km_per_h(by),
                km_per_h(low),
                km_per_h(high)
            ),
        }
    }

    pub fn near_split_midpoint(speed_m_per_s: f64, below: f64, above: f64) -> Self {
        Self {
            code: WarningCode::NearSplitMidpoint,
            message: format!(
                "{} is within 1 % of {}, where a midpoint forest jumps from the curve of {} to that of {}",
                km_per_h(speed_m_per_s),
                km_per_h(0.5 * (below + above)),
                km_per_h(below),
                km_per_h(above)
            ),
        }
    }

    pub fn energy_mismatch(ratio: f64) -> Self {
        Self {
            code: WarningCode::EnergyMismatch,
            message: format!(
                "the curve takes up {:.1} % of the impact's kinetic energy",
                ratio * 100.0
            ),
        }
    }

    pub fn truncated_training_run(name: &str) -> Self {
        Self {
            code: WarningCode::TruncatedTrainingRun,
            message: format!(
                "training run \"{name}\" ended while loading: it is left out of the maximal crush"
            ),
        }
    }

    pub fn no_unloading() -> Self {
        Self {
            code: WarningCode::NoUnloading,
            message: "no training run holds an unloading branch: the unloading stiffness is the steepest rise of the curve".into(),
        }
    }

    pub fn other_mass(mass_kg: f64, trained_kg: f64) -> Self {
        Self {
            code: WarningCode::OtherMass,
            message: format!(
                "the mass of {:.3} t differs from the training runs' {:.3} t: rate effects are those of the training mass",
                mass_kg / 1e3,
                trained_kg / 1e3
            ),
        }
    }
}
