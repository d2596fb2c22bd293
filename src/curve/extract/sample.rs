//! A run's curve at the common times of its group.

use super::error::ExtractError;
use super::input::Setup;
use super::remarks::Notes;
use crate::curve::Curve;
use crate::signal::resample::interpolate;

/// The curve and its closing speeds at the recipe's common times, as far as the record
/// reaches.
pub(super) fn sample(
    original: &Curve,
    closing: &[f64],
    setup: &Setup<'_>,
) -> Result<((Curve, Vec<f64>), Notes), ExtractError> {
    let mut remarks = Notes::default();
    let sampling = setup.recipe.sampling;
    let at = original.time_s();
    let last_s = at[at.len() - 1];
    // The last state may come a rounding error before its nominal time.
    let reach = last_s * (1.0 + 1e-9);
    let times: Vec<f64> = (0..sampling.states)
        .map(|i| i as f64 * sampling.interval_s)
        .take_while(|&t| t <= reach)
        .map(|t| t.min(last_s))
        .collect();
    if times.len() < sampling.states {
        let short = format!(
            "short: the record holds {} of {} states from contact on",
            times.len(),
            sampling.states
        );
        // A record that was cut on purpose is as short as was asked for.
        match setup.stated.truncate_s {
            Some(_) => remarks.note(short),
            None => remarks.warn(short),
        }
    }
    let at_times =
        |values: &[f64]| interpolate(at, values, &times).map_err(|_| ExtractError::NoOverlap);
    let deflection = at_times(original.deflection_m())?;
    let force = at_times(original.force_n())?;
    let closing = at_times(closing)?;
    Ok(((Curve::new(times, deflection, force)?, closing), remarks))
}
