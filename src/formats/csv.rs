//! Curve as CSV: deflection and force under `#` header lines.

use std::fmt::Write;

use super::{ExportError, Options, facts, nine_digits};
use crate::surrogate::PredictedCurve;
use crate::unit::{FORCE, LENGTH, UnitSystem};

pub fn write(curve: &PredictedCurve, options: &Options) -> Result<Vec<u8>, ExportError> {
    let units = options.units.unwrap_or(UnitSystem::SI);
    let (length, force) =
        LENGTH.name_of(units.length_m).zip(FORCE.name_of(units.force())).ok_or_else(|| {
            ExportError::NoUnitNames { lengths: LENGTH.known_units(), forces: FORCE.known_units() }
        })?;
    let mut out = String::new();
    // Writing to a string cannot fail.
    let mut line = |text: std::fmt::Arguments<'_>| {
        let _ = writeln!(out, "{text}");
    };
    for (key, value) in facts(curve) {
        line(format_args!("# {key}: {value}"));
    }
    for warning in &curve.warnings {
        line(format_args!("# warning: {}", warning.message.replace('\n', " ")));
    }
    let band = curve.force_low_n.as_ref().zip(curve.force_high_n.as_ref());
    line(format_args!("d_{length},force_{force}{}", if band.is_some() { ",lo,hi" } else { "" }));
    let shown = |force_n: f64| nine_digits(force_n / units.force());
    for (i, (d, f)) in curve.deflection_m.iter().zip(&curve.force_n).enumerate() {
        let edges = match band {
            Some((low, high)) => format!(",{},{}", shown(low[i]), shown(high[i])),
            None => String::new(),
        };
        line(format_args!("{},{}{edges}", nine_digits(d / units.length_m), shown(*f)));
    }
    Ok(out.into_bytes())
}
