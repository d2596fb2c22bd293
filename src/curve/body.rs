//! Body force: the force that drives the car body, from the rate of the deflection.

use super::loading::{loading_branch, loading_end};
use super::{Case, Curve, Envelope};
use crate::signal::{cfc, derivative};

/// Class of the filter of accelerations that are compared: that of structural accelerations in SAE J211-1.
const CLASS: u32 = 60;
/// Classes of the filter of the body force, in the order in which they are tried (SAE J211-1).
const CLASSES: [u32; 4] = [CLASS, 180, 600, 1000];
/// A class that changes the energy by more than this share is too low for the duration of the impact.
const LOST: f64 = 0.005;
/// Most of the energy that a factor makes up.
const MADE_UP: f64 = 0.1;

/// The motion of a case along its loading branch and at the end of it.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyMotion {
    /// Effective mass times deceleration over deflection, in N, filtered, never below 0.
    pub force: Envelope,
    /// Closing speed in m/s over deflection: an envelope by its shape, not a force.
    pub closing_speed: Envelope,
    /// Separation speed in m/s, the mean over up to 5 ms after the body force has first fallen to
    /// zero after the maximum deflection; `None` if the record ends before it does.
    pub rebound_speed_m_per_s: Option<f64>,
}

/// Stiffness in N/m of the straight line on which a body of `mass_kg` leaves a force of `top_n`
/// at `rebound_m_per_s`: `F²/(m v²)`, as `F²/2k = m v²/2`. `None` if that is not a stiffness.
pub(crate) fn rebound_stiffness_n_per_m(
    top_n: f64,
    mass_kg: f64,
    rebound_m_per_s: f64,
) -> Option<f64> {
    let stiffness = top_n * top_n / (mass_kg * rebound_m_per_s * rebound_m_per_s);
    (stiffness > 0.0 && stiffness.is_finite()).then_some(stiffness)
}

/// The body force of a case at the sampled times, in N; of a table without times its own force.
pub(crate) fn body_force_n(case: &Case) -> Vec<f64> {
    // A motion computed from a force adds nothing to the force itself.
    if case.moves_by_its_force() {
        return case.curves.sampled.force_n().to_vec();
    }
    let mass_kg = case.conditions.masses.effective_kg();
    body_force_of(&case.curves.sampled, &case.curves.closing_speed_m_per_s, mass_kg).0
}

/// The body force `−m dv/dt` of the closing speed `v` at the sampled times, in N, for the effective mass, and the class of
/// its filter.
///
/// It is filtered with the lowest class that keeps the energy of the impact within 0.5 %; if the sampling allows no such class, with the one
/// that changes the energy least; and if it allows none, or none that keeps nine tenths of it, not at all. A factor makes up for the rest, so that a body that this force stops
/// loses the energy that it loses in FE.
pub(super) fn body_force_of(sampled: &Curve, speeds: &[f64], mass: f64) -> (Vec<f64>, Option<u32>) {
    let time_s = sampled.time_s();
    let accelerations = derivative(time_s, speeds);
    let raw: Vec<f64> = accelerations.into_iter().map(|a| -mass * a).collect();
    let end = loading_end(sampled);
    let lost_j = 0.5 * mass * (speeds[0] * speeds[0] - speeds[end] * speeds[end]);
    // The work over the energy that the body lost.
    let share = |force_n: &[f64]| {
        let work_j = over_deflection(sampled, force_n.to_vec())?.pushing().work();
        let share = work_j / lost_j;
        (share > 0.0 && share.is_finite()).then_some(share)
    };
    // The contact has not reached the body before the first state.
    let from_rest = |(mut force_n, class): (Vec<f64>, Option<u32>)| {
        force_n[0] = 0.0;
        let share = share(&force_n)?;
        Some((force_n, share, class))
    };
    let of_class =
        |&class: &u32| Some((cfc::filter(class, time_s, &raw).ok()?.values, Some(class)));
    let by_class = CLASSES.iter().filter_map(of_class).filter_map(from_rest);
    let mut best: Option<(Vec<f64>, f64, Option<u32>)> = None;
    let changes = |of: &(Vec<f64>, f64, Option<u32>)| (of.1 - 1.0).abs();
    for next in by_class {
        if best.as_ref().is_none_or(|best| changes(&next) < changes(best)) {
            best = Some(next);
        }
        if best.as_ref().is_some_and(|best| changes(best) <= LOST) {
            break;
        }
    }
    // A crush too short for every class.
    if best.as_ref().is_none_or(|best| changes(best) > MADE_UP) {
        let unfiltered = from_rest((raw.clone(), None));
        best = unfiltered.filter(|of| best.is_none() || changes(of) <= MADE_UP).or(best);
    }
    match best {
        Some((mut force_n, share, class)) => {
            // Further off, mass, speeds and deflection contradict each other, which no factor mends.
            if (share - 1.0).abs() <= MADE_UP {
                force_n.iter_mut().for_each(|f| *f /= share);
            }
            (force_n, class)
        }
        None => {
            let mut force_n = filtered(time_s, raw);
            force_n[0] = 0.0;
            (force_n, None)
        }
    }
}

/// Values at the sampled times over the deflection of the loading branch.
fn over_deflection(sampled: &Curve, values: Vec<f64>) -> Option<Envelope> {
    let curve =
        Curve::new(sampled.time_s().to_vec(), sampled.deflection_m().to_vec(), values).ok()?;
    Some(loading_branch(&curve).ok()?.envelope)
}

/// The body force over deflection, and the speeds around it.
///
/// It differs from the contact force by the mass that the crush zone stops before the body
/// (an impact's first spike is the nose being stopped). `None` if the samples contain no loading branch.
pub(crate) fn body_motion(case: &Case) -> Option<BodyMotion> {
    let sampled = &case.curves.sampled;
    let speeds = &case.curves.closing_speed_m_per_s;
    let force_n = body_force_n(case);
    let end = loading_end(sampled);
    let rebound = (end + 1..speeds.len())
        .find(|&i| force_n[i] <= 0.0)
        .map(|i| separation_m_per_s(sampled.time_s(), speeds, i));
    let force = match case.moves_by_its_force() {
        true => case.loading().ok()?.envelope,
        false => over_deflection(sampled, force_n)?.pushing(),
    };
    Some(BodyMotion {
        closing_speed: over_deflection(sampled, speeds.clone())?,
        force,
        rebound_speed_m_per_s: rebound.filter(|&v| v > 0.0),
    })
}

/// The force that drove the body, from its speeds, for loading and unloading, not filtered.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RecordedForce {
    /// Loading branch, in N.
    pub loading: Envelope,
    /// Unloading branch from the maximum deflection to where the force is first zero.
    pub unloading_deflection_m: Vec<f64>,
    pub unloading_force_n: Vec<f64>,
    /// Stiffness in N/m of the straight line that returns the energy of the separation.
    pub unloading_stiffness_n_per_m: Option<f64>,
}

/// The body still oscillates after it has left the obstacle: its separation speed is the mean
/// over this time, in s.
const SEPARATION_S: f64 = 0.005;

/// Separation speed of closing speeds whose body has parted at state `from`.
fn separation_m_per_s(time_s: &[f64], closing_m_per_s: &[f64], from: usize) -> f64 {
    let until = time_s.iter().take_while(|&&time| time <= time_s[from] + SEPARATION_S).count();
    let after = &closing_m_per_s[from..until];
    -after.iter().sum::<f64>() / after.len() as f64
}

/// Near the maximum deflection the force still oscillates in time while the deflection hardly
/// moves: over the last share of it one mean force is used, so that the rebound does not depend on
/// where exactly a run stops.
const LAST_SHARE: f64 = 0.005;

/// The mean force between two states from the change of kinetic energy over the change of
/// deflection, `−m Δ(v²)/2Δd`: a body that runs on it has the recorded speeds at the recorded
/// deflections. `None` if the samples contain no loading branch.
pub(crate) fn recorded_force(case: &Case) -> Option<RecordedForce> {
    let (t, d) = (case.curves.sampled.time_s(), case.curves.sampled.deflection_m());
    let v = &case.curves.closing_speed_m_per_s;
    let mass = case.conditions.masses.effective_kg();
    let end = loading_end(&case.curves.sampled);
    let states = advancing_states(d, end);
    let mean = |i: usize, j: usize| -0.5 * mass * (v[j] * v[j] - v[i] * v[i]) / (d[j] - d[i]);
    // The mean forces between them.
    let mut means = Vec::with_capacity(states.len());
    // A body that oscillates forward at first would need tension: the impulse that an interface that only pushes
    // cannot provide is subtracted from the following pushes.
    let mut owed_j = 0.0;
    for w in states.windows(2) {
        let step = d[w[1]] - d[w[0]];
        let work_j = mean(w[0], w[1]) * step + owed_j;
        owed_j = work_j.min(0.0);
        means.push(work_j.max(0.0) / step);
    }
    let top = *means.last()?;
    // At a state the mean of both sides, low enough that none between two states is below 0;
    // between them what keeps their energy.
    let at = |k: usize| match k {
        0 => 0.0,
        k if k == means.len() => top,
        k => (0.5 * (means[k - 1] + means[k])).min(2.0 * means[k - 1]).min(2.0 * means[k]),
    };
    let (mut deflection_m, mut force_n) = (vec![0.0], vec![0.0]);
    for (k, w) in states.windows(2).enumerate() {
        deflection_m.extend([0.5 * (d[w[0]] + d[w[1]]), d[w[1]]]);
        force_n.extend([2.0 * means[k] - 0.5 * (at(k) + at(k + 1)), at(k + 1)]);
    }
    let (mut unloading_deflection_m, mut unloading_force_n) = (vec![d[end]], vec![top]);
    let (mut parted, mut from) = (None, end);
    for i in end + 1..d.len() {
        if d[i] > d[from] {
            break;
        }
        // Where the body turns it hardly moves, and the energies of two states say nothing of a force.
        if d[from] - d[i] < LEAST_STEP * d[end] {
            continue;
        }
        unloading_deflection_m.push(0.5 * (d[from] + d[i]));
        unloading_force_n.push(mean(from, i));
        if mean(from, i) <= 0.0 {
            parted = Some(from);
            break;
        }
        from = i;
    }
    let separation = parted.map(|from| separation_m_per_s(t, v, from));
    Some(RecordedForce {
        loading: Envelope::new(deflection_m, force_n).ok()?.pushing(),
        unloading_deflection_m,
        unloading_force_n,
        unloading_stiffness_n_per_m: separation
            .and_then(|speed| rebound_stiffness_n_per_m(top, mass, speed)),
    })
}

/// Shortest distance between states that are used, as a share of the maximum deflection: over a shorter one the digits of a file make steps of
/// the force, and their slopes would pass for stiffness.
pub(crate) const LEAST_STEP: f64 = 1.0 / 2000.0;

/// States on the way to the `end` of the loading branch whose deflection advances, with the first
/// and the last one.
fn advancing_states(deflection_m: &[f64], end: usize) -> Vec<usize> {
    let mut states = vec![0];
    let mut next_m = LEAST_STEP * deflection_m[end];
    for i in 1..end {
        let d = deflection_m[i];
        if d >= next_m && d <= (1.0 - LAST_SHARE) * deflection_m[end] {
            states.push(i);
            next_m = d + LEAST_STEP * deflection_m[end];
        }
    }
    states.push(end);
    states
}

/// Whether [`filtered`] filters values at `time_s`.
pub(crate) fn can_filter(time_s: &[f64]) -> bool {
    cfc::filter(CLASS, time_s, &vec![0.0; time_s.len()]).is_ok()
}

/// CFC 60 of values at `time_s`, as they are if their interval is too coarse for it.
pub(crate) fn filtered(time_s: &[f64], values: Vec<f64>) -> Vec<f64> {
    match cfc::filter(CLASS, time_s, &values) {
        Ok(filtered) => filtered.values,
        Err(_) => values,
    }
}
