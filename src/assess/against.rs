//! What has changed since an earlier validation of a group: after another FE run, another recipe or another program.

use std::collections::BTreeSet;

use serde::Serialize;

use crate::surrogate::leave_one_out::{LeftOut, Validation};

/// A number before and now; absent where there was none.
pub(crate) type Pair = [Option<f64>; 2];

/// An earlier validation of the same group beside this one.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Against {
    /// The model chosen before.
    pub chosen_before: String,
    /// Half width of the band between the speeds, in shares of the local force level: before and now.
    pub band_share: Pair,
    /// The distance of training speeds, in m/s, that each half width is for: it grows with the distance.
    pub band_span_m_per_s: Pair,
    /// How many inner speeds were left out before and now, and in both: the means are over these.
    pub inner_speeds: [usize; 3],
    /// Mean errors over inner speeds, in the order of this validation; then models that it lacks.
    pub models: Vec<Changed>,
    /// Errors of the models chosen before and now at every speed that was left out, as `case`.
    pub speeds: Vec<Changed>,
}

/// Errors before and now.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Changed {
    /// The model or the case.
    pub name: String,
    /// Σ|p−r| / Σ|r| of the force.
    pub force_l1: Pair,
    /// Of the largest crush, relative.
    pub max_crush_error: Pair,
    /// Of the velocity in a run of one mass.
    pub velocity_l1: Pair,
    /// Of the acceleration there (CFC 60).
    pub acceleration_l1: Pair,
}

type Errors = [f64; 4];

impl Changed {
    fn of(name: &str, before: Option<Errors>, now: Option<Errors>) -> Self {
        let pair = |i: usize| [before.map(|of| of[i]), now.map(|of| of[i])];
        Self {
            name: name.into(),
            force_l1: pair(0),
            max_crush_error: pair(1),
            velocity_l1: pair(2),
            acceleration_l1: pair(3),
        }
    }

    /// All in the order of `now`, then those that are gone.
    fn all(before: &[(&str, Errors)], now: &[(&str, Errors)]) -> Vec<Self> {
        let find = |of: &[(&str, Errors)], name: &str| {
            of.iter().find(|(there, _)| *there == name).map(|(_, errors)| *errors)
        };
        let gone = before.iter().filter(|(name, _)| find(now, name).is_none());
        let names = now.iter().chain(gone).map(|(name, _)| *name);
        names.map(|name| Self::of(name, find(before, name), find(now, name))).collect()
    }
}

impl Against {
    pub(crate) fn of(before: &Validation, now: &Validation) -> Self {
        let share = |of: &Validation| of.band.map(|band| band.pointwise_share);
        let span = |of: &Validation| of.band.map(|band| band.span_m_per_s);
        let inner = |of: &Validation| -> BTreeSet<String> {
            of.rows.iter().filter(|row| row.inner).map(|row| row.case.clone()).collect()
        };
        let (of_before, of_now) = (inner(before), inner(now));
        let common: BTreeSet<String> = of_before.intersection(&of_now).cloned().collect();
        Self {
            chosen_before: before.chosen.clone(),
            band_share: [share(before), share(now)],
            band_span_m_per_s: [span(before), span(now)],
            inner_speeds: [of_before.len(), of_now.len(), common.len()],
            models: Changed::all(&means(before, &common), &means(now, &common)),
            speeds: Changed::all(&speeds(before), &speeds(now)),
        }
    }
}

fn errors(row: &LeftOut) -> Errors {
    [row.force_l1, row.max_crush_error, row.velocity_l1, row.acceleration_l1]
}

/// Of all models that have means, over these cases.
fn means<'a>(of: &'a Validation, cases: &BTreeSet<String>) -> Vec<(&'a str, Errors)> {
    let mean = |model: &str| {
        let rows = of.rows.iter().filter(|row| row.model == model && cases.contains(&row.case));
        let rows: Vec<Errors> = rows.map(errors).collect();
        let mean = |i: usize| rows.iter().map(|of| of[i].abs()).sum::<f64>() / rows.len() as f64;
        (!rows.is_empty()).then(|| std::array::from_fn(mean))
    };
    of.means.iter().filter_map(|m| Some((m.model.as_str(), mean(&m.model)?))).collect()
}

/// Of the chosen model.
fn speeds(of: &Validation) -> Vec<(&str, Errors)> {
    let rows = of.rows.iter().filter(|row| row.model == of.chosen);
    rows.map(|row| (row.case.as_str(), errors(row))).collect()
}
