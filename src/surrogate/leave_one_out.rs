//! Results of leave-one-speed-out: errors of a model at speeds it was not trained on.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::band::{Band, ForceScatter};
use super::max_crush::MaxCrushRule;
use crate::curve::ForceKind;
use crate::dataset::is_same_speed;
use crate::words::counted;

/// Errors of one model at one speed that was left out.
///
/// Ratios are `Σ|p − r|/Σ|r|`; other errors are prediction over FE, minus 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct LeftOut {
    /// Name of the model.
    pub model: String,
    /// Name of the case that was left out.
    pub case: String,
    /// Its speed, in m/s.
    pub speed_m_per_s: f64,
    /// Whether training speeds lie on both sides; else it is extrapolation.
    pub inner: bool,
    /// Declared force along the FE case's crush.
    pub force_l1: f64,
    /// Energy of the predicted curve.
    pub energy_error: f64,
    /// Maximum crush by the model's rule.
    pub max_crush_error: f64,
    /// Maximum crush by every rule that has an answer.
    pub max_crush_errors: BTreeMap<MaxCrushRule, f64>,
    /// Speed of the rebound from the curve's maximum crush, where both are known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rebound_error: Option<f64>,
    /// Largest force of the predicted curve; absent in older model files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub peak_force_error: Option<f64>,
    /// The first two peaks of FE's curve.
    pub(crate) peaks: Vec<PeakError>,
    /// Multi-body run driven by the model's body force; by the declared one if the two are
    /// the same.
    pub velocity_l1: f64,
    /// Accelerations filtered with CFC 60, as in SAE J211 for the comparison of vehicles.
    pub acceleration_l1: f64,
    /// Accelerations as central differences over two sampling intervals, not filtered.
    pub acceleration_unfiltered_l1: f64,
    /// The same run driven by the contact force, where that is another.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact_velocity_l1: Option<f64>,
    /// Accelerations of that run, filtered with CFC 60.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact_acceleration_l1: Option<f64>,
    /// Share of the FE curve's points inside the band that the other left-out speeds give over
    /// the same gap; of an end, the other end over the same distance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coverage: Option<f64>,
}

/// One peak of FE's curve and the predicted one that matches it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct PeakError {
    /// Deflection of FE's peak, in m.
    pub deflection_m: f64,
    /// Force of FE's peak, in N.
    #[serde(rename = "force_N")]
    pub force_n: f64,
    /// `None`: the prediction has no peak there.
    pub force_error: Option<f64>,
    /// By how much the predicted peak lies at a larger deflection, in m.
    pub shift_m: Option<f64>,
}

/// FE's own curve in the same multi-body model. That of a contact force is the floor for its
/// predictions; that of the body force is made from FE's own speeds, and checks that curve, force
/// law and run are consistent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Floor {
    /// `contact` or `body`.
    pub force: String,
    /// Name of the case.
    pub case: String,
    /// Its speed, in m/s.
    pub speed_m_per_s: f64,
    /// Whether other cases lie on both sides of its speed.
    pub inner: bool,
    /// Ratio of the errors of the velocity.
    pub velocity_l1: f64,
    /// The same for accelerations filtered with CFC 60.
    pub acceleration_l1: f64,
    /// The same for accelerations that are not filtered.
    pub acceleration_unfiltered_l1: f64,
}

impl Validation {
    /// The means of the model that was chosen, if any speed was left out.
    pub(crate) fn chosen_means(&self) -> Option<&Means> {
        self.means.iter().find(|means| means.model == self.chosen)
    }

    /// How many inner speeds means are over, and cases, if some speeds have several.
    pub(crate) fn inner_speeds(&self, of: &Means) -> String {
        let rows = self.rows.iter().filter(|row| row.inner && row.model == of.model);
        let mut speeds: Vec<f64> = rows.map(|row| row.speed_m_per_s).collect();
        speeds.sort_by(f64::total_cmp);
        speeds.dedup_by(|a, b| is_same_speed(*a, *b));
        match speeds.len() == of.speeds {
            true => counted(of.speeds, "inner speed"),
            false => format!("{} cases of {}", of.speeds, counted(speeds.len(), "inner speed")),
        }
    }
}

/// Means of one model over the inner speeds; of magnitudes where errors have signs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Means {
    /// Name of the model.
    pub model: String,
    /// How many inner speeds the means are over.
    pub speeds: usize,
    /// Of the declared force along FE's crush.
    pub force_l1: f64,
    /// Magnitude of the error of the curve's energy.
    pub energy_error: f64,
    /// By the model's rule.
    pub max_crush_error: f64,
    /// The rule that the model uses.
    pub max_crush_rule: MaxCrushRule,
    /// By every rule that has an answer at all inner speeds.
    pub max_crush_errors: BTreeMap<MaxCrushRule, f64>,
    /// Of the largest force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub peak_force_error: Option<f64>,
    /// Magnitude of the error of the rebound's speed, if it is known at all of these speeds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rebound_error: Option<f64>,
    /// Of the velocity.
    pub velocity_l1: f64,
    /// Of accelerations filtered with CFC 60.
    pub acceleration_l1: f64,
    /// Of accelerations that are not filtered.
    pub acceleration_unfiltered_l1: f64,
}

/// Deviation of runs of one speed from their mean: no model can remove this part of an error.
///
/// Errors of runs that are part of the mean are multiplied by √(n/(n − 1)): they are those of a
/// run that is not part of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Scatter {
    /// Those that have several runs.
    pub speeds: Vec<SpeedScatter>,
    /// Runs at these speeds, minus one for the mean of each: weights of the means below.
    pub degrees_of_freedom: usize,
    /// Error of the declared force of a run against the mean, as in the tables.
    pub force_l1: f64,
    /// The same for the closing speed.
    pub velocity_l1: f64,
    /// Root mean square of the declared force's residuals relative to its local level, as for bands.
    pub force_share: f64,
    /// Root mean square over the runs of the largest of these residuals.
    pub largest_force_share: f64,
    /// Both of the body force, where it is another.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body: Option<BodyScatter>,
}

impl Scatter {
    /// That of one of the forces of a group that declares `declared`.
    pub(crate) fn of_force(&self, force: ForceKind, declared: ForceKind) -> Option<ForceScatter> {
        let (force_share, largest_force_share) = if force == declared {
            (self.force_share, self.largest_force_share)
        } else {
            self.body.map(|body| (body.force_share, body.largest_force_share))?
        };
        let degrees_of_freedom = self.degrees_of_freedom;
        Some(ForceScatter { degrees_of_freedom, force_share, largest_force_share })
    }
}

/// The scatter of the body force.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct BodyScatter {
    /// Root mean square of its residuals relative to its local level, as for bands.
    pub force_share: f64,
    /// Root mean square over the runs of the largest of these residuals.
    pub largest_force_share: f64,
}

/// The scatter at one speed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct SpeedScatter {
    /// Mean of the runs' speeds, in m/s.
    pub speed_m_per_s: f64,
    /// Names of the runs.
    pub runs: Vec<String>,
    /// As for all speeds.
    pub force_l1: f64,
    /// As for all speeds.
    pub velocity_l1: f64,
    /// As for all speeds.
    pub force_share: f64,
    /// As for all speeds.
    pub largest_force_share: f64,
    /// As for all speeds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body: Option<BodyScatter>,
}

/// Leave-one-speed-out of a group: what `crumple validate` prints and a model file keeps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Validation {
    /// Name of the group.
    pub group: String,
    /// The model that `auto` takes.
    pub chosen: String,
    /// Why it is that one.
    pub reason: String,
    /// Every model at every speed that was left out.
    pub rows: Vec<LeftOut>,
    /// The means of each model.
    pub means: Vec<Means>,
    /// FE's own curves in the same runs.
    pub floors: Vec<Floor>,
    /// Scatter of repeated runs; absent if no speed has several runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scatter: Option<Scatter>,
    /// Of the declared force between training speeds, from the chosen model's residuals at the
    /// inner speeds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub band: Option<Band>,
    /// The same outside the training speeds, from its residuals at the ends.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub band_outside: Option<Band>,
    /// Of the body force between training speeds, from its own residuals; absent if it is the
    /// declared one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_band: Option<Band>,
    /// The same outside the training speeds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_band_outside: Option<Band>,
    /// Models that do not suit this group's runs, with the reason; not the fault of any run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unsuited: Vec<String>,
    /// What was left out of the table, with the reason.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}
