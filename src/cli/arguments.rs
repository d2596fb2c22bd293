//! Arguments that several commands share.

use crate::curve::{ForceKind, Parameter};
use crate::solver::{Selection, WantedId};
use crate::surrogate::max_crush::MaxCrushRule;
use crate::unit::{MASS, SPEED, UnitSystem};
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

/// A speed with its unit, in m/s.
pub(super) fn speed(text: &str) -> Result<f64, String> {
    SPEED.parse_positive(text).map_err(|e| e.to_string())
}

/// A mass with its unit, in kg.
pub(super) fn mass(text: &str) -> Result<f64, String> {
    MASS.parse_positive(text).map_err(|e| e.to_string())
}

pub(super) fn units(text: &str) -> Result<UnitSystem, String> {
    UnitSystem::parse(text).map_err(|e| e.to_string())
}

/// A case parameter: `angle_deg=10` or `obstacle=pole`.
pub(super) fn parameter(text: &str) -> Result<(String, Parameter), String> {
    let (name, value) = text
        .split_once('=')
        .filter(|(name, value)| !name.is_empty() && !value.is_empty())
        .ok_or_else(|| format!("\"{text}\" is not a parameter: write NAME=VALUE"))?;
    let value = match value.parse::<f64>() {
        Ok(number) if number.is_finite() => Parameter::Number(number),
        Ok(_) => return Err(format!("\"{value}\" is not finite")),
        Err(_) => Parameter::Category(value.into()),
    };
    Ok((name.into(), value))
}

/// Histories of a solver's file by their options; what is not named is not narrowed.
pub(super) fn selection(
    ids: &[WantedId],
    components: &[String],
    section: Option<&str>,
) -> Selection {
    Selection {
        ids: (!ids.is_empty()).then(|| ids.to_vec()),
        components: (!components.is_empty()).then(|| components.to_vec()),
        section: section.map(Into::into),
        ..Selection::all()
    }
}

/// One of a few values of the library, by name and with a line of help each.
pub(super) fn one_of<T: Copy + Send + Sync + 'static>(
    values: &'static [(&'static str, T, &'static str)],
) -> impl TypedValueParser<Value = T> {
    let names = values.iter().map(|(name, _, help)| PossibleValue::new(*name).help(*help));
    PossibleValuesParser::new(names).map(|given| {
        let found = values.iter().find(|(name, ..)| *name == given);
        found.expect("the parser lets only these names pass").1
    })
}

pub(super) const MAX_CRUSH_RULES: &[(&str, MaxCrushRule, &str)] = &[
    ("spline", MaxCrushRule::Spline, "Cubic spline through the training speeds (reference method)"),
    ("monotone", MaxCrushRule::Monotone, "Monotone cubic through (0, 0) and the training speeds"),
    ("energy", MaxCrushRule::Energy, "Where the curve has absorbed the kinetic energy"),
    ("motion", MaxCrushRule::Motion, "Where the body's own force has stopped it"),
];

/// Forces of a curve.
pub(super) const FORCES: &[(&str, ForceKind, &str)] = &[
    ("body", ForceKind::Body, "The force that drives a body of one mass"),
    (
        "contact",
        ForceKind::Contact,
        "The force on the obstacle: for bodies whose crush zone is a separate mass",
    ),
];
