//! A run that is left out, predicted from the others, and drawn beside what FE has.

use super::curves::{LeftOutPrediction, left_out};
use crate::assess::reference::Reference;
use crate::assess::validate::{Choice, train};
use crate::curve::{Case, ForceKind};
use crate::dataset::{TrainingSet, is_same_speed};
use crate::error::{Error, error};
use crate::plot::Chart;
use crate::surrogate::{PredictedCurve, Query, predict};
use crate::unit::km_per_h;

/// Trains the model of `choice` on the runs at other speeds, predicts the curve at `speed_m_per_s`, lets its body force (or its
/// only force) stop one mass, and draws both beside the run.
///
/// # Errors
/// If there is no such run, or the others are too few.
pub fn left_out_at(
    group: &str,
    cases: &[Case],
    speed_m_per_s: f64,
    choice: Choice,
) -> Result<Chart, Error> {
    let is_that = |case: &&Case| is_same_speed(case.conditions.speed.m_per_s, speed_m_per_s);
    let set = TrainingSet::new(group, cases)?;
    // Several runs of that speed are one case, their mean.
    let mut own = set.cases.iter().map(|own| &*own.case);
    let Some(case) = own.find(is_that) else {
        let speeds: Vec<String> =
            cases.iter().map(|c| km_per_h(c.conditions.speed.m_per_s)).collect();
        let known = speeds.join(", ");
        return Err(error!(
            Plot,
            "{group} has no run at {}: its speeds are {known}",
            km_per_h(speed_m_per_s)
        ));
    };
    let others: Vec<Case> = cases.iter().filter(|c| !is_that(c)).cloned().collect();
    let model = train(group, &others, choice)?;
    let curve =
        predict(&model, &Query { extrapolate: true, ..Query::at(case.conditions.speed.m_per_s) })?;
    let run = Reference::of(case)?.run(&curve.driving(moving_force(&curve))?)?;
    let motion = Some((&run.time_s[..], &run.bodies[0].v_m_per_s[..]));
    Ok(left_out(LeftOutPrediction { case, curve: &curve, motion }))
}

/// The force that moves one mass, or the only one there is.
fn moving_force(curve: &PredictedCurve) -> ForceKind {
    match curve.body_force_n {
        Some(_) => ForceKind::Body,
        None => curve.provenance.force_kind,
    }
}
