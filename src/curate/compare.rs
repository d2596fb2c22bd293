//! Cases side by side: what differs from the first of them.

use crate::error::Error;
use serde::Serialize;

use crate::curve::{Case, Envelope, ForceKind};
use crate::dataset::grid;
use crate::signal::l1_ratio;
use crate::unit::SpeedKind;

#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Comparison {
    pub reference: String,
    pub cases: Vec<Difference>,
}

/// One case, and its differences from the reference; those of values are shares of the reference's.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Difference {
    pub group: String,
    pub case: String,
    pub speed_m_per_s: f64,
    pub speed_kind: SpeedKind,
    pub force_kind: ForceKind,
    pub mass_kg: f64,
    pub max_deflection_m: f64,
    /// ∫F dd up to it, in J.
    #[serde(rename = "work_J")]
    pub work_j: f64,
    #[serde(rename = "peak_force_N")]
    pub peak_force_n: f64,
    pub speed_difference: f64,
    pub mass_difference: f64,
    pub max_deflection_difference: f64,
    pub work_difference: f64,
    pub peak_force_difference: f64,
    /// Deflection up to which both have a loading branch, in m.
    pub common_deflection_m: f64,
    /// Σ|F − F₀| / Σ|F₀| of the loading branches over even steps of that deflection; `None` if the
    /// reference has no force there.
    pub force_l1: Option<f64>,
}

/// Steps of the common deflection at least.
const STEPS: usize = 400;

pub(crate) fn compare(cases: &[&Case]) -> Result<Option<Comparison>, Error> {
    let Some(first) = cases.first() else { return Ok(None) };
    let reference = first.loading()?.envelope;
    let differences: Result<Vec<Difference>, Error> = cases
        .iter()
        .map(|case| Ok(difference(first, &reference, case, case.loading()?.envelope)))
        .collect();
    let reference = format!("{}/{}", first.id.group, first.id.name);
    Ok(Some(Comparison { reference, cases: differences? }))
}

fn difference(first: &Case, reference: &Envelope, case: &Case, envelope: Envelope) -> Difference {
    let share = |value: fn(&Case) -> f64| value(case) / value(first) - 1.0;
    let common_deflection_m = reference.end_m().min(envelope.end_m());
    let along = grid(common_deflection_m, STEPS);
    let at = |e: &Envelope| -> Vec<f64> { along.iter().map(|&d| e.force_at(d)).collect() };
    let force_l1 = l1_ratio(&at(reference), &at(&envelope));
    Difference {
        group: case.id.group.clone(),
        case: case.id.name.clone(),
        speed_m_per_s: case.conditions.speed.m_per_s,
        speed_kind: case.conditions.speed.kind,
        force_kind: case.curves.force_kind,
        mass_kg: case.conditions.masses.body_kg,
        max_deflection_m: case.max_deflection_m(),
        work_j: case.quality.audit.work_j,
        peak_force_n: case.peak_force_n(),
        speed_difference: share(|c| c.conditions.speed.m_per_s),
        mass_difference: share(|c| c.conditions.masses.body_kg),
        max_deflection_difference: share(Case::max_deflection_m),
        work_difference: share(|c| c.quality.audit.work_j),
        peak_force_difference: share(Case::peak_force_n),
        common_deflection_m,
        force_l1: Some(force_l1).filter(|l1| l1.is_finite()),
    }
}
