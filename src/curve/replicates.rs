//! Replicates: runs that are nominally equal, and the one motion that is their mean.
//!
//! The mean is taken over time, from contact on, so that deflection, speed, force and what follows from them (body
//! force, maximum crush, rebound) are those of one motion and fit together. A mean of forces over deflection would not:
//! each run ends at a crush of its own.

use serde::Deserialize;

use super::{Case, Curve, EnergyAudit};
use crate::error::Error;
use crate::piecewise;
use crate::words::counted;

impl Case {
    /// Whether both were measured by one recipe, so that a difference of their curves is scatter:
    /// recipes are compared without names, files and what belongs to the one run.
    pub(crate) fn is_measured_as(&self, other: &Self) -> bool {
        measured(&self.provenance.recipe) == measured(&other.provenance.recipe)
    }

    /// The filter of its recipe; none of a curve from a table.
    pub(crate) fn filter(&self) -> Option<String> {
        #[derive(Deserialize)]
        struct Whole {
            recipe: Recipe,
        }
        #[derive(Deserialize)]
        struct Recipe {
            filter: String,
        }
        let whole = serde_json::from_slice::<Whole>(self.provenance.recipe.as_bytes()).ok()?;
        Some(whole.recipe.filter)
    }
}

/// What of a recipe decides how force and deflection were measured.
fn measured(recipe: &str) -> serde_json::Value {
    let Ok(whole) = recipe.parse::<serde_json::Value>() else {
        return recipe.into();
    };
    let imported = &whole["imported"];
    let keys = ["has_times", "moves_by_its_force", "contact_alone"];
    serde_json::json!([whole["recipe"], whole["half_model"], keys.map(|key| &imported[key])])
}

/// The mean of runs that agree in speed, masses, parameters and recipe; a single run as it is.
/// It reaches as far as the shortest of them.
pub(crate) fn mean_of(first: &Case, others: &[&Case]) -> Result<Case, Error> {
    if others.is_empty() {
        return Ok(first.clone());
    }
    let runs: Vec<&Case> = [first].into_iter().chain(others.iter().copied()).collect();
    let mean =
        |of: fn(&Case) -> f64| runs.iter().map(|run| of(run)).sum::<f64>() / runs.len() as f64;
    let known: Vec<f64> =
        runs.iter().filter_map(|run| run.curves.unloading_stiffness_n_per_m).collect();
    let sampled = mean_curve(&runs, |run| &run.curves.sampled)?;
    let speeds: Vec<_> = runs
        .iter()
        .map(|run| (run.curves.sampled.time_s(), &run.curves.closing_speed_m_per_s[..]))
        .collect();
    let mut fingerprint = blake3::Hasher::new();
    for run in &runs {
        fingerprint.update(run.provenance.fingerprint.as_bytes());
    }
    let names: Vec<&str> = runs.iter().map(|run| run.id.name.as_str()).collect();
    let mut of = first.clone();
    of.id.name = format!("{} (mean of {})", first.id.name, runs.len());
    of.conditions.speed.m_per_s = mean(|run| run.conditions.speed.m_per_s);
    let masses = &mut of.conditions.masses;
    masses.body_kg = mean(|run| run.conditions.masses.body_kg);
    let others: Option<f64> = runs.iter().map(|run| run.conditions.masses.other_kg).sum();
    masses.other_kg = others.map(|sum| sum / runs.len() as f64);
    of.curves.closing_speed_m_per_s = mean_over_time(&speeds, sampled.time_s());
    of.curves.sampled = sampled;
    of.curves.original = mean_curve(&runs, |run| &run.curves.original)?;
    let times: Option<f64> = runs.iter().map(|run| run.provenance.solver_wall_time_s).sum();
    of.provenance.solver_wall_time_s = times.map(|sum| sum / runs.len() as f64);
    of.curves.unloading_stiffness_n_per_m =
        (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64);
    of.quality.audit = EnergyAudit {
        work_j: mean(|run| run.quality.audit.work_j),
        kinetic_j: mean(|run| run.quality.audit.kinetic_j),
    };
    of.provenance.fingerprint = fingerprint.finalize().to_hex().to_string();
    of.provenance.sources = runs.iter().flat_map(|run| run.provenance.sources.clone()).collect();
    of.quality.notes =
        vec![format!("mean of {}: {}", counted(runs.len(), "run"), names.join(", "))];
    let named = |run: &&Case| {
        let name = run.id.name.clone();
        run.quality.warnings.clone().into_iter().map(move |w| format!("{name}: {w}"))
    };
    of.quality.warnings = runs.iter().flat_map(named).collect();
    (of.provenance.origin, of.provenance.tags, of.provenance.user_notes) =
        (None, Vec::new(), Vec::new());
    Ok(of)
}

fn mean_curve(runs: &[&Case], of: fn(&Case) -> &Curve) -> Result<Curve, Error> {
    let curves: Vec<&Curve> = runs.iter().map(|run| of(run)).collect();
    let last_s = |curve: &Curve| curve.time_s[curve.time_s.len() - 1];
    let end_s = curves.iter().map(|curve| last_s(curve)).fold(f64::INFINITY, f64::min);
    let time_s: Vec<f64> = curves[0].time_s.iter().copied().take_while(|&t| t <= end_s).collect();
    let mean = |values: fn(&Curve) -> &[f64]| {
        let each: Vec<_> = curves.iter().map(|c| (c.time_s(), values(c))).collect();
        mean_over_time(&each, &time_s)
    };
    let (deflection_m, force_n) = (mean(Curve::deflection_m), mean(Curve::force_n));
    Curve::new(time_s, deflection_m, force_n)
}

/// The mean at `time_s` of values at times of their own, which reach as far.
fn mean_over_time(each: &[(&[f64], &[f64])], time_s: &[f64]) -> Vec<f64> {
    let mut sums = vec![0.0; time_s.len()];
    for (own_s, values) in each {
        let own = at_times(own_s, values, time_s);
        sums.iter_mut().zip(own).for_each(|(sum, value)| *sum += value);
    }
    sums.into_iter().map(|sum| sum / each.len() as f64).collect()
}

/// Values at other times, linear between their own; the first and the last one beyond them.
pub(crate) fn at_times(own_s: &[f64], values: &[f64], time_s: &[f64]) -> Vec<f64> {
    // Runs of one recipe mostly have the same times: nothing is rounded then.
    if own_s.starts_with(time_s) {
        return values[..time_s.len()].to_vec();
    }
    let (first_s, last_s) = (own_s[0], own_s[own_s.len() - 1]);
    let at = |&t: &f64| {
        let t = t.clamp(first_s, last_s);
        piecewise::by_share(own_s, values, piecewise::segment(own_s, t), t)
    };
    time_s.iter().map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_taken_between_times() {
        let (own, values) = ([0.0, 1.0, 3.0], [5.0, 7.0, 1.0]);
        assert_eq!(at_times(&own, &values, &[0.0, 1.0]), [5.0, 7.0]);
        assert_eq!(at_times(&own, &values, &[-1.0, 0.5, 2.0, 9.0]), [5.0, 6.0, 4.0, 1.0]);
        let other = ([0.0, 2.0], [1.0, 3.0]);
        let each = [(&own[..], &values[..]), (&other.0[..], &other.1[..])];
        assert_eq!(mean_over_time(&each, &[0.0, 1.0, 2.0]), [3.0, 4.5, 3.5]);
    }

    #[test]
    fn recipes_are_compared_without_the_run() {
        let recipe = |filter: &str, run: &str| {
            format!(
                r#"{{"study": "{run}", "recipe": {{"filter": "{filter}"}}, "run": {{"path": "{run}"}}}}"#
            )
        };
        assert_eq!(measured(&recipe("none", "a")), measured(&recipe("none", "b")));
        assert_ne!(measured(&recipe("none", "a")), measured(&recipe("CFC60", "a")));
        let imported = |times: bool, path: &str| {
            format!(r#"{{"imported": {{"path": "{path}", "has_times": {times}}}}}"#)
        };
        assert_eq!(measured(&imported(true, "a")), measured(&imported(true, "b")));
        assert_ne!(measured(&imported(true, "a")), measured(&imported(false, "a")));
        assert_ne!(measured(&imported(true, "a")), measured(&recipe("none", "a")));
    }
}
