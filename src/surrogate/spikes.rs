//! Spikes: isolated points of a predicted force that no training curve has.

use super::Model;
use crate::error::{Error, error};

/// A point stands alone if its force lies above both neighbours, or below both, by more than
/// this factor of what any training curve shows.
const SPIKE: f64 = 1.05;
/// Most rounds of taking points back.
const ROUNDS: usize = 100;
/// Most places of a training curve that are examined.
const PROBES: f64 = 4_000.0;

/// Forces of a physical loading branch: 0 at 0, never negative, and no point that stands
/// alone as none of a training curve does. A force that begins with a step reaches its first value at the second point, so that its first
/// peak is kept.
pub(super) fn without_spikes(
    model: &Model,
    deflection_m: &[f64],
    force_n: Vec<f64>,
    of_body: bool,
) -> Result<Vec<f64>, Error> {
    if force_n.iter().any(|f| !f.is_finite()) {
        return Err(error!(
            Prediction,
            "the {model} model cannot predict this speed: train another one",
            model = model.name()
        ));
    }
    let mut force_n: Vec<f64> = force_n.into_iter().map(|f| f.max(0.0)).collect();
    force_n[1] = force_n[1].max(force_n[0]);
    force_n[0] = 0.0;
    let step = deflection_m[1] - deflection_m[0];
    // How far a point lies above both of its neighbours, or below both.
    let stands_out = |before: f64, at: f64, after: f64| {
        let (a, b) = (at - before, at - after);
        if a * b > 0.0 { a.abs().min(b.abs()) } else { 0.0 }
    };
    let most = model.most_kink_n(of_body, step, |curves| {
        let mut most = 0.0_f64;
        // Of many curves 20 that are spread over the speeds show how far points stand out.
        for curve in curves.iter().step_by(curves.len().div_ceil(20).max(1)) {
            // Far finer steps than the curve's own find no other kinks.
            let probes = (2.0 * curve.end_m() / step).clamp(2.0, PROBES) as usize;
            let even = (0..probes)
                .map(|k| step + (curve.end_m() - 2.0 * step).max(0.0) * k as f64 / probes as f64);
            // A point at a corner stands out most.
            let corners = curve.envelope().deflection_m().iter().copied();
            let corners = corners.filter(|&d| d >= step && d + step <= curve.end_m());
            let mut near = [0; 3];
            for d in even.chain(corners.take(PROBES as usize)) {
                let mut force_n = |i: usize, d| curve.envelope().force_near(&mut near[i], d);
                let [a, b, c] = [force_n(0, d - step), force_n(1, d), force_n(2, d + step)];
                most = most.max(stands_out(a, b, c));
            }
        }
        most
    });
    // Taking one point back may leave its neighbour standing: a few rounds settle it.
    for _ in 0..ROUNDS {
        let mut settled = true;
        for i in 2..force_n.len() - 1 {
            let (before, after) = (force_n[i - 1], force_n[i + 1]);
            if most > 0.0 && stands_out(before, force_n[i], after) > SPIKE * most {
                force_n[i] = 0.5 * (before + after);
                settled = false;
            }
        }
        if settled {
            break;
        }
    }
    Ok(force_n)
}
