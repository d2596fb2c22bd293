//! The speed at which a model's maximum crush is a given one: what a measured crush says of the impact.

use serde::Serialize;

use super::{Model, Query, predict};
use crate::error::{Error, error};
use crate::unit::km_per_h;

/// A speed that was found by its crush.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SpeedOfCrush {
    /// The crush that was asked for.
    pub crush_m: f64,
    /// The speed that gives it.
    pub speed_m_per_s: f64,
    /// Speeds of a crush as much smaller and larger as the model's is off on average at left-out speeds; null beyond the
    /// model's speeds, and if no speed was left out.
    pub low_m_per_s: Option<f64>,
    /// See `low_m_per_s`.
    pub high_m_per_s: Option<f64>,
    /// That mean error of the rule in use, relative; null too if that rule has no answer at some of these speeds.
    pub crush_error: Option<f64>,
}

/// Intervals that are looked into; crushes of real structures rise with the speed, so the first that holds it counts.
const INTERVALS: usize = 32;
/// Halvings of an interval.
const HALVINGS: usize = 40;
/// What rounding takes from a crush that is printed in m, or in mm with one digit behind the point.
const ROUNDING_M: f64 = 5.1e-5;

/// Finds the speed, between the slowest and the fastest run of the model, at which the curve of `query` ends at
/// `crush_m`.
///
/// # Errors
/// If no speed between the runs gives that crush; as [`predict`].
pub fn speed_of_crush(model: &Model, query: &Query, crush_m: f64) -> Result<SpeedOfCrush, Error> {
    let (low, high) = model.range_m_per_s();
    let crush_at = |speed_m_per_s: f64| -> Result<f64, Error> {
        let query = Query { speed_m_per_s, ..query.clone() };
        Ok(predict(model, &query)?.max_deflection_m)
    };
    let at = |k: usize| low + (high - low) * k as f64 / INTERVALS as f64;
    let crushes = (0..=INTERVALS).map(|k| crush_at(at(k))).collect::<Result<Vec<f64>, _>>()?;
    let find = |wanted: f64| -> Result<Option<f64>, Error> {
        let k = crushes.windows(2).position(|pair| pair[0] <= wanted && wanted <= pair[1]);
        let Some(k) = k else { return Ok(None) };
        let (mut from, mut to) = (at(k), at(k + 1));
        for _ in 0..HALVINGS {
            let middle = 0.5 * (from + to);
            if crush_at(middle)? < wanted { from = middle } else { to = middle }
        }
        Ok(Some(0.5 * (from + to)))
    };
    let (least_m, most_m) = (crushes[0], crushes[INTERVALS]);
    let is_nearly_inside = (least_m - ROUNDING_M..=most_m + ROUNDING_M).contains(&crush_m);
    let within = if is_nearly_inside { crush_m.max(least_m).min(most_m) } else { crush_m };
    let speed_m_per_s = find(within)?.ok_or_else(|| {
        error!(
            Prediction,
            "no speed between those of the runs gives a crush of {} m: the model's crush goes from {least_m:.4} m at {} to {most_m:.4} m at {}",
            (crush_m * 1e4).round() / 1e4,
            km_per_h(low),
            km_per_h(high)
        )
    })?;
    let means = model.leave_one_out.as_ref();
    let means = means.and_then(|of| of.means.iter().find(|means| means.model == model.kind.name()));
    let crush_error = means.and_then(|means| match query.rule {
        Some(rule) => means.max_crush_errors.get(&rule).copied(),
        None => Some(means.max_crush_error),
    });
    let off =
        |share: f64| crush_error.map_or(Ok(None), |error| find(crush_m * (1.0 + share * error)));
    let (low_m_per_s, high_m_per_s) = (off(-1.0)?, off(1.0)?);
    Ok(SpeedOfCrush { crush_m, speed_m_per_s, low_m_per_s, high_m_per_s, crush_error })
}
