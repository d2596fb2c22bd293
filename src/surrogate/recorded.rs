//! A recorded case in the form of a predicted curve, so that it is exported like one.

use std::collections::BTreeMap;

use super::Warning;
use super::max_crush::MaxCrush;
use super::predicted::{PredictedCurve, Provenance, Rebound, envelope};
use crate::curve::body::LEAST_STEP;
use crate::curve::force_curve::ForceCurveError;
use crate::curve::{Case, Envelope, ForceCurve, ForceKind, Parameter};
use crate::dataset::OTHER_MASS;
use crate::error::{Error, error};

/// The name that stands where a predicted curve has its model's.
pub(crate) const RECORDED: &str = "recorded";

impl PredictedCurve {
    /// The curve of one recorded run: its declared force, and beside a contact force the one that
    /// moved the body, both at the points of either. Exact between the points, as both are
    /// piecewise linear, but for the last 1/2000 of a record's crush, of which a peak is kept.
    ///
    /// # Errors
    /// If the case's states contain no loading branch.
    pub fn of_case(case: &Case) -> Result<Self, Error> {
        let no_curve = |e: ForceCurveError| error!(Prediction, "{}: {e}", case.id.name);
        let of_case = |force: ForceKind| {
            let mut curve = ForceCurve::of_case(case, force)?;
            if case.moves_by_its_force() {
                curve.loading = corners(curve.loading)?;
            }
            Ok(curve)
        };
        let declared = of_case(case.curves.force_kind).map_err(no_curve)?;
        let body = match case.curves.force_kind {
            ForceKind::Contact if !case.has_contact_alone() => of_case(ForceKind::Body).ok(),
            _ => None,
        };
        let mut deflection_m = union(&declared.loading, body.as_ref().map(|b| &b.loading));
        // Where the body turns, a step of the force between two states is not a stiffness; a peak there is one.
        let end_m = deflection_m.last().copied().unwrap_or_default();
        if !case.moves_by_its_force() {
            let is_kept = |d: f64| d == end_m || d < (1.0 - LEAST_STEP) * end_m;
            let force = |d: f64| declared.loading.force_at(d);
            let kept = deflection_m.iter().filter(|d| is_kept(**d));
            let peak_n = kept.map(|d| force(*d)).fold(0.0, f64::max);
            deflection_m.retain(|d| is_kept(*d) || force(*d) > peak_n);
        }
        let at = |e: &Envelope| -> Vec<f64> {
            deflection_m.iter().map(|&d| e.force_at(d).max(0.0)).collect()
        };
        let force_n = at(&declared.loading);
        let loading = envelope(deflection_m.clone(), force_n.clone())?;
        let driving = body.as_ref().unwrap_or(&declared);
        let top_n = driving.loading.force_at(driving.loading.end_m());
        let rebound = driving.unloading.stiffness_n_per_m().map(|stiffness_n_per_m| Rebound {
            speed_m_per_s: top_n
                / (stiffness_n_per_m * case.conditions.masses.effective_kg()).sqrt(),
            stiffness_n_per_m,
            left_out_error: None,
        });
        let mut curve = Self {
            body_force_n: body.as_ref().map(|b| at(&b.loading)),
            body_drives: body.as_ref().map(|_| ForceKind::Body.drives().into()),
            body_unloading_stiffness_n_per_m: body.as_ref().map(|b| b.loading.max_slope()),
            unloading_stiffness_n_per_m: declared
                .unloading
                .stiffness_n_per_m()
                .unwrap_or_else(|| declared.loading.max_slope()),
            force_low_n: None,
            force_high_n: None,
            beyond: None,
            body_force_low_n: None,
            body_force_high_n: None,
            forest_quantiles: None,
            drives: case.curves.force_kind.drives().into(),
            rebound,
            max_deflection_m: loading.end_m(),
            speed_m_per_s: case.conditions.speed.m_per_s,
            speed_kind: case.conditions.speed.kind,
            mass_kg: case.conditions.masses.body_kg,
            energy_j: loading.work(),
            model: RECORDED.into(),
            warnings: Warning::of_case(&case.id.name, case.is_truncated(), &case.quality.warnings),
            provenance: provenance(case, loading.work(), body.as_ref().map(|b| b.loading.work())),
            deflection_m,
            force_n,
        };
        curve.unloading_stiffness_n_per_m =
            curve.stiffness_where_stopped(&loading, case.curves.force_kind, case.curves.force_kind);
        curve.body_unloading_stiffness_n_per_m = body
            .map(|b| curve.stiffness_where_stopped(&b.loading, ForceKind::Body, ForceKind::Body));
        Ok(curve)
    }
}

/// Points on a line between others, within this share of the largest force, are those of states and
/// not of the table that a motion was made of.
const ON_LINE: f64 = 1e-9;
/// A curve that has fewer corners keeps all its points, since tools want some.
const FEWEST: usize = 4;

/// The same function through its corners alone.
fn corners(curve: Envelope) -> Result<Envelope, Error> {
    let (d, f) = (curve.deflection_m(), curve.force_n());
    let margin_n = ON_LINE * curve.peak_force_n();
    let (mut kept, mut from) = (vec![0], 0);
    // Slopes of the lines from the last corner that pass all points behind it.
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    for i in 1..d.len() {
        let slope = |from: usize, margin_n: f64| (f[i] + margin_n - f[from]) / (d[i] - d[from]);
        if !(low..=high).contains(&slope(from, 0.0)) {
            from = i - 1;
            kept.push(from);
            (low, high) = (f64::NEG_INFINITY, f64::INFINITY);
        }
        (low, high) = (low.max(slope(from, -margin_n)), high.min(slope(from, margin_n)));
    }
    kept.push(d.len() - 1);
    if kept.len() < FEWEST {
        return Ok(curve);
    }
    Envelope::new(kept.iter().map(|&i| d[i]).collect(), kept.iter().map(|&i| f[i]).collect())
}

/// Where a case comes from; the works are those of its declared force and of the body's, in J.
fn provenance(case: &Case, work_j: f64, body_work_j: Option<f64>) -> Provenance {
    let kinetic_energy_j = case.conditions.masses.kinetic_energy_j(case.conditions.speed);
    let speed = case.conditions.speed.m_per_s;
    let mut parameters: BTreeMap<String, Parameter> = case.conditions.parameters.clone();
    if let Some(other) = case.conditions.masses.other_kg {
        parameters.insert(OTHER_MASS.into(), Parameter::Number(other));
    }
    Provenance {
        written_by: concat!("crumple ", env!("CARGO_PKG_VERSION")).into(),
        group: case.id.group.clone(),
        case: Some(case.id.name.clone()),
        force_kind: case.curves.force_kind,
        training_hash: case.provenance.fingerprint.clone(),
        study_units: case.units(),
        training_speeds_m_per_s: vec![speed],
        in_range: true,
        nearest_training_speed_m_per_s: speed,
        distance_to_nearest_m_per_s: 0.0,
        max_crush_rule: None,
        max_crush: MaxCrush::NONE,
        kinetic_energy_j,
        energy_over_kinetic: work_j / kinetic_energy_j,
        body_energy_over_kinetic: body_work_j.map(|work_j| work_j / kinetic_energy_j),
        band: None,
        body_band: None,
        parameters,
    }
}

/// The points of one or both envelopes up to the shorter end, rising; points closer together than 1e-9
/// of the end are one.
fn union(a: &Envelope, b: Option<&Envelope>) -> Vec<f64> {
    let end = b.map_or(a.end_m(), |b| a.end_m().max(b.end_m()));
    let mut all: Vec<f64> = a.deflection_m().to_vec();
    all.extend(b.into_iter().flat_map(|b| b.deflection_m().iter().copied()));
    all.sort_by(f64::total_cmp);
    all.dedup_by(|next, kept| *next - *kept <= 1e-9 * end);
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// States between the points of a table are left out, whatever they are; the function stays.
    #[test]
    fn a_table_comes_out_by_its_corners() {
        let table = [(0.0, 0.0), (0.05, 3e6), (0.25, 1e6), (0.5, 1.5e6), (1.0, 2e6)];
        let (d, f): (Vec<f64>, Vec<f64>) = table.into_iter().unzip();
        let table = Envelope::new(d.clone(), f.clone()).unwrap();
        let mut all: Vec<f64> = (0..=1000).map(|i| f64::from(i) / 1000.0).collect();
        all.extend(&d);
        all.sort_by(f64::total_cmp);
        all.dedup();
        let forces = all.iter().map(|&d| table.force_at(d)).collect();
        let found = corners(Envelope::new(all.clone(), forces).unwrap()).unwrap();
        assert_eq!((found.deflection_m(), found.force_n()), (&d[..], &f[..]));
        // A curved one keeps its points, and so does a line.
        let curved = Envelope::new(all.clone(), all.iter().map(|d| d * d * 1e6).collect()).unwrap();
        assert_eq!(corners(curved.clone()).unwrap(), curved);
        let line = Envelope::new(all.clone(), all.iter().map(|d| d * 1e6).collect()).unwrap();
        assert_eq!(corners(line.clone()).unwrap(), line);
    }
}
