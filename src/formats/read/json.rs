//! Curve of a JSON file made by `crumple predict`: the master format of exports.

use crate::error::{Error, error};
use std::path::Path;

use super::columns::too_few;
use super::curve::{self, Metadata, ReadCurve, title};
use super::{Input, MIN_POINTS};
use crate::curve::{ForceKind, Parameter};
use crate::dataset::OTHER_MASS;
use crate::file;
use crate::formats::MAX_CURVE_BYTES;
use crate::surrogate::PredictedCurve;
use crate::unit::UnitSystem;

/// Reads a predicted curve and checks its promises.
pub(crate) fn predicted(path: &Path) -> Result<PredictedCurve, Error> {
    let bytes = file::read(path, MAX_CURVE_BYTES).map_err(|e| curve::content(path)(e.into()))?;
    parse(&bytes).map_err(curve::content(path))
}

fn parse(bytes: &[u8]) -> Result<PredictedCurve, Error> {
    let curve: PredictedCurve = serde_json::from_slice(bytes).map_err(|source| {
        error!(
            CurveFile,
            "this is not a predicted curve ({source}): give a JSON file made by crumple predict"
        )
        .caused_by(source)
    })?;
    curve.envelope()?;
    if curve.body_force_n.is_some() {
        curve.driving_envelope()?;
    }
    Ok(curve)
}

/// Whether the first byte that is not a blank opens an object.
pub(super) fn recognise(input: &Input<'_>) -> bool {
    input.text.trim_ascii_start().starts_with('{')
}

/// The declared force, with the body force if the file has both; or the force that was
/// asked for, alone.
pub(super) fn read(input: &Input<'_>) -> Result<ReadCurve, Error> {
    let mut curve = parse(input.text.as_bytes())?;
    let both = curve.body_force_n.is_some();
    let mut notes = vec!["units: SI, as all JSON files of crumple predict".into()];
    if let Some(asked) = input.options.force {
        curve = curve.of_force(asked)?;
    }
    let points = curve.deflection_m.len();
    if points < MIN_POINTS {
        return Err(too_few(points, ""));
    }
    if both {
        notes.push(match curve.body_force_n {
            Some(_) => "force: the contact force, and the body force for the motion".into(),
            None => "force: the requested one; the file also holds the other".into(),
        });
    }
    // The body force along the deflection determines the motion; a contact force alone is
    // the best there is.
    let has_contact = curve.provenance.force_kind == ForceKind::Contact;
    let other_mass_kg = match curve.provenance.parameters.get(OTHER_MASS) {
        Some(Parameter::Number(mass)) => Some(*mass),
        _ => None,
    };
    let facts = Metadata {
        force: Some(curve.provenance.force_kind),
        speed_m_per_s: Some(curve.speed_m_per_s),
        speed_kind: Some(curve.speed_kind),
        unloading_stiffness_n_per_m: Some(curve.unloading_stiffness_n_per_m),
        body_unloading_stiffness_n_per_m: curve.body_unloading_stiffness_n_per_m,
        mass_kg: Some(curve.mass_kg),
        other_mass_kg,
        ..Metadata::default()
    };
    Ok(ReadCurve {
        title: title(&format!("{}, {}", curve.provenance.group, curve.model), &mut notes),
        deflection_m: curve.deflection_m,
        force_n: curve.force_n,
        body_force_n: curve.body_force_n.filter(|_| has_contact),
        facts,
        units: Some(UnitSystem::SI),
        notes,
        is_ready: true,
        ..ReadCurve::default()
    })
}
