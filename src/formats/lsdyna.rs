//! LS-DYNA `*DEFINE_CURVE_TITLE`: eight fields of 10, then points in two fields of 20.

use std::fmt::Write;

use super::{ExportError, Options, facts, headline, nine_digits};
use crate::surrogate::PredictedCurve;
use crate::unit::UnitSystem;

/// Columns of a title.
const TITLE_WIDTH: usize = 80;

pub fn write(curve: &PredictedCurve, options: &Options) -> Result<Vec<u8>, ExportError> {
    let units = options.units.or(curve.provenance.study_units).unwrap_or(UnitSystem::SI);
    let stiffness = units.force() / units.length_m;
    let mut out = String::new();
    // Writing to a string cannot fail.
    let mut line = |text: std::fmt::Arguments<'_>| {
        let _ = writeln!(out, "{text}");
    };
    line(format_args!("*KEYWORD"));
    line(format_args!(
        "$ units of the points: {units} (length {} m, force {} N)",
        nine_digits(units.length_m),
        nine_digits(units.force())
    ));
    line(format_args!(
        "$ unloading stiffness in these units: {}",
        nine_digits(curve.unloading_stiffness_n_per_m / stiffness)
    ));
    for (key, value) in facts(curve) {
        line(format_args!("$ {key}: {value}"));
    }
    line(format_args!("*DEFINE_CURVE_TITLE"));
    line(format_args!("{}", title(&headline(curve))));
    line(format_args!(
        "$#    lcid      sidr       sfa       sfo      offa      offo    dattyp     lcint"
    ));
    line(format_args!(
        "{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}",
        options.id,
        0,
        "1.0",
        "1.0",
        "0.0",
        "0.0",
        0,
        discretisation(curve.deflection_m.len())
    ));
    line(format_args!("$#                a1                  o1"));
    for (d, f) in curve.deflection_m.iter().zip(&curve.force_n) {
        line(format_args!(
            "{:>20}{:>20}",
            nine_digits(d / units.length_m),
            nine_digits(f / units.force())
        ));
    }
    line(format_args!("*END"));
    Ok(out.into_bytes())
}

/// LS-DYNA resamples a curve to LCINT even points, 100 by default: a curve with more would
/// lose its peaks. Predicted curves are even, so as many points keep every one.
fn discretisation(points: usize) -> usize {
    if points > 100 { points } else { 0 }
}

/// A title that fits its line; LS-DYNA reads ASCII.
fn title(text: &str) -> String {
    // A line that began with * or $ would be a keyword or a comment.
    text.trim_start_matches(['*', '$', ' '])
        .chars()
        .map(|c| if c.is_ascii_graphic() { c } else { ' ' })
        .take(TITLE_WIDTH)
        .collect()
}
