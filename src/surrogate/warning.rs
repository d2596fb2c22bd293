//! Warnings of a prediction: the same codes in text and JSON.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::curve::Masses;
use crate::curve::force_curve::FULLY_CRUSHED;
use crate::dataset::{Feature, SAME_SPEED};
use crate::unit::{Shown, km_per_h};
use crate::words::counted;

/// A mass that differs from the training runs' by such a factor is a mistaken unit rather than another vehicle.
const UNLIKE_MASS: f64 = 10.0;

/// Whether a mass over the training runs' is rather a mistaken unit.
pub(super) fn is_unlike(ratio: f64) -> bool {
    !(1.0 / UNLIKE_MASS..UNLIKE_MASS).contains(&ratio)
}

/// Something to know before trusting a predicted curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Warning {
    /// Its kind, the same for all curves.
    pub code: WarningCode,
    /// What was found, with numbers, and what to do.
    pub message: String,
}

/// Kinds of warnings; in snake case the codes of the JSON.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum WarningCode {
    /// The speed, another parameter or the maximum crush lies outside the training cases'.
    OutOfRange,
    /// A midpoint forest jumps here from one training curve to the next.
    NearSplitMidpoint,
    /// The energy of the curve differs from that of the impact.
    EnergyMismatch,
    /// A training run ended while loading; it is left out of the maximum crush.
    TruncatedTrainingRun,
    /// No training run holds an unloading branch.
    NoUnloading,
    /// The mass differs from the training runs'.
    OtherMass,
    /// The speed lies between training speeds that are far apart, or no run has the parameters.
    FarFromTraining,
    /// The collapse mode changes between the neighbouring training speeds.
    ModeSwitch,
    /// The largest force lies outside those of the two neighbouring training runs.
    PeakForce,
    /// Too few curves to assess the model, or to check its band.
    TooFewCurves,
    /// The force was scaled so that the curve absorbs the impact's energy.
    EnergyCorrected,
    /// Nothing that was left out shows how far FE may be from this curve.
    NoBand,
    /// A warning of the build of a training run, or of the recorded one.
    CaseWarning,
}

/// A largest force this share outside those of the neighbouring runs is not theirs.
const FAR_PEAK: f64 = 0.1;

/// Speeds further outside the training speeds than this share of their range are not answered
/// without asking for it.
const FAR_OUTSIDE: f64 = 1.0 / 3.0;

/// Whether a speed lies further outside `low` to `high` than a third of that range.
pub(super) fn is_far_outside(speed_m_per_s: f64, low: f64, high: f64) -> bool {
    let outside = (low - speed_m_per_s).max(speed_m_per_s - high);
    // A third of a range of km/h is not a number of m/s, and one speed has no range.
    outside > (FAR_OUTSIDE * (high - low) * (1.0 + 1e-9)).max(SAME_SPEED * high)
}

/// `9 km/h is 16 km/h below the lowest training speed (25 km/h to 72 km/h)`.
pub(super) fn outside_of(speed_m_per_s: f64, low: f64, high: f64) -> String {
    let (side, by) = if speed_m_per_s < low {
        ("below the lowest", low - speed_m_per_s)
    } else {
        ("above the highest", speed_m_per_s - high)
    };
    let (speed, by) = (km_per_h(speed_m_per_s), km_per_h(by));
    if low == high {
        format!("{speed} is {by} from {}, the only training speed", km_per_h(low))
    } else {
        format!("{speed} is {by} {side} training speed ({} to {})", km_per_h(low), km_per_h(high))
    }
}

impl WarningCode {
    /// As in the JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::OutOfRange => "out_of_range",
            Self::NearSplitMidpoint => "near_split_midpoint",
            Self::EnergyMismatch => "energy_mismatch",
            Self::TruncatedTrainingRun => "truncated_training_run",
            Self::NoUnloading => "no_unloading",
            Self::OtherMass => "other_mass",
            Self::FarFromTraining => "far_from_training",
            Self::ModeSwitch => "mode_switch",
            Self::PeakForce => "peak_force",
            Self::TooFewCurves => "too_few_curves",
            Self::EnergyCorrected => "energy_corrected",
            Self::NoBand => "no_band",
            Self::CaseWarning => "case_warning",
        }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} [{}]", self.message, self.code.name())
    }
}

impl Warning {
    pub(crate) fn out_of_range(speed_m_per_s: f64, low: f64, high: f64, of: &str) -> Self {
        // Of some of the runs alone it is not refused.
        let far = if of.is_empty() && is_far_outside(speed_m_per_s, low, high) {
            " by more than a third of the range"
        } else {
            ""
        };
        Self {
            code: WarningCode::OutOfRange,
            message: format!(
                "{}{of}: this is extrapolation{far}",
                outside_of(speed_m_per_s, low, high)
            ),
        }
    }

    pub(crate) fn no_band(why: &str) -> Self {
        Self { code: WarningCode::NoBand, message: format!("there is no band: {why}") }
    }

    pub(crate) fn parameter_out_of_range(name: &str, asked: f64, low: f64, high: f64) -> Self {
        Self {
            code: WarningCode::OutOfRange,
            message: format!(
                "{name} = {asked} lies outside the training cases' {low} to {high}: this is extrapolation"
            ),
        }
    }

    /// Of values of the features that each lie inside those of the runs.
    pub(crate) fn parameters_of_no_run(features: &[Feature], asked: &[f64]) -> Self {
        let named = features.iter().zip(asked).filter_map(|(feature, asked)| {
            let value = match &feature.category {
                Some(category) => (*asked == 1.0).then(|| category.clone())?,
                None => asked.to_string(),
            };
            Some(format!("{} = {value}", feature.parameter))
        });
        let named = named.collect::<Vec<_>>().join(", ");
        Self {
            code: WarningCode::FarFromTraining,
            message: format!(
                "no training run has {named}: only speeds were left out, so any band says nothing of the step to other parameters"
            ),
        }
    }

    pub(crate) fn near_split_midpoint(speed_m_per_s: f64, below: f64, above: f64) -> Self {
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

    pub(crate) fn far_from_training(speed_m_per_s: f64, nearest: f64) -> Self {
        Self {
            code: WarningCode::FarFromTraining,
            message: format!(
                "the nearest training speed is {}, {:.0} % from {}: an FE run between them would help",
                km_per_h(nearest),
                (nearest / speed_m_per_s - 1.0).abs() * 100.0,
                km_per_h(speed_m_per_s)
            ),
        }
    }

    pub(crate) fn mode_switch(below: f64, above: f64) -> Self {
        Self {
            code: WarningCode::ModeSwitch,
            message: format!(
                "the training curves differ between {} and {} by more than a shift of their peaks and steps with the speed: the collapse mode may change there, and a run between the two may follow either",
                km_per_h(below),
                km_per_h(above)
            ),
        }
    }

    /// If the largest force of a curve is a tenth below those of both neighbours, given by speed in m/s and force in N, or above
    /// them. At the speed of a run, both are that run.
    pub(crate) fn peak_force(peak_n: f64, neighbours: [(f64, f64); 2]) -> Option<Self> {
        let [low_n, high_n] = [f64::min, f64::max].map(|of| of(neighbours[0].1, neighbours[1].1));
        let (share, side, why) = match peak_n {
            n if n < (1.0 - FAR_PEAK) * low_n => (
                1.0 - n / low_n,
                "below",
                "it may be too low, because blending and smoothing lower peaks",
            ),
            n if n > (1.0 + FAR_PEAK) * high_n => {
                (n / high_n - 1.0, "above", "no run there shows such a force")
            }
            _ => return None,
        };
        let shown = Shown::force(peak_n);
        let [below, above] =
            neighbours.map(|(v, n)| format!("{} at {}", shown.text(n), km_per_h(v)));
        let of = match neighbours[0] == neighbours[1] {
            true => format!("{side} that of the run at this speed ({below})"),
            false => format!("{side} those of both neighbouring runs ({below}, {above})"),
        };
        Some(Self {
            code: WarningCode::PeakForce,
            message: format!(
                "the largest force, {}, is at least {:.0} % {of}: {why}",
                shown.text(peak_n),
                100.0 * share
            ),
        })
    }

    pub(crate) fn band_of_one() -> Self {
        Self {
            code: WarningCode::TooFewCurves,
            message: "only one speed could be left out, so the width of the band is unchecked"
                .into(),
        }
    }

    pub(crate) fn too_few_curves(curves: usize) -> Self {
        Self {
            code: WarningCode::TooFewCurves,
            message: format!(
                "the model rests on {}: with fewer than 3, no speed can be left out to assess it",
                counted(curves, "training curve")
            ),
        }
    }

    pub(crate) fn energy_corrected(factor: f64) -> Self {
        let message = if (factor - 1.0).abs() < 5e-5 {
            "there was nothing to correct: the force that moves the body absorbs the impact's kinetic energy up to this maximum crush (by the rule motion always)".into()
        } else {
            format!(
                "the forces were multiplied by {factor:.4}, so that the one that moves the body absorbs the impact's kinetic energy"
            )
        };
        Self { code: WarningCode::EnergyCorrected, message }
    }

    pub(crate) fn energy_mismatch(ratio: f64) -> Self {
        Self {
            code: WarningCode::EnergyMismatch,
            message: format!(
                "the curve absorbs {:.1} % of the impact's kinetic energy",
                ratio * 100.0
            ),
        }
    }

    pub(crate) fn contact_energy_mismatch(ratio: f64, (least, most): (f64, f64)) -> Self {
        Self {
            code: WarningCode::EnergyMismatch,
            message: format!(
                "the contact force absorbs {:.1} % of the impact's kinetic energy, in the training runs {:.1} to {:.1} %",
                ratio * 100.0,
                least * 100.0,
                most * 100.0
            ),
        }
    }

    /// Warnings of a recorded case: that it ended while loading, and those of its build.
    pub(crate) fn of_case(name: &str, truncated: bool, warnings: &[String]) -> Vec<Self> {
        let own = warnings.iter().filter(|w| !truncated || !w.starts_with("truncated:"));
        let own = own.map(|warning| Self {
            code: WarningCode::CaseWarning,
            message: format!("run \"{name}\": {warning}"),
        });
        truncated.then(|| Self::truncated_training_run(name)).into_iter().chain(own).collect()
    }

    fn truncated_training_run(name: &str) -> Self {
        Self {
            code: WarningCode::TruncatedTrainingRun,
            message: format!(
                "training run \"{name}\" ended while loading: it is left out of the maximum crush"
            ),
        }
    }

    pub(crate) fn no_unloading() -> Self {
        Self {
            code: WarningCode::NoUnloading,
            message: "no training run holds an unloading branch: the unloading stiffness is the steepest rise of the curve".into(),
        }
    }

    /// `by_speed_m`: what the runs' maximum crush over their speeds, continued, would give.
    pub(crate) fn beyond_data(
        crush_m: f64,
        (data_end_m, of): (f64, &str),
        by_speed_m: Option<f64>,
    ) -> Self {
        let mut other = String::new();
        if let Some(m) = by_speed_m {
            other = format!("; extrapolating the runs' crush over the speed gives {m:.3} m");
        }
        let fully_m = FULLY_CRUSHED * data_end_m;
        if crush_m > fully_m {
            other.push_str(&format!(
                "; in multi-body runs the structure is fully crushed from {fully_m:.3} m on, so that they stop earlier, at a higher force"
            ));
        }
        Self {
            code: WarningCode::OutOfRange,
            message: format!(
                "the maximum crush of {crush_m:.3} m lies beyond the {data_end_m:.3} m of the {of}: the force there is an assumption{other}"
            ),
        }
    }

    pub(crate) fn other_mass(asked: Masses, trained: Masses) -> Self {
        let shown = |of: Masses| match of.other_kg.map(Shown::one_mass) {
            None => Shown::one_mass(of.body_kg),
            Some(_) if of.other_kg == Some(of.body_kg) => {
                format!("{} each", Shown::one_mass(of.body_kg))
            }
            Some(other) => format!("{} against {other}", Shown::one_mass(of.body_kg)),
        };
        // Of unequal bodies two equal ones that move alike.
        let by = if asked.other_kg == Some(asked.body_kg) { " (by the reduced mass)" } else { "" };
        let ratio = asked.effective_kg() / trained.effective_kg();
        let effect = if is_unlike(ratio) {
            "so far from it, the curve is not reliable: check the unit"
        } else {
            "rate effects and any band are those of the training mass, and the error may be larger"
        };
        Self {
            code: WarningCode::OtherMass,
            message: format!(
                "the mass of {}{by} differs from the training runs' {}: {effect}",
                shown(asked),
                shown(trained)
            ),
        }
    }
}
