//! Scatter: deviation of nominally repeated runs from their mean, which no model can remove.

use super::left_out::{STEPS, forces_n};
use super::reference::Reference;
use crate::curve::body::body_motion;
use crate::curve::replicates::at_times;
use crate::curve::{Case, ForceKind};
use crate::dataset::{TrainingCase, TrainingSet, grid};
use crate::signal::l1_ratio;
use crate::surrogate::band;
use crate::surrogate::leave_one_out::{BodyScatter, Scatter, SpeedScatter};

/// The scatter of the set's cases that are means of several of `cases`; `None` without any, or if
/// none can be compared.
pub(super) fn scatter(set: &TrainingSet, cases: &[Case]) -> Option<Scatter> {
    let several = set.cases.iter().filter(|case| case.runs.len() > 1);
    let speeds: Vec<SpeedScatter> = several.filter_map(|mean| at_speed(mean, cases)).collect();
    let degrees = |at: &SpeedScatter| at.runs.len() - 1;
    let degrees_of_freedom: usize = speeds.iter().map(degrees).sum();
    let pooled = |of: &dyn Fn(&SpeedScatter) -> f64| {
        let sum: f64 = speeds.iter().map(|at| degrees(at) as f64 * of(at)).sum();
        sum / degrees_of_freedom as f64
    };
    let root = |of: &dyn Fn(&SpeedScatter) -> f64| pooled(&|at| of(at).powi(2)).sqrt();
    let of_body = |of: fn(&BodyScatter) -> f64| root(&|at| at.body.as_ref().map_or(0.0, of));
    let has_body = speeds.iter().all(|at| at.body.is_some());
    let found = (degrees_of_freedom > 0).then(|| Scatter {
        speeds: Vec::new(),
        degrees_of_freedom,
        force_l1: pooled(&|at| at.force_l1),
        velocity_l1: pooled(&|at| at.velocity_l1),
        force_share: root(&|at| at.force_share),
        largest_force_share: root(&|at| at.largest_force_share),
        body: has_body.then(|| BodyScatter {
            force_share: of_body(|body| body.force_share),
            largest_force_share: of_body(|body| body.largest_force_share),
        }),
    });
    found.map(|pooled| Scatter { speeds, ..pooled })
}

/// Errors of one run against the mean.
struct Apart {
    force_l1: f64,
    velocity_l1: f64,
    declared: Squares,
    /// Of the body force, where it is another.
    body: Option<Squares>,
}

/// Squares of the residuals of one force relative to its local level.
struct Squares {
    mean: f64,
    largest: f64,
}

impl Squares {
    /// Of a run's forces in N against those of the mean at the same deflections.
    fn of(own_n: &[f64], mean_n: &[f64]) -> Self {
        let ratios = band::ratios(own_n, mean_n);
        let squares = || ratios.iter().map(|r| r * r);
        let mean = squares().sum::<f64>() / ratios.len() as f64;
        Self { mean, largest: squares().fold(0.0, f64::max) }
    }
}

fn at_speed(mean: &TrainingCase, cases: &[Case]) -> Option<SpeedScatter> {
    let motion = Reference::of(&mean.case).ok()?;
    // In their own order, so that the order of the cases changes no sum.
    let runs = mean.runs.iter().filter_map(|name| cases.iter().find(|case| case.id.name == *name));
    let apart: Vec<Apart> = runs.map(|run| apart(run, mean, &motion)).collect::<Option<_>>()?;
    let n = apart.len() as f64;
    let over = |of: &dyn Fn(&Apart) -> f64| apart.iter().map(of).sum::<f64>() / (n - 1.0);
    let of_body = |of: fn(&Squares) -> f64| over(&|a| a.body.as_ref().map_or(0.0, of)).sqrt();
    // Of a magnitude, not of a square.
    let unknown = ((n - 1.0) / n).sqrt();
    let found = SpeedScatter {
        speed_m_per_s: mean.speed_m_per_s,
        runs: mean.runs.clone(),
        force_l1: unknown * over(&|a| a.force_l1),
        velocity_l1: unknown * over(&|a| a.velocity_l1),
        force_share: over(&|a| a.declared.mean).sqrt(),
        largest_force_share: over(&|a| a.declared.largest).sqrt(),
        body: apart.iter().all(|a| a.body.is_some()).then(|| BodyScatter {
            force_share: of_body(|squares| squares.mean),
            largest_force_share: of_body(|squares| squares.largest),
        }),
    };
    let SpeedScatter { force_l1, velocity_l1, largest_force_share, body, .. } = found;
    let of_body = body.map_or(0.0, |body| body.largest_force_share);
    let numbers = [force_l1, velocity_l1, largest_force_share, of_body];
    numbers.iter().all(|x| x.is_finite()).then_some(found)
}

fn apart(run: &Case, mean: &TrainingCase, motion: &Reference) -> Option<Apart> {
    let own = run.loading().ok()?.envelope;
    let along = grid(own.end_m().min(mean.envelope.end_m()), STEPS);
    let (own_n, mean_n) = (forces_n(&own, &along), forces_n(&mean.envelope, &along));
    let body = match run.curves.force_kind {
        ForceKind::Contact => {
            let own_n = forces_n(&body_motion(run)?.force, &along);
            Some(Squares::of(&own_n, &forces_n(&mean.motion.force, &along)))
        }
        ForceKind::Body => None,
    };
    let time_s = &motion.time_s[..motion.inside];
    let own_v = at_times(run.curves.sampled.time_s(), &run.curves.closing_speed_m_per_s, time_s);
    Some(Apart {
        force_l1: l1_ratio(&mean_n, &own_n),
        velocity_l1: l1_ratio(&motion.velocity[..motion.inside], &own_v),
        declared: Squares::of(&own_n, &mean_n),
        body,
    })
}
